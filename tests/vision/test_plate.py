"""The parts of the background model by themselves, on arrays whose answer is known."""

import cv2
import numpy as np
import pytest

from vidsindy_lite.vision.plate import Plate, least_difference, lights_of, noise_of, tolerance

SIZE = (128, 96)


def panning(frames, u, v=0):
    """Maps of a camera that pans by (u, v) pixels in each frame."""
    return np.array([[[1, 0, u * k], [0, 1, v * k], [0, 0, 1.0]] for k in range(frames)])


@pytest.mark.parametrize("pan", [(20, 0), (0, -15)])
def test_a_plate_of_a_camera_that_turns_far_shows_what_is_around_the_middle_of_its_way(pan):
    samples = np.full((21, 36, 48, 3), 100, np.uint8)
    plate = Plate(samples, panning(21, *pan))
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
    lights = lights_of(samples, maps, np.ones(15, bool))
    ratio = lights / exposure[:, None]
    np.testing.assert_allclose(ratio / ratio[7], 1, atol=0.04)
    plain = Plate(samples, maps)
    even = Plate(samples, maps, lights=lights)
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
    plate = Plate(samples, panning(5, pan))
    found = tolerance(plate.image, least_difference(noise), moves=plate.moves)[15]
    step = int(np.argmax(plate.image[15, :, 0] > 125))
    known = plate.valid[15] > 0
    at = np.arange(len(found))
    near = (at == step) | (at == step - 1)
    np.testing.assert_allclose(found[near & known], least + 50 * edge, rtol=1e-6)
    np.testing.assert_allclose(found[~near & known], least, rtol=1e-6)
    assert (~known).any() == (pan > 0)
