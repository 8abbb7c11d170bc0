"""Models of cameras: planes, the convention, lenses, shutters, and what bad input is told."""

import pickle
import warnings
from dataclasses import FrozenInstanceError, replace

import cv2
import numpy as np
import pytest
from helpers import scene
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vidsindy_lite.cameras import OrthographicCamera, PerspectiveCamera, Rig
from vidsindy_lite.cameras.models import distorted, rotation_to_z, undistorted

SEEDS = st.integers(0, 2**32 - 1)


def test_convention_by_hand():
    # Looking down the z axis, unturned: x to the right, y up, so v falls as y grows.
    camera = OrthographicCamera(position=(1, 2, 50), normal=(0, 0, 1), scale=0.5, angle=0.0)
    np.testing.assert_allclose(camera.project([[1, 2, -9]]), [[255.5, 255.5]])
    np.testing.assert_allclose(camera.project([[2, 2, 0]]), [[257.5, 255.5]])
    np.testing.assert_allclose(camera.project([[1, 3, 0]]), [[255.5, 253.5]])
    assert np.isnan(camera.project([[np.nan, 0, 0]])).all()
    # A pixel is 1.25 times as high as wide, and (10, 20) is the middle.
    oblong = replace(camera, principal_point=(10, 20), aspect=1.25)
    np.testing.assert_allclose(oblong.project([[2, 3, 0]]), [[12, 17.5]])
    np.testing.assert_allclose(oblong.plane_coordinates([[12, 17.5]]), [[2, 3]])


@given(SEEDS)
@settings(max_examples=20)
def test_project_satisfies_the_camera_equation(seed):
    x, rig, _, _ = scene(seed, n=5)
    for camera in rig.cameras:
        u, v = camera.project(x).T
        x_c = np.array([u - 511 / 2, 511 / 2 - v])
        c, s = np.cos(camera.angle), np.sin(camera.angle)
        left = camera.scale * np.array([[c, s], [-s, c]]) @ x_c + camera.offset[:, None]
        right = rotation_to_z(camera.normal)[:2] @ x.T
        np.testing.assert_allclose(left, right, atol=1e-10 * np.abs(x).max())


def test_depth_is_not_seen():
    x, rig, tracks, _ = scene(7, n=40)
    for camera, track in zip(rig.cameras, tracks, strict=True):
        seen = camera.plane_coordinates(track)
        np.testing.assert_allclose(seen, x @ camera.rows.T, atol=1e-10 * np.abs(x).max())
        nearer = replace(camera, position=camera.position + 3 * camera.normal)
        np.testing.assert_allclose(nearer.project(x), track, atol=1e-9)


def test_a_camera_is_frozen_normalises_and_has_a_hash():
    camera = OrthographicCamera(position=[1, 2, 3], normal=[0, 3, 4])
    np.testing.assert_allclose(camera.normal, [0, 0.6, 0.8], rtol=1e-15)
    assert not camera.is_calibrated
    for length in (1e-200, 1e200, 5e-324):
        assert replace(camera, normal=[0, 0, length]).normal.tolist() == [0, 0, 1]
    with pytest.raises(FrozenInstanceError):
        camera.scale = 1.0
    with pytest.raises(ValueError, match="read-only"):
        camera.normal[0] = 1.0
    position = np.zeros(3)
    camera = OrthographicCamera(position=position, normal=[0, 0, 1])
    position[0] = 9
    assert camera.position[0] == 0
    camera = OrthographicCamera(position=[1, 2, 0.0], normal=[0, 3, 4], scale=1, angle=0)
    twin = OrthographicCamera(position=(1, 2, -0.0), normal=(0, 3.0, 4), scale=1.0, angle=-0.0)
    assert camera == twin
    assert len({camera, twin, replace(camera, scale=2), replace(camera, angle=1)}) == 3
    rig = Rig([camera, replace(camera, normal=(1, 0, 0))])
    assert len({rig, Rig(rig.cameras), rig.uncalibrated()}) == 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position": (1, 2, np.inf)}, "position: must be 3 finite numbers, got"),
        ({"normal": (0, 0, 0)}, "normal: must not be the zero vector, got"),
        ({"angle": None}, "scale and angle: give both .* or neither .* got scale=1.0, angle=N"),
        ({"scale": 0}, "scale: must be positive, got 0"),
        ({"angle": "left"}, "angle: must be a finite number, got 'left'"),
        ({"image_size": (512, 0)}, r"image_size: must be two integers .*, got \(512, 0\)"),
        ({"principal_point": (1, 2, 3)}, "principal_point: must be 2 finite numbers, got"),
        ({"aspect": 0}, "aspect: must be positive, got 0"),
        ({"position_error": "far"}, "position_error: must be a finite number, got 'far'"),
        ({"normal_error": -0.5}, "normal_error: must be zero or positive, got -0.5"),
        ({"readout": -1.01}, "readout: must be between -1 and 1 frames, got"),
        ({"readout": 1.01}, "readout: must be between -1 and 1 frames, got"),
        ({"distortion": range(9)}, "distortion: must be at most 8 finite numbers, k1"),
        ({"distortion": 0.1}, "distortion: must be at most 8 finite numbers"),
    ],
)
def test_bad_camera(change, message):
    good = {"position": (0, 0, 0), "normal": (0, 0, 1), "scale": 1.0, "angle": 0.0}
    with pytest.raises(ValueError, match=message):
        PerspectiveCamera(**good | change)
    short = PerspectiveCamera(**good, distortion=(-0.1, 0.02))
    assert short.distortion.tolist() == [-0.1, 0.02, 0, 0, 0]
    assert short.project(np.zeros((0, 3))).shape == (0, 2)


