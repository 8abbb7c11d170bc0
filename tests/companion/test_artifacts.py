"""Figures, tables and their registry: round trips, the same bytes twice, and a check that fails."""

import base64
import io
import json
import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image

from vidsindy_lite.companion import registry
from vidsindy_lite.companion.artifacts import (
    load_table,
    save_animation,
    save_figure,
    save_slider,
    save_table,
)
from vidsindy_lite.companion.records import RUN_TIMES
from vidsindy_lite.companion.registry import check_folder, load_run_times

ROWS = [
    {"system": "Lorenz", "terms": 12, "l2": 0.00123456789, "exact": True, "seconds": 2.345},
    {"system": "SprottE", "terms": 8, "l2": float("nan"), "exact": False, "seconds": 0.5},
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder of figures, as a run of notebook 01_first sees it."""
    folder = tmp_path / "figures"
    monkeypatch.setenv("VIDSINDY_FIGURES", str(folder))
    monkeypatch.setenv("VIDSINDY_NOTEBOOK", "01_first")
    monkeypatch.setenv("VIDSINDY_STAMP", "stamp-1")
    return folder


@pytest.fixture
def figure():
    """A figure with a line, text and a clipped marker: all that gets an id in an SVG."""
    with plt.style.context("vidsindy_lite.study.plots.vidsindy"):
        figure, axes = plt.subplots()
        axes.plot([0, 1, 2], [0, 1, 4], "o-", label="square")
        axes.legend()
    yield figure
    plt.close(figure)


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


# ---------------------------------------------------------------------------------- figures, tables


def test_figure_and_numbers_are_written_and_registered(folder, figure):
    numbers = {"x": np.arange(3), "y": np.array([1 / 3, np.nan, np.inf]), "n": np.int64(3)}
    save_figure("fig_2", figure, caption="A  square\nin words.", numbers=numbers)
    assert set(contents(folder)) == {"fig_2.png", "fig_2.svg", "fig_2.json"}
    record = json.loads((folder / "fig_2.json").read_text())
    assert record["numbers"] == {"x": [0, 1, 2], "y": [0.333333, None, None], "n": 3}
    assert record["caption"] == "A square in words."
    assert (record["notebook"], record["stamp"]) == ("01_first", "stamp-1")
    assert plt.fignum_exists(figure.number)


def test_figure_is_the_same_bytes_twice(folder, figure):
    save_figure("fig_2", figure, caption="A square.", numbers={"x": [1]})
    first = contents(folder)
    save_figure("fig_2", figure, caption="A square.", numbers={"x": [1]})
    assert contents(folder) == first
    assert b"Matplotlib" not in first["fig_2.png"]
    assert b"dc:date" not in first["fig_2.svg"]


def test_a_figure_with_pixels_or_very_many_points_has_no_svg(folder, figure):
    save_figure("fig_2", figure, caption="A square.", numbers={})
    assert (folder / "fig_2.svg").exists()
    figure.axes[0].imshow(np.eye(3), extent=(0, 1, 0, 1))
    save_figure("fig_2", figure, caption="A square.", numbers={})
    assert set(contents(folder)) == {"fig_2.png", "fig_2.json"}
    registry.write_index(folder)
    assert check_folder(folder) == []
    assert "SVG" not in (folder / "README.md").read_text()
    figure.axes[0].images[0].remove()
    rng = np.random.default_rng(0)
    figure.axes[0].plot(*rng.normal(size=(2, 20_000)), ".")
    save_figure("fig_2", figure, caption="A square.", numbers={})
    assert not (folder / "fig_2.svg").exists()
    with Image.open(folder / "fig_2.png") as image:
        assert image.mode == "P"


def test_animation_is_written_registered_and_the_same_bytes_twice(folder):
    stripes = np.broadcast_to(np.arange(0, 240, 8, np.uint8)[:, None], (20, 30, 3))
    pictures = [np.roll(stripes, step, axis=1) for step in range(3)]
    save_animation("tour", pictures, caption="Stripes.", numbers={"step": [0, 1, 2]})
    first = contents(folder)
    assert set(first) == {"tour.gif", "tour.json"}
    with Image.open(folder / "tour.gif") as image:
        assert (image.n_frames, image.size) == (3, (30, 20))
    save_animation("tour", pictures, caption="Stripes.", numbers={"step": [0, 1, 2]})
    assert contents(folder) == first
    registry.write_index(folder)
    assert "![tour](tour.gif)\n\nStripes." in (folder / "README.md").read_text()
    assert check_folder(folder, {"01_first": "stamp-1"}) == []


def test_a_small_thing_keeps_its_colour_in_an_animation(folder):
    rng = np.random.default_rng(0)
    sky = rng.integers((90, 130, 170), (140, 180, 255), (100, 150, 3)).astype(np.uint8)
    pictures = []
    for step in range(20):
        pictures.append(sky.copy())
        pictures[-1][50:53, 5 * step : 5 * step + 3] = (255, 120, 0)
    pictures.append(np.full_like(sky, 255))  # without it
    save_animation("tour", pictures, caption="A target.", numbers={})
    with Image.open(folder / "tour.gif") as image:
        for step in range(20):
            image.seek(step)
            shown = np.asarray(image.convert("RGB"))[51, 5 * step + 1]
            assert np.abs(shown - [255.0, 120, 0]).max() < 30


def test_slider_registers_the_first_frame_and_shows_all_in_one_picture(folder):
    def saved():
        figures = {}
        for level in ("0 px", "<1 px>", "it's 2"):
            figures[level], axes = plt.subplots(figsize=(2, 1))
            axes.plot([0, len(figures)])
        shown = save_slider("noise", figures, caption='A "noisy" line.', numbers={"n": [0, 1, 2]})
        assert not any(plt.fignum_exists(figure.number) for figure in figures.values())
        return shown.data

    html = saved()
    first = contents(folder)
    assert set(first) == {"noise.png", "noise.svg", "noise.json"}
    (strip,) = re.findall(
        r'<img alt="A &#34;noisy&#34; line." src="data:image/png;base64,(.*?)"', html
    )
    with Image.open(io.BytesIO(base64.b64decode(strip))) as image:
        assert image.size == (200, 300)
    assert (html.count('type="range"'), html.count('max="2"'), html.count("http")) == (1, 1, 0)
    assert saved() == html
    assert contents(folder) == first


def test_a_slider_without_figures_is_named(folder):
    with pytest.raises(ValueError, match=r"figures: slider 'noise' needs at least one figure"):
        save_slider("noise", {}, caption="Nothing.", numbers={})


def test_table_round_trip(folder):
    saved = save_table("table_1", ROWS, caption="Two systems.")
    assert load_table("table_1", folder) == saved
    assert saved.rows[0] == {**ROWS[0], "l2": 0.00123457, "seconds": 2.3}
    assert saved.rows[1]["l2"] is None
    assert (folder / "table_1.csv").read_text() == (
        "system,terms,l2,exact,seconds\nLorenz,12,0.00123457,True,2.3\nSprottE,8,,False,0.5\n"
    )


def test_table_shows_itself(folder):
    table = save_table("table_1", [{"name": "a|b<c", "value": 1 / 3}], caption="Awkward.")
    assert table.markdown() == "| name | value |\n| --- | ---: |\n| a\\|b<c | 0.3333 |\n"
    assert "a|b&lt;c" in table._repr_html_()
    assert str(table).splitlines() == ["name    value", "-" * 13, "a|b<c  0.3333"]


def test_load_table_lists_those_there_are(folder):
    save_table("table_1", ROWS, caption="Two systems.")
    with pytest.raises(FileNotFoundError, match=r"table_id: .*table_1.* got 'table_2'"):
        load_table("table_2", folder)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"table_id": "a/b"}, "table_id: .* got 'a/b'"),
        ({"table_id": "README"}, "table_id: .* got 'README'"),
        ({"caption": " "}, "caption: .* empty"),
        ({"rows": []}, "rows: .* got none"),
        ({"rows": [{"a": 1}, {"b": 1}]}, r"rows: .*\['a'\], got \['b'\] in row 1"),
        ({"rows": [{"a": [1, 2]}]}, r"rows: .* got \[1, 2\] in row 0, column 'a'"),
    ],
)
def test_bad_table(folder, changes, message):
    arguments = {"table_id": "table_1", "rows": ROWS, "caption": "A caption."} | changes
    with pytest.raises(ValueError, match=message):
        save_table(arguments.pop("table_id"), arguments.pop("rows"), **arguments)
    assert not folder.exists()


def test_numbers_of_an_unknown_kind(folder, figure):
    with pytest.raises(TypeError, match=r"numbers\['x'\]: .* got <object"):
        save_figure("fig_2", figure, caption="A square.", numbers={"x": object()})
    assert not folder.exists()


def test_two_notebooks_cannot_write_one_id(folder, monkeypatch):
    save_table("table_1", ROWS, caption="Two systems.")
    monkeypatch.setenv("VIDSINDY_NOTEBOOK", "02_second")
    with pytest.raises(ValueError, match="'table_1' belongs to notebook 01_first"):
        save_table("table_1", ROWS, caption="Two systems.")


def test_without_a_run_results_go_to_a_folder_of_their_own(tiny, monkeypatch, capsys):
    for name in ("VIDSINDY_FIGURES", "VIDSINDY_NOTEBOOK", "VIDSINDY_STAMP"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tiny.notebooks)
    for _ in range(2):
        save_table("table_1", ROWS, caption="Two systems.")
    own = tiny.root / "build" / "interactive" / "figures"
    assert load_table("table_1", own).notebook == "interactive"
    assert not (tiny.root / "figures").exists()
    assert capsys.readouterr().out.count(str(own)) == 1


# ------------------------------------------------------------------------------------- wall times


def test_wall_times_are_those_of_the_first_run_of_the_code(folder, monkeypatch):
    save_table("table_1", ROWS, caption="Two systems.")
    slower = [{**row, "seconds": 9.9} for row in ROWS]
    assert save_table("table_1", slower, caption="Two systems.").rows[0]["seconds"] == 2.3
    better = [{**slower[0], "l2": 0.5}, slower[1]]  # another result: its own time
    seconds = [row["seconds"] for row in save_table("table_1", better, caption="Two.").rows]
    assert seconds == [9.9, 0.5]
    monkeypatch.setenv("VIDSINDY_STAMP", "stamp-2")
    assert save_table("table_1", slower, caption="Two systems.").rows[1]["seconds"] == 9.9


def test_run_time_is_that_of_the_first_run_of_the_code(folder):
    registry.record_run_time(folder, "01_first", "stamp-1", 123.4)
    registry.record_run_time(folder, "01_first", "stamp-1", 9.0)
    times = folder / RUN_TIMES
    assert json.loads(times.read_text()) == {"01_first": {"seconds": 120, "stamp": "stamp-1"}}
    assert load_run_times(folder) == {"01_first": 120}
    registry.record_run_time(folder, "01_first", "stamp-2", 9.0)
    assert json.loads(times.read_text())["01_first"]["seconds"] == 9


# -------------------------------------------------------------------------- the folder as a whole


@pytest.fixture
def complete(folder, figure):
    """A folder with two tables, a figure, run times and the index."""
    save_table("table_S10", ROWS, caption="Ten.")
    save_table("table_S2", ROWS, caption="Two.")
    save_figure("fig_2", figure, caption="A square.", numbers={})
    registry.record_run_time(folder, "01_first", "stamp-1", 12.3)
    registry.write_index(folder)
    return folder


def test_index_shows_everything_in_order_and_is_the_same_bytes_twice(complete):
    page = (complete / "README.md").read_text()
    places = [page.index(f"### {name}\n") for name in ("fig_2", "table_S2", "table_S10")]
    assert places == sorted(places)
    assert "![fig_2](fig_2.png)\n\nA square." in page
    assert "| [01_first](../notebooks/01_first.ipynb) | about 12 s | [fig_2](#fig_2)" in page
    assert "| Lorenz | 12 | 0.001235 | yes | 2.3 |" in page
    before = contents(complete)
    registry.write_index(complete)
    assert contents(complete) == before


def test_a_complete_folder_passes(complete):
    assert check_folder(complete) == []
    assert check_folder(complete, {"01_first": "stamp-1"}) == []
    assert check_folder(complete, {"01_first": None}) == []


def test_check_reports_what_is_missing_and_what_is_stray(complete):
    (complete / "fig_2.svg").unlink()
    (complete / "README.md").unlink()
    (complete / "table_S2.json").unlink()
    (complete / "old.png").write_bytes(b"")
    assert check_folder(complete) == [
        "README.md: registered, but missing",
        "fig_2.svg: registered, but missing",
        "old.png: nothing registers it",
        "table_S2.csv: nothing registers it",
        "table_S2.md: nothing registers it",
    ]


@pytest.mark.parametrize(
    ("stamps", "problem"),
    [
        ({}, "fig_2: no notebook '01_first' to make it"),
        ({"01_first": "stamp-2"}, "fig_2: 01_first has changed since it was made"),
    ],
)
def test_prune_removes_what_the_check_reports(complete, stamps, problem):
    assert problem in check_folder(complete, stamps)
    registry.prune(complete, stamps)
    registry.write_index(complete)
    assert check_folder(complete, stamps) == []
    assert not list(complete.glob("*.png"))


def test_prune_keeps_what_is_current(complete):
    before = contents(complete)
    registry.prune(complete, {"01_first": "stamp-1", "02_second": None})
    assert contents(complete) == before


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("fig_2.png", b" " * 600_001, "fig_2.png: 600001 bytes, at most 600000"),
        ("fig_2.svg", b"<svg><image/></svg>", "fig_2.svg: holds a picture of pixels"),
    ],
)
def test_check_reports_what_would_swell_the_history(complete, name, content, problem):
    (complete / name).write_bytes(content)
    assert check_folder(complete) == [problem]


def test_check_reports_a_folder_that_is_too_large(complete, monkeypatch):
    total = sum(len(content) for content in contents(complete).values())
    monkeypatch.setattr(registry, "LARGEST_FOLDER", total)
    assert check_folder(complete) == []
    monkeypatch.setattr(registry, "LARGEST_FOLDER", total - 1)
    assert check_folder(complete) == [f"all files: {total} bytes, at most {total - 1}"]


@pytest.mark.parametrize("content", ["", "{", "[1]", '{"id": 3}'])
def test_a_damaged_record_is_a_stray_file(complete, content):
    (complete / "fig_2.json").write_text(content)
    assert [line.partition(":")[2] for line in check_folder(complete)] == [
        " nothing registers it"
    ] * 3
