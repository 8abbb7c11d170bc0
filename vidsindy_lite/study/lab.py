"""The lab experiment: a ball rolls on a table, three perspective cameras film it.

The paper's footage is not public, nor are the places of its cameras. What it does say is here:
origin at a corner of the table, three straight paths, one calibrated camera, and one point, the
true and the identified one. The rest is a table-top scene of ordinary size; the videos are
rendered. The point's height is that of the centre of a ball of 52.5 mm, a snooker ball.

All lengths are in millimetres.

Paper: Appendix "Lab Experiment on Trajectory Extraction".
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..arrays import Floats
from ..cameras import (
    OrthographicCamera,
    PerspectiveCamera,
    Rig,
    calibration_errors,
    rotation_to_z,
)
from ..observation import Observation, observe_tracks
from ..vision import Scene, render_video, track
from .films import TOGETHER
from .published import LAB

MARKED = np.array(LAB.truth)  # where the paper compares
IDENTIFIED = np.array(LAB.found)  # what it finds there
RADIUS = float(MARKED[2])  # a ball on the table has its centre there
MIDDLE = np.array([350.0, 350.0, 0.0])  # of the part of the table that the cameras look at
FPS = 25

# Where the ball is in the middle of each clip, and how fast, in the plane of the table (mm, mm/s).
# The first path goes through the marked point.
_PATHS = (
    (MARKED[:2], (50.0, 170.0)),
    ((430.0, 350.0), (-220.0, 130.0)),
    ((350.0, 450.0), (240.0, -80.0)),
)
_SLOWING = 60.0  # mm/s^2: rolling resistance of 0.6 % of the ball's weight


def paths(frames: int = 50) -> Floats:
    """Centre of the ball on three straight paths, on which it rolls and slows down.

    Parameters
    ----------
    frames : int
        Of each path, at `FPS` frames a second; the marked point is that of index frames // 2 on the
        first.

    Returns
    -------
    ndarray, shape (3, frames, 3)
        Millimetres, origin at the corner of the table.
    """
    t = (np.arange(frames)[:, None] - frames // 2) / FPS
    x = np.full((len(_PATHS), frames, 3), RADIUS)
    for path, middle_and_velocity in zip(x, _PATHS, strict=True):
        middle, velocity = np.array(middle_and_velocity)
        path[:, :2] = middle + (t - t**2 * _SLOWING / (2 * np.linalg.norm(velocity))) * velocity
    return x


def cameras(distance: float = 1.0) -> Rig:
    """Three perspective cameras around the table, all calibrated: the truth.

    Parameters
    ----------
    distance : float
        Factor on the distance from the table. The focal length grows with it, so that the table
        fills the images as before.

    Returns
    -------
    Rig
    """
    places = (
        (-80.0, 35.0, 1900.0, 1100.0, 3.0),
        (40.0, 30.0, 2200.0, 1250.0, -5.0),
        (160.0, 40.0, 2000.0, 1150.0, 8.0),
    )
    return Rig(
        tuple(_camera(a, e, distance * r, distance * f, roll) for a, e, r, f, roll in places)
    )


def random_cameras(rng: np.random.Generator) -> Rig:
    """Three cameras as someone else might have put them around the same table.

    Distances of 1.2 to 3 m, 20 to 50 degrees above the table, at least 60 degrees apart around it,
    rolled by up to 10 degrees; the focal lengths show as much of the table as `cameras` does.

    Parameters
    ----------
    rng : np.random.Generator

    Returns
    -------
    Rig
    """
    while True:
        azimuths = np.sort(rng.uniform(0, 360, 3))
        if np.diff(azimuths, append=azimuths[0] + 360).min() >= 60:
            break
    places = zip(rng.permutation(azimuths), rng.uniform(1200, 3000, 3), strict=True)
    return Rig(
        tuple(
            _camera(azimuth, rng.uniform(20, 50), reach, 0.575 * reach, rng.uniform(-10, 10))
            for azimuth, reach in places
        )
    )


def _camera(
    azimuth: float, elevation: float, reach: float, focal: float, roll: float
) -> PerspectiveCamera:
    """A camera that looks at the middle, seen from there in the given direction (degrees)."""
    a, e, roll = np.deg2rad([azimuth, elevation, roll])
    normal = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    up = rotation_to_z(normal)[:2, 2]  # the angle that shows it as up in the image, plus a roll
    return PerspectiveCamera(
        position=MIDDLE + reach * normal,
        normal=normal,
        scale=1 / focal,
        angle=np.arctan2(up[0], up[1]) + roll,
    )


def orthographic(rig: Rig) -> Rig:
    """The same rig as the paper's model has it: one pixel measures the same at every distance.

    Each camera is calibrated at the middle of the table.

    Parameters
    ----------
    rig : Rig
        Of calibrated perspective cameras.

    Returns
    -------
    Rig
        Of orthographic cameras.
    """
    return Rig(
        tuple(
            OrthographicCamera(
                position=c.position,
                normal=c.normal,
                scale=c.scale * (c.normal @ (c.position - MIDDLE)),
                angle=c.angle,
                image_size=c.image_size,
            )
            for c in rig.cameras
        )
    )


def orthographic_error(rig: Rig, flat: Rig, x: Floats) -> Floats:
    """First-order error of a path that orthographic cameras reconstruct from perspective images.

    A point that lies by delta nearer to the camera than the middle, at the distance D, is drawn
    larger by delta / D: away from the line of view by (delta / D) R^-(x - position). Scales and
    angles that were learned from such images are off as well, and shift it by
    (d s / s + d theta T(pi/2)) R^-(x - position). The error in space is the least-squares solution
    of these errors in the view planes.

    Parameters
    ----------
    rig : Rig
        Of calibrated perspective cameras.
    flat : Rig
        The orthographic cameras that reconstruct.
    x : ndarray, shape (n, 3)
        True path.

    Returns
    -------
    ndarray, shape (n, 3)
        Reconstructed minus true, for distances large against the size of the table.
    """
    rows, views = [], []
    wrong = calibration_errors(flat, orthographic(rig))
    for camera, (growth, turn) in zip(rig.cameras, wrong, strict=True):
        away = camera.normal @ (camera.position - MIDDLE)
        growth = growth + (x - MIDDLE) @ camera.normal / away
        across = (x - np.asarray(camera.position)) @ camera.rows.T
        pixel = camera.scale * away
        rows.append(camera.rows / pixel)
        views.append((growth[:, None] * across + turn * across[:, ::-1] * (1, -1)) / pixel)
    return np.hstack(views) @ np.linalg.pinv(np.vstack(rows)).T


def film_ball(rig: Rig, x: Floats, folder: str | Path, seed: int = 0) -> list[Floats]:
    """Film each path with every camera and track the ball.

    The ball is drawn as the ellipse that a perspective image of a ball is, in one colour: no
    highlight, no shadow, no motion blur, no image noise. The table behind it is a plain cloth.

    Parameters
    ----------
    rig : Rig
        Of calibrated perspective cameras.
    x : ndarray, shape (k, n, 3)
        Centre of the ball in each frame of each path.
    folder : path
        Where the videos go: path_1_camera_1.mov and so on.
    seed : int
        Draws the shade of the cloth.

    Returns
    -------
    list of ndarray, shape (k * n, 2)
        A track per camera, of one path after the other.
    """
    tracks = []
    for i, camera in enumerate(_perspective(rig)):
        scene = Scene(background="plain", image_size=camera.image_size)
        parts = []
        for k, path in enumerate(x):
            centroids, shapes = camera.ball_image(path, RADIUS)
            file = Path(folder) / f"path_{k + 1}_camera_{i + 1}.mov"
            number = len(rig.cameras) * seed + i  # all clips of one camera show the same cloth
            render_video(file, centroids, scene, FPS, number, 2 / scene.size * shapes)
            parts.append(track(file).pixels)
        tracks.append(np.vstack(parts))
    return tracks


def observe_ball(tracks: Sequence[Floats], rig: Rig) -> Observation:
    """Learn the cameras from centroids of a ball's images, which are not images of its centre.

    How far the two differ follows from the ball's radius and place (`ball_image`). So: observe,
    correct the tracks, and again; each round leaves about a thousandth of the error.

    Parameters
    ----------
    tracks : sequence of array_like, shape (n, 2)
        Centroids of the ball's images.
    rig : Rig
        Of perspective cameras, at least one calibrated.

    Returns
    -------
    Observation
        Of the centre of the ball, as `observe_tracks` makes it from the corrected tracks.
    """
    t = np.arange(len(tracks[0])) / FPS
    seen = observe_tracks(tracks, rig, t, lags=TOGETHER)
    for _ in range(2):
        corrected = [
            pixels - camera.ball_image(seen.x, RADIUS)[0] + camera.project(seen.x)
            for pixels, camera in zip(tracks, _perspective(seen.rig), strict=True)
        ]
        seen = observe_tracks(corrected, rig, t, lags=TOGETHER)
    return seen


def _perspective(rig: Rig) -> list[PerspectiveCamera]:
    """The cameras of a rig that has only such ones."""
    return [camera for camera in rig.cameras if isinstance(camera, PerspectiveCamera)]
