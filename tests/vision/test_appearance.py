"""A target by its looks: found to a fraction of a pixel, followed both ways, told from others."""

import cv2
import numpy as np
import pytest

from vidsindy_lite import write_video
from vidsindy_lite.vision.candidates import Appearance, Candidates, followed
from vidsindy_lite.vision.video import Reel

N = 40
PLACES = np.column_stack([60 + 30 * np.sin(np.arange(N) / 6), 50 + 0.5 * np.arange(N)])
RNG = np.random.default_rng(0)
GROUND = RNG.uniform(60, 180, (120, 160, 3)).astype(np.float32)
GROUND = cv2.GaussianBlur(GROUND, (0, 0), 2)


def drawn(place, colour=(60, 200, 40), shown=True):
    image = GROUND.copy()
    if shown:
        at = tuple(np.rint(16 * np.asarray(place)).astype(int).tolist())
        cv2.circle(image, at, 16 * 8, colour, -1, cv2.LINE_AA, 4)
    return np.clip(image + RNG.normal(0, 2, image.shape), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("off", [(0, 0), (4.3, -3.6), (-6.5, 5.2)])
def test_a_target_is_found_near_where_it_is_expected(off):
    size = np.array([17.0, 17])
    looks = Appearance(drawn((60, 50)), np.array([60.0, 50]), size)
    place, fit, colour = looks.find(drawn((70, 64)), np.array([70.0, 64]) + off, size)
    np.testing.assert_allclose(place, [70, 64], atol=0.7)
    assert fit > 0.3
    assert colour > 0.5


def test_what_is_of_another_colour_or_not_there_fits_less():
    size = np.array([17.0, 17])
    looks = Appearance(drawn((60, 50)), np.array([60.0, 50]), size)
    own, other, none = (
        looks.find(frame, np.array([62.0, 50]), size)
        for frame in (drawn((60, 50)), drawn((60, 50), (60, 60, 200)), drawn(None, shown=False))
    )
    assert own[1] > 2 * none[1]
    assert own[2] > 2 * max(other[2], none[2])
    assert looks.likely(drawn((60, 50)))[50, 60] > 0.9 > 0.1 > looks.likely(drawn((60, 50)))[10, 9]


def test_it_is_followed_both_ways_from_where_it_is_known(tmp_path):
    hidden = (20, 21, 22)
    film = [drawn(place, shown=i not in hidden) for i, place in enumerate(PLACES)]
    frames = Reel(write_video(tmp_path / "film.mov", iter(film)))
    maps = np.tile(np.eye(3), (N, 1, 1))
    two = np.array([*PLACES[5:6], [20.0, 20]])  # the target and a piece of ground
    found = Candidates.of(5, np.eye(3), np.column_stack(
        [two, two - 8, np.full((2, 2), 17.0), np.full(2, 200.0), np.zeros((2, 6)), np.ones(2)]
    ))  # fmt: skip
    looks = followed(frames, maps, found, (10, PLACES[10], np.array([17.0, 17])),
                     np.full((N, 2), np.nan))  # fmt: skip
    shown = ~np.isin(np.arange(N), hidden)
    assert np.linalg.norm(looks.box[shown, :2] - PLACES[shown], axis=1).max() < 1.5
    assert looks.fit[10] == 1
    assert looks.fit[list(hidden)].max() < looks.fit[shown].min()
    assert looks.like[0] > 0.8
    assert looks.like[1] < 0.4
