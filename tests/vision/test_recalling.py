"""Where a target is in frames that show only a part of it."""

import cv2
import numpy as np
import pytest

from vidsindy_lite import Hint, track, write_video
from vidsindy_lite.vision.candidates import Plate
from vidsindy_lite.vision.recalling import _FAR, recalled
from vidsindy_lite.vision.reel import Reel
from vidsindy_lite.vision.refining import Lens, View

N = 60
TRUTH = np.column_stack([30 + 4.4 * np.arange(N), 110 - 25 * np.sin(np.arange(N) / 15)])
HINT = Hint(frame=10, box=(*(TRUTH[10] - 12), 25, 25))


def plain(path, truth, radius, shown=N):
    """A film of a red disc before a grey wall, with its lens, light and views of the whole."""
    frames = np.full((N, 200, 320, 3), 120, np.uint8)
    for frame, place in zip(frames[:shown], truth, strict=False):
        cv2.circle(frame, tuple(np.rint(16 * place).astype(int)), 16 * radius, (30, 30, 210),
                   -1, cv2.LINE_AA, 4)  # fmt: skip
    maps = np.tile(np.eye(3), (N, 1, 1))
    lens = Lens(Plate(np.full((3, 200, 320, 3), 120, np.uint8), maps[:3], np.ones(3, bool)), 1.0)
    square = radius * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    area = round(np.pi * radius**2)
    views = [View(place, area, np.zeros(3), True, place + square) for place in truth]
    return write_video(path, iter(frames)), lens, [np.ones(3, np.float32)] * N, maps, views


def film(path, post, wall):
    """A red ball that flies behind a post, or before a wall of its colour, past other things."""
    rng = np.random.default_rng(0)
    ground = cv2.GaussianBlur(rng.uniform(0, 255, (200, 320, 3)).astype(np.float32), (0, 0), 4)
    ground = 60 + ground / 2
    if wall:
        ground[:, 150:162] = (30, 30, 210)

    def frames():
        for i in range(N):
            frame = ground.copy()
            cv2.circle(frame, tuple(np.rint(16 * TRUTH[i]).astype(int)), 16 * 11, (30, 30, 210),
                       -1, cv2.LINE_AA, 4)  # fmt: skip
            frame[:, 150 : 150 + post] = (60, 80, 90)
            noise = rng.normal(0, 3, frame.shape)
            yield np.clip((1 + 0.1 * np.sin(i)) * frame + noise, 0, 255).astype(np.uint8)

    return write_video(path, frames())


@pytest.mark.parametrize(("post", "wall"), [(14, False), (0, True)], ids=["post", "wall"])
def test_what_is_seen_in_part_is_where_its_motion_leads(tmp_path, post, wall):
    path = film(tmp_path / "clip.mov", post, wall)
    error, hinted = (
        np.linalg.norm(track(path, target=hint).pixels - TRUTH, axis=1) for hint in (None, HINT)
    )
    for found in (error, hinted):
        assert np.isfinite(found).mean() >= 0.95
        assert np.nanmax(found) < 1
    assert np.isfinite(hinted[np.isfinite(error)]).all()


def test_what_is_hidden_altogether_stays_a_gap(tmp_path):
    path = film(tmp_path / "clip.mov", 60, False)
    error = np.linalg.norm(track(path, target=HINT).pixels - TRUTH, axis=1)
    hidden = (TRUTH[:, 0] > 150 + 13) & (TRUTH[:, 0] < 210 - 13)
    assert hidden.sum() > 5
    assert np.isnan(error[hidden]).all()
    assert np.nanmax(error) < 3


def test_beyond_its_views_a_target_is_carried_on_as_long_as_it_is_found(tmp_path):
    path, lens, lights, maps, views = plain(tmp_path / "clip.mov", TRUTH, 11, shown=54)
    pixels = TRUTH.copy()
    pixels[:8], pixels[45:] = np.nan, np.nan
    places = recalled(Reel(path), lens, lights, pixels, maps, views, told=True)
    found = np.isfinite(places[:, 0])
    np.testing.assert_array_equal(np.flatnonzero(found), [*range(8), *range(45, 54)])
    assert np.linalg.norm(places[found] - TRUTH[found], axis=1).max() < 0.5
    assert np.isnan(recalled(Reel(path), lens, lights, pixels, maps, views, told=False)).all()
    pixels[20:45] = np.nan  # farther than a view is carried
    places = recalled(Reel(path), lens, lights, pixels, maps, views, told=True)
    np.testing.assert_array_equal(
        np.flatnonzero(np.isfinite(places[:, 0])), [*range(8), *range(20, 20 + _FAR)]
    )


@pytest.mark.parametrize("sharp", [1.0, 30.0])
def test_without_a_hint_a_gap_is_filled_where_its_motion_is_known_to_two_pixels(tmp_path, sharp):
    at = np.arange(N)
    truth = np.column_stack([30 + 4.4 * at, 100 + sharp * np.tanh((at - 30) / 4)])
    path, lens, lights, maps, views = plain(tmp_path / "clip.mov", truth, 25)
    pixels = truth.copy()
    pixels[28:33] = np.nan
    for told in (True, False):
        places = recalled(Reel(path), lens, lights, pixels, maps, views, told=told)
        assert np.isfinite(places[28:33, 0]).all() == (told or sharp < 2)


def test_only_frames_in_and_beside_gaps_are_looked_at(tmp_path):
    class Picked(Reel):
        def pick(self, numbers):
            self.numbers = list(numbers)
            return super().pick(numbers)

    path, lens, lights, maps, views = plain(tmp_path / "clip.mov", TRUTH, 11)
    pixels = TRUTH.copy()
    pixels[28:31] = np.nan
    reel = Picked(path)
    places = recalled(reel, lens, lights, pixels, maps, views, told=False)
    assert reel.numbers == [27, 28, 29, 30, 31]
    np.testing.assert_allclose(places[28:31], TRUTH[28:31], atol=0.5)
