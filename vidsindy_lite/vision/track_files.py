"""Tracks as text files: what other programs write, and our own.

=================  ===============================================================================
written by         what marks it, and where its pixels count from
=================  ===============================================================================
this package       ``frame`` or ``t``, ``u``, ``v`` (``x``, ``y`` mean the same); or ``u1``, ``v1``,
                   ``u2``, ... with all cameras in one file; pixel centres at integers from 0
DLTdv              ``pt1_cam1_X``, ``pt1_cam1_Y``, ...; the first pixel is 1, at the upper left
DeepLabCut         rows ``scorer``, ``bodyparts``, ``coords``; frames of a likelihood below .6 do
                   not count
Tracker (OSP)      the name of the mass over ``t``, ``x``, ``y``; better ``pixelx``, ``pixely``,
                   which count from the upper left corner of the image
=================  ===============================================================================

Separators may be commas, semicolons, tabs or spaces, and decimals commas where these separate
nothing. A file without a header holds u and v, or a frame's number (or time), u and v. A row whose
pixels are empty, no number or exactly 0, 0 is a frame in which the target was not seen.
"""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..arrays import Floats
from ..checks import check_path

SUFFIXES = frozenset({".csv", ".tsv", ".txt", ".dat"})

_SURE = 0.6  # DeepLabCut's own limit of the likelihood
_HEAD = 4096  # characters that tell text from what is none
_MOST_FRAMES = 10_000_000  # a larger number of a frame is none
_DLTDV = re.compile(r"pt(\d+)_cam(\d+)_([xy])")
_OURS = re.compile(r"([uv])_?(\d+)")
_TIME, _FRAME = ("t", "time", "seconds", "t_s"), ("frame", "frames", "step", "n")
_PIXELS = (("u", "v"), ("pixelx", "pixely"), ("x", "y"), ("x_px", "y_px"))


@dataclass(frozen=True, eq=False)
class TrackFile:
    """One camera's track as a file holds it.

    Parameters
    ----------
    name : str
        Of the file, and of the camera in it if it holds several.
    pixels : ndarray, shape (n, 2)
        (u right, v down), pixel centres at integers from 0; NaN where the target was not seen.
    t : ndarray, shape (n,), or None
        Time of each row, if the file states it.
    warnings : tuple of str
        Why it may have been misunderstood.
    start : int
        Number of the frame of the first row.
    """

    name: str
    pixels: Floats
    t: Floats | None
    warnings: tuple[str, ...] = ()
    start: int = 0


def read_tracks(path: str | os.PathLike) -> list[TrackFile]:
    """The tracks in a text file, one per camera.

    Parameters
    ----------
    path : path
        As this package, DLTdv, Tracker (OSP) or DeepLabCut write it; see `track_files`.

    Returns
    -------
    list of TrackFile
        Of one target; several only if the file names several cameras.

    Raises
    ------
    FileNotFoundError, ValueError
        If the file is missing, holds no track, or those of several targets.
    """
    path = check_path("tracks", path)
    if not path.is_file():
        raise FileNotFoundError(f"tracks: no such file, got '{path}'")
    header, rows = _split(path, _cells(path))
    names = [name.strip().lower() for name in header[-1]] if header else []
    values = _numbers(path, rows, len(names) or max(map(len, rows)))
    columns = {name: values[:, names.index(name)] for name in names if name}
    if any(_DLTDV.fullmatch(name) for name in columns):
        return _of_dltdv(path, columns)
    if header and header[0][0].strip().lower() == "scorer":
        return [_of_deeplabcut(path, header, values)]
    if any(_OURS.fullmatch(name) for name in columns):
        return _of_cameras(path, columns)
    if not header:
        keys = {2: ("u", "v"), 3: ("frame", "u", "v")}.get(values.shape[1])
        if keys is None:
            raise ValueError(f"tracks: {path.name} must have a header, or columns u and v")
        columns = {key: values[:, i] for i, key in enumerate(keys)}
        if len(keys) == 3 and not _counts(columns["frame"]):
            columns["t"] = columns.pop("frame")
    return [_of_columns(path, columns, _is_of_tracker(path, header))]


# ------------------------------------------------------------------------------- text into numbers


