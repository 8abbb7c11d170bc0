"""The paper's experiments on synthetic videos, as typed trials; protocol of docs/results.md.

A benchmark is simulated in the reference frame and filmed by three cameras around it; its path is
then recovered from the video files as a user's would be, with only the first camera calibrated::

    films = sweep(run_film, [FilmTask("Lorenz", trial) for trial in range(5)])

A `Trial` takes the tracks of a film, adds noise or hides rows, learns cameras and path from what is
left, and gives the path to one method::

    results = run_trials(grid(["Lorenz"], {"noise": (0, 0.1, 0.2)}, range(5), METHODS))

The number of a trial seeds all that is random in it: scenes, noise, gaps, and the methods that draw
numbers. All methods get the same data.

From results come frames, one row a trial (`tabulate`), and from these the rows of the paper's
tables (`summary`). A mean over five trials hangs on the worst of them: tables show medians with the
range beside them, and count by trial, for all methods alike.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..arrays import Floats
from ..cameras import Rig
from ..checks import check_choice, check_integer, check_number
from ..dynamics import Discovery, PolynomialSystem, discover
from ..pipeline import Observation, Refused, observe, observe_tracks
from ..vision import LearnedDetector, Scene, detections, read_video, render_video
from .corruption import add_noise, drop_blocks, drop_fibers
from .metrics import Score, pulls, score, trajectory_error
from .paper import REFERENCE_OFFSET, SYSTEMS, Benchmark
from .spline_ado import held_out_misfit, spline_ado
from .sweeps import remember, sweep

if TYPE_CHECKING:  # pandas is imported where a frame is made
    from pandas import DataFrame, Series

# -------------------------------------------------------------------------------------------- films

#: Frames in one characteristic period of a system: playback speed differs per system.
SAMPLES_PER_PERIOD = 100
#: Side in pixels of the square in which the learned detector looks for the target of a film.
WINDOW = 64

_GRID = 16  # pixels; from one such step to the next the detector's anchors are where they were
_BATCH = 32  # windows that the detector sees at once


@dataclass(frozen=True)
class Filmed:
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
) -> Filmed:
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
    Filmed

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
    same = ("shape", "colour", "size", "shape_seed", "turns")
    common = {key: getattr(drawn, key) for key in same} | disturbances
    paths, scenes = [], []
    for number, (camera, view) in enumerate(zip(rig.cameras, views, strict=True), start=1):
        draw, disturb = view.spawn(2)
        scenes.append(Scene.random(np.random.default_rng(draw), **common))
        paths.append(Path(folder) / f"{name}_{number}.mov")
        disturbance_seed = int(disturb.generate_state(1)[0])
        render_video(paths[-1], camera.project(x), scenes[-1], seed=disturbance_seed)
    return Filmed(tuple(paths), rig, truth, t, x, tuple(scenes))


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
        # The videos start at the same time, and whoever filmed them knows.
        seen = observe(shot.paths, shot.rig.uncalibrated(keep=0), shot.t, lags=(0, 0, 0))
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


# ------------------------------------------------------------------------------------------- trials

#: What a condition does to tracks or to a path, at a level that is a fraction.
CORRUPTIONS: dict[str, Callable[[Floats, float, np.random.Generator], Floats]] = {
    "noise": add_noise,
    "blocks": drop_blocks,
    "fibers": drop_fibers,
}
CONDITIONS = ("clean", *CORRUPTIONS)
#: `dynamics.discover`, the paper's own optimiser (`spline_ado`), and `baselines.BASELINES`.
METHODS = ("Gauss-Newton", "spline-ADO", "PySINDy", "E-SINDy", "WeakSINDy", "Model-A")
#: Where a path comes from, and what a condition is done to: tracks of the learned detector in whole
#: pixels (the paper's regime), and tracks of the film tracker, before cameras are learned from
#: them; the path that the latter give; or the simulation.
SOURCES = ("detector", "sub-pixel", "path", "truth")

#: Relative l2 error below which a few grey levels in the videos decide: tables give it as that.
LEAST = 1e-5


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
        Standard deviation of the noise over that of each coordinate (of the pixels, or of the path
        if that is the source), or fraction of the rows that are hidden, in each view anew; 0 if,
        and only if, the condition is "clean".
    trial : int
        Number of the repetition, the seed of its film, corruption and method.
    method : str
        One of `METHODS`.
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
    method: str = "Gauss-Newton"
    source: str = "detector"
    frames: int = 1500

    def __post_init__(self) -> None:
        check_choice("system", self.system, SYSTEMS)
        check_choice("condition", self.condition, CONDITIONS)
        check_choice("method", self.method, METHODS)
        check_choice("source", self.source, SOURCES)
        clean, gaps = self.condition == "clean", self.condition in ("blocks", "fibers")
        level = check_number("level", self.level)
        if level < 0 or (level == 0) != clean or (gaps and level >= 1):
            raise ValueError(
                "level: must be 0 in the condition 'clean', above 0 in all others, and a share of "
                f"the samples below 1 of blocks and fibers, got {self.level} in {self.condition!r}"
            )

    @property
    def film(self) -> FilmTask:
        """The film that the path comes from."""
        return FilmTask(self.system, self.trial, self.frames)

    def corrupt_each(self, paths: Sequence[Floats]) -> list[Floats]:
        """Do what the condition says to paths or tracks, to each by its own draw.

        It is the same whatever the method and the source.
        """
        if self.condition == "clean":
            return list(paths)
        # The names and numbers themselves are the entropy: no trial depends on any other.
        place = f"{self.system} {self.condition}".encode()
        entropy = (*place, round(1e6 * self.level), self.trial)
        rng = np.random.default_rng(np.random.SeedSequence(entropy))
        return [CORRUPTIONS[self.condition](x, self.level, rng) for x in paths]


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
    seconds : float
        Of processor time from path to law.
    status : str or None
        ``"ok"`` or ``"suspect"``, as `discover_from_tracks` says; None for the methods that do not
        say; ``"refused"`` for all of them where the cameras could not be learned.
    warnings : tuple of str
        Of the observation and of the law.
    promised_l2 : float or None
        The relative l2 error that the standard errors of the coefficients amount to; None for the
        methods without standard errors.
    pulls : ndarray
        See `metrics.pulls`; empty for the methods without standard errors.
    """

    trial: Trial
    law: PolynomialSystem
    score: Score
    seconds: float
    status: str | None = None
    warnings: tuple[str, ...] = ()
    promised_l2: float | None = None
    pulls: Floats = field(default_factory=lambda: np.empty(0))

    @property
    def wrong_terms(self) -> int:
        """True terms that are missing and false ones that were found."""
        return self.score.missing + self.score.false_positives

    @property
    def verdict(self) -> str:
        """Is the law exact, and what did the method say of it: e.g. ``"wrong, suspect"``."""
        return f"{'exact' if self.score.exact else 'wrong'}, {self.status}"


