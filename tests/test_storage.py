"""Files: what is wrong with one is one line, each is replaced in one step; the hash of code."""

import ast
import json
import re
import tomllib
from importlib.metadata import packages_distributions

import numpy as np
import pytest
from helpers import full_disk

import vidsindy_lite as vl
from vidsindy_lite import storage
from vidsindy_lite.__main__ import main
from vidsindy_lite.storage import DEEPEST, PACKAGE, RESULTLESS, code_hash, read_tree, write_file
from vidsindy_lite.vision import read_tracks

ROOT = PACKAGE.parent
MANY = 30_000
DEEP = {
    "a.xml": '<?xml version="1.0"?><opencv_storage>' + "<a>" * MANY + "</a>" * MANY,
    "b.xml": '<?xml version="1.0"?><opencv_storage><!--' + "</a>" * MANY + "-->" + "<a>" * MANY,
    "a.yaml": "%YAML:1.0\n---\na: " + "[" * MANY + "]" * MANY,
    "b.yaml": "%YAML:1.0\n---\na: " + "- " * MANY + "1",
    "d.yaml": '%YAML:1.0\n---\na: "' + "]" * MANY + '"\nb: ' + "[" * MANY,
    "a.json": '{"opencv-matrix": 1, "a": ' + "[" * MANY + "]" * MANY + "}",
    "a.toml": "a = " + "[" * MANY,
    "b.toml": "a." * MANY + "b = 1",
}


@pytest.mark.parametrize("name", DEEP)
def test_nested_files_are_refused(tmp_path, name):
    path = tmp_path / name
    path.write_text(DEEP[name])
    with pytest.raises(ValueError, match=f"at must be nested|must be nested {DEEPEST} levels"):
        read_tree("paths", path, path.suffix)
    assert main(["rig-import", str(path), "--size", "9x9"]) == 2


def test_marks_of_byte_order(tmp_path, monkeypatch):
    rig = vl.Rig.around(np.random.default_rng(0).normal(size=(9, 3)))
    for encoding in ("utf-8-sig", "utf-16"):
        (tmp_path / "rig.toml").write_bytes(rig.text().encode(encoding))
        assert vl.Rig.load(tmp_path / "rig.toml") == rig
        (tmp_path / "a.csv").write_bytes("u,v\n1,2\n3,4\n".encode(encoding))
        np.testing.assert_array_equal(read_tracks(tmp_path / "a.csv")[0].pixels, [[1, 2], [3, 4]])
    (tmp_path / "a.csv").write_bytes("Bildé,u,v\n0,1,2\n1,3,4\n".encode("latin-1"))
    np.testing.assert_array_equal(read_tracks(tmp_path / "a.csv")[0].pixels, [[1, 2], [3, 4]])
    monkeypatch.setattr(storage, "LARGEST_TEXT", 20)
    with pytest.raises(ValueError, match="tracks: must be a table of numbers of at most 20 bytes"):
        read_tracks(tmp_path / "a.csv")


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    path = tmp_path_factory.mktemp("law") / "law.json"
    t = np.linspace(0, 10, 100)
    vl.discover(t, np.c_[np.cos(t), -np.sin(t)], degree=1).save(path)
    return json.loads(path.read_text())


FIELDS = (
    "system", "native", "swing", "curves", "noise", "warnings", "path", "history", "offset",
    "covariance", "absent", "note", "orientation",
)  # fmt: skip


@pytest.mark.parametrize("value", [5, None, {"type": "Step"}, [1, [2]]])
@pytest.mark.parametrize("key", FIELDS)
def test_a_saved_law_with_a_field_of_another_type_is_refused(saved, tmp_path, key, value):
    if value == saved["discovery"][key]:
        return
    broken = saved | {"discovery": saved["discovery"] | {key: value}}
    (tmp_path / "law.json").write_text(json.dumps(broken))
    with pytest.raises(ValueError, match="path: must be a file that Discovery.save has") as caught:
        vl.Discovery.load(tmp_path / "law.json")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["[" * 100_000, "{}", "5", '{"format": 1}', ""])
def test_what_is_no_saved_law_is_refused(tmp_path, text):
    (tmp_path / "law.json").write_text(text)
    with pytest.raises(ValueError, match="path: must be a"):
        vl.Discovery.load(tmp_path / "law.json")


