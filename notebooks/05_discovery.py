# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#       jupytext_version: 1.19.6
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Seven systems, from videos to equations
#
# In this notebook, we present the main result: seven systems, each discovered from three videos with
# only the first camera calibrated, by six methods from the same tracks, and scored as in the paper.
#
# **What you will see**
#
# * the systems as data, in two frames of reference;
# * the equations found, term by term with standard errors, beside the truth;
# * the discovered laws set in motion, and for how long their forecasts hold;
# * the paper's own optimiser, **spline-ADO**, beside **Gauss-Newton**, which this package uses for the same model,
#   and beside PySINDy, E-SINDy, WeakSINDy and Model-A;
# * all of it from a learned detector's tracks in whole pixels, which is the paper's regime, with sub-pixel tracks as
#   what a better tracker gives.
#
# **Afterwards you can** read the paper's main tables, and compare methods on equal terms.
#
# **What you need**: the [tour](00_tour.ipynb); how the law is found is the subject of
# [notebook 04](04_spline_ado.ipynb).
#
# **Covers** Table 1, Fig. 2, Tables S1-S3.

# %% tags=["parameters"]
profile: str = "full"  # full or quick
seed: int = 0  # number of the first trial: seeds the scenes in the videos
jobs: int = 2  # films or trials at a time

# %%
from dataclasses import replace
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from IPython.display import Math, display

from vidsindy_lite import discover, observe
from vidsindy_lite.companion.artifacts import save_figure, save_table, versions
from vidsindy_lite.study import (
    LEAST,
    METHODS,
    REFERENCE_OFFSET,
    SCORES,
    SYSTEMS,
    FilmTask,
    Trial,
    baselines,
    film,
    grid,
    plots,
    rate,
    run_film,
    run_trial,
    run_trials,
    score,
    significant,
    summary,
    sweep,
    tabulate,
    trial_path,
)

# %%
plt.style.use("vidsindy_lite.study.plots.vidsindy")
full = profile == "full"
names = tuple(SYSTEMS) if full else ("Lorenz",)
frames = 1500 if full else 300
trials = range(seed, seed + (5 if full else 1))

# %% [markdown]
# ## The systems (Table S1)
#
# A system is a table of coefficients, with an initial condition and a characteristic period. Here
# they are in their native frame, as textbooks have them.

# %%
for name, system in SYSTEMS.items():
    display(Math(rf"\textbf{{{name}}}\qquad {system.latex()}"))

# %% [markdown]
# The paper scores all laws in its "predefined reference coordinate system", and never says where
# that is. Its ground truths tell: they are the native laws seen from an origin shifted by
# **(10, 10, 0)**. A shifted polynomial is a polynomial, with more terms:
# $\dot{\mathbf x}=\mathbf f(\mathbf x-\boldsymbol\Delta)$, multiplied out. No ground truth below
# was typed; each follows from Table S1 by this shift.

# %%
rows = [
    {
        "system": name,
        "native law": "; ".join(system.text().splitlines()),
        "initial condition": str(system.x0),
        "period": system.period,
        "terms, native": int(system.support.sum()),
        "terms, reference": int(system.shift(REFERENCE_OFFSET).support.sum()),
    }
    for name, system in SYSTEMS.items()
]
assert [row["terms, reference"] for row in rows] == [12, 8, 11, 10, 9, 15, 14]
save_table("table_S1", rows, caption="The seven systems; initial conditions in the native frame.")

# %% [markdown]
# ## From videos to paths
#
# One trial by hand, with fewer frames: film a system with three cameras against random backgrounds, forget the
# calibration of cameras 2 and 3, and `observe`: track, learn the cameras, reconstruct.
# Then find the law, and score it.

# %%
with TemporaryDirectory() as folder:
    shot = film("Lorenz", folder, frames=150, seed=seed)
    seen = observe(shot.paths, shot.rig.uncalibrated(keep=0), shot.t, lags=(0, 0, 0))
law = discover(seen.t, seen.x, systematic=seen.systematic, order=1)
print(law.equations(), score(law, shot.truth), sep="\n\n")
assert score(law, shot.truth).exact
by_package = run_trial(Trial("Lorenz", trial=seed, source="sub-pixel", frames=150))
assert np.allclose(by_package.law.coefficients, law.system.coefficients, rtol=1e-6)

