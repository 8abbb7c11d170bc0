"""The runner on tiny notebooks: what it makes of a good one, how each bad one is seen to fail."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import nbformat
import psutil
import pytest
from helpers import TinyRepository

from vidsindy_lite import stamp as repository
from vidsindy_lite.__main__ import main
from vidsindy_lite.companion import ledger, registry
from vidsindy_lite.companion import run as runner
from vidsindy_lite.companion.artifacts import INDEX
from vidsindy_lite.companion.execute import NotebookError, execute
from vidsindy_lite.companion.records import RUN_TIMES

pytestmark = pytest.mark.slow  # starts kernels

LEDGER = ledger.LEDGER.as_posix()

PLOT = (
    "import matplotlib.pyplot as plt\n\nfigure, axes = plt.subplots()\naxes.plot([0, 1], [0, 1]);"
)
SAVE = """\
from vidsindy_lite.companion import artifacts

artifacts.save_figure("fig_1", figure, caption="A line.", numbers={"x": [0, 1]})
artifacts.save_table(
    "table_systems", [{"system": profile, "seconds": 1.234}], caption="The systems."
)"""
NOISE = """\
import sys

print("to stdout")
print("to stderr", file=sys.stderr)
print("again")
{3, 1, 2} | {"b", "a"}"""


def files(folder):
    found = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


# ------------------------------------------------------------------------------------ a good run


@pytest.fixture(scope="module")
def executed_once(tmp_path_factory):
    """A repository with one good notebook, after a full run."""
    tiny = TinyRepository(tmp_path_factory.mktemp("executed"))
    tiny.write("01_first", PLOT, SAVE, NOISE)
    assert runner.run(root=tiny.root).ok
    return tiny


def copied(tiny, folder):
    shutil.copytree(tiny.root, folder)
    return TinyRepository(folder)


@pytest.fixture
def good(executed_once, tmp_path):
    """A copy of it, to change."""
    return copied(executed_once, tmp_path / "repository")


@pytest.fixture(scope="module")
def bare_once(tmp_path_factory):
    """One whose notebook imports nothing, for what does not depend on what a notebook does."""
    tiny = TinyRepository(tmp_path_factory.mktemp("bare"))
    tiny.write("01_first", "print(1)")
    assert runner.run(root=tiny.root).ok
    return tiny


@pytest.fixture
def bare(bare_once, tmp_path):
    """A copy of it, to change."""
    return copied(bare_once, tmp_path / "bare")


def test_full_run_writes_into_the_repository(executed_once):
    made = {"fig_1.png", "fig_1.svg", "fig_1.json", "README.md", "run_times.json"}
    made |= {f"table_systems.{suffix}" for suffix in ("csv", "md", "json")}
    assert {path.name for path in (executed_once.root / "figures").iterdir()} == made
    assert (executed_once.notebooks / "01_first.ipynb").exists()


def test_second_execution_changes_no_byte(good, capsys):
    before = files(good.root)
    assert runner.run(root=good.root, force=True).ok
    after = files(good.root)
    assert before.pop(LEDGER) != after.pop(LEDGER)  # the time it took
    assert after == before
    assert "[1/1] 01_first" in capsys.readouterr().out


def test_quick_run_goes_to_the_build_folder_only(good):
    before = files(good.root)
    report = runner.run(["01"], "quick", root=good.root)
    assert report.ok
    assert report.systems.rows[0]["system"] == "quick"
    assert str(report.systems) in str(report)
    made = files(good.root / "build" / "quick")
    assert {"notebooks/01_first.ipynb", "figures/fig_1.png", "figures/README.md"} <= set(made)
    shutil.rmtree(good.root / "build" / "quick")
    assert files(good.root) == before


def test_executed_notebook_is_clean(executed_once):
    cleaned = nbformat.read(executed_once.notebooks / "01_first.ipynb", as_version=4)
    assert set(cleaned.metadata) == {"jupytext", "kernelspec", "vidsindy_lite"}
    stamp = runner.notebook_stamp(executed_once.notebooks / "01_first.py", "full")
    assert cleaned.metadata.vidsindy_lite == {"profile": "full", "stamp": stamp}
    kept = [dict(cell.metadata) for cell in cleaned.cells]
    assert kept == [{}, {"tags": ["parameters"]}, {}, {}, {}]
    assert [cell.id for cell in cleaned.cells] == [f"cell-{i:02d}" for i in range(5)]
    counts = [cell.execution_count for cell in cleaned.cells if cell.cell_type == "code"]
    assert counts == [1, 2, 3, 4]
    stream, result = cleaned.cells[-1].outputs
    assert (stream.name, stream.text) == ("stdout", "to stdout\nagain\n")
    assert result.execution_count == 4
    assert "image/png" in cleaned.cells[2].outputs[0].data
    assert "<table>" in cleaned.cells[3].outputs[0].data["text/html"]


def test_index_has_the_run_times(executed_once):
    figures = executed_once.root / "figures"
    times = json.loads((figures / RUN_TIMES).read_text())
    stamp = runner.notebook_stamp(executed_once.notebooks / "01_first.py", "full")
    assert times["01_first"]["stamp"] == stamp
    assert "01_first.ipynb) | about " in (figures / INDEX).read_text()


def test_notebook_that_writes_less_than_before_leaves_nothing_behind(good):
    good.write("01_first", "x = 1")
    assert runner.run(root=good.root).ok
    assert set(files(good.root / "figures")) == {"README.md", "run_times.json"}
    assert runner.run(root=good.root).outcomes[0].up_to_date


def test_memory_of_the_largest_process_is_reported(tiny):
    tiny.write(
        "01_large",
        """\
