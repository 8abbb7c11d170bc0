"""What may be the target, the best path through it, and its looks."""

import cv2
import numpy as np
import pytest
from helpers import one_a_frame

from vidsindy_lite import write_video
from vidsindy_lite.vision import candidates
from vidsindy_lite.vision.candidates import Candidates, Spot, best_path, followed, plainest_paths
from vidsindy_lite.vision.plate import shadowed
from vidsindy_lite.vision.video import Reel


def found_in(*parts, colour=(20, 40, 220), behind=(90, 100, 110), level=1.0):
    """What is connected of parts (left, top, width, height, strength) of a frame of 60 x 40."""
    strength = np.zeros((40, 60), np.float32)
    ground = np.full((40, 60, 3), behind, np.uint8)
    frame = ground.copy()
    for left, top, width, height, strong in parts:
        place = np.s_[top : top + height, left : left + width]
        strength[place], frame[place] = strong, colour
    return candidates.components(strength, level, frame, ground, 1.0, False)


def test_a_thing_is_where_it_differs():
    one = found_in((10, 20, 4, 4, 2.0))
    np.testing.assert_array_equal(one.box, [[10, 20, 4, 4]])
    np.testing.assert_allclose(one.centre, [[11.5, 21.5]])
    np.testing.assert_array_equal(one.colour, [[20, 40, 220]])
    np.testing.assert_array_equal(one.behind, [[90, 100, 110]])
    assert one.area == 16
    assert len(found_in((10, 20, 4, 4, 2.0), level=2.5).frame) == 0


def test_what_fills_the_image_and_what_is_of_two_pixels_is_nothing():
    assert len(found_in((5, 5, 2, 1, 9.0)).frame) == 0
    # Of 2400 pixels 30 % are 720.
    assert len(found_in((5, 5, 30, 23, 2.0)).frame) == 1
    assert len(found_in((5, 5, 30, 25, 2.0)).frame) == 0


@pytest.mark.parametrize(
    ("left", "top", "touches"),
    [(0, 20, True), (56, 20, True), (20, 0, True), (20, 36, True), (2, 2, False), (54, 34, False)],
)
def test_what_touches_the_border_of_the_image_is_worth_less_and_a_shadow_half(left, top, touches):
    worth = (0.6 if touches else 1) * np.tanh(0.5)
    assert found_in((left, top, 4, 4, 2.0)).quality == pytest.approx(worth)
    shadow = found_in((left, top, 4, 4, 2.0), colour=(63, 70, 77))
    assert shadow.quality == pytest.approx(worth / 2)


def test_shadows_are_darker_by_about_the_same_factor_in_all_colours():
    ground = np.array([100, 150, 200.0])
    for share, is_shadow in ((0.3, False), (0.4, True), (0.6, True), (0.9, True), (0.98, False)):
        assert shadowed(share * ground[None], ground[None]).item() == is_shadow
    coloured = ground * [0.55, 0.65, 0.6]
    assert not shadowed(coloured[None], ground[None]).item()
    # The darker the ground, the less its colours tell.
    assert shadowed(np.array([[3, 10, 3.5]]), np.array([[6, 16, 6.0]])).item()
    assert not shadowed(10 * np.array([[3, 10, 3.5]]), 10 * np.array([[6, 16, 6.0]])).item()


FRAMES = np.arange(30)
CURVE = np.column_stack([20 + 4.0 * FRAMES, 60 + 20 * np.sin(FRAMES / 5)])


def test_a_path_prefers_what_travels_smoothly_and_bridges_gaps():
    rng = np.random.default_rng(0)
    seen = one_a_frame(CURVE, np.full(30, 0.7))
    clutter = Candidates.joined(
        one_a_frame(rng.uniform(0, 150, (30, 2)), np.full(30, 0.8)) for _ in range(3)
    )
    both = Candidates.joined([seen.only(~np.isin(FRAMES, [12, 13, 14, 15])), clutter])
    rows, value = best_path(both)
    near = np.linalg.norm(both.place[rows] - CURVE[both.frame[rows]], axis=1) < 1
    assert near.sum() == 26
    assert value > 8


