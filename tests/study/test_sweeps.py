"""Sweeps in small clones of the repository: killed, edited, damaged, on a cluster."""

import hashlib
import json
import math
import os
import signal
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest
from helpers import full_disk, wait_for

from vidsindy_lite.storage import PACKAGE
from vidsindy_lite.study.sweeps import remember, sweep
from vidsindy_lite.vision import Scene, video_info

# A module of the package, with a function that takes notes of its calls.
TOY = '''\
import os
import time
from dataclasses import dataclass

import cv2
import numpy as np
from threadpoolctl import threadpool_info

from .powers import square as power


@dataclass(frozen=True)
class Task:
    number: int
    pause: float = 0.0


def square(task):
    """A result with random numbers, from the task alone."""
    with open(os.environ["CALLS"], "a") as calls:
        calls.write(f"{task.number}\\n")
    with open(os.environ["THREADS"], "a") as threads:
        threads.write(f"{cv2.getNumThreads()} ")
        threads.writelines(f"{pool['num_threads']} " for pool in threadpool_info())
    time.sleep(task.pause)
    if task.number < 0:
        raise ArithmeticError("below zero")
    # a comment
    return power(task.number), np.random.default_rng(task.number).normal(size=3).tolist()
'''
SWEEP = """\
import json
import sys

from vidsindy_lite import toy
from vidsindy_lite.study.sweeps import sweep

if __name__ == "__main__":
    tasks = [toy.Task(*task) for task in json.loads(sys.argv[1])]
    print(json.dumps(sweep(toy.square, tasks, desc="toy", jobs=int(sys.argv[2]))))
"""


class Clone:
    """A repository whose package holds the sweeps and the module above."""

    def __init__(self, root):
        self.root, self.calls = root, root / "calls.txt"
        self.package = root / "vidsindy_lite"
        (root / "notebooks").mkdir()
        for room in ("study", "companion"):
            (self.package / room).mkdir(parents=True)
        (root / "sweep.py").write_text(SWEEP)
        files = {"CALLS": str(self.calls), "THREADS": str(root / "threads.txt")}
        self.environment = os.environ | {"PYTHONPATH": str(root)} | files
        for front_door in (self.package, self.package / "study"):
            (front_door / "__init__.py").touch()
        (self.package / "toy.py").write_text(TOY)
        (self.package / "powers.py").write_text("def square(number):\n    return number**2\n")
        (self.package / "companion" / "pages.py").write_text("LINE_WIDTH = 1\n")
        for module in ("arrays.py", "checks.py", "storage.py", "values.py", "study/sweeps.py"):
            (self.package / module).write_bytes((PACKAGE / module).read_bytes())

    def edit(self, module, old, new):
        path = self.package / module
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))

    def start(self, tasks, jobs=2, **environment):
        """A process that sweeps over tasks, each a list of a number and a pause in seconds."""
        self.calls.write_text("")
        return subprocess.Popen(
            [sys.executable, str(self.root / "sweep.py"), json.dumps(tasks), str(jobs)],
            env=self.environment | environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, start_new_session=True,
        )  # fmt: skip

    def sweep(self, tasks, status=0, **environment):
        """Results of a sweep to its end, or what it raises."""
        process = self.start(tasks, **environment)
        output, errors = process.communicate(timeout=120)
        assert process.returncode == status, errors
        raised = [line for line in errors.splitlines() if "Error: " in line]
        return raised[-1] if status else json.loads(output)

    def called(self):
        """Numbers of the tasks that were computed since the last start."""
        return sorted(int(line) for line in self.calls.read_text().split())

    def stored(self):
        """Files of results, by the number of the task."""
        files = list((self.root / "build" / "cache").glob("*/toy.square/*.json"))
        return {math.isqrt(content(file)[0]): file for file in files}


@pytest.fixture
def clone(tmp_path, monkeypatch):
    for name in ("VIDSINDY_CACHE", "VIDSINDY_DASK"):
        monkeypatch.delenv(name, raising=False)
    root = tmp_path / "clone"
    root.mkdir()
    return Clone(root)


def content(file):
    """The result that a file holds, as plain values."""
    return json.loads(file.read_text().splitlines()[1])["result"]


def results_of(tasks):
    """What a sweep over tasks gives."""
    return [[n**2, np.random.default_rng(n).normal(size=3).tolist()] for n, _ in tasks]


@pytest.mark.slow
def test_killed_half_way_two_at_once_share_the_rest(clone):
    tasks = [[number, 0.3] for number in range(8)]
    process = clone.start(tasks)
    wait_for(lambda: len(clone.stored()) >= 3)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    done = set(clone.stored())
    assert 3 <= len(done) < 8
    threads = {"OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2"}
    together = [clone.start(tasks, **threads), clone.start(tasks[::-1], **threads)]
    first, second = (json.loads(one.communicate(timeout=120)[0]) for one in together)
    assert first == second[::-1] == results_of(tasks)
    assert set(clone.called()) == set(range(8)) - done
    assert len(clone.called()) == 8 - len(done)
    assert set((clone.root / "threads.txt").read_text().split()) == {"1"}  # in each process


