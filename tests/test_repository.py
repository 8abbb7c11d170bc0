"""Where the repository is, files in one step, the hash of the code, what has to be installed."""

import ast
import re
import tomllib
from importlib.metadata import packages_distributions

import pytest

from vidsindy_lite import storage
from vidsindy_lite.storage import PACKAGE, RESULTLESS, code_hash, repository_root, write_file

ROOT = PACKAGE.parent


def test_repository_is_found_from_inside(tiny, tmp_path):
    assert repository_root(tiny.notebooks) == tiny.root
    with pytest.raises(FileNotFoundError, match="repository: expected to be inside a clone"):
        repository_root(tmp_path.parent)


def test_a_file_is_replaced_in_one_step(tmp_path):
    write_file(tmp_path / "folder" / "a", b"one")
    write_file(tmp_path / "folder" / "a", b"two")
    (tmp_path / "folder" / "b").mkdir()
    with pytest.raises(OSError, match="b"):
        write_file(tmp_path / "folder" / "b", b"three")
    assert (tmp_path / "folder" / "a").read_bytes() == b"two"
    assert sorted(path.name for path in (tmp_path / "folder").iterdir()) == ["a", "b"]


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
def test_the_hash_follows_code_and_data(
    tmp_path, monkeypatch, file, content, counts, counts_for_results
):
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
    homes = packages_distributions()
    return {
        module
        for module in modules
        if module in homes and not {_plain(name) for name in homes[module]} & listed
    }


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
    modules = imported("vidsindy_lite") | imported("tests") | imported("notebooks")
    modules |= imported("docs")
    for listed in required():
        assert unlisted(modules, listed | {"vidsindy-lite"}) == set()


def test_an_import_that_is_not_listed_is_seen():
    pinned, wanted = required()
    assert unlisted({"PIL", "numpy", "os"}, pinned - {"pillow"}) == {"PIL"}
    assert unlisted({"PIL", "numpy", "os"}, wanted - {"numpy"}) == {"numpy"}
