"""The public names, each imported when it is first used."""

from .cameras import Camera as Camera
from .cameras import OrthographicCamera as OrthographicCamera
from .cameras import PerspectiveCamera as PerspectiveCamera
from .cameras import Rig as Rig
from .cameras import align as align
from .cameras import learn_cameras as learn_cameras
from .cameras import learn_lags as learn_lags
from .cameras import reconstruct as reconstruct
from .cameras import residuals as residuals
from .cameras import rig_template as rig_template
from .dynamics import Discovery as Discovery
from .dynamics import Library as Library
from .dynamics import PolynomialSystem as PolynomialSystem
from .dynamics import discover as discover
from .dynamics import on_circle as on_circle
from .dynamics import on_sphere as on_sphere
from .pipeline import Observation as Observation
from .pipeline import VideoDiscovery as VideoDiscovery
from .pipeline import discover_from_tracks as discover_from_tracks
from .pipeline import discover_from_videos as discover_from_videos
from .pipeline import observe as observe
from .pipeline import observe_tracks as observe_tracks
from .plane import discover_from_video as discover_from_video
from .vision import Hint as Hint
from .vision import Scene as Scene
from .vision import read_frame as read_frame
from .vision import read_video as read_video
from .vision import render_video as render_video
from .vision import track as track
from .vision import write_video as write_video

__version__: str
