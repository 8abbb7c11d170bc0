# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#       jupytext_version: 1.19.6
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # What does not add up: the tables
#
# In this notebook, we compare the columns of the paper's tables with one another, and with the equations printed beside them.
#
# **What you will see**
#
# * the errors of Tables 1 and S3 recomputed from the equations of Table S2;
# * rows whose columns exclude one another;
# * where the largest errors come from: two are clocks, one is a ruler;
# * the list of all findings, with what each of them means for the results.
#
# **Afterwards you can** recompute a paper's claims from its own tables.
#
# **What you need**: what a precision and a recall are. The paper's numbers are data in `vidsindy_lite/study/published.toml`.
#
# **Covers** Tables 1, 2 and S1-S3.

# %% tags=["parameters"]
profile: str = "full"  # full or quick
seed: int = 0  # of the resampling in E-SINDy

# %%
from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares

from vidsindy_lite import dynamics
from vidsindy_lite.companion.artifacts import save_figure, save_table, versions
from vidsindy_lite.study import (
    ABLATION,
    LAWS,
    REFERENCE_OFFSET,
    SCORES,
    SYSTEMS,
    baselines,
    metrics,
    plots,
    score,
)

plt.style.use("vidsindy_lite.study.plots.vidsindy")
frames = {"full": 1500, "quick": 400}[profile]
truths = {name: system.shift(REFERENCE_OFFSET) for name, system in SYSTEMS.items()}
true_terms = {name: int(truth.support.sum()) for name, truth in truths.items()}

# %% [markdown]
# Every finding goes into one list, with the value computed here; the list is the last table.

# %%
findings = []


def note(where, claim, finding, value, matters):
    findings.append({
        "where": where, "the paper": claim, "what we find": finding,
        "recomputed": value, "does it matter": matters,
    })  # fmt: skip


# %% [markdown]
# ## First, what does add up
#
# Table S1, shifted by (10, 10, 0), is the ground truth of Table S2, every term of all seven systems; the
# only digits that differ are those of 2.667 for 8/3. So the unstated reference frame is no guess.
#
# The claim that the method beats its baselines is borne out by the $\ell_2$ errors of every row, and still is
# when the wrong time steps found below are put right.

# %%
ground = {name: score(LAWS["Ground truth", name], truth) for name, truth in truths.items()}
assert all(scored.exact for scored in ground.values())
rounded = {name for name, scored in ground.items() if scored.max_coefficient_error > 1e-12}
assert rounded == {"Lorenz"}
assert ground["Lorenz"].max_coefficient_error < 2e-4

for (table, method, name), row in SCORES.items():
    if method != "Ours":
        assert row.l2 > SCORES[table, "Ours", name].l2


# %% [markdown]
# ## Errors recomputed from the printed equations
#
# Table S2 prints the laws whose scores are in Table 1. Their $\ell_2$ error can be computed, up to the
# rounding of coefficients to two decimals.

# %%
def rounding_reach(law, truth):
    """By how much the errors of a printed law, recomputed and printed, may differ by rounding."""
    coefficients = 0.01 / 2 * np.sqrt(np.count_nonzero(law.coefficients))
    return coefficients / np.linalg.norm(truth.coefficients) + 1e-4 / 2


# %%
def recompute(method, name, law=None):
    law = LAWS[method, name] if law is None else law
    printed, scored = SCORES["Table 1", method, name], score(law, truths[name])
    reach = rounding_reach(law, truths[name])
    return {
        "system": name, "method": method,
        "l2 printed (e-2)": 100 * printed.l2, "l2 recomputed (e-2)": 100 * scored.l2,
        "difference / rounding": abs(scored.l2 - printed.l2) / reach,
        "false positives printed": printed.false_positives,
        "false positives counted": scored.false_positives,
        "worst coefficient (%)": 100 * scored.max_coefficient_error,
    }  # fmt: skip


rows = [recompute(method, name) for name in SYSTEMS for method in ("Ours", "PySINDy")]
save_table("audit_l2", rows, caption="Table 1 recomputed from the equations of Table S2.")

# %% [markdown]
# Ten of fourteen rows agree within rounding. What does the 82.27 of WangSun do? Printed is
# "$+82.27y$", and no term in z, where the truth is $-0.5y+10z$. As a coefficient of z it fits:

# %%
law = LAWS["PySINDy", "WangSun"]
y, z = law.terms.index("y"), law.terms.index("z")
values = law.coefficients.copy()
values[z, 1], values[y, 1] = values[y, 1], 0.0
mended = replace(law, coefficients=values)
as_z = recompute("PySINDy", "WangSun", mended)
as_printed = 100 * score(law, truths["WangSun"]).l2
print(f"with 82.27y {as_printed:.2f}, with 82.27z {as_z['l2 recomputed (e-2)']:.2f}")
print(f"Table 1     {as_z['l2 printed (e-2)']:.2f}")
assert as_z["difference / rounding"] < 1

differences = {f"{row['system']}, {row['method']}": row["difference / rounding"] for row in rows}
differences["WangSun, PySINDy, 82.27 as z"] = as_z["difference / rounding"]

# %% jupyter={"source_hidden": true} tags=["hide-input"]
fig, axes = plt.subplots(figsize=(7.5, 0.32 * len(differences) + 1.1))
heights = np.arange(len(differences))[::-1]
values = np.maximum(list(differences.values()), 1e-3)
within = values <= 1
axes.axvspan(0.8e-3, 1, color="0.92", zorder=0)
axes.plot(values[within], heights[within], "o", label="within the rounding of the print")
axes.plot(values[~within], heights[~within], "s", label="not explained by rounding")
axes.set(xscale="log", xlim=(0.8e-3, 1e2), ylim=(-0.7, len(heights) - 0.3))
axes.set_yticks(heights, list(differences))
axes.set_xlabel("|recomputed - printed| / largest effect of rounding")
axes.grid(axis="y", visible=False)
fig.legend(loc="outside upper center", ncols=2)
caption = "Printed against recomputed l2 errors of Table 1, in units of what rounding can explain."
save_figure("audit_l2_figure", fig, caption=caption, numbers=differences)

# %% [markdown]
# *Distance between the errors of Table 1 and those of the equations of Table S2, over what rounding can
# explain (at least 0.001 is drawn). The farthest, WangSun, comes back as soon as 82.27 is read as the coefficient of z.*

# %%
unexplained = {name for name, value in differences.items() if value > 1}
print("not explained:", sorted(unexplained))
assert unexplained == {
    "SprottF, Ours", "NoseHoover, PySINDy", "Tsucs2, PySINDy", "WangSun, PySINDy",
}  # fmt: skip
agree = len(rows) - len(unexplained)
sprott = next(row for row in rows if row["system"] == "SprottF" and row["method"] == "Ours")
tsucs = next(row for row in rows if row["system"] == "Tsucs2" and row["method"] == "PySINDy")
assert differences["NoseHoover, PySINDy"] < 1.5  # 824.44 beside 824.47

# %% [markdown]
# The scores are said to be averages over five trials. That ten of fourteen are, within the
# rounding of its coefficients, the score of *one* printed law leaves two readings: they are the scores of one trial, or the trials hardly
# differed. No standard deviation is given; for clean videos the second is well possible.

# %%
note("Table S2", "WangSun, PySINDy: +82.27y", "82.27z",
     f"l2 {as_printed:.2f} as printed, "
     f"{as_z['l2 recomputed (e-2)']:.2f} as z; Table 1: {as_z['l2 printed (e-2)']:.2f}",
     "no: misprint, the score is that of 82.27z")
note("Table 1", "l2 of SprottF (own method), Tsucs2 (PySINDy)", "not those of Table S2's laws",
     f"{sprott['l2 recomputed (e-2)']:.2f} for {sprott['l2 printed (e-2)']:.2f}, "
     f"{tsucs['l2 recomputed (e-2)']:.2f} for {tsucs['l2 printed (e-2)']:.2f}", "hardly")
note("Sec. 4.1", "results are averaged over five trials",
     "most errors are, within rounding, those of one printed law",
     f"{agree} of {len(rows)} rows", "no standard deviation is known")  # fmt: skip

# %% [markdown]
# ## Rows that exclude themselves
#
# A law with $h$ of $T$ true terms and $f$ false ones has recall $h/T$ and precision $h/(h+f)$. So the
# three columns False Positives, P and R are two numbers. Which rows can no law have? And which not even an
# average over five, with the mean number of false positives rounded?

# %%
HALF = (0.5 + 1e-6) * 1e-4  # of the last digit of P and R, with room for binary fractions
LIBRARY = 60  # coefficients: 20 monomials up to degree 3 in three equations


