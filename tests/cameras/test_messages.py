"""What did not converge is told in the warnings of the result."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import trajectory

import vidsindy_lite as vl
from vidsindy_lite.cameras import adjust, calibrate, sight

NOISE = 0.3  # pixels


def filmed(kind=vl.OrthographicCamera, noise=NOISE):
    """A rig of three cameras and noisy tracks."""
    x = trajectory(np.random.default_rng(4), 120)
    rig = vl.Rig.around(x)
    if kind is vl.PerspectiveCamera:
        reach = np.linalg.norm(np.ptp(x, axis=0))
        rig = vl.Rig(
            kind(
                position=x.mean(axis=0) + 2 * reach * c.normal,
                normal=c.normal,
                scale=c.scale / (2 * reach),
                angle=c.angle,
            )
            for c in rig.cameras
        )
    rng = np.random.default_rng(0)
    return rig, [c.project(x) + noise * rng.normal(size=(120, 2)) for c in rig.cameras]


@pytest.mark.parametrize("kind", [vl.OrthographicCamera, vl.PerspectiveCamera])
def test_a_search_for_cameras_that_ran_out_of_steps(monkeypatch, kind):
    rig, tracks = filmed(kind)
    assert vl.learn_cameras(tracks, rig.uncalibrated()).warnings == ()
    monkeypatch.setattr(adjust, "_STEPS", 1)
    (warning,) = vl.learn_cameras(tracks, rig.uncalibrated()).warnings
    assert "the search for the cameras did not converge in 1 evaluations" in warning


def test_outliers_that_cannot_be_told(monkeypatch):
    rig, tracks = filmed()
    tracks[0][::9] += 100
    assert vl.learn_cameras(tracks, rig.uncalibrated()).warnings == ()
    monkeypatch.setattr(calibrate, "_ROUNDS", 1)
    (warning,) = vl.learn_cameras(tracks, rig.uncalibrated()).warnings
    assert "which frames hold outliers of a track cannot be told" in warning


def test_points_that_did_not_settle(monkeypatch):
    rig, tracks = filmed(vl.PerspectiveCamera)
    monkeypatch.setattr(sight, "_STEPS", 1)
    warnings = vl.learn_cameras(tracks, rig.uncalibrated()).warnings
    assert "the target's place is uncertain in 120 of 120 frames" in warnings[-1]


def test_lags_that_did_not_settle(monkeypatch):
    rig, tracks = filmed(noise=0.05)
    assert vl.learn_lags(tracks, rig.uncalibrated()).warnings == ()
    monkeypatch.setattr(adjust, "_IN_TIME", 0.0)
    monkeypatch.setattr(adjust, "_STEPS", 3)
    found = vl.learn_lags(tracks, rig.uncalibrated())
    assert found.agree
    assert "the search for the lags of the videos did not converge" in found.warnings[0]


def test_lags_at_which_nothing_fits():
    rig, tracks = filmed()
    tracks[1] = np.random.default_rng(1).uniform(0, 500, (120, 2))
    found = vl.learn_lags(tracks, rig.uncalibrated())
    assert not found.agree
    assert found.errors.tolist() == [0, np.inf, np.inf]
    (warning,) = found.warnings
    assert "no lags of the videos make the views agree: (0, 0, 0) frames were taken" in warning
    assert "pixels; check the rig" in warning


def test_lags_at_which_there_are_no_cameras():
    rig, tracks = filmed()
    tracks[1][:60], tracks[2][60:] = np.nan, np.nan
    tracks[0][::2] = np.nan
    tracks[0][1:115] = np.nan
    found = vl.learn_lags(tracks, rig.uncalibrated())
    assert not found.agree


def test_warnings_are_no_part_of_a_rig(tmp_path):
    rig, _ = filmed()
    doubtful = replace(rig, warnings=("no",))
    assert doubtful == rig
    assert hash(doubtful) == hash(rig)
    doubtful.save(tmp_path / "rig.toml")
    assert vl.Rig.load(tmp_path / "rig.toml").warnings == ()
