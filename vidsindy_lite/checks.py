"""What arguments have to be: each check gives back the clean value, or names argument, rule, value.

Booleans are no numbers here, and text is none even where numpy would read it as one.
"""

from __future__ import annotations

import csv
import os
import struct
import zlib
from collections.abc import Iterable, Sequence
from datetime import date, timedelta
from fractions import Fraction
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar
from zipfile import BadZipFile

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats

T = TypeVar("T")

#: Largest coordinate of a track or a state: the squares of larger ones are no numbers any more.
FARTHEST = 1e100
LARGEST_SIDE = 32768  #: Pixels of a camera's image, in width and in height: no sensor has more.
#: What is raised where something from outside is turned into values, and is malformed.
MALFORMED = (
    ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RuntimeError, ImportError,
    EOFError, MemoryError, SyntaxError, SystemError, BadZipFile, csv.Error, struct.error,
    zlib.error,
)  # fmt: skip


def shown(value: object) -> str:
    """A value as a message shows it: the start of it, in one line."""
    try:
        return " ".join(repr(value).split())[:60]
    except MALFORMED:  # such as an integer of 5,000 digits
        return f"a value of type {type(value).__name__}"


def check_instance(name: str, value: object, kind: type) -> None:
    """An object of a type of ours, not e.g. the name of its file."""
    if not isinstance(value, kind):
        raise ValueError(f"{name}: must be of type {kind.__name__}, got {shown(value)}")


def check_items(
    name: str, values: Iterable[T], count: int | None = None, of: str = ""
) -> tuple[T, ...]:
    """The items of a list or the like; one for each of so many things, if these are given."""
    try:
        if of and isinstance(values, str):
            raise TypeError
        items = tuple(values)
    except TypeError:  # also of a scalar that calls itself iterable
        each = of and f", one per {of}"
        raise ValueError(f"{name}: must be a list{each}, got {shown(values)}") from None
    if count is not None and len(items) != count:
        raise ValueError(f"{name}: must be one per {of}, got {len(items)} for {count}")
    return items


def check_path(name: str, value: str | os.PathLike) -> Path:
    """The name of one file or folder, which can be shown."""
    if not isinstance(value, str | os.PathLike) or not os.fspath(value):
        raise ValueError(f"{name}: must be the name of a file, got {shown(value)}")
    path = Path(value)
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise ValueError(f"{name}: must be made of characters, got {shown(value)}") from None
    return path


def check_output(name: str, value: str | os.PathLike) -> Path:
    """A file that can be written, with folders around it that may be made; no folder itself."""
    path = check_path(name, value)
    if path.is_dir():
        raise ValueError(f"{name}: must be a file, got the folder '{path}'")
    return path


def check_choice(name: str, value: str, known: Iterable[str]) -> None:
    """One of the known names."""
    if not isinstance(value, str) or value not in known:
        raise ValueError(f"{name}: must be one of {', '.join(known)}, got {shown(value)}")


def check_integer(name: str, value: int, least: int = 0) -> int:
    """An integer of at least ``least``; with the default, a seed or an index."""
    if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
        raise ValueError(f"{name}: must be an integer of at least {least}, got {shown(value)}")
    if value >= 2**63:  # which is none to numpy and to most files
        raise ValueError(f"{name}: must be an integer below 2^63, got {shown(value)}")
    return int(value)


def check_number(name: str, value: float | Fraction) -> float:
    """A finite real number."""
    try:
        number = float(value) if isinstance(value, Real) and not isinstance(value, bool) else np.nan
    except OverflowError:
        number = np.inf
    if not np.isfinite(number):
        raise ValueError(f"{name}: must be a finite number, got {shown(value)}")
    return number


def check_positive(name: str, value: float) -> float:
    """A finite number above zero."""
    if check_number(name, value) <= 0:
        raise ValueError(f"{name}: must be positive, got {value}")
    return float(value)


def labels(values: Any) -> list[str]:
    """The names that values come with, as columns of a frame or entries of a series; else none."""
    own = getattr(values, "columns", getattr(values, "index", ()))
    own = [] if callable(own) else list(own)
    return own if all(isinstance(name, str) and name.isidentifier() for name in own) else []


