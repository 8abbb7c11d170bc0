"""Execute a notebook as plain Python, in its quick profile or with other settings, on no paper.

Figures are drawn, see `undisplayed.py`, tables go to VIDSINDY_FIGURES, sweeps work in this process.
"""

import importlib
import os
import re
import sys
from pathlib import Path

HARNESS = Path(__file__).parent


def execute(notebook, settings, variables, log):
    """Do so in a new process, with more environment variables; what goes wrong stands in a log."""
    for stream, path in ((1, os.devnull), (2, log)):
        os.dup2(os.open(path, os.O_WRONLY), stream)
    source = notebook.read_text("utf-8")
    for name, value in ({"profile": "quick", "jobs": 1} | settings).items():
        source, there = re.subn(
            rf"^({name}: \w+ = ).*?(?=  #)", rf"\g<1>{value!r}", source, count=1, flags=re.MULTILINE
        )
        if not there and name != "jobs":
            sys.exit(f"{name}: must be a parameter of {notebook.stem}")
    os.environ |= variables
    os.chdir(notebook.parent)
    sys.path.insert(0, str(HARNESS))
    importlib.import_module("disturbed.sitecustomize")  # before the package
    importlib.import_module("matplotlib").use("module://undisplayed")
    exec(compile(source, str(notebook), "exec"), {"__name__": notebook.stem})
