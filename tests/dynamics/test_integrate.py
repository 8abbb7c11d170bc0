"""Integrators against exact solutions and scipy, and the same digits on every machine."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import vidsindy_lite
from vidsindy_lite.dynamics.model import integrate, runge_kutta_4

DIGEST = """
import hashlib
from vidsindy_lite.study import SYSTEMS
print(hashlib.sha256(SYSTEMS["SprottF"].trajectory(800)[1].tobytes()).hexdigest())
"""


def circle(x):
    return np.stack([x[..., 1], -x[..., 0]], axis=-1)


@pytest.mark.parametrize("t", [np.linspace(0, 20, 201), np.linspace(0, 20, 3), [0.0, 1e-3, 7, 20]])
def test_a_circle_is_closed_whatever_the_times(t):
    t = np.asarray(t)
    path, _ = integrate(circle, t, np.array([0.0, 1.0]))
    np.testing.assert_allclose(path, np.stack([np.sin(t), np.cos(t)], axis=1), atol=3e-10)


def test_the_tolerance_is_met():
    t = np.linspace(0, 10, 11)
    errors = [
        np.abs(integrate(circle, t, np.array([0.0, 1.0]), tolerance)[0][:, 0] - np.sin(t)).max()
        for tolerance in (1e-5, 1e-8, 1e-11)
    ]
    assert errors[0] < 1e-3
    assert errors[1] < 1e-6
    assert errors[2] < 1e-9
    assert errors[0] > errors[1] > errors[2] > 0


def test_after_a_blow_up_there_is_nothing():
    t = np.linspace(0, 2, 21)  # 1 / (1 - t)
    path = integrate(lambda x: x**2, t, np.array([1.0]), farthest=1e6)[0][:, 0]
    np.testing.assert_allclose(path[:10], 1 / (1 - t[:10]), rtol=1e-9)
    assert np.isnan(path[10:]).all()
    endless = integrate(lambda x: x**2, t, np.array([1.0]))[0][:, 0]
    assert np.isnan(endless[11:]).all()


def test_the_classical_method_is_of_fourth_order():
    t = np.linspace(0, 2, 5)
    exact = np.stack([np.sin(t), np.cos(t)], axis=1)
    coarse, fine = (
        np.abs(runge_kutta_4(circle, t, [0.0, 1.0], substeps) - exact).max() for substeps in (2, 4)
    )
    assert coarse / fine == pytest.approx(16, rel=0.1)


def test_a_chaotic_path_is_the_same_with_every_kernel_of_linear_algebra():
    """With scipy's integrator the end of this path moved by its whole width."""

    def digest(**environment):
        paths = {"PYTHONPATH": str(Path(vidsindy_lite.__file__).parents[1])}
        ran = subprocess.run(
            [sys.executable, "-c", DIGEST], env=os.environ | paths | environment,
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        return ran.stdout

    here = digest()
    assert len(here.strip()) == len(hashlib.sha256().hexdigest())
    for kernel in ("Haswell", "Prescott"):
        assert digest(OPENBLAS_CORETYPE=kernel, OMP_NUM_THREADS="2") == here


def test_a_motion_too_stiff_to_follow_ends():
    t = np.linspace(0.0, 20.0, 50)

    def rate(x):
        return -1e6 * (x - 1)

    path, _ = integrate(rate, t, np.array([0.0]), most_steps=200)
    assert np.isfinite(path[0]).all()
    assert np.isnan(path[-1]).all()


def test_a_long_motion_is_followed_to_its_end():
    path, end = integrate(circle, np.array([0.0, 2000.0]), np.array([0.0, 1.0]), most_steps=200)
    np.testing.assert_allclose(path[-1], [np.sin(2000.0), np.cos(2000.0)], atol=1e-6)
    assert end == ""


def test_what_ends_a_path_is_told():
    t = np.linspace(0.0, 20.0, 50)
    assert integrate(lambda x: x**2, t, np.ones(1), farthest=1e6)[1] == "diverges"
    assert integrate(lambda x: x**2, t, np.ones(1))[1] == "diverges"
    stiff = integrate(lambda x: -1e6 * (x - 1), t, np.zeros(1), most_steps=200)
    assert stiff[1] == "is too stiff to be followed"
