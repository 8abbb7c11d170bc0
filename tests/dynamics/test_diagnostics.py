"""The warnings, on fits whose support is set by hand and on laws that are found."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers import moving, noisy, solved
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from vidsindy_lite.dynamics import discover
from vidsindy_lite.dynamics.collocation import Status
from vidsindy_lite.dynamics.data import check_trajectories
from vidsindy_lite.dynamics.diagnostics import diagnose, outliers
from vidsindy_lite.dynamics.library import Library
from vidsindy_lite.dynamics.model import PolynomialSystem, runge_kutta_4
from vidsindy_lite.dynamics.path import follow
from vidsindy_lite.study import SYSTEMS, add_noise, corruption, score
from vidsindy_lite.study.paper import FLOWS
from vidsindy_lite.study.scoreboard import OdeContest


@pytest.fixture(scope="module")
def duffing():
    """Noisy samples of a hardening spring, and what the law that they tell is judged by."""
    law = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -0.5, "x^3": -0.5, "y": -0.05}})
    t = np.linspace(0, 30, 600)
    x = law.simulate(t, (1.5, 0)) + 0.03 * np.random.default_rng(0).normal(size=(600, 2))
    found, problem, fit = solved(t, x, 3)
    path = follow(problem, fit)
    return t, x, (problem, fit, path.model, path, found.system)


def test_less_than_a_turn_and_a_half_is_told_of_several_runs_too():
    t, x = np.linspace(0, 2, 60), np.exp(1j * np.linspace(0, -2, 60))[:, None].view(float)
    found = discover([(t[:30], x[:30]), (t[30:], x[30:])], degree=1)
    assert any("turns of the motion" in warning for warning in found.warnings)


def far_off(t, x):
    """What is said of samples that no law explains."""
    runs = check_trajectories(t, x)
    return list(outliers(runs, [np.zeros(len(times), dtype=bool) for times, _ in runs]))


def test_a_coordinate_that_lost_its_law_is_told(duffing):
    law = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {}}, degree=3)
    (warning,) = [w for w in diagnose(*duffing[2][:-1], law) if "no term was found for dy/dt" in w]
    assert warning.endswith("use cleaner samples or a longer trajectory")


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("rows", [[300], [0, 1, 2], [597, 598, 599]])
def test_samples_far_off_are_named(duffing, rows, sign):
    t, x = duffing[0], duffing[1].copy()
    x[200:220] = np.nan
    x[rows, 1] = 1e3 * sign ** np.arange(1, len(rows) + 1)
    (warning,) = far_off(t, x)
    places = warning.split("after it: ")[1].split(": no motion")[0].split("; ")
    assert [float(place.split(",")[0].removeprefix("t = ")) for place in places] == pytest.approx(
        t[rows], rel=1e-4
    )
    x[[310, 320, 330, 340], 0] = 1e3
    (warning,) = far_off(t, x)
    assert f"and {len(rows) + 1} more" in warning


def test_a_motion_that_comes_to_rest_is_no_outliers():
    k = np.arange(1000)
    x = np.exp(-0.03 * k)[:, None] * np.column_stack((np.cos(0.2 * k), np.sin(0.2 * k)))
    for states in (x, x[::-1], np.exp(-0.3 * k)[:, None]):
        assert far_off(k, states) == []


@pytest.mark.parametrize("samples_per_period", [100, 25])
def test_noise_and_gaps_are_no_outliers(samples_per_period):
    rng = np.random.default_rng(0)
    t, clean = SYSTEMS["Lorenz"].trajectory(600, samples_per_period)
    noisy = [add_noise(clean, level, rng) for level in (0.05, 0.5)]
    hidden = [corruption.drop_blocks(x, 0.5, rng) for x in (clean, *noisy)]
    for x in (clean, *noisy, *hidden):
        for part in (slice(None), slice(-100, None), np.sort(rng.permutation(600)[:40])):
            assert far_off(t[part], x[part]) == []


@pytest.mark.parametrize(
    ("status", "words"),
    [(Status.MAX_STEPS, "may be off by more"), (Status.STALLED, "may be indistinguishable")],
)
def test_a_fit_that_did_not_converge_is_named_with_advice(duffing, status, words):
    problem, fit, model, path, law = duffing[2]
    assert fit.status is Status.CONVERGED
    (warning,) = diagnose(problem, replace(fit, status=status), model, path, law)
    assert warning.startswith(f"the last fit did not converge ({status.value})")
    assert words in warning
    assert warning.endswith("use cleaner samples or a longer trajectory, or a lower degree")


@pytest.mark.parametrize(
    ("noise", "times"), [(0.02, r"\d+\.\d times"), (1e-9, "more than 100 times")]
)
def test_a_misfit_has_a_size_in_units_of_the_data_and_of_their_spread(noise, times):
    # The constant of a decay changes after half of the time: the curve of no law meets both.
    t = np.linspace(0, 40, 400)
    drive = np.cos(t) + 0.1 * np.cos(2.3 * t), -np.sin(t) - 0.23 * np.sin(2.3 * t)
    x = 50 * np.stack(drive, axis=1)
    x += noise * x.std() * np.random.default_rng(3).standard_normal(x.shape)
    told = " ".join(discover(t, x, degree=1, order=1).warnings)
    number = r"(\d\S*)"
    pattern = f"data of ([xy]) by {number} \\({number} % of its spread, {times} the noise estimated"
    found = re.search(pattern, told)
    assert found, told
    spread = x[:, "xy".index(found[1])].std()
    assert float(found[2]) == pytest.approx(float(found[3]) / 100 * spread, rel=0.02)


@pytest.mark.parametrize(("samples", "status"), [(900, "ok"), (300, "suspect")])
def test_errors_that_last_are_a_misfit_only_if_few_are_independent(samples, status):
    truth = SYSTEMS["NoseHoover"].shift((5, 5, 5))
    t, x = truth.trajectory(samples)
    found = discover(t, corruption.add_correlated_noise(x, 0.05, np.random.default_rng(2)))
    assert found.status == status, found.warnings
    assert all("times the noise estimated beforehand" in warning for warning in found.warnings)


def test_random_pushes_that_nobody_named_are_a_misfit():
    # A spring swings where it is pushed: what its law misses comes back with the other sign.
    t = np.linspace(0, 80, 800)
    rng = np.random.default_rng(1)
    push = make_interp_spline(np.linspace(-2, 82, 71), rng.standard_normal(71))
    swing = runge_kutta_4(
        lambda s: np.array([s[1], -s[0] - 0.05 * s[1] + 0.15 * push(s[2]), 1.0]),
        t,
        np.array([2.0, 0.0, 0.0]),
    )[:, :2]
    found = discover(t, swing + 0.002 * rng.standard_normal(swing.shape), order=1)
    assert any("times the noise estimated beforehand" in warning for warning in found.warnings)


def moved(flow, origin, error, level, draw=0, n=1500):
    """The law of a flow around an origin, and what is found in a draw of an error."""
    truth = FLOWS[flow].shift(origin)
    t, x = truth.trajectory(n)
    return truth, discover(t, error(x, level, np.random.default_rng(draw)))


def duffings(*stiffness, noise):
    """A run of a hardening spring for each stiffness, and its noise."""
    laws = [{"x": {"y": 1}, "y": {"x": -k, "x^3": -0.3, "y": -0.1}} for k in stiffness]
    t, rng = np.linspace(0, 20, 300), np.random.default_rng(7)
    runs = [PolynomialSystem.from_terms(law).simulate(t, (1.5, 0)) for law in laws]
    return [(t, add_noise(x, level, rng)) for x, level in zip(runs, noise, strict=True)]


def differing(found):
    return [w.split(" has other coeff")[0] for w in found.warnings if "other coefficients" in w]


@pytest.mark.parametrize(
    ("stiffness", "told", "noise"),
    [
        ((1, 1, 1.05), ["run 2"], [0.03] * 3), ((1, 1.12, 1), ["run 1"], [0.1] * 3),
        ((1, 1, 1), [], [0.03] * 3), ((1, 1, 1.03, 1), ["run 2"], [0.005, 0.02, 0.05, 0.01]),
    ],
)  # fmt: skip
def test_runs_of_different_systems_are_told(stiffness, told, noise):
    assert differing(discover(duffings(*stiffness, noise=noise))) == told


@pytest.mark.parametrize(("last", "told"), [(1, []), (1.15, ["the second half of the data"])])
def test_a_coefficient_that_changes_with_time_is_told(last, told):
    t = np.linspace(0, 40, 600)

    def slope(t, x):
        return [x[1], np.interp(t, (0, 40), (1, last)) * (1 - x[0] ** 2) * x[1] - x[0]]

    x = solve_ivp(slope, (0, 40), (2, 0), t_eval=t, rtol=1e-8).y.T
    assert differing(discover(t, add_noise(x, 0.05, np.random.default_rng(1)), order=1)) == told


@pytest.mark.parametrize("place", [0.007, 0.0])
def test_an_origin_a_little_off_that_of_the_data_is_doubted_where_errors_are_small(place):
    # Less than a hundredth of the spread: nothing at the errors that the search tolerates.
    truth, found = moved("WangSun", (place, -1.47, 1.87), corruption.quantise, 1 / 64)
    assert score(found, truth).exact == (place == 0)
    assert ("the law's origin is in x: " in " ".join(found.warnings)) == (place != 0)


def test_an_axis_is_not_at_home_for_the_asking_where_others_have_left():
    # Around another origin of z than that of the data the same law has x in dy/dt.
    truth, found = moved("Chen", (13.8, 9.0, 4.05), add_noise, 0.2, 1)
    assert not score(found, truth).exact
    assert found.offset[2] == 0
    told = " ".join(found.warnings)
    assert "the law's origin is in z: other terms around another" in told


TIMES = np.linspace(0, 20, 600)
WORDS = "terms that the law has not explain what it leaves"


def swung(pull, start):
    """Positions of a body that a law of second order moves."""
    return moving(pull, [start], [0], TIMES)


@pytest.mark.parametrize(
    ("pull", "start", "share", "words"),
    [
        (lambda x, v: -9.81 * np.sin(x) - 0.2 * v, 1.6, 0.0, f"{WORDS} (x^5 in dvx/dt"),
        (lambda x, v: -9.81 * np.sin(x) - 0.2 * v, 1.6, 0.01, WORDS),
        (lambda x, v: -3 * x / (1 + x**2) - 0.05 * v, 2.0, 0.05, ""),
        (lambda x, v: -x + 1.5 * (1 - x**2) * v, 0.5, 0.0, None),
        (lambda x, v: -x + 1.5 * (1 - x**2) * v, 0.5, 0.05, None),
    ],
)
def test_a_cubic_for_another_function_is_doubted_and_a_true_law_is_not(pull, start, share, words):
    told = discover(TIMES, noisy(swung(pull, start), share, seed=3), order=2).warnings
    assert any((WORDS if words is None else words) in w for w in told) == (words is not None)


@pytest.mark.parametrize(("number", "status"), [*((n, "suspect") for n in (4, 8, 13)), (12, "ok")])
def test_a_way_to_rest_on_a_line_is_doubted_where_higher_terms_explain_what_is_left(number, status):
    data = OdeContest(number).data()  # an exponential, a cubic with a small error, a sine; a cubic
    assert discover(data.t, data.x).status == status


def test_a_rival_of_higher_degree_is_told():
    data = OdeContest(16, noise=0.02).data()  # of degree five, which a cubic imitates
    assert any("law may" in w and "x^5" in w for w in discover(data.t, data.x).warnings)


def test_a_rival_is_told_where_errors_last_and_a_small_term_is_lost():
    """Selkov's oscillator: without its constant all other coefficients are many errors off."""
    terms = {"x": {"1": 0.05, "x": -1, "y": 0.1, "x^2y": 1}, "y": {"1": 0.5, "y": -0.1, "x^2y": -1}}
    t, law = np.linspace(0, 40, 400), PolynomialSystem.from_terms(terms)
    x = corruption.add_correlated_noise(law.simulate(t, (0.3, 1.5)), 0.03, np.random.default_rng(0))
    assert "with a constant in dx/dt" in " ".join(discover(t, x).warnings)


