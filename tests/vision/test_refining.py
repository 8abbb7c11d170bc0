"""Views of the target: where it is, and which are whole."""

import numpy as np
import pytest

from vidsindy_lite.vision.plate import Plate
from vidsindy_lite.vision.refining import Lens, View, entire, fitting, scatter

GROUND = np.full((60, 80, 3), (60, 90, 120), np.uint8)


def look(frame, box, colour, centre=None, ground=GROUND):
    """What a lens sees near a box before the ground."""
    box = np.array(box, float)
    centre = box[:2] + (box[2:] - 1) / 2 if centre is None else np.array(centre, float)
    plate = Plate([ground] * 3, np.stack([np.eye(3)] * 3))
    return Lens(plate, 0.0).look(
        frame, np.eye(3), box, centre, np.array(colour, float), np.ones(3, np.float32)
    )


def disc(centre, radius, size=(80, 60)):
    """How much of each pixel a disc covers, by pieces of a tenth."""
    u, v = (np.arange(10 * n) / 10 - 0.45 for n in size)
    inside = np.hypot(u[None] - centre[0], v[:, None] - centre[1]) < radius
    return inside.reshape(size[1], 10, size[0], 10).mean(axis=(1, 3))[..., None]


@pytest.mark.parametrize(("radius", "centre"), [(5.0, (40.3, 30.6)), (9.0, (31.0, 22.25))])
def test_the_centroid_and_area_of_a_disc_are_those_of_its_parts_of_pixels(radius, centre):
    ground = np.full((60, 80, 3), 90, np.uint8)
    share, colour = disc(centre, radius), np.array([30, 60, 220])
    frame = np.rint((1 - share) * ground + share * colour).astype(np.uint8)
    box = [centre[0] - radius, centre[1] - radius, 2 * radius, 2 * radius]
    view = look(frame, box, colour, centre, ground)
    assert view.inside
    assert view.area == pytest.approx(np.pi * radius**2, rel=0.01)
    np.testing.assert_allclose(view.centroid, centre, atol=0.02)
    np.testing.assert_allclose(view.colour, colour, atol=1)
    assert look(ground, box, colour, centre, ground) is None


@pytest.mark.parametrize("colour", [(75, 130, 110), (70, 98, 122)])
def test_a_shadow_that_touches_the_target_is_no_part_of_it_unless_they_look_alike(colour):
    ground = np.full((60, 80, 3), (100, 140, 175), np.uint8)
    shade, share = 0.3 * disc((46.0, 36.0), 8), disc((38.0, 28.0), 8)
    frame = np.rint(share * np.array(colour) + (1 - share) * (1 - shade) * ground).astype(np.uint8)
    view = look(frame, (30, 20, 17, 17), colour, (38, 28), ground)
    off = np.linalg.norm(view.centroid - [38, 28])
    assert off < 2 if colour == (75, 130, 110) else off > 4


def painted(*blocks):
    """The ground with rectangles (left, top, width, height) of some colours."""
    frame = GROUND.copy()
    for (left, top, width, height), colour in blocks:
        frame[top : top + height, left : left + width] = colour
    return frame


RED, GREEN = (30, 50, 230), (60, 220, 90)


def test_of_two_things_of_the_targets_colour_the_nearer_one_is_seen():
    boxes = (30, 20, 9, 9), (50, 30, 9, 9)
    frame = painted(*((box, RED) for box in boxes))
    for centre in ((34.0, 24.0), (54.0, 34.0)):
        view = look(frame, (36, 18, 18, 26), RED, centre)
        np.testing.assert_allclose(view.centroid, centre, atol=0.05)
        # Of the target's colour is neither of two others: the nearer one is the whole.
        view = look(painted(*((box, GREEN) for box in boxes)), (36, 18, 18, 26), RED, centre)
        assert view.area == 0
        np.testing.assert_allclose(view.whole.centroid, centre, atol=0.05)
        assert view.whole.area == pytest.approx(81, rel=0.02)


def test_the_whole_of_a_thing_of_two_colours_has_the_area_and_centroid_of_both():
    frame = painted(((30, 20, 10, 15), RED), ((40, 20, 10, 15), GREEN))
    view = look(frame, (30, 20, 20, 15), RED)
    assert view.area == pytest.approx(150, rel=0.1)
    assert view.centroid[0] == pytest.approx(34.5, abs=0.5)
    assert view.whole.area == pytest.approx(300, rel=0.02)
    np.testing.assert_allclose(view.whole.centroid, (39.5, 27), atol=0.05)


