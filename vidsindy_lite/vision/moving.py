"""What moves before a background that is steadied: the tracker for films that people make.

Candidates of all frames (`candidates`) are linked to paths (`linking`); the plainest path is the
target's, and its places are refined in whole frames (`refining`). The camera's motion (`steadying`)
is taken out, so that tracks come in the first frame's pixels.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Floats32, Image, Ints
from .background import light, sampled
from .camera import LOOSE, camera_motion
from .candidates import (
    Candidate,
    Difference,
    Plate,
    tolerance,
    uncommon,
)
from .crossing import rejoined
from .hints import Hint
from .lingering import Place, lingering, uncover
from .linking import TOLD, Sightings, best_path, worth
from .occluders import hidden
from .pixels import relit
from .pointing import Pointer, alike
from .recalling import recalled
from .reducing import ReducedFrames, reduce, reduced
from .refining import Lens, View, entire, fitting, scatter, swapped
from .steadying import CameraMotion, at_rest, carry

_PATHS = 5  # paths among which the target's is chosen
_SHORTEST = 5  # frames of a path
_AS_PLAIN = 0.5  # rating of another path, relative to the best, above which there is doubt
_AS_OFTEN = 0.5  # share of its sightings, from which on another is rated by how plain each is
_BEYOND = 3  # frames by which a path is carried on at its ends
_PLAIN = 0.2  # quality of the candidates of a path that is worth anything
_SWINGS = 0.1  # of its size, by which what lingers in its place moves at least
_SCARCE = 0.05  # share of the frames in which a target must be seen
_RECALLED = 2.0  # pixels, about, to which a target is recalled that is not seen whole
_DENSE = 640  # pixels in a row of which the noise is known well
_RARELY = 0.5  # share of the views before ground of about the target's colour, which are of parts
_LARGE = 0.01  # share of the image that a target hardly fills
_RESTLESS = 0.03  # of their length, by which the sides of a target hardly change in a frame
_PIXELS = 2  # of each side that change with where its two ends lie between pixels


class Rated(NamedTuple):
    """A path: rows of the sightings, how plainly it is a target's."""

    rows: Ints
    rating: float


def rate(seen: Sightings, rows: Ints, value: float) -> float:
    """How plainly a path is that of a target: something that travels and stays what it is.

    What stands still, flickers or is a part of something larger that changes is worth little, and
    so is what changes its outline from frame to frame, as people do who walk.
    """
    centre, size = seen.centre[rows], np.median(seen.size[rows])
    low, high = np.percentile(centre, [5, 95], axis=0)
    extent = float(np.linalg.norm(high - low) / size)
    colour = seen.colour[rows]
    recolour = np.median(np.linalg.norm(colour - np.median(colour, axis=0), axis=1))
    speed = np.diff(centre, axis=0) / np.diff(seen.frame[rows])[:, None]
    turn = np.median(np.linalg.norm(np.diff(speed, axis=0), axis=1))
    jitter = turn / (np.median(np.linalg.norm(speed, axis=1)) + 0.5)
    large = size**2 / seen.diagonal**2
    sides = seen.box[rows, 2:]
    change = np.maximum(np.abs(np.diff(sides, axis=0)) - _PIXELS, 0) / sides[1:]
    restless = np.median(change.sum(axis=1))
    doubts = (1 + recolour / 30) * (1 + jitter) * (1 + large / _LARGE)
    doubts *= 1 + restless / _RESTLESS
    return float(value * extent / (extent + 2) / doubts)


def plainest_paths(seen: Sightings, most: int = _PATHS) -> list[Rated]:
    """Several paths that have nothing in common, the plainest first."""
    left, found, boxes = np.arange(len(seen.frame)), [], seen.box
    for _ in range(most):
        rows = left[best_path(seen.only(left))[0]]
        if len(rows) < _SHORTEST:
            break
        found.append(rows)
        around = np.full((seen.frame[-1] + 1, 4), np.nan)
        around[seen.frame[rows]] = boxes[rows]
        low = around[seen.frame[left], :2]
        middle = boxes[left, :2] + boxes[left, 2:] / 2
        with np.errstate(invalid="ignore"):
            part = ((middle >= low) & (middle <= low + around[seen.frame[left], 2:])).all(axis=1)
        left = left[~part & ~np.isin(left, rows)]
    found = [rows for rows in rejoined(seen, found) if len(rows) >= _SHORTEST]
    rated = [Rated(rows, rate(seen, rows, worth(seen, rows))) for rows in found]
    return sorted(rated, key=lambda path: -path.rating)