E_Z = np.array([0.0, 0.0, 1.0])


def directions():
    parts = st.tuples(*[st.floats(-1.0, 1.0, allow_subnormal=False)] * 3)
    return parts.map(np.array).filter(lambda v: np.linalg.norm(v) > 1e-3)


@given(directions())
def test_rotation_to_z_is_a_rotation_of_the_normal_to_z(normal):
    rotation = rotation_to_z(normal)
    unit = normal / np.linalg.norm(normal)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1, abs=1e-14)
    np.testing.assert_allclose(rotation @ unit, E_Z, atol=1e-14)
    np.testing.assert_allclose(rotation[2], unit, atol=1e-14)
    axis = np.cross(unit, E_Z)
    if (sine := np.linalg.norm(axis)) > 1e-9:
        expected = Rotation.from_rotvec(np.arctan2(sine, unit[2]) / sine * axis).as_matrix()
        np.testing.assert_allclose(rotation, expected, atol=1e-14)


def test_rotation_to_z_at_and_near_the_z_axis():
    np.testing.assert_array_equal(rotation_to_z([0, 0, 2]), np.eye(3))
    np.testing.assert_allclose(rotation_to_z([0, 0, -2]), np.diag([1, -1, -1]), atol=1e-15)
    for tilt in 10.0 ** np.arange(-300, 0, 23):
        rotation = rotation_to_z([tilt, -2 * tilt, 1])
        np.testing.assert_allclose(rotation, np.eye(3), atol=2.5 * tilt)
        # The tilt itself is not rounded away.
        np.testing.assert_allclose(rotation[:2, 2], [-tilt, 2 * tilt], rtol=3 * tilt + 1e-14)
        normal = np.array([tilt, tilt, -1])
        rotation = rotation_to_z(normal)
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
        np.testing.assert_allclose(rotation @ (normal / np.linalg.norm(normal)), E_Z, atol=1e-14)


