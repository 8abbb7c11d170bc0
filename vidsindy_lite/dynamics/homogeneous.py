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
from scipy.optimize import least_squares
from scipy.special import chdtri, exprel, fdtri

from ..arrays import Bools, Floats, Ints
from .bspline import smooth
from .collocation import CLEANEST
from .data import check_trajectory, inflation
from .library import monomial_exponents, velocity_names
from .mechanics import Quantity
from .model import PolynomialSystem
from .noise import GROSS
from .problem import FALSE_ALARM, SURE
from .result import Discovery, Plateau


@dataclass(frozen=True, eq=False)
class Flight:
    """The flight that fits best under a force ``f + k v`` that is the same at every place.

    Parameters
    ----------
    theta : ndarray, shape (3 m + 1,)
        Place, velocity and f at time 0, and k: below zero a drag.
    free : ndarray of bool, shape (3 m + 1,)
        Which of these were sought; the others are zero.
    covariance : ndarray, shape (3 m + 1, 3 m + 1)
        The errors of neighbours taken as not independent.
    left : ndarray, shape (n, m)
        What is left of the samples.
    """

    theta: Floats
    free: Bools
    covariance: Floats
    left: Floats

    @classmethod
    def fitted(cls, t: Floats, x: Floats, free: Bools) -> Flight:
        """By least squares to samples (n, m), as many as ``free`` tells."""
        most = 5 / np.ptp(t)  # with more drag the velocity is lost at once

        def whole(values: Floats) -> Floats:
            theta = np.zeros(len(free))
            theta[free] = values
            return theta

        def left(values: Floats) -> Floats:
            return (x - places(t, whole(values))).ravel()

        bound = np.where(np.arange(len(free)) < len(free) - 1, np.inf, most)[free]
        found = least_squares(left, np.zeros(free.sum()), "3-point", (-bound, bound), x_scale="jac")
        errors = found.fun.reshape(x.shape)
        size = (errors**2).sum() / max(errors.size - free.sum(), 1) * inflation([errors]).max()
        covariance = np.zeros((len(free),) * 2)
        covariance[np.ix_(free, free)] = np.linalg.pinv(found.jac.T @ found.jac) * size
        return cls(whole(found.x), free, covariance, errors)

    def moved(self, t: Floats, x: Floats, modes: Floats) -> Floats:
        """What errors that all samples share, (k, n, m), do to its numbers, (k, 3 m + 1)."""
        moved = [Flight.fitted(t, x + mode, self.free).theta - self.theta for mode in modes]
        return np.reshape(moved, (-1, len(self.theta)))

    def freed(self, t: Floats, x: Floats, modes: Floats, noise: float) -> Flight:
        """The same, less what the errors that all samples share, (k, n, m), leave of samples.

        Their sizes are the likeliest beside samples of some noise; of the scale, for one, any
        motion would be an error, were it large enough.
        """
        fits = [Flight.fitted(t, x + mode, self.free) for mode in modes]
        bends = np.reshape([fit.left - self.left for fit in fits], (len(modes), x.size))
        likely = bends @ bends.T + noise**2 * np.eye(len(modes))
        sizes = np.clip(np.linalg.solve(likely, bends @ self.left.ravel()), -3, 3)
        return replace(self, left=self.left - (sizes @ bends).reshape(self.left.shape))

    @property
    def error(self) -> float:
        """Standard deviation of single samples about it."""
        return float(np.sqrt((self.left**2).sum() / max(self.left.size - self.free.sum(), 1)))


def places(t: Floats, theta: Floats, slope: bool = False) -> Floats:
    """Where a flight of these numbers is, (n, m), or how fast."""
    start, velocity, force = np.split(theta[:-1], 3)
    z = theta[-1] * t
    first = t * exprel(z)  # the integral of exp(k t)
    if slope:
        return np.outer(np.exp(z), velocity) + np.outer(first, force)
    near = np.abs(z) < 1e-4  # there the difference has lost its digits, and the series has not
    second = t**2 * np.where(near, 0.5 + z / 6, (exprel(z) - 1) / np.where(near, 1.0, z))
    return start + np.outer(first, velocity) + np.outer(second, force)


