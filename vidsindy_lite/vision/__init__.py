"""Files and pixels: where the target is in each frame of a video, and films of synthetic scenes.

::

  video       reading and writing of video files; stills reads films that are folders of images
  track_files tracks as text files: DLTdv's, Tracker's, DeepLabCut's and ours
  tracking    track: a video in, the target's pixels out, by one of
  background      what differs from a background at rest (the most exact)
  moving          what moves most plainly, if camera and background are not: steadying takes out the
                  camera's motion (aligning: by all pixels, where corners are few), candidates are
                  what differs from the ground (plate) or from other frames, association finds the
                  path through them, appearance learns what is on it and follows its looks, or those
                  of what a hint points at (hints), refining measures
  several     track_targets: the same for several targets, each where it is apart from the others
  detector        what looks like a target in a single frame: our network, or any YOLO-v8
  network     that network, in PyTorch; training trained it, on frames that are drawn here
  scenes      what a camera sees; scenery draws its backgrounds, rendering its frames
"""

from .detector import WEIGHTS, LearnedDetector, detections
from .hints import Hint, load_hints
from .rendering import render, render_labelled, render_restless, render_video
from .scenery import BACKGROUNDS
from .scenes import SHAPES, Scene
from .several import track_targets
from .track_files import TrackFile, read_tracks
from .tracking import Track, check_detector, track
from .video import (
    VideoInfo,
    frame_clock,
    pick_frames,
    read_frame,
    read_video,
    video_info,
    write_video,
)
