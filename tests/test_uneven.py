"""Videos whose frames are not evenly spaced: each counts at the time that its file states."""

import numpy as np
import pytest
from phones import waver, write_at
from scipy.interpolate import CubicSpline

import vidsindy_lite as vl
from vidsindy_lite import study
from vidsindy_lite.vision import render

SIZE = (320, 320)
RATE = 30.0  # frames a second
LATER = (0, 0.21, 0.0)  # seconds by which each camera starts later


@pytest.fixture(scope="module")
def motion():
    """A system, its path over seconds of video, and a rig."""
    truth = study.SYSTEMS["Lorenz"].shift(study.REFERENCE_OFFSET)
    t, x = truth.trajectory(3600, 800)  # a frame of an even camera is eight of its rows
    unit = RATE * (t[8] - t[0])
    return truth, CubicSpline(t / unit, x), vl.Rig.around(x, SIZE), unit


def filmed(motion, clocks):
    _, path, rig, _ = motion
    parts = zip(rig.cameras, clocks, LATER, strict=True)
    return [camera.project(path(seconds + later)) for camera, seconds, later in parts]


def in_own_time(found, motion):
    """The law that was found, in the unit of time of its system."""
    truth, _, _, unit = motion
    law = vl.discover(found.t * unit, found.x, systematic=found.systematic)
    return study.score(law, truth)


def test_tracks_by_their_own_clocks_give_the_path(motion):
    rng = np.random.default_rng(0)
    clocks = [waver(rng, 300) for _ in range(3)]
    seen = vl.observe_tracks(filmed(motion, clocks), motion[2].uncalibrated(0), clocks)
    step = np.median(np.diff(clocks[0]))
    np.testing.assert_allclose(seen.lags.frames * step, LATER, atol=1e-3)
    np.testing.assert_array_equal(seen.t, clocks[0])
    both = np.isfinite(seen.x).all(axis=1)
    assert both.mean() > 0.9
    assert np.abs(seen.x - motion[1](clocks[0]))[both].max() < 0.01
    assert in_own_time(seen, motion).exact


@pytest.mark.slow
def test_the_law_of_a_phones_films_is_exact(motion, tmp_path):
    rng = np.random.default_rng(5)
    clocks = [waver(rng, 200) for _ in range(3)]
    scene, paths = vl.Scene("sea", size=12, image_size=SIZE), []
    for i, track in enumerate(filmed(motion, clocks)):
        frames = render(track, scene, seed=i)
        paths.append(
            write_at(tmp_path / f"{i}.mp4", clocks[i], frames, "libx264", "yuv420p", crf="10")
        )
    found = vl.discover_from_videos(paths, motion[2].uncalibrated(0))
    assert np.abs(found.t - clocks[0]).max() < 1e-3
    step = np.median(np.diff(clocks[0]))
    np.testing.assert_allclose(found.lags.frames * step, LATER, atol=1e-3)
    assert in_own_time(found, motion).exact
