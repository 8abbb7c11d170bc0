"""Checks of published numbers against each other, where the data behind them are not at hand.

A row of scores counts terms, so its columns constrain one another (`could_be`, `counts_behind`). A
printed law has an l2 error that can be recomputed up to its rounding (`rounding_reach`). And a
law that is right in stretched, shifted coordinates or by a wrong clock differs from the truth in
its own way (`seen_in`, `fit_coordinates`).
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ..arrays import Floats
from ..checks import check_integer, check_positive, check_vector
from ..dynamics import PolynomialSystem
from .metrics import coefficients_in
from .published import PublishedScore

PERCENT_STEP = 1e-4
"""Last printed digit of precision, recall and l2, as a fraction."""
COEFFICIENT_STEP = 0.01
"""Last printed digit of a coefficient in Table S2."""
LIBRARY = 60
"""Candidate coefficients of the paper: 20 monomials up to degree 3 in three equations."""

_HALF = 0.5 + 1e-6  # of a last digit, with room for binary fractions


# ----------------------------------------------------------------------------------- rows of counts


def counts_behind(row: PublishedScore, true_terms: int) -> list[tuple[int, int]]:
    """Numbers of true and of false terms in one law that give the printed precision and recall.

    Parameters
    ----------
    row : PublishedScore
    true_terms : int
        Terms of the true law, at most `LIBRARY`.

    Returns
    -------
    list of tuple of int
        Pairs (true terms found, false positives); empty if no law can score this.
    """
    _check_true_terms(true_terms)
    reach = _HALF * PERCENT_STEP
    return [
        (hits, false)
        for hits in range(1, true_terms + 1)
        for false in range(LIBRARY - true_terms + 1)
        if abs(hits / true_terms - row.recall) <= reach
        and abs(hits / (hits + false) - row.precision) <= reach
    ]


def could_be(row: PublishedScore, true_terms: int, trials: int = 1) -> bool:
    """Whether some laws could score a printed row, on average over several trials.

    The mean number of false positives counts as printed if it rounds to the printed one. For one
    trial the answer is exact; for several, False is a proof and True only means "not excluded".

    Parameters
    ----------
    row : PublishedScore
    true_terms : int
        Terms of the true law, at most `LIBRARY`.
    trials : int
        Laws that were averaged, at least 1.
    """
    _check_true_terms(true_terms)
    trials = check_integer("trials", trials, 1)
    false_sum = trials * (row.false_positives + np.array([-0.5, 0.5]))
    hit_sum = trials * (row.recall + np.array([-1, 1]) * _HALF * PERCENT_STEP) * true_terms
    precision = trials * (row.precision + np.array([-1, 1]) * _HALF * PERCENT_STEP)
    low, high = _precision_sums(true_terms, trials, int(false_sum[1]))
    hits, false = np.indices(low.shape)
    printed = (hits >= hit_sum[0]) & (hits <= hit_sum[1]) & (false >= false_sum[0])
    return bool((printed & (low <= precision[1]) & (high >= precision[0])).any())


def _precision_sums(true_terms: int, trials: int, most_false: int) -> tuple[Floats, ...]:
    """Least and largest sum of precisions, by total of true and of false terms found."""
    shape = (trials * true_terms + 1, most_false + 1)
    low, high = np.full(shape, np.inf), np.full(shape, -np.inf)
    low[0, 0] = high[0, 0] = 0.0
    for _ in range(trials):
        lower, higher = np.full(shape, np.inf), np.full(shape, -np.inf)
        for hits in range(true_terms + 1):
            for false in range(min(most_false, LIBRARY - true_terms) + 1):
                precision = hits / (hits + false) if hits else 0.0
                ours = np.s_[hits:, false:]
                before = np.s_[: shape[0] - hits, : shape[1] - false]
                lower[ours] = np.minimum(lower[ours], low[before] + precision)
                higher[ours] = np.maximum(higher[ours], high[before] + precision)
        low, high = lower, higher
    return low, high


def _check_true_terms(true_terms: int) -> None:
    if check_integer("true_terms", true_terms, 1) > LIBRARY:
        raise ValueError(f"true_terms: must be an integer of 1 to {LIBRARY}, got {true_terms!r}")


# --------------------------------------------------------------------------------- printed laws


def rounding_reach(law: PolynomialSystem, truth: PolynomialSystem) -> float:
    """By how much the l2 error of a printed law and a printed l2 error may differ by rounding.

    Every coefficient is off by at most half its last digit, and so is the printed error.
    """
    coefficients = COEFFICIENT_STEP / 2 * np.sqrt(np.count_nonzero(law.coefficients))
    return float(coefficients / np.linalg.norm(truth.coefficients) + PERCENT_STEP / 2)


def seen_in(
    law: PolynomialSystem, scale: Floats, offset: Floats, clock: float = 1.0
) -> PolynomialSystem:
    """The same motion in stretched and shifted coordinates, by a clock of other units.

    If x(t) solves `law`, y(t) = offset + scale * x(clock t) solves the returned one. A clock of
    10 is a time step that was taken for a tenth of what it is: all coefficients are ten times as
    large.

    Parameters
    ----------
    law : PolynomialSystem
    scale : array_like, shape (d,)
        Positive stretch of each axis.
    offset : array_like, shape (d,)
        Shift of the stretched coordinates, state units.
    clock : float
        Positive.
    """
    check_positive("clock", clock)
    scale = check_vector("scale", scale, law.d)
    if not (scale > 0).all():
        raise ValueError(f"scale: must be {law.d} positive numbers, got {scale}")
    stretched = clock * law.coefficients * scale / np.prod(scale**law.exponents, axis=1)[:, None]
    # A Benchmark has an initial condition and a period, which the stretch does not carry along.
    return PolynomialSystem(law.names, law.exponents, stretched).shift(offset)


@dataclass(frozen=True, eq=False)
class Coordinates:
    """The coordinates in which a true law comes closest to a printed one.

    Parameters
    ----------
    scale, offset : ndarray, shape (d,)
    clock : float
        See `seen_in`.
    law : PolynomialSystem
        The true law in these coordinates.
    misfit : float
        Distance of its coefficients from the printed ones, over the norm of the true law's in
        the reference frame: an l2 error after the coordinates are accounted for.
    """

    scale: Floats
    offset: Floats
    clock: float
    law: PolynomialSystem
    misfit: float


def fit_coordinates(
    printed: PolynomialSystem,
    native: PolynomialSystem,
    offset: Floats,
    free_clock: bool = False,
) -> Coordinates:
    """Least-squares stretch and shift of each axis that turn a true law into a printed one.

    Six unknowns, or seven with the clock, against the coefficients of the law, most of whose norm
    is in a few constants: a small misfit alone says little. What counts is whether it lies within
    the rounding of the print (`rounding_reach`), all terms at once.

    Parameters
    ----------
    printed : PolynomialSystem
        A law as published.
    native : PolynomialSystem
        The true law in its native frame.
    offset : array_like, shape (d,)
        Nominal shift from there to the frame of the printed law; the search starts from it.
    free_clock : bool
        Whether the unit of time is fitted, too.
    """
    truth = native.shift(offset)
    norm, d = np.linalg.norm(truth.coefficients), native.d
    library = np.unique(np.concatenate([printed.exponents, truth.exponents]), axis=0)
    target, true = coefficients_in(printed, library), coefficients_in(truth, library)

    def coordinates(parameters: Floats) -> tuple[Floats, Floats, float]:
        scale, shift, clock = np.split(parameters, [d, 2 * d])
        return np.exp(scale), shift, float(np.exp(clock.sum()))

    def misfit(parameters: Floats) -> Floats:
        law = seen_in(native, *coordinates(parameters))
        return ((coefficients_in(law, library) - target) / norm).ravel()

    both = (true != 0) & (target / np.where(true, true, 1) > 0)
    clock = [np.log(np.median(target[both] / true[both]))] if free_clock else []
    fit = least_squares(misfit, [*np.zeros(d), *offset, *clock], xtol=1e-14, ftol=1e-14)
    found = coordinates(fit.x)
    return Coordinates(*found, seen_in(native, *found), float(np.linalg.norm(fit.fun)))


def coefficients_of(law: PolynomialSystem, support: PolynomialSystem) -> dict[str, float]:
    """Coefficients of a law at the terms of another one, keyed like ``"dx/dt: yz"``."""
    values = coefficients_in(law, support.exponents)
    return {
        f"d{name}/dt: {term}": float(values[row, j])
        for j, name in enumerate(support.names)
        for row, term in enumerate(support.terms)
        if support.coefficients[row, j]
    }


def coefficient_ratios(found: PolynomialSystem, truth: PolynomialSystem) -> dict[str, float]:
    """Found over true coefficient of every true term, keyed like ``"dx/dt: yz"``."""
    true = coefficients_of(truth, truth)
    return {term: value / true[term] for term, value in coefficients_of(found, truth).items()}


def false_terms(found: PolynomialSystem, truth: PolynomialSystem) -> dict[str, float]:
    """Coefficients of the terms found that are not true, keyed like ``"dx/dt: yz"``."""
    true = coefficients_of(truth, truth)
    return {
        term: value for term, value in coefficients_of(found, found).items() if term not in true
    }
