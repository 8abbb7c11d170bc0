"""Every page of the site in a browser, at two widths, without a network."""

import contextlib
import gc
import io
import re
import time

import matplotlib.pyplot as plt
import pytest
from browser import CHROMIUM, Browser
from vidsindy_lite.companion.manifest import clear, sign
from vidsindy_lite.companion.site import build_site

from vidsindy_lite.companion.artifacts import save_slider
from vidsindy_lite.repository import PACKAGE, write_file

ROOT = PACKAGE.parent
LAPTOP, PHONE = 1280, 390  # CSS pixels
needs_browser = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium here to open the pages in: apt-get install chromium"
)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder of the site, and what was warned of while it was written."""
    output = tmp_path_factory.mktemp("site")
    gc.disable()  # looking for garbage among all those trees takes a third of the time
    try:
        with contextlib.redirect_stderr(io.StringIO()) as seen:
            build_site(output, ROOT)
    finally:
        gc.enable()
    return output, seen.getvalue()


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
    problems = [f"broken image {image}" for image in seen["broken"]]
    problems += [f"image without words {image}" for image in seen["wordless"]]
    problems += [f"code wider than its box: {code}" for code in seen["cut"]]
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
    pages = sorted(path for path in site.rglob("*.html") if "_static" not in path.parts)
    assert len(pages) > len(list((ROOT / "notebooks").glob("*.py")))
    found = {str(page.relative_to(site)): page_problems(browser, page, width) for page in pages}
    assert {page: problems for page, problems in found.items() if problems} == {}


@pytest.mark.slow
@needs_browser
def test_formulas_and_figures_are_drawn(site, browser):
    seen = browser.open(site / "notebooks" / "03_camera_learning.html")
    assert seen["formulas"] > 10
    executed = (ROOT / "notebooks" / "03_camera_learning.ipynb").read_text("utf-8")
    assert seen["images"] == executed.count('"image/png":') + executed.count("<img ") >= 5
    assert r"\mathbf" not in seen["text"]


@pytest.mark.slow
def test_a_notebook_says_how_long_it_takes(site):
    page = (site / "notebooks" / "03_camera_learning.html").read_text("utf-8")
    assert re.search(r"</h1>\s*<p><em>About \d+ minutes to read, \d+ seconds to run.</em>", page)


@pytest.mark.slow
def test_pages_hold_the_sliders_of_their_notebooks(site):
    for executed in (ROOT / "notebooks").glob("*.ipynb"):
        page = (site / "notebooks" / f"{executed.stem}.html").read_text("utf-8")
        assert page.count('type="range"') == executed.read_text("utf-8").count(r"type=\"range\"")


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
    reached, ahead = set(), {(site / "index.html").resolve()}
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
def test_every_link_leads_to_a_file(site):
    assert dead_links(site) == []


@pytest.mark.slow
def test_nothing_is_warned_of_such_as_a_link_or_a_docstring_that_cannot_be_read(built):
    assert built[1] == ""


@pytest.mark.slow
def test_every_module_has_a_page(site):
    parts = [path.relative_to(ROOT).with_suffix("").parts for path in PACKAGE.rglob("*.py")]
    names = {".".join(part for part in each if part != "__init__") for each in parts}
    pages = {path.stem for path in (site / "api").glob("*.html")}
    assert pages == names - {"vidsindy_lite.__main__"}
    assert "vidsindy_lite.dynamics.solver" in pages


@pytest.mark.slow
@needs_browser
def test_pages_lead_to_each_other_and_words_to_pages(site, browser):
    browser.open(site / "notebooks" / "03_camera_learning.html")
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


@pytest.mark.slow
@needs_browser
def test_arrow_keys_go_from_slide_to_slide(site, browser):
    seen = browser.open(site / "docs" / "slides.html")
    assert min(seen["images"], seen["formulas"]) > 10
    at = """[...document.querySelectorAll(".content section section")].findLastIndex(
        slide => slide.getBoundingClientRect().top < 2)"""
    for key, expected in (("ArrowRight", 0), ("ArrowRight", 1), ("ArrowLeft", 0)):
        browser.command("Input.dispatchKeyEvent", type="rawKeyDown", key=key)
        answer = browser.command("Runtime.evaluate", expression=at, returnByValue=True)
        assert answer["result"]["value"] == expected


def links(browser, selector):
    """Addresses of the links of a page that fit a selector."""
    code = f"[...document.querySelectorAll({selector!r})].map(link => link.href)"
    answer = browser.command("Runtime.evaluate", expression=code, returnByValue=True)
    return answer["result"].get("value") or []


# ------------------------------------------------------------------------------- the gate can fail


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


@needs_browser
def test_a_good_page_passes(browser, tmp_path):
    (tmp_path / "page.html").write_text(GOOD.format("text"))
    assert page_problems(browser, tmp_path / "page.html", PHONE) == []


def test_a_dead_link_is_seen(tmp_path):
    (tmp_path / "a.html").write_text('<a href="a.html">a</a> <img src="b.png">')
    assert dead_links(tmp_path) == ["a.html: b.png"]


# -------------------------------------------------------------------------------------------- parts


@pytest.mark.parametrize("name", ["letter", "index.html", "MANIFEST"])
def test_a_folder_of_something_else_is_not_emptied(tmp_path, name):
    (tmp_path / name).write_text("dear")
    with pytest.raises(ValueError, match="output: must be a new folder or hold an earlier site"):
        build_site(tmp_path, ROOT)
    assert (tmp_path / name).read_text() == "dear"


def test_what_is_left_of_an_interrupted_site_may_be_replaced(tmp_path, monkeypatch):
    class Interrupted:
        def __init__(self, pages, settings, output, *_, **__):
            self.output = output

        def connect(self, *_, **__):
            pass

        def build(self):
            write_file(self.output / "half.html", b"")
            raise KeyboardInterrupt

    for folder in ("docs", "figures", "notebooks", "vidsindy_lite"):
        (tmp_path / "root" / folder).mkdir(parents=True)
    for name in ("README.md", "LICENSE", "CITATION.cff", "CHANGELOG.md"):
        (tmp_path / "root" / name).write_text("# One\n")
    (tmp_path / "root" / "docs" / "teaching.md").write_text("# No plan\n")
    monkeypatch.setattr("vidsindy_lite.companion.site.Sphinx", Interrupted)
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            build_site(tmp_path / "site", tmp_path / "root")


@pytest.mark.parametrize("name", ["vidsindy_lite", "notebooks", "figures", "figures/site"])
def test_what_is_shown_is_not_written_over(tmp_path, name):
    for folder in ("vidsindy_lite", "notebooks", "figures"):
        (tmp_path / folder).mkdir()
    with pytest.raises(ValueError, match="output: must not lie in what is shown"):
        build_site(tmp_path / name, tmp_path)


def test_only_what_was_signed_and_is_unchanged_is_removed(tmp_path):
    for name in ("a", "folder/b"):
        write_file(tmp_path / name, b"ours")
    sign(tmp_path)
    for name, content in (("folder/b", b"edited"), ("folder/c", b"theirs")):
        before = (tmp_path / name).read_bytes() if (tmp_path / name).exists() else None
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ValueError, match=f"an earlier site, .* with {name}"):
            clear(tmp_path, "site")
        assert (tmp_path / "a").exists()
        (tmp_path / name).unlink() if before is None else (tmp_path / name).write_bytes(before)
    clear(tmp_path, "site")
    assert not tmp_path.exists()
