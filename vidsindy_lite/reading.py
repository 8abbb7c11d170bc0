"""What comes from outside as files: text, trees and arrays, read through one door.

Whatever is wrong with such a file is said in one line: the argument, the file, the rule, and what
it holds instead. What a reader makes of what it gets here is its own; `reading` says whose file it
was if that is malformed.
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from .checks import MALFORMED, check_path

LARGEST_TEXT = 500_000_000
"""Bytes of a file of text: more does not fit into the memory that its tree needs."""
MOST_DIGITS = 300
"""Of a number: a longer one is none of ours."""
DEEPEST = 100
"""Levels of a tree: OpenCV's readers of deeper ones overflow their stack."""
TREES = (".toml", ".json", ".yaml", ".yml", ".xml")
"""Suffixes of files that hold a tree."""
_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
_HEAD = 4096  # characters that tell text from what is none


@contextmanager
def reading(name: str, path: Path) -> Iterator[None]:
    """Whatever the content of a file makes a reader raise, as one line that names the file."""
    try:
        yield
    except MALFORMED as error:
        first = (str(error).splitlines() or [""])[0]
        if isinstance(error, RecursionError):
            first = "must not be nested so deeply"
        elif not isinstance(error, ValueError):
            first = f"must not be malformed ({type(error).__name__}: {first:.60})"
        raise ValueError(f"{name}: {first}, in '{path}'") from error


def check_file(name: str, path: str | os.PathLike, what: str = "file") -> Path:
    """A file that is there, and its name one that can be shown.

    Raises
    ------
    FileNotFoundError, ValueError
    """
    file = check_path(name, path)
    try:
        found = file.is_file()
    except ValueError:  # no system has names with null characters
        found = False
    if not found:
        raise FileNotFoundError(f"{name}: no such {what}, got '{path}'")
    return file


def read_text(name: str, path: Path, kind: str, fallback: str | None = None) -> str:
    """A file of text in UTF-8, or in UTF-16 if its first bytes say so, or in the fallback.

    Raises
    ------
    ValueError
        If it is none, or holds a number of more digits than any number has.
    """
    size = path.stat().st_size
    if size > LARGEST_TEXT:
        raise ValueError(
            f"{name}: must be {kind} of at most {LARGEST_TEXT} bytes, got {size} in '{path}'"
        )
    raw = path.read_bytes()
    encoding = next((known for mark, known in _MARKS.items() if raw.startswith(mark)), "utf-8")
    text = None
    for one in filter(None, (encoding, fallback)):
        try:
            text = raw.decode(one)
            break
        except UnicodeDecodeError:
            continue
    if text is None or any(mark < " " and not mark.isspace() for mark in text[:_HEAD]):
        raise ValueError(f"{name}: must be {kind} in UTF-8, got '{path.name}', which is none")
    digits = re.search(rf"\d{{{MOST_DIGITS},}}", text)
    if digits:
        raise ValueError(
            f"{name}: must hold numbers of less than {MOST_DIGITS} digits, got {digits[0]:.20}... "
            f"in '{path}'"
        )
    return text.replace("\r\n", "\n")


def read_tree(name: str, path: Path, suffix: str) -> Any:
    """A file of TOML, JSON, or OpenCV's YAML, XML and JSON, as mappings, lists and values.

    Parameters
    ----------
    name : str
        Of the argument.
    path : Path
    suffix : str
        One of `TREES`, which tells what the file holds.

    Raises
    ------
    ValueError
        If it is none, or nested too deeply.
    """
    kind = f"a {suffix[1:].upper()} file"
    text = read_text(name, path, kind)
    try:
        if suffix == ".json" and '"opencv-matrix"' not in text:
            return json.loads(text)
        if _depth(text, suffix) > DEEPEST:
            raise RecursionError
        if suffix == ".toml":
            return tomllib.loads(text)
        memory = cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY
        storage = cv2.FileStorage(text, memory)
        try:
            return _plain(storage.root())
        finally:
            storage.release()
    except (*MALFORMED, cv2.error) as error:
        first = (str(error).splitlines() or [""])[0] or type(error).__name__
        if isinstance(error, RecursionError):
            first = f"it must be nested {DEEPEST} levels deep at most"
        raise ValueError(f"{name}: must be {kind}, got '{path}': {first}") from None


def _depth(text: str, suffix: str) -> int:
    """How deeply a tree is nested at most: never less than it is."""
    if suffix == ".xml":
        first, *rest = text.split("<!--")
        text = first + "".join(part.partition("-->")[2] for part in rest)
        tags = re.findall(r"<(/?)[^\s/<>!?][^<>]*?(/?)>", text)
        steps = [0 if closed else -1 if ends else 1 for ends, closed in tags]
        ahead = [""]
    else:
        text = re.sub(r'"(?:\\.|[^"\\\n])*"|#.*', "", text)  # brackets there open nothing
        steps = [1 if mark in "[{" else -1 for mark in re.findall(r"[][{}]", text)]
        if suffix == ".toml":  # the dots of a key open levels, too
            tokens = re.split(r"[\n,=\[\]]", text.replace(" ", "").replace("\t", ""))
            ahead = ["." * part.count(".") for part in tokens]
        else:  # as do indents and dashes of YAML
            ahead = re.findall(r"[ \t?:-]+", text)
    levels = np.cumsum([0, *steps])
    return int((levels - np.minimum.accumulate(levels)).max()) + max(map(len, ahead), default=0)


def _plain(node: Any) -> Any:
    """A node of OpenCV's files as mappings, lists and numbers."""
    if node.isMap():
        keys = node.keys()
        if {"rows", "cols", "data"} <= set(keys):
            matrix = node.mat()
            if matrix is not None:
                return matrix
            values = np.array(_plain(node.getNode("data")), dtype=float)
            return values.reshape(int(node.getNode("rows").real()), -1)
        return {key: _plain(node.getNode(key)) for key in keys}
    if node.isSeq():
        return [_plain(node.at(i)) for i in range(node.size())]
    return node.string() if node.isString() else node.real()


def read_arrays(name: str, path: Path) -> Any:
    """A file of numpy: an array, or a mapping of them; nothing of it is executed.

    Raises
    ------
    ValueError
        If it is none.
    """
    try:
        with open(path, "rb") as file:
            loaded = np.load(file)
            return loaded if isinstance(loaded, np.ndarray) else dict(loaded)
    except MALFORMED as error:
        first = (str(error).splitlines() or [""])[0] or type(error).__name__
        raise ValueError(
            f"{name}: must be a {path.suffix} file of numbers, got '{path}': {first:.80}"
        ) from None
