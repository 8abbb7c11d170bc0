"""What moves before a background that is steadied: the tracker for films.

::

  camera        its motion is taken out, if it moves: tracks come in the first frame's pixels
  candidates    all that differs from the ground or from other frames
  association   the best path through them
  appearance    if it has gaps or rivals, what lies on it is learned and followed by its looks
  association   again, with both kinds of evidence
  refining      its places to a fraction of a pixel, in whole frames; doubts

Somebody who points at the target in one frame decides where its looks are learned.

Where two meet in an image, nobody can say which is which afterwards: who is who, across meetings
and views, is for the cameras to tell (`cameras.identify`). So a track is that of one target from
one meeting to the next.
"""

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, Self

import cv2
import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..arrays import Bools, Floats, Floats32, Image, Ints
from ..checks import check_integer
from .camera import LOOSE, CameraMotion, at_rest, camera_motion, rescaled, stands_still
from .candidates import (
    TOLD,
    Candidates,
    Hint,
    Looks,
    Motion,
    Spot,
    best_path,
    candidates,
    followed,
    plainest_paths,
)
from .plate import Plate, carry, lights_of, noise_of, sampled
from .refining import Lens, View, entire, fitting, roughness, swapped
from .video import Reel, frame_clock, reduce

_SHORTEST = 5  # frames of a path
_LOOKS_ALONE = "no view tells it from its ground: it is followed by its looks alone"


@dataclass(frozen=True, eq=False)
class Track:
    """The target in each frame of a video; `np.asarray` of it is its pixels.

    Parameters
    ----------
    pixels : ndarray, shape (n, 2)
        Centroid of the target, (u right, v down) in pixels of the first frame, pixel centres at
        integers; NaN in frames where it is not seen, or only a part of it, or not for sure.
    confidence : ndarray, shape (n,)
        From 0, nothing seen, to 1. A detector says how sure it is of each frame; else it is
        exp(-e / 3) in a place that is known to e pixels.
    detector : str
        What found it: "background", before a background at rest, "motion", where that of the camera
        was taken out, "learned" or the name of an .onnx file.
    warnings : tuple of str
        Reasons not to trust the track.
    maps : ndarray, shape (n, 3, 3), optional
        Where each frame lies in the first one, homogeneous, if the camera moved.
    """

    pixels: Floats
    confidence: Floats
    detector: str
    warnings: tuple[str, ...] = ()
    maps: Floats | None = None

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray:
        return np.array(self.pixels, dtype, copy=copy)

    @property
    def in_frames(self) -> Floats:
        """The target in the pixels of each frame itself, (n, 2): to be drawn there."""
        if self.maps is None:
            return self.pixels
        return carry(np.linalg.inv(self.maps), self.pixels)


class Film(NamedTuple):
    """What is known of a film before its target.

    `samples` and `motion` are of whole frames, `small` and `maps` the same of reduced ones;
    `sampled` are the numbers of the samples, and `lights` (m, 3) say how much brighter each is than
    most; `doubts`, why the camera may move other than `motion` says.
    """

    frames: Reel
    samples: Image
    motion: CameraMotion
    small: Image
    maps: Floats
    sampled: Ints
    lights: Floats32
    doubts: tuple[str, ...]

    @classmethod
    def of(cls, path: str | os.PathLike, *, rests: bool = False) -> Self:
        """From its sampled frames, and from all of them if its camera may move."""
        frames = Reel(path, 480)  # pixels of the longer side of a reduced frame
        numbers, samples = sampled(frames)
        small = np.array([reduce(sample, frames.factor) for sample in samples])
        doubts: tuple[str, ...] = ()
        motion = at_rest(frames.info.frames)
        if not rests:
            motion, doubts = camera_motion(frames, small, numbers)
        elif stands_still(small) is False:
            doubts = ("the camera moves, and its motion is part of the track",)
        numbers = np.minimum(numbers, len(motion.maps) - 1)
        maps, known = rescaled(motion.maps, frames.factor), np.isfinite(motion.errors)
        lights = lights_of(small, maps[numbers], known[numbers])
        return cls(frames, samples, motion, small, maps, numbers, lights, doubts)

    def ground(self, boxes: Floats | None = None, *, whole: bool = False) -> tuple[Plate, float]:
        """The ground, without what is in boxes (n, 4) of the frames, and the noise of a pixel."""
        samples, maps = (self.samples, self.motion.maps) if whole else (self.small, self.maps)
        here, known = maps[self.sampled], np.isfinite(self.motion.errors[self.sampled])
        if boxes is not None:  # in the others it may be anywhere
            known &= np.isfinite(boxes[self.sampled, 0])
        use = np.flatnonzero(known)
        hide = None if boxes is None else boxes[self.sampled[use]]
        # The samples are views: copies would fill the memory.
        plate = Plate([samples[i] for i in use], here[use], hide, self.lights[use])
        return plate, noise_of(samples, here, plate)


