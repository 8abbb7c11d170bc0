"""The tracker against the exact positions of rendered targets, and what it must not invent."""

import numpy as np
import pytest
from tiny_onnx import write_red_detector

from vidsindy_lite import Hint
from vidsindy_lite.vision import track_targets
from vidsindy_lite.vision.rendering import Scene, render_restless, render_video
from vidsindy_lite.vision.tracking import LEAST, Detection, link, track
from vidsindy_lite.vision.video import write_video

SIZE = (256, 192)


def winding_path(n=150, size=SIZE, margin=28):
    """A smooth path over the whole image, 4 to 9 pixels a frame."""
    t = np.linspace(0, 1, n)
    middle = (np.array(size) - 1) / 2
    return middle + (middle - margin) * np.column_stack(
        [np.sin(2 * np.pi * 2 * t * n / 150), np.sin(2 * np.pi * 3 * t * n / 150 + 0.7)]
    )


def tracked(folder, truth, background, size, seed=0, detector="auto", **look):
    """What is found of a target of this size that is filmed before a background."""
    scene = Scene(background, size=size, image_size=SIZE, **look)
    return track(render_video(folder / "clip.mov", truth, scene, seed=seed), detector)


def errors(found, truth):
    return np.linalg.norm(found.pixels - truth, axis=1)


def distance_to_rectangle(points, rectangle):
    left, top, width, height = rectangle
    low = np.array([left, top]) - 0.5
    return np.linalg.norm(points - np.clip(points, low, low + [width, height]), axis=1)


@pytest.mark.parametrize("background", ["plain", "wood", "sky", "bricks"])
def test_an_ordinary_video_raises_no_doubt(tmp_path, background):
    clean, truth = background in ("plain", "wood"), winding_path(60)
    found = tracked(tmp_path, truth, background, 18, 1, noise_variance=0 if clean else 0.01)
    error = errors(found, truth)
    assert np.isfinite(error).all()
    assert np.sqrt(np.mean(error**2)) < (0.02 if clean else 0.2)
    assert found.detector == "background"
    assert found.warnings == ()
    np.testing.assert_array_equal(found.pixels, track(tmp_path / "clip.mov", "background").pixels)


@pytest.mark.parametrize(
    ("post", "variance"), [((100, 20, 44, 172), 0), ((120, 20, 12, 172), 0.005)]
)
def test_a_hidden_target_is_not_seen_and_a_partly_hidden_one_not_trusted(tmp_path, post, variance):
    truth = winding_path(200)
    look = {"size_variation": 0.1, "noise_variance": variance, "occluders": (post,)}
    error = errors(tracked(tmp_path, truth, "bricks", 22, 4, **look), truth)
    distance = distance_to_rectangle(truth, post)
    assert np.isnan(error[distance < 8]).all()
    assert np.isfinite(error[distance > 14]).mean() > 0.93
    assert np.nanmax(error) < (0.5 if variance else 0.01)


def test_a_target_across_the_border_is_not_trusted(tmp_path):
    truth = winding_path(100, margin=0)
    error = errors(tracked(tmp_path, truth, "wood", 20), truth)
    depth = np.minimum(truth, np.array(SIZE) - 1 - truth).min(axis=1)
    assert np.isnan(error[depth < 9.5]).all()
    assert np.isfinite(error[depth > 12]).all()
    assert np.nanmax(error) < 0.1


def test_frames_without_target_are_nan_and_it_is_found_again(tmp_path):
    drawn = winding_path(100)
    drawn[40:60] = np.nan
    found = tracked(tmp_path, drawn, "sea", 14)
    unseen = np.isnan(drawn[:, 0])
    assert np.array_equal(np.isnan(found.pixels[:, 0]), unseen)
    assert np.nanmax(np.abs(found.pixels - drawn)) < 0.05
    assert (found.confidence[unseen] == 0).all()
    assert (found.confidence[~unseen] > np.exp(-1)).all()
    assert found.confidence.max() <= 1
    np.testing.assert_array_equal(np.asarray(found), found.pixels)
    assert np.asarray(found, np.float32).dtype == np.float32


def test_a_target_that_stays_for_long_leaves_no_ghost(tmp_path):
    n, stay = 100, 60
    truth = np.tile([60.0, 60.0], (n, 1))
    truth[stay:] += np.linspace(0, 1, n - stay)[:, None] * [150, 80]
    error = errors(tracked(tmp_path, truth, "bricks", 24), truth)
    assert np.isfinite(error).mean() > 0.93
    assert np.nanmax(error) < 0.1


