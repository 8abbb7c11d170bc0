"""Frames that show two instants: every other line was taken half a frame later.

The lines of one instant are kept, and those between interpolated. Which of the two fields came
first does not matter: half a frame, the same for all frames, is part of the video's lag.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from ..arrays import Image

if TYPE_CHECKING:
    from av import VideoFrame


def upper_field(frame: VideoFrame) -> Image:
    """What an interlaced frame shows in its first, third, ... lines, at full height.

    Parameters
    ----------
    frame : VideoFrame

    Returns
    -------
    ndarray, shape (height, width, 3), uint8
        Blue-green-red.
    """
    import av

    # By ffmpeg's filter, which takes the right lines of coarser colour planes, too.
    graph = av.filter.Graph()
    source = graph.add_buffer(
        width=frame.width, height=frame.height, format=frame.format, time_base=frame.time_base
    )
    field, sink = graph.add("field", "type=top"), graph.add("buffersink")
    source.link_to(field)
    field.link_to(sink)
    graph.configure()
    graph.push(frame)
    lines = cast("VideoFrame", graph.pull()).to_ndarray(format="bgr24", threads=1)
    return with_lines_between(cast("Image", lines))[: frame.height]


def with_lines_between(field: Image) -> Image:
    """A field with the mean of two lines between them, and the last one twice."""
    lower = np.concatenate((field[1:], field[-1:]))
    between = ((field.astype(np.uint16) + lower + 1) // 2).astype(np.uint8)
    return np.stack((field, between), axis=1).reshape(-1, *field.shape[1:])
