"""A discovery in the axes in which the law is sparsest, where nobody knows how the path lies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import comb

import numpy as np

from ..arrays import Floats
from ..checks import check_choice
from .candidates import Library
from .collocation import Fit
from .conclusion import with_errors
from .discovery import Discovery
from .form import Form
from .library import variable_names
from .orientation import refined, rough_orientations, with_turns
from .problem import Problem
from .trajectories import Trajectory

ROUNDS = 3
"""Most times that a discovery tells the axes better, in which the next is made."""

Solved = tuple[Discovery, Problem, Fit]
Measured = tuple[list[Trajectory], list[Floats], list[Floats] | None]
"""Trajectories, their systematic errors, and their standard errors if they are known."""


def check_orientation(orientation: str, library: Library, d: int, origin: str) -> None:
    """Refuse what is no orientation, or to learn one of data or candidates that have none."""
    check_choice("orientation", orientation, ("data", "learn"))
    if orientation == "data":
        return
    if d not in (2, 3):
        raise ValueError(f"orientation: can be learned of two or three coordinates, got {d}")
    form = Form.of(variable_names(d), library)
    whole = len(form.exponents) == comb(d + form.degree, d) and form.candidates.all()
    if not whole or form.functions or library.given or library.timed(form.names):
        raise ValueError(
            "orientation: can be learned only among all polynomials up to a degree, got "
            f"library={library}"
        )
    if origin != "learn":
        raise ValueError(f"orientation: can be learned only with origin='learn', got {origin!r}")


def in_sparsest_axes(
    own: Discovery,
    pose: Callable[[Floats], Problem],
    solve: Callable[[Floats], Solved],
    rng: np.random.Generator,
) -> Discovery:
    """The law in the axes in which it has fewest terms: its own if no others have fewer.

    Parameters
    ----------
    own : Discovery
        In the axes of the data.
    pose, solve : callable
        The problem, and its solution, in axes that are the rows of (m, m).
    rng : numpy.random.Generator
        For the starts of the search.
    """
    starts = rough_orientations(pose(np.eye(own.system.states // own.system.order)), rng)
    best = min((_settled(turn, solve) for turn in starts), key=_rank, default=own)
    if _terms(best) < _terms(own):
        return replace(best, note=own.note)
    said = "orientation: the data's own axes, as the law has no fewer terms in any others"
    return replace(own, note="; ".join(filter(None, (own.note, said))))


def _settled(turn: Floats, solve: Callable[[Floats], Solved]) -> Discovery:
    """The law in the best axes near some; of laws alike, the one in the axes that were refined."""
    found, problem, fit = solve(turn)
    best = replace(found, orientation=turn), problem, fit
    for _ in range(ROUNDS):
        turn, before = refined(problem, fit) @ turn, _rank(found)
        found, problem, fit = solve(turn)
        if _rank(found) <= _rank(best[0]):
            best = replace(found, orientation=turn), problem, fit
        if _rank(found) >= before:
            break
    found, problem, fit = best
    return with_errors(found, problem, fit, with_turns(problem, fit))


def _rank(found: Discovery) -> tuple[bool, int]:
    """What is to be smallest: no warnings, then few terms."""
    return bool(found.warnings), _terms(found)


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
