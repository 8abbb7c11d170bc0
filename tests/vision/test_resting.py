"""Whether a camera's motion explains its frames better than rest does, where the truth is known."""

import cv2
import numpy as np
import pytest

from vidsindy_lite.vision.camera import explains, rests
from vidsindy_lite.vision.steadying import at_rest

SIZE = 160, 120
N = 21
EVERY = np.ones(N, bool)


def ground(kind):
    """A wall that a lamp lights, clouds, or nothing."""
    v, u = np.mgrid[: SIZE[1] + 40, : SIZE[0] + 40].astype(np.float32)
    if kind == "lamp":
        return 60 + 120 * np.exp(-((u - 70) ** 2 + (v - 110) ** 2) / 2 / 60**2)
    cloud = cv2.GaussianBlur(np.random.default_rng(1).normal(size=u.shape), (0, 0), 6)
    return 130 + {"clouds": 20, "nothing": 0}[kind] * (cloud / cloud.std()).astype(np.float32)


def film(kind, shifts, size=30, noise=1.0):
    """A red ball that goes round, seen by a camera that is shifted; and where the ball is."""
    rng = np.random.default_rng(0)
    angle = 2 * np.pi * np.arange(len(shifts)) / 17
    places = np.array([80, 60]) + np.array([45, 25]) * np.column_stack(
        [np.cos(angle), np.sin(angle)]
    )
    frames = []
    for shift, place in zip(shifts, places, strict=True):
        move = np.float32([[1, 0, shift[0] - 20], [0, 1, shift[1] - 20]])
        view = cv2.warpAffine(ground(kind), move, SIZE)[..., None].repeat(3, axis=2)
        at = np.rint(16 * (place + shift)).astype(int)
        cv2.circle(view, at.tolist(), 8 * size, (30, 30, 200), -1, cv2.LINE_AA, 4)
        frames.append(np.clip(np.rint(view + rng.normal(0, noise, view.shape)), 0, 255))
    return np.array(frames, np.uint8), places


def shifted(shifts):
    """The maps of the frames into the first."""
    maps = np.tile(np.eye(3), (len(shifts), 1, 1))
    maps[:, :2, 2] = -np.asarray(shifts)
    return maps


def trembling(pixels):
    rng = np.random.default_rng(2)
    shifts = rng.uniform(-pixels, pixels, (N, 2))
    shifts[0] = 0
    return shifts


@pytest.mark.parametrize("pixels", [2, 8])
@pytest.mark.parametrize("kind", ["lamp", "clouds"])
def test_a_true_motion_explains_the_frames(kind, pixels):
    shifts = trembling(pixels)
    frames, _ = film(kind, shifts)
    assert explains(frames, shifted(shifts), EVERY)
    assert not explains(frames, shifted(-shifts), EVERY)
    assert not rests(frames)


@pytest.mark.parametrize("kind", ["lamp", "clouds", "nothing"])
def test_the_motion_of_the_target_is_not_the_cameras(kind):
    # The plate that it makes shows the target sharp, but all else blurred.
    frames, places = film(kind, np.zeros((N, 2)), 30)
    assert not explains(frames, shifted(places - places[0]), EVERY)


@pytest.mark.parametrize(("kind", "told"), [("lamp", True), ("clouds", True), ("nothing", False)])
def test_rest_is_told_where_there_is_something_to_see(kind, told):
    frames, _ = film(kind, np.zeros((N, 2)))
    assert rests(frames) == told
    assert not explains(frames, at_rest(N).maps, EVERY)


def test_samples_of_which_the_motion_is_not_known_say_nothing():
    shifts = trembling(5)
    frames, _ = film("clouds", shifts)
    maps, known = shifted(shifts), EVERY.copy()
    known[3:9] = False
    maps[3:9] = np.diag([5.0, 5.0, 1.0])
    assert explains(frames, maps, known)
