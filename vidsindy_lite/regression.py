"""Sparse regression in small algebra: the paper's STRidge and our subset search."""

from __future__ import annotations

import numpy as np

from .information import equilibrated

COLLINEAR = 1e-9
"""Share of a column that is not a combination of others, below which it is taken to be one."""
PLATEAU = 1e-3
"""Changes of the objective below this are taken for rounding."""


def subset_search(
    information: np.ndarray, pull: np.ndarray, charge: np.ndarray, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Minimise ``c' S c - 2 b' c + sum of charges of the non-zero entries`` by local search.

    Takes the best of all single drops, adds and swaps until none helps, once from the given
    support and once from nothing; then asks of every entry left out whether it lets others go
    that it does not pay for by itself (where a conserved quantity ties terms together, only that
    leads on). Unlike a threshold it weighs a term by what the fit loses with it, re-fitting all
    others, so it survives collinear columns and coefficients of very different size.

    Parameters
    ----------
    information : ndarray, shape (m, m)
        ``S``, symmetric positive semi-definite.
    pull : ndarray, shape (m,)
        ``b``.
    charge : ndarray, shape (m,)
        Price of each non-zero entry, in the units of the objective; minus infinity keeps it in.
    start : ndarray of bool, shape (m,)
        First support.

    Returns
    -------
    support : ndarray of bool, shape (m,)
    solution : ndarray, shape (m,)
        Minimiser on the support, zero elsewhere.
    value : float
        The objective with charges.
    """
    matrix, scale = equilibrated(information)
    target = pull * scale
    kept = np.isneginf(charge)
    support, value = min(
        (_descend(matrix, target, charge, first) for first in (start, kept)),
        key=lambda item: item[1],
    )
    while True:
        deeper = _through_newcomer(matrix, target, charge, support, value)
        if deeper is None:
            break
        support, value = deeper
    inside = np.flatnonzero(support)
    solution = np.zeros(len(target))
    solution[inside] = np.linalg.solve(matrix[np.ix_(inside, inside)], target[inside])
    return support, solution * scale, value


def _descend(
    matrix: np.ndarray, target: np.ndarray, charge: np.ndarray, start: np.ndarray
) -> tuple[np.ndarray, float]:
    """Take the best of all drops, adds and swaps until none helps."""
    support = start.copy()
    best, value = support, np.inf
    while True:
        reached = _value(matrix, target, charge, support)
        # Rounding may promise a fall that does not come: what counts is the value itself.
        if not reached < value - 1e-9:
            break
        best, value = support.copy(), reached
        change, drop, add = min(
            _single_changes(matrix, target, charge, support), key=lambda item: item[0]
        )
        if not change < -1e-9:
            break
        support[drop] = False
        support[add] = True
    return best, value


def _through_newcomer(
    matrix: np.ndarray, target: np.ndarray, charge: np.ndarray, support: np.ndarray, value: float
) -> tuple[np.ndarray, float] | None:
    """A lower value reached by forcing one entry in, which may let several others go."""
    for entry in np.flatnonzero(~support):
        locked = charge.copy()
        locked[entry] = -np.inf
        start = support.copy()
        start[entry] = True
        trial, paid = _descend(matrix, target, locked, start)
        if paid + charge[entry] < value - PLATEAU:
            return _descend(matrix, target, charge, trial)
    return None


def closest_rival(
    information: np.ndarray, pull: np.ndarray, charge: np.ndarray, support: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """The single change of a support that costs least.

    Parameters
    ----------
    information, pull, charge
        See `subset_search`.
    support : ndarray of bool, shape (m,)
        A support at which `subset_search` has stopped.

    Returns
    -------
    cost : float
        By how much the objective with charges rises.
    dropped, added : ndarray of int
        The entries that leave and enter, at most one each.
    """
    matrix, scale = equilibrated(information)
    target = pull * scale
    now = _value(matrix, target, charge, support)
    rivals = []
    for cost, dropped, added in _single_changes(matrix, target, charge, support):
        if np.isfinite(cost):  # a rough one where terms are tied together: work it out again
            changed = support.copy()
            changed[dropped], changed[added] = False, True
            cost = _value(matrix, target, charge, changed) - now
        rivals.append((cost, dropped, added))
    return min(rivals, key=lambda item: item[0])


def _value(
    matrix: np.ndarray, target: np.ndarray, charge: np.ndarray, support: np.ndarray
) -> float:
    """The objective with charges at its minimum on a support."""
    inside = np.flatnonzero(support)
    fitted = np.linalg.solve(matrix[np.ix_(inside, inside)], target[inside])
    paid = charge[inside[np.isfinite(charge[inside])]].sum()
    return float(paid - target[inside] @ fitted)


def _single_changes(
    matrix: np.ndarray, target: np.ndarray, charge: np.ndarray, support: np.ndarray
) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Best drop, add and swap: change of the objective, entries dropped, entries added."""
    inside, outside = np.flatnonzero(support), np.flatnonzero(~support)
    none = np.array([], dtype=int)
    inverse = np.linalg.inv(matrix[np.ix_(inside, inside)])
    fitted = inverse @ target[inside]
    spread = np.diag(inverse)
    response = matrix[np.ix_(outside, inside)] @ inverse
    left = target[outside] - matrix[np.ix_(outside, inside)] @ fitted
    room = 1 - np.einsum("ak,ka->a", response, matrix[np.ix_(inside, outside)])
    loss = fitted**2 / spread - charge[inside]
    cost = charge[outside] - _gain(left, room)
    changes = [(np.inf, none, none)]
    if len(inside):
        changes.append((loss.min(), inside[[loss.argmin()]], none))
    if len(outside):
        changes.append((cost.min(), none, outside[[cost.argmin()]]))
    if len(inside) and len(outside):
        # A drop changes what the others leave over, and the room a newcomer has, by rank one.
        swapped_left = left[:, None] + response * (fitted / spread)
        swapped_room = room[:, None] + response**2 / spread
        swap = loss + charge[outside][:, None] - _gain(swapped_left, swapped_room)
        add, drop = np.unravel_index(swap.argmin(), swap.shape)
        changes.append((swap[add, drop], inside[[drop]], outside[[add]]))
    return changes


def _gain(left: np.ndarray, room: np.ndarray) -> np.ndarray:
    """What a newcomer explains; nothing if it is a combination of those that are in."""
    return np.where(room > COLLINEAR, left**2 / np.maximum(room, COLLINEAR), -np.inf)


def stridge(
    library: np.ndarray,
    derivative: np.ndarray,
    rng: np.random.Generator,
    ridge: float = 1e-6,
    sparsity_weight: float = 5e-3,
    step: float = 1e-2,
    trials: int = 100,
) -> np.ndarray:
    """Sequentially thresholded ridge regression with an adaptive threshold (paper: Eq. S8).

    Ridge regression, columns below a threshold cut, again until none is cut. The threshold is
    raised while the loss on held-out rows, ``|residual| + sparsity_weight |coefficients|_0``, does
    not grow; when it grows the threshold goes back and its step shrinks. A plain least squares on
    all rows ends it. This is the training loop of Rudy et al. (2017), but for the residual, here a
    root mean square, and the condition number, left out of the price of a term: the price then
    means the same for any number of rows and any library.

    Parameters
    ----------
    library : ndarray, shape (n, l)
        Candidate terms.
    derivative : ndarray, shape (n, d)
        Derivatives to explain, one column an equation, each treated alone.
    rng : numpy.random.Generator
        Draws the held-out rows.
    ridge : float
        Ridge penalty; columns and derivatives are scaled to a root mean square of 1.
    sparsity_weight : float
        Price of a term: what it has to save of the relative error of the derivative.
    step : float
        First threshold and its first step: root mean square of what a term contributes, over
        that of the derivative.
    trials : int
        Number of thresholds tried.

    Returns
    -------
    ndarray, shape (l, d)
        Sparse coefficients.

    Raises
    ------
    ValueError
        If the shapes disagree or there are too few rows to hold some out.

    References
    ----------
    S. H. Rudy, S. L. Brunton, J. L. Proctor, J. N. Kutz, "Data-driven discovery of partial
    differential equations", Science Advances 3, e1602614 (2017).
    """
    library, derivative = np.asarray(library, dtype=float), np.asarray(derivative, dtype=float)
    if library.ndim != 2 or derivative.ndim != 2 or len(library) != len(derivative):
        raise ValueError(
            "library and derivative: must have shapes (n, l) and (n, d), "
            f"got {library.shape} and {derivative.shape}"
        )
    n, terms = library.shape
    order = rng.permutation(n)
    held_out, training = order[: n // 5], order[n // 5 :]
    if not len(held_out) or len(training) < terms:
        raise ValueError(f"library: must hold at least {terms} training rows, got {n} rows in all")
    size, speed = _root_mean_square(library), _root_mean_square(derivative)
    scaled = library / size
    columns = [
        _stridge_column(scaled, target, training, held_out, ridge, sparsity_weight, step, trials)
        for target in (derivative / speed).T
    ]
    return np.stack(columns, axis=1) * speed / size[:, None]


def _root_mean_square(columns: np.ndarray) -> np.ndarray:
    """Scale of each column; 1 for a column of zeros."""
    scale = np.sqrt((columns**2).mean(axis=0))
    return np.where(scale > 0, scale, 1.0)


def _stridge_column(scaled, target, training, held_out, ridge, price, step, trials) -> np.ndarray:
    gram = scaled[training].T @ scaled[training] / len(training)
    pull = scaled[training].T @ target[training] / len(training)

    def loss(coefficients):
        residual = target[held_out] - scaled[held_out] @ coefficients
        return np.sqrt((residual**2).mean()) + price * np.count_nonzero(coefficients)

    best = _thresholded(gram, pull, ridge, 0.0)
    lowest, threshold = loss(best), step
    for _ in range(trials):
        trial = _thresholded(gram, pull, ridge, threshold)
        value = loss(trial)
        if value <= lowest:
            best, lowest = trial, value
        else:
            # Back to the last threshold that helped, and on in smaller steps (golden section).
            threshold = max(0.0, threshold - 2 * step)
            step /= 1.618
        threshold += step
    inside = np.flatnonzero(best)
    refit = np.zeros_like(best)
    refit[inside] = np.linalg.lstsq(scaled[:, inside], target, rcond=None)[0]
    return refit


def _thresholded(gram, pull, ridge, threshold) -> np.ndarray:
    support = np.ones(len(pull), dtype=bool)
    coefficients = np.zeros(len(pull))
    while support.any():
        inside = np.flatnonzero(support)
        damped = gram[np.ix_(inside, inside)] + ridge * np.eye(len(inside))
        coefficients[inside] = np.linalg.solve(damped, pull[inside])
        small = support & (np.abs(coefficients) < threshold)
        if not small.any():
            break
        support &= ~small
        coefficients[small] = 0.0
    return coefficients
