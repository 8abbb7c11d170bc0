"""Whether a discovered law should be trusted: each warning in words, with advice.

A warning is a necessary sign of trouble, not a sufficient one: a law without one may be wrong. What
is looked at: where the motion takes place, terms beyond the library (omitted-term score test),
other origins, other laws, the fit and its samples.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.special import betaincc, chdtrc, chdtri

from ..arrays import Bools, Floats, Ints
from .collocation import CLEANEST, Fit, Linearisation, State, Status, WithCurve
from .data import Trajectory, typical_step
from .frames import closed, free_offsets, laws_at
from .l0 import RIDGE, STRONG, far_neighbours, newcomers, prior_penalties, subset_search
from .library import monomial_exponents, monomials, shift_generators, shift_matrix
from .mechanics import FAINT, Round, on_circle, on_sphere
from .model import PolynomialSystem, place, spoken
from .noise import CONSISTENT, GROSS, TOLERATED, effective_noise, passing, residual_noise
from .problem import COARSE, Problem, typical
from .result import Path

# --------------------------------------------------------------------------------------------------
# Where a motion takes place: a coordinate at rest, a circle, a sphere; any plane or quadric of the
# states, velocities included.
#
# There the terms of a library depend on each other, and many laws fit alike. A motion is on a
# shape if its distance from it, less the noise, is nothing of the size of the shape: not because
# noise may hide it, but because the data are good enough to tell.

#: Share of a size that is none: the scales of coordinates and cameras are off by as much.
CLOSE = 0.005
PLAIN = 3.0  #: Standard errors beyond which something stands out from the noise.


def shapes(x: Floats, noise: Floats, names: Sequence[str]) -> Iterator[str]:
    """What there is to say of where a motion takes place, with what to do about it.

    Parameters
    ----------
    x : ndarray, shape (n, d)
        The data, in the user's units.
    noise : ndarray, shape (d,)
        Estimated standard deviation of the errors of each coordinate.
    names : sequence of str
        Of the coordinates.
    """
    for j in np.flatnonzero(~_moving(x, noise)).tolist():
        yield f"{names[j]} moves by no more than a part of its noise: leave it out"
    where = where_round(x, noise)
    if where is not None:
        round_one, _, _ = str(where).partition("\n")
        free = "angle is" if where.shape == "circle" else "angles are"
        yield (
            f"the motion stays on a {round_one}: there its coordinates depend on each other and "
            f"many laws fit alike; its {free} free (on_{where.shape} finds it), and order=2 a law"
        )


def _moving(x: Floats, noise: Floats) -> Bools:
    """Which coordinates move by more than half of their noise, (d,)."""
    centred = x - x.mean(axis=0)
    return np.array([_distance(centred[:, [j]], e)[1] / e > 0.5 for j, e in enumerate(noise)])


def _across(x: Floats, noise: Floats) -> int:
    """Across how many directions a motion is flat."""
    d, scale = x.shape[1], x.std(axis=0)
    standard = (x - x.mean(axis=0)) / scale
    _, directions = np.linalg.eigh(standard.T @ standard)
    wide = [
        _on(standard @ normal[:, None], float(np.linalg.norm(normal * noise / scale)), 1.0)
        for normal in directions.T[: d - 1]
    ]
    return wide.index(False) if False in wide else d - 1


def where_round(x: Floats, noise: Floats, places: bool = False) -> Round | None:
    """The circle or sphere of what moves of a motion, (n, d), if it is on one.

    Of two coordinates that go round, one may be the speed of the other, or hunt it: only what turns
    back on its arc, as nothing does that is not bound to it, is a bob; it may be ten times as far
    off, and its arc twice as high as the noise. Of what are ``places`` for sure, as in space, half
    a turn is enough.
    """
    moves = _moving(x, noise)
    x, noise, d = x[:, moves], noise[moves], int(moves.sum())
    flat = _across(x, noise) if d in (2, 3) else d
    planar = d - flat == 2
    if not planar and (flat or d != 3):
        return None
    try:
        where = on_circle(x) if planar else on_sphere(x)
    except ValueError:  # nothing round is closer than what is flat
        return None
    widths = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(x.T)), 0.0))
    toward = x - where.centre
    reach = np.linalg.norm(toward, axis=1)
    outward = (toward / reach[:, None]) ** 2
    off, error = (reach - where.radius)[:, None], float(np.sqrt((outward @ noise**2).mean()))
    if not planar:
        return where if _on(off, error, widths[0]) else None
    if np.quantile(np.abs(np.diff(where.angle)), 0.9) > np.pi / 2:
        return None  # the way between samples is not known
    # Averages tell the way along the arc, not the noise.
    pieces = [piece.mean() for piece in np.array_split(where.angle, min(50, len(x)))]
    length = float(np.ptp(pieces))
    back = np.abs(np.diff(pieces)).sum() > 1.5 * length
    bound = back or (d > 2 or places) and length > np.pi
    close, told = (10 * CLOSE, 0.5) if back else (CLOSE, 0.1)
    return where if bound and _on(off, error, widths[-2], close, told) else None


def related(names: Sequence[str], x: Floats, degree: int, error: float) -> Iterator[str]:
    """What to say if states of a motion, (n, d), in standard units, depend on each other.

    A law of some degree plus a polynomial of no higher one that is zero along the motion is another
    such law; planes and quadrics are looked for. The mean square of a polynomial over that of its
    gradient is how far from its zeros the motion is, squared (Taubin 1991): at least, the lowest
    eigenvalue of the two. It is none if the data, a mean of which is known to an ``error``, do not
    tell it from zero.
    """
    spread = x.std(axis=0)
    moves = spread > CLOSE  # a velocity may be constant
    states, moving = (x - x.mean(axis=0))[:, moves] / spread[moves], np.array(list(names))[moves]
    for k in range(1, min(degree, 2) + 1) if len(moving) > 1 else ():
        exponents = monomial_exponents(len(moving), k)
        values, rates = monomials(states, exponents), shift_generators(exponents)
        squares = values.T @ values / len(values)
        slopes = (rates.swapaxes(1, 2) @ squares @ rates)[:, 1:, 1:]
        apart = squares[1:, 1:] - np.outer(squares[1:, 0], squares[0, 1:])  # but for a constant
        least = RIDGE * np.eye(len(apart)) * apart.trace()
        apart_by, zeros = eigh(apart, slopes.sum(axis=0) + least)
        zeros = zeros[:, apart_by < min(CLOSE, PLAIN * error) ** 2]
        if zeros.size:  # of several, any combination is one, too: all of their coordinates
            shares = np.einsum("ki,jkl,li->j", zeros, slopes, zeros)
            of = ", ".join(moving[shares > CLOSE * shares.max()])
            yield (
                f"{of} depend on each other on these data (a relation of degree {k} holds): many "
                "laws fit alike; leave out what follows from others, or add runs from other starts"
            )
            return


def _on(
    residual: Floats, noise: float, size: float, close: float = CLOSE, told: float = 0.1
) -> bool:
    """Whether distances from a shape of some size, (n, k), are those of noise.

    Not because noise may hide more: the data have to be good enough to tell a share of the size.
    """
    least, most = _distance(residual, noise)
    return least < close * size and most < told * size


def _distance(residual: Floats, noise: float) -> tuple[float, float]:
    """Root mean square of a distance less its noise, at least and at most.

    What it is more than the noise, or what it has in common with its neighbour, whichever is more.
    """
    square = float((residual**2).mean())
    more = max(square - noise**2, float((residual[1:] * residual[:-1]).mean()))
    unsure = PLAIN * square * np.sqrt(2 / residual.size)
    return float(np.sqrt(max(more - unsure, 0.0))), float(np.sqrt(max(more, 0.0) + unsure))


# --------------------------------------------------------------------------------------------------
# Beyond the library: whether terms of higher degree explain what a law leaves of its data.
#
# A cubic imitates a sine, the drag of air or the pull of a planet on the path that was recorded,
# and nowhere else. What it leaves is small but follows the state, so that terms of the next two
# degrees explain it: Rao's score test, of all of them together and of the best of them. And where
# noise hides what it leaves, a law with one of them may fit as well.


def more_than_chance(gain: float, count: int) -> bool:
    """Whether so many further unknowns explain more than chance makes them, in chi-square units.

    Half more, where errors are all but independent, such as those of tracks in compressed video
    (1.2 was seen).
    """
    return bool(count and gain > 1.5 * chdtri(count, 1e-4))


@dataclass(frozen=True)
class Wider:
    """A fit among the candidates of a library and the terms of the next degrees.

    Parameters
    ----------
    problem : Problem
        With all of these as candidates; its penalties are those of the library alone.
    fit : Fit
        With the old terms alone.
    further : ndarray of int
        Places in the coefficients, equation by equation, of terms that the library has not.
    """

    problem: Problem
    fit: Fit
    further: Ints

    @cached_property
    def model(self) -> WithCurve:
        """The quadratic model around the fit, in all candidates and moving axes."""
        return self.problem.model(self.fit)

    @cached_property
    def own(self) -> Ints:
        """What the law has."""
        return np.flatnonzero(self.fit.state.free())

    @cached_property
    def others(self) -> Ints:
        """What it has not: further terms, and those of the library."""
        return np.setdiff1d(self.problem.form.searched, self.own)

    @cached_property
    def gain(self) -> float:
        """What all further terms lower the objective by, in chi-square units."""
        model = self.model.of(np.append(self.own, self.further))
        return float(model.newton()[1] - model.fall)

    @cached_property
    def single(self) -> Floats:
        """What each of the others does by itself."""
        model = self.model.of(np.append(self.own, self.others))
        estimate, variance = newcomers(model.information, model.gradient, len(self.own))
        return estimate**2 / variance

    @property
    def significant(self) -> bool:
        """Whether that is more than chance makes."""
        several, count = more_than_chance(self.gain, len(self.further)), len(self.others)
        best = self.single.max(initial=0.0)
        return bool(several or self.further.size and chdtrc(1, best) * count < 1e-3)

    @property
    def decisive(self) -> bool:
        """Whether one term, or few, explain nearly all that is left, be that noise or not.

        Errors that last, of an integrator or a lens, are spread over several (up to two thirds in
        one were seen). Few have four times as many errors left as they are; and of as many
        independent errors as are left, one direction seldom has such a share.
        """
        left = float(self.fit.collocation.objective(self.fit.state))
        best, count = self.single.max(initial=0.0), len(self.further)
        share, independent = min(best / left, 1.0), max(left - 1, 0.0) / 2
        alone = independent and betaincc(0.5, independent, share) * len(self.others) < 1e-3
        few = count and 4 * count < left
        return bool(alone and best > 0.9 * left or few and self.gain > 0.9 * left)


def widened(problem: Problem, fit: Fit, budget: float = 5e6) -> Wider:
    """The last fit among terms beyond its library; of a fraction, in its numerators.

    Further terms are such as no function of the library is. The budget is of entries of the
    derivatives of the data, or the curve, in these.
    """
    form, state, (size, d) = problem.form, fit.state, problem.form.known.shape
    equations, along = np.flatnonzero(form.candidates.any(axis=0)), fit.collocation.grid
    entries = max(along.x.size, along.r * d) * len(equations)
    exponents = _higher(problem.exponents, form.states, budget / entries)

    def padded(array: NDArray[Any]) -> NDArray[Any]:
        return np.pad(array, ((0, len(exponents) - size), (0, 0)))

    candidates = padded(form.candidates)
    candidates[size:, equations] = True
    places = np.arange(candidates.size).reshape(d, -1)
    shared = places.copy()
    shared[:, :size] = places[:, :size].ravel()[form.shared].reshape(d, size)
    state = replace(
        state, coefficients=padded(state.coefficients), active=padded(state.active),
        shared=shared.ravel(),
    )  # fmt: skip
    known = padded(fit.collocation.known)
    whole = replace(fit.collocation, exponents=exponents, known=known)
    fit = replace(fit, state=state, collocation=whole)
    form = replace(
        form, exponents=exponents, candidates=candidates, known=padded(form.known),
        shared=shared.ravel(),
    )  # fmt: skip
    new = form.searched % len(exponents) >= size
    wider = Wider(replace(problem, form=form), fit, form.searched[new])
    if form.functions:
        model = wider.model.of(np.append(form.searched[~new], wider.further))
        _, variance = newcomers(model.information, model.gradient, int((~new).sum()))
        candidates.T.flat[wider.further[~np.isfinite(variance)]] = False
        wider = replace(wider, further=wider.further[np.isfinite(variance)])
    return wider


def _higher(exponents: Ints, d: int, most: float) -> Ints:
    """A library with the monomials of two further degrees, as an odd function needs two.

    Of few variables each, if they are many. Its first ``d`` columns are the variables, of which
    functions may be further ones.
    """
    plain = exponents[(exponents[:, d:] == 0).all(axis=1), :d]
    higher = monomial_exponents(d, int(plain.sum(axis=1).max(initial=0)) + 2)
    higher = higher[~(higher[:, None] == plain).all(axis=2).any(axis=1)]
    fewer = (higher[(higher > 0).sum(axis=1) <= variables] for variables in (d, 2, 1))
    kept = next((some for some in fewer if len(some) <= most), higher[:0])
    return np.concatenate([exponents, np.pad(kept, ((0, 0), (0, exponents.shape[1] - d)))])


# --------------------------------------------------------------------------------------------------
# Whether a law has its origin elsewhere, or would do as well around another.
#
# An axis whose origin is that of the data is a claim: of all places in the box of the data it
# would be just there. It is believed if the data hold it to be so likelier than chance makes it.

#: Which other origin, along which axis, and by how much the criterion rises there.
Rival = tuple[str, str, float]


def elsewhere(problem: Problem, fit: Fit, law: PolynomialSystem) -> Iterator[Rival]:
    """Other laws that fit almost as well, with one free axis less or one more.

    Parameters
    ----------
    problem : Problem
        Its penalties.
    fit : Fit
        The last one.
    law : PolynomialSystem
        The law in the frame of the data.
    """
    state, given = fit.state, problem.origin
    axes = np.eye(problem.d, dtype=bool)[state.moving]
    fewer = [(np.where(axis, given, state.offset), state.moving & ~axis) for axis in axes]
    whole = closed(problem, fit)
    every = problem.form.candidates | whole.state.active
    whole = replace(whole, state=replace(whole.state, active=every))
    own = problem.criterion(fit.collocation, state)
    origins = [*fewer, *free_offsets(problem, state, problem.form.movable)]
    found = laws_at(problem, whole, origins, free=True)
    for (_, moving), laws in zip(origins, found, strict=True):
        for one in laws:
            cost, rival = one.criterion - own, one.state.coefficients
            if not cost < 4.0:  # a likelihood ratio of 7 tells two laws apart
                break  # the next costs more
            matrix = shift_matrix(problem.exponents, one.state.offset - given)
            parts = np.abs(matrix) @ np.abs(rival)
            terms = (np.abs(matrix @ rival) > FAINT * parts) | (problem.known != 0)
            if (terms != law.support).any():
                axis = int(np.argmax(moving != state.moving))
                where = "another origin" if moving[axis] else "the origin of the data"
                yield where, problem.form.names[axis], cost
                break


def pinned(
    problem: Problem, state: State, model: Linearisation, law: PolynomialSystem, tolerated: float
) -> Iterator[Rival]:
    """Axes that may as well be free, a little off the data's, by which the law had other terms.

    Where other axes are free, none is fixed for the asking: to be there is a coincidence, as much
    as the box of the data is wider than the origin is uncertain. A move costs twice its logarithm.

    Parameters
    ----------
    problem, state, model, law
        See `elsewhere`.
    tolerated : float
        Errors that have to be tolerated, over those that the law leaves.
    """
    if not state.moving.any():
        return
    (low, high), generators = problem.box, shift_generators(problem.exponents)
    own = np.eye(len(model.columns))[np.flatnonzero(state.free()[model.columns])]
    forth = shift_matrix(problem.exponents, state.offset - problem.origin)
    for axis in np.flatnonzero(problem.form.movable & ~state.moving).tolist():
        rate = -generators[axis] @ state.coefficients
        rows = np.vstack([own, np.append(rate.T.ravel(), np.zeros(problem.d))[model.columns]])
        (place,), (variance,) = newcomers(
            rows @ model.information @ rows.T, rows @ model.gradient, len(own)
        )
        if not np.isfinite(variance):  # the terms of the law make up for such a move
            continue
        variance *= tolerated**2
        cost = float(np.log((high - low)[axis] ** 2 / (2 * np.pi * variance)) - place**2 / variance)
        moved = forth @ rate
        new = (np.abs(moved) > FAINT * np.abs(moved).max(initial=0.0)) & ~law.support
        if new.any() and cost < STRONG:
            yield "another origin", problem.form.names[axis], cost


def untold_origins(found: Sequence[Rival], remedy: str) -> Iterator[str]:
    """One line for all axes along which other terms fit almost as well around another origin.

    Parameters
    ----------
    found : sequence of (str, str, float)
    remedy : str
        What to do about it.
    """
    for where in dict.fromkeys(where for where, _, _ in found):
        axes = dict.fromkeys(name for other, name, _ in found if other == where)
        least = min(cost for other, _, cost in found if other == where)
        well = "almost as well" if least > -STRONG else "better, which the search has missed"
        yield (
            f"the data hardly tell where the law's origin is in {' and in '.join(axes)}: other "
            f"terms around {where} fit {well} (criterion {least:+.1f}); use {remedy}"
        )


# --------------------------------------------------------------------------------------------------
# All that is to be said of a law.


def diagnose(
    problem: Problem, fit: Fit, model: Linearisation, path: Path, law: PolynomialSystem
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
    """
    wider = widened(problem, fit)
    # Without errors that the splines could tell from their own: what is clean cannot be cleaner.
    clean = bool((effective_noise(fit) <= CLEANEST).all())
    remedy = "cleaner samples or a longer trajectory"
    if clean:
        remedy = "a longer trajectory, denser samples or other starts"
    return (
        *outliers(problem.measured, _met(problem, fit)),
        *_shape(problem, fit),
        *_misfit(problem, fit, wider),
        *_unmet(fit, remedy),
        *_contested(problem, fit.state, path, remedy),
        *_rivals(problem, fit, model, wider, path, law, remedy, clean),
        *_late(problem, fit, law),
        *_sampling(problem, fit, law, remedy),
    )


