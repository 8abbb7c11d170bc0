"""Calibration: scales, angles and positions of cameras, learned from tracks of one moving target.

Orthographic views agree on one point if linear equations hold for what is unknown, so no starting
guess is needed: the stacked in-plane coordinates of the views of a frame equal [R^-_1; R^-_2; ...]
x, columns Q with Q^T [R^-_1; ...] = 0 take the unknown point out, and what is left is linear in (s
cos theta, s sin theta) of the cameras that are not calibrated and Delta_c of those without a
position. Perspective ones are found from the known cameras, one epipolar constraint at a time. From
there a search goes to the smallest reprojection error in pixels (`adjust`).

Rigs of which nothing is measured but perhaps the lenses: two pinholes that see the same points
determine where they stand relative to each other, but for the unit of length (the essential matrix,
by the five-point method); of the points that they see, any other camera's place follows. From far
away, three images or more of a path are a linear map of it, which is factorised; that start and its
mirror image in depth are tried as well. A focal length of which nothing is known is tried from long
lenses to wide ones. From the starts with the smallest residuals all cameras, and their focal
lengths as far as they are uncertain, are adjusted (`adjust`), and the best is taken.

Nothing in the images tells the unit of length, nor how the rig stands in the room. So the first
camera gives the axes, x to the right and y up in its image and z towards it; the middle of the path
is the origin, and the distance from the first camera to the second is the unit. Handedness is told
by perspective; where that is too weak, a warning says so.

Paper: Section "Coordinates Transformation", Eq. (4), (5). Hartley and Zisserman 2004, "Multiple
View Geometry"; Nister 2004, PAMI 26 (five points); Tomasi and Kanade 1992, IJCV 9 (factorisation).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from ..arrays import Bools, Floats, Ints
from ..checks import check_instance
from .adjust import PARTS, Adjustment, adjust, known_to
from .alignment import Footage
from .models import PARALLEL, Camera, PerspectiveCamera, all_orthographic, independent
from .rig import Rig
from .sight import (
    Views,
    epipolar_equations,
    intersect,
    points_of_views,
    residuals_of_views,
    views_of,
)
from .triangulate import GROSS, check_calibrated, check_seen, check_views

Complex = NDArray[np.complex128]

# A frame that is missed by more than so many robust standard deviations holds an outlier.
_OUTLIER = 8.0
_ROUNDING = 1e-6  # pixels; missing by less is no disagreement
_ROUNDS = 20  # of leaving outliers out
# Motion must tell by so many times the misfit in countless frames, and over sqrt(n) more in n.
_TELLING, _FEW = 1.45, 8.0
_UNDECIDED = (
    "which frames hold outliers of a track cannot be told: leaving some out makes others look "
    "wrong; check the tracks, the positions and the normals"
)
_EITHER_HAND = (
    "whether the path is the true one or its mirror image cannot be told, as the cameras are "
    "too far away: measure roughly where they stand, or come closer"
)
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
_TOO_FAR = 5.0  # standard errors that a measurement may be off


@dataclass(frozen=True)
class Unknowns:
    """Which cameras of a rig are not calibrated and which not placed, as indices.

    `scale` is the mean scale of the calibrated cameras.
    """

    cameras: tuple[Camera, ...]
    uncalibrated: Ints
    unplaced: Ints
    scale: float

    @classmethod
    def of(cls, rig: Rig) -> Unknowns:
        """Of a rig with at least one calibrated camera."""
        return cls(
            rig.cameras,
            np.flatnonzero([not camera.is_calibrated for camera in rig.cameras]),
            np.flatnonzero([not camera.is_placed for camera in rig.cameras]),
            float(np.mean([c.calibration[0] for c in rig.cameras if c.is_calibrated])),
        )

    @property
    def known(self) -> int:
        """The first calibrated camera."""
        return next(i for i, camera in enumerate(self.cameras) if camera.is_calibrated)

    @property
    def any(self) -> bool:
        """Whether anything is unknown."""
        return bool(self.uncalibrated.size or self.unplaced.size)

    @property
    def measured(self) -> bool:
        """Whether something that is given has an error."""
        return any(any(camera.errors.values()) for camera in self.cameras)

    def filled(self, turned: Complex, offsets: Floats) -> tuple[Camera, ...]:
        """The cameras with s exp(i theta), (u,), and offsets, (v, 2), where they are unknown."""
        cameras = list(self.cameras)
        for i, offset in zip(self.unplaced, offsets, strict=True):
            cameras[i] = cameras[i].placed(offset)
        return calibrated(cameras, self.uncalibrated, turned)


def calibrated(
    cameras: Sequence[Camera], indices: Iterable[int], turned: Iterable[complex]
) -> tuple[Camera, ...]:
    """The cameras with s exp(i theta) written into some of them."""
    values = dict(zip(indices, turned, strict=True))
    return tuple(c.calibrated(values[i]) if i in values else c for i, c in enumerate(cameras))


def names(indices: Iterable[int]) -> str:
    """Cameras as errors call them."""
    return " and ".join(f"cameras[{i}]" for i in indices)


@dataclass(frozen=True)
class Equations:
    """Linear equations design @ p = target, (k, p) and (k,), and the frame of each, (k,).

    p holds (s cos theta, s sin theta) of the cameras that are not calibrated, then Delta_c of those
    not placed, divided by the half width of their image: so all of the design is in pixels.
    """

    design: Floats
    target: Floats
    frames: Ints


def annihilator(cameras: Sequence[Camera]) -> Floats:
    """All columns Q that take the unknown point out of the views of these cameras."""
    return null_space(np.vstack([camera.rows for camera in cameras]).T, rcond=PARALLEL)


def agreement(
    views: Views,
    unknowns: Unknowns,
    columns: Callable[[Sequence[Camera]], Floats] = annihilator,
) -> tuple[Equations, bool]:
    """The equations of all frames without outliers, and whether it could be told which these are.

    `columns(cameras)` are the Q, (2 c, q), of c cameras that see the target in the same frames.
    """
    width = 2 * (unknowns.uncalibrated.size + unknowns.unplaced.size)
    parts = [(np.zeros((0, width)), np.zeros(0), np.zeros(0, dtype=int))]
    for indices, frames in views.groups:
        block = columns([unknowns.cameras[i] for i in indices])
        design, target = _group(views, unknowns, indices, frames, block)
        places = np.repeat(frames, target.shape[1])
        parts.append((design.reshape(len(places), width), target.ravel(), places))
    every = Equations(*map(np.concatenate, zip(*parts, strict=True)))
    return _without_outliers(every, unknowns.scale)


def _group(
    views: Views, unknowns: Unknowns, indices: Ints, frames: Ints, columns: Floats
) -> tuple[Floats, Floats]:
    """Design, (f, q, p / 2, 2), and target, (f, q), of the equations of one group of frames."""
    first = unknowns.uncalibrated.size  # of the cameras that are not placed
    design = np.zeros((len(frames), columns.shape[1], first + unknowns.unplaced.size, 2))
    target = np.zeros(design.shape[:2])
    for i, block in zip(indices, np.split(columns, len(indices)), strict=True):
        camera, pixels = unknowns.cameras[i], views.tracks[i][frames]
        if camera.scale is not None:
            target -= camera.scale * camera.turned(pixels) @ block
        else:
            # s T(theta) (X, Y) = [[X, Y], [Y, -X]] p
            x, y = camera.centred(pixels).T
            slope = np.einsum("abf,aq->fqb", np.array([[x, y], [y, -x]]), block)
            design[:, :, np.searchsorted(unknowns.uncalibrated, i)] = slope
        if camera.is_placed:
            target -= camera.offset @ block
        else:
            place = first + np.searchsorted(unknowns.unplaced, i)
            design[:, :, place] = camera.image_size[0] / 2 * block.T
    return design, target


def _without_outliers(every: Equations, scale: float) -> tuple[Equations, bool]:
    """The frames of which a least-squares fit to them misses no equation by far.

    Fit and frames are found in turn; the second result is whether they came to agree. The scale of
    the misses is the median over all frames, so that leaving some out never makes others look
    worse.
    """
    kept = every
    for _ in range(_ROUNDS):
        solution = np.linalg.lstsq(kept.design, kept.target)[0]
        missed = np.abs(every.design @ solution - every.target) / scale
        limit = max(_OUTLIER * 1.4826 * np.median(missed), _ROUNDING) if len(missed) else 0.0
        good = ~np.isin(every.frames, every.frames[missed > limit])
        before, kept = kept, Equations(every.design[good], every.target[good], every.frames[good])
        if np.array_equal(kept.frames, before.frames):
            return kept, True
    return kept, False


def solve(design: Floats, target: Floats, unknowns: Unknowns) -> tuple[Complex, Floats]:
    """Least-squares s exp(i theta) and offsets, or an error that names what the tracks leave open.

    The design is in pixels: a singular value over sqrt(n) is the motion, in pixels rms, that tells
    one combination of the parameters. Noise on a target that does not move makes 0.6-1.4 times the
    misfit of it, and somewhat more in few frames.
    """
    turns, loose = unknowns.uncalibrated, unknowns.unplaced
    wanted = "scale, angle and position" if len(loose) else "scale and angle"
    asked = np.append(turns, loose)
    if len(design) < design.shape[1]:
        raise ValueError(
            f"tracks: frames with common views must give at least {design.shape[1]} equations "
            f"for {wanted} of {names(asked)}, got {len(design)}"
        )
    solution = np.linalg.lstsq(design, target)[0]
    turned, offsets = solution[: 2 * len(turns)].view(complex), solution[2 * len(turns) :]
    scale = np.mean(np.abs(turned)) if len(turns) else unknowns.scale
    misfit = np.sqrt(np.mean((design @ solution - target) ** 2)) / scale if scale > 0 else np.inf
    _, singular, right = np.linalg.svd(design, full_matrices=False)
    motion = singular / np.sqrt(len(design))
    # What is missed by measurements is no noise; a later search takes these for what they are.
    asked_for = min(2.0, _TELLING + _FEW / np.sqrt(len(design))) * misfit
    weak = motion <= max(1e-9 * motion[0], 0.0 if unknowns.measured else asked_for)
    if weak.any():
        share = np.linalg.norm(right[weak].reshape(weak.sum(), -1, 2), axis=(0, 2))
        raise ValueError(
            f"tracks: the target's motion must determine {wanted} of "
            f"{names(asked[share > 0.1])}, got {motion[-1]:.2g} px rms of "
            f"telling motion against a misfit of {misfit:.2g} px (a static target, a wrong "
            "position or normal, videos in another order than the cameras, or of other motions)"
        )
    widths = [unknowns.cameras[i].image_size[0] for i in loose]
    return turned, offsets.reshape(-1, 2) * np.reshape(widths, (-1, 1)) / 2


def posed(tracks: Sequence[Floats], rig: Rig, synchronous: bool = True, most: float = GROSS) -> Rig:
    """The rig with places and directions found from tracks, if it has none.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2)
        At the same instants, ...
    rig : Rig
        See `Rig.is_measured`.
    synchronous : bool
        ... or but for small lags, which are then learned as well, and forgotten.
    most : float
        Noise that may be left, pixels.

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
    if best is None or best.noise > most:
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
    sizes = np.linalg.norm(motion, axis=(1, 2), keepdims=True)
    if not sizes.all():  # nothing moves in some view
        return
    up = np.triu_indices(3)
    twice = 2 - np.eye(3)[up]  # what is off the diagonal stands there twice
    equations = []
    for one, other in motion / sizes:
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
    doubts = (_EITHER_HAND,) if mirrored else ()
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
        doubts: tuple[str, ...] = () if decided else (_UNDECIDED,)
    else:
        learned = _closest(footage, _spread(views, unknowns), errors)
        _, settled = intersect(learned.cameras, views.tracks)
        left = int((~settled).sum())
        doubts = (
            f"the target's place is uncertain in {left} of {views.frames} frames, where the lines "
            "of sight hardly cross: the cameras look along nearly the same line there, or one of "
            "them is wrong",
        ) * bool(left)
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
    doubts: tuple[str, ...] = (
        f"the search for the cameras did not converge in {found.steps} evaluations: their scales "
        "and angles may be off; check the positions and normals, or give more of what is known",
    ) * (not found.settled)
    measured = (errors > 0) & np.isfinite(errors)
    off = np.where(measured, np.abs(found.change) / np.where(measured, errors, 1.0), 0.0)
    if off.max() > _TOO_FAR:
        i, part = np.unravel_index(off.argmax(), off.shape)
        what = next(name for name, place in PARTS.items() if place.start <= part < place.stop)
        doubts += (
            f"the {what} of cameras[{i}] is {off.max():.0f} times its error from what was "
            "measured: check it, and how the others were measured",
        )
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
