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
# # Solutions: Which terms are the law: the search, its path, its errors
#
# Questions to [the notebook](../04b_the_search.ipynb). Write into the blank cells of the
# [exercises](../exercises/04b_the_search.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/04b_the_search.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
from itertools import product
from zlib import crc32

import numpy as np
from scipy.integrate import solve_ivp

from vidsindy_lite import discover, dynamics
from vidsindy_lite.study import SYSTEMS, add_noise

native = SYSTEMS["Lorenz"]
rng = np.random.default_rng(seed)
t, x = native.trajectory(800)
library = dynamics.monomials(x, dynamics.monomial_exponents(3, 2))  # ten candidates
slopes = native(x)[:, 1] + 2 * rng.standard_normal(len(x))  # of y, with an error of 2

# %%
def priced(kept):
    """The loss of a fit with these of the ten terms, and a penalty of log(n) for each of them."""
    columns = library[:, np.array(kept, bool)]
    left = slopes - columns @ np.linalg.lstsq(columns, slopes)[0]
    return left @ left / 2**2 + np.log(len(x)) * np.sum(kept)

# %% [markdown]
# **1.** (Explore.) Lorenz' law has one more origin from which it has only 7 terms. Where? Set `origin` to a triple,
# so that `native.shift(origin)` has 7 terms, too.

# %% tags=["solution"]
origin = (0, 0, -28)

# %%
assert any(origin), "not yet: another one"
assert native.shift(origin).support.sum() == native.support.sum(), "not yet"
print(native.shift(origin).text())
print("right")

# %% [markdown] tags=["solution"]
# At z = 28 the term 28 x in dy/dt is absorbed by xz, and a constant appears in dz/dt. The number of terms is the
# same, so the data alone cannot decide. The solver penalises every axis along which the origin is moved nearly as
# much as a term, and the one that leaves z alone wins.

# %% [markdown]
# **2.** (Explore.) The law of a pendulum from one record had a term $xy^2$ that nobody put there. Records on several
# orbits tell. Take $\ddot x=-\sin x$, let go at 3, 2 and 1 rad, 800 samples up to $t=50$ each, with 1 % noise
# (`add_noise(x, 0.01, rng)`); discover one law `cubic` from the list of the three records `(t, x)`. Where does $xy^2$
# come from? Set `answer`: `"a"` the noise, `"b"` the energy, which is the same all along one record, `"c"` a wrong
# degree.

# %% tags=["solution"]
def swing(start):
    times = np.linspace(0, 50, 800)
    y = solve_ivp(lambda _, s: (s[1], -np.sin(s[0])), (0, 50), (start, 0), t_eval=times, rtol=1e-9).y
    return times, add_noise(y.T, 0.01, rng)


cubic = discover([swing(3.0), swing(2.0), swing(1.0)])
answer = "b"
print(cubic)

# %%
assert cubic.status == "suspect", "not yet: the law"
assert crc32(f"04.2 {answer}".encode()) == 2955113837, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# The energy $E=y^2/2-\cos x$ is the same all along a record, so $xy^2=2x\,(E+\cos x)$ there: different functions in
# space, the same one on the orbit. Records on several orbits tell them apart. With degree 3 the curve then misses the
# data, and says so.

# %% [markdown]
# **3.** (Implement.) Find the terms of dy/dt by a descent: begin with all ten, drop the term without which `priced`
# is lowest, and repeat as long as that lowers it. Name the result `kept`, ten times True or False.

# %% tags=["solution"]
kept = np.ones(10, bool)
while True:
    without = [kept & (np.arange(10) != k) for k in np.flatnonzero(kept)]
    best = min(without, key=priced)
    if priced(best) >= priced(kept):
        break
    kept = best
print(kept)

# %%
everything = (np.array(subset) for subset in product((False, True), repeat=10) if any(subset))
assert np.isclose(priced(kept), min(map(priced, everything))), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Terms go one by one, and it ends at the best of all 1,023 subsets, without trying them. The package gets the cost of
# every change from one inverse, by formulas like the $z^2$ of a drop below, in place of a fit for each; and it starts
# from nothing as well, as a descent may stop early.

# %% [markdown]
# **4.** (Prove.) Show that a fit without one term loses $z^2$, the square of its coefficient over its standard error.
# Compute `z2`, ten numbers, for the fit of `slopes` by all ten terms; the errors of `slopes` are 2.

# %% tags=["solution"]
coefficients = np.linalg.lstsq(library, slopes)[0]
covariance = 2**2 * np.linalg.inv(library.T @ library)
z2 = coefficients**2 / np.diag(covariance)

# %%
everything = np.ones(10, bool)
lost = [priced(np.arange(10) != k) - priced(everything) + np.log(len(x)) for k in range(10)]
assert np.allclose(z2, lost, rtol=1e-3), "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Minimise $(\boldsymbol\lambda-\mathbf c)^T\mathbf S(\boldsymbol\lambda-\mathbf c)$ under $\lambda_k=0$. With a
# multiplier $\mu$, $\mathbf S(\boldsymbol\lambda-\mathbf c)=\mu\,\mathbf e_k$, so $\boldsymbol\lambda-\mathbf
# c=\mu\,\mathbf S^{-1}\mathbf e_k$. Row $k$ says $-c_k=\mu\,(\mathbf S^{-1})_{kk}$, and the loss is $\mu^2(\mathbf
# S^{-1})_{kk}=c_k^2/(\mathbf S^{-1})_{kk}$. As $\mathbf S^{-1}$ is the covariance, $(\mathbf S^{-1})_{kk}$ is the
# square of the standard error.
