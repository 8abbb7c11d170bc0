"""Figures of video frames and of what the tracker made of them; the animation of the tour."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d.art3d import Line3D

from ...arrays import Floats, Image
from .common import STYLES


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
        Blue-green-red, as a video reader gives them; sizes may differ.
    titles : sequence of str
    tracks : sequence of ndarray, shape (n, 2)
        Pixels of the target in all frames of each video.
    index : int or sequence of int
        Where on the tracks the images were taken: the target is magnified if it is seen there.
    """
    columns = min(len(images), 3)
    rows = -(-len(images) // columns)
    size = (2.7 * columns + 0.6, 3.0 * rows + 0.5)
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
        axes.plot(*track.T, color="C0", lw=1.0, path_effects=halo)
        if np.isfinite(track[k]).all():
            _magnify(axes, image, track, k)
        if alike:
            axes.label_outer()
    for axes in grid.flat[len(images) :]:
        axes.remove()
    return figure


def plot_tracker_steps(
    frame: Image, background: Image, coverage: Floats, corner: Sequence[int], centroid: Floats
) -> Figure:
    """How one position comes about: frame, background, difference, coverage with its centroid.

    Parameters
    ----------
    frame, background : ndarray, shape (h, w, 3)
        The part of the image around the target, blue-green-red, 0 to 255.
    coverage : ndarray, shape (h, w)
        Share of each pixel that the target covers.
    corner : array_like of int, shape (2,)
        Column and row of the first pixel in the whole image.
    centroid : array_like, shape (2,)
        Pixels in the whole image.
    """
    figure, panels = plt.subplots(1, 4, figsize=(10.5, 3.2), sharex=True, sharey=True)
    (left, top), (height, width) = corner, coverage.shape
    extent = (left - 0.5, left + width - 0.5, top + height - 0.5, top - 0.5)
    _show(panels[0], frame, extent=extent)
    _show(panels[1], background, extent=extent)
    distance = np.linalg.norm(frame.astype(float) - background, axis=-1)
    units = ("grey levels", "share of the pixel")
    for axes, values, unit in zip(panels[2:], (distance, coverage), units, strict=True):
        shown = axes.imshow(values, extent=extent, cmap="gray", interpolation="nearest", vmin=0)
        axes.grid(False)
        figure.colorbar(shown, ax=axes, shrink=0.72, pad=0.03, label=unit)
    panels[3].plot(*centroid, "+", color="C1", ms=16, mew=2)
    for axes, title in zip(panels, ("frame", "background", "difference", "coverage"), strict=True):
        axes.set_title(title)
        axes.set_xlabel("u (px)")
    panels[0].set_ylabel("v (px)")
    return figure


def plot_track_errors(errors: Mapping[str, Floats]) -> Figure:
    """Distribution of the distance between tracked and true positions.

    Parameters
    ----------
    errors : dict of str to ndarray, shape (n,)
        Pixels, by the kind of video; NaN (not seen) is left out.
    """
    figure, axes = plt.subplots(figsize=(7.5, 4))
    for (name, error), style in zip(errors.items(), STYLES, strict=False):
        axes.ecdf(error[np.isfinite(error)], ls=style, label=name)
    axes.set(xscale="log", xlabel="distance from the truth (px)", ylabel="share of frames below")
    axes.legend(loc="upper left")
    return figure


def plot_confidence(visible: Sequence[Floats], confidence: Sequence[Floats]) -> Figure:
    """How much of the target can be seen in each frame, and how sure the tracker is of it.

    Parameters
    ----------
    visible, confidence : sequence of ndarray, shape (n,)
        In [0, 1], by camera.
    """
    figure, panels = plt.subplots(len(visible), 1, figsize=(9, 4.6), sharex=True, sharey=True)
    for i, (axes, share, sure) in enumerate(zip(panels, visible, confidence, strict=True)):
        axes.fill_between(
            np.arange(len(share)), share, color="0.85", step="mid", label="visible share"
        )
        axes.plot(sure, color="C0", lw=1, label="confidence of the tracker")
        axes.set(ylabel=f"camera {i + 1}", ylim=(0, 1.05))
    panels[-1].set(xlabel="frame", xlim=(0, len(visible[0]) - 1))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def plot_loss(loss: Sequence[float], steps: int) -> Figure:
    """The loss of a training over its steps.

    Parameters
    ----------
    loss : sequence of float
        Means over blocks of steps.
    steps : int
        Length of a block.
    """
    figure, axes = plt.subplots()
    axes.plot(steps * (np.arange(len(loss)) + 1), loss)
    axes.set(xlabel="step", ylabel="loss", ylim=(0, None))
    return figure


def _show(axes: Axes, image: Image, extent: tuple[float, ...] | None = None) -> None:
    """An image as a video reader gives it (blue-green-red)."""
    axes.imshow(image[..., ::-1].astype(np.uint8), extent=extent, interpolation="nearest")
    axes.grid(False)
    axes.spines[:].set_visible(False)


def _magnify(axes: Axes, image: Image, track: Floats, index: int) -> None:
    """The surroundings of the target, three times as large, in the corner with the least track."""
    reach = 3 / 64 * image.shape[1]  # 24 px of 512
    corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])  # right, bottom
    size = np.array(image.shape[1::-1])
    part = 6 * reach / size
    seen = track[np.isfinite(track).all(axis=1)] / size
    inside = [np.all(np.abs(seen - corner) < 1.1 * part, axis=1).sum() for corner in corners]
    right, bottom = corners[int(np.argmin(inside))]
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


