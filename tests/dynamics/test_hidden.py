"""Coordinates that nobody saw, and that a known equation tells."""

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite import Library, PolynomialSystem, study

OSCILLATOR = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -4, "y": -0.1, "x^3": -1}})
TIED = Library.polynomial(3).where({"x": {"y": 1, "...": 0}})
T = np.linspace(0, 20, 1000)


def without(x, column, noise=0.0):
    """States of which one coordinate was never seen."""
    x = x + noise * x.std(axis=0) * np.random.default_rng(0).normal(size=x.shape)
    x[:, column] = np.nan
    return x


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_a_velocity_that_nobody_saw(noise):
    found = vl.discover(T, without(OSCILLATOR.simulate(T, [1.5, 0]), 1, noise), library=TIED)
    assert study.score(found.system, OSCILLATOR).exact
    assert found.status == "ok"
    assert np.isnan(found.noise).tolist() == [False, True]


def test_a_coordinate_between_others_is_told_by_a_sum():
    lorenz = PolynomialSystem.from_terms(
        {"x": {"x": -10, "y": 10}, "y": {"x": 28, "y": -1, "xz": -1}, "z": {"xy": 1, "z": -8 / 3}}
    )
    library = Library.polynomial(2).where({"x": {"x": -10, "y": 10, "...": 0}})
    t = np.arange(1500) * 0.02
    found = vl.discover(t, without(lorenz.simulate(t, [-8, 7, 27]), 1, 0.01), library=library)
    assert study.score(found.system, lorenz).exact
    errors = found.standard_errors
    far = np.abs(found.coefficients - lorenz.coefficients)[errors > 0] / errors[errors > 0]
    assert far.max() < 4


@pytest.mark.parametrize(
    ("library", "order", "words"),
    [
        (Library.polynomial(3), 1, "told by an equation that is known, .* got none for y"),
        (Library.polynomial(3), 2, "order 2 every position must be seen, got none of y"),
        (Library.polynomial(3).where({"y": {"x": 1, "...": 0}}), 1, "got none for y"),
        (Library.polynomial(3).where({"x": {"y^2": 1, "...": 0}}), 1, "got none for y"),
        (Library.polynomial(3).where({"x": {"y": 1, "xy": 1, "...": 0}}), 1, "got none for y"),
    ],
)
def test_what_no_equation_tells_is_refused(library, order, words):
    x = without(OSCILLATOR.simulate(T, [1.5, 0]), 1)
    with pytest.raises(ValueError, match=words) as refused:
        vl.discover(T, x, library=library, order=order)
    assert "\n" not in str(refused.value)


def test_seen_in_one_trajectory_and_not_in_another():
    x = OSCILLATOR.simulate(T, [1.5, 0])
    with pytest.raises(ValueError, match="in all trajectories or in none, got column 1 .* 1$"):
        vl.discover([(T, x), (T, without(x, 1))], library=TIED)
