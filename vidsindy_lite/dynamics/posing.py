"""Poses the problem of a discovery: standard units, gaps, the noise, and states that nobody saw."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline

from ..arrays import Floats
from .collocation import CLEANEST
from .errors import spread_to_unseen
from .form import Form
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
        If a coordinate does not move, or there are fewer samples than unknowns; if a function of
        the library is not finite on the data, or its terms depend on each other.
    """
    x = np.concatenate([values for _, values in measured])
    unknowns, samples = len(form.exponents) + 1, int(np.isfinite(x).sum(axis=0).min())
    if samples < unknowns:
        raise ValueError(
            f"x: must hold at least as many samples as unknowns per equation ({unknowns} for this "
            f"library and d = {x.shape[1]}), got {samples} samples"
        )
    centre, scale = np.nanmean(x, axis=0), np.nanstd(x, axis=0)
    if not (scale > 1e-12 * np.abs(centre)).all():
        still = int(np.argmin(scale))
        raise ValueError(f"x: every coordinate must move, got a constant column {still}")
    if not form.movable.any():  # terms are what they are in the frame of the data
        centre = np.zeros_like(centre)
    step = typical_step(measured)
    trajectories = [(t / step, (values - centre) / scale) for t, values in measured]
    stretches, curves, noise = _smoothed(trajectories, rng, PENALTIES[:1] if through else PENALTIES)
    speed = _rms_speed(curves)
    curves = [BSpline(s.t * speed, s.c, DEGREE, extrapolate=True) for s in curves]
    noise = np.maximum(noise, CLEANEST)
    precision = [np.isfinite(values).astype(float) for _, values in measured]
    if sigma is not None:
        errors = [np.maximum(part / scale, CLEANEST) for part in sigma]
        noise = np.nanmedian(np.concatenate(errors), axis=0)
        precision = [np.nan_to_num((noise / part) ** 2) for part in errors]
    problem = Problem(
        measured=measured,
        trajectories=[(t * speed, values) for t, values in trajectories],
        systematic=[modes / scale[:, None] for modes in systematic],
        precision=precision,
        stretches=[(i, (t * speed, values)) for i, (t, values) in stretches],
        curves=curves,
        units=Units(centre, scale, step / speed),
        noise=noise,
        form=form,
        penalties=term_penalties(form.exponents, x.shape[1]),
        slack=np.ones(len(form.names)),
        process_noise=np.zeros(len(form.names)),
        measured_errors=sigma is not None,
    )
    if problem.shared:
        problem = problem.cautious
    if form.states > x.shape[1]:
        problem = _with_velocities(problem, curves)
    if form.states < len(form.names):
        problem = _with_time(problem)
    if form.exponents.shape[1] > len(form.names):
        problem = _with_functions(problem, rng)
    return replace(problem, slack=_slack(problem))


def _with_velocities(problem: Problem, positions: Sequence[BSpline]) -> Problem:
    """The same with velocities as further states: a velocity of zero stays what it is."""
    units = problem.units
    slopes = [spline.derivative()(spline.t[DEGREE:-DEGREE]) for spline in positions]
    rms = np.sqrt((np.concatenate(slopes) ** 2).mean(axis=0))

    def with_velocity(position: BSpline) -> Callable[[Floats], Floats]:
        velocity = position.derivative()
        return lambda t: np.hstack([position(t), velocity(t) / rms])

    curves = [with_velocity(spline) for spline in positions]
    return _with_unseen(problem, curves, rms * units.scale / units.time)


def _with_time(problem: Problem) -> Problem:
    """The same with the time as a further state, in time units."""

    def with_time(curve: Callable[[Floats], Floats]) -> Callable[[Floats], Floats]:
        return lambda t: np.column_stack([curve(t), t])

    curves = [with_time(curve) for curve in problem.curves]
    return _with_unseen(problem, curves, np.array([problem.units.time]))


def _with_unseen(
    problem: Problem, curves: Sequence[Callable[[Floats], Floats]], scale: Floats
) -> Problem:
    """The same with further states, (k,), of curves and scales, which nobody has measured.

    Their standard units have mean 0.
    """
    units, (m,), (k,) = problem.units, problem.noise.shape, scale.shape

    def unseen(values: Floats, filling: float) -> Floats:
        shape = (len(values), k, *values.shape[2:])
        return np.concatenate([values, np.full(shape, filling)], axis=1)

    return replace(
        problem,
        trajectories=[(t, unseen(x, np.nan)) for t, x in problem.trajectories],
        systematic=[unseen(modes, 0.0) for modes in problem.systematic],
        precision=[unseen(precision, 0.0) for precision in problem.precision],
        stretches=[(i, (t, unseen(x, np.nan))) for i, (t, x) in problem.stretches],
        curves=curves,
        units=Units(
            centre=np.append(units.centre, np.zeros(k)),
            scale=np.append(units.scale, scale),
            time=units.time,
        ),
        noise=spread_to_unseen(problem.noise, np.arange(m + k) < m),
    )


def _with_functions(problem: Problem, rng: np.random.Generator) -> Problem:
    """The same with the functions of the library in units of their own, and checked."""
    pieces = zip(problem.curves, problem.stretches, strict=True)
    x = problem.units.point(np.concatenate([curve(t) for curve, (_, (t, _)) in pieces]))
    functions = problem.form.functions
    values = extended(x, functions)[:, problem.d :]
    for function, column in zip(functions, values.T, strict=True):
        if not np.isfinite(column).all():
            where = ", ".join(f"{v:g}" for v in x[np.argmin(np.isfinite(column))])
            raise ValueError(
                f"library: {function.name} must be finite on the data, got none at ({where})"
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
    """Refuse candidates that depend on each other at any points, given as terms (n, l)."""
    searched = form.candidates.any(axis=1) & ~form.implicit
    columns = terms[np.isfinite(terms).all(axis=1)][:, searched]
    columns /= np.maximum(np.linalg.norm(columns, axis=0), LEAST)
    _, sizes, shares = np.linalg.svd(columns, full_matrices=False)
    if len(columns) >= len(sizes) and sizes[-1] < DEPENDENT * sizes[0]:
        names = np.array(form.law(form.known).terms)[searched]
        tied = ", ".join(names[np.abs(shares[-1]) > INVOLVED])
        raise ValueError(f"library: its terms must not depend on each other, got {tied}")


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
