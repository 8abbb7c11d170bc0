"""The axes in which a polynomial law is sparsest, for paths of which nobody knows how they lie.

A rotation of the axes, like a shift of their origin, maps polynomials of one degree onto each
other, exactly. So all terms are fitted once, and the estimate, with its covariance, is looked at
in other axes, where the number of terms that differ from zero is minimised, as `frames`
does for shifts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from operator import itemgetter

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag, eigh
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ..arrays import Floats, Ints
from ..checks import check_choice
from .collocation import Fit, Linearisation, State, Status
from .data import Trajectory
from .l0 import inverse
from .library import Library, monomials
from .problem import Problem, leaves_something_over, tightened, unpruned
from .result import Discovery

Solved = tuple[Discovery, Problem, Fit]
#: Trajectories, their systematic errors, and their standard errors if they are known.
Measured = tuple[list[Trajectory], list[Floats], list[Floats] | None]


def estimated(problem: Problem, fit: Fit) -> tuple[Ints, Floats]:
    """An estimate of all terms of some rows of the library, to be looked at in other axes.

    By the quadratic model around a fit of m coordinates.

    Returns
    -------
    exponents : ndarray of int, shape (l, m) or (l, 2 m)
        Of places, or of places and velocities.
    estimates : ndarray, shape (1 + k, l, m)
        Coefficients in axes of one unit, and the 40 largest directions in which they are uncertain,
        each one standard error long.
    """
    rows, columns = fit.state.active.any(axis=1), np.flatnonzero(fit.state.free())
    model, m = fit.collocation.linearise(fit.state, columns), _places(problem)
    factors = _in_one_unit(problem)[rows, -m:].T.ravel()
    flat = factors * (fit.state.flat()[columns] + model.newton()[0])
    values, axes = np.linalg.eigh(factors[:, None] * inverse(model.information) * factors)
    directions = (axes * np.sqrt(np.maximum(values, 0.0))).T[::-1]
    stacked = np.vstack([flat, directions[:40]]).reshape(-1, m, rows.sum())
    return problem.exponents[rows], np.moveaxis(stacked, 1, 2)


def descended(
    law: tuple[Ints, Floats], turn: Floats, origin: Floats, size: float
) -> tuple[float, Floats, Floats]:
    """The nearest orientation, (m, m), and origin, (m,), with fewest terms, and their number.

    Axes are the rows of an orientation. A coefficient counts ``log(1 + z^2)``, with ``z`` over its
    standard error and a size.
    """
    (exponents, estimates), m = law, len(turn)

    def moved(step: Floats) -> tuple[Floats, Floats]:
        return turned(step[:-m], m) @ turn, origin + step[-m:]

    def scores(step: Floats) -> Floats:
        axes, place = moved(step)
        whole = np.append(place, np.zeros(exponents.shape[1] - m))  # velocities have none
        inward = block_diag(*[axes.T] * (exponents.shape[1] // m))
        estimate, *spread = _mapped(exponents, estimates, inward, whole, axes)
        return (estimate / np.sqrt(np.square(spread).sum(axis=0) + size**2)).ravel()

    start = np.zeros(m * (m - 1) // 2 + m)
    best = least_squares(scores, start, max_nfev=60, loss="cauchy")
    return float(best.cost), *moved(best.x)


def rough_orientations(problem: Problem, rng: np.random.Generator, most: int = 3) -> list[Floats]:
    """Orientations in which fits of all terms up to a degree look sparse, for degrees as needed.

    Of each degree at most so many, sought from those of lower degrees, from the data's own, and
    from 20 random ones.
    """
    degrees, m = problem.exponents.sum(axis=1), _places(problem)
    found: list[Floats] = []
    for degree in range(1, problem.form.degree + 1):
        fit = unpruned(problem, degrees <= degree)
        if fit.status is not Status.CONVERGED:  # too many terms for these data
            continue
        law = estimated(problem, fit)
        turns, _ = np.linalg.qr(rng.standard_normal((20, m, m)))
        turns[:, 0] *= np.linalg.det(turns)[:, None]  # not mirrored
        starts = [*found, np.eye(m), *turns]
        # A coefficient counts from a tenth of its standard size on, at the end from a hundredth.
        coarse = [descended(law, turn, np.zeros(m), 0.1) for turn in starts]
        coarse.sort(key=itemgetter(0))
        fine = [descended(law, turn, origin, 0.01) for _, turn, origin in coarse[: 2 * most]]
        limit = len(found) + most
        for _, turn, _ in sorted(fine, key=itemgetter(0)):
            near = nearest(turn)
            # Orientations that differ by less than two degrees are one.
            if len(found) < limit and all(apart(near, one) > np.deg2rad(2) for one in found):
                found.append(near)
        if not leaves_something_over(problem, fit):
            break
    return found


def refined(problem: Problem, fit: Fit) -> Floats:
    """The small turn, (m, m), after which the small terms of a law are not needed any more.

    Axes that are off by a fraction of a degree leave small terms, which clean data tell: below .05
    in standard units. The law is fitted without them, and the turn is the best step from there.
    """
    sizes = fit.state.coefficients * _in_one_unit(problem)
    state = fit.state.of_terms(fit.state.active & (np.abs(sizes) > 0.05))
    if not state.active.any():
        return np.eye(_places(problem))
    fit = tightened(problem, fit.collocation, state)
    model = problem.model(fit)
    own = np.eye(len(model.columns))[fit.state.free()[model.columns]]
    ways = np.vstack([own, _turns(problem, fit.state)[model.columns].T])
    step = inverse(ways @ model.information @ ways.T) @ (ways @ model.gradient)
    return turned(step[len(own) :], _places(problem))


def with_turns(problem: Problem, fit: Fit, chosen: float = 1e-8) -> Linearisation:
    """The quadratic model around a fit, with small turns of its axes eliminated.

    Axes in which terms are absent were learned from these: so what a law with the same terms in
    axes near by explains as well is not known. A turn that the law's own terms can make up for, but
    for such a share of what it changes, is no unknown but a choice of axes, which stay.
    """
    model = problem.model(fit)
    turns = _turns(problem, fit.state)[model.columns]
    own = np.flatnonzero(fit.state.free()[model.columns])
    told = model.information @ turns
    gain = inverse(model.information[np.ix_(own, own)]) @ told[own]
    whole = turns.T @ told
    least = chosen * np.trace(whole) * np.eye(len(whole))  # turns that change nothing have a share
    shares, directions = eigh(whole - told[own].T @ gain, whole + least)
    turns = turns @ directions[:, shares > chosen]
    told = model.information @ turns
    share = told @ np.linalg.pinv(turns.T @ told, hermitian=True)
    return replace(
        model,
        information=model.information - share @ told.T,
        gradient=model.gradient - share @ (turns.T @ model.gradient),
    )


def _turns(problem: Problem, state: State, step: float = 1e-4) -> Floats:
    """What small turns about the origin of the data change in a law, along `State.flat`, (k, r).

    By differences of so large a turn to both sides.
    """
    scale, law, changes = problem.units.scale, state.coefficients + problem.known, []
    whole, away = np.eye(problem.d), state.offset - problem.origin
    # How axes change as they are `turned` back by a small angle about each.
    back = np.cross(np.eye(3), np.eye(3)[:, None]).swapaxes(1, 2)
    for generator in back if _places(problem) == 3 else back[2:, :2, :2]:
        copies = problem.d // len(generator)
        turn = step * np.kron(np.eye(copies), generator) * scale / scale[:, None]
        ahead = _mapped(problem.exponents, law, whole - turn, -turn @ away, whole + turn)
        behind = _mapped(problem.exponents, law, whole + turn, turn @ away, whole - turn)
        changes.append(np.append((ahead - behind).T / (2 * step), np.zeros(problem.d)))
    return np.column_stack(changes)


def _mapped(
    exponents: Ints, laws: Floats, inward: Floats, origin: Floats, outward: Floats
) -> Floats:
    """The laws, (..., l, m), of ``outward f(inward y + origin)``: alike at three points a term."""
    y = np.random.default_rng(0).uniform(-1, 1, (3 * len(exponents), exponents.shape[1]))
    values = monomials(y @ inward.T + origin, exponents) @ laws @ outward.T
    return np.linalg.pinv(monomials(y, exponents)) @ values


def _places(problem: Problem) -> int:
    """How many coordinates a place has."""
    return problem.measured[0][1].shape[1]


def _in_one_unit(problem: Problem) -> Floats:
    """What turns coefficients into those of one unit for all places and one for velocities, (l, d).

    Each is the root mean square of its scales.
    """
    m, units = _places(problem), problem.units
    sizes = np.repeat(np.sqrt(np.mean(units.scale.reshape(-1, m) ** 2, axis=1)), m)
    return units.factors(problem.exponents) / replace(units, scale=sizes).factors(problem.exponents)


def turned(angles: ArrayLike, m: int) -> Floats:
    """A rotation of m axes, (m, m), by an angle, or by a vector of three."""
    vector = angles if m == 3 else np.append([0, 0], angles)
    return Rotation.from_rotvec(vector).as_matrix()[:m, :m]


def apart(turn: Floats, other: Floats) -> float:
    """Largest angle between the axes of two orientations, by whatever name and sign."""
    return float(np.arccos(np.clip(np.abs(turn @ other.T).max(axis=1), 0, 1)).max())


def nearest(turn: Floats) -> Floats:
    """The same axes in the order and with the signs that are nearest to the data's own."""
    m = len(turn)
    quarters = Rotation.create_group("O" if m == 3 else "C4").as_matrix()[:, :m, :m]
    return max(np.round(quarters) @ turn, key=np.trace)


