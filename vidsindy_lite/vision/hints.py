"""What a user can say of the target: where it is in one frame, or its colour."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from ..arrays import Floats
from ..checks import check_integer, check_number, shown
from ..storage import check_file, read_tree


@dataclass(frozen=True)
class Hint:
    """Which of the things that move is the target: a box around it in one frame, or its colour.

    Parameters
    ----------
    frame : int, optional
        Number of the frame in which the box is drawn, from 0.
    box : (u, v, width, height), optional
        Around the target in that frame, close to it: left and upper edge, width and height, pixels.
    colour : (red, green, blue), optional
        Of the target, 0 to 255 each.

    Raises
    ------
    ValueError
        If there is neither a box with its frame nor a colour, or one of them breaks its rule.
    """

    frame: int | None = None
    box: tuple[float, float, float, float] | None = None
    colour: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if (self.frame is None) != (self.box is None):
            raise ValueError(
                f"box: must come with its frame, got frame={self.frame!r}, box={shown(self.box)}"
            )
        if self.box is None and self.colour is None:
            raise ValueError("target: must be a frame and a box in it, or a colour, got neither")
        if self.frame is not None:
            object.__setattr__(self, "frame", check_integer("frame", self.frame))
            box = _numbers("box", self.box, 4, "(u, v, width, height) in pixels")
            if min(box[2:]) < 2:
                raise ValueError(f"box: must be two pixels wide and high or more, got {box}")
            object.__setattr__(self, "box", box)
        if self.colour is not None:
            colour = _numbers("colour", self.colour, 3, "(red, green, blue), 0 to 255 each")
            if not 0 <= min(colour) <= max(colour) <= 255:
                raise ValueError(f"colour: must be red, green, blue, 0 to 255 each, got {colour}")
            object.__setattr__(self, "colour", colour)

    def boxed(
        self, size: tuple[int, int], frames: int, factor: int
    ) -> tuple[int, Floats, Floats] | None:
        """Frame, middle and sides of the box, in frames reduced by a factor; None without a box.

        Raises
        ------
        ValueError
            If the film has no such frame, or the middle of the box is not in its image.
        """
        if self.box is None or self.frame is None:
            return None
        if self.frame >= frames:
            raise ValueError(f"target: its frame must be one of {frames}, got {self.frame}")
        low, sides = np.array(self.box[:2]), np.array(self.box[2:])
        middle = low + (sides - 1) / 2  # it begins at its first pixel
        if (middle < 0).any() or (middle >= size).any():
            raise ValueError(
                f"box: must have its middle in the image of {size[0]} x {size[1]} pixels, "
                f"got {_told(self.box)}"
            )
        return self.frame, (middle - (factor - 1) / 2) / factor, sides / factor

    def likeness(self, colours: Floats, grounds: Floats) -> Floats:
        """How like the colour that is told things (m, 3) are before grounds (m, 3), from 0 to 1.

        Also in other light, and where blur mixes them with their ground.
        """
        told = np.array(self.colour or (0, 0, 0), float)
        mixed = told - grounds
        share = ((colours - grounds) * mixed).sum(axis=1) / np.maximum((mixed**2).sum(axis=1), 1)
        ways = told, grounds + np.clip(share, 0.25, 1)[:, None] * mixed
        return np.maximum(*(_alike(colours, way) for way in ways))

    def unlike(self, colour: Floats) -> tuple[str, ...]:
        """Has what is followed, of this red, green and blue, another colour than is told?"""
        if self.colour is None or _alike(colour[None], np.array(self.colour, float))[0] > 0.5:
            return ()
        here = _told(colour.round().tolist())
        return (f"what is followed has the colour {here}, not {_told(self.colour)} as told",)


def _told(numbers: Sequence[float]) -> str:
    """Numbers as a user writes them."""
    return f"({', '.join(f'{number:g}' for number in numbers)})"


def _alike(colours: Floats, told: Floats) -> Floats:
    """How alike colours (m, 3) are to others, from 0 to 1, also in another light."""
    shade = (colours * told).sum(axis=1) / np.maximum((colours**2).sum(axis=1), 1)
    off = np.clip(shade, 0.7, 1.4)[:, None] * colours - told
    return np.asarray(np.exp(-((off**2).sum(axis=1) / 70.0**2)))


def _numbers(name: str, values: object, count: int, what: str) -> tuple[float, ...]:
    if not isinstance(values, Sequence) or isinstance(values, str) or len(values) != count:
        raise ValueError(f"{name}: must be {what}, got {shown(values)}")
    return tuple(check_number(name, value) for value in values)


def load_hints(path: str | os.PathLike) -> tuple[Hint | None, ...]:
    """The hints of a rig file, one per camera: ``target = {frame = 10, box = [u, v, w, h]}``.

    Parameters
    ----------
    path : path
        A rig file that `Rig.load` reads.

    Returns
    -------
    tuple of Hint or None

    Raises
    ------
    ValueError
        If a target is no hint; names file, camera and key.
    """
    tables = read_tree("path", check_file("path", path), ".toml").get("camera", ())
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise ValueError(f"path: must hold tables [[camera]], got {shown(tables)}, in '{path}'")
    return tuple(_from_table(f"{path}: camera {i}", table) for i, table in enumerate(tables))


def _from_table(where: str, table: Mapping[str, object]) -> Hint | None:
    told = table.get("target")
    if told is None:
        return None
    known = [field.name for field in fields(Hint)]
    if not isinstance(told, dict) or not set(told) <= set(known):
        raise ValueError(
            f"{where}: target: must be a table of {', '.join(known)}, got {shown(told)}"
        )
    try:
        return Hint(**told)
    except ValueError as error:
        raise ValueError(f"{where}: target: {error}") from None
