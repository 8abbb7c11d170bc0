"""Perspective cameras and lines of sight: projection, learning, reconstruction, bad rigs."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import scene
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from vidsindy_lite.cameras import (
    OrthographicCamera,
    PerspectiveCamera,
    Rig,
    calibration_errors,
    learn_cameras,
    reconstruct,
    residuals,
)

SEEDS = st.integers(0, 2**32 - 1)
MIXED = (OrthographicCamera, PerspectiveCamera)
LENSES = MIXED[1:]


@pytest.mark.parametrize("cameras", [2, 3])
@pytest.mark.parametrize("kinds", [MIXED[:1], LENSES, MIXED])
def test_noisy_pixels_give_the_least_squares_of_scipy(cameras, kinds):
    x, rig, tracks, rng = scene(0, 6, cameras, kinds)
    tracks = [track + 3 * rng.normal(size=track.shape) for track in tracks]
    if cameras > 2:
        tracks[2][1] = np.nan
    found = reconstruct(tracks, rig)
    for k in range(6):
        shown = zip(rig.cameras, tracks, strict=True)
        seen = [(c, t[k]) for c, t in shown if np.isfinite(t[k]).all()]

        def missed(point, seen=seen):
            return np.concatenate([c.project(point[None])[0] - pixel for c, pixel in seen])

        best = least_squares(missed, x[k], xtol=1e-14, ftol=1e-14, gtol=1e-14, x_scale="jac")
        np.testing.assert_allclose(found[k], best.x, atol=1e-6 * np.ptp(x))


def test_lines_that_meet_behind_a_camera_give_no_point():
    straight = {"scale": 0.001, "angle": 0.0, "image_size": (1001, 1001)}
    rig = Rig(PerspectiveCamera(position=(x, 0, 10), normal=(0, 0, 1), **straight) for x in (0, 4))
    # By hand: (0, 0, 2) lies 8 below the first camera, and .5 of the depth to the other's side.
    seen = [np.array([[500.0, 500.0]]), np.array([[0.0, 500.0]])]
    np.testing.assert_allclose(reconstruct(seen, rig), [[0, 0, 2]], atol=1e-9)
    assert np.isnan(reconstruct([seen[0], 1000 - seen[1]], rig)).all()
    assert np.isnan(reconstruct([seen[0], seen[0]], rig)).all()  # parallel


def test_behind_the_camera_nothing_is_seen():
    camera = PerspectiveCamera(position=(0, 0, 10), normal=(0, 0, 1), scale=1, angle=0)
    seen = camera.project([[0, 0, 9], [0, 0, 10], [0, 0, 11], [np.nan, 0, 0]])
    assert np.isnan(seen).all(axis=1).tolist() == [False, True, True, True]
    for radius in (0, -1, 10, 11):
        with pytest.raises(ValueError, match=f"radius: must be positive and .* got {radius}"):
            camera.ball_image([[0, 0, 0]], radius)


@given(SEEDS, st.floats(0.01, 0.3))
@settings(max_examples=10)
def test_outline_is_that_of_the_tangent_cone(seed, size):
    x, rig, _, rng = scene(seed, 4, kinds=LENSES)
    for camera in rig.cameras:
        depth = (camera.position - x) @ camera.normal
        radius = size * depth.min()
        centroids, shapes = camera.ball_image(x, radius)
        circle = rng.uniform(0, 2 * np.pi, 7)
        circle = np.column_stack((np.cos(circle), np.sin(circle)))
        for centre, centroid, shape in zip(x, centroids, shapes, strict=True):
            # The ray through a pixel of the outline touches the ball.
            seen = camera.scale * camera.turned(centroid + circle @ shape.T)
            rays = seen @ camera.rows - camera.normal
            rays /= np.linalg.norm(rays, axis=1, keepdims=True)
            nearest = np.linalg.norm(np.cross(rays, centre - camera.position), axis=1)
            np.testing.assert_allclose(nearest, radius, rtol=1e-8)


@given(SEEDS, st.data())
@settings(max_examples=15)
def test_exact_pixels_give_exact_cameras_though_views_are_missing(seed, data):
    kinds = data.draw(st.sampled_from([MIXED[:1], LENSES, MIXED]))
    cameras = data.draw(st.integers(3 if PerspectiveCamera in kinds else 2, 6))
    x, truth, tracks, rng = scene(seed, 100, cameras, kinds)
    seen = rng.random((100, cameras)) < 0.8
    for i, track in enumerate(tracks):
        track[~seen[:, i]] = np.nan
    learned = learn_cameras(tracks, truth.uncalibrated(data.draw(st.integers(0, cameras - 1))))
    assert np.abs(calibration_errors(learned, truth)).max() < 1e-9
    found, enough = reconstruct(tracks, learned), seen.sum(axis=1) >= 2
    np.testing.assert_allclose(found[enough], x[enough], atol=1e-8 * np.ptp(x))
    assert np.isnan(found[~enough]).all()


def test_one_camera_may_be_known_through_another():
    # Cameras 0 and 2 never see the target in the same frame.
    _, truth, tracks, _ = scene(5, 90, kinds=LENSES)
    tracks[2][:45] = np.nan
    tracks[0][45:] = np.nan
    learned = learn_cameras(tracks, truth.uncalibrated())
    assert np.abs(calibration_errors(learned, truth)).max() < 1e-9
    tracks[1][45:] = np.nan
    with pytest.raises(ValueError, match=r"scale and angle of cameras\[2\], got 0"):
        learn_cameras(tracks, truth.uncalibrated())


def test_motion_in_one_plane_through_two_cameras():
    # Every line of sight of the known camera is then seen as the same line.
    rig = Rig(
        PerspectiveCamera(position=10 * axis, normal=axis, scale=1e-3, angle=0.3)
        for axis in np.eye(3)[:2]
    )
    t = np.linspace(0, 6, 50)
    flat = np.column_stack((np.sin(t), np.cos(2 * t), 0 * t))
    tracks = [camera.project(flat) for camera in rig.cameras]
    with pytest.raises(ValueError, match=r"must determine scale and angle of cameras\[1\]"):
        learn_cameras(tracks, rig.uncalibrated())
    solid = flat + np.column_stack((0 * t, 0 * t, np.sin(3 * t)))
    tracks = [camera.project(solid) for camera in rig.cameras]
    learned = learn_cameras(tracks, rig.uncalibrated())
    assert np.abs(calibration_errors(learned, rig)).max() < 1e-9


def test_normal_that_points_away():
    _, rig, tracks, _ = scene(7, 60, kinds=LENSES)
    wrong = replace(rig.cameras[0], normal=-rig.cameras[0].normal)
    with pytest.raises(ValueError, match=r"static target, a wrong position or normal"):
        learn_cameras(tracks, Rig([wrong, *rig.uncalibrated(0).cameras[1:]]))
    first, second, third = rig.uncalibrated(0).cameras
    wrong = replace(third, normal=-third.normal)
    away = [replace(camera, normal=-camera.normal) for camera in rig.cameras]
    for cameras in ([first, second, wrong], away):
        with pytest.raises(ValueError, match="does each normal point from the scene to its cam"):
            learn_cameras(tracks, Rig(cameras))


@pytest.mark.filterwarnings("error")
@given(SEEDS, st.integers(2, 5))
@settings(max_examples=10)
def test_tracks_that_fit_nothing(seed, cameras):
    # No warning, no crash, and no point behind a camera.
    _, rig, tracks, rng = scene(seed, 30, cameras, LENSES)
    tracks = [rng.uniform(-200, 700, size=track.shape) for track in tracks]
    missed = np.hstack(residuals(tracks, rig))
    assert np.isfinite(missed).all(axis=1).sum() > 15
    for camera in rig.cameras:
        in_front = reconstruct(tracks, rig) @ camera.matrix[2, :3] + camera.matrix[2, 3]
        assert not (in_front <= 0).any()


def test_a_position_beside_a_perspective_camera_cannot_be_learned():
    _, rig, tracks, _ = scene(1, kinds=LENSES)
    flat = OrthographicCamera(normal=rig.cameras[0].normal, scale=1.0, angle=0.0)
    mixed = Rig([flat, *rig.cameras[1:]])
    with pytest.raises(ValueError, match=r"all positions must be given .* none of cameras\[0\]"):
        learn_cameras(tracks, mixed)
    with pytest.raises(ValueError, match="position: must be given for a perspective camera"):
        PerspectiveCamera(normal=(0, 0, 1))
