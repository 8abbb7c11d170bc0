"""Frames that are looked at several times against those of the file."""

import numpy as np
import pytest

from vidsindy_lite import write_video
from vidsindy_lite.vision import video as module
from vidsindy_lite.vision.video import Reel, reduce


def rounded(factor):
    """By how much a mean may be off: each step, a halving or the rest, rounds to whole levels."""
    return 0.51 * {2: 1, 3: 1, 4: 2, 6: 2, 8: 3}[factor]


@pytest.mark.parametrize("factor", [2, 3, 4, 6, 8])
def test_reduced_pixels_are_means(factor):
    image = np.random.default_rng(0).integers(0, 256, (4 * factor, 6 * factor, 3), np.uint8)
    means = image.reshape(4, factor, 6, factor, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(reduce(image, factor), means, atol=rounded(factor))
    assert reduce(image, factor).shape == (4, 6, 3)
    assert reduce(image, 1) is image


@pytest.mark.parametrize("factor", [3, 4])
def test_what_is_missing_of_the_last_squares_repeats_the_last_row_and_column(factor):
    image = np.random.default_rng(0).integers(0, 256, (7, 10, 3), np.uint8)
    cut = np.pad(image, ((0, -7 % factor), (0, -10 % factor), (0, 0)), mode="edge")
    means = cut.reshape(len(cut) // factor, factor, -1, factor, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(reduce(image, factor), means, atol=rounded(factor))


@pytest.mark.parametrize("longest", [None, 16])
@pytest.mark.parametrize(("room", "reads", "picks"), [(1.0, 1, 0), (0.99, 2, 1)])
def test_frames_are_read_once_if_there_is_room(tmp_path, monkeypatch, room, reads, picks, longest):
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
    reel = Reel(path, longest)
    small = np.array([reduce(image, reel.factor) for image in images])
    monkeypatch.setattr(module, "_ROOM", room * small.nbytes)
    reel = Reel(path, longest)
    assert reel.whole.few == (longest is None and room == 1)
    np.testing.assert_array_equal(list(reel.pick([0, 2, 4, 7])), small[[0, 2, 4]])
    for _ in range(2):
        np.testing.assert_array_equal(list(reel), small)
    assert count == {"read_video": reads, "pick_frames": picks}


def test_a_film_of_which_not_all_was_seen_is_read_again(tmp_path):
    images = np.random.default_rng(0).integers(0, 256, (5, 16, 32, 3), np.uint8)
    reel = Reel(write_video(tmp_path / "clip.mov", iter(images)))
    next(iter(reel))
    np.testing.assert_array_equal(list(reel), images)
