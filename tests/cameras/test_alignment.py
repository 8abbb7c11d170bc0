"""When which frame was taken: numbers of clocks, lags and rates, and the curves between frames."""

import numpy as np
import pytest

from vidsindy_lite.cameras import align
from vidsindy_lite.cameras.alignment import (
    Curve,
    Footage,
    Lags,
    check_clocks,
    check_lags,
    check_rates,
)

RNG = np.random.default_rng(0)
TRACKS = [np.cumsum(RNG.normal(size=(n, 2)), axis=0) for n in (9, 8)]


def test_everything_counts_from_the_first():
    assert check_lags("lags", (3, 5.5, -1), 3).tolist() == [0, 2.5, -4]
    assert check_rates((2, 1, 5), 3).tolist() == [1, 0.5, 2.5]
    first, second = check_clocks((5 + np.arange(9), 7.5 + np.arange(8) * 2), TRACKS)
    assert first.tolist() == list(range(9))
    assert second.tolist() == list(range(0, 16, 2))


def test_only_differences_of_a_clock_count():
    ticks = np.arange(9) + 40.0, np.array([0, 1, 3, 4, 5, 7, 8, 9]) - 100.0
    ours = align(TRACKS, (0, 0), clocks=ticks)
    theirs = align(TRACKS, (0, 0), clocks=[tick - tick[0] for tick in ticks])
    np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(ours[0], TRACKS[0])
    np.testing.assert_array_equal(ours[1][[0, 1, 3, 4, 5, 7, 8]], TRACKS[1][:7])
    assert np.isfinite(ours[1]).all()  # one frame that was dropped is filled in


def test_a_frame_is_that_of_the_instant():
    lags = Lags(np.array([0, 2.0, -3.5]), np.array([1, 1, 2.0]), np.zeros(3), 0.0)
    assert [lags.frame_at(i, 10) for i in range(3)] == [10, 8, 27]
    ticks = np.arange(9.0), np.array([0, 1, 3, 4, 5, 7, 8, 9.0])
    dropped = Lags(np.array([0, 1.0]), np.ones(2), np.zeros(2), 0.0, clocks=ticks)
    assert [dropped.frame_at(1, instant) for instant in (1, 4, 8)] == [0, 2, 5]
    faster = Lags(np.array([0, 1.0]), np.array([1, 2.0]), np.zeros(2), 0.0, clocks=ticks)
    assert [faster.frame_at(1, instant) for instant in (1, 3, 5)] == [0, 3, 6]


def test_a_slope_is_from_the_frame_before_to_the_frame_after():
    t = np.arange(12.0)
    curve = Curve(np.column_stack([t**2, 3 - 4 * t]), t)
    inside = np.array([1, 4.5, 10])
    slopes = np.column_stack([2 * inside, np.full(3, -4)])
    np.testing.assert_allclose(curve.slope(inside), slopes, atol=1e-9)
    # At an end from it to the frame beside it; nowhere, if the target is in no frame.
    np.testing.assert_allclose(curve.slope(np.array([0.0, 11])), [[1, -4], [21, -4]], atol=1e-9)
    assert not Curve(np.full((4, 2), np.nan), np.arange(4.0)).slope(inside).any()


@pytest.mark.parametrize("rate", [1.0, 2.0])
def test_slopes_in_lag_and_drift_are_those_of_the_track(rate):
    """Of a straight motion, exactly what `later` makes of a small step."""
    t = 20 + np.arange(41.0)
    straight = np.column_stack([5 + 2 * np.arange(81), 7 - np.arange(81)])
    curves = tuple(Curve(straight, np.arange(81.0)) for _ in range(2))
    footage = Footage(curves, t, np.array([0, 1.5]), np.array([1.0, rate / 2]))
    lag, drift = footage.slopes(1)
    step, still = np.array([0, 1e-6]), np.zeros(2)
    for slope, changed in ((lag, footage.later(step, still)), (drift, footage.later(still, step))):
        numeric = (changed.aligned[1] - footage.aligned[1]) / 1e-6
        np.testing.assert_allclose(numeric, slope, atol=1e-6)


def test_a_later_video_is_later_in_the_middle():
    """Wherever the instants begin: the drift is none in their middle, half of it at either end."""
    curves = tuple(Curve(np.zeros((100, 2)), np.arange(100.0)) for _ in range(2))
    footage = Footage(curves, np.array([20.0, 30, 40]), np.array([0, 3.0]), np.array([1, 2.0]))
    changed = footage.later(np.array([0, 0.5]), np.array([0, 4.0]))
    by = (changed.frames(1) - footage.frames(1)) / footage.rates[1]
    np.testing.assert_allclose(by, [-0.5 + 2, -0.5, -0.5 - 2])
