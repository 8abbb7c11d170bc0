"""Two folders of figures, or two runs of a notebook: number by number, and as one looks at them.

What a run has made replaces what is committed only where it differs: a number by more than its
tolerance, or a picture so that one sees it.
"""

import base64
import io
import json
import math
import os
import re
from collections.abc import Iterable, Iterator
from decimal import Decimal
from pathlib import Path

import numpy as np
from nbformat import NotebookNode
from PIL import Image, ImageSequence
from scipy.ndimage import maximum_filter, minimum_filter

from ..checks import check_path
from ..storage import write_files
from .artifacts import files_of, read_records
from .report import write_page

TOLERANCE = 1e-3  # of a number, relative, where its record states no other
OF_LIST = 1e-4  # of the largest of a list: what is nearly zero beside it has fewer digits
NOTHING = 1e-12  # and a number that small has none
ERROR_BAR = 0.2  # of what stands after a +-; what stands before it may differ by as much as that is
SQUARE = 2  # pixels: a picture is looked at in squares of this side,
NEAR = 5  # and what was anywhere in so many by so many of them, may be in their middle
VISIBLE = 24  # grey levels by which the mean of a square differs so that one sees it
FEW = 0.002  # share of such squares of which one takes no notice
TIMES = "seconds"  # what is called so differs from run to run, and counts nowhere

_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?", re.IGNORECASE)
_ERROR = re.compile(r"(?:±|\+-) ?$")
_WITH_ERROR = re.compile(rf" ?(?:±|\+-) ?({_NUMBER.pattern})", re.IGNORECASE)
_SAVES = re.compile(r"\bsave_(?:figure|slider|animation|table)\(")


def differences(committed: str | os.PathLike, regenerated: str | os.PathLike) -> dict[str, str]:
    """Which figures and tables hold other numbers, and where each first differs.

    Numbers may differ by the tolerance that the committed record states, for all or for their
    column or name, or else by `TOLERANCE`; texts as in `same_text`. Wall times and captions do not
    count.

    Parameters
    ----------
    committed, regenerated : path
        Folders as notebooks write them.

    Returns
    -------
    dict of str to str
        By id, in words: the row, the column, and both values.

    Raises
    ------
    ValueError
        If one of them is no folder, or holds no figure or table.
    """
    ours, theirs = _records("committed", committed), _records("regenerated", regenerated)
    found = {}
    for name in sorted(ours | theirs):
        if name not in ours or name not in theirs:
            found[name] = "only " + ("committed" if name in ours else "regenerated")
        elif place := _first_difference(ours[name], theirs[name]):
            found[name] = place
    return found


def write_differences(
    committed: str | os.PathLike, regenerated: str | os.PathLike, output: str | os.PathLike
) -> dict[str, str]:
    """Write a page that shows what `differences` finds, both pictures side by side.

    Parameters
    ----------
    committed, regenerated : path
        As of `differences`.
    output : path
        Of the page; an earlier one is replaced.

    Returns
    -------
    dict of str to str
        As of `differences`.

    Raises
    ------
    ValueError
        As of `differences`, or if another file is at `output`.
    """
    found = differences(committed, regenerated)
    folders = {"committed": Path(committed), "regenerated": Path(regenerated)}
    write_page("output", output, "compare.html", found=found, folders=folders)
    return found


def outdated(committed: Path, regenerated: Path, notebook: str) -> list[str]:
    """Ids of a notebook's figures and tables that are not as it has made them now.

    Parameters
    ----------
    committed : Path
        The folder with those of all notebooks.
    regenerated : Path
        What the notebook has made, and nothing else.
    notebook : str
        What it makes no longer counts, too.

    Raises
    ------
    ValueError
        If another notebook has made a figure or table of the same id.
    """
    old, new = read_records(committed), read_records(regenerated)
    for name in new.keys() & old.keys():
        if old[name]["notebook"] != notebook:
            raise ValueError(f"{name}: belongs to notebook {old[name]['notebook']}")
    gone = [name for name in old if old[name]["notebook"] == notebook and name not in new]
    return gone + [
        name for name in new if not _same(old.get(name, {}), new[name], committed, regenerated)
    ]


