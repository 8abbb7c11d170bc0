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
# # Solutions: Noise and missing data
#
# Questions to [the notebook](../06_robustness_and_ablation.ipynb). Write into the blank cells of the
# [exercises](../exercises/06_robustness_and_ablation.ipynb), and run the check behind each: it says *right*, or
# fails. The [solutions](../solutions/06_robustness_and_ablation.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
import numpy as np
from scipy.interpolate import make_smoothing_spline

from vidsindy_lite import PolynomialSystem, discover, dynamics
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, add_noise, drop_blocks, score

truth = SYSTEMS["SprottF"].shift(REFERENCE_OFFSET)
t, x = truth.trajectory(1500)
rng = np.random.default_rng(seed)
noisy = add_noise(x, 0.1, rng)

# %% [markdown]
# **1.** (Explore.) Gaps *and* noise: hide 20 % of `noisy` in blocks by `drop_blocks(noisy, 0.2, rng)`, discover, and
# name the law `both`. Does it still work?

# %% tags=["solution"]
both = discover(t, drop_blocks(noisy, 0.2, rng))
print(both, score(both, truth), sep="\n")

# %%
assert score(both, truth).exact, "not yet"
assert not np.array_equal(both.coefficients, discover(t, noisy).coefficients), "not yet: no gaps"
print("right")

# %% [markdown] tags=["solution"]
# It does: the terms are the true ones. Four fifths of the samples are left, so that the coefficients are about as
# exact as before; by chance they may even be closer. If there is a warning, read it: gaps make the law harder to tell.

# %% [markdown]
# **2.** (Implement.) Curve and law one after the other (the notebook's Model-A): smooth `noisy` by a spline (`make_smoothing_spline`, column by column),
# regress its slopes on the monomials up to degree 3 (`dynamics.monomials(path, dynamics.monomial_exponents(3, 3))`),
# and, ten times, cut coefficients below 0.1 and fit those that are left again. Name the table of coefficients, (20, 3), `regressed`.

# %% tags=["solution"]
curves = [make_smoothing_spline(t, column) for column in noisy.T]
path, slope = (np.stack([curve(t, order) for curve in curves], axis=1) for order in (0, 1))
library = dynamics.monomials(path, dynamics.monomial_exponents(3, 3))
regressed = np.linalg.lstsq(library, slope)[0]
for _ in range(10):
    regressed[np.abs(regressed) < 0.1] = 0
    for j, kept in enumerate(regressed.T != 0):
        regressed[kept, j] = np.linalg.lstsq(library[:, kept], slope[:, j])[0]

# %%
assert np.shape(regressed) == (20, 3), "not yet: the shape"
small = np.abs(regressed[regressed != 0]) < 0.1
apart = PolynomialSystem(truth.names, dynamics.monomial_exponents(3, 3), regressed)
assert not small.any(), "not yet: small coefficients"
assert score(apart, truth).recall > 0.5, "not yet: true terms are missing"
assert score(apart, truth).false_positives < 15, "not yet: too many terms; cut, fit again, and repeat"
together = discover(t, noisy)
print("apart:", score(apart, truth), "together:", score(together, truth), sep="\n")
print("right")

# %% [markdown] tags=["solution"]
# The spline follows some of the noise, most of all at the ends, and its slopes follow more of it. Fitted together,
# every sample takes part in every slope; the threshold, which who knows the truth may choose, is gone as well.

# %% [markdown]
# **3.** (Prove.) Why does noise of 10 % cost a method that takes differences of neighbours so much more than one that
# fits a curve? A central difference over $2h$ of samples with errors $\sigma$ errs by $c\,\sigma/h$. Set `c`.

# %% tags=["solution"]
c = 1 / np.sqrt(2)

# %%
errors, h = rng.standard_normal(200_000), 0.01
assert np.isclose(c, h * np.gradient(errors, h)[1:-1].std(), rtol=0.02), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# The error $\sigma/(\sqrt2\,h)$ grows as the frame rate does: more samples make each slope worse, and their number
# makes up for only a part. A curve with $m$ free numbers in a record of $n$ samples errs by about $\sigma\sqrt{m/n}$
# in its values, and its slope by that over the distance of its knots, which does not grow with the frame rate.
