"""Camera models: from points in space to pixels.

With the pixel (u to the right, v down) measured from the middle of the image,
x_c = (u - (W-1)/2, (H-1)/2 - v), a scaled orthographic camera sees the point x where

    s T(theta) x_c + Delta_c = R^- x,        T = [[cos, sin], [-sin, cos]].

R^- are the first two rows of the rotation that takes the unit normal to e_z, and
Delta_c = R^- position. A perspective camera is a pinhole. In the frame of its view plane,
R (x - position), a point lies at the distance d = normal . (position - x) in front of it and is
seen at

    s d T(theta) x_c = R^- (x - position),

so that one pixel measures s d scene units there; 1 / s is the focal length in pixels. Both are one
3 x 4 matrix, s T(theta) x_c = (X, Y) / W with (X, Y, W) = matrix @ (x, 1), and differ in its last
row alone.

That is the ideal image. What is seen has its principal point (x_c = 0) where the lens is mounted,
lengths along v `aspect` times as large, and is bent by the lens (`lens`).

Paper: Section "Coordinates Transformation", Eq. (4)-(6).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..checks import check_array, check_rows, shown
from . import lens
from .camera import Camera, frozen, turn
from .geometry import PARALLEL

_DOWN = np.array([1.0, -1.0])  # the lens's y is down, the ideal image's up


@dataclass(frozen=True, eq=False, kw_only=True)
class OrthographicCamera(Camera):
    """A scaled orthographic camera, the one of the paper.

    Parameters
    ----------
    position : array_like, shape (3,), optional
        The point of the reference frame that is seen at the principal point, by default in the
        middle of the image, or any other point on the same line of sight. Scene units. None: to be
        learned, as the one of these points that is closest to the origin.
    normal : array_like, shape (3,)
        Normal of the view plane, pointing from the scene to the camera. Stored with unit length.
    scale : float, optional
        s, scene units per pixel. None: to be learned.
    angle : float, optional
        theta, in-plane angle in radians. None: to be learned, together with the scale.
    image_size : tuple of int, default (512, 512)
        Width and height in pixels.
    principal_point, aspect, readout, and the errors of what was measured
        See `Camera`.

    Raises
    ------
    ValueError
        If an argument has a wrong shape, is not finite, or only one of scale and angle is given.
    """

    model: ClassVar[str] = "orthographic"

    @property
    def _last_row(self) -> Floats:
        return np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False, kw_only=True)
class PerspectiveCamera(Camera):
    """A pinhole camera: the closer the target, the larger its image.

    Parameters
    ----------
    position : array_like, shape (3,), optional
        The pinhole. Scene units. None, if `normal` is, too: nothing is known of where the camera
        stands; then nothing may be known of any camera's of the rig.
    normal : array_like, shape (3,), optional
        Normal of the view plane, from the scene to the camera: against the line of view.
    scale : float, optional
        s, scene units per pixel at distance 1: the inverse of the focal length in pixels, OpenCV's
        fx. None: to be learned.
    angle : float, optional
        theta, in-plane angle in radians. None: to be learned, together with the scale.
    image_size : tuple of int, default (512, 512)
        Width and height in pixels.
    distortion : array_like, shape (5,) or (8,), optional
        Of the lens: k1, k2, p1, p2, k3, or k4, k5, k6 after them, OpenCV's (trailing zeros may be
        left out). None: none.
    distortion_error : float, default 0
        Standard error of k1 and of k2; that of p1 and p2 is a tenth of it; k3 to k6
        stay as given.
    principal_point, aspect, readout, and the errors of what was measured
        See `Camera`.

    Raises
    ------
    ValueError
        If an argument has a wrong shape, is not finite, or only one of scale and angle is given.
    """

    model: ClassVar[str] = "perspective"

    distortion: Floats | None = None
    distortion_error: float = 0.0

    def __post_init__(self) -> None:
        if self.position is None and self.normal is None:  # any direction, until it is found
            self._set(normal=(0, 0, 1), angle=None if self.scale is None else 0.0)
        elif self.position is None:
            raise ValueError(
                "position: must be given for a perspective camera with a normal, got None"
            )
        super().__post_init__()
        if self.distortion is not None:
            given = check_array("distortion", self.distortion)
            if given.ndim != 1 or len(given) > len(lens.NAMES) or not np.isfinite(given).all():
                raise ValueError(
                    f"distortion: must be at most {len(lens.NAMES)} finite numbers, "
                    f"{', '.join(lens.NAMES)}, got {shown(self.distortion)}"
                )
            size = lens.USUAL if len(given) <= lens.USUAL else len(lens.NAMES)
            self._set(distortion=frozen(np.pad(given, (0, size - len(given)))))

    def _bent(self, centred: Floats) -> Floats:
        if self.distortion is None:
            return centred
        scale, _ = self.calibration
        return lens.distorted(scale * centred * _DOWN, self.distortion) * _DOWN / scale

    def _unbent(self, centred: Floats) -> Floats:
        if self.distortion is None or self.scale is None:
            return centred
        return lens.undistorted(self.scale * centred * _DOWN, self.distortion) * _DOWN / self.scale

    @property
    def _last_row(self) -> Floats:
        """The distance in front of the camera."""
        return np.append(-self.normal, self.normal @ np.asarray(self.position))

    def posed(self, rotation: Floats, shift: Floats) -> PerspectiveCamera:
        """The same camera with OpenCV's pose: x is at rotation @ x + shift, right, down, forward.

        Its scale must be known.
        """
        camera = replace(self, position=-rotation.T @ shift, normal=-rotation[2])
        # T' R^- is (right, up): its first row is that of the rotation.
        across, along = camera.rows @ rotation[0]
        return camera.calibrated(complex(across, -along) * camera.calibration[0])

    @property
    def focal_length(self) -> float:
        """1 / scale, pixels."""
        scale, _ = self.calibration
        return 1 / scale

    def ball_image(self, x: ArrayLike, radius: float) -> tuple[Floats, Floats]:
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
        scale, angle = self.calibration
        image = check_rows("x", x, 3) @ self.matrix[:, :3].T + self.matrix[:, 3]
        depth = image[:, 2]
        if not radius > 0 or (depth <= radius).any():
            raise ValueError(
                f"radius: must be positive and less than each distance, got {radius} "
                f"and {np.nanmin(depth)}"
            )
        out = image[:, :2] / (scale * depth[:, None]) @ turn(angle)
        clear = depth**2 - radius**2
        across = radius / (scale * np.sqrt(clear))
        # Along `out` the half axis grows by the secant of the angle from the line of view.
        squared = np.sum(out**2, axis=1)
        along = across * np.sqrt(1 + squared * (scale * depth) ** 2 / clear)
        outer = out[:, :, None] * out[:, None, :]
        stretch = (along - across) / np.where(squared > 0, squared, 1)
        shapes = across[:, None, None] * np.eye(2) + stretch[:, None, None] * outer
        centres = out * (depth**2 / clear)[:, None]
        return self.seen(centres), self._slope(centres) @ shapes @ np.diag(_DOWN)

    def _slope(self, centred: Floats) -> Floats:
        """Slope of `seen`, (n, 2, 2): what the lens makes of small shapes."""
        steps = np.eye(2)  # pixels
        ends = [(self.seen(centred + e) - self.seen(centred - e)) / 2 for e in steps]
        return np.stack(ends, axis=-1)


MODELS: dict[str, Any] = {kind.model: kind for kind in (OrthographicCamera, PerspectiveCamera)}
"""The models by their names in the files of rigs."""


def all_orthographic(cameras: Sequence[Camera]) -> bool:
    """Whether all are: then agreement of the views is linear in what is unknown."""
    return all(isinstance(camera, OrthographicCamera) for camera in cameras)


def independent(cameras: Sequence[Camera]) -> bool:
    """Whether two of the cameras look along different lines: do all have the same centre?

    The centre is the pinhole, or a point at infinity in the direction of an orthographic normal.
    """
    normals = np.array([c.normal for c in cameras if isinstance(c, OrthographicCamera)])
    pinholes = np.array([c.position for c in cameras if isinstance(c, PerspectiveCamera)])
    apart = len(pinholes) > 1 and np.ptp(pinholes, axis=0).max() > 1e-9 * np.abs(pinholes).max()
    turned = len(normals) > 1 and np.linalg.svd(normals, compute_uv=False)[1] > PARALLEL
    return bool(apart or turned or (len(normals) and len(pinholes)))
