"""Many independent tasks in parallel; what is finished is kept, so a stopped sweep goes on later.

A task is a frozen dataclass that says all there is to say about it, its seed included, and what is
done with it is a function of this package::

    results = sweep(run_trial, grid(["Lorenz"], {"noise": (0, 0.1, 0.2)}, range(5)))

Each result goes to a file as soon as it is there, build/cache/<hash>/<function>/<task>.json in the
repository, or in place of build/cache the folder that the environment variable VIDSINDY_CACHE
names. The hash is that of the code which computes results, and of the libraries' versions: other
code finds no results. A file holds plain values: it is read, never executed. A package installed
outside a clone of its repository stores nothing.

The tasks run in processes of this machine, or on a Dask cluster of any size. Two sweeps of this
machine that share tasks may run at the same time: who comes second waits for the first one's
result.

Why not joblib.Memory: it watches the source of the one function that it wraps, not of what that
calls; it does not make two processes share a task, nor take a result that a cluster computed; and
it stores pickles, which whoever can write into the folder makes run.
"""

import hashlib
import importlib
import json
import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar
from uuid import uuid4

from tqdm import tqdm

from ..checks import MALFORMED, check_integer, check_items
from ..storage import PACKAGE, RESULTLESS, code_hash, edited, repository_root, write_file
from ..values import decoded, encoded

Task = TypeVar("Task")
Result = TypeVar("Result")
Function = Callable[[Task], Result]


class TaskError(RuntimeError):
    """A task of a sweep raised; the message names the task."""


def sweep(
    function: Function[Task, Result],
    tasks: Iterable[Task],
    *,
    jobs: int = 2,
    desc: str = "sweep",
    dask: str | None = None,
) -> list[Result]:
    """Call a function for each task, in parallel; results that are stored are read back.

    Parameters
    ----------
    function : callable
        A top-level function of this package, of one task. Its result has to be made of numbers,
        text, None, arrays, dataclasses of this package, and tuples, lists and dicts of them.
    tasks : iterable
        Frozen dataclasses of numbers, text and tuples of them: a result is stored under the repr.
    jobs : int
        Processes on this machine, one thread each; 1 works in this very process.
    desc : str
        Label of the progress bar, which starts at what is stored.
    dask : str, optional
        Address of a Dask scheduler whose workers run the tasks instead, e.g.
        "tcp://10.0.0.1:8786"; by default the environment variable VIDSINDY_DASK, if set.

    Returns
    -------
    list
        The results in the order of the tasks.

    Raises
    ------
    ValueError
        If the function is not one of the package, a task is no frozen dataclass, or jobs < 1.
    TaskError
        If a task raises: the sweep stops, and what was finished stays stored.
    ImportError
        If a cluster is asked for and `distributed` is not installed.
    RuntimeError
        If a worker of the cluster has other code of this package.
    """
    tasks = list(check_items("tasks", tasks))
    _check(function, tasks, jobs)
    address = dask or os.environ.get("VIDSINDY_DASK")
    files = _files(function, tasks)
    results = _stored(files, tasks)
    todo = {number: task for number, task in enumerate(tasks) if number not in results}
    if address:
        work = _on_cluster(function, todo, address, files)
    else:
        work = _here(function, todo, jobs, files)
    with tqdm(total=len(tasks), initial=len(results), desc=desc) as bar:
        for number, result in work if todo else ():
            results[number] = result
            bar.update()
    return [results[number] for number in range(len(tasks))]


def remember(function: Function[Task, Result], task: Task) -> Result:
    """Call a function for one task in this process, or read the stored result back.

    For a task that builds on the results of another sweep. While another process of this machine
    is at the same task, this one waits for its result.

    Parameters
    ----------
    function, task
        As for `sweep`.
    """
    _check(function, [task], jobs=1)
    return _remember(function, task, _files(function, [task]).get(0))


def _check(function: Callable, tasks: list, jobs: int) -> None:
    home, name = getattr(function, "__module__", ""), getattr(function, "__qualname__", "")
    if home.partition(".")[0] != PACKAGE.name or not name.isidentifier():
        raise ValueError(
            f"function: must be a top-level function of {PACKAGE.name}, whose code the stored "
            f"results depend on, got {function!r}"
        )
    for task in tasks:
        try:
            hash(task)  # fails with arrays, and the repr of a large one leaves numbers out
            frozen = type(task).__dataclass_params__.frozen
        except (AttributeError, TypeError):
            frozen = False
        if not frozen:
            raise ValueError(
                "tasks: each must be a frozen dataclass of numbers, text and tuples of them, "
                f"got {task!r}"
            )
    check_integer("jobs", jobs, 1)


def _remember(function: Function[Task, Result], task: Task, file: Path | None) -> Result:
    if file is None:
        return function(task)
    from filelock import FileLock

    file.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(f"{file}.lock"):
        results = _stored({0: file}, [task])
        if not results:
            if file.is_file():
                warnings.warn(f"computed again, as {file} does not hold its result", stacklevel=2)
            results[0] = function(task)
            _store(file, task, results[0])
    return results[0]


