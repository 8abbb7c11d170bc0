"""When each camera started, and how fast its clock runs: the lags of the videos.

Two cameras see one point only if they look at the same instant; otherwise their lines of sight miss
each other, and no camera can mend it. So the lags are those of the smallest reprojection error, and
are found in three steps:

1. pair by pair, with a calibrated camera: the epipolar equation (`models.epipolar_lines`) is
   linear in what is unknown of the other camera, and is solved at all whole lags at once; with a
   shift of the other image, which takes up most of what a badly measured normal or position does;
2. all cameras together (`adjust`), in some of the frames, from the most promising whole lags;
3. from the best of these, in all frames.

What was measured with an error may change with the lags. If cameras that may turn and zoom a little
although they are called exact explain the tracks far better, the lags are taken from these: a wrong
normal is no reason for a wrong lag.

A motion that repeats itself fits at several lags, one that hardly moves at all of them: then the
result says so.

The errors of lags are those of least squares, but for residuals that depend on their neighbours,
and for slopes that are noise: with a share p of motion in the squares of the slopes, beyond what
cameras that are known to their errors make up for, they are 1 / p times as large.

**Mistakes** are one of a few, and what is right is known at once: tracks in another order than the
cameras, a mirrored view, v counted upwards, a video of another frame rate than stated, dropped
frames. `find_mistake` tries all. Two views at a time, the epipolar equation tells by how much they
disagree at all whole lags; the mistake that mends that best is tried with all cameras. Frames were
dropped of a video where its best lag behind all others jumps; the cameras that tell this are those
of a part of the videos in which none were.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations, product
from operator import itemgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from tqdm import tqdm

from ..arrays import Floats, Ints
from ..progress import bar
from .adjust import DRIFT, LAG, PARTS, STEPS, Adjustment, adjust, known_to, persistence
from .calibrate import check_learnable, closed_form
from .clocks import INSTANTS, OVERLAP, Footage, Lags, check_lags, dips, list_lags, untold_lags
from .models import TRIMMED, Camera, at_once, epipolar_lines, epipolar_rows, missed, trimmed
from .rig import ALIKE, BETTER, DISAGREEMENT, FINE, GROSS, Rig, check_seen, paced
from .unmeasured import posed

_PERSISTENT = 0.5  # correlation of a residual with the next frame's that is no tracker's noise
_TIMES = LAG, DRIFT
_SHOWN = 3  # of the lags that fit equally well
#: Rates over those stated that are taken for each other.
RATES = ((25, 30), (30, 25), (24, 30), (30, 24), (24, 25), (25, 24), (30, 60), (60, 30))
_LONGEST = 60  # frames by which it may jump
_PRICE = 20.0  # of a jump, in units of log(1 + miss^2) of a frame


def lag_misses(
    footage: Footage, cameras: Sequence[Camera], most: int = INSTANTS
) -> Iterator[tuple[Floats, Floats]]:
    """Of each camera all whole lags (k,) behind the first calibrated one, and `pair_missed` there.

    The misses are at so many instants at most.
    """
    known = next(i for i, camera in enumerate(cameras) if camera.is_calibrated)
    curves, ends = footage.curves, footage.lengths
    frames = curves[known].clock
    frames = frames[:: max(1, len(frames) // most)]
    for other in range(len(curves)):
        if other == known:
            yield np.zeros(1), np.zeros(1)
            continue
        margin = OVERLAP * min(ends[known], ends[other])
        lags = np.arange(np.ceil(margin - ends[other]), ends[known] - margin + 1)
        lines = epipolar_lines(cameras[known], curves[known].at(frames), cameras[other])
        instants, rate = frames / footage.rates[known], footage.rates[other]
        missed = []
        # So many pairs of a lag and an instant at a time.
        for block in np.array_split(lags, int(np.ceil(lags.size * frames.size / 200_000))):
            theirs = curves[other].at((instants - block[:, None]) * rate)
            missed.append(pair_missed(cameras[other], lines, theirs))
        yield lags, np.concatenate(missed)


def pair_missed(other: Camera, lines: tuple[Floats, Floats], theirs: Floats) -> Floats:
    """By how much its pixels, (k, n, 2), miss the epipolar lines at best, (k,), scene units rms.

    Its image may be shifted. One instant in ten is left out. Infinite where too few are left.
    """
    design, target = epipolar_rows(lines, other, theirs)
    shift = np.broadcast_to(lines[0], design.shape)
    design = shift if other.is_calibrated else np.concatenate((design, shift), axis=-1)
    seen = np.isfinite(target) & np.isfinite(design).all(axis=-1)
    design, target = np.where(seen[..., None], design, 0), np.where(seen, target, 0)
    fits = seen
    for _ in range(2):
        used, wanted = np.where(fits[..., None], design, 0), np.where(fits, target, 0)
        solution = np.linalg.pinv(used) @ wanted[..., None]
        missed = np.where(seen, np.abs((design @ solution)[..., 0] - target), np.nan)
        enough = fits.sum(axis=1) > 2 * design.shape[-1]
        most = (TRIMMED * np.maximum(seen.sum(axis=1) - 1, 0)).astype(int)
        fits = seen & (missed <= np.take_along_axis(np.sort(missed), most[:, None], axis=1))
    total = np.sum(np.where(fits, missed, 0) ** 2, axis=1)
    return np.where(enough, np.sqrt(total / np.maximum(fits.sum(axis=1), 1)), np.inf)


def score(fit: Adjustment) -> float:
    """What is left, if errors are normal but for some outliers: by the better part of them."""
    # The share of them in which there is no outlier.
    return fit.left(0.7)


def in_common(fit: Adjustment) -> bool:
    """Whether the views have enough in common to tell the clocks."""
    told = np.isfinite(fit.misses).any(axis=1).sum()
    return bool(3 * told > np.isinf(fit.errors[:, _TIMES]).sum())


def agrees(fit: Adjustment) -> bool:
    """Whether residuals are small, and not like those of the next frame.

    Noise of the tracks, however large, is no reason to look for other lags.
    """
    alike = max(persistence(fit.misses[fit.used]), 0.0)
    misfit = score(fit) * np.sqrt(alike / _PERSISTENT)
    return bool(alike <= _PERSISTENT and misfit <= DISAGREEMENT and score(fit) <= GROSS)


def near(fit: Adjustment, lags: Floats) -> bool:
    """Whether its lags are those."""
    # Frames; lags closer than that are one and the same.
    return bool(np.abs(fit.footage.lags - lags).max() < 1.0)


def shares(fit: Adjustment) -> Floats:
    """Share of each lag's squared slope that is motion and not noise, between 0 and 1.

    Interpolated noise has a slope, too: with a variance of half of the noise's, as it is taken
    between two frames that are two apart.
    """
    slopes = fit.reduced.slopes[fit.used].reshape(-1, len(fit.prior))
    slopes = np.vstack((slopes, fit.noise * np.diag(np.sqrt(fit.prior))))  # what is known counts
    parts = np.argwhere(fit.free)[:, 1]
    lags, others = slopes[:, parts == LAG], slopes[:, ~np.isin(parts, _TIMES)]
    lags = lags - others @ np.linalg.lstsq(others, lags)[0] if others.size else lags
    # Of the two numbers of each of k views, the point leaves 2 - 3 / k.
    seen = np.isfinite(fit.misses[fit.used, ::2].T)
    views = np.maximum(seen.sum(axis=0), 2)
    freedom = np.maximum((seen * (2 - 3 / views)).sum(axis=1)[1:], 1e-9)
    speeds = fit.footage.rates[1:]
    chance = 0.5 * fit.noise**2 * speeds**2 * (freedom + 2 * np.sqrt(2 * freedom))
    total = np.sum(lags**2, axis=0)
    return np.clip((total - chance) / np.maximum(total, 1e-300), 0, 1)


def covariance(fit: Adjustment) -> Floats:
    """Of lags and drifts, if that of cameras is known as well as the tracks tell it."""
    cameras, parts = np.argwhere(fit.free).T
    order = np.concatenate([np.flatnonzero(parts == part) for part in _TIMES])
    # Slopes that are noise add to the information, but mend nothing.
    share = np.append(1.0, np.maximum(shares(fit), 1e-9))[cameras[order]]
    factor = fit.factor[order] / share[:, None]
    return factor @ factor.T


def drifted(fit: Adjustment) -> Adjustment:
    """The same with drifts of clocks, if any are clear and large enough to matter."""
    errors, off = fit.errors.copy(), np.zeros(len(fit.errors))
    errors[1:, DRIFT] = fit.footage.drift_error
    free = adjust(fit.given, fit.start, errors, begin=fit.change)
    off[1:] = np.sqrt(np.diag(covariance(free)))[len(off) - 1 :]
    # Standard errors by which a clock must drift, and frames over the whole video.
    clear = np.abs(free.change[:, DRIFT]) > np.maximum(4.0 * off, 0.05)
    if not clear.any():
        return fit
    errors[~clear, DRIFT] = 0.0
    found = adjust(fit.given, fit.start, errors, begin=np.where(errors > 0, free.change, 0.0))
    return found if in_common(found) else fit


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
        As for `learn_cameras`; the readouts of shutters are told in frames of the first video.
    rates : array_like, shape (m,), optional
        Frames of each video in one frame of the first; by default one. Errors of these, of about
        1 % at most, are learned where the videos are long enough to tell them.
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
    footage = Footage.of(tracks, check_lags("start", start, len(tracks)), rates, clocks)
    rig = posed(footage.aligned, rig, synchronous=False)
    with bar(progress, "synchronise", unit="fit") as shown:
        return replace(_learned(_Videos.of(footage, rig, shown)), clocks=footage.clocks)


@dataclass(frozen=True, eq=False)
class _Videos:
    """The tracks as functions of time, what is known of the cameras, and a bar to move, if any.

    The lags of `given` are tried first.
    """

    given: Footage
    known: tuple[Camera, ...]
    shown: tqdm | None = None

    @classmethod
    def of(cls, given: Footage, rig: Rig, shown: tqdm | None = None) -> _Videos:
        """Of footage as it is given, with its shutters."""
        still = at_once(paced(rig, 1 / given.rates).cameras, given.tracks)
        instant = tuple(replace(camera, readout=0.0) for camera in rig.cameras)
        return cls(Footage.of(still, given.lags, given.rates, given.clocks), instant, shown)

    def cameras(self, footage: Footage) -> tuple[Camera, ...] | None:
        """Those that the closed form finds; None if it finds none."""
        try:
            return closed_form(footage.aligned, self.known, checked=False)
        except ValueError:
            return None

    def errors(self, rough: bool = False, loose: bool = False) -> Floats:
        """What is known of cameras, and of all lags but the first one's nothing."""
        errors = np.array([known_to(camera) for camera in self.known])
        # Some instants are too few to tell where the target was between two.
        if rough and len(self.given.instants) > INSTANTS:
            errors[:, PARTS["readout"]] = 0.0
        errors[1:, LAG] = np.inf
        if loose:
            ways = PARTS["normal"] + PARTS["angle"] + PARTS["scale"]
            # As a hand measures tilts, log scales and angles: three degrees, 5 %.
            errors[:, ways] = np.where(errors[:, ways] == 0, 0.05, errors[:, ways])
        return errors

    def fitted(self, lags: Floats, rough: bool = False, loose: bool = False) -> Adjustment | None:
        """The best lags near given ones, or better ones than these; None if nothing fits."""
        if self.shown is not None:
            self.shown.update()
        footage = replace(self.given.some if rough else self.given, lags=lags)
        cameras = self.cameras(footage)
        if cameras is None:
            return None
        found = adjust(footage, cameras, self.errors(rough, loose), most=8 if rough else STEPS)
        return found if in_common(found) else None