def check_orientation(orientation: str, library: Library, d: int, origin: str) -> None:
    """Refuse what is no orientation, or to learn one of data or candidates that have none."""
    check_choice("orientation", orientation, ("data", "learn"))
    if orientation == "data":
        return
    if d not in (2, 3):
        raise ValueError(f"orientation: can be learned of two or three coordinates, got {d}")
    if library != Library(library.degree):
        raise ValueError(
            "orientation: can be learned only among all polynomials up to a degree, got "
            f"library={library}"
        )
    if origin != "learn":
        raise ValueError(f"orientation: can be learned only with origin='learn', got {origin!r}")


def in_sparsest_axes(
    own: Discovery, problem: Problem, solve: Callable[[Floats], Solved], rng: np.random.Generator
) -> Solved | None:
    """The law in the axes in which it has fewest terms; none if in no others it has fewer.

    Parameters
    ----------
    own : Discovery
        In the axes of the data.
    problem : Problem
        In these, of places that were seen whole.
    solve : callable
        The solution in axes that are the rows of (m, m).
    rng : numpy.random.Generator
        For the starts of the search.
    """
    settled = (_settled(turn, solve) for turn in rough_orientations(problem, rng))
    best = min(settled, key=_rank, default=None)
    return best if best and _terms(best[0]) < _terms(own) else None


