"""The report on a law that one camera's film shows: a page with the law over the film, and data."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from ..dynamics import Quantity
from ..plane import PlaneDiscovery
from ..values import as_json
from ..vision import read_frame
from .pages import page
from .report import DATA, FORMAT, PAGE, TRACKS, check_folder_is_free, data_files, encoded, put

COLOURS = "tab:blue", "tab:orange"
DRAWN = 600
"""Points of the law's curve in a picture."""


def write_plane_report(
    found: PlaneDiscovery,
    path: str | Path,
    folder: str | Path,
    options: Mapping[str, object] | None = None,
) -> Path:
    """Write the report on a law that was found from one film: report.html, result.json, tracks.csv.

    Parameters
    ----------
    found : PlaneDiscovery
    path : path
        The film.
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
        If the folder holds anything but a report.
    """
    folder = check_folder_is_free(folder).absolute()
    content = plane_summary(found, path, options)
    text = page(
        "plane.html", look=_look(found, path), said=str(found),
        physics_text=str(found.discovery.physics()), data_file=DATA, tracks_file=TRACKS, **content,
    )  # fmt: skip
    put(folder, data_files(content, found.t, [found.track.pixels]) | {PAGE: text})
    return folder / PAGE


def plane_summary(
    found: PlaneDiscovery, path: str | Path, options: Mapping[str, object] | None = None
) -> dict[str, object]:
    """All that the report tells, as plain data for JSON; None for what is not known."""
    law = found.discovery
    content = {
        "format": FORMAT, "status": found.status, "warnings": list(found.warnings),
        "video": Path(path).name, "unit": found.unit, "scale_error": found.scale_error,
        "homography": found.homography, "equations": law.equations(),
        "g": _number(found.g), "period": _number(found.period),
        "physics": {q.name: {"value": q.value, "error": q.error} for q in law.physics()},
        "t": found.t, "x": found.x, "curve": found.fitted,
        "track": found.track.pixels, "options": dict(options or {}),
    }  # fmt: skip
    return {key: as_json(value, f"found[{key!r}]") for key, value in content.items()}


def _number(found: Quantity | None) -> dict[str, float] | None:
    """A quantity as data."""
    return None if found is None else {"value": float(found.value), "error": float(found.error)}


def _look(found: PlaneDiscovery, path: str | Path) -> str:
    """The law over a frame, and both coordinates over the time, as a PNG in base64."""
    plt.draw_if_interactive()
    with plt.style.context("vidsindy_lite.study.plots.vidsindy"):
        return encoded(_drawn(found, path))


def _drawn(found: PlaneDiscovery, path: str | Path) -> Figure:
    seen = np.flatnonzero(np.isfinite(found.x[:, 0]))
    t = np.linspace(found.t[seen[0]], found.t[seen[-1]], DRAWN)
    law = found.along(t)
    figure, (picture, graph) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    # The track is in the pixels of the first frame.
    picture.imshow(read_frame(path, 0)[..., ::-1])
    picture.plot(*found.in_picture(law).T, color="tab:orange", label="law")
    picture.plot(*found.track.pixels.T, ".", ms=3, color="tab:blue", label="track")
    picture.set_axis_off()
    picture.legend()
    for j, (name, colour) in enumerate(zip("xy", COLOURS, strict=True)):
        graph.plot(found.t, found.x[:, j], ".", color=colour, label=name)
        graph.plot(t, law[:, j], color=colour)
    graph.set(xlabel="t (s)", ylabel=f"place ({found.unit})")
    graph.legend()
    return figure
