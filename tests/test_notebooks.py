"""Gates that keep the notebooks honest, each with a test in which it fails, and their quick run."""

import ast
import io
import json
import re
from functools import cache

import jupytext
import nbformat
import pytest
from disturbed.undisplayed import FigureCanvas
from helpers import run_quickly
from matplotlib.figure import Figure

from vidsindy_lite.companion.artifacts import (
    INDEX,
    files_of,
    read_records,
    save_figure,
    save_table,
    write_index,
)
from vidsindy_lite.companion.compare import differences
from vidsindy_lite.companion.run import find_notebooks, tidy
from vidsindy_lite.storage import PACKAGE

ROOT = PACKAGE.parent
NOTEBOOKS = find_notebooks(ROOT)
REFERENCES = ROOT / "tests" / "quick"  # tables of a quick run
LARGEST = 600_000  # bytes of an executed notebook; a code host shows no more
LARGEST_FILE, LARGEST_FOLDER, MOST_FILES = 600_000, 6_000_000, 250  # of figures/; bytes, bytes
LONGEST = 15  # lines of a code cell that is not folded
MOST_CELLS = 60

# What a notebook says at its opening and its close, in this order.
SECTIONS = (
    r"\*\*What you will see\*\*", r"\*\*Afterwards you can\*\*", r"\*\*What you need\*\*",
    r"\*\*Covers\*\*",
    r"^## What we learned", r"What the paper says,? and what we found", r"^## Exercises",
    r"^## Run time and versions",
)  # fmt: skip
PARAMETER = re.compile(r"\w+: \w+ = .+  # .+")
GLOBAL_RANDOM = re.compile(
    r"\b(np|numpy)\.random\.(?!default_rng\b|Generator\b|SeedSequence\b)\w+"
    r"|^\s*(import|from) random\b|\btorch\.manual_seed\b",
    re.MULTILINE,
)
# Where a notebook may import from; the rooms come as names of the package.
PLACES = {
    "vidsindy_lite", "vidsindy_lite.study", "vidsindy_lite.study.plots",
    "vidsindy_lite.companion.artifacts",
}  # fmt: skip
LENGTH = lambda path: -path.stat().st_size  # noqa: E731
VOLATILE = re.compile(r"0x[0-9a-f]{6,}|/(tmp|home|root|Users)/|\\Users\\")


@cache  # every gate reads all of them
def parsed(text):
    return jupytext.reads(text, "py:percent")


def source_half(path):
    """The .py half of a pair as a notebook."""
    return parsed(path.read_text("utf-8"))


def executed_half(path):
    """The .ipynb beside a .py; no cells if there is none, which `pair_problems` reports."""
    executed = path.with_suffix(".ipynb")
    return (
        nbformat.read(executed, as_version=4) if executed.exists() else nbformat.v4.new_notebook()
    )


def pair_problems(path):
    """How the two halves of a pair disagree: kind, source, tags or folding of a cell."""

    def cells(notebook):
        return [(c.cell_type, c.source, marks(c.metadata)) for c in notebook.cells]

    def marks(metadata):
        return metadata.get("tags", []), metadata.get("jupyter", {})

    ours, theirs = cells(source_half(path)), cells(executed_half(path))
    problems = [] if len(ours) == len(theirs) else [f"{len(ours)} cells beside {len(theirs)}"]
    for index, (one, other) in enumerate(zip(ours, theirs, strict=False)):
        if one != other:
            problems.append(f"cell {index}: {one} beside {other}")
    return problems


def execution_problems(path):
    """Cells of the executed half that were not executed, or that failed."""
    problems = []
    for index, cell in enumerate(executed_half(path).cells):
        if cell.cell_type == "code" and cell.execution_count is None:
            problems.append(f"cell {index} was not executed")
        if any(output.output_type == "error" for output in cell.get("outputs", [])):
            problems.append(f"cell {index} failed")
    return problems


def hash_problems(path):
    """Marks of the code in an executed half: it is compared, not stamped."""
    allowed = {"jupytext", "kernelspec"}
    return [f"metadata: {name}" for name in executed_half(path).metadata.keys() - allowed]


