"""A law as a model: its system of equations, its integration, and its form before a search.

`PolynomialSystem` is a law, of the truth as well as of a discovery; `runge_kutta_4` follows it;
`Form` is what a law may look like before it is
searched.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from scipy.integrate import DOP853

from ..arrays import Bools, Floats, Ints
from ..checks import (
    check_array,
    check_instance,
    check_integer,
    check_items,
    check_number,
    check_times,
    check_vector,
    shown,
)
from .l0 import LEAST
from .library import (
    CLOCK,
    Function,
    Input,
    Library,
    check_mapping,
    check_own_names,
    closure,
    extended,
    jumps,
    law_terms,
    linearised,
    name_latex,
    places_of,
    shift_matrix,
    velocity_names,
)

# --------------------------------------------------------------------------------------------------
# Solutions of differential equations, the same to the last digit on every machine.
#
# A chaotic motion multiplies a rounding error until nothing of the first digits is left: a path of
# Sprott's F over 15 periods depends on whether the processor adds two products in one instruction.
# So the integrators here use nothing whose rounding is left to a library of linear algebra.

STAGES = [row[:k, None] for k, row in enumerate(DOP853.A[: DOP853.n_stages])]
#: Coefficients of the step, and of its errors against steps of order 3 and 5.
WEIGHTS, THIRD, FIFTH = (row[: len(STAGES), None] for row in (DOP853.B, DOP853.E3, DOP853.E5))


def runge_kutta_4(
    rate: Callable[[Floats], Floats], t: Floats, x0: Floats, substeps: int = 10
) -> Floats:
    """Integrate with the classical 4th-order Runge-Kutta method, as the paper does.

    Parameters
    ----------
    rate : callable
        The law: time derivative of a state, or of several at once; a `PolynomialSystem` is one.
    t : ndarray, shape (n,)
        Increasing times of the returned rows.
    x0 : array_like, shape (d,) or (m, d)
        State, or states of several motions, at ``t[0]``.
    substeps : int
        Equal steps between two times.

    Returns
    -------
    ndarray, shape (n, d) or (n, m, d)
    """
    states = [check_array("x0", x0, getattr(rate, "names", ()))]
    d = getattr(rate, "d", None)
    if d is not None and states[0].shape[-1:] != (d,):
        raise ValueError(f"x0: must have shape ({d},) or (m, {d}), got {states[0].shape}")
    if not np.isfinite(states[0]).all():
        raise ValueError(f"x0: must be finite, got {x0!r:.60}")
    for step in np.diff(check_times(t)) / check_integer("substeps", substeps, 1):
        x = states[-1]
        for _ in range(substeps):
            k1 = rate(x)
            k2 = rate(x + step / 2 * k1)
            k3 = rate(x + step / 2 * k2)
            k4 = rate(x + step * k3)
            x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        states.append(x)
    return np.array(states)


def sums(exponents: Ints, coefficients: Floats) -> Callable[[Floats], Floats]:
    """Sums of monomials at a point, (d,), as a function of its coordinates; no BLAS adds them."""
    used = coefficients.any(axis=1)
    exponents, coefficients = exponents[used], coefficients[used]
    highest, width = exponents.max(initial=0), exponents.shape[1]
    powers, columns = np.ones((highest + 1, width)), np.arange(width)

    def value(z: Floats) -> Floats:
        powers[1:] = z
        factors = np.multiply.accumulate(powers)[exponents, columns]
        return np.add.reduce(np.multiply.reduce(factors, axis=1)[:, None] * coefficients)

    return value


def integrate(
    rate: Callable[[Floats], Floats],
    t: Floats,
    x0: Floats,
    farthest: float = np.inf,
    most_steps: float = 50_000,
) -> tuple[Floats, str]:
    """Integrate with the Dormand-Prince method of order 8, its steps halved and doubled as needed.

    Parameters
    ----------
    rate : callable
        The law: time derivative (d,) of a state (d,).
    t : ndarray, shape (n,)
        Increasing times of the returned rows; a step ends at each.
    x0 : ndarray, shape (d,)
        State at ``t[0]``.
    farthest : float
        Largest coordinate; beyond it the motion is taken to blow up.
    most_steps : float
        Of a motion that gets nowhere; one that needs more is stiff, or as good as lost. For each of
        its own sizes by which it moves on it has a thousand more: then it is just long.

    Returns
    -------
    path : ndarray, shape (n, d)
        Rows after a blow-up are NaN, or from where the motion is too stiff to follow; however long
        it is, it is followed to its end.
    end : str
        What happens where the path ends early, in words; else empty.

    References
    ----------
    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, sec. II.10.
    """
    path = np.full((len(t), len(x0)), np.nan)
    path[0] = x = x0
    step, least = float(np.diff(t[:2]).sum()), 1e-15 * float(np.abs(t).max())
    steps, size = most_steps, np.abs(x0) + LEAST
    for row, (now, end) in enumerate(zip(t[:-1].tolist(), t[1:].tolist(), strict=True), start=1):
        while now < end:
            last = step >= end - now
            steps -= not last  # that a row is near is no fault of the motion
            if steps < 0:
                return path, "is too stiff to be followed"
            taken = end - now if last else step
            with np.errstate(over="ignore", invalid="ignore"):  # of steps that are too long
                moved, error = _step(rate, x, taken)
            change = np.abs(moved - x)
            # Where the rate jumps, the shortest step misses by more than is tolerated, but hardly
            # moves; at a pole it does.
            if not (error < 1 or (taken <= least and (change < 1e-9 * (1 + np.abs(x))).all())):
                if taken <= least:
                    return path, "diverges"
                step = max(taken / 2, least)
                continue
            size = np.maximum(size, np.abs(moved))
            steps += 1000 * float((change / size).max())
            x, now = moved, end if last else now + taken
            if np.abs(x).max() > farthest:
                return path, "diverges"
            if error < 2.0**-9 and not taken < step:  # of a step of order 8
                step = 2 * taken
        path[row] = x
    return path, ""


def _step(rate: Callable[[Floats], Floats], x: Floats, step: float) -> tuple[Floats, float]:
    """A step of order 8, and its error over a tolerance of 1e-11, absolute and relative."""
    slopes = np.empty((len(STAGES), len(x)))
    for k, weights in enumerate(STAGES):
        slopes[k] = rate(x + step * np.add.reduce(weights * slopes[:k]))
    moved = x + step * np.add.reduce(WEIGHTS * slopes)
    scale = 1e-11 * (1 + np.maximum(np.abs(x), np.abs(moved)))
    third = float(np.add.reduce((np.add.reduce(THIRD * slopes) / scale) ** 2))
    fifth = float(np.add.reduce((np.add.reduce(FIFTH * slopes) / scale) ** 2))
    if fifth == 0:
        return moved, 0.0
    return moved, step * fifth / np.sqrt((fifth + 0.01 * third) * len(x))


# --------------------------------------------------------------------------------------------------
# Polynomial dynamical systems: the one type of both the ground truth and the discovered law.
#
# The law is ``dx/dt = phi(x) Lambda`` (paper: Eq. 7), with a row ``phi`` of monomials and a sparse
# matrix ``Lambda`` of coefficients. A polynomial library is closed under a shift of the origin, so
# the law in any other frame follows exactly (paper: Eq. 10) and is never typed by hand. A law may
# be a polynomial in functions of the state, too: then its frame is that of the data.


def with_error(values: Floats, error: float, known: str = "g") -> tuple[str, int]:
    """Numbers with two digits of their error, over a power of ten; known ones in a format.

    The power is 0 for numbers of few digits.
    """
    largest = max(float(np.abs(values).max()), error)
    power = int(np.floor(np.log10(largest))) if largest > 0 else 0
    power = 0 if -5 <= power < 6 else power
    digits = int(np.clip(1 - np.floor(np.log10(error / 10.0**power)), 0, 12)) if error > 0 else 0
    form = f".{digits}f" if error > 0 else known
    text = ", ".join(f"{value / 10.0**power + 0.0:{form}}" for value in np.ravel(values))
    text = f"({text})" if np.ndim(values) else text
    return f"{text} ± {error / 10.0**power:{form}}" if error > 0 else text, power


@dataclass(frozen=True, eq=False)
class PolynomialSystem:
    """An autonomous polynomial system ``dx/dt = phi(x) Lambda`` (paper: Eq. 7).

    Parameters
    ----------
    names : sequence of str, length d
        Names of the state variables: a letter, then letters, digits and underscores.
    exponents : array_like of int, shape (l, d + k) or (l, 2 d + k)
        The monomials of the library, one row each, in the variables and in k functions of them. If
        the law is a fraction, also in the slopes: a term with a slope, brought to the other side,
        belongs to the denominator.
    coefficients : array_like, shape (l, d)
        ``Lambda``; column j is the right-hand side of variable j.
    functions : tuple of Function
        Those of the k functions that a `Library` brings; none for a polynomial law.

    Raises
    ------
    ValueError
        If shapes disagree, a name is none, an exponent is negative, not whole or repeated, or a
        value is not finite.
    """

    names: tuple[str, ...]
    exponents: Ints
    coefficients: Floats
    functions: tuple[Function, ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        names = check_items("names", self.names)
        named = all(isinstance(name, str) and name.isidentifier() for name in names)
        if not names or not named or len(set(names)) != len(names):
            raise ValueError(
                "names: must be distinct names such as x or x1, at least one, "
                f"got {shown(self.names)}"
            )
        powers = check_array("exponents", self.exponents)
        coefficients = check_array("coefficients", self.coefficients).copy()
        functions = check_items("functions", self.functions)
        # A law that is read from a file has the names of its functions at first.
        if not all(isinstance(function, Function | str) for function in functions):
            raise ValueError(f"functions: must be of a Library, got {shown(self.functions)}")
        width = len(names) + len(functions)
        if powers.ndim != 2 or powers.shape[1] not in (width, width + len(names)):
            raise ValueError(f"exponents: must have shape (l, {width}), got shape {powers.shape}")
        whole = np.isfinite(powers) & (powers >= 0) & (powers == np.rint(powers))
        if not whole.all():
            raise ValueError(f"exponents: must be non-negative integers, got {powers[~whole][0]:g}")
        exponents = powers.astype(int)
        if len(np.unique(exponents, axis=0)) != len(exponents):
            raise ValueError("exponents: every monomial may appear once, got a repeated row")
        shape = (len(exponents), len(names))
        if coefficients.shape != shape:
            raise ValueError(f"coefficients: must have shape {shape}, got {coefficients.shape}")
        if not np.isfinite(coefficients).all():
            raise ValueError("coefficients: must be finite, got NaN or infinity")
        for array in (exponents, coefficients):
            array.setflags(write=False)
        vars(self).update(names=names, exponents=exponents, coefficients=coefficients)

    @classmethod
    def from_terms(
        cls,
        equations: Mapping[str, Mapping[str, float]],
        degree: int | None = None,
        library: Library | None = None,
    ) -> PolynomialSystem:
        """Build a system from named terms.

        Parameters
        ----------
        equations : mapping of str to mapping of str to float
            For each variable its terms, e.g. ``{"x": {"x": -10, "y": 10}, "y": {...}}``. A term
            is a product of variables, ``"1"``, ``"xz"``, ``"x^2 y"`` or ``"x*y**2"``.
        degree : int, optional
            Degree of the full library; by default the highest degree among the terms.
        library : Library, optional
            Whose functions terms may name, as in ``"sin(x)"``.

        Raises
        ------
        ValueError
            If the equations are no such mapping, or a term names an unknown variable or has a
            higher degree than the library.
        """
        rule = "give each variable its terms, e.g. {'x': {'x': -10, 'y': 10}, 'y': {'x': 1}}"
        check_mapping("equations", equations, rule, Mapping)
        names, held = tuple(equations), Library() if library is None else library
        check_instance("library", held, Library)
        states = names[:-1] if CLOCK in names[-1:] and held.timed(names[:-1]) else names
        m = len(states) // 2
        measured = m if m and states[m:] == velocity_names(states[:m]) else len(states)
        _, functions = held.resolve(names, measured)
        known = (*names, *(function.name for function in functions))
        known += tuple(f"{name}'" for name in names if held.denominators)
        parsed = [
            (parse_term(term, known), column, check_number(f"coefficient of {term}", value))
            for column, terms in enumerate(equations.values())
            for term, value in terms.items()
        ]
        highest = max((sum(powers) for powers, _, _ in parsed), default=0)
        degree = highest if degree is None else check_integer("degree", degree)
        if highest > degree:
            raise ValueError(f"degree: must be at least that of the terms, {highest}, got {degree}")
        wanted, _ = (held + Library.polynomial(degree)).resolve(names, measured)
        named = np.array([powers for powers, _, _ in parsed], int).reshape(-1, wanted.shape[1])
        exponents = closure(np.concatenate([wanted, named]))
        coefficients = np.zeros((len(exponents), len(names)))
        rows = places_of(named, exponents).tolist()
        for row, (_, column, value) in zip(rows, parsed, strict=True):
            coefficients[row, column] += value
        law = cls(names, exponents, coefficients, functions=functions)
        check_own_names(law.terms)
        return law

    @property
    def d(self) -> int:
        """Dimension of the state."""
        return len(self.names)

    @cached_property
    def terms(self) -> tuple[str, ...]:
        """Names of the monomials, e.g. ``("1", "x", "x^2", "xy")``."""
        return self._named(tuple(f"{name}'" for name in self.names))

    @cached_property
    def factors(self) -> tuple[str, ...]:
        """The same names without the slopes that terms hold."""
        return self._named(())

    def _named(self, slopes: tuple[str, ...]) -> tuple[str, ...]:
        """Names of the monomials, given those of the slopes; without these, if none are.

        A blank sets apart what has more than a letter, and all if a function is named like a
        product of variables.
        """
        functions = tuple(function.name for function in self.functions)
        alike = any(set(name) <= set(self.names) for name in functions)
        names = (*self.names, *functions, *slopes)
        return tuple(_term_text(e, names, "{}^{}", int(not alike)) for e in self.exponents)

    @property
    def is_polynomial(self) -> bool:
        """Whether terms are products of the variables alone."""
        return self.exponents.shape[1] == self.d

    @cached_property
    def implicit(self) -> Bools:
        """Which terms hold a slope, bool, shape (l,); none, unless the law is a fraction."""
        return np.asarray(self.exponents[:, self.d + len(self.functions) :].any(axis=1))

    @cached_property
    def timed(self) -> bool:
        """Whether the last variable is the time, of which functions are terms: ``dt/dt = 1``."""
        constant = (self.exponents.sum(axis=1) == 0).astype(float)
        named = bool(self.functions) and self.names[-1] == CLOCK
        return named and bool((self.coefficients[:, -1] == constant).all())

    @property
    def states(self) -> int:
        """How many variables there are besides the time."""
        return self.d - self.timed

    @cached_property
    def order(self) -> int:
        """2 if the second half of the variables are the velocities of the first, else 1.

        Velocities are named like vx, and the first half of the law is ``dx/dt = vx``. The time is
        not counted.
        """
        m = self.states // 2
        if self.names[m : self.states] != velocity_names(self.names[:m]):
            return 1
        tied = (self.exponents[:, : self.d] @ np.arange(self.d))[:, None] == np.arange(m, 2 * m)
        tied &= self.exponents.sum(axis=1)[:, None] == 1
        return 2 if (self.coefficients[:, :m] == tied).all() and tied.any(axis=0).all() else 1

    @property
    def support(self) -> Bools:
        """Where a coefficient is not zero, bool, shape (l, d)."""
        return self.coefficients != 0

    @cached_property
    def _own(self) -> PolynomialSystem:
        """The same without functions that it has not: they may be infinite."""
        used = self.support.any(axis=1) | self.is_polynomial
        return replace(self, exponents=self.exponents[used], coefficients=self.coefficients[used])

    @cached_property
    def _closed(self) -> tuple[Ints, Floats]:
        """Exponents and coefficients in a library that is closed under a shift of the origin."""
        exponents = closure(self.exponents)
        coefficients = np.zeros((len(exponents), self.d))
        coefficients[places_of(self.exponents, exponents)] = self.coefficients
        return exponents, coefficients

    def library(self, x: Floats) -> Floats:
        """Candidate terms ``phi(x)``: (n, d) points to (n, l) values; slopes are the law's."""
        return law_terms(self._points(x), self.functions, self.exponents, self.coefficients)[0]

    def __call__(self, x: Floats) -> Floats:
        """Time derivative at ``x``, shape (n, d) or (d,), in state units per time unit."""
        x = check_array("x", x, self.names)
        return (self._own.library(np.atleast_2d(x)) @ self._own.coefficients).reshape(x.shape)

    def gradient(self, x: Floats) -> Floats:
        """Jacobian of the right-hand side.

        Parameters
        ----------
        x : ndarray, shape (n, d) or (d,)
            Points.

        Returns
        -------
        ndarray, shape (n, d, d) or (d, d)
            ``[..., j, i]`` is the derivative of equation j with respect to variable i.
        """
        x = check_array("x", x, self.names)
        points, (exponents, law) = self._points(np.atleast_2d(x)), self._own._closed
        _, _, jacobian = linearised(points, self.functions, exponents, law)
        return jacobian.reshape(*x.shape, self.d)

    def shift(self, offset: Sequence[float] | Floats) -> PolynomialSystem:
        """The same motion seen from a shifted origin, exactly (paper: Eq. 10).

        If x(t) solves this system, x(t) + offset solves the returned one.

        Parameters
        ----------
        offset : array_like, shape (d,)
            Shift of the trajectory, in state units.

        Raises
        ------
        ValueError
            If the shift is not zero, and the law holds functions of the state, or the denominator
            of a fraction vanishes at the new origin.
        """
        shift = check_vector("offset", offset, self.d, self.names)
        moves = all(function.of_time for function in self.functions)
        if shift[self.states :].any() or (shift.any() and not moves):
            raise ValueError(
                f"offset: must be zero for a law with functions of the state, got {shown(offset)}"
            )
        exponents, closed = self._closed
        matrix = shift_matrix(exponents, shift)
        shifted = matrix @ closed
        # What cancels in exact arithmetic must not survive as a term of 1e-16.
        shifted[np.abs(shifted) <= 1e-13 * (np.abs(matrix) @ np.abs(closed))] = 0.0
        # A slope by itself belongs to the constant of a denominator, which is 1.
        slopes = exponents[:, self.d + len(self.functions) :].any(axis=1)
        slopes &= exponents.sum(axis=1) == 1
        below = 1 - shifted[slopes].sum(axis=0)
        if (np.abs(below) <= 1e-13).any():
            raise ValueError(f"offset: no denominator may vanish there, got {shown(offset)}")
        shifted[slopes] = 0.0
        return replace(self, exponents=exponents, coefficients=shifted / below)

    def simulate(self, t: Floats, x0: Floats) -> Floats:
        """Integrate from ``x0`` at ``t[0]`` with an adaptive 8th-order Runge-Kutta method.

        The path is the same to the last digit on every machine; see `integrate`.

        Parameters
        ----------
        t : array_like, shape (n,)
            Increasing, finite times.
        x0 : array_like, shape (d,)
            State at ``t[0]``; the time itself, if it is a variable, may be left out.

        Returns
        -------
        ndarray, shape (n, d)
            The trajectory; rows after a blow-up are NaN, or where it is too stiff to follow.

        Raises
        ------
        ValueError
            If the times do not increase, a time or a number of the state is not finite, or an input
            is not known at a time.
        """
        return self.followed(t, x0)[0]

    def followed(self, t: Floats, x0: Floats) -> tuple[Floats, str]:
        """The path that `simulate` finds, and what happens at its end; empty if it has all rows."""
        t = check_times(t)
        if self.timed and np.shape(x0) != (self.d,):
            x0 = np.append(check_vector("x0", x0, self.states, self.names[:-1]), t[0])
        x0, clock = check_vector("x0", x0, self.d, self.names), np.zeros(self.d)
        driven, since = self.driven(), t - t[0]
        if self.timed:
            if abs(x0[-1] - t[0]) > 1e-6 * (since[-1] or 1.0):
                raise ValueError(f"x0: its time must be that of t, {t[0]:g}, got {x0[-1]:g}")
            x0[-1], clock[-1] = 0.0, t[0]  # counted from the first, times are exact
        # A step ends where an input has a kink, just before it jumps, and just after.
        breaks = [one.breaks for one in driven.values() if isinstance(one, Input)]
        times = np.unique(np.concatenate([t, *breaks]))
        times = times[(t[0] <= times) & (times <= t[-1])]
        between = (times[1:] + times[:-1]) / 2, np.linspace(t[0], t[-1], 1000)
        self.check_inputs(np.concatenate([times, *between]))
        at = [jumps(one, times) - t[0] for one in driven.values()]
        just = 2e-9 * np.diff(times).max(initial=0.0)
        before = [np.maximum(one - just, 0) for one in at]
        every = np.unique(np.concatenate([times - t[0], *at, *before]))
        fraction, size = bool(self.implicit.any()), self.d + len(self.functions)
        above = sums(self.exponents[~self.implicit, :size], self.coefficients[~self.implicit])
        below = sums(self.exponents[self.implicit, :size], self.coefficients[self.implicit])

        def rate(x: Floats) -> Floats:
            z = extended((x + clock)[None], self.functions)[0]
            if not fraction:
                return above(z)
            with np.errstate(divide="ignore", invalid="ignore"):  # at a pole the path ends
                return above(z) / (1 - below(z))

        farthest = 1e8 * (1 + np.abs(x0).max())
        path, end = integrate(rate, every, x0, farthest)
        return path[np.searchsorted(every, since)] + clock, end

    def driven(self) -> dict[str, Callable[[Floats], Floats]]:
        """The inputs and the functions of the time alone that the law has, each of times (n,)."""
        used = self.exponents[self.support.any(axis=1), self.d :].sum(axis=0)
        found: dict[str, Callable[[Floats], Floats]] = {}
        for k in np.flatnonzero(used[: len(self.functions)]).tolist():
            if (function := self.functions[k]).of_time:
                found[function.name] = partial(function.at, d=self.d)
            found |= function.inputs
        return found

    def check_inputs(self, t: Floats) -> None:
        """Refuse times (n,) at which an input in the law is not known."""
        for name, value in self.driven().items():
            unknown = ~np.isfinite(value(t))
            if unknown.any():
                raise ValueError(f"t: must lie where {name} is known, got {t[unknown][0]:g}")

    def sides(self) -> dict[int, str]:
        """What stands left in text, by number of equation: ``dx/dt``, or ``x''`` of order 2."""
        if self.order == 1:
            return {j: f"d{name}/dt" for j, name in enumerate(self.names[: self.states])}
        m = self.states // 2
        return {m + j: f"{name}''" for j, name in enumerate(self.names[:m])}

    def text(self, digits: int = 4) -> str:
        """The equations as lines of plain text, e.g. ``dx/dt = -10 x + 10 y``.

        Of a law of second order its accelerations, e.g. ``x'' = -30 x - 0.25 vx``.
        """
        return "\n".join(
            f"{side} = {self._right(j, self.factors, digits, '({}) / ({})', ' ')}"
            for j, side in self.sides().items()
        )

    def _right(self, j: int, terms: Sequence[str], digits: int, fraction: str, times: str) -> str:
        """The right-hand side of an equation, given terms without slopes and how it is written."""
        column = self.coefficients[:, j]
        check_integer("digits", digits, 1)
        above = sum_text(np.where(self.implicit, 0.0, column), terms, digits, times)
        below = np.where(self.implicit, -column, 0.0)
        if not below.any():
            return above
        return fraction.format(above, sum_text(below, terms, digits, times, "1"))

    def latex(self, digits: int = 4) -> str:
        """The equations as a LaTeX ``aligned`` block (without surrounding dollar signs)."""
        names = tuple(map(name_latex, self.names))
        left = [rf"\dot{{{name}}}" for name in names]
        if self.order == 2:
            m = self.states // 2
            names = (*names[:m], *left[:m], *names[2 * m :])
            left[m : 2 * m] = [rf"\ddot{{{name}}}" for name in names[:m]]
        names += tuple(function.latex for function in self.functions)
        terms = [_term_text(e, names, "{}^{{{}}}", 0) for e in self.exponents]
        rows = (
            f"{left[j]} &= " + self._right(j, terms, digits, r"\frac{{{}}}{{{}}}", r"\,")
            for j in self.sides()
        )
        return "\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}"

    def __str__(self) -> str:
        return self.text()

    def _repr_latex_(self) -> str:
        return f"${self.latex()}$"

    def _points(self, x: Floats) -> Floats:
        x = check_array("x", x, self.names)
        if x.ndim != 2 or x.shape[1] != self.d:
            raise ValueError(f"x: must have shape (n, {self.d}), got {x.shape}")
        return x


