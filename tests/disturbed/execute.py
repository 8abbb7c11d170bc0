"""Execute a notebook as plain Python, in its quick profile or with other settings, on no paper.

    python tests/disturbed/execute.py FIGURES notebooks/03_camera_learning.py '{"seed": 1}'

Its figures are laid out and drawn, see `undisplayed.py`, its tables go to FIGURES, as from a run
through papermill, in a part of its time. Sweeps work in this very process: the cores are busy.
"""

import json
import os
import re
import sys
from pathlib import Path

import matplotlib as mpl

if __name__ == "__main__":
    figures, notebook = (Path(argument).resolve() for argument in sys.argv[1:3])
    settings = {"profile": "quick", "jobs": 1} | json.loads((*sys.argv, "{}")[3])
    source = notebook.read_text("utf-8")
    for name, value in settings.items():
        source, there = re.subn(
            rf"^({name}: \w+ = ).*?(?=  #)", rf"\g<1>{value!r}", source, count=1, flags=re.MULTILINE
        )
        if not there and name != "jobs":
            sys.exit(f"{name}: must be a parameter of {notebook.stem}")
    os.environ |= {"VIDSINDY_FIGURES": str(figures), "VIDSINDY_NOTEBOOK": notebook.stem}
    os.chdir(notebook.parent)
    mpl.use("module://undisplayed")
    exec(compile(source, str(notebook), "exec"), {"__name__": notebook.stem})
