"""Rigs of which nothing is measured but perhaps the lenses: all else from the tracks.

Two pinholes that see the same points determine where they stand relative to each other, but for the
unit of length (the essential matrix, by the five-point method); of the points that they see, any
other camera's place follows. From far away, three images or more of a path are a linear map of it,
which is factorised; that start and its mirror image in depth are tried as well. A focal length of
which nothing is known is tried from long lenses to wide ones. From the starts with the smallest
residuals all cameras, and their focal lengths as far as they are uncertain, are adjusted
(`adjust`), and the best is taken.

Nothing in the images tells the unit of length, nor how the rig stands in the room. So the first
camera gives the axes, x to the right and y up in its image and z towards it; the middle of the path
is the origin, and the distance from the first camera to the second is the unit. Handedness is told
by perspective; where that is too weak, a warning says so.

Hartley and Zisserman 2004, "Multiple View Geometry"; Nister 2004, PAMI 26 (five points); Tomasi and
Kanade 1992, IJCV 9 (factorisation).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import cv2
import numpy as np

from ..arrays import Floats
from .adjust import Adjustment, adjust
from .alignment import Footage
from .camera import Camera
from .causes import GROSS
from .changes import PARTS, known_to
from .messages import either_hand
from .models import PerspectiveCamera
from .rig import Rig
from .triangulate import check_views, points_of_views, residuals_of_views, views_of

_FEWEST = 8  # frames in common of a pair
_MISS = 4.0  # pixels that a pair may miss: its focal lengths are rough
_UNKNOWN = 45.0  # degrees
_VIEWS = 2 * 1.15 ** np.arange(28)  # degrees across an image: what lenses have
_ANY = 0.5  # error of the logarithm of an unknown focal length
_INSTANTS = 200  # at which starts are compared
_TRIED = 4  # of all starts
_STEPS = 30
_WIDE = 0.01  # OpenCV refuses points that are close together, in whatever unit
_FLAT = 1e-3  # of the largest axis: what rounding leaves of a motion in a plane
_TOLD = 25.0  # chi-squared by which the mirror image must be worse

_Pose = tuple[Floats, Floats]  # OpenCV's rotation and shift


def posed(tracks: Sequence[Floats], rig: Rig, synchronous: bool = True) -> Rig:
    """The rig with places and directions found from tracks, if it has none.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2)
        At the same instants, ...
    rig : Rig
        See `Rig.is_measured`.
    synchronous : bool
        ... or but for small lags, which are then learned as well, and forgotten.

    Raises
    ------
    ValueError
        If the tracks do not tell where the cameras stand.
    """
    if rig.is_measured:
        return rig
    check_views(tracks, rig)
    starts = sorted(_starts(tracks, rig), key=lambda start: start.missed)
    footage, fits = Footage.of(tracks), []
    for start in starts[:_TRIED]:
        errors = _errors(start.cameras)
        if not synchronous:
            errors[1:, PARTS["lag"]] = np.inf
        fit = adjust(footage, start.cameras, errors, most=_STEPS)
        if np.isfinite(fit.misses).any():
            fits.append(fit)
    best = min(fits, key=lambda fit: fit.noise, default=None)
    if best is None or best.noise > GROSS:
        left = "no start" if best is None else f"views that are {best.noise:.1f} pixels apart"
        raise ValueError(
            "rig: the tracks must tell where the cameras stand, as nothing of it is measured, got "
            f"{left} (videos that do not start within a frame or two of each other, a focal length "
            "that is far off, or a target that moves on a line or in a plane?)"
        )
    return _framed(rig, best, any(_mirrored(best, fit) for fit in fits))


@dataclass(frozen=True)
class _Start:
    """Cameras around the path, the first one at home, and by how many pixels they miss tracks."""

    cameras: tuple[PerspectiveCamera, ...]
    missed: float


def _starts(tracks: Sequence[Floats], rig: Rig) -> Iterator[_Start]:
    """Cameras by any pair, and as if far away, with each choice of unknown lenses."""
    step = -(-len(tracks[0]) // _INSTANTS)
    some = [np.asarray(track)[::step] for track in tracks]
    given = [camera for camera in rig.cameras if isinstance(camera, PerspectiveCamera)]
    for view in _VIEWS if any(camera.scale is None for camera in given) else _VIEWS[:1]:
        lenses = [_lens(camera, view) for camera in given]
        views = views_of(some, lenses)
        rays = [_rays(lens, track) for lens, track in zip(lenses, views.tracks, strict=True)]
        pairs = (_around(rays, lenses, pair) for pair in combinations(range(len(rays)), 2))
        for poses in (*pairs, *_far_away(rays, lenses)):
            if poses is None:
                continue
            cameras = _homed(lenses, poses)
            misses = np.hstack(residuals_of_views(views, cameras))
            seen = np.isfinite(misses)
            if seen.any():  # points that none can see are missed, too
                yield _Start(cameras, float(np.median(np.abs(misses[seen])) / seen.mean()))


def _lens(camera: PerspectiveCamera, view: float) -> PerspectiveCamera:
    """A camera of such a field of view, if that is unknown."""
    if camera.scale is not None:
        return camera
    scale = 2 * np.tan(np.deg2rad(view) / 2) / camera.image_size[0]
    return camera.moved(scale=float(scale), angle=0.0, scale_error=_ANY)


def _errors(cameras: Sequence[Camera]) -> Floats:
    """What is known: of the first camera its place, of all others only their lenses."""
    errors = np.array([known_to(camera) for camera in cameras])
    for part in ("normal", "angle", "position"):
        errors[0, PARTS[part]] = 0.0
        errors[1:, PARTS[part]] = np.inf
    errors[1, PARTS["position"]] = 1.0  # or nothing would hold the unit of length
    return errors


def _rays(camera: Camera, track: Floats) -> Floats:
    """Directions (X, Y) / Z in OpenCV's axes, right and down, (n, 2)."""
    scale, _ = camera.calibration
    return scale * camera.centred(track) * [1, -1]


