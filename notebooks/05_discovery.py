# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Seven systems, from videos to equations
#
# In this notebook, we present the main result: seven chaotic systems, each discovered from three
# videos with only the first camera calibrated, and scored as in the paper.
#
# **What you will see**
#
# * the systems as data, in two frames of reference;
# * the equations found, term by term with standard errors, beside the truth;
# * the discovered laws set in motion, and for how long their forecasts hold;
# * the same from whole pixels, as in the paper;
# * PySINDy, E-SINDy, WeakSINDy and Model-A on the same trajectories.
#
# **What you need**: the [tour](00_tour.ipynb); how the law is found is the subject of
# [notebook 04](04_spline_ado.ipynb).
#
# **Covers** Table 1, Fig. 2, Tables S1-S3.

# %% tags=["parameters"]
profile: str = "full"  # full or quick
seed: int = 0  # of the scenes in the videos
jobs: int = 2  # systems at a time

# %%
import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Math, display

from vidsindy_lite import discover, learn_cameras, plots, reconstruct, score
from vidsindy_lite.artifacts import save_figure, save_table
from vidsindy_lite.baselines import BASELINES
from vidsindy_lite.experiments import discover_films
from vidsindy_lite.systems import REFERENCE_OFFSET, SYSTEMS

plt.style.use("vidsindy_lite.vidsindy")
names = {"full": tuple(SYSTEMS), "quick": ("SprottE", "WangSun")}[profile]
frames = {"full": 1500, "quick": 400}[profile]

# %% [markdown]
# ## The systems (Table S1)
#
# A system is a table of coefficients, with an initial condition and a characteristic period. Here
# they are in their native frame, as textbooks have them.

# %%
for name, system in SYSTEMS.items():
    display(Math(rf"\textbf{{{name}}}\qquad {system.latex()}"))

# %% [markdown]
# The paper scores all laws in its "predefined reference coordinate system", and never says where that
# is. Its ground truths tell: they are the native laws seen from an origin shifted by **(10, 10, 0)**.
# A shifted polynomial is a polynomial, with more terms:
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
# ## Discovery
#
# `discover_films` does for each system what the tour did for one: film it with three cameras against
# random backgrounds, forget the calibration of cameras 2 and 3, track, learn the cameras,
# reconstruct, discover. Nothing is chosen by system.

# %%
results = discover_films(names, frames, seed, jobs)

# %% [markdown]
# The paper's numbers (Table 1 and S3), to stand beside ours: relative $\ell_2$ error in $10^{-2}$,
# and false positives.

# %%
columns = ("Lorenz", "SprottE", "RayleighBenard", "SprottF", "NoseHoover", "Tsucs2", "WangSun")
paper_l2 = {
    "ours": (1.50, 0.15, 2.00, 0.16, 6.22, 5.39, 0.16),
    "PySINDy": (4.17, 3.48, 2.74, 7.51, 824.44, 12.29, 856.47),
    "E-SINDy": (4.17, 3.26, 2.74, 7.52, 824.44, 12.29, 863.42),
    "WeakSINDy": (2.02, 93.06, 84.66, 12.70, 12.71, 83.52, 9.56),
}
paper_false = {
    "ours": (1, 0, 1, 0, 0, 1, 1), "PySINDy": (1, 3, 2, 1, 3, 1, 3),
    "E-SINDy": (1, 1, 2, 1, 3, 1, 3), "WeakSINDy": (1, 6, 9, 6, 10, 2, 0),
}  # fmt: skip
paper_l2, paper_false = (
    {method: dict(zip(columns, values, strict=True)) for method, values in table.items()}
    for table in (paper_l2, paper_false)
)

# %%
rows = [
    result.row()
    | {
        "paper: false positives": paper_false["ours"][result.name],
        "paper: l2 (e-2)": paper_l2["ours"][result.name],
    }
    for result in results
]
caption = "Seven systems from videos, scored in the reference frame, beside the paper's numbers."
save_table("table_systems", rows, caption=caption)

