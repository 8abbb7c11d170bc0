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
# # Learning cameras, and the target's path in space
#
# In this notebook, we present how one calibrated camera is enough to calibrate the others: the target
# itself, seen from several sides, tells scale and in-plane angle of every camera, and with them its
# path in space.
#
# **What you will see**
#
# * Eq. (4) of the paper is a *linear* least-squares problem: closed form, no starting guess;
# * what it leaves out, the epipolar constraint between the two unknown cameras, and what that costs;
# * exact pixels give exact cameras; whole pixels give the path to about 0.2 px;
# * lost views, and tracks that cannot calibrate anything;
# * what to do about a rig that was measured by hand.
#
# **Afterwards you can** calibrate cameras by the motion that they see, and read in the residuals whether to trust
# them.
#
# **What you need**: the camera equation of the [first notebook](01_projection_proofs.ipynb). The tracks
# are computed here, not taken from videos, so that the true answer is known.
#
# **Covers** Section "Learning 3D trajectory", Eq. (4)-(6).

# %% tags=["parameters"]
profile: str = "full"  # full or quick
system: str = "Lorenz"  # one of vidsindy_lite.study.SYSTEMS
frames: int = 500  # video frames per camera
pixel_noise: float = 2.0  # of the noisy tracks, px
seed: int = 0  # of all pixel noise

# %%
import re
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import matplotlib.pyplot as plt
import numpy as np
import torch
from scipy.spatial.transform import Rotation

from vidsindy_lite import (
    Rig,
    cameras,
    discover_from_tracks,
    learn_cameras,
    reconstruct,
    residuals,
)
from vidsindy_lite.companion.artifacts import save_figure, save_slider, save_table, versions
from vidsindy_lite.study import (
    REFERENCE_OFFSET,
    SYSTEMS,
    plots,
    rate,
    score,
    significant,
    term_errors,
)

plt.style.use("vidsindy_lite.study.plots.vidsindy")
trials = {"full": 100, "quick": 40}[profile]

# %% [markdown]
# ## The rig and the tracks
#
# Three cameras around the target. Camera $i$ sees it at $\mathbf x_{c_i}$ (pixels from the middle of the
# image, y up), where
#
# $$s_i\,\mathcal T(\vartheta_i)\,\mathbf x_{c_i}+\Delta_{c_i}=\mathbf R_i^-\mathbf x .$$
#
# On the left is the pixel, scaled by $s$, turned by $\vartheta$ and shifted by the offset $\Delta_c$; on the right
# the point in space in the two axes of the view plane. $\mathbf R^-$, the first two rows of the rotation of
# [notebook 01](01_projection_proofs.ipynb), is `camera.rows` in the code.

# %%
t, x = SYSTEMS[system].shift(REFERENCE_OFFSET).trajectory(frames)
truth = Rig.around(x)
tracks = [camera.project(x) for camera in truth.cameras]
pixel = np.mean([camera.scale for camera in truth.cameras])  # scene units

# %%
fig = plots.plot_rig(truth, x)
caption = "Three cameras around a target; each sees its flat image of the same path (black)."
save_figure("cameras_rig", fig, caption=caption, numbers={"t": t, "x": x})

# %% [markdown]
# *Three cameras around a target: each view plane holds a different flat image of the same path (black).*

# %%
fig = plots.plot_tracks(tracks, truth.cameras)
caption = "What is given: one pixel track per camera, v pointing down."
numbers = {f"camera {i}": track for i, track in enumerate(tracks, start=1)}
save_figure("cameras_tracks", fig, caption=caption, numbers=numbers)

# %% [markdown]
# *What is given: one pixel track per camera (v points down, as in any image). Scales differ, and so
# does the tilt of the images.*

# %% [markdown]
# Positions and normals of all cameras are known, scale and angle of the first only. This is what a rig
# file looks like; the missing keys are the ones to be learned.

# %%
start = truth.uncalibrated(keep=0)
with TemporaryDirectory() as folder:
    file = Path(folder) / "rig.toml"
    start.save(file)
    assert Rig.load(file) == start
    print(re.sub(r"(\.\d{4})\d+", r"\1", file.read_text()))  # fewer digits, to be read

# %% [markdown]
# ## "Inverses" that are least squares
#
# Eq. (5) and (6) write an inverse of stacked $\mathbf R^-$: $4\times3$ for two cameras, $6\times3$ for
# three. Neither has one. What is meant is the pseudo-inverse, the least-squares solution, written $^+$ below.

