"""The best path through candidates: smooth, of one thing, whatever else there is."""

from itertools import product

import numpy as np
import pytest
from helpers import one_a_frame

from vidsindy_lite.vision.candidates import TOLD, Candidates, best_path, plainest_paths

RED = np.array([30.0, 30, 200])
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


def test_what_falls_is_no_worse_than_what_goes_straight():
    straight = one_a_frame(np.column_stack([6.0 * FRAMES, 50 + 0 * FRAMES]), np.full(30, 0.7))
    falls = one_a_frame(np.column_stack([6.0 * FRAMES, 0.4 * FRAMES**2]), np.full(30, 0.7))
    assert best_path(falls)[1] > 0.9 * best_path(straight)[1]


def test_a_path_goes_through_what_somebody_points_at():
    plain = one_a_frame(CURVE, np.full(30, 0.9))
    faint = one_a_frame(CURVE + [0, 90], np.full(30, 0.5))
    both = Candidates.joined([plain, faint])
    assert (both.place[best_path(both)[0], 1] < 100).all()
    told = (both.frame == 12) & (both.place[:, 1] > 100)
    pinned = both._replace(quality=np.where(told, TOLD, both.quality))
    assert (pinned.place[best_path(pinned)[0], 1] > 100).all()


def test_no_candidates_are_no_path():
    assert len(best_path(one_a_frame(np.zeros((0, 2)), []))[0]) == 0
    assert plainest_paths(one_a_frame(np.zeros((0, 2)), [])) == []


@pytest.mark.parametrize("seed", range(3))
def test_of_short_paths_none_is_worth_more_than_the_best(seed):
    """Of two steps a path has no motion yet but the first: dynamic programming is exact."""
    rng = np.random.default_rng(seed)
    seen = Candidates.joined(
        one_a_frame(rng.uniform(0, 30, (2, 2)), rng.uniform(0.3, 0.9, 2)) for _ in range(3)
    )
    value = best_path(seen)[1]
    for one, other in product(np.flatnonzero(seen.frame == 0), np.flatnonzero(seen.frame == 1)):
        assert best_path(seen.only(np.array([one, other])))[1] <= value + 1e-12


def test_paths_have_nothing_in_common_and_the_plainest_comes_first():
    plain = one_a_frame(CURVE, np.full(30, 0.9))
    other = one_a_frame(CURVE[:, ::-1] + [200, 0], np.full(30, 0.6))
    first, second = plainest_paths(both := Candidates.joined([plain, other]))
    assert (both.quality[first.rows] == 0.9).all()
    assert (both.quality[second.rows] == 0.6).all()
    assert first.rating > second.rating > 0


def test_what_stays_in_its_place_or_changes_its_outline_is_less_plain():
    plain = one_a_frame(CURVE, np.full(30, 0.9))
    stays = one_a_frame(20 + 0.02 * CURVE, np.full(30, 0.9))
    box = plain.box.copy()
    box[::2, 2] += 6  # of 9 pixels, in each frame: somebody who walks
    best, *others = (
        plainest_paths(seen)[0].rating for seen in (plain, stays, plain._replace(box=box))
    )
    assert max(others) < 0.5 * best
