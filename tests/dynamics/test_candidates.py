"""Libraries as values: what they hold, what they find, and what they refuse."""

import math

import numpy as np
import pytest
from helpers import noisy

import vidsindy_lite as vl
from vidsindy_lite import Library, PolynomialSystem

PENDULUM = Library.polynomial(1) + Library.fourier(1)


def drag(v, u):
    return np.hypot(v, u) * v


@pytest.mark.parametrize(
    ("friction", "library"), [(0.1, PENDULUM), (0.0, Library.polynomial(3) + Library.fourier(1))]
)
def test_a_pendulum_at_a_large_amplitude_is_found_from_its_angle_alone(friction, library):
    wanted, t = {"sin(x)": -9.81} | ({"vx": -friction} if friction else {}), np.linspace(0, 20, 700)
    law = PolynomialSystem.from_terms({"x": {"vx": 1.0}, "vx": wanted}, library=PENDULUM)
    x = noisy(law.simulate(t, [1.5, 0.0])[:, :1], 0.01)
    found = vl.discover(t, x, order=2, library=library)
    if library == PENDULUM:
        assert (found.system.support == law.support).all()
    rows = np.flatnonzero(found.system.support[:, 1])
    assert {found.terms[k] for k in rows} == set(wanted)
    for k in rows:
        error = found.coefficients[k, 1] - wanted[found.terms[k]]
        assert abs(error) < 5 * found.standard_errors[k, 1]
    assert found.status == "ok"


DRAG = Library.terms(
    {"|v|v": lambda vx, vy, vz: np.sqrt(vx**2 + vy**2 + vz**2) * np.array([vx, vy, vz])}
)


def thrown(noise=0.01):
    """A throw with gravity and quadratic drag: its times and noisy positions."""
    equations = {q: {f"v{q}": 1.0} for q in "xyz"}
    equations |= {f"v{q}": {f"|v|v_{q}": -0.05} for q in "xyz"}
    equations["vz"]["1"] = -9.81
    law, t = PolynomialSystem.from_terms(equations, library=DRAG), np.linspace(0, 2, 600)
    return t, noisy(law.simulate(t, [0, 0, 1.5, 8, 3, 9])[:, :3], noise)


def test_one_throw_tells_quadratic_drag_that_is_the_same_in_all_directions():
    vector = Library.terms({"v": lambda vx, vy, vz: np.array([vx, vy, vz])})
    library = Library.polynomial(0) + vector + DRAG
    found = vl.discover(*thrown(), order=2, library=library)
    support = found.system.support & (np.arange(6) > 2)
    wanted = {("|v|v_x", 3), ("|v|v_y", 4), ("|v|v_z", 5), ("1", 5)}
    assert {(found.terms[k], j) for k, j in np.argwhere(support)} == wanted
    rows = [found.terms.index(f"|v|v_{q}") for q in "xyz"]
    drags, errors = (part[rows, [3, 4, 5]] for part in (found.coefficients, found.standard_errors))
    np.testing.assert_allclose([drags, errors], [drags[:1], errors[:1]] * np.ones(3), rtol=1e-9)
    assert abs(drags[0] + 0.05) < 5 * errors[0] < 0.002


FRACTION = Library.polynomial(3) + Library.rational(1)
PREDATOR = {  # Holling's type II: x' = x (1 - x/4) - xy/(1 + x/2), y' = .6 xy/(1 + x/2) - .4 y
    "x": {"x": 1.0, "x^2": 0.25, "x^3": -0.125, "xy": -1.0, "x x'": -0.5},
    "y": {"y": -0.4, "xy": 0.4, "x y'": -0.5},
}
ENZYME = {"x": {"x": -2.0, "x x'": -2.0}}  # Michaelis and Menten: x' = -x/(.5 + x)


