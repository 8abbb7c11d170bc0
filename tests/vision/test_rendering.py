"""Rendering against exact geometry, what is drawn, and bad arguments."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidsindy_lite.vision import rendering
from vidsindy_lite.vision.rendering import BACKGROUNDS, COLOURS, SHAPES, Scene, render, render_video
from vidsindy_lite.vision.video import read_video

SMALL = (96, 80)


def drawn_centroid_and_area(frame, empty, colour):
    """Centroid and area of the target, from the exact mixture of target and background."""
    contrast = np.array(COLOURS[colour], float) - empty
    alpha = ((frame.astype(float) - empty) * contrast).sum(-1) / (contrast**2).sum(-1)
    area = alpha.sum()
    return np.array(
        [alpha.sum(0) @ np.arange(alpha.shape[1]), alpha.sum(1) @ np.arange(alpha.shape[0])]
    ) / area, area


@settings(max_examples=20)
@given(
    shape=st.sampled_from(SHAPES),
    size=st.floats(8, 40),
    u=st.floats(35, 60),
    v=st.floats(35, 45),
    seed=st.integers(0, 2**20),
)
def test_drawn_centroid_and_area(shape, size, u, v, seed):
    scene = Scene("plain", shape, size, tumbling=1, shape_seed=seed, image_size=SMALL)
    empty, frame = render([[np.nan, np.nan], [u, v]], scene, seed)
    centroid, area = drawn_centroid_and_area(frame, empty, scene.colour)
    assert centroid == pytest.approx([u, v], abs=0.02)
    assert area == pytest.approx(np.pi * size**2 / 4, rel=0.01)


def test_labels_of_a_frame():
    scene = Scene("plain", size=20, occluders=((50, 0, 21, 80),), image_size=SMALL)
    track = [[30.0, 40.0], [49.5, 40.0], [60.0, 40.0], [-0.5, 40.0], [np.nan, np.nan]]
    drawn = list(rendering.render_labelled(track, scene))
    whole, half, hidden, cut, absent = drawn
    for labelled, visible in ((whole, 1), (half, 0.5), (hidden, 0), (cut, 0.5)):
        np.testing.assert_allclose(labelled.extent, 20, atol=0.02)
        assert labelled.visible == pytest.approx(visible, abs=1e-6)
    assert np.isnan(absent.extent).all()
    assert absent.visible == 0
    for labelled, frame in zip(drawn, render(track, scene), strict=True):
        np.testing.assert_array_equal(labelled.frame, frame)


def test_a_restless_background_moves_behind_the_target():
    scene, track = Scene("bricks", size=16, image_size=SMALL), np.full((3, 2), [48.0, 40.0])
    shifts = np.array([[0, 0], [5, -3], [0, 0]])
    first, second, third = rendering.render_restless(track, scene, shifts, light=[1, 1, 0.5])
    np.testing.assert_array_equal(first[:20, 5:], second[3:23, :-5])
    np.testing.assert_array_equal(first[38:43, 46:51], second[38:43, 46:51])
    np.testing.assert_allclose(third[:20].astype(float), first[:20] / 2, atol=0.51)
    for bad in (shifts[:2], shifts / 2):
        with pytest.raises(ValueError, match=r"shifts: must be integers .* \(3, 2\), got"):
            next(rendering.render_restless(track, scene, bad))


def test_shapes_map_the_outline_and_keep_the_centroid():
    track = np.tile([48.3, 40.6], (3, 1))
    shapes = np.array([np.eye(2), [[1.5, 0], [0, 1]], [[1.2, 0.3], [0.3, 0.8]]])
    scene = Scene("plain", size=24, image_size=SMALL)
    empty = next(render([[np.nan, np.nan]], scene))
    frames = list(render(track, scene, shapes=shapes))
    looks = [drawn_centroid_and_area(frame, empty, "red") for frame in frames]
    assert np.abs([centroid - track[0] for centroid, _ in looks]).max() < 0.02
    expected = np.pi * 12**2 * np.linalg.det(shapes)
    np.testing.assert_allclose([area for _, area in looks], expected, rtol=0.01)
    assert np.ptp(np.flatnonzero((frames[1] != empty).any(axis=(0, 2)))) == pytest.approx(36, abs=2)


def test_a_tree_hides_what_is_behind_it_and_nothing_else():
    box = (30, 20, 60, 76)
    scene = Scene("sky", size=90, colour="magenta", trees=(box,), image_size=(128, 96))
    empty, full = render([[np.nan, np.nan], [63.5, 47.5]], scene)
    hidden = (full == empty).all(axis=-1)[27:69, 43:84]  # well inside the disc
    assert 0.2 < hidden.mean() < 1
    inside = np.s_[box[1] : box[1] + box[3], box[0] : box[0] + box[2]]
    bare = next(render([[np.nan, np.nan]], replace(scene, trees=())))
    changed = (bare != empty).any(axis=-1)
    assert changed[inside].sum() == changed.sum() > 0
    assert changed[95, 58:62].all()  # the trunk stands on the lower side
    assert np.array_equal(changed[27:69, 43:84], hidden)


def test_noise_has_the_variance_asked_for():
    scene = Scene("plain", noise_variance=0.001, image_size=SMALL)
    clean = next(render([[np.nan, np.nan]], Scene("plain", image_size=SMALL)))
    noisy = list(render(np.full((5, 2), np.nan), scene))
    assert np.var((np.array(noisy) - clean.astype(float)) / 255) == pytest.approx(0.001, rel=0.05)
    assert not np.array_equal(noisy[0], noisy[1])


def test_a_seed_gives_the_same_frames_and_file_and_another_seed_others(tmp_path):
    fixed = {"image_size": SMALL, "noise_variance": 0.01}
    scene = Scene.random(7, **fixed)
    assert scene == Scene.random(np.random.default_rng(7), **fixed) != Scene.random(4, **fixed)
    track = [[40.0, 40.0], [50.0, 42.0]]
    first, again, other = (list(render(track, scene, seed)) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first[0], other[0])
    path = render_video(tmp_path / "clip.mkv", track, scene, seed=1)
    assert np.array_equal(first, list(read_video(path)))


@pytest.mark.parametrize(
    ("track", "message"),
    [
        (np.zeros((4, 3)), r"track: must have shape \(n, 2\)"),
        (np.zeros((0, 2)), r"track: must have shape \(n, 2\)"),
        (np.zeros((4, 5)), r"track: must have shape \(n, 4\)"),
        ([[np.inf, 0]], "track: must be finite or NaN"),
    ],
)
def test_render_rejects(track, message):
    with pytest.raises(ValueError, match=message):
        render(track, Scene())
    with pytest.raises(ValueError, match="scene: must be of type Scene, got 'hills'"):
        render([[40, 40]], "hills")
    for shapes in (np.eye(2), np.ones((3, 2, 2)), np.full((2, 2, 2), np.nan)):
        with pytest.raises(ValueError, match=r"shapes: must be finite, of shape \(2, 2, 2\), got"):
            render(np.zeros((2, 2)), Scene(), shapes=shapes)
    for seed in (-1, 1.5, None):
        with pytest.raises(ValueError, match="seed: must be an integer of at least 0, got"):
            render_video("clip.mkv", [[40, 40]], Scene(), seed=seed)
        with pytest.raises(ValueError, match="rng: must be an integer of at least 0, got"):
            Scene.random(seed)


@settings(max_examples=30)
@given(
    edges=st.tuples(*[st.integers(-320, 320)] * 2, *[st.integers(1, 160)] * 2),
    clockwise=st.booleans(),
    first=st.integers(0, 3),
)
def test_a_rectangle_covers_each_pixel_by_its_common_part(edges, clockwise, first):
    left, top, width, height = np.array(edges) / 16  # along v to a sixteenth of a pixel
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * [width, height] + [left, top]
    alpha, corner = rendering.coverage(np.roll(corners[:: 1 if clockwise else -1], first, axis=0))
    pixels = [corner[k] + np.arange(alpha.shape[1 - k]) for k in (0, 1)]
    u, v = (
        np.clip(np.minimum(x + 0.5, low + side) - np.maximum(x - 0.5, low), 0, 1)
        for x, low, side in zip(pixels, (left, top), (width, height), strict=True)
    )
    np.testing.assert_allclose(alpha, np.outer(v, u), atol=1e-9)


def test_of_several_targets_the_later_ones_are_in_front():
    scene = Scene("plain", size=20, image_size=SMALL)
    track = np.array([[30.0, 40, 60, 44, 33, 40], [30, 40, np.nan, np.nan, 80, 40]])
    drawn = list(rendering.render_labelled(track, scene))
    empty = next(render([[np.nan, np.nan]], scene))
    changed = [(labelled.frame != empty).any(axis=2) for labelled in drawn]
    assert changed[0][40, 21:43].all()
    assert changed[0][44, 51:69].all()
    assert not changed[1][44, 51:69].any()
    assert drawn[0].visible == pytest.approx(1)
    assert changed[1].sum() == pytest.approx(2 * np.pi * 100, rel=0.15)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("background", "moon"), ("shape", "cube"), ("colour", "teal"), ("size", 2),
        ("turns", np.inf), ("turns", "many"), ("tumbling", -1), ("size_variation", 0.9),
        ("noise_variance", -0.1), ("shape_seed", -1), ("image_size", (10, 10)),
        *[("occluders", (box,)) for box in ((1, 2, 3), (0, 1, 4, 512), (-1, 0, 9, 9))],
        *[("trees", (box,)) for box in ((1, 2, 3), (0, 500, 50, 50))],
    ],
)  # fmt: skip
def test_scene_rejects(field, value):
    with pytest.raises(ValueError, match=f"^{field}: must|^{field}: each must"):
        Scene(**{field: value})


def test_random_scenes_are_drawn_from_their_ranges():
    scenes = [Scene.random(seed) for seed in range(200)]
    assert {s.background for s in scenes} == set(BACKGROUNDS)
    assert {s.shape for s in scenes} == set(SHAPES)
    assert {s.colour for s in scenes} == set(COLOURS)
    for name, low, high in (("size", 8, 40), ("turns", -10, 10), ("tumbling", 0, 1)):
        values = np.array([getattr(s, name) for s in scenes])
        assert low <= values.min() < low + 0.04 * (high - low)
        assert high >= values.max() > high - 0.04 * (high - low)
    largest = Scene(size=100, size_variation=0.5, noise_variance=0.1, occluders=[[0, 0, 4, 512]])
    assert largest.occluders == ((0, 0, 4, 512),)
