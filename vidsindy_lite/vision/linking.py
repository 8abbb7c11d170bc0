"""The most plausible path through candidates that may be the target, one or none in each frame.

A path gains the quality of its candidates and pays for leaving its motion, for changing its size or
colour, and for gaps. Dynamic programming finds the best one. A state is a candidate together with
the one before it, which gives the velocity; of each candidate's states the few best are kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints
from .candidates import Candidate

TOLD = 100.0  # quality of a candidate that somebody points at, to and from which nothing jumps
_GAIN = 0.15  # of quality, that a candidate must exceed to be worth anything
_GAP = 0.3  # price of a gap
_SLOT = 0.04  # price of each frame of it
_JUMP = 2.0  # highest price of leaving a motion
_START = 0.06  # of the image's diagonal: a first step of a motion that is nothing special
MEMORY = 20  # frames after which a path ends
RECOLOUR = 60.0  # grey levels of a change of colour that costs 1
_STATES = 4  # states of a candidate that are kept


@dataclass(frozen=True)
class Sightings:
    """The candidates of all frames as rows of a table, in the order of their frames.

    `frame`, `which` of the frame, `centre` (m, 2) steadied, `size`, `colour` (m, 3), `quality`,
    `box` (m, 4) in the frame;
    `diagonal` of the image, in the same pixels.
    """

    frame: Ints
    which: Ints
    centre: Floats
    size: Floats
    colour: Floats
    quality: Floats
    box: Floats
    diagonal: float

    @classmethod
    def of(
        cls,
        candidates: Sequence[Sequence[Candidate]],
        places: Sequence[Floats],
        diagonal: float,
    ) -> "Sightings":
        """Candidates and their steadied centres."""
        rows = [(i, k, c) for i, found in enumerate(candidates) for k, c in enumerate(found)]
        frame, which = np.array([row[:2] for row in rows], int).reshape(-1, 2).T
        return cls(
            frame, which, np.concatenate([np.zeros((0, 2)), *places]),
            np.sqrt([c.area for *_, c in rows]),
            np.array([c.colour for *_, c in rows]).reshape(-1, 3),
            np.array([c.quality for *_, c in rows]),
            np.array([c.box for *_, c in rows]).reshape(-1, 4), diagonal,
        )  # fmt: skip

    def only(self, rows: Ints) -> "Sightings":
        """Some of the rows."""
        return Sightings(
            self.frame[rows],
            self.which[rows],
            self.centre[rows],
            self.size[rows],
            self.colour[rows],
            self.quality[rows],
            self.box[rows],
            self.diagonal,
        )


def _prices(seen: Sightings, old: Ints, new: Ints, speed: Floats, moving: Floats) -> Floats:
    """What it costs to go on from states of old rows, of these speeds, to new rows, (old, new)."""
    gap = seen.frame[new] - seen.frame[old][:, None]
    along, down = (
        seen.centre[new, k] - seen.centre[old, k][:, None] - gap * speed[:, k][:, None]
        for k in (0, 1)
    )
    size, travel = seen.size[old][:, None], np.hypot(*speed.T)[:, None]
    known = 2 + 0.5 * size + 0.5 * travel * gap
    reach = np.where(moving[:, None], known, _START * seen.diagonal + 2 * size * gap)
    far = 0.5 * (along**2 + down**2) / reach**2
    told = (seen.quality[new] >= TOLD) | (seen.quality[old] >= TOLD)[:, None]
    price = _JUMP * np.where(told, far, 1 - np.exp(-far))
    # All else is the same for all states of a row.
    first = np.flatnonzero(np.diff(old, prepend=-1))
    return price + np.repeat(_looks(seen, old[first], new), np.diff(first, append=len(old)), axis=0)


def _looks(seen: Sightings, old: Ints, new: Ints) -> Floats:
    """What gaps and changes of size and colour cost from old to new rows, (old, new)."""
    gap = seen.frame[new] - seen.frame[old][:, None]
    price = np.where(gap > 1, _GAP + _SLOT * gap, 0)
    price += np.abs(np.log(seen.size[new] / seen.size[old][:, None]))
    apart = sum((seen.colour[new, k] - seen.colour[old, k][:, None]) ** 2 for k in range(3))
    return np.asarray(price + np.minimum(np.sqrt(apart) / RECOLOUR, 2.0), float)


def best_path(seen: Sightings) -> tuple[Ints, float]:
    """The rows of the path of the highest value, and that value."""
    m = len(seen.frame)
    if not m:
        return np.zeros(0, int), 0.0
    gain = seen.quality - _GAIN
    value = np.full((m, _STATES), -np.inf)
    value[:, 0] = gain
    speed, moving = np.zeros((m, _STATES, 2)), np.zeros((m, _STATES), bool)
    before = np.full((m, _STATES), -1)
    bounds = np.searchsorted(seen.frame, np.arange(seen.frame[-1] + 2))
    for i in np.unique(seen.frame):
        new = np.arange(bounds[i], bounds[i + 1])
        states = np.flatnonzero(np.isfinite(value[bounds[max(i - MEMORY, 0)] : bounds[i]].ravel()))
        states += bounds[max(i - MEMORY, 0)] * _STATES
        if not len(states):
            continue
        old = states // _STATES
        price = _prices(seen, old, new, speed.reshape(-1, 2)[states], moving.ravel()[states])
        worth = value.ravel()[states][:, None] - price
        # Of the states of each row before them only the best counts, and of these the few best.
        first = np.flatnonzero(np.diff(old, prepend=-1))
        best = np.maximum.reduceat(worth, first, axis=0)
        order = np.argsort(-best, axis=0)[:_STATES]
        for column, j in enumerate(new):
            chosen = order[:, column]
            chosen = chosen[best[chosen, column] > 0]
            if not len(chosen):
                continue
            ends = np.append(first, len(old))
            at = [first[r] + worth[first[r] : ends[r + 1], column].argmax() for r in chosen]
            n = len(chosen)
            value[j, :n] = gain[j] + best[chosen, column]
            before[j, :n] = states[at]
            step = seen.centre[j] - seen.centre[old[at]]
            speed[j, :n] = step / (i - seen.frame[old[at]])[:, None]
            moving[j, :n] = True
    rows, state = [], int(value.argmax())
    while state >= 0:
        rows.append(state // _STATES)
        state = before.ravel()[state]
    return np.array(rows[::-1]), float(value.max())


def worth(seen: Sightings, rows: Ints) -> float:
    """The value of a path, as `best_path` counts it."""
    total = float((seen.quality[rows] - _GAIN).sum())
    speed, moving = np.zeros((1, 2)), np.zeros(1, bool)
    for old, new in zip(rows[:-1, None], rows[1:, None], strict=True):
        total -= float(_prices(seen, old, new, speed, moving)[0, 0])
        gap = seen.frame[new] - seen.frame[old]
        speed, moving = (seen.centre[new] - seen.centre[old]) / gap, np.ones(1, bool)
    return total