# %%
for result in results:
    assert result.score.exact, f"{result.name}: terms are wrong"
    assert result.score.l2 <= 0.5e-2, f"{result.name}: l2 is {result.score.l2:.2e}"

# %% [markdown]
# All terms, no false one, and errors far below those of the paper. Where do they come from? These
# videos are clean and lossless, and the tracker reads them to a thousandth of a pixel:

# %%
for result in results:
    pixels = ", ".join(f"{error:.4f}" for error in result.pixel_error)
    space = ", ".join(f"{error:.1e}" for error in result.position_error)
    print(f"{result.name:15} pixels off by {pixels} px; path by {space} scene units (rms)")
    assert max(result.pixel_error) < 0.1

# %% [markdown]
# ## The equations (Table S2)
#
# Each law as it was found, with standard errors, and the truth in the same frame.

# %%
for result in results:
    print(f"{result.name}, found:\n{result.found.equations()}")
    print(f"truth:\n{result.truth.text()}\n")

# %% [markdown]
# In the native frame the laws are shorter. The offset was found, too, and counts as up to three
# unknowns more; along z it is zero, because a shift there would not have saved a term.

# %%
for result in results:
    offset = ", ".join(f"{value:.6f}" for value in result.found.offset)
    print(f"{result.name}, offset ({offset}):\n{result.found.equations('native')}")
    print(f"truth, offset {REFERENCE_OFFSET}:\n{SYSTEMS[result.name].text()}\n")
    assert np.allclose(result.found.offset, REFERENCE_OFFSET, atol=1e-2)


# %% [markdown]
# Are the standard errors to be trusted? If so, the distance of a coefficient from the truth is about
# one standard error, and beyond two in few cases.


# %%
def pulls(result):
    found, true = result.found, result.truth
    rows = [found.terms.index(term) for term in true.terms]
    errors = found.standard_errors[rows][true.support]
    return (found.coefficients[rows] - true.coefficients)[true.support] / errors


pulled = {result.name: pulls(result) for result in results}
every = np.concatenate(list(pulled.values()))
print(f"{len(every)} coefficients, {np.mean(np.abs(every) < 2):.0%} within two standard errors")
assert np.mean(np.abs(every) < 2) > 0.7

# %%
fig = plots.plot_pulls(pulled)
caption = "Errors of all coefficients in units of their standard errors; grey: two of them."
save_figure("discovery_pulls", fig, caption=caption, numbers=pulled)

# %% [markdown]
# *Each point is one coefficient in the reference frame: its distance from the truth in standard
# errors. Those of one system stray together, since they share one path and one offset.*

# %%
rows = [
    {
        "system": result.name, "equation": f"d{result.truth.names[equation]}/dt", "term": term,
        "truth": result.truth.coefficients[result.truth.terms.index(term), equation],
        "found": result.found.coefficients[row, equation],
        "standard error": result.found.standard_errors[row, equation],
    }
    for result in results
    for equation in range(3)
    for row, term in enumerate(result.found.terms)
    if result.found.coefficients[row, equation]
]  # fmt: skip
caption = "Every discovered term in the reference frame, with its standard error, and the truth."
table = save_table("table_S2", rows, caption=caption)
print(len(table.rows), "terms, stored as table_S2")

# %% [markdown]
# ## The laws in motion (Fig. 2)
#
# A law is more than its coefficients: let it run. We start each discovered law at the first point of
# its curve and the truth at its initial condition. The systems are chaotic, and any error grows
# exponentially; a forecast counts as good until the distance exceeds a tenth of the spread of the
# motion.


# %%
def forecast(result, periods=40, rate=400):
    t = result.truth.times(periods * rate, rate)
    truth = result.truth.simulate(t, result.truth.x0)
    found = result.found.system.simulate(t, result.found.curve(t[:1])[0])
    near = np.linalg.norm(found - truth, axis=1) < 0.1 * truth.std(axis=0).max()
    good = len(t) if near.all() else np.argmin(near)
    return truth[:good], found[:good]


forecasts = {result.name: forecast(result) for result in results}

