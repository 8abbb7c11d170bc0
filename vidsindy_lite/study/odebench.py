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

import ast
import operator
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Floats
from ..dynamics import PolynomialSystem

TIMES = np.linspace(0, 10, 512)
"""Of the samples of every equation."""

_OPERATORS: dict[type, Callable] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv, ast.Pow: operator.pow, ast.USub: operator.neg,
}  # fmt: skip
_FUNCTIONS = {
    name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "log", "abs")
}  # fmt: skip


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


def formula(text: str, values: Mapping[str, Any]) -> Any:
    """Value of a formula such as ``"r*x*(1 - x/K)"``, where its names have these values.

    Parameters
    ----------
    text : str
        Numbers, names, ``+ - * / **``, brackets, and the functions sin, cos, tan, exp, log, abs.
    values : mapping
        Numbers or arrays by name.

    Raises
    ------
    ValueError
        If anything else stands in it.
    """

    def value(node: ast.AST) -> Any:
        match node:
            case ast.Constant(value=int() | float() as number):
                return number
            case ast.Name(id=name) if name in values:
                return values[name]
            case ast.UnaryOp(op=op, operand=inner) if type(op) in _OPERATORS:
                return _OPERATORS[type(op)](value(inner))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                return _OPERATORS[type(op)](value(left), value(right))
            case ast.Call(func=ast.Name(id=name), args=[inner]) if name in _FUNCTIONS:
                return _FUNCTIONS[name](value(inner))
        raise ValueError(f"text: must be a formula of {', '.join(values)}, got {text!r}")

    return value(_parsed(text))


@cache
def _parsed(text: str) -> ast.AST:
    return ast.parse(text, mode="eval").body


def _equation(number: str, record: Mapping[str, Any]) -> Equation:
    """An equation from its record; a parameter may be a fraction: "8/3"."""
    parameters = {name: formula(str(v), {}) for name, v in record["parameters"].items()}
    law, rates = None, record.get("rates", {})
    if "terms" in record:
        law = PolynomialSystem.from_terms({
            variable: {term: formula(text, parameters) for term, text in terms.items()}
            for variable, terms in record["terms"].items()
        })  # fmt: skip

    def rate(x: Floats) -> Floats:
        values = parameters | dict(zip(rates, x, strict=True))
        return np.array([formula(text, values) for text in rates.values()])

    starts = tuple(tuple(map(float, start)) for start in record["starts"])
    return Equation(int(number), record["name"], record["source"], law or rate, law, starts)


ODEBENCH: dict[int, Equation] = {
    int(number): _equation(number, record)
    for number, record in tomllib.loads(
        Path(__file__).with_suffix(".toml").read_text("utf-8")
    ).items()
}
"""The equations by number."""
