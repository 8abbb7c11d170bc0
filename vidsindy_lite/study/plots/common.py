"""What several modules of figures need: axes in space, images, line styles."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D

STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (7, 2)), (0, (1, 1)))


def space_axes(size: tuple[float, float]) -> tuple[Figure, Axes3D]:
    figure = plt.figure(figsize=size)
    axes = figure.add_subplot(projection="3d", proj_type="ortho")
    return figure, axes


def finish_space(axes: Axes3D, azimuth: float, elevation: float, zoom: float = 1.05) -> None:
    extent = np.ptp([axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d()], axis=1)
    axes.set_box_aspect(extent, zoom=zoom)  # one unit is equally long on all three axes
    axes.locator_params(nbins=5)
    for name in "xyz":
        axes.set(**{f"{name}label": f"{name} (scene units)"})
        getattr(axes, f"{name}axis").labelpad = 7
    axes.view_init(elev=elevation, azim=azimuth)
