"""The parts of the background model by themselves, on arrays whose answer is known."""

import cv2
import numpy as np
import pytest

from vidsindy_lite.vision.background import (
    BackgroundModel,
    Blob,
    _unrest,
    displacement,
    track_blobs,
    view_distances,
    whole_views,
)
from vidsindy_lite.vision.rendering import Scene, render

SIZE = (128, 96)


@pytest.fixture(scope="module")
def texture():
    """A smooth random image, coarse pixels."""
    rng = np.random.default_rng(0)
    return cv2.GaussianBlur(rng.uniform(0, 255, (60, 80, 3)).astype(np.float32), (0, 0), 3) * 4


def test_one_push_or_one_change_of_light_is_unrest(texture):
    ground = 100 + texture / 20
    slope = np.gradient(ground, axis=(1, 0))
    rng = np.random.default_rng(2)
    changes = [rng.normal(0, 0.1, ground.shape).astype(np.float32) for _ in range(21)]

    def unrest(changes):
        return _unrest(ground, changes, displacement(ground, changes, 8.0), 8.0)

    assert unrest(changes) == ()
    pushed = [*changes[:20], changes[20] - (0.2 * slope[0]).astype(np.float32)]
    assert ["camera moves" in doubt for doubt in unrest(pushed)] == [True]
    dimmed = [*changes[:20], changes[20] - 0.05 * ground]
    assert any("light changes, by up to 5 %" in doubt for doubt in unrest(dimmed))
    lit = [*changes[:20], changes[20] + 0.9 * ground]
    assert any("light changes, by up to 90 %" in doubt for doubt in unrest(lit))


def blob(shape=(0, 0, 0, 0), area=400.0, inside=True, sound=True):
    return Blob(np.zeros(2), area, inside, np.array(shape, float) if sound else None)


def test_distances_of_views_from_the_commonest_one():
    # At an area of 400 pixels, shapes 0.6 / 20 = 0.03 apart are just alike.
    odd = [blob((0.06, 0, 0, 0)), blob((0, 0.3, 0, 0)), blob(area=800), None]
    unseen = [blob(inside=False), blob(sound=False)]
    distance = view_distances([*[blob()] * 20, *odd, *unseen])
    np.testing.assert_allclose(distance[:20], 0)
    np.testing.assert_allclose(distance[20:22], [2, 10])
    assert distance[22] == pytest.approx(np.log(2) * np.sqrt(800) / 0.6)
    assert np.isinf(distance[23:]).all()
    assert np.isinf(view_distances([None, None])).all()
    many = view_distances([*[blob()] * 250, blob((0, 0.3, 0, 0))])
    np.testing.assert_allclose(many, [*[0] * 250, 10])


def learned(samples):
    model = BackgroundModel(samples)
    model.learn_target(samples)
    return model


@pytest.mark.parametrize("variance", [0.0, 0.005])
def test_the_model_of_a_film(variance):
    truth = np.column_stack([np.linspace(20, 108, 45), 48 + 20 * np.sin(np.arange(45) / 5)])
    scene = Scene("bricks", size=16, noise_variance=variance, image_size=SIZE)
    frames = np.array(list(render(truth, scene, 1)))
    model = learned(frames[::2])
    clean = next(render([[np.nan, np.nan]], Scene("bricks", image_size=SIZE), 1)).astype(float)
    off = np.abs(model.background - clean)
    assert off.max() <= (0 if variance == 0 else 40)
    assert off.mean() <= (0 if variance == 0 else 6)
    assert model.noise == pytest.approx(255 * np.sqrt(variance), rel=0.15)
    assert model.area == pytest.approx(np.pi * 8**2, rel=0.2)
    assert model.unrest == ()
    blobs = list(track_blobs(model, frames))
    error = np.array([b.centroid for b in blobs]) - truth
    assert np.sqrt(np.mean(error**2)) < (0.01 if variance == 0 else 0.1)
    assert [b.area for b in blobs] == pytest.approx([np.pi * 8**2] * 45, rel=0.01 + 20 * variance)
    assert whole_views(view_distances(blobs)).mean() > 0.95
    near = model.search(frames[20])
    assert np.abs(near[0] - truth[20]).max() < 4
    assert 8 < near[1] < 24
    assert model.search(clean.astype(np.uint8)) is None or variance
    assert model.measure(frames[20], truth[20] + 30, 10) is None  # nothing there


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
    model = BackgroundModel(samples)
    model.learn_target(samples)
    assert model.shows_target() == shows
