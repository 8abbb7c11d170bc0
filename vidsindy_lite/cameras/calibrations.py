"""Calibrations of other tools: from their files to a rig, and back.

What they have in common is OpenCV's camera: a point X of the scene is seen at the pixel of
K (R X + t), bent by the lens, x to the right, y down and z forward. Its centre is -R' t, our normal
is minus the third row of R, our scale 1 / fx. Understood are::

    .toml              Anipose, Pose2Sim, Caliscope: a table per camera with matrix, distortions,
                       rotation (of Rodrigues, or a matrix), translation and size
    .yaml .xml .json   OpenCV's FileStorage, and plain JSON: K, dist, R or rvec, t, size under any
                       of their usual names, one camera per file or several
    .npz               the same names
    .csv .txt .npy     11 DLT coefficients per camera, a column each (DLTdv, Argus, easyWand), or
                       projection matrices of 3 x 4, one below the other

DLT coefficients count pixels from 1, from the upper left (DLTdv8) or, if their image is mirrored,
which the determinant tells, from the lower left (earlier ones).

Hartley & Zisserman 2004, "Multiple View Geometry", 6.2; Abdel-Aziz & Karara 1971 (DLT).
"""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import cv2
import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import rq
from scipy.spatial.transform import Rotation

from ..arrays import Floats
from ..checks import check_array, check_image_size, check_output, check_path
from .camera import turn
from .models import PerspectiveCamera
from .rig import Rig
from .triangulate import check_calibrated

_NAMES = {
    "K": ("k", "matrix", "camera_matrix", "cameramatrix", "intrinsics", "intrinsic_matrix", "mtx"),
    "dist": (
        "dist", "d", "distortions", "distortion", "distortion_coefficients", "dist_coeffs",
        "distcoeffs", "dist_coefs",
    ),
    "R": ("r", "rotation", "rvec", "rotation_matrix", "rot"),
    "t": ("t", "translation", "tvec", "translation_vector"),
    "size": ("size", "image_size", "imagesize", "resolution", "img_size"),
}  # fmt: skip
_STORAGE = (".yaml", ".yml", ".xml", ".json")  # of OpenCV
_SKEW = 1e-6  # pixels, at the edge of the image, that are rounding; and ...
_MOST_SKEW = 5.0  # ... that are no camera's


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
    if isinstance(paths, str | os.PathLike) or not isinstance(paths, Iterable):
        raise ValueError(f"paths: must be a list of files, got {paths!r:.60}")
    for given in paths:
        path = check_path("paths", given)
        if not path.is_file():
            raise FileNotFoundError(f"paths: no such calibration file, got '{path}'")
        try:
            found = list(_cameras(path, size))
        except (ValueError, KeyError, TypeError, OSError) as error:
            raise ValueError(f"paths: in '{path}', {error}") from error
        if not found:
            raise ValueError(
                f"paths: must hold a camera matrix (K), DLT coefficients or P, got none in '{path}'"
            )
        for camera, skew in found:
            if skew > _SKEW:
                warnings.append(
                    f"cameras[{len(cameras)}] ({path.name}): its pixels are skew, by {skew:.2g} "
                    "pixels at the edge of the image, which is left out"
                )
            cameras.append(camera)
    return Rig(tuple(cameras), tuple(warnings))