def _settled(turn: Floats, solve: Callable[[Floats], Solved]) -> Solved:
    """The law in the best axes near some; of laws alike, the one in the axes that were refined."""
    solved = solve(turn)
    for _ in range(3):  # each law tells the axes better, in which the next is made
        turn, before = refined(*solved[1:]) @ turn, solved
        solved = min(solve(turn), before, key=_rank)
        if _rank(solved) == _rank(before):
            break
    return solved


def _rank(solved: Solved) -> tuple[bool, int]:
    """What is to be smallest: no warnings, then few terms."""
    return bool(solved[0].warnings), _terms(solved[0])


def _terms(found: Discovery) -> int:
    """Terms of a law, and axes along which its origin is moved."""
    return int(found.native.support.sum() + (found.offset != 0).sum())


def in_axes(measured: Measured, turn: Floats) -> Measured:
    """What was measured, in axes that are the rows of ``turn``, (m, m).

    A place of which a coordinate was not seen is none. The errors of two coordinates of known ones
    are taken to be independent in all axes.
    """
    trajectories, shared, sigma = measured
    whole = [np.isfinite(x).all(axis=1) for _, x in trajectories]
    paths = [(t[rows], x[rows] @ turn.T) for (t, x), rows in zip(trajectories, whole, strict=True)]
    modes = [np.einsum("ij,njk->nik", turn, s[rows]) for s, rows in zip(shared, whole, strict=True)]
    if sigma is None:
        return paths, modes, None
    pairs = zip(sigma, whole, strict=True)
    return paths, modes, [np.sqrt(errors[rows] ** 2 @ (turn**2).T) for errors, rows in pairs]
