"""Candidate terms: monomials and their shifts, functions of the state, measured inputs, and the
libraries that a user asks for as values."""

from __future__ import annotations

import inspect
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations_with_replacement
from math import comb
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_interp_spline
from scipy.linalg import block_diag
from scipy.special import comb as binomial

from ..arrays import Bools, Floats, Ints
from ..checks import (
    check_array,
    check_choice,
    check_instance,
    check_integer,
    check_items,
    check_number,
    check_times,
    shown,
)

# --------------------------------------------------------------------------------------------------
# The library: monomials of the state, and what a shift of the origin does to them (paper: Eq. 10).
#
# A library that holds all divisors of its monomials is closed under a shift of the origin. Its
# monomials may have functions of the state as further variables, after the coordinates, and after
# these the slopes; such variables stay as they are when the origin is shifted.


def velocity_names(names: Sequence[str]) -> tuple[str, ...]:
    """Names of the velocities of variables: vx, vy, ..."""
    return tuple(f"v{name}" for name in names)


CLOCK = "t"  #: The time as a variable of a law: after all others, with dt/dt = 1.


def name_latex(name: str) -> str:
    """A variable as LaTeX: digits at its end become an index; a name of more letters is upright."""
    letters = re.sub("(?<=.)_*[0-9]+$", "", name)
    index = name[len(letters) :].strip("_")
    text = letters if len(letters) == 1 and letters != "_" else upright(letters)
    return f"{text}_{{{index}}}" if index else text


def upright(name: str) -> str:
    """A name as upright letters of LaTeX."""
    return r"\mathrm{" + name.replace("_", r"\_") + "}"


@dataclass(frozen=True, eq=False)
class Function:
    """A function of the state, as a further variable of monomials.

    Parameters
    ----------
    name, latex : str
        How it is printed.
    value : callable
        From points (n, d) to values (n,).
    axes : sequence of int
        On which coordinates it depends; on none, if it is a function of the time alone.
    direction : int, optional
        Of a component of a vector, which one it is: the first has the others after it, each stands
        in the equation of its direction alone, and all have one coefficient.
    timed : bool
        Whether it depends on the time, alone or beside the state.
    inputs : mapping of str to Input
        By which it does so.
    """

    name: str
    latex: str
    value: Callable[[Floats], Floats]
    axes: Sequence[int]
    direction: int | None = None
    timed: bool = False
    inputs: Mapping[str, Input] = field(default_factory=dict)

    @classmethod
    def unknown(cls, name: str) -> Function:
        """A function of which nothing but the name is known: NaN everywhere."""
        return cls(name, name, _unknown, (0,))

    @property
    def of_time(self) -> bool:
        """Whether it depends on the time alone."""
        return not self.axes

    def at(self, t: Floats, d: int) -> Floats:
        """Values of a function of the time alone at times (n,), of d variables."""
        return self.value(np.repeat(t[:, None], d, axis=1))

    def gradient(self, x: Floats) -> Floats:
        """Derivatives at points (n, d), by differences of fourth order, (n, d)."""
        result = np.zeros_like(x)
        for axis in self.axes:
            step = 1e-4 * (np.abs(x[:, axis]).mean() or 1.0) * np.eye(x.shape[1])[axis]
            near = self.value(x + step) - self.value(x - step)
            far = self.value(x + 2 * step) - self.value(x - 2 * step)
            result[:, axis] = (8 * near - far) / (12 * step[axis])
        return result


def _unknown(x: Floats) -> Floats:
    return np.full(len(x), np.nan)


def extended(x: Floats, functions: Sequence[Function]) -> Floats:
    """Points (n, d), and the values of k functions at them, side by side: (n, d + k)."""
    return np.column_stack([x, *(f.value(x) for f in functions)]) if functions else x


