"""From a path of candidates to the target's centroid, to a fraction of a pixel, in whole frames.

Near each place of the path, what differs from the steadied background and has the target's colour
is taken apart from the rest. Where a frame mixes target and background, its colour lies on the line
between the two, so that the *coverage* of each pixel,

::

    alpha = <frame - background, target - background> / |target - background|^2,

is known even along an anti-aliased edge, and the centroid is the mean of the pixel positions
weighted with it: to a thousandth of a pixel in clean films.

A view may be of a part of the target, of something else, or of both in one. What is missing, or is
not the target's, is on one side of it: such a view is larger or smaller than those around it, or
lopsided in another way, as its *skewness* says. Neither changes where motion or a codec blurs the
outline alike on both sides. Half the size of the target times such a difference is about the pixels
by which the centroid of the view is off the target's; a view is left out where these are many more
than those by which the path scatters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.spatial.distance import cdist

from ..arrays import Bools, Floats, Floats32, Image, Ints
from .plate import Plate, dot, least_difference, lengths, relit, shadowed, tolerance

_AROUND = 9  # views around one that say how large it should be
_MOSTLY = 0.8  # share of the views that must show it whole
_BESIDE = 5  # views before and after a change of size, which show how large it was and is
_CORE = np.ones((5, 5), np.uint8)  # a rim of two pixels


@dataclass(frozen=True)
class View:
    """One look at the target, in pixels of its frame.

    Centroid (2,), area, mean colour, is it clear of the image's border?, skewness (2,), see
    `_skewness`; `whole` is the view of it with all that has another colour in one piece with it, if
    compact. The area is 0 where nothing has the target's colour.
    """

    centroid: Floats
    area: float
    colour: Floats
    inside: bool
    skewness: Floats
    whole: View | None = None


class Lens:
    """Looks at the target in whole frames, before the plate.

    Parameters
    ----------
    plate : Plate
        Of whole frames.
    noise : float
        Of a pixel, in grey levels.
    """

    def __init__(self, plate: Plate, noise: float) -> None:
        self.plate = plate
        self.least = least_difference(noise)
        self.blur = 1.0 if noise > 2 else 0.6

    def look(
        self, frame: Image, here: Floats, box: Floats, centre: Floats, colour: Floats,
        gain: Floats32,
    ) -> View | None:  # fmt: skip
        """The target near a box (left, top, width, height) around `centre`, if it is there."""
        # By half of its size and eight pixels a window exceeds the target.
        spare = 0.5 * box[2:].max() + 8
        low = np.clip(np.floor(box[:2] - spare), 0, self.plate.size - 1).astype(int)
        high = np.clip(np.ceil(box[:2] + box[2:] + spare), low + 1, self.plate.size).astype(int)
        then, known = self.plate.seen_from(here, low, high)
        now = relit(frame[low[1] : high[1], low[0] : high[0]], np.reciprocal(gain))
        ground = then.astype(np.float32)
        change = now - ground
        smooth = np.asarray(cv2.GaussianBlur(change, (0, 0), self.blur), np.float32)
        differs = lengths(smooth)
        bound = tolerance(then, self.least, moves=self.plate.moves)
        mask = (differs > bound) & known
        contrast = colour.astype(np.float32) - ground
        square = dot(contrast, contrast)
        share = dot(smooth, contrast) / np.maximum(square, self.least**2)
        miss = lengths(smooth - share[..., None] * contrast)
        # What is of another colour, e.g. a shadow or a hand: off the line from ground to target.
        off = miss >= np.maximum(0.45 * np.sqrt(square), 2 * self.least)
        own = mask & (share > 0.25) & ~off
        # A shadow is nearer to the line from ground to black than to that from ground to target.
        dark = shadowed(ground + smooth, ground)
        less = dot(smooth, ground) / (dot(ground, ground) + 1)
        dark &= miss > lengths(np.asarray(smooth - less[..., None] * ground)) + self.least
        own &= ~dark
        change[dark] = 0
        label = _nearest(own, centre - low)
        view = label if label is None else self._measure(label, change, contrast, low, now)
        if label is None and (label := _nearest(mask, centre - low)) is None:
            return None
        found = whole(label, mask, mask & (off | (share < 0)), now, ground)
        if found is None:
            return view
        label, colours, plain = found
        if plain:
            return view and replace(view, whole=view)
        first, end = _extent(label, low)
        if (((first == low) & (low > 0)) | ((end == high) & (high < self.plate.size))).any():
            return view  # how far it goes, the window does not show
        all_ = self._measure(label, change, colours - ground, low, now)
        return replace(view or replace(all_, area=0.0), whole=all_)

    def _measure(
        self, label: Bools, change: Floats32, contrast: Floats32, low: Floats, now: Floats32
    ) -> View:
        """Centroid, area and skewness of one connected part."""
        near = cv2.dilate(label.astype(np.uint8), _CORE) > 0
        core = cv2.erode(label.astype(np.uint8), _CORE) > 0
        alpha = dot(change, contrast) / np.maximum(dot(contrast, contrast), self.least**2)
        alpha = np.clip(alpha, 0, 1)
        alpha[core] = 1
        alpha[~near] = 0
        moments = cv2.moments(alpha.astype(float))
        area = moments["m00"]
        centroid = np.array([moments["m10"], moments["m01"]]) / max(area, 1e-9)
        first, end = _extent(label, low)
        inside = bool((first > 0).all() and (end < self.plate.size).all())
        shade = now[core if core.any() else label].mean(axis=0)
        return View(low + centroid, area, shade, inside, _skewness(moments))


def _skewness(moments: Mapping[str, float]) -> Floats:
    """How lopsided a coverage is about its centroid: two numbers that no turn or size changes.

    With z = u + iv from the centroid a turn changes only the phase of the complex moments
    c_pq = sum of alpha z^p conj(z)^q. Of third order, these are magnitudes of c_21 and c_30.
    """
    uuu, uuv, uvv, vvv = (moments[name] for name in ("mu30", "mu21", "mu12", "mu03"))
    c21, c30 = uuu + uvv + 1j * (uuv + vvv), uuu - 3 * uvv + 1j * (3 * uuv - vvv)
    # By the second moment of a disc of that area, as a skewness is by that of a distribution.
    return np.abs([c21, c30]) * (2 * np.pi) ** 1.5 / max(moments["m00"], 1e-9) ** 2.5


def _extent(label: Bools, low: Floats) -> tuple[Floats, Floats]:
    """The first pixel of a mask and the one after its last, in an image where it begins at low."""
    left, top, width, height = cv2.boundingRect(label.astype(np.uint8))
    return low + [left, top], low + [left + width, top + height]


def _nearest(mask: Bools, centre: Floats) -> Bools | None:
    """The connected part of a mask that is largest for its distance from a place."""
    count, labels, stats, centres = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    if count < 2:
        return None
    area = stats[1:, cv2.CC_STAT_AREA]
    apart = np.linalg.norm(centres[1:] - centre, axis=1)
    best = labels == 1 + int(np.argmax(area / (1 + (apart / (2 + np.sqrt(area))) ** 2)))
    rims, _ = cv2.findContours(best.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    return cv2.drawContours(np.zeros(mask.shape, np.uint8), rims, -1, 1, cv2.FILLED) > 0


def entire(views: Sequence[View | None]) -> tuple[list[View | None], tuple[str, ...]]:
    """Views of the whole target, in place of those of one of its colours, and doubts.

    A shadow stays on its side of the target. Where the colour goes round the middle of the whole,
    and the whole keeps its size, that is the target.

    Parameters
    ----------
    views : sequence of View or None
        By the target's colour, one a frame.
    """
    parts = [one if one and one.area > 0 else None for one in views]
    both = [(one, one.whole) for one in views if one is not None and one.whole is not None]
    areas = np.array([[one.area, all_.area] for one, all_ in both]).reshape(-1, 2)
    offset = np.array([one.centroid - all_.centroid for one, all_ in both]).reshape(-1, 2)
    offset = (offset / np.sqrt(areas[:, 1:] / np.pi))[areas[:, 0] > 0]
    if not len(offset) or len(both) < _MOSTLY * sum(one is not None for one in views):
        return parts, ()
    # Of its radius, by which the middle of one colour goes about that of the whole.
    turns = np.linalg.norm(offset - np.median(offset, axis=0), axis=1).mean() > 0.1
    # Share of the whole that one colour covers at most, if there are several.
    if not turns or np.median(areas[:, 0] / areas[:, 1]) > 0.9:
        return parts, ()
    size = np.log(areas[:, 1])
    # Whole views differ from those around them by this factor at most.
    keeps = np.abs(size - median_filter(size, _AROUND)) < np.log(1.5)
    if keeps.mean() > _MOSTLY:
        return [one and (one.whole or one) for one in views], ()
    return parts, ("the target has several colours, or touches other things: perhaps only a part "
                   "of it is followed",)  # fmt: skip


def displaced(
    frames: Floats, places: Floats, areas: Floats, skewness: Floats, inside: Bools
) -> tuple[Floats, float]:
    """Pixels by which views (n,) are off the target, as their outlines say, and a bound to them.

    The usual skewness is the commonest one: whole views, at least a third of all, lie close around
    it. The usual area is that of the views around. By no more than the bound whole views may seem
    to be off: that is how the most alike of them differ, and how their path scatters.
    """
    if not inside.any():
        return np.full(len(areas), np.inf), 0.0
    half, logs = np.sqrt(np.median(areas[inside])) / 2, np.log(np.maximum(areas, 1e-3))
    some, third = skewness[inside][:: 1 + inside.sum() // 200], inside.sum() // 3
    apart = cdist(some, skewness)
    off = half * apart[np.partition(apart[:, inside], third, axis=1)[:, third].argmin()]

    def bound() -> float:
        best = inside & (off <= np.quantile(off[inside], 0.75))
        alike, rough = np.partition(off[inside], third)[third], scatter(frames[best], places[best])
        return float(max(0.05, 8 * alike, 12 * rough if np.isfinite(rough) else 0.0))

    use = np.flatnonzero(inside & (off < bound()))
    if len(use) >= _AROUND:
        off = np.maximum(off, half * np.abs(logs - _trend(frames, frames[use], logs[use])))
    off[~inside] = np.inf
    return off, bound()


def _trend(frames: Floats, at: Floats, values: Floats) -> Floats:
    """What the values around each frame say of it: the line of Theil and Sen through nine."""
    first = np.clip(np.searchsorted(at, frames) - _AROUND // 2, 0, len(at) - _AROUND)
    around = first[:, None] + np.arange(_AROUND)
    t, y = at[around] - frames[:, None], values[around]
    i, j = np.triu_indices(_AROUND, 1)
    slope = np.median((y[:, j] - y[:, i]) / (t[:, j] - t[:, i]), axis=1)
    return np.asarray(np.median(y - slope[:, None] * t, axis=1))


def fitting(
    frames: Floats, places: Floats, areas: Floats, skewness: Floats, inside: Bools
) -> tuple[Bools, float]:
    """Which views (n,) are of the whole target, on its way; by so many pixels they may be off."""
    off, bound = displaced(frames, places, areas, skewness, inside)
    good = off < bound
    while (use := np.flatnonzero(good)).size >= 7:
        miss, unsure = _left_out(frames[use], places[use])
        # Of its size, by which a view may be off the way.
        room = np.maximum(10 * max(float(np.median(miss)), 0.05), 1 + 0.3 * np.sqrt(areas[use]))
        over = miss / (room + unsure)
        # A wrong place spoils what its neighbours seem to be: the worst of them goes first.
        worst = (over > 1) & (over == maximum_filter1d(over, 7))
        if not worst.any():
            break
        good[use[worst]] = False
    return good, bound


def swapped(frames: Ints, areas: Floats) -> int | None:
    """The first view (n,) of something else that is larger or smaller at once, None if all is well.

    No target changes like that within a few frames and remains so.
    """
    logs = np.log2(np.maximum(areas, 1e-3))  # something else has twice the area, or half of it
    most = np.maximum(np.diff(frames) / _AROUND, 1)
    for first in 1 + np.flatnonzero(np.abs(np.diff(logs)) > most):
        before, after = logs[:first][-_BESIDE:], logs[first:][:_BESIDE]
        apart = abs(np.median(after) - np.median(before))
        if min(len(before), len(after)) == _BESIDE and apart > most[first - 1]:
            return int(first)
    return None


def _left_out(frames: Floats, places: Floats) -> tuple[Floats, Floats]:
    """How far places are from where the three on both sides say, and how unsure that is: (m,) each.

    Of five or more. A quartic through six says it. Where a target turns within a few frames, or
    some are missing, no polynomial is right, and a parabola says something else.
    """
    m, count = len(frames), min(6, len(frames) - 1)
    own = np.arange(m)[:, None]
    beside = np.clip(own - 3, 0, m - 1 - count) + np.arange(count)
    beside += beside >= own  # without itself
    t = frames[beside] - frames[:, None]
    quartic, parabola = (
        np.einsum("ij,ijk->ik", np.linalg.pinv(t[..., None] ** np.arange(degree + 1))[:, 0],
                  places[beside])
        for degree in (min(4, count - 1), 2)
    )  # fmt: skip
    first, last = t[:, 0], t[:, -1]
    off = np.linalg.norm(quartic - places, axis=1)
    unsure = np.linalg.norm(quartic - parabola, axis=1) * (1 + ((first > 0) | (last < 0)))
    far = np.maximum(last, 0) - np.minimum(first, 0) > 15
    return np.where(far, 0.0, off), np.where(far, np.inf, unsure)


def roughness(frames: Floats, places: Floats, areas: Floats) -> tuple[Floats, float]:
    """How far each of the views (n,) may be off its place, and how far as a rule by its outline.

    By as much as the way is rough, or as it is off the way of those around it. And what is missing
    of a view, or more than the target, is so on one side of it: by half its share.
    """
    half, logs = np.sqrt(np.median(areas)) / 2, np.log(np.maximum(areas, 1))
    torn = half * scatter(frames, logs[:, None])
    odd = half * np.abs(logs - median_filter(logs, _AROUND, mode="nearest"))
    off, unsure = _left_out(frames, places)
    worst = np.maximum(np.maximum(odd, off - unsure), torn if np.isfinite(torn) else 0.0)
    return np.hypot(scatter(frames, places), worst), torn


def bends(frames: Floats | Ints, places: Floats) -> Floats:
    """How far five places (n, d) in a row are off any cubic, (n - 4, d), over the error of a place.

    That is their fourth divided difference. Each of the five misses the cubic through the others by
    as much, over the error of that.
    """
    five = np.arange(len(frames) - 4)[:, None] + np.arange(5)
    apart = frames[five][:, :, None] - frames[five][:, None]
    fourth = 1 / (apart + np.eye(5)).prod(axis=2)
    fourth /= np.linalg.norm(fourth, axis=1, keepdims=True)
    return np.asarray(np.einsum("nk,nkd->nd", fourth, places[five]))


def scatter(frames: Floats, places: Floats) -> float:
    """Standard error of the places (n, 2) of a smooth motion, per axis: how rough they are."""
    close = frames[4:] - frames[:-4] < 4.5  # where no frame is missing
    if close.sum() < 3:
        return float("inf")
    return float(1.4826 * np.median(np.abs(bends(frames, places)[close])))


def whole(
    own: Bools, differs: Bools, other: Bools, now: Floats32, ground: Floats32
) -> tuple[Bools, Floats32, bool] | None:
    """All that differs from the background in one piece with what has the target's colour, `own`.

    Where that is, (h, w), its colours (h, w, 3), continued to its edge, and whether there is hardly
    another colour; None if it is not one compact thing. Not all that `differs` has an `other`
    colour: what lies between ground and target is its blur.
    """
    shadow = shadowed(now, ground)
    mask = (own | (differs & ~shadow)).astype(np.uint8)
    _, labels = cv2.connectedComponents(np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, _CORE)))
    inside = np.bincount(labels[own], minlength=2)
    label = labels == 1 + int(inside[1:].argmax()) if inside[1:].any() else own
    thing = label.astype(np.uint8)
    core = cv2.erode(thing, _CORE) > 0
    rims, _ = cv2.findContours(thing, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    outline = cv2.fillConvexPoly(np.zeros_like(thing), cv2.convexHull(np.concatenate(rims)), 1)
    if not core.any() or label.sum() < 0.85 * outline.sum():
        return None
    _, nearest = cv2.distanceTransformWithLabels(
        (~core).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    colours = np.zeros((1 + np.count_nonzero(core), 3), np.float32)
    colours[nearest[core]] = now[core]
    plain = (label & other & ~shadow).sum() < 0.15 * label.sum()
    return label, colours[nearest], bool(plain)
