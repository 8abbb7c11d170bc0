"""The repository that the package lies in: where it is, what its code is, files in one step."""

import ast
import hashlib
import os
import platform
from functools import cache
from importlib import metadata
from pathlib import Path

PACKAGE = Path(__file__).parent
# What results depend on.
LIBRARIES = (
    "numpy", "scipy", "scikit-learn", "torch", "pysindy", "opencv-python-headless", "matplotlib"
)  # fmt: skip


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
        if (folder / "notebooks").is_dir() and (folder / "vidsindy_lite").is_dir():
            return folder
    raise FileNotFoundError(
        "repository: expected to be inside a clone of vidsindy_lite (a folder with notebooks/ and "
        f"vidsindy_lite/), got {str(start)!r}"
    )


def write_file(path: Path, content: bytes) -> None:
    """Replace a file in one step, so an interrupted run leaves the old one or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    beside.write_bytes(content)
    beside.replace(path)


def versions() -> str:
    """Python and the libraries that results depend on, as they are here, a line each."""
    lines = [f"{name} {metadata.version(name)}" for name in LIBRARIES]
    return "\n".join([f"Python {platform.python_version()}", *lines])


def package_stamp(root: str | os.PathLike | None = None) -> str:
    """Hash of the code that results depend on.

    That is every file of the package and, given a repository, its requirements.txt, which pins
    the libraries. Comments, docstrings and the layout of the code do not count.

    Parameters
    ----------
    root : path, optional
        The repository.
    """
    digest = hashlib.sha256()
    for file in sorted(PACKAGE.rglob("*")):
        if file.is_file() and "__pycache__" not in file.parts:
            digest.update(b"\0" + file.relative_to(PACKAGE).as_posix().encode() + b"\0")
            is_code = file.suffix == ".py"
            digest.update(_meaning(file.read_text("utf-8")) if is_code else file.read_bytes())
    if root is not None:
        digest.update(b"\0" + (Path(root) / "requirements.txt").read_bytes())
    return digest.hexdigest()[:16]


@cache
def _meaning(source: str) -> bytes:
    """What a Python source does, as text: its syntax tree without bare constants (docstrings)."""

    def plain(node: object) -> object:
        if isinstance(node, list):
            return [plain(n) for n in node if not _is_bare_constant(n)]
        if isinstance(node, ast.AST):
            fields = [(name, plain(value)) for name, value in ast.iter_fields(node)]
            # Empty fields differ between versions of Python.
            return [type(node).__name__, *(f for f in fields if f[1] not in (None, []))]
        return node

    return repr(plain(ast.parse(source))).encode()


def _is_bare_constant(node: object) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
