"""When the frames of a video file were taken, by what its packets state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Floats

if TYPE_CHECKING:
    from av.container import InputContainer
    from av.video.stream import VideoStream

Shown = tuple[int | None, bool]
"""When a packet's frame is shown, in ticks of the stream, and whether decoding can begin there."""

_LESS = (
    1 - 1e-6
)  # of a tick by which rounded times may be off: a whole one is a frame in some files


def timing(packets: Sequence[Shown], stream: VideoStream) -> tuple[Floats, float]:
    """When each frame is shown, in frames, and the number of frames in a second."""
    stated = float(stream.guessed_rate or 0)
    even = np.arange(len(packets), dtype=float)
    ticks = np.sort([time for time, _ in packets if time is not None]).astype(float)
    steps = np.diff(ticks)
    if len(ticks) < len(packets) or len(ticks) < 2 or not stream.time_base or steps.min() <= 0:
        return even, stated  # some old files do not say
    tick = float(stream.time_base)
    seconds = (ticks - ticks[0]) * tick
    usual = float(np.median(steps)) * tick
    # Between dropped frames, most follow each other at an even rate, which may not be the stated.
    counted = np.concatenate(([0.0], np.cumsum(np.rint(steps * tick / usual))))
    mean = counted[-1] / seconds[-1]
    for clock, rate in ((even, stated), (counted, stated), (counted, mean)):
        if rate > 0 and np.abs(seconds * rate - clock).max() < _LESS * rate * tick:
            return clock, rate
    return seconds / usual, 1 / usual


def cut_off(
    packets: Sequence[Shown], end: float, container: InputContainer, stream: VideoStream
) -> int:
    """Number of frames that were cut off the end of a file, by the duration that it states.

    `end` is when the last packet of all its streams ends, in seconds: a file whose sound goes on
    to its end is whole.
    """
    times = [time for time, _ in packets if time is not None]
    if not (container.duration and stream.time_base and times):
        return 0
    rate, whole = float(stream.guessed_rate or 0), container.duration / 1e6
    if len(container.streams) > 1 and (whole - end) * rate < 2:
        return 0
    return max(round((whole - float(max(times) * stream.time_base)) * rate) - 1, 0)
