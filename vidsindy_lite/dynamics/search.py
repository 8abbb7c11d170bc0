"""The search for the terms of a law: which of all candidates make the motion.

Unpruned fits while the physics weight rises, a subset search in the small algebra that remains
(`selection`) in every frame in which the law may be sparse (`origin`), refinement of the cheapest
candidates, and bridges across gaps (`gaps`).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from ..arrays import Bools, Floats
from .collocation import Collocation, Fit, Status
from .gaps import Gap, gaps, join
from .history import History
from .library import closure_mask, divides, shift_matrix
from .origin import ShiftedLaw, sparse_origins
from .persistence import LARGEST, TOLERATED
from .problem import Problem, fit_curves
from .selection import PLATEAU, subset_search
from .state import State
from .trajectories import Trajectory

FIRST_WEIGHTS = (1e-1, 1e0, 1e1, 1e2)
"""Physics weights of the unpruned fits, relative to the misfit of a plain regression."""
SEARCH_WEIGHTS = (1e2, 1e4, 1e8)
"""Physics weights of the subset searches in the law's own frame."""
BARRED = 1e9
"""Price of a term that does not take part."""
REFINED = 3
"""Most candidates that are refined."""
FINAL_WEIGHT = SEARCH_WEIGHTS[-1]
"""Weight at which the law holds exactly for all that the data can tell."""
NEEDLESS_START = 0.1
"""Chance that a second start, from terms of all degrees, is made though the first left nothing."""
ROUNDING = 1e-9
"""Moves of an origin, in units of the spread of the data, that are none."""
ENOUGH_SAMPLES, ENOUGH_TURNS, LARGEST_SHARE = 3000, 30, 0.5
"""A search is made on so many samples and turns of the motion, if they are no more than that share
of the data."""
LONGEST_SEARCH = 10
"""Most rounds of a subset search."""
CONSISTENT = 1.5
"""Errors that a law leaves, over those tolerated when it was chosen, that are still the same."""
LONGEST_CLIMB = 4
"""Most searches, each at larger errors than the one before."""


def search(
    problem: Problem, rng: np.random.Generator, history: History, tolerated: float = TOLERATED
) -> Fit:
    """The terms that make the motion: the cheapest law at the least error that is tolerated.

    Relative to the spread of the data; where the noise is larger, that is tolerated.
    """
    return _tolerating(problem, _tolerable(problem, tolerated), rng, history)


def consistent(problem: Problem, fit: Fit) -> bool:
    """Whether a law of the first search leaves no larger errors than that tolerated."""
    return bool((problem.errors(fit) <= CONSISTENT * _tolerable(problem)).all())


def climb(problem: Problem, fit: Fit, rng: np.random.Generator, history: History) -> Fit:
    """The law of a search at errors that it leaves.

    If the law leaves larger errors than were tolerated, or errors that last, the search is made
    again and tolerates them.
    """
    tolerated = _tolerable(problem)
    for _ in range(LONGEST_CLIMB - 1):
        left = problem.errors(fit)
        if (left <= CONSISTENT * tolerated).all() or (tolerated >= LARGEST).all():
            break
        tolerated = np.maximum(tolerated, np.minimum(left, LARGEST))
        fit = _tolerating(problem, tolerated, rng, history)
    return fit


def _tolerable(problem: Problem, least: float = TOLERATED) -> Floats:
    """Errors that a search tolerates, (d,); kicks are tolerated as they are."""
    return problem.noise if problem.kicked else np.maximum(problem.noise, least)


def _tolerating(
    problem: Problem, tolerated: Floats, rng: np.random.Generator, history: History
) -> Fit:
    """The cheapest law at tolerated errors, (d,).

    Long data are searched in part: all of them then decide on the terms once more.
    """
    tolerant, stretches = replace(problem, noise=tolerated), _enough(problem)
    part = replace(tolerant, stretches=stretches)
    fit = cheapest(part, candidates(part, rng, history), history)
    if stretches is not problem.stretches:
        fit = _of_all_data(tolerant, fit, history)
    return bridge(tolerant, fit, history)


