"""What figures show."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from vidsindy_lite.study import plots


@pytest.fixture(autouse=True)
def look():
    with plt.style.context("vidsindy_lite.study.plots.vidsindy"):
        yield
    plt.close("all")


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
