"""Bundle adjustment: cameras and path together, from what was seen and what was measured.

Wanted are the changes p of the cameras (`changes`) and the points x of the path that make

::

    sum_frames w / sigma^2 |track - image(x, p)|^2  +  sum (p / error)^2

smallest: pixels and measurements, each in units of its error. Each step of Gauss and Newton takes
the points out first: of the slopes in p only what no move of the frame's own point can mimic counts
(the Schur complement, here by QR). sigma is the noise that the residuals show, robustly; a frame
that is missed by more than `_OUTLIER` sigma is weighed down so that it pulls no more the further it
is off (w = (limit / miss)^2, the weight of Geman and McClure's kind).

Triggs et al. 2000, "Bundle adjustment: a modern synthesis".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Bools, Floats
from .camera import Camera
from .changes import PARTS, at_once, changed, units
from .triangulate import Views, points_of_views

_OUTLIER = 6.0  # sigma
_FINEST = 1e-6  # pixels; noise below that is rounding
_PRIOR_NOISE = 0.02  # pixels; no track is better than that beside a measurement
_STEPS = 60
_SETTLED = 1e-11  # pixels, or ...
_ENOUGH = 1e-7  # ... of sigma, by which a last step moves the images
_PROBE = 1e-6  # of a unit: slopes are taken over twice that
_DAMPING = (0.0, 1e-4, 1e-2, 1.0, 1e2)  # tried in turn, until a step leads downhill


@dataclass(frozen=True)
class Adjustment:
    """Cameras of the smallest errors, and what is known of them near by.

    Parameters
    ----------
    cameras : tuple of Camera
    errors : ndarray, shape (m, SIZE)
        As they were given.
    change : ndarray, shape (m, SIZE)
        Of each camera, from the start.
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


def adjust(views: Views, start: Sequence[Camera], errors: Floats) -> Adjustment:
    """The cameras of the smallest errors near a start, see the module.

    Parameters
    ----------
    views : Views
    start : sequence of Camera
        Calibrated and placed.
    errors : ndarray, shape (m, SIZE)
        Standard errors of the start: zero what is exactly known, infinite what is not at all.
    """
    problem = _Problem.of(views, start, errors)
    change = np.zeros((errors > 0).sum())
    state = problem.at(change, problem.begin)
    noise = _noise(state.misses)
    settled, steps = False, 0
    while not settled and steps < _STEPS:
        weights = _weights(state.misses, noise)
        moved, step = _downhill(problem, state, weights, noise)
        if moved is None:  # rounding is all that is left
            settled = True
        else:
            state, before = moved, noise
            noise = _noise(state.misses)
            settled = step <= max(_SETTLED, _ENOUGH * noise) and noise >= before * (1 - 1e-3)
        steps += 1
    return problem.result(state, noise, settled, steps)


def linearised(views: Views, cameras: Sequence[Camera], errors: Floats) -> Adjustment:
    """What is known near cameras that were adjusted before."""
    problem = _Problem.of(views, cameras, errors)
    state = problem.at(np.zeros((errors > 0).sum()), problem.begin)
    return problem.result(state, _noise(state.misses), settled=True, steps=0)


@dataclass(frozen=True)
class _State:
    """Changes, (p,), points, (n, 3), the cameras, and by how much they miss the tracks."""

    change: Floats
    points: Floats
    cameras: tuple[Camera, ...]
    misses: Floats