DAMAGES = [
    lambda content: b"",
    lambda content: content[: len(content) // 2],
    lambda content: content[:80] + bytes([content[80] ^ 1]) + content[81:],
    lambda content: b"\x80\x04K\x00.",  # a pickle
]


@pytest.mark.slow
def test_what_is_stored_is_found_unless_it_is_damaged_or_of_other_code(clone):
    tasks = [[number, 0.0] for number in range(1, 6)]
    assert clone.sweep(tasks, jobs=1) == results_of(tasks)
    assert clone.called() == [1, 2, 3, 4, 5]
    stored = clone.stored()
    whole = {number: file.read_bytes() for number, file in stored.items()}
    for number, damage in enumerate(DAMAGES, start=2):  # of the first task nothing is damaged
        stored[number].write_bytes(damage(whole[number]))
    clone.edit("toy.py", "# a comment", "# another")
    clone.edit("companion/pages.py", "1", "2")
    assert clone.sweep(tasks, jobs=1) == results_of(tasks)
    assert clone.called() == [2, 3, 4, 5]
    assert {number: file.read_bytes() for number, file in stored.items()} == whole
    clone.edit("powers.py", "number**2", "number * number")
    for _ in range(2):
        assert clone.sweep(tasks, jobs=1) == results_of(tasks)
        assert clone.called() == [1, 2, 3, 4, 5]
        os.utime(clone.package / "powers.py", (2e9, 2e9))  # edited since it was read


@pytest.mark.parametrize(
    "result",
    [
        '{"type": "os:system", "command": "touch planted"}',
        '{"type": "vidsindy_lite.study.sweeps:sweep", "function": 1}',
        '{"type": "array", "dtype": "i", "values": [1' + "0" * 40 + "]}",
        "[" * 100_000 + "]" * 100_000,
    ],
    ids=range(4),
)
def test_a_planted_file_is_read_and_never_executed(cache, monkeypatch, result):
    monkeypatch.chdir(cache)
    assert remember(squared, Holder(3)) == 9
    (file,) = cache.rglob("*.json")
    content = '{"task": ' + json.dumps(repr(Holder(3))) + ', "result": ' + result + "}"
    file.write_text(f"{hashlib.sha256(content.encode()).hexdigest()}\n{content}\n")
    with pytest.warns(UserWarning, match="computed again, as .* does not hold its result"):
        assert remember(squared, Holder(3)) == 9
    assert remember(squared, Holder(3)) == 9
    assert not (cache / "planted").exists()


CLUSTER = """\
import sys
import time

from distributed import LocalCluster

if __name__ == "__main__":
    with LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()
"""


@pytest.fixture
def cluster(clone):
    """Address of a Dask scheduler with two worker processes that have the clone's package."""
    (clone.root / "cluster.py").write_text(CLUSTER)
    process = subprocess.Popen(
        [sys.executable, str(clone.root / "cluster.py")],
        env=clone.environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    yield process.stdout.readline().strip()
    process.communicate(timeout=60)


@pytest.mark.slow
def test_a_cluster_gives_the_same_results_and_only_with_the_same_code(clone, cluster):
    tasks = [[3, 0.5], [1, 0.0], [2, 0.0]]
    assert clone.sweep(tasks, VIDSINDY_DASK=cluster) == results_of(tasks)
    assert clone.called() == [1, 2, 3]
    assert set(clone.stored()) == {1, 2, 3}
    error = clone.sweep([[5, 0.0], [-3, 1.0]], 1, VIDSINDY_DASK=cluster)
    assert error.endswith("square(Task(number=-3, pause=1.0)) raised ArithmeticError: below zero")
    assert 5 in clone.stored()
    clone.edit("powers.py", "number**2", "number * number")
    error = clone.sweep([[1, 0.0]], 1, VIDSINDY_DASK=cluster)
    assert "all workers must have this very code of vidsindy_lite, got other code on tcp" in error
    assert clone.called() == []


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("VIDSINDY_CACHE", str(tmp_path))
    return tmp_path


def test_without_distributed_the_error_names_the_extra(cache, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)  # as if it were not installed
    with pytest.raises(ImportError, match=r'pip install "vidsindy_lite\[cluster\]"'):
        sweep(video_info, [Scene()], dask="tcp://127.0.0.1:1")


@dataclass
class Changeable:
    number: int = 1


@dataclass(frozen=True)
class Holder:
    values: object


@pytest.mark.parametrize(
    ("function", "task", "jobs", "message"),
    [
        *[(f, Scene(), 1, "function: must be a top-level function of vidsindy_lite")
          for f in (lambda task: task, Scene.random, wait_for, len)],
        *[(video_info, task, 1, "tasks: each must be a frozen dataclass .* got ")
          for task in (1, Scene, Changeable(), Holder(np.ones(3)), Holder([1]))],
        *[(video_info, Scene(), jobs, f"jobs: must be an integer of at least 1, got {jobs!r}")
          for jobs in (0, "2")],
    ],
)  # fmt: skip
def test_what_no_sweep_can_do_is_refused(cache, function, task, jobs, message):
    with pytest.raises(ValueError, match=message):
        sweep(function, [Scene(), task], jobs=jobs)


def test_one_task_is_remembered_by_whoever_asks_next(cache):
    calls = []

    def double(task):
        calls.append(task)
        return 2 * task.values

    double.__module__, double.__qualname__ = "vidsindy_lite.toy", "double"
    assert remember(double, Holder(3)) == 6
    assert remember(double, Holder(3)) == 6
    assert sweep(double, [Holder(3), Holder(4)], jobs=1) == [6, 8]
    assert remember(double, Holder(4)) == 8
    assert calls == [Holder(3), Holder(4)]


def test_a_full_disk_costs_the_storing_not_the_result(cache, monkeypatch):
    monkeypatch.setattr("vidsindy_lite.study.sweeps.write_file", full_disk)
    with pytest.warns(UserWarning, match="a result is not stored: .*No space left"):
        assert remember(squared, Holder(3)) == 9


def squared(task):
    return task.values**2


squared.__module__ = "vidsindy_lite.toy"
