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
# # From a point in space to a point in a view plane
#
# In this notebook, we present the geometry under everything else: how a camera whose view plane
# has the normal $\mathbf n$ turns a point $\mathbf x$ of space into two in-plane coordinates.
#
# **What you will see**
#
# * Rodrigues' formula, and the one rotation that makes the projection work: *normal to* $\mathbf e_z$;
# * why the position of the plane along its normal drops out;
# * the in-plane offset as two *signed* distances;
# * four places where the paper's text does not compute, each shown by a number.
#
# **Afterwards you can** project a point on the view plane of any camera, and prove that the plane's position along
# its normal does not matter.
#
# **What you need**: vectors, matrices, the cross product. Nothing is random here.
#
# **Covers** Eq. (1)-(2) and the appendices "Detail of Projection", "Plane Projection Proof" and
# "Compute offset distance of a camera plane" (Fig. S1).

# %% tags=["parameters"]
profile: str = "full"  # full or quick
system: str = "Lorenz"  # one of vidsindy_lite.study.SYSTEMS
view: int = 1  # which of the three cameras

# %%
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

from vidsindy_lite import Rig, cameras
from vidsindy_lite.companion.artifacts import save_figure, save_slider, save_table, versions
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, plots

plt.style.use("vidsindy_lite.study.plots.vidsindy")
frames = {"full": 1500, "quick": 300}[profile]
e_z = np.array([0.0, 0.0, 1.0])

# %% [markdown]
# A moving target to look at, and a camera that looks at it. `Rig.around` places three cameras
# around a scene; here we take one of them.

# %%
t, x = SYSTEMS[system].shift(REFERENCE_OFFSET).trajectory(frames)
camera = Rig.around(x).cameras[view - 1]
print("position", camera.position.round(2))
print("normal  ", camera.normal.round(4))

