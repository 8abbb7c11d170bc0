"""From video files to equations, and what is refused on the way."""

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite import study
from vidsindy_lite.study import film

# Films its videos; most tests discover from the same ones.
pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("tracked_once")]


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return film("Lorenz", tmp_path_factory.mktemp("film"), frames=200, seed=3)


def test_exact_equations_from_video_files(shot):
    found = vl.discover_from_videos(shot.paths, shot.rig.uncalibrated(keep=0), shot.t)
    assert study.score(found.discovery, shot.truth).exact
    assert study.score(found.discovery, shot.truth).l2 < 5e-3
    assert all(camera.is_calibrated for camera in found.rig.cameras)
    assert found.x.shape == found.fitted.shape == (200, 3)
    off = [np.sqrt(np.mean((x - shot.x) ** 2)) for x in (found.fitted, found.x)]
    assert off[0] < 0.5 * off[1]
    assert [track.shape for track in found.tracks] == [(200, 2)] * 3
    assert not any("rig" in warning for warning in found.warnings)


@pytest.fixture(scope="module")
def late(shot):
    """The second video without its first 7 frames and its last 20."""
    path = shot.paths[1].with_name("late.mkv")
    vl.write_video(path, list(vl.read_video(shot.paths[1]))[7:180])
    return path


def test_videos_of_different_length_that_start_at_different_times(shot, late):
    paths = [shot.paths[0], late, shot.paths[2]]
    found = vl.observe(paths, shot.rig.uncalibrated(), shot.t)
    np.testing.assert_allclose(found.lags.frames, (0, 7, 0), atol=0.01)
    assert np.isnan(found.tracks[1][:7]).all()
    np.testing.assert_allclose(found.tracks[1][7:180], shot.tracks[1][7:180], atol=0.1)
    assert len(found.x) == len(found.t) == 200
    assert not any("lags" in warning for warning in found.warnings)


def test_given_lags_are_used(shot, late):
    paths = [late, shot.paths[0], shot.paths[2]]  # the first one is the clock
    first, second, third = shot.rig.cameras
    rig = vl.Rig([second, first, third])
    found = vl.observe(paths, rig, shot.t[7:180], lags=(7, 0, 0))
    assert found.lags.frames.tolist() == [0, -7, -7]
    assert found.lags.errors.tolist() == [0, 0, 0]
    assert max(np.nanmax(np.abs(r)) for r in vl.residuals(found.tracks, found.rig)) < 0.2
    assert not any("lags" in warning for warning in found.warnings)


def test_different_frame_rates(shot, tmp_path):
    half = tmp_path / "half.mkv"
    vl.write_video(half, list(vl.read_video(shot.paths[2]))[::2], fps=12.5)
    found = vl.observe([*shot.paths[:2], half], shot.rig)
    np.testing.assert_allclose(found.lags.rates, (1, 1, 0.5))
    np.testing.assert_allclose(found.lags.frames, 0, atol=0.01)
    assert np.nanmax(np.abs(found.x - shot.x)) < 5 * shot.rig.cameras[0].scale


@pytest.fixture
def untracked(monkeypatch):
    """No film may be tracked."""
    monkeypatch.setattr(vl.vision, "track", lambda *_, **__: pytest.fail("tracked a film"))


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ({"paths": ["a.mkv", "b.mkv"]}, {}, "paths: must be one per camera .*, got 2 for 3"),
        ({"t": np.arange(10)}, {}, r"t: must have shape \(200,\), one per frame of the .* \(10,\)"),
        ({"rig": "rig.toml"}, {}, "rig: must be of type Rig, got 'rig.toml'"),
        ({"paths": "a.mkv"}, {}, "paths: must be a list, one per camera .* got 'a.mkv'"),
        ({"paths": ["a.mkv", None, "c.mkv"]}, {}, r"paths\[1\]: must be the name of a file"),
        ({"paths": ["\udcff.mkv"] * 3}, {}, r"paths\[0\]: must be made of characters, got"),
        (
            {"paths": ["a.mkv", "b.mkv", "a.mkv"]},
            {},
            "paths: must be another video .* got 'a.mkv' 2",
        ),
        ({}, {"degree": 0}, "degree: must be an integer of at least 1, got 0"),
        ({}, {"library": "fourier(1)"}, "library: must be of type Library, got 'fourier"),
        ({}, {"origin": "home"}, "origin: must be one of learn, data, got 'home'"),
        ({}, {"orientation": "learn", "targets": 2}, "orientation: can be learned of two or three"),
        ({}, {"lags": (0, 7)}, "lags: must be 3 finite numbers"),
        ({}, {"detector": "yolo"}, "detector: must be one of auto, background, learned, or"),
        ({}, {"seed": -1}, "seed: must be an integer of at least 0, got -1"),
        ({"t": np.arange(200)[::-1]}, {}, "t: must increase"),
    ],
)
def test_what_is_cheap_is_checked_before_tracking(shot, untracked, arguments, options, message):
    given = {"paths": shot.paths, "rig": shot.rig} | arguments
    with pytest.raises(ValueError, match=message):
        vl.discover_from_videos(**given, **options)


def test_observing_tracks_is_observing_their_videos(shot, monkeypatch):
    seen = vl.observe(shot.paths, shot.rig.uncalibrated(keep=0), shot.t, lags=(0, 0, 0))
    rig = shot.rig.uncalibrated(keep=0)
    again = vl.observe_tracks(seen.tracks, rig, shot.t, lags=(5, 5, 5))
    np.testing.assert_array_equal(again.x, seen.x)
    np.testing.assert_array_equal(again.systematic, seen.systematic)
    assert again.warnings == seen.warnings == ()
    with pytest.raises(ValueError, match=r"t: must have shape \(200,\), one per row of tracks"):
        vl.observe_tracks(seen.tracks, rig, shot.t[1:])
    shares = [track / shot.rig.cameras[0].image_size for track in seen.tracks]
    with pytest.raises(ValueError, match=r"tracks: must be in pixels, got tracks.0. with all"):
        vl.observe_tracks(shares, rig, shot.t)
    with pytest.raises(ValueError, match=r"tracks.1.: must see the target in some frame"):
        vl.observe_tracks([seen.tracks[0], np.nan * shares[1], seen.tracks[2]], rig, shot.t)
