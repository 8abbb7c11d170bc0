"""What happens to a film while it runs: the light, a push, something larger; none goes unsaid."""

import cv2
import numpy as np
import pytest

from vidsindy_lite import Hint, track, write_video
from vidsindy_lite.vision.rendering import BACKGROUNDS

SIZE = 200, 150
FRAMES = 60
BALL = 6


def places(n=FRAMES):
    s = 2 * np.pi * np.arange(n) / n
    return np.column_stack([100 + 60 * np.sin(2 * s), 75 + 45 * np.sin(3 * s + 1)])


def disc(image, place, radius, colour):
    centre = tuple(np.rint(16 * np.asarray(place)).astype(int).tolist())
    cv2.circle(image, centre, round(16 * radius), colour, -1, cv2.LINE_AA, 4)


def film(path, change, truth=None):
    """A red ball before bricks; `change` of an image and its number happens afterwards."""
    truth = places() if truth is None else truth
    ground = BACKGROUNDS["bricks"](np.random.default_rng(1), SIZE)
    ground = cv2.GaussianBlur(ground, (0, 0), 1)

    def frames():
        for i, place in enumerate(truth):
            image = ground.copy()
            disc(image, place, BALL, (30, 40, 220))
            yield np.clip(change(image, i), 0, 255).astype(np.uint8)

    return write_video(path, frames())


def error_of(found, truth):
    return np.linalg.norm(found.pixels - truth, axis=1)


@pytest.mark.parametrize(
    "light",
    [
        lambda i: 1.0 if i < 30 else 0.8,
        lambda i: 0.8 + 0.15 * np.sin(1.7 * i),
        lambda i: 1 - 0.4 * i / FRAMES,
        lambda i: 1.0 if i < 54 else 0.7,
    ],
    ids=["step", "flicker", "ramp", "late"],
)
def test_changing_light_loses_no_frames(tmp_path, light):
    path = film(tmp_path / "clip.mov", lambda image, i: light(i) * image)
    found = track(path)
    error = error_of(found, places())
    assert np.isfinite(error).mean() >= 0.95
    assert np.nanmax(error) < 0.5
    assert any("the light changes" in doubt for doubt in track(path, "background").warnings)


@pytest.mark.parametrize("when", [4, 15, 30, 45, 55])
@pytest.mark.parametrize("hinted", [False, True])
def test_one_push_of_the_camera_is_taken_out(tmp_path, when, hinted):
    move = np.float32([[1, 0, 5], [0, 1, 3]])

    def pushed(image, i):
        if i < when:
            return image
        return cv2.warpAffine(image, move, SIZE, borderMode=cv2.BORDER_REFLECT)

    hint = Hint(frame=2, box=(*(places()[2] - 7), 15, 15)) if hinted else None
    found = track(film(tmp_path / "clip.mov", pushed), target=hint)
    error = error_of(found, places())
    assert np.isfinite(error).mean() >= 0.95
    assert np.nanmax(error) < 0.5


@pytest.mark.parametrize("radius", [6, 12, 20])
def test_something_else_that_moves_is_not_followed_unsaid(tmp_path, radius):
    def passed(image, i):
        disc(image, (20 + 2.6 * i, 120), radius, (60, 60, 60))
        return image

    found = track(film(tmp_path / "clip.mov", passed))
    error = error_of(found, places())
    right = np.isfinite(error).mean() > 0.8 and np.nanquantile(error, 0.9) < 0.5
    assert right or any("something else moves" in doubt for doubt in found.warnings)


def test_a_target_that_is_lost_in_many_frames_is_told(tmp_path):
    truth = places()
    truth[8:22] = truth[28:48] = np.nan

    def hidden(image, i):
        return image

    ground = [np.where(np.isfinite(truth), truth, -50)]
    found = track(film(tmp_path / "clip.mov", hidden, ground[0]))
    assert np.isnan(found.pixels[32:43]).all()
    assert any("is lost in 34 of 60 frames" in doubt for doubt in found.warnings)
