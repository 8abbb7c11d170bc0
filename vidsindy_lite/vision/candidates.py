"""What may be the target in each frame: all that differs from the ground, or from other frames.

Two differences, each a witness where the other is blind. That from the *ground* (`plate`) shows
all that is not ground, also what moves slowly; that from the *neighbours*, a few frames before and
after, shows what moves before ground that changes, or that the plate knows badly. Each is cut at
three levels: a target that touches its shadow, or a faint change of the light, is a part of one
thing at a low level and stands alone at a higher one. What is connected is a candidate; which of
them are the target is for `association` to say.

All of this happens on reduced frames, see `reducing`.
"""

from collections import deque
from collections.abc import Iterable, Iterator
from itertools import chain, repeat
from typing import Any, NamedTuple, Self

import cv2
import numpy as np

from ..arrays import Bools, Floats, Floats32, Image, Ints
from .background import light
from .pixels import changes, lengths
from .plate import Plate, tolerance
from .steadying import carry

LEVELS = 1.0, 2.5, 6.0
"""Tolerances by which what is connected differs."""
APART = 3
"""Frames to the neighbours with which a frame is compared."""
_KEPT = 16  # candidates of a frame


class Candidates(NamedTuple):
    """The candidates of all frames as rows of a table, in the order of their frames.

    `frame` (m,); `place` (m, 2) in the first frame; `centre` (m, 2), `box` (m, 4) (left, top,
    width, height) and `area` (m,) in the frame; the mean `colour` (m, 3) and that of the ground
    `behind` (m, 3) it; `quality` (m,), how plain it is.
    """

    frame: Ints
    place: Floats
    centre: Floats
    box: Floats
    area: Floats
    colour: Floats
    behind: Floats
    quality: Floats

    @property
    def size(self) -> Floats:
        """Side of a square of the same area."""
        return np.asarray(np.sqrt(self.area))

    def only(self, rows: Ints | Bools | slice) -> Self:
        """Some of the rows."""
        columns: list[Any] = [column[rows] for column in self]
        return type(self)(*columns)

    @classmethod
    def joined(cls, parts: Iterable["Candidates"]) -> "Candidates":
        """Several tables as one, in the order of their frames."""
        whole = cls(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
        return whole.only(np.argsort(whole.frame, kind="stable"))

    @classmethod
    def of(cls, frame: int, here: Floats, rows: Floats) -> "Candidates":
        """Of one frame, from rows (k, 14) of centre, box, area, colour, behind, quality."""
        number = np.full(len(rows), frame)
        centre, box, area, colour, behind = np.split(rows[:, :13], [2, 6, 7, 10], axis=1)
        return cls(number, carry(here, centre), centre, box, area[:, 0], colour, behind,
                   rows[:, 13])  # fmt: skip


def candidates(
    frames: Iterable[Image], maps: Floats, plate: Plate, noise: float
) -> tuple[Candidates, list[Floats32]]:
    """The candidates of all frames, and how much brighter each frame is than the ground."""
    bound, lights, found = tolerance(plate, noise), [], []
    for i, (frame, here, others) in enumerate(_with_neighbours(frames, maps)):
        height, width = frame.shape[:2]
        ground, known = plate.seen_from(here, np.zeros(2), (width, height))
        allowed = bound
        if plate.moves:
            back = np.linalg.inv(plate.shift @ here)
            there = cv2.warpPerspective(bound, back, (width, height), borderValue=1e3)
            allowed = np.asarray(there, np.float32)
        lit = light(frame, ground, known)
        lights.append(lit)
        differs = lengths(changes(frame, ground, lit))
        if plate.unsure is not None:  # a guess says nothing of what is within its error
            unsure = plate.unsure
            if plate.moves:
                there = cv2.warpPerspective(unsure, back, (width, height))
                unsure = np.asarray(there, np.float32)
            differs = np.maximum(differs - unsure, 0)
        strengths = [differs / allowed * known]
        if others:
            strengths.append(_from_neighbours(frame, others, plate.moves) / allowed)
        rows = [
            components(strength, level, frame, ground, worth)
            for strength, worth in zip(strengths, (1.0, 0.7), strict=False)
            for level in LEVELS
        ]
        found.append(Candidates.of(i, here, _distinct(np.concatenate(rows))))
        found[-1].colour[:] /= lit
    if not found:
        return Candidates.of(0, np.eye(3), np.zeros((0, 14))), lights
    return Candidates.joined(found), lights


def _with_neighbours(
    frames: Iterable[Image], maps: Floats
) -> Iterator[tuple[Image, Floats, list[tuple[Image, Floats]]]]:
    """Each frame and its map, and some frames before and after it with maps that lay them on it."""
    window: deque[tuple[Image, Floats] | None] = deque([None] * APART, maxlen=2 * APART + 1)
    for one in chain(zip(frames, maps, strict=False), repeat(None, APART)):
        window.append(one)
        if len(window) <= APART or (middle := window[-1 - APART]) is None:
            continue
        back = np.linalg.inv(middle[1])
        beside = [window[0] if len(window) > 2 * APART else None, window[-1]]
        yield *middle, [(other[0], back @ other[1]) for other in beside if other is not None]


def _from_neighbours(frame: Image, others: list[tuple[Image, Floats]], moves: bool) -> Floats32:
    """Grey levels (h, w) by which a frame differs from each of its neighbours."""
    least = np.full(frame.shape[:2], np.inf, np.float32)
    bright = np.array(cv2.mean(frame)[:3]) + 1
    for other, move in others:
        if moves:
            moved = cv2.warpPerspective(
                other, move, frame.shape[1::-1], frame.copy(), borderMode=cv2.BORDER_TRANSPARENT
            )
            other = np.asarray(moved, np.uint8)
        lit = (bright / (np.array(cv2.mean(other)[:3]) + 1)).astype(np.float32)
        least = np.minimum(least, lengths(changes(frame, other, lit)))
    return least


def components(
    strength: Floats32, level: float, frame: Image, ground: Image, worth: float = 1.0
) -> Floats:
    """What differs by some level and is connected, as rows (k, 14), see `Candidates.of`.

    A thing is plain if it differs by much, fills its box, is of more than a few pixels and lies
    clear of the border. A shadow, the same surface in less light, is half as plain.
    """
    mask = cv2.morphologyEx((strength > level).astype(np.uint8), cv2.MORPH_CLOSE,
                            np.ones((3, 3), np.uint8))  # fmt: skip
    left, top, wide, high = cv2.boundingRect(mask)
    place = np.s_[top : top + high, left : left + wide]
    if not wide:
        return np.zeros((0, 14))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask[place])
    area = stats[:, cv2.CC_STAT_AREA].astype(float)
    order = 1 + np.argsort(-area[1:])[:_KEPT]  # the largest: the others are noise
    order = order[(area[order] >= 3) & (area[order] <= 0.3 * mask.size)]
    rank = np.full(count, -1)
    rank[order] = np.arange(len(order))
    v, u = np.nonzero(rank[labels] >= 0)
    part = rank[labels[v, u]]
    v, u = v + top, u + left
    strong = strength[v, u]
    area, stats = area[order], stats[order]
    mean = np.bincount(part, strong, len(order)) / area
    weight = np.minimum(strong, 3 * level)
    total = np.bincount(part, weight, len(order))
    centre = np.column_stack([np.bincount(part, weight * x, len(order)) / total for x in (u, v)])
    inner = strong >= mean[part]
    colour, behind = (_means(image[v[inner], u[inner]], part[inner], len(order))
                      for image in (frame, ground))  # fmt: skip
    box = (stats[:, :4] + [left, top, 0, 0]).astype(float)
    quality = worth * np.tanh(mean / 4) * np.minimum(area / (0.7 * box[:, 2:].prod(axis=1)), 1)
    quality *= np.minimum(area / 8, 1)
    cut = (box[:, :2] <= 0).any(axis=1) | (box[:, :2] + box[:, 2:] >= mask.shape[::-1]).any(axis=1)
    quality *= np.where(cut, 0.6, 1) * np.where(_are_shadows(colour, behind), 0.5, 1)
    return np.column_stack([centre, box, area, colour, behind, quality])


def _means(colours: Image, part: Ints, count: int) -> Floats:
    """Mean colours (count, 3) of the parts to which pixels (m, 3) belong."""
    sums = np.column_stack([np.bincount(part, x, count) for x in colours.T])
    return sums / np.maximum(np.bincount(part, minlength=count), 1)[:, None]


def _are_shadows(colours: Floats, grounds: Floats) -> Bools:
    """The same surfaces (m, 3) in less light: darker by about the same factor in all colours."""
    ratio = (colours + 4) / (grounds + 4)
    mean = ratio.mean(axis=1)
    return (mean > 0.35) & (mean < 0.95) & (np.ptp(ratio, axis=1) < 0.1 * mean)


def _distinct(rows: Floats) -> Floats:
    """The plainest of the rows, each thing once, though it shows at several levels."""
    rows = rows[np.argsort(-rows[:, 13], kind="stable")]
    apart = np.linalg.norm(rows[:, None, :2] - rows[:, :2], axis=2)
    same = np.tril((apart < 1) & (np.abs(np.log(rows[:, None, 6] / rows[:, 6])) < 0.22), -1)
    kept: list[int] = []
    for k in range(len(rows)):
        if not same[k, kept].any():
            kept.append(k)
        if len(kept) == _KEPT:
            break
    return rows[kept]


def uncommon(found: Candidates, targets: int) -> Candidates:
    """Candidates worth the less the more of them look alike in their frame than there are targets.

    The leaves of a tree hardly leave their places, and before a plain wall that does not tell the
    camera's motion all that is at rest seems to move. But they are many, the targets few.
    """
    quality = found.quality.copy()
    bounds = np.searchsorted(found.frame, np.arange(found.frame[-1] + 2)) if len(quality) else [0]
    for first, last in zip(bounds[:-1], bounds[1:], strict=True):
        here = found.only(np.s_[first:last])
        like = np.linalg.norm(here.colour[:, None] - here.colour, axis=2) < 40
        like &= np.abs(np.log(here.size[:, None] / here.size)) < np.log(2)
        apart = np.linalg.norm(here.centre[:, None] - here.centre, axis=2)
        like &= apart > (here.size[:, None] + here.size) / 2  # not the same at another level
        quality[first:last] *= np.minimum((targets + 1) / (1 + like.sum(axis=1)), 1)
    return found._replace(quality=quality)
