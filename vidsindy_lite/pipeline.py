"""From video files to equations: track, learn the cameras, reconstruct, discover."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from tqdm import tqdm

from .ado import discover
from .cameras import Rig, check_learnable, learn_cameras, learn_normal, reconstruct, residuals
from .checks import check_integer, check_path, check_times
from .discovery import Discovery
from .tracking import Track, check_detector, follow
from .video import video_info

DISAGREEMENT = 1.0
"""Pixels by which a good rig misses at most one frame in ten; even whole-pixel tracks are missed by
less than half of that."""


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
    detector: str | os.PathLike = "auto",
    degree: int = 3,
    seed: int = 0,
    progress: bool = False,
) -> VideoDiscovery:
    """Discover the governing equations of a target filmed by several fixed cameras.

    Parameters
    ----------
    paths : sequence of path
        One video file per camera of the rig, all of the same frames.
    rig : Rig
        Positions and normals of all cameras, scale and angle of at least one.
    t : array_like, shape (n,), optional
        Time of each frame, increasing; by default the frame number over the frame rate, in
        seconds. The unit of time is that of the equations.
    detector : str or path
        See `track`.
    degree, seed : int
        See `discover`.
    progress : bool
        Show progress bars.

    Returns
    -------
    VideoDiscovery
        Its first warnings are that the rig does not agree with the tracks, if it does not, and
        which backgrounds are not at rest.

    Raises
    ------
    FileNotFoundError, ValueError
        If a file is missing, cut off or no video, if the numbers of files, cameras or frames
        disagree, if a target is not found, or if cameras or law cannot be learned (see
        `learn_cameras` and `discover`). What can be told before a video is tracked is.
    """
    check_learnable(rig)
    check_integer("degree", degree, 1)
    check_integer("seed", seed)
    check_detector(detector)
    if isinstance(paths, str) or not isinstance(paths, Iterable):
        raise ValueError(f"paths: must be a list of files, one per camera, got {paths!r:.60}")
    paths = [check_path(f"paths[{i}]", path) for i, path in enumerate(paths)]
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
    t = check_times(t)
    if t.shape != (shots[0].frames,):
        raise ValueError(f"t: must have shape ({shots[0].frames},), one per frame, got {t.shape}")
    bar = tqdm(paths, desc="track", disable=not progress, leave=False)
    followed = [_follow(path, len(t), detector) for path in bar]
    tracks = tuple(seen.pixels for seen in followed)
    learned = learn_cameras(tracks, rig)
    x = reconstruct(tracks, learned)
    found = discover(t, x, degree=degree, seed=seed, progress=progress)
    parts = {f.name: getattr(found, f.name) for f in fields(Discovery)}
    parts["warnings"] = (
        *_rig_doubts(tracks, learned, rig, paths),
        *(warning for seen in followed for warning in seen.warnings),
        *found.warnings,
    )
    return VideoDiscovery(**parts, tracks=tracks, rig=learned, t=t, x=x)


def _follow(path: Path, frames: int, detector: str | os.PathLike) -> Track:
    """Track a video that should have so many frames and one moving target."""
    found = follow(path, detector)
    if len(found.pixels) != frames:
        raise ValueError(
            f"paths: {path.name} must hold the {frames} frames that its header states, got "
            f"{len(found.pixels)} that can be read: the file is cut off or damaged, or its header "
            "wrong"
        )
    if not np.isfinite(found.pixels).any():
        raise ValueError(
            f"paths: {path.name} must show one moving target, got none in any frame: what never "
            "moves away from a place by about its own width is taken for background"
        )
    return found


def _rig_doubts(
    tracks: Sequence[np.ndarray], learned: Rig, given: Rig, paths: Sequence[Path]
) -> list[str]:
    """Do the cameras agree on the target to within what tracking can be blamed for?"""
    missed = _missed(tracks, learned)
    if max(missed) <= DISAGREEMENT:
        return []
    # The largest residual does not tell which camera is wrong: the others were fitted to it.
    others = [learn_normal(tracks, given, i) for i in range(len(paths))]
    left = [max(_missed(tracks, other)) for other in others]
    i = int(np.argmin(left))
    normal = ", ".join(f"{value:.3f}" for value in others[i].cameras[i].normal)
    advice = (
        f"the normal ({normal}) of cameras[{i}] ({paths[i].name}) would explain it best"
        if left[i] <= DISAGREEMENT
        else "no single wrong normal explains it; check the positions, the scales and angles that "
        "are given, and that all videos start together"
    )
    sizes = ", ".join(f"{size:.1f}" for size in missed)
    return [
        "the rig does not agree with the tracks: in one frame of ten, tracked and reconstructed "
        f"target lie more than {sizes} pixels apart, where tracking explains {DISAGREEMENT:g}: "
        + advice
    ]


def _missed(tracks: Sequence[np.ndarray], rig: Rig) -> list[float]:
    """Residual in pixels that one frame in ten exceeds, per camera.

    That tenth may hold anything: a few outliers of the tracker do not accuse the rig.
    """
    missed = []
    for residual in residuals(tracks, rig):
        seen = residual[np.isfinite(residual).all(axis=1)]
        missed.append(np.percentile(np.hypot(*seen.T), 90) if len(seen) else 0.0)
    return missed
