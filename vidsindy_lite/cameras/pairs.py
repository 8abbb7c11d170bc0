"""Two views at a time: promising lags and rough cameras, by equations that are linear.

The epipolar equation between a calibrated camera and another one (`triangulate.epipolar_lines`) is
linear in (s cos theta, s sin theta) of the other. How far it is from holding is solved at all whole
lags at once, and a second time with a shift of the other image, which takes up most of what a badly
measured normal or position does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..arrays import Floats
from .alignment import Curve
from .camera import Camera
from .models import all_orthographic
from .triangulate import TRIMMED, Views, epipolar_equations, epipolar_lines, epipolar_rows
from .unknowns import Unknowns, agreement, calibrated

_OVERLAP = 0.5  # share of the shorter of two videos that both must show
_INSTANTS = 300  # at which two views are compared
_BLOCK = 200_000  # pairs of a lag and an instant at a time
_PROMISING = 4  # lags of each camera, with and without a shift
_NEAR = 4.0  # frames
_ROUNDS = 5  # of leaving the others out
_BETTER_PART = 0.7  # of all equations, in which there is no outlier


def rough_cameras(views: Views, unknowns: Unknowns) -> tuple[Camera, ...] | None:
    """Cameras to start a search from, however badly they fit; None if there is no telling.

    What learning asks for, that the motion determines a camera and that no view contradicts it, is
    not asked for here: it would not hold at a wrong lag, nor with a wrong normal.
    """
    cameras = unknowns.cameras
    if not unknowns.any:
        return cameras
    turns = unknowns.uncalibrated
    if all_orthographic(cameras):
        equations, _ = agreement(views, unknowns)
        if len(equations.design) <= equations.design.shape[1]:
            return None
        solution = np.linalg.lstsq(equations.design, equations.target)[0]
        turned = solution[: 2 * len(turns)].view(complex)
        widths = np.array([cameras[i].image_size[0] for i in unknowns.unplaced])
        offsets = solution[2 * len(turns) :].reshape(-1, 2) * widths[:, None] / 2
        return unknowns.filled(turned, offsets) if turned.all() else None
    for i in turns:
        one = _turned(views, cameras, int(i))
        if one == 0:
            return None
        cameras = calibrated(cameras, [i], [one])
    return cameras


def _turned(views: Views, cameras: Sequence[Camera], i: int) -> complex:
    """s exp(i theta) of a camera from those that are calibrated; zero if there is no telling."""
    design, target = epipolar_equations(cameras, views.tracks, i)
    fits = np.ones(len(target), bool)
    turned = 0j
    for _ in range(_ROUNDS):
        if fits.sum() <= 4:
            break
        solution = np.linalg.lstsq(design[fits], target[fits])[0]
        missed = np.abs(design @ solution - target)
        fits, turned = missed <= np.quantile(missed, _BETTER_PART), complex(*solution)
    return turned


def promising_lags(curves: Sequence[Curve], rates: Floats, unknowns: Unknowns) -> list[list[float]]:
    """Whole lags of each camera behind the first calibrated one, the most promising first."""
    known = unknowns.known
    found = []
    for lags, missed in lag_misses(curves, rates, unknowns):
        choices = [_dips(lags, part)[:_PROMISING] for part in missed]
        found.append(_apart(np.concatenate(choices)).tolist() or [0.0])
    return [*found[:known], [0.0], *found[known:]]


def lag_misses(
    curves: Sequence[Curve],
    rates: Floats,
    unknowns: Unknowns,
    most: int = _INSTANTS,
    shifts: Sequence[bool] = (False, True),
) -> Iterator[tuple[Floats, Floats]]:
    """Of each camera but the first calibrated one, all whole lags (k,) and `pair_missed` at these.

    The misses are those without and with a shift, at so many instants at most.
    """
    known = unknowns.known
    frames = curves[known].clock
    frames = frames[:: max(1, len(frames) // most)]
    ends = np.array([curve.clock[-1] + 1 for curve in curves]) / rates  # on the first one's clock
    for other in range(len(curves)):
        if other == known:
            continue
        margin = _OVERLAP * min(ends[known], ends[other])
        lags = np.arange(np.ceil(margin - ends[other]), ends[known] - margin + 1)
        first, second = unknowns.cameras[known], unknowns.cameras[other]
        placed = first.is_placed and second.is_placed
        near, far = (c if c.is_placed else c.placed(np.zeros(2)) for c in (first, second))
        lines = epipolar_lines(near, curves[known].at(frames), far)
        instants, rate = frames / rates[known], rates[other]
        missed = []
        for block in np.array_split(lags, int(np.ceil(lags.size * frames.size / _BLOCK))):
            theirs = curves[other].at((instants - block[:, None]) * rate)
            missed.append([pair_missed(second, placed, lines, theirs, shift) for shift in shifts])
        yield lags, np.concatenate(missed, axis=1)


def _dips(lags: Floats, missed: Floats) -> Floats:
    """The lags of the minima, the lowest first."""
    padded = np.concatenate(([np.inf], missed, [np.inf]))
    dips = np.flatnonzero((missed <= padded[:-2]) & (missed <= padded[2:]) & np.isfinite(missed))
    return _apart(lags[dips[np.argsort(missed[dips])]])


def _apart(lags: Floats) -> Floats:
    """Those that no earlier one is close to: a search goes to the best within a few frames."""
    kept: list[float] = []
    for lag in lags:
        if all(abs(lag - other) >= _NEAR for other in kept):
            kept.append(lag)
    return np.array(kept)


def pair_missed(
    other: Camera, placed: bool, lines: tuple[Floats, Floats], theirs: Floats, shift: bool
) -> Floats:
    """By how much its pixels, (k, n, 2), miss the epipolar lines at best, (k,), scene units rms.

    `placed` says whether both positions are known, `shift` whether the image may be shifted. One
    instant in ten is left out. Infinite where too few are left.
    """
    design, target = epipolar_rows(lines, other, theirs)
    if other.is_calibrated:
        scale, angle = other.calibration
        design, target = (
            design[..., :0],
            target - design @ [scale * np.cos(angle), scale * np.sin(angle)],
        )
    extra = lines[0] if shift else np.ones((len(lines[0]), 1)) if not placed else lines[0][:, :0]
    extra = np.broadcast_to(extra, (*target.shape, extra.shape[1]))
    design = np.concatenate((design, extra), axis=-1)
    seen = np.isfinite(target) & np.isfinite(design).all(axis=-1)
    design, target = np.where(seen[..., None], design, 0), np.where(seen, target, 0)
    size = np.abs(design).max(axis=(0, 1), initial=0, keepdims=True)
    design = design / np.where(size > 0, size, 1)
    fits, unknown = seen, design.shape[-1]
    for _ in range(2):
        used = np.where(fits[..., None], design, 0)
        square = used.swapaxes(-1, -2) @ used
        right = np.einsum("kni,kn->ki", used, np.where(fits, target, 0))
        solution = np.einsum(
            "kij,kj->ki", np.linalg.pinv(square, rcond=1e-10, hermitian=True), right
        )
        missed = np.where(seen, np.abs(np.einsum("kni,ki->kn", design, solution) - target), np.nan)
        enough = fits.sum(axis=1) > 2 * unknown
        limit = np.nanquantile(np.where(enough[:, None], missed, 0), TRIMMED, axis=1)
        fits = seen & (missed <= limit[:, None])
    total = np.sum(np.where(fits, missed, 0) ** 2, axis=1)
    return np.where(enough, np.sqrt(total / np.maximum(fits.sum(axis=1), 1)), np.inf)
