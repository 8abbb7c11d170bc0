"""The paper's experiments on synthetic videos, as typed trials; protocol of the README.

A benchmark is simulated in the reference frame, filmed by three cameras around it, and its path
recovered from the video files, with only the first camera calibrated: a `Recording`. A `Trial`
takes such a path, adds noise or hides rows, and gives what is left to one method. Films and trials
are tasks of `sweeps.sweep`:

    films = sweep(record, [FilmTask("Lorenz", trial) for trial in range(5)])
    results = sweep(run_trial, grid(["Lorenz"], {"noise": (0, 0.1, 0.2)}, range(5)))

The number of a trial seeds all that is random in it: scenes, noise, gaps, and the method.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ..cameras import Rig, learn_cameras, reconstruct
from ..checks import check_integer
from ..dynamics import Discovery, PolynomialSystem, discover
from ..vision import Scene, render_video, track
from .baselines import BASELINES
from .corruption import add_noise, drop_blocks, drop_fibers
from .metrics import Score, pulls, score, trajectory_error
from .sweeps import remember
from .systems import REFERENCE_OFFSET, SYSTEMS, Benchmark

SAMPLES_PER_PERIOD = 100
"""Frames in one characteristic period of a system: playback speed differs per system."""

CORRUPTIONS: dict[str, Callable[[np.ndarray, float, np.random.Generator], np.ndarray]] = {
    "noise": add_noise,
    "blocks": drop_blocks,
    "fibers": drop_fibers,
}
"""What a condition does to a path, at a level that is a fraction."""
CONDITIONS = ("clean", *CORRUPTIONS)
METHODS: dict[str, Callable[..., Discovery | PolynomialSystem]] = {"ours": discover, **BASELINES}
RANDOM_METHODS = ("E-SINDy", "WeakSINDy", "Model-A")
"""The methods that draw random numbers and take a seed."""
SOURCES = ("videos", "whole pixels", "truth")
"""Where a path comes from: the tracks, the tracks rounded to whole pixels, or the simulation."""

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
    **disturbances
        Fields of `Scene` common to all cameras, e.g. ``noise_variance=0.01``.

    Returns
    -------
    Film
    """
    _check_choice("name", name, SYSTEMS)
    seed = check_integer("seed", seed)
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
        path = Path(folder) / f"{name}_{number}.mov"
        render_video(path, camera.project(x), scene, seed=disturbance_seed)
        paths.append(path)
        scenes.append(scene)
    return Film(tuple(paths), rig, truth, t, x, tuple(scenes))


