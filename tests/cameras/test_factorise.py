"""Cameras of which nothing is known: lags and a path up to an affine map, by factorisation."""

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite.cameras import AffineCamera, factorised

LAGS = np.array([0.0, 17.4, -8.0, 5.5])
FPS = 30


def swinging(frames, moving=3):
    """Places of a weight that swings along three axes, each with a period of its own, in pixels."""
    t = frames / FPS
    period, size = np.array([1.3, 2.1, 0.9]), np.array([40.0, 25, 15]) * (np.arange(3) < moving)
    return size * np.cos(2 * np.pi * t[:, None] / period + [0.3, 1.0, 2.0])


def filmed(views=3, moving=3, noise=0.2, count=240, seed=0):
    """Tracks of cut-out films by cameras far away, each begun at its own time."""
    rng = np.random.default_rng(seed)
    tracks = []
    for lag in LAGS[:views]:
        axes, middle = rng.normal(size=(2, 3)), rng.uniform(50, 300, size=2)
        x = swinging(np.arange(count) + lag, moving)
        tracks.append(middle + x @ axes.T + noise * rng.normal(size=(count, 2)))
    return tracks, vl.Rig(tuple(vl.PerspectiveCamera() for _ in range(views)))


@pytest.mark.parametrize(("views", "moving"), [(3, 3), (3, 2), (4, 3)])
def test_lags_and_axes_of_motion(views, moving):
    tracks, rig = filmed(views, moving)
    found = factorised(tracks, rig, np.ones(views), None)
    assert found.moving == moving
    np.testing.assert_allclose(found.lags.frames, LAGS[:views], atol=0.1)
    assert (found.lags.errors[1:] < 0.05).all()
    assert found.lags.residual < 0.3


def test_given_lags_are_kept():
    tracks, rig = filmed()
    found = factorised(tracks, rig, np.ones(3), None, LAGS[:3])
    np.testing.assert_array_equal(found.lags.frames, LAGS[:3])
    assert found.lags.residual < 0.3


def test_views_of_different_things_do_not_agree():
    tracks, rig = filmed()
    rng = np.random.default_rng(1)
    tracks[2] = np.cumsum(rng.normal(size=(240, 2)), axis=0) * 10
    assert factorised(tracks, rig, np.ones(3), None) is None
    with pytest.raises(ValueError, match="must tell where the cameras stand"):
        vl.observe_tracks(tracks, rig, np.arange(240) / FPS)


@pytest.mark.parametrize("lags", [None, np.zeros(3)])
def test_views_with_nothing_in_common_tell_nothing(lags):
    tracks, rig = filmed()
    tracks[1][:] = np.nan
    assert factorised(tracks, rig, np.ones(3), None, lags) is None


def test_what_stands_still_tells_nothing():
    tracks, rig = filmed()
    assert factorised([np.ones_like(track) for track in tracks], rig, np.ones(3), None) is None


def test_the_law_of_a_swing_needs_no_rig():
    tracks, rig = filmed(moving=2)
    found = vl.discover_from_tracks(tracks, rig, fps=FPS)
    periods = [q for q in found.discovery.physics() if q.name.startswith("period")]
    for period, true in zip(periods, sorted((1.3, 2.1), reverse=True), strict=True):
        assert abs(period.value - true) < 4 * period.error + 1e-9
        assert period.error < 0.02 * true
    assert "frequencies and dampings" in found.rig.note
    assert max(np.nanstd(missed) for missed in found.residuals) < 0.3


def test_affine_cameras_see_what_their_axes_say_and_have_a_file(tmp_path):
    down, x = np.array([[1.0, 2, 0], [0.5, 0, -3]]), np.random.default_rng(0).normal(size=(9, 3))
    camera = AffineCamera.of(down, np.array([20.0, 30]), (100, 80))
    np.testing.assert_allclose(camera.project(x), [20, 30] + x @ down.T)
    other = AffineCamera.of(down[::-1] + 1, np.array([20.0, 30]), (100, 80))
    rig = vl.Rig((camera, other))
    rig.save(tmp_path / "rig.toml")
    assert vl.Rig.load(tmp_path / "rig.toml") == rig
    tracks = [one.project(x) for one in rig.cameras]
    np.testing.assert_allclose(vl.reconstruct(tracks, rig), x, atol=1e-10)


@pytest.mark.parametrize("axes", [np.ones((2, 3)), np.zeros((3, 2)), None, [[1, 2, np.nan]] * 2])
def test_axes_must_be_independent(axes):
    with pytest.raises(ValueError, match="axes"):
        AffineCamera(axes=axes, normal=(0, 0, 1))
