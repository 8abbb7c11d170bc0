"""When each camera started, and how fast its clock runs: the lags of the videos.

Two cameras see one point only if they look at the same instant; otherwise their lines of sight miss
each other, and no camera can mend it. So the lags are those of the smallest reprojection error, and
are found in three steps:

1. pair by pair, with a calibrated camera: the epipolar equation (`triangulate.epipolar_lines`) is
   linear in what is unknown of the other camera, and is solved at all whole lags at once. It is
   solved a second time with a shift of the other image, which takes up most of what a badly
   measured normal or position does;
2. all cameras together (`adjust`), in some of the frames, from the most promising whole lags;
3. from the best of these, in all frames.

What was measured with an error may change with the lags. If cameras that may turn and zoom a little
although they are called exact explain the tracks far better, the lags are taken from these: a wrong
normal is no reason for a wrong lag.

A motion that repeats itself fits at several lags, one that hardly moves at all of them: then the
result says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from tqdm import tqdm

from ..arrays import Floats
from ..progress import bar
from .alignment import (
    Curve,
    Footage,
    Lags,
    align,
    check_clocks,
    check_lags,
    check_rates,
    list_lags,
)
from .calibrate import check_learnable
from .camera import Camera
from .changes import PARTS, known_to
from .messages import ambiguous_lags, blurred_lag, no_lags, unsettled_lags
from .pairs import promising_lags, rough_cameras
from .rig import Rig
from .shutter import steadied
from .timing import DISAGREEMENT, Timing
from .triangulate import Views, check_seen, residuals_of_views, trimmed
from .unknowns import Unknowns
from .unmeasured import posed

BLURRED = 0.5
"""Standard error of a lag, in frames, beyond which it counts as unknown."""
ALIKE = 2.0
"""Ratio of residuals up to which two lags fit equally well, ..."""
FINE = 0.05
"""... and residual in pixels below which all do: real tracks are no better than that."""

_INSTANTS = 300  # at which all cameras are compared in the second step
_ROUGH_STEPS = 8  # of the second step
_SHOWN = 3  # of the lags that fit equally well
_LOOSE = 0.05  # of tilts, log scales and angles that a hand measured: three degrees, 5 %
_BETTER = 1.25  # times smaller residuals are a reason to doubt what was measured


def learn_lags(
    tracks: Sequence[Floats],
    rig: Rig,
    rates: ArrayLike | None = None,
    start: ArrayLike | None = None,
    clocks: Sequence[ArrayLike] | None = None,
    *,
    progress: bool | None = None,
) -> Lags:
    """Learn by how much each video starts later than the first, and whether its clock drifts.

    The rig need not be exact. If cameras that turn and zoom by some degrees and per cent explain
    the tracks far better, the lags are taken from those.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n_i, 2)
        One per camera of the rig, frame by frame; NaN = not seen.
    rig : Rig
        As for `learn_cameras`.
    rates : array_like, shape (m,), optional
        Frames of each video in one frame of the first; by default one. Small errors of these are
        learned where the videos are long enough to tell them.
    start : array_like, shape (m,), optional
        Lags that are tried first, by default zero; of several that fit equally well, these win.
    clocks : sequence of array_like, shape (n_i,), optional
        See `align`.
    progress : bool, optional
        Whether a progress bar is shown; by default after two seconds, if a person watches.

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
    check_learnable(rig)
    tracks = check_seen(tracks, rig)
    first = check_lags("start", np.zeros(len(tracks)) if start is None else start, len(tracks))
    given = check_rates(rates, len(tracks))
    rig = posed(align(tracks, first, given, clocks), rig, synchronous=False)
    with bar(progress, "synchronise", unit="fit") as shown:
        videos = _Videos.of(tracks, rig, given, clocks, shown)
        found = _learned(videos, first)
    return found if clocks is None else replace(found, clocks=tuple(c.clock for c in videos.curves))


def nearest(
    tracks: Sequence[Floats],
    rig: Rig,
    rates: Floats,
    lags: Floats,
    clocks: Sequence[ArrayLike] | None,
) -> float:
    """Residual in pixels at the best lags near given ones."""
    with tqdm(disable=True) as bar:
        found = _Videos.of(tracks, rig, rates, clocks, bar).fitted(lags, rough=True)
    return np.inf if found is None else found.residual


