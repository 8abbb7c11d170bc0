"""The plate: the ground behind a moving target, as no single frame may show it.

It is the median of frames spread through the clip, of which each is carried into the first one by
the camera's motion, if that moves, and, where the light or the exposure changes, brought into the
same light. A target that covers the same ground in most of the frames is a part of that median;
once its places are known, they are left out of it, and ground that no frame shows continues what
is around it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ..arrays import Bools, Floats, Floats32, Image, Ints
from .video import Reel

_STRIP = 64  # rows of an image that are sorted at once: what they need stays in the cache


def dot(a: Floats32, b: Floats32) -> Floats32:
    """Scalar product of the colours of each pixel."""
    return (a * b) @ np.ones(3, np.float32)


def lengths(a: Floats32) -> Floats32:
    """Root of the sum of the squares of the colours of each pixel."""
    return np.sqrt(dot(a, a))


def shadowed(now: Floats | Floats32 | Image, ground: Floats | Floats32) -> Bools:
    """Where (...) the same surface is seen in less light: darker by the same in all colours."""
    r, g, b = np.moveaxis((now + 4.0) / (ground + 4.0), -1, 0)  # faster than along a short axis
    mean = (r + g + b) / 3
    apart = np.maximum(np.maximum(r, g), b) - np.minimum(np.minimum(r, g), b)
    # By that share a shadow may darken the colours of a pixel unlike each other.
    return np.asarray((mean > 0.35) & (mean < 0.95) & (apart < 0.12 * mean))


def relit(image: Image, factor: Floats32) -> Floats32:
    """An image as it is where each colour is brighter by a factor (3,)."""
    rows = image.reshape(len(image), -1) * np.tile(factor, image.shape[1])
    return np.asarray(rows.reshape(image.shape), np.float32)


def changes(frame: Image, ground: Image, factor: Floats32) -> Floats32:
    """By what the colours of a frame differ from a ground that is brighter by a factor (3,).

    What is saturated is at least so bright: what is brighter than that is no difference.
    """
    if (factor == 1).all():
        return np.asarray(cv2.subtract(frame, ground, dtype=cv2.CV_32F), np.float32)
    then = relit(ground, factor)
    if factor.min() < 1 and (bright := ground >= 250).any():  # 255, but for compression
        np.maximum(then, frame, out=then, where=bright)
    if factor.max() > 1:
        np.minimum(then, 255, out=then)
    return np.asarray(cv2.subtract(frame, then, then, dtype=cv2.CV_32F), np.float32)


def carry(maps: NDArray, points: Floats) -> Floats:
    """Points (n, 2) taken through one map (3, 3), or each through its own (n, 3, 3)."""
    ends = np.einsum("...ij,...j->...i", maps, np.column_stack([points, np.ones(len(points))]))
    return ends[:, :2] / ends[:, 2:]


def sampled(frames: Reel) -> tuple[Ints, Image]:
    """About 21 frames spread evenly over a clip, as far as it holds them: their numbers, and they.

    These are whole, (m, height, width, 3).
    """
    numbers = np.unique(np.linspace(0, frames.info.frames - 1, 21).round().astype(int))
    image = np.dtype((np.uint8, (*frames.info.size[::-1], 3)))
    samples = np.asarray(np.fromiter(frames.whole.pick(numbers.tolist()), image), np.uint8)
    return numbers[: len(samples)], samples


def _median(layers: Image) -> Image:
    """Median over the first axis of uint8 images, by a sorting network (8 times numpy's speed)."""
    images = list(layers)
    for step in range(len(images)):
        for j in range(step % 2, len(images) - 1, 2):
            low = np.minimum(images[j], images[j + 1])
            images[j + 1] = np.maximum(images[j], images[j + 1])
            images[j] = low
    return images[len(images) // 2]


def light(frame: Image | Floats32, background: Image | Floats32, known: Bools) -> Floats32:
    """By what factor each colour of a frame is brighter than the background, (3,).

    The median over pixels that are neither dark nor saturated nor, probably, the target's.
    """
    step = max(1, int(np.sqrt(known.size / 2000)))
    a, b = frame[::step, ::step], background[::step, ::step]
    use = known[::step, ::step] & (cv2.inRange(b, (41,) * 3, (239,) * 3) > 0)
    if use.mean() < 0.1:
        return np.ones(3, np.float32)
    ratio = np.median(a[use] / b[use], axis=0)
    ratio[np.abs(ratio - 1) < 0.01] = 1  # what rounding and compression do
    return np.clip(ratio, 0.4, 2.5).astype(np.float32)


class Plate:
    """The steadied background, of frames of one size.

    Parameters
    ----------
    samples : sequence of ndarray, shape (height, width, 3), uint8
    maps : ndarray, shape (m, 3, 3)
        Where each lies in the first frame, as far as that is known.
    hidden : ndarray, shape (m, 4), optional
        What of each sample is not the ground: left, top, width, height; NaN for nothing.
    lights : ndarray, shape (m, 3), optional
        How much brighter each sample is, see `lights_of`; by default all are in the same light.
    """

    def __init__(
        self, samples: Image | Sequence[Image], maps: Floats,
        hidden: Iterable[Floats] | None = None, lights: Floats32 | None = None,
    ) -> None:  # fmt: skip
        self.size = np.array(samples[0].shape[1::-1])
        self.moves = not np.allclose(maps, np.eye(3))
        corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) * (self.size - 1.0)
        ends = np.array([carry(h, corners) for h in maps])
        # It reaches so many sides of a frame from the middle of the one in the middle.
        middle, most = ends[len(ends) // 2].mean(axis=0), 1.2 * self.size
        low = np.floor(np.maximum(ends.min(axis=(0, 1)), middle - most))
        high = np.minimum(ends.max(axis=(0, 1)), middle + most)
        self.shift = np.array([[1, 0, -low[0]], [0, 1, -low[1]], [0, 0, 1.0]])
        width, height = (int(x) for x in np.ceil(high - low) + 1)
        shows = [np.full(samples[0].shape[:2], 255, np.uint8)] * len(samples)
        if hidden is not None:
            shows = [_without(one, box) for one, box in zip(shows, hidden, strict=True)]
        moves = self.shift @ maps
        gains = np.ones((len(maps), 3), np.float32) if lights is None else np.reciprocal(lights)
        self.image, count = _masked_median(samples, shows, moves, gains, (width, height))
        # Samples that must show a place of the plate.
        self.valid = np.where(count >= min(3, len(maps)), 255, 0).astype(np.uint8)
        if hidden is not None:
            self._continue(shows, moves, count)

    def _continue(self, shows: Sequence[Image], moves: Floats, count: Image) -> None:
        """Ground that the target hides is what is seen of it, or what is around it."""
        size = self.image.shape[1::-1]
        covered = np.zeros(self.valid.shape, np.uint8)
        for one, move in zip(shows, moves, strict=True):
            there = cv2.warpPerspective(255 - one, move, size, flags=cv2.INTER_NEAREST)
            covered |= np.asarray(there, np.uint8)
        self.valid |= covered
        never = ((count == 0) & (covered > 0)).astype(np.uint8)
        if never.any():
            self.image = np.asarray(cv2.inpaint(self.image, never, 3, cv2.INPAINT_TELEA), np.uint8)

    def laid(self, image: NDArray, here: Floats, *window: Ints, **how: Any) -> NDArray:
        """An image over the plate in the frame that the map carries, or in a window of that."""
        (left, top), (right, bottom) = window or (np.zeros(2, int), self.size)
        back = np.linalg.inv(self.shift @ here)
        if np.array_equal(back, np.eye(3)):
            return image[top:bottom, left:right]
        to_window = np.array([[1, 0, -left], [0, 1, -top], [0, 0, 1]])
        return cv2.warpPerspective(image, to_window @ back, (right - left, bottom - top), **how)

    def seen_from(self, here: Floats, *window: Ints) -> tuple[Image, Bools]:
        """The background in the frame that the map carries, or a window; where it is known."""
        valid = self.laid(self.valid, here, *window, flags=cv2.INTER_NEAREST)
        return self.laid(self.image, here, *window), valid > 0


def _without(shows: Image, box: Floats) -> Image:
    """What a sample shows of the ground: not what is in an ellipse around a box."""
    if not np.isfinite(box).all():
        return shows
    centre, axes = box[:2] + (box[2:] - 1) / 2, 0.6 * box[2:] + 2
    ends = tuple(np.rint(centre).astype(int).tolist()), tuple(np.ceil(axes).astype(int).tolist())
    return np.asarray(cv2.ellipse(shows.copy(), *ends, 0, 0, 360, 0, -1), np.uint8)


def _masked_median(
    samples: Sequence[Image] | Image, shows: Sequence[Image], moves: Floats, gains: Floats32,
    size: tuple[int, int],
) -> tuple[Image, Image]:  # fmt: skip
    """The median of the samples that show each pixel of a canvas, by how many it is shown.

    Strip by strip, as the samples that are carried there would fill the memory. Where a sample
    shows nothing, black and white take turns, which does not move the median.
    """
    width, height = size
    result = np.zeros((height, width, 3), np.uint8)
    count = np.zeros((height, width), np.uint8)
    for top in range(0, height, _STRIP):
        strip = (width, min(_STRIP, height - top))
        up = np.array([[1, 0, 0], [0, 1, -top], [0, 0, 1.0]])
        layers = np.empty((len(samples), strip[1], width, 3), np.uint8)
        here = np.zeros((strip[1], width), np.uint8)
        for k, (sample, full, move) in enumerate(zip(samples, shows, moves, strict=True)):
            if np.array_equal(move, np.eye(3)) and sample.shape[:2] == (height, width):
                there, shown = (image[top : top + strip[1]] for image in (sample, full))
            else:
                there = cv2.warpPerspective(sample, up @ move, strip)
                shown = cv2.warpPerspective(full, up @ move, strip, flags=cv2.INTER_NEAREST)
            same = (gains[k] == 1).all()
            layers[k] = there if same else cv2.multiply(there, np.array([*gains[k], 0.0]))
            shown = shown > 0
            if shown.all():
                here += 1
                continue
            missing = k - here  # samples before it that show nothing
            layers[k][~shown] = np.where(missing[~shown] % 2, 255, 0)[:, None]
            here += shown
        result[top : top + strip[1]] = _median(layers)
        count[top : top + strip[1]] = here
    return result, count


def lights_of(samples: Image, maps: Floats, known: Bools) -> Floats32:
    """How much brighter (m, 3) each of the samples of a film is than most of them."""
    plate = Plate(samples[known], maps[known])
    return np.array([light(sample, *plate.seen_from(here))
                     for sample, here in zip(samples, maps, strict=True)])  # fmt: skip


def least_difference(noise: float) -> float:
    """Grey levels below which nothing differs from the ground, in this noise of a pixel."""
    return float(np.clip(5 * noise, 8.0, 60.0))


def tolerance(ground: Image, least: float, *, moves: bool) -> Floats32:
    """Grey levels by which frames may differ from each place of their ground.

    An edge may be displaced, by more if the camera moves.
    """
    grey = cv2.cvtColor(ground, cv2.COLOR_RGB2GRAY)
    slope = cv2.morphologyEx(grey, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    return np.asarray(least + (0.5 if moves else 0.12) * slope.astype(np.float32), np.float32)


def noise_of(samples: Image, maps: Floats, plate: Plate) -> float:
    """Of a pixel, in grey levels: of the quieter samples, which differ from the plate by that."""
    found = []
    step = max(3, samples.shape[2] // 640)
    every = np.s_[::step, ::step]
    for sample, here in zip(samples, maps, strict=True):
        then, known = plate.seen_from(here)
        now, then, known = sample[every], then[every], known[every]
        if known.any():
            differs = changes(now, then, light(now, then, known))[known]
            found.append(1.4826 * np.median(np.abs(differs)))
    return float(np.median(found)) if found else 0.0
