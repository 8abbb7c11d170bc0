"""Rotations and planes: how a view plane of known normal sees 3D space.

A view plane with unit normal n is rotated flat: R is the rotation that takes **n to e_z** (not e_z
to n), and the first two rows R^- give the in-plane coordinates R^- x of a point x. Because the
third row of R is n itself, moving the plane along its normal changes R^- x not at all; moving it
sideways changes its origin by the in-plane offset R^- position.

Paper: Eq. (1)-(2), Appendices "Detail of Projection", "Plane Projection Proof" and "Compute offset
distance of a camera plane".
"""

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..checks import check_array, check_number, check_vector

PARALLEL = 1e-6
"""Sine of the angle below which two lines of sight count as parallel."""


def rodrigues(axis: ArrayLike, angle: float) -> Floats:
    """Rotation by an angle about an axis, by Rodrigues' formula.

    Paper: Eq. (1)-(2), R = I + sin(angle) U + (1 - cos(angle)) U^2, where U w = u x w.

    Parameters
    ----------
    axis : array_like, shape (3,)
        Rotation axis u; need not have unit length, must not be zero.
    angle : float
        Rotation angle in radians, right-handed about the axis.

    Returns
    -------
    ndarray, shape (3, 3)

    Raises
    ------
    ValueError
        If the axis is not a finite non-zero vector of shape (3,), or the angle is not finite.
    """
    return _rotation(unit_vector("axis", axis), check_number("angle", angle))


def _rotation(axis: Floats | tuple[float, ...], angle: float) -> Floats:
    """`rodrigues` of a unit vector."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # 1 - cos(a) = 2 sin(a/2)^2 keeps its digits at small angles.
    return np.eye(3) + np.sin(angle) * cross + 2 * np.sin(angle / 2) ** 2 * cross @ cross


def rotation_to_z(normal: ArrayLike) -> Floats:
    """The shortest rotation R that takes a plane's normal to e_z: R n = e_z.

    Paper: Eq. (1)-(2) with axis n x e_z and the angle between n and e_z. The axis is 0/0 for a
    normal along z: +e_z gives the identity (the limit), and -e_z, where every horizontal axis is
    equally short and no limit exists, gives the rotation by pi about the x axis.

    Parameters
    ----------
    normal : array_like, shape (3,)
        Normal of the plane, of any length but zero.

    Returns
    -------
    ndarray, shape (3, 3)
        Rows: the plane's X' axis, its Y' axis, and the unit normal.

    Raises
    ------
    ValueError
        If the normal is not a finite non-zero vector of shape (3,).
    """
    a, b, c = unit_vector("normal", normal)
    horizontal = np.hypot(a, b)
    axis = (b / horizontal, -a / horizontal, 0.0) if horizontal > 0 else (1.0, 0.0, 0.0)
    # arctan2 is accurate at every angle; arccos(c) loses half its digits near 0 and pi.
    return _rotation(axis, np.arctan2(horizontal, c))


def plane_projection(x: ArrayLike, normal: ArrayLike, d: float) -> Floats:
    """Foot of the perpendicular from points to the plane normal . x + d = 0.

    Paper: Eq. (S3), x_p = x - n (n . x + D) / (n . n) with n = (A, B, C).

    Parameters
    ----------
    x : array_like, shape (..., 3)
        Points; NaN rows pass through.
    normal : array_like, shape (3,)
        (A, B, C), of any length but zero.
    d : float
        D, in the units of normal . x.

    Returns
    -------
    ndarray, shape (..., 3)

    Raises
    ------
    ValueError
        If `x` does not end in an axis of length 3, or the normal is not a finite non-zero vector.
    """
    distance = signed_distance(x, normal, d)
    return check_array("x", x) - distance[..., None] * unit_vector("normal", normal)


def signed_distance(x: ArrayLike, normal: ArrayLike, d: float) -> Floats:
    """Signed distance of points to the plane normal . x + d = 0, positive on the normal's side.

    Parameters
    ----------
    x : array_like, shape (..., 3)
        Points; NaN rows pass through.
    normal : array_like, shape (3,)
        Normal of the plane, of any length but zero.
    d : float
        Constant of the plane's equation, in the units of normal . x.

    Returns
    -------
    ndarray, shape (...)

    Raises
    ------
    ValueError
        If `x` does not end in an axis of length 3, or the normal is not a finite non-zero vector.
    """
    points = check_array("x", x)
    if points.ndim == 0 or points.shape[-1] != 3:
        raise ValueError(f"x: must have shape (..., 3), got {points.shape}")
    return points @ unit_vector("normal", normal) + float(d) / np.linalg.norm(normal)


def plane_through(p1: ArrayLike, p2: ArrayLike, p3: ArrayLike) -> tuple[Floats, float]:
    """Plane through three points, as the normal and constant of normal . x + d = 0.

    Paper: Appendix "Compute offset distance of a camera plane", n = p1p2 x p1p3.

    Parameters
    ----------
    p1, p2, p3 : array_like, shape (3,)
        Points; counter-clockwise as seen from the side to which the normal points.

    Returns
    -------
    normal : ndarray, shape (3,)
        Unit normal.
    d : float

    Raises
    ------
    ValueError
        If the points lie on one line, or are not finite vectors of shape (3,).
    """
    p1, p2, p3 = (check_vector(f"p{i}", p, 3) for i, p in enumerate((p1, p2, p3), start=1))
    normal = np.cross(p2 - p1, p3 - p1)
    reach = np.linalg.norm(p2 - p1) * np.linalg.norm(p3 - p1)
    if np.linalg.norm(normal) <= 1e-12 * reach:
        raise ValueError(f"p1, p2, p3: must not lie on one line, got {p1}, {p2}, {p3}")
    normal = unit_vector("normal", normal)
    return normal, -float(normal @ p1)


def unit_vector(name: str, value: ArrayLike) -> Floats:
    """A finite vector of shape (3,), of any length but zero, at unit length.

    Raises
    ------
    ValueError
        If the vector is zero, not finite or of another shape.
    """
    vector = check_vector(name, value, 3)
    largest = np.abs(vector).max()
    if largest == 0:
        raise ValueError(f"{name}: must not be the zero vector, got {vector.tolist()}")
    vector = vector / largest  # so that squares neither overflow nor underflow
    return vector / np.linalg.norm(vector)
