"""Stamps: hashes of what a result depends on. Beside them, where the repository is.

The code of a notebook, or the function of a sweep, depends on the modules that it imports from the
package, and on those that they import, imports inside functions included. An import through a front
door (an ``__init__.py``) leads to the module that defines the name, not to all of the room. Where
figures are drawn and written each function counts for itself, with what it uses of its module. To a
module belong the data files that it names, and those that are named like it.
"""

import ast
import hashlib
import os
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

__all__ = ["LIBRARIES", "PACKAGE", "code_stamp", "repository_root", "source_stamp", "write_file"]

NAME = __name__.partition(".")[0]
PACKAGE = Path(__file__).parent
# Whose pins in requirements.txt are part of every stamp: results depend on them.
LIBRARIES = (
    "numpy", "scipy", "scikit-learn", "torch", "pysindy", "opencv-python-headless", "av", "pandas",
    "matplotlib",
)  # fmt: skip

BY_DEFINITION = tuple(
    f"{NAME}.{module}" for module in ("study.plots", "companion.artifacts", "companion.records")
)
WITHOUT_RESULTS = (f"{NAME}.companion", f"{NAME}.stamp")  # but for those above
NO_DATA = {".py", ".pyc", ".checkpoint"}  # suffixes


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


def write_file(path: Path, content: bytes) -> None:
    """Replace a file in one step, so an interrupted run leaves the old one or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    beside.write_bytes(content)
    beside.replace(path)


# ------------------------------------------------------------------------------------------- stamps


def source_stamp(source: str, root: str | os.PathLike | None = None) -> str:
    """Hash of a piece of code, such as a notebook's, and of all that its results depend on.

    Parameters
    ----------
    source : str
        Python that imports from the package. It counts as it is; of the package, comments,
        docstrings and layout do not count. If it cannot be parsed, all of the package counts.
    root : path, optional
        The repository, whose requirements.txt pins the libraries; they do not count without it.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    try:
        part = _part(source, "", False, None)
    except SyntaxError:
        part = _Part("", frozenset({(NAME, ())}), frozenset())
    return _digest(part, root, source)


def code_stamp(function: Callable, root: str | os.PathLike | None = None) -> str:
    """Hash of all that the results of a function of the package depend on.

    Parameters
    ----------
    function : callable
        A top-level function of the package.
    root : path, optional
        As of `source_stamp`.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    home, name = function.__module__, function.__qualname__
    return _digest(_Part("", frozenset({(home, (name,))}), frozenset()), root, f"{home}.{name}")


def _digest(start: "_Part", root: str | os.PathLike | None, first: str) -> str:
    parts, files = _reached(start)
    digest = hashlib.sha256(first.encode())
    for node in sorted(parts, key=str):
        digest.update(f"\0{node}\0{parts[node].meaning}".encode())
    for file in files:
        digest.update(b"\0" + file.relative_to(PACKAGE).as_posix().encode() + b"\0")
        digest.update(file.read_bytes())
    if root is not None:
        digest.update("\0".join(_pins(Path(root) / "requirements.txt")).encode())
    return digest.hexdigest()[:16]


def _pins(requirements: Path) -> list[str]:
    """The lines of requirements.txt on the libraries that results depend on."""
    lines = re.findall(r"^[\w.-]+==[\w.+]+", requirements.read_text("utf-8"), re.MULTILINE)
    return sorted(line for line in lines if line.partition("==")[0] in LIBRARIES)


# -------------------------------------------------------------------------------- what is reached

IMPORTS = (ast.Import, ast.ImportFrom)
Reference = tuple[str, tuple[str, ...]]  # a module, and a dotted name in it


class _Node(NamedTuple):
    """A module, or one of its definitions."""

    module: str
    name: str | None = None


@dataclass(frozen=True)
class _Part:
    """What a piece of code does, where it leads, and its strings, which may name data files."""

    meaning: str
    references: frozenset[Reference]
    strings: frozenset[str]


def _reached(start: _Part) -> tuple[dict[_Node, _Part], list[Path]]:
    """The parts of the package that some code leads to, and their data files."""
    parts: dict[_Node, _Part] = {}
    todo, strings = set(start.references), set(start.strings)
    seen: set[Reference] = set()
    beside: set[Path] = set()
    while todo:
        seen.add(reference := todo.pop())
        for node in _nodes(*reference):
            file = _file(node.module)
            if file and node not in parts:
                source, is_front_door = file.read_text("utf-8"), file.name == "__init__.py"
                parts[node] = _part(source, node.module, is_front_door, node.name)
                todo |= parts[node].references - seen
                strings |= parts[node].strings
                beside.add(file.with_suffix(""))
    text = "\n".join(strings)
    return parts, [
        file
        for file in sorted(PACKAGE.rglob("*"))
        if file.suffix not in NO_DATA and file.is_file()
        if file.with_suffix("") in beside or _is_named(file, text)
    ]


def _is_named(file: Path, text: str) -> bool:
    """Whether a text holds a data file's name, or its dotted one, as matplotlib has it."""
    dotted = ".".join((NAME, *file.relative_to(PACKAGE).with_suffix("").parts))
    return file.name in text or dotted in text


def _nodes(module: str, names: tuple[str, ...]) -> Iterator[_Node]:
    """What a dotted name in a module of the package counts as."""
    file = _file(module)
    if file is None or not names or file.name != "__init__.py":
        yield from _whole(module) if not names else _one(module, names[0])
        return
    name, *rest = names
    imported, defined = _top_level(file.read_text("utf-8"), module)
    # `from . import room` in a front door leads to the module of that name, not to itself.
    if targets := [t for t in imported.get(name, []) if t != (module, (name,))]:
        for target, place in targets:
            yield from _nodes(target, (*place, *rest))
    elif name in defined:
        yield _Node(module, name)
    elif _file(f"{module}.{name}"):
        yield from _nodes(f"{module}.{name}", tuple(rest))
    else:
        yield from _whole(module)


