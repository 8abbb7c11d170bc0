"""When each camera started: the lags of the videos, learned from their tracks.

The frames of the first video are the clock. Camera i starts `lag` of them later and takes `rate`
frames during each, so that the instant k of the clock is its frame (k - lag) * rate. Between two
frames a track is interpolated, so lags need not be whole.

Two cameras see one point only if they look at the same instant; otherwise their lines of sight miss
each other, and no scale and angle can mend it. So the lags are found like the cameras, as those of
the smallest reprojection error, in three steps:

1. pair by pair, with a calibrated camera: the epipolar equation (`sights.epipolar_equations`) is
   linear in what is unknown of the other camera, and is tried at every whole lag;
2. all cameras together (`learn_cameras`) at the most promising whole lags;
3. from there, fractions by Gauss-Newton, with all that is unknown of the cameras projected out.

A motion that repeats itself fits at several lags, one that hardly moves at all of them: then the
result says so.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from ..checks import check_positive, check_tracks, check_vector
from .calibrate import Rig, check_learnable, learn_cameras, residuals
from .triangulate import epipolar_equations

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
_FARTHEST = 1e9  # frames by which a video may start later; and ...
_FASTEST = 1e6  # ... times as many frames that one may take: more is no lag and no rate
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
        Why the lags should not be trusted although the views agree, with advice.
    """

    frames: np.ndarray
    rates: np.ndarray
    errors: np.ndarray
    residual: float
    warnings: tuple[str, ...] = ()

    @property
    def agree(self) -> bool:
        """Whether all views agree on one target to within what tracking can be blamed for."""
        return bool(self.residual <= DISAGREEMENT)

    def frame_at(self, i: int, instant: int) -> int:
        """Which frame of video i is closest to one of the first."""
        return int(np.rint((instant - self.frames[i]) * self.rates[i]))


def align(
    tracks: Sequence[np.ndarray], lags: Sequence[float], rates: Sequence[float] | None = None
) -> tuple[np.ndarray, ...]:
    """Tracks of all videos at the instants of the first video's frames.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n_i, 2)
        One per video, frame by frame; NaN = not seen.
    lags : array_like, shape (m,)
        By how many frames of the first video each one starts later; only differences count.
    rates : array_like, shape (m,), optional
        Frames of each video in one frame of the first; by default one.

    Returns
    -------
    tuple of ndarray, shape (n_0, 2)
        NaN where a video has not begun, has ended, or does not show the target in the frames before
        and after. At whole frames these are the tracks themselves.

    Raises
    ------
    ValueError
        If a track has a wrong shape or an infinite value, or there is not one finite lag, or
        positive rate, per track, or one of them is absurdly large or small.
    """
    tracks = check_tracks(tracks)
    lags = _check_lags("lags", lags, len(tracks))
    rates = _check_rates(rates, len(tracks))
    clock = np.arange(len(tracks[0]))
    at = [_curve(track) for track in tracks]
    return tuple(c((clock - lag) * r) for c, lag, r in zip(at, lags, rates, strict=True))


def disagreement(tracks: Sequence[np.ndarray], rig: Rig) -> list[float]:
    """Residual in pixels that one frame in ten exceeds, per camera.

    That tenth may hold anything: a few outliers of the tracker do not accuse the rig.
    """
    missed = []
    for residual in residuals(tracks, rig):
        seen = residual[np.isfinite(residual).all(axis=1)]
        missed.append(np.quantile(np.hypot(*seen.T), _TRIMMED) if len(seen) else 0.0)
    return missed