# %% [markdown]
# That is all that happens in a trial. Its number is the seed of target and backgrounds; the motion is always the same.
# Nothing is chosen by system. Here are the films of all trials:

# %%
films = sweep(run_film, [FilmTask(name, n, frames) for name in names for n in trials], jobs=jobs)

# %% [markdown]
# ## Discovery, by six methods (Tables 1 and S3)
#
# "Camera pixels can only take approximate integer values", says the paper, and it tracks with a detector that sees
# one frame at a time. So this is the regime of all main numbers: tracks of our **learned detector**, rounded to whole pixels,
# cameras and path learned from them. It is off by some tenths of a pixel, by other amounts at other places. (To spare time it
# looks in a square of 64 px around the target, along the grid of its anchors; what it says there is what it says in the whole
# frame, to one to three tenths of a pixel.)
#
# `track` is more exact: its **sub-pixel** tracks are read to a thousandth of a pixel from clean and lossless
# videos. What a method makes of those is of no use in a comparison with the paper, and says what the tracker costs.
#
# All methods get the same paths in the reference frame, and the same 20 candidate terms:
#
# * **spline-ADO** is the paper's method with the paper's optimiser: gradient descent on spline, coefficients and offset,
#   alternating with STRidge ([notebook 04](04_spline_ado.ipynb)). Unlike in the paper, the law is not asked for inside of gaps,
#   where the first curve is a guess that spoils it. The paper does not print its two weights; one pair for all
#   systems and conditions is chosen on samples that were held out ([notebook 06](06_robustness_and_ablation.ipynb));
# * **Gauss-Newton** is `discover`: the same model and the same losses, with another optimiser and another choice of terms;
# * the others stand in the paper's tables. Here are their settings.

# %%
common = {"ridge": f"{baselines.RIDGE:g}", "pysindy's default ridge": "0.05"}
rows = [
    {"method": "PySINDy", "derivatives": "central differences", "fit": "STLSQ", **common},
    {"method": "E-SINDy", "derivatives": "central differences",
     "fit": "median of 20 STLSQ on resampled rows", **common},
    {"method": "WeakSINDy", "derivatives": f"none: {baselines.WEAK_WINDOWS} windows of "
     f"{100 * baselines.WEAK_WIDTH:g} % of the record", "fit": "STLSQ", **common},
    {"method": "Model-A", "derivatives": "cubic spline, smoothed by cross-validation",
     "fit": "STLSQ", **common},
]  # fmt: skip
caption = "Settings of the baselines; everything else is pysindy's default."
save_table("table_baselines", rows, caption=caption)

# %% [markdown]
# The paper names no thresholds. Here each baseline chooses its own without the truth: fitted to the
# first part of the record with every threshold of a grid, judged by the rest, and of the good ones
# the largest wins. But the tolerance of that choice, the ridge and the width of the windows were
# picked among several **by their scores on these very systems**, with the truth at hand. That
# favours the baselines. (The defaults of Gauss-Newton were made with these systems in view as well;
# it has no setting that a user would turn.)

# %%
print(f"thresholds: {baselines.THRESHOLDS[0]:g} to {baselines.THRESHOLDS[-1]:g}, "
      f"{len(baselines.THRESHOLDS)} values; fitted to the first {baselines.TRAINING:.0%}; "
      f"as good as the best: up to {baselines.TOLERANCE:g} times its error")  # fmt: skip

# %%
clean = {"clean": (0,)}
results, bound = (
    tabulate(run_trials(grid(names, clean, trials, METHODS, frames, source), jobs=jobs, desc=source))
    for source in ("detector", "sub-pixel")
)


# %% [markdown]
# In the paper's units and beside its numbers. "Exact" counts the trials with all true terms and no others, "wrong terms" are
# the missing and the false ones trial by trial; errors are the median, the least and the most of the trials. Gauss-Newton alone
# says whether it doubts its law: how many exact laws it doubts and how many wrong ones it does not.

# %%
def beside_paper(table, methods):
    rows = summary(results[results.method.isin(methods)], ["system", "method"])
    best = summary(bound[bound.method.isin(methods)], ["system", "method"])
    rows["sub-pixel: l2 (e-2)"] = best["l2 (e-2)"]
    printed_as = rows.method.replace(["Gauss-Newton", "spline-ADO"], "Ours")
    printed = [SCORES.get((table, *key)) for key in zip(printed_as, rows.system, strict=True)]
    rows["paper: false positives"] = pd.array([p and p.false_positives for p in printed], "object")
    rows["paper: l2 (e-2)"] = [p and 100 * p.l2 for p in printed]
    return rows


