"""The paper's optimiser: its losses from their definition, and small systems it has to find."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from vidsindy_lite.dynamics import (
    PolynomialSystem,
    clamped_knots,
    monomial_exponents,
    monomials,
)
from vidsindy_lite.study.metrics import score
from vidsindy_lite.study.paper import SYSTEMS
from vidsindy_lite.study.spline_ado import (
    SplineADOSettings,
    _Fit,
    spline_ado,
    spline_ado_batch,
    stridge,
)

SHORT = {"pretraining": 200, "epochs": 100, "alternations": 2, "collocation_per_knot": 3}
SPIRAL = PolynomialSystem.from_terms(
    {"x": {"x": -0.5, "y": 2}, "y": {"x": -2, "y": -0.5}}, degree=2
)


def spiral(n=150, offset=(3.0, -1.0)):
    t = np.linspace(0, 6, n)
    return t, SPIRAL.simulate(t, [2.0, 0.0]) + offset


def fitted(records, t, degree=2, **settings):
    records = np.asarray(records)
    generators = [np.random.default_rng(one) for one in range(len(records))]
    chosen = SplineADOSettings(**settings)
    exponents = monomial_exponents(records.shape[2], degree)
    return _Fit(t, records, exponents, chosen, generators, torch.device("cpu"))


def test_losses_are_those_of_the_paper():
    t, x = spiral()
    hidden = x.copy()
    hidden[40:50] = np.nan
    fit = fitted([x, hidden], t, knots_per_sample=80 / 149, collocation_per_knot=4)
    rng = np.random.default_rng(0)
    coefficients = np.where(rng.random((2, 6, 2)) < 0.5, rng.standard_normal((2, 6, 2)), 0.0)
    offset = rng.standard_normal((2, 2))
    fit.restart(coefficients)
    fit.offset += fit.offset.new_tensor(offset[:, :, None])
    found = np.array([loss.numpy() for loss in fit.losses()])

    # The same collocation times, from the same seeds, and everything else with scipy.
    breakpoints = np.linspace(t[0], t[-1], 81)
    for one, states in enumerate((x, hidden)):
        seen = ~np.isnan(states[:, 0])
        fractions = np.random.default_rng(one).uniform(size=(80, 4))
        times = (breakpoints[:-1, None] + fractions * np.diff(breakpoints)[:, None]).ravel()
        spline = BSpline(clamped_knots(breakpoints), fit.control_points[one].numpy().T, 3)
        data = (states - states[seen].mean(axis=0)) / states[seen].std(axis=0)
        residual = (spline(t) + offset[one] - data)[seen]
        assert found[0, one] == pytest.approx((residual**2).sum() / seen.sum())
        law = PolynomialSystem(("x", "y"), fit.exponents, coefficients[one])
        spans = np.clip(np.searchsorted(breakpoints, t[seen], side="right") - 1, 0, 79)
        near = np.isin(np.arange(80), [*spans, *(spans - 1), *(spans + 1)])
        asked = times[np.repeat(near, 4)]
        assert near.all() == seen.all()
        residual = fit.units[one].time * spline(asked, 1) - law(spline(asked))
        assert found[1, one] == pytest.approx((residual**2).sum() / len(asked))


@given(st.integers(0, 2**31), st.floats(0.1, 0.9))
@settings(max_examples=20, deadline=None)
def test_gradients_are_those_of_automatic_differentiation(seed, share):
    rng = np.random.default_rng(seed)
    t = np.sort(rng.uniform(0, 1, 40))
    records = rng.standard_normal((2, 40, 3))
    records[rng.random((2, 40)) < 0.2] = np.nan
    fit = fitted(records, t, degree=3, collocation_per_knot=2, physics_weight=0.3)
    shape = fit.coefficients.shape
    fit.restart(np.where(rng.random(shape) < share, rng.standard_normal(shape), 0.0))
    fit.losses()
    unknowns = [fit.control_points, fit.coefficients, fit.offset]
    written = [unknown.grad.clone() for unknown in unknowns]

    free = [unknown.clone().requires_grad_() for unknown in unknowns]
    control, coefficients, offset = free
    measured = (fit.sampling.to_dense() @ control.transpose(1, 2)).transpose(1, 2)
    loss = (fit.weights * (measured + offset - fit.data) ** 2).sum()
    windows = control.unfold(2, 4, 1)
    both = torch.einsum("bdma,baqm->bdqm", windows, fit.basis)
    points, slopes = (half.flatten(2) for half in both.chunk(2, dim=2))
    powers = torch.tensor(fit.exponents)[:, None]
    terms = (points.transpose(1, 2)[:, None] ** powers).prod(dim=3)
    residual = slopes - torch.einsum("bli,blk->bik", coefficients * fit.mask, terms)
    loss = loss + 0.3 * (fit.shares * residual**2).sum()
    loss.backward()
    for found, unknown in zip(written, free, strict=True):
        torch.testing.assert_close(found, unknown.grad, rtol=1e-9, atol=1e-9)


def test_a_batch_finds_the_laws_of_its_records_alone():
    t, x = spiral(80)
    noisy = x + 0.02 * np.random.default_rng(0).standard_normal(x.shape)
    noisy[30:35] = np.nan
    records, short = [x, noisy, 2 * noisy], SHORT | {"pretraining": 60, "epochs": 40}
    together = spline_ado_batch(t, records, 2, [3, 4, 5], **short)
    for record, seed, law in zip(records, (3, 4, 5), together, strict=True):
        alone = spline_ado(t, record, 2, seed, **short)
        np.testing.assert_array_equal(law.native.support, alone.native.support)
        np.testing.assert_allclose(law.native.coefficients, alone.native.coefficients, rtol=1e-4)
        np.testing.assert_allclose(law.curve, alone.curve, atol=1e-5)
        assert len(law.history) == len(alone.history)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")
def test_a_gpu_finds_the_same_law():
    t, x = spiral(80)
    here, there = (spline_ado(t, x, 2, device=name, **SHORT).native for name in ("cpu", "cuda"))
    np.testing.assert_array_equal(here.support, there.support)
    np.testing.assert_allclose(here.coefficients, there.coefficients, rtol=1e-3)


@pytest.mark.slow
def test_lorenz_is_found_from_clean_data():
    truth = SYSTEMS["Lorenz"].shift((10, 10, 0))
    t, x = truth.trajectory(300)
    result = score(spline_ado(t, x, pretraining=300, epochs=300), truth)
    assert result.exact
    assert result.l2 < 1e-3


@pytest.mark.parametrize("gap", [slice(0), slice(60, 100)])
def test_a_spiral_is_found_away_from_its_origin_and_across_a_gap(gap):
    t, x = spiral()
    x[gap] = np.nan
    found = spline_ado(t, x, degree=2, **SHORT)
    result = score(found, SPIRAL.shift((3, -1)))
    assert result.exact
    assert result.max_coefficient_error < 1e-2
    # A linear law has its constants at zero in one frame only, the data's frame has them all.
    shifted = found.native.shift(found.offset)
    kept = np.where(np.abs(shifted.coefficients) < 0.1, 0, shifted.coefficients)
    np.testing.assert_array_equal(found.system.coefficients, kept)


def test_history_goes_on_and_the_loss_falls():
    t, x = spiral()
    x = x + 0.02 * np.random.default_rng(0).standard_normal(x.shape)
    history = spline_ado(t, x, degree=2, **SHORT).history
    assert set(history[0]) == {"iteration", "seconds", "data_loss", "physics_loss", "terms"}
    assert history[0]["iteration"] == 1
    for name in ("iteration", "seconds"):
        assert (np.diff([entry[name] for entry in history]) > 0).all()
    assert history[0]["terms"] == 12
    assert history[-1]["terms"] < 12
    total = [entry["data_loss"] + entry["physics_loss"] for entry in history]
    assert total[-1] < total[0]


def test_equal_seeds_give_equal_laws_and_no_global_state_is_touched():
    t, x = spiral(80)
    numpy_state, torch_state = np.random.get_state()[1].copy(), torch.get_rng_state()  # noqa: NPY002
    short = SHORT | {"pretraining": 20, "epochs": 20}
    first, again, other = (
        spline_ado(t, x, degree=2, seed=s, **short).native.coefficients for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    np.testing.assert_array_equal(np.random.get_state()[1], numpy_state)  # noqa: NPY002
    assert torch.equal(torch.get_rng_state(), torch_state)


def test_the_law_does_not_depend_on_the_units_of_time_and_space():
    t, x = spiral(80)
    short = SHORT | {"pretraining": 50, "epochs": 50, "prune": 0.0}
    plain = spline_ado(t, x, degree=2, **short).native
    scaled = spline_ado(10 * t + 3, 100 * x, degree=2, **short).native
    factor = 100.0 ** (1 - plain.exponents.sum(axis=1)[:, None]) / 10
    # Gradient descent amplifies the rounding.
    np.testing.assert_allclose(scaled.coefficients, plain.coefficients * factor, rtol=1e-3)


def lorenz_rows():
    truth = SYSTEMS["Lorenz"]
    _, x = truth.trajectory(600)
    return truth, monomials(x, truth.exponents), truth(x)


def test_stridge_recovers_lorenz_from_exact_derivatives():
    truth, library, derivative = lorenz_rows()
    found = stridge(library, derivative, np.random.default_rng(0))
    assert ((found != 0) == truth.support).all()
    np.testing.assert_allclose(found, truth.coefficients, rtol=1e-8)


def test_stridge_does_not_depend_on_units():
    _, library, derivative = lorenz_rows()
    rng = np.random.default_rng(1)
    size, speed = 10.0 ** rng.uniform(-3, 3, library.shape[1]), 10.0 ** rng.uniform(-3, 3, 3)
    found = stridge(library, derivative, np.random.default_rng(0))
    scaled = stridge(library * size, derivative * speed, np.random.default_rng(0))
    np.testing.assert_allclose(scaled * size[:, None] / speed, found, rtol=1e-6, atol=1e-9)


def test_the_refit_of_stridge_is_plain_least_squares_on_all_rows():
    truth, library, derivative = lorenz_rows()
    rng = np.random.default_rng(0)
    noisy = derivative + rng.standard_normal(derivative.shape)
    found = stridge(library, noisy, rng, sparsity_weight=1e-2)
    for column, target in zip(found.T, noisy.T, strict=True):
        inside = np.flatnonzero(column)
        assert 0 < len(inside) < library.shape[1]
        expected = np.linalg.lstsq(library[:, inside], target, rcond=None)[0]
        np.testing.assert_allclose(column[inside], expected, rtol=1e-6)


LEAST = ("knots_per_sample", "collocation_per_knot", "pretraining", "epochs", "learning_rate")


@pytest.mark.parametrize(
    ("records", "options", "message"),
    [
        ([spiral(80)[1][:5]], {}, "x: must hold at least 6 samples, got 5"),
        ([spiral(80)[1] * [1, 0]], {}, "x: every coordinate must move"),
        ([], {}, "records: must be at least one, .* got none"),
        ([np.ones((80, 2)), np.ones((79, 2))], {}, r"records: .* got \(80, 2\), \(79, 2\)"),
        ([spiral(80)[1]] * 2, {"seeds": [0]}, "seeds: must be one a record, 2, got 1"),
        ([spiral(80)[1]], {"seeds": [-1]}, "seed: must be an integer of at least 0, got -1"),
        ([spiral(80)[1]], {"physics_weight": (1, 2)}, "physics_weight: .* one a record"),
        ([spiral(80)[1]], {"device": "moon"}, "device: must be one that PyTorch knows, got 'moon'"),
        *[([spiral(80)[1]], {name: 0}, f"{name}: must be at least .*, got 0") for name in LEAST],
        *[([spiral(80)[1]], {"prune": v}, f"prune: must be at least 0, got {v}")
          for v in (-1, np.nan, np.inf)],
    ],
)  # fmt: skip
def test_bad_input(records, options, message):
    t = np.linspace(0, 6, len(records[0]) if records else 80)
    with pytest.raises(ValueError, match=message):
        spline_ado_batch(t, records, 2, **options)
