"""What moves before a background that is steadied: the tracker for films that people make.

Candidates of all frames (`candidates`) are linked to paths (`linking`); the plainest path is the
target's, and its places are refined in whole frames (`refining`). The camera's motion (`steadying`)
is taken out, so that tracks come in the first frame's pixels.
"""

import os
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..arrays import Bools, Floats, Floats32, Image, Ints
from .background import sample_frames
from .candidates import Candidate, Difference, Plate, enlarged, light, reduce, reduction
from .linking import Sightings, best_path
from .refining import Lens, View, fitting
from .steadying import CameraMotion, Steadying, at_rest, carry, stands_still
from .video import read_video, video_info

_PATHS = 5  # paths among which the target's is chosen
_SHORTEST = 5  # frames of a path
_AS_PLAIN = 0.5  # rating of another path, relative to the best, above which there is doubt
_BEYOND = 3  # frames by which a path is carried on at its ends
_LARGE = 0.03  # share of the image that a target hardly fills


class Rated(NamedTuple):
    """A path: rows of the sightings, how plainly it is a target's."""

    rows: Ints
    rating: float


def rate(seen: Sightings, rows: Ints, value: float) -> float:
    """How plainly a path is that of a target: something that travels and stays what it is.

    What stands still, flickers or is a part of something larger that changes is worth little.
    """
    centre, size = seen.centre[rows], np.median(seen.size[rows])
    extent = np.linalg.norm(np.ptp(np.percentile(centre, [5, 95], axis=0), axis=0)) / size
    colour = seen.colour[rows]
    recolour = np.median(np.linalg.norm(colour - np.median(colour, axis=0), axis=1))
    speed = np.diff(centre, axis=0) / np.diff(seen.frame[rows])[:, None]
    turn = np.median(np.linalg.norm(np.diff(speed, axis=0), axis=1))
    jitter = turn / (np.median(np.linalg.norm(speed, axis=1)) + 0.5)
    large = size**2 / seen.diagonal**2
    doubts = (1 + recolour / 30) * (1 + jitter) * (1 + large / _LARGE)
    return float(value * extent / (extent + 2) / doubts)


def plainest_paths(seen: Sightings, boxes: Floats) -> list[Rated]:
    """Several paths that have nothing in common, the plainest first."""
    left, found = np.arange(len(seen.frame)), []
    for _ in range(_PATHS):
        rows, value = best_path(seen.only(left))
        rows = left[rows]
        if len(rows) < _SHORTEST:
            break
        found.append(Rated(rows, rate(seen, rows, value)))
        around = np.full((seen.frame[-1] + 1, 4), np.nan)
        around[seen.frame[rows]] = boxes[rows]
        low = around[seen.frame[left], :2]
        middle = boxes[left, :2] + boxes[left, 2:] / 2
        with np.errstate(invalid="ignore"):
            part = ((middle >= low) & (middle <= low + around[seen.frame[left], 2:])).all(axis=1)
        left = left[~part & ~np.isin(left, rows)]
    return sorted(found, key=lambda path: -path.rating)


@dataclass
class Followed:
    """What was found: (n, 2) pixels of the first frame, their errors (n,), doubts."""

    pixels: Floats
    raw: Floats
    errors: Floats
    motion: CameraMotion
    doubts: list[str]


def _noise(samples: Image, maps: Floats, plate: Plate) -> float:
    """Of a pixel, in grey levels: the median over the samples of what differs from the plate."""
    found = []
    for sample, here in zip(samples, maps, strict=True):
        then, known = plate.seen_from(here, np.zeros(2), sample.shape[1::-1])
        a, b = sample.astype(np.float32)[::3, ::3], then.astype(np.float32)[::3, ::3]
        known = known[::3, ::3]
        if known.any():
            found.append(1.4826 * np.median(np.abs(a - b * light(a, b, known))[known]))
    return float(np.median(found)) if found else 0.0


def _camera(path: str | os.PathLike, small: Image, frames: int, factor: int) -> CameraMotion:
    """The camera's motion, read from all frames unless some of them show it at rest."""
    if stands_still(small):
        return at_rest(frames)
    steadying = Steadying(factor)
    for frame in read_video(path):
        steadying.add(reduce(frame, factor))
    return steadying.motion()


