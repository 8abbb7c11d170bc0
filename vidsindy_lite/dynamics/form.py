"""The form of a law before it is searched: its variables, its candidate terms, and what is known.

A law of second order, ``x'' = f(x, x')``, is one of first order in positions and velocities. The
velocities are states that nobody has measured, and their half of the law is known: ``x' = v``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from .candidates import Library
from .library import Function, closure, variable_names
from .polynomials import PolynomialSystem, velocity_names


@dataclass(frozen=True, eq=False)
class Form:
    """What a law of ``d`` equations in ``l`` terms may look like.

    Parameters
    ----------
    names : tuple of str
        Of the d state variables: first those that were measured.
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
    def of(cls, measured: int, library: Library, order: int) -> Form:
        """A law in all terms of a library, for so many measured coordinates."""
        names = variable_names(measured)
        if order == 2:
            names += velocity_names(names)
        d = len(names)
        wanted, functions = library.resolve(names, measured)
        velocities = np.eye(wanted.shape[1], dtype=int)[measured:d]
        exponents = closure(np.concatenate([wanted, velocities]))
        row = {tuple(powers): k for k, powers in enumerate(exponents.tolist())}
        known = np.zeros((len(exponents), d))
        for position, velocity in enumerate(velocities.tolist()):
            known[row[tuple(velocity)], position] = 1.0
        candidates = np.zeros(known.shape, dtype=bool)
        candidates[[row[tuple(powers)] for powers in wanted.tolist()], d - measured :] = True
        shared, first = np.arange(candidates.size).reshape(d, -1), 0
        alone = np.eye(wanted.shape[1], dtype=int)[d:].tolist()
        for powers, function in zip(alone, functions, strict=False):
            direction = function.direction
            if direction is not None:
                equation, here = d - measured + direction, row[tuple(powers)]
                candidates[here, np.arange(d) != equation] = False
                first = shared[equation, here] if direction == 0 else first
                shared[equation, here] = first
        # A slope multiplies terms of its own equation alone.
        slopes = exponents[:, d + len(functions) :]
        candidates &= (slopes.sum(axis=1) == 0)[:, None] | (slopes > 0 if slopes.size else False)
        # A function of the state does not move with the origin, so that none is sought.
        movable = (np.arange(d) < measured) & (exponents.shape[1] == d)
        return cls(names, exponents, functions, candidates, known, movable, shared.ravel())

    def law(self, coefficients: Floats) -> PolynomialSystem:
        """The law with these coefficients, (l, d), in the units of the data."""
        return PolynomialSystem(self.names, self.exponents, coefficients, functions=self.functions)

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
