"""Cubic smoothing splines with one penalty per coordinate, chosen by cross-validation.

Gives the first curve and the estimate of the noise. All stretches of data between gaps share one
penalty, so that nothing is smoothed across a gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded

from .splines import DEGREE, clamped_knots, local_basis

PROBES = 24
PENALTIES = 10.0 ** np.arange(-4, 11.6, 0.5)


@dataclass(frozen=True)
class Smooth:
    """Smoothed stretches of one trajectory.

    Parameters
    ----------
    splines : tuple of scipy.interpolate.BSpline
        One per stretch, with values of shape (d,).
    noise : ndarray, shape (d,)
        Estimated standard deviation of the noise of each coordinate.
    """

    splines: tuple[BSpline, ...]
    noise: np.ndarray


def smooth(stretches: Sequence[tuple[np.ndarray, np.ndarray]], rng: np.random.Generator) -> Smooth:
    """Smooth stretches of data by generalised cross-validation.

    Minimises ``|G P - x|^2 + penalty |second derivative|^2`` with a knot at every sample; the
    trace of the influence matrix is estimated with random probes (Hutchinson), which keeps the
    cost linear in the number of samples.

    Parameters
    ----------
    stretches : sequence of (t, x)
        Times (n,) and values (n, d) without gaps, n >= 2.
    rng : numpy.random.Generator
        For the probes.
    """
    knots = [clamped_knots(t) for t, _ in stretches]
    starts = np.cumsum([0] + [len(k) - DEGREE - 1 for k in knots])
    r, n = starts[-1], sum(len(t) for t, _ in stretches)
    x = np.concatenate([values for _, values in stretches])
    step = np.median(np.concatenate([np.diff(t) for t, _ in stretches]))
    gram, roughness = np.zeros((DEGREE + 1, r)), np.zeros((DEGREE + 1, r))
    firsts, values = [], []
    for k, start, (t, _) in zip(knots, starts[:-1], stretches, strict=True):
        first, basis = local_basis(k, t)
        firsts.append(first + start)
        values.append(basis)
        # The second derivative is linear in a span: two Gauss points integrate its square.
        for node in (0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12)):
            span = np.diff(t)
            at, bend = local_basis(k, t[:-1] + node * span, order=2)
            _accumulate(roughness, at + start, bend * np.sqrt(span / 2)[:, None])
    first, basis = np.concatenate(firsts), np.concatenate(values)
    _accumulate(gram, first, basis)
    roughness *= step**3

    def transpose(v):
        total = np.zeros((r, v.shape[1]))
        for a in range(DEGREE + 1):
            np.add.at(total, first + a, basis[:, a, None] * v)
        return total

    def evaluate(p):
        return sum(basis[:, a, None] * p[first + a] for a in range(DEGREE + 1))

    # Combs of random signs: exact where the influence of a sample dies out within a comb's pitch.
    probes = np.zeros((n, PROBES))
    probes[np.arange(n), np.arange(n) % PROBES] = rng.choice([-1.0, 1.0], size=n)
    right = np.concatenate([transpose(x), transpose(probes)], axis=1)
    d = x.shape[1]
    best = np.full(d, np.inf)
    control, noise = np.zeros((r, d)), np.zeros(d)
    for penalty in PENALTIES:
        band = gram + penalty * roughness
        band[0] += 1e-12 * band[0].max()
        solved = cho_solve_banded((cholesky_banded(band, lower=True), True), right)
        fitted = evaluate(solved)
        trace = (probes * fitted[:, d:]).sum()
        free = max(n - trace, 1e-9 * n)
        squares = ((x - fitted[:, :d]) ** 2).sum(axis=0)
        score = n * squares / free**2
        better = score < best
        best[better] = score[better]
        control[:, better] = solved[:, :d][:, better]
        # E |K e|^2 = variance tr(K K'), K = I - influence: holds where hardly anything is smoothed.
        noise[better] = np.sqrt(squares[better] / ((probes - fitted[:, d:]) ** 2).sum())
    splines = tuple(
        BSpline(k, control[start : start + len(k) - DEGREE - 1], DEGREE)
        for k, start in zip(knots, starts[:-1], strict=True)
    )
    return Smooth(splines, noise)


def _accumulate(band: np.ndarray, first: np.ndarray, rows: np.ndarray) -> None:
    for a in range(DEGREE + 1):
        for b in range(a + 1):
            np.add.at(band[a - b], first + b, rows[:, a] * rows[:, b])
