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
# # The scoreboard
#
# In this notebook, we present benchmarks that others use, and errors that are no white noise. Gauss-Newton (`discover`) and four other
# methods get the same samples in one run; what is published of the same benchmarks stands beside it.
#
# **What you will see**
#
# * ODEBench: 63 equations from textbooks, whose stored trajectories err smoothly;
# * the Lorenz system over noise and length, beside the best published method;
# * eight chaotic flows with drift, outliers, coarse steps, correlated noise, kicks;
# * for each: how often the law is exact, how often it is wrong and nothing said so, how long it takes;
# * which mechanism of our solver is needed for what.
#
# **Afterwards you can** say on which data which method finds the law, and which of them warns when it does not.
#
# **What you need**: [notebook 06](06_robustness_and_ablation.ipynb), of which this is the sequel outside the
# paper's protocol.
#
# **Covers** nothing in the paper, whose errors are noise and gaps.

# %% tags=["parameters"]
profile: str = "full"  # full or quick
seed: int = 0  # of all errors
jobs: int = 2  # contests at a time

# %%
from dataclasses import replace
from itertools import product

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from vidsindy_lite import discover
from vidsindy_lite.companion.artifacts import save_figure, save_table, versions
from vidsindy_lite.study import (
    CONTESTANTS,
    ERRORS,
    MOTIONS,
    ODEBENCH,
    RIVALS,
    FlowContest,
    LorenzContest,
    OdeContest,
    ablation_table,
    ablations,
    plots,
    run_ablation,
    run_contest,
    standings,
    sweep,
    term_errors,
)

plt.style.use("vidsindy_lite.study.plots.vidsindy")
full = profile == "full"
both = CONTESTANTS[:2]  # Gauss-Newton and PySINDy see everything, the slower ones less
sindy = CONTESTANTS[-2:]  # SINDy with a smoothing spline, and with the truth to choose by


# %% [markdown]
# ## The rules
#
# * Everybody gets the same samples, candidate terms up to the same degree, and nothing else: no noise level, no
#   origin, no threshold. Gauss-Newton runs with its defaults.
# * The baselines are those of [notebook 05](05_discovery.ipynb). Their thresholds are chosen without the truth, by
#   the error of the derivatives on the last fifth of the record. Model-A is SINDy as a careful user has it: with the derivatives of
#   a smoothing spline. The **oracle** is no contestant: of many more thresholds, with differences and with splines, it takes the
#   exact law, if there is one, or that whose path comes closest to the clean one.
# * **Exact** means: every true term and no other.
# * Only Gauss-Newton says whether it trusts its law. *Wrong and ok* is the worst that can happen, *right but doubted* the
#   price of caution.

# %%
def count(table):
    """One row a condition and method: how many are exact, and how far the status can be trusted."""
    groups = table.groupby(["condition", "method"], sort=False)
    return [
        {
            "condition": condition, "method": method, "cases": len(group),
            "exact (%)": 100 * group.exact.mean(),
            "wrong and ok": group["wrong, ok"].sum() if method == "Gauss-Newton" else None,
            "right but doubted": group["exact, doubted"].sum() if method == "Gauss-Newton" else None,
            "seconds": group.seconds.median(),
        }
        for (condition, method), group in groups
    ]  # fmt: skip


# %%
def shares(table):
    """Share of exact laws, a row a condition, a column a method."""
    found = table.pivot_table("exact", "condition", "method", sort=False).astype(float)
    return found.reindex(columns=[name for name in CONTESTANTS if name in found])


# %% [markdown]
# ## ODEBench: trajectories that are not quite those of their equations
#
# [ODEBench](https://arxiv.org/abs/2310.05573) collects 63 equations of one to four variables. Truth and found law
# are the same type; 37 are polynomials, 35 of them of degree three at most, and are data like this one:

# %%
equation = ODEBENCH[27]
print(f"{equation.number}, {equation.name}", equation.law.text(), sep="\n")

# %% [markdown]
# The benchmark stores 512 samples on $[0, 10]$, integrated by LSODA with a relative tolerance of $10^{-5}$. We
# integrate in the same way, and once to twelve digits. The difference is small and smooth:

