"""The path of laws over the tolerated error, and the law that stays the same over most of it.

One objective, in standard units, with ``s`` the error that is tolerated over that of the data::

    J_s = s^-2 (sum w r^2 / sigma^2 + sum |x' - Theta(x - Delta) Lambda|^2 / q)
          + penalty (|Lambda|_0 + |Delta|_0)

A smooth error of a thousandth (of an integrator, of a lens) is a small change of the law: terms
that no noise model refuses, each worth its penalty. Raise the error that is tolerated, and the law
changes at every step until only the terms remain that the motion needs; then it stays the same over
a wide range. So each equation has a *path* of laws over ``s``, and the widest plateau, in decades,
is the law (stability selection). To tolerate an error is to divide the quadratic model of a fit by
``s^2``: around a fit the whole path is small algebra.

So there is one loop. A first law at a large ``s``; the path around it down to the errors of the
data; of each equation the widest plateau; that law fitted where it begins; and again, until the
path around a law leads to that law.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..arrays import Bools
from .collocation import Fit, State, Status
from .frames import Origin, cheapest, closed, free_offsets, with_fewer_axes
from .l0 import NEGLIGIBLE, STRONG, inverse, minimiser, subset_search
from .noise import (
    CONSISTENT,
    TOLERATED,
    effective_noise,
    errors_left,
    residual_noise,
    time_inflation,
)
from .problem import (
    FINAL_WEIGHT,
    WEIGHTS,
    Problem,
    fit_curves,
    leaves_something_over,
    tightened,
    typical,
    unpruned,
)
from .result import History, Path, Plateau

#: Where errors are smooth, a plateau may begin here: terms below are as likely made by the errors.
#: Independent errors average out, and whatever they do not explain is a term.
SMOOTH = 0.1
#: Largest error on a path, that of no law at all; and decades between two laws of a path.
LARGEST, STEP = 1.0, 0.1
ROUNDS = 6  #: Most laws to which paths lead, each followed around the law before.
LONGEST_SEARCH = 10  #: Most rounds of a subset search, and most moves of an origin.
EXACT = 1e-4  #: Tolerance of the last fits: a hundredth of a standard error, squared.


def follow(problem: Problem, fit: Fit) -> Path:
    """The path of laws around a fit at a physics weight at which the law holds exactly.

    Parameters
    ----------
    problem : Problem
        Its penalties.
    fit : Fit
        Around which.
    """
    model = problem.model(fit)
    columns = model.columns
    present, support = fit.state.flat()[columns], fit.state.free()[columns]
    own = typical(np.maximum(fit.collocation.data_weights**-0.5, problem.process_noise))
    single = np.full(problem.d, own) if problem.has_process_noise else residual_noise(fit)
    lasting = single if problem.has_process_noise else effective_noise(fit)
    lowest = min(typical(single), LARGEST / 10**STEP)
    # No measurement is as good as a ten-thousandth, but a simulation may be: its errors are smooth.
    smooth = bool((lasting > 2 * single).any() or typical(single) <= 1e-4)
    level = max(lowest, time_inflation(fit) * typical(lasting), SMOOTH if smooth else 0.0)
    count = int(np.ceil(np.log10(LARGEST / lowest) / STEP))
    # What has to be tolerated is asked itself: a plateau may begin just below it.
    levels = np.union1d(np.geomspace(lowest, LARGEST, count + 1), min(level, LARGEST))
    flat = np.zeros((len(levels) - 1, problem.form.candidates.size), dtype=bool)
    for terms, low in zip(flat, levels[:-1].tolist(), strict=True):
        at = model.tolerating((own / low) ** 2)
        costs = problem.costs(columns)
        support, _, _ = subset_search(at.information, at.gradient, present, costs, support)
        terms[problem.form.searched] = support[: len(problem.form.searched)]
    laws = flat[:, problem.form.shared].reshape(len(flat), problem.d, -1)
    plateaus = (_plateaus(j, levels.tolist(), laws[:, j]) for j in range(problem.d))
    return Path(fit, model, own, level, tuple(plateaus))


def _plateaus(equation: int, levels: list[float], laws: Bools) -> tuple[Plateau, ...]:
    """The ranges between levels in which laws of an equation, (n, l), one after the other agree."""
    changes = np.flatnonzero((laws[1:] != laws[:-1]).any(axis=1)) + 1
    ends = pairwise([0, *changes.tolist(), len(laws)])
    return tuple(Plateau(equation, levels[low], levels[high], laws[low]) for low, high in ends)


# ------------------------------------------------------------------------------------ a first law


def first_law(problem: Problem, history: History, tolerated: float | None = None) -> Fit:
    """A law at a large tolerated error: of terms of low degree, and of all if these miss something.

    The error is relative to the spread of the data, `TOLERATED` by default; where the noise is
    larger, that is tolerated, and process noise is as it is. Of long data it is the law of a part,
    if that fits all.
    """
    least = TOLERATED if tolerated is None else tolerated
    noise = problem.noise if problem.has_process_noise else np.maximum(problem.noise, least)
    tolerant, part = replace(problem, noise=noise), problem.part()
    if part is not problem:
        law = first_law(part, history, tolerated)
        collocation = tolerant.collocation(tolerant.segments())
        state = replace(law.state, control_points=fit_curves(collocation, problem.curves))
        fit = tightened(tolerant, collocation, state)
        if (residual_noise(fit) <= CONSISTENT * tolerant.noise).all():
            return fit  # else the part is not like the rest
    degrees, implicit = problem.exponents.sum(axis=1), problem.form.implicit
    # Terms of denominators come last: a factor above and below the line changes nothing.
    stages = [~implicit & (degrees <= 2), ~implicit, np.ones_like(implicit)]
    for rows in {rows.tobytes(): rows for rows in stages}.values():  # of those alike, one
        whole = unpruned(tolerant, rows)
        history.add("all terms", whole)
        fit = cheapest(tolerant, whole, [(problem.origin, np.zeros(problem.d, dtype=bool))])
        for weight in WEIGHTS:
            fit = select(tolerant, fit, weight, "subset search", history)
        fit = framed(tolerant, fit, history)
        if not leaves_something_over(tolerant, whole) or history.over:
            break
    return fit


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
    history.add(stage, best)
    for _ in range(LONGEST_SEARCH):
        state = best.state
        columns = problem.columns(state)
        model = weighted.linearise(state, columns, 0.0)
        support, solution, _ = subset_search(
            model.information, model.gradient, state.flat()[columns], problem.costs(columns),
            state.free()[columns],
        )  # fmt: skip
        if (support == state.free()[columns]).all():
            break
        promised = model.along(state, solution - state.flat()[columns], 1.0)
        trial = refit(replace(promised, active=promised.coefficients != 0))
        if not trial.criterion < best.criterion - NEGLIGIBLE or history.over:
            break
        best = trial
        history.add(stage, best)
    return best


def framed(problem: Problem, fit: Fit, history: History) -> Fit:
    """The law with its origin off the data's, or back, while the criterion falls.

    Axes move together, to where a term vanishes; only if that does not pay, one by one.
    """
    movable = problem.form.movable
    for _ in range(LONGEST_SEARCH):
        if fit.status is not Status.CONVERGED or history.over:
            break  # what has not converged is no law whose terms could tell
        together = free_offsets(problem, fit.state, movable)
        fewer = with_fewer_axes(problem, fit.state.offset)
        trial = _moved(problem, fit, [*together, *fewer], history)
        if not trial.criterion < fit.criterion:
            alone = [free_offsets(problem, fit.state, a) for a in np.diag(movable)[movable]]
            trial = _moved(problem, fit, [origin for one in alone for origin in one], history)
        if not trial.criterion < fit.criterion:
            break
        fit = trial
    return fit


def _moved(problem: Problem, fit: Fit, origins: Sequence[Origin], history: History) -> Fit:
    """The law in the cheapest of other frames; as it is where none is cheaper."""
    others = [there for there in origins if (there[1] != fit.state.moving).any()]
    if not others:
        return fit
    start = cheapest(problem, closed(problem, fit), others)
    if not start.criterion < fit.criterion + problem.penalties.max():
        return fit
    start = start.collocation.solve(start.state)  # its curve is still that of the frame before
    trial = select(problem, start, FINAL_WEIGHT, "another frame", history)
    low, high = problem.box
    inside = ((low <= trial.state.offset) & (trial.state.offset <= high)).all()
    return trial if inside and trial.criterion < fit.criterion - NEGLIGIBLE else fit


# ---------------------------------------------------------------------------- the law that persists


def persistent(problem: Problem, fit: Fit, history: History) -> tuple[Fit, Path, bool]:
    """The law whose terms are those of the widest plateaus of the path around it, and that path.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        A first law.
    history : History

    Returns
    -------
    fit : Fit
    path : Path
        Around it.
    persists : bool
        Whether the path leads to the law; else it is the last to which one led.
    """
    for k in range(ROUNDS):
        coarse = k > 0 or not near(problem, fit, TOLERATED)
        fit = at_own_errors(problem, fit) if coarse else polish(problem, fit, history)
        path = follow(problem, fit)
        if k == 0:
            path = deepest(problem, path, history)
        if coarse and has_terms(fit, path.widest()):
            fit = polish(problem, fit, history)
            path = follow(problem, fit)
        if has_terms(fit, path.widest()):
            return fit, path, fit.status is Status.CONVERGED
        other = refit(problem, path, history)
        stays = fit.status is Status.CONVERGED
        if other is None or (stays and other.status is not Status.CONVERGED):
            break  # what cannot be fitted is no law
        fit = other
        if not history.another():
            break
    fit = polish(problem, fit, history)
    path = follow(problem, fit)
    return fit, path, fit.status is Status.CONVERGED and has_terms(fit, path.widest())


def near(problem: Problem, fit: Fit, tolerated: float = 0.0) -> bool:
    """Whether a law leaves hardly more than the noise, or than is tolerated."""
    limit = CONSISTENT * np.maximum(problem.noise, tolerated)
    return bool((errors_left(problem, fit) <= limit).all())


def has_terms(fit: Fit, goal: Sequence[Plateau]) -> bool:
    """Whether a fit has the terms of these plateaus."""
    return all((p.terms == fit.state.active[:, p.equation]).all() for p in goal)


def deepest(problem: Problem, path: Path, history: History) -> Path:
    """The path around the last of the richer laws that explain what the one before left over.

    A missing term leaves smooth errors, too, and only its own law tells: so the error that is
    tolerated is lowered as long as that pays (`_explains`), to a third from one law to the next, of
    which there are six at most.
    """
    for _ in range(6):
        errors = errors_left(problem, path.fit)
        if near(problem, path.fit) or history.over:
            break
        tolerant = replace(problem, noise=np.maximum(problem.noise, errors / 3))
        weighted = replace(path.fit.collocation, data_weights=tolerant.noise**-2)
        start = replace(path.fit, collocation=weighted)
        fit = select(tolerant, start, FINAL_WEIGHT, "a smaller error", history)
        fit = at_own_errors(problem, framed(tolerant, fit, history))
        if fit.status is not Status.CONVERGED or not _explains(problem, path.fit, fit):
            break  # around what has not converged nothing is told
        path = follow(problem, fit)
    return path


def _explains(problem: Problem, before: Fit, after: Fit) -> bool:
    """Whether what a law takes of the errors of single samples is worth its terms.

    Of errors that last, with that law, any term takes some: only so many samples count as have
    independent errors, and the evidence has to be strong.
    """
    one, two = residual_noise(before), residual_noise(after)
    independent = after.collocation.counts * (two / effective_noise(after)) ** 2
    gain = independent @ np.log((one / two) ** 2)
    return bool(gain > problem.penalty(after.state) - problem.penalty(before.state) + STRONG)


def at_own_errors(problem: Problem, fit: Fit) -> Fit:
    """The fit weighted with the errors that it leaves, the law exact."""
    fit = replace(fit, collocation=problem.along(fit.collocation, fit.state))
    collocation = problem.weighted(fit.collocation, FINAL_WEIGHT)
    for _ in range(2):
        weighted = replace(collocation, data_weights=errors_left(problem, fit) ** -2)
        fit = weighted.solve(fit.state, tolerance=0.1, max_steps=10)
        if fit.status is not Status.CONVERGED:  # it creeps where the law is held too firmly
            fit = tightened(problem, weighted, fit.state)
    return fit


def refit(problem: Problem, path: Path, history: History) -> Fit | None:
    """The law of the widest plateaus of a path, fitted and framed where they begin.

    A plateau is told by the quadratic model around another law: none, if its own has a pole, or
    misses the data by more than is tolerated where the plateau begins.
    """
    goal = path.widest()
    tolerated = max(1.0, *(plateau.low / path.own for plateau in goal))
    tolerant = replace(problem, noise=errors_left(problem, path.fit) * tolerated)
    active = path.fit.state.whole(np.stack([plateau.terms for plateau in goal], axis=1))
    collocation = replace(path.fit.collocation, data_weights=tolerant.noise**-2)
    fit = tightened(tolerant, collocation, _restricted(path, active))
    fit = replace(fit, criterion=tolerant.criterion(fit.collocation, fit.state))
    if not np.isfinite(fit.criterion):
        return None
    history.add("another law of the path", fit)
    fit = framed(tolerant, fit, history)
    return fit if (residual_noise(fit) <= CONSISTENT * tolerant.noise).all() else None


def _restricted(path: Path, active: Bools) -> State:
    """The state that the quadratic model around a fit promises for other terms, (l, d)."""
    model, state, columns = path.model, path.fit.state, path.model.columns
    support, flat = np.append(active.T.ravel(), state.moving)[columns], state.flat()
    flat[columns] = minimiser(model.information, model.gradient, flat[columns], support)
    return state.moved(state.control_points, flat).of_terms(active)


def polish(problem: Problem, fit: Fit, history: History, most: int = 16) -> Fit:
    """Refit with the law exact and at the errors it leaves, on knots as fine as that needs.

    What knots do to a coefficient falls with the fourth power of their distance, so two fits tell
    into how many parts a span has to go: at ``most`` so many. Less than a tenth of a standard error
    is fine, or, of nearly exact data, a millionth.
    """
    collocation = problem.along(fit.collocation, fit.state)
    fit = problem.weighted(collocation, FINAL_WEIGHT).solve(fit.state, EXACT)
    columns, coarse = np.flatnonzero(fit.state.free()), fit.collocation.grid.segments
    before, parts = 1, 2
    while before < parts:
        last = fit
        finer = problem.collocation([s.refined(parts) for s in coarse], errors_left(problem, last))
        state = replace(last.state, control_points=fit_curves(finer, last.splines))
        fit = problem.weighted(problem.along(finer, state), FINAL_WEIGHT).solve(state, EXACT)
        if fit.status is not Status.CONVERGED:
            break
        allowed = np.maximum(0.1 * np.sqrt(np.diag(inverse(fit.information))), 1e-6)
        change = np.abs(fit.state.flat() - last.state.flat())[columns]
        error = (change / allowed).max(initial=0.0) / ((parts / before) ** 4 - 1)
        before = parts
        if error > 1:
            # A quarter more at once: the errors that the law leaves fall, too.
            parts = min(int(np.ceil(1.25 * parts * error**0.25)), most)
    history.add("polish", fit)
    return fit


def information_criterion(problem: Problem, fit: Fit) -> float:
    """What a law costs whose noise is its own: n log variance, and the penalty of its terms.

    The lower, the better (Bayesian information criterion); of laws of the same data. Measurements
    that are dropped are as likely anywhere in the spread of the data.
    """
    counts = fit.collocation.counts
    seen = counts > 0
    # Under process noise, what is not foretold: the curve follows its data.
    foretold = np.hypot(problem.noise, problem.process_noise)
    single = foretold if problem.has_process_noise else residual_noise(fit)
    return float(counts[seen] @ np.log(single[seen] ** 2)) + problem.penalty(fit.state)
