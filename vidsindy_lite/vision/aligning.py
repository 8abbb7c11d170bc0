"""Two views of one scene laid on each other by all of their pixels, where corners are few.

Clouds, waves and plain walls have no corners, but all of their pixels together tell a motion to a
fraction of a pixel, and how well they tell it. A shift, turn and scale, a gain and an offset of the
light are fitted by least squares (Gauss and Newton; Lucas and Kanade 1981), from coarse to fine,
with weights that leave aside what moves on its own.
"""

from typing import NamedTuple

import cv2
import numpy as np

from ..arrays import Bools, Floats, Floats32, Image

_LEVELS = 4  # of the pyramid, the first of half the size
_ITERATIONS = 6
_CLOSE = 0.01  # pixels of a level of a step that is no longer worth another
_OUTSIDE = -1e4  # grey level of what a view does not show
_LOOSE, _FIRM = 40.0, 3.0  # grey levels, and deviations, from which on a pixel is left aside
_STEP, _TURN = 8.0, 0.03  # pixels and radians by which the guess may be wrong
_FAIR = 4.0  # times what a usual block tells, that one block may tell at most
_FAINT = 0.3  # grey levels; a deviation without any noise
_BOUND = 30.0  # grey levels of a difference
_BETTER = 0.97  # share of it that remains if a motion explains it; the noise falls a little, too
_EQUAL = 0.05  # grey levels of a difference that are none
_BLOCKS = 12  # into which each side is cut: errors within one may be the same


class Aligned(NamedTuple):
    """The map (3, 3) of one view to another, and the standard error of the places it gives."""

    map: Floats
    error: float


def pyramid(small: Image) -> list[Floats32]:
    """Grey levels of an image at a half, a quarter, ... of its size."""
    levels = [cv2.cvtColor(small, cv2.COLOR_BGR2GRAY).astype(np.float32)]
    while len(levels) <= _LEVELS and min(levels[-1].shape) >= 32:
        levels.append(np.asarray(cv2.pyrDown(levels[-1]), np.float32))
    return levels[1:]


def align(before: list[Floats32], after: list[Floats32], guess: Floats) -> Aligned | None:
    """The map of one view to another, from a guess; None where they have little in common.

    Parameters
    ----------
    before, after : list of ndarray
        Of `pyramid`.
    guess : ndarray, shape (3, 3)
        In pixels of the images of which the pyramids are.
    """
    found, fitted = guess, None
    for level in range(len(before), 0, -1):
        scale = np.diag([0.5**level, 0.5**level, 1.0])
        here = scale @ found @ np.linalg.inv(scale)
        fitted = _fit(before[level - 1], after[level - 1], here, scale[0, 0], _LOOSE * (level > 1))
        if fitted is None:
            return None
        found = np.linalg.inv(scale) @ fitted.map @ scale
    return fitted and Aligned(found, 2 * fitted.error)


def explains(before: list[Floats32], after: list[Floats32], here: Floats) -> bool:
    """Does a map make most parts of two views more alike than they are without it?"""
    return more_alike(unlike(before, after, here), unlike(before, after, np.eye(3)))


def unlike(before: list[Floats32], after: list[Floats32], here: Floats) -> Floats:
    """Grey levels by which the parts of two views differ, see `parts_unlike`, laid by a map."""
    key, view = before[0], after[0]
    half = np.diag([0.5, 0.5, 1.0])
    moved = cv2.warpPerspective(
        view, half @ here @ np.linalg.inv(half), key.shape[::-1],
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderValue=_OUTSIDE,
    )  # fmt: skip
    brighter = np.median(view) / max(float(np.median(key)), 1.0)
    return parts_unlike(np.asarray(moved) - brighter * key, np.asarray(moved) >= 0)


