"""What may be wrong of a camera, as one vector of changes, and by how much each is known.

The vector holds two tilts of the normal and the in-plane angle (radians), the logarithm of the
scale, the position along the axes of the view plane and along its normal (scene units), the
principal point (pixels), k1, k2, p1, p2, the readout of the shutter (frames); and what no rig file
holds, but may be the reason why views do not agree: by how many frames the video is late, by how
many more at its end than at its start, and how near an orthographic camera is to what it sees (the
inverse of its distance; zero is infinitely far).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats
from .camera import Camera, frozen
from .lens import USUAL
from .models import OrthographicCamera, PerspectiveCamera

PARTS = {
    "normal": slice(0, 2),
    "angle": slice(2, 3),
    "scale": slice(3, 4),
    "position": slice(4, 7),
    "principal point": slice(7, 9),
    "distortion": slice(9, 13),
    "readout": slice(13, 14),
    "lag": slice(14, 15),
    "drift": slice(15, 16),
    "nearness": slice(16, 17),
}
"""Which components of the vector belong to what."""

SIZE = 17
_LARGEST = 50.0  # logarithm of a scale: a step that leads there is not taken
_TANGENTIAL = 0.1  # p1 and p2 of a lens, in units of k1


def known_to(given: Camera) -> Floats:
    """Standard errors of a camera of a rig: zero what is exact, infinite what is to be learned."""
    errors = np.zeros(SIZE)
    errors[PARTS["normal"]] = np.deg2rad(given.normal_error)
    errors[PARTS["angle"]] = np.deg2rad(given.normal_error) if given.is_calibrated else np.inf
    errors[PARTS["scale"]] = given.scale_error if given.is_calibrated else np.inf
    errors[PARTS["position"]] = given.position_error if given.is_placed else np.inf
    if isinstance(given, OrthographicCamera):
        errors[PARTS["position"]][2] = 0.0  # it sees the same from anywhere on its axis
    errors[PARTS["principal point"]] = given.principal_point_error
    if isinstance(given, PerspectiveCamera):
        errors[PARTS["distortion"]] = given.distortion_error * np.array(
            [1, 1, _TANGENTIAL, _TANGENTIAL]
        )
    errors[PARTS["readout"]] = given.readout_error
    return errors


@dataclass(frozen=True, eq=False, kw_only=True)
class NearCamera(OrthographicCamera):
    """What an orthographic camera would be that is not infinitely far from the point `about`."""

    about: Floats
    nearness: float = 0.0

    @property
    def _last_row(self) -> Floats:
        away = self.nearness * self.normal
        return np.append(-away, 1 + away @ self.about)


def units(width: float, image: float) -> Floats:
    """Sizes of changes that matter about equally, for a scene and an image of these widths."""
    sizes = np.ones(SIZE)
    sizes[PARTS["position"]] = width
    sizes[PARTS["principal point"]] = image
    sizes[PARTS["nearness"]] = 1 / width
    return sizes


def changed(camera: Camera, change: Floats) -> Camera:
    """A calibrated camera after a change; lag and drift are none of its own."""
    part = {name: change[place] for name, place in PARTS.items()}
    values: dict[str, Any] = {}
    if part["normal"].any():
        normal = camera.normal + part["normal"] @ camera.rows
        values["normal"] = frozen(normal / np.linalg.norm(normal))
    if part["position"].any() and camera.position is not None:
        axes = np.vstack((camera.rows, camera.normal))
        values["position"] = frozen(camera.position + part["position"] @ axes)
    if part["principal point"].any():
        values["principal_point"] = frozen(camera.centre + part["principal point"])
    if part["distortion"].any() and isinstance(camera, PerspectiveCamera):
        before = np.zeros(USUAL) if camera.distortion is None else camera.distortion
        step = np.pad(part["distortion"], (0, len(before) - len(part["distortion"])))
        values["distortion"] = frozen(before + step)
    if part["readout"].any():
        values["readout"] = float(np.clip(camera.readout + part["readout"][0], -1, 1))
    if part["nearness"].any() and isinstance(camera, NearCamera):
        values["nearness"] = camera.nearness + part["nearness"][0]
    moved = camera.moved(**values) if values else camera
    if part["angle"].any() or part["scale"].any():
        scale, angle = camera.calibration
        grown = np.clip(part["scale"][0], -_LARGEST, _LARGEST)
        moved = moved.calibrated(scale * np.exp(grown + 1j * (angle + part["angle"][0])))
    return moved
