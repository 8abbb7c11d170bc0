"""Figures of the scoreboard: who finds the law, under which errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from ...arrays import Floats
from .robustness import COLOURS, MARKERS

if TYPE_CHECKING:  # pandas is imported where a frame is made
    from pandas import DataFrame


def plot_standings(panels: Mapping[str, DataFrame]) -> Figure:
    """Share of exact laws by condition and method.

    Parameters
    ----------
    panels : dict of str to DataFrame
        By title: shares from 0 to 1, a row a condition, a column a method; NaN where a method did
        not take part.
    """
    heights = [len(shares) + 1.5 for shares in panels.values()]
    figure, grid = plt.subplots(
        len(panels), 1, figsize=(7.5, 0.34 * sum(heights) + 1), sharex=True, squeeze=False,
        height_ratios=heights,
    )  # fmt: skip
    for axes, (title, shares) in zip(grid[:, 0], panels.items(), strict=True):
        rows = np.arange(len(shares))[::-1]
        # Later ones lie on top: Gauss-Newton is drawn last, and the others a little apart.
        for k, method in reversed(list(enumerate(map(str, shares)))):
            style = {"color": COLOURS[method], "marker": MARKERS[method], "label": method}
            place = rows + 0.11 * (k - (shares.shape[1] - 1) / 2)
            axes.plot(100 * shares[method], place, ls="", ms=8, clip_on=False, **style)
        axes.set_yticks(rows, shares.index)
        axes.set(xlim=(0, 100), ylim=(-0.6, len(shares) - 0.4), title=title)
    grid[-1, 0].set_xlabel("exact laws (%)")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles[::-1], labels[::-1], loc="outside upper center", ncols=3)
    return figure


def plot_lorenz_grids(grids: Mapping[str, Floats], levels: Floats, lengths: Floats) -> Figure:
    """Share of exact laws over noise and length, one panel a method.

    Parameters
    ----------
    grids : dict of str to ndarray, shape (m, k)
        Shares from 0 to 1, by method.
    levels : ndarray, shape (m,)
        Noise over the spread.
    lengths : ndarray, shape (k,)
        Time units.
    """
    figure, panels = plt.subplots(
        1, len(grids), figsize=(4.1 * len(grids), 0.42 * len(levels) + 1.2), sharey=True,
        squeeze=False,
    )  # fmt: skip
    for axes, (method, rates) in zip(panels[0], grids.items(), strict=True):
        axes.imshow(100 * rates, vmin=0, vmax=100, cmap="Blues", aspect="auto")
        for (row, column), rate in np.ndenumerate(rates):
            colour = "white" if rate > 0.6 else "black"
            text = f"{100 * rate:.0f}"
            axes.text(column, row, text, ha="center", va="center", size=9, color=colour)
        axes.set_xticks(range(len(lengths)), [f"{length:g}" for length in lengths])
        axes.set_yticks(range(len(levels)), [f"{100 * level:g}" for level in levels])
        axes.set(title=method, xlabel="length (time units)")
        axes.tick_params(length=0)
        axes.grid(False)
        axes.spines[:].set_visible(False)
    panels[0, 0].set_ylabel("noise (% of the spread)")
    return figure
