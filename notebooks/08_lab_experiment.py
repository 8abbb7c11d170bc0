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
# # The lab experiment: a ball on a table
#
# In this notebook, we present the one experiment of the paper with real cameras: a ball rolls over a
# table, three cameras film it, and one point of its path is found with an error of 8.87 mm. We ask where
# the millimetres come from, and take them away.
#
# **What you will see**
#
# * the experiment rebuilt: three paths, three perspective cameras, rendered and tracked videos;
# * the paper's orthographic cameras: errors of the size that the paper reports;
# * why: an orthographic camera does not know that near things look larger; the first-order formula;
# * perspective cameras behind the same methods, learned from one calibrated camera;
# * that the image of a ball is not centred on the image of its centre, and what whole pixels cost.
#
# **Afterwards you can** tell from residuals that a camera model is wrong, and how many millimetres that costs.
#
# **What you need**: the camera equation and its learning, [notebook 03](03_camera_learning.ipynb).
#
# **Covers** Appendix "Lab Experiment on Trajectory Extraction". The paper's footage is **not public**,
# and neither are the places of its cameras. The videos here are rendered; only the frame of reference,
# the marked point, the three straight paths and the one calibrated camera are the paper's.

# %% tags=["parameters"]
profile: str = "full"  # full or quick
camera: int = 2  # which one is measured wrong, 2 or 3
seed: int = 0  # of the cloth in the videos, and of the rigs put up at random

# %%
import re
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import LogLocator

from vidsindy_lite import (
    Rig,
    Scene,
    cameras,
    learn_cameras,
    observe_tracks,
    read_frame,
    reconstruct,
    render_video,
    residuals,
    track,
)
from vidsindy_lite.companion.artifacts import save_figure, save_table, versions
from vidsindy_lite.study import LAB, plots

plt.style.use("vidsindy_lite.study.plots.vidsindy")
full = profile == "full"
frames = 50 if full else 30  # of each path


# %%
def length(error):
    return np.linalg.norm(error, axis=-1)


def rms(error):
    return np.sqrt(np.mean(length(error) ** 2))


# %% [markdown]
# ## What the paper says
#
# With the corner of the table as origin, the ball's centre is found at (182.92, 291.81, 24.50) mm where
# it is at (180, 300, 26.25) mm.

# %%
MARKED, IDENTIFIED = np.array(LAB.truth), np.array(LAB.found)
RADIUS = MARKED[2]  # a ball on the table has its centre there
published = length(IDENTIFIED - MARKED)
print(f"error of the paper: {published:.2f} mm; diameter of its ball: {2 * RADIUS} mm")
assert round(published, 2) == 8.87

# %% [markdown]
# The height says which ball it was: one whose centre is 26.25 mm above the table measures 52.5 mm, a
# snooker ball. (The "standard billiard ball" of pool has 57.15 mm.) We roll this one.
#
# ## The scene
#
# Three cameras stand about two metres from the table and look down on it. The ball rolls along three
# straight paths and slows down; the first path goes through the marked point.

# %%
FPS = 25
middles = (MARKED[:2], (430.0, 350.0), (350.0, 450.0))  # where it is in the middle of each clip, mm
velocities = np.array([(50.0, 170.0), (-220.0, 130.0), (240.0, -80.0)])  # and how fast, mm/s