def run_trials(
    trials: Iterable[Trial], *, jobs: int = 2, desc: str = "trials"
) -> list[TrialResult]:
    """Run many trials in a `sweep`, see there."""
    return sweep(run_trial, trials, jobs=jobs, desc=desc)


def run_trial(trial: Trial) -> TrialResult:
    """Corrupt what was seen of a film and let a method find its law.

    Without cameras there is no path, and no method has a law: one without any term.
    """
    t, x, systematic, doubts = trial_path(trial)
    truth = SYSTEMS[trial.system].shift(REFERENCE_OFFSET)
    if not np.isfinite(x).any():
        nothing = replace(truth, coefficients=np.zeros_like(truth.coefficients))
        return TrialResult(trial, nothing, score(nothing, truth), 0.0, "refused", doubts)
    began = time.process_time()
    found = find_law(trial.method, t, x, systematic, trial.trial)
    seconds = time.process_time() - began
    if isinstance(found, PolynomialSystem):
        return TrialResult(trial, found, score(found, truth), seconds)
    promised = np.linalg.norm(found.standard_errors) / np.linalg.norm(truth.coefficients)
    warnings = (*doubts, *found.warnings)
    return TrialResult(
        trial,
        found.system,
        score(found, truth),
        seconds,
        status="suspect" if warnings else "ok",
        warnings=warnings,
        promised_l2=float(promised),
        pulls=pulls(found, truth),
    )