@dataclass(frozen=True)
class FilmTask:
    """One film to be made and measured.

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
class Recording:
    """What the videos of one film gave, with all calibrations but the first forgotten.

    Parameters
    ----------
    task : FilmTask
    truth : Benchmark
        The system in the reference frame.
    tracks : tuple of ndarray, shape (n, 2)
        Pixels of the target in each video.
    rig : Rig
        The cameras as they were learned.
    t : ndarray, shape (n,)
        Time of each frame, in time units of the system.
    x : ndarray, shape (n, 3)
        Reconstructed path, scene units.
    pixel_error : tuple of float
        Root mean square distance of tracked and true pixels, per camera.
    path_error : ndarray, shape (3,)
        Root mean square error of the path along each axis, in scene units.
    seconds : float
        From video files to path.
    """

    task: FilmTask
    truth: Benchmark
    tracks: tuple[np.ndarray, ...]
    rig: Rig
    t: np.ndarray
    x: np.ndarray
    pixel_error: tuple[float, ...]
    path_error: np.ndarray
    seconds: float

    def path(self, source: str = "videos") -> np.ndarray:
        """The path from one of the `SOURCES`, shape (n, 3)."""
        _check_choice("source", source, SOURCES)
        if source == "videos":
            return self.x
        if source == "truth":
            return self.truth.simulate(self.t, self.truth.x0)
        tracks = [np.round(track) for track in self.tracks]
        return reconstruct(tracks, learn_cameras(tracks, self.rig.uncalibrated(keep=0)))


def record(task: FilmTask) -> Recording:
    """Film a benchmark, track it, learn the cameras and reconstruct; the videos are removed."""
    with TemporaryDirectory() as folder:
        shot = film(task.system, folder, task.frames, task.trial)
        began = time.perf_counter()
        tracks = tuple(track(path).pixels for path in shot.paths)
    rig = learn_cameras(tracks, shot.rig.uncalibrated(keep=0))
    x = reconstruct(tracks, rig)
    seconds = time.perf_counter() - began
    pixel_error = tuple(
        float(np.sqrt(np.nanmean(((seen - true) ** 2).sum(axis=1))))
        for seen, true in zip(tracks, shot.tracks, strict=True)
    )
    path_error = trajectory_error(x, shot.x).rmse
    return Recording(task, shot.truth, tracks, rig, shot.t, x, pixel_error, path_error, seconds)


@lru_cache(maxsize=64)
def recording(task: FilmTask) -> Recording:
    """The recording of a film: in memory, stored by an earlier sweep, or made now."""
    return remember(record, task)


@dataclass(frozen=True)
class Trial:
    """One method on one corrupted path.

    Parameters
    ----------
    system : str
        A key of `SYSTEMS`.
    condition : str
        One of `CONDITIONS`.
    level : float
        Standard deviation of the noise over that of each coordinate, or fraction of the rows that
        are hidden; 0 if, and only if, the condition is "clean".
    trial : int
        Number of the repetition, the seed of its film, corruption and method.
    method : str
        A key of `METHODS`.
    source : str
        One of `SOURCES`.
    frames : int
        Length of the film.

    Raises
    ------
    ValueError
        If a name is unknown or the level does not fit the condition.
    """

    system: str
    condition: str = "clean"
    level: float = 0.0
    trial: int = 0
    method: str = "ours"
    source: str = "videos"
    frames: int = 1500

    def __post_init__(self) -> None:
        _check_choice("system", self.system, SYSTEMS)
        _check_choice("condition", self.condition, CONDITIONS)
        _check_choice("method", self.method, METHODS)
        _check_choice("source", self.source, SOURCES)
        if not 0 <= self.level < np.inf or (self.level == 0) != (self.condition == "clean"):
            raise ValueError(
                "level: must be 0 in the condition 'clean' and above 0 in all others, "
                f"got {self.level} in {self.condition!r}"
            )

    @property
    def film(self) -> FilmTask:
        """The film that the path comes from."""
        return FilmTask(self.system, self.trial, self.frames)

    def corrupt(self, x: np.ndarray) -> np.ndarray:
        """Do to a path what the condition says; the same whatever the method and the source."""
        if self.condition == "clean":
            return x
        # The names and numbers themselves are the entropy: no trial depends on any other.
        place = f"{self.system} {self.condition}".encode()
        entropy = (*place, round(1e6 * self.level), self.trial)
        rng = np.random.default_rng(np.random.SeedSequence(entropy))
        return CORRUPTIONS[self.condition](x, self.level, rng)


@dataclass(frozen=True, eq=False)
class TrialResult:
    """What one method made of one corrupted path.

    Parameters
    ----------
    trial : Trial
    law : PolynomialSystem
        As found, in the reference frame.
    score : Score
        Of the law.
    sigma : ndarray, shape (3,)
        Standard deviation of the added noise, in scene units; 0 without noise.
    seconds : float
        From path to law.
    native_exact : bool or None
        Whether the law has exactly the true terms in its native frame; None for the methods that
        do not look for that frame.
    status : str or None
        ``"ok"`` or ``"suspect"``; None for the methods that do not say.
    warnings : tuple of str
    promised_l2 : float or None
        The relative l2 error that the standard errors of the coefficients amount to; None for the
        methods without standard errors.
    pulls : ndarray
        See `metrics.pulls`; empty for the methods without standard errors.
    """

    trial: Trial
    law: PolynomialSystem
    score: Score
    sigma: np.ndarray
    seconds: float
    native_exact: bool | None = None
    status: str | None = None
    warnings: tuple[str, ...] = ()
    promised_l2: float | None = None
    pulls: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def wrong_terms(self) -> int:
        """True terms that are missing and false ones that were found."""
        return self.score.missing + self.score.false_positives

    @property
    def verdict(self) -> str:
        """Is the law exact, and what did the method say of it: e.g. ``"wrong, suspect"``."""
        return f"{'exact' if self.score.exact else 'wrong'}, {self.status}"


def run_trial(trial: Trial) -> TrialResult:
    """Corrupt the path of a film and let a method find its law."""
    source = recording(trial.film)
    path = source.path(trial.source)
    x = trial.corrupt(path)
    sigma = trial.level * np.nanstd(path, axis=0) if trial.condition == "noise" else np.zeros(3)
    options = {"seed": trial.trial} if trial.method in RANDOM_METHODS else {}
    began = time.perf_counter()
    found = METHODS[trial.method](source.t, x, **options)
    seconds = time.perf_counter() - began
    if isinstance(found, PolynomialSystem):
        return TrialResult(trial, found, score(found, source.truth), sigma, seconds)
    return TrialResult(
        trial=trial,
        law=found.system,
        score=score(found, source.truth),
        sigma=sigma,
        seconds=seconds,
        native_exact=score(found.native, SYSTEMS[trial.system]).exact,
        status=found.status,
        warnings=found.warnings,
        promised_l2=float(
            np.linalg.norm(found.standard_errors) / np.linalg.norm(source.truth.coefficients)
        ),
        pulls=pulls(found, source.truth),
    )


def grid(
    systems: Iterable[str],
    levels: Mapping[str, Iterable[float]],
    trials: Iterable[int],
    methods: Iterable[str] = ("ours",),
    frames: int = 1500,
) -> list[Trial]:
    """Every combination, trial by trial of each film; a level of 0 is the condition "clean".

    Parameters
    ----------
    systems, trials, methods, frames
        See `Trial`.
    levels : mapping of str to iterable of float
        Levels of each condition.
    """
    cases = dict.fromkeys(
        (condition if level else "clean", float(level))
        for condition, values in levels.items()
        for level in values
    )
    systems, trials, methods = list(systems), list(trials), list(methods)
    return [
        Trial(system, condition, level, trial, method, frames=frames)
        for system in systems
        for trial in trials
        for condition, level in cases
        for method in methods
    ]


def select(results: Iterable[TrialResult], **fields) -> list[TrialResult]:
    """The results whose trials have these values, e.g. ``system="Lorenz", method="ours"``."""
    wanted = fields.items()
    return [r for r in results if all(getattr(r.trial, name) == value for name, value in wanted)]


def by_level(
    results: Sequence[TrialResult], condition: str, **fields
) -> dict[float, list[TrialResult]]:
    """The results of one condition by level, beginning with level 0, the clean ones."""
    chosen = select(results, condition="clean", **fields)
    chosen += select(results, condition=condition, **fields)
    levels = sorted({r.trial.level for r in chosen})
    return {level: [r for r in chosen if r.trial.level == level] for level in levels}


def _check_choice(name: str, value: str, known: Iterable[str]) -> None:
    if value not in known:
        raise ValueError(f"{name}: must be one of {', '.join(known)}, got {value!r}")