class Ways(NamedTuple):
    """Where to look in each frame, in its own pixels: centre (n, 2), box (n, 4), colour (n, 3)."""

    centre: Floats
    box: Floats
    colour: Floats


def follow(path: str | os.PathLike, hint: Hint | None = None, *, rests: bool = False) -> Track:
    """Track what moves in a film, the target if there is a hint which it is.

    Its camera `rests` if that is known.
    """
    film = Film.of(path, rests=rests)
    seen, lights = sighted(film)
    n = len(lights)
    boxed = None if hint is None else hint.boxed(film.frames.info.size, n, film.frames.factor)
    seed = boxed and _tightened(seen, boxed)
    paths, bare = _paths(seen, hint, seed), False
    if seed is None and not _plain(paths, n):  # it may hang on a string
        others = sighted(film, bare=True)
        plainer = _paths(others[0], hint, seed)
        if bare := _plain(plainer, n):
            (seen, lights), paths = others, plainer
    if not paths and seed is None:
        return nothing(film.motion, n, film.doubts)
    covered = _covering(film, seen, paths[0].rows, seed) if paths else None
    if covered is not None:  # it covers its own ground: before ground that is without it
        others = sighted(film, covered, bare=bare)
        plainer = _paths(others[0], hint, seed)
        # Unless these were two crescents, ground on which it is less plain is guessed, and wrong:
        # of .6 of the rating before or less, as a rule, and of .9 or more where it is right.
        least = 0.7 * paths[0].rating
        if plainer and any(path.rating > least for path in (plainer[0], *paths[1:])):
            (seen, lights), paths = others, plainer
    rows = paths[0].rows if paths else np.zeros(0, int)
    start = seed or _plainest(seen, rows)
    if seed is None and len(rows) == n and not _rivals(paths):  # nothing is left to be told
        looks = Looks(np.full((n, 4), np.nan), np.zeros(n), np.ones(len(seen.frame)))
    else:
        looks = followed(film.frames, film.maps[:n], seen, start)
    both = _together(seen, looks, film.maps, start.frame, told=seed is not None)
    rows, _ = best_path(both, away=True)
    if len(rows) < _SHORTEST:
        return nothing(film.motion, n, film.doubts)
    ways = expected(both, rows, film, n)
    doubts = _doubts(film, seen, paths, ways) if seed is None else film.doubts
    if _differing(seen, both.only(rows)) < 0.5:
        doubts += (_LOOKS_ALONE,)
    views = viewed(film, lens_of(film, ways), ways, lights)
    if hint is not None and hint.colour is not None and any(views):
        doubts += hint.unlike(np.median([view.colour for view in views if view], axis=0))
    found, bound = finished(views, film.motion, doubts, frame_clock(path))
    found = _filled(found, bound, film, ways, both.frame[rows], seed)
    found = replace(found, warnings=found.warnings + unsure(found))
    if seed is not None and found.warnings and not _shown(seen, seed).any():
        empty = f"in frame {seed.frame} nothing is seen to move in the box: is the target in it?"
        found = replace(found, warnings=(empty, *found.warnings))
    return found


