"""The lab experiment: its scene, the error of orthographic cameras, and the ball's image."""

import numpy as np
import pytest

from vidsindy_lite.cameras import calibration_errors, learn_cameras, reconstruct
from vidsindy_lite.study import lab


def rms(error):
    return np.sqrt(np.mean(np.sum(error**2, axis=-1)))


@pytest.fixture(scope="module")
def x():
    return lab.paths(30).reshape(-1, 3)


def flat_error(rig, x):
    flat = learn_cameras([c.project(x) for c in rig.cameras], lab.orthographic(rig).uncalibrated())
    return flat, reconstruct([c.project(x) for c in rig.cameras], flat) - x


def test_paths_are_straight_and_slow_down():
    paths = lab.paths(40)
    assert paths.shape == (3, 40, 3)
    np.testing.assert_array_equal(paths[0, 20], lab.MARKED)
    for path in paths:
        steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
        assert (np.diff(steps) < 0).all()
        assert np.linalg.svd(path - path[0], compute_uv=False)[1] < 1e-9
        assert (path[:, 2] == lab.RADIUS).all()


@pytest.mark.parametrize("seed", range(5))
def test_cameras_look_at_the_table(x, seed):
    for rig in (lab.cameras(), lab.random_cameras(np.random.default_rng(seed))):
        for camera in rig.cameras:
            np.testing.assert_allclose(camera.project([lab.MIDDLE]), [[255.5, 255.5]])
            pixels, shapes = camera.ball_image(x, lab.RADIUS)
            assert pixels.min() > 20
            assert pixels.max() < 491
            assert np.linalg.det(shapes).min() > 5**2
            up = np.diff(camera.project([lab.MIDDLE, lab.MIDDLE + [0, 0, 50]]), axis=0)[0]
            assert abs(np.rad2deg(np.arctan2(up[0], -up[1]))) < 11


def test_orthographic_cameras_are_right_at_the_middle():
    rig = lab.cameras()
    near = lab.MIDDLE + 1e-3 * np.random.default_rng(0).normal(size=(9, 3))
    for camera, flat in zip(rig.cameras, lab.orthographic(rig).cameras, strict=True):
        np.testing.assert_allclose(flat.project(near), camera.project(near), atol=1e-6)


def test_first_order_error(x):
    for distance, tolerance in ((1, 0.2), (10, 0.02), (100, 0.002)):
        rig = lab.cameras(distance)
        flat, error = flat_error(rig, x)
        assert rms(lab.orthographic_error(rig, flat, x) - error) < tolerance * rms(error)


def test_perspective_cameras_are_exact_where_orthographic_ones_are_not(x):
    rig = lab.cameras()
    assert rms(flat_error(rig, x)[1]) > 3
    tracks = [camera.project(x) for camera in rig.cameras]
    assert rms(reconstruct(tracks, learn_cameras(tracks, rig.uncalibrated())) - x) < 1e-6


def test_observe_ball_finds_its_centre(x):
    rig = lab.cameras()
    centroids = [camera.ball_image(x, lab.RADIUS)[0] for camera in rig.cameras]
    plain = reconstruct(centroids, learn_cameras(centroids, rig.uncalibrated())) - x
    seen = lab.observe_ball(centroids, rig.uncalibrated())
    assert rms(seen.x - x) < 1e-4 * rms(plain)
    assert np.abs(calibration_errors(seen.rig, rig)).max() < 1e-8
    assert seen.warnings == ()


@pytest.mark.slow
def test_film(tmp_path):
    rig, paths = lab.cameras(), lab.paths(30)[:1]
    tracks = lab.film_ball(rig, paths, tmp_path)
    assert len(list(tmp_path.glob("path_1_camera_?.mov"))) == 3
    for track, camera in zip(tracks, rig.cameras, strict=True):
        expected, _ = camera.ball_image(paths[0], lab.RADIUS)
        assert np.nanmax(np.abs(track - expected)) < 0.02
