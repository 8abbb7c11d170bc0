"""How a discovery went: the steps of its fits, in the order of time."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from tqdm import tqdm

from ..arrays import Floats
from .collocation import Fit
from .problem import Problem


@dataclass(frozen=True)
class Step:
    """One line of the history of a discovery.

    Parameters
    ----------
    stage : str
        What was done.
    seconds : float
        Time since the start.
    physics_weight : float
        Relative weight of the physics loss.
    data_loss : float
        Mean square residual of the data over the noise variance.
    physics_loss : float
        Mean square residual of the law in standard units.
    terms : int
        Number of active terms.
    offset : ndarray, shape (d,)
        Origin of the law in the data's frame.
    """

    stage: str
    seconds: float
    physics_weight: float
    data_loss: float
    physics_loss: float
    terms: int
    offset: Floats


@dataclass(frozen=True)
class History:
    """The steps of a discovery so far, in the order of time, and how much of it is left.

    Parameters
    ----------
    steps : list of Step
    began : float
        On the clock of `time.perf_counter`.
    end : float
        When no further round begins, on that clock.
    bar : tqdm, optional
        Moves with every round.
    """

    steps: list[Step] = field(default_factory=list)
    began: float = field(default_factory=time.perf_counter)
    end: float = np.inf
    bar: tqdm | None = None

    @property
    def over(self) -> bool:
        """Whether there is no time left."""
        return time.perf_counter() > self.end

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be told if the time was not enough."""
        told = "the time limit ended the search: this is the best law so far; raise time_limit"
        return (told,) if self.over else ()

    def another(self) -> bool:
        """Count a round, and say whether there is time for another."""
        if self.bar is not None:
            self.bar.update()
        return not self.over

    def add(self, stage: str, problem: Problem, fit: Fit, weight: float) -> None:
        """Add what a fit at a relative physics weight has reached."""
        state, collocation = fit.state, fit.collocation
        data = collocation.data_loss(collocation.curve(state.control_points))
        self.steps.append(
            Step(
                stage=stage,
                seconds=time.perf_counter() - self.began,
                physics_weight=weight,
                data_loss=data / collocation.counts.sum(),
                physics_loss=float((collocation.physics_residual(state) ** 2).mean()),
                terms=int(state.active.sum()),
                offset=problem.units.point(state.offset),
            )
        )
