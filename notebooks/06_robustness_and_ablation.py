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
# # Noise and missing data
#
# In this notebook, we add noise to what was seen in the videos or hide parts of it, and ask which method still
# finds the law, how well, and whether it knows.
#
# **What you will see**
#
# * error and wrong terms against noise, random blocks and fibers in the tracks, for all seven systems and six methods,
#   the paper's own optimiser (spline-ADO) among them;
# * how its two weights, which the paper does not print, are chosen without the truth;
# * noise and gaps in the path instead of the tracks, as a second protocol;
# * where Gauss-Newton fails, and what could have been known before;
# * whether error bars hold under noise, and whether a wrong law is flagged;
# * how little of all this is due to videos and cameras.
#
# **Afterwards you can** tell how much noise and how many gaps a law survives, and what limits it.
#
# **What you need**: [notebook 05](05_discovery.ipynb), of which this is the sequel.
#
# **Covers** Fig. 3, Figs. S4-S10, Table 2.

# %% tags=["parameters"]
profile: str = "full"  # full or quick
seed: int = 0  # number of the first trial: seeds films, noise, gaps
share: float = 0.1  # noise of the one trial by hand, over the spread of the path
jobs: int = 2  # trials at a time

# %%
from collections import Counter
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import seaborn as sns
from scipy.stats import halfnorm

from vidsindy_lite import discover, dynamics, observe_tracks
from vidsindy_lite.companion.artifacts import save_figure, save_table, versions
from vidsindy_lite.study import (
    ABLATION,
    LEAST,
    METHODS,
    REFERENCE_OFFSET,
    SYSTEMS,
    FilmTask,
    Trial,
    Weights,
    add_noise,
    by_condition,
    cramer_rao_bound,
    drop_fibers,
    grid,
    plots,
    rate,
    run_film,
    run_trial,
    run_trials,
    run_weights,
    significant,
    spline_ado,
    summary,
    sweep,
    tabulate,
    term_errors,
)

# %%
plt.style.use("vidsindy_lite.study.plots.vidsindy")
full = profile == "full"
systems = tuple(SYSTEMS) if full else ("SprottF",)
methods = METHODS if full else (*METHODS[:3], METHODS[-1])  # without ensembles, which take long
frames = 1500 if full else 200
trials = range(seed, seed + (5 if full else 1))

# %% [markdown]
# ## The paths, and how exact they are
#
# A trial begins with a film of its own: three videos with new backgrounds and a new target, from
# which the path is recovered as in [notebook 05](05_discovery.ipynb).

# %%
films = sweep(run_film, [FilmTask(s, n, frames) for s in systems for n in trials], jobs=jobs)
films_of = {s: [film for film in films if film.task.system == s] for s in systems}
path_error = {
    s: np.sqrt(np.mean([(film.path_error**2).sum() for film in shots]))
    for s, shots in films_of.items()
}

# %% [markdown]
# To the tracks, or to the path $\mathbf x$, we do one of three things, of the paper's kinds; what a level is relative to, it does not say:
#
# * **noise** of level $p$: $\tilde x_i = x_i + p\,\sigma_i\,\varepsilon$ with
#   $\varepsilon\sim N(0,1)$, where $\sigma_i$ is the standard deviation of coordinate $i$;
# * **random blocks**: gaps of 1 % of the record each, as many as make up the rate;
# * **fibers**: five gaps, as long as makes up the rate.
#
# A percentage of a standard deviation says little about the lengths, so here they
# are.

# %%
rows = []
for name in systems:
    sigma = 0.1 * np.std(films_of[name][0].x, axis=0)
    rows.append({
        "system": name,
        **{f"noise of 10 %, {axis}": value for axis, value in zip("xyz", sigma, strict=True)},
        "error of the path (rms)": path_error[name],
        "error / noise of 10 %": path_error[name] / np.linalg.norm(sigma),
    })  # fmt: skip
caption = "Standard deviation of the added noise and rms error of the paths, in scene units."
loose = dict.fromkeys(["error of the path (rms)", "error / noise of 10 %"], 0.2)
assert all(row["error / noise of 10 %"] < 0.02 for row in rows)
save_table("study_noise", rows, caption=caption, tolerance=loose)

# %% [markdown]
# These paths are those of sub-pixel tracks, and what tracking and cameras leave behind is a small fraction of the noise that
# follows; the last section checks this again by its results. The tracks of the detector that come first, in whole pixels, are off
# by half a pixel: what that costs the clean rows show.
#
# ## One trial
#
# The paper adds its noise "to the generated video data", and its blocks hide "the target in the video". So the **tracks** are
# corrupted, each view by its own draw: those of the learned detector, which are then rounded to whole pixels; **then** cameras
# and path are learned. Here it is by hand.
# Then the corruption itself: noise is one line, a fiber two.

