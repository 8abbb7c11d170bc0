"""Figures that more than one notebook, or the report, has; the look of all (``vidsindy.mplstyle``).

A figure of one notebook is drawn there, in a folded cell. Every function takes what is plotted and
returns a matplotlib Figure. Colours are those of the style's cycle, C0 to C6.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d import Axes3D
from scipy.interpolate import make_interp_spline

from ...arrays import Floats, Image
from ...cameras import Camera, PerspectiveCamera, Rig
from ...dynamics import Discovery, PolynomialSystem

#: Axes in space, as matplotlib's ``subplot_kw``.
SPACE = {"projection": "3d", "proj_type": "ortho"}
#: Lines of several curves in one figure.
STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (7, 2)), (0, (1, 1)))
#: Colour and marker of each method.
METHOD_STYLES = {
    "Gauss-Newton": {"color": "C0", "marker": "o"}, "spline-ADO": {"color": "C5", "marker": "P"},
    "PySINDy": {"color": "C1", "marker": "s"}, "E-SINDy": {"color": "C2", "marker": "^"},
    "WeakSINDy": {"color": "C3", "marker": "v"}, "Model-A": {"color": "C4", "marker": "D"},
    "SINDy, oracle": {"color": "0.5", "marker": "*"},
}  # fmt: skip
#: Colour and hatch of each outcome: is the law exact, and what did the solver say of it.
VERDICTS = {
    "exact, ok": ("C0", ""),
    "exact, suspect": ("C5", ""),
    "wrong, suspect": ("C4", "//"),
    "wrong, ok": ("C1", "xx"),
}
#: The measured path or the truth, broad, and over it the curve of a law.
LINES = ({"color": "0.75", "lw": 4}, {"color": "C0", "lw": 1})
#: The truth, and over it a path with gaps.
DASHED = ({"color": "0.4", "ls": "--", "lw": 0.8}, {"color": "C0", "lw": 1.4})


def finish_space(
    axes: Axes3D, azimuth: float, elevation: float, zoom: float = 1.05, unit: str = "scene units"
) -> None:
    """The same scale along three labelled axes, seen from a direction in degrees."""
    extent = np.ptp([axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d()], axis=1)
    axes.set_box_aspect(extent, zoom=zoom)  # one unit is equally long on all three axes
    axes.locator_params(nbins=5)
    for name in "xyz":
        axes.set(**{f"{name}label": f"{name} ({unit})"})
        getattr(axes, f"{name}axis").labelpad = 7
    axes.view_init(elev=elevation, azim=azimuth)


def on_plane(camera: Camera, pixels: Floats, away: float = 0.0) -> Floats:
    """Places of pixels in space: on the view plane, of a pinhole on a plane so far before it."""
    in_plane = (camera.plane_coordinates(pixels) - camera.offset) @ camera.rows
    place = np.asarray(camera.position)
    if isinstance(camera, PerspectiveCamera):
        return place + away * (in_plane - camera.normal)
    return place + in_plane


def draw_plane(axes: Axes3D, camera: Camera, color: str, away: float = 0.0) -> None:
    """Draw the image of a camera in space, of a pinhole with the pyramid of what it sees."""
    width, height = camera.image_size
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height], [0, 0]]) - 0.5
    edge = on_plane(camera, corners, away)
    axes.plot(*edge.T, color=color, lw=1)
    axes.plot_trisurf(*edge[:4].T, triangles=[[0, 1, 2], [0, 2, 3]], color=color, alpha=0.12)
    if isinstance(camera, PerspectiveCamera):
        for corner in edge[:4]:
            axes.plot(*np.transpose([camera.position, corner]), color=color, lw=1)


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
    points = x[shown[np.linspace(0, len(shown) - 1, 5).astype(int)]]
    axes.scatter(*points.T, color="k", s=8)
    for i, camera in enumerate(rig.cameras):
        # A pinhole's image is drawn close to it.
        away = 0.15 * float(np.linalg.norm(points.mean(axis=0) - np.asarray(camera.position)))
        seen = on_plane(camera, camera.project(x), away)
        axes.plot(*seen.T, color=f"C{i}", lw=0.8, label=f"camera {i + 1}")
        draw_plane(axes, camera, f"C{i}", away)
        ends = on_plane(camera, camera.project(points))  # or the pinhole
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


def plot_frames(
    images: Sequence[Image],
    titles: Sequence[str],
    tracks: Sequence[Floats],
    index: int | Sequence[int] = 0,
) -> Figure:
    """Video frames, three a row, with the tracks over them and the target magnified.

    Parameters
    ----------
    images : sequence of ndarray, shape (height, width, 3), uint8
        As a video reader gives them; sizes may differ.
    titles : sequence of str
    tracks : sequence of ndarray, shape (n, 2 k)
        Pixels of k targets in all frames of each video, each target in its own colour.
    index : int or sequence of int
        Where on the tracks the images were taken: the first target is magnified if seen there.
    """
    columns = min(len(images), 3)
    rows = -(-len(images) // columns)
    several = tracks[0].shape[1] > 2
    size = (2.7 * columns + 0.6, 3.0 * rows + 0.5 + 0.25 * several)
    alike = len({image.shape for image in images}) == 1
    shared = {"sharex": alike, "sharey": alike, "squeeze": False}
    figure, grid = plt.subplots(rows, columns, figsize=size, layout="compressed", **shared)
    halo = [withStroke(linewidth=2.4, foreground="white")]
    indices = np.broadcast_to(index, len(images))
    for axes, image, title, track, k in zip(
        grid.flat, images, titles, tracks, indices, strict=False
    ):
        height, width = image.shape[:2]
        _show(axes, image)
        axes.set_title(title, fontsize=11)
        axes.set(xlim=(-0.5, width - 0.5), xlabel="u (px)")
        axes.set(ylim=(height - 0.5, -0.5), ylabel="v (px)")
        axes.locator_params(nbins=3)
        targets = np.split(track, track.shape[1] // 2, axis=1)
        for j, target in enumerate(targets):
            axes.plot(*target.T, color=f"C{j}", label=f"target {j + 1}", lw=1.0, path_effects=halo)
        if np.isfinite(targets[0][k]).all():
            _magnify(axes, image, np.concatenate(targets), k)
        if alike:
            axes.label_outer()
    for axes in grid.flat[len(images) :]:
        axes.remove()
    if several:
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=9)
    return figure


def _show(axes: Axes, image: Image) -> None:
    """An image as a video reader gives it."""
    axes.imshow(image.astype(np.uint8), interpolation="nearest")
    axes.grid(False)
    axes.spines[:].set_visible(False)


def _magnify(axes: Axes, image: Image, track: Floats, index: int) -> None:
    """The surroundings of the target, three times as large, where the least track is."""
    reach = 3 / 64 * image.shape[1]  # 24 px of 512
    size = np.array(image.shape[1::-1])
    part = 6 * reach / size
    seen = track[np.isfinite(track).all(axis=1)] / size
    # Corners first, so that one of them is taken if the track leaves it free.
    steps = np.linspace(0, 1, 9)
    places = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)  # right, bottom
    places = places[np.argsort(-np.abs(places - 0.5).sum(axis=1), kind="stable")]
    middles = places * (1 - part) + part / 2
    inside = [np.all(np.abs(seen - middle) < 0.6 * part, axis=1).sum() for middle in middles]
    right, bottom = places[int(np.argmin(inside))]
    place = (right * (1 - part[0]), (1 - bottom) * (1 - part[1]), *part)
    u, v = track[index]
    near: dict[str, Any] = {"xlim": (u - reach, u + reach), "ylim": (v + reach, v - reach)}
    near |= {"xticks": (), "yticks": ()}
    inset = axes.inset_axes(place, **near)
    _show(inset, image)
    inset.set(**near)
    inset.spines[:].set(visible=True, color="white", linewidth=1.5)
    box = axes.indicate_inset_zoom(inset, edgecolor="white", alpha=1, linewidth=1.5)
    for line in box.connectors:
        line.set_visible(False)


def plot_in_plane(curves: Mapping[str, Floats], names: Sequence[str]) -> Figure:
    """Curves in a plane, several to compare.

    Parameters
    ----------
    curves : dict of str to ndarray, shape (n, 2)
        By label, scene units; the first is drawn as a broad line.
    names : sequence of str
        Names of the two coordinates: to the right and upwards.
    """
    tall = np.ptp(np.vstack(list(curves.values())), axis=0) @ (-1, 1) > 0
    figure, axes = plt.subplots(figsize=(5, 6.8) if tall else (7, 4.8))
    for index, (label, curve) in enumerate(curves.items()):
        style = {"lw": 1.2, "color": f"C{index - 1}"} if index else {"lw": 5, "color": "0.8"}
        axes.plot(*curve.T, label=label, **style)
    right, up = (f"{name} (scene units)" for name in names)
    axes.set(xlabel=right, ylabel=up, aspect="equal")
    figure.legend(loc="outside upper center")
    return figure


def plot_path(
    t: Floats,
    curves: Mapping[str, Floats],
    missing: str = "",
    styles: Sequence[Mapping[str, Any]] = LINES,
    unit: str = "units of the equations",
    length: str = "scene units",
    numbered: bool = False,
) -> Figure:
    """Draw curves over time, coordinate by coordinate, and in space.

    Parameters
    ----------
    t : ndarray, shape (n,)
    curves : dict of str to ndarray, shape (n, 3) or (n, 2)
        Positions by what they are; NaN where there is none.
    missing : str
        What the times are called, which are shaded, at which a curve is NaN.
    styles : sequence of dict
        Of the lines, in this order.
    unit, length : str
        Units of the times and of the positions.
    numbered : bool
        Whether the numbers of the times are on an axis of their own, as those of frames.
    """
    figure = plt.figure(figsize=(10.5, 4.7))
    names = "xyz"[: next(iter(curves.values())).shape[1]]
    panels = figure.subplot_mosaic(
        [[name, "space"] for name in names], width_ratios=(1.1, 1),
        per_subplot_kw={"space": SPACE if len(names) == 3 else {"aspect": "equal"}},
    )  # fmt: skip
    space = panels["space"]
    for i, name in enumerate(names):
        axes = panels[name]
        if missing:
            lost = np.isnan(np.hstack([*curves.values()])).any(axis=1)
            at = {"step": "mid", "transform": axes.get_xaxis_transform()}
            axes.fill_between(t, 0, 1, where=lost, color="0.85", **at)
        for curve, style in zip(curves.values(), styles, strict=True):
            axes.plot(t, curve[:, i], **style)
        axes.set_ylabel(name)
        axes.label_outer()
    panels[names[-1]].set_xlabel(f"time ({unit}); {', '.join(names)} in {length}")
    if numbered:
        frames = np.arange(len(t))
        both = make_interp_spline(t, frames, 1), make_interp_spline(frames, t, 1)
        panels[names[0]].secondary_xaxis("top", functions=both).set_xlabel("frame")
    for (label, curve), style in zip(curves.items(), styles, strict=True):
        space.plot(*curve.T, label=label, **style)
    if missing:
        space.plot([], [], color="0.85", lw=8, label=missing)
    if len(names) == 3:
        finish_space(space, azimuth=-60, elevation=25, zoom=0.85, unit=length)
    else:
        space.set(xlabel=f"x ({length})", ylabel=f"y ({length})")
    figure.legend(*space.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def plot_coefficients(found: Discovery, truth: PolynomialSystem) -> Figure:
    """How far each coefficient is from the truth, with its standard error.

    Parameters
    ----------
    found : Discovery
    truth : PolynomialSystem
        In the frame of the data.
    """
    equations, rows = np.nonzero(truth.support.T)
    terms = [truth.terms[row] for row in rows]
    labels = [f"{term} in d{truth.names[j]}/dt" for term, j in zip(terms, equations, strict=True)]
    place = [found.terms.index(term) for term in terms], equations
    true, errors = truth.coefficients[rows, equations], found.standard_errors[place]
    figure, axes = plt.subplots(figsize=(7.5, 0.32 * len(labels) + 1.2))
    heights = -np.arange(len(labels))
    axes.axvline(0, color="k", lw=0.8)
    scale = 1e6 / np.abs(true)
    difference = found.coefficients[place] - true
    axes.errorbar(difference * scale, heights, xerr=errors * scale, fmt="o")
    axes.set_yticks(heights, labels)
    axes.set_xlabel("distance from the truth (millionths of the true coefficient)")
    axes.grid(axis="y", visible=False)
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


def draw_tour(
    films: Sequence[Sequence[Image]],
    moments: np.ndarray,
    tracks: Sequence[Floats],
    x: Floats,
    equations: Sequence[str],
) -> list[Image]:
    """Draw three videos and the path that they agree on as they grow, and then the law.

    Parameters
    ----------
    films : sequence of sequence of ndarray, shape (height, width, 3)
        By camera, the frames to show; As a video reader gives them.
    moments : ndarray of int, shape (k,)
        Which frames of the videos these are.
    tracks : sequence of ndarray, shape (n, 2)
        By camera, px.
    x : ndarray, shape (n, 3)
        Path in space, scene units.
    equations : sequence of str
        Lines of text. They follow the last frame one by one.

    Returns
    -------
    list of ndarray of uint8, shape (300, 900, 3)
    """
    with plt.style.context("vidsindy_lite.study.plots.vidsindy"):
        figure = Figure(figsize=(9, 3), dpi=100, layout="none")
    canvas, images, lines, pictures = FigureCanvasAgg(figure), [], [], []
    for i, (film, track) in enumerate(zip(films, tracks, strict=True)):
        axes = figure.add_axes((0.01 + 0.235 * i, 0.29, 0.225, 0.675))
        axes.set_axis_off()
        images.append(axes.imshow(film[0], interpolation="antialiased"))
        lines += axes.plot(*track[:1].T, color="white", lw=1.4)
    space = figure.add_axes((0.715, 0.25, 0.28, 0.75), projection="3d")
    path = space.plot(*x[: moments[-1] + 1].T, color="C0", lw=1.4)[0]  # axes that hold all of it
    space.set_box_aspect(np.ptp(x[: moments[-1] + 1], axis=0), zoom=1.15)
    space.set(xticklabels=(), yticklabels=(), zticklabels=())
    space.view_init(elev=20, azim=-50)

    def picture() -> Image:
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    for number, moment in enumerate(moments):
        for image, film in zip(images, films, strict=True):
            image.set_data(film[number])
        for line, track in zip(lines, tracks, strict=True):
            line.set_data(*track[: moment + 1].T)
        path.set_data_3d(*x[: moment + 1].T)
        pictures.append(picture())
    for row, equation in enumerate(equations):
        figure.text(0.02, 0.2 - 0.075 * row, equation, family="monospace", size=9.5, color="k")
        pictures += [picture()] * 4
    return pictures
