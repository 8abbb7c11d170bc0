"""What a hint says of the candidates, and of a track that misses it."""

import re

import numpy as np
import pytest

from vidsindy_lite import Hint, track, write_video
from vidsindy_lite.vision.candidates import Candidate
from vidsindy_lite.vision.linking import TOLD
from vidsindy_lite.vision.pointing import Pointer, _boxed, _fits, _overlap, alike


def blob(u, v, size, colour=(30, 30, 200)):
    """A candidate of quality .8, as wide as high."""
    box = np.array([u - (size - 1) / 2, v - (size - 1) / 2, size, size])
    return Candidate(np.array([u, v]), box, size**2, np.array(colour, float), 0.8)


FOUND = [[blob(40.0, 50.0, 9), blob(80.0, 50.0, 9, (200, 30, 30))], [blob(9.0, 9.0, 9)]]


def test_a_candidate_of_another_colour_is_worth_less():
    pointer = Pointer.of(Hint(colour=(200, 30, 30)), FOUND, 1, "none.mov")
    (same, other), (again,) = pointer.like(FOUND)
    assert same.quality == again.quality == pytest.approx(0.8)
    assert other.quality < 0.1
    assert pointer.pinned(FOUND) is FOUND


def test_what_is_in_the_box_is_all_that_its_frame_has():
    pointer = Pointer.of(Hint(0, (76, 46, 9, 9)), FOUND, 1, "none.mov")
    (own,), rest = pointer.pinned(FOUND)
    assert own.quality == TOLD
    np.testing.assert_array_equal(own.centre, [80, 50])
    assert rest is FOUND[1]
    assert pointer.like(FOUND)[0][0].quality < 0.1 < pointer.like(FOUND)[0][1].quality


def test_of_what_is_in_a_box_the_one_that_fills_it_is_meant():
    found = [[blob(40.0, 50.0, 3), blob(41.0, 50.0, 9)]]
    assert Pointer.of(Hint(0, (36, 46, 9, 9)), found, 1, "none.mov").one.area == 81


def test_what_a_path_has_is_to_be_on_the_next_one_and_what_is_as_large_is_preferred():
    pointer = Pointer.of(Hint(0, (36, 46, 9, 9)), FOUND, 1, "none.mov")
    found = [FOUND[0], FOUND[1], [blob(40.0, 50.0, 9), blob(40.0, 50.0, 63)]]
    frames, which = np.array([0, 1]), np.array([0, 0])
    kept = pointer.kept(found, frames, which)
    assert [[c.quality for c in some] for some in kept[1:]] == [
        [pytest.approx(1.8)],
        [pytest.approx(0.8), pytest.approx(0.8 * np.exp(-((np.log(49) / 2.2) ** 2)))],
    ]
    assert [c.quality for c in kept[0]] == pytest.approx([0.8, 0.8])  # the one is pinned there
    assert pointer.like(found)[2][1].quality < 0.1


def test_two_boxes_overlap_by_what_both_cover():
    one, other = np.array([0.0, 0, 4, 4]), np.array([2.0, 0, 4, 4])
    assert _overlap(one, other) == pytest.approx(8 / 24)
    assert _overlap(one, other + [4, 0, 0, 0]) == 0


def test_a_candidate_fits_a_box_about_its_place_and_size():
    """A pixel beyond half of the box at most; 1.6 times as large and four pixels more."""
    box, middle = np.array([35.5, 45.5, 10, 10]), np.array([40.0, 50.0])
    for u, v, size, fits in (
        (46.0, 50.0, 10, True), (46.1, 50.0, 10, False), (40.0, 43.9, 10, False),
        (40.0, 44.0, 20, True), (40.0, 50.0, 20.1, False), (40.0, 50.0, 1, True),
    ):  # fmt: skip
        assert _fits(blob(u, v, size), box, middle) is fits


def test_a_track_that_is_not_in_the_box_says_so():
    pointer = Pointer.of(Hint(0, (36, 46, 9, 9)), FOUND, 1, "none.mov")
    maps = np.array(
        [[[1, 0, 5], [0, 1, 0], [0, 0, 1.0]]]
    )  # the frame lies five pixels to the right
    assert pointer.missed(np.array([[49.0, 50]]), maps) == ()
    (elsewhere,) = pointer.missed(np.array([[52.0, 50]]), maps)
    assert "pointed at in frame 0" in elsewhere
    assert "at (47, 50)" in elsewhere
    (unseen,) = pointer.missed(np.full((1, 2), np.nan), maps)
    assert unseen.endswith("is not seen in that frame")
    assert Pointer.of(Hint(colour=(1, 2, 3)), FOUND, 1, "none.mov").missed(maps[:, 0], maps) == ()


