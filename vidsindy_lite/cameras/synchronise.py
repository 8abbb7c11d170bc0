"""When each camera started: the lags of the videos.

The frames of the first video are the clock. Camera i starts `lag` of them later and takes `rate`
frames during each (`alignment`).

Two cameras see one point only if they look at the same instant; otherwise their lines of sight miss
each other, and no scale and angle can mend it. So the lags are found like the cameras, as those of
the smallest reprojection error, in three steps:

1. pair by pair, with a calibrated camera: the epipolar equation (`triangulate.epipolar_lines`) is
   linear in what is unknown of the other camera, and is tried at every whole lag;
2. all cameras together (`learn_cameras`) at the most promising whole lags;
3. from there, fractions by Gauss-Newton, with all that is unknown of the cameras projected out.

A motion that repeats itself fits at several lags, one that hardly moves at all of them: then the
result says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Bools, Floats
from .alignment import Curve, aligned, check_clocks, check_lags, check_rates, curve
from .calibrate import cameras_of_views, check_learnable
from .camera import Camera
from .messages import ambiguous_lags, blurred_lag, no_lags, unsettled_lags
from .rig import Rig
from .triangulate import (
    Views,
    check_seen,
    epipolar_design,
    epipolar_lines,
    residuals,
    residuals_of_views,
)
from .unknowns import Unknowns

DISAGREEMENT = 1.0
"""Pixels by which a good rig misses at most one frame in ten; even whole-pixel tracks are missed by
less than half of that."""
BLURRED = 0.5
"""Standard error of a lag, in frames, beyond which it counts as unknown."""
ALIKE = 2.0
"""Ratio of disagreements up to which two lags fit equally well, ..."""
FINE = 0.05
"""... and disagreement in pixels below which all do: real tracks are no better than that."""
PROBE = 0.05
"""Frames; slopes in a lag are taken over twice that."""
OUTLIER = 12.0
"""Medians of the residuals; one beyond that moves neither a lag nor its error."""

_OVERLAP = 0.5  # share of the shorter of two videos that both must show
_INSTANTS = 200  # at which the first step compares two views
_PROMISING = 5  # lags of each camera that pass the first step
_TRIMMED = 0.9  # share of the instants that must agree; the others may hold anything
_STEPS = 10  # of one frame at most, from the best whole lags to the best ones
_SETTLED = 1e-3  # frames
_SHOWN = 3  # of the lags that fit equally well
_ROUNDING = 1e-6  # pixels; residuals below that are none


@dataclass(frozen=True)
class Lags:
    """Lags of the videos.

    Parameters
    ----------
    frames : ndarray, shape (m,)
        By how many frames of the first video each one starts later than the first.
    rates : ndarray, shape (m,)
        Frames of each video in one frame of the first.
    errors : ndarray, shape (m,)
        Standard errors of the lags, if the errors of the tracks are independent; infinite if the
        tracks do not tell them, zero if they were given. Lags that whole numbers fit as well are
        whole.
    residual : float
        The `disagreement` of the worst camera that is left, pixels.
    warnings : tuple of str
        Why the lags should not be trusted, with advice.
    clocks : tuple of ndarray, shape (n_i,)
        When each frame was taken, see `align`; empty if all videos are even.
    """

    frames: Floats
    rates: Floats
    errors: Floats
    residual: float
    warnings: tuple[str, ...] = ()
    clocks: tuple[Floats, ...] = field(default=(), repr=False)

    @property
    def agree(self) -> bool:
        """Whether all views agree on one target to within what tracking can be blamed for."""
        return bool(self.residual <= DISAGREEMENT)

    def frame_at(self, i: int, instant: int) -> int:
        """Which frame of video i is closest to one of the first."""
        if not self.clocks:
            return int(np.rint((instant - self.frames[i]) * self.rates[i]))
        sought = (self.clocks[0][instant] - self.frames[i]) * self.rates[i]
        return int(np.abs(self.clocks[i] - sought).argmin())


def disagreement(tracks: Sequence[Floats], rig: Rig) -> list[float]:
    """Residual in pixels that one frame in ten exceeds, per camera.

    That tenth may hold anything: a few outliers of the tracker do not accuse the rig.

    Parameters
    ----------
    tracks, rig
        See `residuals`.

    Returns
    -------
    list of float
        Pixels; zero for a camera that takes part in no point.
    """
    return [_trimmed(part) for part in residuals(tracks, rig)]


def learn_lags(
    tracks: Sequence[Floats],
    rig: Rig,
    rates: ArrayLike | None = None,
    start: ArrayLike | None = None,
    clocks: Sequence[ArrayLike] | None = None,
) -> Lags:
    """Learn by how much each video starts later than the first.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n_i, 2)
        One per camera of the rig, frame by frame; NaN = not seen.
    rig : Rig
        As for `learn_cameras`.
    rates : array_like, shape (m,), optional
        Frames of each video in one frame of the first; by default one.
    start : array_like, shape (m,), optional
        Lags that are tried first, by default zero: if they make the views agree to within
        `DISAGREEMENT`, only better ones close by are sought.
    clocks : sequence of array_like, shape (n_i,), optional
        See `align`.

    Returns
    -------
    Lags
        If no lags make the views agree, ``agree`` is false and the lags are those of the start.

    Raises
    ------
    ValueError
        If the rig has no calibrated camera, there is not one track, rate, lag and clock per
        camera, a track has a wrong shape, or a track never shows the target.
    """
    unknowns, tracks = check_learnable(rig), check_seen(tracks, rig)
    first = check_lags("start", np.zeros(len(tracks)) if start is None else start, len(tracks))
    videos = _Videos.of(tracks, unknowns, check_rates(rates, len(tracks)), clocks)
    ticks = () if clocks is None else videos.clocks
    residual = videos.disagreement(first)
    tried = [first] if residual <= DISAGREEMENT else _whole_lags(videos)
    refined = [_refined(videos, lags) for lags in tried]
    found = sorted((s for s in refined if s.agree), key=lambda s: s.residual)
    if not found:
        best = _untold(videos, first, no_lags(list_lags(first), residual))
        return replace(best, clocks=ticks)
    alike = [s for s in found if s.residual <= max(ALIKE * found[0].residual, FINE)]
    best = min(alike, key=lambda s: np.abs(s.frames).sum())
    warnings = list(best.warnings)
    if len(alike) > 1:
        warnings.append(ambiguous_lags([list_lags(s.frames) for s in alike[:_SHOWN]]))
    blurred = np.flatnonzero(best.errors > BLURRED)
    warnings += [blurred_lag(int(i) + 1, best.frames[i]) for i in blurred]
    return replace(best, warnings=tuple(warnings), clocks=ticks)


def list_lags(lags: Sequence[float] | Floats) -> str:
    """Lags as text, to a hundredth of a frame, e.g. ``0, 7, -12.5``."""
    return ", ".join(f"{round(lag, 2) + 0.0:g}" for lag in lags)


@dataclass(frozen=True)
class _Videos:
    """The tracks as functions of time, and how well they agree at given lags."""

    curves: tuple[Curve, ...]
    clocks: tuple[Floats, ...]  # when each frame was taken
    rates: Floats
    unknowns: Unknowns
    speed: float  # pixels in a frame
    tried: dict[tuple[float, ...], Floats] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        tracks: Sequence[Floats],
        unknowns: Unknowns,
        rates: Floats,
        clocks: Sequence[ArrayLike] | None = None,
    ) -> _Videos:
        """Of tracks, unknowns and rates that were checked."""
        seen = [track[np.isfinite(track).all(axis=1)] for track in tracks]
        steps = np.concatenate([np.hypot(*np.diff(track, axis=0).T) for track in seen])
        speed = float(np.quantile(steps, _TRIMMED)) if len(steps) else 0.0
        ticks = check_clocks(clocks, tracks)
        return cls(tuple(map(curve, tracks, ticks)), ticks, rates, unknowns, speed)

    @property
    def ends(self) -> Floats:
        """Durations on the clock."""
        return np.array([clock[-1] + 1 for clock in self.clocks]) / self.rates

    def residuals(self, lags: Floats) -> Floats:
        """Reprojection residuals of the cameras that fit best, (n_0, 2 m); NaN if none do."""
        key = tuple(lags.tolist())
        if key not in self.tried:
            tracks = aligned(self.curves, lags, self.rates, self.clocks[0])
            self.tried[key] = _best_residuals(tracks, self.unknowns)
        return self.tried[key]

    def disagreement(self, lags: Floats) -> float:
        """The worst camera's, pixels; infinite where no cameras fit."""
        missed = self.residuals(lags)
        if np.isnan(missed).all():
            return np.inf
        return max(_trimmed(part) for part in np.split(missed, len(self.curves), axis=1))


