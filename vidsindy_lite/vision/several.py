"""Several targets in one film: each is followed wherever it is apart from the others.

Where two meet in an image, nobody can say which is which afterwards: who is who, across meetings
and views, is for the cameras to tell (`cameras.identify`). So a track is that of one target from
one meeting to the next.
"""

import os
from pathlib import Path

import numpy as np

from ..arrays import Bools
from ..checks import check_integer
from .association import Path as Motion
from .association import plainest_paths
from .background import BackgroundModel, sample_frames
from .candidates import Candidates
from .moving import Film, Ways, expected, finished, lens_of, nothing, sighted, viewed
from .reducing import ReducedFrames
from .tracking import Track


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
    frames = ReducedFrames.of(path)
    samples = sample_frames(frames)
    # Before a plain background, all that could tell of a camera's motion may be the targets.
    film = Film.of(frames, samples, BackgroundModel(samples).camera_rests)
    seen, lights = sighted(film, targets=count)
    n = len(lights)
    # Paths of a target that may follow each other.
    paths = plainest_paths(seen, most=count * 8)
    lanes, strange = _lanes(seen, paths, count)
    ways = [_joined([expected(seen, p.rows, film, n) for p in lane]) for lane in lanes]
    touching = _touching(ways)
    doubts = _doubts(seen, strange, film.factor, n, Path(path).name)
    tracks = []
    lens = lens_of(samples, film, *ways)
    for way, hidden in zip(ways, touching, strict=True):
        way.centre[hidden] = np.nan
        followed = finished(viewed(film, lens, way, lights), film.motion, doubts)
        tracks.append(Track.of_motion(followed))
        doubts = ()
    missing = Track.of_motion(nothing(film.motion, n))
    return (*tracks, *[missing] * (count - len(tracks)))


def _lanes(
    seen: Candidates, paths: list[Motion], count: int
) -> tuple[list[list[Motion]], list[Motion]]:
    """The paths of each target, one after the other in time; and paths for which none is left."""
    lanes: list[list[Motion]] = []
    left = []
    plainest = max((path.rating / len(path.rows) for path in paths), default=0.0)
    for path in sorted(paths, key=lambda path: -len(path.rows)):
        # Worth of a candidate of a path, relative to those of the plainest.
        if path.rating / len(path.rows) < 0.4 * plainest:
            continue
        free = [lane for lane in lanes if not any(_overlap(seen, path, other) for other in lane)]
        if free:
            free[0].append(path)
        elif len(lanes) < count:
            lanes.append([path])
        else:
            left.append(path)
    return lanes, left


def _overlap(seen: Candidates, one: Motion, other: Motion) -> bool:
    """Do two paths share any of the time from their first frames to their last?"""
    (a, b), (c, d) = (seen.frame[path.rows[[0, -1]]] for path in (one, other))
    return bool(a <= d and c <= b)


def _joined(ways: list[Ways]) -> Ways:
    """The ways of paths that follow each other as one."""
    centre, box, colour = (field.copy() for field in ways[0])
    for way in ways[1:]:
        here = np.isfinite(way.centre[:, 0]) & np.isnan(centre[:, 0])
        centre[here], box[here], colour[here] = way.centre[here], way.box[here], way.colour[here]
    return Ways(centre, box, colour)


def _touching(ways: list[Ways]) -> list[Bools]:
    """In which frames each target touches another one, or hides it."""
    found = [np.zeros(len(ways[0].centre), bool) for _ in ways]
    for i, one in enumerate(ways):
        for j, other in enumerate(ways[:i]):
            apart = np.linalg.norm(one.centre - other.centre, axis=1)
            sizes = (one.box[:, 2:].max(axis=1) + other.box[:, 2:].max(axis=1)) / 2
            with np.errstate(invalid="ignore"):
                # Sizes, and pixels more, between two targets that do not touch.
                met = apart < 1.3 * sizes + 2.0
            found[i] |= met
            found[j] |= met
    return found


def _doubts(
    seen: Candidates, strange: list[Motion], factor: int, frames: int, name: str
) -> tuple[str, ...]:
    """Does one thing more move than there are targets?"""
    longest = max(strange, key=lambda path: len(path.rows), default=None)
    # Share of the frames in which one more thing moves, above which there is doubt.
    if longest is None or len(longest.rows) < 0.2 * frames:
        return ()
    row = longest.rows[len(longest.rows) // 2]
    u, v = factor * seen.place[row]
    return (
        f"{name}: one thing more moves than there are targets, e.g. in frame {seen.frame[row]} at "
        f"({u:.0f}, {v:.0f})",
    )