@pytest.mark.parametrize(
    ("equations", "start", "span", "noise"),
    [(PREDATOR, [1.0, 0.5], 60, 0.01), (ENZYME, [3.0], 6, 0.0)],
)
def test_fractions_are_found_exactly(equations, start, span, noise, tmp_path):
    law, t = PolynomialSystem.from_terms(equations, library=FRACTION), np.linspace(0, span, 800)
    found = vl.discover(t, noisy(law.simulate(t, start), noise), library=FRACTION)
    assert (found.system.support == law.support).all()
    np.testing.assert_allclose(found.coefficients, law.coefficients, rtol=0.02)
    assert "/ (1 + (" in found.equations()
    found.save(tmp_path / "law")
    assert vl.Discovery.load(tmp_path / "law").equations() == found.equations()


def test_a_fraction_evaluates_differentiates_and_prints():
    law = PolynomialSystem.from_terms(PREDATOR, library=FRACTION)
    x = np.random.default_rng(0).uniform(0.1, 3, size=(50, 2))
    p, q = x.T
    eaten = p * q / (1 + p / 2)
    wanted = np.column_stack([p * (1 - p / 4) - eaten, 0.6 * eaten - 0.4 * q])
    np.testing.assert_allclose(law(x), wanted, rtol=1e-12)
    for i, axis in enumerate(np.eye(2)):
        slope = (law(x + 1e-6 * axis) - law(x - 1e-6 * axis)) / 2e-6
        np.testing.assert_allclose(law.gradient(x)[:, :, i], slope, atol=1e-7)
    assert law.text().splitlines()[1] == "dy/dt = (-0.4 y + 0.4 xy) / (1 + 0.5 x)"
    assert r"\dot{y} &= \frac{-0.4\,y + 0.4\,x y}{1 + 0.5\,x}" in law.latex()
    moved = law.shift([1.0, -0.5])
    np.testing.assert_allclose(moved(x + [1.0, -0.5]), law(x), rtol=1e-12)
    np.testing.assert_allclose(moved.shift([-1.0, 0.5])(x), law(x), rtol=1e-12)
    with pytest.raises(ValueError, match="offset: no denominator may vanish there, got .2.0, 0.0"):
        law.shift([2.0, 0.0])


def test_a_path_ends_at_a_pole():
    law = PolynomialSystem.from_terms({"x": {"1": 1.0, "x x'": 1.0}}, library=FRACTION)
    x = law.simulate(np.linspace(0, 1, 50), [0.0])
    assert np.isnan(x[-1, 0])
    assert np.nanmax(x) < 1.01


def test_a_law_evaluates_differentiates_and_prints():
    # What an argument is by default is no variable.
    library = Library.fourier(2) + Library.terms({"|v|v": lambda v, u, k=1: k * drag(v, u)})
    terms = {"v": {"|v|v": -0.2, "sin(2 v)": 1.0}, "u": {"cos(u)": 2.0}}
    law = PolynomialSystem.from_terms(terms, library=library)
    assert law.text() == "dv/dt = sin(2 v) - 0.2 |v|v\ndu/dt = 2 cos(u)"
    assert r"\sin(2 v)" in law.latex()
    assert r"\mathrm{|v|v}" in law.latex()
    x = np.random.default_rng(0).normal(size=(50, 2))
    v, u = x.T
    wanted = np.column_stack([np.sin(2 * v) - 0.2 * np.hypot(v, u) * v, 2 * np.cos(u)])
    np.testing.assert_allclose(law(x), wanted, rtol=1e-12)
    for i, axis in enumerate(np.eye(2)):
        slope = (law(x + 1e-6 * axis) - law(x - 1e-6 * axis)) / 2e-6
        np.testing.assert_allclose(law.gradient(x)[:, :, i], slope, atol=1e-6)
    assert law.shift([0.0, 0.0])(x) == pytest.approx(law(x))
    with pytest.raises(
        ValueError, match="offset: must be zero for a law with functions of the state"
    ):
        law.shift([1.0, 0.0])
    product = PolynomialSystem.from_terms({"v": {"u cos(u)": 1}, "u": {"1": 1}}, library=library)
    np.testing.assert_allclose(product(x)[:, 0], u * np.cos(u))
    with pytest.raises(ValueError, match=r"term: must be a product of the variables .* got 'tan"):
        PolynomialSystem.from_terms({"v": {"tan(v)": 1}, "u": {"1": 1}}, library=library)


