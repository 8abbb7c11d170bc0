"""Drawn backgrounds, and what stands before them: images from random numbers.

FFV1 codes green and the differences blue - green and red - green; the backgrounds put their texture
into the brightness and keep those differences constant over large areas, which costs little in
looks and makes the files much smaller. Their colours are muted: the vivid ones are the targets'.
"""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Bools, Floats32, Image

Size = tuple[int, int]
"""Width and height in pixels."""


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
    image = np.stack([green + np.rint(blue), green, green + np.rint(red)], axis=-1)
    return np.clip(image, 0, 255).astype(np.uint8)


def _sky(rng: np.random.Generator, size: Size) -> Image:
    """Blue above, pale below, with clouds."""
    width, height = size
    row = np.linspace(0, 1, height, dtype=np.float32)[:, None]
    clouds = np.clip(_texture(rng, size, (3, 6, 12, 24), stretch=(1, 2)) * 2.2 - 1.0, 0, 1)
    light = 150 + 45 * row + 25 * clouds
    return _paint(light, 48 - 34 * row, -40 + 28 * row)


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


BACKGROUNDS: dict[str, Callable[[np.random.Generator, Size], Image]] = {
    "plain": _plain, "sky": _sky, "hills": _hills, "sea": _sea, "wood": _wood, "bricks": _bricks,
}
"""What draws each background: a source of random numbers and (width, height) to an image."""


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
