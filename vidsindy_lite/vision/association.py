"""Which candidates of successive frames are one target: the best path through them.

A path gains the quality of its candidates and pays for leaving its motion, of constant velocity or
constant acceleration, for changes of size and colour, and for gaps. Dynamic programming (Viterbi)
finds the best one; without what lies on it, the next.
"""

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints
from .candidates import Candidates

GAP = 15
"""Frames that a path may miss."""
TOLD = 20.0
"""Quality of a candidate that somebody points at."""


class Path(NamedTuple):
    """Rows of the candidates, and its value, as far as it travels and keeps its outline."""

    rows: Ints
    rating: float


def best_path(seen: Candidates) -> tuple[Ints, float]:
    """The rows of the path of the highest value, and that value."""
    if not len(seen.frame):
        return np.zeros(0, int), 0.0
    size = seen.size + 2
    # Of quality, that a candidate must exceed to be worth anything.
    value, before = seen.quality - 0.2, np.full(len(size), -1)
    speed, bent = np.full((2, len(size), 2), np.nan)
    bounds = np.searchsorted(seen.frame, np.arange(seen.frame[-1] + 2))
    for i in np.unique(seen.frame):
        new, old = (
            np.arange(bounds[i], bounds[i + 1]),
            np.arange(bounds[max(i - GAP, 0)], bounds[i]),
        )
        if not len(old):
            continue
        gap = (i - seen.frame[old])[:, None]
        worth = value[old][:, None] - _price(seen, size, old, new, gap, speed[old], bent[old])
        best = worth.argmax(axis=0)
        gain = worth[best, np.arange(len(new))]
        j, p = new[gain > 0], old[best[gain > 0]]
        value[j] += gain[gain > 0]
        before[j] = p
        past = (i - seen.frame[p])[:, None]
        now = (seen.place[j] - seen.place[p]) / past
        bent[j] = (now - speed[p]) / past
        # Of a slow target the places scatter more than it moves: its speed is a mean.
        fresh = 0.6 + 0.4 * np.minimum(np.linalg.norm(now, axis=1) / size[j], 1)[:, None]
        speed[j] = np.where(np.isfinite(speed[p]), (1 - fresh) * speed[p] + fresh * now, now)
    rows, row = [], int(value.argmax())
    while row >= 0:
        rows.append(row)
        row = int(before[row])
    return np.array(rows[::-1]), float(value.max())


def _price(
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
    return np.asarray(np.where(known, turn, start) + 0.6 * resize + colour / 120 + 0.12 * (gap - 1))


def plainest_paths(seen: Candidates, most: int = 3) -> list[Path]:
    """Several paths that have nothing in common, the plainest first."""
    left, found = np.arange(len(seen.frame)), []
    for _ in range(most):
        rows, value = best_path(seen.only(left))
        if len(rows) < 5:
            break
        rows = left[rows]
        found.append(Path(rows, value * _travels(seen, rows) * _rigid(seen, rows)))
        box = np.full((seen.frame[-1] + 1, 4), np.nan)
        box[seen.frame[rows]] = seen.box[rows]
        box, own = box[seen.frame[left]], seen.box[left]
        apart = np.abs(box[:, :2] + box[:, 2:] / 2 - own[:, :2] - own[:, 2:] / 2)
        with np.errstate(invalid="ignore"):
            part = (apart <= np.maximum(box[:, 2:], own[:, 2:]) / 2 + 1).all(axis=1)
        left = left[~part]
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
