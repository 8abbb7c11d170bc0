"""What is unknown of the cameras of a rig, and linear equations for it.

The equations say that orthographic views agree on one point. The stacked in-plane coordinates of
the views of a frame equal [R^-_1; R^-_2; ...] x. Columns Q with Q^T [R^-_1; ...] = 0 take the
unknown point out, and what is left is linear in (s cos theta, s sin theta) of the cameras that are
not calibrated and Delta_c of those without a position.

Paper: Eq. (4), (5).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from ..arrays import Floats, Ints
from .camera import Camera
from .geometry import PARALLEL
from .rig import Rig
from .triangulate import Views

Complex = NDArray[np.complex128]

# A frame that is missed by more than so many robust standard deviations holds an outlier.
_OUTLIER = 8.0
_ROUNDING = 1e-6  # pixels; missing by less is no disagreement
_ROUNDS = 20  # of leaving outliers out
# Motion must tell by so many times the misfit in countless frames, and over sqrt(n) more in n.
_TELLING, _FEW = 1.45, 8.0


@dataclass(frozen=True)
class Unknowns:
    """Which cameras of a rig are not calibrated and which not placed, as indices.

    `scale` is the mean scale of the calibrated cameras.
    """

    cameras: tuple[Camera, ...]
    uncalibrated: Ints
    unplaced: Ints
    scale: float

    @classmethod
    def of(cls, rig: Rig) -> Unknowns:
        """Of a rig with at least one calibrated camera."""
        return cls(
            rig.cameras,
            np.flatnonzero([not camera.is_calibrated for camera in rig.cameras]),
            np.flatnonzero([not camera.is_placed for camera in rig.cameras]),
            float(np.mean([c.calibration[0] for c in rig.cameras if c.is_calibrated])),
        )

    @property
    def known(self) -> int:
        """The first calibrated camera."""
        return next(i for i, camera in enumerate(self.cameras) if camera.is_calibrated)

    @property
    def any(self) -> bool:
        """Whether anything is unknown."""
        return bool(self.uncalibrated.size or self.unplaced.size)

    @property
    def measured(self) -> bool:
        """Whether something that is given has an error."""
        return any(any(camera.errors.values()) for camera in self.cameras)

    def filled(self, turned: Complex, offsets: Floats) -> tuple[Camera, ...]:
        """The cameras with s exp(i theta), (u,), and offsets, (v, 2), where they are unknown."""
        cameras = list(self.cameras)
        for i, offset in zip(self.unplaced, offsets, strict=True):
            cameras[i] = cameras[i].placed(offset)
        return calibrated(cameras, self.uncalibrated, turned)


def calibrated(
    cameras: Sequence[Camera], indices: Iterable[int], turned: Iterable[complex]
) -> tuple[Camera, ...]:
    """The cameras with s exp(i theta) written into some of them."""
    values = dict(zip(indices, turned, strict=True))
    return tuple(c.calibrated(values[i]) if i in values else c for i, c in enumerate(cameras))


def names(indices: Iterable[int]) -> str:
    """Cameras as errors call them."""
    return " and ".join(f"cameras[{i}]" for i in indices)


@dataclass(frozen=True)
class Equations:
    """Linear equations design @ p = target, (k, p) and (k,), and the frame of each, (k,).

    p holds (s cos theta, s sin theta) of the cameras that are not calibrated, then Delta_c of those
    not placed, divided by the half width of their image: so all of the design is in pixels.
    """

    design: Floats
    target: Floats
    frames: Ints


def annihilator(cameras: Sequence[Camera]) -> Floats:
    """All columns Q that take the unknown point out of the views of these cameras."""
    return null_space(np.vstack([camera.rows for camera in cameras]).T, rcond=PARALLEL)


def agreement(
    views: Views,
    unknowns: Unknowns,
    columns: Callable[[Sequence[Camera]], Floats] = annihilator,
) -> tuple[Equations, bool]:
    """The equations of all frames without outliers, and whether it could be told which these are.

    `columns(cameras)` are the Q, (2 c, q), of c cameras that see the target in the same frames.
    """
    width = 2 * (unknowns.uncalibrated.size + unknowns.unplaced.size)
    parts = [(np.zeros((0, width)), np.zeros(0), np.zeros(0, dtype=int))]
    for indices, frames in views.groups:
        block = columns([unknowns.cameras[i] for i in indices])
        design, target = _group(views, unknowns, indices, frames, block)
        places = np.repeat(frames, target.shape[1])
        parts.append((design.reshape(len(places), width), target.ravel(), places))
    every = Equations(*map(np.concatenate, zip(*parts, strict=True)))
    return _without_outliers(every, unknowns.scale)


def _group(
    views: Views, unknowns: Unknowns, indices: Ints, frames: Ints, columns: Floats
) -> tuple[Floats, Floats]:
    """Design, (f, q, p / 2, 2), and target, (f, q), of the equations of one group of frames."""
    first = unknowns.uncalibrated.size  # of the cameras that are not placed
    design = np.zeros((len(frames), columns.shape[1], first + unknowns.unplaced.size, 2))
    target = np.zeros(design.shape[:2])
    for i, block in zip(indices, np.split(columns, len(indices)), strict=True):
        camera, pixels = unknowns.cameras[i], views.tracks[i][frames]
        if camera.scale is not None:
            target -= camera.scale * camera.turned(pixels) @ block
        else:
            # s T(theta) (X, Y) = [[X, Y], [Y, -X]] p
            x, y = camera.centred(pixels).T
            slope = np.einsum("abf,aq->fqb", np.array([[x, y], [y, -x]]), block)
            design[:, :, np.searchsorted(unknowns.uncalibrated, i)] = slope
        if camera.is_placed:
            target -= camera.offset @ block
        else:
            place = first + np.searchsorted(unknowns.unplaced, i)
            design[:, :, place] = camera.image_size[0] / 2 * block.T
    return design, target


def _without_outliers(every: Equations, scale: float) -> tuple[Equations, bool]:
    """The frames of which a least-squares fit to them misses no equation by far.

    Fit and frames are found in turn; the second result is whether they came to agree. The scale of
    the misses is the median over all frames, so that leaving some out never makes others look
    worse.
    """
    kept = every
    for _ in range(_ROUNDS):
        solution = np.linalg.lstsq(kept.design, kept.target)[0]
        missed = np.abs(every.design @ solution - every.target) / scale
        limit = max(_OUTLIER * 1.4826 * np.median(missed), _ROUNDING) if len(missed) else 0.0
        good = ~np.isin(every.frames, every.frames[missed > limit])
        before, kept = kept, Equations(every.design[good], every.target[good], every.frames[good])
        if np.array_equal(kept.frames, before.frames):
            return kept, True
    return kept, False


def solve(design: Floats, target: Floats, unknowns: Unknowns) -> tuple[Complex, Floats]:
    """Least-squares s exp(i theta) and offsets, or an error that names what the tracks leave open.

    The design is in pixels: a singular value over sqrt(n) is the motion, in pixels rms, that tells
    one combination of the parameters. Noise on a target that does not move makes 0.6-1.4 times the
    misfit of it, and somewhat more in few frames.
    """
    turns, loose = unknowns.uncalibrated, unknowns.unplaced
    wanted = "scale, angle and position" if len(loose) else "scale and angle"
    asked = np.append(turns, loose)
    if len(design) < design.shape[1]:
        raise ValueError(
            f"tracks: frames with common views must give at least {design.shape[1]} equations "
            f"for {wanted} of {names(asked)}, got {len(design)}"
        )
    solution = np.linalg.lstsq(design, target)[0]
    turned, offsets = solution[: 2 * len(turns)].view(complex), solution[2 * len(turns) :]
    scale = np.mean(np.abs(turned)) if len(turns) else unknowns.scale
    misfit = np.sqrt(np.mean((design @ solution - target) ** 2)) / scale if scale > 0 else np.inf
    _, singular, right = np.linalg.svd(design, full_matrices=False)
    motion = singular / np.sqrt(len(design))
    # What is missed by measurements is no noise; a later search takes these for what they are.
    asked_for = min(2.0, _TELLING + _FEW / np.sqrt(len(design))) * misfit
    weak = motion <= max(1e-9 * motion[0], 0.0 if unknowns.measured else asked_for)
    if weak.any():
        share = np.linalg.norm(right[weak].reshape(weak.sum(), -1, 2), axis=(0, 2))
        raise ValueError(
            f"tracks: the target's motion must determine {wanted} of "
            f"{names(asked[share > 0.1])}, got {motion[-1]:.2g} px rms of "
            f"telling motion against a misfit of {misfit:.2g} px (a static target, a wrong "
            "position or normal, videos in another order than the cameras, or of other motions)"
        )
    widths = [unknowns.cameras[i].image_size[0] for i in loose]
    return turned, offsets.reshape(-1, 2) * np.reshape(widths, (-1, 1)) / 2
