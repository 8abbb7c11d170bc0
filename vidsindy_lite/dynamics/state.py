"""The unknowns of a fit: a curve, and a law with its origin."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats, Ints


@dataclass(frozen=True)
class State:
    """A curve and a law.

    Parameters
    ----------
    control_points : ndarray, shape (r, d)
        ``P``; the curve is ``G P``.
    coefficients : ndarray, shape (l, d)
        ``Lambda``, in monomials of ``x - offset``.
    active : ndarray of bool, shape (l, d)
        Terms that may differ from zero.
    offset : ndarray, shape (d,)
        ``Delta``, the origin of the law.
    moving : ndarray of bool, shape (d,)
        Coordinates of the offset that are free.
    shared : ndarray of int, shape (l d,), optional
        Of each coefficient, equation by equation, whose value it has; its own by default.
    """

    control_points: Floats
    coefficients: Floats
    active: Bools
    offset: Floats
    moving: Bools
    shared: Ints | None = None

    def flat(self) -> Floats:
        """Coefficients, equation by equation, then the offset."""
        return np.concatenate([self.coefficients.T.ravel(), self.offset])

    def free(self) -> Bools:
        """Which entries of `flat` are unknowns: of those that share a value, the first."""
        free = np.concatenate([self.active.T.ravel(), self.moving])
        free[[entry for entry, _ in self.followers()]] = False
        return free

    def followers(self) -> list[tuple[int, int]]:
        """Entries of `flat` that have the value of another, and which."""
        if self.shared is None:
            return []
        entries = np.flatnonzero(self.shared != np.arange(len(self.shared)))
        return [(int(entry), int(self.shared[entry])) for entry in entries]

    def whole(self, active: Bools) -> Bools:
        """Terms, (l, d), with all that share a value with one of them."""
        if self.shared is None:
            return active
        count = np.bincount(self.shared, active.T.ravel(), len(self.shared))
        return np.asarray(count[self.shared] > 0).reshape(active.T.shape).T

    def moved(self, control_points: Floats, flat: Floats) -> State:
        """The same terms with another curve and other entries of `flat`."""
        l, d = self.coefficients.shape
        values, offset = flat[: l * d], flat[l * d :]
        coefficients = (values if self.shared is None else values[self.shared]).reshape(d, l).T
        return replace(
            self, control_points=control_points, coefficients=coefficients, offset=offset
        )

    def of_terms(self, active: Bools) -> State:
        """The same with these terms, those that share a value with them, and no others."""
        active = self.whole(active)
        return replace(self, active=active, coefficients=np.where(active, self.coefficients, 0.0))
