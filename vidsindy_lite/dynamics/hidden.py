"""States that nobody has measured: velocities, the time, and what a known equation tells.

They are tied to the others by equations that are known, so that a fit finds them; here they are
given a curve to begin with.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline

from ..arrays import Bools, Floats
from .errors import spread_to_unseen
from .form import Form
from .library import monomials
from .problem import Problem
from .splines import DEGREE
from .units import Units


def with_velocities(problem: Problem, positions: Sequence[BSpline]) -> Problem:
    """The same with velocities as further states: a velocity of zero stays what it is."""
    units = problem.units
    slopes = [spline.derivative()(spline.t[DEGREE:-DEGREE]) for spline in positions]
    rms = np.sqrt((np.concatenate(slopes) ** 2).mean(axis=0))

    def with_velocity(position: BSpline) -> Callable[[Floats], Floats]:
        velocity = position.derivative()
        return lambda t: np.hstack([position(t), velocity(t) / rms])

    curves = [with_velocity(spline) for spline in positions]
    seen = np.repeat([True, False], len(rms))
    return _with_states(problem, curves, rms * units.scale / units.time, seen)


def with_time(problem: Problem) -> Problem:
    """The same with the time as a last state, in time units."""

    def with_clock(curve: Callable[[Floats], Floats]) -> Callable[[Floats], Floats]:
        return lambda t: np.column_stack([curve(t), t])

    curves = [with_clock(curve) for curve in problem.curves]
    seen = np.append(np.ones(len(problem.noise), dtype=bool), False)
    return _with_states(problem, curves, np.array([problem.units.time]), seen)


def with_hidden(problem: Problem, curves: Sequence[BSpline], seen: Bools) -> Problem:
    """The same with coordinates that were never seen, each told by an equation that is known.

    Of a seen coordinate y with ``y' = g + b u``, with b and g known, it is ``u = (y' - g) / b``.

    Parameters
    ----------
    problem : Problem
        Of the coordinates that were seen.
    curves : sequence of BSpline
        These, smoothed.
    seen : ndarray of bool, shape (m,)
        Which of all coordinates they are.

    Raises
    ------
    ValueError
        If no equation tells a coordinate, or the law is of second order.
    """
    form, units, m = problem.form, problem.units, len(seen)
    if form.states > m:
        name = form.names[int(np.argmin(seen))]
        raise ValueError(f"x: of a law of order 2 every position must be seen, got none of {name}")
    telling = [_telling(form, seen, u) for u in np.flatnonzero(~seen).tolist()]

    def with_told(curve: BSpline) -> Callable[[Floats], Floats]:
        slope = curve.derivative()

        def states(t: Floats) -> Floats:
            x, slopes = np.zeros((len(t), m)), np.zeros((len(t), m))
            x[:, seen] = units.point(curve(t))
            slopes[:, seen] = slope(t) * units.scale / units.time
            for u, (j, term) in zip(np.flatnonzero(~seen), telling, strict=True):
                rest = form.known[:, j].copy()
                rest[term] = 0.0
                known = monomials(x, form.exponents[:, :m]) @ rest
                x[:, u] = (slopes[:, j] - known) / form.known[term, j]
            return x

        return states

    told = [with_told(curve) for curve in curves]
    values = [states(c.t[DEGREE:-DEGREE])[:, ~seen] for states, c in zip(told, curves, strict=True)]
    scale = np.sqrt((np.concatenate(values) ** 2).mean(axis=0))
    whole = np.ones(m)
    whole[seen], whole[~seen] = units.scale, scale

    def standard(states: Callable[[Floats], Floats]) -> Callable[[Floats], Floats]:
        return lambda t: states(t) / whole

    return _with_states(problem, [standard(states) for states in told], scale, seen)


def _telling(form: Form, seen: Bools, u: int) -> tuple[int, int]:
    """Which equation tells a coordinate that was never seen, and by which term."""
    m, powers = len(seen), form.exponents
    alone = powers.sum(axis=1) == 1
    for j in np.flatnonzero(seen).tolist():
        given = (form.known[:, j] != 0) & ~form.candidates[:, j].any()
        plain = ~powers[given][:, m:].any() and not powers[given & ~alone][:, :m][:, ~seen].any()
        of_hidden = np.flatnonzero(given & powers[:, :m][:, ~seen].any(axis=1))
        if plain and len(of_hidden) == 1 and powers[of_hidden[0], u] == 1:
            return j, int(of_hidden[0])
    name = form.names[u]
    raise ValueError(
        f"x: a coordinate that was never seen must be told by an equation that is known, as in "
        f"library.where({{{form.names[int(np.argmax(seen))]!r}: {{{name!r}: 1, '...': 0}}}}), "
        f"got none for {name}"
    )


def _with_states(
    problem: Problem, curves: Sequence[Callable[[Floats], Floats]], scale: Floats, seen: Bools
) -> Problem:
    """The same with further states, of curves and scales (k,), which nobody has measured.

    ``seen``, (m + k,), says where the others stand among all; the standard units of the new ones
    have mean 0.
    """
    units = problem.units

    def among(values: Floats, filling: float) -> Floats:
        whole = np.full((len(values), len(seen), *values.shape[2:]), filling)
        whole[:, seen] = values
        return whole

    centres, scales = np.zeros(len(seen)), np.empty(len(seen))
    centres[seen], scales[seen], scales[~seen] = units.centre, units.scale, scale
    return replace(
        problem,
        trajectories=[(t, among(x, np.nan)) for t, x in problem.trajectories],
        systematic=[among(modes, 0.0) for modes in problem.systematic],
        precision=[among(precision, 0.0) for precision in problem.precision],
        stretches=[(i, (t, among(x, np.nan))) for i, (t, x) in problem.stretches],
        curves=curves,
        units=Units(centres, scales, units.time),
        noise=spread_to_unseen(problem.noise, seen),
    )
