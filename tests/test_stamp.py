"""Where the repository is, files in one step, and stamps that follow what a result depends on."""

import ast
import shutil
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from vidsindy_lite import stamp
from vidsindy_lite.companion import run as runner
from vidsindy_lite.stamp import code_stamp, repository_root, source_stamp, write_file
from vidsindy_lite.study import run_trial

ROOT = stamp.PACKAGE.parent


def test_repository_is_found_from_inside(tiny, tmp_path):
    assert repository_root(tiny.notebooks) == tiny.root
    assert repository_root(tiny.root) == tiny.root
    with pytest.raises(FileNotFoundError, match="repository: .* got"):
        repository_root(tmp_path.parent)


def test_written_file_replaces_the_old_one(tmp_path):
    path = tmp_path / "folder" / "file"
    write_file(path, b"old")
    write_file(path, b"new")
    assert path.read_bytes() == b"new"
    assert list(path.parent.iterdir()) == [path]


def test_a_file_that_cannot_be_replaced_leaves_nothing_beside(tmp_path):
    (tmp_path / "taken" / "inside").mkdir(parents=True)
    with pytest.raises(OSError):  # noqa: PT011  whatever the system calls it
        write_file(tmp_path / "taken", b"new")
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


# -------------------------------------------------------------------- a small package, edit by edit

FILES = {
    "__init__.py": '"""Doc."""\nfrom .room import first\n',
    "room/__init__.py": "from .a import first\nfrom .b import Second as second\n",
    "room/a.py": '"""A."""\nfrom ..low import base\n\ndef first():\n    "One."\n    return base\n',
    "room/b.py": "class Second:\n    pass\n",
    "room/weights.py": "FILE = __file__\n",
    "room/weights.bin": "1",
    "low.py": "def base():\n    from .late import thing\n    return thing\n",
    "late.py": "thing = 1\nname = 'numbers.csv'\n",
    "numbers.csv": "1",
    "other.csv": "1",
    "study/__init__.py": "from .none import none\n",
    "study/plots/__init__.py": "from .lines import draw, dot\n",
    "study/plots/lines.py": (
        "import math\nimport cmath as c\n\nWIDTH = 2\nCOLOUR = 1\n\n\n"
        "def draw():\n    return _pen()\n\n\n"
        "def _pen():\n    return WIDTH, math.pi, 'house.mplstyle'\n\n\n"
        "def dot():\n    return COLOUR, c.pi\n\n\nprint('hello')\n"
    ),
    "study/plots/house.mplstyle": "size: 1",
    "companion/artifacts.py": "def save():\n    return 1\n\n\ndef load():\n    return 2\n",
    "companion/site.py": "def build():\n    return 1\n",
    "companion/site.css": "a {}",
    "stamp.py": "x = 1\n",
}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A small package under our name."""
    folder = tmp_path / "package"
    for name, text in FILES.items():
        write_file(folder / name, text.encode())
    monkeypatch.setattr(stamp, "PACKAGE", folder)
    return folder


def followed(package, source, root=None):
    """Which edits of the package's files make the stamp of a source another."""
    found, before = set(), source_stamp(source, root)
    for name, text in FILES.items():
        edited = f"{text}\nadded = 1\n" if name.endswith(".py") else f"{text} "
        (package / name).write_text(edited)
        found |= {name} if source_stamp(source, root) != before else set()
        (package / name).write_text(text)
    assert source_stamp(source, root) == before
    return found


A = {"room/a.py", "low.py", "late.py", "numbers.csv"}


@pytest.mark.parametrize(
    ("source", "files"),
    [
        ("import numpy", set()),
        ("from vidsindy_lite import first", A),
        ("from vidsindy_lite.room import first as f", A),
        ("from vidsindy_lite.room import second", {"room/b.py"}),
        ("import vidsindy_lite as vl\nvl.first()", A),
        ("import vidsindy_lite\nvidsindy_lite.room.second.name", {"room/b.py"}),
        ("from vidsindy_lite import room\nroom.second()", {"room/b.py"}),
        ("def late():\n    from vidsindy_lite import room\n    room.second", {"room/b.py"}),
        ("from vidsindy_lite.room import b\nb.anything", {"room/b.py"}),
        ("from vidsindy_lite.room import weights", {"room/weights.py", "room/weights.bin"}),
        ("from vidsindy_lite import low", {"low.py", "late.py", "numbers.csv"}),
        ("open('other.csv')", {"other.csv"}),
        ("'vidsindy_lite.study.plots.house'.upper()", {"study/plots/house.mplstyle"}),
        ("from vidsindy_lite.companion import site\nsite.build()", set()),
        ("import vidsindy_lite.stamp\nvidsindy_lite.stamp.x", set()),
    ],
)
def test_a_stamp_follows_what_a_source_reaches(package, source, files):
    assert followed(package, source) == files


@pytest.mark.parametrize(
    "source",
    [
        "import vidsindy_lite as vl\nshow(vl)",
        "from vidsindy_lite import *",
        "from vidsindy_lite import no_such_name",
        "%matplotlib inline\nimport vidsindy_lite",
    ],
)
def test_what_cannot_be_followed_depends_on_everything(package, source):
    without_results = {"companion/site.py", "companion/site.css", "stamp.py", "other.csv"}
    assert followed(package, source) == FILES.keys() - without_results


