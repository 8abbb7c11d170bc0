"""Lower floors of the package never import higher ones."""

import ast
from pathlib import Path

import pytest

import vidsindy_lite

FLOORS = [
    {"repository", "polynomials", "splines", "geometry", "records", "information"},
    {"systems", "sights", "cameras", "perspective", "published"},
    {"video", "tracking", "corruption"},
    {
        "smoothing", "collocation", "regression", "frames", "bridges", "trust", "discovery",
        "ado", "paper_ado", "baselines", "metrics", "limits",
    },
    {"pipeline", "sweeps"},
    {"experiments", "audit", "lab"},
    {
        "plots", "plots_solver", "plots_study", "plots_audit", "plots_lab", "artifacts", "runner",
        "__main__",
    },
]  # fmt: skip
PACKAGE = Path(vidsindy_lite.__file__).parent


def siblings(source: str) -> set[str]:
    """Modules of the package that a module imports, anywhere in its text."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            found |= {node.module} if node.module else {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("vidsindy_lite"):
            found.add(node.module.removeprefix("vidsindy_lite").lstrip("."))
    return found


def climbing(module: str, source: str) -> set[str]:
    """Imports of a module that lie on a higher floor."""
    floor = {name: number for number, names in enumerate(FLOORS) for name in names}
    return {name for name in siblings(source) if floor.get(name, 0) > floor[module]}


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("*.py")), ids=lambda path: path.stem)
def test_no_module_imports_a_higher_floor(path):
    if path.stem != "__init__":
        assert climbing(path.stem, path.read_text()) == set()


@pytest.mark.parametrize(
    "source",
    [
        "from .pipeline import discover_from_videos",
        "def f():\n    from . import plots",
        "from vidsindy_lite.ado import discover",
    ],
)
def test_the_gate_sees_a_climb(source):
    assert climbing("polynomials", source)
