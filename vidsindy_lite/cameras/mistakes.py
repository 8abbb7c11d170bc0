"""Mistakes that make views disagree grossly, and that can be tried: one after the other, all.

Tracks in another order than the cameras, a mirrored view, v counted upwards, a video of another
frame rate than stated, dropped frames: each is one of a few, and what is right is known at once.
Two views at a time, the epipolar equation tells by how much they disagree at all whole lags; the
mistake that mends that best is tried with all cameras. Frames were dropped where the best lag of
two views jumps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from ..arrays import Floats
from .alignment import Curve, Lags, align
from .calibrate import learn_cameras
from .camera import Camera
from .pairs import lag_misses
from .rig import Rig
from .synchronise import learn_lags, nearest
from .timing import DISAGREEMENT
from .triangulate import epipolar_lines, epipolar_rows
from .unknowns import Unknowns

RATES = ((25, 30), (30, 25), (24, 30), (30, 24), (24, 25), (25, 24), (30, 60), (60, 30))
"""Rates over those stated that are taken for each other."""
BETTER = 3.0
"""Times by which a mistake has to mend the disagreement of all views together."""
_INSTANTS = 60  # at which two views are compared
_TRIED = 16  # mistakes of a kind that mend most, tried with all cameras
_PART = 0.4  # of the videos, in which their cameras are learned if frames were dropped elsewhere
_FRAMES = 1500  # of the first video at which a jump of the lag is sought
_LONGEST = 60  # frames by which it may jump
_MOST, _PRICE = 8.0, 40.0  # typical misses: the most that one frame counts, and the price of a jump
_ROUNDING = 1e-9  # scene units
_MANY = 6  # cameras, of which only two are taken for each other
_UNTOLD = Lags(np.zeros(0), np.zeros(0), np.zeros(0), np.inf)


@dataclass(frozen=True, eq=False)
class Mistake:
    """What may have been done to the tracks, and what they are without it."""

    what: str
    tracks: tuple[Floats, ...]
    rates: Floats
    clocks: tuple[Floats, ...]
    lags: Lags = _UNTOLD
    before: float = np.inf

    @property
    def text(self) -> str:
        """What explains that the views did not agree."""
        return (
            f"the rig does not agree with the tracks as they are given: {self.what} explains it "
            f"({self.lags.residual:.2g} pixels apart instead of {self.before:.3g}), and was put "
            "right here: do so in what is given"
        )

    def paired(self, unknowns: Unknowns) -> tuple[float, Floats]:
        """By how much two views disagree at their best lags, all pairs; and these lags."""
        curves = tuple(map(Curve, self.tracks, self.clocks))
        least, lags = [], []
        for tried, misses in lag_misses(curves, self.rates, unknowns, _INSTANTS, (False,)):
            least.append(misses[0].min())
            lags.append(tried[misses[0].argmin()])
        behind = np.insert(lags, unknowns.known, 0.0)
        return float(np.linalg.norm(least)), behind - behind[0]

    def left(self, rig: Rig, lags: Floats) -> float:
        """Pixels by which the worst view disagrees near these lags."""
        return nearest(self.tracks, rig, self.rates, lags, self.clocks)


def find_mistake(
    tracks: Sequence[Floats],
    rig: Rig,
    rates: Floats,
    clocks: Sequence[Floats] | None,
    start: Floats,
    names: Sequence[str],
) -> Mistake | None:
    """The one mistake without which the views agree; None if they do anyway, or with none.

    Parameters
    ----------
    tracks, rig, rates, clocks, start
        See `learn_lags`.
    names : sequence of str
        What the videos are called.
    """
    even = [np.arange(len(track), dtype=float) for track in tracks]
    none = Mistake("", tuple(tracks), rates, tuple(even if clocks is None else clocks))
    try:
        return _found(none, rig, start, names)
    except ValueError:  # what cannot be compared at all is told where cameras and lags are learned
        return None


def _found(none: Mistake, rig: Rig, start: Floats, names: Sequence[str]) -> Mistake | None:
    """The same, where the tracks can be compared."""
    if none.left(rig, start) <= 2 * DISAGREEMENT:
        return None
    unknowns = Unknowns.of(rig)
    _, lags = none.paired(unknowns)
    left = none.left(rig, lags)
    if left <= 2 * DISAGREEMENT:
        return None
    for kind in (_views, _rates, _dropped):
        # Two views of which a scale is unknown agree mirrored as well: they rank, and refuse none.
        ranked = [(*one.paired(unknowns), one) for one in kind(none, rig, unknowns, names)]
        ranked = sorted(ranked, key=lambda one: one[0])[:_TRIED]
        tried = [(one.left(rig, best), best, one) for _, best, one in ranked]
        for now, best, one in sorted(tried, key=lambda one: one[0]):
            if BETTER * now < left:
                told = learn_lags(one.tracks, rig, one.rates, best, one.clocks)
                if told.residual <= DISAGREEMENT:
                    return replace(one, lags=told, before=left)
    return None


def _views(none: Mistake, rig: Rig, _: Unknowns, names: Sequence[str]) -> Iterator[Mistake]:
    """All that change whole views: their order, and their axes."""
    count, sizes = len(names), [camera.image_size for camera in rig.cameras]
    for moved, order in _orders(count):
        if len({sizes[i] for i in moved}) == 1:
            tracks, clocks = (tuple(one[i] for i in order) for one in (none.tracks, none.clocks))
            rates = none.rates[order] / none.rates[order[0]]
            how = "swapped" if len(moved) == 2 else "in another order than their cameras"
            what = f"{' and '.join(names[i] for i in moved)} {how}"
            yield Mistake(what, tracks, rates, clocks)
    known = {i for i, camera in enumerate(rig.cameras) if camera.is_calibrated}
    for axis, what in ((0, "mirrored"), (1, "with v counted upwards")):
        for views in [*([i] for i in range(count)), [*range(count)]]:
            told, how = names[views[0]] if len(views) == 1 else "all views", what
            if len(views) == 1 and not known & {*views}:
                # Half a turn from a mirrored view is one with v counted upwards.
                how = "mirrored, or with v counted upwards"
            elif len(views) == 1 and known <= {*views}:
                how = "mirrored, or with v counted upwards: then the path has the other sign"
            if axis == 1 and how != what:
                continue
            given = list(none.tracks)
            for i in views:
                turned = [given[i][:, 0], given[i][:, 1]]
                turned[axis] = sizes[i][axis] - 1 - turned[axis]
                given[i] = np.column_stack(turned)
            yield replace(none, what=f"{told} {how}", tracks=tuple(given))


def _orders(count: int) -> Iterator[tuple[tuple[int, ...], list[int]]]:
    """Orders in which two views change places, or three in a ring; and which these are."""
    for size in (2, 3) if count < _MANY else (2,):
        for ring in permutations(range(count), size):
            if ring[0] == min(ring):  # the others are the same ones
                order = [*range(count)]
                for i, j in zip(ring, (*ring[1:], ring[0]), strict=True):
                    order[i] = j
                yield tuple(sorted(ring)), order


def _rates(none: Mistake, rig: Rig, _: Unknowns, names: Sequence[str]) -> Iterator[Mistake]:
    """Frame rates that are taken for each other."""
    count = len(names)
    for i in range(count):
        for real, stated in RATES:
            rates = np.where(np.arange(count) == i, real / stated, 1.0) * none.rates
            what = f"{names[i]} with {real} frames for {stated} that are supposed"
            yield replace(none, what=what, rates=rates / rates[0])


def _dropped(
    none: Mistake, rig: Rig, unknowns: Unknowns, names: Sequence[str]
) -> Iterator[Mistake]:
    """Videos of which frames were dropped, each with the clock by which it agrees all the time."""
    shares = ((0.0, _PART), (1 - _PART, 1.0))  # of a video, in one of which none is dropped, maybe
    for low, high in shares:
        rows = [slice(int(low * len(t)), int(high * len(t))) for t in none.tracks]
        tracks = tuple(t[part] for t, part in zip(none.tracks, rows, strict=True))
        clocks = tuple(c[part] for c, part in zip(none.clocks, rows, strict=True))
        part = replace(none, tracks=tracks, clocks=clocks)
        _, lags = part.paired(unknowns)
        try:
            learned = learn_cameras(align(tracks, lags, none.rates, clocks), rig)
        except ValueError:
            continue
        curves = tuple(map(Curve, none.tracks, none.clocks))
        jumps = [_jumps(curves, none.rates, learned.cameras, lags, j) for j in range(1, len(names))]
        if all(found and found[0][1] < 0 for found in jumps):  # it is the first that lacks some
            each = {0: [(frame, -lag) for frame, lag in jumps[0]]}
        else:
            each = {j: found for j, found in enumerate(jumps, start=1) if found}
        mended, told = list(none.clocks), []
        for j, found in each.items():
            clock = mended[j].copy()
            lag = 0.0 if j == 0 else lags[j] - (low > 0) * sum(jump for _, jump in found)
            for frame, jump in found:
                row = int(np.clip(np.rint((frame - lag) * none.rates[j]), 0, len(clock) - 1))
                count, lag = round(jump * none.rates[j]), lag + jump
                clock[row:] += count
                told.append(f"{count} frames dropped of {names[j]} before its frame {row}")
            mended[j] = clock
        if told and all((np.diff(clock) > 0).all() for clock in mended):
            yield replace(none, what=", ".join(told), clocks=tuple(mended))


def _jumps(
    curves: Sequence[Curve], rates: Floats, cameras: Sequence[Camera], lags: Floats, j: int
) -> list[tuple[float, float]]:
    """Where the lag of a video behind the first jumps for good, and by how much.

    The lags that leave the least, each jump at a price, by dynamic programming.
    """
    frames = curves[0].clock[:: -(-len(curves[0].clock) // _FRAMES)]
    tried = lags[j] - lags[0] + np.arange(-_LONGEST, _LONGEST + 1)
    lines = epipolar_lines(cameras[0], curves[0].at(frames), cameras[j])
    theirs = curves[j].at((frames - tried[:, None]) * rates[j])
    design, target = epipolar_rows(lines, cameras[j], theirs)
    scale, angle = cameras[j].calibration
    missed = np.abs(target - design @ [scale * np.cos(angle), scale * np.sin(angle)])
    usual = missed[_LONGEST][np.isfinite(missed[_LONGEST])]
    if not usual.size:
        return []
    typical = max(float(np.quantile(usual, _PART / 2)), _ROUNDING)
    # What nobody saw costs as much as what was seen: no lag is better for leaving frames out.
    cost = np.minimum(missed / typical, _MOST)
    cost = np.nan_to_num(cost, nan=float(np.minimum(usual / typical, _MOST).mean()))
    total, before = cost[:, 0], []
    for now in cost[:, 1:].T:
        best = int(total.argmin())
        jumped = total > total[best] + _PRICE
        before.append(np.where(jumped, best, np.arange(len(total))))
        total = np.where(jumped, total[best] + _PRICE, total) + now
    path = [int(total.argmin())]
    for step in before[::-1]:
        path.append(int(step[path[-1]]))
    path = path[::-1]
    return [
        (float(frames[k]), float(path[k] - path[k - 1]))
        for k in range(1, len(path))
        if path[k] != path[k - 1]
    ]