# %%
stack = np.vstack([camera.rows for camera in truth.cameras])
try:
    np.linalg.inv(stack)
except np.linalg.LinAlgError as error:
    print(f"{stack.shape}: {error}")
assert np.allclose(np.linalg.pinv(stack) @ stack, np.eye(3))
assert not np.allclose(stack @ np.linalg.pinv(stack), np.eye(6), atol=0.1)

# %% [markdown]
# ## Eq. (4) is linear
#
# The two cameras to be learned predict what the calibrated one sees:
#
# $$\mathcal L_r=\frac1{N_m}\Bigl\|\mathbf R_1^-\begin{bmatrix}\mathbf R_2^-\\ \mathbf R_3^-\end{bmatrix}^{+}
# \begin{bmatrix}s_2\mathcal T(\vartheta_2)\mathbf x_{c_2}+\Delta_{c_2}\\
# s_3\mathcal T(\vartheta_3)\mathbf x_{c_3}+\Delta_{c_3}\end{bmatrix}
# -\bigl(s_1\mathcal T(\vartheta_1)\mathbf x_{c_1}+\Delta_{c_1}\bigr)\Bigr\|^2 .$$
#
# The paper finds $(s,\vartheta)$ "via optimization" of it, and does not say which. But with $\mathbf x_c=(X,Y)$
#
# $$s\,\mathcal T(\vartheta)\,\mathbf x_c=\begin{bmatrix}X&Y\\Y&-X\end{bmatrix}
# \begin{bmatrix}s\cos\vartheta\\ s\sin\vartheta\end{bmatrix},$$
#
# so the loss is quadratic in the four numbers $(s\cos\vartheta,\ s\sin\vartheta)$ of cameras 2 and 3:
# one linear least-squares solve.

# %%
learned = cameras.learn_cameras_eq4(tracks, start)
for found, true in zip(learned.cameras, truth.cameras, strict=True):
    print(f"scale {found.scale:.9f} (true {true.scale:.9f})", end="   ")
    print(f"angle {found.angle:+.9f} (true {true.angle:+.9f})")
assert np.abs(cameras.calibration_errors(learned, truth)).max() < 1e-9

# %% [markdown]
# ## What Eq. (4) leaves out
#
# Six numbers are seen per frame, three are unknown: the views must satisfy **three** conditions,
#
# $$\mathbf Q^T\begin{bmatrix}s_1\mathcal T(\vartheta_1)\mathbf x_{c_1}+\Delta_{c_1}\\
# s_2\mathcal T(\vartheta_2)\mathbf x_{c_2}+\Delta_{c_2}\\
# s_3\mathcal T(\vartheta_3)\mathbf x_{c_3}+\Delta_{c_3}\end{bmatrix}=\mathbf 0,\qquad
# \mathbf Q^T\begin{bmatrix}\mathbf R_1^-\\ \mathbf R_2^-\\ \mathbf R_3^-\end{bmatrix}=\mathbf 0,\qquad
# \mathbf Q\in\mathbb R^{6\times3}.$$
#
# The columns of $\mathbf Q$ are orthogonal to all that a point in space can cause; what is left along them is
# disagreement of the views. Eq. (4) uses two of the conditions. The third is the *epipolar* condition between cameras 2 and 3, which the
# least-squares "inverse" absorbs. `learn_cameras` begins, still linear, with the epipolar conditions between the
# calibrated camera and each of the others, and then goes to the smallest reprojection error: the distance, in pixels,
# between what a camera saw and where it would see the reconstructed point. That holds all three.

# %%
first, second, third = (camera.rows for camera in truth.cameras)
others = np.vstack([second, third])
eq_4 = np.hstack([-np.eye(2), first @ np.linalg.pinv(others)])
print("conditions in Eq. (4):", np.linalg.matrix_rank(eq_4))
print("conditions there are: ", len(stack) - np.linalg.matrix_rank(stack))
assert np.allclose(eq_4 @ stack, 0, atol=1e-12)
assert np.linalg.matrix_rank(eq_4) == len(stack) - np.linalg.matrix_rank(stack) - 1

# %% [markdown]
# Does it matter? Here is everything at once: exact pixels, pixels rounded to whole numbers, and two
# pixels of noise; with Eq. (4) in closed form, Eq. (4) by gradients (L-BFGS in
# PyTorch, from $s=s_1$, $\vartheta=0$), and the joint fit.

