"""What the notebooks produce: figures and tables in a folder, each with its numbers beside it.

A notebook hands each result over under an id, the paper's number where there is one::

    save_figure("fig_3", fig, caption="...", numbers={"noise": levels, "l2": errors})
    save_table("table_1", rows, caption="...")          # rows: a list of dicts

and the folder then holds the picture and one JSON file ``<id>.json``, the record: caption,
notebook, and the plotted numbers or the rows of the table. No dates, no versions, six significant
digits. What is called ``seconds`` in a record is a wall time: it differs from run to run, and
counts nowhere.

The folder is the one that the environment variable VIDSINDY_FIGURES names; the runner sets it, and
VIDSINDY_NOTEBOOK. Without it, a cell that somebody runs by hand writes to
build/interactive/figures: only the runner writes the committed ones.
"""

import io
import json
import os
import platform
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from IPython.display import HTML, Markdown
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from ..storage import library_versions, repository_root, write_file, write_files
from ..values import as_json
from .report import page

INDEX = "README.md"
DIGITS = 6  # of the numbers in the records
PALETTE = Image.Quantize.FASTOCTREE  # a small target keeps its colour, and so does white
PICTURES = {"figure": [".png"], "animation": [".gif"], "table": []}  # files of a kind


def versions() -> str:
    """Python and the libraries that results depend on, as they are here, a line each."""
    return "\n".join([f"Python {platform.python_version()}", *library_versions()])


def figures_folder() -> Path:
    """The folder that figures and tables go to: VIDSINDY_FIGURES, or one of its own."""
    named = os.environ.get("VIDSINDY_FIGURES")
    return Path(named) if named else _interactive_folder(repository_root())


@cache
def _interactive_folder(root: Path) -> Path:
    """Where results go that no run asked for; says so once."""
    folder = root / "build" / "interactive" / "figures"
    print(f"figures and tables go to {folder}; `make figures` writes the committed ones")
    return folder


# ------------------------------------------------------------------------------------------ figures


def save_figure(
    figure_id: str,
    figure: Figure,
    *,
    caption: str,
    numbers: Mapping[str, object],
    tolerance: float | Mapping[str, float] | None = None,
) -> None:
    """Write a figure as PNG with the plotted numbers beside it.

    Parameters
    ----------
    figure_id : str
        The paper's number ("fig_3", "figure_S10") or a name of ours: letters, digits, _ and -.
    figure : matplotlib Figure
        Not closed, so a notebook shows it under the cell.
    caption : str
        The sentence on what to see.
    numbers : mapping of str to array_like
        What is plotted, by name: numbers, text, arrays and nestings of them. NaN becomes null.
    tolerance : float or mapping of str to float, optional
        By how much the numbers may differ between two runs, relatively, or some of them, by name;
        by default a thousandth (see `compare.differences`).

    Raises
    ------
    ValueError
        On a malformed id, an empty caption, or a tolerance of what is not there.
    TypeError
        If something in `numbers` is none of the above.
    """
    record = _record(figure_id, "figure", caption, numbers, tolerance)
    # What is written in the figure, but for numbers: titles, labels, legends.
    texts = dict.fromkeys(text.get_text() for text in figure.findobj(Text) if text.get_visible())
    words = (text for text in texts if re.search(r"[^\W\d_]", re.sub(r"\\\w+", "", text)))
    _write(record | {"words": [*words]}, _png(figure))


def save_animation(
    animation_id: str,
    pictures: Sequence[np.ndarray],
    *,
    caption: str,
    numbers: Mapping[str, object],
) -> None:
    """Write pictures as an animated GIF, which every code host plays.

    Parameters
    ----------
    animation_id : str
        As of `save_figure`.
    pictures : sequence of ndarray of uint8, shape (height, width, 3)
        One palette of 256 colours serves all of them. The last one stays for three seconds.
    caption, numbers
        As of `save_figure`.

    Raises
    ------
    ValueError, TypeError
        As `save_figure` does.
    """
    record = _record(animation_id, "animation", caption, numbers)
    palette = Image.fromarray(np.concatenate(pictures)).quantize(256, PALETTE)
    images = (Image.fromarray(picture) for picture in pictures)
    first, *rest = (one.quantize(palette=palette, dither=Image.Dither.NONE) for one in images)
    durations, file = [83] * len(rest) + [3000], io.BytesIO()  # milliseconds
    first.save(file, "GIF", save_all=True, append_images=rest, duration=durations, loop=0)
    _write(record, file.getvalue())


