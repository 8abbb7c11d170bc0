"""The problem that a discovery solves: the data in standard units, and what is known before a law.

In standard units every coordinate has mean 0 and variance 1, and time runs so that the
root-mean-square speed is 1. `pose` makes it from data: units, gaps, the noise, penalties, and first
guesses of the states that nobody has measured.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.special import chdtri

from ..arrays import Bools, Floats, Ints
from .bspline import DEGREE, PENALTIES, WIDTH, Grid, Segment, basis, normal_band, smooth
from .collocation import CLEANEST, Collocation, Fit, State, Status, WithCurve
from .data import Trajectory, Units, cut, typical_step, typical_steps
from .l0 import LEAST
from .library import Function, extended, jumps, law_terms, monomials
from .model import Form, PolynomialSystem

#: Chance of a false term in a law, if all candidates were independent: where random laws have about
#: the fewest wrong terms (notebook 04b).
FALSE_ALARM = 0.02
#: The same where samples share errors, which look like evidence for small terms, and elsewhere for
#: a law that is not to be doubted: a term that is only worth the penalty above is told.
SURE = 0.004
#: Samples a turn from which on a curve tells the noise to a tenth, and kicks from a drive.
COARSE = 20


@dataclass(frozen=True, eq=False)
class Problem:
    """One discovery's data and penalties; all but ``measured`` in standard units.

    Parameters
    ----------
    measured : list of Trajectory
        The data in the user's units.
    trajectories : list of Trajectory
        The same in standard units.
    stretches : list of (int, Trajectory)
        The data between gaps, each with the number of its trajectory.
    curves : list of callable
        Each stretch smoothed, without a law: from times (n,) to states (n, d).
    precision : ndarray, shape (n, d)
        Weight of each measurement of all stretches relative to ``noise ** -2``; 0 where it was not
        observed.
    systematic : ndarray, shape (n, d, k)
        Errors that all samples share, without what grows with the place.
    pulls : ndarray, shape (d, d, k)
        By how much they grow with it.
    units : Units
    noise : ndarray, shape (d,)
        Noise of the data as the smoothing estimates it.
    form : Form
        Which terms the law may have, and which it has.
    penalties : ndarray, shape (l,)
        Penalty of a term; see `term_penalties`.
    slack : ndarray, shape (d,)
        Misfit of a plain regression on the smoothed curves: the scale of physics weights.
    process_noise : ndarray, shape (d,)
        What random kicks leave of each equation, root mean square over a sample; zero for a law
        that holds exactly.
    unsure : ndarray, shape (k, 2)
        Times between which an input jumps, nobody knows when; no law is asked for there.
    measured_errors : bool
        Whether noise and precision are given by the user, and not to be estimated.
    """

    measured: list[Trajectory]
    trajectories: list[Trajectory]
    stretches: list[tuple[int, Trajectory]]
    curves: Sequence[Callable[[Floats], Floats]]
    precision: Floats
    systematic: Floats
    pulls: Floats
    units: Units
    noise: Floats
    form: Form
    penalties: Floats
    slack: Floats
    process_noise: Floats
    unsure: Floats
    measured_errors: bool = False

    @property
    def d(self) -> int:
        """Dimension of the state."""
        return len(self.form.names)

    @property
    def exponents(self) -> Ints:
        """The library, shape (l, d + k)."""
        return self.form.exponents

    @cached_property
    def functions(self) -> tuple[Function, ...]:
        """Those of the library, of standard points."""

        def standard(function: Function, size: float) -> Function:
            return replace(function, value=lambda x: function.value(self.units.point(x)) / size)

        return tuple(map(standard, self.form.functions, self.units.sizes.tolist()))

    def terms(self, x: Floats) -> Floats:
        """All candidate terms at standard points, (n, l); those with a slope are 0."""
        return law_terms(x, self.functions, self.exponents, np.zeros(self.known.shape))[0]

    @property
    def known(self) -> Floats:
        """Coefficients that are given, shape (l, d)."""
        return self.form.known / self.units.factors(self.exponents)

    @property
    def entry_penalties(self) -> Floats:
        """The penalties of all terms, equation by equation, shape (l d,)."""
        return np.tile(self.penalties, self.d)

    @property
    def cautious(self) -> Problem:
        """The same at the penalties of `SURE`, at which a law is compared with its rivals."""
        equations = self.measured[0][1].shape[1]
        return replace(self, penalties=term_penalties(self.exponents, equations, SURE))

    def costs(self, columns: Ints) -> Floats:
        """Penalties of entries of `State.flat` in a search in which no axis is dropped."""
        return np.append(self.entry_penalties, np.full(self.d, -np.inf))[columns]

    def columns(self, state: State) -> Ints:
        """Entries of `State.flat` that may differ from zero: candidates and moving axes."""
        size = self.form.candidates.size
        return np.concatenate([self.form.searched, size + np.flatnonzero(state.moving)])

    def model(self, fit: Fit) -> WithCurve:
        """The quadratic model around a fit, in all candidates and moving axes."""
        return fit.collocation.linearise(fit.state, self.columns(fit.state))

    @property
    def origin(self) -> Floats:
        """The origin of the data's frame, shape (d,)."""
        timeless = np.arange(self.d) < self.form.states  # functions of the time have their own
        return np.where(timeless, self.units.standard(np.zeros(self.d)), 0.0)

    @cached_property
    def box(self) -> tuple[Floats, Floats]:
        """Corners of the box in which a law has its origin, each (d,).

        It holds the data and their origin, and a spread more: a motion need not pass its centre.
        """
        movable, given = self.form.movable, self.origin
        x = np.vstack([given, *(values for _, (_, values) in self.stretches)])
        low, high = np.nanmin(x, axis=0) - 1.0, np.nanmax(x, axis=0) + 1.0
        return np.where(movable, low, given), np.where(movable, high, given)

    @property
    def axis_penalty(self) -> float:
        """Penalty of an axis along which the law's origin is not that of the data.

        Less than that of a constant term: of two laws alike, the one with fewer terms wins.
        """
        return float(0.95 * self.penalties[0])

    @property
    def turns(self) -> float:
        """Turns of the motion that the data cover."""
        return float(sum(t[-1] - t[0] for t, _ in self.trajectories) / (2 * np.pi))

    @property
    def samples_a_turn(self) -> float:
        """Samples of a turn of the motion; infinite where nothing turns."""
        samples = sum(len(t) for t, _ in self.trajectories)
        return samples / self.turns if self.turns else np.inf

    @cached_property
    def spacing(self) -> float:
        """Length of a knot span, in time scales: wide where the noise is.

        A motion that rests most of the time is much faster than its mean speed tells while it
        moves, which few samples show: then spans are as much shorter, but for a single sample.
        """
        usual = 1 / 5 if self.noise.max() > 0.02 else 1 / 16
        moves = np.nan_to_num(self.smoothed(1e-3) - self.smoothed(-1e-3))
        squares = (moves**2).sum(axis=1)
        # Speed, root mean square, along the way over that of all the time.
        rush = float(np.sqrt((squares**2).mean()) / max(squares.mean(), LEAST))
        return min(usual, max(usual * 4 / rush, typical_step(self.trajectories)))

    def part(self, enough: int = 5_000) -> Problem:
        """The same on pieces of its samples, evenly chosen; or itself.

        Long data show in a part, of ``enough`` samples or a few more, what their law is. A piece
        is a whole stretch or ten turns of the motion; a part of less than two of these is none.
        """
        length = int(min(max(enough / 10, 10 * self.samples_a_turn), enough))
        samples = np.arange(len(self.precision))
        each = np.split(samples, np.cumsum([len(t) for _, (t, _) in self.stretches])[:-1])
        pieces = [
            ((i, (t[k : k + length], x[k : k + length])), curve, rows[k : k + length])
            for (i, (t, x)), curve, rows in zip(self.stretches, self.curves, each, strict=True)
            for k in range(0, max(len(t) - length // 2, 1), length)
        ]
        apart = len(samples) // enough
        if apart < 2 or len(pieces) < 2 * apart:
            return self
        stretches, curves, kept = zip(*pieces[::apart], strict=True)
        rows = np.concatenate(kept)
        return replace(
            self, stretches=list(stretches), curves=curves, precision=self.precision[rows],
            systematic=self.systematic[rows],
        )  # fmt: skip

    def segments(self) -> list[Segment]:
        """The stretches with their first knots."""
        return [Segment.even(t, x, self.spacing, i, self.jumps[i]) for i, (t, x) in self.stretches]

    @cached_property
    def jumps(self) -> list[Floats]:
        """Times at which an input of the law jumps, of each trajectory: there its slope does."""
        found = []
        for t, _ in self.measured:
            beside = 1e-11 * (t[-1] - t[0]) * np.array([-1, 1])  # also one that it begins with
            times = np.concatenate([t[:1] + beside[0], t, t[-1:] + beside[1]])
            every = [
                jumps(partial(f.at, d=self.d), times) for f in self.form.functions if f.of_time
            ]
            found.append(np.unique(np.concatenate([np.zeros(0), *every])) / self.units.time)
        return found

    def collocation(self, segments: Sequence[Segment], noise: Floats | None = None) -> Collocation:
        """Data and physics loss on segments, one a stretch; by default for the problem's noise."""
        shared = self._shared_at(self.smoothed())
        weights = (self.noise if noise is None else noise) ** -2
        return Collocation(
            Grid.of(segments), self.exponents, weights, self.precision, np.ones(self.d), shared,
            self.known, self.functions,
        )  # fmt: skip

    def along(self, collocation: Collocation, state: State) -> Collocation:
        """The same with shared errors as the curve of a state has them: where that is, no noise."""
        curve = collocation.curve(state.control_points)
        return replace(collocation, systematic=self._shared_at(curve))

    def _shared_at(self, places: Floats) -> Floats:
        """The errors that all samples share, where they are at these places."""
        return self.systematic + np.einsum("ni,ijk->njk", places, self.pulls)

    def smoothed(self, later: float = 0.0) -> Floats:
        """The curves at all samples, (n, d), or so much later."""
        pairs = zip(self.curves, self.stretches, strict=True)
        return np.concatenate([curve(t + later) for curve, (_, (t, _)) in pairs])

    def weighted(self, collocation: Collocation, weight: float) -> Collocation:
        """The same with another physics weight, relative to the slack, as far as kicks allow."""
        physics = 1.0 / np.maximum(self.slack**2 / weight, self.process_noise**2)
        return replace(collocation, physics_weights=physics)

    @property
    def has_process_noise(self) -> bool:
        """Whether the law holds but for random kicks."""
        return bool(self.process_noise.any())

    def criterion(self, collocation: Collocation, state: State) -> float:
        """What a discovery minimises: the objective and the penalties of terms and axes."""
        return collocation.objective(state) + self.penalty(state)

    def penalty(self, state: State) -> float:
        """The penalties of the terms and axes of a law."""
        terms = self.entry_penalties @ state.free()[: len(self.entry_penalties)]
        return float(terms + self.axis_penalty * state.moving.sum())

    def law(self, state: State) -> PolynomialSystem:
        """The law of a state in its own frame."""
        return replace(self.form, functions=self.functions).law(state.coefficients + self.known)


def fit_curves(collocation: Collocation, curves: Sequence[Callable[[Floats], Floats]]) -> Floats:
    """Control points, (r, d), of the splines closest to the given curves, one a segment."""
    control = []
    for segment, curve in zip(collocation.grid.segments, curves, strict=True):
        dense = segment.refined(4).breakpoints
        # scipy's least squares looks each point up among all knots: long data take minutes.
        rows = basis([segment.knots], np.array([0, len(segment.knots) - WIDTH]), [dense])
        factor = cholesky_banded(normal_band(rows), lower=True)
        control.append(cho_solve_banded((factor, True), rows.T @ curve(dense)))
    return np.concatenate(control)


def term_penalties(
    exponents: Ints, equations: int | None = None, false_alarm: float = FALSE_ALARM
) -> Floats:
    """Penalty of a term of each kind: how much of the chi-square it has to explain, shape (l,).

    Half of the chance of a false alarm goes to the constants, half of the rest to the linear
    terms, and so on; the terms of one degree in all equations share evenly (Bonferroni). So a term
    has to be significant among all that could have been, and of two laws that fit alike the one of
    lower degree wins. All equations are searched unless their number is given.
    """
    degrees = exponents.sum(axis=1)
    equations = exponents.shape[1] if equations is None else equations
    rivals = equations * np.bincount(degrees)[degrees] * 2.0 ** (degrees + 1)
    return chdtri(1, false_alarm / rivals)


def typical(noise: Floats) -> float:
    """One number for the errors of all coordinates: their geometric mean."""
    return float(np.exp(np.log(noise).mean()))


def spread_to_unseen(noise: Floats, seen: Bools) -> Floats:
    """The errors of the coordinates that were observed, their geometric mean for the others."""
    filled = np.full(len(seen), typical(np.maximum(noise, CLEANEST)))
    filled[seen] = noise
    return filled


# --------------------------------------------------------------------------------------------------
# Penalty continuation: fits while the physics weight rises.

#: Physics weights of a search, relative to the misfit of a plain regression. At the last alone some
#: fits creep; with one between no law more is found, of 96 flows with errors and 111 of ODEBench.
WEIGHTS = (1e2, 1e8)
FINAL_WEIGHT = WEIGHTS[-1]  #: Weight at which the law holds exactly for all that the data can tell.


def unpruned(problem: Problem, rows: Bools) -> Fit:
    """Fit all terms of some rows of the library, (l,), while the physics weight rises.

    Many terms that the data hardly tell apart cannot be fitted at a large weight: then the first
    fit that does not converge is the last.
    """
    collocation = problem.collocation(problem.segments())
    control = fit_curves(collocation, problem.curves)
    x, slope = collocation.node_states(control)
    coefficients, terms = np.zeros(problem.known.shape), problem.terms(x)
    left = slope - terms @ problem.known
    coefficients[rows] = np.linalg.lstsq(terms[:, rows], left, rcond=problem.noise.min())[0]
    active = rows[:, None] & problem.form.candidates
    coefficients[~active] = 0.0
    still, shared = np.zeros(problem.d, dtype=bool), problem.form.shared
    state = State(control, coefficients, active, np.zeros(problem.d), still, shared)
    for weight in (1.0, 1e2):
        fit = problem.weighted(collocation, weight).solve(state, tolerance=1.0, max_steps=15)
        if fit.status is not Status.CONVERGED:
            break
        state = fit.state
    return fit


def leaves_something_over(problem: Problem, fit: Fit, chance: float = 0.1) -> bool:
    """Would the other terms together explain more of the data than chance does?"""
    searched = problem.form.searched
    left_out = len(searched) - int(fit.state.free()[searched].sum())
    if not left_out:
        return False
    _, gain = fit.collocation.linearise(fit.state, searched).newton()
    return bool(gain > chdtri(left_out, chance))


def tightened(problem: Problem, collocation: Collocation, state: State) -> Fit:
    """The fit of a state's terms while the physics weight rises to its last.

    At that weight alone the law holds so exactly that a state far from the minimum creeps.
    """
    for weight in WEIGHTS:
        fit = problem.weighted(collocation, weight).solve(state, tolerance=1.0, max_steps=10)
        state = fit.state
    return fit


# --------------------------------------------------------------------------------------------------
# States that nobody has measured: velocities, the time, and what a known equation tells.
#
# They are tied to the others by equations that are known, so that a fit finds them; here they are
# given a curve to begin with.


def with_unseen(
    form: Form, seen: Bools, curves: Sequence[BSpline], units: Units
) -> tuple[list[Callable[[Floats], Floats]], Units]:
    """Curves of all states, also of those that nobody has measured, and their standard units.

    Coordinates that were never seen, each told by an equation that is known: of a seen coordinate
    y with ``y' = g + b u``, with b and g known, it is ``u = (y' - g) / b``. Then velocities, and
    last the time. In standard units what was not measured has a mean of 0.

    Parameters
    ----------
    form : Form
        Which equations are known.
    seen : ndarray of bool, shape (m,)
        Which of all coordinates were seen.
    curves : sequence of BSpline
        These, smoothed, in their own ``units``.
    units : Units

    Raises
    ------
    ValueError
        If no equation tells a coordinate, or the law is of second order.
    """
    m, d = len(seen), len(form.names)
    hidden, moves, timed = np.flatnonzero(~seen), form.states > m, form.states < d
    if hidden.size and moves:
        name = form.names[hidden[0]]
        raise ValueError(f"x: of a law of order 2 every position must be seen, got none of {name}")
    telling = [_telling(form, seen, u) for u in hidden.tolist()]
    measured = np.append(seen, np.zeros(d - m, dtype=bool))

    def whole(curve: BSpline, t: Floats) -> Floats:
        """All states in units of the data."""
        x, slopes = np.zeros((len(t), d)), np.zeros((len(t), m))
        x[:, measured] = units.point(curve(t))
        slopes[:, seen] = curve(t, 1) * units.scale / units.time
        for u, (j, term) in zip(hidden, telling, strict=True):
            known = monomials(x[:, :m], form.exponents[:, :m]) @ form.known[:, j]  # u is still 0
            x[:, u] = (slopes[:, j] - known) / form.known[term, j]
        x[:, m : form.states] = slopes[:, : form.states - m]
        if timed:
            x[:, -1] = t * units.time
        return x

    values = np.concatenate([whole(curve, curve.t[DEGREE:-DEGREE]) for curve in curves])
    centre, scale = np.zeros(d), np.sqrt((values**2).mean(axis=0))
    centre[measured], scale[measured] = units.centre, units.scale
    if timed:  # small numbers, as of large ones rounding takes the slope
        centre[-1], scale[-1] = values[:, -1].mean(), units.time

    def standard(curve: BSpline, t: Floats) -> Floats:
        x = (whole(curve, t) - centre) / scale
        x[:, measured] = curve(t)
        return x

    return [partial(standard, curve) for curve in curves], Units(centre, scale, units.time)


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


# --------------------------------------------------------------------------------------------------
# Poses the problem of a discovery: standard units, gaps, the noise, and the library's units.


def pose(
    measured: list[Trajectory],
    systematic: list[Floats],
    form: Form,
    rng: np.random.Generator,
    sigma: list[Floats] | None = None,
    through: bool = False,
) -> Problem:
    """Pose the problem of a discovery: standard units, gaps, noise, penalties.

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
    inputs = {name: one for f in form.functions for name, one in f.inputs.items()}
    unsure = np.concatenate([np.zeros((0, 2)), *(one.unsure for one in inputs.values())]) / step
    unsure = np.sort(unsure[np.ptp(unsure, axis=1) > 0.5], axis=0)  # others are known well
    penalties = PENALTIES[:1] if through else PENALTIES
    stretches, curves, noise = _smoothed(trajectories, unsure, rng, penalties)
    telling = [len(t) for _, (t, _) in stretches if len(t) >= 4]
    if len(unsure) and sum(telling) < samples / 2:
        raise ValueError(
            "library: an input must jump less often than every few samples, or hold must say what "
            f"it is between its own, got {len(unsure)} jumps of which nobody knows when"
        )
    speed = _rms_speed(curves)
    curves = [BSpline(s.t * speed, s.c, DEGREE, extrapolate=True) for s in curves]
    noise = np.maximum(noise, CLEANEST)
    precision = [np.isfinite(values).astype(float) for _, values in trajectories]
    if sigma is not None:
        errors = [np.maximum(part.compress(seen, axis=1) / scale, CLEANEST) for part in sigma]
        noise = np.nanmedian(np.concatenate(errors), axis=0)
        precision = [np.nan_to_num((noise / part) ** 2) for part in errors]
    rows = [(i, np.searchsorted(trajectories[i][0], t)) for i, (t, _) in stretches]
    modes = [part.compress(seen, axis=1) / scale[:, None] for part in systematic]
    pulls, rest = _shared(trajectories, stretches, modes, [modes[i][at] for i, at in rows])
    d = len(form.names)
    here, units = np.pad(seen, (0, d - len(seen))), Units(centre, scale, step / speed)

    def among(values: Floats, filling: float = np.nan) -> Floats:
        """Values of all states from those of the coordinates that were seen, (n, ...)."""
        every = np.full((len(values), d, *values.shape[2:]), filling)
        every[:, here] = values
        return every

    grown = np.zeros((d, d, pulls.shape[-1]))
    grown[np.ix_(here, here)] = pulls
    every_curve: Sequence[Callable[[Floats], Floats]] = curves
    if not here.all():
        every_curve, units = with_unseen(form, seen, curves, units)
    problem = Problem(
        measured=measured,
        trajectories=[(t * speed, among(values)) for t, values in trajectories],
        stretches=[(i, (t * speed, among(values))) for i, (t, values) in stretches],
        curves=every_curve,
        precision=among(np.concatenate([precision[i][at] for i, at in rows]), 0.0),
        systematic=among(rest, 0.0),
        pulls=grown,
        units=units,
        noise=spread_to_unseen(noise, here),
        form=form,
        penalties=term_penalties(form.exponents, len(seen)),
        slack=np.ones(d),
        process_noise=np.zeros(d),
        unsure=unsure * speed,
        measured_errors=sigma is not None,
    )
    if grown.size:  # there are errors that all samples share, and that do not average out
        problem = problem.cautious
    if form.exponents.shape[1] > len(form.names):
        problem = _with_functions(problem, rng)
    return replace(problem, slack=_slack(problem))


def _shared(
    trajectories: Sequence[Trajectory],
    stretches: Sequence[tuple[int, Trajectory]],
    systematic: Sequence[Floats],
    parts: Sequence[Floats],
) -> tuple[Floats, Floats]:
    """By how much shared errors, (n, d, k), grow with the place, (d, d, k), and smooth remainders.

    The errors are of each trajectory, and ``parts`` of each stretch; the remainders of all
    stretches. Errors of a place are those of a noisy place where they are told at the samples. In a
    fit such errors would explain that very noise, and their sizes grow beyond all measure.
    """
    x, modes = np.concatenate([x for _, x in trajectories]), np.concatenate(list(systematic))
    _, d, k = modes.shape
    rows = np.isfinite(x).all(axis=1)
    places, values = np.insert(x[rows], 0, 1.0, axis=1), modes[rows].reshape(-1, d * max(k, 1))
    if not k or not len(values):
        return np.zeros((d, d, k)), np.concatenate(list(parts))
    pulls = np.asarray(np.linalg.lstsq(places, values)[0][1:], dtype=float).reshape(d, d, k)
    rest = []
    for (_, (t, x)), part in zip(stretches, parts, strict=True):
        left = (part - np.einsum("ni,ijk->njk", x, pulls)).reshape(len(t), -1)
        curve = smooth([(t, left)], np.random.default_rng(0)).splines[0]
        rest.append(curve(t).reshape(-1, d, k))
    return pulls, np.nan_to_num(np.concatenate(rest))


def _with_functions(problem: Problem, rng: np.random.Generator) -> Problem:
    """The same with the functions of the library in units of their own, and checked."""
    x = problem.units.point(problem.smoothed())
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
        if len(terms) >= len(sizes) and sizes[-1] < 1e-10 * sizes[0]:  # as far as rounding tells
            names = np.array(form.law(form.known).terms)[unknowns % l]
            raise ValueError(
                "library: its terms must not be zero or depend on each other on the data, got "
                + ", ".join(dict.fromkeys(names[np.abs(shares[-1]) > 1e-3]))
            )


def _smoothed(
    trajectories: Sequence[Trajectory], unsure: Floats, rng: np.random.Generator, penalties: Floats
) -> tuple[list[tuple[int, Trajectory]], Sequence[BSpline], Floats]:
    """Stretches between gaps, their smoothing splines and the noise; time in typical steps.

    Where the data pause is a gap or not depending on how fast the target moves, which a first
    smoothing tells; if there are other gaps, a second one respects them. A coordinate that is
    seen less often than others pauses later.
    """
    steps = typical_steps(trajectories)
    first = _stretches(trajectories, 5.0 * steps, unsure)
    smoothed = smooth([piece for _, piece in first], rng, penalties)
    # A pause is a gap if it is longer than this share of the time scale of the motion.
    longest = np.maximum(2.5 * steps, 0.4 / _rms_speed(smoothed.splines))
    stretches = _stretches(trajectories, longest, unsure)
    if [len(t) for _, (t, _) in stretches] != [len(t) for _, (t, _) in first]:
        smoothed = smooth([piece for _, piece in stretches], rng, penalties)
    return stretches, smoothed.splines, smoothed.noise


def _stretches(
    trajectories: Sequence[Trajectory], longest_step: Floats, unsure: Floats
) -> list[tuple[int, Trajectory]]:
    pieces = [
        (i, piece)
        for i, whole in enumerate(trajectories)
        for piece in cut(whole, longest_step, unsure)
    ]
    longest = max(len(t) for _, (t, _) in pieces)
    if longest < 2:
        raise ValueError("x: must hold all coordinates at about the same times, got none")
    # Fewer than four samples tell less than their initial conditions cost.
    return [piece for piece in pieces if len(piece[1][0]) >= min(4, longest)]


def _rms_speed(splines: Sequence[BSpline]) -> float:
    slopes = [spline.derivative()(spline.t[DEGREE:-DEGREE]) for spline in splines]
    return float(np.sqrt((np.concatenate(slopes) ** 2).mean()))


def _slack(problem: Problem) -> Floats:
    collocation = problem.collocation(problem.segments())
    x, slope = collocation.node_states(fit_curves(collocation, problem.curves))
    terms = problem.terms(x)
    misfit = slope - terms @ np.linalg.lstsq(terms, slope, rcond=None)[0]
    slack = np.maximum(np.sqrt((misfit**2).mean(axis=0)), 1e-3)
    searched = problem.form.candidates.any(axis=0)
    return np.where(searched, slack, slack[searched].min())
