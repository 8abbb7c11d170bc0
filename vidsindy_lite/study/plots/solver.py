"""Figures of the solver: curve, matrix, selection, origin, error bars."""

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ...arrays import Bools, Floats

Pair = tuple[Floats, Floats]

_WHITE = {"facecolor": "white", "edgecolor": "none", "pad": 2}  # behind words that lie on lines


# ------------------------------------------------------------------------- the curve and its matrix


def plot_basis(t: Floats, basis: Floats, point: float, breakpoints: Floats) -> Figure:
    """B-spline basis functions, those that are not zero at one time, and their sum.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time units.
    basis : ndarray, shape (n, r)
        One basis function a column.
    point : float
        The time at which the functions that matter are picked out.
    breakpoints : ndarray
        Ends of the knot spans.
    """
    figure, axes = plt.subplots(figsize=(6.4, 2.6))
    here = basis[np.abs(t - point).argmin()] > 0
    shown = np.where(basis > 0, basis, np.nan)
    axes.plot(t, shown[:, ~here], color="0.75", lw=1.2)
    axes.plot(t, shown[:, here], lw=2.2)
    axes.plot(t, basis.sum(axis=1), "k--", label="sum of all")
    axes.plot([], [], color="0.75", lw=1.2, label="zero at the dotted line")
    axes.axvline(point, color="k", ls=":")
    axes.plot(breakpoints, np.zeros_like(breakpoints), "|k", ms=12, label="knots")
    axes.set(xlabel="time (time units)", ylabel="basis function")
    figure.legend(loc="outside upper center", ncols=3)
    return figure


def plot_normal_matrix(matrix: Floats, curve: int, coefficients: int) -> Figure:
    """Where the normal matrix of curve, coefficients and offset is not zero.

    Parameters
    ----------
    matrix : ndarray, shape (m, m)
    curve, coefficients : int
        How many unknowns of each come first; what follows is the offset.
    """
    figure, axes = plt.subplots(figsize=(6.6, 5.4))
    kind = np.ones(matrix.shape)
    kind[curve:], kind[:, curve:] = 2, 2
    kind[curve:, curve:] = 3
    shown = np.where(matrix != 0, kind, 0)
    colours = ("white", "C0", "C4", "C1")
    axes.imshow(shown, cmap=ListedColormap(colours), vmin=0, vmax=3, interpolation="nearest")
    edges = np.array([0, curve, curve + coefficients, len(matrix)]) - 0.5
    for edge in edges[1:-1]:
        axes.axhline(edge, color="k", lw=0.8)
        axes.axvline(edge, color="k", lw=0.8)
    names = ("control\npoints P", r"$\Lambda$", r"$\Delta$")
    axes.set_xticks((edges[1:] + edges[:-1]) / 2, names)
    axes.set_yticks((edges[1:] + edges[:-1]) / 2, names)
    axes.tick_params(length=0)
    axes.grid(False)
    axes.spines[:].set_visible(True)
    labels = ("curve: banded", "border: dense", "law: small")
    handles = [Patch(color=c, label=text) for c, text in zip(colours[1:], labels, strict=True)]
    figure.legend(handles=handles, loc="outside right center")
    return figure


