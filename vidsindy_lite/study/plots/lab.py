"""Figures of the lab experiment. All lengths are in millimetres."""

from collections.abc import Mapping

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from ...arrays import Floats
from ...cameras import Rig
from .common import SPACE, finish_space


def plot_table(
    rig: Rig, x: Floats, found: Mapping[str, Floats], marked: Mapping[str, Floats]
) -> Figure:
    """Paths from above with what was reconstructed, and the scene in space.

    Parameters
    ----------
    rig : Rig
        Three cameras.
    x : ndarray, shape (k, n, 3)
        True paths.
    found : dict of str to ndarray, shape (k, n, 3)
        Reconstructed paths by model.
    marked : dict of str to ndarray, shape (3,)
        Points that are drawn as pentagrams.
    """
    figure = plt.figure(figsize=(10.5, 4.2), layout="compressed")
    panels = figure.subplot_mosaic(
        [["above", "space"]], width_ratios=(1, 1.15), per_subplot_kw={"space": SPACE}
    )
    above, space = panels["above"], panels["space"]
    for path in x:
        space.plot(*path.T, color="k", lw=1.2)
    for i, camera in enumerate(rig.cameras):
        place = np.asarray(camera.position)
        middle = place - camera.normal * np.linalg.norm(place - x.mean((0, 1)))
        space.plot(*np.transpose([place, middle]), "s:", color="0.4", ms=8, lw=1, markevery=2)
        space.text(*place + [0, 0, 130], f"$C_{i + 1}$", ha="center")
    space.plot([0, 750, 750, 0, 0], [0, 0, 750, 750, 0], 0, color="0.6", lw=0.8)
    space.set_zlim3d(0, space.get_zlim3d()[1])
    finish_space(space, azimuth=-65, elevation=25, zoom=1.12, unit="mm")
    space.locator_params(nbins=3)
    for k, path in enumerate(x):
        above.plot(*path[:, :2].T, color="0.75", lw=5, label="truth" if k == 0 else None)
    for i, (name, paths) in enumerate(found.items()):
        for k, path in enumerate(paths):
            above.plot(*path[:, :2].T, f"C{1 - i}", lw=1.3, label=name if k == 0 else None)
    for (name, point), style in zip(marked.items(), ("*k", "*C4"), strict=True):
        above.plot(*point[:2], style, ms=12, mec="white", mew=0.6, ls="", label=name)
    above.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
    figure.legend(*above.get_legend_handles_labels(), loc="outside upper center", ncols=5)
    return figure


def plot_orthographic_error(
    t: Floats, measured: Floats, predicted: Floats, ratio: Floats, by_distance: Mapping[str, Floats]
) -> Figure:
    """Error of the orthographic model along the paths, and as the cameras move away.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Seconds.
    measured, predicted : ndarray, shape (k, n)
        Length of the error, by path.
    ratio : ndarray, shape (m,)
        Depth range of the paths over the distance of the cameras.
    by_distance : dict of str to ndarray, shape (m,)
        Root mean square of the error, measured first and then predicted.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2))
    for k, (error, first_order) in enumerate(zip(measured, predicted, strict=True)):
        left.plot(t, error, f"C{k}", label=f"path {k + 1}")
        left.plot(t, first_order, "--k", lw=1)
    left.plot([], [], "--k", lw=1, label="first order")
    left.set(title="along the paths", xlabel="time (s)", ylabel="error (mm)", ylim=(0, None))
    left.legend()
    for (name, error), style in zip(by_distance.items(), ("oC1", "--k"), strict=True):
        right.loglog(ratio, error, style, label=name)
    right.set(title="as the cameras move away", ylabel="rms error (mm)")
    right.set_xticks(ratio, [f"{value:.2g}" for value in ratio])
    right.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    right.yaxis.set_major_formatter("{x:g}")
    right.minorticks_off()
    right.set_xlabel("depth range / distance")
    right.legend()
    return figure


def plot_anywhere(errors: Floats, published: float) -> Figure:
    """Distribution of the error at one point over many rigs, and the published error.

    Parameters
    ----------
    errors : ndarray, shape (n,)
    published : float
    """
    figure, axes = plt.subplots(figsize=(7, 3.8))
    axes.ecdf(errors, color="C1", label="orthographic cameras, somewhere around the table")
    axes.axvline(published, color="k", ls="--", lw=1.2, label=f"the paper's, {published:.2f} mm")
    axes.set(xlabel="error at the marked point (mm)", ylabel="share of rigs below", xlim=(0, None))
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def plot_model_errors(errors: Mapping[str, Floats]) -> Figure:
    """Distribution of the error in space by the model of the camera.

    Parameters
    ----------
    errors : dict of str to ndarray, shape (n,)
        Length of the error in each frame, by model.
    """
    figure, axes = plt.subplots(figsize=(8, 4))
    for i, (name, error) in enumerate(errors.items()):
        axes.ecdf(error, color=f"C{(1, 0, 2, 3)[i]}", ls=("-", "--", "-.", ":")[i], label=name)
    axes.axvline(1, color="0.6", lw=0.8)
    axes.set(xscale="log", xlabel="error in space (mm)", ylabel="share of frames below")
    figure.legend(loc="outside upper center", ncols=2)
    return figure
