"""The library: monomials of the state, and what a shift of the origin does to them (paper: Eq. 10).

A library that holds all divisors of its monomials is closed under a shift of the origin. Its
monomials may have functions of the state as further variables, after the coordinates, and after
these the slopes; such variables stay as they are when the origin is shifted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations_with_replacement

import numpy as np
from scipy.special import comb as binomial

from ..arrays import Bools, Floats, Ints
from ..checks import check_integer


def variable_names(d: int) -> tuple[str, ...]:
    """Default names of ``d`` state variables: x, y, z, w up to four, else x1, x2, ..."""
    return tuple("xyzw"[:d]) if d <= 4 else tuple(f"x{i + 1}" for i in range(d))


def velocity_names(names: Sequence[str]) -> tuple[str, ...]:
    """Names of the velocities of variables: vx, vy, ..."""
    return tuple(f"v{name}" for name in names)


CLOCK = "t"
"""The time as a variable of a law: after all others, with dt/dt = 1."""


def name_latex(name: str) -> str:
    """A variable as LaTeX: digits at its end become an index."""
    letters = name.rstrip("0123456789")
    return name if letters == name else f"{letters}_{{{name[len(letters) :]}}}"


@dataclass(frozen=True, eq=False)
class Function:
    """A function of the state, as a further variable of monomials.

    Parameters
    ----------
    name, latex : str
        How it is printed.
    value : callable
        From points (n, d) to values (n,).
    gradient : callable
        From points (n, d) to derivatives (n, d).
    direction : int, optional
        Of a component of a vector, which one it is: the first has the others after it, each stands
        in the equation of its direction alone, and all have one coefficient.
    of_time : bool
        Whether it depends on the time alone.
    """

    name: str
    latex: str
    value: Callable[[Floats], Floats]
    gradient: Callable[[Floats], Floats]
    direction: int | None = None
    of_time: bool = False

    @classmethod
    def unknown(cls, name: str) -> Function:
        """A function of which nothing but the name is known: NaN everywhere."""
        return cls(name, name, lambda x: np.full(len(x), np.nan), np.zeros_like)

    def standardised(self, centre: Floats, scale: Floats, size: float) -> Function:
        """The same function over ``size``, of points less ``centre``, over ``scale``."""
        return replace(
            self,
            value=lambda x: self.value(centre + scale * x) / size,
            gradient=lambda x: self.gradient(centre + scale * x) * scale / size,
        )


def extended(x: Floats, functions: Sequence[Function]) -> Floats:
    """Points (n, d), and the values of k functions at them, side by side: (n, d + k)."""
    return np.column_stack([x, *(f.value(x) for f in functions)]) if functions else x


def law_variables(
    x: Floats, functions: Sequence[Function], exponents: Ints, law: Floats
) -> tuple[Floats, Floats]:
    """All that the monomials of a law, (l, d), are made of at points (n, d), and its denominators.

    Where exponents leave room for slopes, terms with a slope, ``b psi(x) x'``, are those that a
    denominator ``1 - b psi`` brings over: the slopes are what the law makes them.

    Returns
    -------
    variables : ndarray, shape (n, d + k) or (n, 2 d + k)
    denominators : ndarray, shape (n, d), or (1, d) if all are 1
    """
    d, z = x.shape[1], extended(x, functions)
    if exponents.shape[1] == z.shape[1]:
        return z, np.ones((1, d))
    z = np.column_stack([z, np.ones_like(x)])
    implicit, terms = exponents[:, -d:].any(axis=1), monomials(z, exponents)
    below = 1 - terms[:, implicit] @ law[implicit]
    with np.errstate(divide="ignore", invalid="ignore"):  # at a pole
        z[:, -d:] = (terms[:, ~implicit] @ law[~implicit]) / below
    return z, below


def along_state(rates: Floats, x: Floats, functions: Sequence[Function]) -> Floats:
    """Derivatives in coordinates and functions, (n, m, >= d + k), as those in coordinates alone.

    The chain rule: (n, m, d).
    """
    d = x.shape[1]
    total = rates[:, :, :d]
    for k, function in enumerate(functions):
        rate = rates[:, :, d + k, None]
        if rate.any():  # those that are in no term may be infinite
            total = total + rate * function.gradient(x)[:, None, :]
    return total


def monomial_exponents(d: int, degree: int) -> Ints:
    """Exponents of all monomials of ``d`` variables up to ``degree``, in graded order.

    Parameters
    ----------
    d : int
        Number of variables, at least 1.
    degree : int
        Highest total degree, at least 0.

    Returns
    -------
    ndarray of int, shape (l, d)
        For d = 2, degree = 2: 1, x, y, x^2, xy, y^2.
    """
    d, degree = check_integer("d", d, 1), check_integer("degree", degree)
    rows = [
        [picked.count(i) for i in range(d)]
        for total in range(degree + 1)
        for picked in combinations_with_replacement(range(d), total)
    ]
    return np.array(rows, dtype=int).reshape(-1, d)


def monomials(x: Floats, exponents: Ints) -> Floats:
    """Evaluate monomials.

    Parameters
    ----------
    x : ndarray, shape (n, d)
        Points.
    exponents : ndarray of int, shape (l, d)
        One row a monomial.

    Returns
    -------
    ndarray, shape (n, l)
        ``phi(x)``, one row a point.
    """
    # By products, one monomial a row: ten times faster than powers, one point a row.
    powers = np.ones((exponents.max(initial=0) + 1, *x.T.shape))
    for k in range(1, len(powers)):
        np.multiply(powers[k - 1], x.T, out=powers[k])
    values = powers[exponents[:, 0], 0]
    for i in range(1, exponents.shape[1]):
        values *= powers[exponents[:, i], i]
    return values.T


def monomial_gradients(x: Floats, exponents: Ints) -> Floats:
    """Derivatives of monomials, shape (n, l, d); see `monomials`."""
    gradients = []
    for i in range(x.shape[1]):
        lowered = exponents.copy()
        lowered[:, i] = np.maximum(lowered[:, i] - 1, 0)
        gradients.append(exponents[:, i] * monomials(x, lowered))
    return np.stack(gradients, axis=-1)


def shift_matrix(exponents: Ints, offset: Floats, rows: Ints | slice = slice(None)) -> Floats:
    """Matrix ``S`` with ``phi(x - offset) = phi(x) S``, shape (l, l), or some rows of it.

    The library has to be closed: with every monomial it holds all its divisors. An offset (d,)
    leaves the functions as they are. Of several offsets, (n, d), one matrix each, of rows (n, k).
    """
    still = np.zeros((*offset.shape[:-1], exponents.shape[1] - offset.shape[-1]))
    moved = -np.concatenate([offset, still], axis=-1)[..., None, None, :]
    factors, lowered = _binomials(exponents.tobytes(), *exponents.shape)
    return (factors[rows] * moved ** lowered[rows]).prod(axis=-1)


@lru_cache(maxsize=64)
def _binomials(exponents: bytes, l: int, d: int) -> tuple[Floats, Ints]:
    powers = np.frombuffer(exponents, dtype=int).reshape(l, d)
    lowered = powers[None, :, :] - powers[:, None, :]
    factors = np.where(lowered >= 0, binomial(powers[None, :, :], powers[:, None, :]), 0.0)
    return factors, np.maximum(lowered, 0)


def closure(exponents: Ints) -> Ints:
    """Exponents of all divisors of the given monomials, in graded order, shape (l, d)."""
    divisors = {divisor for powers in exponents for divisor in np.ndindex(*(powers + 1))}
    ordered = sorted(divisors, key=lambda e: (sum(e), tuple(-p for p in e)))
    return np.array(ordered, dtype=int).reshape(-1, exponents.shape[1])


def divides(exponents: Ints, axes: Bools | None = None) -> Bools:
    """Which monomial (row) divides which (column), itself included; shape (l, l).

    If axes are given, bool (d,), along these only: along the others both have the same power.
    """
    if axes is not None:
        axes = np.append(axes, np.zeros(exponents.shape[1] - len(axes), dtype=bool))
    row, column = exponents[:, None, :], exponents[None, :, :]
    lower = row < column if axes is None else axes & (row < column)
    return np.all((row == column) | lower, axis=-1)


def closure_mask(exponents: Ints, support: Bools, axes: Bools | None = None) -> Bools:
    """Widen a support (l, d) to all divisors of its terms: what a shift of it may contain.

    If axes are given, bool (d,), of a shift along these.
    """
    return divides(exponents, axes) @ support


def shift_generators(exponents: Ints) -> Floats:
    """Matrices ``N_i`` with ``d phi / d x_i = phi N_i``, shape (d, l, l).

    ``-N_i`` is the rate of change of `shift_matrix` with the offset along axis i.
    """
    d = exponents.shape[1]
    lowered = exponents[None, :, :] - exponents[:, None, :]
    return np.stack(
        [
            np.where((lowered == axis).all(axis=-1), exponents[None, :, i], 0.0)
            for i, axis in enumerate(np.eye(d, dtype=int))
        ]
    )