def coefficients_of(theta: Floats, exponents: Ints) -> Floats:
    """The law of a flight in terms of these exponents, (l, 2 m)."""
    force = np.split(theta[:-1], 3)[2]
    velocities = exponents[:, len(force) :]
    pull = np.outer(exponents.sum(axis=1) == 0, force) + theta[-1] * velocities
    return np.hstack([velocities, pull])


def homogeneous(
    t: Floats, x: Floats, names: tuple[str, ...], systematic: Floats | None = None
) -> Discovery | None:
    """The law of a flight, where one that is the same at every place is to be preferred.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Increasing times.
    x : ndarray, shape (n, m)
        Places. One standard error goes for all coordinates.
    names : tuple of str
        Of the coordinates.
    systematic : ndarray, shape (k, n, m), optional
        Errors that all places share, see `discover`.

    Returns
    -------
    Discovery or None
        Its errors hold how far the next richer law would be from it, and a warning tells where that
        fits better. None where other laws are right over a wider range of errors.

    Raises
    ------
    ValueError
        If there are fewer than six samples, all are alike, or as `check_trajectory` says.
    """
    t, x = check_trajectory(t, x)
    if len(x) < 6:  # nothing is left over of a throw with drag
        raise ValueError(f"x: must hold at least 6 places, got {len(x)}")
    if not np.ptp(x, axis=0).any():
        raise ValueError("x: must hold a motion, got one that stands still")
    m, middle = x.shape[1], (t[0] + t[-1]) / 2
    since, numbers = t - middle, np.arange(3 * m + 1)
    classes = [Flight.fitted(since, x, numbers < count) for count in (m, 2 * m, 3 * m, 3 * m + 1)]
    modes = np.zeros((0, *x.shape)) if systematic is None else systematic
    noise = float(np.sqrt((smooth([(t, x)], np.random.default_rng(0)).noise ** 2).mean()))
    bounds = np.array([*(max(one.error, noise) for one in classes), noise])
    best = 1 + int(np.argmax(bounds[:-1] / bounds[1:]))
    if best == len(classes):  # all other laws
        return None
    if classes[best].theta[-1] > 0:  # no drag: it comes nearer; the constant force is doubted
        best -= 1
    flight, richer = classes[best], classes[min(best + 1, len(classes) - 1)]
    # Mean products of what the numbers of the richer law are off those of this one.
    apart = richer.theta - flight.theta
    covariance = (richer.covariance + np.outer(apart, apart)) * np.outer(flight.free, flight.free)
    # A scale, however wrong it is, makes no force of nothing: what is along the numbers themselves.
    moved, own = flight.moved(since, x, modes), flight.theta / np.linalg.norm(flight.theta)
    moved -= np.outer(moved @ own, own)
    shared, penalty = moved.T @ moved, chdtri(1, FALSE_ALARM / (2 * m))

    def told(errors: Floats) -> Bools:
        return flight.theta**2 > penalty * np.diag(errors)

    kept = flight.free & (told(covariance + shared) | (numbers < 2 * m))
    law = Flight.fitted(since, x, kept)
    moved = law.moved(since, x, modes)
    covariance = covariance + moved.T @ moved
    found = _told(law, covariance * np.outer(kept, kept), t, names)
    spread, classes[best] = np.linalg.norm(x.std(axis=0)), law
    supports = [coefficients_of(one.theta, found.system.exponents) != 0 for one in classes]
    path = tuple(
        tuple(
            Plateau(j, bounds[k] / spread, bounds[k - 1] / spread, supports[k][:, j])
            for k in range(len(classes) - 1, 0, -1)
            if bounds[k] < bounds[k - 1]
        )
        for j in range(found.system.d)
    )
    exact = flight.error < CLEANEST * x.std()  # digits are what is left
    dropped = (flight.free & ~kept & told(flight.covariance + shared)).any()

    def doubts(flight: Flight, richer: Flight, law: Flight) -> tuple[str, ...]:
        said = () if exact else _doubt(flight, richer, penalty) or _bent(since, x, flight)
        if dropped:
            said = said or _doubt(law, flight, penalty)
        return said or _misfit(x, flight, noise)

    # What errors that all samples share may leave of them is no reason to doubt.
    freed = (one.freed(since, x, modes, noise) for one in (flight, richer, law))
    unsure = doubts(flight, richer, law) and doubts(*freed)
    return replace(found, warnings=unsure, path=path)


