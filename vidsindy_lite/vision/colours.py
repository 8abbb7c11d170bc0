"""Targets of several colours: what turns with the target is a part of it.

A ball of two halves is followed by the colour of one of them. All that differs from the background
in one piece shows the ball, but perhaps a shadow or a hand, too. A shadow stays on its side of the
target; where the colour goes round the middle of the whole, and the whole is one compact thing that
keeps its size, that is the target.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np
from scipy import ndimage

from ..arrays import Bools, Floats32
from .pixels import hull

if TYPE_CHECKING:
    from .refining import View

_PART = 0.9  # share of the whole that one colour covers at most, if there are several
_TURNS = 0.1  # of its radius, by which the middle of one colour goes about that of the whole
_OTHER = 0.15  # share of the whole that has another colour, if there are several
_SOLID = 0.85  # share of its convex outline that a compact thing fills
_AROUND, _SIZE = 9, 1.5  # views around one, whose areas differ from it by a factor at most
_MOSTLY = 0.8  # share of the views that must show it whole
_SHADOW = 0.35, 0.95, 0.12  # light that is left in a shadow; by how much that differs by colour
_CORE = np.ones((5, 5), np.uint8)


class Whole(NamedTuple):
    """All that differs from the background in one piece with what has the target's colour.

    `label` (h, w) is where; `colours` (h, w, 3) are those inside it, continued to its edge; `plain`
    is whether there is hardly another colour.
    """

    label: Bools
    colours: Floats32
    plain: bool


def shadowed(now: Floats32, ground: Floats32) -> Bools:
    """Where (h, w) the same surface is seen in less light: darker by the same in all colours."""
    ratio = cv2.split((now + 4) / (ground + 4))
    mean = sum(ratio) / 3
    apart = np.maximum.reduce(ratio) - np.minimum.reduce(ratio)
    least, most, equal = _SHADOW
    return np.asarray((mean > least) & (mean < most) & (apart < equal * mean))


def whole(
    own: Bools, differs: Bools, other: Bools, now: Floats32, ground: Floats32
) -> Whole | None:
    """The whole of which `own` is a part, None if it is not one compact thing.

    Not all that `differs` has an `other` colour: what lies between ground and target is its blur.
    """
    shadow = shadowed(now, ground)
    mask = (own | (differs & ~shadow)).astype(np.uint8)
    _, labels = cv2.connectedComponents(np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, _CORE)))
    inside = np.bincount(labels[own], minlength=2)
    label = labels == 1 + int(inside[1:].argmax()) if inside[1:].any() else own
    core = cv2.erode(label.astype(np.uint8), _CORE) > 0
    outline = cv2.fillConvexPoly(np.zeros(label.shape, np.uint8), hull(label), 1)
    if not core.any() or label.sum() < _SOLID * outline.sum():
        return None
    _, nearest = cv2.distanceTransformWithLabels(
        (~core).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    colours = np.zeros((1 + np.count_nonzero(core), 3), np.float32)
    colours[nearest[core]] = now[core]
    plain = (label & other & ~shadow).sum() < _OTHER * label.sum()
    return Whole(label, colours[nearest], bool(plain))


def entire(views: Sequence["View | None"]) -> tuple[list["View | None"], tuple[str, ...]]:
    """Views of the whole target, in place of those of one of its colours, and doubts.

    Parameters
    ----------
    views : sequence of View or None
        By the target's colour, one a frame.
    """
    parts = [one if one is not None and one.area > 0 else None for one in views]
    both = [(one, one.whole) for one in views if one is not None and one.whole is not None]
    areas = np.array([[one.area, all_.area] for one, all_ in both]).reshape(-1, 2)
    offset = np.array([one.centroid - all_.centroid for one, all_ in both]).reshape(-1, 2)
    offset = (offset / np.sqrt(areas[:, 1:] / np.pi))[areas[:, 0] > 0]
    count = sum(one is not None for one in views)
    if not len(offset) or len(both) < _MOSTLY * count:
        return parts, ()
    turns = np.linalg.norm(offset - np.median(offset, axis=0), axis=1).mean() > _TURNS
    if not turns or np.median(areas[:, 0] / areas[:, 1]) > _PART:
        return parts, ()
    size = np.log(areas[:, 1])
    keeps = np.abs(size - ndimage.median_filter(size, _AROUND)) < np.log(_SIZE)
    if keeps.mean() > _MOSTLY:
        return [one and (one.whole or one) for one in views], ()
    return parts, ("the target has several colours, or touches other things: perhaps only a part "
                   "of it is followed",)  # fmt: skip
