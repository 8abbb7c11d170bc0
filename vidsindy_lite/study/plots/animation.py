"""The animation of the tour: videos, tracks, path in space, law, in one moving picture."""

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Line3D

from ...arrays import Floats, Image


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
