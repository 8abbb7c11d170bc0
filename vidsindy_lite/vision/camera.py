"""Motion of the camera: where each frame of a trembling or held camera lies in the first one.

A camera is at rest unless its frames say otherwise: a map that is not needed only adds its errors.
Several witnesses are asked until one is sure.

Corners of a key frame are followed into the frames after it (Lucas-Kanade); the homography that
most of them obey, counted by the parts of the image that they cover, is the camera's motion, since
the target is in few of these parts however much texture it has. Where there are few corners, all
pixels tell the motion. A new key frame is taken when little is left of the last one.

Clouds, waves and plain walls have no corners, but all of their pixels together tell a motion to a
fraction of a pixel, and how well they tell it. A shift, turn and scale, a gain and an offset of the
light are fitted by least squares (Gauss and Newton; Lucas and Kanade 1981), from coarse to fine,
with weights that leave aside what moves on its own.

A motion can be wrong with small errors: before a smooth wall nothing but the target has corners,
and then the target's motion is taken for the camera's. But the plate that it makes, and the one of
a camera at rest, each say what all frames look like in all of their parts, and what moves on its
own is in few of these: so a motion is taken only if it explains the frames better than rest does.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np

from ..arrays import Floats, Floats32, Image, Ints
from .plate import Plate, carry, changes, lengths, light
from .video import Reel

_BEYOND = -1e6  # in place of grey levels where nothing is shown: what it has a part in is below 0
_STEP = 8.0  # pixels by which the guess may be wrong
PARTS = 12  # into which each side of an image is cut: of one corner, and of one error, each
LOOSE = 1.0  # pixels (reduced ones if it is to be used at all) to which a camera's motion is known
_STILL = 0.25  # reduced pixels by which a corner at rest may seem to move
_PLAINLY = 10  # standard errors from which on one pair of views tells a displacement
_MANY = 60  # corners that need no other witness
_CHANCE = 0.04  # gain (see `_gain`) above which it tells: those of mere noise are a tenth of it


class Aligned(NamedTuple):
    """The map (3, 3) of one view to another, and the standard error of the places it gives."""

    map: Floats
    error: float


class Look:
    """A reduced frame as it is compared with others; what of it is not needed is not worked out."""

    def __init__(self, small: Image) -> None:
        self.grey = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY).astype(np.float32)

    @cached_property
    def levels(self) -> list[Floats32]:
        """Its grey levels at a half, a quarter, ... of its size."""
        levels = [self.grey]
        while len(levels) <= 4 and min(levels[-1].shape) >= 32:
            levels.append(np.asarray(cv2.pyrDown(levels[-1]), np.float32))
        # So soft that linear interpolation neither shifts nor softens them (the cubic one shifts).
        return [np.asarray(cv2.GaussianBlur(one, (0, 0), 1), np.float32) for one in levels[1:]]

    @cached_property
    def slopes(self) -> list[Floats32]:
        """By what each pixel of these changes, see `_slopes`."""
        return [_slopes(grey) for grey in self.levels]

    @cached_property
    def relief(self) -> Image:
        """What stands out from its surroundings, whatever the light."""
        grey = np.asarray(cv2.GaussianBlur(self.grey, (0, 0), 1))
        mean = cv2.blur(cv2.blur(grey, (21, 21)), (21, 21))  # what is smoother than this is light
        relief = 128 + 250 * (grey - mean) / (mean + 20)  # below 20, all is dark
        return np.clip(relief, 0, 255).astype(np.uint8)

    @cached_property
    def corners(self) -> Floats:
        """The best corner of each part of the image that has one, (m, 2): none counts twice."""
        sharp = np.asarray(cv2.cornerMinEigenVal(self.relief, 9, ksize=3))
        height, width = (side // PARTS for side in sharp.shape)
        if not height or not width:
            return np.zeros((0, 2))
        whole = sharp[: height * PARTS, : width * PARTS].reshape(PARTS, height, PARTS, width)
        parts = whole.swapaxes(1, 2).reshape(PARTS**2, -1)
        best = parts.argmax(axis=1)
        row, column = np.divmod(np.arange(PARTS**2), PARTS)
        found = np.column_stack([column * width + best % width, row * height + best // width])
        # Smallest eigenvalue of the gradient's covariance in a corner, grey levels squared.
        return found[parts.max(axis=1) > 2.0 / 255**2].astype(float)

    def follow(self, other: Look, guess: Floats) -> tuple[Floats, Floats]:
        """Where its corners are, and where they are found in another image, near a guess (3, 3)."""
        if not len(self.corners):
            return self.corners, self.corners
        points = self.corners.astype(np.float32)[:, None]
        near = carry(guess, self.corners).astype(np.float32)[:, None].copy()
        flown, found, _ = cv2.calcOpticalFlowPyrLK(
            self.relief, other.relief, points, near, winSize=(15, 15), maxLevel=3,
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        )  # fmt: skip
        ends = np.asarray(flown[:, 0], float)
        within = ((ends >= 0) & (ends < other.relief.shape[::-1])).all(axis=1)
        good = (np.asarray(found)[:, 0] > 0) & within
        return self.corners[good], ends[good]


def align(before: Look, after: Look, guess: Floats) -> Aligned | None:
    """The map of one view to another, from a guess; None where they have little in common.

    Its error is infinite where the views tell no more than the guess.
    """
    if not before.levels:  # images too small for a pyramid
        return None
    size = 2 * np.array(before.levels[0].shape[::-1])
    found = Aligned(_as_similarity(guess, size), np.inf)
    for level in range(len(before.levels), 0, -1):
        scale, back = (np.diag([x, x, 1.0]) for x in (0.5**level, 2.0**level))
        # Grey levels from which on a pixel is left aside.
        loose = 40.0 if level > 1 else 0.0
        both = before.slopes[level - 1], after.levels[level - 1]
        fitted = _fit(*both, scale @ found.map @ back, scale[0, 0], loose)
        if fitted is None:
            return None
        found = Aligned(back @ fitted.map @ scale, 2 * fitted.error)
    return found if found.error < _STEP else found._replace(error=np.inf)


def _as_similarity(guess: Floats, size: Ints) -> Floats:
    """The shift, turn and scale nearest to a guess in an image (width, height).

    Other parts of it, as perspective, would stay as they are, since nothing is fitted to them.
    """
    corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) * size.astype(float)
    # As complex numbers, places are turned, scaled and shifted by a line.
    turn, shift = np.polyfit(corners @ [1, 1j], carry(guess, corners) @ [1, 1j], 1)
    return _similarity(turn.real, turn.imag, shift.real, shift.imag)


def _similarity(along: float, across: float, right: float, down: float) -> Floats:
    """The map (3, 3) that turns and scales an image, and shifts it."""
    return np.array([[along, -across, right], [across, along, down], [0, 0, 1]])


def _fit(
    slopes: Floats32, view: Floats32, here: Floats, scale: float, loose: float
) -> Aligned | None:
    """One level: Gauss-Newton steps of which each refines the map by what the key's slopes say."""
    key = slopes[4]
    height, width = key.shape
    power = _by_blocks(slopes[0] ** 2 + slopes[1] ** 2)
    # Times what a usual block tells, that one block may tell at most.
    fair = np.minimum(1, 4.0 * np.median(power) / np.maximum(power, 1e-9))
    share = cv2.resize(fair, (width, height), interpolation=cv2.INTER_LINEAR)
    middle = np.array([[1, 0, (width - 1) / 2], [0, 1, (height - 1) / 2], [0, 0, 1.0]])
    steep = slopes.reshape(6, -1)
    # What the guess may be wrong by: shift, turn and scale, gain and offset of the light.
    sure = np.array([scale * _STEP, scale * _STEP, 0.03, 0.03, 1, 100])
    prior = np.diag(1 / sure**2)
    gain, offset = 1.0, 0.0
    # The rim depends on what lies beyond the image.
    framed = np.pad(view[2:-2, 2:-2], 2, constant_values=_BEYOND)
    within = framed >= 0
    for step in range(6):
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        laid = cv2.warpAffine(framed, here[:2], (width, height), flags=flags, borderValue=_BEYOND)
        shown = np.asarray(laid, np.float32)
        known = within & (shown >= 0)
        if np.count_nonzero(known) < 0.3 * known.size:
            return None
        miss = shown - gain * key - offset
        if step == 0:
            offset = float(np.median(miss[known][::2]))
            miss -= offset
        # Grey levels; a deviation without any noise.
        spread = max(1.4826 * float(np.median(np.abs(miss[known][::2]))), 0.3)
        bound = max(3 * spread, loose / 2**step)
        weight = share * known / (1 + (miss / bound) ** 2) ** 2
        heavy = steep * weight.ravel()
        normal = heavy @ steep.T + spread**2 * prior
        delta = np.linalg.solve(normal, heavy @ miss.ravel())
        step_map = _similarity(1 + delta[2], delta[3], delta[0], delta[1])
        here = here @ middle @ np.linalg.inv(step_map) @ np.linalg.inv(middle)
        gain, offset = float(gain + delta[4]), float(offset + delta[5])
        # Pixels of a level of a step that is no longer worth another.
        if np.hypot(delta[0], delta[1]) + np.hypot(delta[2], delta[3]) * width / 2 < 0.01:
            break
    if loose:  # a finer level says how sure the map is
        return Aligned(here, np.inf)
    miss = miss - np.tensordot(delta.astype(np.float32), slopes, 1)
    seen = _slopes(np.where(known, (shown - offset) / gain, key).astype(np.float32))
    # Noise has slopes, too, but not the same in both views.
    told = heavy @ seen.reshape(6, -1).T
    value, direction = np.linalg.eigh((told + told.T) / 2)
    information = (direction * np.maximum(value, 0)) @ direction.T / spread**2 + prior
    telling = _by_blocks(weight * (seen[0] * slopes[0] + seen[1] * slopes[1]))
    # Blocks of mere noise tell as much for the map as against it.
    # Share of the blocks that must tell: what few of them tell may move on its own.
    if telling.mean() <= np.sqrt(0.1 * (telling**2).mean()):
        return Aligned(here, np.inf)
    return Aligned(here, _error(slopes, weight * miss / spread**2, information))


