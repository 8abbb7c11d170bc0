"""What the notebooks produce: figures, tables, and the registry that keeps the folder honest.

A notebook hands each result over under an id, the paper's number where there is one:

    save_figure("fig_3", fig, caption="...", numbers={"noise": levels, "l2": errors})
    save_table("table_1", rows, caption="...")          # rows: a list of dicts

and the folder then holds, beside the image (PNG, SVG) or the table (CSV, Markdown), one JSON file
``<id>.json``: the registry's record (caption, notebook, stamp of the code that made it) together
with the plotted numbers or the rows. ``write_index`` turns the records into the folder's index
page, ``check_folder`` finds what is missing, stray or made by other code.

All files are deterministic: no dates, no library versions, six significant digits. Wall times are
the one thing that differs between two runs, so they are recorded by the first run of the same code
and kept by later ones: a table's column ``seconds``, and the run time of each notebook.

The folder is ``figures/`` at the root of the repository, or the one that the environment variable
VIDSINDY_FIGURES names. `vidsindy_lite.companion.run` sets it, VIDSINDY_NOTEBOOK and VIDSINDY_STAMP.
"""

import csv
import html
import io
import json
import math
import os
import platform
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from ..stamp import LIBRARIES, repository_root, write_file

__all__ = [
    "Table",
    "as_json",
    "check_folder",
    "figures_folder",
    "files_of",
    "load_run_times",
    "load_table",
    "prune",
    "record_run_time",
    "save_animation",
    "save_figure",
    "save_table",
    "versions",
    "write_index",
]

INDEX = "README.md"
RUN_TIMES = "run_times.json"
DIGITS = 6  # of the numbers in the records
SECONDS = "seconds"  # the column of a table that holds wall times


# ---------------------------------------------------------------------------------------- where


def figures_folder() -> Path:
    """The folder that figures and tables go to: VIDSINDY_FIGURES, or figures/ of the repository."""
    named = os.environ.get("VIDSINDY_FIGURES")
    return Path(named) if named else repository_root() / "figures"


def versions() -> str:
    """Python and the libraries that results depend on, as they are here, a line each."""
    lines = [f"{name} {metadata.version(name)}" for name in LIBRARIES]
    return "\n".join([f"Python {platform.python_version()}", *lines])


# ------------------------------------------------------------------------------------- what goes in


@dataclass(frozen=True)
class Table:
    """A registered table, shown by a notebook as HTML and by a terminal as text.

    Attributes
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

    def __post_init__(self):
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
        text = io.StringIO()
        writer = csv.DictWriter(text, self.columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(self.rows)
        return text.getvalue()

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
        head, *body = [[html.escape(cell) for cell in line] for line in self._cells()]
        style = ["left" if self._is_text(column) else "right" for column in self.columns]

        def line(tag: str, cells: list[str]) -> str:
            pairs = zip(style, cells, strict=True)
            inner = "".join(f'<{tag} style="text-align:{s}">{c}</{tag}>' for s, c in pairs)
            return f"<tr>{inner}</tr>\n"

        return (
            f"<table>\n<caption>{html.escape(self.caption)}</caption>\n"
            f"<thead>\n{line('th', head)}</thead>\n"
            f"<tbody>\n{''.join(line('td', cells) for cells in body)}</tbody>\n</table>"
        )


def save_figure(
    figure_id: str, figure: Figure, *, caption: str, numbers: Mapping[str, object]
) -> None:
    """Write a figure as PNG and SVG with the plotted numbers beside it, and register it.

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
    record = _new_record("figure", figure_id, caption, [f"{figure_id}.png", f"{figure_id}.svg"])
    record["numbers"] = as_json(dict(numbers), "numbers", DIGITS)
    for name in record["files"]:
        image = io.BytesIO()
        # Without these three, a PNG names the library and an SVG the date, with random ids.
        volatile = {"Software": None} if name.endswith(".png") else {"Date": None, "Creator": None}
        with plt.rc_context({"svg.hashsalt": figure_id}):
            figure.savefig(image, format=name[-3:], metadata=volatile)
        write_file(figures_folder() / name, image.getvalue())
    _write_record(record)


