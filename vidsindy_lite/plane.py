"""From the film of one camera to the law of a motion in a plane that faces it, or is marked out.

The camera is known by what it sees of the plane z = 0: from two marks and the distance between
them, or from the corners of a rectangle. Of nested laws, each class with fewer symmetries than the
one before it, the simplest is taken that the data bear: forces that are the same everywhere
(`homogeneous`), forces linear in place and velocity, a swing on a circle.
"""

import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from numpy.polynomial.polynomial import polyfit, polyval
from scipy.special import fdtri

from . import pipeline
from .arrays import Floats, Ints
from .cameras import Lags, OrthographicCamera, Rig
from .checks import check_array, check_number, check_path, check_positive, check_vector, shown
from .dynamics.collocation import CLEANEST
from .dynamics.data import inflation
from .pipeline import Observation, VideoDiscovery
from .vision import Hint, TrackFile, carry, check_detector, frame_clock, read_tracks, video_info

MARK = 1.0  #: Standard error of a mark that is set by hand, in pixels.
#: What pulls at all bodies, in metres a second squared, and by how much it differs on earth.
EARTH, ELSEWHERE = 9.81, 0.03
SURE = 3.0  #: Standard errors from which on a difference is one.
#: Standard error of a direction that is set by hand: of a vertical, and of where a camera looks.
TILTED = np.deg2rad(2.0)
#: Of the vertical of a picture, where no other is given: a telephone is held upright by hand.
HELD = np.deg2rad(10.0)
TABLES = (".csv", ".tsv", ".txt", ".xml", ".dat")  #: How the names of files end that hold a track.
SPACE = np.eye(2, 3)  #: From places in the plane, (n, 2), to the same in space, (n, 3).


@dataclass(frozen=True, eq=False, kw_only=True)
class PlaneCamera(OrthographicCamera):
    """A camera of which is known how it sees the plane z = 0, and its scale between the marks.

    Parameters
    ----------
    homography : ndarray, shape (3, 3)
        From pixels to the plane, homogeneous.
    position, normal, scale, angle, scale_error, image_size
        See `Camera`.
    """

    model: ClassVar[str] = "plane"

    homography: Floats

    def image(self, x: Floats) -> Floats:
        """Pixels at which points of the plane are seen, (n, 2)."""
        return carry(np.asarray(np.linalg.inv(self.homography), float), x[:, :2])


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PlaneDiscovery(VideoDiscovery):
    """A motion in the plane z = 0 of one camera, x rightwards and y upwards, and its law.

    Parameters
    ----------
    unit : {"m", "px"}
        Of places. The law of what moves along a line is that of one coordinate, see
        `Discovery.orientation`.
    """

    unit: str

    def doubted(self, doubts: Sequence[str]) -> Self:
        """The same with more warnings, which come first, and which the law keeps."""
        law = replace(self.discovery, warnings=(*doubts, *self.warnings))
        return replace(self, warnings=law.warnings, discovery=law)

    @cached_property
    def leaning(self) -> float:
        """By how many degrees a motion along a line leans from the vertical; else 0.

        And where that may be how the telephone was held.
        """
        there = np.isfinite(self.x[:, 0])
        axes = pipeline.directions(self.t[there], self.x[there, :2])
        off = float(np.arctan2(*np.abs(axes[0])))
        return float(np.rad2deg(off)) if len(axes) == 1 and off > SURE * HELD else 0.0


