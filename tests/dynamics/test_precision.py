"""Measurements are weighed by the errors that a law leaves them: against known variances."""

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite.dynamics import PolynomialSystem
from vidsindy_lite.dynamics import noise as weighing
from vidsindy_lite.dynamics.library import Library
from vidsindy_lite.dynamics.model import Form
from vidsindy_lite.dynamics.problem import pose

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


def posed(x):
    data = [(TIMES, x)]
    nothing = [np.empty((*x.shape, 0))]
    return pose(data, nothing, Form.of(("x", "y"), Library.polynomial(3)), np.random.default_rng(0))


def test_the_noise_is_that_of_the_errors_where_they_are_as_usual():
    """By how much weighted errors are smaller than all, so much the noise shrinks."""
    x, _ = uneven("growing", np.random.default_rng(2))
    problem = posed(x)
    found = weighing.smoother_weights(problem)
    factors = found.precision[0] / problem.precision[0]
    assert np.ptp(factors, axis=0).min() > 0.5
    ((_, (t, data)),) = problem.stretches
    squares = (problem.curves[0](t) - data) ** 2
    smaller = np.mean(factors * squares, axis=0) / np.mean(squares, axis=0)
    np.testing.assert_allclose(found.noise, problem.noise * np.sqrt(smaller))


def test_noise_that_looks_even_before_a_law_is_known_stays_even():
    even = posed(PATH + 0.05 * np.random.default_rng(6).standard_normal(PATH.shape))
    assert weighing.smoother_weights(even) is even
    exact = posed(PATH)
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


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("n", [2, 9])
def test_fewer_errors_than_stretches_have_precisions_too(n):
    residual = np.random.default_rng(n).standard_normal(n)
    precision = weighing._factors(residual, [np.linspace(1, 2, n)])
    assert precision.shape == (n,)
    assert (np.isfinite(precision) & (precision >= 0)).all()


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