# %%
numbers = list(ODEBENCH) if full else [3, 24, 28]
cubic = [number for number in numbers if ODEBENCH[number].is_cubic]
off = {}
for number in cubic:
    stored, tight = (OdeContest(number, tight=tight).data().x for tight in (False, True))
    off[number] = (np.abs(stored - tight).max(axis=0) / tight.std(axis=0)).max()
low, middle, high = np.quantile(list(off.values()), [0.1, 0.5, 0.9])
print(f"largest error over the spread: {low:.0e}, {middle:.0e}, {high:.0e} (a tenth, half, nine tenths)")
assert 1e-6 < middle < 1e-2

# %% [markdown]
# Noise is as published: samples are multiplied by $1+\sigma\,\varepsilon$, and a share $\rho$ of them is dropped.
# All methods fit cubic laws; 35 equations have one. The two slower methods see the stored data alone. *Tight* is what is
# integrated to twelve digits.

# %%
levels = [(0, 0), (0.02, 0), (0.05, 0), (0.05, 0.5)] if full else [(0, 0), (0.02, 0)]
tasks = [OdeContest(n, tight=True, methods=both, seed=seed) for n in cubic]
for noise, dropped in levels:
    for n in numbers:
        methods = CONTESTANTS if full and not noise and n in cubic else (*both, *sindy)
        tasks += [OdeContest(n, 0, noise, dropped, methods=methods, seed=seed)]
ode = standings(sweep(run_contest, tasks, jobs=jobs, desc="ODEBench"))
laws, others = ode[ode.inside], ode[~ode.inside]

# %%
caption = "ODEBench, the equations with a cubic law, from their first start: how many laws are exact."
save_table("score_odebench", count(laws), caption=caption)

# %%
rate = shares(laws)
if full:
    assert rate["Gauss-Newton"]["tight"] > 0.9
    assert 0.4 < rate["PySINDy"]["tight"] < 0.6
    assert rate["Gauss-Newton"]["stored"] > 0.75
    assert rate["Gauss-Newton"]["stored"] > rate.drop(columns="Gauss-Newton").loc["stored"].max() + 0.05
    assert (rate["Gauss-Newton"] > rate.PySINDy + 0.1).all()
    assert (laws.groupby("condition")["wrong, ok"].sum() <= 7).all()
    cost = len(cubic) * (rate.loc["tight", list(both)] - rate.loc["stored", list(both)])
    assert (abs(cost) < 2.5).all()
    ours = laws[(laws.method == "Gauss-Newton") & (laws.condition == "stored")]
    assert not ours["wrong, ok"].any()

# %% [markdown]
# PySINDy finds about half of these laws even without errors: a threshold on coefficients keeps what is large,
# not what is needed. The smooth error of the stored integration, of the order of $10^{-4}$, costs each method two laws
# at most, and what Gauss-Newton finds in their place comes with a doubt. It looks like small terms to a solver that takes errors for white noise; Gauss-Newton looks for the law that *persists* while more and more error is tolerated ([notebook 04b](04b_the_search.ipynb)); `found.plot_path()`
# draws that.

# %%
data = OdeContest(49).data()  # the Brusselator
found = discover(data.t, data.x)
fig = found.plot_path()
caption = "The Brusselator, as stored by ODEBench: terms over the error that is tolerated."
path = [[(p.low, p.high, int(p.terms.sum())) for p in plateaus] for plateaus in found.path]
save_figure("score_path", fig, caption=caption, numbers=dict(zip("xy", path, strict=True)))

# %% [markdown]
# *The Brusselator, as stored. Where nothing is tolerated (left), the law has terms that imitate the
# integrator; they go as more is tolerated, and the plateau that lasts (orange) is the law.*
#
# ### Equations that are no cubic polynomial
#
# A sine, a fraction or a fifth power is outside the library, and any law that comes out is an approximation along
# the path. What does the status say of it?

