"""Paths that meet: which is which afterwards is said by looks, where these are plain."""

import numpy as np
import pytest

from vidsindy_lite.vision import crossing, moving
from vidsindy_lite.vision.crossing import _meetings, _off, rejoined
from vidsindy_lite.vision.linking import Sightings
from vidsindy_lite.vision.moving import plainest_paths

BALL, PERSON = ((180, 35, 200), 20), ((75, 55, 45), 90)
N = 60


def crossing_of(looks, apart=0.0, at=30):
    """Two things that pass each other in the middle: the first is seen in rows 0 to 59."""
    t = np.arange(N)
    places = [np.column_stack([200 + way * 6.0 * (t - at), np.full(N, 100 + apart * (way > 0))])
              for way in (1, -1)]  # fmt: skip
    centre = np.concatenate(places)
    size = np.repeat([float(size) for _, size in looks], N)
    colour = np.repeat(np.array([colour for colour, _ in looks], float), N, axis=0)
    box = np.column_stack([centre - size[:, None] / 2, size, size])
    frame = np.tile(t, 2)
    return Sightings(frame, frame, centre, size, colour, np.full(2 * N, 0.9), box, 500.0)


def paths(seen, *, swap, gap=(24, 38)):
    """The paths of both, which change places behind a gap of the first, its last frame too."""
    one, other = np.arange(N), N + np.arange(N)
    shown = (seen.frame[one] < gap[0]) | (seen.frame[one] > gap[1])
    one = one[shown]
    if not swap:
        return [one, other]
    return [np.append(one[one < gap[0]], other[gap[1] + 1 :]),
            np.append(other[: gap[1] + 1], one[one > gap[1]])]  # fmt: skip


def test_what_comes_out_of_a_meeting_as_something_else_is_put_right():
    seen = crossing_of((BALL, PERSON))
    right = paths(seen, swap=False)
    for found, true in zip(rejoined(seen, paths(seen, swap=True)), right, strict=True):
        np.testing.assert_array_equal(found, true)
    for found, true in zip(rejoined(seen, right), right, strict=True):
        np.testing.assert_array_equal(found, true)


def test_while_both_are_seen_each_sighting_goes_to_what_it_looks_like():
    seen = crossing_of((BALL, PERSON))
    for cut in (27, 30, 33):
        wrong = [np.append(np.arange(cut), N + np.arange(cut, N)),
                 np.append(N + np.arange(cut), np.arange(cut, N))]  # fmt: skip
        one, other = rejoined(seen, wrong)
        np.testing.assert_array_equal(one, np.arange(N))
        np.testing.assert_array_equal(other, N + np.arange(N))


@pytest.mark.parametrize("other", [BALL, ((170, 45, 190), 22)], ids=["alike", "nearly alike"])
def test_where_looks_say_little_motion_has_the_word(other):
    seen = crossing_of((BALL, other))
    wrong = paths(seen, swap=True)
    for found, given in zip(rejoined(seen, wrong), wrong, strict=True):
        np.testing.assert_array_equal(found, given)


@pytest.mark.parametrize("apart", [0, 200])
def test_what_never_met_has_not_changed_places(apart):
    seen = crossing_of((BALL, PERSON), apart)
    late = seen.frame >= 30  # each looks as the other from there on
    seen.colour[late], seen.size[late] = (
        np.roll(x, N, axis=0)[late].copy() for x in (seen.colour, seen.size)
    )
    one, _ = rejoined(seen, paths(seen, swap=False))
    assert (one < N).all() == (apart > 0)


def test_looks_must_differ_plainly(monkeypatch):
    seen = crossing_of((BALL, ((170, 45, 190), 22)))
    monkeypatch.setattr(crossing, "_PLAINLY", 0.5)
    one, _ = rejoined(seen, paths(seen, swap=True))
    np.testing.assert_array_equal(one, paths(seen, swap=False)[0])


def test_things_of_one_colour_are_told_by_their_sizes():
    seen = crossing_of((BALL, (BALL[0], 90)))
    right = paths(seen, swap=False)
    for found, true in zip(rejoined(seen, paths(seen, swap=True)), right, strict=True):
        np.testing.assert_array_equal(found, true)


def test_two_that_look_alike_behind_a_meeting_keep_their_places():
    # Both come out of it in the shade: neither of the two ways to go on is better.
    seen = crossing_of((BALL, PERSON))
    late = seen.frame > 35
    seen.colour[late], seen.size[late] = (0, 60, 0), 50
    given = paths(seen, swap=False)
    for found, true in zip(rejoined(seen, given), given, strict=True):
        np.testing.assert_array_equal(found, true)


