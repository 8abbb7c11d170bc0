"""From video files to a path in space, and on to its equations.

`observe` tracks, synchronises, learns the cameras and reconstructs the path; `discover_from_videos`
looks for the law that it obeys.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike
from scipy.linalg import qr

from . import cameras, dynamics, vision
from .arrays import Bools, Floats, Ints
from .cameras import Clock, Footage, Lags, Rig
from .checks import (
    check_choice,
    check_instance,
    check_integer,
    check_items,
    check_path,
    check_positive,
    check_rows,
    check_tracks,
    check_vector,
    shown,
)
from .dynamics import Discovery, Library, Quantity, Round, Swing
from .progress import bar
from .vision import Hint, TrackFile

_BEYOND = 0.1  # share of an image by which a tenth of the places may lie beyond it


@dataclass(frozen=True, eq=False)
class Observation:
    """What the videos of one target tell before any law is asked for.

    Parameters
    ----------
    tracks : tuple of ndarray, shape (n, 2)
        Pixels of the target in each video at the instants ``t``; NaN where it was not seen. Of k
        targets (n, 2 k), side by side, as are their paths and errors below.
    rig : Rig
        The cameras, all calibrated.
    lags : Lags
        When each video started.
    t : ndarray, shape (n,)
        Time of each frame of the first video.
    x : ndarray, shape (n, 3)
        Reconstructed path in scene units; NaN where fewer than two cameras saw the target.
    systematic : ndarray, shape (k, n, 3)
        Errors of the path that all frames share: what k independent causes, each off by one
        standard error, add to it, in scene units. See `discover`.
    warnings : tuple of str
        Why the result should not be trusted, with advice; empty if nothing was found.
    """

    tracks: tuple[Floats, ...]
    rig: Rig
    lags: Lags
    t: Floats
    x: Floats
    systematic: Floats
    warnings: tuple[str, ...]

    @property
    def status(self) -> str:
        """``"ok"``, or ``"suspect"`` if there is a warning."""
        return "suspect" if self.warnings else "ok"

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {len(self.t)} places: {self.status}>"

    @property
    def targets(self) -> int:
        """How many targets there are."""
        return self.x.shape[1] // 3

    @property
    def residuals(self) -> list[Floats]:
        """Tracks minus what the cameras see of the path, in the shape of the tracks."""
        tracks = [cameras.stacked(track, 2) for track in self.tracks]
        missed = cameras.residuals(tracks, cameras.paced(self.rig, self.lags.rates))
        return [cameras.side_by_side(one, self.targets) for one in missed]


def observe(
    paths: Sequence[str | Path],
    rig: Rig | None = None,
    t: ArrayLike | None = None,
    *,
    lags: Sequence[float] | None = None,
    detector: str | os.PathLike = "auto",
    hints: Sequence[Hint | None] | None = None,
    targets: int = 1,
    progress: bool | None = None,
) -> Observation:
    """Track a target in the videos of several fixed cameras and reconstruct its path.

    The frames of the first video are the clock; the others may start earlier or later, differ in
    length, and in frame rate if their files state it. Frames that were dropped, or taken at uneven
    times, count at the times that the files state.

    Parameters
    ----------
    paths : sequence of path
        One video per camera of the rig: a file, a folder of images, or a pattern of their names,
        see `read_video`.
    rig : Rig, optional
        Positions and normals of all cameras, scale and angle of at least one. Or of three or more
        perspective cameras nothing, the default, or the scale, which may be rough; then the videos
        must start within a frame or two of each other, or their lags be given. Where that leads to
        no rig, as for cameras far away or pictures that were cut out, the path is known but for an
        affine map, and the note of the result's rig says what that leaves of a law.
    t : array_like, shape (n,), optional
        Time of each frame of the first video, increasing; all videos then have the same frame rate.
        By default as the file states, in seconds from its first frame.
    lags : array_like, shape (m,), optional
        By how many frames of the first video each one starts later; only differences count. By
        default they are learned, see `learn_lags`.
    detector : str or path
        See `track`.
    hints : sequence of Hint or None, optional
        Which of the things that move is the target, one per video: see `track`.
    targets : int
        How many targets there are. Several are followed wherever they are apart, and told from each
        other by geometry: in three or more views of a measured rig that start together, or whose
        lags are given. The first is furthest left where the first view first tells them apart.
    progress : bool, optional
        Whether progress bars are shown; by default after two seconds, if a person watches.

    Returns
    -------
    Observation
        Its first warnings are that the rig does not agree with the tracks, if it does not, and
        which backgrounds are not at rest.

    Raises
    ------
    FileNotFoundError, ValueError
        If a file is missing, cut off or no video, if the numbers of files and cameras disagree, if
        ``t`` is given for files that state different frame rates, if a target is not found, if the
        given lags are clearly wrong, or if the cameras cannot be learned (see `learn_cameras`).
        What can be told before a video is tracked is.
    """
    if rig is not None:
        cameras.check_learnable(rig)
    vision.check_detector(detector)
    check_integer("targets", targets, least=1)
    count = None if rig is None else len(rig.cameras)
    each = enumerate(check_items("paths", paths, count, "camera of the rig"))
    files = [check_path(f"paths[{i}]", path) for i, path in each]
    for path in files:
        if (times := files.count(path)) > 1:
            raise ValueError(
                f"paths: must be another video for each camera, got '{path}' {times} times"
            )
    given = [None] * len(files) if hints is None else hints
    hints = check_items("hints", given, len(files), "video")
    if targets > 1:
        _check_several(targets, rig, detector, hints)
    shots = [vision.video_info(path) for path in files]
    if rig is None:
        rig = Rig(tuple(cameras.PerspectiveCamera(image_size=shot.size) for shot in shots))
    names = [path.name for path in files]
    for name, shot, camera in zip(names, shots, rig.cameras, strict=True):
        if shot.frames < 2:
            raise ValueError(f"paths: {name} must be a video, got a single frame")
        if shot.size != camera.image_size:
            raise ValueError(
                f"paths: {name} must have the image size of its camera in the rig, "
                f"{camera.image_size}, got {shot.size}"
            )
    clocks = [vision.frame_clock(path) for path in files]
    clock = Clock.of_videos([shot.fps for shot in shots], clocks, t)
    starts = _check_lags(lags, clock, names)
    films = list(zip(files, shots, hints, strict=True))
    seen = [
        tracked(path, shot.frames, detector, hint, targets)
        for path, shot, hint in bar(progress, "track", iterable=films)
    ]
    tracks = [np.hstack([track.pixels for track in found]) for found in seen]
    told = [[warning for track in found for warning in track.warnings] for found in seen]
    check_found(tracks, names, targets, told)
    conclude = _observed if targets == 1 else _several_observed
    return conclude(tracks, rig, clock, starts, names, sum(told, []), progress)


def observe_tracks(
    tracks: Sequence[ArrayLike],
    rig: Rig,
    t: ArrayLike | Sequence[ArrayLike],
    *,
    lags: Sequence[float] | str | None = None,
    names: Sequence[str] | None = None,
    progress: bool | None = None,
) -> Observation:
    """Reconstruct the path of a target from tracks: `observe` for who has tracked it already.

    Parameters
    ----------
    tracks : sequence of array_like, shape (n_i, 2)
        Pixels of the target, one track per camera of the rig, each from its own first frame. NaN
        where it was not seen.
    rig
        See `observe`.
    lags : sequence of float or "synchronous", optional
        See `observe`. Synchronous are cameras that share a trigger: no other lags are tried, which
        takes most of the time where tracks are noisy, nor what mistake would make views agree.
    t : array_like, shape (n_0,), or a sequence of such
        Time of each frame of the first track, increasing; all cameras then have its frame rate. Or
        the times of each track by its own clock, if rates differ or frames are missing.
    names : sequence of str, optional
        What messages call the tracks.
    progress : bool, optional
        Whether progress bars are shown; by default after two seconds, if a person watches.

    Returns
    -------
    Observation

    Raises
    ------
    ValueError
        If the numbers of tracks, cameras and times disagree, or as `observe` does.
    """
    cameras.check_learnable(rig)
    raw = check_tracks(tracks, len(rig.cameras))
    if min(map(len, raw)) < 2:
        raise ValueError(f"tracks: must have two frames or more, got {[*map(len, raw)]}")
    clock = Clock.of_tracks(t, raw)
    called = [f"tracks[{i}]" for i in range(len(raw))] if names is None else names
    names = [str(name) for name in check_items("names", called, len(raw), "track")]
    for name, track, camera in zip(names, raw, rig.cameras, strict=True):
        seen = track[np.isfinite(track)]
        if not seen.size:
            raise ValueError(f"{name}: must see the target in some frame, got only NaN rows")
        if (np.abs(seen) <= 1).all():
            raise ValueError(
                f"tracks: must be in pixels, got {name} with all places between -1 and 1: if they "
                f"are shares of the image multiply them by its size, {camera.image_size}"
            )
        seen, size = track[np.isfinite(track).all(axis=1)], np.array(camera.image_size)
        beyond = np.maximum(-seen, seen - size)
        # Some places of a tracker may be wild, and some beyond the border by part of the target.
        if np.mean((beyond > _BEYOND * size).any(axis=1)) > _BEYOND:
            i = beyond.max(axis=1).argmax()
            raise ValueError(
                f"tracks: must lie in the image of their camera, image_size = {camera.image_size}, "
                f"got {name} with places such as ({seen[i, 0]:.5g}, {seen[i, 1]:.5g}): give the "
                "image_size of the video to the rig, or check which track is whose"
            )
    cleared = [without_wild(*each) for each in zip(raw, names, strict=True)]
    raw, said = [track for track, _ in cleared], [wild for _, wild in cleared]
    if isinstance(lags, str):
        check_choice("lags", lags, ["synchronous"])
        found = _observed(raw, rig, clock, np.zeros(len(raw)), names, synchronous=True)
    else:
        given = _check_lags(lags, clock, names)
        found = _observed(raw, rig, clock, given, names, progress=progress)
    return replace(found, rig=noted(found.rig, *said))


def _observed(
    raw: Sequence[Floats],
    rig: Rig,
    clock: Clock,
    lags: Floats | None,
    names: Sequence[str],
    doubts: Sequence[str] = (),
    progress: bool | None = None,
    synchronous: bool = False,
    before: Floats | int = 0,
) -> Observation:
    """What the tracks of videos of these names tell, with the tracker's doubts about them.

    The lags count from those before, which the tracks are aligned by.
    """
    for (i, one), (j, other) in combinations(enumerate(raw), 2):
        if np.array_equal(one, other, equal_nan=True):
            pair = f"{names[i]} and {names[j]} with the same places"
            message = f"tracks: must be of another film for each camera, got {pair}"
            raise Refused(message, "track", raw)
    films = Footage.of(raw, lags, clock.rates, clock.frames)
    rig, affine = cameras.paced(rig, clock.rates), None
    if not rig.is_measured:
        with refusing("cameras", raw, names):
            far = cameras.factorised(films, rig, lags is not None)
            if far is not None:
                tracks = replace(films, lags=far.lags.frames).aligned
                warnings = (*far.lags.warnings, *doubts)
                affine = _concluded(raw, tracks, far.rig, far.lags, clock, [], warnings, far.places)
                # Parallel projections of a plane tell of no lens.
                if len(far.variance) < 3 and not far.lags.warnings:
                    return affine
            for begun in [films.lags, *([far.lags.frames] if far and lags is None else [])]:
                try:
                    rig = cameras.posed(replace(films, lags=begun).aligned, rig, lags is not None)
                    break
                except ValueError as error:
                    failed = error
            else:
                if affine is None:
                    raise failed
                return affine
    first = list[str]()
    mistake = None if synchronous else cameras.find_mistake(films, rig, names)
    if synchronous:
        best = Lags(films.lags, films.rates, films.lags, 0.0, clocks=films.clocks)
    elif mistake is not None:  # and is put right, as nothing can be learned with it
        first, films, best, lags = [mistake.text], mistake.footage, mistake.lags, None
        rig = cameras.paced(mistake.rig, films.rates / clock.rates)
        raw, clock = films.tracks, clock.mended(films)
    else:
        with refusing("lags", raw, names):
            best = cameras.learn_lags(raw, rig, clock.rates, lags, clock.frames, progress=progress)
            if lags is not None and _apart(lags, best, 0.5):  # frames
                given, right = (cameras.list_lags(each + before) for each in (lags, best.frames))
                raise ValueError(
                    f"lags: must make the views agree, got ({given}) frames, none counting as 0, "
                    f"where ({right}) do: give those, or check the films"
                )
    told = best if lags is None else replace(best, frames=lags, errors=0 * lags, warnings=())
    tracks = replace(films, lags=told.frames, rates=best.rates).aligned
    with refusing("cameras", raw, names):
        learned = cameras.learn_cameras(tracks, rig)
        cleared, outliers = cameras.without_view_outliers(tracks, learned)
        if outliers.any():
            tracks, why = tuple(cleared), "which the other views contradict"
            each = zip(names, map(np.flatnonzero, outliers.T), strict=True)
            said = (left_out(name, why, rows) for name, rows in each)
            learned = noted(cameras.learn_cameras(cleared, rig), *said)
    missed = cameras.disagreement(tracks, learned)
    if affine is not None:  # pinholes are more unknowns than parallel projections
        left = max(cameras.disagreement(affine.tracks, affine.rig), default=0.0)
        if max(missed) * (cameras.BETTER if lags is None else 1.0) > left:  # and lags are more
            return affine
    if lags is not None:
        told = replace(told, residual=max(missed))
    if len(raw) == 2:
        learned = noted(learned, "two views do not show whether a camera was measured wrong")
    modes = cameras.systematic_errors(raw, rig, learned, told)
    disagreeing = _rig_warnings(missed, tracks, rig, learned, names, told.frames, best)
    warnings = (*first, *disagreeing, *learned.warnings, *doubts, *told.warnings)
    return _concluded(raw, tracks, learned, told, clock, modes, warnings)


def _concluded(
    raw: Sequence[Floats],
    tracks: tuple[Floats, ...],
    rig: Rig,
    lags: Lags,
    clock: Clock,
    modes: Iterable[Floats],
    warnings: tuple[str, ...],
    places: Callable[[Sequence[Floats]], Floats] | None = None,
) -> Observation:
    """The path that cameras have seen which are known now; by default as `cameras.reconstruct`.

    Its errors are the modes and what the tracks of all frames share.
    """
    motion = [_smoothed(clock.times, track) for track in tracks]
    errors = np.stack([*modes, *cameras.tracking_errors(tracks, rig, motion, raw, places)])
    x = cameras.reconstruct(tracks, rig) if places is None else places(tracks)
    rig = cameras.paced(rig, 1 / clock.rates)
    return Observation(tracks, rig, lags, clock.times, x, errors, warnings)


def _several_observed(
    raw: Sequence[Floats],
    rig: Rig,
    clock: Clock,
    lags: Floats | None,
    names: Sequence[str],
    doubts: Sequence[str],
    progress: bool | None,
) -> Observation:
    """What the tracks (n_i, 2 k) of k targets tell: once told apart, they are one long track."""
    count, begun = raw[0].shape[1] // 2, np.zeros(len(raw)) if lags is None else lags
    each = zip(*(np.split(track, count, axis=1) for track in raw), strict=True)
    aligned = [Footage.of(one, begun, clock.rates, clock.frames).aligned for one in each]
    tracks = [np.hstack(views) for views in zip(*aligned, strict=True)]
    rig = cameras.paced(rig, clock.rates)
    with refusing("cameras", tracks, names):
        told, unsure = cameras.identify(tracks, rig)
    rows = [cameras.stacked(track, 2) for track in told]
    t, step = clock.times, np.diff(clock.times).min()
    later = (t[-1] - t[0] + 2 * step) * np.arange(count)[:, None]
    long = Clock.of_tracks((np.append(t, t[-1] + step) + later).ravel()[:-1], rows)
    seen = _observed(rows, rig, long, 0 * begun, names, (*doubts, *unsure), progress, before=begun)
    modes = [cameras.side_by_side(mode, count) for mode in seen.systematic]
    x = cameras.side_by_side(seen.x, count)
    lost = np.flatnonzero(np.isnan(x).any(axis=1))
    # The frames that its note names are those of the long track: it is left as it was given.
    note = noted(rig, left_out("the paths", "as no two views tell all targets apart", lost)).note
    return replace(
        seen,
        tracks=tuple(cameras.side_by_side(track, count) for track in seen.tracks),
        rig=cameras.paced(replace(seen.rig, note=note), 1 / clock.rates),
        lags=replace(seen.lags, frames=begun, rates=clock.rates),
        t=t,
        x=x,
        systematic=np.reshape(modes, (len(modes), len(t), 3 * count)),
    )


def _check_lags(lags: Sequence[float] | None, clock: Clock, names: Sequence[str]) -> Floats | None:
    """By how much each video starts later than the first, if that is given.

    Each must share half of the shorter one's time with the first.
    """
    if lags is None:
        return None
    given = check_vector("lags", lags, len(names))
    given -= given[0]
    frames, ends = [len(one) for one in clock.frames], clock.ends
    common = np.minimum(given + ends, ends[0]) - np.maximum(given, 0)
    few = common < np.minimum(ends, ends[0]) / 2
    if few.any():
        i = int(few.argmax())
        raise ValueError(
            "lags: every video must have half of the shorter of the two in common with the first "
            f"({frames[0]} frames), got {given[i]:g} for {names[i]} ({frames[i]} frames)"
        )
    return given


def _check_several(
    targets: int, rig: Rig | None, detector: str | os.PathLike, hints: Sequence[Hint | None]
) -> None:
    """That several targets can be told apart."""
    known = len(rig.cameras) if rig is not None and rig.is_measured else 0
    if known < 3:
        raise ValueError(
            f"targets: {targets} need three cameras of known places and directions, got {known} "
            "of known ones"
        )
    if detector != "auto" or any(hints):
        raise ValueError(
            f"targets: {targets} are found by detector='auto' alone, without hints, got "
            f"detector={shown(detector)}, hints={shown(hints)}"
        )


def _smoothed(t: Floats, values: Floats) -> Floats:
    """What (n, k) values that change with the motion would be without the noise of its frames."""
    clean, rng = values.copy(), np.random.default_rng(0)
    seen = np.flatnonzero(np.isfinite(values).all(axis=1))
    for stretch in np.split(seen, np.flatnonzero(np.diff(seen) > 1) + 1):
        if len(stretch) >= 8:  # frames, from which its curve can be told from noise
            curve = dynamics.smooth([(t[stretch], values[stretch])], rng).splines[0]
            clean[stretch] = curve(t[stretch])
    return clean


def tracked(
    path: Path, frames: int, detector: str | os.PathLike, hint: Hint | None, targets: int = 1
) -> tuple[vision.Track, ...]:
    """The tracks of the targets of a video that should have so many frames.

    Raises
    ------
    ValueError
        If fewer can be read.
    """
    one = targets == 1
    found = (vision.track(path, detector, hint),) if one else vision.track_targets(path, targets)
    if len(found[0].pixels) != frames:
        raise ValueError(
            f"paths: {path.name} must hold the {frames} frames that its header states, got "
            f"{len(found[0].pixels)} that can be read: the file is cut off or damaged, or its "
            "header wrong"
        )
    return found


def noted(rig: Rig, *more: str) -> Rig:
    """The rig with more in its note."""
    return replace(rig, note="; ".join(filter(None, (rig.note, *more))))


def left_out(name: str, why: str, rows: Sequence[int] | Ints) -> str:
    """What to note of frames of a track that do not count; nothing of none."""
    if not len(rows):
        return ""
    runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    told = [f"{run[0]} to {run[-1]}" if len(run) > 1 else str(run[0]) for run in runs]
    return f"left out of {name}, {why}: frames {', '.join(told[:5])}{', ...' * (len(told) > 5)}"


def without_wild(track: Floats, name: str) -> tuple[Floats, str]:
    """A track, (n, 2), without single places that are far from a smooth path; and which these were.

    Without such a place those beside it are on one path, as they are not where a target bounces.
    """
    kept = seen = np.flatnonzero(np.isfinite(track).all(axis=1))
    most, wild, limit = len(seen) // 10, list[int](), _most_missed(_off_neighbours(seen, track))
    while len(seen) <= len(kept) + most and ((apart := _off_neighbours(kept, track)) > limit).any():
        highest = sliding_window_view(np.pad(apart, 4), 9).max(axis=1)
        # The first three miss the same neighbours, by the same, and so do the last three.
        kept = kept[(apart <= limit) | (apart < (1 - 1e-9) * highest)]
    order = np.searchsorted(seen, np.setdiff1d(seen, kept))
    gaps = np.diff(order, prepend=-2, append=len(seen) + 1)
    for row in seen[order[(gaps[:-1] > 1) & (gaps[1:] > 1)]].tolist() if len(order) <= most else ():
        near = np.sort(kept[np.argsort(np.abs(kept - row))[:10]])
        back = np.sort(np.append(near, row))
        own = _off_neighbours(back, track)[np.searchsorted(back, row)]
        if own > 5 * _off_neighbours(near, track).max():
            wild.append(row)
    cleared = track.copy()
    cleared[wild] = np.nan
    return cleared, left_out(name, "far from their neighbours", wild)


def kinks(track: Floats) -> Ints:
    """Frames at which a track, (n, 2), turns as no smooth motion does: it bounces, or is hit."""
    seen = np.flatnonzero(np.isfinite(track).all(axis=1))
    missed = _off_neighbours(seen, track)
    return seen[missed > _most_missed(missed)]


def _most_missed(missed: Floats) -> float:
    """By how much a place of a smooth motion may miss its neighbours, of what all do."""
    return max(8.0 * float(np.median(missed)), cameras.GROSS) if len(missed) >= 10 else np.inf


def _off_neighbours(rows: Ints, track: Floats) -> Floats:
    """By how much places of a track miss the cubic through the four beside each, over its noise."""
    if len(rows) < 5:
        return np.zeros(len(rows))
    return np.pad(np.linalg.norm(vision.bends(rows, track[rows]), axis=1), 2, mode="edge")


def check_found(
    tracks: Sequence[Floats], names: Sequence[str], targets: int, told: Sequence[Sequence[str]] = ()
) -> None:
    """That each video shows its targets: all are tracked first, so that all can be looked at.

    What is told of each film says why it does not.

    Raises
    ------
    Refused
        If one does not.
    """
    wanted = "one moving target" if targets == 1 else f"{targets} moving targets"
    still = ("what moves by less than a tenth of its own width is taken for background; a box "
             "around the one target in one frame shows it: --hint, pick, vl.Hint")  # fmt: skip
    for i, (pixels, name) in enumerate(zip(tracks, names, strict=True)):
        if (found := int(np.isfinite(pixels).any(axis=0).sum()) // 2) < targets:
            why = f": {'; '.join((*told[i], still))}" if told else ""
            got = f"got {found or 'none'} in any frame{why}"
            raise Refused(f"paths: {name} must show {wanted}, {got}", "track", tracks)


def _apart(lags: Floats, learned: Lags, limit: float) -> bool:
    """Whether lags differ clearly, and by more than so many frames, from those of the tracks."""
    apart = np.abs(learned.frames - lags) > limit + 5 * learned.errors
    return learned.agree and bool(apart.any())


def _rig_warnings(
    missed: Sequence[float],
    tracks: Sequence[Floats],
    given: Rig,
    learned: Rig,
    names: Sequence[str],
    lags: Floats,
    best: Lags,
) -> list[str]:
    """Do the cameras agree on the target to within what tracking can be blamed for?

    They miss it by `missed` pixels. The tracks are those at the lags, `best` are the lags that the
    tracks themselves tell.
    """
    told, worst, where = f"({cameras.list_lags(best.frames)})", max(missed), ""
    few = worst <= cameras.GROSS
    if _apart(lags, best, 0.02):  # frames, too few to refuse them
        if worst <= cameras.DISAGREEMENT:
            return [
                "the lags that are given differ from those of the tracks: "
                f"({cameras.list_lags(lags)}) for {told} frames: give those, or check"
            ]
        advice, where = f"the lags {told} would explain it best", " at the lags that are given"
    elif (why := cameras.explain(tracks, given, learned)) is not None and (
        few or why.left <= max(cameras.GROSS / 2, worst / 3)
    ):
        advice = f"{why.text(names)} would explain it best"
    elif not few and (alone := _contradicted(tracks, given)) is not None:
        advice = f"without {names[alone]} the others agree: check what it shows, or leave it out"
    elif not few and cameras.smooth(tracks, learned):
        advice = (
            "no single cause explains it; check the positions and normals, the scales and angles "
            "that are given, and that at least half of the shortest video is in common with the "
            "others; what was measured by hand needs its errors in the rig file, as a number "
            "without one is exact: normal_error = 2, position_error = 0.03 (if in metres), "
            "scale_error = 0.03"
        )
    else:
        return []
    sizes = ", ".join(f"{size:.1f}" for size in missed)
    return [
        f"the rig does not agree with the tracks{where}: in one frame of ten, tracked and "
        f"reconstructed target lie more than {sizes} pixels apart: {advice}"
    ]


def _contradicted(tracks: Sequence[Floats], given: Rig) -> int | None:
    """The one of four or more tracks without which the others agree, if there is one."""
    left = {}
    for i in range(len(tracks)) if len(tracks) > 3 else ():
        others = [j for j in range(len(tracks)) if j != i]
        with suppress(ValueError):
            rest, rig = [tracks[j] for j in others], Rig(tuple(given.cameras[j] for j in others))
            left[i] = max(cameras.disagreement(rest, cameras.learn_cameras(rest, rig)))
    best = min(left, key=lambda i: left[i], default=-1)
    return best if left.get(best, np.inf) <= cameras.GROSS / 2 else None


# ---------------------------------------------------------------------------------------- the law

#: Spread across a plane or a line, over the errors of places, up to which a motion stays in it.
STILL = 1.5


@dataclass(frozen=True, eq=False, repr=False)
class VideoDiscovery(Observation):
    """An observation and the law that it obeys; its warnings are those of both.

    Parameters
    ----------
    discovery : Discovery
        The law in the frame of the rig and in its own, sparsest frame; in other axes if these were
        learned.
    circle : Round, optional
        Where the target is bound to a circle, and no law was asked for: then the law is that of the
        angle on it.
    """

    discovery: Discovery
    circle: Round | None = None

    @property
    def fitted(self) -> Floats:
        """The path that obeys the law, in the shape of ``x`` and with a fraction of its noise.

        In gaps, too, across which the law leads; NaN elsewhere.
        """
        curve, turn = self.discovery.curve(self.t), self.turn
        if self.circle is not None:
            away = np.hstack([np.cos(curve[:, :1]), np.sin(curve[:, :1])]) @ self.circle.axes
            return self.circle.centre + self.circle.radius * away
        still = np.nanmean(self.x - self.x @ turn.T @ turn, axis=0)  # of what the law does not move
        return curve[:, : len(turn)] @ turn + still

    @property
    def turn(self) -> Floats:
        """Axes of the law in those of ``x``, (m, d), one a row."""
        law = self.discovery.system
        own = np.eye(law.states // law.order, self.x.shape[1])
        return own if self.discovery.orientation is None else self.discovery.orientation

    @property
    def swing(self) -> Swing | None:
        """The circle to which the target is bound, and the law of its angle; None elsewhere."""
        return Swing(self.circle, self.discovery) if self.circle else self.discovery.swing

    @property
    def g(self) -> Quantity | None:
        """The pull of gravity on what flies, or swings on a circle; None of other motions."""
        if self.swing is not None:
            return self.swing.g
        return next((q for q in self.discovery.physics() if q.name == "g"), None)

    @property
    def period(self) -> Quantity | None:
        """Of small swings: of the coordinate or mode that moves most; None if nothing swings."""
        said = [q for q in self.discovery.physics() if q.name.startswith("period")]
        return min(said, key=lambda q: self._left_of(float(q.value)), default=None)

    def _left_of(self, period: float) -> float:
        """Squares that oscillations of one period leave of the path."""
        seen = np.isfinite(self.x[:, 0])
        phase = 2 * np.pi * self.t[seen] / period
        waves = np.column_stack([np.ones_like(phase), np.cos(phase), np.sin(phase)])
        left = self.x[seen] - waves @ np.linalg.lstsq(waves, self.x[seen], rcond=None)[0]
        return float((left**2).sum())

    @property
    def driven(self) -> str:
        """Which of several targets drive which others, and by what terms; empty for one target."""
        return _driven(self.discovery.system) if self.targets > 1 else ""

    def __str__(self) -> str:
        warnings = (f"warning: {text}" for text in self.warnings)
        notes = [f"frame: {self.rig.note}"] if self.rig.note else []
        notes += [f"targets: {self.driven}"] if self.driven else []
        told = []
        if self.circle is not None:
            radius = f"{self.circle.radius:.4g} ± {self.circle.radius_error:.2g}"
            told = [f"on a circle of radius {radius}" + (f"; {self.g}" if self.g else "")]
        return "\n".join([*told, self.discovery.statement(), *notes, *warnings])


def discover_from_videos(
    paths: Sequence[str | Path],
    rig: Rig | None = None,
    t: ArrayLike | None = None,
    *,
    lags: Sequence[float] | None = None,
    detector: str | os.PathLike = "auto",
    hints: Sequence[Hint | None] | None = None,
    targets: int = 1,
    degree: int | None = None,
    library: Library | None = None,
    order: int | str = "auto",
    origin: str = "learn",
    orientation: str = "data",
    seed: int = 0,
    progress: bool | None = None,
) -> VideoDiscovery:
    """Discover the governing equations of a target filmed by several fixed cameras.

    This is `observe`, then `discover` on the path that it reconstructs.

    Parameters
    ----------
    paths, rig, t, lags, detector, hints, targets, progress
        See `observe`. The unit of time is that of the equations. The law of several targets is one
        for all: x1, x2, x3 are the place of the first, x4, x5, x6 of the second, and so on.
    degree, library, order, origin, orientation, seed
        See `discover`.

    Returns
    -------
    VideoDiscovery

    Raises
    ------
    FileNotFoundError, ValueError
        See `observe` and `discover`. What can be told before a video is tracked is.
    """
    check_integer("targets", targets, least=1)
    law = law_options(degree, library, order, origin, orientation, seed, progress, 3 * targets)
    seen = observe(
        paths, rig, t, lags=lags, detector=detector, hints=hints, targets=targets,
        progress=progress,
    )  # fmt: skip
    return with_law(seen, [Path(path).name for path in paths], law)


def discover_from_tracks(
    tracks: Sequence[ArrayLike | str | os.PathLike],
    rig: Rig,
    t: ArrayLike | Sequence[ArrayLike] | None = None,
    *,
    fps: float | None = None,
    individual: str | None = None,
    lags: Sequence[float] | str | None = None,
    degree: int | None = None,
    library: Library | None = None,
    order: int | str = "auto",
    origin: str = "learn",
    orientation: str = "data",
    seed: int = 0,
    progress: bool | None = None,
) -> VideoDiscovery:
    """Discover the governing equations of a target from tracks that are there already.

    This is `observe_tracks`, then `discover` on the path that it reconstructs.

    Parameters
    ----------
    tracks : sequence of array_like, shape (n_i, 2), or of path
        Pixels of the target, one track per camera of the rig, NaN where it was not seen; or text
        files of them, as DLTdv, Argus, Tracker (OSP), Kinovea, TrackMate, DeepLabCut, SLEAP,
        detectors of boxes and this package write them. A file may hold the tracks of several
        cameras.
    rig, t, lags
        See `observe_tracks`.
    fps : float, optional
        Frames of every camera in one unit of time, in place of ``t``, which takes the times of
        each. Without either, files have to state the times of their rows.
    individual : str, optional
        Which of several targets of the files, by its name there; see `read_tracks`.
    degree, library, order, origin, orientation, seed, progress
        See `discover_from_videos`.

    Returns
    -------
    VideoDiscovery

    Raises
    ------
    FileNotFoundError, ValueError
        If a file is missing or holds no track, if times are given twice or not at all, or as
        `observe_tracks` and `discover` do.
    """
    law = law_options(degree, library, order, origin, orientation, seed, progress)
    check_instance("rig", rig, Rig)
    read = _read(tracks, rig, individual)
    names, pixels = [track.name for track in read], [track.pixels for track in read]
    times, doubts = times_of(read, t, fps)
    seen = observe_tracks(pixels, rig, times, lags=lags, names=names, progress=progress)
    doubts = [*(warning for track in read for warning in track.warnings), *doubts]
    seen = replace(seen, warnings=(*seen.warnings, *doubts))
    return with_law(seen, names, law)


def law_options(
    degree: int | None,
    library: Library | None,
    order: int | str,
    origin: str,
    orientation: str,
    seed: int,
    progress: bool | None,
    coordinates: int = 3,
) -> dict[str, Any]:
    """What `discover` takes beside the path, checked before anything is tracked."""
    terms = dynamics.check_library(degree, library)
    dynamics.check_order(order, origin)
    dynamics.check_orientation(orientation, terms, coordinates, origin)
    dynamics.Form.of(dynamics.variable_names(coordinates), terms, 2 if order == 2 else 1)
    return {
        "degree": degree, "library": library, "order": order, "origin": origin,
        "orientation": orientation, "seed": check_integer("seed", seed), "progress": progress,
    }  # fmt: skip


def _driven(law: dynamics.PolynomialSystem) -> str:
    """Which of several targets, of three coordinates each, drive which others by what terms."""
    target = np.arange(law.d) % (law.d // law.order) // 3 + 1  # of places, and of velocities
    by: dict[tuple[int, int], list[str]] = {}
    for j, side in law.sides().items():
        for row in np.flatnonzero(law.support[:, j]):
            for other in set(target[law.exponents[row, : law.d] > 0]) - {target[j]}:
                pair = int(other), int(target[j])
                by.setdefault(pair, []).append(f"{law.terms[row]} in {side}")
    free = [str(i) for i in np.unique(target) if all(i != driven for _, driven in by)]
    said = [f"{i} drives {j} by {', '.join(terms)}" for (i, j), terms in sorted(by.items())]
    alone = f"{' and '.join(free)} {'moves' if len(free) == 1 else 'move'} independently"
    return "; ".join([alone] * bool(free) + said)


def _read(
    tracks: Sequence[ArrayLike | str | os.PathLike], rig: Rig, individual: str | None
) -> list[TrackFile]:
    """All tracks, those of files read, v down in the images of the rig."""
    read: list[TrackFile] = []
    for given in check_items("tracks", tracks, of="camera"):
        if isinstance(given, str | os.PathLike):
            read += vision.read_tracks(given, individual)
        else:
            name = f"tracks[{len(read)}]"
            if individual is not None:
                raise ValueError(
                    f"individual: must be given with files of tracks alone, got {name} as numbers"
                )
            read.append(TrackFile(name, check_rows(name, cast("ArrayLike", given), 2), None))
    # Files that count frames from the start of their videos may begin at different ones.
    first = min((track.start for track in read), default=0)
    for i, (one, camera) in enumerate(zip(read, rig.cameras, strict=False)):
        pixels, rows = one.downwards(camera.image_size[1]), ((one.start - first, 0), (0, 0))
        read[i] = replace(one, pixels=np.pad(pixels, rows, constant_values=np.nan))
    return read  # another number of tracks than of cameras is refused where they are observed


def times_of(
    read: Sequence[TrackFile], t: ArrayLike | Sequence[ArrayLike] | None, fps: float | None
) -> tuple[ArrayLike | Sequence[ArrayLike], list[str]]:
    """The times that are given, or those that files state; and which files contradict them."""
    if t is not None and fps is not None:
        raise ValueError(f"fps: must not be given with t, got {shown(fps)}")
    if t is not None:
        return t, []
    stated = [(track.name, track.t) for track in read if track.t is not None]
    if fps is None:
        if len(stated) < len(read):
            name = next(track.name for track in read if track.t is None)
            raise ValueError(f"fps: must be given, or times, as {name} states none")
        return [times for _, times in stated], []
    given = check_positive("fps", fps)
    rates = [(name, 1 / np.median(np.diff(times))) for name, times in stated if len(times) > 1]
    doubts = [
        f"fps: {given:g} frames in a unit of time are taken as given, though {name} states "
        f"{rate:.4g}"
        for name, rate in rates if abs(rate / given - 1) > 1e-3
    ]  # fmt: skip
    return [np.arange(len(track.pixels)) / given for track in read], doubts


def with_law(seen: Observation, names: Sequence[str], law: dict[str, Any]) -> VideoDiscovery:
    """An observation with the law that it obeys, given what else `discover` takes.

    In a frame that is any affine map of space, the default is a law that is linear in any other.

    Parameters
    ----------
    seen : Observation
    names : sequence of str
        What messages call the tracks.
    law : dict
        See `law_options`.
    """
    default = all(law[name] in (None, "auto") for name in ("degree", "library", "order"))
    affine = isinstance(seen.rig.cameras[0], cameras.AffineCamera)
    law = law | ({"degree": 1, "order": 2} if default and affine else {})
    reach = np.nanmax(seen.x, axis=0) - np.nanmin(seen.x, axis=0)
    moves = reach > 1e-9 * reach.max()  # but for rounding; others are at rest
    with refusing("law", seen.tracks, names):
        if not moves.any():
            raise ValueError("tracks: must show a target that moves, got one that stands still")
        left, pixels = np.hstack(seen.residuals), np.hstack(seen.tracks)
        left = left[np.isfinite(left)]  # none of one camera
        share = (left @ left) / max(len(left), 1) / np.nanvar(pixels, axis=0).mean()
        apart = float(np.sqrt(share))
        x, modes, circle = seen.x[:, moves], seen.systematic[..., moves], None
        if default and seen.targets == 1 and not affine:  # there no circle is one, and no pull g
            found, circle = simplest(seen.t, x, modes, law, apart)
        elif seen.targets == 1 and law["library"] is None:
            found = _where_it_moves(seen.t, x, modes, law, apart)
        else:
            found = dynamics.discover(seen.t, x, systematic=modes, **law)
    if affine:
        found = replace(found, force="pull", swing=None)
    axes = np.eye(len(moves))[moves]
    if circle is not None:
        spread = axes.T @ circle.centre_covariance @ axes
        centre, around = circle.centre @ axes, circle.axes @ axes
        circle = replace(circle, centre=centre, centre_covariance=spread, axes=around)
    elif found.orientation is not None:
        found = replace(found, orientation=found.orientation @ axes)
    elif not moves[: len(axes)].all():  # else they are the first, as a law's are
        found = replace(found, orientation=axes)
    body = found.physics() if default else ()
    losses = [q for q in body if q.name.startswith(("damping", "drag"))]
    if grows := [str(q) for q in losses if (q.value + 4 * q.error < 0).all()]:
        doubt = f"{', '.join(grows)}: what nothing drives loses energy; the film may run backwards"
        found = replace(found, warnings=(*found.warnings, doubt))
    # Who keeps the law alone keeps the doubts about what it was found in.
    found = replace(found, warnings=(*seen.warnings, *found.warnings))
    said = vars(seen) | {"warnings": found.warnings}
    return VideoDiscovery(**said, discovery=found, circle=circle)


def simplest(
    t: Floats, x: Floats, modes: Floats, law: dict[str, Any], apart: float = 0.0
) -> tuple[Discovery, Round | None]:
    """Of nested laws of a body the simplest that the data bear.

    Forces that are the same everywhere; where the body is bound to a plane or a line, linear ones
    along it, and on a circle the law of the angle, which is given with the circle; else any other.

    Parameters
    ----------
    t : ndarray, shape (n,)
    x : ndarray, shape (n, m)
        Places, a row with a NaN where they are not known.
    modes : ndarray, shape (k, n, m)
        Errors that all places share.
    law : dict
        What else `discover` takes.
    apart : float
        See `directions`.
    """
    rows = np.isfinite(x).all(axis=1)
    names = dynamics.variable_names(x.shape[1])
    flight = dynamics.homogeneous(t[rows], x[rows], names, modes[:, rows])
    if flight is not None:
        return flight, None
    found = _where_it_moves(t, x, modes, law, apart, degree=1, order=2)
    swing = found.swing
    if swing is None:
        return found, None
    axes = np.eye(x.shape[1]) if found.orientation is None else found.orientation
    circle = dynamics.on_circle(x, swing.circle.axes[0] @ axes, modes)
    found, names = swing.law, swing.law.system.names[:1]
    angle, shared = circle.angle[rows, None], np.asarray(circle.systematic)[:, rows]
    turning = dynamics.homogeneous(t[rows], angle, names, shared)
    found = found if turning is None or turning.warnings else turning
    return replace(found, warnings=(*circle.warnings, *found.warnings)), circle


def _where_it_moves(
    t: Floats, x: Floats, modes: Floats, law: dict[str, Any], apart: float, **bound: int
) -> Discovery:
    """The law along the `directions` in which a path moves; ``bound`` holds of one or two."""
    rows = np.isfinite(x).all(axis=1)
    axes = directions(t[rows], x[rows], apart)
    asked = law | (bound if len(axes) < 3 else {})
    found = dynamics.discover(t, x @ axes.T, systematic=modes @ axes.T, **asked)
    if np.array_equal(axes, np.eye(x.shape[1])):
        return found
    own = np.eye(len(axes)) if found.orientation is None else found.orientation
    return replace(found, orientation=own @ axes)


def directions(t: Floats, x: Floats, apart: float = 0.0) -> Floats:
    """Orthonormal directions, (k, d), along which a path, (n, d), moves, and near the axes.

    A spread of hardly more than their errors is none: these are the noise, or the share of the
    motion by which views disagree if that is more, as smooth errors are in no estimate of noise.
    """

    def moves(axes: Floats) -> Bools:
        along = x @ axes.T
        noise, spread = dynamics.smooth([(t, along)], np.random.default_rng(0)).noise, along.std(0)
        errors = np.maximum(noise, max(apart, dynamics.CLOSE) * spread.max())
        return np.asarray(spread > STILL * errors)

    axes = np.eye(x.shape[1])
    if not (along := moves(axes)).any():  # all of it is noise
        return axes
    axes = axes[along]
    _, _, own = np.linalg.svd((x - x.mean(axis=0)) @ axes.T, full_matrices=False)
    own = own[moves(own @ axes)]
    if len(own) in (0, len(axes)):
        return axes
    nearest = np.sort(qr(own, pivoting=True)[2][: len(own)])
    u, _, v = np.linalg.svd(own[:, nearest])
    return (u @ v).T @ own @ axes


# ----------------------------------------------------------------------------------------- refusals


class _Ended(BaseException):
    """An exception that holds what there is already."""

    def __init__(self, message: str, step: str, tracks: Sequence[Floats]) -> None:
        super().__init__(message)
        self.step = step
        self.tracks = tuple(tracks)


class Refused(_Ended, ValueError):
    """Tracks from which no path or law can be had.

    Parameters
    ----------
    message : str
    step : {"track", "lags", "cameras", "law"}
        What could not be done.
    tracks : sequence of ndarray, shape (n_i, 2)
        Pixels of the target in each video up to there.
    """


class Stopped(_Ended, KeyboardInterrupt):
    """An interruption when there were tracks already; see `Refused`."""


@contextmanager
def refusing(step: str, tracks: Sequence[Floats], names: Sequence[str]) -> Iterator[None]:
    """What cannot be done in a step, as a refusal that says where to look first.

    And an interruption with the tracks, which took the longest.
    """
    try:
        yield
    except (Refused, Stopped):
        raise
    except KeyboardInterrupt:
        raise Stopped("stopped before there was a law", step, tracks) from None
    except ValueError as error:
        message = f"{error}; likely causes, in this order: {_likely_causes(step, tracks, names)}"
        raise Refused(message, step, tracks) from None


def _likely_causes(step: str, tracks: Sequence[Floats], names: Sequence[str]) -> str:
    """Tracker, lags and rig, with what the tracks say of the first."""
    strange = [
        name for track, name in zip(tracks, names, strict=True)
        if any(map(_is_strange, np.split(track, track.shape[1] // 2, axis=1)))
    ]  # fmt: skip
    tracker = "the tracker" + (f" (look at {', '.join(strange)})" if strange else "")
    if len(tracks) == 1:
        return tracker
    if strange:
        return f"{tracker}, the lags, the rig"
    return f"the lags, the rig, {tracker}" if step == "lags" else f"the rig, the lags, {tracker}"


def _is_strange(track: Floats) -> bool:
    """Whether a track jumps, trembles, stands still, or is mostly missing."""
    seen = np.isfinite(track).all(axis=1)
    steps, turns = (np.hypot(*np.diff(track, n, axis=0).T) for n in (1, 2))
    steps, turns = steps[np.isfinite(steps)], turns[np.isfinite(turns)]
    if not len(turns) or seen.mean() < 0.5:  # it may be of something else
        return True
    # More than one step in fifty is a jump, of eight times their median.
    jumps = np.mean(steps > 8.0 * max(np.median(steps), 1.0)) > 0.02
    still = np.ptp(track[seen], axis=0).max() < 2.0  # pixels
    return bool(jumps or still or np.median(turns) > np.median(steps))
