"""Spline-enhanced sparse regression: a noisy trajectory goes in, the governing equations come out.

The objective is the paper's (Eqs. 8-9): data loss of a cubic B-spline, physics loss at collocation
points, a penalty per term. What differs is how it is minimised: banded Gauss-Newton steps with the
curve eliminated (`collocation`), a search over supports in the small algebra that remains
(`l0`), the offset as the origin in which the law is sparsest (`frames`), a physics weight
that is raised until the law holds exactly, and an error that is tolerated (`path`). Nothing is set
by hand per system.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from threading import Lock
from typing import cast

import numpy as np
from scipy.interpolate import BSpline
from threadpoolctl import OpenBLASController, threadpool_limits

from ..arrays import Floats
from ..checks import check_choice, check_integer, check_positive, shown
from ..progress import bar
from .bspline import DEGREE
from .collocation import Fit, Status
from .data import Trajectory, check_sigma, check_systematic, check_trajectories, coordinate_names
from .diagnostics import CLOSE, diagnose, where_round
from .inference import infer, with_errors
from .l0 import STRONG
from .library import Library, check_library, monomial_exponents, monomials
from .mechanics import NAME
from .model import Form
from .noise import TOLERATED, bent, rebalanced, smoother_weights, views, with_process_noise
from .orientation import Measured, Solved, check_orientation, in_axes, in_sparsest_axes, with_turns
from .path import ROUNDS, first_law, information_criterion, near, persistent
from .problem import Problem, pose
from .result import LIBRARY, Discovery, History, Path, Swing, swinging

_lock = Lock()
_at_work: list[threadpool_limits] = []  # one for each discovery, the first of which counts


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS to one thread, and give it back what it had when the last one at work has ended.

    The limit is the process's own: who sets it while another has would take one thread for what
    was there before.
    """
    with _lock:
        _at_work.append(_at_work[0] if _at_work else threadpool_limits(limits=1, user_api="blas"))
    try:
        yield
    finally:
        with _lock:
            limits = _at_work.pop()
            if not _at_work:
                # Of OpenBLAS only the thread that set a limit may lift it, unless it is released.
                OpenBLASController.clear_controlling_thread(force=True)
                limits.restore_original_limits()
                OpenBLASController.clear_controlling_thread(force=True)