def follow(path: str | os.PathLike) -> Followed:
    """Track what moves in a film."""
    info = video_info(path)
    factor = reduction(info.size)
    samples = sample_frames(path)
    small = np.array([reduce(sample, factor) for sample in samples])
    motion = _camera(path, small, info.frames, factor)
    n = len(motion.maps)
    which = np.unique(np.linspace(0, info.frames - 1, 21).round().astype(int))[: len(samples)]
    which = np.minimum(which, n - 1)
    larger = enlarged(factor)
    maps = np.linalg.inv(larger) @ motion.maps @ larger
    known = np.isfinite(motion.errors[which])
    plate = Plate(small, maps[which], known)
    difference = Difference(plate, _noise(small, maps[which], plate))
    found = [
        difference.candidates(reduce(frame, factor), here)
        for frame, here in zip(read_video(path), maps, strict=False)
    ]
    n = len(found)
    found = [difference.travelling(f, here) for f, here in zip(found, maps, strict=False)]
    places = [carry(maps[i], np.array([c.centre for c in f])) for i, f in enumerate(found) if f]
    seen = Sightings.of(found, places, float(np.hypot(*plate.size)))
    boxes = np.array([c.box for f in found for c in f]).reshape(-1, 4)
    paths = plainest_paths(seen, boxes)
    nothing = np.full((n, 2), np.nan)
    if not paths:
        return Followed(nothing, nothing, np.full(n, np.inf), motion, ["nothing moves"])
    doubts = []
    if len(paths) > 1 and paths[1].rating > _AS_PLAIN * paths[0].rating:
        doubts.append("other things move as plainly")
    large = Plate(samples, motion.maps[which], known)
    lens = Lens(large, _noise(samples, motion.maps[which], large))
    ways = expected(seen, boxes, paths[0].rows, maps, factor, n)
    views = []
    for i, (frame, here) in enumerate(zip(read_video(path), motion.maps, strict=False)):
        if not np.isfinite(ways.centre[i, 0]):
            views.append(None)
            continue
        gain = lens.gain(frame, here)
        views.append(lens.look(frame, here, ways.box[i], ways.centre[i], ways.colour[i], gain))
    return _finished(views, motion, doubts)


class Ways(NamedTuple):
    """Where to look in each frame, in its own pixels: centre (n, 2), box (n, 4), colour (n, 3)."""

    centre: Floats
    box: Floats
    colour: Floats


def expected(
    seen: Sightings, boxes: Floats, rows: Ints, maps: Floats, factor: int, n: int
) -> Ways:
    """Where a path leads in all frames from its first to its last, and a little beyond."""
    at, place = seen.frame[rows], seen.centre[rows]
    frames = np.arange(max(at[0] - _BEYOND, 0), min(at[-1] + _BEYOND, n - 1) + 1)
    along = np.column_stack([np.interp(frames, at, x) for x in place.T])
    for outside, end in ((frames < at[0], slice(0, 4)), (frames > at[-1], slice(-4, None))):
        if outside.any():
            fit = np.polyfit(at[end] - at[end][0], place[end], min(2, len(at[end]) - 1))
            t = frames[outside] - at[end][0]
            along[outside] = np.column_stack([np.polyval(fit[:, k], t) for k in (0, 1)])
    extent = np.column_stack([np.interp(frames, at, x) for x in boxes[rows, 2:].T])
    centre, box, colour = np.full((n, 2), np.nan), np.full((n, 4), np.nan), np.zeros((n, 3))
    centre[frames] = carry(np.linalg.inv(maps[frames]), along)
    box[frames] = np.column_stack([centre[frames] - extent / 2, extent])
    colour[:] = np.median(seen.colour[rows], axis=0)
    near = np.column_stack([np.interp(frames, at, x) for x in seen.colour[rows].T])
    colour[frames] = 0.5 * colour[frames] + 0.5 * near
    centre, box = factor * centre + (factor - 1) / 2, factor * box
    return Ways(centre, box, colour)


def _finished(views: list[View | None], motion: CameraMotion, doubts: list[str]) -> Followed:
    """The views of the whole target as a track."""
    n = len(views)
    raw = np.full((n, 2), np.nan)
    at = np.array([i for i, view in enumerate(views) if view], int)
    if not len(at):
        return Followed(raw, raw.copy(), np.full(n, np.inf), motion, [*doubts, "not seen"])
    shown = [view for view in views if view]
    centroids = np.array([view.centroid for view in shown])
    steady = carry(motion.maps[at], centroids)
    areas = np.array([view.area for view in shown])
    inside = np.array([view.inside for view in shown]) & np.isfinite(motion.errors[at])
    good = fitting(at, steady, areas, inside)
    raw[at[good]] = centroids[good]
    pixels = np.full((n, 2), np.nan)
    pixels[at[good]] = steady[good]
    return Followed(pixels, raw, motion.errors[:n].copy(), motion, doubts)
