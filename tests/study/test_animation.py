"""The animation of the tour shows its parts in turn."""

import numpy as np
import pytest

from vidsindy_lite.study import plots

FRAMES, MOMENTS = 30, np.array([0, 10, 29])


@pytest.fixture(scope="module")
def pictures():
    rng = np.random.default_rng(0)
    films = [[np.full((64, 64, 3), 60 * k, np.uint8) for k in range(3)] for _ in range(3)]
    tracks = [rng.uniform(0, 63, (FRAMES, 2)) for _ in range(3)]
    return plots.draw_tour(films, MOMENTS, tracks, rng.normal(size=(FRAMES, 3)), ["dx/dt = y"])


def test_pictures_have_one_size(pictures):
    assert {picture.shape for picture in pictures} == {(300, 900, 3)}
    assert {picture.dtype for picture in pictures} == {np.dtype(np.uint8)}


def test_videos_and_path_grow_before_the_law_is_shown(pictures):
    videos, law = pictures[: len(MOMENTS)], pictures[len(MOMENTS) :]
    for before, after in zip(videos, videos[1:], strict=False):
        changed = (before != after).any(axis=2)
        assert changed[:220, :640].any()  # the videos
        assert changed[:220, 640:].any()  # the path
        assert not changed[230:, :640].any()
    assert all((picture[:220] == videos[-1][:220]).all() for picture in law)
    assert (law[0][230:] != videos[-1][230:]).any()


def test_frames_are_blue_green_red_as_a_video_reader_gives_them():
    orange = np.full((64, 64, 3), (0, 120, 255), np.uint8)
    tracks, path = np.full((3, 2, 2), np.nan), np.array([[0.0, 0, 0], [1, 1, 1]])
    (picture,) = plots.draw_tour([[orange]] * 3, np.array([1]), tracks, path, [])
    assert picture[150, 100].tolist() == [255, 120, 0]