def _cells(path: Path) -> list[list[str]]:
    """The cells of a text file, line by line; a line of empty cells is a frame without target."""
    raw = path.read_bytes()
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    if any(mark < " " and not mark.isspace() for mark in text[:_HEAD]):
        raise ValueError(
            f"tracks: must be tables in UTF-8, got '{path.name}', which is no table of numbers"
        )
    lines = [line for line in text.splitlines() if line.strip(" ")]
    separator = next((mark for mark in "\t;," if any(mark in line for line in lines[-3:])), " ")
    if separator == " ":
        return [line.split() for line in lines]
    cells = list(csv.reader(lines, delimiter=separator))
    if separator != ",":  # decimals may have commas then
        cells = [[cell.replace(",", ".") for cell in row] for row in cells]
    return cells


def _split(path: Path, cells: list[list[str]]) -> tuple[list[list[str]], list[list[str]]]:
    """Header and numbers."""
    start = next((i for i, row in enumerate(cells) if _is_of_numbers(row)), len(cells))
    if start == len(cells):
        raise ValueError(f"tracks: {path.name} must hold rows of numbers, got none")
    return cells[:start], cells[start:]


def _is_of_numbers(row: Sequence[str]) -> bool:
    """Whether a line holds values: numbers or nothing, but for a name of an image in front."""
    rest = row[1:] if len(row) > 1 and _number(row[0]) is None else row
    numbers = [_number(cell) for cell in rest if cell.strip()]
    return None not in numbers and (bool(numbers) or rest is row)


def _number(cell: str) -> float | None:
    try:
        return float(cell) if cell.strip() else np.nan
    except ValueError:
        return None


def _numbers(path: Path, rows: list[list[str]], width: int) -> Floats:
    """All values, NaN where a cell is empty or missing."""
    values = np.full((len(rows), width), np.nan)
    for i, row in enumerate(rows):
        for j, cell in enumerate(row[:width]):
            number = _number(cell)
            if number is None and j:
                raise ValueError(
                    f"tracks: {path.name} must hold numbers below its header, got {cell!r:.40} "
                    f"in row {i + 1} of them"
                )
            values[i, j] = np.nan if number is None or np.isinf(number) else number
    return values


# ------------------------------------------------------------------------------ numbers into tracks


def _of_dltdv(path: Path, columns: Mapping[str, Floats]) -> list[TrackFile]:
    """DLTdv's table of all points in all cameras, of which one point must be the target."""
    found: dict[tuple[int, int], dict[str, Floats]] = {}
    for name, values in columns.items():
        match = _DLTDV.fullmatch(name)
        if match:
            point, camera, axis = match.groups()
            found.setdefault((int(point), int(camera)), {})[axis] = values - 1
    shown = {key: both for key, both in found.items() if np.isfinite([*both.values()]).any()}
    points = sorted({point for point, _ in shown})
    if len(points) > 1:
        raise _several(path, [f"pt{point}" for point in points])
    cameras = sorted(camera for _, camera in shown)
    return [
        _whole(f"{path.name}, cam{camera}", shown[points[0], camera]["x"],
               shown[points[0], camera]["y"], {})
        for camera in cameras
    ]  # fmt: skip


def _of_deeplabcut(path: Path, header: list[list[str]], values: Floats) -> TrackFile:
    """DeepLabCut's table of one body part."""
    parts = sorted({name for row in header[1:-1] for name in row[1:] if name})
    if len(set(header[-2][1:])) > 1:
        raise _several(path, parts)
    coords = [name.strip().lower() for name in header[-1]]
    columns = {name: values[:, i] for i, name in enumerate(coords)}
    if np.isfinite(values[:, 0]).all():
        columns["frame"] = values[:, 0]
    return _of_columns(path, columns, False)


def _of_cameras(path: Path, columns: Mapping[str, Floats]) -> list[TrackFile]:
    """Our own table of all cameras."""
    numbers = sorted({int(m[2]) for name in columns if (m := _OURS.fullmatch(name))})
    tidy = {name.replace("_", ""): values for name, values in columns.items()}
    try:
        return [
            _whole(f"{path.name}, camera {i}", tidy[f"u{i}"], tidy[f"v{i}"], columns)
            for i in numbers
        ]
    except KeyError as missing:
        raise ValueError(f"tracks: {path.name} must have a column {missing}") from None


