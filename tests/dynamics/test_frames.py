"""Exact changes of frame."""

import numpy as np
import pytest

from vidsindy_lite.dynamics.frames import ShiftedLaw
from vidsindy_lite.dynamics.library import monomial_exponents
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


def test_coefficients_are_made_to_vanish():
    law = SYSTEMS["SprottF"].shift((0.4, -0.3, 0.2))
    frames = algebra(law, 0.1)
    entries = np.argwhere((law.support & ~SYSTEMS["SprottF"].support).T)
    origin = frames.vanish(np.zeros((1, 3)), entries[None])[0]
    left = frames.at(origin)[0].T[tuple(entries.T)]
    np.testing.assert_allclose(left, 0, atol=1e-8)
    (moved,) = frames.vanish(np.array([[0.4, -0.3, 0.2]]), entries[None])
    np.testing.assert_allclose(moved, (0.4, -0.3, 0.2), atol=1e-12)
