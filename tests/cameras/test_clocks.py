"""When frames were taken: clocks, lags and rates, and the curves between frames."""

import numpy as np
import pytest

from vidsindy_lite.cameras import Clock
from vidsindy_lite.cameras.clocks import Lags


def test_the_times_of_each_track_are_checked():
    tracks = [np.zeros((4, 2)), np.zeros((5, 2))]
    clock = Clock.of_tracks([[0, 1, 2, 4], [0, 0.5, 1.0, 1.5, 3]], tracks)
    assert clock.rates.tolist() == [1, 2]
    assert [frames.tolist() for frames in clock.frames] == [[0, 1, 2, 4], [0, 1, 2, 3, 6]]
    assert clock.ends.tolist() == [5.0, 3.5]  # by the clock of the first
    short = Clock.of_tracks([[0, 2, 4], [7]], [np.zeros((3, 2)), np.zeros((1, 2))])
    assert short.rates.tolist() == [1, 2]
    assert Clock.of_tracks(np.arange(4) / 30, tracks).uneven is None
    with pytest.raises(ValueError, match=r"t: must have shape \(5,\), one per row of tracks\[1\]"):
        Clock.of_tracks([range(4), range(4)], tracks)
    # One clock for all of them.
    clock = Clock.of_tracks([3.0, 3.5, 4.0], [np.zeros((3, 2)), np.zeros((5, 2))])
    assert clock.times.tolist() == [3.0, 3.5, 4.0]
    assert clock.rates.tolist() == [1, 1]
    assert [frames.tolist() for frames in clock.frames] == [[0, 1, 2], [0, 1, 2, 3, 4]]
    with pytest.raises(ValueError, match=r"t: must have shape \(3,\), one per row of tracks\[0\]"):
        Clock.of_tracks(range(4), [np.zeros((3, 2))] * 2)


@pytest.mark.parametrize(("off", "even"), [(0.5e-6, True), (2e-6, False)])
def test_times_that_are_even_but_for_rounding_are_even(off, even):
    times = np.arange(9.0)
    times[4] += off
    clock = Clock.of_tracks([times, np.arange(9.0)], [np.zeros((9, 2))] * 2)
    assert (clock.uneven is None) == even


def test_files_that_state_their_rates():
    clock = Clock.of_videos([30, 60], [np.array([0, 1, 3.0]), np.arange(4.0)], None)
    np.testing.assert_allclose(clock.times, [0, 1 / 30, 0.1])
    assert clock.rates.tolist() == [1, 2]
    assert clock.ends.tolist() == [4, 2]
    for rate in (0, np.nan, -1):
        with pytest.raises(ValueError, match="t: must be given, as by --fps, if a file states no"):
            Clock.of_videos([30, rate], [np.arange(3.0)] * 2, None)


@pytest.mark.parametrize(("rate", "same"), [(30.29, True), (30.31, False), (np.nan, True)])
def test_given_times_are_for_files_of_one_rate(rate, same):
    """Within one in a hundred; a file that states none has that of the others."""

    def use():
        return Clock.of_videos([30, rate], [np.arange(3.0)] * 2, [0, 0.5, 1])

    if same:
        assert use().times.tolist() == [0, 0.5, 1]
        assert use().rates.tolist() == [1, 1]
    else:
        with pytest.raises(ValueError, match=f"files that state 30, {rate:g}: leave it out"):
            use()
    with pytest.raises(ValueError, match=r"shape \(3,\), one per frame of the first video, got"):
        Clock.of_videos([30], [np.arange(3.0)], [0, 1])


@pytest.mark.parametrize(("off", "fits"), [(0.24, True), (-0.24, True), (0.26, False)])
def test_given_times_are_those_of_an_uneven_file_but_for_a_quarter_of_a_frame(off, fits):
    frames = np.array([0, 1, 2, 5, 6, 8.0])
    times = 7 + frames / 240
    times[3] += off / 240
    if fits:
        assert (Clock.of_videos([30], [frames], times).times == times).all()
    else:
        with pytest.raises(ValueError, match="got 0.0219167 after the first for frame 3"):
            Clock.of_videos([30], [frames], times)


def test_a_frame_is_that_of_the_instant():
    lags = Lags(np.array([0, 2.0, -3.5]), np.array([1, 1, 2.0]), np.zeros(3), 0.0)
    assert [lags.frame_at(i, 10) for i in range(3)] == [10, 8, 27]
    ticks = np.arange(9.0), np.array([0, 1, 3, 4, 5, 7, 8, 9.0])
    dropped = Lags(np.array([0, 1.0]), np.ones(2), np.zeros(2), 0.0, clocks=ticks)
    assert [dropped.frame_at(1, instant) for instant in (1, 4, 8)] == [0, 2, 5]
    faster = Lags(np.array([0, 1.0]), np.array([1, 2.0]), np.zeros(2), 0.0, clocks=ticks)
    assert [faster.frame_at(1, instant) for instant in (1, 3, 5)] == [0, 3, 6]