@dataclass(frozen=True, eq=False)
class _Videos:
    """The tracks as functions of time, what is known of the cameras, and a bar to move."""

    curves: tuple[Curve, ...]
    unknowns: Unknowns
    rates: Floats
    bar: tqdm

    @classmethod
    def of(
        cls,
        tracks: Sequence[Floats],
        rig: Rig,
        rates: Floats,
        clocks: Sequence[ArrayLike] | None,
        bar: tqdm,
    ) -> _Videos:
        """Of tracks as they are given."""
        still = [
            steadied(track, camera.readout, camera.image_size[1])
            for track, camera in zip(tracks, rig.cameras, strict=True)
        ]
        at_once = Rig(tuple(replace(camera, readout=0.0) for camera in rig.cameras))
        curves = tuple(map(Curve, still, check_clocks(clocks, tracks)))
        return cls(curves, Unknowns.of(at_once), rates, bar)

    @property
    def step(self) -> int:
        """Frames from one to the next of those in which all cameras are compared."""
        return -(-len(self.curves[0].clock) // _INSTANTS)

    def footage(self, lags: Floats, rough: bool = False) -> Footage:
        """All instants, or some."""
        instants = self.curves[0].clock[:: self.step if rough else 1]
        return Footage(self.curves, instants, lags, self.rates)

    def cameras(self, footage: Footage) -> tuple[Camera, ...] | None:
        """Those that the closed form finds; None if it finds none."""
        tracks = footage.aligned
        if not all(np.isfinite(track).any() for track in tracks):
            return None
        return rough_cameras(Views.of(tracks), self.unknowns)

    def errors(self, rough: bool = False, loose: bool = False) -> Floats:
        """What is known of cameras, and of all lags but the first one's nothing."""
        errors = np.array([known_to(camera) for camera in self.unknowns.cameras])
        if rough and self.step > 1:  # which are too few to tell where the target was between two
            errors[:, PARTS["readout"]] = 0.0
        errors[1:, PARTS["lag"]] = np.inf
        if loose:
            ways = np.zeros(errors.shape, bool)
            for what in ("normal", "angle", "scale"):
                ways[:, PARTS[what]] = True
            errors[ways & (errors == 0)] = _LOOSE
        return errors

    def fitted(self, lags: Floats, rough: bool = False, loose: bool = False) -> Timing | None:
        """The best lags near given ones, or better ones than these; None if nothing fits."""
        self.bar.update()
        footage = self.footage(lags, rough)
        cameras = self.cameras(footage)
        if cameras is None:
            return None
        errors = self.errors(rough, loose)
        return Timing.of(footage, cameras, errors, most=_ROUGH_STEPS if rough else None)


# ------------------------------------------------------------------------------------- the search


def _learned(videos: _Videos, first: Floats) -> Lags:
    """`learn_lags` of what was checked."""
    begun = videos.fitted(first)
    if begun is not None and begun.agrees and (begun.near(first) or not begun.shares.all()):
        return _told(videos, begun.drifted(), first)
    loose, sampled = _searched(videos, first)
    if not sampled:
        return _untold(videos, first, False)
    close = [s for s in sampled if s.score <= max(2 * ALIKE * sampled[0].score, FINE)]
    small = sorted(close, key=lambda s: np.abs(s.lags).sum())
    chosen = _different(close[:_SHOWN] + small[:_SHOWN])
    every = [videos.fitted(s.lags, loose=loose) for s in chosen]
    found = sorted(_different([f for f in every if f]), key=lambda f: f.score)
    if not found:
        return _untold(videos, first, False)
    if not found[0].agrees:  # as no lag does, where clocks drift by more than a part of a frame
        found = sorted((f.drifted() for f in found), key=lambda f: f.score)
    alike = [f for f in found if f.score <= max(ALIKE * found[0].score, FINE)]
    if len(alike) > 1 and found[0].score > DISAGREEMENT:
        return _untold(videos, first, False)
    best = min(alike, key=lambda f: (not f.near(first), np.abs(f.lags).sum()))
    told = _told(videos, best.drifted(), first)
    if len(alike) > 1 and not best.near(first):
        choices = [best, *(f for f in alike if f is not best)][:_SHOWN]
        warning = ambiguous_lags([list_lags(f.lags) for f in choices])
        told = replace(told, warnings=(warning, *told.warnings))
    return told


def _searched(videos: _Videos, first: Floats) -> tuple[bool, list[Timing]]:
    """Whether cameras should be loose, and fits to some of the instants, the best first."""
    promising = promising_lags(videos.curves, videos.rates, videos.unknowns)
    exact = _climbed(videos, promising, first, False)
    if not exact or exact[0].score <= FINE:
        return False, exact
    if exact[0].score <= DISAGREEMENT:
        other = videos.fitted(exact[0].lags, rough=True, loose=True)
        if other is None or other.score * _BETTER >= exact[0].score:
            return False, exact
    # Where the rig is wrong, its best lags may be wrong as well: so all are tried again.
    loose = _climbed(videos, promising, first, True)
    if loose and loose[0].score * _BETTER < exact[0].score:
        return True, loose
    return False, exact


def _climbed(
    videos: _Videos, promising: list[list[float]], first: Floats, loose: bool
) -> list[Timing]:
    """Fits to some instants from the most promising lags and all that differ from the best in one.

    The best are tried in all combinations with the others' until none is better.
    """
    count = len(promising)
    tried: dict[tuple[float, ...], Timing | None] = {}

    def fits(lags: Floats) -> float:
        key = tuple((lags - lags[0]).tolist())
        if key not in tried:
            tried[key] = videos.fitted(np.array(key), True, loose)
        found = tried[key]
        return np.inf if found is None else found.residual

    best = np.array([lags[0] for lags in promising])
    fits(first)
    while True:
        others = [(i, lag) for i in range(count) for lag in promising[i] if lag != best[i]]
        every = [best, *(np.where(np.arange(count) == i, lag, best) for i, lag in others)]
        winner = int(np.argmin([fits(lags) for lags in every]))
        if winner == 0:
            break
        best = every[winner]
    found = sorted((f for f in tried.values() if f is not None), key=lambda f: f.score)
    return _different(found)


def _different(found: list[Timing]) -> list[Timing]:
    """The first of all that have the same lags."""
    kept: list[Timing] = []
    for one in found:
        if not any(one.near(other.lags) for other in kept):
            kept.append(one)
    return kept


# --------------------------------------------------------------------- errors, and what is told


def _told(videos: _Videos, found: Timing, first: Floats) -> Lags:
    """What a fit tells of the lags, or that it tells nothing."""
    fit, lags = found.fit, found.lags.copy()
    count = len(lags) - 1
    if not found.shares.all():
        return _untold(videos, first, found.score <= DISAGREEMENT)
    covariance, rate_errors = found.covariance, np.zeros(len(lags))
    drifting = fit.errors[:, PARTS["drift"].start] > 0
    rate_errors[drifting] = np.sqrt(np.diag(covariance)[count:]) / fit.footage.span
    # Lags are those of the first instant, those of the fit of the middle.
    moved = np.hstack((np.eye(count), -np.eye(count)[:, drifting[1:]] * fit.footage.middle
                       / fit.footage.span))  # fmt: skip
    information = np.linalg.pinv(moved @ covariance @ moved.T, hermitian=True)
    errors = np.sqrt(np.concatenate(([0.0], np.diag(np.linalg.pinv(information, hermitian=True)))))
    # Schwarz's criterion: a fraction is one more unknown per video.
    rounded = np.rint(lags) + 0.0  # and not -0
    beside = (rounded - lags)[1:]
    if beside @ information @ beside < count * np.log(found.used.sum()):
        lags = rounded
    blurred = np.flatnonzero(errors > BLURRED)
    warnings = [blurred_lag(int(i) + 1, lags[i]) for i in blurred]
    if not fit.settled:
        warnings.append(unsettled_lags(fit.steps))
    return Lags(
        lags, fit.footage.rates, errors, found.residual, tuple(warnings), rate_errors=rate_errors
    )


def _untold(videos: _Videos, lags: Floats, agree: bool) -> Lags:
    """Lags of which the tracks tell nothing, as all agree or none; the first one is the clock."""
    errors = np.where(np.arange(len(lags)) > 0, np.inf, 0.0)
    residual, footage = np.inf, videos.footage(lags)
    cameras = videos.cameras(footage)
    if cameras is not None:
        missed = residuals_of_views(Views.of(footage.aligned), cameras)
        residual = max(map(trimmed, missed))
    warnings = [blurred_lag(i + 1, lags[i]) for i in range(1, len(lags))]
    if not agree:
        warnings = [no_lags(list_lags(lags), residual)]
    return Lags(lags, videos.rates, errors, residual, tuple(warnings))
