"""Linear equations for cameras: Eq. (4) by itself, outliers, and motion that is too weak."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import room, scene, trajectory, walk
from hypothesis import given, settings
from hypothesis import strategies as st

import vidsindy_lite as vl
from vidsindy_lite.cameras import (
    Rig,
    calibration_errors,
    learn_cameras,
    learn_cameras_eq4,
    learn_cameras_lbfgs,
)
from vidsindy_lite.cameras.eq4 import (
    Equations,
    Unknowns,
    _prediction,
    agreement,
    solve,
    without_outliers,
)

SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture
def small():
    return scene(7, n=40)


@given(SEEDS)
@settings(max_examples=4)
def test_lbfgs_descends_to_the_closed_form(seed):
    _, truth, tracks, rng = scene(seed, n=100)
    tracks = [track + rng.normal(size=track.shape) for track in tracks]
    start = truth.uncalibrated()
    descended, closed = (f(tracks, start) for f in (learn_cameras_lbfgs, learn_cameras_eq4))
    assert np.abs(calibration_errors(descended, closed)).max() < 1e-6


@pytest.mark.slow
def test_ours_is_closer_and_less_biased_than_eq_4():
    errors = {learn_cameras: [], learn_cameras_eq4: []}
    for seed in range(30):
        rng = np.random.default_rng(seed)
        x = trajectory(rng, 400)
        truth = Rig.around(x)
        tracks = [c.project(x) + 4 * rng.normal(size=(400, 2)) for c in truth.cameras]
        for learn, found in errors.items():
            learned = learn(tracks, truth.uncalibrated())
            found.extend(calibration_errors(learned, truth)[1:])
    joint, paper = map(np.array, errors.values())
    assert (np.mean(joint**2, axis=0) < np.mean(paper**2, axis=0)).all()
    # Noise in the regressors shrinks the scale in Eq. (4), not at the least reprojection error.
    standard_error = joint[:, 0].std() / np.sqrt(len(joint))
    assert abs(joint[:, 0].mean()) < 3 * standard_error
    assert paper[:, 0].mean() < -3 * standard_error


def test_eq_4_needs_independent_unknown_cameras(small):
    _, rig, tracks, _ = small
    twin = replace(rig.cameras[1], normal=-rig.cameras[1].normal)
    rig = Rig([rig.cameras[0], rig.cameras[1], twin])
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs two independent normals among"):
        learn_cameras_eq4(tracks, rig.uncalibrated())


@pytest.mark.parametrize("learn", [learn_cameras_eq4, learn_cameras_lbfgs])
def test_eq_4_is_orthographic(learn):
    rig = room(np.random.default_rng(0))
    tracks = [camera.project(walk(np.arange(60))) for camera in rig.cameras]
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs orthographic cameras, got a persp"):
        learn(tracks, rig.uncalibrated())


def test_the_prediction_by_hand():
    """Views along x and y hold all coordinates: they predict what is seen along z."""
    views = vl.Rig(
        vl.OrthographicCamera(position=(0, 0, 0), normal=n, scale=1, angle=0)
        for n in np.eye(3)[[2, 0, 1]]
    ).uncalibrated()
    columns = _prediction(views.cameras)
    x = np.random.default_rng(0).normal(size=(9, 3))
    seen = np.hstack([x @ camera.rows.T for camera in views.cameras])
    np.testing.assert_allclose(seen @ columns, 0, atol=1e-14)
    np.testing.assert_array_equal(columns[:2], -np.eye(2))
    # x and y stand once in what predicts them, each with a weight of one.
    np.testing.assert_allclose(np.abs(columns[2:]).sum(axis=0), [1, 1], atol=1e-15)


@pytest.mark.parametrize("learn", [learn_cameras_eq4, learn_cameras_lbfgs])
def test_what_eq_4_needs(small, learn):
    _, rig, tracks, _ = small
    assert learn(tracks, rig) is rig
    lost = Rig([*rig.cameras[:2], replace(rig.cameras[2], position=None)])
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs all positions, got none of"):
        learn(tracks, lost.uncalibrated())


@pytest.fixture
def unknown():
    """A rig of two cameras, of which the second is not calibrated."""
    place = {"position": (0, 0, 0), "image_size": (400, 300)}
    known = vl.OrthographicCamera(normal=(0, 0, 1), scale=0.5, angle=0.1, **place)
    return Unknowns.of(vl.Rig([known, vl.OrthographicCamera(normal=(1, 0, 0), **place)]))


def equations(*missed):
    """One equation a frame, in which nothing is unknown: it is missed by its target."""
    return Equations(np.zeros((len(missed), 0)), np.array(missed), np.arange(len(missed)))


def test_an_outlier_is_eight_robust_standard_deviations_away():
    usual = [1.0, -1.0] * 5  # 1.4826 of a robust standard deviation
    kept, decided = without_outliers(equations(*usual, 11.8, -11.8), 3.0)
    assert decided
    assert kept.frames.tolist() == list(range(12))
    kept, decided = without_outliers(equations(*usual, 11.9, 2.0, -11.9), 3.0)
    assert decided
    assert kept.frames.tolist() == [*range(10), 11]
    assert kept.target[-1] == 2


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_missing_by_a_rounding_is_no_outlier_in_any_unit(scale):
    almost = equations(*np.zeros(9), 0.9e-6 * scale, 1.1e-6 * scale)
    assert without_outliers(almost, scale)[0].frames.tolist() == list(range(10))


def test_all_equations_of_a_frame_are_left_out():
    every = Equations(np.zeros((8, 0)), np.array([0, 0, 0, 0, 0, 0, 0, 9.0]), np.arange(8) // 2)
    assert without_outliers(every, 1.0)[0].frames.tolist() == [0, 0, 1, 1, 2, 2]


def motion(first, second, misfit, frames=40):
    """Equations whose two unknowns, 3 and 4, show by so many pixels rms, missed by others."""
    waves = np.sqrt(2) * np.cos(2 * np.pi * np.outer(np.arange(frames), [1, 2, 3]) / frames)
    design = waves[:, :2] * [first, second]
    return Equations(design, design @ [3, 4] + misfit * waves[:, 2], np.arange(frames))


def test_motion_must_be_twice_the_misfit(unknown):
    # The misfit counts in pixels: |3 + 4i| = 5 scene units are one.
    turned, offsets = solve(motion(10.0, 2.1, 5.0), unknown)
    np.testing.assert_allclose(turned, [3 + 4j], rtol=1e-12)
    assert offsets.shape == (0, 2)
    message = r"cameras\[1\], got 1.9 px rms of telling motion against a misfit of 1 px"
    with pytest.raises(ValueError, match=message):
        solve(motion(10.0, 1.9, 5.0), unknown)


def test_in_many_frames_less_motion_tells(unknown):
    turned, _ = solve(motion(10.0, 1.9, 5.0, 1500), unknown)
    np.testing.assert_allclose(turned, [3 + 4j], rtol=1e-12)
    with pytest.raises(ValueError, match="got 1.5 px rms of telling motion"):
        solve(motion(10.0, 1.5, 5.0, 1500), unknown)


def test_exact_motion_must_be_more_than_rounding(unknown):
    turned, _ = solve(motion(100.0, 1e-5, 0.0), unknown)
    np.testing.assert_allclose(turned, [3 + 4j], rtol=1e-6)
    with pytest.raises(ValueError, match=r"must determine scale and angle of cameras\[1\]"):
        solve(motion(100.0, 5e-8, 0.0), unknown)


@pytest.fixture
def loose():
    """Four cameras around a path, its pixels, and the rig with some scales and positions gone."""
    x = trajectory(np.random.default_rng(2), 60)
    first, second, third = vl.Rig.around(x, image_size=(400, 300)).cameras
    truth = vl.Rig([first, second, third, replace(third, normal=(0, 1, 1), scale=2 * third.scale)])
    tracks = [camera.project(x) for camera in truth.cameras]
    cameras = list(truth.uncalibrated(1).cameras)
    cameras[0], cameras[2] = (replace(cameras[i], position=None) for i in (0, 2))
    return truth, tracks, Unknowns.of(vl.Rig(cameras))


def test_the_equations_of_exact_tracks_have_the_exact_solution(loose):
    truth, tracks, unknowns = loose
    tracks[3][::2] = np.nan
    equations, decided = without_outliers(agreement(tracks, unknowns), unknowns.scale)
    assert decided
    # Of c views, 2 c numbers less the 3 of the point.
    assert len(equations.target) == 30 * 5 + 30 * 3
    turned, offsets = solve(equations, unknowns)
    expected = [c.scale * np.exp(1j * c.angle) for c in truth.cameras]
    np.testing.assert_allclose(turned, [expected[i] for i in (0, 2, 3)], rtol=1e-9)
    np.testing.assert_allclose(offsets, [truth.cameras[i].offset for i in (0, 2)], rtol=1e-9)
