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
# # Solutions: Seven systems, from videos to equations
#
# Questions to [the notebook](../05_discovery.ipynb). Write into the blank cells of the
# [exercises](../exercises/05_discovery.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/05_discovery.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
from dataclasses import replace
from zlib import crc32

import numpy as np

from vidsindy_lite import PolynomialSystem, discover
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, add_noise, score

truth = SYSTEMS["Tsucs2"].shift(REFERENCE_OFFSET)
flow = SYSTEMS["SprottF"]
t, x = flow.trajectory(800)
rng = np.random.default_rng(seed)

# %% [markdown]
# **1.** (Explore.) The paper's law for Tsucs2 has 0.63 in place of 1 as the coefficient of x in dy/dt. Put it into
# the coefficients of `truth`, and `score` the law against `truth`. Set `l2` to the relative l2 error, and `worst` to
# that of the worst coefficient.

# %% tags=["solution"]
wrong = truth.coefficients.copy()
wrong[truth.terms.index("x"), 1] = 0.63
scored = score(replace(truth, coefficients=wrong), truth)
l2, worst = scored.l2, scored.max_coefficient_error
print(f"l2 {l2:.4f}, worst coefficient {worst:.0%}")
assert l2 < 0.002

# %%
assert crc32(f"05.1 {worst:.2f} {1000 * l2:.1f}".encode()) == 3895241054, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Hardly anything of it shows in the l2 error: the constant 210 that the shift creates dominates the norm. Hence the
# column "worst coefficient".

# %% [markdown]
# **2.** (Explore.) How does the error of a law grow with the noise? Discover the law of `flow` from `add_noise(x,
# level, rng)`, five times with a level of 0.01 and five times with 0.1, and set `l2` to a dictionary with the mean
# relative l2 error of each, by level.

# %% tags=["solution"]
l2 = {}
for level in (0.01, 0.1):
    laws = [discover(t, add_noise(x, level, rng)) for _ in range(5)]
    l2[level] = np.mean([score(law, flow).l2 for law in laws])
print({level: f"{error:.1e}" for level, error in l2.items()})

# %%
assert set(l2) == {0.01, 0.1}, "not yet: two levels"
assert 1e-5 < l2[0.01] < 0.1, "not yet: the smaller noise"
assert 2 < l2[0.1] / l2[0.01] < 40, "not yet: the larger noise"
print("right")

# %% [markdown] tags=["solution"]
# About as the noise itself: ten times the noise, some ten times the error; of one draw it may be less or more. As long
# as no term is lost or false, that is least squares.

# %% [markdown]
# **3.** (Prove.) Which terms does a shift of the origin add to Lorenz' law, axis by axis? A shift along one of the
# axes adds no term but a constant. Set `answer` to `"x"`, `"y"` or `"z"`.

# %% tags=["solution"]
lorenz = SYSTEMS["Lorenz"]
for axis, step in zip("xyz", np.eye(3), strict=True):
    print(axis, "\n", lorenz.shift(step).text(), sep="")
answer = "z"

# %%
assert crc32(f"05.3 {answer}".encode()) == 2683154108, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# With $\mathbf x=\mathbf y+\boldsymbol\Delta$ the term $xz$ gives $\Delta_xz+\Delta_zx$ beside itself, and $xy$ gives
# $\Delta_xy+\Delta_yx$. So $\Delta_x\neq0$ adds $z$ to dy/dt and $y$ to dz/dt, $\Delta_y\neq0$ adds $x$ to dz/dt, and
# $\Delta_z$ changes the coefficient of $x$ in dy/dt, which may even vanish. Constants come with every shift but those
# along which the law does not move.

# %% [markdown]
# **4.** (Implement.) Write a function `scores(law, truth)` that computes precision, recall and the relative l2 error
# from `law.terms`, `law.coefficients` and the same of the truth. The two need not have the same terms, nor in the
# same order.

# %% tags=["solution"]
def scores(law, truth):
    terms = sorted({*law.terms, *truth.terms})
    tables = []
    for one in (law, truth):
        rows = dict(zip(one.terms, one.coefficients, strict=True))
        tables.append(np.array([rows.get(term, np.zeros(3)) for term in terms]))
    ours, true = tables
    right = np.sum((ours != 0) & (true != 0))
    error = np.linalg.norm(ours - true) / np.linalg.norm(true)
    return right / np.sum(ours != 0), right / np.sum(true != 0), error

# %%
guess = {"x": {"y": 0.9, "x": 0.1}, "y": {"z": rng.normal()}, "z": {"z": -1.0, "x^2": rng.normal()}}
law = PolynomialSystem.from_terms(guess, degree=2)
packaged = score(law, flow)
assert np.allclose(scores(law, flow), (packaged.precision, packaged.recall, packaged.l2)), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Precision is the share of the found terms that are true, recall that of the true terms that are found. The error is
# that of all coefficients as one vector, so the largest of them decides.
