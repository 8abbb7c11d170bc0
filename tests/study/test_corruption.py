"""Noise, gaps and all other errors have the level, the rate and the shape that they promise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidsindy_lite.dynamics import PolynomialSystem
from vidsindy_lite.study.corruption import (
    add_averaged_noise,
    add_correlated_noise,
    add_drift,
    add_noise,
    add_outliers,
    add_proportional_noise,
    coarse_path,
    distort,
    drop_blocks,
    drop_fibers,
    jitter,
    kicked_path,
    quantise,
)


def gap_lengths(x):
    """Lengths of the runs of missing rows; a row is missing as a whole."""
    missing = np.isnan(x).any(axis=1)
    assert (missing == np.isnan(x).all(axis=1)).all()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]])))
    return edges[1::2] - edges[::2]


def states(n, d=3):
    return np.random.default_rng(1).standard_normal((n, d)) * np.arange(1, d + 1)


@given(st.floats(0, 1), st.integers(0, 2**32 - 1))
def test_noise_has_the_stated_standard_deviation(level, seed):
    x = states(4000)
    noise = add_noise(x, level, np.random.default_rng(seed)) - x
    # The standard deviation of 4000 draws is known to 1.1 %; five of its standard errors.
    np.testing.assert_allclose(noise.std(axis=0), level * x.std(axis=0), rtol=0.056, atol=1e-12)
    np.testing.assert_allclose(noise.mean(axis=0) / x.std(axis=0), 0, atol=5 * level / 60 + 1e-12)


@given(st.integers(200, 3000), st.integers(0, 80), st.integers(0, 2**32 - 1))
def test_blocks_are_separate_and_of_one_percent_each(n, percent, seed):
    # Gaps that never touch need a row between them: with few rows only low rates fit.
    percent = min(percent, int(100 * n / (n + 100)))
    dropped = drop_blocks(states(n), percent / 100, np.random.default_rng(seed))
    lengths = gap_lengths(dropped)
    assert len(lengths) == percent
    assert lengths.sum() == round(percent / 100 * n)
    assert all(abs(length - n / 100) < 1.51 for length in lengths)


@given(st.integers(50, 3000), st.floats(0.1, 0.8), st.integers(0, 2**32 - 1))
def test_fibers_share_the_rate(n, rate, seed):
    lengths = gap_lengths(drop_fibers(states(n), rate, np.random.default_rng(seed)))
    assert len(lengths) == 5
    assert lengths.sum() == round(rate * n)
    assert lengths.max() - lengths.min() <= 1


def waves(n=4000):
    """A smooth path of three coordinates with other means and spreads."""
    t = np.linspace(0, 40 * np.pi, n)
    return np.column_stack((np.sin(t), 5 + 2 * np.cos(t), 0.1 * np.sin(t / 3) - 3))


@pytest.mark.parametrize(
    ("corrupt", "level"),
    [
        (add_noise, 0.2), (drop_blocks, 0.2), (drop_fibers, 0.2), (add_proportional_noise, 0.05),
        (add_correlated_noise, 0.05), (add_averaged_noise, 0.05), (add_outliers, 0.02),
        (add_drift, 0.01), (distort, 0.003), (quantise, 1 / 64), (jitter, 0.3),
    ],
)  # fmt: skip
def test_errors_are_copies_that_repeat_with_their_seed_and_none_at_level_zero(corrupt, level):
    x = waves(500)
    before = x.copy()
    first, again, other = (corrupt(x, level, np.random.default_rng(s)) for s in (3, 3, 4))
    assert (x == before).all()
    assert first.shape == x.shape
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other, equal_nan=True)
    if corrupt is not jitter:
        x[::50] = np.nan
        assert np.isnan(corrupt(x, level, np.random.default_rng(0))[::50]).all()
    if corrupt is not quantise:
        x = before
        np.testing.assert_allclose(corrupt(x, 0, np.random.default_rng(0)), x, atol=1e-12)
    for bad in (-0.1, np.nan):
        with pytest.raises(ValueError, match="(level|rate): must"):
            corrupt(x, bad, np.random.default_rng(0))
    with pytest.raises(ValueError, match="rng: must be of type Generator, got 0"):
        corrupt(x, level, 0)


@pytest.mark.parametrize(
    ("corrupt", "x", "level", "message"),
    [
        (drop_blocks, np.full((5, 1), np.inf), 0.1, "x: must not be infinite, got 5"),
        (drop_blocks, np.zeros((500, 1)), 1.0, "rate: must be .* got 1"),
        (drop_fibers, np.zeros((10, 1)), 0.9, "rate: 5 separate gaps of 9 rows .* into 10 rows"),
    ],
)
def test_bad_input(corrupt, x, level, message):
    with pytest.raises(ValueError, match=message):
        corrupt(x, level, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("corrupt", "remembered"),
    [
        (add_correlated_noise, {1: 0.9, 5: 0.9**5}),
        (add_averaged_noise, {1: 8 / 9, 5: 4 / 9, 9: 0, 20: 0}),
    ],
)
def test_noise_remembers(corrupt, remembered):
    x = waves(20_000)
    error = corrupt(x, 0.05, np.random.default_rng(0)) - x
    np.testing.assert_allclose(error.std(axis=0), 0.05 * x.std(axis=0), rtol=0.1)
    for column in error.T:
        for lag, expected in remembered.items():
            found = np.corrcoef(column[lag:], column[:-lag])[0, 1]
            assert found == pytest.approx(expected, abs=0.05)


def test_outliers_hit_as_many_rows_as_they_should():
    x = waves(1000)
    error = add_outliers(x, 0.02, np.random.default_rng(0)) - x
    assert (error != 0).any(axis=1).sum() == 20
    hit = error[(error != 0).any(axis=1)] / x.std(axis=0)
    assert 0.7 < hit.std() < 1.3


def test_drift_is_slow_and_as_high_as_stated():
    x = waves()
    error = (add_drift(x, 0.01, np.random.default_rng(0)) - x) / x.std(axis=0)
    assert np.abs(error).max() <= 0.01 + 1e-12
    assert np.abs(error).max() > 0.005
    assert np.abs(np.diff(error, axis=0)).max() < 0.01 * 1.3 * 2 * np.pi / len(x)


def test_distortion_depends_on_the_place_alone():
    x = waves(1000)
    twice = np.concatenate((x, x))
    bent = distort(twice, 0.003, np.random.default_rng(0))
    np.testing.assert_allclose(bent[:1000], bent[1000:])
    largest = np.abs(bent - twice).max(axis=0) / np.ptp(x, axis=0)
    np.testing.assert_allclose(largest, 0.003)
    still = np.column_stack((x[:, 0], np.ones(1000)))
    np.testing.assert_array_equal(distort(still, 0.003, np.random.default_rng(0))[:, 1], 1)


def test_quantised_values_lie_on_a_grid():
    x = waves()
    grid = quantise(x, 1 / 64, np.random.default_rng(0))
    step = np.ptp(x, axis=0) / 64
    assert np.abs(grid - x).max(axis=0) == pytest.approx(step / 2, rel=0.02)
    for column, one in zip(grid.T, step, strict=True):
        assert 64 <= len(np.unique(np.round(column / one, 6))) <= 66
    with pytest.raises(ValueError, match="level: must be positive, got 0"):
        quantise(x, 0, np.random.default_rng(0))


def test_jitter_reads_the_path_at_other_times():
    line = np.arange(2000.0)[:, None] * [1, -3]
    error = jitter(line, 0.3, np.random.default_rng(0)) - line
    np.testing.assert_allclose(error[:, 1], -3 * error[:, 0], atol=1e-9)
    assert error[1:-1, 0].std() == pytest.approx(0.3, rel=0.06)


OSCILLATOR = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1}})


def test_a_coarse_path_is_off_smoothly_and_a_tight_one_is_not():
    t = np.linspace(0, 20, 400)
    true = np.column_stack((np.cos(t), -np.sin(t)))
    coarse = coarse_path(OSCILLATOR, t, (1, 0)) - true
    assert 1e-6 < np.abs(coarse).max() < 1e-3
    tight = coarse_path(OSCILLATOR, t, (1, 0), "DOP853", rtol=1e-10, atol=1e-10) - true
    assert np.abs(tight).max() < 1e-8
    with pytest.raises(ValueError, match="rate: must have a solution up to 20, got"):
        coarse_path(lambda x: x**2, t, np.array([1.0]))


def test_kicks_add_what_is_stated():
    t = np.linspace(0, 4, 11)
    still = PolynomialSystem.from_terms({"x": {"1": 0}, "y": {"1": 0}})
    rng = np.random.default_rng(0)
    ends = np.array([kicked_path(still, t, (1, 2), (0.5, 0.1), rng)[-1] for _ in range(200)])
    np.testing.assert_allclose(ends.mean(axis=0), (1, 2), atol=0.3)
    np.testing.assert_allclose(ends.std(axis=0), (1, 0.2), rtol=0.2)
    calm = kicked_path(OSCILLATOR, t, (1, 0), (0, 0), rng, substeps=40)
    np.testing.assert_allclose(calm[:, 0], np.cos(t), atol=1e-8)
    with pytest.raises(ValueError, match="kicks: must"):
        kicked_path(OSCILLATOR, t, (1, 0), (0.1,), rng)
