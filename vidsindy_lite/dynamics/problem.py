"""The problem that a discovery solves: the data in standard units, and what is known before a law.

In standard units every coordinate has mean 0 and variance 1, and time runs so that the
root-mean-square speed is 1. `posing` makes it from data.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.stats import chi2

from ..arrays import Floats, Ints
from .banded import normal_band
from .collocation import Collocation, Fit, WithCurve
from .errors import effective_noise, residual_noise
from .form import Form
from .library import Function, law_variables, monomials
from .polynomials import PolynomialSystem
from .splines import Segment, basis, clamped_knots
from .state import State
from .trajectories import Trajectory
from .units import Units

FALSE_ALARM = 0.02
"""Chance of a false term in a law, if all candidates were independent: where laws of the zoo have
about the fewest wrong terms (`study.price`)."""
SURE = 0.004
"""The same where samples share errors, which look like evidence for small terms, and elsewhere for
a law that is not to be doubted: a term that is only worth the price above is told."""
OFFSET_PENALTY = 0.95
"""Price of a moved axis, in constant terms: of two laws alike, the one with fewer terms wins."""
COARSE = 20
"""Samples a turn from which on a curve tells the noise to a tenth, and kicks from a drive."""
NOISY, WIDE, NARROW = 0.02, 1 / 5, 1 / 16
"""Knot spacing in time scales: wide where the noise is above this, narrow elsewhere."""


@dataclass(frozen=True, eq=False)
class Problem:
    """One discovery's data and prices; all but ``measured`` in standard units.

    Parameters
    ----------
    measured : list of Trajectory
        The data in the user's units.
    trajectories : list of Trajectory
        The same in standard units.
    systematic : list of ndarray, shape (n, d, k)
        Errors that all samples share, for each trajectory.
    precision : list of ndarray, shape (n, d)
        Weight of each measurement relative to ``noise ** -2``, for each trajectory; 0 where it was
        not observed.
    stretches : list of (int, Trajectory)
        The data between gaps, each with the number of its trajectory.
    curves : list of callable
        Each stretch smoothed, without a law: from times (n,) to states (n, d).
    units : Units
    noise : ndarray, shape (d,)
        Noise of the data as the smoothing estimates it.
    form : Form
        Which terms the law may have, and which it has.
    penalties : ndarray, shape (l,)
        Price of a term; see `term_penalties`.
    slack : ndarray, shape (d,)
        Misfit of a plain regression on the smoothed curves: the scale of physics weights.
    process_noise : ndarray, shape (d,)
        What random kicks leave of each equation, root mean square over a sample; zero for a law
        that holds exactly.
    measured_errors : bool
        Whether noise and precision are given by the user, and not to be estimated.
    """

    measured: list[Trajectory]
    trajectories: list[Trajectory]
    systematic: list[Floats]
    precision: list[Floats]
    stretches: list[tuple[int, Trajectory]]
    curves: Sequence[Callable[[Floats], Floats]]
    units: Units
    noise: Floats
    form: Form
    penalties: Floats
    slack: Floats
    process_noise: Floats
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
        centre, scale, sizes = self.units.centre, self.units.scale, self.units.sizes
        return tuple(
            function.standardised(centre, scale, size)
            for function, size in zip(self.form.functions, sizes.tolist(), strict=False)
        )

    def terms(self, x: Floats) -> Floats:
        """All candidate terms at standard points, (n, l); those with a slope are 0."""
        z, _ = law_variables(x, self.functions, self.exponents, np.zeros(self.known.shape))
        return monomials(z, self.exponents)

    @property
    def known(self) -> Floats:
        """Coefficients that are given, shape (l, d)."""
        return self.form.known / self.units.factors(self.exponents)

    @property
    def prices(self) -> Floats:
        """The penalties of all terms, equation by equation, shape (l d,)."""
        return np.tile(self.penalties, self.d)

    @property
    def shared(self) -> bool:
        """Whether there are errors that all samples share, and that do not average out."""
        return any(modes.size for modes in self.systematic)

    @property
    def cautious(self) -> Problem:
        """The same at the prices of `SURE`, at which a law is compared with its rivals."""
        equations = self.measured[0][1].shape[1]
        return replace(self, penalties=term_penalties(self.exponents, equations, SURE))

    def columns(self, state: State) -> Ints:
        """Entries of `State.flat` that may differ from zero: candidates and moving axes."""
        size = self.form.candidates.size
        return np.concatenate([self.form.searched, size + np.flatnonzero(state.moving)])

    def model(self, fit: Fit) -> WithCurve:
        """The quadratic model around a fit, in all candidates and moving axes."""
        return fit.collocation.linearise(fit.state, self.columns(fit.state))

    @property
    def home(self) -> Floats:
        """The origin of the data's frame, shape (d,)."""
        return self.units.standard(np.zeros(self.d))

    @cached_property
    def box(self) -> tuple[Floats, Floats]:
        """Corners of the box of data and home, in which a law has its origin, each (d,)."""
        x = np.concatenate([values for _, (_, values) in self.stretches])
        movable, home = self.form.movable, self.home
        low, high = (
            np.where(movable, extreme(extreme.reduce(x), home), home)
            for extreme in (np.fmin, np.fmax)
        )
        return low, high

    @property
    def axis_penalty(self) -> float:
        """Price of an axis along which the law's origin is not at home."""
        return float(OFFSET_PENALTY * self.penalties[0])

    @property
    def turns(self) -> float:
        """Turns of the motion that the data cover."""
        return float(sum(t[-1] - t[0] for t, _ in self.trajectories) / (2 * np.pi))

    @property
    def samples_a_turn(self) -> float:
        """Samples of a turn of the motion; infinite where nothing turns."""
        samples = sum(len(t) for t, _ in self.trajectories)
        return samples / self.turns if self.turns else np.inf

    @property
    def spacing(self) -> float:
        """Length of a knot span."""
        return WIDE if self.noise.max() > NOISY else NARROW

    def segments(self) -> list[Segment]:
        """The stretches with their first knots."""
        return [Segment.even(t, x, self.spacing, i) for i, (t, x) in self.stretches]

    def collocation(self, segments: Sequence[Segment], noise: Floats | None = None) -> Collocation:
        """Data and physics loss on segments; by default for the noise of the smoothing."""
        shared, precision = (
            np.concatenate([self._at(segment, values) for segment in segments])
            for values in (self.systematic, self.precision)
        )
        weights = (self.noise if noise is None else noise) ** -2
        return Collocation.of(
            segments, self.exponents, weights, np.ones(self.d), shared, precision, self.known,
            self.functions,
        )  # fmt: skip

    def _at(self, segment: Segment, values: Sequence[Floats]) -> Floats:
        """What is given for all samples of each trajectory, at those of a segment."""
        t, _ = self.trajectories[segment.trajectory]
        return values[segment.trajectory][np.searchsorted(t, segment.t)]

    def weighted(self, collocation: Collocation, weight: float) -> Collocation:
        """The same with another physics weight, relative to the slack, as far as kicks allow."""
        physics = 1.0 / np.maximum(self.slack**2 / weight, self.process_noise**2)
        return collocation.weighted(collocation.data_weights, physics)

    @property
    def kicked(self) -> bool:
        """Whether the law holds but for random kicks."""
        return bool(self.process_noise.any())

    def errors(self, fit: Fit) -> Floats:
        """How large the errors of the data are by a fit, (d,), were they independent.

        A curve that may leave its law follows the errors, too: then they are as estimated. Of
        errors that are given only how long they last is estimated.
        """
        if self.kicked:
            return self.noise
        errors = effective_noise(fit)
        return self.noise * errors / residual_noise(fit) if self.measured_errors else errors

    def criterion(self, collocation: Collocation, state: State) -> float:
        """What a discovery minimises: the objective and the penalties of terms and axes."""
        return collocation.objective(state) + self.price(state)

    def price(self, state: State) -> float:
        """The penalties of the terms and axes of a law."""
        terms = self.prices @ state.free()[: len(self.prices)]
        return float(terms + self.axis_penalty * state.moving.sum())

    def law(self, state: State) -> PolynomialSystem:
        """The law of a state in its own frame."""
        coefficients = state.coefficients + self.known
        names, functions = self.form.names, self.functions
        return PolynomialSystem(names, self.exponents, coefficients, functions=functions)


