"""Every notebook holds for other settings, and none hangs on the last digits.

Assertions of a notebook have to test what it says, not the numbers of its default: each has two
other settings. One of a small one runs with all tests, the rest by `pytest -m thorough`.

Disturbed are every track and trajectory, by `disturbed/sitecustomize.py`, in every process that has
its folder on PYTHONPATH. The full profile is disturbed in the same way, in a copy of the repository
whose figures are then compared:

    VIDSINDY_DISTURB=1e-9:1 PYTHONPATH=tests/disturbed make figures FORCE=1
    python -m vidsindy_lite compare figures ../copy/figures

and so is a run with another kernel of OpenBLAS or other threads (OPENBLAS_CORETYPE=Haswell,
OMP_NUM_THREADS=2), with VIDSINDY_CACHE set to a folder of its own.

Each run of all tests disturbs the quick notebooks once, see `test_notebooks`; `pytest -m thorough`
does it twice more.
"""

import json
from contextlib import redirect_stdout
from io import StringIO

import numpy as np
import pytest
from helpers import SIZE, python, run_quickly

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


# -------------------------------------------------------------------------------------- last digits

SHOW = """\
import json, sys
import numpy as np
from vidsindy_lite import Rig, Scene, reconstruct, render_video, track
from vidsindy_lite.dynamics import runge_kutta_4
from vidsindy_lite.study import SYSTEMS
t, x = SYSTEMS["Lorenz"].trajectory(40)
path = np.linspace([0.0, 0.0, 0.0], [100.0, 40.0, 5.0], 40)
rig = Rig.around(path)
video = render_video(sys.argv[1], rig.cameras[0].project(path), Scene(background="plain"))
print(json.dumps({
    "simulate": x.tolist(),
    "runge_kutta_4": runge_kutta_4(SYSTEMS["Lorenz"], t, (-8, 7, 27)).tolist(),
    "reconstruct": reconstruct([camera.project(path) for camera in rig.cameras], rig).tolist(),
    "track": track(video).pixels.tolist(),
}))
"""


@pytest.fixture(scope="module")
def shown(tmp_path_factory, shared_cache):
    """What the functions return, undisturbed and by two seeds."""
    video = tmp_path_factory.mktemp("shown") / "one.mov"
    with redirect_stdout(StringIO()) as here, pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["-c", str(video)])
        exec(SHOW, {})
    ran = [python("-c", SHOW, video, cache=shared_cache, seed=seed) for seed in (1, 2)]
    assert all(r.returncode == 0 for r in ran), [r.stderr for r in ran]
    return [json.loads(text) for text in (here.getvalue(), *(r.stdout for r in ran))]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["simulate", "runge_kutta_4", "reconstruct", "track"])
def test_every_target_is_disturbed_by_so_much(shown, name):
    plain, first, second = (np.array(values[name]) for values in shown)
    apart = np.abs(first - plain)[plain != 0] / np.abs(plain[plain != 0])
    assert SIZE / 3 < np.sqrt(np.nanmean(apart**2)) < 3 * SIZE
    assert not np.array_equal(first, second, equal_nan=True)


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


@pytest.mark.slow
def test_disturbed_sweeps_find_no_results_of_others(shared_cache):
    show = "import os; print(os.environ['VIDSINDY_CACHE'])"
    twice = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {show!r}])"
    folders = {python("-c", show, cache=shared_cache, seed=seed).stdout for seed in (None, 1, 2)}
    assert len(folders) == 3
    assert python("-c", twice, cache=shared_cache, seed=1).stdout in folders
