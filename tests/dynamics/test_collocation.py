"""Banded Gauss-Newton against dense algebra, on problems small enough for it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from vidsindy_lite.dynamics.bspline import Segment
from vidsindy_lite.dynamics.collocation import Collocation, State, Status, _without_systematic
from vidsindy_lite.dynamics.library import monomial_exponents


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


@pytest.mark.parametrize("share", [1.0, 1e-4])
def test_systematic_errors_are_eliminated_as_by_a_least_squares_fit(share):
    """Their own rows, one for each, are the prior: it does not fade where more is tolerated."""
    rng = np.random.default_rng(0)
    rows, sizes = rng.normal(size=(9, 5)), np.array([0.3, -0.2])
    prior = np.hstack([sizes[:, None], np.zeros((2, 2)), np.eye(2)]) / np.sqrt(share)
    whole = np.vstack([rows, prior])
    left, shared = _without_systematic(rows.T @ rows, sizes, share)
    np.testing.assert_allclose(left, np.linalg.inv(np.linalg.inv(whole.T @ whole)[:3, :3]))
    best = np.linalg.lstsq(whole[:, 3:], whole[:, :3], rcond=None)[0]
    np.testing.assert_allclose(shared, -best)


def test_what_was_not_observed_has_no_weight_whatever_its_value(problem, state):
    rng = np.random.default_rng(2)
    precision = rng.uniform(0.5, 2, problem.grid.x.shape)
    precision[rng.random(precision.shape) < 0.3] = 0
    hidden = [
        replace(s, x=np.where(precision[i * 9 : i * 9 + 9] > 0, s.x, np.nan))
        for i, s in enumerate(problem.segments)
    ]
    weights = problem.data_weights, problem.physics_weights
    columns = np.arange(14)
    of_nan = Collocation.of(hidden, problem.exponents, *weights, precision=precision)
    of_zero = replace(problem, precision=precision)
    assert (of_nan.counts == (precision > 0).sum(axis=0)).all()
    for one in (of_nan, of_zero):
        residual, _ = one.data_residual(state.control_points)
        by_hand = (residual**2 * precision * problem.data_weights).sum()
        assert one.data_loss(one.curve(state.control_points)) == pytest.approx(by_hand, rel=1e-12)
    first, second = (one.linearise(state, columns) for one in (of_nan, of_zero))
    np.testing.assert_allclose(first.information, second.information, rtol=1e-12)
    np.testing.assert_allclose(first.gradient, second.gradient, rtol=1e-9)


def test_an_absurd_start_is_no_error(problem, state):
    """Where no law can be seen, a law that crosses a gap may leave all bounds."""
    far = replace(state, control_points=1e60 * state.control_points)
    assert problem.objective(problem.solve(far).state) < problem.objective(far)
