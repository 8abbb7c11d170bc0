"""Clamped cubic B-splines in local form: every point touches four control points (paper: Eq. 3)."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from ..arrays import Floats, Ints

DEGREE = 3


def clamped_knots(breakpoints: Floats) -> Floats:
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
        raise ValueError(f"breakpoints: must be at least two increasing numbers, got {breakpoints}")
    return np.concatenate([breakpoints[:1].repeat(3), breakpoints, breakpoints[-1:].repeat(3)])


def local_basis(knots: Floats, t: Floats, order: int = 0) -> tuple[Ints, Floats]:
    """The four basis functions that are not zero at each time, or their derivatives.

    Parameters
    ----------
    knots : ndarray, shape (m + 7,)
        From `clamped_knots`.
    t : ndarray, shape (n,)
        Times within the knots.
    order : int
        Order of the derivative, 0 to 2.

    Returns
    -------
    first : ndarray of int, shape (n,)
        Index of the first control point that matters at each time.
    values : ndarray, shape (n, 4)
        Derivative of that order of the basis functions of control points first .. first + 3.
    """
    low = DEGREE - order
    design = BSpline.design_matrix(t, knots[order : len(knots) - order], low)
    values = design.data.reshape(-1, low + 1)
    first = design.indices.reshape(-1, low + 1)[:, 0].astype(int)
    # The derivative of a basis function is a difference of two of one degree less, each over
    # its width (de Boor).
    for degree in range(low + 1, DEGREE + 1):
        lower = first[:, None] + np.arange(DEGREE + 1 - degree, DEGREE + 1)
        rates = degree * values / (knots[lower + degree] - knots[lower])
        values = np.zeros((len(t), degree + 1))
        values[:, 1:] += rates
        values[:, :-1] -= rates
    return first, values


def design_matrix(knots: Floats, t: Floats, order: int = 0) -> Floats:
    """Dense matrix of shape (n, r): ``G`` for order 0, ``dG/dt`` for order 1; see `local_basis`."""
    first, values = local_basis(knots, t, order)
    dense = np.zeros((len(t), len(knots) - DEGREE - 1))
    np.put_along_axis(dense, first[:, None] + np.arange(DEGREE + 1), values, axis=1)
    return dense
