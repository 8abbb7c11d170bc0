"""Eq. (4) by itself: what it predicts, what it needs, and how close it comes."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import room, scene, trajectory, walk
from hypothesis import given, settings
from hypothesis import strategies as st

import vidsindy_lite as vl
from vidsindy_lite.cameras import (
    Rig,
    calibration_errors,
    learn_cameras,
    learn_cameras_eq4,
    learn_cameras_lbfgs,
)
from vidsindy_lite.cameras.eq4 import _prediction

SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture
def small():
    return scene(7, n=40)


@given(SEEDS)
@settings(max_examples=4)
def test_lbfgs_descends_to_the_closed_form(seed):
    _, truth, tracks, rng = scene(seed, n=100)
    tracks = [track + rng.normal(size=track.shape) for track in tracks]
    start = truth.uncalibrated()
    descended, closed = (f(tracks, start) for f in (learn_cameras_lbfgs, learn_cameras_eq4))
    assert np.abs(calibration_errors(descended, closed)).max() < 1e-6


@pytest.mark.slow
def test_ours_is_closer_and_less_biased_than_eq_4():
    errors = {learn_cameras: [], learn_cameras_eq4: []}
    for seed in range(30):
        rng = np.random.default_rng(seed)
        x = trajectory(rng, 400)
        truth = Rig.around(x)
        tracks = [c.project(x) + 4 * rng.normal(size=(400, 2)) for c in truth.cameras]
        for learn, found in errors.items():
            learned = learn(tracks, truth.uncalibrated())
            found.extend(calibration_errors(learned, truth)[1:])
    joint, paper = map(np.array, errors.values())
    assert (np.mean(joint**2, axis=0) < np.mean(paper**2, axis=0)).all()
    # Noise in the regressors shrinks the scale in Eq. (4), not at the least reprojection error.
    standard_error = joint[:, 0].std() / np.sqrt(len(joint))
    assert abs(joint[:, 0].mean()) < 3 * standard_error
    assert paper[:, 0].mean() < -3 * standard_error


def test_eq_4_needs_independent_unknown_cameras(small):
    _, rig, tracks, _ = small
    twin = replace(rig.cameras[1], normal=-rig.cameras[1].normal)
    rig = Rig([rig.cameras[0], rig.cameras[1], twin])
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs two independent normals among"):
        learn_cameras_eq4(tracks, rig.uncalibrated())


@pytest.mark.parametrize("learn", [learn_cameras_eq4, learn_cameras_lbfgs])
def test_eq_4_is_orthographic(learn):
    rig = room(np.random.default_rng(0))
    tracks = [camera.project(walk(np.arange(60))) for camera in rig.cameras]
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs orthographic cameras, got a persp"):
        learn(tracks, rig.uncalibrated())


def test_the_prediction_by_hand():
    """Views along x and y hold all coordinates: they predict what is seen along z."""
    views = vl.Rig(
        vl.OrthographicCamera(position=(0, 0, 0), normal=n, scale=1, angle=0)
        for n in np.eye(3)[[2, 0, 1]]
    ).uncalibrated()
    columns = _prediction(views.cameras)
    x = np.random.default_rng(0).normal(size=(9, 3))
    seen = np.hstack([x @ camera.rows.T for camera in views.cameras])
    np.testing.assert_allclose(seen @ columns, 0, atol=1e-14)
    np.testing.assert_array_equal(columns[:2], -np.eye(2))
    # x and y stand once in what predicts them, each with a weight of one.
    np.testing.assert_allclose(np.abs(columns[2:]).sum(axis=0), [1, 1], atol=1e-15)


@pytest.mark.parametrize("learn", [learn_cameras_eq4, learn_cameras_lbfgs])
def test_what_eq_4_needs(small, learn):
    _, rig, tracks, _ = small
    assert learn(tracks, rig) is rig
    lost = Rig([*rig.cameras[:2], replace(rig.cameras[2], position=None)])
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs all positions, got none of"):
        learn(tracks, lost.uncalibrated())
