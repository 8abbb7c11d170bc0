"""Splines, banded Gauss-Newton and sparse regression against scipy, dense algebra, definitions."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline, make_smoothing_spline
from scipy.optimize import approx_fprime

from vidsindy_lite.dynamics.bspline import PENALTIES, Segment, clamped_knots, design_matrix, smooth
from vidsindy_lite.dynamics.collocation import Collocation, State, Status
from vidsindy_lite.dynamics.inference import _pruned
from vidsindy_lite.dynamics.l0 import closest_rival, inverse, subset_search
from vidsindy_lite.dynamics.library import monomial_exponents


@given(st.integers(2, 15), st.integers(1, 2), st.integers(0, 1000))
def test_derivatives_agree_with_scipy(count, order, seed):
    rng = np.random.default_rng(seed)
    breakpoints = np.cumsum(rng.uniform(0.1, 2, count))
    knots = clamped_knots(breakpoints)
    t = np.sort(np.concatenate([breakpoints, rng.uniform(breakpoints[0], breakpoints[-1], 20)]))
    control = rng.normal(size=len(knots) - 4)
    ours = design_matrix(knots, t, order) @ control
    theirs = BSpline(knots, control, 3).derivative(order)(t)
    inside = ~np.isin(t, breakpoints) if order == 2 else np.ones(len(t), dtype=bool)
    np.testing.assert_allclose(ours[inside], theirs[inside], atol=1e-9 * (1 + abs(theirs).max()))


@pytest.mark.parametrize("breakpoints", [[1.0], [0.0, 0.0], [1.0, 0.0], [0.0, np.nan]])
def test_bad_breakpoints_are_refused(breakpoints):
    with pytest.raises(ValueError, match="breakpoints: must be at least two increasing"):
        clamped_knots(breakpoints)


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
    model = problem.linearise(state, columns, 0.0)
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


def objective(information, pull, penalty, support):
    """Lowest value on a support, from the definition."""
    inside = np.flatnonzero(support)
    solution = np.linalg.solve(information[np.ix_(inside, inside)], pull[inside])
    return penalty[inside].sum() - pull[inside] @ solution


def random_problem(seed, m, rows=40):
    rng = np.random.default_rng(seed)
    matrix = rng.standard_normal((rows, m)) @ rng.standard_normal((m, m))
    truth = np.where(rng.random(m) < 0.5, rng.standard_normal(m), 0.0)
    target = matrix @ truth + 0.1 * rng.standard_normal(rows)
    return matrix.T @ matrix, matrix.T @ target, rng


@given(st.integers(0, 2**32 - 1), st.integers(2, 7), st.floats(0.01, 10))
def test_no_single_move_improves_the_result(seed, m, price):
    information, pull, rng = random_problem(seed, m)
    penalty = price * rng.uniform(0.5, 1.5, m)
    start = rng.random(m) < 0.5
    support, solution, value = subset_search(information, pull, 0 * pull, penalty, start)
    tolerance = 1e-6 * (1 + abs(value))
    assert (np.flatnonzero(solution) == np.flatnonzero(support)).all()
    assert value == pytest.approx(objective(information, pull, penalty, support), abs=tolerance)
    assert value <= objective(information, pull, penalty, start) + tolerance
    for i in range(m):
        flipped = support.copy()
        flipped[i] = not flipped[i]
        assert value <= objective(information, pull, penalty, flipped) + tolerance
        for k in np.flatnonzero(support != support[i]):
            swapped = support.copy()
            swapped[[i, k]] = swapped[[k, i]]
            assert value <= objective(information, pull, penalty, swapped) + tolerance


def test_the_closest_rival_may_have_no_term_in_common():
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((200, 3))
    columns[:, 2] = columns[:, 0] - columns[:, 1] + 1e-3 * rng.standard_normal(200)
    y = 5 * columns[:, 0] + rng.standard_normal(200)
    information, pull = columns.T @ columns, columns.T @ y
    penalty, support = np.array([20.0, 10.0, 10.0]), np.array([True, False, False])
    cost, dropped, added = closest_rival(information, pull, 0 * pull, penalty, support)
    assert (dropped.tolist(), added.tolist()) == ([0], [1, 2])
    swapped = objective(information, pull, penalty, ~support)
    own = objective(information, pull, penalty, support)
    assert cost == pytest.approx(swapped - own, abs=1e-6)


# -- information matrices ---


def test_inverse_of_badly_scaled_and_of_no_information():
    scale = np.diag([1e-8, 1.0, 1e8])
    core = np.array([[2, 1, 0], [1, 2, 1], [0, 1, 2.0]])
    back = scale @ inverse(scale @ core @ scale) @ scale
    np.testing.assert_allclose(back, np.linalg.inv(core), atol=1e-11)
    assert np.diag(inverse(np.ones((2, 2)))).min() > 1e6  # what cannot be told is uncertain
    with np.errstate(all="raise"):
        variance = np.diag(inverse(np.diag([4.0, 0.0])))
    assert variance[0] == pytest.approx(0.25)
    assert 1e200 < variance[1] < np.inf


@pytest.mark.parametrize("distance", [0.3, 2.9, 3.1, 6.0])
def test_the_square_of_an_origin_is_as_far_from_zero_as_the_origin(distance):
    """x' = x^2 y around an origin that is so many standard errors from that of the data."""
    exponents, error = monomial_exponents(2, 3), 1e-3
    rows = exponents.tolist()
    own, cross, square = (rows.index(powers) for powers in ([2, 1], [1, 1], [0, 1]))
    law, offset = np.zeros((len(rows), 2)), np.array([distance * error, 0.0])
    law[own, 0] = 1.0
    covariance = np.zeros((law.size + 2,) * 2)
    covariance[own, own], covariance[law.size, law.size] = 1e-8, error**2
    kept, _ = _pruned(exponents, law, offset, covariance, np.full(law.size, 9.0))
    assert kept[own, 0] == pytest.approx(1.0)
    shifted = [0.0, 0.0] if distance < 3 else [-2 * offset[0], offset[0] ** 2]
    assert kept[[cross, square], 0] == pytest.approx(shifted, abs=0.0)
