"""The tracker's bars, on full-size clips: accuracy, frames kept, and time relative to decoding.

Run with `pytest -s tests/benchmarks/bench_tracking.py` on an otherwise idle machine (some minutes).
"""

import time

import numpy as np
import pytest

from vidsindy_lite.study import SYSTEMS
from vidsindy_lite.vision import BACKGROUNDS, Scene, read_video, render_video, track

FRAMES = 1500
REPEATS = 3


def lorenz_track(seed, margin=40, size=(512, 512)):
    """A Lorenz orbit, projected along a random direction into the image."""
    plane, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 2)))
    y = SYSTEMS["Lorenz"].trajectory(FRAMES)[1] @ plane
    y = (y - y.min(axis=0)) / np.ptp(y, axis=0)
    return margin + y * (np.array(size) - 1 - 2 * margin)


def seconds(function):
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


@pytest.mark.parametrize("background", BACKGROUNDS)
def test_clean_textured_video(tmp_path, background):
    truth = lorenz_track(100)
    path = tmp_path / "clip.mkv"
    render_video(path, truth, Scene(background), seed=100)
    decoding = min(seconds(lambda: sum(1 for _ in read_video(path))) for _ in range(REPEATS))
    tracking = min(seconds(lambda: track(path)) for _ in range(REPEATS))
    error = np.linalg.norm(track(path).pixels - truth, axis=1)
    rms = np.sqrt(np.mean(error**2))
    print(f"\n{background}: rms {rms:.4f} px, time over decoding {tracking / decoding:.2f}")
    assert np.isfinite(error).all()
    assert rms <= 0.1
    assert tracking <= 2 * decoding
