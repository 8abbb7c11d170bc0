"""Motion of the camera: where each frame of a trembling or held camera lies in the first one.

Corners of a key frame are followed into the frames after it (Lucas-Kanade); the homography that
most of them obey, counted by the parts of the image that they cover, is the camera's motion, since
the target is in few of these parts however much texture it has. Where there are few corners, all
pixels tell the motion (`aligning`). A new key frame is taken when little is left of the last one.

A camera is at rest unless its frames say otherwise: a map that is not needed only adds its errors.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ..arrays import Bools, Floats, Floats32, Image
from .aligning import Aligned, Ground, align, grounds, pyramid

_PARTS = 12  # parts into which each side of the image is cut; one corner is followed in each
_WIDTH = 21  # reduced pixels: what is smoother than this is light
_CONTRAST, _DARK = 250.0, 20.0  # of the relief; grey levels below which all is dark
_EXACT = 1.0  # reduced pixels by which a corner may miss its place
_STILL = 0.25  # reduced pixels by which a corner at rest may seem to move
_VAGUE = 3.0  # reduced pixels: a map that is known no better is not known
PLAINLY = 10.0  # standard errors of a displacement that is one
_FEWEST = 8  # corners for a map of four numbers: shift, turn and scale
_SOME, _MANY = 20, 60  # corners that are worth a look; that need no other witness
_AGREE = 0.25  # share of the corners that must do so: of those of mere noise, 0.15 to 0.24 agree
_WIDE = 0.6  # times the image's own spread, that of corners that tell the camera's motion at least


class CameraMotion(NamedTuple):
    """Where each frame lies in the first one.

    `maps` (n, 3, 3) take homogeneous pixels of a frame to pixels of the first; `errors` (n,) are
    the standard errors of the places that they give, in pixels: infinite where nothing is known.
    """

    maps: Floats
    errors: Floats

    @property
    def moves(self) -> bool:
        """Does the camera move at all?"""
        return not np.array_equal(self.maps, np.broadcast_to(np.eye(3), self.maps.shape))


def at_rest(n: int) -> CameraMotion:
    """The motion of a camera that stands still."""
    return CameraMotion(np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros(n))


def carry(maps: NDArray, points: Floats) -> Floats:
    """Points (n, 2) taken through one map (3, 3), or each through its own (n, 3, 3)."""
    ends = np.einsum("...ij,...j->...i", maps, np.column_stack([points, np.ones(len(points))]))
    return ends[:, :2] / ends[:, 2:]


class _Relief(NamedTuple):
    """A reduced frame: what stands out from its surroundings, whatever the light; grey levels."""

    fine: Image
    levels: list[Floats32]

    @classmethod
    def of(cls, small: Image) -> "_Relief":
        grey = cv2.cvtColor(small, cv2.COLOR_BGR2GRAY).astype(np.float32)
        grey = np.asarray(cv2.GaussianBlur(grey, (0, 0), 1))
        mean = cv2.blur(cv2.blur(grey, (_WIDTH, _WIDTH)), (_WIDTH, _WIDTH))
        fine = np.clip(128 + _CONTRAST * (grey - mean) / (mean + _DARK), 0, 255).astype(np.uint8)
        return cls(fine, pyramid(small))


def _corners(grey: Image) -> Floats:
    """The best corner of each part of the image that has one, (m, 2): none counts twice."""
    sharp = cv2.cornerMinEigenVal(grey, 9, ksize=3)
    height, width = (side // _PARTS for side in grey.shape)
    if not height or not width:
        return np.zeros((0, 2))
    whole = np.asarray(sharp)[: height * _PARTS, : width * _PARTS]
    parts = whole.reshape(_PARTS, height, _PARTS, width).swapaxes(1, 2).reshape(_PARTS**2, -1)
    best = parts.argmax(axis=1)
    row, column = np.divmod(np.arange(_PARTS**2), _PARTS)
    found = np.column_stack([column * width + best % width, row * height + best // width])
    # Smallest eigenvalue of the gradient's covariance in a corner, grey levels squared.
    return found[parts.max(axis=1) > 2.0 / 255**2].astype(float)


def _follow(before: Image, after: Image, points: Floats, guess: Floats) -> tuple[Floats, Bools]:
    """Where the corners are in another image, and which were found."""
    if not len(points):
        return points, np.zeros(0, bool)
    flown, found, _ = cv2.calcOpticalFlowPyrLK(
        before, after, points.astype(np.float32)[:, None], guess.astype(np.float32)[:, None].copy(),
        winSize=(15, 15), maxLevel=3, flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )  # fmt: skip
    ends = np.asarray(flown[:, 0], float)
    size = np.array(after.shape[1::-1])
    within = ((ends >= 0) & (ends < size)).all(axis=1)
    return ends, (np.asarray(found)[:, 0] > 0) & within


def stands_still(samples: Iterable[Image]) -> bool | None:
    """Does no pair of reduced samples, successive or far apart, show that the camera moves?

    It moves if clearly more corners share a motion than stay where they are. None if most pairs
    are too plain to tell.
    """
    reliefs = [_Relief.of(sample) for sample in samples]
    pairs = list(zip(reliefs, reliefs[1:], strict=False))
    middle = reliefs[len(reliefs) // 2]
    found = []
    for before, after in [(reliefs[0], middle), (middle, reliefs[-1]), *pairs]:
        found.append(_moved(before, after))
        if found[-1]:
            return False
    return True if 2 * found.count(None) < len(found) else None


def corners_tell(samples: Iterable[Image]) -> bool:
    """Do corners alone tell how most reduced samples lie on the next one?"""
    reliefs = [_Relief.of(sample) for sample in samples]
    told = [
        _by_corners(before, _corners(before.fine), after, np.eye(3)).alone
        for before, after in zip(reliefs, reliefs[1:], strict=False)
    ]
    return sum(told) > len(told) / 2


def _moved(before: _Relief, after: _Relief) -> bool | None:
    points = _corners(before.fine)
    ends, found = _follow(before.fine, after.fine, points, points)
    a, b = points[found], ends[found]
    similar, _ = _similar(a, b, 2 * _STILL)
    if similar is None:
        return _drifted(before, after)
    still = np.linalg.norm(b - a, axis=1) < _STILL
    share = np.linalg.norm(carry(similar, a) - b, axis=1) < _STILL
    moves = bool(still.sum() < 0.7 * share.sum())
    # Corners that must share a motion, if it is to be the camera's.
    few = share.sum() < max(10, moves * _AGREE * len(a))
    if few or (moves and not _widespread(a[share], before.fine.shape)):
        return _drifted(before, after)
    return moves


def _widespread(points: Floats, shape: Sequence[int]) -> bool:
    """Are points spread over an image (height, width)? Those of one large thing are not."""
    image = np.linalg.norm(shape) / np.sqrt(12)
    return bool(np.sqrt(points.var(axis=0).sum()) > _WIDE * image)


def _drifted(before: _Relief, after: _Relief) -> bool | None:
    """Do all pixels tell of a motion, where corners are few? None if these are mute, too."""
    found = align(grounds(before.levels), after.levels, np.eye(3))
    if found is None or found.error > _VAGUE:
        return None
    moved = displacement(found.map[None], before.fine.shape[::-1])[0]
    return bool(moved > PLAINLY / 2 * found.error)


def displacement(maps: Floats, size: Sequence[int]) -> Floats:
    """Pixels by which maps (n, 3, 3) move an image (width, height), rms of its parts."""
    grid = np.array([[u, v] for u in (0.2, 0.5, 0.8) for v in (0.2, 0.5, 0.8)])
    points = grid * np.array(size)
    return np.array([np.sqrt(np.mean(np.sum((carry(h, points) - points) ** 2, 1))) for h in maps])


def _similar(a: Floats, b: Floats, exact: float) -> tuple[Floats | None, Bools]:
    """The shift, turn and scale that most corners share, and which do."""
    if len(a) < _FEWEST:
        return None, np.zeros(len(a), bool)
    found, obey = cv2.estimateAffinePartial2D(a, b, ransacReprojThreshold=exact)
    if found is None:
        return None, np.zeros(len(a), bool)
    return np.vstack([found, [0, 0, 1]]), obey[:, 0] > 0


class _ByCorners(NamedTuple):
    """Where a frame lies in another, by its corners, and how many of them say so."""

    found: Aligned | None
    agreeing: int

    @property
    def alone(self) -> bool:
        """Need they no other witness?"""
        # Reduced pixels: corners that tell a map no better need another witness, too.
        return self.found is not None and self.agreeing >= _MANY and self.found.error < 0.05


def _by_corners(before: _Relief, points: Floats, after: _Relief, last: Floats) -> _ByCorners:
    """Where a frame lies in another, by its corners, from a map that is about right."""
    guess = carry(last, points) if len(points) else points
    ends, found = _follow(before.fine, after.fine, points, guess)
    a, b = points[found], ends[found]
    best, good = _similar(a, b, 2 * _EXACT)
    if best is None or good.sum() < max(_SOME, _AGREE * len(a)):
        return _ByCorners(None, 0)
    if good.sum() >= _MANY:
        full, obey = cv2.findHomography(a, b, cv2.RANSAC, _EXACT)
        if full is not None and obey.sum() >= max(_MANY, 0.8 * good.sum()):
            best, good = np.asarray(full, float), obey[:, 0] > 0
    miss = np.linalg.norm(carry(best, a[good]) - b[good], axis=1)
    error = float(np.sqrt(np.mean(miss**2) * 4 / len(miss)))
    return _ByCorners(Aligned(best, error), len(miss))


class Steadying:
    """Follows a camera through reduced frames, one at a time.

    `factor` is by how much they are reduced.
    """

    def __init__(self, factor: int) -> None:
        self.factor = factor
        self.key: _Relief | None = None
        self.maps: list[Floats] = []
        self.errors: list[float] = []

    def _start(self, relief: _Relief, base: Floats, error: float) -> None:
        self.key, self.points, self.base, self.drift = relief, _corners(relief.fine), base, error
        self.grounds: list[Ground] | None = None  # of the key frame, once they are needed
        self.last = np.eye(3)  # from the key frame to the newest

    def _locate(self, relief: _Relief) -> Aligned | None:
        """Where the key frame lies in another: by corners; if these are few, perhaps by pixels."""
        assert self.key is not None
        told = _by_corners(self.key, self.points, relief, self.last)
        if told.alone:
            return told.found
        if self.grounds is None:
            self.grounds = grounds(self.key.levels)
        direct = align(self.grounds, relief.levels, self.last)
        both = [one for one in (told.found, direct) if one is not None and one.error < _VAGUE]
        best = min((one.error for one in both), default=0.0)
        # Times the error of another map that is about as good.
        good = [one for one in both if one.error <= 3.0 * best]
        return min(good, key=lambda one: self._step(one.map), default=None)

    def _step(self, here: Floats) -> float:
        """By how much a map differs from that of the frame before, where two are as good."""
        assert self.key is not None
        step = here @ np.linalg.inv(self.last)
        return float(displacement(step[None], self.key.fine.shape[::-1])[0])

    def _shared(self, here: Floats) -> float:
        """Share of the key frame that is still in view."""
        assert self.key is not None
        size = np.array(self.key.fine.shape[::-1])
        u, v = np.meshgrid(*np.outer(size, np.linspace(0, 1, 9)))
        places = carry(here, np.column_stack([u.ravel(), v.ravel()]))
        return float(((places >= 0) & (places < size)).all(axis=1).mean())

    def add(self, small: Image) -> None:
        """The next frame."""
        relief = _Relief.of(small)
        if self.key is None:
            self.before = relief, np.eye(3), 0.0
            self._start(*self.before)
            self.maps.append(np.eye(3))
            self.errors.append(0.0)
            return
        located = self._locate(relief)
        if located is None:  # little in common with the key frame: more with the last one known
            self._start(*self.before)
            located = self._locate(relief)
        if located is None:
            self.maps.append(self.maps[-1])
            self.errors.append(np.inf)
            return
        self.last = located.map
        self.maps.append(self.base @ np.linalg.inv(self.last))
        self.errors.append(float(np.hypot(self.drift, located.error)))
        self.before = relief, self.maps[-1], self.errors[-1]
        # Share of a key frame that is left, below which there must be a new one. Each adds its
        # error to all that follow, so late: a little above the 0.3 that `align` needs.
        if self._shared(self.last) < 0.4:
            self._start(*self.before)

    def motion(self) -> CameraMotion:
        """The motion so far, in pixels of the frames."""
        k = self.factor
        enlarge = np.array([[k, 0, (k - 1) / 2], [0, k, (k - 1) / 2], [0, 0, 1]])
        maps = enlarge @ np.array(self.maps) @ np.linalg.inv(enlarge)
        return CameraMotion(maps / maps[:, 2:, 2:], k * np.array(self.errors))