# ------------------------------------------------------------------------------------- the search


def _learned(videos: _Videos) -> Lags:
    """`learn_lags` of what was checked."""
    first = videos.given.lags
    begun = videos.fitted(first)
    if begun is not None and agrees(begun) and (near(begun, first) or not shares(begun).all()):
        return _told(videos, drifted(begun))
    loose, sampled = _searched(videos)
    close = [s for s in sampled if score(s) <= max(2 * ALIKE * score(sampled[0]), FINE)]
    chosen = _different(close[:_SHOWN] + sorted(close, key=_moved)[:_SHOWN])
    every = [videos.fitted(s.footage.lags, loose=loose) for s in chosen]
    found = sorted(_different([f for f in every if f]), key=score)
    if not found:
        return _untold(videos)
    if not agrees(found[0]):  # as no lag does, where clocks drift by more than a part of a frame
        found = sorted(map(drifted, found), key=score)
    alike = [f for f in found if score(f) <= max(ALIKE * score(found[0]), FINE)]
    if len(alike) > 1 and score(found[0]) > DISAGREEMENT:
        return _untold(videos)
    best = min(alike, key=lambda f: (not near(f, first), _moved(f)))
    told = _told(videos, drifted(best))
    if len(alike) > 1 and not near(best, first):
        choices = [best, *(f for f in alike if f is not best)]
        warning = untold_lags([f.footage.lags for f in choices])
        told = replace(told, warnings=(warning, *told.warnings))
    return told


