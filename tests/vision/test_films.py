"""Films in which anybody sees the target, whatever happens while they run: none goes unsaid."""

import cv2
import numpy as np
import pytest

from vidsindy_lite import Hint, track, write_video
from vidsindy_lite.vision import Track
from vidsindy_lite.vision.moving import unsure
from vidsindy_lite.vision.refining import roughness
from vidsindy_lite.vision.rendering import BACKGROUNDS

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

    return image


def around(place, side, frame=10):
    return Hint(frame=frame, box=(*(place[frame] - side / 2), side, side))


def painted(folder, ground, draw, n, noise=2.0, seed=0):
    """A film of which `draw` paints each frame on a ground."""
    rng = np.random.default_rng(seed)

    def frames():
        for i in range(n):
            image = draw(ground.copy(), i)
            image = image + noise * rng.normal(size=image.shape)
            yield np.clip(image, 0, 255).astype(np.uint8)

    return write_video(folder / "film.mov", frames())


def followed(path, truth, target=None, least=0.95):
    """Track, and its errors."""
    found = track(path, target=target)
    error = np.linalg.norm(found.pixels - truth, axis=1)
    assert np.isfinite(error).mean() >= least
    return found, error


def test_a_large_ball_that_never_leaves_its_own_ground(tmp_path):
    radius = 45
    leaves = 0.45 * radius * np.column_stack([np.sin(ANGLE), np.sin(2.3 * ANGLE + 1)])
    truth = [160, 90] + leaves

    def draw(image, i):
        return disc(image, truth[i], radius, (210, 60, 30))

    path = painted(tmp_path, texture(np.random.default_rng(2), 320, 180), draw, N)
    found, error = followed(path, truth, around(truth, 2 * radius + 4))
    assert np.nanpercentile(error, 95) < 1
    assert not found.warnings


ROUND = [120, 100] + 70 * np.column_stack([np.cos(ANGLE), -np.sin(ANGLE)])


@pytest.mark.parametrize("mixed", [0.0, 0.7])
def test_a_colour_that_the_film_shows_mixed_with_its_ground_is_not_lost(tmp_path, mixed):
    def draw(image, i):
        return mixed * image + (1 - mixed) * disc(image.copy(), ROUND[i], 8, (40, 230, 110))

    path = painted(tmp_path, texture(np.random.default_rng(3), 240, 200), draw, N)
    found, error = followed(path, ROUND, Hint(colour=(40, 230, 110)))
    assert np.nanpercentile(error, 95) < 1.5
    assert any("has the colour" in doubt for doubt in found.warnings) == (mixed > 0.4)


SIZE = 200, 150
LENGTH = 60
BALL = 6


def places(n=LENGTH):
    s = 2 * np.pi * np.arange(n) / n
    return np.column_stack([100 + 60 * np.sin(2 * s), 75 + 45 * np.sin(3 * s + 1)])


BRICKS = cv2.GaussianBlur(BACKGROUNDS["bricks"](np.random.default_rng(1), SIZE), (0, 0), 1)


def film(folder, change, truth=None):
    """A red ball before bricks; `change` of an image and its number happens afterwards."""
    truth = places() if truth is None else truth

    def draw(image, i):
        return change(disc(image, truth[i], BALL, (30, 40, 220)), i)

    return painted(folder, BRICKS, draw, len(truth), 0)


@pytest.mark.parametrize(
    "light",
    [lambda i: 0.8 + 0.15 * np.sin(1.7 * i), lambda i: 1.0 if i < 54 else 0.7],
    ids=["flicker", "late"],
)
def test_changing_light_loses_no_frames(tmp_path, light):
    path = film(tmp_path, lambda image, i: light(i) * image)
    assert np.nanmax(followed(path, places())[1]) < 0.5
    assert any("the light changes" in doubt for doubt in track(path, "background").warnings)