def discover_from_video(
    path: str | os.PathLike,
    length: Sequence[float] | None = None,
    up: Sequence[float] | None = None,
    fps: float | None = None,
    *,
    corners: Sequence[float] | None = None,
    length_error: float | None = None,
    frames: Sequence[int] | None = None,
    individual: str | None = None,
    hint: Hint | None = None,
    detector: str | os.PathLike = "auto",
    degree: int | None = None,
    order: int | str = "auto",
    seed: int = 0,
    progress: bool | None = None,
) -> PlaneDiscovery:
    """Discover the law of a motion in a plane from the film of one camera.

    Parameters
    ----------
    path : path
        A film, see `track`, or a text file of the target's track in it, see `discover_from_tracks`.
        Marks are in pixels of its first frame.
    length : (u1, v1, u2, v2, metres), optional
        Two marks, and how far they are apart in the plane of the motion; the first is its origin.
        Without it, and without corners, places are in pixels from the lower left of the picture.
    up : (du, dv) or (u1, v1, u2, v2), optional
        The vertical, as a direction in the picture or by two marks, the lower one first; by default
        that of the picture.
    fps : float, optional
        Frames in one second, where the file does not say so: slow motion, tracks without times.
    corners : (u1, v1, ..., u4, v4, width, height), optional
        For a plane that is seen askew: the corners of a rectangle in it, lower left, lower right,
        upper right, upper left, and its sides in metres. The lower left is the origin.
    length_error : float, optional
        Standard error of the length or of the sides, as a share of them; .01 by default. That of
        marks, a pixel each, comes on top.
    frames : (first, last), optional
        What counts of the film, both included, from 0 or as a file numbers its frames: the target
        may be in a hand before, or on the ground after. By default all but the rest of what is held
        still and then let go; or the longest part without a bounce or a hit, or in free flight with
        the pull of the earth, where that alone has a law beyond doubt.
    individual : str, optional
        Which of several targets of a text file; see `read_tracks`.
    hint, detector
        Of a film: see ``target`` and ``detector`` of `track`.
    degree, order, seed, progress
        See `discover`. By default, of nested laws the simplest that the data bear: forces that are
        the same at every place, linear ones, a swing on a circle.

    Returns
    -------
    PlaneDiscovery

    Raises
    ------
    FileNotFoundError, ValueError
        If marks or numbers are no such, or as `track` and `discover` do.

    Examples
    --------
    >>> found = vl.discover_from_video("throw.mp4", length=(272, 446, 273, 47, 1.0))
    >>> print(found, found.g)
    """
    check_detector(detector)
    asked = pipeline.law_options(degree, None, order, "learn", "data", seed, progress, 2)
    if length_error is not None and length is None and corners is None:
        raise ValueError("length_error: must be given with length or corners, got neither")
    share = 0.01 if length_error is None else check_number("length_error", length_error)
    if not 0 <= share < 1:
        raise ValueError(
            f"length_error: must be a share of the length, from 0 to below 1, got {share}"
        )
    path = check_path("path", path)
    name, table = path.name, path.suffix.lower() in TABLES
    of_film, of_table = hint is not None or detector != "auto", individual is not None
    if of_film if table else of_table:
        raise ValueError(
            f"{'hint and detector' if table else 'individual'}: must be given with a "
            f"{'film' if table else 'text file of tracks'}, got {name}"
        )
    if table:  # its picture is the smallest one that holds the track
        track = _table(path, fps, individual)
        width, height = (int(x) + 1 for x in np.fmax.reduce(track.pixels, axis=0, initial=0.0))
    else:
        shot = video_info(path)
        if fps is None and not shot.fps:
            raise ValueError(f"fps: must be given, as {name} states no frame rate")
        rate = shot.fps if fps is None else check_positive("fps", fps)
        width, height = shot.size
    size = width, height
    marks, places, measured = four_places(length, up, corners, size, within=not table)
    if table:  # the picture holds the marks, too
        width, height = np.maximum(size, marks.max(axis=0).astype(int) + 1).tolist()
        size = width, height
    to_plane = homography_of(marks, places)
    error = float(np.hypot(share, np.sqrt(2) * MARK / measured)) if measured else 0.0
    unit = "m" if measured else "px"
    scale = f", their scale known to {100 * error:.2g} % at the marks" if measured else ""
    middle, centre = marks.mean(axis=0), (np.array(size) - 1) / 2
    across = complex(*np.diff(carry(to_plane, middle + [[0.0, 0], [1, 0]]), axis=0)[0])
    camera = PlaneCamera(
        homography=to_plane, position=carry(to_plane, centre[None])[0] @ SPACE,
        normal=np.array([0, 0, 1]), scale=abs(across), angle=-float(np.angle(across)),
        scale_error=error, image_size=size,
    )  # fmt: skip
    rig = Rig((camera,), note=f"the plane of the motion, places in {unit}, times in s{scale}")
    if not table:
        (seen,) = pipeline.tracked(path, shot.frames, detector, hint)
        track = TrackFile(name, seen.pixels, frame_clock(path) / rate, seen.warnings)
    t, pixels, first, warnings = np.asarray(track.t), track.pixels, track.start, track.warnings
    if frames is not None:
        pixels = _between(frames, pixels, first)
    pipeline.check_found([pixels], [name], 1, () if table else [warnings])
    pixels, left_out = pipeline.without_wild(pixels, name)
    zero, clock = np.zeros(1), np.arange(len(t), dtype=float)

    def law_of(pixels: Floats, *cuts: str) -> PlaneDiscovery:
        """The law of what is left of a track after some cuts."""
        x = carry(to_plane, pixels)
        known = slice(3 if corners is None else 1) if measured else slice(0)
        modes = np.stack([error * x, *_tilts(camera, pixels, middle)])[known]
        seen = Observation(
            tracks=(pixels,), rig=pipeline.noted(rig, left_out, *cuts),
            lags=Lags(zero, zero + 1, zero, 0.0, clocks=(clock,)),
            t=t, x=x @ SPACE, systematic=modes @ SPACE, warnings=warnings,
        )  # fmt: skip
        found = PlaneDiscovery(**vars(pipeline.with_law(seen, [name], asked)), unit=unit)
        if found.leaning:
            line = f"along a line {found.leaning:.0f} degrees off the vertical: something bears it"
            law = replace(found.discovery, force="pull")
            with_line = pipeline.noted(found.rig, f"{line}, its pull is no g")
            found = replace(found, rig=with_line, discovery=law)
        doubted, contradicted = found.warnings != seen.warnings, list[str]()
        if not doubted or found.circle is not None:  # else its g is none
            vertical = up is not None or corners is not None
            contradicted += _contradicted(found, vertical, corners is None)
        if doubted and frames is None:
            contradicted.append(
                f"frames: all{' of these' if any(cuts) else ''} were taken to be of one motion: if "
                "it begins in a hand or ends on the ground, give the first and the last frame that "
                "count; and before a plain wall, which does not show how a hand trembles, the "
                "phone has to stand on something"
            )
        return found.doubted(contradicted)

    if frames is not None:
        return law_of(pixels)
    let_go, held = _let_go(pixels, first)
    found, x = law_of(let_go, held), carry(to_plane, pixels)
    for flies in (False, True):
        # Doubts about a track are those of its parts; and without metres nobody knows what falls.
        if found.status == "ok" or warnings or (flies and not measured):
            break
        part, told = _flight(pixels, first, t, x) if flies else _unhit(let_go, first)
        with suppress(ValueError):  # of a part that holds too little
            other = law_of(part, "" if flies else held, told) if told else found
            if other.status == "ok" and (other.g is not None or not flies):
                found = other
            elif flies and told:
                fall = f": if {told.partition(',')[0]}, "
                doubt = (one for one in other.warnings if "flies or swings freely" in one)
                also = [one.replace(": ", fall, 1) for one in doubt]
                found = found.doubted(also)
    return found