def _searched(videos: _Videos) -> tuple[bool, list[Adjustment]]:
    """Whether cameras should be loose, and fits to some of the instants, the best first."""
    promising = [dips(*misses)[:8] or [0.0] for misses in lag_misses(videos.given, videos.known)]
    exact = _climbed(videos, promising, False)
    if not exact or score(exact[0]) <= FINE:
        return False, exact
    if score(exact[0]) <= DISAGREEMENT:
        other = videos.fitted(exact[0].footage.lags, rough=True, loose=True)
        if other is None or score(other) * BETTER >= score(exact[0]):
            return False, exact
    # Where the rig is wrong, its best lags may be wrong as well: so all are tried again.
    loose = _climbed(videos, promising, True)
    told = score(exact[0]) > DISAGREEMENT or (loose and shares(loose[0]).all())
    if loose and told and score(loose[0]) * BETTER < score(exact[0]):
        return True, loose
    return False, exact


def _climbed(videos: _Videos, promising: list[list[float]], loose: bool) -> list[Adjustment]:
    """Fits to some instants from the most promising lags and all that differ from the best in one.

    The best are tried in all combinations with the others' until none is better.
    """
    count = len(promising)
    tried: dict[tuple[float, ...], Adjustment | None] = {}

    def fits(lags: Floats) -> float:
        key = tuple((lags - lags[0]).tolist())
        if key not in tried:
            tried[key] = videos.fitted(np.array(key), True, loose)
        found = tried[key]
        return np.inf if found is None else found.left()

    best = np.array([lags[0] for lags in promising])
    fits(videos.given.lags)
    while True:
        moved = ((i, lag) for i in range(count) for lag in promising[i])
        winner = min((np.where(np.arange(count) == i, lag, best) for i, lag in moved), key=fits)
        if fits(winner) >= fits(best):
            break
        best = winner
    return _different(sorted((f for f in tried.values() if f is not None), key=score))


