"""One camera, motion in a plane: the scale and its error, and laws that are the same everywhere."""

import json
import re
from itertools import pairwise

import numpy as np
import pytest
from helpers import real
from scipy.integrate import solve_ivp

import vidsindy_lite as vl
from vidsindy_lite import pipeline, plane
from vidsindy_lite.__main__ import main
from vidsindy_lite.dynamics import homogeneous
from vidsindy_lite.vision import Track, VideoInfo

SCALE = 250.0  # pixels in a metre
STICK = (100.0, 600.0, 100.0, 600.0 - SCALE / 2, 0.5)


def flight(velocity=(1.5, 5.0), drag=0.0, samples=34):
    """Places in metres at 30 a second, under g and a drag."""
    t = np.arange(samples) / 30
    first = -np.expm1(-drag * t) / drag if drag else t
    second = (t - first) / drag if drag else t**2 / 2
    return t, np.outer(first, velocity) + np.outer(second, (0, -9.81))


def swung(t, length, drag, angle=0.6):
    """Places of a pendulum in metres, from its rest."""

    def pull(t, y):
        return [y[1], -9.81 / length * np.sin(y[0]) - drag * y[1]]

    angle = solve_ivp(pull, (0, t[-1]), [angle, 0], t_eval=t, rtol=1e-9, atol=1e-9).y[0]
    return length * np.column_stack([np.sin(angle), 1 - np.cos(angle)])


def noisy(x, seed, error=4e-4):
    return x + np.random.default_rng(seed).normal(0, error, x.shape)


def filmed(monkeypatch, pixels, fps=30.0, frames=None):
    """As if a film showed the target there."""
    found, asked = Track(np.asarray(pixels), np.ones(len(pixels)), "motion"), []
    monkeypatch.setattr(vl.vision, "track", lambda *what: asked.append(what) or found)
    monkeypatch.setattr(plane, "frame_clock", lambda path: np.arange(len(pixels), dtype=float))
    info = VideoInfo(len(pixels) if frames is None else frames, fps, (1280, 720))
    monkeypatch.setattr(plane, "video_info", lambda path: info)
    return asked


def pixels_of(x):
    return np.column_stack([640 + SCALE * x[:, 0], 500 - SCALE * x[:, 1]])


@pytest.mark.parametrize("seed", range(2))
def test_a_throw_is_a_constant_force(seed):
    rng = np.random.default_rng(seed)
    t, x = flight((rng.uniform(-2, 2), rng.uniform(4, 6)))
    assert homogeneous(t, x, ("x", "y")).status == "ok"
    found = homogeneous(t, noisy(x, seed), ("x", "y"))
    g = found.physics()["g"]
    assert found.system.support.sum() == 2 + 1  # x' = vx, y' = vy, y'' = -g
    assert abs(g.value - 9.81) < min(3 * g.error, 0.02)
    assert found.status == "ok"
    assert "same everywhere; velocity at t = " in found.note
    np.testing.assert_allclose(found.curve(t)[:, :2], x, atol=1e-3)
    x[[0, -1]] = x[[1, -2]]  # in a hand, and on the ground
    assert "the target may be held" in homogeneous(t, noisy(x, seed), ("x", "y")).warnings[-1]


def test_drag_is_given_where_it_is_plain_and_else_a_doubt_and_in_the_error_of_g():
    t, x = flight(drag=0.6)
    found = homogeneous(t, noisy(x, 0), ("x", "y"))
    said = found.physics()
    assert abs(said["drag"].value - 0.6) < 3 * said["drag"].error < 0.05
    assert abs(said["g"].value - 9.81) < 3 * said["g"].error < 0.05
    assert found.status == "ok"
    assert [plateau.terms.sum() for plateau in found.path[3]] == [2, 1, 0]
    assert all(low.high == high.low for low, high in pairwise(found.path[3]))
    t, x = flight(drag=0.05)
    found = homogeneous(t, noisy(x, 0), ("x", "y"))
    g = found.physics()["g"]
    assert not any(quantity.name == "drag" for quantity in found.physics())
    assert abs(g.value - 9.81) < 2 * g.error < 0.4
    (doubt,) = found.warnings
    assert doubt.startswith("one flight hardly tells its law")
    assert "(drag" in doubt


