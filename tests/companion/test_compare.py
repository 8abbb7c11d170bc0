"""Two folders of figures are compared by their numbers."""

import json

import pytest

from vidsindy_lite.__main__ import main
from vidsindy_lite.companion.compare import differences, side_by_side

RECORD = {"id": "table_1", "stamp": "a", "rows": [{"name": "x", "l2": 1.0, "seconds": 2.0}]}
FIGURE = {"id": "fig_1", "stamp": "a", "numbers": {"error": [1e-9, 5.0, None], "n": 3}}


@pytest.fixture
def folders(tmp_path):
    """Two folders that hold the same."""
    for side in ("committed", "regenerated"):
        write(tmp_path / side, RECORD)
        write(tmp_path / side, FIGURE)
        (tmp_path / side / "fig_1.png").write_bytes(b"image")
        (tmp_path / side / "run_times.json").write_text("{}")
    return tmp_path / "committed", tmp_path / "regenerated"


def write(folder, record):
    folder.mkdir(exist_ok=True)
    (folder / f"{record['id']}.json").write_text(json.dumps(record))


@pytest.mark.parametrize(
    "record",
    [
        RECORD,
        RECORD | {"stamp": "b"},
        RECORD | {"rows": [{"name": "x", "l2": 1.0005, "seconds": 9.0}]},
        FIGURE | {"numbers": {"error": [2e-9, 5.0, None], "n": 3}},  # rounding beside 5
    ],
)
def test_what_does_not_count(folders, record):
    write(folders[1], record)
    assert differences(*folders) == {}


@pytest.mark.parametrize(
    ("record", "place"),
    [
        (RECORD | {"rows": [{"name": "x", "l2": 1.01, "seconds": 2.0}]}, "[0] l2: 1.0 committed"),
        (RECORD | {"rows": [{"name": "y", "l2": 1.0, "seconds": 2.0}]}, "[0] name: 'x' committed"),
        (RECORD | {"rows": []}, "committed"),
        (FIGURE | {"numbers": {"error": [1e-9, 5.0, 0.0], "n": 3}}, "error[2]: None committed"),
        (FIGURE | {"numbers": {"error": [1e-9, 5.1, None], "n": 3}}, "error[1]: 5.0 committed"),
        (FIGURE | {"numbers": {"error": [1e-9, 5.0, None]}}, "committed"),
    ],
)
def test_what_counts(folders, record, place):
    write(folders[1], record)
    found = differences(*folders)
    assert list(found) == [record["id"]]
    assert place in found[record["id"]]


def test_what_is_on_one_side_only(folders):
    (folders[0] / "fig_1.json").unlink()
    (folders[1] / "table_1.json").unlink()
    assert differences(*folders) == {"fig_1": "only regenerated", "table_1": "only committed"}


def test_differences_are_laid_out_side_by_side(folders, tmp_path):
    write(folders[1], FIGURE | {"numbers": {"error": [0.0, 6.0, None], "n": 3}})
    assert list(side_by_side(*folders, tmp_path / "out")) == ["fig_1"]
    page = (tmp_path / "out" / "index.html").read_text()
    for side in ("committed", "regenerated"):
        assert f"{side}/fig_1.png" in page
        assert (tmp_path / "out" / side / "fig_1.png").exists()
    assert not (tmp_path / "out" / "committed" / "table_1.json").exists()


def test_the_first_difference_is_told_in_the_order_of_the_file(folders):
    keys = [f"number_{k}" for k in range(20)]
    write(folders[0], FIGURE | {"numbers": dict.fromkeys(keys, 1.0)})
    write(folders[1], FIGURE | {"numbers": dict.fromkeys(keys, 2.0)})
    assert differences(*folders) == {"fig_1": "number_0: 1.0 committed, 2.0 regenerated"}


def test_an_earlier_comparison_is_replaced(folders, tmp_path):
    output = tmp_path / "out"
    write(folders[1], FIGURE | {"numbers": {}})
    write(folders[1], RECORD | {"rows": [{"name": "<b>"}]})
    side_by_side(*folders, output)
    assert "<b>" not in (output / "index.html").read_text()
    write(folders[1], FIGURE)
    side_by_side(*folders, output)
    names = {str(path.relative_to(output)) for path in output.rglob("*.*")}
    assert names == {"index.html", "committed/table_1.json", "regenerated/table_1.json"}


@pytest.mark.parametrize(
    "mine",
    ["notes.txt", "committed/notes.txt", "committed/fig_1.txt", "regenerated", "index.html"],
)
@pytest.mark.parametrize("earlier", [True, False])
def test_other_peoples_files_are_not_touched(folders, tmp_path, mine, earlier):
    output = tmp_path / "out"
    if earlier and mine != "regenerated":
        write(folders[1], FIGURE | {"numbers": {}})
        side_by_side(*folders, output)
    (output / mine).parent.mkdir(parents=True, exist_ok=True)
    (output / mine).write_text("mine")
    message = f"output: must be a new folder or hold an earlier comparison, .* with .*{mine}"
    with pytest.raises(ValueError, match=message):
        side_by_side(*folders, output)
    assert (output / mine).read_text() == "mine"


def test_what_is_compared_is_not_replaced(folders, tmp_path):
    output = tmp_path / "out"
    write(folders[1], FIGURE | {"numbers": {}})
    side_by_side(*folders, output)
    with pytest.raises(ValueError, match="output: must not hold or lie in what is compared"):
        side_by_side(output / "committed", output / "regenerated", output)
    assert (output / "committed" / "fig_1.json").exists()
    for inside in (folders[0] / "out", folders[1], folders[1] / "a" / "b"):
        before = sorted(tmp_path.rglob("*"))
        with pytest.raises(ValueError, match="output: must not hold or lie in what is compared"):
            side_by_side(*folders, inside)
        assert sorted(tmp_path.rglob("*")) == before
    (tmp_path / "file").touch()
    with pytest.raises(ValueError, match="output: must be a folder, got the file"):
        side_by_side(*folders, tmp_path / "file")


@pytest.mark.parametrize("content", ["{", "[1]", "3", "null", "{}", '"rows"', b"\xff\xfe"])
@pytest.mark.parametrize("wrong", [0, 1])
def test_a_strange_file_is_named(folders, tmp_path, capsys, content, wrong):
    path = folders[wrong] / "strange.json"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert main(["compare", *map(str, folders), "--output", str(tmp_path / "out")]) == 2
    name = ("committed", "regenerated")[wrong]
    message = f"error: {name}: must hold figures and tables (*.json), got '{path}', which is none"
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_command_fails_on_a_difference(folders, tmp_path, capsys):
    command = ["compare", *map(str, folders), "--output", str(tmp_path / "out")]
    assert main(command) == 0
    write(folders[1], RECORD | {"rows": []})
    assert main(command) == 1
    assert "table_1: " in capsys.readouterr().out


@pytest.mark.parametrize("wrong", [0, 1])
def test_nothing_to_compare_is_an_error(folders, tmp_path, capsys, wrong):
    name = ("committed", "regenerated")[wrong]
    asked = list(map(str, folders))
    asked[wrong] = str(tmp_path / "nowhere")
    assert main(["compare", *asked, "--output", str(tmp_path / "out")]) == 2
    assert f"error: {name}: must be a folder, got '{asked[wrong]}'" in capsys.readouterr().err
    (tmp_path / "nowhere").mkdir()
    (tmp_path / "nowhere" / "run_times.json").write_text("{}")
    assert main(["compare", *asked, "--output", str(tmp_path / "out")]) == 2
    assert f"error: {name}: must hold figures or tables" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
