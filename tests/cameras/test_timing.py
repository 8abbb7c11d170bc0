"""One fit of cameras and lags: what it tells, and by how much lags may be wrong."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import dependent, filmed

from vidsindy_lite.cameras import learn_lags
from vidsindy_lite.cameras.adjust import PARTS, SIZE
from vidsindy_lite.cameras.alignment import Footage
from vidsindy_lite.cameras.synchronise import Timing


def test_a_slope_that_is_noise_tells_nothing(motion, monkeypatch):
    # If half of each squared slope is motion, it tells half as much of the noise that it collects.
    tracks, errors = filmed(motion, (60,) * 3, (0, 0, 0)), {}
    for share in (1, 0.5):
        shares = np.full(2, share)
        monkeypatch.setattr(Timing, "shares", shares)
        errors[share] = learn_lags(tracks, motion[1]).errors
    assert (errors[1][1:] > 0).all()
    np.testing.assert_allclose(errors[0.5], 2 * errors[1], rtol=1e-9)


def test_slopes_that_are_noise_make_errors_larger(motion, monkeypatch):
    """Of drifts as of lags: half of the information is half as much slope for the same noise."""
    tracks = filmed(motion, (250,) * 3, (0, 0, 0))
    kept = []
    told = Timing.covariance.fget
    monkeypatch.setattr(Timing, "covariance", property(lambda fit: kept.append(fit) or told(fit)))
    learn_lags(tracks, motion[1])
    free = next(fit for fit in kept if np.isinf(fit.fit.errors).sum() == 4)  # two lags, two drifts
    monkeypatch.setattr(Timing, "shares", np.ones(2))
    best = told(free)
    monkeypatch.setattr(Timing, "shares", np.array([0.5, 1.0]))
    errors = np.sqrt(np.diag(told(free)) / np.diag(best))
    np.testing.assert_allclose(errors, [2, 1, 2, 1], rtol=1e-12)


LAG, DRIFT = PARTS["lag"].start, PARTS["drift"].start


def fitted(motion, lags=(0, 0, 0), frames=120, rates=(1, 1, 1), **more):
    """A known rig, and nothing known of lags."""
    tracks = filmed(motion, (frames,) * 3, lags, rates, **more)
    errors = np.zeros((3, SIZE))
    errors[1:, LAG] = np.inf
    return Timing.of(Footage.of(tracks), motion[1].cameras, errors)


def missing(timing, misses):
    """The same, if residuals were these."""
    return replace(timing, fit=replace(timing.fit, misses=misses, weights=np.ones(len(misses))))


def test_lags_are_near_if_all_are_less_than_a_frame_apart(motion):
    timing = fitted(motion, (0, 0.6, -0.4), noise=0.0)
    np.testing.assert_allclose(timing.lags, [0, 0.6, -0.4], atol=1e-3)
    assert timing.near(np.array([0, 1.59, 0.59]))
    assert not timing.near(np.array([0, 0.6, 0.61]))


def test_residual_and_score_are_those_of_the_worst_camera(motion):
    rng = np.random.default_rng(0)
    misses = rng.normal(size=(120, 6)) * np.repeat([0.1, 0.3, 0.2], 2)
    timing = missing(fitted(motion), misses)
    lengths = np.hypot(misses[:, 2], misses[:, 3])
    assert timing.missed.shape == (3, 120, 2)
    assert timing.residual == pytest.approx(np.quantile(lengths, 0.9))
    # Rayleigh's: the share of lengths below r is 1 - exp(-r^2 / 2 sigma^2).
    ratio = np.sqrt(np.log(0.1) / np.log(0.3))
    assert timing.score == pytest.approx(ratio * np.quantile(lengths, 0.7))


@pytest.mark.parametrize(
    ("size", "memory", "agrees"),
    [(0.1, 0.0, True), (2.0, 0.0, True), (1e3, 0.0, False), (0.01, 0.9, False), (1.0, 0.35, True),
     (2.0, 0.35, False)],
)  # fmt: skip
def test_noise_agrees_and_what_persists_does_not(motion, size, memory, agrees):
    """Noise however large, unless it is gross; what is like the next frame's, if it is small."""
    rng = np.random.default_rng(0)
    misses = size * np.hstack([dependent(rng, 400, memory) for _ in range(3)])
    assert missing(fitted(motion), misses / 2).agrees is agrees


def test_the_share_of_a_slope_that_is_motion(motion):
    """Each of three views leaves one number a frame; its noise of .3 has a slope, too."""
    timing = fitted(motion)
    steep = np.sum(timing.fit.slopes**2, axis=(0, 1))
    timing = replace(timing, fit=replace(timing.fit, noise=0.3, weights=np.ones(120)))
    seen = np.isfinite(timing.fit.misses[:, ::2])
    views = np.maximum(seen.sum(axis=1, keepdims=True), 2)
    freedom = np.sum(seen * (2 - 3 / views), axis=0)[1:]
    chance = 0.5 * 0.3**2 * (freedom + 2 * np.sqrt(2 * freedom))
    np.testing.assert_allclose(timing.shares, 1 - chance / steep, rtol=1e-9)
    assert 0 < timing.shares.min() < timing.shares.max() < 1
    lost = replace(timing, fit=replace(timing.fit, noise=1e6))
    assert lost.shares.tolist() == [0, 0]


@pytest.mark.parametrize(("frames", "enough"), [(1, False), (2, True)])
def test_views_in_common_tell_of_each_lag_three_numbers_a_frame(motion, frames, enough):
    """Four unknowns need more than that: two frames, not one."""
    tracks = filmed(motion, (40,) * 3, (0, 0, 0))
    for track in tracks[1:]:
        track[frames:] = np.nan
    errors = np.zeros((3, SIZE))
    errors[1:, [LAG, DRIFT]] = np.inf
    timing = Timing.of(Footage.of(tracks), motion[1].cameras, errors, most=0)
    assert (timing is not None) == enough


def test_a_clock_that_drifts_clearly_is_freed_and_no_other(motion):
    """By half a frame in 250, twenty times its error; the third one's stays even."""
    rate = 1 + 0.5 / 250
    plain = fitted(motion, frames=250, rates=(1, rate, 1))
    drifted = plain.drifted()
    drift = drifted.fit.change[:, DRIFT]
    assert drift[1] == pytest.approx(-0.5, rel=0.05)
    assert drift[[0, 2]].tolist() == [0, 0]
    assert drifted.residual < 0.7 * plain.residual
    even = fitted(motion, frames=250)
    assert even.drifted() is even