def law_terms(
    x: Floats, functions: Sequence[Function], exponents: Ints, law: Floats
) -> tuple[Floats, Floats]:
    """The monomials of a law, (l, d), at points (n, d), and its denominators.

    Where exponents leave room for slopes, terms with a slope, ``b psi(x) x'``, are those that a
    denominator ``1 - b psi`` brings over: the slopes are what the law makes them.

    Returns
    -------
    terms : ndarray, shape (n, l)
    denominators : ndarray, shape (n, d), or (1, d) if all are 1
    """
    d, z = x.shape[1], extended(x, functions)
    if exponents.shape[1] == z.shape[1]:
        return monomials(z, exponents), np.ones((1, d))
    z = np.column_stack([z, np.ones_like(x)])
    implicit, terms = exponents[:, -d:].any(axis=1), monomials(z, exponents)
    below = 1 - terms[:, implicit] @ law[implicit]
    with np.errstate(divide="ignore", invalid="ignore"):  # at a pole
        z[:, -d:] = (terms[:, ~implicit] @ law[~implicit]) / below
    return monomials(z, exponents), below


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


def shift_matrix(exponents: Ints, offset: Floats, rows: Ints | slice = slice(None)) -> Floats:
    """Matrix ``S`` with ``phi(x - offset) = phi(x) S``, shape (l, l), or some rows of it.

    The library has to be closed: with every monomial it holds all its divisors. An offset (d,)
    leaves the functions as they are. Of several offsets, (n, d), one matrix each, of rows (n, k).
    """
    still = np.zeros((*offset.shape[:-1], exponents.shape[1] - offset.shape[-1]))
    moved = -np.concatenate([offset, still], axis=-1)[..., None, None, :]
    high, low = exponents[None, :, :], exponents[:, None, :]
    factors = binomial(high, low)  # zero where no power is left
    return (factors[rows] * moved ** np.maximum(high - low, 0)[rows]).prod(axis=-1)


def closure(exponents: Ints) -> Ints:
    """Exponents of all divisors of the given monomials, in graded order, shape (l, d)."""
    divisors = {divisor for powers in exponents for divisor in np.ndindex(*(powers + 1))}
    ordered = sorted(divisors, key=lambda e: (sum(e), tuple(-p for p in e)))
    return np.array(ordered, dtype=int).reshape(-1, exponents.shape[1])


def places_of(wanted: Ints, exponents: Ints) -> Ints:
    """In which row of exponents each of the wanted monomials stands, which all are there."""
    row = {tuple(powers): k for k, powers in enumerate(exponents.tolist())}
    return np.array([row[tuple(powers)] for powers in wanted.tolist()], dtype=int)


def divides(exponents: Ints, axes: Bools) -> Bools:
    """Which monomial (row) divides which (column), itself included; shape (l, l).

    Along the given axes, bool (d,): along the others both have the same power.
    """
    along = np.append(axes, np.zeros(exponents.shape[1] - len(axes), dtype=bool))
    row, column = exponents[:, None, :], exponents[None, :, :]
    return np.all((row == column) | along & (row < column), axis=-1)


def shift_generators(exponents: Ints) -> Floats:
    """Matrices ``N_i`` with ``d phi / d x_i = phi N_i``, shape (d, l, l).

    ``-N_i`` is the rate of change of `shift_matrix` with the offset along axis i.
    """
    lowered = exponents[None, :, :] - exponents[:, None, :]
    axes = np.eye(exponents.shape[1], dtype=int)[:, None, None]
    return np.where((lowered == axes).all(axis=-1), exponents.T[:, None], 0.0)


def linearised(
    x: Floats, functions: Sequence[Function], exponents: Ints, law: Floats
) -> tuple[Floats, Floats, Floats]:
    """A law, (l, d), around points (n, d), of a library with all divisors of its monomials.

    Returns
    -------
    terms : ndarray, shape (n, l)
    denominators : ndarray, shape (n, d), or (1, d) if all are 1
    jacobian : ndarray, shape (n, d, d)
        Derivatives of each equation in each coordinate.
    """
    d = x.shape[1]
    terms, below = law_terms(x, functions, exponents, law)
    rates = (terms @ (shift_generators(exponents) @ law)).transpose(1, 2, 0)
    total = rates[:, :, :d]
    for k, function in enumerate(functions):  # by the chain rule
        rate = rates[:, :, d + k, None]
        if rate.any():  # those that are in no term may be infinite
            total = total + rate * function.gradient(x)[:, None, :]
    return terms, below, total / below[:, :, None]


