"""Who is who among several targets: across views and behind each meeting, told by geometry.

Two targets that meet in one image are apart in the others. So each view's tracks are cut into
*runs*, in which none can be mistaken for another. Two runs of different views that share some time
belong together in the one order in which their lines of sight meet in space, and so the runs of all
views hang together, unless all views are blind at once: then the targets go on smoothly in space,
where they hardly ever meet. Where they do, a guess would spoil all that is known: the longest part
is told, the others are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations, permutations, product

import numpy as np

from ..arrays import Floats, Ints
from .calibrate import learn_cameras
from .models import Camera, at_once, independent, intersect, missed
from .rig import ALIKE, Rig

_SHORTEST = 4  # frames of a run, and of what two runs have in common
_ENOUGH = 60  # frames from which the cameras are learned
_AHEAD, _DEGREE = 6, 4  # frames on both sides of a gap, through which a target goes like t^4


@dataclass(frozen=True, eq=False)
class _Run:
    """Frames in a row in which a view tells all targets apart, and their places (m, k, 2)."""

    view: int
    frames: Ints
    places: Floats

    def at(self, frames: Ints) -> Floats:
        """The places in some of its frames."""
        return self.places[frames - self.frames[0]]

    def ordered(self, order: Sequence[int]) -> _Run:
        """The same with the targets in another order."""
        return replace(self, places=self.places[:, list(order)])


def stacked(values: Floats, width: int) -> Floats:
    """Columns side by side, (n, width k), one below the other, with a row of NaN in between."""
    parts = values.reshape(len(values), values.shape[1] // width, width).swapaxes(0, 1)
    return np.pad(parts, ((0, 0), (0, 1), (0, 0)), constant_values=np.nan).reshape(-1, width)[:-1]


def side_by_side(rows: Floats, count: int) -> Floats:
    """What `stacked` has put one below the other."""
    n = (len(rows) + 1) // count - 1
    return np.hstack([rows[i * (n + 1) : i * (n + 1) + n] for i in range(count)])


def identify(tracks: Sequence[Floats], rig: Rig) -> tuple[list[Floats], list[str]]:
    """Give each target its own columns in all views, from left to right as the first view begins.

    Only the longest part in which that is sure is told; elsewhere the tracks are NaN.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2 k)
        Pixels of k targets in each view at the same instants, in any order, which may change
        wherever two of them meet or one is not seen.
    rig : Rig
        One camera per view, at least three; see `learn_cameras`.

    Returns
    -------
    tracks : list of ndarray, shape (n, 2 k)
        In which each pair of columns is one target.
    doubts : list of str
        What was left out, and why.

    Raises
    ------
    ValueError
        If all views never see all targets apart at once, or no order of the targets in the views
        fits the rig then better than the others.
    """
    views = [np.reshape(track, (len(track), -1, 2)) for track in tracks]
    runs = [run for i, view in enumerate(views) for run in _runs(i, view)]
    cameras = _cameras(views, runs, rig)
    groups = _joined(runs, cameras)
    *others, together = sorted(_parts(groups, cameras), key=lambda part: _size(part, cameras))
    start = min(together, key=lambda run: (run.view, run.frames[0]))
    numbered = np.argsort(start.places[0, :, 0]).tolist()
    told = [np.full_like(view, np.nan) for view in views]
    for run in (one.ordered(numbered) for one in together):
        told[run.view][run.frames] = run.places
    flat = [view.reshape(len(view), -1) for view in told]
    left = sum(_size(part, cameras)[1] for part in others)
    if left < 0.05 * len(views[0]):  # a few frames that are left out do no harm
        return flat, []
    doubt = (
        f"targets: {left} frames are left out, e.g. from frame {min(map(_first, others))} on: who "
        "is who there is not sure, as in between no two views tell the targets apart, and in space "
        "they meet, or are lost for too long"
    )
    return flat, [doubt]


def _parts(groups: Sequence[Sequence[_Run]], cameras: Sequence[Camera]) -> list[list[_Run]]:
    """Groups in one order of the targets, as far as that is sure: each with where it goes on."""
    parts: list[list[_Run]] = []
    for group in groups:
        for part in reversed(parts):
            order, sure = _on_from(part, group, cameras)
            if sure:
                part += [run.ordered(order) for run in group]
                break
        else:
            parts.append(list(group))
    return parts


def _size(part: Sequence[_Run], cameras: Sequence[Camera]) -> tuple[int, int]:
    """How many views have runs of a part, and in how many frames it tells where the targets are."""
    return len({run.view for run in part}), len(_in_space(part, cameras)[0])


def _runs(number: int, view: Floats) -> list[_Run]:
    """The runs of a view (n, k, 2): until another target might as well be a target's next place."""
    frames = np.flatnonzero(np.isfinite(view).all(axis=(1, 2)))
    before = np.concatenate((view[:1], view[:-1]))
    ahead = np.where(np.isfinite(before), 2 * view - before, view)[:-1]
    miss = np.linalg.norm(ahead[:, :, None] - view[1:, None], axis=3)
    own = np.einsum("nkk->nk", miss).max(axis=1)
    miss[:, *np.diag_indices(view.shape[1])] = np.inf
    # By so much closer, in times and pixels, a target is to where it goes.
    mistaken = miss.min(axis=(1, 2), initial=np.inf) < 2.0 * own + 2.0
    ends = 1 + np.flatnonzero((np.diff(frames) > 1) | mistaken[frames[:-1]])
    parts = [part for part in np.split(frames, ends) if len(part) >= _SHORTEST]
    return [_Run(number, part, view[part]) for part in parts]


