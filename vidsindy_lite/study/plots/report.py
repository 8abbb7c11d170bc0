"""Figures of the report on one's own videos."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patheffects import withStroke

from .pipeline import _over_time_and_in_space, _show


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
    curves = {
        "reconstructed": (x, {"color": "0.75", "lw": 4}),
        "curve that obeys the law": (curve, {"color": "C0", "lw": 1}),
    }
    missing, unit = np.isnan(x).any(axis=1), "units of the equations"
    return _over_time_and_in_space(t, curves, missing, "not seen", unit)


def plot_views(images, titles, tracks, index):
    """One frame of each video, the whole track over it, and a ring where the target is.

    Parameters
    ----------
    images : sequence of ndarray, shape (height, width, 3), uint8
        Blue-green-red, as a video reader gives them; sizes may differ.
    titles : sequence of str
    tracks : sequence of ndarray, shape (n, 2)
        Pixels of the target in all frames of each video.
    index : int
        Where on the tracks the images were taken.
    """
    columns = min(len(images), 3)
    rows = -(-len(images) // columns)
    size = (3.5 * columns, 3.2 * rows)
    figure, grid = plt.subplots(rows, columns, figsize=size, squeeze=False)
    halo = [withStroke(linewidth=3.5, foreground="white")]
    for axes, image, title, track in zip(grid.flat, images, titles, tracks, strict=False):
        height, width = image.shape[:2]
        _show(axes, image)
        axes.plot(*track.T, color="white", lw=0.7)
        axes.plot(*track[index], "o", ms=22, mfc="none", mec="C0", mew=2, path_effects=halo)
        axes.set_title(title, fontsize=11)
        axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
        axes.set(xticks=(0, width // 2, width), yticks=(0, height // 2, height))
        axes.set(xlabel="u (px)", ylabel="v (px)")
    for axes in grid.flat[len(images) :]:
        axes.remove()
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


def plot_lags(lags, missed, limit):
    """How well the views agree at each lag of one video.

    Parameters
    ----------
    lags : ndarray, shape (k,)
        Frames.
    missed : ndarray, shape (k,)
        Disagreement, pixels.
    limit : float
        Pixels that tracking can be blamed for.
    """
    figure, axes = plt.subplots(figsize=(7.5, 3.8))
    axes.semilogy(lags, missed, "o-", ms=4, lw=1)
    axes.axhline(limit, color="0.4", lw=1, ls="--")
    axes.set(xlabel="lag of the second video (frames)", ylabel="disagreement (px)")
    return figure
