"""Laws with known functions of the time: measured inputs, harmonics, products with the state."""

import pickle

import numpy as np
import pytest
from helpers import noisy
from scipy.integrate import solve_ivp

import vidsindy_lite as vl
from vidsindy_lite import Library, PolynomialSystem
from vidsindy_lite.dynamics.library import Input, jumps
from vidsindy_lite.dynamics.result import Discovery

T = np.linspace(0, 40, 600)
CUBIC = Library.polynomial(3)


def force(t):
    return 0.5 * np.cos(1.2 * t) + 0.3 * np.sin(0.37 * t + 1)


def duffing(t=T, start=(0.5, 0.0), push=lambda t, x: force(t)):
    return solve_ivp(
        lambda s, x: [x[1], -0.3 * x[1] + x[0] - x[0] ** 3 + push(s, x[0])],
        (t[0], t[-1]), start, t_eval=t, rtol=1e-10, atol=1e-12,
    ).y.T  # fmt: skip


FORCED = duffing()
U = Library.inputs(T, {"u": force(T)})


def terms(law, equation):
    column = law.support[:, law.names.index(equation)]
    return {law.terms[k] for k in np.flatnonzero(column)}


@pytest.mark.parametrize(("order", "noise", "began"), [(1, 0.0, 1e6), (2, 0.05, 0.0)])
def test_a_forced_oscillator_is_found_with_its_input_and_foretold(order, noise, began):
    t, x = began + T, noisy(FORCED[:, : 3 - order], noise)
    found = vl.discover(t, x, library=CUBIC + Library.inputs(t, {"u": force(T)}), order=order)
    law, v = found.system, "vx" if order == 2 else "y"
    assert (found.status, law.names, law.order) == ("ok", ("x", v, "t"), order)
    assert (terms(law, v), terms(law, "t")) == ({"x", v, "x^3", "u"}, {"1"})
    ahead = found.simulate(FORCED[0], t[:200])
    np.testing.assert_allclose(ahead.x[:, :2], FORCED[:200], atol=1e-4 if noise == 0 else 0.05)
    assert "dt/dt" not in found.equations() + law.text() + law.latex()
    assert r"\mathrm{u}" in law.latex()


@pytest.fixture(scope="module")
def forced():
    """What is found of the positions of the forced oscillator."""
    return vl.discover(T, noisy(FORCED[:, :1], 0.01), library=CUBIC + U)


def test_the_order_of_a_forced_law_is_decided(forced):
    assert (forced.system.order, forced.status) == (2, "ok")
    both = vl.discover(T, noisy(FORCED, 0.01), library=CUBIC + U)
    assert (both.system.order, both.status) == (1, "ok")


def test_functions_of_the_time_may_multiply_the_state():
    x = duffing(push=lambda t, x: 0.4 * x * np.cos(1.9 * t))[:, :1]
    library = CUBIC + Library.terms(
        {"h": lambda t: np.cos(1.9 * t), "hx": lambda x, t: x * np.cos(1.9 * t)}
    )
    found = vl.discover(T, noisy(x, 0.01), library=library, order=2)
    assert terms(found.system, "vx") == {"x", "vx", "x^3", "hx"}
    library = CUBIC + Library.inputs(T, {"h": np.cos(1.9 * T)})
    library += Library.terms({"hx": lambda h, x: h * x})
    same = vl.discover(T, noisy(x, 0.01), library=library, order=2)
    np.testing.assert_allclose(same.coefficients, found.coefficients, rtol=1e-3, atol=1e-3)
    assert all("changes with the time" in str(law.physics()) for law in (found, same))
    with pytest.raises(ValueError, match="t: must lie where h is known, got 4"):
        same.simulate((1, 0), [0, 10, 42])  # though it stands in a product alone


def test_each_trajectory_has_its_input_and_a_gap_is_bridged():
    later = T + 100
    second = duffing(later, (-1.0, 0.4), lambda t, x: np.sin(0.7 * t))
    library = CUBIC + Library.inputs([T, later], {"u": [force(T), np.sin(0.7 * later)]})
    runs = [(T, noisy(FORCED[:, :1], 0.02)), (later, noisy(second[:, :1], 0.02, 1))]
    runs[0][1][300:340] = np.nan
    found = vl.discover(runs, library=library, order=2)
    assert terms(found.system, "vx") == {"x", "vx", "x^3", "u"}
    assert np.isfinite(found.curve(np.concatenate([T, later]))).all()


def test_an_input_that_the_law_does_not_have_changes_no_physics():
    x = np.exp(-0.05 * T) * np.cos(2 * T)
    library = Library.polynomial(1) + U + Library.terms({"sinc": np.sinc})
    found = vl.discover(T, noisy(x[:, None], 0.01), library=library, order=2)
    assert terms(found.system, "vx") == {"x", "vx"}
    again, _ = pickle.loads(pickle.dumps((found, Library.fourier().resolve(("x",), 1))))
    assert again.physics()["period"].value == pytest.approx(np.pi, abs=0.01)