def test_motions_that_are_no_plain_flight():
    t, x = flight()
    nearer = homogeneous(t, noisy(x / (1 - 0.1 * t)[:, None], 0), ("x", "y"))
    assert not any(quantity.name == "drag" for quantity in nearer.physics())
    assert any("it comes nearer, or the plane lies askew" in doubt for doubt in nearer.warnings)
    straight = homogeneous(t, noisy(np.outer(t, (0.5, 0.2)), 0), ("x", "y"))
    assert straight.equations() == "x'' = 0\ny'' = 0"
    slowed = homogeneous(t, noisy(np.outer(t - 0.01 * t**2, (0.5, 0.2)), 0), ("x", "y"))
    assert slowed.warnings[0].startswith("a constant force of 0.01")
    assert "would leave" in homogeneous(t[:6], noisy(x, 0)[:6] * 2, ("x", "y")).warnings[0]
    jumps = x + 0.1 * (np.arange(len(x)) > 20)[:, None]
    assert "the track jumps" in homogeneous(t, noisy(jumps, 0), ("x", "y")).warnings[0]
    arc = 0.4 * np.column_stack([np.cos(t), np.sin(t)])
    assert "the path bends" in homogeneous(t, noisy(arc, 0), ("x", "y")).warnings[0]
    with pytest.raises(ValueError, match="x: must hold a motion, got one that stands still"):
        homogeneous(t, np.ones((len(t), 2)), ("x", "y"))
    t = np.arange(60) / 30
    swings = np.column_stack([0.1 * np.sin(4 * t), 0.2 * np.cos(6 * t)])
    assert homogeneous(t, noisy(swings, 0), ("x", "y")) is None


def placed(pixels, length=None, up=None, corners=None, size=(1280, 720)):
    """Where pixels are in the plane."""
    marks, places, _ = plane.four_places(length, up, corners, size)
    return plane.carry(plane.homography_of(marks, places), np.array(pixels))


def test_two_marks_and_a_length():
    marks = [[100.0, 600], [100, 600 - SCALE], [100 + SCALE, 600]]
    np.testing.assert_allclose(placed(marks, STICK), [[0, 0], [0, 1], [1, 0]], atol=1e-9)
    # Without a length places are pixels from the lower left.
    np.testing.assert_allclose(placed([[3.0, 719 - 4]]), [[3, 4]], atol=1e-9)
    for up in ((1, 0), (10, 5, 30, 5)):  # a camera that lies on its side
        np.testing.assert_allclose(placed([[2.0, 3]], (0, 0, 10, 0, 10), up), [[3, 2]], atol=1e-9)


def test_four_marks_of_a_rectangle_that_is_seen_askew():
    askew = np.array([[200.0, 20, 300], [-10, -180, 600], [0.05, 0.02, 1]])
    places = np.array([[0.0, 0], [2, 0], [2, 1], [0, 1], [0.7, 0.4]])
    marks = plane.carry(askew, places)
    np.testing.assert_allclose(placed(marks, corners=(*marks[:4].ravel(), 2, 1)), places, atol=1e-9)
    leans = plane.carry(askew, np.array([[1.0, 0.5], [1.001, 0.501]]))  # at 45 degrees
    turned = placed(marks, corners=(*marks[:4].ravel(), 2, 1), up=np.diff(leans, axis=0)[0])
    np.testing.assert_allclose(turned[1], [np.sqrt(2), np.sqrt(2)], atol=5e-3)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"length": (1, 2, 3, 4)}, "length: must be"),
        ({"length": (1, 2, 1, 2, 1)}, "length: must be two marks more than 2 pixels apart"),
        ({"up": (0, 0)}, "up: must be a direction"),
        ({"corners": (0, 0, 1, 0, 1, 9, 0, 9, 1, 1)}, "corners: must be lower left"),
        ({"corners": (0, 9, 9, 9, 9, 0, 0, 0, 1, 0)}, "corners: must be .* two sides above 0"),
        ({"length": (4000, 9, 4000, 5, 1)}, "length: marks must lie in the picture, .*4000"),
        ({"corners": (0, 90, 90, 90, 90, 0, 0, -1, 1, 1)}, "corners: marks must lie in the"),
        ({"corners": 3}, "corners: must be 10 finite numbers"),
        ({"length": STICK, "corners": 3}, "corners: must not be given with length"),
        ({"length": STICK, "length_error": 2}, "length_error: must be a share"),
        ({"length_error": 0.02}, "length_error: must be given with length or corners"),
        ({"fps": 0}, "fps: must be positive"),
        ({"length": STICK}, "fps: must be given"),
        ({}, "throw.mp4 must hold the 60 frames that its header"),
    ],
)
def test_what_is_no_scale_or_was_cut_off_is_refused(monkeypatch, given, message):
    rate = 0.0 if given == {"length": STICK} else 30.0
    filmed(monkeypatch, pixels_of(flight()[1]), rate, None if given else 60)
    with pytest.raises(ValueError, match=message):
        vl.discover_from_video("throw.mp4", **given)