def parse_term(term: str, names: tuple[str, ...]) -> tuple[int, ...]:
    """The powers of the named factors in a term such as ``x^2 y``."""
    if not isinstance(term, str) or not term.strip():
        raise ValueError(f"term: must be '1' or a product of the variables {names}, got {term!r}")
    exponents = dict.fromkeys(names, 0)
    rest = "" if term.strip() == "1" else term.replace("**", "^").replace("*", " ").strip()
    longest_first = "|".join(sorted(map(re.escape, names), key=len, reverse=True))
    factor = re.compile(rf"({longest_first})(?:\s*\^\s*(\d+))?\s*")
    if factor.sub("", rest):
        raise ValueError(f"term: must be a product of the variables {names}, got {term!r}")
    for name, power in factor.findall(rest):
        exponents[name] += int(power or 1)
    return tuple(exponents.values())


def _term_text(exponents: Ints, names: tuple[str, ...], power: str, letters: int) -> str:
    """A monomial as text, given how a power is written; a blank beside names of more letters.

    Factors beyond those that have names are left out.
    """
    text, before = "", ""
    for name, e in zip(names, exponents, strict=False):
        if e:
            apart = text and max(len(before), len(name.rstrip("'"))) > letters
            text += (" " if apart else "") + (name if e == 1 else power.format(name, e))
            before = name.rstrip("'")
    return text or "1"


