"""Rigs: the cameras that watch one scene, their file and its template, and the path that they see.

A camera sees the point x at the pixel x_c (from the middle of the image, y up) with

    s T(theta) x_c = (X, Y) / W,        (X, Y, W) = matrix @ (x, 1).

For known s and theta these are two linear equations for x, the line of sight: `intersect`. For
known x on some other camera's line of sight they leave one linear equation for
(s cos theta, s sin theta), the epipolar one: `epipolar_lines` and `epipolar_rows`. None of them
asks which model of camera it is.

A file holds one [[camera]] table per video, whose keys are the arguments of its model of camera,
and model unless it is orthographic; target is a hint for the tracker, e.g. {frame = 10, box =
[120, 80, 24, 24]}. Without scale and angle, or position, these are learned
(`learn_cameras`); of the other keys, what is left out has its default. Perspective cameras, three
or more, may leave out position and normal, all of them: then `distance`, before the first table, is
how far the first is from the second.

Paper: Eq. (6).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Bools, Floats, Ints
from ..checks import (
    check_choice,
    check_image_size,
    check_instance,
    check_integer,
    check_items,
    check_number,
    check_output,
    check_positive,
    check_rows,
    check_tracks,
    check_vector,
    shown,
)
from ..storage import check_file, read_tree, reading, write_file
from .models import (
    MODELS,
    PARALLEL,
    Camera,
    OrthographicCamera,
    PerspectiveCamera,
    independent,
    rotation_to_z,
)

DISAGREEMENT = 1.0
"""Pixels by which a good rig misses at most one frame in ten; even whole-pixel tracks are missed by
less than half of that."""
ALIKE = 2.0
"""Ratio of residuals up to which two explanations fit equally well, ..."""
FINE = 0.05
"""... and residual in pixels below which all do: real tracks are no better than that."""
GROSS = 4.0
"""Pixels; real calibrations of real tracks leave up to half of that."""
_FEWEST = 3  # cameras of which nothing is measured
_MOST = 100  # cameras of a template
_HEAD = """\
# Rig file: one [[camera]] table per video, in the order of the videos.
# Choose an origin, axes (z up) and a unit of length (here: metres) and replace every number.
"""
_STILL = """\
# Cameras stand still. What is left out is learned from the videos, but for one camera at least
# scale and angle must be given.
"""
_MEASURED = """\
# Cameras stand still. Errors are those of a tape and of the eye: one standard deviation each; the
# videos then tell better. Without its error, a number is taken as exact.
"""
_SCALE = "scale = 0.005    # scene units per pixel: length of an object over its pixels"
_ANGLE = """\
angle = {angle:.3f}    # radians: for this normal and the z axis upright in the image; add how
                  # far the z axis is turned anticlockwise there"""
_BY_HAND = """\
looks_at = [0.000, 0.000, 0.000]    # what stands in the middle of its image (or give normal)
field_of_view = 60    # degrees across the width of the video (or give scale and angle)
roll = 0    # degrees by which the z axis leans to the left in its image; 0 for a level camera
position_error = 0.03    # metres in each direction
normal_error = 2    # degrees, of where it looks and of its roll
scale_error = 0.03    # share of the focal length: 3 %"""
_LOOKS = ("looks_at", "field_of_view", "roll")  # keys that a hand can measure

TRIMMED = 0.9
"""Share of the instants that must agree; the others may hold anything."""
_STEPS = 30  # of Gauss and Newton; from the linear solution four or five are usual
_SETTLED = 1e-11  # pixels


