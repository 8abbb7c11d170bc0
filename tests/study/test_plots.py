"""What figures show."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from helpers import room, walk

from vidsindy_lite import Rig
from vidsindy_lite.study import plots


@pytest.fixture(autouse=True)
def look():
    with plt.style.context("vidsindy_lite.study.plots.vidsindy"):
        yield
    plt.close("all")


@pytest.mark.parametrize("kind", ["orthographic", "perspective"])
def test_lines_of_sight_lead_from_the_path_to_the_cameras(kind):
    x = walk(np.arange(80))
    x[:7] = np.nan
    rig = room(np.random.default_rng(0)) if kind == "perspective" else Rig.around(x)
    (axes,) = plots.plot_rig(rig, x).axes
    assert axes.get_xlabel() == "x (scene units)"
    for i, camera in enumerate(rig.cameras):
        sights = [line.get_data_3d() for line in axes.lines if line.get_color() == f"C{i}"
                  and line.get_linestyle() == ":"]  # fmt: skip
        assert len(sights) == 5
        for sight in np.swapaxes(sights, 1, 2):
            start, end = sight
            assert np.abs(x[7:] - start).sum(axis=1).min() < 1e-12
            assert start.tolist() not in ([np.nan] * 3, end.tolist())
            np.testing.assert_allclose(camera.project(sight[:1] + 0.3 * (end - start)),
                                       camera.project(sight[:1]), atol=1e-6)  # fmt: skip
            if kind == "perspective":
                np.testing.assert_allclose(end, camera.position)


def test_frames_of_different_sizes_keep_their_own_axes():
    images = [np.zeros((60, 80, 3), np.uint8), np.zeros((120, 200, 3), np.uint8)]
    tracks = [np.array([[40.0, 30.0], [np.nan, np.nan]]), np.array([[10.0, 20.0], [30.0, 20.0]])]
    figure = plots.plot_frames(images, ["a", "b"], tracks, 1)
    assert [axes.get_xlim()[1] for axes in figure.axes[:2]] == [79.5, 199.5]
    # The target is magnified where it was seen.
    assert [len(axes.child_axes) for axes in figure.axes[:2]] == [0, 1]


def test_each_of_several_targets_has_its_own_colour_and_name():
    track = np.arange(12.0).reshape(3, 4)
    figure = plots.plot_frames([np.zeros((60, 80, 3), np.uint8)], ["a"], [track])
    first, second = figure.axes[0].lines
    np.testing.assert_array_equal(second.get_xydata(), track[:, 2:])
    assert first.get_color() != second.get_color()
    assert [text.get_text() for text in figure.legends[0].texts] == ["target 1", "target 2"]


def test_what_is_missing_is_shaded_over_time():
    t = np.linspace(0, 1, 30)
    x = np.column_stack((t, t**2, t**3))
    seen = x.copy()
    seen[10:15] = np.nan
    figure = plots.plot_path(t, {"truth": x, "reconstructed": seen}, "hidden")
    assert [text.get_text() for text in figure.legends[0].texts][-1] == "hidden"
    for axes in figure.axes:
        if axes.name != "3d":
            (shade,) = axes.collections
            ends = shade.get_paths()[0].vertices[:, 0]
            assert t[9] < ends.min() <= t[10]
            assert t[14] <= ends.max() < t[15]
