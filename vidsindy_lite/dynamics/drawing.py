"""The path of laws as a picture: what a reader looks at before believing a law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..arrays import Bools
from .path import Plateau

if TYPE_CHECKING:  # matplotlib takes a second to import, and few discoveries are drawn
    from matplotlib.figure import Figure


def draw_path(path: Sequence[Sequence[Plateau]], support: Bools, sides: dict[int, str]) -> Figure:
    """Number of terms of each equation over the error that is tolerated; see `plot_path`."""
    import matplotlib.pyplot as plt
    from matplotlib.ticker import MaxNLocator

    figure, panels = plt.subplots(
        1, len(sides), figsize=(2.9 * len(sides), 2.8), sharex=True, sharey=True, squeeze=False,
        layout="constrained",
    )  # fmt: skip
    for axes, (j, side) in zip(panels[0], sides.items(), strict=True):
        plateaus = path[j]
        edges = [plateaus[0].low, *(plateau.high for plateau in plateaus)]
        counts = [int(plateau.terms.sum()) for plateau in plateaus]
        axes.stairs(counts, edges, color="0.4", baseline=None, label="all laws")
        for own in (p for p in plateaus if (p.terms == support[:, j]).all()):
            axes.hlines(own.terms.sum(), own.low, own.high, color="C1", lw=5, label="the law")
        axes.set(xscale="log", xlabel="tolerated error / spread", title=side)
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    panels[0, 0].set(ylabel="terms", ylim=(0, None))
    drawn = [axes.get_legend_handles_labels() for axes in panels[0]]
    shown = {label: one for pair in drawn for one, label in zip(*pair, strict=True)}
    figure.legend(shown.values(), shown, loc="outside upper center", ncols=2)
    return figure
