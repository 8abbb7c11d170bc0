"""Run the notebooks: each notebooks/NN_name.py through papermill, three at a time, outputs cleaned.

The .py half of a pair is the source. The .ipynb half is made here: executed, stripped of all that
differs between two runs, and stamped with a hash of the code that it depends on. The full profile
writes ``notebooks/*.ipynb`` and figures/ of the repository, and the tables of README and
docs/; the quick profile writes the layout of the former two under build/quick/.

A notebook is not executed again if its stamp and its source are the same, its prose included, and
its outputs are in place byte for byte (see `ledger`).
"""

import os
import sys
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import jupytext
import nbformat
import psutil
from tqdm import tqdm

from ..stamp import repository_root, source_stamp, write_file
from . import artifacts, registry
from .clean import clean
from .execute import NotebookError, check_parameters, execute
from .ledger import enter, seconds_if_current
from .readme import write_readme

PROFILES = ("full", "quick")
AT_ONCE = 3  # notebooks: where one waits for the last task of a sweep, another goes on
SYSTEMS_TABLE = "table_systems"  # printed after a run of its notebook, or if that is up to date


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


def find_notebooks(root: str | os.PathLike) -> tuple[Path, ...]:
    """The source halves (``notebooks/*.py``) of a repository's notebooks, in order."""
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
    """Execute notebooks, three at a time, and write what they make; goes on after a failure.

    Parameters
    ----------
    notebooks : iterable of str
        As of `select_notebooks`.
    profile : {"full", "quick"}
        Handed to each notebook as its parameter `profile`.
    output : path, optional
        Folder that receives notebooks/ (executed) and figures/. By default the repository itself
        in the full profile and build/quick in the quick one. A notebook that fails leaves its
        executed half as it was.
    force : bool
        Execute also what is up to date: executed here by the same code, outputs in place.
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
        Before anything runs: on an unknown profile or notebook, a notebook without the parameter
        `profile`, or if the quick profile were to overwrite the repository's outputs.
    FileNotFoundError
        If there is no repository around the working directory.
    """
    root = repository_root() if root is None else Path(root).resolve()
    output = _output(profile, output, root)
    figures, chosen = output / "figures", select_notebooks(notebooks, root)
    for path in chosen:
        check_parameters(path, ["profile"])
    stamps: dict[str, str | None] = dict.fromkeys(path.stem for path in find_notebooks(root))
    registry.prune(figures, stamps)  # what a notebook left that has gone
    outcomes = {}
    for task, outcome in _outcomes(chosen, profile, output, force, dask):
        outcomes[task.path] = outcome
        if outcome.error is None:
            stamps[task.path.stem] = task.stamp
            registry.prune(figures, stamps)  # what an earlier version of it left
            registry.record_run_time(figures, task.path.stem, task.stamp, outcome.seconds)
            enter(output, task.path, task.stamp, outcome.seconds)
    problems = _written_pages(figures, stamps, root)
    done = tuple(outcomes[path] for path in chosen)
    return Report(done, tuple(problems), _systems_table(figures, done), _largest_process())


def notebook_stamp(path: str | os.PathLike, profile: str) -> str:
    """Hash of what a notebook's outputs depend on: profile, code cells, and what these reach.

    Prose does not count, nor what the code does not use: see `vidsindy_lite.stamp`.
    """
    path = Path(path)
    code = [cell.source for cell in jupytext.read(path).cells if cell.cell_type == "code"]
    return source_stamp("\n".join([f"{profile!r}", *code]), path.parent.parent)


# ------------------------------------------------------------------------------------------ details


@dataclass(frozen=True)
class _Task:
    """One notebook to execute, and how."""

    path: Path
    label: str
    stamp: str
    profile: str
    output: Path
    environment: dict[str, str]


def _output(profile: str, output: str | os.PathLike | None, root: Path) -> Path:
    """The folder that a run writes to, checked."""
    if profile not in PROFILES:
        raise ValueError(f"profile: expected one of {', '.join(PROFILES)}, got {profile!r}")
    if output is None:
        output = root if profile == "full" else root / "build" / "quick"
    output = Path(output).resolve()
    if profile == "quick" and output == root:
        raise ValueError(
            f"output: the quick profile needs a folder of its own, got {str(output)!r}"
        )
    return output