def _one(module: str, name: str) -> Iterator[_Node]:
    """A definition, or all of its module where definitions do not count for themselves."""
    if _is_under(module, BY_DEFINITION):
        yield _Node(module, name)
    elif _file(module) and not _is_under(module, WITHOUT_RESULTS):
        yield _Node(module)


def _whole(module: str) -> Iterator[_Node]:
    """A module, or every module of a folder."""
    file = _file(module)
    if file is None:
        return
    for each in sorted(file.parent.rglob("*.py")) if file.name == "__init__.py" else [file]:
        parts = each.relative_to(PACKAGE).with_suffix("").parts
        dotted = ".".join((NAME, *(part for part in parts if part != "__init__")))
        if _is_under(dotted, BY_DEFINITION) or not _is_under(dotted, WITHOUT_RESULTS):
            yield _Node(dotted)


def _is_under(module: str, folders: Iterable[str]) -> bool:
    return any(f"{module}.".startswith(f"{folder}.") for folder in folders)


def _file(module: str) -> Path | None:
    """The file of a module of the package; None if there is none."""
    first, *rest = module.split(".")
    place = PACKAGE.joinpath(*rest)
    files = (place / "__init__.py", place.parent / f"{place.name}.py")
    return next((file for file in files if first == NAME and file.is_file()), None)


# ------------------------------------------------------------------------------ reading one source

_tree = cache(ast.parse)


@cache
def _part(source: str, module: str, is_front_door: bool, name: str | None) -> _Part:
    """One definition of a module, or all of it if no name is given."""
    body = [line for line in _tree(source).body if not _is_bare_constant(line)]
    package = module if is_front_door else module.rpartition(".")[0]
    outer: dict[str, list[Reference]] = {}
    if name is not None:
        outer = {n: [(module, (n,))] for line in body for n in _binds(line) - {name}}
        outer |= _imports((line for line in body if isinstance(line, IMPORTS)), package)
        # What binds no name works by itself, as a call or a condition does.
        body = [line for line in body if name in _binds(line) or not _binds(line)]
    names = _Names()
    for line in body:
        names.visit(line)
    inner = _imports(body, package)
    bound = inner | {n: places for n, places in outer.items() if n in names.chains}
    references = {
        (place, (*first, *chain))
        for n, places in bound.items()
        for place, first in places
        for chain in names.chains.get(n, {()})
    }
    meaning = [_meaning(body), sorted((n, bound[n]) for n in bound.keys() - inner.keys())]
    return _Part(repr(meaning), frozenset(references), frozenset(names.strings))


@cache
def _top_level(source: str, module: str) -> tuple[dict[str, list[Reference]], set[str]]:
    """What a front door imports and what it defines, by name."""
    body = _tree(source).body
    imports = _imports(body, module)
    return imports, {name for line in body for name in _binds(line)} - imports.keys()


def _imports(code: Iterable[ast.stmt], package: str) -> dict[str, list[Reference]]:
    """Where the names lead that some code imports, functions included."""
    found: dict[str, list[Reference]] = {}
    for node in (node for line in code for node in ast.walk(line)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                place = alias.name if alias.asname else alias.name.partition(".")[0]
                found.setdefault(alias.asname or place, []).append((place, ()))
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - node.level]
            place = ".".join(filter(None, [*(above if node.level else ()), node.module]))
            for alias in node.names:
                names = () if alias.name == "*" else (alias.name,)
                found.setdefault(alias.asname or alias.name, []).append((place, names))
    return found


class _Names(ast.NodeVisitor):
    """Collects names, each with the attributes asked of it ("a.b.c" is a: b, c), and strings."""

    def __init__(self) -> None:
        self.chains: dict[str, set[tuple[str, ...]]] = {}
        self.strings: set[str] = set()

    def visit_Attribute(self, node: ast.Attribute) -> None:
        chain, base = [node.attr], node.value
        while isinstance(base, ast.Attribute):
            chain, base = [base.attr, *chain], base.value
        if isinstance(base, ast.Name):
            self.chains.setdefault(base.id, set()).add(tuple(chain))
        else:
            self.visit(base)

    def visit_Name(self, node: ast.Name) -> None:
        self.chains.setdefault(node.id, set()).add(())

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, str):
            self.strings.add(node.value)


def _binds(line: ast.stmt) -> set[str]:
    """Names that a statement of a module defines or imports; none if it is compound."""
    if isinstance(line, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return {line.name}
    if isinstance(line, IMPORTS):
        return {alias.asname or alias.name.partition(".")[0] for alias in line.names}
    targets: list[ast.expr] = []
    if isinstance(line, ast.Assign | ast.AnnAssign):
        targets = line.targets if isinstance(line, ast.Assign) else [line.target]
    return {n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)}


def _meaning(node: object) -> object:
    """What code does, as lists: its syntax tree without bare constants, docstrings among them."""
    if isinstance(node, list):
        return [_meaning(n) for n in node if not _is_bare_constant(n)]
    if isinstance(node, ast.AST):
        fields = [(name, _meaning(value)) for name, value in ast.iter_fields(node)]
        # Empty fields differ between versions of Python.
        return [type(node).__name__, *(f for f in fields if f[1] not in (None, []))]
    return node


def _is_bare_constant(node: object) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
