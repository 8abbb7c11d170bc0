"""What all tests share: settings and fixtures."""

import os
import signal
from collections import Counter
from functools import cache
from pathlib import Path

# Before numpy is imported: results then do not depend on the number of cores.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# Tests run side by side, one on each core.
os.environ.setdefault("OPENCV_FOR_THREADS_NUM", "1")
# Of the processes that tests start: the order of a set is then the same in every run.
os.environ.setdefault("PYTHONHASHSEED", "0")
# A second less for each that reads notebooks, see `disturbed/sitecustomize.py`.
os.environ["PYTHONPATH"] = os.pathsep.join(
    [str(Path(__file__).parent / "disturbed"), *filter(None, [os.environ.get("PYTHONPATH")])]
)

import disturbed.sitecustomize  # noqa: F401
import pytest
from helpers import TinyRepository
from hypothesis import settings
from xdist.scheduler import LoadScopeScheduling

from vidsindy_lite import vision

# The same examples in every run, so that a red test stays red; no deadline on a busy machine.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


def pytest_collection_modifyitems(items):
    """Begin with what takes longest, so that no worker ends with one alone: last, short files."""
    slow = Counter(item.path for item in items if item.get_closest_marker("slow"))
    items.sort(
        key=lambda item: (
            not item.get_closest_marker("notebooks"), -slow[item.path], -item.path.stat().st_size
        )
    )  # fmt: skip


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    return Spread(config, log)


class Spread(LoadScopeScheduling):
    """A file of tests goes to one worker, where what they share is made once; notebooks to any."""

    def _split_scope(self, nodeid):
        alone = ("::test_quick_run[", "::test_solutions_are_right[")
        return nodeid if any(name in nodeid for name in alone) else nodeid.partition("::")[0]


@pytest.fixture(scope="module")
def tracked_once():
    """Tracks each video file once, however many tests of a module discover from it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vision, "track", cache(vision.track))
        yield


@pytest.fixture(scope="session")
def shared_cache(tmp_path_factory):
    """Where notebooks keep the results of sweeps: what one computes, no worker computes again."""
    folder = tmp_path_factory.getbasetemp()
    return (folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "cache"


@pytest.fixture
def interruptible():
    """Commands that a test starts heed Ctrl+C; those of a shell's background job do not."""
    earlier = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, earlier)


@pytest.fixture
def tiny(tmp_path) -> TinyRepository:
    """An empty `TinyRepository`."""
    return TinyRepository(tmp_path)
