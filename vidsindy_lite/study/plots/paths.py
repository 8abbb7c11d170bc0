"""Figures of motions over time and in space, and of the laws behind them."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from ...arrays import Floats
from ...dynamics import Discovery, PolynomialSystem
from .common import SPACE, STYLES, finish_space


def plot_sampling(t: Floats, x: Floats, samples: Mapping[str, tuple[Floats, Floats]]) -> Figure:
    """One coordinate over time, and the frames that a camera takes of it.

    Parameters
    ----------
    t, x : ndarray, shape (n,)
        The motion, finely resolved: time units and scene units.
    samples : dict of str to pair of ndarray
        Times and values of the frames, by what the frame rate is.
    """
    figure, panels = plt.subplots(len(samples), 1, figsize=(8, 4.2), sharex=True, sharey=True)
    for axes, (name, (times, values)) in zip(panels, samples.items(), strict=True):
        axes.plot(t, x, color="0.7", lw=1.5)
        axes.plot(times, values, "oC0", ms=3)
        axes.set_title(name)
        axes.set_ylabel("x (scene units)")
    panels[-1].set_xlabel("time (time units)")
    return figure


def plot_divergence(periods: Floats, differences: Mapping[str, Floats]) -> Figure:
    """How two solutions of the same equations drift apart, in several systems.

    Parameters
    ----------
    periods : ndarray, shape (n,)
        Time in characteristic periods.
    differences : dict of str to ndarray, shape (n,)
        Distance over the spread of the motion, by system; at most seven.
    """
    figure, axes = plt.subplots(figsize=(8, 4.2))
    for (name, difference), style in zip(differences.items(), STYLES, strict=False):
        axes.semilogy(periods, np.maximum(difference, 1e-14), ls=style, label=name)
    axes.set(xlabel="time (characteristic periods)", ylabel="distance / spread of the motion")
    figure.legend(loc="outside right center")
    return figure


def plot_in_plane(curves: Mapping[str, Floats], names: Sequence[str]) -> Figure:
    """Curves in a plane, several to compare.

    Parameters
    ----------
    curves : dict of str to ndarray, shape (n, 2)
        By label, scene units; the first is drawn as a broad line.
    names : sequence of str
        Names of the two coordinates: to the right and upwards.
    """
    tall = np.ptp(np.vstack(list(curves.values())), axis=0) @ (-1, 1) > 0
    figure, axes = plt.subplots(figsize=(8, 4.2) if tall else (7, 4.8))
    for index, (label, curve) in enumerate(curves.items()):
        style = {"lw": 1.2, "color": f"C{index - 1}"} if index else {"lw": 5, "color": "0.8"}
        axes.plot(*curve.T, label=label, **style)
    right, up = (f"{name} (scene units)" for name in names)
    axes.set(xlabel=right, ylabel=up, aspect="equal")
    figure.legend(loc="outside right center" if tall else "outside upper center")
    return figure


def plot_gaps(t: Floats, x: Floats, truth: Floats) -> Figure:
    """A trajectory with missing stretches, shaded over time and left out in space (Fig. S3).

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time units.
    x : ndarray, shape (n, 3)
        Reconstructed positions, scene units; NaN where missing.
    truth : ndarray, shape (n, 3)
    """
    curves = {
        "truth": (truth, {"color": "0.4", "ls": "--", "lw": 0.8}),
        "reconstructed": (x, {"color": "C0", "lw": 1.4}),
    }
    return _over_time_and_in_space(t, curves, "hidden", "time units")


def plot_path(t: Floats, x: Floats, curve: Floats) -> Figure:
    """A reconstructed path and the curve that obeys the law, over time and in space.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time units.
    x : ndarray, shape (n, 3) or (n, 2)
        Reconstructed positions, scene units; NaN where missing.
    curve : ndarray, shape (n, 3) or (n, 2)
        The fitted curve; NaN outside its stretches.
    """
    curves = {
        "reconstructed": (x, {"color": "0.75", "lw": 4}),
        "curve that obeys the law": (curve, {"color": "C0", "lw": 1}),
    }
    return _over_time_and_in_space(t, curves, "not seen", "units of the equations")


def plot_forecast(t: Floats, truth: Floats, told: Floats) -> Figure:
    """A true motion and what a law foretells of it, over time and in space.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time units.
    truth, told : ndarray, shape (n, 3)
        Positions, scene units.
    """
    curves = {
        "true motion": (truth, {"color": "0.75", "lw": 4}),
        "foretold by the law": (told, {"color": "C0", "lw": 1}),
    }
    return _over_time_and_in_space(t, curves, "", "units of the equations")


def plot_attractors(curves: Mapping[str, tuple[Floats, Floats]]) -> Figure:
    """True motions and those of the discovered laws, one panel a system (Fig. 2).

    Parameters
    ----------
    curves : dict of str to pair of ndarray, shape (n, 3)
        True and simulated states by system, scene units.
    """
    columns = min(len(curves), 4)
    rows = -(-len(curves) // columns)
    size = (3.1 * columns, 3.3 * rows + 0.5) if columns > 1 else (6.5, 5)
    figure, grid = plt.subplots(rows, columns, figsize=size, squeeze=False, subplot_kw=SPACE)
    for axes, (name, (truth, found)) in zip(grid.flat, curves.items(), strict=False):
        axes.plot(*truth.T, color="0.75", lw=3, label="truth")
        axes.plot(*found.T, color="C0", lw=0.8, label="discovered law")
        axes.set_title(name, loc="center")
        finish_space(axes, azimuth=-60, elevation=20, zoom=0.9)
        if columns > 1:  # small panels: cubes with few numbers, and the unit goes to the legend
            axes.set_box_aspect((1, 1, 1), zoom=0.9)
            axes.locator_params(nbins=4, integer=True)
            axes.tick_params(labelsize=8, pad=-2)
            for letter in "xyz":
                axes.set(**{f"{letter}label": letter})
                getattr(axes, f"{letter}axis").labelpad = -4
    for axes in grid.flat[len(curves) :]:
        axes.remove()
    unit = "x, y, z in scene units" if columns > 1 else None
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2, title=unit)
    return figure


def plot_coefficients(found: Discovery, truth: PolynomialSystem) -> Figure:
    """How far each coefficient is from the truth, with its standard error.

    Parameters
    ----------
    found : Discovery
    truth : PolynomialSystem
        In the frame of the data.
    """
    equations, rows = np.nonzero(truth.support.T)
    terms = [truth.terms[row] for row in rows]
    labels = [f"{term} in d{truth.names[j]}/dt" for term, j in zip(terms, equations, strict=True)]
    place = [found.terms.index(term) for term in terms], equations
    true, errors = truth.coefficients[rows, equations], found.standard_errors[place]
    figure, axes = plt.subplots(figsize=(7.5, 0.32 * len(labels) + 1.2))
    heights = -np.arange(len(labels))
    axes.axvline(0, color="k", lw=0.8)
    scale = 1e6 / np.abs(true)
    difference = found.coefficients[place] - true
    axes.errorbar(difference * scale, heights, xerr=errors * scale, fmt="o")
    axes.set_yticks(heights, labels)
    axes.set_xlabel("distance from the truth (millionths of the true coefficient)")
    axes.grid(axis="y", visible=False)
    return figure


def _over_time_and_in_space(
    t: Floats, curves: Mapping[str, tuple[Floats, dict[str, Any]]], word: str, unit: str
) -> Figure:
    """Curves over time and in space, by label, with their style.

    Shaded, and called by ``word``, where what was reconstructed is missing.
    """
    measured = curves.get("reconstructed")
    missing = np.isnan(measured[0]).any(axis=1) if measured else np.zeros(len(t), dtype=bool)
    figure = plt.figure(figsize=(10.5, 4.7))
    names = "xyz"[: next(iter(curves.values()))[0].shape[1]]
    panels = figure.subplot_mosaic(
        [[name, "space"] for name in names], width_ratios=(1.1, 1),
        per_subplot_kw={"space": SPACE if len(names) == 3 else {"aspect": "equal"}},
    )  # fmt: skip
    space = panels["space"]
    for i, name in enumerate(names):
        axes = panels[name]
        axes.fill_between(
            t, 0, 1, where=missing, color="0.85", step="mid", transform=axes.get_xaxis_transform()
        )
        for curve, style in curves.values():
            axes.plot(t, curve[:, i], **style)
        axes.set_ylabel(name)
        axes.label_outer()
    panels[names[-1]].set_xlabel(f"time ({unit}); {', '.join(names)} in scene units")
    for label, (curve, style) in curves.items():
        space.plot(*curve.T, label=label, **style)
    if word:
        space.plot([], [], color="0.85", lw=8, label=word)
    if len(names) == 3:
        finish_space(space, azimuth=-60, elevation=25, zoom=0.85)
    figure.legend(*space.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure
