"""Execute the quick profile of notebooks as plain Python, in one process and without pictures.

    python tests/disturbed/execute.py OUTPUT notebooks/03_camera_learning.py ...

The numbers of figures and tables go to OUTPUT, as from a run through papermill, in a small part of
its time. A notebook that fails does not stop the others; the exit status is the number of failures.
"""

import os
import sys
import traceback
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
from PIL import Image


def save_nothing(figure, file, **_):
    """In place of `Figure.savefig`, which takes most of the time: one pixel."""
    Image.new("RGB", (1, 1)).save(file, "PNG")


def execute(path):
    """Run the source half of one notebook; whether it got to its end."""
    source = path.read_text("utf-8").replace('profile: str = "full"', 'profile: str = "quick"')
    source = source.replace("jobs: int = 2", "jobs: int = 1")
    os.environ["VIDSINDY_NOTEBOOK"] = path.stem
    os.chdir(path.parent)
    try:
        exec(compile(source, str(path), "exec"), {"__name__": path.stem})
    except Exception:
        traceback.print_exc()
        return False
    finally:
        plt.close("all")
    return True


if __name__ == "__main__":
    folder, *paths = (Path(argument).resolve() for argument in sys.argv[1:])
    os.environ["VIDSINDY_FIGURES"] = str(folder)
    mpl.use("agg")
    mpl.figure.Figure.savefig = save_nothing
    sys.exit(sum(not execute(path) for path in paths))
