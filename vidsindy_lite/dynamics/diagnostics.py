"""Whether a discovered law should be trusted: each warning in words, with advice.

A warning is a necessary sign of trouble, not a sufficient one: a law without one may be wrong.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.stats import chi2

from ..arrays import Floats
from .beyond import Wider, beyond_the_library, place, spoken, widened
from .collocation import CLEANEST, Fit, Linearisation, Status
from .elsewhere import NEAR_TIE, elsewhere, pinned, untold_origins
from .errors import passing, residual_noise
from .path import RESOLVED, Path
from .polynomials import PolynomialSystem
from .problem import COARSE, Problem
from .selection import closest_rival
from .shape import cancelling, shapes, tied
from .state import State
from .trajectories import Trajectory, typical_step

MISFIT = 1.5
"""Residual over estimated noise beyond which the law does not fit."""
TURNS = 1.5
"""Turns of the motion that a trajectory should cover."""
REPEATED = 10.0
"""Turns that tell kicks from a wrong law, which misses the same whenever the motion comes by."""
LONGEST_STEP = 1.0
"""Longest typical time step, in time scales of the motion (about 6 to a turn)."""
OUTLIER = 30.0
"""Distance of a sample from those around it, over how far nine samples in ten are from the median,
and over the typical distance of those around it, that no motion explains. Noise of 50 % makes 6."""
GUARD, REACH = 2, 8
"""The samples around one are those from 3 to 8 before and after it: so up to three errors in a row
are compared with what is none."""
CHANCE = 1e-4
"""Probability below which what the left-out terms explain together is no chance."""
RIVAL = 0.5
"""Width of another plateau, over that of the law's own, from which on the law is contested."""
UNMET = 1e-2
"""Root mean square residual of the law along the curve, relative to the speed."""
WILD = 2.0
"""The same residual over that of the kicks of the motion."""
APART = 0.2
"""Root mean square distance of the law's two frames along the curve, relative to the speed: more
than terms that cannot be told from zero make."""
MEANING = {
    Status.MAX_STEPS: "its coefficients may be off by more than their errors",
    Status.STALLED: "terms may be indistinguishable on these data",
}
"""What a fit that ended so may mean."""
BEYOND_COUNTING = 100.0
"""Times a noise beyond which it was all but none, and its multiples say nothing."""


def diagnose(
    problem: Problem,
    fit: Fit,
    model: Linearisation,
    path: Path,
    law: PolynomialSystem,
    margins: Floats,
) -> tuple[str, ...]:
    """Reasons not to trust a law.

    Parameters
    ----------
    problem : Problem
        The data, and the noise as it was estimated before any law was known.
    fit : Fit
        The final fit, its noise re-estimated from the residual.
    model : Linearisation
        Around it, of all candidates.
    path : Path
        On which its terms were chosen.
    law : PolynomialSystem
        The law in the frame of the data.
    margins : ndarray, shape (l d,)
        By how much the criterion rises if a term of this law is taken out or put back, equation
        by equation.
    """
    wider = widened(problem, fit)
    return (
        *outliers(problem.measured),
        *_shape(problem, fit),
        *_misfit(problem, fit, wider),
        *_doubtful_sigma(problem, fit),
        *_unfinished(fit),
        *_unmet(problem, fit),
        *_another_in_the_data(problem, fit, law),
        *_selection(problem, fit, model, wider, path, law),
        *_sampling(problem),
        *_standstill(law, _remedy(fit)),
        *_narrow(law, margins),
    )


def outliers(trajectories: Sequence[Trajectory]) -> list[str]:
    """Samples so far from those around them that they must be errors.

    Parameters
    ----------
    trajectories : sequence of Trajectory
        The data in the user's units.
    """
    found = []
    for t, x in trajectories:
        far: set[int] = set()
        for column in x.T[np.isfinite(x).any(axis=0)]:
            seen = np.flatnonzero(np.isfinite(column))
            values = column[seen]
            away = np.abs(values - np.median(values))
            spread = np.quantile(away, 0.9)
            rows = np.flatnonzero((away > OUTLIER * spread) & (spread > 0)).tolist()
            far |= {int(seen[row]) for row in rows if _leaps(values, row)}
        found += [
            f"t = {t[row]:g}, x = ({', '.join(f'{v:g}' for v in x[row])})" for row in sorted(far)
        ]
    if not found:
        return []
    more = f" and {len(found) - 3} more" if len(found) > 3 else ""
    return [
        f"a sample lies far from those before and after it: {'; '.join(found[:3])}{more}: no "
        "motion explains that; put NaN in its place"
    ]


def _leaps(values: Floats, row: int) -> bool:
    """Whether a sample is far from those around it, too, and not part of a motion far away."""
    before, after = values[max(row - REACH, 0) : max(row - GUARD, 0)], values[row + GUARD + 1 :]
    beside = np.concatenate((before, after[: REACH - GUARD]))
    middle = np.median(beside)
    return bool(abs(values[row] - middle) > OUTLIER * np.median(np.abs(beside - middle)))


