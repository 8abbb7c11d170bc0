"""The price of a term, measured on the zoo: wrong terms against the chance of a false alarm.

What the criterion prefers is asked at the truth's own fit, so that no search has a part in it: a
cheap price lets false terms in, a dear one loses true terms, and the sum of both has a minimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Floats
from ..dynamics import Collocation, Segment, State, Units, smooth, subset_search, term_penalties
from .corruption import add_noise
from .sweeps import sweep
from .systems import Benchmark
from .zoo import specimen

if TYPE_CHECKING:  # pandas is imported where a frame is made
    from pandas import DataFrame

CHANCES = tuple(float(chance) for chance in 10.0 ** np.arange(-6, 0.1, 0.5))
"""Chances of a false term that are tried."""
SAMPLES_PER_PERIOD = 60
"""Samples of a period of the motion."""
EXACT = 1e8
"""Physics weight at which the law holds exactly for all that the data can tell."""


@dataclass(frozen=True)
class Case:
    """One specimen, measured.

    Parameters
    ----------
    number : int
        Of the specimen.
    noise : float
        Standard deviation, over that of each coordinate.
    samples : int
        How many.
    """

    number: int
    noise: float
    samples: int


def wrong_terms(case: Case) -> list[tuple[int, int]]:
    """False and lost terms of the cheapest law at each of `CHANCES`."""
    law = specimen(case.number)
    information, gradient, present = _around_truth(law, case)
    right = law.support.T.ravel()
    counts = []
    for chance in CHANCES:
        price = np.tile(term_penalties(law.exponents, law.d, chance), law.d)
        kept, _, _ = subset_search(information, gradient, present, price, right)
        counts.append((int((kept & ~right).sum()), int((right & ~kept).sum())))
    return counts


def _around_truth(law: Benchmark, case: Case) -> tuple[Floats, Floats, Floats]:
    """The quadratic model of all terms around the fitted true ones: see `subset_search`.

    In units of the spread and of a radian of the period.
    """
    rng = np.random.default_rng([case.number, case.samples])
    t, clean = law.trajectory(case.samples, SAMPLES_PER_PERIOD)
    t, scale, time = t * (2 * np.pi / law.period), clean.std(axis=0), law.period / (2 * np.pi)
    true = law.coefficients / Units(np.zeros(law.d), scale, time).factors(law.exponents)
    control = smooth([(t, clean / scale)], rng).splines[0].c
    state = State(control, true, law.support, np.zeros(law.d), np.zeros(law.d, dtype=bool))
    segment = Segment(t, add_noise(clean, case.noise, rng) / scale, t)
    precision, physics = np.full((2, law.d), [[case.noise**-2], [EXACT]])
    fit = Collocation.of([segment], law.exponents, precision, physics).solve(state)
    model = fit.collocation.linearise(fit.state, np.arange(law.exponents.size))
    return model.information, model.gradient, fit.state.coefficients.T.ravel()


def price_curve(
    specimens: int, noises: Sequence[float], lengths: Sequence[int], jobs: int = 2
) -> DataFrame:
    """False and lost terms of the zoo at each chance of a false alarm, per law.

    Parameters
    ----------
    specimens : int
        How many laws, the first of the zoo.
    noises, lengths : sequence
        See `Case`; each with each.
    jobs : int
        Processes.

    Returns
    -------
    DataFrame
        Columns ``false alarm``, ``noise (%)``, ``samples``, ``false``, ``lost``.
    """
    import pandas

    cases = [Case(*case) for case in product(range(specimens), noises, lengths)]
    rows = [
        (chance, 100 * case.noise, case.samples, *count)
        for case, counts in zip(cases, sweep(wrong_terms, cases, jobs=jobs), strict=True)
        for chance, count in zip(CHANCES, counts, strict=True)
    ]
    names = ["false alarm", "noise (%)", "samples", "false", "lost"]
    by = names[:3]
    return pandas.DataFrame(rows, columns=names).groupby(by, sort=True).mean().reset_index()
