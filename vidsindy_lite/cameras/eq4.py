"""Cameras by linear equations: Eq. (4) of the paper, and what it leaves out.

Orthographic views agree on one point if linear equations hold for what is unknown, so no starting
guess is needed: the stacked in-plane coordinates of the views of a frame equal [R^-_1; R^-_2; ...]
x, columns Q with Q^T [R^-_1; ...] = 0 take the unknown point out, and what is left is linear in (s
cos theta, s sin theta) of the cameras that are not calibrated and Delta_c of those without a
position. Perspective ones are found from the known cameras, one epipolar constraint at a time.

In Eq. (4) by itself, to compare `learn_cameras` with, the views of the uncalibrated cameras predict
those of the calibrated ones, R^-_known pinv(R^-_unknown) y_unknown = y_known, in the frames in
which all cameras see the target.

Paper: Section "Coordinates Transformation", Eq. (4), (5).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from ..arrays import Floats, Ints
from ..checks import check_instance
from .models import PARALLEL, Camera, all_orthographic, independent
from .rig import Rig, check_views
from .triangulate import epipolar_lines, epipolar_rows

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


class Equations(NamedTuple):
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
    tracks: Sequence[Floats],
    unknowns: Unknowns,
    columns: Callable[[Sequence[Camera]], Floats] = annihilator,
) -> Equations:
    """The equations of orthographic views in all frames that two or more of them see.

    `columns(cameras)` are the Q, (2 c, q), of c cameras that see the target in the same frames.
    """
    first = unknowns.uncalibrated.size  # of the cameras that are not placed
    width = 2 * (first + unknowns.unplaced.size)
    parts = [Equations(np.zeros((0, width)), np.zeros(0), np.zeros(0, dtype=int))]
    seen = np.column_stack([np.isfinite(track).all(axis=1) for track in tracks])
    patterns, group = np.unique(seen, axis=0, return_inverse=True)
    for g in map(int, np.flatnonzero(patterns.sum(axis=1) >= 2)):
        indices, frames = np.flatnonzero(patterns[g]), np.flatnonzero(group == g)
        q = columns([unknowns.cameras[i] for i in indices])
        design = np.zeros((len(frames), q.shape[1], width // 2, 2))
        target = np.zeros(design.shape[:2])
        for i, block in zip(indices, np.split(q, len(indices)), strict=True):
            camera, pixels = unknowns.cameras[i], tracks[int(i)][frames]
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
        places = np.repeat(frames, target.shape[1])
        parts.append(Equations(design.reshape(len(places), width), target.ravel(), places))
    return Equations(*map(np.concatenate, zip(*parts, strict=True)))


def _epipolar(tracks: Sequence[Floats], cameras: Sequence[Camera], i: int) -> Equations:
    """The equations of a camera of any model that is not calibrated, with all that are."""
    parts = []
    for known, track in zip(cameras, tracks, strict=True):
        if known.is_calibrated:
            lines = epipolar_lines(known, track, cameras[i])
            design, target = epipolar_rows(lines, cameras[i], tracks[i])
            told = np.flatnonzero(np.isfinite(design).all(axis=1) & np.isfinite(target))
            parts.append(Equations(design[told], target[told], told))
    return Equations(*map(np.concatenate, zip(*parts, strict=True)))


def without_outliers(every: Equations, scale: float) -> tuple[Equations, bool]:
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


def solve(equations: Equations, unknowns: Unknowns, checked: bool = True) -> tuple[Complex, Floats]:
    """Least-squares s exp(i theta) and offsets, or an error that names what the tracks leave open.

    The design is in pixels: a singular value over sqrt(n) is the motion, in pixels rms, that tells
    one combination of the parameters. Noise on a target that does not move makes 0.6-1.4 times the
    misfit of it, and somewhat more in few frames. That is not asked for unless `checked`: it would
    not hold at a wrong lag, nor with a wrong normal.
    """
    design, target, _ = equations
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
    if checked and weak.any():
        share = np.linalg.norm(right[weak].reshape(weak.sum(), -1, 2), axis=(0, 2))
        raise ValueError(
            f"tracks: the target's motion must determine {wanted} of "
            f"{names(asked[share > 0.1])}, got {motion[-1]:.2g} px rms of "
            f"telling motion against a misfit of {misfit:.2g} px (a static target, a wrong "
            "position or normal, videos in another order than the cameras, or of other motions)"
        )
    widths = [unknowns.cameras[i].image_size[0] for i in loose]
    return turned, offsets.reshape(-1, 2) * np.reshape(widths, (-1, 1)) / 2


def closed_form(
    tracks: Sequence[Floats], unknowns: Unknowns, checked: bool = True
) -> tuple[tuple[Camera, ...], bool]:
    """Cameras of linear equations, and whether it could be told which frames hold outliers.

    Between two perspective cameras that are both unknown, the epipolar constraint is not linear; so
    a camera waits until one that shares frames with it is known.

    Raises
    ------
    ValueError
        If the tracks leave a camera open; see `solve` for `checked`.
    """
    cameras, decided = unknowns.cameras, True
    if not unknowns.any:
        return cameras, decided
    if all_orthographic(cameras):
        equations, decided = without_outliers(agreement(tracks, unknowns), unknowns.scale)
        return unknowns.filled(*solve(equations, unknowns, checked)), decided
    while waiting := [i for i in unknowns.uncalibrated if not cameras[i].is_calibrated]:
        found, failed = {}, []
        for i in waiting:
            every, told = without_outliers(_epipolar(tracks, cameras, i), unknowns.scale)
            try:
                one = replace(unknowns, cameras=cameras, uncalibrated=np.array([i]))
                found[i] = solve(every, one, checked)[0][0]
            except ValueError as error:
                failed.append(error)
            decided &= told
        if not found:
            raise failed[0]
        cameras = calibrated(cameras, found, found.values())
    return cameras, decided


def check_learnable(rig: Rig) -> None:
    """That enough is known of the cameras of a rig to learn the rest.

    Raises
    ------
    ValueError
        If it is not.
    """
    check_instance("rig", rig, Rig)
    if len(rig.cameras) < 2:
        raise ValueError("rig: must hold two or more cameras, got 1, which sees no depth")
    if not rig.is_measured:
        return
    if not any(camera.is_calibrated for camera in rig.cameras):
        raise ValueError(
            "rig: at least one camera must be calibrated (scale and angle given) to learn the "
            f"others, got none of {len(rig.cameras)}"
        )
    loose = Unknowns.of(rig).unplaced
    if loose.size and not all_orthographic(rig.cameras):
        raise ValueError(
            "rig: all positions must be given if a camera is perspective, got none of "
            f"{names(loose)}"
        )
    placed = [camera for camera in rig.cameras if camera.is_placed]
    if loose.size and not independent(placed):
        raise ValueError(
            "rig: the positions of two cameras with independent normals must be given to learn "
            f"those of {names(loose)}, got {len(placed)}"
        )


def learn_cameras_eq4(tracks: Sequence[Floats], rig: Rig) -> Rig:
    """Learn scales and angles by Eq. (4) in closed form.

    Eq. (4) is linear in (s cos theta, s sin theta). It leaves out the epipolar constraint between
    uncalibrated cameras, and its misfit is not the error of pixels.

    Parameters
    ----------
    tracks, rig
        See `learn_cameras`. All cameras are orthographic and placed, and two of the uncalibrated
        ones have independent normals.

    Returns
    -------
    Rig
        The same cameras, all calibrated.

    Raises
    ------
    ValueError
        See `learn_cameras`.
    """
    return _learned(tracks, rig, _closed)


def learn_cameras_lbfgs(tracks: Sequence[Floats], rig: Rig) -> Rig:
    """Learn scales and angles by descending Eq. (4) in (s, theta), with L-BFGS in PyTorch.

    The start is the calibrated camera's scale and no turn.

    Parameters
    ----------
    tracks, rig
        See `learn_cameras_eq4`.

    Returns
    -------
    Rig
        The same cameras, all calibrated.

    Raises
    ------
    ValueError
        See `learn_cameras`.
    """
    return _learned(tracks, rig, _descended)


def _learned(
    tracks: Sequence[Floats], rig: Rig, method: Callable[[Equations, Unknowns], Complex]
) -> Rig:
    """The rig with s exp(i theta) by a method, from Eq. (4) in all frames without outliers."""
    check_learnable(rig)
    if not rig.is_measured:
        raise ValueError("rig: Eq. (4) needs all positions, got none; use learn_cameras")
    unknowns, views = Unknowns.of(rig), np.stack(check_views(tracks, rig))
    if not unknowns.any:
        return rig
    if unknowns.unplaced.size:
        raise ValueError(
            f"rig: Eq. (4) needs all positions, got none of {names(unknowns.unplaced)}; use "
            "learn_cameras"
        )
    if not all_orthographic(rig.cameras):
        raise ValueError("rig: Eq. (4) needs orthographic cameras, got a perspective one")
    others = [rig.cameras[i] for i in unknowns.uncalibrated]
    if not independent(others):
        raise ValueError(
            "rig: Eq. (4) needs two independent normals among the uncalibrated cameras, got "
            f"{[camera.normal.tolist() for camera in others]}; use learn_cameras"
        )
    common = np.isfinite(views).all(axis=(0, 2), keepdims=True)
    every = agreement([*np.where(common, views, np.nan)], unknowns, _prediction)
    equations, _ = without_outliers(every, unknowns.scale)
    return Rig(calibrated(rig.cameras, unknowns.uncalibrated, method(equations, unknowns)))


def _prediction(cameras: Sequence[Camera]) -> Floats:
    """Columns Q of Eq. (4): R^-_known pinv(R^-_unknown) y_unknown - y_known = 0."""
    known, unknown = (
        np.vstack([c.rows for c in cameras if c.is_calibrated == flag]) for flag in (True, False)
    )
    flags = np.repeat([c.is_calibrated for c in cameras], 2)
    columns = np.zeros((len(flags), len(known)))
    columns[~flags] = (known @ np.linalg.pinv(unknown)).T
    columns[flags] = -np.eye(len(known))
    return columns


def _closed(equations: Equations, unknowns: Unknowns) -> Complex:
    """s exp(i theta) by linear least squares."""
    return solve(equations, unknowns)[0]


def _descended(equations: Equations, unknowns: Unknowns) -> Complex:
    """s exp(i theta) by L-BFGS."""
    _closed(equations, unknowns)  # or an error
    import torch  # slow to import, and only this comparison needs it

    unit = np.abs(equations.design).mean()  # makes the unknowns of order one
    design = torch.tensor(equations.design / unit)
    target = torch.tensor(equations.target / (unit * unknowns.scale))
    start = torch.tensor([[1.0, 0.0]] * unknowns.uncalibrated.size, dtype=torch.float64)
    scale, angle = (column.clone().requires_grad_() for column in start.T)
    optimiser = torch.optim.LBFGS(
        [scale, angle],
        max_iter=500,
        tolerance_grad=1e-15,
        tolerance_change=1e-18,
        line_search_fn="strong_wolfe",
    )

    def loss() -> torch.Tensor:
        optimiser.zero_grad()
        turned = torch.stack((scale * torch.cos(angle), scale * torch.sin(angle)), dim=1)
        value = torch.mean((design @ turned.ravel() - target) ** 2)
        value.backward()
        return value

    optimiser.step(loss)
    return unknowns.scale * scale.detach().numpy() * np.exp(1j * angle.detach().numpy())