def check_array(name: str, values: Any, names: Sequence[str] = ()) -> Floats:
    """Real numbers as an array of floats, in which what is masked or not available is NaN.

    Values that come with names are taken in the order of those given.
    """
    if names and (own := labels(values)):
        if not {*names} <= {*own}:
            raise ValueError(f"{name}: must be named like the variables, {[*names]}, got {own}")
        values = values[list(names)]
    if hasattr(values, "columns") and hasattr(values, "items"):  # each column has its type
        parts = [check_array(f"{name}: {key!r} ({x.dtype})", x) for key, x in values.items()]
        values = np.column_stack(parts) if parts else values
    advice = ""
    try:
        array = values if isinstance(values, np.ma.MaskedArray) else np.asarray(values)
        first = next(array.flat, None) if array.dtype.kind in "MmO" else None
        if isinstance(first, np.datetime64 | date):
            advice = (
                ": give seconds since the first: with t = np.array(t, 'datetime64[us]'), "
                "(t - t[0]) / np.timedelta64(1, 's')"
            )
        elif isinstance(first, np.timedelta64 | timedelta):
            advice = ": give seconds, np.array(t, 'timedelta64[us]') / np.timedelta64(1, 's')"
        # Beside numbers a boolean becomes one.
        told = [first] if isinstance(values, np.ndarray) else np.asarray(values, object).flat
        if array.dtype.kind not in "iufO" or any(isinstance(one, str | bool) for one in told):
            raise TypeError
        return np.ma.filled(array.astype(float, copy=False), np.nan)
    except MALFORMED:
        raise ValueError(
            f"{name}: must be an array of real numbers, got {shown(values)}{advice}"
        ) from None


def check_vector(name: str, values: ArrayLike, size: int, names: Sequence[str] = ()) -> Floats:
    """So many finite numbers, shape (size,); a copy."""
    vector = check_array(name, values, names).copy()
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise ValueError(f"{name}: must be {size} finite numbers, got {shown(values)}")
    return vector


def check_rows(name: str, values: ArrayLike, width: int) -> Floats:
    """Points or pixels row by row, shape (n, width); a row holding NaN is a missing one."""
    rows = check_array(name, values)
    if rows.ndim != 2 or rows.shape[1] != width:
        raise ValueError(f"{name}: must have shape (n, {width}), got {rows.shape}")
    if np.isinf(rows).any():
        raise ValueError(
            f"{name}: must be finite or NaN, got {np.isinf(rows).sum()} infinite values"
        )
    return rows


def check_tracks(tracks: Sequence[ArrayLike], cameras: int | None = None) -> list[Floats]:
    """Pixels of the target in each camera, (n_i, 2) each; so many if given."""
    given = check_items("tracks", tracks, cameras, "camera")
    if not given:
        raise ValueError("tracks: must be one per camera, got none")
    checked = [check_rows(f"tracks[{i}]", track, 2) for i, track in enumerate(given)]
    for i, track in enumerate(checked):
        largest = np.nanmax(np.abs(track), initial=0.0)
        if largest > FARTHEST:
            raise ValueError(
                f"tracks[{i}]: must be pixels of at most {FARTHEST:g}, got {largest:g}"
            )
    return checked


def check_times(t: ArrayLike, name: str = "t") -> Floats:
    """Finite, increasing times, at least one, shape (n,)."""
    t = check_array(name, t)
    if t.ndim != 1 or not len(t):
        raise ValueError(
            f"{name}: must hold at least one time, with shape (n,), got shape {t.shape}"
        )
    if not np.isfinite(t).all():
        raise ValueError(f"{name}: must be finite, got {t[~np.isfinite(t)][0]}")
    if (np.diff(t) <= 0).any():
        row = int(np.flatnonzero(np.diff(t) <= 0)[0])
        digits = 17 if t[row] == t[row + 1] else 6
        pair = " before ".join(f"{name}[{i}] = {t[i]:.{digits}g}" for i in (row, row + 1))
        single = digits == 17 and np.array_equal(t, t.astype(np.float32))
        advice = ", equal in single precision: give t in float64, or from zero" if single else ""
        raise ValueError(f"{name}: must increase, got {pair}{advice}")
    return t


def check_image_size(size: tuple[int, int], least: int = 1) -> tuple[int, int]:
    """Width and height in whole pixels."""
    try:
        width, height = size
        sides = check_integer("", width, least), check_integer("", height, least)
    except (TypeError, ValueError):
        raise ValueError(
            f"image_size: must be two integers of at least {least}, got {shown(size)}"
        ) from None
    if max(sides) > LARGEST_SIDE:
        raise ValueError(f"image_size: must be at most {LARGEST_SIDE} a side, got {shown(size)}")
    return sides