@pytest.mark.parametrize("rate", [1.3j, -0.65 + 1.89j])  # of what drives it, or of its control
def test_an_input_that_follows_from_the_state_is_told(rate):
    t = np.linspace(0, 10, 800)
    x, v = np.real(np.exp(rate * t)), np.real(rate * np.exp(rate * t))
    u = 3 * x + 0.5 * v
    library = Library.polynomial(1) + Library.inputs(t, {"u": u})
    found = vl.discover(t, noisy(x[:, None], 0.01), library=library, order=2)
    assert any("x, vx, u depend on each other" in doubt for doubt in found.warnings)


@pytest.mark.parametrize(("start", "order", "doubts"), [(0, "auto", 1), (0, 1, 0), (2, "auto", 0)])
def test_under_one_steady_sine_the_order_is_not_told(start, order, doubts):
    x = start * np.exp(-0.4 * T) + (0.4 * np.sin(1.3 * T) - 1.3 * np.cos(1.3 * T)) / 1.85
    library = Library.polynomial(1) + Library.inputs(T, {"u": np.sin(1.3 * T)})
    found = vl.discover(T, noisy(x[:, None], 0.01), library=library, order=order)
    assert sum("orders 1 and 2 fit alike" in doubt for doubt in found.warnings) == doubts
    assert terms(found.system, "x") == {"x", "u"}


def test_a_law_with_an_input_is_saved_and_read_with_its_library(forced, tmp_path):
    forced.save(tmp_path / "law.json")
    again = Discovery.load(tmp_path / "law.json", CUBIC + U)
    state = np.array([0.1, 0.2, 3.0])  # the time is the last
    assert again.predict(state)[1] == forced.predict(state)[1]
    said = again.physics()  # of the same law without what drives it
    assert said["natural frequency"].value == pytest.approx(np.sqrt(2), abs=0.01)
    assert ("changes with the time" in str(said), said.energy) == (True, ())
    with pytest.raises(ValueError, match="library: must hold the function 'u'"):
        Discovery.load(tmp_path / "law.json")
    with pytest.raises(ValueError, match="library: must be of type Library, got 'polynomial"):
        Discovery.load(tmp_path / "law.json", "polynomial(3)")
    with pytest.raises(ValueError, match="t: must lie where u is known, got 4"):
        forced.simulate((0, 0), np.linspace(30, 42, 5))


def test_slopes_are_refused_where_an_input_of_the_law_is_not_known(forced):
    for states in ([0.1, 0.2, 42.0], [[0.1, 0.2, 3.0], [0.1, 0.2, 42.0]]):
        with pytest.raises(ValueError, match="t: must lie where u is known, got 4"):
            forced.predict(states)
    idle = Library.inputs(T, {"idle": np.cos(9.1 * T)})
    x = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1, "x^3": -1}}).simulate(T, (1, 0))
    free = vl.discover(T, noisy(x[:, :1], 0.01), library=CUBIC + idle, order=2)
    assert terms(free.system, "vx") == {"x", "x^3"}
    assert np.isfinite(free.predict([0.1, 0.2, 42.0])).all()  # nothing of it hangs on the input


SWITCHED = np.array([5.0, 9.0, 12.5, 21.0, 30.0])  # among the samples


def relay(t):
    return np.searchsorted(SWITCHED, t, side="right") % 2


def charged(rate=0.8, gain=2.0):
    """The exact answer of x' = -rate x + gain relay(t) at a fine grid of times."""
    x, answer = 0.0, []
    for before, after in zip(np.append(CLOCK[:1], CLOCK[:-1]), CLOCK, strict=True):
        level = gain / rate * relay(before)
        x = level + (x - level) * np.exp(-rate * (after - before))
        answer.append(x)
    return np.array(answer)[:, None]


CLOCK = np.arange(0, 40, 0.1)


@pytest.mark.parametrize(
    ("known", "noise"),
    [
        (Library.inputs(CLOCK, {"u": relay(CLOCK)}, hold="zero"), 0.0),
        (Library.terms({"u": lambda t: relay(t).astype(float)}), 0.02),
    ],
    ids=["samples", "function"],
)
def test_where_an_input_jumps_so_does_the_slope(known, noise):
    found = vl.discover(CLOCK, noisy(charged(), noise), library=Library.polynomial(1) + known)
    law = found.system
    assert found.status == "ok"
    assert terms(law, "x") == {"x", "u"}
    rows = [law.terms.index(term) for term in ("x", "u")]
    off = law.coefficients[rows, 0] - (-0.8, 2.0)
    assert (np.abs(off) < 4 * found.standard_errors[rows, 0]).all()
    assert noise or np.abs(off).max() < 1e-5
    if not noise:  # a pulse between the times that are asked for
        ahead = found.simulate([0.0], [0.0, 11.0]).x[1, 0]
        assert ahead == pytest.approx(charged()[110, 0], abs=1e-4)


