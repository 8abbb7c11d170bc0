"""From a fit to a law in the frame of the data: what is told from zero, and what is not."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import posed

from vidsindy_lite.dynamics.conclusion import _pruned, conclude
from vidsindy_lite.dynamics.history import History
from vidsindy_lite.dynamics.persistence import LARGEST, follow
from vidsindy_lite.dynamics.problem import fit_curves
from vidsindy_lite.dynamics.search import FINAL_WEIGHT
from vidsindy_lite.dynamics.state import State


def test_pruning_conditions_on_zero():
    covariance = np.array([[1.0, 0.8], [0.8, 4.0]])
    kept, left, margins = _pruned(np.array([[0.5], [20.0]]), covariance, np.array([9.0, 9.0]))
    assert kept[0, 0] == 0
    assert kept[1, 0] == pytest.approx(20.0 - 0.8 * 0.5)
    assert left[1, 1] == pytest.approx(4.0 - 0.8**2)
    assert not left[0].any()
    np.testing.assert_allclose(margins, [9 - 0.5**2, 19.6**2 / 3.36 - 9])


def test_pruning_keeps_what_is_significant():
    coefficients = np.array([[4.0], [20.0]])
    kept, left, margins = _pruned(coefficients, np.eye(2), np.array([9.0, 9.0]))
    assert (kept == coefficients).all()
    assert (left == np.eye(2)).all()
    np.testing.assert_allclose(margins, [16 - 9, 400 - 9])


def test_what_no_shift_has_changed_stays_however_large_the_errors_that_are_tolerated():
    problem = posed(0.1)
    law = np.array([[0, 0], [0, -1], [1, 0], [0, 0], [0, 0], [0, 0]], float)
    grid = problem.collocation(problem.segments())
    control = fit_curves(grid, problem.curves)
    state = State(control, law, law != 0, problem.home, np.zeros(2, dtype=bool))
    fit = problem.weighted(grid, FINAL_WEIGHT).solve(state)
    path = follow(problem, fit)
    tolerant = tuple(
        tuple(replace(plateau, low=LARGEST) for plateau in plateaus) for plateaus in path.plateaus
    )
    found = conclude(problem, fit, replace(path, plateaus=tolerant), History())
    assert (found.system.support == found.native.support).all()