def _met(problem: Problem, fit: Fit) -> list[Bools]:
    """Through which samples of each trajectory the curve of a law passes, as far as noise tells."""
    grid = fit.collocation.grid
    apart = np.abs(fit.collocation.curve(fit.state.control_points) - grid.x)
    near = np.asarray(~(apart > GROSS * residual_noise(fit)).any(axis=1))
    found = [np.zeros(len(t), dtype=bool) for t, _ in problem.trajectories]
    for segment, rows in zip(grid.segments, grid.split(near), strict=True):
        times = problem.trajectories[segment.trajectory][0]
        found[segment.trajectory][np.searchsorted(times, segment.t)] = rows
    return found


def outliers(trajectories: Sequence[Trajectory], met: Sequence[Bools]) -> Iterator[str]:
    """Samples so far from those around them that they must be errors.

    Parameters
    ----------
    trajectories : sequence of Trajectory
        The data in the user's units.
    met : sequence of ndarray of bool, shape (n,)
        Which samples of each a law passes through: what it explains is no error.
    """
    # Distance of a sample from those around it, over how far nine samples in ten are from the
    # median, and over the typical distance of those around it, that no motion explains. Noise of
    # 50 % makes 6.
    found, limit = [], 30.0
    for (t, x), explained in zip(trajectories, met, strict=True):
        far = np.zeros(len(t), dtype=bool)
        for column in x.T[np.isfinite(x).any(axis=0)]:
            seen = np.flatnonzero(np.isfinite(column))
            values = column[seen]
            distance = np.abs(values - np.median(values))
            spread = np.quantile(distance, 0.9)
            rows = np.flatnonzero((distance > limit * spread) & (spread > 0))
            # Far from those around it, too, it is no part of a motion far away. These are from 3 to
            # 8 before and after it: so three errors in a row are compared with none.
            around = np.append(np.arange(6), np.arange(11, 17)) + rows[:, None]
            beside = np.pad(values, 8, constant_values=np.nan)[around]
            apart = np.abs(values[rows] - np.nanmedian(beside, axis=1))
            own = np.abs(beside - np.nanmedian(beside, axis=1, keepdims=True))
            far[seen[rows[apart > limit * np.nanmedian(own, axis=1)]]] = True
        found += [
            f"t = {t[row]:g}, x = ({', '.join(f'{v:g}' for v in x[row])})"
            for row in np.flatnonzero(far & ~explained).tolist()
        ]
    more = f" and {len(found) - 3} more" if len(found) > 3 else ""
    if found:
        yield (
            f"a sample lies far from those before and after it: {'; '.join(found[:3])}{more}: no "
            "motion explains that; put NaN in its place"
        )


