"""What may be the target in each frame: all that differs from the steadied background.

The *plate* is the background as no single frame shows it: the median over frames spread through the
clip, each carried into the first frame by the camera's motion. What differs from it, beyond noise
and beyond what an edge does that is displaced a little, falls apart into blobs, each a candidate
with its place, size, colour and the strength of its evidence. Which of them are the target is for
`linking` to say.

All of this happens on reduced frames, see `reducing`.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from ..arrays import Bools, Floats, Floats32, Image, Ints
from .background import light, median_image
from .pixels import lengths, relit

_LARGEST = 2.5  # frames that the plate may hold, side by side
_FEWEST = 3  # samples that must show a place of the plate
_LEAST, _COARSE = 8.0, 60.0  # grey levels, below which no difference counts, whatever the noise
_EDGE = {False: 0.12, True: 0.5}  # pixels by which an edge may be displaced; if the camera moves
_FILLS = 0.3  # share of the image that no target fills
_STRIP = 128  # rows of a canvas whose median is taken at once
_MOST = 40  # candidates of a frame that are looked at
_KEPT = 12  # and that are kept, once it is known which of them stay where they are
_STAYS = 1.0  # by how much of its quality a candidate loses that is there in all frames
_WORTH = 0.4  # share of its quality that it keeps at least
_LEVELS = 2.0, 4.0, 8.0  # times the tolerance, by which a core differs at least; and
_PLAINER = 2.0  # times as much as what is around it
_CORE = 25, 0.5  # pixels of a core at least, and its share of the whole at most
_ALIKE = 40.0, 2.0  # grey levels of colour and factor of size between two that look alike


@dataclass(frozen=True)
class Candidate:
    """Something that differs from the background, in pixels of its frame.

    `centre` (2,), `box` (left, top, width, height), area, mean colour (3,), quality in [0, 1].
    """

    centre: Floats
    box: Floats
    area: float
    colour: Floats
    quality: float


class Plate:
    """The steadied background, of frames of one size.

    Parameters
    ----------
    samples : ndarray, shape (m, height, width, 3), uint8
    maps : ndarray, shape (m, 3, 3)
        Where each lies in the first frame.
    known : ndarray, shape (m,), bool
        Which of the maps can be trusted.
    """

    def __init__(self, samples: Image, maps: Floats, known: Bools) -> None:
        size = np.array(samples.shape[2:0:-1])
        self.size = size
        self.moves = not np.allclose(maps, np.eye(3))
        if not self.moves:
            self.shift, self.image = np.eye(3), median_image(samples)
            self.valid = np.full(self.image.shape[:2], 255, np.uint8)
            return
        corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) * (size - 1.0)
        ends = [_carry(h, corners) for h in maps[known]]
        low = np.floor(np.percentile([e.min(axis=0) for e in ends], 5, axis=0))
        high = np.ceil(np.percentile([e.max(axis=0) for e in ends], 95, axis=0))
        middle = _carry(maps[known][len(maps[known]) // 2], corners).mean(axis=0)
        reach = size * np.sqrt(_LARGEST) / 2
        low, high = np.maximum(low, middle - 1.5 * reach), np.minimum(high, middle + 1.5 * reach)
        low = np.floor(low)
        self.shift = np.array([[1, 0, -low[0]], [0, 1, -low[1]], [0, 0, 1.0]])
        width, height = (int(x) for x in np.ceil(high - low) + 1)
        moves = [self.shift @ here for here in maps[known]]
        shown = [samples[k] for k in np.flatnonzero(known)]  # views: copies would fill the memory
        self.image, count = _masked_median(shown, moves, (width, height))
        self.valid = np.where(count >= _FEWEST, 255, 0).astype(np.uint8)

    def samples(
        self, samples: Image, maps: Floats, known: Bools, window: tuple[slice, slice]
    ) -> tuple[Image, Bools]:
        """The samples in a window of the plate, (m, h, w, 3), and where they show it."""
        if not self.moves:
            views = samples[:, *window]
            return views, np.ones(views.shape[:3], bool)
        height, width = self.image.shape[:2]
        top, bottom, _ = window[0].indices(height)
        left, right, _ = window[1].indices(width)
        to_window = np.array([[1, 0, -left], [0, 1, -top], [0, 0, 1.0]]) @ self.shift
        size = right - left, bottom - top
        views = np.zeros((int(known.sum()), size[1], size[0], 3), np.uint8)
        shown = np.zeros(views.shape[:3], bool)
        full = np.full(samples.shape[1:3], 255, np.uint8)
        for k, i in enumerate(np.flatnonzero(known)):
            move = to_window @ maps[i]
            views[k] = cv2.warpPerspective(samples[i], move, size)
            shown[k] = cv2.warpPerspective(full, move, size, flags=cv2.INTER_NEAREST) > 0
        return views, shown

    def seen_from(
        self, here: Floats, corner: Floats, size: tuple[int, int], step: int = 1
    ) -> tuple[Image, Bools]:
        """The background in a window of the frame that the map carries; where it is known.

        Only every pixel of some `step` in each row and column.
        """
        left, top = (int(x) for x in corner)
        if not self.moves:
            window = np.s_[top : top + size[1] : step, left : left + size[0] : step]
            return self.image[window], self.valid[window] > 0
        to_window = np.array([[1, 0, -left], [0, 1, -top], [0, 0, step]]) / step
        size = -(-size[0] // step), -(-size[1] // step)
        back = to_window @ np.linalg.inv(self.shift @ here)
        image = cv2.warpPerspective(self.image, back, size, flags=cv2.INTER_LINEAR)
        valid = cv2.warpPerspective(self.valid, back, size, flags=cv2.INTER_NEAREST)
        return np.asarray(image, np.uint8), np.asarray(valid) > 0


def _carry(here: Floats, points: Floats) -> Floats:
    ends = np.column_stack([points, np.ones(len(points))]) @ here.T
    return ends[:, :2] / ends[:, 2:]


def _masked_median(
    samples: list[Image], moves: list[Floats], size: tuple[int, int]
) -> tuple[Image, Image]:
    """The median of the samples that show each pixel of a canvas, by how many it is shown.

    Strip by strip, as the samples that are carried there would fill the memory. Where a sample
    shows nothing, black and white take turns, which does not move the median.
    """
    width, height = size
    result = np.zeros((height, width, 3), np.uint8)
    count = np.zeros((height, width), np.uint8)
    full = np.full(samples[0].shape[:2], 255, np.uint8)
    for top in range(0, height, _STRIP):
        strip = (width, min(_STRIP, height - top))
        up = np.array([[1, 0, 0], [0, 1, -top], [0, 0, 1.0]])
        layers = np.empty((len(samples), strip[1], width, 3), np.uint8)
        here = np.zeros((strip[1], width), np.uint8)
        for k, (sample, move) in enumerate(zip(samples, moves, strict=True)):
            layers[k] = cv2.warpPerspective(sample, up @ move, strip)
            shown = cv2.warpPerspective(full, up @ move, strip, flags=cv2.INTER_NEAREST) > 0
            missing = k - here  # samples before it that show nothing
            layers[k][~shown] = np.where(missing[~shown] % 2, 255, 0)[:, None]
            here += shown
        result[top : top + strip[1]] = median_image(layers)
        count[top : top + strip[1]] = here
    return result, count


def tolerance(plate: Plate, noise: float) -> Floats32:
    """Grey levels by which reduced frames may differ from each place of their plate."""
    grey = cv2.cvtColor(plate.image, cv2.COLOR_BGR2GRAY)
    slope = cv2.morphologyEx(grey, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    least = np.float32(np.clip(5 * noise, _LEAST, _COARSE))
    bound = least + np.float32(_EDGE[plate.moves]) * slope.astype(np.float32)
    if plate.moves:
        bound[plate.valid == 0] = 1e3
    return np.asarray(bound, np.float32)


class Difference:
    """What differs from the plate, in reduced frames one at a time."""

    def __init__(self, plate: Plate, noise: float) -> None:
        self.plate = plate
        self.tolerance = tolerance(plate, noise)
        self.often = np.zeros(plate.valid.shape, np.float32)
        self.lights: list[Floats32] = []

    def candidates(self, frame: Image, here: Floats) -> list[Candidate]:
        """The blobs of a reduced frame, the plainest first, in its pixels."""
        height, width = frame.shape[:2]
        background, known = self.plate.seen_from(here, np.zeros(2), (width, height))
        tolerance = self.tolerance
        if self.plate.moves:
            back = np.linalg.inv(self.plate.shift @ here)
            carried = cv2.warpPerspective(tolerance, back, (width, height), borderValue=1e3)
            tolerance = np.asarray(carried, np.float32)
        factor = light(frame, background, known)
        self.lights.append(factor)
        change = frame - relit(background, factor)
        strength = lengths(change) / tolerance
        differs = ((strength > 1) & known).astype(np.uint8)
        closed = cv2.morphologyEx(differs, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
        mask = np.asarray(closed, np.uint8)
        self._note(mask, here)
        found = blobs(mask, strength, frame, background, factor)
        for core in cores(mask, strength):
            found += blobs(core, strength, frame, background, factor)
        return found

    def _note(self, mask: Image, here: Floats) -> None:
        """Count how often each place of the plate differs from it."""
        if self.plate.moves:
            size = self.often.shape[1::-1]
            move = self.plate.shift @ here
            self.often += cv2.warpPerspective(mask, move, size, flags=cv2.INTER_NEAREST)
        else:
            self.often += mask

    def travelling(self, found: list[Candidate], here: Floats) -> list[Candidate]:
        """The candidates of a frame, in the order of their quality, those that stay worth less.

        To be called when all frames have been seen: what differs from the plate in a place in many
        frames, e.g. leaves that sway or the ghost of what has left, is hardly the target.
        """
        if not found:
            return []
        often = self._shares(np.array([one.centre for one in found]), here)
        worth = np.maximum(1 - _STAYS * often, _WORTH)
        kept = [
            replace(c, quality=c.quality * w) for c, w in zip(found, worth.tolist(), strict=True)
        ]
        return sorted(kept, key=lambda one: -one.quality)[:_KEPT]

    def _shares(self, centres: Floats, here: Floats) -> Floats:
        """Share of the frames in which each middle (m, 2) differs from the plate."""
        size = np.array(self.often.shape[::-1])
        at = _carry(self.plate.shift @ here, centres).round().astype(int)
        around = at[:, None] + np.mgrid[-1:2, -1:2].reshape(2, -1).T
        inside = np.asarray(((around >= 0) & (around < size)).all(axis=2), bool)
        u, v = np.where(inside[..., None], around, 0).transpose(2, 0, 1)
        count = np.maximum(inside.sum(axis=1), 1)
        shares = (self.often[v, u] * inside).sum(axis=1) / count / len(self.lights)
        return np.asarray(np.where((at >= 0).all(axis=1), shares, 0.0), float)


def cores(mask: Image, strength: Floats32) -> list[Image]:
    """Masks of what differs far more than that with which it is in one piece.

    A target that meets its shadow, or a wide and faint change of the light, is a small part of the
    whole. Of a person, many parts differ about as much, and none is a core.
    """
    _, whole, stats, _ = cv2.connectedComponentsWithStats(mask)
    areas = stats[:, cv2.CC_STAT_AREA].tolist()
    large = stats[1:][stats[1:, cv2.CC_STAT_AREA] > _CORE[0] / _CORE[1]]
    if not len(large):  # no whole has a part that is large enough
        return []
    low, high = large[:, :2].min(axis=0), (large[:, :2] + large[:, 2:4]).max(axis=0)
    place = np.s_[low[1] : high[1], low[0] : high[0]]
    whole, strength, inside = whole[place], strength[place], mask[place]
    totals = np.bincount(whole.ravel(), strength.ravel(), len(areas)).tolist()
    found = []
    for level in _LEVELS:
        plain = np.asarray(inside & (strength > level), np.uint8)
        if np.count_nonzero(plain) < _CORE[0]:
            break
        core = np.zeros_like(plain)
        _, labels, stats, _ = cv2.connectedComponentsWithStats(plain)
        for k in 1 + np.flatnonzero(stats[1:, cv2.CC_STAT_AREA] >= _CORE[0]):
            left, top, width, height, area = stats[k].tolist()
            window = np.s_[top : top + height, left : left + width]
            here = labels[window] == k
            total, around = float(strength[window][here].sum()), whole[window][here][0]
            rest = (totals[around] - total) / max(areas[around] - area, 1)
            if area < _CORE[1] * areas[around] and total / area > _PLAINER * rest:
                core[window][here] = 1
                whole[window][here] = len(areas)  # what lies within is compared with this
                areas.append(area)
                totals.append(total)
        if core.any():
            found.append(np.zeros_like(mask))
            found[-1][place] = core
    return found


def blobs(
    mask: Image, strength: Floats32, frame: Image, ground: Image, factor: Floats32
) -> list[Candidate]:
    """The connected parts of a mask as candidates, in a frame that is brighter by a factor."""
    height, width = mask.shape
    low_u, low_v, wide, high = cv2.boundingRect(mask)  # OpenCV looks at each pixel several times
    place = np.s_[low_v : low_v + high, low_u : low_u + wide]
    if not wide:
        return []
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask[place])
    stats[:, :2] += [low_u, low_v]
    v, u = np.nonzero(mask[place])
    part, strong = np.asarray(labels[v, u], int), strength[place][v, u]
    v, u = v + low_v, u + low_u
    area = stats[:, cv2.CC_STAT_AREA]
    total = np.bincount(part, strong, count)
    mean = total / np.maximum(area, 1)
    plain = (mean - 1) * np.sqrt(np.minimum(area, 25))
    order = 1 + np.argsort(-plain[1:])[:_MOST]
    order = order[((area >= 2) | (mean >= 3))[order] & (area <= _FILLS * mask.size)[order]]
    inner = strong >= _nearly_strongest(part, strong, order, count)[part]
    core = part[inner]
    colour, behind = (_means(image[v[inner], u[inner]], core, count) for image in (frame, ground))
    colour /= factor
    quality = (1 - np.exp(-plain / 4)) * np.where(_are_shadows(colour, behind), 0.5, 1.0)
    sum_u, sum_v = (np.bincount(part, x * strong, count) for x in (u, v))
    found = []
    for k in order.tolist():
        left, top, wide, high, _ = stats[k].tolist()
        worth = float(quality[k])
        if left == 0 or top == 0 or left + wide == width or top + high == height:
            worth *= 0.6
        centre = np.array([sum_u[k], sum_v[k]]) / total[k]
        box = np.array([left, top, wide, high], float)
        found.append(Candidate(centre, box, float(area[k]), colour[k], worth))
    return found


def _nearly_strongest(part: Ints, strong: Floats32, wanted: Ints, count: int) -> Floats32:
    """Of each part that is wanted, seven tenths of the strength that a tenth of it exceeds."""
    bound = np.full(count, np.inf, np.float32)
    order = np.argsort(
        part.astype(np.uint16), kind="stable"
    )  # a quarter of 480 x 480 parts at most
    ends = np.cumsum(np.bincount(part, minlength=count))
    for k in wanted.tolist():
        own = strong[order[ends[k - 1] : ends[k]]]
        own.partition(rank := int(0.9 * (len(own) - 1)))
        bound[k] = np.float32(0.7) * own[rank]
    return bound


def _means(colours: Image, part: Ints, count: int) -> Floats:
    """Mean colours (count, 3) of the parts to which pixels (m, 3) belong."""
    sums = np.column_stack([np.bincount(part, x, count) for x in colours.T])
    return sums / np.maximum(np.bincount(part, minlength=count), 1)[:, None]


def uncommon(found: list[Candidate], targets: int) -> list[Candidate]:
    """The candidates of a frame, worth the less the more of them look alike than there are targets.

    The leaves of a tree hardly leave their places, and before a plain wall that does not tell the
    camera's motion all that is at rest seems to move. But they are many, the targets few.
    """
    colour = np.array([one.colour for one in found]).reshape(-1, 3)
    size = np.log([np.sqrt(one.area) for one in found])
    like = np.linalg.norm(colour[:, None] - colour, axis=2) < _ALIKE[0]
    like &= np.abs(size[:, None] - size) < np.log(_ALIKE[1])
    worth = np.minimum((targets + 1) / np.maximum(like.sum(axis=1), 1), 1)  # two are no crowd
    return [replace(one, quality=one.quality * w) for one, w in zip(found, worth, strict=True)]


def _are_shadows(colours: Floats, grounds: Floats) -> Bools:
    """The same surfaces (m, 3) in less light: darker by about the same factor in all colours."""
    ratio = (colours + 4) / (grounds + 4)
    mean = ratio.mean(axis=1)
    return (mean > 0.35) & (mean < 0.95) & (np.ptp(ratio, axis=1) < 0.1 * mean)