def test_nothing_is_made_of_the_time_in_which_an_input_jumped():
    t, x = CLOCK[::4], charged()[::4]  # it jumps between samples
    with pytest.warns(UserWarning, match="nobody knows when it jumped"):
        known = Library.inputs(t, {"u": relay(t)})
    found = vl.discover(t, x, library=Library.polynomial(1) + known)
    assert (found.status, terms(found.system, "x")) == ("ok", {"x", "u"})
    kept = found.system.coefficients[found.system.support[:, 0], 0]
    np.testing.assert_allclose(np.sort(kept), (-0.8, 2.0), atol=1e-5)
    with pytest.warns(UserWarning, match="jumps"):
        often = Library.inputs(t, {"u": np.arange(len(t)) // 2 % 2})
    with pytest.raises(ValueError, match=r"must jump less often .* got 49 jumps"):
        vl.discover(t, x, library=Library.polynomial(1) + often)


@pytest.mark.parametrize("own", [False, True])
def test_under_an_input_that_jumps_a_long_motion_is_followed_to_its_end(own):
    t = np.arange(1501) / 5
    u = np.where(np.random.default_rng(0).random(301) < 0.5, -1.0, 1.0)[(t + 1e-9).astype(int)]
    held = Input.of("u", t, u, "zero")
    known = Library.terms({"u": lambda t: held(t)}) if own else Library.inputs(t, {"u": u}, "zero")
    system = {"x": {"x": -0.5, "u": 10.0}, "t": {"1": 1.0}}
    law = PolynomialSystem.from_terms(system, library=Library.polynomial(1) + known)
    path, end = law.followed(t, [0.0])
    x = [0.0]
    for push in u[:-1]:
        x.append(x[-1] * np.exp(-0.1) + 20 * push * (1 - np.exp(-0.1)))
    assert end == ""
    np.testing.assert_allclose(path[:, 0], x, atol=1e-8)
    with pytest.raises(ValueError, match="x0: its time must be that of t, 1, got 7"):
        law.followed(t[5:], [0.0, 7.0])
    with pytest.raises(ValueError, match="t: must lie where u is known, got 600"):
        law.followed([0.0, 600.0], [0.0])


def test_runs_that_begin_where_an_input_jumps():
    ends = np.searchsorted(CLOCK, SWITCHED)
    runs = list(zip(np.split(CLOCK, ends), np.split(noisy(charged(), 0.02), ends), strict=True))
    known = Library.inputs(CLOCK, {"u": relay(CLOCK)}, hold="zero")
    found = vl.discover(runs, library=Library.polynomial(1) + known)
    assert (found.status, terms(found.system, "x")) == ("ok", {"x", "u"})


def test_samples_that_jump_are_held_and_that_is_told():
    with pytest.warns(UserWarning, match="inputs: u jumps, as at t = 5, .*hold='zero'"):
        told = Input.of("u", CLOCK, relay(CLOCK))
    assert len(Input.of("u", CLOCK, np.full(len(CLOCK), 0.3)).unsure) == 0  # without a word
    s = np.arange(0.05, 39, 0.1)
    np.testing.assert_array_equal(told(s), relay(s))
    np.testing.assert_allclose(jumps(told, np.arange(0.0, 40, 9.5)), SWITCHED)  # two in one
    for hold in ("linear", "cubic"):  # who says so is not told
        assert not np.array_equal(Input.of("u", CLOCK, relay(CLOCK), hold)(s), relay(s))


def test_an_input_is_a_spline_and_unknown_outside():
    t = np.array([0.0, 1.0, 2.5, 3.0, 4.0])
    u = Input.of("u", t, t**3 - 2 * t, "cubic")  # a cubic is its own spline
    s = np.linspace(0, 4, 41)
    np.testing.assert_allclose(u(s), s**3 - 2 * s, atol=1e-12)
    assert np.isnan(u(np.array([-0.1, 4.1]))).all()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (lambda: Library.inputs(T, {"u": T[1:]}), r"u must have shape \(600,\), .* got \(599,\)"),
        (lambda: Library.inputs(T, {"u": np.where(T > 3, np.nan, T)}), r"u must be .* at t = 3\.0"),
        (lambda: Library.inputs(T, {"u v": T}), "inputs: must be named like variables.* got 'u v'"),
        (lambda: Library.inputs([1.0], {"u": [1.0]}), "at least 2 samples, got 1"),
        (lambda: Library.inputs(T + 1.7e9, {"u": T}), "told apart to a ten-millionth of their"),
        (lambda: Library.inputs([T, T], {"u": [T]}), "u: must be one per .*, got 1 for 2"),
        (lambda: Library.inputs([T, T], {"u": [T, T]}), "times apart .* to t = 40 and one from"),
        (lambda: vl.discover(T, FORCED, library=CUBIC + Library.inputs(T, {"x": T})), "'x' twice"),
        (lambda: vl.discover(T + 1, FORCED, library=CUBIC + U), "u must be finite .* t = 40.0"),
    ],
)
def test_bad_inputs_are_refused_in_one_line(given, message):
    with pytest.raises(ValueError, match=message) as refused:
        given()
    assert "\n" not in str(refused.value)
