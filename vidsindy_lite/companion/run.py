"""Run the notebooks: each notebooks/NN_name.py through papermill, three at a time.

The .py half of a pair is the source. A run leaves what it makes in build/runs/ of its output, and
is not repeated there while the code cells, the package and the libraries are the same. From there
`compare.replace` puts into figures/, and this module into ``notebooks/``, what differs from
what is there already.
"""

import base64
import copy
import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.pool import ThreadPool
from pathlib import Path

import jupytext
import nbformat
import papermill
from filelock import FileLock
from nbformat import NotebookNode
from papermill.exceptions import strip_color

from ..checks import check_choice
from ..progress import bar
from ..storage import PACKAGE, code_hash, repository_root, write_file
from .artifacts import read_records, with_palette, write_index
from .compare import outdated, replace, same_notebook

CELL_TIMEOUT = 3600  # seconds; papermill's own default is to wait for ever
EXECUTED, LOG = "executed.ipynb", "log.txt"  # in the folder of a run

# Papermill, which ends its kernel before itself, also where this process is closed or killed.
# Ctrl-C is for this process, which then ends it.
PAPERMILL = """\
import ctypes, signal, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)
for number in (signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):  # none on Windows
    signal.signal(number, lambda *_: sys.exit(1))
if sys.platform == "linux":
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG
from papermill.cli import papermill
papermill()"""
_RUNNING: set[subprocess.Popen] = set()  # papermills, which end with the run


class NotebookError(RuntimeError):
    """A notebook did not run to its end; the message shows the cell and the traceback."""


@dataclass(frozen=True)
class Outcome:
    """How the run of one notebook ended.

    `error` is None if every cell completed; `seconds` is None if nothing had to be executed;
    `changed` names the figures, tables and executed notebook that were not as before.
    """

    notebook: str
    seconds: float | None
    error: str | None = None
    changed: tuple[str, ...] = ()

    def __str__(self) -> str:
        took = "up to date" if self.seconds is None else f"{self.seconds:.1f} s"
        changed = f", changed: {', '.join(self.changed)}" if self.changed else ""
        failed = f"FAILED\n\n{self.error}\n" if self.error else ""
        return f"{self.notebook}: {failed or took}{changed}"


def find_notebooks(root: str | os.PathLike) -> tuple[Path, ...]:
    """The source halves of a repository's notebooks, in order."""
    return tuple(sorted(Path(root, "notebooks").glob("[0-9][0-9]*_*.py")))


def select_notebooks(names: Iterable[str], root: str | os.PathLike) -> tuple[Path, ...]:
    """The notebooks meant by names such as "03", "03_camera_learning" or a path; all for no name.

    Raises
    ------
    ValueError
        If a name fits no notebook; the message lists those there are.
    """
    known, chosen = find_notebooks(root), set()
    for name in names:
        stem = Path(name).name.removesuffix(".py").removesuffix(".ipynb")
        fitting = {p for p in known if stem and f"{p.stem}_".startswith(f"{stem}_")}
        if not fitting:
            there = ", ".join(path.stem for path in known) or "(there are none)"
            raise ValueError(
                f"notebook: expected one of {there}, its number or its path, got {str(name)!r}"
            )
        chosen |= fitting
    return tuple(path for path in known if path in chosen or not chosen)


def run(
    notebooks: Iterable[str] = (), profile: str = "full", *, force: bool = False
) -> list[Outcome]:
    """Execute notebooks, three at a time, and write what differs; goes on after a failure.

    The full profile writes notebooks/ and figures/ of the repository around the working directory,
    the quick one the same into build/quick/. A notebook that fails changes nothing there; what it
    made until then lies in build/runs/.

    Parameters
    ----------
    notebooks : iterable of str
        As of `select_notebooks`.
    profile : {"full", "quick"}
        Handed to each notebook as its parameter `profile`.
    force : bool
        Execute also what has been executed here with the same code.

    Returns
    -------
    list of Outcome
        Of the notebooks, in order.

    Raises
    ------
    ValueError
        On an unknown profile or notebook, before anything runs.
    FileNotFoundError
        If there is no repository around the working directory.
    """
    check_choice("profile", profile, ("full", "quick"))
    root = repository_root()
    output = root if profile == "full" else root / "build" / "quick"
    chosen, figures = select_notebooks(notebooks, root), output / "figures"
    known = {path.stem for path in find_notebooks(root)}
    gone = [n for n, record in read_records(figures).items() if record["notebook"] not in known]
    replace(figures, figures / "none", gone)
    # The longest begun first, so that none runs on alone for long.
    by_size = sorted(chosen, key=lambda path: -path.stat().st_size)
    work = partial(_outcome, profile=profile, output=output, force=force)
    outcomes = []
    shown = bar(None, "notebooks", total=len(chosen), leave=False)
    try:
        # Where one waits for the last task of a sweep, another goes on.
        with ThreadPool(3) as pool, shown:
            for outcome in pool.imap_unordered(work, by_size):
                outcomes.append(outcome)
                with shown.external_write_mode():
                    print(outcome, flush=True)
                shown.update()
    finally:
        for process in tuple(_RUNNING):  # which changes as they end
            process.terminate()
    write_index(figures)
    return sorted(outcomes, key=lambda outcome: outcome.notebook)


