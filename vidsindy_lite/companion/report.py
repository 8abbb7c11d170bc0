"""The report on a law discovered from videos: a page to read, and the same as data.

`write_report` makes a folder of three files: ``report.html``, which needs no other file and no
network, ``result.json``, and ``rig.toml`` with the learned cameras. The folder appears under its
name only when it is complete.
"""

from __future__ import annotations

import base64
import io
import json
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from ..arrays import Floats
from ..cameras import DISAGREEMENT, residuals
from ..checks import check_path
from ..dynamics import Discovery
from ..pipeline import VideoDiscovery
from ..study.plots import plot_frames, plot_path, plot_plateaus, plot_residuals, plot_rig
from ..vision import read_frame, video_info
from .pages import page
from .records import as_json

LONGEST_NAME = 30  # characters above a picture
PAGE, DATA, RIG = FILES = ("report.html", "result.json", "rig.toml")


def check_folder_is_free(folder: str | Path) -> Path:
    """That a report may be written there: nothing is, or an earlier report that it replaces.

    Raises
    ------
    ValueError
        If something else is there, or the folder around it does not exist or is not writable.
    """
    folder = check_path("out", folder)
    if not folder.absolute().parent.is_dir():
        raise ValueError(f"out: the folder around it must exist, got '{folder}'")
    if not os.access(folder.absolute().parent, os.W_OK):
        raise ValueError(f"out: the folder around it must be writable, got '{folder}'")
    if folder.is_dir():
        strange = sorted({path.name for path in folder.iterdir()} - set(FILES))
        if strange:
            raise ValueError(
                f"out: must be a new folder or hold an earlier report, got '{folder}' with "
                f"{', '.join(strange[:3])}"
            )
    elif folder.exists():
        raise ValueError(f"out: must be a folder, got the file '{folder}'")
    return folder


def write_report(
    found: VideoDiscovery,
    paths: Sequence[str | Path],
    folder: str | Path,
    options: Mapping[str, object] | None = None,
) -> Path:
    """Write the report on a law.

    Parameters
    ----------
    found : VideoDiscovery
    paths : sequence of path
        The video files, one per camera.
    folder : path
        Where; an earlier report is replaced.
    options : mapping, optional
        How the law was asked for, to be told in the report.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    ValueError
        If there is not one video per camera, or the folder holds anything but a report.
    """
    folder = check_folder_is_free(folder).absolute()
    if len(paths) != len(found.rig.cameras):
        raise ValueError(f"paths: must be {len(found.rig.cameras)} videos, got {len(paths)}")
    content = summary(found, paths, options)
    with tempfile.TemporaryDirectory(prefix=".report-", dir=folder.parent) as scratch:
        new, old = Path(scratch) / "new", Path(scratch) / "old"
        new.mkdir()
        (new / DATA).write_text(json.dumps(content, allow_nan=False, indent=1) + "\n", "utf-8")
        found.rig.save(new / RIG)
        (new / PAGE).write_text(_page(found, paths, content), "utf-8")
        if folder.exists():
            folder.rename(old)
        try:
            new.rename(folder)
        except OSError:
            if old.exists():
                old.rename(folder)
            raise
    return folder / PAGE


def summary(
    found: VideoDiscovery, paths: Sequence[str | Path], options: Mapping[str, object] | None = None
) -> dict[str, object]:
    """All that the report tells, as plain data for JSON; None in place of NaN.

    Parameters
    ----------
    found, paths, options
        See `write_report`.
    """
    missed = residuals(found.tracks, found.rig)
    cameras = []
    for i, (path, camera) in enumerate(zip(paths, found.rig.cameras, strict=True)):
        shot, seen = video_info(path), np.isfinite(found.tracks[i]).all(axis=1)
        length = np.hypot(*missed[i].T)
        length = length[np.isfinite(length)]
        cameras.append({
            "video": Path(path).name, "frames": shot.frames, "fps": shot.fps,
            "image_size": list(shot.size), "model": camera.model,
            "position": camera.position, "normal": camera.normal,
            "scale": camera.scale, "angle": camera.angle,
            "lag": found.lags.frames[i], "lag_error": found.lags.errors[i],
            "share_of_frames_seen": seen.mean(),
            "residual_rms": np.sqrt(np.mean(length**2)) if len(length) else np.nan,
            "residual_of_nine_in_ten": np.quantile(length, 0.9) if len(length) else np.nan,
        })  # fmt: skip
    law = found.discovery
    content = {
        "status": found.status,
        "warnings": list(found.warnings),
        "law": {
            "data": _law(law, "data", np.zeros(law.system.d), np.zeros(law.system.d)),
            "native": _law(law, "native", law.offset, law.offset_errors),
        },
        "noise": law.noise,
        "cameras": cameras,
        "options": dict(options or {}),
        "t": found.t,
        "x": found.x,
        "curve": law.curve(found.t),
        "tracks": list(found.tracks),
        "residuals": missed,
    }
    return {key: as_json(value, f"found[{key!r}]") for key, value in content.items()}


def _law(found: Discovery, frame: str, origin: Floats, errors: Floats) -> dict[str, object]:
    """One form of the law: as text, and term by term."""
    law, deviations = (
        (found.system, found.standard_errors)
        if frame == "data"
        else (found.native, found.native_standard_errors)
    )
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


# ---------------------------------------------------------------------------------------- the page


def _page(found: VideoDiscovery, paths: Sequence[str | Path], content: Mapping[str, object]) -> str:
    """The report as one HTML page."""
    about = {"limit": DISAGREEMENT, "data_file": DATA, "rig_file": RIG}
    return page("report.html", figures=_figures(found, paths), **about, **content)


def _figures(found: VideoDiscovery, paths: Sequence[str | Path]) -> Iterator[tuple[str, str]]:
    """The figures one after the other, each a PNG in base64, by their names in the template."""
    # The first use of pyplot switches the figures of a notebook on, the end of a style whatever was
    # switched on meanwhile off again: so this comes first.
    plt.draw_if_interactive()
    with plt.style.context("vidsindy_lite.study.plots.vidsindy"):
        yield "path", _encoded(plot_path(found.t, found.x, found.discovery.curve(found.t)[:, :3]))
        seen = np.all([np.isfinite(track).all(axis=1) for track in found.tracks], axis=0)
        if seen.any():
            yield "look", _encoded(_first_look(found, paths, int(seen.argmax())))
        if found.rig.is_orthographic:
            yield "rig", _encoded(plot_rig(found.rig, found.x))
        missed = residuals(found.tracks, found.rig)
        yield "residuals", _encoded(plot_residuals(found.t, missed, DISAGREEMENT))
        yield "plateaus", _encoded(plot_plateaus(found.discovery))


def _first_look(found: VideoDiscovery, paths: Sequence[str | Path], instant: int) -> Figure:
    """The frames of all videos at one instant of the first."""
    places = [(Path(path), found.lags.frame_at(i, instant)) for i, path in enumerate(paths)]
    images = [read_frame(path, frame) for path, frame in places]
    titles = [f"{_short(path.name)}, frame {frame}" for path, frame in places]
    return plot_frames(images, titles, found.tracks, instant)


def _short(name: str) -> str:
    """A file's name as it fits above its picture, where a dollar sign would begin a formula."""
    fitting = name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"
    return fitting.replace("$", r"\$")


def _encoded(figure: Figure) -> str:
    """A figure as text, closed."""
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=110)
    plt.close(figure)
    return base64.b64encode(image.getvalue()).decode()
