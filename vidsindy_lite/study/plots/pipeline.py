"""Figures of the notebooks, one function each.

Every function takes what is plotted and returns a matplotlib Figure. The look is that of
``vidsindy.mplstyle``; colours are its cycle, C0 to C6.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patheffects import withStroke

_STYLES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (7, 2)), (0, (1, 1)))

# -------------------------------------------------------------------------- view planes and cameras


def plot_view_plane(camera, x):
    """A curve in space, its projection on one view plane, and the plane's axes (Fig. S1).

    Parameters
    ----------
    camera : Camera
        Calibrated.
    x : ndarray, shape (n, 3)
        Curve, scene units.
    """
    figure, axes = _space((7.5, 5.2))
    flat = _on_plane(camera, camera.project(x))
    axes.plot(*x.T, lw=1, label="3D trajectory")
    axes.plot(*flat.T, lw=1, label="its projection on the view plane")
    for start, end in zip(x[:: len(x) // 12], flat[:: len(x) // 12], strict=True):
        axes.plot(*np.transpose([start, end]), color="0.6", lw=0.6, ls=":")
    _draw_plane(axes, camera, "C1")
    axes.scatter(*camera.position, color="k", s=15)
    halo = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}
    reach = 180 * camera.scale
    for axis, name in zip((*camera.rows, camera.normal), ("X'", "Y'", "Z'"), strict=True):
        axes.quiver(*camera.position, *(reach * axis), color="k", lw=1.2, arrow_length_ratio=0.15)
        axes.text(
            *(camera.position + 1.2 * reach * axis), name, ha="center", va="center", bbox=halo
        )
    axes.text(*(camera.position - 0.35 * reach * camera.rows[1]), "$C_1$", ha="center", bbox=halo)
    _finish(axes, azimuth=-40, elevation=8)
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def plot_rotation_accuracy(tilt, errors):
    """Error |R n - e_z| of several ways to compute R, for normals near the z axis.

    Parameters
    ----------
    tilt : ndarray, shape (n,)
        Angle between normal and e_z, rad.
    errors : dict of str to ndarray, shape (n,)
    """
    figure, axes = plt.subplots()
    for (name, error), marker in zip(errors.items(), "osv^", strict=False):
        axes.loglog(tilt, np.maximum(error, 1e-17), marker, label=name)
    axes.set(xlabel="angle between normal and z axis (rad)", ylabel=r"$\|R\,n - e_z\|$")
    axes.legend()
    return figure


def plot_independence(d, turned):
    """The three coordinates of R x_p as the plane moves along its normal, one panel per R.

    Parameters
    ----------
    d : ndarray, shape (n,)
        Constant of the plane's equation, scene units.
    turned : dict of str to ndarray, shape (n, 3)
        R x_p for each d, by the name of the rotation.
    """
    figure, panels = plt.subplots(1, len(turned), figsize=(9, 3.6), sharey=True)
    names = ("$x_{rp}$", "$y_{rp}$", "$z_{rp}$")
    for axes, (title, values) in zip(panels, turned.items(), strict=True):
        for value, name, style in zip(values.T, names, ("-", "--", ":"), strict=True):
            axes.plot(d, value, style, label=name)
        axes.set(title=title, xlabel="D (scene units)")
    panels[0].set_ylabel("coordinate (scene units)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center")
    return figure


def plot_in_plane(curves):
    """Curves in a view plane, several to compare.

    Parameters
    ----------
    curves : dict of str to ndarray, shape (n, 2)
        In-plane coordinates by name, the first drawn as a broad line.
    """
    figure, axes = plt.subplots(figsize=(7, 4.8))
    broad = {"lw": 5, "color": "0.8"}
    for index, (name, curve) in enumerate(curves.items()):
        style = broad if index == 0 else {"lw": 1.2, "color": f"C{index - 1}"}
        axes.plot(*curve.T, label=name, **style)
    axes.set(xlabel="X' (scene units)", ylabel="Y' (scene units)", aspect="equal")
    figure.legend(loc="outside upper center")
    return figure


def plot_rig(rig, x):
    """The cameras of a rig around a trajectory, each with its image in its view plane.

    Parameters
    ----------
    rig : Rig
        Calibrated.
    x : ndarray, shape (n, 3)
        Trajectory, scene units.
    """
    figure, axes = _space((7.5, 5.5))
    axes.plot(*x.T, color="k", lw=0.8)
    for i, camera in enumerate(rig.cameras):
        seen = _on_plane(camera, camera.project(x))
        axes.plot(*seen.T, color=f"C{i}", lw=0.8, label=f"camera {i + 1}")
        _draw_plane(axes, camera, f"C{i}")
    _finish(axes, azimuth=-40, elevation=22)
    figure.legend(loc="outside upper center", ncols=len(rig.cameras))
    return figure


def plot_tracks(tracks, rig):
    """The pixel track of each camera in the frame of its image.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2)
    rig : Rig
    """
    figure, panels = plt.subplots(1, len(tracks), figsize=(3.2 * len(tracks), 3.6))
    for i, (axes, track, camera) in enumerate(zip(panels, tracks, rig.cameras, strict=True)):
        width, height = camera.image_size
        axes.plot(*track.T, color=f"C{i}", lw=0.8)
        axes.set(title=f"camera {i + 1}", xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
        axes.set(aspect="equal", xlabel="u (px)", xticks=(0, width // 2, width))
        axes.set(yticks=(0, height // 2, height))
        axes.spines[["top", "right"]].set_visible(True)
    panels[0].set_ylabel("v (px)")
    return figure


def plot_calibration_errors(errors):
    """Errors of scale and angle in repeated trials, one panel per learned camera.

    Parameters
    ----------
    errors : dict of str to ndarray, shape (trials, cameras, 2)
        As of `calibration_errors`, by method; learned cameras only.
    """
    cameras = next(iter(errors.values())).shape[1]
    figure, panels = plt.subplots(1, cameras, figsize=(9, 4.2), sharex=True, sharey=True)
    for i, axes in enumerate(panels):
        axes.axhline(0, color="k", lw=0.6)
        axes.axvline(0, color="k", lw=0.6)
        for (name, error), marker in zip(errors.items(), "sov", strict=False):
            scale, angle = error[:, i].T
            axes.plot(100 * scale, 1e3 * angle, marker, ms=4, alpha=0.7, mec="none", label=name)
        axes.set(title=f"camera {i + 2}", xlabel="error of scale (%)")
    panels[0].set_ylabel("error of angle (mrad)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def plot_scale_error(noise, errors):
    """Spread and bias of the learned scales as the pixel noise grows.

    Parameters
    ----------
    noise : ndarray, shape (k,)
        Standard deviation, px.
    errors : dict of str to ndarray, shape (k, trials)
        Relative errors of the scale, by method.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.8))
    for (name, error), marker in zip(errors.items(), "sov", strict=False):
        left.loglog(noise, 100 * np.sqrt(np.mean(error**2, axis=1)), f"{marker}-", label=name)
        spread = error.std(axis=1) / np.sqrt(error.shape[1])
        mean = 100 * error.mean(axis=1)
        right.errorbar(noise, mean, 200 * spread, fmt=f"{marker}-", label=name)
    right.axhline(0, color="k", lw=0.6)
    left.set(title="rms error", ylabel="rms error of scale (%)")
    right.set(title="bias", ylabel="mean error of scale (%)", xscale="log")
    for axes in (left, right):
        axes.set_xlabel("noise per pixel coordinate (px)")
        axes.set_xticks(noise, [f"{value:g}" for value in noise])
        axes.minorticks_off()
    right.legend(loc="lower left")
    return figure


