"""What may be the target in each frame: all that differs from the ground, or from other frames.

Two differences, each a witness where the other is blind. That from the *ground* (`Plate`) shows all
that is not ground, also what moves slowly; that from the *neighbours*, a few frames before and
after, shows what moves before ground that changes, or that the plate knows badly. Each is cut at
three levels: a target that touches its shadow, or a faint change of the light, is a part of one
thing at a low level and stands alone at a higher one. What is connected is a candidate; which of
them are the target is for the association to say.

All of this happens on reduced frames, to be quick. What a user knows of the target is a hint:
a box around it in one frame, or its colour.

A path gains the quality of its candidates and pays for leaving its motion, of constant velocity or
constant acceleration, for changes of size and colour, and for gaps. Dynamic programming (Viterbi)
finds the best one; without what lies on it, the next.

What the target looks like is learned on the way. The *filter* answers with a peak where the
gradients and colours of a patch are those that it has learned: the least squares of all patches and
their cyclic shifts, which the Fourier transform makes diagonal (Bolme et al. 2010; Henriques et al.
2015). The *histograms* say of each colour how much likelier it is in the target than around it
(Bertinetto et al. 2016). From one frame in which the target is known it is followed both ways, each
time near where its motion leads and near the candidates there.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from itertools import chain, islice, repeat, tee
from typing import Any, NamedTuple, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from ..arrays import Bools, Floats, Floats32, Image, Ints
from ..checks import check_integer, check_vector, shown
from ..storage import check_file, read_tree
from .plate import Plate, carry, changes, least_difference, lengths, light, shadowed, tolerance
from .video import Reel

_KEPT = 16  # candidates of a frame
GAP = 15  # frames that a path may miss
TOLD = 20.0  # quality of a candidate that somebody points at
_SIDE = 40  # pixels of a patch
_WIDE = 2.6  # width of the patch, in widths of the target


class Spot(NamedTuple):
    """Where a target is known: number of a frame, and centre (2,) and size (2,) there, reduced."""

    frame: int
    centre: Floats
    size: Floats


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
        if self.frame is not None and self.box is not None:
            object.__setattr__(self, "frame", check_integer("frame", self.frame))
            box = tuple(check_vector("box", self.box, 4).tolist())
            if min(box[2:]) < 2:
                raise ValueError(f"box: must be two pixels wide and high or more, got {box}")
            object.__setattr__(self, "box", box)
        if self.colour is not None:
            colour = tuple(check_vector("colour", self.colour, 3).tolist())
            if not 0 <= min(colour) <= max(colour) <= 255:
                raise ValueError(f"colour: must be red, green, blue, 0 to 255 each, got {colour}")
            object.__setattr__(self, "colour", colour)

    def boxed(self, size: tuple[int, int], frames: int, factor: int) -> Spot | None:
        """The box, in frames that are reduced by a factor; None without a box.

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
                f"got {as_written(self.box)}"
            )
        return Spot(self.frame, (middle - (factor - 1) / 2) / factor, sides / factor)

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
        here = as_written(colour.round().tolist())
        return (f"what is followed has the colour {here}, not {as_written(self.colour)} as told",)


def as_written(numbers: Sequence[float]) -> str:
    """Numbers as a user writes them."""
    return f"({', '.join(f'{number:g}' for number in numbers)})"


def _alike(colours: Floats, told: Floats) -> Floats:
    """How alike colours (m, 3) are to others, from 0 to 1, also in another light."""
    shade = (colours * told).sum(axis=1) / np.maximum((colours**2).sum(axis=1), 1)
    off = np.clip(shade, 0.7, 1.4)[:, None] * colours - told
    return np.asarray(np.exp(-((off**2).sum(axis=1) / 70.0**2)))


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
    hints: list[Hint | None] = []
    known = [field.name for field in fields(Hint)]
    for i, told in enumerate(table.get("target") for table in tables):
        try:
            if told is not None and not (isinstance(told, dict) and set(told) <= set(known)):
                raise ValueError(f"must be a table of {', '.join(known)}, got {shown(told)}")
            hints.append(None if told is None else Hint(**told))
        except ValueError as error:
            raise ValueError(f"{path}: camera {i}: target: {error}") from None
    return tuple(hints)


