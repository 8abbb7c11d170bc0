"""Which views are of the target and of something like it in one."""

import numpy as np
import pytest

from vidsindy_lite.vision.candidates import Plate
from vidsindy_lite.vision.refining import _BESIDE, Lens, joined, swapped


@pytest.mark.parametrize("missing", [0, 1])
def test_two_that_meet_and_part_are_one_in_between_if_both_sides_are_seen(missing):
    before, during, after = [100.0] * _BESIDE, [220.0] * 6, [100.0] * (_BESIDE - missing)
    expected = [False] * _BESIDE + [not missing] * 6 + [False] * len(after)
    assert joined(np.array(before + during + after)).tolist() == expected
    assert joined(np.array(after + during + before)).tolist() == expected[::-1]


@pytest.mark.parametrize("factor", [3.0, 1 / 3])
def test_what_is_larger_or_smaller_at_once_and_remains_so_is_something_else(factor):
    areas = np.linspace(100, 150, 40)
    frames = np.arange(40)
    assert swapped(frames, areas) is None
    areas[20:] *= factor
    assert swapped(frames, areas) == 20
    assert swapped(np.where(frames < 20, frames, frames + 20), areas) is None  # nobody looked
    assert swapped(np.where(frames < 20, frames, frames + 6), areas) == 20
    areas[22:] /= factor
    assert swapped(frames, areas) is None


def disc(centre, radius, size=(80, 60)):
    """How much of each pixel a disc covers, by pieces of a tenth."""
    u, v = (np.arange(10 * n) / 10 - 0.45 for n in size)
    inside = np.hypot(u[None] - centre[0], v[:, None] - centre[1]) < radius
    return inside.reshape(size[1], 10, size[0], 10).mean(axis=(1, 3))[..., None]


@pytest.mark.parametrize("radius", [5.0, 9.0])
@pytest.mark.parametrize("centre", [(40.3, 30.6), (31.0, 22.25)])
def test_the_centroid_and_area_of_a_disc_are_those_of_its_parts_of_pixels(centre, radius):
    ground = np.full((60, 80, 3), 90, np.uint8)
    share, colour = disc(centre, radius), np.array([30, 60, 220])
    frame = np.rint((1 - share) * ground + share * colour).astype(np.uint8)
    plate = Plate(np.stack([ground] * 3), np.stack([np.eye(3)] * 3), np.ones(3, bool))
    box = np.array([centre[0] - radius, centre[1] - radius, 2 * radius, 2 * radius])
    gain = np.ones(3, np.float32)
    view = Lens(plate, 0.0).look(frame, np.eye(3), box, np.array(centre), colour, gain)
    assert view.inside
    assert view.area == pytest.approx(np.pi * radius**2, rel=0.01)
    np.testing.assert_allclose(view.centroid, centre, atol=0.02)
    np.testing.assert_allclose(view.colour, colour, atol=1)
    assert Lens(plate, 0.0).look(ground, np.eye(3), box, np.array(centre), colour, gain) is None


@pytest.mark.parametrize(("shade", "faint"), [(90, False), (176, False), (192, True)])
def test_a_view_before_ground_of_about_its_own_colour_is_faint(shade, faint):
    ground = np.full((60, 80, 3), 90, np.uint8)
    ground[:, 10:70] = shade
    share = disc((40.0, 30.0), 8)
    frame = np.rint((1 - share) * ground + share * 200).astype(np.uint8)
    plate = Plate(np.stack([ground] * 3), np.stack([np.eye(3)] * 3), np.ones(3, bool))
    box, gain = np.array([32.0, 22, 16, 16]), np.ones(3, np.float32)
    colour = np.full(3, 200.0)
    view = Lens(plate, 0.0).look(frame, np.eye(3), box, np.array([40.0, 30]), colour, gain)
    assert view.faint == faint


@pytest.mark.parametrize("colour", [(75, 130, 110), (70, 98, 122)])
def test_a_shadow_that_touches_the_target_is_no_part_of_it_unless_they_look_alike(colour):
    ground = np.full((60, 80, 3), (100, 140, 175), np.uint8)
    shade, share = 0.3 * disc((46.0, 36.0), 8), disc((38.0, 28.0), 8)
    frame = np.rint(share * np.array(colour) + (1 - share) * (1 - shade) * ground).astype(np.uint8)
    plate = Plate(np.stack([ground] * 3), np.stack([np.eye(3)] * 3), np.ones(3, bool))
    box, gain = np.array([30.0, 20, 17, 17]), np.ones(3, np.float32)
    view = Lens(plate, 0.0).look(
        frame, np.eye(3), box, np.array([38.0, 28.0]), np.array(colour, float), gain
    )
    off = np.linalg.norm(view.centroid - [38, 28])
    assert off < 2 if colour == (75, 130, 110) else off > 4