def _moved(fit: Adjustment) -> float:
    """By how many frames all videos are late, together."""
    return float(np.abs(fit.footage.lags).sum())


def _different(found: list[Adjustment]) -> list[Adjustment]:
    """The first of all that have the same lags."""
    lags = [one.footage.lags for one in found]
    return [f for k, f in enumerate(found) if not any(near(f, other) for other in lags[:k])]


# --------------------------------------------------------------------- errors, and what is told


def _told(videos: _Videos, fit: Adjustment) -> Lags:
    """What a fit tells of the lags, or that it tells nothing."""
    lags, count = fit.footage.lags.copy(), len(fit.start) - 1
    if not shares(fit).all():
        return _untold(videos, fit if score(fit) <= DISAGREEMENT else None)
    together, rate_errors = covariance(fit), np.zeros(len(lags))
    drifting = fit.errors[:, DRIFT] > 0
    rate_errors[drifting] = np.sqrt(np.diag(together)[count:]) / fit.footage.span
    # Lags are those of the first instant, those of the fit of the middle.
    moved = np.hstack((np.eye(count), -np.eye(count)[:, drifting[1:]] * fit.footage.middle
                       / fit.footage.span))  # fmt: skip
    variance = moved @ together @ moved.T
    errors = np.sqrt(np.append(0.0, np.diag(variance)))
    # Schwarz's criterion: a fraction is one more unknown per video.
    rounded = np.rint(lags) + 0.0  # and not -0
    beside = (rounded - lags)[1:]
    if beside @ np.linalg.pinv(variance) @ beside < count * np.log(fit.used.sum()):
        lags = rounded
    # Frames, beyond which a lag counts as unknown.
    warnings = [_blurred(i, lags) for i in range(len(lags)) if errors[i] > 0.5]
    if not fit.settled:
        warnings.append(
            f"the search for the lags of the videos did not converge in {fit.steps} steps: give "
            "the lags if you know them"
        )
    return Lags(
        lags, fit.footage.rates, errors, fit.left(), tuple(warnings), rate_errors=rate_errors
    )


