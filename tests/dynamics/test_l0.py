"""Sparse regression, and which terms of the frame of the data are left out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidsindy_lite.dynamics.inference import _pruned
from vidsindy_lite.dynamics.l0 import closest_rival, inverse, subset_search
from vidsindy_lite.dynamics.library import monomial_exponents


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


# ----------------------------------------------------------------- the law in the frame of the data


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
