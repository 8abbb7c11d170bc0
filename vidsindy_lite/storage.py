"""Files: read through one door, written in one step; where the repository is, and its code's hash.

Whatever is wrong with a file from outside is said in one line: the argument, the file, the rule,
and what it holds instead. What a reader makes of what it gets here is its own; `reading` says whose
file it was if that is malformed.
"""

from __future__ import annotations

import ast
import glob
import hashlib
import json
import os
import re
import time
import tomllib
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import XMLPullParser

import cv2
import numpy as np

from .checks import MALFORMED, check_path

#: Bytes of a file of text: more does not fit into the memory that its tree needs.
LARGEST_TEXT = 500_000_000
MOST_DIGITS = 300  #: Of a number: a longer one is none of ours.
DEEPEST = 100  #: Levels of a tree: OpenCV's readers of deeper ones overflow their stack.
TREES = (".toml", ".json", ".yaml", ".yml", ".xml")  #: Suffixes of files that hold a tree.


@contextmanager
def reading(name: str, path: Path, kind: str | None = None) -> Iterator[None]:
    """Whatever the content of a file makes a reader raise, as one line that names the file.

    And what kind of file it has to be, if that is what is wrong with it.
    """
    try:
        yield
    except (*MALFORMED, cv2.error) as error:
        first = (str(error).splitlines() or [""])[0] or type(error).__name__
        if isinstance(error, RecursionError):
            first = f"must be nested {DEEPEST} levels deep at most"
        elif kind is None and not isinstance(error, ValueError):
            first = f"must not be malformed ({type(error).__name__}: {first:.60})"
        told = f"{first}, in '{path}'" if kind is None else f"must be {kind}, got '{path}': {first}"
        raise ValueError(f"{name}: {told}") from error


def check_file(name: str, path: str | os.PathLike, what: str = "file") -> Path:
    """A file that is there, and its name one that can be shown.

    Raises
    ------
    FileNotFoundError, ValueError
    """
    file = check_path(name, path)
    if not file.is_file():
        raise FileNotFoundError(f"{name}: no such {what}, got {str(path)!r}")
    return file


def read_text(name: str, path: Path, kind: str, fallback: str | None = None) -> str:
    """A file of text in UTF-8, or in UTF-16 if its first bytes say so, or in the fallback.

    That is an encoding in which all bytes are characters.

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
    encoding = "utf-16" if raw.startswith((BOM_UTF16_LE, BOM_UTF16_BE)) else "utf-8-sig"
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError:
        text = raw.decode(fallback) if fallback else "\0"  # which no text holds
    if any(mark < " " and not mark.isspace() for mark in text[:4096]):
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
    kind = f"a {suffix[1:].upper()} file{' of OpenCV' * (suffix not in ('.json', '.toml'))}"
    text = read_text(name, path, kind)
    with reading(name, path, kind):
        if suffix == ".json" and '"opencv-matrix"' not in text:
            return json.loads(text)
        if _depth(text, suffix) > DEEPEST:
            raise RecursionError
        if suffix == ".toml":
            return tomllib.loads(text)
        try:
            storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        except (cv2.error, SystemError):
            keys = ", ".join(re.findall(r"^<?(\w+)[^:>\n]*[:>]", text, re.MULTILINE)[:5])
            raise ValueError(f"OpenCV cannot read it, which holds {keys or 'no keys'}") from None
        return _plain(storage.root())


def _depth(text: str, suffix: str) -> int:
    """How deeply a tree is nested at most: never less than it is."""
    if suffix == ".xml":
        parser: XMLPullParser = XMLPullParser(("start", "end"))
        parser.feed(text)
        steps = [1 if event[0] == "start" else -1 for event in parser.read_events()]
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
        if {"sizes", "dt", "data"} <= set(keys):  # of another number of axes than two
            sizes = np.array(_plain(node.getNode("sizes")), dtype=int)
            return np.array(_plain(node.getNode("data")), dtype=float).reshape(sizes)
        if {"rows", "cols", "data"} <= set(keys):
            if "dt" in keys:
                return node.mat()
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
    with reading(name, path, f"a {path.suffix} file of numbers"), open(path, "rb") as file:
        loaded = np.load(file)
        return loaded if isinstance(loaded, np.ndarray) else dict(loaded)


# ------------------------------------------------------------------------------------------ written


def write_file(path: Path, content: bytes) -> None:
    """Replace a file in one step, so an interrupted run leaves the old one or the new one."""
    write_files({path: content})


def write_json(path: Path, content: object) -> None:
    """Replace a file by a tree as JSON, with null for NaN, and a number beyond all for infinity."""
    text = re.sub(r"(?m)NaN(?=,?$)", "null", json.dumps(content, indent=1))  # text ends in a quote
    write_file(path, re.sub(r"(?m)Infinity(?=,?$)", "1e999", f"{text}\n").encode())


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Replace files when all are written beside them; a link is followed, a device written to.

    A full disk or a killed run leaves the old ones. What a killed run of this machine has left
    beside them is removed.
    """
    beside: dict[Path, Path] = {}
    try:
        for given, content in contents.items():
            path = given.resolve()  # a link stays one
            if path.exists() and not path.is_file():  # such as /dev/stdout
                path.write_bytes(content)
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            for left in path.parent.glob(f".{glob.escape(path.name)}.*"):
                if left.suffix[1:].isdecimal() and not _is_running(int(left.suffix[1:])):
                    left.unlink(missing_ok=True)
            beside[path] = path.with_name(f".{path.name}.{os.getpid()}")
            beside[path].write_bytes(content)
            if path.exists():
                beside[path].chmod(path.stat().st_mode)
        for path, new in beside.items():
            new.replace(path)
    finally:
        for new in beside.values():
            new.unlink(missing_ok=True)


