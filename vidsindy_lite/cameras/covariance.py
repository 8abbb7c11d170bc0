"""Covariance of sums of errors that depend on their neighbours, and of what is fitted to such.

With the slopes J of the residuals r in the parameters, their noise sigma and the information P of
measurements, least squares leave the covariance

    W = (sum_n J_n' J_n / sigma^2 + P)^-1,

if errors do not depend on each other. If they do, it is the "sandwich"

    S = W (M / sigma^4 + P) W,   M = sum_nm w(n - m) (J_n' r_n) (J_m' r_m)',

with weights w that fall linearly to zero over as many frames as the residuals depend on each other.
From few frames S is often too small by chance, and W never is but for such errors: so in every
direction the larger of both counts.

Newey and West 1987, Econometrica 55; Andrews 1991, Econometrica 59 (the number of frames).
"""

import numpy as np

from ..arrays import Floats

_UNTOLD = 1e-15  # of the largest information of any direction: rounding


def fitted_factor(missed: Floats, slopes: Floats, prior: Floats, noise: float) -> Floats:
    """A factor F of the covariance F F' of parameters, (k, k), that were fitted.

    Parameters
    ----------
    missed, slopes : ndarray, shape (n, m) and (n, m, k)
        Residuals, and their slopes.
    prior : ndarray, shape (k,)
        Information of measurements on the parameters.
    noise : float
        Standard deviation of the residuals.
    """
    square = np.einsum("nmk,nml->kl", slopes, slopes) + noise**2 * np.diag(prior)
    size = np.sqrt(np.diag(square))  # of each parameter: units of pixels, metres and radians
    size[size == 0] = 1.0
    values, ways = np.linalg.eigh(square / np.outer(size, size))
    told = values > _UNTOLD * values.max(initial=0.0)
    # In the directions of `half`, of length one over sigma, W is the unit matrix.
    half = ways[:, told] / np.sqrt(values[told]) / size[:, None]
    scores = np.einsum("nmk,nm->nk", slopes, missed) @ half
    measured = noise**2 * half.T @ np.diag(prior) @ half
    sandwich = long_run_covariance(scores) * len(scores) + noise**2 * measured
    grown, turned = np.linalg.eigh(sandwich)
    return half @ turned * np.sqrt(np.maximum(grown, noise**2))


def long_run_covariance(series: Floats) -> Floats:
    """Covariance of the mean of a stationary series of mean zero, times its length.

    Parameters
    ----------
    series : ndarray, shape (n, k)

    Returns
    -------
    ndarray, shape (k, k)
        ``sum_h w_h E[s_n s_(n+h)']`` with Bartlett's weights; their width is that which is best
        for autoregressive series of first order.
    """
    n, width = len(series), bandwidth(series)
    total = series.T @ series
    for lag in range(1, min(int(np.ceil(width)), n - 1) + 1):
        product = series[lag:].T @ series[:-lag]
        total += (1 - lag / (width + 1)) * (product + product.T)
    return total / n


def bandwidth(series: Floats) -> float:
    """Over how many neighbours Bartlett's weights fall to zero: best for autoregressive series."""
    power = np.maximum((series**2).sum(axis=0), 1e-300)
    rho = np.clip((series[1:] * series[:-1]).sum(axis=0) / power, -0.97, 0.97)
    curvature = np.mean(4 * rho**2 / ((1 - rho) ** 2 * (1 + rho) ** 2)) if len(rho) else 0.0
    return float(1.1447 * (curvature * len(series)) ** (1 / 3))
