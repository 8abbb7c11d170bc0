"""Tracks as text files: what other programs write, and our own.

=================  ===============================================================================
written by         what marks it, and where its pixels count from
=================  ===============================================================================
this package       ``frame`` or ``t``, ``u``, ``v`` (``x``, ``y`` mean the same); or ``u1``, ``v1``,
                   ``u2``, ... with all cameras in one file; pixel centres at integers from 0
DLTdv              ``pt1_cam1_X``, ``pt1_cam1_Y``, ...; the first pixel is 1, at the upper left
Argus              ``Track 1_cam_1_x``, ...; the first pixel is 1, at the lower left
DeepLabCut         rows ``scorer``, ``individuals`` (if there are several), ``bodyparts``,
                   ``coords``; frames of a likelihood below .6 do not count; of images that
                   somebody labelled, the numbers in their names
SLEAP              its analysis as CSV: ``track``, ``frame_idx``, ``nose.x``, ``nose.y``, ...
TrackMate          its spots as CSV: ``TRACK_ID``, ``POSITION_X``, ..., ``FRAME``, or its tracks as
                   XML; in pixels
Kinovea            its trajectories as text, with ``#Kinovea`` in front
Tracker (OSP)      the name of the mass over ``t``, ``x``, ``y``; better ``pixelx``, ``pixely``,
                   which count from the upper left corner of the image
detectors          boxes, as ``x``, ``y``, ``w``, ``h`` (``left``, ``top``, ...), or two corners,
                   ``x1``, ``y1``, ``x2``, ``y2`` (``xmin``, ...): their middles, or a point of its
                   own that lies in them
=================  ===============================================================================

Separators may be commas, semicolons, tabs or spaces, and decimals commas where these separate
nothing. A file without a header holds u and v, or a frame's number (or time), u and v. A row whose
pixels are empty, no number, exactly 0, 0 or -1, -1 (or another negative number twice), or which
says so in a column of its own, is a frame in which the target was not seen. Of several targets, or
parts of one, one is chosen by its name.
"""

from __future__ import annotations

import csv
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, product
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Bools, Floats
from ..storage import check_file, read_text, reading

