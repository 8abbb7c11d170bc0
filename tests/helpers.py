"""Random curves, rigs and their tracks, a posed problem, and notebooks: tiny ones, quick runs."""

import multiprocessing
import os
import time
from dataclasses import replace
from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np
import pytest
from disturbed.execute import HARNESS, execute
from scipy.integrate import solve_ivp

import vidsindy_lite as vl
from vidsindy_lite.dynamics.library import Library
from vidsindy_lite.dynamics.solver import _posed, _solved, _Task
from vidsindy_lite.vision.candidates import Candidates

REAL = Path(vl.__file__).parents[2] / "shared" / "real"

HEADER = """\
# ---
# jupyter:
#   jupytext:
#     cell_metadata_filter: tags,-all
#     formats: ipynb,py:percent
#     notebook_metadata_filter: kernelspec,jupytext,-jupytext.text_representation.jupytext_version
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---

# %% [markdown]
# # A tiny notebook

# %% tags=["parameters"]
profile: str = "full"  # full or quick
"""


def real(name):
    """A clip that people filmed, where these are at hand; they are no part of the repository."""
    path = REAL / f"{name}.mp4"
    if not path.is_file():
        pytest.skip("no real footage here")
    return path


def full_disk(path, *_):
    """Stands in for what writes a file."""
    raise OSError(28, "No space left on device", str(path))


def wait_for(condition):
    """Poll until a condition holds; fail after a minute."""
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def trajectory(rng, n):
    """A smooth 3D curve of random shape, size and place."""
    t = np.linspace(0, 8, n)[:, None]
    waves = sum(
        rng.normal(size=3) / k * np.sin(k * t + rng.uniform(0, 2 * np.pi, 3)) for k in range(1, 6)
    )
    return rng.normal(scale=5, size=3) + rng.uniform(1, 100) * waves


def moving(acceleration, x0, v0, t):
    """Positions of a motion, (n, m)."""
    m = len(x0)

    def rate(_, state):
        return np.append(state[m:], acceleration(state[:m], state[m:]))

    start = np.append(x0, v0).astype(float)
    return solve_ivp(rate, (t[0], t[-1]), start, t_eval=t, rtol=1e-10, atol=1e-11).y[:m].T


def noisy(x, share, seed=0):
    """Values with errors of a share of the spread of each column."""
    return x + share * x.std(axis=0) * np.random.default_rng(seed).normal(size=x.shape)


def dependent(rng, n, memory):
    """A series of mean 0 and variance 1 in which each value keeps a share of the one before."""
    series = rng.normal(size=(n, 2))
    for k in range(1, n):
        series[k] = memory * series[k - 1] + np.sqrt(1 - memory**2) * series[k]
    return series


def scene(seed, n=500, cameras=3, kinds=(vl.OrthographicCamera,)):
    """A random path, cameras of some kinds that look roughly at it, exact tracks, the generator."""
    rng = np.random.default_rng(seed)
    x = trajectory(rng, n)
    reach = np.linalg.norm(np.ptp(x, axis=0)) / 2
    while True:
        out = rng.normal(size=(cameras, 3))
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        if np.linalg.eigvalsh(cameras * np.eye(3) - out.T @ out)[0] > cameras / 3:
            break
    views = []
    for direction in out:
        kind = kinds[rng.integers(len(kinds))]
        distance = rng.uniform(1.5, 6) * reach
        pixel = reach / rng.uniform(150, 230)
        views.append(
            kind(
                position=(x.min(0) + x.max(0)) / 2 + distance * direction,
                normal=direction + 0.1 * rng.normal(size=3),
                scale=pixel if kind is vl.OrthographicCamera else pixel / distance,
                angle=rng.uniform(-np.pi, np.pi),
            )
        )
    return x, vl.Rig(views), [camera.project(x) for camera in views], rng


def solved(t, x, degree):
    """What is found of one motion by a law of first order, its problem and its fit."""
    measured = [(t, x)], [np.zeros((*x.shape, 0))], None
    names, library = tuple("xyz"[: x.shape[1]]), Library.polynomial(degree)
    task = _Task(measured, names, library, "learn", 0, False, np.inf)
    return _solved(task, *_posed(task, task.form(1)))


def filmed(motion, frames, lags, rates=(1, 1, 1), noise=0.05):
    """Tracks of a motion, (path, rig), by cameras that are late by these frames."""
    path, rig = motion
    rng = np.random.default_rng(0)
    tracks = []
    for camera, n, lag, rate in zip(rig.cameras, frames, lags, rates, strict=True):
        pixels = camera.project(path(lag + np.arange(n) / rate))
        tracks.append(pixels + noise * rng.normal(size=pixels.shape))
    return tracks


def walk(t):
    """A path in a room, metres, that never repeats itself; t in frames of a video."""
    t = np.asarray(t)[:, None] / 40
    return np.array([0.6, 0.5, 0.4]) * np.sin(t * [1.0, 1.31, 0.77] + [0, 1, 2])