def _table(path: Path, fps: float | None, individual: str | None) -> TrackFile:
    """The track of one camera in a text file, with the times that are given or stated."""
    read = read_tracks(path, individual)
    if len(read) > 1 or read[0].upwards:
        got = f"{len(read)} cameras" if len(read) > 1 else "one that counts v from below"
        told = f"path: {path.name} must hold the track of one camera, v downwards, got {got}"
        raise ValueError(told)
    (track,), (times, doubts) = read, pipeline.times_of(read, None, fps)
    return replace(track, t=np.array(times, float)[0], warnings=(*track.warnings, *doubts))


def _between(frames: Sequence[int], pixels: Floats, start: int) -> Floats:
    """A track that starts at some frame, not seen but from the first to the last of two frames."""
    first, last = check_vector("frames", frames, 2).tolist()
    number = start + np.arange(len(pixels))[:, None]
    if not (first % 1 == last % 1 == 0 and number[0] <= first and first + 5 <= last <= number[-1]):
        raise ValueError(
            "frames: must be the first and the last that count, at least 5 apart, integers from "
            f"{start} to {start + len(pixels) - 1}, got {first:g}, {last:g}"
        )
    return np.where((number >= first) & (number <= last), pixels, np.nan)


def _unhit(pixels: Floats, start: int) -> tuple[Floats, str]:
    """The part of a track that goes farthest without a hit, and what to say of it.

    It starts at some frame. Parts are long enough for a law if they hold more than ten frames.
    """
    turns, seen = pipeline.kinks(pixels), np.flatnonzero(np.isfinite(pixels).all(axis=1))

    def reach(rows: Ints) -> float:
        return float(np.linalg.norm(np.ptp(pixels[rows], axis=0)))

    free = np.setdiff1d(seen, turns)
    parts = [part for part in np.split(free, np.searchsorted(free, turns)) if len(part) > 10]
    far = max(parts, key=reach, default=seen[:1])
    if not len(turns) or reach(far) < reach(seen) / 10:  # at rest
        return pixels, ""
    first, last = (start + far[[0, -1]]).tolist()
    places = np.split(turns, np.flatnonzero(np.diff(turns) > 2) + 1)
    each = ", ".join(str(start + int(np.median(one))) for one in places[:5])
    told = (
        f"it turns sharply at frame{'s' * (len(places) > 1)} {each}, as where it bounces, is hit, "
        f"or frames are missing: counted from {first} to {last}"
    )
    return _between((first, last), pixels, start), told


