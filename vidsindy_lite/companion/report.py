"""The report on a law discovered from videos, and other pages; templates lie beside this module.

`write_report` writes four files into a folder: ``report.html``, which needs no other file and no
network, ``result.json`` (``result.schema.json`` says what is in it), ``tracks.csv``, and
``rig.toml`` with the learned cameras. `write_refusal` does the same, without cameras, if there is
no law to report: then a picture of the tracks is what helps. All of them appear when all are made;
the folder itself and whatever else it holds stay as they are.

`write_pick_page` writes the page on which a user shows the target: frames spread through each video
are inside, and what is drawn becomes a line for the rig file and one for Python.
"""

from __future__ import annotations

import base64
import io
import json
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from string import ascii_lowercase
from typing import Any, TypeAlias, cast

import cv2
import jinja2
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from ..arrays import Floats, Image
from ..cameras import DISAGREEMENT, Rig, stacked
from ..checks import check_instance, check_path
from ..dynamics import Discovery, Swing
from ..pipeline import Refused, Stopped, VideoDiscovery
from ..plane import PlaneDiscovery
from ..progress import bar
from ..storage import write_file, write_files
from ..study.plots import plot_frames, plot_path, plot_residuals, plot_rig
from ..values import as_json
from ..vision import VideoInfo, pick_frames, read_frame, video_info, write_video

PAGE, DATA, RIG, TRACKS = FILES = ("report.html", "result.json", "rig.toml", "tracks.csv")
FORMAT = 1  # of result.json: counts up when what is in it changes its meaning

_TITLES = ("<title>Law of a moving target", "<title>No law: ")  # of pages that are ours

FRAMES = 24  # of each video on the page to show the target on

_HEIGHT = 270  # pixels of each view, which stand side by side
_CURVE = (0, 114, 178)  # as in the figures
_FAINT = 0.4  # share of the tube's colour

_PAGES = jinja2.Environment(
    loader=jinja2.FileSystemLoader(Path(__file__).parent),
    autoescape=jinja2.select_autoescape(["html"]),
    undefined=jinja2.StrictUndefined,
    keep_trailing_newline=True,
)
_PAGES.filters |= {"base64": lambda data: base64.b64encode(data).decode()}
_PAGES.globals |= {"data_file": DATA, "rig_file": RIG, "tracks_file": TRACKS}


Videos: TypeAlias = Sequence[str | Path] | None  # one per camera; None if there are tracks alone
Options: TypeAlias = Mapping[str, object] | None  # how a law was asked for


def page(template: str, **values: object) -> str:
    """A template filled in; in HTML, values are escaped."""
    return _PAGES.get_template(template).render(values)


def write_page(name: str, path: str | os.PathLike, template: str, **values: object) -> Path:
    """Write a page where nothing is, or an earlier one of this template.

    Raises
    ------
    ValueError
        If another file is.
    """
    path, kind = check_path(name, path), Path(template).stem
    mark = f'<meta name="generator" content="vidsindy_lite {kind}">'
    if path.exists() and not _holds(path, mark):
        raise ValueError(f"{name}: must be a new file or an earlier page of {kind}, got '{path}'")
    write_file(path, page(template, **values).encode())
    return path


def _holds(path: Path, *marks: str) -> bool:
    """Whether a file is there and can be read, and one of these marks is near its beginning."""
    try:
        start = path.read_text("utf-8", "replace")[:1000]
    except OSError:
        return False
    return any(mark in start for mark in marks)


# --------------------------------------------------------------------------------------- the report


def check_folder_is_free(folder: str | Path, given: Sequence[str | Path] = ()) -> Path:
    """That a report may be written there: none of its files is, or those of an earlier report.

    Of these none may be given, to be read.

    Raises
    ------
    ValueError
        If files of these names are none of a report, or given, it is no folder, or cannot be
        written to.
    """
    folder = check_path("out", folder)
    there = next(one for one in (folder, *folder.absolute().parents) if one.exists())
    try:
        tempfile.TemporaryFile(dir=there).close()
    except OSError:
        raise ValueError(f"out: must be a folder that can be written, got '{folder}'") from None
    strange = [name for name in FILES if (folder / name).exists()]
    if strange and not _holds(folder / PAGE, *_TITLES):
        raise ValueError(
            f"out: must hold no files of the names {', '.join(FILES)} but of an earlier report, "
            f"got '{folder}' with {', '.join(strange)}"
        )
    own = {(folder / name).resolve() for name in FILES}
    if read := next((path for path in given if Path(path).resolve() in own), None):
        raise ValueError(f"out: must be another folder than that of what is read, got '{read}'")
    return folder


