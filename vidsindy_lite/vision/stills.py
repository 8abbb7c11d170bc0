"""A film as a folder of images, as images whose names follow a pattern, or as pages of one TIFF.

Such films state no frame rate. The numbers in the names are the clock: an image that is missing is
a frame that was dropped. Images of 16 bits of which the film uses fewer, as those of cameras of 10
or 12 bits, are read by those it uses.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, cast

import cv2
import numpy as np

from ..arrays import Floats, Image

SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".ppm", ".pgm"})


_BITS = (8, 10, 12, 14, 16)  # of cameras
_LOOKED_AT = 9  # images that tell how many bits a film uses


class Stills(NamedTuple):
    """The files of a film's images in their order, and when each was taken, in frames.

    Of pages, the file stands there once for each.
    """

    files: list[Path]
    clock: Floats
    pages: bool = False

    def read(self, number: int, bits: int) -> Image:
        """One image, upright, blue-green-red, of so many bits made eight."""
        file = self.files[number]
        image = self._decoded(number)
        if image is None:
            raise ValueError(f"path: must be an image that OpenCV can read, got '{file}'")
        if image.dtype == np.uint16:
            image = np.clip(image >> (bits - 8), 0, 255).astype(np.uint8)
        return cast("Image", image)

    def bits(self) -> int:
        """How many bits the film uses, by some of its images."""
        shown = np.unique(np.linspace(0, len(self.files) - 1, _LOOKED_AT).astype(int))
        images = [self._decoded(int(k)) for k in shown]
        if all(image is None or image.dtype == np.uint8 for image in images):
            return 8
        largest = max(int(image.max()) for image in images if image is not None)
        return next((bits for bits in _BITS if largest < 2**bits), _BITS[-1])

    def _decoded(self, number: int) -> np.ndarray | None:
        """An image as it is stored, but for its colours."""
        file, how = self.files[number], cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH
        try:
            if self.pages:
                _, images = cv2.imreadmulti(str(file), number, 1, flags=how)
                return images[0] if images else None
            # Not imread, which knows no Chinese name on some systems.
            return cv2.imdecode(np.fromfile(file, np.uint8), how) if _holds(file) else None
        except cv2.error:  # such as a header of more pixels than there are
            return None


def find_stills(path: Path) -> Stills | None:
    """The images in a folder or of a pattern, such as ``shots/a_%04d.png`` or ``shots/*.png``.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Stills or None
        None if the path is neither a folder nor a pattern, but the name of a file that is no TIFF.

    Raises
    ------
    FileNotFoundError, ValueError
        If there are no such images, or their numbers do not tell their order.
    """
    if path.is_file() and path.suffix.lower() in (".tif", ".tiff"):
        count = cv2.imcount(str(path)) if _holds(path) else 0
        return Stills([path] * count, np.arange(count, dtype=float), True) if count else None
    if path.is_file() or not (path.is_dir() or re.search(r"[*?]|%\d*d", path.name)):
        return None
    if path.is_dir():
        files = [file for file in path.iterdir() if file.suffix.lower() in SUFFIXES]
        files = [file for file in files if not file.name.startswith(".")]
    else:
        folder = path.parent if path.parent.is_dir() else Path()
        named = re.compile(_expression(path.name))
        files = [file for file in folder.iterdir() if named.fullmatch(file.name)]
    if not files and not path.is_dir():
        raise FileNotFoundError(
            f"path: no such video file, nor images of that name, got {str(path)!r}"
        )
    if not files:
        raise ValueError(
            f"path: must be a video file, or a folder of images, got '{path}' without any"
        )
    numbers = [_number(file) for file in files]
    if None in numbers:
        return Stills(sorted(files), np.arange(len(files), dtype=float))
    return _in_order(path, files, np.array(numbers, dtype=float))


def _expression(name: str) -> str:
    """A pattern of names as a regular expression."""
    parts = re.split(r"(%\d*d|[*?])", name)
    meaning = {"*": ".*", "?": "."}
    return "".join(
        r"\d+" if part.startswith("%") and len(part) > 1 else meaning.get(part, re.escape(part))
        for part in parts
    )


def _number(file: Path) -> int | None:
    """The last number in a file's name."""
    found = re.findall(r"\d+", file.stem)
    return int(found[-1]) if found else None


def _in_order(path: Path, files: list[Path], numbers: Floats) -> Stills:
    """Images by their numbers, which must be those of frames."""
    order = np.argsort(numbers)
    steps = np.diff(numbers[order])
    step = steps.min() if steps.size else 1.0
    if step == 0:
        k = int(steps.argmin())
        twins = " and ".join(files[i].name for i in order[k : k + 2])
        raise ValueError(f"path: each image of a film must have its own number, got {twins}")
    if (steps % step).any() or (steps.size and np.median(steps) > step):
        raise ValueError(
            f"path: the numbers of images must count frames, got {files[order[0]].name}, "
            f"{files[order[1]].name}, ... in '{path}': rename them 0001, 0002, ..."
        )
    return Stills([files[i] for i in order], (numbers[order] - numbers.min()) / step)


def read_stills(stills: Stills) -> Iterator[Image]:
    """The images one after the other, blue-green-red, all of one size.

    Raises
    ------
    ValueError
        Where an image cannot be read or has another size.
    """
    size, bits = None, stills.bits()
    for k, file in enumerate(stills.files):
        image = stills.read(k, bits)
        size = size or image.shape[1::-1]
        if image.shape[1::-1] != size:
            raise ValueError(
                f"path: all images of a film must have one size, {size}, got "
                f"{image.shape[1::-1]} in '{file}'"
            )
        yield image


def _holds(file: Path) -> bool:
    """Whether there is anything in it: OpenCV fails at nothing with a message of its own."""
    return file.is_file() and file.stat().st_size > 0
