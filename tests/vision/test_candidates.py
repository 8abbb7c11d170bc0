"""What differs from the background: how often it does in one place, and what that is worth."""

import tracemalloc

import cv2
import numpy as np
import pytest

from vidsindy_lite.vision.candidates import (
    Candidate,
    Difference,
    Plate,
    _are_shadows,
    _carry,
    _masked_median,
    _nearly_strongest,
    blobs,
    cores,
    tolerance,
    uncommon,
)

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


# ------------------------------------------------------------------------------------- the plate


def panned(u, v, size=(48, 36)):
    """A plate of 21 frames (width, height) of a camera that pans by (u, v) pixels in each."""
    maps = np.array([[[1, 0, u * k], [0, 1, v * k], [0, 0, 1.0]] for k in range(21)])
    samples = np.full((21, *size[::-1], 3), 100, np.uint8)
    return Plate(samples, maps, np.ones(21, bool))


def test_a_plate_reaches_as_far_as_all_frames_but_the_outermost_do():
    # From the second of 21 to the last but one: 54 pixels more than a frame, and 36.
    plate = panned(3, -2)
    assert plate.image.shape == (36 + 36, 48 + 54, 3)
    np.testing.assert_array_equal(plate.shift @ [3, -38, 1], [0, 0, 1])
    # In its corners it is shown by less than three frames.
    assert plate.valid[40, 50] == 255
    assert plate.valid[0, 0] == plate.valid[-1, -1] == 0


@pytest.mark.parametrize("pan", [(20, 0), (0, -15)])
def test_a_plate_of_a_camera_that_turns_far_shows_what_is_around_the_middle_of_its_way(pan):
    plate = panned(*pan)
    along = int(np.argmax(np.abs(pan)))
    size, frame = plate.image.shape[1::-1], (48, 36)
    assert 2.2 * frame[along] < size[along] < 2.6 * frame[along]
    assert size[1 - along] == frame[1 - along]
    middle = 10 * np.array(pan) + [23.5, 17.5]
    found = (np.array(size) - 1) / 2 - plate.shift[:2, 2]
    np.testing.assert_allclose(found, middle, atol=1)


def test_a_map_with_a_perspective_carries_points_as_opencv_does():
    here = np.array([[1.1, 0.1, 5], [-0.2, 0.9, 7], [1e-3, -2e-3, 1.25]])
    points = np.array([[0, 0], [30, 4], [17, 50.0]])
    expected = cv2.perspectiveTransform(points[None], here)[0]
    np.testing.assert_allclose(_carry(here, points), expected)


def test_a_window_of_the_samples_is_that_of_the_whole_plate():
    _, frames, maps = filmed([(2 * k, k) for k in range(FRAMES)])
    known = np.arange(FRAMES) != 3
    plate = Plate(frames, maps, known)
    views, shown = plate.samples(frames, maps, known, np.s_[:, :])
    part, told = plate.samples(frames, maps, known, np.s_[15:60, 9:140])
    np.testing.assert_array_equal(part, views[:, 15:60, 9:140])
    np.testing.assert_array_equal(told, shown[:, 15:60, 9:140])
    for k, i in enumerate(np.flatnonzero(known)):
        u, v = (maps[i] + plate.shift)[:2, 2].astype(int)  # where the frame lies in the plate
        left, top = max(u, 0), max(v, 0)
        inside = np.s_[top : v + HEIGHT, left : u + WIDTH]
        seen = views[k][inside]
        np.testing.assert_array_equal(
            seen, frames[i, top - v :, left - u :][: len(seen), : seen.shape[1]]
        )
        assert shown[k][inside].all()
        assert shown[k].sum() == seen.shape[0] * seen.shape[1]


