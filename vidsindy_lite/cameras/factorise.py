"""Cameras of which nothing is known, far from what they see: lags and path, up to an affine map.

Parallel projections of one path make a matrix of rank three of the centred tracks of all views,
whatever the lenses, where the cameras stand, and which part of their frames was cut out; of rank
two if the path lies in a plane, of rank one on a line. So the lags are those that leave least
beyond the smallest rank that leaves about as little as three, and the path is known but for an
affine map of space. What no such map changes is known: frequencies and dampings of a linear law.

Tomasi and Kanade 1992, IJCV 9 (factorisation).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..arrays import Floats
from .alignment import Curve, Lags, check_clocks
from .models import AffineCamera
from .rig import Rig
from .triangulate import ALIKE, FINE, GROSS

_INSTANTS = 300  # at which lags are compared
_PROMISING = 20  # lags of each view
_TRIED = 10  # of all of them together, to fractions of a frame
_STEPS = 30  # of each such search
_BETTER = 1.25  # times less noise is a reason for one more direction of motion
_MOVES = 5.0  # times what is left by which a target must move, rms, in every view
_COMMON = 0.5  # share of the shortest video that all must show
_NOTE = (
    "nothing is known of the cameras: the path is known but for an affine map, its axes are those "
    "of its spread, largest first; of a linear law frequencies and dampings do not depend on it"
)


class Factorised(NamedTuple):
    """Cameras of one affine frame, when their videos began, and along how many axes it moves."""

    rig: Rig
    lags: Lags
    moving: int


def factorised(
    tracks: Sequence[Floats],
    rig: Rig,
    rates: Floats,
    clocks: Sequence[Floats] | None,
    lags: Floats | None = None,
) -> Factorised | None:
    """Cameras of which nothing is known as affine maps; None if no lags make the views agree.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n_i, 2)
        One per camera, NaN where the target was not seen.
    rig : Rig
        See `Rig.is_measured`; of its cameras the sizes of the images count.
    rates, clocks, lags
        See `align`; lags are found if they are not given.
    """
    ticks = check_clocks(clocks, tracks)
    views = _Views(tuple(map(Curve, tracks, ticks)), ticks[0], rates)
    ranks = range(1, 4)
    found = [
        views.best(rank) if lags is None else (views.left(lags, range(len(tracks)), rank), lags)
        for rank in ranks
    ]
    enough = max(_BETTER * found[-1][0], FINE)
    rank = next(rank for rank, (left, _) in zip(ranks, found, strict=True) if left <= enough)
    left, best = found[rank - 1]
    if not np.isfinite(left):
        return None
    every = views.matrix(best, views.instants, range(len(tracks)))
    every = every[np.isfinite(every).all(axis=1)]
    count, middle = len(tracks), every.mean(axis=0)
    moved = every - middle
    axes = np.linalg.svd(moved, full_matrices=False)[2]
    missed = moved - moved @ axes[:rank].T @ axes[:rank]
    of_views = [
        (part**2).reshape(len(every), count, 2).mean(axis=(0, 2)) for part in (moved, missed)
    ]
    if not (of_views[0] > _MOVES**2 * of_views[1]).all():
        return None
    cameras = [
        AffineCamera.of(
            np.sqrt(count) * axes[:3, 2 * i : 2 * i + 2].T, middle[2 * i : 2 * i + 2],
            camera.image_size,
        )
        for i, camera in enumerate(rig.cameras)
    ]  # fmt: skip
    errors = views.errors(best, rank) if lags is None else np.zeros(count)
    doubts = () if left <= GROSS else (
        f"views agree on one motion but for {left:.2g} pixels of noise: look at the tracks",
    )  # fmt: skip
    told = Lags(best, rates, errors, left, doubts, clocks=() if clocks is None else ticks)
    return Factorised(Rig(tuple(cameras), note=_NOTE), told, rank)


@dataclass(frozen=True, eq=False)
class _Views:
    """All views at the same instants, (n,), as a function of their lags; rates as of `align`."""

    curves: tuple[Curve, ...]
    instants: Floats
    rates: Floats

    def matrix(self, lags: Floats, instants: Floats, places: Sequence[int]) -> Floats:
        """Tracks of some views side by side, (n, 2 m)."""
        frames = [(instants - lags[i]) * self.rates[i] for i in places]
        return np.hstack([self.curves[i].at(at) for i, at in zip(places, frames, strict=True)])

    @cached_property
    def some(self) -> Floats:
        """Instants at which lags are compared."""
        return self.instants[:: -(-len(self.instants) // _INSTANTS)]

    @cached_property
    def lengths(self) -> Floats:
        """Of all videos, in frames of the first."""
        return np.array([np.ptp(curve.clock) + 1 for curve in self.curves]) / self.rates

    @cached_property
    def least(self) -> float:
        """Frames of the first video that all must show."""
        return _COMMON * float(self.lengths.min())

    def left(self, lags: Floats, places: Sequence[int], rank: int) -> float:
        """Noise of the pixels that is left beyond a rank; infinite of too few common frames."""
        matrix = self.matrix(lags, self.some, places)
        seen = matrix[np.isfinite(matrix).all(axis=1)]
        step = np.ptp(self.some) / max(len(self.some) - 1, 1)
        if len(seen) <= matrix.shape[1] or len(seen) * step < self.least:
            return np.inf
        values = np.linalg.eigvalsh(np.cov(seen.T, bias=True))
        return float(np.sqrt(max(values[:-rank].mean(), 0.0)))

    def best(self, rank: int) -> tuple[float, Floats]:
        """What the lags leave beyond a rank that leave least, and those lags.

        Of two views, lags are promising that leave less than their neighbours; of three, these are
        tried together, and further views one by one. Of those that leave about as little, the
        shortest count.
        """
        count = len(self.curves)
        lags = np.zeros(count)
        promising = [self._promising(i, rank) for i in range(1, count)]
        for last in range(3, count + 1):
            tried = []
            for new in product(*promising[:2]) if last == 3 else product(promising[last - 2]):
                lags[last - len(new) : last] = new
                tried.append((self.left(lags, range(last), rank), tuple(lags)))
            starts = [np.array(one) for _, one in sorted(tried)[:_TRIED]]
            found = [self._polished(one, last, rank) for one in starts]
            left = np.array([self.left(one, range(last), rank) for one in found])
            alike = np.flatnonzero(left <= max(ALIKE * left.min(), FINE))
            shortest = min(alike, key=lambda k: np.abs(found[k]).sum())
            lags, least = found[shortest], float(left[shortest])
        return least, lags

    def _promising(self, i: int, rank: int) -> list[float]:
        """Whole lags of a view at which less is left than at their neighbours, the best first."""
        first, last = self.least - self.lengths[i], self.lengths[0] - self.least
        tried = np.arange(np.ceil(first), last + 1)
        lags = np.zeros(len(self.curves))
        left = np.full(len(tried) + 2, np.inf)
        for k, lags[i] in enumerate(tried):
            left[k + 1] = self.left(lags, (0, i), rank)
        lowest = np.flatnonzero((left[1:-1] <= left[:-2]) & (left[1:-1] <= left[2:]))
        return tried[lowest[np.argsort(left[1 + lowest])][:_PROMISING]].tolist()

    def _polished(self, lags: Floats, count: int, rank: int) -> Floats:
        """The lags of so many views, to fractions of a frame, that leave least near by."""

        def beyond(others: Floats) -> Floats:
            return self._beyond(np.concatenate(([0.0], others, lags[count:])), range(count), rank)

        found = least_squares(beyond, lags[1:count], diff_step=1e-3, max_nfev=_STEPS)
        return np.concatenate(([0.0], found.x, lags[count:]))

    def _beyond(self, lags: Floats, places: Sequence[int], rank: int) -> Floats:
        """What is left of every frame beyond a rank, pixels; zero where a view is missing."""
        matrix = self.matrix(lags, self.some, places)
        seen = np.isfinite(matrix).all(axis=1)
        beyond = np.zeros_like(matrix)
        if seen.any():
            centred = matrix[seen] - matrix[seen].mean(axis=0)
            axes = np.linalg.svd(centred, full_matrices=False)[2][:rank]
            beyond[seen] = centred - centred @ axes.T @ axes
        return beyond.ravel()

    def errors(self, lags: Floats, rank: int) -> Floats:
        """Standard errors of the lags, if what is left is independent noise, (m,)."""
        every, step = range(len(lags)), 1e-2
        here = self._beyond(lags, every, rank)
        moves = step * np.eye(len(lags))[1:]
        ends = [[self._beyond(lags + s * move, every, rank) for s in (1, -1)] for move in moves]
        slopes = np.array([(later - sooner) / (2 * step) for later, sooner in ends])
        information = slopes @ slopes.T
        if np.linalg.cond(information) > 1 / np.finfo(float).eps:
            return np.append(0.0, np.full(len(slopes), np.inf))
        variance = (here**2).sum() / max(np.count_nonzero(here) / 2, 1)
        return np.append(0.0, np.sqrt(variance * np.diag(np.linalg.inv(information))))
