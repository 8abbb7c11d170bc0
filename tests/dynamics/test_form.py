"""What a user knows beforehand: terms, origin, errors, names, and what nobody saw."""

import numpy as np
import pandas as pd
import pytest

import vidsindy_lite as vl
from vidsindy_lite import Library, PolynomialSystem, study
from vidsindy_lite.dynamics.model import Form

SPRING = PolynomialSystem.from_terms({"x": {"y": 2}, "y": {"x": -1, "y": -0.1}}, degree=2)
T = np.linspace(0, 20, 200)
X = SPRING.simulate(T, (1.0, 0.0))
QUADRATIC = Library.polynomial(2)


def noisy(sigma=0.05, seed=0, x=X):
    return x + sigma * np.random.default_rng(seed).normal(size=x.shape)


def form(library, order=1):
    return Form.of(("x", "y"), library, order)


def test_terms_are_known_forbidden_or_alone_allowed():
    library = QUADRATIC.where({"x": {"y": 2, "x^2": 0}, "y": {"x": None, "y": None, "...": 0}})
    posed = form(library)
    terms = posed.law(posed.known).terms
    assert [terms[k] for k in np.flatnonzero(posed.candidates[:, 0])] == ["1", "x", "xy", "y^2"]
    assert [terms[k] for k in np.flatnonzero(posed.candidates[:, 1])] == ["x", "y"]
    assert posed.law(posed.known).text() == "dx/dt = 2 y\ndy/dt = 0"
    assert not posed.movable.any()  # what is given is so in the frame of the data


def test_of_second_order_the_accelerations_are_given():
    posed = form(QUADRATIC.where({"vx": {"x": -4}}), order=2)
    assert posed.law(posed.known).text() == "x'' = -4 x\ny'' = 0"
    assert form(QUADRATIC, order=2).movable.tolist() == [True, True, False, False]
    with pytest.raises(ValueError, match=r"library: must give terms of an equation of vx, vy, got"):
        form(QUADRATIC.where({"x": {"vx": 1}}), order=2)


def test_directions_of_a_vector_are_given_together():
    def drag(vx, vy):
        return -np.hypot(vx, vy) * vx, -np.hypot(vx, vy) * vy

    library = Library.polynomial(0) + Library.terms({"drag": drag})
    posed = form(library.where({"vx": {"drag_x": 0.1}}), order=2)
    assert posed.law(posed.known).text() == "x'' = 0.1 drag_x\ny'' = 0.1 drag_y"
    assert posed.candidates.sum() == 2  # the constants
    both = form(library.where({"vx": {"drag_x": 0.1}, "vy": {"drag_y": 0.1}}), order=2)
    np.testing.assert_array_equal(both.known, posed.known)
    with pytest.raises(ValueError, match=r"one coefficient, .* got 0.1 and 0.2 for 'drag_y'"):
        form(library.where({"vx": {"drag_x": 0.1}, "vy": {"drag_y": 0.2}}), order=2)
    alone = form(library.where({"vx": {"drag_x": None, "...": 0}, "vy": {"...": 0}}), order=2)
    assert alone.candidates.sum() == 2  # both directions: a name counts more than all others


def test_a_direction_of_a_vector_that_is_empty_is_no_term():
    library = Library.terms(
        {
            "lift": lambda y: [0 * y, np.maximum(y - 10, 0)],  # far up alone
            "turn": lambda vx, vy: [-vy, vx],
        }
    )
    posed = form(library, order=2)
    terms = posed.law(posed.known).terms
    assert [terms[k] for k in np.flatnonzero(posed.candidates[:, 2])] == ["turn_x"]
    assert [terms[k] for k in np.flatnonzero(posed.candidates[:, 3])] == ["lift_y", "turn_y"]
    assert len(posed.searched) == 2  # lift by itself, and the turn once
    with pytest.raises(ValueError, match=r"'lift_x' is no term of the equation of vx, which has t"):
        form(library.where({"vx": {"lift_x": 1}}), order=2)


@pytest.mark.parametrize(
    ("equations", "words"),
    [
        ({"z": {"x": 1}}, "library: must give terms of an equation of x, y, got 'z'"),
        ({"x": {"z": 1}}, "library: 'z' is no term of the equation of x, which has 1, x, y, x"),
        ({"x": {"...": 0}, "y": {"...": 0}}, "library: must leave a term to be found, got all"),
        ({"x": {"y": np.nan}}, "coefficient of y: must be a finite number, got nan"),
        ({"x": "y"}, "equations: must give variables what is known of their terms"),
        ({}, "equations: must give variables what is known of their terms"),
    ],
)
def test_what_cannot_be_given_is_named(equations, words):
    with pytest.raises(ValueError, match=words):
        form(QUADRATIC.where(equations))


def test_what_is_given_is_written_and_read():
    library = Library.polynomial(2).where({"y": {"x": 28}, "x": {"x": None, "...": 0}})
    assert str(library) == "polynomial(2); y: x = 28; x: x = ?, ... = 0"
    assert Library.parse(str(library)) == library
    assert (library + Library.fourier(1)).given == library.given
    more = library.where({"y": {"y": -1}})
    assert dict(dict(more.given)["y"]) == {"x": 28, "y": -1}
    for text in ("polynomial(2); x", "polynomial(2); x: y", "polynomial(2); x: y = much"):
        with pytest.raises(ValueError, match="library: what is known must read as 'x: y = 10"):
            Library.parse(text)