def test_a_look_is_off_by_its_colour_and_by_the_logarithm_of_its_size():
    seen = crossing_of((BALL, PERSON))
    seen.colour[:3], seen.size[:3] = [[9, 20, 30], [10, 20, 30], [10, 20, 32]], [8, 9, 10]
    seen.colour[5], seen.size[5] = (10, 20, 120), 9  # 90 grey levels off, of which 60 cost 1
    seen.colour[6], seen.size[6] = (10, 20, 30), 18
    seen.colour[7], seen.size[7] = (40, 20, 30), 3
    off = _off(seen, np.arange(3), np.array([5, 6, 7]))
    np.testing.assert_allclose(off, [1.5, np.log(2), 0.5 + np.log(3)])
    np.testing.assert_array_equal(_off(seen, np.arange(2), np.array([5, 6, 7])), 0)


def test_boxes_meet_from_the_first_to_the_last_frame_in_which_less_than_two_pixels_part_them():
    # Of 20 and 90 pixels, 12 nearer in each frame: less than 57 apart in frames 26 to 34.
    seen = crossing_of((BALL, PERSON))
    one, other = np.arange(N), N + np.arange(N)
    np.testing.assert_array_equal(_meetings(seen, one, other), [[26, 34]])
    # A path rests where it ends, and is remembered for 20 frames.
    np.testing.assert_array_equal(_meetings(seen, one[:31], other[:29]), [[26, 48]])
    np.testing.assert_array_equal(_meetings(seen, one[29:], other[28:]), [[9, 34]])
    assert _meetings(seen, one[:10], other[51:]).shape == (0, 2)


def test_a_path_that_goes_on_as_another_one_ends_there():
    # The ball leaves, and its path goes on as the person, whose own ends.
    seen = crossing_of((BALL, PERSON))
    ball, person = paths(seen, swap=False)
    wrong = [np.append(ball[:24], person[39:]), person[:39]]
    one, other = rejoined(seen, wrong)
    np.testing.assert_array_equal(one, ball[:24])
    np.testing.assert_array_equal(other, person)


def test_what_parts_twice_is_told_apart_twice():
    t = np.arange(N)
    seen = crossing_of((BALL, PERSON))
    seen.centre[:N, 0] = seen.centre[N:, 0] + 120 * np.cos(2 * np.pi * t / N)
    seen.box[:N, :2] = seen.centre[:N] - 10
    gaps = (np.abs(seen.centre[:N, 0] - seen.centre[N:, 0]) < 50, t >= 0)
    ball, person = t[~gaps[0]], N + t
    between = (t > 15) & (t < 45)
    wrong = [np.append(ball[~between[ball]], N + t[between]),
             np.append(person[~between[t]], ball[between[ball]])]  # fmt: skip
    one, other = rejoined(seen, [rows[np.argsort(seen.frame[rows])] for rows in wrong])
    np.testing.assert_array_equal(one, ball)
    np.testing.assert_array_equal(other, person)


def test_too_few_sightings_say_nothing():
    seen = crossing_of((BALL, PERSON))
    ball, person = paths(seen, swap=False)
    for few, told in ((2, False), (3, True)):
        wrong = [np.append(ball[:24], person[39 : 39 + few]),
                 np.append(person[:39], ball[24 : 24 + few])]  # fmt: skip
        one, _ = rejoined(seen, wrong)
        assert (one < N).all() == told


def test_the_plainest_path_is_that_of_the_ball_alone(monkeypatch):
    # While the ball is hidden its path gains more by going on as the person, seen as plainly.
    seen = crossing_of((BALL, PERSON))
    ball, person = paths(seen, swap=False)
    seen.quality[N + np.arange(39, N)] = 0.4
    shown = seen.only(np.concatenate([ball, person])[np.argsort(seen.frame[[*ball, *person]])])

    def frames_of_ball():
        rows = plainest_paths(shown)[0].rows
        return shown.frame[rows[shown.size[rows] == BALL[1]]].tolist()

    assert frames_of_ball() == seen.frame[ball].tolist()
    monkeypatch.setattr(moving, "rejoined", lambda seen, paths: paths)
    assert frames_of_ball() != seen.frame[ball].tolist()
