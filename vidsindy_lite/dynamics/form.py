"""The form of a law before it is searched: its variables, its candidate terms, and what is known.

A law of second order, ``x'' = f(x, x')``, is one of first order in positions and velocities. The
velocities are states that nobody has measured, and their half of the law is known: ``x' = v``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from .library import monomial_exponents, variable_names
from .polynomials import velocity_names


@dataclass(frozen=True, eq=False)
class Form:
    """What a law of ``d`` equations in ``l`` terms may look like.

    Parameters
    ----------
    names : tuple of str
        Of the d state variables: first those that were measured.
    exponents : ndarray of int, shape (l, d)
        The library.
    candidates : ndarray of bool, shape (l, d)
        Terms that are searched.
    known : ndarray, shape (l, d)
        Coefficients that are given, in the units of the data; zero where a term is a candidate.
    movable : ndarray of bool, shape (d,)
        Coordinates whose origin is unknown. What is known does not change when it moves.
    """

    names: tuple[str, ...]
    exponents: Ints
    candidates: Bools
    known: Floats
    movable: Bools

    @classmethod
    def of(cls, measured: int, degree: int, order: int) -> Form:
        """A law in all terms up to a degree, for so many measured coordinates."""
        names = variable_names(measured)
        if order == 2:
            names += velocity_names(names)
        d = len(names)
        exponents = monomial_exponents(d, degree)
        movable = np.arange(d) < measured
        known = np.zeros(exponents.shape)
        # Terms 1 .. d of the library are the variables themselves, in their order.
        for position, velocity in enumerate(range(measured, d)):
            known[1 + velocity, position] = 1.0
        candidates = np.zeros(exponents.shape, dtype=bool)
        candidates[:, d - measured :] = True
        return cls(names, exponents, candidates, known, movable)

    @property
    def searched(self) -> Ints:
        """The candidates' places in the coefficients, equation by equation."""
        return np.flatnonzero(self.candidates.T)