# Names of columns of several cameras or targets: of DLTdv and Argus, of ours, of poses.
_SERIES = (
    re.compile(r"(?P<target>.+)_cam(?P<below>_?)(?P<camera>\d+)_(?P<axis>[xy])"),
    re.compile(r"(?P<axis>[uv])_?(?P<camera>\d+)"),
    re.compile(r"(?P<target>.+)\.(?P<axis>x|y|score|likelihood)"),
)
_TIME = re.compile(
    r"(?:t|times?|timestamp)(?:[ _(\[/]*(s|sec|seconds|ms|msec|us|µs|ns)[)\]]*)?|"
    r"(seconds|milliseconds|ms)"
)
# Other names, and what stands in cells.
_WORDS: dict[str, Any] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
_SIZED = list(product(_WORDS["corners"], _WORDS["sizes"]))  # corner and size of a box
_BOXES = [*_SIZED, *_WORDS["opposite"]]
_READ = {"frame", "likelihood", *_WORDS["seen"], *_WORDS["hidden"]}
_READ |= {*chain(*_WORDS["pixels"], *chain(*_BOXES))}


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
    upwards : bool
        Whether v counts up from the lowest row of the image, which is 1: of Argus.
    """

    name: str
    pixels: Floats
    t: Floats | None
    warnings: tuple[str, ...] = ()
    start: int = 0
    upwards: bool = False

    def downwards(self, height: int) -> Floats:
        """The pixels in an image of so many rows, v down from 0."""
        return np.array([0, height]) + [1, -1] * self.pixels if self.upwards else self.pixels


def read_tracks(path: str | os.PathLike, individual: str | None = None) -> list[TrackFile]:
    """The tracks in a text file, one per camera.

    Parameters
    ----------
    path : path
        As the programs write it that `track_files` lists.
    individual : str, optional
        Which of several targets: the name of an individual, a body part, both with a space
        between, or the number of a track, as the file has it.

    Returns
    -------
    list of TrackFile
        Of one target; several only if the file names several cameras.

    Raises
    ------
    FileNotFoundError, ValueError
        If the file is missing, holds no track, or those of several targets, of which none is
        chosen.
    """
    path = check_file("tracks", path)
    if kind := _WORDS["binary"].get(path.suffix.lower()):
        raise ValueError(
            f"tracks: must be a table as text, got '{path.name}', {kind}: export it as CSV"
        )
    text = read_text("tracks", path, "a table of numbers", fallback="latin-1")
    with reading("tracks", path):
        if text.lstrip().startswith("<"):
            header, rows = _of_xml(text)
        elif text.lstrip().lower().startswith("#kinovea"):
            header, rows = _of_kinovea(text)
        else:
            header, rows = _of_table(text)
        if not rows:
            raise ValueError("must hold rows of numbers, got none")
        return _tracks(path.name, header, rows, individual)


def _tracks(
    name: str, header: list[list[str]], rows: list[list[str]], individual: str | None
) -> list[TrackFile]:
    """The tracks in the cells of a file."""
    doubts: tuple[str, ...] = ()
    units = next((row for row in header if any(cell.strip().startswith("(") for cell in row)), None)
    named = [i for i, row in enumerate(header) if _names_pixels(row)]
    header = header[: named[-1] + 1] if named else header  # without units below
    heads = [[_plain(cell) for cell in row] for row in header] or [[]]
    names = heads[-1]
    if heads[0][:1] == ["scorer"]:
        names = _of_poses(header, names)
    if "position_x" in heads[0]:  # of TrackMate, above other names of them
        names = heads[0]
        unit = units[names.index("position_x")].strip("() ").lower() if units else "pixel"
        if not unit.startswith("pix"):
            raise ValueError(
                f"must have positions in pixels, got {unit}: remove the scale in TrackMate"
            )
        if not units:
            doubts = (f"{name}: its positions are taken for pixels: it does not say what they are",)
    names = [names[0] or "index", *names[1:]] if names else names
    width = len(names) or max(map(len, rows))
    for k, row in enumerate(rows):
        if any(cell.strip() for cell in row[width:]):  # of which column each is, nobody knows
            raise ValueError(f"must have {width} cells in a row, got {len(row)} in row {k}")
    rows = [[*row, *[""] * (width - len(row))] for row in rows]
    who, chosen = _column(names, _WORDS["target"]), ""
    if who is not None:
        for row in rows:
            row[who] = re.sub(r"\.0+$", "", row[who].strip())  # a number is called so, too
    words = {row[who] for row in rows} - {""} if who is not None else set()
    if who is not None and 0 < len(words) < max(len(rows), 2):  # else they count the rows
        whose = sorted(words, key=lambda word: (len(word), word))
        chosen = _chosen(whose, individual, lenient=True)
        rows = [row for row in rows if row[who] == chosen]
    frame = _column(names, _WORDS["frame"])
    counted = frame is not None
    if names[:1] == ["index"] and frame is None and who is None:
        frame = 0  # of the rows of a table: those that are left out are frames without a target
    values = _numbers(rows, width, names, frame)
    if frame is not None:
        # Images may be called by their times, and what is called image or n may be anything.
        numbers, sure = values[:, frame], "frame" in names[frame]
        if sure or (_counts(numbers) and np.diff(numbers).min(initial=np.inf) <= 10):
            names = [*names[:frame], "frame", *names[frame + 1 :]]
            values[:, frame] -= 0 if counted else numbers[0]
    if not header:
        if not 2 <= width <= 3:
            raise ValueError("must have a header, or columns u and v")
        names = ["frame" if _counts(values[:, 0]) else "t", "u", "v"][-width:]
    if who is not None and "frame" in names:
        values = values[np.argsort(values[:, names.index("frame")], kind="stable")]
    twice = {key for key in names if key and names.count(key) > 1}
    if twice & {key for pair in _WORDS["pixels"] for key in pair}:
        raise _several([f"{key} {names.count(key)} times" for key in sorted(twice)])
    columns = {key: values[:, names.index(key)] for key in names if key}
    told = [m for known in _SERIES for key in columns if (m := known.fullmatch(key))]
    if "frame" not in columns and not any(map(_TIME.fullmatch, columns)):
        steps = {key: np.diff(x) for key, x in columns.items() if len(x) > 2 and not _is_read(key)}
        rising = [key for key, by in steps.items() if (by > 0).all() and (by != 1).any()]
        if rising:
            doubts += (
                f"{name}: its rows are taken for frames one after the other, and {rising[0]!r}, "
                "which rises from each to the next, is left out: if that is the number of the "
                "frame or a time, call it frame or t",
            )
    if any(match["axis"] in "uvxy" for match in told):
        found = _of_series(name, columns, told, individual, chosen)
    else:
        _check_meant(individual, chosen)
        found = [_track(name, columns, of_world=units is None and _is_of_tracker(header))]
    return [replace(track, warnings=(*track.warnings, *doubts)) for track in found]


# ------------------------------------------------------------------------------- text into numbers


def _cells(text: str) -> list[list[str]]:
    """The cells of a text file, line by line; a line of empty cells is a frame without target."""
    lines = [line for line in text.splitlines() if line.strip(" ")]
    separator = next((mark for mark in "\t;," if any(mark in line for line in lines[-3:])), " ")
    if separator == " ":
        return [line.split() for line in lines]
    cells = list(csv.reader(lines, delimiter=separator))
    if separator != ",":  # decimals may have commas then
        cells = [[cell.replace(",", ".") for cell in row] for row in cells]
    return cells


def _of_table(text: str) -> tuple[list[list[str]], list[list[str]]]:
    """The lines above the numbers, and those of numbers, without comments."""
    cells = _cells(text)
    poses = bool(cells) and cells[0][0].strip().lower() == "scorer"
    begins = [row[0].strip().lower() == "coords" if poses else _is_of_numbers(row) for row in cells]
    other = (i for i, row in enumerate(cells) if not begins[i] and _names_pixels(row))
    above = 0 if poses else max(other, default=0)  # a title may hold numbers
    first = (i + poses for i, begun in enumerate(begins) if begun and i >= above)
    start = next(first, 1 if poses else len(cells))
    header, rows = cells[:start], cells[start:]
    if poses:  # names of folders may stand before those of images
        more = next((i for i, cell in enumerate(header[0][1:]) if cell.strip()), 0)
        return [[row[0], *row[1 + more :]] for row in header], [row[more:] for row in rows]
    said = [row for row in header if row[0].startswith("#")]
    header = [row for row in header if row not in said]
    if said and rows and not header:  # the last comment may be the names of the columns
        names = [cell.lstrip("# ") for cell in said[-1]]
        names = names if len(names) == len(rows[0]) else names[1:]
        header = [names] if len(names) == len(rows[0]) else []
    return header, rows


def _of_xml(text: str) -> tuple[list[list[str]], list[list[str]]]:
    """TrackMate's XML as a table; tracks are called by their numbers, from 0."""
    whole = re.search(r"<Tracks\b[^>]*>", text)
    if whole is None:
        raise ValueError("must be a table, or <Tracks> of TrackMate, got other XML")
    unit = re.search(r'spaceUnits="([^"]*)"', whole[0])
    rows = [
        [str(number), *(dict(re.findall(r'(\w+)="([^"]*)"', one)).get(key, "") for key in "txy")]
        for number, part in enumerate(text[whole.end() :].split("<particle")[1:])
        for one in re.findall(r"<detection\b([^>]*)>", part)
    ]
    heads = ["TRACK_ID", "FRAME", "POSITION_X", "POSITION_Y"]
    return [heads, ["", "", f"({unit[1] if unit else 'pixel'})", ""]], rows


