"""Systematic errors of the path, (k, n, 3), from cameras and lags that are learned but not exact.

A wrong angle of 1e-4 turns the whole path by about as much: an error far below the noise of a
frame, but shared by all frames, so that it does not average out. A law fitted to such a path has
small terms that the true one has not. `discover` takes such errors into account if it is told them.

The covariance of what was learned does not rest on independent errors of the tracks, which
compression makes similar from frame to frame (`adjust`). A direction that the tracks tell
nothing of, such as a turn of the whole rig, is as uncertain as the measurements leave it.

The tracks themselves may share an error, too: see `trailing_errors`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Floats
from .adjust import PARTS, fitted_factor, known_to, linearised
from .alignment import Curve, Footage, Lags, check_clocks
from .rig import Rig
from .sight import points_of_views, residuals_of_views, views_of
from .triangulate import check_calibrated, check_views

_TRAIL = 0.5  # of the tracks' noise; mp4v made up to .6 of it, Motion JPEG .1


def systematic_errors(tracks: Sequence[Floats], rig: Rig, learned: Rig, lags: Lags) -> Floats:
    """Errors of the reconstructed path that come from what was learned of cameras and lags.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n_i, 2)
        As the videos show them, each from its own first frame.
    rig, learned : Rig
        Before and after `learn_cameras`.
    lags : Lags
        Lags and rates with a standard error of zero or infinity are taken as they are.

    Returns
    -------
    ndarray, shape (k, n, 3)
        Scene units; what k independent causes, each off by one standard error, add to the path.
        Zero where nothing can be reconstructed.
    """
    errors = np.array([known_to(camera) for camera in rig.cameras])
    moving = (lags.errors > 0) & np.isfinite(lags.errors)
    errors[moving, PARTS["lag"]] = errors[lags.rate_errors > 0, PARTS["drift"]] = np.inf
    clocks = check_clocks(lags.clocks or None, tracks)
    curves = tuple(map(Curve, tracks, clocks))
    footage = Footage(curves, clocks[0], lags.frames, lags.rates)
    near = linearised(footage, learned.cameras, errors)
    factor = fitted_factor(*near.weighed, near.prior, near.noise)
    modes = np.einsum("ik,nji->knj", factor, near.path_slopes)
    if not rig.note:
        return modes
    still = views_of(footage.aligned, learned.cameras)
    return _of_shape(modes, points_of_views(still, learned.cameras))


def _of_shape(modes: Floats, x: Floats) -> Floats:
    """Modes, (k, n, 3), without moves and stretches of the whole path x, (n, 3).

    Of a rig that nobody measured the path is the frame: its middle is the origin, and how far two
    cameras are apart the unit of length.
    """
    seen = np.asarray(np.isfinite(x).all(axis=1))
    centred = np.where(seen[:, None], x - x[seen].mean(axis=0), 0.0)
    moves = [seen[:, None] * axis for axis in np.eye(3)]
    frame, _ = np.linalg.qr(np.reshape([*moves, centred], (4, -1)).T)
    flat = modes.reshape(len(modes), -1)
    return (flat - flat @ frame @ frame.T).reshape(modes.shape)


def trailing_errors(
    tracks: Sequence[Floats], rig: Rig, motion: Sequence[Floats] | None = None
) -> Floats:
    """Errors of the reconstructed path if tracks stay a constant distance behind the motion.

    A codec that codes changes leaves out the smallest ones, so that a trace of the target stays
    where it just was, and the track behind. The residuals show little of it, because all views do
    it alike; so it is allowed for in proportion to the noise that they do show.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2)
        One per camera, at the same instants.
    rig : Rig
        All cameras calibrated.
    motion : sequence of ndarray, shape (n, 2), optional
        The tracks without their noise; by default the tracks themselves.

    Returns
    -------
    ndarray, shape (m, n, 3)
        Scene units; what the trail of each camera, one standard deviation long, adds to the path.
        Zero where nothing can be reconstructed.
    """
    check_calibrated("rig", rig)
    views = check_views(tracks, rig)
    x = points_of_views(views, rig.cameras)
    missed = np.hstack(residuals_of_views(views, rig.cameras))
    count = missed.shape[1]
    missed = np.abs(missed[np.isfinite(missed)])
    noise = 1.4826 * np.median(missed) * np.sqrt(count / (count - 3)) if missed.size else 0.0
    modes = []
    for i, track in enumerate(views.tracks):
        step = np.gradient(track if motion is None else motion[i], axis=0)
        # Noise has no direction: the trail ends where the target moves by less than that.
        length = np.sqrt((step**2).sum(axis=1, keepdims=True) + noise**2)
        trail = _TRAIL * noise * np.nan_to_num(step / np.maximum(length, 1e-300))
        moved = replace(views, tracks=(*views.tracks[:i], track - trail, *views.tracks[i + 1 :]))
        modes.append(points_of_views(moved, rig.cameras) - x)
    return np.nan_to_num(np.array(modes))
