"""A camera that trembles before ground without corners, as told by all frames together.

Two frames of a sky share little but noise, and corners of noise tell no motion. But the median of
many frames of a camera that trembles is that sky nearly without noise, only a little blurred, and
each frame laid on it (`aligning`) tells its own small motion. Whether that is one is for the halves
of the image to say: if the camera moves, both move alike; noise, a codec's errors and what moves on
its own are not the same in both. By how much the halves differ also says how exact the motion is:
errors of a codec and of the plate itself reach over many pixels, which no pixel's misfit tells.
What a codec of few bits leaves where it was, instead of moving it along, both tell alike, though.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from ..arrays import Bools, Floats, Floats32, Image
from .aligning import Aligned, Ground, align, grounds, pyramid
from .plate import Plate
from .reducing import ReducedFrames, enlarged
from .steadying import CameraMotion, carry, displacement

_RIM = np.ones((5, 5), np.uint8)  # around what a plate does not show


def trembling(frames: ReducedFrames, samples: Image) -> CameraMotion | None:
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
    image, known = plate.seen_from(np.eye(3), np.zeros(2), (int(plate.size[0]), int(plate.size[1])))
    return [_limited(level, known) for level in grounds(pyramid(image))]


def _limited(level: Ground, where: Bools) -> Ground:
    """A level that tells nothing outside some part (h, w) of the image."""
    size = level.grey.shape[1::-1]
    share = cv2.resize(where.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    inner = cv2.erode(np.asarray(share > 0.99, np.uint8), _RIM) > 0
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


def _motion(ground: list[Ground], frames: ReducedFrames, larger: float) -> CameraMotion:
    """All frames laid on the ground, and so on the first; errors are `larger` than they tell."""
    laid = [_laid(ground, pyramid(frame), np.eye(3)) for frame in frames]
    maps, errors = _maps(laid), np.array([one.error for one in laid])
    whole = enlarged(frames.factor)
    steady = whole @ np.linalg.inv(maps[0]) @ maps @ np.linalg.inv(whole)
    sure = larger * np.hypot(errors, errors[0])
    sure[0] = 0.0
    return CameraMotion(steady / steady[:, 2:, 2:], frames.factor * sure)