def _flight(pixels: Floats, start: int, t: Floats, x: Floats) -> tuple[Floats, str]:
    """The part of a track that goes farthest on a parabola, to its noise, and what to say of it.

    It starts at some frame, and is at places in the plane, (n, 2), at some times. What comes before
    and after is another motion, as that of a hand, if what acts there differs by more than the
    pull: that of a drag, or of a plane askew, is less. What a slope bears falls aside.
    """
    seen, first = np.flatnonzero(np.isfinite(x).all(axis=1)), 0
    best, fall = (0.0, 0, 0), np.zeros((3, 2))
    for last in range(len(seen)):
        parabola = None
        while last - first >= 9 and parabola is None:
            parabola = _parabola(t[own := seen[first : last + 1]], x[own])
            first += parabola is None
        if parabola is not None:
            upright = np.abs(parabola[2, 0]) < np.tan(HELD) * -parabola[2, 1]
            far = float(np.linalg.norm(np.diff(x[own], axis=0), axis=1).sum()), first, last
            if upright and far > best:
                best, fall = far, parabola
    if not best[-1]:
        return pixels, ""
    own = seen[best[1] : best[2] + 1]
    since, reach = t[seen] - t[own[0]], np.linalg.norm(np.ptp(x[own], axis=0))
    off = np.linalg.norm(polyval(since, fall).T - x[seen], axis=1)
    beyond = np.maximum(0, np.maximum(-since, since - np.ptp(t[own])))
    other = off > -fall[2, 1] * beyond**2 + 5 * np.median(off[beyond == 0])
    # Any smooth motion falls so for a while.
    if reach <= np.linalg.norm(np.ptp(x[seen], axis=0)) / 2 or not other[beyond > 0].any():
        return pixels, ""
    begins, ends = start + own[[2, -3]]  # the test hardly sees what the ends do
    told = f"it flies freely from frame {begins} to {ends}, which alone are counted"
    return _between((begins, ends), pixels, start), told