def test_a_law_with_what_is_known_is_found_and_its_errors_are_smaller():
    alone = vl.discover(T, noisy(), degree=2)
    told = vl.discover(T, noisy(), library=QUADRATIC.where({"x": {"y": 2}, "y": {"y": -0.1}}))
    assert (told.system.support == SPRING.support).all()
    assert told.coefficients[2].tolist() == [2, -0.1]
    assert told.standard_errors[2].tolist() == [0, 0]
    assert told.standard_errors[1, 1] < alone.standard_errors[1, 1]
    assert told.equations().startswith("dx/dt = 2 y\ndy/dt = - (")


def test_with_the_origin_of_the_data_no_axis_moves():
    shifted = noisy() + (5.0, 0.0)
    assert vl.discover(T, shifted, degree=2).offset[0] == pytest.approx(5, abs=0.1)
    found = vl.discover(T, shifted, degree=2, origin="data")
    assert not found.offset.any()
    assert (found.native.coefficients == found.coefficients).all()
    assert (found.system.support == SPRING.shift((5, 0)).support).all()


def test_error_bars_of_given_errors_cover():
    allowed = {"x": {"y": None, "...": 0}, "y": {"x": None, "y": None, "...": 0}}
    library, scores = QUADRATIC.where(allowed), []
    for seed in range(6):
        rng = np.random.default_rng([7, seed])
        sigma = np.where(rng.random(X.shape) < 0.3, 0.15, 0.02)
        x = X + sigma * rng.normal(size=X.shape)
        found = vl.discover(T, x, library=library, sigma=sigma)
        away = (found.coefficients - SPRING.coefficients)[SPRING.support]
        scores += (away / found.standard_errors[SPRING.support]).tolist()
    assert 0.6 < np.std(scores) < 1.5


@pytest.mark.parametrize(("factor", "words"), [(0.4, "times sigma"), (2.5, "sigma of x is")])
@pytest.mark.parametrize("size", [0.05, 0.005])
def test_errors_that_contradict_the_data_are_doubted(factor, words, size):
    found = vl.discover(T, noisy(size), degree=2, sigma=factor * size)
    assert any(words in warning for warning in found.warnings)


def frame(*names):
    return pd.DataFrame(X, columns=names)


def test_columns_name_the_variables():
    found = vl.discover(T, frame("hare", "lynx"), degree=1)
    assert found.system.names == ("hare", "lynx")
    assert found.equations().startswith("dhare/dt = (2.0")
    other, same = frame("hare", "lynx")[["lynx", "hare"]], np.testing.assert_array_equal
    same(found.predict(other), found.system(X))
    same(found.system.gradient(other.iloc[0]), found.system.gradient(X[0]))
    same(found.simulate(other.iloc[0], T[:2]).x[0], X[0])
    with pytest.raises(ValueError, match="x: .* variables, .'hare', 'lynx'., got .'lynx', 'x'."):
        found.predict(other.rename(columns={"hare": "x"}))
    for names in ((0, 1), ("x / m", "y / m")):
        assert vl.discover(T, frame(*names), degree=1).system.names == ("x", "y")


OSCILLATOR = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -4, "y": -0.1, "x^3": -1}})
TIED = Library.polynomial(3).where({"x": {"y": 1, "...": 0}})
LONG = np.linspace(0, 20, 600)


def without(x, column, noise=0.0):
    """States of which one coordinate was never seen."""
    x = x + noise * x.std(axis=0) * np.random.default_rng(0).normal(size=x.shape)
    x[:, column] = np.nan
    return x


def test_a_velocity_that_nobody_saw():
    found = vl.discover(LONG, without(OSCILLATOR.simulate(LONG, [1.5, 0]), 1, 0.02), library=TIED)
    assert study.score(found.system, OSCILLATOR).exact
    assert (found.status, np.isnan(found.noise).tolist()) == ("ok", [False, True])


def test_a_coordinate_between_others_is_told_by_a_sum():
    lorenz = PolynomialSystem.from_terms(
        {"x": {"x": -10, "y": 10}, "y": {"x": 28, "y": -1, "xz": -1}, "z": {"xy": 1, "z": -8 / 3}}
    )
    library = Library.polynomial(2).where({"x": {"x": -10, "y": 10, "...": 0}})
    t = np.arange(800) * 0.02
    found = vl.discover(t, without(lorenz.simulate(t, [-8, 7, 27]), 1, 0.01), library=library)
    assert study.score(found.system, lorenz).exact
    errors = found.standard_errors
    far = np.abs(found.coefficients - lorenz.coefficients)[errors > 0] / errors[errors > 0]
    assert far.max() < 4