@pytest.mark.parametrize(("when", "hinted"), [(4, False), (55, True)])
def test_one_push_of_the_camera_is_taken_out(tmp_path, when, hinted):
    move = np.float32([[1, 0, 5], [0, 1, 3]])

    def pushed(image, i):
        if i < when:
            return image
        return cv2.warpAffine(image, move, SIZE, borderMode=cv2.BORDER_REFLECT)

    hint = around(places(), 15, 2) if hinted else None
    assert np.nanmax(followed(film(tmp_path, pushed), places(), hint)[1]) < 0.5


def test_a_target_that_is_lost_in_many_frames_is_told(tmp_path):
    truth = places()
    truth[8:22] = truth[28:48] = -50
    found = track(film(tmp_path, lambda image, i: image, truth))
    assert np.isnan(found.pixels[32:43]).all()
    assert any("is lost in 34 of 60 frames" in doubt for doubt in found.warnings)


FLIGHT = 60
TRUTH = np.column_stack([30 + 4.4 * np.arange(FLIGHT), 110 - 25 * np.sin(np.arange(FLIGHT) / 15)])
HINT = around(TRUTH, 25)


def flight(folder, post, wall):
    """A red ball that flies behind a post, or before a wall of its colour, past other things."""
    ground = np.random.default_rng(0).uniform(0, 255, (200, 320, 3)).astype(np.float32)
    ground = 60 + cv2.GaussianBlur(ground, (0, 0), 4) / 2
    if wall:
        ground[:, 150:162] = (30, 30, 210)

    def draw(image, i):
        disc(image, TRUTH[i], 11, (30, 30, 210))
        image[:, 150 : 150 + post] = (60, 80, 90)
        return (1 + 0.1 * np.sin(i)) * image

    return painted(folder, ground, draw, FLIGHT, 3)


@pytest.mark.parametrize(("post", "wall"), [(14, False), (0, True)], ids=["post", "wall"])
def test_what_is_seen_in_part_is_where_its_motion_leads(tmp_path, post, wall):
    path = flight(tmp_path, post, wall)
    assert np.nanmax(followed(path, TRUTH, HINT if wall else None)[1]) < 1


def test_what_is_hidden_altogether_stays_a_gap(tmp_path):
    _, error = followed(flight(tmp_path, 60, False), TRUTH, HINT, 0.5)
    hidden = (TRUTH[:, 0] > 150 + 13) & (TRUTH[:, 0] < 210 - 13)
    assert hidden.sum() > 5
    assert np.isnan(error[hidden]).all()
    assert np.nanmax(error) < 3


def beach_ball(folder, radius, rate, colours, flicker):
    """A ball of two halves that turns by `rate` radians a frame, before bricks."""
    half = cv2.ellipse2Poly((0, 0), (1000, 1000), 0, 0, 180, 4) / 1000 * radius

    def draw(image, i):
        at = np.rint(16 * places()[i]).astype(int)
        for colour, first in zip(colours, (0, np.pi), strict=True):
            angle = rate * i + first
            spin = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            corners = np.rint(16 * (half @ spin) + at).astype(np.int32)
            cv2.fillConvexPoly(image, corners, colour, cv2.LINE_AA, 4)
        return (1 + flicker * np.sin(1.7 * i)) * image

    return painted(folder, BRICKS, draw, LENGTH, 1.5)


@pytest.mark.parametrize(
    ("colours", "rate", "flicker"),
    [
        (((30, 30, 210), (240, 240, 240)), 0.04, 0.05),
        (((250, 250, 20), (40, 50, 200)), 0.3, 0.0),  # one is faint
    ],
)
def test_a_ball_of_two_halves_that_turns(tmp_path, colours, rate, flicker):
    path = beach_ball(tmp_path, 12, rate, colours, flicker)
    _, error = followed(path, places(), least=0.8)
    assert np.nanpercentile(error, 90) < 1


# ---- where what is seen is more than the target, or less, it is left out, mended or told


