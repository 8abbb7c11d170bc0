"""From video files to equations: `observe`, then `discover` on the path that it reconstructs."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from numpy.typing import ArrayLike

from .cameras import Rig
from .checks import check_integer
from .dynamics import Discovery, discover
from .observation import Observation, observe
from .vision import Hint


@dataclass(frozen=True, eq=False)
class VideoDiscovery(Observation):
    """An observation and the law that it obeys; its warnings are those of both.

    Parameters
    ----------
    discovery : Discovery
        The law in the frame of the rig and in its own, sparsest frame.
    """

    discovery: Discovery

    def __str__(self) -> str:
        warnings = (f"warning: {text}" for text in self.warnings)
        return "\n".join([self.discovery.equations(), *warnings])


def discover_from_videos(
    paths: Sequence[str | Path],
    rig: Rig,
    t: ArrayLike | None = None,
    *,
    lags: Sequence[float] | None = None,
    detector: str | os.PathLike = "auto",
    hints: Sequence[Hint | None] | None = None,
    degree: int = 3,
    seed: int = 0,
    progress: bool = False,
) -> VideoDiscovery:
    """Discover the governing equations of a target filmed by several fixed cameras.

    This is `observe`, then `discover` on the path that it reconstructs.

    Parameters
    ----------
    paths, rig, t, lags, detector, hints, progress
        See `observe`. The unit of time is that of the equations.
    degree, seed : int
        See `discover`.

    Returns
    -------
    VideoDiscovery

    Raises
    ------
    FileNotFoundError, ValueError
        See `observe` and `discover`. What can be told before a video is tracked is.
    """
    check_integer("degree", degree, 1)
    check_integer("seed", seed)
    seen = observe(
        paths, rig, t, lags=lags, detector=detector, hints=hints, progress=progress
    )
    found = discover(
        seen.t, seen.x, degree=degree, seed=seed, progress=progress, systematic=seen.systematic
    )
    parts = vars(seen) | {"warnings": (*seen.warnings, *found.warnings)}
    return VideoDiscovery(**parts, discovery=found)