def _written_pages(figures: Path, stamps: Mapping[str, str | None], root: Path) -> list[str]:
    """Write the index of the figures, with the repository's own the README; what is wrong."""
    registry.write_index(figures)
    problems = registry.check_folder(figures, stamps)
    if figures == root / "figures" and (root / "README.md").exists():
        try:
            write_readme(root)
        except (ValueError, FileNotFoundError) as missing:
            problems.append(f"README and docs: {missing}")
    return problems


def _outcomes(
    chosen: Sequence[Path], profile: str, output: Path, force: bool, dask: str | None
) -> Iterator[tuple[_Task, Outcome]]:
    """How each notebook ends: at once what is up to date, then what is executed, as it ends."""
    figures, due = output / "figures", []
    for number, path in enumerate(chosen, start=1):
        stamp = notebook_stamp(path, profile)
        environment = {
            "VIDSINDY_FIGURES": str(figures),
            "VIDSINDY_NOTEBOOK": path.stem,
            "VIDSINDY_STAMP": stamp,
            **({"VIDSINDY_DASK": dask} if dask else {}),
        }
        label = f"[{number}/{len(chosen)}] {path.stem}"
        task = _Task(path, label, stamp, profile, output, environment)
        seconds = None if force else seconds_if_current(output, path, stamp)
        if seconds is None:
            due.append(task)
        else:
            print(f"{label}: up to date ({seconds:.1f} s when it ran)", flush=True)
            yield task, Outcome(path.stem, seconds, up_to_date=True)
    # The longest first, so that none runs on alone for long.
    usual = registry.load_run_times(figures)
    yield from _executed(sorted(due, key=lambda task: -usual.get(task.path.stem, 0.0)))


def _executed(tasks: Sequence[_Task]) -> Iterator[tuple[_Task, Outcome]]:
    """The notebooks as they end, begun in this order; each has a kernel, a process of its own."""
    waiting, running = deque(tasks), dict[Future[Outcome], _Task]()
    others = psutil.Process().children(recursive=True)
    # The bar stands still while a notebook runs, but for the clock and what is running.
    with (
        ThreadPoolExecutor(AT_ONCE) as pool,
        tqdm(total=len(tasks), desc="notebooks", leave=False, disable=None) as bar,
    ):
        try:
            while waiting or running:
                while waiting and len(running) < AT_ONCE:
                    task = waiting.popleft()
                    _say(task.label)
                    running[pool.submit(_outcome, task)] = task
                bar.set_postfix_str(", ".join(task.path.stem for task in running.values()))
                for future in wait(running, timeout=1, return_when=FIRST_COMPLETED).done:
                    task, outcome = running.pop(future), future.result()
                    failed = f"FAILED\n\n{outcome.error}\n" if outcome.error else ""
                    _say(f"{task.label}: {failed or f'{outcome.seconds:.1f} s'}")
                    bar.update()
                    yield task, outcome
        finally:
            while wait(running, timeout=0.1).not_done:  # left early: the kernels end now
                for process in psutil.Process().children(recursive=True):
                    with suppress(psutil.NoSuchProcess):
                        if process not in others:
                            process.kill()


def _outcome(task: _Task) -> Outcome:
    """Execute a notebook, write its executed half, and tell how it ended."""
    error, started = None, time.perf_counter()
    try:
        executed = execute(task.path, {"profile": task.profile}, environment=task.environment)
        half = nbformat.writes(clean(executed, task.path, task.profile, task.stamp)) + "\n"
        write_file(task.output / "notebooks" / f"{task.path.stem}.ipynb", half.encode())
    except NotebookError as failure:
        error = str(failure)
    except Exception as failure:  # such as a full disk: the other notebooks go on
        error = f"{task.path.stem}: {type(failure).__name__}: {failure}"
    return Outcome(task.path.stem, time.perf_counter() - started, error)


def _say(line: str) -> None:
    with tqdm.external_write_mode():
        print(line, flush=True)


def _largest_process() -> float | None:
    """Peak memory in GB of the largest process that this one has started, kernels' own included."""
    if sys.platform == "win32":
        return None
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * unit / 1e9


def _systems_table(figures: Path, outcomes: Sequence[Outcome]) -> artifacts.Table | None:
    """The table of the systems, if its notebook ran or is up to date."""
    try:
        table = artifacts.load_table(SYSTEMS_TABLE, figures)
    except FileNotFoundError:
        return None
    succeeded = {outcome.notebook for outcome in outcomes if outcome.error is None}
    return table if table.notebook in succeeded else None
