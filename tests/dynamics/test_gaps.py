"""Curves across gaps."""

from types import SimpleNamespace

import numpy as np
from scipy.interpolate import make_interp_spline

from vidsindy_lite.dynamics.bspline import Segment
from vidsindy_lite.dynamics.model import PolynomialSystem
from vidsindy_lite.dynamics.path import gaps, join

CIRCLE = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1}})


def data(*trajectories, spacing=0.2):
    """A problem as far as its gaps matter."""
    jumps = [np.zeros(0)] * len(trajectories)
    return SimpleNamespace(trajectories=trajectories, spacing=spacing, jumps=jumps)


def pieces():
    """A circle seen from 0 to 2 and 3 to 6, and a second trajectory."""
    t = np.linspace(0, 6, 121)
    x = np.stack([np.sin(t), np.cos(t)], axis=1)
    trajectories = [(t, x), (t, x)]
    cuts = [(0, t <= 2), (0, t >= 3), (1, t >= 0)]
    segments = [Segment.even(t[s], x[s], 0.2, trajectory) for trajectory, s in cuts]
    splines = [make_interp_spline(s.t, s.x, 3) for s in segments]
    return trajectories, segments, splines


def test_a_law_carries_the_curve_across_the_gap():
    trajectories, segments, splines = pieces()
    joined, curves = join(data(*trajectories), segments, splines, CIRCLE, [(0, 2.0)])
    assert [segment.trajectory for segment in joined] == [0, 1]
    assert len(joined[0].t) == 121  # samples inside the gap, if any, come back
    t = np.linspace(2, 3, 40)
    exact = np.stack([np.sin(t), np.cos(t)], axis=1)
    np.testing.assert_allclose(curves[0](t), exact, atol=1e-5)


def test_a_law_that_blows_up_in_a_gap_leaves_the_curve_finite():
    trajectories, segments, splines = pieces()
    wild = PolynomialSystem.from_terms({"x": {"x^3": 1e3}, "y": {"x": -1}})
    _, curves = join(data(*trajectories), segments, splines, wild, [(0, 2.0)])
    t = np.linspace(2.1, 2.9, 40)
    assert np.isfinite(curves[0](t)).all()


def test_gaps_come_shortest_first():
    t = np.linspace(0, 10, 101)
    x = np.stack([np.sin(t), np.cos(t)], axis=1)
    cuts = [t <= 2, (t >= 4) & (t <= 5), (t >= 6) & (t <= 7), t >= 7.5]
    segments = [Segment.even(t[s], x[s], 0.2, 0) for s in cuts]
    assert gaps(segments) == [(0, 7.0), (0, 5.0), (0, 2.0)]


def test_both_sides_are_blended_linearly_across_the_gap():
    """Two circles of other sizes: the law keeps each, so the shares show."""
    t = np.linspace(0, 6, 121)
    x = np.stack([np.sin(t), np.cos(t)], axis=1)
    x[t >= 3] *= 2
    parts = [t <= 2, t >= 3]
    segments = [Segment.even(t[s], x[s], 0.2, 0) for s in parts]
    splines = [make_interp_spline(s.t, s.x, 3) for s in segments]
    joined, (curve,) = join(data((t, x)), segments, splines, CIRCLE, [(0, 2.0)])
    assert len(joined) == 1
    inside = np.linspace(2, 3, 30)
    size = 1 + (inside - 2)
    exact = size[:, None] * np.stack([np.sin(inside), np.cos(inside)], axis=1)
    np.testing.assert_allclose(curve(inside), exact, atol=1e-5)
    outside = np.array([1.5, 4.5])
    np.testing.assert_allclose(curve(outside), [splines[0](1.5), splines[1](4.5)])
