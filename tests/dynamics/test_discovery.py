"""The report of a fit: units, error bars, frames, pruning."""

import numpy as np
import pytest

from vidsindy_lite.dynamics.discovery import _pruned
from vidsindy_lite.dynamics.library import monomial_exponents
from vidsindy_lite.dynamics.polynomials import PolynomialSystem
from vidsindy_lite.dynamics.problem import Units
from vidsindy_lite.dynamics.solver import discover
from vidsindy_lite.study import add_noise


@pytest.fixture(scope="module")
def found():
    truth = PolynomialSystem.from_terms({"x": {"y": 2}, "y": {"x": -1, "y": -0.1}}).shift(
        (5.0, 0.0)
    )
    t = np.linspace(0, 20, 300)
    x = add_noise(truth.simulate(t, (6.0, 0.0)), 0.02, np.random.default_rng(0))
    return discover(t, x, degree=2)


def test_units_turn_a_law_back():
    """A law in standard units, rescaled, is the law of the rescaled trajectory."""
    rng = np.random.default_rng(0)
    exponents = monomial_exponents(2, 3)
    coefficients = rng.normal(size=(10, 2))
    units = Units(np.zeros(2), np.array([3.0, 0.2]), 7.0)
    law = PolynomialSystem(("x", "y"), exponents, coefficients * units.factors(exponents))
    standard = PolynomialSystem(("x", "y"), exponents, coefficients)
    z = rng.normal(size=2)
    np.testing.assert_allclose(law(units.point(z)), standard(z) * units.scale / units.time)


def test_equations_show_errors_in_both_frames(found):
    assert "±" in found.equations()
    assert found.equations("data") != found.equations("native")
    assert found.equations("native").count("±") == found.native.support.sum()
    with pytest.raises(ValueError, match="frame: must be 'data' or 'native', got 'reference'"):
        found.equations("reference")


def test_errors_are_zero_exactly_where_there_is_no_term(found):
    assert ((found.standard_errors > 0) == found.system.support).all()
    assert ((found.native_standard_errors > 0) == found.native.support).all()


def test_covariance_of_the_shift_is_carried_along(found):
    """The constant in the frame of the data is minus the slope times the offset."""
    x, one = found.terms.index("x"), found.terms.index("1")
    ratio = found.coefficients[one, 1] / found.coefficients[x, 1]
    assert ratio == pytest.approx(-found.offset[0], rel=1e-9)
    slope, constant = found.coefficients[[x, one], 1]
    rows = [6 + x, 6 + one]  # second equation of a library of six terms
    covariance = found.covariance[np.ix_(rows, rows)]
    gradient = np.array([constant / slope**2, -1 / slope])
    assert np.sqrt(gradient @ covariance @ gradient) == pytest.approx(
        found.offset_errors[0], rel=1e-6
    )


def test_pruning_conditions_on_zero():
    covariance = np.array([[1.0, 0.8], [0.8, 4.0]])
    kept, left, margins = _pruned(np.array([[0.5], [20.0]]), covariance, np.array([9.0, 9.0]))
    assert kept[0, 0] == 0
    assert kept[1, 0] == pytest.approx(20.0 - 0.8 * 0.5)
    assert left[1, 1] == pytest.approx(4.0 - 0.8**2)
    assert not left[0].any()
    np.testing.assert_allclose(margins, [9 - 0.5**2, 19.6**2 / 3.36 - 9])


def test_pruning_keeps_what_is_significant():
    coefficients = np.array([[4.0], [20.0]])
    kept, left, margins = _pruned(coefficients, np.eye(2), np.array([9.0, 9.0]))
    assert (kept == coefficients).all()
    assert (left == np.eye(2)).all()
    np.testing.assert_allclose(margins, [16 - 9, 400 - 9])


def test_text_holds_the_warnings():
    t = np.linspace(0, 2, 200)
    x = np.stack([np.sin(t), np.cos(t)], axis=1)
    short = discover(t, add_noise(x, 0.05, np.random.default_rng(0)))
    assert "warning: the trajectory covers only" in str(short)
