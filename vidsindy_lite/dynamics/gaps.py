"""Curves across gaps in the data, by integrating a law from both sides.

A smoothing spline crosses a gap on whatever branch is smooth, not on the one that the motion
took. A law found from the stretches between the gaps tells which.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, CubicHermiteSpline

from ..arrays import Floats
from .integrate import runge_kutta_4
from .polynomials import PolynomialSystem
from .splines import Segment
from .trajectories import Trajectory

Gap = tuple[int, float]
"""A gap is named by its trajectory and the time of the last sample before it."""


def gaps(segments: Sequence[Segment]) -> list[Gap]:
    """The gaps between segments of the same trajectory, shortest first."""
    lengths = {
        (left.trajectory, left.t[-1]): right.t[0] - left.t[-1]
        for left, right in zip(segments[:-1], segments[1:], strict=True)
        if left.trajectory == right.trajectory
    }
    return sorted(lengths, key=lengths.__getitem__)


@dataclass(frozen=True)
class Joined:
    """A curve made of splines, with the gaps between them crossed by a law.

    Parameters
    ----------
    splines : sequence of scipy.interpolate.BSpline
        Pieces in the order of time, with values of shape (d,).
    law : PolynomialSystem
        Integrated forward from the left end and backward from the right end of each gap; the two
        are blended linearly.
    """

    splines: Sequence[BSpline]
    law: PolynomialSystem

    def __call__(self, t: Floats) -> Floats:
        """Evaluate at increasing times, shape (n, d)."""
        values = np.empty((len(t), self.law.d))
        ends = [(spline.t[0], spline.t[-1]) for spline in self.splines]
        for (low, high), spline in zip(ends, self.splines, strict=True):
            inside = (t >= low) & (t <= high)
            values[inside] = spline(t[inside])
        crossed = [(low, high) for (_, low), (high, _) in zip(ends[:-1], ends[1:], strict=True)]
        inside = [(t > low) & (t < high) for low, high in crossed]
        steps = 1 + max(rows.sum() for rows in inside)
        forward, backward = self._crossings(np.array(crossed), steps)
        for (low, high), rows, left, right in zip(crossed, inside, forward, backward, strict=True):
            share = (t[rows] - low) / (high - low)
            values[rows] = (1 - share[:, None]) * left(share) + share[:, None] * right(1 - share)
        return values

    def _crossings(
        self, crossed: Floats, steps: int
    ) -> tuple[list[CubicHermiteSpline], list[CubicHermiteSpline]]:
        """Each gap from its left and from its right end, as functions of the share covered."""
        x0 = np.array(
            [spline(low) for spline, (low, _) in zip(self.splines[:-1], crossed, strict=True)]
            + [spline(high) for spline, (_, high) in zip(self.splines[1:], crossed, strict=True)]
        )
        length = np.diff(crossed)
        pace = np.concatenate([length, -length])
        share = np.linspace(0, 1, steps + 1)

        def rate(x: Floats) -> Floats:
            return pace * self.law(x)

        with np.errstate(over="ignore", invalid="ignore"):
            paths = runge_kutta_4(rate, share, x0, substeps=1)
            slopes = np.array([rate(x) for x in paths])
        # Where the law blows up the curve stays at the end: the fit will refuse the bridge.
        lost = ~(np.isfinite(paths) & np.isfinite(slopes)).all(axis=(0, 2))
        paths[:, lost], slopes[:, lost] = x0[lost], 0.0
        curves = [CubicHermiteSpline(share, paths[:, i], slopes[:, i]) for i in range(len(x0))]
        return curves[: len(crossed)], curves[len(crossed) :]


def join(
    segments: Sequence[Segment],
    splines: Sequence[BSpline],
    bridged: Sequence[Gap],
    trajectories: Sequence[Trajectory],
    law: PolynomialSystem,
    spacing: float,
) -> tuple[list[Segment], list[BSpline | Joined]]:
    """Join segments across the named gaps.

    Parameters
    ----------
    segments, splines
        The present pieces and their fitted curves.
    bridged : sequence of Gap
        Which gaps to cross.
    trajectories : sequence of Trajectory
        All data, including samples that were too few to make a segment of their own.
    law : PolynomialSystem
        The law, in the frame of the trajectories.
    spacing : float
        Length of a knot span.

    Returns
    -------
    segments : list of Segment
    curves : list of callable
        A first curve for each of them.
    """
    groups: list[list[int]] = []
    for i, segment in enumerate(segments):
        left = segments[i - 1]
        if i and left.trajectory == segment.trajectory and (left.trajectory, left.t[-1]) in bridged:
            groups[-1].append(i)
        else:
            groups.append([i])
    joined, curves = [], []
    for group in groups:
        first, last = segments[group[0]], segments[group[-1]]
        if len(group) == 1:
            joined.append(first)
            curves.append(splines[group[0]])
            continue
        t, x = trajectories[first.trajectory]
        inside = (t >= first.t[0]) & (t <= last.t[-1])
        joined.append(Segment.even(t[inside], x[inside], spacing, first.trajectory))
        curves.append(Joined([splines[i] for i in group], law))
    return joined, curves
