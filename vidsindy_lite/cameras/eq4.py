"""Eq. (4) of the paper by itself, to compare `learn_cameras` with.

The views of the uncalibrated cameras predict those of the calibrated ones,
R^-_known pinv(R^-_unknown) y_unknown = y_known, in the frames in which all cameras see the target.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Floats, Ints
from .calibrate import check_learnable
from .models import independent
from .rig import Rig
from .triangulate import check_views
from .unknowns import Equations, Unknowns, agreement, calibrated, names, outliers, solve


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
    equations, unknowns = _equations(tracks, rig)
    if equations is None:
        return rig
    turned, _ = solve(equations.design, equations.target, unknowns)
    return Rig(calibrated(rig.cameras, unknowns.turns, turned))


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
    equations, unknowns = _equations(tracks, rig)
    if equations is None:
        return rig
    solve(equations.design, equations.target, unknowns)  # or an error
    import torch  # slow to import, and only this comparison needs it

    unit = np.abs(equations.design).mean()  # makes the unknowns of order one
    design = torch.tensor(equations.design / unit)
    target = torch.tensor(equations.target / (unit * unknowns.scale))
    scale = torch.ones(unknowns.turns.size, dtype=torch.float64, requires_grad=True)
    angle = torch.zeros(unknowns.turns.size, dtype=torch.float64, requires_grad=True)
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
    turned = unknowns.scale * scale.detach().numpy() * np.exp(1j * angle.detach().numpy())
    return Rig(calibrated(rig.cameras, unknowns.turns, turned))


def _equations(tracks: Sequence[Floats], rig: Rig) -> tuple[Equations | None, Unknowns]:
    """Eq. (4) in all frames without outliers; None if nothing is unknown."""
    check_learnable(rig)
    views = check_views(tracks, rig)
    unknowns = Unknowns.of(rig)
    if not unknowns.any:
        return None, unknowns
    if unknowns.loose.size:
        raise ValueError(
            f"rig: Eq. (4) needs all positions, got none of {names(unknowns.loose)}; use "
            "learn_cameras"
        )
    if not rig.is_orthographic:
        raise ValueError("rig: Eq. (4) needs orthographic cameras, got a perspective one")
    others = [rig.cameras[i] for i in unknowns.turns]
    if not independent(others):
        raise ValueError(
            "rig: Eq. (4) needs two independent normals among the uncalibrated cameras, got "
            f"{[camera.normal.tolist() for camera in others]}; use learn_cameras"
        )

    def prediction(indices: Ints) -> Floats | None:
        """Columns Q of Eq. (4): R^-_known pinv(R^-_unknown) y_unknown - y_known = 0."""
        if len(indices) < len(rig.cameras):
            return None
        known = np.vstack([c.rows for c in rig.cameras if c.is_calibrated])
        flags = np.repeat([not c.is_calibrated for c in rig.cameras], 2)
        columns = np.zeros((len(flags), len(known)))
        columns[flags] = (known @ np.linalg.pinv(np.vstack([c.rows for c in others]))).T
        columns[~flags] = -np.eye(len(known))
        return columns

    equations = agreement(views, unknowns, prediction)
    return equations.without(outliers(equations, unknowns.scale)[0]), unknowns
