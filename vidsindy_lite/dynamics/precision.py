"""How precise each measurement is, as the errors that a law leaves tell.

Noise may grow with the signal, with its speed (times that are not exact) or be larger for a while,
and some samples may be plainly wrong. A model of the variance is fitted to the residuals, the
simplest that explains them (Bayesian information criterion); each measurement then has its own
weight, and what is no noise at all has none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Bools, Floats
from .collocation import CLEANEST, Fit
from .errors import inflation
from .problem import Problem

GROSS = 6.0
"""Distance from the curve, in standard deviations of the noise there, that no noise reaches."""
MOST_GROSS = 0.1
"""Largest share of samples that may be wrong; if more are, the law is."""
STRETCHES = 8
"""Pieces of a trajectory that may have a noise of their own."""
LIKELY = 20.0
"""Gain of the criterion from which on a noise is not taken to be even."""
LARGEST_RATIO = 100.0
"""Precision of the best measurements over the typical one, at most."""
UPDATES = 60
"""Steps of the variance components: ten would do for most."""
LEAST = 1e-300
"""Keeps a quotient finite where nothing is left."""
MEDIAN = 0.455
"""Median of the square of a standard normal number."""
LASTING = 1.5
"""Inflation of the errors from which on they are no noise of single samples."""
NOISELESS = 1e-4
"""Errors as small as this are those of splines, not of measurements."""


def with_precision(problem: Problem, fit: Fit) -> Problem:
    """The problem with the precision that a fit shows each measurement to have.

    The same problem where the noise is even and no sample is wrong, or the errors are given.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        A law that fits as far as its measurements allow.
    """
    collocation, segments = fit.collocation, fit.collocation.segments
    splines = collocation.grid.splines(fit.state.control_points)
    residual, _ = collocation.data_residual(fit.state.control_points)
    path = [
        np.stack([spline(s.t), spline(s.t, 1)]) for s, spline in zip(segments, splines, strict=True)
    ]
    pieces = [(s.trajectory, s.t) for s in segments]
    return _weighed(problem, pieces, path, residual, collocation.precision)


def foreseen(problem: Problem) -> Problem:
    """The same by the smoothed curves, before any law is known.

    A wrong law explains what it misses by measurements of its own choice; a curve has no law.
    """
    stretches, steps = problem.stretches, 1e-3
    path, residual = [], []
    for (_, (t, x)), curve in zip(stretches, problem.curves, strict=True):
        path.append(np.stack([curve(t), (curve(t + steps) - curve(t - steps)) / (2 * steps)]))
        residual.append(np.nan_to_num(path[-1][0] - x))
    seen = np.concatenate([np.isfinite(x) for _, (_, x) in stretches]).astype(float)
    pieces = [(number, t) for number, (t, _) in stretches]
    return _weighed(problem, pieces, path, np.concatenate(residual), seen)


def _weighed(
    problem: Problem,
    pieces: list[tuple[int, Floats]],
    path: list[Floats],
    residual: Floats,
    known: Floats,
) -> Problem:
    """The problem with the precision that residuals of a path tell, (n, d) in pieces.

    A piece is the number of a trajectory and times, its path states and slopes, (2, n, d); what is
    ``known`` are the precisions so far.
    """
    if problem.measured_errors:
        return problem
    residual = residual * np.sqrt(known)
    signal, speed = np.concatenate(path, axis=1)
    causes = [(signal - problem.home) ** 2, speed**2]  # what the variance of the noise may follow
    spread = np.sqrt((residual**2).sum(axis=0) / np.maximum((known > 0).sum(axis=0), 1))
    factors, noise = np.ones_like(residual), problem.noise.copy()
    for j in np.flatnonzero(spread > NOISELESS):
        seen = known[:, j] > 0
        factors[seen, j] = _factors(residual[seen, j], [cause[seen, j] for cause in causes])
        left = (factors[seen, j] * residual[seen, j] ** 2).sum() / (factors[seen, j] > 0).sum()
        noise[j] *= np.sqrt(left) / spread[j]
    if (factors == 1).all():
        return problem
    precision = [values.copy() for values in problem.precision]
    ends = np.cumsum([len(t) for _, t in pieces])[:-1]
    for (number, t), factor in zip(pieces, np.split(factors, ends), strict=True):
        rows = np.searchsorted(problem.trajectories[number][0], t)
        precision[number][rows] *= factor
    return replace(problem, precision=precision, noise=np.maximum(noise, CLEANEST))


def _factors(residual: Floats, causes: list[Floats]) -> Floats:
    """Precision of measurements over the typical one, (n,): 0 for what is no noise."""
    n = len(residual)
    even = np.ones(n)
    pieces = np.arange(n) * STRETCHES // n
    stretches = (pieces == np.unique(pieces)[:, None]).astype(float)
    models = [even[None], *([even, z] for z in causes), stretches]
    fits = [_variance(residual, np.array(model)) for model in models]
    cost, variance, gross = min(fits, key=lambda fit: fit[0])
    plain = n * np.log((residual**2).mean()) + n + np.log(n)
    if not cost < plain - LIKELY or gross.mean() > MOST_GROSS:
        return even
    if inflation([np.where(gross, 0.0, residual / np.sqrt(variance))[:, None]])[0] > LASTING:
        variance = even  # what lasts is no noise, but a single sample may still be wrong
    precision = np.minimum(np.median(variance) / variance, LARGEST_RATIO)
    return np.where(gross & _alone(residual), 0.0, precision)


def _alone(residual: Floats) -> Bools:
    """Which residuals are more than twice those around them, (n,)."""
    around = np.stack([np.roll(residual, k) for k in (-2, -1, 1, 2)])
    return np.abs(residual) > 2 * np.abs(np.median(around, axis=0))


def _variance(residual: Floats, causes: Floats) -> tuple[float, Floats, Bools]:
    """A variance that is a sum of causes, (k, n), each times an unknown size of at least 0.

    Its criterion, itself, (n,), and what is no noise. The sizes by an ascent of the likelihood
    that keeps them positive; what is gross at present does not count.
    """
    causes = causes / causes.mean(axis=1, keepdims=True)
    squares = residual**2
    variance = causes.sum(axis=0)
    least = (squares / variance).mean() / LARGEST_RATIO**2  # some residuals are exactly zero
    sizes = np.full(len(causes), max(np.median(squares / variance) / MEDIAN, least))
    for _ in range(UPDATES):
        variance = np.maximum(sizes @ causes, least)
        noise = squares <= GROSS**2 * variance
        up = (causes * (noise * squares / variance**2)).sum(axis=1)
        down = (causes * (noise / variance)).sum(axis=1)
        sizes = sizes * up / np.maximum(down, LEAST)
    variance = np.maximum(sizes @ causes, variance.max() / LARGEST_RATIO**2)
    gross = squares > GROSS**2 * variance
    terms = np.log(variance) + np.where(gross, GROSS**2, squares / variance)
    return float(terms.sum() + len(causes) * np.log(len(residual))), variance, gross