class Followed(NamedTuple):
    """What was found: pixels (n, 2) of the first frame, their errors (n,), doubts.

    `maps` (n, 3, 3) say where each frame lies in the first.
    """

    pixels: Floats
    errors: Floats
    maps: Floats
    doubts: tuple[str, ...]


def _noise(samples: Image, maps: Floats, plate: Plate) -> float:
    """Of a pixel, in grey levels: of the quieter samples, which differ from the plate by that."""
    found = []
    step = max(3, samples.shape[2] // _DENSE)
    for sample, here in zip(samples, maps, strict=True):
        then, known = plate.seen_from(here, np.zeros(2), sample.shape[1::-1], step)
        now = sample[::step, ::step]
        if known.any():
            found.append(
                1.4826 * np.median(np.abs(now - relit(then, light(now, then, known)))[known])
            )
    return float(np.median(found)) if found else 0.0


def follow(frames: ReducedFrames, samples: Image, hint: Hint | None = None) -> Followed:
    """Track what moves in a film, the target if there is a hint which it is.

    `samples` are frames spread evenly over the film, see `sample_frames`.
    """
    film = Film.of(frames, samples)
    found, lights = sighted(film)
    lens = lens_of(samples, film)
    if hint is None:
        return _followed(film, lens, found, lights)
    pointer = Pointer.of(hint, found, film.factor, frames.reel.path)
    if pointer.one is not None:  # the plainest path may be the one that is meant
        plain = _followed(film, lens, found, lights, hinted=True)
        if not pointer.missed(plain.pixels, plain.maps):
            return plain
    followed = _followed(film, lens, found, lights, hinted=True, pointer=pointer)
    missed = pointer.missed(followed.pixels, followed.maps)
    return followed._replace(doubts=followed.doubts + missed)


def _followed(
    film: "Film", lens: Lens, found: list[list[Candidate]],
    lights: list[Floats32], *, hinted: bool = False, pointer: Pointer | None = None,
) -> Followed:  # fmt: skip
    """What moves most plainly, of that at which a hint points, its gaps filled."""
    seen, paths = linked(pointer.like(found) if pointer else found, film, pointer)
    doubts: tuple[str, ...] = ()
    if pointer is None and paths:
        paths = paths if _travels(seen, paths[0].rows, film.places) else []
        doubts = _rivals(seen, paths, film) if paths and not hinted else ()
    if not paths:
        return nothing(film.motion, len(found))
    # What the target looks like is known by now, which tells it from what it meets.
    first = paths[0].rows
    learned = _learned(found, seen, first)
    if pointer is not None:
        learned = pointer.kept(learned, seen.frame[first], seen.which[first])
    seen, paths = linked(learned, film, pointer)
    if not paths:
        return nothing(film.motion, len(found))
    if not film.sure:
        doubts += ("the background is too plain to tell whether the camera moves: if so, its "
                   "motion is part of the track",)  # fmt: skip
    rows = max(paths, key=lambda path: np.isin(path.rows, first).sum()).rows
    views = viewed(film, lens, expected(seen, rows, film, len(found)), lights)
    if pointer is not None and any(views):
        doubts += pointer.unlike(np.median([view.colour for view in views if view], axis=0))
    followed = finished(views, film.motion, doubts)
    start, last = seen.frame[rows[[0, -1]]]
    sure = np.s_[start : last + 1]
    return remembered(film, lens, lights, followed, views, sure, told=hinted)


def linked(
    found: list[list[Candidate]], film: "Film", pointer: Pointer | None = None, most: int = _PATHS
) -> tuple[Sightings, list[Rated]]:
    """The candidates as a table, and the paths through them, the plainest first.

    If somebody points at one of them, only those through that.
    """
    if pointer is not None:
        found = pointer.pinned(found)
    places = [
        carry(film.maps[i], np.array([c.centre for c in f])) for i, f in enumerate(found) if f
    ]
    seen = Sightings.of(found, places, float(np.hypot(*film.plate.size)))
    paths = plainest_paths(seen, most)
    if pointer is not None and pointer.one is not None:
        paths = [path for path in paths if (seen.quality[path.rows] >= TOLD).any()]
    return seen, paths


def _learned(found: list[list[Candidate]], seen: Sightings, rows: Ints) -> list[list[Candidate]]:
    """Candidates as far as they have the colour of a path.

    What is as plain as the target usually is, is worth all: else a faint one would be left wherever
    its size and colour waver.
    """
    colour = np.median(seen.colour[rows], axis=0)
    usual = float(np.median(seen.quality[rows]))
    return [
        [replace(c, quality=min(c.quality / usual, 1.0) * alike(c.colour, colour)) for c in f]
        for f in found
    ]


class Film(NamedTuple):
    """What is known of a film before its target: `maps` and `plate` are of reduced frames.

    `sure` is whether its camera is known to be at rest, or to move as `motion` says.
    """

    frames: ReducedFrames
    motion: CameraMotion
    maps: Floats
    plate: Plate
    noise: float
    sampled: Ints
    places: list[Place]
    sure: bool

    @property
    def factor(self) -> int:
        """By how much the frames are reduced."""
        return self.frames.factor

    @classmethod
    def of(cls, frames: ReducedFrames, samples: Image, rests: bool = False) -> "Film":
        """From its sampled frames, and from all of them if its camera may move."""
        info, factor = frames.reel.info, frames.factor
        numbers = sampled(info.frames)[: len(samples)]
        small = np.array([reduce(sample, factor) for sample in samples])
        motion, sure = at_rest(info.frames), True
        if not rests:
            motion, sure = camera_motion(frames, small, numbers)
        numbers = np.minimum(numbers, len(motion.maps) - 1)
        maps = reduced(motion.maps, factor)
        known = np.isfinite(motion.errors[numbers])
        plate = Plate(small, maps[numbers], known)
        noise = _noise(small, maps[numbers], plate)
        places = lingering(plate, small, maps[numbers], known, tolerance(plate, noise))
        uncover(plate, small, maps[numbers], known, places)
        return cls(frames, motion, maps, plate, noise, numbers, places, sure)


def sighted(film: Film, targets: int = 1) -> tuple[list[list[Candidate]], list[Floats32]]:
    """What may be the target in each frame, and how bright the frame is."""
    difference = Difference(film.plate, film.noise)
    found = [
        difference.candidates(frame, here)
        for frame, here in zip(film.frames, film.maps, strict=False)
    ]
    kept = [
        difference.travelling(uncommon(some, targets), here)
        for some, here in zip(found, film.maps, strict=False)
    ]
    return kept, difference.lights


def lens_of(samples: Image, film: Film) -> Lens:
    """What looks at targets in whole frames, of which these are samples."""
    known = np.isfinite(film.motion.errors[film.sampled])
    maps = film.motion.maps[film.sampled]
    plate = Plate(samples, maps, known)
    lens = Lens(plate, _noise(samples, maps, plate))
    uncover(plate, samples, maps, known, film.places, film.factor)
    return lens


def viewed(film: Film, lens: Lens, ways: "Ways", lights: list[Floats32]) -> list[View | None]:
    """The target in whole frames, near where it is expected."""
    views = []
    for i, (frame, here) in enumerate(zip(film.frames.reel, film.motion.maps, strict=False)):
        view = None
        if np.isfinite(ways.centre[i, 0]):
            view = lens.look(frame, here, ways.box[i], ways.centre[i], ways.colour[i], lights[i])
        views.append(view)
    return views


def nothing(motion: CameraMotion, n: int) -> Followed:
    """Of a film of n frames in which no target was found."""
    none = "nothing was found that moves like one target"
    return Followed(np.full((n, 2), np.nan), np.full(n, np.inf), motion.maps[:n], (none,))


def _travels(seen: Sightings, rows: Ints, places: list[Place]) -> bool:
    """Does a path leave its place, or turn in one that is known, and is it worth its candidates?"""
    extent = float(np.linalg.norm(np.ptp(seen.centre[rows], axis=0)))
    lingers = any(place.holds(np.median(seen.centre[rows], axis=0)) for place in places)
    least = (_SWINGS if lingers else 1.0) * np.median(seen.size[rows])
    return bool(extent > least and np.median(seen.quality[rows]) > _PLAIN)


def _rivals(seen: Sightings, paths: list[Rated], film: "Film") -> tuple[str, ...]:
    """What else moves about as plainly."""
    whole = len(paths[0].rows)
    often = [max(len(p.rows), _AS_OFTEN * whole) for p in paths[1:]]  # what is rare is not plain
    plain = [
        p
        for p, count in zip(paths[1:], often, strict=True)
        if p.rating * max(whole / count, 1) > _AS_PLAIN * paths[0].rating
    ]
    others = [p for p in plain if _travels(seen, p.rows, film.places)]
    if not others:
        return ()
    row = others[0].rows[len(others[0].rows) // 2]
    u, v = film.factor * seen.centre[row]
    return (
        f"something else moves about as plainly, e.g. in frame {seen.frame[row]} at "
        f"({u:.0f}, {v:.0f}): if that is the target, say so, target=Hint(frame=, box=)",
    )


class Ways(NamedTuple):
    """Where to look in each frame, in its own pixels: centre (n, 2), box (n, 4), colour (n, 3)."""

    centre: Floats
    box: Floats
    colour: Floats


def expected(seen: Sightings, rows: Ints, film: Film, n: int) -> Ways:
    """Where a path leads in all frames from its first to its last, and a little beyond."""
    at, place = seen.frame[rows], seen.centre[rows]
    frames = np.arange(max(at[0] - _BEYOND, 0), min(at[-1] + _BEYOND, n - 1) + 1)
    along = np.column_stack([np.interp(frames, at, x) for x in place.T])
    for outside, end in ((frames < at[0], slice(0, 4)), (frames > at[-1], slice(-4, None))):
        if outside.any():
            fit = np.polyfit(at[end] - at[end][0], place[end], min(2, len(at[end]) - 1))
            t = frames[outside] - at[end][0]
            along[outside] = np.column_stack([np.polyval(fit[:, k], t) for k in (0, 1)])
    extent = np.column_stack([np.interp(frames, at, x) for x in seen.box[rows, 2:].T])
    centre, box, colour = np.full((n, 2), np.nan), np.full((n, 4), np.nan), np.zeros((n, 3))
    centre[frames] = carry(np.linalg.inv(film.maps[frames]), along)
    box[frames] = np.column_stack([centre[frames] - extent / 2, extent])
    colour[:] = np.median(seen.colour[rows], axis=0)
    near = np.column_stack([np.interp(frames, at, x) for x in seen.colour[rows].T])
    colour[frames] = 0.5 * colour[frames] + 0.5 * near
    k = film.factor
    return Ways(k * centre + (k - 1) / 2, k * box, colour)


def finished(views: list[View | None], motion: CameraMotion, doubts: tuple[str, ...]) -> Followed:
    """The views of the whole target as a track."""
    n = len(views)
    pixels, errors = np.full((n, 2), np.nan), np.full(n, np.inf)
    whole, of_parts = entire(views)
    at = np.array([i for i, view in enumerate(whole) if view], int)
    if len(at) < _SHORTEST:
        return nothing(motion, n)
    doubts += of_parts
    shown = [view for view in whole if view]
    steady = carry(motion.maps[at], np.array([view.centroid for view in shown]))
    areas = np.array([view.area for view in shown])
    inside = np.array([view.inside for view in shown]) & np.isfinite(motion.errors[at])
    outlines = [carry(motion.maps[i], view.outline) for i, view in zip(at, shown, strict=True)]
    alone = np.array([view.whole is not None and view.whole.area == view.area for view in shown])
    inside &= ~hidden(outlines, steady, areas, alone)
    faint = np.array([view.faint for view in shown])
    if faint.mean() < _RARELY:  # else it is so everywhere
        inside &= ~faint
    good = fitting(at, steady, areas, inside, alone)
    untold = at[~np.isfinite(motion.errors[at])]
    if len(untold):
        doubts += (f"in {len(untold)} frames of {n} the target is seen, but not how the camera "
                   f"moved, from {untold[0]} to {untold[-1]}: they are left out",)  # fmt: skip
    if good.sum() < max(_SHORTEST, _SCARCE * n):
        return nothing(motion, n)
    if (first := swapped(at[good], areas[good])) is not None:
        doubts += (f"from frame {at[good][first]} on, what is followed has another size at once: "
                   "perhaps it is something else",)  # fmt: skip
    pixels[at[good]] = steady[good]
    errors[at[good]] = np.hypot(scatter(at[good], steady[good]), motion.errors[at[good]])
    if np.median(motion.errors[at[good]]) > LOOSE:
        error = np.median(motion.errors[at[good]])
        doubts += (f"the camera moves, and its motion is known to {error:.1f} px only",)
    return Followed(pixels, errors, motion.maps[:n], doubts)


def remembered(
    film: Film, lens: Lens, lights: list[Floats32], found: Followed,
    views: list[View | None], sure: slice, *, told: bool,
) -> Followed:  # fmt: skip
    """A track with its gaps filled; if somebody told the target, carried on beyond its ends."""
    pixels, errors = found.pixels.copy(), found.errors.copy()
    inside = np.full_like(pixels, np.nan)
    inside[sure] = pixels[sure]
    if np.isfinite(inside[:, 0]).any():
        places = recalled(
            film.frames.reel, lens, lights, inside, found.maps, entire(views)[0], told=told
        )
        known = np.isfinite(places[:, 0])
        pixels[known], errors[known] = places[known], _RECALLED
    return found._replace(pixels=pixels, errors=errors)
