"""Who may import whom: the contract in pyproject.toml holds, and the gate can fail."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import vidsindy_lite
from vidsindy_lite import study

ROOT = Path(vidsindy_lite.__file__).parent.parent


def contract_problems(root: Path) -> str:
    """What import-linter has to say of a repository; nothing if every contract is kept."""
    command = "from importlinter.cli import lint_imports_command; lint_imports_command()"
    ran = subprocess.run(
        [sys.executable, "-c", command, "--no-cache"],
        cwd=root, capture_output=True, text=True, env={"PYTHONPATH": str(root), "PATH": ""},
    )  # fmt: skip
    return "" if ran.returncode == 0 else ran.stdout + ran.stderr


@pytest.fixture
def copy(tmp_path):
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    shutil.copytree(ROOT / "vidsindy_lite", tmp_path / "vidsindy_lite")
    return tmp_path


def test_the_contract_is_kept():
    assert contract_problems(ROOT) == ""


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("dynamics/solver.py", "def late():\n    from ..cameras import Rig"),
        ("checks.py", "from .storage import PACKAGE"),
    ],
)
def test_the_gate_sees_an_import_against_it(copy, module, line):
    path = copy / "vidsindy_lite" / module
    path.write_text(f"{path.read_text()}\n{line}\n")
    assert "BROKEN" in contract_problems(copy)


def side_doors(path: Path) -> set[str]:
    """Modules of other rooms that a module imports past their front door."""
    room = path.relative_to(ROOT / "vidsindy_lite").parts[0]
    taken = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            home = ["vidsindy_lite"] if node.level else []
            parts = [*home, *(node.module or "").split(".")]
            if parts[0] == "vidsindy_lite" and len(parts) > 2 and node.level != 1:
                taken.add(".".join(parts[1:3]))
    return {name for name in taken - {"study.plots"} if not name.startswith(f"{room}.")}


@pytest.mark.parametrize("room", ["dynamics", "cameras", "vision", "study", "companion"])
def test_rooms_are_entered_by_their_front_door(room):
    modules = (ROOT / "vidsindy_lite" / room).rglob("*.py")
    assert {door for path in modules for door in side_doors(path)} == set()


@pytest.mark.parametrize(
    ("line", "door"),
    [
        ("from vidsindy_lite.cameras.rig import Rig", "cameras.rig"),
        ("def late():\n    from ..cameras.rig import Rig", "cameras.rig"),
    ],
)
def test_the_gate_sees_a_side_door(copy, line, door, monkeypatch):
    path = copy / "vidsindy_lite" / "study" / "paper.py"
    path.write_text(f"{path.read_text()}\n{line}\n")
    monkeypatch.setitem(globals(), "ROOT", copy)
    assert side_doors(path) == {door}


def test_public_names_are_few_and_there():
    names = vidsindy_lite.__all__
    assert len(set(names)) == len(names) <= 31
    assert all(hasattr(vidsindy_lite, name) for name in names)
    values = [value for name, value in vars(study).items() if not name.startswith("_")]
    assert sum(not isinstance(value, ModuleType) for value in values) <= 60
