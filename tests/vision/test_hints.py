"""What a user says of the target, by hand or in a rig file."""

import re

import numpy as np
import pytest

import vidsindy_lite
from vidsindy_lite import Hint, track
from vidsindy_lite.vision import load_hints


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
