"""What others have published of the benchmarks of the scoreboard: their numbers, not our runs.

The numbers stand in ``rivals.toml``, each with its source and with what the method was given.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..arrays import Floats


@dataclass(frozen=True, eq=False)
class LorenzGrid:
    """How often a method finds the terms of the Lorenz system, over noise and length.

    Parameters
    ----------
    method, source, given : str
        Who, where, and what it was told beside the data.
    levels : ndarray, shape (m,)
        Standard deviation of the noise over that of all coordinates together.
    lengths : ndarray, shape (k,)
        Time units.
    rates : ndarray, shape (m, k)
        Shares of the draws.
    """

    method: str
    source: str
    given: str
    levels: Floats
    lengths: Floats
    rates: Floats


_PUBLISHED = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))


def _lorenz_grid() -> LorenzGrid:
    grid = _PUBLISHED["lorenz_grid"]
    about = {key: grid[key] for key in ("method", "source", "given")}
    levels, lengths = np.array(grid["levels"], float), np.array(grid["lengths"], float)
    return LorenzGrid(**about, levels=levels, lengths=lengths, rates=_shares(grid))


def _shares(grid: dict) -> Floats:
    return np.asarray(np.array(grid["exact"], float) / grid["draws"])


LORENZ_GRID = _lorenz_grid()
"""The best published grid."""

R2_SOURCE: str = _PUBLISHED["odebench"]["source"]
R2_GIVEN: str = _PUBLISHED["odebench"]["given"]
"""What the methods of `R2_RATES` were told beside the data."""
R2_RATES: dict[str, dict[tuple[float, float], float]] = {
    method: {
        (float(noise), float(dropped)): rate / 100
        for (noise, dropped), rate in zip(_PUBLISHED["odebench"]["conditions"], rates, strict=True)
    }
    for method, rates in _PUBLISHED["odebench"]["rates"].items()
}
"""Share of ODEBench's equations whose law follows the fitted trajectory with R^2 above 0.9, by
method and by (noise, share of dropped samples); NaN where nothing is published."""