# %% tags=["hide-input"] jupyter={"source_hidden": true}
def learn_cameras_lbfgs(observed, rig):
    """Eq. (4) by gradients in (s cos theta, s sin theta) / s_1 of cameras 2 and 3."""
    known, *unknown = rig.cameras
    seen = torch.tensor(known.plane_coordinates(observed[0]))
    pairs = zip(unknown, observed[1:], strict=True)
    views = np.stack([c.centred(track) @ [1, 1j] for c, track in pairs], axis=1)
    offsets = torch.tensor([c.offset @ [1, 1j] for c in unknown])
    views, predict = torch.tensor(views), torch.tensor(first @ np.linalg.pinv(others)).T
    values = torch.tensor([[1.0, 0.0]] * 2, dtype=torch.float64, requires_grad=True)
    precise = {"max_iter": 500, "tolerance_grad": 1e-15, "tolerance_change": 1e-18}
    optimiser = torch.optim.LBFGS([values], line_search_fn="strong_wolfe", **precise)

    def loss():
        optimiser.zero_grad()
        turned = known.scale * torch.view_as_complex(values).conj() * views
        planes = torch.view_as_real(turned + offsets)
        missed = (planes.reshape(-1, 4) @ predict - seen) / (100 * known.scale)
        value = torch.mean(missed**2)
        value.backward()
        return value

    optimiser.step(loss)
    turned = known.scale * values.detach().numpy() @ [1, 1j]
    learned = [c.calibrated(z) for c, z in zip(unknown, turned, strict=True)]
    return Rig([known, *learned])


# %%
rng = np.random.default_rng(seed)
rounded = [np.round(track) for track in tracks]
noisy = [track + pixel_noise * rng.normal(size=track.shape) for track in tracks]
learn_cameras_lbfgs(tracks, start)  # so that what PyTorch loads at first use is not timed


def row(pixels, observed, method):
    began = perf_counter()
    found = methods[method](observed, start)
    seconds = perf_counter() - began
    scale, angle = np.abs(cameras.calibration_errors(found, truth)).max(axis=0)
    rmse = np.sqrt(np.mean((reconstruct(observed, found) - x) ** 2)) / pixel
    errors = {"error of scale": scale, "error of angle (rad)": angle, "3D rmse (px)": rmse}
    return {"pixels": pixels, "method": method, **errors, "seconds": seconds}


# %%
cases = {"exact": tracks, "rounded": rounded, f"{pixel_noise:g} px noise": noisy}
methods = {
    "Eq. (4)": cameras.learn_cameras_eq4,
    "Eq. (4), gradients": learn_cameras_lbfgs,
    "joint fit": learn_cameras,
}
rows = [row(name, observed, method) for name, observed in cases.items() for method in methods]
for entry in rows:  # so small a number says nothing but "rounding"
    entry |= {k: "below 1e-6" for k in tuple(entry)[2:5] if entry[k] < 1e-6}
assert all(entry["error of scale"] == "below 1e-6" for entry in rows[:3])
for paths in ([entry["3D rmse (px)"] for entry in group] for group in (rows[3:6], rows[6:])):
    assert max(paths) < 1.1 * min(paths)
caption = "Exact pixels: all three are exact. Else the paths are equally good; in one draw chance decides whose cameras are closer."
save_table("cameras_methods", rows, caption=caption)

# %% [markdown]
# With exact pixels all three agree with the truth; gradients find what the closed form finds, later. With pixels that are not exact the
# paths are equally good: the errors of the views themselves outweigh those of the cameras. Of scales and angles, now Eq. (4), now the joint
# fit is closer: one draw of the noise proves little, so repeat the last case.


# %%
def errors_of(method, noise, number):
    def trial(stream):
        generator = np.random.default_rng(stream)
        observed = [track + noise * generator.normal(size=track.shape) for track in tracks]
        try:
            learned = methods[method](observed, start)
        except ValueError:  # so much noise hides the motion
            return np.full((2, 2), np.nan)
        return cameras.calibration_errors(learned, truth)[1:]

    return np.array([trial(stream) for stream in np.random.SeedSequence(seed).spawn(number)])


