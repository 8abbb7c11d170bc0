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
# # Solutions: One telephone: a throw, a swing, and a length in the picture
#
# Questions to [the notebook](../13_one_telephone.ipynb). Write into the blank cells of the
# [exercises](../exercises/13_one_telephone.ipynb), and run the check behind each: it says *right*, or fails. The
# [solutions](../solutions/13_one_telephone.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
from tempfile import TemporaryDirectory

import numpy as np

from vidsindy_lite import Scene, discover_from_video, render_video, track

folder, fps, metre = TemporaryDirectory(), 30, 200  # metre: pixels
t = np.arange(27) / fps
rng = np.random.default_rng(seed)
start = np.array([rng.uniform(2, 3), rng.uniform(4.5, 5.5)])  # m/s
thrown = np.outer(t, start) - np.outer(t**2, (0, 9.81 / 2))
film = f"{folder.name}/throw.mkv"
render_video(film, [60, 330] + metre * thrown * [1, -1], Scene("bricks", image_size=(640, 360)), fps, seed)
stick = (60, 330, 60, 330 - metre, 1.0)  # two marks and the metres between them
flight = discover_from_video(film, length=stick)
print(flight.g)

# %% [markdown]
# **1.** (Prove.) Somebody films in slow motion, at 120 frames a second, and the file says 30. Set `factor` to the
# $g$ that comes out over the true one. (Then see what `discover_from_video(film, length=stick, fps=7.5)` makes of the film above,
# which says that it has a quarter of its frames a second.)

# %% tags=["solution"]
factor = (30 / 120) ** 2

# %%
slow = discover_from_video(film, length=stick, fps=7.5)
assert np.isclose(slow.g.value / flight.g.value, factor, rtol=0.05), "not yet"
print(slow.status, *slow.warnings, sep="\n")
print("right")

# %% [markdown] tags=["solution"]
# Times are four times as long, and $g$ has the unit m/s$^2$: a sixteenth. Of a swing, the period would be four times
# as long. The program doubts the $g$ and names the frame rate as one of the causes.

# %% [markdown]
# **2.** (Implement.) Find $g$ without the package, but for its tracker: `track(film).pixels` are the pixels (u, v) of
# the ball, `metre` says how many of them a metre has, `fps` how many frames a second. Name it `by_hand`.

# %% tags=["solution"]
u, v = track(film).pixels.T
seen = np.isfinite(v)
by_hand = 2 * np.polyfit(np.arange(len(v))[seen] / fps, v[seen], 2)[0] / metre
print(f"{by_hand:.2f}")

# %%
assert abs(by_hand / flight.g.value - 1) < 0.03, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# $v$ points down, so $v=v_0+\dot v_0t+\frac g2t^2$ with $g$ in pixels, and a parabola through the track has it. What
# the package adds: whether a parabola is right at all, the direction of the pull, and the error bar.

# %% [markdown]
# **3.** (Explore.) Film a stone that sinks in water: its acceleration is $9.81\,(1-\rho_w/\rho)$ and the water takes
# its speed with a drag of 3 per second. Simulate places for 0.9 s, from rest, for a stone with $\rho=2.5\,\rho_w$,
# draw the film as above, but with `"pool.mkv"` and from high enough in the picture (`[60, 50]` in place of `[60,
# 330]`), and name what `discover_from_video` finds `sunk`. What is the law, and what does its `status` say?

# %% tags=["solution"]
pull, drag = 9.81 * (1 - 1 / 2.5), 3.0
depth = pull / drag * (t - (1 - np.exp(-drag * t)) / drag)
places = np.column_stack([0.3 + 0 * t, -depth])
pool = f"{folder.name}/pool.mkv"
render_video(pool, [60, 50] + metre * places * [1, -1], Scene("bricks", image_size=(640, 360)), fps, seed)
sunk = discover_from_video(pool, length=stick)
print(sunk, sunk.status, sep="\n")

# %%
assert sunk.status == "suspect", "not yet"
assert np.nanmax(sunk.x[:, 1]) - np.nanmin(sunk.x[:, 1]) > 0.5, "not yet: it hardly moves"
folder.cleanup()
print("right")

# %% [markdown] tags=["solution"]
# The law is right, a pull of 5.89 and a drag of 3 per second. But the pull is not the 9.81 of what falls freely, so
# it is doubted: the program cannot know that there is water. A doubt is a question to you, not a verdict.