def _untold(videos: _Videos, fit: Adjustment | None = None) -> Lags:
    """Lags of which the tracks tell nothing: whole ones near a fit that agrees, if one does.

    The first one is the clock.
    """
    lags, residual = videos.given.lags, np.inf
    errors = np.where(np.arange(len(lags)) > 0, np.inf, 0.0)
    if fit is not None:
        lags, residual = np.rint(fit.footage.lags) + 0.0, fit.left()  # and not -0
    elif (cameras := videos.cameras(videos.given)) is not None:
        residual = max(map(trimmed, missed(cameras, videos.given.aligned)))
    warnings = [_blurred(i, lags) for i in range(1, len(lags))]
    if fit is None:
        left = f"leave {residual:.2g} pixels" if residual < np.inf else "no cameras fit"
        warnings = [
            f"no lags of the videos make the views agree: ({list_lags(lags)}) frames were taken, "
            f"which {left}; check the rig, or give the lags if you know them"
        ]
    return Lags(lags, videos.given.rates, errors, residual, tuple(warnings))


def _blurred(i: int, lags: Floats) -> str:
    """That many lags of a video fit."""
    return (
        f"the lag of video {i + 1} cannot be told, because the target moves too little or too "
        f"slowly: {lags[i]:g} frames were taken; give the lags if you know them"
    )


class Mistake(NamedTuple):
    """What explains that the views did not agree; footage and rig without it, and the lags."""

    text: str
    footage: Footage
    rig: Rig
    lags: Lags


def _paired(footage: Footage, cameras: Sequence[Camera]) -> tuple[float, Floats]:
    """By how much two views disagree at their best lags, all pairs; and these lags."""
    each = [*lag_misses(footage, cameras, most=60)]
    lags = np.array([tried[left.argmin()] for tried, left in each])
    return float(np.linalg.norm([left.min() for _, left in each])), lags - lags[0]


def _fits(footage: Footage, rig: Rig, *lags: Floats) -> list[Adjustment]:
    """Cameras and lags near these, roughly."""
    videos = _Videos.of(footage, rig)
    found = [videos.fitted(each, rough=True) for each in np.unique(lags, axis=0)]
    return [fit for fit in found if fit]


def _near(footage: Footage, rig: Rig) -> list[Adjustment]:
    """Near its lags and the best of two views, which are as rough as the rig."""
    return _fits(footage, rig, footage.lags, _paired(footage, rig.cameras)[1])


def find_mistake(given: Footage, rig: Rig, names: Sequence[str]) -> Mistake | None:
    """The one mistake without which the views agree; None if they do anyway, or with none.

    Parameters
    ----------
    given : Footage
        Its lags are tried first.
    rig : Rig
        See `learn_lags`.
    names : sequence of str
        What the videos are called.
    """
    with suppress(ValueError):  # what cannot be compared is told where cameras and lags are learned
        begun = _near(given, rig)
        left = min(map(_worst, begun), default=np.inf)
        if left <= 2 * DISAGREEMENT:
            return None
        # Whole views are not mistaken where most frames agree.
        most = min((fit.left() for fit in begun), default=np.inf) <= 2 * DISAGREEMENT
        # Two views of which a scale is unknown agree mirrored as well: they rank, and refuse none.
        ranked = [
            (*_paired(mended, known.cameras), what, mended, known)
            for kind in ((_dropped,) if most else (_dropped, _whole))
            for what, mended, known in kind(given, rig, names)
        ]
        # Those that mend most, with all cameras.
        tried = [
            (_worst(fit), fit, what, mended, known)
            for _, best, what, mended, known in sorted(ranked, key=itemgetter(0))[:16]
            for fit in _fits(mended, known, given.lags, best)
        ]
        for now, fit, what, mended, known in sorted(tried, key=itemgetter(0)):
            # Times by which it has to mend the disagreement of all views together.
            if now > GROSS or 3.0 * now >= left:
                break
            told = learn_lags(mended.tracks, known, mended.rates, fit.footage.lags, mended.clocks)
            if not told.agree or told.residual > 2 * DISAGREEMENT:
                continue
            if _as_well(given, rig, told):
                break
            others = [o for n, _, o, *_ in tried if n <= ALIKE * max(now, FINE)]
            alike = ", and ".join(dict.fromkeys(o for o in others if o != what))
            text = (
                f"the rig does not agree with the tracks as they are given: {what} explains it "
                f"({told.residual:.2g} pixels apart instead of {left:.3g}), and was put right "
                "here: do so in what is given"
            ) + (f"; as well do {alike}: another path" if alike else "")
            return Mistake(text, mended, known, told)
    return None