def rolling(frames):
    """Centre of the ball on three straight paths, on which rolling friction slows it down by 60 mm/s^2."""
    t = (np.arange(frames)[:, None] - frames // 2) / FPS
    x = np.full((3, frames, 3), RADIUS)
    for path, middle, velocity in zip(x, middles, velocities, strict=True):
        path[:, :2] = middle + (t - t**2 * 60 / (2 * length(velocity))) * velocity
    return x


# %% [markdown]
# The paper does not say where its cameras stand. All of ours look at the same point of the table; the focal length
# grows with the distance, so that the table fills the images.

# %%
MIDDLE = np.array([350.0, 350.0, 0.0])  # of the part of the table that they look at


def camera_at(azimuth, elevation, reach, focal, roll):
    """A camera that looks at the middle, seen from there in this direction (degrees), rolled."""
    a, e, roll = np.deg2rad([azimuth, elevation, roll])
    normal = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    up = cameras.rotation_to_z(normal)[:2, 2]  # this angle shows it as up in the image
    place, angle = MIDDLE + reach * normal, np.arctan2(up[0], up[1]) + roll
    return cameras.PerspectiveCamera(position=place, normal=normal, scale=1 / focal, angle=angle)


def table_rig(distance=1.0):
    places = ((-80, 35, 1900, 1100, 3), (40, 30, 2200, 1250, -5), (160, 40, 2000, 1150, 8))
    return Rig([camera_at(a, e, distance * r, distance * f, roll) for a, e, r, f, roll in places])


# %%
truth = table_rig()
paths = rolling(frames)
x = paths.reshape(-1, 3)
marked = frames // 2  # index of the frame in which the ball is there
assert np.allclose(x[marked], MARKED, atol=1e-3)
assert abs(2 * RADIUS - 52.5) < 0.1  # of a snooker ball, mm
for one in truth.cameras:
    print(f"at {one.position.round()} mm, focal length {one.focal_length:.0f} px")

# %% [markdown]
# A pinhole camera sees the point $\mathbf x$ at the pixel $\mathbf x_c$ (from the middle of the image,
# $y$ up), where
#
# $$s\,d\;\mathcal T(\vartheta)\,\mathbf x_c=\mathbf R^-(\mathbf x-\mathbf p),\qquad
# d=\mathbf n\cdot(\mathbf p-\mathbf x):$$
#
# the camera of the paper with a scale $s\,d$ that grows with the distance $d$ from the pinhole
# $\mathbf p$ along the normal $\mathbf n$. $1/s$ is the focal length in pixels.
#
# A ball of radius $r$ is seen as an ellipse, so this is what is drawn: in one colour, without highlight, shadow, blur
# or noise, before a plain cloth.

# %%
def filmed(file, camera, path, cloth):
    """Film a path of the ball, and track it."""
    centroids, shapes = camera.ball_image(path, RADIUS)
    scene = Scene(background="plain", image_size=camera.image_size)
    render_video(file, centroids, scene, FPS, cloth, 2 / scene.size * shapes)
    return track(file).pixels, read_frame(file, marked)


# %%
with TemporaryDirectory() as folder:
    clips = [
        [filmed(Path(folder) / f"{i}_{k}.mov", camera, path, 3 * seed + i) for k, path in enumerate(paths)]
        for i, camera in enumerate(truth.cameras)
    ]
tracks = [np.vstack([pixels for pixels, _ in views]) for views in clips]
images = [views[0][1] for views in clips]
lost = sum(np.isnan(track).any(axis=1).sum() for track in tracks)
print(f"{9 * frames} frames, target lost in {lost}")
assert lost == 0

# %%
titles = [f"camera {i}" for i in (1, 2, 3)]
first = [track[:frames] for track in tracks]
fig = plots.plot_frames(images, titles, first, marked)
caption = "The three views when the ball is at the marked point, and its tracks along the first path."
numbers = {f"camera {i}": track for i, track in enumerate(tracks, start=1)}
save_figure("lab_frames", fig, caption=caption, numbers=numbers)

# %% [markdown]
# *The three views at the moment when the ball is at the marked point, with its track along the first
# path and the ball magnified.*

# %% [markdown]
# ## The paper's cameras
#
# The paper takes its cameras as scaled orthographic: one scale for all distances. The best that can be
# done for camera 1 is to calibrate it in the middle of the table. The others are learned.

# %%
def flattened(rig):
    """The same cameras, with one scale for all distances."""
    return Rig([
        cameras.OrthographicCamera(
            position=c.position, normal=c.normal, angle=c.angle, image_size=c.image_size,
            scale=c.scale * (c.normal @ (c.position - MIDDLE)),
        ) for c in rig.cameras
    ])  # fmt: skip


# %%
t = np.arange(len(x)) / FPS
seen = observe_tracks(tracks, flattened(truth).uncalibrated(keep=0), t, lags=(0, 0, 0))
assert "the rig does not agree with the tracks" in seen.warnings[0]
flat, by_flat = seen.rig, seen.x
error = by_flat - x
rows = [
    {"": "truth", **dict(zip("xyz", MARKED, strict=True)), "error (mm)": 0.0},
    {"": "paper", **dict(zip("xyz", IDENTIFIED, strict=True)), "error (mm)": published},
    {"": "here", **dict(zip("xyz", by_flat[marked], strict=True)), "error (mm)": length(error)[marked]},
]
assert 3 < length(error)[marked] < 20
save_table("lab_marked_point", rows, caption="The marked point (mm), by orthographic cameras.")

# %% [markdown]
# An error of the paper's size, from videos without any noise; and a warning that the cameras do not agree,
# as anyone would get it. It is not the worst on the paths:

# %%
missed = np.hstack(residuals(tracks, flat))
print(f"error along the paths: {rms(error):.1f} mm rms, up to {length(error).max():.0f} mm")
print(f"residuals: {np.sqrt(np.mean(missed**2)):.1f} px rms")
assert length(error).max() > 2 * length(error)[marked]
assert np.sqrt(np.mean(missed**2)) > 1

# %% [markdown]
# The *residuals*, which need no truth, give it away: a tracker that is good to a fraction of a pixel
# should not be missed by pixels. Something about the cameras is wrong.

# %% [markdown]
# ## Why
#
# Let the camera be calibrated at the distance $D$. A point nearer by $\delta$ is seen larger by
# $D/(D-\delta)\approx1+\delta/D$, that is, pushed away from the line of view:
#
# $$\boldsymbol\varepsilon_i\approx\frac{\delta_i}{D_i}\,\mathbf R_i^-(\mathbf x-\mathbf p_i)
# +\Bigl(\frac{\mathrm ds_i}{s_i}+\mathrm d\vartheta_i\,\mathcal T(\tfrac\pi2)\Bigr)
# \mathbf R_i^-(\mathbf x-\mathbf p_i).$$
#
# The second part is what these errors do to the learned cameras. The error in space is the least-squares
# solution of the $\boldsymbol\varepsilon_i$, Eq. (6). It is proportional to the depth range over the
# distance, so look at cameras further and further away, with focal lengths to match.

# %%
def first_order(rig, flat, x):
    """Error in space of the orthographic cameras that reconstruct, to the first order."""
    rows, views = [], []
    for camera, (growth, turn) in zip(rig.cameras, cameras.calibration_errors(flat, flattened(rig)), strict=True):
        distance = camera.normal @ (camera.position - MIDDLE)
        growth = growth + (x - MIDDLE) @ camera.normal / distance
        across = (x - camera.position) @ camera.rows.T
        pixel = camera.scale * distance
        rows.append(camera.rows / pixel)
        views.append((growth[:, None] * across + turn * across[:, ::-1] * (1, -1)) / pixel)
    return np.hstack(views) @ np.linalg.pinv(np.vstack(rows)).T


# %%
predicted = first_order(truth, flat, x)
measured_rms, predicted_rms, ratio = [], [], []
for factor in (1, 2, 4, 8, 16):
    far = table_rig(distance=factor)
    pixels = [camera.project(x) for camera in far.cameras]
    found = learn_cameras(pixels, flattened(far).uncalibrated())
    measured_rms.append(rms(reconstruct(pixels, found) - x))
    predicted_rms.append(rms(first_order(far, found, x)))
    ratio.append(np.mean([np.ptp(x @ c.normal) / length(c.position - MIDDLE) for c in far.cameras]))
assert np.isclose(measured_rms[0], rms(error), rtol=0.05)  # from pixels as from videos

# %%
by_path = length(error).reshape(3, -1), length(predicted).reshape(3, -1)
by_distance = {"measured": np.array(measured_rms), "first order": np.array(predicted_rms)}

# %% tags=["hide-input"] jupyter={"source_hidden": true}
fig, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2))
seconds = np.arange(frames) / FPS
for k, (measured, expected) in enumerate(zip(*by_path, strict=True)):
    left.plot(seconds, measured, f"C{k}", label=f"path {k + 1}")
    left.plot(seconds, expected, "--k", lw=1)
