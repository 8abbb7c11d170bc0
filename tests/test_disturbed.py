"""Every notebook holds for two other settings each, and none hangs on the last digits.

One setting of a small one runs with all tests, the rest by `pytest -m thorough`. Tracks and
trajectories of quick notebooks are disturbed in `test_notebooks`, of all in a copy, to `compare`:
VIDSINDY_DISTURB=1e-9:1 PYTHONPATH=tests/disturbed make figures FORCE=1
"""

import pytest
from helpers import run_quickly

from vidsindy_lite.companion.run import find_notebooks
from vidsindy_lite.storage import PACKAGE

NOTEBOOKS = {path.stem.partition("_")[0]: path for path in find_notebooks(PACKAGE.parent)}
SETTINGS = {
    "00": [{"system": "SprottF", "camera": 3}, {"system": "WangSun", "noise_variance": 0.003}],
    "01": [{"system": "NoseHoover", "view": 2}, {"view": 3}],
    "02": [{"seed": 1}, {"seed": 2, "noise_variance": 0.02}],
    "03": [{"system": "WangSun", "seed": 1}, {"frames": 300, "pixel_noise": 1.0, "seed": 2}],
    "04": [{"level": 0.05}, {"seed": 1}],
    "04b": [{"level": 0.05}, {"seed": 1}],
    "06": [{"seed": 10}, {"seed": 20, "share": 0.05}],
    "08": [{"seed": 1}, {"camera": 3}],
    "12": [{"fps": 60}, {"seed": 1}],
    "13": [{"seed": 1}, {"fps": 60}],
    **dict.fromkeys(("05", "07", "11"), [{"seed": 10}, {"seed": 20}]),
    **dict.fromkeys(("09", "10", "10b", "14"), [{"seed": 1}, {"seed": 2}]),
}
QUICK = ("10", {"seed": 1})


def test_every_notebook_has_two():
    assert {number: len(both) for number, both in SETTINGS.items()} == dict.fromkeys(NOTEBOOKS, 2)


@pytest.mark.parametrize(
    ("number", "settings"),
    [
        pytest.param(*case, marks=pytest.mark.slow if case == QUICK else pytest.mark.thorough)
        for case in ((number, one) for number, both in SETTINGS.items() for one in both)
    ],
)
def test_a_notebook_holds_for_other_settings(number, settings, tmp_path, shared_cache):
    assert run_quickly(NOTEBOOKS[number], tmp_path, settings, shared_cache) == ""


HAIR = """\
profile: str = "full"  # full or quick
from vidsindy_lite.study import SYSTEMS
t, x = SYSTEMS["Lorenz"].trajectory(3)
assert abs(x[0, 0] + 8) < 1e-12
assert profile == "quick"
"""


@pytest.mark.slow
def test_what_holds_by_a_hair_fails(tmp_path, shared_cache):
    hair = tmp_path / "hair.py"
    hair.write_text(HAIR)
    assert run_quickly(hair, tmp_path, {}, shared_cache) == ""
    assert "AssertionError" in run_quickly(hair, tmp_path, {}, shared_cache, seed=1)
    assert "colour: must be" in run_quickly(hair, tmp_path, {"colour": 1}, shared_cache)
