"""Run the notebooks: each notebooks/NN_name.py through papermill, two at a time, outputs cleaned.

The .py half of a pair is the source. The .ipynb half is made here: executed, stripped of all that
differs between two runs, and stamped with a hash of the code that made it. The full profile
writes notebooks/*.ipynb and figures/ of the repository, and the tables of its README; the quick
profile writes the layout of the former two under build/quick/.

A ledger beside them, build/ledger.json, which is never committed, keeps what was executed here. A
notebook is not executed again if its stamp and its source are the same, its prose included, and its
outputs are in place byte for byte.
"""

import base64
import copy
import hashlib
import io
import json
import os
import sys
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from queue import Empty

import jupytext
import nbformat
import papermill
from nbclient.exceptions import CellTimeoutError, DeadKernelError
from nbclient.util import run_sync
from nbformat import NotebookNode
from papermill.clientwrap import PapermillNotebookClient
from papermill.engines import Engine, papermill_engines
from papermill.exceptions import PapermillExecutionError, strip_color
from PIL import Image
from tqdm import tqdm
from traitlets.config import Config

from ..stamp import PACKAGE, repository_root, source_stamp, write_file
from . import artifacts
from .readme import write_readme

__all__ = [
    "NotebookError",
    "Outcome",
    "Report",
    "check_parameters",
    "clean",
    "notebook_stamp",
    "execute",
    "find_notebooks",
    "run",
    "select_notebooks",
]

PROFILES = ("full", "quick")
AT_ONCE = 2  # notebooks: most of them work on one core for most of their time
CELL_TIMEOUT = 3600  # seconds; papermill's own default is to wait for ever
ENGINE = "vidsindy_lite"  # under which papermill knows ours
LEDGER = Path("build", "ledger.json")
SYSTEMS_TABLE = "table_systems"  # printed after a run that wrote it
# The kernel warns on stderr that anyone on the machine could listen in otherwise.
ENCRYPTED = Config(KernelManager={"transport_encryption": "auto"})


class NotebookError(RuntimeError):
    """A notebook did not run to its end; the message shows the cell and the traceback."""


@dataclass(frozen=True)
class Outcome:
    """How the run of one notebook ended: `error` is None if every cell completed.

    A notebook that was `up_to_date` was not executed; `seconds` is how long it took when it was.
    """

    notebook: str
    seconds: float
    error: str | None = None
    up_to_date: bool = False

    @property
    def verdict(self) -> str:
        """One or two words."""
        return "up to date" if self.up_to_date else "ok" if self.error is None else "FAILED"


@dataclass(frozen=True)
class Report:
    """What a run came to: the outcome of each notebook, and what is wrong with the figures.

    `memory` is the peak of the largest process of the run in GB, where the system counts it.
    """

    outcomes: tuple[Outcome, ...]
    problems: tuple[str, ...]
    systems: artifacts.Table | None = None
    memory: float | None = None

    @property
    def ok(self) -> bool:
        """True if every notebook ran to its end and the folder of figures adds up."""
        return not self.problems and all(outcome.error is None for outcome in self.outcomes)

    def __str__(self) -> str:
        width = max((len(outcome.notebook) for outcome in self.outcomes), default=0)
        lines = [] if self.systems is None else [self.systems.caption, "", str(self.systems), ""]
        for outcome in self.outcomes:
            seconds, verdict = outcome.seconds, outcome.verdict
            lines.append(f"{outcome.notebook:<{width}}  {seconds:7.1f} s  {verdict}")
        lines += [f"figures: {problem}" for problem in self.problems]
        executed = [outcome for outcome in self.outcomes if not outcome.up_to_date]
        failed = sum(outcome.error is not None for outcome in executed)
        if executed and self.memory is not None:
            lines.append(f"largest process: {self.memory:.2f} GB at its peak")
        lines.append(
            f"{len(executed)} run in {sum(outcome.seconds for outcome in executed):.1f} s, "
            f"{len(self.outcomes) - len(executed)} up to date, {failed} failed"
        )
        return "\n".join(lines)


# ----------------------------------------------------------------------------------- which, and how


def find_notebooks(root: str | os.PathLike) -> tuple[Path, ...]:
    """The source halves (notebooks/*.py) of a repository's notebooks, in order."""
    return tuple(sorted((Path(root) / "notebooks").glob("*.py")))