class TrialPath(NamedTuple):
    """The path that a trial is about: times (n,), states (n, 3), systematic errors, warnings."""

    t: Floats
    x: Floats
    systematic: Floats | None
    warnings: tuple[str, ...]


def trial_path(trial: Trial) -> TrialPath:
    """The data of a trial: what its condition leaves of what its film gave.

    Parameters
    ----------
    trial : Trial

    Returns
    -------
    TrialPath
        In the reference frame; the systematic errors are known where cameras were learned. Where
        the cameras cannot be learned from the tracks, all rows are missing and the warning says
        why.
    """
    return _path(replace(trial, method=METHODS[0]))


@lru_cache(maxsize=8)
def _path(trial: Trial) -> TrialPath:
    """The same data for one method after the other."""
    filmed = film_result(trial.film)
    if trial.source == "truth":
        path = filmed.truth.simulate(filmed.t, np.array(filmed.truth.x0))
        return TrialPath(filmed.t, trial.corrupt_each([path])[0], None, ())
    if trial.source == "path":
        (path,) = trial.corrupt_each([filmed.x])
        return TrialPath(filmed.t, path, filmed.systematic, filmed.warnings)
    whole = trial.source == "detector"
    tracks = trial.corrupt_each(filmed.detected if whole else filmed.tracks)
    tracks = [np.round(track) if whole else track for track in tracks]
    try:
        seen = observe_tracks(tracks, filmed.rig.uncalibrated(keep=0), filmed.t, lags="synchronous")
    except Refused as refusal:
        return TrialPath(filmed.t, np.full(filmed.x.shape, np.nan), None, (str(refusal),))
    return TrialPath(seen.t, seen.x, seen.systematic, seen.warnings)


def find_law(
    method: str,
    t: Floats,
    x: Floats,
    systematic: Floats | None,
    seed: int,
    degree: int = 3,
    origin: str = "learn",
) -> Discovery | PolynomialSystem:
    """What a method finds in one record.

    Only Gauss-Newton can use what is known of systematic errors, and looks for the law's origin,
    which it can be told.
    """
    if method == "Gauss-Newton":
        return discover(
            t, x, degree=degree, systematic=systematic, order=1, origin=origin,
            time_limit=None,  # or results would depend on what else the machine does
        )  # fmt: skip
    if method == "spline-ADO":
        return spline_ado(t, x, degree, seed).system
    from .baselines import BASELINES  # pysindy takes seconds to import

    drawn = {} if method == "PySINDy" else {"seed": seed}
    return BASELINES[method](t, x, degree, **drawn)


@dataclass(frozen=True)
class Weights:
    """Pairs of weights of spline-ADO to be judged on the data of a trial.

    Parameters
    ----------
    trial : Trial
    pairs : tuple of tuple of float
        ``physics_weight`` and ``sparsity_weight`` of each, see `spline_ado.SplineADOSettings`.
    """

    trial: Trial
    pairs: tuple[tuple[float, float], ...]


def run_weights(weights: Weights) -> list[float]:
    """The misfit of held-out samples with each pair, see `spline_ado.held_out_misfit`."""
    path, seed = trial_path(weights.trial), weights.trial.trial
    return [
        held_out_misfit(path.t, path.x, seed, physics_weight=alpha, sparsity_weight=beta)
        for alpha, beta in weights.pairs
    ]


def grid(
    systems: Iterable[str],
    levels: Mapping[str, Iterable[float]],
    trials: Iterable[int],
    methods: Iterable[str] = METHODS[:1],
    frames: int = 1500,
    source: str = "detector",
) -> list[Trial]:
    """Every combination, trial by trial of each film; a level of 0 is the condition "clean".

    Parameters
    ----------
    systems, trials, methods, frames, source
        See `Trial`.
    levels : mapping of str to iterable of float
        Levels of each condition.
    """
    cases = dict.fromkeys(
        (condition if level else "clean", float(level))
        for condition, values in levels.items()
        for level in values
    )
    return [
        Trial(system, condition, level, trial, method, source, frames)
        for system, trial, (condition, level), method in product(systems, trials, cases, methods)
    ]