def test_the_error_of_the_length_is_that_of_g_whichever_mark_is_first(monkeypatch):
    filmed(monkeypatch, pixels_of(noisy(flight()[1], 0)))
    one, other = (
        vl.discover_from_video("throw.mp4", (*STICK[k : k + 2], *STICK[2 - k : 4 - k], 0.5)).g.error
        for k in (0, 2)
    )
    assert one == pytest.approx(other, rel=1e-6)
    monkeypatch.setattr(plane, "TILTED", 0.0)
    found = vl.discover_from_video("throw.mp4", STICK, length_error=0.03)
    assert found.status == "ok"
    error = found.rig.cameras[0].scale_error
    assert error == pytest.approx(np.hypot(0.03, np.sqrt(2) / (SCALE / 2)))
    assert found.g.error == pytest.approx(error * 9.81, rel=0.1)
    assert found.period is None
    np.testing.assert_allclose(found.rig.cameras[0].project(found.x), found.tracks[0])
    np.testing.assert_allclose(found.fitted, found.x, atol=0.01)


@pytest.mark.parametrize("order", ["auto", 2])
def test_a_spring_on_a_line_has_a_period(monkeypatch, order):
    t = np.arange(72) / 24
    x = (0.2 * np.exp(-0.1 * t) * np.cos(5.3 * t))[:, None] * [0.03, 1]
    filmed(monkeypatch, pixels_of(noisy(x, 0)), fps=24.0)
    found = vl.discover_from_video("spring.mp4", STICK, order=order)
    said = found.discovery.physics()
    law = found.discovery.system  # along a line: x' = vx, x'' = rest, spring, drag
    assert (found.status, law.support.sum(), law.states) == ("ok", 1 + 3, 2)
    assert abs(found.period.value - 2 * np.pi / 5.3) < 3 * found.period.error < 0.003
    assert abs(said["damping"].value - 2 * 0.1) < 3 * said["damping"].error < 0.03


def test_what_a_slope_bears_has_no_g(monkeypatch, tmp_path):
    rolled = 1.5 * np.outer(np.arange(30) / 30, (1, 1)) ** 2 @ [[0.8, 0], [0, -0.6]]
    filmed(monkeypatch, pixels_of(noisy(rolled, 0)))
    found = vl.discover_from_video("slope.mp4", STICK)
    assert (found.status, found.g) == ("ok", None)
    found.discovery.save(tmp_path / "slope.json")
    for told in (found, vl.Discovery.load(tmp_path / "slope.json").physics()):
        assert ("pull = " in str(told), "g = " in str(told)) == (True, False)
    assert str(told).endswith("what bears it may rub: no energy")
    assert max(len(repr(one)) for one in (found, found.discovery)) < 60
    assert "53 degrees off the vertical: something bears it" in found.rig.note
    for start in ((0, 1), (1.2, 4)):  # in whole pixels: straight down, and 10 a frame
        filmed(monkeypatch, pixels_of(flight(start)[1]).round())
        found = vl.discover_from_video("drop.mp4", STICK)
        assert abs(found.g.value - 9.81) < 3 * found.g.error < 3
        assert found.status == "ok"


