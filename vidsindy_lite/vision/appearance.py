"""What a target looks like, learned on the way: a correlation filter and two histograms.

The *filter* answers with a peak where the gradients and colours of a patch are those that it has
learned: the least squares of all patches and their cyclic shifts, which the Fourier transform
makes diagonal (Bolme et al. 2010; Henriques et al. 2015). The *histograms* say of each colour how
much likelier it is in the target than around it (Bertinetto et al. 2016). From one frame in which
the target is known it is followed both ways, each time near where its motion leads and near the
candidates there.
"""

from collections.abc import Iterator
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Floats32, Image, Ints
from .candidates import Candidates
from .reducing import ReducedFrames
from .steadying import carry

_SIDE = 40  # pixels of a patch
_WIDE = 2.6  # width of the patch, in widths of the target
_BINS = 4096  # of a histogram: 16 levels a colour


class Looks(NamedTuple):
    """Where a target's looks are found: boxes (n, 4) (centre, width, height) in the frames.

    NaN where not; `fit` (n,) is the filter's answer, 1 where it was learned first; `like` (m,) is
    for each candidate how likely its colours are the target's.
    """

    box: Floats
    fit: Floats
    like: Floats


class Appearance:
    """A correlation filter and two histograms, of patches that are resampled to one size.

    Centres and sizes are in pixels of frames that are reduced by `factor`; the frames are whole.
    """

    def __init__(self, frame: Image, centre: Floats, size: Floats, factor: int = 1) -> None:
        self._factor = factor
        self._hann = np.outer(np.hanning(_SIDE), np.hanning(_SIDE)).astype(np.float32)
        t = np.arange(_SIDE) - _SIDE // 2
        peak = np.exp(-(t[:, None] ** 2 + t**2) / (2 * (_SIDE / _WIDE / 12) ** 2))
        self._aim = np.fft.rfft2(np.fft.ifftshift(peak))
        self._own = self._around = np.zeros(_BINS)
        self._cross, self._power = np.zeros(1), np.zeros(1)
        self.learn(frame, centre, size, 1.0)

    def learn(self, frame: Image, centre: Floats, size: Floats, rate: float) -> None:
        """Take in what the target looks like in one more frame."""
        patch = self._patch(frame, centre, size)
        z = self._features(patch)
        radius = np.abs(np.mgrid[:_SIDE, :_SIDE] - (_SIDE - 1) / 2) * 2 * _WIDE / _SIDE
        inner, outer = (radius**2).sum(axis=0) < 0.7, (radius > 1.25).any(axis=0)
        bins = _bins(patch)
        new = (np.conj(z) * self._aim, (np.abs(z) ** 2).sum(axis=0), *(
            np.bincount(bins[m], minlength=_BINS) / m.sum() for m in (inner, outer)))  # fmt: skip
        known = self._cross, self._power, self._own, self._around
        self._cross, self._power, self._own, self._around = (
            (1 - rate) * a + rate * b for a, b in zip(known, new, strict=True)
        )
        self._likely = ((self._own + 1e-4) / (self._own + self._around + 2e-4)).astype(np.float32)

    def likely(self, image: Image) -> Floats32:
        """Of each pixel, how likely its colour is the target's."""
        return self._likely[_bins(image)]

    def find(self, frame: Image, centre: Floats, size: Floats) -> tuple[Floats, float, float]:
        """The best place near a centre, the filter's answer there, and that of the histograms."""
        patch = self._patch(frame, centre, size)
        z = self._features(patch)
        damped = self._power + 0.02 * self._power.mean() + 1e-3
        answer = np.fft.irfft2((self._cross * z).sum(axis=0) / damped, s=(_SIDE, _SIDE))
        answer = np.fft.fftshift(answer)
        k = int(0.9 * _SIDE / _WIDE)
        colour = cv2.blur(self.likely(patch), (k, k))
        both = 0.7 * answer + 0.3 * colour
        y, x = (2 + k for k in np.divmod(int(both[2:-2, 2:-2].argmax()), _SIDE - 4))
        off = np.array([x + _top(both[y, x - 1 : x + 2]), y + _top(both[y - 1 : y + 2, x])])
        step = (off - _SIDE // 2) / _SIDE * (_WIDE * size + 4)
        return centre + step, float(answer[y, x]), float(colour[y, x])

    def _patch(self, frame: Image, centre: Floats, size: Floats) -> Image:
        side = self._factor * (_WIDE * size + 4)
        low = self._factor * centre + (self._factor - 1 - side) / 2
        k = 2 * _SIDE  # then halved: a large target is not sampled at single pixels
        m = np.array([[side[0] / k, 0, low[0]], [0, side[1] / k, low[1]]])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        fine = cv2.warpAffine(frame, m, (k, k), flags=flags, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(cv2.resize(fine, (_SIDE, _SIDE), interpolation=cv2.INTER_AREA), np.uint8)

    def _features(self, patch: Image) -> NDArray[np.complex128]:
        """Fourier transforms of eight gradients and three colours."""
        grey = cv2.cvtColor(patch, cv2.COLOR_BGR2GRAY).astype(np.float32)
        gx, gy = cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1)
        norm = cv2.blur(cv2.magnitude(gx, gy), (9, 9)) + 8
        x, y = np.asarray(gx / norm), np.asarray(gy / norm)
        maps = [np.maximum(x * np.cos(a) + y * np.sin(a), 0) for a in np.arange(8) * np.pi / 4]
        lab = cv2.cvtColor(patch, cv2.COLOR_BGR2LAB).astype(np.float32)
        maps += [
            (one - one.mean()) / s for one, s in zip(cv2.split(lab), (60, 25, 25), strict=True)
        ]
        return np.fft.rfft2(np.array(maps) * self._hann)


def _bins(image: Image) -> Ints:
    q = (image >> 4).astype(np.int32)
    return np.asarray((q[..., 0] << 8) | (q[..., 1] << 4) | q[..., 2])


def _top(values: Floats) -> float:
    """By how much the top of a parabola through three values is off the middle one."""
    before, here, after = values.tolist()
    return float(np.clip(0.5 * (before - after) / (before - 2 * here + after - 1e-9), -0.5, 0.5))


def followed(
    frames: ReducedFrames, maps: Floats, found: Candidates, seed: tuple[int, Floats, Floats],
    guide: Floats,
) -> Looks:  # fmt: skip
    """Follow a target by its looks, both ways.

    Parameters
    ----------
    frames : ReducedFrames
    maps : ndarray, shape (n, 3, 3)
        Of reduced frames.
    found : Candidates
    seed : int, ndarray, ndarray
        A frame in which the target is known, its centre and size there, in reduced pixels.
    guide : ndarray, shape (n, 2)
        Where a path leads; NaN where none does.
    """
    n = len(maps)
    factor = frames.factor if frames.reel.few else 1
    box, fit = np.full((n, 4), np.nan), np.zeros(n)
    like = np.ones(len(found.frame))  # of what is not looked at, nothing is said
    bounds = np.searchsorted(found.frame, np.arange(n + 1))
    for way in (1, -1):
        looks: Appearance | None = None
        last: list[tuple[int, Floats]] = []
        size, usual = seed[2].astype(float), 1.0
        for i, frame in _in_order(frames, seed[0], way, n):
            here = np.s_[bounds[i] : bounds[i + 1]]
            if looks is None:
                looks = Appearance(frame, seed[1], size, factor)
                box[i], fit[i] = [*seed[1], *size], 1.0
                last = [(i, carry(maps[i], seed[1][None])[0])]
                like[here] = _likeness(looks, frame[::factor, ::factor], found.box[here])
                continue
            like[here] = _likeness(looks, frame[::factor, ::factor], found.box[here])
            gap = abs(i - last[-1][0])
            speed = np.zeros(2)
            if len(last) > 1:
                speed = (last[-1][1] - last[-2][1]) / abs(last[-1][0] - last[-2][0])
            ahead = carry(np.linalg.inv(maps[i]), (last[-1][1] + speed * min(gap, 8))[None])[0]
            near = _near(found.only(here), like[here], ahead, size, gap)
            tries: list[Floats] = []
            for one in [ahead, *near] if np.isnan(guide[i, 0]) else [ahead, guide[i], *near]:
                if not any(np.linalg.norm(one - other) < size.min() / 4 for other in tries):
                    tries.append(one)
            best = -np.inf, ahead, 0.0, 0.0, False
            for centre in tries:
                place, answer, colour = looks.find(frame, centre, size)
                apart = np.linalg.norm(place - ahead) / (size.max() + 8)
                moved = any(np.linalg.norm(place - one) < size.min() / 2 for one in near)
                score = 0.7 * answer + 0.3 * colour + 0.25 * moved - 0.1 * apart
                if score > best[0]:
                    best = score, place, answer, colour, moved
            _, place, answer, colour, moved = best
            inside = ((place >= 0) & (factor * place < frame.shape[1::-1])).all()
            usual = answer if len(last) == 1 and gap == 1 else usual
            # What differs from the ground and has its colours may be blurred or turned.
            sure = answer > max(0.12, 0.35 * usual) or (moved and colour > 0.5)
            if not (inside and sure):
                if gap > 60 and np.isnan(guide[i, 0]):
                    break
                continue
            usual = 0.95 * usual + 0.05 * answer
            for grown in (0.96, 1.04) if i % 2 else ():
                there, a, c = looks.find(frame, place, size * grown)
                if a + 0.3 * c > 1.03 * (answer + 0.3 * colour):
                    place, answer, size = there, a, size * grown
                    break
            box[i], fit[i] = [*place, *size], answer
            looks.learn(frame, place, size, 0.03)
            last = [*last, (i, carry(maps[i], place[None])[0])][-3:]
    return Looks(box, fit, like)


def _in_order(frames: ReducedFrames, first: int, way: int, n: int) -> Iterator[tuple[int, Image]]:
    """The frames, reduced if they are many, with their numbers from one on, in both directions."""
    whole = frames.reel.few
    if way > 0:
        forward = frames.reel if whole else frames
        yield from ((i, frame) for i, frame in zip(range(n), forward, strict=False) if i >= first)
        return
    for last in range(first + 1, 0, -50):
        numbers = range(max(last - 50, 0), last)
        some = frames.reel.pick(numbers) if whole else frames.some(numbers)
        yield from reversed(list(zip(numbers, some, strict=False)))


def _near(found: Candidates, like: Floats, ahead: Floats, size: Floats, gap: int) -> list[Floats]:
    """The two candidates of a frame that are likeliest what is expected there."""
    apart = np.linalg.norm(found.centre - ahead, axis=1)
    resize = np.abs(np.log((found.size + 1) / (np.sqrt(0.7 * size.prod()) + 1)))
    good = np.flatnonzero((apart < (1.5 + 0.5 * gap) * size.max() + 8) & (resize < 0.6))
    order = good[np.argsort(-(found.quality * (0.25 + 0.75 * like))[good])][:2]
    return list(found.centre[order])


def _likeness(looks: Appearance, frame: Image, boxes: Floats) -> Floats:
    """How likely the colours in the inner parts of boxes (k, 4) are the target's."""
    total = cv2.integral(looks.likely(frame))
    size = np.array(frame.shape[1::-1])
    low = np.clip(np.floor(boxes[:, :2] + 0.15 * boxes[:, 2:]), 0, size - 1).astype(int)
    high = np.clip(np.ceil(boxes[:, :2] + 0.85 * boxes[:, 2:]), low + 1, size).astype(int)
    (u, v), (x, y) = low.T, high.T
    inside = total[y, x] - total[v, x] - total[y, u] + total[v, u]
    return np.asarray(inside / (high - low).prod(axis=1))
