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
# # Solutions: Ninety minutes: the whole subject for one lecture
#
# Questions to [the notebook](../14_ninety_minutes.ipynb). Write into the blank cells of the
# [exercises](../exercises/14_ninety_minutes.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/14_ninety_minutes.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
import numpy as np

from vidsindy_lite import PolynomialSystem, Rig, discover, dynamics, reconstruct
from vidsindy_lite.study import SYSTEMS, score

truth = SYSTEMS["Lorenz"]
t, x = truth.trajectory(800)
rig, rng = Rig.around(x), np.random.default_rng(seed)
tracks = [camera.project(x) + rng.standard_normal((len(x), 2)) for camera in rig.cameras]
path = reconstruct(tracks, rig)
spline = dynamics.smooth([(t, path)], rng).splines[0]
library, slopes = dynamics.monomials(spline(t), dynamics.monomial_exponents(3, 2)), spline.derivative()(t)

# %%
def sparse(threshold):
    coefficients = np.linalg.lstsq(library, slopes)[0]
    for _ in range(10):
        coefficients[np.abs(coefficients) < threshold] = 0
        for j, kept in enumerate(coefficients.T != 0):
            coefficients[kept, j] = np.linalg.lstsq(library[:, kept], slopes[:, j])[0]
    return coefficients


def is_right(coefficients):
    found = PolynomialSystem(truth.names, dynamics.monomial_exponents(3, 2), coefficients)
    return score(found, truth).exact

# %% [markdown]
# **1.** (Implement.) Find the path from the three tracks without `reconstruct`, by one call of `np.linalg.lstsq`.
# `camera.plane_coordinates(track)` is what a camera saw in the coordinates of its plane, $\mathbf R^-\mathbf x$, and
# `camera.rows` is $\mathbf R^-$. Name the path `by_hand`.

# %% tags=["solution"]
rows = np.vstack([camera.rows for camera in rig.cameras])
seen = np.hstack([camera.plane_coordinates(track) for camera, track in zip(rig.cameras, tracks, strict=True)])
by_hand = np.linalg.lstsq(rows, seen.T)[0].T

# %%
assert np.shape(by_hand) == x.shape, "not yet: the shape"
assert np.abs(by_hand - path).std() < 0.3 * np.abs(x - path).std(), "not yet: the path of all three tracks"
print("right")

# %% [markdown] tags=["solution"]
# Six equations for three unknowns, the same six rows in each frame. (`reconstruct` weighs each camera by the size of
# its pixels, so that the two differ by a fraction of a pixel.)

# %% [markdown]
# **2.** (Explore.) `sparse(threshold)` is the regression of the lecture. How small, and how large, may its threshold
# be so that exactly the true terms are left? Find both limits to 10 %, among 0.02 to 5, and set `low` and `high`.

# %% tags=["solution"]
thresholds = np.geomspace(0.02, 5, 100)
fits = [is_right(sparse(threshold)) for threshold in thresholds]
low, high = thresholds[fits][[0, -1]]
print(f"{low:.2f} to {high:.2f}")

# %%
assert all(is_right(sparse(limit)) for limit in (low, high)), "not yet: at the limits the terms are not right"
assert not any(is_right(sparse(limit)) for limit in (low / 1.1, 1.1 * high)), "not yet: there is more room"
print("right")

# %% [markdown] tags=["solution"]
# The smallest coefficient of the law is 1, of y in dy/dt, and above it the term goes. Below the lower limit, what the
# noise makes stays. In between lie all thresholds that work, and who does not know the law cannot tell which they
# are.

# %% [markdown]
# **3.** (Explore.) How long has the film to be? Find the smallest multiple of 25 samples of `path` from whose
# beginning `discover(..., degree=2)` has the status "ok" for the first time. Name it `enough`.

# %% tags=["solution"]
enough = 25
while discover(t[:enough], path[:enough], degree=2).status != "ok":
    enough += 25
print(enough)

# %%
statuses = [discover(t[:k], path[:k], degree=2).status for k in range(25, enough + 1, 25)]
assert statuses[-1] == "ok" not in statuses[:-1], "not yet"
print("right")

# %% [markdown] tags=["solution"]
# As soon as the record covers one turn of the motion and a half. The law itself is often right before; but one turn is
# no proof that the next one obeys it, too.
