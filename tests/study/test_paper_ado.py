"""The paper's optimiser: its losses from their definition, and small systems it has to find."""

import numpy as np
import pytest
import torch
from scipy.interpolate import BSpline

from vidsindy_lite.dynamics import (
    PolynomialSystem,
    clamped_knots,
    monomial_exponents,
    monomial_gradients,
    monomials,
)
from vidsindy_lite.study.metrics import score
from vidsindy_lite.study.paper_ado import (
    PaperSettings,
    _curve,
    _Fit,
    _monomials,
    discover_paper,
    stridge,
)
from vidsindy_lite.study.systems import SYSTEMS

SHORT = {"pretraining": 200, "epochs": 100, "alternations": 2, "collocation_per_knot": 3}
SPIRAL = PolynomialSystem.from_terms(
    {"x": {"x": -0.5, "y": 2}, "y": {"x": -2, "y": -0.5}}, degree=2
)


def spiral(n=150, offset=(3.0, -1.0)):
    t = np.linspace(0, 6, n)
    return t, SPIRAL.simulate(t, [2.0, 0.0]) + offset


def test_monomials_and_their_gradient_are_those_of_numpy():
    rng = np.random.default_rng(0)
    x, exponents = rng.standard_normal((20, 3)), monomial_exponents(3, 3)
    points = torch.tensor(x, requires_grad=True)
    values = _monomials(points, exponents)
    np.testing.assert_allclose(values.detach(), monomials(x, exponents))
    weights = rng.standard_normal(values.shape)
    (values * torch.tensor(weights)).sum().backward()
    expected = np.einsum("nl,nli->ni", weights, monomial_gradients(x, exponents))
    np.testing.assert_allclose(points.grad, expected)
    assert _monomials(points, exponents[:0]).shape == (20, 0)


def test_losses_are_those_of_the_paper():
    t, x = spiral()
    exponents = monomial_exponents(2, 2)
    rng = np.random.default_rng(0)
    settings = PaperSettings(knots_per_sample=80 / 149, collocation_per_knot=4)
    fit = _Fit(t, x, exponents, settings, rng)
    coefficients = np.where(rng.random((6, 2)) < 0.5, rng.standard_normal((6, 2)), 0.0)
    offset = rng.standard_normal(2)
    fit.restart(coefficients)
    with torch.no_grad():
        fit.offset += fit.offset.new_tensor(offset)
    data_loss, physics_loss = (float(loss.detach()) for loss in fit.losses())

    # The same collocation times, from the same seed, and everything else with scipy.
    breakpoints = np.linspace(t[0], t[-1], 81)
    fractions = np.random.default_rng(0).uniform(size=(80, 4))
    times = (breakpoints[:-1, None] + fractions * np.diff(breakpoints)[:, None]).ravel()
    spline = BSpline(clamped_knots(breakpoints), fit.control_points.numpy(force=True), 3)
    data = (x - x.mean(axis=0)) / x.std(axis=0)
    residual = spline(t) + offset - data
    assert data_loss == pytest.approx((residual**2).sum() / len(t))
    law = PolynomialSystem(("x", "y"), exponents, coefficients)
    residual = fit.units.time * spline(times, 1) - law(spline(times))
    assert physics_loss == pytest.approx((residual**2).sum() / len(times))


def test_collocation_covers_every_knot_span():
    t, x = spiral()
    settings = PaperSettings(knots_per_sample=40 / 149, collocation_per_knot=5)
    fit = _Fit(t, x, monomial_exponents(2, 1), settings, np.random.default_rng(0))
    assert fit.basis.shape == (40, 5, 4)
    np.testing.assert_allclose(fit.basis.sum(dim=2).cpu(), 1)
    np.testing.assert_allclose(fit.slopes.sum(dim=2).cpu(), 0, atol=1e-9)
    ones = fit.control_points.new_ones((43, 2))
    np.testing.assert_allclose(_curve(fit.basis, ones).cpu(), np.ones((200, 2)))


