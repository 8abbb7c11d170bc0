"""What is asked of many pixels against the plain way."""

import cv2
import numpy as np
import pytest

from vidsindy_lite.vision.background import changes, dot, hull, lengths, relit


@pytest.mark.parametrize("seed", range(5))
def test_the_hull_of_a_mask_is_that_of_all_its_pixels(seed):
    rng = np.random.default_rng(seed)
    noise = cv2.GaussianBlur(rng.normal(size=(40, 60)), (0, 0), 3)
    mask = (noise > 0.02) & (np.hypot(*np.ogrid[-20:20, -30:30]) < 19)
    at = np.argwhere(mask)[:, ::-1].astype(np.int32)
    plain = cv2.convexHull(at)[:, 0]
    assert len(plain) > 4
    assert set(map(tuple, hull(mask).tolist())) == set(map(tuple, plain.tolist()))
    np.testing.assert_array_equal(hull(mask[[20]][:, 10:11] | True), [[0, 0]])


def test_sums_over_the_colours():
    a, b = np.random.default_rng(0).normal(size=(2, 4, 5, 3)).astype(np.float32)
    np.testing.assert_allclose(dot(a, b), (a * b).sum(axis=2), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(lengths(a), np.linalg.norm(a, axis=2), rtol=1e-5)


def test_an_image_in_another_light():
    image = np.random.default_rng(0).integers(0, 256, (4, 5, 3), np.uint8)
    factor = np.array([0.5, 1.25, 2], np.float32)
    np.testing.assert_allclose(relit(image, factor), image * factor)


@pytest.mark.parametrize("factor", [0.5, 1.0, 1.5])
def test_what_is_saturated_differs_from_what_is_darker_only(factor):
    light = np.full(3, factor, np.float32)
    ground = np.full((1, 4, 3), 255, np.uint8)
    grey = np.array([255.0, 200, 130, 20])
    frame = grey.astype(np.uint8)[None, :, None].repeat(3, axis=2)
    found = changes(frame, ground, light)[0, :, 0]
    least = min(255 * factor, 255)  # the least that the ground may be in that light
    np.testing.assert_allclose(found, np.minimum(grey - least, 0), atol=1e-3)
    # What is not saturated differs from what is brighter, too, as far as a frame shows that.
    wall = np.full((1, 4, 3), 200, np.uint8)
    found = changes(frame, wall, light)[0, :, 0]
    np.testing.assert_allclose(found, grey - min(200 * factor, 255), atol=1e-3)