def write_report(
    found: VideoDiscovery, paths: Videos, folder: str | Path, options: Options = None
) -> Path:
    """Write the report on a law.

    Parameters
    ----------
    found : VideoDiscovery
    paths : sequence of path, or None
        The videos, one per camera; None if there are tracks alone.
    folder : path
        Where; the files of an earlier report are replaced.
    options : mapping, optional
        How the law was asked for, to be told in the report.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    ValueError
        If there is not one video per camera, or the folder holds files of these names that are none
        of a report.
    """
    check_instance("found", found, VideoDiscovery)
    if paths is not None and len(paths) != len(found.rig.cameras):
        raise ValueError(f"paths: must be {len(found.rig.cameras)} videos, got {len(paths)}")
    content = summary(found, paths, options)
    files = _data(content, found.t, found.tracks)
    files |= {RIG: found.rig.text()} if len(found.rig.cameras) > 1 else {}
    figures = bar(None, "report", iterable=_figures(found, paths))
    film = None if paths is None else law_over_videos(found, paths)
    drawn = {"figures": figures, "film": film, "limit": DISAGREEMENT}
    return _put(folder, {PAGE: page("report.html", found=found, **drawn, **content)} | files)


def write_refusal(
    refused: Refused | Stopped,
    paths: Videos,
    rig: Rig | None,
    folder: str | Path,
    options: Options = None,
) -> Path:
    """Write what is known where no law was found: the tracks over the videos, and what failed.

    Parameters
    ----------
    refused : Refused or Stopped
    paths, folder, options
        See `write_report`.
    rig : Rig, optional
        As it was given; not needed with videos.

    Returns
    -------
    Path
        Of the page.
    """
    seen = [np.isfinite(track).all(axis=1) for track in refused.tracks]
    told = {
        "format": FORMAT, "status": "refused", "step": refused.step, "error": str(refused),
        "videos": _names(paths, len(seen)), "options": options or {}, "tracks": refused.tracks,
        "share_of_frames_seen": [one.mean() for one in seen],
    }  # fmt: skip
    content = as_json(told, "refused")
    # In the middle of what is seen of the target in each view.
    shown = [int(np.flatnonzero(one)[one.sum() // 2]) if one.any() else 0 for one in seen]
    sizes = [camera.image_size for camera in rig.cameras] if rig else [(1, 1)] * len(seen)
    look = _picture(_look, paths, sizes, shown, refused.tracks, shown)
    frames = np.arange(max(len(track) for track in refused.tracks), dtype=float)
    files = _data(content, frames, refused.tracks, "frame")
    return _put(folder, {PAGE: page("refusal.html", look=look, **content)} | files)


def _put(folder: str | Path, texts: Mapping[str, str]) -> Path:
    """Put the files of a report into its folder, and take away those of an earlier one.

    The page is the first, which tells whose the others are.
    """
    folder = check_folder_is_free(folder)
    is_new = not folder.exists()
    try:
        write_files({folder / name: text.encode() for name, text in texts.items()})
    finally:
        if is_new:  # and still empty
            with suppress(OSError):
                folder.rmdir()
    for name in set(FILES) - set(texts):
        (folder / name).unlink(missing_ok=True)
    return folder / PAGE


def _data(
    content: Mapping[str, object], instants: Floats, tracks: Sequence[Floats], instant: str = "t"
) -> dict[str, str]:
    """The data as JSON, and the tracks as a table that `discover --tracks` reads."""
    several = [""] if tracks[0].shape[1] == 2 else ascii_lowercase[: tracks[0].shape[1] // 2]
    columns = [f"{axis}{i + 1}{n}" for i in range(len(tracks)) for n in several for axis in "uv"]
    longest = len(instants)
    whole = [np.pad(t, ((0, longest - len(t)), (0, 0)), constant_values=np.nan) for t in tracks]
    table, head = io.StringIO(), ",".join((instant, *columns))
    np.savetxt(table, np.column_stack((instants, *whole)), "%.10g", ",", header=head, comments="")
    text = json.dumps(content, allow_nan=False, indent=1) + "\n"
    return {DATA: text, TRACKS: table.getvalue().replace("nan", "")}


def _names(paths: Videos, count: int) -> list[str]:
    """What the videos are called."""
    return [f"camera {i + 1}" if paths is None else Path(paths[i]).name for i in range(count)]


def summary(found: VideoDiscovery, paths: Videos, options: Options = None) -> dict[str, object]:
    """All that the report tells, as plain data for JSON; None in place of NaN.

    Parameters
    ----------
    found, paths, options
        See `write_report`.
    """
    missed = found.residuals
    cameras = []
    names = _names(paths, len(found.rig.cameras))
    rates = found.lags.rates / np.median(np.diff(found.t))
    for i, camera in enumerate(found.rig.cameras):
        known = VideoInfo(len(found.tracks[i]), float(rates[i]), camera.image_size)
        shot = known if paths is None else video_info(paths[i])
        length = np.linalg.norm(missed[i].reshape(-1, 2), axis=1)
        length = length[np.isfinite(length)]
        cameras.append({
            "video": names[i], "frames": shot.frames, "fps": shot.fps, "image_size": shot.size,
            **_parts(camera, "model", "position", "normal", "scale", "scale_error", "angle",
                     "homography"),
            "lag": found.lags.frames[i], "lag_error": found.lags.errors[i],
            "share_of_frames_seen": np.isfinite(found.tracks[i]).all(axis=1).mean(),
            "residual_rms": np.sqrt(np.mean(length**2)) if len(length) else np.nan,
            "residual_of_nine_in_ten": np.quantile(length, 0.9) if len(length) else np.nan,
        })  # fmt: skip
    law = found.discovery
    states = np.split(law.curve(found.t), law.system.order, axis=1)  # places, and velocities
    turn = np.eye(states[0].shape[1]) if law.orientation is None else law.orientation
    content = {
        "format": FORMAT,
        "status": found.status,
        "warnings": found.warnings,
        "frame": found.rig.note,
        "law": {
            "data": _law(law, "data"),
            "native": _law(law, "native"),
            "orientation": law.orientation,
            "swing": None if found.swing is None else _swing(found.swing),
        },
        "g": found.g and _parts(found.g, "value", "error"),
        "period": found.period and _parts(found.period, "value", "error"),
        "noise": law.noise,
        "cameras": cameras,
        "options": options or {},
        "t": found.t,
        "x": found.x,
        "curve": np.hstack([part @ turn for part in states]),
        "tracks": found.tracks,
        "residuals": missed,
    }
    return as_json(content, "found")


def _law(found: Discovery, frame: str) -> dict[str, object]:
    """One form of the law: as text, and term by term."""
    law, deviations = found.system, found.standard_errors
    origin = errors = np.zeros(law.d)
    if frame == "native":
        law, deviations = found.native, found.native_standard_errors
        origin, errors = found.offset, found.offset_errors
    terms = [
        {
            "equation": side, "term": law.terms[row],
            "coefficient": law.coefficients[row, j], "standard_error": deviations[row, j],
        }
        for j, side in law.sides().items()
        for row in np.flatnonzero(law.coefficients[:, j])
    ]  # fmt: skip
    equations = found.equations(frame)
    return {"equations": equations, "origin": origin, "origin_errors": errors, "terms": terms}


def _swing(swing: Swing) -> dict[str, object]:
    """A circle and the law of the angle on it."""
    return {
        **_parts(swing.circle, "centre", "centre_errors", "radius", "radius_error"),
        "equations": swing.law.equations(),
        "g": getattr(swing.g, "value", None), "g_error": getattr(swing.g, "error", None),
        "warnings": [*swing.circle.warnings, *swing.law.warnings],
    }  # fmt: skip


def _parts(whole: object, *names: str) -> dict[str, object]:
    """Attributes by their names; None where there is none."""
    return {name: getattr(whole, name, None) for name in names}


# ------------------------------------------------------------------------------------- its figures


def _figures(found: VideoDiscovery, paths: Videos) -> Iterator[tuple[str, bytes]]:
    """The figures one after the other, each a PNG, by their names in the template."""
    # Several targets are drawn as one that begins again.
    t = stacked(np.tile(found.t[:, None], found.targets), 1)[:, 0]
    x = stacked(found.x, 3)
    d = 3 if np.nan_to_num(x)[:, 2].any() else 2  # in the plane of one camera
    curves = {"reconstructed": x[:, :d]}
    curves["curve that obeys the law"] = stacked(found.fitted, 3)[:, :d]
    units: dict[str, Any] = {}
    if isinstance(found, PlaneDiscovery):
        units = {"unit": "s", "length": found.unit, "numbered": paths is not None}
    yield "path", _picture(plot_path, t, curves, "not seen", **units)
    seen = np.all([np.isfinite(track).all(axis=1) for track in found.tracks], axis=0)
    if seen.any() and paths is not None:
        instant = int(seen.argmax())
        shown = [found.lags.frame_at(i, instant) for i in range(len(paths))]
        sizes = [camera.image_size for camera in found.rig.cameras]
        yield "look", _picture(_look, paths, sizes, shown, found.tracks, instant)
    if len(found.rig.cameras) > 1:
        yield "rig", _picture(plot_rig, found.rig, x)
        missed = [stacked(one, 2) for one in found.residuals]
        yield "residuals", _picture(plot_residuals, t, missed, DISAGREEMENT)
    yield "plateaus", _picture(found.discovery.plot_path)


def _look(
    paths: Videos,
    sizes: Sequence[tuple[int, int]],
    frames: Sequence[int],
    tracks: Sequence[Floats],
    index: int | Sequence[int],
) -> Figure:
    """A frame of each view, white where there is no video, with its whole track over it."""
    titles = [f"camera {i + 1}, frame {k}" for i, k in enumerate(frames)]
    images = [
        np.full((height, width, 3), 255, np.uint8) if paths is None else read_frame(paths[i], k)
        for i, ((width, height), k) in enumerate(zip(sizes, frames, strict=True))
    ]
    return plot_frames(images, titles, tracks, index)


def _picture(plot: Callable[..., Figure], *shown: object, **how: object) -> bytes:
    """What a function plots, as a PNG."""
    # The first use of pyplot switches the figures of a notebook on, the end of a style whatever was
    # switched on meanwhile off again: so this comes first.
    plt.draw_if_interactive()
    image = io.BytesIO()
    with plt.style.context("vidsindy_lite.study.plots.vidsindy"):
        figure = plot(*shown, **how)
        figure.savefig(image, format="png", dpi=110)
        plt.close(figure)
    return image.getvalue()


# -------------------------------------------------------------------------- the law over the videos


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
    instants = range(0, len(found.t), -(-len(found.t) // 200))  # so many at most
    views = [_view(found, Path(path), i, instants) for i, path in enumerate(paths)]
    frames = (np.hstack(images) for images in zip(*views, strict=True))
    with tempfile.TemporaryDirectory() as own:
        return write_video(Path(own) / "law.webm", frames, fps=25, codec="VP9").read_bytes()


def _view(found: VideoDiscovery, path: Path, i: int, instants: range) -> Iterator[Image]:
    """What one camera saw at these instants, with what it would see of the law; small."""
    camera = found.rig.cameras[i]
    pixels = np.stack([camera.project(x) for x in np.split(found.fitted, found.targets, axis=1)])
    spread = float(np.sqrt(np.nanmean((found.tracks[i] - np.hstack(list(pixels))) ** 2)))
    width, height = camera.image_size
    scale = _HEIGHT / height
    size = 2 * round(width * scale / 2), _HEIGHT
    numbers = [found.lags.frame_at(i, k) for k in instants]
    frames = pick_frames(path, sorted({number for number in numbers if number >= 0}))
    grey = image = np.full((height, width, 3), 128, np.uint8)
    for j, (before, number) in enumerate(pairwise([-1, *numbers])):
        if number > max(before, -1):
            image = next(frames, grey)
        shown = cast("Image", cv2.resize(image, size, interpolation=cv2.INTER_AREA))
        # The curve reaches forty frames of the film back.
        for trail in pixels[:, instants[max(j - 40, 0)] : instants[j] + 1]:
            shown = _drawn(shown, (trail + 0.5) * scale - 0.5, spread * scale)
        yield shown


def _drawn(image: Image, trail: Floats, spread: float) -> Image:
    """A frame with the last part of the curve, the tube around it, and a ring at its end."""
    shown = trail[(np.abs(trail) < 10 * _HEIGHT).all(axis=1)]  # and no NaN
    if not len(shown):
        return image
    line = [np.rint(shown).astype(np.int32)[:, None]]
    width = int(np.clip(4 * spread, 3, _HEIGHT))  # two standard deviations to both sides
    tube = cv2.polylines(image.copy(), line, False, _CURVE, width, cv2.LINE_AA)
    drawn = cv2.addWeighted(tube, _FAINT, image, 1 - _FAINT, 0)
    cv2.polylines(drawn, line, False, _CURVE, 1, cv2.LINE_AA)
    u, v = line[0][-1, 0].tolist()
    cv2.circle(drawn, (u, v), 7, (255, 255, 255), 3, cv2.LINE_AA)
    return cast("Image", cv2.circle(drawn, (u, v), 7, _CURVE, 1, cv2.LINE_AA))


# ------------------------------------------------------------------- the page to show the target on


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
    videos = (_video(Path(path)) for path in paths)
    return write_page("out", out, "pick.html", alone=len(paths) == 1, videos=videos)


def _video(path: Path) -> dict[str, object]:
    """Name and size of a video, and frames spread through it."""
    info = video_info(path)
    numbers = np.unique(np.linspace(0, info.frames - 1, FRAMES).round().astype(int)).tolist()
    shrunk = min(1.0, 1280 / max(info.size))
    frames = []
    for number, image in zip(numbers, pick_frames(path, numbers), strict=False):
        small = cv2.resize(image, None, fx=shrunk, fy=shrunk, interpolation=cv2.INTER_AREA)
        _, packed = cv2.imencode(".jpg", small[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 80])
        frames.append({"number": number, "image": packed.tobytes()})
    return {"name": path.name, "size": info.size, "frames": frames}
