"""Local B-spline basis against scipy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from vidsindy_lite.dynamics.splines import clamped_knots, design_matrix, local_basis


@given(st.integers(2, 15), st.integers(0, 2), st.integers(0, 1000))
def test_agrees_with_scipy(count, order, seed):
    rng = np.random.default_rng(seed)
    breakpoints = np.cumsum(rng.uniform(0.1, 2, count))
    knots = clamped_knots(breakpoints)
    t = np.sort(np.concatenate([breakpoints, rng.uniform(breakpoints[0], breakpoints[-1], 20)]))
    control = rng.normal(size=len(knots) - 4)
    ours = design_matrix(knots, t, order) @ control
    scipys = BSpline(knots, control, 3)
    theirs = scipys.derivative(order)(t) if order else scipys(t)
    inside = ~np.isin(t, breakpoints) if order == 2 else np.ones(len(t), dtype=bool)
    np.testing.assert_allclose(ours[inside], theirs[inside], atol=1e-9 * (1 + abs(theirs).max()))


def test_partition_of_unity_makes_the_offset_redundant():
    knots = clamped_knots(np.linspace(0, 1, 6))
    _, values = local_basis(knots, np.linspace(0, 1, 50))
    np.testing.assert_allclose(values.sum(axis=1), 1)


def test_ends_are_interpolated():
    knots = clamped_knots([0.0, 1.0, 3.0])
    assert design_matrix(knots, np.array([0.0]))[0, 0] == 1
    assert design_matrix(knots, np.array([3.0]))[0, -1] == 1


@pytest.mark.parametrize("breakpoints", [[1.0], [0.0, 0.0], [1.0, 0.0], [0.0, np.nan]])
def test_bad_breakpoints_are_refused(breakpoints):
    with pytest.raises(ValueError, match="breakpoints: must be at least two increasing"):
        clamped_knots(breakpoints)