errors = dict.fromkeys(["l2 (e-2)", "least", "most", "sub-pixel: l2 (e-2)"], 0.2)
caption = f"From the detector's tracks in whole pixels, {len(trials)} trials; sub-pixel: from sub-pixel tracks; 0.001 is 0.001 or less."
table_1 = beside_paper("Table 1", ("Gauss-Newton", "spline-ADO", "PySINDy"))
save_table("table_1", table_1.to_dict("records"), caption=caption, tolerance=errors)

# %%
table_S3 = beside_paper("Table S3", [method for method in METHODS if method != "PySINDy"])
save_table("table_S3", table_S3.to_dict("records"), caption=caption, tolerance=errors)

# %% [markdown]
# How often is the law exact, from whole pixels and from sub-pixel tracks?

# %%
both = pd.concat((results, bound))
counts = both.groupby(["source", "method"], sort=False).exact.agg(rate).unstack(sort=False)
print(counts.to_string())
right = both.groupby(["source", "method"], sort=False).exact.mean()
middle = results.groupby("method").l2.median()
both_optimisers = ("Gauss-Newton", "spline-ADO")
ado = table_1[table_1.method == "spline-ADO"].set_index("system")
plain = table_1[table_1.method == "PySINDy"].set_index("system")["l2 (e-2)"]
assert right["sub-pixel", "Gauss-Newton"] == 1
ours = results[results.method == "Gauss-Newton"]

# %%
if full:
    assert right["sub-pixel", "spline-ADO"] == 1
    assert right["detector", "Gauss-Newton"] >= 0.9
    assert right["detector", "spline-ADO"] >= 0.75
    assert middle[list(both_optimisers)].max() < 2e-3
    assert middle["spline-ADO"] < 3 * middle["Gauss-Newton"] > middle["Model-A"] / 5
    assert 0.25 < (ours[ours.exact].status == "suspect").mean() < 0.5
    assert middle["PySINDy"] > 5 * middle["spline-ADO"]
    assert (ado["l2 (e-2)"] < ado["paper: l2 (e-2)"]).all()
    assert (plain[["NoseHoover", "WangSun"]] < 20).all()

# %% [markdown]
# **The paper's method works.** From sub-pixel tracks both optimisers of its model find every law in every trial. From whole
# pixels Gauss-Newton is cautious: it doubts about two of five exact laws. Here is one picture of all methods, from both kinds of tracks:

# %%
pictured = both[both.trial == seed]

# %% jupyter={"source_hidden": true} tags=["hide-input"]
sources, methods = pictured.source.unique(), pictured.method.unique()
fig, panels = plt.subplots(1, len(sources), figsize=(10.5, 4.4), sharey=True)
for axes, source in zip(panels, sources, strict=True):
    for k, method in enumerate(methods):
        part = pictured[(pictured.source == source) & (pictured.method == method)]
        place = np.arange(len(part)) + 0.13 * (k - (len(methods) - 1) / 2)
        style = plots.METHOD_STYLES[method] | {"ms": 8, "mew": 1.5, "ls": ""}
        at = part.exact.to_numpy()
        axes.plot(place[at], 100 * part.l2[at], **style)
        axes.plot(place[~at], 100 * part.l2[~at], mfc="white", **style)
        axes.plot([], [], label=method, **style)
    axes.set(title=source, yscale="log")
    axes.set_xticks(range(len(part)), part.system, rotation=35, ha="right")
    axes.grid(axis="x", visible=False)
panels[0].plot([], [], "o", ms=8, color="0.4", mfc="white", mew=1.5, label="open: wrong terms")
panels[0].set_ylabel(r"relative $\ell_2$ error (%)")
fig.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=len(methods) + 1)
caption = "Relative error of each method on each system, one trial; open symbols: the terms are wrong."
numbers = {
    f"{method}, {source}": {
        name: significant(l2, 3, LEAST) for name, l2 in zip(g.system, g.l2, strict=True)
    }
    for (source, method), g in pictured.groupby(["source", "method"], sort=False)
}
save_figure("discovery_methods", fig, caption=caption, numbers=numbers, tolerance=0.2)