@pytest.mark.parametrize(
    ("old", "new", "stale"),
    [
        ("return _pen()", "return 1", {"draw"}),
        ("WIDTH = 2", "WIDTH = 3", {"draw"}),
        ("COLOUR = 1", "COLOUR = 2", {"dot"}),
        ("import math", "import numpy as math", {"draw"}),
        ("import cmath", "import math", {"dot"}),
        ("print('hello')", "print('bye')", {"draw", "dot"}),
        ("'house.mplstyle'", "'house.mplstyle', 1", {"draw"}),
        ("def draw():\n", "def draw():\n    '''Prose.'''\n", set()),
        ("WIDTH = 2\n", "WIDTH = 2  # prose\n\n", set()),
    ],
)
def test_in_a_module_that_draws_each_function_counts_for_itself(package, old, new, stale):
    sources = {n: f"from vidsindy_lite.study import plots\nplots.{n}()" for n in ("draw", "dot")}
    before = {name: source_stamp(source) for name, source in sources.items()}
    file = package / "study/plots/lines.py"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))
    assert {n for n, source in sources.items() if source_stamp(source) != before[n]} == stale


def test_a_stamp_follows_the_source_itself_and_the_pins_of_libraries(package, tiny):
    stamps = {source_stamp("x = 1"), source_stamp("x = 2"), source_stamp("x = 1", tiny.root)}
    (tiny.root / "requirements.txt").write_text("numpy==2.4.6\nruff==0.1\n# prose\n")
    stamps.add(source_stamp("x = 1", tiny.root))
    assert len(stamps) == 3
    (tiny.root / "requirements.txt").write_text("numpy==1.0\n")
    assert source_stamp("x = 1", tiny.root) not in stamps


def test_the_stamp_of_a_function_is_that_of_what_it_reaches(package):
    def function():
        pass

    function.__module__, function.__qualname__ = "vidsindy_lite.room.a", "first"
    before = code_stamp(function)
    (package / "room/b.py").write_text("x = 1")
    assert code_stamp(function) == before
    (package / "late.py").write_text("thing = 2")
    assert code_stamp(function) != before


# ----------------------------------------------------------------------- our package, edit by edit


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """The repository without its data, to be edited."""
    for folder in ("vidsindy_lite", "notebooks"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("*.ipynb"))
    shutil.copy(ROOT / "requirements.txt", tmp_path)
    monkeypatch.setattr(stamp, "PACKAGE", tmp_path / "vidsindy_lite")
    return tmp_path


def stamps(clone: Path) -> dict[str, str]:
    """Of all notebooks and of the sweeps."""
    found = {p.stem[:2]: runner.notebook_stamp(p, "full") for p in runner.find_notebooks(clone)}
    return found | {"sweeps": code_stamp(run_trial, clone)}


ALL = {p.stem[:2] for p in runner.find_notebooks(ROOT)} | {"sweeps"}
DISCOVER = {"00", "03", "04", "05", "06", "07", "09", "sweeps"}


def test_only_what_depends_on_an_edit_becomes_stale(clone):
    edits = {
        "study/plots/cameras.py": ('"angle between normal and z axis (rad)"', '"tilt"', {"01"}),
        "companion/contents.md": ("glob", "no", set()),
        "../requirements.txt": ("ruff==", "ruff==9", set()),
        "dynamics/splines.py": ('"""', '"""Prose. ', set()),
    }
    before = stamps(clone)
    for name, (old, new, stale) in edits.items():
        file = clone / "vidsindy_lite" / name
        text = file.read_text("utf-8")
        assert old in text, name
        file.write_text(text.replace(old, new, 1), "utf-8")
        after = stamps(clone)
        assert {key for key in ALL if after[key] != before[key]} == stale, name
        file.write_text(text, "utf-8")


def test_an_edit_of_the_solver_makes_those_stale_that_discover(clone):
    before = stamps(clone)
    solver = clone / "vidsindy_lite" / "dynamics" / "solver.py"
    solver.write_text(solver.read_text("utf-8") + "\nNEW = 1\n", "utf-8")
    stale = {key for key, value in stamps(clone).items() if value != before[key]}
    assert stale >= DISCOVER
    assert not {"01", "08"} & stale


# How it is run, not what.
NO_MATTER = {"tqdm", "joblib", "threadpoolctl", "filelock", "distributed", "jinja2"}


def test_every_pinned_library_that_results_come_from_counts():
    written = {"artifacts.py", "records.py"}  # of the companion, these alone make results
    sources = [
        path
        for path in stamp.PACKAGE.rglob("*.py")
        if path.parent.name != "companion" or path.name in written
    ]
    tops = {
        name.partition(".")[0]
        for path in sources
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        for name in (
            [alias.name for alias in node.names] if isinstance(node, ast.Import)
            else [node.module or ""] if isinstance(node, ast.ImportFrom) and not node.level
            else []
        )
    }  # fmt: skip
    pins = (ROOT / "requirements.txt").read_text("utf-8")
    homes = packages_distributions()
    used = {home for top in tops for home in homes.get(top, []) if f"\n{home}==" in pins}
    assert used - NO_MATTER == set(stamp.LIBRARIES)


def test_another_numpy_makes_all_stale(clone):
    before, pins = stamps(clone), clone / "requirements.txt"
    pins.write_text(pins.read_text("utf-8").replace("numpy==", "numpy==1"), "utf-8")
    assert {key for key, value in stamps(clone).items() if value != before[key]} == ALL
