"""Bundle adjustment: what is learned, what is told of it, and errors that depend on others."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import aligned_error, by_hand, room, walk
from hypothesis import given, settings
from hypothesis import strategies as st

import vidsindy_lite as vl
from vidsindy_lite.cameras import Lags, learn_cameras, systematic_errors
from vidsindy_lite.cameras.adjust import adjust, fitted_factor, known_to, long_run_covariance
from vidsindy_lite.cameras.clocks import Footage

SEEDS = st.integers(0, 2**32 - 1)


def film(seed, cameras=3, n=400, **lens):
    """Generator, rig, path, noisy tracks; rolling shutters look at each row when it is read."""
    rng = np.random.default_rng(seed)
    rig, x, tracks = room(rng, cameras, **lens), walk(np.arange(n)), []
    for camera in rig.cameras:
        height, seen = camera.image_size[1], camera.project(x)
        for _ in range(10):
            late = camera.readout * (seen[:, 1] - (height - 1) / 2) / height
            seen = camera.project(walk(np.arange(n) + late))
        tracks.append(seen + 0.5 * rng.normal(size=seen.shape))
    return rng, rig, x, tracks


@given(SEEDS, st.integers(3, 5))
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


def test_noise_and_outliers_are_told_apart():
    rng, rig, _, tracks = film(10, 4, n=1000)
    tracks[2][100] += 80
    errors = np.array([known_to(c) for c in by_hand(rng, rig).cameras])
    found = adjust(Footage.of(tracks), rig.cameras, errors)
    assert abs(found.noise - 0.5) < 0.03
    assert found.weights[100] < 0.01
    assert np.sum(found.weights < 1) < 5
    assert found.settled


def test_a_measurement_that_is_far_off_is_told():
    rng, rig, _, tracks = film(12, 4)
    first, *others = by_hand(rng, rig).cameras
    wrong = replace(first, position=first.position + [0.0, 0.0, 1.5])
    (warning,) = learn_cameras(tracks, vl.Rig([wrong, *others])).warnings
    assert "of cameras[0] is" in warning
    assert "times its error from what was measured" in warning


def test_how_well_a_camera_is_known():
    """A tangential distortion is ten times as small as a radial one."""
    image = {"principal_point_error": 4.0, "distortion_error": 0.3, "readout_error": 0.2}
    errors = {"normal_error": 2.0, "scale_error": 0.03, "position_error": 0.5, **image}
    place = {"position": (0, 0, 9), "normal": (0, 0, 1)}
    known = known_to(vl.PerspectiveCamera(**place, scale=1, angle=0, **errors))
    two = np.deg2rad(2)
    expected = [two, two, two, 0.03, *[0.5] * 3, 4, 4, 0.3, 0.3, 0.03, 0.03, 0.2, 0, 0, 0]
    np.testing.assert_allclose(known, expected)
    unknown = known_to(vl.PerspectiveCamera(**place))
    assert np.flatnonzero(unknown).tolist() == [2, 3]
    assert np.isinf(unknown[2:4]).all()
    flat = known_to(vl.OrthographicCamera(normal=(0, 0, 1), scale=1, angle=0))
    assert np.flatnonzero(np.isinf(flat)).tolist() == [4, 5]  # along its axis it sees the same


def test_measurements_and_residuals_add_up_unless_these_stay():
    """One parameter, slope 2 in 25 residuals of noise .5, measured with a standard error of .1."""
    missed, slopes = np.full((25, 1), 0.0), np.full((25, 1, 1), 2.0)
    factor = fitted_factor(missed, slopes, np.array([0.1**-2]), 0.5)
    np.testing.assert_allclose(factor @ factor.T, 1 / (25 * 4 / 0.25 + 100))
    # Residuals that are all alike are as good as one per width of the weights.
    n = 400
    found = fitted_factor(np.ones((n, 1)), np.ones((n, 1, 1)), np.zeros(1), 1.0) ** 2
    expected = long_run_covariance(np.ones((n, 1))) / n  # W = 1 / n, M = n times it
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert found[0, 0] > 50 / n
    # Only the sum of two is seen: a direction that nothing tells of is left out.
    factor = fitted_factor(np.zeros((30, 1)), np.ones((30, 1, 2)), np.zeros(2), 0.3)
    sums = np.array([1.0, 1.0]) @ factor
    np.testing.assert_allclose(sums @ sums, 0.3**2 / 30)
    np.testing.assert_allclose(np.array([1.0, -1.0]) @ factor, 0, atol=1e-12)
