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
# # Solutions: The scoreboard
#
# Questions to [the notebook](../11_scoreboard.ipynb). Write into the blank cells of the
# [exercises](../exercises/11_scoreboard.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/11_scoreboard.ipynb) lie apart.

# %%
from zlib import crc32

import numpy as np

from vidsindy_lite import discover
from vidsindy_lite.study import FLOWS, corruption, score

flow = FLOWS["Roessler"]
t, clean = flow.trajectory(800)

# %% [markdown]
# **1.** (Explore.) How coarse may an integrator be before the law of a flow is lost? Discover the law from
# `corruption.coarse_path(flow, t, flow.x0, "RK45", rtol, rtol)` with `rtol` of 1e-6, 1e-4 and 1e-2, and put the laws
# into a dictionary `told`, by `rtol`. Set `answer` to the largest of the three at which the terms are exactly the
# true ones.

# %% tags=["solution"]
told = {rtol: discover(t, corruption.coarse_path(flow, t, flow.x0, "RK45", rtol, rtol)) for rtol in (1e-6, 1e-4, 1e-2)}
for rtol, law in told.items():
    print(f"{rtol:g}: {score(law, flow)}; {law.status}")
answer = max(rtol for rtol, law in told.items() if score(law, flow).exact)

# %%
assert score(told[answer], flow).exact, "not yet: other terms"
assert not any(score(told[rtol], flow).exact for rtol in told if rtol > answer), "not yet: one is coarser"
assert score(told[1e-6], flow).l2 < 1e-3, "not yet: the finest"
print("right")

# %% [markdown] tags=["solution"]
# The errors of an integrator are smooth, so that they look like a law. As long as they are smaller than the smallest
# terms, the terms are found; beyond it, nobody could tell.

# %% [markdown]
# **2.** (Prove.) A clock that is wrong by $\tau(t)$ turns $\dot{\mathbf x}=\mathbf f(\mathbf x)$ into what law? For
# which $\tau$ are the terms the same? Set `answer`: `"a"` for any, `"b"` if it grows evenly, `"c"` if it is periodic.

# %% tags=["solution"]
answer = "b"

# %%
assert crc32(f"11.2 {answer}".encode()) == 3013552568, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# With $\mathbf y(t)=\mathbf x(t+\tau(t))$, $\dot{\mathbf y}=(1+\dot\tau)\,\mathbf f(\mathbf y)$. A constant
# $\dot\tau$ scales all coefficients alike and leaves the terms as they are; any other makes the law depend on time.

# %% [markdown]
# **3.** (Implement.) Add a kind of error of your own, a dead zone: a coordinate stays at its last value until it has
# moved by 1 % of its range. Name the path that comes of `clean` so `held`, and its law `law`.

# %% tags=["solution"]
held = clean.copy()
for k in range(1, len(held)):
    small = np.abs(clean[k] - held[k - 1]) < 0.01 * np.ptp(clean, axis=0)
    held[k, small] = held[k - 1, small]
law = discover(t, held)
print(f"{score(law, flow)}; {law.status}")

# %%
zone, steps = 0.01 * np.ptp(clean, axis=0), np.abs(np.diff(held, axis=0))
assert (np.abs(held - clean) <= zone + 1e-12).all(), "not yet: too far from the path"
assert ((steps == 0) | (steps >= zone - 1e-12)).all(), "not yet: smaller steps than the zone"
assert (held[1:][np.abs(clean[1:] - held[:-1]) >= zone] == clean[1:][np.abs(clean[1:] - held[:-1]) >= zone]).all(), "not yet: beyond the zone it follows at once"
assert law.coefficients.shape[1] == 3, "not yet: the law"
print("right")

# %% [markdown] tags=["solution"]
# Such an error lags behind the motion and depends on where that turns: it is neither white nor a function of the
# place. Compare with `corruption.quantise` at the same size.
