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
# # Solutions: What does not add up: the tables
#
# Questions to [the notebook](../10b_paper_tables.ipynb). Write into the blank cells of the
# [exercises](../exercises/10b_paper_tables.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/10b_paper_tables.ipynb) lie apart.

# %%
from dataclasses import replace
from zlib import crc32

import numpy as np
from scipy.optimize import least_squares

from vidsindy_lite.study import REFERENCE_OFFSET, SCORES, SYSTEMS, metrics, score

row = SCORES["Table S3", "WeakSINDy", "RayleighBenard"]
print(f"recall {row.recall:.2%}, precision {row.precision:.2%}, printed with {row.false_positives} false terms")
native = SYSTEMS["NoseHoover"]
whole = native.shift(REFERENCE_OFFSET)


# %%
def misfit(unknowns, law):
    """What is left of a law if it is the true one in axes of other scales and origins."""
    scale, offset = np.exp(unknowns[:3]), unknowns[3:]
    powers = np.prod(scale**native.exponents, axis=1)[:, None]
    seen = replace(native, coefficients=native.coefficients * scale / powers).shift(offset)
    library = np.unique(np.concatenate([law.exponents, seen.exponents]), axis=0)
    apart = metrics.coefficients_in(seen, library) - metrics.coefficients_in(law, library)
    return apart.ravel() / np.linalg.norm(whole.coefficients)

# %% [markdown]
# **1.** (Implement.) The law of RayleighBenard has 11 terms. Which pairs (true terms found, false terms) give the
# recall and precision printed above? Try 1 to 11 true and 0 to 49 false ones, and set `possible` to the list of the
# pairs that round to both.

# %% tags=["solution"]
def printed_as(hits, false, true_terms=11):
    return f"{hits / true_terms:.2%}", f"{hits / (hits + false):.2%}"


asked = f"{row.recall:.2%}", f"{row.precision:.2%}"
possible = [(hits, false) for hits in range(1, 12) for false in range(50) if printed_as(hits, false) == asked]
print(possible)

# %%
assert crc32(f"10.1 {sorted((int(a), int(b)) for a, b in possible)}".encode()) == 4205841709, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# Ten false terms: $11/(11+10)=52.38\,\%$. Printed are nine, for which P would be 55 %. With recall 100 % in every one
# of five trials, no average helps.

# %% [markdown]
# **2.** (Explore.) `misfit` above has six free numbers, the logarithms of the axes' scales and their origins. Give it a
# law with one coefficient that is really wrong, a half of that of z in NoseHoover's dy/dt (of `whole`), and find the
# six by `least_squares`, from no stretch and `REFERENCE_OFFSET`. What is left, compared with the l2 error of that
# law? Set `answer`: `"a"` all of it, `"b"` about a half, `"c"` less than a fifth.

# %% tags=["solution"]
values = whole.coefficients.copy()
values[whole.terms.index("z"), 1] *= 0.5
halved = replace(whole, coefficients=values)
fit = least_squares(misfit, [0, 0, 0, *REFERENCE_OFFSET], args=(halved,), xtol=1e-14, ftol=1e-14)
left = np.linalg.norm(fit.fun)
rounding = 0.005 * np.sqrt(np.count_nonzero(values)) / np.linalg.norm(whole.coefficients)
taken, beyond = left / score(halved, whole).l2, left / rounding
print(f"misfit: {taken:.2f} of l2, {beyond:.0f} times what rounding explains; scales {np.exp(fit.x[:3])}")
assert taken < 0.2
assert beyond > 10
answer = "c"

# %%
assert crc32(f"10.2 {answer}".encode()) == 4193792158, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# It takes most of $\ell_2$ away, by stretching z to the double. That is why a small misfit alone proves nothing: this
# one is many times what rounding explains. Only a misfit below rounding is evidence.

# %% [markdown]
# **3.** (Prove.) A table prints precision 100 % and one false positive for a mean of five trials. Can both be true?
# Set `answer` to `"yes"` or `"no"`.

# %% tags=["solution"]
answer = "no"

# %%
assert crc32(f"10.3 {answer}".encode()) == 357813279, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# If the mean of the precisions is 100 %, each of them is, as none can be more; then no trial has a false term, and
# their mean number is 0. A number rounded up to 1 would need a mean of at least $\tfrac12$, three false terms in five
# trials, and each of these trials has a precision below one. So no.
