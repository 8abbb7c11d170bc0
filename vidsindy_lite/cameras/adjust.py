"""Bundle adjustment: cameras, clocks and path together, from what was seen and what was measured.

Wanted are the changes p of cameras and clocks (`PARTS`) and the points x of the path that make

::

    sum_frames w / sigma^2 |track - image(x, p)|^2  +  sum (p / error)^2

smallest: pixels and measurements, each in units of its error. Each step of Gauss and Newton takes
the points out first: of the slopes in p only what no move of the frame's own point can mimic counts
(the Schur complement). sigma is the noise that the residuals show, robustly; a frame
that is missed by more than `_OUTLIER` sigma is weighed down so that it pulls no more the further it
is off (w = (limit / miss)^2, the weight of Geman and McClure's kind).

A change of a camera is one vector: two tilts of the normal and the in-plane angle (radians), the
logarithm of the scale, the position along the axes of the view plane and along its normal (scene
units), the principal point (pixels), k1, k2, p1, p2, the readout of the shutter (frames); and what
no rig file holds: by how many frames the video is late, and by how many more at its end than at its
start.

Errors of tracks depend on their neighbours. With the slopes J of the residuals r, their noise sigma
and the information P of measurements, what was fitted has the covariance

    W = A^-1 (tau N + P) A^-1,   N = sum_n J_n' J_n / sigma^2,   A = N + P,

tau the integrated autocorrelation time of the residuals, (1 + rho) / (1 - rho) with their
correlation rho from frame to frame: tau frames tell as much as one of independent errors.

**Why views do not agree.** `explain` frees one thing at a time. Residuals of a right rig are the
errors of the tracks. A wrong normal, lens or clock leaves more, which follows the motion; how large
it may be without a word depends on these errors, and not on a fixed number of pixels. For each
cause, the squares that one step saves with it free are compared with those that it leaves:

    T = (sum r^2 - sum r_c^2) / (tau_c sigma_c^2),

r what a step leaves with all free that was measured with an error, r_c with the cause as well, and
tau_c and sigma_c of r_c. Where there is no cause, T is chi-squared of as many degrees as the cause
has components. With the cause that stands out most free, cameras and path are adjusted.

Bartlett 1946, J. R. Stat. Soc. Suppl. 8 (tau); Triggs et al. 2000, "Bundle adjustment: a modern
synthesis".
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import minimum_filter1d
from scipy.special import chdtri, gammaincinv

from ..arrays import Bools, Floats
from . import models
from .clocks import Footage
from .models import TRIMMED, Camera, OrthographicCamera, PerspectiveCamera
from .rig import FINE, GROSS, Rig, decimals, residuals

#: Which components of the vector belong to what.
PARTS = {
    "normal": [0, 1],
    "angle": [2],
    "scale": [3],
    "position": [4, 5, 6],
    "principal point": [7, 8],
    "distortion": [9, 10, 11, 12],
    "readout": [13],
    "lag": [14],
    "drift": [15],
}

SIZE = 16
STEPS = 60  #: That a search takes at most.
_LARGEST = 50.0  # logarithm of a scale: a step that leads there is not taken
_OUTLIER = 6.0  # sigma
_PRIOR_NOISE = 0.02  # pixels; no track is better than that beside a measurement
_ENOUGH = 1e-7  # of sigma, by which a last step moves the images, or ...
_IN_TIME = 1e-4  # ... if clocks move, whose slopes are rough, and in frames
_PROBE = 1e-6  # of a unit: slopes are taken over twice that, and less is no change
LAG, DRIFT = PARTS["lag"][0], PARTS["drift"][0]


def persistence(missed: Floats) -> float:
    """Correlation of residuals, (n, k), with those of the next frame; that of noise is zero."""
    now, then = missed[:-1], missed[1:]
    both = np.isfinite(now) & np.isfinite(then)
    squares = np.sqrt(np.sum(now[both] ** 2) * np.sum(then[both] ** 2))
    return float(np.sum((now * then)[both]) / max(squares, 1e-300))


def lasting(missed: Floats) -> float:
    """How many times the variance of a sum of residuals, (n, k), is that of independent ones.

    Of an autoregressive series of first order: its integrated autocorrelation time, in frames.
    """
    rho = np.clip(persistence(missed), 0.0, 0.97)
    return float((1 + rho) / (1 - rho))


def known_to(given: Camera) -> Floats:
    """Standard errors of a camera of a rig: zero what is exact, infinite what is to be learned."""
    errors = np.zeros(SIZE)
    for part in ("scale", "position", "principal point", "distortion", "readout"):
        errors[PARTS[part]] = getattr(given, f"{part.replace(' ', '_')}_error", 0.0)
    errors[PARTS["normal"] + PARTS["angle"]] = np.deg2rad(given.normal_error)
    errors[PARTS["distortion"][2:]] *= 0.1  # p1 and p2, in units of k1
    if not given.is_calibrated:
        errors[PARTS["angle"] + PARTS["scale"]] = np.inf
    if not given.is_placed:
        errors[PARTS["position"]] = np.inf
    if isinstance(given, OrthographicCamera):
        errors[PARTS["position"][2]] = 0.0  # it sees the same from anywhere on its axis
    return errors


def changed(camera: Camera, change: Floats) -> Camera:
    """A calibrated camera after a change; lag and drift are none of its own."""
    if not change.any():
        return camera
    part = {name: change[place[0] : place[-1] + 1] for name, place in PARTS.items()}
    values: dict[str, Any] = {}
    if part["normal"].any():
        normal = camera.normal + part["normal"] @ camera.rows
        values["normal"] = models.frozen(normal / np.linalg.norm(normal))
    if part["position"].any() and camera.position is not None:
        axes = np.vstack((camera.rows, camera.normal))
        values["position"] = models.frozen(camera.position + part["position"] @ axes)
    if part["principal point"].any():
        values["principal_point"] = models.frozen(camera.centre + part["principal point"])
    if part["distortion"].any() and isinstance(camera, PerspectiveCamera):
        before = np.zeros(models.USUAL) if camera.distortion is None else camera.distortion
        step = np.pad(part["distortion"], (0, len(before) - len(part["distortion"])))
        values["distortion"] = models.frozen(before + step)
    if part["readout"].any():
        values["readout"] = float(np.clip(camera.readout + part["readout"][0], -1, 1))
    moved = camera.moved(**values) if values else camera
    if part["angle"].any() or part["scale"].any():
        scale, angle = camera.calibration
        grown = np.clip(part["scale"][0], -_LARGEST, _LARGEST)
        moved = moved.calibrated(scale * np.exp(grown + 1j * (angle + part["angle"][0])))
    return moved


@dataclass(eq=False)
class Adjustment:
    """Cameras, clocks and path after some change, and what is known of them near by.

    Parameters
    ----------
    given : Footage
    start : tuple of Camera
    errors : ndarray, shape (m, SIZE)
        Of the start: zero what is exactly known, infinite what is not at all.
    change : ndarray, shape (m, SIZE)
        Of each camera and its clock, from the start.
    points : ndarray, shape (n, 3)
        NaN where none is found.
    reach : float
        Size of the path, scene units.
    settled : bool
        Whether the search came to its end, after so many ...
    steps : int
    rung : int
        Which damping it took to come here.
    """

    given: Footage
    start: tuple[Camera, ...]
    errors: Floats
    change: Floats
    points: Floats
    reach: float = 1.0
    settled: bool = False
    steps: int = 0
    rung: int = 0

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """After the change."""
        return tuple(map(changed, self.start, self.change))

    @cached_property
    def footage(self) -> Footage:
        """With its lags and rates."""
        lag, drift = self.change[:, LAG], self.change[:, DRIFT]
        return self.given.later(lag, drift) if lag.any() or drift.any() else self.given

    @cached_property
    def misses(self) -> Floats:
        """Residuals, pixels, (n, 2 m); NaN where nothing is seen or no point is found."""
        pairs = zip(self.cameras, self.footage.aligned, strict=True)
        missed = np.stack([_missed(camera, track, self.points) for camera, track in pairs], axis=1)
        seen = np.isfinite(missed).all(axis=-1)
        missed[~seen | (seen.sum(axis=1) < 2)[:, None]] = np.nan  # one view has no say
        return missed.reshape(len(missed), -1)

    def left(self, share: float = TRIMMED) -> float:
        """The worst camera's residual that one frame in ten exceeds, pixels; see `trimmed`."""
        views = np.split(self.misses, len(self.start), axis=1)
        return max(models.trimmed(view, share) for view in views)

    @cached_property
    def noise(self) -> float:
        """Standard deviation of the errors of the tracks, if most residuals are those of noise.

        Of the 2 m numbers of a frame its point takes three, and leaves the squared length of the
        others, whose median is that of chi-squared. Numbers one by one would not do: two views err
        along their epipolar lines without a residual.
        """
        freedom = np.isfinite(self.misses).sum(axis=1) - 3
        squares = np.nansum(self.misses**2, axis=1)[freedom > 0]
        if not squares.size:
            return models.ROUNDING
        expected = 2 * gammaincinv(freedom[freedom > 0] / 2, 0.5)
        return max(float(np.sqrt(np.median(squares / expected))), models.ROUNDING)

    @cached_property
    def weights(self) -> Floats:
        """Of each frame, (n,): one, unless nothing is seen, it is missed by far, ..."""
        worst = np.nanmax(np.abs(self.misses), axis=1, initial=0.0)
        weights = np.minimum(1.0, _OUTLIER * self.noise / np.maximum(worst, 1e-300)) ** 2
        if self.timed and len(weights):  # ... or is near one, as interpolation carries a part
            weights = minimum_filter1d(weights, 5)
        return np.where(np.isfinite(self.misses).any(axis=1), weights, 0.0)

    @property
    def used(self) -> Bools:
        """Instants that hold no outlier, (n,)."""
        return self.weights > 0.5

    @property
    def free(self) -> Bools:
        """What may change, (m, SIZE)."""
        return self.errors > 0

    @property
    def prior(self) -> Floats:
        """Information of the measurements on the free changes, (p,)."""
        return self.errors[self.free] ** -2.0

    @property
    def timed(self) -> bool:
        """Whether a clock is unknown."""
        return bool(self.free[:, [LAG, DRIFT]].any())

    @cached_property
    def unit(self) -> Floats:
        """Sizes of changes that matter about equally, (m, SIZE)."""
        sizes = np.ones(self.errors.shape)
        sizes[:, PARTS["position"]] = self.reach
        sizes[:, PARTS["principal point"]] = [[camera.image_size[0]] for camera in self.start]
        return sizes

    @cached_property
    def reduced(self) -> _Reduced:
        """Slopes in the free changes, with the points taken out."""
        seen = np.isfinite(self.misses)[..., None]
        in_change, in_points = (np.where(seen, np.nan_to_num(part), 0.0) for part in self._slopes())
        q, size, ways = np.linalg.svd(in_points, full_matrices=False)
        # In ways of smaller slopes a point stays where it is.
        told = size > 1e-9 * size.max(axis=1, initial=0, keepdims=True)
        q, back = q * told[:, None], -ways.swapaxes(1, 2) / np.where(told, size, 1.0)[:, None]
        missed = np.nan_to_num(self.misses)[..., None]
        of_change, of_misses = (q.swapaxes(1, 2) @ part for part in (in_change, missed))
        own, follow = back @ of_misses, back @ of_change
        return _Reduced(in_change - q @ of_change, own[..., 0], follow, of_misses[..., 0])

    def _slopes(self) -> tuple[Floats, Floats]:
        """Slopes of the misses in the free changes, (n, 2 m, p), and in the points, (n, 2 m, 3)."""
        probe = _PROBE * self.reach
        in_points = np.stack([
            np.hstack([c.image(self.points - e) - c.image(self.points + e) for c in self.cameras])
            / (2 * probe)
            for e in probe * np.eye(3)
        ], axis=-1)  # fmt: skip
        free = np.argwhere(self.free)
        in_change = np.zeros((*self.misses.shape, len(free)))
        for k, (i, part) in enumerate(free):
            columns, camera = slice(2 * i, 2 * i + 2), self.start[i]
            if part in (LAG, DRIFT):
                in_change[:, columns, k] = self.footage.slopes(i)[int(part == DRIFT)]
            elif part in PARTS["position"]:  # a camera moves as all points would the other way
                axis = np.vstack((camera.rows, camera.normal))[PARTS["position"].index(part)]
                in_change[:, columns, k] = -in_points[:, columns] @ axis
            else:
                step = _PROBE * self.unit[i, part] * np.eye(SIZE)[part]
                ends = [changed(camera, self.change[i] + sign * step) for sign in (1, -1)]
                high, low = (_missed(c, self.footage.aligned[i], self.points) for c in ends)
                in_change[:, columns, k] = (high - low) / (2 * step[part])
        return in_change, in_points

    @property
    def weighed(self) -> tuple[Floats, Floats]:
        """Residuals and slopes times the roots of the weights, zero where nothing is seen."""
        root = np.sqrt(self.weights)[:, None]
        return root * np.nan_to_num(self.misses), root[..., None] * self.reduced.slopes

    @property
    def system(self) -> tuple[Floats, Floats, Floats]:
        """Linear equations for a step, of residuals and measurements in units of their errors.

        Their columns have length one; the sizes are what they are to be divided by.
        """
        (missed, slopes), prior = self.weighed, np.sqrt(self.prior)
        sigma = max(self.noise, _PRIOR_NOISE)
        rows = np.vstack((slopes.reshape(-1, len(prior)) / sigma, np.diag(prior)))
        size = np.linalg.norm(rows, axis=0)
        size[size == 0] = 1.0
        target = -np.append(missed.ravel() / sigma, prior * self.change[self.free])
        return rows / size, target, size

    @property
    def factor(self) -> Floats:
        """F, (p, k), of the covariance W = F F' of the free changes."""
        missed, slopes = self.weighed
        tau = lasting(np.where(np.isfinite(self.misses), missed, np.nan))
        square = np.einsum("nmk,nml->kl", slopes, slopes) / self.noise**2 + np.diag(self.prior)
        size = np.sqrt(np.diag(square))  # of each change: units of pixels, metres and radians
        size[size == 0] = 1.0
        values, ways = np.linalg.eigh(square / np.outer(size, size))
        # Less of the largest information of any direction is rounding.
        told = values > 1e-15 * values.max(initial=0.0)
        # In the directions of `half`, A is the unit matrix.
        half = ways[:, told] / np.sqrt(values[told]) / size[:, None]
        measured = half.T @ (self.prior[:, None] * half)
        grown, turned = np.linalg.eigh(tau * np.eye(len(measured)) - (tau - 1) * measured)
        return half @ turned * np.sqrt(np.maximum(grown, 1.0))  # less, by rounding, is none


