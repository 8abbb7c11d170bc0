"""Fit a spline and a polynomial law together by banded Gauss-Newton steps (paper: Eqs. 8-9, S9).

A cubic B-spline touches four control points, so the normal matrix in the control points is banded
(half-bandwidth 4 d - 1); coefficients and offset border it densely. Banded Cholesky and a Schur
complement make one step linear in the number of samples. The Schur complement is also the
information matrix of the law: a local quadratic model in *all* candidate coefficients, active or
not, with the curve already eliminated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from ..arrays import Bools, Floats, Ints
from .bspline import WIDTH, Grid, Segment, normal_band
from .l0 import RIDGE, equilibrated
from .library import Function, law_terms, linearised

#: Least noise, relative to the spread of the data, that the splines are trusted to resolve.
CLEANEST = 1e-5


@dataclass(frozen=True)
class State:
    """A curve and a law.

    Parameters
    ----------
    control_points : ndarray, shape (r, d)
        ``P``; the curve is ``G P``.
    coefficients : ndarray, shape (l, d)
        ``Lambda``, in monomials of ``x - offset``.
    active : ndarray of bool, shape (l, d)
        Terms that may differ from zero.
    offset : ndarray, shape (d,)
        ``Delta``, the origin of the law.
    moving : ndarray of bool, shape (d,)
        Coordinates of the offset that are free.
    shared : ndarray of int, shape (l d,), optional
        Of each coefficient, equation by equation, whose value it has; its own by default.
    """

    control_points: Floats
    coefficients: Floats
    active: Bools
    offset: Floats
    moving: Bools
    shared: Ints | None = None

    def flat(self) -> Floats:
        """Coefficients, equation by equation, then the offset."""
        return np.concatenate([self.coefficients.T.ravel(), self.offset])

    @property
    def sources(self) -> Ints:
        """Of each entry of `flat`, whose value it has."""
        sources = np.arange(self.coefficients.size + len(self.offset))
        if self.shared is not None:
            sources[: len(self.shared)] = self.shared
        return sources

    def free(self) -> Bools:
        """Which entries of `flat` are unknowns: of those that share a value, the first."""
        sources = self.sources
        own = sources == np.arange(len(sources))
        return own & np.concatenate([self.active.T.ravel(), self.moving])

    def whole(self, active: Bools) -> Bools:
        """Terms, (l, d), with all that share a value with one of them."""
        sources = self.sources[: active.size]
        count = np.bincount(sources, active.T.ravel(), active.size)
        return np.asarray(count[sources] > 0).reshape(active.T.shape).T

    def moved(self, control_points: Floats, flat: Floats) -> State:
        """The same terms with another curve and other entries of `flat`."""
        values, offset = np.split(flat[self.sources], [self.coefficients.size])
        coefficients = values.reshape(self.coefficients.T.shape).T
        return replace(
            self, control_points=control_points, coefficients=coefficients, offset=offset
        )

    def of_terms(self, active: Bools) -> State:
        """The same with these terms, those that share a value with them, and no others."""
        active = self.whole(active)
        return replace(self, active=active, coefficients=np.where(active, self.coefficients, 0.0))


class Status(Enum):
    """How a fit ended."""

    CONVERGED = "converged"
    MAX_STEPS = "steps were left over to do"
    STALLED = "no step lowered the objective"


@dataclass(frozen=True)
class Fit:
    """A state, on the data and knots to which it was fitted.

    Parameters
    ----------
    state : State
        The lowest point found.
    collocation : Collocation
        With the weights of the fit.
    status : Status
        Whether the state is a minimum.
    criterion : float
        Objective and penalties, where the fit compares laws (of a candidate that is not refined
        yet, by the quadratic model); else NaN.
    information : ndarray, shape (m, m)
        Of what is free, where the fit has converged; else empty.
    """

    state: State
    collocation: Collocation
    status: Status
    criterion: float = np.nan
    information: Floats = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def splines(self) -> list[BSpline]:
        """The curve, a spline a segment."""
        return self.collocation.grid.splines(self.state.control_points)

    @property
    def residual(self) -> Floats:
        """What it leaves of the data, (n, d); see `Collocation.data_residual`."""
        return self.collocation.data_residual(self.state.control_points)[0]


@dataclass(frozen=True)
class Linearisation:
    """The least-squares problem around a state, with the control points eliminated.

    The objective near the state is ``objective - fall + step' information step - 2 gradient' step``
    for a step in the columns named by ``columns`` (indices into `State.flat`), with the curve that
    goes best with it; ``fall`` is what the curve gains by itself.
    """

    fall: float
    columns: Ints
    information: Floats
    gradient: Floats

    def of(self, columns: Ints) -> Linearisation:
        """The same for some of the columns: the others stay as they are."""
        places = np.searchsorted(self.columns, columns)
        information = self.information[np.ix_(places, places)]
        return Linearisation(self.fall, columns, information, self.gradient[places])

    def newton(self, damping: float = 0.0) -> tuple[Floats, float]:
        """The best step in the columns, and by how much it promises to lower the objective."""
        matrix, scale = equilibrated(self.information, RIDGE + damping)
        step = scale * np.linalg.solve(matrix, scale * self.gradient)
        return step, float(self.fall + self.gradient @ step)


@dataclass(frozen=True)
class WithCurve(Linearisation):
    """A linearisation that knows what the curve does.

    Parameters
    ----------
    response : ndarray, shape (r d, 1 + m + s)
        What the control points do by themselves, with each column, and each systematic error; empty
        where no step is to be taken.
    shared : ndarray, shape (s, 1 + m)
        What the sizes of the systematic errors do by themselves, and with each column.
    gram : ndarray, shape (1 + m + s, 1 + m + s)
        The problem before these sizes were eliminated, without what is known of them.
    sizes : ndarray, shape (s,)
        How large they are in the fit.
    """

    response: Floats
    shared: Floats
    gram: Floats
    sizes: Floats

    def tolerating(self, share: float) -> Linearisation:
        """The same where larger errors are tolerated: ``share`` times the data and physics loss.

        How large the systematic errors are is known as before.
        """
        gram, _ = _without_systematic(share * self.gram, self.sizes)
        return Linearisation(share * self.fall, self.columns, gram[1:, 1:], -gram[1:, 0])

    def without_systematic(self, precision: Floats) -> tuple[Floats, Floats]:
        """The problem, and `shared`, where the systematic errors are 0 with these precisions."""
        return _without_systematic(self.gram, self.sizes, precision)

    def along(self, state: State, step: Floats, fraction: float) -> State:
        """The state after a fraction of a step, with the curve that goes with it."""
        flat = state.flat()
        flat[self.columns] += fraction * step
        moves = np.append(1.0, step)
        change = self.response @ np.append(moves, self.shared @ moves)
        control = state.control_points + fraction * change.reshape(state.control_points.shape)
        return state.moved(control, flat)


@dataclass(frozen=True, eq=False)
class Collocation:
    """Data and physics loss on cubic splines, one per segment, sharing one law.

    There is one equation per control point but for the initial condition (see `Grid`). So the law
    can hold exactly, and the physics weight can be raised without limit.

    Parameters
    ----------
    grid : Grid
        Data, knots and nodes; `Collocation.of` makes it from segments.
    exponents : ndarray of int, shape (l, d + k) or (l, 2 d + k)
        The library; of an implicit law with terms that hold a slope.
    data_weights : ndarray, shape (d,)
        1 / variance of the measurement noise.
    precision : ndarray, shape (n, d)
        Weight of each measurement relative to these: 1 for most, 0 for what was not observed.
    physics_weights : ndarray, shape (d,)
        Weight of the mean-square residual of each equation per sample.
    systematic : ndarray, shape (n, d, k)
        Errors that all samples share: they are the curve plus noise plus a sum of these, each
        times an unknown number of mean 0 and variance 1.
    known : ndarray, shape (l, d)
        Coefficients of the law that are given; those of a `State` come on top.
    functions : tuple of Function, length k
        Of the state, in the units of the fit.
    """

    grid: Grid
    exponents: Ints
    data_weights: Floats
    precision: Floats
    physics_weights: Floats
    systematic: Floats
    known: Floats
    functions: tuple[Function, ...] = ()

    @classmethod
    def of(
        cls,
        segments: Sequence[Segment],
        exponents: Ints,
        data_weights: Floats,
        physics_weights: Floats,
    ) -> Collocation:
        """The problem without systematic errors or known terms; what is NaN was not observed."""
        grid = Grid.of(segments)
        data, physics = (np.asarray(w, dtype=float) for w in (data_weights, physics_weights))
        seen, none = np.isfinite(grid.x).astype(float), np.empty((*grid.x.shape, 0))
        known = np.zeros((len(exponents), grid.x.shape[1]))
        return cls(grid, exponents, data, seen, physics, none, known)

    @property
    def d(self) -> int:
        """Dimension of the state."""
        return self.grid.x.shape[1]

    @property
    def counts(self) -> Ints:
        """How often each coordinate was observed, shape (d,)."""
        return np.count_nonzero(self.precision, axis=0)

    @cached_property
    def sample_weights(self) -> Floats:
        """1 / variance of every measurement, shape (n, d)."""
        return self.precision * self.data_weights

    @cached_property
    def _data_band(self) -> Floats:
        """Normal matrix of the data loss in the control points, in lower banded storage."""
        band = np.zeros((WIDTH * self.d, self.grid.r * self.d))
        for j, weights in enumerate(self.sample_weights.T):
            band[:: self.d, j :: self.d] = normal_band(self.grid.samples, weights)
        return band

    @cached_property
    def _weighted(self) -> sparse.csr_array:
        """All control points to all that was measured, in standard deviations, (n d, r d)."""
        root = np.sqrt(self.sample_weights).reshape(-1, 1)
        return sparse.csr_array(self.grid.measured.multiply(root))

    @cached_property
    def _shared(self) -> tuple[Floats, Floats]:
        """Weighted systematic errors, (n d, k), and the normal matrix of their sizes."""
        flat = self.systematic.reshape(self.grid.x.size, -1)
        weighted = self.sample_weights.reshape(-1, 1) * flat
        return weighted, weighted.T @ flat + np.eye(flat.shape[1])

    def curve(self, control_points: Floats) -> Floats:
        """The curve at the samples, shape (n, d)."""
        return self.grid.samples @ control_points

    def node_states(self, control_points: Floats) -> tuple[Floats, Floats]:
        """The curve and its slope at the collocation nodes, each of shape (k, d)."""
        return self.grid.nodes @ control_points, self.grid.slopes @ control_points

    def data_residual(self, control_points: Floats) -> tuple[Floats, Floats]:
        """Curve plus systematic errors minus data, (n, d), and the best sizes of these, (k,).

        What was not observed has residual 0.
        """
        curve = self.curve(control_points)
        residual = np.where(self.precision > 0, curve - self.grid.x, 0.0)
        weighted, information = self._shared
        sizes = -np.linalg.solve(information, np.einsum("sk,s->k", weighted, residual.ravel()))
        return residual + (self.precision > 0) * (self.systematic @ sizes), sizes

    def data_loss(self, control_points: Floats) -> float:
        """Weighted sum of squares of the data residual (chi-square), systematic errors included."""
        residual, sizes = self.data_residual(control_points)
        return float((residual**2 * self.sample_weights).sum() + sizes @ sizes)

    def physics_residual(self, state: State) -> Floats:
        """``dG P - phi(G P - offset) Lambda`` at the nodes, shape (k, d)."""
        x, slope = self.node_states(state.control_points)
        law = state.coefficients + self.known
        rows = law.any(axis=1)
        exponents, law = self.exponents[rows], law[rows]
        terms, below = law_terms(x - state.offset, self.functions, exponents, law)
        if not (below > 0).all():  # a pole on the path would leave the curve free to jump there
            return np.full_like(slope, np.inf)
        return slope - terms @ law

    @np.errstate(over="ignore", invalid="ignore")  # of steps that go too far, and are refused
    def objective(self, state: State) -> float:
        """Data loss plus weighted physics loss, in chi-square units."""
        squares = self.grid.node_weights @ self.physics_residual(state) ** 2
        return self.data_loss(state.control_points) + float(squares @ self.physics_weights)

    def linearise(
        self, state: State, columns: Ints, damping: float | None = None, part: Bools | None = None
    ) -> WithCurve:
        """Linearise around a state and eliminate the control points.

        Parameters
        ----------
        state : State
            Where.
        columns : ndarray of int
            Entries of `State.flat` to keep as unknowns, active or not.
        damping : float, optional
            Relative Levenberg-Marquardt damping of the control points, if a step is to be taken:
            then what the curve does is kept, which is as large as the data in each column.
        part : ndarray of bool, shape (k,), optional
            Nodes at which all columns once more are unknowns of their own: these come after the
            others, their numbers larger by the size of `State.flat`.

        Raises
        ------
        scipy.linalg.LinAlgError
            If the banded normal matrix is not positive definite.
        """
        physics, unknowns = self._derivatives(state, columns)
        if part is not None:
            own = unknowns[:, 1 : 1 + len(columns)] * part.repeat(self.d)[:, None]
            unknowns = np.insert(unknowns, [1 + len(columns)], own, axis=1)
            columns = np.append(columns, columns + len(state.sources))
        data_residual, sizes = self.data_residual(state.control_points)
        objective = (data_residual**2 * self.sample_weights).sum() + sizes @ sizes
        objective += (unknowns[:, 0] ** 2).sum()
        factor, data = self._factor(physics, damping or 0.0), self._weighted
        misses = np.zeros((*data_residual.shape, unknowns.shape[1]))
        misses[..., 0], misses[..., 1 + len(columns) :] = data_residual, self.systematic
        misses = (np.sqrt(self.sample_weights)[..., None] * misses).reshape(-1, unknowns.shape[1])
        # A few columns at once: of long data, each copy of all of them is large.
        response, once = [], min(16, 1 + 3_000_000 // len(unknowns))
        for first in range(0, unknowns.shape[1], once):
            some = slice(first, first + once)
            pull = physics.T @ unknowns[:, some]
            if misses[:, some].any():
                pull += data.T @ misses[:, some]
            moves = -cho_solve_banded((factor, True), pull, True, False)
            unknowns[:, some] += physics @ moves
            misses[:, some] += data @ moves
            response += [moves] * (damping is not None)
        # The Gram matrix of what the curve cannot follow is the Schur complement, without the
        # cancellation between two large matrices that a large physics weight would bring.
        whole = unknowns.T @ unknowns + misses.T @ misses
        gram, shared = _without_systematic(whole, sizes)
        return WithCurve(
            fall=float(objective - gram[0, 0]),
            columns=columns,
            information=gram[1:, 1:],
            gradient=-gram[1:, 0],
            response=np.hstack(response or [np.empty((0, 0))]),
            shared=shared,
            gram=whole,
            sizes=sizes,
        )

    def _factor(self, physics: sparse.csr_array, damping: float = 0.0) -> Floats:
        """Cholesky factor of the normal matrix of the control points, in lower banded storage."""
        band = self._data_band + normal_band(physics, alike=self.d)
        # What rounding does to a factor: less could leave it without a root, more would hold the
        # curve back.
        band[0] += damping * band[0] + 1e-14 * band[0].max()
        return cholesky_banded(band, lower=True, overwrite_ab=True, check_finite=False)

    def factor(self, state: State) -> tuple[Floats, sparse.csr_array]:
        """That factor at a state, and the Jacobian of the weighted physics residual, (k d, r d)."""
        physics, _ = self._derivatives(state, np.array([], dtype=int))
        return self._factor(physics), physics

    def _derivatives(self, state: State, columns: Ints) -> tuple[sparse.csr_array, Floats]:
        """The weighted physics residual around a state.

        Its Jacobian in the control points, (k d, r d); and, side by side, (k d, 1 + m + s), the
        residual itself, its derivatives in the columns, and zeros for the systematic errors.
        """
        d, l = self.d, len(self.exponents)
        x, slope = self.node_states(state.control_points)
        law = state.coefficients + self.known
        terms, below, jacobian = linearised(x - state.offset, self.functions, self.exponents, law)
        root = np.sqrt(self.grid.node_weights[:, None] * self.physics_weights)
        residual, jacobian = root * (slope - terms @ law), root[:, :, None] * jacobian
        root = root / below
        # Minus the terms in their own equation, and the rates of the law for the offset.
        offset_columns = columns[columns >= d * l] - d * l
        term_columns = columns[columns < d * l]
        size, count = len(columns), len(term_columns)
        unknowns = np.zeros((len(residual), d, 1 + size + self.systematic.shape[-1]))
        unknowns[:, :, 0] = residual
        for j, sources in enumerate(np.split(state.sources[: d * l], d)):
            place, row = np.nonzero(term_columns[:, None] == sources)
            unknowns[:, j, 1 + place] = -root[:, j, None] * terms[:, row]
        unknowns[:, :, 1 + count : 1 + size] = jacobian[:, :, offset_columns]
        return self.grid.physics(root * below, jacobian), unknowns.reshape(-1, unknowns.shape[-1])

    @np.errstate(over="ignore", invalid="ignore")  # of steps that go too far, and are refused
    def solve(self, state: State, tolerance: float = 1e-2, max_steps: int = 30) -> Fit:
        """Minimise the objective over the curve and the free coefficients and offsets.

        Gauss-Newton with step halving, and Levenberg-Marquardt damping where that fails.

        Parameters
        ----------
        state : State
            Where to start; what is not free stays.
        tolerance : float
            The fit has converged when a step promises to lower the objective by less (in
            chi-square units: the square of a step over its standard error).
        max_steps : int
            After so many steps it ends anyway.
        """
        columns = np.flatnonzero(state.free())
        value, damping = self.objective(state), 0.0
        for _ in range(max_steps):
            try:
                model = self.linearise(state, columns, damping)
            except LinAlgError:
                damping = max(10 * damping, 1e-8)
                continue
            step, promise = model.newton(damping)
            if damping == 0.0 and promise < tolerance:
                last = model.along(state, step, 1.0)
                last = last if self.objective(last) < value else state
                return Fit(last, self, Status.CONVERGED, information=model.information)
            for fraction in (1.0, 0.3, 0.1):
                trial = model.along(state, step, fraction)
                trial_value = self.objective(trial)
                if trial_value < value:
                    break
            else:
                damping = max(10 * damping, 1e-6)
                if damping > 1e2:
                    return Fit(state, self, Status.STALLED)
                continue
            state, value = trial, trial_value
            damping = damping / 10 if damping > 1e-8 else 0.0
        return Fit(state, self, Status.MAX_STEPS)


def _without_systematic(
    gram: Floats, sizes: Floats, precision: Floats | float = 1.0
) -> tuple[Floats, Floats]:
    """Eliminate the sizes of the systematic errors, which go with the law as the curve does.

    They have mean 0 and variance 1, or 1 / ``precision``.
    """
    size = len(gram) - len(sizes)
    pull = gram[size:, :size].copy()
    pull[:, 0] += precision * sizes
    shared = -np.linalg.solve(gram[size:, size:] + precision * np.eye(len(sizes)), pull)
    left = gram[:size, :size] + pull.T @ shared
    left[0, 0] += precision * sizes @ sizes
    return left, np.asarray(shared, dtype=float)