def differenced(names: Sequence[str], trajectories: Sequence[Trajectory]) -> Iterator[str]:
    """What to say of a coordinate that is another's difference over a step, to one side or both."""
    t, x = max(trajectories, key=lambda run: len(run[0]))
    rates = np.diff(x, axis=0) / np.diff(t)[:, None]
    both = (rates[1:] + rates[:-1]) / 2
    sides = (rates, x[1:]), (rates, x[:-1]), (both, x[1:-1])
    for made, given in sides if len(t) > 4 else ():  # fewer samples may agree by chance
        off = np.abs(made[:, :, None] - given[:, None]).max(axis=0)
        for i, j in np.argwhere(off < 1e-7 * x.std(axis=0)).tolist():  # but for rounding
            yield (
                f"{names[j]} is made of differences of {names[i]}: its errors are theirs, which "
                "changes the law; leave it out, and say order=2"
            )


def _shape(problem: Problem, fit: Fit) -> Iterator[str]:
    """What follows from where the motion takes place."""
    measured, names = problem.measured[0][1].shape[1], problem.form.names
    noise = (problem.noise * problem.units.scale)[:measured]
    x = np.concatenate([values for _, values in problem.measured])
    whole = x[np.isfinite(x).all(axis=1)]
    if len(whole):
        yield from shapes(whole, noise, names[:measured])
        away = np.abs(whole.mean(axis=0)) / whole.std(axis=0)
        for j in np.flatnonzero(away > 300).tolist():
            yield f"{names[j]} is {away[j]:.0g} times its spread from zero: subtract a constant"
    yield from differenced(names, problem.measured)
    x, _ = fit.collocation.node_states(fit.state.control_points)
    degree = int(problem.exponents[fit.state.active.any(axis=1)].sum(axis=1).max(initial=1))
    counts, states = fit.collocation.counts, problem.form.states
    error = typical((effective_noise(fit) / np.sqrt(np.maximum(counts, 1)))[counts > 0])
    told, inputs = [], {f.name: f.value(x) for f in problem.functions if f.of_time}
    if inputs:
        every = np.column_stack([x[:, :states], *inputs.values()])
        told = list(related([*names[:states], *inputs], every, 1, error))
    yield from told or related(names[:states], x[:, :states], degree, error)


