"""Rigs: the cameras that watch one scene, their files, ours and those of other tools, and the path.

Our file holds one [[camera]] table per video, whose keys are the arguments of its model of camera,
and model unless it is orthographic; target is a hint for the tracker, e.g. {frame = 10, box =
[120, 80, 24, 24]}. Without scale and angle, or position, these are learned
(`learn_cameras`); of the other keys, what is left out has its default. Perspective cameras, three
or more, may leave out position and normal, all of them: then `distance`, before the first table, is
how far the first is from the second.

What the calibrations of other tools have in common is OpenCV's camera: a point X of the scene is
seen at the pixel of K (R X + t), bent by the lens, x to the right, y down and z forward. Its centre
is -R' t, our normal is minus the third row of R, our scale 1 / fx. Understood are::

    .toml              Anipose, Pose2Sim, Caliscope: a table per camera with matrix, distortions,
                       rotation (of Rodrigues, or a matrix), translation and size
    .yaml .xml .json   OpenCV's FileStorage, and plain JSON: K, dist, R or rvec, t, size under any
                       of their usual names, one camera per file or several
    .npz               the same names
    .csv .txt .npy     11 DLT coefficients per camera, a column each (DLTdv, Argus, easyWand), or
                       projection matrices of 3 x 4, one below the other

DLT coefficients count pixels from 1, from the upper left (DLTdv8) or, if their image is mirrored,
which the determinant tells, from the lower left (earlier ones). What a table says of a lens that is
none of ours is refused; a camera that is to be ignored is left out, and that is told, as are keys
of which nothing is known.

Paper: Eq. (6). Hartley & Zisserman 2004, "Multiple View Geometry", 6.2; Abdel-Aziz & Karara 1971
(DLT).
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import chain, combinations
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..arrays import Bools, Floats
from ..checks import (
    check_array,
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
from ..storage import TREES, check_file, read_arrays, read_text, read_tree, reading, write_file
from . import models
from .models import Camera, OrthographicCamera, PerspectiveCamera

#: Pixels by which a good rig misses at most one frame in ten; even whole-pixel tracks are missed by
#: less than half of that.
DISAGREEMENT = 1.0
ALIKE = 2.0  #: Ratio of residuals up to which two explanations fit equally well, ...
FINE = 0.05  #: ... and residual in pixels below which all do: real tracks are no better than that.
BETTER = 1.25  #: Ratio of residuals from which on more unknowns are worth it.
GROSS = 4.0  #: Pixels; real calibrations of real tracks leave up to half of that.
_FEWEST = 3  # cameras of which nothing is measured
_MOST = 100  # cameras of a template
_ROUNDED = 1e-5  # by which a rotation may be off in a calibration file
_NARROWEST = 5.0  # degrees: less is rather meant in radians
_LOOKS = ("looks_at", "field_of_view", "roll")  # keys that a hand can measure
_TEXTS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
_KEYS: dict[str, Any] = _TEXTS["keys"]
_NAMES: dict[str, list[str]] = _KEYS["names"]
# Keys that mark a camera as one to be left out: if they are set, or if they are not.
_MARKS = dict.fromkeys(_KEYS["ignored"], True) | dict.fromkeys(_KEYS["used"], False)
# Keys that say which lens it is.
_LENS = re.compile(r"model|lens|projection_?type|^camera_?type")
_LENSES = f"of {', '.join(models.LENS)}"
# Keys that are read, and those that change nothing of what a camera sees.
_KNOWN = {*chain(_KEYS["known"], _MARKS, *_KEYS["sides"], *_NAMES.values())}


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
        if len(cameras) > 1 and self.is_measured and not models.independent(cameras):
            kind = "normal" if isinstance(cameras[0], OrthographicCamera) else "position"
            raise ValueError(
                f"cameras: must have at least two independent {kind}s, got only "
                f"{[getattr(camera, kind).tolist() for camera in cameras]}"
            )

    def _check_measured(self) -> None:
        """That of perspective cameras all have a place, or none; a distance is for the latter."""
        loose = [not camera.is_measured for camera in self.cameras]
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
        return any(camera.is_measured for camera in self.cameras)

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
        different = len(np.unique(points, axis=0))
        if different < 2:
            raise ValueError(
                f"x: must hold at least two different points, got {different} without NaN in "
                f"shape {np.shape(x)}"
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
            lines += [f"{key} = {value!r}" for key, value in camera.table.items()]
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


def paced(rig: Rig, rates: Floats) -> Rig:
    """The rig with its shutters told in other frames: so many of each camera's own in one."""
    return replace(rig, cameras=tuple(
        camera.moved(readout=camera.readout / rate, readout_error=camera.readout_error / rate)
        for camera, rate in zip(rig.cameras, rates, strict=True)
    ))  # fmt: skip


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
    return models.intersect(rig.cameras, check_views(tracks, rig))


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
    return models.missed(rig.cameras, check_views(tracks, rig))


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
    return [models.trimmed(part) for part in residuals(tracks, rig)]