def counts_behind(row, T):
    """Numbers of true and of false terms of one law that give the printed P and R."""
    return [
        (h, f) for h in range(1, T + 1) for f in range(LIBRARY - T + 1)
        if abs(h / T - row.recall) <= HALF and abs(h / (h + f) - row.precision) <= HALF
    ]  # fmt: skip


# %% [markdown]
# An average over five: go through all sums of true and of false terms, with the least and the largest sum of precisions that each
# can have. What lies between them is not excluded.

# %% jupyter={"source_hidden": true} tags=["hide-input"]
def could_be(row, T, trials=1):
    """Whether laws could score a printed row, on average over several trials."""
    ends = np.array([-1, 1])
    false_sum = trials * (row.false_positives + 0.5 * ends)
    hit_sum = trials * (row.recall + HALF * ends) * T
    precision_sum = trials * (row.precision + HALF * ends)
    shape = (trials * T + 1, int(false_sum[1]) + 1)
    low, high = np.full(shape, np.inf), np.full(shape, -np.inf)
    low[0, 0] = high[0, 0] = 0.0
    for _ in range(trials):
        lower, higher = np.full(shape, np.inf), np.full(shape, -np.inf)
        for h, f in product(range(T + 1), range(min(shape[1] - 1, LIBRARY - T) + 1)):
            precision = h / (h + f) if h else 0.0
            now, before = np.s_[h:, f:], np.s_[: shape[0] - h, : shape[1] - f]
            lower[now] = np.minimum(lower[now], low[before] + precision)
            higher[now] = np.maximum(higher[now], high[before] + precision)
        low, high = lower, higher
    hits, false = np.indices(shape)
    printed = (hits >= hit_sum[0]) & (hits <= hit_sum[1]) & (false >= false_sum[0])
    return (printed & (low <= precision_sum[1]) & (high >= precision_sum[0])).any()


# %%
published = {key: (row, true_terms[key[2]]) for key, row in SCORES.items()}
published |= {
    ("Table 2", f"{method}, {condition} {rate} %", "SprottF"): (row, true_terms["SprottF"])
    for (condition, rate, method), row in ABLATION.items()
}

# %%
impossible = {key: (row, T) for key, (row, T) in published.items() if not could_be(row, T)}
rows = [
    {
        "table": table, "system": name, "method": method, "true terms": T,
        "false positives": row.false_positives,
        "P (%)": 100 * row.precision, "R (%)": 100 * row.recall,
        "P and R say": "; ".join(f"{h} true, {f} false" for h, f in counts_behind(row, T)),
        "mean of five": "possible" if could_be(row, T, trials=5) else "impossible",
    }
    for (table, method, name), (row, T) in impossible.items()
]  # fmt: skip
save_table("audit_rows", rows, caption="Rows whose false positives, precision and recall disagree.")

# %%
never = sum(row["mean of five"] == "impossible" for row in rows)
in_s3 = sum(row["table"] == "Table S3" for row in rows)
assert (len(rows), never, in_s3) == (11, 6, 8)
assert sum(row["method"] == "WeakSINDy" for row in rows) == 6  # of seven in Table S3
assert sum(row["P and R say"] == "" for row in rows) == 3
by_one = [
    key for key, (row, T) in impossible.items()
    if any(abs(false - row.false_positives) == 1 for _, false in counts_behind(row, T))
]  # fmt: skip
assert len(by_one) == 6
assert not any(method.startswith("Ours") for table, method, _ in impossible if table != "Table 2")

# %% [markdown]
# Three rows explain themselves. SprottF has ten terms, so $R=90.91=10/11$ and $R=77.78=7/9$ cannot be its
# recall: the first is its precision written twice, the second comes with the precision of the NoseHoover
# row below, and nearly with its $\ell_2$: a row copied by mistake. In WangSun's E-SINDy, P counts fourteen
# true terms and R thirteen. In the other eight P and R go together and the count is off, in six of them by one.

# %%
weak = {name: SCORES["Table S3", "WeakSINDy", name] for name in ("SprottF", "NoseHoover")}
assert weak["SprottF"].precision == weak["NoseHoover"].precision
assert weak["SprottF"].recall == weak["NoseHoover"].recall == round(7 / 9, 4)
assert abs(weak["SprottF"].l2 - weak["NoseHoover"].l2) < 1.5e-4