def _of_kinovea(text: str) -> tuple[list[list[str]], list[list[str]]]:
    """Kinovea's trajectories as a table; those without a name are called by their numbers."""
    rows: list[list[str]] = []
    name, number = "", 0
    for line in [*text.splitlines()[2:], ""]:
        cells = line.replace(",", ".").split()
        if cells and cells[0].startswith("#"):
            name = line.lstrip("# ").strip()
        elif len(cells) > 2:
            rows.append([name or str(number), *cells[1:3]])
        elif not cells and rows and rows[-1][0] == (name or str(number)):
            name, number = "", number + 1
    return [["of Kinovea"], ["track", "x", "y"]], rows


def _plain(cell: str) -> str:
    """The name of a column without its unit, if that is pixels."""
    return re.sub(r"\s*[(\[](px|pixels?)[)\]]$", "", cell.strip().lower())


def _names_pixels(row: Sequence[str]) -> bool:
    """Whether a line names two columns of pixels, as of one of several cameras or targets."""
    names = {*map(_plain, row)}
    known = (one.fullmatch(name) for one in _SERIES for name in names)
    return any({*pair} <= names for pair in _WORDS["pixels"]) or any(known)


def _is_of_numbers(row: Sequence[str]) -> bool:
    """Whether a line holds values: numbers in half of its cells that are filled, or nothing."""
    filled = [_number(cell) for cell in row if cell.strip()]
    numbers = [number for number in filled if number is not None]
    real = bool(np.isfinite(numbers).any())
    return 2 * len(numbers) >= len(filled) if real else numbers == filled