def execute(
    path: str | os.PathLike, parameters: Mapping[str, object], folder: str | os.PathLike
) -> NotebookNode:
    """Run a notebook's source half through papermill, in its own folder.

    Parameters
    ----------
    path : path
        The .py half.
    parameters : mapping
        Values for names of the parameters cell.
    folder : path
        Receives the executed notebook, what was written to stderr, and in figures/ what it saves.

    Returns
    -------
    NotebookNode
        As papermill leaves it; see `tidy`.

    Raises
    ------
    ValueError
        On an unknown parameter.
    NotebookError
        If the kernel does not start, or if a cell raises, takes too long, ends the kernel, or
        stops the run early: after ``sys.exit(0)`` papermill reports success, but cells were left
        out.
    """
    path, folder = Path(path), Path(folder).resolve()
    source = jupytext.read(path)
    known = papermill.inspect_notebook(source)
    if strange := parameters.keys() - known:
        raise ValueError(
            f"parameters: notebook {path.stem} has {', '.join(known) or 'none'} (one `name: type = "
            f"value  # help` a line in the cell tagged parameters), got {', '.join(strange)}"
        )
    folder.mkdir(parents=True, exist_ok=True)
    nbformat.write(source, folder / EXECUTED)
    paths = [str(PACKAGE.parent), os.environ.get("PYTHONPATH")]
    variables = {
        # Sums do not depend on the number of cores, and joblib's workers do not fight over them.
        "OMP_NUM_THREADS": "1",
        "OPENCV_FOR_THREADS_NUM": "1",
        **os.environ,
        "VIDSINDY_FIGURES": str(folder / "figures"),
        "VIDSINDY_NOTEBOOK": path.stem,
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),  # the kernel imports this very package
        "PYTHONHASHSEED": "0",  # the order of a set is then the same in every run
    }
    command: list[str | Path] = [
        sys.executable, "-c", PAPERMILL, folder / EXECUTED, folder / EXECUTED,
        "--kernel", "python3", "--no-progress-bar", "--log-level", "ERROR",
        "--cwd", path.parent, "--execution-timeout", str(CELL_TIMEOUT),
        "-y", json.dumps(dict(parameters)),
    ]  # fmt: skip
    # Two kernels that begin at once may be given the same port, and one then dies.
    for _ in range(3):
        with (
            open(folder / LOG, "w") as log,
            subprocess.Popen(command, env=variables, stdout=log, stderr=log) as process,
        ):
            _RUNNING.add(process)
            try:
                status = process.wait()
            finally:
                process.terminate()  # if it has not ended
                _RUNNING.discard(process)
        if "Kernel died before replying" not in (folder / LOG).read_text("utf-8", "replace"):
            break
    return _whole(path, folder, status)


