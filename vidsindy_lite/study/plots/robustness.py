"""Figures of the notebook on robustness, one function each.

Every function takes what is plotted and returns a matplotlib Figure. The look is that of
``vidsindy.mplstyle``; colours are its cycle, C0 to C6.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import halfnorm

_STYLES = {
    "ours": ("C0", "o"), "PySINDy": ("C1", "s"), "E-SINDy": ("C2", "^"),
    "WeakSINDy": ("C3", "v"), "Model-A": ("C4", "D"),
}  # fmt: skip
_TITLES = {"noise": "noise", "blocks": "random blocks missing", "fibers": "fibers missing"}


def plot_robustness(curves, published=None):
    """Relative error and number of wrong terms against noise and missing data (Fig. 3, S4-S10).

    Parameters
    ----------
    curves : dict of str to dict of str to dict of float to sequence of TrialResult
        Repeated trials by level, by method, by condition: one column of panels a condition. Lines
        join the means over the trials, bars reach from the lowest to the highest.
    published : dict of str to dict of float to float, optional
        The paper's relative errors by level, by condition.
    """
    widths = [1 + max(map(len, methods.values())) for methods in curves.values()]
    figure, grid = plt.subplots(
        2, len(curves), figsize=(9 if len(curves) > 1 else 6.5, 5), sharex="col", sharey="row",
        squeeze=False, width_ratios=widths,
    )  # fmt: skip
    for column, (condition, methods) in zip(grid.T, curves.items(), strict=True):
        for k, (method, by_level) in enumerate(methods.items()):
            colour, marker = _STYLES[method]
            levels = 100 * np.array(list(by_level))
            beside = 0.006 * np.ptp(levels) * (k - (len(methods) - 1) / 2)
            errors = [[100 * r.score.l2 for r in results] for results in by_level.values()]
            wrong = [[r.wrong_terms for r in results] for results in by_level.values()]
            for axes, values in zip(column, (errors, wrong), strict=True):
                means = np.array([np.mean(v) for v in values])
                reach = np.abs([[np.min(v), np.max(v)] for v in values] - means[:, None]).T
                style = {"color": colour, "marker": marker, "lw": 1.4, "label": method}
                bars = {"ecolor": (colour, 0.45), "elinewidth": 1, "capsize": 2}
                axes.errorbar(levels + beside, means, reach, **style, **bars)
        if published:
            known = 100 * np.array(list(published[condition].items()))
            column[0].errorbar(*known.T, fmt="*k", ms=10, label="paper (Table 2)")
        column[0].set_title(_TITLES[condition])
        column[1].set_xlabel("level (%)" if condition == "noise" else "rate (%)")
    grid[0, 0].set(yscale="log", ylabel=r"relative $\ell_2$ error (%)")
    grid[1, 0].set(ylabel="wrong terms", ylim=(-0.5, max(3.5, grid[1, 0].get_ylim()[1])))
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure


def plot_shares(shares):
    """Share of trials whose terms are all right, in every condition and system.

    Parameters
    ----------
    shares : dict of str to dict of str to dict of float to float
        Shares by level, by system, by condition: one panel a condition.
    """
    widths = [len(next(iter(systems.values()))) for systems in shares.values()]
    figure, panels = plt.subplots(
        1, len(shares), figsize=(9.5, 3.4), sharey=True, squeeze=False, width_ratios=widths
    )
    for axes, (condition, systems) in zip(panels[0], shares.items(), strict=True):
        values = np.array([[100 * v for v in by_level.values()] for by_level in systems.values()])
        levels = [f"{100 * level:.0f}" for level in next(iter(systems.values()))]
        axes.pcolormesh(values, vmin=0, vmax=100, cmap="Blues", edgecolors="white", lw=1.5)
        for (row, column), value in np.ndenumerate(values):
            style = {"color": "white" if value > 60 else "black", "size": 9}
            axes.text(column + 0.5, row + 0.5, f"{value:.0f}", ha="center", va="center", **style)
        axes.set_xticks(np.arange(len(levels)) + 0.5, levels)
        axes.set_title(_TITLES[condition])
        axes.set_xlabel("level (%)" if condition == "noise" else "rate (%)")
        axes.grid(visible=False)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
    panels[0, 0].set_yticks(np.arange(len(systems)) + 0.5, systems)
    panels[0, 0].invert_yaxis()
    return figure


def plot_pull_distribution(pulls):
    """How many coefficients are within so many standard errors of the truth.

    Parameters
    ----------
    pulls : dict of str to ndarray
        ``(found - true) / standard error`` of all coefficients, by condition, in rising order.
    """
    figure, axes = plt.subplots(figsize=(7, 4))
    reach = np.linspace(0, 4, 200)
    axes.plot(reach, 100 * halfnorm.cdf(reach), color="0.8", lw=7, label="if they are right")
    colours = plt.get_cmap("viridis")(np.linspace(0, 0.9, len(pulls)))
    for (name, values), colour in zip(pulls.items(), colours, strict=True):
        ordered = np.sort(np.abs(values))
        share = 100 * np.arange(1, len(ordered) + 1) / len(ordered)
        axes.step(ordered, share, where="post", color=colour, lw=1.4, label=name)
    axes.set(xlim=(0, 4), ylim=(0, 102), xlabel="|error| / standard error")
    axes.set_ylabel("coefficients below (%)")
    axes.legend(loc="lower right")
    return figure
