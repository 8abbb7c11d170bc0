"""The paper's experiments on synthetic videos, on the data protocol of the README.

A benchmark is simulated in the reference frame, filmed by three cameras around it, and discovered
from the video files, with only the first camera calibrated.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from joblib import Parallel, delayed
from tqdm import tqdm

from .cameras import Rig
from .metrics import Score, score, trajectory_error
from .pipeline import VideoDiscovery, discover_from_videos
from .systems import REFERENCE_OFFSET, SYSTEMS, Benchmark
from .video import Scene, render_video

SAMPLES_PER_PERIOD = 100
"""Frames in one characteristic period of a system: playback speed differs per system."""


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
    t: np.ndarray
    x: np.ndarray
    scenes: tuple[Scene, ...]

    @property
    def tracks(self) -> list[np.ndarray]:
        """True pixels of the target in each video, (n, 2) each."""
        return [camera.project(self.x) for camera in self.rig.cameras]


def film(
    name: str,
    folder: str | Path,
    frames: int = 1500,
    seed: int = 0,
    suffix: str = ".mkv",
    **disturbances,
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
    suffix : {".mkv", ".avi"}
        The same frames in small files (FFV1), or in files five times as large that are written and
        read in a third of the time (HFYU).
    **disturbances
        Fields of `Scene` common to all cameras, e.g. ``noise_variance=0.01``.

    Returns
    -------
    Film
    """
    if name not in SYSTEMS:
        raise ValueError(f"name: must be one of {', '.join(SYSTEMS)}, got {name!r}")
    truth = SYSTEMS[name].shift(REFERENCE_OFFSET)
    t, x = truth.trajectory(frames, SAMPLES_PER_PERIOD)
    rig = Rig.around(x)
    target, *views = np.random.SeedSequence(seed).spawn(1 + len(rig.cameras))
    drawn = Scene.random(np.random.default_rng(target))
    same = ("shape", "colour", "size", "shape_seed", "turns")
    common = {key: getattr(drawn, key) for key in same}
    paths, scenes = [], []
    for number, (camera, view) in enumerate(zip(rig.cameras, views, strict=True), start=1):
        draw, disturb = view.spawn(2)
        disturbance_seed = int(disturb.generate_state(1)[0])
        scene = Scene.random(np.random.default_rng(draw), **common | disturbances)
        path = Path(folder) / f"{name}_{number}{suffix}"
        render_video(path, camera.project(x), scene, seed=disturbance_seed)
        paths.append(path)
        scenes.append(scene)
    return Film(tuple(paths), rig, truth, t, x, tuple(scenes))


@dataclass(frozen=True)
class Result:
    """What came out of the videos of one benchmark.

    Parameters
    ----------
    name : str
    seed : int
    found : VideoDiscovery
    truth : Benchmark
        In the reference frame.
    score : Score
        Of ``found`` in the reference frame.
    pixel_error : tuple of float
        Root mean square distance of tracked and true pixels, per camera.
    position_error : ndarray, shape (3,)
        Root mean square error of the trajectory per axis, in scene units.
    seconds : float
        From video files to equations.
    """

    name: str
    seed: int
    found: VideoDiscovery
    truth: Benchmark
    score: Score
    pixel_error: tuple[float, ...]
    position_error: np.ndarray
    seconds: float

    def row(self) -> dict[str, object]:
        """A line of Table 1, in the paper's units."""
        return {
            "system": self.name,
            "terms found": "yes" if self.score.terms_found else "no",
            "false positives": self.score.false_positives,
            "l2 (e-2)": 100 * self.score.l2,
            "precision (%)": 100 * self.score.precision,
            "recall (%)": 100 * self.score.recall,
            "worst coefficient (%)": 100 * self.score.max_coefficient_error,
            "seconds": self.seconds,
        }


def discover_film(name: str, frames: int = 1500, seed: int = 0, **disturbances) -> Result:
    """Film a benchmark, forget all but the first calibration, and discover from the files.

    See `film` for the parameters; the video files are removed afterwards.
    """
    with TemporaryDirectory() as folder:
        shot = film(name, folder, frames, seed, suffix=".avi", **disturbances)
        began = time.perf_counter()
        found = discover_from_videos(shot.paths, shot.rig.uncalibrated(keep=0), shot.t)
        seconds = time.perf_counter() - began
    pixel_error = tuple(
        float(np.sqrt(np.nanmean(((seen - true) ** 2).sum(axis=1))))
        for seen, true in zip(found.tracks, shot.tracks, strict=True)
    )
    position_error = trajectory_error(found.x, shot.x).rmse
    return Result(
        name,
        seed,
        found,
        shot.truth,
        score(found, shot.truth),
        pixel_error,
        position_error,
        seconds,
    )


def discover_films(
    names: Iterable[str] = tuple(SYSTEMS), frames: int = 1500, seed: int = 0, jobs: int = 2
) -> list[Result]:
    """`discover_film` for several benchmarks, in parallel processes and with a progress bar."""
    names = list(names)
    work: Iterator[Result] = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(discover_film)(name, frames, seed) for name in names
    )
    return list(tqdm(work, total=len(names), desc="systems", unit="system"))
