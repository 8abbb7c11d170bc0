"""Films of the benchmark systems, and what `observe` makes of them.

A benchmark is simulated in the reference frame and filmed by three cameras around it; its path is
then recovered from the video files as a user's would be, with only the first camera calibrated::

    films = sweep(run_film, [FilmTask("Lorenz", trial) for trial in range(5)])
"""

import time
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..arrays import Floats
from ..cameras import Rig
from ..checks import check_choice, check_integer
from ..pipeline import Observation, observe
from ..vision import LearnedDetector, Scene, detections, read_video, render_video
from .metrics import trajectory_error
from .paper import REFERENCE_OFFSET, SYSTEMS, Benchmark
from .sweeps import remember

SAMPLES_PER_PERIOD = 100
"""Frames in one characteristic period of a system: playback speed differs per system."""
TOGETHER = (0.0, 0.0, 0.0)
"""The three videos of a film start at the same time, and whoever filmed them knows."""
WINDOW = 64
"""Side in pixels of the square in which the learned detector looks for the target of a film."""

_GRID = 16  # pixels; from one such step to the next the detector's anchors are where they were
_BATCH = 32  # windows that the detector sees at once

_SAME_TARGET = ("shape", "colour", "size", "shape_seed", "turns")  # fields of Scene


@dataclass(frozen=True)
class Film:
    """Three video files of one benchmark, and the truth behind them.

    Parameters
    ----------
    paths : tuple of Path
        One video per camera.
    rig : Rig
        The true cameras, all calibrated.
    truth : Benchmark
        The system in the reference frame.
    t : ndarray, shape (n,)
        Time of each frame, in time units of the system.
    x : ndarray, shape (n, 3)
        True positions in the reference frame.
    scenes : tuple of Scene
        What each camera sees.
    """

    paths: tuple[Path, ...]
    rig: Rig
    truth: Benchmark
    t: Floats
    x: Floats
    scenes: tuple[Scene, ...]

    @property
    def tracks(self) -> list[Floats]:
        """True pixels of the target in each video, (n, 2) each."""
        return [camera.project(self.x) for camera in self.rig.cameras]


def film(
    name: str, folder: str | Path, frames: int = 1500, seed: int = 0, **disturbances: Any
) -> Film:
    """Film a benchmark with three cameras against random backgrounds.

    Parameters
    ----------
    name : str
        A key of `SYSTEMS`.
    folder : path
        Where the video files go.
    frames : int
        Frames per camera.
    seed : int
        Of the scenes: one target (shape, colour, size) before three backgrounds.
    **disturbances
        Fields of `Scene` common to all cameras, e.g. ``noise_variance=0.01``.

    Returns
    -------
    Film

    Raises
    ------
    ValueError
        If the name or a disturbance is unknown, or a number is out of its range.
    """
    check_choice("name", name, SYSTEMS)
    seed = check_integer("seed", seed)
    truth = SYSTEMS[name].shift(REFERENCE_OFFSET)
    t, x = truth.trajectory(frames, SAMPLES_PER_PERIOD)
    rig = Rig.around(x)
    target, *views = np.random.SeedSequence(seed).spawn(1 + len(rig.cameras))
    drawn = Scene.random(np.random.default_rng(target))
    common = {key: getattr(drawn, key) for key in _SAME_TARGET} | disturbances
    paths, scenes = [], []
    for number, (camera, view) in enumerate(zip(rig.cameras, views, strict=True), start=1):
        draw, disturb = view.spawn(2)
        scenes.append(Scene.random(np.random.default_rng(draw), **common))
        paths.append(Path(folder) / f"{name}_{number}.mov")
        disturbance_seed = int(disturb.generate_state(1)[0])
        render_video(paths[-1], camera.project(x), scenes[-1], seed=disturbance_seed)
    return Film(tuple(paths), rig, truth, t, x, tuple(scenes))


@dataclass(frozen=True)
class FilmTask:
    """One film to be made and observed.

    Parameters
    ----------
    system : str
        A key of `SYSTEMS`.
    trial : int
        Seed of the scenes.
    frames : int
        Per camera.
    """

    system: str
    trial: int = 0
    frames: int = 1500


@dataclass(frozen=True, eq=False)
class FilmResult(Observation):
    """What the videos of one film gave, and how far that is from the truth.

    Parameters
    ----------
    task : FilmTask
    truth : Benchmark
        The system in the reference frame.
    pixel_error : tuple of float
        Root mean square distance of tracked and true pixels, per camera.
    path_error : ndarray, shape (3,)
        Root mean square error of the path along each axis, in scene units.
    seconds : float
        From video files to path.
    detected : tuple of ndarray, shape (n, 2)
        The learned detector's track in each video, see `detect_near`.
    """

    task: FilmTask
    truth: Benchmark
    pixel_error: tuple[float, ...]
    path_error: Floats
    seconds: float
    detected: tuple[Floats, ...]


def run_film(task: FilmTask) -> FilmResult:
    """Film a benchmark and observe it, with all calibrations but the first forgotten.

    Parameters
    ----------
    task : FilmTask

    Returns
    -------
    FilmResult
        The videos are removed.
    """
    with TemporaryDirectory() as folder:
        shot = film(task.system, folder, task.frames, task.trial)
        began = time.perf_counter()
        seen = observe(shot.paths, shot.rig.uncalibrated(keep=0), shot.t, lags=TOGETHER)
        seconds = time.perf_counter() - began
        detected = tuple(map(detect_near, shot.paths, seen.tracks))
    pixel_error = tuple(
        float(np.sqrt(np.nanmean(((track - true) ** 2).sum(axis=1))))
        for track, true in zip(seen.tracks, shot.tracks, strict=True)
    )
    return FilmResult(
        **vars(seen),
        task=task,
        truth=shot.truth,
        pixel_error=pixel_error,
        path_error=trajectory_error(seen.x, shot.x),
        seconds=seconds,
        detected=detected,
    )


def detect_near(path: Path, track: Floats) -> Floats:
    """Where the learned detector sees the target, frame by frame, near a track of it.

    It looks in a square of `WINDOW` pixels, cut from the frame along the grid of its anchors: what
    it says there is what it says in the whole frame to a tenth of a pixel (three, of the largest
    targets), in a tenth of the time.

    Parameters
    ----------
    path : path
        The video.
    track : ndarray, shape (n, 2)
        About where the target is, pixels; NaN where nobody knows.

    Returns
    -------
    ndarray, shape (n, 2)
        Pixels; NaN where the track is or nothing is seen.
    """
    found, detector = np.full(track.shape, np.nan), LearnedDetector()
    at, corners, windows = [], [], []
    for number, (frame, place) in enumerate(zip(read_video(path), track, strict=True)):
        if np.isfinite(place[0]):
            last = np.array(frame.shape[1::-1]) - WINDOW
            left, top = np.clip(_GRID * np.rint((place - WINDOW / 2) / _GRID), 0, last).astype(int)
            at.append(number)
            corners.append((left, top))
            windows.append(frame[top : top + WINDOW, left : left + WINDOW].copy())
    for first in range(0, len(at), _BATCH):
        batch = slice(first, first + _BATCH)
        seen = detector.predict_all(np.array(windows[batch]))
        for number, corner, predictions in zip(at[batch], corners[batch], seen, strict=True):
            if best := detections(predictions, most=1):
                found[number] = corner + best[0].centre
    return found


@lru_cache(maxsize=64)
def film_result(task: FilmTask) -> FilmResult:
    """The result of a film: in memory, stored by an earlier sweep, or made now."""
    return remember(run_film, task)
