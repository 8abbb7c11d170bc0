"""Errors that last for several samples count for what they leave uncertain."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from vidsindy_lite.dynamics.noise import (
    inflation,
    passing,
    time_inflation,
)


def lasting(n, correlation, rng):
    """An autoregressive error of first order, variance 1."""
    return lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], rng.standard_normal(n))


def test_independent_errors_are_not_inflated():
    errors = np.random.default_rng(0).standard_normal((3000, 4))
    np.testing.assert_array_equal(inflation([errors]), 1.0)


@pytest.mark.parametrize("correlation", [0.3, 0.8, 0.95])
def test_autoregressive_errors_are_inflated_as_theory_says(correlation):
    error = lasting(200_000, correlation, np.random.default_rng(1))
    expected = (1 + correlation) / (1 - correlation)
    assert inflation([error[:, None]])[0] == pytest.approx(expected, rel=0.1)


def test_errors_that_alternate_are_not_inflated():
    error = lasting(3000, -0.8, np.random.default_rng(3))
    assert inflation([error[:, None]])[0] == 1.0


def test_nothing_lasts_from_one_stretch_into_the_next():
    rng = np.random.default_rng(4)
    # Each stretch has its own level: within it errors never end, between two they are unrelated.
    stretches = [np.full((20, 1), level) for level in rng.choice([-1.0, 1.0], 500)]
    together = np.concatenate(stretches)
    assert inflation(stretches)[0] == pytest.approx(20, rel=0.1)
    assert inflation([together])[0] == pytest.approx(20, rel=0.3)
    assert inflation([piece[:1] for piece in stretches])[0] == 1.0


def fit_with(residual, precision=1.0):
    """A fit that leaves these errors."""
    n, d = residual.shape
    precision = np.broadcast_to(precision, residual.shape)
    data = SimpleNamespace(
        data_residual=lambda _: (residual.copy(), None),
        precision=precision,
        counts=(residual != 0).sum(axis=0),
        grid=SimpleNamespace(x=np.where(residual == 0, np.nan, residual)),
        segments=[SimpleNamespace(t=np.arange(n))],
        d=d,
    )
    state = SimpleNamespace(
        control_points=None, moving=np.zeros(d, dtype=bool), free=lambda: np.zeros(d, dtype=bool)
    )
    return SimpleNamespace(collocation=data, state=state)


def test_errors_pass_that_are_forgotten_and_do_not_rebound():
    rng, t = np.random.default_rng(8), np.arange(1500)
    white, slow = rng.standard_normal(1500), lasting(1500, 0.9, rng)
    averaged = np.convolve(rng.standard_normal(1508), np.ones(9) / 3, "valid")
    filtered = gaussian_filter1d(rng.standard_normal(1500), 6)
    missed = np.sin(t / 7) + 0.3 * white
    pushed = lfilter([1], [1, -1.97, 0.98], rng.standard_normal(1500))  # a spring, at random
    errors = np.stack([white, slow, averaged, filtered, missed, pushed, np.zeros(1500)], axis=1)
    errors *= 0.09 / np.maximum(errors.std(axis=0), 1e-9)
    assert passing(fit_with(errors), 56).tolist() == [True] * 4 + [False] * 3
    assert passing(fit_with(errors[:, [1, 6]]), 56).tolist() == [True, True]  # the 2nd was not seen
    assert not passing(fit_with(errors[:, :4]), 2000).any()  # so many terms these cannot judge
    assert not passing(fit_with(1.2 * errors), 56).any()  # a large part of the motion


def test_errors_of_time_are_along_the_path():
    rng, t = np.random.default_rng(9), np.linspace(0, 60, 2000)
    slopes = np.stack([np.cos(t), -2 * np.sin(2 * t), 3 * np.cos(t + 1)], axis=1)

    def splines(_):
        return [lambda times, order: slopes]

    def inflated(errors):
        fit = fit_with(errors)
        fit.collocation.grid.splines, fit.collocation.segments = splines, [SimpleNamespace(t=t)]
        fit.state.free = lambda: np.zeros(4)
        return time_inflation(fit)

    assert inflated(slopes * rng.standard_normal((2000, 1))) == pytest.approx(np.sqrt(3), rel=0.02)
    assert inflated(rng.standard_normal((2000, 3))) == 1.0