def _as_well(given: Footage, rig: Rig, mended: Lags) -> bool:
    """Whether smaller lags explain it as well, of a motion that repeats itself."""
    moved = np.abs(mended.frames - given.lags).sum()
    if moved <= 1:
        return False
    told = learn_lags(given.tracks, rig, given.rates, given.lags, given.clocks)
    smaller = np.abs(told.frames - given.lags).sum() + 1 < moved
    return bool(told.agree and smaller and told.residual <= ALIKE * max(mended.residual, FINE))


def _worst(fit: Adjustment) -> float:
    """Pixels by which the worst view disagrees in the worst part of the video, but for outliers."""
    parts = np.array_split(fit.misses, 20)
    views = [view for part in parts for view in np.split(part, len(fit.start), axis=1)]
    return max(trimmed(view, 0.5) for view in views)


def _whole(given: Footage, rig: Rig, names: Sequence[str]) -> Iterator[tuple[str, Footage, Rig]]:
    """All that change whole views: whose camera it is, their axes, rates taken for each other."""
    count, sizes = len(names), [camera.image_size for camera in rig.cameras]
    unpaced = paced(rig, 1 / given.rates).cameras
    for moved, order in _orders(count):
        if len({sizes[i] for i in moved}) == 1:
            how = "swapped" if len(moved) == 2 else "in another order than their cameras"
            what = f"{' and '.join(names[i] for i in moved)} {how}"
            others = replace(rig, cameras=tuple(unpaced[i] for i in order))
            yield what, given, paced(others, given.rates)
    known = {i for i, camera in enumerate(rig.cameras) if camera.is_calibrated}
    for views in (*({i} for i in range(count)), {*range(count)}):
        told, ways = "all views", ["mirrored", "with v counted upwards"]
        if len(views) == 1:
            told = names[min(views)]
            # Half a turn from a mirrored view is one with v counted upwards: an angle that is
            # learned takes it up, or those of all others do.
            if known <= views:
                ways = [", or ".join(ways) + ": then the path has the other sign"]
            elif not known & views:
                ways = [", or ".join(ways)]
        for axis, how in enumerate(ways):
            each = enumerate(zip(given.tracks, np.array(sizes) - 1, strict=True))
            turned = np.arange(2) == axis
            tracks = [np.where(turned & (i in views), side - x, x) for i, (x, side) in each]
            yield f"{told} {how}", Footage.of(tracks, None, given.rates, given.clocks), rig
    for i, (real, stated) in product(range(count), RATES):
        rates = np.where(np.arange(count) == i, real / stated, 1.0) * given.rates
        what = f"{names[i]} with {real} frames for {stated} that are supposed"
        yield what, Footage.of(given.tracks, given.lags, rates, given.clocks), rig


def _orders(count: int) -> Iterator[tuple[tuple[int, ...], list[int]]]:
    """Orders in which two views change places, or three of a few in a ring; and which these are."""
    for size in (2, 3) if count < 6 else (2,):
        for moved, turn in product(combinations(range(count), size), range(1, size)):
            order = np.arange(count)
            order[[*moved]] = np.roll(moved, turn)
            yield moved, order.tolist()