def _misfit(problem: Problem, fit: Fit, wider: Wider) -> Iterator[str]:
    """Does the curve miss the data, or by less than the errors that were given?"""
    residual, names = residual_noise(fit), problem.form.names
    # Less than a hundredth of the spread does not matter, unless error bars are made of it.
    seen = (fit.collocation.counts > 0) & ((residual > 1e-2) | problem.measured_errors)
    ratio = np.where(seen, residual / problem.noise, 0.0)
    misses = ~(ratio < CONSISTENT)
    # A curve without a law follows errors that last, too: they are no misfit.
    if misses.any() and wider.further.size and not (wider.significant or problem.measured_errors):
        misses &= ~passing(fit, len(wider.problem.exponents))
    if misses.any():
        j = int(np.where(misses, ratio, 0.0).argmax())
        told = "sigma" if problem.measured_errors else "the noise estimated beforehand"
        times = f"{ratio[j]:.1f}" if ratio[j] <= 100 else "more than 100"  # that noise is none
        small = "sigma may be too small, " if problem.measured_errors else ""
        yield (
            f"the curve misses the data of {names[j]} by "
            f"{residual[j] * problem.units.scale[j]:.3g} ({100 * residual[j]:.3g} % of its spread, "
            f"{times} times {told}): {small}errors may last for several samples, the law may lie "
            "outside the library (raise the degree), or the motion may not be autonomous"
        )
    too_large = problem.noise / residual
    j = int(too_large.argmax())
    if problem.measured_errors and too_large[j] > CONSISTENT:
        yield (
            f"sigma of {names[j]} is {too_large[j]:.3g} times the errors that the law leaves: the "
            "error bars are too wide, and terms may be lost; leave it out, and the errors are "
            "estimated"
        )


