"""What a change of a camera is: each part of it alone, in the camera's own axes."""

import numpy as np
import pytest
from helpers import room

import vidsindy_lite as vl
from vidsindy_lite.cameras.adjust import PARTS, SIZE, NearCamera, changed, known_to, units

CAMERA = room(np.random.default_rng(3), principal_point=(630.0, 350.0), readout=0.3).cameras[0]


def after(camera=CAMERA, **parts):
    change = np.zeros(SIZE)
    for name, values in parts.items():
        change[PARTS[name.replace("_", " ")]] = values
    return changed(camera, change)


def test_a_position_moves_along_the_axes_of_the_image():
    moved = after(position=(0.1, -0.2, 0.3)).position - CAMERA.position
    along, across = CAMERA.normal @ moved, CAMERA.rows @ moved
    np.testing.assert_allclose([*across, along], (0.1, -0.2, 0.3), atol=1e-12)


def test_numbers_of_the_image_are_added():
    assert after(principal_point=(5.0, -7.0)).principal_point.tolist() == [635, 343]
    bent = after(distortion=(0.1, -0.02, 0.001, 0.002))
    assert bent.distortion.tolist() == [0.1, -0.02, 0.001, 0.002, 0]
    twice = after(bent, distortion=(0.1, 0, 0, 0))
    np.testing.assert_allclose(twice.distortion, [0.2, -0.02, 0.001, 0.002, 0])


@pytest.mark.parametrize(("by", "readout"), [(0.2, 0.5), (-0.4, -0.1), (0.9, 1.0), (-2, -1.0)])
def test_a_shutter_rolls_over_one_frame_at_most(by, readout):
    assert after(readout=by).readout == pytest.approx(readout)


def test_a_scale_grows_by_a_factor_and_an_angle_by_a_sum():
    turned = after(scale=0.1, angle=0.2)
    assert turned.scale == pytest.approx(CAMERA.scale * np.exp(0.1))
    assert np.exp(1j * turned.angle) == pytest.approx(np.exp(1j * (CAMERA.angle + 0.2)))


def test_a_nearer_camera_sees_what_is_close_larger():
    about = np.array([1.0, 2.0, 3.0])
    near = NearCamera(
        position=about, normal=(0.6, 0, 0.8), scale=1.0, angle=0.0, about=about, nearness=0.01
    )
    nearer = after(near, nearness=0.04)
    assert nearer.nearness == pytest.approx(0.05)
    right = near.rows[0]
    at = [about, about + right, about + right + 4 * near.normal]  # the last one 4 nearer, of 20
    middle, beside, close = nearer.image(np.array(at))
    assert np.linalg.norm(beside - middle) > 0.1
    np.testing.assert_allclose(close - middle, (beside - middle) / 0.8, atol=1e-9)


def test_sizes_of_changes_are_those_of_the_scene_and_the_image():
    sizes = units(4.0, 1280.0)
    assert (sizes[PARTS["position"]] == 4).all()
    assert (sizes[PARTS["principal point"]] == 1280).all()
    assert (sizes[PARTS["nearness"]] == 0.25).all()
    assert (sizes[PARTS["normal"]] == 1).all()


def test_how_well_a_camera_is_known():
    """A tangential distortion is ten times as small as a radial one."""
    image = {"principal_point_error": 4.0, "distortion_error": 0.3, "readout_error": 0.2}
    errors = {"normal_error": 2.0, "scale_error": 0.03, "position_error": 0.5, **image}
    place = {"position": (0, 0, 9), "normal": (0, 0, 1)}
    known = known_to(vl.PerspectiveCamera(**place, scale=1, angle=0, **errors))
    two = np.deg2rad(2)
    expected = [two, two, two, 0.03, *[0.5] * 3, 4, 4, 0.3, 0.3, 0.03, 0.03, 0.2, 0, 0, 0]
    np.testing.assert_allclose(known, expected)
    unknown = known_to(vl.PerspectiveCamera(**place))
    assert np.flatnonzero(unknown).tolist() == [2, 3]
    assert np.isinf(unknown[2:4]).all()
    flat = known_to(vl.OrthographicCamera(normal=(0, 0, 1), scale=1, angle=0))
    assert np.flatnonzero(np.isinf(flat)).tolist() == [4, 5]  # along its axis it sees the same
