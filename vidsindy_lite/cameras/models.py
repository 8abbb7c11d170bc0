"""Camera models: from points in space to pixels, and back along the lines of sight.

A view plane with unit normal n is rotated flat: R is the rotation that takes **n to e_z** (not e_z
to n), and its first two rows R^- give the in-plane coordinates R^- x of a point x. Because the
third row of R is n itself, moving the plane along its normal changes R^- x not at all; moving it
sideways changes its origin by the in-plane offset Delta_c = R^- position.

With the pixel (u to the right, v down) measured from the middle of the image, x_c = (u - (W-1)/2,
(H-1)/2 - v), a scaled orthographic camera sees the point x where

    s T(theta) x_c + Delta_c = R^- x,        T = [[cos, sin], [-sin, cos]].

A perspective camera is a pinhole. In the frame of its view plane, R (x - position), a point lies at
the distance d = normal . (position - x) in front of it and is seen at

    s d T(theta) x_c = R^- (x - position),

so that one pixel measures s d scene units there; 1 / s is the focal length in pixels. Both are one
3 x 4 matrix, s T(theta) x_c = (X, Y) / W with (X, Y, W) = matrix @ (x, 1), and differ in its last
row alone.

For known s and theta these are two linear equations for x, the line of sight: `intersect`. For
known x on some other camera's line of sight they leave one linear equation for
(s cos theta, s sin theta), the epipolar one: `epipolar_lines` and `epipolar_rows`. None of them
asks which model of camera it is.

That is the ideal image. What is seen has its principal point (x_c = 0) where the lens is mounted,
lengths along v `aspect` times as large, and is bent by the lens: a point that a pinhole of focal
length 1 would show at (x, y), y *down*, is seen at

    x q + 2 p1 x y + p2 (r2 + 2 x^2),      y q + p1 (r2 + 2 y^2) + 2 p2 x y,

    q = (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3),      r2 = x^2 + y^2.

The rows of a rolling shutter are read one after the other: the row v of the frame k at the instant
k + readout (v - (H - 1) / 2) / H, in frames, a lag that depends on where the target is.

Paper: Eq. (1)-(2), (4)-(6), Appendices "Detail of Projection", "Plane Projection Proof" and
"Compute offset distance of a camera plane". Lens: Brown 1966, Photogrammetric Engineering 32;
coefficients in OpenCV's order, k1, k2, p1, p2, k3, and k4, k5, k6 of its rational model.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from math import hypot
from typing import Any, ClassVar, Self

import cv2
import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline

from ..arrays import Bools, Floats
from ..checks import (
    check_array,
    check_image_size,
    check_number,
    check_positive,
    check_rows,
    check_vector,
    shown,
)

ROUNDING = 1e-6  #: Pixels by which numbers in files and exact tracks are off.
SETTLED = 1e-11  #: Pixels by which a last step of a search moves an image at most.
PARALLEL = 1e-6  #: Sine of the angle below which two lines of sight count as parallel.
LENS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
USUAL = 5  #: How many of these most lenses have; the others are those of a fraction.
TRIMMED = 0.9  #: Share of the instants that must agree; the others may hold anything.

_STEPS = 30  # of Newton, from the linear solution: four or five are usual
_LARGEST = 0.49  # frames; so instants never overtake each other, whatever an outlier says
_DOWN = np.array([1.0, -1.0])  # the lens's y is down, the ideal image's up


def rotation_to_z(normal: ArrayLike) -> Floats:
    """The shortest rotation R that takes a plane's normal to e_z: R n = e_z.

    Paper: Eq. (1)-(2) with axis n x e_z and the angle between n and e_z. The axis is 0/0 for a
    normal along z: +e_z gives the identity (the limit), and -e_z, where every horizontal axis is
    equally short and no limit exists, gives the rotation by pi about the x axis.

    Parameters
    ----------
    normal : array_like, shape (3,)
        Normal of the plane, of any length but zero.

    Returns
    -------
    ndarray, shape (3, 3)
        Rows: the plane's X' axis, its Y' axis, and the unit normal.

    Raises
    ------
    ValueError
        If the normal is not a finite non-zero vector of shape (3,).
    """
    a, b, c = unit_vector("normal", normal)
    horizontal = np.hypot(a, b)
    # The axis is (v, -u, 0); what follows is Eq. (2) of its angle, whose sine is `horizontal`.
    u, v = (a / horizontal, b / horizontal) if horizontal > 0 else (0.0, 1.0)
    k = 1 - c
    return np.array([[1 - k * u * u, -k * u * v, -a], [-k * u * v, 1 - k * v * v, -b], [a, b, c]])


def unit_vector(name: str, value: ArrayLike) -> Floats:
    """A finite vector of shape (3,), of any length but zero, at unit length.

    Raises
    ------
    ValueError
        If the vector is zero, not finite or of another shape.
    """
    vector = check_vector(name, value, 3)
    largest = np.abs(vector).max()
    if largest == 0:
        raise ValueError(f"{name}: must not be the zero vector, got {vector.tolist()}")
    vector = vector / largest  # so that squares neither overflow nor underflow
    return vector / np.linalg.norm(vector)


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
        for name, size in (("position", 3), ("principal_point", 2)):
            if (given := getattr(self, name)) is not None:
                self._set(**{name: frozen(check_vector(name, given, size))})
        if (self.scale is None) != (self.angle is None):
            raise ValueError(
                "scale and angle: give both (calibrated) or neither (to be learned), got "
                f"scale={self.scale}, angle={self.angle}"
            )
        if self.scale is not None and self.angle is not None:
            scale, angle = check_positive("scale", self.scale), check_number("angle", self.angle)
            if abs(angle) > 4 * np.pi:
                raise ValueError(f"angle: must be in radians, two turns at most, got {angle:g}")
            self._set(scale=scale, angle=angle)
        self._set(image_size=check_image_size(self.image_size))
        self._set(aspect=check_positive("aspect", self.aspect))
        self._set(readout=check_number("readout", self.readout))
        if abs(self.readout) > 1:
            raise ValueError(f"readout: must be between -1 and 1 frames, got {self.readout}")
        for name, error in self.errors.items():
            if check_number(name, error) < 0:
                raise ValueError(f"{name}: must be zero or positive, got {error:g}")
            self._set(**{name: float(error)})

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Camera) and self.table == other.table

    def __hash__(self) -> int:
        return hash((self.model, self.image_size))

    @property
    def table(self) -> dict[str, object]:
        """Its model and plain numbers, under the keys of a rig file; defaults are left out."""
        known: dict[str, object] = {} if type(self) is OrthographicCamera else {"model": self.model}
        for part in fields(self):
            value = getattr(self, part.name)
            default = isinstance(value, float) and value == part.default
            free = part.name in ("normal", "angle") and not self.is_measured
            if value is not None and not (default or free):
                known[part.name] = np.asarray(value).tolist()
        return known

    @property
    def is_measured(self) -> bool:
        """Whether something is known of where it stands, or where it looks."""
        return isinstance(self, OrthographicCamera) or self.is_placed

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
        return self.calibration[0] * self.turned(check_rows("pixels", pixels, 2)) + self.offset

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
        return self.centred(pixels) @ turn(self.calibration[1]).T

    def seen(self, centred: Floats) -> Floats:
        """Pixels at which points x_c of the ideal image are seen through the lens, shape (n, 2)."""
        return self.centre + self._through(distorted, centred) * [1, -self.aspect]

    def centred(self, pixels: Floats) -> Floats:
        """Pixels in the ideal image, measured from its principal point, right and *up*: x_c.

        Shape (n, 2). Of a camera that is not calibrated, without its distortion.
        """
        return self._through(undistorted, (pixels - self.centre) / [1, -self.aspect])

    @property
    def centre(self) -> Floats:
        """The principal point."""
        middle = (np.array(self.image_size) - 1) / 2
        return middle if self.principal_point is None else self.principal_point

    def _through(self, lens: Callable[[Floats, Floats], Floats], centred: Floats) -> Floats:
        """What the lens makes of an ideal image, or the ideal image of what is seen."""
        return centred

    def steadied(self, track: Floats) -> Floats:
        """What it would have seen if it read all rows at once: the track at whole frames."""
        if self.readout == 0:
            return track
        shown = np.flatnonzero(np.isfinite(track).all(axis=1))
        if len(shown) < 4:
            return track
        height = self.image_size[1]
        behind = self.readout * (track[shown, 1] - (height - 1) / 2) / height
        instants = shown + np.clip(behind, -_LARGEST, _LARGEST)
        still = track.copy()
        still[shown] = make_interp_spline(instants, track[shown], k=3)(shown)
        return still

    def calibrated(self, turned: complex) -> Self:
        """The same camera with s exp(i theta)."""
        return self.moved(scale=float(abs(turned)), angle=float(np.angle(turned)))

    def moved(self, **values: object) -> Self:
        """The same camera with values that need no check: a search builds very many."""
        twin = copy(self)
        twin._set(**values)
        if not values.keys().isdisjoint(("normal", "position")):
            for name in ("rows", "offset", "matrix"):
                twin.__dict__.pop(name, None)
        return twin

    def placed(self, offset: Floats) -> Self:
        """The same camera at the point of this in-plane offset that is closest to the origin."""
        return self.moved(position=frozen(offset @ self.rows))


@lru_cache(maxsize=64)  # slopes of one camera ask for the same again and again
def turn(angle: float) -> Floats:
    """T(theta), shape (2, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return frozen(np.array([[c, s], [-s, c]]))


def frozen(array: Floats) -> Floats:
    """The array, read-only from now on."""
    array.flags.writeable = False
    return array


def undistorted(points: Floats, coefficients: Floats) -> Floats:
    """Points of the ideal image that are seen at `points`, (n, 2).

    NaN where the model shows none there, as beyond the circle where its image folds.
    """
    # Most steps are taken in a hair of where the image folds; the focal length is the unit.
    enough = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 20_000, 1e-14)
    found, seen = np.full(points.shape, np.nan), np.isfinite(points).all(axis=1)
    if seen.any():  # a NaN would be tried to the last iteration, and no points are refused
        ideal = cv2.undistortPoints(points[seen, None], np.eye(3), coefficients, criteria=enough)
        found[seen] = ideal[:, 0]
    found[~(np.abs(distorted(found, coefficients) - points).max(axis=1) < 1e-7)] = np.nan
    return found


