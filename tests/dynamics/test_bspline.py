"""Splines and banded Gauss-Newton against scipy and dense algebra."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline, make_smoothing_spline
from scipy.optimize import approx_fprime

from vidsindy_lite.dynamics.bspline import (
    PENALTIES,
    Segment,
    clamped_knots,
    design_matrix,
    smooth,
)
from vidsindy_lite.dynamics.collocation import Collocation, State, Status
from vidsindy_lite.dynamics.library import monomial_exponents


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


# ---------------------------------------------------------------------------------------- smoothing


def test_few_samples_have_a_smoothing_spline_of_scipys():
    rng = np.random.default_rng(4)
    t = np.cumsum(rng.uniform(0.5, 1.5, 22))
    x = np.sin(0.4 * t) + 0.1 * rng.normal(size=22)
    ours = smooth([(t, x[:, None])], rng).splines[0](t)[:, 0]
    scipys = [
        make_smoothing_spline(t, x, lam=penalty * np.median(np.diff(t)) ** 3)(t)
        for penalty in PENALTIES
    ]
    assert np.abs(ours - scipys).max(axis=1).min() < 1e-6


# -------------------------------------------------------------------------------------- collocation


@pytest.fixture
def problem():
    """Two segments of a plane curve, a cubic law with a moving offset, uneven weights."""
    rng = np.random.default_rng(0)
    segments = []
    for trajectory, (low, high) in enumerate([(0.0, 2.0), (3.0, 3.6)]):
        t = np.sort(rng.uniform(low, high, 9))
        segments.append(Segment.even(t, rng.normal(size=(9, 2)), 0.5, trajectory))
    return Collocation.of(
        segments, monomial_exponents(2, 2), np.array([4.0, 1.0]), np.array([3.0, 7])
    )


@pytest.fixture
def state(problem):
    rng = np.random.default_rng(1)
    active = rng.random((6, 2)) < 0.6
    return State(
        rng.normal(size=(problem.grid.r, 2)), rng.normal(size=(6, 2)) * active, active,
        rng.normal(size=2), np.array([True, False]),
    )  # fmt: skip


def residuals(problem, state):
    data = (problem.curve(state.control_points) - problem.grid.x) * np.sqrt(problem.data_weights)
    weights = np.sqrt(problem.grid.node_weights[:, None] * problem.physics_weights)
    return np.concatenate([data.ravel(), (weights * problem.physics_residual(state)).ravel()])


def dense_jacobian(problem, state, columns):
    """By differences: first the control points, then the named columns."""
    size = state.control_points.size

    def at(p):
        flat = state.flat()
        flat[columns] += p[size:]
        moved = replace(
            state,
            control_points=state.control_points + p[:size].reshape(-1, 2),
            coefficients=flat[:12].reshape(2, 6).T,
            active=np.ones((6, 2), dtype=bool),
            offset=flat[12:],
        )
        return residuals(problem, moved)

    return approx_fprime(np.zeros(size + len(columns)), at, 1e-7)


def test_schur_complement_and_gradient_agree_with_dense_algebra(problem, state):
    assert problem.objective(state) == pytest.approx((residuals(problem, state) ** 2).sum())
    columns = np.arange(14)  # all terms, active or not, and both axes of the offset
    model = problem.linearise(state, columns)
    jacobian = dense_jacobian(problem, state, columns)
    curve, law = np.split(jacobian, [state.control_points.size], axis=1)
    projector = np.eye(len(curve)) - curve @ np.linalg.pinv(curve)
    residual = residuals(problem, state)
    np.testing.assert_allclose(model.information, law.T @ projector @ law, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(model.gradient, -law.T @ projector @ residual, rtol=1e-4, atol=1e-4)
    step = -np.linalg.pinv(curve) @ residual
    np.testing.assert_allclose(model.response[:, 0], step, rtol=1e-4, atol=1e-5)
    left = ((residual + curve @ step) ** 2).sum()
    assert model.fall == pytest.approx((residual**2).sum() - left, rel=1e-6)


def test_a_fit_says_how_it_ended(problem, state):
    assert problem.solve(state, max_steps=1).status is Status.MAX_STEPS
    done = problem.solve(state, tolerance=1e-9, max_steps=200)
    assert done.status is Status.CONVERGED
    assert problem.linearise(done.state, np.flatnonzero(done.state.free())).newton()[1] < 1e-9
    assert (done.state.coefficients[~state.active] == 0).all()  # what is not free does not move
    assert (done.state.offset != state.offset).tolist() == [True, False]
    # No step promises less than nothing: it goes on until rounding hides what steps still do.
    further = problem.solve(done.state, tolerance=-1.0, max_steps=1000)
    assert further.status is Status.STALLED
    assert problem.objective(further.state) <= problem.objective(done.state)
