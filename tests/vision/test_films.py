"""Films in which anybody sees the target, those of telephones, and hints: nothing goes unsaid."""

import re

import cv2
import numpy as np
import pytest
from footage import Phone, write_phone
from helpers import real

import vidsindy_lite
from vidsindy_lite import Hint, track, write_video
from vidsindy_lite.vision import Track, load_hints
from vidsindy_lite.vision.camera import CameraMotion, at_rest
from vidsindy_lite.vision.film import finished, unsure
from vidsindy_lite.vision.refining import View, roughness
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


def ball(truth, radius, colour, light=lambda i: 1):
    """What draws a ball where it is in a frame, and lights the image."""
    return lambda image, i: light(i) * disc(image, truth[i], radius, colour)


def around(place, side, frame=10):
    return Hint(frame=frame, box=(*(place[frame] - side / 2), side, side))


def painted(folder, ground, draw, n, noise=2.0, seed=0, codec=None):
    """A film of which `draw` paints each frame on a ground."""
    rng = np.random.default_rng(seed)

    def frames():
        for i in range(n):
            image = draw(ground.copy(), i)
            image = image + noise * rng.normal(size=image.shape)
            yield np.clip(image, 0, 255).astype(np.uint8)

    return write_video(folder / ("film.mp4" if codec else "film.mov"), frames(), codec=codec)


def followed(path, truth, target=None, least=0.95):
    """Track, and its errors."""
    found = track(path, target=target)
    error = np.linalg.norm(found.pixels - truth, axis=1)
    assert np.isfinite(error).mean() >= least
    return found, error


@pytest.mark.parametrize("seed", [0, 9])
def test_a_ball_that_hardly_leaves_its_own_ground_in_compressed_film(tmp_path, seed):
    truth = [160, 90] + 15 * np.column_stack([0 * ANGLE, np.cos(2 * ANGLE)])[:70]
    ground = texture(np.random.default_rng(seed), 320, 180)
    path = painted(tmp_path, ground, ball(truth, 9, (230, 200, 30)), 70, 1.0, 1, "mp4v")
    assert np.nanmax(followed(path, truth)[1]) < 1


def test_a_large_ball_that_never_leaves_its_own_ground(tmp_path):
    radius = 22
    leaves = 0.45 * radius * np.column_stack([np.sin(ANGLE), np.sin(2.3 * ANGLE + 1)])
    truth = [80, 45] + leaves
    ground = texture(np.random.default_rng(2), 160, 90)
    path = painted(tmp_path, ground, ball(truth, radius, (210, 60, 30)), N)
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
    if not mixed:
        lost = track(path, target=Hint(colour=(230, 40, 110)))
        assert any("colour (230, 40, 110)" in doubt for doubt in lost.warnings)


@pytest.mark.parametrize(("plain", "passed"), [(True, False), (False, False), (True, True)])
def test_a_bob_is_told_from_its_string_and_who_walks_behind_it(tmp_path, plain, passed):
    ground = np.full((200, 240, 3), 178.0) if plain else texture(np.random.default_rng(4), 240, 200)
    swing = 0.6 * np.cos(2 * ANGLE)
    truth = [120, 10] + 150 * np.column_stack([np.sin(swing), np.cos(swing)])

    def draw(image, i):
        if passed:  # by somebody whom the lower border cuts
            cv2.rectangle(image, (210 - 2 * i, 60), (250 - 2 * i, 200), (87, 58, 48), -1)
        ends = (np.rint(16 * np.array(end)).astype(int) for end in ([120, 10], truth[i]))
        cv2.line(image, *map(tuple, ends), (60, 60, 60), 2, cv2.LINE_AA, 4)
        return disc(image, truth[i], 9, (210, 60, 30))

    _, error = followed(painted(tmp_path, ground, draw, N), truth, least=0.7 if passed else 0.9)
    assert np.nanmax(error) < 2


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
    assert np.nanmax(followed(path, TRUTH, HINT)[1]) < 1