def select_notebooks(names: Iterable[str], root: str | os.PathLike) -> tuple[Path, ...]:
    """The notebooks meant by names such as "03", "03_camera_learning" or a path; all for no name.

    Raises
    ------
    ValueError
        If a name fits no notebook; the message lists those there are.
    """
    known = {path.stem: path for path in find_notebooks(root)}
    chosen = set()
    for name in names:
        stem = Path(name).name.removesuffix(".py").removesuffix(".ipynb")
        fitting = [n for n in known if n == stem or n.startswith(f"{stem}_")] if stem else []
        if not fitting:
            raise ValueError(
                f"notebook: expected one of {', '.join(known) or '(there are none)'}, "
                f"its number or its path, got {str(name)!r}"
            )
        chosen.update(fitting)
    return tuple(path for name, path in known.items() if name in chosen or not chosen)


def run(
    notebooks: Iterable[str] = (),
    profile: str = "full",
    output: str | os.PathLike | None = None,
    *,
    force: bool = False,
    dask: str | None = None,
    root: str | os.PathLike | None = None,
) -> Report:
    """Execute notebooks, two at a time, and write what they make; goes on after a failure.

    Parameters
    ----------
    notebooks : iterable of str
        As `select_notebooks` takes them; none means all.
    profile : {"full", "quick"}
        Handed to each notebook as its parameter `profile`.
    output : path, optional
        Folder that receives notebooks/ (executed) and figures/. By default the repository itself
        in the full profile and build/quick in the quick one. A notebook that fails leaves its
        executed half as it was.
    force : bool
        Execute also what is up to date: executed here by the same code, with all its outputs in
        place. (A notebook that reads another's tables is always executed, after those before it.)
    dask : str, optional
        Address of a Dask scheduler: what a notebook sweeps runs on its workers (see `sweep`).
    root : path, optional
        The repository; by default the one around the working directory.

    Returns
    -------
    Report

    Raises
    ------
    ValueError
        Before anything runs: on an unknown profile or notebook, on a notebook without the
        parameter `profile`, or if the quick profile were to overwrite the repository's outputs.
    FileNotFoundError
        If there is no repository around the working directory.
    """
    if profile not in PROFILES:
        raise ValueError(f"profile: expected one of {', '.join(PROFILES)}, got {profile!r}")
    root = repository_root() if root is None else Path(root).resolve()
    if output is None:
        output = root if profile == "full" else root / "build" / "quick"
    output = Path(output).resolve()
    if profile == "quick" and output == root:
        raise ValueError(
            f"output: the quick profile needs a folder of its own, got {str(output)!r}"
        )
    chosen = select_notebooks(notebooks, root)
    for path in chosen:
        check_parameters(path, ["profile"])

    figures = output / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    stamps = dict.fromkeys((path.stem for path in find_notebooks(root)), None)
    artifacts.prune(figures, stamps)  # what a notebook left that has gone

    usual = artifacts.load_run_times(figures)
    outcomes, due = {}, []
    for number, path in enumerate(chosen, start=1):
        label, stamp = f"[{number}/{len(chosen)}] {path.stem}", notebook_stamp(path, profile)
        reads = _reads_tables(path)
        known = None if force or reads else _ledger(output).get(path.stem)
        if known and known == _ledger_entry(output, path, stamp, known["seconds"]):
            stamps[path.stem] = stamp
            outcomes[path.stem] = Outcome(path.stem, known["seconds"], up_to_date=True)
            artifacts.record_run_time(figures, path.stem, stamp, known["seconds"])
            print(f"{label}: up to date ({known['seconds']:.1f} s when it ran)", flush=True)
            continue
        environment = {
            "VIDSINDY_FIGURES": str(figures),
            "VIDSINDY_NOTEBOOK": path.stem,
            "VIDSINDY_STAMP": stamp,
            **({"VIDSINDY_DASK": dask} if dask else {}),
        }
        due.append(_Task(path, label, stamp, profile, output, environment, reads))
    # The longest first, so that none runs on alone for long; after all, what reads their tables.
    due.sort(key=lambda task: (task.reads_tables, -usual.get(task.path.stem, 0.0)))
    for task, outcome in _executed(due):
        name = task.path.stem
        outcomes[name] = outcome
        if outcome.error is None:
            stamps[name] = task.stamp
            artifacts.prune(figures, stamps)  # what an earlier version of it left
            artifacts.record_run_time(figures, name, task.stamp, outcome.seconds)
            _enter(output, task.path, task.stamp, outcome.seconds)

    artifacts.write_index(figures)
    problems = artifacts.check_folder(figures, stamps)
    if output == root and (root / "README.md").exists():
        try:
            write_readme(root)
        except (ValueError, FileNotFoundError) as missing:
            problems.append(f"README.md: {missing}")
    in_order = tuple(outcomes[path.stem] for path in chosen)
    table, memory = _systems_table(figures, in_order), _largest_process()
    return Report(in_order, tuple(problems), table, memory)


