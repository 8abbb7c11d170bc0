"""What is asked of many pixels, where the plain way is slow."""

import cv2
import numpy as np

from ..arrays import Bools, Floats32, Image, Ints

_SATURATED = 250  # 255, but for compression


def dot(a: Floats32, b: Floats32) -> Floats32:
    """Scalar product of the colours of each pixel."""
    return (a * b) @ np.ones(3, np.float32)


def lengths(a: Floats32) -> Floats32:
    """Root of the sum of the squares of the colours of each pixel."""
    return np.sqrt(dot(a, a))


def relit(image: Image, factor: Floats32) -> Floats32:
    """An image as it is where each colour is brighter by a factor (3,)."""
    rows = image.reshape(len(image), -1) * np.tile(factor, image.shape[1])
    return np.asarray(rows.reshape(image.shape), np.float32)


def changes(frame: Image, ground: Image, factor: Floats32) -> Floats32:
    """By what the colours of a frame differ from a ground that is brighter by a factor (3,).

    What is saturated is at least so bright: what is brighter than that is no difference.
    """
    then = relit(ground, factor)
    if factor.min() < 1:
        np.maximum(then, frame, out=then, where=ground >= _SATURATED)
    return np.asarray(frame - (np.minimum(then, 255) if factor.max() > 1 else then), np.float32)


def hull(mask: Bools) -> Ints:
    """Convex outline (k, 2) of a mask: that of the first and the last pixels of its rows."""
    rows = np.flatnonzero(mask.any(axis=1))
    first = mask[rows].argmax(axis=1)
    last = mask.shape[1] - 1 - mask[rows, ::-1].argmax(axis=1)
    ends = np.column_stack([np.concatenate([first, last]), np.concatenate([rows, rows])])
    return np.asarray(cv2.convexHull(ends.astype(np.int32))[:, 0], int)