def test_what_differs_from_the_ground_the_other_way_round_is_another_colour():
    ground, box = GROUND[0, 0].astype(int), (30, 20, 20, 15)
    for width, both in ((10, 300), (18, 270)):  # a tenth of another colour is no part of it
        rest = ((30 + width, 20, 20 - width, 15), ground // 10)
        view = look(painted(((30, 20, width, 15), 2 * ground), rest), box, 2 * ground)
        assert view.area == pytest.approx(15 * width, rel=0.1)
        assert view.whole.area == pytest.approx(both, rel=0.05)


@pytest.mark.parametrize(
    ("corner", "inside"),
    [((3, 3), True), ((0, 20), False), ((30, 0), False),
     ((65, 45), True), ((68, 20), False), ((30, 48), False)],
)  # fmt: skip
def test_what_reaches_the_border_of_the_image_is_not_inside(corner, inside):
    box = (*corner, 12, 12)
    assert look(painted((box, RED)), box, RED).inside is inside


FRAMES = np.arange(30.0)
WAY = np.column_stack([20 + 3 * FRAMES, 90 - 2 * FRAMES + 0.1 * FRAMES**2])
EVEN = np.zeros((60, 2))  # skewness of a disc
SIXTY = np.arange(60)


def left_out(frames, places, areas, skewness, inside=True):
    inside = np.broadcast_to(inside, len(frames))
    return np.flatnonzero(~fitting(frames, places, areas, skewness, inside)[0]).tolist()


def test_views_of_another_size_than_those_around_them_do_not_fit():
    areas = np.geomspace(100, 250, 30)  # a target that comes closer
    areas[[7, 12, 23, 29]] *= [1.004, 1.6, 1 / 1.2, 0.5]
    assert left_out(FRAMES, WAY, areas, EVEN[:30]) == [12, 23, 29]
    assert left_out(FRAMES, WAY, areas, EVEN[:30], FRAMES != 4) == [4, 12, 23, 29]


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.2])
def test_the_rougher_a_path_the_more_may_outlines_differ(noise):
    way = np.column_stack([3.0 * SIXTY, 50 + 20 * np.sin(SIXTY / 9)])
    way += np.random.default_rng(0).normal(0, noise, way.shape)
    skewness = np.zeros((60, 2))
    skewness[20:26] = 0.1  # of a target of 20 pixels
    areas, inside = np.full(60, 400.0), np.full(60, True)
    good, bound = fitting(SIXTY, way, areas, skewness, inside)
    assert good.all() if noise > 0.1 else np.flatnonzero(~good).tolist() == [*range(20, 26)]
    assert bound == pytest.approx(max(0.05, 12 * noise), rel=0.3)


def test_views_of_the_target_and_something_like_it_in_one_are_left_out():
    areas = np.linspace(100, 200, 60)
    areas[20:40] *= 2.5  # one beside the other
    areas[50:52] *= 0.4  # hidden in part
    skewness = EVEN.copy()
    skewness[20:40, 1] = 0.2
    way = np.column_stack([2.0 * SIXTY, SIXTY])
    assert left_out(SIXTY, way, areas, skewness) == [*range(20, 40), 50, 51]


def test_of_a_fast_target_no_view_is_left_out_but_one_that_is_displaced():
    turn, width = 60, 0.25  # round in 60 frames, by up to 37 pixels a frame in a few of them
    frames, areas = np.arange(2 * turn), np.full(2 * turn, 150.0)
    angle = 2 * np.pi * frames / turn
    up = 130 * np.exp((np.cos(angle) - 1) / width**2)
    places = np.column_stack([160 + 100 * np.cos(angle), 200 - up])
    even = np.zeros((2 * turn, 2))
    assert left_out(frames, places, areas, even) == []
    kept = np.delete(frames, np.s_[55:58])  # beside a gap
    assert left_out(kept, places[kept], areas[kept], even[kept]) == []
    for displaced in range(turn - 12, turn + 13, 4):
        seen = places.copy()
        seen[displaced] += [20, 15]
        assert left_out(frames, seen, areas, even) == [displaced]


@pytest.mark.parametrize("wavers", [0.0, 0.15])  # frames of a telephone do
def test_the_scatter_is_that_of_the_noise_whatever_cubic_the_motion_is(wavers):
    number = np.arange(3000)
    frames = number + wavers * np.random.default_rng(1).uniform(-1, 1, 3000)
    t = frames / 500
    way = np.column_stack([t**3 - 200 * t, 40 * t**2])
    assert scatter(frames, way) < 1e-3
    noisy = way + np.random.default_rng(0).normal(0, 0.7, way.shape)
    assert scatter(frames, noisy) == pytest.approx(0.7, rel=0.05)
    jumps = np.where(number % 50 == 49, 300, 0)[:, None]  # a few wrong places spoil nothing
    assert scatter(frames, noisy + jumps) == pytest.approx(0.7, rel=0.25)


def parts_of_wholes(parts, areas):
    """Views of a part of area 100, in its places, each of a whole at (0, 0) of its area."""
    wholes = [View(np.zeros(2), area, np.zeros(3), True, np.zeros(2)) for area in areas]
    return [
        View(part, 100.0, np.zeros(3), True, np.zeros(2), one)
        for part, one in zip(parts, wholes, strict=True)
    ]


def test_what_turns_about_a_whole_that_keeps_its_size_is_a_part_of_it():
    angle = np.linspace(0, 9, 40)
    around = 4 * np.column_stack([np.cos(angle), np.sin(angle)])
    shown = parts_of_wholes(around, np.full(40, 220.0))
    assert entire(shown) == ([one.whole for one in shown], ())
    aside = parts_of_wholes(np.tile([4.0, 2.0], (40, 1)), np.full(40, 220.0))
    assert entire(aside) == (aside, ())
    changing = 220 * np.exp(np.random.default_rng(0).normal(0, 1, 40))
    kept, doubts = entire(shown := parts_of_wholes(around, changing))
    assert kept == shown
    assert "several colours" in doubts[0]