from joblib import Parallel, delayed

def fill(size):
    return len(b"x" * size)

Parallel(2)(delayed(fill)(size) for size in (400_000_000, 100_000_000))""",
    )
    report = runner.run(root=tiny.root)
    assert 0.4 < report.memory < 4
    assert f"largest process: {report.memory:.2f} GB" in str(report)


# --------------------------------------------------------------------------- what is up to date


def executed(report):
    """Names of the notebooks that a run executed."""
    assert report.ok, str(report)
    return [outcome.notebook for outcome in report.outcomes if not outcome.up_to_date]


def test_what_is_up_to_date_is_kept(good, capsys):
    before = files(good.root)
    report = runner.run(root=good.root)
    assert executed(report) == []
    assert files(good.root) == before
    seconds = json.loads(before[LEDGER])["01_first"]["seconds"]
    assert report.outcomes[0].seconds == seconds > 0
    assert f"up to date ({seconds:.1f} s when it ran)" in capsys.readouterr().out
    assert str(report).endswith("0 run in 0.0 s, 1 up to date, 0 failed")
    assert str(report.systems) in str(report)


def test_only_what_has_changed_is_executed(bare):
    bare.write("02_second", "x = 1")
    assert executed(runner.run(root=bare.root)) == ["02_second"]
    bare.write("02_second", "x = 2")
    assert executed(runner.run(root=bare.root)) == ["02_second"]
    assert executed(runner.run(root=bare.root)) == []


def test_edited_prose_gets_into_the_executed_half(bare):
    path = bare.notebooks / "01_first.py"
    path.write_text(path.read_text().replace("A tiny notebook", "A small notebook"))
    assert executed(runner.run(root=bare.root)) == ["01_first"]
    assert "A small notebook" in path.with_suffix(".ipynb").read_text()


def test_force_executes_what_is_up_to_date(bare):
    assert executed(runner.run(root=bare.root, force=True)) == ["01_first"]


def test_other_requirements_are_a_change(bare):
    (bare.root / "requirements.txt").write_text("numpy==1.0\n")
    assert executed(runner.run(root=bare.root)) == ["01_first"]


def test_another_package_is_a_change(good, tmp_path, monkeypatch):
    package = tmp_path / "elsewhere" / "vidsindy_lite"
    shutil.copytree(repository.PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(repository, "PACKAGE", package)
    assert executed(runner.run(root=good.root)) == []
    module = package / "companion" / "artifacts.py"
    module.write_text(module.read_text().replace("DIGITS = 6", "DIGITS = 5"))
    assert executed(runner.run(root=good.root)) == ["01_first"]


@pytest.mark.parametrize(
    ("name", "tamper"),
    [
        ("figures/fig_1.svg", lambda path: path.unlink()),
        ("figures/table_systems.csv", lambda path: path.write_text("x")),
    ],
    ids=["missing", "tampered"],
)
def test_tampered_or_missing_output_is_made_again(good, name, tamper):
    before = files(good.root)
    tamper(good.root / name)
    assert executed(runner.run(root=good.root)) == ["01_first"]
    assert files(good.root)[name] == before[name]


def test_tampered_notebook_or_record_is_made_again(good):
    for name in ("notebooks/01_first.ipynb", "figures/fig_1.json"):
        before = files(good.root)
        path = good.root / name
        path.write_text(path.read_text().replace("A line", "No line"))
        assert files(good.root) != before
        assert executed(runner.run(root=good.root)) == ["01_first"]
        assert files(good.root)[name] == before[name]


def test_clean_clone_executes_everything(bare):
    shutil.rmtree(bare.root / "build")
    assert executed(runner.run(root=bare.root)) == ["01_first"]


def test_profiles_and_folders_have_their_own_ledgers(bare, tmp_path):
    assert executed(runner.run(profile="quick", root=bare.root)) == ["01_first"]
    assert executed(runner.run(profile="quick", root=bare.root)) == []
    assert executed(runner.run(output=tmp_path / "other", root=bare.root)) == ["01_first"]
    assert executed(runner.run(root=bare.root)) == []


def test_longest_notebook_begins_first(bare, capsys):
    bare.write("02_long", "print(2)")
    for name, seconds in {"01_first": 1, "02_long": 100}.items():
        registry.record_run_time(bare.root / "figures", name, "of an earlier run", seconds)
    report = runner.run(root=bare.root, force=True)
    begun = [line.split()[1] for line in capsys.readouterr().out.splitlines() if ": " not in line]
    assert begun == ["02_long", "01_first"]
    assert executed(report) == ["01_first", "02_long"]


@pytest.mark.parametrize(
    "damaged",
    ["", "{", "[]", "3", '{"01_first": 1}', '{"01_first": {}}', '{"01_first": {"seconds": "x"}}'],
)
def test_a_damaged_ledger_or_table_of_times_tells_nothing(good, damaged):
    notebook = good.root / "notebooks" / "01_first.py"
    stamp = runner.notebook_stamp(notebook, "full")
    assert ledger.seconds_if_current(good.root, notebook, stamp) is not None
    assert "01_first" in registry.load_run_times(good.root / "figures")
    for name in (LEDGER, f"figures/{RUN_TIMES}"):
        (good.root / name).write_text(damaged)
    assert ledger.seconds_if_current(good.root, notebook, stamp) is None
    assert registry.load_run_times(good.root / "figures") == {}


def test_a_damaged_ledger_or_table_of_times_is_made_again(bare):
    before = files(bare.root)
    for name in (LEDGER, f"figures/{RUN_TIMES}"):
        (bare.root / name).write_text("{")
    assert executed(runner.run(root=bare.root)) == ["01_first"]
    assert files(bare.root).keys() == before.keys()
    assert executed(runner.run(root=bare.root)) == []


def test_failed_notebook_is_not_up_to_date(bare):
    bare.write("02_bad", "1 / 0")
    for _ in range(2):
        first, second = runner.run(root=bare.root).outcomes
        assert (first.verdict, second.verdict) == ("up to date", "FAILED")


# ----------------------------------------------------------------------------- notebooks that fail


def test_raising_notebook_shows_cell_and_traceback_and_the_next_one_runs(tiny, capsys):
    tiny.write("01_bad", "x = 1", "y = x + 1\nraise ArithmeticError('seen to fail')", "z = 1")
    tiny.write("02_good", "x = 1")
    report = runner.run(root=tiny.root)
    assert not report.ok
    bad, good = report.outcomes
    assert good.error is None
    assert "    y = x + 1\n    raise ArithmeticError('seen to fail')" in bad.error
    assert "ArithmeticError: seen to fail" in bad.error.splitlines()[-1]
    assert bad.error in capsys.readouterr().out
    assert "01_bad" in str(report)
    assert str(report).endswith("1 failed")
    assert [path.name for path in tiny.notebooks.glob("*.ipynb")] == ["02_good.ipynb"]


def test_failing_notebook_leaves_the_executed_half_as_it_was(good):
    before = files(good.root)
    source = good.write("01_first", "raise ArithmeticError")
    assert not runner.run(root=good.root).ok
    changed = files(good.root)
    assert changed.pop("notebooks/01_first.py") == source.read_bytes()
    del before["notebooks/01_first.py"]
    assert changed == before


def test_early_exit_is_a_failure_though_papermill_accepts_it(tiny):
    path = tiny.write(
        "01_exit", "import sys\nsys.exit(0)", "raise ArithmeticError('never reached')"
    )
    with pytest.raises(NotebookError, match=r"01_exit, cell In \[3\](?s:.*)before the end"):
        execute(path, {"profile": "quick"})


def test_dead_kernel_is_a_failure(tiny):
    path = tiny.write("01_dead", "import os\nos._exit(0)")
    with pytest.raises(NotebookError, match="01_dead: .*died"):
        execute(path, {"profile": "quick"})


def test_a_kernel_that_dies_takes_no_other_notebook_along(tiny, capsys):
    tiny.write("01_bad", "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)")
    tiny.write("02_good", PLOT, SAVE)
    report = runner.run(root=tiny.root)
    bad, good = report.outcomes
    assert bad.error == "01_bad: Kernel died"
    assert good.error is None
    assert bad.error in capsys.readouterr().out
    assert report.problems == ()
    assert "fig_1" in (tiny.root / "figures" / INDEX).read_text()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_run_that_is_ended_leaves_no_process_behind(tiny, interruptible, number):
    busy = "[os.getpid(), *(process.pid for process in psutil.Process().children())]"
    tiny.write(
        "01_long",
        "import os, psutil, subprocess, sys, time",
        "subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])",
        f"open('started', 'w').write(' '.join(map(str, {busy})))\ntime.sleep(600)",
    )
    command = [sys.executable, "-m", "vidsindy_lite", "run"]
    here = os.environ | {"PYTHONPATH": str(repository.PACKAGE.parent)}
    run = subprocess.Popen(command, cwd=tiny.notebooks, env=here, start_new_session=True)
    started = tiny.notebooks / "started"
    wait_for(lambda: started.exists() and started.read_text())
    below = psutil.Process(run.pid).children(recursive=True)
    assert {int(pid) for pid in started.read_text().split()} <= {each.pid for each in below}
    run.send_signal(number)
    assert run.wait(60) != 0
    wait_for(lambda: not any(each.is_running() for each in below))


def wait_for(condition):
    """Poll until a condition holds; fail after a minute."""
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)


PAPERMILL = """\
import papermill, sys
papermill.execute_notebook("notebooks/01_first.ipynb", sys.argv[1], {"profile": "quick"})"""


def test_a_notebook_executed_by_others_leaves_the_committed_figures(good):
    before = files(good.root)
    here = os.environ | {"PYTHONPATH": str(repository.PACKAGE.parent)}
    for name in ("VIDSINDY_FIGURES", "VIDSINDY_NOTEBOOK", "VIDSINDY_STAMP"):
        here.pop(name, None)
    command = [sys.executable, "-c", PAPERMILL, "build/out.ipynb"]
    subprocess.run(command, cwd=good.root, env=here, check=True)
    after = files(good.root)
    made = {name for name in after if after[name] != before.get(name)}
    assert made > {"build/interactive/figures/fig_1.png"}
    assert all(name.startswith("build/") for name in made)
    assert after["build/out.ipynb"].count(b"build/interactive/figures;") == 1


def test_kernel_that_dies_at_start_is_a_failure(tiny, tmp_path, monkeypatch):
    monkeypatch.setenv("JUPYTER_PATH", str(tmp_path / "jupyter"))
    kernel = tmp_path / "jupyter" / "kernels" / "python3" / "kernel.json"
    kernel.parent.mkdir(parents=True)
    path = tiny.write("01_first", "x = 1")
    for command in (sys.executable, str(tmp_path / "no_python")):
        kernel.write_text(json.dumps({"argv": [command, "-c", "exit(1)"], "display_name": "x"}))
        message = "01_first: could not be executed: .* If kernel python3 did not"
        with pytest.raises(NotebookError, match=message):
            execute(path, {"profile": "quick"})


def test_kernel_that_is_slow_to_return_is_not_interrupted(tiny, capfd):
    slow = """\