def count_lines(source):
    """Lines that are not empty; an import is one, however many names it lists."""
    imports = (node for node in ast.parse(source).body if isinstance(node, ast.ImportFrom))
    names = sum(node.end_lineno - node.lineno for node in imports)
    return sum(bool(line.strip()) for line in source.splitlines()) - names


def anatomy_problems(path):
    """What a notebook of ours has to have, and must not."""
    notebook = source_half(path)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    parameters = [cell for cell in code if "parameters" in cell.metadata.get("tags", [])]
    problems = []
    first = notebook.cells[0]
    if first.cell_type != "markdown" or not first.source.startswith("# "):
        problems.append("the first cell is no title")
    if notebook.metadata.get("kernelspec", {}).get("name") != "python3":
        problems.append("the header does not name the kernel python3")
    if len(parameters) != 1 or 'profile: str = "full"' not in parameters[0].source:
        problems.append('no parameters cell with profile: str = "full"')
    if len(notebook.cells) > MOST_CELLS:
        problems.append(f"{len(notebook.cells)} cells, at most {MOST_CELLS}")
    for cell in parameters:
        for line in cell.source.splitlines():
            if not PARAMETER.fullmatch(line):
                problems.append(f"parameters: not `name: type = value  # help`: {line}")
    for index, cell in enumerate(notebook.cells):
        if cell.cell_type == "code":
            tags = cell.metadata.get("tags", [])
            folded = any(tag in tags for tag in ("hide-input", "hide-cell"))
            if folded != cell.metadata.get("jupyter", {}).get("source_hidden", False):
                problems.append(f"cell {index} is folded on the site or in JupyterLab, not in both")
            if not folded and (lines := count_lines(cell.source)) > LONGEST:
                problems.append(f"cell {index} has {lines} lines, at most {LONGEST}")
            if found := GLOBAL_RANDOM.search(cell.source):
                problems.append(f"cell {index} uses global random state: {found[0].strip()}")
    return problems


def import_problems(path):
    """Places in the package that a notebook imports from, beside the four that it may."""
    code = "\n".join(cell.source for cell in source_half(path).cells if cell.cell_type == "code")
    found = set()
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.ImportFrom):
            found.add(node.module)
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    ours = {place for place in found if place.partition(".")[0] == PACKAGE.name}
    return [f"imports from {place}" for place in sorted(ours - PLACES)]


def story_problems(path):
    """What the prose of a notebook lacks, and claims that nothing computes."""
    notebook = source_half(path)
    prose = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    code = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "code")
    places = [re.search(section, prose, re.MULTILINE) for section in SECTIONS]
    problems = [
        f"no {section}" for section, place in zip(SECTIONS, places, strict=True) if place is None
    ]
    starts = [place.start() for place in places if place]
    if starts != sorted(starts):
        problems.append("opening and closing are not in the order of SECTIONS")
    for folder in ("exercises", "solutions"):
        if not re.search(rf"^## Exercises.*\]\({folder}/{path.stem}\.ipynb\)", prose, re.M | re.S):
            problems.append(f"no way to its {folder}")
    if not re.search(r"^\s*assert ", code, re.MULTILINE):
        problems.append("no claim is asserted")
    if not code.rstrip().endswith("print(versions())"):
        problems.append("does not close with print(versions())")
    return problems


def output_problems(path):
    """What an executed half must not hold, too much or what changes, and pictures that it lacks."""
    executed = executed_half(path)
    size = len(nbformat.writes(executed).encode())
    problems = [f"{size} bytes, at most {LARGEST}"] if size > LARGEST else []
    for index, cell in enumerate(executed.cells):
        for output in cell.get("outputs", []):
            text = output.get("text", "") + output.get("data", {}).get("text/plain", "")
            if found := VOLATILE.search(text):
                problems.append(f"cell {index} prints an address or a path: {found[0]}")
        shown = [output.get("data", {}) for output in cell.get("outputs", [])]
        sliders = [data for data in shown if "data:image/png" in data.get("text/html", "")]
        for call, seen in (("figure", [d for d in shown if "image/png" in d]), ("slider", sliders)):
            if re.search(rf"^save_{call}\(", cell.source, re.MULTILINE) and not seen:
                problems.append(f"cell {index} saves a {call} that nobody sees")
    return problems


