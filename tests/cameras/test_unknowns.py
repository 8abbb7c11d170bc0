"""Linear equations for what is unknown of a rig: outliers and weak motion, on numbers by hand."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import trajectory

import vidsindy_lite as vl
from vidsindy_lite.cameras import calibrate as module
from vidsindy_lite.cameras.calibrate import Equations, Unknowns, solve
from vidsindy_lite.cameras.sight import Views


@pytest.fixture
def unknown():
    """A rig of two cameras, of which the second is not calibrated."""
    place = {"position": (0, 0, 0), "image_size": (400, 300)}
    known = vl.OrthographicCamera(normal=(0, 0, 1), scale=0.5, angle=0.1, **place)
    return Unknowns.of(vl.Rig([known, vl.OrthographicCamera(normal=(1, 0, 0), **place)]))


def equations(*missed):
    """One equation a frame, in which nothing is unknown: it is missed by its target."""
    return Equations(np.zeros((len(missed), 0)), np.array(missed), np.arange(len(missed)))


def test_units_are_those_of_the_calibrated_cameras(unknown):
    assert unknown.scale == 0.5
    assert unknown.uncalibrated.tolist() == [1]
    assert unknown.unplaced.tolist() == []


def test_an_outlier_is_eight_robust_standard_deviations_away():
    usual = [1.0, -1.0] * 5  # 1.4826 of a robust standard deviation
    kept, decided = module._without_outliers(equations(*usual, 11.8, -11.8), 3.0)
    assert decided
    assert kept.frames.tolist() == list(range(12))
    kept, decided = module._without_outliers(equations(*usual, 11.9, 2.0, -11.9), 3.0)
    assert decided
    assert kept.frames.tolist() == [*range(10), 11]
    assert kept.target[-1] == 2


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_missing_by_a_rounding_is_no_outlier_in_any_unit(scale):
    almost = equations(*np.zeros(9), 0.9e-6 * scale, 1.1e-6 * scale)
    assert module._without_outliers(almost, scale)[0].frames.tolist() == list(range(10))


def test_all_equations_of_a_frame_are_left_out():
    every = Equations(np.zeros((8, 0)), np.array([0, 0, 0, 0, 0, 0, 0, 9.0]), np.arange(8) // 2)
    assert module._without_outliers(every, 1.0)[0].frames.tolist() == [0, 0, 1, 1, 2, 2]


def motion(first, second, misfit, frames=40):
    """Equations whose two unknowns, 3 and 4, show by so many pixels rms, missed by others."""
    waves = np.sqrt(2) * np.cos(2 * np.pi * np.outer(np.arange(frames), [1, 2, 3]) / frames)
    design = waves[:, :2] * [first, second]
    return design, design @ [3, 4] + misfit * waves[:, 2]


def test_motion_must_be_twice_the_misfit(unknown):
    # The misfit counts in pixels: |3 + 4i| = 5 scene units are one.
    turned, offsets = solve(*motion(10.0, 2.1, 5.0), unknown)
    np.testing.assert_allclose(turned, [3 + 4j], rtol=1e-12)
    assert offsets.shape == (0, 2)
    message = r"cameras\[1\], got 1.9 px rms of telling motion against a misfit of 1 px"
    with pytest.raises(ValueError, match=message):
        solve(*motion(10.0, 1.9, 5.0), unknown)


def test_in_many_frames_less_motion_tells(unknown):
    turned, _ = solve(*motion(10.0, 1.9, 5.0, 1500), unknown)
    np.testing.assert_allclose(turned, [3 + 4j], rtol=1e-12)
    with pytest.raises(ValueError, match="got 1.5 px rms of telling motion"):
        solve(*motion(10.0, 1.5, 5.0, 1500), unknown)


def test_exact_motion_must_be_more_than_rounding(unknown):
    turned, _ = solve(*motion(100.0, 1e-5, 0.0), unknown)
    np.testing.assert_allclose(turned, [3 + 4j], rtol=1e-6)
    with pytest.raises(ValueError, match=r"must determine scale and angle of cameras\[1\]"):
        solve(*motion(100.0, 5e-8, 0.0), unknown)


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
    equations, decided = module.agreement(Views.of(tracks), unknowns)
    assert decided
    # Of c views, 2 c numbers less the 3 of the point.
    assert len(equations.target) == 30 * 5 + 30 * 3
    turned, offsets = solve(equations.design, equations.target, unknowns)
    expected = [c.scale * np.exp(1j * c.angle) for c in truth.cameras]
    np.testing.assert_allclose(turned, [expected[i] for i in (0, 2, 3)], rtol=1e-9)
    np.testing.assert_allclose(offsets, [truth.cameras[i].offset for i in (0, 2)], rtol=1e-9)


def test_what_is_unknown_is_written_in(loose):
    truth, _, unknowns = loose
    turned = np.array([truth.cameras[i].scale * np.exp(1j * truth.cameras[i].angle)
                       for i in unknowns.uncalibrated])  # fmt: skip
    offsets = np.array([truth.cameras[i].offset for i in unknowns.unplaced])
    for camera, true in zip(unknowns.filled(turned, offsets), truth.cameras, strict=True):
        np.testing.assert_allclose(camera.calibration, true.calibration, rtol=1e-12)
        np.testing.assert_allclose(camera.offset, true.offset, rtol=1e-9)
