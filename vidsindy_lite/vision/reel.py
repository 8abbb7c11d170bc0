"""The frames of a film, decoded once if they are few."""

import os
from collections.abc import Iterator, Sequence

from ..arrays import Image
from .video import pick_frames, read_video, video_info

_ROOM = 300_000_000  # bytes of frames that are kept


class Reel:
    """A film whose frames are looked at several times: some of them first, then all in order.

    Parameters
    ----------
    path : path
        See `read_video`.
    """

    def __init__(self, path: str | os.PathLike) -> None:
        self.path, self.info = path, video_info(path)
        if self.info.frames < 2:
            raise ValueError(f"path: must hold two frames or more, got one in '{path}'")
        width, height = self.info.size
        self.few = 3 * width * height * self.info.frames <= _ROOM
        self._kept: list[Image] | None = None

    def __iter__(self) -> Iterator[Image]:
        if self._kept is not None:
            yield from self._kept
            return
        kept: list[Image] = []
        for frame in read_video(self.path):
            if self.few:
                kept.append(frame)
            yield frame
        self._kept = kept if self.few else None

    def pick(self, numbers: Sequence[int]) -> Iterator[Image]:
        """The frames of these increasing numbers, as far as the film holds them."""
        if self.few:
            return (frame for i, frame in enumerate(self) if i in numbers)
        return pick_frames(self.path, numbers)
