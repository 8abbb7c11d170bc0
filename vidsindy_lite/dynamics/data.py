"""Trajectories as they are measured: checks, gaps, typical steps, and their standard units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import cast

import numpy as np

from ..arrays import Floats, Ints
from ..checks import FARTHEST, check_array, check_items, check_times, labels, shown

# --------------------------------------------------------------------------------------------------
# Measured trajectories: checked input, and its cut into stretches without gaps.

#: Lag-1 autocorrelation, in standard errors of white noise, from which on errors are dependent.
CHANCE = 4.0
MOST_APART = 50.0  #: Median steps of runs over each other: beyond, as of minutes, units differ.
#: Times (n,) and states (n, d), NaN where a coordinate was not seen; in each row one was.
Trajectory = tuple[Floats, Floats]


def check_trajectory(t: Floats, x: Floats) -> Trajectory:
    """Check one trajectory and leave out the rows in which a coordinate was not seen.

    Parameters
    ----------
    t : array_like, shape (n,)
        Increasing, finite times.
    x : array_like, shape (n, d)
        States, NaN or masked where they were not seen.

    Returns
    -------
    t : ndarray, shape (m,)
    x : ndarray, shape (m, d)

    Raises
    ------
    ValueError
        If shapes disagree, ``t`` does not increase, a value is infinite or nothing is left.
    """
    t, x = _check_samples(t, x)
    whole = ~np.isnan(x).any(axis=1)
    if not whole.any():
        raise ValueError(f"x: must hold at least one row without NaN, got {len(x)} with one")
    return t[whole], x[whole]


def _check_samples(t: Floats, x: Floats) -> Trajectory:
    """The same of all rows in which a coordinate was seen."""
    t, x = check_array("t", t), check_array("x", x)
    if x.ndim != 2 or x.shape[1] < 1:
        advice = {
            1: ": one coordinate is a column, x[:, None]",
            3: ": several runs are a list of pairs, discover([(t, x), ...])",
        }.get(x.ndim if x.size else 0, "")
        raise ValueError(f"x: must have shape (n, d) with d of at least 1, got {x.shape}{advice}")
    if t.shape != (len(x),):
        raise ValueError(f"t: must have shape ({len(x)},) as x has {len(x)} rows, got {t.shape}")
    t = check_times(t)
    if np.isinf(x).any():
        raise ValueError(
            f"x: must not be infinite (NaN marks what was not seen), "
            f"got infinity in row {int(np.flatnonzero(np.isinf(x).any(axis=1))[0])}"
        )
    for name, values in (("t", t), ("x", x)):
        sizes = np.abs(values[(values != 0) & ~np.isnan(values)])
        largest = sizes.max(initial=0.0)
        if largest > FARTHEST or 0 < largest < 1 / FARTHEST:
            raise ValueError(
                f"{name}: must be between {1 / FARTHEST:g} and {FARTHEST:g}, got {largest:g} at "
                "most: take another unit"
            )
    rows = ~np.isnan(x).all(axis=1)
    if not rows.any():
        raise ValueError(f"x: must hold a number, got {len(x)} rows of NaN")
    return t[rows], x[rows]


def check_trajectories(
    t: Floats | Sequence[tuple[Floats, Floats]], x: Floats | None = None
) -> list[Trajectory]:
    """Check one trajectory ``t, x``, or a list of several pairs ``(t, x)`` of one dimension.

    Raises
    ------
    ValueError
        If ``t`` is neither, or a trajectory is malformed: see `check_trajectory`; of these a row
        is left out only if nothing was seen in it. If one is there twice, or in other units.
    """
    pairs = t if x is None else [(t, x)]
    items = pairs if isinstance(pairs, list | tuple) else [pairs]
    other = [pair for pair in items if not (isinstance(pair, list | tuple) and len(pair) == 2)]
    if other:
        raise ValueError(f"t: must be a list of pairs (t, x), or x be given, got {shown(other[0])}")
    trajectories = []
    for i, pair in enumerate(pairs):
        try:
            trajectories.append(_check_samples(*pair))
        except ValueError as error:
            if x is not None or len(pairs) == 1:
                raise
            raise ValueError(f"{error}, in trajectory {i}") from None
    if len({values.shape[1] for _, values in trajectories}) != 1:
        raise ValueError(
            "t: a list of trajectories must hold at least one, all of the same dimension, "
            f"got shapes {[values.shape for _, values in trajectories]}"
        )
    seen = np.array([np.isfinite(values).any(axis=0) for _, values in trajectories])
    if (some := seen.any(axis=0) & ~seen.all(axis=0)).any():
        column = int(some.argmax())
        raise ValueError(
            f"x: a coordinate must be seen in all trajectories or in none, got column {column} "
            f"without a number in trajectory {int(seen[:, column].argmin())}"
        )
    runs = [(times.tobytes(), values.tobytes()) for times, values in trajectories]
    for i, run in enumerate(runs):
        if (first := runs.index(run)) < i:
            raise ValueError(f"t: must hold each run once, got trajectory {first} again as {i}")
    steps = sorted(typical_step([run]) for run in trajectories if len(run[0]) > 1)
    if steps and steps[-1] > MOST_APART * steps[0]:
        low, high = steps[0], steps[-1]
        raise ValueError(f"t: must have one unit in all runs, got steps of {low:g} and {high:g}")
    return trajectories


def variable_names(d: int) -> tuple[str, ...]:
    """Default names of ``d`` state variables: x, y, z, w up to four, else x1, x2, ..."""
    return tuple("xyzw"[:d]) if d <= 4 else tuple(f"x{i + 1}" for i in range(d))


def coordinate_names(pairs: Sequence[tuple[Floats, Floats]]) -> tuple[str, ...]:
    """Names of the coordinates: of the columns of data frames, if all are names; else x, y, ...

    Raises
    ------
    ValueError
        If the columns of several trajectories are not named alike.
    """
    columns = [list(getattr(frame, "columns", [])) for _, frame in pairs]
    if any(names != columns[0] for names in columns):
        raise ValueError(f"x: columns must be named alike in all trajectories, got {columns}")
    if len(set(columns[0])) < len(columns[0]):
        raise ValueError(f"x: columns must have names of their own, got {columns[0]}")
    for times, frame in pairs:
        for name in columns[0]:
            clock = str(name).lower() in ("t", "time", "times", "seconds", "timestamp")
            if clock and np.array_equal(frame[name], times):
                raise ValueError(f"x: must hold states alone, got the times as column {name!r}")
    return tuple(labels(pairs[0][1])) or variable_names(np.shape(pairs[0][1])[1])


def check_sigma(
    sigma: float | Floats | Sequence[float | Floats] | None,
    times: Sequence[Floats],
    trajectories: Sequence[Trajectory],
    names: Sequence[str],
) -> list[Floats] | None:
    """Standard errors of samples as `discover` takes them, at those that are not missing.

    Parameters
    ----------
    sigma : float, or array_like of shape (d,) or (n, d), or list of such, or None
        For all trajectories, or a list with one for each of several.
    times : sequence of array_like, shape (n,)
        Of all samples of each trajectory, missing or not.
    trajectories : sequence of Trajectory
    names : sequence of str, length d

    Returns
    -------
    list of ndarray, shape (m, d), or None
        NaN where a coordinate was not seen.

    Raises
    ------
    ValueError
        If shapes disagree, or a standard error of a sample is not finite and positive.
    """
    if sigma is None:
        return None
    several = len(trajectories) > 1 and isinstance(sigma, list | tuple)
    given = cast("Sequence[Floats]", sigma if several else [sigma] * len(trajectories))
    check_items("sigma", given, len(trajectories), "trajectory")
    checked = []
    for part, t, (seen, x) in zip(given, times, trajectories, strict=True):
        errors, shape = check_array("sigma", part, names), (len(t), x.shape[1])
        if errors.shape not in ((), shape[1:], shape):
            raise ValueError(
                f"sigma: must be a number, or have shape {shape[1:]} or {shape}, got {errors.shape}"
            )
        errors = np.broadcast_to(errors, shape)[np.searchsorted(t, seen)]
        wrong = errors[np.isfinite(x) & ~(np.isfinite(errors) & (errors > 0))]
        if wrong.size:
            raise ValueError(f"sigma: must be finite and positive where x is, got {wrong[0]:g}")
        checked.append(np.where(np.isfinite(x), errors, np.nan))
    return checked


def check_systematic(
    systematic: Floats | Sequence[Floats] | None,
    times: Sequence[Floats],
    trajectories: Sequence[Trajectory],
) -> list[Floats]:
    """Systematic errors as `discover` takes them, at the samples that are not missing.

    Parameters
    ----------
    systematic : array_like, shape (k, n, d), or list of such, or None
        For one trajectory, or for each.
    times : sequence of array_like, shape (n,)
        Of all samples of each trajectory, missing or not.
    trajectories : sequence of Trajectory

    Returns
    -------
    list of ndarray, shape (m, d, k)

    Raises
    ------
    ValueError
        If shapes disagree, or a value at a sample is not finite.
    """
    if systematic is None:
        return [np.empty((*x.shape, 0)) for _, x in trajectories]
    if not isinstance(systematic, np.ndarray | list | tuple):
        raise ValueError(f"systematic: must have shape (k, n, d), got {shown(systematic)}")
    alone = len(trajectories) == 1 and not (len(systematic) == 1 and np.ndim(systematic[0]) == 3)
    parts = [systematic] if alone else systematic
    check_items("systematic", parts, len(trajectories), "trajectory")
    checked = []
    for part, t, (seen, x) in zip(parts, times, trajectories, strict=True):
        part = check_array("systematic", part)
        if part.ndim != 3 or part.shape[1:] != (len(t), x.shape[1]):
            raise ValueError(
                f"systematic: must have shape (k, {len(t)}, {x.shape[1]}), got {part.shape}"
            )
        part = np.moveaxis(part, 0, -1)[np.searchsorted(t, seen)]
        part = np.where(np.isfinite(x)[:, :, None], part, 0.0)
        if not np.isfinite(part).all():
            raise ValueError("systematic: must be finite where x is, got NaN or infinity")
        checked.append(part)
    if len({part.shape[-1] for part in checked}) != 1:
        raise ValueError(
            "systematic: must hold the same causes for all trajectories, got "
            f"{[part.shape[-1] for part in checked]} of them"
        )
    return checked


def cut(
    trajectory: Trajectory, longest_step: float | Floats, unsure: Floats | None = None
) -> list[Trajectory]:
    """Cut a trajectory wherever a coordinate is not seen for longer than ``longest_step``, (d,).

    And between ``unsure`` times, (k, 2), where nobody knows what drives it.
    """
    t, x = trajectory
    longest, kept = np.broadcast_to(longest_step, x.shape[1]), np.ones(len(t), dtype=bool)
    for seen, longest_here in zip(np.isfinite(x).T, longest, strict=True):
        at = np.concatenate([[-np.inf], t[seen], [np.inf]])
        after = np.searchsorted(at, t)
        kept &= seen | (at[after] - at[after - 1] <= longest_here)
    low, high = np.zeros((2, 0)) if unsure is None else unsure.T
    kept &= np.searchsorted(low, t) <= np.searchsorted(high, t, side="right")
    t, x = t[kept], x[kept]
    ends = np.flatnonzero(np.diff(t) > longest.min()) + 1
    ends = np.union1d(ends, np.searchsorted(t, high))
    return list(zip(np.split(t, ends), np.split(x, ends), strict=True))


def typical_step(trajectories: Sequence[Trajectory]) -> float:
    """Median time between two samples of the trajectories."""
    return float(np.median(np.concatenate([np.diff(t) for t, _ in trajectories])))


def typical_steps(trajectories: Sequence[Trajectory]) -> Floats:
    """The same of each coordinate over that of all samples, (d,): 1 if it is seen in all."""
    coordinates = range(trajectories[0][1].shape[1])
    seen = [[(t[np.isfinite(x[:, j])], x) for t, x in trajectories] for j in coordinates]
    return np.array([typical_step(parts) for parts in seen]) / typical_step(trajectories)


# --------------------------------------------------------------------------------------------------
# Standard units, in which a fit is made, and those of the data.


@dataclass(frozen=True)
class Units:
    """Standard units of a fit: every coordinate with mean 0 and variance 1, time in time scales.

    Parameters
    ----------
    centre, scale : ndarray, shape (d,)
        Mean and standard deviation of the data.
    time : float
        Length of a standard time unit.
    sizes : ndarray, shape (k,) or (k + d,)
        Root mean squares of the functions of the state in the library; of an implicit law also
        the units of the slopes.
    """

    centre: Floats
    scale: Floats
    time: float
    sizes: Floats = field(default_factory=lambda: np.empty(0))

    def standard(self, point: Floats) -> Floats:
        """A point of the data's frame in standard units."""
        return (point - self.centre) / self.scale

    def point(self, standard: Floats) -> Floats:
        """A standard point in the data's frame and units."""
        return standard * self.scale + self.centre

    def factors(self, exponents: Ints) -> Floats:
        """What turns standard coefficients into those of the data's units, shape (l, d)."""
        scales = np.append(self.scale, self.sizes)
        return self.scale / np.prod(scales**exponents, axis=1)[:, None] / self.time


