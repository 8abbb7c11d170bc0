"""The axes in which a law is sparsest, against laws that are turned on purpose."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import vidsindy_lite as vl
from vidsindy_lite.dynamics.library import monomial_exponents
from vidsindy_lite.dynamics.orientation import TurnedLaw, apart, nearest
from vidsindy_lite.dynamics.turning import in_axes
from vidsindy_lite.study import SYSTEMS


def turned(name, seed, noise=0.0, n=600):
    """A path in axes turned at random: times, places, and the law's axes in those."""
    t, x = SYSTEMS[name].trajectory(n, 50)
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=rng).as_matrix()
    return t, x @ turn.T + noise * x.std() * rng.normal(size=x.shape), turn.T


@pytest.fixture(scope="module")
def lorenz():
    t, x, axes = turned("Lorenz", 1, 0.01)
    return t, x, axes, vl.discover(t, x, degree=2, order=1, orientation="learn")


def test_a_turned_law_is_found_in_its_own_axes(lorenz):
    t, x, axes, found = lorenz
    assert found.status == "ok"
    assert found.native.support.sum() == 7
    assert apart(found.orientation, axes) < np.deg2rad(1)
    np.testing.assert_allclose(found.orientation @ found.orientation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(found.orientation) > 0
    assert vl.discover(t, x, degree=2, order=1).native.support.sum() > 7  # in the axes of the data


def test_its_curve_is_in_its_own_axes_and_it_is_kept(lorenz, tmp_path):
    t, x, _, found = lorenz
    missed = found.curve(t) @ found.orientation - x
    assert np.sqrt(np.mean(missed**2)) < 0.02 * x.std()
    assert "axes: turned, x along (" in str(found)
    found.save(tmp_path / "law.json")
    np.testing.assert_array_equal(
        vl.Discovery.load(tmp_path / "law.json").orientation, found.orientation
    )


def test_a_turn_of_the_data_changes_nothing_in_the_law(lorenz):
    t, x, axes, found = lorenz
    more = Rotation.from_rotvec([0.3, -0.9, 0.4]).as_matrix()
    again = vl.discover(t, x @ more.T, degree=2, order=1, orientation="learn")
    sizes = [np.sort(np.abs(law.native.coefficients[law.native.support])) for law in (found, again)]
    np.testing.assert_allclose(*sizes, rtol=0.02)
    assert apart(again.orientation, found.orientation @ more.T) < np.deg2rad(0.3)


def test_springs_that_stand_askew_are_found_along_themselves():
    names = {"x": "vx", "y": "vy", "z": "vz"}
    springs = {f"v{name}": {name: -k} for name, k in zip(names, (1.0, 1.7, 2.3), strict=True)}
    law = vl.PolynomialSystem.from_terms({n: {v: 1} for n, v in names.items()} | springs)
    t, rng = np.linspace(0, 40, 800), np.random.default_rng(0)
    x = law.simulate(t, [1, 0.2, 0.5, 0.1, 0.8, -0.5])[:, :3]
    axes = Rotation.random(random_state=rng).as_matrix()
    seen = x @ axes + 0.02 * x.std() * rng.normal(size=x.shape)
    found = vl.discover(t, seen, degree=1, order=2, orientation="learn")
    assert found.native.support[:, 3:].sum() == 3
    assert apart(found.orientation, axes) < np.deg2rad(1)


def test_where_no_axes_are_better_those_of_the_data_stay():
    t = np.linspace(0, 20, 400)
    law = vl.PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1}})  # alike in all axes
    x = law.simulate(t, [1.0, 0.3])
    found = vl.discover(t, x, degree=1, order=1, orientation="learn")
    assert found.orientation is None
    assert "orientation: the data's own axes" in found.note
    assert vl.discover(t, x, degree=1, order=1).note == ""


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"orientation": "mine"}, "orientation: must be one of data, learn, got 'mine'"),
        ({"library": vl.Library.fourier(1)}, "orientation: can be learned only among all"),
        ({"origin": "data"}, "orientation: can be learned only with origin='learn', got 'data'"),
        ({"width": 1}, "orientation: can be learned of two or three coordinates, got 1"),
        ({"width": 4}, "orientation: can be learned of two or three coordinates, got 4"),
    ],
)
def test_what_has_no_orientation_is_refused(options, message):
    options = dict(options)
    width = options.pop("width", 2)
    x = np.random.default_rng(0).normal(size=(200, width))
    with pytest.raises(ValueError, match=message):
        vl.discover(np.arange(200.0), x, **({"orientation": "learn"} | options))


def test_the_nearest_order_and_signs_of_axes_are_taken():
    turn = Rotation.from_rotvec([0.1, -0.2, 0.05]).as_matrix()
    swapped = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]) @ turn
    np.testing.assert_array_equal(nearest(swapped), turn)
    assert apart(swapped, turn) < 1e-6
    assert apart(turn, np.eye(3)) > 0.1


def test_what_was_measured_is_turned_as_a_whole():
    turn = Rotation.from_euler("z", 90, degrees=True).as_matrix()[:2, :2].T
    x = np.array([[1.0, 2.0], [3.0, np.nan], [5.0, 6.0]])
    modes, errors = np.ones((3, 2, 1)), np.full((3, 2), [0.1, 0.2])
    [(t, y)], [shared], sigma = in_axes(([(np.arange(3.0), x)], [modes], [errors]), turn)
    np.testing.assert_array_equal(t, [0, 2])
    np.testing.assert_allclose(y, [[2, -1], [6, -5]])
    np.testing.assert_allclose(shared[:, :, 0], [[1, -1], [1, -1]])
    np.testing.assert_allclose(sigma[0], [[0.2, 0.1], [0.2, 0.1]])


def test_descending_ends_in_the_axes_and_at_the_origin_that_it_counted():
    """A law of two terms around (.2, -.1), turned by .3: of the twelve terms two are left."""
    exponents = monomial_exponents(2, 2)
    law, rng = np.zeros((6, 2)), np.random.default_rng(0)
    law[(exponents == (1, 1)).all(axis=1), 0] = 1.0
    law[(exponents == (1, 0)).all(axis=1), 1] = -1.5
    directions = 1e-3 * rng.normal(size=(12, 6, 2))
    about = TurnedLaw(exponents, np.stack([law, *directions]), np.zeros(2))
    turn, away = Rotation.from_rotvec([0, 0, 0.3]).as_matrix()[:2, :2], np.array([-0.2, 0.1])
    askew = about._mapped(turn, turn @ away, turn.T)
    cost, axes, origin = askew.descended(np.eye(2), np.zeros(2), 0.01)
    estimate, variance = askew.seen(axes, origin)
    z2 = estimate**2 / (variance + 0.01**2)
    assert cost == pytest.approx(0.5 * np.log1p(z2).sum(), rel=1e-6)
    assert (z2 > 1).sum() == 2
