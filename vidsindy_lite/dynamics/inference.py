"""From the last fit to what is told of it: a law in the frame and the units of the data.

Its standard errors, too, and the intervals of absent terms.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from ..arrays import Floats, Ints
from .bspline import DEGREE
from .collocation import Fit, Linearisation, State
from .data import Units
from .l0 import inverse, newcomers
from .library import divides, shift_generators, shift_matrix
from .model import runge_kutta_4
from .noise import bent, place_errors, residual_noise
from .problem import Problem
from .result import Discovery, History, Path

# --------------------------------------------------------------------------------------------------
# Terms that a law has not: between which values each could be, and which the data could not see.
#
# No term in a law means no evidence for it, which is little where the data can hardly tell.


def intervals(problem: Problem, state: State, model: Linearisation, tolerated: Floats) -> Floats:
    """Between which values each absent candidate term would be if it alone joined the law.

    With the information ``S`` and the gradient ``g`` of the last fit, of which the curve is
    eliminated, and the terms ``A`` of the law (and its moving axes), a candidate k is estimated as
    ``(g_k - S_kA inv(S_AA) g_A) v`` with the variance ``v = 1 / (S_kk - S_kA inv(S_AA) S_Ak)``:
    all that the law has is fitted again.

    Parameters
    ----------
    problem : Problem
    state : State
        Of the last fit.
    model : Linearisation
        Around it, of all candidates.
    tolerated : ndarray, shape (d,)
        Errors at which the terms of each equation were chosen, over those of the fit.

    Returns
    -------
    ndarray, shape (l, d, 2)
        95 % intervals in the law's own frame and the units of the data; NaN for what is in the law
        or no candidate, infinite where the data cannot tell a term from those of the law.
    """
    l, d = state.coefficients.shape
    own = np.flatnonzero(state.free())
    others = np.setdiff1d(problem.form.searched, own)
    model = model.of(np.concatenate([own, others]))
    estimate, variance = newcomers(model.information, model.gradient, len(own))
    spread = 1.96 * np.sqrt(variance) * tolerated[others // l]
    flat = np.full((l * d, 2), np.nan)
    flat[others] = np.column_stack([estimate - spread, estimate + spread])
    flat = flat[problem.form.shared]  # directions of a vector have the interval of the first
    factors = problem.units.factors(problem.exponents)
    return flat.reshape(d, l, 2).swapaxes(0, 1) * factors[:, :, None]


# --------------------------------------------------------------------------------------------------
# From the last fit to what is told of it: the law in the units and the frame of the data.

KEPT = 1e-12  #: Penalty of a term that stays whatever its error.


def infer(
    problem: Problem, fit: Fit, model: Linearisation, path: Path, history: History
) -> Discovery:
    """Turn the last fit into a `Discovery` in the units of the data, without warnings as yet.

    Parameters
    ----------
    problem : Problem
        The data and the penalties: a coefficient whose squared score is lower than its own cannot
        be told from zero.
    fit : Fit
        At a physics weight at which the law holds exactly.
    model : Linearisation
        Around it, of all candidates and moving axes.
    path : Path
        On which the law was chosen.
    history : History
        Passed on.
    """
    units, state, collocation = problem.units, fit.state, fit.collocation
    form, exponents = problem.form, problem.exponents
    coefficients = state.coefficients * units.factors(exponents)
    offset = np.where(state.moving, units.point(state.offset), 0.0)
    # Errors at which the terms were chosen, over those of the fit.
    tolerated = np.maximum([plateau.low / path.own for plateau in path.of(state.active)], 1.0)
    # To what the shift adds nothing, that the fit has weighed.
    weighed = _shifted(exponents, coefficients, offset)[0] == coefficients.T.ravel()
    penalties = np.where(weighed, KEPT, np.tile(problem.penalties, problem.d))
    noise = problem.noise if problem.has_process_noise else residual_noise(fit)
    span = sum(np.ptp(s.breakpoints) for s in collocation.grid.segments) / len(collocation.grid.x)

    def told(curve: BSpline) -> BSpline:
        return BSpline(curve.t * units.time, curve.c * units.scale + units.centre, DEGREE)

    own, shared = np.flatnonzero(state.free()), bent(fit).collocation
    bends = shared.systematic.shape[2] > collocation.systematic.shape[2]
    around = shared.linearise(state, own) if bends else model.of(own)
    return Discovery(
        **_in_both_frames(problem, fit, around, offset, penalties),
        native=form.law(coefficients + form.known),
        offset=offset,
        noise=np.where(collocation.counts > 0, noise * units.scale, np.nan),
        model_error=problem.process_noise * units.scale * np.sqrt(span / units.time),
        warnings=(),
        path=path.plateaus,
        history=tuple(history.steps),
        absent=intervals(problem, fit.state, model, tolerated),
        curves=tuple(map(told, fit.splines)),
        across=tuple(map(told, across_gaps(problem, fit))),
    )


def with_errors(found: Discovery, problem: Problem, fit: Fit, model: Linearisation) -> Discovery:
    """The same law, its error bars those of another quadratic model around its fit."""
    kept = found.system.support & ~(problem.form.known != 0)
    penalties = np.where(kept.T.ravel(), KEPT, np.inf)
    return replace(found, **_in_both_frames(problem, fit, model, found.offset, penalties))


def _in_both_frames(
    problem: Problem, fit: Fit, model: Linearisation, offset: Floats, penalties: Floats
) -> dict[str, Any]:
    """The law in the frame of the data, and the errors in both, as a `Discovery` has them."""
    covariance, size = _covariance(problem.units, fit, model), fit.state.coefficients.size
    coefficients = fit.state.coefficients * problem.units.factors(problem.exponents)
    moved, spread = _pruned(problem.exponents, coefficients, offset, covariance, penalties)
    return {
        "system": problem.form.law(moved + problem.form.known),
        "covariance": spread,
        "native_covariance": covariance[:size, :size],
        "offset_errors": np.sqrt(np.diag(covariance)[size:]),
    }


def across_gaps(problem: Problem, fit: Fit, most: float = 0.1) -> Iterator[BSpline]:
    """Curves across the gaps in which a law leads from one side to the other.

    It is integrated from where the one ends, and by how much it misses the other is spread over the
    way; where that is ``most`` of the spread, or an input jumps nobody knows when, the gap is open.
    """
    law = problem.law(fit.state).shift(fit.state.offset)
    pieces = zip(fit.collocation.grid.segments, fit.splines, strict=True)
    for (before, left), (after, right) in pairwise(pieces):
        low, high = left.t[-1], right.t[0]
        jumps = ((problem.unsure[:, 0] < high) & (low < problem.unsure[:, 1])).any()
        if before.trajectory != after.trajectory or jumps:
            continue
        t = np.linspace(low, high, 4 + 4 * int((high - low) / problem.spacing))
        with np.errstate(over="ignore", invalid="ignore"):
            path = runge_kutta_4(law, t, left(low), substeps=1)
        missed = right(high) - path[-1]
        if np.abs(missed).max() < most:
            yield make_interp_spline(t, path + np.linspace(0, 1, len(t))[:, None] * missed)


def _covariance(units: Units, fit: Fit, model: Linearisation) -> Floats:
    """Covariance of coefficients and offset in units of the data; zero where nothing is free."""
    columns = np.flatnonzero(fit.state.free())
    size = len(fit.state.flat())
    covariance = np.zeros((size, size))
    covariance[np.ix_(columns, columns)] = inverse(model.of(columns).information)
    moving = size - len(units.scale) + np.flatnonzero(fit.state.moving)
    covariance[moving, moving] += place_errors(fit) ** 2
    factors = units.factors(fit.collocation.exponents)
    unit = np.concatenate([factors.T.ravel(), units.scale])
    sources = fit.state.sources
    return covariance[np.ix_(sources, sources)] * (unit[:, None] * unit)


def _shifted(exponents: Ints, coefficients: Floats, offset: Floats) -> tuple[Floats, Floats]:
    """The coefficients of a law in the data's frame, equation by equation, (l d,).

    And their derivatives in coefficients and offset, (l d, l d + d).
    """
    d, matrix = len(offset), shift_matrix(exponents, offset)
    moved = matrix @ coefficients
    rates = (-shift_generators(exponents)[:d] @ moved).transpose(2, 1, 0).reshape(-1, d)
    return moved.T.ravel(), np.hstack([np.kron(np.eye(d), matrix), rates])


def _powers(exponents: Ints, coefficients: Floats, offset: Floats) -> Ints:
    """The lowest power of the offset in each term of the law in the data's frame, (l d,).

    1 for terms of the law itself.
    """
    lowered = exponents.sum(axis=1) - exponents.sum(axis=1)[:, None]
    left = np.where(divides(exponents, offset != 0), lowered, len(exponents))
    powers = [left[:, column != 0].min(axis=1, initial=len(exponents)) for column in coefficients.T]
    return np.maximum(np.concatenate(powers), 1)


def _pruned(
    exponents: Ints, coefficients: Floats, offset: Floats, covariance: Floats, penalties: Floats
) -> tuple[Floats, Floats]:
    """A law in the data's frame without what cannot be told from zero, and its covariance.

    Shifting a law by an estimated offset leaves remainders where the exact shift cancels. One by
    one, the least significant is taken out by conditioning the Gaussian estimate of coefficients
    and offset on its being zero. A power of an offset is as far from zero as the offset: in its own
    standard errors so many times less.
    """
    shape, size = coefficients.shape[::-1], coefficients.size
    native = np.concatenate([coefficients.T.ravel(), offset])
    free, powers = np.flatnonzero(np.diag(covariance)), _powers(exponents, coefficients, offset)

    def moved(point: Floats) -> tuple[Floats, Floats]:
        return _shifted(exponents, point[:size].reshape(shape).T, point[size:])

    dead, original = moved(native)[0] == 0, None
    for _ in range(size + 1):
        flat, slopes = moved(native)
        left = slopes[:, free] @ covariance[np.ix_(free, free)] @ slopes[:, free].T
        variance = np.diag(left)
        original = variance if original is None else original
        # After conditioning, a dependent entry has neither value nor variance left.
        known = variance <= 1e-12 * original
        dead |= known & (flat**2 < 1e-6 * original)
        live = np.flatnonzero(~dead)
        sigma = np.where(known, 1.0, variance)[live]
        score = np.where(known[live], np.inf, (powers * flat)[live] ** 2 / sigma)
        weakness = score / penalties[live]
        if not len(live) or weakness.min() >= 1:
            break
        # Of the powers of one offset the lowest: the others vanish with it.
        k = live[np.lexsort([weakness, np.where(weakness < 1, powers[live], size)])[0]]
        dead[k] = True
        point = native
        for _ in range(40):  # until it is zero: else what vanishes with it still seems to vary
            flat, slopes = moved(point)
            pull = covariance @ slopes[k]
            room = slopes[k] @ pull
            point = native - pull * ((flat[k] + slopes[k] @ (native - point)) / room)
            if flat[k] ** 2 <= 1e-20 * original[k]:
                break
        covariance = covariance - np.outer(pull, pull / room)
        native = point
    flat = np.where(dead, 0.0, flat)
    left[dead] = left[:, dead] = 0.0
    return flat.reshape(shape).T, left
