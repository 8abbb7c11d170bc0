"""From the film of one camera to the law of a motion in a plane that faces it, or is marked out.

`discover_from_video` tracks the target, takes its pixels to the plane (two marks and the distance
between them, or the corners of a rectangle), and looks for the law. Of nested laws, each class with
fewer symmetries than the one before it, the simplest is taken that the data bear: forces that are
the same everywhere (`homogeneous`), forces linear in place and velocity, all that `discover` knows.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .checks import check_array, check_integer, check_number, check_positive, check_vector
from .dynamics import (
    Discovery,
    PolynomialSystem,
    Quantity,
    Swing,
    check_library,
    check_order,
    discover,
    find_swing,
    homogeneous,
    smooth,
)
from .refusal import refusing
from .vision import Hint, Track, check_detector, frame_clock, track, video_info

NAMES = ("x", "y")
MARK = 1.0
"""Standard error of a mark that is set by hand, in pixels."""
EARTH, ELSEWHERE = 9.81, 0.03
"""What pulls at all bodies, in metres a second squared, and by how much it differs on earth."""
SURE = 3.0
"""Standard errors from which on a difference is one."""
TILTED = np.deg2rad(2.0)
"""Angle between a pull and a vertical that is marked by hand, up to which they may be one."""
ASIDE = 5.0
"""Spread across a line, over the noise, up to which a motion is one along it."""


@dataclass(frozen=True, eq=False)
class PlaneDiscovery:
    """A motion in a plane, and the law that it obeys.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times of the frames, in seconds unless ``fps`` says otherwise.
    x : ndarray, shape (n, 2)
        Where the target is in the plane, rightwards and upwards; NaN where it was not seen.
    unit : {"m", "px"}
        Of places.
    scale_error : float
        Standard error of the scale, as a share of it: all places are off by it alike.
    homography : ndarray, shape (3, 3)
        From pixels of the first frame to the plane, homogeneous.
    track : Track
        The target in the film.
    line : tuple of ndarray, shapes (2,) and (m, 2)
        An origin and unit vectors: of what they are the coordinates that the law has. The axes of
        the plane, x and y; or the one line along which the target moves, x.
    discovery : Discovery
        The law; the errors of its terms hold that of the scale. Where the target swings on a
        circle, that of the angle.
    swing : Swing, optional
        The circle, if the target swings on one.
    warnings : tuple of str
        Why not to trust it: those of the track, of the law, and what they say of the scale.
    """

    t: Floats
    x: Floats
    unit: str
    scale_error: float
    homography: Floats
    track: Track
    line: tuple[Floats, Floats]
    discovery: Discovery
    warnings: tuple[str, ...]
    swing: Swing | None = None

    @property
    def status(self) -> str:
        """``"ok"``, or ``"suspect"`` if there is a warning."""
        return "suspect" if self.warnings else "ok"

    @property
    def g(self) -> Quantity | None:
        """The pull of gravity on what flies, or swings on a circle; None of other motions."""
        if self.swing is not None:
            return self.swing.g
        said = [q for q in self.discovery.physics() if q.name == "g"]
        return said[0] if said else None

    @property
    def period(self) -> Quantity | None:
        """Of small swings: of the coordinate or mode that moves most; None if nothing swings."""
        said = [q for q in self.discovery.physics() if q.name.startswith("period")]
        return min(said, key=lambda q: self._left_of(float(q.value)), default=None)

    def _left_of(self, period: float) -> float:
        """Squares that oscillations of one period leave of the path."""
        seen = np.isfinite(self.x[:, 0])
        phase = 2 * np.pi * self.t[seen] / period
        waves = np.column_stack([np.ones_like(phase), np.cos(phase), np.sin(phase)])
        left = self.x[seen] - waves @ np.linalg.lstsq(waves, self.x[seen], rcond=None)[0]
        return float((left**2).sum())

    @property
    def fitted(self) -> Floats:
        """The path that obeys the law, in the shape of ``x``; NaN before and after it."""
        return self.along(self.t)

    def along(self, t: Floats) -> Floats:
        """Places of the path that obeys the law at times (n,), (n, 2)."""
        if self.swing is not None:
            circle, angle = self.swing.circle, self.discovery.curve(t)[:, :1]
            ways = np.hstack([np.cos(angle), np.sin(angle)]) @ circle.axes
            return circle.centre + circle.radius * ways
        origin, axes = self.line
        return origin + self.discovery.curve(t)[:, : len(axes)] @ axes

    def in_picture(self, x: Floats) -> Floats:
        """Places of the plane, (n, 2), in pixels of the first frame."""
        return _mapped(np.asarray(np.linalg.inv(self.homography), float), x)

    def __str__(self) -> str:
        said = [f"of small swings: {self.period}"] if self.swing and self.period else []
        if len(self.line[1]) == 1:
            said.append(
                "along a line, on which x points to ({:.3f}, {:.3f})".format(*self.line[1][0])
            )
        scale = f"places in {self.unit}"
        scale += f", their scale known to {100 * self.scale_error:.2g} %" * (self.unit == "m")
        warnings = (f"warning: {text}" for text in self.warnings)
        # The doubts below the law of a swing are among the warnings.
        law = self.discovery.statement()
        law = law if self.swing is None else str(self.swing).partition("\n")[0]
        return "\n".join([law, *said, scale, *warnings])


def discover_from_video(
    path: str | os.PathLike,
    length: Sequence[float] | None = None,
    up: Sequence[float] | None = None,
    fps: float | None = None,
    *,
    corners: tuple[ArrayLike, Sequence[float]] | None = None,
    length_error: float = 0.01,
    hint: Hint | None = None,
    detector: str | os.PathLike = "auto",
    degree: int | None = None,
    order: int | str = "auto",
    seed: int = 0,
    progress: bool = False,
) -> PlaneDiscovery:
    """Discover the law of a motion in a plane from the film of one camera.

    Parameters
    ----------
    path : path
        A film, see `track`. Marks are in pixels of its first frame.
    length : (u1, v1, u2, v2, metres), optional
        Two marks, and how far they are apart in the plane of the motion; the first is its origin.
        Without it, and without corners, places are in pixels from the lower left of the picture.
    up : (du, dv) or (u1, v1, u2, v2), optional
        The vertical, as a direction in the picture or by two marks, the lower one first; by default
        that of the picture.
    fps : float, optional
        Frames in one second, where the file does not say so: slow motion.
    corners : (marks, (width, height)), optional
        For a plane that is seen askew: the corners of a rectangle in it, shape (4, 2), lower left,
        lower right, upper right, upper left, and its sides in metres. The lower left is the origin.
    length_error : float
        Standard error of the length or of the sides, as a share of them. That of marks, a pixel
        each, comes on top.
    hint, detector
        See ``target`` and ``detector`` of `track`.
    degree, order, seed, progress
        See `discover`. By default, of nested laws the simplest that the data bear: forces that are
        the same at every place, linear ones, all up to degree 3.

    Returns
    -------
    PlaneDiscovery

    Raises
    ------
    FileNotFoundError, ValueError
        If marks or numbers are no such, or as `track` and `discover` do.

    Examples
    --------
    >>> found = vl.discover_from_video("throw.mp4", length=(272, 446, 273, 47, 1.0))
    >>> print(found, found.g)
    """
    check_detector(detector)
    check_order(order, "learn", check_library(degree, None))
    check_integer("seed", seed)
    share = check_number("length_error", length_error)
    if not 0 <= share < 1:
        raise ValueError(f"length_error: must be a share of the length, 0 to 1, got {share}")
    shot = video_info(path)
    if fps is None and not shot.fps:
        raise ValueError(f"fps: must be given, as {Path(path).name} states no frame rate")
    homography, pixels = _to_plane(length, up, corners, shot.size)
    error = float(np.hypot(share, np.sqrt(2) * MARK / pixels)) if pixels else 0.0
    rate = shot.fps if fps is None else check_positive("fps", fps)
    seen = track(path, detector, hint)
    t, x = frame_clock(path) / rate, _mapped(homography, seen.pixels)
    with refusing("law", [seen.pixels], [Path(path).name]):
        there = np.isfinite(x[:, 0])
        line, law, swing = _law(t[there], x[there], degree, order, seed, progress)
    doubts = list(law.warnings)
    if swing is None:
        law = replace(
            law,
            covariance=_with_scale(law.covariance, law.system, error),
            native_covariance=_with_scale(law.native_covariance, law.native, error),
        )
    else:  # an angle has no scale, its circle has
        circle = swing.circle
        spread = float(np.hypot(circle.radius_error, error * circle.radius))
        swing = replace(swing, circle=replace(circle, radius_error=spread))
        doubts += circle.warnings
    unit = "m" if pixels else "px"
    found = PlaneDiscovery(t, x, unit, error, homography, seen, line, law, (), swing)
    doubts += _doubts(found, up is not None or corners is not None)
    return replace(found, warnings=(*seen.warnings, *doubts))


def _to_plane(
    length: Sequence[float] | None,
    up: Sequence[float] | None,
    corners: tuple[ArrayLike, Sequence[float]] | None,
    size: tuple[int, int],
) -> tuple[Floats, float]:
    """From pixels to the plane, (3, 3); and the pixels its scale was measured on, 0 if none."""
    direction = _upwards(up)
    if corners is not None:
        if length is not None:
            raise ValueError("corners: must not be given with length, got both")
        return _rectified(*_checked(corners), direction if up is not None else None)
    origin, scale, pixels = np.array([0.0, size[1] - 1.0]), 1.0, 0.0
    if length is not None:
        marks = check_vector("length", length, 5)
        origin, pixels = marks[:2], float(np.hypot(*(marks[2:4] - marks[:2])))
        if not (pixels > 2 * MARK and marks[4] > 0):
            raise ValueError(
                "length: must be two marks apart from each other and a distance above 0, "
                f"got {tuple(marks)}"
            )
        scale = marks[4] / pixels
    turn = np.array([[-direction[1], direction[0]], direction])
    return np.vstack([np.column_stack([scale * turn, -scale * turn @ origin]), [0, 0, 1]]), pixels


def _upwards(up: Sequence[float] | None) -> Floats:
    """The unit vector of the vertical in the picture, (u right, v down)."""
    if up is None:
        return np.array([0.0, -1.0])
    marks = check_array("up", up)
    if marks.shape not in ((2,), (4,)):
        raise ValueError(f"up: must be (du, dv) or two marks (u1, v1, u2, v2), got {up!r:.60}")
    away = marks if len(marks) == 2 else marks[2:] - marks[:2]
    if not (np.isfinite(away).all() and away.any()):
        raise ValueError(f"up: must be a direction, got {up!r:.60}")
    return away / np.hypot(*away)


def _checked(corners: tuple[ArrayLike, Sequence[float]]) -> tuple[Floats, Floats]:
    """Marks, (4, 2), and sides, (2,), of a rectangle."""
    if not isinstance(corners, tuple | list) or len(corners) != 2:
        raise ValueError(f"corners: must be four marks and two sides, got {corners!r:.60}")
    marks, sides = check_array("corners", corners[0]), check_vector("corners", corners[1], 2)
    if marks.shape != (4, 2) or not (np.isfinite(marks).all() and sides.min() > 0):
        raise ValueError(
            f"corners: must be four marks (4, 2) and two sides above 0, got {corners!r:.60}"
        )
    edges = np.roll(marks, -1, axis=0) - marks
    turns = edges[:, 0] * np.roll(edges[:, 1], -1) - edges[:, 1] * np.roll(edges[:, 0], -1)
    if not (turns < 0).all():  # v points down
        raise ValueError(
            "corners: must be lower left, lower right, upper right, upper left of a rectangle, "
            f"got {marks.tolist()}"
        )
    return marks, sides


def _rectified(marks: Floats, sides: Floats, up: Floats | None) -> tuple[Floats, float]:
    """The homography that takes marks to the corners of a rectangle; see `_to_plane`."""
    places = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * sides
    rows = []
    for (u, v), place in zip(marks, places, strict=True):
        for axis, value in enumerate(place):
            row = np.zeros(9)
            row[3 * axis : 3 * axis + 3], row[6:] = (u, v, 1), (-value * u, -value * v, -value)
            rows.append(row)
    homography = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)
    if up is not None:  # of the plane, as it is seen at the middle of the rectangle
        middle = marks.mean(axis=0)
        away = np.diff(_mapped(homography, np.array([middle, middle + up])), axis=0)[0]
        c, s = away[::-1] / np.hypot(*away)
        homography = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ homography
    sizes = np.linalg.norm(np.roll(marks, -1, axis=0) - marks, axis=1)
    return homography / homography[2, 2], float(sizes.min())


def _mapped(homography: Floats, places: Floats) -> Floats:
    """Places, (n, 2), where a homography takes them."""
    mapped = np.column_stack([places, np.ones(len(places))]) @ homography.T
    return mapped[:, :2] / mapped[:, 2:]


def _law(
    t: Floats, x: Floats, degree: int | None, order: int | str, seed: int, progress: bool
) -> tuple[tuple[Floats, Floats], Discovery, Swing | None]:
    """The law of places: of nested ones the simplest that the data bear, or the one asked for.

    And of what it has the coordinates, see `PlaneDiscovery`.
    """
    plane = np.zeros(2), np.eye(2)
    if degree is not None or order != "auto":
        found = discover(t, x, degree, seed, progress, order=order)
        return plane, found if found.swing is None else found.swing.law, found.swing
    if (flight := homogeneous(t, x, NAMES)) is not None:
        return plane, flight, None
    if (line := _line(t, x)) is None and (swing := find_swing(t, x, seed)) is not None:
        return plane, swing.law, swing
    origin, axes = line or plane
    return (origin, axes), discover(t, (x - origin) @ axes.T, 1, seed, progress, order=2), None


def _line(t: Floats, x: Floats) -> tuple[Floats, Floats] | None:
    """Origin and direction, (1, 2), of the line that a path does not leave within its noise."""
    middle = x.mean(axis=0)
    _, sizes, axes = np.linalg.svd(x - middle, full_matrices=False)
    noise = smooth([(t, (x - middle) @ axes.T)], np.random.default_rng(0)).noise
    if sizes[1] > ASIDE * noise[1] * np.sqrt(len(x)):
        return None
    main = axes[:1] * np.sign(axes[0, np.abs(axes[0]).argmax()])
    # Zero next to that of the plane: a zero near where the target rests would pass for its rest.
    return middle - middle @ main.T @ main, main


def _with_scale(covariance: Floats, law: PolynomialSystem, error: float) -> Floats:
    """With what an error of the scale makes of coefficients, 1 - p times for those of degree p."""
    rates = (law.coefficients * (1 - law.exponents.sum(axis=1))[:, None]).T.ravel()
    return covariance + error**2 * np.outer(rates, rates)


def _doubts(found: PlaneDiscovery, vertical: bool) -> list[str]:
    """What the law says against scale, frame rate and vertical."""
    doubts, g = [], found.g
    if found.unit == "m" and g is not None:
        times = float(g.value) / EARTH
        if abs(times - 1) * EARTH > SURE * np.hypot(float(g.error), ELSEWHERE):
            wrong = (
                f"the length may be {times:.3g} times too large, or the frame rate "
                f"{np.sqrt(times):.3g} times, or the plane lies askew"
                if times > 0
                else "it does not hang there, or the plane lies askew"
            )
            doubts.append(f"length: {g} is not the {EARTH} of what flies or swings freely: {wrong}")
    if vertical and found.swing is None and g is not None:
        pull = found.discovery.physics()["direction"]
        tilt = np.arctan2(pull.value[0], -pull.value[1])
        if abs(tilt) > SURE * np.hypot(float(pull.error[0]), TILTED):
            doubts.append(
                f"up: the pull is {np.rad2deg(tilt):.3g} degrees off the vertical that was given"
            )
    return doubts