# %% [markdown]
# *Relative error of each method in the first trial, from whole pixels (left) and from sub-pixel tracks (right); open symbols
# show where a term was lost or a false one found. The weak form depends on its random windows; this is one draw.*

# %%
rows = []
for name, mine in ours.groupby("system", sort=False):
    shots = [film for film in films if film.truth.name == name]
    off = [np.sqrt(np.nanmean(np.sum((np.round(d) - t) ** 2, axis=1)))
           for f in shots for d, t in zip(f.detected, f.tracks, strict=True)]  # fmt: skip
    rows.append({
        "system": name, "exact": rate(mine.exact), "l2 (e-2)": significant(100 * mine.l2.median()),
        "worst coefficient (%)": significant(100 * mine.max_coefficient_error.median()),
        "detector (px)": significant(np.median(off)),
        "track (px)": significant(np.median([film.pixel_error for film in shots])),
        "seconds": np.median([film.seconds for film in shots]) + mine.seconds.median(),
    })  # fmt: skip

# %%
caption = f"Gauss-Newton from the detector's whole pixels, and errors (rms) of both trackers; medians of {len(trials)} trials."
loose = dict.fromkeys(["l2 (e-2)", "worst coefficient (%)", "detector (px)", "track (px)"], 0.2)
save_table("table_systems", rows, caption=caption, tolerance=loose)

# %%
assert max(max(film.pixel_error) for film in films) < 0.1
assert all(row["detector (px)"] > 4 * row["track (px)"] for row in rows)

# %% [markdown]
# ## The equations (Table S2)
#
# The laws of the first trial, from whole pixels: Gauss-Newton's with standard errors, spline-ADO's, and the truth in the same
# frame.

# %%
first = {film.truth.name: film for film in films if film.task.trial == seed}
paths = {name: trial_path(Trial(name, trial=seed, frames=frames)) for name in names}
found = {
    name: discover(path.t, path.x, systematic=path.systematic, order=1) for name, path in paths.items()
}
by_gradients = results[(results.method == "spline-ADO") & (results.trial == seed)].set_index("system").law
for name, law in found.items():
    print(f"{name}, Gauss-Newton:\n{law.equations()}")
    print(f"spline-ADO:\n{by_gradients[name].text()}")
    print(f"truth:\n{first[name].truth.text()}\n")

# %% [markdown]
# In the native frame the laws are shorter. The offset was found, too, and counts as up to three
# unknowns more; along z it is zero, because a shift there would not have saved a term.

# %%
for name, law in found.items():
    offset = ", ".join(f"{value:.6f}" for value in law.offset)
    print(f"{name}, offset ({offset}):\n{law.equations('native')}")
    print(f"truth, offset {REFERENCE_OFFSET}:\n{SYSTEMS[name].text()}\n")
    assert np.allclose(law.offset, REFERENCE_OFFSET, atol=0.3)

# %% [markdown]
# Are the standard errors to be trusted? If so, the distance of a coefficient from the truth is
# about one standard error, and beyond two in few cases.

# %%
pulled = {n: np.concatenate(list(group)) for n, group in ours.groupby("system", sort=False).pulls}
every = np.concatenate(list(pulled.values()))
within = {name: np.mean(np.abs(group) < 2) for name, group in pulled.items()}
print(f"{len(every)} coefficients, {np.mean(np.abs(every) < 2):.0%} within two standard errors")
print("by system:", ", ".join(f"{name} {share:.0%}" for name, share in within.items()))
if full:
    assert 0.9 < np.mean(np.abs(every) < 2) < 0.98
    assert min(within.values()) < 0.9 < 0.99 < max(within.values())

# %% jupyter={"source_hidden": true} tags=["hide-input"]
fig, axes = plt.subplots(figsize=(8, 3.8))
axes.axhspan(-2, 2, color="0.92")
axes.axhline(0, color="k", lw=0.8)
for column, values in enumerate(pulled.values()):
    axes.plot(column + np.linspace(-0.25, 0.25, len(values)), values, "oC0", ms=4)
axes.set_xticks(range(len(pulled)), list(pulled), rotation=20)
axes.set_ylabel("error / standard error")
axes.grid(axis="x", visible=False)
caption = "Errors of all coefficients in units of their standard errors; grey: two of them."
save_figure("discovery_pulls", fig, caption=caption, numbers=pulled, tolerance=0.1)


