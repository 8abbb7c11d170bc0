"""Figures, tables and their folder: round trips, the same bytes twice, and a check that fails."""

import base64
import io
import json
import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image

from vidsindy_lite.companion import artifacts
from vidsindy_lite.companion.artifacts import read_records, save_figure, save_slider, save_table

ROWS = [
    {"system": "Lorenz", "terms": 12, "l2": 0.00123456789, "exact": True, "seconds": 2.345},
    {"system": "SprottE", "terms": 8, "l2": float("nan"), "exact": False, "seconds": 0.5},
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder of figures, as a run of notebook 01_first sees it."""
    monkeypatch.setenv("VIDSINDY_FIGURES", str(tmp_path / "figures"))
    monkeypatch.setenv("VIDSINDY_NOTEBOOK", "01_first")
    return tmp_path / "figures"


@pytest.fixture
def figure():
    with plt.style.context("vidsindy_lite.study.plots.vidsindy"):
        figure, axes = plt.subplots()
        axes.plot([0, 1, 2], [0, 1, 4], "o-", label="square")
        axes.legend()
    yield figure
    plt.close(figure)


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_figure_and_numbers_are_written_the_same_twice(folder, figure):
    numbers = {"x": np.arange(3), "y": np.array([1 / 3, np.nan, np.inf]), "n": np.int64(3)}
    for _ in range(2):
        options = {"caption": "A  square\nin words.", "tolerance": {"y": 0.1}}
        save_figure("fig_2", figure, numbers=numbers, **options)
        assert set(contents(folder)) == {"fig_2.png", "fig_2.json"}
        record = json.loads((folder / "fig_2.json").read_text())
        assert record.pop("numbers") == {"x": [0, 1, 2], "y": [0.333333, None, None], "n": 3}
        assert record == {
            "id": "fig_2", "kind": "figure", "notebook": "01_first",
            "caption": "A square in words.", "tolerance": {"y": 0.1}, "words": ["square"],
        }  # fmt: skip
    assert plt.fignum_exists(figure.number)
    assert b"Matplotlib" not in contents(folder)["fig_2.png"]
    assert min(Image.open(folder / "fig_2.png").convert("RGB").getpixel((0, 0))) > 252  # white


def test_animation_is_the_same_bytes_twice(folder):
    stripes = np.broadcast_to(np.arange(0, 240, 8, np.uint8)[:, None], (20, 30, 3))
    pictures = [np.roll(stripes, step, axis=1) for step in range(3)]
    artifacts.save_animation("tour", pictures, caption="Stripes.", numbers={"step": [0, 1, 2]})
    first = contents(folder)
    assert set(first) == {"tour.gif", "tour.json"}
    with Image.open(folder / "tour.gif") as image:
        assert (image.n_frames, image.size) == (3, (30, 20))
    artifacts.save_animation("tour", pictures, caption="Stripes.", numbers={"step": [0, 1, 2]})
    assert contents(folder) == first
    artifacts.write_index(folder)
    assert "![tour](tour.gif)\n\nStripes." in (folder / "README.md").read_text()


def test_slider_saves_the_first_frame_and_shows_all_in_one_picture(folder):
    def saved():
        figures = {}
        for level in ("0 px", "<1 px>", "it's 2"):
            figures[level], axes = plt.subplots(figsize=(2, 1))
            axes.plot([0, len(figures)])
        shown = save_slider("noise", figures, caption='A "noisy" line.', numbers={"n": [0, 1, 2]})
        assert not any(plt.fignum_exists(figure.number) for figure in figures.values())
        return shown.data

    html, first = saved(), contents(folder)
    assert set(first) == {"noise.png", "noise.json"}
    strip = re.search(r'alt="A &#34;noisy&#34; line." src="data:image/png;base64,(.*?)"', html)[1]
    with Image.open(io.BytesIO(base64.b64decode(strip))) as image:
        assert image.size == (200, 300)
    assert (html.count('type="range"'), html.count('max="2"'), html.count("http")) == (1, 1, 0)
    assert saved() == html
    assert contents(folder) == first
    with pytest.raises(ValueError, match=r"figures: slider 'noise' needs at least one figure"):
        save_slider("noise", {}, caption="Nothing.", numbers={})


def test_table_shows_itself_and_is_read_again(folder):
    save_table("table_1", ROWS, caption="Two systems.", tolerance={"l2": 0.2})
    assert set(contents(folder)) == {"table_1.json"}
    rows = read_records(folder)["table_1"]["rows"]
    assert (rows[0], rows[1]["l2"]) == ({**ROWS[0], "l2": 0.00123457, "seconds": 2.3}, None)
    shown = save_table("a", [{"name": "a|b<c", "value": 1 / 3, "ok": True}], caption="Awkward.")
    assert shown.data.splitlines() == [
        r"| name   |   value |   ok |",
        r"|:-------|--------:|-----:|",
        r"| a\|b<c |  0.3333 |  yes |",
        "",
        "Awkward.",
    ]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"table_id": "a/b"}, "table_id: .* got 'a/b'"),
        ({"caption": " "}, "caption: .* empty"),
        ({"rows": []}, "rows: .* got no row"),
        ({"rows": [{"a": 1}, {"b": 1}]}, r"rows: .*\['a'\] and \['b'\]"),
        ({"tolerance": {"size": 1}}, r"tolerance: must name what is in .* \(exact, .* got size"),
    ],
)
def test_bad_table(folder, figure, changes, message):
    arguments = {"table_id": "table_1", "rows": ROWS, "caption": "A caption."} | changes
    with pytest.raises(ValueError, match=message):
        save_table(arguments.pop("table_id"), arguments.pop("rows"), **arguments)
    assert not folder.exists()
    with pytest.raises(TypeError, match=r"numbers\['x'\]: .* got <object"):
        save_figure("fig_2", figure, caption="A square.", numbers={"x": object()})
    assert list(folder.glob("*.json")) == []


def test_without_a_run_results_go_to_a_folder_of_their_own(tiny, monkeypatch, capsys):
    for name in ("VIDSINDY_FIGURES", "VIDSINDY_NOTEBOOK"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tiny.notebooks)
    for _ in range(2):
        save_table("table_1", ROWS, caption="Two systems.")
    own = tiny.root / "build" / "interactive" / "figures"
    assert read_records(own)["table_1"]["notebook"] == "interactive"
    assert not (tiny.root / "figures").exists()
    assert capsys.readouterr().out.count(str(own)) == 1


def test_index_shows_everything_in_order_and_is_the_same_bytes_twice(folder, figure):
    save_table("table_S10", ROWS, caption="Ten.")
    save_table("table_S2", ROWS, caption="Two.")
    save_figure("fig_2", figure, caption="A square.", numbers={})
    artifacts.write_index(folder)
    page = (folder / "README.md").read_text()
    places = [page.index(f"### {name}\n") for name in ("fig_2", "table_S2", "table_S10")]
    assert places == sorted(places)
    assert "![fig_2](fig_2.png)\n\nA square." in page
    assert "| [01_first](../notebooks/01_first.ipynb) | [fig_2](#fig_2)" in page
    assert re.search(r"\| Lorenz +\| +12 \| +0.001235 \| +yes \| +2.3 \|", page)
    before = contents(folder)
    artifacts.write_index(folder)
    assert contents(folder) == before
