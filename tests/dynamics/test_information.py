import numpy as np
import pytest

from vidsindy_lite.dynamics.information import equilibrated, inverse


def test_inverse_of_badly_scaled_information():
    scale = np.diag([1e-8, 1.0, 1e8])
    core = np.array([[2, 1, 0], [1, 2, 1], [0, 1, 2.0]])
    back = scale @ inverse(scale @ core @ scale) @ scale
    np.testing.assert_allclose(back, np.linalg.inv(core), atol=1e-11)


def test_equilibrated_has_a_unit_diagonal_and_scales_back():
    information = np.array([[4.0, 1.0], [1.0, 9e8]])
    matrix, scale = equilibrated(information, ridge=0.0)
    np.testing.assert_allclose(np.diag(matrix), 1)
    np.testing.assert_allclose(matrix / scale[:, None] / scale, information)


def test_what_cannot_be_told_is_uncertain_not_certain():
    dependent = np.array([[1.0, 1.0], [1.0, 1.0]])
    assert np.diag(inverse(dependent)).min() > 1e6


def test_no_information_is_a_huge_variance_not_an_overflow():
    with np.errstate(all="raise"):
        variance = np.diag(inverse(np.diag([4.0, 0.0])))
    assert variance[0] == pytest.approx(0.25)
    assert 1e200 < variance[1] < np.inf
