"""Who may import whom: the contract in pyproject.toml holds, and the gate can fail."""

import shutil
import subprocess
import sys
from pathlib import Path

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
        ("dynamics/solver.py", "from ..cameras import Rig"),
        ("cameras/geometry.py", "def late():\n    from ..study import SYSTEMS"),
        ("vision/video.py", "import vidsindy_lite.pipeline"),
        ("study/systems.py", "from ..companion import artifacts"),
        ("checks.py", "from .stamp import PACKAGE"),
    ],
)
def test_the_gate_sees_an_import_against_it(copy, module, line):
    path = copy / "vidsindy_lite" / module
    path.write_text(f"{path.read_text()}\n{line}\n")
    assert "BROKEN" in contract_problems(copy)


def test_public_names_are_few_and_there():
    for room, most in ((vidsindy_lite, 30), (study, 60)):
        assert len(set(room.__all__)) == len(room.__all__) <= most
        assert all(hasattr(room, name) for name in room.__all__)
