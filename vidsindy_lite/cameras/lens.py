"""What a lens does to the image of a pinhole: radial and tangential distortion, OpenCV's model.

A point that a pinhole of focal length 1 would show at (x, y), x to the right and y *down* from the
principal point, is seen through the lens at

    x q + 2 p1 x y + p2 (r2 + 2 x^2),      y q + p1 (r2 + 2 y^2) + 2 p2 x y,

    q = (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3),      r2 = x^2 + y^2.

Brown 1966, Photogrammetric Engineering 32; coefficients in OpenCV's order, k1, k2, p1, p2, k3, and
k4, k5, k6 of its rational model.
"""

import numpy as np

from ..arrays import Floats

NAMES = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
USUAL = 5
"""How many of these most lenses have; the others are those of a fraction."""

_STEPS = 30  # of Newton, from the distorted point
_SETTLED = 1e-14  # of the focal length


def distorted(points: Floats, coefficients: Floats) -> Floats:
    """Where points of the ideal image, (n, 2), are seen through the lens."""
    return _distorted(points, coefficients)[0]


def undistorted(points: Floats, coefficients: Floats) -> Floats:
    """Points of the ideal image that are seen at `points`, (n, 2).

    NaN where the model shows none: beyond the circle in which its images do not overlap.
    """
    ideal = points.copy()
    missed = np.zeros_like(points)
    for _ in range(_STEPS):
        seen, slope = _distorted(ideal, coefficients)
        missed = points - seen
        with np.errstate(over="ignore", invalid="ignore"):
            determinant = slope[:, 0, 0] * slope[:, 1, 1] - slope[:, 0, 1] ** 2
        folded = ~(determinant > 0)  # the image turns over there: no lens does that
        missed[folded] = np.nan
        slope[folded] = np.eye(2)
        step = np.linalg.solve(slope, missed[..., None])[..., 0]
        ideal = ideal + step
        if not np.nanmax(np.abs(step), initial=0.0) > _SETTLED:
            break
    ideal[~(np.abs(missed).max(axis=1, initial=0.0) < np.sqrt(_SETTLED))] = np.nan
    return ideal


def _distorted(points: Floats, coefficients: Floats) -> tuple[Floats, Floats]:
    """Where points are seen, (n, 2), and the slope of that, (n, 2, 2)."""
    k1, k2, p1, p2, k3, k4, k5, k6 = np.pad(coefficients, (0, len(NAMES) - len(coefficients)))
    x, y = points.T
    with np.errstate(all="ignore"):  # a step of Newton's may lead far away
        r2 = x**2 + y**2
        below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / below
        growth = k1 + r2 * (2 * k2 + r2 * 3 * k3) - radial * (k4 + r2 * (2 * k5 + r2 * 3 * k6))
        growth *= 2 / below  # of radial, along x: x times this
        seen = np.column_stack(
            (
                x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2),
                y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y,
            )
        )
        across = x * y * growth + 2 * p1 * x + 2 * p2 * y
        slope = np.empty((len(points), 2, 2))
        slope[:, 0, 0] = radial + x**2 * growth + 2 * p1 * y + 6 * p2 * x
        slope[:, 0, 1] = slope[:, 1, 0] = across
        slope[:, 1, 1] = radial + y**2 * growth + 6 * p1 * y + 2 * p2 * x
    return seen, slope