def test_a_spiral_is_found_away_from_its_origin():
    t, x = spiral()
    found = discover_paper(t, x, degree=2, **SHORT)
    result = score(found, SPIRAL.shift((3, -1)))
    assert result.exact
    assert result.max_coefficient_error < 1e-2
    # A linear law has its constants at zero in one frame only, the data's frame has them all.
    shifted = found.native.shift(found.offset)
    kept = np.where(np.abs(shifted.coefficients) < 0.1, 0, shifted.coefficients)
    np.testing.assert_array_equal(found.system.coefficients, kept)


@pytest.mark.slow
def test_lorenz_is_found_from_clean_data():
    truth = SYSTEMS["Lorenz"].shift((10, 10, 0))
    t, x = truth.trajectory(300)
    result = score(discover_paper(t, x, pretraining=300, epochs=300), truth)
    assert result.exact
    assert result.l2 < 1e-3


def test_a_gap_is_crossed_by_physics():
    t, x = spiral()
    x[60:75] = np.nan
    result = score(discover_paper(t, x, degree=2, **SHORT), SPIRAL.shift((3, -1)))
    assert result.terms_found
    assert result.max_coefficient_error < 0.1


def test_history_goes_on_and_the_loss_falls():
    t, x = spiral()
    x = x + 0.02 * np.random.default_rng(0).standard_normal(x.shape)
    history = discover_paper(t, x, degree=2, **SHORT).history
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
        discover_paper(t, x, degree=2, seed=s, **short).native.coefficients for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    np.testing.assert_array_equal(np.random.get_state()[1], numpy_state)  # noqa: NPY002
    assert torch.equal(torch.get_rng_state(), torch_state)


def test_the_law_does_not_depend_on_the_units_of_time_and_space():
    t, x = spiral(80)
    short = SHORT | {"pretraining": 50, "epochs": 50, "prune": 0.0}
    plain = discover_paper(t, x, degree=2, **short).native
    scaled = discover_paper(10 * t + 3, 100 * x, degree=2, **short).native
    factor = 100.0 ** (1 - plain.exponents.sum(axis=1)[:, None]) / 10
    # Gradient descent amplifies the rounding.
    np.testing.assert_allclose(scaled.coefficients, plain.coefficients * factor, rtol=1e-3)


def test_bad_input():
    t, x = spiral(80)
    with pytest.raises(ValueError, match="t: must increase"):
        discover_paper(t[::-1], x)
    with pytest.raises(ValueError, match="x: must hold at least 6 samples, got 5"):
        discover_paper(t[:5], x[:5], degree=2)
    with pytest.raises(ValueError, match="x: every coordinate must move"):
        discover_paper(t, x * [1, 0])
    with pytest.raises(ValueError, match="seed: must be an integer of at least 0, got -1"):
        discover_paper(t, x, seed=-1)
    for name in ("knots_per_sample", "collocation_per_knot", "pretraining", "epochs"):
        with pytest.raises(ValueError, match=f"{name}: must be at least .*, got 0"):
            discover_paper(t, x, **{name: 0})


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


def test_a_dearer_term_is_a_rarer_term():
    _, library, derivative = lorenz_rows()
    noisy = derivative + 2 * np.random.default_rng(0).standard_normal(derivative.shape)
    weights = (0.0, 1e-3, 1e-2, 10.0)
    counts = [
        np.count_nonzero(stridge(library, noisy, np.random.default_rng(0), sparsity_weight=w))
        for w in weights
    ]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[-1]


def test_stridge_copes_with_a_column_of_zeros_and_a_target_of_zeros():
    x = np.random.default_rng(0).standard_normal((100, 2))
    library = np.column_stack([monomials(x, monomial_exponents(2, 2)), np.zeros(100)])
    found = stridge(library, np.zeros((100, 1)), np.random.default_rng(0))
    np.testing.assert_array_equal(found, np.zeros((7, 1)))


def test_stridge_rejects_bad_shapes():
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match=r"library and derivative: .* got \(5, 2\) and \(4, 1\)"):
        stridge(np.ones((5, 2)), np.ones((4, 1)), rng)
    with pytest.raises(ValueError, match="library: must hold at least 9 training rows, got 10"):
        stridge(np.ones((10, 9)), np.ones((10, 1)), rng)
