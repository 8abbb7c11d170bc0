"""The law that is settled on: that of the widest plateaus of the path of laws around it.

A path (`persistence`) tells the laws around a fit from its quadratic model. The one that persists
is fitted itself, and the path followed around it, until it leads nowhere else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .collocation import Fit, Status
from .history import History
from .library import closure_mask
from .persistence import Path, Plateau, follow, typical
from .problem import Problem
from .search import CONSISTENT, FINAL_WEIGHT, leave_home, tightened

EXACT = 1e-4
"""Tolerance of the last fits: a hundredth of a standard error, squared."""
RICHEST = 2.0
"""Most terms of a law that refines another, over the terms of that."""
LONGEST_DESCENT = 3
"""Most laws at smaller errors."""
MOST_PATHS = 4
"""Most paths that are followed, each around the law to which the one before led."""
MOST_PLATEAUS = 4
"""Most choices of plateaus that are fitted until one leaves no more than it tolerates."""


def settle(problem: Problem, fit: Fit, history: History) -> tuple[Fit, Path]:
    """The law that has the widest plateau of each equation on the path around it, and that path.

    Where paths lead round in a circle, the law to which the last of them led; that path is then
    around the law before.
    """
    for _ in range(MOST_PATHS):
        start = fit
        fit, path = _persistent(problem, start, history)
        if fit is start:
            break
    return fit, path


def persists(fit: Fit, path: Path) -> bool:
    """Whether a law has converged, and has the widest plateau of each equation on a path."""
    widest = [plateau for plateau, *_ in path.ranked()]
    return fit.status is Status.CONVERGED and not _changed(fit, widest)


def _persistent(problem: Problem, fit: Fit, history: History) -> tuple[Fit, Path]:
    """The law with the widest plateau of each equation around a fit, and the path that tells.

    The richer laws below the errors that a law leaves are fitted first, and the path followed from
    the last of them: a missing term leaves smooth errors, too, and only its own law tells.
    """
    deepest, path = fit, follow(problem, fit)
    for _ in range(LONGEST_DESCENT):
        lowest = [plateaus[0] for plateaus in path.plateaus]
        trial = _refitted(problem, path, lowest, history)
        if trial is None or trial.status is not Status.CONVERGED:
            break  # around what has not converged nothing is told
        if not _leaves(problem, trial, path.lowest):
            break
        deepest, path = trial, follow(problem, trial)
    ranked = path.ranked()
    for _ in range(MOST_PLATEAUS):
        best = [widest for widest, *_ in ranked]
        for known in (fit, deepest):
            if not _changed(known, best):
                return known, path
        found = _refitted(problem, path, best, history)
        largest = max(_changed(path.fit, best), key=lambda plateau: plateau.low)
        if found and _leaves(problem, found, max(path.own, largest.low)):
            return found, path
        ranked[largest.equation].remove(largest)  # it leaves more than it was said to
        if not ranked[largest.equation]:
            break
    return fit, path


def _refitted(
    problem: Problem, path: Path, goal: Sequence[Plateau], history: History
) -> Fit | None:
    """The law of these plateaus; none if it is that of the path, too rich, or has a pole there."""
    if not _changed(path.fit, goal):
        return None
    active = path.fit.state.whole(np.stack([plateau.terms for plateau in goal], axis=1))
    if active.sum() > RICHEST * path.fit.state.active.sum():
        return None
    fit = tightened(problem, path.fit.collocation, path.restricted(active))
    fit = at_own_noise(problem, fit.collocation.solve(fit.state, EXACT))
    priced = replace(fit, criterion=problem.criterion(fit.collocation, fit.state))
    # Terms that come in may be those of a shift, and worth their price at these errors alone; no
    # others, since those of the path are the ones that are no errors.
    shifts = closure_mask(problem.exponents, active, problem.form.movable)
    shifted = replace(problem, form=replace(problem.form, candidates=shifts))
    fit = at_own_noise(problem, leave_home(shifted, priced, history))
    history.add("another law of the path", problem, fit, FINAL_WEIGHT)
    return fit if np.isfinite(fit.collocation.objective(fit.state)) else None


def _leaves(problem: Problem, fit: Fit, tolerated: float) -> bool:
    """Whether a law leaves no larger errors than were tolerated when it was chosen."""
    return typical(problem.errors(fit)) <= CONSISTENT * tolerated


def _changed(fit: Fit, goal: Sequence[Plateau]) -> list[Plateau]:
    """The plateaus whose terms are not those of a fit."""
    return [p for p in goal if (p.terms != fit.state.active[:, p.equation]).any()]


def at_own_noise(problem: Problem, fit: Fit) -> Fit:
    """The same fit, weighted with the errors that it leaves."""
    collocation = fit.collocation
    weighted = collocation.weighted(problem.errors(fit) ** -2, collocation.physics_weights)
    own = weighted.solve(fit.state, EXACT)
    if own.status is Status.CONVERGED:
        return own
    looser = tightened(problem, weighted, own.state)
    again = looser.collocation.solve(looser.state, EXACT)
    return again if again.status is Status.CONVERGED else own
