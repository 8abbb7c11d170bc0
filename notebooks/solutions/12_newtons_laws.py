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
# # Solutions: Newton's laws from filmed positions
#
# Questions to [the notebook](../12_newtons_laws.ipynb). Write into the blank cells of the
# [exercises](../exercises/12_newtons_laws.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/12_newtons_laws.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
from zlib import crc32

import numpy as np

from vidsindy_lite import Library, PolynomialSystem, discover

rng = np.random.default_rng(seed)
thrown = {"x": {"vx": 1.0}, "y": {"vy": 1.0}, "vx": {"vx": -0.4}, "vy": {"1": -9.81, "vy": -0.4}}
flight = PolynomialSystem.from_terms(thrown, degree=2)
s = np.arange(90) / 60
throws = [(4.0, 5.0), (-3.0, 6.0), (6.0, 2.0), (1.0, 7.0)]
runs = [(s, flight.simulate(s, np.array([0.0, 1.5, *throw]))[:, :2]) for throw in throws]
runs = [(s, path + 0.003 * rng.standard_normal(path.shape)) for s, path in runs]
sines = Library.polynomial(1) + Library.fourier(1)

# %% [markdown]
# **1.** (Prove.) Show that along one throw with linear drag $\ddot y=-g-c\,\dot y$ can be written as $\ddot
# y=-a\,\dot x$ on the path. Write $a$ as a function `a(g, c, vx, vy)` of the velocity at the start.

# %% tags=["solution"]
def a(g, c, vx, vy):
    return (c * vy + g) / vx

# %%
for vx, vy in throws:
    state = flight.simulate(s, np.array([0.0, 1.5, vx, vy]))
    assert np.allclose(flight(state)[:, 3], -a(9.81, 0.4, vx, vy) * state[:, 2], atol=1e-3), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# $\dot x=\dot x_0e^{-ct}$ and $\dot y=-g/c+(\dot y_0+g/c)e^{-ct}$, so $\ddot y=-c(\dot y_0+g/c)e^{-ct}=-\frac{c\,\dot
# y_0+g}{\dot x_0}\,\dot x$. The constant $a$ depends on the throw: two throws refute it.

# %% [markdown]
# **2.** (Explore.) Throw twice: discover the law of the first two of `runs`, with `degree=2, order=2`, and name it
# `two`. Is that enough?

# %% tags=["solution"]
two = discover(runs[:2], degree=2, order=2)
print(two)

# %%
assert (two.system.support == flight.support).all(), "not yet: the terms"
four = discover(runs, degree=2, order=2)
assert two.physics()["g"].error > four.physics()["g"].error, "not yet: this is more than two throws"
print("right")

# %% [markdown] tags=["solution"]
# The law is right, with error bars that are wider.

# %% [markdown]
# **3.** (Implement.) Let the order be found: leave `order` out, with all of `runs`. Name the law `law`, read
# `law.note`, and set `answer` to the order, 1 or 2.

# %% tags=["solution"]
law = discover(runs, degree=2)
print(law.note)
answer = 2

# %%
assert law.system.names == flight.names, "not yet: the law"
assert crc32(f"12.3 {answer}".encode()) == 2660657323, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# No law of order 1 does as well: the same place is passed with many velocities.

# %% [markdown]
# **4.** (Explore.) Let a pendulum, $\ddot x=-9.81\sin x-0.1\,\dot x$, hang in a wind that pushes with $0.5\cos x$.
# Simulate it for 20 s at 60 samples a second from 1.5 rad and from 0.1 rad, add noise of 1 % of the standard deviation, and
# discover with `library=sines, order=2`. Put the laws into a dictionary `laws_of`, by the angle. Is the push found
# beside the sine?

# %% tags=["solution"]
terms = {"x": {"vx": 1.0}, "vx": {"sin(x)": -9.81, "vx": -0.1, "cos(x)": 0.5}}
windy, u, laws_of = PolynomialSystem.from_terms(terms, library=sines), np.arange(1200) / 60, {}
for angle in (1.5, 0.1):
    clean = windy.simulate(u, np.array([angle, 0.0]))[:, :1]
    noisy = clean + 0.01 * clean.std() * rng.standard_normal(clean.shape)
    print(laws_of.setdefault(angle, discover(u, noisy, order=2, library=sines)))

# %%
wide = laws_of[1.5]
names = {wide.terms[row] for row in np.flatnonzero(wide.system.support[:, 1])}
assert names == {"sin(x)", "vx", "cos(x)"}, "not yet"
assert abs(wide.coefficients[wide.terms.index("cos(x)"), 1] - 0.5) < 0.1, "not yet: the push"
assert 0.1 in laws_of, "not yet: 0.1 rad"
print("right")

# %% [markdown] tags=["solution"]
# At 1.5 rad it is. At 0.1 rad the pendulum is a spring about another point: a line is as good as a sine, and a
# constant as a cosine. The first is said in a warning.
