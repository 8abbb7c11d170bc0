"""Calibration: cameras learned from tracks of one moving target, and what they do to the path.

The views of two cameras agree on a point if one linear equation holds, the epipolar one, of what is
not known of one of them: (s cos theta, s sin theta), and Delta_c if it is orthographic. So cameras
are found from those that are known, one after the other and without a starting guess; where nothing
was measured, they stand where `unmeasured` finds them. From there a search goes to the smallest
reprojection error in pixels (`adjust`).

In Eq. (4) by itself, to compare `learn_cameras` with, the views of the uncalibrated cameras predict
those of the calibrated ones, R^-_known pinv(R^-_unknown) y_unknown = y_known, in the frames in
which all cameras see the target: a linear equation as well.

What is learned is not exact. A wrong angle of 1e-4 turns the whole path by about as much: an error
far below the noise of a frame, but shared by all frames, so that it does not average out. A law
fitted to such a path has small terms that the true one has not. `discover` takes such systematic
errors into account if it is told them, (k, n, 3). The covariance of what was learned does not rest
on independent errors of the tracks, which compression makes similar from frame to frame. A
direction that the tracks tell nothing of, such as a turn of the whole rig, is as uncertain as the
measurements leave it. And the tracks themselves may share an error: see `tracking_errors`.

Paper: Section "Coordinates Transformation", Eq. (4), (5).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from ..arrays import Floats, Ints
from ..checks import check_instance, check_items
from . import models
from .adjust import DRIFT, LAG, PARTS, adjust, known_to
from .clocks import Footage, Lags
from .models import Camera, missed
from .rig import Rig, check_calibrated, check_seen, check_views
from .unmeasured import posed


class Equations(NamedTuple):
    """Linear equations design @ p = target, (k, p) and (k,), and the frame of each, (k,).

    p holds (s cos theta, s sin theta) of the cameras that are not calibrated, then Delta_c of one
    that is not placed, divided by the half width of its image: so all of the design is in pixels.
    """

    design: Floats
    target: Floats
    frames: Ints


def _epipolar(tracks: Sequence[Floats], cameras: Sequence[Camera], i: int) -> Equations:
    """The equations for what is unknown of a camera, with all that are calibrated.

    Where one of these stands is not known either, its equations are off by a constant.
    """
    camera = cameras[i]
    others = [j for j, known in enumerate(cameras) if known.is_calibrated and j != i]
    loose = [j for j in others if not cameras[j].is_placed]
    free = [not camera.is_calibrated] * 2 + [not camera.is_placed] * 2 + [True] * len(loose)
    parts = [(np.zeros((0, len(free))), np.zeros(0), np.zeros(0, int))]
    for j in others:
        lines = models.epipolar_lines(cameras[j], tracks[j], camera)
        design, target = models.epipolar_rows(lines, camera, tracks[i])
        constants = np.tile(np.equal(loose, j), (len(design), 1))
        moves = np.hstack((lines[0][:, ::-1] * [-1, 1], constants))
        design = np.hstack((design, camera.image_size[0] / 2 * moves))
        told = np.flatnonzero(np.isfinite(design).all(axis=1) & np.isfinite(target))
        parts.append((design[told], target[told], told))
    design, target, frames = map(np.concatenate, zip(*parts, strict=True))
    return Equations(design[:, free], target, frames)


def _without_outliers(every: Equations, scale: float) -> Equations:
    """The frames of which the fit of the least absolute misses, in pixels, misses none by far."""
    missed = np.ones(len(every.target))
    for _ in range(20):
        root = np.sqrt(np.maximum(missed, models.ROUNDING))
        solution = np.linalg.lstsq(every.design / root[:, None], every.target / root)[0]
        missed = np.abs(every.design @ solution - every.target) / scale
    # Eight robust standard deviations.
    limit = max(8.0 * 1.4826 * np.median(missed), models.ROUNDING) if len(missed) else 0.0
    good = ~np.isin(every.frames, every.frames[missed > limit])
    return Equations(every.design[good], every.target[good], every.frames[good])


def _solved(
    equations: Equations, cameras: Sequence[Camera], asked: Sequence[int], checked: bool = True
) -> Floats:
    """What is unknown of the first of some cameras or of all, or an error that names them.

    The design is in pixels: a singular value over sqrt(n) is the motion, in pixels rms, that tells
    one combination of the parameters. Noise on a target that does not move makes 0.6-1.4 times the
    misfit of it, and somewhat more in few frames. That is not asked for unless `checked`: it would
    not hold at a wrong lag, nor with a wrong normal.
    """
    design, target, _ = equations
    turned = all(cameras[i].is_calibrated for i in asked)
    placed = all(cameras[i].is_placed for i in asked)
    wanted = "position" if turned else "scale and angle" if placed else "scale, angle and position"
    if len(design) < design.shape[1]:
        raise ValueError(
            f"tracks: frames with common views must give at least {design.shape[1]} equations "
            f"for {wanted} of {_names(asked)}, got {len(design)}"
        )
    solution = np.linalg.lstsq(design, target)[0].astype(float)
    scale = cameras[asked[0]].scale or np.linalg.norm(solution[:2])
    misfit = np.sqrt(np.mean((design @ solution - target) ** 2)) / scale if scale > 0 else np.inf
    motion = np.linalg.svd(design, compute_uv=False) / np.sqrt(len(design))
    # What is missed by measurements is no noise; a later search takes these for what they are.
    measured = any(any(camera.errors.values()) for camera in cameras)
    # So many times the misfit in countless frames, and more in few.
    asked_for = min(2.5, 1.45 + 8.0 / np.sqrt(len(design))) * misfit
    if checked and motion[-1] <= max(1e-9 * motion[0], 0.0 if measured else asked_for):
        raise ValueError(
            f"tracks: the target's motion must determine {wanted} of "
            f"{_names(asked)}, got {motion[-1]:.2g} px rms of telling motion against a misfit of "
            f"{misfit:.2g} px (a static target, a wrong position or normal, videos in another "
            "order than the cameras, or of other motions)"
        )
    return solution


def closed_form(
    tracks: Sequence[Floats], cameras: Sequence[Camera], checked: bool = True
) -> tuple[Camera, ...]:
    """Cameras of linear equations.

    Between two cameras that are both unknown, the epipolar constraint is not linear; so a camera
    waits until one that shares frames with it is known.

    Raises
    ------
    ValueError
        If the tracks leave a camera open; see `_solved` for `checked`.
    """
    cameras, scale = tuple(cameras), _known_scale(cameras)
    while waiting := [
        i for i, camera in enumerate(cameras) if not (camera.is_calibrated and camera.is_placed)
    ]:
        found, failed = {}, []
        for i in waiting:
            equations = _without_outliers(_epipolar(tracks, cameras, i), scale)
            try:
                # If none can be found, the error of the first names all of them.
                others = [j for j in waiting if j != i]
                found[i] = _filled(cameras[i], _solved(equations, cameras, [i, *others], checked))
            except ValueError as error:
                failed.append(error)
        if not found:
            raise failed[0]
        cameras = tuple(found.get(i, camera) for i, camera in enumerate(cameras))
    return cameras


def _known_scale(cameras: Sequence[Camera]) -> float:
    """The mean scale of those that are calibrated."""
    return float(np.mean([camera.scale for camera in cameras if camera.scale is not None]))


def _filled(camera: Camera, solution: Floats) -> Camera:
    """A camera with what was unknown of it."""
    if not camera.is_calibrated:
        turned, solution = solution[:2], solution[2:]
        camera = camera.calibrated(complex(*turned))
    return camera if camera.is_placed else camera.placed(camera.image_size[0] / 2 * solution[:2])


def _names(indices: Iterable[int]) -> str:
    """Cameras as errors call them."""
    return " and ".join(f"cameras[{i}]" for i in indices)


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
    loose = [i for i, camera in enumerate(rig.cameras) if not camera.is_placed]
    if loose and not models.all_orthographic(rig.cameras):
        raise ValueError(
            "rig: all positions must be given if a camera is perspective, got none of "
            f"{_names(loose)}"
        )
    placed = [camera for camera in rig.cameras if camera.is_placed]
    if loose and not models.independent(placed):
        raise ValueError(
            "rig: the positions of two cameras with independent normals must be given to learn "
            f"those of {_names(loose)}, got {len(placed)}"
        )


def learn_cameras_eq4(tracks: Sequence[Floats], rig: Rig) -> Rig:
    """Learn scales and angles by Eq. (4) in closed form.

    Eq. (4) is linear in (s cos theta, s sin theta). It leaves out the epipolar constraint between
    uncalibrated cameras, and its misfit is not the error of pixels.

    Parameters
    ----------
    tracks, rig
        See `learn_cameras`. All cameras are orthographic and placed, and two of the uncalibrated
        ones have independent normals.

    Returns
    -------
    Rig
        The same cameras, all calibrated.

    Raises
    ------
    ValueError
        See `learn_cameras`.
    """
    check_learnable(rig)
    views, cameras = np.stack(check_views(tracks, rig)), rig.cameras
    known, unknown = ([i for i, c in enumerate(cameras) if c.is_calibrated == k] for k in (1, 0))
    loose = [i for i, camera in enumerate(cameras) if not camera.is_placed]
    if not (unknown or loose):
        return rig
    if loose:
        raise ValueError(
            f"rig: Eq. (4) needs all positions, got none of {_names(loose)}; use learn_cameras"
        )
    if not models.all_orthographic(cameras):
        raise ValueError("rig: Eq. (4) needs orthographic cameras, got a perspective one")
    if not models.independent([cameras[i] for i in unknown]):
        raise ValueError(
            "rig: Eq. (4) needs two independent normals among the uncalibrated cameras, got "
            f"{[cameras[i].normal.tolist() for i in unknown]}; use learn_cameras"
        )
    frames = np.flatnonzero(np.isfinite(views).all(axis=(0, 2)))
    others = np.vstack([cameras[i].rows for i in unknown])
    predict = np.vstack([cameras[i].rows for i in known]) @ np.linalg.pinv(others)
    target = np.hstack([cameras[i].plane_coordinates(views[i][frames]) for i in known])
    design = []
    for i, block in zip(unknown, np.split(predict, len(unknown), axis=1), strict=True):
        x, y = cameras[i].centred(views[i][frames]).T
        # s T(theta) (X, Y) = [[X, Y], [Y, -X]] p
        design.append(np.einsum("qa,abf->fqb", block, np.array([[x, y], [y, -x]])))
        target = target - cameras[i].offset @ block.T
    every = Equations(
        np.concatenate(design, axis=2).reshape(target.size, 2 * len(unknown)), target.ravel(),
        np.repeat(frames, target.shape[1]),
    )  # fmt: skip
    kept = _without_outliers(every, _known_scale(cameras))
    values = _solved(kept, cameras, unknown).reshape(-1, 2)
    found = {i: _filled(cameras[i], value) for i, value in zip(unknown, values, strict=True)}
    return Rig(tuple(found.get(i, camera) for i, camera in enumerate(cameras)))


def learn_cameras(tracks: Sequence[Floats], rig: Rig) -> Rig:
    """Learn what is not known of the cameras from tracks of one moving target.

    In (s cos theta, s sin theta) of an unknown camera and Delta_c of one without a position, the
    condition that its view and those of known cameras agree on one point is linear, so no starting
    guess is needed. This closed form is then refined to the smallest reprojection error in pixels,
    in every frame with two or more views: that holds the epipolar constraint between uncalibrated
    cameras, too, which Eq. (4) leaves out, and has no bias of the scale by pixel noise.

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
    rig = posed(tracks, rig)
    views, seen = check_views(tracks, rig), check_seen(tracks, rig)
    errors = np.array([known_to(camera) for camera in rig.cameras])
    start = closed_form(views, rig.cameras)
    if not np.isfinite(models.intersect(start, views)).any():
        raise ValueError(
            "rig: the lines of sight must meet in front of the cameras, got none that do (do two "
            "views share frames, and does each normal point from the scene to its camera?)"
        )
    if not errors.any():
        return Rig(rig.cameras, note=rig.note)
    found = adjust(Footage.of(seen), start, errors)
    doubts: tuple[str, ...] = ()
    if not found.settled:
        doubts += (
            f"the search for the cameras did not converge in {found.steps} evaluations: their "
            "scales and angles may be off; check what was measured, or give more of what is known "
            "(a motion on a line or in a plane tells little of cameras)",
        )
    off = np.abs(found.change) / np.where(errors > 0, errors, np.inf)
    # So many of the measurements the tracks tell: of each the share by which it is known better.
    left = (found.factor**2).sum(axis=1) * found.prior
    told = np.clip(1 - left[found.prior > 0], 0, 1).sum()
    squares = (off**2).sum()
    if squares > chdtri(max(told, 1.0), 1e-4):
        i, part = np.unravel_index(off.argmax(), off.shape)
        what = next(name for name, place in PARTS.items() if part in place)
        doubts += (
            f"the {what} of cameras[{i}] is {off.max():.1f} times its error from what was measured "
            f"(of all cameras chi-square {squares:.0f}, where some {told:.0f} are expected): check "
            "it, how the others were measured, and whether the tracks are in their order",
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
    learned = check_items("rig", rig.cameras, len(truth.cameras), "camera of truth")
    known = ((a.calibration, b.calibration) for a, b in zip(learned, truth.cameras, strict=True))
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
    drifting = np.flatnonzero(lags.rate_errors > 0)
    errors[moving, LAG] = errors[drifting, DRIFT] = np.inf
    footage = Footage.of(tracks, lags.frames, lags.rates, lags.clocks or None)
    near = adjust(footage, learned.cameras, errors, most=0)
    modes = np.einsum("ik,nji->knj", near.factor, near.reduced.follow)
    return _of_shape(modes, near.points) if rig.note else modes


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


def tracking_errors(
    tracks: Sequence[Floats],
    rig: Rig,
    motion: Sequence[Floats] | None = None,
    raw: Sequence[Floats] | None = None,
    places: Callable[[Sequence[Floats]], Floats] | None = None,
) -> Floats:
    """Errors of the reconstructed path that the tracks of all frames share.

    A codec that codes changes leaves out the smallest ones, so that a trace of the target stays
    where it just was, and the track a constant distance behind the motion. And a detector that
    marks whole pixels may mark corners or middles, so that all of a track lies beside the target by
    part of a pixel. The residuals show little of either, because all views do it alike. The trail
    is allowed for in proportion to the noise that they do show, the place by the pixels' step.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2)
        One per camera, at the same instants.
    rig : Rig
        All cameras calibrated.
    motion : sequence of ndarray, shape (n, 2), optional
        The tracks without their noise; by default the tracks themselves.
    raw : sequence of ndarray, shape (n_i, 2), optional
        The tracks as they were before they were interpolated to these instants, if they were.
    places : callable, optional
        From tracks to the path; by default that of `reconstruct`.

    Returns
    -------
    ndarray, shape (m, n, 3)
        Scene units; what the trail of each camera, one standard deviation long, adds to the path,
        and then what a shift of its track does, in u and in v, if that is rounded.
        Zero where nothing can be reconstructed.

    Raises
    ------
    ValueError
        If a camera is not calibrated, or the tracks are not one per camera of two frames or more.
    """
    check_calibrated("rig", rig)
    views = check_views(tracks, rig)
    if len(views[0]) < 2:
        raise ValueError(f"tracks: must have two frames or more, got {[*map(len, views)]}")
    if places is None:
        places = partial(models.intersect, rig.cameras)  # of views that are at once already
    left = np.hstack(missed(rig.cameras, views))
    count = left.shape[1]
    left = np.abs(left[np.isfinite(left)])
    noise = 1.4826 * np.median(left) * np.sqrt(count / (count - 3)) if left.size else 0.0
    shifts = []
    for i, track in enumerate(views):
        step = np.gradient(track if motion is None else motion[i], axis=0)
        # Noise has no direction: the trail ends where the target moves by less than that.
        length = np.sqrt((step**2).sum(axis=1, keepdims=True) + noise**2)
        # Half of the noise; mp4v made up to .6 of it, Motion JPEG .1.
        shifts.append((i, -0.5 * noise * np.nan_to_num(step / np.maximum(length, 1e-300))))
    for i, track in enumerate(views if raw is None else raw):
        place = _step(track) / np.sqrt(12)  # of what lies anywhere in a step with equal chance
        shifts += [(i, place * axis) for axis in np.eye(2) if place]
    moved = ([*views[:i], views[i] + shift, *views[i + 1 :]] for i, shift in shifts)
    x = places(views)
    return np.nan_to_num([places(those) - x for those in moved])


def _step(track: Floats) -> float:
    """The step that all pixels of a track, (n, 2), are multiples of; 0 if they are not rounded."""
    seen = track[np.isfinite(track).all(axis=1)]
    places = np.unique(seen - seen.min(axis=0, initial=np.inf))
    if len(places) < 4:  # of which nothing can be said
        return 0.0
    step = float(np.diff(places).min())
    off = places / step - np.round(places / step)
    return step if np.abs(off).max() < 1e-6 else 0.0
