"""What is said when tracks do not lead to a path or a law: the step, and where to look first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from .arrays import Floats

_JUMP = 8.0  # medians of a track's steps; more is a jump, ...
_JUMPY = 0.02  # ... and a track with more of them than this, ...
_STILL = 2.0  # pixels; ... or one that stays within that, ...
_SPARSE = 0.5  # ... or of a target that is seen in fewer frames than that, may be of something else


class Refused(ValueError):
    """Tracks from which no path or law can be had.

    Parameters
    ----------
    message : str
    step : {"track", "lags", "cameras", "law"}
        What could not be done.
    tracks : sequence of ndarray, shape (n_i, 2)
        Pixels of the target in each video up to there.
    """

    def __init__(self, message: str, step: str, tracks: Sequence[Floats]) -> None:
        super().__init__(message)
        self.step = step
        self.tracks = tuple(tracks)


class Stopped(KeyboardInterrupt):
    """An interruption when there were tracks already; see `Refused`."""

    def __init__(self, step: str, tracks: Sequence[Floats]) -> None:
        super().__init__("stopped before there was a law")
        self.step = step
        self.tracks = tuple(tracks)


@contextmanager
def refusing(step: str, tracks: Sequence[Floats], names: Sequence[str]) -> Iterator[None]:
    """What cannot be done in a step, as a refusal that says where to look first.

    And an interruption with the tracks, which took the longest.
    """
    try:
        yield
    except (Refused, Stopped):
        raise
    except KeyboardInterrupt:
        raise Stopped(step, tracks) from None
    except ValueError as error:
        message = f"{error}; likely causes, in this order: {_likely_causes(step, tracks, names)}"
        raise Refused(message, step, tracks) from None


def _likely_causes(step: str, tracks: Sequence[Floats], names: Sequence[str]) -> str:
    """Tracker, lags and rig, with what the tracks say of the first."""
    strange = [
        name for track, name in zip(tracks, names, strict=True)
        if any(map(_is_strange, np.split(track, track.shape[1] // 2, axis=1)))
    ]  # fmt: skip
    tracker = "the tracker" + (f" (look at {', '.join(strange)})" if strange else "")
    if len(tracks) == 1:
        return tracker
    if strange or step == "track":
        return f"{tracker}, the lags, the rig"
    return f"the lags, the rig, {tracker}" if step == "lags" else f"the rig, the lags, {tracker}"


def _is_strange(track: Floats) -> bool:
    """Whether a track jumps, trembles, stands still, or is mostly missing."""
    seen = np.isfinite(track).all(axis=1)
    steps, turns = (np.hypot(*np.diff(track, n, axis=0).T) for n in (1, 2))
    steps, turns = steps[np.isfinite(steps)], turns[np.isfinite(turns)]
    if not len(turns) or seen.mean() < _SPARSE:
        return True
    jumps = np.mean(steps > _JUMP * max(np.median(steps), 1.0)) > _JUMPY
    still = np.ptp(track[seen], axis=0).max() < _STILL
    return bool(jumps or still or np.median(turns) > np.median(steps))
