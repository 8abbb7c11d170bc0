"""Terms that a law has not: between which values each could be, and which the data could not see.

No term in a law means no evidence for it, which is little where the data can hardly tell.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.interpolate import BSpline

from ..arrays import Floats
from .beyond import newcomers, place
from .collocation import Linearisation
from .polynomials import PolynomialSystem
from .problem import Problem
from .state import State

HALF_WIDTH = 1.96
"""Of a 95 % interval, in standard errors."""


def intervals(problem: Problem, state: State, model: Linearisation, tolerated: Floats) -> Floats:
    """Between which values each absent candidate term would be if it alone joined the law.

    With the information ``S`` and the gradient ``g`` of the last fit, of which the curve is
    eliminated, and the terms ``A`` of the law (and its moving axes), a candidate k is estimated as
    ``(g_k - S_kA inv(S_AA) g_A) v`` with the variance ``v = 1 / (S_kk - S_kA inv(S_AA) S_Ak)``:
    all that the law has is fitted again.

    Parameters
    ----------
    problem : Problem
    state : State
        Of the last fit.
    model : Linearisation
        Around it, of all candidates.
    tolerated : ndarray, shape (d,)
        Errors at which the terms of each equation were chosen, over those of the fit.

    Returns
    -------
    ndarray, shape (l, d, 2)
        95 % intervals in the law's own frame and the units of the data; NaN for what is in the law
        or no candidate, infinite where the data cannot tell a term from those of the law.
    """
    l, d = state.coefficients.shape
    own = np.flatnonzero(state.free())
    others = np.setdiff1d(problem.form.searched, own)
    model = model.of(np.concatenate([own, others]))
    estimate, variance = newcomers(model.information, model.gradient, len(own))
    spread = HALF_WIDTH * np.sqrt(variance) * tolerated[others // l]
    flat = np.full((l * d, 2), np.nan)
    flat[others] = np.column_stack([estimate - spread, estimate + spread])
    flat = flat[problem.form.shared]  # directions of a vector have the interval of the first
    factors = problem.units.factors(problem.exponents)
    return flat.reshape(d, l, 2).swapaxes(0, 1) * factors[:, :, None]


def unseen(
    law: PolynomialSystem, offset: Floats, curves: Sequence[BSpline], absent: Floats
) -> Iterator[str]:
    """Absent terms that may make more of a slope than one of the law does, the largest first.

    How much a term makes of a slope is its root mean square along the curve.
    """
    x = np.concatenate([curve(np.unique(curve.t)) for curve in curves]) - offset
    size = np.sqrt((law.library(x) ** 2).mean(axis=0))[:, None]
    own = np.where(law.support, size * np.abs(law.coefficients), np.inf).min(axis=0)
    most = np.nan_to_num(np.abs(absent).max(axis=2), nan=0.0, posinf=np.inf)
    with np.errstate(invalid="ignore"):  # of an equation without terms
        reach = size * most / own
    for entry in np.argsort(-reach, axis=None, kind="stable")[: int((reach > 1).sum())].tolist():
        row, j = divmod(entry, law.d)
        low, high = absent[row, j]
        between = f"{low:.2g} to {high:.2g}" if np.isfinite(most[row, j]) else "of any size"
        yield f"{place(law, j * len(law.terms) + row)} ({between})"