def _number(cell: str) -> float | None:
    word = cell.strip().lower()
    try:
        return np.nan if word in _WORDS["empty"] else float(_WORDS["answers"].get(word, word))
    except ValueError:
        return None


def _is_read(name: str) -> bool:
    """Whether something is made of a column."""
    return name in _READ or any(one.fullmatch(name) for one in (_TIME, *_SERIES))


def _column(names: Sequence[str], keys: Sequence[str]) -> int | None:
    """The column of the first of some names that there is, whatever is between its words."""
    plain = [re.sub(r"[\W_]+", "_", name).strip("_") or name for name in names]
    ways = product((names, plain), keys)
    return next((list(known).index(key) for known, key in ways if key in known), None)


def _numbers(rows: list[list[str]], width: int, names: Sequence[str], images: int | None) -> Floats:
    """All values, NaN where a cell is empty or missing, or words in a column that is not read.

    Frames may be called by the names of their `images`: then the number in these counts.
    """
    values = np.full((len(rows), width), np.nan)
    for i, row in enumerate(rows):
        for j, cell in enumerate(row[:width]):
            number = _number(cell)
            if number is None and j == images:
                digits = re.search(r"(?<![\d.])(\d+)\D*$", cell.rpartition(".")[0] or cell)
                number = float(digits[1]) if digits else np.nan
            if number is None and j and (not names or _is_read(names[j])):
                raise ValueError(
                    f"must hold numbers below its header, got {cell!r:.40} in row {i + 1} of them"
                )
            values[i, j] = np.nan if number is None or np.isinf(number) else number
    return values


# ------------------------------------------------------------------------------ numbers into tracks


def _chosen(names: Sequence[str], individual: str | None, *, lenient: bool) -> str:
    """The target that is meant, or the only one there is; `lenient` if none need be called so.

    A user means one by its name, by some of the words in it, or by all of them and more.
    """
    if individual is not None and individual in names:
        return individual
    said = set((individual or "").split())
    meant = [name for name in names if said <= set(name.split()) or set(name.split()) <= said]
    wanted = meant or (names if lenient else [])
    if len(wanted) != 1:
        raise _several(wanted or names)
    return wanted[0]


def _check_meant(individual: str | None, *chosen: str) -> None:
    """Refuse what is chosen if a word of the individual is none of its names."""
    said, found = individual or "", " ".join(chosen)
    if said not in chosen and not set(said.split()) <= set(found.split()):
        raise ValueError(f"must name the individual {said!r}, got {found.strip() or 'no names'}")


def _several(names: Sequence[str]) -> ValueError:
    return ValueError(
        f"must hold one target, got {', '.join(names):.80}: leave one in it, or choose one by "
        "its name as individual"
    )


def _of_poses(header: list[list[str]], coords: list[str]) -> list[str]:
    """Names of the columns of DeepLabCut's table: individual and body part, and what it is."""
    width = min(map(len, header))
    if len(header) < 3 or not {"x", "y"} <= set(coords[:width]):
        raise ValueError("must have rows scorer, bodyparts and coords, with x and y in the last")
    parts = [" ".join(row[i].strip() for row in header[1:-1]) for i in range(1, width)]
    return ["frame", *(f"{part}.{what}" for part, what in zip(parts, coords[1:], strict=False))]


