"""Errors that last, noise of few samples a turn, weights of measurements, and kicked motions."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from helpers import dependent
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

import vidsindy_lite as vl
from vidsindy_lite.dynamics import PolynomialSystem
from vidsindy_lite.dynamics import noise as weighing
from vidsindy_lite.dynamics.library import Library
from vidsindy_lite.dynamics.model import Form
from vidsindy_lite.dynamics.noise import inflation, passing, views
from vidsindy_lite.dynamics.problem import pose
from vidsindy_lite.study import FLOWS
from vidsindy_lite.study.corruption import kicked_path


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


# ------------------------------------------------------------------------------------------ weights

LAW = PolynomialSystem.from_terms(
    {"x": {"y": 1.0}, "y": {"x": -1.0, "y": 1.0, "x^2 y": -1.0}}, degree=3
)
TIMES = np.linspace(0.0, 40.0, 1000)
PATH = LAW.simulate(TIMES, [2.0, 0.0])


def uneven(kind, rng):
    """The path with errors of mean size .02 and more, and their standard deviations."""
    if kind == "growing":
        size = 0.02 + 0.1 * np.abs(PATH)
    elif kind == "for a while":
        size = np.where(TIMES > 28, 0.2, 0.02)[:, None] * np.ones(2)
    elif kind == "faster":
        size = 0.01 + 0.1 * np.abs(LAW(PATH))
    return PATH + size * rng.standard_normal(PATH.shape), size


@pytest.mark.parametrize("kind", ["growing", "for a while", "faster"])
def test_law_is_exact_and_its_errors_are_right_and_smaller_than_by_one_variance(kind, monkeypatch):
    x, _ = uneven(kind, np.random.default_rng(2))
    found = vl.discover(TIMES, x)
    assert (found.system.support == LAW.support).all()
    assert found.status == "ok"
    kept = LAW.support
    weighed = found.standard_errors[kept]
    assert (np.abs((found.coefficients - LAW.coefficients)[kept] / weighed) < 4).all()
    monkeypatch.setattr(weighing, "LIKELY", np.inf)
    even = vl.discover(TIMES, x).standard_errors[kept]
    assert np.exp(np.log(even / weighed).mean()) > 1.1


def test_gross_errors_do_no_harm():
    rng = np.random.default_rng(6)
    x = PATH + 0.02 * rng.standard_normal(PATH.shape)
    clean = vl.discover(TIMES, x)
    wrong = rng.permutation(len(x))[:20]
    x[wrong] += rng.choice([-1.0, 1.0], (20, 2)) * rng.uniform(1.0, 3.0, (20, 2))
    found = vl.discover(TIMES, x)
    assert (found.system.support == LAW.support).all()
    assert found.status == "ok"
    off = np.abs(found.coefficients - clean.coefficients)[LAW.support]
    assert (off < 3 * clean.standard_errors[LAW.support]).all()
    assert (found.noise < 1.3 * clean.noise).all()


def test_where_too_much_is_wrong_nothing_is_left_out():
    rng = np.random.default_rng(9)
    residual = rng.standard_normal(1000)
    residual[rng.permutation(1000)[:200]] *= 1e3
    factors = weighing._factors(residual, [PATH[:, 0] ** 2])
    assert (factors > 0).all()


def smoothed(x):
    data = [(TIMES, x)]
    nothing = [np.empty((*x.shape, 0))]
    return pose(data, nothing, Form.of(("x", "y"), Library.polynomial(3)), np.random.default_rng(0))


def test_noise_that_looks_even_before_a_law_is_known_stays_even():
    even = smoothed(PATH + 0.05 * np.random.default_rng(6).standard_normal(PATH.shape))
    assert weighing.smoother_weights(even) is even
    exact = smoothed(PATH)
    assert weighing.smoother_weights(exact) is exact


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("share", [0.05, 1.0])
def test_residuals_that_are_exactly_zero_are_no_accident(share):
    residual = 0.01 * np.random.default_rng(3).standard_normal(800)
    residual[: int(800 * share) - 1] = 0.0
    pieces = np.repeat(np.eye(8), 100, axis=1)
    for causes in (np.ones((1, 800)), pieces):
        cost, variance, _ = weighing._variance(residual, causes)
        assert np.isfinite(cost)
        assert (variance > 0).all()


@pytest.mark.parametrize(
    ("slopes", "start", "noise"),
    [
        ({"x": {"x": -20.0}}, [1.0], 0.0),
        ({"x": {"1": 8.0, "x": -16.0}}, [3.0], 1e-2),
        ({"x": {"1": 8.0, "x": -16.0}}, [3.0], 1e-6),
        ({"x": {"x": -25.0, "y": 1.0}, "y": {"y": -0.5}}, [1.0, 1.0], 1e-4),
    ],
    ids=["a decay", "mixing and noise", "mixing", "a stiff start"],
)
def test_a_transient_of_few_samples_is_the_laws_and_no_error(slopes, start, noise):
    law, t = PolynomialSystem.from_terms(slopes), np.linspace(0, 5, 100)
    x = law.simulate(t, start)
    x += noise * np.random.default_rng(0).standard_normal(x.shape)
    found = vl.discover(t, x, degree=1, order=1)
    assert not any("far from those" in warning for warning in found.warnings)
    rows = [found.system.terms.index(term) for term in law.terms]
    off, kept = found.coefficients[rows] - law.coefficients, law.support
    if noise < 1e-2:
        np.testing.assert_array_equal(found.system.support[rows], kept)
        assert (np.abs(off[kept]) < 4 * found.standard_errors[rows][kept]).all()


def test_a_wrong_sample_is_told_where_the_law_does_not_meet_it():
    x = LAW.simulate(TIMES, [2.0, 0.0])
    x[400] += 100.0
    found = vl.discover(TIMES, x)
    assert (found.system.support == LAW.support).all()
    assert any(f"t = {TIMES[400]:g}" in warning for warning in found.warnings)


# -------------------------------------------------------------------------------------------- kicks

LONG = np.linspace(0.0, 60.0, 1000)


@pytest.mark.thorough
def test_errors_that_a_poor_law_leaves_are_not_taken_for_kicks():
    """The first law shows kicks; the one that is found under them holds exactly."""
    rng = np.random.default_rng(3)
    times = np.linspace(0.0, 60.0, 1500)
    x = LAW.simulate(times, np.array([2.0, 0.0])) + 0.2 * dependent(rng, len(times), 0.97)
    found = vl.discover(times, x, order=1)
    assert (found.system.support == LAW.support).all()
    assert not found.model_error.any()


def test_law_of_a_kicked_motion_is_found_with_the_size_of_its_kicks(tmp_path):
    rng, kept = np.random.default_rng(11), LAW.support
    x = kicked_path(LAW, LONG, (2.0, 0.0), (0.05, 0.05), rng)
    found = vl.discover(LONG, x + 0.002 * rng.standard_normal(x.shape))
    assert (found.system.support == LAW.support).all()
    assert found.status == "ok"
    np.testing.assert_allclose(found.model_error, 0.05, rtol=0.3)
    # Between two knots a kick cannot be told from noise: it is at most that of one sample.
    assert (found.noise < 0.05 * np.sqrt(LONG[1])).all()
    off = (found.coefficients - LAW.coefficients)[kept]
    assert (np.abs(off / found.standard_errors[kept]) < 4).all()
    assert "process noise: 0.0" in str(found)
    found.save(tmp_path / "law.json")
    again = vl.Discovery.load(tmp_path / "law.json")
    np.testing.assert_array_equal(again.model_error, found.model_error)


@pytest.mark.parametrize("kind", ["independent", "lasting", "bent space"])
def test_errors_of_the_measurement_are_no_kicks(kind):
    rng = np.random.default_rng(5)
    x = LAW.simulate(LONG, [2.0, 0.0])
    if kind == "independent":
        x = x + 0.05 * rng.standard_normal(x.shape)
    elif kind == "lasting":
        x = x + 0.05 * dependent(rng, len(x), 0.9)
    else:
        x = x + 0.01 * x[:, ::-1] ** 2
    found = vl.discover(LONG, x)
    assert not found.model_error.any()
    assert "process noise" not in str(found)
    if kind != "bent space":
        assert (found.system.support == LAW.support).all()


def test_velocities_are_kicked_where_positions_are_seen():
    spring = PolynomialSystem.from_terms(
        {"x": {"y": 1.0}, "y": {"x": -4.0, "y": -0.2, "x^3": -3.0}}, degree=3
    )
    rng, times = np.random.default_rng(3), np.linspace(0.0, 30.0, 1000)
    path = kicked_path(spring, times, (1.5, 0.0), (0.0, 0.1), rng)[:, :1]
    found = vl.discover(times, path + 0.003 * rng.standard_normal(path.shape), order=2)
    assert set(np.array(found.terms)[found.system.support[:, 1]]) == {"x", "vx", "x^3"}
    assert found.model_error[0] == 0  # the slope of a position is its velocity, kicked or not
    assert found.model_error[1] == pytest.approx(0.1, rel=0.3)


def test_kicks_in_few_turns_may_be_a_drive():
    spring = PolynomialSystem.from_terms({"x": {"y": 1.0}, "y": {"x": -1.0, "y": -0.1}}, degree=3)
    rng, times = np.random.default_rng(3), np.linspace(0.0, 10 * np.pi, 500)
    path = kicked_path(spring, times, (1.0, 0.0), (0.0, 0.2), rng)[:, :1]
    found = vl.discover(times, path + 0.01 * path.std() * rng.standard_normal(path.shape), order=2)
    assert found.model_error.any()
    assert any("from a drive or a force that nobody named" in text for text in found.warnings)


def test_a_drive_is_not_taken_for_kicks():
    """A spring pushed by cos(.85 t), which nobody named, at eight samples a turn."""
    times = np.arange(80) * 2 * np.pi / 0.85 / 8
    driven = PolynomialSystem.from_terms(
        {"x": {"v": 1}, "v": {"x": -1, "v": -0.1, "c": 1}, "c": {"s": -0.85}, "s": {"c": 0.85}}
    )
    x = driven.simulate(times, (1.0, 0.0, 1.0, 0.0))[:, :1]
    x += 0.05 * x.std() * np.random.default_rng(0).standard_normal(x.shape)
    found = vl.discover(times, x)
    assert not found.model_error.any()
    assert found.status == "suspect"