# %% [markdown]
# *Each point is one coefficient in the reference frame: its distance from the truth in standard
# errors, all trials (grey: up to two). Those of one trial stray together, since they share one path and one offset.*

# %%
def by_term(law):
    """Coefficients of a law by equation and term."""
    return {
        (f"d{name}/dt", term): law.coefficients[row, k]
        for k, name in enumerate("xyz")
        for row, term in enumerate(law.terms)
        if law.coefficients[row, k]
    }


# %%
rows = []
for name, law in found.items():
    true, newton, ado = map(by_term, (first[name].truth, law.system, by_gradients[name]))
    spread = by_term(replace(law.system, coefficients=law.standard_errors))
    rows += [
        {"system": name, "equation": key[0], "term": key[1], "truth": true.get(key),
         "Gauss-Newton": newton.get(key), "standard error": newton.get(key) and spread.get(key),
         "spline-ADO": ado.get(key)}
        for key in sorted({*true, *newton, *ado}, key=lambda key: (key[0], len(key[1]), key[1]))
    ]  # fmt: skip

# %%
caption = "Every term of the laws of the first trial and of the truth, in the reference frame; empty: the term is not in the law."
save_table("table_S2", rows, caption=caption, tolerance={"Gauss-Newton": 0.02, "spline-ADO": 0.02, "standard error": 0.2})
print(len(rows), "terms, stored as table_S2")

# %% [markdown]
# ## The laws in motion (Fig. 2)
#
# A law is more than its coefficients: let it run. We start each discovered law at the first point
# of its curve and the truth at its initial condition. Where a motion is chaotic a small error grows
# exponentially (NoseHoover and Tsucs2 are not chaotic from the paper's starts, see [notebook 02](02_videos_and_tracking.ipynb)); a forecast counts as good until the distance exceeds a tenth of the motion's
# standard deviation (of the coordinate that moves most). A law should also hold where nobody filmed: so both start at other points, too, off the first one by a fifth of
# the standard deviation in each coordinate.

# %%
horizon = 40 if full else 10  # periods


def forecast(benchmark, law, start, begin, periods, rate):
    t = benchmark.times(periods * rate, rate)
    truth, motion = benchmark.simulate(t, start), law.system.simulate(t, begin)
    near = np.linalg.norm(motion - truth, axis=1) < 0.1 * truth.std(axis=0).max()
    good = len(t) if near.all() else np.argmin(near)
    return truth[:good], motion[:good]


forecasts = {
    name: forecast(first[name].truth, law, first[name].truth.x0, law.curve(paths[name].t[:1])[0], horizon, 400)
    for name, law in found.items()
}


# %%
def elsewhere(name, draw):
    truth = first[name].truth
    start = truth.x0 + 0.2 * first[name].x.std(axis=0) * np.random.default_rng([seed, draw]).normal(size=3)
    return len(forecast(truth, found[name], start, start, periods=10, rate=100)[0]) / 100


rows = [
    {
        "system": name, "forecast good for (periods)": len(truth) / 400,
        "from three other starts, least (at most 10)": min(elsewhere(name, draw) for draw in range(3)),
    }
    for name, (truth, _) in forecasts.items()
]  # fmt: skip
if full:
    assert all(row["forecast good for (periods)"] > 1 for row in rows)
    assert all(row["from three other starts, least (at most 10)"] > 0.5 for row in rows)

# %%
caption = f"Forecast from the first frame and from other points, at most {horizon} periods; the videos last {frames / 100:g}."
loose = dict.fromkeys(["forecast good for (periods)", "from three other starts, least (at most 10)"], 0.2)
save_table("discovery_forecast", rows, caption=caption, tolerance=loose)

# %%
shown = {name: (truth[:6000], found[:6000]) for name, (truth, found) in forecasts.items()}

