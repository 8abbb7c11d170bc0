"""Execute one notebook through papermill, and see to it that a failure is one."""

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from queue import Empty
from typing import Any

import jupytext
import papermill
from nbclient.exceptions import CellTimeoutError, DeadKernelError
from nbclient.util import run_sync
from nbformat import NotebookNode
from papermill.clientwrap import PapermillNotebookClient
from papermill.engines import Engine, NotebookExecutionManager, papermill_engines
from papermill.exceptions import PapermillExecutionError, strip_color
from traitlets.config import Config

from ..stamp import PACKAGE

CELL_TIMEOUT = 3600  # seconds; papermill's own default is to wait for ever
STARTUP_TIMEOUT = 120  # seconds, of a kernel
ENGINE = "vidsindy_lite"  # under which papermill knows ours


class NotebookError(RuntimeError):
    """A notebook did not run to its end; the message shows the cell and the traceback."""


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
        executed = papermill.execute_notebook(
            jupytext.read(path), None, dict(parameters),
            engine_name=ENGINE, kernel_name="python3", progress_bar=False,
            folder=path.parent, environment=environment or {}, timeout=timeout,
        )  # fmt: skip
    except PapermillExecutionError as error:
        traceback = strip_color("\n".join(error.traceback)) or f"{error.ename}: {error.evalue}"
        raise _cell_error(path, error.exec_count, error.source, traceback) from None
    except (CellTimeoutError, DeadKernelError) as error:
        raise NotebookError(f"{path.stem}: {error}") from None
    except (RuntimeError, OSError) as error:
        raise NotebookError(
            f"{path.stem}: could not be executed: {type(error).__name__}: {error}. If kernel "
            "python3 did not start, what it wrote stands above; see `jupyter kernelspec list`."
        ) from error
    for cell in executed.cells:
        if cell.cell_type == "code" and cell.source.strip():
            completed = cell.metadata.papermill.status == "completed"
            if not completed or cell.execution_count is None:
                reason = "The run ended in this cell, before the end of the notebook."
                raise _cell_error(path, cell.execution_count, cell.source, reason)
    return executed


# ------------------------------------------------------------------------------------------ details


class _Client(PapermillNotebookClient):
    """Papermill's client, which leaves the kernel when it is idle, not when it has replied.

    Shutting a kernel down begins with an interrupt. One that is idle ignores it; one that still
    returns from its last request reports it on stderr.
    """

    def wait_for_reply(self, msg_id: str, cell: NotebookNode | None = None) -> dict | None:
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
    """Makes papermill use that client, and give folder and environment to the kernel alone.

    So notebooks can run at once: papermill itself would change this process's.
    """

    @classmethod
    def execute_managed_notebook(
        cls, nb_man: NotebookExecutionManager, kernel_name: str, **options: Any
    ) -> None:
        """Execute the cells."""
        client = _Client(
            nb_man,
            kernel_name=kernel_name,
            timeout=options["timeout"],
            startup_timeout=STARTUP_TIMEOUT,
            coalesce_streams=True,
            # The kernel warns on stderr that anyone on the machine could listen in otherwise.
            config=Config(KernelManager={"transport_encryption": "auto"}),
        )
        client.execute(cwd=options["folder"], env=_kernel_environment(options["environment"]))


papermill_engines.register(ENGINE, _Engine)


def _kernel_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """What the kernel inherits: this very package, an order of sets, one thread per process."""
    paths = [str(PACKAGE.parent), os.environ.get("PYTHONPATH")]
    return {
        # Sums do not depend on the number of cores, and joblib's workers do not fight over them.
        "OMP_NUM_THREADS": "1",
        "OPENCV_FOR_THREADS_NUM": "1",
        **os.environ,
        **environment,
        "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        "PYTHONHASHSEED": "0",  # the order of a set is then the same in every run
        "PYDEVD_DISABLE_FILE_VALIDATION": "1",  # the kernel's debugger warns without it
    }


def _cell_error(path: Path, count: int | None, source: str, what: str) -> NotebookError:
    shown = "\n".join(f"    {line}" for line in source.splitlines())
    return NotebookError(f"{path.stem}, cell In [{count}]:\n\n{shown}\n\n{what}")
