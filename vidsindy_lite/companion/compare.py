"""Two folders of figures, number by number: what a run on another machine or day has changed."""

import json
import math
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from ..checks import check_path
from .artifacts import SECONDS
from .manifest import clear, sign
from .pages import page
from .records import RUN_TIMES

SIDES = ("committed", "regenerated")

# Of a number; and of the largest of its list, as what is zero but for rounding has no digits.
TOLERANCE = 1e-3
ROUNDING = 1e-9


def differences(
    committed: str | os.PathLike, regenerated: str | os.PathLike, tolerance: float = TOLERANCE
) -> dict[str, str]:
    """Which figures and tables hold other numbers, and where each first differs.

    Wall times, captions and stamps do not count.

    Parameters
    ----------
    committed, regenerated : path
        Folders as notebooks write them.
    tolerance : float
        Relative difference of two numbers that passes.

    Returns
    -------
    dict of str to str
        By id, in words.

    Raises
    ------
    ValueError
        If one of them is no folder, holds no figure or table, or a JSON file that is none.
    """
    ours, theirs = _numbers("committed", committed), _numbers("regenerated", regenerated)
    found = {}
    for name in sorted(ours | theirs):
        if name not in ours or name not in theirs:
            found[name] = "only " + ("committed" if name in ours else "regenerated")
        elif place := next(_unlike(ours[name], theirs[name], "", 0.0, tolerance), None):
            found[name] = place
    return found


def side_by_side(
    committed: str | os.PathLike, regenerated: str | os.PathLike, output: str | os.PathLike
) -> dict[str, str]:
    """Copy what `differences` finds, and a page that shows both images and the places.

    Parameters
    ----------
    committed, regenerated : path
        As of `differences`.
    output : path
        Where; an earlier comparison is replaced.

    Returns
    -------
    dict of str to str
        As of `differences`.

    Raises
    ------
    ValueError
        As of `differences`, or if the output holds anything but an earlier comparison.
    """
    output = check_path("output", output)
    for folder in (committed, regenerated):
        ours, theirs = output.resolve(), Path(folder).resolve()
        if ours.is_relative_to(theirs) or theirs.is_relative_to(ours):
            raise ValueError(f"output: must not hold or lie in what is compared, got '{output}'")
    found = differences(committed, regenerated)
    clear(output, "comparison")
    pictures: dict[str, list[str]] = {name: [] for name in found}
    for side, folder in zip(SIDES, (committed, regenerated), strict=True):
        (output / side).mkdir(parents=True, exist_ok=True)
        for name in found:
            for file in Path(folder).glob(f"{name}.*"):
                shutil.copy(file, output / side)
                pictures[name] += [side] if file.suffix == ".png" else []
    index = page("compare.html", found=found, pictures=pictures)
    (output / "index.html").write_text(index, "utf-8")
    sign(output)
    return found


def _numbers(name: str, folder: str | os.PathLike) -> dict[str, object]:
    """What each figure plots and each table holds, by id."""
    folder = check_path(name, folder)
    if not folder.is_dir():
        raise ValueError(f"{name}: must be a folder, got '{folder}'")
    paths = [path for path in folder.glob("*.json") if path.name != RUN_TIMES]
    if not paths:
        raise ValueError(f"{name}: must hold figures or tables (*.json), got none in '{folder}'")
    return {path.stem: _content(name, path) for path in paths}


def _content(name: str, path: Path) -> object:
    try:
        record = json.loads(path.read_text("utf-8"))
        return record["rows"] if "rows" in record else record["numbers"]
    except (ValueError, TypeError, KeyError):
        raise ValueError(
            f"{name}: must hold figures and tables (*.json), got '{path}', which is none"
        ) from None


def _unlike(one: object, other: object, place: str, size: float, tolerance: float) -> Iterator[str]:
    """Where two contents differ; `size` is that of the largest number beside this one."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        for key in one:
            if key != SECONDS:
                yield from _unlike(one[key], other[key], f"{place} {key}", 0.0, tolerance)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        largest = max((abs(v) for v in one if isinstance(v, int | float)), default=0.0)
        for index, pair in enumerate(zip(one, other, strict=True)):
            yield from _unlike(*pair, f"{place}[{index}]", largest, tolerance)
    elif isinstance(one, float | int) and isinstance(other, float | int):
        nothing = max(tolerance * size, ROUNDING)
        if not math.isclose(one, other, rel_tol=tolerance, abs_tol=nothing):
            yield f"{place.strip()}: {one} committed, {other} regenerated"
    elif one != other:
        yield f"{place.strip()}: {one!r:.60} committed, {other!r:.60} regenerated"