def distorted(points: Floats, coefficients: Floats) -> Floats:
    """Where points of the ideal image, (n, 2), are seen through the lens."""
    ahead, still = np.column_stack((points, np.ones(len(points)))), np.zeros(3)
    seen, _ = cv2.projectPoints(ahead[:, None], still, still, np.eye(3), coefficients)
    return np.asarray(seen[:, 0], float)


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
class AffineCamera(OrthographicCamera):
    """A camera far away of which nothing is known: pixels are an affine map of space.

    Parameters
    ----------
    axes : array_like, shape (2, 3)
        By how many pixels to the right and up the image of a point moves with each coordinate.
    position, normal, scale, angle, image_size
        See `Camera`; the scale is 1, as that of the frame is not known, and the angle zero.
    """

    model: ClassVar[str] = "affine"

    axes: Floats

    def __post_init__(self) -> None:
        axes = check_array("axes", self.axes)
        if axes.shape != (2, 3) or np.linalg.matrix_rank(np.nan_to_num(axes)) < 2:
            raise ValueError(f"axes: must be two independent rows of three, got {shown(axes)}")
        self._set(axes=frozen(axes))
        super().__post_init__()

    @property
    def rows(self) -> Floats:
        """What stands in the place of R^-: the axes."""
        return self.axes

    @classmethod
    def of(cls, down: Floats, centre: Floats, image_size: tuple[int, int]) -> AffineCamera:
        """The camera that sees x at centre + down @ x, in pixels right and down."""
        axes = down * _DOWN[:, None]
        half = (np.array(image_size) - 1) / 2
        return cls(
            axes=axes, normal=np.cross(*axes), scale=1.0, angle=0.0, image_size=image_size,
            position=-np.linalg.pinv(axes) @ ((centre - half) * _DOWN),
        )  # fmt: skip


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
            if given.ndim != 1 or len(given) > len(LENS) or not np.isfinite(given).all():
                raise ValueError(
                    f"distortion: must be at most {len(LENS)} finite numbers, "
                    f"{', '.join(LENS)}, got {shown(self.distortion)}"
                )
            size = USUAL if len(given) <= USUAL else len(LENS)
            self._set(distortion=frozen(np.pad(given, (0, size - len(given)))))

    def _through(self, lens: Callable[[Floats, Floats], Floats], centred: Floats) -> Floats:
        if self.distortion is None or self.scale is None or not len(centred):
            return centred  # which OpenCV refuses, if there is none
        return lens(self.scale * centred * _DOWN, self.distortion) * _DOWN / self.scale

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
        return 1 / self.calibration[0]

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
        plane, depth = image[:, :2] @ turn(angle), image[:, 2]
        if not radius > 0 or (depth <= radius).any():
            raise ValueError(
                f"radius: must be positive and less than each distance, got {radius} "
                f"and {np.nanmin(depth)}"
            )
        clear = depth**2 - radius**2
        # Away from the line of view the half axis grows by so many times, across it by none.
        along = np.sqrt(1 + np.sum(plane**2, axis=1) / clear)
        stretch = plane[:, :, None] * plane[:, None, :] / (clear * (1 + along))[:, None, None]
        shapes = (radius / (scale * np.sqrt(clear)))[:, None, None] * (np.eye(2) + stretch)
        centres = plane * (depth / (scale * clear))[:, None]
        # What the lens makes of small shapes, by steps of a pixel.
        ends = [(self.seen(centres + e) - self.seen(centres - e)) / 2 for e in np.eye(2)]
        return self.seen(centres), np.stack(ends, axis=-1) @ shapes @ np.diag(_DOWN)


