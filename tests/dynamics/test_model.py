"""Polynomial systems: terms, values, derivatives, shifts, text, paths; and checked input."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidsindy_lite.dynamics.data import check_trajectories, check_trajectory, variable_names
from vidsindy_lite.dynamics.library import monomial_exponents
from vidsindy_lite.dynamics.model import PolynomialSystem, integrate, runge_kutta_4

LORENZ = {"x": {"x": -10, "y": 10}, "y": {"x": 28, "xz": -1, "y": -1}, "z": {"xy": 1, "z": -8 / 3}}

LINE = PolynomialSystem.from_terms({"x": {"x": 1}})


@st.composite
def systems(draw):
    d, degree = draw(st.integers(1, 4)), draw(st.integers(0, 3))
    exponents = monomial_exponents(d, degree)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    sparse = rng.normal(size=exponents.shape) * (rng.random(exponents.shape) < 0.4)
    return PolynomialSystem(variable_names(d), exponents, sparse)


def test_terms_are_read_in_any_usual_spelling():
    spellings = ["x^2 y", "x*x*y", "yx**2", " x ^2*y "]
    laws = [PolynomialSystem.from_terms({"x": {s: 2.0}, "y": {}}, degree=3) for s in spellings]
    for law in laws:
        assert law.coefficients[law.terms.index("x^2y"), 0] == 2.0
        assert law.support.sum() == 1
    # Long names are kept apart.
    law = PolynomialSystem.from_terms({"x10": {"x10 y_2": 1}, "y_2": {"y_2^2": -3}})
    assert law.terms[-3:] == ("x10^2", "x10 y_2", "y_2^2")
    assert r"\dot{x_{10}} &= x_{10} y_{2} \\" in law.latex()
    law = PolynomialSystem.from_terms({"of_y_2": {}})
    assert r"\dot{\mathrm{of\_y}_{2}} &= 0" in law.latex()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        *[
            (lambda terms=terms: PolynomialSystem.from_terms(terms, degree=3), message)
            for terms, message in [
                ({"x": {"q": 1}}, "term: must be a product"),
                ({"x": {"x^4": 1}}, "degree: must be at least"),
                ({"x": {"": 1}}, "term: must be '1' or a product"),
                ({"x": 3}, "equations: must give each variable its terms, .* got {'x': 3}"),
                ({}, "equations: must give each variable its terms, .* got {}"),
                ({"x": {"xy": 1}, "y": {}, "xy": {}}, "a name of its own, got 'xy' twice$"),
            ]
        ],
        *[
            (lambda given=given: PolynomialSystem(*given), message)
            for given, message in [
                ((("x",), [[0], [1]], [[np.nan], [1]]), "coefficients: must be finite"),
                ((("x",), [[1], [1]], [[1], [1]]), "exponents: every monomial may appear once"),
                ((("x", "y"), [[1]], [[1]]), r"must have shape \(l, 2\), got .*\(1, 1\)"),
                ((("x",), [[-1]], [[1]]), "exponents: must be non-negative integers, got -1"),
                ((("x",), [[1.9]], [[1]]), "exponents: must be non-negative integers, got 1.9"),
                ((("x", "x"), [[1, 0]], [[1, 1]]), "names: must be distinct"),
                ((("1", "x"), [[1, 0]], [[1, 1]]), "names: must be distinct names such as x or x1"),
                ((("x",), [[1]], [[1, 2]]), "coefficients: must have shape"),
            ]
        ],
        (lambda: PolynomialSystem(("x",), [[1]], [[1]], functions=(3,)), "must be of a Library"),
        (lambda: runge_kutta_4(LINE, [0, 1], [1, 2]), r"x0: must have shape \(1,\) or \(m, 1\)"),
        (lambda: runge_kutta_4(LINE, [0, 1], [np.inf]), "x0: must be finite, got"),
        (lambda: LINE.simulate([0, 0], [1]), "t: must increase"),
        (lambda: LINE.simulate([0, np.inf], [1]), "t: must be finite, got inf"),
        (lambda: LINE.simulate([0, 1], [1, 2]), "x0: must be 1 finite numbers"),
        (lambda: LINE.library(np.zeros((4, 2))), r"x: must have shape \(n, 1\), got \(4, 2\)"),
        *[(lambda f=f: f("a"), "x: must .*, got 'a'") for f in (LINE, LINE.gradient, LINE.library)],
        *[(lambda at=at: LINE.shift(at), "offset: must be") for at in ([1, 2], "abc", None)],
    ],
)
def test_bad_systems_and_uses_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@given(systems(), st.integers(0, 1000))
def test_gradient_agrees_with_differences(law, seed):
    x = np.random.default_rng(seed).normal(size=law.d)
    step = 1e-6
    numeric = np.stack(
        [(law(x + step * e) - law(x - step * e)) / (2 * step) for e in np.eye(law.d)], axis=-1
    )
    np.testing.assert_allclose(law.gradient(x), numeric, atol=1e-6 * (1 + np.abs(numeric).max()))


@given(systems(), st.integers(0, 1000))
def test_shift_moves_the_argument_and_comes_back(law, seed):
    rng = np.random.default_rng(seed)
    x, offset = rng.normal(size=(5, law.d)), rng.normal(size=law.d)
    shifted = law.shift(offset)
    np.testing.assert_allclose(shifted(x + offset), law(x), atol=1e-10)
    np.testing.assert_allclose(shifted.shift(-offset)(x), law(x), atol=1e-9)


def test_shift_leaves_no_remainder_where_terms_cancel():
    law = PolynomialSystem.from_terms({"x": {"x": -10, "y": 10}, "y": {"y": -0.1}})
    shifted = law.shift((0.3, 0.3))
    assert shifted.coefficients[shifted.terms.index("1"), 0] == 0


def test_value_text_and_latex():
    lorenz = PolynomialSystem.from_terms(LORENZ)
    x, y, z = point = np.array([1.5, -2.0, 3.0])
    np.testing.assert_allclose(lorenz(point), [10 * (y - x), x * (28 - z) - y, x * y - 8 / 3 * z])
    assert lorenz(np.stack([point, point])).shape == (2, 3)
    law = PolynomialSystem.from_terms({"x": {"1": -0.5, "x": 1, "x^2y": -2.25}, "y": {}})
    assert law.text() == "dx/dt = x - 2.25 x^2y - 0.5\ndy/dt = 0"
    assert r"\dot{x} &= x - 2.25\,x^{2} y - 0.5" in law.latex()
    assert (str(law), law._repr_latex_()) == (law.text(), f"${law.latex()}$")


def circle(x):
    return np.stack([x[..., 1], -x[..., 0]], axis=-1)


@pytest.mark.parametrize("t", [np.linspace(0, 20, 201), np.linspace(0, 20, 3), [0.0, 1e-3, 7, 20]])
def test_a_circle_is_closed_whatever_the_times(t):
    t = np.asarray(t)
    path, _ = integrate(circle, t, np.array([0.0, 1.0]))
    np.testing.assert_allclose(path, np.stack([np.sin(t), np.cos(t)], axis=1), atol=3e-10)


def test_what_ends_a_path_is_told_and_after_it_there_is_nothing():
    t = np.linspace(0, 2, 21)  # 1 / (1 - t)
    path, end = integrate(lambda x: x**2, t, np.array([1.0]), farthest=1e6)
    np.testing.assert_allclose(path[:10, 0], 1 / (1 - t[:10]), rtol=1e-9)
    assert (np.isnan(path[10:]).all(), end) == (True, "diverges")
    endless, end = integrate(lambda x: x**2, t, np.array([1.0]))
    assert (np.isnan(endless[11:]).all(), end) == (True, "diverges")
    path, end = integrate(lambda x: -1e6 * (x - 1), 10 * t, np.zeros(1), most_steps=200)
    assert np.isfinite(path[0]).all()
    assert np.isnan(path[-1]).all()
    assert end == "is too stiff to be followed"


def test_the_classical_method_is_of_fourth_order():
    t = np.linspace(0, 2, 5)
    exact = np.stack([np.sin(t), np.cos(t)], axis=1)
    coarse, fine = (
        np.abs(runge_kutta_4(circle, t, [0.0, 1.0], substeps) - exact).max() for substeps in (2, 4)
    )
    assert coarse / fine == pytest.approx(16, rel=0.1)


def test_a_long_motion_is_followed_to_its_end():
    path, end = integrate(circle, np.array([0.0, 600.0]), np.array([0.0, 1.0]), most_steps=200)
    np.testing.assert_allclose(path[-1], [np.sin(600.0), np.cos(600.0)], atol=1e-6)
    assert end == ""
    law = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1}})
    soon, far = (law.simulate([begin, begin + 1], [1, 0]) for begin in (0, 1e15))
    np.testing.assert_array_equal(far, soon)


T, X = np.arange(5.0), np.ones((5, 2))


def with_value(row, value):
    x = X.copy()
    x[row, 1] = value
    return x


@pytest.mark.parametrize(
    ("t", "x", "message"),
    [
        ("soon", X, "t: must be an array of real numbers, got 'soon'"),
        (T, X + 0j, "x: must be an array of real numbers"),
        (T, np.ones(5), r"x: must have shape \(n, d\)"),
        (T[:4], X, r"t: must have shape \(5,\) as x has 5 rows, got \(4,\)"),
        (np.array([0, 1, 1, 3, 4]), X, r"t: must increase, got t\[1\] = 1 before t\[2\] = 1"),
        (T, with_value(3, np.inf), "x: must not be infinite .* got infinity in row 3"),
        (
            T,
            with_value(3, -1e150),
            r"x: must be between 1e-100 and 1e\+100, got 1e\+150 at most: take another unit",
        ),
        (T, np.diag(np.full(5, np.nan)) + 1, "x: must hold at least one row without NaN, got 5"),
        (T, np.full((5, 2), np.nan), "x: must hold a number, got 5 rows of NaN"),
    ],
)
def test_bad_input_is_named(t, x, message):
    with pytest.raises(ValueError, match=message):
        check_trajectory(t, x)


def test_missing_and_masked_rows_are_left_out():
    masked = np.ma.masked_greater(with_value(2, 1e9), 9)
    for states in (with_value(2, np.nan), masked):
        t, x = check_trajectory(T, states)
        assert t.tolist() == [0, 1, 3, 4]
        assert (x == X[:4]).all()


@pytest.mark.parametrize("t", [[1, 2], T, [(T, X), (T,)], None, [], [(T, X), (T, X[:, :1])]])
def test_what_is_no_list_of_trajectories_of_one_system(t):
    given = r"t: must be a list of pairs \(t, x\), or x be given"
    with pytest.raises(ValueError, match=f"{given}|t: a list of trajectories must hold at least"):
        check_trajectories(t)
