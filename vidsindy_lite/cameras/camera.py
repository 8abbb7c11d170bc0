"""What all cameras have in common: their place, their image, and errors of what was measured.

How points in space are seen differs, and stands in `models`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from copy import copy
from dataclasses import dataclass, fields
from functools import cached_property
from math import hypot
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..checks import check_image_size, check_number, check_positive, check_rows, check_vector
from .geometry import rotation_to_z, unit_vector


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
    principal_point : array_like, shape (2,), optional
        Pixel (u, v) on the axis of the lens. None: the middle of the image.
    aspect : float, default 1
        Height of a square's image over its width: OpenCV's fy / fx.
    readout : float, default 0
        Of a rolling shutter: by how much later the last row of an image is read than the first, in
        frames, between -1 and 1 (negative if the image is stored upside down); 10 ms at 30 frames
        per second are 0.3. The time of a frame is that of its middle row.
    position_error, normal_error, scale_error, principal_point_error, readout_error : float
        Standard errors of what was measured: of each coordinate in scene units; of the normal in
        degrees, and of the angle; of the scale as a share of it, .03 for 3 %; in pixels; in frames.
        Zero, the default: exactly known.

    Raises
    ------
    ValueError
        If an argument has a wrong shape, is not finite, or only one of scale and angle is given.
    """

    model: ClassVar[str]  # its name in the file of a rig

    position: Floats | None = None
    normal: Floats = None  # type: ignore[assignment]  # of a pinhole of which nothing is known
    scale: float | None = None
    angle: float | None = None
    image_size: tuple[int, int] = (512, 512)
    principal_point: Floats | None = None
    aspect: float = 1.0
    readout: float = 0.0
    position_error: float = 0.0
    normal_error: float = 0.0
    scale_error: float = 0.0
    principal_point_error: float = 0.0
    readout_error: float = 0.0

    def __post_init__(self) -> None:
        normal = check_vector("normal", self.normal, 3)
        if abs(hypot(*normal) - 1) > 1e-15:  # a unit vector stays as it is: files round-trip
            normal = unit_vector("normal", normal)
        self._set(normal=frozen(normal))
        if self.position is not None:
            self._set(position=frozen(check_vector("position", self.position, 3)))
        if (self.scale is None) != (self.angle is None):
            raise ValueError(
                "scale and angle: give both (calibrated) or neither (to be learned), got "
                f"scale={self.scale}, angle={self.angle}"
            )
        if self.scale is not None and self.angle is not None:
            self._set(scale=check_positive("scale", self.scale))
            self._set(angle=check_number("angle", self.angle))
        self._set(image_size=check_image_size(self.image_size))
        if self.principal_point is not None:
            point = check_vector("principal_point", self.principal_point, 2)
            self._set(principal_point=frozen(point))
        self._set(aspect=check_positive("aspect", self.aspect))
        if not abs(check_number("readout", self.readout)) <= 1:
            raise ValueError(f"readout: must be between -1 and 1 frames, got {self.readout}")
        self._set(readout=float(self.readout))
        for name in self.errors:
            error = check_number(name, getattr(self, name))
            if error < 0:
                raise ValueError(f"{name}: must be zero or positive, got {error:g}")
            self._set(**{name: error})

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Camera):
            return NotImplemented
        return self._values == other._values

    def __hash__(self) -> int:
        return hash(self._values)

    @property
    def _values(self) -> tuple[object, ...]:
        parts = (getattr(self, part.name) for part in fields(self))
        plain = (p.tolist() if isinstance(p, np.ndarray) else p for p in parts)
        return self.model, *(tuple(p) if isinstance(p, list) else p for p in plain)

    def _set(self, **values: object) -> None:
        self.__dict__.update(values)

    @property
    def errors(self) -> dict[str, float]:
        """Standard errors of what was measured, by their names."""
        names = (part.name for part in fields(self) if part.name.endswith("_error"))
        return {name: getattr(self, name) for name in names}

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
        return frozen(rotation_to_z(self.normal)[:2])

    @cached_property
    def offset(self) -> Floats:
        """Delta_c = R^- position, shape (2,), scene units.

        Its two components are the *signed* distances of the position to the planes Y'OZ' and X'OZ'
        through the reference origin (the paper's text names the image plane X'OY' itself, and
        distances without a sign). Paper: Appendix "Compute offset distance of a camera plane".
        """
        if self.position is None:
            raise ValueError("camera: position must be known, got None; see learn_cameras")
        return frozen(self.rows @ self.position)

    @cached_property
    def matrix(self) -> Floats:
        """Camera matrix, shape (3, 4): s T(theta) x_c = (X, Y) / W, (X, Y, W) = matrix @ (x, 1)."""
        return frozen(np.vstack((np.column_stack((self.rows, -self.offset)), self._last_row)))

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
        return self.seen(plane @ turn(angle))  # row vectors: (T^-1 w)^T = w^T T

    def turned(self, pixels: Floats) -> Floats:
        """Pixels along the axes of the view plane: T(theta) x_c, shape (n, 2)."""
        _, angle = self.calibration
        return self.centred(pixels) @ turn(angle).T

    def seen(self, centred: Floats) -> Floats:
        """Pixels at which points x_c of the ideal image are seen through the lens, shape (n, 2)."""
        u, v = self.centre
        bent = self._bent(centred)
        return np.column_stack((u + bent[:, 0], v - self.aspect * bent[:, 1]))

    def centred(self, pixels: Floats) -> Floats:
        """Pixels in the ideal image, measured from its principal point, right and *up*: x_c.

        Shape (n, 2). Of a camera that is not calibrated, without its distortion.
        """
        u, v = self.centre
        return self._unbent(np.column_stack((pixels[:, 0] - u, (v - pixels[:, 1]) / self.aspect)))

    @property
    def centre(self) -> tuple[float, float]:
        """The principal point."""
        if self.principal_point is not None:
            return self.principal_point[0], self.principal_point[1]
        width, height = self.image_size
        return (width - 1) / 2, (height - 1) / 2

    def _bent(self, centred: Floats) -> Floats:
        """What the lens makes of an ideal image."""
        return centred

    def _unbent(self, centred: Floats) -> Floats:
        """The ideal image of what is seen."""
        return centred

    def calibrated(self, turned: complex) -> Self:
        """The same camera with s exp(i theta)."""
        twin = copy(self)  # and what was computed of it: none of that hangs on scale or angle
        twin._set(scale=float(abs(turned)), angle=float(np.angle(turned)))
        return twin

    def moved(self, **values: object) -> Self:
        """The same camera with values that need no check: a search builds very many."""
        twin = copy(self)
        twin._set(**values)
        for name in ("rows", "offset", "matrix") if "normal" in values else ("offset", "matrix"):
            twin.__dict__.pop(name, None)
        return twin

    def placed(self, offset: Floats) -> Self:
        """The same camera at the point of this in-plane offset that is closest to the origin."""
        return self.moved(position=frozen(offset @ self.rows))


def turn(angle: float) -> Floats:
    """T(theta), shape (2, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s], [-s, c]])


def frozen(array: Floats) -> Floats:
    """The array, read-only from now on."""
    array.flags.writeable = False
    return array
