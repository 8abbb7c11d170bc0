"""Covariance of sums of errors that depend on their neighbours.

Newey and West 1987, Econometrica 55; Andrews 1991, Econometrica 59.
"""

import numpy as np

from ..arrays import Floats


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
