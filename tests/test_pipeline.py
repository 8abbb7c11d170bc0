"""From video files to equations, and what is refused on the way."""

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite.experiments import film


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return film("Lorenz", tmp_path_factory.mktemp("film"), frames=200, seed=3)


def test_exact_equations_from_video_files(shot):
    found = vl.discover_from_videos(shot.paths, shot.rig.uncalibrated(keep=0), shot.t)
    assert vl.score(found, shot.truth).exact
    assert vl.score(found, shot.truth).l2 < 5e-3
    assert all(camera.is_calibrated for camera in found.rig.cameras)
    assert found.x.shape == (200, 3)
    assert [track.shape for track in found.tracks] == [(200, 2)] * 3


def test_time_of_a_frame_comes_from_the_frame_rate(shot):
    found = vl.discover_from_videos(shot.paths, shot.rig, degree=2)
    np.testing.assert_allclose(found.t, np.arange(200) / 25)


def test_same_seed_same_film(tmp_path):
    films = []
    for folder in ("first", "second"):
        (tmp_path / folder).mkdir()
        films.append(film("Lorenz", tmp_path / folder, frames=8, seed=3))
    for ours, theirs in zip(films[0].paths, films[1].paths, strict=True):
        pairs = zip(vl.read_video(ours), vl.read_video(theirs), strict=True)
        assert all((a == b).all() for a, b in pairs)


def test_fast_files_hold_the_same_film(shot, tmp_path):
    fast = film("Lorenz", tmp_path, frames=200, seed=3, suffix=".avi")
    for ours, theirs in zip(fast.paths, shot.paths, strict=True):
        assert ours.suffix == ".avi"
        pairs = zip(vl.read_video(ours), vl.read_video(theirs), strict=True)
        assert all((a == b).all() for a, b in pairs)
    np.testing.assert_array_equal(vl.track(fast.paths[0]), vl.track(shot.paths[0]))


def test_unknown_benchmark_is_named(tmp_path):
    with pytest.raises(ValueError, match="name: must be one of Lorenz, .* got 'Lorentz'"):
        film("Lorentz", tmp_path)


def test_missing_file(shot, tmp_path):
    with pytest.raises(FileNotFoundError, match="nothing.mkv"):
        vl.discover_from_videos([*shot.paths[:2], tmp_path / "nothing.mkv"], shot.rig)


def test_wrong_number_of_files(shot):
    with pytest.raises(
        ValueError, match=r"paths: there must be one video per camera .*\(3\), got 2"
    ):
        vl.discover_from_videos(shot.paths[:2], shot.rig)


def test_videos_of_different_length(shot, tmp_path):
    short = tmp_path / "short.mkv"
    frames = [frame for frame, _ in zip(vl.read_video(shot.paths[2]), range(20), strict=False)]
    vl.write_video(short, frames)
    with pytest.raises(
        ValueError, match="same number of frames, got .*: 200, .*: 200, short.mkv: 20"
    ):
        vl.discover_from_videos([*shot.paths[:2], short], shot.rig)


def test_image_size_must_be_that_of_the_camera(shot, tmp_path):
    small = tmp_path / "small.mkv"
    vl.write_video(small, (frame[:128, :128] for frame in vl.read_video(shot.paths[2])))
    with pytest.raises(ValueError, match=r"small.mkv must have the image size .* got \(128, 128\)"):
        vl.discover_from_videos([*shot.paths[:2], small], shot.rig)


def test_wrong_number_of_times(shot):
    with pytest.raises(
        ValueError, match=r"t: must have shape \(200,\), one per frame, got \(10,\)"
    ):
        vl.discover_from_videos(shot.paths, shot.rig, np.arange(10))
