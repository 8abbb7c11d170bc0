"""Measured inputs: known functions of the time, such as a force that somebody applies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from ..arrays import Floats
from ..checks import check_array, check_times

BEYOND = 1e-6
"""How far beyond its samples an input is known, over their length: further than rounding."""


@dataclass(frozen=True, eq=False)
class Input:
    """A function of the time by its samples: a cubic spline through those of each trajectory.

    Parameters
    ----------
    pieces : tuple of CubicSpline
        One a trajectory.
    """

    pieces: tuple[CubicSpline, ...]

    @classmethod
    def of(cls, name: str, t: ArrayLike, values: ArrayLike) -> Input:
        """An input from times and values (n,), or lists of such.

        Raises
        ------
        ValueError
            If the name is none, times or values are not such, or times of trajectories overlap.
        """
        if not isinstance(name, str) or not name.isidentifier():
            raise ValueError(f"inputs: must be named like variables, such as u, got {name!r:.60}")
        several = isinstance(t, list | tuple) and any(np.ndim(part) for part in t)
        times = cast("Sequence[Floats]", t if several else [t])
        runs = cast("Sequence[Floats]", values if several else [values])
        if len(runs) != len(times):
            raise ValueError(
                f"inputs: {name} must be one per trajectory ({len(times)}), got {len(runs)}"
            )
        pieces = [_spline(name, part, run) for part, run in zip(times, runs, strict=True)]
        ends = sorted((spline.x[0], spline.x[-1]) for spline in pieces)
        for (_, last), (first, _) in zip(ends[:-1], ends[1:], strict=True):
            if not last < first:
                raise ValueError(
                    "inputs: trajectories must have times apart from each other (add a number to "
                    f"those of the second), got one to t = {last:g} and one from t = {first:g}"
                )
        return cls(tuple(pieces))

    def __call__(self, t: Floats) -> Floats:
        """The values at times (n,); NaN where it was not measured."""
        t = np.asarray(t, dtype=float)
        values = np.full(t.shape, np.nan)
        for spline in self.pieces:
            low, high = spline.x[0], spline.x[-1]
            slack = BEYOND * (high - low)
            inside = (t >= low - slack) & (t <= high + slack)
            values[inside] = spline(t[inside])
        return values


def _spline(name: str, t: Floats, values: Floats) -> CubicSpline:
    """The spline through samples, which are checked."""
    t, values = check_times(t), check_array("inputs", values)
    if values.shape != t.shape:
        raise ValueError(f"inputs: {name} must have shape {t.shape}, as t has, got {values.shape}")
    if len(t) < 2:
        raise ValueError(f"inputs: {name} must have at least 2 samples, got {len(t)}")
    if not np.isfinite(values).all():
        first = t[np.argmin(np.isfinite(values))]
        raise ValueError(f"inputs: {name} must be finite, got NaN or infinity at t = {first:g}")
    return CubicSpline(t, values)