def write_calibration(rig: Rig, path: str | os.PathLike) -> None:
    """Write a rig for other tools.

    Parameters
    ----------
    rig : Rig
        Perspective cameras, all calibrated.
    path : path
        ``.toml`` for Anipose and Pose2Sim; ``.yaml``, ``.yml``, ``.xml`` or ``.json`` for OpenCV's
        FileStorage, a map per camera; ``.npz`` with K, dist, R, t and size, stacked; or ``.csv``
        for DLT coefficients (pixels from 1, from the upper left, as DLTdv8; without distortion).

    Raises
    ------
    ValueError
        If a camera is orthographic or not calibrated, has a distortion that a ``.csv`` cannot hold,
        the name ends otherwise, or its folder does not exist.
    """
    check_calibrated("rig", rig)
    file = check_output("path", path)
    parts = [_opencv(i, camera) for i, camera in enumerate(rig.cameras)]
    if file.suffix == ".toml":
        tables = [_table(i, part) for i, part in enumerate(parts)]
        file.write_text("\n".join([*tables, "[metadata]\n"]), encoding="utf-8")
    elif file.suffix in _STORAGE:
        file.write_text(_storage(file.suffix, parts), encoding="utf-8")
    elif file.suffix == ".npz":
        inner, dist, rotation, shift, size = (
            np.array([part[key] for part in parts]) for key in ("K", "dist", "R", "t", "size")
        )
        np.savez(file, K=inner, dist=dist, R=rotation, t=shift, size=size)
    elif file.suffix == ".csv":
        columns = [_coefficients(i, part) for i, part in enumerate(parts)]
        np.savetxt(file, np.column_stack(columns), delimiter=",", fmt="%.17g")
    else:
        known = ", ".join((".toml", *_STORAGE, ".npz"))
        raise ValueError(f"path: must end in {known} or .csv, got '{file.name}'")


def _cameras(path: Path, size: tuple[int, int] | None) -> Iterator[tuple[PerspectiveCamera, float]]:
    """The cameras of a file, each with the skew of its pixels."""
    suffix = path.suffix.lower()
    if suffix in (".csv", ".txt", ".npy"):
        yield from _from_matrices(_table_of(path), size)
        return
    for table in _tables(_content(path, suffix)):
        if "K" in table:
            yield _from_opencv(table, size), 0.0
        else:
            yield from _from_matrices(check_array("P", table["P"]), size)


def _content(path: Path, suffix: str) -> object:
    """A file as mappings, lists and numbers."""
    try:
        if suffix == ".toml":
            return tomllib.loads(path.read_text(encoding="utf-8"))
        if suffix == ".npz":
            with np.load(path) as archive:
                return dict(archive)
        if suffix == ".json" and '"opencv-matrix"' not in path.read_text(encoding="utf-8"):
            return json.loads(path.read_text(encoding="utf-8"))
        if suffix in _STORAGE:
            storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
            try:
                return _plain(storage.root())
            finally:
                storage.release()
    except (ValueError, cv2.error, SystemError, EOFError, BadZipFile) as error:
        first = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ValueError(f"must be a {suffix} file of its kind: {first}") from None
    raise ValueError(
        f"must end in .toml, .yaml, .yml, .xml, .json, .npz, .npy, .csv or .txt, got '{path.name}'"
    )


def _plain(node: Any) -> object:
    """A node of OpenCV's files as mappings, lists and numbers."""
    if node.isMap():
        keys = node.keys()
        if {"rows", "cols", "data"} <= set(keys):
            matrix = node.mat()
            if matrix is not None:
                return matrix
            values = np.array(_plain(node.getNode("data")), dtype=float)
            return values.reshape(int(node.getNode("rows").real()), -1)
        return {key: _plain(node.getNode(key)) for key in keys}
    if node.isSeq():
        return [_plain(node.at(i)) for i in range(node.size())]
    return node.string() if node.isString() else node.real()


def _tables(content: object) -> Iterator[dict[str, Any]]:
    """All parts of a file that describe a camera, in its order, under our names."""
    if isinstance(content, list):
        for part in content:
            yield from _tables(part)
    if not isinstance(content, Mapping):
        return
    lower = {str(key).lower(): value for key, value in content.items()}
    known = {
        name: lower[other] for name, others in _NAMES.items() for other in others if other in lower
    }
    if "K" in known:
        if "size" not in known and {"image_width", "image_height"} <= set(lower):
            known["size"] = [lower["image_width"], lower["image_height"]]
        for key in ("fisheye", "rotation_count"):
            if lower.get(key):
                raise ValueError(f"{key}: must be {type(lower[key])()}, got {lower[key]}")
        stacked = np.ndim(known["K"]) == 3
        count = len(known["K"]) if stacked else 1
        for i in range(count):
            yield {name: value[i] if stacked else value for name, value in known.items()}
    elif "p" in lower or "projection_matrix" in lower:
        yield {"P": lower.get("p", lower.get("projection_matrix"))}
    else:
        for part in content.values():
            yield from _tables(part)