def _by_blocks(values: Floats32) -> Floats32:
    """The means (12, 12) of an image over its blocks."""
    return np.asarray(cv2.resize(values, (PARTS, PARTS), interpolation=cv2.INTER_AREA), np.float32)


def _slopes(view: Floats32) -> Floats32:
    """By what each pixel changes with shift, turn, scale about the middle, and light, (6, h, w)."""
    height, width = view.shape
    u = np.arange(width, dtype=np.float32) - np.float32((width - 1) / 2)
    v = (np.arange(height, dtype=np.float32) - np.float32((height - 1) / 2))[:, None]
    gu, gv = (0.5 * cv2.Sobel(view, cv2.CV_32F, *by, ksize=1) for by in ((1, 0), (0, 1)))
    return np.stack([gu, gv, gu * u + gv * v, gv * u - gu * v, view, np.ones_like(view)])


def _error(slopes: Floats32, pull: Floats32, information: Floats) -> float:
    """Standard error of the places of a map, if errors within a block may be the same.

    `pull` (h, w) of each pixel; what the pixels do not tell is known by the guess only.
    """
    height, width = (side // PARTS for side in pull.shape)
    pulls = (slopes * pull)[:, : height * PARTS, : width * PARTS]
    means = np.array([_by_blocks(by) for by in pulls], float).reshape(6, -1)
    sums = height * width * means
    covariance = np.linalg.inv(information)
    blockwise = covariance @ (sums @ sums.T) @ covariance
    variance = np.maximum(np.diag(blockwise), np.diag(covariance))
    far = (pull.shape[0] ** 2 + pull.shape[1] ** 2 - 2) / 12  # mean square from the middle
    return float(np.sqrt((variance[0] + variance[1] + far * (variance[2] + variance[3])) / 2))


class CameraMotion(NamedTuple):
    """Where each frame lies in the first one.

    `maps` (n, 3, 3) take homogeneous pixels of a frame to pixels of the first; `errors` (n,) are
    the standard errors of the places that they give, in pixels: infinite where nothing is known.
    """

    maps: Floats
    errors: Floats


def at_rest(n: int) -> CameraMotion:
    """The motion of a camera that stands still."""
    return CameraMotion(np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros(n))


def rescaled(maps: Floats, factor: float) -> Floats:
    """Maps (n, 3, 3) of pixels of an image as maps of those of the image reduced by a factor."""
    larger = np.array([[factor, 0, (factor - 1) / 2], [0, factor, (factor - 1) / 2], [0, 0, 1]])
    found = np.linalg.inv(larger) @ maps @ larger
    return np.asarray(found / found[:, 2:, 2:], float)


def stands_still(samples: Iterable[Image]) -> bool | None:
    """Do pairs of reduced samples, successive or far apart, show that the camera does not move?

    None if many pairs are too plain or noisy to tell. Any motion is seen by two of the pairs, and a
    tremble that is lost in the noise of each of them by its usual size.
    """
    looks = [Look(sample) for sample in samples]
    middle = looks[len(looks) // 2]
    pairs = [(looks[0], middle), (middle, looks[-1]), *pairwise(looks)]
    found = np.array([_moved(before, after) for before, after in pairs])
    told = found[np.isfinite(found)]
    if np.sum(told > _PLAINLY) > 1:
        return False
    # The usual one is 1 to 3 of a camera at rest, more than 1 by compression. What few pairs tell,
    # before a plain wall, may be the target's motion.
    return bool(np.median(told) < 3.5) if len(told) > 0.75 * len(found) else None


def _moved(before: Look, after: Look) -> float:
    """By how many of its standard errors a view lies elsewhere, none if most corners stay.

    NaN if that cannot be told.
    """
    rest = np.eye(3)
    a, b = before.follow(after, rest)
    found = _Key(before, rest, 0.0).locate(after, rest, (a, b))
    if found is None:
        return np.nan
    stay, share = (
        np.sum(np.linalg.norm(carry(here, a) - b, axis=1) < _STILL) for here in (rest, found.map)
    )
    moved = displacement(found.map[None], before.grey.shape[::-1])[0]
    stays = stay > max(0.7 * share, 0.1 * len(a))  # of corners of mere noise few do
    errors = moved / found.error if moved > _STILL and not stays else 0.0
    return errors if errors > _PLAINLY or 2 * found.error < LOOSE else np.nan


def displacement(maps: Floats, size: Sequence[int]) -> Floats:
    """Pixels by which maps (n, 3, 3) move an image (width, height), rms of its parts."""
    grid = np.array([[u, v] for u in (0.2, 0.5, 0.8) for v in (0.2, 0.5, 0.8)])
    points = grid * np.array(size)
    return np.array([np.sqrt(np.mean(np.sum((carry(h, points) - points) ** 2, 1))) for h in maps])


def _by_corners(a: Floats, b: Floats) -> tuple[Aligned | None, bool]:
    """Where a frame lies in another, by where its corners are in both.

    And whether they need no other witness: they are many, and tell the map exactly.
    """
    if len(a) < 20:  # fewer are not worth a look
        return None, False
    found, obey = cv2.estimateAffinePartial2D(a, b, ransacReprojThreshold=2 * LOOSE)
    # Of the corners of mere noise, a share of 0.15 to 0.24 agree.
    if found is None or obey.sum() < max(20, 0.25 * len(a)):
        return None, False
    best, good = np.vstack([found, [0, 0, 1]]), obey[:, 0] > 0
    if good.sum() >= _MANY:
        full, obey = cv2.findHomography(a, b, cv2.RANSAC, LOOSE)
        if full is not None and obey.sum() >= max(_MANY, 0.8 * good.sum()):
            best, good = np.asarray(full, float), obey[:, 0] > 0
    miss = np.linalg.norm(carry(best, a[good]) - b[good], axis=1)
    error = float(np.sqrt(np.mean(miss**2) * 4 / len(miss)))
    # Reduced pixels: corners that tell a map no better need another witness, too.
    return Aligned(best, error), len(miss) >= _MANY and error < 0.05


class _Key(NamedTuple):
    """A frame in which others are located, and where it lies in the first one."""

    look: Look
    base: Floats
    error: float

    def locate(
        self, look: Look, last: Floats, corners: tuple[Floats, Floats] | None = None
    ) -> Aligned | None:
        """Where it lies in another, from a map that is about right.

        By corners, which may have been followed already; if these are few, perhaps by pixels.
        """
        told, alone = _by_corners(*(corners or self.look.follow(look, last)))
        if alone:
            return told
        direct = align(self.look, look, last)
        # A map that is known to three reduced pixels, no better, is not known.
        known = [one for one in (told, direct) if one is not None and one.error < 3.0]
        least = min((one.error for one in known), default=0.0)
        # Times the error of another map that is about as good; then the smaller step is taken.
        good = [one for one in known if one.error <= 3.0 * least]
        size, back = self.look.grey.shape[::-1], np.linalg.inv(last)
        return min(
            good, key=lambda one: displacement((one.map @ back)[None], size)[0], default=None
        )

    def shared(self, here: Floats) -> float:
        """Share of it that is in the view of the frame in which it lies here."""
        size = np.array(self.look.grey.shape[::-1])
        u, v = np.meshgrid(*np.outer(size, np.linspace(0, 1, 9)))
        places = carry(here, np.column_stack([u.ravel(), v.ravel()]))
        return float(((places >= 0) & (places < size)).all(axis=1).mean())


def steadied(frames: Iterable[Image], factor: int) -> CameraMotion:
    """The motion of a camera, by frames reduced by a factor, one after the other."""
    looks = map(Look, frames)
    last = np.eye(3)
    key = before = _Key(next(looks), last, 0.0)
    places = [(key.base, key.error)]
    for look in looks:
        if (located := key.locate(look, last)) is None:
            # Little in common with the key frame: more with the last one known.
            key, last = before, np.eye(3)
            located = key.locate(look, last)
        if located is None:
            places.append((places[-1][0], np.inf))
            continue
        last = located.map
        error = float(np.hypot(key.error, located.error))
        before = _Key(look, key.base @ np.linalg.inv(last), error)
        places.append((before.base, error))
        # Share of a key frame that is left, below which there must be a new one. Each adds its
        # error to all that follow, so late: a little above the 0.3 that `align` needs.
        if key.shared(last) < 0.4:
            key, last = before, np.eye(3)
    maps, errors = map(np.array, zip(*places, strict=True))
    return CameraMotion(rescaled(maps, 1 / factor), factor * errors)


def explains(samples: Image, maps: Floats) -> bool:
    """Are reduced frames likelier with a camera that moves by these maps than with one at rest?

    And than with one that moves the other way: its maps smooth the noise as much, so that no more
    than the motion tells the two apart. Frames count by how far they are from the usual one: where
    that is the same, so are all plates.
    """
    rest, back = np.broadcast_to(np.eye(3), maps.shape), np.asarray(np.linalg.inv(maps), float)
    size = samples.shape[2:0:-1]
    apart = np.array([displacement(np.linalg.inv(usual) @ maps, size) for usual in maps])
    weights = apart[apart.sum(axis=1).argmin()]
    ways = (_missed(samples, Plate(samples, at), at) for at in (maps, rest, back))
    gains = [(_gain(moved, r), _gain(moved, b)) for moved, r, b in zip(*ways, strict=True)]
    over_rest, over_return = weights @ np.array(gains)
    return bool(over_rest > 0 and over_return > _CHANCE * weights.sum())


def rests(samples: Image) -> bool:
    """Are reduced frames likelier with a camera at rest than with one a pixel off along an axis?

    Not so if it moves, nor if there is too little to see. No camera that is held moves along one
    axis only.
    """
    rest = np.broadcast_to(np.eye(3), (len(samples), 3, 3))
    plate = Plate(samples, rest)
    here, *beside = (
        _missed(samples, plate, rest + np.array([[0, 0, u], [0, 0, v], [0, 0, 0]]))
        for u, v in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))
    )
    gains = ([_gain(one, other) for other in off] for one, *off in zip(here, *beside, strict=True))
    least = [max(min(gain[:2]), min(gain[2:])) for gain in gains]
    # Share of the frames that say so, if the camera is at rest.
    return bool(np.mean(np.array(least) > _CHANCE) >= 0.9)


