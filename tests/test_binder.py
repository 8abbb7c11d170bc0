"""What Binder installs is what everything was run with."""

import os
import subprocess
import sys

import pytest

from vidsindy_lite.storage import PACKAGE

ROOT = PACKAGE.parent


def test_binder_takes_the_python_of_the_nightly_run():
    runtime = (ROOT / "binder" / "runtime.txt").read_text().strip()
    workflow = (ROOT / ".github" / "workflows" / "figures.yml").read_text()
    assert runtime.replace("python-", 'python-version: "') + '"' in workflow
    assert {path.name for path in (ROOT / "binder").iterdir()} == {
        "runtime.txt",
        "requirements.txt",
    }


@pytest.mark.slow
def test_binder_installs_these_versions_and_the_package():
    command = [sys.executable, "-m", "pip", "install", "--dry-run", "--no-deps", "--no-index"]
    command += ["--no-build-isolation", "-r", "binder/requirements.txt"]
    done = subprocess.run(
        command, cwd=ROOT, env=os.environ | {"PYTHONPATH": ""}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1].split("-")[0] == "Would install vidsindy_lite"