import time

handlers = get_ipython().kernel.shell_handlers
answer = handlers["kernel_info_request"]

async def answer_slowly(*arguments):
    await answer(*arguments)
    time.sleep(1)

handlers["kernel_info_request"] = answer_slowly"""
    execute(tiny.write("01_slow", slow), {"profile": "quick"})
    assert capfd.readouterr().err == ""


def test_endless_cell_is_a_failure(tiny):
    path = tiny.write("01_endless", "while True:\n    pass")
    with pytest.raises(NotebookError, match="01_endless: .*timed out"):
        execute(path, {"profile": "quick"}, timeout=2)


def test_unknown_parameter_is_found_before_anything_runs(tiny):
    path = tiny.write("01_first", "x = 1")
    with pytest.raises(ValueError, match="notebook 01_first has profile .* got 'colour'"):
        execute(path, {"profile": "quick", "colour": "red"})
    bare = tiny.write("02_bare", "x = 1")
    bare.write_text(bare.read_text().replace("profile: str", "size: str"))
    with pytest.raises(ValueError, match="notebook 02_bare has size .* got 'profile'"):
        runner.run(root=tiny.root)
    assert not list(tiny.root.rglob("*.ipynb"))


def test_stray_figure_fails_the_run(tiny):
    (tiny.root / "figures").mkdir()
    (tiny.root / "figures" / "old.png").write_bytes(b"")
    report = runner.run(root=tiny.root)
    assert report.problems == ("old.png: nothing registers it",)
    assert not report.ok


# ------------------------------------------------------------------------------- which notebooks


@pytest.mark.parametrize(
    ("names", "chosen"),
    [
        ([], ["01_first", "02_second", "02_twin"]),
        (["01"], ["01_first"]),
        (["02_second", "01_first"], ["01_first", "02_second"]),
        (["02"], ["02_second", "02_twin"]),
        (["notebooks/02_twin.ipynb", "elsewhere/01_first.py"], ["01_first", "02_twin"]),
    ],
)
def test_names_of_notebooks(tiny, names, chosen):
    for name in ("01_first", "02_second", "02_twin"):
        tiny.write(name)
    assert [path.stem for path in runner.select_notebooks(names, tiny.root)] == chosen


@pytest.mark.parametrize("name", ["03", "first", "01_f", "1", ""])
def test_unknown_notebook(tiny, name):
    tiny.write("01_first")
    with pytest.raises(ValueError, match=f"notebook: expected one of 01_first, .* got '{name}'"):
        runner.select_notebooks([name], tiny.root)


def test_unknown_profile(tiny):
    with pytest.raises(ValueError, match="profile: expected one of full, quick, got 'small'"):
        runner.run(profile="small", root=tiny.root)


def test_quick_run_cannot_overwrite_the_repository(tiny):
    with pytest.raises(ValueError, match="output: the quick profile"):
        runner.run(profile="quick", output=tiny.root, root=tiny.root)


# ------------------------------------------------------------------------------------ the stamp


def test_stamp_follows_code_profile_and_requirements(tiny):
    path = tiny.write("01_first", "x = 1")
    stamps = [runner.notebook_stamp(path, "full"), runner.notebook_stamp(path, "quick")]
    tiny.write("01_first", "x = 2")
    stamps.append(runner.notebook_stamp(path, "full"))
    (tiny.root / "requirements.txt").write_text("numpy==1.0\n")
    stamps.append(runner.notebook_stamp(path, "full"))
    assert len(set(stamps)) == 4


def test_stamp_does_not_follow_the_prose_of_a_notebook(tiny):
    path = tiny.write("01_first", "x = 1")
    before = runner.notebook_stamp(path, "full")
    path.write_text(path.read_text().replace("A tiny notebook", "A small notebook"))
    assert runner.notebook_stamp(path, "full") == before


# ----------------------------------------------------------------------------- the command line


def test_command_line_exit_status(tiny, monkeypatch, capsys):
    tiny.write("01_good", "print(profile)")
    tiny.write("02_bad", "1 / 0")
    monkeypatch.chdir(tiny.notebooks)
    assert main(["run", "01", "--output", str(tiny.root / "elsewhere")]) == 0
    executed = nbformat.read(tiny.root / "elsewhere" / "notebooks" / "01_good.ipynb", as_version=4)
    assert executed.cells[-1].outputs[0].text == "full\n"
    assert main(["run", "02", "--profile", "quick"]) == 1
    assert "ZeroDivisionError" in capsys.readouterr().out
    assert main(["run", "03"]) == 2
    assert "expected one of 01_good, 02_bad" in capsys.readouterr().err


def test_command_line_outside_a_repository(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run"]) == 2
    assert "repository: expected to be inside a clone" in capsys.readouterr().err


def test_demo_goes_from_videos_to_the_law(capsys):
    assert main(["demo", "--system", "SprottE", "--frames", "200"]) == 0
    assert "against the truth: all true terms found, 0 false" in capsys.readouterr().out


def test_demo_that_cannot_work_says_why(capsys):
    assert main(["demo", "--frames", "10"]) == 2
    assert "x: must hold at least as many samples as unknowns" in capsys.readouterr().err


def test_help_has_examples():
    command = [sys.executable, "-m", "vidsindy_lite", "run", "--help"]
    root = repository.PACKAGE.parent
    shown = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True).stdout
    assert "python -m vidsindy_lite run 03" in shown
    assert "--profile {full,quick}" in shown