def _unmet(fit: Fit, remedy: str) -> Iterator[str]:
    """Is the fit no minimum?"""
    if fit.status is not Status.CONVERGED:
        meaning = {
            Status.MAX_STEPS: "its coefficients may be off by more than their errors",
            Status.STALLED: "terms may be indistinguishable on these data",
        }[fit.status]
        yield (
            f"the last fit did not converge ({fit.status.value}): {meaning}; use {remedy}, or a "
            "lower degree"
        )


def _contested(problem: Problem, state: State, path: Path, remedy: str) -> Iterator[str]:
    """Is another plateau more than half as wide, which begins at errors as large as there may be?

    Of errors that last nobody knows how large they are; those that samples share are given.
    """
    law, varies = problem.law(state), path.fit.collocation.systematic.std(axis=0)
    largest = np.inf if path.level > path.lowest else np.sqrt((varies**2).sum(axis=1)).max()
    for own, plateaus in zip(path.of(state.active), path.plateaus, strict=True):
        same = [p for p in plateaus if p.low <= path.level and (p.terms == own.terms).all()]
        own = max(same, key=path.width, default=own)
        limit = max(path.level, largest) if same else path.level
        others = [p for p in plateaus if p.low <= limit and (p.terms != own.terms).any()]
        rival = max(others, key=path.width, default=None)
        if rival and path.width(rival) > 0.5 * path.width(own):
            change = ", ".join(
                f"{'with' if rival.terms[k] else 'without'} {spoken(law, k, own.equation)}"
                for k in np.flatnonzero(rival.terms != own.terms).tolist()
            )
            yield (
                f"d{law.names[own.equation]}/dt is settled by how large an error is tolerated: "
                f"it stays the same {_range(own.low, own.high)} of the spread of the data, and "
                f"{change} {_range(rival.low, rival.high)}; use {remedy}"
            )