def _best_residuals(tracks: Sequence[Floats], unknowns: Unknowns) -> Floats:
    """Residuals of the cameras that fit aligned tracks best, (n, 2 m); NaN if none do."""
    if all(np.isfinite(track).any() for track in tracks):
        views = Views.of(tracks)
        try:
            return np.hstack(residuals_of_views(views, cameras_of_views(views, unknowns).cameras))
        except ValueError:  # these lags leave too little in common, or nothing that agrees
            pass
    return np.full_like(np.hstack(tracks), np.nan)


def _trimmed(residual: Floats) -> float:
    """Length of the residuals, (n, 2), that one frame in ten exceeds."""
    seen = residual[np.isfinite(residual).all(axis=1)]
    return float(np.quantile(np.hypot(*seen.T), _TRIMMED)) if len(seen) else 0.0


def _refined(videos: _Videos, whole: Floats) -> Lags:
    """The lags of the smallest reprojection error near whole ones."""
    lags = whole.copy()
    shifts = PROBE * np.eye(len(lags))[1:]  # the first video is the clock
    for _ in range(_STEPS):
        tried = np.array([videos.residuals(lags + s) for s in (0 * lags, *shifts, *-shifts)])
        here, ahead, behind = tried[0], *np.split(tried[1:], 2)
        used = np.isfinite(tried).all(axis=0)
        if not used.any():
            return _untold(videos, lags)
        limit = max(OUTLIER * np.median(np.abs(here[used])), _ROUNDING)
        used &= np.abs(np.where(used, here, 0)) <= limit
        slope = (ahead - behind)[:, used].T / (2 * PROBE)
        step, *_ = np.linalg.lstsq(slope, -here[used])
        size = np.abs(step).max()
        lags[1:] += step / max(size, 1)  # further than a frame the slope does not hold
        if size < _SETTLED:
            break
    noise = max(np.mean((here[used] + slope @ step) ** 2), _ROUNDING**2)
    told = _told(videos, lags, used, noise, np.sum(slope**2, axis=0))
    if not told.all():
        return _untold(videos, whole)
    information = slope.T @ slope / noise * np.sqrt(np.outer(told, told))
    errors = np.sqrt(np.concatenate(([0.0], np.diag(np.linalg.pinv(information)))))
    # Schwarz's criterion: a fraction is one more unknown per video.
    rounded = np.rint(lags) + 0.0  # and not -0
    beside = (rounded - lags)[1:]
    if beside @ information @ beside < len(beside) * np.log(used.sum()):
        lags = rounded
    warnings = () if size < _SETTLED else (unsettled_lags(size),)
    return Lags(lags, videos.rates, errors, videos.disagreement(lags), warnings)