def without_view_outliers(tracks: Sequence[Floats], rig: Rig) -> tuple[list[Floats], Bools]:
    """Tracks without the places that the other views contradict, and which these are, (n, m).

    In each of the few frames that are missed by far more than most, the view is left out without
    which the others agree; all are, where no view alone is to blame. Where such frames are not few,
    it is the rig that is wrong, and none is.

    Parameters
    ----------
    tracks, rig
        See `residuals`.
    """
    views = check_views(tracks, rig)

    def off(views: Sequence[Floats]) -> Floats:
        return np.fmax.reduce([np.hypot(*part.T) for part in models.missed(rig.cameras, views)])

    whole, outliers = off(views), np.zeros((len(views[0]), len(views)), dtype=bool)
    limit = max(8.0 * float(np.nanmedian(whole)), GROSS)
    rows = np.flatnonzero(whole > limit)
    if 10 * len(rows) <= np.isfinite(whole).sum():  # the share that `disagreement` leaves aside
        ways = range(len(views))
        left = [off([np.where(k == i, np.nan, views[k][rows]) for k in ways]) for i in ways]
        agree = np.array(left) <= limit
        outliers[rows] = np.where(agree.sum(axis=0) == 1, agree, True).T
    return [np.where(outliers[:, [i]], np.nan, track) for i, track in enumerate(tracks)], outliers


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
    whole = [np.where(np.isfinite(t).all(axis=1, keepdims=True), t, np.nan) for t in checked]
    return models.at_once(rig.cameras, whole)


def check_calibrated(name: str, rig: Rig) -> None:
    """That scale, angle and position of all cameras are known."""
    check_instance(name, rig, Rig)
    for i, camera in enumerate(rig.cameras):
        if not (camera.is_calibrated and camera.is_placed):
            what = "position" if camera.is_calibrated else "scale and angle"
            raise ValueError(
                f"{name}: all cameras must be calibrated and placed, got cameras[{i}] without "
                f"{what}; learn_cameras finds them, as the command discover does, which writes "
                "them to rig.toml in its report"
            )


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
    template = _TEXTS["template"][model]
    text = template["head"]
    for i in range(cameras):
        # Of two cameras, one is a third of a turn from the other: face to face both see the same.
        azimuth = 2 * np.pi * i / max(cameras, 3) + np.deg2rad(20)
        normal, upright = _looking_down(azimuth, np.deg2rad(20))
        text += (template["camera"] + ("" if i else template["first"])).format(
            place=decimals(3 * normal), normal=decimals(normal), angle=upright, width=width,
            height=height,
        )  # fmt: skip
    return str(text)


