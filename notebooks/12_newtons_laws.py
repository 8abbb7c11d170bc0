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
# # Newton's laws from filmed positions
#
# In this notebook, we present laws of motion: what people film obeys $\ddot{\mathbf x}=\mathbf f(\mathbf x,
# \dot{\mathbf x})$, and cameras see $\mathbf x$ alone. The paper's systems are of first order; this is the step
# from them to balls and springs.
#
# **What you will see**
#
# * a ball on a spring, from three video files to its law, the law played over them, and its forecasts;
# * what a first-order law says of the same data, and that it is not believed;
# * gravity and drag from four throws, and why one throw is not enough;
# * a motion that is kicked at random, and how strong the kicks are;
# * a pendulum at a large amplitude, whose law is no polynomial, and its bob in space, whose angle has a law;
# * a bob that swings round on a sphere, whose law needs no angles.
#
# **Afterwards you can** find a law of motion from positions alone: gravity, drag, springs, and when to doubt them.
#
# **What you need**: the objective of [notebook 04](04_spline_ado.ipynb), the cameras of
# [notebook 08](08_lab_experiment.ipynb).
#
# **Covers** nothing in the paper, whose laws are all of first order.

# %% tags=["parameters"]
profile: str = "full"  # full or quick
fps: int = 30  # frames a second of the films
seed: int = 0  # of the scenes, and of all errors and kicks

# %%
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

from vidsindy_lite import (
    Library,
    PerspectiveCamera,
    PolynomialSystem,
    Rig,
    Scene,
    discover,
    discover_from_videos,
    on_sphere,
    read_video,
    render_video,
    write_video,
)
from vidsindy_lite.companion.artifacts import save_animation, save_figure, save_table, versions
from vidsindy_lite.study import plots, term_errors

plt.style.use("vidsindy_lite.study.plots.vidsindy")
full = profile == "full"
rng = np.random.default_rng(seed)

# %% [markdown]
# ## Velocities that nobody measures
#
# A law of second order is one of first order in twice as many states,
#
# $$\dot{\mathbf x}=\mathbf v,\qquad\dot{\mathbf v}=\mathbf f(\mathbf x,\mathbf v).$$
#
# The first half is known and not searched; the velocities are states *without data*, weight zero in the misfit.
# Splines, collocation, subset search, origin and error bars stay what they were.
#
# Our ball hangs on a spring that grows stiffer as it is stretched, and the air damps it. The law as data, in
# centimetres and seconds:

# %%
spring = {axis: {"v" + axis: 1.0} for axis in "xyz"}
stiffness = {"x": -40.0, "y": -40.0, "z": -25.0}
spring |= {
    "v" + axis: {axis: k, "v" + axis: -0.3, axis + "^3": -0.05} for axis, k in stiffness.items()
}
law = PolynomialSystem.from_terms(spring, degree=3)
t = np.arange(fps * (10 if full else 8)) / fps
start = np.array([12.0, -5.0, 8.0, 0.0, 60.0, 0.0])
x = law.simulate(t, start)[:, :3]
print(law.text())

# %% [markdown]
# ## Three films
#
# Three perspective cameras film the ball from two metres, before other grounds. The files are compressed (.mp4),
# which moves the edges of a small target.

# %%
bearings = np.radians([10.0, 130.0, 250.0])
towards = np.stack([np.cos(bearings), np.sin(bearings), np.full(3, 0.35)], axis=1)
places = 200 * towards / np.linalg.norm(towards, axis=1, keepdims=True)
rig = Rig(
    tuple(
        PerspectiveCamera(position=place, normal=place, scale=1 / 1500, angle=0.0)
        for place in places
    )
)
folder = TemporaryDirectory()
paths = [Path(folder.name) / f"{ground}.mp4" for ground in ("hills", "sea", "wood")]
for path, camera in zip(paths, rig.cameras, strict=True):
    track, scene = camera.project(x), Scene(background=path.stem, size=14)
    drawn = render_video(path.with_suffix(".mov"), track, scene, fps, seed)
    write_video(path, read_video(drawn), fps, codec="mp4v")

# %% [markdown]
# One camera is calibrated, of the others position and normal are known; everything else is learned, also when
# each film began. The word `order=2` asks for a law of motion; without it, one is looked for where a law of
# first order is doubtful.

# %%
seen = discover_from_videos(paths, rig.uncalibrated(), order=2)
found = seen.discovery
print(seen, seen.status, sep="\n")
assert seen.status == "ok" or not full
assert (found.system.support == law.support).all()