def _of_series(
    name: str, columns: Mapping[str, Floats], told: list[re.Match], individual: str | None,
    whose: str,
) -> list[TrackFile]:  # fmt: skip
    """The tracks of one target, by columns whose names say of what target or camera they are."""
    found: dict[tuple[str, int], dict[str, str]] = {}
    for match in told:
        if match.re == told[0].re:
            of = {"target": "", "camera": "0"} | match.groupdict()
            axis = {"x": "u", "y": "v"}.get(match["axis"], match["axis"])
            found.setdefault((of["target"], int(of["camera"])), {})[axis] = match[0]
    found = {of: axes for of, axes in found.items() if axes.keys() & {"u", "v"}}
    seen = {
        of for of, axes in found.items() if np.isfinite([columns[k] for k in axes.values()]).any()
    }
    target = _chosen(sorted({one for one, _ in seen or found}), individual, lenient=bool(whose))
    if whose:
        _check_meant(individual, whose, target)
    shared = {key: x for key, x in columns.items() if key == "frame" or _TIME.fullmatch(key)}
    # Of DLTdv and Argus the first pixel is 1; of Argus rows count up from the lowest one.
    below = told[0].groupdict().get("below")
    tracks = []
    for camera in sorted(camera for one, camera in found if one == target):
        axes = found[target, camera]
        if not {"u", "v"} <= axes.keys():
            raise ValueError(f"must have columns of both axes, got only {', '.join(axes.values())}")
        own = {axis: columns[key] for axis, key in axes.items()}
        own["u"], own["v"] = own["u"] - (below is not None), own["v"] - (below == "")
        where = f"{name}, camera {camera}" if "camera" in told[0].groupdict() else name
        tracks.append(_track(where, shared | own, upwards=below == "_"))
    return tracks


def _track(
    name: str, columns: Mapping[str, Floats], *, of_world: bool = False, upwards: bool = False
) -> TrackFile:
    """One camera's columns, with the rows of the frames that a file leaves out.

    Those of the world of a program may have any origin and unit.
    """
    doubts: tuple[str, ...] = ()
    box = next((box for box in _BOXES if {*box[0], *box[1]} <= columns.keys()), None)
    pair = next((pair for pair in _WORDS["pixels"] if set(pair) <= columns.keys()), None)
    if box:
        low, high = (np.array([columns[key] for key in keys]) for keys in box)
        sides = high if box in _SIZED else high - low
    if box and pair:  # a point of its own, if it is inside
        off = np.abs(low + sides / 2 - [columns[key] for key in pair])
        inside = ((off <= 0.45 * sides) | ~(sides > 0)).all()
        box = None if inside and pair != box[0] else box
    if box:
        # Edges of the first pixel are at -0.5 and 0.5; a box without an area is none.
        pixels = np.where((sides > 0).all(axis=0), low + sides / 2 - 0.5, np.nan).T
        doubts += (f"{name}: the middles of its boxes are taken, of {', '.join(box[0] + box[1])}",)
    elif pair == ["x", "y"] and np.nanstd(columns.get("z", 0.0)) > 0:
        raise ValueError(
            "must be the track of one camera, got x, y and z: a path in space needs no cameras, "
            "give it to vl.discover(t, x)"
        )
    elif pair:
        pixels = np.column_stack([columns[key] for key in pair])
    else:
        raise ValueError(f"must have columns u and v, got {', '.join(columns) or 'none':.80}")
    if of_world := of_world and pair == ["x", "y"]:
        if np.nanmin(pixels, initial=0) < 0:
            raise ValueError(
                "must hold pixels from the upper left corner, got x and y of Tracker or Kinovea "
                "with another origin: export columns pixelx and pixely, or move the origin there"
            )
        doubts += (
            f"{name}: x and y of Tracker or Kinovea are taken for pixels from the upper left "
            "corner, y down, which holds only if the axes were set so: export its columns pixelx "
            "and pixely",
        )
    if 0 < np.nanmax(pixels, initial=0) <= 1 and len(pixels) > 2:
        doubts += (f"{name}: no pixel of it is beyond 1: are these fractions of the image?",)
    pixels[~_seen(columns)] = np.nan
    # What many programs write where nothing was found.
    unset = (pixels[:, 0] == pixels[:, 1]) & (pixels[:, 0] <= 0) & (pixels[:, 0] % 1 == 0)
    if unset.any():
        marks = ", ".join(f"{value:g}, {value:g}" for value in np.unique(pixels[unset, 0]))
        doubts += (f"{name}: {marks} in {unset.sum()} of {len(unset)} rows is taken for not seen",)
    pixels[unset | ~np.isfinite(pixels).all(axis=1)] = np.nan
    # Tracker, which writes times as well, counts from the corner of the first pixel.
    if pair == ["pixelx", "pixely"] or (of_world and "t" in columns):
        pixels -= 0.5
    frames = columns.get("frame")
    clock = next((match for key in columns if (match := _TIME.fullmatch(key))), None)
    t, start = None, 0
    if clock is not None:
        # Seconds in milli-, micro- or nanoseconds, by their first letter.
        letter = (clock[1] or clock[2] or "s")[0]
        t = {"m": 1e-3, "u": 1e-6, "µ": 1e-6, "n": 1e-9}.get(letter, 1.0) * columns[clock[0]]
        if not (rises := np.diff(t, prepend=-np.inf) > 0).all():
            here = rises.argmin()
            raise ValueError(
                f"must have increasing times, got {t[here]:g} as {clock[0]} in row {here}"
            )
        # No camera takes longer from one frame to the next.
        if len(t) > 1 and (step := np.median(np.diff(t))) > 2.0:
            doubts += (
                f"{name}: its times are {step:.4g} apart: if these are milliseconds, "
                f"call the column {clock[0]}_ms",
            )
        t, frames = _unrounded(t)
    elif frames is not None and not _counts(frames):
        wrong = (frames % 1 != 0) | ~(np.diff(frames, prepend=-np.inf) > 0)
        row = int(wrong.argmax()) if wrong.any() else len(frames) - 1
        raise ValueError(
            "must have increasing whole numbers of frames within ten million, got "
            f"{frames[row]:.10g} in row {row}"
        )
    if frames is not None:
        start, seen, rows = int(frames[0]), pixels, (frames - frames[0]).astype(int)
        pixels = np.full((rows[-1] + 1, 2), np.nan)
        pixels[rows] = seen
        t = None if t is None else np.interp(np.arange(len(pixels)), rows, t)
    return TrackFile(name, pixels, t, doubts, start, upwards)


