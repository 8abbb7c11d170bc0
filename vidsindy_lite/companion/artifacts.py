"""What the notebooks produce: figures, tables, and the registry that keeps the folder honest.

A notebook hands each result over under an id, the paper's number where there is one::

    save_figure("fig_3", fig, caption="...", numbers={"noise": levels, "l2": errors})
    save_table("table_1", rows, caption="...")          # rows: a list of dicts

and the folder then holds, beside the image (PNG, SVG) or the table (CSV, Markdown), one JSON file
``<id>.json``: the registry's record (caption, notebook, stamp of the code that made it) together
with the plotted numbers or the rows. What the folder adds up to is the business of `registry`.

All files are deterministic: no dates, no library versions, six significant digits. Wall times are
the one thing that differs between two runs, so they are recorded by the first run of the same code
and kept by later ones: a table's column ``seconds``, and the run time of each notebook.

The folder is the one that the environment variable VIDSINDY_FIGURES names; the runner sets it,
VIDSINDY_NOTEBOOK and VIDSINDY_STAMP. Without it, a cell that somebody runs by hand writes to
build/interactive/figures: only the runner writes the committed ones.
"""

import base64
import io
import os
import platform
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from IPython.display import HTML
from matplotlib.figure import Figure
from PIL import Image

from ..stamp import LIBRARIES, repository_root, write_file
from .pages import page
from .records import RUN_TIMES, as_json, json_bytes, read_json, read_records

INDEX = "README.md"
DIGITS = 6  # of the numbers in the records
LARGEST_SVG = 120_000  # bytes
PICTURE = 83  # milliseconds that one of an animation stays
SLIDER_DPI = 100  # dots per inch of its frames
SECONDS = "seconds"  # the column of a table that holds wall times


# ---------------------------------------------------------------------------------------- where


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


def versions() -> str:
    """Python and the libraries that results depend on, as they are here, a line each."""
    lines = [f"{name} {metadata.version(name)}" for name in LIBRARIES]
    return "\n".join([f"Python {platform.python_version()}", *lines])


# ------------------------------------------------------------------------------------- what goes in


@dataclass(frozen=True)
class Table:
    """A registered table, shown by a notebook as HTML and by a terminal as text.

    Parameters
    ----------
    table_id : str
    caption : str
    rows : tuple of dict
        One dict per row, all with the same keys in the same order; the values are text, numbers,
        booleans or None (also in place of NaN).
    notebook : str
        Which wrote it.
    """

    table_id: str
    caption: str
    rows: tuple[dict, ...]
    notebook: str

    def __post_init__(self) -> None:
        if not self.rows:
            raise ValueError(f"rows: table {self.table_id!r} needs at least one row, got none")
        for number, row in enumerate(self.rows):
            if tuple(row) != self.columns:
                raise ValueError(
                    f"rows: every row of table {self.table_id!r} must have the columns "
                    f"{list(self.columns)}, got {list(row)} in row {number}"
                )
            for column, value in row.items():
                if isinstance(value, list | dict):
                    raise ValueError(
                        f"rows: a cell of table {self.table_id!r} must be text, a number, a "
                        f"boolean or None, got {value!r} in row {number}, column {column!r}"
                    )

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.rows[0])

    def csv(self) -> str:
        """The table as comma-separated values; None is an empty cell."""
        return pd.DataFrame(self.rows, dtype=object).to_csv(index=False, lineterminator="\n")

    def markdown(self) -> str:
        """The table in Markdown, four significant digits."""
        body = [[cell.replace("|", "\\|") for cell in line] for line in self._cells()]
        rule = ["---" if self._is_text(column) else "---:" for column in self.columns]
        lines = [body[0], rule, *body[1:]]
        return "".join(f"| {' | '.join(line)} |\n" for line in lines)

    def _cells(self) -> list[list[str]]:
        rows = [[_shown(value) for value in row.values()] for row in self.rows]
        return [[str(column) for column in self.columns], *rows]

    def _is_text(self, column: str) -> bool:
        return any(isinstance(row[column], str) for row in self.rows)

    def __str__(self) -> str:
        cells = self._cells()
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        align = ["<" if self._is_text(column) else ">" for column in self.columns]
        lines = [
            "  ".join(f"{c:{a}{w}}" for c, a, w in zip(line, align, widths, strict=True)).rstrip()
            for line in cells
        ]
        return "\n".join([lines[0], "-" * (sum(widths) + 2 * len(widths) - 2), *lines[1:]])

    def _repr_markdown_(self) -> str:
        return f"{self.markdown()}\n{self.caption}\n"

    def _repr_html_(self) -> str:
        align = ["left" if self._is_text(column) else "right" for column in self.columns]
        return page("table.html", caption=self.caption, align=align, lines=self._cells())