def _parabola(t: Floats, x: Floats) -> Floats | None:
    """The parabola of places, (3, 2), from the first time on; None if they are on none.

    Three powers of the time more explain no more than chance: F-test at one in a thousand, of
    errors that may last.
    """
    n, since = len(t), t - t[0]
    own, more = polyfit(since, x, 2), polyfit(since / since[-1], x, 5)
    two, five = x - polyval(since, own).T, x - polyval(since / since[-1], more).T
    noise = (five**2).sum(axis=0) / (n - 6) + (CLEANEST * x.std()) ** 2
    gain = ((two**2).sum(axis=0) - (five**2).sum(axis=0)) / 3
    on_it = (gain <= fdtri(3, n - 6, 0.999) * inflation([five]) * noise).all()
    return np.asarray(own, float) if on_it else None


def _let_go(pixels: Floats, start: int) -> tuple[Floats, str]:
    """A track that starts at some frame, without the rest before its motion, and what to say of it.

    From rest, in twice the time it moves four times as far: so it was let go as long before it had
    moved by one step as that is before four. What grows by itself has moved by a quarter by then,
    or was hardly longer at rest.
    """
    seen = np.flatnonzero(np.isfinite(pixels).all(axis=1))
    apart = np.linalg.norm(pixels[seen] - np.median(pixels[seen[:5]], axis=0), axis=1)
    step = max(0.05 * apart.max(), 2.0)  # pixels, more than a hand trembles or a track errs
    once, fourth = (seen[int((apart > far).argmax())] for far in (step, 4 * step))
    released = 2 * once - fourth
    moved = apart[seen < released].max(initial=0.0) > 0.2 * step + 3 * np.median(apart[:10])
    if moved or apart.max() <= 4 * step or released - seen[0] < max(5, 2 * (fourth - once)):
        return pixels, ""
    told = f"it rests until frame {start + released}: counted from {start + once} on"
    return np.where(np.arange(len(pixels))[:, None] < once, np.nan, pixels), told


def four_places(
    length: Sequence[float] | None,
    up: Sequence[float] | None,
    corners: Sequence[float] | None,
    size: tuple[int, int],
    within: bool = True,
) -> tuple[Floats, Floats, float]:
    """Four pixels and where they are in the plane, (4, 2) each.

    And the pixels that their distances were measured on, 0 if there are none. The marks have to lie
    within a picture of that size, or it is the least that holds the motion.
    """
    upwards, square = _upwards(up), np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    if corners is not None:
        if length is not None:
            raise ValueError("corners: must not be given with length, got both")
        given = check_vector("corners", corners, 10)
        marks, places = _in_picture("corners", given[:8], size, within), square * given[8:]
        edges = np.roll(marks, -1, axis=0) - marks
        turns = edges[:, 0] * np.roll(edges[:, 1], -1) - edges[:, 1] * np.roll(edges[:, 0], -1)
        if not ((turns < 0).all() and given[8:].min() > 0):  # v points down
            raise ValueError(
                "corners: must be lower left, lower right, upper right, upper left of a rectangle "
                f"and two sides above 0, got {given.tolist()}"
            )
        if up is not None:  # of the plane, as it is seen at the middle of the rectangle
            seen = carry(homography_of(marks, places), marks.mean(axis=0) + [0 * upwards, upwards])
            s, c = (seen[1] - seen[0]) / np.hypot(*(seen[1] - seen[0]))
            places = places @ np.array([[c, s], [-s, c]])
        return marks, places, float(np.hypot(*edges.T).min())
    origin = middle = np.array([0.0, size[1] - 1.0])
    metres, pixels = 1.0, 0.0
    if length is not None:
        told = check_vector("length", length, 5)
        ends, metres = _in_picture("length", told[:4], size, within), float(told[4])
        origin, middle, pixels = ends[0], ends.mean(axis=0), float(np.hypot(*(ends[1] - ends[0])))
        if not (pixels > 2 * MARK and metres > 0):
            raise ValueError(
                f"length: must be two marks more than {2 * MARK:g} pixels apart and a distance "
                f"above 0, got {tuple(length)}"
            )
    axes = np.array([[-upwards[1], upwards[0]], upwards])
    marks, scale = middle + (pixels or 1.0) * (square - 0.5) @ axes, metres / (pixels or 1.0)
    return marks, scale * (marks - origin) @ axes.T, pixels


