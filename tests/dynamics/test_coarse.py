"""Data with few samples a turn: all terms together tell their noise, a curve does not."""

from functools import partial

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite.dynamics.model import Form
from vidsindy_lite.dynamics.noise import views
from vidsindy_lite.dynamics.problem import pose
from vidsindy_lite.study import FLOWS

CIRCLING = {"x": {"vx": 1.0}, "vx": {"x": -1.0, "vx": 0.5, "x^2 vx": -0.5}}
VAN_DER_POL = vl.PolynomialSystem.from_terms(CIRCLING, degree=3)
CUBIC = vl.Library.polynomial(3)


def posed(t, x, through=False, sigma=None):
    form = Form.of(tuple("xyz"[: x.shape[1]]), CUBIC, 1)
    shared = [np.zeros((*x.shape, 0))]
    return pose([(t, x)], shared, form, np.random.default_rng(0), sigma, through)


def noisy(flow, samples_a_period, share, n=600):
    t, x = FLOWS[flow].trajectory(n, samples_a_period)
    rng = np.random.default_rng(1)
    return t, x + share * x.std(axis=0) * rng.standard_normal(x.shape)


@pytest.mark.parametrize(
    ("flow", "samples_a_period"), [("Lorenz", 8), ("Halvorsen", 6), ("Roessler", 12)]
)
def test_all_terms_tell_a_noise_that_a_curve_overestimates(flow, samples_a_period):
    data = noisy(flow, samples_a_period, 0.05)
    curve, told = posed(*data).noise, views(partial(posed, *data))[-1].noise
    assert (curve > 0.065).any()
    assert told == pytest.approx(0.05, rel=0.25)


def test_where_samples_are_many_the_curve_tells_it():
    data = noisy("Lorenz", 40, 0.05)
    assert (views(partial(posed, *data))[-1].noise == posed(*data).noise).all()


def test_given_errors_stay():
    t, x = noisy("Lorenz", 8, 0.05)
    given = [np.full(x.shape, 0.3)]
    known = views(lambda *how: posed(t, x, *(how or (False,)), given))[-1]
    assert known.noise == pytest.approx(0.3 / x.std(axis=0))


def test_what_is_noise_stays_noise():
    x = np.random.default_rng(0).standard_normal((200, 2))
    assert (views(partial(posed, np.arange(200.0), x))[-1].noise > 0.7).all()


@pytest.mark.parametrize(("step", "least"), [(1.0, 4), (2.0, 2)])
def test_van_der_pol_from_fifty_samples(step, least):
    """Most draws tell the law, and none of the others says that it does."""
    t, exact = step * np.arange(50), 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        x = VAN_DER_POL.simulate(t, rng.uniform(-2, 2, 2))[:, :1]
        found = vl.discover(t, x + 0.1 * rng.standard_normal(x.shape), order=2)
        right = (found.system.support == VAN_DER_POL.support).all()
        assert right or found.status == "suspect"
        exact += right
    assert exact >= least
