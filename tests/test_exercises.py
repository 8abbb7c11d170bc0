"""Exercises and their solutions: the pair agrees, checks hold for these and for no blank."""

import ast
import re

import jupytext
import nbformat
import pytest
from exercises import BLANK, NOTEBOOKS, SOLUTIONS, exercise, names
from test_notebooks import LONGEST, count_lines, executed_problems

SOURCES = sorted(NOTEBOOKS.glob("*.py"))
KINDS = r"^\*\*(\d)\.\*\* \((?:Explore|Implement|Prove)\.\)"


def check_problems(path):
    """Exercises without a blank cell, and checks that look at nothing of what it made."""
    notebook, problems, made, asked = jupytext.read(path), [], None, []
    for cell in notebook.cells:
        tags = cell.metadata.get("tags", [])
        if cell.cell_type == "markdown":
            asked += re.findall(KINDS, cell.source, re.MULTILINE)
        elif "solution" in tags:
            made = (made or set()) | names(cell.source, ast.Store)
        elif made is not None:
            if not made & names(cell.source, ast.Load) or 'print("right")' not in cell.source:
                problems.append(f"exercise {asked[-1]}: its check sees nothing of the answer")
            made, asked = None, asked[:-1]
    problems += [f"exercise {number}: no check" for number in asked]
    code = [(i, cell.source) for i, cell in enumerate(notebook.cells) if cell.cell_type == "code"]
    long = [i for i, source in code if count_lines(source) > LONGEST]
    return problems + [f"cell {i}: more than {LONGEST} lines" for i in long]


def run_cells(notebook, seed):
    """All code cells in one namespace, from another seed."""
    space = {"__name__": "__main__"}
    for index, cell in enumerate(notebook.cells):
        if cell.cell_type == "code":
            source = re.sub(r"^seed: int = 0", f"seed: int = {seed}", cell.source)
            exec(compile(source, f"cell {index}", "exec"), space)


def test_every_notebook_has_exercises():
    assert [path.stem for path in SOLUTIONS] == [path.stem for path in SOURCES]
    made = {path.stem for path in (NOTEBOOKS / "exercises").glob("*.ipynb")}
    assert made == {path.stem for path in SOURCES}


@pytest.mark.parametrize("path", SOLUTIONS, ids=lambda path: path.stem)
@pytest.mark.parametrize("gate", [check_problems, executed_problems])
def test_solutions_pass(path, gate):
    assert gate(path) == []


@pytest.mark.parametrize("path", SOLUTIONS, ids=lambda path: path.stem)
def test_exercises_are_their_solutions_with_blank_cells(path):
    committed = nbformat.read(NOTEBOOKS / "exercises" / f"{path.stem}.ipynb", 4)
    assert committed == exercise(path), "python tests/exercises.py makes them"
    questions = sum(len(re.findall(KINDS, c.source, re.MULTILINE)) for c in committed.cells)
    assert 2 <= questions <= 4
    assert sum(cell.source.startswith(BLANK) for cell in committed.cells) == questions


@pytest.mark.notebooks
@pytest.mark.parametrize("path", SOLUTIONS, ids=lambda path: path.stem)
def test_solutions_are_right(path):
    run_cells(jupytext.read(path), seed=1)


@pytest.mark.parametrize("path", SOLUTIONS, ids=lambda path: path.stem)
def test_a_wrong_letter_is_not_right(path):
    for cell in jupytext.read(path).cells:
        for check in re.findall(r"^assert crc32\(f.*\{answer\}.*$", cell.source, re.MULTILINE):
            with pytest.raises(AssertionError, match="not yet"):
                exec(f"from zlib import crc32\nanswer = 'wrong'\n{check}", {})
