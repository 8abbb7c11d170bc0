"""The README, the notebooks, the figures and the package's reference as a folder of web pages.

Everything lies in the folder, MathJax included, which draws the formulas: the pages need no network
and no server.
"""

import os
import re
import shutil
import warnings
from importlib import import_module
from pathlib import Path

import jupyter_server_mathjax
import nbformat
import pdoc
from nbconvert import HTMLExporter
from nbconvert.filters.markdown_mistune import IPythonRenderer, MarkdownWithMath
from pygments.formatters import HtmlFormatter

from ..stamp import PACKAGE, repository_root, write_file
from .manifest import clear, sign
from .pages import page
from .run import find_notebooks


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
    for shown in (root / "figures", root / "notebooks", root / PACKAGE.name):
        if output.resolve().is_relative_to(shown):
            raise ValueError(f"output: must not lie in what is shown, got '{output}'")
    clear(output, "site")
    style = (Path(__file__).parent / "site.css").read_text("utf-8")
    colours = HtmlFormatter(style="default").get_style_defs(".highlight")
    write_file(output / "site.css", f"{style}\n{colours}\n".encode())
    shutil.copytree(root / "figures", output / "figures")
    shutil.copytree(Path(jupyter_server_mathjax.__file__).parent / "static", output / "mathjax")
    for name in ("LICENSE", "CITATION.cff", "CHANGELOG.md"):
        shutil.copy(root / name, output / name)

    notebooks = [path.with_suffix(".ipynb") for path in find_notebooks(root)]
    for path in notebooks:
        _write_page(output / "notebooks" / f"{path.stem}.html", _notebook_body(path))
    for folder in (output, output / "figures"):
        source = root / folder.relative_to(output) / "README.md"
        _write_page(folder / "index.html", _html(source.read_text("utf-8")))
    _write_reference(output / "api")
    sign(output)
    return sorted(output.rglob("*.html"))


def page_of(url: str) -> str:
    """Where a link of the repository leads in the site; others stay as they are.

    A notebook is its page, a folder and its README.md are the folder's index.
    """
    if re.match(r"[a-z]+:|#", url):
        return url
    path, mark, anchor = url.partition("#")
    path = re.sub(r"\.ipynb$", ".html", path)
    path = re.sub(r"(^|/)README\.md$", r"\1index.html", path)
    path = re.sub(r"/$", "/index.html", path)
    return path + mark + anchor


def heading_anchor(text: str) -> str:
    """The anchor of a heading, as code hosts make it: lower case, hyphens, no punctuation."""
    return re.sub(r"[^\w\- ]", "", re.sub(r"<[^>]*>", "", text)).strip().lower().replace(" ", "-")


# ------------------------------------------------------------------------------------------ details


class _Renderer(IPythonRenderer):
    """Markdown as nbconvert knows it, with links within the site and plain anchors."""

    def heading(self, text: str, level: int, **_: object) -> str:
        return f'<h{level} id="{heading_anchor(text)}">{text}</h{level}>\n'

    def link(self, text: str, url: str, title: str | None = None) -> str:
        return super().link(text, page_of(url), title)


def _html(markdown: str) -> str:
    text = MarkdownWithMath(renderer=_Renderer(escape=False)).render(markdown)
    return re.sub(r"(<table>.*?</table>)", r'<div class="wide">\1</div>', text, flags=re.DOTALL)


def _notebook_body(path: Path) -> str:
    notebook = nbformat.read(path, as_version=4)
    exporter = HTMLExporter(
        template_name="basic",
        filters={"markdown2html": _html},
        exclude_input_prompt=True,
        exclude_output_prompt=True,
    )
    return exporter.from_notebook_node(notebook)[0]


def _write_reference(folder: Path) -> None:
    """A page of each module, as pdoc makes it, and a list of them."""
    pdoc.render.configure(docformat="numpy", show_source=False, search=False)
    pages = {name: f"{name.replace('.', '/')}.html" for name in reference_modules()}
    with warnings.catch_warnings():  # a room may bring its modules along
        warnings.filterwarnings("ignore", message="The module specification")
        pdoc.pdoc(*pages, output_directory=folder)
    for path in folder.rglob("*.html"):  # a long name or signature scrolls, too
        narrow = "<style>main { overflow-x: auto; overflow-wrap: anywhere; }</style>\n</head>"
        write_file(path, path.read_text("utf-8").replace("</head>", narrow).encode())
    lines = [
        f"* [{name}]({path}): " + (import_module(name).__doc__ or "").split("\n\n")[0]
        for name, path in pages.items()
    ]
    _write_page(folder / "index.html", _html("# Reference\n\n" + "\n".join(lines)))


def reference_modules() -> list[str]:
    """Dotted names of the package's modules, rooms before what they hold."""
    parts = [path.relative_to(PACKAGE).with_suffix("").parts for path in PACKAGE.rglob("*.py")]
    names = {tuple(part for part in each if part != "__init__") for each in parts}
    return [".".join((PACKAGE.name, *each)) for each in sorted(names - {("__main__",)})]


def _write_page(path: Path, body: str) -> None:
    title, *_ = re.findall(r"<h1[^>]*>(.*?)</h1>", body, re.DOTALL)
    top = "" if (path.parent / "site.css").exists() else "../"
    title = re.sub(r"<[^>]*>", "", title)
    write_file(path, page("site.html", title=title, top=top, body=body).encode())