@pytest.mark.parametrize(("samples", "drag"), [(90, 0.1), (150, 0.05)])
def test_a_swing_is_on_a_circle(monkeypatch, samples, drag):
    x = swung(np.arange(samples) / 30, 0.5, drag) + [0, 0.46]
    filmed(monkeypatch, pixels_of(noisy(x, 0)))
    found = vl.discover_from_video("swing.mp4", (600, 430, 600, 305, 0.5))
    law = found.discovery
    assert law.status == "ok"
    assert str(found).startswith("on a circle of radius ")
    assert f"; {found.g}" in str(found)
    told = [law.terms[row] for row in np.flatnonzero(law.system.support[:, 1])]
    assert told == ["vangle", "sin(angle)"]
    assert abs(found.g.value - 9.81) < 2 * found.g.error < 0.6
    assert float(found.period.value) == pytest.approx(2 * np.pi / np.sqrt(9.81 / 0.5), rel=2e-3)
    np.testing.assert_allclose(found.fitted, found.x, atol=2e-3)
    small = swung(np.arange(130) / 30, 0.5, 0, 0.2) + [0, 0.46]
    filmed(monkeypatch, pixels_of(noisy(small, 0, 1e-3)))  # its arc is 10 mm high
    found = vl.discover_from_video("small.mp4", (600, 430, 600, 305, 0.5))
    assert abs(found.g.value - 9.81) < 3 * found.g.error < 2
    assert (found.status, found.swing is None) == ("ok", False)
    filmed(monkeypatch, pixels_of(noisy(x, 0))[::-1])
    found = vl.discover_from_video("backwards.mp4", (600, 430, 600, 305, 0.5))
    assert any("the film may run backwards" in doubt for doubt in found.warnings)


@pytest.mark.parametrize("kind", ["swing", "fall"])
def test_what_is_held_before_it_moves_does_not_count(monkeypatch, kind):
    t = np.arange(100) / 30
    moved = swung(t, 0.5, 0.1) if kind == "swing" else flight((0, 0), samples=20)[1]
    filmed(monkeypatch, pixels_of(noisy(np.concatenate([moved[:1].repeat(25, axis=0), moved]), 0)))
    found = vl.discover_from_video("held.mp4", STICK)
    assert found.status == "ok"
    assert abs(found.g.value - 9.81) < 3 * found.g.error < 2
    assert re.search(r"it rests until frame 2[4-7]: counted from (2[6-9]|3\d) on", found.rig.note)
    every = vl.discover_from_video("held.mp4", STICK, frames=(0, len(moved) + 24)).x
    assert np.isfinite(every).all()
    grown = 0.002 * np.exp(1.5 * t)[:, None] * [1, 0]  # neither held nor let go as the film begins
    for path in (moved, grown):
        filmed(monkeypatch, pixels_of(noisy(path, 0)))
        assert "rests" not in vl.discover_from_video("free.mp4", STICK).rig.note


def test_a_wheel_turns_by_the_law_of_its_angle(monkeypatch):
    t = np.arange(120) / 30
    angles = {"1": 6 * t - 0.6 * t**2, "vangle": -20 * np.exp(-0.3 * t), "": -6 * t}
    for term, angle in angles.items():
        turned = 0.4 * np.column_stack([np.cos(angle), np.sin(angle)])
        filmed(monkeypatch, pixels_of(noisy(turned, 0)))
        found = vl.discover_from_video("wheel.mp4", STICK)
        law = found.discovery
        told = [law.terms[row] for row in np.flatnonzero(law.system.support[:, 1])]
        assert (found.status, found.g, "".join(told)) == ("ok", None, term)
        assert np.sign(law.curve(found.t)[0, 1]) == np.sign(angle[1] - angle[0])
    turned = 0.4 * np.column_stack([np.cos(60 * t), np.sin(60 * t)])  # a third of a turn a frame
    filmed(monkeypatch, pixels_of(noisy(turned, 0)))
    doubts = vl.discover_from_video("wheel.mp4", STICK).warnings
    assert any("only 3.1 samples per turn" in doubt for doubt in doubts)


def test_a_camera_that_looks_askew_by_little_is_no_reason_to_doubt(monkeypatch):
    pixels = pixels_of(noisy(flight()[1], 0))
    (u, v), away = pixels.mean(axis=0), pixels - pixels.mean(axis=0)
    for degrees, status in ((1.5, "ok"), (15, "suspect")):
        filmed(monkeypatch, pixels + np.deg2rad(degrees) / 960 * away[:, :1] * away)
        found = vl.discover_from_video("throw.mp4", (u, v + 125, u, v - 125, 1.0))
        assert found.status == status
        assert abs(found.g.value - 9.81) < 3 * found.g.error < 1
    assert found.warnings[0].startswith("frames: all were taken to be of one motion")


