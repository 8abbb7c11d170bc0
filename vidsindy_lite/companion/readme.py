"""The parts of README and docs/ that a run of the notebooks writes: what they found, in what time.

Between a line ``<!-- name -->`` and the next ``<!-- end -->`` stands what the macro of that name in
``readme.md`` makes of the figures' registry. All else is written by hand.
"""

import json
import math
import re
from pathlib import Path

import jupytext
import pandas as pd

from ..stamp import write_file
from ..study import LEAST
from .artifacts import load_table
from .claims import claims_of
from .pages import macros
from .records import read_records
from .registry import load_run_times

PART = re.compile(r"(?<=^<!-- )(?!end )(\w+) -->\n.*?(?=<!-- end -->$)", re.DOTALL | re.MULTILINE)


WORDS, LINES = 200, 12  # of prose, of code, that one reads in a minute


def written_pages(root: Path) -> list[Path]:
    """The README of a repository and the pages of its docs/."""
    return [Path(root) / "README.md", *sorted((Path(root) / "docs").glob("*.md"))]


def write_readme(root: Path) -> None:
    """Write these pages anew, with their parts as the figures have them now."""
    for path in written_pages(root):
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
    figures = Path(root) / "figures"

    def numbers(figure_id: str) -> dict:
        return json.loads((figures / f"{figure_id}.json").read_text("utf-8"))["numbers"]

    def part(match: re.Match) -> str:
        name = match[1]
        if name not in PARTS:
            raise ValueError(f"text: a part must be one of {', '.join(PARTS)}, got {name!r}")
        return f"{name} -->\n{parts[name]()}\n"

    parts = macros(
        "readme.md",
        titles=_titles(Path(root)),
        minutes=lambda name: reading_minutes(Path(root) / "notebooks" / f"{name}.py"),
        headlines=headlines(figures),
        times=load_run_times(figures),
        frame=lambda table_id: pd.DataFrame(load_table(table_id, figures).rows, dtype=object),
        numbers=numbers,
        claimed=lambda: {page.stem: claims_of(page) for page in _claiming(Path(root))},
        least=LEAST,
    )
    return PART.sub(part, text)


def _claiming(root: Path) -> list[Path]:
    """The pages whose claims are listed."""
    return [root / "README.md", *sorted((root / "notebooks").glob("*.py"))]


def reading_minutes(notebook: Path) -> int:
    """Minutes that it takes to study a notebook, from its words and lines of code; in fives."""
    cells = jupytext.read(notebook).cells
    words = sum(len(cell.source.split()) for cell in cells if cell.cell_type == "markdown")
    lines = sum(len(cell.source.splitlines()) for cell in cells if cell.cell_type == "code")
    return 5 * math.ceil((words / WORDS + lines / LINES) / 5)


def _titles(root: Path) -> dict[str, str]:
    """The first heading of each notebook."""
    sources = {path.stem: path.read_text("utf-8") for path in (root / "notebooks").glob("*.py")}
    return {name: re.findall(r"^# # (.*)", sources[name], re.M)[0] for name in sorted(sources)}


def headlines(figures: Path) -> dict[str, str]:
    """By notebook; a notebook without one of these tables has none."""
    tables = [record for record in read_records(figures).values() if record["id"] in HEADLINES]
    return {
        t["notebook"]: HEADLINES[t["id"]](pd.DataFrame(t["rows"], dtype=object)) for t in tables
    }


def _below(value: float) -> str:
    """A bound with a margin: what others get of a number that is nearly nothing."""
    return f"below {LEAST if value <= LEAST else 10 ** math.ceil(math.log10(2 * value)):.0e}"


PARTS = tuple(macros("readme.md"))
HEADLINES = macros("headlines.md", below=_below)
