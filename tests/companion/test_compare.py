"""Two folders of figures, and two runs of a notebook, are compared; what differs is refreshed."""

import io
import json

import nbformat
import numpy as np
import pytest
from PIL import Image

from vidsindy_lite.__main__ import main
from vidsindy_lite.companion import compare
from vidsindy_lite.companion.compare import differences, same_notebook, same_text, write_differences

COMMON = {"notebook": "01_first", "caption": "A."}
RECORD = COMMON | {"id": "table_1", "kind": "table"}
RECORD["rows"] = [{"name": "x", "l2": 1.0, "seconds": 2.0}]
FIGURE = COMMON | {"id": "fig_1", "kind": "figure"}
FIGURE["numbers"] = {"error": [1e-9, 5.0, None], "n": 3}


def png(pixels):
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


LINE = np.full((64, 96, 3), 255, np.uint8)
LINE[30:33] = (0, 114, 178)


@pytest.fixture
def folders(tmp_path):
    """Two folders that hold the same."""
    for side in ("committed", "regenerated"):
        write(tmp_path / side, RECORD)
        write(tmp_path / side, FIGURE)
        (tmp_path / side / "fig_1.png").write_bytes(png(LINE))
    return tmp_path / "committed", tmp_path / "regenerated"


def write(folder, record):
    folder.mkdir(exist_ok=True)
    (folder / f"{record['id']}.json").write_text(json.dumps(record))


def rows(**changes):
    return RECORD | {"rows": [RECORD["rows"][0] | changes]}


RECORDS = [
    (RECORD, None),
    (rows(l2=1.0005, seconds=9.0), None),
    (FIGURE | {"numbers": {"error": [1e-4, 5.0, None], "n": 3}}, None),  # nearly zero beside 5
    (rows(l2=1.01), "row 0 (x), column l2: 1.0 committed, 1.01 regenerated"),
    (rows(name="y"), "row 0 (x), column name: 'x' committed"),
    (RECORD | {"rows": []}, "1 rows committed, 0 regenerated"),
    (FIGURE | {"numbers": {"error": [1e-9, 5.0, 0.0], "n": 3}}, "error[2]: None committed"),
    (FIGURE | {"numbers": {"error": [1e-9, 5.1, None], "n": 3}}, "error[1]: 5.0 committed"),
    (FIGURE | {"numbers": {"error": [1e-9, 5.0, None]}}, "committed"),
    (FIGURE | {"numbers": {"error": [1e-3, 5.0, None], "n": 3}}, "error[0]: 1e-09 committed"),
    (FIGURE | {"numbers": {"error": [1e-9, 5.0, None], "n": 4}}, "n: 3 committed, 4"),
]


@pytest.mark.parametrize(("record", "place"), RECORDS)
def test_what_counts_and_what_does_not(folders, record, place):
    write(folders[1], record)
    found, before, names = differences(*folders), files(folders[0]), [record["id"]] * bool(place)
    assert list(found) == names
    assert not place or place in found[record["id"]]
    assert refresh(*folders, "01_first") == names
    assert files(folders[0]) == (files(folders[1]) if place else before)


@pytest.mark.parametrize(
    ("tolerance", "same"), [(0.2, True), ({"l2": 0.2}, True), ({"name": 0.2}, False), (0.05, False)]
)
def test_a_record_may_state_a_tolerance(folders, tolerance, same):
    write(folders[0], RECORD | {"tolerance": tolerance})
    write(folders[1], rows(l2=1.1))
    assert list(differences(*folders)) == ([] if same else ["table_1"])


@pytest.mark.parametrize("content", [None, "{", "null", "[" * 100_000, '{"id": "fig_1"}'])
def test_what_is_on_one_side_only(folders, content):
    record = folders[0] / "fig_1.json"
    record.unlink() if content is None else record.write_text(content)  # a damaged one is none
    (folders[1] / "table_1.json").unlink()
    assert differences(*folders) == {"fig_1": "only regenerated", "table_1": "only committed"}


def refresh(committed, regenerated, notebook):
    """Put what is outdated in place, and say what it was."""
    names = compare.outdated(committed, regenerated, notebook)
    compare.replace(committed, regenerated, names)
    return names


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def shifted(pixels, share):
    """A picture moved down by a part of a pixel."""
    moved = (1 - share) * pixels + share * np.roll(pixels, 1, axis=0)
    return np.rint(moved).astype(np.uint8)


@pytest.mark.parametrize(
    ("pixels", "same"),
    [
        (shifted(LINE, 0.1), True),
        (np.roll(LINE, 2, axis=0), True),
        (np.roll(LINE, 9, axis=0), False),
        (np.where(LINE == (0, 114, 178), (213, 94, 0), LINE).astype(np.uint8), False),
        (LINE[:-1], False),
        (np.where(np.indices(LINE.shape)[:2].max(axis=0) < 4, 200, LINE).astype(np.uint8), False),
    ],
)
def test_a_picture_is_refreshed_where_one_sees_it(folders, pixels, same):
    (folders[1] / "fig_1.png").write_bytes(png(pixels))
    assert refresh(*folders, "01_first") == ([] if same else ["fig_1"])
    expected = LINE if same else pixels
    assert (folders[0] / "fig_1.png").read_bytes() == png(expected)