@dataclass(frozen=True)
class _Problem:
    """The tracks, the start, what is free of it, and the frames in which a point can be found."""

    tracks: tuple[Floats, ...]
    start: tuple[Camera, ...]
    errors: Floats
    found: Bools  # which frames
    begin: Floats
    unit: Floats  # of each free change, and ...
    reach: float  # ... of points

    @classmethod
    def of(cls, views: Views, start: Sequence[Camera], errors: Floats) -> _Problem:
        """Start, and units from the size of the path."""
        points = points_of_views(views, start)
        found = np.asarray(np.isfinite(points).all(axis=1))
        begin = points[found]
        reach = float(np.sqrt(np.mean(np.var(begin, axis=0)))) if len(begin) else 1.0
        reach = reach or 1.0
        sizes = np.array([units(reach, float(camera.image_size[0])) for camera in start])
        return cls(views.tracks, tuple(start), errors, found, begin, sizes[errors > 0], reach)

    def full(self, change: Floats) -> Floats:
        """Changes of all components, (m, SIZE), from those of the free ones."""
        every = np.zeros(self.errors.shape)
        every[self.errors > 0] = change
        return every

    def at(self, change: Floats, points: Floats) -> _State:
        """What the cameras miss after a change."""
        pairs = zip(self.start, self.full(change), strict=True)
        cameras = tuple(changed(camera, part) for camera, part in pairs)
        return _State(change, points, cameras, np.hstack([
            self._missed(i, camera, points, self.full(change)[i])
            for i, camera in enumerate(cameras)
        ]))  # fmt: skip

    def _missed(self, i: int, camera: Camera, points: Floats, change: Floats) -> Floats:
        """Track minus image of one camera, (n, 2)."""
        track = at_once(self.tracks[i], change, camera.image_size[1])
        return track[self.found] - camera.image(points)

    def slopes(self, state: _State) -> tuple[Floats, Floats]:
        """Slopes of the misses in the free changes, (n, 2 m, p), and in the points, (n, 2 m, 3)."""
        count = len(self.start)
        free = np.argwhere(self.errors > 0)
        in_change = np.zeros((len(state.points), 2 * count, len(free)))
        every = self.full(state.change)
        for k, (i, part) in enumerate(free):
            ends = []
            for sign in (1, -1):
                moved = every[i].copy()
                moved[part] += sign * _PROBE * self.unit[k]
                camera = changed(self.start[i], moved)
                ends.append(self._missed(i, camera, state.points, moved))
            slope = (ends[0] - ends[1]) / (2 * _PROBE * self.unit[k])
            in_change[:, 2 * i : 2 * i + 2, k] = slope
        probe = _PROBE * self.reach
        in_points = np.stack([
            np.hstack([c.image(state.points - e) - c.image(state.points + e)
                       for c in state.cameras]) / (2 * probe)
            for e in probe * np.eye(3)
        ], axis=-1)  # fmt: skip
        seen = np.isfinite(state.misses)[..., None]
        return np.where(seen, in_change, 0.0), np.where(seen, in_points, 0.0)

    def result(self, state: _State, noise: float, settled: bool, steps: int) -> Adjustment:
        """All of it, in all frames."""
        in_change, in_points = self.slopes(state)
        q, r = np.linalg.qr(in_points)
        along = q.swapaxes(1, 2) @ in_change
        frames, (count, width) = len(self.found), in_change.shape[1:]
        misses, weights = np.full((frames, count), np.nan), np.zeros(frames)
        slopes, path = np.zeros((frames, count, width)), np.zeros((frames, 3, width))
        misses[self.found], weights[self.found] = state.misses, _weights(state.misses, noise)
        slopes[self.found], path[self.found] = in_change - q @ along, -np.linalg.solve(r, along)
        change = self.full(state.change)
        return Adjustment(
            self._read(state, change), self.errors, change, misses, weights, noise, slopes, path,
            settled, steps,
        )  # fmt: skip

    def _read(self, state: _State, change: Floats) -> tuple[Camera, ...]:
        """The cameras of a state, with the readout of each in place."""
        late = change[:, PARTS["readout"]][:, 0]
        return tuple(
            replace(c, readout=float(np.clip(c.readout + add, -1, 1))) if add else c
            for c, add in zip(state.cameras, late, strict=True)
        )


def _downhill(
    problem: _Problem, state: _State, weights: Floats, noise: float
) -> tuple[_State | None, float]:
    """The state after a step that lessens the errors, and how far it moved images, pixels."""
    in_change, in_points = problem.slopes(state)
    q, r = np.linalg.qr(in_points)
    missed = np.nan_to_num(state.misses)[..., None]
    own = -np.linalg.solve(r, q.swapaxes(1, 2) @ missed)[..., 0]
    along = q.swapaxes(1, 2) @ in_change
    slopes = in_change - q @ along
    left = missed - q @ (q.swapaxes(1, 2) @ missed)
    root = np.sqrt(weights)[:, None] / max(noise, _PRIOR_NOISE)
    design = (root[..., None] * slopes).reshape(-1, len(state.change))
    prior = 1 / problem.errors[problem.errors > 0]
    rows = np.vstack((design, np.diag(prior)))
    target = -np.append((root * left[..., 0]).ravel(), prior * state.change)
    size = np.sqrt(np.sum(rows**2, axis=0))
    size[size == 0] = 1.0
    factor, triangle = np.linalg.qr(rows / size)
    aim = factor.T @ target
    seen = np.isfinite(state.misses)
    here = _cost(state, seen, weights, noise, prior)
    for damping in _DAMPING:
        damped = np.vstack((triangle, np.sqrt(damping) * np.eye(len(size))))
        full = np.append(aim, np.zeros(len(size)))
        step = np.linalg.lstsq(damped, full, rcond=1e-13)[0] / size
        points = state.points + own - np.linalg.solve(r, along @ step[:, None])[..., 0]
        moved = problem.at(state.change + step, points)
        shift = float(np.sqrt(np.mean((slopes @ step) ** 2))) if slopes.size else 0.0
        if _cost(moved, seen, weights, noise, prior) <= here * (1 + 1e-12) + 1e-18:
            return moved, max(shift, float(np.abs(q.swapaxes(1, 2) @ missed).max(initial=0)))
    return None, 0.0


def _cost(state: _State, seen: Bools, weights: Floats, noise: float, prior: Floats) -> float:
    """What is to be smallest; infinite if a point that was seen would not be."""
    if not np.isfinite(state.misses[seen]).all():
        return np.inf
    squares = np.nansum(state.misses**2, axis=1)
    sigma = max(noise, _PRIOR_NOISE)
    return float(np.sum(weights * squares) / sigma**2 + np.sum((prior * state.change) ** 2))


def _noise(misses: Floats) -> float:
    """Standard deviation of the errors of the tracks, if most residuals are those of noise."""
    seen = np.isfinite(misses)
    if not seen.any():
        return _FINEST
    count = seen.sum(axis=1, keepdims=True)
    # Of 2 m numbers of a frame its point takes three.
    grown = np.where(seen, np.abs(misses) * np.sqrt(count / np.maximum(count - 3, 1)), 0.0)
    return max(1.4826 * float(np.median(grown[seen])), _FINEST)


def _weights(misses: Floats, noise: float) -> Floats:
    """Of each frame: one, unless it is missed by far."""
    worst = np.nanmax(np.abs(misses), axis=1, initial=0.0)
    return np.minimum(1.0, _OUTLIER * noise / np.maximum(worst, 1e-300)) ** 2
