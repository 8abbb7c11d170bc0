"""Local B-spline basis against scipy; knots, nodes and matrices against dense algebra."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from vidsindy_lite.dynamics.bspline import (
    Grid,
    Segment,
    clamped_knots,
    design_matrix,
)


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


@pytest.mark.parametrize("breakpoints", [[1.0], [0.0, 0.0], [1.0, 0.0], [0.0, np.nan]])
def test_bad_breakpoints_are_refused(breakpoints):
    with pytest.raises(ValueError, match="breakpoints: must be at least two increasing"):
        clamped_knots(breakpoints)


def pieces():
    rng = np.random.default_rng(0)
    times = [np.sort(rng.uniform(low, high, 9)) for low, high in [(0.0, 2.0), (3.0, 4.5)]]
    return [Segment.even(t, rng.normal(size=(9, 2)), 0.4, i) for i, t in enumerate(times)]


@pytest.mark.parametrize("spacing", [0.3, 0.25, 5.0])
def test_even_knots_are_as_far_apart_as_asked_for_or_closer(spacing):
    t = np.array([2.0, 2.1, 3.0])
    breakpoints = Segment.even(t, t[:, None], spacing, 0).breakpoints
    gaps = np.diff(breakpoints)
    assert breakpoints[[0, -1]].tolist() == [2.0, 3.0]
    np.testing.assert_allclose(gaps, gaps[0])
    assert gaps[0] <= spacing + 1e-12
    assert 1 / (len(gaps) - 1) > spacing if len(gaps) > 1 else spacing >= 1


def test_matrices_hold_the_segments_side_by_side():
    segments = pieces()
    grid = Grid.of(segments)
    sizes = [len(s.breakpoints) + 2 for s in segments]
    assert grid.starts.tolist() == [0, sizes[0], sum(sizes)]
    assert grid.r == sum(sizes)
    for rows, columns, segment, knots in zip(
        (slice(0, 9), slice(9, 18)),
        (slice(0, sizes[0]), slice(sizes[0], None)),
        segments,
        grid.knots,
        strict=True,
    ):
        dense = grid.samples.toarray()[rows]
        np.testing.assert_allclose(dense[:, columns], design_matrix(knots, segment.t))
        assert dense.sum() == pytest.approx(9)


def test_nodes_are_midpoints_and_ends():
    segments = pieces()
    grid = Grid.of(segments)
    assert grid.nodes.shape[0] == grid.r - len(segments)
    first = segments[0].breakpoints
    nodes = np.concatenate([first[:1], (first[1:] + first[:-1]) / 2, first[-1:]])
    k, r = len(nodes), len(first) + 2
    knots = grid.knots[0]
    np.testing.assert_allclose(grid.nodes.toarray()[:k, :r], design_matrix(knots, nodes))
    np.testing.assert_allclose(grid.slopes.toarray()[:k, :r], design_matrix(knots, nodes, order=1))


def test_at_a_kink_the_curve_is_continuous_and_its_slope_is_not():
    t = np.linspace(0, 3, 40)
    x = np.abs(t - 1.3)[:, None]
    segment = Segment.even(t, x, 0.3, 0, np.array([-1.0, 1.3, 3.0])).refined()
    assert segment.kinks.tolist() == [1.3]
    grid = Grid.of([segment])
    assert grid.nodes.shape[0] == grid.r - 1  # as many equations as without: all but the start
    control = np.linalg.lstsq(grid.samples.toarray(), x, rcond=None)[0]
    (spline,) = grid.splines(control)
    fine = np.linspace(0, 3, 333)
    np.testing.assert_allclose(spline(fine)[:, 0], np.abs(fine - 1.3), atol=1e-10)
    slopes = grid.slopes @ control
    np.testing.assert_allclose(np.abs(slopes), 1, atol=1e-8)
    assert (np.diff(slopes[:, 0]) > 1).sum() == 1


def test_node_weights_are_the_lengths_that_nodes_stand_for():
    segments = [
        Segment(np.arange(4.0), np.zeros((4, 1)), np.array([0.0, 1.0, 3.0])),
        Segment(np.arange(3.0), np.zeros((3, 1)), np.array([0.0, 2.0])),
    ]
    widths = np.array([0.5, 1, 2, 1, 1, 2, 1])
    np.testing.assert_allclose(Grid.of(segments).node_weights, 7 * widths / widths.sum())