def learn_lags(
    tracks: Sequence[np.ndarray],
    rig: Rig,
    rates: Sequence[float] | None = None,
    start: Sequence[float] | None = None,
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

    Returns
    -------
    Lags
        If no lags make the views agree, ``agree`` is false and the lags are those of the start.

    Raises
    ------
    ValueError
        If the rig has no calibrated camera, there is not one track, rate and lag per camera, a
        track has a wrong shape, or a track never shows the target.
    """
    check_learnable(rig)
    tracks = check_tracks(tracks, len(rig.cameras))
    for i, track in enumerate(tracks):
        if not np.isfinite(track).all(axis=1).any():
            raise ValueError(f"tracks[{i}]: must show the target in some frame, got none")
    first = _check_lags("start", np.zeros(len(tracks)) if start is None else start, len(tracks))
    views = _Views(tracks, rig, _check_rates(rates, len(tracks)))
    missed = views.missed(first)
    if missed <= DISAGREEMENT:
        found = [views.refined(first)]
    else:
        found = [views.refined(lags) for lags in _whole_lags(views)]
    found = sorted((s for s in found if s.agree), key=lambda s: s.residual)
    if not found:
        return Lags(first, views.rates, np.full(len(first), np.inf), missed)
    alike = [s for s in found if s.residual <= max(ALIKE * found[0].residual, FINE)]
    best = min(alike, key=lambda s: np.abs(s.frames).sum())
    return replace(best, warnings=tuple(_ambiguous(alike) + _blurred(best)))


def list_lags(lags: Sequence[float]) -> str:
    """Lags as text, to a hundredth of a frame, e.g. ``0, 7, -12.5``."""
    return ", ".join(f"{round(lag, 2) + 0.0:g}" for lag in lags)


def _ambiguous(alike: Sequence[Lags]) -> list[str]:
    if len(alike) < 2:
        return []
    lags = " or ".join(f"({list_lags(s.frames)})" for s in alike[:_SHOWN])
    return [
        f"the lags of the videos cannot be told: {lags} frames fit about equally well, because the "
        "motion repeats itself; give the lags if you know them"
    ]


def _blurred(best: Lags) -> list[str]:
    return [
        f"the lag of video {i + 1} cannot be told, because the target moves too little or too "
        f"slowly: {lag:g} frames were taken; give the lags if you know them"
        for i, (lag, error) in enumerate(zip(best.frames, best.errors, strict=True))
        if error > BLURRED
    ]


class _Views:
    """The tracks as functions of time, and how well they agree at given lags."""

    def __init__(self, tracks, rig, rates):
        self.tracks, self.rig, self.rates = tracks, rig, rates
        self.ends = np.array([len(track) for track in tracks]) / rates  # on the clock
        seen = [track[np.isfinite(track).all(axis=1)] for track in tracks]
        steps = np.concatenate([np.hypot(*np.diff(track, axis=0).T) for track in seen])
        self.speed = np.quantile(steps, _TRIMMED) if len(steps) else 0.0  # pixels in a frame
        self.known = {}  # the cameras learned at lags that were tried

    def at(self, lags):
        return align(self.tracks, lags, self.rates)

    def learned(self, lags):
        """The cameras that fit best at these lags; None if none do."""
        key = tuple(lags)
        if key not in self.known:
            try:
                self.known[key] = learn_cameras(self.at(lags), self.rig)
            except ValueError:  # these lags leave too little in common, or nothing that agrees
                self.known[key] = None
        return self.known[key]

    def residuals(self, lags):
        """Reprojection residuals of the cameras that fit best, (n_0, 2 m); None if none do."""
        rig = self.learned(lags)
        return None if rig is None else np.hstack(residuals(self.at(lags), rig))

    def missed(self, lags):
        """The worst camera's disagreement, pixels; infinite where no cameras fit."""
        rig = self.learned(lags)
        return np.inf if rig is None else max(disagreement(self.at(lags), rig))

    def refined(self, whole):
        """The lags of the smallest reprojection error near whole ones, as `Lags`."""
        lags, step = np.array(whole, float), np.inf
        shifts = PROBE * np.eye(len(lags))[1:]  # the first video is the clock
        for _ in range(_STEPS):
            tried = [self.residuals(lags + s) for s in (0 * lags, *shifts, *-shifts)]
            if any(part is None for part in tried):
                return Lags(lags, self.rates, np.full(len(lags), np.inf), self.missed(lags))
            here, ahead, behind = tried[0], *np.split(np.array(tried[1:]), 2)
            used = np.isfinite(tried).all(axis=0)
            limit = max(OUTLIER * np.median(np.abs(here[used])), _ROUNDING)
            used &= np.abs(np.where(used, here, 0)) <= limit
            slope = (ahead - behind)[:, used].T / (2 * PROBE)
            step, *_ = np.linalg.lstsq(slope, -here[used])
            size = np.abs(step).max()
            lags[1:] += step / max(size, 1)  # further than a frame the slope does not hold
            if size < _SETTLED:
                break
        noise = max(np.mean((here[used] + slope @ step) ** 2), _ROUNDING**2)
        told = self._told(lags, used, noise, np.sum(slope**2, axis=0))
        information = slope.T @ slope / noise * np.sqrt(np.outer(told, told))
        if not told.all():
            errors = np.where(np.arange(len(lags)) > 0, np.inf, 0.0)
            return Lags(np.array(whole, float), self.rates, errors, self.missed(whole))
        errors = np.sqrt(np.concatenate(([0.0], np.diag(np.linalg.pinv(information)))))
        # Schwarz's criterion: a fraction is one more unknown per video.
        rounded = np.rint(lags) + 0.0  # and not -0
        beside = (rounded - lags)[1:]
        if beside @ information @ beside < len(beside) * np.log(used.sum()):
            lags = rounded
        return Lags(lags, self.rates, errors, self.missed(lags))

    def _told(self, lags, used, noise, slopes):
        """Share of each lag's squared slope that is motion and not noise, between 0 and 1.

        Interpolated noise has a slope, too. But whole frames beside the lags its size is the same
        as at them: there only motion makes the residuals larger.
        """
        shares = []
        for one, slope in zip(np.eye(len(lags))[1:], slopes, strict=True):
            tried = [self.residuals(lags + shift) for shift in (0 * one, one, -one)]
            if any(part is None for part in tried):  # a frame beside, nothing fits at all
                shares.append(1.0)
                continue
            both = used & np.isfinite(tried).all(axis=0)
            here, ahead, behind = (np.sum(part[both] ** 2) for part in tried)
            chance = 2 * noise * np.sqrt(2 * both.sum())  # two standard deviations of such a sum
            rise = ((ahead + behind) / 2 - here - chance) / slope
            shares.append(float(np.clip(rise, 0, 1)))
        return np.array(shares)


def _whole_lags(views: _Views) -> list[np.ndarray]:
    """Whole lags at which all cameras agree as well as they can between two frames."""
    known = next(i for i, camera in enumerate(views.rig.cameras) if camera.is_calibrated)
    others = [i for i in range(len(views.tracks)) if i != known]
    promising = {i: _pair_lags(views, known, i) for i in others}
    best = np.zeros(len(views.tracks))
    best[others] = [promising[i][0] for i in others]
    while True:
        tried = [best]
        for i in others:
            for lag in promising[i][1:]:
                tried.append(best.copy())
                tried[-1][i] = lag
        missed = np.array([views.missed(lags) for lags in tried])
        winner = int(missed.argmin())
        if winner == 0:
            break
        best = tried[winner]
        promising = {i: sorted(promising[i], key=lambda lag: lag != best[i]) for i in others}  # noqa: B023
    # Half a frame beside the right lag, the views miss each other by half a frame of motion.
    limit = max(missed.min(), DISAGREEMENT + views.speed / 2)
    return [lags - lags[0] for lags, value in zip(tried, missed, strict=True) if value <= limit]


def _pair_lags(views: _Views, known: int, other: int) -> list[float]:
    """The most promising lags of one camera behind a calibrated one, best first."""
    shortest = min(views.ends[known], views.ends[other])
    margin = _OVERLAP * shortest
    lags = np.arange(np.ceil(margin - views.ends[other]), views.ends[known] - margin + 1)
    cameras = views.rig.cameras[known], views.rig.cameras[other]
    frames = np.arange(0, len(views.tracks[known]), max(1, int(shortest // _INSTANTS)))
    ours, theirs = views.tracks[known][frames], _curve(views.tracks[other])
    instants = frames / views.rates[known]
    rate = views.rates[other]
    missed = np.array(
        [_pair_missed(*cameras, ours, theirs((instants - lag) * rate)) for lag in lags]
    )
    padded = np.concatenate(([np.inf], missed, [np.inf]))
    dips = (missed <= padded[:-2]) & (missed <= padded[2:]) & np.isfinite(missed)
    ranked = sorted(np.flatnonzero(dips), key=lambda k: missed[k])
    return [float(lags[k]) for k in ranked[:_PROMISING]] or [0.0]


def _pair_missed(known, other, ours: np.ndarray, theirs: np.ndarray) -> float:
    """How badly two views agree at best, in pixels of the first; one instant in ten is left out."""
    common = np.isfinite(ours).all(axis=1) & np.isfinite(theirs).all(axis=1)
    cameras = [c if c.is_placed else replace(c, position=np.zeros(3)) for c in (known, other)]
    design, target = epipolar_equations(cameras[0], ours[common], cameras[1], theirs[common])
    if other.is_calibrated:
        turned = other.scale * np.array([np.cos(other.angle), np.sin(other.angle)])
        design, target = design[:, :0], target - design @ turned
    if not (known.is_placed and other.is_placed):  # the offset adds the same to all equations
        design = np.column_stack((design, np.ones(len(design))))
    fits = np.ones(len(target), bool)
    for _ in range(2):
        if fits.sum() <= 2 * design.shape[1]:
            return np.inf
        solution = np.linalg.lstsq(design[fits], target[fits])[0]
        missed = np.abs(design @ solution - target)
        fits = missed <= np.quantile(missed, _TRIMMED)
    return float(np.sqrt(np.mean(missed[fits] ** 2))) / known.scale


def _curve(track: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """A track as a function of the frame number, whole or not: a cubic spline through its frames.

    Its values are NaN outside, and unless the target is seen in the frames before and after.
    """
    shown = np.isfinite(track).all(axis=1)
    seen = np.flatnonzero(shown)
    spline = make_interp_spline(seen, track[seen], k=min(3, len(seen) - 1)) if len(seen) else None

    def at(frames):
        inside = (frames >= 0) & (frames <= len(track) - 1)
        frames = np.where(inside, frames, 0)
        low, high = np.floor(frames).astype(int), np.ceil(frames).astype(int)
        inside[inside] = shown[low[inside]] & shown[high[inside]]
        values = np.full((len(frames), 2), np.nan)
        whole = inside & (low == high)
        values[whole] = track[low[whole]]
        between = inside & (low != high)
        if between.any():
            values[between] = spline(frames[between])
        return values

    return at


def _check_lags(name, lags, count):
    lags = check_vector(name, lags, count)
    far = np.abs(lags).max()
    if far > _FARTHEST:
        raise ValueError(f"{name}: must be at most {_FARTHEST:g} frames, got {far:g}")
    return lags - lags[0]


def _check_rates(rates, count):
    rates = np.ones(count) if rates is None else check_vector("rates", rates, count)
    for rate in rates:
        if not 1 / _FASTEST <= check_positive("rates", rate) <= _FASTEST:
            raise ValueError(
                f"rates: must be between {1 / _FASTEST:g} and {_FASTEST:g}, got {rate:g}"
            )
    return rates / rates[0]
