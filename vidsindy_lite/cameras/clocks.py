"""Lags and clocks of videos, and their tracks at the same instants: the frames of the first video.

Camera i starts `lag` frames of the first video later and takes `rate` frames during each, so that
the instant k is its frame (k - lag) * rate. Between two frames a track is interpolated, so lags
need not be whole. Frames that were dropped, or taken at uneven times, keep the numbers that an even
camera would have given them: that is the video's `clock`, 0, 1, 2, ... for an even one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_interp_spline
from scipy.ndimage import minimum_filter1d

from ..arrays import Bools, Floats
from ..checks import check_items, check_positive, check_times, check_tracks, check_vector, shown

INSTANTS = 300  #: At which views are compared before all frames are.
SAME_RATE = 0.01  #: Relative difference of frame rates that are the same.
OVERLAP = 0.5  #: Share of the shorter of two videos that both must show.
_FARTHEST = 1e9  # frames by which a video may start later; and ...
_FASTEST = 1e6  # ... times as many frames that one may take: more is no lag and no rate


@dataclass(frozen=True)
class Lags:
    """Lags of the videos.

    Parameters
    ----------
    frames : ndarray, shape (m,)
        By how many frames of the first video each one starts later than the first.
    rates : ndarray, shape (m,)
        Frames of each video in one frame of the first: as given, or as learned where a clock runs
        fast or slow.
    errors : ndarray, shape (m,)
        Standard errors of the lags; infinite if the tracks do not tell them, zero if they were
        given. Lags that whole numbers fit as well are whole.
    residual : float
        Residual of the worst camera that one frame in ten exceeds, pixels, with the cameras that
        fit these lags best; see `learn_lags`.
    warnings : tuple of str
        Why the lags should not be trusted, with advice.
    clocks : tuple of ndarray, shape (n_i,)
        When each frame was taken, see `align`.
    rate_errors : ndarray, shape (m,)
        Standard errors of the rates that were learned, zero of the others; empty if none was.
    """

    frames: Floats
    rates: Floats
    errors: Floats
    residual: float
    warnings: tuple[str, ...] = ()
    clocks: tuple[Floats, ...] = field(default=(), repr=False)
    rate_errors: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def agree(self) -> bool:
        """Whether the lags are known: the views agree at these and not at others."""
        return bool(np.isfinite(self.errors).all())

    def frame_at(self, i: int, instant: int) -> int:
        """Which frame of video i is closest to one of the first; below 0 if none was yet."""
        clock, sought = self.clocks[i], (self.clocks[0][instant] - self.frames[i]) * self.rates[i]
        return int(np.rint(np.interp(sought, clock, np.arange(len(clock)), -1, len(clock))))


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
        NaN where a video has not begun, has ended, or of the frames around two in a row do not show
        the target or were dropped. At whole frames these are the tracks themselves.

    Raises
    ------
    ValueError
        If a track has a wrong shape or an infinite value, or there is not one finite lag, positive
        rate, or increasing clock, per track, or a lag or rate is absurdly large or small.
    """
    return Footage.of(check_tracks(tracks), lags, rates, clocks).aligned


def list_lags(lags: Sequence[float] | Floats) -> str:
    """Lags as text, to a hundredth of a frame, e.g. ``0, 7, -12.5``."""
    return ", ".join(f"{round(lag, 2) + 0.0:g}" for lag in lags)


def untold_lags(choices: Sequence[Floats]) -> str:
    """What to say where several choices of lags fit; the first three are named."""
    lags = " or ".join(f"({list_lags(lags)})" for lags in choices[:3])
    return (
        f"the lags of the videos cannot be told: {lags} frames fit about equally well, because "
        "the motion repeats itself, or is in a plane before cameras that nobody measured; give the "
        "lags if you know them"
    )


def dips(lags: Floats, missed: Floats) -> list[float]:
    """Whole lags at which less is missed than at all near by, the lowest first."""
    # Of seven lags in a row, the search goes from any to the best.
    low = np.flatnonzero(np.isfinite(missed) & (missed == minimum_filter1d(missed, 7)))
    return lags[low[np.argsort(missed[low])]].tolist()


