"""Figures of the report on one's own videos."""

import matplotlib.pyplot as plt
import numpy as np

from .plots import _finish


def plot_path(t, x, curve):
    """A reconstructed path and the curve that obeys the law, over time and in space.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time units.
    x : ndarray, shape (n, 3)
        Reconstructed positions, scene units; NaN where missing.
    curve : ndarray, shape (n, 3)
        The fitted curve; NaN outside its stretches.
    """
    figure = plt.figure(figsize=(10.5, 4.8))
    panels = figure.subplot_mosaic(
        [["x", "space"], ["y", "space"], ["z", "space"]],
        per_subplot_kw={"space": {"projection": "3d", "proj_type": "ortho"}}, width_ratios=(1.1, 1),
    )  # fmt: skip
    missing = np.isnan(x).any(axis=1)
    for i, name in enumerate("xyz"):
        axes = panels[name]
        axes.fill_between(
            t, 0, 1, where=missing, color="0.85", step="mid", transform=axes.get_xaxis_transform()
        )
        axes.plot(t, x[:, i], color="0.75", lw=4)
        axes.plot(t, curve[:, i], color="C0", lw=1)
        axes.set_ylabel(name)
        axes.label_outer()
    panels["z"].set_xlabel("time (units of the equations); x, y, z in scene units")
    panels["space"].plot(*x.T, color="0.75", lw=4, label="reconstructed")
    panels["space"].plot(*curve.T, color="C0", lw=1, label="curve that obeys the law")
    panels["space"].plot([], [], color="0.85", lw=8, label="not seen")
    _finish(panels["space"], azimuth=-60, elevation=25, zoom=0.85)
    figure.legend(*panels["space"].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def plot_residuals(t, residuals, limit):
    """By how many pixels the reconstructed target misses each track, over time.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time units.
    residuals : sequence of ndarray, shape (n, 2)
        Pixels, one per camera; NaN where there is none.
    limit : float
        Pixels that tracking can be blamed for.
    """
    shared = {"sharex": True, "sharey": True, "squeeze": False}
    height = 1.4 * len(residuals) + 0.8
    figure, panels = plt.subplots(len(residuals), 1, figsize=(9, height), **shared)
    for i, (axes, residual) in enumerate(zip(panels[:, 0], residuals, strict=True)):
        axes.semilogy(t, np.maximum(np.hypot(*residual.T), 1e-6), f".C{i}", ms=3)
        axes.axhline(limit, color="0.4", lw=1, ls="--")
        axes.set_title(f"camera {i + 1}")
    figure.supylabel("residual (px)", fontsize=11)
    panels[-1, 0].set_xlabel("time (units of the equations)")
    return figure