# ---------------------------------------------------------------------------------------- tables


def tabulate(results: Iterable[TrialResult]) -> DataFrame:
    """Results of trials as a frame.

    Parameters
    ----------
    results : iterable of TrialResult

    Returns
    -------
    DataFrame
        One row a trial, in the given order. Its columns are the fields of `Trial`, the fields and
        properties of `Score` but for the array, and those of `TrialResult` that are not among
        them: wrong_terms, verdict, law, pulls and so on.
    """
    import pandas

    return pandas.DataFrame([_row(result) for result in results])


def _row(result: TrialResult) -> dict[str, object]:
    fields = vars(result) | vars(result.score) | vars(result.trial)  # "trial" is now its number
    properties = {
        "exact": result.score.exact,
        "max_coefficient_error": result.score.max_coefficient_error,
        "wrong_terms": result.wrong_terms,
        "verdict": result.verdict,
    }
    left_out = ("score", "coefficient_errors")
    return {name: fields[name] for name in fields if name not in left_out} | properties


def by_condition(trials: DataFrame) -> DataFrame:
    """The trials condition by condition, each beginning with level 0: its clean trials.

    Parameters
    ----------
    trials : DataFrame
        See `tabulate`.

    Returns
    -------
    DataFrame
        The clean trials stand in it once for each other condition that there is, by its name.
    """
    import pandas

    clean = trials[trials.condition == "clean"]
    parts = [
        pandas.concat([clean.assign(condition=name), noisy]).sort_values("level", kind="stable")
        for name in CORRUPTIONS
        if len(noisy := trials[trials.condition == name])
    ]
    return pandas.concat(parts, ignore_index=True) if parts else trials[:0]


def summary(trials: DataFrame, by: str | list[str]) -> DataFrame:
    """Repeated trials as rows of the paper's tables, in its units.

    Parameters
    ----------
    trials : DataFrame
        See `tabulate`.
    by : str or list of str
        Columns whose values tell the groups; they are the first columns of the result.

    Returns
    -------
    DataFrame
        One row a group, in the order of their first trials: in how many trials the terms are the
        true ones and no others; wrong terms, missing or false, trial by trial; median and range of
        the relative l2 error, medians of precision and recall; exact laws that are doubted and
        wrong ones that are not, None for methods without a status; trials whose cameras could not
        be learned; processor time of a trial.
        Errors have two significant digits, and one below `LEAST` is given as that: the rest is
        rounding noise.
    """

    def percent(value: float) -> float:
        return significant(100 * max(value, LEAST))

    def count(verdict: str) -> Callable[[Series], int | None]:
        silent = ("None", "refused")
        return lambda v: None if v.str.endswith(silent).all() else int((v == verdict).sum())

    rows = trials.groupby(by, sort=False).agg(
        **{
            "exact": ("exact", rate),
            "wrong terms": ("wrong_terms", lambda values: " ".join(map(str, values))),
            "l2 (e-2)": ("l2", lambda values: percent(values.median())),
            "least": ("l2", lambda values: percent(values.min())),
            "most": ("l2", lambda values: percent(values.max())),
            "precision (%)": ("precision", lambda values: round(100 * values.median(), 2)),
            "recall (%)": ("recall", lambda values: round(100 * values.median(), 2)),
            "exact, doubted": ("verdict", count("exact, suspect")),
            "wrong, ok": ("verdict", count("wrong, ok")),
            "no path": ("verdict", lambda v: int(v.str.endswith("refused").sum())),
            "seconds": ("seconds", "median"),
        }
    )
    rows[["exact, doubted", "wrong, ok"]] = rows[["exact, doubted", "wrong, ok"]].astype(object)
    return rows.reset_index()


def rate(happened: Series) -> str:
    """How often something happened, as text: "4 of 5"."""
    return f"{int(happened.sum())} of {len(happened)}"


def significant(value: float, digits: int = 2, least: float = 0.0) -> float:
    """A number rounded to so many significant digits; what is below the least is given as that."""
    return float(f"{value if abs(value) > least else least:.{digits - 1}e}")