def _call(
    function: Function[Task, Result], number: int, task: Task, file: Path | None = None
) -> tuple[int, Result]:
    try:
        return number, _remember(function, task, file)
    except Exception as error:
        raise TaskError(
            f"{function.__name__}({task!r}) raised {type(error).__name__}: {error}"
        ) from error


def _here(
    function: Function[Task, Result], todo: Mapping[int, Task], jobs: int, files: dict[int, Path]
) -> Iterator[tuple[int, Result]]:
    """Numbers and results of the tasks as they come, from processes of this machine."""
    import cv2
    from joblib import Parallel, delayed, parallel_config

    # One thread of BLAS, OpenMP and torch; OpenCV has its own.
    one_thread = {"inner_max_num_threads": 1, "initializer": cv2.setNumThreads, "initargs": (1,)}
    with parallel_config("loky", n_jobs=jobs, **one_thread):
        # One task a batch: a result comes when it is there, not when its batch is.
        parallel = Parallel(return_as="generator_unordered", batch_size=1)
        yield from parallel(
            delayed(_call)(function, number, task, files.get(number))
            for number, task in todo.items()
        )


def _on_cluster(
    function: Function[Task, Result], todo: Mapping[int, Task], address: str, files: dict[int, Path]
) -> Iterator[tuple[int, Result]]:
    """Numbers and results of the tasks as they come, from the workers of a Dask cluster.

    The workers need not see the files of this machine, so the results are stored here. Not by
    joblib's Dask backend: that waits for ever for a task that ends its worker.
    """
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise ImportError(
            "dask: a cluster needs the package distributed, which the extra 'cluster' installs: "
            f'pip install "{PACKAGE.name}[cluster]"'
        ) from None
    with Client(address) as client:
        client.wait_for_workers(1, timeout=60)
        ours, theirs = code_hash(RESULTLESS), client.run(code_hash, RESULTLESS)
        differing = [worker for worker, other in theirs.items() if other != ours]
        if differing:
            raise RuntimeError(
                f"dask: all workers must have this very code of {PACKAGE.name}, "
                f"got other code on {', '.join(differing)}"
            )
        # The key is what Dask calls a task, in its errors too.
        keys = [f"{function.__name__}({task!r}) {uuid4().hex}" for task in todo.values()]
        futures = client.map(partial(_call, function), todo, todo.values(), key=keys)
        for _, (number, result) in as_completed(futures, with_results=True):
            if number in files:
                _store(files[number], todo[number], result)
            yield number, result


# ----------------------------------------------------------------------------------- stored results


def _files(function: Callable, tasks: list) -> dict[int, Path]:
    """The file of each task's result by number of the task; none outside a clone."""
    try:
        root = repository_root(PACKAGE)
    except FileNotFoundError:
        return {}
    if edited():
        warnings.warn("no result is stored or taken, as the code was edited since this session "
                      "began: start it anew", stacklevel=4)  # fmt: skip
        return {}
    named = os.environ.get("VIDSINDY_CACHE")
    cache = Path(named).expanduser() if named else root / "build" / "cache"
    try:
        cache.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"VIDSINDY_CACHE: must be a folder or a new one, got {error}") from None
    module = function.__module__.removeprefix(f"{PACKAGE.name}.")
    folder = cache / code_hash(RESULTLESS) / f"{module}.{function.__name__}"
    names = [hashlib.sha256(repr(task).encode()).hexdigest()[:32] for task in tasks]
    return {number: folder / f"{name}.json" for number, name in enumerate(names)}


def _store(file: Path, task: object, result: object) -> None:
    value = encoded(result, lambda kind: f"{kind.__module__}:{kind.__qualname__}")
    content = json.dumps({"task": repr(task), "result": value})
    try:
        write_file(file, f"{_digest(content)}\n{content}\n".encode())
    except OSError as error:  # such as a full disk, or a folder in its place
        warnings.warn(f"a result is not stored: {error}", stacklevel=2)


def _stored(files: Mapping[int, Path], tasks: list) -> dict[int, Any]:
    """The results that are stored as they were written, by number of the task."""
    results = {}
    for number, file in files.items():
        try:
            digest, content = file.read_text("utf-8").splitlines()
            entry = json.loads(content) if digest == _digest(content) else {}
            if entry["task"] == repr(tasks[number]):
                results[number] = decoded(entry["result"], _built)
        except (*MALFORMED, OSError):  # damaged, or none
            continue
    return results


def _digest(content: str) -> str:
    return hashlib.sha256(content.encode()).hexdigest()


def _built(place: str, parts: dict[str, Any]) -> Any:
    """A dataclass of the package with these very fields: its constructor might round them."""
    module, _, name = place.partition(":")
    if module.partition(".")[0] != PACKAGE.name:
        raise ValueError(f"not of the package: {place}")
    kind = getattr(importlib.import_module(module), name)
    names = {field.name for field in fields(kind)} if is_dataclass(kind) else {None}
    if parts.keys() != names:
        raise ValueError(f"no such dataclass: {place} of {', '.join(parts)}")
    value = object.__new__(kind)
    vars(value).update(parts)
    return value
