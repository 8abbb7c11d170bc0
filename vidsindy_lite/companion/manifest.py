"""Folders that a command may write anew: it removes only what it wrote there and nobody changed."""

import hashlib
from pathlib import Path

from ..stamp import write_file

MANIFEST = "MANIFEST"  # in each such folder: after the title a line per file, digest and path
TITLE = "Written by vidsindy_lite\n"


def clear(folder: Path, what: str) -> None:
    """Empty a folder that `sign` has signed; one that is new or empty is fine as it is.

    Parameters
    ----------
    folder : Path
    what : str
        What it holds, for the error.

    Raises
    ------
    ValueError
        If anything else is there; then nothing is removed.
    """
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"output: must be a folder, got the file '{folder}'")
    signed, manifest = _signed(folder), folder / MANIFEST
    there = sorted(path for path in folder.rglob("*") if path.is_symlink() or not path.is_dir())
    strange = [path for path in there if path != manifest and signed.get(path) != _digest(path)]
    if strange or (there and not signed):
        shown = ", ".join(path.relative_to(folder).as_posix() for path in (strange or there)[:3])
        raise ValueError(
            f"output: must be a new folder or hold an earlier {what}, got '{folder}' with {shown}"
        )
    for path in there:
        path.unlink()
    for parent in sorted({p for path in signed for p in path.parents}, reverse=True):
        if parent.is_relative_to(folder) and parent.is_dir() and not any(parent.iterdir()):
            parent.rmdir()


def sign(folder: Path) -> None:
    """Note all files of a folder as written by us."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    lines = [f"{_digest(path)}  {path.relative_to(folder).as_posix()}\n" for path in files]
    write_file(folder / MANIFEST, "".join([TITLE, *lines]).encode())


def _signed(folder: Path) -> dict[Path, str]:
    """Digests of the files that are noted, by path."""
    manifest = folder / MANIFEST
    text = manifest.read_text("utf-8", errors="replace") if manifest.is_file() else ""
    ours = text.startswith(TITLE)
    lines = [line.partition("  ") for line in text.splitlines()[1:] if ours]
    return {folder / name: digest for digest, _, name in lines}


def _digest(path: Path) -> str:
    """Of a file; a link is nobody's."""
    return "" if path.is_symlink() else hashlib.sha256(path.read_bytes()).hexdigest()
