"""The ground: what frames show together, what a target hides, how exactly it is known."""

import cv2
import numpy as np
import pytest

from vidsindy_lite.vision.background import (
    Plate,
    least_difference,
    lights_of,
    noise_of,
    tolerance,
)


def panned(u, v, size=(48, 36)):
    """A plate of 21 frames (width, height) of a camera that pans by (u, v) pixels in each."""
    maps = np.array([[[1, 0, u * k], [0, 1, v * k], [0, 0, 1.0]] for k in range(21)])
    samples = np.full((21, *size[::-1], 3), 100, np.uint8)
    return Plate(samples, maps, np.ones(21, bool))


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


@pytest.mark.parametrize("pan", [0, 2])
def test_ground_that_a_target_hides_is_what_is_seen_of_it_or_what_is_around_it(pan):
    """A dark disc that turns about its place, whose middle hides its ground in all frames."""
    ground = np.full((80, 140, 3), 150, np.uint8)
    ground[:, 70:] = 160
    maps = np.array([[[1, 0, pan * k], [0, 1, 0], [0, 0, 1.0]] for k in range(9)])
    at = np.array([[70 + 5 * np.cos(k), 40 + 5 * np.sin(k)] for k in range(9)])
    samples = []
    for k, place in enumerate(at):
        scene = ground.copy()
        cv2.circle(scene, tuple(np.rint(16 * place).astype(int)), 16 * 10, 0, -1, cv2.LINE_AA, 4)
        samples.append(scene[:, pan * k : pan * k + 120])
    boxes = np.column_stack([at - [pan, 0] * np.arange(9)[:, None] - 10, np.full((9, 2), 21.0)])
    known = np.ones(9, bool)
    covered = Plate(np.array(samples), maps, known)
    view, _ = covered.seen_from(maps[4], low := np.array([60 - 4 * pan, 30]), low + 20)
    assert view.min() < 50
    bare = Plate(np.array(samples), maps, known, boxes)
    view, shown = bare.seen_from(maps[4], low - 10, low + 30)
    assert shown.all()
    assert view.min() >= 148
    assert view.max() <= 165


@pytest.mark.parametrize("pan", [0, 4])
def test_a_plate_is_of_one_light_though_the_exposure_changes(pan):
    rng = np.random.default_rng(0)
    ground = cv2.resize(rng.integers(60, 160, (12, 20, 3)).astype(np.uint8), (200, 120))
    exposure = np.linspace(0.7, 1.4, 15)
    samples = np.array([(a * ground[:, pan * k :][:, :140]).round().astype(np.uint8)
                        for k, a in enumerate(exposure)])  # fmt: skip
    maps = np.array([[[1, 0, pan * k], [0, 1, 0], [0, 0, 1.0]] for k in range(15)])
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
    maps = np.array([[[1, 0, pan * k], [0, 1, 0], [0, 0, 1.0]] for k in range(5)])
    plate = Plate(samples, maps, np.ones(5, bool))
    found = tolerance(plate.image, least_difference(noise), moves=plate.moves)[15]
    step = int(np.argmax(plate.image[15, :, 0] > 125))
    known = plate.valid[15] > 0
    at = np.arange(len(found))
    near = (at == step) | (at == step - 1)
    np.testing.assert_allclose(found[near & known], least + 50 * edge, rtol=1e-6)
    np.testing.assert_allclose(found[~near & known], least, rtol=1e-6)
    assert (~known).any() == (pan > 0)


def test_the_noise_of_a_film_is_that_of_its_samples():
    light = 0.8
    rng = np.random.default_rng(0)
    ground = rng.uniform(80, 200, (90, 120, 3))
    samples = light ** (np.arange(21) % 2)[:, None, None, None] * ground
    samples = (samples + rng.normal(0, 6, samples.shape)).round().astype(np.uint8)
    maps = np.array([np.eye(3)] * 21)
    plate = Plate(samples, maps, np.ones(21, bool))
    plate.image = ground.round().astype(np.uint8)
    assert noise_of(samples, maps, plate) == pytest.approx(6, rel=0.1)
