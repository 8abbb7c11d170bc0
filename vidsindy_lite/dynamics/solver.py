"""Spline-enhanced sparse regression: a noisy trajectory goes in, the governing equations come out.

The objective is the paper's (Eqs. 8-9): data loss of a cubic B-spline, physics loss at collocation
points, a price per term. What differs is how it is minimised: banded Gauss-Newton steps with the
curve eliminated (`collocation`), a search over supports in the small algebra that remains
(`selection`), the offset as the origin in which the law is sparsest (`frames`), a physics weight
that is raised until the law holds exactly, and an error that is tolerated (`path`). Nothing is set
by hand per system.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from ..arrays import Floats
from ..checks import check_integer, check_positive
from .candidates import Library, check_library
from .coarse import evidence, views
from .collocation import Fit
from .conclusion import conclude
from .discovery import Discovery
from .form import Form
from .history import History
from .order import accelerated, better, check_order
from .path import ROUNDS, TOLERATED, Path, first_law, near, persistent
from .posing import pose
from .precision import foreseen
from .problem import Problem
from .process_noise import rebalanced, with_process_noise
from .shape import is_on_circle
from .swing import LIBRARY, NAME, Swing, swinging
from .trajectories import (
    Trajectory,
    check_sigma,
    check_systematic,
    check_trajectories,
    coordinate_names,
)
from .turning import Measured, Solved, check_orientation, in_axes, in_sparsest_axes

DROWNED = 0.5
"""Errors, relative to the spread of the data, beyond which a curve shows no accelerations."""
MOST_LAWS = 3
"""Most laws to which a path is followed: a first, one under kicks, and one at larger errors."""


def discover(
    t: Floats | Sequence[tuple[Floats, Floats]],
    x: Floats | None = None,
    degree: int | None = None,
    seed: int = 0,
    progress: bool = False,
    systematic: Floats | Sequence[Floats] | None = None,
    order: int | str = "auto",
    library: Library | None = None,
    sigma: float | Floats | Sequence[float | Floats] | None = None,
    origin: str = "learn",
    orientation: str = "data",
    time_limit: float | None = None,
) -> Discovery:
    """Discover the law of a measured trajectory (paper: Eqs. 7-10).

    Parameters
    ----------
    t : array_like, shape (n,), or list of (t, x)
        Increasing times, even or uneven; or several trajectories of one system.
    x : array_like, shape (n, d), optional
        States with d of at least 1, NaN where a coordinate was not seen: what was seen at the same
        time counts. Omitted when ``t`` is a list. The columns of a data frame name the variables,
        if they are names.
    degree : int, optional
        Highest degree of the candidate terms: short for ``library=Library.polynomial(degree)``; 3
        by default.
    seed : int
        For the random probes of the noise estimate.
    progress : bool
        Show a progress bar.
    systematic : array_like, shape (k, n, d), optional
        Errors that all samples share, such as those of a scale: what k independent causes, each
        off by one standard error, add to ``x``; smooth like the path, and below its noise. One
        such array per trajectory if ``t`` is a list.
    order : {1, 2, "auto"}
        1 for ``x' = f(x)``; 2 for ``x'' = f(x, x')``, where ``x`` are positions alone: velocities
        become states ``vx, ...`` of the law, after the positions. ``"auto"`` looks for the second
        where the first is doubtful and the motion is that of a body, and says in `Discovery.note`
        which was taken and why. Where terms are given of the equations, it is 1; where the library
        names velocities, 2.
    library : Library, optional
        The candidate terms, in place of ``degree``; `Library.where` says what is known of them, and
        `Library.inputs` brings measured inputs.
        With terms that are no polynomials the law is sought in the frame of the data only, as no
        shift of its origin is exact.
    sigma : float, or array_like of shape (d,) or (n, d), optional
        Standard errors of the samples, if they are known: then noise is not estimated. For several
        trajectories one for all, or a list with one for each.
    origin : {"learn", "data"}
        Whether the law's own origin is sought, or is that of the data: then no axis moves.
    orientation : {"data", "learn"}
        Whether the axes are those of the data, or turned to where the law has fewest terms, if
        nobody knows how two or three coordinates of a place lie. Then all of the result is in the
        axes that `Discovery.orientation` holds: a state of it is ``x @ orientation.T``. Rows in
        which a coordinate was not seen do not count.
    time_limit : float, optional
        Seconds after which no further round begins: then the best law so far comes back, and a
        warning says so. One fit may last longer.

    Returns
    -------
    Discovery
        The law with standard errors in the frame of the data and in its own, sparsest frame.

    Raises
    ------
    ValueError
        If the input has the wrong shape, times that do not increase, infinite values, a
        coordinate that does not move, or fewer samples than unknowns; if ``degree`` and
        ``library`` are given, or a library does not suit the data; if a standard error is not
        positive.

    Examples
    --------
    >>> t, x = study.SYSTEMS["Lorenz"].trajectory(1500)
    >>> print(vl.discover(t, x).equations())
    """
    library, seed = check_library(degree, library), check_integer("seed", seed)
    check_order(order, origin, library)
    trajectories = check_trajectories(t, x)
    check_orientation(orientation, library, trajectories[0][1].shape[1], origin)
    names = coordinate_names(t, x)
    times = [np.asarray(pair[0]) for pair in (t if x is None else [(t, x)])]
    shared = check_systematic(systematic, times, trajectories)
    measured = trajectories, shared, check_sigma(sigma, times, trajectories)
    end = (
        np.inf
        if time_limit is None
        else time.perf_counter() + check_positive("time_limit", time_limit)
    )
    task = _Task(measured, names, library, origin, seed, progress, end)
    # Matrices this small gain nothing by threads, which wait for each other on a busy machine.
    with threadpool_limits(limits=1, user_api="blas"):
        found = _of_order(task, order)
        return found if orientation == "data" else _oriented(task, found)


@dataclass(frozen=True)
class _Task:
    """What is asked of a discovery: the data, and which laws they may have."""

    measured: Measured
    names: tuple[str, ...]
    library: Library
    origin: str
    seed: int
    progress: bool
    end: float
    turned: bool = False
    """Whether the axes are a guess: a wrong one looks like an origin that is a little off."""

    def form(self, order: int) -> Form:
        """That of laws of an order."""
        return Form.of(self.names, self.library, order, self.origin)


def _oriented(task: _Task, found: Discovery) -> Discovery:
    """The law in the axes in which it has fewest terms."""
    form = task.form(found.system.order)

    def posed(turn: Floats) -> Problem:
        probes = np.random.default_rng(task.seed)
        paths, modes, errors = in_axes(task.measured, turn)
        return foreseen(pose(paths, modes, form, probes, errors))

    def solved(turn: Floats) -> Solved:
        return _solved(replace(task, measured=in_axes(task.measured, turn), turned=True), form)

    return in_sparsest_axes(found, posed, solved, np.random.default_rng(task.seed))


def _of_order(task: _Task, order: int | str) -> Discovery:
    """The law of an order, or of the one that is to be trusted."""
    if order == "auto" and task.library.moving(task.names):
        order = 2  # who names a velocity means a law of motion
    found, problem, _ = _solved(task, task.form(2 if order == 2 else 1))
    if order == 1 or task.library.given or not found.warnings:
        return found
    swing = _swing(task, problem)
    drowned = problem.noise.max() > DROWNED
    if swing or order == 2 or drowned:
        return replace(found, swing=swing)
    # With inputs a place is passed with several velocities, whatever the order is.
    if not (found.system.timed or accelerated(problem.curves)):
        return found
    try:
        second, *_ = _solved(task, task.form(2))
    except ValueError:  # too few samples for a law of so many terms, or its names are taken
        return found
    return better(found, second)


def _swing(task: _Task, problem: Problem) -> Swing | None:
    """The law of the angle of positions that are on a circle, if nothing but polynomials is given.

    None elsewhere, or if there is too little of it.
    """
    trajectories, shared, _ = task.measured
    x = np.concatenate([values for _, values in trajectories])
    noise = (problem.noise * problem.units.scale)[: x.shape[1]]
    if problem.form.functions or not is_on_circle(x[np.isfinite(x).all(axis=1)], noise):
        return None

    form = Form.of((NAME,), LIBRARY, 2)

    def solved(angles: list[Trajectory], errors: list[Floats]) -> Discovery:
        return _solved(replace(task, measured=(angles, errors, None)), form)[0]

    try:
        return swinging(trajectories, shared, solved)
    except ValueError:
        return None


def _solved(task: _Task, form: Form) -> Solved:
    """The law of a form, the problem that it solves, and the last fit.

    As in the paper: prepare, path, refit, infer, diagnose; the last two are `conclude`.
    """
    trajectories, shared, sigma = task.measured
    probes = np.random.default_rng(task.seed)
    problems = views(lambda *how: pose(trajectories, shared, form, probes, sigma, *how))
    rounds = MOST_LAWS * (1 + ROUNDS) * len(problems)
    with tqdm(total=rounds, disable=not task.progress, desc="discover", leave=False) as bar:
        history = History(end=task.end, bar=bar)
        laws = [_law(problem, probes, history, not task.turned) for problem in problems]
        bar.update(rounds - bar.n)
    problem, fit, path = min(laws, key=lambda law: evidence(*law[:2]))
    return conclude(problem, fit, path, history), problem, fit


def _law(
    problem: Problem, probes: np.random.Generator, history: History, free: bool
) -> tuple[Problem, Fit, Path]:
    """The law that persists: the problem as that tells it, the last fit, and the path of laws.

    Where a first law does not fit, the motion may be kicked; where no path leads to a law, errors
    that last may have made terms of the first, and one that tolerates them is the start.
    """
    fit = first_law(problem, history)
    asked = not near(problem, fit, TOLERATED)
    if asked:
        problem, fit = _kicked(problem, fit, probes, history)
    fit, path, persists = persistent(problem, fit, history, free)
    if not asked and not near(problem, fit, 0.0):
        kicked, law = _kicked(problem, fit, probes, history)
        if kicked.kicked:
            return kicked, *persistent(kicked, law, history, free)[:2]
    if not (persists or problem.kicked or history.over):
        law = first_law(problem, history, path.level)
        other, around, found = persistent(problem, law, history, free)
        fit, path = (other, around) if found else (fit, path)
    return problem, fit, path


def _kicked(
    problem: Problem, fit: Fit, probes: np.random.Generator, history: History
) -> tuple[Problem, Fit]:
    """The problem with the kicks that its data show, and the law under them; else both as given.

    A poor law shows kicks that are none: the law that is found under them must not hold exactly.
    """
    kicked = with_process_noise(problem, fit, probes)
    if kicked is problem:
        return problem, fit
    law = first_law(kicked, history)
    if with_process_noise(problem, law, probes) is problem:
        return problem, fit
    return rebalanced(kicked, law, probes), law
