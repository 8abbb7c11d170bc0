"""Sparse regression in small algebra: which terms a quadratic model of the fit needs.

Coefficients of a law differ in size by factors of thousands, and so do the rows of its information
matrix: all matrices are scaled to a unit diagonal before they are solved or inverted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..arrays import Bools, Floats, Ints

Change = tuple[float, Ints, Ints]
"""Change of the function, entries dropped, entries added."""
NONE = np.array([], dtype=int)
"""No entries."""
COLLINEAR = 1e-9
"""Share of a column that is not a combination of others, below which it is taken to be one."""
BATCH = 1_000_000
"""Most numbers of an array over newcomers, those outside and those inside."""
PLATEAU = 1e-6
"""Changes of the function below this are taken for rounding."""
MOST_CHANGES = 4
"""Most changes of a support on its way down, for each entry that there is."""
NOTHING = 1e-250
"""Least information; its inverse, even over the ridge, is still a number."""
DEPENDENT = 1e-9
"""Share of a term that those of the law leave, below which they have it already."""
FAR = 4.0
"""Standard errors of a coefficient beyond which another law has another coefficient."""
LEAST = 1e-300
"""Keeps a quotient or a logarithm finite where there is nothing."""
RIDGE = 1e-12
"""Keeps a matrix with dependent columns solvable; what it cannot tell gets a huge variance."""


@np.errstate(over="ignore", invalid="ignore")  # of columns that are all but combinations
def subset_search(
    information: Floats, gradient: Floats, present: Floats, penalty: Floats, start: Bools
) -> tuple[Bools, Floats, float]:
    """Minimise a quadratic function of ``c`` plus a penalty per non-zero entry, by local search.

    The function is ``(c - p)' S (c - p) - 2 g' (c - p)``: what Gauss-Newton knows around ``p``.
    Takes the best of all single drops, adds and swaps until none helps, once from the given
    support and once from nothing; then asks of every entry left out whether it lets others go
    that it does not pay for by itself (where a conserved quantity ties terms together, only that
    leads on). Unlike a threshold it weighs a term by what the fit loses with it, re-fitting all
    others, so it survives collinear columns and coefficients of very different size.

    Parameters
    ----------
    information : ndarray, shape (m, m)
        ``S``, symmetric positive semi-definite.
    gradient : ndarray, shape (m,)
        ``g``.
    present : ndarray, shape (m,)
        ``p``; zeros for a plain regression.
    penalty : ndarray, shape (m,)
        Price of each non-zero entry, in the units of the objective; minus infinity keeps it in.
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
    best = _search(model, start)
    solution = np.zeros(len(penalty))
    solution[best.inside] = best.fitted * model.scale[best.inside]
    return best.support, solution, best.value


@np.errstate(over="ignore", invalid="ignore")  # of columns that are all but combinations
def subset_path(
    information: Floats,
    gradient: Floats,
    present: Floats,
    penalty: Floats,
    start: Bools,
    shares: Sequence[float],
) -> list[Bools]:
    """The supports that `subset_search` finds of shares of a function, each from the one before.

    Nine of ten supports that such a search tries, one before it has tried: each is solved once.

    Parameters
    ----------
    information, gradient, present, penalty, start
        See `subset_search`.
    shares : sequence of float
        What the function is multiplied by; the penalties are not.
    """
    model, supports = _Remembering.of(information, gradient, present, penalty), [start]
    for share in shares:
        supports.append(_search(replace(model, share=share), supports[-1]).support)
    return supports[1:]


