"""Process noise: random kicks of the motion, told from errors of the measurement by evidence.

A law that leaves more than the noise of the data may be exact and measured with errors that last,
or measured well and not exact: kicked at every instant. Both are Gaussian models of the same data,
so their marginal likelihoods can be compared (MacKay 1992); in the language of data assimilation,
a strong against a weak constraint. And kicks have a spectrum of their own: what lasts, such as a
bent space or a law outside the library, is none.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.linalg import cho_solve_banded

from ..arrays import Bools, Floats
from .collocation import CLEANEST, Collocation, Fit
from .errors import prediction_gain, residual_noise
from .problem import Problem, fit_curves
from .splines import Segment
from .state import State

PROBES = 8
"""Random vectors of a trace (Hutchinson): they leave an error of a hundredth at 1,500 samples."""
MOST_UPDATES, SETTLED = 20, 0.1
"""Updates of the variances, and the change of a logarithm at which they end."""
HARDEST = 1e8
"""Physics weight, relative to the misfit of a plain regression, that leaves no room for kicks."""
OCTAVE = 8
"""Frequencies of the lowest band of a spectrum; each next one has twice as many."""
UNLIKE, BLUR = 4.0, 0.15
"""Distance between two spectra in standard errors from which on they differ, and the error of a
band's logarithm that splines make by themselves."""
LEAST = 1e-300
"""Keeps a quotient finite where nothing is left."""


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
    start, free = problem.weighted(problem.collocation(segments), 1.0), _free(problem)
    every = replace(_on_knots(start, fit), active=problem.form.candidates)
    kicked = _balanced(problem, _hard_where_known(start, free), every, rng)
    if unlike_kicks(kicked, free, rng) > UNLIKE:
        return problem
    exact = _measured_badly(problem, fit, segments)
    newcomers = int((every.active & ~fit.state.active).sum())  # each of them gains 1 by chance
    measured = evidence(exact) + prediction_gain(exact).sum()
    if not evidence(kicked) + 2 * newcomers < measured:
        return problem
    return _with_variances(problem, kicked.collocation)


def rebalanced(problem: Problem, fit: Fit, rng: np.random.Generator) -> Problem:
    """The problem with the kicks and the noise that a law leaves; all terms together leave less."""
    balanced = _balanced(problem, fit.collocation, fit.state, rng)
    return _with_variances(problem, balanced.collocation)


def _with_variances(problem: Problem, weights: Collocation) -> Problem:
    return replace(
        problem,
        noise=np.maximum(weights.data_weights**-0.5, CLEANEST),
        process_noise=np.where(_free(problem), weights.physics_weights**-0.5, 0.0),
    )


def _free(problem: Problem) -> Bools:
    """Which equations may be kicked: those that are not known, (d,)."""
    return np.asarray(problem.form.candidates.any(axis=0), dtype=bool)


def _hard_where_known(collocation: Collocation, free: Bools) -> Collocation:
    """What is known of a law (the slope of a position is the velocity) holds exactly."""
    hard = HARDEST * collocation.physics_weights
    return collocation.weighted(
        collocation.data_weights, np.where(free, collocation.physics_weights, hard)
    )


def evidence(fit: Fit) -> float:
    """Minus twice the log marginal likelihood of a fit; comparable on the same knots."""
    collocation, grid = fit.collocation, fit.collocation.grid
    factor, _ = collocation.factor(fit.state)
    weights = collocation.counts @ np.log(collocation.data_weights)
    weights += np.log(np.outer(grid.node_weights, collocation.physics_weights)).sum()
    return float(collocation.objective(fit.state) - weights + 2 * np.log(factor[0]).sum())


def _measured_badly(problem: Problem, fit: Fit, segments: list[Segment]) -> Fit:
    """The exact law on other knots, at the errors that it leaves."""
    grid = problem.collocation(segments, residual_noise(fit))
    exact = problem.weighted(grid, HARDEST).solve(_on_knots(grid, fit))
    own = exact.collocation.weighted(residual_noise(exact) ** -2, exact.collocation.physics_weights)
    return own.solve(exact.state)


def _on_knots(collocation: Collocation, fit: Fit) -> State:
    """The state of a fit on other knots."""
    curves = fit.collocation.grid.splines(fit.state.control_points)
    return replace(fit.state, control_points=fit_curves(collocation, curves))


