"""The frame of a law: the origin in which it is sparsest, the meaning of the offset (Eq. 10).

B-splines sum to one, so an offset added to the curve is redundant. It matters when the library is
evaluated at ``x - offset``: then it is the origin of the law's own frame. What a move of the origin
does to a polynomial law and to its information is exact, so that frames are compared by algebra: an
axis off the data's origin is one more column of the L0 search, with a penalty of its own.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from .collocation import Fit, State
from .l0 import closest_rival, minimiser, subset_search
from .library import divides, shift_generators, shift_matrix
from .problem import FINAL_WEIGHT, Problem

#: An origin, and which of its axes are not where the data have theirs.
Origin = tuple[Floats, Bools]


@np.errstate(all="ignore")  # of moves that lead nowhere
def _vanishing(exponents: Ints, law: Floats, entries: Ints, axes: Ints) -> Floats:
    """The shortest moves of the origin after which single coefficients of a law vanish, (n, d).

    Of each entry, (n, 2), its equation and term; along some axes, by Newton steps. Not finite, or
    far away, where there is no such move.
    """
    equations, terms = entries.T
    along = np.stack([law, *(shift_generators(exponents)[axes] @ law)])[:, :, equations]
    moves = np.zeros((len(entries), law.shape[1]))
    for _ in range(6):
        shift = shift_matrix(exponents, -moves, terms[:, None])[:, 0]
        values, rates = np.split(np.einsum("nl,aln->na", shift, along), [1], axis=1)
        moves[:, axes] -= values * rates / (rates**2).sum(axis=1, keepdims=True)
    return moves


def free_offsets(problem: Problem, state: State, movable: Bools) -> list[Origin]:
    """Origins at which a term of a law vanishes, moved along some of the axes that are not free.

    Terms that a move brings in are the data's to decide on, while the origin moves.
    """
    exponents, fixed = problem.exponents, movable & ~state.moving
    below = divides(exponents, fixed) & ~np.eye(len(exponents), dtype=bool)
    low, high = problem.box
    found: list[Origin] = []
    entries = np.argwhere((state.active & (below @ state.active)).T)
    for step in _vanishing(exponents, state.coefficients, entries, np.flatnonzero(fixed)):
        origin, moved = state.offset + step, np.abs(step) > 1e-9  # more than rounding
        known = any(np.allclose(origin, other) for other, _ in found)
        inside = ((low <= origin) & (origin <= high))[moved].all()  # not if it is infinite
        if inside and moved.any() and not known:
            found.append((origin, state.moving | moved))
    return found


def with_fewer_axes(problem: Problem, origin: Floats) -> list[Origin]:
    """An origin, and the same with some of its axes at the data's, where they cost nothing."""
    given = problem.origin
    masks = itertools.product(*((True, False) if free else (False,) for free in origin != given))
    return [(np.where(mask, origin, given), np.array(mask)) for mask in masks]


def closed(problem: Problem, fit: Fit) -> Fit:
    """The law in the centred frame, with all terms of its shift closure: these are 0 as yet."""
    d, exponents = problem.d, problem.exponents
    state = replace(
        fit.state,
        coefficients=shift_matrix(exponents, fit.state.offset) @ fit.state.coefficients,
        active=divides(exponents, problem.form.movable) @ fit.state.active,
        offset=np.zeros(d),
        moving=np.zeros(d, dtype=bool),
    )
    return replace(fit, state=state, collocation=problem.weighted(fit.collocation, FINAL_WEIGHT))


def cheapest(problem: Problem, whole: Fit, origins: Sequence[Origin]) -> Fit:
    """The cheapest support at one of some origins, by the quadratic model around a law."""
    found = map(next, laws_at(problem, whole, origins))
    return min(found, key=lambda fit: fit.criterion)


def laws_at(
    problem: Problem, whole: Fit, origins: Sequence[Origin], free: bool = False
) -> Iterator[Iterator[Fit]]:
    """The cheapest law at each of some origins, and its closest rival there.

    By the quadratic model around a law in the centred frame, with all terms of the library, or of a
    shift closure; what it lacks stays zero. Axes that are off may be left ``free`` to move on.
    """
    state, columns = whole.state, np.flatnonzero(whole.state.free())
    information = np.diag(np.where(state.free()[: -problem.d], 0.0, 1e30))
    model, gradient = whole.collocation.linearise(state, columns), np.zeros(len(information))
    information[np.ix_(columns, columns)], gradient[columns] = model.information, model.gradient
    objective, size = whole.collocation.objective(state), len(columns)
    generators = shift_generators(problem.exponents)

    def at(origin: Floats, moving: Bools) -> Iterator[Fit]:
        coefficients = shift_matrix(problem.exponents, -origin) @ state.coefficients
        back = np.kron(np.eye(problem.d), shift_matrix(problem.exponents, origin))
        axes = np.flatnonzero(moving & free)
        rates = -generators[axes] @ coefficients
        flat_rates = rates.swapaxes(1, 2).reshape(-1, coefficients.size)
        ways = np.vstack([np.eye(size), flat_rates[:, columns]]) @ back.T[columns]
        present = np.append(coefficients.T.ravel()[columns], np.zeros(len(axes)))
        quadratic = ways @ information @ ways.T, ways @ gradient, present
        penalties = np.append(problem.entry_penalties[columns], np.full(len(axes), -np.inf))

        def told(solution: Floats, value: float) -> Fit:
            flat = np.append(np.zeros(state.coefficients.size), origin)
            flat[columns] = solution[:size]
            flat[state.coefficients.size + axes] += solution[size:]
            there = state.moved(state.control_points, flat)
            there = replace(there, active=there.coefficients != 0, moving=moving)
            cost = objective + value + problem.axis_penalty * moving.sum()
            return replace(whole, state=there, criterion=cost)

        every = np.ones(len(present), dtype=bool)
        support, solution, value = subset_search(*quadratic, penalties, every)
        yield told(solution, value)
        cost, dropped, added = closest_rival(*quadratic, penalties, support)
        support[dropped], support[added] = False, True
        yield told(minimiser(*quadratic, support), value + cost)

    return (at(*origin) for origin in origins)