@dataclass(frozen=True, eq=False)
class Curve:
    """A track as a function of the frame number, whole or not: a spline through its frames.

    Parameters
    ----------
    track : ndarray, shape (n, 2)
        NaN where the target is not seen.
    clock : ndarray, shape (n,)
        Numbers of its frames.
    """

    track: Floats
    clock: Floats

    @cached_property
    def shown(self) -> Bools:
        """Frames that show the target."""
        return np.asarray(np.isfinite(self.track).all(axis=1))

    @cached_property
    def _seen(self) -> tuple[Floats, Floats]:
        """Numbers and places of the frames that show the target; of all if none does, and NaN."""
        rows = self.shown if self.shown.any() else slice(None)
        return self.clock[rows], self.track[rows]

    @cached_property
    def _spline(self) -> BSpline:
        # Where a frame was dropped, a cubic is off by some ten times as much as between two frames.
        degree = 3 if _is_even(self.clock) else 5
        most = len(self._seen[0]) - 1
        return make_interp_spline(*self._seen, k=min(degree, most), check_finite=False)

    def at(self, frames: Floats) -> Floats:
        """Pixels, (..., 2).

        NaN outside, at frames that do not show the target, and between two that do and are not
        close to each other.
        """
        seen, places = self._seen
        within = np.clip(frames, seen[0], seen[-1])
        low, high = np.searchsorted(seen, within, "right") - 1, np.searchsorted(seen, within)
        values, between = places[low], low != high
        if between.any():
            values[between] = self._spline(within[between])
        row = np.searchsorted(self.clock, within)
        hidden = (self.clock[row] == within) & ~self.shown[row]
        # Frames between two that it is interpolated from: one of them may be dropped, or hidden.
        values[(frames != within) | hidden | (seen[high] - seen[low] > 2.5)] = np.nan
        return values

    def averaged(self, step: float) -> Curve:
        """Of means over five places, `step` frames apart: its noise is alike in and between frames.

        NaN where it was, and where they are not all within the video.
        """
        window = self.clock[:, None] + step * np.arange(-2, 3)
        inside = (window >= self.clock[0]).all(axis=1) & (window <= self.clock[-1]).all(axis=1)
        means = np.array([1, 4, 6, 4, 1]) / 16 @ self._spline(window)
        return Curve(np.where((self.shown & inside)[:, None], means, np.nan), self.clock)

    def slope(self, frames: Floats) -> Floats:
        """Pixels a frame, (n, 2), from the frame before to the frame after.

        Over whole frames, the noise of such a difference does not depend on that of the value
        between them: both ends share as much with it.
        """
        seen, _ = self._seen
        back, on = (np.clip(frames + step, seen[0], seen[-1]) for step in (-1, 1))
        return (self._spline(on) - self._spline(back)) / np.maximum(on - back, 1)[..., None]


