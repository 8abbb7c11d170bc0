"""`SplineSINDy` does what a user of pysindy expects of a model."""

import re

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite.study import add_noise

LAW = vl.PolynomialSystem.from_terms(
    {"x0": {"x0": -0.1, "x1": 2}, "x1": {"x0": -2, "x1": -0.1}}, degree=2
)
TIMES = np.linspace(0, 15, 400)


@pytest.fixture(scope="module")
def path():
    return LAW.simulate(TIMES, (2, 0))


@pytest.fixture(scope="module")
def model(path):
    return vl.SplineSINDy(degree=2).fit(path, t=TIMES)


def test_coefficients_features_and_equations_are_those_of_pysindy(model, path, capsys):
    pysindy = pytest.importorskip("pysindy")
    other = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=0.05)).fit(path, t=TIMES)
    assert model.get_feature_names() == other.get_feature_names()
    assert model.coefficients().shape == other.coefficients().shape
    np.testing.assert_allclose(model.coefficients(), other.coefficients(), atol=2e-3)
    np.testing.assert_allclose(model.predict(path), other.predict(path), atol=5e-3)
    assert model.score(path, t=TIMES) == pytest.approx(other.score(path, t=TIMES), abs=1e-3)
    np.testing.assert_allclose(
        model.simulate(path[0], TIMES), other.simulate(path[0], TIMES), atol=0.05
    )
    model.print()
    ours = capsys.readouterr().out
    other.print()
    assert _form(ours) == _form(capsys.readouterr().out)


def _form(text):
    """Printed equations, whatever the numbers are."""
    return re.sub(r"\d+\.\d+", "#", text).split()


def test_the_law_is_that_of_discover(model, path):
    found = vl.discover(TIMES, path, degree=2)
    np.testing.assert_array_equal(model.coefficients(), found.coefficients.T)
    assert model.discovery.status == found.status == "ok"


def test_a_time_step_serves_for_even_times(model, path):
    step = TIMES[1] - TIMES[0]
    again = vl.SplineSINDy(degree=2).fit(path, t=step)
    np.testing.assert_allclose(again.coefficients(), model.coefficients(), rtol=1e-6)


@pytest.mark.parametrize("times", [TIMES, [TIMES, TIMES], TIMES[1] - TIMES[0]])
def test_several_trajectories_share_a_law(path, times):
    rng = np.random.default_rng(0)
    other = LAW.simulate(TIMES, (-1, 1))
    runs = [add_noise(run, 0.02, rng) for run in (path, other)]
    model = vl.SplineSINDy(degree=2).fit(runs, t=times, feature_names=("a", "b"))
    np.testing.assert_array_equal(model.coefficients() != 0, LAW.coefficients.T != 0)
    assert model.get_feature_names()[:5] == ["1", "a", "b", "a^2", "a b"]
    assert model.score(runs, t=times) > 0.9


def test_rows_of_nan_are_missing(path):
    x = path.copy()
    x[::7] = np.nan
    model = vl.SplineSINDy(degree=2).fit(x, t=TIMES)
    np.testing.assert_allclose(model.coefficients(), LAW.coefficients.T, atol=1e-4)
    assert model.score(x, t=TIMES) > 0.999


def test_bad_input_is_named(path):
    with pytest.raises(ValueError, match=r"feature_names: must name 2 variables, got \('a',\)"):
        vl.SplineSINDy().fit(path, t=TIMES, feature_names=np.array(["a"]).tolist())
    with pytest.raises(ValueError, match=r"feature_names: must name 2 variables, got \(\)"):
        vl.SplineSINDy().fit(path, t=TIMES, feature_names=[])
    with pytest.raises(ValueError, match="degree: must be an integer"):
        vl.SplineSINDy(degree="a")
    with pytest.raises(ValueError, match=r"model: must be fitted first: call fit\(x, t\)"):
        vl.SplineSINDy().predict(path)
    with pytest.raises(ValueError, match=r"x: must have shape .* a list of such, got shapes"):
        vl.SplineSINDy().fit([], t=1.0)
    with pytest.raises(ValueError, match="t: must be a positive time step"):
        vl.SplineSINDy().fit(path, t=0.0)
    with pytest.raises(ValueError, match="t: must hold times for 2 trajectories, got 1"):
        vl.SplineSINDy().fit([path, path], t=[TIMES])
    with pytest.raises(ValueError, match="x: must hold at least 4 samples, got 2"):
        vl.SplineSINDy(degree=1).fit(path, t=TIMES).score(path[:2], t=TIMES[:2])


def test_trajectories_of_other_lengths_share_a_law(path):
    model = vl.SplineSINDy(degree=1).fit([path, path[:200]], t=(TIMES, TIMES[:200]))
    np.testing.assert_allclose(model.coefficients()[:, 1:], LAW.coefficients[1:3].T, atol=1e-5)
    first, second = model.predict([path, path[:200]])
    np.testing.assert_array_equal(first[:200], second)
    assert model.score([path, path[:200]], t=[TIMES, TIMES[:200]]) > 0.999


def test_what_does_not_move_has_no_score(model, path):
    assert np.isnan(model.score(np.stack([path[:, 0], np.ones(len(path))], axis=1), t=TIMES))


def test_small_numbers_and_warnings_are_printed(capsys):
    law = vl.PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1, "y": -1e-4}})
    t = np.linspace(0, 30, 600)
    model = vl.SplineSINDy(degree=2).fit(law.simulate(t, (1, 0)), t=np.array(t[1]))
    model.print(lhs=["a", "b"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == ["a = 1.000 x1", "b = -1.000 x0 + -0.0001 x1"]
    assert lines[2].startswith("warning: the motion repeats one closed orbit")
    assert any(line.startswith("warning: dy/dt is settled by") for line in lines)
    assert repr(model) == "SplineSINDy(degree=2, seed=0)"
