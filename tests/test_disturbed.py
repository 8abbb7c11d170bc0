"""No notebook hangs on the last digits: all of them, with every track and trajectory disturbed.

`disturbed/sitecustomize.py` does it, in every process that has its folder on PYTHONPATH. The full
profile is disturbed in the same way, in a copy of the repository whose figures are then compared:

    VIDSINDY_DISTURB=1e-9:1 PYTHONPATH=tests/disturbed make figures FORCE=1
    python -m vidsindy_lite compare figures ../copy/figures

and so is a run with another kernel of OpenBLAS or other threads (OPENBLAS_CORETYPE=Haswell,
OMP_NUM_THREADS=2), with VIDSINDY_CACHE set to a folder of its own.

Each run of all tests disturbs the quick notebooks once, see `test_notebooks`; `pytest -m thorough`
does it twice more.
"""

import json

import numpy as np
import pytest
from helpers import SIZE, python, run_quickly

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


@pytest.mark.slow
def test_every_target_is_disturbed_by_so_much(tmp_path, shared_cache):
    video = tmp_path / "one.mov"
    ran = [python("-c", SHOW, video, cache=shared_cache, seed=seed) for seed in (None, 1, 2)]
    shown = [json.loads(one.stdout) for one in ran]
    for name in ("simulate", "runge_kutta_4", "reconstruct", "track"):
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
    path = tmp_path / "hair.py"
    path.write_text(HAIR)
    assert run_quickly(path, tmp_path, {}, shared_cache) == ""
    assert "AssertionError" in run_quickly(path, tmp_path, {}, shared_cache, 1)
    assert "colour: must be" in run_quickly(path, tmp_path, {"colour": 1}, shared_cache)


@pytest.mark.slow
def test_disturbed_sweeps_find_no_results_of_others(shared_cache):
    show = "import os; print(os.environ['VIDSINDY_CACHE'])"
    twice = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {show!r}])"
    folders = {python("-c", show, cache=shared_cache, seed=seed).stdout for seed in (None, 1, 2)}
    assert len(folders) == 3
    assert python("-c", twice, cache=shared_cache, seed=1).stdout in folders
