"""Slides of a session: headings, equations, figures and claims of the notebooks that it is about.

Which these are, in what order, says the plan in docs/teaching.md. A slide is a section of one page.
"""

import re
from pathlib import Path

import jupytext
from nbformat import NotebookNode

from .claims import claims_of
from .pages import page
from .readme import headlines
from .records import read_records

PLANNED = re.compile(r"\]\(\.\./(notebooks/\d\d_\w+)\.ipynb\)")
SHOWN = re.compile(r"^## [^\n]*|\$\$.*?\$\$", re.MULTILINE | re.DOTALL)
SAVED = re.compile(r'^save_(?:figure|slider|animation)\(\s*"(\w+)"', re.MULTILINE)
SECTION = re.compile(r"^(?=## )", re.MULTILINE)
CLOSING = ("## What", "## Exercises", "## Run time")  # are told in another way, or left out


def slides(root: Path) -> str:
    """The page as Markdown, to lie in docs/.

    Parameters
    ----------
    root : path
        A repository with docs/teaching.md, the notebooks that it links to, and their figures/.
    """
    plan = (root / "docs" / "teaching.md").read_text("utf-8")
    paths = [root / f"{name}.py" for name in dict.fromkeys(PLANNED.findall(plan))]
    records, said = read_records(root / "figures"), headlines(root / "figures")
    parts = [
        {"name": path.stem, "headline": said.get(path.stem), "claims": claims_of(path)}
        | _opening_and_sections(path, records)
        for path in paths
    ]
    return page("slides.md", parts=parts)


def _opening_and_sections(path: Path, records: dict[str, dict]) -> dict[str, object]:
    """A notebook's title, what it says that one will see, and the sections that show something."""
    first, *rest = jupytext.read(path).cells
    title, said = first.source.split("\n", 1)
    sections = SECTION.split("\n\n".join(_shown(cell, records) for cell in rest))[1:]
    told = [s.strip() for s in sections if "\n" in s.strip() and not s.startswith(CLOSING)]
    return {
        "title": title.removeprefix("# "),
        "opening": said.split("**What you need**")[0].strip(),
        "sections": told,
    }


def _shown(cell: NotebookNode, records: dict[str, dict]) -> str:
    """The headings and equations of a cell, or the figures that it makes."""
    if cell.cell_type != "code":
        return "\n\n".join(SHOWN.findall(cell.source))
    made = [records[name] for name in SAVED.findall(cell.source) if name in records]
    return "\n\n".join(
        f"![{one['caption']}](../figures/{one['files'][0]})\n\n*{one['caption']}*" for one in made
    )
