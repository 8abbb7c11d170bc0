"""Laws that are the same at every place: no force, a constant one, drag along the velocity.

Of one throw, coordinates and velocities are affine in one function of the time, so that many laws
fit it alike. What sets one of them apart is that no place is special to it. Candidates are nested
by what they are invariant under, each class holding those before it: rest, a straight flight, a
constant force, drag along the velocity, and all other laws. Each leaves the less error the richer
it is; a class is the right one from the errors that it leaves up to those that the class before it
leaves, and of all classes the one that is so over the widest range of errors is taken, as
`path` takes one of the laws of a path.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from ..arrays import Bools, Floats
from .data import inflation
from .library import monomial_exponents, velocity_names
from .model import PolynomialSystem
from .problem import FALSE_ALARM
from .result import Discovery
from .smoothing import smooth

FEWEST = 6
"""Samples below which nothing is left over of a throw with drag."""
STEEP = 5.0
"""Largest drag, over one through the duration: with more, the velocity is lost at once."""
POINTS = 201
"""Points through which the curve of a law is drawn."""
COLUMNS = 3
"""Of a flight: place, velocity, force."""


@dataclass(frozen=True, eq=False)
class Flight:
    """The flight that fits best under a force ``f + k v`` that is the same at every place.

    Parameters
    ----------
    t, x : ndarray, shape (n,), (n, m)
        Of the samples; the time from their middle on.
    columns : ndarray of bool, shape (3, m)
        Which of place, velocity and force each coordinate has.
    k : float
        Growth of the velocity: below zero a drag.
    sought : bool
        Whether k was sought.
    """

    t: Floats
    x: Floats
    columns: Bools
    k: float = 0.0
    sought: bool = False

    def basis(self, t: Floats, slope: bool = False) -> Floats:
        """What place, velocity and force at time 0 add to a place, or to a velocity: (n, 3)."""
        one, k = np.ones_like(t), self.k
        growth = np.exp(k * t)
        # Series, where k t is so small that differences lose their digits.
        small = np.abs(k * t).max() < 1e-4
        first = t + k * t**2 / 2 if small else (growth - 1) / k
        second = t**2 / 2 + k * t**3 / 6 if small else (first - t) / k
        return np.column_stack([0 * one, growth, first] if slope else [one, first, second])

    @property
    def start(self) -> Floats:
        """Place, velocity and force at time 0, (3, m), by least squares."""
        basis, found = self.basis(self.t), np.zeros(self.columns.shape)
        for j, column in enumerate(self.columns.T):
            found[column, j] = np.linalg.lstsq(basis[:, column], self.x[:, j], rcond=None)[0]
        return found

    @property
    def left(self) -> Floats:
        """What is left of the samples, (n, m)."""
        return self.x - self.basis(self.t) @ self.start

    @property
    def error(self) -> float:
        """Standard deviation of single samples about it."""
        free = self.x.size - self.columns.sum() - self.sought
        return float(np.sqrt((self.left**2).sum() / max(free, 1)))

    def with_drag(self) -> Flight:
        """The same with the drag that fits best."""
        most = STEEP / np.ptp(self.t)

        def squares(k: float) -> float:
            return float((replace(self, k=k).left ** 2).sum())

        best = minimize_scalar(squares, bounds=(-most, most), method="bounded")
        return replace(self, k=float(best.x), sought=True)

    def covariance(self) -> Floats:
        """Of force and drag, (m + 1, m + 1), the errors of neighbours taken as not independent."""
        m, step = self.x.shape[1], 1e-4 / np.ptp(self.t)
        bends = (replace(self, k=self.k + step).basis(self.t) - self.basis(self.t)) / step
        places = np.flatnonzero(self.columns.T.ravel())
        design = np.zeros((m, len(self.t), COLUMNS * m + 1))
        for j in range(m):
            design[j, :, COLUMNS * j : COLUMNS * (j + 1)] = self.basis(self.t)
            design[j, :, -1] = bends @ self.start[:, j]
        free = np.append(places, COLUMNS * m) if self.sought else places
        rows = design[:, :, free].reshape(-1, len(free))
        size = self.error**2 * inflation([self.left]).max()
        whole = np.zeros((COLUMNS * m + 1,) * 2)
        whole[np.ix_(free, free)] = np.linalg.pinv(rows.T @ rows) * size
        wanted = [*range(COLUMNS - 1, COLUMNS * m, COLUMNS), COLUMNS * m]
        return whole[np.ix_(wanted, wanted)]


def homogeneous(t: Floats, x: Floats, names: tuple[str, ...]) -> Discovery | None:
    """The law of a flight, where one that is the same at every place is to be preferred.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Increasing times.
    x : ndarray, shape (n, m)
        Places. One standard error goes for all coordinates.
    names : tuple of str
        Of the coordinates.

    Returns
    -------
    Discovery or None
        Its errors hold how far the next richer law would be from it, and a warning tells where that
        fits better. None where other laws are right over a wider range of errors.

    Raises
    ------
    ValueError
        If there are fewer than six samples.
    """
    if len(x) < FEWEST:
        raise ValueError(f"x: must hold at least {FEWEST} places, got {len(x)}")
    middle = (t[0] + t[-1]) / 2
    order = np.arange(COLUMNS)[:, None] + np.zeros(x.shape[1], dtype=int)
    rest, straight, thrown = (Flight(t - middle, x, order <= k) for k in range(COLUMNS))
    classes = [rest, straight, thrown, thrown.with_drag()]
    noise = float(np.sqrt((smooth([(t, x)], np.random.default_rng(0)).noise ** 2).mean()))
    bounds = np.log([*(max(one.error, noise) for one in classes), noise])
    best = 1 + int(np.argmax(bounds[:-1] - bounds[1:]))
    if best == len(classes):  # all other laws
        return None
    if classes[best].k > 0:  # no drag: it comes nearer, which the constant force is doubted for
        best -= 1
    flight, richer = classes[best], classes[min(best + 1, len(classes) - 1)]
    covariance = flight.covariance()
    departure = _departure(flight, richer)
    if np.trace(departure) > np.trace(covariance):
        covariance = departure
    price = chi2.isf(FALSE_ALARM / (2 * x.shape[1]), df=1)
    pulled = flight.start[-1] ** 2 > price * np.diag(covariance)[:-1]
    columns = flight.columns & np.vstack([*2 * [pulled | True], pulled])
    law = replace(flight, columns=columns)
    covariance = covariance * np.outer(kept := np.append(pulled, True), kept)
    return _told(law, covariance, names, middle, _doubt(flight, richer, price))


def _departure(flight: Flight, richer: Flight) -> Floats:
    """Mean products of what force and drag of a richer law are off those of a flight."""
    away = np.append(richer.start[-1] - flight.start[-1], 0.0)
    off = richer.covariance() + np.outer(away, away)
    if not flight.sought:
        off[-1] = off[:, -1] = 0.0
    return off


def _doubt(flight: Flight, richer: Flight, price: float) -> tuple[str, ...]:
    """Whether the next richer law fits better, and what it would be."""
    if richer is flight:
        return ()
    gained = (flight.left**2).sum() - (richer.left**2).sum()
    if gained < price * richer.error**2 * inflation([richer.left]).max():
        return ()
    pull, left = np.linalg.norm(richer.start[-1]), richer.error / flight.error
    if not richer.sought:
        return (f"a constant force of {pull:.4g} would leave {100 * left:.0f} % of the errors",)
    cause = "drag" if richer.k < 0 else "it comes nearer, or the plane lies askew"
    return (
        f"one flight hardly tells its law: velocities that change by {100 * richer.k:+.3g} % in a "
        f"unit of time, beside a pull of {pull:.4g}, would leave {100 * left:.0f} % of the errors "
        f"({cause}, or the lens bends the picture); the law that is the same at every place and "
        "holds over the widest range of errors is given, its error bars hold the other",
    )


def _told(
    flight: Flight, covariance: Floats, names: tuple[str, ...], middle: float,
    doubts: tuple[str, ...],
) -> Discovery:  # fmt: skip
    """The law of a flight as a discovery; covariance (m + 1, m + 1) is that of force and drag."""
    m, exponents = len(names), monomial_exponents(2 * len(names), 1)
    row = {tuple(powers): k for k, powers in enumerate(exponents.tolist())}
    velocity = [row[tuple(powers)] for powers in np.eye(2 * m, dtype=int)[m:].tolist()]
    constant, force = row[(0,) * 2 * m], flight.start[-1]
    l, d = len(exponents), 2 * m
    coefficients, made = np.zeros((l, d)), np.zeros((d, l, m + 1))
    coefficients[velocity, np.arange(m)] = 1.0
    coefficients[constant, m:] = force
    coefficients[velocity, m + np.arange(m)] = flight.k
    for j in range(m):
        made[m + j, constant, j] = made[m + j, velocity[j], m] = 1.0
    spread = made.reshape(l * d, m + 1)
    spread = spread @ covariance @ spread.T
    system = PolynomialSystem(names + velocity_names(names), exponents, coefficients)
    shown = np.linspace(flight.t[0], flight.t[-1], POINTS)
    states = np.hstack([flight.basis(shown, slope) @ flight.start for slope in (False, True)])
    error = np.sqrt((flight.left**2).mean(axis=0))
    return Discovery(
        system=system, native=system, offset=np.zeros(d), covariance=spread,
        native_covariance=spread, offset_errors=np.zeros(d),
        noise=np.append(error, np.full(m, np.nan)), model_error=np.zeros(d), warnings=doubts,
        path=((),) * d, history=(), curves=(make_interp_spline(shown + middle, states, k=3),),
        absent=np.full((l, d, 2), np.nan),
        note="order 2: of laws that one flight cannot tell apart, the one that is the same "
        "everywhere",
    )  # fmt: skip
