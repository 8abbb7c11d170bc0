"""Paths that meet, cut there and joined again by what things look like before and after.

Where a ball passes before somebody the two are one blob for a while, and what comes out of it as
one path may be the ball before and the person after. Motion cannot tell, since it is that of the
blob; but all that is seen before and all that is seen after can: things keep their colours and
about their sizes.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from ..arrays import Floats, Ints
from .linking import MEMORY, RECOLOUR, Sightings

_ROOM = 2.0  # pixels between two boxes that do not touch
_FEWEST = 3  # sightings that say what a thing looks like
_PLAINLY = 1.0  # by how much dearer the looks are as they are joined than the other way round


def rejoined(seen: Sightings, paths: Sequence[Ints]) -> list[Ints]:
    """Paths, rows of the sightings each, that change places wherever looks plainly say so."""
    paths = list(paths)
    for i, j in combinations(range(len(paths)), 2):
        met = _meetings(seen, paths[i], paths[j])
        for first, last, until in zip(met[:, 0], met[:, 1], [*met[1:, 0], np.inf], strict=False):
            paths[i], paths[j] = _parted(seen, paths[i], paths[j], (first, last, until))
    return paths


def _meetings(seen: Sightings, one: Ints, other: Ints) -> Ints:
    """First and last frames (m, 2) of the times in which the boxes of two paths touch."""
    ends = [seen.frame[rows[[0, -1]]] for rows in (one, other)]
    start, stop = max(e[0] for e in ends) - MEMORY, min(e[1] for e in ends) + MEMORY
    frames = np.arange(max(start, 0), stop + 1)
    if not len(frames):
        return np.zeros((0, 2), int)
    (low, size), (low2, size2) = (_box(seen, rows, frames) for rows in (one, other))
    touch = (np.maximum(low, low2) - np.minimum(low + size, low2 + size2) < _ROOM).all(axis=1)
    change = np.flatnonzero(np.diff(np.concatenate([[False], touch, [False]])))
    return frames[0] + change.reshape(-1, 2) - [0, 1]


def _box(seen: Sightings, rows: Ints, frames: Ints) -> tuple[Floats, Floats]:
    """Left top edge and size of a path's box in frames, also in those between its sightings."""
    box = np.column_stack([np.interp(frames, seen.frame[rows], x) for x in seen.box[rows].T])
    return box[:, :2], box[:, 2:]


def _parted(
    seen: Sightings, one: Ints, other: Ints, meeting: tuple[float, float, float]
) -> tuple[Ints, Ints]:
    """Two paths behind a meeting, of first and last frame, and until the next: which is which."""
    first, last, until = meeting
    heads, tails = [], []
    for rows in (one, other):
        frame = seen.frame[rows]
        heads.append(rows[frame < first])
        tails.append(rows[(frame > last) & (frame < until)])
    apart = np.array([[_unlike(seen, head, tail) for tail in tails] for head in heads])
    if apart[0, 0] + apart[1, 1] < apart[0, 1] + apart[1, 0] + _PLAINLY:
        return one, other
    # What is seen while they touch goes to the one that it looks like, up to one frame for both.
    crossed = np.concatenate([heads[0], tails[1]]), np.concatenate([heads[1], tails[0]])
    costs = []
    for cut in range(int(first), int(last) + 2):
        parts = _swapped(seen, one, other, cut)
        within = [rows[(seen.frame[rows] >= first) & (seen.frame[rows] <= last)] for rows in parts]
        costs.append(sum(_off(seen, a, b).sum() for a, b in zip(crossed, within, strict=True)))
    return _swapped(seen, one, other, int(first) + int(np.argmin(costs)))


def _swapped(seen: Sightings, one: Ints, other: Ints, cut: int) -> tuple[Ints, Ints]:
    """Two paths that change places from some frame on."""
    before, after = ([rows[(seen.frame[rows] < cut) == is_] for rows in (one, other)]
                     for is_ in (True, False))  # fmt: skip
    return np.concatenate([before[0], after[1]]), np.concatenate([before[1], after[0]])


def _unlike(seen: Sightings, one: Ints, other: Ints) -> float:
    """How different two stretches look; 0 if one of them says nothing."""
    return float(np.median(_off(seen, one, other))) if len(other) >= _FEWEST else 0.0


def _off(seen: Sightings, known: Ints, rows: Ints) -> Floats:
    """How different each row looks from what is known, priced as the steps of a path are."""
    if len(known) < _FEWEST:
        return np.zeros(len(rows))
    recolour = np.linalg.norm(seen.colour[rows] - np.median(seen.colour[known], axis=0), axis=1)
    resize = np.abs(np.log(seen.size[rows] / np.median(seen.size[known])))
    return np.asarray(recolour / RECOLOUR + resize, float)
