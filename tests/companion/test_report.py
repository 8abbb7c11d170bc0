"""The report, the film of the law and the page of pick: whole, and readable without network."""

import io
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import warnings
from collections import Counter
from dataclasses import replace
from pathlib import Path

import av
import jsonschema
import matplotlib.pyplot as plt
import numpy as np
import pytest
from browser import Browser, needs_browser
from helpers import full_disk

import vidsindy_lite as vl
from vidsindy_lite import study
from vidsindy_lite.__main__ import main
from vidsindy_lite.cameras import Lags
from vidsindy_lite.companion import report
from vidsindy_lite.companion.report import FILES, FRAMES, check_folder_is_free, write_report
from vidsindy_lite.pipeline import Observation, Refused
from vidsindy_lite.vision import read_tracks


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """A law, found from a true path with gaps, and videos that show it."""
    folder = tmp_path_factory.mktemp("videos")
    truth = study.SYSTEMS["SprottE"].shift(study.REFERENCE_OFFSET)
    t, x = truth.trajectory(150)
    rig = vl.Rig.around(x, image_size=(96, 96))
    tracks = [camera.project(x) for camera in rig.cameras]
    paths = []
    for i, track in enumerate(tracks):
        paths.append(folder / f"<{i}$^$>.mov")  # a name that has to be escaped
        scene = vl.Scene(background="plain", size=8, image_size=(96, 96))
        vl.render_video(paths[-1], track[:20], scene)
    tracks[1] = np.where(np.arange(150)[:, None] < 10, np.nan, tracks[1])
    tracks[2] = np.where(np.arange(150)[:, None] < 5, np.nan, tracks[2])
    x[:5] = np.nan
    law = vl.discover(t, x, degree=2)
    late, errors = np.array([0, 3.5, 0]), np.array([0, 0.01, np.inf])
    lags = Lags(late, np.ones(3), errors, 0.1, clocks=(np.arange(150.0),) * 3)
    seen = Observation(tuple(tracks), rig, lags, t, x, np.empty((0, *x.shape)), law.warnings)
    return vl.VideoDiscovery(**vars(seen), discovery=law), paths


@pytest.fixture(scope="module")
def page(case, tmp_path_factory):
    found, paths = case
    folder = tmp_path_factory.mktemp("out") / "report"
    return write_report(found, paths, folder, {"degree": 2})


def checked_page(page):
    """The text of a page, in which what is opened is closed, and the addresses that it names."""
    text = page.read_text("utf-8")
    opened = Counter(re.findall(r"<([a-z]\w*)", text))
    assert opened - Counter({"meta": 99, "img": 99}) == Counter(re.findall(r"</(\w+)>", text))
    return text, re.findall(r'(?:src|href)="([^"]*)"', text)


def test_the_page_tells_law_verdict_and_cameras_and_needs_nothing_else(page, case):
    text, addresses = checked_page(page)
    assert text.count("<img") == 5
    kinds = [address.partition(",")[0] for address in addresses]
    assert sorted(set(kinds)) == ["data:image/png;base64", "data:video/webm;base64"]
    assert kinds.count("data:video/webm;base64") == 1
    assert not re.search(r"https?:|@import|<script|<link", text)
    assert len(text) < 3_000_000
    found, _ = case
    for frame in ("data", "native"):
        assert found.discovery.equations(frame) in text
    assert "No reason for doubt was found." in text
    assert "3.500 ± 0.01" in text
    assert "0.000 ± unknown" in text
    assert "&lt;1$^$&gt;.mov" in text
    assert "<1" not in text
    assert "degree 2" in text


def test_the_data_are_those_of_the_law_and_the_tracks_can_be_read_again(page, case):
    found, data = case[0], checked(page.parent)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data | {"status": "sure"}, described())
    assert data["status"] == found.status
    assert data["law"]["native"]["equations"] == found.discovery.equations("native")
    term = data["law"]["data"]["terms"][0]
    row, column = found.discovery.terms.index(term["term"]), "xyz".index(term["equation"][1])
    assert term["coefficient"] == found.discovery.coefficients[row, column]
    assert term["standard_error"] == found.discovery.standard_errors[row, column]
    assert len(data["law"]["data"]["terms"]) == found.discovery.system.support.sum()
    x = np.array(data["x"], dtype=float)
    np.testing.assert_array_equal(x, found.x)
    assert data["x"][0] == [None] * 3
    assert data["cameras"][1]["lag"] == 3.5
    assert data["cameras"][2]["lag_error"] is None
    assert data["cameras"][1]["share_of_frames_seen"] == pytest.approx(140 / 150)
    assert vl.Rig.load(page.parent / "rig.toml") == found.rig
    assert set(os.listdir(page.parent)) == set(FILES)
    tracks = read_tracks(page.parent / "tracks.csv")
    for ours, theirs in zip(tracks, found.tracks, strict=True):
        np.testing.assert_allclose(ours.pixels, theirs, rtol=1e-9)
        np.testing.assert_allclose(ours.t, found.t, rtol=1e-9, atol=1e-9)