def save_animation(
    animation_id: str,
    pictures: Sequence[np.ndarray],
    *,
    caption: str,
    numbers: Mapping[str, object],
    rate: float = 12,
) -> None:
    """Write pictures as an animated GIF, which every code host plays, and register it.

    Parameters
    ----------
    animation_id : str
        As of `save_figure`.
    pictures : sequence of ndarray of uint8, shape (height, width, 3)
        One palette of 256 colours serves all of them.
    caption, numbers
        As of `save_figure`.
    rate : float
        Pictures per second. The last one stays for three seconds.

    Raises
    ------
    ValueError, TypeError
        As `save_figure` does.
    """
    record = _new_record("animation", animation_id, caption, [f"{animation_id}.gif"])
    record["numbers"] = as_json(dict(numbers), "numbers", DIGITS)
    # All as one strip get one palette. It starts from the colours that lie farthest apart: so a
    # small target keeps its own, which MEDIANCUT gives to the background.
    height, width = pictures[0].shape[:2]
    strip = Image.fromarray(np.concatenate(pictures))
    strip = strip.quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=1)
    tops = range(0, strip.height, height)
    first, *rest = (strip.crop((0, top, width, top + height)) for top in tops)
    durations = [round(1000 / rate)] * len(rest) + [3000]
    file = io.BytesIO()
    first.save(file, "GIF", save_all=True, append_images=rest, duration=durations, loop=0)
    write_file(figures_folder() / f"{animation_id}.gif", file.getvalue())
    _write_record(record)


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
    record = _new_record("table", table_id, caption, [f"{table_id}.csv", f"{table_id}.md"])
    plain = [as_json(dict(row), "rows", DIGITS) for row in rows]
    record["rows"] = _with_steady_seconds(record, plain)
    table = _table(record)
    write_file(figures_folder() / f"{table_id}.csv", table.csv().encode())
    write_file(figures_folder() / f"{table_id}.md", table._repr_markdown_().encode())
    _write_record(record)
    return table


def load_table(table_id: str, folder: str | os.PathLike | None = None) -> Table:
    """Read a registered table back, its values as they were written.

    Raises
    ------
    FileNotFoundError
        If the folder holds no table of that id; the message lists those it holds.
    """
    folder = figures_folder() if folder is None else Path(folder)
    record = _read(folder / f"{table_id}.json")
    if record.get("kind") != "table":
        tables = [r["id"] for r in _records(folder).values() if r["kind"] == "table"]
        raise FileNotFoundError(
            f"table_id: expected one of the tables in {folder} ({', '.join(tables) or 'none'}), "
            f"got {table_id!r}"
        )
    return _table(record)


def files_of(folder: str | os.PathLike, notebook: str) -> list[str]:
    """Names of the files that a notebook's figures and tables consist of."""
    records = [r for r in _records(Path(folder)).values() if r["notebook"] == notebook]
    return [name for record in records for name in (f"{record['id']}.json", *record["files"])]


def load_run_times(folder: str | os.PathLike) -> dict[str, float]:
    """Seconds that each notebook ran, two digits: what `record_run_time` has recorded."""
    return {name: entry["seconds"] for name, entry in _run_times(Path(folder)).items()}


def record_run_time(folder: str | os.PathLike, notebook: str, stamp: str, seconds: float) -> None:
    """Record how long a notebook ran, unless a run of the same code (stamp) already did."""
    path = Path(folder) / RUN_TIMES
    times = _run_times(path.parent)
    if times.get(notebook, {}).get("stamp") != stamp:
        times[notebook] = {"seconds": float(f"{seconds:.2g}"), "stamp": stamp}
        write_file(path, _json(dict(sorted(times.items()))))


