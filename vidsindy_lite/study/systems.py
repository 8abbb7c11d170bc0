"""The seven chaotic systems of the paper's Table S1, as data, their frame, and five others."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from pathlib import Path

import numpy as np

# Function, Ints: in the signature that is inherited.
from ..arrays import Floats, Ints  # noqa: F401
from ..checks import check_integer, check_positive, check_vector, shown
from ..dynamics import Function, PolynomialSystem, monomial_exponents  # noqa: F401
from .metrics import coefficients_in
from .published import SYSTEMS_S1

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


PERIODS = {
    "Lorenz": 1.50, "SprottE": 7.63, "RayleighBenard": 0.920, "SprottF": 19.2, "NoseHoover": 5.87,
    "Tsucs2": 0.345, "WangSun": 6.0,
}  # fmt: skip
"""Characteristic periods, as in ``dysts``."""


def _benchmark(name: str, law: PolynomialSystem, x0: Sequence[float], period: float) -> Benchmark:
    """A system in the library of degree 3."""
    library = monomial_exponents(3, degree=3)
    coefficients = coefficients_in(law, library)
    return Benchmark(law.names, library, coefficients, name, tuple(x0), period)


class _Benchmarks(dict[str, Benchmark]):
    """Systems by name, which say which there are if one is asked for that is none of them."""

    def __missing__(self, name: object) -> Benchmark:
        known = sorted(self, key=lambda one: SequenceMatcher(None, str(name), one).ratio())
        raise KeyError(f"system: must be one of {', '.join(known[::-1])}, got {shown(name)}")


SYSTEMS: dict[str, Benchmark] = _Benchmarks(
    (name, _benchmark(name, SYSTEMS_S1[name].law, SYSTEMS_S1[name].x0, period))
    for name, period in PERIODS.items()
)
"""The systems of Table S1 in their native frame, by name."""

FLOWS: dict[str, Benchmark] = _Benchmarks(
    SYSTEMS
    | {
        name: _benchmark(name, PolynomialSystem.from_terms(flow["law"]), flow["x0"], flow["period"])
        for name, flow in tomllib.loads(
            Path(__file__).with_name("flows.toml").read_text("utf-8")
        ).items()
    }
)
"""The same and five other chaotic flows; ``flows.toml`` says where they come from."""
