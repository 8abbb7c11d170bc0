"""Governing equations of a moving target from the videos of three cameras.

The modules stand in the order of the pipeline:
systems, cameras, perspective | video, tracking, synchrony | ado (discovery) | pipeline |
experiments, lab | report.
"""

from .ado import discover
from .cameras import Camera, Rig, learn_cameras, reconstruct, residuals
from .discovery import Discovery
from .metrics import Score, score
from .perspective import PerspectiveCamera
from .pipeline import VideoDiscovery, discover_from_videos
from .polynomials import PolynomialSystem
from .synchrony import Synchrony, align, learn_lags
from .systems import REFERENCE_OFFSET, SYSTEMS, Benchmark
from .tracking import Track, follow, track
from .video import Scene, read_video, render_video, write_video

__all__ = [
    "PolynomialSystem",
    "SYSTEMS",
    "REFERENCE_OFFSET",
    "Benchmark",
    "Camera",
    "PerspectiveCamera",
    "Rig",
    "learn_cameras",
    "reconstruct",
    "residuals",
    "Scene",
    "render_video",
    "write_video",
    "read_video",
    "track",
    "follow",
    "Track",
    "Synchrony",
    "align",
    "learn_lags",
    "discover",
    "Discovery",
    "score",
    "Score",
    "discover_from_videos",
    "VideoDiscovery",
]