# --------------------------------------------------------------------------------------------------
# Measured inputs: known functions of the time, such as a force that somebody applies.


@dataclass(frozen=True, eq=False)
class Input:
    """A function of the time by its samples, with a curve through those of each trajectory.

    Parameters
    ----------
    pieces : tuple of BSpline
        One a trajectory.
    unsure : ndarray, shape (k, 2)
        Times of samples between which it jumps, nobody knows when.
    """

    pieces: tuple[BSpline, ...]
    unsure: Floats

    @classmethod
    def of(cls, name: str, t: ArrayLike, values: ArrayLike, hold: str | None = None) -> Input:
        """An input from times and values (n,), or lists of such.

        Raises
        ------
        ValueError
            If the name is none, times or values are not such, or times of trajectories overlap.
        """
        if not isinstance(name, str) or not name.isidentifier():
            raise ValueError(f"inputs: must be named like variables, such as u, got {shown(name)}")
        several = isinstance(t, list | tuple) and any(np.ndim(part) for part in t)
        times = cast("Sequence[Floats]", t if several else [t])
        runs = cast("Sequence[Floats]", values if several else [values])
        check_items(f"inputs: {name}", runs, len(times), "trajectory")
        found = [_curve(name, part, run, hold) for part, run in zip(times, runs, strict=True)]
        pieces = [curve for curve, _ in found]
        ends = sorted((spline.t[0], spline.t[-1]) for spline in pieces)
        for (_, last), (first, _) in zip(ends[:-1], ends[1:], strict=True):
            if not last < first:
                raise ValueError(
                    "inputs: trajectories must have times apart from each other (add a number to "
                    f"those of the second), got one to t = {last:g} and one from t = {first:g}"
                )
        return cls(tuple(pieces), np.concatenate([unsure for _, unsure in found]))

    def __call__(self, t: Floats) -> Floats:
        """The values at times (n,); NaN where it was not measured."""
        return of_pieces(self.pieces, np.asarray(t, dtype=float))

    @property
    def breaks(self) -> Floats:
        """Times of samples at which it begins, jumps, has a kink, or ends."""
        times = [piece.t[[0, -1]] for piece in self.pieces]
        times += [p.t[:-1][np.diff(p.c, prepend=p.c[0]) != 0] for p in self.pieces if p.k == 0]
        return np.concatenate([*times, *(p.t for p in self.pieces if p.k == 1)])


def of_pieces(pieces: Sequence[BSpline], t: Floats) -> Floats:
    """What curves of times apart are at times (n,); NaN beyond, but for rounding at their ends."""
    values = np.full((*t.shape, *pieces[0].c.shape[1:]), np.nan)
    for curve in pieces:
        low, high = curve.t[0], curve.t[-1]
        slack = 1e-6 * (high - low)
        inside = (t >= low - slack) & (t <= high + slack)
        values[inside] = curve(np.clip(t[inside], low, high))
    return values


