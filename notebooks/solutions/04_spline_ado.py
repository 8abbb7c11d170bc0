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
# # Solutions: Splines, physics and sparsity: one objective, two optimisers
#
# Questions to [the notebook](../04_spline_ado.ipynb). Write into the blank cells of the
# [exercises](../exercises/04_spline_ado.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/04_spline_ado.ipynb) lie apart.

# %%
import numpy as np

from vidsindy_lite import dynamics

spans = np.linspace(0, 2, 11)  # ten spans of a cubic spline
knots = dynamics.clamped_knots(spans)
times = np.linspace(0, 2, 200)
G = dynamics.design_matrix(knots, times)  # values of the 13 basis functions, a row a time
D = dynamics.design_matrix(knots, times, order=1)  # and their slopes

# %% [markdown]
# **1.** (Prove.) A curve of one coordinate with an offset is $\mathbf G\mathbf P+\Delta$: 14 unknowns, the control points and
# $\Delta$. There is a direction in which all of them can be moved so that neither the curve nor its slope changes. Set
# `direction` to these 14 numbers, $\Delta$ last.

# %% tags=["solution"]
direction = np.append(np.ones(13), -1.0)

# %%
assert np.shape(direction) == (14,), "not yet: 14 numbers"
assert np.any(direction), "not yet: not all of them zero"
assert np.allclose(G @ direction[:13] + direction[13], 0), "not yet: the curve changes"
assert np.allclose(D @ direction[:13], 0), "not yet: its slope changes"
print("right")

# %% [markdown] tags=["solution"]
# The basis functions sum to one, so that one more on all control points is one more on the curve, which one less of the
# offset takes back; their slopes sum to zero. Both losses are the same all along that direction: no data can tell $\Delta$.

# %% [markdown]
# **2.** (Implement.) Let the curve obey $\dot x=-x$ exactly in the middle of each of the ten spans and at both ends, and
# begin at $x(0)=1$: as many equations as control points. Solve them for `P`, 13 numbers.

# %% tags=["solution"]
nodes = np.concatenate([[spans[0]], (spans[1:] + spans[:-1]) / 2, [spans[-1]]])
held, slope = (dynamics.design_matrix(knots, nodes, order) for order in (0, 1))
begin = dynamics.design_matrix(knots, np.zeros(1))
P = np.linalg.solve(np.vstack([slope + held, begin]), np.append(np.zeros(len(nodes)), 1.0))

# %%
off = np.abs(G @ P - np.exp(-times)).max()
middles = (spans[1:] + spans[:-1]) / 2
there = dynamics.design_matrix(knots, middles) + dynamics.design_matrix(knots, middles, order=1)
assert off < 1e-4, f"not yet: the curve is off by {off:.1e}"
assert np.abs(there @ P).max() < 1e-9, "not yet: the law does not hold in the middles"
print("right")

# %% [markdown] tags=["solution"]
# No step of an integrator was made, and yet the curve is the solution to some $10^{-5}$: this is collocation. In the
# notebook the same equations, weighted, stand beside the misfit of the data, and the law's coefficients are unknown, too.