# %%
off = np.abs(found.coefficients - law.coefficients)[law.support]
errors = found.standard_errors[law.support]
searched = errors > 0  # the first half of the law was known
print(f"worst coefficient: {(off[searched] / errors[searched]).max():.1f} standard errors off")
assert (off[searched] < 5 * errors[searched]).all()

# %% [markdown]
# What a class wants to know is said with error bars, too, carried through from those of the coefficients: stiffness,
# damping and period of small swings about the place of rest, and whether the energy falls, as it should: by more than the
# largest kinetic energy here, as most of it is that of the spring at first.

# %%
springs = found.physics()
print(springs)
period = springs["period z"]
assert abs(period.value - 2 * np.pi / np.sqrt(25 - 0.15**2)) < 5 * period.error
assert "never rises" in springs.notes[-1]

# %% [markdown]
# ## The law over the films
#
# A curve that obeys the law goes through what was seen. Each learned camera says where it would be in the image: over
# the ball, in every frame.

# %%
curves = [camera.project(seen.fitted) for camera in seen.rig.cameras]
beside = [
    np.linalg.norm(curve - track, axis=1) for curve, track in zip(curves, seen.tracks, strict=True)
]
print(f"the ball is at most {np.nanmax(beside):.2f} pixels beside the curve")
assert np.nanmax(beside) < 0.5

