"""What several modules of figures need: axes in space, line styles."""

import numpy as np
from mpl_toolkits.mplot3d import Axes3D

STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (7, 2)), (0, (1, 1)))
SPACE = {"projection": "3d", "proj_type": "ortho"}


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
