"""Exercises, made of notebooks/solutions/ by `python tests/exercises.py`, `--force` of all.

Of cells with the tag `solution` text is left out, code becomes a blank cell with the names that the
check behind it looks at, which says whether what they are is right.
"""

import ast
import copy
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import jupytext
import nbformat
from nbformat import NotebookNode

from vidsindy_lite.companion.compare import same_notebook
from vidsindy_lite.companion.run import execute, tidy
from vidsindy_lite.storage import PACKAGE, write_file

NOTEBOOKS = PACKAGE.parent / "notebooks"
SOLUTIONS = sorted((NOTEBOOKS / "solutions").glob("*.py"))
BLANK = "# Your code here: set "


def names(source: str, context: type[ast.expr_context]) -> set[str]:
    """Names that a cell sets (`ast.Store`) or reads (`ast.Load`), but for comprehensions."""
    nodes = list(ast.walk(ast.parse(source)))
    inner = {n.target for n in nodes if isinstance(n, ast.comprehension)}
    own = {n.id for target in inner for n in ast.walk(target) if isinstance(n, ast.Name)}
    found = {n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, context)} - own
    defined = {n.name for n in nodes if isinstance(n, ast.FunctionDef)}
    return found | (defined if context is ast.Store else set())


def exercise(solutions: Path) -> NotebookNode:
    """The notebook with blank cells, from the source half of its solutions."""
    source = jupytext.read(solutions)
    cells = []
    for index, cell in enumerate(copy.deepcopy(source.cells)):
        if "solution" in cell.metadata.pop("tags", []):
            if cell.cell_type == "markdown":
                continue
            check = source.cells[index + 1].source
            asked = sorted(names(cell.source, ast.Store) & names(check, ast.Load))
            cell.source = BLANK + ", ".join(asked) + "."
        cell.id = f"cell-{len(cells):02d}"
        cell.source = cell.source.replace("# Solutions: ", "# Exercises: ", 1)
        cells.append(cell)
    metadata = {key: source.metadata[key] for key in source.metadata if key == "kernelspec"}
    metadata["jupytext"] = {"formats": "ipynb"}  # or JupyterLab writes a .py half beside it
    return nbformat.v4.new_notebook(cells=cells, metadata=metadata)


def executed(solutions: Path) -> NotebookNode:
    """Solutions with their outputs."""
    with TemporaryDirectory() as folder:
        return tidy(execute(solutions, {}, folder), jupytext.read(solutions))


def is_new(solutions: Path) -> bool:
    """Whether the executed half is not of this source."""
    half = solutions.with_suffix(".ipynb")
    if not half.exists():
        return True
    ours, theirs = jupytext.read(solutions).cells, nbformat.read(half, 4).cells
    return [cell.source for cell in ours] != [cell.source for cell in theirs]


def write(half: Path, notebook: NotebookNode) -> None:
    """Put a notebook into a file."""
    half.parent.mkdir(exist_ok=True)
    write_file(half, (nbformat.writes(notebook) + "\n").encode())


if __name__ == "__main__":
    for path in SOLUTIONS:
        write(NOTEBOOKS / "exercises" / f"{path.stem}.ipynb", exercise(path))
        half = path.with_suffix(".ipynb")
        if "--force" in sys.argv or is_new(path):
            notebook = executed(path)
            if not half.exists() or not same_notebook(nbformat.read(half, 4), notebook):
                write(half, notebook)
                print(half.relative_to(NOTEBOOKS), flush=True)
