"""Noise and gaps have the level, the rate and the shape that the protocol asks for."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidsindy_lite.study.corruption import add_noise, drop_blocks, drop_fibers


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


def test_noise_leaves_missing_rows_missing_and_out_of_the_level():
    x = states(3000)
    gappy = drop_fibers(x, 0.3, np.random.default_rng(0))
    noisy = add_noise(gappy, 0.1, np.random.default_rng(1))
    assert (np.isnan(noisy) == np.isnan(gappy)).all()
    spread = np.nanstd(gappy, axis=0)
    np.testing.assert_allclose(np.nanstd(noisy - gappy, axis=0), 0.1 * spread, rtol=0.1)


@given(st.integers(200, 3000), st.integers(0, 80), st.integers(0, 2**32 - 1))
def test_blocks_are_separate_and_of_one_percent_each(n, percent, seed):
    # Gaps that never touch need a row between them: with few rows only low rates fit.
    percent = min(percent, int(100 * n / (n + 100)))
    dropped = drop_blocks(states(n), percent / 100, np.random.default_rng(seed))
    lengths = gap_lengths(dropped)
    assert len(lengths) == percent
    assert lengths.sum() == round(percent / 100 * n)
    assert all(abs(length - n / 100) < 1.51 for length in lengths)


@given(st.integers(50, 3000), st.floats(0.1, 0.8), st.integers(1, 5), st.integers(0, 2**32 - 1))
def test_fibers_share_the_rate(n, rate, gaps, seed):
    lengths = gap_lengths(drop_fibers(states(n), rate, np.random.default_rng(seed), gaps))
    assert len(lengths) == gaps
    assert lengths.sum() == round(rate * n)
    assert lengths.max() - lengths.min() <= 1


def test_fibers_default_to_five_gaps_that_cover_the_record_evenly():
    trials = [drop_fibers(states(200), 0.2, np.random.default_rng(s)) for s in range(2000)]
    assert {len(gap_lengths(x)) for x in trials} == {5}
    hidden = np.mean([np.isnan(x[:, 0]) for x in trials], axis=0)
    # The ends are hidden less often than the middle, by less than a gap's share on either side.
    np.testing.assert_allclose(hidden[40:-40], 0.2, atol=0.06)
    assert hidden[0] > 0
    assert hidden[-1] > 0


@pytest.mark.parametrize("corrupt", [add_noise, drop_blocks, drop_fibers])
def test_copies_repeats_and_leaves_the_rest_alone(corrupt):
    x = states(500)
    before = x.copy()
    first, again, other = (corrupt(x, 0.2, np.random.default_rng(s)) for s in (3, 3, 4))
    assert (x == before).all()
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other, equal_nan=True)
    zero = corrupt(x, 0.0, np.random.default_rng(3))
    assert zero is not x
    np.testing.assert_array_equal(zero, x)
    if corrupt is not add_noise:
        seen = ~np.isnan(first)
        np.testing.assert_array_equal(first[seen], x[seen])


def test_bad_input():
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match=r"x: must have shape \(n, d\).* got \(5,\)"):
        add_noise(np.zeros(5), 0.1, rng)
    with pytest.raises(ValueError, match="x: must not be infinite, got 5 infinite values"):
        drop_blocks(np.full((5, 1), np.inf), 0.1, rng)
    for level in (-0.1, np.nan, np.inf):
        with pytest.raises(ValueError, match=f"level: must .* got {level}"):
            add_noise(np.zeros((5, 1)), level, rng)
    for rate in (-0.1, 1.0, np.nan):
        with pytest.raises(ValueError, match=f"rate: must be .* got {rate}"):
            drop_blocks(np.zeros((500, 1)), rate, rng)
    with pytest.raises(ValueError, match="rate: 5 separate gaps of 9 rows .* into 10 rows"):
        drop_fibers(np.zeros((10, 1)), 0.9, rng)
    for gaps in (0, 1.5):
        with pytest.raises(ValueError, match="gaps: must be an integer of at least 1, got"):
            drop_fibers(np.zeros((10, 1)), 0.5, rng, gaps=gaps)
    for corrupt in (add_noise, drop_blocks, drop_fibers):
        with pytest.raises(ValueError, match="rng: must be of type Generator, got 0"):
            corrupt(np.zeros((10, 1)), 0.5, 0)
