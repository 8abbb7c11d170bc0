"""From video files to equations: track, learn the cameras, reconstruct, discover."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from tqdm import tqdm

from .ado import discover
from .cameras import Rig, learn_cameras, reconstruct
from .discovery import Discovery
from .tracking import track
from .video import video_info


@dataclass(frozen=True)
class VideoDiscovery(Discovery):
    """A law discovered from videos, with what the pipeline found on the way.

    Parameters
    ----------
    tracks : tuple of ndarray, shape (n, 2)
        Pixels of the target in each video; NaN where it was not seen.
    rig : Rig
        The cameras, all calibrated.
    t : ndarray, shape (n,)
        Time of each frame.
    x : ndarray, shape (n, 3)
        Reconstructed trajectory in scene units; NaN where fewer than two cameras saw the target.
    """

    tracks: tuple[np.ndarray, ...]
    rig: Rig
    t: np.ndarray
    x: np.ndarray


def discover_from_videos(
    paths: Sequence[str | Path],
    rig: Rig,
    t: np.ndarray | None = None,
    *,
    progress: bool = False,
    **options,
) -> VideoDiscovery:
    """Discover the governing equations of a target filmed by several fixed cameras.

    Parameters
    ----------
    paths : sequence of path
        One video file per camera of the rig, all of the same frames.
    rig : Rig
        Positions and normals of all cameras, scale and angle of at least one.
    t : array_like, shape (n,), optional
        Time of each frame; by default the frame number over the frame rate, in seconds.
    progress : bool
        Show progress bars.
    **options
        Passed to `discover`.

    Returns
    -------
    VideoDiscovery

    Raises
    ------
    FileNotFoundError, ValueError
        If a file is missing or no video, if the numbers of files, cameras or frames disagree, or
        if cameras or law cannot be learned (see `learn_cameras` and `discover`).
    """
    paths = [Path(path) for path in paths]
    if len(paths) != len(rig.cameras):
        raise ValueError(
            f"paths: there must be one video per camera of the rig ({len(rig.cameras)}), "
            f"got {len(paths)}"
        )
    shots = [video_info(path) for path in paths]
    if len({shot.frames for shot in shots}) != 1:
        lengths = ", ".join(
            f"{path.name}: {shot.frames}" for path, shot in zip(paths, shots, strict=True)
        )
        raise ValueError(f"paths: the videos must have the same number of frames, got {lengths}")
    for path, shot, camera in zip(paths, shots, rig.cameras, strict=True):
        if shot.size != camera.image_size:
            raise ValueError(
                f"paths: {path.name} must have the image size of its camera in the rig, "
                f"{camera.image_size}, got {shot.size}"
            )
    if t is None:
        if len({shot.fps for shot in shots}) != 1:
            rates = ", ".join(f"{shot.fps:g}" for shot in shots)
            raise ValueError(f"t: must be given if the videos differ in frame rate, got {rates}")
        t = np.arange(shots[0].frames) / shots[0].fps
    t = np.asarray(t, dtype=float)
    if t.shape != (shots[0].frames,):
        raise ValueError(f"t: must have shape ({shots[0].frames},), one per frame, got {t.shape}")
    bar = tqdm(paths, desc="track", disable=not progress, leave=False)
    tracks = tuple(track(path) for path in bar)
    learned = learn_cameras(tracks, rig)
    x = reconstruct(tracks, learned)
    found = discover(t, x, progress=progress, **options)
    parts = {f.name: getattr(found, f.name) for f in fields(Discovery)}
    return VideoDiscovery(**parts, tracks=tracks, rig=learned, t=t, x=x)