left.plot([], [], "--k", lw=1, label="first order")
left.set(title="along the paths", xlabel="time (s)", ylabel="error (mm)", ylim=(0, None))
left.legend()
for (name, values), style in zip(by_distance.items(), ("oC1", "--k"), strict=True):
    right.loglog(ratio, values, style, label=name)
right.set(title="as the cameras move away", ylabel="rms error (mm)")
right.set_xticks(ratio, [f"{value:.2g}" for value in ratio])
right.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
right.yaxis.set_major_formatter("{x:g}")
right.minorticks_off()
right.set_xlabel("depth range / distance")
right.legend()
caption = "Error of orthographic cameras: along the paths, and against depth range over distance."
numbers = {"measured": by_path[0], "first order": by_path[1], "ratio": ratio, **by_distance}
save_figure("lab_orthographic_error", fig, caption=caption, numbers=numbers)

# %% [markdown]
# *Left: the error of the paper's model along the three paths (colours) is what the first-order formula
# says (dashed). Right: twice as far away, half the error.*

# %%
assert rms(predicted - error) < 0.15 * rms(error)
for near, further in zip(measured_rms[:-1], measured_rms[1:], strict=True):
    assert 1.9 < near / further < 2.2
assert abs(measured_rms[-1] / predicted_rms[-1] - 1) < 0.01

