"""Information matrices whose entries differ by many orders of magnitude.

Coefficients of a law differ in size by factors of thousands, and so do the rows of its
information matrix. Scaled to a unit diagonal it can be solved and inverted.
"""

from __future__ import annotations

import numpy as np

NOTHING = 1e-250
"""Least information; its inverse, even over the ridge, is still a number."""
RIDGE = 1e-12
"""Keeps a matrix with dependent columns solvable; what it cannot tell gets a huge variance."""


def equilibrated(information: np.ndarray, ridge: float = RIDGE) -> tuple[np.ndarray, np.ndarray]:
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


def inverse(information: np.ndarray) -> np.ndarray:
    """The covariance that belongs to an information matrix, shape (m, m)."""
    matrix, scale = equilibrated(information)
    return np.linalg.inv(matrix) * scale[:, None] * scale
