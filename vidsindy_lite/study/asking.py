"""Where the law is asked for: the error of its coefficients against times and physics weight.

The paper asks at many random times, the solver once in every knot span. Here both get the right
terms, so that no search has a part in it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Floats
from ..dynamics import Collocation, Segment, State, fit_curves, smooth
from .corruption import add_noise
from .systems import REFERENCE_OFFSET, SYSTEMS

WIDE = 3
"""Samples in a knot span."""


@dataclass(frozen=True)
class Asked:
    """A fit of a benchmark's right terms.

    Parameters
    ----------
    system : str
        Name of a benchmark.
    noise : float
        Standard deviation, over that of each coordinate.
    samples : int
        How many.
    places : {"middles", "even", "random"}
        Where in every knot span the law has to hold: in its middle, at even distances, or anywhere.
    per_span : int
        How often; once in its middle.
    tolerated : float
        Residual of the law, over the rms speed of each coordinate, that counts as much as an error
        of a sample of one standard deviation: the physics weight is the inverse of its square.
    trial : int
        Draw of the noise and of the random times.
    """

    system: str
    noise: float
    samples: int
    places: str
    per_span: int
    tolerated: float
    trial: int


def law_error(asked: Asked) -> float:
    """Distance of the fitted coefficients to the true ones, over the size of these (l2)."""
    law = SYSTEMS[asked.system]
    rng = np.random.default_rng(asked.trial)
    t, clean = law.shift(REFERENCE_OFFSET).trajectory(asked.samples)
    x = add_noise(clean, asked.noise, rng)
    segment = Segment.even(t, x, WIDE * (t[1] - t[0]), 0)
    errors = asked.noise * clean.std(axis=0)
    speed = np.sqrt((law(clean - REFERENCE_OFFSET) ** 2).mean(axis=0))
    physics = (asked.tolerated * speed) ** -2
    fit = Collocation.of([segment], law.exponents, errors**-2, physics)
    if asked.places != "middles":
        fit = replace(fit, grid=fit.grid.asked_at([_times(segment.breakpoints, asked, rng)]))
    control = fit_curves(fit, smooth([(t, x)], rng).splines)
    moving = np.array(REFERENCE_OFFSET) != 0
    start = State(control, law.coefficients, law.support, np.array(REFERENCE_OFFSET), moving)
    found = fit.solve(start).state.coefficients
    return float(np.linalg.norm(found - law.coefficients) / np.linalg.norm(law.coefficients))


def _times(breakpoints: Floats, asked: Asked, rng: np.random.Generator) -> Floats:
    """When the law has to hold: equally often in every span."""
    width = np.diff(breakpoints)[:, None]
    share = (np.arange(asked.per_span) + 0.5) / asked.per_span
    if asked.places == "random":
        share = rng.random((len(width), asked.per_span))
    return np.sort((breakpoints[:-1, None] + width * share).ravel())
