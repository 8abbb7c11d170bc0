"""The zoo's laws are sparse, bounded, in motion, and always the same."""

import numpy as np
import pytest

from vidsindy_lite.study.zoo import DEGREE, FAR, SIZES, specimen


@pytest.mark.parametrize("number", [0, 1, 2, 5, 6, 9])
def test_a_specimen_moves_within_bounds(number):
    law = specimen(number)
    t, x = law.trajectory(600, 60)
    assert law.d == 1 + number % 4
    assert np.abs(x).max() < FAR
    assert (x.std(axis=0) > 0.05).all()
    slopes = law(x) / x.std(axis=0)
    if law.d > 1:  # of one state, the motion ends
        assert 0.2 < np.sqrt((slopes**2).mean()) * law.period / (2 * np.pi) < 5
    assert np.ptp(t) == pytest.approx(599 / 60 * law.period)


@pytest.mark.parametrize("number", [0, 1, 2, 5, 6, 9])
def test_a_specimen_is_sparse(number):
    law = specimen(number)
    sizes = np.abs(law.coefficients[law.support])
    assert (law.support.sum(axis=0) >= 1).all()
    assert law.d == 1 or law.support.mean() < 0.5
    assert law.exponents.sum(axis=1).max() == DEGREE
    assert SIZES[0] <= sizes.min() <= sizes.max() <= SIZES[1]


def test_specimens_differ_and_come_back():
    first, again = specimen(1), specimen.__wrapped__(1)
    np.testing.assert_array_equal(first.coefficients, again.coefficients)
    assert first.x0 == again.x0
    assert not np.array_equal(first.coefficients, specimen(5).coefficients)
