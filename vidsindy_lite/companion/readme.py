"""The parts of the README that a run of the notebooks writes: what they found, and in what time.

Between a line ``<!-- name -->`` and the next ``<!-- end -->`` stands what `PARTS` makes under that
name of the figures' registry. All else is written by hand.
"""

import json
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..stamp import write_file
from ..study import LEAST
from .artifacts import Table, as_table, load_table
from .records import read_records
from .registry import load_run_times

PART = re.compile(r"(?<=^<!-- )(?!end )(\w+) -->\n.*?(?=<!-- end -->$)", re.DOTALL | re.MULTILINE)


def write_readme(root: Path) -> None:
    """Write the README of a repository anew, with its parts as the figures have them now."""
    path = Path(root) / "README.md"
    write_file(path, fill(path.read_text("utf-8"), root).encode())


def fill(text: str, root: Path) -> str:
    """A text with every part replaced by what it has to be.

    Parameters
    ----------
    text : str
        Markdown with marked parts.
    root : path
        The repository whose notebooks and figures/ the parts are about.

    Raises
    ------
    ValueError
        On a part of an unknown name.
    FileNotFoundError
        If a table is missing that a part shows.
    """

    def part(match: re.Match) -> str:
        name = match[1]
        if name not in PARTS:
            raise ValueError(f"text: a part must be one of {', '.join(PARTS)}, got {name!r}")
        return f"{name} -->\n{PARTS[name](Path(root))}\n"

    return PART.sub(part, text)


# -------------------------------------------------------------------------------------- the parts


def notebooks(root: Path) -> str:
    """A line per notebook: title, headline result, run time."""
    figures = root / "figures"
    times, headlines = load_run_times(figures), _headlines(figures)
    lines = ["| notebook | what it shows | result | run time |", "|---|---|---|---:|"]
    for path in sorted((root / "notebooks").glob("*.py")):
        (title, *_) = re.findall(r"^# # (.*)", path.read_text("utf-8"), re.MULTILINE)
        time = f"{times[path.stem]:.0f} s" if path.stem in times else ""
        link = f"[{path.stem}](notebooks/{path.stem}.ipynb)"
        lines.append(f"| {link} | {title} | {headlines.get(path.stem, '')} | {time} |")
    return "\n".join(lines)


def equations(root: Path) -> str:
    """The law that the tour finds, with its standard errors."""
    record = json.loads((root / "figures" / "tour.json").read_text("utf-8"))
    return "\n".join(["```", *record["numbers"]["equations"], "```"])


def table_1(root: Path) -> str:
    """Ours and the baseline beside the paper's of the same, system by system."""
    return _beside_the_paper(load_table("table_1", root / "figures"), ["system"])


def table_2(root: Path) -> str:
    """Ours and the ablated model beside the paper's of the same, condition by condition."""
    return _beside_the_paper(load_table("table_2", root / "figures"), ["condition", "rate (%)"])


PARTS: dict[str, Callable[[Path], str]] = {
    part.__name__: part for part in (notebooks, equations, table_1, table_2)
}


def _beside_the_paper(table: Table, keys: list[str]) -> str:
    """Relative l2 in 1e-2, with the number of false positives if there are any, by method."""
    groups: dict[tuple, list[str]] = {}
    methods = dict.fromkeys(row["method"] for row in table.rows)  # in the order of every group
    for row in table.rows:
        groups.setdefault(tuple(row[key] for key in keys), []).extend(
            [
                _cell(row["l2 (e-2)"], row["false positives"], row["terms found"]),
                _cell(row["paper: l2 (e-2)"], row["paper: false positives"]),
            ]
        )
    names = [name for method in methods for name in (method, f"{method}, paper")]
    head = [*(key.removesuffix(" (%)") for key in keys), *names]
    lines = [head, ["---"] * len(keys) + ["---:"] * len(names)]
    for key, cells in groups.items():
        shown = [f"{value:g} %" if isinstance(value, float | int) else value for value in key]
        lines.append([*shown, *cells])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cell(l2: float, false: float, found: str = "") -> str:
    """An error, and what besides is wrong: false terms, trials in which a term is missing."""
    hits, trials = map(int, found.split(" of ")) if found else (0, 0)
    wrong = [f"{false:g} false"] if false else []
    wrong += [f"misses in {trials - hits} of {trials}"] if hits < trials else []
    shown = f"< {100 * LEAST:g}" if l2 <= 100 * LEAST else f"{l2:.3g}"
    return shown + (f" ({', '.join(wrong)})" if wrong else "")


