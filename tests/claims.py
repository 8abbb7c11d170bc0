"""The claims of the README and of the notebooks, each with the check behind it.

After a claim stands a comment that no reader sees, ``<!-- by: CHECK; CHECK -->``. A check is a part
of an assertion in the notebook's code; ``05: part`` is one in notebook 05; a path with a name is a
test as pytest names it. The claim is false if one of them fails, so it has at least one. Beside
them, ``figure ID`` and a page of docs/ say where its numbers are shown.
"""

import ast
import json
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import jupytext
from nbformat import NotebookNode

from vidsindy_lite.storage import PACKAGE, write_file

BY = re.compile(r"\s*<!-- by: (.*?) -->", re.DOTALL)
# What a notebook claims: the items and the answers to the paper under these headings.
CLAIMING = re.compile(r"^## What (?:we learned|the paper says).*?(?=^## Exercises)", re.M | re.S)
ITEM = re.compile(r"\n\s*\n|\n(?=\* )")


@dataclass(frozen=True)
class Claim:
    """What is said, and by which checks, both as Markdown for a page in docs/."""

    text: str
    checks: tuple[str, ...]


def pages(root: Path) -> dict[str, str]:
    """What README and docs/ say after the notebooks: the tour's law, and all claims; by name.

    They stand between a line ``<!-- name -->`` and the next ``<!-- end -->``.
    """
    law = json.loads((root / "figures" / "tour.json").read_text("utf-8"))["numbers"]["equations"]
    sections = []
    for page in [root / "README.md", *sorted((root / "notebooks").glob("*.py"))]:
        title = (
            "README" if page.suffix == ".md" else f"[{page.stem}](../notebooks/{page.stem}.ipynb)"
        )
        claims = [[f"* {c.text}", *(f"  * {check}" for check in c.checks)] for c in claims_of(page)]
        sections.append("\n".join([f"\n## {title}\n", *sum(claims, [])]))
    parts = {
        "README.md": ("equations", "\n".join(["```", *law, "```"])),
        "docs/claims.md": ("claims", "\n".join([*sections, ""])),
    }
    return {
        name: re.sub(
            rf"(?<=^<!-- {mark} -->\n).*?(?=^<!-- end -->$)",
            part.replace("\\", r"\\") + "\n",
            (root / name).read_text("utf-8"),
            flags=re.DOTALL | re.MULTILINE,
        )
        for name, (mark, part) in parts.items()
    }


def claims_of(page: Path) -> list[Claim]:
    """The claims of a notebook's source half, or of a Markdown page, in order.

    Parameters
    ----------
    page : path
        In the repository: README.md, or notebooks/NN_name.py.

    Raises
    ------
    ValueError
        If a claim has no check, or names one that is not there.
    """
    if page.suffix == ".md":
        items = [item for item in ITEM.split(page.read_text("utf-8")) if BY.search(item)]
    else:
        cells = _cells(page.read_text("utf-8"), "markdown")
        said = "".join(CLAIMING.findall("\n\n".join(cells)))
        items = [item for item in ITEM.split(said) if item.startswith(("* ", "**What the paper"))]
        items = [item for item in items if not item.rstrip().endswith("what we found.**")]
    return [_claim(item, page) for item in items]


def _claim(item: str, page: Path) -> Claim:
    """One claim with its checks looked up."""
    text = " ".join(BY.sub("", item).removeprefix("* ").split())
    text = re.sub(r"\]\((?:notebooks/)?(?=\d\d\w?_)", "](../notebooks/", text).replace(
        "](docs/", "]("
    )  # as from docs/
    if not (by := BY.search(item)):
        raise ValueError(f"{page.name}: no check is named behind {text!r}")
    checks = tuple(_check(" ".join(check.split()), page) for check in by[1].split("; "))
    if not any(check.startswith("false unless") for check in checks):
        raise ValueError(f"{page.name}: nothing could make it false: {text!r}")
    return Claim(text, checks)


def _check(name: str, page: Path) -> str:
    """A check as Markdown, if it is there."""
    root = page.parent if page.suffix == ".md" else page.parent.parent
    kind, _, rest = name.partition(" ")
    path, _, test = name.partition("::")
    if kind == "figure" and (root / "figures" / f"{rest}.json").exists():
        return f"shown in [{rest}](../figures/README.md#{rest.lower()})"
    if test and (root / path).exists() and f"def {test}(" in (root / path).read_text("utf-8"):
        return f"false unless `{name}`"
    if path.startswith("docs/") and (root / path).exists():
        return f"stated in [{path}]({Path(path).name})"
    number = re.match(r"(\d\d\w?): ", name)
    (notebook,) = (root / "notebooks").glob(f"{number[1]}_*.py") if number else [page]
    part = name.removeprefix(number[0]) if number else name
    if notebook.suffix == ".py" and (found := _assertion(part, notebook)):
        return f"false unless `{found}`" + (f" in {number[1]}" if number else "")
    raise ValueError(f"{page.name}: no assertion, figure, test or page is {name!r}")


def _assertion(part: str, notebook: Path) -> str:
    """The assertion of a notebook that holds a piece of code, in one line; empty if none does."""
    found = (line for line in _assertions(notebook.read_text("utf-8")) if part in line)
    return next(found, "").removeprefix("assert ")


@cache  # many claims look into one notebook
def _assertions(notebook: str) -> list[str]:
    """All assertions of a notebook's source half, in one line each."""
    return [
        " ".join((ast.get_source_segment(source, node) or "").split())
        for source in _cells(notebook, "code")
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Assert)
    ]


def _cells(notebook: str, kind: str) -> list[str]:
    """The sources of the cells of one kind."""
    return [cell.source for cell in _read(notebook).cells if cell.cell_type == kind]


@cache
def _read(notebook: str) -> NotebookNode:
    """A notebook from its source half."""
    return jupytext.reads(notebook, "py:percent")


if __name__ == "__main__":
    for name, text in pages(PACKAGE.parent).items():
        write_file(PACKAGE.parent / name, text.encode())
