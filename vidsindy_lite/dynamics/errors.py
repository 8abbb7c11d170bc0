"""How large the errors of the data are, as a fitted curve leaves them, and how long they last."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Bools, Floats
from .collocation import CLEANEST, Fit

CHANCE = 4.0
"""Lag-1 autocorrelation, in standard errors of white noise, from which on errors are dependent."""
ORDER = 40
"""Most errors that foretell the next."""
LEAST = 1e-300
"""Keeps a quotient finite where nothing moves or is left."""
LARGE = 0.1
"""Errors that last, relative to the spread of the data, beyond which a law's may well be meant."""
REBOUND = 0.3
"""Autocorrelation below zero from which on errors come back with the other sign, as a motion does:
three standard errors of a hundred independent ones."""


def residual_noise(fit: Fit) -> Floats:
    """Standard deviation of the errors of single samples, (d,)."""
    return np.maximum(_spread(fit), CLEANEST)


def _spread(fit: Fit) -> Floats:
    """Standard deviation of the data residual, less the freedom that the fit used up.

    Of measurements of precision 1; for a coordinate that was never observed, as of the others.
    """
    collocation, seen = fit.collocation, fit.collocation.counts > 0
    used = fit.state.free().sum() / seen.sum() + len(collocation.segments)
    residual, _ = collocation.data_residual(fit.state.control_points)
    squares = (residual**2 * collocation.precision).sum(axis=0)[seen]
    spread = np.sqrt(squares / np.maximum(collocation.counts[seen] - used, 1.0))
    return spread_to_unseen(spread, seen)


def spread_to_unseen(noise: Floats, seen: Bools) -> Floats:
    """The errors of the coordinates that were observed, their geometric mean for the others."""
    filled = np.full(len(seen), np.exp(np.log(np.maximum(noise, CLEANEST)).mean()))
    filled[seen] = noise
    return filled


def effective_noise(fit: Fit) -> Floats:
    """Standard deviation of white noise that would leave a slow signal as uncertain, (d,).

    Errors that last for several samples do not average out: their variance counts times the sum
    of their autocorrelations (`inflation`).
    """
    lasting = np.concatenate([inflation(errors) for errors in _errors_seen(fit)])
    return np.maximum(_spread(fit) * np.sqrt(lasting), CLEANEST)


def _errors_seen(fit: Fit) -> list[list[Floats]]:
    """Residuals of each coordinate, of precision 1, where it was seen: a column a stretch."""
    collocation = fit.collocation
    residual, _ = collocation.data_residual(fit.state.control_points)
    residual *= np.sqrt(collocation.precision)
    seen = np.isfinite(collocation.grid.x)
    ends = np.cumsum([len(segment.t) for segment in collocation.segments])[:-1]
    stretches = list(zip(np.split(residual, ends), np.split(seen, ends), strict=True))
    return [
        [errors[here[:, j], j, None] for errors, here in stretches] for j in range(collocation.d)
    ]


def time_inflation(fit: Fit) -> float:
    """Size of the errors along the path over what it were if no coordinate knew of another.

    At least 1, and 1 where it may be chance. A time that is not exact moves all coordinates along
    the path, together: at most the root of their number.
    """
    collocation = fit.collocation
    residual, _ = collocation.data_residual(fit.state.control_points)
    splines = collocation.grid.splines(fit.state.control_points)
    pairs = zip(splines, collocation.segments, strict=True)
    slopes = np.concatenate([spline(segment.t, 1) for spline, segment in pairs])
    seen = collocation.counts > 0
    scale = (np.sqrt(collocation.precision) / residual_noise(fit))[:, seen]
    residual, slopes = residual[:, seen] * scale, slopes[:, seen] * scale
    along = (residual * slopes).sum(axis=1) ** 2 / np.maximum((slopes**2).sum(axis=1), LEAST)
    apart = (residual**2).sum(axis=1) / np.maximum((scale > 0).sum(axis=1), 1)
    ratio = float(along.sum() / np.maximum(apart.sum(), LEAST))
    return float(np.sqrt(ratio)) if ratio > 1 + CHANCE * np.sqrt(2 / len(residual)) else 1.0


