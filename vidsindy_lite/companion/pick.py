"""A page on which a user shows the target: a box in one frame of each video.

It needs no network and no other file: frames spread through each video are inside, and what is
drawn becomes a line for the rig file and one for Python.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from ..checks import check_path
from ..repository import write_file
from ..vision import pick_frames, video_info
from .pages import page

FRAMES = 24  # of each video on the page
_LONGEST = 1280  # pixels of a frame's longer side there
_QUALITY = 80  # of the frames' compression
_MARK = '<meta name="generator" content="vidsindy_lite pick">'


def write_pick_page(paths: Sequence[str | os.PathLike], out: str | os.PathLike) -> Path:
    """Write the page on which the target of these videos is shown.

    Parameters
    ----------
    paths : sequence of path
        Videos, see `read_video`.
    out : path
        Of the page; an earlier one is replaced.

    Returns
    -------
    Path

    Raises
    ------
    FileNotFoundError, ValueError
        If a video is missing or none, or another file is at `out`.
    """
    out = check_path("out", out)
    if out.exists() and not (out.is_file() and _MARK in out.read_text("utf-8", "replace")):
        raise ValueError(f"out: must be a new file or an earlier page of pick, got '{out}'")
    text = page("pick.html", videos=[_video(Path(path)) for path in paths])
    write_file(out, text.encode())
    return out


def _video(path: Path) -> dict[str, object]:
    """Name and size of a video, and frames spread through it."""
    info = video_info(path)
    numbers = np.unique(np.linspace(0, info.frames - 1, FRAMES).round().astype(int)).tolist()
    shrunk = min(1.0, _LONGEST / max(info.size))
    frames = []
    for number, image in zip(numbers, pick_frames(path, numbers), strict=False):
        small = cv2.resize(image, None, fx=shrunk, fy=shrunk, interpolation=cv2.INTER_AREA)
        _, packed = cv2.imencode(".jpg", small[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        frames.append({"number": number, "image": base64.b64encode(packed.tobytes()).decode()})
    width, height = info.size
    return {"name": path.name, "width": width, "height": height, "frames": frames}