# ------------------------------------------------------------------------ the tour, as an animation


def draw_tour(
    films: Sequence[Sequence[np.ndarray]],
    moments: np.ndarray,
    tracks: Sequence[np.ndarray],
    x: np.ndarray,
    equations: Sequence[str],
) -> list[np.ndarray]:
    """Draw three videos and the path that they agree on as they grow, and then the law.

    Parameters
    ----------
    films : sequence of sequence of ndarray, shape (height, width, 3)
        By camera, the frames to show; blue-green-red, as a video reader gives them.
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
    canvas = FigureCanvasAgg(figure)
    images, lines = _panels(figure, films, tracks)
    path = _space(figure, x[: moments[-1] + 1])
    pictures = []
    for number, moment in enumerate(moments):
        for image, film in zip(images, films, strict=True):
            image.set_data(film[number][..., ::-1])
        for line, track in zip(lines, tracks, strict=True):
            line.set_data(*track[: moment + 1].T)
        path.set_data_3d(*x[: moment + 1].T)
        pictures.append(_picture(canvas))
    for row, equation in enumerate(equations):
        height = 0.2 - 0.075 * row
        figure.text(0.02, height, equation, family="monospace", size=9.5, color="k")
        pictures += [_picture(canvas)] * 4
    return pictures


def _panels(
    figure: Figure, films: Sequence[Sequence[Image]], tracks: Sequence[Floats]
) -> tuple[list[AxesImage], list[Line2D]]:
    """An image and a track for each camera, side by side."""
    images, lines = [], []
    for i, (film, track) in enumerate(zip(films, tracks, strict=True)):
        axes = figure.add_axes((0.01 + 0.235 * i, 0.29, 0.225, 0.675))
        axes.set_axis_off()
        images.append(axes.imshow(film[0][..., ::-1], interpolation="antialiased"))
        lines += axes.plot(*track[:1].T, color="white", lw=1.4)
    return images, lines


def _space(figure: Figure, x: Floats) -> Line3D:
    """The path in space, in axes that hold all of it."""
    axes = figure.add_axes((0.715, 0.25, 0.28, 0.75), projection="3d")
    path = axes.plot(*x.T, color="C0", lw=1.4)[0]
    axes.set_box_aspect(np.ptp(x, axis=0), zoom=1.15)
    axes.set(xticklabels=(), yticklabels=(), zticklabels=())
    axes.view_init(elev=20, azim=-50)
    return path


def _picture(canvas: FigureCanvasAgg) -> Image:
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
