"""Noise and gaps for the robustness experiments.

The paper names levels and rates but not what they are relative to; this is the data protocol of
all notebooks. Every function returns a copy.
"""

import numpy as np

from ..arrays import Floats
from ..checks import check_array, check_instance, check_integer, check_number

BLOCK = 0.01
"""Length of a random block, as a fraction of the record."""


def add_noise(x: Floats, level: float, rng: np.random.Generator) -> Floats:
    """Add Gaussian noise.

    Parameters
    ----------
    x : array_like, shape (n, d)
        Clean states; missing rows (NaN) stay missing.
    level : float
        Standard deviation of the noise over the standard deviation of the same coordinate.
    rng : numpy.random.Generator
        Source of the noise.

    Returns
    -------
    ndarray, shape (n, d)

    Raises
    ------
    ValueError
        If ``x`` is not two-dimensional or ``level`` is negative or not finite.
    """
    x = _check(x, rng)
    if check_number("level", level) < 0:
        raise ValueError(f"level: must not be negative, got {level}")
    return x + level * np.nanstd(x, axis=0) * rng.standard_normal(x.shape)


def drop_blocks(x: Floats, rate: float, rng: np.random.Generator) -> Floats:
    """Hide random blocks (paper: "random block missing").

    Parameters
    ----------
    x : array_like, shape (n, d)
        States.
    rate : float
        Fraction of the rows to hide, in separate gaps of 1 % of the record each.
    rng : numpy.random.Generator
        Places the gaps.

    Returns
    -------
    ndarray, shape (n, d)
        A copy with NaN in the hidden rows.

    Raises
    ------
    ValueError
        If ``rate`` is outside [0, 1) or the gaps do not fit.
    """
    return _drop(x, rate, max(1, round(_rate(rate) / BLOCK)), rng)


def drop_fibers(x: Floats, rate: float, rng: np.random.Generator, gaps: int = 5) -> Floats:
    """Hide a few long stretches (paper: "fiber missing"); see `drop_blocks`.

    Parameters
    ----------
    x : array_like, shape (n, d)
        States.
    rate : float
        Fraction of the rows to hide, shared evenly by the gaps.
    rng : numpy.random.Generator
        Places the gaps.
    gaps : int
        Number of separate gaps.
    """
    return _drop(x, _rate(rate), check_integer("gaps", gaps, 1), rng)


def _drop(x: Floats, rate: float, count: int, rng: np.random.Generator) -> Floats:
    x = _check(x, rng).copy()
    total = round(rate * len(x))
    if total == 0:
        return x
    room = len(x) - total + 1
    if not count <= min(total, room):
        raise ValueError(
            f"rate: {count} separate gaps of {total} rows in all do not fit into {len(x)} rows, "
            f"got rate {rate}"
        )
    lengths = np.full(count, total // count)
    lengths[rng.permutation(count)[: total % count]] += 1
    # Choose before which of the rows that stay each gap goes: distinct, so gaps never touch.
    kept_before = np.sort(rng.choice(room, count, replace=False))
    starts = kept_before + np.cumsum(lengths) - lengths
    for start, length in zip(starts, lengths, strict=True):
        x[start : start + length] = np.nan
    return x


def _rate(rate: float) -> float:
    if not 0 <= check_number("rate", rate) < 1:
        raise ValueError(f"rate: must be at least 0 and below 1, got {rate}")
    return rate


def _check(x: Floats, rng: np.random.Generator) -> Floats:
    check_instance("rng", rng, np.random.Generator)
    x = check_array("x", x)
    if x.ndim != 2 or not len(x):
        raise ValueError(f"x: must have shape (n, d) with n of at least 1, got {x.shape}")
    if np.isinf(x).any():
        raise ValueError(f"x: must not be infinite, got {np.isinf(x).sum()} infinite values")
    return x
