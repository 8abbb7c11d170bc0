"""The tracker against the exact positions of rendered targets, and what it must not invent."""

import cv2
import numpy as np
import pytest

from vidsindy_lite.tracking import track
from vidsindy_lite.video import Scene, render, render_video, write_video

SIZE = (256, 192)


def winding_path(n=150, size=SIZE, margin=28):
    """A smooth path over the whole image, 4 to 9 pixels a frame."""
    t = np.linspace(0, 1, n)
    middle = (np.array(size) - 1) / 2
    return middle + (middle - margin) * np.column_stack([
        np.sin(2 * np.pi * 2 * t * n / 150), np.sin(2 * np.pi * 3 * t * n / 150 + 0.7)
    ])


def errors(path, truth):
    return np.linalg.norm(track(path) - truth, axis=1)


def distance_to_rectangle(points, rectangle):
    left, top, width, height = rectangle
    low = np.array([left, top]) - 0.5
    return np.linalg.norm(points - np.clip(points, low, low + [width, height]), axis=1)


@pytest.mark.parametrize("background", ["plain", "sky", "hills", "sea", "wood", "bricks"])
def test_clean_textured_video(tmp_path, background):
    truth = winding_path()
    scene = Scene(background, size=18, image_size=SIZE)
    error = errors(render_video(tmp_path / "clip.mkv", truth, scene, seed=1), truth)
    assert np.isfinite(error).all()
    assert np.sqrt(np.mean(error**2)) < 0.02


@pytest.mark.parametrize("seed", range(6))
def test_random_scenes(tmp_path, seed):
    truth = winding_path(margin=45)  # holds the largest outline, a triangle of area pi 24^2
    scene = Scene.random(seed, image_size=SIZE, size_variation=0.2)
    error = errors(render_video(tmp_path / "clip.mkv", truth, scene, seed=seed), truth)
    assert np.isfinite(error).mean() >= 0.99
    assert np.nanmedian(error) < 0.05


@pytest.mark.parametrize("seed", range(2))
def test_image_noise(tmp_path, seed):
    truth = winding_path(100)
    scene = Scene.random(
        seed, size=18, noise_variance=0.01, size_variation=0.2, image_size=SIZE
    )
    path = render_video(tmp_path / "clip.mkv", truth, scene, seed=seed)
    difference = track(path) - truth
    assert np.isfinite(difference[:, 0]).mean() >= 0.97
    assert np.sqrt(np.nanmean(difference**2)) < 0.15
    assert np.abs(np.nanmean(difference, axis=0)).max() < 0.04


@pytest.mark.parametrize(("name", "codec"), [("a.mp4", "mp4v"), ("a.avi", "MJPG")])
def test_lossy_codecs(tmp_path, name, codec):
    truth = winding_path()
    frames = render(truth, Scene("hills", size=20, image_size=SIZE), 0)
    error = errors(write_video(tmp_path / name, frames, codec=codec), truth)
    assert np.isfinite(error).mean() >= 0.99
    assert np.nanmedian(error) < 0.15


def test_grey_video(tmp_path):
    truth = winding_path()
    grey = (
        cv2.cvtColor(cv2.cvtColor(f, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
        for f in render(truth, Scene("sky", size=16, colour="black", image_size=SIZE), 2)
    )
    error = errors(write_video(tmp_path / "grey.mkv", grey), truth)
    assert np.isfinite(error).all()
    assert error.max() < 0.1


@pytest.mark.parametrize("variance", [0, 0.005])
@pytest.mark.parametrize("post", [(100, 20, 44, 172), (120, 20, 12, 172)])
def test_a_hidden_target_is_not_seen_and_a_partly_hidden_one_not_trusted(tmp_path, post, variance):
    truth = winding_path(200)
    scene = Scene(
        "bricks", size=22, size_variation=0.1, noise_variance=variance, occluders=(post,),
        image_size=SIZE,
    )
    error = errors(render_video(tmp_path / "clip.mkv", truth, scene, seed=4), truth)
    distance = distance_to_rectangle(truth, post)
    assert np.isnan(error[distance < 8]).all()
    assert np.isfinite(error[distance > 14]).mean() > 0.97
    assert np.nanmax(error) < 0.5


def test_a_target_across_the_border_is_not_trusted(tmp_path):
    truth = winding_path(150, margin=0)
    scene = Scene("wood", size=20, image_size=SIZE)
    error = errors(render_video(tmp_path / "clip.mkv", truth, scene), truth)
    depth = np.minimum(truth, np.array(SIZE) - 1 - truth).min(axis=1)
    assert np.isnan(error[depth < 9.5]).all()
    assert np.isfinite(error[depth > 12]).all()
    assert np.nanmax(error) < 0.1


def test_frames_without_target_are_nan_and_it_is_found_again(tmp_path):
    truth = winding_path()
    drawn = truth.copy()
    drawn[40:60] = np.nan
    path = render_video(tmp_path / "clip.mkv", drawn, Scene("sea", size=14, image_size=SIZE))
    found = track(path)
    assert np.array_equal(np.isnan(found[:, 0]), np.isnan(drawn[:, 0]))
    assert np.nanmax(np.abs(found - drawn)) < 0.05


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_a_target_that_stays_for_long_leaves_no_ghost(tmp_path, share):
    n, stay = 150, int(150 * share)
    truth = np.tile([60.0, 60.0], (n, 1))
    truth[stay:] += np.linspace(0, 1, n - stay)[:, None] * [150, 80]
    error = errors(
        render_video(tmp_path / "clip.mkv", truth, Scene("bricks", size=24, image_size=SIZE)), truth
    )
    assert np.isfinite(error).mean() > 0.97
    assert np.nanmax(error) < 0.3


@pytest.mark.parametrize("variance", [0, 0.01])
def test_nothing_is_invented_in_an_empty_scene(tmp_path, variance):
    scene = Scene("hills", noise_variance=variance, image_size=SIZE)
    path = render_video(tmp_path / "clip.mkv", np.full((40, 2), np.nan), scene)
    found = track(path)
    assert found.shape == (40, 2)
    assert np.isnan(found).all()


def test_a_single_frame_shows_no_motion(tmp_path):
    path = render_video(tmp_path / "clip.mkv", [[80.0, 80.0]], Scene(image_size=SIZE))
    assert np.isnan(track(path)).all()


def test_a_long_clip_is_sampled_by_jumps(tmp_path):
    size = (96, 80)
    truth = winding_path(600, size, margin=14)
    path = render_video(tmp_path / "clip.mkv", truth, Scene("sea", size=10, image_size=size))
    error = errors(path, truth)
    assert np.isfinite(error).mean() >= 0.99
    assert np.nanmax(error) < 0.1


def test_bad_files(tmp_path):
    with pytest.raises(FileNotFoundError, match="path: no such video file"):
        track(tmp_path / "missing.mkv")
    empty = tmp_path / "empty.mkv"
    empty.touch()
    with pytest.raises(ValueError, match="got the empty file"):
        track(empty)