# %%
moments = np.arange(0, (3 if full else 1) * fps, fps // 10)
shown = [[image for i, image in enumerate(read_video(path)) if i in moments] for path in paths]
lines = found.equations().splitlines()
pictures = plots.draw_tour(shown, moments, curves, seen.fitted, lines)
caption = "Three films of a ball on a spring, and over them the curve that obeys the law found from them."
save_animation("newton_films", pictures, caption=caption, numbers={"frame": moments, "equations": lines})

# %% [markdown]
# ![Three films of a ball on a spring, with the law over them](../figures/newton_films.gif)
#
# *Three seconds of the films with the curve that obeys the law, its path in space, and the law.*

# %% [markdown]
# ## A forecast
#
# A law is worth what it foretells. From another start, which no camera has seen, the found law and the true
# one go the same way.

# %%
later = np.arange(0, 5 * 2 * np.pi / np.sqrt(40), 1 / 60)  # five swings
other = np.array([-9.0, 10.0, -12.0, 30.0, 0.0, 20.0])
true, told = law.simulate(later, other)[:, :3], found.simulate(other, later).x[:, :3]
apart = np.linalg.norm(told - true, axis=1).max() / np.linalg.norm(true, axis=1).max()
print(f"apart by at most {100 * apart:.2f} % of the motion")
assert apart < (0.01 if full else 0.05)

# %%
both = {"true motion": true, "foretold by the law": told}
fig = plots.plot_path(later, both, unit="s", length="cm")
caption = "Another motion of the ball: the true path (grey) and what the discovered law foretells."
save_figure("newton_forecast", fig, caption=caption, numbers={"true": true, "told": told})

# %% [markdown]
# *Another motion of the ball: the true path (grey) and what the law discovered from the films foretells (blue).*

# %% [markdown]
# ## What a first-order law says
#
# In a law of first order, the same place would have to have one velocity, and the ball passes it in many. What comes
# out with `order=1` is wrong; what matters is that it is not believed.

# %%
first = discover(seen.t, seen.x, degree=1, order=1)
print(first)
assert first.status == "suspect"

# %% [markdown]
# ## Gravity and drag
#
# A ball is thrown four times, in other directions; metres and seconds, errors of 3 mm. Runs go in as a list. The
# line below the law is what it says of the ball: $g$, where it points, and one drag for both directions.

# %%
thrown = {"x": {"vx": 1.0}, "y": {"vy": 1.0}, "vx": {"vx": -0.4}, "vy": {"1": -9.81, "vy": -0.4}}
flight = PolynomialSystem.from_terms(thrown, degree=2)
s = np.arange(90) / 60
throws = [(4.0, 5.0), (-3.0, 6.0), (6.0, 2.0), (1.0, 7.0)]
runs = [(s, flight.simulate(s, np.array([0.0, 1.5, *throw]))[:, :2]) for throw in throws]
runs = [(s, path + 0.003 * rng.standard_normal(path.shape)) for s, path in runs]

# %%
fallen = discover(runs, degree=2, order=2)
print(fallen)
g, drag = fallen.physics()["g"], fallen.physics()["drag"]
assert (fallen.system.support == flight.support).all()
assert abs(g.value - 9.81) < 4 * g.error
assert abs(drag.value - 0.4) < 4 * drag.error

# %% [markdown]
# One throw cannot tell. Along a single path with linear drag, $\dot x$, $\dot y$ and $x$ are all affine in one
# exponential, so that a force along $\dot x$ is as good as one along $\dot y$. The status says so.

# %%
once = discover([runs[0]], degree=2, order=2)
print(once)
assert once.status == "suspect"

# %% [markdown]
# ## Drag as the square of the speed
#
# The air resists a fast ball by $-k\,|\mathbf v|\,\mathbf v$, which is no polynomial, and with **one** $k$ for all
# directions. A term that returns a vector says both: each component is a candidate of its own equation,
# and all share a coefficient. Three throws in space, errors of 3 mm:

# %%
def square_drag(vx, vy, vz):
    return np.sqrt(vx**2 + vy**2 + vz**2) * np.array([vx, vy, vz])


air = Library.polynomial(0) + Library.terms({"|v|v": square_drag})
ball = {axis: {"v" + axis: 1.0} for axis in "xyz"}
ball |= {"v" + axis: {f"|v|v_{axis}": -0.05} for axis in "xyz"}
ball["vz"]["1"] = -9.81
fast = PolynomialSystem.from_terms(ball, library=air)
speeds = [(4.0, 1.0, 8.0), (-2.0, 5.0, 6.0), (1.0, -4.0, 9.0)]
shots = [fast.simulate(s, np.array([0.0, 0.0, 1.0, *speed]))[:, :3] for speed in speeds]
shots = [(s, path + 0.003 * rng.standard_normal(path.shape)) for path in shots]

# %%
slowed = discover(shots, order=2, library=air)
print(slowed)
drag_2 = slowed.physics()["quadratic drag"]
assert slowed.status == "ok"
assert term_errors(slowed.system, fast) == ([], [])  # none missing, none false
assert abs(drag_2.value - 0.05) < 4 * drag_2.error

# %% [markdown]
# With one $k$, even a single throw gives the right law. It is doubted nevertheless: a throw stays in a plane and says little
# of what happens elsewhere.

# %%
alone = discover(shots[:1], order=2, library=air)
print(alone)
assert term_errors(alone.system, fast) == ([], [])
assert alone.status == "suspect"

# %% [markdown]
# ## A ball in the wind
#
# Now gusts kick the ball at every instant. The law no longer holds exactly, and a fit that insists on it takes
# the kicks for terms. That the motion was kicked, and not measured badly, is told by the evidence for each.

# %%
windy = np.array([1.5, 0.0])
step, gust, path = 1 / 600, 0.1, []
for _ in range(1500):
    path.append(windy[0])
    for _ in range(10):
        pull = -4 * windy[0] - 0.2 * windy[1] - 3 * windy[0] ** 3
        windy = windy + step * np.array([windy[1], pull])
        windy[1] += gust * np.sqrt(step) * rng.standard_normal()
measured = np.array(path)[:, None] + 0.003 * rng.standard_normal((1500, 1))

# %%
kicked = discover(np.arange(1500) / 60, measured, order=2)
print(kicked)
names = np.array(kicked.terms)[kicked.system.support[:, 1]]
assert set(names) == {"x", "vx", "x^3"}
assert abs(kicked.model_error[1] / gust - 1) < 0.4

# %% [markdown]
# ## A pendulum at a large amplitude
#
# A pendulum that is let go at 1.5 rad, with a length of 1 m and friction: $\ddot\theta=-\frac gL\sin\theta-c\,\dot\theta$.
# The candidate terms are a value that can be added up: the polynomials and the sines and cosines of the
# coordinates. Sines have an origin of their own, so that none is searched.

# %%
sines = Library.polynomial(1) + Library.fourier(1)
swinging = {"x": {"vx": 1.0}, "vx": {"sin(x)": -9.81, "vx": -0.1}}
pendulum = PolynomialSystem.from_terms(swinging, library=sines)
u = np.arange(1200) / 60
theta = pendulum.simulate(u, np.array([1.5, 0.0]))[:, :1]
theta = theta + 0.01 * theta.std() * rng.standard_normal(theta.shape)

# %%
swung = discover(u, theta, order=2, library=sines)
print(swung)
row = swung.terms.index("sin(x)")
assert (swung.system.support == pendulum.support).all()
assert swung.status == "ok"
assert abs(swung.coefficients[row, 1] + 9.81) < 5 * swung.standard_errors[row, 1]

# %% [markdown]
# Small swings of a pendulum are those of a spring with the constant $g/L$: here of $g$ itself, as $L$ is 1 m. (A natural
# frequency is an angular one, in radians a second.)

# %%
print(swung.physics())
small = swung.physics()["spring constant"]
assert abs(small.value - 9.81) < 5 * small.error

# %% [markdown]
# Polynomials alone imitate the sine by its series along this swing, with a doubt, or with kicks that nobody gave. Let go at
# 2.8 rad, the law with the sine is still that of the pendulum; the series sends it off to infinity.

# %%
series = discover(u, theta, order=2)
print(series)
start, ahead = np.array([2.8, 0.0]), u[u < 5]
miss = np.abs(swung.system.simulate(ahead, start) - pendulum.simulate(ahead, start))[:, 0].max()
outcome = series.simulate(start, ahead).status
print(f"with the sine {miss:.1g} rad from the truth in five seconds; the series {outcome}")
assert miss < 0.1
assert "diverges" in outcome

# %% [markdown]
# ### The same bob, seen in space
#
# A camera sees no angle. The bob's three coordinates depend on each other, as it stays on a circle, so that no law of
# theirs can be trusted. That is said; the circle is found, and the law of the angle on it by itself, counted from where the bob would rest.

# %%
aside, down = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, -1.0])
string = 1.0 * (np.sin(theta) * aside + np.cos(theta) * down)
positions = string + 0.005 * rng.standard_normal(string.shape)
seen_bob = discover(u, positions, degree=3 if full else 2)
swing = seen_bob.swing
print(swing)

