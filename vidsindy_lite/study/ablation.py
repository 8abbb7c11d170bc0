"""The solver, taken apart: what is lost without each of its mechanisms.

A task is a contest and a mechanism; while the contest runs, what does the work of the mechanism is
replaced by what does nothing. So the solver itself needs no switches::

    table = ablation_table(sweep(run_ablation, ablations(contests)))
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

from ..checks import check_choice
from ..dynamics import noise, path, solver
from .scoreboard import Contest, Outcome, run_contest

if TYPE_CHECKING:  # pandas is imported where a frame is made
    from pandas import DataFrame

NOTHING = "nothing"
"""The solver as it is."""


def _first_law_alone(problem: Any, fit: Any, history: Any, free: bool = True) -> Any:
    fit = path.polish(problem, fit, history)
    return fit, path.follow(problem, fit), True


def _same(problem: Any, *_: Any) -> Any:
    return problem


def _own(problem: Any, fit: Any, *_: Any) -> Any:
    return fit


WITHOUT: dict[str, tuple[tuple[Any, str, Any], ...]] = {
    NOTHING: (),
    "support path": ((solver, "persistent", _first_law_alone),),
    "first tolerance": ((path, "TOLERATED", 0.0), (solver, "TOLERATED", 0.0)),
    "floor for smooth errors": ((path, "SMOOTH", 0.0),),
    "integrated autocorrelation time": ((noise, "effective_noise", noise.residual_noise),
                                        (path, "effective_noise", noise.residual_noise)),
    "errors of the times": ((path, "time_inflation", lambda fit: 1.0),),
    "weights from the smoother": ((path, "smoother_weights", _same),),
    "noise told by all terms": ((solver, "views", lambda pose: [path.smoother_weights(pose())]),),
    "process noise": ((solver, "with_process_noise", _same),),
    "free offset": ((path, "framed", _own),),
    "offset freed at the end": ((path, "off_home", lambda problem, state, *_: state),),
    "richer laws": ((path, "deepest", lambda problem, around, history: around),),
}  # fmt: skip
"""Of each mechanism, what takes the place of what."""


@dataclass(frozen=True)
class Ablation:
    """A contest without a mechanism.

    Parameters
    ----------
    contest : OdeContest, LorenzContest or FlowContest
        Of whose methods ours alone is asked.
    without : str
        One of `WITHOUT`.
    """

    contest: Contest
    without: str = NOTHING

    def __post_init__(self) -> None:
        check_choice("without", self.without, WITHOUT)


def ablations(contests: Iterable[Contest]) -> Iterator[Ablation]:
    """Every contest without every mechanism, and with all of them."""
    return (Ablation(contest, without) for contest, without in product(contests, WITHOUT))


def run_ablation(task: Ablation) -> tuple[str, Outcome]:
    """Let the solver find the law of a contest without a mechanism.

    Returns
    -------
    without : str
    outcome : Outcome
    """
    with ExitStack() as replaced:
        for module, name, other in WITHOUT[task.without]:
            replaced.enter_context(patch.object(module, name, other))
        (outcome,) = run_contest(task.contest)
    return task.without, outcome


def ablation_table(results: Iterable[tuple[str, Outcome]]) -> DataFrame:
    """Results as a frame, one row a mechanism that is off.

    Parameters
    ----------
    results : iterable of (str, Outcome)
        As a sweep of `run_ablation` gives them.

    Returns
    -------
    DataFrame
        Columns: cases, exact, lost (exact with it and not without), gained (the other way round),
        "wrong, ok", and seconds of processor time together.
    """
    import pandas

    found: dict[str, dict[Contest, Outcome]] = {}
    for without, outcome in results:
        found.setdefault(without, {})[outcome.contest] = outcome
    whole = found[NOTHING]
    rows = []
    for without, outcomes in found.items():
        pairs = [(one.exact, whole[contest].exact) for contest, one in outcomes.items()]
        rows.append(
            {
                "without": without,
                "cases": len(pairs),
                "exact": sum(exact for exact, _ in pairs),
                "lost": pairs.count((False, True)),
                "gained": pairs.count((True, False)),
                "wrong, ok": sum(not o.exact and o.status == "ok" for o in outcomes.values()),
                "seconds": sum(one.seconds for one in outcomes.values()),
            }
        )
    return pandas.DataFrame(rows).set_index("without")