def _curve(name: str, t: Floats, values: Floats, hold: str | None) -> tuple[BSpline, Floats]:
    """The curve through samples, which are checked, and between which it jumps at no known time."""
    t, values = check_times(t), check_array("inputs", values)
    if values.shape != t.shape:
        raise ValueError(f"inputs: {name} must have shape {t.shape}, as t has, got {values.shape}")
    if len(t) < 2:
        raise ValueError(f"inputs: {name} must have at least 2 samples, got {len(t)}")
    if not np.isfinite(values).all():
        first = t[np.argmin(np.isfinite(values))]
        raise ValueError(f"inputs: {name} must be finite, got NaN or infinity at t = {first:g}")
    if np.spacing(np.abs(t).max()) > 1e-7 * np.diff(t).min():
        raise ValueError(
            f"inputs: times of {name} must be told apart to a ten-millionth of their steps, got "
            f"t = {t[0]:g}, ...: subtract the first time, of the states as well"
        )
    degrees, unsure = {"zero": 0, "linear": 1, "cubic": min(3, len(t) - 1)}, np.zeros((0, 2))
    curves = {kind: make_interp_spline(t, values, degree) for kind, degree in degrees.items()}
    if hold is None:
        middles, steps = (t[1:] + t[:-1]) / 2, np.abs(np.diff(values))
        lacks = np.diff(t) > 1.5 * np.median(np.diff(t))  # samples, which is no jump
        # Midway a cubic is so far from a line at six samples of a sine a period: more is a guess.
        much = 0.1 * values.std() + 1e-9 * np.abs(values).max()  # more than rounding
        bend = np.abs(curves["cubic"](middles) - curves["linear"](middles))
        sharp = (bend > much) & ~lacks
        hold = "zero" if sharp.any() else "cubic"
        unsure = np.column_stack([t[:-1], t[1:]])[(steps if sharp.any() else lacks * bend) > much]
        if sharp.any():
            warnings.warn(
                f"inputs: {name} jumps, as at t = {t[1 + (steps * ~lacks).argmax()]:g}, "
                "where a cubic through its samples is a guess: the value of each holds until the "
                "next, but nobody knows when it jumped since the one before, so that nothing is "
                "made of what happens between the two. If it jumps at these times say "
                "hold='zero', or what is true by 'linear' or 'cubic'",
                stacklevel=2,
            )
    return curves[hold], unsure