def test_what_is_hidden_altogether_stays_a_gap(tmp_path):
    _, error = followed(flight(tmp_path, 60, False), TRUTH, HINT, 0.5)
    hidden = (TRUTH[:, 0] > 150 + 13) & (TRUTH[:, 0] < 210 - 13)
    assert hidden.sum() > 5
    assert np.isnan(error[hidden]).all()
    assert np.nanmax(error) < 3


@pytest.mark.parametrize(
    ("colours", "rate", "flicker"),
    [
        (((30, 30, 210), (240, 240, 240)), 0.04, 0.05),
        (((250, 250, 20), (40, 50, 200)), 0.3, 0.0),  # one is faint
    ],
)
def test_a_ball_of_two_halves_that_turns(tmp_path, colours, rate, flicker):
    half = cv2.ellipse2Poly((0, 0), (1000, 1000), 0, 0, 180, 4) / 1000 * 12

    def draw(image, i):
        at = np.rint(16 * places()[i]).astype(int)
        for colour, first in zip(colours, (0, np.pi), strict=True):
            angle = rate * i + first  # radians
            spin = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            corners = np.rint(16 * (half @ spin) + at).astype(np.int32)
            cv2.fillConvexPoly(image, corners, colour, cv2.LINE_AA, 4)
        return (1 + flicker * np.sin(1.7 * i)) * image

    path = painted(tmp_path, BRICKS, draw, LENGTH, 1.5)
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
    assert np.nanpercentile(followed(path, ROUND, around(ROUND, 18))[1], 95) < 1.5


def test_where_two_things_move_alike_it_says_so_and_a_hint_decides(tmp_path):
    t = np.arange(60)
    both = [np.column_stack([40 + 4 * t, 60 + 30 * np.sin(t / (6 + k)) + 80 * k]) for k in (0, 1)]

    def draw(image, i):
        return disc(disc(image, both[0][i], 8, (30, 30, 210)), both[1][i], 8, (30, 30, 210))

    path = painted(tmp_path, texture(np.random.default_rng(0), 320, 240), draw, 60)
    for told in (None, Hint(colour=(30, 30, 210))):  # that of both
        assert any(
            "something else moves" in warning for warning in track(path, "auto", told).warnings
        )
    for truth in both:
        found, error = followed(path, truth, around(truth, 19, 20), 0.9)
        assert np.nanmax(error) < 1
        assert not any("something else moves" in warning for warning in found.warnings)


def test_a_small_target_is_followed_from_a_box_that_is_drawn_loosely(tmp_path):
    turn = np.linspace(0, 4 * np.pi, 60)
    truth = np.column_stack([240 + 170 * np.cos(turn), 120 + 80 * np.sin(turn)])
    draw = ball(truth, 3, (220, 30, 30), lambda i: 1 + 0.05 * np.sin(0.7 * i))
    path = painted(tmp_path, texture(np.random.default_rng(3), 480, 240), draw, 60)
    found, error = followed(path, truth, around(truth, 16), 0.9)
    assert np.nanmax(error) < 1.5
    assert found.warnings == ()
    still, again = (track(path, target=Hint(frame=10, box=(230, 110, 20, 20))) for _ in range(2))
    assert "looks alone" in " ".join(still.warnings)
    assert "in frame 10 nothing is seen to move in the box" in still.warnings[0]
    np.testing.assert_array_equal(again.pixels, still.pixels)  # to the last bit


def test_a_target_that_is_half_in_the_shade_is_the_whole_of_it(tmp_path):
    sway = np.column_stack([80 + 40 * np.sin(ANGLE / 2), 90 + 40 * np.sin(ANGLE)])
    light = 1 - 0.5 / (1 + np.exp((np.arange(320) - 115) / 2))
    draw = ball(sway, 22, (220, 120, 170), lambda i: light[None, :, None])
    path = painted(tmp_path, texture(np.random.default_rng(6), 320, 180), draw, N)
    assert np.nanmax(followed(path, sway, least=0.6)[1]) < 1.5
    assert np.nanpercentile(followed(path, sway, around(sway, 44))[1], 95) < 1.5


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


