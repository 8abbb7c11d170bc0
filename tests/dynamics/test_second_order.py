"""Laws of second order, x'' = f(x, x'), from positions alone: against laws that are known."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import moving, noisy
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from vidsindy_lite.dynamics import PolynomialSystem
from vidsindy_lite.dynamics.library import Library
from vidsindy_lite.dynamics.solver import accelerated, better, discover


def duffing(x, v):
    return x - x**3 - 0.1 * v


def van_der_pol(x, v):
    return -x + 1.5 * (1 - x**2) * v


def found_terms(law):
    """The terms of the accelerations, with their coefficients."""
    where = np.argwhere(law.support[:, law.d // 2 :]) + (0, law.d // 2)
    return {(law.names[j], law.terms[k]): law.coefficients[k, j] for k, j in where}


@pytest.mark.parametrize("share", [0.0, 0.05])
def test_duffing_from_positions_alone(share):
    t = np.linspace(0, 20, 600)
    found = discover(t, noisy(moving(duffing, [1.5], [0.0], t), share, seed=3), order=2)
    truth = {("vx", "x"): 1.0, ("vx", "vx"): -0.1, ("vx", "x^3"): -1.0}
    terms = found_terms(found.system)
    assert terms.keys() == truth.keys()
    for place, value in truth.items():
        error = found.standard_errors[found.terms.index(place[1]), 1]
        assert abs(terms[place] - value) < 4 * error + 1e-6


def test_the_printed_law_is_one_of_accelerations():
    t = np.linspace(0, 20, 400)
    found = discover(t, moving(van_der_pol, [0.5], [0.0], t), order=2)
    assert found.status == "ok", found.warnings
    assert found.system.order == 2
    assert found.system.text(3) == "x'' = -x + 1.5 vx - 1.5 x^2 vx"
    assert r"\ddot{x} &= -x + 1.5\,\dot{x}" in found.system.latex(3)
    assert found.equations().startswith("x'' = - (1.0000")
    assert np.isfinite(found.noise).tolist() == [True, False]


def test_the_law_foretells_another_motion():
    t = np.linspace(0, 20, 400)
    found = discover(t, moving(duffing, [1.5], [0.0], t), order=2)
    later = found.simulate([0.3, 1.0], t)
    np.testing.assert_allclose(later.x[:, :1], moving(duffing, [0.3], [1.0], t), atol=1e-3)
    np.testing.assert_allclose(found.predict([0.3, 1.0]), [1.0, 0.3 - 0.027 - 0.1], atol=1e-4)
    velocity = np.gradient(found.curve(t)[:, 0], t)
    np.testing.assert_allclose(found.curve(t)[5:-5, 1], velocity[5:-5], atol=0.02)


def test_an_origin_off_that_of_the_data_is_found_and_gaps_are_crossed():
    t = np.linspace(0, 25, 700)
    x = noisy(moving(duffing, [1.5], [0.0], t), 0.01) + 7.0
    x[200:250] = x[400:430] = np.nan
    found = discover(t, x, order=2)
    assert found_terms(found.native).keys() == {("vx", "x"), ("vx", "vx"), ("vx", "x^3")}
    assert abs(found.offset[0] - 7) < 4 * found.offset_errors[0]
    assert found.offset[1] == 0  # that of a velocity is known
    assert np.isfinite(found.curve(t)).all()
    assert len(found.curves) == len(found.physics().energy) == 3  # no energy of what is supposed
    assert "energy rises" not in str(found.physics())


def drag(_, v):
    return np.array([0, 0, -9.81]) - 0.3 * v


THROWS = [(4, 1, 8), (-2, 5, 6), (1, -4, 9), (-5, -3, 4)]


def throws(acceleration, starts, share):
    t = np.linspace(0, 1.5, 150)
    paths = [moving(acceleration, [0, 0, 1], v0, t) for v0 in starts]
    return [(t, noisy(x, share, seed)) for seed, x in enumerate(paths)]


def test_four_throws_tell_gravity_and_drag_and_that_they_are_of_second_order():
    found = discover(throws(drag, THROWS, 0.01), degree=1)
    truth = {("vx", "vx"): -0.3, ("vy", "vy"): -0.3, ("vz", "vz"): -0.3, ("vz", "1"): -9.81}
    terms = found_terms(found.system)
    assert found.system.order == 2
    assert terms.keys() == truth.keys()
    assert found.status == "ok", found.warnings
    for place, value in truth.items():
        assert terms[place] == pytest.approx(value, rel=0.05)


def test_without_a_force_a_coordinate_moves_evenly():
    found = discover(throws(lambda x, v: [0, 0, -9.81], THROWS, 0.01), order=2, degree=1)
    assert found.status == "ok", found.warnings
    assert found.system.text().splitlines()[:2] == ["x'' = 0", "y'' = 0"]


def test_velocities_that_are_given_need_no_second_order():
    t = np.linspace(0, 30, 1200)
    driven = lambda t, x: [x[1], -x[0] - 0.2 * x[1] + 0.5 * np.cos(1.7 * t)]  # noqa: E731
    swing = solve_ivp(driven, (0, 30), [1, 0], t_eval=t, rtol=1e-9).y.T
    found = discover(t, noisy(swing, 0.01))
    assert (found.system.order, "may not be autonomous" in found.warnings[0]) == (1, True)


def test_too_few_samples_a_turn_are_told():
    t = np.arange(1000) * 2 * np.pi / 2.6
    swing = np.exp(-0.001 * t)[:, None] * np.column_stack([np.cos(t), -np.sin(t)])
    said = " ".join(discover(t, noisy(swing, 0.01)).warnings)
    assert ("sample faster" in said, "record longer" in said) == (True, False)


def test_one_throw_is_called_undetermined():
    found = discover(throws(drag, THROWS[:1], 0.01), order=2, degree=2)
    assert found.status == "suspect"
    assert any("several runs" in warning for warning in found.warnings)


def test_an_order_that_is_none():
    t = np.linspace(0, 1, 50)
    for order in (3, 0, 2.0, "second", True):
        with pytest.raises(ValueError, match=rf"order: must be 1, 2 or 'auto', got {order!r}"):
            discover(t, t[:, None] ** 2, order=order)


def test_only_velocities_by_name_make_a_second_order():
    assert PolynomialSystem.from_terms({"x": {"vx": 1.0}, "vx": {"x": -1.0}}).order == 2
    assert PolynomialSystem.from_terms({"x": {"y": 1.0}, "y": {"x": -1.0}}).order == 1
    assert PolynomialSystem.from_terms({"x": {"vx": 2.0}, "vx": {"x": -1.0}}).order == 1
    assert PolynomialSystem.from_terms({"x": {"vx": 1, "x": 1}, "vx": {"x": -1}}).order == 1


def test_auto_takes_the_second_order_for_a_body():
    t = np.linspace(0, 20, 500)
    x = noisy(moving(van_der_pol, [1.5], [0.5], t), 0.01)
    found = discover(t, x)
    assert found.system.order == 2
    assert found.note == "order 2: the law of order 1 misses the data"
    assert "note: order 2" in str(found)


def test_six_springs_have_their_law_though_cubics_interpolate_their_path():
    t, rates = np.arange(500) / 25, np.array([2.3, 2.5, 2.7, 1.4, 1.7, 1.6])
    found = discover(t, noisy(np.cos(np.outer(t, rates) + np.arange(6)), 1e-3))
    assert found.note == "order 2: velocities are no function of the place"
    assert len(found_terms(found.system)) == 6
    assert found.status == "ok", found.warnings


def test_a_law_outside_the_library_is_no_body():
    flows = {
        (0.8,): lambda _, x: 0.32 * x * np.log(2.9 / x),
        (2.0,): lambda _, x: 0.5 * x * (1 - x / 20) - x**2 / (1 + x**2),
        (-1.9, 0.0): lambda _, x: [x[1], -0.9 * np.sin(x[0]) - 0.2 * x[1]],
    }
    t = np.linspace(0, 10, 256)
    for start, rate in flows.items():
        x = solve_ivp(rate, (0, 10), start, t_eval=t, rtol=1e-9).y.T
        assert discover(t, noisy(x, 0.02)).system.order == 1


def test_what_cannot_be_of_second_order_stays_with_the_first():
    t = np.linspace(0, 20, 400)
    x = moving(duffing, [1.5], [0.5], t)
    few = discover(t[:20], np.hstack([x[:20], x[20:40]]), degree=2)
    assert few.system.order == 1
    assert discover(t, x, library=Library.polynomial(3).where({"x": {"1": 0.0}})).system.order == 1
    assert accelerated([make_interp_spline(t, np.cos(np.outer(t, 1 + np.arange(22) / 40)))])


def test_a_fall_is_of_second_order_though_it_passes_no_place_twice():
    t = np.linspace(0, 3, 90)[:, None]
    found = discover(t[:, 0], noisy(9.81 * t**2 / 2, 0.005))
    assert found_terms(found.system) == {("vx", "1"): pytest.approx(9.81, abs=0.1)}
    slowed = discover(t[:, 0], noisy(19.1 * (1 - np.exp(-0.8 * t)) - 12.3 * t, 0.02))  # with drag
    assert set(found_terms(slowed.system)) == {("vx", "1"), ("vx", "vx")}
    cools = discover(t[:, 0], noisy(2 - 2 * np.exp(-1.5 * t), 0.02))  # pulled by nothing
    assert set(found_terms(cools.system)) == {("x", "1"), ("x", "x")}


def test_which_of_two_laws_is_better():
    t = np.linspace(0, 20, 300)
    second = discover(t, moving(duffing, [1.5], [0.0], t), order=2)
    doubtful = replace(second, warnings=("doubtful",))
    line = PolynomialSystem.from_terms({"x": {"x": 1.0}})
    first = replace(second, system=line, native=line, noise=second.noise[:1])
    assert better(first, second).note == "order 1: the law of order 2 has 3 terms, not 1"
    assert better(first, doubtful).note == "order 1: the law of order 2 is doubtful, too"
    missed = replace(first, noise=2 * first.noise)
    assert better(missed, doubtful).system.order == 2
    dense = PolynomialSystem(("x",), [[0], [1], [2], [3]], np.ones((4, 1)))
    assert better(replace(first, system=dense, native=dense), second).system.order == 2
    assert better(replace(first, system=dense, native=dense), doubtful).system.order == 1