#: The models by their names in the files of rigs.
MODELS: dict[str, Any] = {
    kind.model: kind for kind in (OrthographicCamera, PerspectiveCamera, AffineCamera)
}


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


def missed(cameras: Sequence[Camera], tracks: Sequence[Floats]) -> list[Floats]:
    """`residuals` of tracks that were checked."""
    x = intersect(cameras, tracks)
    return [track - camera.image(x) for track, camera in zip(tracks, cameras, strict=True)]


def at_once(cameras: Sequence[Camera], tracks: Sequence[Floats]) -> list[Floats]:
    """Tracks as cameras would have seen them that read all rows at once."""
    return [camera.steadied(track) for camera, track in zip(cameras, tracks, strict=True)]


def trimmed(residual: Floats, share: float = TRIMMED) -> float:
    """Length of the residuals, (n, 2), that one frame in ten exceeds.

    From another share of them if they are normal: their lengths are then Rayleigh's.
    """
    seen = residual[np.isfinite(residual).all(axis=1)]
    if not len(seen):
        return 0.0
    ratio = np.sqrt(np.log(1 - TRIMMED) / np.log(1 - share))
    return float(ratio * np.quantile(np.hypot(*seen.T), share))


@np.errstate(all="ignore")  # lines that hardly cross may send a point far away
def intersect(cameras: Sequence[Camera], tracks: Sequence[Floats]) -> Floats:
    """Points that calibrated cameras of any model see at given pixels, by least squares in pixels.

    The linear equations, in scene units, are the start of a Gauss-Newton search for the least
    reprojection error.

    Parameters
    ----------
    cameras : sequence of Camera, length m
    tracks : sequence of ndarray, shape (n, 2)
        Pixels, one array per camera; a row of NaN puts no condition on the point.

    Returns
    -------
    ndarray, shape (n, 3)
        Scene units; NaN where all lines of sight are parallel, or meet behind a camera.
    """
    matrices = np.array([camera.matrix for camera in cameras])
    scales = np.array([camera.calibration[0] for camera in cameras])
    seen = np.stack([c.turned(track) for c, track in zip(cameras, tracks, strict=True)], axis=1)
    visible = np.asarray(np.isfinite(seen).all(axis=-1))
    seen = np.where(visible[..., None], seen, 0)

    left, right = _stacked(*_lines(matrices, scales[:, None] * seen), visible)
    x, part = _least_squares(left, right), np.ones(len(left))
    crossing = (np.linalg.svd(left, compute_uv=False) > PARALLEL).sum(axis=1) == 3
    slope, off = _reprojection(matrices, scales, seen, visible, x)
    active = np.flatnonzero(crossing)
    for _ in range(_STEPS):
        step = part[active, None] * _least_squares(slope[active], off[active])
        tried = x[active] + step
        new_slope, new_off = _reprojection(matrices, scales, seen[active], visible[active], tried)
        error, new_error = np.sum(off[active] ** 2, axis=1), np.sum(new_off**2, axis=1)
        moved = np.abs(slope[active] @ step[..., None]).max(axis=(1, 2), initial=0)
        lower = new_error <= (1 + 1e-12) * error + SETTLED**2  # or equal, but for rounding
        part[active] = np.where(lower, 1, part[active] / 2)  # of a step that leads uphill
        taken = active[lower]
        x[taken], slope[taken], off[taken] = tried[lower], new_slope[lower], new_off[lower]
        active = active[~(moved <= SETTLED)]
        if not active.size:
            break
    depth = x @ matrices[:, 2, :3].T + matrices[:, 2, 3]
    x[(visible & (depth <= 0)).any(axis=1) | ~crossing] = np.nan
    return x


