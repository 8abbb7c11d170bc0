"""Triangulation: from tracks to the path in space, and back to residuals in pixels.

Paper: Eq. (6).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Floats
from ..checks import check_instance, check_tracks
from .rig import Rig
from .sight import Views, points_of_views, residuals_of_views, trimmed, views_of

DISAGREEMENT = 1.0
"""Pixels by which a good rig misses at most one frame in ten; even whole-pixel tracks are missed by
less than half of that."""
ALIKE = 2.0
"""Ratio of residuals up to which two explanations fit equally well, ..."""
FINE = 0.05
"""... and residual in pixels below which all do: real tracks are no better than that."""
GROSS = 4.0
"""Pixels; real calibrations of real tracks leave up to half of that."""


def reconstruct(tracks: Sequence[Floats], rig: Rig) -> Floats:
    """3D trajectory from the tracks of a calibrated rig, by least squares in pixels.

    Paper: Eq. (6), whose "inverse" of a 6 x 3 matrix is the least-squares solution; here with any
    number of cameras, of either model, and each view weighted so that all count in pixels.

    Every frame is taken as it is: an outlier of one track moves the point. Three views show it as
    a large residual of that frame (see `residuals`), two views cannot.

    Parameters
    ----------
    tracks : sequence of array_like, shape (n, 2)
        One track per camera of the rig; NaN = not seen.
    rig : Rig
        All cameras calibrated.

    Returns
    -------
    ndarray, shape (n, 3)
        Scene units; NaN where fewer than two cameras see the target, where all that do look along
        the same line, or where the lines of sight meet behind a perspective camera.

    Raises
    ------
    ValueError
        If the tracks do not match the rig or a camera is not calibrated.
    """
    check_calibrated("rig", rig)
    return points_of_views(check_views(tracks, rig), rig.cameras)


def residuals(tracks: Sequence[Floats], rig: Rig) -> list[Floats]:
    """Reprojection residuals: by how many pixels the reconstructed target misses each track.

    Parameters
    ----------
    tracks : sequence of array_like, shape (n, 2)
        One track per camera of the rig; NaN = not seen.
    rig : Rig
        All cameras calibrated.

    Returns
    -------
    list of ndarray, shape (n, 2)
        Track minus projection, pixels, one array per camera; NaN where the camera does not see
        the target or it cannot be reconstructed. Of the six numbers of a frame three are used up
        by the point itself, so pixel noise of standard deviation sigma leaves sigma / sqrt(2).

    Raises
    ------
    ValueError
        If the tracks do not match the rig or a camera is not calibrated.
    """
    check_calibrated("rig", rig)
    return residuals_of_views(check_views(tracks, rig), rig.cameras)


def disagreement(tracks: Sequence[Floats], rig: Rig) -> list[float]:
    """Residual in pixels that one frame in ten exceeds, per camera.

    That tenth may hold anything: a few outliers of the tracker do not accuse the rig.

    Parameters
    ----------
    tracks, rig
        See `residuals`.

    Returns
    -------
    list of float
        Pixels; zero for a camera that takes part in no point.
    """
    return [trimmed(part) for part in residuals(tracks, rig)]


def check_seen(tracks: Sequence[Floats], rig: Rig) -> list[Floats]:
    """That there is one track per camera of the rig, each of which sees the target."""
    check_instance("rig", rig, Rig)
    checked = check_tracks(tracks, len(rig.cameras))
    for i, track in enumerate(checked):
        if np.isnan(track).any(axis=1).all():
            raise ValueError(f"tracks[{i}]: must see the target in some frame, got only NaN rows")
    return checked


def check_views(tracks: Sequence[Floats], rig: Rig) -> Views:
    """That the tracks fit the rig, and each other in length."""
    checked = check_seen(tracks, rig)
    lengths = [len(track) for track in checked]
    if len(set(lengths)) > 1:
        raise ValueError(f"tracks: must have the same number of frames, got {lengths}")
    return views_of(checked, rig.cameras)


def check_calibrated(name: str, rig: Rig) -> None:
    """That scale, angle and position of all cameras are known."""
    check_instance(name, rig, Rig)
    for i, camera in enumerate(rig.cameras):
        known = {"scale and angle": camera.is_calibrated, "position": camera.is_placed}
        for what, given in known.items():
            if not given:
                raise ValueError(
                    f"{name}: all cameras must be calibrated and placed, got cameras[{i}] without "
                    f"{what}; learn_cameras finds them, as the command discover does, which writes "
                    "them to rig.toml in its report"
                )
