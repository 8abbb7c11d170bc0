"""What all tests share: settings, random curves, and a repository of tiny notebooks."""

import os
from collections import Counter
from functools import cache
from pathlib import Path

# Before numpy is imported: results then do not depend on the number of cores.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pytest
from hypothesis import settings

from vidsindy_lite import pipeline

# The same examples in every run, so that a red test stays red; no deadline on a busy machine.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


def pytest_collection_modifyitems(items):
    """Begin with the files of long tests, so that no worker ends with one of them, alone."""
    marked = [
        Counter(item.path for item in items if item.get_closest_marker(mark))
        for mark in ("notebooks", "slow")
    ]
    items.sort(key=lambda item: [-count[item.path] for count in marked])


HEADER = """\
# ---
# jupyter:
#   jupytext:
#     cell_metadata_filter: tags,-all
#     formats: ipynb,py:percent
#     notebook_metadata_filter: kernelspec,jupytext,-jupytext.text_representation.jupytext_version
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---

# %% [markdown]
# # A tiny notebook

# %% tags=["parameters"]
profile: str = "full"  # full or quick
"""


def trajectory(rng, n):
    """A smooth 3D curve of random shape, size and place."""
    t = np.linspace(0, 8, n)[:, None]
    waves = sum(
        rng.normal(size=3) / k * np.sin(k * t + rng.uniform(0, 2 * np.pi, 3)) for k in range(1, 6)
    )
    return rng.normal(scale=5, size=3) + rng.uniform(1, 100) * waves


class TinyRepository:
    """A folder laid out like the repository, to fill with tiny notebooks."""

    def __init__(self, root: Path):
        self.root = root
        self.notebooks = root / "notebooks"
        self.notebooks.mkdir(exist_ok=True)
        (root / "vidsindy_lite").mkdir(exist_ok=True)
        (root / "requirements.txt").write_text("numpy==2.4.6\n")

    def write(self, name: str, *cells: str) -> Path:
        """Write notebooks/<name>.py: a title, the parameters cell, and these code cells."""
        path = self.notebooks / f"{name}.py"
        path.write_text(HEADER + "".join(f"\n# %%\n{cell}\n" for cell in cells))
        return path


@pytest.fixture(scope="module")
def tracked_once():
    """Tracks each video file once, however many tests of a module discover from it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline, "follow", cache(pipeline.follow))
        yield


@pytest.fixture
def tiny(tmp_path) -> TinyRepository:
    """An empty `TinyRepository`."""
    return TinyRepository(tmp_path)
