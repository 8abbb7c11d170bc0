"""What `observe` is given, checked before a video is tracked."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from .arrays import Floats
from .cameras import Clock, Rig
from .checks import check_path, check_vector, shown
from .vision import Hint, VideoInfo, video_info


def check_lags(lags: Sequence[float] | None, clock: Clock, names: Sequence[str]) -> Floats | None:
    """By how much each video starts later than the first, if that is given.

    Each must share half of the shorter one's time with the first.
    """
    if lags is None:
        return None
    given = check_vector("lags", lags, len(names))
    given -= given[0]
    frames, ends = [len(one) for one in clock.frames], clock.ends
    common = np.minimum(given + ends, ends[0]) - np.maximum(given, 0)
    few = common < np.minimum(ends, ends[0]) / 2
    if few.any():
        i = int(few.argmax())
        raise ValueError(
            "lags: every video must have half of the shorter of the two in common with the first "
            f"({frames[0]} frames), got {given[i]:g} for {names[i]} ({frames[i]} frames)"
        )
    return given


def check_paths(paths: Sequence[str | Path], rig: Rig) -> list[Path]:
    """One file name per camera."""
    if isinstance(paths, str) or not isinstance(paths, Iterable):
        raise ValueError(f"paths: must be a list of files, one per camera, got {shown(paths)}")
    files = [check_path(f"paths[{i}]", path) for i, path in enumerate(paths)]
    if len(files) != len(rig.cameras):
        raise ValueError(
            f"paths: there must be one video per camera of the rig ({len(rig.cameras)}), "
            f"got {len(files)}"
        )
    return files


def check_several(
    targets: int, rig: Rig, detector: str | os.PathLike, hints: Sequence[Hint | None] | None
) -> None:
    """That several targets can be told apart."""
    if len(rig.cameras) < 3 or not rig.is_measured:
        known = "known" if rig.is_measured else "unknown"
        raise ValueError(
            f"targets: {targets} need three cameras of known places and directions, got "
            f"{len(rig.cameras)} of {known} ones"
        )
    if detector != "auto" or any(hints or ()):
        raise ValueError(
            f"targets: {targets} are found by detector='auto' alone, without hints, got "
            f"detector={shown(detector)}, hints={shown(hints)}"
        )


def check_shots(files: Sequence[Path], rig: Rig) -> list[VideoInfo]:
    """What each file is, if it is a video of the size that its camera has."""
    shots = [video_info(path) for path in files]
    for path, shot, camera in zip(files, shots, rig.cameras, strict=True):
        if shot.frames < 2:
            raise ValueError(f"paths: {path.name} must be a video, got a single frame")
        if shot.size != camera.image_size:
            raise ValueError(
                f"paths: {path.name} must have the image size of its camera in the rig, "
                f"{camera.image_size}, got {shot.size}"
            )
    return shots


def check_hints(
    hints: Sequence[Hint | None] | None, files: Sequence[Path]
) -> Sequence[Hint | None]:
    """One hint per video, or none."""
    if hints is None:
        return [None] * len(files)
    if not isinstance(hints, Sequence) or len(hints) != len(files):
        raise ValueError(f"hints: must be one per video ({len(files)}) or None, got {shown(hints)}")
    return hints