def _enough(problem: Problem) -> list[tuple[int, Trajectory]]:
    """The stretches of data, or of long ones so much of each as a search needs."""
    samples = sum(len(t) for _, (t, _) in problem.stretches)
    time = sum(t[-1] - t[0] for _, (t, _) in problem.stretches)
    share = max(ENOUGH_SAMPLES / samples, ENOUGH_TURNS * 2 * np.pi / time)
    if share > LARGEST_SHARE:
        return problem.stretches
    cut = []
    for i, (t, x) in problem.stretches:
        end = t[0] + max(share * (t[-1] - t[0]), 2 * np.pi)
        cut.append((i, (t[t <= end], x[t <= end])))
    return cut


def _of_all_data(problem: Problem, fit: Fit, history: History) -> Fit:
    """A law of a part of the data on all of them, its terms searched again."""
    collocation = problem.collocation(problem.segments())
    state = replace(fit.state, control_points=fit_curves(collocation, problem.curves))
    fit = tightened(problem, collocation, state)
    return select(problem, fit, FINAL_WEIGHT, "subset search, all data", history)


def tightened(problem: Problem, collocation: Collocation, state: State) -> Fit:
    """The fit of a state's terms while the physics weight rises to its last.

    At that weight alone the law holds so exactly that a state far from the minimum creeps.
    """
    for weight in SEARCH_WEIGHTS:
        fit = problem.weighted(collocation, weight).solve(state, tolerance=1.0, max_steps=10)
        state = fit.state
    return fit


def candidates(problem: Problem, rng: np.random.Generator, history: History) -> list[Fit]:
    """Supports worth refining, from all terms up to degree 2, and if need be from all terms.

    Terms of denominators come last: a factor above and below the line changes nothing.
    """
    collocation = problem.collocation(problem.segments())
    control = fit_curves(collocation, problem.curves)
    found, degree = [], problem.form.degree
    degrees, implicit = problem.exponents.sum(axis=1), problem.form.implicit
    stages = {f"degree {k}": ~implicit & (degrees <= k) for k in (min(2, degree), degree)}
    if implicit.any():
        stages["all"] = degrees <= degree
    for name, rows in stages.items():
        stage = f"unpruned, {name}"
        fit, weight = unpruned(problem, collocation, control, rows, stage, history)
        here = _in_sparse_frames(problem, fit, weight, rng, history)
        if weight < FIRST_WEIGHTS[-1]:
            best = sorted(here, key=lambda candidate: candidate.criterion)[: REFINED - 1]
            starts = [_at_home(problem, fit), *best]
            here = _climbed(problem, starts, weight, history)
            if not rows.all():
                # Where the law hardly binds, terms of high degree lead astray: also without them.
                lower = replace(problem, penalties=np.where(rows, problem.penalties, BARRED))
                starts = [_at_home(lower, fit), *best]
                here += _climbed(lower, starts, weight, history)
        found += here
        if not leaves_something_over(problem, fit):
            break
    return found


def unpruned(
    problem: Problem,
    collocation: Collocation,
    control: Floats,
    rows: Bools,
    stage: str,
    history: History,
) -> tuple[Fit, float]:
    """Fit all terms of some rows of the library, (l,), while the physics weight rises.

    The last weight comes back, too. Many terms that the data hardly tell apart cannot be fitted at
    a large one: such a fit does not converge, and even those before it lean on the terms. Then the
    first fit is the start.
    """
    d = problem.d
    x, slope = collocation.node_states(control)
    coefficients = np.zeros(problem.known.shape)
    terms = problem.terms(x)
    left = slope - terms @ problem.known
    coefficients[rows] = np.linalg.lstsq(terms[:, rows], left, rcond=problem.noise.min())[0]
    active = rows[:, None] & problem.form.candidates
    coefficients[~active] = 0.0
    still, shared = np.zeros(d, dtype=bool), problem.form.shared
    state = State(control, coefficients, active, np.zeros(d), still, shared)
    fits: list[tuple[Fit, float]] = []
    for weight in FIRST_WEIGHTS:
        fit = problem.weighted(collocation, weight).solve(state, tolerance=1.0, max_steps=15)
        state = fit.state
        history.add(stage, problem, fit, weight)
        fits.append((fit, weight))
        if fit.status is not Status.CONVERGED:
            return fits[0]
    return fits[-1]