def _range(low: float, high: float) -> str:
    """Two ends with as many digits as tell them apart, three at most."""
    digits = next((n for n in (1, 2) if f"{low:.{n}g}" != f"{high:.{n}g}"), 3)
    return f"from {low:.{digits}g} to {high:.{digits}g}"


def _rivals(
    problem: Problem, fit: Fit, model: Linearisation, wider: Wider, path: Path,
    law: PolynomialSystem, remedy: str, clean: bool,
) -> Iterator[str]:  # fmt: skip
    """Do other terms, coefficients that change or another origin explain the data as well?"""
    if clean and not problem.has_process_noise:
        return  # what is left is the error of the splines, not noise: it settles nothing
    # What changes leaves smooth errors itself: no more of these are tolerated than by a first law.
    yield from _changing(problem, fit, min(path.tolerated, max(TOLERATED / path.own, 1.0)))
    begins = max(plateau.low for plateau in path.of(fit.state.active))
    tolerant = clean or begins > path.lowest
    # Errors that last may follow the state, too; they are no reason to doubt, unless a single term,
    # or the few that a single coordinate has, explain nearly all of them.
    if wider.decisive or (wider.significant and not tolerant):
        single = wider.single
        term = place(wider.problem.law(wider.fit.state), wider.others[single.argmax()])
        yield (
            f"terms that the law has not explain what it leaves ({term}: chi-square "
            f"{single.max():.4g}, all {len(wider.further)} of higher degree together "
            f"{wider.gain:.4g}): it may be an approximation along these data, as of a sine or a "
            "drag; raise the degree, or name its terms with library="
        )
    # From where the law begins to what is tolerated, each decade as likely.
    least = max(begins / path.own, 1.0)
    sizes = np.unique(np.geomspace(least, max(least, path.tolerated), 5))
    yield from _far_neighbours(wider, sizes, remedy)
    origins = list(pinned(problem, fit.state, model, law, path.tolerated))
    if not tolerant:  # weaker errors than those tolerated say nothing about the law
        origins += elsewhere(problem.cautious, fit, law)
    yield from untold_origins(origins, remedy)