@pytest.mark.parametrize(("shown", "pace"), [(range(12, 50), 1.0), (range(22, 39), 3.0)])
def test_what_is_in_few_of_the_sampled_frames_leaves_no_hole_in_the_ground(tmp_path, shown, pace):
    truth = np.full((400, 2), np.nan)
    truth[shown] = [60, 90] + np.outer(np.arange(len(shown)), [pace, 0.0])
    found = tracked(tmp_path, truth, "bricks", 24, 1).pixels
    assert np.isnan(found[np.isnan(truth)]).all()
    assert np.nanmax(np.abs(found - truth), initial=0) < 0.1


def circle(radius, n=150):
    angle = np.linspace(0, 20, n)
    return [120, 90] + radius * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("radius", [2, 4])
def test_a_target_that_hardly_leaves_its_place_is_followed_at_its_middle(tmp_path, radius):
    truth, size = circle(radius, 60), 18
    found = tracked(tmp_path, truth, "sea", size, 2)
    box = Hint(frame=10, box=(*(truth[10] - size / 2), size, size))
    for one in (found, track(tmp_path / "clip.mov", target=box)):
        error = errors(one, truth)
        assert np.isfinite(error).mean() > 0.95
        assert np.nanmax(error) < 0.6


def test_nothing_is_invented_in_an_empty_scene(tmp_path):
    found = tracked(tmp_path, np.full((40, 2), np.nan), "hills", 18, noise_variance=0.01).pixels
    assert found.shape == (40, 2)
    assert np.isnan(found).all()
    still = tracked(tmp_path, circle(0, 60), "sea", 18, 2)  # it is background
    assert np.isnan(still.pixels).all()


def test_a_single_frame_shows_no_motion(tmp_path):
    with pytest.raises(ValueError, match="path: must hold two frames or more, got one in"):
        tracked(tmp_path, [[80.0, 80.0]], "hills", 18)


def shaking(n, seed=0):
    return np.random.default_rng(seed).normal(0, 3, (n, 2)).round().astype(int)


def drifting(n):
    return np.column_stack([2 * np.arange(n), np.zeros(n, int)])


@pytest.mark.parametrize(
    ("background", "motion", "light"), [("bricks", shaking, 0.0), ("wood", drifting, 0.1)]
)
def test_auto_takes_out_the_motion_of_the_camera_and_of_the_light(
    tmp_path, background, motion, light
):
    truth, shifts = winding_path(60), motion(60)
    scene = Scene(background, shape="irregular", size=20, image_size=SIZE)
    light = 1 + light * np.sin(np.arange(60) / 3)
    path = write_video(tmp_path / "clip.mov", render_restless(truth, scene, shifts, light))
    found = track(path)
    assert found.detector == "motion"
    for pixels, places in ((found.pixels, truth + shifts - shifts[0]), (found.in_frames, truth)):
        error = np.linalg.norm(pixels - places, axis=1)
        assert np.isfinite(error).mean() >= 0.95
        assert np.nanmedian(error) < 0.5
    classical = track(path, "background")
    assert classical.warnings
    error = np.linalg.norm(found.in_frames - truth, axis=1)
    assert np.mean(np.linalg.norm(classical.pixels - truth, axis=1) < 1) <= np.mean(error < 1)


def test_the_learned_detector_invents_nothing_behind_a_post(tmp_path):
    truth = winding_path(75)
    post = (100, 0, 44, SIZE[1])
    look = {"shape": "irregular", "occluders": (post,)}
    found = tracked(tmp_path, truth, "bricks", 22, 4, "learned", **look)
    inside = np.abs(truth[:, 0] - (post[0] + (post[2] - 1) / 2)) < post[2] / 2 - 13
    assert inside.sum() >= 5
    assert np.isnan(found.pixels[inside]).all()
    assert (found.confidence[inside] == 0).all()
    clear = distance_to_rectangle(truth, post) > 16
    assert np.isfinite(found.pixels[clear, 0]).mean() > 0.97
    assert (found.confidence[clear] >= LEAST).mean() > 0.97


def test_that_nothing_is_found_is_told(tmp_path):
    film = write_video(tmp_path / "grey.mov", np.full((5, 96, 128, 3), 90, np.uint8))
    assert track(film, "learned").warnings == (
        "grey.mov: nothing was found that looks like one target",
    )


def test_any_onnx_model_tracks(tmp_path):
    truth = winding_path(40)
    model = write_red_detector(tmp_path / "red.onnx", (256, 256))
    found = tracked(tmp_path, truth, "sea", 32, detector=model)
    assert found.detector == str(model)
    assert np.isfinite(found.pixels).mean() > 0.9
    assert np.nanmedian(errors(found, truth)) < 3  # its anchors: 8 px apart


@pytest.mark.parametrize("detector", ["yolo", "model.pt", None, np.zeros(2)])
def test_unknown_detectors(tmp_path, detector):
    with pytest.raises(ValueError, match="detector: must be one of auto, background, learned, or"):
        track(tmp_path / "clip.mov", detector)


def seen(u, confidence=0.9):
    return Detection(np.array([u, 50.0]), np.array([20.0, 20.0]), confidence)


def test_a_chain_leaves_out_what_does_not_belong():
    motion = [seen(100 + 5 * i) for i in range(20)]
    sightings = [[d] for d in motion]
    sightings[5].insert(0, seen(400, 0.99))  # surer than the target, once
    sightings[9] = [seen(400, 0.99)]  # instead of it
    sightings[14] = []
    expected = 100 + 5.0 * np.arange(20)
    expected[[9, 14]] = np.nan
    np.testing.assert_array_equal(link(sightings)[0][:, 0], expected)


def test_a_chain_takes_the_target_up_again():
    motion = [[seen(100 + 5.0 * i)] for i in range(20)] + [[]] * 40
    motion += [[seen(700 - 5.0 * i)] for i in range(20)]
    pixels, confidence = link(motion)
    np.testing.assert_array_equal(pixels, [m[0].centre if m else [np.nan] * 2 for m in motion])
    np.testing.assert_array_equal(confidence, [0.9 if m else 0 for m in motion])
    assert len(link([])[0]) == 0
    assert np.isnan(link([[], []])[0]).all()


FRAMES, BALL = 160, 16.0


def crossing(seed):
    """Two tracks (n, 2) that meet several times, in an image of 320 x 240."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 2 * np.pi, FRAMES)[:, None]
    middle, swing = np.array([160, 120]), np.array([110, 80])
    return [
        middle + swing * np.sin(t * rng.uniform(1.5, 3, 2) + rng.uniform(0, 2 * np.pi, 2))
        for _ in range(2)
    ]


def filmed(folder, tracks, **scene):
    look = {"image_size": (320, 240), "shape": "disc", "size": BALL, "colour": "red"} | scene
    drawn = Scene.random(np.random.default_rng(1), **look)
    return render_video(folder / "film.mov", np.hstack(tracks), drawn)


@pytest.mark.parametrize(("noise", "background"), [(0.0, "plain"), (0.002, "wood")])
def test_two_that_meet(tmp_path, noise, background):
    truth = np.array(crossing(0))
    look = {"noise_variance": noise, "background": background}
    found = track_targets(filmed(tmp_path, truth, **look), 2)
    seen = np.array([one.pixels for one in found])
    off = np.linalg.norm(seen[:, None] - truth[None], axis=3)  # (found, target, frame)
    nearest = off.min(axis=1)
    apart = np.linalg.norm(truth[0] - truth[1], axis=1)
    assert (apart < BALL).any()  # they do meet
    assert np.nanmax(nearest) < 0.5
    assert np.nanmedian(nearest) < 0.1
    assert np.isnan(seen[:, apart < BALL]).all()
    assert np.isfinite(seen[:, apart > 3 * BALL]).mean() > 0.97
    both = np.isfinite(seen).all(axis=(0, 2))
    assert (off[0].argmin(axis=0) != off[1].argmin(axis=0))[both].all()
    assert not any(one.warnings for one in found)


def test_one_target_is_not_two(tmp_path):
    one, none = track_targets(filmed(tmp_path, crossing(1)[:1]), 2)
    assert np.isfinite(one.pixels).mean() > 0.95
    assert np.isnan(none.pixels).all()
    assert (none.confidence == 0).all()


def test_a_third_thing_that_moves_is_told(tmp_path):
    t = np.linspace(0, 2 * np.pi, FRAMES)[:, None]
    third = np.array([160, 215]) + np.array([120, 8]) * np.sin(t * [1.1, 2.0] + [0.4, 1])
    found = track_targets(filmed(tmp_path, [*crossing(0), third]), 2)
    assert any("one thing more moves than there are targets" in one.warnings[0] for one in found
               if one.warnings)  # fmt: skip


@pytest.mark.parametrize("count", [0, 1.5, True])
def test_a_number_that_is_none(count):
    with pytest.raises(ValueError, match="count: must be an integer of at least 1"):
        track_targets("film.mov", count)
