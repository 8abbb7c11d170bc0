"""What data suffer: noise and gaps as in the paper, and the errors that measurements have.

The paper names levels and rates but not what they are relative to; this is the data protocol of
all notebooks. Functions ``(x, level, rng)`` return a copy of a path with errors of that kind; a
missing row (NaN) stays missing. `coarse_path` and `kicked_path` make a motion that is not quite
that of its law.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from ..arrays import Floats
from ..checks import (
    check_array,
    check_instance,
    check_integer,
    check_number,
    check_positive,
    check_times,
    check_vector,
)
from ..dynamics import PolynomialSystem, monomials, runge_kutta_4

#: Length of a random block, as a fraction of the record, and number of fibers, as in the paper.
BLOCK, FIBERS = 0.01, 5
#: Of neighbours in correlated noise, and draws that averaged noise is made of: such noise lasts for
#: about a tenth of a period of a hundred samples.
CORRELATION, WIDTH = 0.9, 9
#: Where a coarse path is lost: so many times as far as it began, or after so many calls.
FARTHEST, MOST_CALLS = 1e6, 50_000


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
    return x + _level(level) * np.nanstd(x, axis=0) * rng.standard_normal(x.shape)


def add_proportional_noise(x: Floats, level: float, rng: np.random.Generator) -> Floats:
    """Add noise that grows with the signal: ``x (1 + level * normal)``; see `add_noise`."""
    x = _check(x, rng)
    return x * (1 + _level(level) * rng.standard_normal(x.shape))


def add_correlated_noise(x: Floats, level: float, rng: np.random.Generator) -> Floats:
    """Add noise whose neighbours have a correlation of `CORRELATION`, AR(1); see `add_noise`."""
    x = _check(x, rng)
    fresh = rng.standard_normal(x.shape)
    fresh[1:] *= np.sqrt(1 - CORRELATION**2)
    noise = lfilter([1.0], [1.0, -CORRELATION], fresh, axis=0)
    return x + _level(level) * np.nanstd(x, axis=0) * noise


def add_averaged_noise(x: Floats, level: float, rng: np.random.Generator) -> Floats:
    """Add noise that is an average over `WIDTH` draws, as a filter leaves it; see `add_noise`."""
    x = _check(x, rng)
    sums = np.cumsum(rng.standard_normal((len(x) + WIDTH, x.shape[1])), axis=0)
    noise = (sums[WIDTH:] - sums[:-WIDTH]) / np.sqrt(WIDTH)
    return x + _level(level) * np.nanstd(x, axis=0) * noise


def add_outliers(x: Floats, rate: float, rng: np.random.Generator) -> Floats:
    """Spoil single samples: errors as large as the motion.

    Parameters
    ----------
    x, rng
        See `add_noise`.
    rate : float
        Fraction of the rows that are hit.
    """
    x = _check(x, rng)
    hit = rng.permutation(len(x))[: round(_rate(rate) * len(x))]
    wrong = x.copy()
    wrong[hit] += np.nanstd(x, axis=0) * rng.standard_normal((len(hit), x.shape[1]))
    return wrong


def add_drift(x: Floats, level: float, rng: np.random.Generator) -> Floats:
    """Let every coordinate wander slowly, by about one wave in all of the record.

    Parameters
    ----------
    x, rng
        See `add_noise`.
    level : float
        Height of the wave over the standard deviation of the coordinate.
    """
    x = _check(x, rng)
    waves, phase = rng.uniform(0.3, 1.2, x.shape[1]), rng.uniform(0, 2 * np.pi, x.shape[1])
    place = np.linspace(0, 2 * np.pi, len(x))[:, None]
    return x + _level(level) * np.nanstd(x, axis=0) * np.sin(waves * place + phase)


def distort(x: Floats, level: float, rng: np.random.Generator) -> Floats:
    """Bend space smoothly, as a lens does: the error is a function of the place alone.

    Parameters
    ----------
    x, rng
        See `add_noise`.
    level : float
        Largest error over the range of the coordinate.
    """
    x = _check(x, rng)
    low, high = np.nanmin(x, axis=0), np.nanmax(x, axis=0)
    place = (2 * x - low - high) / np.where(high > low, high - low, 1.0)
    d = x.shape[1]
    bend = np.sin(1.5 * place @ rng.standard_normal((d, d)) + rng.uniform(0, 2 * np.pi, d))
    return x + _level(level) * (high - low) * bend / np.nanmax(np.abs(bend), axis=0)


def quantise(x: Floats, level: float, rng: np.random.Generator) -> Floats:
    """Round to a grid, as whole pixels are.

    Parameters
    ----------
    x, rng
        See `add_noise`; the origin of the grid is drawn.
    level : float
        Spacing of the grid over the range of the coordinate: 1/64 leaves 64 values.
    """
    x = _check(x, rng)
    step = check_positive("level", level) * (np.nanmax(x, axis=0) - np.nanmin(x, axis=0))
    step = np.where(step > 0, step, 1.0)
    origin = step * rng.uniform(size=x.shape[1])
    return np.round((x - origin) / step) * step + origin


def jitter(x: Floats, level: float, rng: np.random.Generator) -> Floats:
    """Read the path at other times than those stated.

    Parameters
    ----------
    x : array_like, shape (n, d)
        States at equal steps, none missing, so dense that a cubic spline is the path.
    level : float
        Standard deviation of the error of the times over the step.
    rng : numpy.random.Generator
        Source of the errors.
    """
    x = _check(x, rng)
    index = np.arange(len(x), dtype=float)
    read = np.clip(index + _level(level) * rng.standard_normal(len(x)), 0, len(x) - 1)
    return np.asarray(CubicSpline(index, x)(read))


def coarse_path(
    rate: Callable[[Floats], Floats],
    t: Floats,
    x0: Sequence[float] | Floats,
    method: str = "LSODA",
    rtol: float = 1e-5,
    atol: float = 1e-7,
) -> Floats:
    """A path as a careless integrator gives it: off by more and more, and smoothly.

    The defaults are those with which the stored trajectories of ODEBench were made.

    Parameters
    ----------
    rate : callable
        The law: time derivative (d,) of a state (d,); a `PolynomialSystem` is one.
    t : array_like, shape (n,)
        Increasing times.
    x0 : array_like, shape (d,)
        State at ``t[0]``.
    method, rtol, atol
        Of `scipy.integrate.solve_ivp`.

    Returns
    -------
    ndarray, shape (n, d)

    Raises
    ------
    ValueError
        If the integrator does not reach the end.
    """
    t, x0 = check_times(t), check_array("x0", x0)
    end, calls = float(t[-1]), iter(range(MOST_CALLS))

    def bounded(_: float, x: Floats) -> Floats:
        # Before a blow-up some integrators halve their steps for ever.
        if not np.abs(x).max() < FARTHEST * (1 + np.abs(x0).max()) or next(calls, None) is None:
            raise ValueError(f"rate: must have a solution up to {end:g}, got one that is lost")
        return rate(x)

    ends = (float(t[0]), end)
    solved = solve_ivp(bounded, ends, x0, method, t, rtol=rtol, atol=atol, first_step=1e-6)
    if not solved.success:
        raise ValueError(f"rate: must have a solution up to {end:g}, got: {solved.message}")
    return np.asarray(solved.y.T)


def kicked_path(
    law: PolynomialSystem,
    t: Floats,
    x0: Sequence[float] | Floats,
    kicks: Sequence[float] | Floats,
    rng: np.random.Generator,
    substeps: int = 2,
) -> Floats:
    """A motion that is kicked at random all the time: process noise.

    Parameters
    ----------
    law : PolynomialSystem
    t : array_like, shape (n,)
        Increasing times.
    x0 : array_like, shape (d,)
        State at ``t[0]``.
    kicks : array_like, shape (d,)
        What the kicks add to each coordinate in a unit of time, as `Discovery.model_error` has it.
    rng : numpy.random.Generator
        Source of the kicks.
    substeps : int
        Runge-Kutta steps between two times, with a kick after each.

    Returns
    -------
    ndarray, shape (n, d)
    """
    check_instance("rng", rng, np.random.Generator)
    x, kicks = check_vector("x0", x0, law.d), check_vector("kicks", kicks, law.d)
    used = law.support.any(axis=1)  # fewer terms, and none of the checks of a public call
    exponents, coefficients = law.exponents[used], law.coefficients[used]

    def rate(x: Floats) -> Floats:
        return np.asarray((monomials(x[None], exponents) @ coefficients)[0])

    path = [x]
    for step in np.diff(check_times(t)) / check_integer("substeps", substeps, 1):
        for _ in range(substeps):
            x = runge_kutta_4(rate, np.array([0.0, step]), x, 1)[1]
            x = x + np.sqrt(step) * kicks * rng.standard_normal(law.d)
        path.append(x)
    return np.array(path)


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


def drop_fibers(x: Floats, rate: float, rng: np.random.Generator) -> Floats:
    """Hide `FIBERS` long stretches (paper: "fiber missing"), all as long; see `drop_blocks`."""
    return _drop(x, _rate(rate), FIBERS, rng)


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


def _level(level: float) -> float:
    if check_number("level", level) < 0:
        raise ValueError(f"level: must not be negative, got {level}")
    return level


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