@dataclass(frozen=True)
class _Task:
    """One notebook to execute, and all that a process of its own has to know of it."""

    path: Path
    label: str
    stamp: str
    profile: str
    output: Path
    environment: dict[str, str] = field(repr=False)
    reads_tables: bool = False


def _executed(tasks: Sequence[_Task]) -> Iterator[tuple[_Task, Outcome]]:
    """The notebooks as they end, begun in this order; one that reads tables waits for all before.

    Each runs in a process of its own: the folder and the environment that papermill and its kernel
    start from are those of a process.
    """
    waiting, running = deque(tasks), {}
    pool = ProcessPoolExecutor(AT_ONCE, mp_context=get_context("spawn"))
    # The bar stands still while a notebook runs, but for the clock and what is running.
    with pool, tqdm(total=len(tasks), desc="notebooks", leave=False, disable=None) as bar:
        while waiting or running:
            while waiting and len(running) < AT_ONCE and not (running and waiting[0].reads_tables):
                task = waiting.popleft()
                _say(task.label)
                running[pool.submit(_attempt, task)] = task
            bar.set_postfix_str(", ".join(task.path.stem for task in running.values()))
            ended, _ = wait(running, timeout=1, return_when=FIRST_COMPLETED)
            for future in ended:
                task, outcome = running.pop(future), future.result()
                failed = f"FAILED\n\n{outcome.error}\n" if outcome.error else ""
                _say(f"{task.label}: {failed or f'{outcome.seconds:.1f} s'}")
                bar.update()
                yield task, outcome


def _say(line: str) -> None:
    with tqdm.external_write_mode():
        print(line, flush=True)


def _attempt(task: _Task) -> Outcome:
    """Execute a notebook and write its executed half."""
    error, started = None, time.perf_counter()
    try:
        executed = execute(task.path, {"profile": task.profile}, environment=task.environment)
    except NotebookError as failure:
        error = str(failure)
    else:
        half = nbformat.writes(clean(executed, task.path, task.profile, task.stamp)) + "\n"
        write_file(task.output / "notebooks" / f"{task.path.stem}.ipynb", half.encode())
    return Outcome(task.path.stem, time.perf_counter() - started, error)


# --------------------------------------------------------------------------------- one notebook


def check_parameters(path: str | os.PathLike, parameters: Iterable[str]) -> None:
    """Check that a notebook's parameters cell has these parameters (papermill only warns).

    Raises
    ------
    ValueError
        Naming the unknown parameter and those there are.
    """
    known = papermill.inspect_notebook(jupytext.read(path))
    for name in parameters:
        if name not in known:
            raise ValueError(
                f"parameter: notebook {Path(path).stem} has {', '.join(known) or 'no parameters'} "
                f"(one `name: type = value  # help` a line in the cell tagged parameters), "
                f"got {name!r}"
            )