def inflation(pieces: Sequence[Floats]) -> Floats:
    """Variance of a mean of errors over what it were if they were independent, at least 1, (d,).

    The sum of the autocorrelations over all lags, as long as those of neighbouring lags together
    are positive (Geyer 1992, initial positive sequence); 1 where the first lag is no more than
    chance.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n_i, d)
        Errors of successive samples, of mean zero.
    """
    covariances = _autocovariances(pieces)
    result = np.ones(covariances.shape[1])
    limit = CHANCE / np.sqrt(max(sum(map(len, pieces)), 1))
    for j, covariance in enumerate(covariances.T):
        if covariance[1:].any() and covariance[1] > limit * covariance[0]:
            even = len(covariance) // 2 * 2
            pairs = covariance[:even].reshape(-1, 2).sum(axis=1) / covariance[0]
            positive = len(pairs) if (pairs > 0).all() else int((pairs <= 0).argmax())
            result[j] = max(2 * pairs[:positive].sum() - 1, 1.0)
    return result


def _autocovariances(pieces: Sequence[Floats]) -> Floats:
    """Sums of the products of errors so many samples apart, over all pieces, (lags, d)."""
    size = 2 * max(max(len(piece) for piece in pieces), 1)
    powers = [np.abs(np.fft.rfft(piece, size, axis=0)) ** 2 for piece in pieces]
    return np.fft.irfft(np.sum(powers, axis=0), size, axis=0)[: size // 2]


def prediction_gain(fit: Fit) -> Floats:
    """By how much the errors before it foretell an error: n times its log variance ratio, (d,).

    Minus twice the log likelihood of an autoregressive model of the residual over that of white
    noise (Levinson's recursion; its order by the Bayesian information criterion).
    """
    errors = [np.concatenate(pieces)[:, 0] for pieces in _errors_seen(fit)]
    fewest = min((len(e) for e in errors if len(e)), default=0)
    lags = range(min(ORDER, fewest // 10) + 1)
    covariances = [np.array([e[k:] @ e[: len(e) - k] for k in lags]) for e in errors]
    sizes = map(len, errors)
    return np.array([_levinson(c, n).min() for c, n in zip(covariances, sizes, strict=True)])


def passing(fit: Fit, tried: int) -> Bools:
    """Which errors last but are none that the motion brings along, (d,).

    What a law misses swings with the motion; errors of a sensor or a filter are forgotten. More
    must be independent than are ``tried`` as further terms, so that those could tell; and they are
    no large part of the motion. Of a coordinate that was never observed, what is true of all
    others.
    """
    seen, errors = fit.collocation.counts > 0, _errors_seen(fit)
    counts = np.array([sum(independent(piece[:, 0]) for piece in pieces) for pieces in errors])
    lowest = np.concatenate([rebound(pieces) for pieces in errors])
    forgotten = (counts > tried) & (lowest > -REBOUND) & (residual_noise(fit) < LARGE)
    return np.where(seen, forgotten, forgotten[seen].all())


def independent(errors: Floats) -> float:
    """How many independent errors have a variance as uncertain as that of these, (n,).

    Their number over the sum of the squared autocorrelations (Bartlett 1946), which is that of the
    ordinates of their periodogram that matter: few, if they have periods.
    """
    powers = np.abs(np.fft.rfft(errors, max(len(errors), 1))[1:]) ** 2
    return float(4 * powers.sum() ** 2 / (powers**2).sum()) if powers.any() else 0.0


def rebound(pieces: Sequence[Floats]) -> Floats:
    """The lowest autocorrelation of errors at any lag, (d,), as those of `inflation`."""
    covariances = _autocovariances(pieces)
    return covariances.min(axis=0) / np.maximum(covariances[0], LEAST)


def _levinson(covariance: Floats, n: int) -> Floats:
    """The gain for every number of errors that foretell the next."""
    gains = np.zeros(len(covariance))
    if not covariance[0] > 0:
        return gains  # of what was never observed
    variance, weights = covariance[0], np.zeros(0)
    for order in range(1, len(covariance)):
        reflection = (covariance[order] - weights @ covariance[order - 1 : 0 : -1]) / variance
        weights = np.append(weights - reflection * weights[::-1], reflection)
        variance *= 1 - reflection**2
        gains[order] = n * np.log(variance / covariance[0]) + order * np.log(n)
    return gains