# %%
mine = others[(others.method == "Gauss-Newton") & others.condition.isin(["stored", "stored, noise 2 %"])]
rows = [
    {"condition": condition} | group.status.value_counts().to_dict()
    for condition, group in mine.groupby("condition", sort=False)
]
rows = [{key: row.get(key, 0) for key in ("condition", "ok", "suspect", "refused")} for row in rows]
caption = "Status of laws that cannot be right: the library lacks a function that the equation needs."
rows_outside = rows
assert rows_outside[0]["ok"] > 0 or not full
save_table("score_outside", rows, caption=caption)

# %% [markdown]
# A status can only doubt what the data refute. Where a cubic follows the path to within the errors, nothing in one
# record speaks against it: such a law forecasts near the recorded path and nowhere else.
#
# ### Beside published numbers
#
# Others count something easier: the laws whose path from the true start explains 90 % of the variance of the
# trajectory that they were fitted to. That needs no right term. All 63 equations count.

# %%
rivals = RIVALS["odebench"]
printed = {method: dict(zip(map(tuple, rivals["conditions"]), rates, strict=True)) for method, rates in rivals["rates"].items()}
print(f"published: {rivals['source']}; given: {rivals['given']}")
compared = (*both, *sindy)
everyone = ode[ode.condition.str.startswith("stored") & ode.method.isin(compared)]
good = everyone.assign(good=everyone.r2 > 0.9).pivot_table("good", "level", "method", sort=False)
rows = [
    {"noise (%)": 100 * noise, "dropped (%)": 100 * dropped}
    | {f"{method}, here": 100 * good.loc[[(noise, dropped)], method].iloc[0] for method in compared}
    | {method: known[noise, dropped] for method, known in printed.items()}
    for noise, dropped in levels
]
caption = "ODEBench, percent of 63 laws with R2 above 0.9; columns without 'here' are published."
save_table("score_r2", rows, caption=caption, tolerance={f"{method}, here": 0.05 for method in compared})

# %%
if full:
    assert all(row["Gauss-Newton, here"] > 75 for row in rows)
    right = everyone.pivot_table("exact", "level", "method", sort=False)["Gauss-Newton"].astype(float)
    assert (good["Gauss-Newton"] > right + 0.25).all()
    assert all(row["SINDy, oracle, here"] > row["PySINDy, here"] + 10 for row in rows)
    assert all(row["Model-A, here"] > row["PySINDy, here"] for row in rows[1:])

# %% [markdown]
# Why is PySINDy so far below its published rate? There its threshold and its derivatives are those that suit the benchmark. With
# both chosen by the clean truth, and nothing else changed, the oracle's column is what it reaches here; a smoothing spline
# without an oracle brings it a part of the way under noise.

# %% [markdown]
# ## The Lorenz system over noise and length
#
# Start at $(-8,8,27)$, steps of .01, quadratic terms; the noise is relative to the standard deviation of all
# coordinates *together*, so that 40 % of it is 69 % of that of $x$. The best published method,
# ODR-BINDy, is told the variance of the noise, and takes the origin of the data for that of the law. Gauss-Newton is told
# neither; a second run is told the origin. With two draws a cell the two may differ by chance either way.

# %%
rival = RIVALS["lorenz_grid"]
levels, lengths = np.array(rival["levels"]), np.array(rival["lengths"], dtype=float)
shown = np.isin(np.round(1000 * levels), [50, 100, 200, 250, 300, 400] if full else [100])
columns = slice(None) if full else [0, -1]
levels, lengths = levels[shown], lengths[columns]
draws = range(seed, seed + (2 if full else 1))
cells = [(noise, length) for noise in levels for length in lengths]
tasks = [LorenzContest(float(T), float(s), n) for s, T in cells for n in draws]
contests = sweep(run_contest, tasks, jobs=jobs, desc="Lorenz grid")
lorenz = standings(contests)
at_home = [replace(task, origin="data") for task in tasks]
told = standings(sweep(run_contest, at_home, jobs=jobs, desc="Lorenz grid, origin given"))
print(f"{rival['method']}: {rival['source']}; given: {rival['given']}")

# %%
shape = shown.sum(), len(lengths), len(draws)
exact, given = (table.exact.to_numpy(float).reshape(shape).mean(axis=2) for table in (lorenz, told))
theirs = np.array(rival["exact"])[shown][:, columns] / rival["draws"]
grids = {f"Gauss-Newton, {len(draws)} draws": exact, f"{rival['method']}, published": theirs}

