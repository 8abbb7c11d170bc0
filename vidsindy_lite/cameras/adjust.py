"""Bundle adjustment: cameras, clocks and path together, from what was seen and what was measured.

Wanted are the changes p of cameras and clocks (`PARTS`) and the points x of the path that make

::

    sum_frames w / sigma^2 |track - image(x, p)|^2  +  sum (p / error)^2

smallest: pixels and measurements, each in units of its error. Each step of Gauss and Newton takes
the points out first: of the slopes in p only what no move of the frame's own point can mimic counts
(the Schur complement, here by QR). sigma is the noise that the residuals show, robustly; a frame
that is missed by more than `_OUTLIER` sigma is weighed down so that it pulls no more the further it
is off (w = (limit / miss)^2, the weight of Geman and McClure's kind).

A change of a camera is one vector: two tilts of the normal and the in-plane angle (radians), the
logarithm of the scale, the position along the axes of the view plane and along its normal (scene
units), the principal point (pixels), k1, k2, p1, p2, the readout of the shutter (frames); and what
no rig file holds: by how many frames the video is late, by how many more at its end than at its
start, and how near an orthographic camera is to what it sees (the inverse of its distance).

Errors of tracks depend on their neighbours. With the slopes J of the residuals r, their noise sigma
and the information P of measurements, what was fitted has the covariance

    W = (sum_n J_n' J_n / sigma^2 + P)^-1,

if errors do not depend on each other. If they do, it is the "sandwich"

    S = W (M / sigma^4 + P) W,   M = sum_nm w(n - m) (J_n' r_n) (J_m' r_m)',

with weights w that fall linearly to zero over as many frames as the residuals depend on each other.
From few frames S is often too small by chance, and W never is but for such errors: so in every
direction the larger of both counts.

Newey and West 1987, Econometrica 55; Andrews 1991, Econometrica 59 (the number of frames);
Triggs et al. 2000, "Bundle adjustment: a modern synthesis".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import minimum_filter1d
from scipy.special import gammaincinv

from ..arrays import Bools, Floats
from .alignment import Footage
from .models import USUAL, Camera, OrthographicCamera, PerspectiveCamera, frozen, steadied
from .sight import Views, points_of_views

_UNTOLD = 1e-15  # of the largest information of any direction: rounding
PARTS = {
    "normal": slice(0, 2),
    "angle": slice(2, 3),
    "scale": slice(3, 4),
    "position": slice(4, 7),
    "principal point": slice(7, 9),
    "distortion": slice(9, 13),
    "readout": slice(13, 14),
    "lag": slice(14, 15),
    "drift": slice(15, 16),
    "nearness": slice(16, 17),
}
"""Which components of the vector belong to what."""

SIZE = 17
_LARGEST = 50.0  # logarithm of a scale: a step that leads there is not taken
_TANGENTIAL = 0.1  # p1 and p2 of a lens, in units of k1
_OUTLIER = 6.0  # sigma
_FINEST = 1e-6  # pixels; noise below that is rounding
_PRIOR_NOISE = 0.02  # pixels; no track is better than that beside a measurement
_STEPS = 60
_SETTLED = 1e-11  # pixels, or ...
_ENOUGH = 1e-7  # ... of sigma, by which a last step moves the images, or ...
_IN_TIME = 1e-4  # ... if clocks move, whose slopes are rough, and in frames
_BACK = 1e-6  # of a unit: nearer to where it was two steps before, a search goes to and fro
_LONGEST = 1.0  # frames: further than that, the slope in a lag does not hold
_RIPPLES = 1.05  # noise is less between frames than at them, so that a better lag may cost more
_LOST = 0.05  # share of what is seen that a step in time may lead out of the video
_PROBE = 1e-6  # of a unit: slopes are taken over twice that
_BESIDE = 2  # frames around an outlier into which interpolation carries a part of it
_FLAT = 1e-9  # of the largest pivot; smaller ones leave a point where it is
# Tried in turn, until a step leads downhill: fine where focal length and distance hardly differ.
_DAMPING = (0.0, 1e-5, 1e-4, 3e-4, 1e-3, 1e-2, 0.1, 1.0, 1e2)
_LAG, _DRIFT = PARTS["lag"].start, PARTS["drift"].start


def fitted_factor(missed: Floats, slopes: Floats, prior: Floats, noise: float) -> Floats:
    """A factor F of the covariance F F' of parameters, (k, k), that were fitted.

    Parameters
    ----------
    missed, slopes : ndarray, shape (n, m) and (n, m, k)
        Residuals, and their slopes.
    prior : ndarray, shape (k,)
        Information of measurements on the parameters.
    noise : float
        Standard deviation of the residuals.
    """
    square = np.einsum("nmk,nml->kl", slopes, slopes) + noise**2 * np.diag(prior)
    size = np.sqrt(np.diag(square))  # of each parameter: units of pixels, metres and radians
    size[size == 0] = 1.0
    values, ways = np.linalg.eigh(square / np.outer(size, size))
    told = values > _UNTOLD * values.max(initial=0.0)
    # In the directions of `half`, of length one over sigma, W is the unit matrix.
    half = ways[:, told] / np.sqrt(values[told]) / size[:, None]
    scores = np.einsum("nmk,nm->nk", slopes, missed) @ half
    measured = noise**2 * half.T @ np.diag(prior) @ half
    sandwich = long_run_covariance(scores) * len(scores) + noise**2 * measured
    grown, turned = np.linalg.eigh(sandwich)
    return half @ turned * np.sqrt(np.maximum(grown, noise**2))


def long_run_covariance(series: Floats) -> Floats:
    """Covariance of the mean of a stationary series of mean zero, times its length.

    Parameters
    ----------
    series : ndarray, shape (n, k)

    Returns
    -------
    ndarray, shape (k, k)
        ``sum_h w_h E[s_n s_(n+h)']`` with Bartlett's weights; their width is that which is best
        for autoregressive series of first order.
    """
    n, width = len(series), bandwidth(series)
    total = series.T @ series
    for lag in range(1, min(int(np.ceil(width)), n - 1) + 1):
        product = series[lag:].T @ series[:-lag]
        total += (1 - lag / (width + 1)) * (product + product.T)
    return total / n


def bandwidth(series: Floats) -> float:
    """Over how many neighbours Bartlett's weights fall to zero: best for autoregressive series."""
    power = np.maximum((series**2).sum(axis=0), 1e-300)
    rho = np.clip((series[1:] * series[:-1]).sum(axis=0) / power, -0.97, 0.97)
    curvature = np.mean(4 * rho**2 / ((1 - rho) ** 2 * (1 + rho) ** 2)) if len(rho) else 0.0
    return float(1.1447 * (curvature * len(series)) ** (1 / 3))


def known_to(given: Camera) -> Floats:
    """Standard errors of a camera of a rig: zero what is exact, infinite what is to be learned."""
    errors = np.zeros(SIZE)
    errors[PARTS["normal"]] = np.deg2rad(given.normal_error)
    errors[PARTS["angle"]] = np.deg2rad(given.normal_error) if given.is_calibrated else np.inf
    errors[PARTS["scale"]] = given.scale_error if given.is_calibrated else np.inf
    errors[PARTS["position"]] = given.position_error if given.is_placed else np.inf
    if isinstance(given, OrthographicCamera):
        errors[PARTS["position"]][2] = 0.0  # it sees the same from anywhere on its axis
    errors[PARTS["principal point"]] = given.principal_point_error
    if isinstance(given, PerspectiveCamera):
        errors[PARTS["distortion"]] = given.distortion_error * np.array(
            [1, 1, _TANGENTIAL, _TANGENTIAL]
        )
    errors[PARTS["readout"]] = given.readout_error
    return errors


@dataclass(frozen=True, eq=False, kw_only=True)
class NearCamera(OrthographicCamera):
    """What an orthographic camera would be that is not infinitely far from the point `about`."""

    about: Floats
    nearness: float = 0.0

    @property
    def _last_row(self) -> Floats:
        away = self.nearness * self.normal
        return np.append(-away, 1 + away @ self.about)


def units(width: float, image: float) -> Floats:
    """Sizes of changes that matter about equally, for a scene and an image of these widths."""
    sizes = np.ones(SIZE)
    sizes[PARTS["position"]] = width
    sizes[PARTS["principal point"]] = image
    sizes[PARTS["nearness"]] = 1 / width
    return sizes


def changed(camera: Camera, change: Floats) -> Camera:
    """A calibrated camera after a change; lag and drift are none of its own."""
    part = {name: change[place] for name, place in PARTS.items()}
    values: dict[str, Any] = {}
    if part["normal"].any():
        normal = camera.normal + part["normal"] @ camera.rows
        values["normal"] = frozen(normal / np.linalg.norm(normal))
    if part["position"].any() and camera.position is not None:
        axes = np.vstack((camera.rows, camera.normal))
        values["position"] = frozen(camera.position + part["position"] @ axes)
    if part["principal point"].any():
        values["principal_point"] = frozen(camera.centre + part["principal point"])
    if part["distortion"].any() and isinstance(camera, PerspectiveCamera):
        before = np.zeros(USUAL) if camera.distortion is None else camera.distortion
        step = np.pad(part["distortion"], (0, len(before) - len(part["distortion"])))
        values["distortion"] = frozen(before + step)
    if part["readout"].any():
        values["readout"] = float(np.clip(camera.readout + part["readout"][0], -1, 1))
    if part["nearness"].any() and isinstance(camera, NearCamera):
        values["nearness"] = camera.nearness + part["nearness"][0]
    moved = camera.moved(**values) if values else camera
    if part["angle"].any() or part["scale"].any():
        scale, angle = camera.calibration
        grown = np.clip(part["scale"][0], -_LARGEST, _LARGEST)
        moved = moved.calibrated(scale * np.exp(grown + 1j * (angle + part["angle"][0])))
    return moved


@dataclass(frozen=True)
class Adjustment:
    """Cameras and clocks of the smallest errors, and what is known of them near by.

    Parameters
    ----------
    cameras : tuple of Camera
    footage : Footage
        With its lags and rates.
    errors : ndarray, shape (m, SIZE)
        As they were given.
    change : ndarray, shape (m, SIZE)
        Of each camera and its clock, from the start.
    misses : ndarray, shape (n, 2 m)
        Residuals, pixels; NaN where nothing is seen or no point is found.
    weights : ndarray, shape (n,)
    noise : float
        sigma, pixels.
    slopes : ndarray, shape (n, 2 m, p)
        Of the residuals in the free changes, the points following; zero where nothing is seen.
    path_slopes : ndarray, shape (n, 3, p)
        Of the points.
    settled : bool
        Whether the search came to its end, after so many ...
    steps : int
    """

    cameras: tuple[Camera, ...]
    footage: Footage
    errors: Floats
    change: Floats
    misses: Floats
    weights: Floats
    noise: float
    slopes: Floats
    path_slopes: Floats
    settled: bool
    steps: int

    @property
    def prior(self) -> Floats:
        """Information of the measurements on the free changes, (p,)."""
        return self.errors[self.errors > 0] ** -2.0

    @property
    def weighed(self) -> tuple[Floats, Floats]:
        """Residuals and slopes times the roots of the weights, zero where nothing is seen."""
        root = np.sqrt(self.weights)[:, None]
        return root * np.nan_to_num(self.misses), root[..., None] * self.slopes


def adjust(
    footage: Footage,
    start: Sequence[Camera],
    errors: Floats,
    *,
    begin: Floats | None = None,
    used: Bools | None = None,
    most: int | None = None,
) -> Adjustment:
    """The cameras and clocks of the smallest errors near a start, see the module.

    Parameters
    ----------
    footage : Footage
    start : sequence of Camera
        Calibrated and placed.
    errors : ndarray, shape (m, SIZE)
        Standard errors of the start: zero what is exactly known, infinite what is not at all.
    begin : ndarray, shape (m, SIZE), optional
        Changes from which the search begins; by default none.
    used : ndarray of bool, shape (n,), optional
        Which instants count; by default all.
    most : int, optional
        Steps.
    """
    change = np.zeros(errors.shape) if begin is None else begin
    problem, state = _Problem.of(footage, start, errors, change, used)
    noise = _noise(state.misses)
    settled, steps, earlier = False, 0, np.full(problem.unit.shape, np.inf)
    while not settled and steps < (_STEPS if most is None else most):
        weights = problem.weights(state, noise)
        moved, step = _downhill(problem, state, weights, noise)
        steps += 1
        if moved is None:  # rounding is all that is left, or points ran out of numbers
            settled = step == 0
            break
        # A frame at the end of a video may come and go with a lag, for ever.
        to_and_fro = bool((np.abs(moved.change - earlier) <= _BACK * problem.unit).all())
        earlier, state, before = state.change, moved, noise
        noise = _noise(state.misses)
        enough = _IN_TIME if problem.timed else _ENOUGH
        still = step <= max(_SETTLED, enough * noise) or (problem.timed and to_and_fro)
        settled = still and noise >= before * (1 - 1e-3)
    return problem.result(state, noise, settled, steps)


def linearised(footage: Footage, cameras: Sequence[Camera], errors: Floats) -> Adjustment:
    """What is known near cameras and clocks that were adjusted before."""
    return adjust(footage, cameras, errors, most=0)


@dataclass(frozen=True)
class _State:
    """Changes, (p,), points, (n, 3), cameras, clocks, and by how much they miss the tracks."""

    change: Floats
    points: Floats
    cameras: tuple[Camera, ...]
    footage: Footage
    misses: Floats


@dataclass(frozen=True)
class _Problem:
    """What was filmed, the start, what is free of it, and the frames in which a point is found."""

    footage: Footage
    start: tuple[Camera, ...]
    errors: Floats
    found: Bools  # which frames
    unit: Floats  # of each free change, and ...
    reach: float  # ... of points

    @classmethod
    def of(
        cls,
        footage: Footage,
        start: Sequence[Camera],
        errors: Floats,
        change: Floats,
        used: Bools | None,
    ) -> tuple[_Problem, _State]:
        """Units from the size of the path, and the first state."""
        every = np.ones(len(footage.instants), bool)
        blank = cls(footage, tuple(start), errors, every, np.ones(0), 1.0)
        cameras, moved = blank.changed(change)
        seen = [blank.shown(moved, i, camera) for i, camera in enumerate(cameras)]
        points = points_of_views(Views.of(seen), cameras)
        found = np.asarray(np.isfinite(points).all(axis=1)) & (every if used is None else used)
        points = points[found]
        reach = float(np.sqrt(np.mean(np.var(points, axis=0)))) if len(points) else 1.0
        reach = reach or 1.0
        sizes = np.array([units(reach, float(camera.image_size[0])) for camera in start])
        problem = replace(blank, found=found, unit=sizes[errors > 0], reach=reach)
        return problem, problem.at(change[errors > 0], points)

    @property
    def timed(self) -> bool:
        """Whether a clock is unknown."""
        return bool(self.errors[:, [_LAG, _DRIFT]].any())

    def full(self, change: Floats) -> Floats:
        """Changes of all components, (m, SIZE), from those of the free ones."""
        every = np.zeros(self.errors.shape)
        every[self.errors > 0] = change
        return every

    def changed(self, change: Floats) -> tuple[tuple[Camera, ...], Footage]:
        """Cameras and clocks after changes (m, SIZE)."""
        pairs = zip(self.start, change, strict=True)
        moved = self.footage
        if change[:, [_LAG, _DRIFT]].any():
            moved = moved.later(change[:, _LAG], change[:, _DRIFT])
        return tuple(changed(camera, part) for camera, part in pairs), moved

    def shown(self, footage: Footage, i: int, camera: Camera) -> Floats:
        """The track of one camera in all frames, its rows read at once."""
        return steadied(footage.aligned[i], camera.readout, camera.image_size[1])

    def at(self, change: Floats, points: Floats) -> _State:
        """What the cameras miss after a change."""
        cameras, footage = self.changed(self.full(change))
        missed = np.stack(
            [self._missed(footage, i, c, points) for i, c in enumerate(cameras)], axis=1
        )
        seen = np.isfinite(missed).all(axis=-1)
        missed[~seen | (seen.sum(axis=1) < 2)[:, None]] = np.nan  # one view has no say
        return _State(change, points, cameras, footage, missed.reshape(len(points), -1))

    def _missed(self, footage: Footage, i: int, camera: Camera, points: Floats) -> Floats:
        """Track minus image of one camera, (n, 2)."""
        return self.shown(footage, i, camera)[self.found] - camera.image(points)

    def weights(self, state: _State, noise: float) -> Floats:
        """Of each frame, (n,): one, unless it is missed by far, ..."""
        worst = np.nanmax(np.abs(state.misses), axis=1, initial=0.0)
        weights = np.minimum(1.0, _OUTLIER * noise / np.maximum(worst, 1e-300)) ** 2
        if self.timed and len(weights):  # ... or is beside one, as interpolation carries a part
            weights = minimum_filter1d(weights, 2 * _BESIDE + 1)
        return weights

    def slopes(self, state: _State) -> tuple[Floats, Floats]:
        """Slopes of the misses in the free changes, (n, 2 m, p), and in the points, (n, 2 m, 3)."""
        count = len(self.start)
        free = np.argwhere(self.errors > 0)
        in_change = np.zeros((len(state.points), 2 * count, len(free)))
        every = self.full(state.change)
        for k, (i, part) in enumerate(free):
            columns = slice(2 * i, 2 * i + 2)
            if part in (_LAG, _DRIFT):
                in_lag, in_drift = state.footage.slopes(i)
                in_change[:, columns, k] = (in_lag if part == _LAG else in_drift)[self.found]
                continue
            ends, step = [], _PROBE * self.unit[k]
            for sign in (1, -1):
                moved = every[i].copy()
                moved[part] += sign * step
                camera = changed(self.start[i], moved)
                ends.append(self._missed(state.footage, i, camera, state.points))
            in_change[:, columns, k] = (ends[0] - ends[1]) / (2 * step)
        probe = _PROBE * self.reach
        in_points = np.stack([
            np.hstack([c.image(state.points - e) - c.image(state.points + e)
                       for c in state.cameras]) / (2 * probe)
            for e in probe * np.eye(3)
        ], axis=-1)  # fmt: skip
        seen = np.isfinite(state.misses)[..., None]
        in_change, in_points = np.nan_to_num(in_change), np.nan_to_num(in_points)
        return np.where(seen, in_change, 0.0), np.where(seen, in_points, 0.0)

    def result(self, state: _State, noise: float, settled: bool, steps: int) -> Adjustment:
        """All of it, in all frames."""
        reduced = _Reduced.of(*self.slopes(state), state.misses)
        frames, (count, width) = len(self.found), reduced.slopes.shape[1:]
        misses, weights = np.full((frames, count), np.nan), np.zeros(frames)
        slopes, path = np.zeros((frames, count, width)), np.zeros((frames, 3, width))
        misses[self.found], weights[self.found] = state.misses, self.weights(state, noise)
        slopes[self.found], path[self.found] = reduced.slopes, reduced.follow
        return Adjustment(
            state.cameras, state.footage, self.errors, self.full(state.change), misses, weights,
            noise, slopes, path, settled, steps,
        )  # fmt: skip


@dataclass(frozen=True)
class _Reduced:
    """Slopes, (n, 2 m, p), and misses, (n, 2 m), with the points taken out.

    The points move by `own`, (n, 3), to where they are missed least, and with the changes by
    `follow`, (n, 3, p); a point that its views do not tell stays. `along`, (n, 3), is what of the
    misses they take up.
    """

    slopes: Floats
    misses: Floats
    own: Floats
    follow: Floats
    along: Floats

    @classmethod
    def of(cls, in_change: Floats, in_points: Floats, misses: Floats) -> _Reduced:
        """By QR, frame by frame."""
        q, r = np.linalg.qr(in_points)
        pivots = np.abs(np.diagonal(r, axis1=1, axis2=2))
        told = pivots.min(axis=1, initial=np.inf) > _FLAT * pivots.max(axis=1, initial=0)
        q, r = np.where(told[:, None, None], q, 0.0), np.where(told[:, None, None], r, np.eye(3))
        across = q.swapaxes(1, 2)
        missed = np.nan_to_num(misses)[..., None]
        of_change, of_misses = across @ in_change, across @ missed
        return cls(
            in_change - q @ of_change,
            (missed - q @ of_misses)[..., 0],
            -np.linalg.solve(r, of_misses)[..., 0],
            -np.linalg.solve(r, of_change),
            of_misses[..., 0],
        )


def _downhill(
    problem: _Problem, state: _State, weights: Floats, noise: float
) -> tuple[_State | None, float]:
    """The state after a step that lessens the errors, and how far it moved images, pixels."""
    reduced = _Reduced.of(*problem.slopes(state), state.misses)
    root = np.sqrt(weights)[:, None] / max(noise, _PRIOR_NOISE)
    design = (root[..., None] * reduced.slopes).reshape(-1, len(state.change))
    prior = 1 / problem.errors[problem.errors > 0]
    rows = np.vstack((design, np.diag(prior)))
    target = -np.append((root * reduced.misses).ravel(), prior * state.change)
    size = np.sqrt(np.sum(rows**2, axis=0))
    if not np.isfinite(size).all():
        return None, np.inf
    size[size == 0] = 1.0
    factor, triangle = np.linalg.qr(rows / size)
    aim = factor.T @ target
    lags = np.argwhere(problem.errors > 0)[:, 1] == _LAG
    here = _cost(problem, state, state, weights, noise)
    for damping in _DAMPING:
        damped = np.vstack((triangle, np.sqrt(damping) * np.eye(len(size))))
        full = np.append(aim, np.zeros(len(size)))
        step = np.linalg.lstsq(damped, full, rcond=1e-13)[0] / size
        step /= max(np.abs(step[lags]).max(initial=0) / _LONGEST, 1.0)
        points = state.points + reduced.own + reduced.follow @ step
        moved = problem.at(state.change + step, points)
        shift = float(np.sqrt(np.mean((reduced.slopes @ step) ** 2))) if len(step) else 0.0
        slack = _RIPPLES if problem.timed else 1 + 1e-12
        if _cost(problem, moved, state, weights, noise) <= here * slack + 1e-18:
            late = noise * float(np.abs(step[lags]).max(initial=0))
            return moved, max(shift, late, float(np.abs(reduced.along).max(initial=0)))
    return None, 0.0


def _cost(problem: _Problem, state: _State, before: _State, weights: Floats, noise: float) -> float:
    """What is to be smallest; infinite if points that were seen before would not be."""
    seen = np.isfinite(before.misses)
    lost = ~np.isfinite(state.misses[seen])
    if lost.any() and lost.mean() > (_LOST if problem.timed else 0.0):
        return np.inf
    squares = np.nansum(np.where(seen, state.misses, 0.0) ** 2, axis=1)
    prior = 1 / problem.errors[problem.errors > 0]
    sigma = max(noise, _PRIOR_NOISE)
    return float(np.sum(weights * squares) / sigma**2 + np.sum((prior * state.change) ** 2))


def _noise(misses: Floats) -> float:
    """Standard deviation of the errors of the tracks, if most residuals are those of noise.

    Of the 2 m numbers of a frame its point takes three, and leaves the squared length of the
    others, whose median is that of chi-squared. Numbers one by one would not do: two views err
    along their epipolar lines without a residual.
    """
    freedom = np.isfinite(misses).sum(axis=1) - 3
    squares = np.nansum(misses**2, axis=1)[freedom > 0]
    if not squares.size:
        return _FINEST
    expected = 2 * gammaincinv(freedom[freedom > 0] / 2, 0.5)
    return max(float(np.sqrt(np.median(squares / expected))), _FINEST)
