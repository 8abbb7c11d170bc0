"""Records of figures and tables as JSON files: plain values, one line per entry, read with care."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

RUN_TIMES = "run_times.json"  # of the notebooks, beside the records
RECORD = {"id", "kind", "notebook", "stamp", "caption", "files"}  # what each has


def as_json(value: object, name: str, digits: int = 17) -> object:
    """A value as JSON has it.

    Parameters
    ----------
    value : object
        Numbers, text, None, and arrays and nestings of them. What is not finite becomes None.
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
        return float(f"{value:.{digits}g}") if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(k): as_json(item, f"{name}[{k!r}]", digits) for k, item in value.items()}
    if isinstance(value, Sequence):
        return [as_json(item, name, digits) for item in value]
    raise TypeError(
        f"{name}: expected numbers, text, None, or arrays and mappings of them, got {value!r}"
    )


def json_bytes(content: dict) -> bytes:
    """JSON with one line per entry, one more level for mappings and lists of mappings."""

    def entry(value: object) -> str:
        if isinstance(value, dict) and value:
            items = (f"  {json.dumps(k)}: {json.dumps(v)}" for k, v in value.items())
            return "{\n" + ",\n".join(items) + "\n }"
        if isinstance(value, list) and value and isinstance(value[0], dict):
            return "[\n" + ",\n".join(f"  {json.dumps(item)}" for item in value) + "\n ]"
        return json.dumps(value)

    lines = (f" {json.dumps(key)}: {entry(value)}" for key, value in content.items())
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode()


def read_json(path: Path) -> dict:
    """An object from a JSON file; empty if there is none, or the file is damaged."""
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def read_records(folder: Path) -> dict[str, dict]:
    """All records by id, in the order of a reader: S2 before S10."""
    contents = [read_json(path) for path in folder.glob("*.json") if path.name != RUN_TIMES]
    found = {content["id"]: content for content in contents if content.keys() >= RECORD}

    def order(artifact_id: str) -> list:
        return [int(p) if p.isdigit() else p for p in re.split(r"(\d+)", artifact_id)]

    return {artifact_id: found[artifact_id] for artifact_id in sorted(found, key=order)}
