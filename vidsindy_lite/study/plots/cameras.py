"""Figures of view planes, rigs, calibration and reconstruction, in the lab, too."""

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from mpl_toolkits.mplot3d import Axes3D

from ...arrays import Floats
from ...cameras import Camera, PerspectiveCamera, Rig
from .common import SPACE, finish_space

_SIGHTS = 5  # instants at which lines of sight are drawn
_DEPTH = 0.15  # of a pinhole's distance from the path: where its image is drawn


def plot_view_plane(camera: Camera, x: Floats) -> Figure:
    """A curve in space, its projection on one view plane, and the plane's axes (Fig. S1).

    Parameters
    ----------
    camera : Camera
        Calibrated.
    x : ndarray, shape (n, 3)
        Curve, scene units.
    """
    figure, axes = plt.subplots(figsize=(7.5, 5.2), subplot_kw=SPACE)
    flat = _on_plane(camera, camera.project(x))
    axes.plot(*x.T, lw=1, label="3D trajectory")
    axes.plot(*flat.T, lw=1, label="its projection on the view plane")
    for start, end in zip(x[:: len(x) // 12], flat[:: len(x) // 12], strict=True):
        axes.plot(*np.transpose([start, end]), color="0.6", lw=0.6, ls=":")
    _draw_plane(axes, camera, "C1")
    place, reach = np.asarray(camera.position), 180 * float(camera.scale or 0)
    axes.scatter(*place, color="k", s=15)
    halo = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}
    for axis, name in zip((*camera.rows, camera.normal), ("X'", "Y'", "Z'"), strict=True):
        axes.quiver(*place, *(reach * axis), color="k", lw=1.2, arrow_length_ratio=0.15)
        axes.text(*(place + 1.2 * reach * axis), name, ha="center", va="center", bbox=halo)
    axes.text(*(place - 0.35 * reach * camera.rows[1]), "$C_1$", ha="center", bbox=halo)
    finish_space(axes, azimuth=-40, elevation=8)
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def plot_rotation_accuracy(tilt: Floats, errors: Mapping[str, Floats]) -> Figure:
    """Error ``|R n - e_z|`` of several ways to compute R, for normals near the z axis.

    Parameters
    ----------
    tilt : ndarray, shape (n,)
        Angle between normal and e_z, rad.
    errors : dict of str to ndarray, shape (n,)
    """
    figure, axes = plt.subplots()
    for (name, error), marker in zip(errors.items(), "osv^", strict=False):
        axes.loglog(tilt, np.maximum(error, 1e-17), marker, label=name)
    axes.set(xlabel="angle between normal and z axis (rad)", ylabel=r"$\|R\,n - e_z\|$")
    axes.legend()
    return figure


def plot_independence(d: Floats, turned: Mapping[str, Floats]) -> Figure:
    """The three coordinates of R x_p as the plane moves along its normal, one panel per R.

    Parameters
    ----------
    d : ndarray, shape (n,)
        Constant of the plane's equation, scene units.
    turned : dict of str to ndarray, shape (n, 3)
        R x_p for each d, by the name of the rotation.
    """
    figure, panels = plt.subplots(1, len(turned), figsize=(9, 3.6), sharey=True)
    names = ("$x_{rp}$", "$y_{rp}$", "$z_{rp}$")
    for axes, (title, values) in zip(panels, turned.items(), strict=True):
        for value, name, style in zip(values.T, names, ("-", "--", ":"), strict=True):
            axes.plot(d, value, style, label=name)
        axes.set(title=title, xlabel="D (scene units)")
    panels[0].set_ylabel("coordinate (scene units)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center")
    return figure


def plot_rig(rig: Rig, x: Floats) -> Figure:
    """The cameras of a rig around a trajectory, their images of it, and some lines of sight.

    An orthographic camera is its view plane; a perspective one its pinhole and the pyramid of what
    it sees, cut off where its image is drawn.

    Parameters
    ----------
    rig : Rig
        Calibrated.
    x : ndarray, shape (n, 3)
        Trajectory, scene units; NaN rows are left out.
    """
    figure, axes = plt.subplots(figsize=(7.5, 5.5), subplot_kw=SPACE)
    axes.plot(*x.T, color="k", lw=0.8)
    shown = np.flatnonzero(np.isfinite(x).all(axis=1))
    points = x[shown[np.linspace(0, len(shown) - 1, _SIGHTS).astype(int)]]
    axes.scatter(*points.T, color="k", s=8)
    for i, camera in enumerate(rig.cameras):
        # A pinhole's image is drawn close to it.
        away = _DEPTH * float(np.linalg.norm(points.mean(axis=0) - np.asarray(camera.position)))
        seen = _on_plane(camera, camera.project(x), away)
        axes.plot(*seen.T, color=f"C{i}", lw=0.8, label=f"camera {i + 1}")
        _draw_plane(axes, camera, f"C{i}", away)
        ends = _on_plane(camera, camera.project(points))  # or the pinhole
        for point, end in zip(points, ends, strict=True):
            axes.plot(*np.transpose([point, end]), color=f"C{i}", lw=0.5, ls=":")
    finish_space(axes, azimuth=-40, elevation=22)
    figure.legend(loc="outside upper center", ncols=len(rig.cameras))
    return figure


def plot_tracks(tracks: Sequence[Floats], cameras: Sequence[Camera]) -> Figure:
    """The pixel track of each camera in the frame of its image.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2)
    cameras : sequence of Camera
    """
    figure, panels = plt.subplots(1, len(tracks), figsize=(3.2 * len(tracks), 3.6))
    for i, (axes, track, camera) in enumerate(zip(panels, tracks, cameras, strict=True)):
        width, height = camera.image_size
        axes.plot(*track.T, color=f"C{i}", lw=0.8)
        axes.set(title=f"camera {i + 1}", xlabel="u (px)", aspect="equal")
        axes.set(xlim=(-0.5, width - 0.5), xticks=(0, width // 2, width))
        axes.set(ylim=(height - 0.5, -0.5), yticks=(0, height // 2, height))
        axes.spines[["top", "right"]].set_visible(True)
    panels[0].set_ylabel("v (px)")
    return figure


def plot_calibration_errors(errors: Mapping[str, Floats]) -> Figure:
    """Errors of scale and angle in repeated trials, one panel per learned camera.

    Parameters
    ----------
    errors : dict of str to ndarray, shape (trials, cameras, 2)
        As of `calibration_errors`, by method; learned cameras only.
    """
    cameras = next(iter(errors.values())).shape[1]
    figure, panels = plt.subplots(1, cameras, figsize=(9, 4.2), sharex=True, sharey=True)
    for i, axes in enumerate(panels):
        axes.axhline(0, color="k", lw=0.6)
        axes.axvline(0, color="k", lw=0.6)
        for (name, error), marker in zip(errors.items(), "sov", strict=False):
            scale, angle = error[:, i].T
            axes.plot(100 * scale, 1e3 * angle, marker, ms=4, alpha=0.7, mec="none", label=name)
        axes.set(title=f"camera {i + 2}", xlabel="error of scale (%)")
    panels[0].set_ylabel("error of angle (mrad)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def plot_scale_error(noise: Floats, errors: Mapping[str, Floats]) -> Figure:
    """Spread and bias of the learned scales as the pixel noise grows.

    Parameters
    ----------
    noise : ndarray, shape (k,)
        Standard deviation, px.
    errors : dict of str to ndarray, shape (k, trials)
        Relative errors of the scale, by method.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.8))
    for (name, error), marker in zip(errors.items(), "sov", strict=False):
        left.loglog(noise, 100 * np.sqrt(np.mean(error**2, axis=1)), f"{marker}-", label=name)
        spread = error.std(axis=1) / np.sqrt(error.shape[1])
        mean = 100 * error.mean(axis=1)
        right.errorbar(noise, mean, 200 * spread, fmt=f"{marker}-", label=name)
    right.axhline(0, color="k", lw=0.6)
    left.set(title="rms error", ylabel="rms error of scale (%)")
    right.set(title="bias", ylabel="mean error of scale (%)", xscale="log")
    for axes in (left, right):
        axes.set_xlabel("noise per pixel coordinate (px)")
        axes.set_xticks(noise, [f"{value:g}" for value in noise])
        axes.minorticks_off()
    right.legend(loc="lower left")
    return figure


def plot_reconstruction(t: Floats, truth: Floats, found: Floats, pixel: float) -> Figure:
    """Reconstructed and true coordinates over time, and their difference in pixels.

    Parameters
    ----------
    t : ndarray, shape (n,)
    truth, found : ndarray, shape (n, 3)
        Scene units.
    pixel : float
        Scene units per pixel.
    """
    figure, (above, below) = plt.subplots(2, 1, figsize=(8, 5.5), sharex=True)
    above.plot(t, truth, color="0.7", lw=4, label=("truth", "", ""))
    for i, (name, style) in enumerate(zip("xyz", "ov^", strict=True)):
        above.plot(t, found[:, i], f"C{i}", lw=1, label=name)
        below.plot(t, (found - truth)[:, i] / pixel, f"C{i}{style}", ms=2)
    above.set(ylabel="coordinate (scene units)")
    below.set(ylabel="error (px)", xlabel="time (time units)")
    figure.legend(loc="outside upper center", ncols=4)
    return figure


def plot_residuals(t: Floats, residuals: Sequence[Floats], limit: float) -> Figure:
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


def plot_lags(lags: Floats, missed: Floats, limit: float) -> Figure:
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


def _on_plane(camera: Camera, pixels: Floats, away: float = 0.0) -> Floats:
    """The pixels' places in space: on the view plane, of a pinhole on one so far before it."""
    in_plane = (camera.plane_coordinates(pixels) - camera.offset) @ camera.rows
    place = np.asarray(camera.position)
    if isinstance(camera, PerspectiveCamera):
        return place + away * (in_plane - camera.normal)
    return place + in_plane


def _draw_plane(axes: Axes3D, camera: Camera, color: str, away: float = 0.0) -> None:
    width, height = camera.image_size
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height], [0, 0]]) - 0.5
    edge = _on_plane(camera, corners, away)
    axes.plot(*edge.T, color=color, lw=1)
    axes.plot_trisurf(*edge[:4].T, triangles=[[0, 1, 2], [0, 2, 3]], color=color, alpha=0.12)
    if isinstance(camera, PerspectiveCamera):
        for corner in edge[:4]:
            axes.plot(*np.transpose([camera.position, corner]), color=color, lw=1)


# -------------------------------------------------------------------------- the lab, in millimetres


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