def number_problems(path, figures, references=REFERENCES):
    """Where the tables of a quick run hold other numbers than the committed ones.

    By more than the tolerance that a table states for a column, or else by a thousandth.
    """
    if not figures.exists():
        return []
    records = read_records(figures) | read_records(references)
    found = differences(references, figures, path.stem)
    return [f"{name}: {place}" for name, place in found.items() if "rows" in records[name]]


def folder_problems(folder):
    """Files of a record that are missing, files of none, and what is too large or too many."""
    expected = {INDEX, *(name for r in read_records(folder).values() for name in files_of(r))}
    sizes = {p.name: p.stat().st_size for p in folder.glob("*") if not p.name.startswith(".")}
    limits = [(f"{name}: ", size, "bytes", LARGEST_FILE) for name, size in sorted(sizes.items())]
    limits += [("all files: ", sum(sizes.values()), "bytes", LARGEST_FOLDER)]
    limits += [("all files: ", len(sizes), "files", MOST_FILES)]
    return [
        *(f"{name}: missing" for name in sorted(expected - sizes.keys())),
        *(f"{name}: no record names it" for name in sorted(sizes.keys() - expected)),
        *(f"{who}{much} {what}, at most {most}" for who, much, what, most in limits if much > most),
    ]


def orphan_problems(notebooks):
    """Executed halves without a source."""
    sources = {path.stem for path in find_notebooks(notebooks.parent)}
    return [path.name for path in sorted(notebooks.glob("*.ipynb")) if path.stem not in sources]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.parametrize(
    "gate",
    [
        anatomy_problems,
        import_problems,
        story_problems,
        pair_problems,
        execution_problems,
        hash_problems,
        output_problems,
    ],
)
def test_notebook(path, gate):
    assert gate(path) == []


KEYS = {"id", "kind", "notebook", "caption", "tolerance", "rows", "numbers", "words"}


def saved_problems(path, figures):
    """How a notebook and the records of its figures and tables disagree."""
    source = path.read_text("utf-8")
    made = {name for name, r in read_records(figures).items() if r["notebook"] == path.stem}
    named = set(re.findall(r'\bsave_\w+\(\s*"(\w+)"', source))
    begun = tuple(re.findall(r'\bsave_\w+\(\s*f"(\w+?)\{', source)) or None
    computed = {name for name in made - named if begun and name.startswith(begun)}
    listed = {name for name in made - named - computed if f'"{name}"' in source}
    problems = [f"{name}: saved, but not in {figures.name}/" for name in sorted(named - made)]
    return problems + [f"{name}: not saved" for name in sorted(made - named - computed - listed)]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_figures_are_what_a_notebook_saves(path):
    assert saved_problems(path, ROOT / "figures") == []


@pytest.mark.parametrize("folder", [ROOT / "figures", REFERENCES], ids=lambda path: path.name)
def test_records_are_of_our_notebooks_and_hold_no_hash(folder):
    records = read_records(folder).values()
    assert {record["notebook"] for record in records} <= {path.stem for path in NOTEBOOKS}
    assert {key for record in records for key in record} <= KEYS
    assert folder == REFERENCES or folder_problems(folder) == []
    assert orphan_problems(ROOT / "notebooks") == []


def run_problems(path, folder, cache, references=REFERENCES, seed=None):
    """What is wrong with a quick run of a notebook, also with what it made before it failed."""
    failed = run_quickly(path, folder / "figures", {}, cache, seed)
    problems = number_problems(path, folder / "figures", references)
    if failed:
        return [*(problem for problem in problems if "only committed" not in problem), failed]
    return problems


