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

from vidsindy_lite.companion import artifacts
from vidsindy_lite.companion.artifacts import read_records
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
    """The .ipynb beside a .py; no cells if there is none."""
    executed = path.with_suffix(".ipynb")
    return (
        nbformat.read(executed, as_version=4) if executed.exists() else nbformat.v4.new_notebook()
    )


def executed_problems(path):
    """How the executed half differs from the source, did not run, or holds what it must not."""

    def told(notebook):
        return [(c.cell_type, c.source, marks(c.metadata)) for c in notebook.cells]

    def marks(metadata):
        return metadata.get("tags", []), metadata.get("jupyter", {})

    executed = executed_half(path)
    ours, theirs = told(source_half(path)), told(executed)
    problems = [] if len(ours) == len(theirs) else [f"{len(ours)} cells beside {len(theirs)}"]
    for index, (one, other) in enumerate(zip(ours, theirs, strict=False)):
        if one != other:
            problems.append(f"cell {index}: {one} beside {other}")
    if (size := len(nbformat.writes(executed).encode())) > LARGEST:
        problems.append(f"{size} bytes, at most {LARGEST}")
    for index, cell in enumerate(executed.cells):
        outputs = cell.get("outputs", [])
        shown = [output.get("data", {}) for output in outputs]
        if cell.cell_type == "code" and cell.execution_count is None:
            problems.append(f"cell {index} was not executed")
        if any(output.output_type == "error" for output in outputs):
            problems.append(f"cell {index} failed")
        for output, data in zip(outputs, shown, strict=True):
            if found := VOLATILE.search(output.get("text", "") + data.get("text/plain", "")):
                problems.append(f"cell {index} prints an address or a path: {found[0]}")
        sliders = [data for data in shown if "data:image/png" in data.get("text/html", "")]
        for call, seen in (("figure", [d for d in shown if "image/png" in d]), ("slider", sliders)):
            if re.search(rf"^save_{call}\(", cell.source, re.MULTILINE) and not seen:
                problems.append(f"cell {index} saves a {call} that nobody sees")
    return problems


def count_lines(source):
    """Lines that are not empty; an import is one, however many names it lists."""
    imports = (node for node in ast.parse(source).body if isinstance(node, ast.ImportFrom))
    names = sum(node.end_lineno - node.lineno for node in imports)
    return sum(bool(line.strip()) for line in source.splitlines()) - names


def source_problems(path):
    """What a notebook of ours has to have and to say, and must not."""
    notebook = source_half(path)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    code = "\n".join(cell.source for cell in cells)
    prose = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    parameters = [cell for cell in cells if "parameters" in cell.metadata.get("tags", [])]
    places = {section: re.search(section, prose, re.MULTILINE) for section in SECTIONS}
    starts = [place.start() for place in places.values() if place]
    exercises = r"^## Exercises.*\]\({}/{}\.ipynb\)"
    kernel = notebook.metadata.get("kernelspec", {}).get("name")
    rules = {
        "the first cell is no title": notebook.cells[0].cell_type == "markdown"
        and notebook.cells[0].source.startswith("# "),
        "the header does not name the kernel python3": kernel == "python3",
        'no parameters cell with profile: str = "full"': len(parameters) == 1
        and 'profile: str = "full"' in parameters[0].source,
        f"{len(notebook.cells)} cells, at most {MOST_CELLS}": len(notebook.cells) <= MOST_CELLS,
        "opening and closing are not in the order of SECTIONS": starts == sorted(starts),
        "no claim is asserted": re.search(r"^\s*assert ", code, re.MULTILINE),
        "does not close with print(versions())": code.rstrip().endswith("print(versions())"),
    }
    rules |= {f"no {section}": place for section, place in places.items()}
    for folder in ("exercises", "solutions"):
        way = re.search(exercises.format(folder, path.stem), prose, re.MULTILINE | re.DOTALL)
        rules[f"no way to its {folder}"] = way
    for line in "\n".join(cell.source for cell in parameters).splitlines():
        rules[f"parameters: not `name: type = value  # help`: {line}"] = PARAMETER.fullmatch(line)
    for node in ast.walk(ast.parse(code)):
        names = [node.module] if isinstance(node, ast.ImportFrom) else []
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else names
        for name in names:
            rules[f"imports from {name}"] = not name.startswith(PACKAGE.name) or name in PLACES
    problems = [problem for problem, holds in rules.items() if not holds]
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


