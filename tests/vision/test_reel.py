"""Frames that are looked at several times against those of the file."""

import numpy as np
import pytest

from vidsindy_lite import write_video
from vidsindy_lite.vision import video as module
from vidsindy_lite.vision.video import Reel


@pytest.mark.parametrize(("room", "reads", "picks"), [(1.0, 1, 0), (0.99, 2, 1)])
def test_frames_are_read_once_if_there_is_room(tmp_path, monkeypatch, room, reads, picks):
    images = np.random.default_rng(0).integers(0, 256, (5, 16, 32, 3), np.uint8)
    path = write_video(tmp_path / "clip.mov", iter(images))
    count = {"read_video": 0, "pick_frames": 0}

    def counted(name):
        use = getattr(module, name)

        def one(*given):
            count[name] += 1
            return use(*given)

        monkeypatch.setattr(module, name, one)

    counted("read_video")
    counted("pick_frames")
    monkeypatch.setattr(module, "_ROOM", room * images.nbytes)
    reel = Reel(path)
    np.testing.assert_array_equal(list(reel.pick([0, 2, 4, 7])), images[[0, 2, 4]])
    for _ in range(2):
        np.testing.assert_array_equal(list(reel), images)
    assert count == {"read_video": reads, "pick_frames": picks}


def test_a_film_of_which_not_all_was_seen_is_read_again(tmp_path):
    images = np.random.default_rng(0).integers(0, 256, (5, 16, 32, 3), np.uint8)
    reel = Reel(write_video(tmp_path / "clip.mov", iter(images)))
    next(iter(reel))
    np.testing.assert_array_equal(list(reel), images)
