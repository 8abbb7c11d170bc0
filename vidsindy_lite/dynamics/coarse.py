"""Noise of data with few samples a turn, told by candidate terms together.

A curve without a law has as much freedom as there are samples a turn. Where these are few, it takes
motion for noise, or gives the motion up and is flat. So terms are fitted at once, as many as
converge, and what they leave is the noise; each of the two noises has its law.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .collocation import Fit
from .errors import residual_noise
from .history import History
from .path import CONSISTENT, FIRST_WEIGHTS, TOLERATED, unpruned
from .precision import foreseen
from .problem import COARSE, Problem, fit_curves

FLAT = 0.9
"""Errors, relative to the spread of the data, of a curve that has given the motion up."""


def views(pose: Callable[..., Problem]) -> list[Problem]:
    """A problem with the noise that its curves leave, and, if far less, with what terms leave.

    Parameters
    ----------
    pose : callable
        Poses the problem: with smoothed curves, or, if ``True`` is passed, with curves through
        the samples, which serve where smoothed ones leave out a part of the motion.
    """
    problem = foreseen(pose())
    # A curve that has given up has no turns.
    enough = problem.samples_a_turn > COARSE and problem.noise.max() < FLAT
    if enough or problem.measured_errors or (problem.noise <= TOLERATED).all():
        return [problem]
    told = _by_terms(problem) or _by_terms(pose(True))
    return [problem] if told is None else [problem, told]


def _by_terms(problem: Problem) -> Problem | None:
    """The problem with the noise that terms leave, as many as converge, if it is far less."""
    collocation = problem.collocation(problem.segments())
    control = fit_curves(collocation, problem.curves)
    degrees = problem.exponents.sum(axis=1)
    for degree in range(problem.form.degree, 0, -1):
        rows = ~problem.form.implicit & (degrees <= degree)
        fit, weight = unpruned(problem, collocation, control, rows, History())
        left = residual_noise(fit)
        over = CONSISTENT * left < problem.noise
        if weight == FIRST_WEIGHTS[-1] and over.any():
            return replace(problem, noise=np.where(over, left, problem.noise))
    return None


def evidence(problem: Problem, fit: Fit) -> float:
    """What a law costs whose noise is its own: n log variance, and the price of its terms.

    The lower, the better (Bayesian information criterion); of laws of the same data.
    """
    counts = fit.collocation.counts
    seen = counts > 0
    # Of a law that is kicked, what is not foretold: the curve follows its data.
    single = (
        np.hypot(problem.noise, problem.process_noise) if problem.kicked else residual_noise(fit)
    )
    return float(counts[seen] @ np.log(single[seen] ** 2)) + problem.price(fit.state)
