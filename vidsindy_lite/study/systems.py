"""The seven chaotic systems of the paper's Table S1, as data, and the frame they are seen in."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Ints  # noqa: F401 (Ints: in the signature that is inherited)
from ..checks import check_integer, check_positive, check_vector
from ..dynamics import PolynomialSystem

Terms = dict[str, float]  # coefficients of an equation by the name of the term

REFERENCE_OFFSET = (10.0, 10.0, 0.0)
"""Shift from a system's native frame to the paper's reference frame, in scene units.

The paper never states it; it is what turns its Table S1 into the ground truths of its Table S2.
"""


@dataclass(frozen=True, eq=False)
class Benchmark(PolynomialSystem):
    """A system with an initial condition and a characteristic time: a ready experiment.

    Parameters
    ----------
    names, exponents, coefficients
        See `PolynomialSystem`.
    name : str
        Name of the system.
    x0 : tuple of float, length d
        Initial condition, in the frame of the system.
    period : float
        Characteristic period, in time units (convention of the ``dysts`` collection).
    """

    name: str
    x0: tuple[float, ...]
    period: float

    def __post_init__(self) -> None:
        super().__post_init__()
        check_vector("x0", self.x0, self.d)
        check_positive("period", self.period)

    def shift(self, offset: Sequence[float] | Floats) -> "Benchmark":
        """The same experiment seen from a shifted origin; see `PolynomialSystem.shift`."""
        law = super().shift(offset)
        x0 = tuple(float(v) for v in np.add(self.x0, offset))
        return Benchmark(law.names, law.exponents, law.coefficients, self.name, x0, self.period)

    def times(self, n: int = 1500, samples_per_period: float = 100) -> Floats:
        """Times of ``n`` video frames, shape (n,), starting at 0."""
        step = self.period / check_positive("samples_per_period", samples_per_period)
        return step * np.arange(check_integer("n", n, 1), dtype=float)

    def trajectory(self, n: int = 1500, samples_per_period: float = 100) -> tuple[Floats, Floats]:
        """Times (n,) and states (n, d) of the motion from ``x0``, one row a video frame."""
        t = self.times(n, samples_per_period)
        return t, self.simulate(t, np.array(self.x0))


def _benchmark(name: str, x0: tuple[float, ...], period: float, **equations: Terms) -> Benchmark:
    law = PolynomialSystem.from_terms(equations, degree=3)
    return Benchmark(law.names, law.exponents, law.coefficients, name=name, x0=x0, period=period)


SYSTEMS: dict[str, Benchmark] = {system.name: system for system in (
    _benchmark(
        "Lorenz", (-8, 7, 27), 1.50,
        x={"x": -10, "y": 10}, y={"x": 28, "xz": -1, "y": -1}, z={"xy": 1, "z": -8 / 3},
    ),
    _benchmark(
        "SprottE", (-1, 1, 1), 7.63,
        x={"yz": 1}, y={"x^2": 1, "y": -1}, z={"1": 1, "x": -4},
    ),
    _benchmark(
        "RayleighBenard", (-16, -13, 27), 0.920,
        x={"x": -30, "y": 30}, y={"y": 18, "xz": -1}, z={"xy": 1, "z": -5},
    ),
    _benchmark(
        "SprottF", (-1, -1.4, 1), 19.2,
        x={"y": 1, "z": 1}, y={"x": -1, "y": 0.5}, z={"x^2": 1, "z": -1},
    ),
    _benchmark(
        "NoseHoover", (-2, 0.5, 1), 5.87,
        x={"y": 1}, y={"x": -1, "yz": 1}, z={"1": 1.5, "y^2": -1},
    ),
    _benchmark(
        "Tsucs2", (1, 1, 5), 0.345,
        x={"x": -40, "y": 40, "xz": 0.5}, y={"x": 1, "y": 20, "xz": -1},
        z={"z": 0.8, "xy": 1, "x^2": -0.65},
    ),
    _benchmark(
        "WangSun", (1, 1, 0), 6.0,
        x={"x": 0.5, "yz": 1}, y={"x": -1, "y": -0.5, "xz": -1}, z={"z": -1, "xy": -1},
    ),
)}  # fmt: skip
"""The systems of Table S1 in their native frame, by name; periods as in ``dysts``."""
