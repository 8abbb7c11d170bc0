"""The result: units, error bars, frames, texts, files, and a picture of its path."""

import json
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from helpers import noisy

import vidsindy_lite as vl
from vidsindy_lite import Library, PolynomialSystem
from vidsindy_lite.dynamics.result import Discovery, Step, _with_error
from vidsindy_lite.dynamics.solver import discover
from vidsindy_lite.study.corruption import add_correlated_noise


@pytest.fixture(scope="module")
def spring():
    law = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1, "y": -0.1}}, degree=2)
    t = np.linspace(0, 12, 200)
    return law, t, discover(t, law.simulate(t, (1, 0)) + (2, 0), degree=2)


@pytest.fixture(scope="module")
def found(spring):
    return spring[2]


def test_equations_show_errors_in_both_frames(found):
    assert "±" in found.equations()
    assert found.equations("data") != found.equations("native")
    assert found.equations("native").count("±") == found.native.support.sum()
    with pytest.raises(ValueError, match="frame: must be one of data, native, got 'reference'"):
        found.equations("reference")


def test_errors_are_zero_where_there_is_no_term_and_carried_along_with_a_shift(found):
    assert ((found.standard_errors > 0) == found.system.support).all()
    assert ((found.native_standard_errors > 0) == found.native.support).all()
    # The constant in the frame of the data is minus the slope times the offset.
    x, one = found.terms.index("x"), found.terms.index("1")
    ratio = found.coefficients[one, 1] / found.coefficients[x, 1]
    assert ratio == pytest.approx(-found.offset[0], rel=1e-9)
    slope, constant = found.coefficients[[x, one], 1]
    rows = [6 + x, 6 + one]  # second equation of a library of six terms
    covariance = found.covariance[np.ix_(rows, rows)]
    gradient = np.array([constant / slope**2, -1 / slope])
    assert np.sqrt(gradient @ covariance @ gradient) == pytest.approx(
        found.offset_errors[0], rel=1e-6
    )


def test_what_vanishes_with_an_origin_pins_no_coefficient():
    law = PolynomialSystem.from_terms({
        "x": {"1": 2, "x": -0.25, "y^2": -1, "z^2": -1}, "y": {"1": 1, "y": -1, "xy": 1, "xz": -4},
        "z": {"z": -1, "xy": 4, "xz": 1},
    })  # fmt: skip
    t = np.linspace(0, 10, 300)
    x = add_correlated_noise(law.simulate(t, (1, 1, 1)), 0.03, np.random.default_rng(1))
    found = discover(t, x, degree=2)
    both = found.system.support & found.native.support
    assert (found.standard_errors[both] > 0.1 * found.native_standard_errors[both]).all()


def test_a_law_predicts_slopes_and_paths(spring):
    law, t, found = spring
    x = np.array([[2.5, 0.5], [1.0, -1.0]])
    np.testing.assert_allclose(found.predict(x), law(x - (2, 0)), atol=1e-5)
    np.testing.assert_allclose(found.predict(x[0]), found.predict(x)[0], rtol=1e-12)
    ahead = found.simulate((2.5, 0.5), t)
    np.testing.assert_allclose(ahead.x, law.simulate(t, (0.5, 0.5)) + (2, 0), atol=1e-5)
    assert ahead.status == "ok"
    np.testing.assert_array_equal(ahead.t, t)
    t = np.linspace(0, 0.9, 100)
    grown = PolynomialSystem.from_terms({"x": {"x^2": 1}}).simulate(t, [1.0])  # 1 / (1 - t)
    ahead = discover(t, grown, degree=2).simulate([1.0], np.linspace(0, 2, 21))
    assert ahead.status in {"diverges after t = 0.9", "diverges after t = 1"}
    assert (np.isfinite(ahead.x[:10]).all(), np.isnan(ahead.x[11:]).all()) == (True, True)