def jumps(value: Callable[[Floats], Floats], t: Floats, halvings: int = 30) -> Floats:
    """Where a function of the time jumps between given times, (n,).

    Of each interval the half in which it changes more, again and again: what is continuous changes
    less and less. Where it jumps, what is before and after that is searched as well.
    """
    found, starts, ends = np.zeros(0), t[:-1], t[1:]
    least = 1e-9 * np.ptp(value(t))  # more than rounding
    for _ in range(3):
        low, high, changes = starts, ends, []
        below, above = value(low), value(high)
        for _ in range(halvings):
            middle = (low + high) / 2
            here = value(middle)
            left = np.abs(here - below) > np.abs(above - here)
            high, above = np.where(left, middle, high), np.where(left, here, above)
            low, below = np.where(left, low, middle), np.where(left, below, here)
            changes.append(np.abs(above - below))
        there = (changes[-1] > changes[halvings // 2] / 2) & (changes[-1] > least)
        if not there.any():
            break
        found = np.append(found, high[there])
        starts, ends = np.append(starts[there], high[there]), np.append(low[there], ends[there])
    return np.sort(found)


# --------------------------------------------------------------------------------------------------
# Libraries as values: which candidate terms a law may have, before any data are seen.
#
# A library is a sum of families: polynomials, harmonics of the coordinates, functions of one's
# own. For given variables it becomes functions of the state, and the exponents of products of
# coordinates and functions.


@dataclass(frozen=True)
class Library:
    """Candidate terms of a law, as a value: made by `polynomial`, `fourier`, `terms`, and added.

    Parameters
    ----------
    degree : int, optional
        Highest total degree of the monomials; none by default, not even the constant.
    harmonics : int
        Of each measured coordinate q: sin(q), cos(q), ..., sin(n q), cos(n q).
    denominators : int
        Highest degree of a polynomial below a fraction line, each equation its own.
    functions : tuple of (str, callable)
        Terms of one's own, with their names.
    given : tuple of (str, tuple of (str, float or None))
        Of equations, what is known of their terms; see `where`.

    Examples
    --------
    >>> vl.Library.polynomial(3)  # what `discover` takes by default
    >>> vl.Library.polynomial(1) + vl.Library.fourier(1)  # a pendulum
    >>> vl.Library.polynomial(1) + vl.Library.terms({"x/r^3": lambda x, y: x / np.hypot(x, y)**3})
    >>> vl.Library.polynomial(3) + vl.Library.inputs(t, {"u": u})  # a force that was measured
    """

    degree: int | None = None
    harmonics: int = 0
    denominators: int = 0
    functions: tuple[tuple[str, Callable[..., ArrayLike]], ...] = ()
    given: tuple[tuple[str, tuple[tuple[str, float | None], ...]], ...] = ()

    @classmethod
    def polynomial(cls, degree: int) -> Library:
        """All monomials of the state up to a total degree, the constant among them."""
        return cls(degree=check_integer("degree", degree))

    @classmethod
    def fourier(cls, harmonics: int = 1) -> Library:
        """Sine and cosine of each measured coordinate, in radians, and of its multiples.

        The coordinates are taken as they are: no origin is searched for a law with such terms.
        """
        return cls(harmonics=check_integer("harmonics", harmonics, 1))

    @classmethod
    def rational(cls, degree: int) -> Library:
        """Denominators: polynomials up to a degree with the constant 1, one for each equation.

        The law is ``D(x) x' = N(x)``, with all other terms of the library in the numerator.
        """
        return cls(denominators=check_integer("degree", degree, 1))

    @classmethod
    def terms(cls, functions: Mapping[str, Callable[..., ArrayLike]]) -> Library:
        """Functions of one's own as terms.

        Parameters
        ----------
        functions : mapping of str to callable
            Names and functions. The arguments of a function are named like the variables that it
            needs (``x, y``; of a law of second order also ``vx, vy``; one with a default is no
            variable); it takes and returns arrays of shape (n,). Derivatives are taken by
            differences of fourth order. If it returns as many arrays as there are measured
            coordinates, these are the directions of a vector, and the term has the same coefficient
            in all of them. An argument ``t``, which no coordinate is named, is the time, as in
            ``lambda t: np.cos(3 * t)``; it then is the last variable of the law, with
            ``dt/dt = 1``.

        Raises
        ------
        ValueError
            If it is no such mapping.
        """
        check_mapping("functions", functions, "map names to functions of the variables")
        for name, rule in functions.items():
            if not isinstance(name, str) or not name.strip() or not callable(rule):
                raise ValueError(
                    f"functions: must map names to functions, got {shown(name)}: {shown(rule)}"
                )
        return cls(functions=tuple(functions.items()))

    @classmethod
    def inputs(
        cls, t: ArrayLike, values: Mapping[str, ArrayLike], hold: str | None = None
    ) -> Library:
        """Measured inputs as terms: functions of the time that are known, whatever the state is.

        A law with inputs is one of the state and the time, as with `terms` of ``t``. Functions in
        `terms` may have inputs as arguments, as in ``{"ux": lambda u, x: u * x}``. Where an input
        jumps, the slope of the path may.

        Parameters
        ----------
        t : array_like, shape (n,), or list of such
            Increasing times, those of the states or others; for several trajectories a list. As an
            input is a function of the time, trajectories with different inputs must have times
            apart from each other: add a number to those of the second.
        values : mapping of str to array_like, shape (n,), or list of such
            Names and values; for several trajectories lists.
        hold : {"zero", "linear", "cubic"}, optional
            What an input is between its samples: the value of the last one (a controller, which
            switches at these times), a line, or a cubic spline. By default the spline; or, if it
            jumps, the value of the last one, with a warning: as it jumped at some time since then,
            the path is open there, as in a gap.

        Raises
        ------
        ValueError
            If a name is none, times or values are not such, or times of trajectories overlap.

        Warns
        -----
        UserWarning
            If an input jumps, and ``hold`` does not say what is between its samples.

        Examples
        --------
        >>> library = vl.Library.polynomial(3) + vl.Library.inputs(t, {"u": u})
        >>> vl.discover(t, x, library=library, order=2)  # x'' = -x - x^3 - 0.2 vx + 0.5 u
        """
        check_mapping("inputs", values, "map names to values at t")
        if hold is not None:
            check_choice("hold", hold, ("zero", "linear", "cubic"))
        return cls.terms({name: Input.of(name, t, given, hold) for name, given in values.items()})

    def where(self, equations: Mapping[str, Mapping[str, float | None]]) -> Library:
        """The same terms, of which some are known, forbidden or alone allowed in an equation.

        The law is then sought in the frame of the data only, in which these terms are meant.

        Parameters
        ----------
        equations : mapping of str to mapping of str to float or None
            For a variable the terms of its slope (for a law of second order of ``vx``, the
            acceleration), as in `PolynomialSystem.from_terms`: the coefficient that is known, 0 for
            a term that is forbidden, None for one that is to be found. ``"..."`` are all others of
            the equation, which are to be found unless it says otherwise.

        Raises
        ------
        ValueError
            If it is no such mapping.

        Examples
        --------
        >>> known = {"y": {"x": 28}}  # dy/dt = 28 x + ...
        >>> forbidden = {"x": {"z": 0, "z^2": 0}}
        >>> allowed = {"x": {"x": None, "y": None, "...": 0}}
        >>> vl.Library.polynomial(2).where(known | forbidden)
        """
        rows = {name: dict(terms) for name, terms in self.given}
        rule = "give variables what is known of their terms, e.g. {'x': {'y': 10, 'z': 0}}"
        check_mapping("equations", equations, rule, Mapping)
        for name, terms in equations.items():
            checked = {
                term: None if value is None else check_number(f"coefficient of {term}", value)
                for term, value in terms.items()
            }
            rows[name] = rows.get(name, {}) | checked
        return replace(self, given=tuple((name, tuple(row.items())) for name, row in rows.items()))

    @classmethod
    def parse(cls, text: str) -> Library:
        """A library from text such as ``polynomial(3) + fourier(1)``.

        What is known of an equation follows, as in ``polynomial(2); x: y = 10, z = 0, ... = ?``.

        Raises
        ------
        ValueError
            If it names an unknown family, or what follows is no such list.
        """
        check_instance("text", text, str)
        total, (families, *equations) = cls(), text.split(";")
        for part in families.split("+"):
            match = re.fullmatch(r"\s*(polynomial|fourier|rational)\s*\(\s*(\d+)\s*\)\s*", part)
            if match is None:
                raise ValueError(
                    f"library: must be a sum of polynomial(degree), "
                    f"fourier(harmonics) and rational(degree), got {part.strip()!r}"
                )
            total += getattr(cls, match[1])(int(match[2]))
        for equation in equations:
            name, _, listed = equation.partition(":")
            pairs = [pair.partition("=")[::2] for pair in listed.split(",")]
            try:
                row = {
                    term.strip(): None if value.strip() == "?" else float(value)
                    for term, value in pairs
                }
            except ValueError:
                raise ValueError(
                    f"library: what is known must read as 'x: y = 10, z = 0', got {equation!r}"
                ) from None
            total = total.where({name.strip(): row})
        return total

    def __add__(self, other: Library) -> Library:
        if not isinstance(other, Library):
            return NotImplemented
        functions = dict(self.functions)
        for name, rule in other.functions:
            if functions.setdefault(name, rule) is not rule:
                raise ValueError(f"library: a name may stand for one function, got {name!r} twice")
        degrees = [part.degree for part in (self, other) if part.degree is not None]
        total = Library(
            max(degrees, default=None),
            max(self.harmonics, other.harmonics),
            max(self.denominators, other.denominators),
            tuple(functions.items()),
        )
        for name, terms in self.given + other.given:
            total = total.where({name: dict(terms)})
        return total

    def __str__(self) -> str:
        parts = [] if self.degree is None else [f"polynomial({self.degree})"]
        parts += [f"fourier({self.harmonics})"] if self.harmonics else []
        parts += [f"rational({self.denominators})"] if self.denominators else []
        parts += [f"terms({', '.join(name for name, _ in self.functions)})"] * bool(self.functions)
        text = " + ".join(parts)
        for name, terms in self.given:
            known = (f"{term} = {'?' if value is None else f'{value:g}'}" for term, value in terms)
            text += f"; {name}: {', '.join(known)}"
        return text

    def timed(self, names: tuple[str, ...]) -> bool:
        """Whether a function has the time as an argument, which is none of the named variables."""
        arguments = {argument for _, rule in self.functions for argument in _arguments(rule)}
        return CLOCK in arguments - set(names)

    def moving(self, names: tuple[str, ...]) -> bool:
        """Whether it names velocities of the named coordinates, which a law of order 2 has."""
        named = {argument for _, rule in self.functions for argument in _arguments(rule)}
        named |= {equation for equation, _ in self.given}
        return not named.isdisjoint(set(velocity_names(names)) - set(names))

    def resolve(self, names: tuple[str, ...], measured: int) -> tuple[Ints, tuple[Function, ...]]:
        """The terms of a law in named variables, of which the first ``measured`` were measured.

        The last of them is the time, if that was not measured.

        Returns
        -------
        exponents : ndarray of int, shape (l, d + k), or (l, 2 d + k) with denominators
            Of the d variables, k functions and d slopes in each term.
        functions : tuple of Function, length k

        Raises
        ------
        ValueError
            If a function has an argument that is no variable, or there are too many terms.
        """
        d = len(names)
        states = d - (CLOCK in names[measured:])
        highest = max(self.degree or 0, self.denominators)
        count = comb(states + highest, states) + 2 * self.harmonics * measured
        if count > 1000:  # than a search can try to an end
            raise ValueError(
                f"library: must have at most 1000 terms, got {count} in {states} variables"
            )
        functions = [
            harmonic(names, axis, multiple, kind)
            for axis in range(measured)
            for multiple in range(1, self.harmonics + 1)
            for kind in ("sin", "cos")
        ]
        inputs = {name: rule for name, rule in self.functions if isinstance(rule, Input)}
        for name, rule in self.functions:
            functions += own(names, measured, name, rule, inputs)
        taken = [*names, *(function.name for function in functions)]
        check_own_names(taken)
        powers = np.empty((0, d), dtype=int)
        if self.degree is not None:
            powers = np.pad(monomial_exponents(states, self.degree), ((0, 0), (0, d - states)))
        exponents = block_diag(powers, np.eye(len(functions), dtype=int))
        if self.denominators:
            exponents = np.pad(exponents, ((0, 0), (0, d)))
            below = monomial_exponents(states, self.denominators)[1:]
            for slope in range(states - measured, states):
                rows = np.zeros((len(below), exponents.shape[1]), dtype=int)
                rows[:, :states], rows[:, slope - d] = below, 1
                exponents = np.concatenate([exponents, rows])
        return exponents, tuple(functions)


def check_library(degree: int | None, library: Library | None) -> Library:
    """The library that is given, or that of a degree, 3 if neither is."""
    if library is None:
        return Library.polynomial(3 if degree is None else check_integer("degree", degree, 1))
    check_instance("library", library, Library)
    if degree is not None:
        raise ValueError(f"degree: must not be given with a library, got {degree} and {library}")
    if replace(library, denominators=0) == Library():
        above = " above the fraction line" * bool(library.denominators)
        raise ValueError(f"library: must hold a term{above}, got none")
    return library


def check_own_names(terms: Sequence[str]) -> None:
    """Refuse terms of which two have one name."""
    if clash := next((name for name in terms if terms.count(name) > 1), None):
        made = " (with order 2, x are positions alone, of which the velocities are made)"
        raise ValueError(
            f"library: a term must have a name of its own, got {clash!r} twice"
            + made * (clash in velocity_names(terms))
        )


def check_mapping(name: str, value: object, rule: str, of: type = object) -> None:
    """A mapping that is not empty, of values of a type."""
    rows = value.values() if isinstance(value, Mapping) else ()
    if not rows or not all(isinstance(row, of) for row in rows):
        raise ValueError(f"{name}: must {rule}, got {shown(value)}")


def harmonic(names: tuple[str, ...], axis: int, multiple: int, kind: str) -> Function:
    """Sine or cosine of a multiple of a coordinate."""
    times, of = "" if multiple == 1 else f"{multiple} ", {"sin": np.sin, "cos": np.cos}[kind]
    latex = rf"\{kind}({times}{name_latex(names[axis])})"
    value = partial(_harmonic, of=of, multiple=multiple, axis=axis)
    return Function(f"{kind}({times}{names[axis]})", latex, value, (axis,))


def _harmonic(x: Floats, of: np.ufunc, multiple: int, axis: int) -> Floats:
    return np.asarray(of(multiple * x[:, axis]))


def own(
    names: tuple[str, ...],
    measured: int,
    name: str,
    rule: Callable[..., ArrayLike],
    inputs: Mapping[str, Input],
) -> list[Function]:
    """A function of one's own, of variables and inputs by their names; or its components."""
    arguments = _arguments(rule)
    unknown = [argument for argument in arguments if argument not in (*names, *inputs)]
    if not arguments or unknown:
        moving = not set(velocity_names((*names, *inputs))).isdisjoint(unknown)
        raise ValueError(
            f"library: the arguments of {name!r} must be named like variables "
            f"({', '.join((*names, *inputs))}), as in lambda x: np.sin(x), got "
            + (", ".join(unknown) or "none")
            + ": velocities are variables of a law of order=2" * moving
        )
    named = [names.index(argument) for argument in arguments if argument in names]
    axes = [axis for axis in named if names[axis] != CLOCK or axis < measured]
    used = {argument: inputs[argument] for argument in arguments if argument in inputs}
    used |= {name: rule} if isinstance(rule, Input) else {}

    of = [(names.index(CLOCK if a in inputs else a), inputs.get(a, np.asarray)) for a in arguments]
    evaluate = partial(_evaluated, rule=rule, of=of)

    try:
        shape, longer = (evaluate(np.ones((n, len(names)))).shape for n in (2, 97))
    except Exception as error:  # whatever a function of one's own may raise
        raise ValueError(
            f"library: {name!r} must take and return arrays of shape (n,), as numpy's functions "
            f"do, got {type(error).__name__}: {error}"
        ) from error
    if shape not in ((2,), (measured, 2)) or longer != (*shape[:-1], 97):
        raise ValueError(
            f"library: {name!r} must return an array of the shape of its arguments, (n,), or "
            f"{measured} of these, got shape {shape} for n = 2 and {longer} for n = 97"
        )
    latex = upright(name)
    whole = Function(name, latex, evaluate, axes, timed=axes != named or bool(used), inputs=used)

    def component(j: int) -> Function:
        of = names[j]
        return replace(
            whole, name=f"{name}_{of}", latex=f"{latex}_{{{name_latex(of)}}}", direction=j,
            value=partial(evaluate, part=j),
        )  # fmt: skip

    return [whole] if len(shape) == 1 else [component(j) for j in range(measured)]


def _evaluated(x: Floats, rule: Callable[..., Any], of: Sequence[Any], part: Any = ...) -> Floats:
    """A function of one's own, or a component, of some columns of points, or of inputs there."""
    values = [argument(x[:, k]) for k, argument in of]
    with np.errstate(all="ignore"):  # what is not finite is refused where it matters
        return np.asarray(rule(*values), dtype=float)[part]


def _arguments(rule: Callable[..., ArrayLike]) -> list[str]:
    """Names of the arguments that a function needs; none of some functions in C."""
    try:
        parameters = inspect.signature(rule).parameters
    except (TypeError, ValueError):
        return []
    return [name for name, known in parameters.items() if known.default is known.empty]
