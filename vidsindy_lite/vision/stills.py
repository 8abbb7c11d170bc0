"""A film as a folder of images, or as images whose names follow a pattern.

Such films state no frame rate. The numbers in the names are the clock: an image that is missing is
a frame that was dropped.
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


class Stills(NamedTuple):
    """The files of a film's images in their order, and when each was taken, in frames."""

    files: list[Path]
    clock: Floats


def find_stills(path: Path) -> Stills | None:
    """The images in a folder or of a pattern, such as ``shots/a_%04d.png`` or ``shots/*.png``.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Stills or None
        None if the path is neither a folder nor a pattern, but the name of a file.

    Raises
    ------
    FileNotFoundError, ValueError
        If there are no such images, or their numbers do not tell their order.
    """
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
        raise FileNotFoundError(f"path: no such video file, nor images of that name, got '{path}'")
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
    size = None
    for file in stills.files:
        image = read_still(file)
        size = size or image.shape[1::-1]
        if image.shape[1::-1] != size:
            raise ValueError(
                f"path: all images of a film must have one size, {size}, got "
                f"{image.shape[1::-1]} in '{file}'"
            )
        yield image


def read_still(file: Path) -> Image:
    """One image, upright, with eight bits a colour."""
    # Not imread, which knows no Chinese name on some systems.
    image = cv2.imdecode(np.fromfile(file, np.uint8), cv2.IMREAD_COLOR) if _holds(file) else None
    if image is None:
        raise ValueError(f"path: must be an image that OpenCV can read, got '{file}'")
    return cast("Image", image)


def _holds(file: Path) -> bool:
    """Whether there is anything in it: OpenCV fails at nothing with a message of its own."""
    return file.is_file() and file.stat().st_size > 0
