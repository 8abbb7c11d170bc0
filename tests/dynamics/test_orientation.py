"""The axes in which a law is sparsest, against laws that are turned on purpose."""

import numpy as np
import pytest
from helpers import solved
from scipy.spatial.transform import Rotation

import vidsindy_lite as vl
from vidsindy_lite.dynamics.l0 import inverse
from vidsindy_lite.dynamics.orientation import apart, in_axes, with_turns
from vidsindy_lite.study import SYSTEMS


def askew(name, seed, noise=0.0, n=350):
    """A path in axes turned at random: times, places, and the law's axes in those."""
    t, x = SYSTEMS[name].trajectory(n, 50)
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=rng).as_matrix()
    return t, x @ turn.T + noise * x.std() * rng.normal(size=x.shape), turn.T


def test_a_turned_law_is_found_in_its_own_axes():
    t, x, axes = askew("Lorenz", 1, 0.01)
    found = vl.discover(t, x, degree=2, order=1, orientation="learn")
    assert found.status == "ok"
    assert found.native.support.sum() == 7
    assert apart(found.orientation, axes) < np.deg2rad(1)
    np.testing.assert_allclose(found.orientation @ found.orientation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(found.orientation) > 0
    turn = np.rint(found.orientation @ axes.T)  # which of the law's axes they are
    y, law = 10 * np.random.default_rng(1).normal(size=(50, 3)), SYSTEMS["Lorenz"]
    truth = np.linalg.lstsq(found.system.library(y), law(y @ turn) @ turn.T)[0]
    wanted = np.abs(truth) > 1e-6
    np.testing.assert_array_equal(found.system.support, wanted)
    pulls = np.abs((found.coefficients - truth)[wanted] / found.standard_errors[wanted])
    assert (pulls < 3).all()
    # Its curve is in its own axes.
    missed = found.curve(t) @ found.orientation - x
    assert np.sqrt(np.mean(missed**2)) < 0.02 * x.std()
    assert "axes: turned, x along (" in str(found)
    assert "the error bars hold theirs" in str(found)


def test_springs_that_stand_askew_are_found_along_themselves():
    springs = {"x": {"vx": 1}, "y": {"vy": 1}, "vx": {"x": -1.0}, "vy": {"y": -1.7}}
    t, rng = np.linspace(0, 30, 500), np.random.default_rng(0)
    x = vl.PolynomialSystem.from_terms(springs).simulate(t, [1, 0.2, 0.1, 0.8])[:, :2]
    axes = Rotation.from_euler("z", 0.5).as_matrix()[:2, :2]
    seen = x @ axes + 0.02 * x.std() * rng.normal(size=x.shape)
    found = vl.discover(t, seen, degree=1, order=2, orientation="learn")
    assert found.native.support[:, 2:].sum() == 2
    assert apart(found.orientation, axes) < np.deg2rad(1)


LORENZ = SYSTEMS["Lorenz"]
# It has all terms in all axes.
FULL = vl.PolynomialSystem.from_terms({"x": {"x": -0.1, "y": 1}, "y": {"x": -1.5, "y": 0.05}})


def sampled(law, degree, start):
    """Noisy samples of a law in its own axes."""
    t = np.linspace(0, 20 / degree, 300)
    x = law.simulate(t, start)
    return t, x + 0.01 * x.std() * np.random.default_rng(0).normal(size=x.shape)


def own_errors(fit, model):
    """Standard errors of what is free, by a quadratic model, in standard units."""
    return np.sqrt(np.diag(inverse(model.of(np.flatnonzero(fit.state.free())).information)))


@pytest.mark.parametrize(
    ("law", "degree", "start", "live"),
    [(LORENZ, 2, [-8.0, 7.0, 27.0], 7), (FULL, 1, [1.5, 0.4], 4)],
)
def test_axes_that_are_not_known_make_errors_larger_unless_terms_leave_them_open(
    law, degree, start, live
):
    found, problem, fit = solved(*sampled(law, degree, start), degree)
    assert found.native.support.sum() == live
    known, learned = own_errors(fit, problem.model(fit)), own_errors(fit, with_turns(problem, fit))
    assert (learned > known * (1 - 1e-6)).all()
    assert (learned > 1.1 * known).any() == (law is LORENZ)
    assert law is LORENZ or learned == pytest.approx(known, rel=1e-6)


def test_where_no_axes_are_better_those_of_the_data_stay():
    t = np.linspace(0, 20, 400)
    law = vl.PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1}})  # alike in all axes
    x = law.simulate(t, [1.0, 0.3])
    found = vl.discover(t, x, degree=1, order=1, orientation="learn")
    assert found.orientation is None
    assert "orientation: the data's own axes" in found.note


@pytest.mark.parametrize(
    ("options", "width", "message"),
    [
        ({"orientation": "mine"}, 2, "orientation: must be one of data, learn, got 'mine'"),
        ({"library": vl.Library.fourier(1)}, 2, "orientation: can be learned only among all"),
        ({"origin": "data"}, 2, "orientation: can be learned only with origin='learn', got 'data'"),
        ({}, 4, "orientation: can be learned of two or three coordinates, got 4"),
    ],
)
def test_what_has_no_orientation_is_refused(options, width, message):
    x = np.random.default_rng(0).normal(size=(200, width))
    with pytest.raises(ValueError, match=message):
        vl.discover(np.arange(200.0), x, **({"orientation": "learn"} | options))


def test_what_was_measured_is_turned_as_a_whole():
    turn = Rotation.from_euler("z", 90, degrees=True).as_matrix()[:2, :2].T
    x = np.array([[1.0, 2.0], [3.0, np.nan], [5.0, 6.0]])
    modes, errors = np.ones((3, 2, 1)), np.full((3, 2), [0.1, 0.2])
    [(t, y)], [shared], sigma = in_axes(([(np.arange(3.0), x)], [modes], [errors]), turn)
    np.testing.assert_array_equal(t, [0, 2])
    np.testing.assert_allclose(y, [[2, -1], [6, -5]])
    np.testing.assert_allclose(shared[:, :, 0], [[1, -1], [1, -1]])
    np.testing.assert_allclose(sigma[0], [[0.2, 0.1], [0.2, 0.1]])