def _looking_down(azimuth: float, elevation: float) -> tuple[Floats, float]:
    """Normal of a camera so high above the scene, and the angle at which R^- e_z is up in it."""
    away = np.array([np.cos(azimuth), np.sin(azimuth), 0])
    normal = np.cos(elevation) * away + [0, 0, np.sin(elevation)]
    return normal, np.arctan2(-np.cos(azimuth), -np.sin(azimuth))


def _by_hand(known: dict[str, Any], model: str) -> dict[str, Any]:
    """A table with normal, scale and angle in place of what a hand measures."""
    aim, across, roll = (known.pop(key, None) for key in _LOOKS)
    if aim is not None:
        if "normal" in known or "position" not in known:
            raise ValueError("looks_at: must be given with a position and without a normal")
        position = check_vector("position", known["position"], 3)
        known["normal"] = position - check_vector("looks_at", aim, 3)
        if not known["normal"].any():
            raise ValueError(f"looks_at: must be another place than the position, got {aim}")
    if across is not None:
        if model == OrthographicCamera.model or "scale" in known or "angle" in known:
            raise ValueError(
                "field_of_view: must be given in place of scale and angle, perspective"
            )
        width = check_image_size(known.get("image_size", Camera.image_size))[0]
        if not _NARROWEST <= check_number("field_of_view", across) < 180:
            raise ValueError(
                f"field_of_view: must be between {_NARROWEST:g} and 180 degrees (not radians; of a "
                f"longer lens give scale and angle), got {across:g}"
            )
        known["scale"] = 2 * np.tan(np.deg2rad(across) / 2) / width
        leans = check_number("roll", 0.0 if roll is None else roll)
        if "normal" in known:
            x, y = models.rotation_to_z(known["normal"])[:2, 2]
            known["angle"] = float(np.arctan2(x, y) + np.deg2rad(leans))
    elif roll is not None:
        raise ValueError("roll: must be given with a field_of_view")
    return known


def decimals(values: Floats) -> str:
    """Three decimals of each number."""
    return ", ".join(f"{value:.3f}" for value in values)


def _from_table(index: int, table: object) -> Camera:
    """A camera from a table of a file; errors say which."""
    try:
        if not isinstance(table, dict):
            raise ValueError(f"must be a table, got {table!r}")
        known = dict(table)
        model = known.pop("model", OrthographicCamera.model)
        known.pop("target", None)  # for the tracker
        check_choice("model", model, [*models.MODELS])
        keys = ["model", "target", *(part.name for part in fields(models.MODELS[model])), *_LOOKS]
        for key in table:
            if key not in keys:
                raise ValueError(f"{key}: must be one of {', '.join(keys)}")
        known = _by_hand(known, model)
        if "normal" not in known and (model == OrthographicCamera.model or "position" in known):
            raise ValueError(f"normal: must be given, got keys {', '.join(table)}")
        return models.MODELS[model](**known)
    except ValueError as error:
        raise ValueError(f"camera {index}: {error}") from error


# ------------------------------------------------------------------------------- other tools' files


def read_calibration(
    paths: Sequence[str | os.PathLike], image_size: tuple[int, int] | None = None
) -> Rig:
    """A rig from the calibration files of other tools.

    Parameters
    ----------
    paths : sequence of path
        In the order of the videos; see the module for the formats.
    image_size : tuple of int, optional
        Width and height of the videos in pixels, if the files do not say.

    Returns
    -------
    Rig
        Of perspective cameras. Its warnings say what was left out: the skew of DLT coefficients.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If a file is none of these, or holds no calibration; names file, camera and key.
    """
    size = None if image_size is None else check_image_size(image_size)
    cameras: list[PerspectiveCamera] = []
    warnings: list[str] = []
    for given in check_items("paths", paths, of="file"):
        path = check_file("paths", given, "calibration file")
        content, told = _content(path), list[str]()
        with reading("paths", path):
            found = list(_cameras(content, size, told))
        if not found:
            raise ValueError(
                "paths: must hold a camera matrix (K), DLT coefficients or P, got "
                f"{shown([*content])} in '{path}'"
            )
        cameras += found
        warnings += [f"{path.name}: {one}" for one in told]
    return Rig(tuple(cameras), tuple(warnings))


