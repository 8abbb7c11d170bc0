"""What cameras share: values computed once and read-only, and arguments checked once."""

import cProfile
import pickle
import pstats
from dataclasses import replace

import numpy as np
import pytest
from helpers import trajectory
from scipy.spatial.transform import Rotation

import vidsindy_lite as vl
from vidsindy_lite import cameras


@pytest.fixture
def camera():
    return vl.PerspectiveCamera(
        position=(1, 2, 9), normal=(0.1, 0.2, 1), scale=0.01, angle=0.4, image_size=(64, 48)
    )


def test_matrices_are_computed_once_and_read_only(camera):
    for name in ("rows", "offset", "matrix"):
        assert getattr(camera, name) is getattr(camera, name)
        with pytest.raises(ValueError, match="read-only"):
            getattr(camera, name)[0] = 1


def test_a_changed_camera_has_matrices_of_its_own(camera):
    before = camera.matrix
    moved = replace(camera, position=(0, 0, 5))
    assert not np.array_equal(moved.matrix, before)
    np.testing.assert_array_equal(
        camera.calibrated(0.02 * np.exp(0.3j)).matrix, before
    )  # position and normal alone
    flat = vl.OrthographicCamera(normal=(0.1, 0.2, 1), scale=0.01, angle=0.4)
    first, second = flat.placed(np.array([1.0, 2.0])), flat.placed(np.array([3.0, 4.0]))
    np.testing.assert_allclose(first.matrix[:2, 3], [-1, -2])
    np.testing.assert_allclose(second.matrix[:2, 3], [-3, -4])
    again = first.placed(np.array([5.0, 6.0]))
    np.testing.assert_allclose(again.offset, [5, 6])
    np.testing.assert_allclose(again.position @ again.normal, 0, atol=1e-12)


def test_a_used_camera_can_be_pickled(camera):
    _ = camera.matrix
    assert pickle.loads(pickle.dumps(camera)) == camera


def test_the_base_is_no_camera():
    with pytest.raises(TypeError, match="abstract"):
        vl.Camera(normal=(0, 0, 1))


def test_pixels_by_hand(camera):
    """The pinhole as three rotations by scipy: no line of the formula of the package."""
    x = np.random.default_rng(0).normal(size=(20, 3))
    axis = np.cross(camera.normal, [0, 0, 1])
    angle = np.arccos(camera.normal[2])
    turned = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).apply(x - camera.position)
    plane = turned[:, :2] / -turned[:, 2:]
    back = Rotation.from_euler("z", camera.angle).apply(np.column_stack((plane, 0 * x[:, 0])))
    u, v = back[:, :2].T / camera.scale
    np.testing.assert_allclose(camera.project(x), np.column_stack((31.5 + u, 23.5 - v)), rtol=1e-9)


def test_arguments_are_checked_once():
    """Learning, lags and errors of 300 frames once made 46,609 checks of arrays."""
    x = trajectory(np.random.default_rng(4), 300)
    rig = vl.Rig.around(x)
    rng = np.random.default_rng(0)
    tracks = [c.project(x) + 0.05 * rng.normal(size=(300, 2)) for c in rig.cameras]
    start = rig.uncalibrated()

    def run():
        lags = vl.learn_lags(tracks, start)
        aligned = vl.align(tracks, lags.frames)
        learned = vl.learn_cameras(aligned, start)
        vl.reconstruct(aligned, learned)
        cameras.systematic_errors(tracks, start, learned, lags)
        cameras.trailing_errors(aligned, learned)

    profile = cProfile.Profile()
    profile.runcall(run)
    stats = pstats.Stats(profile).stats
    checks = sum(v[0] for (_, _, name), v in stats.items() if name == "check_array")
    assert 0 < checks < 200
