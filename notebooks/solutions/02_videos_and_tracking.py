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
# # Solutions: Videos of a moving target, and where it is in them
#
# Questions to [the notebook](../02_videos_and_tracking.ipynb). Write into the blank cells of the
# [exercises](../exercises/02_videos_and_tracking.ipynb), and run the check behind each: it says *right*, or fails.
# The [solutions](../solutions/02_videos_and_tracking.ipynb) lie apart.

# %% tags=["parameters"]
seed: int = 0  # of all that is random

# %%
from pathlib import Path
from tempfile import TemporaryDirectory
from zlib import crc32

import numpy as np

from vidsindy_lite import Scene, dynamics, render_video, track
from vidsindy_lite.study import SYSTEMS

folder = TemporaryDirectory()
angle = np.linspace(0, 12, 120)
round_trip = 128 + np.column_stack([80 * np.cos(angle), 60 * np.sin(angle)])


def errors_of(places, **scene):
    """How far a track is off, frame by frame, in pixels, of a target that is filmed at these places."""
    drawn = Scene("sea", image_size=(256, 256), **scene)
    path = render_video(Path(folder.name) / "one.mov", places, drawn, seed=seed)
    return np.linalg.norm(track(path).pixels - places, axis=1)

# %% [markdown]
# **1.** (Explore.) With noise, `noise_variance=0.01`: which target is tracked best, one with `size=8`, 16 or 40
# pixels? Set `answer` to its size, an integer. (`errors_of(round_trip, size=8, noise_variance=0.01)` renders, tracks
# and compares.)

# %% tags=["solution"]
rms_of = {size: np.sqrt(np.nanmean(errors_of(round_trip, size=size, noise_variance=0.01) ** 2)) for size in (8, 16, 40)}
print({size: f"{rms:.2f} px" for size, rms in rms_of.items()})
assert rms_of[8] > 1.5 * rms_of[40]
answer = 40

# %%
assert crc32(f"02.1 {answer}".encode()) == 4016396176, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# The largest. Noise enters at the rim (inside, the coverage is one), in about $R$ pixels at the distance $R$, so the
# variance of the centroid goes as $R\cdot R^2/(R^2)^2=1/R$.

# %% [markdown]
# **2.** (Explore.) What if the target hardly moves? Let a target of 20 px go round on circles with a radius of 0.3
# and of 0.7 times its width, without noise. With which of the two shares is the target tracked more exactly, in the
# worst of its frames? Set `answer` to it, as a number.

# %% tags=["solution"]
worst = {}
for share in (0.3, 0.7):
    circle = 128 + share * 20 * np.column_stack([np.cos(angle), np.sin(angle)])
    off = errors_of(circle, size=20)
    worst[share] = np.nanmax(off)
    print(f"{share}: seen in {np.isfinite(off).mean():.0%} of the frames, off by at most {worst[share]:.3f} px")
assert worst[0.7] < worst[0.3] / 2
answer = 0.7

# %%
assert crc32(f"02.2 {answer}".encode()) == 246894914, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# The target never leaves its place on the smaller circle: the median takes its middle for background, and what
# differs from that are slivers. `track` notices, puts the ground that is seen around the place beneath it, and
# follows what then differs; as that ground is a guess, it is off by a hundredth of a pixel or some. On the larger
# circle every frame is as exact as ever.

# %% [markdown]
# **3.** (Prove.) The centroid of a disc is exact if its coverage of every pixel is. Why, and what does an 8-bit
# colour do to it? How large is the error of the centroid, in pixels, that rounding to 1/255 of the contrast makes for
# a disc with a radius of 10 pixels? Set `answer`: `"a"` about 0.1, `"b"` about 0.01, `"c"` below 0.001.

# %% tags=["solution"]
answer = "c"

# %%
assert crc32(f"02.3 {answer}".encode()) == 1235671660, "not yet"
print("right")

# %% [markdown] tags=["solution"]
# The coverage of a pixel is the area of the disc within it, so that $\sum_i c_i=\pi R^2$; and $\sum_i c_i\mathbf p_i$
# with pixel centres $\mathbf p_i$ differs from $\int\mathbf x\,dA$ only in the pixels of the rim, where the centre of
# the covered part is not that of the pixel. These differences have opposite signs at opposite ends of the disc and
# nearly cancel. Rounding to 1/255 of the contrast adds independent errors of $1/(255\sqrt{12})$ in the $2\pi R$
# pixels of the rim, at the distance $R$: together $R\sqrt{\pi R}/(255\sqrt{12}\,\pi R^2)$, some $2\cdot10^{-4}$
# pixels.

# %% [markdown]
# **4.** (Implement.) Write one step of the Runge-Kutta method of order four, `advance(law, x, h)`, for a law that is
# called as `law(x)`.

# %% tags=["solution"]
def advance(law, x, h):
    k1 = law(x)
    k2 = law(x + h / 2 * k1)
    k3 = law(x + h / 2 * k2)
    return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + law(x + h * k3))

# %%
lorenz = SYSTEMS["Lorenz"]
begin, h = np.array(lorenz.x0), lorenz.period / 50
packaged = dynamics.runge_kutta_4(lorenz, np.array([0, h]), begin, substeps=1)[-1]
assert np.allclose(advance(lorenz, begin, h), packaged), "not yet"
folder.cleanup()
print("right")

# %% [markdown] tags=["solution"]
# Halve the step, and the error after a fixed time falls to about a sixteenth: it is of the fourth order in the step.