def _is_running(process: int) -> bool:
    """Whether a process of this number is there; where that cannot be told, it is."""
    try:
        os.kill(process, 0) if os.name == "posix" else None
    except (ProcessLookupError, PermissionError, OverflowError) as error:
        return not isinstance(error, ProcessLookupError)
    return True


# ----------------------------------------------------------------------------------- the repository

NAME = __name__.partition(".")[0]
PACKAGE = Path(__file__).parent
#: On whose versions results depend.
LIBRARIES = (
    "numpy", "scipy", "scikit-learn", "torch", "pysindy", "opencv-python-headless", "av", "pandas",
    "matplotlib", "seaborn",
)  # fmt: skip
#: Folders and modules of the package that compute no result of a sweep.
RESULTLESS = ("companion", "plots", "__main__")
_READ = time.time_ns()  # when the code of this process was read


def repository_root(start: str | os.PathLike | None = None) -> Path:
    """The repository around a folder: the nearest parent that holds notebooks/ and vidsindy_lite/.

    Parameters
    ----------
    start : path, optional
        Where to begin; the working directory by default.

    Raises
    ------
    FileNotFoundError
        If neither the folder nor one of its parents is a clone of the repository.
    """
    start = Path.cwd() if start is None else Path(start).resolve()
    for folder in (start, *start.parents):
        if (folder / "notebooks").is_dir() and (folder / NAME).is_dir():
            return folder
    raise FileNotFoundError(
        f"repository: expected to be inside a clone of {NAME} (a folder with notebooks/ and "
        f"{NAME}/), got {str(start)!r}"
    )


def library_versions() -> list[str]:
    """The libraries that results depend on and that are installed, e.g. "numpy 2.4.6"."""
    installed = {found.name.lower(): found.version for found in metadata.distributions()}
    return [f"{name} {installed[name]}" for name in LIBRARIES if name in installed]


def edited() -> bool:
    """Whether code of the package was written since this process read it: it may run either."""
    return any(file.stat().st_mtime_ns > _READ for file in PACKAGE.rglob("*.py"))


@cache
def code_hash(without: tuple[str, ...] = ()) -> str:
    """Hash of the package's code and data and of the libraries; comments and layout do not count.

    It is the key of what is kept in build/, and stands in nothing that is committed.

    Parameters
    ----------
    without : tuple of str
        Names of folders and modules that do not count either, such as `RESULTLESS`.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    digest = hashlib.sha256("\n".join(library_versions()).encode())
    for file in sorted(PACKAGE.rglob("*")):
        place = file.relative_to(PACKAGE)
        left_out = {*place.parts[:-1], place.stem} & {*without, "__pycache__"}
        if left_out or not file.is_file() or file.suffix == ".pyc":
            continue
        content = _content(file, file.stat().st_mtime_ns)
        digest.update(f"{place.as_posix()}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()[:16]


@cache  # a run hashes before and after each notebook, and reading all code takes a second
def _content(file: Path, written: int) -> bytes:
    """What counts of a file as it was written at a time."""
    content = file.read_bytes()
    return ast.dump(ast.parse(content)).encode() if file.suffix == ".py" else content