def replace(committed: Path, regenerated: Path, names: Iterable[str]) -> None:
    """Put figures and tables in place of those of the same ids, or remove what is made no more."""
    old, new = read_records(committed), read_records(regenerated)
    for name in names:
        files = files_of(new[name]) if name in new else []
        # The record last.
        write_files({committed / f: (regenerated / f).read_bytes() for f in reversed(files)})
        for file in set(files_of(old[name]) if name in old else []) - set(files):
            (committed / file).unlink(missing_ok=True)


def same_notebook(committed: NotebookNode, regenerated: NotebookNode) -> bool:
    """Whether two executed notebooks have the same cells, and say and show the same.

    What a cell saves as a figure or table, and so shows, is compared there. Printed numbers may
    differ by one in their last digit.
    """
    (cells, said, pictures), (others, theirs, seen) = map(_shown, (committed, regenerated))
    if cells != others or len(pictures) != len(seen) or not same_text(said, theirs, printed=True):
        return False
    return all(map(looks_the_same, pictures, seen))


def _shown(notebook: NotebookNode) -> tuple[list, str, list[bytes]]:
    """The cells of a notebook, what they print, and the texts and pictures that none saves."""
    cells, texts, pictures = [], [], []
    for cell in notebook.cells:
        cells.append((cell.cell_type, cell.source, cell.metadata))
        if "versions()" in cell.source:  # with which it was run is no result
            continue
        for output in cell.get("outputs", []):
            data = {} if _SAVES.search(cell.source) else output.get("data", {})
            texts += [output.output_type, output.get("text", "")]
            texts += [data[kind] for kind in sorted(data) if kind.startswith("text/")]
            pictures += [base64.b64decode(data["image/png"])] if "image/png" in data else []
    return cells, "\n".join(texts), pictures


def same_text(one: str, other: str, printed: bool = False) -> bool:
    """Whether two texts have the same words and integers, and nearly the same other numbers.

    Numbers may differ by `TOLERANCE`; before a +- by as much as stands after it, and after it by
    `ERROR_BAR`. Blanks do not count.

    Parameters
    ----------
    one, other : str
    printed : bool
        Numbers may also differ by one in the last digit of the longer one.
    """
    one, other = " ".join(one.split()), " ".join(other.split())
    if _NUMBER.sub("#", one) != _NUMBER.sub("#", other):
        return False
    return all(
        _same_number(a[0], b[0], one[: a.start()], one[a.end() :], printed)
        for a, b in zip(_NUMBER.finditer(one), _NUMBER.finditer(other), strict=True)
    )


def _same_number(one: str, other: str, before: str, after: str, printed: bool) -> bool:
    """Whether two numbers are nearly the same, the first of which stands in a text."""
    if one == other or not re.search(r"[.e]", one + other, re.IGNORECASE):  # or integers
        return one == other
    near, room = TOLERANCE, 0.0
    if _ERROR.search(before):
        near = ERROR_BAR
    elif error := _WITH_ERROR.match(after):
        near, room = 0.0, abs(float(error[1]))
    if printed:
        last = min(int(Decimal(number).as_tuple().exponent) for number in (one, other))
        room = max(room, 1.01 * 10.0**last)
    return math.isclose(float(one), float(other), rel_tol=near, abs_tol=room)


def looks_the_same(one: bytes, other: bytes) -> bool:
    """Whether one would take two pictures for one; each frame of an animation counts.

    What has moved by a few pixels is the same, as between two processors; what cannot be read is
    not.
    """
    try:
        images = [Image.open(io.BytesIO(picture)) for picture in (one, other)]
        a, b = map(_squares, images)
    except (OSError, ValueError):
        return False
    same = images[0].size == images[1].size and a.shape == b.shape
    return same and max(_strange(a, b), _strange(b, a)) <= FEW