def save_slider(
    slider_id: str, figures: Mapping[str, Figure], *, caption: str, numbers: Mapping[str, object]
) -> HTML:
    """Save the first of some figures, close all, and show them behind a slider.

    The frames are drawn before, one below the other in a single picture, and the slider moves it:
    so it works in JupyterLab as on a page without a kernel or a network.

    Parameters
    ----------
    slider_id : str
        As of `save_figure`.
    figures : mapping of str to matplotlib Figure
        At least one, all of one size, by what stands beside the slider.
    caption, numbers
        As of `save_figure`.

    Returns
    -------
    IPython.display.HTML
        For the last expression of a cell.

    Raises
    ------
    ValueError, TypeError
        If there is no figure, and as `save_figure` does.
    """
    if not figures:
        raise ValueError(f"figures: slider {slider_id!r} needs at least one figure, got none")
    save_figure(slider_id, next(iter(figures.values())), caption=caption, numbers=numbers)
    with plt.rc_context({"savefig.dpi": 100}):
        pictures = [Image.open(io.BytesIO(_png(figure))) for figure in figures.values()]
    for figure in figures.values():
        plt.close(figure)
    (width, height), strip = pictures[0].size, io.BytesIO()
    frames = [np.asarray(picture.convert("RGB")) for picture in pictures]
    Image.fromarray(np.concatenate(frames)).save(strip, "PNG")
    shown = {"labels": list(figures), "caption": caption, "strip": with_palette(strip.getvalue())}
    return HTML(page("slider.html", width=width, height=height, **shown))


def with_palette(png: bytes) -> bytes:
    """A PNG with 256 colours, a third of the size; as it was if that is not smaller."""
    image, small = Image.open(io.BytesIO(png)).convert("RGB"), io.BytesIO()
    image.quantize(256, PALETTE).save(small, "PNG", optimize=True)
    return min(png, small.getvalue(), key=len)


def _png(figure: Figure) -> bytes:
    image = io.BytesIO()
    figure.savefig(image, format="png", metadata={"Software": None})  # else it names the library
    return with_palette(image.getvalue())


# ------------------------------------------------------------------------------------------- tables


def save_table(
    table_id: str,
    rows: Iterable[Mapping[str, object]],
    *,
    caption: str,
    tolerance: float | Mapping[str, float] | None = None,
) -> Markdown:
    """Write the record of a table, and show it.

    Parameters
    ----------
    table_id : str
        The paper's number ("table_1", "table_S2") or a name of ours: letters, digits, _ and -.
    rows : iterable of mappings
        One per row, all with the same keys. A column named "seconds" holds wall times, to two
        digits.
    caption : str
        The sentence on what to see.
    tolerance : float or mapping of str to float, optional
        As of `save_figure`, by column.

    Returns
    -------
    IPython.display.Markdown
        The table with its caption, for the last expression of a cell.

    Raises
    ------
    ValueError
        On a malformed id, an empty caption, no rows, rows with different keys, or a tolerance of a
        column that is not there.
    """
    copies = [dict(row) for row in rows]
    if not copies or any(list(row) != list(copies[0]) for row in copies):
        columns = " and ".join(dict.fromkeys(str(list(row)) for row in copies)) or "no row"
        raise ValueError(f"rows: table {table_id!r} needs rows of the same columns, got {columns}")
    for row in copies:
        if isinstance(row.get("seconds"), int | float):
            row["seconds"] = float(f"{row['seconds']:.2g}")
    record = _record(table_id, "table", caption, copies, tolerance)
    _write(record)
    return Markdown(table_text(record))