# %% jupyter={"source_hidden": true} tags=["hide-input"]
fig, panels = plt.subplots(-(-len(shown) // 4), min(len(shown), 4), squeeze=False, subplot_kw=plots.SPACE)
fig.set_size_inches(3.1 * panels.shape[1], 3.3 * panels.shape[0] + 0.5)
for axes, (name, (truth, law)) in zip(panels.flat, shown.items(), strict=False):
    axes.plot(*truth.T, color="0.75", lw=3, label="truth")
    axes.plot(*law.T, color="C0", lw=0.8, label="discovered law")
    axes.set_title(name, loc="center")
    axes.set(xlabel="x", ylabel="y", zlabel="z")
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.labelpad = -4
    axes.set_box_aspect((1, 1, 1), zoom=0.9)  # cubes with few numbers; the legend has the unit
    axes.locator_params(nbins=4, integer=True)
    axes.tick_params(labelsize=8, pad=-2)
    axes.view_init(elev=20, azim=-60)
for axes in panels.flat[len(shown) :]:
    axes.remove()
handles = panels[0, 0].get_legend_handles_labels()
fig.legend(*handles, loc="outside upper center", ncols=2, title="x, y, z in scene units")
caption = "The discovered laws (blue) on the true motions (grey), as long as the forecast is good."
numbers = {name: {"truth": a[::20], "discovered": b[::20]} for name, (a, b) in shown.items()}
save_figure("fig_2", fig, caption=caption, numbers=numbers)

# %% [markdown]
# *Fig. 2: each discovered law (blue) on the true motion (grey), from the first frame for as long as
# the forecast is good, at most 15 periods.*

# %% [markdown]
# ## What we learned
#
# * **The paper's method works.** From whole pixels of a detector, nothing chosen by system, both optimisers of its model find
#   the terms of most laws, with errors of the order of $10^{-3}$; from the sub-pixel tracks of lossless videos they find all of them.
#   <!-- by: right["detector", "Gauss-Newton"] >= 0.9; right["detector", "spline-ADO"] >= 0.75; right["sub-pixel", "spline-ADO"] == 1; middle[list(both_optimisers)].max() < 2e-3 -->
# * The offset of the reference frame was not given and is found with the law.
#   <!-- by: np.allclose(law.offset, REFERENCE_OFFSET -->
# * Nineteen of twenty coefficients lie within two standard errors, as they should; by system fewer or more, for the errors of a
#   detector are not all told by the tracks.
#   <!-- by: 0.9 < np.mean(np.abs(every) < 2) < 0.98; min(within.values()) < 0.9 < 0.99 < max(within.values()) -->
# * On such tracks spline-ADO errs up to three times, Model-A up to five times as much as Gauss-Newton in the median. PySINDy and E-SINDy err by per
#   cents, which is what their finite differences cost. What sets the optimisers far apart is noise.
#   <!-- by: middle["spline-ADO"] < 3 * middle["Gauss-Newton"] > middle["Model-A"] / 5; middle["PySINDy"] > 5 * middle["spline-ADO"]; 06: noisy["Gauss-Newton"] > noisy.drop("Gauss-Newton").max() + 0.2 -->
#
# **What the paper says and what we found.**
#
# * The paper's errors are 0.15 to 6.22 (in $10^{-2}$) with four false positives in seven systems. From whole pixels the median of
#   spline-ADO is below the paper's error in every system, with a false term in some trials, of Tsucs2 in most. Trials differ in
#   nothing but their scenes, so that what makes them differ is the tracker.
#   <!-- by: (ado["l2 (e-2)"] < ado["paper: l2 (e-2)"]).all(); figure table_1 -->
# * PySINDy's 824 % (NoseHoover) and 856 % (WangSun) are coefficients about ten times too large,
#   nearly all of them: a time step wrong by that factor. With the right step the medians are below 20 % here.
#   <!-- by: 10b: 9 < medians[name] < 11; (plain[["NoseHoover", "WangSun"]] < 20).all(); figure table_1 -->
# * "Nine datasets" are seven, and the paper's frame of reference has to be guessed from its own
#   ground truths.
#   <!-- by: 10: len(SYSTEMS_S1) != DATASETS_CLAIMED; 10b: all(scored.exact for scored in ground.values()) -->
#
# How noise and gaps change this is [notebook 06](06_robustness_and_ablation.ipynb).

# %% [markdown]
# ## Exercises
#
# [Four exercises](exercises/05_discovery.ipynb), each with a blank cell and a check that says *right* or fails. Their
# [solutions](solutions/05_discovery.ipynb) lie apart.

# %% [markdown]
# ## Run time and versions
#
# All cells take about 20 minutes on two cores.

# %%
print(versions())