def _squares(image: Image.Image) -> np.ndarray:
    """Mean colours of the squares of all frames, shape (n, height, width, 3)."""
    frames = ImageSequence.Iterator(image)
    return np.array([np.asarray(frame.convert("RGB").reduce(SQUARE), float) for frame in frames])


def _strange(one: np.ndarray, other: np.ndarray) -> float:
    """Largest share of the squares of a frame whose colour is nowhere near them in another."""
    size = (1, NEAR, NEAR, 1)
    low, high = minimum_filter(other, size), maximum_filter(other, size)
    seen = ((one < low - VISIBLE) | (one > high + VISIBLE)).any(axis=-1)
    return float(seen.mean(axis=(1, 2)).max())


# ------------------------------------------------------------------------------------------ details


def _records(name: str, folder: str | os.PathLike) -> dict[str, dict]:
    """The records of a folder; one that is damaged is none."""
    folder = check_path(name, folder)
    if not folder.is_dir():
        raise ValueError(f"{name}: must be a folder, got '{folder}'")
    if not (records := read_records(folder)):
        raise ValueError(f"{name}: must hold figures or tables (*.json), got none in '{folder}'")
    return records


def _first_difference(one: dict, other: dict) -> str | None:
    """Where the numbers of two records first differ, in words."""
    tolerance = one.get("tolerance", TOLERANCE)
    if "rows" not in one or "rows" not in other:
        return next(_unlike(one.get("numbers"), other.get("numbers"), "", tolerance), None)
    if len(one["rows"]) != len(other["rows"]):
        return f"{len(one['rows'])} rows committed, {len(other['rows'])} regenerated"
    for number, rows in enumerate(zip(one["rows"], other["rows"], strict=True)):
        for place in _unlike(*rows, "", tolerance):
            words = ", ".join(v for v in rows[0].values() if isinstance(v, str))
            return f"row {number} ({words:.60}), column {place}"
    return None


def _unlike(
    one: object, other: object, place: str, tolerance: dict | float, size: float = 0.0
) -> Iterator[str]:
    """Where two contents differ; `size` is that of the largest number beside this one."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        for key in one:
            if key != TIMES:
                near = tolerance.get(key, TOLERANCE) if isinstance(tolerance, dict) else tolerance
                yield from _unlike(one[key], other[key], f"{place} {key}", near)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        largest = max((abs(v) for v in one if isinstance(v, int | float)), default=0.0)
        for index, pair in enumerate(zip(one, other, strict=True)):
            yield from _unlike(*pair, f"{place}[{index}]", tolerance, largest)
    elif isinstance(one, float) and isinstance(other, float):
        near = TOLERANCE if isinstance(tolerance, dict) else tolerance
        if not math.isclose(one, other, rel_tol=near, abs_tol=max(OF_LIST * size, NOTHING)):
            yield f"{place.strip()}: {one} committed, {other} regenerated"
    elif isinstance(one, str) and isinstance(other, str) and same_text(one, other):
        return
    elif one != other:
        yield f"{place.strip()}: {one!r:.60} committed, {other!r:.60} regenerated"


def _same(old: dict, new: dict, committed: Path, regenerated: Path) -> bool:
    """Whether a record says the same, and its picture looks the same.

    A picture of wall times never does: it stays as it was, if the other numbers are.
    """
    said = [{k: v for k, v in r.items() if k not in ("rows", "numbers")} for r in (old, new)]
    if said[0] != said[1] or _first_difference(old, new):
        return False
    files = [[folder / name for name in files_of(old)[1:]] for folder in (committed, regenerated)]
    timed = f'"{TIMES}": ' in json.dumps([old.get("rows"), old.get("numbers")])
    return all(
        a.exists() and (timed or looks_the_same(a.read_bytes(), b.read_bytes()))
        for a, b in zip(*files, strict=True)
    )
