"""The runner on tiny notebooks: what it makes of a good one, how each bad one is seen to fail."""

import json
import os
import re
import shutil
import subprocess
import sys
from functools import cache

import jupytext
import nbformat
import psutil
import pytest
from helpers import TinyRepository, full_disk, wait_for

from vidsindy_lite.__main__ import main
from vidsindy_lite.companion import run as runner
from vidsindy_lite.companion.run import NotebookError, execute, run, select_notebooks
from vidsindy_lite.storage import PACKAGE

PLOT = (
    "import matplotlib.pyplot as plt\n\nfigure, axes = plt.subplots()\naxes.plot([0, 1], [0, 1]);"
)
TABLE = """\
import time
from vidsindy_lite.companion import artifacts

row = {"system": profile, "value": 1.0, "seconds": time.time()}
artifacts.save_table("table_1", [row], caption="The systems.")"""
MADE = """\
import json, os, pathlib

table = {"id": "table_1", "kind": "table", "notebook": os.environ["VIDSINDY_NOTEBOOK"]}
folder = pathlib.Path(os.environ["VIDSINDY_FIGURES"])
folder.mkdir()
table |= {"caption": "Without the package, which takes long to import.", "rows": [{"is": profile}]}
(folder / "table_1.json").write_text(json.dumps(table))"""
FIGURE = """\
from vidsindy_lite.companion import artifacts

artifacts.save_figure("fig_1", figure, caption="A line.", numbers={"x": [0, 1]})
"""
NOISE = """\
import sys

print("to stdout", flush=True)
print("to stderr", file=sys.stderr, flush=True)
print("again")
{3, 1, 2} | {"b", "a"}"""


def files(folder):
    found = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


def outputs(tiny):
    """What would be committed."""
    return {name: text for name, text in files(tiny.root).items() if not name.startswith("build/")}


@pytest.fixture(scope="module")
def executed_once(tmp_path_factory):
    """A repository with one good notebook, after a full run."""
    tiny = TinyRepository(tmp_path_factory.mktemp("executed"))
    tiny.write("01_first", PLOT, FIGURE + TABLE, NOISE)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tiny.root)
        (outcome,) = run()
    assert outcome.error is None
    assert outcome.changed == ("fig_1", "table_1", "01_first.ipynb")
    return tiny


@pytest.fixture
def good(executed_once, tmp_path, monkeypatch):
    """A copy of it, to change."""
    shutil.copytree(executed_once.root, tmp_path / "repository")
    monkeypatch.chdir(tmp_path / "repository")
    return TinyRepository(tmp_path / "repository")


@pytest.fixture
def no_kernel(monkeypatch):
    """Notebooks are executed without a kernel: for tests of when they are."""

    def execute(path, parameters, folder):
        notebook = jupytext.read(path)
        for cell in notebook.cells:
            if cell.cell_type == "code":
                cell.outputs = []
        folder.mkdir()
        nbformat.write(notebook, folder / runner.EXECUTED)

    monkeypatch.setattr(runner, "execute", execute)


@pytest.fixture
def instant(no_kernel, monkeypatch):
    """And the code is known."""
    monkeypatch.setattr(runner, "code_hash", cache(lambda: "this"))


def executed(outcomes):
    """Names of the notebooks that a run executed."""
    assert not any(outcome.error for outcome in outcomes), outcomes
    return [outcome.notebook for outcome in outcomes if outcome.seconds is not None]


def test_full_run_writes_into_the_repository(executed_once):
    made = {"fig_1.png", "fig_1.json", "table_1.json", "README.md"}
    assert {path.name for path in (executed_once.root / "figures").iterdir()} == made
    cleaned = nbformat.read(executed_once.notebooks / "01_first.ipynb", as_version=4)
    assert set(cleaned.metadata) == {"jupytext", "kernelspec"}
    kept = [dict(cell.metadata) for cell in cleaned.cells]
    assert kept == [{}, {"tags": ["parameters"]}, {}, {}, {}]
    assert [cell.id for cell in cleaned.cells] == [f"cell-{i:02d}" for i in range(5)]
    counts = [cell.execution_count for cell in cleaned.cells if cell.cell_type == "code"]
    assert counts == [1, 2, 3, 4]
    stream, result = cleaned.cells[-1].outputs
    assert (stream.name, stream.text) == ("stdout", "to stdout\nagain\n")
    assert result.execution_count == 4
    assert "image/png" in cleaned.cells[2].outputs[0].data
    assert "| full" in cleaned.cells[3].outputs[0].data["text/markdown"]