def parts_unlike(change: Floats32, known: Bools) -> Floats:
    """Grey levels by which two images differ in each of their parts, those of a target bounded.

    Of single pixels, which show what is sharp, and of means of 4 x 4, which show what is faint.
    """
    off, size = change * known, (_BLOCKS, _BLOCKS)
    shown = cv2.resize(known.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    coarse = cv2.resize(off, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
    parts = [
        cv2.resize(np.minimum(np.abs(np.asarray(x)), _BOUND), size, interpolation=cv2.INTER_AREA)
        for x in (off, coarse)
    ]
    return np.array(parts) / np.maximum(shown, 0.1)


def more_alike(moved: Floats, still: Floats) -> bool:
    """Do most parts differ less if the camera is taken to move than if it is not?"""
    ratios = np.median((moved + _EQUAL) / (still + _EQUAL), axis=(1, 2))
    return bool(ratios.min() < _BETTER)


def _fit(key: Floats32, view: Floats32, here: Floats, scale: float, loose: float) -> Aligned | None:
    """One level: Gauss-Newton steps of which each refines the map by what the key's slopes say."""
    height, width = key.shape
    v, u = np.mgrid[:height, :width].astype(np.float32)
    middle = np.array([[1, 0, -(width - 1) / 2], [0, 1, -(height - 1) / 2], [0, 0, 1.0]])
    u, v = u - np.float32((width - 1) / 2), v - np.float32((height - 1) / 2)
    gv, gu = np.gradient(key)
    slopes = np.stack([gu, gv, gu * u + gv * v, gv * u - gu * v, key, np.ones_like(key)], axis=-1)
    power = cv2.resize(np.asarray(gu**2 + gv**2), (_BLOCKS, _BLOCKS), interpolation=cv2.INTER_AREA)
    fair = np.minimum(1, _FAIR * np.median(power) / np.maximum(power, 1e-9))
    share = cv2.resize(fair, (width, height), interpolation=cv2.INTER_LINEAR)
    sure = np.array([_STEP, _STEP, _TURN, _TURN, 1, 100]) * [scale, scale, 1, 1, 1, 1]
    prior = np.diag(1 / sure**2)
    for step in range(_ITERATIONS):
        shown = cv2.warpAffine(
            view, here[:2], (width, height), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderValue=_OUTSIDE,
        )  # fmt: skip
        known = shown >= 0
        if known.mean() < 0.3:
            return None
        miss = shown - key
        miss -= np.median(miss[known])
        spread = max(1.4826 * float(np.median(np.abs(miss[known]))), _FAINT)
        bound = max(_FIRM * spread, loose / 2**step)
        weight = share * known / (1 + (miss / bound) ** 2) ** 2
        steep = slopes.reshape(-1, 6)
        heavy = steep * weight.reshape(-1, 1)
        normal = heavy.T @ steep + spread**2 * prior
        delta = np.linalg.solve(normal, heavy.T @ miss.ravel())
        shift = np.array(
            [[1 + delta[2], -delta[3], delta[0]], [delta[3], 1 + delta[2], delta[1]], [0, 0, 1]]
        )
        change = np.linalg.inv(middle) @ shift @ middle
        here = here @ np.linalg.inv(change)
        if np.hypot(delta[0], delta[1]) + np.hypot(delta[2], delta[3]) * width / 2 < _CLOSE:
            break
    miss = miss - (slopes @ delta).astype(np.float32)
    return Aligned(here, _error(slopes, weight * miss, normal, (u, v)))


def _error(
    slopes: Floats32, miss: Floats32, normal: Floats, at: tuple[Floats32, Floats32]
) -> float:
    """Standard error of the places of a map, if errors within a block may be the same."""
    height, width = (side // _BLOCKS for side in miss.shape)
    if not height or not width:
        return np.inf
    cut = np.s_[: height * _BLOCKS, : width * _BLOCKS]
    pull = (slopes * miss[..., None])[cut].reshape(_BLOCKS, height, _BLOCKS, width, 6)
    sums = pull.sum(axis=(1, 3)).reshape(-1, 6)
    inverse = np.linalg.inv(normal)
    variance = np.diag(inverse @ (sums.T @ sums) @ inverse)
    far = float(np.mean(at[0] ** 2 + at[1] ** 2))
    return float(np.sqrt((variance[0] + variance[1] + far * (variance[2] + variance[3])) / 2))
