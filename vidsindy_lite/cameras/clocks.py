"""When the frames of all videos were taken, each by the clock of its own camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..checks import check_times

_ROUNDING = 1e-6  # frames; times that are closer to even ones are even
_SAME_RATE = 0.01  # relative difference of frame rates that are the same
_SAME_TIME = 0.25  # frames by which given times may differ from those of an uneven file


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
    def uneven(self) -> Sequence[Floats] | None:
        """The frames' clocks, if that of any video is not 0, 1, 2, ..."""
        return None if all(map(_is_even, self.frames)) else self.frames

    @property
    def ends(self) -> Floats:
        """How long each video takes, in frames of the first, shape (m,)."""
        return np.array([frames[-1] + 1 for frames in self.frames]) / self.rates

    def mended(self, rates: Floats, frames: Sequence[Floats]) -> Clock:
        """The same with other rates and frames; the times are those of the new first video's."""
        times, old, new = self.times, self.frames[0], frames[0]
        if not np.array_equal(new, old):
            step = np.ptp(times) / np.ptp(old)
            times = times[0] + step * (new - new[0])
        return Clock(times, rates, frames)

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
            even = [np.arange(len(track), dtype=float) for track in tracks]
            return cls(times, np.ones(len(tracks)), even)
        stated = [
            _one_each(one, len(track), f"row of tracks[{i}]")
            for i, (one, track) in enumerate(zip(t, tracks, strict=True))
        ]
        usual = np.array([np.median(np.diff(times)) if len(times) > 1 else 1 for times in stated])
        frames = [
            _rounded((times - times[0]) / step) for times, step in zip(stated, usual, strict=True)
        ]
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
        if told.any() and np.ptp(rates[told]) > _SAME_RATE * rates[told].min():
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


def _rounded(frames: Floats) -> Floats:
    """Frame numbers, whole if they are but for rounding."""
    whole = np.rint(frames)
    return whole if np.abs(frames - whole).max() < _ROUNDING else frames


def _one_each(t: ArrayLike, frames: int, each: str) -> Floats:
    """The time of each frame of a video."""
    times = check_times(t)
    if times.shape != (frames,):
        raise ValueError(f"t: must have shape ({frames},), one per {each}, got {times.shape}")
    return times


def _check_uneven(times: Floats, frames: Floats) -> None:
    """Given times of a video whose file states uneven ones: they must be the same but for scale."""
    if _is_even(frames):
        return
    scaled = (times - times[0]) / (times[-1] - times[0]) * frames[-1]
    k = int(np.abs(scaled - frames).argmax())
    if abs(scaled[k] - frames[k]) > _SAME_TIME:
        raise ValueError(
            "t: must fit the times that the first video's file states, as frames were dropped or "
            f"taken at uneven times, got {times[k] - times[0]:g} after the first for frame {k}: "
            "leave it out, or convert the video to a constant frame rate"
        )
