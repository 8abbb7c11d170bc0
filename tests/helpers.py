"""Random curves, and a repository of tiny notebooks."""

from pathlib import Path

import numpy as np

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
