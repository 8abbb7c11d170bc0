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
# # Solutions: The realistic scene: a tumbling target behind trees
#
# Questions to [the notebook](../07_realistic_scene.ipynb). Write into the blank cells of the
# [exercises](../exercises/07_realistic_scene.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/07_realistic_scene.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
from zlib import crc32

import numpy as np

from vidsindy_lite import Rig, discover, learn_cameras, reconstruct
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, score

truth = SYSTEMS["Lorenz"].shift(REFERENCE_OFFSET)
t, x = truth.trajectory(1000)
rig, rng = Rig.around(x), np.random.default_rng(seed)
tracks = [camera.project(x) + 0.05 * rng.standard_normal((len(x), 2)) for camera in rig.cameras]
for first, track in enumerate(tracks):  # each view loses the target for some frames
    track[100 + 250 * first : 180 + 250 * first] = np.nan
learned = discover(t, reconstruct(tracks, learn_cameras(tracks, rig.uncalibrated(keep=0))))

# %% [markdown]
# **1.** (Explore.) How much of the error of `learned`, the law with learned cameras, comes from the cameras?
# Reconstruct the path with the true ones, `rig`, discover its law, and name it `known`.

# %% tags=["solution"]
known = discover(t, reconstruct(tracks, rig))
print(score(learned, truth), score(known, truth), sep="\n")

# %%
assert score(known, truth).exact, "not yet"
assert not np.array_equal(known.coefficients, learned.coefficients), "not yet: the cameras were learned"
assert not np.array_equal(known.coefficients, discover(t, x).coefficients), "not yet: not of the tracks"
assert max(score(one, truth).l2 for one in (known, learned)) < 0.01
print("right")

# %% [markdown] tags=["solution"]
# None that matters: from learned and from true cameras the error of the law is nearly the same, and which is the
# smaller one is chance. What is left is the tracker's.

# %% [markdown]
# **2.** (Implement.) An orthographic camera is an affine map, $\mathbf x_c=\mathbf A\mathbf x+\mathbf b$. Read
# $\mathbf A$ and $\mathbf b$ off `camera.project`, and find the path by least squares, without `reconstruct`, in the
# frames that all three views see. Name it `by_hand`.

# %% tags=["solution"]
b = np.hstack([camera.project(np.zeros((1, 3))) for camera in rig.cameras])
A = np.hstack([camera.project(np.eye(3)) for camera in rig.cameras]) - b
complete = np.isfinite(np.hstack(tracks)).all(axis=1)
by_hand = np.linalg.lstsq(A.T, (np.hstack(tracks)[complete] - b).T)[0].T

# %%
seen = np.isfinite(np.hstack(tracks)).all(axis=1)
packaged = reconstruct(tracks, rig)[seen]
assert np.shape(by_hand) == packaged.shape, "not yet: the frames"
assert np.abs(by_hand - packaged).max() < 0.3 * np.abs(packaged - x[seen]).max(), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# The image of the origin is $\mathbf b$, those of the three unit points, less $\mathbf b$, are the columns of
# $\mathbf A$. Six equations for three unknowns, one such problem a frame, and all frames share the matrix.
# `reconstruct` does the same, weighs pixels by their size, and uses frames that only two cameras see, too.

# %% [markdown]
# **3.** (Prove.) Behind a tree the tracker sees a part of the target. Which way is the centre of that part off, and
# why does `track` leave such frames out rather than correct them? Set `answer`: `"a"` towards the tree, `"b"` away
# from the tree, `"c"` either way, so that it averages out.

# %% tags=["solution"]
answer = "b"

# %%
assert crc32(f"07.3 {answer}".encode()) == 4131480970, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Away from the tree: the visible part lies on the free side. The error is up to half the width of the target, always
# in the same direction along a pass, so that it does not average out; it would bend the path, and a smooth bend looks
# like a law. A correction would need the target's full shape in that frame, and it tumbles. A frame that is left out
# costs one sample.
