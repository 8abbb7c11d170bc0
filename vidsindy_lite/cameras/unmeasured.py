"""Rigs of which nothing is measured but the lenses: places and directions from the tracks alone.

Two pinholes that see the same points determine where they stand relative to each other, but for the
unit of length (the essential matrix, by the five-point method); of the points that they see, any
other camera's place follows. Each pair leads to one start, from which all cameras, and their focal
lengths as far as they are uncertain, are adjusted (`adjust`); the start that ends with the smallest
residuals is taken.

Nothing in the images tells the unit of length, nor how the rig stands in the room. So the first
camera gives the axes, x to the right and y up in its image and z towards it; the middle of the path
is the origin, and the distance from the first camera to the second is the unit. Handedness is told
by perspective, as points in front of all cameras have no mirror image that is.

Hartley and Zisserman 2004, "Multiple View Geometry"; Nister 2004, PAMI 26 (five points).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import cv2
import numpy as np

from ..arrays import Floats
from .adjust import Adjustment, adjust
from .alignment import Footage
from .camera import Camera
from .causes import GROSS
from .changes import PARTS, known_to
from .models import PerspectiveCamera
from .rig import Rig
from .triangulate import check_views, points_of_views

_FEWEST = 8  # frames in common of a pair
_MISS = 4.0  # pixels that a pair may miss: its focal lengths are rough
_UNKNOWN = 45.0  # degrees
_STEPS = 30


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
    views = check_views(tracks, rig)
    lenses = [camera for camera in rig.cameras if isinstance(camera, PerspectiveCamera)]
    rays = [_rays(lens, track) for lens, track in zip(lenses, views.tracks, strict=True)]
    errors, footage = _errors(rig), Footage.of(tracks)
    if not synchronous:
        errors[1:, PARTS["lag"]] = np.inf
    best: Adjustment | None = None
    for pair in combinations(range(len(rays)), 2):
        cameras = _spread(lenses, rays, pair)
        if cameras is None:
            continue
        fit = adjust(footage, cameras, errors, most=_STEPS)
        if np.isfinite(fit.misses).any() and (best is None or fit.noise < best.noise):
            best = fit
    if best is None or best.noise > GROSS:
        left = "no start" if best is None else f"views that are {best.noise:.1f} pixels apart"
        raise ValueError(
            "rig: the tracks must tell where the cameras stand, as nothing of it is measured, got "
            f"{left} (videos that do not start within a frame or two of each other, a focal length "
            "that is far off, or a target that moves on a line or in a plane?)"
        )
    found = [camera for camera in best.cameras if isinstance(camera, PerspectiveCamera)]
    return _framed(rig, found, points_of_views(views, best.cameras))


def _errors(rig: Rig) -> Floats:
    """What is known: of the first camera its place, of all others only their lenses."""
    errors = np.array([known_to(camera) for camera in rig.cameras])
    for part in ("normal", "angle", "position"):
        errors[0, PARTS[part]] = 0.0
        errors[1:, PARTS[part]] = np.inf
    errors[1, PARTS["position"]] = 1.0  # or nothing would hold the unit of length
    return errors


def _rays(camera: Camera, track: Floats) -> Floats:
    """Directions (X, Y) / Z in OpenCV's axes, right and down, (n, 2)."""
    scale, _ = camera.calibration
    return scale * camera.centred(track) * [1, -1]


def _spread(
    cameras: Sequence[PerspectiveCamera], rays: Sequence[Floats], pair: tuple[int, int]
) -> tuple[PerspectiveCamera, ...] | None:
    """Cameras around what two of them see, the first one at home; None if they tell nothing."""
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
    poses = {i: (np.eye(3), np.zeros(3)), j: (turn, shift[:, 0])}
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
        done, axis, place, _ = cv2.solvePnPRansac(
            points[told], rays[k][told], np.eye(3), None, reprojectionError=limit,
            flags=cv2.SOLVEPNP_SQPNP,
        )  # fmt: skip
        if not done:
            return None
        poses[k] = cv2.Rodrigues(axis)[0], place[:, 0]
    home, place = poses[0]
    turns = [turn @ home.T for turn, _ in (poses[k] for k in range(len(cameras)))]
    shifts = [poses[k][1] - turns[k] @ place for k in range(len(cameras))]
    unit = np.linalg.norm(shifts[1])
    return tuple(
        camera.posed(turn * [1, -1, -1], shift / unit)
        for camera, turn, shift in zip(cameras, turns, shifts, strict=True)
    )


def _framed(rig: Rig, cameras: Sequence[PerspectiveCamera], x: Floats) -> Rig:
    """The cameras around the middle of the path, the second one so far from the first as is known.

    They are as good as measured by eye: what the tracks tell is learned later.
    """
    middle = np.nanmean(x, axis=0)
    between = np.asarray(cameras[1].position) - np.asarray(cameras[0].position)
    apart = float(np.linalg.norm(between))
    unit = (1.0 if rig.distance is None else rig.distance) / apart
    first, *others = (
        replace(camera, position=unit * (np.asarray(camera.position) - middle))
        for camera in cameras
    )
    loose = [
        replace(camera, position_error=unit * apart, normal_error=_UNKNOWN)
        for camera in others
    ]
    return Rig((first, *loose), note=_note(rig))


def _note(rig: Rig) -> str:
    """What cannot be known of a rig that nobody has measured."""
    length = (
        "the unit of length is the distance from the first camera to the second"
        if rig.distance is None
        else f"the first camera is {rig.distance:g} from the second"
    )
    return (
        "nothing is measured of where the cameras stand: x is to the right and y up in the image "
        f"of the first camera, z points towards it, the origin is the middle of the path, {length}"
    )