UNKNOWN = PerspectiveCamera(position=(0, 0, 1), normal=(0, 0, 1))
AT_REST = OrthographicCamera(position=(0, 0, 0), normal=(0, 0, 1), scale=1, angle=0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: AT_REST.project(np.zeros((4, 2))), r"x: must have shape \(n, 3\), got \(4, 2\)"),
        (lambda: AT_REST.project([[0, np.inf, 0]]), "x: must be finite or NaN, got 1 infinite"),
        (lambda: AT_REST.plane_coordinates([1, 2]), r"pixels: must have shape \(n, 2\), got \(2,"),
        (lambda: UNKNOWN.project(np.eye(3)), "scale and angle must be known, got None"),
        (lambda: UNKNOWN.plane_coordinates(np.eye(2)), "scale and angle must be known, got None"),
        (lambda: UNKNOWN.focal_length, "scale and angle must be known"),
        (lambda: rotation_to_z([0, 0, 0]), "normal: must not be the zero vector, got"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(ValueError, match=message):
        call()


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
@settings(max_examples=20)
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
    # And the ideal image is found again.
    pinhole = replace(camera, distortion=None, principal_point=None, aspect=1.0)
    ideal = pinhole.centred(pinhole.project(x))
    np.testing.assert_allclose(camera.centred(camera.project(x)), ideal, atol=1e-9, rtol=0)
    assert pickle.loads(pickle.dumps(camera)) == camera  # though it is used


def test_the_lens_is_that_of_brown():
    rng = np.random.default_rng(0)
    (x, y), (k1, k2, p1, p2, k3) = rng.uniform(-0.5, 0.5, (2, 40)), rng.normal(0, 0.05, 5)
    r2 = x**2 + y**2
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    v = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    seen = distorted(np.column_stack([x, y]), np.array([k1, k2, p1, p2, k3]))
    np.testing.assert_allclose(seen, np.column_stack([u, v]), atol=1e-12)


@pytest.mark.parametrize(("power", "which"), [(1, 0), (2, 1), (3, 4)])
def test_every_power_of_the_radius_folds_where_its_image_is_largest(power, which):
    # With k = -1/(2p + 1) the image of the radius r is r + k r^(2p + 1), largest at r = 1.
    coefficients = np.zeros(5)
    coefficients[which] = -1 / (2 * power + 1)
    largest = 1 - 1 / (2 * power + 1)
    radii = np.array([0.5, 0.9, 0.999])
    points = np.outer(radii * (1 + coefficients[which] * radii ** (2 * power)), [0.6, -0.8])
    with warnings.catch_warnings(action="error"):
        found = undistorted(points, coefficients)
        none = undistorted(np.array([[0.0, 1.001 * largest], [np.nan, 0]]), coefficients)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), radii, rtol=1e-9)
    np.testing.assert_allclose(distorted(found, coefficients), points, atol=1e-13)
    assert np.isnan(none).all()


@given(SEEDS)
@settings(max_examples=20)
def test_a_file_keeps_every_digit(tmp_path_factory, seed):
    rng = np.random.default_rng(seed)
    errors = rng.uniform(0, 1, 6)
    names = ("position", "normal", "scale", "principal_point", "readout", "distortion")
    more = {f"{name}_error": error for name, error in zip(names, errors, strict=True)}
    flat = OrthographicCamera(normal=rng.normal(size=3), position=rng.normal(size=3))
    full = any_camera(rng, readout=rng.uniform(-1, 1), **more)
    rig = Rig([full, any_camera(rng), flat], warnings=("of no file, nor of what is equal",))
    path = tmp_path_factory.mktemp("rig") / "rig.toml"
    rig.save(path)
    assert Rig.load(path) == rig
    assert Rig.load(path).warnings == ()
    assert len({rig, Rig.load(path), Rig((rig.cameras[0], any_camera(rng)))}) == 2


def test_a_ball_through_a_lens():
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


def steadied(track, readout, height):
    camera = OrthographicCamera(normal=(0, 0, 1), readout=readout, image_size=(100, height))
    return camera.steadied(track)


def test_a_global_shutter_and_gaps_stay_as_they_are():
    track = np.cumsum(np.ones((9, 2)), axis=0)
    track[4] = np.nan
    assert steadied(track, 0.0, 100) is track
    assert np.flatnonzero(np.isnan(steadied(track, 0.5, 100)).any(axis=1)).tolist() == [4]
    short = np.full((9, 2), np.nan)
    short[:3] = 1.0
    assert steadied(short, 0.5, 100) is short


@given(st.floats(-0.9, 0.9), st.integers(100, 1000))
def test_a_steady_motion_is_put_back_in_time(readout, height):
    """A point at row v is seen readout (v - (H - 1) / 2) / H frames late."""
    k = np.arange(30.0)
    # Rows v = a + b (k + late(v)), solved for v.
    a, b = 0.3 * height, 0.01 * height
    share = readout / height
    row = (a + b * (k - share * (height - 1) / 2)) / (1 - b * share)
    late = readout * (row - (height - 1) / 2) / height
    seen = np.column_stack((5 - 2 * (k + late), row))
    np.testing.assert_allclose(seen[:, 1], a + b * (k + late), atol=1e-9 * height)
    expected = np.column_stack((5 - 2 * k, a + b * k))
    np.testing.assert_allclose(steadied(seen, readout, height), expected, atol=1e-8 * height)
