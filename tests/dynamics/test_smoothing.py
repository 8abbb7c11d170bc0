"""Noise estimate and smoothing."""

import numpy as np
import pytest

from vidsindy_lite.dynamics.smoothing import smooth


def wave(n):
    t = np.linspace(0, 20, n)
    return t, np.stack([np.sin(t), np.cos(1.7 * t) + 0.3 * t], axis=1)


@pytest.mark.parametrize("sigma", [1e-3, 1e-2, 0.1, 0.5])
def test_noise_is_estimated_over_three_decades(sigma):
    t, x = wave(800)
    noisy = x + sigma * np.random.default_rng(3).normal(size=x.shape)
    estimate = smooth([(t, noisy)], np.random.default_rng(0)).noise
    np.testing.assert_allclose(estimate, sigma, rtol=0.1)


def test_smoothing_removes_noise():
    t, x = wave(800)
    noisy = x + 0.2 * np.random.default_rng(3).normal(size=x.shape)
    fitted = smooth([(t, noisy)], np.random.default_rng(0)).splines[0](t)
    assert np.sqrt(np.mean((fitted - x) ** 2)) < 0.3 * 0.2


def test_nothing_is_smoothed_across_a_gap():
    t = np.linspace(0, 1, 101)
    step = np.where(t < 0.5, 0.0, 1.0)[:, None]
    halves = [(t[:50], step[:50]), (t[51:], step[51:])]
    left, right = smooth(halves, np.random.default_rng(0)).splines
    np.testing.assert_allclose(left(t[:50]), 0, atol=1e-8)
    np.testing.assert_allclose(right(t[51:]), 1, atol=1e-8)


def test_a_line_is_reproduced_on_uneven_times():
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(0, 5, 200))
    line = 2 * t[:, None] - 1
    spline = smooth([(t, line)], rng).splines[0]
    np.testing.assert_allclose(spline(t), line, atol=1e-6)