def test_a_hint_is_for_auto_and_must_be_one(tmp_path):
    with pytest.raises(ValueError, match="target: may be given for detector='auto'"):
        track(tmp_path / "a.mov", "learned", Hint(colour=(1, 2, 3)))
    with pytest.raises(ValueError, match="target: must be of type Hint"):
        track(tmp_path / "a.mov", target=(1, 2, 3, 4))
    with pytest.raises(ValueError, match="target: its frame must be one of 2, got 2"):
        Pointer.of(Hint(2, (36, 46, 9, 9)), FOUND, 1, "none.mov")


@pytest.mark.parametrize("box", [(-80, 20, 30, 30), (20, -40, 30, 30), (190, 20, 30, 30)])
def test_a_box_outside_the_image_is_refused_as_it_was_given(tmp_path, box):
    path = write_video(tmp_path / "a.mov", np.zeros((2, 120, 200, 3), np.uint8))
    said = re.escape(f"box: must have its middle in the image of 200 x 120 pixels, got {box}")
    with pytest.raises(ValueError, match=said):
        Pointer.of(Hint(0, box), [[], []], 4, path)
    assert Pointer.of(Hint(0, (180, 20, 30, 30)), [[], []], 4, path).one is not None


def test_a_colour_that_was_told_is_held_against_what_is_followed():
    pointer = Pointer.of(Hint(colour=(200, 30, 20)), FOUND, 1, "none.mov")
    assert pointer.unlike(np.array([30.0, 40, 170])) == ()  # in less light
    (doubt,) = pointer.unlike(np.array([200.0, 120, 30]))
    assert doubt == "what is followed has the colour (30, 120, 200), not (200, 30, 20) as told"
    boxed = Pointer.of(Hint(0, (36, 46, 9, 9)), FOUND, 1, "none.mov")
    assert boxed.unlike(np.array([200.0, 120, 30])) == ()


def test_a_track_of_another_colour_than_was_told_is_doubted(tmp_path):
    frames = np.full((40, 120, 200, 3), 90, np.uint8)
    for i, frame in enumerate(frames):
        frame[40 + i : 52 + i, 20 + 4 * i : 32 + 4 * i] = (200, 90, 40)
    path = write_video(tmp_path / "a.mov", iter(frames))
    for told, doubted in (((40, 90, 200), False), ((40, 150, 160), True)):
        warnings = track(path, target=Hint(colour=told)).warnings
        assert any("has the colour (40, 90, 200)" in warning for warning in warnings) == doubted


def test_what_is_in_a_box_has_the_colour_of_its_inner_half():
    frame = np.full((60, 80, 3), 90, np.uint8)
    frame[20:31, 30:51] = (30, 60, 200)  # what is boxed, to the pixel
    frame[29:31, 45:51] = 0  # a corner of it is dark
    box = np.array([25.0, 15, 31, 21])  # once more as wide and high
    one = _boxed(frame, box, box[:2] + (box[2:] - 1) / 2)
    np.testing.assert_array_equal(one.colour, [30, 60, 200])
    corner = _boxed(frame, np.array([-6.0, -6, 9, 9]), np.array([-2.0, -2]))
    np.testing.assert_array_equal(corner.colour, [90, 90, 90])


def test_boxes_overlap_by_what_they_share_to_both_sides():
    one, other = np.array([10.0, 20, 4, 6]), np.array([12.0, 23, 5, 8])
    assert _overlap(one, other) == _overlap(other, one) == pytest.approx(2 * 3 / (24 + 40 - 6))
    assert _overlap(one, one) == 1
    assert _overlap(one, np.array([12.0, 21, 1, 2])) == pytest.approx(2 / 24)
    assert _overlap(one, one + [5, 7, 0, 0]) == 0


@pytest.mark.parametrize(
    ("light", "far"),
    # Light from 0.7 to 1.4 of it changes no colour.
    [(0.7, 0.0), (1.0, 0.0), (1.4, 0.0), (0.5, 0.2), (0.2, 0.5), (2.0, 0.6)],
)
def test_colours_are_alike_in_another_light(light, far):
    colour = np.array([20.0, 60, 110])
    apart = far * np.linalg.norm(colour) / 70
    assert alike(colour, light * colour) == pytest.approx(np.exp(-(apart**2)))