def room(rng, cameras=3, **lens):
    """Cameras with 60 degree lenses, 2 to 4 m from the middle of a room."""
    views = []
    turn = rng.uniform(0, 2 * np.pi)
    for i in range(cameras):
        azimuth, height = turn + 2 * np.pi * i / cameras, rng.uniform(0.1, 0.6)
        away = np.array([np.cos(azimuth), np.sin(azimuth), height])
        views.append(
            vl.PerspectiveCamera(
                position=rng.uniform(2, 4) * away / np.linalg.norm(away),
                scale=1 / 1109,
                normal=away + 0.03 * rng.normal(size=3),
                angle=rng.uniform(-np.pi, np.pi),
                image_size=(1280, 720),
                **lens,
            )  # fmt: skip
        )
    return vl.Rig(views)


def shot(rng, rig, frames, late=(0.0,) * 5, noise=0.5, path=walk):
    """Noisy tracks, each so many frames late; rolling shutters look at each row as it is read."""
    tracks = []
    for camera, lag in zip(rig.cameras, late, strict=False):
        height, seen = camera.image_size[1], camera.project(path(frames + lag))
        for _ in range(15 if camera.readout else 0):
            shift = camera.readout * (seen[:, 1] - (height - 1) / 2) / height
            seen = camera.project(path(frames + lag + shift))
        tracks.append(seen + noise * rng.normal(size=seen.shape))
    return tracks


def far_off(rig):
    """The cameras of a room as they would be far away, seeing alike what is in its middle."""
    return [
        vl.OrthographicCamera(
            position=np.zeros(3), normal=c.normal, angle=c.angle, image_size=c.image_size,
            scale=c.scale * (c.normal @ c.position),
        )
        for c in rig.cameras
    ]  # fmt: skip


def by_hand(rng, rig, **more):
    """The rig as a hand measures it: 2 degrees, 3 cm, 3 %."""
    return vl.Rig(
        replace(
            c,
            normal=c.normal + np.deg2rad(2) * rng.normal(size=2) @ c.rows,
            position=c.position + 0.03 * rng.normal(size=3),
            scale=c.scale * np.exp(0.03 * rng.normal()),
            angle=c.angle + np.deg2rad(2) * rng.normal(),
            **{"normal_error": 2.0, "position_error": 0.03, "scale_error": 0.03} | more,
        )
        for c in rig.cameras
    )


def aligned_error(found, x):
    """Root mean square of what the best similarity leaves."""
    a, b = found - found.mean(axis=0), x - x.mean(axis=0)
    u, s, v = np.linalg.svd(b.T @ a)
    s[2] *= (sign := np.sign(np.linalg.det(u @ v)))
    turned = a @ (u @ np.diag([1, 1, sign]) @ v).T * s.sum() / np.sum(a**2)
    return np.sqrt(np.mean(np.sum((turned - b) ** 2, axis=1)))


def one_a_frame(places, qualities):
    """One candidate in each frame, all alike but for their places and qualities."""
    places = np.asarray(places, float)
    n = len(places)
    box = np.column_stack([places - 4, np.full((n, 2), 9.0)])
    colour = np.tile([30.0, 30, 200], (n, 1))
    return Candidates(np.arange(n), places, places, box, np.full(n, 60.0), colour, 0 * colour + 100,
                      np.asarray(qualities, float), np.ones(n, bool))  # fmt: skip


SIZE = 1e-9  # of what disturbs tracks and trajectories, relatively
# What notebooks load is there when one begins, but for the package, which may be disturbed.
SERVER = multiprocessing.get_context("forkserver")
SERVER.set_forkserver_preload(
    ["IPython.display", "av", "cv2", "joblib", "pysindy", "scipy.stats", "seaborn", "torch"]
)


def run_quickly(path, figures, settings, cache, seed=None):
    """What a notebook fails with in its quick profile, with these settings; empty if it ends."""
    paths = os.pathsep.join(map(str, (HARNESS, Path(vl.__file__).parents[1])))
    variables = {
        "PYTHONPATH": paths, "VIDSINDY_CACHE": str(cache), "VIDSINDY_FIGURES": str(figures),
        "VIDSINDY_NOTEBOOK": path.stem,
    }  # fmt: skip
    if seed is not None:
        variables["VIDSINDY_DISTURB"] = f"{SIZE}:{seed}"
    with NamedTemporaryFile() as log:
        process = SERVER.Process(target=execute, args=(path, settings, variables, log.name))
        process.start()
        process.join()
        said = Path(log.name).read_text("utf-8")[-3000:]
    return (said or f"ended with status {process.exitcode}") if process.exitcode else ""


class TinyRepository:
    """A folder laid out like the repository, to fill with tiny notebooks."""

    def __init__(self, root: Path):
        self.root = root
        self.notebooks = root / "notebooks"
        self.notebooks.mkdir(exist_ok=True)
        (root / "vidsindy_lite").mkdir(exist_ok=True)

    def write(self, name: str, *cells: str) -> Path:
        """Write notebooks/<name>.py: a title, the parameters cell, and these code cells."""
        path = self.notebooks / f"{name}.py"
        path.write_text(HEADER + "".join(f"\n# %%\n{cell}\n" for cell in cells))
        return path
