"""From a fit to a law in the frame of the data: what is told from zero, and what is not."""

import numpy as np
import pytest

from vidsindy_lite.dynamics.conclusion import _pruned


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
