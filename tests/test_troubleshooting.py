"""Every row of the guide's table of troubles: its trouble is made, and its message appears."""

import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from helpers import trajectory
from phones import write_at
from scipy.integrate import solve_ivp

import vidsindy_lite as vl
from vidsindy_lite import study
from vidsindy_lite.companion.report import check_folder_is_free
from vidsindy_lite.storage import PACKAGE
from vidsindy_lite.study import add_noise
from vidsindy_lite.study.corruption import kicked_path
from vidsindy_lite.vision import render

GUIDE = (PACKAGE.parent / "docs" / "guide.md").read_text(encoding="utf-8")
pytestmark = pytest.mark.usefixtures("tracked_once")
TABLE = GUIDE.split("## When something is wrong")[1].split("\n## ")[0]
MESSAGES = re.findall(r"^\| `(.+?)` \|", TABLE, re.MULTILINE)
SIZE, FRAMES = (96, 96), 120


class Studio:
    """Small videos of a random motion, and what is said when something about them is changed."""

    def __init__(self, folder):
        self.folder = folder
        x = trajectory(np.random.default_rng(4), FRAMES)
        self.rig = vl.Rig.around(x, SIZE)
        self.tracks = [camera.project(x) for camera in self.rig.cameras]
        self.paths = [self.video(f"{i}.mkv", track) for i, track in enumerate(self.tracks)]

    def video(self, name, track):
        scene = vl.Scene(background="plain", size=8, image_size=SIZE)
        return vl.write_video(self.folder / name, render(track, scene))

    def says(self, paths=None, cameras=None, **options):
        """The error or the warnings of what is observed."""
        rig = vl.Rig(cameras) if cameras else self.rig
        return told(vl.observe, paths or self.paths, rig, **options)

    def without_last(self, path):
        return self.says([*self.paths[:2], path])


def told(function, *arguments, **options):
    try:
        return "\n".join(function(*arguments, **options).warnings)
    except (ValueError, FileNotFoundError) as error:
        return str(error)


def unreadable(studio):
    path = studio.folder / "text.mkv"
    path.write_text("no video " * 100)
    return studio.without_last(path)


def damaged(studio):
    path = studio.folder / "damaged.mkv"
    content = studio.paths[2].read_bytes()
    path.write_bytes(content[: len(content) // 2])
    return studio.without_last(path)


def still(studio):
    return studio.without_last(studio.video("still.mkv", np.full((FRAMES, 2), 48.0)))


def other_size(studio):
    *others, last = studio.rig.cameras
    return studio.says(cameras=[*others, replace(last, image_size=(96, 64))])


def uncalibrated(studio):
    return studio.says(cameras=[replace(c, scale=None, angle=None) for c in studio.rig.cameras])


def without_positions(studio):
    first, *others = studio.rig.cameras
    return studio.says(cameras=[first, *(replace(c, position=None) for c in others)])


def nothing_in_common(studio):
    tracks = [np.random.default_rng(i).uniform(0, 95, (FRAMES, 2)) for i in range(3)]
    return told(vl.learn_cameras, tracks, studio.rig.uncalibrated())


def wrong_position(studio):
    first, *others = studio.rig.cameras
    moved = first.position + 20 * first.scale * first.rows[0]
    return studio.says(cameras=[replace(first, position=moved), *others])


def repeating(studio):
    phase = 2 * np.pi * np.arange(200) / 50.3
    x = np.column_stack((np.cos(phase), np.sin(phase), 0.5 * np.cos(phase + 1)))
    rig = vl.Rig.around(x)
    tracks = [camera.project(x) for camera in rig.cameras]
    tracks[1] = tracks[1][15:]
    return "\n".join(vl.learn_lags(tracks, rig).warnings)


def pendulum(degree):
    t = np.linspace(0, 40, 800)
    swing = solve_ivp(
        lambda _, x: [x[1], -np.sin(3 * x[0])], (0, 40), [0.9, 0], t_eval=t, rtol=1e-9
    )
    x = add_noise(swing.y.T, 0.005, np.random.default_rng(0))
    return told(vl.discover, t, x, degree=degree)


def oscillation(step, count, noise):
    t = step * np.arange(count)
    x = np.stack([np.sin(t), np.cos(t)], axis=1)
    return told(vl.discover, t, add_noise(x, noise, np.random.default_rng(0)), degree=1)


def circling(studio):
    t = np.linspace(0, 12, 400)
    x = np.stack([np.cos(3 * t), np.sin(3 * t)], axis=1)
    return told(vl.discover, t, x, order=2, degree=1)


def kicked(studio):
    """A spring that is kicked at random, for five turns."""
    law = vl.PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1, "y": -0.1}}, degree=3)
    rng, t = np.random.default_rng(3), np.linspace(0, 10 * np.pi, 500)
    x = kicked_path(law, t, (1.0, 0.0), (0.0, 0.2), rng)[:, :1]
    return told(vl.discover, t, x + 0.01 * x.std() * rng.standard_normal(x.shape), order=2)


def undecided(studio):
    """A weak damping that may be in either of the two equations."""
    law = vl.PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1, "y": -0.03}}, degree=2)
    t = np.linspace(0, 20, 300)
    x = law.simulate(t, (1, 0)) + 0.1 * np.random.default_rng(4).normal(size=(300, 2))
    return told(vl.discover, t, x, degree=2)