OLD = "<title>Law of a moving target</title> old"


@pytest.fixture
def old(tmp_path, monkeypatch):
    """A link to a folder with an earlier report and a file of somebody's; without pictures."""
    monkeypatch.setattr(report, "_figures", lambda *_: iter(()))
    (tmp_path / "there").mkdir()
    (tmp_path / "report").symlink_to(tmp_path / "there")
    (tmp_path / "there" / "report.html").write_text(OLD)
    (tmp_path / "there" / "thesis.tex").write_text("mine")
    return tmp_path / "report"


def test_an_earlier_report_is_replaced_and_nothing_else(case, old):
    inode = old.stat().st_ino
    write_report(case[0], None, old)
    assert set(os.listdir(old)) == {*FILES, "thesis.tex"}
    assert "old" not in (old / "report.html").read_text(encoding="utf-8")[:200]
    assert old.is_symlink()
    assert old.stat().st_ino == inode
    assert sorted(os.listdir(old.parent)) == ["report", "there"]


@pytest.mark.parametrize("call", ["write_bytes", "replace", None])
def test_a_report_that_fails_leaves_what_was_there(case, old, tmp_path, monkeypatch, call):
    found, paths = case
    with monkeypatch.context() as patch:
        if call:
            patch.setattr(Path, call, full_disk)
        for folder in (old, tmp_path / "new"):
            with pytest.raises(OSError, match="No space left on device|gone"):
                write_report(found, None if call else [*paths[:2], old / "gone.mov"], folder)
    assert (old / "report.html").read_text() == OLD
    assert sorted(os.listdir(old)) == ["report.html", "thesis.tex"]
    assert not (tmp_path / "new").exists()


def test_what_a_killed_run_has_left_is_cleared_by_the_next(case, old, monkeypatch):
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    for name in FILES:
        (old / f".{name}.{gone.pid}").write_text("left")
        (old / f".{name}.{os.getppid()}").write_text("of a run that goes on")
    order, write = [], report.write_files
    monkeypatch.setattr(report, "write_files", lambda files: order.extend(files) or write(files))
    write_report(case[0], None, old)
    assert order[0].name == "report.html"  # which tells whose the others are, if this is killed
    hidden = {f".{name}.{os.getppid()}" for name in FILES}
    assert set(os.listdir(old)) == {*FILES, *hidden, "thesis.tex"}


def test_other_peoples_files_are_not_overwritten(tmp_path):
    (tmp_path / "rig.toml").write_text("")
    with pytest.raises(ValueError, match=r"out: must hold no files of the names .* with rig\.toml"):
        check_folder_is_free(tmp_path)
    (tmp_path / "report.html").write_text("a report of mine")
    with pytest.raises(ValueError, match=r"got '.*' with report\.html, rig\.toml"):
        check_folder_is_free(tmp_path)
    with pytest.raises(ValueError, match="out: must be a folder that can be written"):
        check_folder_is_free(tmp_path / "rig.toml" / "below")
    assert check_folder_is_free(tmp_path / "a" / "b") == tmp_path / "a" / "b"  # made when written


def test_strange_names_do_not_spoil_the_report_nor_it_the_figures_of_a_notebook(case, tmp_path):
    names = ["a" * 200 + r"\$a$", "line\nbreak {{ x }}", "弾む球 it's $x^$"]
    found, paths = case
    copies = [
        shutil.copy(path, tmp_path / f"{name}.mov") for name, path in zip(names, paths, strict=True)
    ]
    with warnings.catch_warnings(), plt.ion():
        warnings.simplefilter("error")
        page = write_report(found, copies, tmp_path / "report").read_text("utf-8")
        assert plt.isinteractive()
    for name in names:
        shown = name.replace("'", "&#39;")
        assert f"<td>{shown}.mov</td>" in page
    with pytest.raises(ValueError, match="paths: must be 3 videos, got 2"):
        write_report(found, paths[:2], tmp_path / "report")


def described():
    return json.loads(Path(report.__file__).with_name("result.schema.json").read_text("utf-8"))