def test_a_discovery_is_saved_and_loaded_digit_for_digit(spring, tmp_path):
    _, t, found = spring
    history = (Step("", 1.0, np.nan, -np.inf, 2),)
    found = replace(found, absent=found.absent * np.inf, history=history, note="NaN, Infinity")
    found.save(tmp_path / "law.json")
    json.loads((tmp_path / "law.json").read_text(), parse_constant=pytest.fail)
    again = Discovery.load(tmp_path / "law.json")
    assert (str(again), again.status) == (str(found), found.status)
    assert again.equations("native") == found.equations("native")
    np.testing.assert_array_equal(again.curve(t), found.curve(t))
    np.testing.assert_array_equal(again.native_covariance, found.native_covariance)
    again.save(tmp_path / "copy.json")
    assert (tmp_path / "copy.json").read_bytes() == (tmp_path / "law.json").read_bytes()


def test_a_file_that_cannot_be_read_or_written_is_told_with_the_argument(spring, tmp_path):
    for path in (tmp_path / "law.json", tmp_path):
        with pytest.raises(FileNotFoundError, match="path: no such file of a discovery, got '"):
            Discovery.load(path)
    with pytest.raises(ValueError, match="path: must be a file, got the folder '"):
        spring[2].save(tmp_path)
    file = tmp_path / "new" / "law.json"  # the folder is made
    spring[2].save(file)
    content = json.loads(file.read_text())
    found = content["discovery"]
    for other, words in (
        ({"type": "Thing"}, "a type must be one of Discovery"),
        ([1], "it must hold a Discovery, got tuple"),
        (found | {"offset": found["absent"]}, "offset must have shape"),
        (found | {"curves": []}, "it must hold curves"),
    ):
        file.write_text(json.dumps(content | {"discovery": other}))
        with pytest.raises(ValueError, match=f"path: must be a file that .*{words}"):
            Discovery.load(file)


@pytest.mark.parametrize(
    ("number", "text"),
    [
        ((28.076, 0.043), "+ (28.076 ± 0.043) x"),
        ((-3.2e-7, 1.1e-9), "- (3.200 ± 0.011)e-7 x"),
        ((9.9917557e18, 1.6163795e16), "+ (9.992 ± 0.016)e18 x"),
        ((28.0, 0.0), "+ 28 x"),  # known
        ((-1e7, 0.0), "- 1e7 x"),
    ],
)
def test_numbers_have_the_digits_that_their_errors_allow(number, text):
    assert _with_error(*number, "x") == text


T = np.linspace(0, 20, 400)
HELD = Library.terms({"restoring": lambda x: np.sin(x), "away": lambda x: 1 / (4 - x)})


@pytest.fixture(scope="module")
def pendulum():
    """A pendulum's law among two functions, of which it has one."""
    terms = {"x": {"vx": 1.0}, "vx": {"sin(x)": -9.81, "vx": -0.1}}
    law = PolynomialSystem.from_terms(terms, library=Library.polynomial(1) + Library.fourier(1))
    x = noisy(law.simulate(T, [1.5, 0.0])[:, :1], 0.01)
    found = vl.discover(T, x, order=2, library=Library.polynomial(1) + HELD)
    used = found.system.exponents[found.system.support.any(axis=1), 2:].any(axis=0)
    assert used.tolist() == [True, False]
    return found


def test_another_function_of_the_same_name_is_refused(pendulum, tmp_path):
    pendulum.save(tmp_path / "law")
    for other in (lambda x: np.tanh(x), lambda x: 1.001 * np.sin(x), lambda x: x * np.nan):
        with pytest.raises(ValueError, match="library: .* function 'restoring' that the law was"):
            vl.Discovery.load(tmp_path / "law", Library.terms({"restoring": other}))
    with pytest.raises(ValueError, match="library: must hold the function 'restoring'"):
        vl.Discovery.load(tmp_path / "law")
    # What a file of an earlier version does not hold is not compared.
    content = json.loads((tmp_path / "law").read_text())
    del content["functions"]
    (tmp_path / "old").write_text(json.dumps(content))
    assert vl.Discovery.load(tmp_path / "old", HELD).equations() == pendulum.equations()
    (tmp_path / "other").write_text(json.dumps(content | {"functions": [1, 2, 3]}))
    with pytest.raises(ValueError, match="path: must be a file that Discovery.save has written"):
        vl.Discovery.load(tmp_path / "other", HELD)