def fit_curves(collocation: Collocation, curves: Sequence[Callable[[Floats], Floats]]) -> Floats:
    """Control points, (r, d), of the splines closest to the given curves, one a segment."""
    control = []
    for segment, curve in zip(collocation.segments, curves, strict=True):
        b = segment.breakpoints
        dense = np.append((b[:-1, None] + np.diff(b)[:, None] * np.arange(4) / 4).ravel(), b[-1])
        rows = basis([clamped_knots(b)], np.array([0, len(b) + 2]), [dense])
        factor = cholesky_banded(normal_band(rows), lower=True)
        control.append(cho_solve_banded((factor, True), rows.T @ curve(dense)))
    return np.concatenate(control)


def term_penalties(
    exponents: Ints, equations: int | None = None, false_alarm: float = FALSE_ALARM
) -> Floats:
    """Price of a term of each kind: how much of the chi-square it has to explain, shape (l,).

    Half of the chance of a false alarm goes to the constants, half of the rest to the linear
    terms, and so on; the terms of one degree in all equations share evenly (Bonferroni). So a term
    has to be significant among all that could have been, and of two laws that fit alike the one of
    lower degree wins. All equations are searched unless their number is given.
    """
    degrees = exponents.sum(axis=1)
    equations = exponents.shape[1] if equations is None else equations
    rivals = equations * np.bincount(degrees)[degrees] * 2.0 ** (degrees + 1)
    return chi2.isf(false_alarm / rivals, df=1)
