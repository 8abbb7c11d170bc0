"""Noise estimate and smoothing."""

import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline

from vidsindy_lite.dynamics.bspline import (
    PENALTIES,
    Grid,
    Segment,
    _roughness,
    design_matrix,
    smooth,
)


def wave(n):
    t = np.linspace(0, 20, n)
    return t, np.stack([np.sin(t), np.cos(1.7 * t) + 0.3 * t], axis=1)


@pytest.mark.parametrize("sigma", [1e-3, 1e-2, 0.1, 0.5])
def test_noise_is_estimated_over_three_decades(sigma):
    t, x = wave(800)
    noisy = x + sigma * np.random.default_rng(3).normal(size=x.shape)
    estimate = smooth([(t, noisy)], np.random.default_rng(0)).noise
    np.testing.assert_allclose(estimate, sigma, rtol=0.1)


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


def dense(band):
    """The matrix of a lower banded storage."""
    lower = sum(np.diag(row[: band.shape[1] - k], -k) for k, row in enumerate(band))
    return lower + np.tril(lower, -1).T


def test_few_samples_agree_with_dense_algebra():
    """With fewer samples than probes the trace is exact: penalty, curve and noise follow."""
    rng = np.random.default_rng(4)
    t = np.cumsum(rng.uniform(0.5, 1.5, 22))
    x = np.sin(0.4 * t)[:, None] + 0.1 * rng.normal(size=(22, 1))
    grid = Grid.of([Segment(t, x, t)])
    basis, bend = design_matrix(grid.knots[0], t), dense(_roughness([(t, x)], grid))
    scores, noises, curves = [], [], []
    for penalty in PENALTIES:
        influence = basis @ np.linalg.solve(basis.T @ basis + penalty * bend, basis.T)
        left = np.eye(22) - influence
        squares = float(((left @ x) ** 2).sum())
        scores.append(22 * squares / np.trace(left) ** 2 if penalty > 1e-3 else np.inf)
        noises.append(np.sqrt(squares / np.trace(left @ left.T)))
        curves.append(influence @ x)
    best = int(np.argmin(scores))
    smoothed = smooth([(t, x)], rng)
    np.testing.assert_allclose(smoothed.splines[0](t), curves[best], rtol=1e-5, atol=1e-7)
    assert smoothed.noise[0] == pytest.approx(noises[best], rel=1e-5)
    scipys = make_smoothing_spline(t, x[:, 0], lam=PENALTIES[best] * np.median(np.diff(t)) ** 3)
    np.testing.assert_allclose(smoothed.splines[0](t)[:, 0], scipys(t), atol=1e-6)
