"""Splines against scipy and dense algebra: basis, knots, bands, and smoothing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline, make_smoothing_spline
from scipy.linalg import cholesky_banded

from vidsindy_lite.dynamics.bspline import (
    PENALTIES,
    Grid,
    Segment,
    _roughness,
    clamped_knots,
    design_matrix,
    smooth,
    solve_factored,
)


@given(st.integers(2, 15), st.integers(0, 2), st.integers(0, 1000))
def test_agrees_with_scipy(count, order, seed):
    rng = np.random.default_rng(seed)
    breakpoints = np.cumsum(rng.uniform(0.1, 2, count))
    knots = clamped_knots(breakpoints)
    t = np.sort(np.concatenate([breakpoints, rng.uniform(breakpoints[0], breakpoints[-1], 20)]))
    control = rng.normal(size=len(knots) - 4)
    ours = design_matrix(knots, t, order) @ control
    scipys = BSpline(knots, control, 3)
    theirs = scipys.derivative(order)(t) if order else scipys(t)
    inside = ~np.isin(t, breakpoints) if order == 2 else np.ones(len(t), dtype=bool)
    np.testing.assert_allclose(ours[inside], theirs[inside], atol=1e-9 * (1 + abs(theirs).max()))


@pytest.mark.parametrize("breakpoints", [[1.0], [0.0, 0.0], [1.0, 0.0], [0.0, np.nan]])
def test_bad_breakpoints_are_refused(breakpoints):
    with pytest.raises(ValueError, match="breakpoints: must be at least two increasing"):
        clamped_knots(breakpoints)


def test_at_a_kink_the_curve_is_continuous_and_its_slope_is_not():
    t = np.linspace(0, 3, 40)
    x = np.abs(t - 1.3)[:, None]
    segment = Segment.even(t, x, 0.3, 0, np.array([-1.0, 1.3, 3.0])).refined()
    assert segment.kinks.tolist() == [1.3]
    grid = Grid.of([segment])
    assert grid.nodes.shape[0] == grid.r - 1  # as many equations as without: all but the start
    control = np.linalg.lstsq(grid.samples.toarray(), x, rcond=None)[0]
    (spline,) = grid.splines(control)
    fine = np.linspace(0, 3, 333)
    np.testing.assert_allclose(spline(fine)[:, 0], np.abs(fine - 1.3), atol=1e-10)
    slopes = grid.slopes @ control
    np.testing.assert_allclose(np.abs(slopes), 1, atol=1e-8)
    assert (np.diff(slopes[:, 0]) > 1).sum() == 1


def test_node_weights_are_the_lengths_that_nodes_stand_for():
    segments = [
        Segment(np.arange(4.0), np.zeros((4, 1)), np.array([0.0, 1.0, 3.0])),
        Segment(np.arange(3.0), np.zeros((3, 1)), np.array([0.0, 2.0])),
    ]
    widths = np.array([0.5, 1, 2, 1, 1, 2, 1])
    np.testing.assert_allclose(Grid.of(segments).node_weights, 7 * widths / widths.sum())


# -------------------------------------------------------------------------------------------- bands

BLOCK = 48  # rows that are solved at once


@pytest.mark.parametrize("n", [1, BLOCK, 3 * BLOCK - 1])
@pytest.mark.parametrize("reach", [3, BLOCK + 5])
def test_many_right_hand_sides_are_solved_for(n, reach):
    rng = np.random.default_rng(n)
    rows = np.tril(rng.normal(size=(n, n))) + 2 * reach * np.eye(n)
    lower = np.triu(rows, -reach)
    full, right = lower @ lower.T, rng.normal(size=(n, 5))
    band = np.zeros((reach + 1, n))
    for lag in range(min(reach + 1, n)):
        band[lag, : n - lag] = np.diag(full, -lag)
    solved = right.copy()
    solve_factored(cholesky_banded(band, lower=True), solved)
    np.testing.assert_allclose(full @ solved, right, atol=1e-10)


# ---------------------------------------------------------------------------------------- smoothing


@pytest.mark.parametrize("sigma", [1e-3, 0.5])
def test_noise_is_estimated_over_three_decades(sigma):
    t = np.linspace(0, 20, 800)
    x = np.stack([np.sin(t), np.cos(1.7 * t) + 0.3 * t], axis=1)
    noisy = x + sigma * np.random.default_rng(3).normal(size=x.shape)
    estimate = smooth([(t, noisy)], np.random.default_rng(0)).noise
    np.testing.assert_allclose(estimate, sigma, rtol=0.1)


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