def inflation(pieces: Sequence[Floats]) -> Floats:
    """Variance of a mean of errors over what it were if they were independent, at least 1, (d,).

    The sum of the autocorrelations over all lags, as long as those of neighbouring lags together
    are positive (Geyer 1992, initial positive sequence); 1 where the first lag is no more than
    chance.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n_i, d)
        Errors of successive samples, of mean zero.
    """
    covariances = autocovariances(pieces)
    limit = CHANCE / np.sqrt(max(sum(map(len, pieces)), 1))
    lasting = (covariances[1:2] > limit * covariances[0]).any(axis=0)
    pairs = covariances[: len(covariances) // 2 * 2].reshape(-1, 2, len(lasting)).sum(axis=1)
    pairs /= np.where(lasting, covariances[0], 1.0)
    total = pairs.sum(axis=0, where=np.logical_and.accumulate(pairs > 0))
    return np.where(lasting, np.maximum(2 * total - 1, 1.0), 1.0)


def autocovariances(pieces: Sequence[Floats]) -> Floats:
    """Sums of the products of errors so many samples apart, over all pieces, (lags, d)."""
    size = 2 * max(max(len(piece) for piece in pieces), 1)
    powers = [np.abs(np.fft.rfft(piece, size, axis=0)) ** 2 for piece in pieces]
    return np.fft.irfft(np.sum(powers, axis=0), size, axis=0)[: size // 2]