def test_what_a_notebook_makes_no_longer_goes_and_others_things_stay(folders):
    write(folders[0], RECORD | {"id": "other", "notebook": "02_second"})
    (folders[1] / "fig_1.json").unlink()
    assert refresh(*folders, "01_first") == ["fig_1"]
    assert set(files(folders[0])) == {"table_1.json", "other.json"}
    write(folders[1], FIGURE)
    write(folders[1], rows(l2=2.0))
    write(folders[0], FIGURE | {"notebook": "02_second"})
    before = files(folders[0])
    with pytest.raises(ValueError, match="fig_1: belongs to notebook 02_second"):
        refresh(*folders, "01_first")
    assert files(folders[0]) == before


def notebook(source="print(x)", said="x = 1.0\n", shown="<b>", count=1):
    outputs = [
        nbformat.v4.new_output("stream", text=said),
        nbformat.v4.new_output("display_data", data={"text/plain": shown}),
    ]
    cell = nbformat.v4.new_code_cell(source, outputs=outputs[:count] + outputs[1:])
    return nbformat.v4.new_notebook(cells=[cell])


@pytest.mark.parametrize(
    ("other", "same"),
    [
        ({}, True), ({"said": "x = 1.0005\n"}, True),
        ({"said": "x = 1.1\n"}, True),  # one in the last digit
        ({"said": "x = 1.2\n"}, False), ({"said": "y = 1.0\n"}, False),
        ({"shown": "<i>"}, False), ({"source": "print( x)"}, False), ({"count": 0}, False),
    ],
)  # fmt: skip
def test_notebooks_are_compared_by_what_they_say(other, same):
    assert same_notebook(notebook(), notebook(**other)) == same
    assert not same_notebook(notebook(), nbformat.v4.new_notebook())


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("2.500 ± 0.100", "2.550 ± 0.110", True),
        ("2.500 ± 0.100", "2.500 ± 0.150", False),
        ("9.9999981 ± 0.0000083", "9.9912345 ± 0.0000083", False),
        ("2.50 +- 1.0e-1", "2.55 +- 1.1e-1", True),
        ("2.50 ± 0.10", "2.50 0.10", False),
        ("34 of 35", "35 of 35", False), ("1e-15", "3e-15", False), ("5000.1", "5002.1", True),
        ("- 10 x", "- 10.1 x", False), ("- 10 x", "- 9.999 x", True), ("0.8 z", "0.9 z", False),
        ("0.99 y", "1.00 y", False), ("x   9.9996", "x 10.0000", True),
        ("dx/dt = 2.0 x", "dx/dt = 2.0 y", False),
    ],
)  # fmt: skip
def test_texts_are_compared_by_words_and_numbers(one, other, same):
    assert same_text(one, other) == same_text(other, one) == same


def test_what_a_cell_saves_is_compared_where_it_is_saved():
    saves = [notebook("save_table('a', rows)", shown=f"took {n} s") for n in (1, 2)]
    assert same_notebook(*saves)
    assert not same_notebook(saves[0], notebook("save_table('a', rows)", said="x = 2.0\n"))
    others = [notebook("save_video('a', rows)", shown=f"took {n} s") for n in (1, 2)]
    assert not same_notebook(*others)
    printed = [notebook("print(versions())", said=f"Python 3.11.{n}\n") for n in (7, 9)]
    assert same_notebook(*printed)


def test_differences_are_shown_side_by_side_and_their_page_alone_is_replaced(folders, tmp_path):
    output = tmp_path / "page.html"
    write(folders[1], FIGURE | {"numbers": {"error": [0.0, 6.0, None], "n": 3}})
    write(folders[1], rows(name="<b>"))
    assert list(write_differences(*folders, output)) == ["fig_1", "table_1"]
    page = output.read_text()
    assert page.count("data:image/png;base64,") == 2
    assert "<b>" not in page
    write(folders[1], FIGURE)
    write_differences(*folders, output)
    assert "data:image" not in output.read_text()
    output.write_text("mine")
    for place in (output, tmp_path):
        with pytest.raises(ValueError, match="output: must be a new file or an earlier page of"):
            write_differences(*folders, place)
    assert output.read_text() == "mine"


def test_the_command_fails_on_a_difference_and_on_nothing(folders, tmp_path, capsys):
    page = str(tmp_path / "out.html")
    assert main(["compare", *map(str, folders), "--output", page]) == 0
    write(folders[1], RECORD | {"rows": []})
    assert main(["compare", *map(str, folders), "--output", page]) == 1
    assert "table_1: " in capsys.readouterr().out
    nowhere = tmp_path / "nowhere"
    assert main(["compare", str(nowhere), str(folders[1]), "--output", page]) == 2
    assert f"error: committed: must be a folder, got '{nowhere}'" in capsys.readouterr().err
    nowhere.mkdir()
    assert main(["compare", str(folders[0]), str(nowhere), "--output", page]) == 2
    assert "error: regenerated: must hold figures or tables" in capsys.readouterr().err
