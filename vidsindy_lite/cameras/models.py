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

Not modelled: lens distortion, pixels that are not square, a principal point off the middle.

Paper: Section "Coordinates Transformation", Eq. (4)-(6).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from math import hypot
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..checks import check_image_size, check_number, check_positive, check_rows, check_vector
from .geometry import PARALLEL, rotation_to_z, unit_vector


@dataclass(frozen=True, eq=False, kw_only=True)
class Camera(ABC):
    """What cameras of both models share; build an `OrthographicCamera` or a `PerspectiveCamera`.

    Parameters
    ----------
    position : array_like, shape (3,), optional
        Scene units. None: to be learned.
    normal : array_like, shape (3,)
        Normal of the view plane, pointing from the scene to the camera. Stored with unit length.
    scale : float, optional
        s, scene units per pixel, of a perspective camera at distance 1. None: to be learned.
    angle : float, optional
        theta, in-plane angle in radians. None: to be learned, together with the scale.
    image_size : tuple of int, default (512, 512)
        Width and height in pixels.

    Raises
    ------
    ValueError
        If an argument has a wrong shape, is not finite, or only one of scale and angle is given.
    """

    model: ClassVar[str]  # its name in the file of a rig

    position: Floats | None = None
    normal: Floats
    scale: float | None = None
    angle: float | None = None
    image_size: tuple[int, int] = (512, 512)

    def __post_init__(self) -> None:
        normal = check_vector("normal", self.normal, 3)
        if abs(hypot(*normal) - 1) > 1e-15:  # a unit vector stays as it is: files round-trip
            normal = unit_vector("normal", normal)
        self._set(normal=_frozen(normal))
        if self.position is not None:
            self._set(position=_frozen(check_vector("position", self.position, 3)))
        if (self.scale is None) != (self.angle is None):
            raise ValueError(
                "scale and angle: give both (calibrated) or neither (to be learned), got "
                f"scale={self.scale}, angle={self.angle}"
            )
        if self.scale is not None and self.angle is not None:
            self._set(scale=check_positive("scale", self.scale))
            self._set(angle=check_number("angle", self.angle))
        self._set(image_size=check_image_size(self.image_size))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Camera):
            return NotImplemented
        return self._values == other._values

    def __hash__(self) -> int:
        return hash(self._values)

    @property
    def _values(self) -> tuple[object, ...]:
        position = None if self.position is None else tuple(self.position.tolist())
        normal = tuple(self.normal.tolist())
        return self.model, position, normal, self.scale, self.angle, self.image_size

    def _set(self, **values: object) -> None:
        self.__dict__.update(values)

    @property
    def is_calibrated(self) -> bool:
        """Whether scale and angle are known."""
        return self.scale is not None

    @property
    def is_placed(self) -> bool:
        """Whether the position is known."""
        return self.position is not None

    @property
    def calibration(self) -> tuple[float, float]:
        """Scale and angle; an error if they are unknown."""
        if self.scale is None or self.angle is None:
            raise ValueError("camera: scale and angle must be known, got None; see learn_cameras")
        return self.scale, self.angle

    @cached_property
    def rows(self) -> Floats:
        """R^-, shape (2, 3): the plane's axes, in which R^- x are in-plane coordinates."""
        return _frozen(rotation_to_z(self.normal)[:2])

    @cached_property
    def offset(self) -> Floats:
        """Delta_c = R^- position, shape (2,), scene units.

        Its two components are the *signed* distances of the position to the planes Y'OZ' and X'OZ'
        through the reference origin (the paper's text names the image plane X'OY' itself, and
        distances without a sign). Paper: Appendix "Compute offset distance of a camera plane".
        """
        if self.position is None:
            raise ValueError("camera: position must be known, got None; see learn_cameras")
        return _frozen(self.rows @ self.position)

    @cached_property
    def matrix(self) -> Floats:
        """Camera matrix, shape (3, 4): s T(theta) x_c = (X, Y) / W, (X, Y, W) = matrix @ (x, 1)."""
        return _frozen(np.vstack((np.column_stack((self.rows, -self.offset)), self._last_row)))

    @property
    @abstractmethod
    def _last_row(self) -> Floats:
        """W as a linear function of (x, 1): in front of the camera it is positive."""

    def project(self, x: ArrayLike) -> Floats:
        """Pixels at which points are seen.

        Parameters
        ----------
        x : array_like, shape (n, 3)
            Points in the reference frame, scene units. A row holding NaN gives NaN pixels.

        Returns
        -------
        ndarray, shape (n, 2)
            Pixels (u to the right, v down), the centre of the first pixel being (0, 0). NaN for
            points behind a perspective camera.

        Raises
        ------
        ValueError
            If the camera is not calibrated, or x has a wrong shape or an infinite value.
        """
        return self.image(check_rows("x", x, 3))

    def plane_coordinates(self, pixels: ArrayLike) -> Floats:
        """In-plane coordinates R^- x = s T(theta) x_c + Delta_c of what is seen at the pixels.

        For a perspective camera, of what is seen there at distance 1.

        Parameters
        ----------
        pixels : array_like, shape (n, 2)

        Returns
        -------
        ndarray, shape (n, 2)
            Scene units; NaN rows pass through.

        Raises
        ------
        ValueError
            If the camera is not calibrated, or pixels has a wrong shape or an infinite value.
        """
        scale, _ = self.calibration
        return scale * self.turned(check_rows("pixels", pixels, 2)) + self.offset

    # What follows takes its arguments as they are: arrays of floats of the right shape.

    def image(self, x: Floats) -> Floats:
        """Pixels at which points are seen, see `project`."""
        scale, angle = self.calibration
        image = x @ self.matrix[:, :3].T + self.matrix[:, 3]
        image[~(image[:, 2] > 0)] = np.nan
        plane = image[:, :2] / (scale * image[:, 2:])
        centred = plane @ _turn(angle)  # row vectors: (T^-1 w)^T = w^T T
        width, height = self.image_size
        return np.column_stack(((width - 1) / 2 + centred[:, 0], (height - 1) / 2 - centred[:, 1]))

    def turned(self, pixels: Floats) -> Floats:
        """Pixels along the axes of the view plane: T(theta) x_c, shape (n, 2)."""
        _, angle = self.calibration
        return self.centred(pixels) @ _turn(angle).T

    def centred(self, pixels: Floats) -> Floats:
        """Pixels measured from the middle of the image, right and *up*: x_c, shape (n, 2)."""
        width, height = self.image_size
        return np.column_stack((pixels[:, 0] - (width - 1) / 2, (height - 1) / 2 - pixels[:, 1]))

    def calibrated(self, turned: complex) -> Self:
        """The same camera with s exp(i theta)."""
        twin = copy(self)  # and what was computed of it: none of that hangs on scale or angle
        twin._set(scale=float(abs(turned)), angle=float(np.angle(turned)))
        return twin

    def placed(self, offset: Floats) -> Self:
        """The same camera at the point of this in-plane offset that is closest to the origin."""
        twin = copy(self)
        twin._set(position=_frozen(offset @ self.rows))
        for name in ("offset", "matrix"):
            twin.__dict__.pop(name, None)
        return twin