def checked(folder):
    """result.json, which the schema must describe, all of it."""

    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    schema = described()
    data = json.loads((folder / "result.json").read_text("utf-8"), parse_constant=refuse)
    jsonschema.validate(data, schema)
    told = next(
        one for one in schema["oneOf"] if jsonschema.Draft202012Validator(one).is_valid(data)
    )
    assert data.keys() == told["properties"].keys()
    return data


def test_of_tracks_alone_a_doubted_law_in_turned_axes(case, tmp_path, monkeypatch):
    found, _ = case
    turn = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    turned = replace(found.discovery, orientation=turn)
    monkeypatch.chdir(tmp_path)
    doubted = replace(found, discovery=turned, warnings=("it is < wrong",))
    write_report(doubted, None, ".")
    assert set(os.listdir(tmp_path)) == set(FILES)
    data, page = checked(tmp_path), (tmp_path / "report.html").read_text("utf-8")
    assert data["law"]["orientation"] == turn.tolist()
    np.testing.assert_allclose(np.array(data["curve"], float), doubted.fitted)
    assert data["cameras"][0]["fps"] == pytest.approx(1 / np.diff(found.t)[0])
    assert "its axes turned, x along (0.0000, 1.0000, 0.0000)" in page
    assert "Suspect: do not trust this law as it is." in page
    assert "it is &lt; wrong" in page
    assert "No reason for doubt" not in page
    assert page.count("<img") == 4
    assert "<td>camera 2</td>" in page


@pytest.mark.parametrize("with_videos", [True, False])
def test_a_refusal_shows_the_tracks_and_the_step(case, tmp_path, with_videos):
    found, paths = case
    tracks = [*(track[:20] for track in found.tracks[:2]), np.full((20, 2), np.nan)]
    refused = Refused("paths: <b> shows nothing; likely causes: ...", "track", tracks)
    page = report.write_refusal(
        refused, paths if with_videos else None, found.rig, tmp_path / "out", {"degree": 2}
    )
    assert sorted(os.listdir(page.parent)) == ["report.html", "result.json", "tracks.csv"]
    text, _ = checked_page(page)
    assert text.count("<img") == 1
    assert "A target was not found in every video." in text
    assert "paths: &lt;b&gt; shows nothing" in text
    data = checked(page.parent)
    assert (data["status"], data["step"]) == ("refused", "track")
    assert data["share_of_frames_seen"][2] == 0
    check_folder_is_free(page.parent)  # the next run may replace it
    np.testing.assert_allclose(read_tracks(page.parent / "tracks.csv")[0].pixels, tracks[0])


@needs_browser
def test_a_telephone_shows_the_report_without_scrolling_sideways(page, case, tmp_path):
    found, paths = case
    tracks = [track[:20] for track in found.tracks]
    refused = Refused("paths: " + "a" * 300, "law", tracks)
    other = report.write_refusal(refused, paths, found.rig, tmp_path / "out")
    (tmp_path / "profile").mkdir()
    with Browser(tmp_path / "profile") as browser:
        for one in (page, other):
            seen = browser.open(one, 390)
            assert seen["width"] <= 390
            assert (seen["errors"], seen["requests"], seen["broken"]) == ([], [], [])


LATER = 4  # frames


def observed(tmp_path, frames):
    """Two films of a motion, the second of which starts later, and its law."""
    truth = study.SYSTEMS["SprottE"].shift(study.REFERENCE_OFFSET)
    t, x = truth.trajectory(frames)
    rig = vl.Rig.around(x, image_size=(270, 270))
    tracks = [camera.project(x) for camera in rig.cameras[:2]]
    scene = vl.Scene(background="plain", size=12, image_size=(270, 270))
    paths = [vl.render_video(tmp_path / "a.mov", tracks[0], scene)]
    paths.append(vl.render_video(tmp_path / "b.mov", tracks[1][LATER:], scene))
    tracks[1][:LATER] = np.nan
    clocks = np.arange(1.0 * frames), np.arange(1.0 * frames - LATER)
    lags = Lags(np.array([0.0, LATER]), np.ones(2), np.zeros(2), 0.0, clocks=clocks)
    rig = vl.Rig(rig.cameras[:2])
    seen = Observation(tuple(tracks), rig, lags, t, x, np.empty((0, *x.shape)), ())
    return vl.VideoDiscovery(**vars(seen), discovery=vl.discover(t, x, degree=2)), paths