# %% jupyter={"source_hidden": true} tags=["hide-input"]
size = (4.1 * len(grids), 0.42 * len(levels) + 1.2)
fig, panels = plt.subplots(1, len(grids), figsize=size, sharey=True)
for axes, (method, rates) in zip(panels, grids.items(), strict=True):
    axes.imshow(100 * rates, vmin=0, vmax=100, cmap="Blues", aspect="auto")
    for (row, column), share in np.ndenumerate(rates):
        style = {"ha": "center", "va": "center", "color": "white" if share > 0.6 else "black"}
        axes.text(column, row, f"{100 * share:.0f}", size=9, **style)
    axes.set_xticks(range(len(lengths)), [f"{length:g}" for length in lengths])
    axes.set_yticks(range(len(levels)), [f"{100 * level:g}" for level in levels])
    axes.set(title=method, xlabel="length (time units)")
    axes.tick_params(length=0)
    axes.grid(False)
    axes.spines[:].set_visible(False)
panels[0].set_ylabel("noise (% of the spread)")
caption = "Share of exact Lorenz laws in percent, over noise and length: Gauss-Newton beside the published."
save_figure("score_lorenz", fig, caption=caption, numbers=grids)

# %% [markdown]
# *Percent of exact laws by length (column) and noise (row). Gauss-Newton is not told the noise. With two draws a cell, a
# cell says little and a row something.*

# %%
rows = [
    {
        "noise (%)": 100 * level, "Gauss-Newton (%)": 100 * mine.mean(),
        "the same, origin given (%)": 100 * home.mean(), "ODR-BINDy (%)": 100 * known.mean(),
    }  # fmt: skip
    for level, mine, home, known in zip(levels, exact, given, theirs, strict=True)
]
save_table("score_lorenz_rows", rows, caption="Exact Lorenz laws, mean over the lengths.")

# %%
silent = lorenz["wrong, ok"].mean()
print(f"exact in {exact.mean():.0%}, wrong and ok in {silent:.0%}; origin given, exact in {given.mean():.0%}")
misses = [one for (one,) in contests if not one.exact and one.law is not None]
lost = [term_errors(one.law, one.contest.data().truth)[0] for one in misses]
buried = sum("y in dy/dt" in terms for terms in lost)
print(f"{buried} of {len(misses)} misses have lost -y in dy/dt")
if full:
    assert exact[:2].mean() > 0.9
    assert exact.mean() > theirs.mean() - 0.2
    assert buried > 0.8 * len(misses)

# %% [markdown]
# Most misses drop one term, $-y$ in $\dot y$, which noise of this size buries: the law without it fits as well.
#
# ## Errors as they are
#
# Eight flows, four of the paper's and four others, 15 periods each, seen from an origin that is unknown. Every
# kind of error is a function of `study.corruption`: *64 values* are those that a converter of six bits can tell apart, *averaged
# noise* is what a filter over nine samples leaves of it, *coarse steps* are those of a careless integrator, *bent space* is a lens.

# %%
four = ("Lorenz", "RayleighBenard", "NoseHoover", "WangSun")  # of the paper's
flows = (*four, "Roessler", "Arneodo", "Halvorsen", "Chen") if full else four[:1]
errors = (*ERRORS, *MOTIONS) if full else ("64 values", "drift 0.2 %", "kicks 1 %")
few = flows[::4]  # of the slower methods
tasks = [
    FlowContest(flow, error, 1500 if full else 500, methods=CONTESTANTS[:5] if full and flow in few else both, seed=seed)
    for error in errors
    for flow in flows
]
flow_table = standings(sweep(run_contest, tasks, jobs=jobs, desc="flows"))
save_table("score_errors", count(flow_table), caption=f"Exact laws of {len(flows)} flows, cubic terms.")

# %%
rate_flows = shares(flow_table)

