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
# # The realistic scene: a tumbling target behind trees
#
# In this notebook, we present the hardest videos of the paper: an irregular target tumbles and
# changes in size, the images are noisy, and a tree stands in the way, here of every camera. From them
# the equations are discovered as before, by the same calls.
#
# **What you will see**
#
# * the scene, with the tracks over the frames;
# * what the tracker says of a target that vanishes behind a tree, and how fast it is found again;
# * the reconstructed path with its gaps;
# * the equations, term by term with standard errors, in five trials.
#
# **Afterwards you can** follow a target that vanishes, and see what its gaps cost the law.
#
# **What you need**: the [tour](00_tour.ipynb); how the target is tracked is the subject of
# [notebook 02](02_videos_and_tracking.ipynb).
#
# **Covers** Fig. 4 and Appendix "Simulating Realistic Scenarios".

# %% tags=["parameters"]
profile: str = "full"  # full or quick
seed: int = 0  # number of the first trial: seeds targets, backgrounds, trees and noise
jobs: int = 2  # trials at a time

# %%
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
from joblib import Parallel, delayed
from tqdm import tqdm

# %%
from vidsindy_lite import (
    Rig,
    Scene,
    discover,
    observe,
    observe_tracks,
    read_frame,
    render_video,
    track,
    vision,
    write_video,
)
from vidsindy_lite.companion.artifacts import save_figure, save_table, versions
from vidsindy_lite.study import (
    LEAST,
    REFERENCE_OFFSET,
    SYSTEMS,
    plots,
    pulls,
    score,
    significant,
)

plt.style.use("vidsindy_lite.study.plots.vidsindy")
full = profile == "full"
frames = 400 if full else 160
trials = range(seed, seed + (5 if full else 1))

# %% [markdown]
# ## The scene
#
# The paper takes SprottF and lets it start at (-1.17, -1.1, 1). Every camera sees a target of irregular
# shape that turns at random, changes in size as if it came nearer and receded, and is covered by image
# noise of variance 0.01 (for intensities from 0 to 1). All else that the paper leaves open is drawn at
# random: shape and colour of the target, backgrounds, the trees and where they stand.

# %%
START = (-1.17, -1.1, 1.0)  # in the native frame
DISTURBANCES = {"shape": "irregular", "tumbling": 1.0, "size_variation": 0.25, "noise_variance": 0.01}
print(SYSTEMS["SprottF"].text(), f"from {START}", sep="\n")
for name, value in DISTURBANCES.items():
    print(f"{name:15} {value}")

# %% [markdown]
# One such film by hand, with plain calls: three scenes with a tree each, the videos drawn, observed, and the law found.

# %%
truth = replace(SYSTEMS["SprottF"], x0=START).shift(REFERENCE_OFFSET)
t, x = truth.trajectory(250 if full else 160)
rig = Rig.around(x)
with TemporaryDirectory() as folder:
    paths = [Path(folder) / f"{number}.mov" for number in (1, 2, 3)]
    for number, (path, camera) in enumerate(zip(paths, rig.cameras, strict=True)):
        tree = (170 + 50 * number, 180, 120, 332)  # left, top, width, height
        scene = Scene(background="hills", size=28, trees=(tree,), **DISTURBANCES)
        render_video(path, camera.project(x), scene, seed=3 * seed + number)
    seen = observe(paths, rig.uncalibrated(keep=0), t, lags=(0, 0, 0))
law = discover(t, seen.x, systematic=seen.systematic)
print(f"lost: {np.isnan(seen.x[:, 0]).mean():.0%} of the path", law.equations("native"), sep="\n")
assert score(law, truth).exact

# %% [markdown]
# Each trial has another scene: one target before three backgrounds, and before each of them a tree.

