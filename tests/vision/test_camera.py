"""Which witness of a camera's motion is asked first, and which is believed."""

import numpy as np
import pytest
from footage import Phone, render_phone

from vidsindy_lite.vision import camera
from vidsindy_lite.vision.background import sample_frames
from vidsindy_lite.vision.camera import carry, trembling
from vidsindy_lite.vision.video import Reel, write_video

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
