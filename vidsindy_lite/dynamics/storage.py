"""A discovery as a text file: JSON in which every number keeps all its digits."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Any, cast

import numpy as np

from ..arrays import Bools, Floats
from ..checks import MALFORMED, check_array, check_output, shown
from ..reading import check_file, read_tree
from ..repository import write_file
from ..values import built, decoded, encoded
from .candidates import Library, harmonic
from .discovery import Discovery
from .history import Step
from .library import Function, extended
from .persistence import Plateau
from .polynomials import PolynomialSystem
from .rounds import Round
from .swing import Swing

POINTS = 20
"""Places on the curve where a file holds the values of the law's functions."""
ALIKE = 1e-6
"""Difference of such values, over the largest, by which a function is still the same."""
FORMAT = "vidsindy_lite discovery, version 1"
TYPES: dict[str, Any] = {
    kind.__name__: kind for kind in (Discovery, PolynomialSystem, Plateau, Step, Swing, Round)
}


def write(found: Discovery, path: str | os.PathLike) -> None:
    """Write a discovery to a file."""
    file = check_output("path", path)
    content = {
        "format": FORMAT,
        "functions": encoded(_values(found), str),
        "discovery": encoded(found, attrgetter("__name__"), (Function,)),
    }
    text = json.dumps(content, indent=1)
    write_file(file, f"{text}\n".encode())


def read(path: str | os.PathLike, library: Library | None = None) -> Discovery:
    """Read a discovery from a file that `write` has made.

    Functions of one's own are those of the library: a file holds their names, and a few values
    by which another function of that name is told.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file holds none, or the library not all functions of the law, or others.
    """
    file = check_file("path", path, "file of a discovery")
    content = read_tree("path", file, ".json")
    message = f"path: must be a file that Discovery.save has written, got '{file}'"
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ValueError(f"{message}, whose format is not {FORMAT!r}")
    try:
        found = decoded(content["discovery"], _built)
        values = decoded(content.get("functions"), _built)
        if values is not None:
            values = check_array("functions", values)
        _check_shapes(found)
    except MALFORMED as error:
        raise ValueError(f"{message}: {shown(error)}") from error
    found = _with_functions(found, library)
    if values is not None:  # of a file of today
        _check_alike(found, values)
    if found.swing is None:
        return found
    return replace(found, swing=replace(found.swing, law=_with_functions(found.swing.law, None)))


def _with_functions(found: Discovery, library: Library | None) -> Discovery:
    """A discovery with the functions of which a file holds the names."""
    system, native = found.system, found.native
    written = cast("tuple[str, ...]", system.functions)
    measured, used = system.d // system.order, _used(found)
    functions = _restored(system.names, measured, written, used, library)
    return replace(
        found,
        system=replace(system, functions=functions),
        native=replace(native, functions=functions),
    )


def _restored(
    names: tuple[str, ...],
    measured: int,
    written: Sequence[str],
    used: Bools,
    library: Library | None,
) -> tuple[Function, ...]:
    """Functions by their names; one's own, if the law uses them, from a library that holds them."""
    _, held = (library or Library()).resolve(names, measured)
    known = {function.name: function for function in held}
    functions = []
    for name, needed in zip(written, used, strict=True):
        match = re.fullmatch(r"(sin|cos)\((?:(\d+) )?(\w+)\)", name)
        if name in known:
            functions.append(known[name])
        elif match and match[3] in names:
            functions.append(harmonic(names, names.index(match[3]), int(match[2] or 1), match[1]))
        elif not needed:
            functions.append(Function.unknown(name))
        else:
            raise ValueError(
                f"library: must hold the function {name!r} of the law, as a file holds its name "
                f"alone; got {library or 'none'}"
            )
    return tuple(functions)


def _used(found: Discovery) -> Bools:
    """Which functions of the library are in the law, in either frame."""
    rows = (found.system.support | found.native.support).any(axis=1)
    d, k = found.system.d, len(found.system.functions)
    return np.asarray(found.system.exponents[rows, d : d + k].any(axis=0))


def _values(found: Discovery) -> Floats:
    """What the functions of a law are at a few places on its curve, (n, k)."""
    d, knots = found.system.d, np.concatenate([curve.t for curve in found.curves])
    x = found.curve(np.quantile(knots, np.linspace(0, 1, POINTS), method="nearest"))
    return extended(x, found.system.functions)[:, d:]


def _check_alike(found: Discovery, written: Floats) -> None:
    """Refuse functions that have other values than when the law was written."""
    values = np.where(_used(found), _values(found), written)
    size = np.where(np.isfinite(written), np.abs(written), 0.0).max(axis=0)
    alike = np.isclose(values, written, rtol=0, atol=ALIKE * size, equal_nan=True).all(axis=0)
    if not alike.all():
        name = found.system.functions[int(alike.argmin())].name
        raise ValueError(
            f"library: must hold the function {name!r} that the law was found with, got another of "
            "that name"
        )


def _built(kind: str, parts: dict[str, Any]) -> Any:
    """What a file holds under the name of a type; functions are there by their names."""
    if kind not in TYPES:
        raise ValueError(f"a type must be one of {', '.join(TYPES)}, got {shown(kind)}")
    return built(TYPES[kind], parts, TYPES | {"Function": str})


def _check_shapes(found: Any) -> None:
    """Refuse a discovery whose parts are of different laws."""
    if not isinstance(found, Discovery):
        raise ValueError(f"it must hold a Discovery, got {type(found).__name__}")
    d, here, native = found.system.d, *(len(law.exponents) for law in (found.system, found.native))
    shapes = {
        "offset": (d,), "offset_errors": (d,), "covariance": (here * d, here * d),
        "native_covariance": (native * d, native * d), "absent": (native, d, 2),
    }  # fmt: skip
    for name, shape in shapes.items():
        if getattr(found, name).shape != shape:
            raise ValueError(f"{name} must have shape {shape}, got {getattr(found, name).shape}")
    if not found.curves or found.native.d != d:
        raise ValueError(f"it must hold curves, and two laws of {d} variables")