@dataclass(frozen=True)
class Rig:
    """Cameras that watch one scene in one reference frame.

    Parameters
    ----------
    cameras : sequence of Camera
        One, before a motion in a plane. Or more, orthographic or perspective, that do not all look
        along the same lines: two orthographic normals must not be parallel, or two pinholes not
        coincide, or there is one camera of each kind. Or three or more perspective ones without
        position and normal.
    warnings : tuple of str, optional
        What `learn_cameras` has to say of the cameras that it learned. Not part of a file, nor of
        what makes two rigs equal.
    note : str, optional
        In which frame the cameras are, where that was found and not given; as the warnings.
    distance : float, optional
        Of the first camera and the second, if nothing else is measured: what gives the path its
        unit of length.

    Raises
    ------
    ValueError
        If there is no camera, or all of several look along the same lines.
    """

    cameras: tuple[Camera, ...]
    warnings: tuple[str, ...] = field(default=(), compare=False)
    note: str = field(default="", compare=False)
    distance: float | None = None

    def __post_init__(self) -> None:
        cameras = check_items("cameras", self.cameras)
        object.__setattr__(self, "cameras", cameras)
        object.__setattr__(self, "warnings", check_items("warnings", self.warnings))
        for i, camera in enumerate(cameras):
            check_instance(f"cameras[{i}]", camera, Camera)
        if not cameras:
            raise ValueError("cameras: must be one or more, got none")
        self._check_measured()
        if len(cameras) > 1 and self.is_measured and not independent(cameras):
            kind = "normal" if isinstance(cameras[0], OrthographicCamera) else "position"
            raise ValueError(
                f"cameras: must have at least two independent {kind}s, got only "
                f"{[getattr(camera, kind).tolist() for camera in cameras]}"
            )

    def _check_measured(self) -> None:
        """That of perspective cameras all have a place, or none; a distance is for the latter."""
        loose = [not isinstance(c, OrthographicCamera) and not c.is_placed for c in self.cameras]
        if any(loose) and not all(loose):
            raise ValueError(
                "cameras: must all have a position, or none if all are perspective, got none of "
                f"cameras[{loose.index(True)}]"
            )
        if all(loose) and len(loose) < _FEWEST:
            raise ValueError(
                f"cameras: must be {_FEWEST} or more if nothing is measured of where they stand, "
                f"got {len(loose)}"
            )
        if self.distance is not None:
            if self.is_measured:
                raise ValueError(
                    "distance: must not be given with positions, which tell the unit of length, "
                    f"got {shown(self.distance)}"
                )
            object.__setattr__(self, "distance", check_positive("distance", self.distance))

    @property
    def is_measured(self) -> bool:
        """Whether something is known of where the cameras stand, or where they look."""
        return any(isinstance(c, OrthographicCamera) or c.is_placed for c in self.cameras)

    @classmethod
    def around(cls, x: ArrayLike, image_size: tuple[int, int] = (512, 512)) -> Rig:
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
        points = check_rows("x", x, 3)
        points = points[~np.isnan(points).any(axis=1)]
        if len(np.unique(points, axis=0)) < 2:
            raise ValueError(
                "x: must hold at least two different points, got "
                f"{len(np.unique(points, axis=0))} without NaN in shape {np.shape(x)}"
            )
        low, high = points.min(axis=0), points.max(axis=0)
        middle, reach = (low + high) / 2, np.linalg.norm(high - low)
        half = (np.array(check_image_size(image_size, least=2)) - 1) / 2
        cameras = []
        for azimuth, elevation, roll in np.deg2rad([[20, 20, 6], [140, 15, -9], [260, 25, 14]]):
            normal, upright = _looking_down(azimuth, elevation)
            camera = OrthographicCamera(
                position=middle + reach * normal,
                normal=normal,
                scale=1.0,
                angle=upright + roll,
                image_size=image_size,
            )
            extent = np.max(np.abs(camera.centred(camera.image(points))) / half)
            # The outermost point comes to 85 % of the half image: room for the target's size.
            cameras.append(replace(camera, scale=extent / 0.85))
        return cls(tuple(cameras))

    @classmethod
    def load(cls, path: str | os.PathLike) -> Rig:
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
        file = check_file("rig", path)
        content = read_tree("rig", file, ".toml")
        tables = content.get("camera")
        if not content.keys() <= {"camera", "distance"} or not isinstance(tables, list):
            raise ValueError(
                "rig: must hold [[camera]] tables and at most a distance, got "
                f"{shown(sorted(content))} in '{path}'"
            )
        with reading("rig", file):
            cameras = tuple(_from_table(i, table) for i, table in enumerate(tables))
            return cls(cameras, distance=content.get("distance"))

    def save(self, path: str | os.PathLike) -> None:
        """Write the rig to a TOML file, from which `load` gives back exactly this rig.

        Parameters
        ----------
        path : path-like
            Overwritten if it exists.

        Raises
        ------
        ValueError
            If the file cannot be there: it is a folder, or its folder does not exist.
        """
        write_file(check_output("path", path), self.text().encode())

    def text(self) -> str:
        """What `save` writes."""
        lines = [
            "# Cameras of a rig; scale in scene units per pixel (of a perspective camera: at "
            "distance 1), angle in radians."
        ]
        if self.note:
            lines += [f"# Frame: {self.note}."]
        if self.distance is not None:
            lines += [f"distance = {self.distance!r}"]
        for camera in self.cameras:
            lines += ["", "[[camera]]"]
            # repr of a float is its shortest exact decimal form, and valid TOML.
            lines += [f"{key} = {value!r}" for key, value in _to_table(camera).items()]
        return "\n".join(lines) + "\n"

    def uncalibrated(self, keep: int = 0) -> Rig:
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
        cameras = [replace(camera, scale=None, angle=None) for camera in self.cameras]
        cameras[keep] = self.cameras[keep]
        return Rig(tuple(cameras))


