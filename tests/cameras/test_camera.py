"""What all cameras share: the convention, values that cannot change, and what bad input is told."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from helpers import scene
from hypothesis import given, settings
from hypothesis import strategies as st

from vidsindy_lite.cameras import OrthographicCamera, Rig
from vidsindy_lite.cameras.models import plane_projection, rotation_to_z, turn

SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture
def small():
    return scene(7, n=40)


def test_convention_by_hand():
    # Looking down the z axis, unturned: x to the right, y up, so v falls as y grows.
    camera = OrthographicCamera(position=(1, 2, 50), normal=(0, 0, 1), scale=0.5, angle=0.0)
    np.testing.assert_allclose(camera.project([[1, 2, -9]]), [[255.5, 255.5]])
    np.testing.assert_allclose(camera.project([[2, 2, 0]]), [[257.5, 255.5]])
    np.testing.assert_allclose(camera.project([[1, 3, 0]]), [[255.5, 253.5]])


def test_in_plane_angle_by_hand():
    # T(pi/2) takes (0, 1) to (1, 0): a step along x is seen as a step up the image.
    camera = OrthographicCamera(position=(0, 0, 0), normal=(0, 0, 1), scale=1, angle=np.pi / 2)
    np.testing.assert_allclose(camera.project([[1, 0, 0]]), [[255.5, 254.5]])


def test_image_size():
    camera = OrthographicCamera(
        position=(0, 0, 0), normal=(0, 0, 1), scale=1, angle=0, image_size=(641, 481)
    )
    np.testing.assert_allclose(camera.project([[0, 0, 0]]), [[320, 240]])


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


def test_plane_coordinates_undo_project(small):
    x, rig, tracks, _ = small
    for camera, track in zip(rig.cameras, tracks, strict=True):
        seen = camera.plane_coordinates(track)
        np.testing.assert_allclose(seen, x @ camera.rows.T, atol=1e-10 * np.abs(x).max())


def test_depth_is_not_seen(small):
    x, rig, tracks, _ = small
    for camera, track in zip(rig.cameras, tracks, strict=True):
        on_plane = plane_projection(x, camera.normal, -camera.normal @ camera.position)
        np.testing.assert_allclose(camera.project(on_plane), track, atol=1e-9)
        nearer = replace(camera, position=camera.position + 3 * camera.normal)
        np.testing.assert_allclose(nearer.project(x), track, atol=1e-9)


def test_nan_rows_pass_through():
    camera = OrthographicCamera(position=(0, 0, 0), normal=(1, 1, 1), scale=1, angle=0)
    pixels = camera.project([[np.nan, 0, 0], [0, 0, 0]])
    assert np.isnan(pixels[0]).all()
    np.testing.assert_allclose(pixels[1], 255.5)


def test_is_frozen_and_normalises():
    camera = OrthographicCamera(position=[1, 2, 3], normal=[0, 3, 4])
    np.testing.assert_allclose(camera.normal, [0, 0.6, 0.8], rtol=1e-15)
    assert not camera.is_calibrated
    with pytest.raises(FrozenInstanceError):
        camera.scale = 1.0
    with pytest.raises(ValueError, match="read-only"):
        camera.normal[0] = 1.0


def test_does_not_share_memory_with_its_arguments():
    position = np.zeros(3)
    camera = OrthographicCamera(position=position, normal=[0, 0, 1])
    position[0] = 9
    assert camera.position[0] == 0


def test_equality():
    camera = OrthographicCamera(position=[1, 2, 3], normal=[0, 3, 4], scale=1, angle=0)
    assert camera == replace(camera)
    assert camera != replace(camera, scale=2)
    assert camera != "camera"


def test_hash_agrees_with_equality():
    camera = OrthographicCamera(position=[1, 2, 0.0], normal=[0, 3, 4], scale=1, angle=0)
    twin = OrthographicCamera(position=(1, 2, -0.0), normal=(0, 3.0, 4), scale=1.0, angle=-0.0)
    assert camera == twin
    assert len({camera, twin, replace(camera, scale=2), replace(camera, angle=1)}) == 3
    rig = Rig([camera, replace(camera, normal=(1, 0, 0))])
    assert len({rig, Rig(rig.cameras), rig.uncalibrated()}) == 2


@pytest.mark.parametrize("length", [1e-200, 1e200, 5e-324])
def test_normals_of_any_length(length):
    camera = OrthographicCamera(position=[0, 0, 0], normal=[0, 0, length])
    assert camera.normal.tolist() == [0, 0, 1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position": (1, 2)}, "position: must be 3 finite numbers, got"),
        ({"position": (1, 2, np.inf)}, "position: must be 3 finite numbers, got"),
        ({"normal": (0, 0, 0)}, "normal: must not be the zero vector, got"),
        ({"normal": "up"}, "normal: must be an array of real numbers, got 'up'"),
        ({"angle": None}, "scale and angle: give both .* or neither .* got scale=1.0, angle=N"),
        ({"scale": 0}, "scale: must be positive, got 0"),
        ({"scale": -1}, "scale: must be positive, got -1"),
        ({"scale": True}, "scale: must be a finite number, got True"),
        ({"scale": np.nan}, "scale: must be a finite number, got nan"),
        ({"angle": "left"}, "angle: must be a finite number, got 'left'"),
        ({"image_size": (512, 0)}, r"image_size: must be two integers .*, got \(512, 0\)"),
        ({"image_size": (512.5, 512)}, "image_size: must be two integers of at least 1, got"),
        ({"image_size": 512}, "image_size: must be two integers of at least 1, got 512"),
    ],
)
def test_bad_camera(change, message):
    good = {"position": (0, 0, 0), "normal": (0, 0, 1), "scale": 1.0, "angle": 0.0}
    with pytest.raises(ValueError, match=message):
        OrthographicCamera(**good | change)


def test_bad_points(small):
    camera = small[1].cameras[0]
    with pytest.raises(ValueError, match=r"x: must have shape \(n, 3\), got \(4, 2\)"):
        camera.project(np.zeros((4, 2)))
    with pytest.raises(ValueError, match="x: must be finite or NaN, got 1 infinite values"):
        camera.project([[0, np.inf, 0]])
    with pytest.raises(ValueError, match=r"pixels: must have shape \(n, 2\), got \(2,\)"):
        camera.plane_coordinates([1, 2])


def test_uncalibrated_camera_cannot_project():
    camera = OrthographicCamera(position=(0, 0, 0), normal=(0, 0, 1))
    for use in (camera.project, camera.plane_coordinates):
        with pytest.raises(ValueError, match="scale and angle must be known, got None"):
            use(np.zeros((1, 3)))


def test_the_offset_is_where_the_position_lies_in_the_plane():
    camera = OrthographicCamera(position=(2, -3, 7), normal=(0, 0, 1), scale=1, angle=0)
    np.testing.assert_allclose(camera.offset, [2, -3])
    there = camera.placed(np.array([5.0, 6.0]))
    np.testing.assert_allclose(there.position, [5, 6, 0], atol=1e-15)
    np.testing.assert_allclose(there.offset, [5, 6])


def test_turns_are_clockwise():
    np.testing.assert_allclose(turn(np.pi / 6), [[np.sqrt(3) / 2, 0.5], [-0.5, np.sqrt(3) / 2]])


def test_pixels_of_an_oblong_image_and_back():
    """A pixel is 1.25 times as high as wide, and (10, 20) is the middle."""
    camera = OrthographicCamera(
        position=(1, 2, 3), normal=(0, 0, 1), scale=0.5, angle=0, principal_point=(10, 20),
        aspect=1.25,
    )  # fmt: skip
    np.testing.assert_allclose(camera.project([[2, 3, 0]]), [[12, 17.5]])
    np.testing.assert_allclose(camera.centred(np.array([[12, 17.5]])), [[2, 2]])
    np.testing.assert_allclose(camera.plane_coordinates([[12, 17.5]]), [[2, 3]])


def test_what_a_camera_is_calibrated_with():
    camera = OrthographicCamera(position=(0, 0, 0), normal=(0, 0, 1))
    learned = camera.calibrated(0.25 * np.exp(0.75j))
    np.testing.assert_allclose(learned.calibration, [0.25, 0.75])
    assert not camera.is_calibrated
    assert learned.is_placed
    for lost in ("offset", "matrix"):
        with pytest.raises(ValueError, match="camera: position must be known, got None"):
            getattr(OrthographicCamera(normal=(0, 0, 1)), lost)


@pytest.mark.parametrize("readout", [-1, 1])
def test_readouts_are_a_frame_at_most(readout):
    assert OrthographicCamera(normal=(0, 0, 1), readout=readout).readout == readout
    with pytest.raises(ValueError, match="readout: must be between -1 and 1 frames, got"):
        OrthographicCamera(normal=(0, 0, 1), readout=1.01 * readout)


@pytest.mark.parametrize("name", ["position_error", "normal_error", "readout_error"])
def test_errors_of_measurements_are_not_negative(name):
    camera = OrthographicCamera(normal=(0, 0, 1), **{name: 0.5})
    assert camera.errors[name] == 0.5
    assert sum(camera.errors.values()) == 0.5
    with pytest.raises(ValueError, match=f"{name}: must be zero or positive, got -0.5"):
        OrthographicCamera(normal=(0, 0, 1), **{name: -0.5})