def test_a_median_is_that_of_the_samples_that_show_a_place():
    rng = np.random.default_rng(0)
    samples = list(rng.integers(0, 256, (7, 150, 40, 3), np.uint8))
    moves = [np.array([[1, 0, 5 * k], [0, 1, 11 * k % 6], [0, 0, 1.0]]) for k in range(7)]
    median, count = _masked_median(samples, moves, (74, 157))
    canvas = np.full((7, 157, 74, 3), np.nan)
    for k, sample in enumerate(samples):
        canvas[k, 11 * k % 6 :][:150, 5 * k : 5 * k + 40] = sample
    shown = np.isfinite(canvas[..., 0]).sum(axis=0)
    np.testing.assert_array_equal(count, shown)
    odd = shown % 2 == 1  # else the upper or the lower of the two in the middle
    assert odd.mean() > 0.3
    np.testing.assert_array_equal(median[odd], np.nanmedian(canvas[:, odd], axis=0))


@pytest.mark.parametrize(("noise", "least"), [(0.5, 8), (3, 15), (30, 60)])
@pytest.mark.parametrize(("pan", "edge"), [(0, 0.12), (1, 0.5)])
def test_the_tolerance_is_five_times_the_noise_and_what_a_displaced_edge_does(
    noise, least, pan, edge
):
    scene = np.full((30, 50, 3), 100, np.uint8)
    scene[:, 25:] = 150
    samples = np.array([scene[:, pan * k : pan * k + 40] for k in range(5)])
    maps = np.array([[[1, 0, pan * k], [0, 1, 0], [0, 0, 1.0]] for k in range(5)])
    plate = Plate(samples, maps, np.ones(5, bool))
    found = tolerance(plate, noise)[15]
    step = int(np.argmax(plate.image[15, :, 0] > 125))
    known = plate.valid[15] > 0
    at = np.arange(len(found))
    near = (at == step) | (at == step - 1)
    np.testing.assert_allclose(found[near & known], least + 50 * edge, rtol=1e-6)
    np.testing.assert_allclose(found[~near & known], least, rtol=1e-6)
    assert (found[~known] > 255).all()
    assert (~known).any() == (pan > 0)


@pytest.mark.parametrize(
    ("centre", "share"),
    [((20, 30), 4 / 9), ((0, 0), 1 / 4), ((39, 30), 2 / 3), ((20, 59), 0), ((-3, 30), 0)],
)
def test_how_often_a_place_differs_is_the_mean_over_the_pixels_around_it(centre, share):
    """In half of the frames 8 pixels of 9 differ, 2 of 4 in a corner, all 6 at a border."""
    plate = Plate(
        np.full((3, 60, 40, 3), 100, np.uint8), np.array([np.eye(3)] * 3), np.ones(3, bool)
    )
    difference = Difference(plate, noise=1.0)
    difference.lights = [np.ones(3, np.float32)] * 6
    difference.often[29:32, 19:22] = 3
    difference.often[31, 21] = 0
    difference.often[0, 1] = difference.often[1, 0] = 3
    difference.often[29:32, 38:] = 4
    found = difference._shares(np.array([centre, (30, 10)], float), np.eye(3))
    np.testing.assert_allclose(found, [share, 0])


# ------------------------------------------------------------------------------------- the blobs


@pytest.mark.parametrize(("around", "is_core"), [(4.2, True), (5.0, False)])
def test_a_core_differs_twice_as_much_as_the_rest_of_its_whole(around, is_core):
    strength = np.zeros((40, 60), np.float32)
    strength[10:20, 20:50] = around
    strength[10:20, 25:35] = 9
    assert bool(cores((strength > 1).astype(np.uint8), strength)) == is_core


def found_in(*parts, colour=(20, 40, 220), behind=(90, 100, 110), factor=1.0):
    """The blobs of parts (left, top, width, height, strength) of a frame of 60 x 40 pixels."""
    strength = np.zeros((40, 60), np.float32)
    ground = np.full((40, 60, 3), behind, np.uint8)
    frame = ground.copy()
    for left, top, width, height, strong in parts:
        place = np.s_[top : top + height, left : left + width]
        strength[place], frame[place] = strong, colour
    mask = (strength > 0).astype(np.uint8)
    return blobs(mask, strength, frame, ground, np.full(3, factor, np.float32))


