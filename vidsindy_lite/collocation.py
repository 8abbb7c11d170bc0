"""Fit a spline and a polynomial law together by banded Gauss-Newton steps (paper: Eqs. 8-9, S9).

A cubic B-spline touches four control points, so the normal matrix in the control points is banded
(half-bandwidth 4 d - 1); coefficients and offset border it densely. Banded Cholesky and a Schur
complement make one step linear in the number of samples. The Schur complement is also the
information matrix of the law: a local quadratic model in *all* candidate coefficients, active or
not, with the curve already eliminated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from .information import RIDGE, equilibrated
from .polynomials import monomial_gradients, monomials
from .splines import DEGREE, clamped_knots, local_basis

WIDTH = DEGREE + 1
CHUNK = 512
"""Nodes whose local matrices are multiplied in one go."""
CLEANEST = 1e-5
"""Least noise, relative to the spread of the data, that the splines are trusted to resolve."""


@dataclass(frozen=True)
class Segment:
    """A stretch of one record of data, with the breakpoints of its spline.

    Parameters
    ----------
    t : ndarray, shape (n,)
    x : ndarray, shape (n, d)
    breakpoints : ndarray, shape (m + 1,)
        Ends of the knot spans.
    record : int
        Which record the stretch is cut from.
    """

    t: np.ndarray
    x: np.ndarray
    breakpoints: np.ndarray
    record: int = 0

    @classmethod
    def even(cls, t: np.ndarray, x: np.ndarray, spacing: float, record: int) -> Segment:
        """A segment with knots at even distances of at most ``spacing``."""
        spans = max(1, int(np.ceil((t[-1] - t[0]) / spacing)))
        return cls(t, x, np.linspace(t[0], t[-1], spans + 1), record)

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

    The objective near the state is ``objective + step' information step - 2 gradient' step`` for
    a step in the columns named by ``columns`` (indices into `State.flat`).
    """

    objective: float
    columns: np.ndarray
    information: np.ndarray
    gradient: np.ndarray
    curve_step: np.ndarray
    curve_response: np.ndarray


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
    """

    def __init__(
        self,
        segments: Sequence[Segment],
        exponents: np.ndarray,
        data_weights: np.ndarray,
        physics_weights: np.ndarray,
    ) -> None:
        self.exponents = exponents
        self.d = exponents.shape[1]
        self.segments = list(segments)
        self.data_weights = np.asarray(data_weights, dtype=float)
        self.physics_weights = np.asarray(physics_weights, dtype=float)
        self.knots = [clamped_knots(segment.breakpoints) for segment in self.segments]
        self.starts = np.cumsum([0] + [len(k) - WIDTH for k in self.knots])
        self.r = int(self.starts[-1])
        self.x = np.concatenate([segment.x for segment in self.segments])
        self.sample_first, self.sample_values = self._basis([s.t for s in self.segments])
        ends = [segment.breakpoints for segment in self.segments]
        nodes = [
            [(b[1:] + b[:-1]) / 2 for b in ends],
            [b[:1] for b in ends],
            [b[-1:] for b in ends],
        ]
        spans = [
            [np.diff(b) for b in ends],
            [np.diff(b[:2]) / 2 for b in ends],
            [np.diff(b[-2:]) / 2 for b in ends],
        ]
        self.node_first, self.node_values = map(
            np.concatenate, zip(*(self._basis(group) for group in nodes), strict=True)
        )
        self.node_slopes = np.concatenate([self._basis(group, order=1)[1] for group in nodes])
        width = np.concatenate([np.concatenate(group) for group in spans])
        self.node_weights = width / width.sum() * len(self.x)
        edges = np.cumsum([0] + [sum(map(len, group)) for group in nodes])
        # Within a group no two nodes share their first control point, so slices add without clash.
        self.groups = [slice(low, high) for low, high in zip(edges[:-1], edges[1:], strict=True)]
        self._data_band = self._assemble_data_band()

    def _basis(self, times: list[np.ndarray], order: int = 0) -> tuple[np.ndarray, np.ndarray]:
        parts = []
        for knots, start, t in zip(self.knots, self.starts[:-1], times, strict=True):
            first, values = local_basis(knots, t, order)
            parts.append((first + start, values))
        first, values = zip(*parts, strict=True)
        return np.concatenate(first), np.concatenate(values)

    def splines(self, control_points: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Knots and control points of every segment."""
        return list(zip(self.knots, np.split(control_points, self.starts[1:-1]), strict=True))

    def curve(self, control_points: np.ndarray) -> np.ndarray:
        """The curve at the samples, shape (n, d)."""
        return _local(self.sample_values, self.sample_first, control_points)

    def node_states(self, control_points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The curve and its slope at the collocation nodes, each of shape (k, d)."""
        return (
            _local(self.node_values, self.node_first, control_points),
            _local(self.node_slopes, self.node_first, control_points),
        )

    def data_loss(self, control_points: np.ndarray) -> float:
        """Weighted sum of squares of the data residual (chi-square)."""
        residual = self.curve(control_points) - self.x
        return float((residual**2).sum(axis=0) @ self.data_weights)

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
        rows = state.active.any(axis=1)
        offset_columns = columns[columns >= d * l] - d * l
        term_columns = columns[columns < d * l]
        terms = monomials(x - state.offset, self.exponents)
        jacobian = np.einsum(
            "kli,lj->kji",
            monomial_gradients(x - state.offset, self.exponents[rows]),
            state.coefficients[rows],
        )
        root = np.sqrt(self.node_weights[:, None] * self.physics_weights)
        residual = root * (slope - terms[:, rows] @ state.coefficients[rows])

        # Jacobian of the physics residual in the local control points: (nodes, equation, a, i).
        local = -jacobian[:, :, None, :] * self.node_values[:, None, :, None]
        for i in range(d):
            local[:, i, :, i] += self.node_slopes
        local = (local * root[:, :, None, None]).reshape(-1, d, WIDTH * d)
        band = self._data_band + self._scatter_band(local.transpose(0, 2, 1) @ local)
        band[0] += damping * band[0] + 1e-12 * band[0].max()

        # The same in the unknowns of the law: own[j] for the terms of equation j, moved for the
        # offset; and what both leave in the normal equations.
        size, count = len(columns), len(term_columns)
        own = np.zeros((len(residual), d, size))
        for j in range(d):
            here = np.flatnonzero(term_columns // l == j)
            own[:, j, here] = -root[:, j, None] * terms[:, term_columns[here] % l]
        own[:, :, count:] = root[:, :, None] * jacobian[:, :, offset_columns]
        unknowns = np.concatenate([residual[:, :, None], own], axis=2)
        data_residual = self.curve(state.control_points) - self.x
        right = np.zeros((r, d, 1 + size))
        right[:, :, 0] = self._pull(data_residual)
        for part in _chunks(self.groups):
            blocks = local[part].transpose(0, 2, 1) @ unknowns[part]
            blocks = blocks.reshape(-1, WIDTH, d, 1 + size)
            for a in range(WIDTH):
                right[self.node_first[part] + a] += blocks[:, a]

        factor = cholesky_banded(band, lower=True, overwrite_ab=True, check_finite=False)
        solved = cho_solve_banded((factor, True), right.reshape(r * d, -1), check_finite=False)
        solved = np.ascontiguousarray(solved).reshape(r, d, 1 + size)

        # What the curve cannot follow. Its Gram matrix is the Schur complement, without the
        # cancellation between two large matrices that a large physics weight would bring.
        gram = np.zeros((1 + size, 1 + size))
        for part in _chunks(self.groups):
            near = np.stack([solved[self.node_first[part] + a] for a in range(WIDTH)], axis=1)
            left = unknowns[part] - local[part] @ near.reshape(-1, WIDTH * d, 1 + size)
            left = left.reshape(-1, 1 + size)
            gram += left.T @ left
        for part in _chunks([slice(0, len(self.x))]):
            follow = -_local(self.sample_values[part], self.sample_first[part], solved)
            follow[:, :, 0] += data_residual[part]
            follow *= np.sqrt(self.data_weights)[:, None]
            follow = follow.reshape(-1, 1 + size)
            gram += follow.T @ follow
        objective = float((data_residual**2).sum(axis=0) @ self.data_weights + (residual**2).sum())
        return Linearisation(
            objective=objective,
            columns=columns,
            information=gram[1:, 1:],
            gradient=-gram[1:, 0],
            curve_step=-solved[:, :, 0],
            curve_response=-solved[:, :, 1:],
        )

    def solve(self, state: State, tolerance: float = 1e-2, max_steps: int = 30) -> State:
        """Minimise the objective over the curve and the free coefficients and offsets.

        Gauss-Newton with step halving, and Levenberg-Marquardt damping where that fails; stops
        when the objective falls by less than ``tolerance`` (chi-square units).
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
            step = _solved(model.information, model.gradient, damping)
            for fraction in (1.0, 0.3, 0.1):
                trial = _moved(state, model, step, fraction)
                with np.errstate(over="ignore", invalid="ignore"):
                    trial_value = self.objective(trial)
                if trial_value < value:
                    break
            else:
                damping = max(10 * damping, 1e-6)
                if damping > 1e2:
                    break
                continue
            fall, state, value = value - trial_value, trial, trial_value
            damping = damping / 10 if damping > 1e-8 else 0.0
            if fall < tolerance and damping == 0.0:
                break
        return state

    def _assemble_data_band(self) -> np.ndarray:
        products = self.sample_values[:, :, None] * self.sample_values[:, None, :]
        wide = np.zeros((WIDTH * self.d, self.r * self.d))
        for a in range(WIDTH):
            for b in range(a + 1):
                column = np.bincount(self.sample_first + b, products[:, a, b], minlength=self.r)
                wide[(a - b) * self.d] += (column[:, None] * self.data_weights).ravel()
        return wide

    def _pull(self, residual: np.ndarray) -> np.ndarray:
        """Weighted data residual collected at the control points, shape (r, d)."""
        total = np.zeros((self.r, self.d))
        for a in range(WIDTH):
            for i in range(self.d):
                weight = self.sample_values[:, a] * residual[:, i] * self.data_weights[i]
                total[:, i] += np.bincount(self.sample_first + a, weight, minlength=self.r)
        return total

    def _scatter_band(self, blocks: np.ndarray) -> np.ndarray:
        """Add up local normal matrices (k, 4 d, 4 d) in lower banded storage."""
        band = np.zeros((WIDTH * self.d, self.r * self.d))
        for group in self.groups:
            base = self.node_first[group] * self.d
            for p in range(WIDTH * self.d):
                for q in range(p + 1):
                    band[p - q, base + q] += blocks[group, p, q]
        return band


def _chunks(slices: Sequence[slice]) -> Iterator[slice]:
    """Pieces small enough for the processor's cache, which the products then stay in."""
    for whole in slices:
        for low in range(whole.start, whole.stop, CHUNK):
            yield slice(low, min(low + CHUNK, whole.stop))


def _local(values: np.ndarray, first: np.ndarray, control_points: np.ndarray) -> np.ndarray:
    weights = values.reshape(*values.shape, *(1,) * (control_points.ndim - 1))
    return sum(weights[:, a] * control_points[first + a] for a in range(WIDTH))


def _solved(information: np.ndarray, gradient: np.ndarray, damping: float) -> np.ndarray:
    if not len(gradient):
        return gradient
    matrix, scale = equilibrated(information, RIDGE + damping)
    return scale * np.linalg.solve(matrix, scale * gradient)


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
