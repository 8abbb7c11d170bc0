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
# # Solutions: From three videos to the equations
#
# Questions to [the notebook](../00_tour.ipynb). Write into the blank cells of the
# [exercises](../exercises/00_tour.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/00_tour.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
from zlib import crc32

import numpy as np

from vidsindy_lite import discover
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, score

truth = SYSTEMS["Lorenz"].shift(REFERENCE_OFFSET)  # in the cameras' frame
t, clean = truth.trajectory(1500)
x = clean + 1e-3 * np.random.default_rng(seed).standard_normal(clean.shape)
law = discover(t, x)

# %% [markdown]
# **1.** (Explore.) How few samples are enough? Discover the law from every second, fourth and eighth sample of `x`,
# and put the three laws into a dictionary `laws`, by the step: `laws[2]`, `laws[4]`, `laws[8]`.

# %% tags=["solution"]
laws = {step: discover(t[::step], x[::step]) for step in (2, 4, 8)}
for step, fewer in laws.items():
    print(step, score(fewer, truth), *fewer.warnings, sep="\n")

# %%
assert set(laws) == {2, 4, 8}, "not yet: three steps"
assert len({one.coefficients.tobytes() for one in laws.values()}) == 3, "not yet: three different laws"
assert all(score(one, truth).exact for one in laws.values()), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Even every eighth sample, 12 in a period, gives exactly the true terms. Where the samples are too few for that, as
# in a shorter record, a warning says so.

# %% [markdown]
# **2.** (Implement.) Follow the found law yourself, with the classical Runge-Kutta method of order four and one step
# a sample. `law.predict(state)` gives the slope. Start at `law.curve(t[:1])[0]`, and put the first 150 states into an
# array `states` of shape (150, 3).

# %% tags=["solution"]
slope, states = law.predict, [law.curve(t[:1])[0]]
for h in np.diff(t[:150]):
    k1 = slope(states[-1])
    k2 = slope(states[-1] + h / 2 * k1)
    k3 = slope(states[-1] + h / 2 * k2)
    k4 = slope(states[-1] + h * k3)
    states.append(states[-1] + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
states = np.array(states)

# %%
assert np.shape(states) == (150, 3), "not yet: the shape"
simulated = law.simulate(law.curve(t[:1])[0], t[:150]).x
assert np.abs(states - simulated).max() < 0.01 * np.ptp(simulated), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Four slopes, averaged with the weights of Simpson's rule. `simulate` takes as many steps as its tolerance asks for,
# where this takes one a sample; on a chaotic path the small difference grows with time.

# %% [markdown]
# **3.** (Prove.) The law has a frame of its own in which it is shortest. Show that a polynomial law of degree $p$
# keeps its degree under any shift of the origin, and that its terms of degree $p$ do not change at all. Which two
# terms of Lorenz' law does that hold for? Set `answer` to a string of the two, in alphabetical order, such
# as `"x,y"`.

# %% tags=["solution"]
answer = "xy,xz"

# %%
assert crc32(f"00.3 {answer}".encode()) == 1852272705, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Put $\mathbf x=\mathbf y+\boldsymbol\Delta$ into a monomial and multiply out: $\prod_i(y_i+\Delta_i)^{p_i}$ is
# $\prod_iy_i^{p_i}$ plus monomials of a lower degree. A term of the highest degree gets nothing from any other, as
# there is none above it. In Lorenz' law, these are $xz$ and $xy$.
