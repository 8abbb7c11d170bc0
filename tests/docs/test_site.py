"""Every page of the site in a browser, at two widths, without a network."""

import re
import runpy
import subprocess
import sys
import time
from types import SimpleNamespace

import matplotlib.pyplot as plt
import pytest
from browser import Browser, needs_browser

from vidsindy_lite.companion.artifacts import save_slider
from vidsindy_lite.storage import PACKAGE

ROOT = PACKAGE.parent
LAPTOP, PHONE = 1280, 390  # CSS pixels


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder of the site, and what was warned of while it was written."""
    output = tmp_path_factory.mktemp("site")
    # Collecting garbage would be a quarter of the time.
    code = "import gc, sys; gc.disable(); from sphinx.cmd.build import main; sys.exit(main())"
    command = [sys.executable, "-c", code, "--quiet", "--conf-dir", "docs", ".", str(output)]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    return output, ran.stderr


@pytest.fixture(scope="module")
def site(built):
    """The folder of the site."""
    return built[0]


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Browser(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


def page_problems(browser, page, width):
    """What a reader would miss on a page, or have to scroll sideways for."""
    seen = browser.open(page, width)
    words = {
        "broken": "broken image ", "wordless": "image without words ", "errors": "console: ",
        "cut": "code wider than its box: ", "requests": "asks the network for ",
        "dead": "link to no place on the page: #", "unread": "formula: ",
    }  # fmt: skip
    problems = [f"{said}{one}" for kind, said in words.items() for one in seen[kind]]
    if not seen["text"].strip():
        problems.append("shows no text")
    if seen["width"] > width:
        problems.append(f"{seen['width']} px wide in a window of {width}")
    return problems


def dead_links(site):
    """Links and images of all pages that lead to no file of the site."""
    problems = []
    for page in site.rglob("*.html"):
        text = re.sub(r"<pre.*?</pre>", "", page.read_text("utf-8"), flags=re.DOTALL)
        for url in re.findall(r'(?:href|src)="([^"#?]+)', text):
            if not re.match(r"[a-z]+:", url) and not (page.parent / url).exists():
                problems.append(f"{page.name}: {url}")
    return problems


@pytest.mark.slow
@needs_browser
@pytest.mark.parametrize("width", [LAPTOP, PHONE])
def test_every_page_can_be_read(site, browser, width):
    pages = sorted(path for path in site.rglob("*.html") if "_static" not in path.parts)
    assert len(pages) > len(list((ROOT / "notebooks").glob("*.py")))
    found = {str(page.relative_to(site)): page_problems(browser, page, width) for page in pages}
    assert {page: problems for page, problems in found.items() if problems} == {}


@pytest.mark.parametrize(
    "origin", ["https://github.com/some-one/film.law.git\n", "git@github.com:some-one/film.law.git"]
)
def test_a_notebook_of_a_repository_on_github_opens_on_binder_and_colab(origin):
    conf = SimpleNamespace(**runpy.run_path(str(ROOT / "docs" / "conf.py")))
    for elsewhere in ("", "/home/me/film", "https://example.org/github.com.git"):
        assert conf.launchers("notebooks/01_projection_proofs", elsewhere) == ""
    told = conf.launchers("notebooks/01_projection_proofs", origin)
    binder, colab = re.findall(r"\((https://[^)]+)\)", told)
    assert binder.startswith("https://mybinder.org/v2/gh/some-one/film.law/HEAD?urlpath=lab/tree/")
    assert "/github/some-one/film.law/blob/HEAD/" in colab
    for address in (binder, colab):
        assert (ROOT / re.search(r"notebooks/.*", address)[0]).is_file()
    notebook = {"cells": [{"cell_type": "markdown", "source": ["# Title\n", "Text."]}]}
    assert told in conf.described(notebook, told)["cells"][0]["source"]


@pytest.mark.slow
def test_pages_hold_the_sliders_of_their_notebooks_and_how_long_these_take(site):
    for executed in (ROOT / "notebooks").glob("*.ipynb"):
        page = (site / "notebooks" / f"{executed.stem}.html").read_text("utf-8")
        assert page.count('type="range"') == executed.read_text("utf-8").count(r"type=\"range\"")
        assert re.search(r"</h1>\s*<p><em>About \d+ minutes to read.</em>", page)


@needs_browser
def test_a_slider_moves_its_frames_and_says_where_it_is(browser, tmp_path, monkeypatch):
    monkeypatch.setenv("VIDSINDY_FIGURES", str(tmp_path))
    figures = {f"{level} px": plt.figure(figsize=(5, 2)) for level in (0, 1, 2, 4)}
    slider = save_slider("noise", figures, caption="Noise.", numbers={})
    (tmp_path / "page.html").write_text(GOOD.format(slider.data))
    assert page_problems(browser, tmp_path / "page.html", PHONE) == []
    code = """(() => {
        const input = document.querySelector("input"), image = document.querySelector("img");
        const top = () => Math.round(image.getBoundingClientRect().top
            - image.parentElement.getBoundingClientRect().top);
        input.value = 2;
        input.dispatchEvent(new Event("input"));
        const frame = image.parentElement.getBoundingClientRect().height;
        return [document.querySelector("output").value, top() / frame];
    })()"""
    said, moved = browser.command("Runtime.evaluate", expression=code, returnByValue=True)[
        "result"
    ]["value"]
    assert said == "2 px"
    assert moved == pytest.approx(-2, abs=0.02)


@pytest.mark.slow
def test_the_contents_beside_the_pages_lead_to_every_page(site):
    reached, ahead = set(), {(site / "README.html").resolve()}
    while ahead:
        page = ahead.pop()
        reached.add(page)
        (contents,) = re.findall(
            r'class="sidebar-tree">(.*?)</aside>', page.read_text("utf-8"), re.S
        )
        links = re.findall(r'href="([^"#:]+)', contents)
        ahead |= {(page.parent / link).resolve() for link in links} - reached
    pages = {page.resolve() for page in site.rglob("*.html") if "_static" not in page.parts}
    aside = {site / "search.html", site / "py-modindex.html"}  # indexes, not pages
    assert pages - reached == {page.resolve() for page in aside}


@pytest.mark.slow
def test_nothing_is_warned_of_every_link_leads_to_a_file_and_every_module_has_a_page(built):
    site, warned = built
    assert warned == ""  # such as of a docstring that cannot be read
    assert dead_links(site) == []
    parts = [path.relative_to(ROOT).with_suffix("").parts for path in PACKAGE.rglob("*.py")]
    names = {".".join(part for part in each if part != "__init__") for each in parts}
    pages = {path.stem for path in (site / "build" / "api").glob("*.html")}
    assert pages == names - {"vidsindy_lite.__main__"}


@pytest.mark.slow
@needs_browser
def test_a_page_draws_its_formulas_and_figures_and_leads_to_others(site, browser):
    seen = browser.open(site / "notebooks" / "03_camera_learning.html")
    assert seen["formulas"] > 10
    executed = (ROOT / "notebooks" / "03_camera_learning.ipynb").read_text("utf-8")
    assert seen["images"] == executed.count('"image/png":') + executed.count("<img ") >= 5
    assert r"\mathbf" not in seen["text"]
    for selector, end in (
        ("a.prev-page", "02_videos_and_tracking.html"),
        ("a.next-page", "04_spline_ado.html"),
        (".sidebar-tree a[href*='10_']", "10_paper_audit.html"),
        (".toc-tree li li a", "#exercises"),
    ):
        assert any(link.endswith(end) for link in links(browser, selector)), selector
    browser.command("Page.navigate", url=(site / "search.html").as_uri() + "?q=epipolar")
    deadline = time.monotonic() + 30
    while not (found := links(browser, "#search-results li a")) and time.monotonic() < deadline:
        time.sleep(0.2)
    assert any("03_camera_learning.html" in link for link in found)


def links(browser, selector):
    """Addresses of the links of a page that fit a selector."""
    code = f"[...document.querySelectorAll({selector!r})].map(link => link.href)"
    answer = browser.command("Runtime.evaluate", expression=code, returnByValue=True)
    return answer["result"].get("value") or []


GOOD = """<!DOCTYPE html><link rel='icon' href='data:,'>
<meta name='viewport' content='width=device-width'><body>{}</body>"""


@needs_browser
@pytest.mark.parametrize(
    ("body", "problem"),
    [
        ("", "shows no text"),
        ("text <img src='missing.png' alt='a'>", "broken image"),
        ("text <img src='data:,'>", "image without words"),
        ("text <pre style='overflow: auto; width: 99px'>so_long_a_name_of_it</pre>", "code wider"),
        ("text <script>console.error('seen')</script>", "console: .*seen"),
        ("text <script>missing()</script>", "console: Uncaught"),
        ("text <script src='https://cdn.invalid/x.js'></script>", "asks the network"),
        ("text <a href='#nowhere'>link</a>", "no place on the page: #nowhere"),
        ("<p style='width: 500px'>text</p>", "wide in a window of 390"),
    ],
)
def test_a_bad_page_is_seen(browser, tmp_path, body, problem):
    page = tmp_path / "page.html"
    page.write_text(GOOD.format(body))
    found = page_problems(browser, page, PHONE)
    assert any(re.search(problem, line) for line in found), found


def test_a_dead_link_is_seen(tmp_path):
    (tmp_path / "a.html").write_text('<a href="a.html">a</a> <img src="b.png">')
    assert dead_links(tmp_path) == ["a.html: b.png"]
