"""Cubic smoothing splines with one penalty per coordinate, chosen by cross-validation.

Gives the first curve and the estimate of the noise. All stretches of data between gaps share one
penalty, so that nothing is smoothed across a gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded

from ..arrays import Floats
from .bspline import WIDTH, Grid, Segment, basis, normal_band
from .data import Trajectory

PROBES = 24
"""Random vectors with which the trace of the influence matrix is estimated."""
PENALTIES = 10.0 ** np.arange(-4, 11.6, 0.5)
"""Of the squared second derivative, in units of the median time step."""
COARSE = 4
"""One penalty in so many is tried first, then those beside the best."""


@dataclass(frozen=True)
class Smooth:
    """Smoothed stretches of data.

    Parameters
    ----------
    splines : tuple of scipy.interpolate.BSpline
        One per stretch, with values of shape (d,).
    noise : ndarray, shape (d,)
        Estimated standard deviation of the noise of each coordinate.
    """

    splines: tuple[BSpline, ...]
    noise: Floats


def smooth(
    stretches: Sequence[Trajectory], rng: np.random.Generator, penalties: Floats = PENALTIES
) -> Smooth:
    """Smooth stretches of data by generalised cross-validation.

    Minimises ``|G P - x|^2 + penalty |second derivative|^2`` with a knot at every sample; the
    trace of the influence matrix is estimated with random probes (Hutchinson), which keeps the
    cost linear in the number of samples.

    Parameters
    ----------
    stretches : sequence of (t, x)
        Times (n,) and values (n, d) without gaps, n >= 2; NaN where a coordinate was not seen.
    rng : numpy.random.Generator
        For the probes.
    penalties : ndarray, optional
        Among which to choose.
    """
    grid = Grid.of([Segment(t, x, t) for t, x in stretches])
    roughness, signs = _roughness(stretches, grid), rng.choice([-1.0, 1.0], size=len(grid.x))
    control, noise = np.zeros((grid.r, grid.x.shape[1])), np.zeros(grid.x.shape[1])
    patterns, kind = np.unique(np.isfinite(grid.x), axis=1, return_inverse=True)
    for k, seen in enumerate(patterns.T):
        alike, rows = np.flatnonzero(kind == k), np.flatnonzero(seen)
        smoothed = _cross_validated(
            grid.samples[rows], grid.x[np.ix_(rows, alike)], roughness, signs[rows], penalties
        )
        control[:, alike], noise[alike] = smoothed
    return Smooth(tuple(grid.splines(control)), noise)


def _cross_validated(
    samples: sparse.csr_array, x: Floats, roughness: Floats, signs: Floats, penalties: Floats
) -> tuple[Floats, Floats]:
    """Control points, (r, d), and noise, (d,), of coordinates that were seen at the same times."""
    n, d = x.shape
    sample_band = normal_band(samples)
    # Combs of random signs: exact where the influence of a sample dies out within a comb's pitch.
    probes = np.zeros((n, PROBES))
    probes[np.arange(n), np.arange(n) % PROBES] = signs
    right = samples.T @ np.concatenate([x, probes], axis=1)
    best, noise = np.full(d, np.inf), np.zeros(d)
    control, chosen = np.zeros((samples.shape[1], d)), np.zeros(d, dtype=int)
    every = np.arange(len(penalties))
    coarse = every % COARSE == 0
    for refined in (False, True):
        near = np.abs(every[:, None] - chosen).min(axis=1) < COARSE
        for index in every[near & ~coarse if refined else coarse]:
            band = sample_band + penalties[index] * roughness
            band[0] += 1e-12 * band[0].max()
            solved = cho_solve_banded((cholesky_banded(band, lower=True), True), right)
            fitted = samples @ solved
            trace = (probes * fitted[:, d:]).sum()
            free = max(n - trace, 1e-9 * n)
            squares = ((x - fitted[:, :d]) ** 2).sum(axis=0)
            score = n * squares / free**2
            better = score < best
            best[better], chosen[better] = score[better], index
            control[:, better] = solved[:, :d][:, better]
            # E |K e|^2 = variance tr(K K'), K = I - influence: holds where hardly anything is
            # smoothed.
            noise[better] = np.sqrt(squares[better] / ((probes - fitted[:, d:]) ** 2).sum())
    return control, noise


def _roughness(stretches: Sequence[Trajectory], grid: Grid) -> Floats:
    """Integral of the squared second derivative in the control points, (4, r) in banded storage.

    Times are in units of the median time step. The second derivative is linear between two knots,
    so two Gauss points integrate its square.
    """
    spans = np.concatenate([np.diff(t) for t, _ in stretches])
    total = np.zeros((WIDTH, grid.r))
    for node in (0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12)):
        times = [t[:-1] + node * np.diff(t) for t, _ in stretches]
        bend = basis(grid.knots, grid.starts, times, order=2)
        bend.data *= np.sqrt(spans / 2).repeat(WIDTH)
        total += normal_band(bend)
    return total * np.median(spans) ** 3
