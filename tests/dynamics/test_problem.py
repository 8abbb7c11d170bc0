"""A posed problem: its knots, penalties, weights, and what a candidate for its law costs."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from helpers import posed

from vidsindy_lite.dynamics.collocation import Fit, State, Status
from vidsindy_lite.dynamics.frames import ShiftedLaw, cheapest, closed
from vidsindy_lite.dynamics.library import Library
from vidsindy_lite.dynamics.model import Form
from vidsindy_lite.dynamics.problem import OFFSET_PENALTY, SURE, fit_curves, pose, term_penalties
from vidsindy_lite.study import SYSTEMS


def fit_of(problem, moving=(True, False)):
    collocation = problem.collocation(problem.segments())
    rng = np.random.default_rng(1)
    active = rng.random((6, 2)) < 0.5
    state = State(
        fit_curves(collocation, problem.curves), rng.normal(size=(6, 2)) * active, active,
        np.array([0.5, 0.0]), np.array(moving),
    )  # fmt: skip
    return Fit(state, collocation, Status.CONVERGED)


@pytest.mark.parametrize("moving", [(False, False), (True, False), (False, True), (True, True)])
def test_a_candidate_costs_its_misfit_its_terms_and_its_moved_axes(moving):
    problem = posed(0.1)
    fit = fit_of(problem, (False, False))
    linear = np.repeat(problem.exponents.sum(axis=1) <= 1, 2).reshape(-1, 2)
    state = replace(fit.state, active=linear, coefficients=0.1 * linear, offset=np.zeros(2))
    whole = closed(problem, replace(fit, state=state), 1e2)
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


def test_prices_are_dearer_for_rivals_and_where_all_samples_share_errors():
    rng = np.random.default_rng(0)
    t, x = SYSTEMS["Lorenz"].trajectory(300)
    form = Form.of(("x", "y", "z"), Library.polynomial(2), 1)
    alone, shared = (pose([(t, x)], [np.ones((300, 3, k))], form, rng) for k in (0, 1))
    sure = term_penalties(alone.exponents, 3, SURE)
    assert (alone.shared, shared.shared) == (False, True)
    assert (sure > alone.penalties + 2).all()
    for problem in (alone.cautious, shared, shared.cautious):
        np.testing.assert_array_equal(problem.penalties, sure)


def test_turns_and_samples_are_those_of_all_runs():
    problem = posed()
    (t, _), *_ = problem.trajectories
    twice = replace(problem, trajectories=2 * problem.trajectories)
    assert problem.turns == pytest.approx((t[-1] - t[0]) / (2 * np.pi))
    assert twice.turns == pytest.approx(2 * problem.turns)
    assert twice.samples_a_turn == pytest.approx(len(t) / problem.turns)
