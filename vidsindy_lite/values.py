"""Values as trees that JSON holds, number by number, and back: arrays, dataclasses, collections."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from scipy.interpolate import BSpline

#: Of the numbers of arrays, by numpy's letters.
KINDS = {"f": np.float64, "i": np.int64, "b": np.bool_}


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
    if kind == "array":
        values: np.ndarray = np.array(tree["values"], dtype=KINDS[tree["dtype"]])
        return values.reshape(tree.get("shape", values.shape))
    if kind == "list":
        return list(decoded(tree["items"], build))
    if kind == "dict":
        return dict(decoded(tree["items"], build))
    parts = {name: decoded(part, build) for name, part in tree.items() if name != "type"}
    return BSpline(parts["t"], parts["c"], parts["k"]) if kind == "spline" else build(kind, parts)


def built(kind: type, parts: dict[str, Any], known: dict[str, Any]) -> Any:
    """A dataclass of its fields, if each is of the type that its annotation states.

    Parameters
    ----------
    kind : type
    parts : dict
        Values of all fields that have no default, by name.
    known : dict of str to type
        What annotations may name besides what the module of `kind` does.

    Raises
    ------
    ValueError
        If a field is missing, of another type, or none.
    """
    hints = get_type_hints(kind, localns=known)
    strange = next((name for name in parts if name not in hints), None)
    if strange is not None:
        raise ValueError(f"{kind.__name__} must have no {strange!r:.40}")
    # JSON has no NaN.
    parts = {k: np.nan if v is None and hints[k] is float else v for k, v in parts.items()}
    for name, value in parts.items():
        if not _is_of(value, hints[name]):
            wanted = getattr(hints[name], "__name__", hints[name])
            raise ValueError(f"{name} of {kind.__name__} must be {wanted}, got {value!r:.40}")
    return kind(**parts)


def _is_of(value: Any, hint: Any) -> bool:
    """Whether a value is of the type of an annotation, those of its items included."""
    origin, inner = get_origin(hint), get_args(hint)
    origin = get_origin(getattr(origin, "__value__", hint))  # of an alias, as newer numpys have it
    if hint is Any:
        return True
    if origin in (Union, UnionType):
        return any(_is_of(value, one) for one in inner)
    if origin is tuple:
        return isinstance(value, tuple) and all(_is_of(item, inner[0]) for item in value)
    if hint in (float, int):
        return isinstance(value, hint | int) and not isinstance(value, bool)
    return value is None if hint is NoneType else isinstance(value, origin or hint)


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
