"""The realistic scene: an irregular target tumbles behind trees, and the images are noisy.

SprottF from another start, filmed in full by three cameras with all disturbances of the paper at
once: a target of irregular shape, random self-rotation, a size that changes as if it came nearer
and receded, image noise of variance 0.01, and a tree in front of each camera, behind which the
target vanishes.

::

    runs = sweep(run_scene, [SceneTask(trial) for trial in range(5)])

Paper: section "Simulating Realistic Scenarios", Fig. 4.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ..arrays import Bools, Floats, Image, Ints
from ..cameras import Camera, Rig
from ..checks import check_integer
from ..dynamics import Discovery, discover
from ..observation import observe_tracks
from ..vision import Scene, Track, read_frame, render_labelled, track, write_video
from .films import SAMPLES_PER_PERIOD, TOGETHER
from .metrics import Score, score
from .systems import REFERENCE_OFFSET, SYSTEMS, Benchmark

START = (-1.17, -1.1, 1.0)
"""Where the motion begins, in the native frame."""
DISTURBANCES = {
    "shape": "irregular",
    "tumbling": 1.0,
    "size_variation": 0.25,
    "noise_variance": 0.01,
}
"""What all cameras have to cope with, as fields of `Scene`; the tree differs from view to view."""

_SIZE = 0.055  # diameter of the target, share of the image's width
_TREE = 0.24, 0.66  # width and height of a tree, shares of the image
_WHOLE = 0.999  # visible share from which a view counts as whole: edges are rounded
_NOTHING = 0.01  # visible share below which the target counts as hidden: a pixel of its rim
_SHIFT = 0.12  # of the image: how far from its middle a tree stands at most


@dataclass(frozen=True)
class SceneTask:
    """One film of the realistic scene.

    Parameters
    ----------
    trial : int
        Seed of target, backgrounds, trees, tumbling and noise.
    frames : int
        Per camera.
    image_size : (width, height)
    """

    trial: int = 0
    frames: int = 400
    image_size: tuple[int, int] = (512, 512)


@dataclass(frozen=True, eq=False)
class View:
    """What one camera saw, and what was hidden from it.

    Parameters
    ----------
    scene : Scene
    shown : int
        Number of the frame in the middle of those in which the target was found.
    image : ndarray, shape (height, width, 3), uint8
        That frame, blue-green-red.
    track : Track
        As found in the video file.
    truth : ndarray, shape (n, 2)
        True pixels of the target, also where it is hidden.
    visible : ndarray, shape (n,)
        Share of the target that can be seen, in [0, 1].
    """

    scene: Scene
    shown: int
    image: Image
    track: Track
    truth: Floats
    visible: Floats

    @property
    def errors(self) -> Floats:
        """Distance of tracked and true pixels, (n,); NaN where the target was not found."""
        return np.linalg.norm(self.track.pixels - self.truth, axis=1)

    @property
    def hidden(self) -> Bools:
        """Frames in which nothing of the target can be seen, (n,) bool."""
        return self.visible < _NOTHING

    @property
    def delays(self) -> Ints:
        """Whole views after each time that it was hidden, until it is found again, (k,) int."""
        whole, found = self.visible > _WHOLE, np.isfinite(self.errors)
        ends = np.flatnonzero(self.hidden[:-1] & ~self.hidden[1:]) + 1
        back = [end + np.argmax(np.append(found[end:], True)) for end in ends]
        return np.array([whole[a:b].sum() for a, b in zip(ends, back, strict=True)], int)


@dataclass(frozen=True, eq=False)
class SceneResult:
    """From the videos of the realistic scene to the equations.

    Parameters
    ----------
    task : SceneTask
    truth : Benchmark
        The system in the reference frame.
    views : tuple of View
        One per camera.
    t : ndarray, shape (n,)
        Time of each frame, in time units of the system.
    x, path : ndarray, shape (n, 3)
        True and reconstructed positions; the path is NaN where fewer than two cameras saw the
        target.
    found : Discovery
    score : Score
        Of the law, in the reference frame.
    seconds : float
        From path to law.
    """

    task: SceneTask
    truth: Benchmark
    views: tuple[View, ...]
    t: Floats
    x: Floats
    path: Floats
    found: Discovery
    score: Score
    seconds: float


def run_scene(task: SceneTask) -> SceneResult:
    """Film the scene, track it, learn cameras 2 and 3, reconstruct and discover."""
    truth = replace(SYSTEMS["SprottF"], x0=START).shift(REFERENCE_OFFSET)
    t, x = truth.trajectory(task.frames, SAMPLES_PER_PERIOD)
    rig = Rig.around(x, task.image_size)
    views = film_scene(rig, x, task.trial)
    tracks = [view.track.pixels for view in views]
    seen = observe_tracks(tracks, rig.uncalibrated(keep=0), t, lags=TOGETHER)
    began = time.perf_counter()
    found = discover(t, seen.x, seed=task.trial, systematic=seen.systematic)
    seconds = time.perf_counter() - began
    return SceneResult(task, truth, views, t, x, seen.x, found, score(found, truth), seconds)


def film_scene(rig: Rig, x: Floats, seed: int = 0) -> tuple[View, ...]:
    """Film a path with each camera of a rig and track it; the videos are removed.

    Parameters
    ----------
    rig : Rig
        Calibrated.
    x : ndarray, shape (n, 3)
    seed : int
    """
    sequence = np.random.SeedSequence(check_integer("seed", seed))
    target, *streams = sequence.spawn(1 + len(rig.cameras))
    drawn = Scene.random(np.random.default_rng(target), **DISTURBANCES)
    common = DISTURBANCES | {name: getattr(drawn, name) for name in ("colour", "shape_seed")}
    views = []
    for camera, stream in zip(rig.cameras, streams, strict=True):
        rng = np.random.default_rng(stream)
        own = {"trees": (_tree_before(camera, rng),), "image_size": camera.image_size}
        scene = Scene.random(rng, **common, **own, size=_SIZE * camera.image_size[0])
        views.append(_view(camera.project(x), scene, int(rng.integers(2**31))))
    return tuple(views)


def _tree_before(camera: Camera, rng: np.random.Generator) -> tuple[int, int, int, int]:
    """A tree that stands on the lower border, somewhere near the middle."""
    width, height = camera.image_size
    across, up = round(_TREE[0] * width), round(_TREE[1] * height)
    left = round((0.5 + rng.uniform(-_SHIFT, _SHIFT)) * width - across / 2)
    return left, height - up, across, up


def _view(pixels: Floats, scene: Scene, seed: int) -> View:
    """Film pixels before a scene and track them."""
    visible: list[float] = []

    def frames() -> Iterator[Image]:
        for drawn in render_labelled(pixels, scene, seed):
            visible.append(drawn.visible)
            yield drawn.frame

    with TemporaryDirectory() as folder:
        video = write_video(Path(folder) / "view.mov", frames())
        found = track(video)
        seen = np.flatnonzero(np.isfinite(found.pixels).all(axis=1))
        shown = int(seen[len(seen) // 2]) if len(seen) else 0
        image = read_frame(video, shown)
    return View(scene, shown, image, found, pixels, np.array(visible))