def _untold(videos: _Videos, lags: Floats, *warnings: str) -> Lags:
    """Lags of which the tracks tell nothing; that of the first video is zero in any case."""
    errors = np.where(np.arange(len(lags)) > 0, np.inf, 0.0)
    return Lags(lags, videos.rates, errors, videos.disagreement(lags), warnings)


def _told(videos: _Videos, lags: Floats, used: Bools, noise: float, slopes: Floats) -> Floats:
    """Share of each lag's squared slope that is motion and not noise, between 0 and 1.

    Interpolated noise has a slope, too. But whole frames beside the lags its size is the same
    as at them: there only motion makes the residuals larger.
    """
    shares = []
    for one, slope in zip(np.eye(len(lags))[1:], slopes, strict=True):
        tried = np.array([videos.residuals(lags + shift) for shift in (0 * one, one, -one)])
        both = used & np.isfinite(tried).all(axis=0)
        here, ahead, behind = (np.sum(part[both] ** 2) for part in tried)
        chance = 2 * noise * np.sqrt(2 * both.sum())  # two standard deviations of such a sum
        rise = ((ahead + behind) / 2 - here - chance) / slope
        shares.append(rise if both.any() else 1.0)  # a frame beside, nothing fits at all
    return np.clip(shares, 0, 1)


