"""The report on a law discovered from videos: a page to read, and the same as data.

`write_report` makes a folder of three files: ``report.html``, which needs no other file and no
network, ``result.json``, and ``rig.toml`` with the learned cameras. The folder appears under its
name only when it is complete.
"""

from __future__ import annotations

import base64
import html
import io
import json
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from ..cameras import DISAGREEMENT, residuals
from ..checks import check_path
from ..pipeline import VideoDiscovery
from ..study.plots import plot_path, plot_residuals, plot_rig, plot_views
from ..vision import read_frame, video_info
from .records import as_json

PAGE, DATA, RIG = FILES = ("report.html", "result.json", "rig.toml")

_STYLE = """\
body { font: 16px/1.5 sans-serif; color: #222 }
body { max-width: 62rem; margin: 2rem auto; padding: 0 1rem }
pre { background: #f4f4f4; padding: .8rem; overflow-x: auto; font-size: 14px }
table { border-collapse: collapse; margin: 1rem 0; font-size: 14px }
table { display: block; overflow-x: auto }
th, td { padding: .25rem .7rem; border-bottom: 1px solid #ddd; text-align: right }
th:first-child, td:first-child { text-align: left }
img { max-width: 100% }
figure { margin: 1.5rem 0 } figcaption { font-style: italic }
.verdict { padding: .6rem 1rem; border-left: .5rem solid #009e73; background: #eef8f4 }
.suspect { border-color: #d55e00; background: #fdf1ea }
"""


def check_folder_is_free(folder: str | Path) -> Path:
    """That a report may be written there: nothing is, or an earlier report that it replaces.

    Raises
    ------
    ValueError
        If something else is there, or the folder around it does not exist.
    """
    folder = check_path("out", folder)
    if not folder.absolute().parent.is_dir():
        raise ValueError(f"out: the folder around it must exist, got '{folder}'")
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
        new.rename(folder)
    return folder / PAGE


def summary(
    found: VideoDiscovery, paths: Sequence[str | Path], options: Mapping[str, object] | None = None
) -> dict:
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
            "data": _law(law, "data", np.zeros(3), np.zeros(3)),
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
    return as_json(content, "found")


def _law(found, frame, origin, errors):
    """One form of the law: as text, and term by term."""
    law, deviations = (
        (found.system, found.standard_errors)
        if frame == "data"
        else (found.native, found.native_standard_errors)
    )
    terms = [
        {
            "equation": f"d{name}/dt", "term": law.terms[row],
            "coefficient": law.coefficients[row, j], "standard_error": deviations[row, j],
        }
        for j, name in enumerate(law.names)
        for row in np.flatnonzero(law.coefficients[:, j])
    ]  # fmt: skip
    equations = found.equations(frame)
    return {"equations": equations, "origin": origin, "origin_errors": errors, "terms": terms}


# ---------------------------------------------------------------------------------------- the page


def _page(found, paths, content):
    """The report as one HTML page."""
    native, data = content["law"]["native"], content["law"]["data"]
    origin = ", ".join(
        f"{value:.6g} ± {error:.1g}" if error else f"{value:.6g}"
        for value, error in zip(native["origin"], native["origin_errors"], strict=True)
    )
    options = ", ".join(f"{key} {value}" for key, value in content["options"].items())
    parts = [
        "<h1>The law of a moving target</h1>",
        _verdict(found),
        "<h2>The law</h2>",
        f"<p>In the frame in which it is shortest, with its origin at ({origin}):</p>",
        f"<pre>{html.escape(native['equations'])}</pre>",
        "<p>In the frame of the rig file:</p>",
        f"<pre>{html.escape(data['equations'])}</pre>",
        "<p>After ± stands one standard error, if these terms are the right ones. Lengths are in "
        "scene units, time in seconds of video unless other times were given.</p>",
        _table(_term_rows(data)),
        "<h2>The path</h2>",
        *_figures(found, paths),
        "<h2>The cameras</h2>",
        _table(_camera_rows(content["cameras"])),
        "<p>The lag is by how many frames of the first video a video starts later. Residuals are "
        "the distances, in pixels, between the tracks and what the cameras see of the "
        f"reconstructed target; above {DISAGREEMENT:g} in a tenth of the frames, the rig is "
        "doubted.</p>",
        "<h2>How it was found</h2>",
        f"<p>{html.escape(options) or 'Default options'}. Estimated noise of the path: "
        f"{', '.join(f'{value:.2g}' for value in content['noise'])} scene units in x, y, z. All "
        f"numbers are in {DATA}; the learned cameras are also in {RIG}.</p>",
    ]
    body = "\n".join(parts)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f"<title>Law of a moving target</title>\n<style>\n{_STYLE}</style>\n</head>\n"
        f"<body>\n{body}\n</body>\n</html>\n"
    )


