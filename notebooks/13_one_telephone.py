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
# # One telephone: a throw, a swing, and a length in the picture
#
# In this notebook, we present what a class can do with one telephone: film a throw and a swing, and read $g$, a
# period and a law from the films.
#
# **What you will see**
#
# * a throw that is filmed from the hand, and $g$ from it;
# * a swing, its law, its length and its period;
# * what happens if the length in the picture is given wrong;
# * a forecast of the second half of a film from its first half.
#
# **Afterwards you can** film a motion in a plane, find its law, and say which of its numbers need a length.
#
# **What you need**: Newton's second law.
#
# **Covers** nothing in the paper, which films with three cameras and leaves real film to future work, but for a ball that
# rolls ([notebook 08](08_lab_experiment.ipynb)). The films of this page are drawn.

# %% tags=["parameters"]
profile: str = "full"  # full or quick
fps: int = 30  # frames a second of the films
seed: int = 0  # of the wall, the hand, and how well the length is measured

# %%
from itertools import islice
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

from vidsindy_lite import (
    Library,
    PolynomialSystem,
    Scene,
    discover_from_video,
    read_frame,
    read_video,
    vision,
    write_video,
)
from vidsindy_lite.companion.artifacts import save_figure, save_table, versions

plt.style.use("vidsindy_lite.study.plots.vidsindy")
full = profile == "full"
folder = TemporaryDirectory()
rng = np.random.default_rng(seed)
g, size = 9.81, (960, 540) if full else (512, 288)

# %% [markdown]
# ## Two films
#
# We have no telephone here, so we draw what one would film: a red ball before a wall of bricks, at a telephone's
# frame rate, compressed by H.264. The hand that holds the telephone trembles: the view wanders over the wall by some pixels.
#
# `place` says where a point of the plane, in metres, is seen in the first frame.

# %%
def place(x, zero, metre):
    """Pixels (u right, v down) of places in metres (x right, y up)."""
    return np.array(zero) * size + metre * size[1] * np.array(x) * [1, -1]


def shoot(name, pixels):
    """A film of a ball that is seen there, by a telephone in the hand."""
    t, turns = np.arange(len(pixels)) / fps, rng.uniform(0, 1, (3, 2))
    waves = np.sin(2 * np.pi * (np.outer([0.3, 1.1, 4.0], t)[..., None] + turns[:, None]))
    hand = np.einsum("k,ktj->tj", np.array([5, 2, 0.5]) * size[1] / 540, waves)
    hand = np.rint(hand - hand[0]).astype(int)
    wall = Scene("bricks", size=size[1] / 20, image_size=size)
    frames = vision.render_restless(pixels - hand, wall, hand, seed=seed)
    return write_video(f"{folder.name}/{name}.mp4", frames, fps, codec="H264")


# %% [markdown]
# The throw lasts nine tenths of a second. The swing is a ball on a string of 0.8 m, let go at 0.7 rad; the air
# takes a little of its speed.

# %%
t = np.arange(0, 0.9, 1 / fps)
thrown = np.column_stack([2.4 * t, 5.0 * t - g * t**2 / 2])
throw = shoot("throw", place(thrown, (0.12, 0.85), 0.45))

# %%
string, sines = 0.8, Library.polynomial(1) + Library.fourier(1)
hung = {"x": {"vx": 1.0}, "vx": {"sin(x)": -g / string, "vx": -0.1}}
pendulum = PolynomialSystem.from_terms(hung, library=sines)
s = np.arange(0, 5.0 if full else 3.0, 1 / fps)
angle = pendulum.simulate(s, np.array([0.7, 0.0]))[:, 0]
swung = string * np.column_stack([np.sin(angle), -np.cos(angle)])
swing = shoot("swing", place(swung, (0.5, 0.08), 0.95))

# %% [markdown]
# ## A length in the picture
#
# A film has pixels, and $g$ is in metres. So something of known length has to be in the picture, as far away as the
# motion: here a stick of one metre, whose ends are two marks in the first frame. A class measures it to about one per
# cent; the number that is used below is off by a random amount of that size.

# %%
measured = 1.0 * (1 + rng.uniform(-0.01, 0.01))
stick = {
    throw: place([[-0.2, 0], [-0.2, 1]], (0.12, 0.85), 0.45),
    swing: place([[-0.8, -0.85], [0.2, -0.85]], (0.5, 0.08), 0.95),
}
print(f"the stick of 1 m was measured as {measured:.3f} m")

