"""Beyond the library: whether terms of higher degree explain what a law leaves of its data.

A cubic imitates a sine, the drag of air or the pull of a planet on the path that was recorded, and
nowhere else. What it leaves is small but follows the state, so that terms of the next two degrees
explain it: Rao's score test, of all of them together and of the best of them. And where noise hides
what it leaves, a law with one of them may fit as well.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta, chi2

from ..arrays import Floats, Ints
from .collocation import Collocation, Fit, Linearisation
from .library import monomial_exponents
from .polynomials import PolynomialSystem
from .problem import SURE, Problem, term_penalties
from .selection import newcomers
from .state import State

HIGHER = 2
"""Degrees beyond that of the library: an odd function needs two."""
BUDGET = 2e7
"""Most entries of the derivatives of the data, or the curve, in the terms that are tried."""
CHANCE_OF_ALL, CHANCE_OF_ONE = 1e-4, 1e-3
"""Probability below which what all higher terms explain, or the best of them, is no chance."""
SLIGHT = 1.5
"""Times that what all higher terms explain by chance, where errors are all but independent, such as
those of tracks in compressed video (1.2 was seen)."""
MOST = 0.9
"""Share of what is left that a term explains which a law lacks: errors that last, of an integrator
or a lens, are spread over several (up to two thirds were seen)."""
FEW = 4
"""Errors that are left, to a term, at which all terms together are few: chance leaves more than
that share."""


@dataclass(frozen=True)
class Beyond:
    """What terms of higher degree would explain, and the best of those that a law has not.

    Parameters
    ----------
    gain : float
        What all of them lower the objective by, in chi-square units.
    count : int
        How many there are.
    best : float
        What the best term does that the law has not, one of theirs or of the library.
    tried : int
        How many these are.
    left : float
        The objective, of which they explain a part.
    term : str
        The best of them, and its equation.
    """

    gain: float
    count: int
    best: float
    tried: int
    left: float
    term: str

    @property
    def significant(self) -> bool:
        """Whether that is more than chance makes."""
        return bool(self.count and (self._all or self._one))

    @property
    def decisive(self) -> bool:
        """Whether one term, or few, explain nearly all that is left, be that noise or not."""
        few, most = FEW * self.count < self.left, MOST * self.left
        return bool(self._alone and self.best > most or few and self.count and self.gain > most)

    @property
    def _alone(self) -> bool:
        # Of as many independent errors as are left, one direction seldom has such a share.
        share, others = min(self.best / self.left, 1.0), max(self.left - 1, 0.0) / 2
        return bool(others and beta.sf(share, 0.5, others) * self.tried < CHANCE_OF_ONE)

    @property
    def _all(self) -> bool:
        return bool(self.gain > SLIGHT * chi2.isf(CHANCE_OF_ALL, self.count))

    @property
    def _one(self) -> bool:
        return bool(chi2.sf(self.best, 1) * self.tried < CHANCE_OF_ONE)


@dataclass(frozen=True)
class Wider:
    """A fit among the candidates of a library and the terms of the next degrees.

    Parameters
    ----------
    law : PolynomialSystem
        In the wider library, of which it has the old terms alone.
    state : State
        The same.
    collocation : Collocation
        The same.
    searched, further : ndarray of int
        Places in the coefficients, equation by equation: of the old candidates, and of the terms
        that the library has not, not even as a function of another name.
    prices : ndarray
        Of all places.
    """

    law: PolynomialSystem
    state: State
    collocation: Collocation
    searched: Ints
    further: Ints
    prices: Floats

    @property
    def columns(self) -> Ints:
        """Places of all candidates and further terms."""
        return np.sort(np.concatenate([self.searched, self.further]))

    @cached_property
    def model(self) -> Linearisation:
        """The quadratic model around the fit, in all candidates and moving axes."""
        axes = self.law.coefficients.size + np.flatnonzero(self.state.moving)
        return self.collocation.linearise(self.state, np.concatenate([self.columns, axes]))

    @property
    def candidates(self) -> Linearisation:
        """The same with the axes as they are: the same law in another frame would count."""
        return self.model.of(self.columns)

    @cached_property
    def beyond(self) -> Beyond:
        """The score test of the terms that the law has not."""
        own = np.flatnonzero(self.state.free())
        others = np.concatenate([self.further, np.setdiff1d(self.searched, own)])
        model = self.model.of(np.concatenate([own, others]))
        estimate, variance = newcomers(model.information, model.gradient, len(own))
        single = estimate**2 / variance
        model = self.model.of(np.concatenate([own, self.further]))
        return Beyond(
            gain=float(model.newton()[1] - model.fall),
            count=len(self.further),
            best=float(single.max(initial=0.0)),
            tried=len(others),
            left=float(self.collocation.objective(self.state)),
            term=place(self.law, int(others[single.argmax()])) if len(others) else "",
        )


def widened(problem: Problem, fit: Fit) -> Wider:
    """The last fit among terms beyond its library; of a fraction, in its numerators."""
    form, size, d = problem.form, len(problem.exponents), problem.d
    equations = np.flatnonzero(form.candidates.any(axis=0))
    grid = fit.collocation.grid
    budget = BUDGET / max(grid.x.size, grid.r * d) / len(equations)
    law, exponents = problem.law(fit.state), problem.exponents
    exponents = _higher(exponents, form.states, budget)
    l, new = len(exponents), len(exponents) - size

    def padded(array: NDArray[Any]) -> NDArray[Any]:
        return np.vstack([array, np.zeros((new, array.shape[1]), array.dtype)])

    places = np.arange(d * l).reshape(d, l)
    shared = places.copy()
    shared[:, :size] = places[:, :size].ravel()[form.shared].reshape(d, size)
    known = padded(fit.collocation.known)
    wider = Wider(
        law=replace(law, exponents=exponents, coefficients=padded(law.coefficients)),
        state=replace(
            fit.state,
            coefficients=padded(fit.state.coefficients),
            active=padded(fit.state.active),
            shared=shared.ravel(),
        ),
        # With a known part of its own shape: a collocation is made for its library.
        collocation=replace(fit.collocation, exponents=exponents, known=known),
        searched=places[:, :size].ravel()[form.searched],
        further=places[equations, size:].ravel(),
        prices=np.tile(term_penalties(exponents, problem.measured[0][1].shape[1], SURE), d),
    )
    return _renamed_left_out(wider) if form.functions else wider


def _renamed_left_out(wider: Wider) -> Wider:
    """The same without further terms that the candidates make, as a function may be a monomial."""
    model = wider.model.of(np.concatenate([wider.searched, wider.further]))
    _, variance = newcomers(model.information, model.gradient, len(wider.searched))
    return replace(wider, further=wider.further[np.isfinite(variance)])


def _higher(exponents: Ints, d: int, budget: float) -> Ints:
    """A library with the monomials of the next degrees; of few variables each, if they are many.

    Its first ``d`` columns are the variables, of which functions may be further ones.
    """
    plain = exponents[(exponents[:, d:] == 0).all(axis=1), :d]
    higher = monomial_exponents(d, int(plain.sum(axis=1).max(initial=0)) + HIGHER)
    higher = higher[~(higher[:, None] == plain).all(axis=2).any(axis=1)]
    for variables in (d, 2, 1):
        kept = higher[(higher > 0).sum(axis=1) <= variables]
        if len(kept) <= budget:
            unused = ((0, 0), (0, exponents.shape[1] - d))
            return np.concatenate([exponents, np.pad(kept, unused)])
    return exponents


def place(law: PolynomialSystem, entry: int) -> str:
    """Name of an entry of the coefficients, counted equation by equation."""
    equation, term = divmod(int(entry), len(law.terms))
    return f"{spoken(law, term, equation)} in d{law.names[equation]}/dt"


def spoken(law: PolynomialSystem, term: int, equation: int) -> str:
    """A term within a sentence, where a 1 would be read as a number."""
    constant = "the constant" if law.support[term, equation] else "a constant"
    return constant if law.terms[term] == "1" else law.terms[term]


def beyond_the_library(wider: Wider, noisy: bool) -> Iterator[str]:
    """A warning if the law is an approximation on these data.

    Errors that last may follow the state, too; they are no reason to doubt, unless a single term,
    or the few that a single coordinate has, explain nearly all of them. What is ``noisy`` has
    errors of single samples.
    """
    found = wider.beyond
    if found.decisive or (noisy and found.significant):
        yield (
            f"terms that the law has not explain what it leaves ({found.term}: chi-square "
            f"{found.best:.4g}, all {found.count} of higher degree together {found.gain:.4g}): it "
            "may be an approximation along these data, as of a sine or a drag; raise the degree, "
            "or name its terms with library="
        )
