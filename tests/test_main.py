"""The command line on one's own videos: from three lossy files to a report, or one clear error."""

import json
import os
import signal
import subprocess
import sys
import tomllib
from pathlib import Path
from unittest.mock import Mock

import cv2
import numpy as np
import pytest
from helpers import full_disk

import vidsindy_lite as vl
from vidsindy_lite import study
from vidsindy_lite.__main__ import main
from vidsindy_lite.vision import render

SIZE = (128, 128)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three lossy videos of 30 fps and different length; the second starts 7 frames late."""
    folder = tmp_path_factory.mktemp("own")
    truth = study.SYSTEMS["SprottE"].shift(study.REFERENCE_OFFSET)
    _, x = truth.trajectory(220)
    rig = vl.Rig.around(x, SIZE)
    rows = slice(0, 220), slice(7, 215), slice(0, 210)
    scene = vl.Scene(background="plain", size=12, image_size=SIZE)
    for name, camera, shown in zip("abc", rig.cameras, rows, strict=True):
        frames = render(camera.project(x)[shown], scene)
        vl.write_video(folder / f"{name}.avi", frames, fps=30, codec="MJPG")
    rig.uncalibrated().save(folder / "rig.toml")
    return folder


@pytest.fixture
def here(folder, tmp_path, monkeypatch):
    """The same files in a fresh working directory."""
    for path in folder.iterdir():
        (tmp_path / path.name).symlink_to(path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["rig-template", "--size", "640"], "size: must be two integers like 1920x1080, got '640'"),
        (["rig-template", "--cameras", "1"], "cameras: must be an integer of at least 2, got 1"),
        (["discver"], "COMMAND: must be one of discover, pick, "),
        (["rig-import", "none.toml"], "files: no such calibration file, got 'none.toml'"),
        (["--rig", "none.toml"], "rig: no such file, got 'none.toml'"),
        (["--rig", "rig.toml", "--lag", "0,7"], "lag: must be 3 finite numbers"),
        (["--rig", "rig.toml", "--fps", "0"], "fps: must be positive, got 0"),
        (["--rig", "rig.toml", "--lag", "0,soon,0"], "lag: must be numbers with commas between"),
        (["--rig", "a.avi"], "rig: must be a TOML file in UTF-8, got 'a.avi', which is none"),
        (["--rig", "rig.toml", "--library", "tan(1)"], "library: must be a sum of polynomial("),
        (["--rig", "rig.toml", "--out", "/proc/law"], "out: must be a folder that can be written"),
        (["--rig", "rig.toml", "--seed", "x"], "seed: must be an integer, got 'x'"),
        (["--rig", "rig.toml", "--loud"], "unrecognized arguments: --loud"),
        (["--rig", "rig.toml", "--individual", "a"], "individual: must be given with one camera"),
        (["--rig", "rig.toml", "--degree", "2", "--library", "fourier(1)"], "a library, got 2"),
    ],
)
def test_bad_commands_are_told_in_one_line_before_it_is_tracked(here, capsys, options, message):
    videos = ["discover", "a.avi", "b.avi", "c.avi"] if options[0].startswith("--") else []
    assert main([*videos, *options]) == 2
    shown = capsys.readouterr()
    assert shown.err.startswith("error: ")
    assert message in shown.err
    assert (shown.err.count("\n"), shown.out) == (1, "")


TRACKS = ["a.csv", "b.csv", "c.csv"]


@pytest.fixture
def tracked(tmp_path, monkeypatch):
    """Text files of tracks and a rig."""
    monkeypatch.chdir(tmp_path)
    truth = study.SYSTEMS["Lorenz"].shift(study.REFERENCE_OFFSET)
    _, x = truth.trajectory(100)
    rig = vl.Rig.around(x)
    rig.uncalibrated(0).save("rig.toml")
    for name, camera in zip("abc", rig.cameras, strict=True):
        rows = (f"{i},{u:.9f},{v:.9f}" for i, (u, v) in enumerate(camera.project(x)))
        (tmp_path / f"{name}.csv").write_text("\n".join(["frame,u,v", *rows]))
    (tmp_path / "1.csv").write_text("u,v\n1,2\n")
    return tmp_path


def test_from_tracks_to_a_report_and_back(tracked, capsys):
    text = (tracked / "a.csv").read_text().splitlines()
    rows = [f"{int(row.split(',')[0]) / 50:.6f},{row.partition(',')[2]}" for row in text[1:]]
    (tracked / "timed.csv").write_text("\n".join(["t,u,v", *rows]))
    command = ["discover", "--rig", "rig.toml", "--degree", "2", "--tracks"]
    assert main([*command, "timed.csv", "b.csv", "c.csv", "--fps", "25"]) == 1
    told = "fps: 25 frames in a unit of time are taken as given, though timed.csv states 50"
    shown = capsys.readouterr().out
    assert told in shown
    assert "report: report/report.html" in shown
    first = json.loads((tracked / "report" / "result.json").read_text())
    assert first["options"]["rig file"] == "rig.toml"
    for rate in (["--fps", "25"], []):  # stated and given alike raises no doubt, nor stated alone
        assert main([*command, "report/tracks.csv", "--out", "again", *rate]) == 0
    again = json.loads((tracked / "again" / "result.json").read_text())
    both = (data["law"]["data"]["terms"] for data in (first, again))
    for one, other in zip(*both, strict=True):
        assert one["term"] == other["term"]
        assert one["coefficient"] == pytest.approx(other["coefficient"], rel=1e-4)


def test_a_report_is_kept_though_nobody_reads_what_is_printed(tracked, monkeypatch):
    monkeypatch.setattr("builtins.print", Mock(side_effect=BrokenPipeError))
    command = ["discover", "--rig", "rig.toml", "--fps", "25", "--degree", "2", "--tracks"]
    with pytest.raises(BrokenPipeError):
        main([*command, "a.csv", "b.csv", "c.csv"])
    assert (tracked / "report" / "report.html").exists()


def test_a_refusal_has_one_line_and_a_picture(tracked, capsys):
    command = ["discover", "--rig", "rig.toml", "--fps", "25", "--tracks"]
    assert main([*command, "a.csv", "b.csv", "c.csv", "--degree", "7"]) == 2
    (line,) = [one for one in capsys.readouterr().err.splitlines() if one.startswith("error:")]
    assert "x: must hold at least as many samples as unknowns" in line
    assert "; likely causes, in this order: the rig, the lags, the tracker; " in line
    assert line.endswith("; the tracks are drawn in report/report.html")
    assert sorted(os.listdir("report")) == ["report.html", "result.json", "tracks.csv"]
    # Frames of files count from the start of their videos; a report takes the place of that.
    for name, cut in (("a", 5), ("b", 9)):
        header, *rows = (tracked / f"{name}.csv").read_text().split("\n")
        (tracked / f"{name}.csv").write_text("\n".join([header, *rows[cut:]]))
    assert main([*command, "a.csv", "b.csv", "c.csv", "--degree", "2", "--lag", "0,0,0"]) == 0
    assert (tracked / "report" / "rig.toml").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "videos: give either one video per camera, or --tracks"),
        (["--tracks", "a.csv", "b.csv", "c.csv"], "fps: must be given, or times, as a.csv states"),
        (["--tracks", "a.csv", "none.csv"], "tracks: no such file, got 'none.csv'"),
        (["--tracks", "1.csv", "1.csv", "1.csv", "--fps", "9"], "tracks: must have two frames or"),
        (["--tracks", "a.csv", "--individual", "mouse"], "tracks: must name the individual"),
    ],
)
def test_bad_tracks_are_told(tracked, capsys, options, message):
    assert main(["discover", "--rig", "rig.toml", *options]) == 2
    assert f"error: {message}" in capsys.readouterr().err
    assert not (tracked / "report").exists()


@pytest.mark.parametrize("degree", ["2", "7"])
def test_a_full_disk_is_one_line_and_law_or_refusal_are_told(tracked, capsys, monkeypatch, degree):
    monkeypatch.setattr(Path, "write_bytes", full_disk)
    command = ["discover", "--rig", "rig.toml", "--fps", "25", "--degree", degree, "--tracks"]
    assert main([*command, "a.csv", "b.csv", "c.csv"]) == 2
    shown = capsys.readouterr()
    (line,) = [one for one in shown.err.splitlines() if one.startswith("error:")]
    assert "No space left on device" in line
    assert shown.out.startswith("dx/dt = ") == (degree == "2")
    if degree == "7":
        assert "x: must hold at least as many samples as unknowns" in line
        assert "the tracks could not be drawn: [Errno 28] No space left on device" in line
    assert not list(tracked.glob("*report*"))


@pytest.mark.slow
def test_every_kind_of_film_under_any_name(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    long = "長" * 60 + "l" * 60 + ".avi"
    (tmp_path / long).write_bytes((folder / "a.avi").read_bytes())
    names = [long, "it's $5 「弾む球」", 'say "b_%04d.png"']
    for video, prefix in zip("bc", (f"{names[1]}/", 'say "b_'), strict=True):
        (tmp_path / names[1]).mkdir(exist_ok=True)
        ending = '"' if "b_" in prefix else ""
        for i, frame in enumerate(vl.read_video(folder / f"{video}.avi")):
            path = tmp_path / f"{prefix}{i:04d}.png{ending}"
            path.write_bytes(cv2.imencode(".png", frame[..., ::-1])[1].tobytes())
    command = ["discover", *names, "--rig", str(folder / "rig.toml"), "--fps", "30"]
    status = main([*command, "--degree", "2", "--out", "$報告 'r'"])
    shown = capsys.readouterr()
    assert "report: $報告 'r'/report.html" in shown.out
    assert not shown.err  # nobody watches its progress
    data = json.loads((tmp_path / "$報告 'r'" / "result.json").read_text("utf-8"))
    assert status == (0 if data["status"] == "ok" else 1)
    assert f"status: {data['status']}" in shown.out
    assert [camera["video"] for camera in data["cameras"]] == names
    np.testing.assert_allclose([c["lag"] for c in data["cameras"]], (0, 7, 0), atol=0.05)
    assert [c["frames"] for c in data["cameras"]] == [220, 208, 210]
    assert (data["options"]["lags"], data["t"][30]) == ("learned", pytest.approx(1.0))
    report = (tmp_path / "$報告 'r'" / "report.html").read_text("utf-8")
    assert data["law"]["data"]["equations"] in report


def test_ctrl_c_ends_the_command_in_one_line(tracked, interruptible):
    command = [sys.executable, "-X", "importtime", "-m", "vidsindy_lite", "discover"]
    environment = os.environ | {"PYTHONPATH": str(Path(vl.__file__).parent.parent)}
    with subprocess.Popen(
        [*command, "--rig", "rig.toml", "--fps", "9", "--degree", "5", "--tracks", *TRACKS],
        env=environment, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as running:  # fmt: skip
        for line in running.stderr:
            if "vidsindy_lite.dynamics.solver" in line:  # it is at work
                break
        running.send_signal(signal.SIGINT)
        _, shown = running.communicate(timeout=60)
    assert "Traceback" not in shown
    assert running.returncode == 130
    assert not list(tracked.glob("*report*"))


def test_the_version(capsys):
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out == f"vidsindy_lite {vl.__version__}\n"
    project = tomllib.loads((Path(vl.__file__).parent.parent / "pyproject.toml").read_text())
    assert project["project"]["version"] == vl.__version__