def _in_picture(name: str, given: Floats, size: tuple[int, int], within: bool) -> Floats:
    """Marks, (n, 2), which are checked to lie within the picture."""
    marks = given.reshape(-1, 2)
    if within and not ((marks >= 0) & (marks <= size)).all():
        raise ValueError(
            f"{name}: marks must lie in the picture, {size[0]} x {size[1]}, got {marks.tolist()}"
        )
    return marks


def _upwards(up: Sequence[float] | None) -> Floats:
    """The unit vector of the vertical in the picture, (u right, v down)."""
    marks = check_array("up", (0, -1) if up is None else up)
    away = marks[-2:] - (marks[:2] if marks.shape == (4,) else 0.0)
    if marks.shape not in ((2,), (4,)) or not (np.isfinite(away).all() and away.any()):
        raise ValueError(
            f"up: must be a direction (du, dv) or two marks apart (u1, v1, u2, v2), got {shown(up)}"
        )
    return away / np.hypot(*away)


def homography_of(marks: Floats, places: Floats) -> Floats:
    """The homography, (3, 3), that takes four pixels to places, (4, 2) each."""
    ones = np.column_stack([marks, np.ones(4)])
    wanted, twice = places.T.ravel(), np.vstack([marks, marks])
    rows = np.hstack([np.kron(np.eye(2), ones), -wanted[:, None] * twice])
    return np.append(np.linalg.solve(rows, wanted), 1.0).reshape(3, 3)


def _tilts(camera: PlaneCamera, pixels: Floats, middle: Floats) -> list[Floats]:
    """By how much places are off, (n, 2), where the camera looks askew by one standard error.

    To the side, and upwards. Lengths between the marks are right, what is seen beside their middle
    is nearer to the camera or farther away.
    """
    away = pixels - middle
    # The focal length of a telephone over the longer side of its picture.
    nearer = TILTED * away / (0.75 * max(camera.image_size))
    x = carry(camera.homography, pixels)
    return [carry(camera.homography, pixels + nearer[:, [j]] * away) - x for j in (0, 1)]


def _contradicted(found: PlaneDiscovery, vertical: bool, askew: bool) -> list[str]:
    """What the law says against scale, frame rate and vertical, and a plane that may lie askew."""
    doubts, g = [], found.g
    drags = [str(one) for one in found.discovery.physics() if one.name.startswith("drag")]
    if drags and askew and found.circle is None:
        doubts.append(
            f"corners: {', '.join(drags)} is that of a path that recedes as well, as in a plane "
            "that lies askew: give four marks of a rectangle in the plane"
        )
    if found.unit == "m" and g is not None:
        times = float(g.value) / EARTH
        error = float(g.error) / max(times, 1.0)  # what is too long errs by as much more
        if abs(times - 1) * EARTH > SURE * np.hypot(error, ELSEWHERE):
            wrong = (
                f"the marks may be {1 / times:.3g} times as far apart as is given, or the frames "
                f"a second {1 / np.sqrt(times):.3g} times as many, or the plane may lie askew"
                if times > 0
                else "it does not hang there, or the plane lies askew"
            )
            what = "length" if askew else "corners"
            doubts.append(f"{what}: {g} is not the {EARTH} of what flies or swings freely: {wrong}")
    if found.circle is None and g is not None:
        pull = found.discovery.physics()["direction"]
        (aside, upwards, _), off = pull.value @ found.turn, pull.error @ np.abs(found.turn)
        tilt = np.arctan2(aside, -upwards)
        error, whose = (TILTED, "that was given") if vertical else (HELD, "of the picture")
        if abs(tilt) > SURE * np.hypot(float(off[0]), error):
            doubts.append(
                f"up: the pull is {np.rad2deg(tilt):.3g} degrees off the vertical {whose}: if a "
                "slope bears it, it is no g; if v is counted upwards, it is upside down"
            )
    return doubts
