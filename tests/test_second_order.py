"""Laws of motion from what cameras see: a ball on three springs."""

import json

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite.__main__ import main
from vidsindy_lite.companion.report import write_report

SPRINGS = vl.PolynomialSystem.from_terms(
    {
        "x": {"vx": 1}, "y": {"vy": 1}, "z": {"vz": 1},
        "vx": {"x": -30, "vx": -0.25}, "vy": {"y": -34, "vy": -0.25}, "vz": {"z": -40, "vz": -0.25},
    }
)  # fmt: skip


@pytest.fixture(scope="module")
def filmed():
    """Tracks in three cameras at 30 frames a second, off by a tenth of a pixel, and the rig."""
    x = SPRINGS.simulate(np.arange(240) / 30, [0.5, 0.2, -0.1, 0, 1, 0.7])[:, :3]
    rig, rng = vl.Rig.around(x, (512, 512)), np.random.default_rng(0)
    return [c.project(x) + 0.1 * rng.normal(size=(240, 2)) for c in rig.cameras], rig


def test_the_stiffness_of_three_springs_and_a_report_on_accelerations(filmed, tmp_path):
    found = vl.discover_from_tracks(*filmed, fps=30, degree=2, order=2)
    law = found.discovery.system
    assert law.text(2) == "x'' = -30 x - 0.25 vx\ny'' = -34 y - 0.25 vy\nz'' = -40 z - 0.25 vz"
    assert found.status == "ok", found.warnings
    write_report(found, None, tmp_path / "report", {})
    written = json.loads((tmp_path / "report" / "result.json").read_text())
    equations = [term["equation"] for term in written["law"]["data"]["terms"]]
    assert equations == ["x''", "x''", "y''", "y''", "z''", "z''"]
    assert "\nperiod x = 1.147" in (tmp_path / "report" / "report.html").read_text()


def test_orders_that_are_none(filmed, capsys):
    with pytest.raises(ValueError, match="order: must be 1, 2 or 'auto', got 3"):
        vl.discover_from_tracks(*filmed, fps=30, order=3)
    with pytest.raises(ValueError, match="order: must be 1, 2 or 'auto', got 3"):
        vl.discover_from_videos(["a.mkv"], filmed[1], order=3)
    assert main(["discover", "--rig", "rig.toml", "--tracks", "a.csv", "--order", "3"]) == 2
    assert capsys.readouterr().err == "error: order: must be one of 1, 2, auto, got '3'\n"
