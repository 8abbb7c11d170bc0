"""Errors that all samples share, as the law counts them in."""

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite import study


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


def oscillation():
    """dx/dt = -y, dy/dt = x, with noise of 1e-3."""
    t = np.linspace(0, 20, 200)
    x = np.column_stack((np.cos(t), np.sin(t)))
    return t, x, x + 1e-3 * np.random.default_rng(0).normal(size=x.shape)


def test_no_systematic_errors_change_nothing():
    t, x, noisy = oscillation()
    plain, none = (vl.discover(t, noisy, 2, systematic=e) for e in (None, x[None][:0]))
    np.testing.assert_array_equal(plain.coefficients, none.coefficients)
    np.testing.assert_array_equal(plain.covariance, none.covariance)


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


def test_errors_of_the_axes_do_not_explain_the_noise():
    """How far axes are from right angles is told to what is given, not beyond."""
    law, rng = study.SYSTEMS["NoseHoover"].shift([0.5, 0.5, 0.5]), np.random.default_rng(1)
    t, x = law.trajectory(600)
    lean = 0.005 * np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]])
    noisy = x + 0.01 * x.std(axis=0) * rng.multivariate_normal(
        np.zeros(3), np.ones((3, 3)) * 0.7 + 0.3 * np.eye(3), 600
    )
    found = vl.discover(t, noisy, systematic=(noisy @ lean)[None])
    assert study.score(found, law).exact
    rows = dict(zip(law.terms, law.coefficients, strict=True))
    true = np.array([rows.get(term, np.zeros(3)) for term in found.terms])
    kept = found.system.support
    apart = (found.coefficients - true)[kept] / found.standard_errors[kept]
    assert np.sqrt(np.mean(apart**2)) < 2


@pytest.mark.parametrize(
    ("systematic", "message"),
    [
        (np.zeros((2, 9, 2)), r"systematic: must have shape \(k, 10, 2\), got \(2, 9, 2\)"),
        (np.zeros((10, 2)), r"systematic: must have shape \(k, 10, 2\), got \(10, 2\)"),
        (np.full((1, 10, 2), np.nan), "systematic: must be finite where x is"),
        (-1, r"systematic: must have shape \(k, n, d\), got -1"),
    ],
)
def test_malformed_systematic_errors_are_named(systematic, message):
    t = np.arange(10.0)
    with pytest.raises(ValueError, match=message):
        vl.discover(t, np.column_stack((np.sin(t), np.cos(t))), 1, systematic=systematic)