def test_a_sum_is_a_union():
    both = Library.polynomial(3) + Library.fourier(1)
    assert both + both == both
    assert Library.polynomial(1) + Library.polynomial(3) == Library.polynomial(3)
    assert str(both + Library.terms({"a": drag})) == "polynomial(3) + fourier(1) + terms(a)"
    assert Library.parse("fourier(1)+ polynomial( 3 )") == both
    fractions = Library.polynomial(2) + Library.rational(1)
    assert Library.parse(str(fractions)) == fractions
    with pytest.raises(TypeError):
        both + 3


@pytest.mark.parametrize(
    ("library", "words"),
    [
        (Library(), "library: must hold a term, got none"),
        (Library.rational(1), "library: must hold a term above the fraction line, got none"),
        ("polynomial(3)", "library: must be of type Library"),
        (Library.terms({"a": lambda q: q}), r"arguments of 'a' must be named .*\(x, y\), .* got q"),
        (Library.fourier(10**6), r"library: must have at most 1000 terms, got [246]0"),
        (Library.polynomial(60), r"library: must have at most 1000 terms, got 1891 in 2"),
        (Library.terms({"a": max}), r"arguments of 'a' must be named .* got none"),
        (Library.terms({"x": lambda x: x**2}), "a term must have a name of its own, got 'x' twice"),
        (Library.polynomial(1) + Library.terms({"1": lambda x: x**2}), "of its own, got '1' twice"),
        (Library.terms({"s": lambda x: math.sin(x)}), "'s' must take and return arrays .* Type"),
        (Library.terms({"a": lambda x: [x, x, x]}), r"return an array .* 2 of these, .* .3, 2."),
        (Library.terms({"a": lambda x: np.ones(2)}), r"shape .2,. for n = 2 and .2,. for n = 97"),
        (Library.terms({"a": lambda x: np.log(-2 - x)}), r"a must be .* at \(1, "),
        (
            Library.polynomial(1) + Library.inputs([0, 2, 9], {"u": [1, 0, 2]}, hold="linear"),
            "library: u must be finite on the data, got no such value at t = 9.03",
        ),
        (Library.polynomial(2) + Library.terms({"square": lambda x: x**2}), "got square"),
        (lambda: Library.parse("polynomial(3) + tan(1)"), r"a sum of .*'tan\(1\)'"),
        (lambda: Library.fourier(0), "harmonics: must be an integer of at least 1, got 0"),
        (lambda: Library.terms({"a": 1}), "functions: must map names to functions, got 'a': 1"),
        (lambda: Library.terms({"a": np.sin}) + Library.terms({"a": np.cos}), ".* 'a' twice"),
    ],
)
def test_a_library_that_does_not_suit_is_refused_in_one_line(library, words):
    t = np.linspace(0, 10, 300)
    x = np.column_stack([np.cos(t), -np.sin(t)])
    with pytest.raises(ValueError, match=words) as refused:
        vl.discover(t, x, library=library() if callable(library) else library)
    assert "\n" not in str(refused.value)


def test_a_velocity_in_the_library_asks_for_order_2():
    drag = Library.terms({"slow": lambda vx: vx})
    t = np.linspace(0, 10, 300)
    x = (np.exp(-0.1 * t) * np.cos(2 * t))[:, None]
    found = vl.discover(t, x, library=Library.terms({"pull": lambda x: x}) + drag)
    assert found.system.order == 2
    assert found.system.text().startswith("x'' = ")
    known = vl.discover(t, x, library=Library.polynomial(1).where({"vx": {"vx": -0.2}}))
    assert known.system.coefficients[known.terms.index("vx"), 1] == -0.2
    with pytest.raises(ValueError, match="got vx: velocities are variables of a law of order=2"):
        vl.discover(t, x, library=drag, order=1)
