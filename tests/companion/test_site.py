"""Every page of the site in a browser, at two widths, without a network."""

import re
import warnings

import pdoc
import pytest
from browser import CHROMIUM, Browser

from vidsindy_lite.companion.site import build_site, heading_anchor, page_of
from vidsindy_lite.stamp import PACKAGE

ROOT = PACKAGE.parent
LAPTOP, PHONE = 1280, 390  # CSS pixels
needs_browser = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium here to open the pages in: apt-get install chromium"
)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site."""
    output = tmp_path_factory.mktemp("site")
    build_site(output, ROOT)
    return output


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Browser(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


def page_problems(browser, page, width):
    """What a reader would miss on a page, or have to scroll sideways for."""
    seen = browser.open(page, width)
    problems = [f"broken image {image}" for image in seen["broken"]]
    problems += [f"console: {error}" for error in seen["errors"]]
    problems += [f"asks the network for {url}" for url in seen["requests"]]
    problems += [f"link to no place on the page: #{anchor}" for anchor in seen["dead"]]
    problems += [f"formula: {formula}" for formula in seen["unread"]]
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


# ----------------------------------------------------------------------------------------- our site


@pytest.mark.slow
@needs_browser
@pytest.mark.parametrize("width", [LAPTOP, PHONE])
def test_every_page_can_be_read(site, browser, width):
    pages = sorted(path for path in site.rglob("*.html") if "mathjax" not in path.parts)
    assert len(pages) > len(list((ROOT / "notebooks").glob("*.py")))
    found = {str(page.relative_to(site)): page_problems(browser, page, width) for page in pages}
    assert {page: problems for page, problems in found.items() if problems} == {}


@pytest.mark.slow
@needs_browser
def test_formulas_and_figures_are_drawn(site, browser):
    seen = browser.open(site / "notebooks" / "03_camera_learning.html")
    assert seen["formulas"] > 10
    assert seen["images"] == 5
    assert r"\mathbf" not in seen["text"]


@pytest.mark.slow
def test_every_link_leads_to_a_file(site):
    assert dead_links(site) == []


# ------------------------------------------------------------------------------- the gate can fail


GOOD = """<!DOCTYPE html><link rel='icon' href='data:,'>
<meta name='viewport' content='width=device-width'><body>{}</body>"""


@pytest.mark.slow
def test_the_reference_reads_all_annotations(tmp_path):
    modules = [path.stem for path in PACKAGE.glob("*.py") if not path.stem.startswith("__")]
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message="Error parsing type annotation")
        pdoc.pdoc(
            PACKAGE.name,
            *(f"{PACKAGE.name}.{name}" for name in modules),
            output_directory=tmp_path,
        )
    for name in modules:
        assert (tmp_path / PACKAGE.name / f"{name}.html").exists()


@needs_browser
@pytest.mark.parametrize(
    ("body", "problem"),
    [
        ("", "shows no text"),
        ("text <img src='missing.png'>", "broken image"),
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


@needs_browser
def test_a_good_page_passes(browser, tmp_path):
    (tmp_path / "page.html").write_text(GOOD.format("text"))
    assert page_problems(browser, tmp_path / "page.html", PHONE) == []


def test_a_dead_link_is_seen(tmp_path):
    (tmp_path / "a.html").write_text('<a href="a.html">a</a> <img src="b.png">')
    assert dead_links(tmp_path) == ["a.html: b.png"]


# -------------------------------------------------------------------------------------------- parts


@pytest.mark.parametrize(
    ("url", "page"),
    [
        ("notebooks/00_tour.ipynb", "notebooks/00_tour.html"),
        ("../notebooks/00_tour.ipynb#exercises", "../notebooks/00_tour.html#exercises"),
        ("README.md", "index.html"),
        ("../figures/README.md#fig_2", "../figures/index.html#fig_2"),
        ("figures/", "figures/index.html"),
        ("fig_2.svg", "fig_2.svg"),
        ("#fig_2", "#fig_2"),
        ("https://example.org/a.ipynb", "https://example.org/a.ipynb"),
    ],
)
def test_links_lead_to_pages(url, page):
    assert page_of(url) == page


def test_anchors_are_those_of_a_code_host():
    assert heading_anchor("Figure_S1: what it <em>shows</em>") == "figure_s1-what-it-shows"


def test_a_folder_of_something_else_is_not_emptied(tmp_path):
    (tmp_path / "letter").write_text("dear")
    with pytest.raises(ValueError, match="output: expected a new or empty folder or a site"):
        build_site(tmp_path, ROOT)
    assert (tmp_path / "letter").exists()
