"""README, docs/, the notebooks, the figures and the package's reference as a folder of web pages.

Sphinx makes them, of the notebooks myst-nb. Everything lies in the folder, the search and MathJax
included, which draws the formulas: the pages need no network and no server.
"""

import os
import re
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import jupyter_server_mathjax
import nbformat
from sphinx.application import Sphinx

from ..stamp import PACKAGE, repository_root
from .manifest import clear, sign
from .readme import reading_minutes
from .records import read_records
from .registry import load_run_times
from .run import find_notebooks
from .slides import slides

SETTINGS = {
    "project": PACKAGE.name,
    "extensions": ["myst_nb", *(f"sphinx.ext.{n}" for n in ("apidoc", "autodoc", "napoleon"))],
    "include_patterns": [
        "*.md", "docs/*.md", "notebooks/*", "figures/README.md", "api/vidsindy_lite*",
    ],
    "nb_execution_mode": "off",
    "myst_enable_extensions": ["dollarmath"],
    "myst_heading_anchors": 4,
    "apidoc_modules": [{
        "path": PACKAGE, "destination": "api", "module_first": True, "separate_modules": True,
        "exclude_patterns": ["**/__main__.py"],
    }],
    "default_role": "py:obj",
    "napoleon_use_param": False,  # or "shape" in the type of an argument links to `Scene.shape`
    "suppress_warnings": ["ref.python"],  # one name, several places
    "html_theme": "furo",
    "html_title": PACKAGE.name,
    "html_copy_source": False,
    "html_static_path": [
        str(Path(jupyter_server_mathjax.__file__).parent / "static"),
        str(Path(__file__).with_suffix(".css")),
    ],
    "html_css_files": ["site.css"],
    "html_use_index": False,  # its names are wider than a screen
    "myst_update_mathjax": False,
    "mathjax_options": {"defer": "defer"},
    "mathjax_path": "MathJax.js?config=TeX-AMS-MML_HTMLorMML-full",
    # MathJax's own font, so that the pages look the same everywhere. Its style "@font-face" asks
    # for the page about:blank, which browsers refuse; assistive MathML is for missing fonts.
    "mathjax2_config": {
        "jax": ["input/TeX", "output/HTML-CSS"],
        "tex2jax": {"processClass": "math"},
        "HTML-CSS": {
            "availableFonts": [], "webFont": "STIX-Web", "linebreaks": {"automatic": True},
            "styles": {"@font-face": {"src": "local('serif')"}},
        },
        "AssistiveMML": {"disabled": True}, "showMathMenu": False, "messageStyle": "none",
    },
}  # fmt: skip


def build_site(output: str | os.PathLike, root: str | os.PathLike | None = None) -> list[Path]:
    """Write the pages and what they show into a folder; an earlier site there is replaced.

    Parameters
    ----------
    output : path
        A folder that this function wrote, an empty one, or one that does not exist.
    root : path, optional
        The repository; by default the one around the working directory. Its executed notebooks
        are shown as they are.

    Returns
    -------
    list of Path
        All pages.

    Raises
    ------
    ValueError
        If the folder holds anything but a site, or lies in what is shown.
    FileNotFoundError
        If there is no repository, or a notebook has not been executed yet.
    """
    root, output = repository_root(root), Path(output)
    for shown in ("docs", "figures", "notebooks", PACKAGE.name):
        if output.resolve().is_relative_to(root / shown):
            raise ValueError(f"output: must not lie in what is shown, got '{output}'")
    clear(output, "site")
    with TemporaryDirectory() as scratch:
        pages, doctrees = Path(scratch) / "pages", Path(scratch) / "doctrees"
        for folder in ("figures", "docs"):
            shutil.copytree(root / folder, pages / folder)
        (pages / "notebooks").mkdir()
        for path in find_notebooks(root):
            executed = path.with_suffix(".ipynb")
            nbformat.write(_described(executed), pages / "notebooks" / executed.name)
        (pages / "docs" / "slides.md").write_text(slides(root), "utf-8")
        for name in ("LICENSE", "CITATION.cff", "CHANGELOG.md"):
            shutil.copy(root / name, pages)
        parts = root / "README.md", Path(__file__).parent / "contents.md"
        first = "".join(part.read_text("utf-8") for part in parts)
        (pages / "index.md").write_text(first, "utf-8")
        try:
            sphinx = Sphinx(pages, None, output, doctrees, "html", SETTINGS, warning=sys.stderr)
            sphinx.connect("html-page-context", _near_contents, priority=400)  # before the theme's
            sphinx.build()
        finally:
            sign(output)  # what was interrupted is ours, too, and may be replaced
    return sorted(output.rglob("*.html"))


def _near_contents(app: Sphinx, page: str, template: str, context: dict, doctree: object) -> None:
    """Beside a page stands what is near it: all modules on all of their pages are half the time."""
    whole = context["toctree"]
    context["toctree"] = lambda **options: whole(**options | {"collapse": True})


def _described(executed: Path) -> nbformat.NotebookNode:
    """A notebook that says how long it takes, and its pictures in words: their captions."""
    figures = executed.parent.parent / "figures"
    records, seconds = read_records(figures), load_run_times(figures).get(executed.stem, 0.0)
    captions = {name: record["caption"] for name, record in records.items()}
    notebook = nbformat.read(executed, as_version=4)
    for cell in notebook.cells:
        named = re.findall(r'"(\w+)"', cell.source) if cell.cell_type == "code" else []
        if said := " ".join(captions[name] for name in named if name in captions):
            cell.metadata["mystnb"] = {"image": {"alt": said}}
    title, _, rest = notebook.cells[0].source.partition("\n")
    long = f"{seconds:.0f} seconds" if seconds < 120 else f"{seconds / 60:.0f} minutes"
    running = f", {long} to run" if seconds else ""
    takes = f"*About {reading_minutes(executed)} minutes to read{running}.*"
    notebook.cells[0].source = f"{title}\n\n{takes}\n{rest}"
    return notebook