def test_what_differs_is_refreshed_and_nothing_else_though_a_disk_was_full(
    good, no_kernel, monkeypatch
):
    record = good.root / "figures" / "table_1.json"
    before = outputs(good)
    record.write_text(record.read_text().replace("1.0", "1.01"))
    for writer in ("compare.write_files", "run.write_file"):
        with monkeypatch.context() as patch:
            patch.setattr(f"vidsindy_lite.companion.{writer}", full_disk)
            (outcome,) = run()
        assert "No space left on device" in outcome.error
    (outcome,) = run()
    assert (outcome.seconds, outcome.changed) == (None, ("table_1", "01_first.ipynb"))
    assert outputs(good) == before
    good.write("01_first", PLOT, "x = 1")
    (outcome,) = run()
    assert set(outcome.changed) == {"fig_1", "table_1", "01_first.ipynb"}
    assert set(files(good.root / "figures")) == {"README.md"}


def test_only_other_code_is_executed(good, instant, monkeypatch):
    good.write("02_second", "x = 1")
    assert executed(run()) == ["01_first", "02_second"]
    assert executed(run()) == []
    assert executed(run(["02"], force=True)) == ["02_second"]
    path = good.notebooks / "02_second.py"
    path.write_text(path.read_text().replace("A tiny notebook", "A small notebook"))
    assert executed(run()) == []
    assert "A small notebook" in path.with_suffix(".ipynb").read_text()
    monkeypatch.setattr(runner, "code_hash", cache(lambda: "another"))  # of the package
    assert executed(run()) == ["01_first", "02_second"]


@pytest.mark.slow
def test_quick_run_goes_to_the_build_folder_only_though_its_kernel_dies_as_it_starts(
    good, monkeypatch, capsys
):
    spec, seen = good.root / "kernels" / "python3" / "kernel.json", good.root / "build" / "seen"
    code = (
        f"import pathlib, runpy, sys; seen = pathlib.Path({str(seen)!r})\n"
        "if not seen.exists():\n    seen.touch()\n    sys.exit(1)\n"
        "runpy.run_module('ipykernel_launcher', run_name='__main__')"
    )
    argv = [sys.executable, "-c", code, "-f", "{connection_file}"]
    spec.parent.mkdir(parents=True)
    spec.write_text(json.dumps({"argv": argv, "display_name": "Python 3", "language": "python"}))
    monkeypatch.setenv("JUPYTER_PATH", str(good.root))
    good.write("02_second", MADE)
    before = outputs(good)
    monkeypatch.chdir(good.notebooks)
    assert main(["run", "02", "--profile", "quick"]) == 0
    assert seen.exists()
    assert "02_second: " in (said := capsys.readouterr().out)
    assert said.endswith("2 outputs changed; failed: none\n")
    made = files(good.root / "build" / "quick")
    assert {"notebooks/02_second.ipynb", "figures/README.md"} < set(made)
    assert b'"quick"' in made["figures/table_1.json"]
    assert outputs(good) == before


@pytest.mark.slow
def test_notebooks_that_fail_leave_what_was_there(good, monkeypatch, capsys):
    before = outputs(good)
    source = good.write("01_first", MADE, "y = 1\nraise ArithmeticError('seen to fail')")
    good.write("02_dead", "x = 1", "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)")
    good.write("03_exits", "import sys\nsys.exit(0)", "x = 1")
    monkeypatch.chdir(good.notebooks)
    assert main(["run"]) == 1
    said = capsys.readouterr().out
    assert "01_first, cell In [4]:\n\n    y = 1\n    raise ArithmeticError('seen to fail')" in said
    assert "\nArithmeticError: seen to fail\n" in said
    assert re.search(r"03_exits, cell In \[3\](?s:.*)\nSystemExit: 0\n", said)
    assert "02_dead did not run to its end: nbclient.exceptions.DeadKernelError" in said
    assert said.endswith("0 outputs changed; failed: 01_first, 02_dead, 03_exits\n")
    after = outputs(good)
    assert after.pop("notebooks/01_first.py") == source.read_bytes()
    assert after.keys() - before.keys() == {"notebooks/02_dead.py", "notebooks/03_exits.py"}
    del before["notebooks/01_first.py"]
    assert before.items() <= after.items()
    failed = good.root / "build" / "runs" / "01_first-full" / "running"
    assert "table_1.json" in {path.name for path in (failed / "figures").iterdir()}


