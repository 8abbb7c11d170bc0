"""Scenes: outlines against exact geometry, random scenes, and bad arguments."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidsindy_lite.vision.rendering import BACKGROUNDS, COLOURS, SHAPES, Scene


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("background", "moon"),
        ("shape", "cube"),
        ("colour", "teal"),
        ("size", 2),
        ("size", np.nan),
        ("turns", np.inf),
        ("tumbling", -1),
        ("size_variation", 0.9),
        ("noise_variance", -0.1),
        ("shape_seed", -1),
        ("shape_seed", 1.5),
        ("size", True),
        ("turns", "many"),
        ("image_size", 512),
        ("image_size", (10, 10)),
        ("image_size", (512,)),
        ("occluders", ((1, 2, 3),)),
        ("occluders", ((500, 0, 50, 50),)),
        ("occluders", ((0, 0, 1, 50),)),
        ("trees", ((1, 2, 3),)),
        ("trees", ((0, 500, 50, 50),)),
    ],
)
def test_scene_rejects(field, value):
    with pytest.raises(ValueError, match=f"^{field}: must|^{field}: each must"):
        Scene(**{field: value})


def moments(points):
    """Area and centroid of a polygon as a fan of triangles around its first corner."""
    a, b = points[1:-1] - points[0], points[2:] - points[0]
    areas = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    centroids = points[0] + (a + b) / 3
    return areas.sum(), areas @ centroids / areas.sum()


@given(st.sampled_from(SHAPES), st.floats(4, 100), st.integers(0, 1000))
def test_outlines_have_the_area_of_their_disc_and_their_centroid_at_zero(shape, size, seed):
    area, centroid = moments(Scene(shape=shape, size=size, shape_seed=seed).outline())
    assert area == pytest.approx(np.pi * size**2 / 4)
    np.testing.assert_allclose(centroid, 0, atol=1e-9 * size)


def test_outlines_are_of_their_kind():
    disc = Scene(size=20).outline()
    assert disc.shape == (128, 2)
    np.testing.assert_allclose(np.hypot(*disc.T), 10, rtol=1e-3)
    counts, spreads = set(), []
    for seed in range(60):
        corners = Scene(shape="polygon", size=20, shape_seed=seed).outline()
        counts.add(len(corners))
        turns = np.diff(np.unwrap(np.arctan2(*corners.T[::-1]), period=2 * np.pi))
        # Corners are as far apart as those of a regular one, but for .4 of that.
        spreads.append(np.abs(turns * len(corners) / (2 * np.pi) - 1).max())
        blob = Scene(shape="irregular", size=20, shape_seed=seed).outline()
        assert len(blob) == 128
        assert 1.1 < np.hypot(*blob.T).max() / np.hypot(*blob.T).min() < 4
    assert counts == {3, 4, 5, 6}
    assert 0.2 < max(spreads) < 0.8


def test_random_scenes_are_drawn_from_their_ranges():
    scenes = [Scene.random(seed) for seed in range(300)]
    assert {s.background for s in scenes} == set(BACKGROUNDS)
    assert {s.shape for s in scenes} == set(SHAPES)
    assert {s.colour for s in scenes} == set(COLOURS)
    for name, low, high in (("size", 8, 40), ("turns", -10, 10), ("tumbling", 0, 1)):
        values = np.array([getattr(s, name) for s in scenes])
        assert low <= values.min() < low + 0.03 * (high - low)
        assert high >= values.max() > high - 0.03 * (high - low)
    assert Scene.random(3) == Scene.random(np.random.default_rng(3)) != Scene.random(4)
    assert Scene.random(3, size=9, noise_variance=0.01).size == 9


def test_the_largest_that_a_scene_may_hold():
    scene = Scene(size=100, size_variation=0.5, noise_variance=0.1, occluders=[[0, 0, 4, 512]],
                  trees=((508, 508, 4, 4),), image_size=(512, 512))  # fmt: skip
    assert scene.occluders == ((0, 0, 4, 512),)
    for wrong in (((0, 1, 4, 512),), ((509, 0, 4, 4),), ((0, 0, 3, 9),), ((-1, 0, 9, 9),)):
        with pytest.raises(ValueError, match="occluders: "):
            Scene(occluders=wrong)