def contested(studio):
    """A damping of a ten-thousandth, in data without noise."""
    law = vl.PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1, "y": -1e-4}}, degree=2)
    t = np.linspace(0, 30, 600)
    return told(vl.discover, t, law.simulate(t, (1, 0)), degree=2)


def unlike(studio):
    t, rng = np.linspace(0, 30, 200), np.random.default_rng(0)
    pair = [np.stack([np.cos(w * t), -w * np.sin(w * t)], axis=1) for w in (1, 1.02)]
    return told(vl.discover, [(t, add_noise(x, 0.05, rng)) for x in pair], degree=1, order=1)


def jumping(studio):
    t = np.linspace(0, 20, 100)
    x = np.column_stack((np.cos(t), -np.sin(t)))
    x[50, 1] = 1e6
    return "\n".join(vl.discover(t, x, degree=1, order=1).warnings)


def thrown(studio):
    """From a hand, at a length that is wrong by a third."""
    t, table = np.arange(-12, 22)[:, None] / 30, studio.folder / "throw.csv"
    x = np.where(t < 0, ((1 + t / 0.4) ** 3 - 1) * 0.4 / 3, t) * [1.5, 5]
    x -= np.maximum(t, 0) ** 2 * [0, 9.81 / 2]
    rows = x * [200, -200] + np.random.default_rng(0).normal([100, 400], 0.2, x.shape)
    np.savetxt(table, rows, "%.3f", ",", header="u,v", comments="")
    return told(vl.discover_from_video, table, (0, 300, 0, 100, 1.3), fps=30)


def occupied(studio):
    (studio.folder / "occupied").mkdir(exist_ok=True)
    (studio.folder / "occupied" / "rig.toml").write_text("")
    return told(check_folder_is_free, studio.folder / "occupied")


def swapped(studio):
    """Tracks in another order than the cameras."""
    t, x = study.SYSTEMS["Lorenz"].trajectory(200)
    rig = vl.Rig.around(x)
    tracks = [camera.project(x) for camera in rig.cameras]
    return vl.observe_tracks([tracks[0], tracks[2], tracks[1]], rig, t).warnings[0]


def dropping(studio):
    """Even times for a video of which a frame was dropped."""
    kept = np.delete(np.arange(FRAMES), 40)
    frames = [frame for k, frame in enumerate(vl.read_video(studio.paths[0])) if k != 40]
    path = write_at(studio.folder / "dropped.mov", kept / 25, frames)
    return studio.says([path, *studio.paths[1:]], t=np.arange(len(kept)) / 25)


def named_by_times(studio):
    folder = studio.folder / "images"
    folder.mkdir()
    for milliseconds in (33, 67, 100):
        cv2.imwrite(str(folder / f"{milliseconds}.png"), np.zeros((*SIZE, 3), np.uint8))
    return studio.without_last(folder)


def track_file(studio, text):
    path = studio.folder / "track.txt"
    path.write_text(text)
    return told(vl.discover_from_tracks, [path], studio.rig, fps=30)


TROUBLES = {
    "no such video file": lambda studio: studio.without_last(studio.folder / "none.mkv"),
    "must be a video file that PyAV can read": unreadable,
    "frames that its header states": damaged,
    "must show one moving target": still,
    "must have the image size of its camera": other_size,
    "must fit the times that the first video's file states": dropping,
    "the numbers of images must count frames": named_by_times,
    "must hold one target": lambda studio: track_file(
        studio, "pt1_cam1_X,pt1_cam1_Y,pt2_cam1_X,pt2_cam1_Y\n1,2,3,4\n"
    ),
    "got x and y of Tracker or Kinovea with another origin": lambda studio: track_file(
        studio, "mass_A\nt,x,y\n0,-1.5,0.5\n1,-1.4,0.3\n"
    ),
    "must be one per camera of the rig": lambda studio: studio.says(studio.paths[:2]),
    "at least one camera must be calibrated": uncalibrated,
    "the positions of two cameras with independent normals must be given": without_positions,
    "the target's motion must determine": nothing_in_common,
    "the rig does not agree with the tracks": wrong_position,
    "the lags of the videos cannot be told": repeating,
    "the lags that are given differ from those of the tracks": lambda s: s.says(lags=(0, 0.2, 0)),
    "must make the views agree": lambda studio: studio.says(lags=(0, 5, 0)),
    "the curve misses the data": lambda studio: pendulum(degree=1),
    "another law may as well be true": undecided,
    "has other coefficients than the rest": unlike,
    "is settled by how large an error is tolerated": contested,
    "a sample lies far from those before and after it": jumping,
    "depend on each other on these data": circling,
    "turns of the motion": lambda studio: oscillation(0.01, 200, 0.05),
    "sample faster": lambda studio: oscillation(1.3, 200, 0.02),
    "from a drive or a force that nobody named": kicked,
    "must hold no files of the names": occupied,
    "explains it": swapped,
    "is not the 9.81 of what flies or swings freely": thrown,
    "were taken to be of one motion": thrown,
}


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    return Studio(tmp_path_factory.mktemp("studio"))


@pytest.mark.parametrize("message", MESSAGES)
def test_the_message_appears(studio, message):
    assert message in TROUBLES[message](studio)


def test_every_trouble_is_in_the_table():
    assert set(MESSAGES) == set(TROUBLES)
    assert len(set(MESSAGES)) == len(MESSAGES)


def test_without_trouble_no_message_appears(studio):
    text = studio.says()
    assert not any(message in text for message in MESSAGES if "rig" in message or "lag" in message)