def test_a_notebook_that_does_not_end_has_failed(tiny, tmp_path, monkeypatch):
    path = tiny.write("01_bad", "while True:\n    pass")
    with pytest.raises(ValueError, match="notebook 01_bad has profile .* got colour"):
        execute(path, {"profile": "quick", "colour": "red"}, tmp_path / "run")
    monkeypatch.setattr(runner, "CELL_TIMEOUT", 1)
    with pytest.raises(NotebookError, match=r"01_bad, cell In (?s:.*)timed out"):
        execute(path, {"profile": "quick"}, tmp_path / "run")


def test_an_edit_meanwhile_is_not_taken_for_a_run_of_this_code(good, instant, monkeypatch):
    hashes = iter(["before", "after", "before", "before"])
    monkeypatch.setattr(runner, "_key", lambda source: next(hashes))
    assert executed(run()) == ["01_first"]
    assert executed(run()) == ["01_first"]


def start(tiny):
    command = [sys.executable, "-m", "vidsindy_lite", "run"]
    here = os.environ | {"PYTHONPATH": str(PACKAGE.parent)}
    return subprocess.Popen(command, cwd=tiny.notebooks, env=here, start_new_session=True)


@pytest.mark.slow
def test_a_run_that_is_killed_leaves_no_process_and_goes_on_later(good, no_kernel):
    before = outputs(good)
    busy = "[os.getpid(), *(process.pid for process in psutil.Process().children())]"
    long = good.write(
        "02_long",
        "import os, psutil, subprocess, sys, time",
        "subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])",
        f"open('started', 'w').write(' '.join(map(str, {busy})))\ntime.sleep(600)",
    )
    process = start(good)
    started = good.notebooks / "started"
    wait_for(lambda: started.exists() and started.read_text())
    below = psutil.Process(process.pid).children(recursive=True)
    assert {int(pid) for pid in started.read_text().split()} <= {each.pid for each in below}
    process.kill()
    assert process.wait(60) != 0
    wait_for(lambda: not any(each.is_running() for each in below))
    started.unlink()
    long.unlink()
    assert outputs(good) == before
    good.write("02_long", "x = 1")
    assert executed(run()) == ["02_long"]
    assert not (good.root / "build" / "runs" / "02_long-full" / "running").exists()


def test_names_of_notebooks(tiny):
    for name in ("01_first", "02_second", "02_twin"):
        tiny.write(name)
    for names, chosen in (
        ([], ["01_first", "02_second", "02_twin"]),
        (["01"], ["01_first"]),
        (["02_second", "01_first"], ["01_first", "02_second"]),
        (["02"], ["02_second", "02_twin"]),
        (["notebooks/02_twin.ipynb", "elsewhere/01_first.py"], ["01_first", "02_twin"]),
    ):
        assert [path.stem for path in select_notebooks(names, tiny.root)] == chosen


def test_what_makes_no_sense_is_refused(tiny, tmp_path, monkeypatch, capsys):
    with pytest.raises(ValueError, match="profile: must be one of full, quick, got 'small'"):
        run(profile="small")
    tiny.write("01_first")
    for name in ("first", "01_f", ""):
        with pytest.raises(ValueError, match=f"notebook: expected one of 01_first, .* '{name}'"):
            select_notebooks([name], tiny.root)
    monkeypatch.chdir(tmp_path.parent)
    assert main(["run"]) == 2
    assert "repository: expected to be inside a clone" in capsys.readouterr().err
