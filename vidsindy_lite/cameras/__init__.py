"""Pixels and space: camera models, calibration, triangulation, synchronisation."""

from .calibrate import (
    Camera,
    Rig,
    calibration_errors,
    check_learnable,
    learn_cameras,
    learn_normal,
    reconstruct,
    residuals,
)
from .geometry import (
    plane_projection,
    plane_through,
    rodrigues,
    rotation_to_z,
    signed_distance,
)
from .perspective import PerspectiveCamera
from .synchronise import DISAGREEMENT, Synchrony, align, disagreement, learn_lags, list_lags
from .template import rig_template
from .uncertainty import systematic_errors, trailing_errors

__all__ = [
    "Camera",
    "DISAGREEMENT",
    "PerspectiveCamera",
    "Rig",
    "Synchrony",
    "align",
    "calibration_errors",
    "check_learnable",
    "disagreement",
    "learn_cameras",
    "learn_lags",
    "learn_normal",
    "list_lags",
    "plane_projection",
    "plane_through",
    "reconstruct",
    "residuals",
    "rig_template",
    "rodrigues",
    "rotation_to_z",
    "signed_distance",
    "systematic_errors",
    "trailing_errors",
]
