"""Targets of several colours: all that is in one piece with what has the target's colour.

A ball of two halves is followed by the colour of one of them. All that differs from the background
in one piece shows the ball, but perhaps a shadow or a hand, too: only one compact thing counts.
"""

from typing import NamedTuple

import cv2
import numpy as np

from ..arrays import Bools, Floats32
from .pixels import hull

_OTHER = 0.15  # share of the whole that has another colour, if there are several
_SOLID = 0.85  # share of its convex outline that a compact thing fills
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