def test_what_goes_on_beyond_the_window_is_not_the_whole_target(tmp_path):
    rng = np.random.default_rng(5)
    wheel = texture(rng, 240, 200)[..., ::-1]

    def draw(image, i):
        turn = cv2.getRotationMatrix2D((120, 100), np.degrees(ANGLE[i]), 1)
        turned = cv2.warpAffine(wheel, turn, (240, 200), borderMode=cv2.BORDER_REFLECT)
        mask = np.zeros(image.shape[:2], np.uint8)
        cv2.circle(mask, (120, 100), 90, 1, -1)
        image[mask > 0] = turned[mask > 0]
        return disc(image, ROUND[i], 8, (40, 230, 110))

    path = painted(tmp_path, texture(rng, 240, 200), draw, N)
    _, error = followed(path, ROUND, around(ROUND, 18))
    assert np.nanpercentile(error, 95) < 1.5


def test_where_two_things_move_alike_it_says_so_and_a_hint_decides(tmp_path):
    t = np.arange(60)
    both = [np.column_stack([40 + 4 * t, 60 + 30 * np.sin(t / (6 + k)) + 80 * k]) for k in (0, 1)]

    def draw(image, i):
        return disc(disc(image, both[0][i], 8, (30, 30, 210)), both[1][i], 8, (30, 30, 210))

    path = painted(tmp_path, texture(np.random.default_rng(0), 320, 240), draw, 60)
    assert any("something else moves" in warning for warning in track(path).warnings)
    for truth in both:
        found, error = followed(path, truth, around(truth, 19, 20), 0.9)
        assert np.nanmax(error) < 1
        assert not any("something else moves" in warning for warning in found.warnings)


def test_a_small_target_is_followed_from_a_box_that_is_drawn_loosely(tmp_path):
    turn = np.linspace(0, 4 * np.pi, 60)
    truth = np.column_stack([240 + 170 * np.cos(turn), 120 + 80 * np.sin(turn)])

    def draw(image, i):
        return disc(image, truth[i], 3, (220, 30, 30)) * (1 + 0.05 * np.sin(0.7 * i))

    path = painted(tmp_path, texture(np.random.default_rng(3), 480, 240), draw, 60)
    found, error = followed(path, truth, around(truth, 16), 0.9)
    assert np.nanmax(error) < 1.5
    assert found.warnings == ()
    still = track(path, target=Hint(frame=10, box=(230, 110, 20, 20)))
    assert "looks alone" in " ".join(still.warnings)


def test_a_target_that_is_half_in_the_shade_is_the_whole_of_it(tmp_path):
    sway = np.column_stack([80 + 40 * np.sin(ANGLE / 2), 90 + 40 * np.sin(ANGLE)])
    light = 1 - 0.5 / (1 + np.exp((np.arange(320) - 115) / 2))

    def draw(image, i):
        return disc(image, sway[i], 22, (220, 120, 170)) * light[None, :, None]

    path = painted(tmp_path, texture(np.random.default_rng(6), 320, 180), draw, N)
    _, error = followed(path, sway)
    assert np.nanpercentile(error, 95) < 1.5


def test_a_view_of_another_size_or_off_the_way_is_known_less_well():
    at = np.arange(40)
    places = np.column_stack([3.0 * at, 0.02 * at**2])
    areas = np.full(40, 400.0)
    areas[10], places[30] = 300, places[30] + 3
    off, _ = roughness(at, places, areas)
    assert off[10] > 2
    assert off[30] > 2
    assert (np.delete(off, [10, *range(27, 34)]) < 0.5).all()


@pytest.mark.parametrize("part", [4, 12])
def test_many_frames_that_show_only_a_part_are_told(part):
    confidence = np.where(np.arange(40) < part, 0.5, 0.9)
    told = unsure(Track(np.zeros((40, 2)), confidence, "motion"))
    assert any("only a part of the target" in doubt for doubt in told) == (part > 8)