# %% tags=["hide-input"] jupyter={"source_hidden": true}
fig, axes = plt.subplots(figsize=(7.5, 5.2), subplot_kw=plots.SPACE)
flat = plots.on_plane(camera, camera.project(x))
axes.plot(*x.T, lw=1, label="3D trajectory")
axes.plot(*flat.T, lw=1, label="its projection on the view plane")
for point, foot in zip(x[:: len(x) // 12], flat[:: len(x) // 12], strict=True):
    axes.plot(*np.transpose([point, foot]), color="0.6", lw=0.6, ls=":")
plots.draw_plane(axes, camera, "C1")
place, reach = camera.position, 180 * camera.scale
axes.scatter(*place, color="k", s=15)
halo = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}
for axis, name in zip((*camera.rows, camera.normal), ("X'", "Y'", "Z'"), strict=True):
    axes.quiver(*place, *(reach * axis), color="k", lw=1.2, arrow_length_ratio=0.15)
    axes.text(*(place + 1.2 * reach * axis), name, ha="center", va="center", bbox=halo)
axes.text(*(place - 0.35 * reach * camera.rows[1]), "$C_1$", ha="center", bbox=halo)
plots.finish_space(axes, azimuth=-40, elevation=8)
fig.legend(loc="outside upper center", ncols=2)
caption = "The view plane sees a flat copy of the 3D trajectory; depth along its normal Z' is lost."
save_figure("figure_S1", fig, caption=caption, numbers={"t": t, "x": x})

# %% [markdown]
# *Figure S1: the plane through $C_1$ sees a flat copy of the trajectory. X' and Y' are its axes,
# Z' is its normal; whatever happens along Z' is lost.*

# %% [markdown]
# ## Rodrigues' formula
#
# A rotation by the angle $\theta$ about the unit axis $\mathbf u$ is, Eq. (1)-(2),
#
# $$\mathbf R = \mathbf I + \sin\theta\,\mathbf U + (1-\cos\theta)\,\mathbf U^2,\qquad
# \mathbf U\mathbf w = \mathbf u\times\mathbf w .$$
#
# scipy's rotation vectors are an independent implementation to compare with.

# %%
def rotation_about(axis, angle):
    u = axis / np.linalg.norm(axis)
    U = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return np.eye(3) + np.sin(angle) * U + (1 - np.cos(angle)) * U @ U


axis, angle = np.array([1.0, 2.0, 2.0]) / 3, 0.7
R = rotation_about(axis, angle)
assert np.allclose(R, Rotation.from_rotvec(angle * axis).as_matrix(), atol=1e-12)
R.round(6)

# %% [markdown]
# ## Which rotation: normal to $\mathbf e_z$
#
# To read off in-plane coordinates we turn the plane flat: its unit normal has to become the
# vertical,
#
# $$\mathbf R\,\mathbf n = \mathbf e_z,\qquad \mathbf u = \frac{\mathbf n\times\mathbf e_z}
# {\|\mathbf n\times\mathbf e_z\|},\qquad \cos\theta = \mathbf n\cdot\mathbf e_z .$$
#
# The last row of $\mathbf R$ is then $\mathbf n$ itself, and the first two rows, $\mathbf R^-$, are
# the axes X' and Y' of the plane.

# %%
n = camera.normal
R = cameras.rotation_to_z(n)
assert np.allclose(R @ n, e_z, atol=1e-12)
assert np.allclose(R[2], n, atol=1e-12)
R.round(4)

# %% [markdown]
# **The paper's text has it the other way round.** It sets $\mathbf v_0 = \mathbf e_z$ and
# $\mathbf v_1 = \mathbf n$ and defines $\mathbf v_1 = \mathbf R\mathbf v_0$: that rotation takes
# $\mathbf e_z$ to the normal. It is the transpose of ours, and it does not turn the plane flat.
# Its appendix A says both: $\mathbf v_1 = \mathbf R\mathbf v_0$, and that the normal is rotated to $(0, 0, 1)^T$, which is what is needed.

# %%
text = R.T  # the rotation of the text
assert np.allclose(text @ e_z, n, atol=1e-12)
assert not np.allclose(text @ n, e_z, atol=0.1)
print("R n        ", (R @ n).round(4) + 0.0)
print("R n, text's", (text @ n).round(4) + 0.0)

# %% [markdown]
# ## A camera that looks along z
#
# For $\mathbf n = \pm\mathbf e_z$ the axis is $0/0$. Near $+\mathbf e_z$ the limit is the identity.
# At $-\mathbf e_z$ there is no limit, every horizontal axis is equally short, so we fix one: half a
# turn about x. The choice is harmless, since another one only adds to the camera's in-plane angle.

# %%
with np.errstate(invalid="ignore"):
    axis = np.cross(e_z, e_z) / np.linalg.norm(np.cross(e_z, e_z))
assert np.isnan(axis).all()
assert np.allclose(cameras.rotation_to_z(e_z), np.eye(3))
assert np.allclose(cameras.rotation_to_z(-e_z), np.diag([1, -1, -1]))
print("axis as written:", axis)

# %% [markdown]
# Close to z there is a second trap: $\theta = \arccos(\mathbf n\cdot\mathbf e_z)$ loses half of its
# digits, because the cosine is flat there. $\operatorname{atan2}$ of sine and cosine does not. Which
# digits are lost is a matter of rounding, so we look at the worst of 300 cameras in each decade of
# the tilt, and round it up.


# %%
def as_written(normal):
    axis = np.cross(normal, e_z)
    return rotation_about(axis, np.arccos(normal @ e_z))


def bound(rotation, exponent):
    """The largest error of a decade, rounded up to 3, 30, 300, ... times 1e-16."""
    tilts = np.logspace(exponent, exponent + 1, 300)
    normals = np.column_stack([np.sin(tilts), 0 * tilts, np.cos(tilts)])
    worst = max(np.linalg.norm(rotation(n) @ n - e_z) for n in normals)
    return 3 * 10 ** np.ceil(np.log10(max(worst, 1e-15) / 3))


# %%
exponents = np.arange(-12, 0)
tilt = 10.0 ** (exponents + 0.5)
errors = {
    "angle by arccos, as written": [bound(as_written, e) for e in exponents],
    "angle by atan2, ours": [bound(cameras.rotation_to_z, e) for e in exponents],
}
assert max(errors["angle by arccos, as written"]) > 1e-9
assert max(errors["angle by atan2, ours"]) < 1e-14

# %% tags=["hide-input"] jupyter={"source_hidden": true}
fig, axes = plt.subplots()
for (name, error), marker in zip(errors.items(), "os", strict=True):
    axes.loglog(tilt, error, marker, label=name)
axes.set(xlabel="angle between normal and z axis (rad)", ylabel=r"$\|R\,n - e_z\|$")
axes.legend()
caption = "Computed as written, the rotation is off by some 1e-8 for a camera near the z axis."
save_figure("projection_near_z", fig, caption=caption, numbers={"tilt": tilt, **errors})

# %% [markdown]
# *Computed as written, the rotation misses $\mathbf e_z$ by some $10^{-8}$ for a camera near the
# z axis; with the angle from atan2 it stays exact to $3\cdot10^{-15}$. (The largest error in each decade
# of the tilt, rounded up.)*

# %% [markdown]
# ## Projection on the plane, and why D drops out
#
# The foot of the perpendicular from $\mathbf x$ to the plane $Ax+By+Cz+D=0$ is, Eq. (S3) in one line,
#
# $$\mathbf x_p = \mathbf x - \mathbf n\,\frac{\mathbf n\cdot\mathbf x + D}{\mathbf n\cdot\mathbf n},
# \qquad \mathbf n=(A,B,C)^T.$$
#
# Turn it flat: $\mathbf R\mathbf x_p = \mathbf R\mathbf x - \mathbf R\mathbf n\,(\dots)$. With
# $\mathbf R\mathbf n = \|\mathbf n\|\,\mathbf e_z$ the whole correction points along
# $\mathbf e_z$, so the first two coordinates are $\mathbf R^-\mathbf x$, **whatever D is**. That is
# the proof of the appendix, without expanding a single product. It needs *normal to* $\mathbf e_z$.

# %%
def foot(x, n, d):
    """Of the perpendicular from points x to the plane n . x + d = 0 (Eq. S3)."""
    return x - np.multiply.outer((x @ n + d) / (n @ n), n)


# %%
d = np.linspace(-80, 80, 41)
feet = np.array([foot(x[0], n, value) for value in d])
assert np.allclose(feet @ n + d, 0, atol=1e-12)
turned = {"R takes n to $e_z$": feet @ R.T, "as in the text: $e_z$ to n": feet @ text.T}
moved = [np.ptp(values[:, :2], axis=0).max() for values in turned.values()]
assert moved[0] < 1e-12
assert moved[1] > 1
rows = [
    {"rotation": "R takes n to e_z", "shift of the image": "below 1e-12"},
    {"rotation": "as in the text: e_z to n", "shift of the image": f"{moved[1]:.1f}"},
]
caption = (
    "How far the image moves while the plane moves along its normal through all D (scene units)."
)
save_table("projection_shift", rows, caption=caption)

# %% tags=["hide-input"] jupyter={"source_hidden": true}
fig, panels = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True)
for axes, (title, values) in zip(panels, turned.items(), strict=True):
    for letter, value, style in zip("xyz", values.T, ("-", "--", ":"), strict=True):
        axes.plot(d, value, style, label=f"${letter}_{{rp}}$")
    axes.set(title=title, xlabel="D (scene units)")