def _shown(seen: Candidates, seed: Spot) -> Bools:
    """Which candidates have their centre in a box."""
    inside = (np.abs(seen.centre - seed.centre) < seed.size / 2).all(axis=1)
    return inside & (seen.frame == seed.frame)


def unsure(found: Track) -> tuple[str, ...]:
    """Is a place in many of the frames of a track known to a pixel or two only?"""
    seen = np.isfinite(found.pixels[:, 0])
    vague = np.flatnonzero(seen & (found.confidence < _confidence(1.5 * LOOSE)))
    if found.warnings or len(vague) < 0.2 * seen.sum():
        return ()
    middle = vague[len(vague) // 2]
    return (
        f"in {len(vague)} of {seen.sum()} frames, e.g. {middle}, only a part of the target is told "
        "from what is around it: it may be some pixels off there",
    )


def sighted(
    film: Film, boxes: Floats | None = None, targets: int = 1, *, bare: bool = False
) -> tuple[Candidates, list[Floats32]]:
    """What may be the target in each frame, and how bright the frame is; see `candidates`."""
    plate, noise = film.ground(boxes)
    frames: Iterable[Image] = film.frames
    if noise > 12:  # grey levels, in which no pixel is told alone
        frames = (np.asarray(cv2.GaussianBlur(frame, (0, 0), 1.0), np.uint8) for frame in frames)
        noise /= 2 * np.sqrt(np.pi)
    return candidates(frames, film.maps, plate, noise, targets, bare)


def _paths(seen: Candidates, hint: Hint | None, seed: Spot | None) -> list[Motion]:
    """The plainest paths, of what a hint allows."""
    if seed is not None:
        here = seen.frame == seed.frame
        alike = _shown(seen, seed) & (np.abs(np.log(seen.area / (0.7 * seed.size.prod()))) < 0.9)
        if not alike.any():
            return []
        quality = np.where(here, np.where(alike, seen.quality + TOLD, -TOLD), seen.quality)
        return [best_path(seen._replace(quality=quality))]
    liked = seen
    if hint is not None and hint.colour is not None:
        liked = seen._replace(quality=seen.quality * hint.likeness(seen.colour, seen.behind))
    # Of less, noise is made.
    return [path for path in plainest_paths(liked) if np.median(seen.quality[path.rows]) > 0.2]


def _plain(paths: Sequence[Motion], n: int) -> bool:
    """Is there a path worth much in n frames? What is plain in all of them is worth .4 to .7 each.

    Half of that: it may be away for a while.
    """
    return bool(paths) and paths[0].rating > 0.2 * n


def _tightened(seen: Candidates, seed: Spot) -> Spot:
    """A box that is drawn loosely around one plain thing, close around it."""
    size = seed.size
    here = _shown(seen, seed._replace(size=size / 2))
    inside = np.flatnonzero(here & (seen.box[:, 2:] < size).all(axis=1) & (seen.quality > 0.8))
    if not len(inside):
        return seed
    best = inside[seen.area[inside].argmax()]
    loose = seen.area[best] < 0.4 * 0.7 * size.prod()
    return _spot(seen, best) if loose else seed


def _plainest(seen: Candidates, rows: Ints) -> Spot:
    """The plainest view on a path, of about the usual size."""
    usual = np.median(seen.area[rows])
    worth = seen.quality[rows] - 0.5 * np.abs(np.log(seen.area[rows] / usual))
    return _spot(seen, rows[np.argmax(worth)])


def _spot(seen: Candidates, row: np.integer) -> Spot:
    """Where a candidate is, and how large, four pixels at least."""
    return Spot(int(seen.frame[row]), seen.centre[row], np.maximum(seen.box[row, 2:], 4))


def _rivals(paths: Sequence[Motion]) -> Sequence[Motion]:
    """Paths that are about as plain as the plainest."""
    return [path for path in paths[1:] if path.rating > 0.5 * paths[0].rating]


def _covering(film: Film, seen: Candidates, rows: Ints, seed: Spot | None) -> Floats | None:
    """Boxes (n, 4) of a target that covers its own ground in many frames, None if it does not."""
    at, low, high = seen.frame[rows], seen.box[:, :2], seen.box[:, :2] + seen.box[:, 2:]
    own = np.full(len(film.maps), -1)
    own[at] = rows
    k, (first, last) = own[seen.frame], np.full((2, len(film.maps), 2), np.nan)
    first[at], last[at] = low[rows], high[rows]
    # Before ground that shows it, it is two crescents, where it is and where it was: of both. Their
    # colours, and those behind, are the target's and the ground's, or mixed of these.
    ends = seen.colour[k], seen.behind[k]
    mixed = [
        sum(np.linalg.norm(x - end, axis=1) for end in ends) for x in (seen.colour, seen.behind)
    ]
    beside = np.max(mixed, axis=0) < 1.2 * np.linalg.norm(ends[0] - ends[1], axis=1)
    beside &= (k >= 0) & ((low <= high[k]) & (low[k] <= high)).all(axis=1)
    np.minimum.at(first, seen.frame[beside], low[beside])
    np.maximum.at(last, seen.frame[beside], high[beside])
    centre, size = (first + last)[at] / 2, (last - first)[at]
    size = np.maximum(size, np.median(size, axis=0))  # it may be seen in part
    # The median of the samples does not show what is in one or two of them.
    if np.isin(film.sampled, at).sum() < 3 or _staying(centre, size) < 0.35:
        return None
    if seed is not None:  # its size is told
        size = 0 * size + seed.size
    boxes = np.full((len(film.maps), 4), np.nan)
    boxes[at] = np.hstack([centre - size / 2, size])
    return boxes


def _staying(centre: Floats, size: Floats) -> float:
    """In what share of its frames a target of these centres and sizes (k, 2) covers one place."""
    some = centre[:: 1 + len(centre) // 2000]  # all pairs of a long film would fill the memory
    with np.errstate(invalid="ignore"):
        inside = (np.abs(some[:, None] - centre) < size / 2).all(axis=2)
    return float(inside.mean(axis=1).max())


def _together(
    seen: Candidates, looks: Looks, maps: Floats, first: int, *, told: bool
) -> Candidates:
    """Candidates of both kinds: what differs, worth what its colours say, and what looks alike.

    `told` is whether somebody says where it is, in the frame `first`.
    """
    quality = seen.quality * (0.25 + 0.75 * looks.like)
    at = np.flatnonzero(np.isfinite(looks.box[:, 0]))
    box, area = looks.box[at], 0.7 * looks.box[at, 2:].prod(axis=1)
    centre, worth = box[:, :2], np.clip(1.2 * looks.fit[at], 0.25, 0.8)
    colour = np.zeros((len(at), 3))
    colour[:] = np.median(seen.colour, axis=0) if len(seen.colour) else 0
    for k, i in enumerate(at.tolist()):
        there = _there(seen, i, centre[k], area[k])
        if not len(there):  # what does not differ from the ground is hardly the target
            worth[k] *= 0.5
        near = there[np.abs(np.log(seen.area[there] / area[k])) < 0.8]
        if len(near):
            best = near[quality[near].argmax()]
            colour[k] = seen.colour[best]
            worth[k] += 0.5 * quality[best]
            quality[near] += 0.5 * looks.fit[i]
    place = carry(maps[at], centre)
    alike = Candidates(at, place, centre, np.column_stack([centre - box[:, 2:] / 2, box[:, 2:]]),
                       area, colour, colour, worth, at >= 0)  # fmt: skip
    alike.quality[at == first] += TOLD
    kept = (seen.frame != first) | (not told)
    return Candidates.joined([seen._replace(quality=quality).only(kept), alike])


def _there(seen: Candidates, frame: int, centre: Floats, area: float) -> Ints:
    """The candidates of a frame in the inner part of a thing of such an area."""
    here = np.flatnonzero(seen.frame == frame)
    apart = np.linalg.norm(seen.centre[here] - centre, axis=1)
    return here[apart < 0.35 * np.sqrt(area) + 1]


def _differing(seen: Candidates, path: Candidates) -> float:
    """In what share of its frames something is seen to differ where a path leads."""
    places = zip(path.frame, path.centre, path.area, strict=True)
    return float(np.mean([len(_there(seen, *place)) > 0 for place in places]))


def lens_of(film: Film, *ways: Ways) -> Lens:
    """What looks at targets in whole frames."""
    at = film.sampled
    staying = [way.box for way in ways if _staying(way.centre[at], way.box[at, 2:]) > 0.25]
    return Lens(*film.ground(staying[-1] if staying else None, whole=True))


def viewed(film: Film, lens: Lens, ways: Ways, lights: list[Floats32]) -> list[View | None]:
    """The target in whole frames, near where it is expected."""
    shown = zip(film.frames.whole, film.motion.maps, *ways, lights, strict=False)
    return [
        lens.look(frame, here, box, centre, colour, light) if np.isfinite(centre[0]) else None
        for frame, here, centre, box, colour, light in shown
    ]


def nothing(motion: CameraMotion, n: int, doubts: tuple[str, ...]) -> Track:
    """Of a film of n frames in which no target was found."""
    said = ("nothing was found that moves like one target", *doubts)
    return _as_track(np.full((n, 2), np.nan), np.full(n, np.inf), motion, said)


def _as_track(
    pixels: Floats, errors: Floats, motion: CameraMotion, doubts: tuple[str, ...]
) -> Track:
    """Of pixels (n, 2) of the first frame and their errors (n,), infinite where it is not seen."""
    moves = bool((motion.maps != np.eye(3)).any())
    maps = motion.maps[: len(pixels)] if moves else None
    return Track(pixels, _confidence(errors), "motion" if moves else "background", doubts, maps)


def _confidence(errors: Floats | float) -> Floats:
    """In places that are known to so many pixels: 1 if exactly, 0 if not at all."""
    return np.asarray(np.exp(-np.asarray(errors) / 3))


def _example(film: Film, seen: Candidates, path: Motion) -> str:
    """Where somebody may look at what moves along a path."""
    row = path.rows[len(path.rows) // 2]
    u, v = film.frames.factor * seen.centre[row]
    return f"e.g. in frame {seen.frame[row]} at ({u:.0f}, {v:.0f})"


def _doubts(film: Film, seen: Candidates, paths: list[Motion], ways: Ways) -> tuple[str, ...]:
    """Whether the camera is known, and what else moves about as plainly, elsewhere."""
    k = film.frames.factor
    for path in _rivals(paths):
        at = seen.frame[path.rows]
        off = np.linalg.norm(k * seen.centre[path.rows] + (k - 1) / 2 - ways.centre[at], axis=1)
        # It may be the target itself, after a gap.
        if not np.median(off / ways.box[at, 2:].max(axis=1)) < 1:
            told = ("something else moves about as plainly, "
                    f"{_example(film, seen, path)}: if that is the target, say so by a hint with "
                    "a frame and a box")  # fmt: skip
            return (*film.doubts, told)
    return film.doubts


def expected(seen: Candidates, rows: Ints, film: Film, n: int) -> Ways:
    """Where a path leads in all frames from its first to its last, and a little beyond."""
    at, place, usual = seen.frame[rows], seen.place[rows], np.median(seen.colour[rows], axis=0)
    frames = np.arange(max(at[0] - 3, 0), min(at[-1] + 3, n - 1) + 1)
    known = np.hstack([place, seen.box[rows, 2:], seen.colour[rows]])
    between = np.column_stack([np.interp(frames, at, x) for x in known.T])
    along, extent, near = np.split(between, [2, 4], axis=1)
    for outside, end in ((frames < at[0], slice(0, 4)), (frames > at[-1], slice(-4, None))):
        fit = np.polyfit(at[end] - at[end][0], place[end], 2)
        along[outside] = np.vander(frames[outside] - at[end][0], 3) @ fit
    centre, box, colour = (np.full((n, width), np.nan) for width in (2, 4, 3))
    centre[frames] = carry(np.linalg.inv(film.maps[frames]), along)
    box[frames] = np.hstack([centre[frames] - extent / 2, extent])
    colour[frames] = 0.5 * usual + 0.5 * near
    k = film.frames.factor
    return Ways(k * centre + (k - 1) / 2, k * box, colour)


def finished(
    views: list[View | None], motion: CameraMotion, doubts: tuple[str, ...], clock: Floats
) -> tuple[Track, float]:
    """The views of the whole target as a track, and by how many pixels they may be off at most.

    Frames of which the clock says nothing are evenly spaced; see `frame_clock`.
    """
    n = len(views)
    clock = np.arange(n, dtype=float) if len(clock) < n else clock
    pixels, errors = np.full((n, 2), np.nan), np.full(n, np.inf)
    whole, of_parts = entire(views)
    at = np.array([i for i, view in enumerate(whole) if view], int)
    if len(at) < _SHORTEST:
        return nothing(motion, n, doubts), 0.0
    doubts += of_parts
    shown = [view for view in whole if view]
    steady = carry(motion.maps[at], np.array([view.centroid for view in shown]))
    areas = np.array([view.area for view in shown])
    inside = np.array([view.inside for view in shown]) & np.isfinite(motion.errors[at])
    skewness = np.array([view.skewness for view in shown])
    good, bound = fitting(clock[at], steady, areas, skewness, inside)
    untold = at[~np.isfinite(motion.errors[at])]
    if len(untold):
        doubts += (f"in {len(untold)} frames of {n} the target is seen, but not how the camera "
                   f"moved, from {untold[0]} to {untold[-1]}: they are left out",)  # fmt: skip
    if good.sum() < max(_SHORTEST, 0.05 * n):
        return nothing(motion, n, doubts), 0.0
    if (first := swapped(at[good], areas[good])) is not None:
        doubts += (f"from frame {at[good][first]} on, what is followed has another size at once: "
                   "perhaps it is something else",)  # fmt: skip
    pixels[at[good]] = steady[good]
    rough, torn = roughness(clock[at][good], steady[good], areas[good])
    errors[at[good]] = np.hypot(rough, motion.errors[at[good]])
    side = np.sqrt(np.median(areas[good]))
    if bound > side / 3:  # of half of it the outline is off by that
        doubts += ("the target's outline differs so much that a part of it cannot be told from the "
                   "whole",)  # fmt: skip
    elif np.isfinite(torn) and torn > max(LOOSE, 0.02 * side):
        doubts += (f"the outline of the target changes from frame to frame: its place is known to "
                   f"{torn:.1f} px only",)  # fmt: skip
    if (error := np.median(motion.errors[at[good]])) > LOOSE:
        doubts += (f"the camera moves, and its motion is known to {error:.1f} px only",)
    return _as_track(pixels, errors, motion, doubts), bound


def _filled(
    found: Track, bound: float, film: Film, ways: Ways, frames: Ints, seed: Spot | None
) -> Track:
    """A track with its gaps filled: where its motion leads, or where both evidences do.

    These have a place in the `frames` of their path. Its motion is surer, if that is known; else
    they are off by the same as in the frames around. What somebody points at is wanted in any case;
    else gaps are better, but where whole views are known no better than that, to a `bound`.
    """
    vague = 2.0  # pixels to which they tell a place
    if seed is None and bound < vague:
        return found
    pixels, confidence = found.pixels.copy(), found.confidence.copy()
    there = carry(film.motion.maps[: len(pixels)], ways.centre)
    size = ways.box[:, 2:].mean(axis=1)
    if seed is not None:  # of what somebody points at, no view is of something else
        stray = np.linalg.norm(pixels - there, axis=1) > 0.5 * size + 2
        pixels[stray], confidence[stray] = np.nan, 0
    at = np.flatnonzero(np.isfinite(pixels[:, 0]))
    edge = ways.box[frames, :2] + ways.box[frames, 2:]
    whole = (ways.box[frames, :2] > -0.5).all(axis=1) & (edge < film.frames.info.size).all(axis=1)
    known = frames[whole & np.isfinite(film.motion.errors[frames])]
    for i in np.setdiff1d(known, at).tolist():
        confidence[i] = _confidence(vague)
        beside = np.concatenate([at[at < i][-4:], at[at > i][:4]])
        if len(beside) == 8 and np.ptp(beside) < 40:
            # What a cubic misses where the motion turns a quartic shows.
            other, way, finer = (
                np.polyfit(beside - i, pixels[beside], degree)[-1] for degree in (2, 3, 4)
            )
            if max(np.linalg.norm(way - other), np.linalg.norm(way - finer)) < 0.25 * size[i]:
                pixels[i] = way
                continue
        near = at[np.argsort(np.abs(at - i), kind="stable")[:15]]
        pixels[i] = there[i] + (np.median((pixels - there)[near], axis=0) if len(near) > 2 else 0)
    if not len(at) and np.isfinite(pixels[:, 0]).any():
        return replace(found, pixels=pixels, confidence=confidence, warnings=(_LOOKS_ALONE,))
    return replace(found, pixels=pixels, confidence=confidence)


def track_targets(path: str | os.PathLike, count: int) -> tuple[Track, ...]:
    """Track so many moving targets of a video, each where it is apart from the others.

    Parameters
    ----------
    path : path
        A video in which nothing else moves as plainly.
    count : int
        How many targets there are.

    Returns
    -------
    tuple of Track
        NaN wherever two targets meet. Behind a meeting a track may be that of another target. If
        fewer things move, the last tracks are NaN throughout.

    Raises
    ------
    FileNotFoundError, ValueError
        If the file is missing or no video.
    """
    check_integer("count", count, least=1)
    film = Film.of(path)
    seen, lights = sighted(film, targets=count)
    n = len(lights)
    paths = plainest_paths(seen, most=count + 1, away=True)
    # Worth of a candidate of a path, relative to those of the plainest.
    worth = [path.rating / len(path.rows) for path in paths]
    plain = [path for path, own in zip(paths, worth, strict=True) if own >= 0.4 * worth[0]]
    ways = [expected(seen, path.rows, film, n) for path in plain[:count]]
    doubts: tuple[str, ...] = ()
    # Share of the frames in which one more thing moves, above which there is doubt.
    if len(plain) > count and len(plain[count].rows) >= 0.2 * n:
        doubts = (f"{Path(path).name}: one thing more moves than there are targets, "
                  f"{_example(film, seen, plain[count])}",)  # fmt: skip
    lens = lens_of(film, *ways)
    tracks, clock = [], frame_clock(path)
    for way, met in zip(ways, _touching(ways), strict=True):
        way.centre[met] = np.nan
        views = viewed(film, lens, way, lights)
        tracks.append(finished(views, film.motion, doubts, clock)[0])
        doubts = ()
    return (*tracks, *[nothing(film.motion, n, film.doubts)] * (count - len(tracks)))


def _touching(ways: list[Ways]) -> list[Bools]:
    """In which frames each target touches another one, or hides it."""

    def met(one: Ways, other: Ways) -> Bools:
        apart = np.linalg.norm(one.centre - other.centre, axis=1)
        sizes = (one.box[:, 2:].max(axis=1) + other.box[:, 2:].max(axis=1)) / 2
        # Sizes, and pixels more, between two targets that do not touch.
        return np.asarray(apart < 1.3 * sizes + 2.0)

    return [np.any([met(one, other) for other in ways if other is not one], axis=0) for one in ways]
