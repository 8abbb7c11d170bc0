"""Libraries as values: which candidate terms a law may have, before any data are seen.

A library is a sum of families: polynomials, harmonics of the coordinates, functions of one's own.
For given variables it becomes what `library` works with: functions of the state, and the exponents
of products of coordinates and functions.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import comb

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Ints
from ..checks import check_instance, check_integer, check_number
from .inputs import Input
from .library import CLOCK, Function, monomial_exponents, name_latex, velocity_names

MOST_TERMS = 1000
"""Most monomials of a law, of its denominators, or waves: a search among more would not end."""
FAMILIES = "polynomial(degree), fourier(harmonics) and rational(degree)"
"""What can be written as text."""
OTHERS = "..."
"""All terms of an equation that are not named."""
STEP = 1e-3
"""Step of a difference, relative to the size of the coordinate."""


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
        if not isinstance(functions, Mapping) or not functions:
            raise ValueError(
                f"functions: must map names to functions of the variables, got {functions!r:.60}"
            )
        for name, rule in functions.items():
            if not isinstance(name, str) or not name.strip() or not callable(rule):
                raise ValueError(
                    f"functions: must map names to functions, got {name!r:.60}: {rule!r:.60}"
                )
        return cls(functions=tuple(functions.items()))

    @classmethod
    def inputs(cls, t: ArrayLike, values: Mapping[str, ArrayLike]) -> Library:
        """Measured inputs as terms: functions of the time that are known, whatever the state is.

        Between the samples each is a cubic spline. A law with inputs is one of the state and the
        time, as with `terms` of ``t``. Functions in `terms` may have inputs as arguments, as in
        ``{"ux": lambda u, x: u * x}``.

        Parameters
        ----------
        t : array_like, shape (n,), or list of such
            Increasing times, those of the states or others; for several trajectories a list. As an
            input is a function of the time, trajectories with different inputs must have times
            apart from each other: add a number to those of the second.
        values : mapping of str to array_like, shape (n,), or list of such
            Names and values; for several trajectories lists.

        Raises
        ------
        ValueError
            If a name is none, times or values are not such, or times of trajectories overlap.

        Examples
        --------
        >>> library = vl.Library.polynomial(3) + vl.Library.inputs(t, {"u": u})
        >>> vl.discover(t, x, library=library, order=2)  # x'' = -x - x^3 - 0.2 vx + 0.5 u
        """
        if not isinstance(values, Mapping) or not values:
            raise ValueError(f"inputs: must map names to values at t, got {values!r:.60}")
        return cls.terms({name: Input.of(name, t, given) for name, given in values.items()})

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
        given = equations.items() if isinstance(equations, Mapping) else ()
        if not given or not all(isinstance(terms, Mapping) for _, terms in given):
            raise ValueError(
                "equations: must give variables what is known of their terms, e.g. "
                f"{{'x': {{'y': 10, 'z': 0}}}}, got {equations!r:.60}"
            )
        for name, terms in given:
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
                raise ValueError(f"library: must be a sum of {FAMILIES}, got {part.strip()!r}")
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
        given = [(name, dict(terms)) for name, terms in self.given + other.given]
        for name, terms in given:
            total = total.where({name: terms})
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
        self._check_size(states, measured)
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
        if clash := next((name for name in taken if taken.count(name) > 1), None):
            raise ValueError(f"library: a term must have a name of its own, got {clash!r} twice")
        powers = np.empty((0, d), dtype=int)
        if self.degree is not None:
            powers = np.pad(monomial_exponents(states, self.degree), ((0, 0), (0, d - states)))
        exponents = np.zeros((len(powers) + len(functions), d + len(functions)), dtype=int)
        exponents[: len(powers), :d] = powers
        exponents[len(powers) :, d:] = np.eye(len(functions), dtype=int)
        if self.denominators:
            exponents = np.pad(exponents, ((0, 0), (0, d)))
            below = monomial_exponents(states, self.denominators)[1:]
            for slope in range(states - measured, states):
                rows = np.zeros((len(below), exponents.shape[1]), dtype=int)
                rows[:, :states], rows[:, slope - d] = below, 1
                exponents = np.concatenate([exponents, rows])
        return exponents, tuple(functions)

    def _check_size(self, states: int, measured: int) -> None:
        """Refuse more terms than a search can try, before they are listed."""
        counts = [
            ("monomials", comb(states + degree, states), f"of degree {degree}")
            for degree in (self.degree or 0, self.denominators)
        ]
        waves = 2 * self.harmonics * measured
        counts += [("sines and cosines", waves, f"of {self.harmonics} multiples")]
        for what, count, which in counts:
            if count > MOST_TERMS:
                raise ValueError(
                    f"library: must have at most {MOST_TERMS} {what}, got {count} {which} in "
                    f"{states} variables"
                )


def check_library(degree: int | None, library: Library | None) -> Library:
    """The library that is given, or that of a degree, 3 if neither is."""
    if library is None:
        return Library.polynomial(3 if degree is None else check_integer("degree", degree, 1))
    check_instance("library", library, Library)
    if degree is not None:
        raise ValueError(f"degree: must not be given with a library, got {degree} and {library}")
    if library == Library():
        raise ValueError("library: must hold a term, got none")
    return library


def harmonic(names: tuple[str, ...], axis: int, multiple: int, kind: str) -> Function:
    """Sine or cosine of a multiple of a coordinate."""
    of, slope, sign = (np.sin, np.cos, 1) if kind == "sin" else (np.cos, np.sin, -1)

    def gradient(x: Floats) -> Floats:
        result = np.zeros_like(x)
        result[:, axis] = sign * multiple * slope(multiple * x[:, axis])
        return result

    times = "" if multiple == 1 else f"{multiple} "
    return Function(
        name=f"{kind}({times}{names[axis]})",
        latex=rf"\{kind}({times}{name_latex(names[axis])})",
        value=lambda x: of(multiple * x[:, axis]),
        gradient=gradient,
    )


def own(
    names: tuple[str, ...],
    measured: int,
    name: str,
    rule: Callable[..., ArrayLike],
    inputs: Mapping[str, Input],
) -> list[Function]:
    """A function of one's own, of variables and inputs by their names; or its components."""
    arguments = _checked_arguments((*names, *inputs), name, rule)
    axes = [names.index(argument) for argument in arguments if argument in names]
    moving = [axis for axis in axes if names[axis] != CLOCK or axis < measured]

    def evaluate(x: Floats) -> Floats:
        values = dict(zip(names, x.T, strict=True))
        values |= {known: of_time(values[CLOCK]) for known, of_time in inputs.items()}
        with np.errstate(all="ignore"):  # what is not finite is refused where it matters
            return np.asarray(rule(*(values[argument] for argument in arguments)), dtype=float)

    try:
        shape, longer = (evaluate(np.ones((n, len(names)))).shape for n in (2, 3))
    except Exception as error:  # whatever a function of one's own may raise
        raise ValueError(
            f"library: {name!r} must take and return arrays of shape (n,), as numpy's functions "
            f"do, got {type(error).__name__}: {error}"
        ) from error
    if shape not in ((2,), (measured, 2)) or longer != (*shape[:-1], 3):
        raise ValueError(
            f"library: {name!r} must return an array of the shape of its arguments, (n,), or "
            f"{measured} of these, got shape {shape} for n = 2 and {longer} for n = 3"
        )

    def component(direction: int | None) -> Function:
        def value(x: Floats) -> Floats:
            values = evaluate(x)
            return values if direction is None else values[direction]

        of = "" if direction is None else names[direction]
        return Function(
            name=f"{name}_{of}" if of else name,
            latex=rf"\mathrm{{{name}}}" + (f"_{{{of}}}" if of else ""),
            value=value,
            gradient=lambda x: _differences(value, x, moving),
            direction=direction,
            of_time=not moving,
        )

    return [component(j) for j in (range(measured) if len(shape) == 2 else [None])]


