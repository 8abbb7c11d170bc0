"""The origin in which a polynomial law is sparsest: the meaning of the paper's offset (Eq. 10).

B-splines sum to one, so an offset added to the curve is redundant. It matters when the library
is evaluated at ``x - offset``: then it is the origin of the law's own frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import minimize

from ..arrays import Bools, Floats, Ints
from .library import divides, shift_generators, shift_matrix
from .selection import inverse

DRAWS = 200
"""Random sets of coefficients that an origin is asked to make vanish."""


@dataclass(frozen=True, eq=False)
class ShiftedLaw:
    """Coefficients and information of an estimated law in shifted frames, exactly.

    Parameters
    ----------
    exponents : ndarray of int, shape (l, d + k)
        A library that holds all divisors of its monomials.
    coefficients : ndarray, shape (l, d)
        Estimate in the present frame.
    information : ndarray, shape (l d, l d)
        Its information matrix, equation by equation.
    movable : ndarray of bool, shape (d,), optional
        Along which axes its origin is sought; all by default.
    gradient : ndarray, shape (l d,), optional
        What still pulls at the coefficients (see `subset_search`); nothing by default.
    """

    exponents: Ints
    coefficients: Floats
    information: Floats
    movable: Bools | None = None
    gradient: Floats | None = None

    @property
    def d(self) -> int:
        """Dimension of the state."""
        return self.coefficients.shape[1]

    @cached_property
    def _covariances(self) -> Floats:
        """Covariance of the coefficients of each equation, (d, l, l)."""
        l, d = self.coefficients.shape
        blocks = inverse(self.information).reshape(d, l, d, l)
        return np.stack([blocks[j, :, j, :] for j in range(d)])

    @cached_property
    def axes(self) -> Ints:
        """The movable axes."""
        return np.arange(self.d) if self.movable is None else np.flatnonzero(self.movable)

    @cached_property
    def _generators(self) -> Floats:
        return shift_generators(self.exponents)

    @cached_property
    def _with_rates(self) -> Floats:
        """The coefficients and their rates along the movable axes, which shifts carry alike."""
        return np.stack([self.coefficients, *(self._generators[self.axes] @ self.coefficients)])

    def at(self, origin: Floats) -> tuple[Floats, Floats, Floats]:
        """Coefficients (l, d), information and gradient in monomials of ``x - origin``."""
        forth = shift_matrix(self.exponents, -origin)
        back = np.kron(np.eye(self.d), shift_matrix(self.exponents, origin))
        pull = np.zeros(len(back)) if self.gradient is None else back.T @ self.gradient
        return forth @ self.coefficients, back.T @ self.information @ back, pull

    def vanish(self, origins: Floats, entries: Ints) -> Floats:
        """Move each origin as little as possible so that the given coefficients vanish.

        Parameters
        ----------
        origins : ndarray, shape (n, d)
            Where to start.
        entries : ndarray of int, shape (n, k, 2)
            Equation and term of each coefficient.

        Returns
        -------
        ndarray, shape (n, d)
            NaN where no origin was found.
        """
        equations, terms = np.moveaxis(entries, -1, 0)
        here, origins = self._with_rates[:, :, equations], origins.copy()
        moving = np.arange(len(origins))
        for _ in range(6):
            shift = shift_matrix(self.exponents, -origins[moving], terms[moving])
            values = np.einsum("nkl,alnk->nka", shift, here[:, :, moving])
            back = np.linalg.pinv(values[:, :, 1:], rcond=1e-6)
            step = -(back @ values[:, :, :1])[:, :, 0]
            origins[np.ix_(moving, self.axes)] += step
            lost = ~(np.abs(origins[moving]) < 1e6).all(axis=1)
            origins[moving[lost]] = np.nan
            moving = moving[~lost & (np.abs(step) >= 1e-9).any(axis=1)]
        return origins

    def smooth_count(self, origin: Floats, active: Bools, penalty: float) -> tuple[float, Floats]:
        """Smoothed number of significant terms at an origin, and its gradient.

        Each active term with score ``z`` (estimate over standard error) counts
        ``z^2 / (z^2 + penalty)``.
        """
        forth, mask = shift_matrix(self.exponents, -origin), active.T
        estimate = (forth @ self.coefficients).T
        covariance = forth @ self._covariances @ forth.T
        variance = np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 1e-300)
        score = estimate**2 / variance
        value = (score / (score + penalty))[mask].sum()
        weight = penalty / (score + penalty) ** 2
        gradient = np.zeros(self.d)
        for i in self.axes:
            generator = self._generators[i]
            estimate_rate = estimate @ generator.T
            variance_rate = 2 * np.einsum("ka,jak->jk", generator, covariance)
            rate = 2 * estimate * estimate_rate / variance - score * variance_rate / variance
            gradient[i] = (weight * rate)[mask].sum()
        return float(value), gradient


def sparse_origins(
    law: ShiftedLaw,
    active: Bools,
    home: Floats,
    box: tuple[Floats, Floats],
    penalty: float,
    keep: int,
    rng: np.random.Generator,
) -> list[Floats]:
    """Distinct origins with the smallest smoothed number of significant terms.

    On clean data the count is flat but for needle-thin wells, which lie where coefficients
    vanish together. So the starts are origins at which a few coefficients drawn at random do
    (Newton steps of least norm, from home or a random point); a descent of the count follows.

    Parameters
    ----------
    law : ShiftedLaw
        The estimated law.
    active : ndarray of bool, shape (l, d)
        Terms that count.
    home : ndarray, shape (d,)
        The origin of the data's frame, where an offset costs nothing.
    box : pair of ndarray, shape (d,)
        Lower and upper bounds of the search.
    penalty : float
        Square of the score at which a term counts one half.
    keep : int
        How many to return at most.
    rng : numpy.random.Generator
        For the draws.

    Returns
    -------
    list of ndarray, shape (d,), best first
    """
    low, high = box
    starts = _starts(law, active, home, box, rng)
    counts = [law.smooth_count(start, active, penalty)[0] for start in starts]
    found: list[tuple[float, Floats]] = []
    for index in np.argsort(counts)[: 4 * keep]:
        if any(np.abs(starts[index] - origin).max() < 1e-3 for _, origin in found):
            continue
        result = minimize(
            law.smooth_count, starts[index], args=(active, penalty), jac=True,
            method="L-BFGS-B", bounds=list(zip(low, high, strict=True)), options={"maxiter": 40},
        )  # fmt: skip
        found.append((float(result.fun), result.x))
    found.sort(key=lambda item: item[0])
    distinct: list[Floats] = []
    for _, origin in found:
        if all(np.abs(origin - other).max() > 0.02 for other in distinct):
            distinct.append(origin)
    return distinct[:keep]


def _starts(
    law: ShiftedLaw,
    active: Bools,
    home: Floats,
    box: tuple[Floats, Floats],
    rng: np.random.Generator,
) -> list[Floats]:
    """Origins in the box near which a few coefficients drawn at random vanish."""
    low, high = box
    # Only what divides another term of its equation can vanish by a shift.
    below = divides(law.exponents, law.movable) & ~np.eye(len(law.exponents), dtype=bool)
    droppable = np.argwhere((active & (below @ active)).T)
    origins, entries = [], []
    for draw in range(DRAWS if len(droppable) else 0):
        origins.append(home if draw % 2 else rng.uniform(low, high))
        size = min(1 + draw % len(law.axes), len(droppable))
        entries.append(droppable[rng.permutation(len(droppable))[:size]])
    for first in range(len(law.axes) if origins else 0):  # those of as many coefficients at once
        alike = slice(first, None, len(law.axes))
        origins[alike] = law.vanish(np.array(origins[alike]), np.array(entries[alike]))
    return [np.clip(origin, low, high) for origin in origins if np.isfinite(origin).all()]