def table_text(record: dict) -> str:
    """A table in Markdown with its caption, four significant digits, numbers to the right."""

    def shown(value: object) -> str:
        if value is None or isinstance(value, bool):
            return {None: "", True: "yes", False: "no"}[value]
        return f"{value:.4g}" if isinstance(value, float) else str(value).replace("|", "\\|")

    frame = pd.DataFrame(record["rows"], dtype=object)
    is_text = frame.map(lambda value: isinstance(value, str)).any()
    align = ["left" if text else "right" for text in is_text]
    table = frame.map(shown).to_markdown(index=False, colalign=align, disable_numparse=True)
    return f"{table}\n\n{record['caption']}\n"


# ------------------------------------------------------------------------------------------ records


def _record(
    artifact_id: str,
    kind: str,
    caption: str,
    content: Mapping | list,
    tolerance: float | Mapping[str, float] | None = None,
) -> dict:
    """A record, checked."""
    if not re.fullmatch(r"[A-Za-z0-9_-]+", artifact_id) or artifact_id == Path(INDEX).stem:
        raise ValueError(
            f"{kind}_id: expected letters, digits, _ and -, other than {Path(INDEX).stem}, "
            f"got {artifact_id!r}"
        )
    caption = " ".join(caption.split())
    if not caption:
        raise ValueError(f"caption: {kind} {artifact_id!r} needs a sentence, got an empty one")
    holds, rows = ("rows", content) if isinstance(content, list) else ("numbers", [content])
    known = {name for row in rows for name in row}
    if strange := set(tolerance if isinstance(tolerance, Mapping) else ()) - known:
        raise ValueError(
            f"tolerance: must name what is in {kind} {artifact_id!r} ({', '.join(sorted(known))}), "
            f"got {', '.join(sorted(strange))}"
        )
    return {
        "id": artifact_id,
        "kind": kind,
        "notebook": os.environ.get("VIDSINDY_NOTEBOOK", "interactive"),
        "caption": caption,
        **({"tolerance": as_json(tolerance, "tolerance")} if tolerance is not None else {}),
        holds: as_json(content, holds, DIGITS),
    }


def _write(record: dict, *picture: bytes) -> None:
    """Write a picture, then its record, a line per entry and per row."""

    def entry(value: object) -> str:
        if isinstance(value, dict) and value:
            items = (f"  {json.dumps(k)}: {json.dumps(v)}" for k, v in value.items())
            return "{\n" + ",\n".join(items) + "\n }"
        if isinstance(value, list):
            return "[\n" + ",\n".join(f"  {json.dumps(item)}" for item in value) + "\n ]"
        return json.dumps(value)

    lines = (f" {json.dumps(key)}: {entry(value)}" for key, value in record.items())
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    contents = zip(reversed(files_of(record)), (*picture, text.encode()), strict=True)
    write_files({figures_folder() / name: content for name, content in contents})


def read_records(folder: Path) -> dict[str, dict]:
    """All records by id, in the order of a reader: S2 before S10. A damaged one is none."""
    found = {}
    for path in folder.glob("*.json"):
        with suppress(ValueError, RecursionError):
            record = json.loads(path.read_text("utf-8"))
            if _is_record(record, path.stem):
                found[path.stem] = record

    def order(artifact_id: str) -> list:
        return [int(p) if p.isdigit() else p for p in re.split(r"(\d+)", artifact_id)]

    return {artifact_id: found[artifact_id] for artifact_id in sorted(found, key=order)}


def _is_record(record: object, name: str) -> bool:
    """Whether this is what `save_figure` and `save_table` write under a name."""
    if not isinstance(record, dict) or record.get("id") != name:
        return False
    rows, numbers = record.get("rows"), record.get("numbers")
    has_rows = isinstance(rows, list) and all(isinstance(row, dict) for row in rows)
    said = isinstance(record.get("notebook"), str) and isinstance(record.get("caption"), str)
    return said and record.get("kind") in PICTURES and (has_rows or isinstance(numbers, dict))


def files_of(record: dict) -> list[str]:
    """Names of the files that a figure or table consists of."""
    return [f"{record['id']}{suffix}" for suffix in (".json", *PICTURES[record["kind"]])]


def write_index(folder: Path) -> None:
    """Write the folder's index page (README.md, which code hosts show) from the records."""
    records = list(read_records(folder).values())
    write_file(folder / INDEX, page("index.md", records=records, table_text=table_text).encode())
