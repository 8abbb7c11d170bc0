"""Files and pixels: where the target is in each frame of a video, and films of synthetic scenes.

::

  video       reading and writing of video files, and of films that are folders of images
  track_files tracks as text files: DLTdv's, Tracker's, DeepLabCut's and ours
  tracking    track: a video in, the target's pixels out, by
  film            what moves most plainly: camera takes out the camera's motion, if it moves, plate
                  is the ground behind the target, candidates are what differs from it or from other
                  frames, and the best path through them, which learns the looks of what is on it,
                  or of what a hint points at; refining measures; track_targets follows several
  a detector      what looks like a target in a single frame: our network, or any YOLO-v8
  network     that network, in PyTorch, and its training on frames that are drawn here
  rendering   films of a scene: background, target, and the disturbances between them
"""

from .candidates import Hint, load_hints
from .film import Track, track_targets
from .plate import carry
from .refining import bends
from .rendering import BACKGROUNDS, SHAPES, Scene, render, render_labelled, render_restless
from .rendering import render_video
from .track_files import TrackFile, read_tracks
from .tracking import WEIGHTS, LearnedDetector, check_detector, detections, track
from .video import VideoInfo, frame_clock, pick_frames, read_frame, read_video, video_info
from .video import write_video
