"""Geometry against scipy's Rotation, against the definitions, and by properties."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vidsindy_lite.cameras import OrthographicCamera
from vidsindy_lite.cameras.models import (
    plane_projection,
    plane_through,
    rodrigues,
    rotation_to_z,
    signed_distance,
)

E_Z = np.array([0.0, 0.0, 1.0])


def vectors(size):
    return st.tuples(*[st.floats(-size, size, allow_subnormal=False)] * 3).map(np.array)


def directions():
    return vectors(1.0).filter(lambda v: np.linalg.norm(v) > 1e-3)


@given(directions(), st.floats(-10, 10))
def test_rodrigues_agrees_with_scipy(axis, angle):
    expected = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
    np.testing.assert_allclose(rodrigues(axis, angle), expected, atol=1e-14)


@given(directions())
def test_rotation_to_z_is_a_rotation_of_the_normal_to_z(normal):
    rotation = rotation_to_z(normal)
    unit = normal / np.linalg.norm(normal)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1, abs=1e-14)
    np.testing.assert_allclose(rotation @ unit, E_Z, atol=1e-14)
    np.testing.assert_allclose(rotation[2], unit, atol=1e-14)


@given(directions())
def test_rotation_to_z_is_the_shortest(normal):
    # No rotation that takes n to e_z turns by less than the angle between them.
    unit = normal / np.linalg.norm(normal)
    angle = np.arctan2(np.hypot(unit[0], unit[1]), unit[2])
    turned = Rotation.from_matrix(rotation_to_z(normal)).magnitude()
    assert turned == pytest.approx(angle, abs=1e-7)


def test_rotation_to_z_by_hand():
    np.testing.assert_allclose(
        rotation_to_z([1, 0, 0]), [[0, 0, -1], [0, 1, 0], [1, 0, 0]], atol=1e-15
    )
    np.testing.assert_allclose(
        rotation_to_z([0, 1, 0]), [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-15
    )


def test_normals_along_z():
    np.testing.assert_array_equal(rotation_to_z([0, 0, 2]), np.eye(3))
    np.testing.assert_allclose(rotation_to_z([0, 0, -2]), np.diag([1, -1, -1]), atol=1e-15)


@pytest.mark.parametrize("tilt", 10.0 ** np.arange(-300, 0, 23))
def test_continuous_near_parallel(tilt):
    rotation = rotation_to_z([tilt, -2 * tilt, 1])
    np.testing.assert_allclose(rotation, np.eye(3), atol=2.5 * tilt)
    # The tilt itself is not rounded away.
    np.testing.assert_allclose(rotation[:2, 2], [-tilt, 2 * tilt], rtol=3 * tilt + 1e-14)


@pytest.mark.parametrize("tilt", 10.0 ** np.arange(-300, 0, 23))
def test_accurate_near_antiparallel(tilt):
    normal = np.array([tilt, tilt, -1])
    rotation = rotation_to_z(normal)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(rotation @ (normal / np.linalg.norm(normal)), E_Z, atol=1e-14)


@given(vectors(100.0), directions(), st.floats(-100, 100))
def test_projection_is_the_nearest_point_of_the_plane(x, normal, d):
    foot = plane_projection(x, normal, d)
    length = np.linalg.norm(normal)
    assert normal @ foot + d == pytest.approx(0, abs=1e-10)
    np.testing.assert_allclose(np.cross(x - foot, normal / length), 0, atol=1e-10 / length)
    np.testing.assert_allclose(plane_projection(foot, normal, d), foot, atol=1e-10 / length)


def test_projection_is_equation_s3():
    x, y, z = point = np.array([1.0, -2.0, 3.0])
    a, b, c, d = 0.5, 2.0, -1.0, 4.0
    expected = np.array(
        [
            x * (b**2 + c**2) - a * (b * y + c * z + d),
            y * (a**2 + c**2) - b * (a * x + c * z + d),
            z * (a**2 + b**2) - c * (a * x + b * y + d),
        ]
    ) / (a**2 + b**2 + c**2)
    np.testing.assert_allclose(plane_projection(point, (a, b, c), d), expected, rtol=1e-14)


@given(vectors(100.0), directions(), st.floats(-100, 100), st.floats(-100, 100))
def test_in_plane_coordinates_do_not_depend_on_d(x, normal, d1, d2):
    unit = normal / np.linalg.norm(normal)
    rotation = rotation_to_z(unit)
    first = rotation @ plane_projection(x, unit, d1)
    second = rotation @ plane_projection(x, unit, d2)
    np.testing.assert_allclose(first[:2], second[:2], atol=1e-11)
    np.testing.assert_allclose(first[:2], rotation[:2] @ x, atol=1e-11)
    assert first[2] - second[2] == pytest.approx(d2 - d1, abs=1e-11)


@given(vectors(100.0), directions())
def test_offset_is_the_signed_distance_to_the_turned_coordinate_planes(position, normal):
    x_axis, y_axis, z_axis = rotation_to_z(normal)
    to_yz = signed_distance(position, *plane_through((0, 0, 0), y_axis, z_axis))
    to_xz = signed_distance(position, *plane_through((0, 0, 0), z_axis, x_axis))
    offset = OrthographicCamera(position=position, normal=normal).offset
    np.testing.assert_allclose(offset, [to_yz, to_xz], atol=1e-11)


def test_offset_by_hand_has_a_sign():
    above = OrthographicCamera(position=[3, -4, 7], normal=[0, 0, 1])
    np.testing.assert_allclose(above.offset, [3, -4], atol=1e-15)
    beside = OrthographicCamera(position=[3, -4, 7], normal=[1, 0, 0])
    np.testing.assert_allclose(beside.offset, [-7, -4], atol=1e-14)


def test_plane_through_by_hand():
    normal, d = plane_through((1, 0, 2), (0, 1, 2), (-1, -1, 2))
    np.testing.assert_allclose(normal, E_Z, atol=1e-15)
    assert d == pytest.approx(-2)


def test_a_small_triangle_far_away_is_a_plane():
    normal, d = plane_through((1e6, 0, 0), (1e6, 1e-6, 0), (1e6, 0, 1e-6))
    np.testing.assert_allclose(normal, [1, 0, 0], atol=1e-15)
    assert d == pytest.approx(-1e6)
    for size in (1e-6, 1e6):
        with pytest.raises(ValueError, match="must not lie on one line"):
            plane_through((0, 0, 0), (size, size, 0), (3 * size, 3 * size, 1e-13 * size))


def test_distance_does_not_depend_on_the_length_of_the_equation():
    x = np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(signed_distance(x, (0, 0, 2), -4), [1, -2])
    np.testing.assert_allclose(signed_distance(x, (0, 0, -2), 4), [-1, 2])


def test_nan_rows_pass_through():
    projected = plane_projection([[np.nan] * 3, [1.0, 2.0, 3.0]], (0, 0, 1), 0)
    assert np.isnan(projected[0]).all()
    np.testing.assert_array_equal(projected[1], [1, 2, 0])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rotation_to_z([0, 0, 0]), "normal: must not be the zero vector, got"),
        (lambda: rotation_to_z([1, 2]), "normal: must be 3 finite numbers, got"),
        (lambda: rotation_to_z([1, np.nan, 0]), "normal: must be 3 finite numbers, got"),
        (lambda: rodrigues([0, 0, 0], 1.0), "axis: must not be the zero vector, got"),
        (lambda: rodrigues([0, 0, 1], np.inf), "angle: must be a finite number, got inf"),
        (lambda: plane_projection([1, 2], [0, 0, 1], 0), r"x: must have shape \(\.\.\., 3\), got"),
        (lambda: signed_distance(1.0, [0, 0, 1], 0), r"x: must have shape \(\.\.\., 3\), got"),
        (lambda: plane_through((0, 0, 0), (1, 1, 1), (2, 2, 2)), "must not lie on one line"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(ValueError, match=message):
        call()