def _content(path: Path) -> Any:
    """A file as mappings and lists, or as an array of numbers."""
    suffix = path.suffix.lower()
    if suffix in TREES:
        return read_tree("paths", path, suffix)
    if suffix in (".npy", ".npz"):
        return read_arrays("paths", path)
    if suffix in (".csv", ".txt"):
        text = read_text("paths", path, "a table")
        comma = "." if re.search(r";[ \t]*[-+\d]", text) else " "  # as spreadsheets write decimals
        lines = re.sub("#.*", "", text).replace(",", comma).replace(";", " ").splitlines()
        with reading("paths", path, "rows of as many numbers each"):
            rows = [line.split() for line in lines if line.strip()]
            if len(lengths := {len(row) for row in rows}) > 1:
                raise ValueError(f"{min(lengths)} numbers in one, and {max(lengths)} in another")
            return np.array(rows, dtype=float)
    raise ValueError(
        "paths: must end in .toml, .yaml, .yml, .xml, .json, .npz, .npy, .csv or .txt, got "
        f"'{path}'"
    )


def _cameras(
    content: Any, size: tuple[int, int] | None, warnings: list[str]
) -> Iterator[PerspectiveCamera]:
    """The cameras of a file."""
    alone = isinstance(content, np.ndarray)
    for name, table in [("", {"P": content})] if alone else _tables(content, "", warnings):
        try:
            table["size"] = _size_of(table, size)
            parts = [table] if "K" in table else _decomposed(table, name, warnings)
            yield from map(_camera, parts)
        except ValueError as error:
            raise ValueError(f"{name}{error}") from None


def _size_of(table: dict[str, Any], given: tuple[int, int] | None) -> tuple[int, int]:
    """Width and height that a table states, or that are given."""
    stated = table.get("size", given)
    if stated is None:
        raise ValueError("image_size: must be given (--size WxH), as this file does not say")
    width, height = _shaped("size", stated, (2,))
    size = check_image_size((round(width), round(height)))
    if given not in (None, size):
        raise ValueError(f"size: must be the image_size that is given, {given}, got {size}")
    return size