def _at_home(problem: Problem, fit: Fit) -> Fit:
    """The cheapest support where the data have their origin, from all terms of a fit."""
    law = _as_shifted(problem, fit)
    return _candidate(problem, fit, law, problem.home, np.zeros(problem.d, dtype=bool))


def _climbed(problem: Problem, found: list[Fit], weight: float, history: History) -> list[Fit]:
    """Candidates of a small physics weight, searched again while it rises."""
    for higher in FIRST_WEIGHTS[FIRST_WEIGHTS.index(weight) :]:
        found = [select(problem, fit, higher, "subset search, climbing", history) for fit in found]
    return found


def leaves_something_over(problem: Problem, fit: Fit) -> bool:
    """Would the other terms together explain more of the data than chance does?"""
    searched = problem.form.searched
    left_out = len(searched) - int(fit.state.free()[searched].sum())
    if not left_out:
        return False
    _, gain = fit.collocation.linearise(fit.state, searched).newton()
    return bool(gain > chi2.isf(NEEDLESS_START, left_out))


def _in_sparse_frames(
    problem: Problem, fit: Fit, weight: float, rng: np.random.Generator, history: History
) -> list[Fit]:
    """Supports in the frames where the law is sparsest, by the quadratic model."""
    fit = select(problem, fit, weight, "subset search, centred frame", history)
    closed = _closed(problem, fit, weight)
    # A law exact in another frame has no firm minimum here: some steps are near enough.
    closed = closed.collocation.solve(closed.state, tolerance=0.1, max_steps=8)
    law = _as_shifted(problem, closed)
    origins = sparse_origins(
        law, closed.state.active, problem.home, problem.box,
        problem.penalties.max(), keep=4, rng=rng,
    )  # fmt: skip
    unique = {
        tuple(np.round(origin, 2)): (origin, moving)
        for start in [problem.home, *origins]
        for origin, moving in _variants(start, problem.home)
    }
    return [_candidate(problem, closed, law, *variant) for variant in unique.values()]


def _variants(origin: Floats, home: Floats) -> list[tuple[Floats, Bools]]:
    """An origin, and the same with some of its axes at home, where they cost nothing."""
    masks = itertools.product(*((True, False) if away else (False,) for away in origin != home))
    return [(np.where(mask, origin, home), np.array(mask)) for mask in masks]


def _closed(problem: Problem, fit: Fit, weight: float) -> Fit:
    """The law in the centred frame, with all terms of its shift closure: these are 0 as yet."""
    d, exponents = problem.d, problem.exponents
    state = replace(
        fit.state,
        coefficients=shift_matrix(exponents, fit.state.offset) @ fit.state.coefficients,
        active=closure_mask(exponents, fit.state.active, problem.form.movable),
        offset=np.zeros(d),
        moving=np.zeros(d, dtype=bool),
    )
    return replace(fit, state=state, collocation=problem.weighted(fit.collocation, weight))


def _as_shifted(problem: Problem, fit: Fit) -> ShiftedLaw:
    """The law of a fit, whose terms are closed under shifts, with its information."""
    state, columns = fit.state, np.flatnonzero(fit.state.free())
    information = np.diag(np.where(state.free()[: -problem.d], 0.0, 1e30))
    model, gradient = fit.collocation.linearise(state, columns), np.zeros(len(information))
    information[np.ix_(columns, columns)], gradient[columns] = model.information, model.gradient
    movable = problem.form.movable
    return ShiftedLaw(problem.exponents, state.coefficients, information, movable, gradient)


