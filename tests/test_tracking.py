"""The tracker against the exact positions of rendered targets, and what it must not invent."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidsindy_lite.cameras import Rig
from vidsindy_lite.systems import REFERENCE_OFFSET, SYSTEMS
from vidsindy_lite.tracking import _shape, track
from vidsindy_lite.video import (
    COLOURS,
    SHAPES,
    Scene,
    _coverage,
    render,
    render_video,
    write_video,
)

pytestmark = pytest.mark.slow  # renders and tracks videos

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


def shape_of(polygon, hidden=0):
    """The shape numbers of a polygon (m, 2) of which the last `hidden` pixels to the right lack."""
    alpha, corner = _coverage(polygon)
    u, v = np.arange(alpha.shape[1]), np.arange(alpha.shape[0])
    alpha[:, u + corner[0] > polygon[:, 0].max() - hidden] = 0
    centre = [alpha.sum(axis=0) @ u, alpha.sum(axis=1) @ v] / alpha.sum()
    return _shape(alpha, u - centre[0], v - centre[1])


@settings(deadline=None, max_examples=50)
@given(
    seed=st.integers(0, 1000),
    form=st.sampled_from(SHAPES),
    angle=st.floats(0, 2 * np.pi),
    scale=st.floats(0.5, 2),
)
def test_whole_views_are_alike(seed, form, angle, scale):
    outline = Scene(shape=form, size=24, shape_seed=seed).outline()
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    view = [0.3, 0.4] + scale * outline @ turn
    assert np.linalg.norm(shape_of(view) - shape_of(outline)) < 0.6 / (18 * min(scale, 1))


@settings(deadline=None, max_examples=50)
@given(size=st.floats(8, 40), share=st.floats(0.1, 0.8))
def test_a_part_of_a_disc_is_no_disc(size, share):
    disc = Scene(size=size).outline()
    assert np.linalg.norm(shape_of(disc, share * size) - shape_of(disc)) > 0.04


@pytest.mark.parametrize("form", SHAPES)
def test_a_target_that_lingers_half_hidden_is_not_trusted(tmp_path, form):
    # It spends most of the clip across the edge of a post, and never vanishes behind it.
    truth = winding_path(200)
    k = np.arange(130)
    truth[35:165] = np.column_stack([108 + 3 * np.sin(k / 9), 96 + 60 * np.sin(k / 20)])
    post = (112, 0, 40, SIZE[1])
    scene = Scene(
        "bricks", shape=form, size=22, turns=3, shape_seed=5, occluders=(post,), image_size=SIZE
    )
    error = errors(render_video(tmp_path / "clip.mkv", truth, scene, seed=1), truth)
    distance = distance_to_rectangle(truth, post)
    assert np.isnan(error[distance < 8]).all()
    assert np.isfinite(error[distance > 16]).mean() > 0.97
    assert np.nanmax(error) < 0.3


@pytest.mark.parametrize("frames", [200, 400])
def test_a_chaotic_orbit_that_turns_at_the_edge_of_a_post(tmp_path, frames):
    _, x = SYSTEMS["SprottE"].shift(REFERENCE_OFFSET).trajectory(frames, 100)
    truth = Rig.around(x).cameras[0].project(x)
    post = (230, 0, 50, 512)
    scene = Scene("hills", size=18, occluders=(post,))
    error = errors(render_video(tmp_path / "clip.mkv", truth, scene, seed=1), truth)
    assert np.isfinite(error[distance_to_rectangle(truth, post) > 10]).mean() > 0.97
    assert np.nanmax(error) < 0.3


def test_an_occluder_of_the_colour_of_the_target(tmp_path):
    truth = winding_path(200)
    post = (100, 0, 30, SIZE[1])

    def frames():
        for frame in render(truth, Scene("sky", size=22, image_size=SIZE), 3):
            frame[:, post[0]:post[0] + post[2]] = COLOURS["red"]
            yield frame

    error = errors(write_video(tmp_path / "clip.mkv", frames()), truth)
    assert np.isfinite(error[distance_to_rectangle(truth, post) > 16]).mean() > 0.97
    assert np.nanmax(error) < 0.3


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


def circle(radius, n=150):
    angle = np.linspace(0, 20, n)
    return [120, 90] + radius * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("variance", [0, 0.005])
@pytest.mark.parametrize("radius", [0, 2, 5])
@pytest.mark.parametrize("form", ["disc", "polygon"])
def test_a_target_that_never_leaves_its_place_is_background(tmp_path, form, radius, variance):
    truth = circle(radius)
    scene = Scene("sea", form, size=18, turns=2, noise_variance=variance, image_size=SIZE)
    assert np.isnan(track(render_video(tmp_path / "clip.mkv", truth, scene, seed=2))).all()


def test_a_target_that_leaves_its_place_by_its_own_width_is_tracked(tmp_path):
    truth = circle(10)
    scene = Scene("sea", size=18, image_size=SIZE)
    error = errors(render_video(tmp_path / "clip.mkv", truth, scene, seed=2), truth)
    assert np.isfinite(error).mean() > 0.97
    assert np.nanmax(error) < 0.1


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
