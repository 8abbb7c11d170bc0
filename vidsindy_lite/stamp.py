"""Stamps: hashes of what a result depends on; where the repository is; files written in one step.

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

NAME = __name__.partition(".")[0]
PACKAGE = Path(__file__).parent
# Whose pins in requirements.txt are part of every stamp: results depend on them.
LIBRARIES = (
    "numpy", "scipy", "scikit-learn", "torch", "pysindy", "opencv-python-headless", "av", "pandas",
    "matplotlib", "seaborn",
)  # fmt: skip

BY_DEFINITION = tuple(
    f"{NAME}.{module}." for module in ("study.plots", "companion.artifacts", "companion.records")
)
WITHOUT_RESULTS = (f"{NAME}.companion.", f"{NAME}.stamp.")  # but for those above
IMPORTS = (ast.Import, ast.ImportFrom)
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
    try:
        beside.write_bytes(content)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


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
    parts, files = _reached(part)
    digest = hashlib.sha256(source.encode())
    for node in sorted(parts):
        digest.update(f"\0{node}\0{parts[node].meaning}".encode())
    for file in files:
        digest.update(b"\0" + file.relative_to(PACKAGE).as_posix().encode() + b"\0")
        digest.update(file.read_bytes())
    if root is not None:
        pins = (Path(root) / "requirements.txt").read_text("utf-8")
        lines = re.findall(r"^[\w.-]+==[\w.+]+", pins, re.MULTILINE)
        ours = sorted(line for line in lines if line.partition("==")[0] in LIBRARIES)
        digest.update("\0".join(ours).encode())
    return digest.hexdigest()[:16]


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
    return source_stamp(f"from {function.__module__} import {function.__qualname__}", root)


# -------------------------------------------------------------------------------- what is reached

Reference = tuple[str, tuple[str, ...]]  # a module, and a dotted name in it; none means all of it


@dataclass(frozen=True)
class _Part:
    """What a piece of code does, where it leads, and its strings, which may name data files."""

    meaning: str
    references: frozenset[Reference]
    strings: frozenset[str]


def _reached(start: _Part) -> tuple[dict[Reference, _Part], list[Path]]:
    """The parts of the package that some code leads to, and their data files."""
    parts: dict[Reference, _Part] = {}
    todo, strings = set(start.references), set(start.strings)
    seen: set[Reference] = set()
    beside: set[Path] = set()
    while todo:
        seen.add(reference := todo.pop())
        for module, names in _nodes(*reference):
            file = _file(module)
            if file and (module, names) not in parts:
                source, is_front_door = file.read_text("utf-8"), file.name == "__init__.py"
                part = _part(source, module, is_front_door, names[0] if names else None)
                parts[module, names] = part
                todo |= part.references - seen
                strings |= part.strings
                beside.add(file.with_suffix(""))
    text = "\n".join(strings)
    files = [f for f in sorted(PACKAGE.rglob("*")) if f.suffix not in NO_DATA and f.is_file()]
    # A file may be named as it is, or dotted, as matplotlib has it.
    return parts, [
        f for f in files if f.with_suffix("") in beside or f.name in text or _dotted(f) in text
    ]


def _nodes(module: str, names: tuple[str, ...]) -> Iterator[Reference]:
    """The modules, or definitions of modules, that a dotted name in a module counts as."""
    file = _file(module)
    if file is None:
        return
    if file.name != "__init__.py":
        yield from _node(module, names[:1])
        return
    if names:
        name, *rest = names
        imported, defined = _top_level(file.read_text("utf-8"), module)
        # `from . import room` in a front door leads to the module of that name, not to itself.
        targets = [target for target in imported.get(name, []) if target != (module, (name,))]
        if not targets and name in defined:
            yield module, (name,)
            return
        if not targets and _file(f"{module}.{name}"):
            targets = [(f"{module}.{name}", ())]
        for target, place in targets:
            yield from _nodes(target, (*place, *rest))
        if targets:
            return
    for each in sorted(file.parent.rglob("*.py")):
        yield from _node(_dotted(each), ())


def _node(module: str, names: tuple[str, ...]) -> Iterator[Reference]:
    """A definition, or all of its module where definitions do not count for themselves."""
    if f"{module}.".startswith(BY_DEFINITION):
        yield module, names
    elif not f"{module}.".startswith(WITHOUT_RESULTS):
        yield module, ()


def _file(module: str) -> Path | None:
    """The file of a module of the package; None if there is none."""
    first, *rest = module.split(".")
    place = PACKAGE.joinpath(*rest)
    files = (place / "__init__.py", place.parent / f"{place.name}.py")
    return next((file for file in files if first == NAME and file.is_file()), None)


def _dotted(file: Path) -> str:
    """The name of a module, or of another file as if it were one."""
    parts = file.relative_to(PACKAGE).with_suffix("").parts
    return ".".join((NAME, *(part for part in parts if part != "__init__")))


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
    chains, inner = _chains(body), _imports(body, package)
    bound = inner | {n: places for n, places in outer.items() if n in chains}
    references = {
        (place, (*first, *chain))
        for n, places in bound.items()
        for place, first in places
        for chain in chains.get(n, {()})
    }
    meaning = [_meaning(body), sorted((n, bound[n]) for n in bound.keys() - inner.keys())]
    constants = (n.value for line in body for n in ast.walk(line) if isinstance(n, ast.Constant))
    strings = frozenset(value for value in constants if isinstance(value, str))
    return _Part(repr(meaning), frozenset(references), strings)


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


def _chains(code: Iterable[ast.stmt]) -> dict[str, set[tuple[str, ...]]]:
    """The names that some code uses, each with the attributes asked of it: "a.b.c" is a: b, c."""
    found: dict[str, set[tuple[str, ...]]] = {}
    within = set()  # a longer chain
    for node in (node for line in code for node in ast.walk(line)):  # the longest come first
        if isinstance(node, ast.Attribute):
            within.add(node.value)
        if isinstance(node, ast.Attribute | ast.Name) and node not in within:
            name, *attributes = ast.unparse(node).split(".")
            if all(map(str.isidentifier, [name, *attributes])):  # not that of a call or an item
                found.setdefault(name, set()).add(tuple(attributes))
    return found


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
