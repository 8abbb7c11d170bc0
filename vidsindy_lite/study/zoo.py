"""A zoo of random sparse laws that are in no exam: what is chosen by measuring is chosen on these.

A law of one to four states has few terms, of random signs and sizes, mostly of low degree. Laws are
drawn until one keeps its motion bounded and does not come to rest (of one state: moves at all).
"""

from functools import cache

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..dynamics import monomial_exponents, monomials, variable_names
from .systems import Benchmark

DEGREE = 3
"""Highest degree of a law."""
EXTRA_TERMS = 0.5
"""Chance of one term more in an equation, each time."""
SIZES = (0.3, 3.0)
"""Smallest and largest coefficient; their logarithms are even."""
HERD, SPAN, STEP = 512, 20.0, 0.04
"""Laws that are tried at a time; how long each is followed, and by what steps."""
FAR, STILL, LASTING = 8.0, 0.2, 0.5
"""Largest state, least standard deviation of one, and how much of it the second half must keep."""
EXAMINED, PER_PERIOD = 1000, 60
"""Samples, and samples of a period, that have to stay bounded in an exact integration, too."""


@cache
def specimen(number: int) -> Benchmark:
    """The law of a number, with a start and the period of its motion.

    Parameters
    ----------
    number : int
        Seeds the draw; numbers in a row have one, two, three and four states in turn.
    """
    d, rng = 1 + number % 4, np.random.default_rng([4, number])
    exponents = monomial_exponents(d, DEGREE)
    while True:
        laws, starts = _drawn(rng, exponents), rng.normal(size=(HERD, d))
        paths = _paths(laws, starts, exponents)
        for k in np.flatnonzero(_alive(paths)).tolist():
            slopes = np.gradient(paths[k], STEP, axis=0) / paths[k].std(axis=0)
            period, x0 = 2 * np.pi / float(slopes.std()), tuple(map(float, starts[k]))
            names, title = variable_names(d), f"specimen {number}"
            found = Benchmark(names, exponents, laws[k], title, x0, period)
            _, x = found.trajectory(EXAMINED, PER_PERIOD)
            if np.isfinite(x).all() and np.abs(x).max() < FAR:
                return found


def _drawn(rng: np.random.Generator, exponents: Ints) -> Floats:
    """Random sparse coefficients, (herd, l, d): a term's chance halves with each degree."""
    l, d = exponents.shape
    degrees = exponents.sum(axis=1)
    likely = 0.5**degrees / np.bincount(degrees)[degrees]
    count = rng.geometric(1 - EXTRA_TERMS, size=(HERD, 1, d))
    # The few largest of log(u) / p are a draw without replacement (Efraimidis and Spirakis 2006).
    order = np.log(rng.random((HERD, l, d))) / likely[:, None]
    rank = np.argsort(np.argsort(-order, axis=1), axis=1)
    sizes = SIZES[0] * (SIZES[1] / SIZES[0]) ** rng.random((HERD, l, d))
    return np.where(rank < count, rng.choice([-1.0, 1.0], size=sizes.shape) * sizes, 0.0)


@np.errstate(over="ignore", invalid="ignore")  # of those that run away, and are not taken
def _paths(laws: Floats, x: Floats, exponents: Ints) -> Floats:
    """Paths of all laws by Runge-Kutta steps, (herd, n, d)."""

    def rate(x: Floats) -> Floats:
        x = np.clip(x, -1e3, 1e3)
        return np.einsum("hl,hld->hd", monomials(x, exponents), laws)

    path = [x]
    for _ in range(int(SPAN / STEP)):
        k1 = rate(x)
        k2 = rate(x + STEP / 2 * k1)
        k3 = rate(x + STEP / 2 * k2)
        x = x + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + rate(x + STEP * k3))
        path.append(x)
    return np.stack(path, axis=1)


def _alive(paths: Floats) -> Bools:
    """Which paths are bounded and go on moving, (herd,)."""
    bounded = (np.abs(paths) < FAR).all(axis=(1, 2))
    spread = paths.std(axis=1)
    late = paths[:, paths.shape[1] // 2 :].std(axis=1)
    lasting = LASTING if paths.shape[2] > 1 else 0.0
    return bounded & (spread > STILL).all(axis=1) & (late >= lasting * spread).all(axis=1)
