"""Where a target is in frames that show only a part of it.

Before a ground of its own colour, or where it touches other things, views of the target are of a
part of it, and are left out. Between two views of the whole target its motion tells the place,
though, and there it is, if a part of it is seen there, or what it looks like explains what the
frame shows better than the ground does. One that was pointed at is carried on before the first view
and behind the last from frame to frame by its looks, as long as it is found.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from ..arrays import Bools, Floats, Floats32, Image, Ints
from .reel import Reel
from .refining import Lens, View
from .steadying import carry

_FAR = 15  # frames from a view to which it is looked for at most
_BESIDE = 4  # views on each side of a gap that say how it moves in between
_MARGIN = 3  # pixels around the target's outline that are a part of its looks
_ASTRAY = 0.5, 4.0  # sides of the target, and pixels more, that it may be from where it is expected
_PART = 0.75  # sides of the target from its middle to that of a part of it
_UNSURE = 0.25  # of its side: a place that is known no better than that is not known; and
_ROUGHLY = 2.0  # pixels, if nobody said which is the target
_LIKE = 0.4  # share of the change in a frame that the target's looks explain


class Look(NamedTuple):
    """A part of a frame and of its ground, with the left and upper edge of both; their light."""

    now: Image
    ground: Image
    corner: Floats
    gain: Floats32

    def levels(self) -> Floats32:
        """Of the frame, in the light of the ground."""
        return np.asarray(self.now.astype(np.float32) / self.gain, np.float32)


class Template(NamedTuple):
    """What the target looks like: an image, where it is target, where in it the centroid is."""

    image: Floats32
    mask: Floats32
    centre: Floats

    def found(self, look: Look, expected: Floats) -> tuple[Floats, "Template"] | None:
        """Its centroid near an expected place, and how it looks there, None if it is not there."""
        reach = _ASTRAY[0] * min(self.mask.shape) + _ASTRAY[1]
        height, width = self.mask.shape
        low = np.floor(expected - self.centre - reach - look.corner).astype(int)
        high = np.ceil(expected - self.centre + reach - look.corner).astype(int) + [width, height]
        low, high = np.maximum(low, 0), np.minimum(high, look.now.shape[1::-1])
        if (high - low < [width, height]).any():
            return None
        window = np.s_[low[1] : high[1], low[0] : high[0]]
        now = look.levels()[window]
        change = ((now - look.ground[window]) ** 2).sum(axis=2)
        mask = np.repeat(self.mask[..., None], 3, axis=2)
        own = np.asarray(cv2.matchTemplate(now, self.image, cv2.TM_SQDIFF, mask=mask))
        ground = np.asarray(cv2.matchTemplate(change, self.mask, cv2.TM_CCORR))
        gain = ground - own
        v, u = np.unravel_index(int(gain.argmax()), gain.shape)
        if own[v, u] > (1 - _LIKE) * ground[v, u]:
            return None
        centre = self.centre + [_peak(gain[v], int(u)), _peak(gain[:, u], int(v))]
        here = Template(now[v : v + height, u : u + width], self.mask, centre)
        return look.corner + low + [u, v] + centre, here


def _peak(values: Floats32, i: int) -> float:
    """By how much the maximum of a curve is off its highest value, in steps: that of a parabola."""
    if not 0 < i < len(values) - 1:
        return 0.0
    before, here, after = values[i - 1 : i + 2].tolist()
    return 0.5 * (after - before) / max(2 * here - before - after, 1e-9)


def recalled(
    reel: Reel, lens: Lens, lights: Sequence[Floats32], pixels: Floats, maps: Floats,
    views: Sequence[View | None], *, told: bool,
) -> Floats:  # fmt: skip
    """Places (n, 2) of the target in the gaps of a track, NaN elsewhere.

    Parameters
    ----------
    reel : Reel
        Of n frames.
    lens : Lens
    lights : sequence of ndarray
        How bright each frame is.
    pixels : ndarray, shape (n, 2)
        The track, of the first frame.
    maps : ndarray, shape (n, 3, 3)
        Where each frame lies in the first one.
    views : sequence of View or None
        Of the whole target, where there is a track.
    told : bool
        Was it pointed at? Else only gaps count in which its motion is known to two pixels.
    """
    at = np.flatnonzero(np.isfinite(pixels[:, 0]))
    places = np.full(pixels.shape, np.nan)
    if len(at) == (len(pixels) if told else np.ptp(at) + 1):
        return places
    looks = _looks(reel, lens, lights, pixels, maps, views)
    for order in (range(int(at[-1]), len(pixels)), range(int(at[0]), -1, -1)) if told else ():
        _carry_on(places, order, looks, pixels, maps, views)
    for before, after in zip(at[:-1].tolist(), at[1:].tolist(), strict=True):
        _fill(places, before, after, looks, pixels, maps, views, np.inf if told else _ROUGHLY)
    return places


def _looks(
    reel: Reel, lens: Lens, lights: Sequence[Floats32], pixels: Floats, maps: Floats,
    views: Sequence[View | None],
) -> dict[int, Look]:  # fmt: skip
    """Parts of the frames in gaps that are not far from a view, and of the frames beside them."""
    good = np.isfinite(pixels[:, 0])
    at = np.flatnonzero(good)
    frames = np.arange(len(pixels))
    far = np.abs(frames[:, None] - at).min(axis=1)
    wanted = (far <= _FAR) & (~good | _beside(~good))
    along = np.column_stack([np.interp(frames, at, x) for x in pixels[at].T])
    centres = carry(np.linalg.inv(maps), along)
    steps = np.linalg.norm(np.diff(pixels[at], axis=0), axis=1) / np.diff(at)
    speed = float(np.quantile(steps, 0.9))
    side = max(np.ptp(view.outline, axis=0).max() for view in views if view is not None)
    found = {}
    numbers = np.flatnonzero(wanted).tolist()
    for i, frame in zip(numbers, reel.pick(numbers), strict=False):
        outside = far[i] if i < at[0] or i > at[-1] else 0
        reach = 2 * side + _ASTRAY[1] + outside * speed
        low = np.clip(np.floor(centres[i] - reach), 0, lens.plate.size - 1).astype(int)
        high = np.clip(np.ceil(centres[i] + reach) + 1, low + 1, lens.plate.size).astype(int)
        ground, _ = lens.plate.seen_from(maps[i], low, tuple(high - low))
        now = frame[low[1] : high[1], low[0] : high[0]].copy()
        found[i] = Look(now, ground.copy(), low, lights[i])
    return found


def _beside(some: Bools) -> Bools:
    """Which are next to one of some."""
    found = np.zeros_like(some)
    found[1:] |= some[:-1]
    found[:-1] |= some[1:]
    return found


def _carry_on(
    places: Floats, order: range, looks: dict[int, Look], pixels: Floats, maps: Floats,
    views: Sequence[View | None],
) -> None:  # fmt: skip
    """Find places beyond the first or the last view, frame by frame, as long as that goes."""
    first, step = order[0], order.step
    known = _template(looks, views, first)
    last = pixels[first]
    speed = np.nan_to_num(last - pixels[(first - step) % len(pixels)])
    for i in order[1:]:
        if known is None or i not in looks:
            return
        expected = carry(np.linalg.inv(maps[i]), (last + speed)[None])[0]
        if (found := known.found(looks[i], expected)) is None:
            return
        place, known = found
        places[i] = carry(maps[i], place[None])[0]
        speed, last = (speed + places[i] - last) / 2, places[i]


def _fill(
    places: Floats, before: int, after: int, looks: dict[int, Look], pixels: Floats, maps: Floats,
    views: Sequence[View | None], bound: float,
) -> None:  # fmt: skip
    """Find places between two views, where the motion on both sides leads to so many pixels."""
    known = [one for i in (before, after) if (one := _template(looks, views, i))]
    at = np.flatnonzero(np.isfinite(pixels[:, 0]))
    beside = np.concatenate([at[at <= before][-_BESIDE:], at[at >= after][:_BESIDE]])
    frames = np.arange(before + 1, after)
    way, rough = (_curve(beside - before, pixels[beside], frames - before, k) for k in (3, 2))
    apart = np.linalg.norm(way - rough, axis=1)
    if apart.max(initial=0) > bound:
        return
    for i, place, unsure in zip(frames.tolist(), way, apart, strict=True):
        if i not in looks:
            continue
        expected, view = carry(np.linalg.inv(maps[i]), place[None])[0], views[i]
        side = min(np.sqrt(views[k].area) for k in (before, after))  # type: ignore[union-attr]
        part = view is not None and np.linalg.norm(view.centroid - expected) < _PART * side
        sure = unsure < _UNSURE * side
        if sure and (part or any(one.found(looks[i], expected) for one in known)):
            places[i] = place


def _curve(frames: Ints, places: Floats, at: Ints, degree: int) -> Floats:
    """A polynomial of the time through places (n, 2), at other frames (m,)."""
    powers = [np.vander(t, min(degree + 1, len(frames))) for t in (frames / 10, at / 10)]
    return np.asarray(powers[1] @ np.linalg.lstsq(powers[0], places)[0])


def _template(looks: dict[int, Look], views: Sequence[View | None], i: int) -> Template | None:
    """What a view shows, None if it reaches beyond the image."""
    look, view = looks.get(i), views[i]
    if look is None or view is None:
        return None
    low = np.floor(view.outline.min(axis=0)).astype(int) - _MARGIN - look.corner
    high = np.ceil(view.outline.max(axis=0)).astype(int) + 1 + _MARGIN - look.corner
    if (low < 0).any() or (high > look.now.shape[1::-1]).any():
        return None
    mask = np.zeros(tuple((high - low)[::-1]), np.uint8)
    outline = np.rint(view.outline - look.corner - low).astype(np.int32)
    cv2.fillConvexPoly(mask, outline, 1)
    mask = np.asarray(cv2.dilate(mask, np.ones((2 * _MARGIN + 1,) * 2, np.uint8)), np.uint8)
    image = look.levels()[low[1] : high[1], low[0] : high[0]]
    return Template(image, mask.astype(np.float32), view.centroid - look.corner - low)