panels[0].set_ylabel("coordinate (scene units)")
fig.legend(*panels[0].get_legend_handles_labels(), loc="outside right center")
caption = "Only with the rotation normal-to-e_z are the in-plane coordinates independent of D."
save_figure("projection_independence_of_d", fig, caption=caption, numbers={"d": d, **turned})

# %% [markdown]
# *Moving the plane along its normal changes only $z_{rp}$ if R takes the normal to $\mathbf e_z$
# (left); with the rotation of the text, the image would move, too (right).*

# %% [markdown]
# ## A sign in the proof
#
# The proof writes out R with the axis $(u_x,u_y,0)$, but its matrix, Eq. (S4), has $+u_x\sin\theta$ in
# row 2, column 3, where the definition before it, Eq. (S2), has $-u_x\sin\theta$. The matrix of the
# proof is no rotation, and its $y_{rp}$ depends on D. The published proof only expands $x_{rp}$,
# where the entry does not occur.

# %%
proof = R.copy()
proof[1, 2] *= -1
print("det R        ", np.linalg.det(R).round(6))
print("det, proof's ", np.linalg.det(proof).round(6))
print("D in x_rp, y_rp:", -(proof @ n)[:2].round(6) + 0.0)
assert abs(np.linalg.det(proof) - 1) > 1e-3
assert abs((proof @ n)[0]) < 1e-12

