"""The background model: what differs from a background at rest is the target, to 1/100 of a pixel.

The background is the median over frames spread through the clip; the target is what
differs from it. Where a frame mixes target and background, its colour lies on the line between the
two, so that the *coverage* of each pixel,

::

    alpha = <frame - background, target - background> / |target - background|^2,

is known even along an anti-aliased edge, and the centroid is the mean of the pixel positions
weighted with it. Being linear in the frame, it stays unbiased under image noise.

Where the camera moves, the *plate* is the background as no single frame shows it: the median of
frames of which each is carried into the first one by the camera's motion and, where the light or
the exposure changes, brought into the same light. A target that covers the same ground in most of
the frames is a part of that median; once its places are known, they are left out of it, and ground
that no frame shows continues what is around it.

Behind an occluder or across the image border the visible part of the target has another centroid
than the target. It also has another *shape*, whereas whole views are alike up to rotation and size:
that is how `view_distances` tells the one from the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial.distance import cdist

from ..arrays import Bools, Floats, Floats32, Image, Ints
from .video import Reel, reduce

LONGEST = 480  # pixels of the longer side of a reduced frame
_COARSE = 4  # factor by which the image is reduced for the search over the whole frame
STRIP = 64  # rows of an image that are sorted at once: what they need stays in the cache
_OFTEN = 0.1  # share of the samples in which other things differ: more are unrest
_TOO_LARGE = 0.25  # share of the image that no target fills

# Two pixels on both sides of the target's outline, whose coverage is estimated.
_DISC = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))

Window = tuple[slice, slice]
_Look = tuple[Floats, float, float]


# -------------------------------------------------------------------------------------- background


def dot(a: Floats32, b: Floats32) -> Floats32:
    """Scalar product of the colours of each pixel."""
    return (a * b) @ np.ones(3, np.float32)


def lengths(a: Floats32) -> Floats32:
    """Root of the sum of the squares of the colours of each pixel."""
    return np.sqrt(dot(a, a))


def shadowed(now: Floats | Floats32, ground: Floats | Floats32, uneven: float) -> Bools:
    """Where (...) the same surface is seen in less light: darker by the same in all colours.

    By how much these factors may be `uneven`: of means by less than of noisy pixels.
    """
    ratio = (now + 4) / (ground + 4)
    mean, apart = ratio.mean(axis=-1), ratio.max(axis=-1) - ratio.min(axis=-1)
    return np.asarray((mean > 0.35) & (mean < 0.95) & (apart < uneven * mean))


def relit(image: Image, factor: Floats32) -> Floats32:
    """An image as it is where each colour is brighter by a factor (3,)."""
    rows = image.reshape(len(image), -1) * np.tile(factor, image.shape[1])
    return np.asarray(rows.reshape(image.shape), np.float32)


def changes(frame: Image, ground: Image, factor: Floats32) -> Floats32:
    """By what the colours of a frame differ from a ground that is brighter by a factor (3,).

    What is saturated is at least so bright: what is brighter than that is no difference.
    """
    then = relit(ground, factor)
    if factor.min() < 1:
        np.maximum(then, frame, out=then, where=ground >= 250)  # 255, but for compression
    return np.asarray(frame - (np.minimum(then, 255) if factor.max() > 1 else then), np.float32)


def hull(mask: Bools) -> Ints:
    """Convex outline (k, 2) of a mask: that of the first and the last pixels of its rows."""
    rows = np.flatnonzero(mask.any(axis=1))
    first = mask[rows].argmax(axis=1)
    last = mask.shape[1] - 1 - mask[rows, ::-1].argmax(axis=1)
    ends = np.column_stack([np.concatenate([first, last]), np.concatenate([rows, rows])])
    return np.asarray(cv2.convexHull(ends.astype(np.int32))[:, 0], int)


def carry(maps: NDArray, points: Floats) -> Floats:
    """Points (n, 2) taken through one map (3, 3), or each through its own (n, 3, 3)."""
    ends = np.einsum("...ij,...j->...i", maps, np.column_stack([points, np.ones(len(points))]))
    return ends[:, :2] / ends[:, 2:]


def sampled(frames: int) -> Ints:
    """The numbers of about 21 frames spread evenly over a clip of so many."""
    return np.unique(np.linspace(0, frames - 1, 21).round().astype(int))


def sample_frames(frames: Reel) -> NDArray[np.uint8]:
    """The frames that are `sampled`, as far as the clip holds them, (m, height, width, 3)."""
    info = frames.info
    spread = sampled(info.frames).tolist()
    samples, count = np.empty((len(spread), *info.size[::-1], 3), np.uint8), 0
    for count, frame in enumerate(frames.whole.pick(spread), 1):
        samples[count - 1] = frame
    return samples[:count]


def median_image(frames: Image) -> Image:
    """Median over the first axis of uint8 images, by a sorting network (8 times numpy's speed).

    Strip by strip: what is sorted stays in the cache, and the memory is not filled by copies.
    """
    result = np.empty_like(frames[0])
    for top in range(0, len(result), STRIP):
        images = [frame[top : top + STRIP] for frame in frames]
        for step in range(len(images)):
            for j in range(step % 2, len(images) - 1, 2):
                low = np.minimum(images[j], images[j + 1])
                images[j + 1] = np.maximum(images[j], images[j + 1])
                images[j] = low
        result[top : top + STRIP] = images[len(images) // 2]
    return result


def _around(box: Sequence[int] | NDArray[np.int32], margin: int) -> Window:
    """The window of an image from so far before a box (left, top, width, height) to behind it."""
    left, top, width, height = box[:4]
    return np.s_[
        max(top - margin, 0) : top + height + margin, max(left - margin, 0) : left + width + margin
    ]


def _remove_ghosts(background: Image, samples: Image, coarse: Image, floor: float) -> None:
    """Correct in place a background that contains the target where it stayed for long.

    Where many samples differ from the background, they show the same place with or without the
    target. Of the two, the one that continues its surroundings is the background. `coarse` are the
    samples, reduced: what continues what needs no more.
    """
    reduced = reduce(background, _COARSE)
    ground = reduced.astype(np.float32)
    differs = np.array([lengths(one - ground) > floor for one in coarse])
    often = (differs.mean(axis=0) > _OFTEN).astype(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(often)
    for k in range(1, count):
        if stats[k, cv2.CC_STAT_AREA] > _TOO_LARGE * often.size:
            continue
        group = differs[:, labels == k].mean(axis=1) > 0.5
        if group.all() or not group.any():
            continue
        window = _around(stats[k], 3)  # coarse pixels that show how its surroundings continue
        place = np.asarray(cv2.dilate((labels[window] == k).astype(np.uint8), np.ones((3, 3))))
        inside = place > 0
        around = cv2.inpaint(reduced[window], place, 3, cv2.INPAINT_TELEA)
        looks = [np.median(coarse[:, *window][g], axis=0)[inside] for g in (group, ~group)]
        off = [np.abs(look - around[inside]).sum() for look in looks]
        whole = tuple(slice(_COARSE * side.start, _COARSE * side.stop) for side in window)
        view = background[whole]
        mask = place.repeat(_COARSE, 0).repeat(_COARSE, 1)[: view.shape[0], : view.shape[1]] > 0
        better = group if off[0] < off[1] else ~group
        view[mask] = median_image(samples[:, *whole][better])[mask]


def _others(changes: list[Floats32], floor: float) -> float:
    """Share of the samples in which something differs from the background beside the target.

    Far from the largest thing that differs, at least so many pixels in one place, or a thing that
    is too large for a target; given the samples' differences from the background.
    """
    found = []
    for change in changes:
        differs = lengths(change) > floor
        largest = _largest_component(differs)
        if largest is None:
            continue
        # Coarse pixels, within which several things that differ may be one target.
        differs[_around(largest[1], 16)] = False
        other = _largest_component(differs)
        # Coarse pixels in one place that are more than noise.
        found.append(
            largest[1][cv2.CC_STAT_AREA] > _TOO_LARGE * differs.size
            or (other is not None and other[1][cv2.CC_STAT_AREA] >= 4)
        )
    return float(np.mean(found)) if found else 0.0


def displacement(background: Floats32, changes: list[Floats32], floor: float) -> float:
    """Pixels by which the whole background is displaced in a sample at most, as far as is sure.

    To first order a displacement changes the image by minus that times its slope: least squares,
    with a prior of one coarse pixel where there is little to see.
    """
    slope = np.array(np.gradient(background, axis=(1, 0))).reshape(2, -1)
    farthest = 0.0
    for change in changes:
        calm = lengths(change) <= floor
        if not calm.any():
            continue
        use = calm.repeat(3)
        g, d = slope * use, change.ravel() * use
        # Grey levels squared; variance of coarse differences without any noise.
        variance = d[use].var() + 0.05
        information = g @ g.T / variance + np.eye(2)
        distance = float(np.linalg.norm(np.linalg.solve(information, g @ d / variance)))
        if distance > 5 * np.sqrt(np.trace(np.linalg.inv(information))):
            farthest = max(farthest, _COARSE * distance)
    return farthest if farthest > 0.15 else 0.0  # pixels; of less, a camera is at rest


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


# --------------------------------------------------------------------------------------- the model


def _unrest(
    background: Floats32, changes: list[Floats32], displaced: float, floor: float
) -> tuple[str, ...]:
    """Why a background model is not the right one: what is not at rest in the samples."""
    doubts = []
    if displaced:
        doubts.append(
            f"the camera moves, by up to {displaced:.1f} px in the sampled frames; "
            "its motion is part of the track"
        )
    everywhere = np.ones(background.shape[:2], bool)
    lights = [np.abs(light(background + change, background, everywhere) - 1) for change in changes]
    # Change of the light above which it is not steady.
    if max(map(np.max, lights)) > 0.02:
        doubts.append(f"the light changes, by up to {100 * np.max(lights):.0f} %")
    others = _others(changes, floor)
    if others > _OFTEN:
        doubts.append(
            "the background is not at rest, or other things move: beside the largest thing that "
            f"differs from it there is another in {100 * others:.0f} % of the sampled frames"
        )
    return tuple(doubts)


@dataclass(frozen=True)
class Blob:
    """One look at the target: centroid (2,) in pixels, visible area, clear of the image border?

    `shape` is None where frame, background and target do not fit together. `softness` is how much
    of it is covered in part, over the root of its area: 0.6 for a sharp disc.
    """

    centroid: Floats
    area: float
    inside: bool
    shape: Floats | None
    softness: float = 0.0


class BackgroundModel:
    """Finds the target in a frame, given the background and what the target looks like.

    Parameters
    ----------
    samples : ndarray, shape (m, height, width, 3), uint8
        Frames spread evenly over the clip, see `sample_frames`.
    """

    def __init__(self, samples: Image) -> None:
        self.background = median_image(samples)
        # Pixels in a row, of every third of which the noise is known well.
        step = 3 * max(1, samples.shape[2] // 640)
        few, calm = samples[:, ::step, ::step], self.background[::step, ::step]
        self.noise = 1.4826 * float(np.median(np.maximum(few, calm) - np.minimum(few, calm)))
        self.coarse_floor = max(6 * self.noise / _COARSE, 8.0)
        coarse = np.array([reduce(sample, _COARSE) for sample in samples])
        _remove_ghosts(self.background, samples, coarse, self.coarse_floor)
        self.size = np.array(self.background.shape[1::-1])
        self.coarse_background = reduce(self.background, _COARSE).astype(np.float32)
        changes = [one - self.coarse_background for one in coarse]
        displaced = displacement(self.coarse_background, changes, self.coarse_floor)
        self.camera_rests = not displaced
        self.unrest = _unrest(self.coarse_background, changes, displaced, self.coarse_floor)
        # The difference is smoothed over about the width of the ring: noise falls to a quarter.
        # Grey levels; above this noise the difference is smoothed before it is thresholded.
        self.blur = 1.2 if self.noise > 2.0 else 0.0
        remaining = self.noise / (2 * np.sqrt(np.pi) * self.blur) if self.blur else self.noise
        self.floor = max(5 * remaining, 12.0)
        self.colour: Floats32 | None = None
        self.several_colours = False

    def learn_target(self, samples: Image) -> None:
        """Colour and area of the target: the medians over the sampled frames."""
        looks = [self._look(frame, *near) for frame in samples if (near := self.search(frame))]
        seen = [look for look in looks if look]
        if not seen:
            return
        self.colour = np.median([look[0] for look in seen], axis=0).astype(np.float32)
        self.area = float(np.median([look[1] for look in seen]))
        # Share of the target that is of another colour, if it has several.
        self.several_colours = bool(np.median([look[2] for look in seen]) > 0.2)
        self.coarse_contrast = self.colour - self.coarse_background
        self.coarse_square = dot(self.coarse_contrast, self.coarse_contrast)
        self.blind = max(self.floor**2, 0.1 * float(np.median(self.coarse_square)))

    def shows_target(self) -> bool:
        """Is the target a part of the background, as it covers the same ground for too long?"""
        if self.colour is None:
            return False
        contrast = np.sqrt(np.median(self.coarse_square))
        alike = lengths(self.background - self.colour) < 0.3 * contrast
        found = _largest_component(alike)
        # So small a part of it makes its views unlike.
        return found is not None and found[1][cv2.CC_STAT_AREA] > self.area / 40

    def _window(self, centre: Floats, half: float) -> tuple[Ints, Ints, Window]:
        """First pixel, the one after the last, and the slices, of the square around a place."""
        low = np.clip(np.floor(centre - half).astype(int), 0, self.size - 1)
        high = np.clip(np.ceil(centre + half).astype(int) + 1, low + 1, self.size)
        return low, high, np.s_[low[1] : high[1], low[0] : high[0]]

    def _difference(self, frame: Image, window: Window) -> tuple[Floats32, Floats32]:
        """Signed difference from the background, and its (smoothed) square summed over colours."""
        change = frame[window].astype(np.float32) - self.background[window]
        smooth = cv2.GaussianBlur(change, (0, 0), self.blur) if self.blur else change
        return change, dot(np.asarray(smooth), np.asarray(smooth))

    def _look(self, frame: Image, centre: Floats, half: float) -> _Look | None:
        """Of what differs most near `centre`: colour, rough area, share that has another colour."""
        _, _, window = self._window(centre, half)
        _, energy = self._difference(frame, window)
        found = _largest_component(energy > max(self.floor**2, 0.2 * energy.max()))
        if found is None:
            return None
        label, stats = found
        core = _erode(label) if _erode(label).any() else label
        colour = np.median(frame[window][core > 0], axis=0)
        core = _erode((_largest_component(energy > self.floor**2) or found)[0])  # and all fainter
        inner, ground = frame[window][core > 0], self.background[window][core > 0]
        other = np.linalg.norm(inner - colour, axis=1) > np.linalg.norm(colour - ground, axis=1) / 2
        return colour, stats[cv2.CC_STAT_AREA], other.mean() if other.size else 0.0

    def search(self, frame: Image) -> tuple[Floats, float] | None:
        """Centre and half width of the part of the whole frame where the target seems to be."""
        change = reduce(frame, _COARSE) - self.coarse_background
        weight = None
        if self.colour is not None:
            match = dot(change, self.coarse_contrast)
            weight = np.clip(match / (self.coarse_square + self.coarse_floor**2), 0, 1)
        found = _largest_component(dot(change, change) > self.coarse_floor**2, weight)
        if found is None:
            return None
        corner, extent = found[1][:2], found[1][2:4]
        centre = _COARSE * (corner + (extent - 1) / 2) + (_COARSE - 1) / 2
        return centre, _COARSE * (extent.max() / 2 + 1) + 4

    def measure(self, frame: Image, centre: Floats, half: float) -> Blob | None:
        """The target within `half` pixels of `centre`, if it is there."""
        if self.colour is None:  # no target was found in the samples
            return None
        low, high, window = self._window(centre, half)
        change, energy = self._difference(frame, window)
        contrast = self.colour - self.background[window]
        square = dot(contrast, contrast)
        found = _largest_component(energy > np.maximum(self.floor**2, 0.1 * square))
        if found is None or not 0.2 < found[1][cv2.CC_STAT_AREA] / self.area < 5:
            return None
        label, stats = found
        near = cv2.dilate(label, _DISC) > 0
        alpha = dot(change, contrast) / (square + self.floor**2 / 9)
        alpha[_erode(label) > 0] = 1
        alpha[~near] = 0
        area = float(alpha.sum())
        if area <= 0:
            return None
        u, v = np.arange(alpha.shape[1]), np.arange(alpha.shape[0])
        centre = np.array([alpha.sum(axis=0) @ u, alpha.sum(axis=1) @ v]) / area
        first, last = low + stats[:2], low + stats[:2] + stats[2:4] - 1
        if ((first == low) & (low > 0)).any() or ((last == high - 1) & (high < self.size)).any():
            return None  # cut off by the window
        inside = bool((first > 0).all() and (last < self.size - 1).all())
        # A background that contains the target hides how far it goes, or makes coverages absurd:
        # as they lie in [0, 1], their squares (with some noise) cannot sum up to more than they do.
        # Share of the target's outline that may lie on background of the same colour.
        blind = (square[near & (label == 0)] < self.blind).mean() > 0.1
        sound = not blind and (alpha**2).sum() < 1.2 * area
        shape = _shape(alpha, u - centre[0], v - centre[1]) if sound else None
        softness = float((alpha * (1 - alpha)).sum() / np.sqrt(area))
        return Blob(low + centre, area, inside, shape, softness)


def _erode(label: Image) -> Image:
    """A mask without its rim of two pixels."""
    eroded = cv2.erode(label, _DISC, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    return np.asarray(eroded, np.uint8)


def _largest_component(
    mask: Bools, weight: Floats32 | None = None
) -> tuple[Image, NDArray[np.int32]] | None:
    """Mask of the connected component of largest area or weight; left, top, width, height, area."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    if count < 2:
        return None
    total = stats[:, cv2.CC_STAT_AREA]
    if weight is not None:
        total = np.bincount(labels.ravel(), weight.ravel(), count)
    largest = 1 + int(np.argmax(total[1:]))
    return (labels == largest).astype(np.uint8), stats[largest]


def _shape(alpha: Floats, u: Floats, v: Floats) -> Floats:
    """Four numbers that tell shapes apart and stay the same under rotation and change of size.

    With z = u + iv from the centroid, rotation changes only the phase of the complex moments
    c_pq = sum of alpha z^p conj(z)^q. -> magnitudes of c_11, c_20, c_21, c_30, dimensionless
    """
    area = alpha.sum()
    m = np.vander(v, 4, increasing=True).T @ alpha @ np.vander(u, 4, increasing=True)
    # The pixels' own extent does not count; no shape has a smaller c_11 than a disc, area^2 / 2 pi.
    c11 = max(m[0, 2] + m[2, 0] - area / 6, 0.01 * area**2)
    c20 = m[0, 2] - m[2, 0] + 2j * m[1, 1]
    c21 = m[0, 3] + m[2, 1] + 1j * (m[1, 2] + m[3, 0])
    c30 = m[0, 3] - 3 * m[2, 1] + 1j * (3 * m[1, 2] - m[3, 0])
    cube = c11**1.5 / np.sqrt(area)
    return np.array([np.log(c11 / area**2), abs(c20) / c11, abs(c21) / cube, abs(c30) / cube])


# ------------------------------------------------------------------------------------------- track


def view_distances(blobs: Sequence[Blob | None]) -> Floats:
    """How far each view (None = not found) is from those of the whole target, (n,).

    Partial views differ from each other, whole views are alike: in the space of shapes they lie
    close around one of them, at least a quarter of all views. As far as these also agree in size,
    it is the target's. Up to 1 a view may be whole, infinite is no view at all.
    """
    seen = [(i, blob) for i, blob in enumerate(blobs) if blob is not None and blob.inside]
    sound = [(i, blob.area, blob.shape) for i, blob in seen if blob.shape is not None]
    quarter = len(seen) // 4
    found = np.full(len(blobs), np.inf)
    if len(sound) > quarter:
        frames, areas, shapes = (np.array(column) for column in zip(*sound, strict=True))
        # Views among which the commonest one is sought.
        apart = cdist(shapes[:: 1 + len(shapes) // 200], shapes)
        radius = np.partition(apart, quarter, axis=1)[:, quarter]
        # Pixels; divided by the target's width: distance of the shapes of two whole views.
        alike = 0.6 / np.sqrt(areas)
        odd_shape = apart[radius.argmin()] / np.maximum(alike, 6 * radius.min())
        size = np.abs(np.log(areas / np.median(areas[odd_shape < 1])))
        odd_size = size / np.maximum(alike, 10 * np.median(size[odd_shape < 1]))
        found[frames] = np.maximum(odd_shape, odd_size)
    return found


def whole_blobs(model: BackgroundModel, frames: Iterable[Image]) -> tuple[Floats, Floats, bool]:
    """Centroids of the whole target (n, 2), NaN where it is not seen, and how sure each view is.

    And whether outlines are too blurred to tell whole views by: where these are blurred, by motion
    or a codec, and many views are left out, it is by the blur that they differ.
    """
    blobs = []
    for frame in frames:
        near = model.search(frame)
        blobs.append(model.measure(frame, *near) if near else None)
    distance = view_distances(blobs)
    # A view beside a distant one may be cut a little: it must be twice as close.
    whole = ~ndimage.binary_propagation(distance > 1, mask=distance > 0.5)
    centroids = np.array([b.centroid if b else (np.nan, np.nan) for b in blobs], float)
    centroids[~whole] = np.nan
    inside = np.array([b is not None and b.inside for b in blobs])
    soft = [b.softness for b in blobs if b is not None and b.inside]
    # Of a sharp outline it is 0.6, see `Blob`.
    # Share of views that are whole, below which a blurred outline cannot be trusted.
    blurred = bool(inside.any() and np.median(soft) > 1.0 and whole[inside].mean() < 0.95)
    return centroids, np.exp(-distance), blurred


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
        self, samples: Image, maps: Floats, known: Bools, hidden: Iterable[Floats] | None = None,
        lights: Floats32 | None = None,
    ) -> None:  # fmt: skip
        self.size = np.array(samples.shape[2:0:-1])
        self.moves = not np.allclose(maps, np.eye(3))
        corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) * (self.size - 1.0)
        ends = [carry(h, corners) for h in maps[known]]
        low = np.floor(np.percentile([e.min(axis=0) for e in ends], 5, axis=0))
        high = np.ceil(np.percentile([e.max(axis=0) for e in ends], 95, axis=0))
        middle = carry(maps[known][len(maps[known]) // 2], corners).mean(axis=0)
        # Frames that the plate may hold, side by side.
        reach = self.size * np.sqrt(2.5) / 2
        low = np.floor(np.maximum(low, middle - 1.5 * reach))
        high = np.minimum(high, middle + 1.5 * reach)
        self.shift = np.array([[1, 0, -low[0]], [0, 1, -low[1]], [0, 0, 1.0]])
        width, height = (int(x) for x in np.ceil(high - low) + 1)
        shows = [np.full(samples.shape[1:3], 255, np.uint8)] * len(samples)
        if hidden is not None:
            shows = [_without(one, box) for one, box in zip(shows, hidden, strict=True)]
        use = np.flatnonzero(known)
        moves = [self.shift @ maps[i] for i in use]
        shows = [shows[i] for i in use]
        lights = np.ones((len(samples), 3), np.float32) if lights is None else lights
        # The samples are views: copies would fill the memory.
        self.image, count = _masked_median(
            [samples[i] for i in use], shows, moves, np.reciprocal(lights[use]), (width, height)
        )
        # Samples that must show a place of the plate.
        self.valid = np.where(count >= min(3, len(use)), 255, 0).astype(np.uint8)
        if hidden is not None:
            self._continue(shows, moves, count)

    def _continue(self, shows: Sequence[Image], moves: Sequence[Floats], count: Image) -> None:
        """Ground that the target hides is what is seen of it, or what is around it."""
        size = self.image.shape[1::-1]
        covered = np.zeros(self.valid.shape, np.uint8)
        for one, move in zip(shows, moves, strict=True):
            there = cv2.warpPerspective(255 - one, move, size, flags=cv2.INTER_NEAREST)
            covered |= np.asarray(there, np.uint8)
        self.valid |= covered
        never = ((count == 0) & (covered > 0)).astype(np.uint8)
        if never.any():
            window = _around(cv2.boundingRect(never), 8)
            self.image[window] = cv2.inpaint(
                self.image[window], never[window], 3, cv2.INPAINT_TELEA
            )

    def laid(self, image: Floats32, here: Floats) -> Floats32:
        """An image over the plate, as the frame that the map carries sees it; 1000 beyond it."""
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