def _shape(problem: Problem, fit: Fit) -> Iterator[str]:
    """What follows from where the motion takes place."""
    measured = problem.measured[0][1].shape[1]
    noise = (problem.noise * problem.units.scale)[:measured]
    terms = fit.state.active.sum(axis=0)[-measured:]
    if problem.form.functions:
        terms = np.zeros_like(terms)  # who names a sine knows more than one orbit tells
    rows = [np.isfinite(values).all(axis=1) for _, values in problem.measured]
    whole = [(t[r], x[r]) for r, (t, x) in zip(rows, problem.measured, strict=True) if r.any()]
    if whole:
        yield from shapes(whole, noise, problem.form.names[:measured], terms)
    x, _ = fit.collocation.node_states(fit.state.control_points)
    yield from cancelling(problem.law(fit.state), x - fit.state.offset)
    states = problem.form.states
    yield from tied(problem.form.names[:states], x[:, :states])


def _misfit(problem: Problem, fit: Fit, wider: Wider) -> Iterator[str]:
    residual = residual_noise(fit)
    seen = (fit.collocation.counts > 0) & (residual > RESOLVED)
    ratio = np.where(seen, residual / problem.noise, 0.0)
    misses = ~(ratio < MISFIT)
    # A curve without a law follows errors that last, too: they are no misfit.
    if misses.any() and wider.beyond.count and not wider.beyond.significant:
        misses &= ~passing(fit, len(wider.law.terms))
    if misses.any():
        j = int(np.where(misses, ratio, 0.0).argmax())
        told = "sigma" if problem.measured_errors else "the noise estimated beforehand"
        many = ratio[j] > BEYOND_COUNTING
        times = f"more than {BEYOND_COUNTING:g}" if many else f"{ratio[j]:.1f}"
        yield (
            f"the curve misses the data of {problem.form.names[j]} by "
            f"{residual[j] * problem.units.scale[j]:.3g} ({100 * residual[j]:.3g} % of its spread, "
            f"{times} times {told}): errors may last for several samples, the law may lie outside "
            "the library (raise the degree), or the motion may not be autonomous"
        )


def _doubtful_sigma(problem: Problem, fit: Fit) -> Iterator[str]:
    """Are the errors that were given larger than what is left?"""
    ratio = problem.noise / residual_noise(fit) if problem.measured_errors else np.zeros(problem.d)
    j = int(ratio.argmax())
    if ratio[j] > MISFIT:
        yield (
            f"sigma of {problem.form.names[j]} is {ratio[j]:.3g} times the errors that the law "
            "leaves: the error bars are too wide, and terms may be lost; leave it out, and the "
            "errors are estimated"
        )


def _unfinished(fit: Fit) -> Iterator[str]:
    if fit.status is not Status.CONVERGED:
        yield (
            f"the last fit did not converge ({fit.status.value}): {MEANING[fit.status]}; use "
            f"{_remedy(fit)}, or a lower degree"
        )


def _unmet(problem: Problem, fit: Fit) -> Iterator[str]:
    residual = float(np.sqrt((fit.collocation.physics_residual(fit.state) ** 2).mean()))
    if not residual < max(UNMET, WILD * float(problem.process_noise.max())):
        yield (
            f"the law is not met along the curve (residual {residual:.2g} of the speed): the fit "
            f"did not converge; use {_remedy(fit)}, or another degree"
        )


def _another_in_the_data(problem: Problem, fit: Fit, law: PolynomialSystem) -> Iterator[str]:
    units, (x, _) = problem.units, fit.collocation.node_states(fit.state.control_points)
    native = problem.law(fit.state)(x - fit.state.offset)
    slopes = law(units.point(x)) * units.time / units.scale
    apart = float(np.sqrt(((slopes - native) ** 2).mean()))
    if not apart < APART:
        yield (
            f"the law in the frame of the data is not that in its own frame (apart by {apart:.2g} "
            "of the speed): terms that belong together were told apart; use the native law"
        )


def _selection(
    problem: Problem,
    fit: Fit,
    model: Linearisation,
    wider: Wider,
    path: Path,
    law: PolynomialSystem,
) -> Iterator[str]:
    remedy, clean = _remedy(fit), _is_clean(fit)
    yield from _contested(problem, fit.state, path, remedy)
    if clean and not problem.kicked:
        return  # what is left is the error of the splines, not noise: it settles nothing
    tolerant = clean or max(plateau.low for plateau in path.of(fit.state.active)) > path.lowest
    yield from beyond_the_library(wider, noisy=not tolerant)
    origins = list(pinned(problem, fit.state, model, law, path.tolerated))
    if not tolerant:  # weaker errors than those tolerated say nothing about the law
        # The offset stays where it is: with it free, the same law in another frame would count.
        yield from _left_over(model.of(problem.form.searched), fit.state)
        yield from _near_tie(wider, remedy)
        origins += elsewhere(problem.cautious, fit.state, model, law)
    yield from untold_origins(origins, remedy)


def _is_clean(fit: Fit) -> bool:
    """Whether the data have no errors that the splines could tell from their own."""
    return bool((fit.collocation.data_weights**-0.5 <= CLEANEST).all())


