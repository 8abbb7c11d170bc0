"""Two views of one scene laid on each other by all of their pixels, where corners are few.

Clouds, waves and plain walls have no corners, but all of their pixels together tell a motion to a
fraction of a pixel, and how well they tell it. A shift, turn and scale, a gain and an offset of the
light are fitted by least squares (Gauss and Newton; Lucas and Kanade 1981), from coarse to fine,
with weights that leave aside what moves on its own.
"""

from typing import NamedTuple

import cv2
import numpy as np

from ..arrays import Floats, Floats32, Image, Ints

_RIM = 2  # pixels of each level that depend on what lies beyond the image
_BEYOND = -1e6  # in place of grey levels where nothing is shown: what it has a part in is below 0
_LOOSE, _FIRM = 40.0, 3.0  # grey levels, and deviations, from which on a pixel is left aside
_STEP, _TURN = 8.0, 0.03  # pixels and radians by which the guess may be wrong
_BLOCKS = 12  # into which each side is cut: errors within one may be the same


class Ground(NamedTuple):
    """One level of a view on which others are laid.

    Its grey levels, by what each pixel changes with shift, turn, scale and light, (6, h, w), how
    much each may tell, and its pixels from the middle.
    """

    grey: Floats32
    slopes: Floats32
    share: Floats32
    u: Floats32
    v: Floats32

    @classmethod
    def of(cls, grey: Floats32) -> "Ground":
        height, width = grey.shape
        u = np.arange(width, dtype=np.float32) - np.float32((width - 1) / 2)
        v = (np.arange(height, dtype=np.float32) - np.float32((height - 1) / 2))[:, None]
        slopes = _slopes(grey, u, v)
        power = _by_blocks(slopes[0] ** 2 + slopes[1] ** 2)
        # Times what a usual block tells, that one block may tell at most.
        fair = np.minimum(1, 4.0 * np.median(power) / np.maximum(power, 1e-9))
        share = cv2.resize(fair, (width, height), interpolation=cv2.INTER_LINEAR)
        return cls(grey, slopes, np.asarray(share, np.float32), u, v)


class Aligned(NamedTuple):
    """The map (3, 3) of one view to another, and the standard error of the places it gives."""

    map: Floats
    error: float


def pyramid(small: Image) -> list[Floats32]:
    """Grey levels of an image at a half, a quarter, ... of its size."""
    levels = [cv2.cvtColor(small, cv2.COLOR_BGR2GRAY).astype(np.float32)]
    # Of the pyramid, the first of half the size.
    while len(levels) <= 4 and min(levels[-1].shape) >= 32:
        levels.append(np.asarray(cv2.pyrDown(levels[-1]), np.float32))
    # So soft that linear interpolation neither shifts nor softens them (OpenCV's cubic one shifts).
    return [np.asarray(cv2.GaussianBlur(level, (0, 0), 1), np.float32) for level in levels[1:]]


def grounds(levels: list[Floats32]) -> list[Ground]:
    """Of a `pyramid`."""
    return [Ground.of(grey) for grey in levels]


def align(before: list[Ground], after: list[Floats32], guess: Floats) -> Aligned | None:
    """The map of one view to another, from a guess; None where they have little in common.

    Its error is infinite where the views tell no more than the guess.

    Parameters
    ----------
    before : list of Ground
    after : list of ndarray
        Of `pyramid`.
    guess : ndarray, shape (3, 3)
        In pixels of the images of which the pyramids are.
    """
    found, fitted = _similar(guess, 2 * np.array(before[0].grey.shape[::-1])), None
    for level in range(len(before), 0, -1):
        scale, back = (np.diag([x, x, 1.0]) for x in (0.5**level, 2.0**level))
        here = scale @ found @ back
        fitted = _fit(before[level - 1], after[level - 1], here, scale[0, 0], _LOOSE * (level > 1))
        if fitted is None:
            return None
        found = back @ fitted.map @ scale
    if fitted is None:  # images too small for a pyramid
        return None
    error = 2 * fitted.error
    return Aligned(found, error if error < _STEP else np.inf)


def _similar(guess: Floats, size: Ints) -> Floats:
    """The shift, turn and scale nearest to a guess in an image (width, height).

    Other parts of it, as perspective, would stay as they are, since nothing is fitted to them.
    """
    u, v = np.array([[0, 0], [1, 0], [0, 1], [1, 1]]).T * size[:, None]
    zero, one = np.zeros(4), np.ones(4)
    ends = guess @ [u, v, one]
    rows = np.concatenate([np.column_stack([u, -v, one, zero]), np.column_stack([v, u, zero, one])])
    c, s, right, down = np.linalg.lstsq(rows, (ends[:2] / ends[2]).ravel())[0]
    return np.array([[c, -s, right], [s, c, down], [0, 0, 1]])


