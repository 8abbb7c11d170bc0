"""Standard units, in which a fit is made, and those of the data."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arrays import Floats, Ints


@dataclass(frozen=True)
class Units:
    """Standard units of a fit: every coordinate with mean 0 and variance 1, time in time scales.

    Parameters
    ----------
    centre, scale : ndarray, shape (d,)
        Mean and standard deviation of the data.
    time : float
        Length of a standard time unit.
    sizes : ndarray, shape (k,) or (k + d,)
        Root mean squares of the functions of the state in the library; of an implicit law also
        the units of the slopes.
    """

    centre: Floats
    scale: Floats
    time: float
    sizes: Floats = field(default_factory=lambda: np.empty(0))

    def standard(self, point: Floats) -> Floats:
        """A point of the data's frame in standard units."""
        return (point - self.centre) / self.scale

    def point(self, standard: Floats) -> Floats:
        """A standard point in the data's frame and units."""
        return standard * self.scale + self.centre

    def factors(self, exponents: Ints) -> Floats:
        """What turns standard coefficients into those of the data's units, shape (l, d)."""
        scales = np.append(self.scale, self.sizes)
        return self.scale / np.prod(scales**exponents, axis=1)[:, None] / self.time
