"""Errors that all samples share: told by the rig, counted in by the law."""

import numpy as np
import pytest
from helpers import dependent, trajectory

import vidsindy_lite as vl
from vidsindy_lite import study
from vidsindy_lite.cameras import Lags, systematic_errors, tracking_errors

NOISE = 0.05  # pixels


def learned_rig(rng, memory, frames=250, path=trajectory):
    """A random rig learned from noisy tracks: the path's modes, the path, and the rig."""
    x = path(rng, frames)
    truth = vl.Rig.around(x)
    rig = truth.uncalibrated()
    tracks = [c.project(x) + NOISE * dependent(rng, frames, memory) for c in truth.cameras]
    learned = vl.learn_cameras(tracks, rig)
    still = Lags(np.zeros(3), np.ones(3), np.zeros(3), 0.0)
    modes = systematic_errors(tracks, rig, learned, still)
    return modes, x, learned


def test_errors_of_cameras_are_as_large_as_stated():
    memory = 0.6
    pulls = []
    for seed in np.random.SeedSequence(5).spawn(12):
        modes, x, learned = learned_rig(np.random.default_rng(seed), memory)
        # What the cameras' errors do to the path, in units of what they may do.
        turned = vl.reconstruct([c.project(x) for c in vl.Rig.around(x).cameras], learned) - x
        sizes, *_ = np.linalg.lstsq(modes.reshape(len(modes), -1).T, turned.ravel())
        assert np.abs(turned - np.tensordot(sizes, modes, 1)).max() < 0.02 * np.abs(turned).max()
        pulls.append(sizes)
    spread = np.sqrt(np.mean(np.square(pulls)))
    assert 0.8 < spread < 1.3  # with independent errors taken for granted: 2 at the second
    assert np.abs(pulls).max() < 5


def throw(rng, frames):
    """A ball in a vertical plane, up and down again."""
    t, azimuth = np.linspace(0, 2, frames)[:, None], rng.uniform(0, 2 * np.pi)
    velocity = np.array([2 * np.cos(azimuth), 2 * np.sin(azimuth), rng.uniform(8, 10)])
    return t * velocity - [0, 0, 4.9] * t**2


def test_errors_of_cameras_that_saw_one_short_throw_are_not_understated():
    """In 60 frames, chance alone makes the scores of residuals look like less than their noise."""
    pulls = []
    for seed in np.random.SeedSequence(6).spawn(40):
        modes, x, learned = learned_rig(np.random.default_rng(seed), 0.0, 60, throw)
        turned = vl.reconstruct([c.project(x) for c in vl.Rig.around(x).cameras], learned) - x
        sizes, *_ = np.linalg.lstsq(modes.reshape(len(modes), -1).T, turned.ravel())
        pulls.append(sizes)
    assert 0.8 < np.sqrt(np.mean(np.square(pulls))) < 1.1


def test_trails_follow_the_motion():
    """Half of the noise that the residuals show, backwards along the motion in each image."""
    x = trajectory(np.random.default_rng(4), 80)
    rig = vl.Rig.around(x)
    rng = np.random.default_rng(5)
    tracks = [c.project(x) + 0.3 * rng.normal(size=(80, 2)) for c in rig.cameras]
    tracks[1][20] = np.nan
    modes = tracking_errors(tracks, rig)
    assert modes.shape == (3, 80, 3)
    path = vl.reconstruct(tracks, rig)
    missed = np.hstack(vl.residuals(tracks, rig))
    noise = 1.4826 * np.median(np.abs(missed[np.isfinite(missed)])) * np.sqrt(2)  # 6 / (6 - 3)
    assert 0.2 < noise < 0.4
    for i, mode in enumerate(modes):
        behind = [track.copy() for track in tracks]
        for k in range(1, 79):
            step = (tracks[i][k + 1] - tracks[i][k - 1]) / 2
            if np.isfinite(step).all():
                behind[i][k] = tracks[i][k] - 0.5 * noise * step / np.sqrt(step @ step + noise**2)
        expected = np.nan_to_num(vl.reconstruct(behind, rig) - path)
        np.testing.assert_allclose(mode[1:-1], expected[1:-1], atol=1e-9 * np.ptp(x))