def _changing(problem: Problem, fit: Fit, tolerated: float, most: int = 8) -> Iterator[str]:
    """Has the law other coefficients in a part of the data: a run, the second half, before jumps?

    Chow's test of their constancy (1960), by its score: what they would explain if they were free
    in that part, at the errors that are tolerated. Of runs ``most`` are asked, which fit worst.
    """
    collocation, state = fit.collocation, fit.state
    grid, own = collocation.grid, np.flatnonzero(state.free())
    run_of = np.repeat([s.trajectory for s in grid.segments], [len(s.t) for s in grid.segments])
    squares = (fit.residual**2 * collocation.sample_weights).sum(axis=1)
    runs, place, counts = np.unique(run_of, return_inverse=True, return_counts=True)
    worst = runs[np.argsort(-np.bincount(place, squares) / counts)[:most]]
    here = grid.runs
    parts = {f"run {run}": here == run for run in worst.tolist()}
    if len(runs) == 1:
        parts = {"the second half of the data": np.arange(len(here)) >= len(here) / 2}
    step, before = typical_step(problem.trajectories), np.zeros(len(here), dtype=bool)
    for run, jumps in enumerate(problem.jumps):
        early = jumps - grid.node_times[:, None]
        before |= (here == run) & ((early > 0) & (early < step)).any(axis=1)
    if before.any():
        parts["the sample before a jump of an input"] = before
    models = [collocation.linearise(state, own, part=part) for part in parts.values()]
    gains = [(model.newton()[1] - model.fall) / tolerated**2 for model in models]
    gain, where = max(zip(gains, parts, strict=True))
    if more_than_chance(gain, len(own)):
        yield (
            f"{where} has other coefficients than the rest (chi-square {gain:.4g} of {len(own)}): "
            "something that is not in the law differs or changes"
        )


def _late(problem: Problem, fit: Fit, law: PolynomialSystem) -> Iterator[str]:
    """Would the law be sparser if one coordinate was measured later or earlier than all others?

    What is late obeys a law, too, in which combinations of the state and its slope, more terms,
    stand in place of a coordinate. As of two origins, that of the sparser law is the likelier one;
    a lag is a number, too, and takes the place of one term.
    """
    state, collocation = fit.state, fit.collocation
    seen = np.flatnonzero(collocation.counts[: problem.measured[0][1].shape[1]]).tolist()
    met = (residual_noise(fit) <= CONSISTENT * problem.noise)[seen].all()
    if problem.has_process_noise or len(seen) < 2 or not met:
        return  # what leaves more than noise is no law, late or not
    each = zip(fit.splines, collocation.grid.segments, strict=True)
    step = typical_step(problem.trajectories) * np.concatenate([c(s.t, 1) for c, s in each])
    columns = np.flatnonzero(state.free())  # of which some are one too many
    costs, present = problem.costs(columns), state.flat()[columns]
    support, priced = np.ones(len(columns), dtype=bool), np.isfinite(costs)
    own, found = collocation.objective(state) + costs[priced].sum(), []
    lags = step[:, :, None] * np.eye(problem.d)[:, seen]
    shared = np.concatenate([collocation.systematic, lags], axis=2)
    model = replace(collocation, systematic=shared).linearise(state, columns)
    for row, j in enumerate(seen, len(model.sizes) - len(seen)):
        precision = np.repeat([1.0, 1e9], [len(model.sizes) - len(seen), len(seen)])
        precision[row] = 1.0  # one lag at a time: the others are 0
        left, moves = model.without_systematic(precision)
        start = left[1:, 1:], -left[1:, 0], present, costs, support
        terms, solution, value = subset_search(*start)
        fewer = int((priced & ~terms).sum())
        gain, moved = own - (left[0, 0] + value), np.append(1.0, solution - present)
        if fewer > 1 and gain > STRONG:
            size = model.sizes[row] + moves[row] @ moved
            found.append((gain, fewer, law.names[j], -float(size)))
    if found:
        gain, fewer, name, size = max(found)
        when = f"at least {abs(size):.2g} of a step {'later' if size > 0 else 'earlier'}"
        yield (
            f"the law has {fewer} terms less if {name} was measured {when} than its times say "
            f"(criterion {-gain:+.4g}): correct it, or give systematic="
        )


