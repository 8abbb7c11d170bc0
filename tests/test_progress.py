"""Progress bars: as they are asked for, else where a person watches work that takes a while."""

import io
import sys
from types import SimpleNamespace

import pytest

from vidsindy_lite import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("where", "modules", "process", "expected"),
    [
        (Terminal(), {}, "MainProcess", True),
        (io.StringIO(), {}, "MainProcess", False),
        (io.StringIO(), {"ipykernel": None}, "MainProcess", True),
        (Terminal(), {}, "LokyProcess-1", False),
    ],
    ids=["terminal", "file", "notebook", "worker"],
)
def test_who_watches(monkeypatch, where, modules, process, expected):
    monkeypatch.setattr(sys, "stderr", where)
    monkeypatch.setattr(sys, "modules", modules)
    monkeypatch.setattr(progress, "current_process", lambda: SimpleNamespace(name=process))
    assert progress.watched() == expected


@pytest.mark.parametrize("seen", [True, False])
def test_a_bar_is_shown_as_asked_else_after_two_seconds_to_who_watches(monkeypatch, seen):
    monkeypatch.setattr(progress, "watched", lambda: seen)
    terminal = Terminal()
    for asked, expected in ((True, True), (False, False), (None, False)):  # it takes no time at all
        terminal.truncate(0)
        for _ in progress.bar(asked, "work", iterable=range(9), file=terminal):
            pass
        assert ("work" in terminal.getvalue()) == expected
    assert progress.bar(None, "work").disable != seen
    assert not seen or progress.bar(None, "work", file=terminal).delay == 2