def reconstruct(tracks: Sequence[Floats], rig: Rig) -> Floats:
    """3D trajectory from the tracks of a calibrated rig, by least squares in pixels.

    Paper: Eq. (6), whose "inverse" of a 6 x 3 matrix is the least-squares solution; here with any
    number of cameras, of either model, and each view weighted so that all count in pixels.

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
    check_calibrated("rig", rig)
    return intersect(rig.cameras, check_views(tracks, rig))[0]


def residuals(tracks: Sequence[Floats], rig: Rig) -> list[Floats]:
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
    check_calibrated("rig", rig)
    return missed(rig.cameras, check_views(tracks, rig))


def disagreement(tracks: Sequence[Floats], rig: Rig) -> list[float]:
    """Residual in pixels that one frame in ten exceeds, per camera.

    That tenth may hold anything: a few outliers of the tracker do not accuse the rig.

    Parameters
    ----------
    tracks, rig
        See `residuals`.

    Returns
    -------
    list of float
        Pixels; zero for a camera that takes part in no point.
    """
    return [trimmed(part) for part in residuals(tracks, rig)]


def check_seen(tracks: Sequence[Floats], rig: Rig) -> list[Floats]:
    """That there is one track per camera of the rig, each of which sees the target."""
    check_instance("rig", rig, Rig)
    checked = check_tracks(tracks, len(rig.cameras))
    for i, track in enumerate(checked):
        if np.isnan(track).any(axis=1).all():
            raise ValueError(f"tracks[{i}]: must see the target in some frame, got only NaN rows")
    return checked


def check_views(tracks: Sequence[Floats], rig: Rig) -> list[Floats]:
    """That the tracks fit the rig, and each other in length; half a pixel tells nothing."""
    checked = check_seen(tracks, rig)
    lengths = [len(track) for track in checked]
    if len(set(lengths)) > 1:
        raise ValueError(f"tracks: must have the same number of frames, got {lengths}")
    seen = [np.isfinite(track).all(axis=1, keepdims=True) for track in checked]
    whole = [np.where(rows, track, np.nan) for rows, track in zip(seen, checked, strict=True)]
    return at_once(rig.cameras, whole)


def check_calibrated(name: str, rig: Rig) -> None:
    """That scale, angle and position of all cameras are known."""
    check_instance(name, rig, Rig)
    for i, camera in enumerate(rig.cameras):
        known = {"scale and angle": camera.is_calibrated, "position": camera.is_placed}
        for what, given in known.items():
            if not given:
                raise ValueError(
                    f"{name}: all cameras must be calibrated and placed, got cameras[{i}] without "
                    f"{what}; learn_cameras finds them, as the command discover does, which writes "
                    "them to rig.toml in its report"
                )


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


def rig_template(
    cameras: int = 3, model: str = "perspective", image_size: tuple[int, int] = (1920, 1080)
) -> str:
    """Text of a rig file, to be filled in with what was measured.

    Parameters
    ----------
    cameras : int
        Between 2 and 100, evenly around the scene, looking 20 degrees down on its origin from a
        distance of three units.
    model : {"perspective", "orthographic"}
        Of all cameras.
    image_size : tuple of int
        Width and height of the videos in pixels.

    Returns
    -------
    str
        A file that `Rig.load` reads.

    Raises
    ------
    ValueError
        If an argument breaks its rule.
    """
    if check_integer("cameras", cameras, 2) > _MOST:
        raise ValueError(f"cameras: must be at most {_MOST}, got {cameras}")
    check_choice("model", model, [OrthographicCamera.model, PerspectiveCamera.model])
    width, height = check_image_size(image_size)
    flat = model == OrthographicCamera.model
    parts = [_HEAD + (_STILL if flat else _MEASURED)]
    for i in range(cameras):
        # Of two cameras, one is a third of a turn from the other: face to face both see the same.
        azimuth = 2 * np.pi * i / max(cameras, 3) + np.deg2rad(20)
        normal, upright = _looking_down(azimuth, np.deg2rad(20))
        place, size = f"position = [{decimals(3 * normal)}]", f"image_size = [{width}, {height}]"
        if flat:
            lines = [
                f"{place}    # of the camera, or a landmark in the middle of its image",
                f"normal = [{decimals(normal)}]    # from the scene to the camera; any length",
                size,
                *((_SCALE, _ANGLE.format(angle=upright)) if i == 0 else ()),
            ]
        else:
            lines = [f'model = "{model}"', f"{place}    # of its lens", size, _BY_HAND]
        parts.append("\n".join(["[[camera]]", *lines]) + "\n")
    return "\n".join(parts)


def _looking_down(azimuth: float, elevation: float) -> tuple[Floats, float]:
    """Normal of a camera so high above the scene, and the angle at which R^- e_z is up in it."""
    away = np.array([np.cos(azimuth), np.sin(azimuth), 0])
    normal = np.cos(elevation) * away + [0, 0, np.sin(elevation)]
    return normal, np.arctan2(-np.cos(azimuth), -np.sin(azimuth))


def _by_hand(table: dict[str, Any], model: str) -> dict[str, Any]:
    """A table with normal, scale and angle in place of what a hand measures."""
    known = {key: value for key, value in table.items() if key not in _LOOKS}
    if "looks_at" in table:
        if "normal" in table or "position" not in table:
            raise ValueError("looks_at: must be given with a position and without a normal")
        position = check_vector("position", table["position"], 3)
        known["normal"] = position - check_vector("looks_at", table["looks_at"], 3)
    if "field_of_view" in table:
        if model == OrthographicCamera.model or "scale" in table or "angle" in table:
            raise ValueError(
                "field_of_view: must be given in place of scale and angle, perspective"
            )
        width = check_image_size(table.get("image_size", Camera.image_size))[0]
        across = check_number("field_of_view", table["field_of_view"])
        if not 0 < across < 180:
            raise ValueError(f"field_of_view: must be between 0 and 180 degrees, got {across:g}")
        known["scale"] = 2 * np.tan(np.deg2rad(across) / 2) / width
        roll = check_number("roll", table.get("roll", 0.0))
        if "normal" in known:
            x, y = rotation_to_z(known["normal"])[:2, 2]
            known["angle"] = float(np.arctan2(x, y) + np.deg2rad(roll))
    elif "roll" in table:
        raise ValueError("roll: must be given with a field_of_view")
    return known


def decimals(values: Floats) -> str:
    """Three decimals of each number."""
    return ", ".join(f"{value:.3f}" for value in values)


def _to_table(camera: Camera) -> dict[str, object]:
    """A camera as plain numbers under the keys of the file; defaults are left out."""
    known = {} if type(camera) is OrthographicCamera else {"model": camera.model}
    for part in fields(camera):
        value = getattr(camera, part.name)
        default = isinstance(value, float) and value == part.default
        if value is not None and not default:
            known[part.name] = value
    if not isinstance(camera, OrthographicCamera) and not camera.is_placed:
        known = {key: value for key, value in known.items() if key not in ("normal", "angle")}
    return {key: np.asarray(value).tolist() for key, value in known.items()}


def _from_table(index: int, table: object) -> Camera:
    """A camera from a table of a file; errors say which."""
    try:
        if not isinstance(table, dict):
            raise ValueError(f"must be a table, got {table!r}")
        known = dict(table)
        model = known.pop("model", OrthographicCamera.model)
        known.pop("target", None)  # for the tracker
        check_choice("model", model, [*MODELS])
        keys = ["model", "target", *(part.name for part in fields(MODELS[model])), *_LOOKS]
        for key in table:
            if key not in keys:
                raise ValueError(f"{key}: must be one of {', '.join(keys)}")
        known = _by_hand(known, model)
        if "normal" not in known and (model == OrthographicCamera.model or "position" in known):
            raise ValueError(f"normal: must be given, got keys {', '.join(table)}")
        return MODELS[model](**known)
    except ValueError as error:
        raise ValueError(f"camera {index}: {error}") from error
