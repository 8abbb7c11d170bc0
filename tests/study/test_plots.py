"""What a figure shows fits into it, and can be read."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from mpl_toolkits.mplot3d import proj3d

from vidsindy_lite.study import lab, plots


@pytest.fixture(autouse=True)
def look():
    with plt.style.context("vidsindy_lite.study.plots.vidsindy"):
        yield
    plt.close("all")


def test_loss_has_a_plain_axis_from_zero():
    (axes,) = plots.plot_loss([5.0, 2.0, 1.2, 1.0], 100).axes
    assert axes.get_yscale() == "linear"
    assert axes.get_ylim()[0] == 0


def test_the_scene_in_the_lab_fills_its_half_and_nothing_is_cut_off():
    rig, paths = lab.cameras(), lab.paths(20)
    points = {"marked point": lab.MARKED, "the paper's": lab.IDENTIFIED}
    figure = plots.plot_table(rig, paths, {"orthographic": paths, "perspective": paths}, points)
    figure.canvas.draw()
    (space,) = (axes for axes in figure.axes if axes.name == "3d")
    x, y, _ = proj3d.proj_transform(*np.transpose([c.position for c in rig.cameras]), space.M)
    u = space.transData.transform(np.column_stack((x, y)))[:, 0]
    assert np.ptp(u) > 0.2 * figure.bbox.width
    for axes in figure.axes:
        box = axes.get_tightbbox(figure.canvas.get_renderer())
        assert box.x0 >= 0
        assert box.y0 >= 0
        assert box.x1 <= figure.bbox.width
        assert box.y1 <= figure.bbox.height


@pytest.mark.parametrize(
    ("plot", "word"), [(plots.plot_gaps, "hidden"), (plots.plot_path, "not seen")]
)
def test_what_is_missing_is_shaded_over_time(plot, word):
    t = np.linspace(0, 1, 30)
    x = np.column_stack((t, t**2, t**3))
    seen = x.copy()
    seen[10:15] = np.nan
    figure = plot(t, seen, x)
    assert [text.get_text() for text in figure.legends[0].texts][-1] == word
    for axes in figure.axes:
        if axes.name != "3d":
            (shade,) = axes.collections
            ends = shade.get_paths()[0].vertices[:, 0]
            assert t[9] < ends.min() <= t[10]
            assert t[14] <= ends.max() < t[15]