# %% jupyter={"source_hidden": true} tags=["hide-input"]
boards = {"ODEBench": rate, "chaotic flows": rate_flows}
heights = [len(board) + 1.5 for board in boards.values()]
fig, panels = plt.subplots(
    2, 1, figsize=(7.5, 0.34 * sum(heights) + 1), sharex=True, height_ratios=heights
)
for axes, (title, board) in zip(panels, boards.items(), strict=True):
    places = np.arange(len(board))[::-1]
    # Later ones lie on top: Gauss-Newton is drawn last, and the others a little apart.
    for k, method in reversed(list(enumerate(board))):
        style = plots.METHOD_STYLES[method] | {"ls": "", "ms": 8, "clip_on": False, "label": method}
        axes.plot(100 * board[method], places + 0.11 * (k - (board.shape[1] - 1) / 2), **style)
    axes.set_yticks(places, board.index)
    axes.set(xlim=(0, 100), ylim=(-0.6, len(board) - 0.4), title=title)
axes.set_xlabel("exact laws (%)")
drawn = {line.get_label(): line for axes in panels for line in axes.lines}
fig.legend(handles=[drawn[m] for m in CONTESTANTS if m in drawn], loc="outside upper center", ncols=3)
caption = "Exact laws by benchmark, condition and method, in percent."
numbers = {f"{c}, {m}": value for table in (rate, rate_flows) for m in table for c, value in table[m].items()}
save_figure("score_methods", fig, caption=caption, numbers=numbers)

# %% [markdown]
# *Exact laws in percent. The slower methods see the stored data of ODEBench and two of the
# flows.*

# %%
print(rate_flows.mul(100).round().to_string(na_rep=""))  # percent
if full:
    assert rate_flows["Gauss-Newton"].mean() > 0.75
    assert rate_flows["Gauss-Newton"].mean() > rate_flows.PySINDy.mean() + 0.15

# %% [markdown]
# ## Our solver, taken apart
#
# The paper takes the core out of its method; so do we, mechanism by mechanism. While a contest runs, what does the work of one of them
# is replaced by what does nothing. *Lost* are laws that are exact with it and not without. The contests are the
# flows above that are not the paper's, with errors that are not white, and the cubic equations of ODEBench with noise and one of
# ten samples left.

# %%
kinds = ("drift 0.2 %", "bent space 0.3 %", "correlated noise 5 %", "outliers 2 %", "coarse steps", "clock jitter 30 %", "kicks 5 %")
others = flows[4:] or ("Halvorsen",)
smooth = [FlowContest(flow, kind, 1500 if full else 800, seed=seed) for flow, kind in product(others, kinds if full else kinds[:1])]
sparse = [OdeContest(n, 0, 0.02, 0.9, seed=seed) for n in cubic] if full else []
tasks = list(ablations([*smooth, *sparse]))
apart = ablation_table(sweep(run_ablation, tasks if full else tasks[::8], jobs=jobs, desc="taken apart"))

caption = f"Exact laws of {len(smooth)} contests of flows and {len(sparse)} of ODEBench without each mechanism of the solver."
save_table("table_solver_ablation", apart.reset_index().to_dict("records"), caption=caption, tolerance={"seconds": 1e9})

# %% [markdown]
# *A mechanism whose row does not differ from the first one does not show in these contests.*
#
# *Lost* are laws that are exact with it alone, *gained* those that are exact without it alone. Three are explained in [notebook 04b](04b_the_search.ipynb): the *support path*, along which the tolerated error falls, the *first
# tolerance* at which it begins, and the *free offset*; *process noise* in [notebook 12](12_newtons_laws.ipynb#a-ball-in-the-wind). The others: the *second start* seeks the first law again
# where the path leads to none; *richer laws* are tried below the plateau; the *floor for smooth errors* keeps the path from errors
# that last for many samples, which the *integrated autocorrelation time* counts as fewer; *errors of the times* are those of a clock; the
# *weights from the smoother* are how noisy each coordinate is before any law is known, and *noise told by all terms* is that with
# every term of the library in use.
#
# ## How far can the status be trusted?
#
# All contests of this page together.

# %%
together = {"ODEBench": laws, "Lorenz grid": lorenz, "flows": flow_table}
rows = []
for benchmark, table in together.items():
    mine = table[table.method == "Gauss-Newton"]
    doubted = mine["exact, doubted"].sum() / max(mine.exact.sum(), 1)
    rows.append({
        "benchmark": benchmark, "cases": len(mine), "exact (%)": 100 * mine.exact.mean(),
        "wrong and ok (%)": 100 * mine["wrong, ok"].mean(), "doubted of the exact (%)": 100 * doubted,
        "seconds": mine.seconds.median(),
    })  # fmt: skip