SMALL = {"image_size": (320, 240), "frames": 60}


@pytest.mark.parametrize(
    "phone",
    [
        Phone("bricks", 14, shadow=1, **SMALL),
        Phone("wood", 14, shadow=0.5, colour=(140, 105, 115), **SMALL),
        Phone("wood", 16, camera="held", flicker=0.03, colour=(240, 240, 235), **SMALL),
    ],
    ids=["shadow", "shadow that touches it", "held"],
)
def test_phone_footage(tmp_path, phone):
    truth, _ = write_phone(tmp_path / "clip.mp4", phone, 1)
    _, error = followed(tmp_path / "clip.mp4", truth)
    assert np.nanmedian(error) < 0.3
    assert np.nanpercentile(error, 95) < 1.5


def test_a_large_target_is_plainer_than_leaves_that_sway(tmp_path):
    phone = Phone("sea", 58, colour=(200, 30, 185), noise=3, leaves=True, **SMALL)
    truth, _ = write_phone(tmp_path / "clip.mp4", phone, 1)
    found, error = followed(tmp_path / "clip.mp4", truth, least=0)
    assert np.nanpercentile(error, 95) < 1.5
    assert not found.warnings


def along(n, areas=100.0, half=5.0, **looks):
    """Views of a square that travels to the right, all clear of the border."""
    places = np.column_stack([4 * half + 3.0 * np.arange(n), np.full(n, 10 * half)])
    return [
        View(place, area, np.zeros(3), True, np.zeros(2), **looks)
        for place, area in zip(places, np.full(n, areas), strict=True)
    ]


def test_frames_that_do_not_tell_where_the_camera_is_are_counted():
    views, errors, maps = along(20), np.zeros(20), np.tile(np.eye(3), (20, 1, 1))
    assert finished(views, CameraMotion(maps, errors), (), np.arange(20.0))[0].warnings == ()
    larger = along(40, np.where(np.arange(40) < 20, 100.0, 300.0))
    (doubt,) = finished(larger, at_rest(40), (), np.arange(40.0))[0].warnings
    assert doubt.startswith("from frame 22 on, what is followed has another size at once")
    few, _ = finished(along(9) + [None] * 191, at_rest(200), (), np.arange(200.0))
    assert np.isnan(few.pixels).all()  # of a twentieth of the frames it makes none
    errors[16:] = np.inf
    found, _ = finished(views, CameraMotion(maps, errors), (), np.arange(20.0))
    assert np.isfinite(found.pixels[:, 0]).sum() == 16
    (doubt,) = found.warnings
    assert doubt.startswith("in 4 frames of 20 the target is seen")
    assert "16 to 19" in doubt


@pytest.mark.parametrize(
    ("part", "told"),
    [(0.99, []), (0.8, ["the outline of the target"]), (0.3, ["the target's out"])],
)
def test_an_outline_that_changes_from_frame_to_frame_is_told(part, told):
    areas = 1e4 * np.random.default_rng(0).uniform(part, 1, 40)
    found, _ = finished(along(40, areas, 50.0), at_rest(40), (), np.arange(40.0))
    assert [doubt[: len(start)] for doubt, start in zip(found.warnings, told, strict=True)] == told
    assert (np.median(found.confidence) < np.exp(-2 / 3)) == bool(told)


def test_the_toss():
    path = real("toss")
    truth = np.genfromtxt(path.with_suffix(".csv"), delimiter=",", skip_header=1)[:, 1:]
    error = np.linalg.norm(track(path).in_frames - truth, axis=1)
    shown = np.isfinite(truth[:, 0])
    assert (error[shown] < 1).mean() >= 0.9


