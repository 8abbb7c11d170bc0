"""The repository: where it is, files written in one step, and one hash of the code of results."""

import ast
import glob
import hashlib
import os
from collections.abc import Mapping
from functools import cache
from importlib import metadata
from pathlib import Path

NAME = __name__.partition(".")[0]
PACKAGE = Path(__file__).parent
LIBRARIES = (
    "numpy", "scipy", "scikit-learn", "torch", "pysindy", "opencv-python-headless", "av", "pandas",
    "matplotlib", "seaborn",
)  # fmt: skip
"""On whose versions results depend."""
RESULTLESS = ("companion", "plots", "__main__", "refusal")
"""Folders and modules of the package that compute no result of a sweep."""


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
    write_files({path: content})


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
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True


def library_versions() -> list[str]:
    """The libraries that results depend on and that are installed, e.g. "numpy 2.4.6"."""
    installed = {found.name.lower(): found.version for found in metadata.distributions()}
    return [f"{name} {installed[name]}" for name in LIBRARIES if name in installed]


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
        content = file.read_bytes()
        if file.suffix == ".py":
            content = ast.dump(ast.parse(content)).encode()
        digest.update(f"{place.as_posix()}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()[:16]