# %%
pulls = {swing.law.terms[row] for row in np.flatnonzero(swing.law.system.support[:, 1])}
assert seen_bob.status == "suspect"
assert pulls == {"sin(angle)", "vangle"}
assert abs(swing.circle.radius - 1) < 5 * swing.circle.radius_error
assert abs(swing.g.value - 9.81) < 5 * swing.g.error

# %% [markdown]
# ### A bob that swings round
#
# Pushed aside, the bob leaves its plane and swings round, on a sphere. Counted from its centre, the string pulls
# by as much as keeps the bob on it, and what is left needs no angles:
#
# $$\ddot{\mathbf r}=-\frac1{L^2}|\mathbf v|^2\,\mathbf r-g\left(\mathbf e_z-\frac z{|\mathbf r|^2}\mathbf r\right)-c\,\mathbf v.$$
#
# Three vectors with a coefficient each, $1/L^2$, $g$ and $c$. That $z$ is vertical is supposed; a constant along each
# axis is a candidate, too, and would tell of a push aside.

# %%
def turning(x, y, z, vx, vy, vz):
    return (vx**2 + vy**2 + vz**2) * np.array([x, y, z])


def weight(x, y, z):  # less what the string bears of it
    r = np.array([x, y, z])
    return np.array([0 * z, 0 * z, 1 + 0 * z]) - z / (x**2 + y**2 + z**2) * r


def speed(vx, vy, vz):
    return np.array([vx, vy, vz])


# %%
vectors = {"|v|^2 r": turning, "weight": weight, "v": speed}
tethered = Library.polynomial(0) + Library.terms(vectors)
length, sizes = 1.0, {"|v|^2 r": -1.0, "weight": -9.81, "v": -0.05}
terms = {axis: {"v" + axis: 1.0} for axis in "xyz"}
terms |= {"v" + axis: {f"{term}_{axis}": k for term, k in sizes.items()} for axis in "xyz"}
circling = PolynomialSystem.from_terms(terms, library=tethered)
w = np.arange(600 if full else 300) / 60
pushed_aside = np.array([np.sin(1.0), 0.0, -np.cos(1.0), 0.0, 1.5, 0.0])
orbit = np.array([0.3, -0.2, 2.0]) + length * circling.simulate(w, pushed_aside)[:, :3]
orbit = orbit + 0.005 * rng.standard_normal(orbit.shape)

# %% [markdown]
# Where the string is tied and how long it is, the positions say. The centre's errors move all positions alike: given
# as such, they count in the error bars, and the centre may be better where the law asks for it.

# %%
sphere = on_sphere(orbit)
print(sphere)
moved = np.linalg.cholesky(sphere.centre_covariance).T[:, None].repeat(len(w), axis=1)
around = discover(w, orbit - sphere.centre, order=2, library=tethered, systematic=moved)
print(around)
assert term_errors(around.system, circling) == ([], [])
assert "stays on a sphere" in around.warnings[0]