def _remedy(fit: Fit) -> str:
    """What data would settle it: what is clean cannot be cleaner."""
    if _is_clean(fit):
        return "a longer trajectory, denser samples or other starts"
    return "cleaner samples or a longer trajectory"


def _range(low: float, high: float) -> str:
    """Two ends with as many digits as tell them apart."""
    for digits in range(1, 4):
        ends = f"{low:.{digits}g}", f"{high:.{digits}g}"
        if ends[0] != ends[1]:
            return f"from {ends[0]} to {ends[1]}"
    return f"at {ends[0]}"


def _contested(problem: Problem, state: State, path: Path, remedy: str) -> Iterator[str]:
    """Is another plateau more than half as wide, where errors last also one of larger errors?"""
    lasting, law = problem.shared or path.level > path.lowest, problem.law(state)
    for own, plateaus in zip(path.of(state.active), path.plateaus, strict=True):
        near = [plateau for plateau in plateaus if plateau.low <= path.level]
        same = [plateau for plateau in near if (plateau.terms == own.terms).all()]
        own = max(same, key=path.width, default=own)
        others = [
            plateau
            for plateau in plateaus
            if (plateau.terms != own.terms).any() and (plateau in near or lasting and same)
        ]
        rival = max(others, key=path.width, default=None)
        if rival and path.width(rival) > RIVAL * path.width(own):
            changed = np.flatnonzero(rival.terms != own.terms).tolist()
            change = ", ".join(
                f"{'with' if rival.terms[k] else 'without'} {spoken(law, k, own.equation)}"
                for k in changed
            )
            yield (
                f"d{law.names[own.equation]}/dt is settled by how large an error is tolerated: "
                f"it stays the same {_range(own.low, own.high)} of the spread of the data, and "
                f"{change} {_range(rival.low, rival.high)}; use {remedy}"
            )


def _left_over(model: Linearisation, state: State) -> Iterator[str]:
    """Would all candidates together explain more than chance (Rao's score test)?"""
    gain = float(model.gradient @ model.newton()[0])
    unused = len(model.columns) - int(state.free()[model.columns].sum())
    if unused and not chi2.sf(gain, unused) > CHANCE:
        yield (
            f"the terms left out explain more than chance (chi-square {gain:.4g} for {unused}): a "
            "term may be missing, or the errors of the measurements depend on each other"
        )


def _near_tie(wider: Wider, remedy: str) -> Iterator[str]:
    """Would another law fit almost as well, of the library or of a higher degree?"""
    model, law = wider.candidates, wider.law
    cost, dropped, added = closest_rival(
        model.information,
        model.gradient,
        wider.state.flat()[model.columns],
        wider.prices[model.columns],
        wider.state.free()[model.columns],
    )
    if cost > NEAR_TIE:
        return
    out, into = (
        " and ".join(place(law, k) for k in model.columns[entries]) for entries in (dropped, added)
    )
    change = (
        f"{into} instead of {out}" if out and into else f"with {into}" if into else f"without {out}"
    )
    frame = "in its own frame, " if wider.state.moving.any() else ""
    yield (
        f"another law fits almost as well: {frame}{change} (criterion {cost:+.1f}); the data "
        f"do not settle it: use {remedy}"
    )


def _standstill(law: PolynomialSystem, remedy: str) -> Iterator[str]:
    if law.order == 2:
        return  # what moves without a force moves evenly
    for j in np.flatnonzero(~law.support.any(axis=0)):
        name = law.names[j]
        yield f"no term was found for d{name}/dt although {name} moves: use {remedy}"


def _narrow(law: PolynomialSystem, margins: Floats) -> Iterator[str]:
    close, kept = np.flatnonzero(margins < NEAR_TIE).tolist(), law.support.T.ravel()
    changes = ", ".join(f"{'without' if kept[k] else 'with'} {place(law, k)}" for k in close)
    if changes:
        yield (
            f"in the frame of the data another law fits almost as well: {changes} (criterion "
            f"{margins[close].min():+.1f}); the standard errors do not count this in"
        )


def _sampling(problem: Problem) -> Iterator[str]:
    form, step = problem.form, typical_step(problem.trajectories)
    # On a line nothing turns; a body need not, if it is seen from several starts.
    bound = form.states > 1 and (form.movable.all() or len(problem.trajectories) == 1)
    if problem.turns < TURNS and bound:
        yield (
            f"the trajectory covers only {problem.turns:.1f} turns of the motion: terms may be "
            "indistinguishable on it; record longer, or several runs from other starts"
        )
    if step > LONGEST_STEP:
        yield f"only {2 * np.pi / step:.1f} samples per turn of the motion: sample faster"
    coarse, short = problem.samples_a_turn < COARSE, problem.turns < REPEATED
    if problem.kicked and (coarse or short):
        few = f"{problem.turns:.1f} turns of {problem.samples_a_turn:.0f} samples each"
        yield (
            f"the motion is taken for kicked at random, which {few} cannot tell from a drive or a "
            f"force that nobody named: {'sample faster' if coarse else 'record longer'}, or name it"
        )
