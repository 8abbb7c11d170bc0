"""The tracker for films that people make: phone footage with known truth, hints, real clips."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from footage import Phone, write_phone
from helpers import real

import vidsindy_lite
from vidsindy_lite import Hint, track
from vidsindy_lite.vision import load_hints
from vidsindy_lite.vision.camera import CameraMotion, at_rest
from vidsindy_lite.vision.candidates import Candidates
from vidsindy_lite.vision.moving import expected, finished
from vidsindy_lite.vision.refining import View

SMALL = {"image_size": (320, 240), "frames": 60}


def errors(path, truth, target=None):
    found = track(path, target=target)
    return found, np.linalg.norm(found.pixels - truth, axis=1)


@pytest.mark.parametrize(
    "phone",
    [
        Phone("bricks", 14, shadow=True, **SMALL),
        Phone("wood", 16, camera="held", flicker=0.03, colour=(240, 240, 235), **SMALL),
    ],
    ids=["shadow", "held"],
)
def test_phone_footage(tmp_path, phone):
    truth, _ = write_phone(tmp_path / "clip.mp4", phone, 1)
    found, error = errors(tmp_path / "clip.mp4", truth)
    assert np.isfinite(error).mean() >= 0.95
    assert np.nanmedian(error) < 0.3
    assert np.nanpercentile(error, 95) < 1.5


def test_a_large_target_is_plainer_than_leaves_that_sway(tmp_path):
    phone = Phone("sea", 58, colour=(200, 30, 185), noise=3, leaves=True, **SMALL)
    truth, _ = write_phone(tmp_path / "clip.mp4", phone, 1)
    found, error = errors(tmp_path / "clip.mp4", truth)
    assert np.nanpercentile(error, 95) < 1.5
    assert not found.warnings


def followed_to(n=30, factor=1, maps=None):
    """Where a thing is expected that is seen in a few of n frames, on a parabola."""
    at = np.array([6, 7, 8, 9, 12, 13, 14])
    m = len(at)
    centre = np.column_stack([20 + 3.0 * at, 90 - 2.0 * at + 0.25 * at**2])
    box = np.column_stack([centre - 50, np.full(m, 12.0), np.full(m, 6.0)])  # boxes lag behind
    colour = np.where(np.arange(m)[:, None] < 1, [50.0, 80, 20], [90.0, 80, 20])
    seen = Candidates(at, centre, centre, box, np.full(m, 64.0), colour, 0 * colour,
                      np.full(m, 0.9))  # fmt: skip
    maps = np.tile(np.eye(3), (n, 1, 1)) if maps is None else maps
    return expected(seen, np.arange(m), SimpleNamespace(maps=maps, factor=factor), n)


def test_a_target_is_expected_on_its_way_between_its_sightings_and_three_frames_beyond():
    ways, k = followed_to(), np.arange(30)
    near = (k >= 3) & (k <= 17)
    np.testing.assert_array_equal(np.isfinite(ways.centre[:, 0]), near)
    np.testing.assert_array_equal(np.isfinite(ways.box[:, 0]), near)
    parabola = np.column_stack([20 + 3.0 * k, 90 - 2.0 * k + 0.25 * k**2])
    within = (k >= 10) & (k <= 11)  # in a straight line
    np.testing.assert_allclose(ways.centre[near & ~within], parabola[near & ~within], atol=1e-6)
    line = parabola[9] + np.array([[1], [2]]) / 3 * (parabola[12] - parabola[9])
    np.testing.assert_allclose(ways.centre[within], line)
    np.testing.assert_allclose(ways.box[near, :2], ways.centre[near] - [6, 3])
    np.testing.assert_allclose(ways.box[near, 2:], [[12, 6]] * near.sum())

    # Where the camera sees it, and in whole frames: pixel 10 of those that are reduced by 3 is made
    # of pixels 30 to 32.
    maps = np.tile(np.eye(3), (30, 1, 1))
    maps[:, 0, 2], maps[:, 1, 2] = 2 * k, -k
    moved = ways.centre - np.column_stack([2 * k, -k])
    np.testing.assert_allclose(followed_to(maps=maps).centre[near], moved[near])
    whole = followed_to(factor=3)
    np.testing.assert_allclose(whole.centre[near], 3 * ways.centre[near] + 1)
    np.testing.assert_allclose(whole.box[near], 3 * ways.box[near])


def along(n, areas=100.0, half=5.0, **looks):
    """Views of a square that travels to the right, all clear of the border."""
    square = half * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    places = np.column_stack([4 * half + 3.0 * np.arange(n), np.full(n, 10 * half)])
    return [
        View(place, area, np.zeros(3), True, place + square, **looks)
        for place, area in zip(places, np.full(n, areas), strict=True)
    ]


def test_frames_that_do_not_tell_where_the_camera_is_are_counted():
    views, errors, maps = along(20), np.zeros(20), np.tile(np.eye(3), (20, 1, 1))
    assert finished(views, CameraMotion(maps, errors), ()).warnings == ()
    larger = along(20, np.where(np.arange(20) < 12, 100.0, 300.0))
    (doubt,) = finished(larger, CameraMotion(maps, errors), ()).warnings
    assert doubt.startswith("from frame 12 on, what is followed has another size at once")
    few = finished(along(9) + [None] * 191, at_rest(200), ())
    assert np.isnan(few.pixels).all()  # of a twentieth of the frames it makes none
    errors[16:] = np.inf
    found = finished(views, CameraMotion(maps, errors), ())
    assert np.isfinite(found.pixels[:, 0]).sum() == 16
    (doubt,) = found.warnings
    assert doubt.startswith("in 4 frames of 20 the target is seen")
    assert "16 to 19" in doubt


@pytest.mark.parametrize(("part", "told"), [(0.99, False), (0.8, True)])
def test_an_outline_that_changes_from_frame_to_frame_is_told(part, told):
    areas = 1e4 * np.where(np.random.default_rng(0).random(40) < 0.5, part, 1)
    found = finished(along(40, areas, 50.0), at_rest(40), ())
    assert any("outline of the target" in doubt for doubt in found.warnings) == told
    assert (np.median(found.confidence) < np.exp(-2 / 3)) == told


def test_the_toss():
    path = real("toss")
    truth = np.genfromtxt(path.with_suffix(".csv"), delimiter=",", skip_header=1)[:, 1:]
    error = np.linalg.norm(track(path).in_frames - truth, axis=1)
    shown = np.isfinite(truth[:, 0])
    assert (error[shown] < 1).mean() >= 0.9


# -------------------------------------------------------------------------------------------- hints


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