def _missed(samples: Image, plate: Plate, maps: Floats) -> Iterator[Floats32]:
    """Grey levels by which the parts (12, 12) of each sample differ from the plate, NaN if unknown.

    By these maps the samples lie in it.
    """
    for sample, here in zip(samples, maps, strict=True):
        ground, known = plate.seen_from(here)
        change = changes(sample, ground, light(sample, ground, known))
        # Reduced pixels: noise is not what frames are compared by.
        smooth = cv2.GaussianBlur(change, (0, 0), 2.0)
        # Grey levels that a pixel can differ by: a few that differ by more say no more.
        apart = np.minimum(lengths(np.asarray(smooth, np.float32)), 20.0)
        # Around what is not known smoothing is wrong.
        use = cv2.erode(known.astype(np.uint8), np.ones((9, 9))).astype(np.float32)
        parts, share = _by_blocks(apart * use), _by_blocks(use)
        yield np.where(share > 0.5, parts / np.maximum(share, 0.5), np.nan).astype(np.float32)


def _gain(one: Floats32, other: Floats32) -> float:
    """How much likelier one explanation of a frame is than another, by what both leave.

    The logarithm of the ratio of their likelihoods, up to a factor, where each part has a noise of
    its own: a mean that leaves aside the parts that tell most for either.
    """
    both = np.isfinite(one) & np.isfinite(other)
    if not both.any():
        return 0.0
    # Grey levels; a difference without any noise.
    ratios = np.sort(np.log((other[both] + 0.1) / (one[both] + 0.1)))
    aside = int(0.2 * len(ratios))  # the share of the parts that what moves on its own may be in
    return float(ratios[aside : len(ratios) - aside].mean())


def camera_motion(
    frames: Reel, small: Image, sampled: Ints
) -> tuple[CameraMotion, tuple[str, ...]]:
    """The camera's motion, and doubts of it.

    If the sampled frames do not tell that the camera is at rest, all frames are asked where they
    lie, one after the other. Maps that are known badly, or by which the frames fit together no
    better than at rest, only add their errors.
    """
    still = stands_still(small)
    if still is False:
        motion = steadied(frames, frames.factor)
        at = np.minimum(sampled, len(motion.maps) - 1)
        known = np.isfinite(motion.errors[at])
        maps = rescaled(motion.maps[at[known]], frames.factor)
        if np.median(motion.errors[1:]) < frames.factor * LOOSE and explains(small[known], maps):
            return motion, ()
    plain = ("the background is too plain to tell whether the camera moves: if so, its motion is "
             "part of the track")  # fmt: skip
    return at_rest(frames.info.frames), () if still or rests(small) else (plain,)