def _of_columns(path: Path, columns: Mapping[str, Floats], of_tracker: bool) -> TrackFile:
    """One camera's columns."""
    pair = next((pair for pair in _PIXELS if set(pair) <= columns.keys()), None)
    if pair is None:
        names = ", ".join(columns) or "none"
        raise ValueError(f"tracks: {path.name} must have columns u and v, got {names:.80}")
    u, v = (columns[name] for name in pair)
    if pair == ("pixelx", "pixely"):  # corners at integers
        u, v = u - 0.5, v - 0.5
    doubts: tuple[str, ...] = ()
    if of_tracker and pair == ("x", "y"):
        if min(np.nanmin(u, initial=0), np.nanmin(v, initial=0)) < 0:
            raise ValueError(
                f"tracks: {path.name} must hold pixels from the upper left corner, got x and y of "
                "Tracker with another origin: export its columns pixelx and pixely"
            )
        doubts = (
            f"{path.name}: Tracker's x and y are taken for pixels from the upper left corner, y "
            "down, which holds only if the axes were set so: export its columns pixelx and pixely",
        )
    if "likelihood" in columns:
        u = np.where(columns["likelihood"] >= _SURE, u, np.nan)
    return _whole(path.name, u, v, columns, doubts)


def _whole(
    name: str, u: Floats, v: Floats, columns: Mapping[str, Floats], doubts: tuple[str, ...] = ()
) -> TrackFile:
    """A track with the rows of the frames that a file leaves out."""
    t = next((columns[key] for key in _TIME if key in columns), None)
    frames = next((columns[key] for key in _FRAME if key in columns), None)
    pixels = np.column_stack((u, v))
    unset = (pixels == 0).all(axis=1)
    if unset.any():  # what many programs write where nothing was found
        doubts += (f"{name}: 0, 0 in {unset.sum()} of {len(unset)} rows is taken for not seen",)
    pixels[unset | ~np.isfinite(pixels).all(axis=1)] = np.nan
    if t is not None and (not np.isfinite(t).all() or (np.diff(t) <= 0).any()):
        raise ValueError(f"tracks: {name} must have increasing times")
    if frames is None or t is not None:
        return TrackFile(name, pixels, None if t is None else _unrounded(t), doubts)
    if not _counts(frames):
        raise ValueError(f"tracks: {name} must have increasing whole numbers of frames")
    whole = (frames - frames[0]).astype(int)
    filled = np.full((whole[-1] + 1, 2), np.nan)
    filled[whole] = pixels
    return TrackFile(name, filled, None, doubts, int(frames[0]))


def _unrounded(t: Floats) -> Floats:
    """Times as they were before they were rounded for a file, if an even clock fits them all."""
    if len(t) < 3:
        return t
    last_digit = 10.0 ** -max(len(f"{value:.9f}".rstrip("0").partition(".")[2]) for value in t)
    steps = np.diff(t)
    counted = np.concatenate(([0.0], np.cumsum(np.rint(steps / np.median(steps)))))
    even = np.polynomial.Polynomial.fit(counted, t, 1)(counted)
    fits = (np.diff(counted) > 0).all() and np.abs(even - t).max() < last_digit
    return even if fits else t


def _counts(frames: Floats) -> bool:
    """Whether these are numbers of frames."""
    whole = bool((frames == np.rint(frames)).all()) and np.isfinite(frames).all()
    return bool(whole and (np.diff(frames) > 0).all() and np.ptp(frames) < _MOST_FRAMES)


def _is_of_tracker(path: Path, header: list[list[str]]) -> bool:
    """Whether Tracker wrote it: the name of a mass above its columns."""
    if len(header) < 2:
        return False
    masses = [cell.strip() for cell in header[-2] if cell.strip() and cell[0] != "#"]
    if len(masses) > 1:
        raise _several(path, masses)
    return True


def _several(path: Path, names: Sequence[str]) -> ValueError:
    return ValueError(
        f"tracks: {path.name} must hold one target, got {', '.join(names):.80}: leave one in it"
    )