# %%
errors = {name: errors_of(name, pixel_noise, trials) for name in ("Eq. (4)", "joint fit")}
deviation = {name: error.std(axis=0).max(axis=0) for name, error in errors.items()}
by_chance = 1 + 2 / np.sqrt(2 * trials)  # two standard errors of a standard deviation
assert (deviation["joint fit"] < by_chance * deviation["Eq. (4)"] + 1e-9).all()
assert profile == "quick" or deviation["joint fit"][0] < 0.9 * deviation["Eq. (4)"][0]  # of the scales

# %% tags=["hide-input"] jupyter={"source_hidden": true}
fig, panels = plt.subplots(1, 2, figsize=(9, 4.2), sharex=True, sharey=True)
for i, axes in enumerate(panels):
    axes.axhline(0, color="k", lw=0.6)
    axes.axvline(0, color="k", lw=0.6)
    for (name, error), marker in zip(errors.items(), "so", strict=True):
        scale, angle = error[:, i].T
        axes.plot(100 * scale, 1e3 * angle, marker, ms=4, alpha=0.7, mec="none", label=name)
    axes.set(title=f"camera {i + 2}", xlabel="error of scale (%)")
panels[0].set_ylabel("error of angle (mrad)")
fig.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
caption = (
    f"Errors of the learned cameras in repeated trials with {pixel_noise:g} px noise: the joint fit is closer."
)
save_figure("cameras_trials", fig, caption=caption, numbers=errors)

# %% [markdown]
# *Each point is one trial with such noise: with the epipolar condition (vermilion), scales and angles of the
# learned cameras scatter less than by Eq. (4) alone (blue).*

# %% [markdown]
# ## Noise in the regressors
#
# Pixels stand on both sides of Eq. (4): as data of camera 1, but as *regressors* for cameras 2 and 3.
# Noise in a regressor pulls its coefficient towards zero (attenuation), here the scale, by about
# $\sigma^2/\operatorname{var}(\mathbf x_c)$. This is no scatter that more frames would average out. The
# reprojection error has the noise where it belongs, in every pixel alike, and no such bias.

