"""Synthetic videos of a moving target, and reading and writing of video files.

One camera at a time: a pixel track (the centroid of the target in each frame) and a `Scene` (what
the background, the target and the disturbances look like) become frames, and frames become a file.
Pixel convention: u to the right, v down, pixel centres at integer coordinates, so that the centre
of the top left pixel is (0, 0).

The files are lossless unless a lossy codec is asked for, because a lossy codec moves the edges of a
small target by more than the tracker's own error. QuickTime's run-length code (.mov) writes of each
frame only the pixels that differ from the last one: before a background at rest it is quick, and
its files are small. FFV1 (.mkv) codes each frame on its own, green and the differences blue - green
and red - green; the backgrounds put their texture into the brightness and keep those differences
constant over large areas, which costs little in looks and makes the files much smaller.
"""

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import av
import cv2
import numpy as np
from scipy.special import ndtri

from ..checks import (
    check_array,
    check_image_size,
    check_instance,
    check_integer,
    check_number,
    check_path,
)

# What is wrong with a file is said by our errors, which name it. OpenCV reads this when it opens
# its first file; -8 is ffmpeg's "quiet".
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

SHAPES = ("disc", "polygon", "irregular")

# Vivid colours (blue, green, red), each far from every (muted) colour of every background.
COLOURS = {
    "red": (35, 30, 215),
    "magenta": (185, 30, 200),
    "yellow": (15, 225, 250),
    "orange": (5, 115, 250),
    "black": (22, 18, 20),
}

# Lossless codecs by file suffix (the default), and the suffixes each codec is usually kept in.
LOSSLESS = {".mov": "qtrle", ".mkv": "FFV1"}
CODECS = {
    "qtrle": (".mov",),
    "FFV1": (".mkv", ".avi"),
    "mp4v": (".mp4",),
    "MJPG": (".avi", ".mkv"),
}

FRAME_RATES = 0.01, 10_000.0  # per second, that all these files can hold

_SCANLINES = 16  # per row of pixels, when the target is drawn
_NORMAL = ndtri((np.arange(2**16) + 0.5) / 2**16).astype(np.float32)  # quantiles, all as likely
_KEY_FRAMES = 50  # frames from one that stands on its own to the next: a jump costs half of that


# ------------------------------------------------------------------------------------- backgrounds


def _texture(rng, size, cells, stretch=(1, 1)):
    """Smooth random field in [0, 1], (height, width); `cells` of noise per axis, coarse first."""
    width, height = size
    field = np.zeros((height, width), np.float32)
    for cell in cells:
        grid = rng.random((cell * stretch[1] + 1, cell * stretch[0] + 1), np.float32)
        field += cv2.resize(grid, (width, height), interpolation=cv2.INTER_CUBIC) / np.float32(cell)
    return (field - field.min()) / (field.max() - field.min())


def _paint(light, blue, red):
    """Colour image from brightness (green) and the differences blue - green and red - green."""
    green = np.rint(light)
    image = np.stack([green + np.rint(blue), green, green + np.rint(red)], axis=-1)
    return np.clip(image, 0, 255).astype(np.uint8)


def _sky(rng, size):
    width, height = size
    row = np.linspace(0, 1, height, dtype=np.float32)[:, None]
    clouds = np.clip(_texture(rng, size, (3, 6, 12, 24), stretch=(1, 2)) * 2.2 - 1.0, 0, 1)
    light = 150 + 45 * row + 25 * clouds
    return _paint(light, np.broadcast_to(48 - 34 * row, light.shape), -40 + 28 * row + 0 * light)


def _hills(rng, size):
    width, height = size
    image = _sky(rng, size)
    column = np.linspace(0, 1, width)
    rows = np.arange(height)[:, None]
    for depth, (horizon, light, blue, red) in enumerate(
        [(0.45, 150, 12, -14), (0.58, 128, -12, -16), (0.74, 104, -34, -14)]
    ):
        waves = [np.sin(2 * np.pi * (k * column + rng.random())) / k for k in (1, 2, 4, 7)]
        ridge = height * (horizon + 0.05 * np.sum(waves, axis=0))
        texture = _texture(rng, size, (8, 16, 32, 64), stretch=(1, 2))
        layer = _paint(light + (8 + 10 * depth) * (texture - 0.5), blue, red)
        below = rows >= ridge
        image[below] = layer[below]
    return image