@np.errstate(over="ignore", invalid="ignore")  # of columns that are all but combinations
def closest_rival(
    information: Floats, gradient: Floats, present: Floats, penalty: Floats, support: Bools
) -> Change:
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
    fit = model.fit(support)
    tableau = model.tableau(fit)
    moved = _moved_by_newcomers(model, tableau)
    # Those that move no others cost what they cost alone.
    alone = model.penalty[tableau.outside] - tableau.gained
    alone[moved] = np.inf
    joined = [tableau.outside[moved], tableau.outside[[alone.argmin()]] if len(alone) else NONE]
    rivals = [_with_newcomer(model, support, entry) for entry in np.concatenate(joined)]
    free = replace(model, penalty=np.where(np.isfinite(penalty), 0.0, penalty))
    whole = free.fit(~np.isposinf(penalty))
    lost = np.zeros(len(penalty))
    lost[whole.inside] = whole.fitted**2 / np.diag(whole.inverse)
    for entry in fit.inside[np.isfinite(penalty[fit.inside])]:
        # No law without it is cheaper than all other entries were, if they cost nothing.
        goal = min((rival.value for rival in rivals), default=np.inf)
        if whole.value + lost[entry] < goal:
            without = _changed(support, entry, NONE)
            rivals.append(_descend(model.priced(entry, np.inf), without, goal))
    if not rivals:
        return np.inf, NONE, NONE
    rival = min(rivals, key=lambda rival: rival.value)
    dropped, added = (
        np.flatnonzero(changed) for changed in (support & ~rival.support, rival.support & ~support)
    )
    return rival.value - fit.value, dropped, added


def minimiser(information: Floats, gradient: Floats, present: Floats, support: Bools) -> Floats:
    """Minimiser of the function of `subset_search` on a support, zero elsewhere, shape (m,)."""
    model = _Quadratic.of(information, gradient, present, np.zeros(len(present)))
    fit, solution = model.fit(support), np.zeros(len(present))
    solution[fit.inside] = fit.fitted * model.scale[fit.inside]
    return solution


@dataclass(frozen=True)
class _Fit:
    """A quadratic function at its minimum on a support, all in scaled entries."""

    support: Bools
    inside: Ints
    inverse: Floats
    fitted: Floats
    left: Floats
    fall: float
    value: float


@dataclass(frozen=True)
class _Quadratic:
    """A share of a quadratic function, with penalties, its entries scaled to a unit diagonal.

    Everything is reckoned from the present point: with data that are nearly exact the function
    itself has more digits than a computer, its changes do not.
    """

    matrix: Floats
    scale: Floats
    gradient: Floats
    present: Floats
    penalty: Floats
    share: float = 1.0

    @classmethod
    def of(
        cls, information: Floats, gradient: Floats, present: Floats, penalty: Floats
    ) -> _Quadratic:
        """Scale the function."""
        matrix, scale = equilibrated(information)
        return cls(matrix, scale, gradient * scale, present / scale, penalty)

    def priced(self, entry: int, price: float) -> _Quadratic:
        """The same with another price of an entry: minus infinity keeps it in, infinity out."""
        penalty = self.penalty.copy()
        penalty[entry] = price
        return replace(self, penalty=penalty)

    def paid(self, inside: Ints) -> float:
        """What entries cost, but for those that must be there."""
        return float(self.penalty[inside][np.isfinite(self.penalty[inside])].sum())

    def tableau(self, fit: _Fit) -> _Tableau:
        """What can be read off around a fit."""
        return _Tableau.of(self, fit)

    def fit(self, support: Bools) -> _Fit:
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
        value = self.paid(inside) + self.share * fall
        return _Fit(support, inside, inverse, fitted, left, fall, value)


@dataclass(frozen=True)
class _Remembering(_Quadratic):
    """The same, which remembers of each support what holds for all shares and penalties."""

    fits: dict[bytes, _Fit] = field(default_factory=dict)
    tableaus: dict[bytes, _Tableau] = field(default_factory=dict)

    def fit(self, support: Bools) -> _Fit:
        if (key := support.tobytes()) not in self.fits:
            self.fits[key] = super().fit(support)
        fit = self.fits[key]
        return replace(fit, value=self.paid(fit.inside) + self.share * fit.fall)

    def tableau(self, fit: _Fit) -> _Tableau:
        if (key := fit.support.tobytes()) not in self.tableaus:
            self.tableaus[key] = super().tableau(fit)
        return self.tableaus[key]