def epipolar_lines(known: Camera, pixels: Floats, unknown: Camera) -> tuple[Floats, Floats]:
    """What the lines of sight of one camera are in the image of another, of whatever scale.

    For the matrices P of the known camera and Q of the other, the line of sight of the homogeneous
    pixel y = (s T x_c, 1) goes through pinv(P) y and the camera's centre C, P C = 0. Both are seen
    by the other on the line l = (Q pinv(P) y) x (Q C), and its own pixel there has l' y = 0.

    Parameters
    ----------
    known : Camera
        Calibrated.
    pixels : ndarray, shape (n, 2)
        Where the known camera sees some points.
    unknown : Camera
        Its scale and angle are not used. One without a position, of these two, is anywhere.

    Returns
    -------
    normals : ndarray, shape (n, 2)
        (l2, -l1) at unit length; NaN where the point is not seen, or the cameras cannot disagree
        on it.
    constants : ndarray, shape (n,)
        -l3 in the same unit: scene units, or for a perspective camera those at distance 1.
    """
    known, unknown = (c if c.is_placed else c.placed(np.zeros(2)) for c in (known, unknown))
    plane = known.calibration[0] * known.turned(pixels)
    homogeneous = np.column_stack((plane, np.ones(len(plane))))
    # Seen from the known camera: a scene far from its origin costs no digits.
    home = np.eye(4)
    home[:3, 3] = known.position
    ours, theirs = known.matrix @ home, unknown.matrix @ home
    point = homogeneous @ (theirs @ np.linalg.pinv(ours)).T
    epipole = theirs @ np.linalg.svd(ours)[2][3]
    line = np.cross(point, epipole)
    size = np.linalg.norm(line[:, :2], axis=1)
    reach = np.linalg.norm(point, axis=1) * np.linalg.norm(epipole)
    line[~(size > PARALLEL * reach)] = np.nan
    line /= size[:, None]
    return line[:, 1::-1] * [1, -1], -line[:, 2]


