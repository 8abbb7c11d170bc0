"""Figures of many trials: errors and wrong terms by method, level, system; the paper's numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from scipy.stats import halfnorm

from ...arrays import Floats

if TYPE_CHECKING:  # pandas and seaborn are imported where they draw
    from pandas import DataFrame

_STYLES = {
    "Gauss-Newton": ("C0", "o"), "spline-ADO": ("C5", "P"), "PySINDy": ("C1", "s"),
    "E-SINDy": ("C2", "^"), "WeakSINDy": ("C3", "v"), "Model-A": ("C4", "D"),
    "SINDy, oracle": ("0.5", "*"),
}  # fmt: skip
COLOURS = {name: colour for name, (colour, _) in _STYLES.items()}
MARKERS = {name: marker for name, (_, marker) in _STYLES.items()}
_TITLES = {"noise": "noise", "blocks": "blocks missing", "fibers": "fibers missing"}

VERDICTS = {
    "exact, ok": ("C0", ""),
    "exact, suspect": ("C5", ""),
    "wrong, suspect": ("C4", "//"),
    "wrong, ok": ("C1", "xx"),
}
"""Colour and hatch of each outcome: is the law exact, and what did the solver say of it."""


def plot_robustness(
    trials: DataFrame, published: Mapping[str, Mapping[float, float]] | None = None
) -> Figure:
    """Relative error and number of wrong terms against noise and missing data (Fig. 3, S4-S10).

    Parameters
    ----------
    trials : DataFrame
        Of `by_condition`: one column of panels a condition. Lines join the medians of repeated
        trials, bars hold the middle half of them.
    published : dict of str to dict of float to float, optional
        The paper's relative errors by level, by condition.
    """
    import seaborn as sns

    conditions = trials.condition.unique()
    widths = [1 + n for n in trials.groupby("condition", sort=False)["level"].nunique()]
    figure, grid = plt.subplots(
        2, len(conditions), figsize=(9 if len(conditions) > 1 else 6.5, 5), sharex="col",
        sharey="row", squeeze=False, width_ratios=widths,
    )  # fmt: skip
    for column, condition in zip(grid.T, conditions, strict=True):
        chosen = _beside(trials[trials.condition == condition])
        for axes, value in zip(column, ("l2 (%)", "wrong_terms"), strict=True):
            sns.lineplot(
                chosen, x="place", y=value, hue="method", style="method", palette=COLOURS,
                markers=MARKERS, dashes=False, estimator="median", errorbar=("pi", 50),
                err_style="bars", err_kws={"capsize": 2, "elinewidth": 1}, lw=1.4, legend="full",
                markeredgewidth=0, ax=axes,
            )  # fmt: skip
            axes.get_legend().remove()
        if published:
            known = 100 * np.array(list(published[condition].items()))
            column[0].plot(*known.T, "*k", ms=10, label="paper (Table 2)")
        column[0].set_title(_TITLES[condition])
        column[1].set_xlabel("level (%)" if condition == "noise" else "rate (%)")
        column[1].set_xticks(100 * np.sort(chosen.level.unique()))
    grid[0, 0].set(yscale="log", ylabel=r"relative $\ell_2$ error (%)")
    grid[1, 0].set(ylabel="wrong terms", ylim=(-0.5, max(3.5, grid[1, 0].get_ylim()[1])))
    grid[1, 0].locator_params(axis="y", integer=True)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    columns = len(labels) if len(conditions) > 1 else 3
    figure.legend(handles, labels, loc="outside upper center", ncols=min(columns, len(labels)))
    return figure


def _beside(trials: DataFrame) -> DataFrame:
    """Trials with l2 in percent and a place on the axis, the methods of one level side by side."""
    rank = trials.method.map({name: k for k, name in enumerate(trials.method.unique())})
    level = 100 * trials.level
    shift = 0.006 * np.ptp(level) * (rank - rank.max() / 2)
    return trials.assign(**{"l2 (%)": 100 * trials.l2, "place": level + shift})


def plot_weights(
    misfits: Floats, alphas: Sequence[float], betas: Sequence[float], conditions: Sequence[str]
) -> Figure:
    """Misfit of held-out samples by the two weights of spline-ADO, geometric means over systems.

    Parameters
    ----------
    misfits : ndarray, shape (a, b, systems, conditions)
        Over the spread of the motion.
    alphas, betas : sequence of float
        Weights of the physics loss (rows) and of the terms (columns).
    conditions : sequence of str
        One panel each, and one for all.
    """
    figure, panels = plt.subplots(1, len(conditions) + 1, figsize=(9.5, 3))
    parts = [misfits[..., k] for k in range(len(conditions))]
    for axes, title, values in zip(panels, (*conditions, "all"), (*parts, misfits), strict=True):
        logarithms = np.log(values).reshape(len(alphas), len(betas), -1).mean(axis=2)
        axes.imshow(logarithms, cmap="Blues", aspect="auto", alpha=0.6)
        for (i, j), value in np.ndenumerate(100 * np.exp(logarithms)):
            axes.text(j, i, f"{value:.3g} %", ha="center", va="center")
        axes.set(title=title, xlabel=r"$\beta$")
        axes.set_xticks(range(len(betas)), [f"{b:g}" for b in betas])
        axes.set_yticks(range(len(alphas)), [f"{a:g}" for a in alphas])
        axes.grid(visible=False)
    panels[0].set_ylabel(r"$\alpha$")
    return figure


def plot_shares(shares: DataFrame) -> Figure:
    """Share of trials whose terms are all right, in every condition and system.

    Parameters
    ----------
    shares : DataFrame
        From 0 to 1; a row a system, and columns by condition and level: one panel a condition.
    """
    import seaborn as sns

    conditions = shares.columns.unique("condition")
    figure, panels = plt.subplots(
        1, len(conditions), figsize=(9.5, 3.4), sharey=True, squeeze=False,
        width_ratios=[shares[condition].shape[1] for condition in conditions],
    )  # fmt: skip
    for axes, condition in zip(panels[0], conditions, strict=True):
        levels = [f"{100 * level:.0f}" for level in shares[condition]]
        sns.heatmap(
            100 * shares[condition], xticklabels=levels, vmin=0, vmax=100, cmap="Blues",
            annot=True, fmt=".0f", cbar=False, linewidths=1.5, annot_kws={"size": 9}, ax=axes,
        )  # fmt: skip
        axes.set(title=_TITLES[condition], ylabel="")
        axes.set_xlabel("level (%)" if condition == "noise" else "rate (%)")
        axes.tick_params(length=0, rotation=0)
    return figure


def plot_methods(trials: DataFrame) -> Figure:
    """Relative error of several methods on several systems; open where the terms are wrong.

    Parameters
    ----------
    trials : DataFrame
        One trial of each system, method and source (see `tabulate`); one panel a source.
    """
    sources, methods, systems = (trials[name].unique() for name in ("source", "method", "system"))
    shape = {"figsize": (10.5, 4.4), "sharey": True, "squeeze": False}
    figure, (panels,) = plt.subplots(1, len(sources), **shape)
    for axes, source in zip(panels, sources, strict=True):
        for k, method in enumerate(methods):
            chosen = trials[(trials.source == source) & (trials.method == method)]
            place = np.arange(len(chosen)) + 0.13 * (k - (len(methods) - 1) / 2)
            style = {"marker": MARKERS[method], "color": COLOURS[method], "ms": 8, "mew": 1.5}
            for exact, face in ((True, COLOURS[method]), (False, "white")):
                at = (chosen.exact == exact).to_numpy()
                axes.plot(place[at], 100 * chosen.l2[at], ls="", mfc=face, **style)
            axes.plot([], [], ls="", label=method, **style)
        axes.set(title=source, yscale="log")
        axes.set_xticks(range(len(systems)), systems, rotation=35, ha="right")
        axes.grid(axis="x", visible=False)
    panels[0].plot([], [], "o", ms=8, color="0.4", mfc="white", mew=1.5, label="open: wrong terms")
    panels[0].set_ylabel(r"relative $\ell_2$ error (%)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure


def plot_pulls(pulls: Mapping[str, Floats]) -> Figure:
    """Errors of the coefficients in units of their standard errors, one column a system.

    Parameters
    ----------
    pulls : dict of str to ndarray
        ``(found - true) / standard error`` of all coefficients, by system.
    """
    figure, axes = plt.subplots(figsize=(8, 3.8))
    axes.axhspan(-2, 2, color="0.92")
    axes.axhline(0, color="k", lw=0.8)
    for column, values in enumerate(pulls.values()):
        spread = np.linspace(-0.25, 0.25, len(values))
        axes.plot(column + spread, values, "oC0", ms=4)
    axes.set_xticks(range(len(pulls)), list(pulls), rotation=20)
    axes.set_ylabel("error / standard error")
    axes.grid(axis="x", visible=False)
    return figure


def plot_pull_distribution(pulls: Mapping[str, Floats]) -> Figure:
    """How many coefficients are within so many standard errors of the truth.

    Parameters
    ----------
    pulls : dict of str to ndarray
        ``(found - true) / standard error`` of all coefficients, by condition, in rising order.
    """
    import seaborn as sns

    figure, axes = plt.subplots(figsize=(7, 4))
    reach = np.linspace(0, 4, 200)
    axes.plot(reach, 100 * halfnorm.cdf(reach), color="0.8", lw=7, label="if they are right")
    colours = plt.get_cmap("viridis")(np.linspace(0, 0.9, len(pulls)))
    for (name, values), colour in zip(pulls.items(), colours, strict=True):
        sns.ecdfplot(x=abs(values), stat="percent", color=colour, lw=1.4, label=name, ax=axes)
    axes.set(xlim=(0, 4), ylim=(0, 102), xlabel="|error| / standard error")
    axes.set_ylabel("coefficients below (%)")
    axes.legend(loc="lower right")
    return figure


def plot_verdicts(sweeps: Mapping[str, Mapping[str, Sequence[str]]]) -> Figure:
    """How often a law is exact, and whether the solver said so, in several sweeps.

    Parameters
    ----------
    sweeps : dict of str to dict of str to sequence of str
        Outcomes of the trials, each a key of `VERDICTS`, by value of the setting, by the label of
        the setting.
    """
    widths = [len(sweep) + 1 for sweep in sweeps.values()]
    figure, panels = plt.subplots(
        1, len(sweeps), figsize=(9, 3.3), sharey=True, width_ratios=widths
    )
    for axes, (label, sweep) in zip(panels, sweeps.items(), strict=True):
        bottom = np.zeros(len(sweep))
        for verdict, (colour, hatch) in VERDICTS.items():
            share = np.array([100 * list(o).count(verdict) / len(o) for o in sweep.values()])
            axes.bar(
                list(sweep), share, bottom=bottom, color=colour, hatch=hatch, edgecolor="white",
                label=verdict,
            )  # fmt: skip
            bottom += share
        axes.set_xlabel(label)
        axes.grid(visible=False)
    panels[0].set_ylabel("trials (%)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


# -------------------------------------------------------------------------- the paper's own numbers


def plot_recomputed(differences: Mapping[str, float]) -> Figure:
    """How far printed l2 errors are from those of the printed equations, in units of rounding.

    Parameters
    ----------
    differences : dict of str to float
        ``|recomputed - printed|`` over what rounding can make of it, by the name of the row;
        what is less than 0.001 is drawn there.
    """
    figure, axes = plt.subplots(figsize=(7.5, 0.32 * len(differences) + 1.1))
    rows = np.arange(len(differences))[::-1]
    values = np.maximum(list(differences.values()), 1e-3)
    explained = values <= 1
    axes.axvspan(0.8e-3, 1, color="0.92", zorder=0)
    axes.plot(values[explained], rows[explained], "o", label="within the rounding of the print")
    axes.plot(values[~explained], rows[~explained], "s", label="not explained by rounding")
    axes.set(xscale="log", xlim=(0.8e-3, 1e2), ylim=(-0.7, len(rows) - 0.3))
    axes.set_yticks(rows, list(differences))
    axes.set_xlabel("|recomputed - printed| / largest effect of rounding")
    axes.grid(axis="y", visible=False)
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def plot_ratios(ratios: Mapping[str, Mapping[str, Mapping[str, float]]]) -> Figure:
    """Coefficients over the true ones, term by term, one panel a system.

    Parameters
    ----------
    ratios : dict of str to dict of str to dict of str to float
        Ratios by system, by where they come from and by term; those that are not positive, of
        terms that were not found, are left out.
    """
    heights = [len(next(iter(series.values()))) for series in ratios.values()]
    figure, panels = plt.subplots(
        len(ratios), 1, figsize=(7.5, 0.23 * sum(heights) + 2), sharex=True, squeeze=False,
        height_ratios=heights,
    )  # fmt: skip
    for axes, (system, series) in zip(panels[:, 0], ratios.items(), strict=True):
        terms = list(next(iter(series.values())))
        rows = np.arange(len(terms))[::-1]
        for value in (1, 10):
            axes.axvline(value, color="k", lw=0.8, ls=":")
        for (label, by_term), marker in zip(series.items(), "so^v", strict=False):
            values = np.array([by_term[term] for term in terms])
            axes.plot(np.where(values > 0, values, np.nan), rows, marker, mfc="none", label=label)
        axes.set(xscale="log", xlim=(0.4, 20), title=system, ylim=(-0.7, len(rows) - 0.3))
        axes.set_yticks(rows, terms)
        axes.set_xticks((0.5, 1, 2, 5, 10, 20), ("0.5", "1", "2", "5", "10", "20"))
        axes.minorticks_off()
        axes.grid(axis="y", visible=False)
    panels[-1, 0].set_xlabel("coefficient / true coefficient")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def plot_what_l2_sees(shares: Mapping[str, Mapping[str, float]]) -> Figure:
    """What part of the squared norm of each true law its constants make up.

    Parameters
    ----------
    shares : dict of str to dict of str to float
        Parts by system, and by kind of term; the parts of a system add up to one.
    """
    figure, axes = plt.subplots(figsize=(7.5, 3.2))
    names = list(shares)
    left = np.zeros(len(names))
    for index, kind in enumerate(next(iter(shares.values()))):
        values = np.array([shares[name][kind] for name in names])
        axes.barh(names, values, left=left, color=("C0", "C4", "C2")[index], label=kind)
        left += values
    axes.invert_yaxis()
    axes.set(xlim=(0, 1), xlabel="share of the squared norm")
    axes.grid(axis="y", visible=False)
    figure.legend(loc="outside upper center", ncols=3)
    return figure
