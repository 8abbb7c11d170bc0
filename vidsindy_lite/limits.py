"""The Cramer-Rao bound: how well the coefficients of a law can be known from a noisy trajectory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from .polynomials import PolynomialSystem


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

    coefficients: np.ndarray
    offset: np.ndarray


def cramer_rao(
    system: PolynomialSystem,
    t: np.ndarray,
    x0: np.ndarray,
    sigma: np.ndarray,
    moving: np.ndarray | None = None,
) -> Bound:
    """Cramer-Rao bound of the coefficients, with unknown initial condition and offset.

    Integrates the sensitivity equations along the true trajectory: ``dS/dt = J S + df/dp`` for
    the coefficients and the initial condition; an offset adds to what is measured.

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
    count = len(terms)

    def rates(_, state):
        x, sensitivity = state[:d], state[d:].reshape(d, count + d)
        growth = system.gradient(x) @ sensitivity
        growth[equations, np.arange(count)] += system.library(x[None])[0, terms]
        return np.concatenate([system(x), growth.ravel()])

    start = np.concatenate([x0, np.hstack([np.zeros((d, count)), np.eye(d)]).ravel()])
    solution = solve_ivp(
        rates, (t[0], t[-1]), start, method="DOP853", t_eval=t, rtol=1e-9, atol=1e-10
    )
    sensitivity = solution.y[d:].T.reshape(len(t), d, count + d)
    shifts = np.broadcast_to(np.eye(d)[:, moving], (len(t), d, moving.sum()))
    jacobian = np.concatenate([sensitivity, shifts], axis=2) / np.asarray(sigma)[:, None]
    jacobian = jacobian.reshape(len(t) * d, -1)
    # QR keeps the digits that forming the information matrix of a chaotic flow would lose.
    scale = np.linalg.norm(jacobian, axis=0)
    inverse = np.linalg.inv(np.linalg.qr(jacobian / scale, mode="r"))
    errors = np.linalg.norm(inverse, axis=1) / scale
    coefficients, offset = np.zeros(system.coefficients.shape), np.zeros(d)
    coefficients[terms, equations] = errors[:count]
    offset[moving] = errors[count + d :]
    return Bound(coefficients, offset)
