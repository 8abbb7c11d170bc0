"""What candidate terms could be that are not in a law."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

import vidsindy_lite as vl
from vidsindy_lite import Library, PolynomialSystem
from vidsindy_lite.dynamics.l0 import newcomers
from vidsindy_lite.dynamics.result import unseen

T = np.linspace(0, 20, 200)
ALLOWED = {"x": {"y": None, "x^2": None, "...": 0}}


def spring(weak=0.0):
    terms = {"x": {"y": 2}, "y": {"x": -1, "y": -0.1, "x^2": weak}}
    return PolynomialSystem.from_terms(terms, degree=2)


def found(law, seed, library=None, noise=0.05):
    x = law.simulate(T, (1.0, 0.0))
    x += noise * np.random.default_rng([9, seed]).normal(size=x.shape)
    return vl.discover(T, x, library=library or Library.polynomial(2), origin="data")


@settings(max_examples=10)
@given(st.integers(0, 10**6))
def test_a_newcomer_is_what_least_squares_gives_it(seed):
    rng = np.random.default_rng(seed)
    columns, values = rng.normal(size=(30, 5)), rng.normal(size=30)
    estimate, variance = newcomers(columns.T @ columns, columns.T @ values, 3)
    for k in (3, 4):
        joined = columns[:, [0, 1, 2, k]]
        assert estimate[k - 3] == pytest.approx(np.linalg.lstsq(joined, values)[0][-1], rel=1e-6)
        assert variance[k - 3] == pytest.approx(np.linalg.inv(joined.T @ joined)[-1, -1], rel=1e-6)


def test_intervals_hold_what_is_absent():
    """Nothing, and a term too weak to be found."""
    covered, weak = [], []
    for seed in range(4):
        one = found(spring(), seed).absent
        inside = (one[..., 0] <= 0) & (one[..., 1] >= 0)
        covered.append(inside[np.isfinite(one[..., 0])].mean())
        low, high = found(spring(0.03), seed).absent[3, 1]
        weak.append(low <= 0.03 <= high)
    assert np.mean(covered) > 0.85
    assert np.mean(weak) > 0.6


def test_what_is_there_or_is_no_candidate_has_no_interval(tmp_path):
    law = found(spring(), 0, Library.polynomial(2).where(ALLOWED))
    known = np.isnan(law.absent[..., 0])
    assert known[:, 0].tolist() == [True, True, True, False, True, True]  # x^2 alone is searched
    assert (known[:, 1] == law.native.support[:, 1]).all()
    law.save(tmp_path / "law.json")
    again = vl.Discovery.load(tmp_path / "law.json")
    np.testing.assert_array_equal(again.absent, law.absent)


def test_a_term_that_may_be_as_large_as_one_of_the_law_is_named():
    law = PolynomialSystem.from_terms({"x": {"x": -2}}, degree=2)
    path = BSpline(np.array([0, 0, 1, 2, 2.0]), np.array([[1.0], [-1.0], [1.0]]), 1)
    absent = np.full((3, 1, 2), np.nan)
    absent[0], absent[2] = (-1.9, 1.0), (-0.5, 2.5)
    assert list(unseen(law, np.zeros(1), [path], absent)) == ["x^2 in dx/dt (-0.5 to 2.5)"]
    absent[0] = -np.inf, np.inf
    assert list(unseen(law, np.zeros(1), [path], absent))[0] == "a constant in dx/dt (of any size)"
    absent[:] = 0
    assert not list(unseen(law, np.zeros(1), [path], absent))


def test_only_data_that_tell_little_leave_terms_unseen():
    assert "not seen" not in str(found(spring(), 0))
    t = T[:30]  # half a turn
    x = spring().simulate(t, (1.0, 0.0)) + 0.02 * np.random.default_rng(0).normal(size=(30, 2))
    short = vl.discover(t, x, degree=2)
    assert "not seen, though they may be as large as terms of the law: " in str(short)