def _seen(columns: Mapping[str, Floats]) -> Bools:
    """Where columns of their own do not say that the target was not seen, (n,)."""
    seen = np.ones(len(next(iter(columns.values()))), bool)
    for key, values in columns.items():
        if key == "likelihood":
            seen &= values >= 0.6  # DeepLabCut's own limit
        elif key in _WORDS["seen"]:
            seen &= ~(values <= 0)
        elif key in _WORDS["hidden"]:
            seen &= ~(values > 0)
    return seen


def _unrounded(t: Floats) -> tuple[Floats, Floats | None]:
    """Times as they were before they were rounded for a file, and the frames that they count.

    If an even clock fits them all; else as they are, and none.
    """
    if len(t) < 3:
        return t, None
    last_digit = 10.0 ** -max(len(f"{value:.9f}".rstrip("0").partition(".")[2]) for value in t)
    steps = np.diff(t)
    counted = np.concatenate(([0.0], np.cumsum(np.rint(steps / np.median(steps)))))
    even = np.polynomial.Polynomial.fit(counted, t, 1)(counted)
    fits = _counts(counted) and np.abs(even - t).max() < last_digit
    return (even, counted) if fits else (t, None)


def _counts(frames: Floats) -> bool:
    """Whether these are numbers of frames."""
    whole, rises = (frames % 1 == 0).all(), (np.diff(frames) > 0).all()
    return bool(whole and rises and np.ptp(frames) < 10_000_000)


def _is_of_tracker(header: list[list[str]]) -> bool:
    """Whether the name of a mass stands above the columns."""
    if len(header) < 2 or len(header[-2]) not in (1, len(header[-1])):  # as of a title
        return False
    masses = [cell.strip() for cell in header[-2] if cell.strip()]
    if len(masses) > 1:
        raise _several(masses)
    return True
