"""Frames reduced by a whole factor, and maps between their pixels."""

import os
from collections.abc import Iterator, Sequence
from typing import Self

import cv2
import numpy as np

from ..arrays import Floats, Image
from .reel import Reel

_ROOM = 96_000_000  # bytes of reduced frames that are kept
LONGEST = 480  # pixels of the longer side of a reduced frame


def reduction(size: tuple[int, int]) -> int:
    """By how much frames of this size are reduced."""
    return max(1, -(-max(size) // LONGEST))


def reduce(image: Image, factor: int) -> Image:
    """The means over squares of `factor` pixels, also over what is left of squares at the edges."""
    size = (-(-image.shape[1] // factor), -(-image.shape[0] // factor))
    right, bottom = size[0] * factor - image.shape[1], size[1] * factor - image.shape[0]
    if right or bottom:
        padded = cv2.copyMakeBorder(image, 0, bottom, 0, right, cv2.BORDER_REPLICATE)
        image = np.asarray(padded, np.uint8)
    while factor % 2 == 0:  # OpenCV halves an image much faster than it quarters one
        factor //= 2
        half = (image.shape[1] // 2, image.shape[0] // 2)
        image = np.asarray(cv2.resize(image, half, interpolation=cv2.INTER_AREA), np.uint8)
    if factor == 1:
        return image
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


class ReducedFrames:
    """The frames of a film, reduced by a factor once if they are few."""

    def __init__(self, reel: Reel, factor: int) -> None:
        self.reel, self.factor = reel, factor
        width, height = reel.info.size
        self._few = 3 * width * height * reel.info.frames <= _ROOM * factor**2
        self._kept: list[Image] | None = None

    @classmethod
    def of(cls, path: str | os.PathLike) -> Self:
        """The frames of a film, reduced as is usual for their size."""
        reel = Reel(path)
        return cls(reel, reduction(reel.info.size))

    def pick(self, numbers: Sequence[int]) -> Iterator[Image]:
        """The whole frames of these increasing numbers; on the way the reduced ones are kept."""
        if self.reel.few or not self._few:
            yield from self.reel.pick(numbers)
            return
        yield from (frame for i, (frame, _) in enumerate(self._both()) if i in numbers)

    def __iter__(self) -> Iterator[Image]:
        if self._kept is not None:
            yield from self._kept
        else:
            yield from (small for _, small in self._both())

    def some(self, numbers: Sequence[int]) -> Iterator[Image]:
        """The reduced frames of these increasing numbers, as far as the film holds them."""
        if self._kept is not None:
            yield from (self._kept[i] for i in numbers if i < len(self._kept))
        else:
            yield from (reduce(frame, self.factor) for frame in self.reel.pick(numbers))

    def _both(self) -> Iterator[tuple[Image, Image]]:
        """All frames, whole and reduced; of these few are kept."""
        kept: list[Image] = []
        for frame in self.reel:
            small = reduce(frame, self.factor)
            if self._few:
                kept.append(small)
            yield frame, small
        self._kept = kept if self._few else None


def enlarged(factor: float) -> Floats:
    """The map of pixels of an image reduced by a factor to those of the image."""
    k = factor
    return np.array([[k, 0, (k - 1) / 2], [0, k, (k - 1) / 2], [0, 0, 1.0]])


def reduced(maps: Floats, factor: float) -> Floats:
    """Maps (n, 3, 3) of pixels of an image as maps of those of the image reduced by a factor."""
    larger = enlarged(factor)
    return np.asarray(np.linalg.inv(larger) @ maps @ larger, float)
