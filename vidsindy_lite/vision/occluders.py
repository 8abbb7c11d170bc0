"""What stands before the target: the places that it should cover and never does.

A view of a part of the target looks like one of a smaller target beside its place. But views are
many, and what hides it stays where it is: where views of the target reach whose middles are near,
and yet no view ever shows it, it is hidden, by something before it or by a ground of its own
colour. Views that reach there are of parts.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from scipy.ndimage import median_filter

from ..arrays import Bools, Floats, Image
from .pixels import hull

_CELLS = 32  # into which the side of a target is cut
_REACH = 1.5  # sides of the target from its middle that its usual outline may have
_TOUCHING = np.ones((7, 7), np.uint8)  # cells around a place that is missed: its edge is there


def hidden(
    outlines: Sequence[Floats], centres: Floats, areas: Floats, alone: Bools | None = None
) -> Bools:
    """Which views (n,) reach where the target is never seen, though others of it reach there, too.

    Parameters
    ----------
    outlines : sequence of ndarray, shape (k, 2)
        Convex outlines of the views, in pixels of the first frame.
    centres : ndarray, shape (n, 2)
        Their middles.
    areas : ndarray, shape (n,)
    alone : ndarray, shape (n,), optional
        Which views show nothing but the target: if these are most of them, only they say what the
        target never covers.
    """
    telling = np.ones(len(centres), bool) if alone is None or alone.mean() <= 0.5 else alone
    sides = np.sqrt(np.maximum(areas, 1))
    points = np.concatenate(outlines)
    low = points.min(axis=0) - _REACH * sides.max()
    extent = np.ptp(points, axis=0) + 2 * _REACH * sides.max()
    # Cells of the longer side of a chart.
    cell = max(float(np.median(sides)) / _CELLS, float(extent.max()) / 2000, 1.0)
    shape = np.ceil(extent[::-1] / cell).astype(int) + 1
    chart, missed = np.zeros(shape, np.uint8), np.zeros(shape, np.uint16)
    for outline in outlines:
        patch, window = _drawn((outline - low) / cell)
        chart[window] |= patch
    unseen = np.asarray(cv2.dilate(chart, np.ones((3, 3), np.uint8)) == 0)
    # Views around one that say how large it would be if it were whole.
    whole = np.maximum(sides, median_filter(sides, 19))
    usual = whole[:, None, None] * _usual(outlines, centres, sides)
    for centre, reach in zip(centres[telling], usual[telling], strict=True):
        # Of that outline, within which a target is to be seen.
        patch, window = _drawn((centre + 0.9 * reach - low) / cell)
        missed[window] += patch & unseen[window]
    # Views that miss the target in a place where it is hidden.
    never = np.asarray(cv2.dilate((missed >= 2).astype(np.uint8), _TOUCHING), np.uint8)
    found = np.zeros(len(centres), bool)
    for i, (outline, centre, reach) in enumerate(zip(outlines, centres, usual, strict=True)):
        for reached in (outline, centre + reach):
            patch, window = _drawn((reached - low) / cell)
            found[i] |= bool((patch & never[window]).any())
    return found


def _usual(outlines: Sequence[Floats], centres: Floats, sides: Floats) -> Floats:
    """The outline (k, 2) within which most views show the target, around its middle, of side 1."""
    side = int(2 * _REACH * _CELLS) + 1
    count = np.zeros((side, side), np.uint32)
    for outline, centre, size in zip(outlines, centres, sides, strict=True):
        around = np.clip((outline - centre) / size, -_REACH, _REACH)
        patch, window = _drawn((around + _REACH) * _CELLS)
        count[window] += patch
    # Share of the views that show a place of the usual outline.
    usual = hull(count >= min(0.75 * len(outlines), count.max()))
    return np.asarray(usual / _CELLS - _REACH, float)


def _drawn(outline: Floats) -> tuple[Image, tuple[slice, slice]]:
    """A convex outline in cells as a patch that is 1 within it, and where the patch lies."""
    left, top = np.floor(outline.min(axis=0)).astype(int)
    right, bottom = np.ceil(outline.max(axis=0)).astype(int) + 1
    patch = np.zeros((bottom - top, right - left), np.uint8)
    cv2.fillConvexPoly(patch, np.rint(16 * (outline - [left, top])).astype(np.int32), 1, shift=4)
    return patch, np.s_[top:bottom, left:right]