def _whole_lags(videos: _Videos) -> list[Floats]:
    """Whole lags at which all cameras agree as well as they can between two frames."""
    cameras = videos.unknowns.cameras
    known = next(i for i, camera in enumerate(cameras) if camera.is_calibrated)
    count = len(cameras)
    promising = [[0.0] if i == known else _pair_lags(videos, known, i) for i in range(count)]
    best = np.array([lags[0] for lags in promising])
    while True:
        others = [(i, lag) for i in range(count) for lag in promising[i] if lag != best[i]]
        tried = [best, *(np.where(np.arange(count) == i, lag, best) for i, lag in others)]
        missed = np.array([videos.disagreement(lags) for lags in tried])
        winner = int(missed.argmin())
        if winner == 0:
            break
        best = tried[winner]
    # Half a frame beside the right lag, the views miss each other by half a frame of motion.
    limit = max(missed.min(), DISAGREEMENT + videos.speed / 2)
    return [lags - lags[0] for lags, value in zip(tried, missed, strict=True) if value <= limit]


def _pair_lags(videos: _Videos, known: int, other: int) -> list[float]:
    """The most promising lags of one camera behind a calibrated one, best first."""
    shortest = min(videos.ends[known], videos.ends[other])
    margin = _OVERLAP * shortest
    lags = np.arange(np.ceil(margin - videos.ends[other]), videos.ends[known] - margin + 1)
    frames = videos.clocks[known][:: max(1, int(shortest // _INSTANTS))]
    first, second = videos.unknowns.cameras[known], videos.unknowns.cameras[other]
    placed = first.is_placed and second.is_placed
    near, far = (c if c.is_placed else c.placed(np.zeros(2)) for c in (first, second))
    lines = epipolar_lines(near, videos.curves[known](frames), far)
    instants, rate = frames / videos.rates[known], videos.rates[other]
    theirs = [videos.curves[other]((instants - k) * rate) for k in lags]
    missed = np.array([_pair_missed(second, placed, lines, pixels) for pixels in theirs])
    padded = np.concatenate(([np.inf], missed, [np.inf]))
    dips = (missed <= padded[:-2]) & (missed <= padded[2:]) & np.isfinite(missed)
    ranked = sorted(np.flatnonzero(dips), key=lambda k: missed[k])
    return [float(lags[k]) for k in ranked[:_PROMISING]] or [0.0]


def _pair_missed(
    other: Camera, placed: bool, lines: tuple[Floats, Floats], theirs: Floats
) -> float:
    """By how much its pixels miss the epipolar lines of a known camera at best, scene units rms.

    `placed` says whether both positions are known. One instant in ten is left out.
    """
    design, target = epipolar_design(lines, other, theirs)
    if other.is_calibrated:
        scale, angle = other.calibration
        turned = scale * np.array([np.cos(angle), np.sin(angle)])
        design, target = design[:, :0], target - design @ turned
    if not placed:  # the offset adds the same to all equations
        design = np.column_stack((design, np.ones(len(design))))
    fits = np.ones(len(target), bool)
    for _ in range(2):
        if fits.sum() <= 2 * design.shape[1]:
            return np.inf
        solution = np.linalg.lstsq(design[fits], target[fits])[0]
        missed = np.abs(design @ solution - target)
        fits = missed <= np.quantile(missed, _TRIMMED)
    return float(np.sqrt(np.mean(missed[fits] ** 2)))