def _around(
    rays: Sequence[Floats], cameras: Sequence[PerspectiveCamera], pair: tuple[int, int]
) -> list[_Pose] | None:
    """Poses of cameras around what two of them see; None if they tell nothing."""
    i, j = pair
    both = np.isfinite(rays[i]).all(axis=1) & np.isfinite(rays[j]).all(axis=1)
    if both.sum() < _FEWEST:
        return None
    limit = _MISS * max(cameras[k].calibration[0] for k in pair)
    essential, mask = cv2.findEssentialMat(
        rays[i][both], rays[j][both], np.eye(3), method=cv2.USAC_ACCURATE, prob=0.9999,
        threshold=limit,
    )  # fmt: skip
    if essential is None or essential.shape != (3, 3):
        return None
    count, turn, shift, front = cv2.recoverPose(
        essential, rays[i][both], rays[j][both], np.eye(3), mask=mask
    )
    poses: dict[int, _Pose] = {i: (np.eye(3), np.zeros(3)), j: (_array(turn), _array(shift)[:, 0])}
    points = np.full((len(rays[0]), 3), np.nan)
    seen = np.flatnonzero(both)[front[:, 0] > 0]
    if len(seen) < _FEWEST:
        return None
    first, second = (np.column_stack(poses[k]) for k in pair)
    homogeneous = cv2.triangulatePoints(first, second, rays[i][seen].T, rays[j][seen].T)
    points[seen] = (homogeneous[:3] / homogeneous[3]).T
    for k in set(range(len(cameras))) - set(pair):
        told = np.isfinite(points).all(axis=1) & np.isfinite(rays[k]).all(axis=1)
        if told.sum() < _FEWEST:
            return None
        limit = 3 * _MISS * cameras[k].calibration[0]
        pose = _seen_from(points[told], rays[k][told], limit)
        if pose is None:
            return None
        poses[k] = pose
    return [poses[k] for k in sorted(poses)]


def _array(result: object) -> Floats:
    """A matrix of OpenCV's as ours."""
    return np.asarray(result, float)


def _seen_from(points: Floats, rays: Floats, limit: float) -> _Pose | None:
    """Pose of a camera that sees points in such directions."""
    wide = _WIDE * float(np.ptp(points, axis=0).max())
    try:
        done, axis, place, _ = cv2.solvePnPRansac(
            points / wide, rays, np.eye(3), None, reprojectionError=limit,
            flags=cv2.SOLVEPNP_SQPNP,
        )  # fmt: skip
    except cv2.error:  # points of one draw lie too close together
        return None
    return (_array(cv2.Rodrigues(axis)[0]), wide * _array(place)[:, 0]) if done else None


