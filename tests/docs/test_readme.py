"""The code of README and docs/ runs, and links lead somewhere."""

import re

import numpy as np
import pytest

from vidsindy_lite.__main__ import main
from vidsindy_lite.cameras import Rig
from vidsindy_lite.storage import PACKAGE

ROOT = PACKAGE.parent
PATHS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
PAGES = {path.stem: path.read_text("utf-8") for path in PATHS}
README, GUIDE = PAGES["README"], PAGES["guide"]
HALF = re.compile(r"^# (?=#+ )", re.MULTILINE)  # before a heading in the .py half of a notebook
ONE_SCREEN = 60  # lines
NUMBER = re.compile(r"\d+\.\d*")


def blocks(language, page=GUIDE):
    return re.findall(rf"^```{language}\n(.*?)^```", page, re.DOTALL | re.MULTILINE)


def test_the_readme_fits_one_screen():
    assert README.count("\n") <= ONE_SCREEN
    assert max(map(len, README.splitlines())) <= 120
    (code,) = blocks("python", README)
    assert len(code.split("\n\n", 1)[1].splitlines()) <= 10


def test_every_page_of_docs_can_be_reached_from_the_readme():
    assert set(re.findall(r"\]\(docs/(\w+)\.md\)", README)) == set(PAGES) - {"README"}


@pytest.mark.slow
@pytest.mark.usefixtures("tracked_once")
def test_the_code_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    phone, own_videos = blocks("python")
    smallest, test_videos = blocks("python", PAGES["data"])
    names = {}
    exec(phone, names)
    (typed,) = re.findall(r"^python -m vidsindy_lite (discover throw.*)$", GUIDE, re.MULTILINE)
    assert main(typed.split()) == 0
    assert re.search(r"`(g = [\d.]+ ± [\d.]+)`", GUIDE)[1] in capsys.readouterr().out
    exec(smallest, names)
    said = capsys.readouterr().out
    exec(test_videos, names)  # which writes the files that the last reads
    exec(own_videos, names)
    assert "all true terms found, 0 false" in capsys.readouterr().out
    printed = re.search(r"^dx/dt.*?(?=^```)", PAGES["data"], re.DOTALL | re.MULTILINE)[0]
    assert NUMBER.sub("", said) == NUMBER.sub("", printed)
    values = [[float(number) for number in NUMBER.findall(text)] for text in (said, printed)]
    np.testing.assert_allclose(*values, rtol=0.2, atol=0.01)


@pytest.mark.slow
def test_the_code_of_the_readme_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (code,) = blocks("python", README)
    exec(code, {})
    assert "all true terms found, 0 false" in capsys.readouterr().out


def test_the_rig_file_is_one(tmp_path):
    text = "\n".join(blocks("toml", PAGES["rigs"]))  # the second one adds a camera
    (tmp_path / "rig.toml").write_text(text)
    rig = Rig.load(tmp_path / "rig.toml")
    assert [camera.is_calibrated for camera in rig.cameras] == [True, False, False, True]


def heading_anchor(text):
    """The anchor of a heading, as code hosts make it: lower case, hyphens, no punctuation."""
    return re.sub(r"[^\w\- ]", "", re.sub(r"<[^>]*>", "", text)).strip().lower().replace(" ", "-")


def dead_links(page):
    """Relative links of a Markdown page that lead to no file, or to no heading of a page."""
    text = re.sub(r"^```.*?^```", "", page.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)
    dead = []
    for url in re.findall(r"\]\(([^)\s]+)\)", text):
        path, _, anchor = url.partition("#")
        target = page.parent / path if path else page
        if ":" not in url and not target.exists():
            dead.append(url)
        elif ":" not in url and anchor and target.suffix in (".md", ".ipynb"):
            target = target.with_suffix(".py") if target.suffix == ".ipynb" else target
            headings = re.findall(r"^#+ (.*)", HALF.sub("", target.read_text("utf-8")), re.M)
            if anchor not in map(heading_anchor, headings):
                dead.append(url)
    return dead


@pytest.mark.parametrize(
    "page",
    [*PATHS, ROOT / "figures" / "README.md", *(ROOT / "notebooks").glob("*.py")],
    ids=lambda page: f"{page.parent.name}/{page.name}",
)
def test_links_lead_somewhere(page):
    assert dead_links(page) == []


def test_a_dead_link_is_seen(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# One\n[a](page.md#one) [b](page.md#two) [c](none.md) [d](https://x.org)")
    assert dead_links(page) == ["page.md#two", "none.md"]
    (tmp_path / "book.ipynb").touch()
    (tmp_path / "book.py").write_text("# # A book\n# ## One\n# no # heading\n")
    page.write_text("[a](book.ipynb#one) [b](book.ipynb#a-book) [c](book.ipynb#heading)")
    assert dead_links(page) == ["book.ipynb#heading"]