def _sea(rng, size):
    width, height = size
    image = _sky(rng, size)
    horizon = int(height * rng.uniform(0.35, 0.5))
    depth = np.linspace(0, 1, height - horizon, dtype=np.float32)[:, None]
    # Waves are long and thin far away and grow towards the viewer.
    far = _texture(rng, (width, height - horizon), (6, 12), stretch=(1, 8))
    near = _texture(rng, (width, height - horizon), (4, 8, 16), stretch=(1, 4))
    light = 132 - 22 * depth + 30 * ((1 - depth) * far + depth * near - 0.5)
    image[horizon:] = _paint(light, 26 + 0 * light, -44 + 0 * light)
    return image


def _wood(rng, size):
    width, height = size
    image = np.empty((height, width, 3), np.uint8)
    edges = np.linspace(0, height, 6).astype(int)
    for top, bottom in zip(edges[:-1], edges[1:], strict=True):
        plank = (width, bottom - top)
        # Grain: the level lines of a smooth field, stretched along the plank.
        field = _texture(rng, plank, (1, 2, 4), stretch=(2, 2))
        grain = np.sin(2 * np.pi * 6 * field) + 0.8 * (_texture(rng, plank, (8, 16), (1, 3)) - 0.5)
        light = rng.uniform(118, 140) + 9 * grain
        light[:2] -= 35
        image[top:bottom] = _paint(light, -34 + 0 * light, 36 + 0 * light)
    return image