def _far_away(
    rays: Sequence[Floats], cameras: Sequence[PerspectiveCamera]
) -> Iterator[list[_Pose]]:
    """Poses as if no camera were near: two, the mirror images of each other in depth.

    Centred images are then a matrix M (2 m, 3) times the path, and M A holds the rows of scaled
    rotations. With Q = A A', m1' Q m2 = 0 and m1' Q m1 = m2' Q m2 in each camera, linear in Q.
    """
    images = [c.focal_length * seen for c, seen in zip(cameras, rays, strict=True)]
    every = np.hstack(images)
    every = every[np.isfinite(every).all(axis=1)]
    if len(every) < _FEWEST:
        return
    middle = every.mean(axis=0)
    left, singular, _ = np.linalg.svd((every - middle).T, full_matrices=False)
    motion = (left[:, :3] * singular[:3]).reshape(-1, 2, 3)
    up = np.triu_indices(3)
    twice = 2 - np.eye(3)[up]  # what is off the diagonal stands there twice
    equations = []
    for one, other in motion / np.linalg.norm(motion, axis=(1, 2), keepdims=True):
        crossed = np.outer(one, other) + np.outer(other, one)
        unlike = np.outer(one, one) - np.outer(other, other)
        equations += [crossed[up] * twice, unlike[up] * twice]
    q = np.zeros((3, 3))
    q[up] = np.linalg.svd(np.array(equations))[2][-1]
    values, axes = np.linalg.eigh(q + np.triu(q, 1).T)
    values = values * np.sign(values.sum())
    root = axes * np.sqrt(np.maximum(values, _FLAT * values.max()))
    for mirror in ([1, 1, 1], [1, 1, -1]):
        poses = []
        for rows, camera, centre in zip(
            motion @ root * mirror, cameras, middle.reshape(-1, 2), strict=True
        ):
            turned, lengths, back = np.linalg.svd(rows, full_matrices=False)
            right, down = turned @ back
            shift = np.append(centre, camera.focal_length) / lengths.mean()
            poses.append((np.array([right, down, np.cross(right, down)]), shift))
        yield poses


def _homed(
    cameras: Sequence[PerspectiveCamera], poses: Sequence[_Pose]
) -> tuple[PerspectiveCamera, ...]:
    """The cameras at poses of which the first is at home, and the second a unit from it."""
    home, place = poses[0]
    turns = [turn @ home.T for turn, _ in poses]
    shifts = [shift - turn @ place for turn, (_, shift) in zip(turns, poses, strict=True)]
    unit = np.linalg.norm(shifts[1])
    return tuple(
        camera.posed(turn * [1, -1, -1], shift / unit)
        for camera, turn, shift in zip(cameras, turns, shifts, strict=True)
    )


def _mirrored(best: Adjustment, other: Adjustment) -> bool:
    """Whether other cameras explain the tracks as well, by the mirror image of the path."""
    worse = _squares(other) - _squares(best)
    if worse > _TOLD * best.noise**2:
        return False
    x, y = _path(best), _path(other)
    both = np.isfinite(x + y).all(axis=1)
    x, y = x[both], y[both]
    return bool(np.linalg.det((x - x.mean(axis=0)).T @ (y - y.mean(axis=0))) < 0)


def _squares(fit: Adjustment) -> float:
    """What a fit leaves, pixels squared."""
    return float(np.nansum(fit.weights[:, None] * fit.misses**2))


def _path(fit: Adjustment) -> Floats:
    """What the cameras of a fit see."""
    return points_of_views(views_of(fit.footage.aligned, fit.cameras), fit.cameras)


def _framed(rig: Rig, fit: Adjustment, mirrored: bool) -> Rig:
    """The cameras around the middle of the path, the second one so far from the first as is known.

    They are as good as measured by eye: what the tracks tell is learned later.
    """
    cameras, x = fit.cameras, _path(fit)
    middle = np.nanmean(x, axis=0)
    between = np.asarray(cameras[1].position) - np.asarray(cameras[0].position)
    apart = float(np.linalg.norm(between))
    unit = (1.0 if rig.distance is None else rig.distance) / apart
    first, *others = (
        replace(camera, position=unit * (np.asarray(camera.position) - middle))
        for camera in cameras
    )
    loose = [
        replace(camera, position_error=unit * apart, normal_error=_UNKNOWN) for camera in others
    ]
    doubts = (either_hand(),) if mirrored else ()
    return Rig((first, *loose), doubts, _note(rig))


def _note(rig: Rig) -> str:
    """What cannot be known of a rig that nobody has measured."""
    length = (
        "the unit of length is the distance from the first camera to the second"
        if rig.distance is None
        else f"the first camera is {rig.distance:g} from the second"
    )
    lenses = (
        "; focal lengths are those that the tracks tell"
        if any(camera.scale is None for camera in rig.cameras)
        else ""
    )
    return (
        "nothing is measured of where the cameras stand: x is to the right and y up in the image "
        "of the first camera, z points towards it, the origin is the middle of the path, "
        f"{length}{lenses}"
    )
