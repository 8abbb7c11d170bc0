"""The motion of a film's camera, asked of several witnesses until one is sure."""

from collections.abc import Callable
from functools import partial

import numpy as np

from ..arrays import Image, Ints
from .reducing import ReducedFrames, reduced
from .resting import explains, rests
from .steadying import (
    PLAINLY,
    CameraMotion,
    Steadying,
    at_rest,
    corners_tell,
    displacement,
    stands_still,
)
from .trembling import trembling

LOOSE = 1.0  # pixels (reduced ones if it is to be used at all) to which a camera's motion is known


def camera_motion(frames: ReducedFrames, small: Image, sampled: Ints) -> tuple[CameraMotion, bool]:
    """The camera's motion, and whether that is sure.

    If the sampled frames do not tell that the camera is at rest, all frames are asked where they
    lie: one after the other, and all on what they show together, first where corners are few. If
    that is not exact, the other is asked, too.
    """
    still = stands_still(small)
    ways: list[Callable[[], CameraMotion | None]] = []
    if still is not True:
        ways = [partial(trembling, frames, small)]
    if still is False:
        ways += [partial(_steadied, frames, small, sampled)]
        if corners_tell(small):
            ways.reverse()
    found: list[CameraMotion] = []
    for way in ways:
        if (motion := way()) is not None:
            found.append(motion)
            if _usual_error(motion) < LOOSE:
                break
    if found:
        return min(found, key=_usual_error), True
    return at_rest(frames.reel.info.frames), still is True or rests(small)


def _usual_error(motion: CameraMotion) -> float:
    return float(np.median(motion.errors))


def _steadied(frames: ReducedFrames, small: Image, sampled: Ints) -> CameraMotion | None:
    """Frames laid on each other, one after the other.

    None if these maps say no more than their errors: then they only add these. None, too, if the
    frames fit together worse by them than at rest.
    """
    steadying = Steadying(frames.factor)
    for frame in frames:
        steadying.add(frame)
    motion = steadying.motion()
    if not _plainly(motion, frames.reel.info.size, frames.factor):
        return None
    at = np.minimum(sampled, len(motion.maps) - 1)
    known = np.isfinite(motion.errors[at])
    return motion if explains(small, reduced(motion.maps[at], frames.factor), known) else None


def _plainly(motion: CameraMotion, size: tuple[int, int], factor: int) -> bool:
    """Does a camera move by far more than the errors of its maps, and are these small?"""
    told = motion.errors[1:] < factor * LOOSE
    # Share of the frames that tell of the camera's motion, if it is known.
    if told.mean() < 0.5:
        return False
    sure = displacement(motion.maps[1:], size) / np.maximum(motion.errors[1:], 1e-3)
    # Of the frames, the last of which show it if the camera moves at all.
    return bool(np.quantile(sure, 0.95) > PLAINLY)
