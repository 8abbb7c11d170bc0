"""The Cramer-Rao bound against closed forms and against what the solver reports."""

import numpy as np
import pytest

from vidsindy_lite.dynamics.model import PolynomialSystem
from vidsindy_lite.dynamics.solver import discover
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, add_noise, cramer_rao_bound


def test_decay_agrees_with_its_closed_form():
    t = np.linspace(0, 3, 60)
    bound = cramer_rao_bound(PolynomialSystem.from_terms({"x": {"x": -1.0}}), t, [2.0], [0.1])
    jacobian = np.stack([2 * t * np.exp(-t), np.exp(-t)], axis=1) / 0.1
    errors = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    assert bound.coefficients[1, 0] == pytest.approx(errors[0], rel=1e-6)


def test_an_unknown_origin_agrees_with_its_closed_form():
    """x = c + a exp(-k t) around an unknown c."""
    t = np.linspace(0, 3, 60)
    law = PolynomialSystem.from_terms({"x": {"x": -1.0}})
    bound = cramer_rao_bound(law, t, [2.0], [0.1], moving=[True])
    jacobian = np.stack([-2 * t * np.exp(-t), np.exp(-t), np.ones_like(t)], axis=1) / 0.1
    errors = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    assert bound.coefficients[1, 0] == pytest.approx(errors[0], rel=1e-5)
    assert bound.offset[0] == pytest.approx(errors[2], rel=1e-5)


def test_a_nonlinear_law_in_the_plane_agrees_with_differences():
    """A damped hardening spring, each coordinate with its own noise."""
    terms = {"x": {"y": 1.1}, "y": {"x": -0.7, "y": -0.2, "x^3": -0.4}}
    law, t, sigma = PolynomialSystem.from_terms(terms), np.linspace(0, 6, 50), np.array([0.1, 0.03])
    bound = cramer_rao_bound(law, t, [1.2, 0.3], sigma)

    def path(p):
        own = {"x": {"y": p[2]}, "y": {"x": p[3], "y": p[4], "x^3": p[5]}}
        system = PolynomialSystem.from_terms(own)
        return (system.simulate(t, p[:2]) / sigma).ravel()

    truth = np.array([1.2, 0.3, 1.1, -0.7, -0.2, -0.4])
    jacobian = np.stack(
        [(path(truth + h) - path(truth - h)) / 2e-5 for h in 1e-5 * np.eye(6)], axis=1
    )
    errors = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    at = law.terms.index
    ours = [bound.coefficients[at("y"), 0]]
    ours += [bound.coefficients[at(term), 1] for term in ("x", "y", "x^3")]
    np.testing.assert_allclose(ours, errors[2:], rtol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Lorenz", "WangSun"])
def test_standard_errors_of_a_discovery_are_the_bound(name):
    system = SYSTEMS[name]
    t, x = system.shift(REFERENCE_OFFSET).trajectory(600)
    found = discover(t, add_noise(x, 0.05, np.random.default_rng(2)))
    moving = np.array([True, True, False])
    bound = cramer_rao_bound(system, t, system.x0, 0.05 * x.std(axis=0), moving)
    assert (found.native.support == system.support).all()
    ratio = found.native_standard_errors[system.support] / bound.coefficients[system.support]
    assert (np.abs(np.log(ratio)) < np.log(1.3)).all()
    assert found.offset_errors[moving] == pytest.approx(bound.offset[moving], rel=0.3)
