"""Lenses: OpenCV's model of distortion, principal point and aspect, there and back."""

import warnings
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vidsindy_lite.cameras import OrthographicCamera, PerspectiveCamera, Rig
from vidsindy_lite.cameras.models import distorted, undistorted

SEEDS = st.integers(0, 2**32 - 1)


def any_camera(rng, **more):
    """A 60 degree lens with everything that a lens may have."""
    strength = np.array([0.2, 0.05, 0.01, 0.01, 0.02])
    return PerspectiveCamera(
        position=rng.normal(size=3),
        normal=rng.normal(size=3),
        scale=1 / rng.uniform(500, 600),
        angle=rng.uniform(-np.pi, np.pi),
        image_size=(640, 480),
        principal_point=(320, 240) + 20 * rng.normal(size=2),
        aspect=rng.uniform(0.9, 1.1),
        distortion=strength * rng.uniform(-1, 1, 5),
        **more,
    )


def in_view(rng, camera, n=50):
    """Points in front of a camera, within 45 degrees of its axis."""
    sideways = 0.5 * rng.uniform(-1, 1, (n, 2))
    depth = rng.uniform(1, 5, (n, 1))
    return camera.position + depth * (sideways @ camera.rows - camera.normal)


@given(SEEDS)
@settings(max_examples=40)
def test_agrees_with_opencv(seed):
    rng = np.random.default_rng(seed)
    camera = any_camera(rng)
    x = in_view(rng, camera)
    # OpenCV's camera looks along +z, with y down; T^-1 turns the image.
    axis = np.cross(camera.normal, [0, 0, 1])
    tilt = np.arctan2(np.linalg.norm(axis), camera.normal[2])
    flat = Rotation.from_rotvec(tilt * axis / np.linalg.norm(axis))
    turn = Rotation.from_rotvec([0, 0, camera.angle])
    rotation = (Rotation.from_euler("x", np.pi) * turn * flat).as_matrix()
    f, (u, v) = 1 / camera.scale, camera.principal_point
    inner = np.array([[f, 0, u], [0, f * camera.aspect, v], [0, 0, 1]])
    shift = -rotation @ camera.position
    expected, _ = cv2.projectPoints(x, cv2.Rodrigues(rotation)[0], shift, inner, camera.distortion)
    np.testing.assert_allclose(camera.project(x), expected[:, 0], atol=1e-9, rtol=0)


@given(SEEDS)
@settings(max_examples=40)
def test_the_ideal_image_is_found_again(seed):
    rng = np.random.default_rng(seed)
    camera = any_camera(rng)
    x = in_view(rng, camera)
    pinhole = replace(camera, distortion=None, principal_point=None, aspect=1.0)
    ideal = pinhole.centred(pinhole.project(x))
    np.testing.assert_allclose(camera.centred(camera.project(x)), ideal, atol=1e-9, rtol=0)


def test_where_the_model_folds_there_is_no_ideal_image():
    # With k1 = -1/3 the image of the radius r is r - r^3/3, largest (2/3) at r = 1.
    coefficients = np.array([-1 / 3, 0, 0, 0, 0])
    points = np.array([[0.6, 0.0], [0.66, 0.0], [0.7, 0.0], [np.nan, 0.0]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = undistorted(points, coefficients)
    assert np.isnan(found).all(axis=1).tolist() == [False, False, True, True]
    np.testing.assert_allclose(distorted(found[:2], coefficients), points[:2], atol=1e-13)


@pytest.mark.parametrize(("power", "which"), [(1, 0), (2, 1), (3, 4)])
def test_every_power_of_the_radius_folds_where_its_image_is_largest(power, which):
    # With k = -1/(2p + 1) the image of the radius r is r + k r^(2p + 1), largest at r = 1.
    coefficients = np.zeros(5)
    coefficients[which] = -1 / (2 * power + 1)
    largest = 1 - 1 / (2 * power + 1)
    radii = np.array([0.5, 0.9, 0.999])
    points = np.outer(radii * (1 + coefficients[which] * radii ** (2 * power)), [0.6, -0.8])
    found = undistorted(points, coefficients)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), radii, rtol=1e-9)
    assert np.isnan(undistorted(np.array([[0.0, 1.001 * largest]]), coefficients)).all()


