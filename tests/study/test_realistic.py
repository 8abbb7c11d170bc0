"""The realistic scene: what is filmed, and what the tracker makes of it."""

import numpy as np
import pytest

from vidsindy_lite.cameras import Rig
from vidsindy_lite.study.realistic import START, SceneTask, View, film_scene, run_scene
from vidsindy_lite.study.systems import REFERENCE_OFFSET
from vidsindy_lite.vision import Track

SIZE = (256, 256)


films = pytest.mark.slow  # films a scene and tracks it


@pytest.fixture(scope="module")
def result():
    return run_scene(SceneTask(trial=1, frames=200, image_size=SIZE))


@films
def test_one_target_before_three_backgrounds_behind_three_trees(result):
    views = result.views
    assert len({view.scene.trees for view in views}) == 3
    assert len({(view.scene.colour, view.scene.shape_seed) for view in views}) == 1
    for view in views:
        assert view.scene.shape == "irregular"
        assert view.scene.noise_variance == 0.01
        assert view.scene.tumbling > 0 < view.scene.size_variation
        assert view.image.shape == (256, 256, 3)
        left, top, width, height = view.scene.trees[0]
        assert top + height == 256
        assert abs(left + width / 2 - 128) <= 0.12 * 256 + 1


@films
def test_nothing_is_invented_behind_the_tree_and_the_target_is_found_again(result):
    assert sum(view.hidden.any() for view in result.views) >= 2
    for view in result.views:
        assert np.isnan(view.errors[view.hidden]).all()
        assert (view.track.confidence[view.hidden] < np.exp(-1)).all()
        assert view.delays.max(initial=0) <= 5
        assert np.sqrt(np.nanmean(view.errors**2)) < 0.5


@films
def test_a_seed_is_a_scene(result):
    x, rig = result.x[:8], Rig.around(result.x, SIZE)
    again, other = film_scene(rig, x, seed=1), film_scene(rig, x, seed=2)
    assert [view.scene for view in again] == [view.scene for view in result.views]
    assert [view.scene for view in other] != [view.scene for view in result.views]


def test_delays_count_whole_views_until_the_target_is_found():
    visible = np.array([1, 0, 0.5, 1, 1, 1, 0, 1, 1, 0, 0.3, 1, 1.0])
    seen = np.array([1, 0, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 0])
    pixels = np.where(seen[:, None] == 1, 5.0, np.nan) * np.ones(2)
    track = Track(pixels, seen.astype(float), "background")
    view = View(None, 0, None, track, np.full((13, 2), 5.0), visible)
    np.testing.assert_array_equal(view.delays, [2, 0, 2])
    np.testing.assert_array_equal(np.flatnonzero(view.hidden), [1, 6, 9])


@films
def test_from_videos_to_the_law(result):
    np.testing.assert_allclose(result.x[0], np.add(START, REFERENCE_OFFSET))
    seen = sum(np.isfinite(view.errors).astype(int) for view in result.views)
    np.testing.assert_array_equal(np.isfinite(result.path).all(axis=1), seen >= 2)
    assert (seen < 2).any()
    assert np.nanmax(np.abs(result.path - result.x)) < 0.1 * result.x.std()
    assert result.score.exact
    assert result.score.l2 < 2e-2
