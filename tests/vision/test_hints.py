"""What a user says of the target, by hand or in a rig file."""

import pytest

import vidsindy_lite
from vidsindy_lite import Hint
from vidsindy_lite.vision.hints import load_hints


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({}, "target: must be a frame and a box"),
        ({"frame": 3}, "box: must come with its frame"),
        ({"box": (1, 2, 3, 4)}, "box: must come with its frame"),
        ({"frame": -1, "box": (1, 2, 3, 4)}, "frame: must be an integer of at least 0"),
        ({"frame": 1, "box": (1, 2, 3)}, "box: must be"),
        ({"frame": 1, "box": (1, 2, 0, 4)}, "box: must be two pixels"),
        ({"colour": (1, 2)}, "colour: must be"),
        ({"colour": (1, 2, 300)}, "colour: must be"),
    ],
)
def test_bad_hints(told, message):
    with pytest.raises(ValueError, match=message):
        Hint(**told)


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


def test_the_least_that_a_hint_may_be():
    """Two pixels, the first frame, and colours from 0 to 255; what it holds are numbers."""
    hint = Hint(0, [-3, 4, 2, 2], [0, 255, 128])
    assert (hint.frame, hint.box, hint.colour) == (0, (-3.0, 4.0, 2.0, 2.0), (0.0, 255.0, 128.0))
    for wrong in ({"frame": 0, "box": (1, 2, 2, 1.9)}, {"colour": (-0.1, 0, 0)}):
        with pytest.raises(ValueError, match="must be two pixels wide|must be red, green, blue"):
            Hint(**wrong)
