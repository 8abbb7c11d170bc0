"""Scenes and their films: a target that moves before a drawn background, one camera at a time.

A pixel track (the centroid of the target in each frame) and a `Scene` become frames. Pixel
convention: u to the right, v down, pixel centres at integer coordinates, so that the centre of the
top left pixel is (0, 0).

FFV1 codes green and the differences blue - green and red - green; the backgrounds put their texture
into the brightness and keep those differences constant over large areas, which costs little in
looks and makes the files much smaller. Their colours are muted: the vivid ones are the targets'.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Self

import cv2
import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from ..arrays import Bools, Floats, Floats32, Image, Ints
from ..checks import (
    MALFORMED,
    check_array,
    check_choice,
    check_image_size,
    check_instance,
    check_integer,
    check_number,
    check_rows,
    shown,
)
from .video import write_video

Size = tuple[int, int]  #: Width and height in pixels.
SHAPES = ("disc", "polygon", "irregular")

#: Red, green and blue of each target colour: vivid, far from every colour of every background.
COLOURS = {
    "red": (215, 30, 35),
    "magenta": (200, 30, 185),
    "yellow": (250, 225, 15),
    "orange": (250, 115, 5),
    "black": (20, 18, 22),
}

Box = tuple[int, int, int, int]  #: Left, top, width and height in whole pixels.
_SCANLINES = 16  # per row of pixels, when the target is drawn
_NORMAL = ndtri((np.arange(2**16) + 0.5) / 2**16).astype(np.float32)  # quantiles, all as likely


def _texture(
    rng: np.random.Generator, size: Size, cells: tuple[int, ...], stretch: Size = (1, 1)
) -> Floats32:
    """Smooth random field in [0, 1], (height, width); `cells` of noise per axis, coarse first."""
    width, height = size
    field = np.zeros((height, width), np.float32)
    for cell in cells:
        grid = rng.random((cell * stretch[1] + 1, cell * stretch[0] + 1), np.float32)
        field += cv2.resize(grid, (width, height), interpolation=cv2.INTER_CUBIC) / np.float32(cell)
    return (field - field.min()) / (field.max() - field.min())


def _paint(light: ArrayLike, blue: ArrayLike, red: ArrayLike) -> Image:
    """Colour image from brightness (green) and the differences blue - green and red - green."""
    green = np.rint(light)
    image = np.stack([green + np.rint(red), green, green + np.rint(blue)], axis=-1)
    return np.clip(image, 0, 255).astype(np.uint8)


def _sky(rng: np.random.Generator, size: Size) -> Image:
    """Blue above, pale below, with clouds."""
    width, height = size
    row = np.linspace(0, 1, height, dtype=np.float32)[:, None]
    clouds = np.clip(_texture(rng, size, (3, 6, 12, 24), stretch=(1, 2)) * 2.2 - 1.0, 0, 1)
    return _paint(150 + 45 * row + 25 * clouds, 48 - 34 * row, -40 + 28 * row)


def _hills(rng: np.random.Generator, size: Size) -> Image:
    """Three ranges of hills, the nearest the darkest, under a sky."""
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


def _sea(rng: np.random.Generator, size: Size) -> Image:
    """Waves below a sky, long and thin far away."""
    width, height = size
    image = _sky(rng, size)
    horizon = int(height * rng.uniform(0.35, 0.5))
    depth = np.linspace(0, 1, height - horizon, dtype=np.float32)[:, None]
    # Waves are long and thin far away and grow towards the viewer.
    far = _texture(rng, (width, height - horizon), (6, 12), stretch=(1, 8))
    near = _texture(rng, (width, height - horizon), (4, 8, 16), stretch=(1, 4))
    light = 132 - 22 * depth + 30 * ((1 - depth) * far + depth * near - 0.5)
    image[horizon:] = _paint(light, 26, -44)
    return image


def _wood(rng: np.random.Generator, size: Size) -> Image:
    """Five planks with grain."""
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
        image[top:bottom] = _paint(light, -34, 36)
    return image


def _bricks(rng: np.random.Generator, size: Size) -> Image:
    """A wall of red bricks in pale joints."""
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


def _plain(rng: np.random.Generator, size: Size) -> Image:
    """Grey, a little brighter to the right."""
    width, height = size
    column = np.linspace(0, 1, width, dtype=np.float32)
    light = np.broadcast_to(rng.uniform(120, 170) + 20 * column, (height, width))
    return _paint(light, 4, -4)


#: What draws each background: a source of random numbers and (width, height) to an image.
BACKGROUNDS: dict[str, Callable[[np.random.Generator, Size], Image]] = {
    "plain": _plain,
    "sky": _sky,
    "hills": _hills,
    "sea": _sea,
    "wood": _wood,
    "bricks": _bricks,
}


def bark(rng: np.random.Generator, size: Size) -> Image:
    """Furrows along a trunk, darker towards its sides."""
    width, height = size
    light = 66 + 40 * (_texture(rng, size, (4, 8), stretch=(3, 1)) - 0.5)
    light -= 22 * np.linspace(-1, 1, width, dtype=np.float32) ** 2
    return _paint(light, -16, 18)


def leaves(rng: np.random.Generator, size: Size) -> Image:
    """Dark green foliage."""
    return _paint(70 + 60 * (_texture(rng, size, (16, 32), stretch=(2, 1)) - 0.5), -30, -22)


def tree(rng: np.random.Generator, size: Size) -> tuple[Image, Bools]:
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
    image = np.where(leafy[..., None], leaves(rng, size), bark(rng, size))
    return image, leafy | trunk


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
        Random self-rotation: standard deviation of its speed, radians per 25 frames.
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
    occluders: tuple[Box, ...] = ()
    trees: tuple[Box, ...] = ()
    shape_seed: int = 0
    image_size: Size = (512, 512)

    def __post_init__(self) -> None:
        check_choice("background", self.background, BACKGROUNDS)
        check_choice("shape", self.shape, SHAPES)
        check_choice("colour", self.colour, COLOURS)
        for name, low, high in [
            ("size", 4, 100),
            ("turns", -np.inf, np.inf),
            ("tumbling", 0, np.inf),
            ("size_variation", 0, 0.5),
            ("noise_variance", 0, 0.1),
        ]:
            if not low <= check_number(name, getattr(self, name)) <= high:
                raise ValueError(f"{name}: must be in [{low}, {high}], got {getattr(self, name)}")
        check_integer("shape_seed", self.shape_seed)
        size = check_image_size(self.image_size, least=64)
        object.__setattr__(self, "image_size", size)
        for name in ("occluders", "trees"):
            object.__setattr__(self, name, _check_rectangles(name, getattr(self, name), size))

    @classmethod
    def random(cls, rng: np.random.Generator | int, **fixed: Any) -> Self:
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
        drawn: dict[str, Any] = {
            "background": str(rng.choice(list(BACKGROUNDS))),
            "shape": str(rng.choice(SHAPES)),
            "size": float(rng.uniform(8, 40)),
            "colour": str(rng.choice(list(COLOURS))),
            "turns": float(rng.uniform(-10, 10)),
            "tumbling": float(rng.uniform(0, 1)),
            "shape_seed": int(rng.integers(2**31)),
        }
        return cls(**(drawn | fixed))

    def outline(self) -> Floats:
        """Outline of the target at rest, (m, 2) pixels: centroid at 0, area that of the disc."""
        rng = np.random.default_rng(self.shape_seed)
        angle = np.linspace(0, 2 * np.pi, 128, endpoint=False)
        if self.shape == "polygon":
            m = int(rng.integers(3, 7))
            angle = 2 * np.pi * (np.arange(m) + rng.uniform(-0.2, 0.2, m)) / m
        points = np.column_stack([np.cos(angle), np.sin(angle)])
        if self.shape == "irregular":
            order = np.arange(2, 6)
            amplitude = rng.uniform(0.3, 1, order.size) * 0.35 / order
            phase = rng.uniform(0, 2 * np.pi, order.size)
            radius = 1 + np.cos(np.outer(angle, order) + phase) @ amplitude
            points *= radius[:, None]
        # Area and centroid by the shoelace formula.
        x, y = points.T
        x1, y1 = np.roll(points, -1, axis=0).T
        cross = x * y1 - x1 * y
        area = cross.sum() / 2
        centroid = np.array([((x + x1) * cross).sum(), ((y + y1) * cross).sum()]) / (6 * area)
        return (points - centroid) * np.sqrt(np.pi * self.size**2 / 4 / area)


def _check_rectangles(name: str, rectangles: Iterable[Box], size: Size) -> tuple[Box, ...]:
    """Boxes of whole pixels that lie in the image."""
    try:
        given = [tuple(box) for box in rectangles]
        boxes = np.array(given, float).reshape(len(given), 4)
    except MALFORMED:
        boxes = np.full((1, 4), np.nan)
    inside = (boxes >= [0, 0, 4, 4]).all() and (boxes[:, :2] + boxes[:, 2:] <= size).all()
    if not inside or (boxes % 1 != 0).any():
        raise ValueError(
            f"{name}: must be boxes of four whole pixels (left >= 0, top >= 0, width >= 4, "
            f"height >= 4) that lie in the {size} image, got {shown(rectangles)}"
        )
    return tuple(map(tuple, boxes.astype(int).tolist()))


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
        Red, green and blue.

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
        Red, green and blue.
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
        Red, green and blue.

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
            # Takes less than half the time of normal numbers; grey levels are coarser by far. Blue
            # comes first, so that films of a seed are what they were.
            grain = grains[noise.integers(0, len(grains), frame.shape, np.uint16)][..., ::-1]
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
