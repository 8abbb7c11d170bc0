"""Lines of sight against OpenCV, scipy and points found by hand."""

import cv2
import numpy as np
import pytest
from helpers import trajectory
from scipy.optimize import least_squares

from vidsindy_lite.cameras import OrthographicCamera, PerspectiveCamera, Rig, reconstruct
from vidsindy_lite.cameras.models import intersect


def scene(*kinds, frames=40, seed=3):
    """Cameras of these models around a path, and the pixels at which they see it."""
    x = trajectory(np.random.default_rng(seed), frames)
    reach = np.linalg.norm(np.ptp(x, axis=0))
    cameras = []
    for i, kind in enumerate(kinds):
        normal = np.array([np.cos(2 * i), np.sin(2 * i), 0.3 + 0.1 * i])
        normal /= np.linalg.norm(normal)
        distance = (1.5 + 0.4 * i) * reach
        scale = reach / 300 / (distance if kind is PerspectiveCamera else 1)
        position = x.mean(axis=0) + distance * normal
        size = (640, 480 + 10 * i)
        cameras.append(
            kind(position=position, normal=normal, scale=scale, angle=0.7 * i, image_size=size)
        )
    return x, cameras, [camera.project(x) for camera in cameras]


def pixel_matrix(camera):
    """The 3 x 4 matrix of the field: homogeneous pixels, u to the right and v down."""
    c, s = np.cos(camera.angle) / camera.scale, np.sin(camera.angle) / camera.scale
    width, height = camera.image_size
    inner = np.array([[c, -s, (width - 1) / 2], [-s, -c, (height - 1) / 2], [0, 0, 1]])
    return inner @ camera.matrix


KINDS = [
    (PerspectiveCamera,) * 2,
    (PerspectiveCamera,) * 3,
    (OrthographicCamera, PerspectiveCamera, PerspectiveCamera),
    (OrthographicCamera,) * 3,
]


@pytest.mark.parametrize("kinds", KINDS)
def test_exact_pixels_as_opencv(kinds):
    x, cameras, tracks = scene(*kinds)
    first, second = pixel_matrix(cameras[0]), pixel_matrix(cameras[1])
    theirs = cv2.triangulatePoints(first, second, tracks[0].T, tracks[1].T)
    theirs = (theirs[:3] / theirs[3]).T
    np.testing.assert_allclose(theirs, x, atol=1e-7 * np.ptp(x))
    ours, settled = intersect(cameras[:2], tracks[:2])
    np.testing.assert_allclose(ours, x, atol=1e-9 * np.ptp(x))
    assert settled.all()


@pytest.mark.parametrize("kinds", KINDS)
def test_noisy_pixels_give_the_least_squares_of_scipy(kinds):
    x, cameras, tracks = scene(*kinds, frames=6)
    rng = np.random.default_rng(0)
    tracks = [track + 3 * rng.normal(size=track.shape) for track in tracks]
    if len(kinds) > 2:
        tracks[2][1] = np.nan
    found = reconstruct(tracks, Rig(cameras))
    for k in range(6):
        seen = [(c, t[k]) for c, t in zip(cameras, tracks, strict=True) if np.isfinite(t[k]).all()]

        def missed(point, seen=seen):
            return np.concatenate([c.project(point[None])[0] - pixel for c, pixel in seen])

        best = least_squares(missed, x[k], xtol=1e-14, ftol=1e-14, gtol=1e-14, x_scale="jac")
        np.testing.assert_allclose(found[k], best.x, atol=1e-6 * np.ptp(x))


def test_lines_that_meet_behind_a_camera_give_no_point():
    straight = {"scale": 0.001, "angle": 0.0, "image_size": (1001, 1001)}
    rig = Rig(
        [
            PerspectiveCamera(position=(0, 0, 10), normal=(0, 0, 1), **straight),
            PerspectiveCamera(position=(4, 0, 10), normal=(0, 0, 1), **straight),
        ]
    )
    # By hand: (0, 0, 2) lies 8 below the first camera, and .5 of the depth to the other's side.
    seen = [np.array([[500.0, 500.0]]), np.array([[0.0, 500.0]])]
    np.testing.assert_allclose(reconstruct(seen, rig), [[0, 0, 2]], atol=1e-9)
    assert np.isnan(reconstruct([seen[0], 1000 - seen[1]], rig)).all()
    assert np.isnan(reconstruct([seen[0], seen[0]], rig)).all()  # parallel
