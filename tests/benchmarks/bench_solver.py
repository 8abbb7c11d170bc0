"""The solver: time and memory, against the paper's optimiser; the tracker.

Run with `make bench` on an otherwise idle machine (about half an hour). Every bar is a ratio taken
in one run, or a time of the processor.
"""

import time
import tracemalloc

import numpy as np
import pytest

from vidsindy_lite.dynamics import discover
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, add_noise
from vidsindy_lite.vision import BACKGROUNDS, Scene, read_video, render_video, track


def note(benchmark, case, value, unit, bar=""):
    row = benchmark, case, f"{value:.4g}", unit, bar
    print("\n", " | ".join(f"{entry!s:>14}" for entry in row), end="")


def measured(name, noise, n=1500, seed=0):
    truth = SYSTEMS[name].shift(REFERENCE_OFFSET)
    t, x = truth.trajectory(n)
    return truth, t, add_noise(x, noise, np.random.default_rng(seed))


def seconds(function, *arguments, **options):
    start = time.process_time()
    result = function(*arguments, **options)
    return time.process_time() - start, result


def test_median_time_over_the_systems():
    spent = []
    for name in SYSTEMS:
        _, t, x = measured(name, 0.1)
        spent.append(seconds(discover, t, x)[0])
        note("time, 1500 samples", name, spent[-1], "s")
    note("time, 1500 samples", "median", np.median(spent), "s", "4")
    assert np.median(spent) <= 4


def test_time_and_memory_are_linear_in_the_samples():
    spent, peaks = [], []
    for n in (1500, 5000, 15000, 60000):
        _, t, x = measured("Lorenz", 0.1, n)
        spent.append(seconds(discover, t, x)[0])
        tracemalloc.start()
        discover(t, x)
        peaks.append(tracemalloc.get_traced_memory()[1] / 1e9)
        tracemalloc.stop()
        note("samples", n, spent[-1], "s")
        note("samples", n, peaks[-1], "GB", "0.5")
    note("samples", "15000 over 1500", spent[2] / spent[0], "ratio", "12")
    note("samples", "60000 over 15000", spent[3] / spent[2], "ratio", "5")
    assert spent[2] <= 12 * spent[0]
    assert spent[3] <= 5 * spent[2]
    assert peaks[2] < 0.5


@pytest.mark.parametrize("background", BACKGROUNDS)
def test_tracking_takes_at_most_twice_as_long_as_decoding_and_keeps_all_frames(
    tmp_path, background
):
    """A Lorenz orbit, projected along a random direction into the image."""
    plane, _ = np.linalg.qr(np.random.default_rng(100).normal(size=(3, 2)))
    truth = SYSTEMS["Lorenz"].trajectory(1500)[1] @ plane
    truth = 40 + (truth - truth.min(axis=0)) / np.ptp(truth, axis=0) * (512 - 1 - 2 * 40)
    path = render_video(tmp_path / "clip.mkv", truth, Scene(background), seed=100)
    decoding = min(seconds(lambda: sum(1 for _ in read_video(path)))[0] for _ in range(3))
    tracking, found = min((seconds(track, path) for _ in range(3)), key=lambda one: one[0])
    error = np.linalg.norm(found.pixels - truth, axis=1)
    note("tracking", background, np.sqrt(np.mean(error**2)), "px rms", "0.1")
    note("tracking", background, tracking / decoding, "of decoding", "2")
    assert np.isfinite(error).all()
    assert np.sqrt(np.mean(error**2)) <= 0.1
    assert tracking <= 2 * decoding
