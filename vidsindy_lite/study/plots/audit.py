"""Figures on the paper's own numbers."""

from collections.abc import Mapping

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure


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
