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
# # Solutions: From a point in space to a point in a view plane
#
# Questions to [the notebook](../01_projection_proofs.ipynb). Write into the blank cells of the
# [exercises](../exercises/01_projection_proofs.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/01_projection_proofs.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
from zlib import crc32

import numpy as np
from scipy.spatial.transform import Rotation

from vidsindy_lite import cameras

normals = np.random.default_rng(seed).standard_normal((3, 3))
normals /= np.linalg.norm(normals, axis=1, keepdims=True)
e_z = np.array([0.0, 0.0, 1.0])

# %% [markdown]
# **1.** (Prove.) $\mathbf R$ is not the only rotation that takes $\mathbf n$ to $\mathbf e_z$. Which are the others,
# and what do they do to a camera? Write a function `other(n, phi)` that returns the one that differs from
# `cameras.rotation_to_z(n)` by an angle `phi`.

# %% tags=["solution"]
def other(n, phi):
    return Rotation.from_rotvec([0, 0, phi]).as_matrix() @ cameras.rotation_to_z(n)

# %%
for n in normals:
    R, packaged = other(n, 0.3), cameras.rotation_to_z(n)
    assert np.allclose(R @ R.T, np.eye(3)), "not yet: no rotation"
    assert np.allclose(R @ n, e_z), "not yet: n is not taken to e_z"
    assert np.isclose(Rotation.from_matrix(R @ packaged.T).magnitude(), 0.3), "not yet: the angle"
print("right")

# %% [markdown] tags=["solution"]
# All $\mathbf R_z(\varphi)\mathbf R$, with a turn about $\mathbf e_z$ afterwards. The in-plane coordinates and the
# offset turn by $\varphi$ together, so $s\,\mathcal T(\vartheta)\mathbf x_c+\Delta_c=\mathbf R^-\mathbf x$ still
# holds with $\vartheta$ changed by $\varphi$. The convention is free, but every part of a program has to share one.

# %% [markdown]
# **2.** (Explore.) Cameras below the scene look up, with the normals $(10^{-6},0,-1)$, $(-10^{-6},0,-1)$ and $(0,10^{-6},-1)$,
# nearly the same. Which of their matrices `cameras.rotation_to_z(n)` are nearly the same, too? Set `answer`: `"a"`
# all of them, `"b"` none, `"c"` the first two, `"d"` the last two.

# %% tags=["solution"]
one, opposite, aside = (cameras.rotation_to_z([*tilt, -1.0]) for tilt in ((1e-6, 0), (-1e-6, 0), (0, 1e-6)))
print(np.abs(one - opposite).max(), np.abs(one - aside).max())
assert np.abs(one - opposite).max() < 1e-5 < 1 < np.abs(one - aside).max()
answer = "c"

# %%
assert crc32(f"01.2 {answer}".encode()) == 264555147, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# The first two turn about the y axis, by nearly $\pi$, in opposite directions: nearly the same. The third turns about
# the x axis, and its X' and Y' have the opposite sign. So near $-\mathbf e_z$ the in-plane angle of a camera jumps as
# its normal moves; learn the angle with the normal at hand, do not carry it over.

# %% [markdown]
# **3.** (Implement.) Write Rodrigues' formula for the rotation that takes a unit vector $\mathbf n$ to $\mathbf e_z$
# in three lines of numpy, as a function `rodrigues(n)`.

# %% tags=["solution"]
def rodrigues(n):
    v, c = np.cross(n, (0, 0, 1)), n[2]
    K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + K + K @ K / (1 + c)

# %%
for n in normals:
    assert np.allclose(rodrigues(n), cameras.rotation_to_z(n), atol=1e-9), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# With $\mathbf v=\mathbf n\times\mathbf e_z=\sin\beta\,\mathbf k$, the formula $\mathbf I+\sin\beta\,\mathbf
# K_k+(1-\cos\beta)\mathbf K_k^2$ becomes $\mathbf I+\mathbf K_v+\mathbf K_v^2/(1+\cos\beta)$, as $(1-c)/s^2=1/(1+c)$.
# It fails at $\mathbf n=-\mathbf e_z$ alone, where any axis in the plane would do.
