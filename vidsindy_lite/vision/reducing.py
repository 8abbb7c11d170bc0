"""Frames reduced by a whole factor, and maps between their pixels."""

import os
from collections.abc import Iterator

import cv2
import numpy as np

from ..arrays import Floats, Image
from .video import read_video

_KEPT = 64_000_000, 128_000_000  # bytes of reduced and of whole frames that are kept
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


class _Kept:
    """Images, as long as they fit into so many bytes."""

    def __init__(self, room: int) -> None:
        self.room = room
        self.images: list[Image] = []

    def add(self, image: Image) -> None:
        self.room -= image.nbytes
        if self.room >= 0:
            self.images.append(image)
        else:
            self.images.clear()

    def all(self) -> list[Image] | None:
        """All that were added, None if they do not fit."""
        return self.images if self.room >= 0 else None


class ReducedFrames:
    """The frames of a video file, reduced by a factor; read once if they are few."""

    def __init__(self, path: str | os.PathLike, factor: int) -> None:
        self.path, self.factor = path, factor
        self.kept: list[Image] | None = None
        self.kept_whole: list[Image] | None = None

    def __iter__(self) -> Iterator[Image]:
        if self.kept is not None:
            yield from self.kept
            return
        kept, kept_whole = (_Kept(room) for room in _KEPT)
        for frame in read_video(self.path):
            small = reduce(frame, self.factor)
            kept.add(small)
            kept_whole.add(frame)
            yield small
        self.kept, self.kept_whole = kept.all(), kept_whole.all()

    def whole(self) -> Iterator[Image]:
        """The frames as they are in the file."""
        return iter(self.kept_whole) if self.kept_whole is not None else read_video(self.path)


def enlarged(factor: float) -> Floats:
    """The map of pixels of an image reduced by a factor to those of the image."""
    k = factor
    return np.array([[k, 0, (k - 1) / 2], [0, k, (k - 1) / 2], [0, 0, 1.0]])


def reduced(maps: Floats, factor: float) -> Floats:
    """Maps (n, 3, 3) of pixels of an image as maps of those of the image reduced by a factor."""
    larger = enlarged(factor)
    return np.asarray(np.linalg.inv(larger) @ maps @ larger, float)