# %% [markdown]
# ## Did we choose the cameras so that it fits?
#
# The error depends on where the cameras are, which the paper does not say. So put them up at random:
# 1.2 to 3 m away, 20 to 50 degrees above the table, at least 60 degrees apart around it.


# %%
def random_rig(rng):
    azimuths = np.zeros(3)
    while np.diff(azimuths, append=azimuths[0] + 360).min() < 60:
        azimuths = np.sort(rng.uniform(0, 360, 3))
    places = zip(rng.permutation(azimuths), rng.uniform(1200, 3000, 3), strict=True)
    return Rig([camera_at(a, rng.uniform(20, 50), r, 0.575 * r, rng.uniform(-10, 10)) for a, r in places])


# %%
def error_of_rig(stream):
    rig = random_rig(np.random.default_rng(stream))
    pixels = [camera.project(x) for camera in rig.cameras]
    found = learn_cameras(pixels, flattened(rig).uncalibrated())
    return length(reconstruct(pixels, found)[marked] - MARKED)


streams = np.random.SeedSequence(seed).spawn(200 if full else 60)
anywhere = np.array([error_of_rig(stream) for stream in streams])
low, middle, high = np.quantile(anywhere, (0.05, 0.5, 0.95))
print(f"median {middle:.1f} mm, nine of ten between {low:.1f} and {high:.1f} mm")
assert low < published < high

# %% tags=["hide-input"] jupyter={"source_hidden": true}
fig, axes = plt.subplots(figsize=(7, 3.8))
axes.ecdf(anywhere, color="C1", label="orthographic cameras, somewhere around the table")
axes.axvline(published, color="k", ls="--", lw=1.2, label=f"the paper's, {published:.2f} mm")
axes.set(xlabel="error at the marked point (mm)", ylabel="share of rigs below", xlim=(0, None))
fig.legend(loc="outside upper center", ncols=2)
caption = "Error at the marked point for rigs put up at random: the paper's is an ordinary one."
save_figure("lab_anywhere", fig, caption=caption, numbers={"error": anywhere})

# %% [markdown]
# *Wherever the three cameras stand, the orthographic model costs millimetres at the marked point; the
# paper's error is an ordinary one.*

# %% [markdown]
# ## Perspective cameras
#
# The same call with perspective cameras: positions and normals known, focal length and roll of two of
# them not. This is their rig file.

# %%
start = truth.uncalibrated(keep=0)
with TemporaryDirectory() as folder:
    start.save(Path(folder) / "rig.toml")
    text = (Path(folder) / "rig.toml").read_text()
print(re.sub(r"(\.\d{4})\d+", r"\1", text)[:350], "...")  # fewer digits, to be read

