"""The solver taken apart: what is replaced is there, and comes back; the table counts."""

from dataclasses import replace

import pytest

from vidsindy_lite.dynamics import path
from vidsindy_lite.study import LorenzContest
from vidsindy_lite.study import ablation as apart
from vidsindy_lite.study.ablation import NOTHING, WITHOUT, Ablation, ablation_table, ablations
from vidsindy_lite.study.scoreboard import Outcome

CONTESTS = [LorenzContest(2.0, 0.01), LorenzContest(3.0, 0.01)]


@pytest.mark.parametrize("without", WITHOUT)
def test_what_is_replaced_is_there_and_comes_back(monkeypatch, without):
    before = [getattr(module, name) for module, name, _ in WITHOUT[without]]
    seen = []

    def contest_run(contest):
        seen.extend(getattr(module, name) for module, name, _ in WITHOUT[without])
        return (contest,)

    monkeypatch.setattr(apart, "run_contest", contest_run)
    assert apart.run_ablation(Ablation(CONTESTS[0], without)) == (without, CONTESTS[0])
    assert seen == [other for *_, other in WITHOUT[without]]
    assert [getattr(module, name) for module, name, _ in WITHOUT[without]] == before


def test_every_contest_meets_every_mechanism():
    tasks = list(ablations(CONTESTS))
    assert len(tasks) == len(set(tasks)) == 2 * len(WITHOUT)
    with pytest.raises(ValueError, match="without: must be"):
        replace(tasks[0], without="luck")


def test_the_table_counts_what_is_lost_and_gained():
    def outcome(contest, exact, status):
        return Outcome(contest, "ours", None, exact, status, 2.0)

    table = ablation_table(
        [
            (NOTHING, outcome(CONTESTS[0], True, "ok")),
            (NOTHING, outcome(CONTESTS[1], False, "suspect")),
            ("support path", outcome(CONTESTS[0], False, "ok")),
            ("support path", outcome(CONTESTS[1], True, "ok")),
        ]
    )
    assert table.loc[NOTHING].tolist() == [2, 1, 0, 0, 0, 4.0]
    assert table.loc["support path"].tolist() == [2, 1, 1, 1, 1, 4.0]


@pytest.mark.slow
def test_without_the_first_law_at_a_large_error_a_law_is_found_all_the_same():
    _, outcome = apart.run_ablation(Ablation(LorenzContest(10.0, 0.05), "first tolerance"))
    assert path.TOLERATED > 0
    assert outcome.exact
