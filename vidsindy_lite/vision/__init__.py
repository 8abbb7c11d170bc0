"""Video files and pixels: reading and writing, drawing scenes, tracking."""

from .detector import WEIGHTS, LearnedDetector, detections
from .tracking import Track, check_detector, track
from .training import SEEN_BACKGROUNDS, SEEN_SHAPES
from .video import (
    BACKGROUNDS,
    SHAPES,
    Scene,
    VideoInfo,
    read_frame,
    read_video,
    render,
    render_labelled,
    render_restless,
    render_video,
    video_info,
    write_video,
)

__all__ = [
    "BACKGROUNDS",
    "LearnedDetector",
    "SEEN_BACKGROUNDS",
    "SEEN_SHAPES",
    "SHAPES",
    "Scene",
    "Track",
    "VideoInfo",
    "WEIGHTS",
    "check_detector",
    "detections",
    "read_frame",
    "read_video",
    "render",
    "render_labelled",
    "render_restless",
    "render_video",
    "track",
    "video_info",
    "write_video",
]
