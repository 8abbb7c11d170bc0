"""What the paper prints, as data: tables, equations, few numbers, and its systems as benchmarks.

The numbers stand in ``published.toml``, copied from the text of the paper and not corrected; where
a print cannot be read as it stands, `MISPRINTS` says how it was read. Fractions have the units of
`metrics.Score`: an l2 error printed as 1.50 (x 10^-2) is 0.0150, a precision of 92.31 % is 0.9231.

Scores are looked up as ``SCORES[table, method, system]``, those of the ablation as
``ABLATION[condition, percent, method]``, and equations as ``LAWS[method, system]``. The paper's own
method goes by its printed name, "Ours"; its ground truths by "Ground truth".

`SYSTEMS` are those of its Table S1, ready to be simulated; `FLOWS` are these and five others.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

# Function, Ints: in the signature that is inherited.
from ..arrays import Floats, Ints  # noqa: F401
from ..checks import check_integer, check_positive, check_vector, shown
from ..dynamics import Function, PolynomialSystem, monomial_exponents  # noqa: F401
from .metrics import coefficients_in


@dataclass(frozen=True)
class PublishedScore:
    """One row of Table 1, 2 or S3.

    Parameters
    ----------
    terms_found : bool
        Column "Terms Found?".
    false_positives : int
        Column "False Positives".
    l2 : float
        Relative error of all coefficients, printed in units of 10^-2 with two decimals.
    precision, recall : float
        Printed in percent with up to two decimals.
    """

    terms_found: bool
    false_positives: int
    l2: float
    precision: float
    recall: float


@dataclass(frozen=True)
class PublishedSystem:
    """One row of Table S1.

    Parameters
    ----------
    x0 : tuple of float, length 3
        Initial condition.
    law : PolynomialSystem
        The printed equations with the printed parameters, in the native frame.
    """

    x0: tuple[float, float, float]
    law: PolynomialSystem


@dataclass(frozen=True)
class PublishedPosition:
    """The one position that the lab experiment reports, in mm.

    Parameters
    ----------
    found, truth : tuple of float, length 3
        Reconstructed and true position of the ball's centre.
    """

    found: tuple[float, float, float]
    truth: tuple[float, float, float]

    @property
    def error(self) -> float:
        """Distance between the two, in mm; the paper does not state it."""
        return float(np.linalg.norm(np.subtract(self.found, self.truth)))


def read_toml(name: str) -> dict[str, Any]:
    """A file of data beside this module."""
    return tomllib.loads(Path(__file__).with_name(name).read_text("utf-8"))


def _law(equations: Mapping[str, Mapping[str, float | str]]) -> PolynomialSystem:
    """A law as it is printed; text is a fraction: "8/3"."""
    return PolynomialSystem.from_terms({
        variable: {term: float(Fraction(value)) for term, value in row.items()}
        for variable, row in equations.items()
    })  # fmt: skip


def _score(row: Sequence) -> PublishedScore:
    found, false_positives, *values = row
    # Rounding only undoes the division's last bit: 72.73 / 100 is 0.7273.
    l2, precision, recall = (round(value / 100, 4) for value in values)
    return PublishedScore(found == "Yes", false_positives, l2, precision, recall)


_PRINTED = read_toml("published.toml")

#: How many datasets the section "Experiments" claims; its footnote lists those of `SYSTEMS_S1`.
DATASETS_CLAIMED: int = _PRINTED["datasets_claimed"]

#: Lab experiment; the origin is a corner of the table.
LAB = PublishedPosition(**{name: tuple(point) for name, point in _PRINTED["lab"].items()})

#: Table S1 by system, in the printed order.
SYSTEMS_S1: dict[str, PublishedSystem] = {
    name: PublishedSystem(tuple(system["x0"]), _law(system["law"]))
    for name, system in _PRINTED["table_S1"].items()
}

#: Tables 1 and S3 by (table, method, system); both hold the rows of "Ours".
SCORES: dict[tuple[str, str, str], PublishedScore] = {
    (table, method, system): _score(row)
    for table, key in (("Table 1", "table_1"), ("Table S3", "table_S3"))
    for system, rows in _PRINTED[key].items()
    for method, row in rows.items()
}

#: Table 2, SprottF, by (condition, rate in percent, method).
ABLATION: dict[tuple[str, int, str], PublishedScore] = {
    (condition, int(rate), method): _score(row)
    for condition, rates in _PRINTED["table_2"].items()
    for rate, rows in rates.items()
    for method, row in rows.items()
}

#: Table S2 by (method, system), in the paper's reference frame.
LAWS: dict[tuple[str, str], PolynomialSystem] = {
    (method, system): _law(equations)
    for method, laws in _PRINTED["table_S2"].items()
    for system, equations in laws.items()
}

#: Prints of Table S2 that cannot stand as they are, and how they were read into `LAWS`: method,
#: system, equation (the name of the variable on the left), printed, read_as.
MISPRINTS: tuple[dict[str, str], ...] = tuple(_PRINTED["misprints"])

#: What others publish of ``lorenz_grid`` and ``odebench``, with its source and what was given.
RIVALS: dict[str, dict[str, Any]] = read_toml("rivals.toml")

# -------------------------------------------------------------- its systems, and others like them

#: Shift from a system's native frame to the paper's reference frame, in scene units. The paper
#: never states it; it is what turns its Table S1 into the ground truths of its Table S2.
REFERENCE_OFFSET = (10.0, 10.0, 0.0)


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


#: Characteristic periods, as in ``dysts``.
PERIODS = {
    "Lorenz": 1.50, "SprottE": 7.63, "RayleighBenard": 0.920, "SprottF": 19.2, "NoseHoover": 5.87,
    "Tsucs2": 0.345, "WangSun": 6.0,
}  # fmt: skip


def _benchmark(name: str, law: PolynomialSystem, x0: Sequence[float], period: float) -> Benchmark:
    """A system in the library of degree 3."""
    library = monomial_exponents(3, degree=3)
    return Benchmark(law.names, library, coefficients_in(law, library), name, tuple(x0), period)


class _Benchmarks(dict[str, Benchmark]):
    """Systems by name, which say which there are if one is asked for that is none of them."""

    def __missing__(self, name: object) -> Benchmark:
        known = sorted(self, key=lambda one: SequenceMatcher(None, str(name), one).ratio())
        raise KeyError(f"system: must be one of {', '.join(known[::-1])}, got {shown(name)}")


#: The systems of Table S1 in their native frame, by name.
SYSTEMS: dict[str, Benchmark] = _Benchmarks(
    (name, _benchmark(name, SYSTEMS_S1[name].law, SYSTEMS_S1[name].x0, period))
    for name, period in PERIODS.items()
)

#: The same and five other chaotic flows; ``flows.toml`` says where they come from.
FLOWS: dict[str, Benchmark] = _Benchmarks(
    SYSTEMS
    | {
        name: _benchmark(name, PolynomialSystem.from_terms(flow["law"]), flow["x0"], flow["period"])
        for name, flow in read_toml("flows.toml").items()
    }
)
