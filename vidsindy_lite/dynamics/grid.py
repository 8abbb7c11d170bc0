"""Splines over several stretches of data: knots, samples, collocation nodes, and their matrices.

The collocation nodes are the midpoints of the knot spans and both ends of each segment: one
equation per control point but for the initial condition.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from ..arrays import Floats, Ints
from .splines import DEGREE, clamped_knots, local_basis

WIDTH = DEGREE + 1


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
    """

    t: Floats
    x: Floats
    breakpoints: Floats
    trajectory: int = 0

    @classmethod
    def even(cls, t: Floats, x: Floats, spacing: float, trajectory: int) -> Segment:
        """A segment with knots at even distances of at most ``spacing``."""
        spans = max(1, int(np.ceil((t[-1] - t[0]) / spacing)))
        return cls(t, x, np.linspace(t[0], t[-1], spans + 1), trajectory)

    def refined(self) -> Segment:
        """The same stretch with every knot span halved."""
        b = self.breakpoints
        return replace(self, breakpoints=np.sort(np.concatenate([b, (b[1:] + b[:-1]) / 2])))


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
    node_weights : ndarray, shape (k,)
        Share of each node in the physics loss; they sum to n.
    sample_band : ndarray, shape (4, r)
        ``G' G`` in lower banded storage.
    """

    segments: tuple[Segment, ...]
    knots: tuple[Floats, ...]
    starts: Ints
    x: Floats
    samples: sparse.csr_array
    nodes: sparse.csr_array
    slopes: sparse.csr_array
    node_weights: Floats
    sample_band: Floats

    @classmethod
    def of(cls, segments: Sequence[Segment]) -> Grid:
        """The grid of these segments."""
        knots = tuple(clamped_knots(segment.breakpoints) for segment in segments)
        starts = np.cumsum([0] + [len(k) - WIDTH for k in knots])
        ends = [segment.breakpoints for segment in segments]
        nodes = [np.concatenate([b[:1], (b[1:] + b[:-1]) / 2, b[-1:]]) for b in ends]
        spans = [np.diff(b) for b in ends]
        width = np.concatenate([np.concatenate([w[:1] / 2, w, w[-1:] / 2]) for w in spans])
        x = np.concatenate([segment.x for segment in segments])
        samples = _basis(knots, starts, [segment.t for segment in segments])
        return cls(
            segments=tuple(segments),
            knots=knots,
            starts=starts,
            x=x,
            samples=samples,
            nodes=_basis(knots, starts, nodes),
            slopes=_basis(knots, starts, nodes, order=1),
            node_weights=width / width.sum() * len(x),
            sample_band=normal_band(samples),
        )

    @property
    def r(self) -> int:
        """Number of control points."""
        return int(self.starts[-1])


def _basis(
    knots: Sequence[Floats], starts: Ints, times: Sequence[Floats], order: int = 0
) -> sparse.csr_array:
    """Basis functions of all segments at the given times of each, shape (times, r)."""
    parts = [local_basis(k, t, order) for k, t in zip(knots, times, strict=True)]
    first = np.concatenate(
        [first + start for (first, _), start in zip(parts, starts[:-1], strict=True)]
    )
    return rows_from(first, np.concatenate([values for _, values in parts]), int(starts[-1]))


def rows_from(first: Ints, values: Floats, size: int) -> sparse.csr_array:
    """Sparse rows that each hold consecutive values from a first column on."""
    n, width = values.shape
    columns = first[:, None] + np.arange(width)
    starts = np.arange(0, n * width + 1, width)
    return sparse.csr_array((values.ravel(), columns.ravel(), starts), shape=(n, size))


def normal_band(rows: sparse.csr_array) -> Floats:
    """Lower banded storage of ``rows' rows``, for rows as `rows_from` makes them."""
    n, size = rows.shape
    values, columns = rows.data.reshape(n, -1), rows.indices.reshape(n, -1)
    width = values.shape[1]
    band = np.empty((width, size))
    for lag in range(width):
        products = values[:, lag:] * values[:, : width - lag]
        band[lag] = np.bincount(columns[:, : width - lag].ravel(), products.ravel(), minlength=size)
    return band