# %%
one = films_of["SprottF"][0]
trial = Trial("SprottF", "noise", share, seed, frames=frames)
tracks = [np.round(track) for track in trial.corrupt_each(one.detected)]
seen = observe_tracks(tracks, one.rig.uncalibrated(keep=0), one.t, lags=(0, 0, 0))
law = discover(seen.t, seen.x, systematic=seen.systematic, order=1)
print(law.equations())
by_package = run_trial(trial)
assert np.allclose(by_package.law.coefficients, law.system.coefficients, rtol=1e-6)
assert by_package.score.exact or not full

noisy = one.x + share * one.x.std(axis=0) * np.random.default_rng(seed).normal(size=one.x.shape)
assert np.allclose(noisy, add_noise(one.x, share, np.random.default_rng(seed)))

# %%
def gap_lengths(x):
    """Shortest first, in samples."""
    missing = np.pad(np.isnan(x[:, 0]).astype(int), 1)
    return np.sort(np.flatnonzero(np.diff(missing) < 0) - np.flatnonzero(np.diff(missing) > 0))


gappy = one.x.copy()
for start in np.linspace(0, len(gappy), 7).astype(int)[1:-1]:  # five gaps of 4 % of the record
    gappy[start : start + len(gappy) // 25] = np.nan
fibers = drop_fibers(one.x, 0.2, np.random.default_rng(seed))
assert np.allclose(gap_lengths(gappy), gap_lengths(fibers), atol=1)

# %% [markdown]
# ## The weights of the paper's optimiser
#
# Spline-ADO has two weights: $\alpha$ of the physics loss, and $\beta$, what a term has to save to stay. The paper prints
# neither. One pair serves all systems and conditions, and the truth has no say in it: a fifth of the samples is held out,
# the rest is fitted, and the pair is taken whose curve comes closest to the samples that it has not seen, in the
# geometric mean over the systems, clean and with 10 % noise; of those that are within a hundredth of it, the one that cuts
# fewest terms. Films of a third of the length do for that.

# %%
alphas, betas = ((0.1, 1.0, 10.0), (0.005, 0.02, 0.08)) if full else ((1.0,), (0.02,))
pairs = tuple((alpha, beta) for alpha in alphas for beta in betas)
judged = grid(systems, {"noise": (0, 0.1)}, [seed], frames=frames // 3)
tasks = [Weights(trial, pairs) for trial in judged]
misfits = np.array(sweep(run_weights, tasks, jobs=jobs, desc="weights of spline-ADO"))
misfits = misfits.T.reshape(len(alphas), len(betas), len(systems), 2)
closest = np.exp(np.log(misfits).mean(axis=(2, 3)))
alike = np.argwhere(closest <= 1.01 * closest.min())
best = min(alike, key=lambda pair: (pair[1], closest[tuple(pair)]))
alpha, beta = alphas[best[0]], betas[best[1]]
print(f"chosen: alpha = {alpha:g}, beta = {beta:g}")
defaults = spline_ado.SplineADOSettings()
if full:
    assert (defaults.physics_weight, defaults.sparsity_weight) == (alpha, beta)

# %% jupyter={"source_hidden": true} tags=["hide-input"]
fig, panels = plt.subplots(1, 3, figsize=(9.5, 3))
conditions = {"clean": misfits[..., :1], "10 % noise": misfits[..., 1:], "all": misfits}
for axes, (title, values) in zip(panels, conditions.items(), strict=True):
    logarithms = np.log(values).mean(axis=(2, 3))
    axes.imshow(logarithms, cmap="Blues", aspect="auto", alpha=0.6)
    for (i, j), value in np.ndenumerate(100 * np.exp(logarithms)):
        axes.text(j, i, f"{value:.3g} %", ha="center", va="center")
    axes.set(title=title, xlabel=r"$\beta$")
    axes.set_xticks(range(len(betas)), [f"{b:g}" for b in betas])
    axes.set_yticks(range(len(alphas)), [f"{a:g}" for a in alphas])
    axes.grid(visible=False)
panels[0].set_ylabel(r"$\alpha$")
numbers = {f"alpha {a:g}, beta {b:g}": misfits[i, j].T for i, a in enumerate(alphas) for j, b in enumerate(betas)}
caption = "Misfit of held-out samples by the weights of spline-ADO, in percent of the spread."
save_figure("study_weights", fig, caption=caption, numbers=numbers, tolerance=0.3)

# %% [markdown]
# *Misfit of the samples that were held out, in percent of the motion's standard deviation: geometric means over the systems. It hardly
# tells the two smaller values of $\beta$ apart.*
#
# ## All methods, all systems
#
# What is random in a trial is seeded by its system, condition, level and number alone, so all methods get the same data. The
# results are a table with one row a trial; its clean trials stand in it as level zero of each condition.

# %%
levels = {"noise": (0, 0.1, 0.2) if full else (0, 0.1), "blocks": (0.2,), "fibers": (0.2,)}
table = tabulate(run_trials(grid(systems, levels, trials, methods, frames), jobs=jobs))
rows = summary(table, ["system", "condition", "level", "method"]).rename(columns={"level": "level (%)"})
rows["level (%)"] *= 100
errors = dict.fromkeys(["l2 (e-2)", "least", "most"], 0.2)
caption = f"Six methods on the same tracks of the detector in whole pixels, {len(trials)} trials: how many laws are exact, wrong terms trial by trial, median and range of the error, processor time of a trial."
save_table("study_all_methods", rows.to_dict("records"), caption=caption, tolerance=errors)

# %%
place = ["condition", "level", "method"]
counts = table.groupby(place, sort=False).exact.agg(rate).unstack(sort=False)
right = table.groupby(place, sort=False).exact.mean().unstack(sort=False)
seconds = table.groupby("method", sort=False).seconds.median()
print(counts.to_string(), f"processor time of a trial:\n{seconds.round(2).to_string()}", sep="\n\n")
rows = counts.reset_index().rename(columns={"level": "level (%)"})
rows["level (%)"] *= 100
save_table("study_methods", rows.to_dict("records"), caption="Exact laws of all systems, by condition and method.")

# %%
kind = ["clean", "blocks", "fibers"]
noisy = right.loc["noise"].iloc[0]
no_path = set(table[table.verdict.str.endswith("refused")].system)
told = table[(table.method == "Gauss-Newton") & table.exact]
doubted_here = (told.status == "suspect").mean()
print(f"{doubted_here:.0%} of the exact laws of Gauss-Newton are doubted; no path: {no_path}")
if full:
    assert (right.loc[kind, "Gauss-Newton"] >= 0.95).all()
    assert (right.loc[kind, "spline-ADO"] >= 0.7).all()
    assert noisy["Gauss-Newton"] > noisy.drop("Gauss-Newton").max() + 0.2
    assert 2 * seconds["Gauss-Newton"] < seconds["spline-ADO"]
    assert no_path == {"SprottE"}
    assert 0.2 < doubted_here < 0.5

# %% jupyter={"source_hidden": true} tags=["hide-input"]
TITLES = {"noise": "noise", "blocks": "blocks missing", "fibers": "fibers missing"}


def plot_robustness(trials, published):
    """Error and wrong terms against the level; lines join medians, bars hold the middle half."""
    conditions = trials.condition.unique()
    levels = [np.sort(trials.level[trials.condition == condition].unique()) for condition in conditions]
    fig, panels = plt.subplots(
        2, len(conditions), figsize=(9 if len(conditions) > 1 else 6.5, 5), sharex="col",
        sharey="row", squeeze=False, width_ratios=[1 + len(level) for level in levels],
    )  # fmt: skip
    for column, condition, level in zip(panels.T, conditions, levels, strict=True):
        chosen = trials[trials.condition == condition]
        rank = chosen.method.map({name: k for k, name in enumerate(chosen.method.unique())})
        shift = 0.6 * np.ptp(level) * (rank - rank.max() / 2)  # methods of a level side by side
        chosen = chosen.assign(**{"l2 (%)": 100 * chosen.l2, "place": 100 * chosen.level + shift})
        for axes, value in zip(column, ("l2 (%)", "wrong_terms"), strict=True):
            sns.lineplot(
                chosen, x="place", y=value, hue="method", style="method", dashes=False, lw=1.4,
                palette={name: style["color"] for name, style in plots.METHOD_STYLES.items()},
                markers={name: style["marker"] for name, style in plots.METHOD_STYLES.items()},
                estimator="median", errorbar=("pi", 50), err_style="bars", markeredgewidth=0,
                err_kws={"capsize": 2, "elinewidth": 1}, legend="full", ax=axes,
            )  # fmt: skip
            axes.get_legend().remove()
        if published:
            known = 100 * np.array(list(published[condition].items()))
            column[0].plot(*known.T, "*k", ms=10, label="paper (Table 2)")
        column[0].set_title(TITLES[condition])
        column[1].set_xlabel("level (%)" if condition == "noise" else "rate (%)")
        column[1].set_xticks(100 * level)
    panels[0, 0].set(yscale="log", ylabel=r"relative $\ell_2$ error (%)")
    panels[1, 0].set(ylabel="wrong terms", ylim=(-0.5, max(3.5, panels[1, 0].get_ylim()[1])))
    panels[1, 0].locator_params(axis="y", integer=True)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    columns = min(len(labels), len(labels) if len(conditions) > 1 else 3)
    fig.legend(handles, labels, loc="outside upper center", ncols=columns)
    return fig


# %%
def robustness(figure_id, caption, trials, published=None):
    fig = plot_robustness(trials, published)
    groups = trials.groupby(["condition", "method", "level"], sort=False)[["l2", "wrong_terms"]]
    numbers = {f"{c}, {m}, {level:g}": group.median() for (c, m, level), group in groups}
    numbers = {key: [significant(l2, 3, LEAST), n] for key, (l2, n) in numbers.items()}
    save_figure(figure_id, fig, caption=caption, numbers=numbers, tolerance=0.2)


by_level = by_condition(table)
caption = "All methods under noise in the tracks: medians over all systems and trials."
robustness("study_methods_all", caption, by_level[by_level.condition == "noise"])

# %% [markdown]
# *Relative error (top) and wrong terms (bottom) under noise in the tracks: medians over all systems and trials, bars hold the
# middle half. An $\ell_2$ error of 100 % is what no law at all would have.*
#
# ## SprottF (Fig. 3)
#
# The paper shows one system in detail. Two numbers per trial: the relative $\ell_2$ error of the
# coefficients, and the number of wrong terms, missing or false.

# %%
more = {
    "noise": (0, 0.1, 0.2, 0.3, 0.5) if full else (0, 0.1),
    "blocks": (0.1, 0.2, 0.5) if full else (0.2,),
    "fibers": (0.1, 0.2, 0.3) if full else (0.2,),
}
tasks = grid(["SprottF"], more, trials, methods, frames)
sprott = by_condition(tabulate(run_trials(tasks, jobs=jobs, desc="SprottF")))

# %%
printed = {"noise": "noise", "blocks": "random block", "fibers": "fiber missing"}
paper = {
    c: {rate / 100: ABLATION[name, rate, "Ours"].l2 for rate in (10, 20)}
    for c, name in printed.items()
}
caption = (
    "SprottF: error and wrong terms, medians and middle half of the trials; stars: paper's Table 2."
)
both = ("Gauss-Newton", "spline-ADO")
robustness("fig_3", caption, sprott[sprott.method.isin(both)], paper)

# %% [markdown]
# *Fig. 3: relative error (top) and wrong terms (bottom) for SprottF of both optimisers of the paper's model; points are
# medians of the trials, bars hold the middle half of them. Stars: what the paper prints for its own
# method. With 50 % noise the cameras cannot be learned from these tracks, and there is no law: an error of 100 %.*
#
# ## PySINDy under the same (Fig. S4)

# %%
caption = "PySINDy on SprottF: error and wrong terms, medians and middle half of the trials."
robustness("figure_S4", caption, sprott[sprott.method == "PySINDy"])
caption = "SprottF: all methods on the same data, medians and middle half of the trials."
robustness("study_methods_sprottf", caption, sprott)


# %% [markdown]
# *Fig. S4, above: the same data through PySINDy. Gaps matter less than noise, since the record is cut
# there and derivatives are local; a difference of neighbours amplifies noise. Below: all methods.*
#
# ## The other systems (Figs. S5-S10)
#
# Both optimisers and PySINDy, one figure a system.

# %%
def other(figure_id, name):
    if name in systems:
        caption = f"{name}: error and wrong terms, medians and middle half of the trials."
        shown = (by_level.system == name) & by_level.method.isin([*both, "PySINDy"])
        robustness(figure_id, caption, by_level[shown])


others = {
    "figure_S5": "Lorenz", "figure_S6": "NoseHoover", "figure_S7": "WangSun", "figure_S8": "SprottE",
    "figure_S9": "RayleighBenard", "figure_S10": "Tsucs2",
}  # fmt: skip
for figure_id, name in others.items():
    other(figure_id, name)

# %% [markdown]
# *From top to bottom: Fig. S5, Lorenz; S6, NoseHoover; S7, WangSun; S8, SprottE, of which with 20 % noise no cameras can be learned, and
# no law found: an error of 100 %; S9, RayleighBenard; S10, Tsucs2, of which noise hides a term; below is why.*
#
# ## The ablation (Table 2)
#
# Model-A is the method without its core: a spline, then SINDy, and nothing flows back from the law
# to the curve. SprottF, the paper's six conditions.

# %%
six = sprott[sprott.level.isin((0.1, 0.2)) & sprott.method.isin([*both, "Model-A"])]
table_2 = summary(six, ["condition", "level", "method"])
keys = zip(
    table_2.condition.map(printed), (100 * table_2.level).round().astype(int),
    table_2.method.where(table_2.method == "Model-A", "Ours"), strict=True,
)  # fmt: skip
known = [ABLATION[key] for key in keys]
table_2["paper: false positives"] = [row.false_positives for row in known]
table_2["paper: l2 (e-2)"] = [100 * row.l2 for row in known]
table_2["condition"] = table_2.condition.map(printed)
table_2["level"] = 100 * table_2.level
rows = table_2.rename(columns={"level": "rate (%)"}).to_dict("records")
caption = f"SprottF, both optimisers and the ablated model, {len(trials)} trials beside the paper's numbers."
save_table("table_2", rows, caption=caption, tolerance=errors)

# %%
for condition, level in six[["condition", "level"]].drop_duplicates().itertuples(index=False):
    here = six[(six.condition == condition) & (six.level == level)].groupby("method").l2
    worst_of, middle_of = here.max(), here.median()
    reached = six[(six.method == "spline-ADO") & (six.condition == condition) & (six.level == level)].l2
    known_l2 = paper[condition][level]
    for method in both if full else ():
        assert worst_of["Model-A"] > worst_of[method], (condition, level)
        if condition == "noise":
            assert middle_of["Model-A"] > 2 * middle_of[method], level
    assert reached.median() < 1.2 * known_l2 or not full, (condition, level)

# %%
far = sprott[(sprott.method == "spline-ADO") & sprott.condition.isin(["blocks", "fibers"])]
held = far[far.level <= far.condition.map({"blocks": 0.5, "fibers": 0.2})].exact
print(f"spline-ADO with up to 50 % in blocks or 20 % in fibers missing: {rate(held)} laws exact")
assert held.mean() >= 0.8 or not full
printed_20 = [ABLATION["noise", 20, method] for method in ("Ours", "Model-A")]
assert [row.false_positives for row in printed_20] == [1, 1]
assert [row.precision for row in printed_20] == [1, 0.8]
if full:
    assert middle_of["Model-A"] < middle_of.drop("Model-A").min()  # the last: a fifth in fibers
    assert (right.loc[kind, "Model-A"] > right.loc[kind, "spline-ADO"] - 0.1).all()
    assert noisy["E-SINDy"] > noisy["spline-ADO"]

# %% [markdown]
# Under noise the core pays. With gaps it hardly does: with a fifth of SprottF in fibers Model-A has the smallest median of the three, and
# over all systems it finds about as many exact laws as spline-ADO, clean and with gaps (first table of counts); with 10 % noise E-SINDy finds
# more. Our solver is taken apart in the same way, with errors that are not white, in [notebook 11](11_scoreboard.ipynb#our-solver-taken-apart).
#
# ## The second protocol: noise and gaps in the path
#
# Here the path is corrupted that sub-pixel tracks gave, so that a level says directly how exact the samples of a law are.
# The rest of this page is about Gauss-Newton under it.

# %%
wide = {
    "noise": (0, 0.1, 0.2, 0.3, 0.4) if full else (0, 0.1),
    "blocks": (0.2, 0.5) if full else (0.2,),
    "fibers": (0.2, 0.3) if full else (0.2,),
}
tasks = grid(systems, wide, trials, both[:1], frames, "path")
paths = tabulate(run_trials(tasks, jobs=jobs, desc="paths"))
newton = by_condition(paths)
gaps = newton[(newton.system == "SprottF") & (newton.condition != "noise")]
assert gaps.exact.all()
assert (gaps.l2 < 1e-4).all()

# %% [markdown]
# Missing samples cost SprottF next to nothing as long as the others are exact: what is lost is their number, not their
# quality.
#
# ## How often is the law exact?
#
# Exact means: every true term and no other, in the reference frame. Here is the share of the trials.

# %%
shares = newton.pivot_table("exact", "system", ["condition", "level"], sort=False)
shares.loc["all"] = newton.groupby(["condition", "level"], sort=False).exact.mean()

rows = [
    {"condition": condition, "level (%)": 100 * level}
    | {name: f"{share:.0%}" for name, share in column.items()}
    for (condition, level), column in shares.items()
]
caption = f"Share of {len(trials)} trials whose terms are all right and none is false."
save_table("study_exact", rows, caption=caption)

# %% jupyter={"source_hidden": true} tags=["hide-input"]
percent = 100 * shares.drop("all")
conditions = percent.columns.unique("condition")
fig, panels = plt.subplots(
    1, len(conditions), figsize=(9.5, 3.4), sharey=True, squeeze=False,
    width_ratios=[percent[condition].shape[1] for condition in conditions],
)  # fmt: skip
for axes, condition in zip(panels[0], conditions, strict=True):
    sns.heatmap(
        percent[condition], xticklabels=[f"{100 * level:.0f}" for level in percent[condition]],
        vmin=0, vmax=100, cmap="Blues", annot=True, fmt=".0f", cbar=False, linewidths=1.5,
        annot_kws={"size": 9}, ax=axes,
    )  # fmt: skip
    axes.set(title=TITLES[condition], ylabel="")
    axes.set_xlabel("level (%)" if condition == "noise" else "rate (%)")
    axes.tick_params(length=0, rotation=0)
numbers = {f"{c}, {level:g}": column.to_dict() for (c, level), column in shares.items()}
save_figure("study_exact_figure", fig, caption=caption, numbers=numbers)

# %% [markdown]
# *Share of exact laws in percent, by system (row) and level (column).*

# %%
reach = newton.condition.map({"noise": 0.2, "blocks": 0.5, "fibers": 0.2})
reach[(newton.system == "Tsucs2") & (newton.condition == "noise")] = 0.1
within = newton[newton.level <= reach].groupby("condition", sort=False).exact
print(within.agg(["mean", "size"]).to_string(float_format="{:.0%}".format))
assert (within.mean() >= 0.95).all()

# %% [markdown]
# Up to 20 % noise, 50 % in blocks and 20 % in fibers, hardly a law is wrong, but of Tsucs2: of its laws, 10 % of noise takes three in five.
#
# ## Where it fails, and why
#
# Every wrong law, by system and condition: from which level on, and what was wrong with it.

# %%
wrong = newton[~newton.exact]


def commonest(laws, name, which):
    truth = SYSTEMS[name].shift(REFERENCE_OFFSET)
    names = Counter(term for law in laws for term in term_errors(law, truth)[which])
    return "; ".join(f"{term} ({count})" for term, count in names.most_common(3)) or "none"


# %%
rows = [
    {
        "system": name, "condition": condition,
        "wrong laws": rate(~newton[(newton.system == name) & (newton.condition == condition)].exact),
        "from level (%)": 100 * group.level.min(),
        "missing, commonest": commonest(group.law, name, 0),
        "false, commonest": commonest(group.law, name, 1),
    }
    for (name, condition), group in wrong.groupby(["system", "condition"], sort=False)
] or [{"system": "none"}]  # fmt: skip
caption = "The wrong laws of Gauss-Newton; in brackets, how many trials had the error."
save_table("study_failures", rows, caption=caption)


# %% [markdown]
# Could they have been found? A term can be told from zero only if its coefficient is several of its
# standard errors, and the least possible standard error is the Cramér-Rao bound
# ([notebook 04b](04b_the_search.ipynb)). It grows in proportion to the noise. So for each system, its
# weakest term sets a level beyond which Gauss-Newton cannot be expected to find it, nor any other that
# is as careful about false terms: where the square of its coefficient, in bounds, is what it
# asks of the term.

# %%
def weakest(name):
    law = SYSTEMS[name]
    t, x = law.trajectory(frames)
    spread, moving = np.std(x, axis=0), [True, True, False]
    bound = cramer_rao_bound(law, t, law.x0, spread, moving).coefficients
    needed = bound * np.sqrt(dynamics.term_penalties(law.exponents))[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        level = np.where(law.support, np.abs(law.coefficients) / needed, np.inf)
    row, equation = np.unravel_index(level.argmin(), level.shape)
    term = f"{law.terms[row]} in d{'xyz'[equation]}/dt"
    return {"system": name, "weakest term": term, "lost from (%)": 100 * level.min()}


rows = [weakest(name) for name in systems]
caption = "Noise beyond which the weakest term of a system cannot be told from zero."
save_table("study_limits", rows, caption=caption, tolerance={"lost from (%)": 0.2})

# %%
limit = {row["system"]: row["lost from (%)"] / 100 for row in rows}
if full:
    assert min(limit, key=limit.get) == "Tsucs2"
    assert limit["Tsucs2"] < 0.15
    assert min(value for name, value in limit.items() if name != "Tsucs2") > 0.5
    others = wrong[(wrong.system != "Tsucs2") & (wrong.condition == "noise")]
    assert (others.level < others.system.map(limit)).all()

# %% [markdown]
# The bound singles out one system. In Tsucs2, the term $x$ in $\dot y$ has the coefficient 1 beside
# $20\,y$ and $xz$, and on this attractor the three go together; from about 10 % noise on, the data
# prefer the law without it. In all others the information lasts beyond the levels shown. Where one
# of their laws is wrong nevertheless, it is not for lack of information.
#
# ## Do the error bars hold?
#
# For laws with the right terms, the distance of a coefficient from the truth in standard errors
# should be that of a normal distribution: 68 % within one, 95 % within two.

# %%
noisy = newton[newton.exact & (newton.condition == "noise") & (newton.level > 0)]
groups = {f"{100 * level:.0f} % noise": group for level, group in noisy.groupby("level")}
pulled = {name: np.concatenate(list(group.pulls)) for name, group in groups.items()}

rows = [
    {
        "noise": name, "coefficients": len(values),
        "within 1 (%)": 100 * np.mean(np.abs(values) < 1),
        "within 2 (%)": 100 * np.mean(np.abs(values) < 2),
        "rms": significant(np.sqrt(np.mean(values**2)), 3),
        "l2, median (e-2)": significant(100 * group.l2.median()),
        "l2, promised (e-2)": significant(100 * group.promised_l2.median()),
    }
    for (name, group), values in zip(groups.items(), pulled.values(), strict=True)
]  # fmt: skip

# %%
caption = (
    "Errors in units of their standard errors, and as what the error bars promise; exact laws."
)
loose = dict.fromkeys(["rms", "l2, median (e-2)", "l2, promised (e-2)"], 0.2)
save_table("study_pulls", rows, caption=caption, tolerance=loose)

# %% jupyter={"source_hidden": true} tags=["hide-input"]
fig, axes = plt.subplots(figsize=(7, 4))
distance = np.linspace(0, 4, 200)
axes.plot(distance, 100 * halfnorm.cdf(distance), color="0.8", lw=7, label="if they are right")
colours = plt.get_cmap("viridis")(np.linspace(0, 0.9, len(pulled)))
for (name, values), colour in zip(pulled.items(), colours, strict=True):
    sns.ecdfplot(x=abs(values), stat="percent", color=colour, lw=1.4, label=name, ax=axes)
axes.set(xlim=(0, 4), ylim=(0, 102), xlabel="|error| / standard error")
axes.set_ylabel("coefficients below (%)")
axes.legend(loc="lower right")
caption = "Share of coefficients within so many standard errors; grey: the normal distribution."
save_figure("study_pulls_figure", fig, caption=caption, numbers=pulled)

# %% [markdown]
# *How far the coefficients of exact laws are from the truth. Those of one law move together, as
# they share one path and one offset, so the curves are rougher than their number of points
# suggests. What the error bars "promise" is the error of a law all of whose coefficients are off by one of them; where coefficients
# move together, most laws are nearer than that.*

# %%
if full:
    assert all(row["within 2 (%)"] > 80 for row in rows)
    assert all(row["rms"] < 2 for row in rows)

# %% [markdown]
# ## Does it know when it is wrong?
#
# A law comes with the status "ok", or "suspect" and warnings. Four outcomes:

# %%
verdicts = {
    condition: {f"{100 * level:.0f}": list(group.verdict) for level, group in part.groupby("level")}
    for condition, part in newton.groupby("condition", sort=False)
}
fig = plots.plot_verdicts({f"{c} (%)": v for c, v in verdicts.items()})
caption = "How often the law is exact, and what the solver says of it, over all systems."
save_figure("study_verdicts_figure", fig, caption=caption, numbers=verdicts)

# %% [markdown]
# *All systems. Blue is right and light blue right but doubted, orange wrong with a warning,
# vermilion wrong without one.*

# %%
mine = paths  # each trial once
counts = mine.verdict.value_counts()
rows = [
    {"law": law} | {s: f"{counts.get(f'{law}, {s}', 0)} of {len(mine)}" for s in ("ok", "suspect")}
    for law in ("exact", "wrong")
]
caption = f"Law and status in {len(mine)} trials of Gauss-Newton under the second protocol."
silent = mine[mine.verdict == "wrong, ok"]
doubted = (mine[mine.exact].status == "suspect").mean()
print("wrong laws without a warning:", silent.system.value_counts().to_dict())
print(f"{doubted:.0%} of the exact laws are doubted")
assert doubted < 0.2 or not full
assert not full or 20 * len(silent) < len(mine) and 0.3 < len(silent) / (~mine.exact).sum() < 0.7
save_table("study_verdicts", rows, caption=caption)

# %% [markdown]
# Of the few wrong laws about half come without a warning. Such a law fits the data to within their noise, as that of Tsucs2 without
# its weakest term does. Its fit gives nothing away; a longer record or less noise would.
#
# ## Tracking or regression?
#
# The same noise on the true path, which no camera has seen, for the first trial. If the errors are
# equal, none of them comes from the videos.

# %%
level = 0.3 if full else 0.1
tasks = grid(systems, {"noise": (0, level)}, trials[:1], both[:1], frames, "path")
tasks += [replace(task, source="truth") for task in tasks]
two = tabulate(run_trials(tasks, jobs=jobs, desc="videos and truth"))
l2 = two.set_index(["source", "level", "system"]).l2

# %%
rows = [
    {
        "system": name,
        "path / spread (e-2)": significant(100 * path_error[name] / np.linalg.norm(x.std(axis=0))),
        "l2, videos (e-2)": significant(100 * l2["path", 0, name], least=100 * LEAST),
        "l2, truth (e-2)": significant(100 * l2["truth", 0, name], least=100 * LEAST),
        "l2, videos, noise (e-2)": significant(100 * l2["path", level, name], 3),
        "l2, truth, noise (e-2)": significant(100 * l2["truth", level, name], 3),
    }
    for name in systems
    for x in [SYSTEMS[name].trajectory(frames)[1]]
]  # fmt: skip
caption = f"Error of the path, of laws from filmed and true paths; {100 * level:.0f} % noise; first trial."
loose = dict.fromkeys(["path / spread (e-2)", "l2, videos (e-2)", "l2, truth (e-2)", "l2, videos, noise (e-2)", "l2, truth, noise (e-2)"], 0.2)
save_table("study_path", rows, caption=caption, tolerance=loose)

# %%
for row in rows:
    videos, truth = (row[f"l2, {source}, noise (e-2)"] for source in ("videos", "truth"))
    assert row["l2, videos (e-2)"] < 0.05 * videos, row["system"]
    assert abs(videos - truth) <= 0.2 * max(videos, truth), row["system"]

# %% [markdown]
# ## What we learned
#
# * **The paper's method works.** Clean, and with blocks or fibers missing in the tracks, its own optimiser finds seven laws of
#   ten and more from whole pixels, Gauss-Newton nearly all: gaps cost little.
#   <!-- by: (right.loc[kind, "Gauss-Newton"] >= 0.95).all(); (right.loc[kind, "spline-ADO"] >= 0.7).all(); figure study_all_methods -->
# * Noise and time are what Gauss-Newton gains: with 10 % noise in the tracks it finds more laws than any other method, spline-ADO
#   among them, in less than half of its processor time.
#   <!-- by: noisy["Gauss-Newton"] > noisy.drop("Gauss-Newton").max() + 0.2; 2 * seconds["Gauss-Newton"] < seconds["spline-ADO"] -->
# * With 20 % noise the cameras cannot be learned from the tracks of SprottE, and no method has a path.
#   <!-- by: no_path == {"SprottE"} -->
# * Gauss-Newton doubts about a quarter of the exact laws of this regime, for the errors of the detector are no noise and the views say so.
#   <!-- by: 0.2 < doubted_here < 0.5 -->
# * Gaps in exact samples cost SprottF next to nothing.
#   <!-- by: gaps.exact.all(); (gaps.l2 < 1e-4).all() -->
# * The limit is information, and the Cramér-Rao bound knows it in advance: Tsucs2 has one term that
#   noise of little more than 10 % buries.
#   <!-- by: limit["Tsucs2"] < 0.15; min(limit, key=limit.get) == "Tsucs2" -->
# * Error bars hold under noise for laws with the right terms. A law that fits as well as the truth
#   carries no warning, even if it is wrong: fewer than one law in twenty, but about half of those that are wrong.
#   <!-- by: row["within 2 (%)"] > 80; 20 * len(silent) < len(mine); 0.3 < len(silent) / (~mine.exact).sum() < 0.7; figure study_verdicts -->
# * Videos and cameras add nothing to these errors that could be seen, if tracks are known to a fraction of a pixel.
#   <!-- by: row["l2, videos (e-2)"] < 0.05 * videos; abs(videos - truth) <= 0.2 -->
#
# **What the paper says and what we found.**
#
# * *"up to a 20% noise interference, our method almost accurately identifies all correct coefficients"*, *"robust even
#   with up to 50% data loss"*, *"strong stability even when the fiber missing rate is about 20%"*: SprottF does this here with the
#   paper's own optimiser, with errors like the paper's or smaller.
#   <!-- by: reached.median() < 1.2 * known_l2; held.mean() >= 0.8 -->
# * *"the performance of the ablated model deteriorates in all considered cases"*: the worst of its trials is worse than both
#   optimisers' in all six conditions, and under noise so is the median. Not so with gaps: its median with a fifth in fibers is the
#   smallest, and over all systems it finds about as many exact laws as spline-ADO.
#   <!-- by: worst_of["Model-A"] > worst_of[method]; middle_of["Model-A"] > 2 * middle_of[method]; middle_of["Model-A"] < middle_of.drop("Model-A").min(); (right.loc[kind, "Model-A"] > right.loc[kind, "spline-ADO"] - 0.1).all() -->
# * Table 2 contradicts itself at 20 % noise: one false positive with a precision of 100 % for one
#   method, one with 80 % for the other.
#   <!-- by: [row.false_positives for row in printed_20] == [1, 1]; [row.precision for row in printed_20] == [1, 0.8]; figure table_2 -->
# * The paper does not say what noise levels are relative to; here it is the standard deviation of each
#   coordinate. Nor does it say whether the occlusions come with noise; here they do not.
#   <!-- by: np.allclose(noisy, add_noise(one.x, share; docs/results.md -->
#
# ## Exercises
#
# [Three exercises](exercises/06_robustness_and_ablation.ipynb), each with a blank cell and a check that says *right* or fails. Their
# [solutions](solutions/06_robustness_and_ablation.ipynb) lie apart.
#
# ## Run time and versions
#
# All cells take about 60 minutes on two cores.

# %%
print(versions())
