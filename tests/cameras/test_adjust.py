"""Bundle adjustment: what is learned, what is told of it, and errors that all samples share."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import aligned_error, by_hand, dependent, room, shot, trajectory, walk
from hypothesis import given, settings
from hypothesis import strategies as st

import vidsindy_lite as vl
from vidsindy_lite import study
from vidsindy_lite.cameras import Lags, learn_cameras, systematic_errors, tracking_errors
from vidsindy_lite.cameras.adjust import known_to


def film(seed, cameras=3, n=400, **lens):
    """Generator, rig, path, noisy tracks."""
    rng = np.random.default_rng(seed)
    rig = room(rng, cameras, **lens)
    return rng, rig, walk(np.arange(n)), shot(rng, rig, np.arange(n))


@given(st.integers(0, 2**32 - 1), st.integers(3, 5))
@settings(max_examples=4)
def test_a_rig_measured_by_hand_becomes_as_good_as_the_true_one(seed, cameras):
    rng, rig, x, tracks = film(seed, cameras)
    given_rig = by_hand(rng, rig)
    learned = learn_cameras(tracks, given_rig)
    assert learned.warnings == ()
    best = aligned_error(vl.reconstruct(tracks, rig), x)
    assert aligned_error(vl.reconstruct(tracks, learned), x) < 1.1 * best + 1e-4
    assert aligned_error(vl.reconstruct(tracks, given_rig), x) > 2 * best


def test_exact_measurements_are_not_touched():
    _, rig, _, tracks = film(1)
    assert learn_cameras(tracks, rig) == rig
    learned = learn_cameras(tracks, rig.uncalibrated())
    for found, true in zip(learned.cameras, rig.cameras, strict=True):
        np.testing.assert_array_equal(found.position, true.position)
        np.testing.assert_array_equal(found.normal, true.normal)


def test_outliers_do_no_harm():
    rng, rig, x, tracks = film(2)
    start = by_hand(rng, rig)
    wild = [track.copy() for track in tracks]
    far = rng.uniform(size=(len(wild), len(x))) < 0.05
    for track, frames in zip(wild, far, strict=True):
        track[frames] += 50 * rng.normal(size=(frames.sum(), 2))
    clean = vl.reconstruct(tracks, learn_cameras(tracks, start))
    learned = vl.reconstruct(tracks, learn_cameras(wild, start))
    assert aligned_error(learned, x) < 1.05 * aligned_error(clean, x) + 1e-4


@pytest.mark.parametrize(
    ("seed", "cameras", "lens", "unknown"),
    [
        (3, 4, {"distortion": (-0.1,)}, {"distortion": None, "distortion_error": 0.2}),
        (4, 3, {"readout": 0.3}, {"readout": 0.0, "readout_error": 0.5}),
    ],
)
def test_a_lens_and_a_rolling_shutter_are_learned(seed, cameras, lens, unknown):
    rng, rig, x, tracks = film(seed, cameras, **lens)
    learned = learn_cameras(tracks, by_hand(rng, rig, **unknown))
    best = aligned_error(vl.reconstruct(tracks, rig), x)
    assert aligned_error(vl.reconstruct(tracks, learned), x) < 1.1 * best
    if "readout" in lens:
        np.testing.assert_allclose([c.readout for c in learned.cameras], 0.3, atol=0.15)
    else:
        blind = learn_cameras(tracks, by_hand(rng, rig, distortion=None))
        assert aligned_error(vl.reconstruct(tracks, blind), x) > 1.3 * best


def test_what_remains_uncertain_is_as_large_as_the_error():
    """Over many rigs the error of the path lies in the modes, and is as large as they say."""
    size = []
    for seed in range(6):
        rng, rig, x, tracks = film(seed, 4, n=200)
        given_rig = by_hand(rng, rig)
        learned = learn_cameras(tracks, given_rig)
        still = Lags(np.zeros(4), np.ones(4), np.zeros(4), 0.0)
        modes = systematic_errors(tracks, given_rig, learned, still)
        exact = [camera.project(x) for camera in rig.cameras]
        off = vl.reconstruct(exact, learned) - x
        _, sizes, ways = np.linalg.svd(modes.reshape(len(modes), -1), full_matrices=False)
        told = ways @ off.ravel()
        assert np.sum((off.ravel() - told @ ways) ** 2) < 0.05 * np.sum(off**2) + 1e-8
        size.append((told / sizes)[:7] ** 2)
    assert 0.3 < np.mean(size) < 3


def test_a_measurement_that_is_far_off_is_told():
    rng, rig, _, tracks = film(12, 4)
    first, *others = by_hand(rng, rig).cameras
    wrong = replace(first, position=first.position + [0.0, 0.0, 1.5])
    (warning,) = learn_cameras(tracks, vl.Rig([wrong, *others])).warnings
    assert "of cameras[0] is" in warning
    assert "times its error from what was measured" in warning


@pytest.mark.parametrize(("times", "told"), [(1, 0), (3, 1)])
def test_many_measurements_that_are_a_little_off_are_told_together(times, told):
    rng, rig, _, tracks = film(12, 4)
    given = [
        replace(c, position=c.position + times * c.position_error * rng.normal(size=3))
        for c in by_hand(rng, rig).cameras
    ]
    said = " ".join(learn_cameras(tracks, vl.Rig(given)).warnings)
    assert said.count("is 3.1 times its error") == said.count("chi-square 63") == told


def test_how_well_a_camera_is_known():
    image = {"principal_point_error": 4.0, "distortion_error": 0.3, "readout_error": 0.2}
    errors = {"normal_error": 2.0, "scale_error": 0.03, "position_error": 0.5, **image}
    place = {"position": (0, 0, 9), "normal": (0, 0, 1)}
    known = known_to(vl.PerspectiveCamera(**place, scale=1, angle=0, **errors))
    two = np.deg2rad(2)
    expected = [two, two, two, 0.03, *[0.5] * 3, 4, 4, 0.3, 0.3, 0.03, 0.03, 0.2, 0, 0]
    np.testing.assert_allclose(known, expected)
    unknown = known_to(vl.PerspectiveCamera(**place))
    assert np.flatnonzero(unknown).tolist() == [2, 3]
    assert np.isinf(unknown[2:4]).all()
    flat = known_to(vl.OrthographicCamera(normal=(0, 0, 1), scale=1, angle=0))
    assert np.flatnonzero(np.isinf(flat)).tolist() == [4, 5]  # along its axis it sees the same


NOISE = 0.05  # pixels
STILL = Lags(np.zeros(3), np.ones(3), np.zeros(3), 0.0)


def seen(seed, frames, noise=NOISE):
    """A path, a rig around it, and its tracks with noise."""
    x, rng = trajectory(np.random.default_rng(seed), frames), np.random.default_rng(seed + 1)
    rig = vl.Rig.around(x)
    return x, rig, [c.project(x) + noise * rng.normal(size=(frames, 2)) for c in rig.cameras]


def throw(rng, frames):
    """A ball in a vertical plane, up and down again."""
    t, azimuth = np.linspace(0, 2, frames)[:, None], rng.uniform(0, 2 * np.pi)
    velocity = np.array([2 * np.cos(azimuth), 2 * np.sin(azimuth), rng.uniform(8, 10)])
    return t * velocity - [0, 0, 4.9] * t**2


@pytest.mark.parametrize(
    ("path", "frames", "memory", "draws", "most"),
    [(trajectory, 250, 0.9, 12, 1.3), (throw, 60, 0.0, 40, 1.1)],  # if independent, 4 for the first
)
def test_errors_of_cameras_are_as_large_as_stated(path, frames, memory, draws, most):
    pulls = []
    for seed in np.random.SeedSequence(5).spawn(draws):
        rng = np.random.default_rng(seed)
        x = path(rng, frames)
        truth = vl.Rig.around(x)
        exact = [c.project(x) for c in truth.cameras]
        tracks = [track + NOISE * dependent(rng, frames, memory) for track in exact]
        learned = vl.learn_cameras(tracks, truth.uncalibrated())
        modes = systematic_errors(tracks, truth.uncalibrated(), learned, STILL)
        # What the cameras' errors do to the path, in units of what they may do.
        turned = vl.reconstruct(exact, learned) - x
        sizes, *_ = np.linalg.lstsq(modes.reshape(len(modes), -1).T, turned.ravel())
        assert np.abs(turned - np.tensordot(sizes, modes, 1)).max() < 0.02 * np.abs(turned).max()
        pulls.append(sizes)
    assert 0.8 < np.sqrt(np.mean(np.square(pulls))) < most
    assert np.abs(pulls).max() < 5


def test_trails_follow_the_motion():
    x, rig, tracks = seen(4, 80, 0.3)
    tracks[1][20] = np.nan
    modes = tracking_errors(tracks, rig)
    assert modes.shape == (3, 80, 3)
    path = vl.reconstruct(tracks, rig)
    missed = np.hstack(vl.residuals(tracks, rig))
    noise = 1.4826 * np.median(np.abs(missed[np.isfinite(missed)])) * np.sqrt(2)  # 6 / (6 - 3)
    assert 0.2 < noise < 0.4
    for i, mode in enumerate(modes):
        behind = [track.copy() for track in tracks]
        for k in range(1, 79):
            step = (tracks[i][k + 1] - tracks[i][k - 1]) / 2
            if np.isfinite(step).all():
                behind[i][k] = tracks[i][k] - 0.5 * noise * step / np.sqrt(step @ step + noise**2)
        expected = np.nan_to_num(vl.reconstruct(behind, rig) - path)
        np.testing.assert_allclose(mode[1:-1], expected[1:-1], atol=1e-9 * np.ptp(x))


def test_a_lag_moves_the_path_as_far_as_it_may_be_wrong():
    x, rig, tracks = seen(6, 120)
    lags = Lags(np.zeros(3), np.ones(3), np.array([0, 0.01, 0]), 0.0)
    (mode,) = systematic_errors(tracks, rig, rig, lags)

    def path(lag):
        return vl.reconstruct(vl.align(tracks, (0, lag, 0)), rig)

    speed = np.nan_to_num((path(0.05) - path(-0.05)) / 0.1)
    size = np.sum(mode * speed) / np.sum(speed**2)
    # Slopes between frames hold some noise, and not the same.
    np.testing.assert_allclose(mode[1:-1], size * speed[1:-1], atol=0.1 * np.abs(mode).max())
    pixels = np.linalg.norm(np.gradient(tracks[1], axis=0), axis=1)
    # The residuals see part of the motion of one camera, so the error is above noise / speed.
    least = NOISE / np.sqrt(np.sum(pixels**2))
    assert least < abs(size) < 5 * least


def test_a_clock_that_may_drift_moves_the_path_at_both_ends():
    x, rig, tracks = seen(10, 200)
    lags = Lags(np.zeros(3), np.ones(3), np.zeros(3), 0.0, rate_errors=np.array([0, 1e-4, 0]))
    (mode,) = systematic_errors(tracks, rig, rig, lags)
    shift = np.linalg.norm(mode, axis=1) / np.linalg.norm(np.gradient(x, axis=0), axis=1)
    assert shift[90:110].max() < 0.2 * np.quantile(shift, 0.9)
    # A lag that is exact, or unknown, moves nothing.
    unknown = replace(STILL, errors=np.array([0, 0, np.inf]))
    for lags in (STILL, unknown):
        assert systematic_errors(tracks, rig, rig, lags).shape == (0, 200, 3)


def test_rounded_tracks_may_lie_beside_the_target():
    """As far as a place within their step is uncertain, whatever the step and the lags."""
    _, rig, tracks = seen(6, 80, 0.0)
    trails = len(tracks)
    for seed in range(10):
        exact = np.random.default_rng(seed).uniform(0, 400, (3, 1000, 2))  # not rounded
        assert len(tracking_errors(tracks, rig, raw=exact)) == trails
    for step in (0.5, 1.0, 3.0):
        rounded = [step * np.round(track / step) for track in tracks]
        rounded[0][5] = np.nan
        modes = tracking_errors(tracks, rig, raw=rounded)[trails:]
        beside = [track + step / np.sqrt(12) * np.array([1.0, -2.0]) for track in tracks]
        shift = vl.reconstruct(beside, rig) - vl.reconstruct(tracks, rig)
        np.testing.assert_allclose(modes[::2].sum(axis=0) - 2 * modes[1::2].sum(axis=0), shift)
    with pytest.raises(ValueError, match=r"tracks: must have two frames or more, got \[1, 1, 1\]"):
        tracking_errors([track[:1] for track in tracks], rig)


def test_a_law_of_marks_beside_the_target_has_no_terms_of_their_distance():
    truth = study.SYSTEMS["WangSun"].shift(study.REFERENCE_OFFSET)
    t, x = truth.trajectory(1000)
    rig = vl.Rig.around(x)
    rounded = [np.round(camera.project(x) + np.array([0.05, 0.25])) for camera in rig.cameras]
    seen = vl.observe_tracks(rounded, rig, t, lags="synchronous")
    blind = vl.discover(t, seen.x, order=1)
    told = vl.discover(t, seen.x, systematic=seen.systematic, order=1)
    assert study.score(blind, truth).false_positives > 0
    assert study.score(told, truth).exact
