"""Sparse regression in small algebra: the paper's STRidge and our subset search."""

from __future__ import annotations

import numpy as np

RIDGE = 1e-11
"""Relative ridge that keeps a nearly singular information matrix solvable."""


def subset_search(
    information: np.ndarray, pull: np.ndarray, charge: np.ndarray, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Minimise ``c' S c - 2 b' c + sum of charges of the non-zero entries`` by local search.

    Starts at a support and takes the best of all single drops, adds and swaps until none helps.
    Unlike a threshold it weighs a term by what the fit loses with it, re-fitting all others, so
    it survives collinear columns and coefficients of very different size.

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
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    matrix = information * scale[:, None] * scale
    matrix[np.diag_indices_from(matrix)] += RIDGE
    target = pull * scale
    support = start.copy()
    for _ in range(20 * len(target)):
        inside, outside = np.flatnonzero(support), np.flatnonzero(~support)
        inverse = np.linalg.inv(matrix[np.ix_(inside, inside)])
        fitted = inverse @ target[inside]
        spread = np.diag(inverse)
        response = matrix[np.ix_(outside, inside)] @ inverse
        left = target[outside] - matrix[np.ix_(outside, inside)] @ fitted
        room = 1 - np.einsum("ak,ka->a", response, matrix[np.ix_(inside, outside)])
        room = np.maximum(room, RIDGE)
        loss = fitted**2 / spread - charge[inside]
        gain = left**2 / room - charge[outside]
        best = [(loss.min(initial=np.inf), "drop"), (-gain.max(initial=-np.inf), "add")]
        if len(inside) and len(outside):
            swapped_left = left[:, None] + response * (fitted / spread)
            swapped_room = room[:, None] + response**2 / spread
            swap = loss - (swapped_left**2 / swapped_room - charge[outside][:, None])
            best.append((swap.min(), "swap"))
        change, move = min(best)
        if not change < -1e-9:
            break
        if move == "drop":
            support[inside[loss.argmin()]] = False
        elif move == "add":
            support[outside[gain.argmax()]] = True
        else:
            add, drop = np.unravel_index(swap.argmin(), swap.shape)
            support[outside[add]], support[inside[drop]] = True, False
    inside = np.flatnonzero(support)
    solution = np.zeros(len(target))
    solution[inside] = np.linalg.solve(matrix[np.ix_(inside, inside)], target[inside])
    paid = charge[support & np.isfinite(charge)].sum()
    value = float(paid - target @ solution)
    return support, solution * scale, value