def test_what_bounces_and_what_flies_from_hand_to_hand_counts_in_between(monkeypatch):
    t, lap = np.arange(60) / 30, np.sqrt(2 / 9.81)  # for so long it falls from a metre
    height = 1 - 9.81 * ((t + lap) % (2 * lap) - lap) ** 2 / 2
    x, grows = flight()[1], (np.linspace(0, 1, 16)[:, None] ** 3 - 1) / 6  # for half a second
    hands = (x[0] + grows[:-1] * (1.5, 5), x, x[-1] - grows[-2::-1] * (1.5, 5 - 9.81 * 1.1))
    paths = {
        "turns sharply at frames 14, 41, as where it bounces": np.column_stack([0.4 * t, height]),
        r"flies freely from frame 1[5-7] to 4[6-8], which": np.concatenate(hands),
    }
    for told, path in paths.items():
        filmed(monkeypatch, pixels_of(noisy(path, 0)))
        found = vl.discover_from_video("ball.mp4", STICK)
        assert re.search(f"it {told}", found.rig.note)
        assert (found.status, abs(found.g.value - 9.81) < 2 * found.g.error) == ("ok", True)
    # Without a length, nothing tells what falls from what a hand turns round.
    assert vl.discover_from_video("ball.mp4").status == "suspect"
    told = vl.discover_from_video("ball.mp4", (*STICK[:4], 0.7)).warnings[0]
    assert re.match(r"length: if it flies freely .*: the marks may be (0.7|1.4)", told)


def test_a_wrong_length_and_a_wrong_vertical_are_told(monkeypatch):
    filmed(monkeypatch, pixels_of(noisy(flight()[1], 0)))
    found = vl.discover_from_video("throw.mp4", (*STICK[:4], 0.7), up=(0.3, -1))
    scale, vertical = found.warnings
    assert "the marks may be 0.714 times as far apart as is given" in scale
    assert "degrees off the vertical that was given" in vertical
    unsure = vl.discover_from_video("throw.mp4", STICK, length_error=0.4)
    assert abs(unsure.g.value - 9.81) < 0.4 * 9.81 < 1.1 * unsure.g.error
    filmed(monkeypatch, pixels_of(noisy(flight()[1], 0))[:, ::-1])  # held on its side
    stick = (*np.reshape(STICK[:4], (2, 2))[:, ::-1].ravel(), STICK[4])
    (vertical,) = vl.discover_from_video("throw.mp4", stick).warnings
    assert "degrees off the vertical of the picture" in vertical


def test_a_table_of_the_track_and_the_frames_that_count(tmp_path, capsys):
    x = flight()[1]
    x = noisy(np.repeat(x, [25, *[1] * (len(x) - 2), 20], axis=0), 0)
    rows = np.column_stack([100 + np.arange(len(x)), pixels_of(x)])
    table, law = tmp_path / "throw.csv", tmp_path / "law"
    np.savetxt(table, rows, "%.4f", ",", header="frame,u,v", comments="")
    found = vl.discover_from_video(table, STICK, fps=30)
    assert (found.status, abs(found.g.value - 9.81) < 2 * found.g.error) == ("ok", True)
    given = ["--length", ",".join(map(str, STICK))]
    command = ["discover", "--tracks", str(table), "--fps", "30", *given, "--out", str(law)]
    assert main([*command, "--frames", "124,157"]) == 0
    data = json.loads((law / "result.json").read_text("utf-8"))
    assert abs(data["g"]["value"] - 9.81) < 2 * data["g"]["error"] < 0.9
    assert "places in m, times in s" in data["frame"]
    # What a run leaves is read again, and not written over.
    read = ["discover", "--tracks", str(law / "tracks.csv"), *given, "--out"]
    assert main([*read, str(law)]) == 2
    assert "out: must be another folder than that of what is read" in capsys.readouterr().err
    assert main([*read, str(tmp_path / "again")]) == 0
    again = json.loads((tmp_path / "again" / "result.json").read_text("utf-8"))
    assert again["g"] == pytest.approx(data["g"], rel=1e-6)
    far = vl.discover_from_video(table, (0, 3000, 0, 2750, 1), fps=30, frames=(124, 157)).g
    assert abs(far.value - 9.81) < 2 * far.error < 9.81
    capsys.readouterr()
    for frames in ("125,9", "25,58", "125,1000", "124.5,157", "125,129"):
        assert main([*command, "--frames", frames]) == 2
        assert "frames: must be the first and the last that count" in capsys.readouterr().err
    for wrong in ({"hint": vl.Hint(frame=3, box=(1, 1, 9, 9))}, {"detector": "learned"}):
        with pytest.raises(ValueError, match="detector: must be given with a film, got throw.csv"):
            vl.discover_from_video(table, STICK, **wrong)
    table.write_text("u1,v1,u2,v2\n1,2,3,4\n5,6,7,9\n")
    with pytest.raises(
        ValueError, match="path: throw.csv must hold the track of one camera, .* 2 cam"
    ):
        vl.discover_from_video(table, STICK, fps=30)


