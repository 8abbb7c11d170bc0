"""The wheel: it holds its data, its commands run where there is no repository; and Binder."""

import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

from vidsindy_lite.storage import PACKAGE

ROOT = PACKAGE.parent
WITHOUT = (
    "torch", "pysindy", "sklearn", "pandas", "matplotlib", "seaborn", "joblib", "filelock",
    "papermill",
)  # fmt: skip
HIDE = f"""\
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {WITHOUT!r}:
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Absent())
from vidsindy_lite.__main__ import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of this tree, built offline from a copy: a build leaves files behind."""
    folder, copy = tmp_path_factory.mktemp("wheel"), tmp_path_factory.mktemp("copy")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    shutil.copytree(PACKAGE, copy / PACKAGE.name)
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-index"]
    command += ["--no-build-isolation", "--wheel-dir", str(folder), str(copy)]
    subprocess.run(command, check=True, env=os.environ | {"PYTHONPATH": ""})
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def python(wheel, tmp_path_factory):
    """An environment with the wheel in it, and the libraries of this one beside it."""
    home = tmp_path_factory.mktemp("environment")
    venv.create(home, with_pip=False)
    (site,) = home.glob("lib/python*/site-packages")
    with zipfile.ZipFile(wheel) as content:
        content.extractall(site)
    libraries = [path for path in sys.path if path.endswith("site-packages")]
    (site / "libraries.pth").write_text("\n".join(libraries))
    return home / "bin" / "python"


@pytest.mark.slow
def test_the_wheel_holds_all_modules_and_data(wheel):
    files = {path.relative_to(ROOT).as_posix() for path in PACKAGE.rglob("*") if path.is_file()}
    files = {name for name in files if "__pycache__" not in name and ".checkpoint" not in name}
    with zipfile.ZipFile(wheel) as content:
        assert {name for name in content.namelist() if ".dist-info/" not in name} == files


@pytest.mark.slow
def test_the_demo_runs_outside_the_repository_with_few_libraries(python, tmp_path):
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    command = [str(python), "-c", HIDE, "demo", "--system", "SprottE", "--frames", "200"]
    ran = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
    )
    assert "all true terms found, 0 false" in ran.stdout, ran.stderr
    where = [str(python), "-c", "import vidsindy_lite; print(vidsindy_lite.__file__)"]
    ran = subprocess.run(where, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert Path(ran.stdout.strip()).is_relative_to(python.parent.parent)


def test_binder_takes_the_python_of_the_nightly_run():
    runtime = (ROOT / "binder" / "runtime.txt").read_text().strip()
    workflow = (ROOT / ".github" / "workflows" / "figures.yml").read_text()
    assert runtime.replace("python-", 'python-version: "') + '"' in workflow
    there = {path.name for path in (ROOT / "binder").iterdir()}
    assert there == {"runtime.txt", "requirements.txt"}


@pytest.mark.slow
def test_binder_installs_these_versions_and_the_package():
    command = [sys.executable, "-m", "pip", "install", "--dry-run", "--no-deps", "--no-index"]
    command += ["--no-build-isolation", "-r", "binder/requirements.txt"]
    done = subprocess.run(
        command, cwd=ROOT, env=os.environ | {"PYTHONPATH": ""}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1].split("-")[0] == "Would install vidsindy_lite"
