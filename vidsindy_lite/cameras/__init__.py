"""Pixels and space: camera models, calibration, triangulation, synchronisation."""

from .calibrate import (
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
from .models import Camera, OrthographicCamera, PerspectiveCamera
from .synchronise import DISAGREEMENT, Lags, align, disagreement, learn_lags, list_lags
from .template import rig_template
from .uncertainty import systematic_errors, trailing_errors

__all__ = [
    "Camera",
    "OrthographicCamera",
    "DISAGREEMENT",
    "PerspectiveCamera",
    "Rig",
    "Lags",
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