@pytest.mark.notebooks
@pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=pytest.mark.thorough) for seed in (2, 3))]
)
@pytest.mark.parametrize("path", sorted(NOTEBOOKS, key=LENGTH), ids=lambda path: path.stem)
def test_quick_run(path, seed, tmp_path, shared_cache):
    """No sentence holds by a hair.

    Every track and trajectory is disturbed by a relative 1e-9, see `test_disturbed`, and the tables
    are compared with those of a run that nothing disturbs. The longest begin, so that none ends
    alone.
    """
    problems = run_problems(path, tmp_path, shared_cache, seed=seed)
    copy = f"if that is meant, copy the tables from build/quick/figures to {REFERENCES}"
    assert not problems, "\n".join([*problems, copy])


def test_a_figure_that_cannot_be_drawn_is_seen_without_paper():
    figure, file = Figure(layout="constrained"), io.BytesIO()
    FigureCanvas(figure)
    figure.subplots().set_title("$x^2$")
    figure.savefig(file, format="png")
    assert file.getvalue().startswith(b"\x89PNG")
    figure.axes[0].set_title(r"$\frac{x$")
    with pytest.raises(ValueError, match="ParseFatalException|Expected"):
        figure.savefig(file, format="png")


@pytest.fixture
def pair(tiny):
    """A pair that passes every gate; its executed half was made without running it."""
    path = tiny.write("01_first", "x = 1", "x + 1")
    source = jupytext.read(path)
    nbformat.write(tidy(source, source), path.with_suffix(".ipynb"))
    return path


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


GATES = (
    anatomy_problems, import_problems, pair_problems, execution_problems, hash_problems,
    output_problems,
)  # fmt: skip
FOLDED = 'tags=["hide-input"] jupyter={"source_hidden": true}'


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("x = 1", "rng = np.random.default_rng(0)\n" * LONGEST),
        ("x + 1", "from math import (\n" + "    pi,\n" * LONGEST + ")"),
        ("# %%\nx = 1\n", f"# %% {FOLDED}\n" + "x = 1\n" * 16),
        ("x = 1", "\n".join(f"import {place}" for place in ("numpy", *sorted(PLACES)))),
    ],
)
def test_a_good_pair_passes(pair, old, new):
    assert [problem for gate in GATES for problem in gate(pair)] == []
    assert orphan_problems(pair.parent) == []
    edit(pair, old, new)
    assert anatomy_problems(pair) == import_problems(pair) == []


@pytest.mark.parametrize(
    ("gate", "half", "old", "new", "problem"),
    [
        (pair_problems, ".py", "x = 1", "x = 2", "cell 2"),
        (pair_problems, ".py", '# %% tags=["parameters"]', "# %%", "cell 1"),
        (pair_problems, ".py", "# %%\nx = 1", "# %% [markdown]\n# x = 1", "cell 2"),
        (pair_problems, ".py", "# %%\nx = 1\n", "", "3 cells beside 4"),
        (pair_problems, ".ipynb", '"x = 1"', '"x = 2"', "cell 2"),
        (execution_problems, ".ipynb", '"execution_count": 2', '"execution_count": null',
         "cell 2 was not executed"),
        (hash_problems, ".ipynb", '"jupytext": {', '"stamp": "1",\n  "jupytext": {', "stamp"),
        (import_problems, ".py", "x = 1", "from vidsindy_lite.cameras import Rig", "cameras"),
        (import_problems, ".py", "x = 1",
         "def late():\n    from vidsindy_lite.study.metrics import score", "study.metrics"),
        (output_problems, ".ipynb", '"x + 1"', "\"save_figure('waves', figure)\"",
         "cell 3 saves a figure that nobody sees"),
        (output_problems, ".ipynb", '"x + 1"', "\"save_slider('waves', figure)\"",
         "cell 3 saves a slider that nobody sees"),
        *(
            (anatomy_problems, ".py", *case)
            for case in [
                ("# # A tiny", "# A tiny", "no title"),
                ("name: python3", "name: other", "kernel python3"),
                ('tags=["parameters"]', "", "no parameters cell"),
                ("profile: str", "size: str", "no parameters cell"),
                ("  # full or quick", "", "parameters: not"),
                ("x = 1", "import numpy as np\nnp.random.seed(0)", "state: np.random.seed"),
                ("x = 1", "import random", "random state: import random"),
                ("x = 1", "torch.manual_seed(0)", "random state: torch.manual_seed"),
                ("x = 1", "x = 1\n" * 16, "has 16 lines"),
                ("# %%\nx = 1\n", "# %%\nx = 1\n" * 60, "63 cells, at most 60"),
                ("# %%\nx = 1", '# %% tags=["hide-input"]\nx = 1', "not in both"),
                ("# %%\nx = 1", '# %% jupyter={"source_hidden": true}\nx = 1', "not in both"),
            ]
        ),
    ],
)  # fmt: skip
def test_a_gate_fails(pair, gate, half, old, new, problem):
    edit(pair.with_suffix(half), old, new)
    assert [found for found in gate(pair) if problem in found]


