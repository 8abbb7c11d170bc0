"""Motions whose place tells too little about their law are named, and no others."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vidsindy_lite.dynamics import PolynomialSystem, discover
from vidsindy_lite.dynamics.diagnostics import differenced, related, shapes
from vidsindy_lite.study import SYSTEMS, score

TIMES = np.linspace(0, 12, 600)


def solved(rate, start, t=TIMES):
    return solve_ivp(rate, (0, t[-1]), start, t_eval=t, rtol=1e-9, atol=1e-10).y.T


def pendulum(amplitude, damping=0.0):
    """Angle and its rate."""
    return solved(lambda _, s: [s[1], -9.81 * np.sin(s[0]) - damping * s[1]], [amplitude, 0])


def bob(angle):
    return 1.1 * np.stack([0.6 * np.sin(angle), 0.8 * np.sin(angle), -np.cos(angle)], 1) + [1, 2, 3]


def spherical():
    def rate(_, s):
        pull = s[3:] @ s[3:] - 9.81 * s[2]
        return np.append(s[3:], -pull * s[:3] + [0, 0, -9.81])

    return solved(rate, [0.6, 0, -0.8, 0, 1.2, 0])[:, :3]


def waves(*parts):
    """One column for each pair of an amplitude and a frequency."""
    return np.stack([a * np.cos(w * TIMES + w) for a, w in parts], axis=1)


NAMED = {
    "bob": (bob(pendulum(1.0)[:, 0]), "on a circle"),
    "bob in its plane": (bob(pendulum(1.5, 0.1)[:, 0])[:, [0, 2]] / [0.6, 1], "on a circle"),
    "bob that swings aside": (spherical(), "on a sphere"),
    "at rest": (np.append(waves((1, 2), (1, 3.1)), 2 + 0 * TIMES[:, None], 1), "z moves by no"),
}


def told(x, share=0.01):
    """What is said of positions with errors of a share of the widest coordinate."""
    noise = np.full(x.shape[1], share * x.std(axis=0).max())
    noisy = x + noise * np.random.default_rng(0).standard_normal(x.shape)
    return " | ".join(shapes(noisy, noise, "xyzw"[: x.shape[1]]))


@pytest.mark.parametrize("name", NAMED)
def test_a_shape_is_named(name):
    x, words = NAMED[name]
    assert words in told(x)


@pytest.mark.parametrize("share", [0.0, 0.2])
@pytest.mark.parametrize("name", ["Lorenz", "SprottE"])
def test_flows_are_on_no_shape(name, share):
    _, x = SYSTEMS[name].trajectory(600)
    assert told(x / x.std(axis=0), max(share, 1e-5)) == ""


def planet():
    """Places and velocities on an ellipse: these go round on a circle."""

    def rate(_, s):
        return [*s[2:], *(-s[:2] / np.hypot(*s[:2]) ** 3)]

    return solved(rate, [1, 0, 0, 1.2])


PLANE = [[1, 0, 0.5, 0], [0, 1, -0.2, 0], [0, 0, 0, 1]]
RELATED = {
    "line": (waves((1, 2), (0.6, 2)), "xy", 1),
    "plane": (waves((1, 2), (0.6, 3.1), (1, 1.3)) @ PLANE + [0, 0, 4, 0], "xyz", 1),
    "circle": (np.stack([np.cos(TIMES), np.sin(TIMES)], axis=1) + [1e4, 0], "xy", 2),
    "planet": (planet(), "xyzw", 2),
}


@pytest.mark.parametrize("name", RELATED)
def test_states_that_depend_on_each_other_are_named(name):
    x, of, degree = RELATED[name]
    names = "xyzw"[: x.shape[1]]
    (told,) = related(names, x, 3, 0.01)
    assert told.startswith(f"{', '.join(of)} depend on each other on these data")
    assert f"a relation of degree {degree} holds" in told
    assert list(related(names, x, degree - 1, 0.01)) == []
    bent = x + 0.002 * x.std(axis=0) * np.sin(3 * x[:, ::-1] / x.std(axis=0))
    assert not list(related(names, bent, degree, 1e-6))  # which the data tell from zero
    noisy = x + 0.05 * x.std(axis=0) * np.random.default_rng(0).standard_normal(x.shape)
    assert list(related(names, noisy, 3, 0.05)) == []


@pytest.mark.parametrize("name", SYSTEMS)
def test_states_of_flows_do_not_depend_on_each_other(name):
    assert list(related("xyz", SYSTEMS[name].trajectory(1500)[1], 2, 1.0)) == []


def test_a_law_of_a_planet_is_never_simply_ok():
    x = planet()[:, :2]
    noise = 0.01 * np.random.default_rng(0).standard_normal(x.shape)
    warnings = discover(TIMES, x + noise, order=2, degree=2).warnings
    assert any("x, y, vx, vy depend on each other" in warning for warning in warnings)


def test_an_arc_that_is_passed_once_is_no_circle():
    angle = np.linspace(-1, 1, 600)
    x = 2 * np.stack([np.sin(angle), np.cos(angle)], axis=1)
    assert told(x) == ""
    assert "on a circle" in told(bob(2 * angle))  # more than half of it, in space


@pytest.mark.parametrize("terms", [{"x": -4.0}, {"x": -2.0, "x^3": -3.0}])
def test_of_one_closed_orbit_a_law_is_told_without_a_doubt(terms):
    law = PolynomialSystem.from_terms({"x": {"y": 1.0}, "y": terms}, degree=3)
    x = law.simulate(TIMES, [1.0, 0.0])
    found = discover(TIMES, x + 0.002 * np.random.default_rng(0).standard_normal(x.shape), order=1)
    assert found.status == "ok"
    assert score(found, law).exact


def test_a_spring_that_is_alike_in_all_directions_is_not_told_from_a_flow():
    t = np.linspace(0, 12, 300)
    for stiff, doubted in (((4, 4), True), ((4, 7), False)):
        k = np.array(stiff)
        x = solved(lambda _, s, k=k: [*s[2:], *(-k * s[:2] - 0.1 * s[2:])], [1, 0, 0, 1.5], t)
        warnings = discover(t, x[:, :2], order=2, degree=2).warnings
        assert any("depend on each other on these" in warning for warning in warnings) == doubted


@pytest.mark.parametrize("made", ["before", "after", "around", ""])
def test_differences_that_are_given_as_states_are_told(made):
    x = pendulum(0.5)[:, 0] + 1e-3 * np.random.default_rng(0).standard_normal(len(TIMES))
    steps, v = np.diff(x) / np.diff(TIMES), np.gradient(x, TIMES)
    v = v + 1e-3 * v.std() if not made else v  # not their differences, but for a thousandth
    x, v = {"before": (x[1:], steps), "after": (x[:-1], steps)}.get(made, (x, v))
    said = " ".join(differenced(["x", "v"], [(TIMES[: len(x)], np.stack([x, v], axis=1))]))
    assert said.startswith("v is made of differences of x: ") == bool(made)
    assert not list(differenced(["x", "v"], [(TIMES[:2], x[:2, None] * [1, 2])] * 50))


def test_what_is_far_from_zero_is_told_to_be_moved():
    for away, said in ((100, False), (5000, True)):
        found = discover(TIMES, pendulum(0.5) + [away, 0], degree=1, order=1)
        assert any("subtract a constant" in doubt for doubt in found.warnings) == said


def test_a_law_that_foretells_no_sample_from_the_one_before_is_told():
    t = np.linspace(0, 20, 800)  # a pulse every two, which a loop through a saddle imitates
    pulses = np.exp(-((((t + 0.6) % 2 - 1) / 0.05) ** 2))
    pulses += 0.005 * np.random.default_rng(0).standard_normal(800)
    found = discover(t, pulses[:, None])
    assert any("from one sample to the next" in doubt for doubt in found.warnings)
