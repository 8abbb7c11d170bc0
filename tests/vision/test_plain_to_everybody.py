"""Films in which anybody sees the target: it circles in its place, on ground that turns, mixed."""

import cv2
import numpy as np
import pytest

from vidsindy_lite import Hint, track, write_video

N = 80
ANGLE = 2 * np.pi * np.arange(N) / 60


def texture(rng, width, height):
    rough = (
        s * cv2.GaussianBlur(rng.normal(size=(height, width, 3)).astype(np.float32), (0, 0), s)
        for s in (2, 8, 32)
    )
    back = sum(rough)
    return 110 + 30 * back / back.std()


def disc(image, place, radius, colour):
    centre = tuple(np.rint(16 * np.asarray(place)).astype(int).tolist())
    cv2.circle(image, centre, round(16 * radius), colour, -1, cv2.LINE_AA, 4)


def around(place, side):
    return Hint(frame=10, box=(*(place[10] - side / 2), side, side))


@pytest.mark.parametrize("hinted", [False, True])
@pytest.mark.parametrize("flicker", [0.0, 0.03])
def test_a_ball_that_circles_within_a_few_of_its_own_widths(tmp_path, flicker, hinted):
    rng = np.random.default_rng(0)
    truth = [160, 90] + [18, 26] * np.column_stack([np.sin(ANGLE), np.sin(2.3 * ANGLE + 1)])
    back = texture(rng, 320, 180)

    def frames():
        for i, place in enumerate(truth):
            image = back.copy()
            disc(image, place, 9, (30, 30, 220))
            image = (1 + flicker * np.sin(2 * i)) * image + rng.normal(0, 2, image.shape)
            yield np.clip(image, 0, 255).astype(np.uint8)

    path = write_video(tmp_path / "ball.mov", frames())
    found = track(path, target=around(truth, 22) if hinted else None)
    error = np.linalg.norm(found.pixels - truth, axis=1)
    assert np.isfinite(error).mean() >= 0.95
    assert np.nanpercentile(error, 95) < 1


@pytest.mark.parametrize("hinted", [False, True])
@pytest.mark.parametrize("radius", [30, 45])
def test_a_large_ball_that_never_leaves_its_own_ground(tmp_path, radius, hinted):
    rng = np.random.default_rng(2)
    leaves = 0.45 * radius * np.column_stack([np.sin(ANGLE), np.sin(2.3 * ANGLE + 1)])
    truth, back = [160, 90] + leaves, texture(rng, 320, 180)

    def frames():
        for place in truth:
            image = back.copy()
            disc(image, place, radius, (210, 60, 30))
            image += rng.normal(0, 2, image.shape)
            yield np.clip(image, 0, 255).astype(np.uint8)

    path = write_video(tmp_path / "ball.mov", frames())
    found = track(path, target=around(truth, 2 * radius + 4) if hinted else None)
    error = np.linalg.norm(found.pixels - truth, axis=1)
    assert np.isfinite(error).mean() >= 0.95
    assert np.nanpercentile(error, 95) < 1
    assert not found.warnings


@pytest.mark.parametrize("hinted", [False, True])
def test_a_mark_on_a_wheel_whose_tyre_differs_from_the_ground_all_the_time(tmp_path, hinted):
    rng = np.random.default_rng(1)
    back = texture(rng, 240, 200)
    grey = rng.uniform(30, 150, 60)
    truth = [120, 100] + 70 * np.column_stack([np.cos(ANGLE), -np.sin(ANGLE)])

    def frames():
        for angle, place in zip(ANGLE, truth, strict=True):
            image = back.copy()
            for k, level in enumerate(grey):
                start = -np.degrees(angle) + 6 * k
                cv2.ellipse(image, (120, 100), (70, 70), 0, start, start + 6, (level,) * 3, 14)
            disc(image, place, 7, (110, 230, 40))
            image += rng.normal(0, 2, image.shape)
            yield np.clip(image, 0, 255).astype(np.uint8)

    path = write_video(tmp_path / "wheel.mov", frames())
    found = track(path, target=around(truth, 17) if hinted else None)
    error = np.linalg.norm(found.pixels - truth, axis=1)
    assert np.isfinite(error).mean() >= 0.95
    assert np.nanpercentile(error, 95) < 1.5


@pytest.mark.parametrize("mixed", [0.0, 0.5, 0.7])
def test_a_colour_that_the_film_shows_mixed_with_its_ground_is_not_lost(tmp_path, mixed):
    rng = np.random.default_rng(3)
    back = texture(rng, 240, 200)
    truth = [120, 100] + 70 * np.column_stack([np.cos(ANGLE), -np.sin(ANGLE)])

    def frames():
        for place in truth:
            drawn = back.copy()
            disc(drawn, place, 8, (40, 230, 110))
            image = mixed * back + (1 - mixed) * drawn + rng.normal(0, 2, back.shape)
            yield np.clip(image, 0, 255).astype(np.uint8)

    path = write_video(tmp_path / "disc.mov", frames())
    found = track(path, target=Hint(colour=(40, 230, 110)))
    error = np.linalg.norm(found.pixels - truth, axis=1)
    assert np.isfinite(error).mean() >= 0.95
    assert np.nanpercentile(error, 95) < 1.5
    assert any("has the colour" in doubt for doubt in found.warnings) == (mixed > 0.4)


def test_what_is_in_a_box_is_followed_though_something_plainer_moves(tmp_path):
    rng = np.random.default_rng(4)
    back = texture(rng, 240, 200)
    truth = np.column_stack([30 + 2.0 * np.arange(N), 150 + 10 * np.sin(ANGLE)])
    plainer = [120, 60] + [90, 30] * np.column_stack([np.cos(ANGLE), np.sin(ANGLE)])

    def frames():
        for place, other in zip(truth, plainer, strict=True):
            image = back.copy()
            disc(image, other, 10, (20, 20, 230))
            disc(image, place, 6, (60, 60, 60))
            image += rng.normal(0, 2, image.shape)
            yield np.clip(image, 0, 255).astype(np.uint8)

    path = write_video(tmp_path / "two.mov", frames())
    found = track(path, target=around(truth, 15))
    error = np.linalg.norm(found.pixels - truth, axis=1)
    assert np.isfinite(error).mean() >= 0.9
    assert np.nanpercentile(error, 95) < 2
    assert not any("is not seen in that frame" in doubt for doubt in found.warnings)
    assert np.isfinite(error[10])
    np.testing.assert_array_equal(np.asarray(found), found.pixels)
