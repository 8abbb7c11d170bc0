"""Reduced frames against the means they are."""

import numpy as np
import pytest

from vidsindy_lite import write_video
from vidsindy_lite.vision import background as reducing
from vidsindy_lite.vision import video as reel
from vidsindy_lite.vision.background import ReducedFrames, reduce
from vidsindy_lite.vision.video import Reel


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


@pytest.mark.parametrize(("room", "times"), [(1.0, 1), (0.99, 2)])
def test_frames_are_reduced_once_if_there_is_room(tmp_path, monkeypatch, room, times):
    images = np.random.default_rng(0).integers(0, 256, (5, 16, 32, 3), np.uint8)
    path = write_video(tmp_path / "clip.mov", iter(images))
    shrink, count = reducing.reduce, []
    monkeypatch.setattr(reducing, "reduce", lambda *a: count.append(a) or shrink(*a))
    monkeypatch.setattr(reducing, "_ROOM", room * images.nbytes / 4)
    frames = ReducedFrames(Reel(path), 2)
    for _ in range(2):
        for frame, image in zip(frames, images, strict=True):
            np.testing.assert_array_equal(frame, reduce(image, 2))
    assert len(count) == 5 * times


@pytest.mark.parametrize("few", [True, False])
def test_frames_that_are_picked_leave_the_reduced_ones_if_there_is_room(tmp_path, monkeypatch, few):
    images = np.random.default_rng(0).integers(0, 256, (5, 16, 32, 3), np.uint8)
    path = write_video(tmp_path / "clip.mov", iter(images))
    monkeypatch.setattr(reel, "_ROOM", 0)
    monkeypatch.setattr(reducing, "_ROOM", few * images.nbytes / 4)
    count = {"read_video": 0, "pick_frames": 0}
    for name, use in [(name, getattr(reel, name)) for name in count]:

        def counted(*given, name=name, use=use):
            count[name] += 1
            return use(*given)

        monkeypatch.setattr(reel, name, counted)
    frames = ReducedFrames(Reel(path), 2)
    np.testing.assert_array_equal(list(frames.pick([0, 2, 4, 7])), images[[0, 2, 4]])
    for frame, image in zip(frames, images, strict=True):
        np.testing.assert_array_equal(frame, reduce(image, 2))
    assert count == {"read_video": 1, "pick_frames": not few}
