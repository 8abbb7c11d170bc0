"""How good a discovered law is, by the paper's scores and others, and how good it could be."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..checks import check_array, check_vector, shown
from ..dynamics import Discovery, PolynomialSystem, runge_kutta_4


@dataclass(frozen=True, eq=False)
class Score:
    """A discovered law beside the truth, term by term.

    Parameters
    ----------
    terms_found : bool
        Every true term was found (the paper's column "Terms Found").
    false_positives : int
        Terms found that are not true.
    missing : int
        True terms that were not found.
    l2 : float
        ``|Lambda_found - Lambda_true| / |Lambda_true|``, 2-norms over all coefficients.
    precision : float
        Fraction of the found terms that are true; 0 if nothing was found.
    recall : float
        Fraction of the true terms that were found.
    coefficient_errors : ndarray, shape (l, d)
        ``|found - true| / |true|`` of every true term, in the library of the truth; NaN off its
        support. It is 1 for a missing term. `l2` hides a small coefficient beside a large one.
    """

    terms_found: bool
    false_positives: int
    missing: int
    l2: float
    precision: float
    recall: float
    coefficient_errors: Floats

    @property
    def exact(self) -> bool:
        """The support is right: no term is missing and none is false."""
        return self.terms_found and self.false_positives == 0

    @property
    def max_coefficient_error(self) -> float:
        """Largest of `coefficient_errors`."""
        return float(np.nanmax(self.coefficient_errors))

    def __str__(self) -> str:
        found = "all true terms found" if self.terms_found else f"{self.missing} terms missing"
        return (
            f"{found}, {self.false_positives} false; relative l2 {self.l2:.2g}, "
            f"worst coefficient {self.max_coefficient_error:.2g}, "
            f"precision {self.precision:.0%}, recall {self.recall:.0%}"
        )


def score(found: PolynomialSystem | Discovery, truth: PolynomialSystem) -> Score:
    """Compare a discovered law with the truth in the same frame (paper: evaluation metrics).

    Parameters
    ----------
    found : PolynomialSystem or Discovery
        The discovered law; anything else that has one as its ``system`` will do as well.
    truth : PolynomialSystem
        The true law. Libraries may differ in degree and order, not in their functions: terms are
        matched by monomial, variables by position: of the same names in another order are none.

    Raises
    ------
    ValueError
        If one of them is no law, the dimensions differ or the truth has no term.

    Examples
    --------
    >>> truth = SYSTEMS["Lorenz"].shift(REFERENCE_OFFSET)
    >>> score(truth, truth).exact
    True
    """
    law: Any = getattr(found, "system", found)  # of which type, is checked now
    for name, one in (("found", law), ("truth", truth)):
        if not isinstance(one, PolynomialSystem):
            raise ValueError(
                f"{name}: must be a PolynomialSystem (what was found comes first, the truth "
                f"second), got {shown(one)}"
            )
    _check_variables(law, truth)
    points = np.random.default_rng(0).normal(size=(9, law.d))
    functions = [
        [(f.name, np.nan_to_num(f.value(points)).round(9).tolist()) for f in one.functions]
        for one in (law, truth)
    ]
    if functions[0] != functions[1] or law.exponents.shape[1] != truth.exponents.shape[1]:
        raise ValueError("found: must have a library with the functions of truth, got others")
    if not truth.support.any():
        raise ValueError("truth: must have at least one term, got none")
    library = np.unique(np.concatenate([law.exponents, truth.exponents]), axis=0)
    guess, true = coefficients_in(law, library), coefficients_in(truth, library)
    hits = int(((guess != 0) & (true != 0)).sum())
    claimed, actual = int(np.count_nonzero(guess)), int(np.count_nonzero(true))
    wanted = np.where(truth.support, truth.coefficients, np.nan)
    return Score(
        terms_found=hits == actual,
        false_positives=claimed - hits,
        missing=actual - hits,
        l2=float(np.linalg.norm(guess - true) / np.linalg.norm(true)),
        precision=hits / claimed if claimed else 0.0,
        recall=hits / actual,
        coefficient_errors=np.abs(coefficients_in(law, truth.exponents) / wanted - 1),
    )


def _check_variables(law: PolynomialSystem, truth: PolynomialSystem) -> None:
    """Refuse a law of more or fewer variables than the truth, or of the same in another order."""
    here, there = law.names, truth.names
    if len(here) != len(there) or (here != there and {*here} == {*there}):
        raise ValueError(f"found: must have the variables of truth, {there}, got {here}")


def term_errors(found: PolynomialSystem, truth: PolynomialSystem) -> tuple[list[str], list[str]]:
    """Names of the true terms that are missing and of the false ones, e.g. "x in dy/dt"."""

    def active(law: PolynomialSystem) -> dict[tuple[int, ...], str]:
        return {
            (equation, *law.exponents[row]): f"{law.terms[row]} in d{truth.names[equation]}/dt"
            for row, equation in np.argwhere(law.support)
        }

    guess, true = active(found), active(truth)
    missing = [name for place, name in true.items() if place not in guess]
    return missing, [name for place, name in guess.items() if place not in true]


def pulls(found: Discovery, truth: PolynomialSystem) -> Floats:
    """Errors of the true terms that were found, in units of their standard errors.

    Parameters
    ----------
    found : Discovery
    truth : PolynomialSystem
        In the frame of the data.

    Returns
    -------
    ndarray, shape (m,)
        ``(found - true) / standard error``. If the standard errors are right, and the law is, its
        mean square is 1; the coefficients of one law are correlated.
    """
    _check_variables(found.system, truth)
    uncertain = replace(found.system, coefficients=found.standard_errors)
    errors, values = (coefficients_in(law, truth.exponents) for law in (uncertain, found.system))
    seen = truth.support & (errors > 0)
    return (values - truth.coefficients)[seen] / errors[seen]


def coefficients_in(system: PolynomialSystem, library: Ints) -> Floats:
    """Coefficients of a system in another library.

    Parameters
    ----------
    system : PolynomialSystem
    library : ndarray of int, shape (l, d)
        Exponents, one row a monomial. Terms of the system outside it are left out.

    Returns
    -------
    ndarray, shape (l, d)
        Zero for monomials that the system does not have.
    """
    rows = dict(zip(map(tuple, system.exponents), system.coefficients, strict=True))
    return np.array([rows.get(tuple(powers), np.zeros(system.d)) for powers in library])


def trajectory_error(x: Floats, truth: Floats) -> Floats:
    """Root mean square error of a reconstructed trajectory, axis by axis.

    It separates the error of tracking and cameras from that of the regression.

    Parameters
    ----------
    x : array_like, shape (n, d)
        Reconstructed states; rows with a NaN are ignored.
    truth : array_like, shape (n, d)
        True states at the same times.

    Returns
    -------
    ndarray, shape (d,)
        In the units of the states.

    Raises
    ------
    ValueError
        If the shapes differ, the truth is not finite or ``x`` has no row without NaN.
    """
    x, truth = check_array("x", x), check_array("truth", truth)
    if truth.ndim != 2 or not np.isfinite(truth).all():
        raise ValueError(f"truth: must be finite with shape (n, d), got shape {truth.shape}")
    if x.shape != truth.shape:
        raise ValueError(f"x: must have the shape of truth, {truth.shape}, got {x.shape}")
    seen = ~np.isnan(x).any(axis=1)
    if not seen.any():
        raise ValueError(f"x: must hold at least one row without NaN, got {len(x)} missing rows")
    return np.asarray(np.sqrt(((x - truth)[seen] ** 2).mean(axis=0)))


# --------------------------------------------------------------------------- the Cramer-Rao bound


@dataclass(frozen=True)
class Bound:
    """Least standard errors of any unbiased estimate that knows the true terms.

    Parameters
    ----------
    coefficients : ndarray, shape (l, d)
        Of the true terms; zero elsewhere.
    offset : ndarray, shape (d,)
        Of the origin of the law; zero along axes that are known.
    """

    coefficients: Floats
    offset: Floats


def cramer_rao_bound(
    system: PolynomialSystem, t: Floats, x0: Floats, sigma: Floats, moving: Bools | None = None
) -> Bound:
    """Cramer-Rao bound of the coefficients, with unknown initial condition and offset.

    A square-root Kalman filter along the true trajectory, without process noise: between two
    measurements the covariance of state and coefficients is carried over by the sensitivities of
    one time step, at a measurement it shrinks. Sensitivities over the whole time would not do:
    in a chaotic flow they grow beyond the digits that a computer has.

    Parameters
    ----------
    system : PolynomialSystem
        The true law in its own frame.
    t : ndarray, shape (n,)
        Times of the measurements; the first is that of the initial condition.
    x0 : array_like, shape (d,)
        True initial condition.
    sigma : array_like, shape (d,)
        Standard deviation of the Gaussian noise of each coordinate, large where none is measured.
    moving : array_like of bool, shape (d,), optional
        Axes along which the origin is unknown; none by default.

    Returns
    -------
    Bound
    """
    d, sigma = system.d, check_vector("sigma", sigma, system.d, system.names)
    if (sigma <= 0).any():
        raise ValueError(f"sigma: must be positive, got {shown(sigma)}")
    moving = np.zeros(d, dtype=bool) if moving is None else np.asarray(moving, dtype=bool)
    # That a velocity is the rate of its position is known, and that of the time.
    unknown = np.arange(d) >= (system.states // 2 if system.order == 2 else 0)
    unknown[system.states :] = False
    equations, terms = np.nonzero((system.support & unknown).T)
    count, free = len(terms), d + len(terms) + int(moving.sum())
    x = system.simulate(t, x0)
    steps, responses = _sensitivities(system, t, x, equations, terms)
    observe = np.hstack([np.eye(d), np.zeros((d, count)), np.eye(d)[:, moving]])
    spread = np.ptp(x, axis=0).max() + np.abs(x).max()
    known = np.abs(system.coefficients[terms, equations])
    # A prior standard deviation of so many times what is unknown is as good as none.
    root = 1e4 * np.diag(np.concatenate([np.full(d, spread), known, np.full(moving.sum(), spread)]))
    root = _measured(root, observe, sigma)
    carry = np.eye(free)
    for step, response in zip(steps, responses, strict=True):
        carry[:d, :d], carry[:d, d : d + count] = step, response
        root = _measured(carry @ root, observe, sigma)
    errors = np.linalg.norm(root, axis=1)
    coefficients, offset = np.zeros(system.coefficients.shape), np.zeros(d)
    coefficients[terms, equations] = errors[d : d + count]
    offset[moving] = errors[d + count :]
    return Bound(coefficients, offset)


def _measured(root: Floats, observe: Floats, sigma: Floats) -> Floats:
    """Square root of the covariance after a measurement (the array form of the Kalman update)."""
    m, free = observe.shape
    array = np.block([[np.diag(sigma), observe @ root], [np.zeros((free, m)), root]])
    lower = np.asarray(np.linalg.qr(array.T, mode="r")).T
    return lower[m:, m:]


def _sensitivities(
    system: PolynomialSystem, t: Floats, x: Floats, equations: Ints, terms: Ints
) -> tuple[Floats, Floats]:
    """Derivatives of each next state with respect to the state (d, d) and coefficients (d, p)."""
    d, width = system.d, np.diff(t)[:, None]

    def rates(both: Floats) -> Floats:
        state, sensitivity = both[:, :d], both[:, d:].reshape(len(both), d, -1)
        growth = system.gradient(state) @ sensitivity
        growth[:, equations, d + np.arange(len(terms))] += system.library(state)[:, terms]
        return np.asarray(width * np.hstack([system(state), growth.reshape(len(both), -1)]))

    begin = np.tile(np.eye(d, d + len(terms)).ravel(), (len(x) - 1, 1))
    end = runge_kutta_4(rates, np.array([0.0, 1.0]), np.hstack([x[:-1], begin]), substeps=8)[1]
    sensitivity = end[:, d:].reshape(len(end), d, -1)
    return sensitivity[:, :, :d], sensitivity[:, :, d:]
