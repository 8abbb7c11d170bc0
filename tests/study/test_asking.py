"""Where the law is asked for: in the middles of the spans it may hold exactly."""

from dataclasses import replace

import numpy as np
import pytest

from vidsindy_lite.dynamics import Segment
from vidsindy_lite.dynamics.bspline import Grid
from vidsindy_lite.study import Asked, law_error

HERE = Asked("Lorenz", 0.1, 400, "middles", 1, 1e-3, 0)


def test_the_law_may_hold_exactly_in_the_middles_but_not_everywhere():
    exact = law_error(HERE)
    assert exact < 0.05
    assert law_error(replace(HERE, places="even", per_span=5)) > 5 * exact
    assert law_error(replace(HERE, places="random", per_span=5)) > 5 * exact


def test_one_even_time_a_span_is_its_middle():
    # but for the two ends of the record, at which the solver asks as well
    even = law_error(replace(HERE, tolerated=1.0, places="even"))
    assert even == pytest.approx(law_error(replace(HERE, tolerated=1.0)), rel=0.3)


def test_draws_are_of_the_trial():
    random = replace(HERE, places="random", tolerated=0.1)
    assert law_error(random) == law_error(random)
    assert law_error(random) != law_error(replace(random, trial=1))


def test_a_grid_that_is_asked_elsewhere_has_the_same_curve():
    t = np.linspace(0, 1, 11)
    grid = Grid.of([Segment(t, np.stack([t, t**3], axis=1), t)])
    times = np.array([0.05, 0.33, 0.9])
    asked = grid.asked_at([times])
    (spline,) = grid.splines(np.random.default_rng(0).normal(size=(grid.r, 2)))
    np.testing.assert_allclose(asked.nodes @ spline.c, spline(times))
    np.testing.assert_allclose(asked.slopes @ spline.c, spline(times, 1))
    assert asked.node_weights.sum() == pytest.approx(grid.node_weights.sum())
    assert asked.samples is grid.samples
