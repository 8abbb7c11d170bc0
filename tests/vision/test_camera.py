"""Which witness of a camera's motion is asked first, and which is believed."""

import cv2
import numpy as np
import pytest

from vidsindy_lite.vision import camera
from vidsindy_lite.vision.camera import camera_motion
from vidsindy_lite.vision.steadying import CameraMotion, corners_tell
from vidsindy_lite.vision.video import Reel, write_video

SHIFTS = np.array([[0, 0], [2, 1], [-1, 2], [1, -2], [2, 2], [-2, 0], [0, -1], [1, 1]])


def views(softness):
    """A scene of grains or of clouds as a camera shows it that trembles."""
    rng = np.random.default_rng(0)
    grains = rng.uniform(0, 255, (260, 340)).astype(np.float32)
    scene = cv2.GaussianBlur(grains, (0, 0), softness)
    scene = 128 + 40 * (scene - scene.mean()) / scene.std()
    for right, down in SHIFTS:
        view = scene[10 + down : 250 + down, 10 + right : 330 + right]
        noisy = view + rng.normal(0, 2, view.shape)
        yield np.repeat(np.clip(noisy, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


@pytest.mark.parametrize(("softness", "told"), [(2.5, True), (25, False)])
def test_corners_tell_of_grains_but_not_of_clouds(softness, told):
    assert corners_tell(list(views(softness))) is told


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """Asks witnesses that say what they are told to, and returns the motion and who was asked."""

    def ask(corners, **errors):
        film = Reel(write_video(tmp_path / "clip.mov", views(2.5)))
        order = []

        def witness(name):
            def say(*_):
                order.append(name)
                error = errors.get(name)
                return None if error is None else CameraMotion(np.eye(3)[None], np.array([error]))

            return say

        monkeypatch.setattr(camera, "stands_still", lambda _: False)
        monkeypatch.setattr(camera, "corners_tell", lambda _: corners)
        monkeypatch.setattr(camera, "_steadied", witness("steadied"))
        monkeypatch.setattr(camera, "trembling", witness("together"))
        small = np.array(list(film))
        return *camera_motion(film, small, np.arange(len(small))), order

    return ask


@pytest.mark.parametrize(
    ("corners", "errors", "order", "error"),
    [
        (True, {"steadied": 0.1, "together": 0.0}, ["steadied"], 0.1),
        (False, {"steadied": 0.0, "together": 0.1}, ["together"], 0.1),
        (True, {"together": 0.1}, ["steadied", "together"], 0.1),
        (False, {"steadied": 0.1}, ["together", "steadied"], 0.1),
        (False, {"steadied": 2.0, "together": 3.0}, ["together", "steadied"], 2.0),
        (False, {"steadied": 3.0, "together": 2.0}, ["together", "steadied"], 2.0),
    ],
)
def test_witnesses_are_asked_until_one_is_exact(asked, corners, errors, order, error):
    motion, sure, said = asked(corners, **errors)
    assert said == order
    assert sure
    assert motion.errors == [error]


def test_without_a_witness_the_camera_is_at_rest_and_its_frames_say_how_sure_that_is(asked):
    motion, sure, said = asked(True)
    assert said == ["steadied", "together"]
    assert not motion.moves
    assert not sure  # the frames do not fit together where they are


def test_a_camera_that_trembles_before_grains_is_followed(tmp_path):
    film = Reel(write_video(tmp_path / "clip.mov", views(2.5)))
    small = np.array(list(film))
    motion, sure = camera_motion(film, small, np.arange(len(small)))
    assert sure
    np.testing.assert_allclose(motion.maps[:, :2, 2], SHIFTS, atol=0.1)