def _candidate(
    problem: Problem, closed: Fit, law: ShiftedLaw, origin: Floats, moving: Bools
) -> Fit:
    """The cheapest support at an origin, by the quadratic model around the closed law."""
    coefficients, information, gradient = law.at(origin)
    columns = np.flatnonzero(closed.state.free())
    _, solution, value = subset_search(
        information[np.ix_(columns, columns)],
        gradient[columns],
        coefficients.T.ravel()[columns],
        problem.prices[columns],
        np.ones(len(columns), dtype=bool),
    )
    flat = np.append(np.zeros(closed.state.coefficients.size), origin)
    flat[columns] = solution
    state = closed.state.moved(closed.state.control_points, flat)
    state = replace(state, active=state.coefficients != 0, moving=moving)
    objective = closed.collocation.objective(closed.state)
    cost = objective + value + problem.axis_penalty * moving.sum()
    return replace(closed, state=state, criterion=cost)


def select(problem: Problem, start: Fit, weight: float, stage: str, history: History) -> Fit:
    """Alternate between the subset search and Gauss-Newton until the criterion stops falling.

    The search runs over all terms, active or not, on the quadratic model with the curve
    eliminated; its proposal is kept only if the true criterion falls after a refit.
    """
    weighted = problem.weighted(start.collocation, weight)

    def refit(state: State) -> Fit:
        fit = weighted.solve(state, tolerance=0.1)
        return replace(fit, criterion=problem.criterion(weighted, fit.state))

    best = refit(start.state)
    history.add(stage, problem, best, weight)
    prices = np.append(problem.prices, np.full(problem.d, -np.inf))
    for _ in range(LONGEST_SEARCH):
        state = best.state
        columns = problem.columns(state)
        model = weighted.linearise(state, columns)
        support, solution, _ = subset_search(
            model.information, model.gradient, state.flat()[columns], prices[columns],
            state.free()[columns],
        )  # fmt: skip
        if (support == state.free()[columns]).all():
            break
        promised = model.along(state, solution - state.flat()[columns], 1.0)
        trial = refit(replace(promised, active=promised.coefficients != 0))
        if not trial.criterion < best.criterion - PLATEAU:
            break
        best = trial
        history.add(stage, problem, best, weight)
    return best


def cheapest(problem: Problem, found: Sequence[Fit], history: History) -> Fit:
    """Refine the cheapest candidates; the lowest criterion wins."""
    kept = _distinct(found)[:REFINED]
    for weight in SEARCH_WEIGHTS:
        refined = [
            select(problem, fit, weight, "subset search, own frame", history) for fit in kept
        ]
        limit = min(fit.criterion for fit in refined) + problem.penalties.max()
        kept = [fit for fit in _distinct(refined) if fit.criterion <= limit]
    homes = [come_home(problem, fit, history) for fit in kept]
    settled = [leave_home(problem, fit, history) for fit in _distinct(homes)]
    return min(settled, key=lambda fit: fit.criterion)


def _distinct(found: Sequence[Fit]) -> list[Fit]:
    """The cheapest fit of each set of terms and moved axes, the cheapest first."""
    first: dict[tuple[bytes, bytes], Fit] = {}
    for fit in sorted(found, key=lambda fit: fit.criterion):
        first.setdefault((fit.state.active.tobytes(), fit.state.moving.tobytes()), fit)
    return list(first.values())


def come_home(problem: Problem, fit: Fit, history: History) -> Fit:
    """Put axes of the offset back to where they cost nothing, if the criterion falls.

    The frames were compared at a small physics weight, at which weak terms do not count.
    """
    state = fit.state
    if fit.status is not Status.CONVERGED or not state.moving.any():
        return fit  # what has not converged is no law whose terms could tell
    closed = _closed(problem, fit, FINAL_WEIGHT)
    law = _as_shifted(problem, closed)
    variants = _variants(state.offset, problem.home)
    priced = [_candidate(problem, closed, law, *variant) for variant in variants]
    closest = min(priced, key=lambda candidate: candidate.criterion)
    if closest.criterion < fit.criterion and closest.state.moving.sum() < state.moving.sum():
        trial = select(problem, closest, FINAL_WEIGHT, "offset home", history)
        if trial.criterion < fit.criterion:
            return trial
    return fit