@pytest.mark.parametrize(("gap", "bridged"), [(15, True), (16, False)])
def test_what_is_longer_ago_than_fifteen_frames_is_another_path(gap, bridged):
    frames = np.r_[0:8, 7 + gap : 15 + gap]
    places = np.column_stack([4.0 * frames, np.full(16, 50.0)])
    seen = one_a_frame(places, np.full(16, 0.9))._replace(frame=frames)
    assert (len(best_path(seen)[0]) == 16) == bridged


def test_a_path_goes_through_what_somebody_points_at():
    plain = one_a_frame(CURVE, np.full(30, 0.9))
    faint = one_a_frame(CURVE + [0, 90], np.full(30, 0.5))
    both = Candidates.joined([plain, faint])
    assert (both.place[best_path(both)[0], 1] < 100).all()
    told = (both.frame == 12) & (both.place[:, 1] > 100)
    pinned = both._replace(quality=np.where(told, candidates.TOLD, both.quality))
    assert (pinned.place[best_path(pinned)[0], 1] > 100).all()


def test_paths_have_nothing_in_common_and_the_plainest_comes_first():
    plain = one_a_frame(CURVE, np.full(30, 0.9))
    other = one_a_frame(CURVE[:, ::-1] + [200, 0], np.full(30, 0.6))
    first, second = plainest_paths(both := Candidates.joined([plain, other]))
    assert (both.quality[first.rows] == 0.9).all()
    assert (both.quality[second.rows] == 0.6).all()
    assert first.rating > second.rating > 0


def test_what_stays_in_its_place_changes_its_outline_or_is_cut_is_less_plain():
    plain = one_a_frame(CURVE, np.full(30, 0.9))
    stays = one_a_frame(20 + 0.02 * CURVE, np.full(30, 0.9))
    walks, cut = plain._replace(box=plain.box.copy()), plain._replace(clear=~plain.clear)
    walks.box[::2, 2] += 6  # of 9 pixels, in each other frame
    best, *others = (plainest_paths(seen)[0].rating for seen in (plain, stays, walks, cut))
    assert max(others) < 0.5 * best


N = 40
PLACES = np.column_stack([60 + 30 * np.sin(np.arange(N) / 6), 50 + 0.5 * np.arange(N)])
LOOKS = np.random.default_rng(0)
WALL = LOOKS.uniform(60, 180, (120, 160, 3)).astype(np.float32)
WALL = cv2.GaussianBlur(WALL, (0, 0), 2)


def drawn(place, colour=(60, 200, 40), shown=True):
    image = WALL.copy()
    if shown:
        at = tuple(np.rint(16 * np.asarray(place)).astype(int).tolist())
        cv2.circle(image, at, 16 * 8, colour, -1, cv2.LINE_AA, 4)
    return np.clip(image + LOOKS.normal(0, 2, image.shape), 0, 255).astype(np.uint8)


def test_what_is_of_another_colour_or_not_there_fits_less():
    size = np.array([17.0, 17])
    looks = candidates.Appearance(drawn((60, 50)), np.array([60.0, 50]), size)
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
    box, area = np.hstack([two - 8, np.full((2, 2), 17.0)]), np.full(2, 200.0)
    found = one_a_frame(two, np.ones(2))._replace(frame=np.full(2, 5), box=box, area=area)
    looks = followed(frames, maps, found, Spot(10, PLACES[10], np.array([17.0, 17])))
    shown = ~np.isin(np.arange(N), hidden)
    assert np.linalg.norm(looks.box[shown, :2] - PLACES[shown], axis=1).max() < 1.5
    assert looks.fit[10] == 1
    assert looks.fit[list(hidden)].max() < looks.fit[shown].min()
    assert looks.like[0] > 0.8
    assert looks.like[1] < 0.4
