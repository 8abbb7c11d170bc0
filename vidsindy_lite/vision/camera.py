"""The motion of a film's camera, asked of several witnesses until one is sure.

A motion can be wrong with small errors: before a smooth wall nothing but the target has corners,
and then the target's motion is taken for the camera's. But the plate that it makes, and the one of
a camera at rest, each say what all frames look like in all of their parts, and what moves on its
own is in few of these: so a motion is taken only if it explains the frames better than rest does.

Two frames of a sky share little but noise, and corners of noise tell no motion. But the median of
many frames of a camera that trembles is that sky nearly without noise, only a little blurred, and
each frame laid on it (`steadying`) tells its own small motion. Whether that is one is for the
halves of the image to say: if the camera moves, both move alike; noise, a codec's errors and what
moves on its own are not the same in both. By how much the halves differ also says how exact the
motion is: errors of a codec and of the plate itself reach over many pixels, which no pixel's misfit
tells. What a codec of few bits leaves where it was, instead of moving it along, both tell alike,
though.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from ..arrays import Bools, Floats, Floats32, Image, Ints
from .background import changes, lengths, light
from .plate import Plate
from .steadying import (
    PARTS,
    PLAINLY,
    Aligned,
    CameraMotion,
    Ground,
    align,
    at_rest,
    carry,
    displacement,
    grounds,
    pyramid,
    rescaled,
    stands_still,
    steadied,
)
from .video import Reel

LOOSE = 1.0  # pixels (reduced ones if it is to be used at all) to which a camera's motion is known


def explains(samples: Image, maps: Floats, known: Bools) -> bool:
    """Are reduced frames likelier with a camera that moves by these maps than with one at rest?

    Frames count by how far they are from the usual one: where that is the same, so are both plates.
    """
    rest = np.broadcast_to(np.eye(3), maps.shape)
    samples, maps, rest = samples[known], maps[known], rest[known]
    size = samples.shape[2:0:-1]
    apart = np.array([displacement(np.linalg.inv(usual) @ maps, size) for usual in maps])
    weights = apart[apart.sum(axis=1).argmin()]
    all_known = np.ones(len(maps), bool)
    plates = Plate(samples, maps, all_known), Plate(samples, rest, all_known)
    gains = [
        _gain(
            *(_misses(sample, *plate.seen_from(at)) for plate, at in zip(plates, both, strict=True))
        )
        for sample, *both in zip(samples, maps, rest, strict=True)
    ]
    # Of a gain: the noise of a median of 21 frames adds that, and maps smooth it.
    return bool(weights @ gains > 0.04 * weights.sum())


def rests(samples: Image) -> bool:
    """Are reduced frames likelier with a camera at rest than with one a pixel off, to any side?

    Not so if it moves, nor if there is too little to see.
    """
    rest = np.broadcast_to(np.eye(3), (len(samples), 3, 3))
    plate = Plate(samples, rest, np.ones(len(samples), bool)).image
    sides = [np.array([[1, 0, u], [0, 1, v]], float) for u, v in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    size, everywhere = plate.shape[1::-1], np.ones(plate.shape[:2], bool)
    beside = [cv2.warpAffine(plate, side, size, borderMode=cv2.BORDER_REPLICATE) for side in sides]
    least = []
    for sample in samples:
        here = _misses(sample, plate, everywhere)
        off = [_misses(sample, np.asarray(one, np.uint8), everywhere) for one in beside]
        least.append(min(_gain(here, there) for there in off))
    # Share of the frames that say so, if the camera is at rest.
    return bool(np.mean(np.array(least) > 0) >= 0.9)


def _misses(frame: Image, ground: Image, known: Bools) -> Floats32:
    """Grey levels by which the parts (12, 12) of a frame differ from the ground; NaN if unknown."""
    change = changes(frame, ground, light(frame, ground, known))
    # Reduced pixels: noise is not what frames are compared by.
    smooth = cv2.GaussianBlur(change, (0, 0), 2.0)
    # Grey levels that a pixel can differ by: a few that differ by more say no more.
    apart = np.minimum(lengths(np.asarray(smooth, np.float32)), 20.0)
    # Around what is not known smoothing is wrong.
    use = cv2.erode(known.astype(np.uint8), np.ones((9, 9))).astype(np.float32)
    parts, share = (
        cv2.resize(x, (PARTS, PARTS), interpolation=cv2.INTER_AREA) for x in (apart * use, use)
    )
    return np.where(share > 0.5, parts / np.maximum(share, 0.5), np.nan).astype(np.float32)


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


def trembling(frames: Reel, samples: Image) -> CameraMotion | None:
    """The motion of a camera that trembles, None if that is not sure; `samples` are reduced."""
    views = [pyramid(sample) for sample in samples]
    maps = np.tile(np.eye(3), (len(samples), 1, 1))
    # Each of the samples as they were laid on the one before.
    for _ in range(2):
        ground = _ground(Plate(samples, maps, np.ones(len(samples), bool)))
        laid = [_laid(ground, view, here) for view, here in zip(views, maps, strict=True)]
        # Reduced pixels to which a motion must be known.
        if np.median([one.error for one in laid]) > 0.5:
            return None
        maps = _maps(laid)
        # Reduced pixels: what moves farther blurs the first plate too much.
        if displacement(maps, samples.shape[2:0:-1]).max() > 8.0:
            return None
    alike, error = _halves(ground, views, maps)
    # Correlation of what two halves of an image tell, if both move alike.
    if alike < 0.5:
        return None
    usual = np.sqrt(np.mean([one.error**2 for one in laid if np.isfinite(one.error)]))
    return _motion(ground, frames, max(error / usual, 1.0))


def _ground(plate: Plate) -> list[Ground]:
    """A plate as the first frame shows it, to lay others on."""
    image, known = plate.seen_from(np.eye(3))
    return [_limited(level, known) for level in grounds(pyramid(image))]


def _limited(level: Ground, where: Bools) -> Ground:
    """A level that tells nothing outside some part (h, w) of the image."""
    size = level.grey.shape[1::-1]
    share = cv2.resize(where.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    inner = cv2.erode(np.asarray(share > 0.99, np.uint8), np.ones((5, 5))) > 0
    return level._replace(share=level.share * inner)


def _laid(ground: list[Ground], view: list[Floats32], here: Floats) -> Aligned:
    """The map of the ground to a view, from one the other way round that is about right."""
    back = np.asarray(np.linalg.inv(here), float)
    return align(ground, view, back) or Aligned(back, np.inf)


def _maps(laid: Sequence[Aligned]) -> Floats:
    """Where views lie on the ground, (n, 3, 3)."""
    return np.asarray(np.linalg.inv([one.map for one in laid]), float)


def _halves(
    ground: list[Ground], views: Sequence[list[Floats32]], maps: Floats
) -> tuple[float, float]:
    """The correlation of the motions that two halves of the image tell, and the error of both.

    A half are two quarters that touch in the middle, which tell all of a motion, and what moves on
    its own is in one half at a time. The error is that of the places of their mean, rms, per axis.
    """
    height, width = ground[0].grey.shape
    left, upper = np.arange(width) < width / 2, (np.arange(height) < height / 2)[:, None]
    size = 2 * np.array([width, height])
    grid = size * np.array([[u, v] for u in (0.2, 0.5, 0.8) for v in (0.2, 0.5, 0.8)])
    told = []
    for half in (left == upper, left != upper):
        part = [_limited(level, half) for level in ground]
        laid = [_laid(part, view, here) for view, here in zip(views, maps, strict=True)]
        ends = np.array([carry(one.map, grid).ravel() for one in laid])
        told.append(ends - np.median(ends, axis=0))
    one, other = told
    alike = (one * other).sum() / np.sqrt((one**2).sum() * (other**2).sum())
    return float(alike), float(np.sqrt(np.mean((one - other) ** 2)) / 2)


def _motion(ground: list[Ground], frames: Reel, larger: float) -> CameraMotion:
    """All frames laid on the ground, and so on the first; errors are `larger` than they tell."""
    laid = [_laid(ground, pyramid(frame), np.eye(3)) for frame in frames]
    maps, errors = _maps(laid), np.array([one.error for one in laid])
    sure = larger * np.hypot(errors, errors[0])
    sure[0] = 0.0
    return CameraMotion.of(np.linalg.inv(maps[0]) @ maps, sure, frames.factor)


def camera_motion(frames: Reel, small: Image, sampled: Ints) -> tuple[CameraMotion, bool]:
    """The camera's motion, and whether that is sure.

    If the sampled frames do not tell that the camera is at rest, all frames are asked where they
    lie: one after the other, and, if that is not exact, all on what they show together.
    """
    still = stands_still(small)
    if still is True:
        return at_rest(frames.info.frames), True
    motion = None if still is None else _followed(frames, small, sampled)
    if motion is None or np.median(motion.errors) >= LOOSE:
        found = [one for one in (motion, trembling(frames, small)) if one is not None]
        motion = min(found, key=lambda one: np.median(one.errors), default=None)
    return (at_rest(frames.info.frames), rests(small)) if motion is None else (motion, True)


def _followed(frames: Reel, small: Image, sampled: Ints) -> CameraMotion | None:
    """Frames laid on each other, one after the other.

    None if these maps say no more than their errors: then they only add these. None, too, if the
    frames fit together worse by them than at rest.
    """
    motion = steadied(frames, frames.factor)
    if not _plainly(motion, frames.info.size, frames.factor):
        return None
    at = np.minimum(sampled, len(motion.maps) - 1)
    known = np.isfinite(motion.errors[at])
    return motion if explains(small, rescaled(motion.maps[at], frames.factor), known) else None


def _plainly(motion: CameraMotion, size: tuple[int, int], factor: int) -> bool:
    """Does a camera move by far more than the errors of its maps, and are these small?"""
    told = motion.errors[1:] < factor * LOOSE
    # Share of the frames that tell of the camera's motion, if it is known.
    if told.mean() < 0.5:
        return False
    sure = displacement(motion.maps[1:], size) / np.maximum(motion.errors[1:], 1e-3)
    # Of the frames, the last of which show it if the camera moves at all.
    return bool(np.quantile(sure, 0.95) > PLAINLY)
