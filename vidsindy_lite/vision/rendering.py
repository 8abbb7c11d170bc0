"""Frames of a target that moves through a scene, one camera at a time.

A pixel track (the centroid of the target in each frame) and a `Scene` become frames. Pixel
convention: u to the right, v down, pixel centres at integer coordinates, so that the centre of the
top left pixel is (0, 0).
"""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from ..arrays import Floats, Floats32, Image, Ints
from ..checks import check_array, check_instance, check_integer, check_rows
from .scenery import BACKGROUNDS, bark, leaves, tree
from .scenes import COLOURS, Scene
from .video import write_video

_SCANLINES = 16  # per row of pixels, when the target is drawn
_NORMAL = ndtri((np.arange(2**16) + 0.5) / 2**16).astype(np.float32)  # quantiles, all as likely


def coverage(polygon: Floats) -> tuple[Floats, Ints]:
    """Share of each pixel covered by a polygon (m, 2) in pixels.

    Along u the area is exact, along v it is the mean over 16 scan lines a pixel. (OpenCV's filled
    polygons include their outline, which shifts small shapes by up to 0.05 px even oversampled.)

    Returns
    -------
    alpha : (h, w) float in [0, 1]
    corner : (2,) int
        Column and row of the first pixel of `alpha`.
    """
    corner = np.floor(polygon.min(axis=0)).astype(int) - 1
    width, height = np.ceil(polygon.max(axis=0)).astype(int) + 3 - corner
    x0, y0 = (polygon - corner + 0.5).T  # from here on pixel i covers [i, i + 1]
    x1, y1 = np.roll(x0, -1), np.roll(y0, -1)
    y = (np.arange(height * _SCANLINES) + 0.5) / _SCANLINES
    # Each edge crosses the scan lines from `first` to before `end`; ordered by line, then by edge.
    first, end = np.searchsorted(y, [np.minimum(y0, y1), np.maximum(y0, y1)])
    count = end - first
    edge = np.repeat(np.arange(len(polygon)), count)
    line = np.arange(len(edge)) + np.repeat(first - np.cumsum(count) + count, count)
    order = np.argsort(line, kind="stable")
    line, edge = line[order], edge[order]
    x = x0[edge] + (y[line] - y0[edge]) * (x1 - x0)[edge] / (y1 - y0)[edge]
    # To the right of a crossing everything is inside (or outside): its pixel gets the share right
    # of it, the next one the rest, and the running sum along the row does the filling.
    first = (line // _SCANLINES) * width + x.astype(int)
    rest = x % 1
    step = np.sign(y1 - y0)[edge] / _SCANLINES
    change = np.bincount(first, step * (1 - rest), width * height)
    change += np.bincount(first + 1, step * rest, width * height)
    return np.abs(np.cumsum(change.reshape(height, width), axis=1)), corner


def _blend(frame: Image, visible: Floats32, polygon: Floats, colour: Floats32) -> float:
    """Draw a polygon into `frame` in place; the share of its area that can be seen."""
    alpha, corner = coverage(polygon)
    height, width = visible.shape
    left, top = np.maximum(corner, 0)
    right, bottom = np.minimum(corner + alpha.shape[::-1], (width, height))
    if left >= right or top >= bottom:
        return 0.0
    window = np.s_[top:bottom, left:right]
    a = alpha[top - corner[1] : bottom - corner[1], left - corner[0] : right - corner[0]]
    a = (a * visible[window])[..., None]
    frame[window] = np.rint(frame[window] * (1 - a) + a * colour)
    return float(a.sum() / alpha.sum())


def _poses(scene: Scene, n: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Angle (rad) and relative size of the target in each of n frames."""
    time = np.linspace(0, 1, n)
    # A random walk of the angular speed over 25 frames keeps the tumbling smooth.
    spin = np.convolve(rng.standard_normal(n + 24), np.full(25, 1 / 5), "valid") / 25
    angle = 2 * np.pi * (rng.random() + scene.turns * time) + scene.tumbling * np.cumsum(spin)
    cycles = rng.uniform(1, 3)
    scale = 1 + scene.size_variation * np.sin(2 * np.pi * (cycles * time + rng.random()))
    return angle, scale


def render(
    track: ArrayLike, scene: Scene, seed: int = 0, shapes: ArrayLike | None = None
) -> Iterator[Image]:
    """Frames of a target that moves along a pixel track through a scene.

    The area centroid of the drawn target lies at the track position to better than 0.02 px.

    Parameters
    ----------
    track : array_like, shape (n, 2)
        Centroid of the target, (u right, v down) in pixels; a row of NaN is a frame without target.
        Or (n, 2 k), side by side, of k targets that look alike; the later ones are in front.
    scene : Scene
    seed : int
        Draws the background, the random pose and the noise.
    shapes : array_like, shape (n, 2, 2), optional
        Linear map of the outline in each frame, (u, v): how a perspective camera sees it.

    Yields
    ------
    frame : ndarray, shape (height, width, 3), uint8
        Blue-green-red.

    Raises
    ------
    ValueError
        If `track` or `shapes` has the wrong shape or infinite values, `scene` is none or `seed`
        is negative.
    """
    return (drawn.frame for drawn in render_labelled(track, scene, seed, shapes))


class LabelledFrame(NamedTuple):
    """A frame and what a detector has to find in it.

    Parameters
    ----------
    frame : ndarray, shape (height, width, 3), uint8
        Blue-green-red.
    extent : ndarray, shape (2,)
        Width and height of the whole target in pixels, of several the last one; NaN in a frame
        without target.
    visible : float
        Share of its area that can be seen.
    """

    frame: Image
    extent: Floats
    visible: float


def render_labelled(
    track: ArrayLike, scene: Scene, seed: int = 0, shapes: ArrayLike | None = None
) -> Iterator[LabelledFrame]:
    """Frames as of `render`, with what a detector has to find in them.

    Parameters
    ----------
    track, scene, seed, shapes
        See `render`.

    Yields
    ------
    LabelledFrame

    Raises
    ------
    ValueError
        As of `render`.
    """
    check_instance("scene", scene, Scene)
    seed = check_integer("seed", seed)
    track = _check_track(track)
    maps = np.broadcast_to(np.eye(2), (len(track), 2, 2)) if shapes is None else np.array(shapes)
    if maps.shape != (len(track), 2, 2) or not np.isfinite(maps).all():
        raise ValueError(
            f"shapes: must be finite, of shape ({len(track)}, 2, 2), got shape {maps.shape} and "
            f"{np.sum(~np.isfinite(maps))} other values"
        )
    return draw_frames(track, scene, seed, maps)


def _check_track(track: ArrayLike) -> Floats:
    """At least one row of pixels, finite or NaN, of one or several targets."""
    width = np.shape(track)[-1] if np.ndim(track) == 2 else 0
    track = check_rows("track", track, max(width - width % 2, 2))
    if not len(track):
        raise ValueError("track: must have shape (n, 2) with n >= 1, got (0, 2)")
    return track


def render_restless(
    track: ArrayLike, scene: Scene, shifts: ArrayLike, light: ArrayLike | None = None, seed: int = 0
) -> Iterator[Image]:
    """Frames as of `render`, of a scene whose background moves and whose light changes.

    Parameters
    ----------
    track, scene, seed
        See `render`; the target keeps its pose.
    shifts : array_like of int, shape (n, 2)
        Where the view has moved to over the background in each frame, pixels (u, v).
    light : array_like, shape (n,), optional
        Factor of the background's brightness in each frame.

    Yields
    ------
    frame : ndarray, shape (height, width, 3), uint8
        Blue-green-red.

    Raises
    ------
    ValueError
        As of `render`, or if `shifts` or `light` does not fit the track.
    """
    track, shifts = _check_track(track), np.asarray(shifts)
    if shifts.shape != track.shape or shifts.dtype.kind != "i":
        raise ValueError(
            f"shifts: must be integers of the track's shape {track.shape}, "
            f"got {shifts.dtype} of shape {shifts.shape}"
        )
    light = np.ones(len(track)) if light is None else check_array("light", light)
    corners = shifts - shifts.min(axis=0)
    width, height = scene.image_size
    across, down = (np.array([width, height]) + corners.max(axis=0)).tolist()
    large = BACKGROUNDS[scene.background](np.random.default_rng(seed), (across, down))
    for place, (u, v), factor in zip(track, corners, light, strict=True):
        view = cv2.convertScaleAbs(large[v : v + height, u : u + width], alpha=factor)
        scenery = np.asarray(view, np.uint8)
        yield next(draw_frames(place[None], scene, seed, np.eye(2)[None], scenery)).frame


def draw_frames(
    track: Floats, scene: Scene, seed: int, shapes: Floats, scenery: Image | None = None
) -> Iterator[LabelledFrame]:
    """The frames of `render_labelled`, whose arguments are good.

    Parameters
    ----------
    track, scene, seed, shapes
        See `render`.
    scenery : ndarray, shape (height, width, 3), uint8, optional
        An image in the place of the scene's background; occluders are drawn over it.

    Yields
    ------
    LabelledFrame
    """
    spawned = np.random.SeedSequence(seed).spawn(3)
    layout, motion, noise = (np.random.default_rng(s) for s in spawned)
    background, visible = _surroundings(scene, layout, scenery)
    outline = scene.outline()
    colour = np.array(COLOURS[scene.colour], np.float32)
    grains = _NORMAL * np.float32(255 * np.sqrt(scene.noise_variance))
    targets = track.reshape(len(track), -1, 2)
    poses = np.array([_poses(scene, len(track), motion) for _ in range(targets.shape[1])])
    for centres, shape, pose in zip(targets, shapes, poses.transpose(2, 0, 1), strict=True):
        frame, extent, seen = background.copy(), np.full(2, np.nan), 0.0
        for centre, (angle, scale) in zip(centres, pose, strict=True):
            if not np.isfinite(centre).all():
                continue
            turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            polygon = centre + scale * outline @ turn @ shape.T
            extent = np.ptp(polygon, axis=0)
            seen = _blend(frame, visible, polygon, colour)
        if scene.noise_variance > 0:
            # Takes less than half the time of normal numbers; grey levels are coarser by far.
            grain = grains[noise.integers(0, len(grains), frame.shape, np.uint16)]
            frame = np.asarray(cv2.add(frame, grain, dtype=cv2.CV_8U), np.uint8)
        yield LabelledFrame(frame, extent, seen)


def _surroundings(
    scene: Scene, rng: np.random.Generator, scenery: Image | None
) -> tuple[Image, Floats32]:
    """The image without the target, and which of its pixels are behind the target (1 or 0)."""
    drawn = BACKGROUNDS[scene.background](rng, scene.image_size) if scenery is None else scenery
    background, visible = drawn.copy(), np.ones(drawn.shape[:2], np.float32)
    for left, top, width, height in scene.occluders:
        window = np.s_[top : top + height, left : left + width]
        texture = bark if height >= width else leaves
        background[window] = texture(rng, (width, height))
        visible[window] = 0
    for left, top, width, height in scene.trees:
        window = np.s_[top : top + height, left : left + width]
        image, here = tree(rng, (width, height))
        background[window][here] = image[here]
        visible[window][here] = 0
    return background, visible


def render_video(
    path: str | os.PathLike,
    track: ArrayLike,
    scene: Scene,
    fps: float = 25,
    seed: int = 0,
    shapes: ArrayLike | None = None,
) -> Path:
    """Render a track in a scene (see `render`) and write it to a video file (see `write_video`)."""
    return write_video(path, render(track, scene, seed, shapes), fps)
