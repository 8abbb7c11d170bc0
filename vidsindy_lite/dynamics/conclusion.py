"""From the last fit to what is told of it: the law in the units and the frame of the data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline

from ..arrays import Floats, Ints
from .absent import intervals
from .collocation import Fit, Linearisation
from .diagnostics import diagnose
from .discovery import Discovery
from .errors import residual_noise
from .history import History
from .library import shift_generators, shift_matrix
from .persistence import Path
from .problem import Problem
from .selection import inverse
from .splines import DEGREE
from .units import Units

KEPT = 1e-12
"""Price of a term that stays whatever its error."""


def conclude(problem: Problem, fit: Fit, path: Path, history: History) -> Discovery:
    """Turn the last fit into a `Discovery` in the units of the data.

    Parameters
    ----------
    problem : Problem
        The data and the prices: a coefficient whose squared score is lower than its price cannot
        be told from zero.
    fit : Fit
        At a physics weight at which the law holds exactly.
    path : Path
        On which the law was chosen.
    history : History
        Passed on.
    """
    units, state, collocation = problem.units, fit.state, fit.collocation
    form, exponents, (l, d) = problem.form, problem.exponents, state.coefficients.shape
    model = path.model if path.fit is fit else problem.model(fit)
    covariance = _covariance(units, fit, model)
    coefficients = state.coefficients * units.factors(exponents)
    offset = np.where(state.moving, units.point(state.offset), 0.0)
    moved, moved_covariance = _shifted(exponents, coefficients, offset, covariance)
    # What the frame of the data needs is decided at the errors at which the terms were chosen.
    tolerated = np.maximum([plateau.low / path.own for plateau in path.of(state.active)], 1.0)
    # To what the shift adds nothing, that the fit has weighed.
    weighed = (moved == coefficients).T.ravel()
    prices = np.where(weighed, KEPT, problem.prices * np.repeat(tolerated, l) ** 2)
    moved, moved_covariance, margins = _pruned(moved, moved_covariance, prices)
    margins /= np.repeat(tolerated**2, l)
    dearer = problem.cautious.prices - problem.prices
    margins += np.where(moved.T.ravel() != 0, -dearer, dearer)
    margins[weighed] = np.inf
    law = form.law(moved + form.known)
    seen = collocation.counts > 0
    return Discovery(
        system=law,
        native=form.law(coefficients + form.known),
        offset=offset,
        covariance=moved_covariance,
        native_covariance=covariance[: l * d, : l * d],
        offset_errors=np.sqrt(np.diag(covariance)[l * d :]),
        noise=np.where(
            seen, (problem.noise if problem.kicked else residual_noise(fit)) * units.scale, np.nan
        ),
        model_error=_kicks(problem, fit),
        warnings=diagnose(problem, fit, model, path, law, margins),
        path=path.plateaus,
        history=tuple(history.steps),
        absent=intervals(problem, fit.state, model, tolerated),
        curves=tuple(
            BSpline(s.t * units.time, s.c * units.scale + units.centre, DEGREE)
            for s in collocation.grid.splines(state.control_points)
        ),
    )


def with_errors(found: Discovery, problem: Problem, fit: Fit, model: Linearisation) -> Discovery:
    """The same law, its error bars those of another quadratic model around its fit."""
    state, form = fit.state, problem.form
    covariance, size = _covariance(problem.units, fit, model), state.coefficients.size
    coefficients = state.coefficients * problem.units.factors(problem.exponents)
    moved = _shifted(problem.exponents, coefficients, found.offset, covariance)
    kept = (found.system.support & ~(form.known != 0)).T.ravel()
    moved_coefficients, moved_covariance, _ = _pruned(*moved, np.where(kept, KEPT, np.inf))
    return replace(
        found,
        system=form.law(moved_coefficients + form.known),
        covariance=moved_covariance,
        native_covariance=covariance[:size, :size],
        offset_errors=np.sqrt(np.diag(covariance)[size:]),
    )


def _kicks(problem: Problem, fit: Fit) -> Floats:
    """Standard deviation of what the kicks of a unit of time add, in units of the data, (d,)."""
    grid, units = fit.collocation.grid, problem.units
    span = sum(s.breakpoints[-1] - s.breakpoints[0] for s in grid.segments) / len(grid.x)
    return problem.process_noise * units.scale * np.sqrt(span / units.time)


def _covariance(units: Units, fit: Fit, model: Linearisation) -> Floats:
    """Covariance of coefficients and offset in units of the data; zero where nothing is free."""
    columns = np.flatnonzero(fit.state.free())
    size = len(fit.state.flat())
    covariance = np.zeros((size, size))
    covariance[np.ix_(columns, columns)] = inverse(model.of(columns).information)
    factors = units.factors(fit.collocation.exponents)
    unit = np.concatenate([factors.T.ravel(), units.scale])
    for entry, first in fit.state.followers():
        covariance[entry] = covariance[first]
    for entry, first in fit.state.followers():
        covariance[:, entry] = covariance[:, first]
    return covariance * (unit[:, None] * unit)


def _shifted(
    exponents: Ints, coefficients: Floats, offset: Floats, covariance: Floats
) -> tuple[Floats, Floats]:
    """Law in the data's frame, with the covariance of coefficients and offset carried along."""
    l, d = coefficients.shape
    matrix = shift_matrix(exponents, offset)
    moved = matrix @ coefficients
    jacobian = np.zeros((l * d, l * d + d))
    jacobian[:, : l * d] = np.kron(np.eye(d), matrix)
    for i, generator in enumerate(shift_generators(exponents)[:d]):
        jacobian[:, l * d + i] = -(generator @ moved).T.ravel()
    return moved, jacobian @ covariance @ jacobian.T


def _pruned(
    coefficients: Floats, covariance: Floats, penalties: Floats
) -> tuple[Floats, Floats, Floats]:
    """Set what cannot be told from zero to zero, one by one, and correct the others for it.

    Shifting a law by an estimated offset leaves remainders where the exact shift cancels. The
    least significant is taken out by conditioning the Gaussian estimate on its being zero. Comes
    back with the margin of each decision, in chi-square units; infinite where none was taken.
    """
    shape = coefficients.shape[::-1]
    flat = coefficients.T.ravel().copy()
    covariance = covariance.copy()
    original = np.diag(covariance).copy()
    margins = np.full(len(flat), np.inf)
    while True:
        variance = np.diag(covariance)
        live = np.flatnonzero(flat)
        # After conditioning, a dependent entry has neither value nor variance left.
        known = variance[live] <= 1e-12 * original[live]
        score = np.where(known, np.inf, flat[live] ** 2 / np.where(known, 1.0, variance[live]))
        gone = live[known & (flat[live] ** 2 < 1e-6 * original[live])]
        if len(gone):
            flat[gone] = 0.0
            continue
        weakness = score / penalties[live]
        if not len(live) or weakness.min() >= 1:
            margins[live] = score - penalties[live]
            break
        weakest = weakness.argmin()
        k = live[weakest]
        margins[k] = penalties[k] - score[weakest]
        gain = covariance[:, k] / covariance[k, k]
        flat -= gain * flat[k]
        covariance -= np.outer(gain, covariance[k])
        flat[k] = 0.0
        covariance[k] = covariance[:, k] = 0.0
    dead = flat == 0
    covariance[dead] = covariance[:, dead] = 0.0
    return flat.reshape(shape).T, covariance, margins
