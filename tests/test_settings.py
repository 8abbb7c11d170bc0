"""Every notebook holds for other settings than its own, in two each, in its quick profile.

Assertions of a notebook have to test what it says, not the numbers of its default. A small one
runs with all tests, the rest by `pytest -m thorough`.
"""

import pytest
from helpers import run_quickly

from vidsindy_lite.companion.run import find_notebooks
from vidsindy_lite.repository import PACKAGE

NOTEBOOKS = {path.stem.partition("_")[0]: path for path in find_notebooks(PACKAGE.parent)}
SETTINGS = {
    "00": [{"system": "SprottF", "camera": 3}, {"system": "WangSun", "noise_variance": 0.003}],
    "01": [{"system": "NoseHoover", "view": 2}, {"view": 3}],
    "02": [{"seed": 1}, {"seed": 2, "noise_variance": 0.02}],
    "03": [{"system": "WangSun", "seed": 1}, {"frames": 300, "pixel_noise": 1.0, "seed": 2}],
    "04": [{"level": 0.05}, {"seed": 1}],
    "04b": [{"level": 0.05}, {"seed": 1}],
    "05": [{"seed": 10}, {"seed": 20}],
    "06": [{"seed": 10}, {"seed": 20, "share": 0.05}],
    "07": [{"seed": 10}, {"seed": 20}],
    "08": [{"seed": 1}, {"camera": 3}],
    "09": [{"seed": 1}, {"seed": 2}],
    "10": [{"seed": 1}, {"seed": 2}],
    "10b": [{"seed": 1}, {"seed": 2}],
    "11": [{"seed": 10}, {"seed": 20}],
    "12": [{"fps": 60}, {"seed": 1}],
    "13": [{"seed": 1}, {"fps": 60}],
    "14": [{"seed": 1}, {"seed": 2}],
}
QUICK = SETTINGS["01"][0]
CASES = [
    pytest.param(number, one, marks=pytest.mark.slow if one is QUICK else pytest.mark.thorough)
    for number, both in SETTINGS.items()
    for one in both
]


def test_every_notebook_has_two():
    assert {number: len(both) for number, both in SETTINGS.items()} == dict.fromkeys(NOTEBOOKS, 2)


@pytest.mark.parametrize(("number", "settings"), CASES)
def test_a_notebook_holds_for_other_settings(number, settings, tmp_path, shared_cache):
    assert run_quickly(NOTEBOOKS[number], tmp_path, settings, shared_cache) == ""