def _doubt(flight: Flight, richer: Flight, penalty: float) -> tuple[str, ...]:
    """Whether the next richer law fits better, and what it would be."""
    gained = (flight.left**2).sum() - (richer.left**2).sum()
    if richer is flight or gained < penalty * richer.error**2 * inflation([richer.left]).max():
        return ()
    force, k = np.split(richer.theta[:-1], 3)[2], richer.theta[-1]
    pull, left = np.linalg.norm(force), richer.error / flight.error
    if not k:
        return (f"a constant force of {pull:.4g} would leave {100 * left:.0f} % of the errors",)
    cause = "drag" if k < 0 else "it comes nearer, or the plane lies askew"
    return (
        f"one flight hardly tells its law: velocities that change by {100 * k:+.3g} % in a unit of "
        f"time, beside a pull of {pull:.4g}, would leave {100 * left:.0f} % of the errors "
        f"({cause}, or the lens bends the picture); the law that is the same at every place and "
        "holds over the widest range of errors is given, its error bars hold the other",
    )


def _bent(t: Floats, x: Floats, flight: Flight) -> tuple[str, ...]:
    """Whether the path bends as no such force makes it: by the third and fourth power of time."""
    powers = np.vander(t / np.ptp(t), 5)
    left = x - powers @ np.linalg.lstsq(powers, x, rcond=None)[0]
    more, rest = 5 * x.shape[1] - int(flight.free.sum()), max(x.size - 5 * x.shape[1], 1)
    square = (left**2).sum() / rest
    gained = ((flight.left**2).sum() - (left**2).sum()) / more / inflation([flight.left]).max()
    if gained < square * fdtri(more, rest, 1 - SURE):
        return ()
    share = 100 * np.sqrt(square) / flight.error
    return (
        f"the path bends as no force does that is the same everywhere: two powers of the time more "
        f"would leave {share:.0f} % of the errors (the target may be held, or its errors smooth)",
    )


def _misfit(x: Floats, flight: Flight, noise: float, most: float = 5.0) -> tuple[str, ...]:
    """Whether it leaves far more than the path scatters from one sample to the next, or jumps.

    Noise whose autocorrelation from one to the next is .9 leaves 3 to 4 times as much.
    """
    steps = np.abs(np.diff(flight.left, axis=0))
    # Of normal errors the median of a difference's size is .954 of their standard deviation.
    typical = np.sqrt((np.median(steps, axis=0) ** 2).mean()) / 0.954
    scatter = max(float(typical), CLEANEST * float(x.std()))
    if flight.error < most * min(scatter, noise) and steps.max() < 2 * GROSS * scatter:
        return ()
    return (
        f"a flight leaves {flight.error:.3g}, and the path scatters by {scatter:.3g} from sample "
        "to sample: something else pulls, the track jumps or lacks frames, or errors are smooth",
    )


def _told(law: Flight, covariance: Floats, t: Floats, names: tuple[str, ...]) -> Discovery:
    """The law of a flight as a discovery."""
    exponents = monomial_exponents(2 * len(names), 1)
    coefficients = coefficients_of(law.theta, exponents)
    system = PolynomialSystem(names + velocity_names(names), exponents, coefficients)
    still = coefficients_of(0 * law.theta, exponents)
    rates = [(coefficients_of(one, exponents) - still).T.ravel() for one in np.eye(len(law.theta))]
    spread = np.transpose(rates) @ covariance @ rates
    shown = np.linspace(t[0], t[-1], 201)  # enough for a smooth curve
    m, middle = len(names), (t[0] + t[-1]) / 2
    moves, since = slice(m, 2 * m), shown - middle
    speed = Quantity.of(f"velocity at t = {middle:.4g}", law.theta[moves], covariance[moves, moves])
    states = np.hstack([places(since, law.theta, slope) for slope in (False, True)])
    noise = np.append(np.sqrt((law.left**2).mean(axis=0)), np.full(m, np.nan))
    nothing = np.zeros(system.d)
    return Discovery(
        system=system, native=system, offset=nothing, covariance=spread, native_covariance=spread,
        offset_errors=nothing, noise=noise, model_error=nothing, warnings=(), path=(), history=(),
        curves=(make_interp_spline(shown, states, k=3),),
        absent=np.full((*coefficients.shape, 2), np.nan),
        note="order 2: of laws that one flight cannot tell apart, the one that is the same "
        f"everywhere; {speed}",
    )  # fmt: skip
