"""Fit a spline and a polynomial law together by banded Gauss-Newton steps (paper: Eqs. 8-9, S9).

A cubic B-spline touches four control points, so the normal matrix in the control points is banded
(half-bandwidth 4 d - 1); coefficients and offset border it densely. Banded Cholesky and a Schur
complement make one step linear in the number of samples. The Schur complement is also the
information matrix of the law: a local quadratic model in *all* candidate coefficients, active or
not, with the curve already eliminated.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from .library import monomials, shift_generators
from .selection import RIDGE, equilibrated
from .splines import DEGREE, clamped_knots, local_basis

WIDTH = DEGREE + 1
CLEANEST = 1e-5
"""Least noise, relative to the spread of the data, that the splines are trusted to resolve."""


@dataclass(frozen=True)
class Segment:
    """A stretch of one trajectory of data, with the breakpoints of its spline.

    Parameters
    ----------
    t : ndarray, shape (n,)
    x : ndarray, shape (n, d)
    breakpoints : ndarray, shape (m + 1,)
        Ends of the knot spans.
    trajectory : int
        Which trajectory the stretch is cut from.
    """

    t: np.ndarray
    x: np.ndarray
    breakpoints: np.ndarray
    trajectory: int = 0

    @classmethod
    def even(cls, t: np.ndarray, x: np.ndarray, spacing: float, trajectory: int) -> Segment:
        """A segment with knots at even distances of at most ``spacing``."""
        spans = max(1, int(np.ceil((t[-1] - t[0]) / spacing)))
        return cls(t, x, np.linspace(t[0], t[-1], spans + 1), trajectory)

    def refined(self) -> Segment:
        """The same stretch with every knot span halved."""
        b = self.breakpoints
        return replace(self, breakpoints=np.sort(np.concatenate([b, (b[1:] + b[:-1]) / 2])))


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
    """

    control_points: np.ndarray
    coefficients: np.ndarray
    active: np.ndarray
    offset: np.ndarray
    moving: np.ndarray

    def flat(self) -> np.ndarray:
        """Coefficients, equation by equation, then the offset."""
        return np.concatenate([self.coefficients.T.ravel(), self.offset])

    def free(self) -> np.ndarray:
        """Which entries of `flat` are unknowns."""
        return np.concatenate([self.active.T.ravel(), self.moving])


@dataclass(frozen=True)
class Linearisation:
    """The least-squares problem around a state, with the control points eliminated.

    The objective near the state is ``objective - fall + step' information step - 2 gradient' step``
    for a step in the columns named by ``columns`` (indices into `State.flat`), with the curve that
    goes best with it; ``fall`` is what the curve gains by itself.
    """

    objective: float
    fall: float
    columns: np.ndarray
    information: np.ndarray
    gradient: np.ndarray
    curve_step: np.ndarray
    curve_response: np.ndarray

    def newton(self, damping: float = 0.0) -> tuple[np.ndarray, float]:
        """The best step in the columns, and by how much it promises to lower the objective."""
        if not len(self.columns):
            return self.gradient, self.fall
        matrix, scale = equilibrated(self.information, RIDGE + damping)
        step = scale * np.linalg.solve(matrix, scale * self.gradient)
        return step, float(self.fall + self.gradient @ step)


