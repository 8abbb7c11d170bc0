"""Process noise: random kicks of the motion, told from errors of the measurement by evidence.

A law that leaves more than the noise of the data can be exact and badly measured (errors that
last), or well measured and not exact (kicks at every instant). Both are Gaussian models of the
same data, so their marginal likelihoods can be compared (MacKay 1992; weak-constraint 4D-Var):
``evidence`` is minus twice its logarithm, with the curve integrated out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import cho_solve_banded

from ..arrays import Floats
from .collocation import CLEANEST, Collocation, Fit, State
from .errors import prediction_gain, residual_noise
from .problem import Problem, fit_curves
from .splines import Segment

PROBES = 8
"""Random vectors of a trace (Hutchinson): they leave an error of a hundredth at 1,500 samples."""
MOST_UPDATES, SETTLED = 20, 0.1
"""Updates of the two variances, and the change (of the logarithm) at which they end."""
HARDEST = 1e8
"""Physics weight, relative to the misfit of a plain regression, that leaves no room for kicks."""


def with_process_noise(problem: Problem, fit: Fit, rng: np.random.Generator) -> Problem:
    """The problem with the kicks that its data show; the same problem if they show none.

    Parameters
    ----------
    problem : Problem
        Without kicks.
    fit : Fit
        The best law that holds exactly.
    rng : Generator
        For the probes of traces.
    """
    segments = [
        Segment.even(s.t, s.x, problem.spacing, s.trajectory) for s in fit.collocation.segments
    ]
    grid = problem.collocation(segments, residual_noise(fit))
    control = fit_curves(grid, fit.collocation.grid.splines(fit.state.control_points))
    exact = problem.weighted(grid, HARDEST).solve(replace(fit.state, control_points=control))
    noise = residual_noise(exact)
    exact = exact.collocation.weighted(noise**-2, exact.collocation.physics_weights).solve(
        exact.state
    )
    residual, _ = exact.collocation.data_residual(exact.state.control_points)
    lasting = evidence(exact) + prediction_gain(exact).sum()
    every = replace(exact.state, active=np.ones_like(fit.state.active))
    kicked = _balanced(problem.weighted(problem.collocation(segments), 1.0), every, rng)
    newcomers = int((~fit.state.active).sum())  # each gains 1 by chance
    if not evidence(kicked) < lasting - 2 * newcomers:
        return problem
    weights = kicked.collocation
    return replace(
        problem,
        noise=np.maximum(weights.data_weights**-0.5, CLEANEST),
        process_noise=weights.physics_weights**-0.5,
    )


def evidence(fit: Fit) -> float:
    """Minus twice the log marginal likelihood of a fit; comparable on the same knots."""
    collocation = fit.collocation
    factor, _ = collocation.factor(fit.state)
    grid = collocation.grid
    weights = len(grid.x) * np.log(collocation.data_weights).sum()
    weights += np.log(np.outer(grid.node_weights, collocation.physics_weights)).sum()
    return float(collocation.objective(fit.state) - weights + 2 * np.log(factor[0]).sum())


def _balanced(collocation: Collocation, state: State, rng: np.random.Generator) -> Fit:
    """The fit at the variances of noise and kicks that make the data most likely.

    Each variance is the mean square of its residual, over the share of its equations that is not
    used up by the curve (MacKay's update).
    """
    grid, d = collocation.grid, collocation.d
    probes = rng.choice([-1.0, 1.0], (grid.r * d, PROBES))
    limit = HARDEST * collocation.physics_weights
    for _ in range(MOST_UPDATES):
        fit = collocation.solve(state, tolerance=1.0, max_steps=10)
        state, collocation = fit.state, fit.collocation
        factor, physics = collocation.factor(state)
        solved = cho_solve_banded((factor, True), probes)
        follows = (physics @ probes) * (physics @ solved)
        law = follows.mean(axis=1).reshape(-1, d).sum(axis=0)
        probe, answer = ((grid.samples @ v.reshape(grid.r, -1)) for v in (probes, solved))
        data = (probe * answer).reshape(len(grid.x), d, PROBES).mean(axis=2).sum(axis=0)
        data *= collocation.data_weights
        residual, _ = collocation.data_residual(state.control_points)
        missed = grid.node_weights @ collocation.physics_residual(state) ** 2
        nodes = len(grid.node_weights)
        left = np.maximum(len(grid.x) - data, 1.0) / np.maximum((residual**2).sum(axis=0), 1e-300)
        kicks = np.maximum(nodes - law, 1.0) / np.maximum(missed, 1e-300)
        left, kicks = np.minimum(left, CLEANEST**-2), np.minimum(kicks, limit)
        change = np.log(np.concatenate([left, kicks]))
        change -= np.log(np.concatenate([collocation.data_weights, collocation.physics_weights]))
        collocation = collocation.weighted(left, kicks)
        if (np.abs(change) < SETTLED).all():
            break
    return collocation.solve(state, tolerance=1.0)
