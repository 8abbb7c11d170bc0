"""Exact changes of frame, and the search for the sparsest one."""

import numpy as np
import pytest
from scipy.optimize import check_grad

from vidsindy_lite.dynamics.library import closure_mask, monomial_exponents
from vidsindy_lite.dynamics.origin import ShiftedLaw, _starts, sparse_origins
from vidsindy_lite.dynamics.polynomials import PolynomialSystem
from vidsindy_lite.study import SYSTEMS


def algebra(law, relative_error):
    size = law.coefficients.size
    return ShiftedLaw(law.exponents, law.coefficients, np.eye(size) / relative_error**2)


def test_coefficients_in_another_frame_are_those_of_the_shift():
    law = SYSTEMS["WangSun"]
    origin = np.array([1.0, -2.0, 0.5])
    coefficients, _, _ = algebra(law, 0.1).at(origin)
    np.testing.assert_allclose(coefficients, law.shift(-origin).coefficients, atol=1e-12)


def test_information_in_another_frame_keeps_the_quadratic_form():
    rng = np.random.default_rng(0)
    exponents = monomial_exponents(2, 2)
    factor = rng.normal(size=(12, 12))
    frames = ShiftedLaw(exponents, rng.normal(size=(6, 2)), factor.T @ factor)
    delta = rng.normal(size=(6, 2))
    moved = ShiftedLaw(exponents, frames.coefficients + delta, frames.information)
    origin = np.array([0.3, -1.2])
    difference = (moved.at(origin)[0] - frames.at(origin)[0]).T.ravel()
    expected = delta.T.ravel() @ frames.information @ delta.T.ravel()
    assert difference @ frames.at(origin)[1] @ difference == pytest.approx(expected)


def test_gradient_of_the_smooth_count():
    law = SYSTEMS["Lorenz"].shift((0.3, -0.4, 0.8))
    frames = algebra(law, 0.3)
    active = np.ones(law.coefficients.shape, dtype=bool)
    for point in np.random.default_rng(0).normal(size=(5, 3)):
        error = check_grad(
            lambda o: frames.smooth_count(o, active, 9.0)[0],
            lambda o: frames.smooth_count(o, active, 9.0)[1],
            point,
        )
        assert error < 1e-4


@pytest.mark.parametrize("name", ["SprottE", "SprottF", "NoseHoover", "WangSun"])
@pytest.mark.parametrize("relative_error", [1e-6, 1e-2])
def test_the_native_frame_is_found(name, relative_error):
    offset = np.array([1.3, -0.7, 0.0])
    law = SYSTEMS[name].shift(offset)
    active = closure_mask(law.exponents, law.support)
    box = (np.full(3, -3.0), np.full(3, 3.0))
    rng = np.random.default_rng(0)
    frames = algebra(law, relative_error)
    origins = sparse_origins(frames, active, np.zeros(3), box, 12.0, keep=4, rng=rng)
    counts = [frames.smooth_count(origin, active, 12.0)[0] for origin in origins]
    assert counts[0] == min(counts)
    assert counts[0] <= SYSTEMS[name].support.sum() + 1e-6


def test_a_linear_law_has_its_fixed_point_as_origin():
    law = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1, "y": -0.2}}).shift((2.0, 1.0))
    box = (np.full(2, -3.0), np.full(2, 3.0))
    origins = sparse_origins(
        algebra(law, 1e-3), law.support, np.zeros(2), box, 12.0, 4, np.random.default_rng(0)
    )
    assert min(np.abs(o - (2.0, 1.0)).max() for o in origins) < 0.01


def test_the_count_is_that_of_significant_terms():
    """Each term counts z^2 / (z^2 + penalty), with z its value over its standard error."""
    law = PolynomialSystem.from_terms({"x": {"1": 3.0, "x": -1.0, "x^2": 0.5}})
    information = np.diag([4.0, 1.0, 100.0])
    frames = ShiftedLaw(law.exponents, law.coefficients, information)
    scores = np.array([36.0, 1.0, 25.0])
    active = np.array([[True], [True], [False]])
    count, _ = frames.smooth_count(np.zeros(1), active, 9.0)
    assert count == pytest.approx((scores / (scores + 9))[:2].sum(), rel=1e-9)


def test_coefficients_are_made_to_vanish():
    law = SYSTEMS["SprottF"].shift((0.4, -0.3, 0.2))
    frames = algebra(law, 0.1)
    entries = np.argwhere((law.support & ~SYSTEMS["SprottF"].support).T)
    origin = frames.vanish(np.zeros((1, 3)), entries[None])[0]
    left = frames.at(origin)[0].T[tuple(entries.T)]
    np.testing.assert_allclose(left, 0, atol=1e-8)
    (moved,) = frames.vanish(np.array([[0.4, -0.3, 0.2]]), entries[None])
    np.testing.assert_allclose(moved, (0.4, -0.3, 0.2), atol=1e-12)


def test_a_coefficient_that_cannot_vanish_leaves_no_origin_or_a_finite_one():
    law = PolynomialSystem.from_terms({"x": {"1": 1.0, "x^2": 1.0}})  # no real root
    origin = algebra(law, 0.1).vanish(np.array([[0.5]]), np.array([[[0, 0]]]))
    assert np.isnan(origin).all() or np.abs(origin).max() < 1e6


def test_origins_are_distinct_within_the_box_and_best_first():
    law = SYSTEMS["Lorenz"].shift((0.5, 0.2, 0.0))
    active = closure_mask(law.exponents, law.support)
    low, high = np.full(3, -1.0), np.full(3, 1.0)
    frames, rng = algebra(law, 1e-3), np.random.default_rng(0)
    origins = sparse_origins(frames, active, np.zeros(3), (low, high), 12.0, keep=3, rng=rng)
    assert 1 <= len(origins) <= 3
    counts = [frames.smooth_count(origin, active, 12.0)[0] for origin in origins]
    assert counts == sorted(counts)
    for i, origin in enumerate(origins):
        assert (origin >= low).all()
        assert (origin <= high).all()
        assert all(np.abs(origin - other).max() > 0.02 for other in origins[:i])


def test_some_first_origins_make_as_many_coefficients_vanish_as_there_are_axes():
    offset = np.array([1.3, -0.7, 0.4])
    law = SYSTEMS["Lorenz"].shift(offset)
    active = closure_mask(law.exponents, law.support)
    box = (np.full(3, -2.0), np.full(3, 2.0))
    starts = _starts(algebra(law, 1e-3), active, np.zeros(3), box, np.random.default_rng(0))
    # On xz and xy hang both constants and the terms in y and z: three of them fix the origin.
    assert min(np.abs(start - offset).max() for start in starts) < 1e-6
    assert len(starts) > 100