class Candidates(NamedTuple):
    """The candidates of all frames as rows of a table, in the order of their frames.

    `frame` (m,); `place` (m, 2) in the first frame; `centre` (m, 2), `box` (m, 4) (left, top,
    width, height) and `area` (m,) in the frame; the mean `colour` (m, 3) and that of the ground
    `behind` (m, 3) it; `quality` (m,), how plain it is; `clear` (m,), of the border.
    """

    frame: Ints
    place: Floats
    centre: Floats
    box: Floats
    area: Floats
    colour: Floats
    behind: Floats
    quality: Floats
    clear: Bools

    @property
    def size(self) -> Floats:
        """Side of a square of the same area."""
        return np.asarray(np.sqrt(self.area))

    def only(self, rows: Ints | Bools | slice) -> Self:
        """Some of the rows."""
        return type(self)._make(column[rows] for column in self)

    @classmethod
    def joined(cls, parts: Iterable[Candidates]) -> Candidates:
        """Several tables as one, in the order of their frames."""
        whole = cls(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
        return whole.only(np.argsort(whole.frame, kind="stable"))


def candidates(
    frames: Iterable[Image], maps: Floats, plate: Plate, noise: float, targets: int, bare: bool
) -> tuple[Candidates, list[Floats32]]:
    """The candidates of all frames, and how much brighter each frame is than the ground.

    If `bare`, without the strings on which they hang.
    """
    lights, found = [], []
    bound = tolerance(plate.image, least_difference(noise), moves=plate.moves)
    bound[plate.valid == 0] = 1e3
    for i, (frame, here, others) in enumerate(_with_neighbours(frames, maps)):
        ground, known = plate.seen_from(here)
        allowed = plate.laid(bound, here, borderValue=1e3)
        lit = light(frame, ground, known)
        lights.append(lit)
        strength = lengths(changes(frame, ground, lit)) / allowed * known
        lighter, some = strength.copy(), strength > 1  # without shadows
        lighter[some] = np.where(shadowed(frame[some], ground[some] * lit), 1, strength[some])
        levels = 1.0, 2.5, 6.0  # tolerances by which what is connected differs
        witnesses = [(lighter, 2.5, 1.0), *((strength, level, 1.0) for level in levels)]
        if others:
            near = _from_neighbours(frame, others, plate.moves) / allowed
            witnesses += [(near, level, 0.7) for level in levels]
        one = _distinct(Candidates.joined(
            components(differs, level, frame, ground, worth, bare)
            for differs, level, worth in witnesses
        ))  # fmt: skip
        found.append(one._replace(frame=one.frame + i, place=carry(here, one.centre),
                                  colour=one.colour / lit))  # fmt: skip
    return _uncommon(Candidates.joined(found), targets), lights


def _with_neighbours(
    frames: Iterable[Image], maps: Floats
) -> Iterator[tuple[Image, Floats, list[tuple[Image, Floats]]]]:
    """Each frame and its map, and some frames before and after it with maps that lay them on it."""
    apart = 3  # frames to the neighbours with which a frame is compared
    first, middles, last = tee(zip(frames, maps, strict=False), 3)
    before = chain(repeat(None, apart), first)
    after = chain(islice(last, apart, None), repeat(None))
    for (frame, here), *beside in zip(middles, before, after, strict=False):
        back = np.linalg.inv(here)
        yield frame, here, [(one[0], back @ one[1]) for one in beside if one is not None]


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


def without_strings(mask: NDArray[Any]) -> Image:
    """A mask, (h, w), without what hangs on its parts, up to half as wide and five pixels."""
    inside = cv2.distanceTransform(np.pad(mask, 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
    labels = np.asarray(cv2.connectedComponents(mask)[1], np.int64)
    widest = np.zeros(labels.max() + 1, np.float32)
    np.maximum.at(widest, labels[mask > 0], inside[mask > 0])
    half = np.minimum(0.5 * widest, 2.5)[labels]
    beyond = cv2.distanceTransform((inside <= half).astype(np.uint8), cv2.DIST_L2, 5)
    return np.asarray((mask > 0) & (beyond <= half), np.uint8)


def components(
    strength: Floats32, level: float, frame: Image, ground: Image, worth: float, bare: bool
) -> Candidates:
    """What differs by some level and is connected, in a frame that counts as the first one.

    A thing is plain if it differs by much, fills its box, is of more than a few pixels and lies
    clear of the border. A shadow, the same surface in less light, is half as plain.
    """
    mask = cv2.morphologyEx((strength > level).astype(np.uint8), cv2.MORPH_CLOSE,
                            np.ones((3, 3), np.uint8))  # fmt: skip
    left, top, wide, high = cv2.boundingRect(mask)
    shown = mask[top : top + max(high, 1), left : left + max(wide, 1)]
    shown = without_strings(shown) if bare else shown
    count, labels, stats, _ = cv2.connectedComponentsWithStats(shown)
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
    clear = (box[:, :2] > 0).all(axis=1) & (box[:, :2] + box[:, 2:] < mask.shape[::-1]).all(axis=1)
    quality *= np.where(clear, 1, 0.6) * np.where(shadowed(colour, behind), 0.5, 1)
    first = np.zeros(len(order), int)
    return Candidates(first, centre, centre, box, area, colour, behind, quality, clear)


def _means(colours: Image, part: Ints, count: int) -> Floats:
    """Mean colours (count, 3) of the parts to which pixels (m, 3) belong."""
    sums = np.column_stack([np.bincount(part, x, count) for x in colours.T])
    return sums / np.maximum(np.bincount(part, minlength=count), 1)[:, None]


def _distinct(found: Candidates) -> Candidates:
    """The plainest candidates of a frame, each thing once, though it shows at several levels."""
    found = found.only(np.argsort(-found.quality, kind="stable"))
    apart = np.linalg.norm(found.centre[:, None] - found.centre, axis=2)
    same = np.tril((apart < 1) & (np.abs(np.log(found.area[:, None] / found.area)) < 0.22), -1)
    kept: list[int] = []
    for k in range(len(same)):
        if not same[k, kept].any():
            kept.append(k)
    return found.only(np.array(kept[:_KEPT], int))


def _uncommon(found: Candidates, targets: int) -> Candidates:
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


class Motion(NamedTuple):
    """A path: its rows of the candidates, and its value."""

    rows: Ints
    rating: float


def best_path(seen: Candidates, *, away: bool = False) -> Motion:
    """The path of the highest value.

    A target may be away for a few frames, or for any time: then a candidate follows one of those
    before it, or one of the best of all that are older.
    """
    if not len(seen.frame):
        return Motion(np.zeros(0, int), 0.0)
    size = seen.size + 2
    # Of quality, that a candidate must exceed to be worth anything.
    value, before = seen.quality - 0.2, np.full(len(size), -1)
    speed, bent = np.full((2, len(size), 2), np.nan)
    bounds = np.searchsorted(seen.frame, np.arange(seen.frame[-1] + 2))
    older, passed = np.zeros(0, int), 0
    for i in np.unique(seen.frame):
        new, recent = np.arange(bounds[i], bounds[i + 1]), bounds[max(i - GAP, 0)]
        if away:
            older = np.concatenate([older, np.arange(passed, recent)])
            older = older[np.lexsort((older, -value[older]))][:_KEPT]
            passed = recent
        old = np.concatenate([older, np.arange(recent, bounds[i])])
        if not len(old):
            continue
        gap = (i - seen.frame[old])[:, None]
        worth = value[old][:, None] - _penalty(seen, size, old, new, gap, speed[old], bent[old])
        best = worth.argmax(axis=0)
        gain = worth[best, np.arange(len(new))]
        j, p = new[gain > 0], old[best[gain > 0]]
        value[j] += gain[gain > 0]
        before[j] = p
        past = (i - seen.frame[p])[:, None]
        now = (seen.place[j] - seen.place[p]) / past
        now[past[:, 0] > GAP] = np.nan  # since then it may have turned
        bent[j] = (now - speed[p]) / past
        # Of a slow target the places scatter more than it moves: its speed is a mean.
        fresh = 0.6 + 0.4 * np.minimum(np.linalg.norm(now, axis=1) / size[j], 1)[:, None]
        speed[j] = np.where(np.isfinite(speed[p]), (1 - fresh) * speed[p] + fresh * now, now)
    rows, row = [], int(value.argmax())
    while row >= 0:
        rows.append(row)
        row = int(before[row])
    return Motion(np.array(rows[::-1]), float(value.max()))


def _penalty(
    seen: Candidates, size: Floats, old: Ints, new: Ints, gap: Ints, speed: Floats, bent: Floats
) -> Floats:
    """What it costs to go on from old rows, of these motions, to new ones, (old, new)."""
    step = (seen.place[new] - seen.place[old][:, None]) / gap[..., None]
    v, a = (np.nan_to_num(x)[:, None] for x in (speed, bent))
    known, bends = np.isfinite(speed[:, :1]), np.isfinite(bent[:, :1])
    change = np.linalg.norm(step - v, axis=2)
    curved = np.linalg.norm(step - v - a, axis=2)  # as what falls does
    change = np.where(bends, np.minimum(change, curved), change)
    side = np.minimum(size[old][:, None], size[new])
    reach = 0.35 * side + 1.5 + 0.15 * np.linalg.norm(v, axis=2)
    # What jumps pays little more for a larger jump, but to and from what is pointed at.
    told = (seen.quality[old] >= TOLD)[:, None] | (seen.quality[new] >= TOLD)
    far = np.where(told, np.inf, change / side)
    turn = 0.5 * np.minimum((change * np.sqrt(gap) / reach) ** 2, 3 + 0.3 * far)
    start = np.minimum(0.25 * change / side, 0.3 + 0.05 * far)
    colour = np.linalg.norm(seen.colour[old][:, None] - seen.colour[new], axis=2)
    resize = np.abs(np.log(size[old][:, None] / size[new]))
    missed = 0.12 * np.minimum(gap - 1, GAP)
    return np.asarray(np.where(known, turn, start) + 0.6 * resize + colour / 120 + missed)


def plainest_paths(seen: Candidates, most: int = 3, *, away: bool = False) -> list[Motion]:
    """Several paths (see `best_path`) that have nothing in common, the plainest first.

    What counts is the value of each, as far as it travels, keeps its outline and is seen whole.
    """
    left, found = np.arange(len(seen.frame)), []
    for _ in range(most):
        rows, value = best_path(seen.only(left), away=away)
        if len(rows) < 5:
            break
        rows = left[rows]
        clear = np.clip(3 * seen.clear[rows].mean(), 0.25, 1)  # what the border cuts has no place
        found.append(Motion(rows, value * clear * _travels(seen, rows) * _rigid(seen, rows)))
        box = np.full((seen.frame[-1] + 1, 4), np.nan)
        box[seen.frame[rows]] = seen.box[rows]
        box, own = box[seen.frame[left]], seen.box[left]
        apart = np.abs(box[:, :2] + box[:, 2:] / 2 - own[:, :2] - own[:, 2:] / 2)
        with np.errstate(invalid="ignore"):
            left = left[~(apart <= np.maximum(box[:, 2:], own[:, 2:]) / 2 + 1).all(axis=1)]
    return sorted(found, key=lambda path: -path.rating)


def _travels(seen: Candidates, rows: Ints) -> float:
    """From 0, for what stays in its place, to 1, for what leaves it by many times its size."""
    low, high = np.percentile(seen.place[rows], [5, 95], axis=0)
    extent = float(np.linalg.norm(high - low) / (np.median(seen.size[rows]) + 1))
    return extent / (extent + 1)


def _rigid(seen: Candidates, rows: Ints) -> float:
    """From 1, for what keeps its outline, to 0, for what changes it in each frame, as who walks."""
    sides = seen.box[rows, 2:]
    change = np.maximum(np.abs(np.diff(sides, axis=0)) - 2, 0) / sides[1:]  # two pixels are nothing
    return float(1 / (1 + 20 * np.median(change.sum(axis=1))))


class Looks(NamedTuple):
    """Where a target's looks are found: boxes (n, 4) (centre, width, height) in the frames.

    NaN where not; `fit` (n,) is the filter's answer, 1 where it was learned first; `like` (m,) is
    for each candidate how likely its colours are the target's.
    """

    box: Floats
    fit: Floats
    like: Floats


class Appearance:
    """A correlation filter and two histograms, of patches that are resampled to one size.

    Centres and sizes are in pixels of frames that are reduced by `factor`; the frames are whole.
    """

    def __init__(self, frame: Image, centre: Floats, size: Floats, factor: int = 1) -> None:
        self._factor = factor
        self._hann = np.outer(np.hanning(_SIDE), np.hanning(_SIDE)).astype(np.float32)
        t = np.arange(_SIDE) - _SIDE // 2
        peak = np.exp(-(t[:, None] ** 2 + t**2) / (2 * (_SIDE / _WIDE / 12) ** 2))
        self._aim = np.fft.rfft2(np.fft.ifftshift(peak))
        self._cross = self._power = self._own = self._around = np.zeros(1)
        self.learn(frame, centre, size, 1.0)

    def learn(self, frame: Image, centre: Floats, size: Floats, rate: float) -> None:
        """Take in what the target looks like in one more frame."""
        patch = self._patch(frame, centre, size)
        z = self._features(patch)
        radius = np.abs(np.mgrid[:_SIDE, :_SIDE] - (_SIDE - 1) / 2) * 2 * _WIDE / _SIDE
        inner, outer = (radius**2).sum(axis=0) < 0.7, (radius > 1.25).any(axis=0)
        bins = _bins(patch)
        new = (np.conj(z) * self._aim, (np.abs(z) ** 2).sum(axis=0), *(
            np.bincount(bins[m], minlength=16**3) / m.sum() for m in (inner, outer)))  # fmt: skip
        known = self._cross, self._power, self._own, self._around
        self._cross, self._power, self._own, self._around = (
            (1 - rate) * a + rate * b for a, b in zip(known, new, strict=True)
        )
        self._likely = ((self._own + 1e-4) / (self._own + self._around + 2e-4)).astype(np.float32)

    def likely(self, image: Image) -> Floats32:
        """Of each pixel, how likely its colour is the target's."""
        return self._likely[_bins(image)]

    def find(self, frame: Image, centre: Floats, size: Floats) -> tuple[Floats, float, float]:
        """The best place near a centre, the filter's answer there, and that of the histograms."""
        patch = self._patch(frame, centre, size)
        z = self._features(patch)
        damped = self._power + 0.02 * self._power.mean() + 1e-3
        answer = np.fft.irfft2((self._cross * z).sum(axis=0) / damped, s=(_SIDE, _SIDE))
        answer = np.fft.fftshift(answer)
        k = int(0.9 * _SIDE / _WIDE)
        colour = cv2.blur(self.likely(patch), (k, k))
        both = 0.7 * answer + 0.3 * colour
        y, x = (2 + k for k in np.divmod(int(both[2:-2, 2:-2].argmax()), _SIDE - 4))
        off = np.array([x + _top(both[y, x - 1 : x + 2]), y + _top(both[y - 1 : y + 2, x])])
        step = (off - _SIDE // 2) / _SIDE * (_WIDE * size + 4)
        return centre + step, float(answer[y, x]), float(colour[y, x])

    def _patch(self, frame: Image, centre: Floats, size: Floats) -> Image:
        side = self._factor * (_WIDE * size + 4)
        low = self._factor * centre + (self._factor - 1 - side) / 2
        k = 2 * _SIDE  # then halved: a large target is not sampled at single pixels
        m = np.array([[side[0] / k, 0, low[0]], [0, side[1] / k, low[1]]])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        fine = cv2.warpAffine(frame, m, (k, k), flags=flags, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(cv2.resize(fine, (_SIDE, _SIDE), interpolation=cv2.INTER_AREA), np.uint8)

    def _features(self, patch: Image) -> NDArray[np.complex128]:
        """Fourier transforms of eight gradients and three colours."""
        grey = cv2.cvtColor(patch, cv2.COLOR_RGB2GRAY).astype(np.float32)
        gx, gy = cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1)
        norm = cv2.blur(np.hypot(gx, gy), (9, 9)) + 8
        x, y = np.asarray(gx / norm), np.asarray(gy / norm)
        maps = [np.maximum(x * np.cos(a) + y * np.sin(a), 0) for a in np.arange(8) * np.pi / 4]
        lab = cv2.cvtColor(patch, cv2.COLOR_RGB2LAB).astype(np.float32)
        maps += [
            (one - one.mean()) / s for one, s in zip(cv2.split(lab), (60, 25, 25), strict=True)
        ]
        return np.fft.rfft2(np.array(maps) * self._hann)


def _bins(image: Image) -> Ints:
    """Which of the bins of a histogram each pixel is in: of 16 levels of each colour."""
    q = (image >> 4).astype(np.int32)
    return np.asarray((q[..., 0] << 8) | (q[..., 1] << 4) | q[..., 2])


def _top(values: Floats) -> float:
    """By how much the top of a parabola through three values is off the middle one."""
    before, here, after = values.tolist()
    return float(np.clip(0.5 * (before - after) / (before - 2 * here + after - 1e-9), -0.5, 0.5))


def followed(frames: Reel, maps: Floats, found: Candidates, seed: Spot) -> Looks:
    """Follow a target by its looks, both ways.

    Parameters
    ----------
    frames : Reel
        Reduced
    maps : ndarray, shape (n, 3, 3)
        Of reduced frames.
    found : Candidates
    seed : Spot
    """
    n = len(maps)
    factor = frames.factor if frames.whole.few else 1
    box, fit = np.full((n, 4), np.nan), np.zeros(n)
    like = np.ones(len(found.frame))  # of what is not looked at, nothing is said
    bounds = np.searchsorted(found.frame, np.arange(n + 1))
    first, middle, size = seed
    box[first], fit[first] = [*middle, *size], 1.0
    for way in (1, -1):
        size, usual = seed.size.astype(float), 1.0
        last = [(first, carry(maps[first], middle[None])[0])]
        for i, frame in _in_order(frames, first, way, n):
            here = np.s_[bounds[i] : bounds[i + 1]]
            if i == first:
                looks = Appearance(frame, middle, size, factor)
            like[here] = _likeness(looks, frame[::factor, ::factor], found.box[here])
            gap = abs(i - last[-1][0])
            if i == first or gap > 60:  # frames after which nothing is known of its looks
                continue
            before, now = last[0], last[-1]  # the same at first
            speed = (now[1] - before[1]) / max(abs(now[0] - before[0]), 1)
            ahead = carry(np.linalg.inv(maps[i]), (now[1] + speed * min(gap, 8))[None])[0]
            near = _near(found.only(here), like[here], ahead, size, gap)
            tries: list[Floats] = []
            for one in [ahead, *near]:
                if not any(np.linalg.norm(one - other) < size.min() / 4 for other in tries):
                    tries.append(one)
            views = []
            for place, answer, colour in (looks.find(frame, centre, size) for centre in tries):
                apart = np.linalg.norm(place - ahead) / (size.max() + 8)
                moved = any(np.linalg.norm(place - one) < size.min() / 2 for one in near)
                score = 0.7 * answer + 0.3 * colour + 0.25 * moved - 0.1 * apart
                views.append((score, place, answer, colour, moved))
            _, place, answer, colour, moved = max(views, key=lambda view: view[0])
            inside = ((place >= 0) & (factor * place < frame.shape[1::-1])).all()
            usual = answer if len(last) == 1 and gap == 1 else usual
            # What differs from the ground and has its colours may be blurred or turned.
            sure = answer > max(0.12, 0.35 * usual) or (moved and colour > 0.5)
            if not (inside and sure):
                continue
            usual = 0.95 * usual + 0.05 * answer
            for grown in (0.96, 1.04) if i % 2 else ():
                there, a, c = looks.find(frame, place, size * grown)
                if a + 0.3 * c > 1.03 * (answer + 0.3 * colour):
                    place, answer, size = there, a, size * grown
                    break
            box[i], fit[i] = [*place, *size], answer
            looks.learn(frame, place, size, 0.03)
            last = [now, (i, carry(maps[i], place[None])[0])]
    return Looks(box, fit, like)


def _in_order(frames: Reel, first: int, way: int, n: int) -> Iterator[tuple[int, Image]]:
    """The frames, reduced if they are many, with their numbers from one on, in both directions."""
    film = frames.whole if frames.whole.few else frames
    numbers = range(first, n) if way > 0 else range(first, -1, -1)
    for k in range(0, len(numbers), 50):  # at once in the memory
        block = numbers[k : k + 50][::way]
        yield from list(zip(block, film.pick(block), strict=False))[::way]


def _near(found: Candidates, like: Floats, ahead: Floats, size: Floats, gap: int) -> list[Floats]:
    """The two candidates of a frame that are likeliest what is expected there."""
    apart = np.linalg.norm(found.centre - ahead, axis=1)
    resize = np.abs(np.log((found.size + 1) / (np.sqrt(0.7 * size.prod()) + 1)))
    good = np.flatnonzero((apart < (1.5 + 0.5 * gap) * size.max() + 8) & (resize < 0.6))
    order = good[np.argsort(-(found.quality * (0.25 + 0.75 * like))[good])][:2]
    return list(found.centre[order])


def _likeness(looks: Appearance, frame: Image, boxes: Floats) -> Floats:
    """How likely the colours in the inner parts of boxes (k, 4) are the target's."""
    total = cv2.integral(looks.likely(frame))
    size = np.array(frame.shape[1::-1])
    low = np.clip(np.floor(boxes[:, :2] + 0.15 * boxes[:, 2:]), 0, size - 1).astype(int)
    high = np.clip(np.ceil(boxes[:, :2] + 0.85 * boxes[:, 2:]), low + 1, size).astype(int)
    (u, v), (x, y) = low.T, high.T
    inside = total[y, x] - total[v, x] - total[y, u] + total[v, u]
    return np.asarray(inside / (high - low).prod(axis=1))
