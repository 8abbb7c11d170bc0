"""Origins of laws that are those of the data, or all but."""

import numpy as np
import pytest

from vidsindy_lite.dynamics import discover
from vidsindy_lite.dynamics.diagnostics import untold_origins
from vidsindy_lite.study import corruption, score
from vidsindy_lite.study.paper import FLOWS


def moved(flow, origin, error, draws):
    """The law of a flow around an origin, and what is found in some draws of an error."""
    truth = FLOWS[flow].shift(origin)
    t, x = truth.trajectory(1500)
    rngs = map(np.random.default_rng, draws)
    return truth, [discover(t, error(x, rng)) for rng in rngs]


def test_axes_whose_origin_the_data_do_not_tell_share_a_line():
    found = [("another origin", name, cost) for name, cost in (("x", 0.4), ("x", -0.2), ("z", 3))]
    first, second = untold_origins([*found, ("the origin of the data", "y", 1)], "longer ones")
    assert "origin is in x and in z: other terms around another origin" in first
    assert "(criterion -0.2); use longer ones" in first
    assert "origin is in y: other terms around the origin of the data" in second


@pytest.mark.parametrize("place", [0.007, 0.0, -0.007])
def test_an_origin_a_little_off_that_of_the_data_is_told_where_errors_are_small(place):
    # Less than a hundredth of the spread: nothing at the errors that the search tolerates.
    def rounded(x, rng):
        return corruption.quantise(x, 1 / 64, rng)

    truth, found = moved("WangSun", (place, -1.47, 1.87), rounded, range(2))
    assert all(score(one, truth).exact for one in found)
    assert [one.offset[0] != 0 for one in found] == [place != 0] * 2


def test_an_axis_is_not_at_home_for_the_asking_where_others_have_left():
    # Around another origin of z than that of the data the same law has x in dy/dt.
    def noisy(x, rng):
        return corruption.add_noise(x, 0.2, rng)

    truth, found = moved("Chen", (13.8, 9.0, 4.05), noisy, range(1, 5))
    wrong = [one for one in found if not score(one, truth).exact]
    assert wrong
    assert all(one.warnings for one in wrong)
    home = [" ".join(one.warnings) for one in wrong if one.offset[2] == 0]
    assert home
    assert all("the law's origin is in z: other terms around another" in text for text in home)


@pytest.mark.parametrize("noise", [0.1, 0.2])
def test_an_axis_at_home_that_the_data_hold_there_is_not_doubted(noise):
    def noisy(x, rng):
        return corruption.add_noise(x, noise, rng)

    truth, found = moved("SprottE", (10.0, 10.0, 0.0), noisy, range(2))
    assert [(score(one, truth).exact, one.status) for one in found] == [(True, "ok")] * 2
