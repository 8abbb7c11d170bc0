"""Poses the problem of a discovery: standard units, gaps, the noise, and the library's units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline

from ..arrays import Floats
from .collocation import CLEANEST
from .form import Form
from .hidden import with_hidden, with_time, with_velocities
from .library import extended
from .problem import Problem, fit_curves, term_penalties
from .smoothing import PENALTIES, smooth
from .splines import DEGREE
from .trajectories import Trajectory, cut, typical_step, typical_steps
from .units import Units

GAP = 0.4
"""A pause longer than this fraction of the time scale of the motion is a gap."""
SHORTEST_STRETCH = 4
"""Stretches of fewer samples tell less than their initial conditions cost."""
LEAST = 1e-300
"""Keeps a quotient finite where a term is zero everywhere."""
DEPENDENT, INVOLVED = 1e-10, 1e-3
"""Least singular value over the largest at which terms depend on each other, and least share."""


def pose(
    measured: list[Trajectory],
    systematic: list[Floats],
    form: Form,
    rng: np.random.Generator,
    sigma: list[Floats] | None = None,
    through: bool = False,
) -> Problem:
    """Pose the problem of a discovery: standard units, gaps, noise, prices.

    The noise is as given by ``sigma``, (n, d) for each trajectory, or as the smoothing estimates;
    the curves are smoothed, or go ``through`` the samples.

    Raises
    ------
    ValueError
        If a coordinate does not move, or there are fewer samples than unknowns; if one was never
        seen, and no equation that is known tells it; if a function of the library is not finite on
        the data, or its terms depend on each other.
    """
    x = np.concatenate([values for _, values in measured])
    seen = np.isfinite(x).any(axis=0)
    x = x.compress(seen, axis=1)
    unknowns, samples = len(form.exponents) + 1, int(np.isfinite(x).sum(axis=0).min())
    if samples < unknowns:
        raise ValueError(
            f"x: must hold at least as many samples as unknowns per equation ({unknowns} for this "
            f"library and d = {len(seen)}), got {samples} samples"
        )
    centre, scale = np.nanmean(x, axis=0), np.nanstd(x, axis=0)
    if not (scale > 1e-12 * np.abs(centre)).all():
        still = int(np.flatnonzero(seen)[np.argmin(scale)])
        raise ValueError(f"x: every coordinate must move, got a constant column {still}")
    if not form.movable.any():  # terms are what they are in the frame of the data
        centre = np.zeros_like(centre)
    step = typical_step(measured)
    trajectories = [
        (t / step, (values.compress(seen, axis=1) - centre) / scale) for t, values in measured
    ]
    stretches, curves, noise = _smoothed(trajectories, rng, PENALTIES[:1] if through else PENALTIES)
    speed = _rms_speed(curves)
    curves = [BSpline(s.t * speed, s.c, DEGREE, extrapolate=True) for s in curves]
    noise = np.maximum(noise, CLEANEST)
    precision = [np.isfinite(values).astype(float) for _, values in trajectories]
    if sigma is not None:
        errors = [np.maximum(part.compress(seen, axis=1) / scale, CLEANEST) for part in sigma]
        noise = np.nanmedian(np.concatenate(errors), axis=0)
        precision = [np.nan_to_num((noise / part) ** 2) for part in errors]
    problem = Problem(
        measured=measured,
        trajectories=[(t * speed, values) for t, values in trajectories],
        systematic=[modes.compress(seen, axis=1) / scale[:, None] for modes in systematic],
        precision=precision,
        stretches=[(i, (t * speed, values)) for i, (t, values) in stretches],
        curves=curves,
        units=Units(centre, scale, step / speed),
        noise=noise,
        form=form,
        penalties=term_penalties(form.exponents, len(seen)),
        slack=np.ones(len(form.names)),
        process_noise=np.zeros(len(form.names)),
        measured_errors=sigma is not None,
    )
    if problem.shared:
        problem = problem.cautious
    if not seen.all():
        problem = with_hidden(problem, curves, seen)
    elif form.states > len(seen):
        problem = with_velocities(problem, curves)
    if form.states < len(form.names):
        problem = with_time(problem)
    if form.exponents.shape[1] > len(form.names):
        problem = _with_functions(problem, rng)
    return replace(problem, slack=_slack(problem))


def _with_functions(problem: Problem, rng: np.random.Generator) -> Problem:
    """The same with the functions of the library in units of their own, and checked."""
    pieces = zip(problem.curves, problem.stretches, strict=True)
    x = problem.units.point(np.concatenate([curve(t) for curve, (_, (t, _)) in pieces]))
    functions = problem.form.functions
    values = extended(x, functions)[:, problem.d :]
    for function, column in zip(functions, values.T, strict=True):
        if not np.isfinite(column).all():
            *place, last = (f"{v:g}" for v in x[np.argmin(np.isfinite(column))])
            where = f"t = {last}" if function.of_time else f"({', '.join([*place, last])})"
            raise ValueError(
                f"library: {function.name} must be finite on the data, got no such value at {where}"
            )
    sizes = np.sqrt((values**2).mean(axis=0))
    for k, function in enumerate(problem.form.functions):
        if function.direction == 0:  # of a vector, in the units of the equations
            scale = problem.units.scale[-len(problem.measured[0][1].T) :]
            common = np.sqrt(((sizes[k : k + len(scale)] / scale) ** 2).mean())
            sizes[k : k + len(scale)] = common * scale
    sizes = np.where(sizes > 0, sizes, 1.0)
    if problem.form.implicit.any():
        sizes = np.append(sizes, problem.units.scale / problem.units.time)
    sized = replace(problem, units=replace(problem.units, sizes=sizes))
    # Each coordinate in an order of its own: what depends on each other there does so everywhere.
    apart = rng.permuted(problem.units.standard(x), axis=0)
    _check_independent(problem.form, sized.terms(apart))
    return sized


def _check_independent(form: Form, terms: Floats) -> None:
    """Refuse candidates that depend on each other at any points, given as terms (n, l).

    Those of an equation; where vectors tie some of several, those of all equations at once.
    """
    terms, l = terms[np.isfinite(terms).all(axis=1)], terms.shape[1]
    explicit = form.candidates & ~form.implicit[:, None]
    searched = np.flatnonzero(explicit.any(axis=0))
    tied = (form.shared != np.arange(len(form.shared))).any()
    _, unlike = np.unique(explicit[:, searched].T, axis=0, return_index=True)
    for equations in [searched] if tied else searched[unlike, None]:
        row, term = np.nonzero(explicit[:, equations].T)
        unknowns, column = np.unique(form.shared[equations[row] * l + term], return_inverse=True)
        columns = np.zeros((len(equations), len(terms), len(unknowns)))
        columns[row, :, column] = terms[:, term].T
        flat = columns.reshape(-1, len(unknowns))
        flat /= np.maximum(np.linalg.norm(flat, axis=0), LEAST)
        _, sizes, shares = np.linalg.svd(flat, full_matrices=False)
        if len(terms) >= len(sizes) and sizes[-1] < DEPENDENT * sizes[0]:
            names = np.array(form.law(form.known).terms)[unknowns % l]
            raise ValueError(
                "library: its terms must not depend on each other, got "
                + ", ".join(dict.fromkeys(names[np.abs(shares[-1]) > INVOLVED]))
            )


def _smoothed(
    trajectories: Sequence[Trajectory], rng: np.random.Generator, penalties: Floats
) -> tuple[list[tuple[int, Trajectory]], Sequence[BSpline], Floats]:
    """Stretches between gaps, their smoothing splines and the noise; time in typical steps.

    Where the data pause is a gap or not depending on how fast the target moves, which a first
    smoothing tells; if there are other gaps, a second one respects them. A coordinate that is
    seen less often than others pauses later.
    """
    steps = typical_steps(trajectories)
    first = _stretches(trajectories, 5.0 * steps)
    smoothed = smooth([piece for _, piece in first], rng, penalties)
    longest = np.maximum(2.5 * steps, GAP / _rms_speed(smoothed.splines))
    stretches = _stretches(trajectories, longest)
    if [len(t) for _, (t, _) in stretches] != [len(t) for _, (t, _) in first]:
        smoothed = smooth([piece for _, piece in stretches], rng, penalties)
    return stretches, smoothed.splines, smoothed.noise


def _stretches(
    trajectories: Sequence[Trajectory], longest_step: Floats
) -> list[tuple[int, Trajectory]]:
    pieces = [
        (i, piece) for i, whole in enumerate(trajectories) for piece in cut(whole, longest_step)
    ]
    longest = max(len(t) for _, (t, _) in pieces)
    if longest < 2:
        raise ValueError("x: must hold all coordinates at about the same times, got none")
    return [piece for piece in pieces if len(piece[1][0]) >= min(SHORTEST_STRETCH, longest)]


def _rms_speed(splines: Sequence[BSpline]) -> float:
    slopes = [spline.derivative()(spline.t[DEGREE:-DEGREE]) for spline in splines]
    return float(np.sqrt((np.concatenate(slopes) ** 2).mean()))


def _slack(problem: Problem) -> Floats:
    collocation = problem.collocation(problem.segments())
    x, slope = collocation.node_states(fit_curves(collocation, problem.curves))
    terms = problem.terms(x)
    misfit = slope - terms @ np.linalg.lstsq(terms, slope, rcond=None)[0]
    slack = np.maximum(np.sqrt((misfit**2).mean(axis=0)), 1e-4)
    searched = problem.form.candidates.any(axis=0)
    return np.where(searched, slack, slack[searched].min())
