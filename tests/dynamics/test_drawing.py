"""The picture of a path of laws shows what the path holds."""

import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest

from vidsindy_lite.dynamics import PolynomialSystem, discover


@pytest.fixture(scope="module")
def found():
    law = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -0.5, "x^3": -0.5}}, degree=3)
    t = np.linspace(0, 30, 600)
    x = law.simulate(t, (1.5, 0))
    return discover(t, x + 0.05 * np.random.default_rng(0).standard_normal(x.shape))


def test_every_plateau_is_drawn_and_the_law_is_marked_where_it_holds(found):
    figure = found.plot_path()
    assert [axes.get_title() for axes in figure.axes] == ["dx/dt", "dy/dt"]
    for j, (axes, plateaus) in enumerate(zip(figure.axes, found.path, strict=True)):
        (stairs,) = axes.patches
        values, edges, _ = stairs.get_data()
        assert list(values) == [p.terms.sum() for p in plateaus]
        np.testing.assert_allclose(edges, [plateaus[0].low, *(p.high for p in plateaus)])
        own = [p for p in plateaus if (p.terms == found.native.support[:, j]).all()]
        marks = [marked.get_segments()[0][:, 0] for marked in axes.collections]
        np.testing.assert_allclose(marks, [(p.low, p.high) for p in own])
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.texts] == ["all laws", "the law"]
    plt.close(figure)


def test_matplotlib_waits_until_something_is_drawn():
    code = "import sys, vidsindy_lite.dynamics; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
