"""Eq. (4) of the paper by itself, to compare `learn_cameras` with.

The views of the uncalibrated cameras predict those of the calibrated ones,
R^-_known pinv(R^-_unknown) y_unknown = y_known, in the frames in which all cameras see the target.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Floats
from .calibrate import (
    Complex,
    Equations,
    Unknowns,
    agreement,
    calibrated,
    check_learnable,
    names,
    solve,
)
from .models import Camera, independent
from .rig import Rig
from .triangulate import check_views


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
    unknowns, views = Unknowns.of(rig), check_views(tracks, rig)
    if not unknowns.any:
        return rig
    if unknowns.unplaced.size:
        raise ValueError(
            f"rig: Eq. (4) needs all positions, got none of {names(unknowns.unplaced)}; use "
            "learn_cameras"
        )
    if not rig.is_orthographic:
        raise ValueError("rig: Eq. (4) needs orthographic cameras, got a perspective one")
    others = [rig.cameras[i] for i in unknowns.uncalibrated]
    if not independent(others):
        raise ValueError(
            "rig: Eq. (4) needs two independent normals among the uncalibrated cameras, got "
            f"{[camera.normal.tolist() for camera in others]}; use learn_cameras"
        )
    common = tuple(group for group in views.groups if len(group[0]) == len(rig.cameras))
    equations, _ = agreement(replace(views, groups=common), unknowns, _prediction)
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
    return solve(equations.design, equations.target, unknowns)[0]


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
