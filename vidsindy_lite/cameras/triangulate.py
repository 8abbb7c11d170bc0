"""Lines of sight: where those of one target meet, and the equations they put on a camera.

A camera sees the point x at the pixel x_c (from the middle of the image, y up) with

    s T(theta) x_c = (X, Y) / W,        (X, Y, W) = matrix @ (x, 1),

where the 3 x 4 camera matrix holds what is known of it, position and normal. W is 1 in an
orthographic camera and the distance along the line of view in a perspective one. For known s and
theta these are two linear equations for x, the line of sight: `intersect`. For known x on some
other camera's line of sight they leave one linear equation for (s cos theta, s sin theta), the
epipolar one: `epipolar_equations`. Neither asks which kind of camera it is.
"""

import numpy as np

# Lines of sight closer to parallel than this (sine of their angle) count as one.
PARALLEL = 1e-6

_STEPS = 30  # of Gauss and Newton; from the linear solution four or five are usual
_SETTLED = 1e-11  # pixels


def intersect(cameras, tracks):
    """Points that calibrated cameras of any kind see at given pixels, by least squares in pixels.

    The linear equations, in scene units, are the start of a Gauss-Newton search for the least
    reprojection error.

    Parameters
    ----------
    cameras : sequence of Camera, length m
    tracks : sequence of ndarray, shape (n, 2)
        Pixels, one array per camera; a row of NaN puts no condition on the point.

    Returns
    -------
    ndarray, shape (n, 3)
        Scene units; NaN where all lines of sight are parallel, or meet behind a camera.
    """
    seen = np.stack([camera.turned(track) for camera, track in zip(cameras, tracks, strict=True)])
    visible = np.isfinite(seen).all(axis=-1)
    seen = np.where(visible[..., None], seen, 0)

    def stacked(pairs):
        """Equations of all cameras, (n, 2 m, 3) and (n, 2 m), zero where the target is hidden."""
        left, right = (np.stack(part, axis=1) for part in zip(*pairs, strict=True))
        shown = visible.T[:, :, None]
        left, right = np.where(shown[..., None], left, 0), np.where(shown, right, 0)
        rows = 2 * len(cameras)
        return left.reshape(-1, rows, 3), right.reshape(-1, rows)

    matrices, scales = [camera.matrix for camera in cameras], [camera.scale for camera in cameras]
    left, right = stacked(map(_line, matrices, scales, seen))
    crossing = np.linalg.svd(left, compute_uv=False)[:, 2] > PARALLEL
    visible, seen = visible[:, crossing], seen[:, crossing]
    point = _least_squares(left[crossing], right[crossing])

    def look(point):
        views = zip(matrices, scales, seen, strict=True)
        slope, missed = stacked(_reprojection(*view, point) for view in views)
        return slope, missed, np.sum(missed**2, axis=1)

    slope, missed, error = look(point)
    part = np.ones((len(point), 1))  # of the step, halved where the whole one leads uphill
    for _ in range(_STEPS):
        step = part * _least_squares(slope, missed)
        with np.errstate(all="ignore"):  # lines that hardly cross may send a point far away
            new_slope, new_missed, new_error = look(point + step)
        moved = np.max(np.abs(slope @ step[..., None]), initial=0)
        lower = new_error <= (1 + 1e-12) * error + _SETTLED**2  # or equal, but for rounding
        part = np.where(lower[:, None], 1, part / 2)
        point[lower] += step[lower]
        slope[lower], missed[lower], error[lower] = (
            new_slope[lower], new_missed[lower], new_error[lower],
        )  # fmt: skip
        if moved <= _SETTLED:
            break
    for matrix, shown in zip(matrices, visible, strict=True):
        depth = point @ matrix[2, :3] + matrix[2, 3]
        point[shown & (depth <= 0)] = np.nan
    x = np.full((len(crossing), 3), np.nan)
    x[crossing] = point
    return x


def epipolar_equations(known, known_pixels, unknown, pixels):
    """Linear equations for scale and angle of one camera from the lines of sight of another.

    On the line x = a + lambda d of the known camera, numerator and denominator of the unknown
    one are g + lambda h and u + lambda v. That (g + lambda h) = (u + lambda v) s T x_c for some
    lambda means, taking lambda out,

        (u h - v g) x (s T x_c) = h x g        (x: cross product in the plane),

    and s T (X, Y) = [[X, Y], [Y, -X]] (s cos theta, s sin theta).

    Parameters
    ----------
    known : Camera
        Calibrated.
    known_pixels : ndarray, shape (n, 2)
    unknown : Camera
        Its scale and angle are not used.
    pixels : ndarray, shape (n, 2)
        Where the unknown camera sees the same points.

    Returns
    -------
    design : ndarray, shape (k, 2)
        Pixels. Frames whose lines of sight cannot disagree are left out.
    target : ndarray, shape (k,)
        In the unit of the unknown camera's scale, times pixels.
    """
    left, right = _line(known.matrix, known.scale, known.turned(known_pixels))
    direction = np.cross(left[:, 0], left[:, 1])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    on_line = (np.linalg.pinv(left) @ right[..., None])[..., 0]
    linear, constant = np.split(unknown.matrix, [3], axis=1)
    g, h = on_line @ linear.T + constant[:, 0], direction @ linear.T
    across = g[:, 2:] * h[:, :2] - h[:, 2:] * g[:, :2]
    size = np.linalg.norm(across, axis=1)
    reach = np.abs(g[:, 2]) + np.abs(h[:, 2]) * np.linalg.norm(g[:, :2], axis=1)
    good = size > PARALLEL * reach
    (a, b), (x, y) = (across[good] / size[good, None]).T, unknown.centred(pixels[good]).T
    design = np.column_stack((a * y - b * x, -a * x - b * y))
    return design, (h[good, 0] * g[good, 1] - h[good, 1] * g[good, 0]) / size[good]


def _line(matrix, scale, turned):
    """Equations left @ x = right of the lines of sight at T x_c, (n, 2, 3), (n, 2), scene units."""
    seen = scale * turned
    left = matrix[:2, :3] - seen[:, :, None] * matrix[2, :3]
    return left, seen * matrix[2, 3] - matrix[:2, 3]


def _reprojection(matrix, scale, turned, x):
    """Slope of the T x_c at which points are seen, (n, 2, 3), and how far it is off, (n, 2)."""
    image = x @ matrix[:, :3].T + matrix[:, 3]
    plane, depth = image[:, :2] / image[:, 2:], image[:, 2, None, None]
    slope = (matrix[:2, :3] - plane[:, :, None] * matrix[2, :3]) / (scale * depth)
    return slope, turned - plane / scale


def _least_squares(left, right):
    """Solutions of many small systems; zero where one is singular: a point that ran far away."""
    q, r = np.linalg.qr(left)
    pivots = np.abs(np.diagonal(r, axis1=1, axis2=2))
    singular = ~(pivots.min(axis=1) > PARALLEL**2 * pivots.max(axis=1))
    r[singular] = np.eye(3)
    x = np.linalg.solve(r, q.swapaxes(1, 2) @ right[..., None])[..., 0]
    x[singular] = 0
    return x
