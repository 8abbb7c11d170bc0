"""Spline-enhanced sparse regression: a noisy trajectory goes in, the governing equations come out.

The objective is the paper's (Eqs. 8-9): data loss of a cubic B-spline, physics loss at collocation
points, a price per term. What differs is how it is minimised: banded Gauss-Newton steps with the
curve eliminated (`collocation`), a search over supports in the small algebra that remains
(`selection`), the offset as the origin in which the law is sparsest (`frames`), a physics weight
that is raised until the law holds exactly, and an error that is tolerated (`path`). Nothing is set
by hand per system.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations, product
from math import comb
from typing import cast

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import block_diag, eigh
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from ..arrays import Bools, Floats, Ints
from ..checks import check_array, check_choice, check_integer, check_number, check_positive
from .bspline import DEGREE, WIDTH
from .collocation import Fit, Linearisation
from .data import (
    Trajectory,
    check_sigma,
    check_systematic,
    check_trajectories,
    check_trajectory,
    coordinate_names,
)
from .diagnostics import is_on_circle
from .inference import conclude, with_errors
from .l0 import inverse
from .library import (
    Library,
    check_library,
    monomial_exponents,
    monomial_gradients,
    monomials,
    variable_names,
)
from .model import Form, PolynomialSystem, State
from .noise import foreseen, rebalanced, with_process_noise
from .path import (
    FIRST_WEIGHTS,
    ROUNDS,
    TOLERATED,
    History,
    Path,
    evidence,
    first_law,
    leaves_something_over,
    near,
    persistent,
    tightened,
    unpruned,
    views,
)
from .problem import Problem, fit_curves, pose
from .result import LIBRARY, NAME, Discovery, Swing, swinging
from .smoothing import smooth

# --------------------------------------------------------------------------------------------------
# First or second order: whether a law of motion, x'' = f(x, x'), is a better guess than x' = f(x).
#
# A body that is thrown, or hangs on a spring, passes the same place with other velocities, so that
# no law of first order holds; but its acceleration is nearly a linear function of where it is and
# how it moves. In the flows that people write down as x' = f(x) it is not.

LINEAR = 0.15
"""Share of the accelerations' squares that no linear law explains, below which they may be those of
a body. Clean flows of first order leave .26 to .64, springs and throws up to .06."""
AMBIGUOUS = 0.5
"""Share of the slopes' squares that no cubic law of first order explains, above which a place is
passed with several velocities. Flows of first order leave up to .15, with noise of 40 %."""
PASSED = 0.005
"""The same share, below which every place is passed with one velocity, so that nothing speaks for
a second order. Flows of first order outside the library leave up to .002, throws .02."""
MISFIT = 1.5
"""Errors that one law leaves over those of another, from which on it misses the data."""
DENSITY = 10
"""Points per time scale of the motion at which accelerations are looked at."""


def check_order(order: object, origin: str, library: Library) -> None:
    """Refuse what is no order of a law or no origin, or does not go with what is given of it."""
    if isinstance(order, bool | float) or order not in (1, 2, "auto"):
        raise ValueError(f"order: must be 1, 2 or 'auto', got {order!r}")
    check_choice("origin", origin, ("learn", "data"))


def accelerated(curves: Sequence[BSpline]) -> bool:
    """Whether smoothed curves look like those of a law of second order.

    The slope is no function of the place; or hardly one, and the second derivative is nearly linear
    in both.
    """
    places, slopes, bends = [], [], []
    for curve in curves:
        low, high = curve.t[DEGREE + 1], curve.t[-DEGREE - 2]  # the outermost spans bend by chance
        t = np.arange(low, high, 1 / DENSITY)
        places.append(curve(t))
        slopes.append(curve(t, 1))
        bends.append(curve(t, 2))
    x, v, a = (np.concatenate(parts) for parts in (places, slopes, bends))
    linear = np.hstack([np.ones((len(x), 1)), x, v])
    cubic = monomials(x, monomial_exponents(x.shape[1], 3))
    several = unexplained(cubic, v)
    return several > AMBIGUOUS or (several > PASSED and unexplained(linear, a) < LINEAR)


def unexplained(terms: Floats, values: Floats) -> float:
    """Share of the squares of values (n, d) that no combination of terms (n, l) explains.

    NaN if there are hardly more values than terms.
    """
    if len(terms) <= 2 * terms.shape[1]:
        return np.nan
    left = values - terms @ np.linalg.lstsq(terms, values, rcond=None)[0]
    return float((left**2).sum() / (values**2).sum())


def better(first: Discovery, second: Discovery) -> Discovery:
    """The one of two laws of the same positions that is to be trusted, where the first is doubtful.

    The second order, if the first misses the data; or if the second is beyond doubt and has no more
    terms.
    """
    m = first.system.states
    terms, others = (
        int(native.support[:, begin : begin + m].sum())
        for native, begin in ((first.native, 0), (second.native, m))
    )
    if (first.noise[:m] > MISFIT * second.noise[:m]).any():
        return replace(second, note="order 2: the law of order 1 misses the data")
    if not second.warnings and others <= terms:
        cause = f"the law of order 1 is doubtful and has {terms} terms, not {others}"
        return replace(second, note=f"order 2: {cause}")
    doubt = "is doubtful, too" if second.warnings else f"has {others} terms, not {terms}"
    return replace(first, note=f"order 1: the law of order 2 {doubt}")


# --------------------------------------------------------------------------------------------------
# The axes in which a polynomial law is sparsest, for paths of which nobody knows how they lie.
#
# A rotation of the axes, like a shift of their origin, maps polynomials of one degree onto each
# other, exactly. So all terms are fitted once, and the estimate, with its covariance, is looked at
# in other axes, where the number of terms that differ from zero is minimised; see `origin`, which
# does the same for shifts.

STARTS = 20
"""Random orientations from which the sparsest is sought."""
KEPT = 3
"""Most orientations that are worth a discovery."""
COARSE, FINE = 0.1, 0.01
"""Sizes of a standard coefficient at which it counts: while seeking, and at the end."""
LEFT_OVER = 0.05
"""Standard coefficients below this may be what axes that are not quite right leave."""
ALIKE = np.deg2rad(2.0)
"""Orientations that differ by less are one."""
MODES = 40
"""Most directions of uncertainty that are looked at: the largest."""
SLIGHTEST = 1e-10
"""Least variance over the largest, in units of their own, that is no rounding."""
POINTS = 3
"""Points at which two polynomials are compared, over the number of their terms."""
CHOSEN = 1e-8
"""Share of what a turn changes that a law's terms cannot make up for: if less, it is a choice."""


