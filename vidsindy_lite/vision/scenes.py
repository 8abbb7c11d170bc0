"""What one camera sees: background, target, and the disturbances between them."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ..arrays import Floats
from ..checks import (
    MALFORMED,
    check_choice,
    check_image_size,
    check_integer,
    check_number,
    shown,
)
from .scenery import BACKGROUNDS, Size

SHAPES = ("disc", "polygon", "irregular")

COLOURS = {
    "red": (35, 30, 215),
    "magenta": (185, 30, 200),
    "yellow": (15, 225, 250),
    "orange": (5, 115, 250),
    "black": (22, 18, 20),
}
"""Blue, green and red of each target colour: vivid, far from every colour of every background."""

Box = tuple[int, int, int, int]
"""Left, top, width and height in whole pixels."""


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
        boxes: tuple[Any, ...] = tuple(tuple(rectangle) for rectangle in rectangles)
        whole = all(len(box) == 4 and all(x == int(x) for x in box) for box in boxes)
    except MALFORMED:
        whole = False
    if not whole:
        raise ValueError(f"{name}: must be boxes of four whole pixels, got {shown(rectangles)}")
    for rectangle in boxes:
        if min(rectangle[:2]) < 0 or min(rectangle[2:]) < 4:
            raise ValueError(
                f"{name}: each must be whole pixels (left >= 0, top >= 0, width >= 4, "
                f"height >= 4), got {rectangle}"
            )
        if rectangle[0] + rectangle[2] > size[0] or rectangle[1] + rectangle[3] > size[1]:
            raise ValueError(f"{name}: must lie in the {size} image, got {rectangle}")
    return boxes