def test_principal_point_and_aspect_by_hand():
    camera = OrthographicCamera(
        position=(0, 0, 0), normal=(0, 0, 1), scale=0.5, angle=0.0,
        principal_point=(100, 50), aspect=2.0,
    )  # fmt: skip
    np.testing.assert_allclose(camera.project([[0, 0, 0], [1, 0, 0]]), [[100, 50], [102, 50]])
    np.testing.assert_allclose(camera.project([[0, 1, 0]]), [[100, 46]])
    np.testing.assert_allclose(camera.plane_coordinates([[102, 46]]), [[1, 1]])


@given(SEEDS)
@settings(max_examples=20)
def test_a_file_keeps_every_digit(tmp_path_factory, seed):
    rng = np.random.default_rng(seed)
    errors = rng.uniform(0, 1, 6)
    names = ("position", "normal", "scale", "principal_point", "readout", "distortion")
    more = {f"{name}_error": error for name, error in zip(names, errors, strict=True)}
    rig = Rig([any_camera(rng, readout=rng.uniform(-1, 1), **more), any_camera(rng)])
    path = tmp_path_factory.mktemp("rig") / "rig.toml"
    rig.save(path)
    assert Rig.load(path) == rig
    assert len({rig, Rig.load(path), Rig((rig.cameras[0], any_camera(rng)))}) == 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"principal_point": (1, 2, 3)}, "principal_point: must be 2 finite numbers, got"),
        ({"aspect": 0}, "aspect: must be positive, got 0"),
        ({"readout": 1.5}, "readout: must be between -1 and 1 frames, got 1.5"),
        ({"normal_error": -2}, "normal_error: must be zero or positive, got -2"),
        ({"position_error": "far"}, "position_error: must be a finite number, got 'far'"),
        ({"distortion": range(9)}, "distortion: must be at most 8 finite numbers, k1"),
        ({"distortion": (np.nan,)}, "distortion: must be at most 8 finite numbers"),
        ({"distortion": 0.1}, "distortion: must be at most 8 finite numbers"),
    ],
)
def test_bad_input_is_named(change, message):
    good = {"position": (0, 0, 0), "normal": (0, 0, 1), "scale": 1.0, "angle": 0.0}
    with pytest.raises(ValueError, match=message):
        PerspectiveCamera(**good | change)


def test_an_orthographic_camera_has_no_distortion(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text("[[camera]]\nnormal = [0, 0, 1]\ndistortion = [0.1]\n", encoding="utf-8")
    message = "camera 0: distortion: must be one of model, target, position"
    with pytest.raises(ValueError, match=message):
        Rig.load(path)


def test_short_distortion_is_filled_with_zeros():
    camera = PerspectiveCamera(position=(0, 0, 0), normal=(0, 0, 1), distortion=(-0.1, 0.02))
    assert camera.distortion.tolist() == [-0.1, 0.02, 0, 0, 0]


def test_a_ball_through_a_lens():
    """Its image is where its outline is seen, and its shape that of the outline."""
    rng = np.random.default_rng(3)
    camera = any_camera(rng)
    plain = replace(camera, distortion=None, principal_point=None, aspect=1.0)
    x = in_view(rng, camera, 10)
    radius = 1e-3
    centroids, shapes = camera.ball_image(x, radius)
    circle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    circle = np.column_stack((np.cos(circle), np.sin(circle)))
    for at, shape, ideal, outline in zip(
        centroids, shapes, *plain.ball_image(x, radius), strict=True
    ):
        seen = camera.seen(plain.centred(ideal + circle @ outline.T))
        np.testing.assert_allclose(at + circle @ shape.T, seen, atol=2e-3)
