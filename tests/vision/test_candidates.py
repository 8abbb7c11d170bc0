"""What differs from the ground or from other frames: where, how large, how plainly."""

import numpy as np
import pytest

from vidsindy_lite.vision.candidates import (
    Candidates,
    _are_shadows,
    _with_neighbours,
    candidates,
    components,
    uncommon,
)
from vidsindy_lite.vision.plate import Plate

RNG = np.random.default_rng(0)
GROUND = RNG.integers(90, 110, (120, 160, 1)).astype(np.uint8).repeat(3, axis=2)
EYES = np.tile(np.eye(3), (12, 1, 1))


def test_a_target_is_told_from_a_faint_change_that_it_meets():
    frame = GROUND.copy()
    frame[20:100, 30:120] += 15
    frame[60:70, 80:90] = 250
    plate = Plate(np.array([GROUND] * 3), EYES[:3], np.ones(3, bool))
    found, _ = candidates([frame], EYES[:1], plate, 1.0)
    plainest = found.only(np.array([found.quality.argmax()]))
    np.testing.assert_allclose(plainest.centre, [[84.5, 64.5]], atol=0.2)
    assert plainest.area == pytest.approx(100, abs=10)
    assert plainest.colour.min() > 200
    assert plainest.behind.max() < 130


def test_what_moves_before_ground_that_the_plate_does_not_know_differs_from_its_neighbours():
    """The plate shows nothing of a strip that has turned bright; a dark square passes there."""
    plate = Plate(np.array([GROUND] * 3), EYES[:3], np.ones(3, bool))
    frames = []
    for k in range(12):
        frame = GROUND.copy()
        frame[40:80] += 120
        frame[55:65, 10 + 12 * k : 20 + 12 * k] = 0
        frames.append(frame)
    found, lights = candidates(frames, EYES, plate, 1.0)
    assert len(lights) == 12
    for k in range(3, 9):
        here = found.only(found.frame == k)
        apart = np.linalg.norm(here.centre - [14.5 + 12 * k, 59.5], axis=1)
        assert (here.quality[apart < 1] > 0.4).any()


def test_neighbours_are_three_frames_before_and_after():
    frames = [np.full((2, 2, 3), k, np.uint8) for k in range(8)]
    beside = [
        (int(frame[0, 0, 0]), [int(other[0, 0, 0]) for other, _ in others])
        for frame, _, others in _with_neighbours(frames, EYES)
    ]
    assert beside == [
        (0, [3]), (1, [4]), (2, [5]), (3, [0, 6]), (4, [1, 7]), (5, [2]), (6, [3]), (7, [4]),
    ]  # fmt: skip


def test_of_a_crowd_of_like_things_none_is_worth_much():
    n = 11
    centre = np.column_stack([20.0 * np.arange(n), np.zeros(n)])
    colour = np.array([(50 + k, 70, 60) for k in range(8)] + [(30, 30, 210), (35, 30, 210),
                                                            (50, 70, 60)], float)  # fmt: skip
    area = np.array([50.0] * 10 + [500.0])
    found = Candidates(np.zeros(n, int), centre, centre, np.zeros((n, 4)), area, colour,
                       np.zeros((n, 3)), np.full(n, 0.8))  # fmt: skip
    assert uncommon(found, 1).quality == pytest.approx([0.8 * 2 / 8] * 8 + [0.8] * 3)
    leaves = found.only(np.arange(8))
    assert uncommon(leaves, 7).quality == pytest.approx([0.8] * 8)
    # The same thing at several levels is no crowd.
    alone = leaves._replace(centre=np.zeros((8, 2)))
    assert uncommon(alone, 1).quality == pytest.approx([0.8] * 8)
    assert len(uncommon(found.only(np.arange(0)), 1).quality) == 0


# -------------------------------------------------------------------------------- what is connected


def found_in(*parts, colour=(20, 40, 220), behind=(90, 100, 110), level=1.0):
    """What is connected of parts (left, top, width, height, strength) of a frame of 60 x 40."""
    strength = np.zeros((40, 60), np.float32)
    ground = np.full((40, 60, 3), behind, np.uint8)
    frame = ground.copy()
    for left, top, width, height, strong in parts:
        place = np.s_[top : top + height, left : left + width]
        strength[place], frame[place] = strong, colour
    return Candidates.of(7, np.eye(3), components(strength, level, frame, ground))


def test_a_thing_is_where_it_differs():
    one = found_in((10, 20, 4, 4, 2.0))
    np.testing.assert_array_equal(one.frame, [7])
    np.testing.assert_array_equal(one.box, [[10, 20, 4, 4]])
    np.testing.assert_allclose(one.centre, [[11.5, 21.5]])
    np.testing.assert_array_equal(one.colour, [[20, 40, 220]])
    np.testing.assert_array_equal(one.behind, [[90, 100, 110]])
    assert one.area == 16
    assert len(found_in((10, 20, 4, 4, 2.0), level=2.5).frame) == 0


def test_a_thing_is_plainer_the_more_it_differs_and_the_larger_it_is_up_to_8_pixels():
    assert found_in((10, 20, 4, 4, 2.0)).quality == pytest.approx(np.tanh(0.5))
    assert found_in((10, 20, 9, 6, 8.0)).quality == pytest.approx(np.tanh(2))
    assert found_in((10, 20, 2, 2, 8.0)).quality == pytest.approx(np.tanh(2) / 2)


def test_what_fills_the_image_and_what_is_of_two_pixels_is_nothing():
    assert len(found_in((5, 5, 2, 1, 9.0)).frame) == 0
    # Of 2400 pixels 30 % are 720.
    assert len(found_in((5, 5, 30, 23, 2.0)).frame) == 1
    assert len(found_in((5, 5, 30, 25, 2.0)).frame) == 0


@pytest.mark.parametrize(
    ("left", "top", "touches"),
    [(0, 20, True), (56, 20, True), (20, 0, True), (20, 36, True), (2, 2, False), (54, 34, False)],
)
def test_what_touches_the_border_of_the_image_is_worth_less(left, top, touches):
    one = found_in((left, top, 4, 4, 2.0))
    assert one.quality == pytest.approx((0.6 if touches else 1) * np.tanh(0.5))


def test_a_shadow_is_worth_half():
    lamp = found_in((10, 20, 4, 4, 2.0), colour=(20, 40, 220))
    shadow = found_in((10, 20, 4, 4, 2.0), colour=(63, 70, 77))
    assert shadow.quality == pytest.approx(lamp.quality / 2)


def test_shadows_are_darker_by_about_the_same_factor_in_all_colours():
    ground = np.array([100, 150, 200.0])
    for share, is_shadow in ((0.3, False), (0.4, True), (0.6, True), (0.9, True), (0.98, False)):
        assert _are_shadows(share * ground[None], ground[None]).item() == is_shadow
    coloured = ground * [0.55, 0.65, 0.6]
    assert not _are_shadows(coloured[None], ground[None]).item()
    # The darker the ground, the less its colours tell.
    assert _are_shadows(np.array([[3, 10, 3.5]]), np.array([[6, 16, 6.0]])).item()
    assert not _are_shadows(10 * np.array([[3, 10, 3.5]]), 10 * np.array([[6, 16, 6.0]])).item()
