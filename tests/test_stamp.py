"""Where the repository is, files in one step, and a stamp that follows code but not prose."""

import pytest

from vidsindy_lite import stamp as repository
from vidsindy_lite.stamp import package_stamp, repository_root, versions, write_file

CODE = '"""A module."""\ndef f(x):\n    """Add one."""\n    return x + 1\n'


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package of one module."""
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "module.py").write_text(CODE)
    monkeypatch.setattr(repository, "PACKAGE", folder)
    return folder


def test_repository_is_found_from_inside(tiny, tmp_path):
    assert repository_root(tiny.notebooks) == tiny.root
    assert repository_root(tiny.root) == tiny.root
    with pytest.raises(FileNotFoundError, match="repository: .* got"):
        repository_root(tmp_path.parent)


def test_written_file_replaces_the_old_one(tmp_path):
    path = tmp_path / "folder" / "file"
    write_file(path, b"old")
    write_file(path, b"new")
    assert path.read_bytes() == b"new"
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize(
    "code",
    [
        CODE.replace("A module", "Better prose"),
        CODE.replace("Add one", "Add 1"),
        CODE.replace("x + 1", "(x + 1)  # why"),
        CODE.replace("def", "\n\ndef"),
    ],
)
def test_stamp_does_not_follow_prose_and_layout(package, code):
    before = package_stamp()
    (package / "module.py").write_text(code)
    assert package_stamp() == before


@pytest.mark.parametrize("code", [CODE.replace("1", "2"), CODE.replace("+", "-")])
def test_stamp_follows_code(package, code):
    before = package_stamp()
    (package / "module.py").write_text(code)
    assert package_stamp() != before


def test_stamp_follows_other_files_and_requirements(package, tiny):
    stamps = {package_stamp(), package_stamp(tiny.root)}
    (tiny.root / "requirements.txt").write_text("numpy==1.0\n")
    stamps.add(package_stamp(tiny.root))
    (package / "look.mplstyle").write_text("font.size: 11\n")
    stamps.add(package_stamp())
    (package / "look.mplstyle").rename(package / "other.mplstyle")
    stamps.add(package_stamp())
    assert len(stamps) == 5


def test_versions_are_those_that_are_imported():
    import numpy

    lines = versions().splitlines()
    assert lines[0].startswith("Python 3.")
    assert f"numpy {numpy.__version__}" in lines
