"""A posed problem: its units and penalties, what a law costs, and what of it is told from zero."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from helpers import posed

from vidsindy_lite.dynamics.collocation import Fit, State, Status
from vidsindy_lite.dynamics.frames import ShiftedLaw, cheapest, closed
from vidsindy_lite.dynamics.inference import _pruned, infer
from vidsindy_lite.dynamics.library import monomial_exponents
from vidsindy_lite.dynamics.path import FINAL_WEIGHT, LARGEST, History, follow
from vidsindy_lite.dynamics.problem import (
    GAP,
    OFFSET_PENALTY,
    fit_curves,
)


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


def test_what_no_shift_has_changed_stays_however_large_the_errors_that_are_tolerated():
    problem = posed(0.1)
    law = np.array([[0, 0], [0, -1], [1, 0], [0, 0], [0, 0], [0, 0]], float)
    grid = problem.collocation(problem.segments())
    control = fit_curves(grid, problem.curves)
    state = State(control, law, law != 0, problem.origin, np.zeros(2, dtype=bool))
    fit = problem.weighted(grid, FINAL_WEIGHT).solve(state)
    path = follow(problem, fit)
    tolerant = tuple(
        tuple(replace(plateau, low=LARGEST) for plateau in plateaus) for plateaus in path.plateaus
    )
    found = infer(problem, fit, path.model, replace(path, plateaus=tolerant), History())
    assert (found.system.support == found.native.support).all()


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