def plot_reconstruction(t, truth, found, pixel):
    """Reconstructed and true coordinates over time, and their difference in pixels.

    Parameters
    ----------
    t : ndarray, shape (n,)
    truth, found : ndarray, shape (n, 3)
        Scene units.
    pixel : float
        Scene units per pixel.
    """
    figure, (above, below) = plt.subplots(2, 1, figsize=(8, 5.5), sharex=True)
    for i, (name, style) in enumerate(zip("xyz", "ov^", strict=True)):
        above.plot(t, truth[:, i], color="0.7", lw=4)
        above.plot(t, found[:, i], f"C{i}", lw=1, label=name)
        below.plot(t, (found - truth)[:, i] / pixel, f"C{i}{style}", ms=2)
    above.set(ylabel="coordinate (scene units)")
    below.set(ylabel="error (px)", xlabel="time (time units)")
    figure.legend(loc="outside upper center", ncols=3)
    return figure


# ------------------------------------------------------------------------------ videos and tracking


def plot_frames(images, titles, tracks=None, index=0, columns=3):
    """Video frames side by side, with the tracks over them and the target magnified.

    Parameters
    ----------
    images : sequence of ndarray, shape (height, width, 3), uint8
        Blue-green-red, as a video reader gives them.
    titles : sequence of str
    tracks : sequence of ndarray, shape (n, 2), optional
        Pixels of the target in all frames of each video.
    index : int or sequence of int
        Frame number of the images: where the target is on its track, if it is seen there.
    columns : int
    """
    indices = np.broadcast_to(index, len(images))
    rows = -(-len(images) // columns)
    size = (2.7 * columns + 0.6, 3.0 * rows + 0.5)
    shared = {"sharex": True, "sharey": True, "squeeze": False}
    figure, grid = plt.subplots(rows, columns, figsize=size, layout="compressed", **shared)
    for k, (axes, image, title) in enumerate(zip(grid.flat, images, titles, strict=True)):
        height, width = image.shape[:2]
        _show(axes, image)
        axes.set_title(title, fontsize=11)
        axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
        axes.set(xticks=(0, 200, 400), yticks=(0, 200, 400))
        if tracks is not None:
            halo = withStroke(linewidth=2.4, foreground="white")
            axes.plot(*tracks[k].T, color="C0", lw=1.0, path_effects=[halo])
            if np.isfinite(tracks[k][indices[k]]).all():
                _magnify(axes, image, tracks[k], indices[k])
    for axes in grid[-1]:
        axes.set_xlabel("u (px)")
    for axes in grid[:, 0]:
        axes.set_ylabel("v (px)")
    return figure


def plot_tracker_steps(frame, background, coverage, corner, centroid):
    """How one position comes about: frame, background, difference, coverage with its centroid.

    Parameters
    ----------
    frame, background : ndarray, shape (h, w, 3)
        The part of the image around the target, blue-green-red, 0 to 255.
    coverage : ndarray, shape (h, w)
        Share of each pixel that the target covers.
    corner : array_like of int, shape (2,)
        Column and row of the first pixel in the whole image.
    centroid : array_like, shape (2,)
        Pixels in the whole image.
    """
    figure, panels = plt.subplots(1, 4, figsize=(10.5, 3.2), sharex=True, sharey=True)
    (left, top), (height, width) = corner, coverage.shape
    extent = (left - 0.5, left + width - 0.5, top + height - 0.5, top - 0.5)
    _show(panels[0], frame, extent=extent)
    _show(panels[1], background, extent=extent)
    distance = np.linalg.norm(frame.astype(float) - background, axis=-1)
    for axes, values in ((panels[2], distance), (panels[3], coverage)):
        shown = axes.imshow(values, extent=extent, cmap="gray", interpolation="nearest", vmin=0)
        axes.grid(False)
        figure.colorbar(shown, ax=axes, shrink=0.72, pad=0.03)
    for axes, title in zip(panels, ("frame", "background", "difference", "coverage"), strict=True):
        axes.set_title(title)
    panels[3].plot(*centroid, "+", color="C1", ms=16, mew=2)
    for axes in panels:
        axes.set_xlabel("u (px)")
    panels[0].set_ylabel("v (px)")
    return figure


def plot_sampling(t, x, samples):
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


def plot_divergence(periods, differences):
    """How two solutions of the same equations drift apart, in several systems.

    Parameters
    ----------
    periods : ndarray, shape (n,)
        Time in characteristic periods.
    differences : dict of str to ndarray, shape (n,)
        Distance over the spread of the motion, by system; at most seven.
    """
    figure, axes = plt.subplots(figsize=(8, 4.2))
    for (name, difference), style in zip(differences.items(), _STYLES, strict=False):
        axes.semilogy(periods, np.maximum(difference, 1e-14), ls=style, label=name)
    axes.set(xlabel="time (characteristic periods)", ylabel="distance / spread of the motion")
    figure.legend(loc="outside right center")
    return figure


def plot_track_errors(errors):
    """Distribution of the distance between tracked and true positions.

    Parameters
    ----------
    errors : dict of str to ndarray, shape (n,)
        Pixels, by the kind of video; NaN (not seen) is left out.
    """
    figure, axes = plt.subplots(figsize=(7.5, 4))
    for (name, error), style in zip(errors.items(), _STYLES, strict=False):
        axes.ecdf(error[np.isfinite(error)], ls=style, label=name)
    axes.set(xscale="log", xlabel="distance from the truth (px)", ylabel="share of frames below")
    axes.legend(loc="upper left")
    return figure


def plot_loss(loss, steps):
    """The loss of a training over its steps.

    Parameters
    ----------
    loss : sequence of float
        Means over blocks of steps.
    steps : int
        Length of a block.
    """
    figure, axes = plt.subplots()
    axes.plot(steps * (np.arange(len(loss)) + 1), loss)
    axes.set(xlabel="step", ylabel="loss", ylim=(0, None))
    return figure


def plot_gaps(t, x, truth):
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
    return _over_time_and_in_space(t, curves, np.isnan(x).any(axis=1), "hidden", "time units")


def plot_confidence(visible, confidence):
    """How much of the target can be seen in each frame, and how sure the tracker is of it.

    Parameters
    ----------
    visible, confidence : sequence of ndarray, shape (n,)
        In [0, 1], by camera.
    """
    figure, panels = plt.subplots(len(visible), 1, figsize=(9, 4.6), sharex=True, sharey=True)
    for i, (axes, share, sure) in enumerate(zip(panels, visible, confidence, strict=True)):
        axes.fill_between(
            np.arange(len(share)), share, color="0.85", step="mid", label="visible share"
        )
        axes.plot(sure, color="C0", lw=1, label="confidence of the tracker")
        axes.set(ylabel=f"camera {i + 1}", ylim=(0, 1.05))
    panels[-1].set(xlabel="frame", xlim=(0, len(visible[0]) - 1))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


# ---------------------------------------------------------------------------------- discovered laws


def plot_attractors(curves, columns=4):
    """True motions and those of the discovered laws, one panel a system (Fig. 2).

    Parameters
    ----------
    curves : dict of str to pair of ndarray, shape (n, 3)
        True and simulated states by system, scene units.
    columns : int
    """
    columns = min(columns, len(curves))
    rows = -(-len(curves) // columns)
    size = (3.1 * columns, 3.3 * rows + 0.5) if columns > 1 else (6.5, 5)
    space = {"projection": "3d", "proj_type": "ortho"}
    figure, grid = plt.subplots(rows, columns, figsize=size, squeeze=False, subplot_kw=space)
    for axes, (name, (truth, found)) in zip(grid.flat, curves.items(), strict=False):
        axes.plot(*truth.T, color="0.75", lw=3, label="truth")
        axes.plot(*found.T, color="C0", lw=0.8, label="discovered law")
        axes.set_title(name, loc="center")
        _finish(axes, azimuth=-60, elevation=20, zoom=0.9)
        if columns > 1:  # small panels: cubes with few numbers, and the unit goes to the legend
            axes.set_box_aspect((1, 1, 1), zoom=0.9)
            axes.locator_params(nbins=4)
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


def plot_coefficients(found, truth):
    """How far each coefficient is from the truth, with its standard error.

    Parameters
    ----------
    found : Discovery
    truth : PolynomialSystem
        In the frame of the data.
    """
    labels, values, errors, true = [], [], [], []
    for equation, row in np.argwhere(truth.support.T):
        index = found.terms.index(truth.terms[row])
        labels.append(f"{truth.terms[row]} in d{truth.names[equation]}/dt")
        values.append(found.coefficients[index, equation])
        errors.append(found.standard_errors[index, equation])
        true.append(truth.coefficients[row, equation])
    values, errors, true = np.array([values, errors, true])
    figure, axes = plt.subplots(figsize=(7.5, 0.32 * len(labels) + 1.2))
    place = -np.arange(len(labels))
    axes.axvline(0, color="k", lw=0.8)
    scale = 1e6 / np.abs(true)
    axes.errorbar((values - true) * scale, place, xerr=errors * scale, fmt="o")
    axes.set_yticks(place, labels)
    axes.set_xlabel("distance from the truth (millionths of the true coefficient)")
    axes.grid(axis="y", visible=False)
    return figure


def plot_pulls(pulls):
    """Errors of the coefficients in units of their standard errors, one column a system.

    Parameters
    ----------
    pulls : dict of str to ndarray
        ``(found - true) / standard error`` of all coefficients, by system.
    """
    figure, axes = plt.subplots(figsize=(8, 3.8))
    axes.axhspan(-2, 2, color="0.92")
    axes.axhline(0, color="k", lw=0.8)
    for column, values in enumerate(pulls.values()):
        spread = np.linspace(-0.25, 0.25, len(values))
        axes.plot(column + spread, values, "oC0", ms=4)
    axes.set_xticks(range(len(pulls)), pulls, rotation=20)
    axes.set_ylabel("error / standard error")
    axes.grid(axis="x", visible=False)
    return figure


def plot_methods(scores):
    """Relative error of several methods on several systems; open where the terms are wrong.

    Parameters
    ----------
    scores : dict of (str, str) to dict of str to Score
        Scores by system, for each pair of a method and a kind of data; one panel a kind.
    """
    methods, kinds = (list(dict.fromkeys(names)) for names in zip(*scores, strict=True))
    figure, panels = plt.subplots(1, len(kinds), figsize=(10.5, 4.4), sharey=True)
    for (method, kind), by_system in scores.items():
        axes, k = panels[kinds.index(kind)], methods.index(method)
        for column, scored in enumerate(by_system.values()):
            style = {"marker": "os^vD"[k], "color": f"C{k}", "ms": 8, "mew": 1.5}
            place = column + 0.13 * (k - (len(methods) - 1) / 2)
            face = f"C{k}" if scored.exact else "white"
            axes.plot(place, 100 * scored.l2, mfc=face, **style)
        axes.plot([], [], ls="", label=method, **style)
        axes.set(title=kind, yscale="log")
        axes.set_xticks(range(len(by_system)), by_system, rotation=35, ha="right")
        axes.grid(axis="x", visible=False)
    panels[0].plot([], [], "o", ms=8, color="0.4", mfc="white", mew=1.5, label="open: wrong terms")
    panels[0].set_ylabel(r"relative $\ell_2$ error (%)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure


# ------------------------------------------------------------------------------------------ details


def _space(size):
    figure = plt.figure(figsize=size)
    axes = figure.add_subplot(projection="3d", proj_type="ortho")
    return figure, axes


def _over_time_and_in_space(t, curves, missing, word, unit):
    """Curves by coordinate and in space, by label with their style; what is missing is shaded."""
    figure = plt.figure(figsize=(10.5, 4.7))
    panels = figure.subplot_mosaic(
        [["x", "space"], ["y", "space"], ["z", "space"]],
        per_subplot_kw={"space": {"projection": "3d", "proj_type": "ortho"}}, width_ratios=(1.1, 1),
    )  # fmt: skip
    space = panels["space"]
    for i, name in enumerate("xyz"):
        axes = panels[name]
        axes.fill_between(
            t, 0, 1, where=missing, color="0.85", step="mid", transform=axes.get_xaxis_transform()
        )
        for curve, style in curves.values():
            axes.plot(t, curve[:, i], **style)
        axes.set_ylabel(name)
        axes.label_outer()
    panels["z"].set_xlabel(f"time ({unit}); x, y, z in scene units")
    for label, (curve, style) in curves.items():
        space.plot(*curve.T, label=label, **style)
    space.plot([], [], color="0.85", lw=8, label=word)
    _finish(space, azimuth=-60, elevation=25, zoom=0.85)
    figure.legend(*space.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _finish(axes, azimuth, elevation, zoom=1.05):
    extent = np.ptp([axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d()], axis=1)
    axes.set_box_aspect(extent, zoom=zoom)  # one unit is equally long on all three axes
    axes.locator_params(nbins=5)
    for name in "xyz":
        axes.set(**{f"{name}label": f"{name} (scene units)"})
        getattr(axes, f"{name}axis").labelpad = 7
    axes.view_init(elev=elevation, azim=azimuth)


def _on_plane(camera, pixels):
    """The points of the view plane that are the pixels' places in space."""
    in_plane = camera.plane_coordinates(pixels) - camera.offset
    return camera.position + in_plane @ camera.rows


def _draw_plane(axes, camera, color):
    width, height = camera.image_size
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height], [0, 0]]) - 0.5
    edge = _on_plane(camera, corners)
    axes.plot(*edge.T, color=color, lw=1)
    axes.plot_trisurf(*edge[:4].T, triangles=[[0, 1, 2], [0, 2, 3]], color=color, alpha=0.12)


def _show(axes, image, extent=None):
    """An image as a video reader gives it (blue-green-red)."""
    axes.imshow(image[..., ::-1].astype(np.uint8), extent=extent, interpolation="nearest")
    axes.grid(False)
    axes.spines[:].set_visible(False)


def _magnify(axes, image, track, index, reach=24):
    """The surroundings of the target, three times as large, in the corner with the least track."""
    corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])  # right, bottom
    size = np.array(image.shape[1::-1])
    part = 6 * reach / size
    seen = track[np.isfinite(track).all(axis=1)] / size
    inside = [np.all(np.abs(seen - corner) < 1.1 * part, axis=1).sum() for corner in corners]
    right, bottom = corners[int(np.argmin(inside))]
    place = (right * (1 - part[0]), (1 - bottom) * (1 - part[1]), *part)
    centre = track[index]
    near = {"xlim": (centre[0] - reach, centre[0] + reach)}
    near |= {"ylim": (centre[1] + reach, centre[1] - reach), "xticks": (), "yticks": ()}
    inset = axes.inset_axes(place, **near)
    _show(inset, image)
    inset.set(**near)
    inset.spines[:].set(visible=True, color="white", linewidth=1.5)
    box = axes.indicate_inset_zoom(inset, edgecolor="white", alpha=1, linewidth=1.5)
    for line in box.connectors:
        line.set_visible(False)