wang = SCORES["Table S3", "E-SINDy", "WangSun"]
assert (wang.precision, wang.recall) == (round(14 / 17, 4), round(13 / 14, 4))


# %% [markdown]
# The row of the paper's own method for WangSun is a case for itself: one false positive and $P=93.33$ agree with one another, but
# not with Table S2, whose law has the fourteen true terms and no other. And the false positives that Table
# S2 does show are constants, as the paper says; "small" depends on the measure.

# %%
def coefficients_of(law, support):
    """Coefficients of a law at the terms of another one, by term: "dx/dt: yz"."""
    values = metrics.coefficients_in(law, support.exponents)
    return {
        f"d{support.names[j]}/dt: {support.terms[row]}": float(values[row, j])
        for j, row in np.argwhere(support.support.T)
    }


# %%
own = {name: score(LAWS["Ours", name], truths[name]) for name in SYSTEMS}
assert could_be(SCORES["Table 1", "Ours", "WangSun"], 14)
assert own["WangSun"].exact
assert np.isclose(own["Tsucs2"].max_coefficient_error, 0.37)  # 0.63 x for x in dy/dt
false = {}
for name, truth in truths.items():
    claimed, true = (coefficients_of(law, law) for law in (LAWS["Ours", name], truth))
    false[name] = {term: value for term, value in claimed.items() if term not in true}
false = {name: terms for name, terms in false.items() if terms}
for name, terms in false.items():
    print(name, terms)
    assert all(term.endswith(": 1") for term in terms)

# %%
note("Tables 1, 2, S3", "False positives, P and R", "three columns that exclude one another",
     f"{len(rows)} rows, {never} not even as averages of five",
     "for the baselines; one row of its own method: noise 20 %, off by a false positive")
note("Table S3", "SprottF, WeakSINDy", "P, R and l2 are NoseHoover's", "R = 7/9 of ten terms",
     "this row is lost")
note("Table 1", "WangSun, own method: one false positive", "Table S2 shows none",
     f"{own['WangSun'].false_positives} false, l2 {100 * own['WangSun'].l2:.2f} as in Table 1",
     "in the authors' favour")
note("Sec. 4.3", "false positives are all small constants", "constants indeed",
     ", ".join(f"{name} {value:g}" for name, terms in false.items() for value in terms.values()),
     "what leaves them is open: a misplaced origin could")  # fmt: skip

# %% [markdown]
# ## Two clocks: a factor of ten
#
# PySINDy's errors of 824 % (NoseHoover) and 856 % (WangSun) stand beside 3 to 12 % elsewhere. Divided by
# the true ones, its coefficients are nearly all about ten: a time step taken for a tenth of what it is
# multiplies every derivative, and so every coefficient, by ten. We give PySINDy exact trajectories of 400
# frames twice, once with the right times and once with times over ten.

# %%
ratios = {}
for name, law in (("NoseHoover", LAWS["PySINDy", "NoseHoover"]), ("WangSun", mended)):
    t, x = truths[name].trajectory(400)
    fits = {
        "Table S2": law,
        "here, time step / 10": baselines.stlsq(t / 10, x),
        "here, right time step": baselines.stlsq(t, x),
    }
    true = coefficients_of(truths[name], truths[name])
    ratios[name] = {
        key: {term: value / true[term] for term, value in coefficients_of(fit, truths[name]).items()}
        for key, fit in fits.items()
    }

# %% jupyter={"source_hidden": true} tags=["hide-input"]
counts = [len(series["Table S2"]) for series in ratios.values()]
fig, panels = plt.subplots(
    len(ratios), 1, figsize=(7.5, 0.23 * sum(counts) + 2), sharex=True, height_ratios=counts
)
for axes, (name, series), count in zip(panels, ratios.items(), counts, strict=True):
    heights = np.arange(count)[::-1]
    for value in (1, 10):
        axes.axvline(value, color="k", lw=0.8, ls=":")
    for (label, by_term), marker in zip(series.items(), "so^", strict=True):
        values = np.array(list(by_term.values()))
        axes.plot(np.where(values > 0, values, np.nan), heights, marker, mfc="none", label=label)
    axes.set(xscale="log", xlim=(0.4, 20), title=name, ylim=(-0.7, count - 0.3))
    axes.set_yticks(heights, list(by_term))
    axes.set_xticks((0.5, 1, 2, 5, 10, 20), ("0.5", "1", "2", "5", "10", "20"))
    axes.minorticks_off()
    axes.grid(axis="y", visible=False)
axes.set_xlabel("coefficient / true coefficient")
fig.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3)
caption = "PySINDy's coefficients over the true ones (no symbol: not found): printed with a wrong clock."
save_figure("audit_factor_ten", fig, caption=caption, numbers=ratios)

# %% [markdown]
# *PySINDy's coefficients over the true ones (dotted: 1 and 10; a term that was not found has no symbol).
# The printed ones (squares) go with a time step that is too small by a factor of ten (circles).*
#
# WangSun's dy/dt is a proof of its own. On a record of this length PySINDy loses the term $-0.5y$ here, too
# (on longer ones it does not), and the four that remain then make up for it as the printed ones do, 82.27
# among them, as the coefficient of z:

# %%
lost = {key: series["dy/dt: y"] for key, series in ratios["WangSun"].items()}
assert set(lost.values()) == {0.0}
for term in ("1", "x", "z", "xz"):
    printed, here = (ratios["WangSun"][key][f"dy/dt: {term}"] for key in list(lost)[:2])
    print(f"dy/dt: {term:2}  over the true one: {printed:.2f} in Table S2, {here:.2f} here")
    assert abs(here / printed - 1) < 0.02

# %%
medians = {name: np.median(list(series["Table S2"].values())) for name, series in ratios.items()}
tenth = {
    name: score(replace(law, coefficients=law.coefficients / 10), truths[name]).l2
    for name, law in (("NoseHoover", LAWS["PySINDy", "NoseHoover"]), ("WangSun", mended))
}
for name in medians:
    print(f"{name}: median ratio {medians[name]:.2f}; l2 of a tenth of the law {tenth[name]:.2%}")
    wrong_clock, right_clock = list(ratios[name].values())[1:]
    assert 9 < medians[name] < 11
    assert 9 < np.median(list(wrong_clock.values())) < 11
    assert 0.9 < np.median(list(right_clock.values())) < 1.1
    assert SCORES["Table 1", "Ours", name].l2 < tenth[name] < 0.08

# %% [markdown]
# E-SINDy's 824.44 and 863.42 carry the same factor; WeakSINDy's 12.71 and 9.56 and the paper's own method
# do not. So the slip is most likely in how two data sets were handed to PySINDy, not in the method and not in
# the data.

# %%
for name in ("NoseHoover", "WangSun"):
    assert SCORES["Table S3", "E-SINDy", name].l2 > 8
    assert SCORES["Table S3", "WeakSINDy", name].l2 < 0.2
note("Table 1, S2, S3", "PySINDy: 824.44 (NoseHoover), 856.47 (WangSun)",
     "nearly all coefficients ten times too large: the time step",
     f"median ratio {medians['NoseHoover']:.1f}, {medians['WangSun']:.1f}; "
     f"l2 {100 * tenth['NoseHoover']:.1f} and {100 * tenth['WangSun']:.1f} after division by ten",
     "yes: the baseline is worse, but not a hundred times")  # fmt: skip

# %% [markdown]
# ## E-SINDy equal to PySINDy
#
# E-SINDy fits resampled rows and takes the median, so its errors differ a little from PySINDy's. In Table S3,
# four rows of seven are those of PySINDy in Table 1 to every printed digit.

# %%
pairs = {n: (SCORES["Table 1", "PySINDy", n], SCORES["Table S3", "E-SINDy", n]) for n in SYSTEMS}
same = [name for name, (plain, bagged) in pairs.items() if plain == bagged]
print("equal in all columns:", same)
assert same == ["Lorenz", "RayleighBenard", "NoseHoover", "Tsucs2"]

# %% [markdown]
# Could it be chance? In NoseHoover five digits agree. On an exact trajectory resampling changes least; how far
# apart are the two there?

# %%
t, x = truths["NoseHoover"].trajectory(frames)
fits = baselines.stlsq(t, x), baselines.ensemble(t, x, seed=seed)
plain, bagged = (score(fit, truths["NoseHoover"]).l2 for fit in fits)
apart = abs(bagged / plain - 1)
digits = 0.5e-4 / SCORES["Table 1", "PySINDy", "NoseHoover"].l2
print(f"here {100 * plain:.3f} and {100 * bagged:.3f} (e-2), apart by {apart:.1e}")
print(f"in print apart by at most {2 * digits:.1e}")
assert apart > 20 * digits
note("Table S3", "E-SINDy beside PySINDy", "equal in every column for " + ", ".join(same),
     f"NoseHoover: {apart:.1e} apart here, at most {2 * digits:.0e} there",
     "these rows are no second baseline")  # fmt: skip


# %% [markdown]
# For the other three such an agreement may be luck; 824.44 twice is hardly. Rows copied, or an ensemble without
# resampling, would look like this.
#
# ## A ruler: the 6.22 % of NoseHoover
#
# The largest error of the paper's own method. PySINDy's law, divided by ten, has *the same*
# $1.10\,y$ in place of $y$, and nearly the same other coefficients. Two methods do not make the same error
# unless it is in their data. Let us ask in which coordinates $y_i=o_i+k_i x_i$ the true law would be
# printed so, perhaps by a clock of other units, too:

# %%
def seen_in(law, scale, offset, clock):
    """The law of y(t) = offset + scale x(clock t)."""
    powers = np.prod(scale**law.exponents, axis=1)[:, None]
    stretched = clock * law.coefficients * scale / powers
    return dynamics.PolynomialSystem(law.names, law.exponents, stretched).shift(offset)


# %% [markdown]
# Least squares over all coefficients, from the nominal shift:

# %% jupyter={"source_hidden": true} tags=["hide-input"]
def fit_coordinates(printed, native, free_clock=False):
    """Stretch, origin and clock that turn a true law into a printed one, and the l2 error that is left."""
    truth, d = native.shift(REFERENCE_OFFSET), native.d
    library = np.unique(np.concatenate([printed.exponents, truth.exponents]), axis=0)
    target, true = (metrics.coefficients_in(law, library) for law in (printed, truth))

    def coordinates(unknowns):
        scale, offset, clock = np.split(unknowns, [d, 2 * d])
        return np.exp(scale), offset, float(np.exp(clock.sum()))

    def misfit(unknowns):
        law = seen_in(native, *coordinates(unknowns))
        return ((metrics.coefficients_in(law, library) - target) / np.linalg.norm(true)).ravel()

    both = (true != 0) & (target / np.where(true, true, 1) > 0)
    clock = [np.log(np.median(target[both] / true[both]))] if free_clock else []
    fit = least_squares(misfit, [*np.zeros(d), *REFERENCE_OFFSET, *clock], xtol=1e-14, ftol=1e-14)
    found = coordinates(fit.x)
    parts = dict(zip(("scale", "offset", "clock"), found, strict=True))
    return SimpleNamespace(**parts, law=seen_in(native, *found), misfit=np.linalg.norm(fit.fun))


# %%
law = LAWS["Ours", "NoseHoover"]
fit = fit_coordinates(law, SYSTEMS["NoseHoover"])
reach = rounding_reach(law, truths["NoseHoover"])
print("stretch", fit.scale.round(3), "  origin", fit.offset.round(2) + 0.0)
print(f"misfit {fit.misfit:.1e}, rounding explains {reach:.1e}")
assert fit.misfit < reach

columns = {
    "true": truths["NoseHoover"], "Table S2": law, "true law, other coordinates": fit.law,
}  # fmt: skip
values = {key: coefficients_of(each, truths["NoseHoover"]) for key, each in columns.items()}
rows = [{"term": term} | {key: values[key][term] for key in values} for term in values["true"]]
gaps = [row["Table S2"] - row["true law, other coordinates"] for row in rows]
assert np.abs(gaps).max() <= 0.01 / 2
save_table("audit_nose_hoover", rows, caption="NoseHoover: the true law in coordinates of its own.")

# %% [markdown]
# All nine printed numbers, to the last digit, from six (three stretches, three origins): y is squeezed by 9 %
# and its origin is at 9.07 instead of 10, z is squeezed by 6 %. So the regression was right to all printed
# digits; the *coordinates* that it was given were not. PySINDy's law, with the clock left free, tells the same coordinates, and a clock
# of ten:

# %%
other = fit_coordinates(LAWS["PySINDy", "NoseHoover"], SYSTEMS["NoseHoover"], free_clock=True)
print("stretch", other.scale.round(3), "  origin", other.offset.round(2) + 0.0)
print(f"clock   {other.clock:.3f}")
assert abs(other.clock - 10) < 0.1
assert np.allclose(other.scale, fit.scale, atol=0.03)
assert np.allclose(other.offset, fit.offset, atol=0.1)