def test_a_path_that_recedes_looks_like_drag(monkeypatch):
    filmed(monkeypatch, pixels_of(noisy(flight(drag=0.6)[1], 0)))
    (doubt,) = vl.discover_from_video("throw.mp4", STICK).warnings
    assert "is that of a path that recedes as well" in doubt
    marks = pixels_of(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])).ravel()
    assert vl.discover_from_video("throw.mp4", corners=(*marks, 1, 1)).status == "ok"


def test_the_command_writes_g_with_its_error(monkeypatch, tmp_path, capsys):
    film = tmp_path / "throw.avi"
    frames = (np.full((720, 1280, 3), 90, np.uint8) for _ in range(2))
    vl.write_video(film, frames, fps=30, codec="MJPG")
    asked = filmed(monkeypatch, pixels_of(noisy(flight()[1], 0)))
    length = ",".join(map(str, STICK))
    given = ["discover", str(film), "--length", length, "--out", str(tmp_path / "law")]
    assert main([*given, "--hint", "3,100,90,20,30"]) == 0
    assert asked == [(film, "auto", vl.Hint(frame=3, box=(100, 90, 20, 30)))]
    assert "status: ok" in capsys.readouterr().out
    data = json.loads((tmp_path / "law" / "result.json").read_text("utf-8"))
    assert abs(data["g"]["value"] - 9.81) < 2 * data["g"]["error"] < 0.8
    assert data["period"] is None
    assert "<img" in (tmp_path / "law" / "report.html").read_text("utf-8")
    assert main(given) == 0  # an earlier report is replaced
    assert main([*given, "--hint", "3.7,100,90,20,30"]) == 2
    assert "frame: must be an integer of at least 0, got 3.7" in capsys.readouterr().err


def test_the_command_draws_the_track_of_what_has_no_law(monkeypatch, tmp_path, capsys):
    film = vl.write_video(tmp_path / "a.mov", np.full((5, 90, 120, 3), 90, np.uint8))
    filmed(monkeypatch, pixels_of(flight(samples=5)[1]))
    assert main(["discover", str(film), "--out", str(tmp_path / "law")]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert "at least 6 places, got 5; likely causes, in this order: the tracker" in said
    assert "the rig" not in said
    assert (tmp_path / "law" / "report.html").is_file()


def test_an_interruption_keeps_the_track(monkeypatch, tmp_path, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    film = vl.write_video(tmp_path / "a.mov", np.full((34, 90, 120, 3), 90, np.uint8))
    filmed(monkeypatch, pixels_of(flight()[1]))
    monkeypatch.setattr(pipeline, "simplest", interrupted)
    folder = tmp_path / "law"
    assert main(["discover", str(film), "--out", str(folder)]) == 130
    kept = f"stopped; the tracks are kept beside {folder / 'report.html'}"
    assert capsys.readouterr().err.splitlines()[-1] == kept
    assert len((folder / "tracks.csv").read_text().splitlines()) == 1 + 34


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["b.mov"], "rig: must be given for several tracks or two videos, got"),
        (["--targets", "2"], "targets: must be given with several videos, got 2"),
        (["--up", "-1,-1", "--rig", "rig.toml"], "up: must be given with one camera alone, got"),
    ],
)
def test_what_does_not_go_together_is_refused(tmp_path, monkeypatch, capsys, given, message):
    monkeypatch.chdir(tmp_path)
    assert main(["rig-template", "--output", "rig.toml"]) == 0
    assert main(["discover", "a.mov", *given]) == 2
    assert message in capsys.readouterr().err


def test_the_toss():
    found = vl.discover_from_video(real("toss"), (272.2, 446.1, 273.2, 47.4, 1.0), fps=15.15)
    assert 9.6 < found.g.value < 10.4
    assert abs(found.g.value - 9.9) < 2 * found.g.error
    assert found.discovery.equations().startswith("x'' = 0\ny'' = - (10.")
    assert found.status == "ok"
    assert "of laws that one flight cannot tell apart" in str(found)
