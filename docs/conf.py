"""Sphinx makes web pages of README, docs/, the executed notebooks, figures and the package.

    sphinx-build -c docs . build/site          (`make site`)

The search and MathJax lie in the folder: the pages need no network and no server.
"""

import json
import re
import subprocess
from functools import cache
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).parent.parent
CONTENTS = """
```{toctree}
:hidden:
:caption: The book

docs/guide
docs/data
docs/rigs
docs/films
docs/laws
docs/targets
docs/formats
docs/results
docs/paper
docs/claims
docs/glossary
docs/teaching
```

```{toctree}
:hidden:
:glob:
:caption: The notebooks

notebooks/*
```

```{toctree}
:hidden:
:glob:
:caption: Exercises

notebooks/exercises/*
```

```{toctree}
:hidden:
:glob:
:caption: Solutions

notebooks/solutions/*
```

```{toctree}
:hidden:
:caption: What is found, and how

figures/README
docs/development
build/api/vidsindy_lite
CHANGELOG
```
"""
WORDS, LINES = 200, 12  # of prose, of code that is not folded, that one reads in a minute

project = html_title = "vidsindy_lite"
root_doc = "README"
extensions = ["myst_nb", "sphinx.ext.apidoc", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
include_patterns = [
    "*.md", "docs/*.md", "notebooks/*.ipynb", "notebooks/exercises/*.ipynb",
    "notebooks/solutions/*.ipynb", "figures/README.md", "build/api/vidsindy_lite*",
]  # fmt: skip
exclude_patterns = [".*", "build/[!a]*"]  # folders of very many files
nb_execution_mode = "off"
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
apidoc_modules = [{
    "path": ROOT / "vidsindy_lite", "destination": "build/api", "module_first": True,
    "separate_modules": True, "exclude_patterns": ["**/__main__.py"],
}]  # fmt: skip
autodoc_use_type_comments = False  # there are none, and every function would be parsed for them
autodoc_typehints = "none"  # each argument says its own
default_role = "py:obj"
napoleon_use_param = False  # or "shape" in the type of an argument links to `Scene.shape`
suppress_warnings = ["ref.python"]  # one name, several places
html_theme = "furo"
html_copy_source = False
html_static_path = [
    str(Path(find_spec("jupyter_server_mathjax").origin).parent / "static"),
    str(ROOT / "docs" / "site.css"),
]  # fmt: skip
html_css_files = ["site.css"]
html_use_index = False  # its names are wider than a screen
myst_update_mathjax = False
mathjax_options = {"defer": "defer"}
mathjax_path = "MathJax.js?config=TeX-AMS-MML_HTMLorMML-full"
# MathJax's own font, so that the pages look the same everywhere. Its style "@font-face" asks for
# the page about:blank, which browsers refuse; assistive MathML is for missing fonts.
mathjax2_config = {
    "jax": ["input/TeX", "output/HTML-CSS"],
    "tex2jax": {"processClass": "math"},
    "HTML-CSS": {
        "availableFonts": [], "webFont": "STIX-Web", "linebreaks": {"automatic": True},
        "styles": {"@font-face": {"src": "local('serif')"}},
    },
    "AssistiveMML": {"disabled": True}, "showMathMenu": False, "messageStyle": "none",
}  # fmt: skip


def setup(app):
    app.connect("source-read", prepare)
    app.connect("html-page-context", near_contents, priority=400)  # before the theme's


def prepare(app, page, source):
    """The first page leads to all others; a notebook says how long it is, its pictures in words."""
    if page == "README":
        source[0] += CONTENTS
    elif page.startswith("notebooks/"):
        source[0] = json.dumps(described(json.loads(source[0]), launchers(page, origin())))


@cache
def origin():
    """The address of the repository that this is a clone of, empty if of none."""
    asked = ["git", "remote", "get-url", "origin"]
    return subprocess.run(asked, cwd=ROOT, capture_output=True, text=True).stdout


def launchers(page, origin):
    """Links that open a notebook on Binder and Colab, if its repository is one on GitHub."""
    found = re.search(r"github\.com[:/]([\w.-]+/[\w.-]+?)(\.git)?$", origin.strip())
    if not found:
        return ""
    binder = f"https://mybinder.org/v2/gh/{found[1]}/HEAD?urlpath=lab/tree/{page}.ipynb"
    colab = f"https://colab.research.google.com/github/{found[1]}/blob/HEAD/{page}.ipynb"
    return f"Open it on [Binder]({binder}) or [Colab]({colab})."


@cache  # every notebook asks
def captions_of_figures():
    """What stands under each figure and table."""
    files = (ROOT / "figures").glob("*.json")
    return {path.stem: json.loads(path.read_text("utf-8"))["caption"] for path in files}


def described(notebook, links=""):
    """A notebook with its minutes to read under its title, and its pictures with their captions."""
    captions, words, lines = captions_of_figures(), 0, 0
    for cell in notebook["cells"]:
        text = "".join(cell["source"])
        if cell["cell_type"] == "code":
            if "hide-input" not in cell["metadata"].get("tags", ()):
                lines += text.count("\n") + 1
            said = [captions[name] for name in re.findall(r'"(\w+)"', text) if name in captions]
            if said:
                cell["metadata"]["mystnb"] = {"image": {"alt": " ".join(said)}}
        else:
            words += len(text.split())
    title, _, rest = "".join(notebook["cells"][0]["source"]).partition("\n")
    minutes = 5 * -(-(words / WORDS + lines / LINES) // 5)
    told = f"*About {minutes:.0f} minutes to read.* {links}".strip()
    notebook["cells"][0]["source"] = f"{title}\n\n{told}\n{rest}"
    return notebook


def near_contents(app, page, template, context, doctree):
    """Beside a page stands what is near it: all modules on all of their pages are half the time."""
    whole = context["toctree"]
    context["toctree"] = lambda **options: whole(**options | {"collapse": True})
