"""One fit of cameras and lags to what was filmed: how well it agrees, and what it tells of lags.

The errors of lags are those of least squares, but for residuals that depend on their neighbours,
and for slopes that are noise: with a share p of motion in the squares of the slopes they are 1 / p
times as large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats
from .adjust import Adjustment, adjust
from .alignment import Footage
from .camera import Camera
from .causes import GROSS
from .changes import PARTS
from .covariance import fitted_factor
from .triangulate import trimmed

DISAGREEMENT = 1.0
"""Pixels by which a good rig misses at most one frame in ten; even whole-pixel tracks are missed by
less than half of that."""

_BETTER_PART = 0.7  # of all frames, in which no view is an outlier
_APART = 1.0  # frames; lags closer than that are one and the same
_PERSISTENT = 0.5  # correlation of a residual with the next frame's that is no tracker's noise
_CLEAR = 4.0  # standard errors by which a clock must drift, ...
_ENOUGH = 0.05  # ... and frames over the whole video
_LEAST = 1e-6  # share of a slope that is motion
_USED = 0.5  # weight of an instant that holds no outlier
_TIMES = _LAG, _DRIFT = PARTS["lag"].start, PARTS["drift"].start


@dataclass(frozen=True, eq=False)
class Timing:
    """What was fitted, and to what."""

    footage: Footage
    cameras: tuple[Camera, ...]
    fit: Adjustment

    @classmethod
    def of(
        cls,
        footage: Footage,
        cameras: tuple[Camera, ...],
        errors: Floats,
        *,
        begin: Floats | None = None,
        most: int | None = None,
    ) -> Timing | None:
        """None if the views have too little in common."""
        fit = adjust(footage, cameras, errors, begin=begin, most=most)
        told = np.isfinite(fit.misses).any(axis=1).sum()
        return cls(footage, cameras, fit) if 3 * told > np.isinf(errors[:, _TIMES]).sum() else None

    @property
    def lags(self) -> Floats:
        """In frames."""
        return self.fit.footage.lags

    @property
    def used(self) -> Bools:
        """Instants that hold no outlier."""
        return self.fit.weights > _USED

    @property
    def missed(self) -> Floats:
        """Residuals, (m, n, 2)."""
        return np.stack(np.split(self.fit.misses, len(self.cameras), axis=1))

    @property
    def residual(self) -> float:
        """The worst camera's, pixels."""
        return max(map(trimmed, self.missed))

    @property
    def score(self) -> float:
        """The same, if errors are normal but for some outliers: from the better part of them."""
        return max(trimmed(part, _BETTER_PART) for part in self.missed)

    @property
    def agrees(self) -> bool:
        """Whether residuals are small, and not like those of the next frame.

        Noise of the tracks, however large, is no reason to look for other lags.
        """
        missed = self.fit.misses[self.used]
        now, then = missed[:-1], missed[1:]
        both = np.isfinite(now) & np.isfinite(then)
        square = max(float(np.sum((now**2)[both])), 1e-300)
        alike = max(float(np.sum((now * then)[both])) / square, 0.0)
        misfit = self.score * np.sqrt(alike / _PERSISTENT)
        return bool(alike <= _PERSISTENT and misfit <= DISAGREEMENT and self.score <= GROSS)

    def near(self, lags: Floats) -> bool:
        """Whether its lags are those."""
        return bool(np.abs(self.lags - lags).max() < _APART)

    @property
    def shares(self) -> Floats:
        """Share of each lag's squared slope that is motion and not noise, between 0 and 1.

        Interpolated noise has a slope, too: with a variance of half of the noise's, as it is taken
        between two frames that are two apart.
        """
        fit, used = self.fit, self.used
        slopes = fit.slopes[used].reshape(-1, fit.slopes.shape[-1])
        parts = np.argwhere(fit.errors > 0)[:, 1]
        lags, others = slopes[:, parts == _LAG], slopes[:, ~np.isin(parts, _TIMES)]
        lags = lags - others @ np.linalg.lstsq(others, lags)[0] if others.size else lags
        # Of the two numbers of each of k views, the point leaves 2 - 3 / k.
        seen = np.isfinite(self.missed[:, used, 0])
        views = np.maximum(seen.sum(axis=0), 2)
        freedom = np.maximum((seen * (2 - 3 / views)).sum(axis=1)[1:], 1e-9)
        speeds = fit.footage.rates[1:]
        chance = 0.5 * fit.noise**2 * speeds**2 * (freedom + 2 * np.sqrt(2 * freedom))
        total = np.sum(lags**2, axis=0)
        return np.clip((total - chance) / np.maximum(total, 1e-300), 0, 1)

    @property
    def covariance(self) -> Floats:
        """Of lags and drifts, if that of cameras is known as well as the tracks tell it."""
        fit = self.fit
        factor = fitted_factor(*fit.weighed, fit.prior, fit.noise)
        covariance = factor @ factor.T
        cameras, parts = np.argwhere(fit.errors > 0).T
        order = np.concatenate([np.flatnonzero(parts == part) for part in _TIMES])
        # Slopes that are noise add to the information, but mend nothing.
        share = np.append(1.0, np.maximum(self.shares, _LEAST))[cameras[order]]
        return covariance[np.ix_(order, order)] / np.outer(share, share)

    def drifted(self) -> Timing:
        """The same with drifts of clocks, if any are clear and large enough to matter."""
        errors, change = self.fit.errors.copy(), self.fit.change
        errors[1:, _DRIFT] = np.inf
        free = Timing.of(self.footage, self.cameras, errors, begin=change)
        if free is None:
            return self
        drift, off = free.fit.change[:, _DRIFT], np.zeros(len(errors))
        off[1:] = np.sqrt(np.diag(free.covariance))[len(off) - 1 :]
        clear = np.abs(drift) > np.maximum(_CLEAR * off, _ENOUGH)
        if not clear.any():
            return self
        errors[~clear, _DRIFT] = 0.0
        begin = np.where(errors > 0, free.fit.change, 0.0)
        return Timing.of(self.footage, self.cameras, errors, begin=begin) or self
