"""Solutions of differential equations, the same to the last digit on every machine.

A chaotic motion multiplies a rounding error until nothing of the first digits is left: a path of
Sprott's F over 15 periods depends on whether the processor adds two products in one instruction.
So the integrators here use nothing whose rounding is left to a library of linear algebra.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import DOP853

from ..arrays import Floats, Ints
from ..checks import check_array, check_integer, check_times

STAGES = DOP853.n_stages
STAGE_WEIGHTS = [row[:stage, None] for stage, row in enumerate(DOP853.A[:STAGES])]
WEIGHTS, THIRD, FIFTH = (row[:STAGES, None] for row in (DOP853.B, DOP853.E3, DOP853.E5))
"""Coefficients of the step, and of its errors against steps of order 3 and 5."""
MUCH_BETTER = 2.0**-9
"""Error over tolerance below which a step of order 8 may be twice as long."""
MOST_STEPS = 50_000
"""Steps of a motion that gets nowhere; one that needs more is stiff, or as good as lost. ..."""
STEPS_A_LENGTH = 1000
"""... For each of its own sizes by which it moves on it has so many more: then it is just long."""
SHORTEST_STEP = 1e-13
"""Least step over the length of the whole motion."""


def runge_kutta_4(
    rate: Callable[[Floats], Floats], t: Floats, x0: Floats, substeps: int = 10
) -> Floats:
    """Integrate with the classical 4th-order Runge-Kutta method, as the paper does.

    Parameters
    ----------
    rate : callable
        The law: time derivative of a state, or of several at once; a `PolynomialSystem` is one.
    t : ndarray, shape (n,)
        Increasing times of the returned rows.
    x0 : array_like, shape (d,) or (m, d)
        State, or states of several motions, at ``t[0]``.
    substeps : int
        Equal steps between two times.

    Returns
    -------
    ndarray, shape (n, d) or (n, m, d)
    """
    states = [check_array("x0", x0)]
    d = getattr(rate, "d", None)
    if d is not None and states[0].shape[-1:] != (d,):
        raise ValueError(f"x0: must have shape ({d},) or (m, {d}), got {states[0].shape}")
    if not np.isfinite(states[0]).all():
        raise ValueError(f"x0: must be finite, got {x0!r:.60}")
    for step in np.diff(check_times(t)) / check_integer("substeps", substeps, 1):
        x = states[-1]
        for _ in range(substeps):
            k1 = rate(x)
            k2 = rate(x + step / 2 * k1)
            k3 = rate(x + step / 2 * k2)
            k4 = rate(x + step * k3)
            x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        states.append(x)
    return np.array(states)


def one_by_one(exponents: Ints, coefficients: Floats) -> Callable[[Sequence[float]], list[float]]:
    """Sums of monomials at a point, (d,), as a function of its coordinates.

    No digit is left to a BLAS; and for the few numbers of a law it is faster than arrays.
    """
    terms = [
        ([(i, e) for i, e in enumerate(powers) if e], [(j, c) for j, c in enumerate(parts) if c])
        for powers, parts in zip(exponents.tolist(), coefficients.tolist(), strict=True)
        if any(parts)
    ]

    def value(z: Sequence[float]) -> list[float]:
        sums = [0.0] * coefficients.shape[1]
        for powers, parts in terms:
            product = 1.0
            for i, exponent in powers:
                power = z[i]
                for _ in range(exponent - 1):
                    power *= z[i]
                product *= power
            for j, coefficient in parts:
                sums[j] += product * coefficient
        return sums

    return value


def integrate(
    rate: Callable[[Floats], Floats],
    t: Floats,
    x0: Floats,
    tolerance: float = 1e-11,
    farthest: float = np.inf,
) -> Floats:
    """Integrate with the Dormand-Prince method of order 8, its steps halved and doubled as needed.

    Parameters
    ----------
    rate : callable
        The law: time derivative (d,) of a state (d,).
    t : ndarray, shape (n,)
        Increasing times of the returned rows; a step ends at each.
    x0 : ndarray, shape (d,)
        State at ``t[0]``.
    tolerance : float
        Error of a step, absolute and relative.
    farthest : float
        Largest coordinate; beyond it the motion is taken to blow up.

    Returns
    -------
    ndarray, shape (n, d)
        Rows after a blow-up are NaN, or from where the motion is too stiff to follow; however long
        it is, it is followed to its end.

    References
    ----------
    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, sec. II.10.
    """
    return followed(rate, t, x0, tolerance, farthest)[0]


def followed(
    rate: Callable[[Floats], Floats],
    t: Floats,
    x0: Floats,
    tolerance: float = 1e-11,
    farthest: float = np.inf,
) -> tuple[Floats, str]:
    """The path of `integrate`, and what happens where it ends early, in words; else empty."""
    path = np.full((len(t), len(x0)), np.nan)
    path[0] = x = x0
    step, span = float(np.diff(t[:2]).sum()), float(t[-1] - t[0])
    steps, size = float(MOST_STEPS), float(np.abs(x0).max())
    for row, (now, end) in enumerate(zip(t[:-1].tolist(), t[1:].tolist(), strict=True), start=1):
        while now < end:
            last = step >= end - now
            steps -= not last  # that a row is near is no fault of the motion
            if steps < 0:
                return path, "is too stiff to be followed"
            taken = end - now if last else step
            with np.errstate(over="ignore", invalid="ignore"):  # of steps that are too long
                moved, error = _step(rate, x, taken, tolerance)
            if not error < 1:
                step = taken / 2
                if step < SHORTEST_STEP * span:
                    return path, "diverges"
                continue
            size = max(size, float(np.abs(moved).max()))
            steps += STEPS_A_LENGTH * float(np.abs(moved - x).max()) / (size or 1.0)
            x, now = moved, end if last else now + taken
            if np.abs(x).max() > farthest:
                return path, "diverges"
            if error < MUCH_BETTER and not taken < step:
                step = 2 * taken
        path[row] = x
    return path, ""


def _step(
    rate: Callable[[Floats], Floats], x: Floats, step: float, tolerance: float
) -> tuple[Floats, float]:
    """A step of order 8, and its error over the tolerance."""
    slopes = np.empty((STAGES, len(x)))
    slopes[0] = rate(x)
    for stage in range(1, STAGES):
        slopes[stage] = rate(x + step * np.add.reduce(STAGE_WEIGHTS[stage] * slopes[:stage]))
    moved = x + step * np.add.reduce(WEIGHTS * slopes)
    scale = tolerance * (1 + np.maximum(np.abs(x), np.abs(moved)))
    third, fifth = (
        float(np.add.reduce((np.add.reduce(weights * slopes) / scale) ** 2))
        for weights in (THIRD, FIFTH)
    )
    if fifth == 0:
        return moved, 0.0
    return moved, step * fifth / np.sqrt((fifth + 0.01 * third) * len(x))