# %% [markdown]
# ## The throw
#
# This is all the work: the film, the two marks, the length. From a terminal it is
# `python -m vidsindy_lite discover throw.mp4 --length u1,v1,u2,v2,1.0`.

# %%
flight = discover_from_video(throw, length=(*stick[throw].ravel(), measured))
print(flight)
print(flight.status)
assert flight.discovery.system.support.sum() == 2 + 1  # x' = vx, y' = vy, y'' = -g
assert abs(flight.g.value - g) < 4 * flight.g.error < 0.2 * g

# %% [markdown]
# Nothing pulls sideways, $\ddot x=0$, and $g$ pulls down. The error of $g$ is not that of the parabola: the stick is known to
# one per cent, and nobody knows whether the telephone looked straight at the plane of the motion. Two degrees askew change
# lengths far from the marks by another per cent.

# %% tags=["hide-input"] jupyter={"source_hidden": true}
def draw(axes, film, found):
    axes.imshow(read_frame(film, 0))
    axes.plot(*stick[film].T, "o-", color="white", ms=4)
    axes.plot(*found.rig.cameras[0].project(found.fitted).T, color="C0", lw=4, label="the law")
    axes.plot(*found.tracks[0].T, "o", color="C4", ms=2.5, label="the ball, as tracked")
    axes.annotate("1 m", stick[film][0], (2, -14), textcoords="offset points", color="white")
    axes.set(xlabel="u (px)", ylabel="v (px)", xlim=(0, size[0]), ylim=(size[1], 0))
    axes.grid(visible=False)
    axes.legend(ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1))


# %%
fig, axes = plt.subplots(figsize=(7, 4.2))
draw(axes, throw, flight)
caption = "The first frame of the throw with the stick, the ball in all frames (dots), and the path that obeys the law (line)."
save_figure("phone_throw", fig, caption=caption, numbers={"track": flight.tracks[0]})

# %% [markdown]
# *The first frame of the throw with the stick (white), the ball in all frames (dots), and the path that obeys the law (line).*

# %% [markdown]
# ## The swing
#
# The same for the swing. A ball on a string stays on a circle. The program notices that, and looks for the law of
# the angle, counted from the lowest point.

# %%
pendular = discover_from_video(swing, length=(*stick[swing].ravel(), measured))
print(pendular)
law, period = pendular.discovery, pendular.period
names = {law.terms[row] for row in np.flatnonzero(law.system.support[:, 1])}
small = 2 * np.pi / np.sqrt(g / string - (0.1 / 2) ** 2)
assert names == {"sin(angle)", "vangle"}
assert abs(period.value / small - 1) < 0.01
assert abs(pendular.g.value - g) < 4 * pendular.g.error

# %% [markdown]
# Read it like this: $\ddot\varphi=-\frac gL\sin\varphi-c\,\dot\varphi$, with the string's length $L$, which is the radius
# of the circle, and the friction $c$. The period is that of small swings, $2\pi\sqrt{L/g}$ but for the friction.

# %%
fig, axes = plt.subplots(figsize=(7, 4.2))
draw(axes, swing, pendular)
caption = "The first frame of the swing with the stick, the ball in all frames (dots), and the path that obeys the law (line)."
save_figure("phone_swing", fig, caption=caption, numbers={"track": pendular.tracks[0]})

# %% [markdown]
# *The first frame of the swing with the stick (white), the ball in all frames (dots), and the path that obeys the law (line).*

# %% [markdown]
# ## What a wrong length does
#
# Say that the stick is 0.9 m, or 1.1 m. All places become too small, or too large, by the same factor.

# %%
def both(metres):
    """What the two films say with the stick at so many metres."""
    thrown, swung = (discover_from_video(film, length=(*ends.ravel(), metres)) for film, ends in stick.items())
    for warning in thrown.warnings:
        print(f"{metres:.2f} m: {warning}")
    return thrown, swung


shares = (0.9, 1.1) if full else (1.1,)
found = {1.0: (flight, pendular)} | {share: both(share * measured) for share in shares}
rows = [
    {
        "length given / measured": share, "g of the throw": float(thrown.g.value), "verdict": thrown.status,
        "radius of the swing (m)": float(swung.circle.radius), "period (s)": float(swung.period.value),
    }
    for share, (thrown, swung) in found.items()
]  # fmt: skip

