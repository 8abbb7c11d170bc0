"""What a figure shows fits into it, and can be read."""

import matplotlib.pyplot as plt
import numpy as np
import pandas
import pytest
from helpers import room, walk
from mpl_toolkits.mplot3d import proj3d

from vidsindy_lite import Rig
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


def test_every_line_of_a_reconstruction_is_named():
    t, x = np.arange(5.0), np.zeros((5, 3))
    legend = plots.plot_reconstruction(t, x, x, 1.0).legends[0]
    assert [text.get_text() for text in legend.texts] == ["truth", "x", "y", "z"]


def test_frames_of_different_sizes_keep_their_own_axes():
    images = [np.zeros((60, 80, 3), np.uint8), np.zeros((120, 200, 3), np.uint8)]
    tracks = [np.array([[40.0, 30.0], [np.nan, np.nan]]), np.array([[10.0, 20.0], [30.0, 20.0]])]
    figure = plots.plot_frames(images, ["a", "b"], tracks, 1)
    assert [axes.get_xlim()[1] for axes in figure.axes[:2]] == [79.5, 199.5]
    # The target is magnified where it was seen.
    assert [len(axes.child_axes) for axes in figure.axes[:2]] == [0, 1]


def test_wrong_terms_are_counted_in_whole_numbers_at_the_levels_tried():
    columns = {"condition": "noise", "method": "Gauss-Newton", "level": [0, 0.15, 0.3], "l2": 0.01}
    figure = plots.plot_robustness(pandas.DataFrame(columns | {"wrong_terms": [0, 6, 12]}))
    _, below = figure.axes
    assert all(tick == round(tick) for tick in below.get_yticks())
    np.testing.assert_allclose(below.get_xticks(), [0, 15, 30])


def test_the_map_of_origins_counts_in_whole_terms():
    axis = np.linspace(-1, 1, 9)
    count = 6.6 + np.add.outer(axis**2, axis**2) * 3
    figure = plots.plot_origin_map(axis, axis, count, np.zeros((2, 2)), (0, 0), (0, 0))
    np.testing.assert_array_equal(figure.axes[1].get_yticks() % 1, 0)


def test_standings_show_every_rate_and_leave_out_who_did_not_take_part():
    rates = pandas.DataFrame(
        {"Gauss-Newton": [1.0, 0.5], "PySINDy": [0.25, np.nan]}, index=["stored", "noise 2 %"]
    )
    figure = plots.plot_standings({"ODEBench": rates, "flows": rates})
    for axes in figure.axes:
        lines = {line.get_label(): line for line in axes.lines}
        np.testing.assert_array_equal(lines["Gauss-Newton"].get_xdata(), [100, 50])
        np.testing.assert_array_equal(lines["PySINDy"].get_xdata(), [25, np.nan])
        assert [text.get_text() for text in axes.get_yticklabels()] == ["stored", "noise 2 %"]
        assert (np.abs(lines["Gauss-Newton"].get_ydata() - axes.get_yticks()) < 0.4).all()
    assert [text.get_text() for text in figure.legends[0].texts] == ["Gauss-Newton", "PySINDy"]


def test_lorenz_grids_have_the_rate_in_every_cell():
    rates = np.array([[1.0, 0.5, 0.25], [0.0, 0.75, 1.0]])
    grids = {"Gauss-Newton": rates, "theirs": 1 - rates}
    figure = plots.plot_lorenz_grids(grids, np.array([0.1, 0.4]), np.array([4.0, 7.0, 10.0]))
    for axes, shown in zip(figure.axes, grids.values(), strict=True):
        texts = {text.get_position(): text.get_text() for text in axes.texts}
        assert texts == {(c, r): f"{100 * v:.0f}" for (r, c), v in np.ndenumerate(shown)}
    assert [text.get_text() for text in figure.axes[0].get_yticklabels()] == ["10", "40"]