# %%
rows = [
    {"system": name, "forecast good for (periods)": len(truth) / 400}
    for name, (truth, _) in forecasts.items()
]
assert all(row["forecast good for (periods)"] > 4 for row in rows)
caption = f"Forecast from the first frame, at most 40 periods; the videos last {frames / 100:g}."
save_table("discovery_forecast", rows, caption=caption)

# %%
shown = {name: (truth[:6000], found[:6000]) for name, (truth, found) in forecasts.items()}
fig = plots.plot_attractors(shown)
caption = "The discovered laws (blue) on the true motions (grey), as long as the forecast is good."
numbers = {name: {"truth": a[::20], "discovered": b[::20]} for name, (a, b) in shown.items()}
save_figure("fig_2", fig, caption=caption, numbers=numbers)

# %% [markdown]
# *Fig. 2: each discovered law (blue) on the true motion (grey), from the first frame for as long as
# the forecast is good, at most 15 periods.*

# %% [markdown]
# ## Whole pixels
#
# A thousandth of a pixel is a luxury of these videos. The paper says that "camera pixels can only
# take approximate integer values", so let us throw away the digits behind the point: the same tracks,
# rounded to whole pixels; cameras and path learned anew.


# %%
def from_whole_pixels(result):
    tracks = [np.round(track) for track in result.found.tracks]
    return reconstruct(tracks, learn_cameras(tracks, result.found.rig.uncalibrated(keep=0)))


paths = {result.name: from_whole_pixels(result) for result in results}
coarse = {r.name: discover(r.found.t, paths[r.name]) for r in results}

# %%
rows = []
for result in results:
    scored = score(coarse[result.name], result.truth)
    rows.append({
        "system": result.name,
        "false positives": scored.false_positives,
        "missing": scored.missing,
        "l2 (e-2)": 100 * scored.l2,
        "worst coefficient (%)": 100 * scored.max_coefficient_error,
        "warnings": len(coarse[result.name].warnings),
        "paper: l2 (e-2)": paper_l2["ours"][result.name],
    })  # fmt: skip
    assert scored.exact, result.name
    assert scored.l2 <= 0.5e-2, result.name
save_table("discovery_whole_pixels", rows, caption="The same from tracks rounded to whole pixels.")

# %% [markdown]
# The errors are a hundred times larger than before and still well below the paper's, and the terms are
# still right.
#
# ## Other methods on the same trajectories (Table 1, Table S3)
#
# Each method of the paper's tables gets the same reconstructed path, as tracked and from whole
# pixels, in the reference frame, with the same 20 candidate terms. The paper names no thresholds;
# here each method chooses its own on the last fifth of the record, without the truth
# (`vidsindy_lite/baselines.py`).

# %%
laws = {("ours", "as tracked"): {r.name: r.found.system for r in results}}
laws["ours", "whole pixels"] = {name: law.system for name, law in coarse.items()}
for method, fit in BASELINES.items():
    laws[method, "as tracked"] = {r.name: fit(r.found.t, r.found.x) for r in results}
    laws[method, "whole pixels"] = {r.name: fit(r.found.t, paths[r.name]) for r in results}

# %%
truths = {result.name: result.truth for result in results}
scores = {
    key: {name: score(law, truths[name]) for name, law in by_system.items()}
    for key, by_system in laws.items()
}


# %%
def table_of(methods):
    return [
        {
            "system": name, "method": method, "tracks": tracks,
            "terms found": "yes" if scored.terms_found else "no",
            "false positives": scored.false_positives, "l2 (e-2)": 100 * scored.l2,
            "precision (%)": 100 * scored.precision, "recall (%)": 100 * scored.recall,
            "paper: false positives": paper_false.get(method, {}).get(name),
            "paper: l2 (e-2)": paper_l2.get(method, {}).get(name),
        }
        for name in names
        for (method, tracks), by_system in scores.items()
        for scored in [by_system[name]]
        if method in methods
    ]  # fmt: skip


# %%
caption = "Ours and PySINDy on the same trajectories, as tracked and from whole pixels."
save_table("table_1", table_of(("ours", "PySINDy")), caption=caption)

