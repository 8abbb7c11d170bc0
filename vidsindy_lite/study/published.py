"""What the paper prints, as data: its tables, its equations, its few numbers in running text.

The numbers stand in ``published.toml``, copied from the text of the paper and not corrected; where
a print cannot be read as it stands, `MISPRINTS` says how it was read. Fractions have the units of
`metrics.Score`: an l2 error printed as 1.50 (x 10^-2) is 0.0150, a precision of 92.31 % is 0.9231.

Scores are looked up as ``SCORES[table, method, system]``, those of the ablation as
``ABLATION[condition, percent, method]``, and equations as ``LAWS[method, system]``. The paper's own
method goes by its printed name, "Ours"; its ground truths by "Ground truth".
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from ..dynamics import PolynomialSystem


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


_PRINTED = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))

DATASETS_CLAIMED: int = _PRINTED["datasets_claimed"]
"""How many datasets the section "Experiments" claims; its footnote lists those of `SYSTEMS_S1`."""

LAB = PublishedPosition(**{name: tuple(point) for name, point in _PRINTED["lab"].items()})
"""Lab experiment; the origin is a corner of the table."""

SYSTEMS_S1: dict[str, PublishedSystem] = {
    name: PublishedSystem(tuple(system["x0"]), _law(system["law"]))
    for name, system in _PRINTED["table_S1"].items()
}
"""Table S1 by system, in the printed order."""

SCORES: dict[tuple[str, str, str], PublishedScore] = {
    (table, method, system): _score(row)
    for table, key in (("Table 1", "table_1"), ("Table S3", "table_S3"))
    for system, rows in _PRINTED[key].items()
    for method, row in rows.items()
}
"""Tables 1 and S3 by (table, method, system); both hold the rows of "Ours"."""

ABLATION: dict[tuple[str, int, str], PublishedScore] = {
    (condition, int(rate), method): _score(row)
    for condition, rates in _PRINTED["table_2"].items()
    for rate, rows in rates.items()
    for method, row in rows.items()
}
"""Table 2, SprottF, by (condition, rate in percent, method)."""

LAWS: dict[tuple[str, str], PolynomialSystem] = {
    (method, system): _law(equations)
    for method, laws in _PRINTED["table_S2"].items()
    for system, equations in laws.items()
}
"""Table S2 by (method, system), in the paper's reference frame."""

MISPRINTS: tuple[dict[str, str], ...] = tuple(_PRINTED["misprints"])
"""Prints of Table S2 that cannot stand as they are, and how they were read into `LAWS`: method,
system, equation (the name of the variable on the left), printed, read_as."""

RIVALS: dict[str, dict[str, Any]] = tomllib.loads(
    Path(__file__).with_name("rivals.toml").read_text("utf-8")
)
"""What others publish of ``lorenz_grid`` and ``odebench``, with its source and what was given."""
