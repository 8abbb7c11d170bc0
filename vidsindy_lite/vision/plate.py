"""The ground before which things move: a median of frames without the camera's motion.

The *plate* is the background as no single frame shows it: the median over frames spread through the
clip, each carried into the first frame by the camera's motion and, where the light or the exposure
changes, brought into the same light. A target that covers the same ground
in most of the frames is a part of that median; once its places are known, they are left out of it,
and ground that no frame shows continues what is around it.
"""

from collections.abc import Iterable, Sequence

import cv2
import numpy as np

from ..arrays import Bools, Floats, Floats32, Image
from .background import STRIP, changes, light, median_image
from .steadying import carry


class Plate:
    """The steadied background, of frames of one size.

    Parameters
    ----------
    samples : ndarray, shape (m, height, width, 3), uint8
    maps : ndarray, shape (m, 3, 3)
        Where each lies in the first frame.
    known : ndarray, shape (m,), bool
        Which of the maps can be trusted.
    hidden : ndarray, shape (m, 4), optional
        What of each sample is not the ground: left, top, width, height; NaN for nothing.
    lights : ndarray, shape (m, 3), optional
        How much brighter each sample is, see `lights_of`; by default all are in the same light.
    """

    def __init__(
        self,
        samples: Image,
        maps: Floats,
        known: Bools,
        hidden: Iterable[Floats] | None = None,
        lights: Floats32 | None = None,
    ) -> None:
        size = np.array(samples.shape[2:0:-1])
        self.size = size
        self.moves = not np.allclose(maps, np.eye(3))
        self.shift = np.eye(3)
        if lights is None:
            lights = np.ones((len(samples), 3), np.float32)
        if not self.moves and hidden is None and (lights == 1).all():
            self.image = median_image(samples)
            self.valid = np.full(self.image.shape[:2], 255, np.uint8)
            return
        width, height = size.tolist()
        if self.moves:
            corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) * (size - 1.0)
            ends = [carry(h, corners) for h in maps[known]]
            low = np.floor(np.percentile([e.min(axis=0) for e in ends], 5, axis=0))
            high = np.ceil(np.percentile([e.max(axis=0) for e in ends], 95, axis=0))
            middle = carry(maps[known][len(maps[known]) // 2], corners).mean(axis=0)
            # Frames that the plate may hold, side by side.
            reach = size * np.sqrt(2.5) / 2
            low = np.floor(np.maximum(low, middle - 1.5 * reach))
            high = np.minimum(high, middle + 1.5 * reach)
            self.shift = np.array([[1, 0, -low[0]], [0, 1, -low[1]], [0, 0, 1.0]])
            width, height = (int(x) for x in np.ceil(high - low) + 1)
        shows = [np.full(samples.shape[1:3], 255, np.uint8)] * len(samples)
        if hidden is not None:
            shows = [_without(one, box) for one, box in zip(shows, hidden, strict=True)]
        use = np.flatnonzero(known)
        moves = [self.shift @ maps[i] for i in use]
        shown = [samples[i] for i in use]  # views: copies would fill the memory
        self.image, count = _masked_median(
            shown, [shows[i] for i in use], moves, np.reciprocal(lights[use]), (width, height)
        )
        # Samples that must show a place of the plate.
        self.valid = np.where(count >= 3, 255, 0).astype(np.uint8)
        if hidden is not None:
            self._continue([shows[i] for i in use], moves, count)

    def _continue(self, shows: Sequence[Image], moves: Sequence[Floats], count: Image) -> None:
        """Ground that the target hides is what is seen of it, or what is around it."""
        size = self.image.shape[1::-1]
        covered = np.zeros(self.valid.shape, np.uint8)
        for one, move in zip(shows, moves, strict=True):
            there = cv2.warpPerspective(255 - one, move, size, flags=cv2.INTER_NEAREST)
            covered |= np.asarray(there, np.uint8)
        self.valid |= covered
        never = ((count == 0) & (covered > 0)).astype(np.uint8)
        left, top, width, height = cv2.boundingRect(never)
        if width:
            window = np.s_[max(top - 8, 0) : top + height + 8, max(left - 8, 0) : left + width + 8]
            self.image[window] = cv2.inpaint(
                self.image[window], never[window], 3, cv2.INPAINT_TELEA
            )

    def laid(self, image: Floats32, here: Floats) -> Floats32:
        """An image over the plate, as the frame that the map carries sees it; 1000 beyond it."""
        if not self.moves:
            return image
        back, size = np.linalg.inv(self.shift @ here), self.size.tolist()
        return np.asarray(cv2.warpPerspective(image, back, size, borderValue=1e3), np.float32)

    def seen_from(
        self, here: Floats, low: Floats | None = None, high: Floats | None = None, step: int = 1
    ) -> tuple[Image, Bools]:
        """The background in the frame that the map carries, or a window of it; where it is known.

        Only every pixel of some `step` in each row and column.
        """
        left, top = np.zeros(2, int) if low is None else low
        size = (self.size if high is None else high) - [left, top]
        if not self.moves:
            window = np.s_[top : top + size[1] : step, left : left + size[0] : step]
            return self.image[window], self.valid[window] > 0
        to_window = np.array([[1, 0, -left], [0, 1, -top], [0, 0, step]]) / step
        size = (-(-size // step)).tolist()
        back = to_window @ np.linalg.inv(self.shift @ here)
        image = cv2.warpPerspective(self.image, back, size, flags=cv2.INTER_LINEAR)
        valid = cv2.warpPerspective(self.valid, back, size, flags=cv2.INTER_NEAREST)
        return np.asarray(image, np.uint8), np.asarray(valid) > 0


def _without(shows: Image, box: Floats) -> Image:
    """What a sample shows of the ground: not what is in an ellipse around a box."""
    if not np.isfinite(box).all():
        return shows
    centre, axes = box[:2] + (box[2:] - 1) / 2, 0.6 * box[2:] + 2
    ends = tuple(np.rint(centre).astype(int).tolist()), tuple(np.ceil(axes).astype(int).tolist())
    return np.asarray(cv2.ellipse(shows.copy(), *ends, 0, 0, 360, 0, -1), np.uint8)


def _masked_median(
    samples: Sequence[Image], shows: Sequence[Image], moves: Sequence[Floats], gains: Floats32,
    size: tuple[int, int],
) -> tuple[Image, Image]:  # fmt: skip
    """The median of the samples that show each pixel of a canvas, by how many it is shown.

    Strip by strip, as the samples that are carried there would fill the memory. Where a sample
    shows nothing, black and white take turns, which does not move the median.
    """
    width, height = size
    result = np.zeros((height, width, 3), np.uint8)
    count = np.zeros((height, width), np.uint8)
    for top in range(0, height, STRIP):
        strip = (width, min(STRIP, height - top))
        up = np.array([[1, 0, 0], [0, 1, -top], [0, 0, 1.0]])
        layers = np.empty((len(samples), strip[1], width, 3), np.uint8)
        here = np.zeros((strip[1], width), np.uint8)
        for k, (sample, full, move) in enumerate(zip(samples, shows, moves, strict=True)):
            there = cv2.warpPerspective(sample, up @ move, strip)
            layers[k] = cv2.multiply(there, np.array([*gains[k], 0.0]))
            shown = cv2.warpPerspective(full, up @ move, strip, flags=cv2.INTER_NEAREST) > 0
            missing = k - here  # samples before it that show nothing
            layers[k][~shown] = np.where(missing[~shown] % 2, 255, 0)[:, None]
            here += shown
        result[top : top + strip[1]] = median_image(layers)
        count[top : top + strip[1]] = here
    return result, count


def lights_of(samples: Image, maps: Floats, known: Bools) -> Floats32:
    """How much brighter (m, 3) each of the samples of a film is than most of them."""
    plate = Plate(samples, maps, known)
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
    for sample, here in zip(samples, maps, strict=True):
        then, known = plate.seen_from(here, step=step)
        now = sample[::step, ::step]
        if known.any():
            differs = changes(now, then, light(now, then, known))[known]
            found.append(1.4826 * np.median(np.abs(differs)))
    return float(np.median(found)) if found else 0.0