def _cameras(views: Sequence[Floats], runs: Sequence[_Run], rig: Rig) -> tuple[Camera, ...]:
    """The cameras, learned where all views tell all targets apart for longest."""
    which = np.full((len(views[0]), len(views)), -1)
    for number, run in enumerate(runs):
        which[run.frames, run.view] = number
    sets, counts = np.unique(which, axis=0, return_counts=True)
    counts[(sets < 0).any(axis=1)] = 0
    if not len(sets) or counts.max() < _SHORTEST:
        raise ValueError(
            "targets: all views must show all targets apart from each other at once, for some "
            f"{_SHORTEST} frames, got no such frames"
        )
    common = np.flatnonzero((which == sets[counts.argmax()]).all(axis=1))
    common = common[:: -(-len(common) // _ENOUGH)]
    places = [view[common] for view in views]
    orders = list(permutations(range(views[0].shape[1])))
    ways: list[tuple[tuple[int, ...], ...]] = [(orders[0],)]
    for count in range(2, len(views) + 1):  # of views, one after the other
        ways, tried = [(*way, order) for way, order in product(ways, orders)], []
        for way in ways:
            here = [place[:, list(order)] for place, order in zip(places, way, strict=False)]
            with suppress(ValueError):
                learned = learn_cameras(_rows(here), Rig(rig.cameras[:count])).cameras
                tried.append((_misfit(here, learned), way, learned))
        tried.sort(key=lambda one: one[0])
        # Where some views leave the cameras open more may not.
        ways = [way for size, way, _ in tried if size <= ALIKE * tried[0][0]] or ways
    if not tried or (len(tried) > 1 and not tried[0][0] * ALIKE < tried[1][0]):
        sizes = ", ".join(f"{size:.2g}" for size, *_ in tried[:2]) or "none"
        raise ValueError(
            "targets: one order of the targets in the views must fit the rig far better than all "
            f"others, got residuals of {sizes} px for the best"
        )
    return tried[0][2]


def _rows(views: Sequence[Floats]) -> list[Floats]:
    """All targets as one long track per view."""
    return [stacked(view.reshape(len(view), -1), 2) for view in views]


def _misfit(views: Sequence[Floats], cameras: Sequence[Camera]) -> float:
    """Pixels by which the views typically miss each other."""
    off = np.concatenate(missed(cameras, at_once(cameras, _rows(views))))
    return float(np.nanmedian(np.hypot(*off.T)))


def _joined(runs: Sequence[_Run], cameras: Sequence[Camera]) -> list[list[_Run]]:
    """Runs in one order of the targets, in groups that nothing joins, in the order of time.

    The surest pairs of runs are joined first.
    """
    links = [
        (*link, i, j)
        for i, j in combinations(range(len(runs)), 2)
        if (link := _link(runs[i], runs[j], cameras))
    ]
    # Of each run the group that it is joined to: runs, and the order of their targets in it.
    groups = [{i: list(range(run.places.shape[1]))} for i, run in enumerate(runs)]
    for _, order, i, j in sorted(links, key=lambda link: -link[0]):
        mine, theirs = groups[i], groups[j]
        if mine is not theirs:
            change = [theirs[j].index(order[target]) for target in mine[i]]
            for k, there in theirs.items():
                mine[k] = [there[target] for target in change]
                groups[k] = mine
    unique = {id(group): group for group in groups if len(group) > 1}
    found = [[runs[i].ordered(order) for i, order in each.items()] for each in unique.values()]
    return sorted(found, key=_first)


def _first(runs: Sequence[_Run]) -> int:
    return min(int(run.frames[0]) for run in runs)


def _link(one: _Run, other: _Run, cameras: Sequence[Camera]) -> tuple[float, list[int]] | None:
    """How sure it is which order of another view's targets is that of a view, and which one."""
    common = np.intersect1d(one.frames, other.frames, assume_unique=True)
    pair = cameras[one.view], cameras[other.view]
    if not independent(pair) or len(common) < _SHORTEST:
        return None
    here, there = one.at(common), other.at(common)
    sure, order = _surest(here.shape[1], lambda o: _misfit([here, there[:, o]], pair))
    return (sure, order) if sure > ALIKE else None


def _surest(count: int, misfit: Callable[[list[int]], float]) -> tuple[float, list[int]]:
    """How many times better the best order of targets fits than the next one, and which it is."""
    ranked = sorted((misfit(order), order) for order in map(list, permutations(range(count))))
    second = ranked[1][0] if len(ranked) > 1 else np.inf
    return second / max(ranked[0][0], 1e-9), ranked[0][1]


def _on_from(
    before: Sequence[_Run], after: Sequence[_Run], cameras: Sequence[Camera]
) -> tuple[list[int], bool]:
    """In which order the targets go on behind a gap in all views, and whether that is sure."""
    start = _first(after)
    there, x = _in_space(before, cameras)
    here, y = _in_space(after, cameras)
    x, there = x[there < start][-_AHEAD:], there[there < start][-_AHEAD:]
    y, here = y[:_AHEAD], here[:_AHEAD]
    count, frames = y.shape[1], np.concatenate((there, here))
    # One goes on wherever it is; of several, too long a gap tells nothing.
    if count == 1 or min(len(x), len(y)) < _DEGREE or here[0] - there[-1] > 4 * _AHEAD:
        return [*range(count)], count == 1
    sure, order = _surest(count, lambda o: _roughness(frames, np.concatenate((x, y[:, o]))))
    return order, sure > ALIKE


def _in_space(runs: Sequence[_Run], cameras: Sequence[Camera]) -> tuple[Ints, Floats]:
    """The frames in which two views or more have runs, and the targets' places, (m, k, 3)."""
    n, count = 1 + max(int(run.frames[-1]) for run in runs), runs[0].places.shape[1]
    views = np.full((len(cameras), n, count, 2), np.nan)
    for run in runs:
        views[run.view, run.frames] = run.places
    x = intersect(cameras, at_once(cameras, _rows([*views])))
    x = side_by_side(x, count).reshape(n, count, 3)
    frames = np.flatnonzero(np.isfinite(x).all(axis=(1, 2)))
    return frames, x[frames]


def _roughness(frames: Ints, x: Floats) -> float:
    """How far the targets (m, k, 3) are from smooth ways through these frames."""
    basis = np.vander((frames - frames.mean()) / np.ptp(frames), _DEGREE + 1)
    flat = x.reshape(len(frames), -1)
    return float(np.linalg.norm(flat - basis @ np.linalg.lstsq(basis, flat)[0]))