def _search(model: _Quadratic, start: Bools) -> _Fit:
    """The lowest value from a support and from nothing, and through newcomers from there."""
    starts = (start, np.isneginf(model.penalty))
    best = min((_descend(model, first) for first in starts), key=lambda fit: fit.value)
    for _ in range(MOST_CHANGES * len(start)):
        deeper = _through_newcomer(model, best)
        if deeper is None:
            break
        best = deeper
    return best


def _descend(model: _Quadratic, start: Bools, goal: float = np.inf) -> _Fit:
    """Take the best of all drops, adds and swaps until none helps.

    Or until as many changes like the best as there are entries would still not reach the goal.
    """
    best = model.fit(start)
    for _ in range(MOST_CHANGES * len(start)):
        changes = _single_changes(model, model.tableau(best))
        change, dropped, added = min(changes, key=lambda item: item[0])
        if not change < -PLATEAU or best.value + len(best.inside) * change > goal:
            return best
        # Rounding may promise a fall that does not come: what counts is the value itself.
        fit = model.fit(_changed(best.support, dropped, added))
        if not fit.value < best.value - PLATEAU:
            return best
        best = fit
    return best


def _through_newcomer(model: _Quadratic, best: _Fit) -> _Fit | None:
    """A lower value reached by forcing one entry in, which may let several others go."""
    tableau = model.tableau(best)
    promising = _moved_by_newcomers(model, tableau)
    for entry in tableau.outside[promising]:
        trial = _with_newcomer(model, best.support, entry)
        if trial.value < best.value - PLATEAU:
            return _descend(model, trial.support)
    return None


def _with_newcomer(model: _Quadratic, support: Bools, entry: int) -> _Fit:
    """The fit that a descent reaches with an entry forced in, at its own price."""
    trial = _descend(model.priced(entry, -np.inf), _changed(support, NONE, entry))
    return replace(trial, value=trial.value + model.penalty[entry])