def _table_of(path: Path) -> Floats:
    """The numbers of a text file or array."""
    if path.suffix.lower() == ".npy":
        return check_array("array", np.load(path))
    try:
        text = path.read_text(encoding="utf-8-sig").replace(",", " ").replace(";", " ")
        rows = [
            [float(part) for part in line.split()] for line in text.splitlines() if line.strip()
        ]
        return np.array(rows)
    except ValueError:
        raise ValueError("must hold rows of as many numbers each and nothing else") from None


def _from_matrices(
    values: Floats, size: tuple[int, int] | None
) -> Iterator[tuple[PerspectiveCamera, float]]:
    """Cameras of DLT coefficients, (11, m), or projection matrices, (3 m, 4) or (m, 3, 4)."""
    if size is None:
        raise ValueError("image_size: must be given (--size WxH), as this file does not say")
    if not np.isfinite(values).all():
        raise ValueError("must hold finite numbers, got NaN or infinity")
    if values.ndim == 2 and values.shape[0] == 11:
        for column in values.T:
            matrix = np.append(column, 1.0).reshape(3, 4)
            up = np.linalg.det(matrix[:, :3]) < 0
            # Pixels from 1, and from the lower left if the image is mirrored.
            first = [[1, 0, -1], [0, -1, size[1]] if up else [0, 1, -1], [0, 0, 1]]
            yield _from_projection(np.array(first) @ matrix, size)
    elif values.shape[-1] == 4 and values.size % 12 == 0:
        for matrix in values.reshape(-1, 3, 4):
            yield _from_projection(matrix * (np.sign(np.linalg.det(matrix[:, :3])) or 1.0), size)
    else:
        raise ValueError(
            "must hold 11 DLT coefficients per camera, a column each, or matrices of 3 x 4, got "
            f"shape {values.shape}"
        )


def _from_projection(matrix: Floats, size: tuple[int, int]) -> tuple[PerspectiveCamera, float]:
    """The camera of a projection matrix with a positive determinant, and its skew."""
    left = matrix[:, :3]
    if not np.linalg.cond(left) < 1e12:
        raise ValueError("P: must be of a camera at a finite place, got a singular matrix")
    inner, rotation = rq(left)
    signs = np.diag(np.sign(np.diag(inner)))
    inner, rotation = inner @ signs, signs @ rotation
    shift = np.linalg.solve(inner, matrix[:, 3])
    inner = inner / inner[2, 2]
    skew = abs(inner[0, 1] / inner[1, 1]) * size[1] / 2
    if skew > _MOST_SKEW:
        raise ValueError(
            f"P: must be of a camera with square corners, got a skew of {skew:.3g} pixels at the "
            "edge of the image"
        )
    return _camera(inner, np.zeros(0), rotation, shift, size), skew


def _from_opencv(table: dict[str, Any], given: tuple[int, int] | None) -> PerspectiveCamera:
    """The camera of a table with K, R, t, and what else there is."""
    for key in ("K", "R", "t"):
        if table.get(key) is None or not np.size(table[key]):
            raise ValueError(f"{key}: must be given ({', '.join(_NAMES[key])}), got none")
    inner = _shaped("K", table["K"], (3, 3))
    if inner[0, 0] <= 0 or inner[1, 1] <= 0 or np.abs(inner[2] - [0, 0, 1]).max() > 1e-12:
        raise ValueError(f"K: must be [[fx, s, cx], [0, fy, cy], [0, 0, 1]], got {inner.tolist()}")
    skew = abs(inner[0, 1] / inner[1, 1]) * inner[1, 2]
    if skew > _SKEW:
        raise ValueError(f"K: must have no skew, got {inner[0, 1]:g}")
    turned = check_array("R", table["R"])
    if turned.size == 3:
        rotation = Rotation.from_rotvec(_shaped("R", turned, (3,))).as_matrix()
    else:
        rotation = _shaped("R", turned, (3, 3))
        if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-5 or np.linalg.det(rotation) < 0:
            raise ValueError("R: must be a rotation, got a matrix that is none")
    size = table.get("size")
    if size is None:
        size = given
    if size is None:
        raise ValueError("image_size: must be given (--size WxH), as this file does not say")
    width, height = _shaped("size", size, (2,))
    dist = check_array("dist", table.get("dist", [])).ravel()
    if dist.size > 5 and not dist[5:].any():
        dist = dist[:5]
    if dist.size > 5:
        raise ValueError(f"dist: must be k1, k2, p1, p2, k3, got {dist.size} coefficients")
    shift = _shaped("t", table["t"], (3,))
    return _camera(inner, dist, rotation, shift, (round(width), round(height)))


