"""The paper's optimiser: its losses from their definition, and small systems it has to find."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from vidsindy_lite.dynamics import PolynomialSystem, clamped_knots, monomial_exponents
from vidsindy_lite.study.metrics import score
from vidsindy_lite.study.spline_ado import SplineADOSettings, _Fit, spline_ado

RANDOM = np.random.default_rng
SHORT = {"pretraining": 200, "epochs": 100, "alternations": 2, "collocation_per_knot": 3}
SPIRAL = PolynomialSystem.from_terms(
    {"x": {"x": -0.5, "y": 2}, "y": {"x": -2, "y": -0.5}}, degree=2
)


def spiral(n=150, offset=(3.0, -1.0)):
    t = np.linspace(0, 6, n)
    return t, SPIRAL.simulate(t, [2.0, 0.0]) + offset


def fitted(t, x, seed=0, **settings):
    exponents = monomial_exponents(x.shape[1], 3)
    return _Fit(t, x, exponents, SplineADOSettings(**settings), np.random.default_rng(seed))


@pytest.mark.parametrize("gap", [slice(0), slice(40, 50)])
def test_losses_are_those_of_the_paper(gap):
    t, x = spiral()
    x[gap] = np.nan
    fit, rng = fitted(t, x, knots_per_sample=80 / 149, collocation_per_knot=4), RANDOM(1)
    shape = fit.coefficients.shape
    fit.coefficients = np.where(rng.random(shape) < 0.5, rng.standard_normal(shape), 0.0)
    fit.offset = rng.standard_normal(2)
    data_loss, physics_loss, _ = fit.losses()

    # The same collocation times, from the same seed, and everything else with scipy.
    breakpoints = np.linspace(t[0], t[-1], 81)
    seen = ~np.isnan(x[:, 0])
    fractions = RANDOM(0).uniform(size=(80, 4))
    times = (breakpoints[:-1, None] + fractions * np.diff(breakpoints)[:, None]).ravel()
    spline = BSpline(clamped_knots(breakpoints), fit.control_points, 3)
    data = (x - x[seen].mean(axis=0)) / x[seen].std(axis=0)
    residual = (spline(t) + fit.offset - data)[seen]
    assert data_loss == pytest.approx((residual**2).sum() / seen.sum())
    law = PolynomialSystem(("x", "y"), fit.exponents, fit.coefficients)
    spans = np.clip(np.searchsorted(breakpoints, t[seen], side="right") - 1, 0, 79)
    near = np.isin(np.arange(80), [*spans, *(spans - 1), *(spans + 1)])
    asked = times[np.repeat(near, 4)]
    assert near.all() == seen.all()
    residual = fit.units.time * spline(asked, 1) - law(spline(asked))
    assert physics_loss == pytest.approx((residual**2).sum() / len(asked))


@given(st.integers(0, 2**31), st.floats(0.1, 0.9))
@settings(max_examples=10, deadline=None)
def test_gradients_are_those_of_differences(seed, share):
    rng = RANDOM(seed)
    t, x = np.sort(rng.uniform(0, 1, 40)), rng.standard_normal((40, 3))
    x[rng.random(40) < 0.2] = np.nan
    fit = fitted(t, x, collocation_per_knot=2, physics_weight=0.3)
    shape = fit.coefficients.shape
    fit.coefficients = np.where(rng.random(shape) < share, rng.standard_normal(shape), 0.0)
    fit.offset = rng.standard_normal(3)
    unknowns = [fit.control_points, fit.coefficients, fit.offset]
    gradients = fit.losses()[2]
    for unknown, gradient in zip(unknowns, gradients, strict=True):
        away, place = rng.standard_normal(unknown.shape) * (unknown != 0), unknown.copy()
        around = []
        for step in (1e-5, -1e-5):
            unknown[:] = place + step * away
            data_loss, physics_loss, _ = fit.losses()
            around.append(data_loss + 0.3 * physics_loss)
        unknown[:] = place
        slope, rounding = (around[0] - around[1]) / 2e-5, 1e-10 * around[0]
        off = 1e-6 * np.linalg.norm(gradient) + rounding
        assert (gradient * away).sum() == pytest.approx(slope, abs=off)


@pytest.mark.parametrize("gap", [slice(0), slice(60, 100)])
def test_a_spiral_is_found_away_from_its_origin_and_across_a_gap(gap):
    t, x = spiral()
    x[gap] = np.nan
    found = spline_ado(t, x, degree=2, **SHORT)
    result = score(found, SPIRAL.shift((3, -1)))
    assert result.exact
    assert result.max_coefficient_error < 1e-2
    assert found.history[0]["iteration"] == 1
    # A linear law has its constants at zero in one frame only, the data's frame has them all.
    shifted = found.native.shift(found.offset)
    kept = np.where(np.abs(shifted.coefficients) < 0.1, 0, shifted.coefficients)
    np.testing.assert_array_equal(found.system.coefficients, kept)


def test_equal_seeds_give_equal_laws():
    t, x = spiral(80)
    short = SHORT | {"pretraining": 20, "epochs": 20}
    first, again, other = (
        spline_ado(t, x, degree=2, seed=s, **short).native.coefficients for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


LEAST = ("knots_per_sample", "collocation_per_knot", "pretraining", "epochs", "learning_rate")


@pytest.mark.parametrize(
    ("x", "options", "message"),
    [
        (spiral(80)[1][:5], {}, "x: must hold at least 6 samples, got 5"),
        (spiral(80)[1] * [1, 0], {}, "x: every coordinate must move"),
        (spiral(80)[1], {"seed": -1}, "seed: must be an integer of at least 0, got -1"),
        *[(spiral(80)[1], {name: 0}, f"{name}: must be .*at least .*, got 0") for name in LEAST],
        *[(spiral(80)[1], {"prune": v}, f"prune: must be .*, got {v}")
          for v in (-1, np.nan, np.inf)],
    ],
)  # fmt: skip
def test_bad_input(x, options, message):
    with pytest.raises(ValueError, match=message):
        spline_ado(np.linspace(0, 6, len(x)), x, 2, **options)