def tidy(executed: NotebookNode, source: NotebookNode) -> NotebookNode:
    """The .ipynb half of a pair: cells and metadata of the .py (source), outputs of the run.

    Left out is what the source does not have and what differs between two runs: the injected cell,
    papermill's and the kernel's metadata, what went to stderr, random cell ids. Images get a
    palette, which keeps a notebook small.
    """
    notebook = copy.deepcopy(source)
    notebook.metadata.jupytext.pop("text_representation", None)  # is about the .py half
    ran = [c for c in executed.cells if "injected-parameters" not in c.metadata.get("tags", [])]
    codes = [cell for cell in notebook.cells if cell.cell_type == "code"]
    for index, cell in enumerate(notebook.cells):
        cell.id = f"cell-{index:02d}"
    twins = (cell for cell in ran if cell.cell_type == "code")
    for count, (cell, twin) in enumerate(zip(codes, twins, strict=True), start=1):
        cell.execution_count = count
        cell.outputs = []
        for output in twin.outputs:
            if output.get("name") == "stdout" and cell.outputs[-1:] and "text" in cell.outputs[-1]:
                cell.outputs[-1].text += output.text  # how it is split depends on the moment
            elif output.get("name") != "stderr":
                cell.outputs.append(output)
        for output in cell.outputs:
            if "execution_count" in output:
                output.execution_count = count
            if png := output.get("data", {}).get("image/png"):
                small = with_palette(base64.b64decode(png))
                output.data["image/png"] = base64.b64encode(small).decode() + "\n"
    return notebook


# ------------------------------------------------------------------------------------------ details


def _outcome(path: Path, profile: str, output: Path, force: bool) -> Outcome:
    """Execute a notebook, unless this very code has been, and put what it made where it differs."""
    seconds, error = None, None
    changed: list[str] = []
    folder = output / "build" / "runs" / f"{path.stem}-{profile}"
    folder.mkdir(parents=True, exist_ok=True)
    running = folder / "running"
    try:
        with FileLock(folder / "lock"):  # until no other run is at this notebook
            source = jupytext.read(path)
            kept = folder / _key(source)
            if force or not kept.exists():
                began = time.perf_counter()
                for earlier in folder.glob("*/"):
                    shutil.rmtree(earlier)
                execute(path, {"profile": profile}, running)
                # What was edited meanwhile is of no code that anybody will have again.
                as_before = kept.name == _key(jupytext.read(path))
                kept = running.rename(kept if as_before else folder / "edited")
                seconds = time.perf_counter() - began
            changed = _refresh(source, path, kept, output)
    except (NotebookError, ValueError, OSError, SyntaxError) as failure:  # the others go on
        error = str(failure)
    return Outcome(path.stem, seconds, error, tuple(changed))


def _key(source: NotebookNode) -> str:
    """What the outputs of a notebook depend on, prose not."""
    code_hash.cache_clear()  # somebody may have edited it meanwhile
    code = [cell.source for cell in source.cells if cell.cell_type == "code"]
    return hashlib.sha256("\0".join([code_hash(), *code]).encode()).hexdigest()[:16]


def _refresh(source: NotebookNode, path: Path, kept: Path, output: Path) -> list[str]:
    """Put the executed half, then figures and tables of a run where they differ."""
    notebook = tidy(nbformat.read(kept / EXECUTED, 4), source)
    changed = outdated(output / "figures", kept / "figures", path.stem)
    half, same = output / "notebooks" / f"{path.stem}.ipynb", False
    with suppress(OSError, ValueError):  # there is none, or it cannot be read
        same = same_notebook(nbformat.read(half, 4), notebook)
    if changed or not same:
        write_file(half, (nbformat.writes(notebook) + "\n").encode())
    replace(output / "figures", kept / "figures", changed)
    return changed if same and not changed else [*changed, half.name]


def _whole(path: Path, folder: Path, status: int) -> NotebookNode:
    """What papermill has executed, which ended with a status; an error if it is not all."""
    executed = nbformat.read(folder / EXECUTED, as_version=4)
    codes = [cell for cell in executed.cells if cell.cell_type == "code" and cell.source.strip()]
    states = {cell.execution_count and cell.metadata.papermill.status for cell in codes}
    if status == 0 and states <= {"completed"}:
        return executed
    log = (folder / LOG).read_text("utf-8", "replace").strip().splitlines() or ["no word of it"]
    for cell in codes:
        for output in cell.outputs:
            if output.output_type == "error":
                source = "\n".join(f"    {line}" for line in cell.source.splitlines())
                where = f"{path.stem}, cell In [{cell.execution_count}]:\n\n{source}"
                raised = strip_color("\n".join(output.traceback))
                late = [line for line in log if "timed out" in line]
                raise NotebookError("\n\n".join([where, raised, *late]))
    raise NotebookError(f"{path.stem} did not run to its end: {log[-1]}")
