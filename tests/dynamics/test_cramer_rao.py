"""The Cramer-Rao bound against closed forms and against what the solver reports."""

import numpy as np
import pytest

from vidsindy_lite.dynamics.cramer_rao import cramer_rao
from vidsindy_lite.dynamics.polynomials import PolynomialSystem
from vidsindy_lite.dynamics.solver import discover
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, add_noise

pytestmark = pytest.mark.slow  # discovers


def test_constant_drift_is_a_straight_line_fit():
    drift = PolynomialSystem.from_terms({"x": {"1": 2.0}})
    t = np.linspace(0, 5, 40)
    bound = cramer_rao(drift, t, [1.0], [0.3])
    slope_error = 0.3 / np.sqrt(((t - t.mean()) ** 2).sum())
    assert bound.coefficients[0, 0] == pytest.approx(slope_error, rel=1e-6)


def test_decay_agrees_with_its_closed_form():
    t = np.linspace(0, 3, 60)
    bound = cramer_rao(PolynomialSystem.from_terms({"x": {"x": -1.0}}), t, [2.0], [0.1])
    jacobian = np.stack([2 * t * np.exp(-t), np.exp(-t)], axis=1) / 0.1
    errors = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    assert bound.coefficients[1, 0] == pytest.approx(errors[0], rel=1e-6)


@pytest.mark.parametrize("name", ["Lorenz", "WangSun"])
def test_standard_errors_of_a_discovery_are_the_bound(name):
    system = SYSTEMS[name]
    t, x = system.shift(REFERENCE_OFFSET).trajectory(600)
    found = discover(t, add_noise(x, 0.05, np.random.default_rng(2)))
    moving = np.array([True, True, False])
    bound = cramer_rao(system, t, system.x0, 0.05 * x.std(axis=0), moving)
    assert (found.native.support == system.support).all()
    ratio = found.native_standard_errors[system.support] / bound.coefficients[system.support]
    assert (np.abs(np.log(ratio)) < np.log(1.3)).all()
    assert found.offset_errors[moving] == pytest.approx(bound.offset[moving], rel=0.3)
