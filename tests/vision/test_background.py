"""The parts of the background model by themselves, on arrays whose answer is known."""

import cv2
import numpy as np
import pytest

from vidsindy_lite.vision.background import (
    BackgroundModel,
    Plate,
    least_difference,
    lights_of,
    noise_of,
    tolerance,
)

SIZE = (128, 96)


def learned(samples):
    model = BackgroundModel(samples)
    model.learn_target(samples)
    return model


GROUND, TARGET = (90, 100, 110), (20, 40, 220)


def squares(*boxes, colour=TARGET):
    """A frame with squares (left, top, side), on whole pixels."""
    frame = np.full((SIZE[1], SIZE[0], 3), GROUND, np.uint8)
    for left, top, side in boxes:
        frame[max(top, 0) : top + side, max(left, 0) : left + side] = colour
    return frame


@pytest.fixture(scope="module")
def plain():
    """A model that has seen a square of 16 pixels in 20 places."""
    return learned(np.array([squares((4 + 5 * i, 4 + 3 * i, 16)) for i in range(20)]))


@pytest.mark.parametrize(
    ("left", "top", "inside"),
    [(40, 24, True), (1, 1, True), (111, 79, True),
     (0, 30, False), (30, 0, False), (112, 30, False), (30, 80, False)],
)  # fmt: skip
def test_a_square_is_measured_exactly_and_at_the_border_it_may_go_on(plain, left, top, inside):
    blob = plain.measure(squares((left, top, 16)), np.array([left + 7.5, top + 7.5]), 14)
    np.testing.assert_allclose(blob.centroid, [left + 7.5, top + 7.5], atol=1e-3)
    assert blob.area == pytest.approx(16**2, rel=1e-3)
    assert blob.inside == inside


@pytest.mark.parametrize(("side", "is_target"), [(6, False), (8, True), (32, True), (40, False)])
def test_what_has_five_times_the_area_of_the_target_or_a_fifth_is_none(plain, side, is_target):
    found = plain.measure(squares((30, 30, side)), np.full(2, 30 + (side - 1) / 2), 30)
    assert (found is not None) == is_target


def test_a_target_of_several_colours_is_told():
    def film(width):
        frames = [squares((4 + 5 * i, 4 + 3 * i, 16)) for i in range(20)]
        for i, frame in enumerate(frames):
            frame[4 + 3 * i : 20 + 3 * i, 4 + 5 * i : 4 + 5 * i + width] = (120, 100, 10)
        return np.array(frames)

    assert not learned(film(0)).several_colours
    assert not learned(film(4)).several_colours
    assert learned(film(6)).several_colours


@pytest.mark.parametrize(("left", "top"), [(40, 24), (112, 80)])
def test_a_square_that_stays_in_most_samples_is_no_background(left, top):
    stays = [squares((left, top, 16))] * 13
    leaves = [squares((76 + i, 4 + i, 16)) for i in range(0, 16, 2)]
    model = learned(np.array(stays + leaves))
    np.testing.assert_array_equal(model.background, squares())
    assert model.area == 16**2


@pytest.mark.parametrize(("reach", "shows"), [(3, True), (7, True), (30, False)])
def test_a_part_of_a_target_that_is_in_the_background_shows(reach, shows):
    """A disc that turns around a place: all of its views cover what is within 9 - `reach` of it."""
    samples = np.full((21, 90, 120, 3), 150, np.uint8)
    for k, sample in enumerate(samples):
        place = [60 + reach * np.cos(2.4 * k), 45 + reach * np.sin(2.4 * k)]
        cv2.circle(sample, tuple(np.rint(16 * np.array(place)).astype(int)), 16 * 9, (20, 30, 220),
                   -1, cv2.LINE_AA, 4)  # fmt: skip
    assert learned(samples).shows_target() == shows


def panning(frames, u, v=0):
    """Maps of a camera that pans by (u, v) pixels in each frame."""
    return np.array([[[1, 0, u * k], [0, 1, v * k], [0, 0, 1.0]] for k in range(frames)])


@pytest.mark.parametrize("pan", [(20, 0), (0, -15)])
def test_a_plate_of_a_camera_that_turns_far_shows_what_is_around_the_middle_of_its_way(pan):
    samples = np.full((21, 36, 48, 3), 100, np.uint8)
    plate = Plate(samples, panning(21, *pan), np.ones(21, bool))
    along = int(np.argmax(np.abs(pan)))
    size, frame = plate.image.shape[1::-1], (48, 36)
    assert 2.2 * frame[along] < size[along] < 2.6 * frame[along]
    assert size[1 - along] == frame[1 - along]
    middle = 10 * np.array(pan) + [23.5, 17.5]
    found = (np.array(size) - 1) / 2 - plate.shift[:2, 2]
    np.testing.assert_allclose(found, middle, atol=1)


@pytest.mark.parametrize("pan", [0, 4])
def test_a_plate_is_of_one_light_though_the_exposure_changes(pan):
    rng = np.random.default_rng(0)
    ground = cv2.resize(rng.integers(60, 160, (12, 20, 3)).astype(np.uint8), (200, 120))
    exposure = np.linspace(0.7, 1.4, 15)
    samples = np.array([(a * ground[:, pan * k :][:, :140]).round().astype(np.uint8)
                        for k, a in enumerate(exposure)])  # fmt: skip
    maps = panning(15, pan)
    known = np.ones(15, bool)
    lights = lights_of(samples, maps, known)
    ratio = lights / exposure[:, None]
    np.testing.assert_allclose(ratio / ratio[7], 1, atol=0.04)
    plain = Plate(samples, maps, known)
    even = Plate(samples, maps, known, lights=lights)
    shown, _ = even.seen_from(maps[7])
    light = shown / ground[:, 7 * pan :][:, :140]
    assert light.std() < 0.01 * light.mean()
    if pan:  # else each place is shown in all lights
        assert noise_of(samples, maps, plain) > 2 * noise_of(samples, maps, even)


@pytest.mark.parametrize(
    ("noise", "least", "pan", "edge"), [(0.5, 8, 0, 0.12), (3, 15, 1, 0.5), (30, 60, 1, 0.5)]
)
def test_the_tolerance_is_five_times_the_noise_and_what_a_displaced_edge_does(
    noise, least, pan, edge
):
    scene = np.full((30, 50, 3), 100, np.uint8)
    scene[:, 25:] = 150
    samples = np.array([scene[:, pan * k : pan * k + 40] for k in range(5)])
    plate = Plate(samples, panning(5, pan), np.ones(5, bool))
    found = tolerance(plate.image, least_difference(noise), moves=plate.moves)[15]
    step = int(np.argmax(plate.image[15, :, 0] > 125))
    known = plate.valid[15] > 0
    at = np.arange(len(found))
    near = (at == step) | (at == step - 1)
    np.testing.assert_allclose(found[near & known], least + 50 * edge, rtol=1e-6)
    np.testing.assert_allclose(found[~near & known], least, rtol=1e-6)
    assert (~known).any() == (pan > 0)