# %% [markdown]
# No starting guess is needed here either. The ball lies on the line of sight of camera 1. In camera 2
# this line has an image, and that the ball is seen on it is one equation per frame, **linear** in
# $(s\cos\vartheta,\,s\sin\vartheta)$: the epipolar constraint. What it gives is then refined to the least
# reprojection error, as with orthographic cameras.

# %%
pixels = [camera.project(x) for camera in truth.cameras]  # of the centre: exact
learned = learn_cameras(pixels, start)
assert np.abs(cameras.calibration_errors(learned, truth)).max() < 1e-9
assert rms(reconstruct(pixels, learned) - x) < 1e-5  # mm
seen = observe_tracks(tracks, start, t, lags=(0, 0, 0))  # of the ball in the videos
assert seen.warnings == ()
learned, by_pinhole = seen.rig, seen.x
print(f"error along the paths: {rms(by_pinhole - x):.3f} mm rms")
assert rms(by_pinhole - x) < 0.1

# %%
models = {"orthographic": by_flat, "perspective": by_pinhole}
points = {"marked point": MARKED, "the paper's result for it": IDENTIFIED}
found = {name: values.reshape(paths.shape) for name, values in models.items()}

# %% tags=["hide-input"] jupyter={"source_hidden": true}
fig = plt.figure(figsize=(10.5, 4.2), layout="compressed")
panels = fig.subplot_mosaic(
    [["above", "space"]], width_ratios=(1, 1.15), per_subplot_kw={"space": plots.SPACE}
)
above, space = panels["above"], panels["space"]
for path in paths:
    space.plot(*path.T, color="k", lw=1.2)
for i, one in enumerate(truth.cameras, start=1):
    place = np.array(one.position)
    looked_at = place - one.normal * length(place - x.mean(axis=0))
    space.plot(*np.transpose([place, looked_at]), "s:", color="0.4", ms=8, lw=1, markevery=2)
    space.text(*place + [0, 0, 130], f"$C_{i}$", ha="center")
space.plot([0, 750, 750, 0, 0], [0, 0, 750, 750, 0], 0, color="0.6", lw=0.8)
space.set_zlim3d(0, space.get_zlim3d()[1])
plots.finish_space(space, azimuth=-65, elevation=25, zoom=1.12, unit="mm")
space.locator_params(nbins=3)
drawn = {"truth": (paths, {"color": "0.75", "lw": 5})}
drawn |= {name: (found[name], {"color": f"C{1 - i}", "lw": 1.3}) for i, name in enumerate(found)}
for name, (lines, style) in drawn.items():
    for k, path in enumerate(lines):
        above.plot(*path[:, :2].T, label=name if k == 0 else None, **style)
for (name, point), style in zip(points.items(), ("*k", "*C4"), strict=True):
    above.plot(*point[:2], style, ms=12, mec="white", mew=0.6, ls="", label=name)
above.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
fig.legend(*above.get_legend_handles_labels(), loc="outside upper center", ncols=5)
caption = "The paths from above: true, by orthographic and by perspective cameras; and the scene."
save_figure("lab_table", fig, caption=caption, numbers={"truth": paths, **found})

# %% [markdown]
# *Left: the paths from above; orthographic cameras (vermilion) miss them, perspective cameras (blue) put them
# on the truth (grey). Right: the scene, with the part of the table that the cameras look at.*

# %% [markdown]
# ## The image of a ball
#
# The tracker finds the centroid of the ball's image. It is **not** the image of the ball's centre: the
# rays that touch the ball form a cone, and the image plane cuts it in an ellipse around
#
# $$\frac{\mathbf x_c}{1-(r/d)^2},$$
#
# further out than the image $\mathbf x_c$ of the centre. At these distances it is a few hundredths of a
# pixel, more than the tracker's error.

# %%
shifts = [
    length(camera.ball_image(x, RADIUS)[0] - centre)
    for camera, centre in zip(truth.cameras, pixels, strict=True)
]
tracking = [
    length(pixels - camera.ball_image(x, RADIUS)[0])
    for camera, pixels in zip(truth.cameras, tracks, strict=True)
]
print(f"centroid beside centre: up to {np.max(shifts):.3f} px; tracker: up to {np.max(tracking):.3f} px")
assert np.max(tracking) < 0.005
assert 5 * np.max(tracking) < np.max(shifts) < 0.1

