"""The README's code runs."""

import re

import pytest

from vidsindy_lite.cameras import Rig
from vidsindy_lite.repository import PACKAGE

README = (PACKAGE.parent / "README.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.DOTALL | re.MULTILINE)


@pytest.mark.slow
def test_the_code_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    smallest, own_videos, test_videos = blocks("python")
    names = {}
    for code in (smallest, test_videos, own_videos):  # which writes the files that the last reads
        exec(code, names)
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