def leave_home(problem: Problem, fit: Fit, history: History) -> Fit:
    """Move axes off home where terms make up for their staying there, while the criterion falls."""
    elsewhere = away(problem, fit.state)
    if fit.status is not Status.CONVERGED or not elsewhere:
        return fit  # as in `come_home`
    closed = _closed(problem, fit, FINAL_WEIGHT)
    law = _as_shifted(problem, closed)
    starts = [_candidate(problem, closed, law, *there) for there in elsewhere]
    for start in sorted(starts, key=lambda candidate: candidate.criterion)[:REFINED]:
        if not start.criterion < fit.criterion + problem.penalties.max():
            break
        trial = select(problem, start, FINAL_WEIGHT, "offset away", history)
        if trial.criterion < fit.criterion - PLATEAU:
            return leave_home(problem, trial, history)  # one axis at a time: the others next
    return fit


def away(problem: Problem, state: State) -> list[tuple[Floats, Bools]]:
    """Origins at which a term of a law vanishes, where motion is, and the axes then off home.

    Terms that a move brings in are the data's to decide on, while the origin moves.
    """
    exponents, home = problem.exponents, problem.form.movable & ~state.moving
    frames = ShiftedLaw(exponents, state.coefficients, np.empty(0), home)
    below = divides(exponents, home) & ~np.eye(len(exponents), dtype=bool)
    low, high = problem.box
    found: list[tuple[Floats, Bools]] = []
    entries = np.argwhere((state.active & (below @ state.active)).T)
    for step in frames.vanish(np.zeros((len(entries), problem.d)), entries[:, None]):
        origin, moved = state.offset + step, np.abs(step) > ROUNDING
        known = any(np.allclose(origin, other) for other, _ in found)
        inside = ((low <= origin) & (origin <= high))[moved].all()  # not if it is infinite
        if inside and moved.any() and not known:
            found.append((origin, state.moving | moved))
    return found


def bridge(problem: Problem, fit: Fit, history: History) -> Fit:
    """Integrate the law across gaps and search again with the physics enforced there.

    A smoothing spline crosses a gap on the wrong branch, so until here the physics was cut
    at gaps. Groups of gaps are tried, shortest first; a group whose bridges spoil the fit is
    halved, down to single gaps.
    """
    for _ in range(3):
        open_gaps = gaps(fit.collocation.segments)
        if not open_gaps:
            break
        before = fit.state.active
        fit = _bridge_group(problem, fit, open_gaps)
        fit = select(problem, fit, FINAL_WEIGHT, "subset search, bridged", history)
        fit = come_home(problem, fit, history)
        if (fit.state.active == before).all():
            break
    return fit


def _bridge_group(problem: Problem, fit: Fit, group: list[Gap]) -> Fit:
    """The fit with these gaps crossed, or those of them that the data allow."""
    law = problem.law(fit.state).shift(fit.state.offset)
    splines = fit.collocation.grid.splines(fit.state.control_points)
    joined, curves = join(
        fit.collocation.segments, splines, group, problem.trajectories, law, problem.spacing
    )
    bridged = problem.collocation(joined)
    start = replace(fit.state, control_points=fit_curves(bridged, curves))
    trial = tightened(problem, bridged, start)
    # A bridge takes away the freedom of one initial condition: so much may the fit lose.
    freedom = problem.d * len(group) + (bridged.counts - fit.collocation.counts).sum()
    loss = trial.collocation.objective(trial.state) - fit.collocation.objective(fit.state)
    if loss < freedom + 4 * np.sqrt(2 * freedom):
        return replace(fit, state=trial.state, collocation=trial.collocation)
    if len(group) > 1:
        for half in (group[: len(group) // 2], group[len(group) // 2 :]):
            fit = _bridge_group(problem, fit, half)
    return fit