# ---------------------------------------------------------------------- what the folder adds up to


def write_index(folder: str | os.PathLike) -> Path:
    """Write the folder's index page (README.md, which code hosts show) from the registry."""
    folder = Path(folder)
    records, times = _records(folder), _run_times(folder)
    notebooks = sorted({record["notebook"] for record in records.values()} | set(times))
    page = [
        "# Figures and tables",
        "Written by the notebooks (`make figures`); do not edit. Beside each image and table lie "
        "its numbers. Run times are those of the first run of this code.",
        "| notebook | run time | figures and tables |\n|---|---:|---|\n"
        + "\n".join(_contents_line(notebook, records, times) for notebook in notebooks),
    ]
    for notebook in notebooks:
        mine = [record for record in records.values() if record["notebook"] == notebook]
        if mine:
            page.append(f"## {_notebook_link(notebook)}")
        for record in mine:
            page += [f"### {record['id']}", _exhibit(record)]
    write_file(folder / INDEX, ("\n\n".join(page) + "\n").encode())
    return folder / INDEX


def check_folder(
    folder: str | os.PathLike, stamps: Mapping[str, str | None] | None = None
) -> list[str]:
    """What is wrong with a folder of figures; an empty list means nothing.

    Parameters
    ----------
    folder : path
    stamps : mapping of notebook to stamp, optional
        The notebooks there are, each with the stamp that its figures and tables must carry; None
        accepts any. Without the mapping, origins are not checked.

    Returns
    -------
    list of str
        One line per registered file that is missing, file that nothing registers, record of a
        notebook that is not there, and record made by other code than the stamp's.
    """
    folder = Path(folder)
    records = _records(folder)
    expected = {INDEX} | ({RUN_TIMES} if (folder / RUN_TIMES).exists() else set())
    for record in records.values():
        expected |= {f"{record['id']}.json", *record["files"]}
    present = {path.name for path in folder.glob("*") if not path.name.startswith(".")}
    problems = [f"{name}: registered, but missing" for name in sorted(expected - present)]
    problems += [f"{name}: nothing registers it" for name in sorted(present - expected)]
    for record in records.values() if stamps is not None else ():
        if record["notebook"] not in stamps:
            problems.append(f"{record['id']}: no notebook {record['notebook']!r} to make it")
        elif stamps[record["notebook"]] not in (None, record["stamp"]):
            problems.append(f"{record['id']}: {record['notebook']} has changed since it was made")
    return problems


def prune(folder: str | os.PathLike, stamps: Mapping[str, str | None]) -> None:
    """Remove the figures and tables that no notebook writes any longer, and their run times.

    Parameters
    ----------
    folder : path
    stamps : mapping of notebook to stamp
        As in `check_folder`: what it would report as made by nobody, or by other code, goes.
    """
    folder = Path(folder)
    for record in _records(folder).values():
        notebook = record["notebook"]
        if notebook not in stamps or stamps[notebook] not in (None, record["stamp"]):
            for name in (f"{record['id']}.json", *record["files"]):
                (folder / name).unlink(missing_ok=True)
    times = _run_times(folder)
    if times.keys() - stamps.keys():
        write_file(folder / RUN_TIMES, _json({n: t for n, t in times.items() if n in stamps}))


# ------------------------------------------------------------------------------------------ details


def _new_record(kind: str, artifact_id: str, caption: str, files: list[str]) -> dict:
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
    owner = _read(figures_folder() / f"{artifact_id}.json").get("notebook")
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
        "files": files,
    }


def _table(record: dict) -> Table:
    return Table(record["id"], record["caption"], tuple(record["rows"]), record["notebook"])


