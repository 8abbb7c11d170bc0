"""Execute the quick profile of notebooks as plain Python, in one process and without pictures.

    python tests/disturbed/execute.py OUTPUT 03_camera_learning 10_paper_audit

The numbers of the figures and the tables go to OUTPUT, as a run through papermill writes them; the
first cell that fails ends it. That takes a small part of the time of a run with its kernel.
"""

import os
import sys
import time
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt

NOTEBOOKS = Path(__file__).resolve().parents[2] / "notebooks"


def execute(path):
    """Run one notebook's source half."""
    source = path.read_text("utf-8").replace('profile: str = "full"', 'profile: str = "quick"')
    os.environ["VIDSINDY_NOTEBOOK"] = path.stem
    exec(compile(source, str(path), "exec"), {"__name__": path.stem})
    plt.close("all")


if __name__ == "__main__":
    os.environ["VIDSINDY_FIGURES"] = str(Path(sys.argv[1]).resolve())
    os.chdir(NOTEBOOKS)
    mpl.use("agg")
    mpl.figure.Figure.savefig = lambda *_, **__: None
    for name in sys.argv[2:] or sorted(path.stem for path in NOTEBOOKS.glob("*.py")):
        began = time.perf_counter()
        execute(NOTEBOOKS / f"{name}.py")
        print(f"[{name}: {time.perf_counter() - began:.1f} s]", flush=True)
