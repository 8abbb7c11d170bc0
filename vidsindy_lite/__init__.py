"""Governing equations of a moving target from the videos of several cameras.

::

    video files --vision--> pixel tracks --cameras--> path in space --dynamics--> equations
                                                      and its errors
    `------------------ observation ------------------'
    `----------------------------------- pipeline ------------------------------------'

`discover_from_videos` goes all the way, and `discover_from_video` of one camera, where the motion
is in a plane; each room can be used by itself. The paper's world
(benchmark systems, trials, baselines, scores) is `vidsindy_lite.study`, what turns the notebooks
into figures and pages is `vidsindy_lite.companion`.
"""

from .cameras import (
    Camera,
    OrthographicCamera,
    PerspectiveCamera,
    Rig,
    align,
    learn_cameras,
    learn_lags,
    reconstruct,
    residuals,
    rig_template,
)
from .dynamics import (
    Discovery,
    Library,
    PolynomialSystem,
    discover,
    on_circle,
    on_sphere,
)
from .observation import Observation, observe, observe_tracks
from .pipeline import VideoDiscovery, discover_from_tracks, discover_from_videos
from .plane import PlaneDiscovery, discover_from_video
from .vision import (
    Hint,
    Scene,
    read_frame,
    read_video,
    render_video,
    track,
    write_video,
)

__version__ = "0.2.0"

__all__ = [
    "discover_from_videos",
    "discover_from_tracks",
    "VideoDiscovery",
    "discover_from_video",
    "observe",
    "observe_tracks",
    "Observation",
    "track",
    "Hint",
    "read_video",
    "read_frame",
    "write_video",
    "render_video",
    "Scene",
    "align",
    "learn_lags",
    "Camera",
    "OrthographicCamera",
    "PerspectiveCamera",
    "Rig",
    "rig_template",
    "learn_cameras",
    "reconstruct",
    "residuals",
    "discover",
    "on_circle",
    "on_sphere",
    "Discovery",
    "Library",
    "PolynomialSystem",
]