def save_figure(
    figure_id: str, figure: Figure, *, caption: str, numbers: Mapping[str, object]
) -> None:
    """Write a figure as PNG and SVG with the plotted numbers beside it, and register it.

    There is no SVG of a figure that holds a picture of pixels, or so many points that the drawing
    is larger than the picture.

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

    Raises
    ------
    ValueError
        On a malformed id, an empty caption, or an id that another notebook of this run owns.
    TypeError
        If something in `numbers` is none of the above.
    """
    record = _new_record("figure", figure_id, caption)
    record["numbers"] = as_json(dict(numbers), "numbers", DIGITS)
    # Without these three, a PNG names the library and an SVG the date, with random ids.
    drawing = _saved(figure, "svg", figure_id, {"Date": None, "Creator": None})
    files = {f"{figure_id}.png": with_palette(_saved(figure, "png", figure_id, {"Software": None}))}
    if b"<image" not in drawing and len(drawing) <= LARGEST_SVG:
        files[f"{figure_id}.svg"] = drawing
    _write(record, files)


def _saved(figure: Figure, form: str, salt: str, metadata: Mapping[str, None]) -> bytes:
    image = io.BytesIO()
    with plt.rc_context({"svg.hashsalt": salt}):
        figure.savefig(image, format=form, metadata=metadata)
    return image.getvalue()


def with_palette(png: bytes) -> bytes:
    """A PNG with 256 colours, a third of the size; as it was if that is not smaller."""
    image, small = Image.open(io.BytesIO(png)).convert("RGB"), io.BytesIO()
    # Colours that lie far apart first: white stays white, and small symbols keep their own.
    reduced = image.quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE)
    reduced.save(small, "PNG", optimize=True)
    return min(png, small.getvalue(), key=len)


def save_animation(
    animation_id: str,
    pictures: Sequence[np.ndarray],
    *,
    caption: str,
    numbers: Mapping[str, object],
) -> None:
    """Write pictures as an animated GIF, which every code host plays, and register it.

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
    record = _new_record("animation", animation_id, caption)
    record["numbers"] = as_json(dict(numbers), "numbers", DIGITS)
    # All as one strip get one palette. It starts from the colours that lie farthest apart: so a
    # small target keeps its own, which MEDIANCUT gives to the background.
    height, width = pictures[0].shape[:2]
    strip = Image.fromarray(np.concatenate(pictures))
    strip = strip.quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=1)
    tops = range(0, strip.height, height)
    first, *rest = (strip.crop((0, top, width, top + height)) for top in tops)
    durations = [PICTURE] * len(rest) + [3000]
    file = io.BytesIO()
    first.save(file, "GIF", save_all=True, append_images=rest, duration=durations, loop=0)
    _write(record, {f"{animation_id}.gif": file.getvalue()})


def save_slider(
    slider_id: str, figures: Mapping[str, Figure], *, caption: str, numbers: Mapping[str, object]
) -> HTML:
    """Register the first of some figures, close all, and show them behind a slider.

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
    frames = []
    for figure in figures.values():
        with plt.rc_context({"savefig.dpi": SLIDER_DPI}):
            frames.append(Image.open(io.BytesIO(_saved(figure, "png", slider_id, {}))))
        plt.close(figure)
    (width, height), strip = frames[0].size, io.BytesIO()
    Image.fromarray(np.concatenate([np.asarray(frame) for frame in frames])).save(strip, "PNG")
    coded = base64.b64encode(with_palette(strip.getvalue())).decode()
    shown = {"labels": list(figures), "caption": caption, "strip": coded}
    return HTML(page("slider.html", width=width, height=height, **shown))