def sum_text(
    coefficients: Floats, terms: Sequence[str], digits: int, times: str, text: str = ""
) -> str:
    """A sum of terms as text, after what comes before it."""
    # The highest monomials last, the constant first in the library: print it the way it is read.
    for row in sorted(np.flatnonzero(coefficients).tolist(), key=lambda r: terms[r] == "1"):
        value, term = coefficients[row], terms[row]
        number = f"{abs(value):.{digits}g}"
        size = number if term == "1" else term if number == "1" else f"{number}{times}{term}"
        sign = "-" if value < 0 else "+"
        text += f" {sign} {size}" if text else (f"-{size}" if value < 0 else size)
    return text or "0"


def place(law: PolynomialSystem, entry: int) -> str:
    """Name of an entry of the coefficients, counted equation by equation."""
    equation, term = divmod(int(entry), len(law.terms))
    return f"{spoken(law, term, equation)} in d{law.names[equation]}/dt"


def spoken(law: PolynomialSystem, term: int, equation: int) -> str:
    """A term within a sentence, where a 1 would be read as a number."""
    constant = "the constant" if law.support[term, equation] else "a constant"
    return constant if law.terms[term] == "1" else law.terms[term]


# --------------------------------------------------------------------------------------------------
# The form of a law before it is searched: its variables, its candidate terms, and what is known.
#
# A law of second order, ``x'' = f(x, x')``, is one of first order in positions and velocities. The
# velocities are states that nobody has measured, and their half of the law is known: ``x' = v``.
# So is the time, if there are inputs: a last state, with ``t' = 1``.

