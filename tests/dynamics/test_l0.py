"""Sparse regression, changes of frame, and what a law of a posed problem costs."""

from itertools import product

import numpy as np
import pytest
from helpers import posed
from hypothesis import given
from hypothesis import strategies as st

from vidsindy_lite.dynamics.collocation import Fit, State, Status
from vidsindy_lite.dynamics.frames import ShiftedLaw, cheapest, closed
from vidsindy_lite.dynamics.inference import _pruned
from vidsindy_lite.dynamics.l0 import closest_rival, inverse, subset_path, subset_search
from vidsindy_lite.dynamics.library import monomial_exponents
from vidsindy_lite.dynamics.model import PolynomialSystem
from vidsindy_lite.dynamics.problem import GAP, OFFSET_PENALTY, fit_curves
from vidsindy_lite.study import SYSTEMS


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


@given(st.integers(0, 2**32 - 1), st.integers(2, 8), st.floats(0.1, 100))
def test_a_path_is_a_search_of_each_share_that_begins_where_the_last_ended(seed, m, price):
    information, pull, rng = random_problem(seed, m)
    penalty, present, support = price * rng.uniform(0.5, 2, m), rng.standard_normal(m), np.ones(m)
    penalty[0], support = rng.choice([penalty[0], -np.inf]), support.astype(bool)
    shares = np.geomspace(1, 1e-4, 9).tolist()
    functions = [(information, pull, share) for share in shares]
    path = subset_path(functions, present, penalty, support)
    for share, found in zip(shares, path, strict=True):
        support, *_ = subset_search(share * information, share * pull, present, penalty, support)
        assert (found == support).all()


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


# ------------------------------------------------------------------------------------------- frames


def test_another_frame_shifts_the_law_and_keeps_the_quadratic_form():
    rng = np.random.default_rng(0)
    exponents = monomial_exponents(2, 2)
    factor = rng.normal(size=(12, 12))
    frames = ShiftedLaw(exponents, rng.normal(size=(6, 2)), factor.T @ factor)
    delta = rng.normal(size=(6, 2))
    moved = ShiftedLaw(exponents, frames.coefficients + delta, frames.information)
    origin = np.array([0.3, -1.2])
    law = PolynomialSystem(("x", "y"), exponents, frames.coefficients).shift(-origin)
    np.testing.assert_allclose(frames.at(origin)[0], law.coefficients, atol=1e-12)
    difference = (moved.at(origin)[0] - frames.at(origin)[0]).T.ravel()
    expected = delta.T.ravel() @ frames.information @ delta.T.ravel()
    assert difference @ frames.at(origin)[1] @ difference == pytest.approx(expected)


def test_coefficients_are_made_to_vanish():
    law = SYSTEMS["SprottF"].shift((0.4, -0.3, 0.2))
    frames = ShiftedLaw(law.exponents, law.coefficients, np.eye(law.coefficients.size))
    entries = np.argwhere((law.support & ~SYSTEMS["SprottF"].support).T)
    origin = frames.vanish(np.zeros((1, 3)), entries[None])[0]
    left = frames.at(origin)[0].T[tuple(entries.T)]
    np.testing.assert_allclose(left, 0, atol=1e-8)
    (moved,) = frames.vanish(np.array([[0.4, -0.3, 0.2]]), entries[None])
    np.testing.assert_allclose(moved, (0.4, -0.3, 0.2), atol=1e-12)


# ---------------------------------------------------------------------------------- a posed problem


@pytest.mark.parametrize("moving", [(False, False), (True, False)])
def test_a_candidate_costs_its_misfit_its_terms_and_its_moved_axes(moving):
    problem = posed(0.1)
    collocation = problem.collocation(problem.segments())
    linear = np.repeat(problem.exponents.sum(axis=1) <= 1, 2).reshape(-1, 2)
    control, still = fit_curves(collocation, problem.curves), np.zeros(2, dtype=bool)
    state = State(control, 0.1 * linear, linear, np.zeros(2), still)
    whole = closed(problem, Fit(state, collocation, Status.CONVERGED), 1e2)
    columns = np.flatnonzero(whole.state.free())
    model = whole.collocation.linearise(whole.state, columns)
    known, pull = np.diag(np.where(linear.T.ravel(), 0.0, 1e30)), np.zeros(12)
    known[np.ix_(columns, columns)], pull[columns] = model.information, model.gradient
    law = ShiftedLaw(problem.exponents, whole.state.coefficients, known, gradient=pull)
    origin = np.where(moving, (0.3, -0.2), problem.origin)
    candidate = cheapest(problem, whole, [(origin, np.array(moving))])

    coefficients, information, gradient = law.at(origin)
    step, penalties = np.linalg.solve(information, gradient), np.tile(problem.penalties, 2)
    estimate = coefficients.T.ravel() + step
    costs = {}
    for support in product([False, True], repeat=6):
        out = np.zeros(12, dtype=bool)
        out[linear.T.ravel()] = ~np.array(support)
        # The rest of the law gives way to what is taken out.
        covariance = np.linalg.inv(information)[np.ix_(out, out)]
        misfit = estimate[out] @ np.linalg.solve(covariance, estimate[out])
        costs[tuple(out)] = misfit + penalties[linear.T.ravel() & ~out].sum()
    out = np.array(min(costs, key=costs.__getitem__))
    assert (candidate.state.active.T.ravel() == linear.T.ravel() & ~out).all()
    price = sum(moving) * OFFSET_PENALTY * problem.penalties[0]
    fitted = whole.collocation.objective(whole.state) - gradient @ step
    expected = fitted + costs[tuple(out)] + price
    assert candidate.criterion == pytest.approx(expected, rel=1e-9)
    assert (candidate.state.moving == moving).all()
    np.testing.assert_array_equal(candidate.state.offset, origin)


# ----------------------------------------------------------------------------------- standard units


def test_a_pause_is_a_gap_if_the_target_moves_far_in_it():
    step = posed().units.time * GAP / 0.05  # samples in the longest pause that is none
    for missing, stretches in ((int(step) - 2, 1), (int(step) + 2, 2)):
        seen = np.r_[0:150, 150 + missing : 401]
        assert len(posed(seen=seen).stretches) == stretches


# ----------------------------------------------------------------- the law in the frame of the data


def pruned(coefficients, covariance, penalties):
    """A law of one variable around the data's own origin, pruned."""
    law = np.array(coefficients, float)[:, None]
    padded = np.pad(np.array(covariance, float), (0, 1))
    return _pruned(monomial_exponents(1, len(law) - 1), law, np.zeros(1), padded, penalties)


def test_pruning_conditions_on_zero():
    kept, left = pruned([0.5, 20.0], [[1.0, 0.8], [0.8, 4.0]], np.array([9.0, 9.0]))
    assert kept[0, 0] == 0
    assert kept[1, 0] == pytest.approx(20.0 - 0.8 * 0.5)
    assert left[1, 1] == pytest.approx(4.0 - 0.8**2)
    assert not left[0].any()


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
