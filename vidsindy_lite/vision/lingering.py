"""The ground beneath what hardly leaves its place, where a median shows the thing itself.

A thing that turns or swings by less than its own width covers its middle in all frames. Against the
median of the frames only its rim differs, on two sides, and a part of its rim would be followed
in its stead. What is seen at the rim in some of the frames is ground, though, and continues the
surroundings, while the middle, which never changes, does not: with the ground put there, the whole
thing differs, as one compact blob.
"""

from typing import NamedTuple

import cv2
import numpy as np
from scipy import ndimage

from ..arrays import Bools, Floats, Floats32, Image, Ints
from .candidates import Plate
from .pixels import lengths

_SEEN = 2  # samples that must differ in a place
_MARGIN = 4  # pixels around a thing that show how its surroundings continue
_LEAST, _LARGEST = 12, 0.3  # pixels, and share of the image, of a thing with its rim
_COMPACT = 0.8  # views of one thing are at least, and by
_MORE = 0.15  # more than what differs at its rim
_BESIDE = 2  # samples of a pixel that show the ground at least


class Place(NamedTuple):
    """Where a thing lingers: left and top edge in reduced pixels of the first frame.

    `rim` (h, w) it covers in some of the frames, `middle` (h, w) in all.
    """

    corner: Ints
    rim: Bools
    middle: Bools

    def holds(self, point: Floats) -> bool:
        """Is a point of the first frame, in reduced pixels, where the thing lingers?"""
        u, v = np.rint(point).astype(int) - self.corner
        inside = 0 <= v < self.rim.shape[0] and 0 <= u < self.rim.shape[1]
        return bool(inside and (self.rim | self.middle)[v, u])


def lingering(
    plate: Plate, samples: Image, maps: Floats, known: Bools, tolerance: Floats32
) -> list[Place]:
    """Places of a plate of reduced frames in which the ground is better than what it shows."""
    views, shown = plate.samples(samples, maps, known, np.s_[:, :])
    differs = shown & (_apart(views, plate.image) > tolerance)
    rims = (differs.sum(axis=0) >= _SEEN).astype(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(rims)
    found = []
    for k in range(1, count):
        left, top, width, height, _ = stats[k]
        if width * height < _LEAST or width * height > _LARGEST * rims.size:
            continue
        low = np.maximum([left - _MARGIN, top - _MARGIN], 0)
        window = np.s_[low[1] : top + height + _MARGIN, low[0] : left + width + _MARGIN]
        whole = ndimage.binary_fill_holes(labels[window] == k)
        rim = (rims[window] > 0) & whole
        if not (whole & ~rim).any():
            continue
        place = Place(low, rim, whole & ~rim)
        then, seen, bound = plate.image[window], shown[:, *window], tolerance[window]
        ground = _ground(then, views[:, *window], place)
        near = ndimage.binary_dilation(whole, iterations=_MARGIN // 2) & seen
        before = _compactness(near & (_apart(views[:, *window], then) > bound))
        after = _compactness(near & (_apart(views[:, *window], ground) > bound))
        if after > max(_COMPACT, before + _MORE):
            found.append(place._replace(corner=low - plate.shift[:2, 2].astype(int)))
    return found


def uncover(
    plate: Plate, samples: Image, maps: Floats, known: Bools, places: list[Place], factor: int = 1
) -> None:
    """Put the ground into a plate, in place; `factor` by how much the places are reduced."""
    for place in places:
        corner = factor * place.corner + plate.shift[:2, 2].astype(int)
        rim, middle = (np.kron(x, np.ones((factor, factor), bool)) for x in place[1:])
        low = np.maximum(corner, 0)
        high = np.minimum(corner + rim.shape[::-1], plate.image.shape[1::-1])
        window = np.s_[low[1] : high[1], low[0] : high[0]]
        first, last = low - corner, high - corner
        shown = np.s_[first[1] : last[1], first[0] : last[0]]
        here = Place(low, rim[shown], middle[shown])
        views, _ = plate.samples(samples, maps, known, window)
        plate.image[window] = _ground(plate.image[window], views, here)


def _apart(views: Image, image: Image) -> Floats32:
    """Grey levels between images and another, pixel by pixel."""
    return lengths(views.astype(np.float32) - image)


def _compactness(masks: Bools) -> float:
    """How compact masks (m, h, w) are, from 0 to 1 for a disc each, the larger counting more."""
    v, u = np.mgrid[: masks.shape[1], : masks.shape[2]]
    area = np.maximum(masks.sum(axis=(1, 2)), 1)
    spread = sum(
        (masks * x**2).sum(axis=(1, 2)) - (masks * x).sum(axis=(1, 2)) ** 2 / area for x in (u, v)
    )
    spread = spread + area / 6  # the extent of the pixels themselves
    return float((area**3 / (2 * np.pi * spread)).sum() / area.sum())


def _ground(image: Image, views: Image, place: Place) -> Image:
    """What is beneath: as it is seen in some views of the rim, continued into the middle.

    A view of the rim is of the ground if it is more like the surroundings and less like the middle.
    """
    whole = (place.rim | place.middle).astype(np.uint8)
    outer = np.asarray(cv2.dilate(whole, np.ones((3, 3), np.uint8)))
    around = cv2.inpaint(image, outer, 3, cv2.INPAINT_TELEA)
    inner = cv2.inpaint(image, (~place.middle).astype(np.uint8), 3, cv2.INPAINT_TELEA)
    like = _apart(views, np.asarray(around)) - _apart(views, np.asarray(inner))
    first = np.argsort(like, axis=0)[:_BESIDE]
    seen = np.take_along_axis(views, first[..., None], axis=0).mean(axis=0)
    result = image.copy()
    result[place.rim] = np.rint(seen[place.rim])
    result = np.asarray(cv2.inpaint(result, place.middle.astype(np.uint8), 3, cv2.INPAINT_TELEA))
    return result.astype(np.uint8)