class _Reduced(NamedTuple):
    """Slopes, (n, 2 m, p), with the points taken out.

    The points move by `own`, (n, 3), to where they are missed least, and with the changes by
    `follow`, (n, 3, p); where its views do not tell a point it stays. `along`, (n, 3), is what of
    the misses they take up.
    """

    slopes: Floats
    own: Floats
    follow: Floats
    along: Floats


def _missed(camera: Camera, track: Floats, points: Floats) -> Floats:
    """By how much the images of points miss a track, (n, 2)."""
    return camera.steadied(track) - camera.image(points)


def adjust(
    footage: Footage,
    start: Sequence[Camera],
    errors: Floats,
    *,
    begin: Floats | None = None,
    most: int = STEPS,
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
    most : int
        Steps; with none, what is known near cameras that were adjusted before.
    """
    change = np.zeros(errors.shape) if begin is None else begin
    state = Adjustment(footage, tuple(start), errors, change, np.zeros((0, 3)))
    points = models.intersect(state.cameras, models.at_once(state.cameras, state.footage.aligned))
    seen = points[np.isfinite(points).all(axis=1)]
    reach = (float(np.sqrt(np.mean(np.var(seen, axis=0)))) if len(seen) else 1.0) or 1.0
    state = replace(state, points=points, reach=reach)
    earlier = np.full(errors.shape, np.inf)
    while not state.settled and state.steps < most:
        moved, step = _downhill(state)
        if moved is None:  # rounding is all that is left, or points ran out of numbers
            state.settled, state.steps = step == 0, state.steps + 1
            break
        # A frame at the end of a video may come and go with a lag, for ever.
        back = (np.abs(moved.change - earlier) <= _PROBE * state.unit).all()
        enough = max(models.SETTLED, (_IN_TIME if state.timed else _ENOUGH) * moved.noise)
        still = step <= enough or (state.timed and back)
        moved.settled = bool(still and moved.noise >= state.noise * (1 - 1e-3))
        moved.steps, earlier, state = state.steps + 1, state.change, moved
    return state


def _downhill(state: Adjustment) -> tuple[Adjustment | None, float]:
    """The state after a step that lessens the errors, and how far it moved images, pixels."""
    free, prior, reduced = state.free, np.sqrt(state.prior), state.reduced
    weights, sigma = state.weights, max(state.noise, _PRIOR_NOISE)
    rows, target, size = state.system
    if not np.isfinite(size).all():
        return None, np.inf
    factor, triangle = np.linalg.qr(rows)
    aim = np.append(factor.T @ target, np.zeros(len(size)))
    lags = np.argwhere(free)[:, 1] == LAG
    seen = np.isfinite(state.misses)

    def cost(other: Adjustment) -> float:
        """What is to be smallest; infinite if points that were seen before would not be."""
        lost = ~np.isfinite(other.misses[seen])
        # Share of what is seen that a step in time may lead out of the video.
        if lost.any() and lost.mean() > (0.05 if state.timed else 0.0):
            return np.inf
        squares = np.nansum(np.where(seen, other.misses, 0.0) ** 2, axis=1)
        off = prior * other.change[free]
        return float(np.sum(weights * squares) / sigma**2 + np.sum(off**2))

    here = cost(state)
    # Until a step leads downhill: fine where focal length and distance hardly differ.
    dampings = (0.0, 1e-5, 1e-4, 3e-4, 1e-3, 1e-2, 0.1, 1.0, 1e2)
    for rung in range(max(state.rung - 1, 0), len(dampings)):
        damped = np.vstack((triangle, np.sqrt(dampings[rung]) * np.eye(len(size))))
        step = np.linalg.lstsq(damped, aim, rcond=1e-13)[0] / size
        step /= max(np.abs(step[lags]).max(initial=0), 1.0)  # a lag's slope holds for a frame
        change, points = state.change.copy(), state.points + reduced.own + reduced.follow @ step
        change[free] += step
        moved = replace(state, change=change, points=points, rung=rung)
        if cost(moved) <= here * (1 + 1e-12) + 1e-18:
            told = seen.any(axis=1)
            shift = np.sqrt(np.mean((reduced.slopes[told] @ step) ** 2)) if told.any() else 0.0
            late = state.noise * np.abs(step[lags]).max(initial=0)
            return moved, float(max(shift, late, np.abs(reduced.along).max(initial=0)))
    return None, 0.0


@dataclass(frozen=True)
class Cause:
    """What may be wrong of some cameras: which components of their changes, and what it leads to.

    ``found`` are the cameras with these free.
    """

    what: str
    freed: Bools
    found: Adjustment

    @property
    def cameras(self) -> tuple[int, ...]:
        """Which ones they are."""
        return tuple(np.flatnonzero(self.freed.any(axis=1)).tolist())

    @property
    def left(self) -> float:
        """`disagreement` of the worst camera of those found, pixels."""
        return self.found.left()

    def text(self, names: Sequence[str]) -> str:
        """What would explain the residuals best, with its value."""
        i = self.cameras[0]
        camera, change = self.found.cameras[i], self.found.change[i]
        one = f"cameras[{i}] ({names[i]})"
        whose = one if len(self.cameras) == 1 else "all cameras"
        parts = {
            "direction": f"the normal ({decimals(camera.normal)}) and the angle "
            f"({camera.angle:.4f}) of {whose}",
            "position": f"the position ({decimals(np.asarray(camera.position))}) of {whose}",
            "scale": f"a scale {100 * np.expm1(change[PARTS['scale']][0]):+.2g} % off of {whose}",
            "distortion": f"a distortion of the lens of {whose}, for {one} k1 off "
            f"by {change[PARTS['distortion']][0]:.2g},",
            "readout": f"a rolling shutter of {whose}, for {one} a readout of {camera.readout:.2g} "
            "frames,",
            "lag": f"a lag of {names[i]} that is off by {change[PARTS['lag']][0]:.2f} frames",
            "drift": f"another clock of {names[i]}, {abs(change[PARTS['drift']][0]):.2g} frames "
            f"{'slow' if change[PARTS['drift']][0] > 0 else 'fast'} over the whole video,",
        }
        return parts[self.what]


def explain(tracks: Sequence[Floats], given: Rig, learned: Rig) -> Cause | None:
    """The one thing that explains best what the views leave; None if nothing stands out.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2)
        One per camera, at the same instants.
    given, learned : Rig
        Before and after `learn_cameras`.
    """
    errors = np.array([known_to(camera) for camera in given.cameras])
    footage, start = Footage.of(tracks), learned.cameras
    near = adjust(footage, start, np.where(errors > 0, errors, np.inf), most=0)
    # Where views are far apart, and no noise makes it, no test is needed.
    far = near.left() > GROSS and smooth(tracks, learned)
    ranked = [
        (_evidence(near, errors[near.free] > 0, freed[near.free], far), what, freed)
        for what, freed in _causes(near)
        if (freed & (errors == 0)).any()
    ]
    most, what, freed = max(ranked, key=lambda one: one[0], default=(0.0, "", errors > 0))
    if most == 0:
        return None
    found = adjust(footage, start, np.where(freed, np.inf, errors))
    # A camera that leaves the scene of all of them behind agrees with whatever it was shown.
    scene = np.vstack([near.points, *(np.asarray(camera.position) for camera in start)])
    moved = np.linalg.norm(found.change[:, PARTS["position"]], axis=1).max()
    far = moved > np.linalg.norm(np.nanmax(scene, axis=0) - np.nanmin(scene, axis=0))
    return None if far else Cause(what, freed, found)


def smooth(tracks: Sequence[Floats], learned: Rig) -> bool:
    """Whether residuals follow the motion, which noise of the tracks does not."""
    missed = np.hstack(residuals(tracks, learned))
    limit = np.nanquantile(np.abs(missed), TRIMMED) if np.isfinite(missed).any() else 0.0
    return persistence(np.clip(missed, -limit, limit)) > 0.3


def _causes(near: Adjustment) -> Iterator[tuple[str, Bools]]:
    """All that is tried, and what it frees; a lens and a shutter of one camera, and of all."""
    parts = {what: PARTS[what] for what in ("position", "scale", "readout", "lag", "drift")}
    parts["direction"] = PARTS["normal"] + PARTS["angle"]
    parts["distortion"] = PARTS["distortion"][:2]  # k1 and k2: few motions tell more
    senseless = np.zeros(near.errors.shape, bool)
    for i, camera in enumerate(near.start):
        if isinstance(camera, OrthographicCamera):
            senseless[i, [PARTS["position"][2], *PARTS["distortion"]]] = True
    every = range(len(near.start))
    for what, places in parts.items():
        for some in [[i] for i in every] + [[*every]] * (what in ("readout", "distortion")):
            freed = np.zeros(senseless.shape, bool)
            freed[np.ix_(some, places)] = True
            yield what, freed & ~senseless


def _evidence(near: Adjustment, free: Bools, wanted: Bools, far: bool) -> float:
    """T over what chance may make it, zero if that is more, or if it would not matter.

    Where views are far apart, the pixels that it explains.
    """
    (rows, target, size), (missed, slopes) = near.system, near.weighed
    scales = np.zeros(near.errors.shape, bool)
    scales[:, PARTS["scale"]] = True

    def left(told: Bools) -> tuple[Floats, Floats]:
        """The best step in some of the changes, and what it leaves of the residuals."""
        step = np.linalg.lstsq(rows[:, told], target, rcond=1e-10)[0] / size[told]
        return step, missed + slopes[..., told] @ step

    every, (_, known) = free | wanted, left(free)
    step, rest = left(every)
    if (np.abs(step[scales[near.free][every]]) > 0.3).sum() > 1:
        return 0.0  # a scene that is larger by a third, in all scales, hides what is wrong in it
    seen = np.isfinite(near.misses)
    after, saved = np.sum(rest**2), np.sum(known**2) - np.sum(rest**2)
    explained = float(np.sqrt(max(saved, 0.0) / seen.sum()))
    if far or explained < FINE:
        return explained if far else 0.0
    share = after / np.sum(missed**2)
    variance = share * near.noise**2 * lasting(np.where(seen, rest, np.nan))
    # The chance of a T that large without a cause.
    evidence = float(saved / variance / chdtri((wanted & ~free).sum(), 1e-6))
    return evidence if evidence > 1 else 0.0