def _verdict(found):
    if found.status == "ok":
        return (
            '<div class="verdict"><strong>No reason for doubt was found.</strong> That is no '
            "proof: the law was judged on the range of these videos alone.</div>"
        )
    doubts = "".join(f"<li>{html.escape(text)}</li>" for text in found.warnings)
    return (
        '<div class="verdict suspect"><strong>Suspect: do not trust this law as it is.</strong>'
        f"<ul>{doubts}</ul></div>"
    )


def _term_rows(law):
    return [
        {
            "equation": term["equation"], "term": term["term"],
            "coefficient": f"{term['coefficient']:.6g}",
            "standard error": f"{term['standard_error']:.2g}",
            "relative (%)": f"{abs(100 * term['standard_error'] / term['coefficient']):.2g}",
        }
        for term in law["terms"]
    ]  # fmt: skip


def _camera_rows(cameras):
    def shown(value, form):
        return "unknown" if value is None else format(value, form)

    return [
        {
            "video": c["video"], "frames": str(c["frames"]), "fps": f"{c['fps']:g}",
            "camera": c["model"], "scale": f"{c['scale']:.6g}", "angle (rad)": f"{c['angle']:.5f}",
            "lag (frames)": f"{c['lag']:.3f} ± {shown(c['lag_error'], '.1g')}" if i else "0",
            "seen (%)": f"{100 * c['share_of_frames_seen']:.1f}",
            "residual, rms (px)": shown(c["residual_rms"], ".3f"),
            "nine in ten below (px)": shown(c["residual_of_nine_in_ten"], ".3f"),
        }
        for i, c in enumerate(cameras)
    ]  # fmt: skip


def _table(rows):
    if not rows:
        return "<p>No terms.</p>"
    head = "".join(f"<th>{html.escape(name)}</th>" for name in rows[0])
    lines = ["".join(f"<td>{html.escape(cell)}</td>" for cell in row.values()) for row in rows]
    return "\n".join(["<table>", *(f"<tr>{line}</tr>" for line in (head, *lines)), "</table>"])


def _figures(found, paths):
    """The figures as HTML, one after the other."""
    # The first use of pyplot switches the figures of a notebook on, the end of a style whatever was
    # switched on meanwhile off again: so this comes first.
    plt.draw_if_interactive()
    with plt.style.context("vidsindy_lite.study.plots.vidsindy"):
        yield _figure(
            plot_path(found.t, found.x, found.discovery.curve(found.t)),
            "The reconstructed path (grey) and the curve that obeys the law (blue), over time and "
            "in space. Where they part, the law does not hold.",
        )
        seen = np.all([np.isfinite(track).all(axis=1) for track in found.tracks], axis=0)
        if seen.any():
            yield _figure(
                _first_look(found, paths, int(seen.argmax())),
                "One instant in every video, with the whole track over it and a ring around the "
                "target. The tracks should be whole and the rings on the same thing.",
            )
        if found.rig.is_orthographic:
            yield _figure(
                plot_rig(found.rig, found.x),
                "The path (black) and what each camera sees of it, in its view plane.",
            )
        yield _figure(
            plot_residuals(found.t, residuals(found.tracks, found.rig), DISAGREEMENT),
            "By how many pixels the reconstructed target misses each track. Single high points are "
            "jumps of a track; a level above the dashed line is a wrong rig or a wrong lag.",
        )


def _first_look(found, paths, instant):
    """The frames of all videos at one instant of the first."""
    places = [(Path(path), found.lags.frame_at(i, instant)) for i, path in enumerate(paths)]
    images = [read_frame(path, frame) for path, frame in places]
    titles = [f"{path.name}, frame {frame}" for path, frame in places]
    return plot_views(images, titles, found.tracks, instant)


def _figure(figure, caption):
    """A figure inside the page."""
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=110)
    plt.close(figure)
    text = base64.b64encode(image.getvalue()).decode()
    caption = html.escape(caption)
    return (
        f'<figure><img src="data:image/png;base64,{text}" alt="{caption}">'
        f"<figcaption>{caption}</figcaption></figure>"
    )
