"""Errors that last for several samples, and the noise of few samples a turn."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

import vidsindy_lite as vl
from vidsindy_lite.dynamics.model import Form
from vidsindy_lite.dynamics.noise import inflation, passing, time_inflation, views
from vidsindy_lite.dynamics.problem import pose
from vidsindy_lite.study import FLOWS


def lasting(n, correlation, rng):
    """An autoregressive error of first order, variance 1."""
    return lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], rng.standard_normal(n))


def test_errors_are_inflated_as_they_last():
    rng = np.random.default_rng(1)
    np.testing.assert_array_equal(inflation([rng.standard_normal((3000, 4))]), 1.0)
    assert inflation([lasting(3000, -0.8, rng)[:, None]])[0] == 1.0  # they alternate
    for correlation in (0.3, 0.9):
        expected = (1 + correlation) / (1 - correlation)  # of an autoregressive error
        found = inflation([lasting(100_000, correlation, rng)[:, None]])[0]
        assert found == pytest.approx(expected, rel=0.1)


def test_nothing_lasts_from_one_stretch_into_the_next():
    rng = np.random.default_rng(4)
    # Each stretch has its own level: within it errors never end, between two they are unrelated.
    stretches = [np.full((20, 1), level) for level in rng.choice([-1.0, 1.0], 500)]
    together = np.concatenate(stretches)
    assert inflation(stretches)[0] == pytest.approx(20, rel=0.1)
    assert inflation([together])[0] == pytest.approx(20, rel=0.3)
    assert inflation([piece[:1] for piece in stretches])[0] == 1.0


def fit_with(residual, precision=1.0):
    """A fit that leaves these errors."""
    n, d = residual.shape
    precision = np.broadcast_to(precision, residual.shape)
    data = SimpleNamespace(
        data_residual=lambda _: (residual.copy(), None),
        precision=precision,
        counts=(residual != 0).sum(axis=0),
        grid=SimpleNamespace(x=np.where(residual == 0, np.nan, residual)),
        segments=[SimpleNamespace(t=np.arange(n))],
        d=d,
    )
    state = SimpleNamespace(
        control_points=None, moving=np.zeros(d, dtype=bool), free=lambda: np.zeros(d, dtype=bool)
    )
    return SimpleNamespace(collocation=data, state=state)


def test_errors_pass_that_are_forgotten_and_do_not_rebound():
    rng, t = np.random.default_rng(8), np.arange(1500)
    white, slow = rng.standard_normal(1500), lasting(1500, 0.9, rng)
    averaged = np.convolve(rng.standard_normal(1508), np.ones(9) / 3, "valid")
    filtered = gaussian_filter1d(rng.standard_normal(1500), 6)
    missed = np.sin(t / 7) + 0.3 * white
    pushed = lfilter([1], [1, -1.97, 0.98], rng.standard_normal(1500))  # a spring, at random
    errors = np.stack([white, slow, averaged, filtered, missed, pushed, np.zeros(1500)], axis=1)
    errors *= 0.09 / np.maximum(errors.std(axis=0), 1e-9)
    assert passing(fit_with(errors), 56).tolist() == [True] * 4 + [False] * 3
    assert passing(fit_with(errors[:, [1, 6]]), 56).tolist() == [True, True]  # the 2nd was not seen
    assert not passing(fit_with(errors[:, :4]), 2000).any()  # so many terms these cannot judge
    assert not passing(fit_with(1.2 * errors), 56).any()  # a large part of the motion


def test_errors_of_time_are_along_the_path():
    rng, t = np.random.default_rng(9), np.linspace(0, 60, 2000)
    slopes = np.stack([np.cos(t), -2 * np.sin(2 * t), 3 * np.cos(t + 1)], axis=1)

    def splines(_):
        return [lambda times, order: slopes]

    def inflated(errors):
        fit = fit_with(errors)
        fit.collocation.grid.splines, fit.collocation.segments = splines, [SimpleNamespace(t=t)]
        fit.state.free = lambda: np.zeros(4)
        return time_inflation(fit)

    assert inflated(slopes * rng.standard_normal((2000, 1))) == pytest.approx(np.sqrt(3), rel=0.02)
    assert inflated(rng.standard_normal((2000, 3))) == 1.0


# ------------------------------------------------------------------------------- few samples a turn

CIRCLING = {"x": {"vx": 1.0}, "vx": {"x": -1.0, "vx": 0.5, "x^2 vx": -0.5}}
VAN_DER_POL = vl.PolynomialSystem.from_terms(CIRCLING, degree=3)
CUBIC = vl.Library.polynomial(3)


def posed(t, x, through=False, sigma=None):
    form = Form.of(tuple("xyz"[: x.shape[1]]), CUBIC, 1)
    shared = [np.zeros((*x.shape, 0))]
    return pose([(t, x)], shared, form, np.random.default_rng(0), sigma, through)


def noisy(flow, samples_a_period, share, n=400):
    t, x = FLOWS[flow].trajectory(n, samples_a_period)
    rng = np.random.default_rng(1)
    return t, x + share * x.std(axis=0) * rng.standard_normal(x.shape)


def test_all_terms_tell_a_noise_that_a_curve_overestimates():
    t, x = few = noisy("Lorenz", 8, 0.05)
    curve, told = posed(*few).noise, views(partial(posed, *few))[-1].noise
    assert (curve > 0.065).any()
    assert told == pytest.approx(0.05, rel=0.25)
    many = noisy("Lorenz", 40, 0.05)  # where the curve tells it
    assert (views(partial(posed, *many))[-1].noise == posed(*many).noise).all()
    given = [np.full(x.shape, 0.3)]
    known = views(lambda *how: posed(t, x, *(how or (False,)), given))[-1]
    assert known.noise == pytest.approx(0.3 / x.std(axis=0))
    nothing = np.random.default_rng(0).standard_normal((200, 2))
    assert (views(partial(posed, np.arange(200.0), nothing))[-1].noise > 0.7).all()


@pytest.mark.parametrize(("step", "least"), [(1.0, 3), (2.0, 1)])
def test_van_der_pol_from_fifty_samples(step, least):
    """Most draws tell the law, and none of the others says that it does."""
    t, exact = step * np.arange(50), 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        x = VAN_DER_POL.simulate(t, rng.uniform(-2, 2, 2))[:, :1]
        found = vl.discover(t, x + 0.1 * rng.standard_normal(x.shape), order=2)
        right = (found.system.support == VAN_DER_POL.support).all()
        assert right or found.status == "suspect"
        exact += right
    assert exact >= least