def test_functions_that_the_law_has_not_may_be_missing(pendulum, tmp_path):
    pendulum.save(tmp_path / "law")
    again = vl.Discovery.load(tmp_path / "law", Library.terms({"restoring": lambda x: np.sin(x)}))
    state = np.array([[0.3, 1.0], [-1.0, 0.5]])
    np.testing.assert_array_equal(again.predict(state), pendulum.predict(state))
    np.testing.assert_array_equal(again.system.gradient(state), pendulum.system.gradient(state))
    np.testing.assert_array_equal(again.simulate(state[0], T).x, pendulum.simulate(state[0], T).x)
    assert again.equations() == pendulum.equations()
    assert np.isnan(again.system.library(state)[:, again.terms.index("away")]).all()
    assert str(again).startswith(pendulum.equations())
    again.save(tmp_path / "copy")
    assert str(vl.Discovery.load(tmp_path / "copy", HELD)) == str(pendulum)


def test_every_plateau_is_drawn_and_the_law_is_marked_where_it_holds(found):
    figure = found.plot_path()
    assert [axes.get_title() for axes in figure.axes] == ["dx/dt", "dy/dt"]
    for j, (axes, plateaus) in enumerate(zip(figure.axes, found.path, strict=True)):
        (stairs,) = axes.patches
        values, edges, _ = stairs.get_data()
        assert list(values) == [p.terms.sum() for p in plateaus]
        np.testing.assert_allclose(edges, [plateaus[0].low, *(p.high for p in plateaus)])
        own = [p for p in plateaus if (p.terms == found.native.support[:, j]).all()]
        marks = [marked.get_segments()[0][:, 0] for marked in axes.collections]
        np.testing.assert_allclose(marks, [(p.low, p.high) for p in own])
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.texts] == ["all laws", "the law"]
    plt.close(figure)


TURNS = np.linspace(0, 20, 200)
ALLOWED = {"x": {"y": None, "x^2": None, "...": 0}}


def weak_spring(weak=0.0):
    terms = {"x": {"y": 2}, "y": {"x": -1, "y": -0.1, "x^2": weak}}
    return PolynomialSystem.from_terms(terms, degree=2)


def found_in(law, seed, library=None, noise=0.05):
    x = law.simulate(TURNS, (1.0, 0.0))
    x += noise * np.random.default_rng([9, seed]).normal(size=x.shape)
    return vl.discover(TURNS, x, library=library or Library.polynomial(2), origin="data")


def test_intervals_hold_what_is_absent():
    covered, weak = [], []
    for seed in range(4):
        one = found_in(weak_spring(), seed).absent
        inside = (one[..., 0] <= 0) & (one[..., 1] >= 0)
        covered.append(inside[np.isfinite(one[..., 0])].mean())
        low, high = found_in(weak_spring(0.03), seed).absent[3, 1]
        weak.append(low <= 0.03 <= high)
    assert np.mean(covered) > 0.85
    assert np.mean(weak) > 0.6


def test_what_is_there_or_is_no_candidate_has_no_interval():
    law = found_in(weak_spring(), 0, Library.polynomial(2).where(ALLOWED))
    known = np.isnan(law.absent[..., 0])
    assert known[:, 0].tolist() == [True, True, True, False, True, True]  # x^2 alone is searched
    assert (known[:, 1] == law.native.support[:, 1]).all()


def test_only_data_that_tell_little_leave_terms_unseen():
    assert "not seen" not in str(found_in(weak_spring(), 0))
    # In the frame in which a body cools down to 0 a constant is the same law around elsewhere.
    t, rng = np.linspace(0, 20, 200), np.random.default_rng(0)
    found = vl.discover(t, 20 + 60 * np.exp(-0.2 * t)[:, None] + 0.3 * rng.normal(size=(200, 1)))
    assert np.isinf(found.absent).any()
    assert "not seen" not in str(found)
    t = TURNS[:30]  # half a turn
    x = weak_spring().simulate(t, (1.0, 0.0)) + 0.02 * np.random.default_rng(0).normal(size=(30, 2))
    short = vl.discover(t, x, degree=2)
    assert "not seen, though they may be as large as terms of the law: " in str(short)
