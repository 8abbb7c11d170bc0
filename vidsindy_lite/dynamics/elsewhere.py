"""Whether a law has its origin elsewhere, or would do as well around another.

An axis whose origin is that of the data is a claim: of all places in the box of the data it would
be just there. It is believed if the data hold it to be so likelier than chance makes it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from .collocation import Linearisation
from .frames import away, freed
from .library import shift_generators, shift_matrix
from .polynomials import PolynomialSystem
from .problem import Problem
from .selection import closest_rival, minimiser, subset_search
from .state import State

NEAR_TIE = 4.0
"""Two laws whose criteria differ by less than this (a likelihood ratio of 7) are not told apart."""
CLAIMED = 6.0
"""Twice the logarithm of the odds, 20 to 1, at which a coincidence is believed (strong evidence by
Kass and Raftery 1995)."""
AWAY = "another origin"
"""That of a law is said to be elsewhere than where it was found."""
VANISHED = 1e-6
"""What is left of a term in another frame, over the parts that cancel in it, if it vanishes."""


Rival = tuple[str, str, float]
"""Which other origin, along which axis, and by how much the criterion rises there."""


def elsewhere(
    problem: Problem, state: State, whole: Linearisation, law: PolynomialSystem
) -> Iterator[Rival]:
    """Other laws that fit almost as well, one axis nearer home or one away from it.

    Parameters
    ----------
    problem : Problem
        Its prices.
    state : State
        Of the last fit.
    whole : Linearisation
        Around it, of all candidates and moving axes.
    law : PolynomialSystem
        The law in the frame of the data.
    """
    exponents = problem.exponents
    # The offset stays where it is: with it free, the same law in another frame would count.
    model = whole.of(problem.form.searched)
    own = problem.price(state)
    for axis, there in _neighbours(problem, state):
        for value, rival in _cheapest_two(problem, state, model, there):
            cost = value + problem.axis_penalty * there.moving.sum() - own
            if not cost < NEAR_TIE:
                break  # the next costs more
            matrix = shift_matrix(exponents, rival.offset - problem.home)
            parts = np.abs(matrix) @ np.abs(rival.coefficients)
            terms = (np.abs(matrix @ rival.coefficients) > VANISHED * parts) | (problem.known != 0)
            if (terms != law.support).any():
                where = AWAY if there.moving[axis] else "the origin of the data"
                yield where, problem.form.names[axis], cost
                break


def pinned(
    problem: Problem,
    state: State,
    model: Linearisation,
    law: PolynomialSystem,
    tolerated: float,
) -> Iterator[Rival]:
    """Axes that may as well be a little off home, by which the law would have other terms.

    Where other axes have left, none is at home for the asking: then to be there is a coincidence,
    as much as the box is wider than the origin is uncertain. A move costs twice its logarithm.

    Parameters
    ----------
    problem, state, model, law
        See `elsewhere`.
    tolerated : float
        Errors that have to be tolerated, over those that the law leaves.
    """
    for axis, gain, room, moved in freed(problem, state, model, tolerated):
        new = (np.abs(moved) > VANISHED * np.abs(moved).max(initial=0.0)) & ~law.support
        if state.moving.any() and new.any() and room - gain < CLAIMED:
            yield AWAY, problem.form.names[axis], room - gain


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
        yield (
            f"the data hardly tell where the law's origin is in {' and in '.join(axes)}: other "
            f"terms around {where} fit almost as well (criterion {least:+.1f}); use {remedy}"
        )


def _neighbours(problem: Problem, state: State) -> Iterator[tuple[int, State]]:
    """The same law with an axis at home that is not, or away from where it is, and which."""
    axes = np.eye(problem.d, dtype=bool)[state.moving]
    nearer = [(np.where(home, problem.home, state.offset), state.moving & ~home) for home in axes]
    for origin, moving in [*nearer, *away(problem, state)]:
        moved = shift_matrix(problem.exponents, state.offset - origin) @ state.coefficients
        axis = int(np.argmax(moving != state.moving))
        yield axis, replace(state, coefficients=moved, offset=origin, moving=moving)


def _cheapest_two(
    problem: Problem, state: State, model: Linearisation, there: State
) -> Iterator[tuple[float, State]]:
    """The cheapest law around a state in another frame and its closest rival, with their costs."""
    # The quadratic model around the law knows them: what a move does to polynomials is exact.
    columns, size = problem.columns(there), state.coefficients.size
    back = shift_matrix(problem.exponents, there.offset - state.offset)
    axes = np.flatnonzero(there.moving)
    rates = -shift_generators(problem.exponents)[axes] @ there.coefficients
    changes = np.vstack([np.eye(size), rates.transpose(0, 2, 1).reshape(-1, size)])
    changes = changes[np.append(problem.form.searched, np.arange(size, len(changes)))]
    changes = (changes @ np.kron(np.eye(problem.d), back.T))[:, model.columns]
    step = (back @ there.coefficients - state.coefficients).T.ravel()[model.columns]
    pull, present = model.gradient - model.information @ step, there.flat()[columns]
    quadratic = changes @ model.information @ changes.T, changes @ pull, present
    risen = float(-step @ (model.gradient + pull))
    prices = np.append(problem.prices, np.full(problem.d, -np.inf))[columns]
    support, solution, value = subset_search(*quadratic, prices, (present != 0) | (columns >= size))
    flat = there.flat()
    flat[columns] = solution
    yield risen + value, there.moved(there.control_points, flat)
    cost, dropped, added = closest_rival(*quadratic, prices, support)
    support[dropped], support[added] = False, True
    flat[columns] = minimiser(*quadratic, support)
    yield risen + value + cost, there.moved(there.control_points, flat)
