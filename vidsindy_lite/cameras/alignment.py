"""Tracks of all videos at the same instants: the frames of the first video.

Camera i starts `lag` frames of the first video later and takes `rate` frames during each, so that
the instant k is its frame (k - lag) * rate. Between two frames a track is interpolated, so lags
need not be whole. Frames that were dropped, or taken at uneven times, keep the numbers that an even
camera would have given them: that is the video's `clock`, 0, 1, 2, ... for an even one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline

from ..arrays import Floats
from ..checks import check_positive, check_tracks, check_vector

_FARTHEST = 1e9  # frames by which a video may start later; and ...
_FASTEST = 1e6  # ... times as many frames that one may take: more is no lag and no rate
_WIDEST = 2.5  # frames between two that a track is interpolated from: one of them may be dropped

Curve = Callable[[Floats], Floats]
"""A track as a function of the frame number, whole or not."""


def align(
    tracks: Sequence[Floats],
    lags: ArrayLike,
    rates: ArrayLike | None = None,
    clocks: Sequence[ArrayLike] | None = None,
) -> tuple[Floats, ...]:
    """Tracks of all videos at the instants of the first video's frames.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n_i, 2)
        One per video, frame by frame; NaN = not seen.
    lags : array_like, shape (m,)
        By how many frames of the first video each one starts later; only differences count.
    rates : array_like, shape (m,), optional
        Frames of each video in one frame of the first; by default one.
    clocks : sequence of array_like, shape (n_i,), optional
        When each frame was taken, in frames of its video at an even rate: by default 0, 1, 2, ...;
        0, 1, 3, 4, ... if one was dropped.

    Returns
    -------
    tuple of ndarray, shape (n_0, 2)
        NaN where a video has not begun, has ended, or does not show the target in the frames before
        and after, or these are more than one dropped frame apart. At whole frames these are the
        tracks themselves.

    Raises
    ------
    ValueError
        If a track has a wrong shape or an infinite value, or there is not one finite lag, positive
        rate, or increasing clock, per track, or a lag or rate is absurdly large or small.
    """
    tracks = check_tracks(tracks)
    shifts = check_lags("lags", lags, len(tracks))
    speeds = check_rates(rates, len(tracks))
    ticks = check_clocks(clocks, tracks)
    return aligned(tuple(map(curve, tracks, ticks)), shifts, speeds, ticks[0])


def aligned(
    curves: Sequence[Curve], lags: Floats, rates: Floats, clock: Floats
) -> tuple[Floats, ...]:
    """What each curve shows at the instants of the clock."""
    return tuple(c((clock - lag) * r) for c, lag, r in zip(curves, lags, rates, strict=True))


def curve(track: Floats, clock: Floats) -> Curve:
    """A track as a function of the frame number, whole or not: a spline through its frames.

    Its values are NaN outside, and unless the target is seen in the frames before and after, and
    these are close to each other.
    """
    shown = np.asarray(np.isfinite(track).all(axis=1))
    seen = np.flatnonzero(shown)
    if not seen.size:
        return lambda frames: np.full((len(frames), 2), np.nan)
    # Where a frame was dropped, a cubic is off by some ten times as much as between two frames.
    degree = 3 if (clock == np.arange(len(clock))).all() else 5
    spline = make_interp_spline(clock[seen], track[seen], k=min(degree, len(seen) - 1))

    def at(frames: Floats) -> Floats:
        within = np.clip(frames, clock[0], clock[-1])
        low = np.searchsorted(clock, within, "right") - 1
        high = np.searchsorted(clock, within, "left")
        values = np.where((low == high)[:, None], track[low], spline(within))
        near = clock[high] - clock[low] <= _WIDEST
        values[~((frames == within) & shown[low] & shown[high] & near)] = np.nan
        return values

    return at


def check_lags(name: str, lags: ArrayLike, count: int) -> Floats:
    """One lag per video, counted from the first one's."""
    checked = check_vector(name, lags, count)
    far = np.abs(checked).max()
    if far > _FARTHEST:
        raise ValueError(f"{name}: must be at most {_FARTHEST:g} frames, got {far:g}")
    return checked - checked[0]


def check_rates(given: ArrayLike | None, count: int) -> Floats:
    """One rate per video, in units of the first one's."""
    rates = np.ones(count) if given is None else check_vector("rates", given, count)
    for rate in rates:
        if not 1 / _FASTEST <= check_positive("rates", rate) <= _FASTEST:
            raise ValueError(
                f"rates: must be between {1 / _FASTEST:g} and {_FASTEST:g}, got {rate:g}"
            )
    return rates / rates[0]


def check_clocks(given: Sequence[ArrayLike] | None, tracks: Sequence[Floats]) -> tuple[Floats, ...]:
    """When each frame of each track was taken, the first one at zero."""
    if given is None:
        return tuple(np.arange(len(track), dtype=float) for track in tracks)
    if len(given) != len(tracks):
        raise ValueError(f"clocks: must be one per track, got {len(given)} for {len(tracks)}")
    clocks = []
    for i, (clock, track) in enumerate(zip(given, tracks, strict=True)):
        checked = check_vector(f"clocks[{i}]", clock, len(track))
        if (np.diff(checked) <= 0).any():
            raise ValueError(f"clocks[{i}]: must increase, got {checked!r:.60}")
        clocks.append(checked - checked[0])
    return tuple(clocks)