OUTPUT = nbformat.v4.new_output


@pytest.mark.parametrize(
    ("gate", "output", "problem"),
    [
        (execution_problems, OUTPUT("error", ename="E", evalue="", traceback=[]), "2 failed"),
        (output_problems, OUTPUT("stream", text="<Axes at 0x7f3a5c0d2e90>"), "0x7f3a5c0d2e90"),
        (output_problems, OUTPUT("stream", text="/tmp/abc/camera_1.mkv"), "/tmp/"),
        (output_problems, OUTPUT("display_data", data={"image/png": "A" * LARGEST}),
         "at most 600000"),
    ],
)  # fmt: skip
def test_a_gate_fails_on_an_output(pair, gate, output, problem):
    executed = nbformat.read(pair.with_suffix(".ipynb"), as_version=4)
    executed.cells[2].outputs = [output]
    nbformat.write(executed, pair.with_suffix(".ipynb"))
    (found,) = gate(pair)
    assert problem in found


def test_a_half_alone_is_seen(pair):
    pair.rename(pair.with_suffix(".bak"))
    assert orphan_problems(pair.parent) == ["01_first.ipynb"]
    pair.with_suffix(".ipynb").unlink()
    pair.with_suffix(".bak").rename(pair)
    assert pair_problems(pair) == ["4 cells beside 0"]


STORY = """\
# # A tiny notebook
# **What you will see** **Afterwards you can** **What you need** **Covers**

# %%
assert True

# %% [markdown]
# ## What we learned
# **What the paper says and what we found.**
# ## Exercises
# [Two exercises](exercises/story.ipynb), [solutions](solutions/story.ipynb).
# ## Run time and versions

# %%
print(versions())
"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("**Covers**", ""),
        ("exercises/story.ipynb", "exercises/tale.ipynb"),
        (", [solutions](solutions/story.ipynb)", ""),
        ("assert True", "True"),
        ("print(versions())", "versions"),
        ("## Exercises", "## Run time and versions\n# ## Exercises"),
    ],
)
def test_story_gate_fails(tmp_path, old, new):
    path = tmp_path / "story.py"
    path.write_text("# %% [markdown]\n" + STORY)
    assert story_problems(path) == []
    edit(path, old, new)
    assert story_problems(path)


@pytest.fixture
def tables(tmp_path):
    """The same table, committed and of a quick run; and those of two other notebooks."""
    row = {"system": "Lorenz", "false": 0, "l2 (e-2)": 0.5, "seconds": 3.0}
    for folder in ("committed", "quick"):
        (tmp_path / folder).mkdir()
        write_table(tmp_path / folder, "found", "01_first", row)
    write_table(tmp_path / "committed", "other", "02_second", row)
    write_table(tmp_path / "quick", "another", "03_third", row)
    return tmp_path


def write_table(folder, name, notebook, row):
    record = {"id": name, "kind": "table", "notebook": notebook, "caption": "A.", "rows": [row]}
    record["tolerance"] = {"l2 (e-2)": 0.1}
    (folder / f"{name}.json").write_text(json.dumps(record))


def named(tables):
    return number_problems(tables / "01_first.py", tables / "quick", tables / "committed")


@pytest.mark.parametrize(
    ("folder", "old", "new", "place"),
    [
        ("committed", "0.5", "0.9", "row 0 (Lorenz), column l2 (e-2): 0.9 committed, 0.5"),
        ("quick", '"false": 0', '"false": 1', "row 0 (Lorenz), column false: 0 committed, 1"),
        ("quick", "Lorenz", "SprottE", "row 0 (Lorenz), column system: 'Lorenz' committed"),
    ],
)
def test_numbers_of_another_quick_run_are_named(tables, folder, old, new, place):
    edit(tables / "quick" / "found.json", "3.0", "9.0")  # seconds
    assert named(tables) == []
    edit(tables / folder / "found.json", old, new)
    (problem,) = named(tables)
    assert problem.startswith(f"found: {place}")
    (tables / folder / "found.json").unlink()  # on one side only
    assert [problem.partition(":")[0] for problem in named(tables)] == ["found"]


def test_a_quick_run_fails_by_its_claim_and_by_its_table(tiny, tmp_path):
    save = """\