# %% [markdown]
# The law is doubted, as on a sphere the coordinates depend on each other: what it says holds there, and
# that is where the bob is. Its first coefficient is a second measurement of the length.

# %%
at = [around.terms.index(f"{term}_z") for term in sizes]
told, wide = around.coefficients[at, 5], around.standard_errors[at, 5]
by_law, by_law_error = np.abs(told[0]) ** -0.5, wide[0] / 2 * np.abs(told[0]) ** -1.5
print(f"L = {by_law:.4f} ± {by_law_error:.4f} by the law")
print(f"L = {sphere.radius:.4f} ± {sphere.radius_error:.4f} by the sphere")
print(f"g = {-told[1]:.4f} ± {wide[1]:.4f}, c = {-told[2]:.5f} ± {wide[2]:.5f}")
assert (np.abs(told - list(sizes.values())) < 5 * wide).all()
assert abs(by_law - length) < 5 * by_law_error
assert abs(sphere.radius - length) < 5 * sphere.radius_error

# %% [markdown]
# ## Four laws of this page

# %%
laws = {
    "spring, three films": (found, law),
    "four throws": (fallen, flight),
    "one throw": (once, flight),
    "pendulum, with its sine": (swung, pendulum),
}
rows = [
    {
        "motion": motion, "true terms": true.support.sum(),
        "missing": (true.support & ~told.system.support).sum(),
        "false": (told.system.support & ~true.support).sum(), "status": told.status,
    }
    for motion, (told, true) in laws.items()
]  # fmt: skip
save_table("newton_laws", rows, caption="Laws of second order from positions alone; true terms count those of x' = v as well.")

# %% [markdown]
# ## What we learned
#
# * Positions are enough: velocities enter as states without data, and the spring's law comes out exactly from
#   three video files, with error bars that hold; its curve runs over the ball in every frame that shows it.
#   <!-- by: (found.system.support == law.support).all(); (off[searched] < 5 * errors[searched]).all(); np.nanmax(beside) < 0.5 -->
# * It foretells a motion that no camera has seen.
#   <!-- by: apart < (0.01 if full else 0.05) -->
# * $g$, drag, springs and periods come as named numbers with error bars, and the energy along the path is a check.
#   <!-- by: abs(g.value - 9.81) < 4 * g.error; abs(drag.value - 0.4) < 4 * drag.error; abs(period.value; "never rises" in springs.notes[-1] -->
# * A first-order law of the same data is wrong, and says so.
#   <!-- by: first.status == "suspect" -->
# * Throws in several directions settle gravity and drag; one throw does not, and is not believed.
#   <!-- by: (fallen.system.support == flight.support).all(); abs(g.value - 9.81) < 4 * g.error; once.status == "suspect" -->
# * A drag that is no polynomial and the same in all directions is one term, a vector.
#   <!-- by: abs(drag_2.value - 0.05) < 4 * drag_2.error; term_errors(slowed.system, fast) == ([], []) -->
# * Kicks of the motion are no errors of the measurement: they are found and measured, and stay out of the law.
#   <!-- by: set(names) == {"x", "vx", "x^3"}; abs(kicked.model_error[1] / gust - 1) < 0.4 -->
# * A law that is no polynomial is found when its terms are among the candidates, and then holds at other amplitudes, too.
#   <!-- by: (swung.system.support == pendulum.support).all(); miss < 0.1 -->
# * From a bob's positions its circle is found, and on it the law of the angle, with the length and $g$.
#   <!-- by: pulls == {"sin(angle)", "vangle"}; abs(swing.circle.radius - 1); abs(swing.g.value - 9.81) < 5 * swing.g.error -->
# * On a sphere three vectors are the law, without angles: $g$, friction, and the length of the string once more.
#   <!-- by: term_errors(around.system, circling) == ([], []); (np.abs(told - list(sizes.values())) < 5 * wide).all(); abs(by_law - length) < 5 * by_law_error -->
#
# **What the paper says and what we found.**
#
# * All systems of the paper are of first order, and so is the law of its Eq. (7); of a ball that flies or swings
#   it says nothing. The same objective serves: the velocities join the control points, and half of the law is
#   known before.
#   <!-- by: (found.system.support == law.support).all() -->

# %% [markdown]
# ## Exercises
#
# [Four exercises](exercises/12_newtons_laws.ipynb), each with a blank cell and a check that says *right* or fails. Their
# [solutions](solutions/12_newtons_laws.ipynb) lie apart.

# %% [markdown]
# ## Run time and versions
#
# All cells take about 1 minute on two cores, beside two other notebooks.

# %%
print(versions())
