"""What the frames say of a camera: whether its motion explains them better than rest does.

A motion can be wrong with small errors: before a smooth wall nothing but the target has corners,
and then the target's motion is taken for the camera's. But the plate that it makes, and the one of
a camera at rest, each say what all frames look like in all of their parts, and what moves on its
own is in few of these.
"""

import cv2
import numpy as np

from ..arrays import Bools, Floats, Floats32, Image
from .background import light
from .pixels import changes, lengths
from .plate import Plate
from .steadying import displacement

_PARTS = 12  # into which each side of an image is cut
_FAINT = 0.1  # grey levels; a difference without any noise
_RIM = np.ones((9, 9), np.uint8)  # around what is not known, where smoothing is wrong


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
        _gain(_misses(sample, *_seen(plates[0], here)), _misses(sample, *_seen(plates[1], there)))
        for sample, here, there in zip(samples, maps, rest, strict=True)
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


def _seen(plate: Plate, here: Floats) -> tuple[Image, Bools]:
    """A plate as a whole frame shows it, and where it is known."""
    return plate.seen_from(here, np.zeros(2), (int(plate.size[0]), int(plate.size[1])))


def _misses(frame: Image, ground: Image, known: Bools) -> Floats32:
    """Grey levels by which the parts (12, 12) of a frame differ from the ground; NaN if unknown."""
    change = changes(frame, ground, light(frame, ground, known))
    # Reduced pixels: noise is not what frames are compared by.
    smooth = cv2.GaussianBlur(change, (0, 0), 2.0)
    # Grey levels that a pixel can differ by: a few that differ by more say no more.
    apart = np.minimum(lengths(np.asarray(smooth, np.float32)), 20.0)
    use = cv2.erode(known.astype(np.uint8), _RIM).astype(np.float32)
    parts, share = (
        cv2.resize(x, (_PARTS, _PARTS), interpolation=cv2.INTER_AREA) for x in (apart * use, use)
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
    ratios = np.sort(np.log((other[both] + _FAINT) / (one[both] + _FAINT)))
    aside = int(0.2 * len(ratios))  # the share of the parts that what moves on its own may be in
    return float(ratios[aside : len(ratios) - aside].mean())