def _bricks(rng, size):
    width, height = size
    course, length, joint = 32, 64, 3
    light = 168 + 14 * (_texture(rng, size, (16, 32, 64)) - 0.5)
    image = _paint(light, -8, 6)
    texture = _texture(rng, size, (16, 32, 64))
    for i, top in enumerate(range(0, height, course)):
        for left in range(-(i % 2) * length // 2, width, length):
            rows = slice(top + joint, top + course)
            columns = slice(max(left + joint, 0), max(left + length, 0))
            light = rng.uniform(96, 122) + 22 * (texture[rows, columns] - 0.5)
            image[rows, columns] = _paint(light, -14, rng.uniform(30, 44))
    return image


def _plain(rng, size):
    width, height = size
    column = np.linspace(0, 1, width, dtype=np.float32)
    light = np.broadcast_to(rng.uniform(120, 170) + 20 * column, (height, width))
    return _paint(light, 4, -4)


BACKGROUNDS = {
    "plain": _plain, "sky": _sky, "hills": _hills, "sea": _sea, "wood": _wood, "bricks": _bricks,
}


def _bark(rng, size):
    width, height = size
    light = 66 + 40 * (_texture(rng, size, (4, 8), stretch=(3, 1)) - 0.5)
    light -= 22 * np.linspace(-1, 1, width, dtype=np.float32) ** 2
    return _paint(light, -16, 18)


def _leaves(rng, size):
    return _paint(70 + 60 * (_texture(rng, size, (16, 32), stretch=(2, 1)) - 0.5), -30, -22)


def _tree(rng, size):
    """A tree in a rectangle: its image, (height, width, 3), and where it is, (height, width).

    A trunk in the middle, and a crown of round tufts in the upper two thirds.
    """
    width, height = size
    crown = np.array([width, 2 * height // 3])
    v, u = np.mgrid[:height, :width]
    radii = crown.min() * rng.uniform(0.14, 0.26, 20)
    angle, reach = rng.uniform(0, 2 * np.pi, 20), np.sqrt(rng.random(20))
    centres = reach * [np.cos(angle), np.sin(angle)] * (crown[:, None] / 2 - radii)
    centres += crown[:, None] / 2
    tufts = zip(*centres, radii, strict=True)
    leafy = np.any([np.hypot(u - x, v - y) < radius for x, y, radius in tufts], axis=0)
    trunk = (np.abs(u - (width - 1) / 2) < width / 14) & (v > crown[1] / 2)
    image = np.where(leafy[..., None], _leaves(rng, size), _bark(rng, size))
    return image, leafy | trunk


# ------------------------------------------------------------------------------------------- scene


@dataclass(frozen=True)
class Scene:
    """What one camera sees, apart from the motion: background, target and disturbances.

    Parameters
    ----------
    background : {"plain", "sky", "hills", "sea", "wood", "bricks"}
    shape : {"disc", "polygon", "irregular"}
        Outline of the target; polygon and irregular outlines are drawn from `shape_seed`.
    size : float
        Diameter in pixels, 4 to 100; for other shapes that of the disc of equal area.
    colour : {"red", "magenta", "yellow", "orange", "black"}
    turns : float
        Steady self-rotation, turns over the whole clip.
    tumbling : float
        Random self-rotation: standard deviation in radians of the turn over 25 frames.
    size_variation : float
        Relative amplitude, in [0, 0.5], of a slow change of the diameter over the clip (as of a
        target that comes nearer and recedes).
    noise_variance : float
        Variance of the Gaussian image noise, for intensities in [0, 1]; the paper uses 0.01.
    occluders : tuple of (left, top, width, height)
        Rectangles in whole pixels in front of the target: posts if taller than wide, else hedges.
    trees : tuple of (left, top, width, height)
        Rectangles that are each filled by a tree in front of the target.
    shape_seed : int
        Chooses the outline, so that several cameras can look at one target.
    image_size : (width, height)

    Raises
    ------
    ValueError
        If an argument breaks its rule.
    """

    background: str = "hills"
    shape: str = "disc"
    size: float = 20.0
    colour: str = "red"
    turns: float = 0.0
    tumbling: float = 0.0
    size_variation: float = 0.0
    noise_variance: float = 0.0
    occluders: tuple[tuple[int, int, int, int], ...] = ()
    trees: tuple[tuple[int, int, int, int], ...] = ()
    shape_seed: int = 0
    image_size: tuple[int, int] = (512, 512)

    def __post_init__(self):
        for name, allowed in [
            ("background", BACKGROUNDS), ("shape", SHAPES), ("colour", COLOURS),
        ]:
            value = getattr(self, name)
            if value not in allowed:
                raise ValueError(f"{name}: must be one of {', '.join(allowed)}, got {value!r}")
        for name, low, high in [
            ("size", 4, 100), ("turns", -np.inf, np.inf), ("tumbling", 0, np.inf),
            ("size_variation", 0, 0.5), ("noise_variance", 0, 0.1),
        ]:
            if not low <= check_number(name, getattr(self, name)) <= high:
                raise ValueError(f"{name}: must be in [{low}, {high}], got {getattr(self, name)}")
        check_integer("shape_seed", self.shape_seed)
        size = check_image_size(self.image_size, least=64)
        object.__setattr__(self, "image_size", size)
        for name in ("occluders", "trees"):
            object.__setattr__(self, name, _check_rectangles(name, getattr(self, name), size))

    @classmethod
    def random(cls, rng, **fixed) -> "Scene":
        """A scene drawn at random: background, shape, colour, size of 8 to 40 px and rotation.

        Parameters
        ----------
        rng : np.random.Generator or int
            The source of random numbers, or its seed.
        **fixed
            Fields that are given instead of drawn (disturbances are never drawn).
        """
        if not isinstance(rng, np.random.Generator):
            rng = np.random.default_rng(check_integer("rng", rng))
        drawn = {
            "background": str(rng.choice(list(BACKGROUNDS))),
            "shape": str(rng.choice(SHAPES)),
            "size": float(rng.uniform(8, 40)),
            "colour": str(rng.choice(list(COLOURS))),
            "turns": float(rng.uniform(-10, 10)),
            "tumbling": float(rng.uniform(0, 1)),
            "shape_seed": int(rng.integers(2**31)),
        }
        return cls(**(drawn | fixed))

    def outline(self) -> np.ndarray:
        """Outline of the target at rest, (m, 2) pixels: centroid at 0, area that of the disc."""
        rng = np.random.default_rng(self.shape_seed)
        if self.shape == "disc":
            angle = np.linspace(0, 2 * np.pi, 128, endpoint=False)
            radius = np.ones_like(angle)
        elif self.shape == "polygon":
            m = int(rng.integers(3, 7))
            angle = 2 * np.pi * (np.arange(m) + rng.uniform(-0.2, 0.2, m)) / m
            radius = np.ones(m)
        else:
            angle = np.linspace(0, 2 * np.pi, 128, endpoint=False)
            order = np.arange(2, 6)
            amplitude = rng.uniform(0.3, 1, order.size) * 0.35 / order
            phase = rng.uniform(0, 2 * np.pi, order.size)
            radius = 1 + np.cos(np.outer(angle, order) + phase) @ amplitude
        points = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        area, centroid = _area_and_centroid(points)
        return (points - centroid) * np.sqrt(np.pi * self.size**2 / 4 / area)


def _check_rectangles(name, rectangles, size):
    rectangles = tuple(tuple(rectangle) for rectangle in rectangles)
    for rectangle in rectangles:
        whole = len(rectangle) == 4 and all(x == int(x) for x in rectangle)
        if not whole or min(rectangle[:2]) < 0 or min(rectangle[2:]) < 4:
            raise ValueError(
                f"{name}: each must be whole pixels (left >= 0, top >= 0, width >= 4, "
                f"height >= 4), got {rectangle}"
            )
        if rectangle[0] + rectangle[2] > size[0] or rectangle[1] + rectangle[3] > size[1]:
            raise ValueError(f"{name}: must lie in the {size} image, got {rectangle}")
    return rectangles


def _area_and_centroid(polygon):
    """Area and area centroid of a simple polygon (m, 2), by the shoelace formula."""
    x, y = polygon.T
    x1, y1 = np.roll(polygon, -1, axis=0).T
    cross = x * y1 - x1 * y
    area = cross.sum() / 2
    return area, np.array([((x + x1) * cross).sum(), ((y + y1) * cross).sum()]) / (6 * area)


# --------------------------------------------------------------------------------------- rendering


def _coverage(polygon):
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


def _blend(frame, background, visible, alpha, corner, colour):
    """Blend the target into `frame` in place, over the part of its patch inside the image.

    Returns
    -------
    float
        The area of the target that can be seen, pixels.
    """
    height, width = visible.shape
    left, top = np.maximum(corner, 0)
    right, bottom = np.minimum(corner + alpha.shape[::-1], (width, height))
    if left >= right or top >= bottom:
        return 0.0
    window = np.s_[top:bottom, left:right]
    a = alpha[top - corner[1]:bottom - corner[1], left - corner[0]:right - corner[0]]
    a = (a * visible[window])[..., None]
    frame[window] = np.rint(background[window] * (1 - a) + a * colour)
    return float(a.sum())


def _poses(scene, n, rng):
    """Angle (rad) and relative size of the target in each of n frames."""
    time = np.linspace(0, 1, n)
    # A random walk of the angular speed over 25 frames keeps the tumbling smooth.
    spin = np.convolve(rng.standard_normal(n + 24), np.full(25, 1 / 5), "valid") / 25
    angle = 2 * np.pi * (rng.random() + scene.turns * time) + scene.tumbling * np.cumsum(spin)
    cycles = rng.uniform(1, 3)
    scale = 1 + scene.size_variation * np.sin(2 * np.pi * (cycles * time + rng.random()))
    return angle, scale


def render(track, scene, seed=0, shapes=None) -> Iterator[np.ndarray]:
    """Frames of a target that moves along a pixel track through a scene.

    The area centroid of the drawn target lies at the track position to better than 0.02 px.

    Parameters
    ----------
    track : (n, 2) array
        Centroid of the target, (u right, v down) in pixels; a row of NaN is a frame without target.
    scene : Scene
    seed : int
        Draws the background, the random pose and the noise.
    shapes : (n, 2, 2) array, optional
        Linear map of the outline in each frame, (u, v): how a perspective camera sees it.

    Yields
    ------
    frame : (height, width, 3) uint8, blue-green-red

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
        Width and height of the whole target in pixels; NaN in a frame without target.
    visible : float
        Share of the target's area that can be seen.
    """

    frame: np.ndarray
    extent: np.ndarray
    visible: float


def render_labelled(track, scene, seed=0, shapes=None, scenery=None) -> Iterator[LabelledFrame]:
    """Frames as of `render`, with what a detector has to find in them.

    Parameters
    ----------
    track, scene, seed, shapes
        See `render`.
    scenery : ndarray, shape (height, width, 3), uint8, optional
        An image in the place of the scene's background; occluders are drawn over it.

    Yields
    ------
    LabelledFrame

    Raises
    ------
    ValueError
        As of `render`, or if `scenery` is no image of the scene's size.
    """
    check_instance("scene", scene, Scene)
    seed = check_integer("seed", seed)
    track = check_array("track", track)
    if track.ndim != 2 or track.shape[1] != 2 or len(track) == 0:
        raise ValueError(f"track: must have shape (n, 2) with n >= 1, got {track.shape}")
    if np.isinf(track).any():
        count = np.isinf(track).sum()
        raise ValueError(f"track: must be finite or NaN, got {count} infinite values")
    shapes = np.broadcast_to(np.eye(2), (len(track), 2, 2)) if shapes is None else np.array(shapes)
    if shapes.shape != (len(track), 2, 2) or not np.isfinite(shapes).all():
        raise ValueError(
            f"shapes: must be finite, of shape ({len(track)}, 2, 2), got shape {shapes.shape} and "
            f"{np.sum(~np.isfinite(shapes))} other values"
        )
    if scenery is not None:
        scenery = np.asarray(scenery)
        if scenery.shape != (*scene.image_size[::-1], 3) or scenery.dtype != np.uint8:
            raise ValueError(
                f"scenery: must be uint8 of the scene's image size {scene.image_size}, "
                f"got {scenery.dtype} of shape {scenery.shape}"
            )
    return _frames(track, scene, seed, shapes, scenery)


def render_restless(track, scene, shifts, light=None, seed=0) -> Iterator[np.ndarray]:
    """Frames as of `render`, of a scene whose background moves and whose light changes.

    Parameters
    ----------
    track, scene, seed
        See `render`; the target keeps its pose.
    shifts : (n, 2) array of int
        Where the view has moved to over the background in each frame, pixels (u, v).
    light : (n,) array, optional
        Factor of the background's brightness in each frame.

    Yields
    ------
    frame : (height, width, 3) uint8, blue-green-red
    """
    track, shifts = check_array("track", track), np.asarray(shifts)
    if shifts.shape != track.shape or shifts.dtype.kind != "i":
        raise ValueError(
            f"shifts: must be integers of the track's shape {track.shape}, "
            f"got {shifts.dtype} of shape {shifts.shape}"
        )
    light = np.ones(len(track)) if light is None else check_array("light", light)
    corners = shifts - shifts.min(axis=0)
    width, height = scene.image_size
    size = (width, height) + corners.max(axis=0)
    large = BACKGROUNDS[scene.background](np.random.default_rng(seed), tuple(map(int, size)))
    for place, (u, v), factor in zip(track, corners, light, strict=True):
        scenery = cv2.convertScaleAbs(large[v:v + height, u:u + width], alpha=factor)
        yield next(render_labelled(place[None], scene, seed, scenery=scenery)).frame


def _frames(track, scene, seed, shapes, scenery):
    spawned = np.random.SeedSequence(seed).spawn(3)
    layout, motion, noise = (np.random.default_rng(s) for s in spawned)
    width, height = scene.image_size
    if scenery is None:
        background = BACKGROUNDS[scene.background](layout, scene.image_size)
    else:
        background = scenery.copy()
    visible = np.ones((height, width), np.float32)
    for left, top, w, h in scene.occluders:
        texture = _bark if h >= w else _leaves
        background[top:top + h, left:left + w] = texture(layout, (w, h))
        visible[top:top + h, left:left + w] = 0
    for left, top, w, h in scene.trees:
        image, here = _tree(layout, (w, h))
        background[top:top + h, left:left + w][here] = image[here]
        visible[top:top + h, left:left + w][here] = 0
    outline = scene.outline()
    colour = np.array(COLOURS[scene.colour], np.float32)
    grains = _NORMAL * np.float32(255 * np.sqrt(scene.noise_variance))
    poses = zip(track, shapes, *_poses(scene, len(track), motion), strict=True)
    for centre, shape, angle, scale in poses:
        frame, extent, seen = background.copy(), np.full(2, np.nan), 0.0
        if np.isfinite(centre).all():
            turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            polygon = centre + scale * outline @ turn @ shape.T
            alpha, corner = _coverage(polygon)
            extent = np.ptp(polygon, axis=0)
            seen = _blend(frame, background, visible, alpha, corner, colour) / alpha.sum()
        if scene.noise_variance > 0:
            # Takes less than half the time of normal numbers; grey levels are coarser by far.
            grain = grains[noise.integers(0, len(grains), frame.shape, np.uint16)]
            frame = cv2.add(frame, grain, dtype=cv2.CV_8U)
        yield LabelledFrame(frame, extent, seen)


def render_video(path, track, scene, fps=25, seed=0, shapes=None) -> Path:
    """Render a track in a scene (see `render`) and write it to a video file (see `write_video`)."""
    return write_video(path, render(track, scene, seed, shapes), fps)


# ------------------------------------------------------------------------------------------- files


class VideoInfo(NamedTuple):
    """Number of frames, frames per second and (width, height) of a video file."""

    frames: int
    fps: float
    size: tuple[int, int]


def write_video(path, frames: Iterable[np.ndarray], fps=25, codec=None) -> Path:
    """Write frames to a video file.

    The file appears under its name only when it is complete.

    Parameters
    ----------
    path : path
        .mov (qtrle) or .mkv (FFV1), both lossless; .mp4 only with the lossy codec "mp4v".
    frames : iterable of (height, width, 3) uint8
        Blue-green-red, all of one size, of even width and height.
    fps : float
        Frames per second, in [0.01, 10000].
    codec : {"qtrle", "FFV1", "mp4v", "MJPG"}, optional
        Lossless by default; "mp4v" and "MJPG" are lossy.

    Returns
    -------
    path : Path

    Raises
    ------
    ValueError
        For an unknown suffix or codec, a bad frame rate, no frame, or a frame of another type or of
        odd or changing size.
    OSError
        If the file cannot be written.
    """
    path = check_path("path", path)
    check_instance("frames", frames, Iterable)
    suffix = path.suffix.lower()
    if codec is None and suffix not in LOSSLESS:
        raise ValueError(f"path: must end in .mov or .mkv unless codec is given, got '{path}'")
    codec = codec or LOSSLESS[suffix]
    if codec not in CODECS:
        raise ValueError(f"codec: must be one of {', '.join(CODECS)}, got {codec!r}")
    if suffix not in CODECS[codec]:
        allowed = " or ".join(CODECS[codec])
        raise ValueError(f"path: must end in {allowed} for {codec}, got '{path}'")
    low, high = FRAME_RATES
    if not low <= check_number("fps", fps) <= high:
        raise ValueError(f"fps: must be in [{low:g}, {high:g}], got {fps}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"path: the folder must exist, got '{path.parent}'")
    partial = path.with_name(f".{path.stem}.{os.getpid()}{suffix}")
    try:
        _encode(partial, frames, fps, codec, path)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    return path


def _encode(partial, frames, fps, codec, path):
    writer, size = None, None
    try:
        for i, frame in enumerate(frames):
            frame = np.asarray(frame)
            if frame.dtype != np.uint8 or frame.ndim != 3 or frame.shape[2] != 3:
                raise ValueError(
                    "frames: each must be uint8 of shape (height, width, 3), "
                    f"got {frame.dtype} {frame.shape} at frame {i}"
                )
            if writer is None:
                size = frame.shape[1::-1]
                if size[0] % 2 or size[1] % 2:  # OpenCV would cut off a row or column, silently
                    raise ValueError(f"frames: width and height must be even, got {size}")
                writer = _open_writer(partial, codec, fps, size)
                if writer is None:
                    raise OSError(f"path: cannot write {codec} video of size {size} to '{path}'")
            if frame.shape[1::-1] != size:
                raise ValueError(
                    f"frames: all must have size {size}, got {frame.shape[1::-1]} at frame {i}"
                )
            writer.write(frame)
    finally:
        if writer is not None:
            writer.release()
    if writer is None:
        raise ValueError("frames: at least one frame is needed, got none")


def _open_writer(path, codec, fps, size):
    if codec == "qtrle":
        return _RunLengthWriter(path, fps, size)
    fourcc = cv2.VideoWriter_fourcc(*codec)
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, fourcc, fps, size)
    return writer if writer.isOpened() else None


class _RunLengthWriter:
    """Writes QuickTime's run-length code, which OpenCV only reads; methods as of its writer."""

    def __init__(self, path, fps, size):
        self.file = av.open(str(path), "w")
        rate = Fraction(fps).limit_denominator(10_000)
        self.stream = self.file.add_stream("qtrle", rate, options={"g": str(_KEY_FRAMES)})
        self.stream.width, self.stream.height = size
        self.stream.pix_fmt = "rgb24"

    def write(self, frame):
        self._put(av.VideoFrame.from_ndarray(frame, "bgr24"))

    def release(self):
        self._put(None)
        self.file.close()

    def _put(self, frame):
        self.file.mux(self.stream.encode(frame))


def open_video(path) -> cv2.VideoCapture:
    """Open a video file for reading.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is empty, is not a video, or holds no frame.
    """
    path = check_path("path", path)
    if not path.is_file():
        raise FileNotFoundError(f"path: no such video file, got '{path}'")
    if path.stat().st_size == 0:
        raise ValueError(f"path: must be a video file, got the empty file '{path}'")
    loud = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    cv2.utils.logging.setLogLevel(loud)
    if not capture.isOpened():
        raise ValueError(f"path: must be a video file that OpenCV can read, got '{path}'")
    if not capture.grab():
        capture.release()
        raise ValueError(f"path: must hold at least one frame, got none in '{path}'")
    capture.open(str(path), cv2.CAP_FFMPEG)
    return capture


def read_video(path) -> Iterator[np.ndarray]:
    """Frames of a video file, one at a time, as (height, width, 3) uint8 blue-green-red.

    Raises
    ------
    FileNotFoundError, ValueError
        At once, if the file is missing, empty, not a video, or holds no frame.
    """
    return _decode(open_video(path))


def _decode(capture):
    try:
        while True:
            more, frame = capture.read()
            if not more:
                return
            yield frame
    finally:
        capture.release()


def read_frame(path, number) -> np.ndarray:
    """One frame of a video file, without decoding all before it.

    Parameters
    ----------
    path : path
    number : int
        From 0.

    Returns
    -------
    frame : (height, width, 3) uint8, blue-green-red

    Raises
    ------
    FileNotFoundError, ValueError
        If the file is missing, empty, not a video, or holds no such frame.
    """
    number = check_integer("number", number)
    capture = open_video(path)
    try:
        capture.set(cv2.CAP_PROP_POS_FRAMES, number)
        more, frame = capture.read()
    finally:
        capture.release()
    if not more:
        raise ValueError(f"number: '{path}' must have that frame, got {number}")
    return frame


def video_info(path) -> VideoInfo:
    """Number of frames, frame rate and size of a video file.

    The number is what the file's header states, which is more than the frames that can be read if
    the file was cut off later; where the header states none, the frames are counted.

    Raises
    ------
    FileNotFoundError, ValueError
        If the file is missing, empty, not a video, or holds no frame.
    """
    capture = open_video(path)
    size = int(capture.get(cv2.CAP_PROP_FRAME_WIDTH)), int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
    frames, fps = round(capture.get(cv2.CAP_PROP_FRAME_COUNT)), capture.get(cv2.CAP_PROP_FPS)
    if frames < 1:  # the file was cut off while it was written
        frames = sum(1 for _ in iter(capture.grab, False))
    capture.release()
    return VideoInfo(frames, fps, size)
