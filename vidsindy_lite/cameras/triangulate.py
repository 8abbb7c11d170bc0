"""Triangulation: where lines of sight meet, and what each says of the other cameras.

A camera sees the point x at the pixel x_c (from the middle of the image, y up) with

    s T(theta) x_c = (X, Y) / W,        (X, Y, W) = matrix @ (x, 1).

For known s and theta these are two linear equations for x, the line of sight: `intersect`. For
known x on some other camera's line of sight they leave one linear equation for
(s cos theta, s sin theta), the epipolar one: `epipolar_lines` and `epipolar_rows`. None of them
asks which model of camera it is.

Paper: Eq. (6).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..arrays import Bools, Floats, Ints
from .models import PARALLEL, Camera

TRIMMED = 0.9
"""Share of the instants that must agree; the others may hold anything."""
_STEPS = 30  # of Gauss and Newton; from the linear solution four or five are usual
_SETTLED = 1e-11  # pixels


def missed(cameras: Sequence[Camera], tracks: Sequence[Floats]) -> list[Floats]:
    """`residuals` of tracks that were checked."""
    x, _ = intersect(cameras, tracks)
    return [track - camera.image(x) for track, camera in zip(tracks, cameras, strict=True)]


def at_once(cameras: Sequence[Camera], tracks: Sequence[Floats]) -> list[Floats]:
    """Tracks as cameras would have seen them that read all rows at once."""
    return [camera.steadied(track) for camera, track in zip(cameras, tracks, strict=True)]


def trimmed(residual: Floats, share: float = TRIMMED) -> float:
    """Length of the residuals, (n, 2), that one frame in ten exceeds.

    From another share of them if they are normal: their lengths are then Rayleigh's.
    """
    seen = residual[np.isfinite(residual).all(axis=1)]
    if not len(seen):
        return 0.0
    ratio = np.sqrt(np.log(1 - TRIMMED) / np.log(1 - share))
    return float(ratio * np.quantile(np.hypot(*seen.T), share))


def intersect(cameras: Sequence[Camera], tracks: Sequence[Floats]) -> tuple[Floats, Bools]:
    """Points that calibrated cameras of any model see at given pixels, by least squares in pixels.

    The linear equations, in scene units, are the start of a Gauss-Newton search for the least
    reprojection error.

    Parameters
    ----------
    cameras : sequence of Camera, length m
    tracks : sequence of ndarray, shape (n, 2)
        Pixels, one array per camera; a row of NaN puts no condition on the point.

    Returns
    -------
    x : ndarray, shape (n, 3)
        Scene units; NaN where all lines of sight are parallel, or meet behind a camera.
    settled : ndarray of bool, shape (n,)
        Whether the search for a point came to its end.
    """
    matrices = np.array([camera.matrix for camera in cameras])
    scales = np.array([camera.calibration[0] for camera in cameras])
    seen = np.stack([c.turned(track) for c, track in zip(cameras, tracks, strict=True)], axis=1)
    visible = np.asarray(np.isfinite(seen).all(axis=-1))
    seen = np.where(visible[..., None], seen, 0)

    left, right = _stacked(*_lines(matrices, scales, seen), visible)
    crossing = (np.linalg.svd(left, compute_uv=False) > PARALLEL).sum(axis=1) == 3
    x, ended = np.full((len(crossing), 3), np.nan), np.ones(len(crossing), bool)
    if not crossing.any():
        return x, ended
    seen, visible = seen[crossing], visible[crossing]

    def look(point: Floats, frames: Ints) -> tuple[Floats, Floats]:
        slope, missed = _reprojection(matrices, scales, seen[frames], point)
        return _stacked(slope, missed, visible[frames])

    start = _least_squares(left[crossing], right[crossing])
    point, settled = _gauss_newton(look, start)
    depth = point @ matrices[:, 2, :3].T + matrices[:, 2, 3]
    point[(visible & (depth <= 0)).any(axis=1)] = np.nan
    x[crossing], ended[crossing] = point, settled
    return x, ended


def epipolar_lines(known: Camera, pixels: Floats, unknown: Camera) -> tuple[Floats, Floats]:
    """What the lines of sight of one camera are in the image of another, of whatever scale.

    On the line x = a + lambda d of the known camera, numerator and denominator of the unknown
    one are g + lambda h and u + lambda v. That (g + lambda h) = (u + lambda v) s T x_c for some
    lambda means, taking lambda out,

        (u h - v g) x (s T x_c) = h x g        (x: cross product in the plane).

    Parameters
    ----------
    known : Camera
        Calibrated.
    pixels : ndarray, shape (n, 2)
        Where the known camera sees some points.
    unknown : Camera
        Its scale and angle are not used.

    Returns
    -------
    normals : ndarray, shape (n, 2)
        u h - v g at unit length; NaN where the point is not seen, or the cameras cannot disagree
        on it.
    constants : ndarray, shape (n,)
        h x g in the same unit: scene units, or for a perspective camera those at distance 1.
    """
    normals, constants = np.full((len(pixels), 2), np.nan), np.full(len(pixels), np.nan)
    seen = np.isfinite(pixels).all(axis=1)
    scale = np.array([known.calibration[0]])
    left, right = _lines(known.matrix[None], scale, known.turned(pixels[seen])[:, None])
    left, right = left[:, 0], right[:, 0]
    direction = np.cross(left[:, 0], left[:, 1])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    on_line = (np.linalg.pinv(left) @ right[..., None])[..., 0]
    linear, constant = np.split(unknown.matrix, [3], axis=1)
    g, h = on_line @ linear.T + constant[:, 0], direction @ linear.T
    across = g[:, 2:] * h[:, :2] - h[:, 2:] * g[:, :2]
    size = np.linalg.norm(across, axis=1)
    reach = np.abs(g[:, 2]) + np.abs(h[:, 2]) * np.linalg.norm(g[:, :2], axis=1)
    good = size > PARALLEL * reach
    told = np.flatnonzero(seen)[good]
    normals[told] = across[good] / size[good, None]
    constants[told] = (h[good, 0] * g[good, 1] - h[good, 1] * g[good, 0]) / size[good]
    return normals, constants


def epipolar_rows(
    lines: tuple[Floats, Floats], camera: Camera, pixels: Floats
) -> tuple[Floats, Floats]:
    """Linear equations for scale and angle of a camera from `epipolar_lines` and its own pixels.

    s T (X, Y) = [[X, Y], [Y, -X]] (s cos theta, s sin theta). Of pixels (..., n, 2) the design, in
    pixels, in the same shape, and the target, (..., n); NaN where there is no line or pixel.
    """
    normals, constants = lines
    (a, b), centred = normals.T, camera.centred(pixels.reshape(-1, 2)).reshape(pixels.shape)
    x, y = centred[..., 0], centred[..., 1]
    design = np.stack((a * y - b * x, -a * x - b * y), axis=-1)
    return design, np.broadcast_to(constants, x.shape)


def _lines(matrices: Floats, scales: Floats, turned: Floats) -> tuple[Floats, Floats]:
    """Equations left @ x = right of the lines of sight at T x_c, scene units.

    From (m, 3, 4), (m,) and (n, m, 2) to (n, m, 2, 3) and (n, m, 2).
    """
    seen = scales[:, None] * turned
    left = matrices[:, :2, :3] - seen[..., None] * matrices[:, None, 2, :3]
    return left, seen * matrices[:, 2, 3, None] - matrices[:, :2, 3]


def _reprojection(
    matrices: Floats, scales: Floats, turned: Floats, x: Floats
) -> tuple[Floats, Floats]:
    """Slope of the T x_c at which points are seen, (n, m, 2, 3), and how far it is off."""
    image = np.moveaxis(x @ matrices[:, :, :3].swapaxes(1, 2), 0, 1) + matrices[:, :, 3]
    plane, depth = image[..., :2] / image[..., 2:], image[..., 2, None, None]
    slope = matrices[:, :2, :3] - plane[..., None] * matrices[:, None, 2, :3]
    return slope / (scales[:, None, None] * depth), turned - plane / scales[:, None]


def _stacked(left: Floats, right: Floats, visible: Bools) -> tuple[Floats, Floats]:
    """Equations of all cameras, (n, 2 m, 3) and (n, 2 m), zero where the target is hidden."""
    rows = 2 * visible.shape[1]
    left = np.where(visible[..., None, None], left, 0).reshape(-1, rows, 3)
    return left, np.where(visible[..., None], right, 0).reshape(-1, rows)


def _gauss_newton(
    look: Callable[[Floats, Ints], tuple[Floats, Floats]], start: Floats
) -> tuple[Floats, Bools]:
    """Points of the least squared misses, each searched by itself, and which of them settled.

    `look(points, frames)` gives the slopes, (k, 2 m, 3), and the misses, (k, 2 m).
    """
    point, active = start.copy(), np.arange(len(start))
    part = np.ones(len(start))  # of the step, halved where the whole one leads uphill
    slope, missed = look(point, active)
    for _ in range(_STEPS):
        step = part[active, None] * _least_squares(slope[active], missed[active])
        with np.errstate(all="ignore"):  # lines that hardly cross may send a point far away
            new_slope, new_missed = look(point[active] + step, active)
            new_error, error = np.sum(new_missed**2, axis=1), np.sum(missed[active] ** 2, axis=1)
        moved = np.abs(slope[active] @ step[..., None]).max(axis=(1, 2), initial=0)
        lower = new_error <= (1 + 1e-12) * error + _SETTLED**2  # or equal, but for rounding
        part[active] = np.where(lower, 1, part[active] / 2)
        taken = active[lower]
        point[taken] += step[lower]
        slope[taken], missed[taken] = new_slope[lower], new_missed[lower]
        active = active[~(moved <= _SETTLED)]
        if not active.size:
            break
    return point, ~np.isin(np.arange(len(start)), active)


def _least_squares(left: Floats, right: Floats) -> Floats:
    """Solutions of many small systems; zero where one is singular: a point that ran far away."""
    q, r = np.linalg.qr(left)
    pivots = np.abs(np.diagonal(r, axis1=1, axis2=2))
    singular = ~(pivots.min(axis=1) > PARALLEL**2 * pivots.max(axis=1))
    r[singular] = np.eye(3)
    x = np.linalg.solve(r, q.swapaxes(1, 2) @ right[..., None])[..., 0]
    x[singular] = 0
    return x