def _fit(
    ground: Ground, view: Floats32, here: Floats, scale: float, loose: float
) -> Aligned | None:
    """One level: Gauss-Newton steps of which each refines the map by what the key's slopes say."""
    key, slopes, share, u, v = ground
    height, width = key.shape
    middle = np.array([[1, 0, (width - 1) / 2], [0, 1, (height - 1) / 2], [0, 0, 1.0]])
    to_middle = np.linalg.inv(middle)
    steep = slopes.reshape(6, -1)
    sure = np.array([_STEP, _STEP, _TURN, _TURN, 1, 100]) * [scale, scale, 1, 1, 1, 1]
    prior = np.diag(1 / sure**2)
    gain, offset = 1.0, 0.0
    framed = np.full_like(view, _BEYOND)
    inner = np.s_[_RIM:-_RIM, _RIM:-_RIM]
    framed[inner] = view[inner]
    within = framed >= 0
    for step in range(6):
        shown = _moved(framed, here[:2])
        known = within & (shown >= 0)
        if np.count_nonzero(known) < 0.3 * known.size:
            return None
        miss = shown - gain * key - offset
        if step == 0:
            offset = _middle(miss[known])
            miss -= offset
        # Grey levels; a deviation without any noise.
        spread = max(1.4826 * _middle(np.abs(miss[known])), 0.3)
        bound = max(_FIRM * spread, loose / 2**step)
        weight = share * known / (1 + (miss / bound) ** 2) ** 2
        heavy = steep * weight.ravel()
        normal = heavy @ steep.T + spread**2 * prior
        delta = np.linalg.solve(normal, heavy @ miss.ravel())
        shift = np.array(
            [[1 + delta[2], -delta[3], delta[0]], [delta[3], 1 + delta[2], delta[1]], [0, 0, 1]]
        )
        here = here @ middle @ np.linalg.inv(shift) @ to_middle
        gain, offset = float(gain + delta[4]), float(offset + delta[5])
        # Pixels of a level of a step that is no longer worth another.
        if np.hypot(delta[0], delta[1]) + np.hypot(delta[2], delta[3]) * width / 2 < 0.01:
            break
    if loose:  # a finer level says how sure the map is
        return Aligned(here, np.inf)
    miss = miss - np.tensordot(delta.astype(np.float32), slopes, 1)
    seen = _slopes(np.where(known, (shown - offset) / gain, key).astype(np.float32), u, v)
    # Noise has slopes, too, but not the same in both views.
    value, direction = np.linalg.eigh(_symmetric(heavy @ seen.reshape(6, -1).T))
    information = (direction * np.maximum(value, 0)) @ direction.T / spread**2 + prior
    telling = _by_blocks(weight * (seen[0] * slopes[0] + seen[1] * slopes[1]))
    # Blocks of mere noise tell as much for the map as against it.
    # Share of the blocks that must tell: what few of them tell may move on its own.
    if telling.mean() <= np.sqrt(0.1 * (telling**2).mean()):
        return Aligned(here, np.inf)
    return Aligned(here, _error(slopes, weight * miss / spread**2, information, (u, v)))


def _middle(values: Floats | Floats32) -> float:
    """The median of every other value, in a fifth of numpy's time."""
    half = values[::2]
    k = len(half) // 2
    parts = np.partition(half, k)
    return float(parts[k] if len(half) % 2 else (parts[:k].max() + parts[k]) / 2)


def _symmetric(matrix: Floats) -> Floats:
    return (matrix + matrix.T) / 2


def _by_blocks(values: Floats32) -> Floats32:
    """The means (12, 12) of an image over its blocks."""
    blocks = cv2.resize(values, (_BLOCKS, _BLOCKS), interpolation=cv2.INTER_AREA)
    return np.asarray(blocks, np.float32)


def _slopes(view: Floats32, u: Floats32, v: Floats32) -> Floats32:
    """By what each pixel changes with shift, turn, scale and light, (6, h, w)."""
    gu, gv = (0.5 * cv2.Sobel(view, cv2.CV_32F, *by, ksize=1) for by in ((1, 0), (0, 1)))
    return np.stack([gu, gv, gu * u + gv * v, gv * u - gu * v, view, np.ones_like(view)])


def _moved(view: Floats32, here: Floats) -> Floats32:
    """A view laid on the other by a map (2, 3)."""
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    size = view.shape[::-1]
    moved = cv2.warpAffine(view, here, size, flags=flags, borderValue=_BEYOND)
    return np.asarray(moved, np.float32)


def _error(
    slopes: Floats32, pull: Floats32, information: Floats, at: tuple[Floats32, Floats32]
) -> float:
    """Standard error of the places of a map, if errors within a block may be the same.

    `pull` (h, w) of each pixel; what the pixels do not tell is known by the guess only.
    """
    height, width = (side // _BLOCKS for side in pull.shape)
    if not height or not width:
        return np.inf
    pulls = (slopes * pull)[:, : height * _BLOCKS, : width * _BLOCKS]
    means = np.array([_by_blocks(by) for by in pulls], float).reshape(6, -1)
    sums = height * width * means
    covariance = np.linalg.inv(information)
    blockwise = covariance @ (sums @ sums.T) @ covariance
    variance = np.maximum(np.diag(blockwise), np.diag(covariance))
    far = float(np.mean(at[0] ** 2) + np.mean(at[1] ** 2))
    return float(np.sqrt((variance[0] + variance[1] + far * (variance[2] + variance[3])) / 2))
