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
# # Solutions: The lab experiment: a ball on a table
#
# Questions to [the notebook](../08_lab_experiment.ipynb). Write into the blank cells of the
# [exercises](../exercises/08_lab_experiment.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/08_lab_experiment.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
from zlib import crc32

import numpy as np

from vidsindy_lite import PerspectiveCamera, Rig, cameras, learn_cameras, reconstruct


# %%
def at_the_table(azimuth, elevation, reach):
    """A camera that looks at the middle of the table from there, upright."""
    a, e = np.radians([azimuth, elevation])
    normal = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    angle = np.arctan2(*cameras.rotation_to_z(normal)[:2, 2])
    place = np.array([350.0, 350.0, 0.0]) + reach * normal
    return PerspectiveCamera(position=place, normal=normal, scale=1 / (0.575 * reach), angle=angle)


# %%
truth = Rig([at_the_table(-80, 35, 1900), at_the_table(40, 30, 2200), at_the_table(160, 40, 2000)])
t = (np.arange(30)[:, None] - 15) / 25  # s
rolling = [((300, 300), (50, 170)), ((430, 350), (-220, 130)), ((350, 450), (240, -80))]
x = np.concatenate([[*middle, 26.25] + t * [*velocity, 0.0] for middle, velocity in rolling])  # mm
start, one = truth.uncalibrated(keep=0), truth.cameras[1]
rng = np.random.default_rng(seed)
pixels = [camera.project(x) + 0.2 * rng.standard_normal((len(x), 2)) for camera in truth.cameras]


def rms(error):
    return np.sqrt(np.mean(np.linalg.norm(error, axis=-1) ** 2))

# %% [markdown]
# **1.** (Explore.) A ball is seen as an ellipse, whose centre is not quite the image of the ball's centre:
# `camera.ball_image(x, radius)[0]`. Learn the cameras from these centres, without noise, for a ball 57.15 mm across, and
# reconstruct. How far is the path off? Set `answer`: `"a"` below 0.1 mm, `"b"` 0.1 to 1 mm, `"c"` more.

# %% tags=["solution"]
larger = [camera.ball_image(x, 57.15 / 2)[0] for camera in truth.cameras]
error = rms(reconstruct(larger, learn_cameras(larger, start)) - x)
print(f"{error:.3f} mm rms")
assert error < 0.1
answer = "a"

# %%
assert crc32(f"08.1 {answer}".encode()) == 4003231631, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Hardly at all. The shift of the centroid, and the error with it, grows with the square of the radius.

# %% [markdown]
# **2.** (Explore.) Are two perspective cameras enough, one of them calibrated? Learn the first two from `pixels`, and
# name the path `two`.

# %% tags=["solution"]
pair = learn_cameras(pixels[:2], Rig(start.cameras[:2]))
two = reconstruct(pixels[:2], pair)

# %%
three = reconstruct(pixels, learn_cameras(pixels, start))
assert rms(two - x) < 3, "not yet"
assert min(rms(two - three), rms(two - x)) > 0.01, "not yet: of two cameras, and of pixels"
print(f"{rms(two - x):.2f} mm rms; three: {rms(three - x):.2f} mm")
print("right")

# %% [markdown] tags=["solution"]
# Yes, nearly as good as with three. But with one condition per frame left, little would tell that a camera was
# measured wrong.

# %% [markdown]
# **3.** (Prove.) The image of a ball is an ellipse. Which way is its centre off the image of the ball's centre, and
# by how much? Write a function `shift(f, rho, beta)`, in pixels, for a camera with a focal length of `f` pixels and a
# ball that is seen at an angle `beta` off the optical axis, within a cone of half the angle `rho`, to the leading
# order in `rho`; positive is outwards.

# %% tags=["solution"]
def shift(f, rho, beta):
    return f * rho**2 * np.tan(beta) / np.cos(beta) ** 2

# %%
for beta in rng.uniform(0.1, 0.6, 5):
    ends = 1000 * np.tan(beta + np.array([-1, 1]) * 1e-3)
    assert np.isclose(shift(1000, 1e-3, beta), ends.mean() - 1000 * np.tan(beta), rtol=1e-3), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# The outline is where a cone about the ball meets the sensor. Its axis leads to the ball's centre, at an angle
# $\beta$ to the optical axis; its sides leave at $\beta\pm\rho$ with $\sin\rho=r/d$, and meet the sensor at
# $f\tan(\beta\pm\rho)$. As the tangent bends upwards, their middle lies farther out than $f\tan\beta$, by about
# $f\rho^2\tan\beta/\cos^2\beta$: outwards, and growing with the square of the radius.

# %% [markdown]
# **4.** (Implement.) Project the path `x` into the camera `one` by the pinhole equation of the notebook, from
# `one.position`, `one.normal`, `one.rows`, `one.scale`, `one.angle` and `one.image_size`. Name the pixels `by_hand`.

# %% tags=["solution"]
depth = (one.position - x) @ one.normal
cos, sin = np.cos(one.angle), np.sin(one.angle)
X, Y = np.array([[cos, -sin], [sin, cos]]) @ (one.rows @ (x - one.position).T) / (one.scale * depth)
width, height = one.image_size
by_hand = np.column_stack([(width - 1) / 2 + X, (height - 1) / 2 - Y])

# %%
assert np.allclose(by_hand, one.project(x)), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# $\mathcal T(\vartheta)$ has orthonormal columns, so its inverse is its transpose; and the image counts from its
# upper left pixel, with $v$ downwards.
