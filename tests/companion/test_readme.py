"""The code of README and docs/ runs, generated parts are current, links lead somewhere."""

import json
import re
import shutil

import numpy as np
import pytest
from vidsindy_lite.companion.readme import HEADLINES, PARTS, fill, reading_minutes, written_pages

from vidsindy_lite.cameras import Rig
from vidsindy_lite.repository import PACKAGE

ROOT = PACKAGE.parent
PAGES = {path.stem: path.read_text("utf-8") for path in written_pages(ROOT)}
README, GUIDE, RESULTS = PAGES["README"], PAGES["guide"], PAGES["results"]
HALF = re.compile(r"^# (?=#+ )", re.MULTILINE)  # before a heading in the .py half of a notebook
ONE_SCREEN = 60  # lines
NUMBER = re.compile(r"\d+\.\d*")


def blocks(language, page=GUIDE):
    return re.findall(rf"^```{language}\n(.*?)^```", page, re.DOTALL | re.MULTILINE)


def test_minutes_to_read_are_those_of_words_and_lines(tmp_path):
    notebook = tmp_path / "a.py"
    notebook.write_text(f"# %% [markdown]\n# {'word ' * 800}\n\n# %%\n" + "x = 1\n" * 60)
    assert reading_minutes(notebook) == 10  # 4 for the words, 5 for the lines
    notebook.write_text("# %% [markdown]\n# word\n")
    assert reading_minutes(notebook) == 5


def test_the_readme_fits_one_screen():
    assert README.count("\n") <= ONE_SCREEN
    assert max(map(len, README.splitlines())) <= 120
    (code,) = blocks("python", README)
    assert len(code.split("\n\n", 1)[1].splitlines()) <= 10


def test_every_page_of_docs_can_be_reached_from_the_readme():
    linked = set(re.findall(r"\]\(docs/(\w+)\.md\)", README))
    assert linked == set(PAGES) - {"README"}


@pytest.mark.slow
@pytest.mark.usefixtures("tracked_once")
def test_the_code_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    smallest, own_videos, test_videos = blocks("python")
    names = {}
    exec(smallest, names)
    said = capsys.readouterr().out
    exec(test_videos, names)  # which writes the files that the last reads
    exec(own_videos, names)
    assert "all true terms found, 0 false" in capsys.readouterr().out
    printed = re.search(r"^dx/dt.*?(?=^```)", GUIDE, re.DOTALL | re.MULTILINE)[0]
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
    text = "\n".join(blocks("toml"))  # the second one adds a camera
    (tmp_path / "rig.toml").write_text(text)
    rig = Rig.load(tmp_path / "rig.toml")
    assert [camera.is_calibrated for camera in rig.cameras] == [True, False, False, True]


def test_a_line_that_does_not_run_is_seen():
    code = blocks("python")[0].replace("vl.discover(", "vl.find(")
    with pytest.raises(AttributeError, match="find"):
        exec(code, {})


# ---------------------------------------------------------------------------------- generated parts


@pytest.mark.parametrize("name", PAGES)
def test_generated_parts_are_those_of_the_figures(name):
    assert fill(PAGES[name], ROOT) == PAGES[name]


def test_every_part_is_shown_once():
    shown = "\n".join(PAGES.values())
    assert [shown.count(f"\n<!-- {name} -->\n") for name in PARTS] == [1] * len(PARTS)


@pytest.mark.parametrize(("old", "new"), [("35 of 35", "34 of 35"), ("| 0.77 |", "| 0.07 |")])
def test_an_edited_result_is_seen(old, new):
    assert old in RESULTS
    assert fill(RESULTS.replace(old, new, 1), ROOT) != RESULTS.replace(old, new, 1)


def test_every_notebook_has_one_headline():
    sources = {path.stem: path.read_text("utf-8") for path in (ROOT / "notebooks").glob("*.py")}
    saved = [[name for name in HEADLINES if f'"{name}"' in text] for text in sources.values()]
    assert [len(names) for names in saved] == [1] * len(sources)


@pytest.mark.parametrize(
    ("name", "rows", "headline"),
    [
        (
            "tour_score",
            [{"true terms": 12, "missing": 1, "false": 2, "l2": "below 1e-3"}],
            "11 of 12 terms, 2 false, l2 below 1e-3",
        ),
        (
            "projection_shift",
            [{"shift of the image": shift} for shift in ("below 1e-12", "31.4")],
            "shift of the image by the plane's D: below 1e-12; with the text's rotation: 31.4",
        ),
    ],
)
def test_a_headline_says_what_its_table_holds(tmp_path, name, rows, headline):
    figures = tmp_path / "figures"
    figures.mkdir()
    (tmp_path / "notebooks").mkdir()
    (tmp_path / "notebooks" / "00_one.py").write_text("# # One\n")
    record = {"id": name, "kind": "table", "caption": "A table.", "notebook": "00_one"}
    record |= {"stamp": None, "files": []}
    (figures / f"{name}.json").write_text(json.dumps({**record, "rows": rows}))
    text = fill("<!-- notebooks -->\n<!-- end -->", tmp_path)
    assert f"| One | {headline} |" in text


def test_another_result_is_seen(tmp_path):
    shutil.copytree(ROOT / "figures", tmp_path / "figures")
    shutil.copytree(ROOT / "notebooks", tmp_path / "notebooks")
    assert fill(RESULTS, tmp_path) == RESULTS
    table = tmp_path / "figures" / "table_1.json"
    table.write_text(table.read_text().replace('"paper: l2 (e-2)": 1.5', '"paper: l2 (e-2)": 1.6'))
    assert fill(RESULTS, tmp_path) != RESULTS


def test_an_unknown_part_is_named():
    with pytest.raises(ValueError, match="text: a part must be one of .*, got 'table_9'"):
        fill("<!-- table_9 -->\n<!-- end -->", ROOT)


# -------------------------------------------------------------------------------------------- links


def heading_anchor(text):
    """The anchor of a heading, as code hosts make it: lower case, hyphens, no punctuation."""
    return re.sub(r"[^\w\- ]", "", re.sub(r"<[^>]*>", "", text)).strip().lower().replace(" ", "-")


def test_anchors_are_those_of_a_code_host():
    assert heading_anchor("Figure_S1: what it <em>shows</em>") == "figure_s1-what-it-shows"


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
    [*written_pages(ROOT), ROOT / "figures" / "README.md", *(ROOT / "notebooks").glob("*.py")],
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
