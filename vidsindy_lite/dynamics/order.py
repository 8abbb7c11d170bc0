"""First or second order: whether a law of motion, x'' = f(x, x'), is a better guess than x' = f(x).

A body that is thrown, or hangs on a spring, passes the same place with other velocities, so that no
law of first order holds; but its acceleration is nearly a linear function of where it is and how
it moves. In the flows that people write down as x' = f(x) it is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline

from ..arrays import Floats
from ..checks import check_choice
from .candidates import Library
from .discovery import Discovery
from .library import monomial_exponents, monomials
from .splines import DEGREE

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