def test_a_blob_is_plainer_the_more_it_differs_and_the_larger_it_is_up_to_25_pixels():
    """Of 16 pixels, once beyond the tolerance by as much again, 4 x 1: 1 - exp(-4 / 4)."""
    (one,) = found_in((10, 20, 4, 4, 2.0))
    assert one.quality == pytest.approx(1 - np.exp(-1))
    assert one.area == 16
    np.testing.assert_array_equal(one.box, [10, 20, 4, 4])
    np.testing.assert_array_equal(one.centre, [11.5, 21.5])
    np.testing.assert_array_equal(one.colour, [20, 40, 220])
    (large,) = found_in((10, 20, 10, 5, 1.8))  # 5 x 0.8
    assert large.quality == pytest.approx(1 - np.exp(-1))
    (strong,) = found_in((10, 20, 3, 3, 5.0))  # 3 x 4
    assert strong.quality == pytest.approx(1 - np.exp(-3))


def test_the_plainest_blob_comes_first():
    found = found_in((2, 2, 2, 2, 1.5), (20, 5, 4, 4, 3.0), (30, 20, 6, 6, 2.0))
    assert [one.box[0] for one in found] == [20, 30, 2]


def test_single_pixels_are_blobs_only_if_strong_and_what_fills_the_image_is_none():
    found = found_in((5, 5, 1, 1, 2.9), (15, 5, 1, 1, 3.5), (25, 5, 2, 1, 1.5))
    assert sorted(one.box[0] for one in found) == [15, 25]
    # Of 2400 pixels 30 % are 720.
    assert len(found_in((5, 5, 30, 23, 2.0))) == 1
    assert len(found_in((5, 5, 30, 25, 2.0))) == 0


@pytest.mark.parametrize(
    ("left", "top", "touches"),
    [(0, 20, True), (56, 20, True), (20, 0, True), (20, 36, True), (1, 1, False), (55, 35, False)],
)
def test_what_touches_the_border_of_the_image_is_worth_less(left, top, touches):
    (one,) = found_in((left, top, 4, 4, 2.0))
    assert one.quality == pytest.approx((0.6 if touches else 1) * (1 - np.exp(-1)))


def test_a_blob_is_where_it_differs_most_and_of_the_colour_of_that_part():
    strength = np.zeros((40, 60), np.float32)
    frame = np.full((40, 60, 3), 100, np.uint8)
    strength[10:14, 20:30], frame[10:14, 20:30] = 3, (50, 60, 70)
    strength[14, 20:30], frame[14, 20:30] = 1.5, (75, 80, 85)  # its soft edge
    mask = (strength > 0).astype(np.uint8)
    ground = np.full_like(frame, 100)
    (one,) = blobs(mask, strength, frame, ground, np.array([1, 2, 0.5], np.float32))
    np.testing.assert_allclose(one.colour, [50, 30, 140])  # in the light of the plate
    # Rows 10 to 13 weigh 30 each and row 14 half as much: 12 + 2.5 / 9.
    np.testing.assert_allclose(one.centre, [24.5, (3 * 46 + 1.5 * 14) / 13.5])
    np.testing.assert_array_equal(one.box, [20, 10, 10, 5])
    assert one.area == 50


def test_a_shadow_is_worth_half():
    (lamp,) = found_in((10, 20, 4, 4, 2.0), colour=(20, 40, 220))
    (shadow,) = found_in((10, 20, 4, 4, 2.0), colour=(63, 70, 77))
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


def test_nearly_the_strongest_is_seven_tenths_of_what_a_tenth_exceeds():
    rng = np.random.default_rng(0)
    strong = np.concatenate(
        [rng.permutation(np.arange(1, 12)), rng.permutation(10 * np.arange(1, 22))]
    )
    part = np.repeat([1, 2, 3], [11, 21, 2])
    strong = np.append(strong, [5, 5])
    shuffled = rng.permutation(len(part))
    found = _nearly_strongest(
        part[shuffled], strong[shuffled].astype(np.float32), np.array([1, 2]), 4
    )
    # Of the tenth of 11, which is 10, and the nineteenth of 21, which is 190.
    np.testing.assert_allclose(found, [np.inf, 7, 133, np.inf])
