"""Values as trees that JSON holds, number by number, and back: arrays, dataclasses, collections."""

import base64
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from scipy.interpolate import BSpline

KINDS = {"f": np.float64, "i": np.int64, "b": np.bool_}
"""Of the numbers of arrays, by numpy's letters."""


def encoded(value: Any, name: Callable[[type], str], named: tuple[Any, ...] = ()) -> Any:
    """A value as a tree of dicts, lists, numbers, text and None.

    Parameters
    ----------
    value : object
        Numbers, text, None, arrays, splines, dataclasses, and tuples, lists and dicts of them.
    name : callable
        What the type of a dataclass is called in the tree.
    named : tuple of type
        Of these, the tree holds the attribute `name` alone.

    Raises
    ------
    TypeError
        If there is anything else in it.
    """

    def tree(value: Any) -> Any:
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, np.ndarray) and value.dtype == np.uint8:  # such as an image
            pixels = base64.b64encode(value.tobytes()).decode()
            return {"type": "bytes", "shape": list(value.shape), "values": pixels}
        if isinstance(value, np.ndarray) and KINDS.get(value.dtype.kind) == value.dtype:
            shape = {} if value.size else {"shape": list(value.shape)}
            return {"type": "array", "dtype": value.dtype.kind, "values": value.tolist(), **shape}
        if isinstance(value, named):
            return value.name
        if isinstance(value, BSpline):
            return {"type": "spline", "t": tree(value.t), "c": tree(value.c), "k": value.k}
        if isinstance(value, tuple):
            return [tree(item) for item in value]
        if isinstance(value, list):
            return {"type": "list", "items": [tree(item) for item in value]}
        if isinstance(value, dict):
            return {"type": "dict", "items": [[tree(k), tree(v)] for k, v in value.items()]}
        if is_dataclass(value):
            parts = {field.name: tree(getattr(value, field.name)) for field in fields(value)}
            return {"type": name(type(value)), **parts}
        raise TypeError(
            "value: must be numbers, text, None, arrays, dataclasses and collections of them, "
            f"got {type(value).__name__}"
        )

    return tree(value)


def decoded(tree: Any, build: Callable[[str, dict[str, Any]], Any]) -> Any:
    """The value of a tree; `build` makes a dataclass of its name in the tree and its fields.

    Raises
    ------
    ValueError, TypeError, KeyError
        If `encoded` has made no such tree.
    """
    if isinstance(tree, list):
        return tuple(decoded(item, build) for item in tree)
    if not isinstance(tree, dict):
        return tree
    kind = tree["type"]
    if kind == "bytes":
        pixels = np.frombuffer(base64.b64decode(tree["values"]), np.uint8)
        return pixels.reshape(tree["shape"]).copy()
    if kind == "array":
        values: np.ndarray = np.array(tree["values"], dtype=KINDS[tree["dtype"]])
        return values.reshape(tree.get("shape", values.shape))
    if kind == "list":
        return list(decoded(tree["items"], build))
    if kind == "dict":
        return dict(decoded(tree["items"], build))
    parts = {name: decoded(part, build) for name, part in tree.items() if name != "type"}
    return BSpline(parts["t"], parts["c"], parts["k"]) if kind == "spline" else build(kind, parts)


def as_json(value: object, name: str, digits: int = 17) -> Any:
    """A value as other programs' JSON has it: no types, and None for what is not finite.

    Parameters
    ----------
    value : object
        Numbers, text, None, and arrays and nestings of them.
    name : str
        Of the argument, for the error.
    digits : int
        Significant ones of a float; the default keeps it exactly.

    Raises
    ------
    TypeError
        If there is anything else in it.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return float(f"{value:.{digits}g}") if np.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(k): as_json(item, f"{name}[{k!r}]", digits) for k, item in value.items()}
    if isinstance(value, Sequence):
        return [as_json(item, name, digits) for item in value]
    raise TypeError(
        f"{name}: expected numbers, text, None, or arrays and mappings of them, got {value!r}"
    )
