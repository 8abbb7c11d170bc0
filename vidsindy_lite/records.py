"""Measured trajectories: checked input, and its cut into stretches without gaps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Record = tuple[np.ndarray, np.ndarray]
"""Times (n,) and states (n, d) without missing rows."""


def check_record(t: np.ndarray, x: np.ndarray) -> Record:
    """Check one trajectory and leave out its missing rows.

    Parameters
    ----------
    t : array_like, shape (n,)
        Increasing, finite times.
    x : array_like, shape (n, d)
        States; a row with a NaN is missing.

    Returns
    -------
    t : ndarray, shape (m,)
    x : ndarray, shape (m, d)

    Raises
    ------
    ValueError
        If shapes disagree, ``t`` does not increase, a value is infinite or nothing is left.
    """
    t, x = _numbers("t", t), _numbers("x", x)
    if x.ndim != 2 or x.shape[1] < 1:
        raise ValueError(f"x: must have shape (n, d) with d of at least 1, got {x.shape}")
    if t.shape != (len(x),):
        raise ValueError(f"t: must have shape ({len(x)},) as x has {len(x)} rows, got {t.shape}")
    if not np.isfinite(t).all():
        raise ValueError(f"t: must be finite, got {t[~np.isfinite(t)][0]}")
    if (np.diff(t) <= 0).any():
        row = int(np.flatnonzero(np.diff(t) <= 0)[0])
        raise ValueError(
            f"t: must increase, got t[{row}] = {t[row]:g} before t[{row + 1}] = {t[row + 1]:g}"
        )
    if np.isinf(x).any():
        raise ValueError(
            f"x: must not be infinite (NaN marks a missing row), "
            f"got infinity in row {int(np.flatnonzero(np.isinf(x).any(axis=1))[0])}"
        )
    seen = ~np.isnan(x).any(axis=1)
    if not seen.any():
        raise ValueError(f"x: must hold at least one row without NaN, got {len(x)} missing rows")
    return t[seen], x[seen]


def _numbers(name: str, values: np.ndarray) -> np.ndarray:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: must be an array of numbers, got {values!r:.60}") from None


def cut(record: Record, longest_step: float) -> list[Record]:
    """Cut a record wherever two samples are further apart than ``longest_step``."""
    t, x = record
    ends = np.flatnonzero(np.diff(t) > longest_step) + 1
    return list(zip(np.split(t, ends), np.split(x, ends), strict=True))


def typical_step(records: Sequence[Record]) -> float:
    """Median time between two samples of the records."""
    return float(np.median(np.concatenate([np.diff(t) for t, _ in records])))
