"""`discover` behind the interface of `pysindy.SINDy`, for code that is written for that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from ..arrays import Floats
from ..checks import check_array, check_number
from .discovery import Discovery
from .polynomials import PolynomialSystem
from .smoothing import smooth
from .solver import discover
from .trajectories import check_trajectory


class SplineSINDy:
    """A model that is fitted as `pysindy.SINDy` is, by `discover`.

    There is nothing to choose but the degree: no threshold, no differentiation method. Rows of NaN
    are missing samples.

    Parameters
    ----------
    degree : int
        Highest degree of the candidate terms.
    feature_names : sequence of str, optional
        Of the state variables; x0, x1, ... by default.
    seed : int
        See `discover`.

    Attributes
    ----------
    discovery : Discovery
        After `fit`: the law with error bars, status and warnings.
    """

    def __init__(
        self, degree: int = 3, feature_names: Sequence[str] | None = None, seed: int = 0
    ) -> None:
        self.degree, self.feature_names, self.seed = degree, feature_names, seed

    def fit(
        self, x: Floats | Sequence[Floats], t: float | Floats | Sequence[Floats] = 1.0
    ) -> SplineSINDy:
        """Discover the law of one trajectory or of several.

        Parameters
        ----------
        x : array_like, shape (n, d), or list of such
            States.
        t : float, array_like, shape (n,), or list of such
            Time step, or times.

        Raises
        ------
        ValueError
            As `discover`, or if there are not as many names as variables.
        """
        runs = _runs(x, t)
        found = discover(runs, degree=self.degree, seed=self.seed)
        d = found.system.d
        names = tuple(self.feature_names or (f"x{i}" for i in range(d)))
        if len(names) != d:
            raise ValueError(f"feature_names: must name {d} variables, got {names}")
        self._law = PolynomialSystem(names, found.system.exponents, found.coefficients)
        self.discovery: Discovery = found
        return self

    @property
    def law(self) -> PolynomialSystem:
        """The law in the model's own names; an AttributeError before `fit`."""
        return self._law

    def predict(self, x: Floats) -> Floats:
        """Time derivative at states, shape (n, d)."""
        return self.law(check_array("x", x))

    def simulate(self, x0: Floats, t: Floats) -> Floats:
        """The path from ``x0``, shape (n, d); NaN after a blow-up."""
        return self.law.simulate(t, x0)

    def score(self, x: Floats | Sequence[Floats], t: float | Floats | Sequence[Floats]) -> float:
        """Coefficient of determination of the slopes of smoothed data, mean over the variables."""
        slopes, predicted = [], []
        for times, states in _runs(x, t):
            seen = check_trajectory(times, states)
            (spline,) = smooth([seen], np.random.default_rng(self.seed)).splines
            slopes.append(spline.derivative()(seen[0]))
            predicted.append(self.predict(spline(seen[0])))
        truth, guess = np.concatenate(slopes), np.concatenate(predicted)
        left = ((truth - guess) ** 2).sum(axis=0)
        return float((1 - left / ((truth - truth.mean(axis=0)) ** 2).sum(axis=0)).mean())

    def coefficients(self) -> Floats:
        """One row an equation, one column a feature, shape (d, l)."""
        return self.law.coefficients.T.copy()

    def get_feature_names(self) -> list[str]:
        """Names of the features, e.g. ``["1", "x0", "x1", "x0^2", "x0 x1", "x1^2"]``."""
        return [
            " ".join(
                name if power == 1 else f"{name}^{power}"
                for name, power in zip(self.law.names, powers, strict=True)
                if power
            )
            or "1"
            for powers in self.law.exponents.tolist()
        ]

    def equations(self, precision: int = 3) -> list[str]:
        """The right-hand sides as text."""
        features = self.get_feature_names()
        return [
            " + ".join(
                f"{value:.{precision}f} {feature}"
                for value, feature in zip(row, features, strict=True)
                if value
            )
            or f"{0:.{precision}f}"
            for row in self.coefficients()
        ]

    def print(self, precision: int = 3) -> None:
        """Print the equations."""
        for name, right in zip(self.law.names, self.equations(precision), strict=True):
            print(f"({name})' = {right}")


def _runs(
    x: Floats | Sequence[Floats], t: float | Floats | Sequence[Floats]
) -> list[tuple[Floats, Floats]]:
    """Times and states of each trajectory."""
    several = isinstance(x, list | tuple) and np.ndim(x[0]) == 2
    states = [check_array("x", run) for run in (x if several else [x])]
    if np.ndim(t) == 0:
        step = check_number("t", cast(float, t))
        if not step > 0:
            raise ValueError(f"t: must be a positive time step or increasing times, got {step:g}")
        return [(np.arange(len(run), dtype=float) * step, run) for run in states]
    given = cast(Sequence[Floats], t)
    times = list(given) if several and np.ndim(given[0]) == 1 else [np.asarray(t)] * len(states)
    if len(times) != len(states):
        raise ValueError(f"t: must hold times for {len(states)} trajectories, got {len(times)}")
    return list(zip(times, states, strict=True))