def test_a_lag_moves_the_path_as_far_as_it_may_be_wrong():
    x = trajectory(np.random.default_rng(6), 120)
    rig = vl.Rig.around(x)
    rng = np.random.default_rng(7)
    tracks = [c.project(x) + NOISE * rng.normal(size=(120, 2)) for c in rig.cameras]
    lags = Lags(np.zeros(3), np.ones(3), np.array([0, 0.01, 0]), 0.0)
    (mode,) = systematic_errors(tracks, rig, rig, lags)

    def path(lag):
        return vl.reconstruct(vl.align(tracks, (0, lag, 0)), rig)

    speed = np.nan_to_num((path(0.05) - path(-0.05)) / 0.1)
    size = np.sum(mode * speed) / np.sum(speed**2)
    # Slopes between frames hold some noise, and not the same.
    np.testing.assert_allclose(mode[1:-1], size * speed[1:-1], atol=0.1 * np.abs(mode).max())
    pixels = np.linalg.norm(np.gradient(tracks[1], axis=0), axis=1)
    # The residuals see part of the motion of one camera, so the error is above noise / speed.
    least = NOISE / np.sqrt(np.sum(pixels**2))
    assert least < abs(size) < 5 * least


def test_lags_that_are_exact_or_unknown_move_nothing():
    x = trajectory(np.random.default_rng(9), 60)
    rig = vl.Rig.around(x)
    tracks = [camera.project(x) for camera in rig.cameras]
    lags = Lags(np.zeros(3), np.ones(3), np.array([0, 0, np.inf]), 0.0)
    assert systematic_errors(tracks, rig, rig, lags).shape == (0, 60, 3)
    still = Lags(np.zeros(3), np.ones(3), np.zeros(3), 0.0)
    assert systematic_errors(tracks, rig, rig, still).shape == (0, 60, 3)


def test_a_clock_that_may_drift_moves_the_path_at_both_ends():
    rng = np.random.default_rng(10)
    x = trajectory(rng, 200)
    rig = vl.Rig.around(x)
    tracks = [camera.project(x) + NOISE * rng.normal(size=(200, 2)) for camera in rig.cameras]
    lags = Lags(np.zeros(3), np.ones(3), np.zeros(3), 0.0, rate_errors=np.array([0, 1e-4, 0]))
    (mode,) = systematic_errors(tracks, rig, rig, lags)
    shift = np.linalg.norm(mode, axis=1) / np.linalg.norm(np.gradient(x, axis=0), axis=1)
    assert shift[90:110].max() < 0.2 * np.quantile(shift, 0.9)
    exact = Lags(np.zeros(3), np.ones(3), np.zeros(3), 0.0)
    assert systematic_errors(tracks, rig, rig, exact).shape == (0, 200, 3)


def test_rounded_tracks_may_lie_beside_the_target():
    """As far as a place within their step is uncertain, whatever the step and the lags."""
    x = trajectory(np.random.default_rng(6), 80)
    rig = vl.Rig.around(x)
    tracks = [camera.project(x) for camera in rig.cameras]
    trails = len(tracks)
    for seed in range(10):
        exact = np.random.default_rng(seed).uniform(0, 400, (3, 1000, 2))  # not rounded
        assert len(tracking_errors(tracks, rig, raw=exact)) == trails
    for step in (0.5, 1.0, 3.0):
        rounded = [step * np.round(track / step) for track in tracks]
        rounded[0][5] = np.nan
        modes = tracking_errors(tracks, rig, raw=rounded)[trails:]
        beside = [track + step / np.sqrt(12) * np.array([1.0, -2.0]) for track in tracks]
        shift = vl.reconstruct(beside, rig) - vl.reconstruct(tracks, rig)
        np.testing.assert_allclose(modes[::2].sum(axis=0) - 2 * modes[1::2].sum(axis=0), shift)


def test_one_frame_tells_of_no_motion():
    x = trajectory(np.random.default_rng(6), 80)
    rig = vl.Rig.around(x)
    with pytest.raises(ValueError, match=r"tracks: must have two frames or more, got \[1, 1, 1\]"):
        tracking_errors([camera.project(x[:1]) for camera in rig.cameras], rig)


def test_a_law_of_marks_beside_the_target_has_no_terms_of_their_distance():
    truth = study.SYSTEMS["WangSun"].shift(study.REFERENCE_OFFSET)
    t, x = truth.trajectory(1000)
    rig = vl.Rig.around(x)
    rounded = [np.round(camera.project(x) + np.array([0.05, 0.25])) for camera in rig.cameras]
    seen = vl.observe_tracks(rounded, rig, t, lags="synchronous")
    blind = vl.discover(t, seen.x, order=1)
    told = vl.discover(t, seen.x, systematic=seen.systematic, order=1)
    assert study.score(blind, truth).false_positives > 0
    assert study.score(told, truth).exact
