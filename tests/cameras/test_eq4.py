"""Linear equations for cameras: Eq. (4) by itself, outliers, and motion that is too weak."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import room, scene, trajectory, walk
from hypothesis import strategies as st

import vidsindy_lite as vl
from vidsindy_lite.cameras import Rig, calibration_errors, learn_cameras, learn_cameras_eq4
from vidsindy_lite.cameras.calibrate import Equations, _solved

SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture
def small():
    return scene(7, n=40)


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


def test_eq_4_is_orthographic():
    rig = room(np.random.default_rng(0))
    tracks = [camera.project(walk(np.arange(60))) for camera in rig.cameras]
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs orthographic cameras, got a persp"):
        learn_cameras_eq4(tracks, rig.uncalibrated())


def test_what_eq_4_needs(small):
    _, rig, tracks, _ = small
    assert learn_cameras_eq4(tracks, rig) is rig
    lost = Rig([*rig.cameras[:2], replace(rig.cameras[2], position=None)])
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs all positions, got none of"):
        learn_cameras_eq4(tracks, lost.uncalibrated())


@pytest.fixture
def unknown():
    """A rig of two cameras, of which the second is not calibrated."""
    place = {"position": (0, 0, 0), "image_size": (400, 300)}
    known = vl.OrthographicCamera(normal=(0, 0, 1), scale=0.5, angle=0.1, **place)
    return known, vl.OrthographicCamera(normal=(1, 0, 0), **place)


def motion(first, second, misfit, frames=40):
    """Equations whose two unknowns, 3 and 4, show by so many pixels rms, missed by others."""
    waves = np.sqrt(2) * np.cos(2 * np.pi * np.outer(np.arange(frames), [1, 2, 3]) / frames)
    design = waves[:, :2] * [first, second]
    return Equations(design, design @ [3, 4] + misfit * waves[:, 2], np.arange(frames))


def test_motion_must_be_twice_the_misfit(unknown):
    # The misfit counts in pixels: |3 + 4i| = 5 scene units are one.
    np.testing.assert_allclose(_solved(motion(10.0, 2.8, 5.0), unknown, [1]), [3, 4], rtol=1e-12)
    message = r"cameras\[1\], got 1.9 px rms of telling motion against a misfit of 1 px"
    with pytest.raises(ValueError, match=message):
        _solved(motion(10.0, 1.9, 5.0), unknown, [1])


def test_in_many_frames_less_motion_tells(unknown):
    found = _solved(motion(10.0, 1.9, 5.0, 1500), unknown, [1])
    np.testing.assert_allclose(found, [3, 4], rtol=1e-12)
    with pytest.raises(ValueError, match="got 1.5 px rms of telling motion"):
        _solved(motion(10.0, 1.5, 5.0, 1500), unknown, [1])


def test_exact_motion_must_be_more_than_rounding(unknown):
    found = _solved(motion(100.0, 1e-5, 0.0), unknown, [1])
    np.testing.assert_allclose(found, [3, 4], rtol=1e-6)
    with pytest.raises(ValueError, match=r"must determine scale and angle of cameras\[1\]"):
        _solved(motion(100.0, 5e-8, 0.0), unknown, [1])