# %%
def scenes(number):
    """What each camera sees, and what seeds tumbling and noise in it."""
    target, *streams = np.random.SeedSequence(number).spawn(4)
    drawn = Scene.random(np.random.default_rng(target), **DISTURBANCES)
    common = DISTURBANCES | {"colour": drawn.colour, "shape_seed": drawn.shape_seed}
    for stream in streams:
        rng = np.random.default_rng(stream)
        left = round((0.5 + rng.uniform(-0.12, 0.12)) * 512 - 123 / 2)  # somewhere near the middle
        tree = (left, 512 - 338, 123, 338)
        scene = Scene.random(rng, **common, trees=(tree,), image_size=(512, 512), size=0.055 * 512)
        yield scene, int(rng.integers(2**31))


# %% [markdown]
# The renderer says with each frame which share of the target can be seen.

# %%
def filmed(pixels, scene, seed):
    """Film pixels before a scene, and track them in the video file."""
    shares = []

    def images():
        for drawn in vision.render_labelled(pixels, scene, seed):
            shares.append(drawn.visible)
            yield drawn.frame

    with TemporaryDirectory() as folder:
        video = write_video(Path(folder) / "view.mov", images())
        found = track(video)
        seen = np.flatnonzero(np.isfinite(found.pixels).all(axis=1))
        shown = int(seen[len(seen) // 2])
        return found, np.array(shares), shown, read_frame(video, shown)


# %% [markdown]
# From the videos to the law. Nothing is told but the times of the frames, where the cameras stand, and the calibration of
# the first.

# %%
def watched(pixels, scene, seed):
    found, visible, shown, image = filmed(pixels, scene, seed)
    errors = np.linalg.norm(found.pixels - pixels, axis=1)
    about = {"scene": scene, "track": found, "errors": errors, "shown": shown, "image": image}
    return SimpleNamespace(**about, visible=visible, hidden=visible < 0.01)  # but for a pixel


def run_scene(number):
    t, x = truth.trajectory(frames)
    rig = Rig.around(x)
    views = [watched(c.project(x), *scene) for c, scene in zip(rig.cameras, scenes(number), strict=True)]
    seen = observe_tracks([one.track.pixels for one in views], rig.uncalibrated(keep=0), t, lags=(0, 0, 0))
    began = perf_counter()
    found = discover(t, seen.x, seed=number, systematic=seen.systematic)
    about = {"t": t, "x": x, "path": seen.x, "truth": truth, "seconds": perf_counter() - began}
    return SimpleNamespace(**about, views=views, found=found, score=score(found, truth))


# %%
work = Parallel(n_jobs=jobs, return_as="generator")(delayed(run_scene)(n) for n in trials)
runs = list(tqdm(work, total=len(trials), desc="trials"))
first = runs[0]

# %%
images = [view.image for view in first.views]
tracks = [view.track.pixels for view in first.views]
titles = [f"camera {i}" for i in (1, 2, 3)]
fig = plots.plot_frames(images, titles, tracks, [view.shown for view in first.views])
caption = "The realistic scene: one frame of each video, with the track of the target."
save_figure("fig_4a", fig, caption=caption, numbers=dict(zip(titles, tracks, strict=True)))

# %% [markdown]
# *Fig. 4a: one frame of each video of the first trial, with the track over it and the target magnified.
# The track breaks off where the tree is.*

# %% [markdown]
# ## Behind the tree
#
# A tracker may lose what it cannot see. It must not invent it, and it should find it again. The target
# may also be seen in part, through the leaves or beside the trunk; what can be seen then has another
# centroid than the target, so these views are not trusted either.
# A view is also doubted where its background, seen through this noise, is too plain to tell a camera that moves.

# %%
views = [view for run in runs for view in run.views]
assert all(view.track.detector == "background" for view in views)
told = [doubt for view in views for doubt in view.track.warnings]
print(*told, sep="\n")
assert all("the target is lost in" in doubt or "too plain to tell" in doubt for doubt in told)
assert len(told) <= len(views) // 2

# %% tags=["hide-input"] jupyter={"source_hidden": true}
fig, panels = plt.subplots(3, 1, figsize=(9, 4.6), sharex=True, sharey=True)
for axes, title, view in zip(panels, titles, first.views, strict=True):
    share = view.visible
    axes.fill_between(np.arange(len(share)), share, color="0.85", step="mid", label="visible share")
    axes.plot(view.track.confidence, color="C0", lw=1, label="confidence of the tracker")
    axes.set(ylabel=title, ylim=(0, 1.05))
panels[-1].set(xlabel="frame", xlim=(0, len(share) - 1))
fig.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
caption = "How much of the target can be seen, and how sure the tracker is."
numbers = {title: view.track.confidence for title, view in zip(titles, first.views, strict=True)}
save_figure("scene_confidence", fig, caption=caption, numbers=numbers)

# %% [markdown]
# *Where the tree hides the target (white between the grey), or shows a part of it only, the confidence is nil; of whole views it is
# nearly one.*

# %%
def delays(view):
    """Whole views after each time that it was hidden, until it is found again."""
    whole, found = view.visible > 0.999, np.isfinite(view.errors)
    ends = np.flatnonzero(view.hidden[:-1] & ~view.hidden[1:]) + 1
    back = [end + np.argmax(np.append(found[end:], True)) for end in ends]
    return [int(whole[end:again].sum()) for end, again in zip(ends, back, strict=True)]


# %%
rows = []
for n, trial in zip(trials, runs, strict=True):
    for i, view in enumerate(trial.views, start=1):
        error, hidden = view.errors, view.hidden
        rows.append({
            "trial": n, "camera": i, "background": view.scene.background,
            "hidden (%)": 100 * hidden.mean(),
            "found while hidden": int(np.isfinite(error[hidden]).sum()),
            "frames until found again": max(delays(view), default=0),
            "found (%)": 100 * np.isfinite(error).mean(),
            "rms error (px)": np.sqrt(np.nanmean(error**2)),
            "largest error (px)": np.nanmax(error),
        })  # fmt: skip
loose = dict.fromkeys(["rms error (px)", "largest error (px)"], 0.2)
save_table("scene_tracks", rows, caption="Tracks of the realistic scene, by trial and camera.", tolerance=loose)

# %%
assert sum(row["hidden (%)"] > 0 for row in rows) > len(rows) / 2
assert all(row["found while hidden"] == 0 for row in rows)
assert all((view.track.confidence[view.hidden] < 0.05).all() for view in views)
assert all(row["frames until found again"] <= 10 for row in rows)
assert all(row["rms error (px)"] < 0.5 for row in rows)

# %% [markdown]
# Not one position is invented while the target is hidden. The others are good to about a tenth of a
# pixel; larger errors are rare. Views in which a little of the target is missing can hardly be told from
# whole ones in this noise.

# %%
error = np.concatenate([view.errors for view in views])
whole = np.concatenate([view.visible == 1 for view in views])
off = np.mean(error[np.isfinite(error)] > 0.5)
print(f"off by more than half a pixel: {off:.2%}; largest error {np.nanmax(error):.2f} px, "
      f"of whole views {np.nanmax(error[whole]):.2f} px")  # fmt: skip
assert np.sqrt(np.nanmean(error**2)) < 0.15
assert off < 0.01

# %% [markdown]
# ## The path
#
# Two cameras suffice for a point in space. So a single tree makes no gap; the shaded intervals are those
# in which two trees, or the views that were not trusted, leave fewer than two.

# %%
gap = np.isnan(first.path).any(axis=1)
alone = [np.isnan(view.track.pixels).any(axis=1).mean() for view in first.views]
print(
    f"no position in {gap.mean():.0%} of the frames; single cameras: {', '.join(f'{a:.0%}' for a in alone)}"
)
error = np.sqrt(np.nanmean((first.path - first.x) ** 2, axis=0))
print(
    f"rms error of the path: {error.round(4)} scene units, standard deviation of the motion: {first.x.std(axis=0).round(2)}"
)
assert 0 < gap.mean() < np.mean(alone)
assert (error < 0.01 * first.x.std(axis=0)).all()

# %%
both = {"truth": first.x, "reconstructed": first.path}
fig = plots.plot_path(first.t, both, "hidden", plots.DASHED, "time units")
caption = "The reconstructed path of the realistic scene; shaded: fewer than two cameras see it."
save_figure(
    "fig_4b", fig, caption=caption, numbers={"t": first.t, "path": first.path, "truth": first.x}
)

# %% [markdown]
# *Fig. 4b: the reconstructed path over time and in space, with the truth (dashed). Shaded: no two cameras
# found the target.*

# %% [markdown]
# ## The equations
#
# Gaps are left out, not filled: the spline has one piece for each stretch of data, and the law that all
# pieces obey carries the curve across ([notebook 04](04_spline_ado.ipynb)).

# %%
print(
    f"native frame, offset {first.found.offset.round(4)}:",
    first.found.equations("native"),
    sep="\n",
)
print(
    "\nin the frame of the cameras:",
    first.found.equations(),
    "\ntruth:",
    first.truth.text(),
    sep="\n",
)

# %%
fig = plots.plot_coefficients(first.found, first.truth)
caption = (
    "Distance of each coefficient from the truth, in millionths of it; bars: one standard error."
)
save_figure(
    "scene_coefficients", fig, caption=caption, numbers={"pulls": pulls(first.found, first.truth)}
)

# %% [markdown]
# *How far each coefficient is from the truth, with its standard error. They lean together, for a small
# error of the learned cameras is one error of all coefficients.*

# %%
rows = [
    {
        "trial": n, "exact terms": trial.score.exact,
        "l2 (e-2)": significant(100 * trial.score.l2, least=100 * LEAST),
        "worst coefficient (%)": significant(100 * trial.score.max_coefficient_error),
        "gaps (%)": 100 * np.isnan(trial.path).any(axis=1).mean(),
        "status": trial.found.status, "seconds": trial.seconds,
    }
    for n, trial in zip(trials, runs, strict=True)
]  # fmt: skip

# %%
save_table(
    "scene_equations",
    rows,
    caption="Laws discovered from the realistic scene, by trial; 0.001 (e-2) is 0.001 or less.",
    tolerance={"l2 (e-2)": 0.2, "worst coefficient (%)": 0.2},
)

# %%
for n, trial in zip(trials, runs, strict=True):
    print(f"trial {n}:", trial.found.status, *trial.found.warnings)
assert all(trial.score.exact for trial in runs)
assert all(trial.score.l2 <= 1e-2 for trial in runs)

# %% [markdown]
# All trials are exact. Where one is *suspect* all the same, a warning under it says which other law fits as well.

# %% [markdown]
# ## What we learned
#
# * Tumbling, change of size, image noise and trees leave the terms as they are: in every trial exactly
#   those of SprottF, with a relative error below a percent.
#   <!-- by: all(trial.score.exact for trial in runs); all(trial.score.l2 <= 1e-2 for trial in runs) -->
# * The tracker says when it does not know: nothing is found while the target is hidden, and it is found
#   again within ten whole views.
#   <!-- by: row["found while hidden"] == 0; row["frames until found again"] <= 10 -->
# * Three cameras are more than the geometry needs. What one of them loses the other two replace.
#   <!-- by: 0 < gap.mean() < np.mean(alone) -->
#
# **What the paper says and what we found.**
#
# * The paper shows that the equations can be found under these conditions and prints neither them nor
#   their errors, so there is no number to compare with. Here they are found in every trial.
#   <!-- by: all(trial.score.exact for trial in runs); docs/paper.md -->
# * It says that the path is reconstructed "from sparse observation points", and its law found. So it is here; what makes
#   it possible is that gaps are no obstacle for a law, as long as it can be carried across them.
#   <!-- by: figure scene_equations; (error < 0.01 * first.x.std(axis=0)).all() -->

# %% [markdown]
# ## Exercises
#
# [Three exercises](exercises/07_realistic_scene.ipynb), each with a blank cell and a check that says *right* or fails. Their
# [solutions](solutions/07_realistic_scene.ipynb) lie apart.

# %% [markdown]
# ## Run time and versions
#
# All cells take about 2 minutes on two cores, beside two other notebooks.

# %%
print(versions())