def _shaped(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Finite numbers of a shape; those of a vector may stand in a column."""
    array = check_array(name, value)
    if array.size != np.prod(shape) or not np.isfinite(array).all():
        raise ValueError(f"{name}: must be finite and of shape {shape}, got {value!r:.60}")
    return array.reshape(shape)


def _camera(
    inner: Floats, dist: Floats, rotation: Floats, shift: Floats, size: tuple[int, int]
) -> PerspectiveCamera:
    """Ours of K, distortion, R, t."""
    camera = PerspectiveCamera(
        scale=1 / inner[0, 0],
        image_size=size,
        principal_point=inner[:2, 2],
        aspect=inner[1, 1] / inner[0, 0],
        distortion=dist if dist.any() else None,
    )
    return camera.posed(rotation, shift)


def _opencv(i: int, camera: object) -> dict[str, Floats]:
    """K, dist, R, t and size of one of ours."""
    if not isinstance(camera, PerspectiveCamera):
        raise ValueError(f"rig: cameras must be perspective, got cameras[{i}] orthographic")
    scale, angle = camera.calibration
    right, up = turn(angle).T @ camera.rows
    rotation = np.array([right, -up, -camera.normal])
    (u, v), f = camera.seen(np.zeros((1, 2)))[0], 1 / scale
    return {
        "K": np.array([[f, 0, u], [0, camera.aspect * f, v], [0, 0, 1]]),
        "dist": np.zeros(5) if camera.distortion is None else camera.distortion,
        "R": rotation,
        "t": -rotation @ np.asarray(camera.position),
        "size": np.array(camera.image_size),
    }


def _table(i: int, part: dict[str, Floats]) -> str:
    """One camera for Anipose and Pose2Sim."""
    turned = Rotation.from_matrix(part["R"]).as_rotvec()
    return (
        f'[cam_{i}]\nname = "cam_{i}"\nsize = {part["size"].tolist()}\n'
        f"matrix = {part['K'].tolist()}\ndistortions = {part['dist'].tolist()}\n"
        f"rotation = {turned.tolist()}\ntranslation = {part['t'].tolist()}\nfisheye = false\n"
    )


def _storage(suffix: str, parts: Sequence[dict[str, Floats]]) -> str:
    """All cameras for OpenCV, in the names of its own calibration samples."""
    storage = cv2.FileStorage(suffix, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    for i, part in enumerate(parts):
        storage.startWriteStruct(f"cam_{i}", cv2.FileNode_MAP)
        for name, pixels in zip(("image_width", "image_height"), part["size"], strict=True):
            storage.write(name, int(pixels))
        storage.write("camera_matrix", part["K"])
        storage.write("distortion_coefficients", part["dist"][:, None])
        storage.write("R", part["R"])
        storage.write("T", part["t"][:, None])
        storage.endWriteStruct()
    return storage.releaseAndGetString()


def _coefficients(i: int, part: dict[str, Floats]) -> Floats:
    """DLT coefficients of one camera, pixels from 1 and from the upper left, as DLTdv8's."""
    if part["dist"].any():
        raise ValueError(f"rig: DLT coefficients hold no distortion, got one in cameras[{i}]")
    last = np.array([[1, 0, 1], [0, 1, 1], [0, 0, 1]])
    matrix = last @ part["K"] @ np.column_stack((part["R"], part["t"]))
    if matrix[2, 3] <= 0:
        raise ValueError(
            f"rig: for DLT coefficients the origin must lie in front of all cameras, not of {i}"
        )
    return (matrix / matrix[2, 3]).ravel()[:11]
