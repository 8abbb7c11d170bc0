"""Why the views of a rig do not agree: by freeing one thing at a time, and looking what that mends.

Residuals of a right rig are the errors of the tracks. A wrong normal, lens or clock leaves more,
which follows the motion; how large it may be without a word depends on these errors, and not on a
fixed number of pixels. For each cause, with slopes C of the residuals r in it (all that is free
anyway projected out), the score g = C'r is compared with its covariance, in which residuals that
depend on their neighbours count for what they are worth (`uncertainty`):

    T = g' Omega^-1 g,      Omega of the residuals that the cause leaves.

A cause that stands out is tried: cameras and path are adjusted with it free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtri

from ..arrays import Bools, Floats
from .adjust import (
    PARTS,
    SIZE,
    Adjustment,
    NearCamera,
    adjust,
    bandwidth,
    known_to,
    linearised,
    long_run_covariance,
)
from .alignment import Footage
from .models import Camera, OrthographicCamera
from .rig import Rig
from .sight import TRIMMED, points_of_views, trimmed
from .triangulate import GROSS, check_views, disagreement, residuals

_CHANCE = 1e-6  # of a T that large without a cause
_MATTERS = 0.02  # pixels rms; real tracks are no better than that
_TRIED = 5  # of the causes that stand out most
_DEGENERATE = 1e-3  # share of a slope that nothing else explains; less tells nothing
_SMOOTH = 0.3  # correlation of a residual with the next; that of noise is zero
_ROUNDING = 1e-9  # pixels


@dataclass(frozen=True)
class Cause:
    """Something that may be wrong of some cameras: which components of their changes."""

    what: str
    cameras: tuple[int, ...]
    parts: tuple[int, ...]

    def mask(self, count: int) -> Bools:
        """The freed components, (m, SIZE)."""
        freed = np.zeros((count, SIZE), bool)
        freed[np.ix_(self.cameras, self.parts)] = True
        return freed


@dataclass(frozen=True)
class Explanation:
    """A cause, and the cameras that it leads to."""

    cause: Cause
    found: Adjustment

    @property
    def left(self) -> float:
        """`disagreement` of the worst camera of these, pixels."""
        return max(map(trimmed, np.split(self.found.misses, len(self.found.cameras), axis=1)))

    def text(self, names: Sequence[str]) -> str:
        """What would explain the residuals best, with its value."""
        i, what = self.cause.cameras[0], self.cause.what
        camera, change = self.found.cameras[i], self.found.change[i]
        one = f"cameras[{i}] ({names[i]})"
        whose = one if len(self.cause.cameras) == 1 else "all cameras"
        parts = {
            "normal": f"the normal ({_list(camera.normal)}) of {whose}",
            "position": f"the position ({_list(np.asarray(camera.position))}) of {whose}",
            "scale": f"a scale {100 * np.expm1(change[PARTS['scale']][0]):+.2g} % off of {whose}",
            "distortion": f"a distortion of the lens of {whose}, for {one} k1 off "
            f"by {change[PARTS['distortion']][0]:.2g},",
            "readout": f"a rolling shutter of {whose}, for {one} a readout of {camera.readout:.2g} "
            "frames,",
            "lag": f"a lag of {names[i]} that is off by {change[PARTS['lag']][0]:.2f} frames",
            "drift": f"another clock of {names[i]}, {abs(change[PARTS['drift']][0]):.2g} frames "
            f"{'slow' if change[PARTS['drift']][0] > 0 else 'fast'} over the whole video,",
            "nearness": "perspective, where the cameras are taken as orthographic, for "
            f"{one} a distance of {1 / max(abs(change[PARTS['nearness']][0]), 1e-12):.3g},",
        }
        return parts[what]


def explain(tracks: Sequence[Floats], given: Rig, learned: Rig) -> Explanation | None:
    """The one thing that explains best what the views leave; None if nothing stands out.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2)
        One per camera, at the same instants.
    given, learned : Rig
        Before and after `learn_cameras`.
    """
    views = check_views(tracks, learned)
    errors = np.array([known_to(camera) for camera in given.cameras])
    points = points_of_views(views, learned.cameras)
    seen = np.isfinite(points).all(axis=1)
    if not seen.any():
        return None
    far = smooth(tracks, learned) and max(disagreement(tracks, learned)) > GROSS
    start = [_near(camera, points[seen].mean(axis=0)) for camera in learned.cameras]
    causes = [c for c in _causes(start) if (c.mask(len(start)) & (errors == 0)).any()]
    footage = Footage.of(tracks)
    near = linearised(footage, start, np.where(errors > 0, errors, np.inf))
    sizes = [_sizes(near, errors, cause) for cause in causes]
    # Where views are far apart, and no noise makes it, no test is needed.
    rank = [explained if far else evidence for evidence, explained in sizes]
    tried = [causes[k] for k in np.argsort(rank)[::-1][:_TRIED] if rank[k] > (0 if far else 1)]
    best: tuple[float, Explanation] | None = None
    for cause in tried:
        freed = cause.mask(len(start))
        found = adjust(footage, start, np.where(freed, np.inf, errors))
        used = np.isfinite(found.misses)
        left = float(np.sum((np.sqrt(found.weights)[:, None] * found.misses)[used] ** 2))
        count = used.sum()
        price = count * np.log(max(left, _ROUNDING)) + freed.sum() * np.log(count)
        if best is None or price < best[0]:
            best = price, Explanation(cause, found)
    return None if best is None else best[1]


def smooth(tracks: Sequence[Floats], learned: Rig) -> bool:
    """Whether residuals follow the motion, which noise of the tracks does not."""
    missed = np.hstack(residuals(tracks, learned))
    both = np.isfinite(missed[1:]) & np.isfinite(missed[:-1])
    limit = np.nanquantile(np.abs(missed), TRIMMED) if both.any() else 0.0
    before, after = (np.clip(part[both], -limit, limit) for part in (missed[:-1], missed[1:]))
    return bool(before @ after > _SMOOTH * np.sqrt((before @ before) * (after @ after)))


def _causes(cameras: Sequence[Camera]) -> list[Cause]:
    """All that is tried; a lens and a shutter of one camera, and of all as of one make."""
    every = tuple(range(len(cameras)))
    flat = tuple(i for i in every if isinstance(cameras[i], OrthographicCamera))
    pinholes = tuple(i for i in every if i not in flat)
    found = [
        Cause(what, (i,), _components(what)[: 2 if i in flat else None])
        for what in ("normal", "position", "scale", "readout", "lag", "drift")
        for i in every
    ]
    lens = _components("distortion")[:2]  # k1 and k2: few motions tell more
    found += [Cause("distortion", (i,), lens) for i in pinholes]
    found.append(Cause("readout", every, _components("readout")))
    if pinholes:
        found.append(Cause("distortion", pinholes, lens))
    if flat:  # the scale is then that of another distance
        found.append(Cause("nearness", flat, _components("nearness") + _components("scale")))
    return found


def _components(what: str) -> tuple[int, ...]:
    """Places in the vector of changes."""
    return tuple(range(SIZE)[PARTS[what]])


def _near(camera: Camera, about: Floats) -> Camera:
    """The same camera, ready to be not infinitely far if it is orthographic."""
    if not isinstance(camera, OrthographicCamera):
        return camera
    return NearCamera(about=about, **{k: v for k, v in vars(camera).items() if k in _FIELDS})


_FIELDS = {name for name in OrthographicCamera.__dataclass_fields__ if name != "model"}


def _sizes(near: Adjustment, errors: Floats, cause: Cause) -> tuple[float, float]:
    """T over what chance may make it, zero if it would not matter; pixels that it explains."""
    missed, slopes = near.weighed
    free, wanted = errors[near.errors > 0] > 0, cause.mask(len(errors))[near.errors > 0]
    own = slopes[..., wanted & ~free]
    flat, target = own.reshape(-1, own.shape[-1]), missed.ravel()
    size = np.sqrt(np.sum(flat**2, axis=0))
    flat, size = flat[:, size > 0], size[size > 0]
    if not size.size:
        return 0.0, 0.0
    prior = near.noise / errors[near.errors > 0][free]
    others = np.vstack((slopes[..., free].reshape(len(flat), -1), np.diag(prior)))
    padded = np.vstack((flat / size, np.zeros((len(prior), len(size)))))
    if free.any():
        solved = np.linalg.lstsq(others, padded, rcond=1e-10)[0]
        padded = padded - others @ solved
    left, singular, _ = np.linalg.svd(padded, full_matrices=False)
    left = left[: len(flat), singular > _DEGENERATE]
    if not left.shape[1]:
        return 0.0, 0.0
    score = left.T @ target
    rest = (target - left @ score).reshape(missed.shape)
    each = np.einsum("nmk,nm->nk", left.reshape(*missed.shape, -1), rest)
    covariance = long_run_covariance(each) * len(each)
    covariance += _ROUNDING**2 * np.eye(len(covariance))
    explained = float(np.linalg.norm(score) / np.sqrt(np.isfinite(near.misses).sum()))
    # Bartlett's weights of that width leave as many degrees of freedom (2/3 is their square's
    # integral) to estimate Omega with: Hotelling's T.
    degrees = 1.5 * len(each) / (bandwidth(each) + 1)
    rest_degrees = degrees - len(score) + 1
    if explained < _MATTERS or rest_degrees <= 0:
        return 0.0, explained
    chance = float(fdtri(len(score), rest_degrees, 1 - _CHANCE))
    limit = chance * len(score) * degrees / rest_degrees
    return float(score @ np.linalg.solve(covariance, score)) / limit, explained


def _list(values: Floats) -> str:
    """Three decimals of each."""
    return ", ".join(f"{value:.3f}" for value in values)