def number_problems(path, figures, references=REFERENCES):
    """Where the tables of a quick run hold other numbers than the committed ones."""
    if not figures.exists():
        return []
    records = [*read_records(figures).items(), *read_records(references).items()]
    tables = {name for name, r in records if "rows" in r and r["notebook"] == path.stem}
    found = differences(references, figures)
    return [f"{name}: {place}" for name, place in found.items() if name in tables]


def folder_problems(folder):
    """Files of a record that are missing, files of none, and what is too large or too many."""
    expected = {artifacts.INDEX}.union(*map(artifacts.files_of, read_records(folder).values()))
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


GATES = (source_problems, executed_problems)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.parametrize("gate", GATES)
def test_notebook(path, gate):
    assert gate(path) == []


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
def test_records_are_of_our_notebooks(folder):
    made = {record["notebook"] for record in read_records(folder).values()}
    assert made <= {path.stem for path in NOTEBOOKS}
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
    """No sentence holds by a hair: tracks are disturbed, tables compared with undisturbed ones."""
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


STORY = """\
x + 1
assert x

# %% [markdown]
# **What you will see** **Afterwards you can** **What you need** **Covers**
# ## What we learned
# **What the paper says and what we found.**
# ## Exercises
# [Two exercises](exercises/01_first.ipynb), [solutions](solutions/01_first.ipynb).
# ## Run time and versions

# %%
print(versions())"""


@pytest.fixture
def pair(tiny):
    """A pair that passes every gate; its executed half was made without running it."""
    path = tiny.write("01_first", "x = 1", STORY)
    source = jupytext.read(path)
    nbformat.write(tidy(source, source), path.with_suffix(".ipynb"))
    return path


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


FOLDED = 'tags=["hide-input"] jupyter={"source_hidden": true}'


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("x = 1", "rng = np.random.default_rng(0)\n" * LONGEST),
        ("x + 1\n", "from math import (\n" + "    pi,\n" * LONGEST + ")\n"),
        ("# %%\nx = 1\n", f"# %% {FOLDED}\n" + "x = 1\n" * 16),
        ("x = 1", "\n".join(f"import {place}" for place in ("numpy", *sorted(PLACES)))),
    ],
)
def test_a_good_pair_passes(pair, old, new):
    assert [problem for gate in GATES for problem in gate(pair)] == []
    assert orphan_problems(pair.parent) == []
    edit(pair, old, new)
    assert source_problems(pair) == []


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("# # A tiny", "# A tiny", "no title"),
        ("name: python3", "name: other", "kernel python3"),
        ('tags=["parameters"]', "", "no parameters cell"),
        ("profile: str", "size: str", "no parameters cell"),
        ("  # full or quick", "", "parameters: not"),
        ("x = 1", "from vidsindy_lite.cameras import Rig", "imports from vidsindy_lite.cameras"),
        ("x = 1", "def late():\n    import vidsindy_lite.study.metrics", "study.metrics"),
        ("x = 1", "import numpy as np\nnp.random.seed(0)", "state: np.random.seed"),
        ("x = 1", "import random", "random state: import random"),
        ("x = 1", "torch.manual_seed(0)", "random state: torch.manual_seed"),
        ("x = 1", "x = 1\n" * 16, "has 16 lines"),
        ("# %%\nx = 1\n", "# %%\nx = 1\n" * 60, "65 cells, at most 60"),
        ("# %%\nx = 1", '# %% tags=["hide-input"]\nx = 1', "not in both"),
        ("# %%\nx = 1", '# %% jupyter={"source_hidden": true}\nx = 1', "not in both"),
        ("**Covers**", "", "Covers"),
        ("exercises/01_first.ipynb", "exercises/tale.ipynb", "no way to its exercises"),
        (", [solutions](solutions/01_first.ipynb)", "", "no way to its solutions"),
        ("assert x", "x", "no claim is asserted"),
        ("print(versions())", "versions", "does not close with"),
        ("## Exercises", "## Run time and versions\n# ## Exercises", "not in the order"),
    ],
)
def test_a_bad_source_is_seen(pair, old, new, problem):
    edit(pair, old, new)
    assert [found for found in source_problems(pair) if problem in found]


OUTPUT = nbformat.v4.new_output