save_table("score_summary", rows, caption="Gauss-Newton on all benchmarks of this page.")

# %%
if full:
    assert all(row["wrong and ok (%)"] < 25 for row in rows)
    assert rows[0]["wrong and ok (%)"] < 15
    assert rows[2]["wrong and ok (%)"] < 15

# %%
_, grid_row, flow_row = rows
every = pd.concat([table[table.method == "Gauss-Newton"] for table in together.values()])
trusted, doubted = every[every.status == "ok"], every[every.status != "ok"]
print(f"of {len(trusted)} laws with the status ok {trusted.exact.mean():.0%} are exact, "
      f"of {len(doubted)} others {doubted.exact.mean():.0%}")  # fmt: skip
if full:
    assert trusted.exact.mean() > 0.95
    assert doubted.exact.mean() > 0.5
    assert grid_row["doubted of the exact (%)"] > 3 * flow_row["doubted of the exact (%)"]

# %% [markdown]
# An *ok* can be trusted in more than nineteen cases of twenty, all three taken together; where it is wrong, it is mostly on the
# Lorenz grid, of which it can be trusted less (see "wrong and ok"). A *suspect* says less: more than half of the laws that are doubted
# are exact. On the Lorenz grid, with few samples and much noise, exact laws are doubted more than three times as often as with the flows.

# %% [markdown]
# ## What we learned
#
# * On motions from textbooks, even without errors, a threshold on coefficients finds about half of the laws; what
#   persists while more error is tolerated is right nearly always.
#   <!-- by: rate["Gauss-Newton"]["tight"] > 0.9; 0.4 < rate["PySINDy"]["tight"] < 0.6; figure score_odebench -->
# * On the Lorenz grid Gauss-Newton, which is told neither the noise nor the origin, comes near the best published method,
#   which takes both as known. Its misses lose one term, as a rule.
#   <!-- by: exact.mean() > theirs.mean() - 0.2; buried > 0.8 * len(misses); figure score_lorenz_rows -->
# * Explained variance says little about terms: most laws explain 90 % of a trajectory, and far fewer are right.
#   <!-- by: row["Gauss-Newton, here"] > 75; (good["Gauss-Newton"] > right + 0.25).all(); figure score_r2 -->
# * The status "ok" can be trusted in more than nineteen cases of twenty, all three taken together; of the laws that are "suspect" more than half are exact, too, and
#   on the Lorenz grid exact laws are doubted more than three times as often as with the flows.
#   <!-- by: trusted.exact.mean() > 0.95; doubted.exact.mean() > 0.5; grid_row["doubted of the exact (%)"] > 3 * flow_row["doubted of the exact (%)"] -->
# * With thresholds that know the truth SINDy is far above PySINDy as a user has it.
#   <!-- by: row["SINDy, oracle, here"] > row["PySINDy, here"] + 10; figure score_r2 -->
# * Whether a law is outside the library, one record cannot always say. Then the status is ok and the law an
#   approximation.
#   <!-- by: rows_outside[0]["ok"] > 0; figure score_outside -->
#
# **What the paper says and what we found.**
#
# * The paper's errors are white noise and gaps, its systems seven. Of integration, drift, distortion, correlated
#   noise or kicks it says nothing, and compares with PySINDy, E-SINDy, WeakSINDy and its own Model-A. Gauss-Newton
#   finds more of these laws than PySINDy does.
#   <!-- by: rate_flows["Gauss-Newton"].mean() > rate_flows.PySINDy.mean() + 0.15; figure score_methods -->

# %% [markdown]
# ## Exercises
#
# [Three exercises](exercises/11_scoreboard.ipynb), each with a blank cell and a check that says *right* or fails. Their
# [solutions](solutions/11_scoreboard.ipynb) lie apart.

# %% [markdown]
# ## Run time and versions
#
# All cells take about 40 minutes on two cores.

# %%
print(versions())