def _moved_by_newcomers(model: _Quadratic, tableau: _Tableau) -> Bools:
    """Which newcomers make a single drop, add or swap of the others worth its price, (outside,).

    As rank-one updates of the tableau tell, for many newcomers at once: first axis. Those that are
    combinations of the entries inside are among them: for these no update tells.
    """
    outside, inside, room, size = tableau.outside, tableau.inside, tableau.room, model.share**0.5
    price, share = model.penalty[outside], np.maximum(room, COLLINEAR)[:, None]
    shared = model.matrix[outside[:, None], inside]
    common = model.matrix[outside[:, None], outside] - shared @ tableau.response.T
    pull = size * tableau.left[:, None] / share
    fitted, spread = size * tableau.fitted - tableau.response * pull, tableau.spread
    spread = spread + tableau.response**2 / share
    left, free = size * tableau.left - common * pull, room - common**2 / share
    np.fill_diagonal(free, 0.0)  # the newcomer itself is in
    loss = fitted**2 / spread - model.penalty[inside]
    gain = _gain(left, free)
    moved = (room <= COLLINEAR) | (loss < -PLATEAU).any(axis=1)
    moved |= (price - gain < -PLATEAU).any(axis=1)
    saved = gain - price + model.penalty[inside].max(initial=-np.inf)
    lost = np.where(np.isfinite(model.penalty[inside]), fitted**2 / spread, np.inf)
    swaps = _may_swap(tableau, common / share, spread, lost, free, gain, saved)
    unsure = np.flatnonzero(~moved & swaps.any(axis=1))
    for many in np.array_split(unsure, 1 + tableau.response.size * len(unsure) // BATCH):
        response = tableau.response - (common / share)[many, :, None] * tableau.response[many, None]
        swapped_left = left[many, :, None] + response * (fitted / spread)[many, None]
        swapped_room = free[many, :, None] + response**2 / spread[many, None]
        swapped_room[np.arange(len(many)), many] = 0.0
        swap = loss[many, None] + price[:, None] - _gain(swapped_left, swapped_room)
        moved[many] = (swap < -PLATEAU).any(axis=(1, 2))
    return moved


def _may_swap(
    tableau: _Tableau,
    common: Floats,
    spread: Floats,
    lost: Floats,
    free: Floats,
    gain: Floats,
    saved: Floats,
) -> Bools:
    """Which of the others a newcomer may let take the place of an entry inside, two axes.

    Few are enough alike. With the tangent ``k`` of what two have in common, for which there is a
    bound, a swap pays only if ``sqrt(lost) < k sqrt(gain) + sqrt((1 + k^2) saved)``.
    """
    alike = np.abs(tableau.response / np.sqrt(tableau.spread)).max(axis=1, initial=0.0)
    given = np.abs(tableau.response / np.sqrt(spread)).max(axis=1, initial=0.0)[:, None]
    alike = (alike + np.abs(common) * given) / np.sqrt(np.maximum(free, COLLINEAR))
    gain, saved = np.maximum(gain, 0.0), np.maximum(saved, 0.0)
    most = alike * np.sqrt(gain) + np.sqrt((1 + alike**2) * saved)
    pays = (saved > 0) & (np.sqrt(lost.min(axis=1, initial=np.inf))[:, None] <= most)
    pays |= free <= COLLINEAR
    np.fill_diagonal(pays, False)
    return pays


def _changed(support: Bools, dropped: Ints | int, added: Ints | int) -> Bools:
    changed = support.copy()
    changed[dropped] = False
    changed[added] = True
    return changed


@dataclass(frozen=True)
class _Tableau:
    """What single changes of a support hang on: entries that may leave, and that may join.

    ``spread`` is the inverse's diagonal, ``response`` (outside, inside) how far those inside give
    way to a newcomer, ``left`` the gradient that is left to it, ``room`` the share of it that is no
    combination of those inside.
    """

    inside: Ints
    outside: Ints
    fitted: Floats
    spread: Floats
    response: Floats
    left: Floats
    room: Floats

    @classmethod
    def of(cls, model: _Quadratic, fit: _Fit) -> _Tableau:
        inside, outside = fit.inside, np.flatnonzero(~fit.support)
        shared = model.matrix[outside[:, None], inside]
        response = shared @ fit.inverse
        room = 1 - (response * shared).sum(axis=1)
        return cls(
            inside, outside, fit.fitted, fit.inverse.diagonal(), response, fit.left[outside], room
        )

    @cached_property
    def gained(self) -> Floats:
        """What each newcomer explains."""
        return _gain(self.left, self.room)

    @cached_property
    def gained_after(self) -> Floats:
        """What it explains after each drop, (outside, inside).

        A drop changes what the others leave over, and the room a newcomer has, by rank one.
        """
        left = self.response * (self.fitted / self.spread)
        left += self.left[:, None]
        room = self.response**2 / self.spread
        room += self.room[:, None]
        return _gain(left, room)


def _single_changes(model: _Quadratic, tableau: _Tableau) -> list[Change]:
    """Best drop, add and swap."""
    inside, outside, share = tableau.inside, tableau.outside, model.share
    lost, price = tableau.fitted**2 / tableau.spread, model.penalty[outside]
    loss = share * lost - model.penalty[inside]
    cost = price - share * tableau.gained
    changes = [(np.inf, NONE, NONE)]
    if len(inside):
        changes.append((loss.min(), inside[[loss.argmin()]], NONE))
    if len(outside):
        changes.append((cost.min(), NONE, outside[[cost.argmin()]]))
    if len(inside) and len(outside):
        swap = loss + price[:, None]
        swap -= share * tableau.gained_after
        add, drop = divmod(int(swap.argmin()), len(inside))
        changes.append((swap[add, drop], inside[[drop]], outside[[add]]))
    return changes


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
    scale = 1 / np.sqrt(np.maximum(np.diag(information), NOTHING))
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
    new = apart > DEPENDENT * whole
    room = np.where(new, apart, 1.0)
    return np.where(new, left / room, 0.0), np.where(new, 1 / room, np.inf)


# --------------------------------------------------------------------------------------------------
# How likely a law is next to which a law's coefficients are elsewhere than their errors say.
#
# The standard errors of a law hold if its terms are the right ones. A law with one term more, one
# less or one in place of another may fit a little worse, or better by less than the price of a
# term, and have other coefficients: where a motion tells the sum of two dampings alone, the law
# that gives all of it to one of them has an error that is ten times too small. So the laws next to
# a law are weighed by their evidence (Laplace's approximation; Madigan and Raftery 1994), and those
# count that are far away in units of the errors that are told.


def prior_prices(exponents: Ints) -> Floats:
    """Twice the log odds that an equation lacks a term of each kind, shape (l,).

    An equation has one linear term by expectation, half a quadratic one and so on, and a constant
    as likely as not; a coefficient is as large as 1 in standard units.
    """
    degrees = exponents.sum(axis=1)
    chance = 2.0 ** (1 - degrees) / np.bincount(degrees)[degrees]
    return 2 * np.log(1 / np.minimum(chance, 0.5) - 1)


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # of columns that are combinations
def far_neighbours(
    information: Floats, gradient: Floats, present: Floats, price: Floats, support: Bools
) -> tuple[float, Ints, Ints, int, float]:
    """The odds of the neighbours of a support that have other entries, and the likeliest of them.

    Parameters
    ----------
    information, gradient, present : ndarray
        See `subset_search`; in units in which an entry is as large as 1.
    price : ndarray, shape (m,)
        Twice the log odds that an entry is zero.
    support : ndarray of bool, shape (m,)
        Of which a neighbour has one entry more, one less or one in place of another.

    Returns
    -------
    odds : float
        Probability of all that have an entry more than `FAR` errors away, if the law is the support
        or one of its neighbours.
    dropped, added : ndarray of int
        The entries that the likeliest of them drops and adds.
    entry : int
        Which of the support it has farthest away, ...
    value : float
        ... and what that is there.
    """
    matrix, scale = equilibrated(information)
    own, others = np.flatnonzero(support), np.flatnonzero(~support)
    shared = matrix[np.ix_(others, own)]
    inverse = np.linalg.inv(matrix[np.ix_(own, own)])
    pull, spread = matrix @ (present / scale) + gradient * scale, np.diag(inverse)
    fitted, response = inverse @ pull[own], shared @ inverse
    # First axis: the entry that leaves, last of all none; second: the one that joins, likewise.
    leaves, none = np.eye(len(own) + 1, len(own), dtype=bool)[:, None], np.zeros((1, len(own)))
    out, gone = np.vstack([inverse / spread[:, None], none]), np.append(fitted, 0.0)[:, None]
    lost = fitted**2 / spread + np.log(spread * scale[own] ** 2) - price[own]
    along = np.vstack([(response / spread).T, np.zeros((1, len(others)))])
    freed = along * np.append(spread, 0.0)[:, None]
    left = pull[others] - response @ pull[own] + along * gone
    room = 1 - (response * shared).sum(axis=1) + along * freed
    new = room > COLLINEAR
    step = np.where(new, left / room, 0.0)
    joined = np.where(new, np.log(room / scale[others] ** 2) + price[others] - left * step, np.inf)
    cost = np.append(lost, 0.0)[:, None] + np.hstack([joined, np.zeros((len(own) + 1, 1))])
    gives = np.concatenate([response - freed[:, :, None] * out[:, None], 0.0 * leaves], axis=1)
    values = (fitted - out * gone)[:, None] - gives * np.hstack([step, 0.0 * gone])[:, :, None]
    values = np.where(leaves, 0.0, values)
    away = np.abs(values - fitted) / np.sqrt(spread)
    weight = np.exp((cost.min() - cost) / 2)
    weight = np.where((away > FAR).any(axis=2), weight / weight.sum(), 0.0)
    drop, add = np.unravel_index(weight.argmax(), weight.shape)
    entry = int(away[drop, add].argmax())
    value = float(values[drop, add, entry] * scale[own[entry]])
    return float(weight.sum()), own[drop : drop + 1], others[add : add + 1], int(own[entry]), value
