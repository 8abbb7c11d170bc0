"""Motion on a circle or a sphere: where it is, how large, and the angles that are its coordinates.

A bob on a string has three coordinates and fewer freedoms: its angles, and these obey a law.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from ..arrays import Bools, Floats
from ..checks import check_array
from .errors import inflation

ASIDE, ASTRAY = 0.1, 0.01
"""Distance of a motion from what is round, over its radius, that doubts it: of single samples, and
what neighbours have in common."""
STRAIGHT = 0.3
"""Standard error of a radius, over the radius, beyond which a motion may as well have none."""


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
    def centre_errors(self) -> Floats:
        """Standard errors of the centre, shape (d,)."""
        return np.sqrt(np.diag(self.centre_covariance))

    def __str__(self) -> str:
        shape = "circle" if len(self.axes) == 2 else "sphere"
        centre, errors = (
            ", ".join(f"{number:.{digits}g}" for number in numbers)
            for numbers, digits in ((self.centre, 6), (self.centre_errors, 2))
        )
        return "\n".join(
            [
                f"{shape} of radius {self.radius:.6g} ± {self.radius_error:.2g} about ({centre}) ± "
                f"({errors}), off by {self.distance:.2g}",
                *(f"warning: {text}" for text in self.warnings),
            ]
        )

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
    return _with_shared(_circle, _positions(x, (2, 3)), zero, systematic)


def _circle(x: Floats, zero: ArrayLike | None) -> Round:
    """The circle of checked positions."""
    seen = _seen(x)
    middle, main = _principal(x[seen])
    flat = (x[seen] - middle) @ main[:2].T
    planar, covariance = _fitted(flat)
    centre = middle + planar[:2] @ main[:2]
    errors = main[:2].T @ covariance[:2, :2] @ main[:2]
    off = np.linalg.norm(flat - planar[:2], axis=1)[:, None] - planar[2]
    if x.shape[1] == 3:
        height = (x[seen] - middle) @ main[2:].T
        errors += _height_error(flat, height, planar[:2]) * main[2:].T * main[2:]
        off = np.hstack([off, height])
    axes = _axes(x[seen] - centre, zero, main[:2])[:2]
    angle = np.full(len(x), np.nan)
    right, up = axes @ (x[seen] - centre).T
    angle[seen] = np.unwrap(np.arctan2(up, right))
    return _round(centre, planar[2], errors, covariance, off, axes, angle)


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
    return _with_shared(_sphere, _positions(x, (3,)), zero, systematic)


def _sphere(x: Floats, zero: ArrayLike | None) -> Round:
    """The sphere of checked positions."""
    seen = _seen(x)
    ball, covariance = _fitted(x[seen])
    away = x[seen] - ball[:3]
    off = np.linalg.norm(away, axis=1)[:, None] - ball[3]
    axes = _axes(away, zero, np.eye(3))
    a, b, c = axes @ away.T
    angle = np.full((len(x), 2), np.nan)
    angle[seen, 0] = np.unwrap(np.arctan2(b, a))
    angle[seen, 1] = np.arctan2(c, np.hypot(a, b))
    return _round(ball[:3], ball[3], covariance[:3, :3], covariance, off, axes, angle)


def _with_shared(
    fit: Callable[[Floats, ArrayLike | None], Round],
    x: Floats,
    zero: ArrayLike | None,
    systematic: ArrayLike | None,
) -> Round:
    """What is fitted to positions, and what each error that they share makes of it."""
    found = fit(x, zero)
    if systematic is None:
        return found
    errors = check_array("systematic", systematic)
    if (
        errors.ndim != 3
        or errors.shape[1:] != x.shape
        or not np.isfinite(errors[:, _seen(x)]).all()
    ):
        raise ValueError(
            f"systematic: must be finite, of shape (k, {len(x)}, {x.shape[1]}), got {errors.shape}"
        )
    moved = [fit(x + error, found.axes[0] if zero is None else zero) for error in errors]
    shape = (len(moved), len(x), found.angle.size // len(x))
    turned = np.array([other.angle - found.angle for other in moved]).reshape(shape)
    centres = np.array([other.centre - found.centre for other in moved]).reshape(-1, x.shape[1])
    radii = np.array([other.radius - found.radius for other in moved])
    return replace(
        found,
        centre_covariance=found.centre_covariance + centres.T @ centres,
        radius_error=float(np.sqrt(found.radius_error**2 + (radii**2).sum())),
        systematic=turned - 2 * np.pi * np.round(turned / (2 * np.pi)),
    )


def _round(
    centre: Floats, radius: float, errors: Floats, covariance: Floats, off: Floats,
    axes: Floats, angle: Floats,
) -> Round:  # fmt: skip
    distance = float(np.sqrt((off**2).sum(axis=1).mean()))
    shared = float(np.sqrt(max((off[1:] * off[:-1]).sum(axis=1).mean(), 0.0)))
    shape = "circle" if len(axes) == 2 else "sphere"
    doubts: list[str] = []
    if distance > ASIDE * radius or shared > ASTRAY * radius:
        doubts.append(
            f"the motion may be on no {shape}: it is off by {100 * distance / radius:.2g} % of the "
            f"radius, of which neighbours share {100 * shared / radius:.2g} %"
        )
    radius_error = float(np.sqrt(covariance[-1, -1]))
    if radius_error > STRAIGHT * radius:
        doubts.append(
            f"the motion may be on no {shape}: it hardly bends, so that the radius is known to "
            f"{100 * radius_error / radius:.0f} % alone"
        )
    return Round(
        centre=centre,
        radius=float(radius),
        centre_covariance=errors,
        radius_error=radius_error,
        distance=distance,
        axes=axes,
        angle=angle,
        warnings=tuple(doubts),
    )


def _seen(x: Floats) -> Bools:
    """Which rows of positions were seen."""
    return np.asarray(np.isfinite(x).all(axis=1))


def _positions(x: ArrayLike, dimensions: tuple[int, ...]) -> Floats:
    """Checked positions."""
    x = check_array("x", x)
    if x.ndim != 2 or x.shape[1] not in dimensions:
        wanted = " or ".join(f"(n, {d})" for d in dimensions)
        raise ValueError(f"x: must have shape {wanted}, got {x.shape}")
    seen = _seen(x).sum()
    if seen < x.shape[1] + 3:
        raise ValueError(f"x: must hold at least {x.shape[1] + 3} positions, got {seen}")
    return x


def _principal(x: Floats) -> tuple[Floats, Floats]:
    """The mean of points, and their principal directions (d, d), the widest first."""
    middle = x.mean(axis=0)
    spread, directions = np.linalg.eigh(np.cov((x - middle).T))
    if not spread[-2] > 1e-18 * spread[-1]:
        raise ValueError("x: must not lie on a line: a line has no centre")
    return middle, directions.T[::-1]


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

    The sign of each but the first is such that its largest component is positive.
    """
    first = away.mean(axis=0) if zero is None else check_array("zero", zero)
    if first.shape != away.shape[1:] or not np.isfinite(first).all():
        raise ValueError(f"zero: must be {away.shape[1]} finite numbers, got {zero!r:.60}")
    within = span.T @ (span @ first)
    length = np.linalg.norm(within)
    if not length > 1e-6 * np.linalg.norm(first):
        raise ValueError(f"zero: must be a direction in the plane of the circle, got {zero!r:.60}")
    first = within / length
    rest = away @ (span.T @ span)
    rest = rest - np.outer(rest @ first, first)
    _, directions = np.linalg.eigh(rest.T @ rest)
    others = directions.T[::-1][: len(span) - 1]
    signs = np.sign(others[np.arange(len(others)), np.abs(others).argmax(axis=1)])
    return np.vstack([first, others * signs[:, None]])
