"""Targets of several colours: the middle of the whole, however it turns."""

import cv2
import numpy as np
import pytest

from vidsindy_lite import track, write_video
from vidsindy_lite.vision.refining import whole
from vidsindy_lite.vision.rendering import BACKGROUNDS

SIZE = 200, 150
FRAMES = 60
HALVES = {
    "red and white": ((30, 30, 210), (240, 240, 240)),
    "black and white": ((20, 20, 25), (235, 235, 235)),
    "one is faint": ((250, 250, 20), (40, 50, 200)),
}


def places():
    s = 2 * np.pi * np.arange(FRAMES) / FRAMES
    return np.column_stack([100 + 60 * np.sin(2 * s), 75 + 40 * np.sin(3 * s + 1)])


def beach_ball(path, radius, rate, colours, flicker):
    """A ball of two halves that turns by `rate` radians a frame, before bricks."""
    rng = np.random.default_rng(1)
    ground = cv2.GaussianBlur(BACKGROUNDS["bricks"](rng, SIZE), (0, 0), 1)

    def frames():
        for i, place in enumerate(places()):
            image = ground.copy()
            at, turn = np.rint(16 * place).astype(int).tolist(), np.rad2deg(rate * i)
            for colour, first in zip(colours, (0, 180), strict=True):
                half = cv2.ellipse2Poly((0, 0), (1000, 1000), 0, 0, 180, 4) / 1000 * radius
                angle = np.deg2rad(turn + first)
                spin = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
                corners = np.rint(16 * (half @ spin) + at).astype(np.int32)
                cv2.fillConvexPoly(image, corners, colour, cv2.LINE_AA, 4)
            noisy = (1 + flicker * np.sin(1.7 * i)) * image + rng.normal(0, 1.5, image.shape)
            yield np.clip(np.rint(noisy), 0, 255).astype(np.uint8)

    return write_video(path, frames())


@pytest.mark.parametrize("flicker", [0.0, 0.05])
@pytest.mark.parametrize("rate", [0.04, 0.3])
@pytest.mark.parametrize("colours", HALVES)
def test_a_ball_of_two_halves_that_turns(tmp_path, colours, rate, flicker):
    path = beach_ball(tmp_path / "clip.mov", 12, rate, HALVES[colours], flicker)
    error = np.linalg.norm(track(path).pixels - places(), axis=1)
    assert np.isfinite(error).mean() > 0.8
    assert np.nanpercentile(error, 90) < 1


@pytest.mark.parametrize(("level", "plain"), [(60.0, True), (200.0, False)])
def test_the_blur_of_a_target_is_no_other_colour(level, plain):
    # Between the ground of 40 and the target's 100 lies its blur; beyond is something else.
    ground, now = np.full((40, 60, 3), 40, np.float32), np.full((40, 60, 3), 40, np.float32)
    now[10:30, 10:30], now[10:30, 30:45] = 100, level
    own, differs = now[..., 0] == 100, now[..., 0] > 40
    other = differs & ~own & (now[..., 0] > 100)
    found = whole(own, differs, other, now, ground)
    assert found.plain == plain
    assert (found.label == differs).all()
