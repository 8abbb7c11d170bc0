"""Bands of normal matrices and their factors against dense algebra."""

import numpy as np
import pytest
from scipy.linalg import cholesky_banded

from vidsindy_lite.dynamics.bspline import normal_band, rows_from, solve_factored

BLOCK = 48  # rows that are solved at once


@pytest.mark.parametrize("alike", [1, 2])
def test_the_band_is_that_of_the_normal_matrix(alike):
    rng = np.random.default_rng(1)
    first = np.sort(rng.integers(0, 7, 20)).repeat(alike)
    rows, weights = (
        rows_from(first, rng.normal(size=(len(first), 3)), 9),
        rng.uniform(1, 2, len(first)),
    )
    dense = rows.toarray()
    assert np.count_nonzero(dense) == 3 * len(first)
    for given, full in ((None, dense.T @ dense), (weights, (dense.T * weights) @ dense)):
        band = normal_band(rows, given, alike)
        for lag in range(3):
            np.testing.assert_allclose(band[lag, : 9 - lag], np.diag(full, -lag), atol=1e-12)


@pytest.mark.parametrize("n", [1, 7, BLOCK, 2 * BLOCK + 1, 3 * BLOCK - 1])
@pytest.mark.parametrize("reach", [3, 11, BLOCK + 5])
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
