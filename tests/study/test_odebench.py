"""ODEBench as it is published: its numbers, its kinds, what its formulas say."""

import numpy as np
import pytest

from vidsindy_lite.study import ODEBENCH
from vidsindy_lite.study.odebench import TIMES, formula


def test_it_is_complete():
    assert list(ODEBENCH) == list(range(1, 64))
    dimensions = [len(one.starts[0]) for one in ODEBENCH.values()]
    assert [dimensions.count(d) for d in (1, 2, 3, 4)] == [23, 28, 10, 2]
    degrees = [e.law.exponents.sum(axis=1).max() for e in ODEBENCH.values() if e.law is not None]
    assert len(degrees) == 37
    assert sum(degree <= 3 for degree in degrees) == 35
    assert len({equation.name for equation in ODEBENCH.values()}) == 63


@pytest.mark.parametrize("number", ODEBENCH)
def test_every_equation_moves_from_both_starts(number):
    equation = ODEBENCH[number]
    assert len(set(equation.starts)) == 2
    for start in equation.starts:
        rate = equation.rate(np.array(start))
        assert rate.shape == (len(start),)
        assert np.isfinite(rate).all()
        assert rate.any()


def test_terms_are_what_the_textbooks_print():
    logistic, lorenz = ODEBENCH[3].law, ODEBENCH[56].law
    assert dict(zip(logistic.terms, logistic.coefficients[:, 0], strict=True)) == pytest.approx(
        {"1": 0, "x": 0.79, "x^2": -0.79 / 74.3}
    )
    x, y, z = start = np.array(ODEBENCH[56].starts[0])
    expected = [10 * (y - x), x * (28 - z) - y, x * y - 8 / 3 * z]
    np.testing.assert_allclose(lorenz(start), expected)
    allee = ODEBENCH[8]
    x = 6.123
    np.testing.assert_allclose(allee.rate(np.array([x])), 0.14 * x * (1 - x / 130) * (x / 4.4 - 1))
    x, y = start = np.array([5.0, 0.7])
    expected = [-np.sin(y) - 0.08 * x**2, x - np.cos(y) / x]
    np.testing.assert_allclose(ODEBENCH[33].rate(start), expected)


def test_a_solution_that_is_known():
    law = ODEBENCH[2].law
    np.testing.assert_allclose(
        law.simulate(TIMES, (4.78,))[:, 0], 4.78 * np.exp(0.23 * TIMES), rtol=1e-9
    )


def test_formulas():
    assert formula("-a**2/4 + 2*(1 - b)", {"a": 2, "b": 3}) == -5
    assert formula("exp(0) + abs(-2)", {}) == 3
    for bad in ("c", "a.b", "open('x')", "a if b else 1", "'a'", "__import__"):
        with pytest.raises(ValueError, match="text: must be a formula of a, b, got"):
            formula(bad, {"a": 1, "b": 2})
