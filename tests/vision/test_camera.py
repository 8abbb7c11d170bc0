"""Which witness of a camera's motion is asked first, and which is believed."""

import cv2
import numpy as np
import pytest
from footage import Phone, render_phone

from vidsindy_lite.vision import camera
from vidsindy_lite.vision.background import sample_frames
from vidsindy_lite.vision.camera import explains, rests, trembling
from vidsindy_lite.vision.steadying import at_rest, carry
from vidsindy_lite.vision.video import Reel, write_video

SMALL = 160, 120
N = 21
EVERY = np.ones(N, bool)


def ground(kind):
    """A wall that a lamp lights, clouds, or nothing."""
    v, u = np.mgrid[: SMALL[1] + 40, : SMALL[0] + 40].astype(np.float32)
    if kind == "lamp":
        return 60 + 120 * np.exp(-((u - 70) ** 2 + (v - 110) ** 2) / 2 / 60**2)
    cloud = cv2.GaussianBlur(np.random.default_rng(1).normal(size=u.shape), (0, 0), 6)
    return 130 + {"clouds": 20, "nothing": 0}[kind] * (cloud / cloud.std()).astype(np.float32)


def samples_of(kind, shifts, size=30, noise=1.0):
    """A red ball that goes round, seen by a camera that is shifted; and where the ball is."""
    rng = np.random.default_rng(0)
    angle = 2 * np.pi * np.arange(len(shifts)) / 17
    places = np.array([80, 60]) + np.array([45, 25]) * np.column_stack(
        [np.cos(angle), np.sin(angle)]
    )
    frames = []
    for shift, place in zip(shifts, places, strict=True):
        move = np.float32([[1, 0, shift[0] - 20], [0, 1, shift[1] - 20]])
        view = cv2.warpAffine(ground(kind), move, SMALL)[..., None].repeat(3, axis=2)
        at = np.rint(16 * (place + shift)).astype(int)
        cv2.circle(view, at.tolist(), 8 * size, (30, 30, 200), -1, cv2.LINE_AA, 4)
        frames.append(np.clip(np.rint(view + rng.normal(0, noise, view.shape)), 0, 255))
    return np.array(frames, np.uint8), places


def shifted(shifts):
    """The maps of the frames into the first."""
    maps = np.tile(np.eye(3), (len(shifts), 1, 1))
    maps[:, :2, 2] = -np.asarray(shifts)
    return maps


def shaken(pixels):
    rng = np.random.default_rng(2)
    shifts = rng.uniform(-pixels, pixels, (N, 2))
    shifts[0] = 0
    return shifts


@pytest.mark.parametrize("pixels", [2, 8])
@pytest.mark.parametrize("kind", ["lamp", "clouds"])
def test_a_true_motion_explains_the_frames(kind, pixels):
    shifts = shaken(pixels)
    frames, _ = samples_of(kind, shifts)
    assert explains(frames, shifted(shifts), EVERY)
    assert not explains(frames, shifted(-shifts), EVERY)
    assert not rests(frames)


@pytest.mark.parametrize("kind", ["lamp", "clouds", "nothing"])
def test_the_motion_of_the_target_is_not_the_cameras(kind):
    # The plate that it makes shows the target sharp, but all else blurred.
    frames, places = samples_of(kind, np.zeros((N, 2)), 30)
    assert not explains(frames, shifted(places - places[0]), EVERY)


@pytest.mark.parametrize(("kind", "told"), [("lamp", True), ("clouds", True), ("nothing", False)])
def test_rest_is_told_where_there_is_something_to_see(kind, told):
    frames, _ = samples_of(kind, np.zeros((N, 2)))
    assert rests(frames) == told
    assert not explains(frames, at_rest(N).maps, EVERY)


def test_samples_of_which_the_motion_is_not_known_say_nothing():
    shifts = shaken(5)
    frames, _ = samples_of("clouds", shifts)
    maps, known = shifted(shifts), EVERY.copy()
    known[3:9] = False
    maps[3:9] = np.diag([5.0, 5.0, 1.0])
    assert explains(frames, maps, known)


SKY = Phone("sky", 40, noise=3, image_size=(320, 240), frames=60)


def film(folder, seed, **change):
    """The film, the target in the first frame's pixels and in each one's own."""
    phone = Phone(**(vars(SKY) | change))
    frames, here, there = zip(*render_phone(phone, seed), strict=True)
    path = write_video(folder / "clip.mkv", iter(frames))
    return path, np.array(here), np.array(there)


def by_the_plate(path):
    return trembling(Reel(path), sample_frames(Reel(path)))


def test_all_frames_together_tell_how_a_camera_trembles_before_a_sky(tmp_path):
    path, here, there = film(tmp_path, 2, camera="trembling")
    motion = by_the_plate(path)
    known = np.isfinite(motion.errors)
    assert known.mean() > 0.9
    moved = np.linalg.norm(there - here, axis=1)
    error = np.linalg.norm(carry(motion.maps, there) - here, axis=1)[known]
    assert np.median(error) < min(0.4, 0.4 * np.median(moved))
    told = np.sqrt(2 * np.mean(motion.errors[known] ** 2))
    assert 0.6 < np.sqrt(np.mean(error**2)) / told < 1.4
    np.testing.assert_allclose(motion.maps[0], np.eye(3), atol=1e-9)
    assert motion.errors[0] == 0


@pytest.mark.parametrize("change", [{"size": 90}, {"person": True, "leaves": True}])
def test_nothing_else_is_taken_for_a_motion_of_the_camera(tmp_path, monkeypatch, change):
    path, *_ = film(tmp_path, 1, **change)
    assert by_the_plate(path) is None

    def with_room(*given):
        alike, error = halves(*given)
        return alike + 0.1, error

    halves = camera._halves
    monkeypatch.setattr(camera, "_halves", with_room)
    assert by_the_plate(path) is None


def test_what_moves_too_far_is_not_told(tmp_path):
    assert by_the_plate(film(tmp_path, 1, camera="held")[0]) is None
