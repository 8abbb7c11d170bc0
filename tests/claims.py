"""The claims of the README and of the notebooks, each with the check behind it.

After a claim stands a hidden comment, ``<!-- by: CHECK; CHECK -->``. A check, at least one, is a
part of an assertion in the notebook's code, ``05: part`` in notebook 05, or a test as pytest names
it; ``figure ID`` and a page of docs/ say where its numbers are shown.
"""

import ast
import json
import re
from functools import cache
from pathlib import Path

import jupytext

from vidsindy_lite.storage import PACKAGE, write_file

BY = re.compile(r"\s*<!-- by: (.*?) -->", re.DOTALL)
# What a notebook claims: the items and the answers to the paper under these headings.
CLAIMING = re.compile(r"^## What (?:we learned|the paper says).*?(?=^## Exercises)", re.M | re.S)
ITEM = re.compile(r"\n\s*\n|\n(?=\* )")


def pages(root: Path) -> dict[str, str]:
    """What README and docs/ say after the notebooks, from ``<!-- name -->`` to ``<!-- end -->``."""
    law = json.loads((root / "figures" / "tour.json").read_text("utf-8"))["numbers"]["equations"]
    listed = []
    for page in [root / "README.md", *sorted((root / "notebooks").glob("*.py"))]:
        notebook = f"[{page.stem}](../notebooks/{page.stem}.ipynb)"
        listed.append(f"\n## {'README' if page.suffix == '.md' else notebook}\n")
        for text, checks in claims_of(page):
            listed += [f"* {text}", *(f"  * {check}" for check in checks)]
    parts = {
        "README.md": ("equations", ["```", *law, "```"]),
        "docs/claims.md": ("claims", [*listed, ""]),
    }
    return {
        name: re.sub(
            rf"(?<=^<!-- {mark} -->\n).*?(?=^<!-- end -->$)",
            "\n".join([*part, ""]).replace("\\", r"\\"),
            (root / name).read_text("utf-8"),
            flags=re.DOTALL | re.MULTILINE,
        )
        for name, (mark, part) in parts.items()
    }


def claims_of(page: Path) -> list[tuple[str, list[str]]]:
    """The claims of README.md or of a notebook's source half with their checks, as for docs/."""
    if page.suffix == ".md":
        items = [item for item in ITEM.split(page.read_text("utf-8")) if BY.search(item)]
    else:
        said = "".join(CLAIMING.findall("\n\n".join(cells(page, "markdown"))))
        items = [item for item in ITEM.split(said) if item.startswith(("* ", "**What the paper"))]
        items = [item for item in items if not item.rstrip().endswith("what we found.**")]
    claims = []
    for item in items:
        text = " ".join(BY.sub("", item).removeprefix("* ").split())
        text = re.sub(r"\]\((?:notebooks/)?(?=\d\d\w?_)", "](../notebooks/", text)
        by = BY.search(item)
        if not by:
            raise ValueError(f"{page.name}: no check is named behind {text!r}")
        checks = [checked(" ".join(check.split()), page) for check in by[1].split("; ")]
        if not any(check.startswith("false unless") for check in checks):
            raise ValueError(f"{page.name}: nothing could make it false: {text!r}")
        claims.append((text.replace("](docs/", "]("), checks))
    return claims


def checked(name: str, page: Path) -> str:
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
    number, part = re.fullmatch(r"(?:(\d\d\w?): )?(.*)", name).groups()
    (notebook,) = (root / "notebooks").glob(f"{number}_*.py") if number else [page]
    found = next((line for line in assertions(notebook) if part in line), None)
    if found is None:
        raise ValueError(f"{page.name}: no assertion, figure, test or page is {name!r}")
    return f"false unless `{found}`" + (f" in {number}" if number else "")


@cache  # many claims look into one notebook
def assertions(page: Path) -> list[str]:
    """All assertions of a notebook's source half, in one line each; of another page none."""
    return [
        " ".join(ast.get_source_segment(source, node).split()).removeprefix("assert ")
        for source in (cells(page, "code") if page.suffix == ".py" else ())
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Assert)
    ]


@cache
def cells(notebook: Path, kind: str) -> list[str]:
    """The sources of the cells of one kind of a notebook's source half."""
    return [cell.source for cell in jupytext.read(notebook).cells if cell.cell_type == kind]


if __name__ == "__main__":
    for name, text in pages(PACKAGE.parent).items():
        write_file(PACKAGE.parent / name, text.encode())