# %% [markdown]
# As the ball's radius is known, the difference can be computed once the ball's place is, and taken off:
# observe, correct, and observe again. Each round leaves about a thousandth of the error. At the other end, a detector that gives **whole
# pixels** (a box, say) costs more than everything else together.

# %%
rounded = [np.round(track) for track in tracks]
coarse = observe_tracks(rounded, start, t, lags=(0, 0, 0))
centred = seen
for _ in range(2):
    corrected = [
        pixels - camera.ball_image(centred.x, RADIUS)[0] + camera.project(centred.x)
        for pixels, camera in zip(tracks, centred.rig.cameras, strict=True)
    ]
    centred = observe_tracks(corrected, start, t, lags=(0, 0, 0))
results = {
    "orthographic": (flat, by_flat),
    "perspective, whole pixels": (coarse.rig, coarse.x),
    "perspective": (learned, by_pinhole),
    "perspective, ball's centre": (centred.rig, centred.x),
}

# %%
rows = []
for name, (rig, path) in results.items():
    scale, angle = np.abs(cameras.calibration_errors(rig, flattened(truth) if rig is flat else truth)).max(0)
    row = {"cameras": name, "rms (mm)": rms(path - x), "largest (mm)": length(path - x).max()}
    row |= {"marked point (mm)": length(path - x)[marked]}
    rows.append(row | {"error of scale (%)": 100 * scale, "error of angle (mrad)": 1000 * angle})
assert all(row["rms (mm)"] < 1 for row in rows[1:])
assert all(row["error of scale (%)"] < 0.1 for row in rows[1:])
assert rows[1]["error of angle (mrad)"] < 1.5
assert all(row["error of angle (mrad)"] < 0.1 for row in rows[2:])
assert rows[0]["largest (mm)"] > 10
assert rows[3]["rms (mm)"] < 0.1 * rows[2]["rms (mm)"] < 0.1 * rows[1]["rms (mm)"]
assert max(list(rows[3].values())[1:]) < 0.01
rows[3] |= dict.fromkeys(tuple(rows[3])[1:], "below 0.01")

# %%
loose = dict.fromkeys(["error of scale (%)", "error of angle (mrad)"], 0.2)
caption = "Three paths of the ball, by the model of the cameras."
save_table("lab_models", rows, caption=caption, tolerance=loose)

# %%
lengths = {name: length(path - x) for name, (_, path) in results.items()}

# %% tags=["hide-input"] jupyter={"source_hidden": true}
fig, axes = plt.subplots(figsize=(8, 4))
for (name, error), colour, style in zip(lengths.items(), (1, 0, 2, 3), ("-", "--", "-.", ":"), strict=True):
    axes.ecdf(error, color=f"C{colour}", ls=style, label=name)
axes.axvline(1, color="0.6", lw=0.8)
axes.set(xscale="log", xlabel="error in space (mm)", ylabel="share of frames below")
fig.legend(loc="outside upper center", ncols=2)
caption = "Error in space by the model of the cameras; the vertical line is one millimetre."
save_figure("lab_model_errors", fig, caption=caption, numbers=lengths)

# %% [markdown]
# *From centimetres to micrometres (vertical line: one millimetre): the model of the camera first, then the fraction of a pixel, then the
# size of the ball.*

# %% [markdown]
# ## What else it could be
#
# All this takes position and normal of every camera as exact. In a lab they are measured, and small
# errors of them cost as much as the wrong model. Perspective cameras, exact pixels, one camera (2, if nothing
# else is asked for) misplaced or turned:


# %%
def misplaced(name, **change):
    measured = list(start.cameras)
    measured[camera - 1] = replace(measured[camera - 1], **change)
    rig = learn_cameras(pixels, Rig(measured))
    missed = np.hstack(residuals(pixels, rig))
    values = rms(reconstruct(pixels, rig) - x), np.sqrt(np.mean(missed**2))
    return {f"camera {camera}": name} | dict(
        zip(("rms (mm)", "residuals (px rms)"), np.round(values, 3).tolist(), strict=True)
    )