# %% [markdown]
# The expansion of $x_{rp}$ collects the coefficient of D and finds zero. That is right for
# the axis $\mathbf n\times\mathbf e_z$, and wrong for the axis of the text, $\mathbf e_z\times\mathbf n$.


# %%
def coefficient_of_d(axis):
    (a, b, cos), (ux, uy, _) = n, axis / np.linalg.norm(axis)
    sin = np.sqrt(1 - cos**2)
    return -a * (cos + ux**2 * (1 - cos)) - cos * uy * sin - b * uy * ux * (1 - cos)


print("axis n x e_z:", coefficient_of_d(np.cross(n, e_z)).round(6) + 0.0)
print("axis e_z x n:", coefficient_of_d(np.cross(e_z, n)).round(6))
assert abs(coefficient_of_d(np.cross(n, e_z))) < 1e-12
assert abs(coefficient_of_d(np.cross(e_z, n))) > 0.1

# %% [markdown]
# ## The in-plane offset, from signed distances
#
# The image has its own origin: the place $C$ of the camera in its plane. In-plane coordinates
# count from the reference origin, so the image is shifted by
#
# $$\Delta_c = \mathbf R^-\,C .$$
#
# The appendix gets the same two numbers as distances of $C$ to coordinate planes, each plane through
# three points. The planes it needs are Y'OZ' (for $\delta_x$) and X'OZ' (for $\delta_y$); the text
# names X'OY', the image plane itself, whose distance is the depth. And the distances carry a *sign*.

# %%
def signed_distance(x, p1, p2, p3):
    """Of x to the plane through three points, positive where they are seen counter-clockwise."""
    normal = np.cross(p2 - p1, p3 - p1)
    return normal @ (x - p1) / np.linalg.norm(normal)


# %%
X, Y, Z = R
origin, C = np.zeros(3), camera.position
distance = {
    "Y'OZ' (delta_x)": signed_distance(C, origin, Y, Z),
    "X'OZ' (delta_y)": signed_distance(C, origin, Z, X),
    "X'OY' (depth)": signed_distance(C, origin, X, Y),
}
assert np.allclose(list(distance.values())[:2], camera.offset, atol=1e-12)

# %%
rows = [
    {"plane": plane, "signed distance": float(value), "distance": abs(float(value))}
    for plane, value in distance.items()
]
caption = "Distances of the camera to the turned coordinate planes; the first two are the offset."
save_table("projection_offset", rows, caption=caption)

# %% [markdown]
# What an unsigned distance does to the image of the trajectory:

# %%
seen = x @ camera.rows.T  # in-plane coordinates, R^- x
on_image = seen - camera.offset  # the same from the camera's own origin
curves = {
    r"$R^-\,x$": seen,
    "image + signed distances": on_image + camera.offset,
    "image + unsigned distances": on_image + np.abs(camera.offset),
}
fig = plots.plot_in_plane(curves, ("X'", "Y'"))
caption = "Only signed distances put the image back where the trajectory is in the plane."
save_figure("projection_offset_signs", fig, caption=caption, numbers=curves)

# %% [markdown]
# *Signed distances (blue) put the image back onto the in-plane coordinates of the trajectory (grey);
# unsigned ones (vermilion) miss by twice the distance along each axis where it is negative.*

# %% [markdown]
# ## All together: pixels
#
# With the scale $s$ and the in-plane angle $\vartheta$ of the image, the camera of this package is
#
# $$s\,\mathcal T(\vartheta)\,\mathbf x_c + \Delta_c = \mathbf R^-\mathbf x,\qquad
# \mathcal T = \begin{bmatrix}\cos\vartheta & \sin\vartheta\\ -\sin\vartheta & \cos\vartheta
# \end{bmatrix},\qquad \mathbf x_c = \bigl(u-\tfrac{W-1}{2},\ \tfrac{H-1}{2}-v\bigr).$$
#
# Projecting a trajectory first onto the plane, or not, makes no difference to the pixels.

