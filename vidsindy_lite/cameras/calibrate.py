"""Calibration: scales, angles and positions of cameras, learned from tracks of one moving target.

Orthographic views agree on one point if linear equations hold for what is unknown (`unknowns`), so
no starting guess is needed; perspective ones are found from the known cameras, one epipolar
constraint at a time. From there a search goes to the smallest reprojection error in pixels.

Paper: Section "Coordinates Transformation", Eq. (4), (5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Bools, Floats
from ..checks import check_instance
from .adjust import adjust
from .alignment import Footage
from .camera import Camera
from .changes import PARTS, known_to
from .messages import far_from_measured, unconverged_cameras, undecided_outliers, unsettled_points
from .models import all_orthographic, independent
from .rig import Rig
from .triangulate import (
    Views,
    check_calibrated,
    check_seen,
    check_views,
    epipolar_equations,
    intersect,
    points_of_views,
)
from .unknowns import Unknowns, agreement, calibrated, names, solve
from .unmeasured import posed

_TOO_FAR = 5.0  # standard errors that a measurement may be off


def learn_cameras(tracks: Sequence[Floats], rig: Rig) -> Rig:
    """Learn what is not known of the cameras from tracks of one moving target.

    In (s cos theta, s sin theta) of the unknown cameras and Delta_c of those without a position,
    the condition that all views agree on one point is linear, so no starting guess is needed. Used
    are every equation that does not hold the unknown point, among them the epipolar constraint
    between uncalibrated cameras that Eq. (4) leaves out, and every frame with two or more views.
    This closed form is then refined to the smallest reprojection error in pixels, which removes the
    bias that pixel noise causes in a scale. With a perspective camera in the rig, the closed form
    goes from the known cameras to the others, and the refinement is the same.

    What was measured with an error (`normal_error` and so on, see `Camera`) may change, too, by as
    much as that: the refinement is a bundle adjustment of cameras and path with the measurements as
    priors, in which half a degree of a normal is found to a hundredth. What neither tracks nor
    measurements tell, such as a turn of the whole rig, stays uncertain; `observe` counts that among
    the systematic errors of the path. Without errors, what is given stays as it is.

    Frames that are missed by far pull with less weight the further they are off, and those in which
    orthographic views of an exact rig contradict each other by more than eight robust standard
    deviations are left out: a few outliers of the tracker do not bend the cameras.

    Two cameras are enough, but raise no alarm at a normal that is turned about the cross product of
    both: the path is then wrong without a residual. Three do.

    Parameters
    ----------
    tracks : sequence of array_like, shape (n, 2)
        One track per camera of the rig, frame by frame the same instants; NaN = not seen.
    rig : Rig
        At least one calibrated camera. If a position is missing, two
        others must be given, with independent normals, and all cameras be orthographic: in depth
        from a single camera nothing would fix the origin. Or three or more perspective cameras,
        all with a scale (the focal length) and none with a position: where they stand is found,
        too, in a frame of their own, which ``note`` of the result describes.

    Returns
    -------
    Rig
        The same cameras, all calibrated and placed; its warnings say if a search did not converge.

    Raises
    ------
    ValueError
        If the tracks do not match the rig, no camera is calibrated, too few are placed, or the
        target's motion does not determine a camera.

    Notes
    -----
    Paper: Eq. (4); by itself it is `learn_cameras_eq4`.
    """
    check_learnable(rig)
    given, rig = rig, posed(tracks, rig)
    doubted = () if rig is given else rig.warnings
    unknowns = Unknowns.of(rig)
    views, footage = check_views(tracks, rig), Footage.of(check_seen(tracks, rig))
    errors = np.array([known_to(camera) for camera in rig.cameras])
    if not errors.any():
        return Rig(rig.cameras, note=rig.note)
    if not unknowns.any:
        learned = _closest(footage, rig.cameras, errors)
        return replace(learned, warnings=(*doubted, *learned.warnings), note=rig.note)
    if all_orthographic(rig.cameras):
        equations, decided = agreement(views, unknowns)
        start = unknowns.filled(*solve(equations.design, equations.target, unknowns))
        agreeing = np.isin(np.arange(views.frames), equations.frames)
        used = None if unknowns.measured else agreeing
        learned = _closest(footage, start, errors, used)
        doubts = () if decided else (undecided_outliers(),)
    else:
        learned = _closest(footage, _spread(views, unknowns), errors)
        _, settled = intersect(learned.cameras, views.tracks)
        left = int((~settled).sum())
        doubts = (unsettled_points(left, views.frames),) if left else ()
    return replace(learned, warnings=learned.warnings + doubts, note=rig.note)


def check_learnable(rig: Rig) -> None:
    """That enough is known of the cameras of a rig to learn the rest.

    Raises
    ------
    ValueError
        If it is not.
    """
    check_instance("rig", rig, Rig)
    if len(rig.cameras) < 2:
        raise ValueError("rig: must hold two or more cameras, got 1, which sees no depth")
    if not rig.is_measured:
        return
    if not any(camera.is_calibrated for camera in rig.cameras):
        raise ValueError(
            "rig: at least one camera must be calibrated (scale and angle given) to learn the "
            f"others, got none of {len(rig.cameras)}"
        )
    loose = Unknowns.of(rig).unplaced
    if loose.size and not rig.is_orthographic:
        raise ValueError(
            "rig: all positions must be given if a camera is perspective, got none of "
            f"{names(loose)}"
        )
    placed = [camera for camera in rig.cameras if camera.is_placed]
    if loose.size and not independent(placed):
        raise ValueError(
            "rig: the positions of two cameras with independent normals must be given to learn "
            f"those of {names(loose)}, got {len(placed)}"
        )


def calibration_errors(rig: Rig, truth: Rig) -> Floats:
    """How far learned cameras are from the true ones.

    Parameters
    ----------
    rig, truth : Rig
        Both with all cameras calibrated, in the same order.

    Returns
    -------
    ndarray, shape (m, 2)
        For each camera the relative error of its scale and the error of its angle in radians,
        between -pi and pi.

    Raises
    ------
    ValueError
        If the rigs differ in length or a camera is not calibrated.
    """
    check_calibrated("rig", rig)
    check_calibrated("truth", truth)
    if len(rig.cameras) != len(truth.cameras):
        raise ValueError(
            f"rig: must have as many cameras as truth, got {len(rig.cameras)} "
            f"and {len(truth.cameras)}"
        )
    pairs = zip(rig.cameras, truth.cameras, strict=True)
    known = ((a.calibration, b.calibration) for a, b in pairs)
    return np.array([(s / r - 1, np.angle(np.exp(1j * (a - b)))) for (s, a), (r, b) in known])


def _closest(
    footage: Footage, start: Sequence[Camera], errors: Floats, used: Bools | None = None
) -> Rig:
    """The cameras of the smallest errors near a start."""
    found = adjust(footage, start, errors, used=used)
    doubts: tuple[str, ...] = () if found.settled else (unconverged_cameras(found.steps),)
    measured = (errors > 0) & np.isfinite(errors)
    off = np.where(measured, np.abs(found.change) / np.where(measured, errors, 1.0), 0.0)
    if off.max() > _TOO_FAR:
        i, part = np.unravel_index(off.argmax(), off.shape)
        what = next(name for name, place in PARTS.items() if place.start <= part < place.stop)
        doubts += (far_from_measured(int(i), what, float(off.max())),)
    return Rig(found.cameras, doubts)


def _spread(views: Views, unknowns: Unknowns) -> tuple[Camera, ...]:
    """Cameras of any model, the unknown ones learned from the known ones, round by round.

    Between two perspective cameras that are both unknown, the epipolar constraint is not linear; so
    a camera waits until one that shares frames with it is known.
    """
    cameras = unknowns.cameras
    while waiting := [i for i in unknowns.uncalibrated if not cameras[i].is_calibrated]:
        found, failed = {}, []
        for i in waiting:
            try:
                found[i] = _from_known(views, replace(unknowns, cameras=cameras), i)
            except ValueError as error:
                failed.append(error)
        if not found:
            raise failed[0]
        cameras = calibrated(cameras, found, found.values())
    if not np.isfinite(points_of_views(views, cameras)).any():
        raise ValueError(
            "rig: the lines of sight must meet in front of the perspective cameras, got none that "
            "do (does each normal point from the scene to its camera?)"
        )
    return cameras


def _from_known(views: Views, unknowns: Unknowns, index: int) -> complex:
    """s exp(i theta) of one unknown camera from all known ones."""
    design, target = epipolar_equations(unknowns.cameras, views.tracks, index)
    return solve(design, target, replace(unknowns, uncalibrated=np.array([index])))[0][0]
