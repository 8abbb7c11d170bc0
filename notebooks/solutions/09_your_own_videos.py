# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Solutions: Your own videos
#
# Questions to [the notebook](../09_your_own_videos.ipynb). Write into the blank cells of the
# [exercises](../exercises/09_your_own_videos.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/09_your_own_videos.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
from dataclasses import replace
from zlib import crc32

import numpy as np
from scipy.linalg import expm

from vidsindy_lite import PolynomialSystem, Rig, learn_cameras
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS

t, x = SYSTEMS["Lorenz"].shift(REFERENCE_OFFSET).trajectory(300)
rig, rng = Rig.around(x), np.random.default_rng(seed)
tracks = [camera.project(x) + 0.1 * rng.standard_normal((len(x), 2)) for camera in rig.cameras]
first, second, third = rig.uncalibrated(keep=0).cameras
k1, k2, join, drag = *rng.uniform(1, 3, 2), 0.5, 0.1
springs = PolynomialSystem.from_terms({
    "x1": {"v1": 1}, "x2": {"v2": 1},
    "v1": {"x1": -k1 - join, "x2": join, "v1": -drag}, "v2": {"x2": -k2 - join, "x1": join, "v2": -drag},
})  # fmt: skip

# %% [markdown]
# **1.** (Prove.) A ball on a turntable is filmed. Why can the lags of its videos not be told, and does it matter for
# the law? Set `answer`: `"a"` it matters, `"b"` it does not, as long as every turn is like the other, `"c"` the lags
# can be told.

# %% tags=["solution"]
answer = "b"

# %%
assert crc32(f"09.1 {answer}".encode()) == 1257574277, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# The motion repeats itself: one turn more or less fits as well, and a warning says so. For the law it does not matter
# as long as every turn is like the other: the views agree at each of these lags.

# %% [markdown]
# **2.** (Explore.) Take away the positions of `first` and `second` (`replace(camera, position=None)`) and learn the
# cameras from `tracks`. What happens? Set `answer`: `"a"` they are learned, `"b"` it is refused, as the scales are
# unknown, `"c"` it is refused, as the scene could be moved along a line of view.

# %% tags=["solution"]
try:
    learn_cameras(tracks, Rig([replace(camera, position=None) for camera in (first, second)] + [third]))
    raise AssertionError("not refused")
except ValueError as refusal:
    print(refusal)
answer = "c"

# %%
assert crc32(f"09.2 {answer}".encode()) == 1068794186, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# It is refused: one position is left, and the scene could be moved along the line of view of that camera without any
# change in the images, if the two others are moved with it.

# %% [markdown]
# **3.** (Implement.) The law of two weights on springs, `springs`, is linear, with the states x1, x2, v1, v2. Set `A`
# to its matrix, (4, 4), and `decay` to the time in which the motion dies away by a factor e.

# %% tags=["solution"]
A = np.array([springs(unit) for unit in np.eye(4)]).T
decay = -1 / np.linalg.eigvals(A).real.max()

# %%
x0 = rng.standard_normal(4)
later = springs.simulate(np.array([0.0, 3.0]), x0)[-1]
assert np.allclose(expm(3 * np.array(A)) @ x0, later, atol=1e-5), "not yet: the matrix"
assert np.isclose(np.linalg.eigvals(A).real * decay, -1).all(), "not yet: the time"
print("right")

# %% [markdown] tags=["solution"]
# $\dot{\mathbf y}=\mathbf A\mathbf y$ has the solution $e^{\mathbf At}\mathbf y(0)$, and the columns of $\mathbf A$
# are the law at unit states. Every mode obeys $\lambda^2+0.1\lambda+\kappa=0$ with a stiffness $\kappa$ of its own,
# so all of them swing at their own pace and die at the same one, half the drag.