OTHERS = "..."  #: All terms of an equation that are not named.


@dataclass(frozen=True, eq=False)
class Form:
    """What a law of ``d`` equations in ``l`` terms may look like.

    Parameters
    ----------
    names : tuple of str
        Of the d state variables: first those that were measured, then their velocities, and last
        the time, as far as a law has them.
    exponents : ndarray of int, shape (l, d + k) or (l, 2 d + k)
        The library: with every term all that divides it. Slopes are variables, too, if the law may
        be a fraction.
    functions : tuple of Function, length k
        Of the state, in the units of the data.
    candidates : ndarray of bool, shape (l, d)
        Terms that are searched.
    known : ndarray, shape (l, d)
        Coefficients that are given, in the units of the data; zero where a term is a candidate.
    movable : ndarray of bool, shape (d,)
        Coordinates whose origin is unknown. What is known does not change when it moves.
    shared : ndarray of int, shape (l d,)
        Of each place in the coefficients, equation by equation, whose value it has: its own, but
        for the directions of a vector, which all have that of the first.
    """

    names: tuple[str, ...]
    exponents: Ints
    functions: tuple[Function, ...]
    candidates: Bools
    known: Floats
    movable: Bools
    shared: Ints

    @classmethod
    def of(
        cls, coordinates: tuple[str, ...], library: Library, order: int = 1, origin: str = "learn"
    ) -> Form:
        """A law in all terms of a library, for named coordinates that were measured."""
        measured, names = len(coordinates), coordinates
        if order == 2:
            names += velocity_names(coordinates)
        states = len(names)  # those that an equation is sought or known of
        if library.timed(names):
            names += (CLOCK,)
        d = len(names)
        wanted, functions = library.resolve(names, measured)
        velocities = np.eye(wanted.shape[1], dtype=int)[measured:states]
        exponents = closure(np.concatenate([wanted, velocities]))
        known = np.zeros((len(exponents), d))
        known[places_of(velocities, exponents), np.arange(len(velocities))] = 1.0
        known[0, states:] = 1.0
        candidates, sought = np.zeros(known.shape, dtype=bool), slice(states - measured, states)
        candidates[places_of(wanted, exponents), sought] = True
        shared, first = np.arange(candidates.size).reshape(d, -1), None
        alone = np.eye(wanted.shape[1], dtype=int)[d : d + len(functions)]
        rows = places_of(alone, exponents).tolist()
        for here, function in zip(rows, functions, strict=True):
            direction = function.direction
            if direction is None:
                continue
            equation = states - measured + direction
            candidates[here, np.arange(d) != equation] = False
            first = None if direction == 0 else first
            if _vanishes(function, d):
                candidates[here, equation] = False
                continue
            first = shared[equation, here] if first is None else first
            shared[equation, here] = first
        # A slope multiplies terms of its own equation alone.
        slopes = exponents[:, d + len(functions) :]
        candidates &= (slopes.sum(axis=1) == 0)[:, None] | (slopes > 0 if slopes.size else False)
        # A function of the state does not move with the origin, so that none is sought; and what is
        # given is so in the frame of the data.
        stays = slopes.size or not all(function.of_time for function in functions)
        still = origin == "data" or stays or library.given
        movable = (np.arange(d) < measured) & (not still)
        form = cls(names, exponents, functions, candidates, known, movable, shared.ravel())
        if library.given:
            form = form._given({of: dict(terms) for of, terms in library.given}, names[sought])
        if not form.candidates.any():
            raise ValueError("library: must leave a term to be found, got all of them given")
        check_own_names(form.law(known).terms)
        return form

    def _given(
        self, equations: dict[str, dict[str, float | None]], sought: tuple[str, ...]
    ) -> Form:
        """The same with some terms of equations given, which are among those that are sought.

        What is said of a term counts more than what is said of all others.
        """
        others: dict[int, float | None] = {}
        named: dict[int, float | None] = {}
        for equation, terms in equations.items():
            if equation not in sought:
                raise ValueError(
                    f"library: must give terms of an equation of {', '.join(sought)}, "
                    f"got {equation!r}"
                )
            j = self.names.index(equation)
            there = np.flatnonzero(self.candidates[:, j]).tolist()
            common = self.shared.reshape(self.known.shape[::-1])[j]
            if terms.get(OTHERS) is not None:
                others |= dict.fromkeys(common[there].tolist(), terms[OTHERS])
            for term, value in terms.items():
                row = self._row(term)
                if row in there:
                    if named.setdefault(int(common[row]), value) != value:
                        raise ValueError(
                            "library: a term has one coefficient, and so have the directions of a "
                            f"vector, got {named[int(common[row])]} and {value} for {term!r} in "
                            f"the equation of {equation}"
                        )
                elif term != OTHERS:
                    names = ", ".join(self.law(self.known).terms[k] for k in there)
                    raise ValueError(
                        f"library: {term!r} is no term of the equation of {equation}, which has "
                        f"{names}"
                    )
        candidates, known = self.candidates.T.copy(), self.known.T.copy()
        for entry, value in (others | named).items():
            tied = (self.shared == entry).reshape(known.shape)
            candidates[tied], known[tied] = value is None, value or 0.0
        return replace(self, candidates=candidates.T, known=known.T)

    def _row(self, term: str) -> int | None:
        """Where a term stands in the library; none if it is not there."""
        slopes = tuple(f"{name}'" for name in self.names)
        variables = (*self.names, *(function.name for function in self.functions), *slopes)
        try:
            powers = parse_term(term, variables[: self.exponents.shape[1]])
        except ValueError:
            return None
        same = (self.exponents == powers).all(axis=1)
        return int(same.argmax()) if same.any() else None

    def law(self, coefficients: Floats) -> PolynomialSystem:
        """The law with these coefficients, (l, d), in the units of the data."""
        return PolynomialSystem(self.names, self.exponents, coefficients, functions=self.functions)

    @property
    def states(self) -> int:
        """How many variables there are besides the time."""
        return self.law(self.known).states

    @property
    def implicit(self) -> Bools:
        """Which terms hold a slope, (l,)."""
        return self.law(self.known).implicit

    @property
    def degree(self) -> int:
        """The highest degree among the candidates; a function counts as a variable."""
        return int(self.exponents[self.candidates.any(axis=1)].sum(axis=1).max())

    @property
    def searched(self) -> Ints:
        """The candidates' places in the coefficients, equation by equation."""
        own = self.shared == np.arange(len(self.shared))
        return np.flatnonzero(self.candidates.T.ravel() & own)


def _vanishes(function: Function, d: int) -> bool:
    """Whether a function is zero at points of all sizes, as a vector along an axis of none."""
    rng = np.random.default_rng(0)
    sizes = 10.0 ** rng.uniform(-3, 6, (64, 1))
    return not function.value(sizes * rng.standard_normal((64, d))).any()
