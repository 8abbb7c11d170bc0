"""Lower floors of the package never import higher ones."""

import ast
from pathlib import Path

import pytest

import vidsindy_lite

FLOORS = [
    {"repository", "checks", "polynomials", "splines", "geometry", "records", "information"},
    {"systems", "sights", "cameras", "perspective", "templates", "published"},
    {
        "video", "background", "detector", "training", "tracking", "synchrony", "uncertainty",
        "corruption",
    },
    {
        "smoothing", "collocation", "regression", "frames", "bridges", "trust", "discovery",
        "ado", "paper_ado", "baselines", "metrics", "limits",
    },
    {"pipeline", "sweeps"},
    {"experiments", "audit", "lab", "realistic"},
    {
        "plots", "plots_solver", "plots_study", "plots_audit", "plots_lab", "plots_report",
        "animation", "report", "artifacts", "compare", "readme", "runner", "site", "__main__",
    },
]  # fmt: skip
PACKAGE = Path(vidsindy_lite.__file__).parent


FLOOR = {name: number for number, names in enumerate(FLOORS) for name in names}


def imported(source: str) -> set[str]:
    """Full names of all that a module imports, anywhere in its text."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            home = [PACKAGE.stem] if node.level else []
            home += [node.module] if node.module else []
            found |= {".".join([*home, alias.name]) for alias in node.names}
    return found


def climbing(module: str, source: str) -> set[str]:
    """Imports of a module that lie on a higher floor; what `__init__` exports lies on the roof."""
    paths = [name.split(".") for name in imported(source)]
    parts = {"".join(path[1:2]) for path in paths if path[0] == PACKAGE.stem}
    return {part for part in parts if FLOOR.get(part, len(FLOORS)) > FLOOR[module]}


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("*.py")), ids=lambda path: path.stem)
def test_no_module_imports_a_higher_floor(path):
    if path.stem not in ("__init__", "__main__"):  # both stand above all others
        assert climbing(path.stem, path.read_text()) == set()


@pytest.mark.parametrize(
    "source",
    [
        "from .pipeline import discover_from_videos",
        "def f():\n    from . import plots",
        "from vidsindy_lite.ado import discover",
        "from vidsindy_lite import ado",
        "from vidsindy_lite import geometry, ado as solver",
        "from vidsindy_lite import discover",
        "from . import discover",
        "import vidsindy_lite.ado",
        "import vidsindy_lite as vl",
    ],
)
def test_the_gate_sees_a_climb(source):
    assert climbing("polynomials", source)


@pytest.mark.parametrize(
    "source",
    [
        "from .geometry import rodrigues",
        "from vidsindy_lite import geometry",
        "from vidsindy_lite.geometry import rodrigues",
        "import vidsindy_lite.geometry, numpy.linalg",
        "from vidsindy_lite_other import ado",
    ],
)
def test_the_gate_lets_others_pass(source):
    assert not climbing("polynomials", source)


def test_every_module_has_a_floor():
    assert {path.stem for path in PACKAGE.glob("*.py")} - {"__init__"} == set(FLOOR)


def test_names_are_exported_in_the_order_of_the_pipeline():
    exported = [getattr(vidsindy_lite, name) for name in vidsindy_lite.__all__]
    # Constants do not know where they come from.
    homes = [value.__module__.split(".")[-1] for value in exported if hasattr(value, "__module__")]
    floors = [FLOOR[home] for home in homes]
    assert floors == sorted(floors)
    assert len(set(vidsindy_lite.__all__)) == len(vidsindy_lite.__all__)


def test_the_readme_shows_the_floors():
    layout = (PACKAGE.parent / "README.md").read_text().split("## Layout")[1].split("```")[1]
    shown = [set(floor.split()) for floor in layout.split("|")]
    assert shown == FLOORS
