"""ODEBench: 63 equations of one to four variables from textbooks, as data.

The equations stand in ``odebench.toml``, typed from their formulas. A polynomial one is a
`PolynomialSystem`, the type of what is found, with coefficients that are formulas of its
parameters; of the others only the right-hand side is known, and no law of a polynomial library can
be right.

References
----------
S. d'Ascoli, S. Becker, A. Mathis, P. Schwaller, N. Kilbertus, ODEFormer: symbolic regression of
dynamical systems with transformers, ICLR 2024.
S. H. Strogatz, Nonlinear Dynamics and Chaos, CRC Press 2018.
"""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np

from ..arrays import Floats
from ..dynamics import PolynomialSystem

TIMES = np.linspace(0, 10, 512)
"""Of the samples of every equation."""

_NAMES = {name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "log", "abs")}


@dataclass(frozen=True, eq=False)
class Equation:
    """One equation of ODEBench.

    Parameters
    ----------
    number : int
        From 1 to 63.
    name, source : str
    rate : callable
        Time derivative (d,) of a state (d,).
    law : PolynomialSystem or None
        The same as data, if it is a polynomial.
    starts : tuple of tuple of float
        The two initial states.
    """

    number: int
    name: str
    source: str
    rate: Callable[[Floats], Floats]
    law: PolynomialSystem | None
    starts: tuple[tuple[float, ...], ...]

    @property
    def is_cubic(self) -> bool:
        """Is it a polynomial of degree 3 at most?"""
        return self.law is not None and bool(self.law.exponents.sum(axis=1).max() <= 3)


def _value(formula: str, values: Mapping[str, Any]) -> Any:
    """Value of a formula of this package's file, for which its names have these values."""
    return eval(_compiled(formula), {"__builtins__": {}, **_NAMES}, dict(values))


@cache
def _compiled(formula: str) -> CodeType:
    return compile(formula, "odebench.toml", "eval")


def _equation(number: str, record: Mapping[str, Any]) -> Equation:
    """An equation from its record; a parameter may be a fraction: "8/3"."""
    parameters = {name: _value(str(v), {}) for name, v in record["parameters"].items()}
    law, rates = None, record.get("rates", {})
    if "terms" in record:
        law = PolynomialSystem.from_terms({
            variable: {term: _value(text, parameters) for term, text in terms.items()}
            for variable, terms in record["terms"].items()
        })  # fmt: skip

    def rate(x: Floats) -> Floats:
        values = parameters | dict(zip(rates, x, strict=True))
        return np.array([_value(text, values) for text in rates.values()])

    starts = tuple(tuple(map(float, start)) for start in record["starts"])
    return Equation(int(number), record["name"], record["source"], law or rate, law, starts)


ODEBENCH: dict[int, Equation] = {
    int(number): _equation(number, record)
    for number, record in tomllib.loads(
        Path(__file__).with_suffix(".toml").read_text("utf-8")
    ).items()
}
"""The equations by number."""