def _with_steady_seconds(record: dict, rows: list[dict]) -> list[dict]:
    """Round the wall times; take the recorded ones where the same code wrote the same rows."""
    before = _read(figures_folder() / f"{record['id']}.json")
    if before.get("stamp") != record["stamp"] or record["stamp"] is None:
        before = {}
    for row in rows:
        if isinstance(row.get(SECONDS), int | float):
            row[SECONDS] = float(f"{row[SECONDS]:.2g}")
    for row, old in zip(rows, before.get("rows", []), strict=False):
        if SECONDS in row and _without_seconds(row) == _without_seconds(old):
            row[SECONDS] = old[SECONDS]
    return rows


def _without_seconds(row: dict) -> dict:
    return {column: value for column, value in row.items() if column != SECONDS}


def as_json(value: object, name: str, digits: int = 17) -> object:
    """A value as JSON has it.

    Parameters
    ----------
    value : object
        Numbers, text, None, and arrays and nestings of them. What is not finite becomes None.
    name : str
        Of the argument, for the error.
    digits : int
        Significant ones of a float; the default keeps it exactly.

    Raises
    ------
    TypeError
        If there is anything else in it.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return float(f"{value:.{digits}g}") if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(k): as_json(item, f"{name}[{k!r}]", digits) for k, item in value.items()}
    if isinstance(value, Sequence):
        return [as_json(item, name, digits) for item in value]
    raise TypeError(
        f"{name}: expected numbers, text, None, or arrays and mappings of them, got {value!r}"
    )


def _shown(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _json(content: dict) -> bytes:
    """JSON with one line per entry, one more level for mappings and lists of mappings."""

    def entry(value: object) -> str:
        if isinstance(value, dict) and value:
            items = (f"  {json.dumps(k)}: {json.dumps(v)}" for k, v in value.items())
            return "{\n" + ",\n".join(items) + "\n }"
        if isinstance(value, list) and value and isinstance(value[0], dict):
            return "[\n" + ",\n".join(f"  {json.dumps(item)}" for item in value) + "\n ]"
        return json.dumps(value)

    lines = (f" {json.dumps(key)}: {entry(value)}" for key, value in content.items())
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode()


def _write_record(record: dict) -> None:
    write_file(figures_folder() / f"{record['id']}.json", _json(record))


def _read(path: Path) -> dict:
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def _run_times(folder: Path) -> dict:
    return _read(folder / RUN_TIMES)


def _records(folder: Path) -> dict[str, dict]:
    """All records by id, in the order of a reader: S2 before S10."""
    contents = [_read(path) for path in folder.glob("*.json") if path.name != RUN_TIMES]
    records = {content["id"]: content for content in contents if "id" in content}

    def order(artifact_id: str) -> list:
        return [int(p) if p.isdigit() else p for p in re.split(r"(\d+)", artifact_id)]

    return {artifact_id: records[artifact_id] for artifact_id in sorted(records, key=order)}


def _notebook_link(notebook: str) -> str:
    return f"[{notebook}](../notebooks/{notebook}.ipynb)"


def _contents_line(notebook: str, records: dict, times: dict) -> str:
    seconds = times.get(notebook, {}).get("seconds")
    duration = "" if seconds is None else f"about {seconds:.0f} s" if seconds > 1 else "about 1 s"
    ids = [r["id"] for r in records.values() if r["notebook"] == notebook]
    links = ", ".join(f"[{artifact_id}](#{artifact_id.lower()})" for artifact_id in ids)
    return f"| {_notebook_link(notebook)} | {duration} | {links} |"


def _exhibit(record: dict) -> str:
    artifact_id = record["id"]
    if record["kind"] == "animation":
        body = f"![{artifact_id}]({artifact_id}.gif)\n\n{record['caption']}"
        return f"{body}\n\n[numbers]({artifact_id}.json)"
    if record["kind"] == "figure":
        body = f"![{artifact_id}]({artifact_id}.png)\n\n{record['caption']}"
        return f"{body}\n\n[SVG]({artifact_id}.svg) · [numbers]({artifact_id}.json)"
    links = f"[CSV]({artifact_id}.csv) · [numbers]({artifact_id}.json)"
    return f"{_table(record)._repr_markdown_()}\n{links}"
