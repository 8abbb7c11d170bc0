"""A discovery as a text file: JSON in which every number keeps all its digits."""

from __future__ import annotations

import json
import os
from dataclasses import fields, is_dataclass, replace
from typing import Any, cast

import numpy as np
from scipy.interpolate import BSpline

from ..checks import check_output, check_path
from .candidates import Library, restored
from .discovery import Discovery
from .history import Step
from .library import Function
from .persistence import Plateau
from .polynomials import PolynomialSystem
from .rounds import Round
from .swing import Swing

FORMAT = "vidsindy_lite discovery, version 1"
TYPES: dict[str, Any] = {
    kind.__name__: kind for kind in (Discovery, PolynomialSystem, Plateau, Step, Swing, Round)
}


def write(found: Discovery, path: str | os.PathLike) -> None:
    """Write a discovery to a file."""
    file = check_output("path", path)
    text = json.dumps({"format": FORMAT, "discovery": _encoded(found)}, indent=1)
    file.write_text(text + "\n", encoding="utf-8")


def read(path: str | os.PathLike, library: Library | None = None) -> Discovery:
    """Read a discovery from a file that `write` has made.

    Functions of one's own are those of the library: a file holds their names.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file holds none, or the library not all functions of the law.
    """
    file = check_path("path", path)
    message = f"path: must be a file that Discovery.save has written, got '{file}'"
    if not file.is_file():
        raise FileNotFoundError(f"{message}, which does not exist")
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        found = _decoded(content["discovery"]) if content["format"] == FORMAT else None
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(message) from error
    if not isinstance(found, Discovery):
        raise ValueError(message)
    found = _with_functions(found, library)
    if found.swing is None:
        return found
    return replace(found, swing=replace(found.swing, law=_with_functions(found.swing.law, None)))


def _with_functions(found: Discovery, library: Library | None) -> Discovery:
    """A discovery with the functions of which a file holds the names."""
    system, native = found.system, found.native
    written = cast("tuple[str, ...]", system.functions)
    functions = restored(system.names, system.d // system.order, written, library)
    return replace(
        found,
        system=replace(system, functions=functions),
        native=replace(native, functions=functions),
    )


def _encoded(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return {"type": "array", "dtype": value.dtype.kind, "values": value.tolist()}
    if isinstance(value, BSpline):
        return {"type": "spline", "t": _encoded(value.t), "c": _encoded(value.c), "k": value.k}
    if isinstance(value, Function):
        return value.name
    if is_dataclass(value):
        parts = {field.name: _encoded(getattr(value, field.name)) for field in fields(value)}
        return {"type": type(value).__name__, **parts}
    if isinstance(value, tuple | list):
        return [_encoded(item) for item in value]
    return value


def _decoded(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_decoded(item) for item in value)
    if not isinstance(value, dict):
        return value
    kind = value["type"]
    if kind == "array":
        return np.array(value["values"], dtype={"f": float, "i": int, "b": bool}[value["dtype"]])
    parts = {name: _decoded(part) for name, part in value.items() if name != "type"}
    return BSpline(parts["t"], parts["c"], parts["k"]) if kind == "spline" else TYPES[kind](**parts)
