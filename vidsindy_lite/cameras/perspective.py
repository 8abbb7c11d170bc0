"""Perspective cameras: the closer the target, the larger its image.

A `PerspectiveCamera` is a pinhole. In the frame of the view plane, R (x - position), a point lies
at the distance d = normal . (position - x) in front of it and is seen at

    s d T(theta) x_c = R^- (x - position),

so that one pixel measures s d scene units there. It is the `Camera` of the paper with a scale that
grows with the distance; 1 / s is the focal length in pixels. It stands wherever a `Camera` does: in
a `Rig`, its file, `learn_cameras`, `reconstruct` and `residuals`.

Not modelled: lens distortion, pixels that are not square, a principal point off the middle.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .calibrate import Camera


@dataclass(frozen=True, eq=False, kw_only=True)
class PerspectiveCamera(Camera):
    """A pinhole camera.

    Parameters
    ----------
    position : array_like, shape (3,)
        The pinhole. Scene units.
    normal : array_like, shape (3,)
        Normal of the view plane, from the scene to the camera: against the line of view.
    scale : float, optional
        s, scene units per pixel at distance 1: the inverse of the focal length in pixels. None: to
        be learned.
    angle : float, optional
        theta, in-plane angle in radians. None: to be learned, together with the scale.
    image_size : tuple of int, default (512, 512)
        Width and height in pixels.

    Raises
    ------
    ValueError
        If an argument has a wrong shape, is not finite, or only one of scale and angle is given.
    """

    model: ClassVar[str] = "perspective"

    def __post_init__(self):
        super().__post_init__()
        if not self.is_placed:
            raise ValueError("position: must be given for a perspective camera, got None")

    @property
    def matrix(self):
        """Camera matrix, shape (3, 4); its last row gives the distance in front of the camera."""
        return np.vstack((super().matrix[:2], [*-self.normal, self.normal @ self.position]))

    @property
    def focal_length(self):
        """1 / scale, pixels."""
        self._require_calibrated()
        return 1 / self.scale

    def ball_image(self, x, radius):
        """Images of balls: ellipses, whose centres are not the images of the balls' centres.

        The rays that touch the ball at distance d in front of the camera form a cone; the plane
        cuts it in an ellipse around x_c / (1 - (radius / d)^2), further out than the centre's
        image x_c, and longer in that direction than across.

        Parameters
        ----------
        x : array_like, shape (n, 3)
            Centres, scene units; NaN rows pass through.
        radius : float
            Scene units, less than each distance in front of the camera.

        Returns
        -------
        centroids : ndarray, shape (n, 2)
            Centres of the ellipses, pixels.
        shapes : ndarray, shape (n, 2, 2)
            Linear maps (pixels, u right and v down) of the unit disc to the centred ellipses.

        Raises
        ------
        ValueError
            If the camera is not calibrated, or the radius not positive or a ball is not wholly in
            front of the camera.
        """
        middle = (np.array(self.image_size) - 1) / 2
        out = self.project(x) - middle
        depth = np.asarray(x, dtype=float) @ self.matrix[2, :3] + self.matrix[2, 3]
        if not radius > 0 or (depth <= radius).any():
            raise ValueError(
                f"radius: must be positive and less than each distance, got {radius} "
                f"and {np.nanmin(depth)}"
            )
        clear = depth**2 - radius**2
        across = radius / (self.scale * np.sqrt(clear))
        # Along `out` the half axis grows by the secant of the angle from the line of view.
        squared = np.sum(out**2, axis=1)
        along = across * np.sqrt(1 + squared * (self.scale * depth) ** 2 / clear)
        outer = out[:, :, None] * out[:, None, :]
        stretch = (along - across) / np.where(squared > 0, squared, 1)
        shapes = across[:, None, None] * np.eye(2) + stretch[:, None, None] * outer
        return middle + out * (depth**2 / clear)[:, None], shapes
