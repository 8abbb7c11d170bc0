"""The page on which the target is shown: complete, without network, and right to a pixel."""

import re
import tomllib

import numpy as np
import pytest
from browser import CHROMIUM, Browser

import vidsindy_lite as vl
from vidsindy_lite.__main__ import main
from vidsindy_lite.companion.report import FRAMES, write_pick_page

needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here to open the page in")


@pytest.fixture(scope="module")
def videos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("videos")
    scene = vl.Scene(background="plain", size=10, image_size=(160, 120))
    track = np.linspace([30, 40], [120, 90], 60)
    return [vl.render_video(folder / name, track, scene) for name in ("a.mov", "<弾む 球>.mov")]


def test_one_page_holds_all(videos, tmp_path):
    text = write_pick_page(videos, tmp_path / "pick.html").read_text("utf-8")
    assert "&lt;弾む 球&gt;.mov" in text
    assert "<弾" not in text
    assert text.count("data:image/jpeg;base64,") == 2 * FRAMES
    assert not re.search(r"https?:|@import|<link|src=\"(?!data:)", text)
    numbers = [int(number) for number in re.findall(r'data-frame="(\d+)"', text)]
    assert (numbers[0], numbers[FRAMES - 1]) == (0, 59)


def test_only_its_own_pages_are_replaced(videos, tmp_path):
    out = tmp_path / "pick.html"
    write_pick_page(videos[:1], out)
    write_pick_page(videos, out)
    other = tmp_path / "thesis.html"
    other.write_text("mine")
    for place in (other, tmp_path):
        with pytest.raises(ValueError, match="out: must be a new file or an earlier page of pick"):
            write_pick_page(videos, place)
    assert other.read_text() == "mine"


def test_the_command(videos, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["pick", *map(str, videos)]) == 0
    assert capsys.readouterr().out == "open pick.html in a browser\n"
    assert main(["pick", "none.mp4"]) == 2
    assert "no such video file" in capsys.readouterr().err


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


@needs_chromium
@pytest.mark.parametrize(("width", "drawn"), [(390, "box"), (1280, "click")])
def test_a_box_becomes_the_line_to_paste(videos, tmp_path, width, drawn):
    page = write_pick_page(videos, tmp_path / "pick.html")
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