def save_table(table_id: str, rows: Iterable[Mapping[str, object]], *, caption: str) -> Table:
    """Write a table as CSV and Markdown, and register it.

    Parameters
    ----------
    table_id : str
        The paper's number ("table_1", "table_S2") or a name of ours: letters, digits, _ and -.
    rows : iterable of mappings
        One per row, all with the same keys. A column named "seconds" holds wall times: two digits,
        and a second run of the same code keeps the recorded ones.
    caption : str
        The sentence on what to see.

    Returns
    -------
    Table
        As it was written; the last expression of a cell shows it.

    Raises
    ------
    ValueError
        On a malformed id, an empty caption, no rows, rows with different keys, a cell that is not
        a scalar, or an id that another notebook of this run owns.
    """
    record = _new_record("table", table_id, caption)
    plain = [{str(k): as_json(v, "rows", DIGITS) for k, v in row.items()} for row in rows]
    record["rows"] = _with_steady_seconds(record, plain)
    table = as_table(record)
    markdown = table._repr_markdown_().encode()
    _write(record, {f"{table_id}.csv": table.csv().encode(), f"{table_id}.md": markdown})
    return table


def load_table(table_id: str, folder: Path) -> Table:
    """Read a table of a folder back, its values as they were written.

    Raises
    ------
    FileNotFoundError
        If the folder holds no table of that id; the message lists those it holds.
    """
    record = read_json(folder / f"{table_id}.json")
    if record.get("kind") != "table":
        tables = [r["id"] for r in read_records(folder).values() if r["kind"] == "table"]
        raise FileNotFoundError(
            f"table_id: expected one of the tables in {folder} ({', '.join(tables) or 'none'}), "
            f"got {table_id!r}"
        )
    return as_table(record)


# ------------------------------------------------------------------------------------------ details


def _new_record(kind: str, artifact_id: str, caption: str) -> dict:
    """The part of a record that figures and tables share, checked."""
    taken = {Path(INDEX).stem, Path(RUN_TIMES).stem}
    if not re.fullmatch(r"[A-Za-z0-9_-]+", artifact_id) or artifact_id in taken:
        raise ValueError(
            f"{kind}_id: expected letters, digits, _ and -, other than "
            f"{' and '.join(sorted(taken))}, got {artifact_id!r}"
        )
    caption = " ".join(caption.split())
    if not caption:
        raise ValueError(f"caption: {kind} {artifact_id!r} needs a sentence, got an empty one")
    notebook = os.environ.get("VIDSINDY_NOTEBOOK")
    owner = read_json(figures_folder() / f"{artifact_id}.json").get("notebook")
    if notebook and owner not in (None, "interactive", notebook):
        raise ValueError(
            f"{kind}_id: {artifact_id!r} belongs to notebook {owner}, got it from {notebook} too"
        )
    return {
        "id": artifact_id,
        "kind": kind,
        "notebook": notebook or "interactive",
        "stamp": os.environ.get("VIDSINDY_STAMP"),
        "caption": caption,
        "files": [],
    }


def as_table(record: dict) -> Table:
    return Table(record["id"], record["caption"], tuple(record["rows"]), record["notebook"])


def _with_steady_seconds(record: dict, rows: list[dict]) -> list[dict]:
    """Round the wall times; take the recorded ones where the same code wrote the same rows."""
    before = read_json(figures_folder() / f"{record['id']}.json")
    is_same_code = record["stamp"] is not None and record["stamp"] == before.get("stamp")
    earlier = before.get("rows", []) if is_same_code else []
    for row in rows:
        if isinstance(row.get(SECONDS), int | float):
            row[SECONDS] = float(f"{row[SECONDS]:.2g}")
    for row, old in zip(rows, earlier, strict=False):
        if SECONDS in row and row | {SECONDS: None} == old | {SECONDS: None}:
            row[SECONDS] = old[SECONDS]
    return rows


def _shown(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _write(record: dict, files: Mapping[str, bytes]) -> None:
    """Write the files of a figure or table, then its record; remove what an earlier one had."""
    folder = figures_folder()
    earlier = read_json(folder / f"{record['id']}.json").get("files", [])
    record["files"] = list(files)
    for name, content in files.items():
        write_file(folder / name, content)
    write_file(folder / f"{record['id']}.json", json_bytes(record))
    for name in set(earlier) - files.keys():
        (folder / name).unlink(missing_ok=True)