# %%
# Up to 10 px, or to a fifth of the smallest motion: the rest hides it.
noise = np.array([0.03, 0.1, 0.3, 1.0]) * min(10.0, np.std(tracks, axis=1).min() / 5)
repeats = max(trials // 2, 10)
scale_errors = {
    name: np.array([errors_of(name, sigma, repeats)[:, 1, 0] for sigma in noise])
    for name in errors
}
bias = {name: np.nanmean(error[-1]) for name, error in scale_errors.items()}
assert abs(bias["joint fit"]) < abs(bias["Eq. (4)"])

# %% tags=["hide-input"] jupyter={"source_hidden": true}
fig, (left, right) = plt.subplots(1, 2, figsize=(9, 3.8))
for (name, error), style in zip(scale_errors.items(), ("s-", "o-"), strict=True):
    left.loglog(noise, 100 * np.sqrt(np.nanmean(error**2, axis=1)), style, label=name)
    deviation = np.nanstd(error, axis=1) / np.sqrt(repeats)
    right.errorbar(noise, 100 * np.nanmean(error, axis=1), 200 * deviation, fmt=style, label=name)
right.axhline(0, color="k", lw=0.6)
left.set(title="rms error", ylabel="rms error of scale (%)")
right.set(title="bias", ylabel="mean error of scale (%)", xscale="log")
for axes in (left, right):
    axes.set_xlabel("noise per pixel coordinate (px)")
    axes.set_xticks(noise, [f"{value:.2g}" for value in noise])
    axes.minorticks_off()
right.legend(loc="lower left")
caption = (
    "Scale of camera 3: rms and mean error over repeated trials; Eq. (4) shrinks it with noise."
)
save_figure("cameras_noise", fig, caption=caption, numbers={"noise": noise, **scale_errors})

# %% [markdown]
# *Scale of camera 3 over repeated trials (bars: two standard errors of the mean). Eq. (4) shrinks the
# scale systematically from a few pixels of noise on; the joint fit scatters around the truth.*

# %% [markdown]
# ## The path in space, Eq. (6)
#
# With all cameras known, each frame is a small least-squares problem; we weight every view by $1/s_i$, so
# that all count in pixels. Videos of 512 x 512 whole pixels are the paper's case ("camera pixels can
# only take approximate integer values"): rounding alone has a standard deviation of
# $1/\sqrt{12}=0.29$ px per coordinate.

# %%
learned = learn_cameras(rounded, start)
found = reconstruct(rounded, learned)
rmse = np.sqrt(np.mean((found - x) ** 2, axis=0)) / pixel
print("3D rmse (px):", rmse.round(3))
known = np.sqrt(np.mean((reconstruct(rounded, truth) - x) ** 2, axis=0)) / pixel  # by the true cameras
assert rmse.max() <= 0.35
assert (rmse < 1.1 * known).all()

# %%
fig = plots.plot_reconstruction(t, x, found, pixel)
caption = "Path in space from whole pixels and one calibrated camera: about 0.2 px off."
save_figure(
    "cameras_reconstruction", fig, caption=caption, numbers={"t": t, "x": x, "found": found}
)

# %% [markdown]
# *From whole pixels and one calibrated camera, the path (colours) lies on the truth (grey); the error,
# below, is about 0.2 px rms.*

# %% [markdown]
# And with more noise in the pixels? Cameras and path are learned anew for each level, with the same draw times the level.

# %%
draws = [np.random.default_rng(seed + i).normal(size=track.shape) for i, track in enumerate(tracks)]
part, figures, off = slice(0, 150), {}, {}
for level in (0, 0.25, 0.5, 1, 2, 4, 8):
    observed = [track + level * draw for track, draw in zip(tracks, draws, strict=True)]
    path = reconstruct(observed, learn_cameras(observed, start))
    off[level] = np.sqrt(np.mean((path - x) ** 2)) / pixel
    fig = plots.plot_reconstruction(t[part], x[part], path[part], pixel)
    fig.axes[1].set_ylim(-20, 20)
    figures[f"noise of {level} px"] = fig
assert all(off[level] < level for level in off if level)
print("rms error of the path over the noise:", *(f"{off[level] / level:.2f}" for level in off if level))
caption = "Path in space (above) and its error (below) as the noise of the pixels grows."
save_slider("cameras_noise_slider", figures, caption=caption, numbers={"noise": list(off), "rmse": list(off.values())})

# %% [markdown]
# *Move the slider: noise in the pixels comes through in space, weakened to the share that is printed above: three views share one point.*

# %% [markdown]
# The truth is not known with real videos, but the **residuals** are: by how many pixels the
# reconstructed point misses each track. Three of the six numbers of a frame are used up by the point, so
# noise of $\sigma$ leaves $\sigma/\sqrt2$.

# %%
for name, observed, sigma in (("rounded", rounded, 12**-0.5), ("noisy", noisy, pixel_noise)):
    missed = np.hstack(residuals(observed, learn_cameras(observed, start)))
    print(f"{name}: rms {np.sqrt(np.mean(missed**2)):.3f} px, expected {sigma / 2**0.5:.3f} px")
    assert np.isclose(np.sqrt(np.mean(missed**2)), sigma / 2**0.5, rtol=0.1)

# %% [markdown]
# ## Lost views
#
# Trackers lose targets. Eq. (4) needs all three views in a frame; the joint fit takes any two. In the
# extreme, *every* frame misses one camera in turn:

# %%
gappy = [track.copy() for track in tracks]
for i, track in enumerate(gappy):
    track[i::3] = np.nan
learned = learn_cameras(gappy, start)
assert np.abs(cameras.calibration_errors(learned, truth)).max() < 1e-9
assert np.allclose(reconstruct(gappy, learned), x, atol=1e-6)

# %% [markdown]
# And Eq. (4) says that it has nothing to go by:

# %%
try:
    cameras.learn_cameras_eq4(gappy, start)
except ValueError as error:
    message = str(error)
print(message)
assert "got 0" in message

# %% [markdown]
# ## When the tracks cannot tell
#
# Calibration needs motion. For a target that hardly moves, the equations still have a solution, made
# of noise; `learn_cameras` compares the motion that tells each parameter with the misfit, and refuses. (The message
# counts from 0: `cameras[1]` and `cameras[2]` are the second and the third.)

# %%
still = [track[:1] + 0.3 * rng.normal(size=track.shape) for track in tracks]
try:
    learn_cameras(still, start)
except ValueError as error:
    message = str(error)
print(message)
assert "cameras[1] and cameras[2]" in message

# %% [markdown]
# ## Measured by hand
#
# So far all normals were exact. By eye one is off by a degree; then the views contradict each other, and no scale or
# angle mends it. But a rig file may say how good each number is: `normal_error` in degrees, `position_error`,
# `scale_error`. Then cameras and path are found together, from the same start, by the smallest
#
# $$\sum_{i,n}\frac{\|\mathbf z_{in}-\mathbf P_i(\mathbf x_n,\mathbf p)\|^2}{\sigma^2}+\sum_k\frac{p_k^2}{\epsilon_k^2},$$
#
# where $\mathbf z_{in}$ is the track of camera $i$ in frame $n$, $\mathbf P_i$ what it would see of the point $\mathbf x_n$, and $p_k$ the
# changes of what was measured with the errors $\epsilon_k$: a **bundle adjustment**, with the measurements as priors.

# %%
hand = np.random.default_rng([seed, 1])
tilts = np.deg2rad(1) / np.sqrt(2) * hand.normal(size=(len(start.cameras), 2))
pairs = list(zip(start.cameras, tilts, strict=True))
by_eye = [replace(camera, normal=camera.normal + by @ camera.rows) for camera, by in pairs]
left, off = [], []
for name, error in {"exact": 0.0, "good to a degree": 1.0}.items():
    rig = learn_cameras(rounded, Rig([replace(camera, normal_error=error) for camera in by_eye]))
    left.append(np.sqrt(np.mean(np.hstack(residuals(rounded, rig)) ** 2)))
    views = zip(rig.cameras, truth.cameras, strict=True)
    sines = [np.linalg.norm(np.cross(camera.normal, true.normal)) for camera, true in views]
    off.append(np.rad2deg(max(sines)))
    print(f"normals taken as {name}: off by {off[-1]:.2f} degrees, residuals of {left[-1]:.1f} px")
assert left[1] < left[0] / 3
assert off[1] < off[0] / 3

# %% [markdown]
# A few hundred frames measure a normal better than an eye. What stays uncertain goes with the path into the law:
# its errors are counted among those of the coefficients. So the law is the true one, in the frame of a rig that was measured by eye,
# and its error bars say what that costs: below, in units of them, how far its coefficients are from the true ones.

# %%
measured = Rig([replace(camera, normal_error=1.0) for camera in by_eye])
found = discover_from_tracks(rounded, measured, t, lags=[0.0] * len(rounded))
print(found.discovery)
true = SYSTEMS[system].shift(REFERENCE_OFFSET)
print("terms that are not there:", *(term_errors(found.discovery.system, true)[1] or ["none"]))
rows = dict(zip(true.terms, true.coefficients, strict=True))
there = np.array([rows.get(term, np.zeros(3)) for term in found.discovery.terms])
kept = found.discovery.system.support
apart = np.abs(found.discovery.coefficients - there)[kept] / found.discovery.standard_errors[kept]
print("coefficients in standard errors from the true ones:", *apart.round(1))
assert apart.max() < 4
size = np.sqrt(np.mean(np.sum(found.systematic**2, axis=(0, 2)))) / pixel
print(f"what is not known of the cameras (`found.systematic`, {len(found.systematic)} causes) may move the path by {size:.2f} px")

# %% [markdown]
# ## How many pixels, how many cameras?
#
# The paper films with three cameras of 512 x 512 pixels. What do other rigs cost, path and law? Tracks in whole pixels, one
# calibrated camera; beyond the third, cameras stand between the others.


# %%
def rig_of(x, count, pixels):
    three, middle = Rig.around(x, (pixels, pixels)).cameras, (x.min(axis=0) + x.max(axis=0)) / 2
    turn = Rotation.from_euler("z", 60, degrees=True).as_matrix()
    between = [replace(c, normal=turn @ c.normal, position=middle + turn @ (c.position - middle)) for c in three]
    return Rig([*three, *between][:count])


def filmed_by(name, count, pixels):
    law = SYSTEMS[name].shift(REFERENCE_OFFSET)
    times, path = law.trajectory(frames)
    rig = rig_of(path, count, pixels)
    seen = [np.round(camera.project(path)) for camera in rig.cameras]
    found = discover_from_tracks(seen, rig.uncalibrated(keep=0), times, lags=[0.0] * count)
    missed = np.sqrt(np.mean((found.x - path) ** 2) / np.mean(path.var(axis=0)))
    scored = score(found.discovery, law)
    return missed, scored.l2, scored.exact


# %%
names = list(SYSTEMS) if profile == "full" else [system]
rigs = [(3, 128), (3, 256), (3, 512), (3, 1024), (2, 512), (4, 512), (5, 512)]
results = {rig: np.array([filmed_by(name, *rig) for name in names]) for rig in rigs}
rows = [
    {
        "cameras": count, "pixels": f"{pixels} x {pixels}", "path, error / spread (%)": round(100 * np.median(missed), 2),
        "law, l2 (e-2)": significant(100 * np.median(l2), 1), "exact": rate(exact),
    }
    for (count, pixels), (missed, l2, exact) in ((rig, result.T) for rig, result in results.items())
]  # fmt: skip
caption = "Other images and other numbers of cameras, whole pixels: medians of the systems (spread: standard deviation), and how many laws are exact."
loose = dict.fromkeys(["path, error / spread (%)", "law, l2 (e-2)"], 0.2)
save_table("cameras_rigs", rows, caption=caption, tolerance=loose)

# %%
path_error = {rig: np.median(result[:, 0]) for rig, result in results.items()}
halved = [path_error[3, pixels] / path_error[3, 2 * pixels] for pixels in (128, 256, 512)]
assert np.allclose(halved, 2, rtol=0.25)
assert np.all(np.diff([path_error[count, 512] for count in (2, 3, 4, 5)]) < 0)
assert all(result[:, 2].mean() >= 0.8 for result in results.values())
law_error = {rig: np.median(result[:, 1]) for rig, result in results.items()}
print(f"from 128 to 1024 pixels the law's error falls {law_error[3, 128] / law_error[3, 1024]:.0f}-fold")
assert law_error[3, 128] > law_error[3, 1024]

# %% [markdown]
# *Twice the pixels halve the error of the path, and a further camera averages rounding away, slowly. The coefficients follow, roughly,
# the path; the terms of the law hold from 128 x 128 pixels and from two cameras on, because all frames share them.*

# %% [markdown]
# ## What we learned
#
# * Scale and angle of the unknown cameras follow from **one linear solve**; gradients and a starting
#   guess are not needed, and exact pixels give exact cameras.
#   <!-- by: np.abs(cameras.calibration_errors(learned, truth)).max() < 1e-9 -->
# * Eq. (4) uses two of the three conditions per frame. The third, between the two unknown cameras, makes
#   the estimate closer, and lets it work when no frame has all three views.
#   <!-- by: np.linalg.matrix_rank(eq_4) == len(stack); (deviation["joint fit"] < by_chance * deviation["Eq. (4)"] + 1e-9).all(); "got 0" in message; np.allclose(reconstruct(gappy, learned), x, atol=1e-6) -->
# * Noisy pixels bias the closed form; the least reprojection error does not have this bias. At the
#   rounding of whole pixels the difference is negligible, from a few pixels on it is not.
#   <!-- by: abs(bias["joint fit"]) < abs(bias["Eq. (4)"]); figure cameras_noise -->
# * Whole pixels cost about 0.2 px in space, nearly all of it the rounding of the views
#   themselves, hardly any of it the learned cameras.
#   <!-- by: rmse.max() <= 0.35; np.isclose(np.sqrt(np.mean(missed**2)), sigma / 2**0.5, rtol=0.1) -->
# * Normals that are off by a degree contradict each other by pixels. Where the rig file says that they are uncertain,
#   the motion finds them.
#   <!-- by: left[1] < left[0] / 3; off[1] < off[0] / 3 -->
# * The error of the path falls with the size of a pixel and with the number of cameras; coefficients follow it, and
#   the terms stay right in most systems.
#   <!-- by: np.allclose(halved, 2, rtol=0.25); law_error[3, 128] > law_error[3, 1024]; np.diff([path_error[count, 512]; result[:, 2].mean() >= 0.8 -->
#
# **What the paper says and what we found.** The paper finds the cameras "via optimization" of Eq. (4), and writes inverses
# in Eq. (5) and (6); what Eq. (4) squares is linear in four numbers, and the inverses are least squares. Gradients end at the
# same cameras, as the table of methods shows.
# <!-- by: figure cameras_methods; np.allclose(np.linalg.pinv(stack) @ stack -->
#
# Next: [splines and alternating optimisation](04_spline_ado.ipynb), from the path to its law.

# %% [markdown]
# ## Exercises
#
# [Four exercises](exercises/03_camera_learning.ipynb), each with a blank cell and a check that says *right* or fails. Their
# [solutions](solutions/03_camera_learning.ipynb) lie apart.

# %% [markdown]
# ## Run time and versions
#
# All cells take about 1 minute on two cores, beside two other notebooks.

# %%
print(versions())