@pytest.mark.parametrize(
    ("library", "order", "words"),
    [
        (Library.polynomial(3), 1, "told by an equation that is known, .* got none for y"),
        (Library.polynomial(3), 2, "order 2 every position must be seen, got none of y"),
        (Library.polynomial(3).where({"x": {"y^2": 1, "...": 0}}), 1, "got none for y"),
        (Library.polynomial(3).where({"x": {"y": 1, "xy": 1, "...": 0}}), 1, "got none for y"),
    ],
)
def test_what_no_equation_tells_is_refused(library, order, words):
    x = without(OSCILLATOR.simulate(LONG, [1.5, 0]), 1)
    with pytest.raises(ValueError, match=words) as refused:
        vl.discover(LONG, x, library=library, order=order)
    assert "\n" not in str(refused.value)


def distorted(name, seed, size):
    """A clean trajectory seen through a slightly wrong linear map, and what the map may be."""
    rng = np.random.default_rng(seed)
    truth = study.SYSTEMS[name].shift((10, 10, 0))
    t, x = truth.trajectory(300)
    modes = size * np.einsum("kij,nj->kni", rng.normal(size=(4, 3, 3)), x - x.mean(axis=0))
    noise = 1e-5 * x.std(axis=0) * rng.normal(size=x.shape)
    return truth, t, x + np.tensordot(rng.normal(size=4), modes, 1) + noise, modes


def test_a_slightly_wrong_map_costs_accuracy_unless_it_is_told():
    truth, t, x, modes = distorted("SprottE", 0, 1e-4)
    blind = study.score(vl.discover(t, x), truth)
    told = vl.discover(t, x, systematic=modes)
    assert blind.exact
    assert study.score(told, truth).exact
    assert study.score(told, truth).l2 < 0.2 * blind.l2  # no data tell of an error of scale
    inside = truth.support
    pulls = (told.coefficients - truth.coefficients)[inside] / told.standard_errors[inside]
    assert np.sqrt(np.mean(pulls**2)) < 2.5
    assert told.status == "ok"
    x[100:104], modes[:, 100:104] = np.nan, np.nan
    halves = [(t[:150], x[:150]), (t[150:], x[150:])]
    parts = vl.discover(halves, systematic=[modes[:, :150], modes[:, 150:]])
    assert study.score(parts, truth).exact


def test_an_error_of_scale_changes_error_bars_alone():
    """It is a share of the noise, too: as a change of the path it would explain that noise."""
    law, error = study.SYSTEMS["RayleighBenard"], 3e-2
    t, x = law.trajectory(600)
    noisy = x + 0.004 * x.std(axis=0) * np.random.default_rng(0).standard_normal(x.shape)
    plain, told = (vl.discover(t, noisy, systematic=e) for e in (None, error * noisy[None]))
    assert study.score(told, law).exact
    kept = plain.system.support
    apart = (told.coefficients - plain.coefficients)[kept]
    assert (np.abs(apart) < plain.standard_errors[kept]).all()
    product = told.terms.index("xz"), 1
    expected = error * abs(plain.coefficients[product])
    assert told.standard_errors[product] == pytest.approx(expected, rel=0.3)


RUNS, CURVE = [(T, X), (T, -X)], np.ones((2, 200, 2))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"systematic": CURVE[:, :9]}, r"must have shape \(k, 200, 2\), got \(2, 9, 2\)"),
        ({"systematic": CURVE[0]}, r"systematic: must have shape \(k, 200, 2\), got \(200, 2\)"),
        ({"systematic": np.nan * CURVE}, "systematic: must be finite where x is"),
        ({"t": RUNS, "x": None, "systematic": [CURVE]}, "systematic: must be one per trajectory"),
        ({"t": RUNS, "x": None, "systematic": [CURVE, CURVE[:1]]}, "must hold the same causes"),
        ({"systematic": -1}, r"systematic: must have shape \(k, n, d\), got -1"),
        ({"sigma": 0}, "sigma: must be finite and positive where x is, got 0"),
        ({"sigma": [0.1] * 3}, r"sigma: must .*, or have shape \(2,\) or \(200, 2\), got \(3,\)"),
        ({"t": RUNS, "x": None, "sigma": [0.1] * 3}, "sigma: must be one per .*, got 3 for 2"),
        ({"origin": "here"}, "origin: must be one of learn, data, got 'here'"),
        ({"t": [(T, X), (T, X * [1, np.nan])], "x": None}, "in all trajectories or in none, got c"),
        ({"t": [(T, frame("a", "b")), (2 * T, frame("b", "a"))], "x": None}, "be named alike in"),
        ({"sigma": frame("y", "b")}, "sigma: must be named like the variables, .'x', 'y'., got"),
        ({"t": [*RUNS, (T, X)], "x": None}, "must hold each run once, got trajectory 0 again as 2"),
        ({"t": [(T, X), (60 * T, X)], "x": None}, "one unit in all .*, got steps of 0.1"),
        ({"x": frame("a", "a")}, "x: columns must have names of their own, got .'a', 'a'."),
    ],
)
def test_what_is_known_wrongly_is_refused(given, message):
    with pytest.raises(ValueError, match=message):
        vl.discover(**{"t": T, "x": X} | given)