# %% [markdown]
# The same question for the other systems. Where the misfit falls below rounding, coordinates explain the
# printed law entirely; where it does not, but most of $\ell_2$ goes, they may only have absorbed the
# constants, which dominate $\ell_2$, so we claim nothing there.

# %%
rows = []
for name in SYSTEMS:
    law = LAWS["Ours", name]
    fitted = fit_coordinates(law, SYSTEMS[name])
    reach = rounding_reach(law, truths[name])
    rows.append({
        "system": name, "l2 (e-2)": 100 * own[name].l2,
        "l2 in its coordinates (e-2)": 100 * fitted.misfit, "rounding (e-2)": 100 * reach,
        "explained": "entirely" if fitted.misfit < reach else "open",
    })  # fmt: skip
explained = {row["system"] for row in rows if row["explained"] == "entirely"}
assert explained == {"SprottF", "NoseHoover", "WangSun"}
save_table("audit_coordinates", rows, caption="How much of l2 is left in stretched, shifted axes.")

# %% [markdown]
# This is what the paper itself suspects ("potential errors in learning such a relationship"). But it does not
# go with Fig. 2, where the discovered trajectories "nearly coincide" with the true ones, unless "true"
# means the reconstructed path:

# %%
native = SYSTEMS["NoseHoover"].trajectory(400)[1]
paths = {
    "truth": native + REFERENCE_OFFSET,
    "in the coordinates that the printed law implies": fit.offset + fit.scale * native,
}
fig = plots.plot_in_plane({label: path[:, 1:] for label, path in paths.items()}, "yz")
caption = "NoseHoover, true and in the coordinates of the printed law: they do not coincide."
save_figure("audit_nose_hoover_path", fig, caption=caption, numbers=paths)

# %% [markdown]
# *NoseHoover from the side: the truth (grey) and the motion that the printed law describes (blue), about one
# scene unit towards smaller y.*

# %%
truth, implied = paths.values()
away = np.linalg.norm(implied - truth) / np.linalg.norm(truth - truth.mean(axis=0))
print(f"distance of the two, over the standard deviation of the motion (rms): {away:.2f}")
assert away > 0.3
note("Table 1, S2", "NoseHoover, own method: 6.22", "the true law, in coordinates of its own",
     f"stretch of y {fit.scale[1]:.3f}, of z {fit.scale[2]:.3f}, y from {fit.offset[1]:.2f}; "
     f"l2 left: {100 * fit.misfit:.3f}",
     "in the authors' favour: cameras, not regression")
note("Fig. 2", "discovered and true paths nearly coincide", "not for NoseHoover's printed law",
     f"{away:.0%} of the standard deviation apart",
     "unless the reconstructed path is shown as true")  # fmt: skip

# %% [markdown]
# ## The audit

# %%
caption = "What does not add up in the paper's tables, recomputed, and what it means."
save_table("audit", findings, caption=caption)

# %% [markdown]
# ## What we learned
#
# * **The ranking stands.** The paper's method is ahead in every row of Table 1, also when the wrong time steps are put right.
#   <!-- by: row.l2 > SCORES[table, "Ours", name].l2; SCORES["Table 1", "Ours", name].l2 < tenth[name] < 0.08 -->
# * **The baselines deserve better.** Two errors of more than 800 % are a wrong time step, four rows of
#   E-SINDy repeat PySINDy, and most rows of WeakSINDy exclude themselves.
#   <!-- by: 9 < medians[name] < 11; same == [; row["method"] == "WeakSINDy"; figure audit_rows -->
# * **The paper's regression was better than its tables say.** For NoseHoover, SprottF and WangSun the
#   printed law is the true one in slightly wrong coordinates, to the last digit; what limits them is the
#   reconstruction.
#   <!-- by: explained == {"SprottF; fit.misfit < reach -->
#
# **What the paper says and what we found.** The table above is the answer; our own numbers for the same
# tables are in [notebook 05](05_discovery.ipynb).
# <!-- by: explained == {"SprottF; figure audit; figure audit_coordinates; figure table_1 -->
#
# ## Exercises
#
# [Three exercises](exercises/10b_paper_tables.ipynb), each with a blank cell and a check that says *right* or fails. Their
# [solutions](solutions/10b_paper_tables.ipynb) lie apart.
#
# ## Run time and versions
#
# All cells take about 10 seconds on two cores, beside two other notebooks.

# %%
print(versions())