@dataclass(frozen=True, eq=False, kw_only=True)
class OrthographicCamera(Camera):
    """A scaled orthographic camera, the one of the paper.

    Parameters
    ----------
    position : array_like, shape (3,), optional
        The point of the reference frame that is seen in the middle of the image, or any other
        point on the same line of sight. Scene units. None: to be learned, as the one of these
        points that is closest to the origin.
    normal : array_like, shape (3,)
        Normal of the view plane, pointing from the scene to the camera. Stored with unit length.
    scale : float, optional
        s, scene units per pixel. None: to be learned.
    angle : float, optional
        theta, in-plane angle in radians. None: to be learned, together with the scale.
    image_size : tuple of int, default (512, 512)
        Width and height in pixels.

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

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.is_placed:
            raise ValueError("position: must be given for a perspective camera, got None")

    @property
    def _last_row(self) -> Floats:
        """The distance in front of the camera."""
        return np.append(-self.normal, self.normal @ np.asarray(self.position))

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
        scale, _ = self.calibration
        middle = (np.array(self.image_size) - 1) / 2
        out = self.project(x) - middle
        depth = np.asarray(x, dtype=float) @ self.matrix[2, :3] + self.matrix[2, 3]
        if not radius > 0 or (depth <= radius).any():
            raise ValueError(
                f"radius: must be positive and less than each distance, got {radius} "
                f"and {np.nanmin(depth)}"
            )
        clear = depth**2 - radius**2
        across = radius / (scale * np.sqrt(clear))
        # Along `out` the half axis grows by the secant of the angle from the line of view.
        squared = np.sum(out**2, axis=1)
        along = across * np.sqrt(1 + squared * (scale * depth) ** 2 / clear)
        outer = out[:, :, None] * out[:, None, :]
        stretch = (along - across) / np.where(squared > 0, squared, 1)
        shapes = across[:, None, None] * np.eye(2) + stretch[:, None, None] * outer
        return middle + out * (depth**2 / clear)[:, None], shapes


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


def _turn(angle: float) -> Floats:
    """T(theta), shape (2, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s], [-s, c]])


def _frozen(array: Floats) -> Floats:
    """The array, read-only from now on."""
    array.flags.writeable = False
    return array
