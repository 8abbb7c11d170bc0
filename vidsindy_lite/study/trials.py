"""The paper's experiments on synthetic videos, as typed trials; protocol of docs/results.md.

A `Trial` takes the path that was recovered from a film (`films`), adds noise or hides rows, and
gives what is left to one method::

    results = sweep(run_trial, grid(["Lorenz"], {"noise": (0, 0.1, 0.2)}, range(5)))

The number of a trial seeds all that is random in it: scenes, noise, gaps, and the methods that draw
numbers; ours runs with its default seed. `tables` turns results into rows.
"""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from ..arrays import Floats
from ..checks import check_choice
from ..dynamics import Discovery, PolynomialSystem, discover
from ..observation import observe_tracks
from .corruption import add_noise, drop_blocks, drop_fibers
from .films import TOGETHER, FilmResult, FilmTask, film_result
from .metrics import Score, pulls, score
from .systems import SYSTEMS

CORRUPTIONS: dict[str, Callable[[Floats, float, np.random.Generator], Floats]] = {
    "noise": add_noise,
    "blocks": drop_blocks,
    "fibers": drop_fibers,
}
"""What a condition does to a path, at a level that is a fraction."""
CONDITIONS = ("clean", *CORRUPTIONS)
METHODS = ("ours", "PySINDy", "E-SINDy", "WeakSINDy", "Model-A")
"""Ours, and the `baselines.BASELINES` by their names there."""
RANDOM_METHODS = ("E-SINDy", "WeakSINDy", "Model-A")
"""The baselines that draw random numbers: the number of the trial is their seed."""
SOURCES = ("videos", "tracks", "whole pixels", "detector", "truth")
"""Where a path comes from: the tracks; the tracks, which are corrupted in its place before the
cameras are learned; the tracks rounded to whole pixels; those of the learned detector, rounded to
whole pixels; or the simulation."""


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
        Standard deviation of the noise over that of each coordinate (of the path, or of the pixels
        if the source is "tracks"), or fraction of the rows that are hidden, in each view anew; 0
        if, and only if, the condition is "clean".
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
    method: str = "ours"
    source: str = "videos"
    frames: int = 1500

    def __post_init__(self) -> None:
        check_choice("system", self.system, SYSTEMS)
        check_choice("condition", self.condition, CONDITIONS)
        check_choice("method", self.method, METHODS)
        check_choice("source", self.source, SOURCES)
        if not 0 <= self.level < np.inf or (self.level == 0) != (self.condition == "clean"):
            raise ValueError(
                "level: must be 0 in the condition 'clean' and above 0 in all others, "
                f"got {self.level} in {self.condition!r}"
            )

    @property
    def film(self) -> FilmTask:
        """The film that the path comes from."""
        return FilmTask(self.system, self.trial, self.frames)

    def corrupt(self, x: Floats) -> Floats:
        """Do to a path what the condition says; the same whatever the method and the source."""
        return self.corrupt_each([x])[0]

    def corrupt_each(self, paths: Sequence[Floats]) -> list[Floats]:
        """Do what the condition says to several paths or tracks, to each by its own draw."""
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
        From path to law.
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


def run_trial(trial: Trial) -> TrialResult:
    """Corrupt the path of a film and let a method find its law.

    Parameters
    ----------
    trial : Trial

    Returns
    -------
    TrialResult
    """
    filmed = film_result(trial.film)
    x, systematic = _corrupted_path(filmed, trial)
    began = time.perf_counter()
    found = find_law(trial.method, filmed.t, x, systematic, trial.trial)
    seconds = time.perf_counter() - began
    law = found if isinstance(found, PolynomialSystem) else found.system
    result = TrialResult(trial, law, score(law, filmed.truth), seconds)
    if isinstance(found, PolynomialSystem):
        return result
    promised = np.linalg.norm(found.standard_errors) / np.linalg.norm(filmed.truth.coefficients)
    return replace(
        result,
        status=found.status,
        warnings=found.warnings,
        promised_l2=float(promised),
        pulls=pulls(found, filmed.truth),
    )


def source_path(filmed: FilmResult, source: str) -> tuple[Floats, Floats | None]:
    """The path of a film from one of the `SOURCES`, (n, 3), and its systematic errors, if any."""
    check_choice("source", source, SOURCES)
    if source == "truth":
        return filmed.truth.simulate(filmed.t, np.array(filmed.truth.x0)), None
    if source == "whole pixels":
        return _reconstructed(filmed, [np.round(track) for track in filmed.tracks])
    if source == "detector":
        return _reconstructed(filmed, [np.round(track) for track in filmed.detected])
    return filmed.x, filmed.systematic


def _corrupted_path(filmed: FilmResult, trial: Trial) -> tuple[Floats, Floats | None]:
    """The path that a trial is about, and its systematic errors, if any."""
    if trial.source == "tracks":
        return _reconstructed(filmed, trial.corrupt_each(filmed.tracks))
    path, systematic = source_path(filmed, trial.source)
    return trial.corrupt(path), systematic


def _reconstructed(filmed: FilmResult, tracks: list[Floats]) -> tuple[Floats, Floats]:
    """The path that other tracks of a film give, and its systematic errors."""
    seen = observe_tracks(tracks, filmed.rig.uncalibrated(keep=0), filmed.t, lags=TOGETHER)
    return seen.x, seen.systematic


def find_law(
    method: str,
    t: Floats,
    x: Floats,
    systematic: Floats | None,
    seed: int,
    degree: int = 3,
    origin: str = "learn",
) -> Discovery | PolynomialSystem:
    """What one of the `METHODS` finds.

    Only ours can use what is known of systematic errors, and looks for the law's origin.
    """
    if method == "ours":
        return discover(t, x, degree=degree, systematic=systematic, order=1, origin=origin)
    from .baselines import BASELINES  # pysindy takes seconds to import

    options = {"seed": seed} if method in RANDOM_METHODS else {}
    return BASELINES[method](t, x, degree, **options)


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
    return [
        Trial(system, condition, level, trial, method, frames=frames)
        for system, trial, (condition, level), method in product(systems, trials, cases, methods)
    ]
