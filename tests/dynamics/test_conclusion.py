"""From a fit to a law in the frame of the data: what is told from zero, and what is not."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import posed

from vidsindy_lite.dynamics.collocation import State
from vidsindy_lite.dynamics.inference import _pruned, infer
from vidsindy_lite.dynamics.library import monomial_exponents
from vidsindy_lite.dynamics.path import FINAL_WEIGHT, LARGEST, History, follow
from vidsindy_lite.dynamics.problem import fit_curves


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
