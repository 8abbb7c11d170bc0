"""Spline-enhanced sparse regression: a noisy trajectory goes in, the governing equations come out.

The objective is the paper's (Eqs. 8-9): data loss of a cubic B-spline, physics loss at collocation
points, a price per term. What differs is how it is minimised: banded Gauss-Newton steps with the
curve eliminated (`collocation`), a search over supports in the small algebra that remains
(`selection`), the offset as the origin in which the law is sparsest (`origin`), and a physics
weight that is raised until the law holds exactly. Nothing is set by hand per system.

The stages, in order: `pose` (`posing`), twice where samples are few (`coarse`), `search` at a
tolerated error, `polish` at the errors that are left, `settle` on the law that persists
(`settling`); where none persists, also from a search that tolerates all that has to be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from tqdm import tqdm

from ..arrays import Floats
from ..checks import check_integer
from .candidates import Library, check_library
from .coarse import evidence, views
from .collocation import Fit, Status
from .conclusion import conclude
from .discovery import Discovery
from .elsewhere import off_home
from .form import Form
from .history import History
from .order import accelerated, better, check_order
from .persistence import Path
from .posing import pose
from .precision import foreseen, with_precision
from .problem import Problem, fit_curves
from .process_noise import rebalanced, with_process_noise
from .search import CONSISTENT, FINAL_WEIGHT, climb, consistent, search
from .selection import inverse
from .settling import EXACT, persists, settle
from .shape import is_on_circle
from .swing import LIBRARY, NAME, Swing, swinging
from .threads import one_blas_thread
from .trajectories import (
    Trajectory,
    check_sigma,
    check_systematic,
    check_trajectories,
    coordinate_names,
)
from .turning import Measured, Solved, check_orientation, in_axes, in_sparsest_axes

SPLINE_ERROR = 3e-7
"""Error of a coefficient, in standard units, that knots may leave in nearly exact data."""
DROWNED = 0.5
"""Errors, relative to the spread of the data, beyond which a curve shows no accelerations."""
MOST_HALVINGS, MOST_CREEPING = 4, 2
"""Most halvings of the knot spans, and those until a law must converge: a sharp turn that the first
knots cannot follow takes two."""
MOST_WEIGHINGS = 2
"""Most laws of which the precision of the measurements is learned."""


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
        For the random probes of the noise estimate and the starts of the offset search.
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
    task = _Task(measured, names, library, origin, seed, progress)
    # Matrices this small gain nothing by threads, which wait for each other on a busy machine.
    with one_blas_thread():
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
    """The law of a form, the problem that it solves, and the last fit."""
    trajectories, shared, sigma = task.measured
    starts, probes = (
        np.random.default_rng(child) for child in np.random.SeedSequence(task.seed).spawn(2)
    )
    history = History()
    with tqdm(total=0, disable=not task.progress, desc="discover", leave=False) as bar:
        outcomes = [
            _law(problem, starts, probes, history, bar)
            for problem in views(lambda *how: pose(trajectories, shared, form, probes, sigma, *how))
        ]
    problem, fit, path = min(outcomes, key=lambda outcome: evidence(*outcome[:2]))
    if not task.turned:
        fit = _off_home(problem, fit, path)
    return conclude(problem, fit, path, history), problem, fit


def _law(
    problem: Problem,
    starts: np.random.Generator,
    probes: np.random.Generator,
    history: History,
    bar: tqdm,
) -> tuple[Problem, Fit, Path]:
    """The law of a problem: the problem as that tells it, the last fit, and the path of laws."""
    bar.total += 2
    fit = search(problem, starts, history)
    # No search at larger errors would find an exact law of a motion that is kicked.
    asked = not consistent(problem, fit)
    if asked:
        problem, fit = _kicked(problem, fit, starts, probes, history)
    if not problem.kicked:
        fit = polish(problem, climb(problem, fit, starts, history), history)
        bar.update()
    for _ in range(0 if problem.kicked else MOST_WEIGHINGS):
        weighed = with_precision(problem, fit)
        if weighed is problem:
            break
        problem = weighed
        bar.total += 1
        fit = climb(problem, search(problem, starts, history), starts, history)
        fit = polish(problem, fit, history)
        bar.update()
    if not asked and (problem.errors(fit) > CONSISTENT * problem.noise).any():
        problem = with_process_noise(problem, fit, probes)
        fit = search(problem, starts, history) if problem.kicked else fit
    if problem.kicked:
        bar.total += 1
        problem = rebalanced(problem, fit, probes)
        fit = polish(problem, fit, history)
        bar.update()
    fit, path = settle(problem, fit, history)
    bar.update()
    if not (problem.kicked or persists(fit, path)):
        # Errors that last may have made terms from which no path leads to the law that persists.
        bar.total += 1
        found = polish(problem, search(problem, starts, history, path.level), history)
        if found.status is Status.CONVERGED:  # around what has not, nothing is told
            other = settle(problem, found, history)
            fit, path = other if persists(*other) else (fit, path)
        bar.update()
    return problem, fit, path


def _off_home(problem: Problem, fit: Fit, path: Path) -> Fit:
    """The fit with those axes off home that the errors which are left tell from there."""
    if not (problem.form.movable & ~fit.state.moving).any():
        return fit
    model = path.model if path.fit is fit else problem.model(fit)
    state = off_home(problem.cautious, fit.state, model, path.tolerated)
    if state is fit.state:
        return fit
    moved = fit.collocation.solve(state, EXACT)
    return _off_home(problem, moved, path) if moved.status is Status.CONVERGED else fit


def _kicked(
    problem: Problem,
    fit: Fit,
    starts: np.random.Generator,
    probes: np.random.Generator,
    history: History,
) -> tuple[Problem, Fit]:
    """The problem with the kicks that its data show, and the law under them; else both as given.

    A poor law shows kicks that are none: the law that is found under them must not hold exactly.
    """
    kicked = with_process_noise(problem, fit, probes)
    if kicked is problem:
        return problem, fit
    law = search(kicked, starts, history)
    exact = with_process_noise(problem, law, probes) is problem
    return (problem, fit) if exact else (kicked, law)


def polish(problem: Problem, fit: Fit, history: History) -> Fit:
    """Refit with the law exact and at the errors it leaves, on finer knots until that is enough."""
    fit = first = problem.weighted(fit.collocation, FINAL_WEIGHT).solve(fit.state, EXACT)
    columns, creeps = np.flatnonzero(fit.state.free()), first.status is Status.MAX_STEPS
    for halving in range(MOST_HALVINGS):
        if creeps and halving == MOST_CREEPING:
            fit = first
            break
        before = fit.state.flat()[columns]
        segments = [segment.refined() for segment in fit.collocation.segments]
        finer = problem.collocation(segments, problem.errors(fit))
        splines = fit.collocation.grid.splines(fit.state.control_points)
        state = replace(fit.state, control_points=fit_curves(finer, splines))
        fit = problem.weighted(finer, FINAL_WEIGHT).solve(state, EXACT)
        creeps = creeps and fit.status is Status.MAX_STEPS
        information = fit.collocation.linearise(fit.state, columns).information
        spread = np.sqrt(np.diag(inverse(information)))
        # Half the spacing, a sixteenth of the error: so much is left of what it just was.
        error = np.abs(fit.state.flat()[columns] - before) / 15
        if (error < np.maximum(0.1 * spread, SPLINE_ERROR)).all():
            break
    history.add("polish", problem, fit, FINAL_WEIGHT)
    return fit
