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
# # Solutions: What does not add up: the formulas
#
# Questions to [the notebook](../10_paper_audit.ipynb). Write into the blank cells of the
# [exercises](../exercises/10_paper_audit.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/10_paper_audit.ipynb) lie apart.

# %%
from dataclasses import replace

import numpy as np

from vidsindy_lite import cameras
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, score

normal = np.array([2.0, 3.0, 6.0]) / 7
rotation = cameras.rotation_to_z(normal)
truths = {name: system.shift(REFERENCE_OFFSET) for name, system in SYSTEMS.items()}

# %% [markdown]
# **1.** (Prove.) `rotation` takes `normal` to the z axis. The text of the paper takes its transpose. Of which camera is that
# the rotation: which unit vector does the transpose take to the z axis? Set `other` to its three numbers, without solving
# anything.

# %% tags=["solution"]
other = normal * (-1, -1, 1)

# %%
assert np.allclose(rotation.T @ other, (0, 0, 1)), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# By Rodrigues' formula the transpose is the rotation about the same axis by the same angle, backwards. The axis lies in
# the xy-plane, so what was tilted away from z to one side is now tilted to the other: half a turn about z.

# %% [markdown]
# **2.** (Explore.) How far off may one coefficient of Lorenz' law in the reference frame, `truths["Lorenz"]`, be so that the
# relative $\ell_2$ error of the whole law stays below 1 %, if it is that of x in dy/dt, which is 28? Set `off` to that
# number, to three digits.

# %% tags=["solution"]
off = 0.01 * np.linalg.norm(truths["Lorenz"].coefficients)
print(off)

# %%
lorenz = truths["Lorenz"]
values = lorenz.coefficients.copy()
values[lorenz.terms.index("x"), 1] += off
assert abs(score(replace(lorenz, coefficients=values), lorenz).l2 / 0.01 - 1) < 0.01, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Nearly 3, a tenth of the coefficient itself: the norm is that of the constants that the shift makes.
