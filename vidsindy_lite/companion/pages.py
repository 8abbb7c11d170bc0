"""Pages from templates: the page on which a user shows the target, and the film of a report.

Templates lie beside this module. The page to show the target on needs no network and no other file:
frames spread through each video are inside, and what is drawn becomes a line for the rig file and
one for Python.
"""

from __future__ import annotations

import base64
import io
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import cast

import av
import cv2
import jinja2
import numpy as np

from ..arrays import Floats, Image
from ..checks import check_path
from ..pipeline import VideoDiscovery
from ..storage import write_file
from ..vision import pick_frames, video_info

FRAMES = 24  # of each video on the page
_LONGEST = 1280  # pixels of a frame's longer side there
_QUALITY = 80  # of the frames' compression
_MARK = '<meta name="generator" content="vidsindy_lite pick">'

_INSTANTS = 200  # of the film at most
_RATE = 25  # frames a second
_HEIGHT = 270  # pixels of each view, which stand side by side
_TRAIL = 40  # frames of the film that the curve reaches back
_CURVE = (0, 114, 178)  # as in the figures
_TUBE = 2.0  # standard deviations of the track around the law
_FAINT = 0.4  # share of the tube's colour

_PAGES = jinja2.Environment(
    loader=jinja2.FileSystemLoader(Path(__file__).parent),
    autoescape=jinja2.select_autoescape(["html"]),
    undefined=jinja2.StrictUndefined,
    keep_trailing_newline=True,
)


def page(template: str, **values: object) -> str:
    """A template filled in; in HTML, values are escaped."""
    return _PAGES.get_template(template).render(values)


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


def law_over_videos(found: VideoDiscovery, paths: Sequence[str | Path]) -> bytes:
    """The curve that obeys the law, drawn over the frames of all views, as WebM (VP9).

    Around the curve lies a tube of two standard deviations of the track around it.

    Parameters
    ----------
    found : VideoDiscovery
    paths : sequence of path
        The videos, one per camera.

    Returns
    -------
    bytes
    """
    instants = range(0, len(found.t), -(-len(found.t) // _INSTANTS))
    views = [_view(found, Path(path), i, instants) for i, path in enumerate(paths)]
    file = io.BytesIO()
    with av.open(file, "w", format="webm") as container:
        options = {"deadline": "realtime", "cpu-used": "8", "crf": "36", "b": "0"}
        stream = container.add_stream("libvpx-vp9", _RATE, options=options)
        for k, images in enumerate(zip(*views, strict=True)):
            side_by_side = np.hstack(images)
            if k == 0:
                stream.width, stream.height = side_by_side.shape[1::-1]
                stream.pix_fmt = "yuv420p"
            container.mux(stream.encode(av.VideoFrame.from_ndarray(side_by_side, "rgb24")))
        container.mux(stream.encode(None))
    return file.getvalue()


def _view(found: VideoDiscovery, path: Path, i: int, instants: range) -> Iterator[Image]:
    """What one camera saw at these instants, with what it would see of the law; small."""
    camera = found.rig.cameras[i]
    targets = np.split(found.fitted, found.targets, axis=1)
    pixels = np.stack([camera.project(x) for x in targets])
    spread = float(np.sqrt(np.nanmean((found.tracks[i] - np.hstack(list(pixels))) ** 2)))
    width, height = camera.image_size
    scale = _HEIGHT / height
    size = 2 * round(width * scale / 2), _HEIGHT
    numbers = [found.lags.frame_at(i, k) for k in instants]
    known = sorted({number for number in numbers if number >= 0})
    frames = zip(known, pick_frames(path, known), strict=False)
    grey = np.full((_HEIGHT, size[0], 3), 128, np.uint8)
    now, image = -1, grey
    for j, number in enumerate(numbers):
        while now < number:
            now, frame = next(frames, (number, None))
            image = grey if frame is None else _small(frame, size)
        shown = image if number >= 0 else grey
        for trail in pixels[:, instants[max(j - _TRAIL, 0)] : instants[j] + 1]:
            shown = _drawn(shown, (trail + 0.5) * scale - 0.5, spread * scale)
        yield shown


def _small(frame: Image, size: tuple[int, int]) -> Image:
    return cast("Image", cv2.resize(frame, size, interpolation=cv2.INTER_AREA))


def _drawn(image: Image, trail: Floats, spread: float) -> Image:
    """A frame with the last part of the curve, the tube around it, and a ring at its end."""
    shown = trail[np.isfinite(trail).all(axis=1)]
    shown = shown[(np.abs(shown) < 10 * _HEIGHT).all(axis=1)]
    if not len(shown):
        return image
    line = [np.rint(shown).astype(np.int32)[:, None]]
    width = int(np.clip(2 * _TUBE * spread, 3, _HEIGHT))
    tube = cv2.polylines(image.copy(), line, False, _CURVE, width, cv2.LINE_AA)
    drawn = cv2.addWeighted(tube, _FAINT, image, 1 - _FAINT, 0)
    cv2.polylines(drawn, line, False, _CURVE, 1, cv2.LINE_AA)
    u, v = line[0][-1, 0].tolist()
    cv2.circle(drawn, (u, v), 7, (255, 255, 255), 3, cv2.LINE_AA)
    return cast("Image", cv2.circle(drawn, (u, v), 7, _CURVE, 1, cv2.LINE_AA))