def discover(
    t: Floats | Sequence[tuple[Floats, Floats]],
    x: Floats | None = None,
    degree: int | None = None,
    seed: int = 0,
    progress: bool | None = None,
    systematic: Floats | Sequence[Floats] | None = None,
    order: int | str = "auto",
    library: Library | None = None,
    sigma: float | Floats | Sequence[float | Floats] | None = None,
    origin: str = "learn",
    orientation: str = "data",
    time_limit: float | None = 60.0,
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
    progress : bool, optional
        Whether a progress bar is shown; by default after two seconds, if a person watches (a
        terminal, a notebook).
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
        warning says so. One fit may last longer. Without a limit if None.

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
    check_order(order, origin)
    trajectories = check_trajectories(t, x)
    check_orientation(orientation, library, trajectories[0][1].shape[1], origin)
    pairs = cast("Sequence[tuple[Floats, Floats]]", t if x is None else [(t, x)])
    names, times = coordinate_names(pairs), [np.asarray(times) for times, _ in pairs]
    shared = check_systematic(systematic, times, trajectories)
    measured = trajectories, shared, check_sigma(sigma, times, trajectories, names)
    limit = np.inf if time_limit is None else check_positive("time_limit", time_limit)
    end = time.perf_counter() + limit
    task = _Task(measured, names, library, origin, seed, progress, end)
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
    progress: bool | None
    end: float

    def form(self, order: int) -> Form:
        """That of laws of an order."""
        return Form.of(self.names, self.library, order, self.origin)


def _oriented(task: _Task, found: Discovery) -> Discovery:
    """The law in the axes in which it has fewest terms."""
    form = task.form(found.system.order)

    def solved(turn: Floats) -> Solved:
        measured = in_axes(task.measured, turn)
        moved = replace(task, measured=measured)
        law, problem, fit = _solved(moved, *_posed(moved, form))
        return replace(law, orientation=turn), problem, fit

    paths, modes, errors = in_axes(task.measured, np.eye(len(task.names)))
    probes, rng = (np.random.default_rng(task.seed) for _ in range(2))
    problem = smoother_weights(pose(paths, modes, form, probes, errors))
    best = in_sparsest_axes(found, problem, solved, rng)
    if best is None:
        said = "orientation: the data's own axes, as the law has no fewer terms in any others"
        return replace(found, note="; ".join(filter(None, (found.note, said))))
    law, problem, fit = best
    return with_errors(replace(law, note=found.note), problem, fit, with_turns(problem, bent(fit)))


def _of_order(task: _Task, order: int | str) -> Discovery:
    """The law of an order, or of the one that is to be trusted."""
    if order == "auto" and task.library.moving(task.names):
        order = 2  # who names a velocity means a law of motion
    problems, probes = _posed(task, task.form(2 if order == 2 else 1))
    problem, whole, linear = problems[0], task.library.degree, None
    given, timed = order == 1 or task.library.given, task.library.timed(task.names)
    drowned = problem.noise.max() > 0.5  # a curve shows no accelerations
    body = order == "auto" and not (given or timed or drowned)
    body = body and accelerated(problem.curves) and not has_velocities(problem)
    swing = _swing(task, problem, places=False) if body and whole else None
    if body and whole and not swing:
        linear = _of_forces(task, 1)  # no law of first order holds: its search would be in vain
        if linear and not linear.warnings:
            return replace(linear, note="order 2: velocities are no function of the place")
    found, problem, fit = _solved(task, problems, probes)
    if given:
        return found
    if order == "auto" and driven_alone(problem, fit):
        doubt = (
            f"{' and '.join(task.names)} all but follows from the inputs and their rates: laws of "
            "orders 1 and 2 fit alike; say which, or record how it starts or comes to rest"
        )
        found = replace(found, warnings=(*found.warnings, doubt))
    if order == "auto" and fit.state.active[1:].any() and len(task.names) == 1:
        # What only rises or falls on a line passes no place twice, or hardly: forces may pull it.
        # Linear ones without a constant pull also hold where the law of first order is linear.
        simple = replace(task, library=Library.polynomial(1))
        steady, exact, its = _solved(simple, *_posed(simple, simple.form(2)))
        less = information_criterion(problem, fit) - information_criterion(exact, its)
        if less > STRONG and its.state.active[0].any() and not exact.has_process_noise:
            return replace(
                steady, note=f"order 2: forces of degree 1 cost {less:.3g} less than order 1"
            )
    if not found.warnings:
        return found
    swing = swing or _swing(task, problem, order == 2)
    if swing or order == 2 or drowned:
        return replace(found, swing=swing)
    # With inputs a place is passed with several velocities, whatever the order is.
    second = linear or (_of_forces(task, whole and 1) if body or timed else None)
    if second and second.warnings and whole and whole > 1:
        second = _of_forces(task, whole) or second
    return better(found, second) if second else found


def _of_forces(task: _Task, degree: int | None) -> Discovery | None:
    """The law of second order up to a degree; None of too few samples, or names that are taken."""
    simple = replace(task, library=replace(task.library, degree=degree))
    try:
        return _solved(simple, *_posed(simple, simple.form(2)))[0]
    except ValueError:
        return None


def _swing(task: _Task, problem: Problem, places: bool) -> Swing | None:
    """The law of the angle of positions that are on a circle, if nothing but polynomials is given.

    None elsewhere, or if there is too little of it.
    """
    trajectories, shared, _ = task.measured
    x = np.concatenate([values for _, values in trajectories])
    noise = (problem.noise * problem.units.scale)[: x.shape[1]]
    seen = x[np.isfinite(x).all(axis=1)]
    if problem.form.functions or not len(seen):
        return None
    where = where_round(seen, noise, places)
    if where is None or where.shape != "circle":
        return None

    form = Form.of((NAME,), LIBRARY, 2)

    def solved(angles: list[Trajectory], errors: list[Floats]) -> Discovery:
        turning = replace(task, measured=(angles, errors, None))
        return _solved(turning, *_posed(turning, form))[0]

    try:
        return swinging(trajectories, shared, solved)
    except ValueError:
        return None


def _posed(task: _Task, form: Form) -> tuple[list[Problem], np.random.Generator]:
    """The problems whose solutions are laws of a form: the data, and what is known of their noise.

    With `_solved`, prepare, path, infer, diagnose: the sections of the paper's method.
    """
    trajectories, shared, sigma = task.measured
    probes = np.random.default_rng(task.seed)
    return views(lambda *how: pose(trajectories, shared, form, probes, sigma, *how)), probes


def _solved(task: _Task, problems: list[Problem], probes: np.random.Generator) -> Solved:
    """The law, the problem that it solves, and the last fit."""
    # A first law, and one under process noise or at larger errors.
    rounds = 2 * (1 + ROUNDS) * len(problems)
    with bar(task.progress, "discover", total=rounds, leave=False) as shown_bar:
        history = History(end=task.end, bar=shown_bar)
        laws = [_law(problem, probes, history) for problem in problems]
        shown_bar.update(rounds - shown_bar.n)
    # What has not converged is no law, however little it leaves.
    met = [law for law in laws if law[1].status is Status.CONVERGED]
    problem, fit, path = min(met or laws, key=lambda law: information_criterion(*law[:2]))
    model = path.model if path.fit is fit else problem.model(fit)
    found = infer(problem, fit, model, path, history)
    doubts = diagnose(problem, fit, model, path, found.system)
    return replace(found, warnings=(*history.warnings, *doubts)), problem, fit


def _law(
    problem: Problem, probes: np.random.Generator, history: History
) -> tuple[Problem, Fit, Path]:
    """The law that persists: the problem as that tells it, the last fit, and the path of laws.

    Where it leaves more than the noise, there may be process noise; where no path leads to a law,
    errors that last may have made terms of the first, and one that tolerates them is the start.
    """
    fit, path, persists = persistent(problem, first_law(problem, history), history)
    if not (near(problem, fit) or history.over):
        found = _under_process_noise(problem, fit, probes, history)
        if found is not None:
            return found[0], *persistent(*found, history)[:2]
    more = path.level > np.maximum(problem.noise, TOLERATED)
    if more.any() and not (persists or history.over):
        law = first_law(problem, history, path.level)
        other, around, leads = persistent(problem, law, history)
        fit, path = (other, around) if leads else (fit, path)
    return problem, fit, path


def _under_process_noise(
    problem: Problem, fit: Fit, probes: np.random.Generator, history: History
) -> tuple[Problem, Fit] | None:
    """The problem with the process noise that its data show, and the law under it; else none.

    A poor law shows some where there is none: a law that is found under it must not hold exactly.
    """
    noisy = with_process_noise(problem, fit, probes)
    if noisy is None:
        return None
    law = first_law(noisy, history)
    if with_process_noise(problem, law, probes) is None:
        return None
    return rebalanced(noisy, law, probes), law


# --------------------------------------------------------------------------------------------------
# First or second order: whether a law of motion, x'' = f(x, x'), is a better guess than x' = f(x).
#
# A body that is thrown, or hangs on a spring, passes the same place with other velocities, so that
# no law of first order holds; but its acceleration is nearly a linear function of where it is and
# how it moves. In the flows that people write down as x' = f(x) it is not.


def check_order(order: object, origin: str) -> None:
    """Refuse what is no order of a law, or no origin."""
    if isinstance(order, bool | float) or order not in (1, 2, "auto"):
        raise ValueError(f"order: must be 1, 2 or 'auto', got {shown(order)}")
    check_choice("origin", origin, ("learn", "data"))


def driven_alone(problem: Problem, fit: Fit) -> bool:
    """Whether all states are combinations of the inputs now and a little later.

    Such is what is left of any linear law, of whatever order, under one steady sine.
    """
    now, _ = fit.collocation.node_states(fit.state.control_points)
    later = now + np.eye(now.shape[1])[-1]  # by a time in which the motion changes by its size
    inputs = [f.value(x) for f in problem.functions if f.of_time for x in (now, later)]
    terms = np.column_stack([np.ones(len(now)), *inputs])
    known = np.isfinite(terms).all(axis=1)
    states = now[known, : problem.form.states]
    return bool(inputs) and unexplained(terms[known], states) < CLOSE**2


def accelerated(curves: Sequence[BSpline]) -> bool:
    """Whether smoothed curves look like those of a law of second order.

    The slope is no function of the place; or hardly one, and the second derivative is nearly linear
    in both. Flows of first order leave up to .15 of the slopes' squares to no cubic law, with noise
    of 40 %, outside the library up to .002; throws .02. Of the accelerations' squares clean flows
    leave .26 to .64 to no linear law, springs and throws up to .06.
    """
    x, v, a = rates(curves)
    linear = np.hstack([np.ones((len(x), 1)), x, v])
    # Cubic terms of more than three coordinates are so many that they may do no more than
    # interpolate, which leaves nothing: of these as many as a tenth of the points.
    whole = [monomial_exponents(x.shape[1], degree) for degree in (1, 2, 3)]
    most = max(20, len(x) / 10, len(whole[0]))
    several = unexplained(monomials(x, [e for e in whole if len(e) <= most][-1]), v)
    return several > 0.5 or (several > 0.005 and unexplained(linear, a) < 0.15)


def rates(curves: Sequence[BSpline]) -> list[Floats]:
    """Places, slopes and second derivatives along curves, (n, d) each."""
    # The outermost spans bend by chance.
    times = [np.arange(curve.t[DEGREE + 1], curve.t[-DEGREE - 2], 1 / 10) for curve in curves]
    return [
        np.concatenate([curve(t, order) for curve, t in zip(curves, times, strict=True)])
        for order in range(3)
    ]


def has_velocities(problem: Problem) -> bool:
    """Whether the coordinates are places and their velocities, each with the other."""
    x, v, _ = rates(problem.curves)
    places, slopes = problem.units.point(x), v * problem.units.scale / problem.units.time
    off = ((slopes[:, :, None] - places[:, None]) ** 2).mean(axis=0)
    pairs = off < 0.05 * (slopes**2).mean(axis=0)[:, None]
    return bool((pairs.any(axis=0) | pairs.any(axis=1)).all())


def unexplained(terms: Floats, values: Floats) -> float:
    """Share of the squares of values (n, d) that no combination of terms (n, l) explains.

    NaN if there are hardly more values than terms.
    """
    if len(terms) <= 2 * terms.shape[1]:
        return np.nan
    left = values - terms @ np.linalg.lstsq(terms, values, rcond=None)[0]
    return float((left**2).sum() / (values**2).sum())


def better(first: Discovery, second: Discovery) -> Discovery:
    """The one of two laws of the same positions that is to be trusted, where the first is doubtful.

    The second order, if the first misses the data; or if the second is beyond doubt and has no more
    terms.
    """
    m = first.system.states
    terms = int(first.native.support[:, :m].sum())
    others = int(second.native.support[:, m : 2 * m].sum())
    if (first.noise[:m] > 1.5 * second.noise[:m]).any():
        return replace(second, note="order 2: the law of order 1 misses the data")
    if not second.warnings and others <= terms:
        cause = f"the law of order 1 is doubtful and has {terms} terms, not {others}"
        return replace(second, note=f"order 2: {cause}")
    doubt = "is doubtful, too" if second.warnings else f"has {others} terms, not {terms}"
    return replace(first, note=f"order 1: the law of order 2 {doubt}")
