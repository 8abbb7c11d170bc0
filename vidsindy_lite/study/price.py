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
    """One specimen, measured under some conditions: to draw it takes longer than to measure it.

    Parameters
    ----------
    number : int
        Of the specimen.
    conditions : tuple of (float, int)
        Standard deviation of the noise, over that of each coordinate, and number of samples.
    """

    number: int
    conditions: tuple[tuple[float, int], ...]


def wrong_terms(case: Case) -> list[list[tuple[int, int]]]:
    """False and lost terms of the cheapest law under each condition, at each of `CHANCES`."""
    law = specimen(case.number)
    return [
        _counts(law, *_around_truth(law, case.number, *condition)) for condition in case.conditions
    ]


def _counts(
    law: Benchmark, information: Floats, gradient: Floats, present: Floats
) -> list[tuple[int, int]]:
    """The same of one quadratic model."""
    right = law.support.T.ravel()
    counts = []
    for chance in CHANCES:
        price = np.tile(term_penalties(law.exponents, law.d, chance), law.d)
        kept, _, _ = subset_search(information, gradient, present, price, right)
        counts.append((int((kept & ~right).sum()), int((right & ~kept).sum())))
    return counts


def _around_truth(
    law: Benchmark, number: int, noise: float, samples: int
) -> tuple[Floats, Floats, Floats]:
    """The quadratic model of all terms around the fitted true ones: see `subset_search`.

    In units of the spread and of a radian of the period.
    """
    rng = np.random.default_rng([number, samples])
    t, clean = law.trajectory(samples, SAMPLES_PER_PERIOD)
    t, scale, time = t * (2 * np.pi / law.period), clean.std(axis=0), law.period / (2 * np.pi)
    true = law.coefficients / Units(np.zeros(law.d), scale, time).factors(law.exponents)
    control = smooth([(t, clean / scale)], rng).splines[0].c
    state = State(control, true, law.support, np.zeros(law.d), np.zeros(law.d, dtype=bool))
    segment = Segment(t, add_noise(clean, noise, rng) / scale, t)
    precision, physics = np.full((2, law.d), [[noise**-2], [EXACT]])
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
        Of the conditions of a `Case`; each with each.
    jobs : int
        Processes.

    Returns
    -------
    DataFrame
        Columns ``false alarm``, ``noise (%)``, ``samples``, ``false``, ``lost``.
    """
    import pandas

    conditions = tuple(product(noises, lengths))
    cases = [Case(number, conditions) for number in range(specimens)]
    rows = [
        (chance, 100 * noise, samples, *count)
        for found in sweep(wrong_terms, cases, jobs=jobs, desc="specimens")
        for (noise, samples), counts in zip(conditions, found, strict=True)
        for chance, count in zip(CHANCES, counts, strict=True)
    ]
    names = ["false alarm", "noise (%)", "samples", "false", "lost"]
    by = names[:3]
    return pandas.DataFrame(rows, columns=names).groupby(by, sort=True).mean().reset_index()