@pytest.mark.parametrize("call", ["write_bytes", "replace"])
def test_a_full_disk_leaves_the_old_law_and_rig(saved, tmp_path, monkeypatch, call):
    (tmp_path / "law.json").write_text(json.dumps(saved))
    law, rig = vl.Discovery.load(tmp_path / "law.json"), vl.Rig.around(np.eye(3))
    rig.save(tmp_path / "rig.toml")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    monkeypatch.setattr(f"pathlib.Path.{call}", full_disk)
    for save in (law.save, rig.save):
        for name in (*before, "new"):
            with pytest.raises(OSError, match="No space left"):
                save(tmp_path / name)
    for command in (["rig-template"], ["rig-import", str(tmp_path / "rig.toml")]):
        assert main([*command, "--output", str(tmp_path / "new")]) == 2
    monkeypatch.undo()
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_link_stays_one_and_a_device_too(tmp_path):
    rig = vl.Rig.around(np.eye(3))
    (tmp_path / "there.toml").write_text("old")
    (tmp_path / "there.toml").chmod(0o640)
    (tmp_path / "rig.toml").symlink_to(tmp_path / "there.toml")
    rig.save(tmp_path / "rig.toml")
    assert (tmp_path / "rig.toml").is_symlink()
    assert vl.Rig.load(tmp_path / "there.toml") == rig
    assert (tmp_path / "there.toml").stat().st_mode & 0o777 == 0o640
    rig.save("/dev/null")


PARTS = {
    "dynamics/law.py": "import numpy\nLEAST = 1\n",
    "vision/weights.json": "{}",
    "study/plots/look.mplstyle": "font.size: 11",
    "companion/pages.py": "DIGITS = 6\n",
}


@pytest.mark.parametrize(
    ("file", "content", "counts", "counts_for_results"),
    [
        ("dynamics/law.py", "import numpy\nLEAST = 2\n", True, True),
        ("dynamics/law.py", "import numpy  # a comment\n\nLEAST = 1\n", False, False),
        ("dynamics/__pycache__/law.pyc", "", False, False),
        ("dynamics/other.py", "", True, True),
        ("vision/weights.json", "{} ", True, True),
        ("study/plots/look.mplstyle", "font.size: 12", True, False),
        ("companion/pages.py", "DIGITS = 5\n", True, False),
    ],
)
def test_the_hash_follows_content(tmp_path, monkeypatch, file, content, counts, counts_for_results):
    monkeypatch.setattr(storage, "PACKAGE", tmp_path)

    def hashes():
        code_hash.cache_clear()
        return code_hash(), code_hash(RESULTLESS)

    for name, text in PARTS.items():
        write_file(tmp_path / name, text.encode())
    before = hashes()
    write_file(tmp_path / file, content.encode())
    changed = [one != other for one, other in zip(before, hashes(), strict=True)]
    monkeypatch.setattr(storage, "library_versions", lambda: ["numpy 1.0"])
    assert hashes() != before
    code_hash.cache_clear()
    assert changed == [counts, counts_for_results]


def imported(folder):
    """Names of the modules that the code of a folder imports, at any depth."""
    found = set()
    for path in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(node.module.partition(".")[0])
    return found


def unlisted(modules, listed):
    """Modules of other distributions than those that are listed."""
    homes = {name: set(map(_plain, home)) for name, home in packages_distributions().items()}
    return {module for module in modules & homes.keys() if not homes[module] & listed}


def _plain(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def required():
    """What requirements.txt lists, and what pyproject.toml lists with all of its extras."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = [*project["dependencies"], *sum(project["optional-dependencies"].values(), [])]
    pinned = re.findall(r"^([\w.-]+)==", (ROOT / "requirements.txt").read_text(), re.MULTILINE)
    names = {_plain(re.match(r"[\w.-]+", one)[0]) for one in wanted}
    return {_plain(name) for name in pinned}, names


def test_all_that_is_imported_is_listed_in_both():
    modules = set().union(*map(imported, ("vidsindy_lite", "tests", "notebooks", "docs")))
    for listed in required():
        assert unlisted(modules, listed | {"vidsindy-lite"}) == set()


def test_an_import_that_is_not_listed_is_seen():
    pinned, wanted = required()
    assert unlisted({"PIL", "numpy", "os"}, pinned - {"pillow"}) == {"PIL"}
    assert unlisted({"PIL", "numpy", "os"}, wanted - {"numpy"}) == {"numpy"}