# ------------------------------------------------------------------------------------- headlines


def _below(value: float) -> str:
    """A bound with a margin: what others get of a number that is nearly nothing."""
    return f"below {LEAST if value <= LEAST else 10 ** math.ceil(math.log10(2 * value)):.0e}"


def _tour(table: Table) -> str:
    (row,) = table.rows
    found = row["true terms"] - row["missing"]
    return f"{found} of {row['true terms']} terms, {row['false']} false, l2 {row['l2']}"


def _projection(table: Table) -> str:
    right, text = (row["shift of the image"] for row in table.rows)
    return f"shift of the image by the plane's D: {right}; with the text's rotation: {text}"


def _tracker(table: Table) -> str:
    rms = {row["videos"]: row["rms error (px)"] for row in table.rows}
    return f"rms error {rms['clean']:.1g} px clean, {rms['noise, variance 0.01']:.1g} px with noise"


def _cameras(table: Table) -> str:
    row = next(r for r in table.rows if (r["pixels"], r["method"]) == ("rounded", "joint"))
    return f"from whole pixels: scales to {100 * row['error of scale']:.1g} %"


def _optimisers(table: Table) -> str:
    most = max(row["noise (%)"] for row in table.rows)
    l2 = {row["optimiser"]: row for row in table.rows if row["noise (%)"] == most}
    paper, ours = (f"{l2[name]['l2 (%)']:.2g} %, {l2[name]['false']} false" for name in l2)
    return f"{most:g} % noise: {ours}; the paper's optimiser {paper}"


def _systems(table: Table) -> str:
    exact = [list(map(int, row["exact"].split(" of "))) for row in table.rows]
    hits, trials = np.sum(exact, axis=0)
    worst = max(row["l2 (e-2)"] for row in table.rows)
    return f"{hits} of {trials} trials exact, l2 {_below(worst / 100)}"


def _ablation(table: Table) -> str:
    ours = [row for row in table.rows if row["method"] == "ours"]
    better = sum(row["l2 (e-2)"] < row["paper: l2 (e-2)"] for row in ours)
    return f"smaller error than the paper's in {better} of {len(ours)} conditions"


def _scene(table: Table) -> str:
    exact = sum(row["exact terms"] for row in table.rows)
    worst = max(row["l2 (e-2)"] for row in table.rows)
    return f"{exact} of {len(table.rows)} trials exact, l2 {_below(worst / 100)}"


def _own(table: Table) -> str:
    late = [row["lag (frames)"] for row in table.rows]
    return f"a video that starts {max(late):.1f} frames late, the law exact"


def _lab(table: Table) -> str:
    rms = {row["cameras"]: row["rms (mm)"] for row in table.rows}
    return f"rms {rms['orthographic']:.1f} mm orthographic, {rms['perspective']:.2g} mm perspective"


def _audit(table: Table) -> str:
    return f"{len(table.rows)} findings, each with a verdict"


# One line for a notebook: by the table it is read from, which names its notebook.
HEADLINES: dict[str, Callable[[Table], str]] = {
    "tour_score": _tour,
    "projection_shift": _projection,
    "videos_tracker": _tracker,
    "cameras_methods": _cameras,
    "solver_optimisers": _optimisers,
    "table_systems": _systems,
    "table_2": _ablation,
    "scene_equations": _scene,
    "own_cameras": _own,
    "lab_models": _lab,
    "audit": _audit,
}


def _headlines(figures: Path) -> dict[str, str]:
    """By notebook; a notebook without one of these tables has none."""
    tables = [as_table(r) for r in read_records(figures).values() if r["id"] in HEADLINES]
    return {table.notebook: HEADLINES[table.table_id](table) for table in tables}
