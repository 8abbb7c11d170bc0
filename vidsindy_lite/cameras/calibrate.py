"""Cameras: from 3D to pixels, and from several pixel tracks back to 3D.

A `Camera` is scaled orthographic. With the pixel (u to the right, v down) measured from the middle
of the image, x_c = (u - (W-1)/2, (H-1)/2 - v), it sees

    s T(theta) x_c + Delta_c = R^- x,        T = [[cos, sin], [-sin, cos]],

where R^- are the first two rows of the rotation that takes the unit normal to e_z and
Delta_c = R^- position. Position and normal are measured; scale s (scene units per pixel) and
in-plane angle theta are given for at least one camera of a `Rig` and learned for the others
(`learn_cameras`). So is Delta_c of cameras without a position, if two others have one.
`reconstruct` then turns the tracks into a trajectory, and `residuals` says by how many pixels it
misses them. `perspective.PerspectiveCamera` is a second kind of camera for the same rigs, which
differs from the first in its `matrix` alone.

A track is an (n, 2) array of pixels, one row per frame; a row holding NaN means "not seen".

Paper: Section "Coordinates Transformation", Eq. (4)-(6).
"""

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import least_squares

from ..checks import (
    check_image_size,
    check_instance,
    check_integer,
    check_path,
    check_rows,
    check_tracks,
)
from .models import MODELS, Camera, OrthographicCamera
from .triangulate import PARALLEL, epipolar_equations, intersect

METHODS = ("joint", "paper", "gradient")

# A frame that is missed by more than so many robust standard deviations holds an outlier.
_OUTLIER = 8.0
_ROUNDING = 1e-6  # pixels; missing by less is no disagreement


