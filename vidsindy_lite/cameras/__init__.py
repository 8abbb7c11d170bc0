"""Pixels and space: cameras, and what several of them that watch one target say of it.

::

    models        the two models of camera, lens and shutter, and where their lines of sight meet
    rig           the cameras that watch one scene, and their files, ours and those of other tools
    clocks        tracks at the same instants, whatever the lags, rates and clocks of the videos
    adjust        bundle adjustment: cameras, clocks and path together; what else would explain them
    unmeasured    rigs of which nothing is known: where they stand, or a path up to an affine map
 1. calibrate     tracks -> the same `Rig`, with nothing unknown, and its systematic errors
 2. synchronise   tracks -> when each camera started (`Lags`), and mistakes in what is given
    targets       who is who among several targets

The other rooms import from here alone.
"""

from .adjust import explain, smooth
from .calibrate import calibration_errors, check_learnable, learn_cameras, learn_cameras_eq4
from .calibrate import systematic_errors, tracking_errors
from .clocks import Clock, Footage, Lags, align, list_lags
from .models import AffineCamera, Camera, OrthographicCamera, PerspectiveCamera, rotation_to_z
from .rig import BETTER, DISAGREEMENT, GROSS, Rig, disagreement, paced, read_calibration
from .rig import reconstruct, residuals, rig_template, without_view_outliers
from .synchronise import find_mistake, learn_lags
from .targets import identify, side_by_side, stacked
from .unmeasured import Factorised, factorised, posed
