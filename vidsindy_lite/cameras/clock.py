"""The clock of several videos: their tracks at the same instants.

The frames of the first video are the clock. Camera i starts `lag` of them later and takes `rate`
frames during each, so that the instant k of the clock is its frame (k - lag) * rate. Between two
frames a track is interpolated, so lags need not be whole.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline

from ..arrays import Floats
from ..checks import check_positive, check_tracks, check_vector

Curve = Callable[[Floats], Floats]
"""A track as a function of the frame number, whole or not."""

_FARTHEST = 1e9  # frames by which a video may start later; and ...
_FASTEST = 1e6  # ... times as many frames that one may take: more is no lag and no rate


def align(
    tracks: Sequence[Floats], lags: ArrayLike, rates: ArrayLike | None = None
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
    shifts = check_lags("lags", lags, len(tracks))
    speeds = check_rates(rates, len(tracks))
    return aligned([curve(track) for track in tracks], shifts, speeds, len(tracks[0]))


def aligned(
    curves: Sequence[Curve], lags: Floats, rates: Floats, frames: int
) -> tuple[Floats, ...]:
    """What each curve shows at so many frames of the clock."""
    clock = np.arange(frames)
    return tuple(c((clock - lag) * r) for c, lag, r in zip(curves, lags, rates, strict=True))


def curve(track: Floats) -> Curve:
    """A track as a function of the frame number, whole or not: a cubic spline through its frames.

    Its values are NaN outside, and unless the target is seen in the frames before and after.
    """
    shown = np.asarray(np.isfinite(track).all(axis=1))
    seen = np.flatnonzero(shown)
    spline = make_interp_spline(seen, track[seen], k=min(3, len(seen) - 1)) if len(seen) else None

    def at(frames: Floats) -> Floats:
        inside = (frames >= 0) & (frames <= len(track) - 1)
        frames = np.where(inside, frames, 0)
        low, high = np.floor(frames).astype(int), np.ceil(frames).astype(int)
        inside[inside] = shown[low[inside]] & shown[high[inside]]
        values = np.full((len(frames), 2), np.nan)
        whole = inside & (low == high)
        values[whole] = track[low[whole]]
        between = inside & (low != high)
        if spline is not None and between.any():
            values[between] = spline(frames[between])
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
