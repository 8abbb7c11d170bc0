"""The Cramer-Rao bound: how well the coefficients of a law can be known from a noisy trajectory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..dynamics import PolynomialSystem

SUBSTEPS = 8
"""Runge-Kutta steps between two measurements."""
VAGUE = 1e4
"""Prior standard deviation, relative to the size of what is unknown: as good as none."""


@dataclass(frozen=True)
class Bound:
    """Least standard errors of any unbiased estimate that knows the true terms.

    Parameters
    ----------
    coefficients : ndarray, shape (l, d)
        Of the true terms; zero elsewhere.
    offset : ndarray, shape (d,)
        Of the origin of the law; zero along axes that are known.
    """

    coefficients: Floats
    offset: Floats


def bound(
    system: PolynomialSystem, t: Floats, x0: Floats, sigma: Floats, moving: Bools | None = None
) -> Bound:
    """Cramer-Rao bound of the coefficients, with unknown initial condition and offset.

    A square-root Kalman filter along the true trajectory, without process noise: between two
    measurements the covariance of state and coefficients is carried over by the sensitivities of
    one time step, at a measurement it shrinks. Sensitivities over the whole time would not do:
    in a chaotic flow they grow beyond the digits that a computer has.

    Parameters
    ----------
    system : PolynomialSystem
        The true law in its own frame.
    t : ndarray, shape (n,)
        Times of the measurements; the first is that of the initial condition.
    x0 : array_like, shape (d,)
        True initial condition.
    sigma : array_like, shape (d,)
        Standard deviation of the Gaussian noise of each coordinate.
    moving : array_like of bool, shape (d,), optional
        Axes along which the origin is unknown; none by default.

    Returns
    -------
    Bound
    """
    d = system.d
    moving = np.zeros(d, dtype=bool) if moving is None else np.asarray(moving, dtype=bool)
    equations, terms = np.nonzero(system.support.T)
    count, free = len(terms), d + len(terms) + int(moving.sum())
    x = system.simulate(t, x0)
    steps, responses = _sensitivities(system, t, x, equations, terms)
    observe = np.zeros((d, free))
    observe[:, :d] = np.eye(d)
    observe[:, d + count :] = np.eye(d)[:, moving]
    spread = np.ptp(x, axis=0).max() + np.abs(x).max()
    known = np.abs(system.coefficients[terms, equations])
    root = VAGUE * np.diag(
        np.concatenate([np.full(d, spread), known, np.full(moving.sum(), spread)])
    )
    root = _measured(root, observe, sigma)
    carry = np.eye(free)
    for step, response in zip(steps, responses, strict=True):
        carry[:d, :d], carry[:d, d : d + count] = step, response
        root = _measured(carry @ root, observe, sigma)
    errors = np.linalg.norm(root, axis=1)
    coefficients, offset = np.zeros(system.coefficients.shape), np.zeros(d)
    coefficients[terms, equations] = errors[d : d + count]
    offset[moving] = errors[d + count :]
    return Bound(coefficients, offset)


def _measured(root: Floats, observe: Floats, sigma: Floats) -> Floats:
    """Square root of the covariance after a measurement (the array form of the Kalman update)."""
    m, free = observe.shape
    array = np.zeros((m + free, m + free))
    array[:m, :m] = np.diag(sigma)
    array[:m, m:] = observe @ root
    array[m:, m:] = root
    lower = np.asarray(np.linalg.qr(array.T, mode="r")).T
    return lower[m:, m:]


def _sensitivities(
    system: PolynomialSystem, t: Floats, x: Floats, equations: Ints, terms: Ints
) -> tuple[Floats, Floats]:
    """Derivatives of each next state with respect to the state (d, d) and coefficients (d, p)."""
    d, count = system.d, len(terms)
    state = x[:-1]
    sensitivity = np.zeros((len(state), d, d + count))
    sensitivity[:, :, :d] = np.eye(d)
    width = np.diff(t)[:, None] / SUBSTEPS

    def rates(state: Floats, sensitivity: Floats) -> tuple[Floats, Floats]:
        growth = system.gradient(state) @ sensitivity
        growth[:, equations, d + np.arange(count)] += system.library(state)[:, terms]
        return system(state), growth

    def moved(rate: Sequence[Floats], share: float) -> tuple[Floats, Floats]:
        return state + share * width * rate[0], sensitivity + share * width[:, :, None] * rate[1]

    for _ in range(SUBSTEPS):
        k1 = rates(state, sensitivity)
        k2 = rates(*moved(k1, 0.5))
        k3 = rates(*moved(k2, 0.5))
        k4 = rates(*moved(k3, 1.0))
        mean = [(a + 2 * b + 2 * c + e) / 6 for a, b, c, e in zip(k1, k2, k3, k4, strict=True)]
        state, sensitivity = moved(mean, 1.0)
    return sensitivity[:, :, :d], sensitivity[:, :, d:]