# %%
caption = "E-SINDy, WeakSINDy and Model-A on the same trajectories."
save_table("table_S3", table_of(("E-SINDy", "WeakSINDy", "Model-A")), caption=caption)

# %%
fig = plots.plot_methods(scores)
caption = "Relative error of each method on each system; open symbols: the terms are wrong."
numbers = {
    f"{method}, {tracks}": {name: scored.l2 for name, scored in by_system.items()}
    for (method, tracks), by_system in scores.items()
}
save_figure("discovery_methods", fig, caption=caption, numbers=numbers)

# %% [markdown]
# *Relative error of each method. From exact paths (left), PySINDy and E-SINDy err by a percent and
# more: that is what their finite differences cost. Splines and integrals do better. From whole pixels
# (right) all errors grow, and open symbols show where a term was lost or a false one found. The weak
# form depends on its random windows; this is one draw.*

# %%
for tracks in ("as tracked", "whole pixels"):
    for method in ("ours", *BASELINES):
        exact = sum(scored.exact for scored in scores[method, tracks].values())
        print(f"{tracks:12}  {method:10} exact terms in {exact} of {len(names)}")
for method in BASELINES:
    theirs, ours = (scores[key, "whole pixels"] for key in (method, "ours"))
    assert np.mean([theirs[n].l2 for n in names]) > np.mean([ours[n].l2 for n in names]), method

# %% [markdown]
# ## What we learned
#
# * Seven systems, one call, nothing chosen by hand: all true terms, no false one, from three videos
#   with one calibrated camera. From clean videos the relative error is of the order of $10^{-6}$,
#   from whole pixels of $10^{-4}$.
# * The offset of the reference frame was not given and is found with the law.
# * The standard errors are what they claim to be: nine of ten coefficients lie within two of them.
# * With paths as exact as these, other methods find most laws as well. What sets them apart is
#   noise, of which whole pixels are a first taste.
#
# **What the paper says and what we found.**
#
# * The paper's errors are 0.15 to 6.22 (in $10^{-2}$) with four false positives in seven systems;
#   here they are below 0.02 even from whole pixels, with none. The paper averages five trials; clean
#   videos differ in nothing but their scenes, so one is shown.
# * PySINDy's 824 % (NoseHoover) and 856 % (WangSun) are coefficients ten times too large throughout:
#   a time step wrong by that factor. With the right step they are 1 to 15 % here.
# * "Nine datasets" are seven, and the paper's frame of reference has to be guessed from its own
#   ground truths.
#
# How far noise and too few samples can be carried is the end of [notebook 04](04_spline_ado.ipynb).

# %% [markdown]
# ## Exercises
#
# **1.** The paper's law for Tsucs2 has 0.63 in place of 1 as the coefficient of x in dy/dt. How much
# of this does the relative $\ell_2$ error show?
#
# <details><summary>Solution</summary>
#
# ```python
# from dataclasses import replace
#
# truth = SYSTEMS["Tsucs2"].shift(REFERENCE_OFFSET)
# wrong = truth.coefficients.copy()
# wrong[truth.terms.index("x"), 1] = 0.63
# scored = score(replace(truth, coefficients=wrong), truth)
# print(scored.l2, scored.max_coefficient_error)
# ```
#
# Hardly anything: $\ell_2$ is 0.0017, although the coefficient is wrong by 37 %. The constant 210
# that the shift creates dominates the norm. Hence the column "worst coefficient".
# </details>
#
# **2.** Add noise of 5 % to the path of the first system and compare the methods again.
#
# <details><summary>Solution</summary>
#
# ```python
# from vidsindy_lite.corruption import add_noise
#
# first = results[0]
# x = add_noise(first.found.x, 0.05, np.random.default_rng(0))
# for method, fit in {"ours": discover, **BASELINES}.items():
#     scored = score(fit(first.found.t, x), first.truth)
#     print(method, scored.exact, scored.l2)
# ```
#
# For Lorenz and 1,500 frames, ours and Model-A keep exactly the true terms, with errors of 0.2 % and
# 0.9 %; PySINDy and E-SINDy find one false term, and WeakSINDy misses three.
# </details>