def _tables(content: Any, name: str, warnings: list[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """All parts of a file that describe a camera, in its order: their names, and our keys' values.

    Names end in ": ", as they stand before what is wrong.
    """
    if isinstance(content, list):
        for i, part in enumerate(content):
            yield from _tables(part, f"{name or 'camera '}[{i}]: ".replace(": [", "["), warnings)
    if not isinstance(content, Mapping):
        return
    lower = {str(key).lower(): value for key, value in content.items() if value is not None}
    for part in ("intrinsics", "extrinsics"):
        if isinstance(lower.get(part), Mapping):
            lower |= {str(key).lower(): value for key, value in lower.pop(part).items()}
    given = {ours: [key for key in keys if key in lower] for ours, keys in _NAMES.items()}
    known = {ours: lower[keys[0]] for ours, keys in given.items() if keys}
    is_camera = "K" in known or "P" in known
    ignored = [key for key in lower if key in _MARKS and _is_set(lower[key]) == _MARKS[key]]
    if ignored:
        warnings.append(f"{name}{ignored[0]} = {shown(lower[ignored[0]])}: this camera is left out")
        return
    for key, value in lower.items():
        if _is_set(value):
            _check_lens(key, value, name, warnings if is_camera else [])
    if not is_camera:
        for key, part in content.items():
            yield from _tables(part, f"camera {key}: ", warnings)
        return
    for one, other in chain.from_iterable(combinations(keys, 2) for keys in given.values()):
        if not np.array_equal(lower[one], lower[other]):
            told = " and ".join(shown(lower[key]) for key in (one, other))
            raise ValueError(f"{name}{one}: must be the same as {other}, got {told}")
    sides = next((sides for sides in _KEYS["sides"] if set(sides) <= set(lower)), ())
    if sides and "size" not in known:
        known["size"] = [lower[side] for side in sides]
    strange = [
        key for key in lower if not (key in _KNOWN or _LENS.search(key)) and _is_set(lower[key])
    ]
    if strange:
        warnings.append(f"{name}nothing is known of {', '.join(strange):.80}, which is left out")
    if np.ndim(known.get("K", 0)) < 3:
        yield name, known
        return
    stacked = {key: value for key, value in known.items() if np.ndim(value) > 1}
    counts = {key: len(value) for key, value in stacked.items()}
    if len(set(counts.values())) > 1:
        raise ValueError(f"{name}K: must be as many as all else of the cameras, got {counts}")
    for parts in zip(*stacked.values(), strict=True):
        yield name, known | dict(zip(stacked, parts, strict=True))


def _is_set(value: Any) -> bool:
    """Whether a value says yes: neither zero, nor empty, nor a word for no."""
    if isinstance(value, str):
        return value.strip().lower() not in ("", "0", "false", "no", "none", "off", "null")
    return value is not None and (not np.isscalar(value) or bool(value))


def _check_lens(key: str, value: Any, name: str, warnings: list[str]) -> None:
    """Refuse a key that says of another lens than ours, or of turned pixels; tell one that may."""
    named = f"{key} {value}".lower()
    if key == "rotation_count":
        raise ValueError(f"{name}{key}: must be 0, got {shown(value)}")
    other = _LENS.search(key) and any(part in named for part in _KEYS["others"])
    if np.isscalar(value) and ("fisheye" in key or other):
        raise ValueError(f"{name}{key}: must be none but of a lens {_LENSES}, got {shown(value)}")
    alone = np.isscalar(value) and re.fullmatch(r"[kp][1-6]|skew", key)  # P1 may be a matrix
    if alone or ("dist" in key and key not in _KNOWN):
        raise ValueError(f"{name}{key}: must stand in dist, {_LENSES}, got {shown(value)}")
    if _LENS.search(key) and not str(value).lower().startswith(tuple(_KEYS["lenses"])):
        warnings.append(f"{name}{key} = {shown(value)} is taken for a lens {_LENSES}")


def _decomposed(table: dict[str, Any], name: str, warnings: list[str]) -> Iterator[dict[str, Any]]:
    """K, R and t of P: DLT coefficients, (11, m), or projections, (3 m, 4) or (m, 3, 4)."""
    values, size = check_array("P", table["P"]), table["size"]
    if not np.isfinite(values).all():
        raise ValueError("must hold finite numbers, got NaN or infinity")
    is_dlt = values.ndim == 2 and len(values) == 11
    if is_dlt:
        values = np.vstack((values, np.ones(values.shape[1]))).T
    elif not (values.ndim in (2, 3) and values.shape[-1] == 4 and values.size % 12 == 0):
        raise ValueError(
            "must hold 11 DLT coefficients per camera, a column each, or matrices of 3 x 4, got "
            f"shape {values.shape}"
        )
    for i, matrix in enumerate(values.reshape(-1, 3, 4)):
        mirrored = np.linalg.det(matrix[:, :3]) < 0
        if is_dlt:
            # Pixels from 1, and from the lower left if the image is mirrored.
            first = [[1, 0, -1], [0, -1, size[1]] if mirrored else [0, 1, -1], [0, 0, 1]]
            matrix = np.array(first) @ matrix
        elif mirrored:
            matrix = -matrix
        if not np.linalg.cond(matrix[:, :3]) < 1e12:
            raise ValueError("P: must be of a camera at a finite place, got a singular matrix")
        parts = cv2.decomposeProjectionMatrix(matrix)[:3]
        inner, rotation, place = (np.asarray(part, float) for part in parts)
        inner /= inner[2, 2]
        skew = abs(inner[0, 1] / inner[1, 1]) * size[1] / 2
        told = f"{skew:.3g} pixels at the edge of the image"
        if skew > 5.0:  # pixels at the edge of the image, which are no camera's
            raise ValueError(f"P: must be of a camera with square corners, got a skew of {told}")
        if skew > models.ROUNDING:
            warnings.append(
                f"{name or f'camera [{i}]: '}its pixels are skew, by {told}, which is left out"
            )
        inner[0, 1] = 0
        yield table | {"K": inner, "R": rotation, "t": -rotation @ place[:3, 0] / place[3]}


def _camera(table: dict[str, Any]) -> PerspectiveCamera:
    """The camera of a table with K, R, t, size, and what else there is."""
    table = {"R": table.get("rvec", ())} | table
    for key in ("K", "R", "t"):
        if not np.size(table.get(key, ())):
            raise ValueError(f"{key}: must be given ({', '.join(_NAMES[key])}), got none")
    inner = _shaped("K", table["K"], (3, 3))
    if inner[0, 0] <= 0 or inner[1, 1] <= 0 or np.abs(inner[2] - [0, 0, 1]).max() > 1e-12:
        raise ValueError(f"K: must be [[fx, s, cx], [0, fy, cy], [0, 0, 1]], got {inner.tolist()}")
    skew = abs(inner[0, 1] / inner[1, 1]) * inner[1, 2]
    if skew > models.ROUNDING:
        raise ValueError(f"K: must have no skew, got {inner[0, 1]:g}")
    middle, size = inner[:2, 2], table["size"]
    # What P leads to may lie anywhere, and matters to no lens.
    if "P" not in table and ((middle <= 1) | (middle >= np.array(size) - 2)).any():
        raise ValueError(
            "K: must have its principal point in pixels, in the image, of width and height "
            f"{size}, got {middle.tolist()}"
        )
    rotation = _rotation("R", table["R"])
    other = rotation if (rvec := table.get("rvec")) is None else _rotation("rvec", rvec)
    if (apart := Rotation.from_matrix(rotation @ other.T).magnitude()) > _ROUNDED:
        raise ValueError(f"R: must be the rotation of rvec, got one {apart:.2g} radians from it")
    dist = np.trim_zeros(check_array("dist", table.get("dist", [])).ravel(), "b")
    camera = PerspectiveCamera(
        scale=1 / inner[0, 0],
        image_size=table["size"],
        principal_point=inner[:2, 2],
        aspect=inner[1, 1] / inner[0, 0],
        distortion=dist if dist.size else None,
    )
    return camera.posed(rotation, _shaped("t", table["t"], (3,)))


def _rotation(name: str, value: ArrayLike) -> Floats:
    """The matrix of a rotation, which may be given as that of Rodrigues."""
    turned = check_array(name, value)
    if turned.size == 3:
        axis = _shaped(name, turned, (3,))
        if np.linalg.norm(axis) > 2 * np.pi:
            raise ValueError(f"{name}: must be a rotation in radians, got {axis.tolist()}")
        return np.asarray(Rotation.from_rotvec(axis).as_matrix())
    turned = _shaped(name, turned, (3, 3))
    off = max(np.abs(turned @ turned.T - np.eye(3)).max(), 1 - np.linalg.det(turned))
    if off > _ROUNDED:
        raise ValueError(f"{name}: must be a rotation to {_ROUNDED:g}, got one off by {off:.1g}")
    return turned


def _shaped(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Finite numbers of a shape; those of a vector may stand in a column."""
    array = check_array(name, value)
    if array.size != np.prod(shape) or not np.isfinite(array).all():
        raise ValueError(f"{name}: must be finite and of shape {shape}, got {shown(value)}")
    return array.reshape(shape)