# %%
caption = "The same two films with other lengths of the stick: g and the radius follow it, the period does not."
save_table("phone_length", rows, caption=caption, tolerance={"g of the throw": 0.02})

# %%
pulls, periods = (np.array([row[name] for row in rows]) for name in ("g of the throw", "period (s)"))
assert np.allclose(pulls / pulls[0], list(found), rtol=0.01)
assert np.allclose(periods / periods[0], 1.0, rtol=0.001)
assert {row["verdict"] for row in rows[1:]} == {"suspect"}

# %% [markdown]
# Two lessons. The form of a law and all times, such as the period, need no length. And a throw that does not show
# the 9.81 that pulls at everything is doubted, with a guess of what is wrong.

# %% [markdown]
# ## The forecast against the film
#
# A law is worth what it foretells. We cut the film of the swing in two, find the law from the first half alone, and
# let it go on. The camera has seen what really happened.

# %%
seen = len(s) // 2
first = list(islice(read_video(swing), seen))
half = write_video(f"{folder.name}/half.mp4", first, fps, codec="H264")
early = discover_from_video(half, length=(*stick[swing].ravel(), measured))
start = early.discovery.curve(early.t[-1:])[0]
told = early.discovery.simulate(start, s[seen - 1 :] - s[seen - 1]).x[:, :1]

# %% [markdown]
# The law is that of an angle; the circle turns it into places, and the camera turns places into pixels.

# %%
circle = early.circle
places = circle.centre + circle.radius * np.hstack([np.cos(told), np.sin(told)]) @ circle.axes
foretold = early.rig.cameras[0].project(places)
apart = np.linalg.norm(foretold - pendular.tracks[0][seen - 1 :], axis=1)
reach = np.nanmax(pendular.tracks[0][:, 0]) - np.nanmin(pendular.tracks[0][:, 0])
print(f"{len(first)} frames seen, {len(s) - seen} foretold; at most {100 * np.nanmax(apart) / reach:.1f} % of the swing apart")
assert np.nanmax(apart) < 0.05 * reach

# %% tags=["hide-input"] jupyter={"source_hidden": true}
fig, axes = plt.subplots(figsize=(7, 3))
axes.plot(s, pendular.tracks[0][:, 0], "o", ms=3, color="0.6", label="filmed")
axes.plot(s[seen - 1 :], foretold[:, 0], label="foretold")
axes.axvline(s[seen - 1], color="0.3", lw=1)
axes.set(xlabel="time (s)", ylabel="u (px)")
axes.legend(ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1))
caption = "Across the picture: the ball as filmed (dots), and from the line on what the law of the first half foretells."
numbers = {"t": s, "filmed": pendular.tracks[0][:, 0], "foretold": foretold[:, 0]}
save_figure("phone_forecast", fig, caption=caption, numbers=numbers)

# %% [markdown]
# *Across the picture: the ball as filmed (dots), and from the line on what the law of the first half foretells.*

# %% [markdown]
# ## What we learned
#
# * One film and one length give $g$ of a throw, within the error of that length.
#   <!-- by: abs(flight.g.value - g) < 4 * flight.g.error; flight.discovery.system.support.sum() == 2 + 1 -->
# * One film of a swing gives its law, with the sine and the friction, its period, and $g$.
#   <!-- by: names == {"sin(angle)", "vangle"}; abs(period.value / small - 1) < 0.01; abs(pendular.g.value - g) -->
# * A wrong length makes $g$ wrong by the same share, which is noticed, and leaves the period as it is.
#   <!-- by: np.allclose(pulls / pulls[0]; np.allclose(periods / periods[0]; row["verdict"] -->
# * Half of the film is enough to foretell the other half.
#   <!-- by: np.nanmax(apart) < 0.05 * reach -->
#
# **What the paper says and what we found.**
#
# * The paper's conclusion leaves laws from real film to future work, with its three cameras. For a motion in a plane one
#   is enough, if something of known length is in the picture.
#   <!-- by: abs(flight.g.value - g) < 4 * flight.g.error; tests/test_plane.py::test_the_toss -->

# %% [markdown]
# ## Exercises
#
# [Three exercises](exercises/13_one_telephone.ipynb), each with a blank cell and a check that says *right* or fails. Their
# [solutions](solutions/13_one_telephone.ipynb) lie apart.

# %% [markdown]
# ## Run time and versions
#
# All cells take about 1 minute on two cores, beside two other notebooks.

# %%
folder.cleanup()
print(versions())
