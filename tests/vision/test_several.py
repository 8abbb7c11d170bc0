"""Several targets in one film: right wherever they are apart, silent where they meet."""

import numpy as np
import pytest

from vidsindy_lite.vision import Scene, render_video, track_targets
from vidsindy_lite.vision.moving import Ways
from vidsindy_lite.vision.tracking import _touching

FRAMES, SIZE = 160, 16.0


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
    look = {"image_size": (320, 240), "shape": "disc", "size": SIZE, "colour": "red"} | scene
    drawn = Scene.random(np.random.default_rng(1), **look)
    return render_video(folder / "film.mov", np.hstack(tracks), drawn)


@pytest.mark.parametrize("background", ["plain", "wood"])
@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_two_that_meet(tmp_path, noise, background):
    truth = np.array(crossing(0))
    look = {"noise_variance": noise, "background": background}
    found = track_targets(filmed(tmp_path, truth, **look), 2)
    seen = np.array([one.pixels for one in found])
    off = np.linalg.norm(seen[:, None] - truth[None], axis=3)  # (found, target, frame)
    nearest = off.min(axis=1)
    apart = np.linalg.norm(truth[0] - truth[1], axis=1)
    assert (apart < SIZE).any()  # they do meet
    assert np.nanmax(nearest) < 0.5
    assert np.nanmedian(nearest) < 0.1
    assert np.isnan(seen[:, apart < SIZE]).all()
    assert np.isfinite(seen[:, apart > 3 * SIZE]).mean() > 0.97
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


@pytest.mark.parametrize(("sizes", "least"), [((16, 16), 22.8), ((4, 8), 9.8)])
def test_targets_touch_within_their_sizes_and_a_little(sizes, least):
    # Their mean size, a third of it more for what a centre may be off, and two pixels of blur.
    apart = np.array([least - 0.1, least + 0.1, np.nan])
    ways = []
    for u, size in zip((0 * apart, apart), sizes, strict=True):
        centre = np.column_stack([u, 0 * apart])
        ways.append(Ways(centre, np.full((3, 4), size), np.zeros((3, 3))))
    for found in _touching(ways):
        assert found.tolist() == [True, False, False]


@pytest.mark.parametrize("count", [0, 1.5, True])
def test_a_number_that_is_none(count):
    with pytest.raises(ValueError, match="count: must be an integer of at least 1"):
        track_targets("film.mov", count)