@pytest.mark.parametrize(
    ("half", "old", "new", "problem"),
    [
        (".py", "x = 1", "x = 2", "cell 2"),
        (".py", '# %% tags=["parameters"]', "# %%", "cell 1"),
        (".py", "# %%\nx = 1", "# %% [markdown]\n# x = 1", "cell 2"),
        (".py", "# %%\nx = 1\n", "", "5 cells beside 6"),
        (".ipynb", '"x = 1"', '"x = 2"', "cell 2"),
        (".ipynb", '"execution_count": 2', '"execution_count": null', "cell 2 was not executed"),
        (".ipynb", '"x = 1"', "\"save_figure('a', figure)\"", "cell 2 saves a figure that nobody"),
        (".ipynb", '"x = 1"', "\"save_slider('a', figure)\"", "cell 2 saves a slider that nobody"),
    ],
)
def test_a_bad_pair_is_seen(pair, half, old, new, problem):
    edit(pair.with_suffix(half), old, new)
    assert [found for found in executed_problems(pair) if problem in found]


@pytest.mark.parametrize(
    ("output", "problem"),
    [
        (OUTPUT("error", ename="E", evalue="", traceback=[]), "2 failed"),
        (OUTPUT("stream", text="<Axes at 0x7f3a5c0d2e90>"), "0x7f3a5c0d2e90"),
        (OUTPUT("stream", text="/tmp/abc/camera_1.mkv"), "/tmp/"),
        (OUTPUT("display_data", data={"image/png": "A" * LARGEST}), "at most 600000"),
    ],
)
def test_a_bad_output_is_seen(pair, output, problem):
    executed = nbformat.read(pair.with_suffix(".ipynb"), as_version=4)
    executed.cells[2].outputs = [output]
    nbformat.write(executed, pair.with_suffix(".ipynb"))
    (found,) = executed_problems(pair)
    assert problem in found


def test_a_half_alone_is_seen(pair):
    pair.rename(pair.with_suffix(".bak"))
    assert orphan_problems(pair.parent) == ["01_first.ipynb"]
    pair.with_suffix(".ipynb").unlink()
    pair.with_suffix(".bak").rename(pair)
    assert executed_problems(pair) == ["6 cells beside 0"]


def test_a_quick_run_fails_by_its_claim_and_by_its_table(tiny, tmp_path):
    save = """\
from vidsindy_lite.companion import artifacts
value = 1.01
artifacts.save_table("found", [{"system": "Lorenz", "value": value}], caption="A.")"""
    path, references = tiny.write("01_first", save, "assert value == 1"), tmp_path / "references"
    references.mkdir()
    for name, of in (("found", "01_first"), ("gone", "01_first"), ("other", "02_second")):
        record = {"id": name, "kind": "table", "notebook": of, "caption": "A."}
        record["rows"] = [{"system": "Lorenz", "value": 1.0}]
        (references / f"{name}.json").write_text(json.dumps(record))
    table, claim = run_problems(path, tmp_path / "run", tmp_path, references)
    assert table.startswith("found: row 0 (Lorenz), column value: 1.0 committed, 1.01")
    assert "AssertionError" in claim
    found = number_problems(path, tmp_path / "run" / "figures", references)
    assert found == [table, "gone: only committed"]


@pytest.fixture
def complete(tmp_path, monkeypatch):
    """A folder of figures with a picture, a table and its index."""
    monkeypatch.setenv("VIDSINDY_FIGURES", str(tmp_path / "figures"))
    monkeypatch.delenv("VIDSINDY_NOTEBOOK", raising=False)
    figure = Figure()
    FigureCanvas(figure)
    artifacts.save_figure("fig_2", figure, caption="Empty.", numbers={})
    artifacts.save_table("table_1", [{"x": 1}], caption="One.")
    artifacts.write_index(tmp_path / "figures")
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


def test_folder_gate_names_what_would_swell_the_history(complete, monkeypatch):
    (complete / "fig_2.png").write_bytes(b" " * 1000)
    for name, most in (("LARGEST_FILE", 999), ("LARGEST_FOLDER", 999), ("MOST_FILES", 3)):
        monkeypatch.setitem(globals(), name, most)
    file, size, count = folder_problems(complete)
    assert file == "fig_2.png: 1000 bytes, at most 999"
    assert re.fullmatch(r"all files: \d+ bytes, at most 999", size)
    assert count == "all files: 4 files, at most 3"


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
