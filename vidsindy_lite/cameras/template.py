"""Rig files to start from: cameras around a scene, with a comment on every value."""

import numpy as np

from ..checks import check_image_size, check_integer
from .models import MODELS

_HEAD = """\
# Rig file: one [[camera]] table per video, in the order of the videos.
# Choose an origin, axes and a unit of length (here: metres) and replace every number.
# Cameras stand still. What is left out is learned from the videos, but for one camera at least
# scale and angle must be given.
"""
_SCALES = {
    "orthographic": "scale = 0.005    # scene units per pixel: length of an object over its pixels",
    "perspective": "scale = 0.001    # one over the focal length in pixels",
}
_POSITIONS = {
    "orthographic": "# of the camera, or a landmark in the middle of its image",
    "perspective": "# of the camera: of its pinhole, near the lens",
}
_ANGLE = """\
angle = {angle:.3f}    # radians: for this normal and the z axis upright in the image; add how
                  # far the z axis is turned anticlockwise there"""


def rig_template(
    cameras: int = 3, model: str = "orthographic", image_size: tuple[int, int] = (1920, 1080)
) -> str:
    """Text of a rig file, to be filled in with what was measured.

    Parameters
    ----------
    cameras : int
        At least two, evenly around the scene, looking 20 degrees down on its origin from a distance
        of three units.
    model : {"orthographic", "perspective"}
        Of all cameras.
    image_size : tuple of int
        Width and height of the videos in pixels.

    Returns
    -------
    str
        A file that `Rig.load` reads.

    Raises
    ------
    ValueError
        If an argument breaks its rule.
    """
    check_integer("cameras", cameras, 2)
    if model not in MODELS:
        raise ValueError(f"model: must be one of {', '.join(MODELS)}, got {model!r}")
    width, height = check_image_size(image_size)
    parts = [_HEAD]
    for i in range(cameras):
        # Of two cameras, one is a third of a turn from the other: face to face both see the same.
        azimuth = 2 * np.pi * i / max(cameras, 3) + np.deg2rad(20)
        elevation = np.deg2rad(20)
        across = np.array([np.cos(azimuth), np.sin(azimuth), 0])
        normal = np.cos(elevation) * across + [0, 0, np.sin(elevation)]
        lines = ["[[camera]]"]
        if model != "orthographic":
            lines.append(f'model = "{model}"')
        lines += [
            f"position = {_vector(3 * normal)}    {_POSITIONS[model]}",
            f"normal = {_vector(normal)}    # from the scene to the camera; any length",
            f"image_size = [{width}, {height}]",
        ]
        if i == 0:
            angle = np.arctan2(-np.cos(azimuth), -np.sin(azimuth))
            lines += [_SCALES[model], _ANGLE.format(angle=angle)]
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def _vector(values: np.ndarray) -> str:
    return f"[{', '.join(f'{value:.3f}' for value in values)}]"
