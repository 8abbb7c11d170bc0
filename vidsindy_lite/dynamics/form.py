"""The form of a law before it is searched: its variables, its candidate terms, and what is known.

A law of second order, ``x'' = f(x, x')``, is one of first order in positions and velocities. The
velocities are states that nobody has measured, and their half of the law is known: ``x' = v``. So
is the time, if there are inputs: a last state, with ``t' = 1``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints
from .candidates import OTHERS, Library
from .library import CLOCK, Function, closure, velocity_names
from .polynomials import PolynomialSystem, parse_term

SIZES, POINTS = (-3, 6), 64
"""Decades of the sizes of points at which a function is asked whether it is none, and how many."""


@dataclass(frozen=True, eq=False)
class Form:
    """What a law of ``d`` equations in ``l`` terms may look like.

    Parameters
    ----------
    names : tuple of str
        Of the d state variables: first those that were measured, then their velocities, and last
        the time, as far as a law has them.
    exponents : ndarray of int, shape (l, d + k) or (l, 2 d + k)
        The library: with every term all that divides it. Slopes are variables, too, if the law may
        be a fraction.
    functions : tuple of Function, length k
        Of the state, in the units of the data.
    candidates : ndarray of bool, shape (l, d)
        Terms that are searched.
    known : ndarray, shape (l, d)
        Coefficients that are given, in the units of the data; zero where a term is a candidate.
    movable : ndarray of bool, shape (d,)
        Coordinates whose origin is unknown. What is known does not change when it moves.
    shared : ndarray of int, shape (l d,)
        Of each place in the coefficients, equation by equation, whose value it has: its own, but
        for the directions of a vector, which all have that of the first.
    """

    names: tuple[str, ...]
    exponents: Ints
    functions: tuple[Function, ...]
    candidates: Bools
    known: Floats
    movable: Bools
    shared: Ints

    @classmethod
    def of(
        cls, coordinates: tuple[str, ...], library: Library, order: int = 1, origin: str = "learn"
    ) -> Form:
        """A law in all terms of a library, for named coordinates that were measured."""
        measured, names = len(coordinates), coordinates
        if order == 2:
            names += velocity_names(coordinates)
        states = len(names)  # those that an equation is sought or known of
        if library.timed(names):
            names += (CLOCK,)
        d = len(names)
        wanted, functions = library.resolve(names, measured)
        velocities = np.eye(wanted.shape[1], dtype=int)[measured:states]
        exponents = closure(np.concatenate([wanted, velocities]))
        row = {tuple(powers): k for k, powers in enumerate(exponents.tolist())}
        known = np.zeros((len(exponents), d))
        for position, velocity in enumerate(velocities.tolist()):
            known[row[tuple(velocity)], position] = 1.0
        known[0, states:] = 1.0
        candidates, sought = np.zeros(known.shape, dtype=bool), slice(states - measured, states)
        candidates[[row[tuple(powers)] for powers in wanted.tolist()], sought] = True
        shared, first = np.arange(candidates.size).reshape(d, -1), None
        alone = np.eye(wanted.shape[1], dtype=int)[d:].tolist()
        for powers, function in zip(alone, functions, strict=False):
            direction = function.direction
            if direction is None:
                continue
            equation, here = states - measured + direction, row[tuple(powers)]
            candidates[here, np.arange(d) != equation] = False
            first = None if direction == 0 else first
            if _vanishes(function, d):
                candidates[here, equation] = False
                continue
            first = shared[equation, here] if first is None else first
            shared[equation, here] = first
        # A slope multiplies terms of its own equation alone.
        slopes = exponents[:, d + len(functions) :]
        candidates &= (slopes.sum(axis=1) == 0)[:, None] | (slopes > 0 if slopes.size else False)
        # A function of the state does not move with the origin, so that none is sought; and what is
        # given is so in the frame of the data.
        stays = slopes.size or not all(function.of_time for function in functions)
        still = origin == "data" or stays or library.given
        movable = (np.arange(d) < measured) & (not still)
        form = cls(names, exponents, functions, candidates, known, movable, shared.ravel())
        if library.given:
            form = form._given({of: dict(terms) for of, terms in library.given}, names[sought])
        if not form.candidates.any():
            raise ValueError("library: must leave a term to be found, got all of them given")
        return form

    def _given(
        self, equations: dict[str, dict[str, float | None]], sought: tuple[str, ...]
    ) -> Form:
        """The same with some terms of equations given, which are among those that are sought.

        What is said of a term counts more than what is said of all others.
        """
        if unknown := [equation for equation in equations if equation not in sought]:
            raise ValueError(
                f"library: must give terms of an equation of {', '.join(sought)}, "
                f"got {unknown[0]!r}"
            )
        candidates, known = self.candidates.T.ravel(), self.known.T.ravel()
        told: dict[int, float | None] = {}

        def tell(entry: int, value: float | None) -> None:
            tied = self.shared == self.shared[entry]
            candidates[tied], known[tied] = value is None, value or 0.0

        for equation, terms in equations.items():
            for entry in self._there(equation) if terms.get(OTHERS) is not None else ():
                tell(entry, terms[OTHERS])
        for equation, terms in equations.items():
            for entry, value in self._named(equation, terms).items():
                common = int(self.shared[entry])
                if told.setdefault(common, value) != value:
                    raise ValueError(
                        "library: the directions of a vector have one coefficient, got "
                        f"{told[common]} and {value} in the equation of {equation}"
                    )
                tell(entry, value)
        shape = self.known.T.shape
        return replace(self, candidates=candidates.reshape(shape).T, known=known.reshape(shape).T)

    def _there(self, equation: str) -> list[int]:
        """Places of an equation's candidates in the coefficients, equation by equation."""
        j = self.names.index(equation)
        return (j * len(self.known) + np.flatnonzero(self.candidates[:, j])).tolist()

    def _named(self, equation: str, terms: dict[str, float | None]) -> dict[int, float | None]:
        """What is said of the terms of an equation that are named, by their places."""
        there, size = self._there(equation), len(self.known)
        rows: dict[int, float | None] = {}
        for term, value in terms.items():
            row = self._row(term)
            entry = self.names.index(equation) * size + (-1 if row is None else row)
            if row is not None and entry in there:
                rows[entry] = value
            elif term != OTHERS:
                names = self.law(self.known).terms
                raise ValueError(
                    f"library: {term!r} is no term of the equation of {equation}, which has "
                    f"{', '.join(names[entry % size] for entry in there)}"
                )
        return rows

    def _row(self, term: str) -> int | None:
        """Where a term stands in the library; none if it is not there."""
        slopes = tuple(f"{name}'" for name in self.names)
        variables = (*self.names, *(function.name for function in self.functions), *slopes)
        try:
            powers = parse_term(term, variables[: self.exponents.shape[1]])
        except ValueError:
            return None
        same = (self.exponents == powers).all(axis=1)
        return int(same.argmax()) if same.any() else None

    def law(self, coefficients: Floats) -> PolynomialSystem:
        """The law with these coefficients, (l, d), in the units of the data."""
        return PolynomialSystem(self.names, self.exponents, coefficients, functions=self.functions)

    @property
    def states(self) -> int:
        """How many variables there are besides the time."""
        return self.law(self.known).states

    @property
    def implicit(self) -> Bools:
        """Which terms hold a slope, (l,)."""
        slopes = self.exponents[:, len(self.names) + len(self.functions) :]
        return np.asarray(slopes.any(axis=1))

    @property
    def degree(self) -> int:
        """The highest degree among the candidates; a function counts as a variable."""
        return int(self.exponents[self.candidates.any(axis=1)].sum(axis=1).max())

    @property
    def searched(self) -> Ints:
        """The candidates' places in the coefficients, equation by equation."""
        own = self.shared == np.arange(len(self.shared))
        return np.flatnonzero(self.candidates.T.ravel() & own)


def _vanishes(function: Function, d: int) -> bool:
    """Whether a function is zero at points of all sizes, as a vector along an axis of none."""
    rng = np.random.default_rng(0)
    sizes = 10.0 ** rng.uniform(*SIZES, (POINTS, 1))
    return not function.value(sizes * rng.standard_normal((POINTS, d))).any()
