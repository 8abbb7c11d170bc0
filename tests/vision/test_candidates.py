"""What differs from the background: how often it does in one place, and what that is worth."""

import tracemalloc

import cv2
import numpy as np
import pytest

from vidsindy_lite.vision.candidates import Candidate, Difference, Plate, cores, uncommon

WIDTH, HEIGHT, FRAMES = 160, 120, 12
SWAYING = np.array([70, 60])  # a place of the scene
RNG = np.random.default_rng(0)
SCENE = RNG.integers(90, 110, (HEIGHT + 40, WIDTH + 40, 1)).astype(np.uint8).repeat(3, axis=2)


def filmed(shifts):
    """Frames with something that is always there and something that travels; their maps."""
    plain, frames, maps = [], [], []
    for k, (u, v) in enumerate(shifts):
        window = np.s_[v : v + HEIGHT, u : u + WIDTH]
        plain.append(SCENE[window])
        marked = SCENE.copy()
        for left, top in (SWAYING, (30 + 10 * k, 90)):
            marked[top : top + 6, left : left + 6] = 250
        frames.append(marked[window])
        maps.append(np.array([[1, 0, u], [0, 1, v], [0, 0, 1.0]]))
    return np.array(plain), np.array(frames), np.array(maps)


@pytest.mark.parametrize(
    "shifts", [[(0, 0)] * FRAMES, [(k, 2 * k % 7) for k in range(FRAMES)]], ids=["still", "moving"]
)
def test_what_differs_in_the_same_place_all_the_time_is_worth_less(shifts):
    plain, frames, maps = filmed(shifts)
    plate = Plate(plain, maps, np.ones(FRAMES, bool))
    assert plate.moves == (shifts[1] != (0, 0))
    difference = Difference(plate, noise=1.0)
    found = [difference.candidates(*each) for each in zip(frames, maps, strict=True)]
    for k, (each, here) in enumerate(zip(found, maps, strict=True)):
        # In the frame, the middles of what sways and of what travels.
        sways, travels = np.array([SWAYING, (30 + 10 * k, 90)]) + 2.5 - here[:2, 2]
        (swaying,) = (one for one in each if np.hypot(*(one.centre - sways)) < 1)
        (travelling,) = (one for one in each if np.hypot(*(one.centre - travels)) < 1)
        first, second = difference.travelling(each, here)
        np.testing.assert_array_equal(first.centre, travelling.centre)
        assert first.quality == pytest.approx(travelling.quality * (1 - 1 / FRAMES))
        assert second.quality == pytest.approx(0.4 * swaying.quality)


def test_of_a_crowd_of_like_things_none_is_worth_much():
    def one(colour, area=50.0):
        return Candidate(np.zeros(2), np.array([0, 0, 8, 8.0]), area, np.array(colour, float), 0.8)

    leaves = [one((50 + k, 70, 60)) for k in range(8)]
    others = [one((30, 30, 210)), one((35, 30, 210)), one((50, 70, 60), 500.0)]
    worth = [each.quality for each in uncommon(leaves + others, 1)]
    assert worth == pytest.approx([0.8 * 2 / 8] * 8 + [0.8] * 3)
    assert [each.quality for each in uncommon(leaves, 7)] == pytest.approx([0.8] * 8)
    assert uncommon([], 1) == []


def test_a_plate_makes_no_copies_of_its_samples():
    samples = np.random.default_rng(0).integers(0, 256, (21, 3000, 40, 3), np.uint8)
    maps = np.array([[[1, 0, k % 3], [0, 1, k % 2], [0, 0, 1.0]] for k in range(21)])
    tracemalloc.start()
    plate = Plate(samples, maps, np.ones(21, bool))
    plate.samples(samples, maps, np.ones(21, bool), np.s_[10:20, 10:20])
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < samples.nbytes / 2


@pytest.mark.parametrize("moves", [False, True])
def test_every_third_pixel_of_a_plate_is_that_of_the_whole(moves):
    _, frames, maps = filmed([(moves * k, 0) for k in range(FRAMES)])
    plate = Plate(frames, maps, np.ones(FRAMES, bool))
    whole, thin = (plate.seen_from(maps[4], [5, 2], (70, 50), step) for step in (1, 3))
    assert thin[0].shape == (17, 24, 3)
    for one, other in zip(whole, thin, strict=True):
        np.testing.assert_array_equal(one[::3, ::3], other)


def test_what_differs_much_more_than_that_with_which_it_is_in_one_piece_is_a_core():
    strength = np.zeros((60, 80), np.float32)
    strength[10:50, 10:70] = 1.5  # a wide change of the light
    strength[20:30, 20:30] = 9
    strength[22:26, 22:26] = 40  # of what is in it, too small for one
    mask = (strength > 1).astype(np.uint8)
    (core,) = cores(mask, strength)
    assert core.sum() == 100
    assert core[20:30, 20:30].all()
    strength[10:50, 10:70] = 1.5
    strength[10:50, 10:70:2] = 9  # of a person, many parts differ as much
    assert not cores(mask, strength)
    strength[strength < 9] = 0
    assert not cores((strength > 1).astype(np.uint8), strength)  # one alone is no core of itself


def test_cores_are_sought_only_where_a_whole_is_large_enough(monkeypatch):
    seen, count = [], cv2.connectedComponentsWithStats
    monkeypatch.setattr(
        cv2, "connectedComponentsWithStats", lambda mask: seen.append(mask.shape) or count(mask)
    )
    strength = np.zeros((60, 80), np.float32)
    strength[10:17, 10:17] = 20  # 49 pixels, of which no part has 25 and less than a half
    assert not cores((strength > 1).astype(np.uint8), strength)
    assert seen == [(60, 80)]
    strength[30:50, 40:70] = 3
    assert not cores((strength > 1).astype(np.uint8), strength)
    assert seen[1:] == [(60, 80), (20, 30)]  # at the one level that any part of it exceeds


def test_a_target_is_told_from_a_faint_change_that_it_meets():
    plain, _, maps = filmed([(0, 0)] * FRAMES)
    frame = plain[0].copy()
    frame[20:100, 30:120] += 15
    frame[60:70, 80:90] = 250
    difference = Difference(Plate(plain, maps, np.ones(FRAMES, bool)), noise=1.0)
    found = difference.candidates(frame, maps[0])
    (core,) = (one for one in found if abs(one.area - 100) < 10)
    np.testing.assert_allclose(core.centre, [84.5, 64.5], atol=0.1)
    assert core.colour.min() > 200