def _far_neighbours(wider: Wider, tolerated: Floats, remedy: str) -> Iterator[str]:
    """Has another law that may as well be true coefficients far from those of this one?

    Unless the evidence against it is strong, on average over the errors that may have to be
    ``tolerated``, (k,). The axes stay as they are: the same law in another frame would count.
    """
    law, columns = wider.problem.law(wider.fit.state), wider.problem.form.searched
    support, present = wider.fit.state.free()[columns], wider.fit.state.flat()[columns]
    if not support.any():
        return
    penalties = np.tile(prior_penalties(law.exponents), law.d)[columns]
    models = [wider.model.tolerating(error**-2).of(columns) for error in tolerated]
    found = [far_neighbours(m.information, m.gradient, present, penalties, support) for m in models]
    odds = sum(one[0] for one in found) / len(found)
    _, dropped, added, entry, value = max(found, key=itemgetter(0))
    if odds > np.exp(-STRONG / 2):
        out, into = (place(law, columns[k]) if k >= 0 else "" for k in (dropped, added))
        change = f"{into} instead of {out}" if out and into else f"with {into}" if into else ""
        change = change or f"without {out}"
        by = 100 * (value / present[entry] - 1)
        becomes = "is zero" if abs(by + 100) < 1 else f"changes by {by:+.2g} %"
        yield (
            f"another law may as well be true ({100 * odds:.0f} %), {change}: there "
            f"{place(law, columns[entry])} {becomes}, far beyond its standard error; use {remedy}"
        )


def _sampling(problem: Problem, fit: Fit, law: PolynomialSystem, remedy: str) -> Iterator[str]:
    """Are samples too few or too far apart for a law, or to tell kicks from a wrong one?

    A wrong law misses the same whenever the motion comes by.
    """
    form, turns = problem.form, problem.turns
    # Along the law: between samples that are few it may turn more often than a smoothing tells.
    x, slopes = fit.collocation.node_states(fit.state.control_points)
    step = typical_step(problem.trajectories)
    # On a line nothing turns; a body need not, if it is seen from several starts.
    bound = form.states > 1 and (form.movable.all() or len(problem.trajectories) == 1)
    if turns < 0.1:  # of curves that are all but flat
        yield "no curve through the samples tells a motion from noise: sample faster, if it is one"
    elif turns < 1.5 and bound:
        yield (
            f"the trajectory covers only {turns:.1f} turns of the motion: terms may be "
            "indistinguishable on it; record longer, or several runs from other starts"
        )
    moved, size = step * np.sqrt((slopes**2).mean()), np.sqrt(x.var(axis=0).mean())
    if moved > size > 0:  # a step is longer than a time scale of the motion
        yield f"only {2 * np.pi * size / moved:.1f} samples per turn of the motion: sample faster"
    some = x[:: len(x) // 1000 + 1] - fit.state.offset
    rates = np.linalg.eigvals(np.nan_to_num(problem.law(fit.state).gradient(some)))
    grows = min(float(np.median(rates.real.max(axis=1))) * step, 99.0)
    if grows > 1:
        yield (
            f"from one sample to the next what is small grows {np.exp(grows):.2g}-fold in the law, "
            "which foretells none of them: sample faster, if it is the law at all"
        )
    coarse = problem.samples_a_turn < COARSE
    if problem.has_process_noise and (coarse or turns < 10):
        few = f"{turns:.1f} turns of {problem.samples_a_turn:.0f} samples each"
        yield (
            f"the motion is taken to have process noise, which {few} cannot tell from a drive or a "
            f"force that nobody named: {'sample faster' if coarse else 'record longer'}, or name it"
        )
    segments, count = fit.collocation.grid.segments, len(fit.collocation.grid.x)
    span = sum(np.ptp(segment.breakpoints) for segment in segments)
    # The curve is smooth where kicks are not: along it, no damping is seen of what they balance.
    kicked = (problem.process_noise * span) ** 2 / count > 4 * x.var(axis=0)
    if kicked.any():
        names = " and ".join(np.array(law.names)[kicked])
        yield (
            f"process noise alone would carry {names} further in the time of the record than it "
            "moves: what damps or drives it by less than that noise is not seen, and may be missing"
        )
    # A body without a force moves evenly.
    for j in np.flatnonzero(~law.support.any(axis=0) & (law.order == 1)).tolist():
        name = law.names[j]
        yield f"no term was found for d{name}/dt although {name} moves: use {remedy}"
