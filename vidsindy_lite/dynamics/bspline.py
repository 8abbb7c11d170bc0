"""Clamped cubic B-splines, one a stretch of data, their banded normal matrices, and smoothing.

The curve is ``G P`` (paper: Eq. 7), with ``P`` the control points. A cubic B-spline touches four of
them, so that normal matrices in ``P`` are banded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded

from ..arrays import Floats, Ints

# --------------------------------------------------------------------------------------------------
# Clamped cubic B-splines over stretches of data: knots, samples, collocation nodes, matrices.
#
# In local form (paper: Eq. 3): every point touches four control points. The collocation nodes are
# the midpoints of the knot spans and both ends of each segment: one equation per control point but
# for the initial condition.

DEGREE = 3
WIDTH = DEGREE + 1  #: Control points that a point of the curve depends on.


def clamped_knots(breakpoints: Floats) -> Floats:
    """Knot vector of a clamped cubic spline.

    Parameters
    ----------
    breakpoints : array_like, shape (m + 1,)
        Increasing ends of the m knot spans.

    Returns
    -------
    ndarray, shape (m + 7,)
        The breakpoints with both ends repeated three more times: m + 3 control points.

    Raises
    ------
    ValueError
        If there are fewer than two breakpoints or they do not increase.
    """
    breakpoints = np.asarray(breakpoints, dtype=float)
    if breakpoints.ndim != 1 or len(breakpoints) < 2 or not (np.diff(breakpoints) > 0).all():
        raise ValueError(f"breakpoints: must be at least two increasing numbers, got {breakpoints}")
    return np.concatenate([breakpoints[:1].repeat(3), breakpoints, breakpoints[-1:].repeat(3)])


def local_basis(knots: Floats, t: Floats, order: int = 0) -> tuple[Ints, Floats]:
    """The four basis functions that are not zero at each time, or their derivatives.

    Parameters
    ----------
    knots : ndarray, shape (m + 7,)
        From `clamped_knots`.
    t : ndarray, shape (n,)
        Times within the knots.
    order : int
        Order of the derivative, 0 to 2.

    Returns
    -------
    first : ndarray of int, shape (n,)
        Index of the first control point that matters at each time.
    values : ndarray, shape (n, 4)
        Derivative of that order of the basis functions of control points first .. first + 3.
    """
    low = DEGREE - order
    design = BSpline.design_matrix(t, knots[order : len(knots) - order], low)
    values = design.data.reshape(-1, low + 1)
    first = design.indices.reshape(-1, low + 1)[:, 0].astype(int)
    # The derivative of a basis function is a difference of two of one degree less, each over
    # its width (de Boor).
    for degree in range(low + 1, DEGREE + 1):
        lower = first[:, None] + np.arange(DEGREE + 1 - degree, DEGREE + 1)
        rates = degree * values / (knots[lower + degree] - knots[lower])
        values = np.zeros((len(t), degree + 1))
        values[:, 1:] += rates
        values[:, :-1] -= rates
    return first, values


def design_matrix(knots: Floats, t: Floats, order: int = 0) -> Floats:
    """Dense matrix of shape (n, r): ``G`` for order 0, ``dG/dt`` for order 1; see `local_basis`."""
    return basis([knots], np.array([0, len(knots) - WIDTH]), [t], order).toarray()


@dataclass(frozen=True)
class Segment:
    """A stretch of one trajectory, with the breakpoints of its spline.

    Parameters
    ----------
    t : ndarray, shape (n,)
    x : ndarray, shape (n, d)
    breakpoints : ndarray, shape (m + 1,)
        Ends of the knot spans.
    trajectory : int
        Which trajectory the stretch is cut from.
    kinks : ndarray, shape (k,)
        Breakpoints within at which the slope may jump.
    """

    t: Floats
    x: Floats
    breakpoints: Floats
    trajectory: int = 0
    kinks: Floats = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def even(
        cls, t: Floats, x: Floats, spacing: float, trajectory: int, jumps: Floats | None = None
    ) -> Segment:
        """A segment with knots at even distances of at most ``spacing`` between jumps of a slope.

        ``jumps`` are times, of which those within the segment count, and its ends but for rounding.
        """
        kinks = np.zeros(0) if jumps is None else jumps
        for end in t[[0, -1]]:
            kinks = np.where(np.abs(kinks - end) < 1e-9 * (t[-1] - t[0]), end, kinks)
        kinks = kinks[(kinks >= t[0]) & (kinks <= t[-1])]
        ends = np.unique(np.concatenate([t[:1], kinks, t[-1:]]))
        spans = np.maximum(1, np.ceil(np.diff(ends) / spacing).astype(int))
        pieces = [np.linspace(*piece) for piece in zip(ends[:-1], ends[1:], spans + 1, strict=True)]
        return cls(t, x, np.unique(np.concatenate(pieces)), trajectory, kinks)

    @property
    def pieces(self) -> list[Floats]:
        """The breakpoints between two kinks, with these: there the curve has all derivatives."""
        cuts = np.searchsorted(self.breakpoints, self.kinks)
        ends = np.unique([0, *cuts, len(self.breakpoints) - 1])
        return [self.breakpoints[low : high + 1] for low, high in pairwise(ends.tolist())]

    @property
    def knots(self) -> Floats:
        """The knot vector: a kink is a knot of multiplicity three."""
        within = np.setdiff1d(self.kinks, self.breakpoints[[0, -1]])
        return np.sort(np.concatenate([clamped_knots(self.breakpoints), within.repeat(2)]))

    def refined(self, parts: int) -> Segment:
        """The same stretch with every knot span in so many equal parts."""
        b = self.breakpoints
        inner = b[:-1, None] + np.diff(b)[:, None] * np.arange(parts) / parts
        return replace(self, breakpoints=np.append(inner.ravel(), b[-1]))


@dataclass(frozen=True, eq=False)
class Grid:
    """What the knots of all segments determine.

    Parameters
    ----------
    segments : tuple of Segment
    knots : tuple of ndarray
        Of each segment.
    starts : ndarray of int, shape (segments + 1,)
        First control point of each segment; the last entry is r, the number of all.
    x : ndarray, shape (n, d)
        Data of all segments.
    samples : sparse array, shape (n, r)
        Control points to the curve at the samples: ``G``.
    nodes, slopes : sparse array, shape (k, r)
        The same for the curve and its slope at the collocation nodes.
    node_times, node_weights : ndarray, shape (k,)
        When each node is, and its share in the physics loss; the shares sum to n.
    """

    segments: tuple[Segment, ...]
    knots: tuple[Floats, ...]
    starts: Ints
    x: Floats
    samples: sparse.csr_array
    nodes: sparse.csr_array
    slopes: sparse.csr_array
    node_times: Floats
    node_weights: Floats

    @classmethod
    def of(cls, segments: Sequence[Segment]) -> Grid:
        """The grid of these segments."""
        knots = tuple(segment.knots for segment in segments)
        starts = np.cumsum([0] + [len(k) - WIDTH for k in knots])
        pieces = [[_nodes(b, s.kinks) for b in s.pieces] for s in segments]
        nodes = [np.concatenate([times for times, _ in parts]) for parts in pieces]
        width = np.concatenate([shares for parts in pieces for _, shares in parts])
        x = np.concatenate([segment.x for segment in segments])
        return cls(
            segments=tuple(segments),
            knots=knots,
            starts=starts,
            x=x,
            samples=basis(knots, starts, [segment.t for segment in segments]),
            nodes=basis(knots, starts, nodes),
            slopes=basis(knots, starts, nodes, order=1),
            node_times=np.concatenate(nodes),
            node_weights=width / width.sum() * len(x),
        )

    @cached_property
    def measured(self) -> sparse.csr_array:
        """All control points, one number after the other, to all that was measured, (n d, r d)."""
        return sparse.kron(self.samples, sparse.eye_array(self.x.shape[1]), format="csr")

    @property
    def runs(self) -> Ints:
        """The trajectory to which each node belongs, (k,)."""
        segments = np.searchsorted(self.starts, self.nodes.indices[::WIDTH], side="right") - 1
        return np.array([segment.trajectory for segment in self.segments])[segments]

    def split(self, values: NDArray[Any]) -> list[NDArray[Any]]:
        """What is given for all samples, (n, ...), segment by segment."""
        return np.split(values, np.cumsum([len(segment.t) for segment in self.segments])[:-1])

    @property
    def r(self) -> int:
        """Number of control points."""
        return int(self.starts[-1])

    def physics(self, weights: Floats, jacobian: Floats) -> sparse.csr_array:
        """Jacobian of a weighted physics residual in the control points, (k d, r d).

        From the weights of the slopes at the nodes, (k, d), and what the law makes of the states
        there, weighted, (k, d, d).
        """
        d = self.x.shape[1]
        values, slopes = (part.data.reshape(-1, WIDTH) for part in (self.nodes, self.slopes))
        local = -jacobian[:, :, None, :] * values[:, None, :, None]
        for i in range(d):
            local[:, i, :, i] += weights[:, i, None] * slopes
        first = d * self.nodes.indices[::WIDTH].repeat(d)
        return rows_from(first, local.reshape(len(first), -1), self.r * d)

    def splines(self, control_points: Floats) -> list[BSpline]:
        """The spline of every segment, from the control points of all, (r, d)."""
        parts = np.split(control_points, self.starts[1:-1])
        return [BSpline(k, p, DEGREE) for k, p in zip(self.knots, parts, strict=True)]


def _nodes(b: Floats, kinks: Floats) -> tuple[Floats, Floats]:
    """Collocation nodes of a piece between its breakpoints, and how much of it each stands for."""
    spans = np.diff(b)
    # The law jumps at a kink: on this side of it, what holds is asked a thousandth of a span beside
    # it, more than rounding moves a time.
    low, high = np.isin(b[[0, -1]], kinks) * 1e-3 * spans[[0, -1]]
    nodes = np.concatenate([b[:1] + low, (b[1:] + b[:-1]) / 2, b[-1:] - high])
    return nodes, np.concatenate([spans[:1] / 2, spans, spans[-1:] / 2])


def basis(
    knots: Sequence[Floats], starts: Ints, times: Sequence[Floats], order: int = 0
) -> sparse.csr_array:
    """Basis functions of all segments at the given times of each, shape (times, r)."""
    parts = [local_basis(k, t, order) for k, t in zip(knots, times, strict=True)]
    pairs = zip(parts, starts[:-1], strict=True)
    first = np.concatenate([first + start for (first, _), start in pairs])
    return rows_from(first, np.concatenate([values for _, values in parts]), int(starts[-1]))


def rows_from(first: Ints, values: Floats, size: int) -> sparse.csr_array:
    """Sparse rows that each hold consecutive values from a first column on."""
    n, width = values.shape
    columns = first[:, None] + np.arange(width)
    starts = np.arange(0, n * width + 1, width)
    return sparse.csr_array((values.ravel(), columns.ravel(), starts), shape=(n, size))


# --------------------------------------------------------------------------------------------------
# Normal matrices of splines, in lower banded storage.
#
# A point of a curve touches few control points, so its normal matrix is a narrow band, and so is
# the Cholesky factor of that.


def normal_band(rows: sparse.csr_array, weights: Floats | None = None, alike: int = 1) -> Floats:
    """Lower banded storage of ``rows' W rows``, for rows as `rows_from` makes them.

    ``W`` is diagonal, with weights (n,) of the rows; by default the identity. So many rows one
    after the other as are ``alike`` have the same columns.
    """
    n, size = rows.shape
    values, first = rows.data.reshape(n, -1), rows.indices.reshape(n, -1)[::alike, 0]
    width = values.shape[1]
    # One column of all rows after the other: far quicker than row by row.
    columns = np.ascontiguousarray(values.reshape(-1, alike, width).T)
    weighted = columns if weights is None else columns * weights.reshape(-1, alike).T
    places = first + np.arange(width)[:, None]
    band = np.empty((width, size))
    for lag in range(width):
        products = (weighted[: width - lag] * columns[lag:]).sum(axis=1)
        band[lag] = np.bincount(places[: width - lag].ravel(), products.ravel(), minlength=size)
    return band


# --------------------------------------------------------------------------------------------------
# Cubic smoothing splines with one penalty per coordinate, chosen by cross-validation.
#
# They give the first curve and the estimate of the noise. All stretches of data between gaps share
# one penalty, so that nothing is smoothed across a gap.

PROBES = 24  #: Random vectors with which the trace of the influence matrix is estimated.
#: Of the squared second derivative, in units of the median time step.
PENALTIES = 10.0 ** np.arange(-4, 11.6, 0.5)


@dataclass(frozen=True)
class Smooth:
    """Smoothed stretches of data.

    Parameters
    ----------
    splines : tuple of scipy.interpolate.BSpline
        One per stretch, with values of shape (d,).
    noise : ndarray, shape (d,)
        Estimated standard deviation of the noise of each coordinate.
    """

    splines: tuple[BSpline, ...]
    noise: Floats


def smooth(
    stretches: Sequence[tuple[Floats, Floats]],
    rng: np.random.Generator,
    penalties: Floats = PENALTIES,
) -> Smooth:
    """Smooth stretches of data by generalised cross-validation.

    Minimises ``|G P - x|^2 + penalty |second derivative|^2`` with a knot at every sample; the
    trace of the influence matrix is estimated with random probes (Hutchinson), which keeps the
    cost linear in the number of samples.

    Parameters
    ----------
    stretches : sequence of (t, x)
        Times (n,) and values (n, d) without gaps, n >= 2; NaN where a coordinate was not seen.
    rng : numpy.random.Generator
        For the probes.
    penalties : ndarray, optional
        Among which to choose, rising.
    """
    grid = Grid.of([Segment(t, x, t) for t, x in stretches])
    roughness, signs = _roughness(stretches, grid), rng.choice([-1.0, 1.0], size=len(grid.x))
    control, noise = np.zeros((grid.r, grid.x.shape[1])), np.zeros(grid.x.shape[1])
    patterns, kind = np.unique(np.isfinite(grid.x), axis=1, return_inverse=True)
    for k, seen in enumerate(patterns.T):
        alike, rows = np.flatnonzero(kind == k), np.flatnonzero(seen)
        control[:, alike], noise[alike] = _cross_validated(
            grid.samples[rows], grid.x[np.ix_(rows, alike)], roughness, signs[rows], penalties
        )
    return Smooth(tuple(grid.splines(control)), noise)


def _cross_validated(
    samples: sparse.csr_array, x: Floats, roughness: Floats, signs: Floats, penalties: Floats
) -> tuple[Floats, Floats]:
    """Control points, (r, d), and noise, (d,), of coordinates that were seen at the same times."""
    n, d = x.shape
    sample_band = normal_band(samples)
    # Combs of random signs: exact where the influence of a sample dies out within a comb's pitch.
    probes = np.zeros((n, PROBES))
    probes[np.arange(n), np.arange(n) % PROBES] = signs
    right = samples.T @ np.concatenate([x, probes], axis=1)
    best, noise = np.full(d, np.inf), np.zeros(d)
    control = np.zeros((samples.shape[1], d))
    for penalty in penalties:
        band = sample_band + penalty * roughness
        band[0] += 1e-12 * band[0].max()
        solved = cho_solve_banded((cholesky_banded(band, lower=True), True), right)
        fitted = samples @ solved
        trace = (probes * fitted[:, d:]).sum()
        free = max(n - trace, 1e-9 * n)
        squares = ((x - fitted[:, :d]) ** 2).sum(axis=0)
        score = n * squares / free**2
        better = score < best
        best[better] = score[better]
        control[:, better] = solved[:, :d][:, better]
        # E |K e|^2 = variance tr(K K'), K = I - influence: holds where hardly anything is smoothed.
        noise[better] = np.sqrt(squares[better] / ((probes - fitted[:, d:]) ** 2).sum())
        if (squares > n * best).all():  # and they rise from penalty to penalty: none scores less
            break
    return control, noise


def _roughness(stretches: Sequence[tuple[Floats, Floats]], grid: Grid) -> Floats:
    """Integral of the squared second derivative in the control points, (4, r) in banded storage.

    Times are in units of the median time step. The second derivative is linear between two knots,
    so two Gauss points integrate its square.
    """
    spans = np.concatenate([np.diff(t) for t, _ in stretches])
    total = np.zeros((WIDTH, grid.r))
    for node in (0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12)):
        times = [t[:-1] + node * np.diff(t) for t, _ in stretches]
        bend = basis(grid.knots, grid.starts, times, order=2)
        bend.data *= np.sqrt(spans / 2).repeat(WIDTH)
        total += normal_band(bend)
    return total * np.median(spans) ** 3
