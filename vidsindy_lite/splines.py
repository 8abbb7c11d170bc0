"""Clamped cubic B-splines in local form: every point touches four control points (paper: Eq. 3)."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

DEGREE = 3


def clamped_knots(breakpoints: np.ndarray) -> np.ndarray:
    """Knot vector of a clamped cubic spline.

    Parameters
    ----------
    breakpoints : array_like, shape (m + 1,)
        Increasing ends of the m knot spans.

    Returns
    -------
    ndarray, shape (m + 7,)
        The breakpoints with both ends repeated three more times: m + 3 control points.

    Raises
    ------
    ValueError
        If there are fewer than two breakpoints or they do not increase.
    """
    breakpoints = np.asarray(breakpoints, dtype=float)
    if breakpoints.ndim != 1 or len(breakpoints) < 2 or not (np.diff(breakpoints) > 0).all():
        raise ValueError(
            f"breakpoints: must be at least two increasing numbers, got {breakpoints}"
        )
    return np.concatenate([breakpoints[:1].repeat(3), breakpoints, breakpoints[-1:].repeat(3)])


def local_basis(knots: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The four basis functions that are not zero at each time, with their slopes.

    Parameters
    ----------
    knots : ndarray, shape (m + 7,)
        From `clamped_knots`.
    t : ndarray, shape (n,)
        Times within the knots.

    Returns
    -------
    first : ndarray of int, shape (n,)
        Index of the first control point that matters at each time.
    values, slopes : ndarray, shape (n, 4)
        ``G`` and ``dG/dt`` of control points first .. first + 3.
    """
    design = BSpline.design_matrix(t, knots, DEGREE)
    values = design.data.reshape(-1, DEGREE + 1)
    first = design.indices.reshape(-1, DEGREE + 1)[:, 0].astype(int)
    # The derivative of a cubic basis is a difference of two quadratic ones, each over its width.
    quadratic = BSpline.design_matrix(t, knots[1:-1], DEGREE - 1).data.reshape(-1, DEGREE)
    lower = first[:, None] + np.arange(1, DEGREE + 1)
    rates = DEGREE * quadratic / (knots[lower + DEGREE] - knots[lower])
    slopes = np.zeros_like(values)
    slopes[:, 1:] += rates
    slopes[:, :-1] -= rates
    return first, values, slopes


def design_matrices(knots: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Dense ``G`` and ``dG/dt``, each of shape (n, r): see `local_basis`."""
    first, values, slopes = local_basis(knots, t)
    dense = np.zeros((2, len(t), len(knots) - DEGREE - 1))
    columns = first[:, None] + np.arange(DEGREE + 1)
    for matrix, entries in zip(dense, (values, slopes), strict=True):
        np.put_along_axis(matrix, columns, entries, axis=1)
    return dense[0], dense[1]