def _dropped(given: Footage, rig: Rig, names: Sequence[str]) -> Iterator[tuple[str, Footage, Rig]]:
    """Videos of which frames were dropped, with the clocks by which they agree all the time."""
    length, ways = given.lengths.min(), []
    # Parts of the videos: in one of them none is dropped, maybe: its cameras tell when.
    for low, high in ((0.0, 0.4), (0.3, 0.7), (0.6, 1.0)):
        begins, ends = length * np.outer([low, high], given.rates)
        rows = [(b <= c) & (c <= e) for b, c, e in zip(begins, given.clocks, ends, strict=True)]
        tracks, clocks = (
            [x[r] for x, r in zip(each, rows, strict=True)] for each in (given.tracks, given.clocks)
        )
        if min(map(len, tracks)) > 1:
            part = Footage.of(tracks, given.lags, given.rates, clocks)
            ways += [_jumped(given, given, fit) for fit in _near(part, rig)]
    for _ in range(3):  # as what is mended tells the cameras, and these the rest
        if not ways:
            return
        _, lags, found = min(ways, key=lambda way: way[0])
        ways = [_jumped(given, found, fit) for fit in _fits(found, rig, lags)]
    lacking = [np.diff(now - then) for now, then in zip(found.clocks, given.clocks, strict=True)]
    told = [
        f"{missing[k]:.0f} frames dropped of {name} before its frame {k + 1}"
        for name, missing in zip(names, lacking, strict=True)
        for k in np.flatnonzero(missing)
    ]
    if told:  # of several places one may have taken a few frames of another
        about = "about " if len(told) > 1 else ""
        yield ", ".join(about + one for one in told), found, rig


def _jumped(given: Footage, mended: Footage, fit: Adjustment) -> tuple[float, Floats, Footage]:
    """With the clock of one video set forward at some frames; what is missed, and its lags.

    The lags that leave the least, each jump at a price, by dynamic programming.
    """
    lags, rates, tried = fit.footage.lags, mended.rates, np.arange(-_LONGEST, _LONGEST + 1)
    curves, missed_before, ways = mended.curves, 0.0, []
    each = zip(fit.cameras, given.clocks, curves, strict=True)
    for i, (camera, stated, curve) in enumerate(each):
        stride = -(-len(stated) // 1500)  # jumps are sought at so many frames at most
        late = (curve.clock - stated)[::stride]
        middle = np.rint(late.mean())
        instants = (stated[::stride] + middle + tried[:, None]) / rates[i] + lags[i]
        missed = np.full((len(curves), *instants.shape), np.nan)
        for j, other in enumerate(fit.cameras):
            if j != i:
                lines = epipolar_lines(camera, curve.track[::stride], other)
                theirs = curves[j].at((instants - lags[j]) * rates[j])
                missed[j] = epipolar_rows(lines, other, theirs)[1] / other.calibration[0]
        seen, costs = np.isfinite(missed), np.log1p((missed / DISAGREEMENT) ** 2)
        cost = np.nansum(costs, axis=0) / np.maximum(seen.sum(axis=0), 1)
        # What nobody saw costs as much as what was seen: no lag is better for leaving frames out.
        cost[~seen.any(axis=0)] = np.nanmean(costs) if seen.any() else 0.0
        states = np.clip(late - middle + _LONGEST, 0, 2 * _LONGEST).astype(int)
        path = _cheapest(cost.T)
        before, least = (
            cost[way, np.arange(len(way))].sum() + _PRICE * np.count_nonzero(np.diff(way))
            for way in (states, path)
        )
        missed_before += before / len(late) / 2  # as each pair of views counts twice
        later = np.repeat(tried[path] + middle, stride)[: len(stated)]
        ahead = np.where(np.arange(len(curves)) == i, later[0] / rates[i], 0.0) + lags
        clocks = [stated + later - later[0] if one is curve else one.clock for one in curves]
        gain = (before - least) / len(late)
        ways.append((gain, ahead - ahead[0], Footage.of(mended.tracks, None, rates, clocks)))
    gain, lags, found = max(ways, key=lambda way: way[0])
    return missed_before - gain, lags, found


def _cheapest(costs: Floats) -> Ints:
    """The cheapest way through states of such costs, (n, k), each change at a price; none falls."""
    states, total = np.arange(costs.shape[1]), costs[0]
    came = np.zeros(costs.shape, dtype=int)
    for k, cost in enumerate(costs[1:], 1):
        least = np.minimum.accumulate(total)
        came[k] = np.maximum.accumulate(np.where(total == least, states, 0))
        stay = total <= least + _PRICE
        came[k][stay] = states[stay]
        total = total[came[k]] + np.where(stay, 0.0, _PRICE) + cost
    path = [int(total.argmin())]
    for before in came[:0:-1]:
        path.append(int(before[path[-1]]))
    return np.array(path[::-1])