@dataclass(frozen=True, eq=False)
class Footage:
    """What several videos show at the same instants, shape (n,), of the first one's clock.

    Lags and rates, (m,), are those of `align`. A frame of the first one lasts so many of those that
    rates were told in, which are its own but where another video was taken for it.
    """

    curves: tuple[Curve, ...]
    instants: Floats
    lags: Floats
    rates: Floats
    lasting: float = 1.0

    @classmethod
    def of(
        cls,
        tracks: Sequence[Floats],
        lags: ArrayLike | None = None,
        rates: ArrayLike | None = None,
        clocks: Sequence[ArrayLike] | None = None,
    ) -> Footage:
        """Of checked tracks; by default they are at the same instants already."""
        curves = tuple(map(Curve, tracks, check_clocks(clocks, tracks)))
        shifts, each = check_lags("lags", lags, len(tracks)), check_rates(rates, len(tracks))
        return cls(curves, curves[0].clock, shifts, each / each[0], 1 / each[0])

    @property
    def tracks(self) -> tuple[Floats, ...]:
        """Of each video, frame by frame."""
        return tuple(curve.track for curve in self.curves)

    @property
    def clocks(self) -> tuple[Floats, ...]:
        """When each frame of each video was taken, see `align`."""
        return tuple(curve.clock for curve in self.curves)

    @property
    def lengths(self) -> Floats:
        """Of all videos, in frames of the first, (m,)."""
        return np.array([clock[-1] + 1 for clock in self.clocks]) / self.rates

    @cached_property
    def span(self) -> float:
        """Frames from the first instant to the last."""
        return max(float(np.ptp(self.instants)), 1.0)

    @property
    def drift_error(self) -> float:
        """Frames by which a clock whose rate is told may be off at the last instant."""
        return SAME_RATE * self.span

    @cached_property
    def middle(self) -> float:
        """Half way between them."""
        return float(self.instants[0] + self.instants[-1]) / 2

    @cached_property
    def aligned(self) -> tuple[Floats, ...]:
        """The tracks at the instants, (n, 2)."""
        return tuple(curve.at(self.frames(i)) for i, curve in enumerate(self.curves))

    @property
    def some(self) -> Footage:
        """The same at some of the instants."""
        step = -(-len(self.instants) // INSTANTS)
        return replace(self, instants=self.instants[::step])

    def frames(self, i: int) -> Floats:
        """What video i shows at the instants: which of its frames."""
        return (self.instants - self.lags[i]) * self.rates[i]

    def later(self, lags: Floats, drifts: Floats) -> Footage:
        """If videos start later by `lags` in the middle, and by `drifts` more at the end, frames.

        The drift is counted from the first instant to the last.
        """
        slower = 1 - drifts / self.span
        behind = self.lags + lags - drifts * self.middle / self.span
        return replace(self, lags=behind / slower, rates=self.rates * slower)

    def slopes(self, i: int) -> tuple[Floats, Floats]:
        """Of the tracks of video i in its lag and in its drift, (n, 2) each."""
        lag = -self.rates[i] * self.curves[i].slope(self.frames(i))
        return lag, lag * ((self.instants - self.middle) / self.span)[:, None]


def check_lags(name: str, lags: ArrayLike | None, count: int) -> Floats:
    """One lag per video, counted from the first one's."""
    checked = np.zeros(count) if lags is None else check_vector(name, lags, count)
    far = np.abs(checked).max()
    if far > _FARTHEST:
        raise ValueError(f"{name}: must be at most {_FARTHEST:g} frames, got {far:g}")
    return checked - checked[0]


def check_rates(given: ArrayLike | None, count: int) -> Floats:
    """One rate per video."""
    rates = np.ones(count) if given is None else check_vector("rates", given, count)
    for rate in rates:
        if not 1 / _FASTEST <= check_positive("rates", rate) <= _FASTEST:
            raise ValueError(
                f"rates: must be between {1 / _FASTEST:g} and {_FASTEST:g}, got {rate:g}"
            )
    return rates


def check_clocks(given: Sequence[ArrayLike] | None, tracks: Sequence[Floats]) -> tuple[Floats, ...]:
    """When each frame of each track was taken, the first one at zero."""
    if given is None:
        return tuple(np.arange(len(track), dtype=float) for track in tracks)
    clocks, each = [], check_items("clocks", given, len(tracks), "track")
    for i, (clock, track) in enumerate(zip(each, tracks, strict=True)):
        checked = check_vector(f"clocks[{i}]", clock, len(track))
        if (np.diff(checked) <= 0).any():
            raise ValueError(f"clocks[{i}]: must increase, got {shown(checked)}")
        clocks.append(checked - checked[0])
    return tuple(clocks)


@dataclass(frozen=True, eq=False)
class Clock:
    """When the frames of all videos were taken.

    Parameters
    ----------
    times : ndarray, shape (n_0,)
        Of the frames of the first video, in the unit of time of the law.
    rates : ndarray, shape (m,)
        Frames of each video in one frame of the first.
    frames : sequence of ndarray, shape (n_i,)
        When each frame was taken, in frames of its video at an even rate; see `align`.
    """

    times: Floats
    rates: Floats
    frames: Sequence[Floats]

    @property
    def ends(self) -> Floats:
        """How long each video takes, in frames of the first, shape (m,)."""
        return np.array([frames[-1] + 1 for frames in self.frames]) / self.rates

    def mended(self, footage: Footage) -> Clock:
        """That of footage which was put right; the times are those of its first video."""
        times, old, new = self.times, self.frames[0], footage.instants
        if footage.lasting != 1 or not np.array_equal(new, old):
            times = times[0] + footage.lasting * np.ptp(times) / np.ptp(old) * new
        return Clock(times, footage.rates, footage.clocks)

    @classmethod
    def of_tracks(cls, t: ArrayLike | Sequence[ArrayLike], tracks: Sequence[Floats]) -> Clock:
        """The clock of tracks, by the times of the first, or by a sequence of those of each.

        Raises
        ------
        ValueError
            If there is not one increasing time per row.
        """
        if not (isinstance(t, list | tuple) and len(t) == len(tracks) and np.ndim(t[0])):
            times = _one_each(cast("ArrayLike", t), len(tracks[0]), "row of tracks[0]")
            return cls(times, np.ones(len(tracks)), check_clocks(None, tracks))
        stated = [
            _one_each(one, len(track), f"row of tracks[{i}]", f"t[{i}]")
            for i, (one, track) in enumerate(zip(t, tracks, strict=True))
        ]
        usual = np.array([np.median(np.diff(times)) if len(times) > 1 else 1 for times in stated])
        # So many times as long as another's a track's frames may last.
        if usual.max() > 20.0 * usual.min():
            i = np.abs(np.log(usual / np.median(usual))).argmax()
            steps = ", ".join(f"{step:.3g}" for step in usual)
            raise ValueError(
                f"t[{i}]: must be in the unit of time of the others, got median steps of {steps}"
            )
        frames = [(times - times[0]) / step for times, step in zip(stated, usual, strict=True)]
        # Times that are that close to even ones are even.
        frames = [np.rint(f) if np.abs(f - np.rint(f)).max() < 1e-6 else f for f in frames]
        return cls(stated[0], usual[0] / usual, frames)

    @classmethod
    def of_videos(
        cls, fps: Sequence[float], frames: Sequence[Floats], t: ArrayLike | None
    ) -> Clock:
        """The clock of files that state these rates, or the given times of the first's frames.

        Raises
        ------
        ValueError
            If no times are given and a file states no rate, or if they are and the files state
            different rates, or the first one other times.
        """
        rates = np.array(fps, dtype=float)
        told = np.isfinite(rates) & (rates > 0)
        if t is None:
            if not told.all():
                raise ValueError(
                    f"t: must be given, as by --fps, if a file states no frame rate, as images do, "
                    f"got {rates.tolist()}"
                )
            return cls(frames[0] / rates[0], rates / rates[0], frames)
        if told.any() and np.ptp(rates[told]) > SAME_RATE * rates[told].min():
            raise ValueError(
                "t: may be given, as --fps may, only for videos of one frame rate, got files that "
                f"state {', '.join(f'{rate:g}' for rate in rates)}: leave it out, so that the "
                "rate of each file counts, or convert the videos"
            )
        times = _one_each(t, len(frames[0]), "frame of the first video")
        _check_uneven(times, frames[0])
        return cls(times, np.ones(len(rates)), frames)


def _is_even(frames: Floats) -> bool:
    return bool((frames == np.arange(len(frames))).all())


def _one_each(t: ArrayLike, frames: int, each: str, name: str = "t") -> Floats:
    """The time of each frame of a video."""
    times = check_times(t, name)
    if times.shape != (frames,):
        raise ValueError(f"{name}: must have shape ({frames},), one per {each}, got {times.shape}")
    return times


def _check_uneven(times: Floats, frames: Floats) -> None:
    """Given times of a video whose file states uneven ones: they must be the same but for scale."""
    if _is_even(frames):
        return
    scaled = (times - times[0]) / (times[-1] - times[0]) * frames[-1]
    k = int(np.abs(scaled - frames).argmax())
    # Frames by which they may differ.
    if abs(scaled[k] - frames[k]) > 0.25:
        raise ValueError(
            "t: must fit the times that the first video's file states, as frames were dropped or "
            f"taken at uneven times, got {times[k] - times[0]:g} after the first for frame {k}: "
            "leave it out, or convert the video to a constant frame rate"
        )