@dataclass(frozen=True, eq=False)
class TurnedLaw:
    """An estimate of all terms of a law of m coordinates, to be looked at in other axes.

    Parameters
    ----------
    exponents : ndarray of int, shape (l, m) or (l, 2 m)
        All monomials up to a degree, of places, or of places and velocities.
    estimates : ndarray, shape (1 + k, l, m)
        Coefficients in axes of one unit, and the directions in which they are uncertain, each one
        standard error long.
    origin : ndarray, shape (m,)
        Where the fit had its origin, in these axes, around the middle of the data.
    """

    exponents: Ints
    estimates: Floats
    origin: Floats

    @classmethod
    def of(cls, problem: Problem, fit: Fit) -> TurnedLaw:
        """The quadratic model around a fit, in all terms; the unit is the spread of the data."""
        state, m = fit.state, problem.measured[0][1].shape[1]
        rows = _rows(fit)
        columns = np.flatnonzero((problem.form.candidates & rows[:, None]).T)
        model = fit.collocation.linearise(state, columns)
        flat = state.flat()[columns] + model.newton()[0]
        values, axes = np.linalg.eigh(inverse(model.information))
        directions = (axes * np.sqrt(np.maximum(values, 0.0))).T
        stacked = np.vstack([flat, directions]).reshape(-1, m, rows.sum())
        scale, unit = problem.units.scale, _unit(problem)
        origin = (state.offset * scale / unit)[:m]
        law = cls(problem.exponents[rows], np.moveaxis(stacked, 1, 2), origin)
        law = law._mapped(np.diag(unit / scale), -state.offset, np.diag((scale / unit)[-m:]))
        flat = law.estimates[1:].reshape(len(directions), -1)
        _, sizes, largest = np.linalg.svd(flat, full_matrices=False)
        modes = (sizes[:, None] * largest).reshape(-1, *law.estimates.shape[1:])
        return replace(law, estimates=np.concatenate([law.estimates[:1], modes]))

    def _mapped(self, inward: Floats, origin: Floats, outward: Floats) -> TurnedLaw:
        """The law of ``outward f(inward y + origin)``, compared at points enough."""
        count, d = self.exponents.shape
        y = np.random.default_rng(0).uniform(-1, 1, (POINTS * count, d))
        values = monomials(y @ inward.T + origin, self.exponents) @ self.estimates @ outward.T
        fitted = np.linalg.pinv(monomials(y, self.exponents)) @ values
        return replace(self, estimates=fitted)

    def _places(self, origin: Floats) -> Floats:
        """An origin in space as one of the state: velocities have none."""
        return np.append(origin, np.zeros(self.exponents.shape[1] - len(origin)))

    def seen(self, turn: Floats, origin: Floats) -> tuple[Floats, Floats]:
        """Coefficients and their variances, (l, m), in axes that are the rows of ``turn``, (m, m).

        Around an origin, (m,), in the axes of the estimate.
        """
        m = len(turn)
        copies = self.exponents.shape[1] // m
        law = self._mapped(block_diag(*[turn.T] * copies), self._places(origin), turn)
        return law.estimates[0], (law.estimates[1:] ** 2).sum(axis=0)

    def descended(self, turn: Floats, origin: Floats, size: float) -> tuple[float, Floats, Floats]:
        """The nearest orientation and origin with fewest terms, and their smoothed number.

        A coefficient counts ``log(1 + z^2)``, with ``z`` over its standard error and a size.
        """
        m = len(turn)

        def scores(step: Floats) -> Floats:
            estimate, variance = self.seen(turned(step[:-m], m) @ turn, origin + step[-m:])
            return (estimate / np.sqrt(variance + size**2)).ravel()

        free = m * (m - 1) // 2 + m
        best = least_squares(scores, np.zeros(free), loss="cauchy", max_nfev=60)
        return float(best.cost), turned(best.x[:-m], m) @ turn, origin + best.x[-m:]

    def freed(self, support: Bools) -> Floats:
        """The small turn, (m, m), after which only these terms, (l, m), are left, if they are all.

        The others are made as small as their covariance asks for, while the origin gives way.
        """
        m, home = len(self.origin), self.origin
        law = self._mapped(np.eye(self.exponents.shape[1]), self._places(home), np.eye(m))
        others = ~support
        directions = law.estimates[1:][:, others]
        sizes = np.maximum(np.linalg.norm(directions, axis=0), np.finfo(float).tiny)
        values, axes = np.linalg.eigh((directions / sizes).T @ (directions / sizes))
        whiten = axes / np.sqrt(np.maximum(values, SLIGHTEST * values[-1]))

        def scores(step: Floats) -> Floats:
            estimate, _ = self.seen(turned(step[:-m], m), home + step[-m:])
            return (estimate[others] / sizes) @ whiten

        best = least_squares(scores, np.zeros(m * (m - 1) // 2 + m), x_scale="jac", max_nfev=60)
        return turned(best.x[:-m], m)


def rough_orientations(problem: Problem, rng: np.random.Generator) -> list[Floats]:
    """Orientations in which fits of all terms up to a degree look sparse, for degrees as needed."""
    collocation = problem.collocation(problem.segments())
    control, history = fit_curves(collocation, problem.curves), History()
    degrees = problem.exponents.sum(axis=1)
    found: list[Floats] = []
    for degree in range(1, problem.form.degree + 1):
        fit, weight = unpruned(problem, collocation, control, degrees <= degree, history)
        if weight < FIRST_WEIGHTS[-1]:  # too many terms for these data
            continue
        for turn in sparse_orientations(TurnedLaw.of(problem, fit), found, rng):
            if all(apart(turn, other) > ALIKE for other in found):
                found.append(turn)
        if not leaves_something_over(problem, fit):
            break
    return found


def refined(problem: Problem, fit: Fit) -> Floats:
    """The small turn, (m, m), after which the small terms of a law are not needed any more.

    Axes that are off by a fraction of a degree leave small terms, which clean data tell. The law is
    fitted without them, and the axes are those in which all that it lacks is nothing.
    """
    state, units = fit.state, problem.units
    unit = replace(units, scale=_unit(problem))
    sizes = state.coefficients * units.factors(problem.exponents) / unit.factors(problem.exponents)
    state, collocation = state.of_terms(state.active & (np.abs(sizes) > LEFT_OVER)), fit.collocation
    if not state.active.any():
        return np.eye(problem.measured[0][1].shape[1])
    fit = tightened(problem, collocation, state)
    law = TurnedLaw.of(problem, fit)
    return law.freed(fit.state.active[_rows(fit)][:, -len(law.origin) :])


def with_turns(problem: Problem, fit: Fit) -> Linearisation:
    """The quadratic model around a fit, with small turns of its axes eliminated.

    Axes in which terms are absent were learned from these: so what a law with the same terms in
    axes near by explains as well is not known. A turn that the law's own terms can make up for is
    no unknown but a choice of axes, which stay.
    """
    model = problem.model(fit)
    turns = _turns(problem, fit.state)[model.columns]
    own = np.flatnonzero(fit.state.free()[model.columns])
    told = model.information @ turns
    gain = inverse(model.information[np.ix_(own, own)]) @ told[own]
    whole = turns.T @ told
    least = CHOSEN * np.trace(whole) * np.eye(len(whole))  # turns that change nothing have a share
    shares, directions = eigh(whole - told[own].T @ gain, whole + least)
    turns = turns @ directions[:, shares > CHOSEN]
    told = model.information @ turns
    share = told @ np.linalg.pinv(turns.T @ told, hermitian=True)
    return replace(
        model,
        information=model.information - share @ told.T,
        gradient=model.gradient - share @ (turns.T @ model.gradient),
    )


def _turns(problem: Problem, state: State) -> Floats:
    """What small turns about the origin of the data change in a law, along `State.flat`, (k, r).

    With the generator K of a turn it is ``K f(x) - f'(x) K x``.
    """
    m, scale, exponents = problem.measured[0][1].shape[1], problem.units.scale, problem.exponents
    y = np.random.default_rng(0).uniform(-1, 1, (POINTS * len(exponents), problem.d))
    values, law = monomials(y, exponents), state.coefficients + problem.known
    slopes = np.einsum("nlk,lj->njk", monomial_gradients(y, exponents), law)
    changes = []
    for i, j in combinations(range(m), 2):
        generator = np.zeros((m, m))
        generator[[i, j], [j, i]] = 1.0, -1.0
        turn = np.kron(np.eye(problem.d // m), generator) * scale / scale[:, None]
        moved = np.einsum("njk,nk->nj", slopes, (y + state.offset - problem.home) @ turn.T)
        change = np.linalg.pinv(values) @ (values @ law @ turn.T - moved)
        changes.append(np.append(change.T, np.zeros(problem.d)))
    return np.column_stack(changes)


def _rows(fit: Fit) -> Bools:
    """Terms, (l,), up to the highest degree of a law: these are mixed by turns and shifts."""
    degrees = fit.collocation.exponents.sum(axis=1)
    return np.asarray(degrees <= degrees[fit.state.active.any(axis=1)].max())


def _unit(problem: Problem) -> Floats:
    """One unit of length for all coordinates, and one for all velocities, (d,)."""
    m, scale = problem.measured[0][1].shape[1], problem.units.scale
    return np.repeat(np.sqrt(np.mean(scale.reshape(-1, m) ** 2, axis=1)), m)


def turned(angles: Floats, m: int) -> Floats:
    """A rotation of m axes, (m, m), by an angle, or by a vector of three."""
    vector = angles if m == 3 else np.append([0, 0], angles)
    return Rotation.from_rotvec(vector).as_matrix()[:m, :m]


def sparse_orientations(
    law: TurnedLaw, known: Sequence[Floats], rng: np.random.Generator
) -> list[Floats]:
    """Orientations, (m, m), in which a law has fewest terms, distinct, best first.

    Sought from those that are known, from the data's own, and from random ones.
    """
    law, m = replace(law, estimates=law.estimates[: 1 + MODES]), law.estimates.shape[2]
    home = np.zeros(m)
    starts = [*known, np.eye(m), *(random_turn(m, rng) for _ in range(STARTS))]
    coarse = sorted((law.descended(turn, home, COARSE) for turn in starts), key=lambda f: f[0])
    found: list[Floats] = []
    fine = [law.descended(turn, origin, FINE) for _, turn, origin in coarse[: 2 * KEPT]]
    for _, turn, _ in sorted(fine, key=lambda f: f[0]):
        near = nearest(turn)
        if all(apart(near, other) > ALIKE for other in found):
            found.append(near)
    return found[:KEPT]


def random_turn(m: int, rng: np.random.Generator) -> Floats:
    """A rotation of two or three axes, (m, m), any as likely."""
    if m == 3:
        return Rotation.random(random_state=rng).as_matrix()
    return Rotation.from_euler("z", rng.uniform(0, 2 * np.pi)).as_matrix()[:2, :2]


def apart(turn: Floats, other: Floats) -> float:
    """Largest angle between the axes of two orientations, by whatever name and sign."""
    return float(np.arccos(np.clip(np.abs(turn @ other.T).max(axis=1), 0, 1)).max())


def nearest(turn: Floats) -> Floats:
    """The same axes in the order and with the signs that are nearest to the data's own."""
    m = len(turn)
    rows = (
        np.array(signs)[:, None] * turn[list(order)]
        for order in permutations(range(m))
        for signs in product([1.0, -1.0], repeat=m)
    )
    return max((axes for axes in rows if np.linalg.det(axes) > 0), key=np.trace)


# --------------------------------------------------------------------------------------------------
# A discovery in the axes in which the law is sparsest, where nobody knows how the path lies.

MOST_TURNS = 3
"""Most times that a discovery tells the axes better, in which the next is made."""

Solved = tuple[Discovery, Problem, Fit]
Measured = tuple[list[Trajectory], list[Floats], list[Floats] | None]
"""Trajectories, their systematic errors, and their standard errors if they are known."""


def check_orientation(orientation: str, library: Library, d: int, origin: str) -> None:
    """Refuse what is no orientation, or to learn one of data or candidates that have none."""
    check_choice("orientation", orientation, ("data", "learn"))
    if orientation == "data":
        return
    if d not in (2, 3):
        raise ValueError(f"orientation: can be learned of two or three coordinates, got {d}")
    form = Form.of(variable_names(d), library)
    whole = len(form.exponents) == comb(d + form.degree, d) and form.candidates.all()
    if not whole or form.functions or library.given or library.timed(form.names):
        raise ValueError(
            "orientation: can be learned only among all polynomials up to a degree, got "
            f"library={library}"
        )
    if origin != "learn":
        raise ValueError(f"orientation: can be learned only with origin='learn', got {origin!r}")


def in_sparsest_axes(
    own: Discovery,
    pose: Callable[[Floats], Problem],
    solve: Callable[[Floats], Solved],
    rng: np.random.Generator,
) -> Discovery:
    """The law in the axes in which it has fewest terms: its own if no others have fewer.

    Parameters
    ----------
    own : Discovery
        In the axes of the data.
    pose, solve : callable
        The problem, and its solution, in axes that are the rows of (m, m).
    rng : numpy.random.Generator
        For the starts of the search.
    """
    starts = rough_orientations(pose(np.eye(own.system.states // own.system.order)), rng)
    best = min((_settled(turn, solve) for turn in starts), key=_rank, default=own)
    if _terms(best) < _terms(own):
        return replace(best, note=own.note)
    said = "orientation: the data's own axes, as the law has no fewer terms in any others"
    return replace(own, note="; ".join(filter(None, (own.note, said))))


def _settled(turn: Floats, solve: Callable[[Floats], Solved]) -> Discovery:
    """The law in the best axes near some; of laws alike, the one in the axes that were refined."""
    found, problem, fit = solve(turn)
    best = replace(found, orientation=turn), problem, fit
    for _ in range(MOST_TURNS):
        turn, before = refined(problem, fit) @ turn, _rank(found)
        found, problem, fit = solve(turn)
        if _rank(found) <= _rank(best[0]):
            best = replace(found, orientation=turn), problem, fit
        if _rank(found) >= before:
            break
    found, problem, fit = best
    return with_errors(found, problem, fit, with_turns(problem, fit))


def _rank(found: Discovery) -> tuple[bool, int]:
    """What is to be smallest: no warnings, then few terms."""
    return bool(found.warnings), _terms(found)


def _terms(found: Discovery) -> int:
    """Terms of a law, and axes along which its origin is moved."""
    return int(found.native.support.sum() + (found.offset != 0).sum())


def in_axes(measured: Measured, turn: Floats) -> Measured:
    """What was measured, in axes that are the rows of ``turn``, (m, m).

    A place of which a coordinate was not seen is none. The errors of two coordinates of known ones
    are taken to be independent in all axes.
    """
    trajectories, shared, sigma = measured
    whole = [np.isfinite(x).all(axis=1) for _, x in trajectories]
    paths = [(t[rows], x[rows] @ turn.T) for (t, x), rows in zip(trajectories, whole, strict=True)]
    modes = [np.einsum("ij,njk->nik", turn, s[rows]) for s, rows in zip(shared, whole, strict=True)]
    if sigma is None:
        return paths, modes, None
    pairs = zip(sigma, whole, strict=True)
    return paths, modes, [np.sqrt(errors[rows] ** 2 @ (turn**2).T) for errors, rows in pairs]


DROWNED = 0.5
"""Errors, relative to the spread of the data, beyond which a curve shows no accelerations."""
MOST_LAWS = 3
"""Most laws to which a path is followed: a first, one under kicks, and one at larger errors."""


def discover(
    t: Floats | Sequence[tuple[Floats, Floats]],
    x: Floats | None = None,
    degree: int | None = None,
    seed: int = 0,
    progress: bool = False,
    systematic: Floats | Sequence[Floats] | None = None,
    order: int | str = "auto",
    library: Library | None = None,
    sigma: float | Floats | Sequence[float | Floats] | None = None,
    origin: str = "learn",
    orientation: str = "data",
    time_limit: float | None = None,
) -> Discovery:
    """Discover the law of a measured trajectory (paper: Eqs. 7-10).

    Parameters
    ----------
    t : array_like, shape (n,), or list of (t, x)
        Increasing times, even or uneven; or several trajectories of one system.
    x : array_like, shape (n, d), optional
        States with d of at least 1, NaN where a coordinate was not seen: what was seen at the same
        time counts. Omitted when ``t`` is a list. The columns of a data frame name the variables,
        if they are names.
    degree : int, optional
        Highest degree of the candidate terms: short for ``library=Library.polynomial(degree)``; 3
        by default.
    seed : int
        For the random probes of the noise estimate.
    progress : bool
        Show a progress bar.
    systematic : array_like, shape (k, n, d), optional
        Errors that all samples share, such as those of a scale: what k independent causes, each
        off by one standard error, add to ``x``; smooth like the path, and below its noise. One
        such array per trajectory if ``t`` is a list.
    order : {1, 2, "auto"}
        1 for ``x' = f(x)``; 2 for ``x'' = f(x, x')``, where ``x`` are positions alone: velocities
        become states ``vx, ...`` of the law, after the positions. ``"auto"`` looks for the second
        where the first is doubtful and the motion is that of a body, and says in `Discovery.note`
        which was taken and why. Where terms are given of the equations, it is 1; where the library
        names velocities, 2.
    library : Library, optional
        The candidate terms, in place of ``degree``; `Library.where` says what is known of them, and
        `Library.inputs` brings measured inputs.
        With terms that are no polynomials the law is sought in the frame of the data only, as no
        shift of its origin is exact.
    sigma : float, or array_like of shape (d,) or (n, d), optional
        Standard errors of the samples, if they are known: then noise is not estimated. For several
        trajectories one for all, or a list with one for each.
    origin : {"learn", "data"}
        Whether the law's own origin is sought, or is that of the data: then no axis moves.
    orientation : {"data", "learn"}
        Whether the axes are those of the data, or turned to where the law has fewest terms, if
        nobody knows how two or three coordinates of a place lie. Then all of the result is in the
        axes that `Discovery.orientation` holds: a state of it is ``x @ orientation.T``. Rows in
        which a coordinate was not seen do not count.
    time_limit : float, optional
        Seconds after which no further round begins: then the best law so far comes back, and a
        warning says so. One fit may last longer.

    Returns
    -------
    Discovery
        The law with standard errors in the frame of the data and in its own, sparsest frame.

    Raises
    ------
    ValueError
        If the input has the wrong shape, times that do not increase, infinite values, a
        coordinate that does not move, or fewer samples than unknowns; if ``degree`` and
        ``library`` are given, or a library does not suit the data; if a standard error is not
        positive.

    Examples
    --------
    >>> t, x = study.SYSTEMS["Lorenz"].trajectory(1500)
    >>> print(vl.discover(t, x).equations())
    """
    library, seed = check_library(degree, library), check_integer("seed", seed)
    check_order(order, origin, library)
    trajectories = check_trajectories(t, x)
    check_orientation(orientation, library, trajectories[0][1].shape[1], origin)
    names = coordinate_names(t, x)
    times = [np.asarray(pair[0]) for pair in (t if x is None else [(t, x)])]
    shared = check_systematic(systematic, times, trajectories)
    measured = trajectories, shared, check_sigma(sigma, times, trajectories)
    end = (
        np.inf
        if time_limit is None
        else time.perf_counter() + check_positive("time_limit", time_limit)
    )
    task = _Task(measured, names, library, origin, seed, progress, end)
    # Matrices this small gain nothing by threads, which wait for each other on a busy machine.
    with threadpool_limits(limits=1, user_api="blas"):
        found = _of_order(task, order)
        return found if orientation == "data" else _oriented(task, found)


@dataclass(frozen=True)
class _Task:
    """What is asked of a discovery: the data, and which laws they may have."""

    measured: Measured
    names: tuple[str, ...]
    library: Library
    origin: str
    seed: int
    progress: bool
    end: float
    turned: bool = False
    """Whether the axes are a guess: a wrong one looks like an origin that is a little off."""

    def form(self, order: int) -> Form:
        """That of laws of an order."""
        return Form.of(self.names, self.library, order, self.origin)


def _oriented(task: _Task, found: Discovery) -> Discovery:
    """The law in the axes in which it has fewest terms."""
    form = task.form(found.system.order)

    def posed(turn: Floats) -> Problem:
        probes = np.random.default_rng(task.seed)
        paths, modes, errors = in_axes(task.measured, turn)
        return foreseen(pose(paths, modes, form, probes, errors))

    def solved(turn: Floats) -> Solved:
        return _solved(replace(task, measured=in_axes(task.measured, turn), turned=True), form)

    return in_sparsest_axes(found, posed, solved, np.random.default_rng(task.seed))


def _of_order(task: _Task, order: int | str) -> Discovery:
    """The law of an order, or of the one that is to be trusted."""
    if order == "auto" and task.library.moving(task.names):
        order = 2  # who names a velocity means a law of motion
    found, problem, _ = _solved(task, task.form(2 if order == 2 else 1))
    if order == 1 or task.library.given or not found.warnings:
        return found
    swing = _swing(task, problem)
    drowned = problem.noise.max() > DROWNED
    if swing or order == 2 or drowned:
        return replace(found, swing=swing)
    # With inputs a place is passed with several velocities, whatever the order is.
    if not (found.system.timed or accelerated(problem.curves)):
        return found
    try:
        second, *_ = _solved(task, task.form(2))
    except ValueError:  # too few samples for a law of so many terms, or its names are taken
        return found
    return better(found, second)


def _swing(task: _Task, problem: Problem) -> Swing | None:
    """The law of the angle of positions that are on a circle, if nothing but polynomials is given.

    None elsewhere, or if there is too little of it.
    """
    trajectories, shared, _ = task.measured
    x = np.concatenate([values for _, values in trajectories])
    noise = (problem.noise * problem.units.scale)[: x.shape[1]]
    if problem.form.functions or not is_on_circle(x[np.isfinite(x).all(axis=1)], noise):
        return None

    form = Form.of((NAME,), LIBRARY, 2)

    def solved(angles: list[Trajectory], errors: list[Floats]) -> Discovery:
        return _solved(replace(task, measured=(angles, errors, None)), form)[0]

    try:
        return swinging(trajectories, shared, solved)
    except ValueError:
        return None


def _solved(task: _Task, form: Form) -> Solved:
    """The law of a form, the problem that it solves, and the last fit.

    As in the paper: prepare, path, refit, infer, diagnose; the last two are `conclude`.
    """
    trajectories, shared, sigma = task.measured
    probes = np.random.default_rng(task.seed)
    problems = views(lambda *how: pose(trajectories, shared, form, probes, sigma, *how))
    rounds = MOST_LAWS * (1 + ROUNDS) * len(problems)
    with tqdm(total=rounds, disable=not task.progress, desc="discover", leave=False) as bar:
        history = History(end=task.end, bar=bar)
        laws = [_law(problem, probes, history, not task.turned) for problem in problems]
        bar.update(rounds - bar.n)
    problem, fit, path = min(laws, key=lambda law: evidence(*law[:2]))
    return conclude(problem, fit, path, history), problem, fit


def _law(
    problem: Problem, probes: np.random.Generator, history: History, free: bool
) -> tuple[Problem, Fit, Path]:
    """The law that persists: the problem as that tells it, the last fit, and the path of laws.

    Where a first law does not fit, the motion may be kicked; where no path leads to a law, errors
    that last may have made terms of the first, and one that tolerates them is the start.
    """
    fit = first_law(problem, history)
    asked = not near(problem, fit, TOLERATED)
    if asked:
        problem, fit = _kicked(problem, fit, probes, history)
    fit, path, persists = persistent(problem, fit, history, free)
    if not asked and not near(problem, fit, 0.0):
        kicked, law = _kicked(problem, fit, probes, history)
        if kicked.kicked:
            return kicked, *persistent(kicked, law, history, free)[:2]
    if not (persists or problem.kicked or history.over):
        law = first_law(problem, history, path.level)
        other, around, found = persistent(problem, law, history, free)
        fit, path = (other, around) if found else (fit, path)
    return problem, fit, path


def _kicked(
    problem: Problem, fit: Fit, probes: np.random.Generator, history: History
) -> tuple[Problem, Fit]:
    """The problem with the kicks that its data show, and the law under them; else both as given.

    A poor law shows kicks that are none: the law that is found under them must not hold exactly.
    """
    kicked = with_process_noise(problem, fit, probes)
    if kicked is problem:
        return problem, fit
    law = first_law(kicked, history)
    if with_process_noise(problem, law, probes) is problem:
        return problem, fit
    return rebalanced(kicked, law, probes), law


# --------------------------------------------------------------------------------------------------
# `discover` behind the interface of `pysindy.SINDy`, for code that is written for that.


class SplineSINDy:
    """A model that is fitted as `pysindy.SINDy` is, by `discover`.

    There is nothing to choose but the degree: no threshold, no differentiation method. Rows of NaN
    are missing samples.

    Parameters
    ----------
    degree : int
        Highest degree of the candidate terms.
    seed : int
        See `discover`.

    Attributes
    ----------
    discovery : Discovery
        After `fit`: the law with error bars, status and warnings.
    """

    def __init__(self, degree: int = 3, seed: int = 0) -> None:
        self.degree = check_integer("degree", degree, 1)
        self.seed = check_integer("seed", seed)
        self._law: PolynomialSystem | None = None

    def __repr__(self) -> str:
        return f"SplineSINDy(degree={self.degree}, seed={self.seed})"

    def fit(
        self,
        x: Floats | Sequence[Floats],
        t: float | Floats | Sequence[Floats] = 1.0,
        feature_names: Sequence[str] | None = None,
    ) -> SplineSINDy:
        """Discover the law of one trajectory or of several.

        Parameters
        ----------
        x : array_like, shape (n, d), or list of such
            States.
        t : float, array_like, shape (n,), or list of such
            Time step, or times.
        feature_names : sequence of str, optional
            Of the state variables; x0, x1, ... by default.

        Raises
        ------
        ValueError
            As `discover`, or if there are not as many names as variables.
        """
        runs = _runs(x, t)
        d = runs[0][1].shape[-1]
        names = tuple(f"x{i}" for i in range(d)) if feature_names is None else tuple(feature_names)
        if len(names) != d:
            raise ValueError(f"feature_names: must name {d} variables, got {names}")
        found = discover(runs, degree=self.degree, seed=self.seed, order=1)
        self._law = PolynomialSystem(names, found.system.exponents, found.coefficients)
        self.discovery: Discovery = found
        return self

    @property
    def law(self) -> PolynomialSystem:
        """The law in the model's own names."""
        if self._law is None:
            raise ValueError("model: must be fitted first: call fit(x, t)")
        return self._law

    def predict(self, x: Floats | Sequence[Floats]) -> Floats | list[Floats]:
        """Time derivative at states, shape (n, d), or a list of such."""
        if _are_several(x):
            return [self.law(check_array("x", run)) for run in x]
        return self.law(check_array("x", x))

    def simulate(self, x0: Floats, t: Floats) -> Floats:
        """The path from ``x0``, shape (n, d); NaN after a blow-up."""
        return self.law.simulate(t, x0)

    def score(
        self, x: Floats | Sequence[Floats], t: float | Floats | Sequence[Floats] = 1.0
    ) -> float:
        """Coefficient of determination of the slopes of smoothed data, mean over the variables.

        NaN if a variable stands still.
        """
        measured, slopes, predicted = [], [], []
        for times, states in _runs(x, t):
            seen, values = check_trajectory(times, states)
            if len(seen) < WIDTH:
                raise ValueError(f"x: must hold at least {WIDTH} samples, got {len(seen)}")
            (spline,) = smooth([(seen, values)], np.random.default_rng(self.seed)).splines
            measured.append(values)
            slopes.append(spline.derivative()(seen))
            predicted.append(self.law(spline(seen)))
        truth, guess = np.concatenate(slopes), np.concatenate(predicted)
        left, total = (
            ((truth - middle) ** 2).sum(axis=0) for middle in (guess, truth.mean(axis=0))
        )
        moves = np.ptp(np.concatenate(measured), axis=0) > 0
        return float((1 - left / np.where(moves, total, np.nan)).mean())

    def coefficients(self) -> Floats:
        """One row an equation, one column a feature, shape (d, l)."""
        return self.law.coefficients.T.copy()

    def get_feature_names(self) -> list[str]:
        """Names of the features, e.g. ``["1", "x0", "x1", "x0^2", "x0 x1", "x1^2"]``."""
        return [
            " ".join(
                name if power == 1 else f"{name}^{power}"
                for name, power in zip(self.law.names, powers, strict=True)
                if power
            )
            or "1"
            for powers in self.law.exponents.tolist()
        ]

    def equations(self, precision: int = 3) -> list[str]:
        """The right-hand sides as text, with so many decimals, or digits where these were zeros."""
        features = self.get_feature_names()
        return [
            " + ".join(
                f"{_number(value, precision)} {feature}"
                for value, feature in zip(row, features, strict=True)
                if value
            )
            or f"{0:.{precision}f}"
            for row in self.coefficients()
        ]

    def print(self, lhs: Sequence[str] | None = None, precision: int = 3) -> None:
        """Print the equations, and warnings if any."""
        left = [f"({name})'" for name in self.law.names] if lhs is None else lhs
        for name, right in zip(left, self.equations(precision), strict=True):
            print(f"{name} = {right}")
        for warning in self.discovery.warnings:
            print(f"warning: {warning}")


def _number(value: float, precision: int) -> str:
    text = f"{value:.{precision}f}"
    return text if float(text) else f"{value:.{precision}g}"


def _are_several(x: Floats | Sequence[Floats]) -> bool:
    """Whether states are those of several trajectories."""
    return isinstance(x, list | tuple) and all(np.ndim(run) == 2 for run in x)


def _runs(
    x: Floats | Sequence[Floats], t: float | Floats | Sequence[Floats]
) -> list[tuple[Floats, Floats]]:
    """Times and states of each trajectory."""
    several = _are_several(x)
    states = [check_array("x", run) for run in (x if several else [x])]
    if not states or any(run.ndim != 2 for run in states):
        shapes = [run.shape for run in states]
        raise ValueError(f"x: must have shape (n, d), or be a list of such, got shapes {shapes}")
    if several and isinstance(t, list | tuple) and all(np.ndim(times) == 1 for times in t):
        times = list(t)
    elif np.ndim(t) == 0:
        step = check_number("t", np.asarray(t).item())
        if not step > 0:
            raise ValueError(f"t: must be a positive time step or increasing times, got {step:g}")
        times = [np.arange(len(run), dtype=float) * step for run in states]
    else:
        times = [cast(Floats, t)] * len(states)
    if len(times) != len(states):
        raise ValueError(f"t: must hold times for {len(states)} trajectories, got {len(times)}")
    return list(zip(times, states, strict=True))
