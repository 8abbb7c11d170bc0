"""Scores against hand-counted cases, and the Cramer-Rao bound against closed forms."""

from types import SimpleNamespace

import numpy as np
import pytest

from vidsindy_lite.dynamics import Library, PolynomialSystem
from vidsindy_lite.study import cramer_rao_bound
from vidsindy_lite.study.metrics import pulls, score, term_errors, trajectory_error

TRUTH = PolynomialSystem.from_terms({"x": {"x": 3}, "y": {"xy": -4, "1": 1}})


def test_counts_and_errors_of_a_case_done_by_hand():
    found = PolynomialSystem.from_terms({"x": {"x": 3.3, "y": 2}, "y": {"xy": -4}}, degree=3)
    result = score(found, TRUTH)
    assert (result.terms_found, result.exact) == (False, False)
    assert (result.false_positives, result.missing) == (1, 1)
    assert (result.precision, result.recall) == pytest.approx((2 / 3, 2 / 3))
    assert result.l2 == pytest.approx(np.sqrt((0.3**2 + 2**2 + 1) / 26))
    seen = result.coefficient_errors
    errors = {(TRUTH.terms[i], j): seen[i, j] for i, j in np.argwhere(~np.isnan(seen)).tolist()}
    assert errors == pytest.approx({("x", 0): 0.1, ("xy", 1): 0.0, ("1", 1): 1.0})
    assert result.max_coefficient_error == pytest.approx(1.0)
    assert term_errors(found, TRUTH) == (["1 in dy/dt"], ["y in dx/dt"])
    assert term_errors(TRUTH, TRUTH) == ([], [])


def test_trajectory_error_of_a_known_displacement():
    t = np.linspace(0, 2 * np.pi, 1000, endpoint=False)
    truth = np.stack([5 * np.sin(t), np.cos(t), 0 * t], axis=1)
    x = truth + [0.5, -0.1, 0.2]
    x[100:200] = x[300, 1] = np.nan
    np.testing.assert_allclose(trajectory_error(x, truth), [0.5, 0.1, 0.2])


def test_pulls_of_the_true_terms_that_were_found():
    law = PolynomialSystem.from_terms({"x": {"x": 3.3, "y": 2}, "y": {"xy": -4.2}}, degree=3)
    errors = np.where(law.support, 0.1, 0.0)
    found = SimpleNamespace(system=law, coefficients=law.coefficients, standard_errors=errors)
    np.testing.assert_allclose(np.sort(pulls(found, TRUTH)), [-2, 3])


NOTHING = PolynomialSystem(TRUTH.names, TRUTH.exponents, 0 * TRUTH.coefficients)
SINE = PolynomialSystem.from_terms({"x": {"sin(x)": -1.0}}, library=Library.fourier())
TURNED = PolynomialSystem(("y", "x"), TRUTH.exponents[:, ::-1], TRUTH.coefficients[:, ::-1])
LINE = PolynomialSystem.from_terms({"x": {"x": -1.0}})
ENZYME = PolynomialSystem.from_terms({"x": {"x x'": -2.0}}, library=Library.rational(1))


def test_nothing_found():
    result = score(NOTHING, TRUTH)
    assert (result.precision, result.recall, result.missing) == (0, 0, 3)
    assert (result.l2, np.nanmin(result.coefficient_errors)) == (pytest.approx(1), 1)
    text = "3 terms missing, 0 false; relative l2 1, worst coefficient 1, precision 0%, recall 0%"
    assert str(result) == text
    assert (score(SINE, SINE).terms_found, score(dragged(1), dragged(1)).exact) == (True, True)


def dragged(power):
    known = Library.terms({"drag": lambda x: np.abs(x) ** power * x})
    return PolynomialSystem.from_terms({"x": {"drag": -1}}, library=known)


@pytest.mark.parametrize(
    ("compare", "one", "other", "message"),
    [
        (score, LINE, TRUTH, "found: must have the variables of truth, .'x', 'y'., got .'x',"),
        (score, TURNED, TRUTH, "found: must have the variables of truth, .'x', 'y'., got .'y'"),
        (pulls, SimpleNamespace(system=TURNED), TRUTH, "truth, .'x', 'y'., got .'y', 'x'"),
        (score, TRUTH, NOTHING, "truth: must have at least one term"),
        (score, 1, TRUTH, r"found: must be a PolynomialSystem \(.*\), got 1"),
        (score, TRUTH, SimpleNamespace(system=TRUTH), "truth: must be a Poly.*found comes first"),
        (score, LINE, SINE, "found: must have a library with the functions"),
        (score, LINE, ENZYME, "found: must have a library with the functions"),
        (score, dragged(1), dragged(3), "found: must have a library with the functions"),
        (trajectory_error, np.zeros((3, 2)), np.zeros((4, 2)), r"x: must have the shape of truth"),
        (trajectory_error, np.full((4, 2), np.nan), np.zeros((4, 2)), "x: must hold at least one"),
    ],
)
def test_what_cannot_be_compared_is_refused(compare, one, other, message):
    with pytest.raises(ValueError, match=message):
        compare(one, other)


def test_an_unknown_origin_agrees_with_its_closed_form():
    t = np.linspace(0, 3, 60)
    law = PolynomialSystem.from_terms({"x": {"x": -1.0}})
    bound = cramer_rao_bound(law, t, [2.0], [0.1], moving=[True])
    jacobian = np.stack([-2 * t * np.exp(-t), np.exp(-t), np.ones_like(t)], axis=1) / 0.1
    errors = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    assert bound.coefficients[1, 0] == pytest.approx(errors[0], rel=1e-5)
    assert bound.offset[0] == pytest.approx(errors[2], rel=1e-5)
    moving = PolynomialSystem.from_terms({"x": {"vx": 1}, "vx": {"x": -1}})
    known = cramer_rao_bound(moving, t, [1, 0], [0.1, 1e6]).coefficients  # that x' = vx
    assert (known > 0).sum() == 1
    with pytest.raises(ValueError, match="sigma: must be positive"):
        cramer_rao_bound(moving, t, [1, 0], [0.1, 0])


def test_a_nonlinear_law_in_the_plane_agrees_with_differences():
    terms = {"x": {"y": 1.1}, "y": {"x": -0.7, "y": -0.2, "x^3": -0.4}}
    law, t, sigma = PolynomialSystem.from_terms(terms), np.linspace(0, 6, 50), np.array([0.1, 0.03])
    bound = cramer_rao_bound(law, t, [1.2, 0.3], sigma)

    def path(p):
        own = {"x": {"y": p[2]}, "y": {"x": p[3], "y": p[4], "x^3": p[5]}}
        system = PolynomialSystem.from_terms(own)
        return (system.simulate(t, p[:2]) / sigma).ravel()

    truth = np.array([1.2, 0.3, 1.1, -0.7, -0.2, -0.4])
    slopes = [(path(truth + h) - path(truth - h)) / 2e-5 for h in 1e-5 * np.eye(6)]
    jacobian = np.stack(slopes, axis=1)
    errors = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    at = law.terms.index
    ours = [bound.coefficients[at("y"), 0]]
    ours += [bound.coefficients[at(term), 1] for term in ("x", "y", "x^3")]
    np.testing.assert_allclose(ours, errors[2:], rtol=1e-4)
