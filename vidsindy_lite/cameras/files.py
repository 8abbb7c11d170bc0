"""Calibrations of other tools: from their files to a rig.

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
which the determinant tells, from the lower left (earlier ones). What a table says of a lens that is
none of ours is refused; a camera that is to be ignored is left out, and that is told, as are keys
of which nothing is known.

Hartley & Zisserman 2004, "Multiple View Geometry", 6.2; Abdel-Aziz & Karara 1971 (DLT).
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import rq
from scipy.spatial.transform import Rotation

from ..arrays import Floats
from ..checks import check_array, check_image_size, shown
from ..storage import TREES, check_file, read_arrays, read_text, read_tree, reading
from .models import LENS, PerspectiveCamera
from .rig import Rig

_NAMES = {
    "K": ("k", "matrix", "camera_matrix", "cameramatrix", "intrinsics", "intrinsic_matrix", "mtx"),
    "dist": (
        "dist", "d", "distortions", "distortion", "distortion_coefficients", "dist_coeffs",
        "distcoeffs", "dist_coefs",
    ),
    "R": ("r", "rotation", "rvec", "rotation_matrix", "rot"),
    "t": ("t", "translation", "tvec", "translation_vector"),
    "size": ("size", "image_size", "imagesize", "resolution", "img_size"),
    "P": ("p", "projection_matrix"),
}  # fmt: skip
_SIZES = (("image_width", "image_height"), ("width", "height"), ("img_width", "img_height"))
_MARKS = dict.fromkeys(("ignore", "ignored", "disabled", "exclude", "excluded", "skip"), True)
_MARKS |= dict.fromkeys(("enabled", "active", "use", "used", "included", "valid"), False)
"""Keys that mark a camera as one to be left out: if they are set, or if they are not."""
_LENS = re.compile(r"model|lens|projection_?type|^camera_?type")
"""Keys that say which lens it is, ..."""
_OURS = (
    "pinhole", "perspective", "opencv", "plumb", "radtan", "radial", "brown", "standard",
    "rational", "polynomial", "simple", "lensmodel_opencv", "lensmodel_pinhole",
)  # fmt: skip
"""... the beginnings of the names of ours, ..."""
_OTHERS = re.compile(
    "fish|equi|kannala|kb4|omni|mei|spher|ucm|unified|fov|atan|scaramuzza|ocam|division|thin|tilt|"
    "ortho|panor|theta|stereograph"
)
"""... and parts of the names of others."""
_LENSES = f"of {', '.join(LENS)}"
_KNOWN = {key for keys in (*_NAMES.values(), *_SIZES, _MARKS) for key in keys} | {
    "name", "camera", "camera_name", "cam_id", "id", "serial", "serial_number", "port", "index",
    "error", "rms", "reprojection_error", "avg_reprojection_error", "grid_count", "flags", "date",
    "calibration_time", "calibration_date", "verified_resolutions", "exposure", "board_width",
    "board_height", "square_size", "nframes", "nr_of_frames", "fps", "frame_rate", "fisheye",
    "rotation_count", "distortion_model", "distortion_type",
}  # fmt: skip
"""Keys that are read, and those that change nothing of what a camera sees."""
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
        raise ValueError(f"paths: must be a list of files, got {shown(paths)}")
    for given in paths:
        path = check_file("paths", given, "calibration file")
        content = _content(path)
        before = len(warnings)
        with reading("paths", path):
            found = list(_cameras(content, size, warnings))
        warnings[before:] = [f"{path.name}: {warning}" for warning in warnings[before:]]
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


def _content(path: Path) -> Any:
    """A file as mappings and lists, or as an array of numbers."""
    suffix = path.suffix.lower()
    if suffix in TREES:
        return read_tree("paths", path, suffix)
    if suffix in (".npy", ".npz"):
        return read_arrays("paths", path)
    if suffix in (".csv", ".txt"):
        text = read_text("paths", path, "a table")
        with reading("paths", path):
            return _table_of(text)
    raise ValueError(
        "paths: must end in .toml, .yaml, .yml, .xml, .json, .npz, .npy, .csv or .txt, got "
        f"'{path}'"
    )


def _cameras(
    content: Any, size: tuple[int, int] | None, warnings: list[str]
) -> Iterator[tuple[PerspectiveCamera, float]]:
    """The cameras of a file, each with the skew of its pixels."""
    if isinstance(content, np.ndarray):
        yield from _from_matrices(check_array("array", content), size)
        return
    for name, table in _tables(content, "", warnings):
        try:
            if "K" in table:
                yield _from_opencv(table, size), 0.0
            else:
                own = check_image_size(table["size"]) if "size" in table else size
                yield from _from_matrices(check_array("P", table["P"]), own)
        except ValueError as error:
            raise ValueError(f"{name}{error}") from None


def _tables(content: Any, name: str, warnings: list[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """All parts of a file that describe a camera, in its order: their names, and our keys' values.

    Names end in ": ", as they stand before what is wrong.
    """
    if isinstance(content, list):
        for i, part in enumerate(content):
            yield from _tables(part, f"{name or 'camera '}[{i}]: ".replace(": [", "["), warnings)
    if not isinstance(content, Mapping):
        return
    lower = {str(key).lower(): value for key, value in content.items()}
    known = {
        ours: lower[other] for ours, others in _NAMES.items() for other in others if other in lower
    }
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
    sides = next((sides for sides in _SIZES if set(sides) <= set(lower)), ())
    if sides and "size" not in known:
        known["size"] = [lower[side] for side in sides]
    strange = [
        key for key in lower if not (key in _KNOWN or _LENS.search(key)) and _is_set(lower[key])
    ]
    if strange:
        warnings.append(f"{name}nothing is known of {', '.join(strange):.80}, which is left out")
    stacked = np.ndim(known.get("K", 0)) == 3
    for i in range(len(known["K"]) if stacked else 1):
        yield name, {key: value[i] if stacked else value for key, value in known.items()}


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
    if np.isscalar(value) and ("fisheye" in key or (_LENS.search(key) and _OTHERS.search(named))):
        raise ValueError(f"{name}{key}: must be none but of a lens {_LENSES}, got {shown(value)}")
    if re.fullmatch(r"[kp][1-6]|skew", key) or ("dist" in key and key not in _KNOWN):
        raise ValueError(f"{name}{key}: must stand in dist, {_LENSES}, got {shown(value)}")
    if _LENS.search(key) and not str(value).lower().startswith(_OURS):
        warnings.append(f"{name}{key} = {shown(value)} is taken for a lens {_LENSES}")


def _table_of(text: str) -> Floats:
    """The numbers of a text."""
    try:
        lines = text.replace(",", " ").replace(";", " ").splitlines()
        return np.array([[float(part) for part in line.split()] for line in lines if line.strip()])
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
    elif values.ndim in (2, 3) and values.shape[-1] == 4 and values.size % 12 == 0:
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
    dist = np.trim_zeros(check_array("dist", table.get("dist", [])).ravel(), "b")
    if dist.size > len(LENS):
        raise ValueError(f"dist: must be {', '.join(LENS)}, got {dist.size} coefficients")
    shift = _shaped("t", table["t"], (3,))
    return _camera(inner, dist, rotation, shift, (round(width), round(height)))


def _shaped(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Finite numbers of a shape; those of a vector may stand in a column."""
    array = check_array(name, value)
    if array.size != np.prod(shape) or not np.isfinite(array).all():
        raise ValueError(f"{name}: must be finite and of shape {shape}, got {shown(value)}")
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
