"""What a hint says of the candidates: which one is the target in a frame, which are like it."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..arrays import Floats, Image, Ints
from .candidates import Candidate
from .hints import Hint
from .linking import TOLD
from .reducing import reduce
from .steadying import carry
from .video import read_frame

_COLOUR = 70.0  # grey levels between colours that are not alike
_UNLIKE = 0.5  # of 1, to which colours are alike at most that are not the same
_SIZE = 2.2  # logarithm of the factor, of nine, between areas that are not alike
_COVERS = 0.25  # share of what a candidate and the box cover together, that both cover
_RIM = 1.0  # pixels by which a box may be drawn too small


@dataclass(frozen=True)
class Pointer:
    """A hint, and the candidate `one` in its box, if it has one."""

    hint: Hint
    one: Candidate | None

    @classmethod
    def of(
        cls,
        hint: Hint,
        found: Sequence[Sequence[Candidate]],
        factor: int,
        path: str | os.PathLike,
    ) -> Self:
        """From the candidates of frames that are reduced by a factor."""
        if hint.box is None or hint.frame is None:
            return cls(hint, None)
        if hint.frame >= len(found):
            raise ValueError(f"target: its frame must be one of {len(found)}, got {hint.frame}")
        box = np.array(hint.box) / factor  # it begins at its first pixel
        middle = box[:2] + (box[2:] - 1) / 2
        here = [(_overlap(c.box, box), c) for c in found[hint.frame] if _fits(c, box, middle)]
        share, one = max(here, key=lambda pair: pair[0], default=(0.0, None))
        if one is None or share < _COVERS:
            frame = read_frame(path, hint.frame)
            there = np.array(hint.box[:2]) + (np.array(hint.box[2:]) - 1) / 2
            width, height = frame.shape[1::-1]
            if not (0 <= there[0] < width and 0 <= there[1] < height):
                raise ValueError(
                    f"box: must have its middle in the image of {width} x {height} pixels, "
                    f"got {_told(hint.box)}"
                )
            one = _boxed(reduce(frame, factor), box, middle)
        return cls(hint, replace(one, quality=TOLD))

    def like(self, found: Sequence[Sequence[Candidate]]) -> list[list[Candidate]]:
        """Candidates as far as they have the colour that is told, and the looks of the one."""
        if self.hint.colour is not None:
            colour = np.array(self.hint.colour[::-1], float)
        else:
            assert self.one is not None
            colour = self.one.colour
        coloured = [
            [replace(c, quality=c.quality * alike(c.colour, colour)) for c in some]
            for some in found
        ]
        return coloured if self.one is None else _sized(coloured, self.one.area)

    def kept(
        self, found: Sequence[Sequence[Candidate]], frames: Ints, which: Ints
    ) -> list[list[Candidate]]:
        """Candidates as far as they have the size of a path's, which are to be on the next one."""
        on = [
            (i, k) for i, k in zip(frames.tolist(), which.tolist(), strict=True)
            if self.one is None or i != self.hint.frame
        ]  # fmt: skip
        likely = _sized(found, float(np.median([found[i][k].area for i, k in on])))
        for i, k in on:
            likely[i][k] = replace(found[i][k], quality=found[i][k].quality + 1)
        return likely

    def pinned(self, found: list[list[Candidate]]) -> list[list[Candidate]]:
        """Candidates of which the one in the box is the only one in its frame."""
        if self.one is None or self.hint.frame is None:
            return found
        return [[self.one] if i == self.hint.frame else some for i, some in enumerate(found)]

    def missed(self, pixels: Floats, maps: Floats) -> tuple[str, ...]:
        """Is a track, in pixels of the first frame, elsewhere in the frame of the box?"""
        if self.hint.box is None or self.hint.frame is None:
            return ()
        box, i = np.array(self.hint.box), self.hint.frame
        there = carry(np.linalg.inv(maps[i]), pixels[i][None])[0]
        which = f"the target that was pointed at in frame {i}, box {self.hint.box}, "
        if np.isnan(there[0]):
            return (which + "is not seen in that frame",)
        if (np.abs(there - box[:2] - (box[2:] - 1) / 2) <= box[2:] / 2 + _RIM).all():
            return ()
        u, v = there
        return (which + f"is not what is followed, which is at ({u:.0f}, {v:.0f}) in that frame",)

    def unlike(self, colour: Floats) -> tuple[str, ...]:
        """Has what is followed, of this colour, another one than is told?"""
        if self.hint.colour is None or alike(colour, np.array(self.hint.colour[::-1])) > _UNLIKE:
            return ()
        here = _told(colour[::-1].round().tolist())
        return (f"what is followed has the colour {here}, not {_told(self.hint.colour)} as told",)


def _told(numbers: Sequence[float]) -> str:
    """Numbers as a user writes them."""
    return f"({', '.join(f'{number:g}' for number in numbers)})"


def _sized(found: Sequence[Sequence[Candidate]], area: float) -> list[list[Candidate]]:
    """Candidates as far as they are about as large."""
    return [
        [
            replace(c, quality=c.quality * float(np.exp(-((np.log(c.area / area) / _SIZE) ** 2))))
            for c in some
        ]
        for some in found
    ]


def _overlap(one: Floats, other: Floats) -> float:
    """Share of what two boxes cover together that both cover."""
    both = np.minimum(one[:2] + one[2:], other[:2] + other[2:]) - np.maximum(one[:2], other[:2])
    common = float(np.maximum(both, 0).prod())
    return common / (float(one[2:].prod() + other[2:].prod()) - common)


def _fits(one: Candidate, box: Floats, middle: Floats) -> bool:
    """Has a candidate about the place and the size of a box?"""
    near = (np.abs(one.centre - middle) <= box[2:] / 2 + 1).all()
    return bool(near and (one.box[2:] <= 1.6 * box[2:] + 4).all())


def _boxed(frame: Image, box: Floats, middle: Floats) -> Candidate:
    """What is in a box, where nothing differs from the background."""
    low, high = middle - box[2:] / 4, middle + box[2:] / 4
    rows = slice(max(int(low[1]), 0), int(high[1]) + 1)
    inner = frame[rows, max(int(low[0]), 0) : int(high[0]) + 1].reshape(-1, 3)
    return Candidate(middle, box, 0.8 * box[2] * box[3], np.median(inner, axis=0).astype(float), 1)


def alike(colour: Floats, told: Floats) -> float:
    """How alike two colours are, from 0 to 1, also in another light."""
    shade = np.clip(float(colour @ told) / max(float(colour @ colour), 1.0), 0.7, 1.4)
    return float(np.exp(-((np.linalg.norm(shade * colour - told) / _COLOUR) ** 2)))