def execute(
    path: str | os.PathLike,
    parameters: Mapping[str, object],
    *,
    environment: Mapping[str, str] | None = None,
    timeout: float = CELL_TIMEOUT,
) -> NotebookNode:
    """Run a notebook's source half through papermill, in its own folder.

    Parameters
    ----------
    path : path
        The .py half.
    parameters : mapping
        Values for names of the parameters cell.
    environment : mapping of str to str, optional
        Environment variables for the kernel, beside those of this process.
    timeout : float
        Seconds that one cell may take.

    Returns
    -------
    NotebookNode
        As papermill leaves it; see `clean`.

    Raises
    ------
    ValueError
        On an unknown parameter.
    NotebookError
        If the kernel does not start, or if a cell raises, takes too long, ends the kernel, or
        stops the run early: after ``sys.exit(0)`` papermill reports success, but cells were left
        out.
    """
    path = Path(path)
    check_parameters(path, parameters)
    try:
        with _kernel_environment(environment or {}):
            executed = papermill.execute_notebook(
                jupytext.read(path),
                None,
                parameters=dict(parameters),
                engine_name=ENGINE,
                kernel_name="python3",
                cwd=path.parent,
                timeout=timeout,
                startup_timeout=120,
                progress_bar=False,
                config=ENCRYPTED,
            )
    except PapermillExecutionError as error:
        traceback = strip_color("\n".join(error.traceback)) or f"{error.ename}: {error.evalue}"
        raise NotebookError(
            _cell_message(path, error.exec_count, error.source, traceback)
        ) from None
    except (CellTimeoutError, DeadKernelError) as error:
        raise NotebookError(f"{path.stem}: {error}") from None
    except (RuntimeError, OSError) as error:
        raise NotebookError(
            f"{path.stem}: the kernel python3 did not start: {error}. What it wrote stands above; "
            "`jupyter kernelspec list` shows which kernel has that name."
        ) from error
    for cell in executed.cells:
        if cell.cell_type == "code" and cell.source.strip():
            completed = cell.metadata.papermill.status == "completed"
            if not completed or cell.execution_count is None:
                reason = "The run ended in this cell, before the end of the notebook."
                raise NotebookError(_cell_message(path, cell.execution_count, cell.source, reason))
    return executed


def clean(
    executed: NotebookNode, path: str | os.PathLike, profile: str, stamp: str
) -> NotebookNode:
    """The .ipynb half of a pair: cells and metadata of the .py, outputs of the run, a stamp.

    Left out is all that differs between two runs or that the source does not have: the injected
    cell, papermill's and the kernel's metadata, what went to stderr, random cell ids, how stdout
    was split into pieces. Images get a palette, which keeps a notebook small.

    Parameters
    ----------
    executed : NotebookNode
        From `execute`.
    path : path
        The .py half.
    profile, stamp : str
        Recorded in the notebook's metadata, where neither jupytext nor JupyterLab removes them.
    """
    notebook = jupytext.read(path)
    notebook.metadata.jupytext.pop("text_representation", None)  # is about the .py half
    notebook.metadata["vidsindy_lite"] = {"profile": profile, "stamp": stamp}
    ran = [c for c in executed.cells if "injected-parameters" not in c.metadata.get("tags", [])]
    count = 0
    for index, (cell, twin) in enumerate(zip(notebook.cells, ran, strict=True)):
        cell.id = f"cell-{index:02d}"
        if cell.cell_type != "code":
            continue
        cell.outputs = _tidy_outputs(twin.outputs)
        if twin.execution_count is not None:
            count += 1
            cell.execution_count = count
        for output in cell.outputs:
            if output.output_type == "execute_result":
                output.execution_count = cell.execution_count
    nbformat.validate(notebook)
    return notebook


def notebook_stamp(path: str | os.PathLike, profile: str) -> str:
    """Hash of what a notebook's outputs depend on: profile, code cells, and what these reach.

    Prose does not count, nor what the code does not use: see `vidsindy_lite.stamp`.
    """
    path = Path(path)
    code = [cell.source for cell in jupytext.read(path).cells if cell.cell_type == "code"]
    return source_stamp("\n".join([f"{profile!r}", *code]), path.parent.parent)


# --------------------------------------------------------------------------------------- the ledger


def _ledger(output: Path) -> dict[str, dict]:
    """What was executed into a folder, by notebook."""
    path = output / LEDGER
    return json.loads(path.read_text("utf-8")) if path.exists() else {}


def _enter(output: Path, path: Path, stamp: str, seconds: float) -> None:
    entries = _ledger(output) | {path.stem: _ledger_entry(output, path, stamp, seconds)}
    write_file(output / LEDGER, json.dumps(entries, indent=1).encode())