@dataclass(frozen=True)
class Rig:
    """Cameras that watch one scene in one reference frame.

    Parameters
    ----------
    cameras : sequence of Camera
        Two or more, orthographic or perspective, that do not all look along the same lines: two
        orthographic normals must not be parallel, or two pinholes not coincide, or there is one
        camera of each kind.

    Raises
    ------
    ValueError
        If there are fewer than two cameras, or all look along the same lines.
    """

    cameras: tuple[Camera, ...]

    def __post_init__(self):
        cameras = tuple(self.cameras) if isinstance(self.cameras, Iterable) else (self.cameras,)
        object.__setattr__(self, "cameras", cameras)
        for i, camera in enumerate(cameras):
            check_instance(f"cameras[{i}]", camera, Camera)
        if len(cameras) < 2:
            raise ValueError(f"cameras: must be two or more, got {len(cameras)}")
        if not _independent(cameras):
            kind = "normal" if cameras[0].model == OrthographicCamera.model else "position"
            raise ValueError(
                f"cameras: must have at least two independent {kind}s, got only "
                f"{[getattr(camera, kind).tolist() for camera in cameras]}"
            )

    @property
    def is_orthographic(self):
        """Whether all cameras are: then agreement of the views is linear in what is unknown."""
        return all(camera.model == OrthographicCamera.model for camera in self.cameras)

    @classmethod
    def around(cls, x, image_size=(512, 512)):
        """Three calibrated cameras around a scene, which fills most of every image.

        The cameras stand 120 degrees apart in azimuth, look 15 to 25 degrees down, and differ in
        scale and in-plane angle; z is up in the images but for a roll of 6 to 14 degrees.

        Parameters
        ----------
        x : array_like, shape (n, 3)
            Points of the scene, e.g. a trajectory; NaN rows are ignored.
        image_size : tuple of int, default (512, 512)
            Width and height in pixels.

        Returns
        -------
        Rig

        Raises
        ------
        ValueError
            If x has a wrong shape or all its points coincide.
        """
        x = check_rows("x", x, 3)
        x = x[~np.isnan(x).any(axis=1)]
        if len(np.unique(x, axis=0)) < 2:
            points = f"{x.tolist()!r:.60}" if len(x) else "only rows with NaN"
            raise ValueError(f"x: must hold at least two different points, got {points}")
        low, high = x.min(axis=0), x.max(axis=0)
        middle, reach = (low + high) / 2, np.linalg.norm(high - low)
        half = (np.array(check_image_size(image_size, least=2)) - 1) / 2
        cameras = []
        for azimuth, elevation, roll in np.deg2rad([[20, 20, 6], [140, 15, -9], [260, 25, 14]]):
            across = np.array([np.cos(azimuth), np.sin(azimuth), 0])
            normal = np.cos(elevation) * across + np.sin(elevation) * np.array([0, 0, 1])
            camera = OrthographicCamera(
                position=middle + reach * normal,
                normal=normal,
                scale=1.0,
                # Without the roll, R^- e_z would be straight up in the image.
                angle=np.arctan2(-np.cos(azimuth), -np.sin(azimuth)) + roll,
                image_size=image_size,
            )
            extent = np.max(np.abs(camera.centred(camera.project(x))) / half)
            # The outermost point comes to 85 % of the half image: room for the target's size.
            cameras.append(replace(camera, scale=extent / 0.85))
        return cls(cameras)

    @classmethod
    def load(cls, path):
        """Read a rig from a TOML file, one [[camera]] table per camera.

        Parameters
        ----------
        path : path-like

        Returns
        -------
        Rig

        Raises
        ------
        FileNotFoundError
            If there is no such file.
        ValueError
            If the file is not TOML or does not describe a rig; names file, camera and key.
        """
        path = check_path("path", path)
        if not path.is_file():
            raise FileNotFoundError(f"{path}: no such rig file")
        try:
            content = tomllib.loads(path.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ValueError(f"{path}: must be a TOML file: {error}") from error
        tables = content.pop("camera", None)
        if content or not isinstance(tables, list):
            found = sorted([*content, "camera"] if tables is not None else content)
            raise ValueError(f"{path}: must hold [[camera]] tables and nothing else, got {found}")
        try:
            return cls([_from_table(i, table) for i, table in enumerate(tables)])
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error

    def save(self, path):
        """Write the rig to a TOML file, from which `load` gives back exactly this rig.

        Parameters
        ----------
        path : path-like
            Overwritten if it exists.
        """
        lines = [
            "# Cameras of a rig; scale in scene units per pixel (of a perspective camera: at "
            "distance 1), angle in radians."
        ]
        for camera in self.cameras:
            lines += ["", "[[camera]]"]
            # repr of a float is its shortest exact decimal form, and valid TOML.
            lines += [f"{key} = {value!r}" for key, value in _to_table(camera).items()]
        check_path("path", path).write_text("\n".join(lines) + "\n", encoding="utf-8")

    def uncalibrated(self, keep=0):
        """The same rig with scale and angle forgotten in all cameras but one.

        Parameters
        ----------
        keep : int, default 0
            Index of the camera that stays as it is.

        Returns
        -------
        Rig

        Raises
        ------
        ValueError
            If there is no such camera.
        """
        if not check_integer("keep", keep) < len(self.cameras):
            raise ValueError(f"keep: must be an index of {len(self.cameras)} cameras, got {keep}")
        return Rig(
            camera if i == keep else replace(camera, scale=None, angle=None)
            for i, camera in enumerate(self.cameras)
        )


def learn_cameras(tracks, rig, method="joint"):
    """Learn what is not known of the cameras from tracks of one moving target.

    In (s cos theta, s sin theta) of the unknown cameras and Delta_c of those without a position,
    the condition that all views agree on one
    point is linear, so no starting guess is needed.

    * "paper": Eq. (4), closed form. The uncalibrated views predict the calibrated ones; uses the
      frames in which all cameras see the target.
    * "joint": every equation that does not hold the unknown point, among them the epipolar
      constraint between uncalibrated cameras that Eq. (4) leaves out, and every frame with two or
      more views; the closed form is then refined to the smallest reprojection error in pixels,
      which removes the bias that pixel noise causes in a scale. With a perspective camera in the
      rig, the closed form goes from the known cameras to the others, one epipolar constraint at a
      time, and the refinement is the same.
    * "gradient": Eq. (4) in (s, theta) as in the paper, by L-BFGS in PyTorch; for comparison.

    Frames in which the views contradict each other by more than eight robust standard deviations
    are left out, so that a few outliers of the tracker do not bend the cameras.

    Two cameras are enough, but raise no alarm at a normal that is turned about the cross product of
    both: the path is then wrong without a residual. Three do.

    Parameters
    ----------
    tracks : sequence of array_like, shape (n, 2)
        One track per camera of the rig, frame by frame the same instants; NaN = not seen.
    rig : Rig
        At least one calibrated camera. What is given stays as it is. If a position is missing, two
        others must be given, with independent normals, and all cameras be orthographic: in depth
        from a single camera nothing would fix the origin.
    method : {"joint", "paper", "gradient"}

    Returns
    -------
    Rig
        The same cameras, all calibrated and placed.

    Raises
    ------
    ValueError
        If the tracks do not match the rig, no camera is calibrated, too few are placed, or the
        target's motion does not determine a camera.
    """
    if method not in METHODS:
        raise ValueError(f"method: must be one of {METHODS}, got {method!r}")
    check_learnable(rig)
    tracks = _check_tracks(tracks, rig)
    unknown, loose = _unknown(rig), _loose(rig)
    if not unknown.size and not loose.size:
        return rig
    if loose.size and method != "joint":
        raise ValueError(
            f"method: must be 'joint' for a rig without the position of {_names(loose)}, "
            f"got {method!r}"
        )
    if not rig.is_orthographic:
        if method != "joint":
            raise ValueError(
                f"method: must be 'joint' for a rig with a perspective camera, got {method!r}"
            )
        return _refine(tracks, rig, _spread(tracks, rig), np.zeros((0, 2)))
    if method != "joint" and not _independent([rig.cameras[i] for i in unknown]):
        raise ValueError(
            f"rig: method {method!r} needs two independent normals among the uncalibrated "
            f"cameras, got {[rig.cameras[i].normal.tolist() for i in unknown]}; use 'joint'"
        )
    design, target, frames = _agreement(tracks, rig, unknown, loose, epipolar=method == "joint")
    fits = ~np.isin(frames, _outliers(design, target, frames, rig))
    design, target = design[fits], target[fits]
    turned, offsets = _solve(design, target, rig, unknown, loose)
    if method == "joint":
        clean = np.isin(np.arange(len(tracks[0])), frames[fits])
        return _refine([track[clean] for track in tracks], rig, turned, offsets)
    if method == "gradient":
        turned = _descend(design, target, rig, unknown)
    return _calibrate(rig, unknown, turned)


def reconstruct(tracks, rig):
    """3D trajectory from the tracks of a calibrated rig, by least squares in pixels.

    Paper: Eq. (6), whose "inverse" of a 6 x 3 matrix is the least-squares solution; here with any
    number of cameras, of either kind, and each view weighted so that all count in pixels.

    Every frame is taken as it is: an outlier of one track moves the point. Three views show it as
    a large residual of that frame (see `residuals`), two views cannot.

    Parameters
    ----------
    tracks : sequence of array_like, shape (n, 2)
        One track per camera of the rig; NaN = not seen.
    rig : Rig
        All cameras calibrated.

    Returns
    -------
    ndarray, shape (n, 3)
        Scene units; NaN where fewer than two cameras see the target, where all that do look along
        the same line, or where the lines of sight meet behind a perspective camera.

    Raises
    ------
    ValueError
        If the tracks do not match the rig or a camera is not calibrated.
    """
    tracks = _check_tracks(tracks, rig)
    _require_all_calibrated("rig", rig.cameras)
    if not rig.is_orthographic:
        return intersect(rig.cameras, tracks)
    x = np.full((len(tracks[0]), 3), np.nan)
    for views, frames in _visibility(tracks):
        cameras = [rig.cameras[i] for i in views]
        if not _independent(cameras):
            continue
        rows = np.vstack([camera.rows / camera.scale for camera in cameras])
        seen = np.hstack(
            [
                camera.plane_coordinates(tracks[i][frames]) / camera.scale
                for i, camera in zip(views, cameras, strict=True)
            ]
        )
        x[frames] = seen @ np.linalg.pinv(rows).T
    return x


def residuals(tracks, rig):
    """Reprojection residuals: by how many pixels the reconstructed target misses each track.

    Parameters
    ----------
    tracks : sequence of array_like, shape (n, 2)
        One track per camera of the rig; NaN = not seen.
    rig : Rig
        All cameras calibrated.

    Returns
    -------
    list of ndarray, shape (n, 2)
        Track minus projection, pixels, one array per camera; NaN where the camera does not see
        the target or it cannot be reconstructed. Of the six numbers of a frame three are used up
        by the point itself, so pixel noise of standard deviation sigma leaves sigma / sqrt(2).

    Raises
    ------
    ValueError
        If the tracks do not match the rig or a camera is not calibrated.
    """
    tracks = _check_tracks(tracks, rig)
    x = reconstruct(tracks, rig)
    return [track - camera.project(x) for track, camera in zip(tracks, rig.cameras, strict=True)]


def learn_normal(tracks, rig, index):
    """Learn the cameras with the normal of one of them unknown as well.

    For a rig that does not agree with its tracks: if the normal of this camera alone was measured
    badly, the residuals of the new rig are no larger than the errors of the tracks.

    Parameters
    ----------
    tracks, rig
        See `learn_cameras`.
    index : int
        Of the camera.

    Returns
    -------
    Rig

    Raises
    ------
    ValueError
        See `learn_cameras`.
    """
    if not check_integer("index", index) < len(rig.cameras):
        raise ValueError(f"index: must be below {len(rig.cameras)}, the cameras, got {index}")
    learned = learn_cameras(tracks, rig)
    tilted = rig.cameras[index]

    def candidate(parameters):
        cameras = list(rig.cameras)
        cameras[index] = replace(tilted, normal=tilted.normal + parameters[:2] @ tilted.rows)
        return with_parameters(Rig(cameras), parameters[2:])

    start = camera_parameters(rig, learned)
    return _closest(tracks, candidate, np.concatenate(([0.0, 0.0], start)))


def camera_parameters(rig, learned):
    """What was learned of the unknown cameras of a rig, as `with_parameters` takes it.

    Parameters
    ----------
    rig, learned : Rig
        Before and after `learn_cameras`.

    Returns
    -------
    ndarray, shape (2 u + 2 v,)
        Log of the scale and angle of each uncalibrated camera, then the offset of each camera
        without a position, over the width of what the calibrated cameras see.
    """
    turned = np.array(
        [learned.cameras[i].scale * np.exp(1j * learned.cameras[i].angle) for i in _unknown(rig)],
        complex,
    )
    offsets = np.array([learned.cameras[i].offset for i in _loose(rig)])
    return _parameters(rig, turned, offsets.reshape(-1, 2))


def with_parameters(rig, parameters):
    """The rig with all that is unknown of its cameras filled in from `camera_parameters`."""
    unknown = _unknown(rig)
    logs, offsets = np.split(parameters, [2 * unknown.size])
    cameras = list(rig.cameras)
    for i, offset in zip(_loose(rig), offsets.reshape(-1, 2) * _known_width(rig), strict=True):
        cameras[i] = replace(cameras[i], position=offset @ cameras[i].rows)
    return _calibrate(Rig(cameras), unknown, np.exp(logs.copy().view(complex)))


def check_learnable(rig):
    """That this is a rig with enough known of its cameras to learn the rest.

    Raises
    ------
    ValueError
        If it is not.
    """
    check_instance("rig", rig, Rig)
    if not any(camera.is_calibrated for camera in rig.cameras):
        raise ValueError(
            "rig: at least one camera must be calibrated (scale and angle given) to learn the "
            f"others, got none of {len(rig.cameras)}"
        )
    loose = _loose(rig)
    if not loose.size:
        return
    if not rig.is_orthographic:
        raise ValueError(
            "rig: all positions must be given if a camera is perspective, got none of "
            f"{_names(loose)}"
        )
    placed = [camera for camera in rig.cameras if camera.is_placed]
    if not _independent(placed):
        raise ValueError(
            "rig: the positions of two cameras with independent normals must be given to learn "
            f"those of {_names(loose)}, got {len(placed)}"
        )


def calibration_errors(rig, truth):
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
    check_instance("rig", rig, Rig)
    check_instance("truth", truth, Rig)
    if len(rig.cameras) != len(truth.cameras):
        raise ValueError(
            f"rig: must have as many cameras as truth, got {len(rig.cameras)} "
            f"and {len(truth.cameras)}"
        )
    for name, cameras in (("rig", rig.cameras), ("truth", truth.cameras)):
        _require_all_calibrated(name, cameras)
    return np.array(
        [
            (a.scale / b.scale - 1, np.angle(np.exp(1j * (a.angle - b.angle))))
            for a, b in zip(rig.cameras, truth.cameras, strict=True)
        ]
    )


def _agreement(tracks, rig, unknown, loose, epipolar):
    """Linear equations design @ p = target for all that is unknown of the cameras.

    p holds (s cos theta, s sin theta) of the unknown cameras, then Delta_c of the loose ones,
    divided by the half width of their image: so all of the design is in pixels.

    The stacked in-plane coordinates of the views of a frame equal [R^-_1; R^-_2; ...] x. Columns Q
    with Q^T [R^-_1; ...] = 0 take the unknown point out: `epipolar` keeps all of them, Eq. (4)
    only those by which the unknown cameras predict the known ones. The third result is the frame
    of each equation.
    """
    designs, targets, places = [], [], []
    for views, frames in _visibility(tracks):
        rows = [rig.cameras[i].rows for i in views]
        if epipolar:
            annihilator = null_space(np.vstack(rows).T, rcond=PARALLEL)
        elif len(views) == len(tracks):
            annihilator = _prediction(rows, np.isin(views, unknown))
        else:
            continue
        blocks = np.split(annihilator, len(views))
        design = np.zeros((len(frames), annihilator.shape[1], unknown.size + loose.size, 2))
        target = np.zeros(design.shape[:2])
        turns, offsets = np.split(design, [unknown.size], axis=2)
        for i, block in zip(views, blocks, strict=True):
            camera, pixels = rig.cameras[i], tracks[i][frames]
            if camera.is_calibrated:
                target -= camera.scale * camera.turned(pixels) @ block
            else:
                # s T(theta) (X, Y) = [[X, Y], [Y, -X]] p
                x, y = camera.centred(pixels).T
                matrix = np.array([[x, y], [y, -x]])
                turns[:, :, unknown == i] = np.einsum("abf,aq->fqb", matrix, block)[:, :, None]
            if camera.is_placed:
                target -= camera.offset @ block
            else:
                offsets[:, :, loose == i] = camera.image_size[0] / 2 * block.T[:, None]
        designs.append(design.reshape(len(frames) * annihilator.shape[1], -1))
        targets.append(target.ravel())
        places.append(np.repeat(frames, target.shape[1]))
    if not designs:
        return np.zeros((0, 2 * (unknown.size + loose.size))), np.zeros(0), np.zeros(0, dtype=int)
    return np.vstack(designs), np.concatenate(targets), np.concatenate(places)


def _outliers(design, target, frames, rig):
    """Frames with an equation that a least-squares fit to all the other frames misses by far.

    Fit and frames are found in turn. The scale of the misses is the median over all frames, so
    that leaving some out never makes others look worse.
    """
    outliers = np.zeros(0, dtype=int)
    for _ in range(20):
        fits = ~np.isin(frames, outliers)
        solution = np.linalg.lstsq(design[fits], target[fits])[0]
        missed = np.abs(design @ solution - target) / _known_scale(rig)
        limit = max(_OUTLIER * 1.4826 * np.median(missed), _ROUNDING) if len(missed) else 0.0
        found = np.unique(frames[missed > limit])
        if np.array_equal(found, outliers):
            break
        outliers = found
    return outliers


def _known_scale(rig):
    """Mean scale of the calibrated cameras, in scene units per pixel."""
    return np.mean([camera.scale for camera in rig.cameras if camera.is_calibrated])


def _known_width(rig):
    """Mean width of what the calibrated cameras see, in scene units."""
    return np.mean([c.scale * c.image_size[0] for c in rig.cameras if c.is_calibrated])


def _unknown(rig):
    """Indices of the cameras without scale and angle."""
    return np.flatnonzero([not camera.is_calibrated for camera in rig.cameras])


def _loose(rig):
    """Indices of the cameras without a position."""
    return np.flatnonzero([not camera.is_placed for camera in rig.cameras])


def _prediction(rows, is_unknown):
    """Columns Q of Eq. (4): R^-_known pinv(R^-_unknown) y_unknown - y_known = 0."""
    known = np.vstack([r for r, flag in zip(rows, is_unknown, strict=True) if not flag])
    others = np.vstack([r for r, flag in zip(rows, is_unknown, strict=True) if flag])
    annihilator = np.zeros((2 * len(rows), len(known)))
    flags = np.repeat(is_unknown, 2)
    annihilator[flags] = (known @ np.linalg.pinv(others)).T
    annihilator[~flags] = -np.eye(len(known))
    return annihilator


def _solve(design, target, rig, unknown, loose):
    """Least-squares s exp(i theta) and offsets, or an error that names what the tracks leave open.

    The design is in pixels: a singular value over sqrt(n) is the motion, in pixels rms, that tells
    one combination of the parameters. Noise on a target that does not move makes 0.6-1.4 times the
    misfit of it, so twice the misfit is asked for.
    """
    wanted = "scale, angle and position" if len(loose) else "scale and angle"
    if len(design) < design.shape[1]:
        raise ValueError(
            f"tracks: frames with common views must give at least {design.shape[1]} equations "
            f"for {wanted} of {_names([*unknown, *loose])}, got {len(design)}"
        )
    solution = np.linalg.lstsq(design, target)[0]
    turned, offsets = solution[: 2 * len(unknown)].view(complex), solution[2 * len(unknown) :]
    scale = np.mean(np.abs(turned)) if len(unknown) else _known_scale(rig)
    misfit = np.sqrt(np.mean((design @ solution - target) ** 2)) / scale if scale > 0 else np.inf
    _, singular, right = np.linalg.svd(design, full_matrices=False)
    motion = singular / np.sqrt(len(design))
    weak = motion <= max(1e-9 * motion[0], 2 * misfit)
    if weak.any():
        share = np.linalg.norm(right[weak].reshape(weak.sum(), -1, 2), axis=(0, 2))
        raise ValueError(
            f"tracks: the target's motion must determine {wanted} of "
            f"{_names(np.array([*unknown, *loose])[share > 0.1])}, got {motion[-1]:.2g} px rms of "
            f"telling motion against a misfit of {misfit:.2g} px (a static target, a wrong "
            "position or normal, videos in another order than the cameras, or of other motions)"
        )
    widths = [rig.cameras[i].image_size[0] for i in loose]
    return turned, offsets.reshape(-1, 2) * np.reshape(widths, (-1, 1)) / 2


def _spread(tracks, rig):
    """s exp(i theta) of the unknown cameras of any kind: from the known ones, round by round.

    Between two perspective cameras that are both unknown, the epipolar constraint is not linear; so
    a camera waits until one that shares frames with it is known.
    """
    start, learned = rig, [i for i, camera in enumerate(rig.cameras) if not camera.is_calibrated]
    while unknown := [i for i in learned if not start.cameras[i].is_calibrated]:
        found, failed = {}, []
        for i in unknown:
            try:
                turned, _ = _solve(*_from_known(tracks, start, i), start, [i], [])
                found[i] = turned[0]
            except ValueError as error:
                failed.append(error)
        if not found:
            raise failed[0]
        start = _calibrate(start, list(found), list(found.values()))
    if not np.isfinite(reconstruct(tracks, start)).any():
        raise ValueError(
            "rig: the lines of sight must meet in front of the perspective cameras, got none that "
            "do (does each normal point from the scene to its camera?)"
        )
    return np.array([start.cameras[i].scale * np.exp(1j * start.cameras[i].angle) for i in learned])


def _from_known(tracks, rig, index):
    """Linear equations for one unknown camera from all known ones."""
    equations = [(np.zeros((0, 2)), np.zeros(0))]
    camera, track = rig.cameras[index], tracks[index]
    for known, other in zip(rig.cameras, tracks, strict=True):
        if known.is_calibrated:
            common = np.isfinite(track).all(axis=1) & np.isfinite(other).all(axis=1)
            equations.append(epipolar_equations(known, other[common], camera, track[common]))
    design, target = zip(*equations, strict=True)
    return np.vstack(design), np.concatenate(target)


def _refine(tracks, rig, turned, offsets):
    """Smallest reprojection error in pixels, searched from s exp(i theta) and offsets."""
    return _closest(
        tracks, lambda p: with_parameters(rig, p), _parameters(rig, turned, offsets)
    )


def _parameters(rig, turned, offsets):
    """What a search varies, all of order one: log s + i theta, and offsets over the image's width.

    As a width counts what the calibrated cameras see.
    """
    return np.concatenate((np.log(turned).view(float), (offsets / _known_width(rig)).ravel()))


def _closest(tracks, candidate, start):
    """The rig `candidate(parameters)` of the smallest reprojection error in pixels."""

    def missed(parameters):
        return np.hstack(residuals(tracks, candidate(parameters)))

    used = np.isfinite(missed(start))  # the same ones throughout
    fit = least_squares(
        lambda parameters: missed(parameters)[used], start, ftol=1e-15, xtol=1e-15, gtol=1e-15
    )
    return candidate(fit.x)


def _descend(design, target, rig, unknown):
    """Eq. (4) by gradients: L-BFGS in (s, theta) from the calibrated camera's scale and no turn."""
    import torch  # slow to import, and only this comparison needs it

    start = _known_scale(rig)
    unit = np.abs(design).mean()  # makes the unknowns of order one
    design, target = torch.tensor(design / unit), torch.tensor(target / (unit * start))
    scale = torch.ones(unknown.size, dtype=torch.float64, requires_grad=True)
    angle = torch.zeros(unknown.size, dtype=torch.float64, requires_grad=True)
    optimiser = torch.optim.LBFGS(
        [scale, angle],
        max_iter=500,
        tolerance_grad=1e-15,
        tolerance_change=1e-18,
        line_search_fn="strong_wolfe",
    )

    def loss():
        optimiser.zero_grad()
        turned = torch.stack((scale * torch.cos(angle), scale * torch.sin(angle)), dim=1)
        value = torch.mean((design @ turned.ravel() - target) ** 2)
        value.backward()
        return value

    optimiser.step(loss)
    return start * scale.detach().numpy() * np.exp(1j * angle.detach().numpy())


def _calibrate(rig, unknown, turned):
    """The rig with s exp(i theta) = `turned` written into its unknown cameras."""
    cameras = list(rig.cameras)
    for i, value in zip(unknown, turned, strict=True):
        cameras[i] = replace(cameras[i], scale=abs(value), angle=np.angle(value))
    return Rig(cameras)


def _visibility(tracks):
    """Groups of frames with the same two or more views: pairs (cameras, frames) of indices."""
    seen = np.column_stack([np.isfinite(track).all(axis=1) for track in tracks])
    patterns, group = np.unique(seen, axis=0, return_inverse=True)
    return [
        (np.flatnonzero(pattern), np.flatnonzero(group == g))
        for g, pattern in enumerate(patterns)
        if pattern.sum() >= 2
    ]


def _independent(cameras):
    """Whether two of the cameras look along different lines: do all have the same centre?

    The centre is the pinhole, or a point at infinity in the direction of an orthographic normal.
    """
    normals = np.array([c.normal for c in cameras if c.model == OrthographicCamera.model])
    pinholes = np.array([c.position for c in cameras if c.model != OrthographicCamera.model])
    if len(normals) < 2 and len(pinholes) < 2:
        return len(normals) == len(pinholes) == 1
    apart = len(pinholes) > 1 and np.ptp(pinholes, axis=0).max() > 1e-9 * np.abs(pinholes).max()
    turned = len(normals) > 1 and np.linalg.svd(normals, compute_uv=False)[1] > PARALLEL
    return bool(apart or turned or (len(normals) and len(pinholes)))


def _require_all_calibrated(name, cameras):
    for i, camera in enumerate(cameras):
        if not camera.is_calibrated:
            raise ValueError(
                f"{name}: all cameras must be calibrated, got cameras[{i}] without scale and "
                "angle; use learn_cameras first"
            )
        if not camera.is_placed:
            raise ValueError(
                f"{name}: all cameras must have a position, got cameras[{i}] without; use "
                "learn_cameras first"
            )


def _check_tracks(tracks, rig):
    check_instance("rig", rig, Rig)
    tracks = check_tracks(tracks, len(rig.cameras))
    lengths = [len(track) for track in tracks]
    if len(set(lengths)) > 1:
        raise ValueError(f"tracks: must have the same number of frames, got {lengths}")
    for i, track in enumerate(tracks):
        unseen = np.isnan(track).any(axis=1, keepdims=True)
        tracks[i] = np.where(unseen, np.nan, track)  # half a pixel tells nothing
        if unseen.all():
            raise ValueError(f"tracks[{i}]: must see the target in some frame, got only NaN rows")
    return tracks


def _to_table(camera):
    """A camera as plain numbers under the keys of the file; None is left out."""
    table = {} if camera.model == OrthographicCamera.model else {"model": camera.model}
    if camera.is_placed:
        table["position"] = camera.position.tolist()
    table["normal"] = camera.normal.tolist()
    if camera.is_calibrated:
        table |= {"scale": camera.scale, "angle": camera.angle}
    return table | {"image_size": list(camera.image_size)}


def _from_table(index, table):
    keys = ["model", *(field.name for field in fields(Camera))]
    try:
        if not isinstance(table, dict):
            raise ValueError(f"must be a table, got {table!r}")
        for key in table:
            if key not in keys:
                raise ValueError(f"{key}: must be one of {', '.join(keys)}")
        if "normal" not in table:
            raise ValueError(f"normal: must be given, got keys {', '.join(table)}")
        model = table.get("model", OrthographicCamera.model)
        if model not in MODELS:
            raise ValueError(f"model: must be one of {', '.join(MODELS)}, got {model!r}")
        return MODELS[model](**{key: value for key, value in table.items() if key != "model"})
    except ValueError as error:
        raise ValueError(f"camera {index}: {error}") from error


def _names(indices):
    return " and ".join(f"cameras[{i}]" for i in indices)
