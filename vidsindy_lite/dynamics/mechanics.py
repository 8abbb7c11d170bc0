"""Laws of motion of a body: named numbers, circles and spheres with their angles, and swings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import cumulative_simpson
from scipy.interpolate import BSpline
from scipy.optimize import least_squares

from ..arrays import Floats
from ..checks import check_array, check_vector, shown
from .data import inflation
from .l0 import LEAST
from .library import extended
from .model import PolynomialSystem, with_error

# --------------------------------------------------------------------------------------------------
# What a law of motion says of a body: gravity and drag, or springs and periods; and its energy.
#
# Each number is a function of the law's coefficients, and their covariance is carried through to
# it to first order (the delta method).

FAINT = 1e-6  #: Share of the largest entry of a matrix below which an entry is rounding.
POINTS = 1001  #: Points of a curve at which forces and energy are looked at.

#: When numbers of small swings, of which a law with powers was fitted to large ones, are right.
IMITATED = "if its powers imitate no other force, as cubics do a sine"

NAME = "angle"  #: Of the coordinate of what moves on a circle.


@dataclass(frozen=True, eq=False)
class Quantity:
    """A number or a vector with a name.

    Parameters
    ----------
    name : str
    value, error : ndarray, shape () or (m,)
        In units of the data, per unit mass; its standard error, if the law is the right one.
    """

    name: str
    value: Floats
    error: Floats

    @classmethod
    def of(cls, name: str, value: Floats, covariance: Floats) -> Quantity:
        """With the errors of a covariance of its entries."""
        variance = np.diag(np.atleast_2d(covariance))
        error = np.sqrt(np.maximum(variance, 0.0)).reshape(np.shape(value))
        return cls(name, np.asarray(value), error)

    def __str__(self) -> str:
        text, power = with_error(self.value, float(self.error.max()), ".4g")
        return f"{self.name} = ({text})e{power}" if power else f"{self.name} = {text}"


@dataclass(frozen=True, eq=False)
class Physics:
    """What a law of motion says of a body, as in ``found.physics()["g"].value``.

    Parameters
    ----------
    quantities : tuple of Quantity
        Of a body whose forces are the same everywhere: ``g``, its ``direction``, ``drag``, and
        ``quadratic drag``. Of one that is pulled back to a place of ``rest``, or, without
        that, along some axes: ``spring constant``, ``damping``, ``natural frequency`` (in radians)
        and ``period`` of small swings about it, unless they grow fast, of each coordinate, as in
        ``period x``, or where coordinates pull at each other of each mode, as in ``period 1``, the
        slowest first.
    energy : tuple of ndarray, shape (n, 2)
        Along each fitted curve, times, and the energy per unit mass over that at rest (along free
        axes, in the middle of the motion), or over that of rest where the curve begins. Empty if
        the forces have no potential.
    notes : tuple of str
        How the energy changes; what cannot be said, and why.
    """

    quantities: tuple[Quantity, ...]
    energy: tuple[Floats, ...]
    notes: tuple[str, ...]

    def __iter__(self) -> Iterator[Quantity]:
        return iter(self.quantities)

    def __getitem__(self, name: str) -> Quantity:
        for quantity in self:
            if quantity.name == name:
                return quantity
        names = ", ".join(quantity.name for quantity in self.quantities) or "nothing"
        raise KeyError(f"name: must be of what the law says ({names}), got {name!r}")

    @property
    def headline(self) -> str:
        """In one line what is not read off the equations: gravity and drag, or periods."""
        named = ("g", "pull", "direction", "drag", "quadratic drag")
        said = [str(q) for q in self if q.name.startswith(named)]
        if periods := [str(q) for q in self if q.name.startswith("period")]:
            supposed = f" ({IMITATED})" if any(IMITATED in note for note in self.notes) else ""
            said.append(f"of small swings{supposed}: {'; '.join(periods)}")
        return "; ".join(said)

    def __str__(self) -> str:
        return "\n".join([*map(str, self.quantities), *self.notes])


def physics_of(
    law: PolynomialSystem,
    covariance: Floats,
    curves: Sequence[BSpline],
    down: ArrayLike | None = None,
    force: str = "g",
) -> Physics:
    """What a law says of a body.

    Parameters
    ----------
    law : PolynomialSystem
    covariance : ndarray, shape (l d, l d)
        Of its coefficients, equation by equation.
    curves : sequence of BSpline
        The motion, velocities included.
    down : array_like, shape (m,), optional
        Direction of gravity.
    force : str
        What a constant force is called, see `Discovery`.

    Raises
    ------
    ValueError
        If ``down`` is no direction.
    """
    if down is not None:
        down = check_vector("down", down, law.d // law.order, law.names[: law.d // law.order])
        if not down.any():
            raise ValueError("down: must be a direction, got zeros only")
        down = down / np.linalg.norm(down)
    if law.order == 1:
        return Physics((), (), ("a law of first order holds no forces: order=2 looks for them",))
    unsaid = ""
    if law.timed:
        whole = law.support.sum()
        law, covariance = _without_time(law, covariance)
        if law.support.sum() < whole - 1:  # the time itself has a term, too
            unsaid = "a force changes with the time: what is said holds without it; no energy"
    times = [np.linspace(curve.t[0], curve.t[-1], POINTS) for curve in curves]
    paths = [curve(t)[:, : law.d] for curve, t in zip(curves, times, strict=True)]
    body = _Body(law, covariance, times, paths)
    if not body.force(law, body.states)[1].any():
        said = list(body.flight(down, force))
        unsaid = unsaid or ("" if force == "g" else "what bears it may rub: no energy")
    elif body.rest is not None:
        said = list(body.swing(body.rest))
    else:
        said = [
            "nothing holds it at a place near the motion, or a force jumps there: no spring "
            "constants and no periods"
        ]
    energy = [] if unsaid else body.energies(law)
    change = body.balance() if energy else "the forces have no potential: no energy"
    return Physics(
        quantities=tuple(entry for entry in said if isinstance(entry, Quantity)),
        energy=tuple(energy),
        notes=(*(entry for entry in said if isinstance(entry, str)), unsaid or change),
    )


def _without_time(law: PolynomialSystem, covariance: Floats) -> tuple[PolynomialSystem, Floats]:
    """The terms of a law that do not hold the time, its last variable, as a law of the others."""
    d, (l, width) = law.d, law.exponents.shape
    timely = [d - 1, *(d + k for k, function in enumerate(law.functions) if function.timed)]
    timely += [width - 1] if width > d + len(law.functions) else []  # the slope of the time
    rows = np.flatnonzero(~law.exponents[:, timely].any(axis=1))
    calm = PolynomialSystem(
        law.names[:-1], np.delete(law.exponents[rows], timely, axis=1), law.coefficients[rows, :-1],
        functions=tuple(function for function in law.functions if not function.timed),
    )  # fmt: skip
    kept = (np.arange(d - 1)[:, None] * l + rows).ravel()
    return calm, covariance[np.ix_(kept, kept)]


@dataclass(frozen=True, eq=False)
class _Body:
    """A law of motion and what is known of it.

    Parameters
    ----------
    law : PolynomialSystem
    covariance : ndarray, shape (l d, l d)
    times : list of ndarray, shape (n,)
        Of each curve that was seen.
    paths : list of ndarray, shape (n, 2 m)
        Places and velocities there.
    """

    law: PolynomialSystem
    covariance: Floats
    times: list[Floats]
    paths: list[Floats]

    @cached_property
    def states(self) -> Floats:
        """All places and velocities that were seen, (n, 2 m)."""
        return np.concatenate(self.paths)

    @property
    def m(self) -> int:
        """How many coordinates the body has."""
        return self.law.d // 2

    @cached_property
    def axes(self) -> list[str]:
        """What tells the coordinates apart in names; nothing, if there is but one."""
        return [f" {name}" for name in self.law.names[: self.m]] if self.m > 1 else [""]

    @cached_property
    def quadratic(self) -> list[tuple[int, int]]:
        """The terms ``|v| v``, and along which coordinate."""
        law, velocity = self.law, self.states[:, self.m :]
        drag = np.linalg.norm(velocity, axis=1)[:, None] * velocity
        values = extended(self.states, law.functions)[:, law.d :]
        near = 1e-9 * np.abs(drag).max()
        alone = law.exponents.sum(axis=1) == 1
        return [
            (row, j)
            for k, column in enumerate(values.T)
            for j in range(self.m)
            if np.allclose(column, drag[:, j], rtol=1e-6, atol=near)
            for row in np.flatnonzero(alone & (law.exponents[:, law.d + k] == 1)).tolist()
        ]

    def force(self, law: PolynomialSystem, states: Floats) -> tuple[Floats, Floats, Floats]:
        """Acceleration without quadratic drag, and its derivatives in places and in velocities.

        Of shapes (n, m), (n, m, m) and (n, m, m).
        """
        coefficients = law.coefficients.copy()
        coefficients[[row for row, _ in self.quadratic]] = 0.0
        calm, m = replace(law, coefficients=coefficients), self.m
        slopes = calm.gradient(states)[:, m:]
        return calm(states)[:, m:], slopes[:, :, :m], slopes[:, :, m:]

    def at_rest(self, law: PolynomialSystem, place: Floats) -> tuple[Floats, Floats, Floats]:
        """The same of a body at rest at a place, (m,): shapes (m,), (m, m), (m, m)."""
        state = np.append(place, np.zeros(self.m))[None]
        force, stiffness, damping = self.force(law, state)
        return force[0], stiffness[0], damping[0]

    @np.errstate(divide="ignore", invalid="ignore")  # of a swing that hardly is one
    def carried(
        self, rule: Callable[[PolynomialSystem], dict[str, Floats]]
    ) -> dict[str, tuple[Floats, Floats]]:
        """What a rule makes of the law: values, each with the covariance of its entries."""
        value, flat = rule(self.law), self.law.coefficients.T.ravel()
        errors = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        free = np.flatnonzero(errors * flat)
        rates = []
        for k in free.tolist():
            step = max(1e-3 * errors[k], 1e-8 * abs(flat[k])) * (np.arange(len(flat)) == k)
            change = step.reshape(self.law.d, -1).T
            above = rule(replace(self.law, coefficients=self.law.coefficients + change))
            below = rule(replace(self.law, coefficients=self.law.coefficients - change))
            rates.append({name: (above[name] - below[name]) / (2 * step[k]) for name in value})
        covariance, found = self.covariance[np.ix_(free, free)], {}
        for name in value:
            slope = np.array([rate[name] for rate in rates]).reshape(len(free), value[name].size)
            found[name] = value[name], slope.T @ covariance @ slope
        return found

    def flight(self, down: Floats | None, name: str) -> Iterator[Quantity | str]:
        """Gravity and drag of a body on which the same forces act everywhere."""
        place = self.states[:, : self.m].mean(axis=0)
        pull, _, slowed = self.at_rest(self.law, place)

        def rule(law: PolynomialSystem) -> dict[str, Floats]:
            pull, _, slowed = self.at_rest(law, place)
            g = float(np.linalg.norm(pull) if down is None else pull @ down)
            said = {"drag": -np.diag(slowed), "quadratic drag": np.zeros(self.m)}
            for row, j in self.quadratic:
                said["quadratic drag"][j] -= law.coefficients[row, self.m + j]
            return {"g": np.array(g), "direction": pull / max(abs(g), LEAST)} | said

        said, turns = self.carried(rule), self.law.names[0] == NAME
        if not pull.any():
            yield "no constant force: no g"
        else:
            yield Quantity.of("constant torque" if turns else name, *said["g"])
            if down is None:
                yield Quantity.of("direction", *said["direction"])
        if not _diagonal(slowed):
            yield "a velocity pulls across its own direction, too: something turns the motion"
        if _diagonal(slowed + slowed.T):  # what turns a velocity does not slow it
            yield from self.drags("drag", *said["drag"])
        yield from self.drags("quadratic drag", *said["quadratic drag"])

    def drags(self, name: str, values: Floats, covariance: Floats) -> Iterator[Quantity]:
        """The drags along all coordinates, (m,): one, if they are alike within three errors."""
        variances = np.diag(covariance)
        if values.all():
            weights = 1 / variances if variances.all() else np.ones(self.m)
            weights /= weights.sum()
            apart = np.eye(self.m) - weights
            spread = np.sqrt(np.maximum(np.diag(apart @ covariance @ apart.T), 0.0))
            if (np.abs(apart @ values) <= 3 * spread + FAINT * np.abs(values)).all():
                yield Quantity.of(name, weights @ values, weights @ covariance @ weights)
                return
        for j in np.flatnonzero(values).tolist():
            yield Quantity.of(name + self.axes[j], values[j], covariance[j, j])

    @np.errstate(divide="ignore", invalid="ignore")  # of functions that have no value there
    def settled(self, law: PolynomialSystem, place: Floats) -> Floats:
        """Where no force acts on a body at rest, by Newton steps from a place, at most 20."""
        nothing = 1e-12 * np.ptp(self.states[:, : self.m], axis=0)
        for _ in range(20):
            force, slope, _ = self.at_rest(law, place)
            if not np.isfinite(slope).all():
                return np.full_like(place, np.nan)
            step = np.linalg.lstsq(slope, force, rcond=FAINT)[0]
            place = place - step
            if (np.abs(step) < nothing).all():
                break
        return np.where(np.abs(place) < nothing, 0.0, place)

    @cached_property
    def rest(self) -> Floats | None:
        """Where forces pull the body back to, no farther off than half of its range; else none.

        Along some axes they may pull it nowhere.
        """
        places = self.states[:, : self.m]
        low, high = places.min(axis=0), places.max(axis=0)
        margin = (high - low) / 2
        for start in (places.mean(axis=0), places[-1]):
            place = self.settled(self.law, start)
            near = (place > low - margin) & (place < high + margin)
            if near.all() and not self.jumps(place):
                held, ways = np.linalg.eig(-self.at_rest(self.law, place)[1])
                most, free = held.real.max(), np.abs(held) <= FAINT * held.real.max()
                # Where they pull nowhere, they do so at all places.
                slopes = self.force(self.law, self.states)[1] @ ways[:, free]
                if held.real[~free].min(initial=most) > 0 and (abs(slopes) <= FAINT * most).all():
                    return place
        return None

    def jumps(self, place: Floats) -> bool:
        """Whether a force is another close by, as dry friction: its slope is of no small motion."""
        still = np.append(place, np.zeros(self.m))
        beside = still + 0.01 * np.ptp(self.states[:, : 2 * self.m], axis=0)
        _, *slopes = self.force(self.law, np.stack([still, beside]))
        here, there = np.concatenate(slopes, axis=2)
        return not np.abs(there - here).max() < 0.5 * np.abs(here).max()

    def swing(self, rest: Floats) -> Iterator[Quantity | str]:
        """Springs, damping and periods about a place of rest."""
        _, pull, slowed = self.at_rest(self.law, rest)
        alone = _diagonal(pull) and _diagonal(slowed)
        labels = self.axes if alone else [f" {k + 1}" for k in range(self.m)]
        rates = _swings(-pull, -slowed, alone)
        # Slow growth is no other period: that of a limit cycle differs by a part in four hundred.
        leaves, stiff = rates.real > 0.1 * np.abs(rates), np.abs(pull).max()
        free = np.diag(pull) == 0 if alone else np.abs(rates) ** 2 <= FAINT * stiff
        swings = (rates.imag > FAINT * np.abs(rates)) & ~leaves & ~free

        def rule(law: PolynomialSystem) -> dict[str, Floats]:
            place = self.settled(law, rest)
            _, pull, slowed = self.at_rest(law, place)
            said = {} if free.any() else {"rest": place}
            rates = _swings(-pull, -slowed, alone)
            for j, (label, rate) in enumerate(zip(labels, rates, strict=True)):
                if alone:
                    said[f"spring constant{label}"] = -pull[j, j]
                if alone or swings[j]:
                    lost = np.abs(rate.real) > 1e-12 * np.abs(rate)  # and not by rounding
                    said[f"damping{label}"] = -2 * rate.real * lost
                if swings[j]:
                    said[f"natural frequency{label}"] = np.abs(rate)
                    said[f"period{label}"] = 2 * np.pi / rate.imag
            return said

        for name, (value, covariance) in self.carried(rule).items():
            if np.isfinite(covariance).all():
                yield Quantity.of(name, value, covariance)
            else:
                yield f"no {name}: by its errors it may as well creep back to rest"
        powers = self.law.exponents[self.law.support.any(axis=1), : self.m].sum(axis=1)
        if self.law.is_polynomial and powers.max() > 1:
            yield f"of small swings, {IMITATED}: else name that with library="
        for j in np.flatnonzero(~swings).tolist():
            why = "what is near rest leaves it" if leaves[j] else "it creeps back to rest"
            yield f"no period{labels[j]}: {'nothing pulls it back' if free[j] else why}"

    def balance(self) -> str:
        """How the energy changes along paths, by more than its errors and a share that is none."""
        most = float((self.states[:, self.m :] ** 2).sum(axis=1).max()) / 2

        def changes(law: PolynomialSystem) -> dict[str, Floats]:
            levels = [pair[:, 1] / most for pair in self.energies(law)]
            rises = [(level - np.minimum.accumulate(level)).max() for level in levels]
            falls = [level[0] - level[-1] for level in levels]
            return {"rise": np.max(rises, initial=0.0), "fall": np.max(falls, initial=0.0)}

        said, share = self.carried(changes), "of the largest kinetic energy"
        (rise, rises), (fall, falls) = said["rise"], said["fall"]
        if rise > (kept := max(1e-3, 3 * float(np.sqrt(rises[0, 0])))):
            return (
                f"the energy rises by {100 * rise:.3g} % {share}: it is driven, or a force is wrong"
            )
        if fall > max(1e-3, 3 * float(np.sqrt(falls[0, 0]))):
            return f"the energy falls by {100 * fall:.3g} % {share}, and never rises"
        return f"the energy is kept, to {100 * kept:.2g} % {share}"

    def energies(self, law: PolynomialSystem) -> list[Floats]:
        """Times and energies along paths; none if the forces at rest have no potential.

        Their curl is then a twentieth of their gradients, which errors of coefficients do not make.
        """

        def still(places: Floats) -> tuple[Floats, Floats]:
            return self.force(law, np.hstack([places, np.zeros_like(places)]))[:2]

        _, slopes = still(self.states[:, : self.m])
        twist = slopes - slopes.transpose(0, 2, 1)
        if (twist**2).mean() > 0.05**2 * (slopes**2).mean():
            return []
        found = []
        for t, path in zip(self.times, self.paths, strict=True):
            places, velocity = path[:, : self.m], path[:, self.m :]
            power = (still(places)[0] * velocity).sum(axis=1)
            stored = -cumulative_simpson(power, x=t, initial=0.0)
            if self.rest is not None:
                away, share = places[0] - self.rest, np.linspace(0, 1, POINTS)
                pull = still(self.rest + share[:, None] * away)[0] @ away
                stored -= cumulative_simpson(pull, x=share)[-1]
            found.append(np.stack([t, stored + (velocity**2).sum(axis=1) / 2], axis=1))
        return found


def _swings(stiffness: Floats, damping: Floats, alone: bool) -> NDArray[np.complex128]:
    """Decay and rotation of each coordinate, if it is alone, or of each mode, as complex rates."""
    m = len(stiffness)
    if alone:
        half = np.diag(damping) / 2
        return -half + 1j * np.sqrt(np.maximum(np.diag(stiffness) - half**2, 0.0))
    pair = np.block([[np.zeros((m, m)), np.eye(m)], [-stiffness, -damping]])
    rates = np.array(sorted(np.linalg.eigvals(pair), key=abs))
    turning, real = rates[rates.imag > 0], rates[rates.imag == 0]  # of two real ones the slower
    both = np.append(turning, real[: m - len(turning)])
    return both[np.argsort(np.abs(both))]


def _diagonal(matrix: Floats) -> bool:
    """Whether nothing but rounding is beside the diagonal."""
    beside = matrix - np.diag(np.diag(matrix))
    return bool((np.abs(beside) <= FAINT * np.abs(matrix).max()).all())


# --------------------------------------------------------------------------------------------------
# Motion on a circle or a sphere: where it is, how large, and the angles that are its coordinates.
#
# A bob on a string has three coordinates and fewer freedoms: its angles, and these obey a law.


@dataclass(frozen=True, eq=False)
class Round:
    """A circle or a sphere, and a motion on it.

    Parameters
    ----------
    centre : ndarray, shape (d,)
    radius : float
        In units of the data: the length of a pendulum.
    centre_covariance : ndarray, shape (d, d)
        Of the errors of the centre.
    radius_error : float
        Standard error of the radius.
    distance : float
        Root mean square distance of the motion from it, in units of the data.
    axes : ndarray, shape (2, d) or (3, 3)
        Unit vectors: where the angle is zero, where it grows; of a sphere, the direction of the
        second angle as well.
    angle : ndarray, shape (n,) or (n, 2)
        Where the motion is, in radians, without leaps; NaN where it was not seen. On a sphere,
        longitude and latitude about the first axis.
    warnings : tuple of str
        Why the motion may be on no circle or sphere; empty if nothing was found.
    systematic : ndarray, shape (k, n, 1) or (k, n, 2), optional
        What the errors that all positions share make of the angle, for ``discover``.
    """

    centre: Floats
    radius: float
    centre_covariance: Floats
    radius_error: float
    distance: float
    axes: Floats
    angle: Floats
    warnings: tuple[str, ...]
    systematic: Floats | None = None

    @property
    def shape(self) -> str:
        """``"circle"`` or ``"sphere"``."""
        return "circle" if len(self.axes) == 2 else "sphere"

    @property
    def centre_errors(self) -> Floats:
        """Standard errors of the centre, shape (d,)."""
        return np.sqrt(np.diag(self.centre_covariance))

    def __str__(self) -> str:
        centre = ", ".join(f"{number:.6g}" for number in self.centre)
        errors = ", ".join(f"{error:.2g}" for error in self.centre_errors)
        radius = f"{self.shape} of radius {self.radius:.6g} ± {self.radius_error:.2g}"
        said = f"{radius} about ({centre}) ± ({errors}), off by {self.distance:.2g}"
        return "\n".join([said, *(f"warning: {text}" for text in self.warnings)])

    __repr__ = __str__


def on_circle(
    x: ArrayLike, zero: ArrayLike | None = None, systematic: ArrayLike | None = None
) -> Round:
    """Fit a circle to a motion, in the plane or in space, and give its angle.

    Parameters
    ----------
    x : array_like, shape (n, 2) or (n, 3)
        Positions; a row with a NaN is missing.
    zero : array_like, shape (2,) or (3,), optional
        Direction from the centre in which the angle is zero, such as downwards; by default the
        mean direction of the motion.
    systematic : array_like, shape (k, n, d), optional
        Errors that all positions share, as `discover` takes them: they count in the errors of the
        circle, and `Round.systematic` passes them on.

    Returns
    -------
    Round
        With ``angle`` of shape (n,): ``discover(t, circle.angle[:, None], order=2)``.

    Raises
    ------
    ValueError
        If ``x`` or ``systematic`` has another shape or too few rows, lies on a line, or ``zero`` is
        no direction in the plane of the circle.

    Examples
    --------
    >>> swing = vl.on_circle(seen.x, zero=(0, 0, -1), systematic=seen.systematic)
    >>> print(swing.radius, swing.radius_error)
    """
    return _with_shared(x, zero, systematic, False)


def on_sphere(
    x: ArrayLike, zero: ArrayLike | None = None, systematic: ArrayLike | None = None
) -> Round:
    """Fit a sphere to a motion in space, and give its two angles.

    Parameters
    ----------
    x : array_like, shape (n, 3)
        Positions; a row with a NaN is missing.
    zero : array_like, shape (3,), optional
        Direction from the centre in which both angles are zero, such as downwards; by default the
        mean direction of the motion.
    systematic : array_like, shape (k, n, 3), optional
        See `on_circle`.

    Returns
    -------
    Round
        With ``angle`` of shape (n, 2): longitude and latitude about that direction, the longitude
        along the widest swing.

    Raises
    ------
    ValueError
        If ``x`` or ``systematic`` has another shape or too few rows, or lies in a plane.
    """
    return _with_shared(x, zero, systematic, True)


def _with_shared(
    positions: ArrayLike, zero: ArrayLike | None, systematic: ArrayLike | None, sphere: bool
) -> Round:
    """What is fitted to positions, and what each error that they share makes of it."""
    x = check_array("x", positions)
    dimensions = (3,) if sphere else (2, 3)
    if x.ndim != 2 or x.shape[1] not in dimensions:
        wanted = " or ".join(f"(n, {d})" for d in dimensions)
        raise ValueError(f"x: must have shape {wanted}, got {x.shape}")
    (n, d), seen = x.shape, np.isfinite(x).all(axis=1)
    if seen.sum() < d + 3:
        raise ValueError(f"x: must hold at least {d + 3} positions, got {seen.sum()}")
    found = _round(x, zero, sphere)
    if systematic is None:
        return found
    errors = check_array("systematic", systematic)
    if errors.ndim != 3 or errors.shape[1:] != x.shape or not np.isfinite(errors[:, seen]).all():
        raise ValueError(f"systematic: must be finite, of shape (k, {n}, {d}), got {errors.shape}")
    moved = [_round(x + error, found.axes[0] if zero is None else zero, sphere) for error in errors]
    shape = (len(moved), n, found.angle.size // n)
    turned = np.array([other.angle - found.angle for other in moved]).reshape(shape)
    centres = np.array([other.centre - found.centre for other in moved]).reshape(-1, d)
    radii = np.array([other.radius - found.radius for other in moved])
    return replace(
        found,
        centre_covariance=found.centre_covariance + centres.T @ centres,
        radius_error=float(np.sqrt(found.radius_error**2 + (radii**2).sum())),
        systematic=turned - 2 * np.pi * np.round(turned / (2 * np.pi)),
    )


def _round(x: Floats, zero: ArrayLike | None, sphere: bool) -> Round:
    """The sphere of checked positions, or the circle in the plane of their main directions.

    Doubted if it is a tenth of its radius off, or neighbours share a hundredth, or hardly bent.
    """
    seen = np.isfinite(x).all(axis=1)
    middle = x[seen].mean(axis=0)
    place, span, across = x[seen] - middle, np.eye(x.shape[1]), np.empty((0, x.shape[1]))
    if not sphere:
        spread, directions = np.linalg.eigh(np.cov(place.T))
        if not spread[-2] > 1e-18 * spread[-1]:
            raise ValueError("x: must not lie on a line: a line has no centre")
        span, across = np.split(directions.T[::-1], [2])
    flat, height = place @ span.T, place @ across.T
    (*at, radius), covariance = _fitted(flat)
    centre, errors = at @ span, span.T @ covariance[:-1, :-1] @ span
    off = np.hstack([np.linalg.norm(flat - at, axis=1)[:, None] - radius, height])
    if height.size:
        errors += _height_error(flat, height, np.array(at)) * across.T * across
    axes = _axes(place - centre, zero, span)
    right, up, *above = axes @ (place - centre).T
    angle = np.full((len(x), len(axes) - 1), np.nan)
    angle[seen, 0] = np.unwrap(np.arctan2(up, right))
    if sphere:
        angle[seen, 1] = np.arctan2(above[0], np.hypot(right, up))
    error, distance = (float(np.sqrt(e)) for e in (covariance[-1, -1], (off**2).sum(axis=1).mean()))
    shared = float(np.sqrt(max((off[1:] * off[:-1]).sum(axis=1).mean(), 0.0)))
    doubts = []
    if distance > 0.1 * radius or shared > 0.01 * radius:
        doubts.append(
            f"it is off by {100 * distance / radius:.2g} % of the radius, of which neighbours "
            f"share {100 * shared / radius:.2g} %"
        )
    if error > 0.3 * radius:
        known = f"the radius is known to {100 * error / radius:.0f} % alone"
        doubts.append(f"it hardly bends, so that {known}")
    shape = "sphere" if sphere else "circle"
    return Round(
        centre=middle + centre,
        radius=float(radius),
        centre_covariance=errors,
        radius_error=error,
        distance=distance,
        axes=axes,
        angle=angle if sphere else angle[:, 0],
        warnings=tuple(f"the motion may be on no {shape}: {doubt}" for doubt in doubts),
    )


def _fitted(x: Floats) -> tuple[Floats, Floats]:
    """Centre and radius of the circle or sphere closest to points, (d + 1,), and covariance.

    From the linear problem ``|x|^2 = 2 c x + r^2 - |c|^2`` (Kasa) by Gauss-Newton on distances.
    """
    middle, size = x.mean(axis=0), x.std()
    u = (x - middle) / size
    linear = np.hstack([2 * u, np.ones((len(u), 1))])
    start = np.linalg.lstsq(linear, (u**2).sum(axis=1), rcond=None)[0]
    start[-1] = np.sqrt(max(start[-1] + start[:-1] @ start[:-1], 1e-12))

    def distance(p: Floats) -> Floats:
        return np.linalg.norm(u - p[:-1], axis=1) - p[-1]

    def slope(p: Floats) -> Floats:
        away = p[:-1] - u
        return np.hstack([away / np.linalg.norm(away, axis=1)[:, None], -np.ones((len(u), 1))])

    fit = least_squares(distance, start, jac=slope, method="lm", xtol=1e-14, ftol=1e-14)
    information = fit.jac.T @ fit.jac
    if not np.linalg.cond(information) < 1e12:
        raise ValueError("x: must not be flat: what has no curvature has no centre")
    variance = (fit.fun**2).sum() / (len(u) - len(start)) * inflation([fit.fun[:, None]])[0]
    fit.x[:-1] = fit.x[:-1] * size + middle
    fit.x[-1] *= size
    return fit.x, np.linalg.inv(information) * variance * size**2


def _height_error(flat: Floats, height: Floats, place: Floats) -> float:
    """Variance of the height of a plane at a place, from points (n, 2) and their heights (n, 1)."""
    design = np.hstack([np.ones((len(flat), 1)), flat])
    left = height - design @ np.linalg.lstsq(design, height, rcond=None)[0]
    variance = float((left**2).sum() / (len(left) - 3)) * float(inflation([left])[0])
    row = np.append(1.0, place)
    return float(row @ np.linalg.solve(design.T @ design, row)) * variance


def _axes(away: Floats, zero: ArrayLike | None, span: Floats) -> Floats:
    """Orthonormal directions in a span (k, d): the first towards zero, then by how wide the motion.

    The largest component of each but the first is positive. On a circle the angle grows from the
    earlier to the later axis of the coordinate plane next to it, as from x to y.
    """
    first = away.mean(axis=0) if zero is None else check_vector("zero", zero, away.shape[1])
    within = span.T @ (span @ first)
    length = np.linalg.norm(within)
    if not length > 1e-6 * np.linalg.norm(first):
        raise ValueError(f"zero: must be a direction in the plane of the circle, got {shown(zero)}")
    first = within / length
    rest = away @ (span.T @ span)
    rest = rest - np.outer(rest @ first, first)
    _, directions = np.linalg.eigh(rest.T @ rest)
    others = directions.T[::-1][: len(span) - 1]
    told, both = others, np.vstack([first, others])
    if len(span) == 2:
        pairs = map(list, combinations(range(len(first)), 2))
        told = np.linalg.det([both[:, pair] for pair in pairs])[None]
    signs = np.sign(told[np.arange(len(told)), np.abs(told).argmax(axis=1)])
    return np.vstack([first, others * signs[:, None]])