# %%
known = start.cameras[camera - 1]
tilt = np.deg2rad(0.5) * known.rows[0]
rows = [
    misplaced("as it is"),
    misplaced("5 mm lower", position=known.position - [0, 0, 5]),
    misplaced("turned by half a degree", normal=known.normal + tilt),
    misplaced("5 mm lower, and said to be good to 5 mm", position=known.position - [0, 0, 5], position_error=5.0),
    misplaced("turned, and said to be good to half a degree", normal=known.normal + tilt, normal_error=0.5),
]
assert rows[1]["rms (mm)"] > 1
assert rows[2]["rms (mm)"] > 5
assert rows[2]["residuals (px rms)"] > 1
assert all(said["rms (mm)"] < 0.05 * taken["rms (mm)"] for taken, said in zip(rows[1:3], rows[3:], strict=True))
save_table("lab_misplaced", rows, caption="Perspective cameras, one of them measured wrong.")

# %% [markdown]
# A rig file that says how good its numbers are (`position_error`, `normal_error`, see
# [notebook 03](03_camera_learning.ipynb#measured-by-hand)) lets the ball find what the hand missed: the last two rows.
#
# So the orthographic model is *sufficient* for the paper's error, but a normal that is wrong by half a
# degree would be as well. Without the footage nobody can tell which it was; the residuals would have told
# that something was.

# %% [markdown]
# ## What we learned
#
# * Orthographic cameras two metres from a table give errors of several millimetres from noiseless
#   videos, and a first-order formula says where and how large.
#   <!-- by: 3 < length(error)[marked] < 20; rms(predicted - error) < 0.15 * rms(error) -->
# * The error falls as depth range over distance. In the videos of the other notebooks the cameras *are*
#   orthographic; with real ones, stand far away with a long lens, or use perspective cameras.
#   <!-- by: 1.9 < near / further < 2.2 -->
# * Perspective cameras need no more to be known: position and normal of all, calibration of one. The
#   start is linear, and whole pixels already suffice for less than a millimetre (with focal lengths
#   within 0.1 %, angles within about a milliradian). But positions and normals must then be measured
#   with care, or the rig file must say how good they are.
#   <!-- by: np.abs(cameras.calibration_errors(learned, truth)).max() < 1e-9; all(row["rms (mm)"] < 1 for row in rows[1:]); rows[1]["error of angle (mrad)"] < 1.5; rows[1]["rms (mm)"] > 1; said["rms (mm)"] < 0.05 * taken["rms (mm)"]; figure lab_misplaced -->
# * Below a tenth of a millimetre, a ball is not a point. (Below a hundredth, our rendered ball in one
#   colour without noise, highlight and shadow flatters the tracker: no real video is that good.)
#   <!-- by: rms(by_pinhole - x) < 0.1; 5 * np.max(tracking) < np.max(shifts) < 0.1 -->
#
# **What the paper says and what we found.**
#
# * "(182.92, 291.81, 24.50) mm ... closely aligning with the ground truth values of (180, 300,
#   26.25) mm": 8.87 mm, an ordinary error for the orthographic model at such distances, wherever the
#   cameras stand.
#   <!-- by: round(published, 2) == 8.87; low < published < high -->
# * "can be further improved when high-resolution videos are recorded": not with these cameras. Ours are
#   tracked to a few thousandths of a pixel, and the orthographic error stays what it is.
#   <!-- by: np.max(tracking) < 0.005; 3 < length(error)[marked] < 20 -->
# * "A standard billiard ball": by its height, a snooker ball.
#   <!-- by: abs(2 * RADIUS - 52.5) < 0.1; figure lab_marked_point -->
#
# Not modelled: lens distortion, a principal point off the middle of the image, and cameras that are not
# synchronised.

# %% [markdown]
# ## Exercises
#
# [Four exercises](exercises/08_lab_experiment.ipynb), each with a blank cell and a check that says *right* or fails. Their
# [solutions](solutions/08_lab_experiment.ipynb) lie apart.

# %% [markdown]
# ## Run time and versions
#
# All cells take about 20 seconds on two cores, beside two other notebooks.

# %%
print(versions())
