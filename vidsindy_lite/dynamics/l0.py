"""Sparse regression in small algebra: which terms a quadratic model of the fit needs.

Coefficients of a law differ in size by factors of thousands, and so do the rows of its information
matrix: all matrices are scaled to a unit diagonal before they are solved or inverted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np

from ..arrays import Bools, Floats, Ints

#: Share of a column that is not a combination of others, below which it is taken to be one.
COLLINEAR = 1e-9
NEGLIGIBLE = 1e-6  #: Changes of the function below this are taken for rounding.
#: Twice the log of odds of 20 to 1: strong evidence for one of two laws (Kass, Raftery 1995).
STRONG = 6.0
LEAST = 1e-300  #: Keeps a quotient or a logarithm finite where there is nothing.
#: Keeps a matrix with dependent columns solvable; what it cannot tell gets a huge variance.
RIDGE = 1e-12


@np.errstate(over="ignore", invalid="ignore")  # of columns that are all but combinations
def subset_search(
    information: Floats, gradient: Floats, present: Floats, penalty: Floats, start: Bools
) -> tuple[Bools, Floats, float]:
    """Minimise a quadratic function of ``c`` plus a penalty per non-zero entry, by local search.

    The function is ``(c - p)' S (c - p) - 2 g' (c - p)``: what Gauss-Newton knows around ``p``.
    Takes the best of all single drops, adds and swaps until none helps, once from the given
    support and once from nothing. Unlike a threshold it weighs a term by what the fit loses with
    it, re-fitting all others, so it survives collinear columns and coefficients of very different
    size.

    Parameters
    ----------
    information : ndarray, shape (m, m)
        ``S``, symmetric positive semi-definite.
    gradient : ndarray, shape (m,)
        ``g``.
    present : ndarray, shape (m,)
        ``p``; zeros for a plain regression.
    penalty : ndarray, shape (m,)
        Penalty of each non-zero entry, in the units of the objective; minus infinity keeps it in.
    start : ndarray of bool, shape (m,)
        First support.

    Returns
    -------
    support : ndarray of bool, shape (m,)
    solution : ndarray, shape (m,)
        Minimiser on the support, zero elsewhere.
    value : float
        The function with penalties.
    """
    model = _Quadratic.of(information, gradient, present, penalty)
    starts = (start, np.isneginf(model.penalty))
    best = min((_descend(model, first) for first in starts), key=model.value)
    return best.support, model.solution(best), model.value(best)


@np.errstate(over="ignore", invalid="ignore")  # of columns that are all but combinations
def closest_rival(
    information: Floats, gradient: Floats, present: Floats, penalty: Floats, support: Bools
) -> tuple[float, Ints, Ints]:
    """The other support that costs least, of those next to a support.

    Every entry has to leave or to join, in turn, and the others then leave and join as they like:
    laws that share little may fit alike where the motion is short or slow.

    Parameters
    ----------
    information, gradient, present, penalty
        See `subset_search`.
    support : ndarray of bool, shape (m,)
        A support at which `subset_search` has stopped.

    Returns
    -------
    cost : float
        By how much the function with penalties rises.
    dropped, added : ndarray of int
        The entries that leave and enter.
    """
    model = _Quadratic.of(information, gradient, present, penalty)
    rivals = [_forced(model, support, k) for k in np.flatnonzero(np.isfinite(penalty)).tolist()]
    value, rival = min(rivals, key=itemgetter(0), default=(np.inf, support))
    cost = value - model.value(model.fit(support))
    return cost, np.flatnonzero(support & ~rival), np.flatnonzero(rival & ~support)


def minimiser(information: Floats, gradient: Floats, present: Floats, support: Bools) -> Floats:
    """Minimiser of the function of `subset_search` on a support, zero elsewhere, shape (m,)."""
    model = _Quadratic.of(information, gradient, present, np.zeros(len(present)))
    return model.solution(model.fit(support))


@dataclass(frozen=True, eq=False)
class _Fit:
    """A quadratic function at its minimum on a support, and the gradient that is left there.

    All in scaled entries.
    """

    support: Bools
    inside: Ints
    inverse: Floats
    fitted: Floats
    left: Floats
    fall: float


@dataclass(frozen=True)
class _Quadratic:
    """A quadratic function with penalties, its entries scaled to a unit diagonal.

    Everything is reckoned from the present point: with data that are nearly exact the function
    itself has more digits than a computer, its changes do not.
    """

    matrix: Floats
    scale: Floats
    gradient: Floats
    present: Floats
    penalty: Floats

    @classmethod
    def of(
        cls, information: Floats, gradient: Floats, present: Floats, penalty: Floats
    ) -> _Quadratic:
        """Scale the function."""
        matrix, scale = equilibrated(information)
        return cls(matrix, scale, gradient * scale, present / scale, penalty)

    def value(self, fit: _Fit) -> float:
        """The function, and what entries cost but for those that must be there."""
        penalty = self.penalty[fit.inside]
        return float(penalty[np.isfinite(penalty)].sum()) + fit.fall

    def fit(self, support: Bools) -> _Fit:
        """The minimum on a support."""
        inside = np.flatnonzero(support)
        block = self.matrix[inside[:, None], inside]
        inverse = np.asarray(np.linalg.inv(block), dtype=float)
        step = -self.present
        step[inside] = 0.0
        target = self.gradient[inside] - self.matrix[inside] @ step
        moved = inverse @ target
        moved += inverse @ (target - block @ moved)
        step[inside] = moved
        left = self.gradient - self.matrix @ step
        fall, fitted = -float(step @ (left + self.gradient)), self.present[inside] + moved
        return _Fit(support, inside, inverse, fitted, left, fall)

    def newcomers(self, fit: _Fit) -> tuple[Ints, Floats, Floats]:
        """Those outside, (k,), how far those inside give way to each, (k, inside), and its room.

        That is the share of it that is no combination of those inside, (k,).
        """
        outside = np.flatnonzero(~fit.support)
        shared = self.matrix[outside[:, None], fit.inside]
        response = shared @ fit.inverse
        return outside, response, 1 - (response * shared).sum(axis=1)

    def solution(self, fit: _Fit) -> Floats:
        """The minimiser, zero outside of the support, in units of its own entries."""
        solution = np.zeros(len(self.scale))
        solution[fit.inside] = fit.fitted * self.scale[fit.inside]
        return solution


def _descend(model: _Quadratic, start: Bools) -> _Fit:
    """Take the best of all drops, adds and swaps until none helps."""
    best = model.fit(start)
    while True:
        change, entries = _best_change(model, best)
        if not change < -NEGLIGIBLE:
            return best
        fit = model.fit(_changed(best.support, entries))
        # Rounding may promise a fall that does not come: what counts is the value itself.
        if not model.value(fit) < model.value(best) - NEGLIGIBLE:
            return best
        best = fit


def _forced(model: _Quadratic, support: Bools, entry: int) -> tuple[float, Bools]:
    """The value and support of a descent with an entry forced out of a support, or into it."""
    inside, penalty = support[entry], model.penalty.copy()
    penalty[entry] = np.inf if inside else -np.inf
    forced = replace(model, penalty=penalty)
    trial = _descend(forced, _changed(support, [entry]))
    return forced.value(trial) + (0.0 if inside else model.penalty[entry]), trial.support


def _changed(support: Bools, entries: list[int]) -> Bools:
    """A support without those of some entries that it has, and with the others."""
    changed = support.copy()
    changed[entries] ^= True
    return changed


def _best_change(model: _Quadratic, fit: _Fit) -> tuple[float, list[int]]:
    """The best of all drops, adds and swaps: change of the function, and whose places change."""
    (outside, response, room), spread = model.newcomers(fit), fit.inverse.diagonal()
    loss = fit.fitted**2 / spread - model.penalty[fit.inside]
    price = model.penalty[outside]
    # A row for each that joins, the first for none; a column for each that leaves, the same.
    changes = np.append(0.0, loss) + np.append(0.0, price)[:, None]
    changes[0, 0] = np.inf
    changes[1:, 0] -= _gain(fit.left[outside], room)
    # A drop changes what the others leave over, and the room a newcomer has, by rank one.
    left = response * (fit.fitted / spread) + fit.left[outside, None]
    changes[1:, 1:] -= _gain(left, response**2 / spread + room[:, None])
    add, drop = divmod(int(np.nanargmin(changes)), 1 + len(loss))
    entries = [*fit.inside[drop - 1 : drop].tolist(), *outside[add - 1 : add].tolist()]
    return float(changes[add, drop]), entries


def _gain(left: Floats, room: Floats) -> Floats:
    """What a newcomer explains; nothing if it is a combination of those that are in."""
    gain = left**2
    gain /= np.maximum(room, COLLINEAR)
    gain[~(room > COLLINEAR)] = -np.inf
    return gain


def equilibrated(information: Floats, ridge: float = RIDGE) -> tuple[Floats, Floats]:
    """Scale a symmetric matrix to a unit diagonal, and add a ridge.

    Parameters
    ----------
    information : ndarray, shape (m, m)
        Symmetric, positive semi-definite.
    ridge : float
        Added to the unit diagonal.

    Returns
    -------
    matrix : ndarray, shape (m, m)
        ``scale[:, None] * information * scale``, plus the ridge.
    scale : ndarray, shape (m,)
    """
    # The inverse of so little information, even over the ridge, is still a number.
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-250))
    matrix = information * scale[:, None] * scale
    matrix[np.diag_indices_from(matrix)] += ridge
    return matrix, scale


def inverse(information: Floats) -> Floats:
    """The covariance that belongs to an information matrix, shape (m, m)."""
    matrix, scale = equilibrated(information)
    return np.linalg.inv(matrix) * scale[:, None] * scale


def newcomers(information: Floats, gradient: Floats, own: int) -> tuple[Floats, Floats]:
    """What each further column would be, (k,), if it alone joined the first ``own``, fitted anew.

    Its estimate and its variance: 0 and infinity where it is a combination of the first.
    """
    response = inverse(information[:own, :own]) @ information[:own, own:]
    left = gradient[own:] - gradient[:own] @ response
    whole = np.diag(information)[own:]
    apart = whole - (information[:own, own:] * response).sum(axis=0)
    new = apart > 1e-7 * whole  # else the law has it already, but for rounding
    room = np.where(new, apart, 1.0)
    return np.where(new, left / room, 0.0), np.where(new, 1 / room, np.inf)


# --------------------------------------------------------------------------------------------------
# How likely a law is next to which a law's coefficients are elsewhere than their errors say.
#
# The standard errors of a law hold if its terms are the right ones. A law with one term more, one
# less or one in place of another may fit a little worse, or better by less than the penalty of
# a term, and have other coefficients: where a motion tells the sum of two dampings alone, the law
# that gives all of it to one of them has an error that is ten times too small. So the laws next to
# a law are weighed by their evidence (Laplace's approximation; Madigan and Raftery 1994), and those
# count that are far away in units of the errors that are told.


def prior_penalties(exponents: Ints) -> Floats:
    """Twice the log odds that an equation lacks a term of each kind, shape (l,).

    An equation has one linear term by expectation, half a quadratic one and so on, and a constant
    as likely as not; a coefficient is as large as 1 in standard units.
    """
    degrees = exponents.sum(axis=1)
    chance = 2.0 ** (1 - degrees) / np.bincount(degrees)[degrees]
    return 2 * np.log(1 / np.minimum(chance, 0.5) - 1)


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # of columns that are combinations
def far_neighbours(
    information: Floats, gradient: Floats, present: Floats, penalty: Floats, support: Bools
) -> tuple[float, int, int, int, float]:
    """The odds of the neighbours of a support that have other entries, and the likeliest of them.

    Parameters
    ----------
    information, gradient, present : ndarray
        See `subset_search`; in units in which an entry is as large as 1.
    penalty : ndarray, shape (m,)
        Twice the log odds that an entry is zero.
    support : ndarray of bool, shape (m,)
        Of which a neighbour has one entry more, one less or one in place of another.

    Returns
    -------
    odds : float
        Probability of all that have an entry more than four standard errors away, if the law is the
        support or one of its neighbours.
    dropped, added : int
        The entries that the likeliest of them drops and adds; -1 if it drops or adds none.
    entry : int
        Which of the support it has farthest away, ...
    value : float
        ... and what that is there.
    """
    model = _Quadratic.of(information, gradient, present, penalty)
    law, found, price = model.fit(support), [], penalty - 2 * np.log(model.scale)
    for dropped in (-1, *law.inside.tolist()):
        fit = model.fit(support & (np.arange(len(support)) != dropped))
        outside, response, room = model.newcomers(fit)
        new = (room > COLLINEAR) & (outside != dropped)  # to add what was dropped is the law itself
        own = fit.fall - np.linalg.slogdet(fit.inverse)[1] + price[fit.inside].sum()
        gained = _gain(fit.left[outside], room)
        joined = np.where(new, own + np.log(room) - gained + price[outside], np.inf)
        step = np.where(new, fit.left[outside] / room, 0.0)
        values = np.zeros((1 + len(outside), len(law.inside)))
        values[:, law.inside != dropped] = fit.fitted
        values[1:, law.inside != dropped] -= step[:, None] * response
        out = np.full(len(values), dropped)
        found.append((np.append(own, joined), values, out, np.append(-1, outside)))
    cost, values, out, into = (np.concatenate(parts) for parts in zip(*found, strict=True))
    apart = np.abs(values - law.fitted) / np.sqrt(law.inverse.diagonal())
    weight = np.exp((cost.min() - cost) / 2)
    weight = np.where((apart > 4).any(axis=1), weight / weight.sum(), 0.0)
    best = int(weight.argmax())
    farthest = int(apart[best].argmax())
    entry = int(law.inside[farthest])
    value = float(values[best, farthest] * model.scale[entry])
    return float(weight.sum()), int(out[best]), int(into[best]), entry, value