def _ledger_entry(output: Path, path: Path, stamp: str, seconds: float) -> dict:
    """What there is of a notebook now: stamp, run time, hashes of its source and what it made."""
    figures = output / "figures"
    made = [figures / name for name in artifacts.files_of(figures, path.stem)]
    files = [path, output / "notebooks" / f"{path.stem}.ipynb", *made]
    return {
        "stamp": stamp,
        "seconds": seconds,
        "files": {
            file.name: hashlib.sha256(file.read_bytes()).hexdigest() if file.exists() else None
            for file in files
        },
    }


def _reads_tables(path: Path) -> bool:
    """Whether a notebook depends on what another wrote, which its stamp does not cover."""
    code = [cell.source for cell in jupytext.read(path).cells if cell.cell_type == "code"]
    return any("load_table" in source for source in code)


# ------------------------------------------------------------------------------------------ details


class _Client(PapermillNotebookClient):
    """Papermill's client, which leaves the kernel when it is idle, not when it has replied.

    Shutting a kernel down begins with an interrupt. One that is idle ignores it; one that still
    returns from its last request reports it on stderr.
    """

    def wait_for_reply(self, msg_id, cell=None):
        reply = super().wait_for_reply(msg_id, cell)
        next_message = run_sync(self.kc.get_iopub_msg)
        with suppress(Empty):
            while True:
                message = next_message(timeout=self.iopub_timeout)
                state = message["content"].get("execution_state")
                if (message["parent_header"].get("msg_id"), state) == (msg_id, "idle"):
                    return reply
        return reply


class _Engine(Engine):
    """Makes papermill use that client."""

    @classmethod
    def execute_managed_notebook(
        cls, nb_man, kernel_name, *, timeout, startup_timeout, config, **_
    ):
        _Client(
            nb_man,
            kernel_name=kernel_name,
            timeout=timeout,
            startup_timeout=startup_timeout,
            config=config,
        ).execute()


papermill_engines.register(ENGINE, _Engine)


@contextmanager
def _kernel_environment(environment: Mapping[str, str]) -> Iterator[None]:
    """What the kernel inherits: this very package, an order of sets, one thread per process."""
    before = dict(os.environ)
    os.environ.update(
        environment,
        PYTHONPATH=os.pathsep.join(filter(None, [str(PACKAGE.parent), before.get("PYTHONPATH")])),
        PYTHONHASHSEED="0",  # the order of a set is then the same in every run
        PYDEVD_DISABLE_FILE_VALIDATION="1",  # the kernel's debugger warns without it
    )
    # Sums then do not depend on the number of cores, and joblib's workers do not fight over them.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _cell_message(path: Path, count: int | None, source: str, what: str) -> str:
    shown = "\n".join(f"    {line}" for line in source.splitlines())
    return f"{path.stem}, cell In [{count}]:\n\n{shown}\n\n{what}"


def _tidy_outputs(outputs: list[NotebookNode]) -> list[NotebookNode]:
    """Outputs without stderr, with neighbouring pieces of stdout joined."""
    tidy = []
    for output in copy.deepcopy(outputs):
        is_stream = output.output_type == "stream"
        if is_stream and output.name == "stderr":
            continue
        if is_stream and tidy and tidy[-1].output_type == "stream":
            tidy[-1].text += output.text
        else:
            if "image/png" in output.get("data", {}):
                output.data["image/png"] = _with_palette(output.data["image/png"])
            tidy.append(output)
    return tidy


def _with_palette(png: str) -> str:
    """A PNG in base64 with 256 colours, a third of the size; as it was if that is not smaller."""
    image = Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")
    small = io.BytesIO()
    reduced = image.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    reduced.save(small, "PNG", optimize=True)
    return min(png, base64.b64encode(small.getvalue()).decode() + "\n", key=len)


def _largest_process() -> float | None:
    """Peak memory in GB of the largest process that this one has started, kernels' own included."""
    if sys.platform == "win32":
        return None
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * unit / 1e9


def _systems_table(figures: Path, outcomes: Sequence[Outcome]) -> artifacts.Table | None:
    """The table of the systems, if this run wrote it."""
    try:
        table = artifacts.load_table(SYSTEMS_TABLE, figures)
    except FileNotFoundError:
        return None
    succeeded = {outcome.notebook for outcome in outcomes if outcome.error is None}
    return table if table.notebook in succeeded else None