class Collocation:
    """Data and physics loss on cubic splines, one per segment, sharing one law.

    The collocation nodes are the midpoints of the knot spans and both ends of each segment: one
    equation per control point but for the initial condition. So the law can hold exactly, and the
    physics weight can be raised without limit.

    Parameters
    ----------
    segments : sequence of Segment
        The data.
    exponents : ndarray of int, shape (l, d)
        The library.
    data_weights : ndarray, shape (d,)
        1 / variance of the measurement noise.
    physics_weights : ndarray, shape (d,)
        Weight of the mean-square residual of each equation per sample.
    systematic : ndarray, shape (n, d, k), optional
        Errors that all samples share: they are the curve plus noise plus a sum of these, each
        times an unknown number of mean 0 and variance 1.
    """

    def __init__(
        self,
        segments: Sequence[Segment],
        exponents: np.ndarray,
        data_weights: np.ndarray,
        physics_weights: np.ndarray,
        systematic: np.ndarray | None = None,
    ) -> None:
        self.exponents = exponents
        self.generators = shift_generators(exponents)
        self.d = exponents.shape[1]
        self.segments = list(segments)
        self.knots = [clamped_knots(segment.breakpoints) for segment in self.segments]
        self.starts = np.cumsum([0] + [len(k) - WIDTH for k in self.knots])
        self.r = int(self.starts[-1])
        self.x = np.concatenate([segment.x for segment in self.segments])
        self.systematic = np.empty((*self.x.shape, 0)) if systematic is None else systematic
        self.samples = self._basis([s.t for s in self.segments])
        ends = [segment.breakpoints for segment in self.segments]
        nodes = [np.concatenate([b[:1], (b[1:] + b[:-1]) / 2, b[-1:]]) for b in ends]
        spans = [np.diff(b) for b in ends]
        width = np.concatenate([np.concatenate([w[:1] / 2, w, w[-1:] / 2]) for w in spans])
        self.nodes, self.slopes = self._basis(nodes), self._basis(nodes, order=1)
        self.node_weights = width / width.sum() * len(self.x)
        self._sample_band = _normal_band(self.samples)
        self._weigh(data_weights, physics_weights)

    def weighted(self, data_weights: np.ndarray, physics_weights: np.ndarray) -> Collocation:
        """The same with other weights; what hangs on the knots alone is shared."""
        other = copy(self)
        other._weigh(data_weights, physics_weights)
        return other

    def _weigh(self, data_weights: np.ndarray, physics_weights: np.ndarray) -> None:
        self.data_weights = np.asarray(data_weights, dtype=float)
        self.physics_weights = np.asarray(physics_weights, dtype=float)
        self._data_band = np.zeros((WIDTH * self.d, self.r * self.d))
        self._data_band[:: self.d] = np.kron(self._sample_band, self.data_weights)
        self._shared = self.data_weights[:, None] * self.systematic
        self._shared_information = np.einsum("nik,nil->kl", self._shared, self.systematic)
        self._shared_information += np.eye(self.systematic.shape[-1])

    def _basis(self, times: list[np.ndarray], order: int = 0) -> sparse.csr_array:
        """Basis functions of all segments at the given times of each, shape (times, r)."""
        parts = [local_basis(knots, t, order) for knots, t in zip(self.knots, times, strict=True)]
        first = np.concatenate(
            [first + start for (first, _), start in zip(parts, self.starts[:-1], strict=True)]
        )
        values = np.concatenate([values for _, values in parts])
        return _rows_from(first, values, self.r)

    def splines(self, control_points: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Knots and control points of every segment."""
        return list(zip(self.knots, np.split(control_points, self.starts[1:-1]), strict=True))

    def curve(self, control_points: np.ndarray) -> np.ndarray:
        """The curve at the samples, shape (n, d)."""
        return self.samples @ control_points

    def node_states(self, control_points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The curve and its slope at the collocation nodes, each of shape (k, d)."""
        return self.nodes @ control_points, self.slopes @ control_points

    def data_residual(self, control_points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Curve plus systematic errors minus data, (n, d), and the best sizes of these, (k,)."""
        residual = self.curve(control_points) - self.x
        pull = np.einsum("nik,ni->k", self._shared, residual)
        sizes = -np.linalg.solve(self._shared_information, pull)
        return residual + self.systematic @ sizes, sizes

    def data_loss(self, control_points: np.ndarray) -> float:
        """Weighted sum of squares of the data residual (chi-square), systematic errors included."""
        residual, sizes = self.data_residual(control_points)
        return float((residual**2).sum(axis=0) @ self.data_weights + sizes @ sizes)

    def physics_residual(self, state: State) -> np.ndarray:
        """``dG P - phi(G P - offset) Lambda`` at the nodes, shape (k, d)."""
        x, slope = self.node_states(state.control_points)
        rows = state.active.any(axis=1)
        terms = monomials(x - state.offset, self.exponents[rows])
        return slope - terms @ state.coefficients[rows]

    def objective(self, state: State) -> float:
        """Data loss plus weighted physics loss, in chi-square units."""
        physics = (self.node_weights @ self.physics_residual(state) ** 2) @ self.physics_weights
        return self.data_loss(state.control_points) + float(physics)

    def linearise(self, state: State, columns: np.ndarray, damping: float = 0.0) -> Linearisation:
        """Linearise around a state and eliminate the control points.

        Parameters
        ----------
        state : State
            Where.
        columns : ndarray of int
            Entries of `State.flat` to keep as unknowns, active or not.
        damping : float
            Relative Levenberg-Marquardt damping of the control points.

        Raises
        ------
        scipy.linalg.LinAlgError
            If the banded normal matrix is not positive definite.
        """
        d, r, l = self.d, self.r, len(self.exponents)
        x, slope = self.node_states(state.control_points)
        offset_columns = columns[columns >= d * l] - d * l
        term_columns = columns[columns < d * l]
        terms = monomials(x - state.offset, self.exponents)
        root = np.sqrt(self.node_weights[:, None] * self.physics_weights)
        residual = root * (slope - terms @ state.coefficients)
        # (nodes, equation, coordinate): how the law changes with the state.
        jacobian = root[:, :, None] * (terms @ (self.generators @ state.coefficients)).transpose(
            1, 2, 0
        )
        physics = self._physics_rows(root, jacobian)
        band = self._data_band + _normal_band(physics)
        band[0] += damping * band[0] + 1e-12 * band[0].max()

        # The same in the unknowns of the law: minus the terms in their own equation, and the
        # rates of the law for the offset; the residual comes first.
        size, count = len(columns), len(term_columns)
        shared = slice(1 + size, 1 + size + self.systematic.shape[-1])
        unknowns = np.zeros((len(residual), d, shared.stop))
        unknowns[:, :, 0] = residual
        for j in range(d):
            here = np.flatnonzero(term_columns // l == j)
            unknowns[:, j, 1 + here] = -root[:, j, None] * terms[:, term_columns[here] % l]
        unknowns[:, :, 1 + count : 1 + size] = jacobian[:, :, offset_columns]
        unknowns = unknowns.reshape(-1, shared.stop)
        data_residual, sizes = self.data_residual(state.control_points)
        right = physics.T @ unknowns
        right[:, 0] += (self.samples.T @ (data_residual * self.data_weights)).ravel()
        pull = self.samples.T @ self._shared.reshape(len(self.x), -1)
        right[:, shared] = pull.reshape(r * d, -1)

        factor = cholesky_banded(band, lower=True, overwrite_ab=True, check_finite=False)
        solved = cho_solve_banded((factor, True), right, check_finite=False)
        solved = np.ascontiguousarray(solved)

        # What the curve cannot follow. Its Gram matrix is the Schur complement, without the
        # cancellation between two large matrices that a large physics weight would bring.
        left = unknowns - physics @ solved
        gram = left.T @ left
        solved = solved.reshape(r, d, shared.stop)
        follow = -(self.samples @ solved.reshape(r, -1)).reshape(-1, d, shared.stop)
        follow[:, :, 0] += data_residual
        follow[:, :, shared] += self.systematic
        follow *= np.sqrt(self.data_weights)[:, None]
        follow = follow.reshape(-1, shared.stop)
        gram += follow.T @ follow
        gram[shared, shared] += np.eye(len(sizes))
        gram[0, 0] += sizes @ sizes
        gram[0, shared] += sizes
        gram[shared, 0] += sizes
        # The systematic errors go with the law as is best for the fit, as the curve does.
        response = np.linalg.solve(gram[shared, shared], gram[shared])
        gram = (gram - gram[:, shared] @ response)[: 1 + size, : 1 + size]
        solved = (solved - solved[:, :, shared] @ response)[:, :, : 1 + size]
        objective = float((data_residual**2).sum(axis=0) @ self.data_weights + (residual**2).sum())
        objective += float(sizes @ sizes)
        return Linearisation(
            objective=objective,
            fall=objective - float(gram[0, 0]),
            columns=columns,
            information=gram[1:, 1:],
            gradient=-gram[1:, 0],
            curve_step=-solved[:, :, 0],
            curve_response=-solved[:, :, 1:],
        )

    def _physics_rows(self, root: np.ndarray, jacobian: np.ndarray) -> sparse.csr_array:
        """Jacobian of the weighted physics residual in the control points, (k d, r d)."""
        d = self.d
        values, slopes = (basis.data.reshape(-1, WIDTH) for basis in (self.nodes, self.slopes))
        local = -jacobian[:, :, None, :] * values[:, None, :, None]
        for i in range(d):
            local[:, i, :, i] += root[:, i, None] * slopes
        first = self.nodes.indices.reshape(-1, WIDTH)[:, 0] * d
        return _rows_from(np.repeat(first, d), local.reshape(-1, WIDTH * d), self.r * d)

    @np.errstate(over="ignore", invalid="ignore")  # of steps that go too far, and are refused
    def solve(self, state: State, tolerance: float = 1e-2, max_steps: int = 30) -> State:
        """Minimise the objective over the curve and the free coefficients and offsets.

        Gauss-Newton with step halving, and Levenberg-Marquardt damping where that fails; stops
        when a step promises to lower the objective by less than ``tolerance`` (chi-square units).
        """
        columns = np.flatnonzero(state.free())
        value = self.objective(state)
        damping = 0.0
        for _ in range(max_steps):
            try:
                model = self.linearise(state, columns, damping)
            except LinAlgError:
                damping = max(10 * damping, 1e-8)
                continue
            step, promise = model.newton(damping)
            if damping == 0.0 and promise < tolerance:
                last = _moved(state, model, step, 1.0)
                return last if self.objective(last) < value else state
            for fraction in (1.0, 0.3, 0.1):
                trial = _moved(state, model, step, fraction)
                trial_value = self.objective(trial)
                if trial_value < value:
                    break
            else:
                damping = max(10 * damping, 1e-6)
                if damping > 1e2:
                    break
                continue
            state, value = trial, trial_value
            damping = damping / 10 if damping > 1e-8 else 0.0
        return state


def _rows_from(first: np.ndarray, values: np.ndarray, size: int) -> sparse.csr_array:
    """Sparse rows that each hold consecutive values from a first column on."""
    n, width = values.shape
    columns = first[:, None] + np.arange(width)
    starts = np.arange(0, n * width + 1, width)
    return sparse.csr_array((values.ravel(), columns.ravel(), starts), shape=(n, size))


def _normal_band(rows: sparse.csr_array) -> np.ndarray:
    """Lower banded storage of ``rows' rows``, for rows as `_rows_from` makes them."""
    n, size = rows.shape
    values, columns = rows.data.reshape(n, -1), rows.indices.reshape(n, -1)
    width = values.shape[1]
    band = np.empty((width, size))
    for lag in range(width):
        products = values[:, lag:] * values[:, : width - lag]
        band[lag] = np.bincount(columns[:, : width - lag].ravel(), products.ravel(), minlength=size)
    return band


def _moved(state: State, model: Linearisation, step: np.ndarray, fraction: float) -> State:
    flat = state.flat()
    flat[model.columns] += fraction * step
    l, d = state.coefficients.shape
    return replace(
        state,
        control_points=state.control_points
        + fraction * (model.curve_step + model.curve_response @ step),
        coefficients=flat[: l * d].reshape(d, l).T,
        offset=flat[l * d :],
    )