def _balanced(
    problem: Problem, collocation: Collocation, state: State, rng: np.random.Generator
) -> Fit:
    """The fit at the variances of noise and kicks that make the data most likely.

    Each is the sum of the squares of its residuals, over how many of these the curve and the terms
    have not used up (MacKay's update). Noise that is given stays.
    """
    free, told = _free(problem), problem.measured_errors
    grid, d = collocation.grid, collocation.d
    probes = rng.choice([-1.0, 1.0], (grid.r * d, PROBES))
    hardest = HARDEST * collocation.physics_weights
    unfitted = len(grid.node_weights) - state.active.sum(axis=0)
    for _ in range(MOST_UPDATES):
        fit = collocation.solve(state, tolerance=1.0, max_steps=10)
        state, collocation = fit.state, fit.collocation
        factor, physics = collocation.factor(state)
        solved = cho_solve_banded((factor, True), probes)
        in_law = ((physics @ probes) * (physics @ solved)).mean(axis=1).reshape(-1, d).sum(axis=0)
        in_data = _measurements_used(collocation, probes, solved)
        residual, _ = collocation.data_residual(state.control_points)
        missed = (collocation.precision * residual**2).sum(axis=0)
        kicked = grid.node_weights @ collocation.physics_residual(state) ** 2
        data = np.maximum(collocation.counts - in_data, 1.0) / np.maximum(missed, LEAST)
        law = np.maximum(unfitted - in_law, 1.0) / np.maximum(kicked, LEAST)
        unknown = (collocation.counts > 0) & (not told)
        data = np.where(unknown, data, collocation.data_weights)
        law = np.where(free, law, collocation.physics_weights)
        data, law = np.minimum(data, CLEANEST**-2), np.minimum(law, hardest)
        change = np.log([data / collocation.data_weights, law / collocation.physics_weights])
        collocation = collocation.weighted(data, law)
        if (np.abs(change) < SETTLED).all():
            break
    return collocation.solve(state, tolerance=1.0)


def _measurements_used(collocation: Collocation, probes: Floats, solved: Floats) -> Floats:
    """How many measurements of each coordinate the curve uses up, (d,): Hutchinson's trace.

    From random vectors of +-1, (r d, m), and what the inverse of the normal matrix makes of them.
    """
    grid = collocation.grid
    shape = (len(grid.x), collocation.d, -1)
    before, after = (
        (grid.samples @ v.reshape(grid.r, -1)).reshape(shape) for v in (probes, solved)
    )
    return ((before * after).mean(axis=2) * collocation.sample_weights).sum(axis=0)


def unlike_kicks(fit: Fit, free: Bools, rng: np.random.Generator) -> float:
    """How far what the law misses is from what independent kicks and errors would leave.

    Both are simulated and smoothed as the data were; their spectra are compared by octaves: the
    largest distance between the logarithms of a band, in standard errors, over the equations that
    are ``free`` to be kicked.
    """
    collocation, grid, d = fit.collocation, fit.collocation.grid, fit.collocation.d
    factor, physics = collocation.factor(fit.state)
    kicks = rng.standard_normal((physics.shape[0], PROBES))
    errors = rng.standard_normal((len(grid.x), d, PROBES))
    weighted = np.sqrt(collocation.sample_weights)[:, :, None] * errors
    pull = (grid.samples.T @ weighted.reshape(len(grid.x), -1)).reshape(grid.r * d, PROBES)
    pull -= physics.T @ kicks
    simulated = kicks + physics @ cho_solve_banded((factor, True), pull)
    root = np.sqrt(grid.node_weights[:, None] * collocation.physics_weights)
    found = _bands((root * collocation.physics_residual(fit.state))[:, :, None])
    expected = _bands(simulated.reshape(-1, d, PROBES))
    count = OCTAVE * 2.0 ** np.maximum(np.arange(len(found)) - 1, 0)
    distance = np.abs(np.log(np.maximum(found, LEAST) / np.maximum(expected, LEAST)))
    return float((distance / np.sqrt(1 / count + BLUR**2)[:, None])[:, free].max())


def _bands(signal: Floats) -> Floats:
    """Mean power of signals of shape (k, d, m) in octaves of frequency, (bands, d)."""
    power = (np.abs(np.fft.rfft(signal, axis=0)[1:]) ** 2).mean(axis=2) / len(signal)
    octaves = int(np.log2(max(len(power) / OCTAVE, 1.0)))
    edges = [0, *(OCTAVE * 2 ** np.arange(octaves + 1)).tolist()]
    return np.stack([power[low:high].mean(axis=0) for low, high in pairwise(edges)])