def test_colours_of_another_hue_are_the_less_alike_the_farther_they_are_apart():
    colour = np.array([0.0, 0, 100])
    for off in (30, 70, 140):
        assert alike(colour, colour + [off, 0, 0]) == pytest.approx(np.exp(-((off / 70) ** 2)))
    assert alike(np.zeros(3), np.array([0.0, 35, 0])) == pytest.approx(np.exp(-0.25))


def test_what_is_told_of_a_box_is_its_middle_its_size_and_most_of_its_area():
    frame = np.full((60, 80, 3), 90, np.uint8)
    box = np.array([20.0, 30, 12, 8])
    one = _boxed(frame, box, np.array([25.5, 33.5]))
    assert one.area == pytest.approx(0.8 * 96)
    np.testing.assert_array_equal(one.centre, [25.5, 33.5])
    np.testing.assert_array_equal(one.box, box)


def test_a_box_in_a_reduced_film_holds_what_is_there_in_a_quarter_of_the_pixels(tmp_path):
    frames = np.full((2, 120, 200, 3), 90, np.uint8)
    frames[:, 40:64, 100:140] = (30, 60, 200)
    path = write_video(tmp_path / "a.mov", frames)
    one = Pointer.of(Hint(0, (100, 40, 40, 24)), [[], []], 4, path).one
    # The reduced pixels 25 to 34 and 10 to 15.
    np.testing.assert_allclose(one.centre, [29.5, 12.5], atol=1e-9)
    np.testing.assert_allclose(one.box, [25, 10, 10, 6], atol=1e-9)
    np.testing.assert_allclose(one.colour, [30, 60, 200], atol=3)
    there = blob(29.5, 12.5, 8)
    assert Pointer.of(Hint(0, (100, 40, 40, 24)), [[there], []], 4, path).one.area == 64
    tiny = blob(29.5, 12.5, 3)  # covers too little of it
    assert Pointer.of(Hint(0, (100, 40, 40, 24)), [[tiny], []], 4, path).one.area > 40


@pytest.mark.parametrize(
    ("left", "top", "good"),
    [(-14, 40, True), (-15, 40, False), (185, 40, True), (186, 40, False),
     (90, -9, True), (90, -10, False), (90, 110, True), (90, 111, False)],
)  # fmt: skip
def test_the_middle_pixel_of_a_box_lies_in_the_image(tmp_path, left, top, good):
    path = write_video(tmp_path / "a.mov", np.zeros((2, 120, 200, 3), np.uint8))
    hint = Hint(0, (left, top, 30, 20))
    if good:
        assert Pointer.of(hint, [[], []], 1, path).one is not None
    else:
        with pytest.raises(ValueError, match="must have its middle in the image"):
            Pointer.of(hint, [[], []], 1, path)


@pytest.mark.parametrize(
    ("u", "v", "missed"),
    # The middle of the box is (40, 52): a pixel beyond its edges.
    [(45.4, 52, 0), (45.6, 52, 1), (34.6, 52, 0), (34.4, 52, 1),
     (40, 59.4, 0), (40, 59.6, 1), (40, 44.6, 0), (40, 44.4, 1)],
)  # fmt: skip
def test_a_track_may_be_a_pixel_outside_the_box(u, v, missed):
    pointer = Pointer.of(Hint(0, (36, 46, 9, 13)), FOUND, 1, "none.mov")
    assert len(pointer.missed(np.array([[u, v]]), np.eye(3)[None])) == missed


def test_a_candidate_of_three_times_the_size_is_worth_less_than_half_of_one_of_the_same():
    pointer = Pointer.of(Hint(0, (36, 46, 9, 9)), FOUND, 1, "none.mov")
    some = [[blob(40.0, 50.0, size) for size in (9, 27, 3, 10)]]
    same, large, small, near = (c.quality / 0.8 for c in pointer.like(some)[0])
    assert same == pytest.approx(1)
    assert large == pytest.approx(small) == pytest.approx(np.exp(-((np.log(9) / 2.2) ** 2)))
    assert 0.98 < near < 1


def test_the_smallest_box_has_the_colour_of_its_pixels():
    frame = np.full((60, 80, 3), 90, np.uint8)
    frame[30:32, 20:22] = (30, 60, 200)
    one = _boxed(frame, np.array([20.0, 30, 2, 2]), np.array([20.5, 30.5]))
    np.testing.assert_array_equal(one.colour, [30, 60, 200])
