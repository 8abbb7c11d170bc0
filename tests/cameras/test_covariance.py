"""Errors that depend on their neighbours: by the book, and as large as they are in fact."""

import numpy as np
from helpers import dependent

from vidsindy_lite.cameras.adjust import bandwidth, fitted_factor, long_run_covariance


def test_long_run_covariance_of_an_autoregressive_series():
    series = dependent(np.random.default_rng(0), 20000, 0.6)
    np.testing.assert_allclose(np.diag(long_run_covariance(series)), 4, rtol=0.15)  # 1.6 / 0.4
    np.testing.assert_allclose(np.diag(long_run_covariance(series[::40])), 1, rtol=0.3)


def test_long_run_covariance_by_the_book():
    """Newey and West 1987 with the width of Andrews 1991, written out."""
    series = dependent(np.random.default_rng(2), 60, 0.5)
    n = len(series)
    parts = []
    for column in series.T:
        rho = sum(column[t] * column[t - 1] for t in range(1, n)) / sum(column**2)
        parts.append(4 * rho**2 / ((1 - rho) ** 2 * (1 + rho) ** 2))
    width = 1.1447 * (np.mean(parts) * n) ** (1 / 3)
    assert 2 < width < 20
    total = np.zeros((2, 2))
    for s in range(n):
        for t in range(n):
            total += max(0, 1 - abs(s - t) / (width + 1)) * np.outer(series[s], series[t])
    found = long_run_covariance(series)
    # The last weight that counts is the first one that is zero or less.
    lag = int(np.ceil(width))
    product = series[lag:].T @ series[:-lag]
    total += min(0, 1 - lag / (width + 1)) * (product + product.T)
    np.testing.assert_allclose(found, total / n, rtol=1e-10)


def test_a_series_that_hardly_ever_changes_has_a_width():
    series = np.ones((50, 1))
    assert 0 < long_run_covariance(series)[0, 0] <= 50
    assert long_run_covariance(np.zeros((50, 1)))[0, 0] == 0


def test_covariance_of_independent_residuals_is_that_of_least_squares():
    rng = np.random.default_rng(3)
    slope = rng.normal(size=(4000, 3, 2))
    missed = 0.2 * rng.normal(size=(4000, 3))
    factor = fitted_factor(missed, slope, np.zeros(2), 0.2)
    flat = slope.reshape(-1, 2)
    expected = 0.2**2 * np.linalg.inv(flat.T @ flat)
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.abs(factor @ factor.T - expected).max() < 0.15 * size.max()
    # Every residual three times in a row: three times the variance for as many numbers.
    thrice = np.repeat(missed, 3, 0), np.repeat(slope, 3, 0)
    tripled = fitted_factor(*thrice, np.zeros(2), 0.2)
    grown = np.trace(tripled @ tripled.T) / np.trace(factor @ factor.T)
    assert 0.6 < grown < 1.1  # and a third if they were taken as independent


def test_measurements_and_residuals_add_up():
    """One parameter, slope 2 in 25 residuals of noise .5, measured with a standard error of .1."""
    missed, slopes = np.full((25, 1), 0.0), np.full((25, 1, 1), 2.0)
    factor = fitted_factor(missed, slopes, np.array([0.1**-2]), 0.5)
    np.testing.assert_allclose(factor @ factor.T, 1 / (25 * 4 / 0.25 + 100))


def test_residuals_that_stay_tell_less():
    """All alike, they are as good as one per width of the weights: the sandwich counts."""
    n = 400
    missed, slopes = np.ones((n, 1)), np.ones((n, 1, 1))
    found = fitted_factor(missed, slopes, np.zeros(1), 1.0) ** 2
    expected = long_run_covariance(np.ones((n, 1))) / n  # W = 1 / n, M = n times it
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert found[0, 0] > 50 / n


def test_a_direction_that_nothing_tells_of_is_left_out():
    slopes = np.ones((30, 1, 1)) * [1.0, 1.0]  # only the sum of both is seen
    factor = fitted_factor(np.zeros((30, 1)), slopes, np.zeros(2), 0.3)
    sums = np.array([1.0, 1.0]) @ factor
    np.testing.assert_allclose(sums @ sums, 0.3**2 / 30)
    difference = np.array([1.0, -1.0]) @ factor
    np.testing.assert_allclose(difference, 0, atol=1e-12)


def test_the_width_of_the_weights():
    """Andrews 1991: 1.1447 (alpha n)^(1/3), alpha = 4 rho^2 / (1 - rho^2)^2."""
    series = np.array([[2.0], [1.0], [0.0], [1.0]])
    rho = (2 * 1 + 1 * 0 + 0 * 1) / (4 + 1 + 1)
    expected = 1.1447 * (4 * rho**2 / (1 - rho**2) ** 2 * 4) ** (1 / 3)
    np.testing.assert_allclose(bandwidth(series), expected)
    assert bandwidth(series[:1]) == 0
