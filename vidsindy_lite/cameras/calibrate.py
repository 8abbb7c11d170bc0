"""Calibration: cameras learned from tracks of one moving target, and what they do to the path.

The cameras of linear equations (`eq4`), or those that stand where nothing was measured
(`unmeasured`), are the start of a search for the smallest reprojection error in pixels (`adjust`).

What is learned is not exact. A wrong angle of 1e-4 turns the whole path by about as much: an error
far below the noise of a frame, but shared by all frames, so that it does not average out. A law
fitted to such a path has small terms that the true one has not. `discover` takes such systematic
errors into account if it is told them, (k, n, 3). The covariance of what was learned does not rest
on independent errors of the tracks, which compression makes similar from frame to frame. A
direction that the tracks tell nothing of, such as a turn of the whole rig, is as uncertain as the
measurements leave it. And the tracks themselves may share an error: see `trailing_errors`.

Paper: Section "Coordinates Transformation", Eq. (4), (5).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Floats
from .adjust import PARTS, adjust, known_to
from .clocks import Curve, Footage, Lags, check_clocks
from .eq4 import Unknowns, check_learnable, closed_form
from .rig import Rig, check_calibrated, check_seen, check_views
from .triangulate import at_once, intersect, missed
from .unmeasured import posed

_TOO_FAR = 5.0  # standard errors that a measurement may be off
_TRAIL = 0.5  # of the tracks' noise; mp4v made up to .6 of it, Motion JPEG .1


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

    Frames that are missed by far pull with less weight the further they are off: a few outliers of
    the tracker do not bend the cameras.

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
    views, seen = check_views(tracks, rig), check_seen(tracks, rig)
    errors = np.array([known_to(camera) for camera in rig.cameras])
    if not errors.any():
        return Rig(rig.cameras, note=rig.note)
    start, decided = closed_form(views, Unknowns.of(rig))
    if not np.isfinite(intersect(start, views)[0]).any():
        raise ValueError(
            "rig: the lines of sight must meet in front of the perspective cameras, got none that "
            "do (does each normal point from the scene to its camera?)"
        )
    found = adjust(Footage.of(seen), start, errors)
    doubts = () if rig is given else rig.warnings
    if not found.settled:
        doubts += (
            f"the search for the cameras did not converge in {found.steps} evaluations: their "
            "scales and angles may be off; check the positions and normals, or give more of what "
            "is known",
        )
    measured = (errors > 0) & np.isfinite(errors)
    off = np.where(measured, np.abs(found.change) / np.where(measured, errors, 1.0), 0.0)
    if off.max() > _TOO_FAR:
        i, part = np.unravel_index(off.argmax(), off.shape)
        what = next(name for name, place in PARTS.items() if place.start <= part < place.stop)
        doubts += (
            f"the {what} of cameras[{i}] is {off.max():.0f} times its error from what was "
            "measured: check it, and how the others were measured",
        )
    if not decided:
        doubts += (
            "which frames hold outliers of a track cannot be told: leaving some out makes others "
            "look wrong; check the tracks, the positions and the normals",
        )
    left = int((~intersect(found.cameras, views)[1]).sum())
    if left:
        doubts += (
            f"the target's place is uncertain in {left} of {len(views[0])} frames, where the lines "
            "of sight hardly cross: the cameras look along nearly the same line there, or one of "
            "them is wrong",
        )
    return Rig(found.cameras, doubts, rig.note)


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


def systematic_errors(tracks: Sequence[Floats], rig: Rig, learned: Rig, lags: Lags) -> Floats:
    """Errors of the reconstructed path that come from what was learned of cameras and lags.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n_i, 2)
        As the videos show them, each from its own first frame.
    rig, learned : Rig
        Before and after `learn_cameras`.
    lags : Lags
        Lags and rates with a standard error of zero or infinity are taken as they are.

    Returns
    -------
    ndarray, shape (k, n, 3)
        Scene units; what k independent causes, each off by one standard error, add to the path.
        Zero where nothing can be reconstructed.
    """
    errors = np.array([known_to(camera) for camera in rig.cameras])
    moving = (lags.errors > 0) & np.isfinite(lags.errors)
    errors[moving, PARTS["lag"]] = errors[lags.rate_errors > 0, PARTS["drift"]] = np.inf
    clocks = check_clocks(lags.clocks or None, tracks)
    curves = tuple(map(Curve, tracks, clocks))
    footage = Footage(curves, clocks[0], lags.frames, lags.rates)
    near = adjust(footage, learned.cameras, errors, most=0)
    modes = np.einsum("ik,nji->knj", near.factor, near.reduced.follow)
    if not rig.note:
        return modes
    still = at_once(learned.cameras, footage.aligned)
    return _of_shape(modes, intersect(learned.cameras, still)[0])


def _of_shape(modes: Floats, x: Floats) -> Floats:
    """Modes, (k, n, 3), without moves and stretches of the whole path x, (n, 3).

    Of a rig that nobody measured the path is the frame: its middle is the origin, and how far two
    cameras are apart the unit of length.
    """
    seen = np.asarray(np.isfinite(x).all(axis=1))
    centred = np.where(seen[:, None], x - x[seen].mean(axis=0), 0.0)
    moves = [seen[:, None] * axis for axis in np.eye(3)]
    frame, _ = np.linalg.qr(np.reshape([*moves, centred], (4, -1)).T)
    flat = modes.reshape(len(modes), -1)
    return (flat - flat @ frame @ frame.T).reshape(modes.shape)


def trailing_errors(
    tracks: Sequence[Floats], rig: Rig, motion: Sequence[Floats] | None = None
) -> Floats:
    """Errors of the reconstructed path if tracks stay a constant distance behind the motion.

    A codec that codes changes leaves out the smallest ones, so that a trace of the target stays
    where it just was, and the track behind. The residuals show little of it, because all views do
    it alike; so it is allowed for in proportion to the noise that they do show.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2)
        One per camera, at the same instants.
    rig : Rig
        All cameras calibrated.
    motion : sequence of ndarray, shape (n, 2), optional
        The tracks without their noise; by default the tracks themselves.

    Returns
    -------
    ndarray, shape (m, n, 3)
        Scene units; what the trail of each camera, one standard deviation long, adds to the path.
        Zero where nothing can be reconstructed.
    """
    check_calibrated("rig", rig)
    views = check_views(tracks, rig)
    x, _ = intersect(rig.cameras, views)
    left = np.hstack(missed(rig.cameras, views))
    count = left.shape[1]
    left = np.abs(left[np.isfinite(left)])
    noise = 1.4826 * np.median(left) * np.sqrt(count / (count - 3)) if left.size else 0.0
    modes = []
    for i, track in enumerate(views):
        step = np.gradient(track if motion is None else motion[i], axis=0)
        # Noise has no direction: the trail ends where the target moves by less than that.
        length = np.sqrt((step**2).sum(axis=1, keepdims=True) + noise**2)
        trail = _TRAIL * noise * np.nan_to_num(step / np.maximum(length, 1e-300))
        moved = [*views[:i], track - trail, *views[i + 1 :]]
        modes.append(intersect(rig.cameras, moved)[0] - x)
    return np.nan_to_num(np.array(modes))
