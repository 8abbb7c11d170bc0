"""Pixels and space: cameras, and what several of them that watch one target say of it.

::

    geometry      rotations and planes
    camera        what all cameras have in common: place, image, errors of what was measured
    models        the two models of camera: orthographic and perspective
    lens          what a lens does to the image: distortion
    rig           the cameras that watch one scene, and their file
    calibrations  rigs from files of other tools, and back
    unknowns      what is unknown of a rig, and linear equations for it
 1. synchronise   tracks -> when each camera started (`Lags`)
    timing        one fit of cameras and lags, and what it tells of the lags
    clocks        when the frames of each video were taken
    alignment     tracks at the same instants, whatever the lags, rates and clocks of the videos
    pairs         lags that are promising, from two views at a time
 2. calibrate     tracks -> the same `Rig`, with nothing unknown
 3. triangulate   tracks of a calibrated rig -> path in space, and by how much it misses them
 4. uncertainty   what errors of cameras, lags and codecs do to the path: systematic errors
    adjust        bundle adjustment: cameras, clocks, path together (`changes`: of what), `shutter`
    mistakes      views swapped, mirrored, upside down, of another rate, or with frames missing
    causes        why views do not agree, by trying one thing at a time
    unmeasured    rigs of which only the lenses are known: a start
    covariance    of errors that depend on their neighbours
    identities    beside the way: who is who among several targets
    messages      all warnings
    eq4           beside the way: calibration as the paper writes it, to compare

The other rooms import from here alone.
"""

from .alignment import Lags, align, list_lags
from .calibrate import calibration_errors, check_learnable, learn_cameras
from .clocks import Clock
from .calibrations import read_calibration
from .causes import GROSS, explain, smooth
from .eq4 import learn_cameras_eq4, learn_cameras_lbfgs
from .identities import identify, side_by_side, stacked
from .mistakes import find_mistake
from .geometry import plane_projection, plane_through, rodrigues, rotation_to_z, signed_distance
from .camera import Camera
from .models import OrthographicCamera, PerspectiveCamera
from .rig import Rig, rig_template
from .synchronise import learn_lags
from .timing import DISAGREEMENT
from .triangulate import disagreement, reconstruct, residuals
from .uncertainty import systematic_errors, trailing_errors
from .unmeasured import posed
