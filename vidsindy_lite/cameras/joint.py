"""Cameras, lags and points together: the smallest reprojection error, by Gauss and Newton.

The pixel that camera i shows at the instant k of the clock is a function of the point x_k, of the
camera, and of when it looked. The point belongs to one instant alone, so that it is eliminated
instant by instant: with the slopes A of the residuals r of one instant in x_k, what is left is
(1 - A A^+) r, a function of cameras and clocks only (variable projection). So a step costs as much
as one look at all pixels, whatever their number.

A camera may move in six ways: its normal by two tilts, the logarithm of its scale, its angle, and
its two offsets. Each has a spread: zero if it is known, infinite if nothing is, and otherwise the
standard deviation that a measured value may be off by.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats
from .alignment import Curve
from .camera import Camera
from .triangulate import Views, points_of_views

WAYS = 6
"""In which a camera may move: two tilts, log scale, angle, and two offsets over the width."""
OUTLIER = 12.0
"""Medians of the residuals; one beyond that moves neither a lag nor its error."""

_BESIDE = 2  # frames around an outlier into which interpolation carries a part of it
_ROUNDING = 1e-6  # pixels; residuals below that are none
_ROUNDS = 30
_SETTLED = 1e-4  # frames, and robust standard deviations of the residuals
_SOFT = 3.0  # standard deviations from which on a residual loses weight
_PROBE = 1e-6  # for slopes: of each way that a camera moves, and of the extent of the path
_LONGEST = 1.0  # frames: further than that, the slope in a lag does not hold


@dataclass(frozen=True, eq=False)
class Scene:
    """What was filmed and what is known of it; tracks, cameras and clocks were checked.

    `spreads`, (m, 6), are those of the ways that cameras may move, `width` the unit of offsets,
    `drifting`, (m,), says of which clocks the rate is unknown.
    """

    curves: tuple[Curve, ...]
    instants: Floats
    rates: Floats
    cameras: tuple[Camera, ...]
    spreads: Floats
    width: float
    drifting: Bools

    def start(self, lags: Floats) -> Estimate:
        """Cameras as they are, at some lags."""
        none = np.zeros(len(self.cameras))
        here = Estimate(np.zeros((len(none), WAYS)), lags, none, np.zeros((0, 3)))
        views = Views.of([self.shown(here, i) for i in range(len(none))])
        return replace(here, points=points_of_views(views, self.cameras))

    def frames(self, here: Estimate, i: int) -> Floats:
        """What camera i shows at the instants: which of its frames."""
        return (self.instants - here.lags[i]) * self.rates[i] * (1 + here.drifts[i])

    def shown(self, here: Estimate, i: int) -> Floats:
        """What camera i shows at the instants: pixels."""
        return self.curves[i].at(self.frames(here, i))

    def images(self, here: Estimate) -> Floats:
        """Pixels at which the points should be seen, (n, m, 2)."""
        pairs = zip(self.cameras, here.change, strict=True)
        cameras = (_moved(camera, change, self.width) for camera, change in pairs)
        return np.stack([camera.image(here.points) for camera in cameras], axis=1)

    def missed(self, here: Estimate) -> Floats:
        """Residuals, (n, m, 2) in pixels; NaN where nothing is seen, or no point is known."""
        shown = [self.shown(here, i) for i in range(len(self.cameras))]
        missed = np.stack(shown, axis=1) - self.images(here)
        missed[np.isfinite(missed).all(axis=-1).sum(axis=1) < 2] = np.nan  # one view has no say
        return missed


@dataclass(frozen=True, eq=False)
class Estimate:
    """How cameras moved, (m, 6), lags, (m,), relative drifts of rates, (m,), and points, (n, 3)."""

    change: Floats
    lags: Floats
    drifts: Floats
    points: Floats


@dataclass(frozen=True, eq=False)
class Fit:
    """An estimate and what it leaves: residuals and slopes without what the points explain.

    `missed`, (n, m, 2), is NaN where nothing is seen; `slopes`, (n, 2 m, p), and `used`, (n,), the
    instants that count, are those of the last step. `freedom`, (n, m), is the share of each camera
    in the numbers that the points leave over. `last` is the last step of a lag, in frames.
    """

    estimate: Estimate
    missed: Floats
    slopes: Floats
    used: Bools
    freedom: Floats
    last: float

    @property
    def noise(self) -> float:
        """Variance of a pixel coordinate, by the instants that count."""
        left = self.freedom[self.used].sum() - self.slopes.shape[-1]
        total = np.nansum(self.missed[self.used] ** 2)
        return float(max(total / max(left, 1.0), _ROUNDING**2))

    @property
    def rms(self) -> float:
        """Square root of that."""
        return float(np.sqrt(self.noise))


def fit(scene: Scene, start: Estimate) -> Fit | None:
    """The estimate of the smallest residuals, in robust weights first, then without outliers.

    None if the views have too little in common.
    """
    soft = roughly_fit(scene, start, _ROUNDS)
    return None if soft is None else _search(scene, soft.estimate, _hard_weights, _ROUNDS)


def roughly_fit(scene: Scene, start: Estimate, rounds: int) -> Fit | None:
    """The same in robust weights and after a few steps, to tell good starts from bad ones."""
    return _search(scene, start, _soft_weights, rounds)


def _search(
    scene: Scene, here: Estimate, weigh: Callable[[Floats], Floats], rounds: int
) -> Fit | None:
    """Gauss-Newton with weights, (n,), that depend on the sizes of the residuals."""
    steps = _Steps(scene)
    look = steps.look(here)
    if look is None:
        return None
    for _ in range(rounds):
        weights = weigh(look.sizes)
        step = steps.solve(look, here, weights)
        moved = np.abs(step[steps.cameras : steps.lags]).max(initial=0)
        change = look.slopes[weights > 0] @ step
        small = _SETTLED * max(np.sqrt(np.mean(look.missed[weights > 0] ** 2)), _ROUNDING)
        if moved < _SETTLED and np.sqrt(np.mean(change**2)) < small:
            break
        there = steps.taken(look, here, weights, step)
        seen_there = None if there is None else steps.look(there)
        if there is None or seen_there is None:
            break
        here, look = there, seen_there
    seen = np.isfinite(scene.missed(here))
    missed, freedom = np.full(seen.shape, np.nan), np.zeros(seen.shape[:2])
    slopes, used = np.zeros((len(seen), *look.slopes.shape[1:])), np.zeros(len(seen), bool)
    missed[look.rows] = look.missed.reshape(-1, *seen.shape[1:])
    slopes[look.rows], freedom[look.rows] = look.slopes, look.freedom
    used[look.rows] = weigh(look.sizes) > 0
    return Fit(here, np.where(seen, missed, np.nan), slopes, used, freedom, float(moved))


@dataclass(frozen=True, eq=False)
class _Look:
    """Residuals and slopes of the instants `rows`, with the points eliminated.

    `lift` and `raw` give the step of the points that belongs to a step of all else.
    """

    rows: Bools
    missed: Floats
    slopes: Floats
    sizes: Floats
    freedom: Floats
    lift: Floats
    raw: tuple[Floats, Floats]


class _Steps:
    """Which parameters there are, in order: ways of cameras, lags but the first, drifts."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.moving = np.argwhere(scene.spreads > 0)
        self.drifting = np.flatnonzero(scene.drifting)
        self.cameras = len(self.moving)
        self.lags = self.cameras + len(scene.cameras) - 1
        self.span = max(float(np.ptp(scene.instants)), 1.0)  # drifts count over the whole time
        spreads = scene.spreads[scene.spreads > 0]
        self.prior = np.concatenate(
            (1 / spreads**2, np.zeros(self.lags - self.cameras + len(self.drifting)))
        )

    def look(self, here: Estimate) -> _Look | None:
        """At all pixels."""
        scene, missed = self.scene, self.scene.missed(here)
        rows: Bools = np.atleast_1d(np.isfinite(missed[..., 0]).any(axis=1))
        if rows.sum() * 3 <= self.lags + len(self.drifting):
            return None
        seen: Bools = np.atleast_1d(np.isfinite(missed[rows]).all(axis=-1))
        raw = np.where(seen[..., None], missed[rows], 0).reshape(len(seen), -1)
        mask = np.repeat(seen, 2, axis=1)[..., None]
        images = scene.images(here)
        across = np.nan_to_num(np.where(mask, self._points(here, rows, images), 0))
        others = np.nan_to_num(np.where(mask, self._others(here, rows, images), 0))
        q, r = np.linalg.qr(across)
        pivots = np.abs(np.diagonal(r, axis1=1, axis2=2))
        r[~(pivots.min(axis=1) > 1e-9 * pivots.max(axis=1))] = np.inf  # such points stay
        left = raw - np.einsum("nij,nj->ni", q, np.einsum("nij,ni->nj", q, raw))
        slopes = others - q @ (q.swapaxes(1, 2) @ others)
        freedom = seen * 2.0 - np.sum(q**2, axis=2).reshape(*seen.shape, 2).sum(axis=2)
        sizes = np.abs(left).max(axis=1)
        lift = np.linalg.solve(np.where(np.isinf(r), np.eye(3) * 1e300, r), q.swapaxes(1, 2))
        return _Look(rows, left, slopes, sizes, freedom, lift, (raw, others))

    def solve(self, look: _Look, here: Estimate, weights: Floats) -> Floats:
        """The step of all parameters."""
        used = weights > 0
        noise = np.sum(weights[used, None] * look.missed[used] ** 2) / max(
            look.freedom[used].sum(), 1
        )
        noise = max(noise, _ROUNDING**2)
        slopes = look.slopes[used]
        information = np.einsum("n,nik,nil->kl", weights[used], slopes, slopes) / noise
        gradient = np.einsum("n,nik,ni->k", weights[used], slopes, look.missed[used]) / noise
        information += np.diag(self.prior)
        known = here.change[*self.moving.T] if self.cameras else np.zeros(0)
        gradient += self.prior * np.concatenate((known, np.zeros(len(self.prior) - self.cameras)))
        size = np.sqrt(np.diag(information))
        if not (np.isfinite(information).all() and np.isfinite(gradient).all()):
            return np.zeros_like(size)
        size[size == 0] = 1.0
        scaled = information / np.outer(size, size)
        step = -np.linalg.lstsq(scaled, gradient / size, rcond=1e-12)[0] / size
        longest = np.abs(step[self.cameras : self.lags]).max(initial=0)
        return step / max(longest / _LONGEST, 1)

    def taken(self, look: _Look, here: Estimate, weights: Floats, step: Floats) -> Estimate | None:
        """The estimate after the step, or after a part of it that does not lead uphill, if any."""
        raw, others = look.raw
        before = np.sum(weights[:, None] * look.missed**2)
        for part in 0.5 ** np.arange(8):
            points = here.points.copy()
            points[look.rows] -= np.einsum("nij,nj->ni", look.lift, raw + others @ (part * step))
            there = self._stepped(replace(here, points=points), part * step)
            missed = self.scene.missed(there)[look.rows].reshape(raw.shape)
            lost = ~np.isfinite(missed) & (raw != 0)
            if lost[weights > 0].mean() < 0.05:
                after = np.nansum(weights[:, None] * missed**2)
                if after <= 1.05 * before + len(raw) * _ROUNDING**2:
                    return there
        return None

    def _stepped(self, here: Estimate, step: Floats) -> Estimate:
        change, lags, drifts = here.change.copy(), here.lags.copy(), here.drifts.copy()
        change[*self.moving.T] += step[: self.cameras]
        lags[1:] += step[self.cameras : self.lags]
        drifts[self.drifting] += step[self.lags :] / self.span
        return replace(here, change=change, lags=lags, drifts=drifts)

    def _points(self, here: Estimate, rows: Bools, images: Floats) -> Floats:
        """Slopes of the residuals in the points, (n, 2 m, 3)."""
        x = here.points
        probe = _PROBE * max(float(np.nanmax(np.ptp(x[rows], axis=0))), 1e-9)
        there = [self.scene.images(replace(here, points=x + e)) for e in probe * np.eye(3)]
        slopes = [(images - image)[rows] / probe for image in there]
        return np.stack(slopes, axis=-1).reshape(-1, 2 * images.shape[1], 3)

    def _others(self, here: Estimate, rows: Bools, images: Floats) -> Floats:
        """Slopes of the residuals in all parameters, (n, 2 m, p)."""
        scene, x = self.scene, here.points[rows]
        slopes = np.zeros((len(x), len(scene.cameras), 2, len(self.prior)))
        for column, (i, way) in enumerate(self.moving):
            change = here.change[i] + _PROBE * np.eye(WAYS)[way]
            there = _moved(scene.cameras[i], change, scene.width).image(x)
            slopes[:, i, :, column] = (images[rows, i] - there) / _PROBE
        for k in range(1, len(scene.cameras)):
            moving = scene.curves[k].slope(scene.frames(here, k)[rows])
            slopes[:, k, :, self.cameras + k - 1] = -scene.rates[k] * (1 + here.drifts[k]) * moving
            if scene.drifting[k]:
                place = self.lags + int(np.searchsorted(self.drifting, k))
                late = (scene.instants[rows] - here.lags[k]) * scene.rates[k] / self.span
                slopes[:, k, :, place] = late[:, None] * moving
        return slopes.reshape(len(x), -1, len(self.prior))


def _moved(camera: Camera, change: Floats, width: float) -> Camera:
    """A calibrated camera that moved in its six ways."""
    tilt, turn, offset = np.split(change, [2, 4])
    if tilt.any():
        camera = replace(camera, normal=camera.normal + tilt @ camera.rows)
    if offset.any():
        camera = camera.placed(camera.offset + width * offset)
    if turn.any():
        scale, angle = camera.calibration
        camera = camera.calibrated(scale * np.exp(turn[0] + 1j * (angle + turn[1])))
    return camera


def _soft_weights(sizes: Floats) -> Floats:
    """Cauchy's, of the sizes of residuals."""
    scale = max(1.4826 * float(np.median(sizes)), _ROUNDING)
    return 1 / (1 + (sizes / (_SOFT * scale)) ** 2)


def _hard_weights(sizes: Floats) -> Floats:
    """One, but zero for outliers and the frames beside them."""
    far = sizes > max(OUTLIER * float(np.median(sizes)), _ROUNDING)
    near = np.convolve(far, np.ones(2 * _BESIDE + 1), mode="same")[: len(far)] if far.any() else far
    return np.where(near > 0, 0.0, 1.0)
