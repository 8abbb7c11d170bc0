"""Governing equations of a moving target from the videos of three cameras.

The modules stand in the order of the pipeline:
systems, cameras, perspective | video, tracking | ado (discovery) | pipeline | experiments, lab.
"""

from .ado import discover
from .cameras import Camera, Rig, learn_cameras, reconstruct, residuals
from .discovery import Discovery
from .metrics import Score, score
from .perspective import PerspectiveCamera
from .pipeline import VideoDiscovery, discover_from_videos
from .polynomials import PolynomialSystem
from .systems import REFERENCE_OFFSET, SYSTEMS, Benchmark
from .tracking import track
from .video import Scene, read_video, render_video, write_video

__all__ = [
    "REFERENCE_OFFSET",
    "SYSTEMS",
    "Benchmark",
    "Camera",
    "Discovery",
    "PerspectiveCamera",
    "PolynomialSystem",
    "Rig",
    "Scene",
    "Score",
    "VideoDiscovery",
    "discover",
    "discover_from_videos",
    "learn_cameras",
    "read_video",
    "reconstruct",
    "render_video",
    "residuals",
    "score",
    "track",
    "write_video",
]
