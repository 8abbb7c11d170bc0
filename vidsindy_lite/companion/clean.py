"""The executed half of a notebook without what differs between two runs."""

import base64
import copy
import os

import jupytext
import nbformat
from nbformat import NotebookNode

from .artifacts import with_palette


def clean(
    executed: NotebookNode, path: str | os.PathLike, profile: str, stamp: str
) -> NotebookNode:
    """The .ipynb half of a pair: cells and metadata of the .py, outputs of the run, a stamp.

    Left out is all that differs between two runs or that the source does not have: the injected
    cell, papermill's and the kernel's metadata, what went to stderr, random cell ids, how stdout
    was split into pieces. Images get a palette, which keeps a notebook small.

    Parameters
    ----------
    executed : NotebookNode
        From `execute`.
    path : path
        The .py half.
    profile, stamp : str
        Recorded in the notebook's metadata, where neither jupytext nor JupyterLab removes them.
    """
    notebook = jupytext.read(path)
    notebook.metadata.jupytext.pop("text_representation", None)  # is about the .py half
    notebook.metadata["vidsindy_lite"] = {"profile": profile, "stamp": stamp}
    ran = [c for c in executed.cells if "injected-parameters" not in c.metadata.get("tags", [])]
    count = 0
    for index, (cell, twin) in enumerate(zip(notebook.cells, ran, strict=True)):
        cell.id = f"cell-{index:02d}"
        if cell.cell_type != "code":
            continue
        cell.outputs = _tidy_outputs(twin.outputs)
        if twin.execution_count is not None:
            count += 1
            cell.execution_count = count
        for output in cell.outputs:
            if output.output_type == "execute_result":
                output.execution_count = cell.execution_count
    nbformat.validate(notebook)
    return notebook


def _tidy_outputs(outputs: list[NotebookNode]) -> list[NotebookNode]:
    """Outputs without stderr, with small pictures."""
    tidy = [copy.deepcopy(output) for output in outputs if output.get("name") != "stderr"]
    for output in tidy:
        if "image/png" in output.get("data", {}):
            small = with_palette(base64.b64decode(output.data["image/png"]))
            output.data["image/png"] = base64.b64encode(small).decode() + "\n"
    return tidy
