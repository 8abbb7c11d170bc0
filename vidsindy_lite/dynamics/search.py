"""Fits of a discovery, their history, and the search for the terms of a law in one frame."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from ..arrays import Floats
from .collocation import Collocation, Linearisation, State, Status
from .problem import Problem
from .selection import subset_search

LONGEST_SEARCH = 10
"""Most rounds of a subset search."""


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
    """The steps of a discovery so far, in the order of time."""

    steps: list[Step] = field(default_factory=list)
    began: float = field(default_factory=time.perf_counter)

    def add(self, stage: str, problem: Problem, fit: Fit, weight: float) -> None:
        """Add what a fit at a relative physics weight has reached."""
        state, collocation = fit.state, fit.collocation
        data = collocation.data_loss(state.control_points)
        self.steps.append(
            Step(
                stage=stage,
                seconds=time.perf_counter() - self.began,
                physics_weight=weight,
                data_loss=data / collocation.grid.x.size,
                physics_loss=float((collocation.physics_residual(state) ** 2).mean()),
                terms=int(state.active.sum()),
                offset=problem.units.point(state.offset),
            )
        )


@dataclass(frozen=True)
class Fit:
    """A state, on the data and knots to which it was fitted.

    Parameters
    ----------
    state : State
    collocation : Collocation
        With the weights of the last fit.
    status : Status
        How the last fit ended.
    criterion : float
        Objective and penalties, where the fit compares laws; else NaN.
    """

    state: State
    collocation: Collocation
    status: Status
    criterion: float = np.nan


def fitted(
    collocation: Collocation, state: State, tolerance: float = 1e-2, max_steps: int = 30
) -> Fit:
    """`Collocation.solve` with the problem kept beside its solution."""
    solution = collocation.solve(state, tolerance, max_steps)
    return Fit(solution.state, collocation, solution.status)


def select(
    problem: Problem,
    collocation: Collocation,
    state: State,
    weight: float,
    stage: str,
    history: History,
) -> Fit:
    """Alternate between the subset search and Gauss-Newton until the criterion stops falling.

    The search runs over all terms, active or not, on the quadratic model with the curve
    eliminated; its proposal is kept only if the true criterion falls after a refit.
    """
    weighted = problem.weighted(collocation, weight)
    best = _priced(problem, fitted(weighted, state, tolerance=0.1))
    history.add(stage, problem, best, weight)
    size = problem.exponents.size
    prices = np.append(np.tile(problem.penalties, problem.d), np.full(problem.d, -np.inf))
    for _ in range(LONGEST_SEARCH):
        state = best.state
        columns = np.concatenate([np.arange(size), size + np.flatnonzero(state.moving)])
        model = weighted.linearise(state, columns)
        support, solution, _ = subset_search(
            model.information, model.gradient, state.flat()[columns], prices[columns],
            state.free()[columns],
        )  # fmt: skip
        if (support == state.free()[columns]).all():
            break
        proposal = _proposed(state, model, solution)
        trial = _priced(problem, fitted(weighted, proposal, tolerance=0.1))
        if not trial.criterion < best.criterion - 1e-6:
            break
        best = trial
        history.add(stage, problem, best, weight)
    return best


def _priced(problem: Problem, fit: Fit) -> Fit:
    criterion = problem.criterion(fit.collocation, fit.state)
    return Fit(fit.state, fit.collocation, fit.status, criterion)


def _proposed(state: State, model: Linearisation, solution: Floats) -> State:
    """The state that the quadratic model promises for a solution of the subset search."""
    flat = state.flat()
    step = solution - flat[model.columns]
    flat[model.columns] = solution
    control = state.control_points + model.curve_step + model.curve_response @ step
    moved = state.moved(control, flat)
    return State(control, moved.coefficients, moved.coefficients != 0, moved.offset, state.moving)
