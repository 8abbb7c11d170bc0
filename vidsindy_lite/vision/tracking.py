"""Where the moving target is in each frame of a video file, to a fraction of a pixel.

Three ways to find it stand behind one call. A *background model* (`background`) knows all frames
and finds what differs from what is at rest: to 1/100 of a pixel, as long as camera and background
stay as they are. Where they do not, `moving` takes out the camera's motion and the light's, and
follows what moves most plainly of all that does. A *detector* (`detector`) knows what targets
look like and finds it in each frame on its own, whatever the background does, to a few tenths of a
pixel. The paper has one of that kind, YOLO-v8; what such a detector sees in the single frames is
linked here to one motion.

A frame gets NaN where the target is not seen, or not for sure.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..checks import check_instance, shown
from .background import LONGEST, BackgroundModel, sample_frames, whole_blobs
from .candidates import Candidates, Hint, best_path
from .detector import Detection, LearnedDetector, OnnxDetector, detections
from .moving import Track, follow
from .refining import scatter
from .video import Reel, read_video, video_info

DETECTORS = ("auto", "background", "learned")


def track(
    path: str | os.PathLike, detector: str | os.PathLike = "auto", target: Hint | None = None
) -> Track:
    """Track the one moving target of a video.

    Parameters
    ----------
    path : path
        A video of a target that moves. Other things may move, too, and the camera may tremble or
        be held in the hand.
    detector : {"auto", "background", "learned"} or path
        * "auto": "background" as long as camera, light and background are at rest, and the target
          is of one colour. Else the
          camera's motion and the light's are taken out, and of all that moves the plainest path is
          followed: something that travels, keeps its colour and turns gently. Gaps of a few
          frames in which a part of it shows are filled where its motion leads.
        * "background": for a camera at rest, the most exact. The target may turn and change its
          size, not its shape, and is whole in at least a quarter of the frames that show any of
          it. It must stay away from each place for at least a fifth of the frames: what never
          moves away by about its own width is background here, not for "auto".
        * "learned": the package's own network, for backgrounds that move or change.
        * the name of a YOLO-v8 model exported to ONNX (see `OnnxDetector`).
    target : Hint, optional
        Which of the things that move is the target, for "auto". It is then carried on beyond its
        first and last whole view, too.

    Returns
    -------
    Track
        Its warnings say where something else might be the target, and whether it misses a hint; of
        "background", whether the camera or the background is not at rest.

    Raises
    ------
    FileNotFoundError, ValueError
        If the file is missing, empty, not a video, or holds no frame, or if there is no such
        detector or .onnx file.
    """
    check_detector(detector)
    if target is not None:
        check_instance("target", target, Hint)
        if detector != "auto":
            raise ValueError(f"target: may be given for detector='auto', got {shown(detector)}")
    found = _track(path, detector, target)
    lacking, stated = found.warnings + _lost(found), video_info(path).frames
    if len(found.pixels) != stated:
        lacking += (f"{len(found.pixels)} of its {stated} frames can be read: it is cut off",)
    doubts = tuple(f"{Path(path).name}: {doubt}" for doubt in lacking)
    return replace(found, warnings=doubts)


def _track(path: str | os.PathLike, detector: str | os.PathLike, target: Hint | None) -> Track:
    """The track, its doubts without the name of the file."""
    if detector not in ("auto", "background"):
        return _link_detections(path, detector)
    frames = Reel(path, LONGEST)
    samples = sample_frames(frames)
    model = BackgroundModel(samples)
    if detector == "auto" and model.unrest:
        del model  # its images are large
        return follow(frames, samples, target)
    model.learn_target(samples)
    if detector == "auto" and model.several_colours:
        return follow(frames, samples, target)
    pixels, confidence, blurred = whole_blobs(model, frames.whole)
    found = Track(pixels, confidence, "background")
    if detector == "auto" and (blurred or not _plausible(found, target)):
        return follow(frames, samples, target)
    found = replace(found, warnings=model.unrest)
    if detector == "auto" and _seen(found) < 0.75 and model.shows_target():
        other = follow(frames, samples, target)
        sees_more = _seen(other) > _seen(found) + 0.1
        return other if sees_more and not other.warnings else found
    return found


def _seen(found: Track) -> float:
    """Share of the frames in which the target is seen."""
    return float(np.isfinite(found.pixels[:, 0]).mean())


def _lost(found: Track) -> tuple[str, ...]:
    """Is the target lost in many of the frames from its first to its last?"""
    at = np.flatnonzero(np.isfinite(found.pixels[:, 0]))
    # Share of the frames below which many of them are lost.
    if not len(at) or len(at) >= 0.5 * (between := at[-1] - at[0] + 1):
        return ()
    lost = between - len(at)
    return (f"the target is lost in {lost} of {between} frames, from {at[0]} to {at[-1]}",)


def _plausible(found: Track, hint: Hint | None) -> bool:
    """Is it a smooth motion, and that of what the hint says?"""
    at = np.flatnonzero(np.isfinite(found.pixels[:, 0]))
    if not len(at):
        return False
    if hint is None:
        rough = scatter(at, found.pixels[at])
        # Pixels that a track may scatter about a smooth motion.
        return not np.isfinite(rough) or rough < 1.0
    if hint.box is None or hint.frame not in at:
        return False
    middle = np.array(hint.box[:2]) + (np.array(hint.box[2:]) - 1) / 2
    return bool((np.abs(found.pixels[hint.frame] - middle) <= np.array(hint.box[2:]) / 2).all())


def check_detector(name: str | os.PathLike) -> None:
    """The name of a way to find the target, or of an .onnx file that is there.

    Raises
    ------
    FileNotFoundError, ValueError
        If it is neither.
    """
    if isinstance(name, str) and name in DETECTORS:
        return
    if not isinstance(name, str | os.PathLike) or Path(name).suffix.lower() != ".onnx":
        raise ValueError(
            f"detector: must be one of {', '.join(DETECTORS)}, or the name of an .onnx file, "
            f"got {shown(name)}"
        )
    if not Path(name).is_file():
        raise FileNotFoundError(f"detector: no such file, got '{name}'")


def _link_detections(path: str | os.PathLike, name: str | os.PathLike) -> Track:
    detector = LearnedDetector() if name == "learned" else OnnxDetector(name)
    chain = link([detections(detector.predict(frame)) for frame in read_video(path)])
    pixels = np.array([d.centre if d else (np.nan, np.nan) for d in chain], float)
    return Track(pixels, np.array([d.confidence if d else 0.0 for d in chain]), str(name))


def link(sightings: Sequence[Sequence[Detection]]) -> list[Detection | None]:
    """At most one sighting of each frame, such that together they are one motion.

    They are candidates as good as the detector is sure of them, see `best_path`; a target may be
    away for any time.

    Parameters
    ----------
    sightings : sequence of sequence of Detection
        What is seen in each frame.

    Returns
    -------
    chain : list of Detection or None
        One entry a frame.
    """
    flat = [(i, d) for i, seen in enumerate(sightings) for d in seen]
    rows = np.zeros((len(flat), 14))
    for row, (_, d) in zip(rows, flat, strict=True):
        row[:7] = *d.centre, *(d.centre - d.size / 2), *d.size, d.size.prod()
        row[13] = d.confidence
    seen = Candidates.of(np.array([i for i, _ in flat], int), np.eye(3), rows)
    chain: list[Detection | None] = [None] * len(sightings)
    for row in best_path(seen, len(sightings))[0]:
        chain[flat[row][0]] = flat[row][1]
    return chain
