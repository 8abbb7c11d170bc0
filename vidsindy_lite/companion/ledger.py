"""The ledger of a folder: which notebooks were executed into it, by what code, with what outputs.

It is build/ledger.json beside them, and never committed. What it does not hold, or not in this
form, was not executed here.
"""

import hashlib
import json
from pathlib import Path

from ..stamp import write_file
from .records import read_json
from .registry import files_of

LEDGER = Path("build", "ledger.json")


def seconds_if_current(output: Path, notebook: Path, stamp: str) -> float | None:
    """How long a notebook ran, if it ran with this stamp and nothing has changed since.

    Parameters
    ----------
    output : Path
        The folder that the notebook was executed into.
    notebook : Path
        Its .py half, whose prose counts here.
    stamp : str
        Of the code that it has to be executed with.
    """
    entry = read_json(output / LEDGER).get(notebook.stem)
    seconds = entry.get("seconds") if isinstance(entry, dict) else None
    current = isinstance(seconds, float) and entry == _entry(output, notebook, stamp, seconds)
    return seconds if current else None


def enter(output: Path, notebook: Path, stamp: str, seconds: float) -> None:
    """Enter a notebook that has just been executed."""
    entry = {notebook.stem: _entry(output, notebook, stamp, seconds)}
    write_file(output / LEDGER, json.dumps(read_json(output / LEDGER) | entry, indent=1).encode())


def _entry(output: Path, notebook: Path, stamp: str, seconds: float) -> dict[str, object]:
    """What there is of a notebook now: stamp, run time, hashes of its source and what it made."""
    figures = output / "figures"
    made = [figures / name for name in files_of(figures, notebook.stem)]
    files = [notebook, output / "notebooks" / f"{notebook.stem}.ipynb", *made]
    return {
        "stamp": stamp,
        "seconds": seconds,
        "files": {
            file.name: hashlib.sha256(file.read_bytes()).hexdigest() if file.exists() else None
            for file in files
        },
    }
