"""Why the views of a rig do not agree: the one thing that, if it were otherwise, mends most.

**Causes** change a number: `explain` frees one thing at a time. Residuals of a right rig are the
errors of the tracks. A wrong normal, lens or clock leaves more, which follows the motion; how large
it may be without a word depends on these errors, and not on a fixed number of pixels. For each
cause, with slopes C of the residuals r in it (all that is free anyway projected out), the score g =
C'r is compared with its covariance, in which residuals that depend on their neighbours count for
what they are worth (`adjust`):

    T = g' Omega^-1 g,      Omega of the residuals that the cause leaves.

A cause that stands out is tried: cameras and path are adjusted with it free.

**Mistakes** are one of a few, and what is right is known at once: tracks in another order than the
cameras, a mirrored view, v counted upwards, a video of another frame rate than stated, dropped
frames. `find_mistake` tries all. Two views at a time, the epipolar equation tells by how much they
disagree at all whole lags; the mistake that mends that best is tried with all cameras. Frames were
dropped where the best lag of two views jumps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import permutations

import numpy as np
from scipy.special import fdtri

from ..arrays import Bools, Floats
from .adjust import (
    PARTS,
    SIZE,
    Adjustment,
    NearCamera,
    adjust,
    bandwidth,
    known_to,
    long_run_covariance,
)
from .calibrate import learn_cameras
from .clocks import Curve, Footage, Lags, align
from .models import Camera, OrthographicCamera
from .rig import DISAGREEMENT, FINE, GROSS, Rig, check_views, disagreement, residuals
from .synchronise import first_known, lag_misses, learn_lags, nearest
from .triangulate import TRIMMED, epipolar_lines, epipolar_rows, intersect, trimmed

RATES = ((25, 30), (30, 25), (24, 30), (30, 24), (24, 25), (25, 24), (30, 60), (60, 30))
"""Rates over those stated that are taken for each other."""
BETTER = 3.0
"""Times by which a mistake has to mend the disagreement of all views together."""
_INSTANTS = 60  # at which two views are compared
_MISTAKES = 16  # of a kind that mend most, tried with all cameras
_PART = 0.4  # of the videos, in which their cameras are learned if frames were dropped elsewhere
_FRAMES = 1500  # of the first video at which a jump of the lag is sought
_LONGEST = 60  # frames by which it may jump
_MOST, _PRICE = 8.0, 40.0  # typical misses: the most that one frame counts, and the price of a jump
_MANY = 6  # cameras, of which only two are taken for each other
_CHANCE = 1e-6  # of a T that large without a cause
_TRIED = 5  # of the causes that stand out most
_DEGENERATE = 1e-3  # share of a slope that nothing else explains; less tells nothing
_SMOOTH = 0.3  # correlation of a residual with the next; that of noise is zero
_ROUNDING = 1e-9  # pixels


@dataclass(frozen=True)
class Cause:
    """Something that may be wrong of some cameras: which components of their changes."""

    what: str
    cameras: tuple[int, ...]
    parts: tuple[int, ...]

    def mask(self, count: int) -> Bools:
        """The freed components, (m, SIZE)."""
        freed = np.zeros((count, SIZE), bool)
        freed[np.ix_(self.cameras, self.parts)] = True
        return freed


@dataclass(frozen=True)
class Explanation:
    """A cause, and the cameras that it leads to."""

    cause: Cause
    found: Adjustment

    @property
    def left(self) -> float:
        """`disagreement` of the worst camera of these, pixels."""
        return max(map(trimmed, np.split(self.found.misses, len(self.found.cameras), axis=1)))

    def text(self, names: Sequence[str]) -> str:
        """What would explain the residuals best, with its value."""
        i, what = self.cause.cameras[0], self.cause.what
        camera, change = self.found.cameras[i], self.found.change[i]
        one = f"cameras[{i}] ({names[i]})"
        whose = one if len(self.cause.cameras) == 1 else "all cameras"
        parts = {
            "normal": f"the normal ({_list(camera.normal)}) of {whose}",
            "position": f"the position ({_list(np.asarray(camera.position))}) of {whose}",
            "scale": f"a scale {100 * np.expm1(change[PARTS['scale']][0]):+.2g} % off of {whose}",
            "distortion": f"a distortion of the lens of {whose}, for {one} k1 off "
            f"by {change[PARTS['distortion']][0]:.2g},",
            "readout": f"a rolling shutter of {whose}, for {one} a readout of {camera.readout:.2g} "
            "frames,",
            "lag": f"a lag of {names[i]} that is off by {change[PARTS['lag']][0]:.2f} frames",
            "drift": f"another clock of {names[i]}, {abs(change[PARTS['drift']][0]):.2g} frames "
            f"{'slow' if change[PARTS['drift']][0] > 0 else 'fast'} over the whole video,",
            "nearness": "perspective, where the cameras are taken as orthographic, for "
            f"{one} a distance of {1 / max(abs(change[PARTS['nearness']][0]), 1e-12):.3g},",
        }
        return parts[what]


def explain(tracks: Sequence[Floats], given: Rig, learned: Rig) -> Explanation | None:
    """The one thing that explains best what the views leave; None if nothing stands out.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2)
        One per camera, at the same instants.
    given, learned : Rig
        Before and after `learn_cameras`.
    """
    views = check_views(tracks, learned)
    errors = np.array([known_to(camera) for camera in given.cameras])
    points, _ = intersect(learned.cameras, views)
    seen = np.isfinite(points).all(axis=1)
    if not seen.any():
        return None
    far = smooth(tracks, learned) and max(disagreement(tracks, learned)) > GROSS
    start = [_near(camera, points[seen].mean(axis=0)) for camera in learned.cameras]
    causes = [c for c in _causes(start) if (c.mask(len(start)) & (errors == 0)).any()]
    footage = Footage.of(tracks)
    near = adjust(footage, start, np.where(errors > 0, errors, np.inf), most=0)
    sizes = [_sizes(near, errors, cause) for cause in causes]
    # Where views are far apart, and no noise makes it, no test is needed.
    rank = [explained if far else evidence for evidence, explained in sizes]
    tried = [causes[k] for k in np.argsort(rank)[::-1][:_TRIED] if rank[k] > (0 if far else 1)]
    best: tuple[float, Explanation] | None = None
    for cause in tried:
        freed = cause.mask(len(start))
        found = adjust(footage, start, np.where(freed, np.inf, errors))
        used = np.isfinite(found.misses)
        left = float(np.sum((np.sqrt(found.weights)[:, None] * found.misses)[used] ** 2))
        count = used.sum()
        price = count * np.log(max(left, _ROUNDING)) + freed.sum() * np.log(count)
        if best is None or price < best[0]:
            best = price, Explanation(cause, found)
    return None if best is None else best[1]


def smooth(tracks: Sequence[Floats], learned: Rig) -> bool:
    """Whether residuals follow the motion, which noise of the tracks does not."""
    missed = np.hstack(residuals(tracks, learned))
    both = np.isfinite(missed[1:]) & np.isfinite(missed[:-1])
    limit = np.nanquantile(np.abs(missed), TRIMMED) if both.any() else 0.0
    before, after = (np.clip(part[both], -limit, limit) for part in (missed[:-1], missed[1:]))
    return bool(before @ after > _SMOOTH * np.sqrt((before @ before) * (after @ after)))


def _causes(cameras: Sequence[Camera]) -> list[Cause]:
    """All that is tried; a lens and a shutter of one camera, and of all as of one make."""
    every = tuple(range(len(cameras)))
    flat = tuple(i for i in every if isinstance(cameras[i], OrthographicCamera))
    pinholes = tuple(i for i in every if i not in flat)
    found = [
        Cause(what, (i,), _components(what)[: 2 if i in flat else None])
        for what in ("normal", "position", "scale", "readout", "lag", "drift")
        for i in every
    ]
    lens = _components("distortion")[:2]  # k1 and k2: few motions tell more
    found += [Cause("distortion", (i,), lens) for i in pinholes]
    found.append(Cause("readout", every, _components("readout")))
    if pinholes:
        found.append(Cause("distortion", pinholes, lens))
    if flat:  # the scale is then that of another distance
        found.append(Cause("nearness", flat, _components("nearness") + _components("scale")))
    return found


def _components(what: str) -> tuple[int, ...]:
    """Places in the vector of changes."""
    return tuple(range(SIZE)[PARTS[what]])


def _near(camera: Camera, about: Floats) -> Camera:
    """The same camera, ready to be not infinitely far if it is orthographic."""
    if not isinstance(camera, OrthographicCamera):
        return camera
    values = {part.name: getattr(camera, part.name) for part in fields(camera)}
    return NearCamera(about=about, **values)


def _sizes(near: Adjustment, errors: Floats, cause: Cause) -> tuple[float, float]:
    """T over what chance may make it, zero if it would not matter; pixels that it explains."""
    missed, slopes = near.weighed
    free, wanted = errors[near.errors > 0] > 0, cause.mask(len(errors))[near.errors > 0]
    own = slopes[..., wanted & ~free]
    flat, target = own.reshape(-1, own.shape[-1]), missed.ravel()
    size = np.sqrt(np.sum(flat**2, axis=0))
    flat, size = flat[:, size > 0], size[size > 0]
    if not size.size:
        return 0.0, 0.0
    prior = near.noise / errors[near.errors > 0][free]
    others = np.vstack((slopes[..., free].reshape(len(flat), -1), np.diag(prior)))
    padded = np.vstack((flat / size, np.zeros((len(prior), len(size)))))
    if free.any():
        solved = np.linalg.lstsq(others, padded, rcond=1e-10)[0]
        padded = padded - others @ solved
    left, singular, _ = np.linalg.svd(padded, full_matrices=False)
    left = left[: len(flat), singular > _DEGENERATE]
    if not left.shape[1]:
        return 0.0, 0.0
    score = left.T @ target
    rest = (target - left @ score).reshape(missed.shape)
    each = np.einsum("nmk,nm->nk", left.reshape(*missed.shape, -1), rest)
    covariance = long_run_covariance(each) * len(each)
    covariance += _ROUNDING**2 * np.eye(len(covariance))
    explained = float(np.linalg.norm(score) / np.sqrt(np.isfinite(near.misses).sum()))
    # Bartlett's weights of that width leave as many degrees of freedom (2/3 is their square's
    # integral) to estimate Omega with: Hotelling's T.
    degrees = 1.5 * len(each) / (bandwidth(each) + 1)
    rest_degrees = degrees - len(score) + 1
    if explained < FINE or rest_degrees <= 0:
        return 0.0, explained
    chance = float(fdtri(len(score), rest_degrees, 1 - _CHANCE))
    limit = chance * len(score) * degrees / rest_degrees
    return float(score @ np.linalg.solve(covariance, score)) / limit, explained


def _list(values: Floats) -> str:
    """Three decimals of each."""
    return ", ".join(f"{value:.3f}" for value in values)


@dataclass(frozen=True, eq=False)
class Mistake:
    """What may have been done to the tracks, and what they are without it."""

    what: str
    tracks: tuple[Floats, ...]
    rates: Floats
    clocks: tuple[Floats, ...]
    lags: Lags = Lags(np.zeros(0), np.zeros(0), np.zeros(0), np.inf)
    before: float = np.inf

    @property
    def text(self) -> str:
        """What explains that the views did not agree."""
        return (
            f"the rig does not agree with the tracks as they are given: {self.what} explains it "
            f"({self.lags.residual:.2g} pixels apart instead of {self.before:.3g}), and was put "
            "right here: do so in what is given"
        )

    def paired(self, cameras: Sequence[Camera]) -> tuple[float, Floats]:
        """By how much two views disagree at their best lags, all pairs; and these lags."""
        curves = tuple(map(Curve, self.tracks, self.clocks))
        least, lags = [], []
        for tried, missed in lag_misses(curves, self.rates, cameras, _INSTANTS):
            least.append(missed.min())
            lags.append(tried[missed.argmin()])
        behind = np.insert(lags, first_known(cameras), 0.0)
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
    _, lags = none.paired(rig.cameras)
    left = none.left(rig, lags)
    if left <= 2 * DISAGREEMENT:
        return None
    for kind in (_views, _rates, _dropped):
        # Two views of which a scale is unknown agree mirrored as well: they rank, and refuse none.
        ranked = [(*one.paired(rig.cameras), one) for one in kind(none, rig, names)]
        ranked = sorted(ranked, key=lambda one: one[0])[:_MISTAKES]
        tried = [(one.left(rig, best), best, one) for _, best, one in ranked]
        for now, best, one in sorted(tried, key=lambda one: one[0]):
            if BETTER * now < left:
                told = learn_lags(one.tracks, rig, one.rates, best, one.clocks)
                if told.residual <= DISAGREEMENT:
                    return replace(one, lags=told, before=left)
    return None


def _views(none: Mistake, rig: Rig, names: Sequence[str]) -> Iterator[Mistake]:
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


def _rates(none: Mistake, rig: Rig, names: Sequence[str]) -> Iterator[Mistake]:
    """Frame rates that are taken for each other."""
    count = len(names)
    for i in range(count):
        for real, stated in RATES:
            rates = np.where(np.arange(count) == i, real / stated, 1.0) * none.rates
            what = f"{names[i]} with {real} frames for {stated} that are supposed"
            yield replace(none, what=what, rates=rates / rates[0])


def _dropped(none: Mistake, rig: Rig, names: Sequence[str]) -> Iterator[Mistake]:
    """Videos of which frames were dropped, each with the clock by which it agrees all the time."""
    shares = ((0.0, _PART), (1 - _PART, 1.0))  # of a video, in one of which none is dropped, maybe
    for low, high in shares:
        rows = [slice(int(low * len(t)), int(high * len(t))) for t in none.tracks]
        tracks = tuple(t[part] for t, part in zip(none.tracks, rows, strict=True))
        clocks = tuple(c[part] for c, part in zip(none.clocks, rows, strict=True))
        part = replace(none, tracks=tracks, clocks=clocks)
        _, lags = part.paired(rig.cameras)
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
