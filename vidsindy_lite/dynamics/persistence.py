"""Which law persists while more and more error is tolerated.

A smooth error of a thousandth (of an integrator, of a lens) is a small change of the law: terms
that no noise model refuses, each worth its price. Raise the error that is tolerated, and the law
changes at every step until only the terms remain that the motion needs; then it stays the same
over a wide range. So each equation has a *path* of laws over the tolerated error, and the widest
plateau, in decades, is the law.

To tolerate an error ``s`` times that of the data is to divide the quadratic model of the fit by
``s^2``: the whole path is a matter of small algebra.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats
from .collocation import Fit, WithCurve
from .errors import effective_noise, residual_noise, time_inflation
from .problem import Problem
from .selection import minimiser, subset_path
from .state import State

TOLERATED = 0.03
"""Error that a first search tolerates, relative to the spread of the data: finer terms come after
those that make the motion."""
SMOOTH = 0.1
"""Where errors are smooth, a plateau may begin here: terms below are as likely made by the errors.
Independent errors average out, and whatever they do not explain is a term."""
NOISELESS = 1e-4
"""Errors as small as this are taken for smooth: no measurement is so good, a simulation may be."""
LASTING = 2.0
"""Errors are smooth if a signal is left so many times as uncertain as by independent ones."""
LARGEST = 1.0
"""Largest error on a path: that of no law at all."""
STEP = 0.1
"""Decades between two laws of a path."""


@dataclass(frozen=True, eq=False)
class Plateau:
    """A range of tolerated errors over which the law of one equation has the same terms.

    Parameters
    ----------
    equation : int
        Column of the coefficients.
    low, high : float
        Tolerated errors, relative to the spread of the data.
    terms : ndarray of bool, shape (l,)
        Which terms the equation has, in the law's own frame.
    """

    equation: int
    low: float
    high: float
    terms: Bools

    @property
    def decades(self) -> float:
        """Width of the range in decades."""
        return float(np.log10(self.high / self.low))


@dataclass(frozen=True, eq=False)
class Path:
    """The laws of all equations around a fit, from the errors that it leaves up to no law at all.

    Parameters
    ----------
    fit : Fit
        Around which the laws are found.
    model : WithCurve
        Its quadratic model: `Problem.model`.
    own : float
        The errors that the fit was weighted with; those of the law, where kicks are larger.
    level : float
        Errors that have to be tolerated: a plateau that begins above them is no law of these data.
    plateaus : tuple of tuple of Plateau
        Of each equation, from the smallest tolerated error up.
    """

    fit: Fit
    model: WithCurve
    own: float
    level: float
    plateaus: tuple[tuple[Plateau, ...], ...]

    @property
    def lowest(self) -> float:
        """The smallest tolerated error."""
        return self.plateaus[0][0].low

    @property
    def tolerated(self) -> float:
        """Errors that have to be tolerated, times those that the fit was weighted with."""
        return max(self.level / self.own, 1.0)

    def width(self, plateau: Plateau) -> float:
        """How far a plateau reaches beyond the errors there are, in decades."""
        return max(replace(plateau, low=max(plateau.low, self.own)).decades, 0.0)

    def ranked(self) -> list[list[Plateau]]:
        """The plateaus of each equation that begin at or below the level, the widest first."""
        return [
            sorted((p for p in path if p.low <= self.level), key=lambda p: -p.decades)
            for path in self.plateaus
        ]

    def of(self, active: Bools) -> list[Plateau]:
        """The lowest plateau with the terms of each equation of a law, or the lowest of all."""
        return [
            next((p for p in path if (p.terms == terms).all()), path[0])
            for path, terms in zip(self.plateaus, active.T, strict=True)
        ]

    def restricted(self, active: Bools) -> State:
        """The state that the quadratic model promises for other terms, (l, d)."""
        support = np.append(active.T.ravel(), self.fit.state.moving)[self.model.columns]
        present = self.fit.state.flat()[self.model.columns]
        solution = minimiser(self.model.information, self.model.gradient, present, support)
        return self.model.along(self.fit.state, solution - present, 1.0).of_terms(active)


def follow(problem: Problem, fit: Fit) -> Path:
    """The path of laws around a fit at a physics weight at which the law holds exactly.

    Parameters
    ----------
    problem : Problem
        Its prices.
    fit : Fit
        Around which.
    """
    model, terms_end = problem.model(fit), len(problem.form.searched)
    columns = model.columns
    prices = np.append(problem.prices, np.full(problem.d, -np.inf))[columns]
    present, support = fit.state.flat()[columns], fit.state.free()[columns]
    own = typical(np.maximum(fit.collocation.data_weights**-0.5, problem.process_noise))
    single = np.full(problem.d, own) if problem.kicked else residual_noise(fit)
    lasting = single if problem.kicked else effective_noise(fit)
    lowest = min(typical(single), LARGEST / 10**STEP)
    smooth = bool((lasting > LASTING * single).any() or typical(single) <= NOISELESS)
    level = max(lowest, time_inflation(fit) * typical(lasting), SMOOTH if smooth else 0.0)
    count = int(np.ceil(np.log10(LARGEST / lowest) / STEP))
    # What has to be tolerated is asked itself: a plateau may begin just below it.
    levels = np.union1d(np.geomspace(lowest, LARGEST, count + 1), min(level, LARGEST))
    paths: list[list[Plateau]] = [[] for _ in range(problem.d)]
    lows, highs = levels[:-1].tolist(), levels[1:].tolist()
    shares = [(own / low) ** 2 for low in lows]
    searched = subset_path(model.information, model.gradient, present, prices, support, shares)
    for low, high, support in zip(lows, highs, searched, strict=True):
        active = np.zeros(problem.form.candidates.T.shape, dtype=bool)
        active.flat[problem.form.searched] = support[:terms_end]
        active = fit.state.whole(active.T).T
        for j, terms in enumerate(active):
            if paths[j] and (paths[j][-1].terms == terms).all():
                low_here = paths[j].pop().low
            else:
                low_here = low
            paths[j].append(Plateau(j, low_here, high, terms))
    return Path(fit, model, own, level, tuple(map(tuple, paths)))


def typical(noise: Floats) -> float:
    """One number for the errors of all coordinates: their geometric mean."""
    return float(np.exp(np.log(noise).mean()))
