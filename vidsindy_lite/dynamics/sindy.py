"""`discover` behind the interface of `pysindy.SINDy`, for code that is written for that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from ..arrays import Floats
from ..checks import check_array, check_integer, check_number
from .discovery import Discovery
from .polynomials import PolynomialSystem
from .smoothing import smooth
from .solver import discover
from .splines import WIDTH
from .trajectories import check_trajectory


class SplineSINDy:
    """A model that is fitted as `pysindy.SINDy` is, by `discover`.

    There is nothing to choose but the degree: no threshold, no differentiation method. Rows of NaN
    are missing samples.

    Parameters
    ----------
    degree : int
        Highest degree of the candidate terms.
    seed : int
        See `discover`.

    Attributes
    ----------
    discovery : Discovery
        After `fit`: the law with error bars, status and warnings.
    """

    def __init__(self, degree: int = 3, seed: int = 0) -> None:
        self.degree = check_integer("degree", degree, 1)
        self.seed = check_integer("seed", seed)
        self._law: PolynomialSystem | None = None

    def __repr__(self) -> str:
        return f"SplineSINDy(degree={self.degree}, seed={self.seed})"

    def fit(
        self,
        x: Floats | Sequence[Floats],
        t: float | Floats | Sequence[Floats] = 1.0,
        feature_names: Sequence[str] | None = None,
    ) -> SplineSINDy:
        """Discover the law of one trajectory or of several.

        Parameters
        ----------
        x : array_like, shape (n, d), or list of such
            States.
        t : float, array_like, shape (n,), or list of such
            Time step, or times.
        feature_names : sequence of str, optional
            Of the state variables; x0, x1, ... by default.

        Raises
        ------
        ValueError
            As `discover`, or if there are not as many names as variables.
        """
        runs = _runs(x, t)
        d = runs[0][1].shape[-1]
        names = tuple(f"x{i}" for i in range(d)) if feature_names is None else tuple(feature_names)
        if len(names) != d:
            raise ValueError(f"feature_names: must name {d} variables, got {names}")
        found = discover(runs, degree=self.degree, seed=self.seed, order=1)
        self._law = PolynomialSystem(names, found.system.exponents, found.coefficients)
        self.discovery: Discovery = found
        return self

    @property
    def law(self) -> PolynomialSystem:
        """The law in the model's own names."""
        if self._law is None:
            raise ValueError("model: must be fitted first: call fit(x, t)")
        return self._law

    def predict(self, x: Floats | Sequence[Floats]) -> Floats | list[Floats]:
        """Time derivative at states, shape (n, d), or a list of such."""
        if _are_several(x):
            return [self.law(check_array("x", run)) for run in x]
        return self.law(check_array("x", x))

    def simulate(self, x0: Floats, t: Floats) -> Floats:
        """The path from ``x0``, shape (n, d); NaN after a blow-up."""
        return self.law.simulate(t, x0)

    def score(
        self, x: Floats | Sequence[Floats], t: float | Floats | Sequence[Floats] = 1.0
    ) -> float:
        """Coefficient of determination of the slopes of smoothed data, mean over the variables.

        NaN if a variable stands still.
        """
        measured, slopes, predicted = [], [], []
        for times, states in _runs(x, t):
            seen, values = check_trajectory(times, states)
            if len(seen) < WIDTH:
                raise ValueError(f"x: must hold at least {WIDTH} samples, got {len(seen)}")
            (spline,) = smooth([(seen, values)], np.random.default_rng(self.seed)).splines
            measured.append(values)
            slopes.append(spline.derivative()(seen))
            predicted.append(self.law(spline(seen)))
        truth, guess = np.concatenate(slopes), np.concatenate(predicted)
        left, total = (
            ((truth - middle) ** 2).sum(axis=0) for middle in (guess, truth.mean(axis=0))
        )
        moves = np.ptp(np.concatenate(measured), axis=0) > 0
        return float((1 - left / np.where(moves, total, np.nan)).mean())

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
        """The right-hand sides as text, with so many decimals, or digits where these were zeros."""
        features = self.get_feature_names()
        return [
            " + ".join(
                f"{_number(value, precision)} {feature}"
                for value, feature in zip(row, features, strict=True)
                if value
            )
            or f"{0:.{precision}f}"
            for row in self.coefficients()
        ]

    def print(self, lhs: Sequence[str] | None = None, precision: int = 3) -> None:
        """Print the equations, and warnings if any."""
        left = [f"({name})'" for name in self.law.names] if lhs is None else lhs
        for name, right in zip(left, self.equations(precision), strict=True):
            print(f"{name} = {right}")
        for warning in self.discovery.warnings:
            print(f"warning: {warning}")


def _number(value: float, precision: int) -> str:
    text = f"{value:.{precision}f}"
    return text if float(text) else f"{value:.{precision}g}"


def _are_several(x: Floats | Sequence[Floats]) -> bool:
    """Whether states are those of several trajectories."""
    return isinstance(x, list | tuple) and all(np.ndim(run) == 2 for run in x)


def _runs(
    x: Floats | Sequence[Floats], t: float | Floats | Sequence[Floats]
) -> list[tuple[Floats, Floats]]:
    """Times and states of each trajectory."""
    several = _are_several(x)
    states = [check_array("x", run) for run in (x if several else [x])]
    if not states or any(run.ndim != 2 for run in states):
        shapes = [run.shape for run in states]
        raise ValueError(f"x: must have shape (n, d), or be a list of such, got shapes {shapes}")
    if several and isinstance(t, list | tuple) and all(np.ndim(times) == 1 for times in t):
        times = list(t)
    elif np.ndim(t) == 0:
        step = check_number("t", np.asarray(t).item())
        if not step > 0:
            raise ValueError(f"t: must be a positive time step or increasing times, got {step:g}")
        times = [np.arange(len(run), dtype=float) * step for run in states]
    else:
        times = [cast(Floats, t)] * len(states)
    if len(times) != len(states):
        raise ValueError(f"t: must hold times for {len(states)} trajectories, got {len(times)}")
    return list(zip(times, states, strict=True))