from vidsindy_lite.companion import artifacts
value = 1.01
artifacts.save_table("found", [{"system": "Lorenz", "value": value}], caption="A.")"""
    path = tiny.write("01_first", save, "assert value == 1")
    (tmp_path / "references").mkdir()
    write_table(tmp_path / "references", "found", "01_first", {"system": "Lorenz", "value": 1.0})
    problems = run_problems(path, tmp_path / "run", tmp_path, tmp_path / "references")
    assert problems[0].startswith("found: row 0 (Lorenz), column value: 1.0 committed, 1.01")
    assert "AssertionError" in problems[1]


@pytest.fixture
def complete(tmp_path, monkeypatch):
    """A folder of figures with a picture, a table and its index."""
    monkeypatch.setenv("VIDSINDY_FIGURES", str(tmp_path / "figures"))
    monkeypatch.delenv("VIDSINDY_NOTEBOOK", raising=False)
    figure = Figure()
    FigureCanvas(figure)
    save_figure("fig_2", figure, caption="Empty.", numbers={})
    save_table("table_1", [{"x": 1}], caption="One.")
    write_index(tmp_path / "figures")
    return tmp_path / "figures"


@pytest.mark.parametrize("content", [None, "{", '{"id": 3}'])
def test_folder_gate_names_what_is_missing_and_what_is_stray(complete, content):
    assert folder_problems(complete) == []
    (complete / "fig_2.png").unlink()
    (complete / "README.md").unlink()
    record = complete / "table_1.json"
    record.unlink() if content is None else record.write_text(content)  # a damaged record is none
    (complete / "old.svg").write_bytes(b"")
    stray = ["old.svg: no record names it"]
    stray += [] if content is None else ["table_1.json: no record names it"]
    assert folder_problems(complete) == ["README.md: missing", "fig_2.png: missing", *stray]


@pytest.mark.parametrize(
    ("name", "most", "problem"),
    [
        ("LARGEST_FILE", 999, "fig_2.png: 1000 bytes, at most 999"),
        ("LARGEST_FOLDER", 999, "all files: .* bytes, at most 999"),
        ("MOST_FILES", 3, "all files: 4 files, at most 3"),
    ],
)
def test_folder_gate_names_what_would_swell_the_history(complete, monkeypatch, name, most, problem):
    (complete / "fig_2.png").write_bytes(b" " * 1000)
    monkeypatch.setitem(globals(), name, most)
    assert re.fullmatch(problem, "\n".join(folder_problems(complete)))


def test_saved_gate_fails_on_a_figure_too_many_and_too_few(complete):
    path = complete.parent / "interactive.py"
    save = 'save_figure("fig_2", figure)\nsave_table("table_1", rows)\n'
    path.write_text(save)
    records = read_records(complete)
    assert {record["notebook"] for record in records.values()} == {"interactive"}
    assert saved_problems(path, complete) == []
    path.write_text(save.replace("fig_2", "fig_3"))
    assert saved_problems(path, complete) == [
        "fig_3: saved, but not in figures/",
        "fig_2: not saved",
    ]