def plot_collocation(
    t: Floats, data: Floats, first: Pair, final: Pair, nodes: Pair, residual: Pair
) -> Figure:
    """A window of data and curves, and how well the law is met on the curve.

    Parameters
    ----------
    t, data : ndarray, shapes (n,) and (n,)
        Samples of one coordinate: time units and scene units.
    first, final : pair of ndarray
        Times and values of the smoothing spline and of the curve that obeys the law.
    nodes : pair of ndarray
        Collocation times and values of the final curve there.
    residual : pair of ndarray
        Times and residual of the law relative to the speed, finely resolved.
    """
    figure, (above, below) = plt.subplots(2, 1, figsize=(7, 4.4), sharex=True, height_ratios=(2, 1))
    above.plot(t, data, "o", color="0.55", ms=4, label="data")
    above.plot(*first, "C1--", lw=1.6, label="smoothing spline")
    above.plot(*final, "C0", lw=2, label="curve that obeys the law")
    above.plot(*nodes, "|k", ms=9, label="collocation nodes")
    above.set(ylabel="x (scene units)")
    above.locator_params(axis="y", integer=True)
    below.plot(*residual, "C0", lw=1.2)
    below.plot(nodes[0], np.zeros_like(nodes[0]), "|k", ms=9)
    below.set(ylabel="residual of the law\n/ speed", xlabel="time (time units)")
    below.ticklabel_format(axis="y", style="sci", scilimits=(0, 0), useMathText=True)
    figure.legend(*above.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def plot_asked(errors: Mapping[str, Mapping[float, float]]) -> Figure:
    """Error of a law against the residual it may leave, for several choices of times.

    Parameters
    ----------
    errors : dict of str to dict of float to float
        l2 error of the coefficients by tolerated residual (over the speed), by choice of times.
    """
    figure, axes = plt.subplots(figsize=(7, 3.8))
    for (label, row), style in zip(errors.items(), ("o-", "s--", "^--", "v:", "D:"), strict=False):
        axes.plot(list(row), list(row.values()), style, label=label)
    axes.set(xscale="log", yscale="log", ylabel="l2 error of the law")
    axes.set_xlabel("tolerated residual of the law / speed (physics weight grows to the right)")
    axes.invert_xaxis()
    figure.legend(loc="outside upper center", ncols=3)
    return figure


# ------------------------------------------------------------------------------------ optimisation


def plot_histories(
    histories: Mapping[str, Mapping[str, Sequence[float]]], true_terms: Mapping[str, int]
) -> Figure:
    """Data loss, physics loss and number of terms over wall time, several optimisers.

    Parameters
    ----------
    histories : dict of str to dict of str to sequence of float
        ``seconds``, ``data loss``, ``physics loss`` and ``terms`` by optimiser.
    true_terms : dict of str to int
        How many terms the law has, by frame.
    """
    figure, panels = plt.subplots(3, 1, figsize=(7, 6), sharex=True)
    labels = {
        "data loss": "data loss\n/ noise variance",
        "physics loss": "physics loss\n/ mean square speed",
        "terms": "number of terms",
    }
    for axes, (key, label) in zip(panels, labels.items(), strict=True):
        for (name, history), style in zip(histories.items(), ("s-C1", "o-C0"), strict=True):
            axes.plot(history["seconds"], history[key], style, ms=4, lw=1.2, label=name)
        axes.set(xscale="log", yscale="log", ylabel=label)
    panels[0].axhline(1, color="k", lw=0.8, ls=":")
    ticks = [60, 30, *true_terms.values()]
    for frame, terms in true_terms.items():
        panels[2].axhline(terms, color="k", lw=0.8, ls=":")
        panels[2].annotate(
            f"truth,\n{frame}", (1.01, terms), xycoords=("axes fraction", "data"), fontsize=9,
            ha="left", va="center",
        )  # fmt: skip
    panels[2].set_yticks(ticks, [str(tick) for tick in ticks])
    panels[2].minorticks_off()
    panels[2].set(xlabel="wall time (s)", ylim=(0.7 * min(ticks), None))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


# ---------------------------------------------------------------------------------------- selection


def plot_ranks(panels: Mapping[str, tuple[Floats, float | None]], true: Bools) -> Figure:
    """Terms in order of size, the true ones marked, one panel for each measure of size.

    Parameters
    ----------
    panels : dict of str to tuple (values, threshold)
        Sizes of all terms, (m,), NaN or zero for one that is not in the law, and a level to draw
        or None; by what is measured.
    true : ndarray of bool, shape (m,)
    """
    figure, grid = plt.subplots(1, len(panels), figsize=(3.1 * len(panels), 3.5))
    scored = [axes for axes, (_, level) in zip(grid, panels.values(), strict=True) if level]
    for axes in scored[1:]:
        axes.sharey(scored[0])
    for axes, (name, (values, threshold)) in zip(grid, panels.items(), strict=True):
        kept = np.flatnonzero(values > 0)
        order = kept[np.argsort(-values[kept])]
        rank, size, hit = np.arange(1, len(order) + 1), values[order], true[order]
        axes.plot(rank[hit], size[hit], "oC0", ms=7, label="true term")
        axes.plot(rank[~hit], size[~hit], "xC1", ms=7, mew=2, label="false term")
        if threshold is not None:
            axes.axhline(threshold, color="k", ls="--", lw=1, label="penalty of a linear term")
        axes.set(yscale="log", xlabel="rank", title=name, xlim=(0, len(values) + 1))
    figure.legend(*scored[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def plot_windows(thresholds: Floats, exact: Mapping[str, Bools]) -> Figure:
    """Which magnitude thresholds leave exactly the true terms, system by system.

    Parameters
    ----------
    thresholds : ndarray, shape (k,)
    exact : dict of str to ndarray of bool, shape (k,)
        By system.
    """
    figure, axes = plt.subplots(figsize=(8, 0.42 * len(exact) + 1.6))
    for row, good in enumerate(exact.values()):
        axes.axhline(-row, color="0.85", lw=1)
        axes.plot(thresholds, np.where(good, -row, np.nan), "s-C0", ms=5)
        if not good.any():
            at = {"xy": (0.5, -row), "xycoords": ("axes fraction", "data")}
            axes.annotate("no threshold", **at, ha="center", va="center", color="C1", bbox=_WHITE)
    axes.set_yticks(-np.arange(len(exact)), exact)
    axes.set(xscale="log", xlim=(thresholds[0], thresholds[-1]), ylim=(-len(exact) + 0.4, 0.6))
    axes.set_xlabel("threshold (units of the coefficients)")
    axes.grid(axis="y", visible=False)
    return figure


def plot_price(chances: Floats, false: Floats, lost: Floats, chosen: float) -> Figure:
    """Wrong terms of a law against the price of a term.

    Parameters
    ----------
    chances : ndarray, shape (k,)
        Chance of a false alarm: the larger, the cheaper is a term.
    false, lost : ndarray, shape (k,)
        Terms of a law, means.
    chosen : float
        The chance that the solver takes.
    """
    figure, axes = plt.subplots(figsize=(7, 3.6))
    axes.plot(chances, false + lost, "o-C0", label="wrong")
    axes.plot(chances, lost, "s--C2", label="lost")
    axes.plot(chances, false, "^:C1", label="false")
    axes.axvline(chosen, color="0.5", lw=1)
    at = {"xy": (chosen, 0.02), "xycoords": ("data", "axes fraction")}
    axes.annotate(" the solver's", **at, ha="left", va="bottom", color="0.4")
    most = 1.25 * float((false + lost).max())  # the legend has the room above the curves
    axes.set(xscale="log", ylim=(0, most), xlabel="chance of a false term", ylabel="terms per law")
    axes.legend(loc="upper left", ncols=3)
    return figure


def plot_origin_map(
    x_axis: Floats,
    y_axis: Floats,
    count: Floats,
    data: Floats,
    best: Sequence[float],
    truth: Sequence[float],
) -> Figure:
    """Smoothed number of significant terms against the origin of the law's frame.

    Parameters
    ----------
    x_axis, y_axis : ndarray, shapes (p,) and (q,)
        Coordinates of the origin, scene units.
    count : ndarray, shape (q, p)
    data : ndarray, shape (n, 2)
        The motion.
    best, truth : array_like, shape (2,)
        Origin with the smallest count, and the true one.
    """
    figure, axes = plt.subplots(figsize=(6.2, 4.8), layout="compressed")
    whole = np.arange(np.floor(count.min()), np.ceil(count.max()) + 1)
    shown = axes.contourf(x_axis, y_axis, count, levels=whole)
    figure.colorbar(shown, ax=axes, label="smoothed number of significant terms")
    axes.plot(*data.T, color="white", lw=0.5, label="data")
    axes.plot(*truth, "o", ms=15, mfc="none", mec="C1", mew=2, label="true origin")
    axes.plot(*best, "+", color="C1", ms=12, mew=2, label="fewest terms")
    axes.set(xlim=(x_axis[0], x_axis[-1]), ylim=(y_axis[0], y_axis[-1]), aspect="equal")
    axes.set(xlabel="x of the origin (scene units)", ylabel="y of the origin (scene units)")
    axes.grid(False)
    dark = {"frameon": True, "facecolor": "0.25", "edgecolor": "none", "labelcolor": "white"}
    axes.legend(loc="lower right", **dark)
    return figure


# ----------------------------------------------------------------------------- error bars, failures


def plot_errors_and_bound(labels: Sequence[str], deviations: Floats, errors: Floats) -> Figure:
    """Estimates of repeated trials with error bars, in units of the Cramer-Rao bound.

    Parameters
    ----------
    labels : sequence of str, length k
        What is estimated.
    deviations : ndarray, shape (trials, k)
        (estimate - truth) / bound.
    errors : ndarray, shape (trials, k)
        Standard errors / bound.
    """
    figure, axes = plt.subplots(figsize=(8.5, 3.7))
    axes.axhspan(-2, 2, color="0.9", label="truth ± 2 Cramér-Rao bounds")
    axes.axhline(0, color="k", lw=0.8)
    spread = np.linspace(-0.36, 0.36, len(deviations) + 2)[1:-1]
    place = spread[:, None] + np.arange(len(labels))
    near = np.abs(deviations) <= 1.96 * errors
    styles = {"95 % interval holds the truth": (near, "oC0"), "does not": (~near, "sC1")}
    for label, (inside, style) in styles.items():
        bars = place[inside], deviations[inside], 1.96 * errors[inside]
        axes.errorbar(*bars, fmt=style, ms=3.5, lw=0.9, capsize=0, label=label)
    axes.set_xticks(range(len(labels)), labels, rotation=25, ha="right")
    axes.set_ylabel("(estimate - truth) / bound")
    axes.grid(axis="x", visible=False)
    figure.legend(loc="outside upper center", ncols=3)
    return figure
