"""What is unknown of the cameras of a rig, as one vector that a search varies or an error moves.

The vector holds log s + i theta of each camera that is not calibrated, then the in-plane offset of
each without a position, over the width of what the calibrated cameras see: all of order one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints
from .models import Camera
from .rig import Rig

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Unknowns:
    """Which cameras are not calibrated (`turns`) and which not placed (`loose`), and their units.

    `scale` is the mean scale of the calibrated cameras, `width` the mean width of what they see.
    """

    cameras: tuple[Camera, ...]
    turns: Ints
    loose: Ints
    scale: float
    width: float

    @classmethod
    def of(cls, rig: Rig) -> Unknowns:
        """Of a rig with at least one calibrated camera."""
        known = [(c, c.calibration[0]) for c in rig.cameras if c.is_calibrated]
        return cls(
            rig.cameras,
            np.flatnonzero([not camera.is_calibrated for camera in rig.cameras]),
            np.flatnonzero([not camera.is_placed for camera in rig.cameras]),
            float(np.mean([scale for _, scale in known])),
            float(np.mean([scale * camera.image_size[0] for camera, scale in known])),
        )

    @property
    def any(self) -> bool:
        """Whether anything is unknown."""
        return bool(self.turns.size or self.loose.size)

    def vector(self, turned: Complex, offsets: Floats) -> Floats:
        """The vector of s exp(i theta), (u,), and offsets, (v, 2)."""
        return np.concatenate((np.log(turned).view(float), (offsets / self.width).ravel()))

    def read(self, learned: Sequence[Camera]) -> Floats:
        """The vector of cameras of which nothing is unknown."""
        pairs = [learned[i].calibration for i in self.turns]
        turned = np.array([scale * np.exp(1j * angle) for scale, angle in pairs], complex)
        offsets = np.array([learned[i].offset for i in self.loose])
        return self.vector(turned, offsets.reshape(-1, 2))

    def filled(self, vector: Floats) -> tuple[Camera, ...]:
        """The cameras with all that is unknown taken from a vector."""
        logs, offsets = np.split(vector, [2 * self.turns.size])
        cameras = list(self.cameras)
        for i, offset in zip(self.loose, offsets.reshape(-1, 2) * self.width, strict=True):
            cameras[i] = cameras[i].placed(offset)
        return calibrated(cameras, self.turns, np.exp(logs.copy().view(complex)))


def calibrated(
    cameras: Sequence[Camera], indices: Iterable[int], turned: Iterable[complex]
) -> tuple[Camera, ...]:
    """The cameras with s exp(i theta) written into some of them."""
    values = dict(zip(indices, turned, strict=True))
    return tuple(c.calibrated(values[i]) if i in values else c for i, c in enumerate(cameras))


def names(indices: Iterable[int]) -> str:
    """Cameras as errors call them."""
    return " and ".join(f"cameras[{i}]" for i in indices)
