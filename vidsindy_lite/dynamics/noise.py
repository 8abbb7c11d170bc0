"""Variance components: the errors of the data, their precision, and process noise.

How large the errors are that a fitted curve leaves and how long they last (integrated
autocorrelation time); how precise each measurement is; and whether the motion is kicked at random.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.linalg import cho_solve_banded, toeplitz
from scipy.special import ndtr

from ..arrays import Bools, Floats
from .collocation import CLEANEST, Collocation, Fit, State, Status
from .data import CHANCE, autocovariances, inflation
from .l0 import LEAST, RIDGE
from .library import monomial_exponents, monomials
from .problem import COARSE, FINAL_WEIGHT, Problem, fit_curves, spread_to_unseen, unpruned

# --------------------------------------------------------------------------------------------------
# How large the errors of the data are, as a fitted curve leaves them, and how long they last.


def residual_noise(fit: Fit) -> Floats:
    """Standard deviation of the errors of single samples, (d,)."""
    return np.maximum(_spread(fit), CLEANEST)


def _spread(fit: Fit) -> Floats:
    """Standard deviation of the data residual, less the freedom that the fit used up.

    Of measurements of precision 1; for a coordinate that was never observed, as of the others.
    """
    collocation, seen = fit.collocation, fit.collocation.counts > 0
    used = fit.state.free().sum() / seen.sum() + len(collocation.grid.segments)
    squares = (fit.residual**2 * collocation.precision).sum(axis=0)[seen]
    spread = np.sqrt(squares / np.maximum(collocation.counts[seen] - used, 1.0))
    return spread_to_unseen(spread, seen)


def effective_noise(fit: Fit) -> Floats:
    """Standard deviation of white noise that would leave a slow signal as uncertain, (d,).

    Errors that last for several samples do not average out: their variance counts times the sum
    of their autocorrelations (`inflation`).
    """
    lasting = np.concatenate([inflation(errors) for errors in _errors_seen(fit)])
    return np.maximum(_spread(fit) * np.sqrt(lasting), CLEANEST)


def errors_left(problem: Problem, fit: Fit) -> Floats:
    """How large the errors of the data are by a fit, (d,), were they independent.

    A curve that may leave its law follows the errors, too: then they are as estimated. Of errors
    that are given only how long they last is estimated.
    """
    if problem.has_process_noise:
        return problem.noise
    errors = effective_noise(fit)
    return problem.noise * errors / residual_noise(fit) if problem.measured_errors else errors


def _errors_seen(fit: Fit) -> list[list[Floats]]:
    """Residuals of each coordinate, of precision 1, where it was seen: a column a stretch."""
    collocation = fit.collocation
    residual = fit.residual * np.sqrt(collocation.precision)
    residual[np.isnan(collocation.grid.x)] = np.nan
    stretches = collocation.grid.split(residual)
    return [
        [errors[~np.isnan(errors[:, j]), j, None] for errors in stretches]
        for j in range(collocation.d)
    ]


def time_inflation(fit: Fit) -> float:
    """Size of the errors along the path over what it were if no coordinate knew of another.

    At least 1, and 1 where it may be chance. A time that is not exact moves all coordinates along
    the path, together: at most the root of their number.
    """
    collocation = fit.collocation
    pairs = zip(fit.splines, collocation.grid.segments, strict=True)
    slopes = np.concatenate([spline(segment.t, 1) for spline, segment in pairs])
    seen = collocation.counts > 0
    scale = (np.sqrt(collocation.precision) / residual_noise(fit))[:, seen]
    residual, slopes = fit.residual[:, seen] * scale, slopes[:, seen] * scale
    along = (residual * slopes).sum(axis=1) ** 2 / np.maximum((slopes**2).sum(axis=1), LEAST)
    apart = (residual**2).sum(axis=1) / np.maximum((scale > 0).sum(axis=1), 1)
    ratio = float(along.sum() / np.maximum(apart.sum(), LEAST))
    return float(np.sqrt(ratio)) if ratio > 1 + CHANCE * np.sqrt(2 / len(residual)) else 1.0


def prediction_gain(fit: Fit, most: int = 40) -> Floats:
    """By how much the errors before it foretell an error: n times its log variance ratio, (d,).

    Minus twice the log likelihood of an autoregressive model of the residual over that of white
    noise (its order, no more than ``most``, by the Bayesian information criterion). What is left
    of an error by so many before it is on the diagonal of a Cholesky factor.
    """
    errors = [np.concatenate(pieces)[:, 0] for pieces in _errors_seen(fit)]
    fewest = min((len(e) for e in errors if len(e)), default=0)
    gains, orders = np.zeros(len(errors)), np.arange(min(most, fewest // 10) + 1)
    for j, e in enumerate(errors):
        if e.any():  # it was observed
            covariance = np.array([e[k:] @ e[: len(e) - k] for k in orders]) / (e @ e)
            covariance[0] += RIDGE
            left = np.diag(np.linalg.cholesky(toeplitz(covariance))) ** 2
            gains[j] = (len(e) * np.log(left) + orders * np.log(len(e))).min()
    return gains


def passing(fit: Fit, tried: int) -> Bools:
    """Which errors last but are none that the motion brings along, (d,).

    What a law misses swings with the motion; errors of a sensor or a filter are forgotten. More
    must be independent than are ``tried`` as further terms, so that those could tell; and they are
    no large part of the motion. Of a coordinate that was never observed, what is true of all
    others.
    """
    seen, errors = fit.collocation.counts > 0, _errors_seen(fit)
    counts = np.array([sum(independent(piece[:, 0]) for piece in pieces) for pieces in errors])
    products = [autocovariances(pieces)[:, 0] for pieces in errors]
    lowest = np.array([some.min() / max(some[0], LEAST) for some in products])
    # An autocorrelation of -.3 is three standard errors of a hundred independent ones: errors come
    # back with the other sign, as a motion does. A tenth of the spread may well be meant by a law.
    forgotten = (counts > tried) & (lowest > -0.3) & (residual_noise(fit) < 0.1)
    return np.where(seen, forgotten, forgotten[seen].all())


def place_errors(fit: Fit) -> float:
    """How large errors are that the motion brings along, over the spread; 0 if there are none.

    Those of a bent space do not average out, and move the origin of a law by as much as they are.
    """
    errors = residual_noise(fit)
    lasting = (effective_noise(fit) > 2 * errors) & ~passing(fit, len(fit.state.coefficients))
    return float(errors[lasting & (fit.collocation.counts > 0)].max(initial=0.0))


def bent(fit: Fit, degree: int = 3) -> Fit:
    """The fit with the errors that a bent space leaves among those that all samples share.

    Such errors, as of a lens that is not undistorted, are functions of the place, come back with
    the motion and do not average out. Each coordinate has as many as there are polynomials of the
    place (of degree 3 as a lens, and orthogonal over the samples), all as large as what these
    explain of its residual together; none where that may be chance or rounding, or where there are
    fewer than ten samples for each.
    """
    collocation = fit.collocation
    (n, d), seen = fit.residual.shape, np.flatnonzero(collocation.counts)
    residual = fit.residual * np.sqrt(collocation.precision)
    exponents = monomial_exponents(len(seen), degree)
    k = len(exponents)
    if n < 10 * k:
        return fit
    places = collocation.curve(fit.state.control_points)[:, seen]
    modes = np.linalg.qr(monomials(places, exponents))[0]
    explained = modes @ (modes.T @ residual)
    left = residual - explained
    chance = inflation([left]) * (left**2).sum(axis=0) / (n - k)
    excess = (explained**2).sum(axis=0) - (k + CHANCE * np.sqrt(2 * k)) * chance
    sizes = np.sqrt(np.where(excess > n * CLEANEST**2, excess, 0.0))
    bends = np.einsum("nk,ij->nijk", modes, np.diag(sizes)[:, sizes > 0]).reshape(n, d, -1)
    shared = np.concatenate([collocation.systematic, bends], axis=2)
    return replace(fit, collocation=replace(collocation, systematic=shared))


def independent(errors: Floats) -> float:
    """How many independent errors have a variance as uncertain as that of these, (n,).

    Their number over the sum of the squared autocorrelations (Bartlett 1946), which is that of the
    ordinates of their periodogram that matter: few, if they have periods or stay aside.
    """
    powers = np.abs(np.fft.rfft(errors, max(len(errors), 1))) ** 2
    return float(4 * powers.sum() ** 2 / (powers**2).sum()) if powers.any() else 0.0


# --------------------------------------------------------------------------------------------------
# How precise each measurement is, as the errors that a law leaves tell.
#
# Noise may grow with the signal, with its speed (times that are not exact) or be larger for a
# while, and some samples may be plainly wrong. A model of the variance is fitted to the residuals,
# the simplest that explains them (Bayesian information criterion); each measurement then has its
# own weight, and what is no noise at all has none.

#: Distance from the curve, in standard deviations of the noise there, that no noise reaches.
GROSS = 6.0
LIKELY = 20.0  #: Gain of the criterion from which on a noise is not taken to be even.
LARGEST_RATIO = 100.0  #: Precision of the best measurements over the typical one, at most.


def smoother_weights(problem: Problem) -> Problem:
    """The problem with the precision that the smoothed curves show each measurement to have.

    The same problem where the noise is even and no sample is wrong, or the errors are given. A
    wrong law explains what it misses by measurements of its own choice; a curve has no law.
    """
    if problem.measured_errors:
        return problem
    step = 1e-3
    behind, signal, ahead = (problem.smoothed(by) for by in (-step, 0, step))
    x = np.concatenate([values for _, (_, values) in problem.stretches])
    residual, observed = np.nan_to_num(signal - x), np.isfinite(x)
    # What the variance of the noise may follow: place and speed.
    causes = [(signal - problem.origin) ** 2, ((ahead - behind) / (2 * step)) ** 2]
    spread = np.sqrt((residual**2).sum(axis=0) / np.maximum(observed.sum(axis=0), 1))
    factors, noise = np.ones_like(residual), problem.noise.copy()
    for j in np.flatnonzero(spread > 1e-4):  # below are the errors of splines
        seen = observed[:, j]
        factors[seen, j] = _factors(residual[seen, j], [cause[seen, j] for cause in causes])
        left = (factors[seen, j] * residual[seen, j] ** 2).sum() / (factors[seen, j] > 0).sum()
        noise[j] *= np.sqrt(left) / spread[j]
    if (factors == 1).all():
        return problem
    precision = problem.precision * factors
    return replace(problem, precision=precision, noise=np.maximum(noise, CLEANEST))


def _factors(residual: Floats, causes: list[Floats]) -> Floats:
    """Precision of measurements over the typical one, (n,): 0 for what is no noise."""
    n = len(residual)
    even = np.ones(n)
    pieces = np.arange(n) * 8 // n  # eighths of a trajectory may have a noise of their own
    stretches = (pieces == np.unique(pieces)[:, None]).astype(float)
    models = [even[None], *([even, z] for z in causes), stretches]
    fits = [_variance(residual, np.array(model)) for model in models]
    cost, variance, gross = min(fits, key=lambda fit: fit[0])
    plain = n * np.log((residual**2).mean()) + n + np.log(n)
    if not cost < plain - LIKELY or gross.mean() > 0.1:  # if so many are wrong, the law is
        return even
    precision = np.minimum(np.median(variance) / variance, LARGEST_RATIO)
    return np.where(gross, 0.0, precision)


def _variance(residual: Floats, causes: Floats, updates: int = 60) -> tuple[float, Floats, Bools]:
    """A variance that is a sum of causes, (k, n), each times an unknown size of at least 0.

    Its criterion, itself, (n,), and what is no noise. The sizes by an ascent of the likelihood
    that keeps them positive (ten ``updates`` would do for most); what is gross at present does not
    count.
    """
    causes = causes / causes.mean(axis=1, keepdims=True)
    squares = residual**2
    variance = causes.sum(axis=0)
    least = (squares / variance).mean() / LARGEST_RATIO**2  # some residuals are exactly zero
    # .455 is the median of the square of a standard normal number.
    sizes = np.full(len(causes), max(np.median(squares / variance) / 0.455, least))
    for _ in range(updates):
        variance = np.maximum(sizes @ causes, least)
        noise = squares <= GROSS**2 * variance
        up = (causes * (noise * squares / variance**2)).sum(axis=1)
        down = (causes * (noise / variance)).sum(axis=1)
        sizes = sizes * up / np.maximum(down, LEAST)
    variance = np.maximum(sizes @ causes, variance.max() / LARGEST_RATIO**2)
    gross = squares > GROSS**2 * variance
    terms = np.log(variance) + np.where(gross, GROSS**2, squares / variance)
    return float(terms.sum() + len(causes) * np.log(len(residual))), variance, gross


# --------------------------------------------------------------------------------------------------
# Process noise: random kicks of the motion, told from errors of the measurement by evidence.
#
# A law that leaves more than the noise of the data may be exact and measured with errors that
# last, or measured well and not exact: kicked at every instant. Both are Gaussian models of the
# same data, so their marginal likelihoods can be compared (MacKay 1992); in the language of data
# assimilation, a strong against a weak constraint. And kicks have a spectrum of their own: what
# lasts, such as a bent space or a law outside the library, is none.

#: Random vectors of a trace (Hutchinson): they leave an error of a hundredth at 1,500 samples.
PROBES = 8
OCTAVE = 8  #: Frequencies of the lowest band of a spectrum; each next one has twice as many.


def with_process_noise(problem: Problem, fit: Fit, rng: np.random.Generator) -> Problem | None:
    """The problem with the process noise that its data show; none if they show none.

    Parameters
    ----------
    problem : Problem
        Without kicks.
    fit : Fit
        The best law that holds exactly.
    rng : Generator
        For the probes of traces.
    """
    start, free = problem.weighted(problem.collocation(problem.segments()), 1.0), _free(problem)
    every = replace(_on_knots(start, fit), active=problem.form.candidates)
    # What is known of a law (the slope of a position is the velocity) holds exactly.
    physics = np.where(free, 1.0, FINAL_WEIGHT) * start.physics_weights
    kicked = _balanced(problem, replace(start, physics_weights=physics), every, rng)
    met = np.isfinite(kicked.collocation.objective(kicked.state))  # else it has a pole on its path
    if not met or like_kicks(kicked, free, rng) < 0.01:
        return None
    exact = _measured_badly(problem, fit, start)
    if not evidence(kicked) < evidence(exact) + prediction_gain(exact).sum():
        return None
    return _with_variances(problem, kicked.collocation)


def rebalanced(problem: Problem, fit: Fit, rng: np.random.Generator) -> Problem:
    """The problem with the kicks and the noise that a law leaves; all terms together leave less."""
    balanced = _balanced(problem, fit.collocation, fit.state, rng)
    return _with_variances(problem, balanced.collocation)


def _with_variances(problem: Problem, weights: Collocation) -> Problem:
    return replace(
        problem,
        noise=np.maximum(weights.data_weights**-0.5, CLEANEST),
        process_noise=np.where(_free(problem), weights.physics_weights**-0.5, 0.0),
    )


def _free(problem: Problem) -> Bools:
    """Which equations may be kicked: those that are not known, (d,)."""
    return np.asarray(problem.form.candidates.any(axis=0), dtype=bool)


def evidence(fit: Fit) -> float:
    """Minus twice the log marginal likelihood of a fit; comparable on the same knots."""
    collocation, grid = fit.collocation, fit.collocation.grid
    factor, _ = collocation.factor(fit.state)
    weights = collocation.counts @ np.log(collocation.data_weights)
    weights += np.log(np.outer(grid.node_weights, collocation.physics_weights)).sum()
    return float(collocation.objective(fit.state) - weights + 2 * np.log(factor[0]).sum())


def _measured_badly(problem: Problem, fit: Fit, start: Collocation) -> Fit:
    """The exact law on other knots, at the errors that it leaves."""
    grid = replace(start, data_weights=residual_noise(fit) ** -2)
    exact = problem.weighted(grid, FINAL_WEIGHT).solve(_on_knots(grid, fit))
    own = replace(exact.collocation, data_weights=residual_noise(exact) ** -2)
    return own.solve(exact.state)


def _on_knots(collocation: Collocation, fit: Fit) -> State:
    """The state of a fit on other knots."""
    return replace(fit.state, control_points=fit_curves(collocation, fit.splines))


def _balanced(
    problem: Problem, collocation: Collocation, state: State, rng: np.random.Generator
) -> Fit:
    """The fit at the variances of noise and kicks that make the data most likely.

    Each is the sum of the squares of its residuals, over how many of these the curve and the terms
    have not used up (MacKay's update). Noise that is given stays. At most 20 updates, until no
    logarithm changes by more than a tenth.
    """
    free, told = _free(problem), problem.measured_errors
    grid, d = collocation.grid, collocation.d
    probes = rng.choice([-1.0, 1.0], (grid.r * d, PROBES))
    hardest = FINAL_WEIGHT * collocation.physics_weights
    unfitted = len(grid.node_weights) - state.active.sum(axis=0)
    for _ in range(20):
        fit = collocation.solve(state, tolerance=1.0, max_steps=10)
        state, collocation = fit.state, fit.collocation
        factor, physics = collocation.factor(state)
        solved = cho_solve_banded((factor, True), probes)
        # What the curve uses up, from random vectors of +-1: Hutchinson's trace.
        used, in_law = (
            ((rows @ probes) * (rows @ solved)).mean(axis=1).reshape(-1, d)
            for rows in (grid.measured, physics)
        )
        in_data = (used * collocation.sample_weights).sum(axis=0)
        missed = (collocation.precision * fit.residual**2).sum(axis=0)
        kicked = grid.node_weights @ collocation.physics_residual(state) ** 2
        data = np.maximum(collocation.counts - in_data, 1.0) / np.maximum(missed, LEAST)
        law = np.maximum(unfitted - in_law.sum(axis=0), 1.0) / np.maximum(kicked, LEAST)
        unknown = (collocation.counts > 0) & (not told)
        data = np.where(unknown, data, collocation.data_weights)
        law = np.where(free, law, collocation.physics_weights)
        data, law = np.minimum(data, CLEANEST**-2), np.clip(law, LEAST, hardest)
        change = np.log([data / collocation.data_weights, law / collocation.physics_weights])
        collocation = replace(collocation, data_weights=data, physics_weights=law)
        if (np.abs(change) < 0.1).all():
            break
    return collocation.solve(state, tolerance=1.0)


def like_kicks(fit: Fit, free: Bools, rng: np.random.Generator) -> float:
    """How probable it is that independent kicks and errors leave what the law misses, at most.

    Both are simulated and smoothed as the data were; their spectra are compared by octaves: the
    largest distance between the logarithms of a band, in standard errors, over the equations that
    are ``free`` to be kicked. Of so many bands any one may be as far off (Bonferroni).
    """
    collocation, grid, d = fit.collocation, fit.collocation.grid, fit.collocation.d
    factor, physics = collocation.factor(fit.state)
    kicks = rng.standard_normal((physics.shape[0], PROBES))
    errors = rng.standard_normal((grid.x.size, PROBES))
    weighted = np.sqrt(collocation.sample_weights).reshape(-1, 1) * errors
    pull = grid.measured.T @ weighted - physics.T @ kicks
    simulated = kicks + physics @ cho_solve_banded((factor, True), pull)
    root = np.sqrt(grid.node_weights[:, None] * collocation.physics_weights)
    found = _bands((root * collocation.physics_residual(fit.state))[:, :, None])
    expected = _bands(simulated.reshape(-1, d, PROBES))
    count = OCTAVE * 2.0 ** np.maximum(np.arange(len(found)) - 1, 0)
    distance = np.abs(np.log(np.maximum(found, LEAST) / np.maximum(expected, LEAST)))[:, free]
    # Splines by themselves blur the logarithm of a band by .15.
    errors = distance / np.sqrt(1 / count + 0.15**2)[:, None]
    return float(2 * ndtr(-errors.max()) * errors.size)


def _bands(signal: Floats) -> Floats:
    """Mean power of signals of shape (k, d, m) in octaves of frequency, (bands, d)."""
    power = (np.abs(np.fft.rfft(signal, axis=0)[1:]) ** 2).mean(axis=2) / len(signal)
    octaves = int(np.log2(max(len(power) / OCTAVE, 1.0)))
    edges = [0, *(OCTAVE * 2 ** np.arange(octaves + 1)).tolist()]
    return np.stack([power[low:high].mean(axis=0) for low, high in pairwise(edges)])


# --------------------------------------------------------------------------------------------------
# Noise of data with few samples a turn, told by candidate terms together.
#
# A curve without a law has as much freedom as there are samples a turn. Where these are few, it
# takes motion for noise, or gives the motion up and is flat. So terms are fitted at once, as many
# as converge, and what they leave is the noise; each of the two noises has its law.

#: Error that a first law tolerates, relative to the spread of the data: finer terms come after
#: those that make the motion.
TOLERATED = 0.03
#: Errors that a law leaves, over those tolerated when it was chosen, that are still the same.
CONSISTENT = 1.5


def views(pose: Callable[..., Problem]) -> list[Problem]:
    """A problem with the noise that its curves leave, and others where that may be wrong.

    Where the curves drop measurements, one with all of them; where terms leave far less than the
    curves, one with what these leave.

    Parameters
    ----------
    pose : callable
        Poses the problem: with smoothed curves, or, if ``True`` is passed, with curves through
        the samples, which serve where smoothed ones leave out a part of the motion.
    """
    whole = pose()
    problem = smoother_weights(whole)
    # What no smooth curve explains may still be the law's: a transient that a sample or two show.
    drops = ((problem.precision == 0) & (whole.precision > 0)).any()
    found = [problem, whole] if drops else [problem]
    # A curve that has given the motion up, and leaves nearly all of its spread, has no turns.
    enough = problem.samples_a_turn > COARSE and problem.noise.max() < 0.9
    if not (enough or problem.measured_errors or (problem.noise <= TOLERATED).all()):
        told = _by_terms(problem) or _by_terms(pose(True))
        found += [] if told is None else [told]
    return found


def _by_terms(problem: Problem) -> Problem | None:
    """The problem with the noise that terms leave, as many as converge, if it is far less."""
    degrees = problem.exponents.sum(axis=1)
    for degree in range(problem.form.degree, 0, -1):
        fit = unpruned(problem, ~problem.form.implicit & (degrees <= degree))
        left = residual_noise(fit)
        over = CONSISTENT * left < problem.noise
        if fit.status is Status.CONVERGED and over.any():
            return replace(problem, noise=np.where(over, left, problem.noise))
    return None