def epipolar_rows(
    lines: tuple[Floats, Floats], camera: Camera, pixels: Floats
) -> tuple[Floats, Floats]:
    """Linear equations for scale and angle of a camera from `epipolar_lines` and its own pixels.

    s T (X, Y) = [[X, Y], [Y, -X]] (s cos theta, s sin theta). Of pixels (..., n, 2) the design, in
    pixels, in the same shape, and the target, (..., n), or what a calibrated camera leaves of it;
    NaN where there is no line or pixel.
    """
    normals, constants = lines
    (a, b), centred = normals.T, camera.centred(pixels.reshape(-1, 2)).reshape(pixels.shape)
    x, y = centred[..., 0], centred[..., 1]
    design = np.stack((a * y - b * x, -a * x - b * y), axis=-1)
    if not camera.is_calibrated:
        return design, np.broadcast_to(constants, x.shape)
    scale, angle = camera.calibration
    return design, constants - design @ (scale * np.array([np.cos(angle), np.sin(angle)]))


def _lines(matrices: Floats, plane: Floats) -> tuple[Floats, Floats]:
    """Equations left @ x = right of the lines of sight at s T x_c, scene units.

    From (m, 3, 4) and (n, m, 2) to (n, m, 2, 3) and (n, m, 2).
    """
    left = matrices[:, :2, :3] - plane[..., None] * matrices[:, None, 2, :3]
    return left, plane * matrices[:, 2, 3, None] - matrices[:, :2, 3]


def _reprojection(
    matrices: Floats, scales: Floats, turned: Floats, visible: Bools, x: Floats
) -> tuple[Floats, Floats]:
    """Slopes of the T x_c at which points are seen, (n, 2 m, 3), and how far these are off."""
    image = np.moveaxis(x @ matrices[:, :, :3].swapaxes(1, 2), 0, 1) + matrices[:, :, 3]
    plane, depth = image[..., :2] / image[..., 2:], image[..., 2, None, None]
    slope = _lines(matrices, plane)[0] / (scales[:, None, None] * depth)
    return _stacked(slope, turned - plane / scales[:, None], visible)


def _stacked(left: Floats, right: Floats, visible: Bools) -> tuple[Floats, Floats]:
    """Equations of all cameras, (n, 2 m, 3) and (n, 2 m), zero where the target is hidden."""
    rows = 2 * visible.shape[1]
    left = np.where(visible[..., None, None], left, 0).reshape(-1, rows, 3)
    return left, np.where(visible[..., None], right, 0).reshape(-1, rows)


def _least_squares(left: Floats, right: Floats) -> Floats:
    """Solutions of many small systems; zero where numbers overflow: a point that ran far away."""
    whole = np.isfinite(left).all(axis=(1, 2), keepdims=True)
    inverse = np.linalg.pinv(np.where(whole, left, 0.0), rcond=PARALLEL**2)
    return (inverse @ right[..., None])[..., 0]
