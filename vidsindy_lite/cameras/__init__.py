"""Pixels and space: cameras, and what several of them that watch one target say of it.

::

    models        the two models of camera, lens and shutter, rotations and planes
    rig           the cameras that watch one scene, and their file
    calibrations  rigs from the files of other tools
    sight         lines of sight: where they meet, and what each says of the other cameras
    alignment     tracks at the same instants, whatever the lags, rates and clocks of the videos
    factorise     cameras of which nothing is known, and the path up to an affine map
 1. synchronise   tracks -> when each camera started (`Lags`)
 2. calibrate     tracks -> the same `Rig`, with nothing unknown
 3. triangulate   tracks of a calibrated rig -> path in space, and by how much it misses them
 4. uncertainty   what errors of cameras, lags and codecs do to the path: systematic errors
    adjust        bundle adjustment: cameras, clocks and path together, and their covariance
    causes        why views do not agree, by freeing one thing at a time
    mistakes      views swapped, mirrored, upside down, of another rate, or with frames missing
    identities    who is who among several targets
    eq4           calibration as the paper writes it, to compare

The other rooms import from here alone.
"""

from .alignment import Clock, Lags, align, list_lags
from .calibrate import calibration_errors, check_learnable, learn_cameras, posed
from .calibrations import read_calibration
from .causes import explain, smooth
from .eq4 import learn_cameras_eq4, learn_cameras_lbfgs
from .factorise import Factorised, factorised
from .identities import identify, side_by_side, stacked
from .mistakes import find_mistake
from .models import AffineCamera, Camera, OrthographicCamera, PerspectiveCamera
from .models import plane_projection, plane_through, rodrigues, rotation_to_z, signed_distance
from .rig import Rig, rig_template
from .synchronise import learn_lags
from .triangulate import ALIKE, DISAGREEMENT, GROSS, disagreement, reconstruct, residuals
from .uncertainty import systematic_errors, trailing_errors