# %%
pixels = camera.project(x)
on_plane = foot(x, camera.normal, -camera.normal @ camera.position)
assert np.allclose(camera.project(on_plane), pixels, atol=1e-9)
assert np.allclose(camera.plane_coordinates(pixels), seen, atol=1e-9)
print("pixels from", pixels.min(axis=0).round(1), "to", pixels.max(axis=0).round(1))

# %% [markdown]
# Walk around the scene with this camera. In the left image, $\vartheta$ turns back by as much as the camera walks on,
# which keeps z up. In the right one it stays: as $\mathbf R$ turns the axes of the plane along, the image rolls.

# %%
middle = (x.min(axis=0) + x.max(axis=0)) / 2


def walked(degrees):
    turn = rotation_about(e_z, np.deg2rad(degrees))
    place = middle + turn @ (camera.position - middle)
    rolling = replace(camera, position=place, normal=turn @ camera.normal, scale=1.2 * camera.scale)
    return replace(rolling, angle=camera.angle - np.deg2rad(degrees)), rolling


# %%
figures, seen, up = {}, {}, {}
for degrees in range(0, 360, 30):
    pair = walked(degrees)
    seen[degrees] = [one.project(x[:500]) for one in pair]
    (u, v), (u_2, v_2) = (np.diff(one.project([middle, middle + e_z]), axis=0)[0] for one in pair)
    up[degrees] = np.arctan2(v, u), np.arctan2(v_2, u_2)  # where z is in the images
    fig = figures[f"{degrees} degrees"] = plots.plot_tracks(seen[degrees], pair)
    for axes, title in zip(fig.axes, ("angle turned back", "angle as it was"), strict=True):
        axes.set_title(title)
upright, rolling = np.unwrap(list(up.values()), axis=0).T
assert np.ptp(upright) < 1e-6 < 1 < np.ptp(rolling)
caption = "The image of a camera that walks around: upright (left), and rolling with the axes of the plane (right)."
save_slider("projection_walk", figures, caption=caption, numbers={"degrees": list(seen), "first": seen[0]})

# %% [markdown]
# *Move the slider: a camera walks around the target. Left with its angle turned back, right without.*

# %% [markdown]
# ## What we learned
#
# * A view plane is turned flat by the rotation that takes its **normal to** $\mathbf e_z$. Then
#   the last row of R is the normal, the first two are the axes of the plane, and the position of the
#   plane along its normal drops out because $\mathbf R\mathbf n\parallel\mathbf e_z$.
#   <!-- by: np.allclose(R @ n, e_z; np.allclose(R[2], n; moved[0] < 1e-12 -->
#
# **What the paper says and what we found.**
#
# * With the paper's $\mathbf v_1=\mathbf R\mathbf v_0$ this fails; the proof's own cancellation
#   silently uses the other direction.
#   <!-- by: not np.allclose(text @ n, e_z; abs(coefficient_of_d(np.cross(n, e_z))) < 1e-12 -->
# * The matrix of the proof has a wrong sign in row 2, column 3; the axis is $0/0$ along z; and the
#   offset needs *signed* distances to Y'OZ' and X'OZ'.
#   <!-- by: abs(np.linalg.det(proof) - 1) > 1e-3; np.isnan(axis).all(); np.allclose(list(distance.values())[:2], camera.offset; figure projection_offset -->
#
# Next: [videos and tracking](02_videos_and_tracking.ipynb), where pixels come from images, and
# [camera learning](03_camera_learning.ipynb), where $s$ and $\vartheta$ come from pixels.

# %% [markdown]
# ## Exercises
#
# [Three exercises](exercises/01_projection_proofs.ipynb), each with a blank cell and a check that says *right* or fails. Their
# [solutions](solutions/01_projection_proofs.ipynb) lie apart.

# %% [markdown]
# ## Run time and versions
#
# All cells take about 10 seconds on two cores, beside two other notebooks.

# %%
print(versions())
