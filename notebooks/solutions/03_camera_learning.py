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
# # Solutions: Learning cameras, and the target's path in space
#
# Questions to [the notebook](../03_camera_learning.ipynb). Write into the blank cells of the
# [exercises](../exercises/03_camera_learning.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/03_camera_learning.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
from dataclasses import replace
from zlib import crc32

import numpy as np

from vidsindy_lite import Rig, cameras, learn_cameras, reconstruct, residuals
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS

t, x = SYSTEMS["Lorenz"].shift(REFERENCE_OFFSET).trajectory(500)
truth = Rig.around(x)
start = truth.uncalibrated(keep=0)  # scale and angle of the first camera alone are known
rng = np.random.default_rng(seed)
noise = [rng.normal(size=(len(x), 2)) for _ in truth.cameras]
tracks = [camera.project(x) + 0.3 * e for camera, e in zip(truth.cameras, noise, strict=True)]

# %% [markdown]
# **1.** (Explore.) The normal of the third camera was measured one degree wrong: take `start` with `replace(camera,
# normal=camera.normal + np.deg2rad(1) * camera.rows[0])` in its place. Learn the cameras, and compare the rms of the
# residuals with that of the right rig. Do they tell? Set `answer`: `"a"` no, they are the same, `"b"` they are up to
# twice as large, `"c"` they are more than five times as large.

# %% tags=["solution"]
third = start.cameras[2]
wrong = replace(third, normal=third.normal + np.deg2rad(1) * third.rows[0])
rigs = [learn_cameras(tracks, rig) for rig in (Rig([*start.cameras[:2], wrong]), start)]
tilted, right = (np.sqrt(np.mean(np.hstack(residuals(tracks, rig)) ** 2)) for rig in rigs)
print(f"{tilted:.1f} px, right: {right:.1f} px")
assert tilted > 5 * right
answer = "c"

# %%
assert crc32(f"03.1 {answer}".encode()) == 2000824242, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Yes: they are many times larger than those of the noise alone. Look at the residuals before anything else.

# %% [markdown]
# **2.** (Explore.) Are two cameras enough, one of them calibrated? Learn the first two from their tracks alone,
# reconstruct the path, and name it `two`, an array of shape (500, 3).

# %% tags=["solution"]
pair = learn_cameras(tracks[:2], Rig(start.cameras[:2]))
two = reconstruct(tracks[:2], pair)

# %%
pixel = np.mean([camera.scale for camera in truth.cameras])
assert np.shape(two) == x.shape, "not yet: the shape"
off = np.sqrt(np.mean((two - x) ** 2))
assert off < pixel, "not yet"
three = reconstruct(tracks, learn_cameras(tracks, start))
assert not np.allclose(two, three), "not yet: these are three cameras"
assert not np.allclose(two, x), "not yet: this is the truth"
print(f"off by {off / pixel:.2f} px; with three cameras {np.sqrt(np.mean((three - x) ** 2)) / pixel:.2f} px")
print("right")

# %% [markdown] tags=["solution"]
# Yes. Two views leave one condition per frame, the epipolar one, and with it two unknowns against hundreds of
# equations. The path is somewhat less exact, and only one number of four per frame is left to raise an alarm.

# %% [markdown]
# **3.** (Prove.) Why can no number of frames tell the scale of all cameras at once? Which quantities have to be
# multiplied by $\lambda$ together with the path $\mathbf x$, so that no pixel changes? Set `answer` to the right ones
# of `angles`, `normals`, `positions`, `scales`, in alphabetical order, as `"angles,normals"`.

# %% tags=["solution"]
answer = "positions,scales"

# %%
assert crc32(f"03.3 {answer}".encode()) == 3382043124, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# If $\mathbf x$ and the cameras fit the pixels, so do $\lambda\mathbf x$, the positions times $\lambda$ and the
# scales times $\lambda$: $s\,\mathcal T\mathbf x_c+\Delta_c=\mathbf R^-\mathbf x$ is linear in all of them. Here the
# measured positions would betray it, if they were exact; the one calibrated camera settles it without them.

# %% [markdown]
# **4.** (Implement.) Solve Eq. (4) for the second and the third camera by one call of `np.linalg.lstsq`, and put
# their two scales into a list `scales`, their two angles into a list `angles`. `camera.centred(track)` are the
# $\mathbf x_c$ of a track, `camera.plane_coordinates(track)` is $s\,\mathcal T\mathbf x_c+\Delta_c$ of a camera that
# is calibrated, `camera.offset` is $\Delta_c$.

# %% tags=["solution"]
known, *unknown = start.cameras
inverse = known.rows @ np.linalg.pinv(np.vstack([camera.rows for camera in unknown]))
blocks, target = [], known.plane_coordinates(tracks[0])
for camera, track, part in zip(unknown, tracks[1:], (inverse[:, :2], inverse[:, 2:]), strict=True):
    X, Y = camera.centred(track).T
    blocks.append(part @ np.array([[X, Y], [Y, -X]]).transpose(2, 0, 1))
    target = target - part @ camera.offset
c2, s2, c3, s3 = np.linalg.lstsq(np.concatenate(blocks, axis=2).reshape(-1, 4), target.ravel())[0]
scales, angles = [np.hypot(c2, s2), np.hypot(c3, s3)], [np.arctan2(s2, c2), np.arctan2(s3, c3)]

# %%
packaged = cameras.learn_cameras_eq4(tracks, start).cameras[1:]
assert np.allclose(scales, [camera.scale for camera in packaged]), "not yet: the scales"
turned = np.exp(1j * np.array([camera.angle for camera in packaged]))
assert np.allclose(np.exp(1j * np.array(angles)), turned), "not yet: the angles"
print("right")

# %% [markdown] tags=["solution"]
# Two rows a frame, four columns, and what is known on the right: the pixels of camera 1 in its plane, less what the
# offsets of the others predict. The scales are the lengths of $(s\cos\vartheta,s\sin\vartheta)$, the angles their
# directions.