@pytest.mark.thorough
def test_the_green_ball_before_a_hand_held_phone():
    found = track(real("pendulum"))
    assert np.isfinite(found.pixels).all(axis=1).mean() > 0.8
    assert not any("followed by its looks alone" in doubt for doubt in found.warnings)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({}, "target: must be a frame and a box"),
        ({"frame": 3}, "box: must come with its frame"),
        ({"box": (1, 2, 3, 4)}, "box: must come with its frame"),
        ({"frame": -1, "box": (1, 2, 3, 4)}, "frame: must be an integer of at least 0"),
        ({"frame": 1, "box": (1, 2, 3)}, "box: must be"),
        ({"frame": 1, "box": (1, 2, 2, 1.9)}, "box: must be two pixels"),
        ({"colour": (1, 2)}, "colour: must be"),
        ({"colour": (-0.1, 2, 3)}, "colour: must be"),
        ({"colour": (1, 2, 300)}, "colour: must be"),
    ],
)
def test_bad_hints(told, message):
    with pytest.raises(ValueError, match=message):
        Hint(**told)
    least = Hint(0, [-3, 4, 2, 2], [0, 255, 128])  # what it holds are numbers
    assert (least.box, least.colour) == ((-3.0, 4.0, 2.0, 2.0), (0.0, 255.0, 128.0))


def test_hints_of_a_rig_file(tmp_path):
    file = tmp_path / "rig.toml"
    file.write_text(
        "[[camera]]\nnormal = [1, 0, 0]\ntarget = {frame = 10, box = [1, 2, 30, 40]}\n"
        "[[camera]]\nnormal = [0, 1, 0]\n"
        "[[camera]]\nnormal = [0, 0, 1]\ntarget = {colour = [255, 0, 0]}\n"
    )
    assert load_hints(file) == (Hint(10, (1, 2, 30, 40)), None, Hint(colour=(255, 0, 0)))
    assert len(vidsindy_lite.Rig.load(file).cameras) == 3
    file.write_text("[[camera]]\nnormal = [1, 0, 0]\ntarget = {place = 10}\n")
    with pytest.raises(ValueError, match="camera 0: target: must be a table of frame, box, colour"):
        load_hints(file)


@pytest.mark.parametrize("box", [(-80, 20, 30, 30), (20, -40, 30, 30), (190, 20, 30, 30)])
def test_a_box_outside_the_image_is_refused_as_it_was_given(box):
    said = re.escape(f"box: must have its middle in the image of 200 x 120 pixels, got {box}")
    with pytest.raises(ValueError, match=said):
        Hint(0, box).boxed((200, 120), 2, 4)
    assert Hint(0, (180, 20, 30, 30)).boxed((200, 120), 2, 4) is not None


def test_a_hint_is_for_auto_and_must_be_one(tmp_path):
    with pytest.raises(ValueError, match="target: may be given for detector='auto'"):
        track(tmp_path / "a.mov", "learned", Hint(colour=(1, 2, 3)))
    with pytest.raises(ValueError, match="target: must be of type Hint"):
        track(tmp_path / "a.mov", target=(1, 2, 3, 4))
    with pytest.raises(ValueError, match="target: its frame must be one of 2, got 2"):
        Hint(2, (36, 46, 9, 9)).boxed((200, 120), 2, 1)


def test_a_box_in_a_reduced_film_is_where_its_pixels_are_reduced_to():
    frame, middle, sides = Hint(3, (40, 20, 10, 6)).boxed((200, 120), 5, 2)
    assert frame == 3
    np.testing.assert_array_equal(middle, [22, 11])  # pixels 40 to 49 are 20 to 24 there
    np.testing.assert_array_equal(sides, [5, 3])
    assert Hint(colour=(1, 2, 3)).boxed((200, 120), 5, 2) is None