@pytest.mark.parametrize(("degree", "status"), [(1, "suspect"), (3, "ok")])
def test_a_numerator_that_lacks_a_term_is_no_motion_that_is_kicked(degree, status):
    """Drag over 1 + x^2 needs x^2 vx there; without it, what is missed looks like kicks."""
    paths = [swung(lambda x, v: -3 * x / (1 + x**2) - 0.1 * v, start) for start in (3.0, 1.5)]
    runs = [(TIMES, noisy(x, 0.01, seed)) for seed, x in enumerate(paths)]
    library = Library.polynomial(degree) + Library.rational(2)
    found = discover(runs, library=library, order=2)
    assert found.status == status
    if status == "suspect":
        assert any(f"{WORDS} (x^2 vx in dvx/dt" in warning for warning in found.warnings)
    else:
        assert found.system.text(1) == "x'' = (-3 x - 0.1 vx - 0.1 x^2 vx) / (1 + x^2)"


def test_a_channel_that_is_late_is_told_with_its_lag():
    system = PolynomialSystem.from_terms({"x": {"y": 1.0}, "y": {"x": -1.0, "x^2 y": -0.8}})
    fine = system.simulate(np.linspace(0, 20, 3001), np.array([1.0, 0.0]))
    t = np.linspace(0, 20, 301)[1:]
    late = "less if (x was measured at least 0.4 of a step later|y .* earlier)"
    for lag, words in ((4, late), (0, "^$")):
        x = np.column_stack([fine[10 - lag : 3001 - lag : 10, 0], fine[10::10, 1]])
        found = discover(t, noisy(x, 0.005), degree=3)
        assert re.search(words, " ".join(found.warnings))


def test_a_function_that_is_a_monomial_is_no_rival_of_itself():
    pull = {"pull": lambda x: x, "slow": lambda vx: vx}
    x = noisy(swung(lambda x, v: -4 * x - 0.1 * v, 1.5), 0.02)
    found = discover(TIMES, x, order=2, library=Library.terms(pull))
    assert found.system.text(1) == "x'' = -4 pull - 0.1 slow"
    assert found.status == "ok"