def decoded(film):
    with av.open(io.BytesIO(film)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def test_the_law_is_drawn_where_the_target_is_and_a_long_film_shown_in_steps(tmp_path):
    found, paths = observed(tmp_path, 150)
    frames = decoded(report.law_over_videos(found, paths))
    assert len(frames) == 150
    assert frames[0].shape == (270, 540, 3)
    for k in (0, LATER, 77, 149):
        for i, (path, start) in enumerate(zip(paths, (0, LATER), strict=True)):
            view = frames[k][:, 270 * i : 270 * (i + 1)].astype(int)
            raw = vl.read_frame(path, k - start) if k >= start else np.full((270, 270, 3), 128)
            v, u = np.nonzero(np.abs(view - raw).max(axis=2) > 60)
            ring = found.rig.cameras[i].project(found.x[[k]])[0]
            assert np.hypot(u - ring[0], v - ring[1]).min() < 10
    assert len(report.law_over_videos(found, paths)) < 1_000_000
    found, paths = observed(tmp_path, 201)
    assert len(decoded(report.law_over_videos(found, paths))) == 101


@pytest.fixture(scope="module")
def videos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("videos")
    scene = vl.Scene(background="plain", size=10, image_size=(160, 120))
    track = np.linspace([30, 40], [120, 90], 60)
    return [vl.render_video(folder / name, track, scene) for name in ("a.mov", "<弾む 球>.mov")]


def test_one_page_holds_all(videos, tmp_path):
    text = report.write_pick_page(videos, tmp_path / "pick.html").read_text("utf-8")
    assert "&lt;弾む 球&gt;.mov" in text
    assert "<弾" not in text
    assert text.count("data:image/jpeg;base64,") == 2 * FRAMES
    assert not re.search(r"https?:|@import|<link|src=\"(?!data:)", text)
    numbers = [int(number) for number in re.findall(r'data-frame="(\d+)"', text)]
    assert (numbers[0], numbers[FRAMES - 1]) == (0, 59)


def test_only_its_own_pages_are_replaced_by_the_command_too(videos, tmp_path, monkeypatch, capsys):
    out = tmp_path / "pick.html"
    report.write_pick_page(videos[:1], out)
    monkeypatch.chdir(tmp_path)
    assert main(["pick", *map(str, videos)]) == 0
    assert capsys.readouterr().out == "open pick.html in a browser\n"
    assert main(["pick", "none.mp4"]) == 2
    assert "no such video file" in capsys.readouterr().err
    other = tmp_path / "thesis.html"
    other.write_text("mine")
    for place in (other, tmp_path):
        with pytest.raises(ValueError, match="out: must be a new file or an earlier page of pick"):
            report.write_pick_page(videos, place)
    assert other.read_text() == "mine"


DRAG = """(() => {
    const [section] = document.querySelectorAll("section");
    const slider = section.querySelector("input"), view = section.querySelector(".view");
    slider.value = SLIDER;
    slider.dispatchEvent(new Event("input"));
    const frame = view.getBoundingClientRect();
    for (const [kind, u, v] of EVENTS) {
        const clientX = frame.left + (u + 0.5) * frame.width / 160;
        const clientY = frame.top + (v + 0.5) * frame.height / 120;
        view.dispatchEvent(new PointerEvent(kind, {clientX, clientY, pointerId: 1, bubbles: true}));
    }
    return ["toml", "python"].map(kind => section.querySelector("." + kind).textContent);
})()"""


@needs_browser
@pytest.mark.parametrize(("width", "drawn"), [(390, "box"), (1280, "click")])
def test_a_box_becomes_the_line_to_paste(videos, tmp_path, width, drawn):
    page = report.write_pick_page(videos, tmp_path / "pick.html")
    events = {
        "box": [["pointerdown", 60, 70], ["pointermove", 30, 50], ["pointerup", 40, 50]],
        "click": [["pointerdown", 50, 60], ["pointerup", 50, 60]],
    }[drawn]
    (tmp_path / "profile").mkdir()
    with Browser(tmp_path / "profile") as browser:
        seen = browser.open(page, width)
        script = DRAG.replace("SLIDER", str(FRAMES - 1)).replace("EVENTS", str(events))
        answer = browser.command("Runtime.evaluate", expression=script, returnByValue=True)
    assert (seen["errors"], seen["requests"], seen["broken"]) == ([], [], [])
    assert seen["width"] <= width
    toml, python = answer["result"]["value"]
    numbers = [float(number) for number in re.findall(r"-?[\d.]+", toml)]
    assert numbers == [float(number) for number in re.findall(r"-?[\d.]+", python)]
    assert re.fullmatch(r"target = \{ frame = 59, box = \[.*\] \}", toml)
    hint = vl.Hint(**tomllib.loads(toml)["target"])  # as the rig file takes it
    assert (hint.frame, list(hint.box)) == (59, numbers[1:])
    expected = [40, 50, 20, 20] if drawn == "box" else [46, 56, 8, 8]
    np.testing.assert_allclose(numbers[1:], expected, atol=0.11)