def _checked_arguments(
    names: tuple[str, ...], name: str, rule: Callable[..., ArrayLike]
) -> list[str]:
    """The arguments of a function, which must be among some names."""
    arguments = _arguments(rule)
    unknown = [argument for argument in arguments if argument not in names]
    if not arguments or unknown:
        moving = not set(velocity_names(names)).isdisjoint(unknown)
        raise ValueError(
            f"library: the arguments of {name!r} must be named like variables "
            f"({', '.join(names)}), as in lambda x: np.sin(x), got {', '.join(unknown) or 'none'}"
            + ": velocities are variables of a law of order=2"
            * moving
        )
    return arguments


def _arguments(rule: Callable[..., ArrayLike]) -> list[str]:
    """Names of the arguments that a function needs; none of some functions in C."""
    try:
        parameters = inspect.signature(rule).parameters
    except (TypeError, ValueError):
        return []
    return [name for name, known in parameters.items() if known.default is known.empty]


def _differences(value: Callable[[Floats], Floats], x: Floats, axes: Sequence[int]) -> Floats:
    """Derivatives of a function along axes by differences of fourth order, (n, d)."""
    result = np.zeros_like(x)
    for axis in axes:
        step = np.zeros(x.shape[1])
        step[axis] = STEP * (np.abs(x[:, axis]).mean() or 1.0)
        near = value(x + step) - value(x - step)
        far = value(x + 2 * step) - value(x - 2 * step)
        result[:, axis] = (8 * near - far) / (12 * step[axis])
    return result
