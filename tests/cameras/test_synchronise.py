"""When frames were taken: clocks, lags, how sure these are, and what is told if nothing tells."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from helpers import by_hand, dependent, filmed, room, shot, trajectory, walk
from hypothesis import given, settings
from hypothesis import strategies as st
from phones import waver
from scipy.interpolate import CubicSpline

import vidsindy_lite as vl
from vidsindy_lite.cameras import Clock, align, disagreement, learn_lags, list_lags
from vidsindy_lite.cameras.adjust import PARTS, SIZE, adjust
from vidsindy_lite.cameras.clocks import Footage, Lags
from vidsindy_lite.cameras.synchronise import agrees

NOISE = 0.05  # pixels


@pytest.fixture(scope="module")
def motion():
    """A motion as a function of the frame number, from -60 to 340, and a rig around it."""
    x = trajectory(np.random.default_rng(4), 400)
    return CubicSpline(np.arange(400) - 60, x), vl.Rig.around(x)


def test_whole_lags_move_tracks_as_they_are(motion):
    tracks = filmed(motion, (100, 90, 120), (0, 0, 0))
    first, second, third = align(tracks, (0, 7, -12))
    np.testing.assert_array_equal(first, tracks[0])
    np.testing.assert_array_equal(second[7:97], tracks[1])
    assert np.isnan(second[:7]).all()
    assert np.isnan(second[97:]).all()
    np.testing.assert_array_equal(third, tracks[2][12:112])


@settings(max_examples=30)
@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9), st.floats(1e-6, 1e6), st.floats(1e-6, 1e6))
def test_far_lags_and_fast_rates_are_no_trouble(first, second, slow, fast):
    with warnings.catch_warnings(action="error"):
        ours, theirs = align([np.ones((9, 2)), np.ones((5, 2))], (first, second), (slow, fast))
    assert (ours == 1).all()
    if second - first > 9:
        assert np.isnan(theirs).all()


@pytest.mark.parametrize("seen", [1, 2, 3, 4])
def test_few_frames_are_joined_by_a_curve_of_low_degree(seen):
    track = np.full((9, 2), np.nan)
    instants = np.arange(2, 2 + seen)
    track[instants] = np.column_stack((instants ** (seen - 1), np.ones(seen)))
    _, found = align([track, track], (0, 0.5))
    between = instants[1:] - 0.5
    shown = np.flatnonzero(np.isfinite(found).all(axis=1))
    assert shown.tolist() == instants[1:].tolist()
    np.testing.assert_allclose(found[shown, 0], between ** (seen - 1), rtol=1e-12)


@given(st.floats(-5, 5), st.floats(0.4, 2.5))
@settings(max_examples=30)
def test_cubic_motions_are_interpolated_exactly(lag, rate):
    def pixels(instant):
        return np.column_stack((100 + instant - 0.01 * instant**3, 50 - 0.1 * instant**2))

    tracks = [pixels(np.arange(20)), pixels(lag + np.arange(60) / rate)]
    ours, theirs = align(tracks, (0, lag), (1, rate))
    shown = np.isfinite(theirs).all(axis=1)
    np.testing.assert_allclose(theirs[shown], ours[shown], rtol=0, atol=1e-8)
    instants = np.arange(20)
    covered = (instants >= lag + 1 / rate) & (instants <= lag + 58 / rate)
    assert shown[covered].all()


def test_fractional_lags_and_different_lengths(motion):
    lags = (0, 7.4, -12.7)
    tracks = filmed(motion, (250, 230, 240), lags)
    found = learn_lags(tracks, motion[1].uncalibrated(2))
    assert found.agree
    assert found.warnings == ()
    pulls = (found.frames - lags)[1:] / found.errors[1:]
    assert np.abs(pulls).max() < 4
    assert found.errors.max() < 0.01
    assert found.errors[0] == 0


def test_whole_lags_come_out_whole_and_a_small_fraction_is_not_rounded_away(motion):
    found = learn_lags(filmed(motion, (250, 240, 230), (0, 7, 0)), motion[1].uncalibrated())
    assert found.frames.tolist() == [0, 7, 0]
    assert found.residual < 5 * NOISE
    found = learn_lags(filmed(motion, (250,) * 3, (0, 0.1, 0)), motion[1].uncalibrated())
    np.testing.assert_allclose(found.frames, (0, 0.1, 0), atol=0.01)


def test_errors_are_those_of_least_squares(motion):
    tracks = filmed(motion, (150,) * 3, (0, 0, 0))
    found = learn_lags(tracks, motion[1])
    assert found.frames.tolist() == [0, 0, 0]
    assert not np.signbit(found.frames).any()

    def missed(second, third):
        aligned = align(tracks, (0, second, third))
        return np.hstack(vl.residuals(aligned, motion[1]))[2:-2].ravel()

    slope = [(missed(*h) - missed(*-h)) / 0.1 for h in 0.05 * np.eye(2)]
    # Of the six numbers of a frame the point takes three.
    covariance = np.linalg.inv(np.inner(slope, slope)) * 2 * np.mean(missed(0, 0) ** 2)
    np.testing.assert_allclose(found.errors[1:], np.sqrt(np.diag(covariance)), rtol=0.1)


def test_a_camera_without_a_position(motion):
    first, second, third = motion[1].uncalibrated().cameras
    rig = vl.Rig([first, replace(second, position=None), third])
    assert learn_lags(filmed(motion, (150,) * 3, (0, 7, -4)), rig).frames.tolist() == [0, 7, -4]


def periodic(k):
    phase = 2 * np.pi * np.asarray(k) / 60.3
    return np.column_stack(
        (10 + 5 * np.cos(phase), 6 * np.sin(phase), 3 * np.cos(phase + 1) + 2 * np.sin(2 * phase))
    )


def test_a_motion_that_repeats_itself_leaves_several_lags():
    rig = vl.Rig.around(periodic(np.arange(61)))
    found = learn_lags(filmed((periodic, rig), (150,) * 3, (0, 20, 5)), rig)
    assert found.agree
    assert found.frames.tolist() == [0, 20, 5]  # the smallest
    assert "the lags of the videos cannot be told: (" in found.warnings[0]
    assert "because the motion repeats itself" in found.warnings[0]


def test_a_target_that_hardly_moves_tells_no_lag():
    rig = vl.Rig.around(periodic(np.arange(61)))

    def slow(k):
        return rig.cameras[0].scale * np.outer(k, [0.01, 0.02, 0.01])

    found = learn_lags(filmed((slow, rig), (150,) * 3, (0, 0, 0), noise=0.4), rig)
    assert [w.split(" cannot")[0] for w in found.warnings] == [
        "the lag of video 2", "the lag of video 3",
    ]  # fmt: skip
    assert all("the target moves too little or too slowly" in w for w in found.warnings)


def test_a_loose_rig_that_tells_no_lags_takes_no_place_of_one_that_agrees():
    rng = np.random.default_rng(1)
    rig = room(rng)

    def thrown(frames):
        t = np.asarray(frames)[:, None] / 60 - 0.4
        return t * [1.5, 0.2, 0] - 4.905 * t**2 * [0, 0, 1] + [0, 0, 0.4]

    late = np.array([0, 12, -9])
    exact = learn_lags(shot(rng, rig, np.arange(48), late, path=thrown), rig)
    np.testing.assert_allclose(exact.frames, late, atol=0.1)
    loose = learn_lags(shot(rng, rig, np.arange(48), late, path=thrown), by_hand(rng, rig))
    np.testing.assert_allclose(loose.frames, late, atol=3)


def test_lags_that_are_given_are_the_start(motion):
    tracks = filmed(motion, (150,) * 3, (0, 7, 0))
    rig = motion[1].uncalibrated()
    assert learn_lags(tracks, rig, start=(1, 8, 1)).frames.tolist() == [0, 7, 0]
    assert learn_lags(tracks, rig, start=(0, 60, 0)).frames.tolist() == [0, 7, 0]


def walked(seed, frames, lags=(0, 0, 0), drifts=(0, 0, 0)):
    """A room, tracks of somebody in it with half a pixel of noise, and the generator."""
    rng = np.random.default_rng(seed)
    x = trajectory(rng, frames + 200)
    path = CubicSpline(np.arange(len(x)) - 100, 1.6 * (x - x.mean(axis=0)) / np.ptp(x))
    rig, tracks = room(rng), []
    for camera, lag, drift in zip(rig.cameras, lags, drifts, strict=True):
        pixels = camera.project(path(lag + np.arange(frames) / (1 + drift)))
        tracks.append(pixels + 0.5 * rng.normal(size=pixels.shape))
    return rig, tracks, rng


def test_lags_at_half_a_pixel_of_noise():
    lags = (0, 31.4, -22.7)
    rig, tracks, rng = walked(0, 150, lags)
    for known, limit in ((rig.uncalibrated(), 0.05), (by_hand(rng, rig), 0.3)):
        found = learn_lags(tracks, known)
        assert found.agree
        assert found.warnings == ()
        assert np.abs(found.frames - lags).max() < limit
        assert (np.abs(found.frames - lags)[1:] < 5 * found.errors[1:] + 0.01).all()
        np.testing.assert_array_equal(found.rates, 1)


def test_a_wrong_rig_does_not_spoil_the_lags(motion):
    first, second, third = motion[1].cameras
    turned = replace(second, normal=second.normal + 0.1 * second.rows[0])
    tracks = filmed(motion, (250,) * 3, (0, 9.3, -4), noise=0.2)
    found = learn_lags(tracks, vl.Rig([first, turned, third]))
    assert max(disagreement(align(tracks, (0, 9.3, -4)), vl.Rig([first, turned, third]))) > 3
    np.testing.assert_allclose(found.frames, (0, 9.3, -4), atol=0.05)


def test_motions_that_have_nothing_in_common_have_no_lags():
    for seeds in ((0, 7), (4, 104)):  # the first leaves a pixel, the second far more
        (rig, tracks, _), (_, others, _) = (walked(seed, 50) for seed in seeds)
        found = learn_lags([tracks[0], others[1], tracks[2]], rig)
        assert not found.agree
        assert found.errors.tolist() == [0, np.inf, np.inf]  # the first video is the clock
    assert found.frames.tolist() == [0, 0, 0]
    (warning,) = found.warnings
    assert "no lags of the videos make the views agree: (0, 0, 0) frames were taken" in warning


def test_the_drift_of_a_clock_is_found():
    rig, tracks, _ = walked(3, 1500, (0, 12.4, -3.3), (0, 4e-4, 0))
    found = learn_lags(tracks, rig)
    np.testing.assert_allclose(found.rates, (1, 1 + 4e-4, 1), rtol=0, atol=1.2e-4)
    assert found.rates[2] == 1  # what is not clear is not changed
    np.testing.assert_allclose(found.frames, (0, 12.4, -3.3), atol=0.15)


def test_a_throw_before_cameras_measured_by_hand_tells_its_lags():
    for seed in range(4):
        rng, lags = np.random.default_rng(seed), (0, 3.3, -2)
        rig, line = room(rng), np.array([[-0.4, 0.3, -0.4], [0.02, -0.012, 0.1], [0, 0, -0.0027]])
        tracks = filmed((lambda k, line=line: np.vander(k, 3, True) @ line, rig), (40,) * 3, lags)
        tracks = [np.where(rng.random((40, 1)) < 0.1, np.nan, track) for track in tracks]
        found = learn_lags(tracks, by_hand(rng, rig))
        assert (np.abs(found.frames - lags) <= 4 * found.errors).all()
        assert found.errors.max() < 0.5


def test_lags_as_text():
    assert list_lags(np.array([0.0, 7.0, -12.504, -1e-9])) == "0, 7, -12.5, 0"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rates": (1, 1)}, "rates: must be 3 finite numbers"),
        ({"rates": (1, 0, 1)}, "rates: must be positive, got 0"),
        ({"rates": (1, 1e300, 1)}, r"rates: must be between 1e-06 and 1e\+06, got 1e\+300"),
        ({"rates": (1, 1, 1e-310)}, r"rates: must be between 1e-06 and 1e\+06, got 1e-310"),
        ({"start": (0, -1e300, 0)}, r"start: must be at most 1e\+09 frames, got 1e\+300"),
        ({"start": (0, np.nan, 0)}, "start: must be 3 finite numbers"),
        ({"start": (0, 1)}, "start: must be 3 finite numbers"),
    ],
)
def test_bad_input_is_named(motion, arguments, message):
    tracks = filmed(motion, (30,) * 3, (0, 0, 0))
    with pytest.raises(ValueError, match=message):
        learn_lags(tracks, motion[1], **arguments)
    with pytest.raises(ValueError, match=r"lags: must be at most 1e\+09 frames, got 1e\+300"):
        align(tracks, (0, 1e300, 0))


def test_a_camera_that_never_sees_the_target(motion):
    tracks = filmed(motion, (30,) * 3, (0, 0, 0))
    tracks[2][::2, 0] = tracks[2][1::2, 1] = np.nan  # half a pixel tells nothing
    with pytest.raises(ValueError, match=r"tracks\[2\]: must see the target in some frame"):
        learn_lags(tracks, motion[1])


def test_lags_of_uneven_videos_are_found(motion):
    lags, rates, rng = (0, 7.3, -4.6), (1, 1.5, 0.8), np.random.default_rng(0)
    clocks = [waver(rng, int(200 * rate), 1.0) for rate in rates]
    parts = zip(motion[1].cameras, clocks, lags, rates, strict=True)
    tracks = [c.project(motion[0](lag + clock / rate)) for c, clock, lag, rate in parts]
    found = learn_lags(tracks, motion[1].uncalibrated(0), rates, clocks=clocks)
    np.testing.assert_allclose(found.frames, lags, atol=2e-3)
    assert found.warnings == ()
    shown = align(tracks, found.frames, rates, clocks)
    for camera, track in zip(motion[1].cameras, shown, strict=True):
        true = camera.project(motion[0](clocks[0]))
        both = np.isfinite(track).all(axis=1)
        assert both.mean() > 0.9
        assert np.abs(track - true)[both].max() < 0.05


def test_a_long_pause_of_a_camera_is_not_interpolated(motion):
    clocks = [np.arange(60.0), np.delete(np.arange(60.0), [10, 30, 31])]
    pairs = zip(motion[1].cameras, clocks, strict=False)
    _, second = align([c.project(motion[0](k)) for c, k in pairs], (0, 0), clocks=clocks)
    assert np.flatnonzero(np.isnan(second[:, 0])).tolist() == [30, 31]
    whole = [c.project(motion[0](np.arange(60.0))) for c in motion[1].cameras[:2]]
    whole[1][[10, 30, 31]] = np.nan  # frames that do not show the target are as dropped ones
    after = align([whole[0], whole[1][clocks[1].astype(int)]], (0, 0.5), clocks=clocks)
    np.testing.assert_allclose(align(whole, (0, 0.5))[1], after[1], atol=1e-3)


@pytest.mark.parametrize(
    ("clocks", "message"),
    [
        ([range(3)], "clocks: must be one per track, got 1 for 2"),
        ([range(3), range(2)], r"clocks\[1\]: must be 3 finite numbers"),
        ([range(3), [0, 1, 1]], r"clocks\[1\]: must increase, got"),
    ],
)
def test_clocks_that_are_none(clocks, message):
    with pytest.raises(ValueError, match=message):
        align([np.ones((3, 2))] * 2, (0, 0), clocks=clocks)


def test_lags_and_rolling_shutters_are_told_apart():
    rng = np.random.default_rng(8)
    rig, lags = room(rng, 4, readout=0.4), (0, 6.3, -4.6, 0.5)
    tracks = shot(rng, rig, np.arange(400), lags, 0.2, lambda k: walk(2 * k))
    rig = vl.Rig(replace(c, readout=0.0, readout_error=0.5) for c in rig.cameras)
    found = learn_lags(tracks, rig)
    assert found.agree
    np.testing.assert_allclose(found.frames, lags, atol=0.1)


def test_a_shutter_is_told_in_frames_of_its_own_video():
    rng, rates = np.random.default_rng(8), (1, 0.5, 2)
    rig, clocks = room(rng, readout=0.5), [np.arange(240 * rate) / rate for rate in rates]
    tracks = [
        shot(rng, rig, clock * rate, noise=0.1, path=lambda k, rate=rate: walk(2 * k / rate))[i]
        for i, (clock, rate) in enumerate(zip(clocks, rates, strict=True))
    ]
    seen = vl.observe_tracks(tracks, rig, clocks)
    assert seen.warnings == ()
    assert seen.rig == rig
    assert np.nanstd(seen.residuals) < 0.12
    assert np.nanmax(np.abs(seen.x - walk(2 * seen.t))) < 1.5e-3


@pytest.mark.parametrize(
    ("size", "memory", "told"),
    [(0.1, 0.0, True), (2.0, 0.0, True), (1e3, 0.0, False), (0.01, 0.9, False), (1.0, 0.35, True),
     (2.0, 0.35, False)],
)  # fmt: skip
def test_noise_agrees_and_what_persists_does_not(motion, size, memory, told):
    rng = np.random.default_rng(0)
    misses = size * np.hstack([dependent(rng, 400, memory) for _ in range(3)])
    tracks = filmed(motion, (120,) * 3, (0, 0, 0))
    errors = np.zeros((3, SIZE))
    errors[1:, PARTS["lag"]] = np.inf
    fit = replace(adjust(Footage.of(tracks), motion[1].cameras, errors))
    fit.misses, fit.weights = misses / 2, np.ones(len(misses))
    assert agrees(fit) is told


def test_the_times_of_each_track_are_checked():
    tracks = [np.zeros((4, 2)), np.zeros((5, 2))]
    clock = Clock.of_tracks([[0, 1, 2, 4], [0, 0.5, 1.0, 1.5, 3]], tracks)
    assert clock.rates.tolist() == [1, 2]
    assert [frames.tolist() for frames in clock.frames] == [[0, 1, 2, 4], [0, 1, 2, 3, 6]]
    assert clock.ends.tolist() == [5.0, 3.5]  # by the clock of the first
    short = Clock.of_tracks([[0, 2, 4], [7]], [np.zeros((3, 2)), np.zeros((1, 2))])
    assert short.rates.tolist() == [1, 2]
    for times, message in (
        (range(4), r"must have shape \(5,\), one per row of tracks\[1\]"),
        (range(5, 0, -1), r"must increase, got t\[1\]\[0\] = 5 before t\[1\]\[1\] = 4"),
        (range(0, 105, 21), "must be in the unit .* of the others, got median steps of 1, 21"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=rf"^t\[[01]\]: {message}"):
            Clock.of_tracks([range(4), times], tracks)
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
    assert (clock.frames[0].tolist() == [*range(9)]) == even


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
    ticks = (np.arange(30.0),) * 3
    lags = Lags(np.array([0, 2.0, -3.5]), np.array([1, 1, 2.0]), np.zeros(3), 0.0, clocks=ticks)
    assert lags.frame_at(1, 1) == -1  # it has not begun
    assert [lags.frame_at(i, 10) for i in range(3)] == [10, 8, 27]
    ticks = np.arange(9.0), np.array([0, 1, 3, 4, 5, 7, 8, 9.0])
    dropped = Lags(np.array([0, 1.0]), np.ones(2), np.zeros(2), 0.0, clocks=ticks)
    assert [dropped.frame_at(1, instant) for instant in (1, 4, 8)] == [0, 2, 5]
    faster = Lags(np.array([0, 1.0]), np.array([1, 2.0]), np.zeros(2), 0.0, clocks=ticks)
    assert [faster.frame_at(1, instant) for instant in (1, 3, 5)] == [0, 3, 6]
