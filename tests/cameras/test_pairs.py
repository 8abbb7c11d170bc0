"""Two views at a time: lags that are promising, and rough cameras to begin with."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import filmed

import vidsindy_lite as vl
from vidsindy_lite.cameras.alignment import Curve
from vidsindy_lite.cameras.calibrate import Unknowns
from vidsindy_lite.cameras.models import turn
from vidsindy_lite.cameras.sight import Views, epipolar_lines
from vidsindy_lite.cameras.synchronise import (
    _apart,
    _dips,
    _turned,
    pair_missed,
    promising_lags,
    rough_cameras,
)

NOISE = 0.05  # pixels


def test_promising_lags_are_not_neighbours(motion):
    """From one of them the search comes to the best within a few frames."""
    tracks = filmed(motion, (250,) * 3, (0, 9, -14), noise=2.0)
    curves = [Curve(track, np.arange(250.0)) for track in tracks]
    for lags in promising_lags(curves, np.ones(3), Unknowns.of(motion[1].uncalibrated()))[1:]:
        assert np.diff(np.sort(lags)).min(initial=4) >= 4


def test_two_views_are_compared_only_where_they_have_enough_in_common(motion):
    """More equations than twice the unknowns, also without the tenth that is missed the most."""
    tracks, (first, second, _) = filmed(motion, (8, 8, 8), (0, 0, 0)), motion[1].cameras
    lines = epipolar_lines(first, tracks[0], second)
    unknown = replace(second, scale=None, angle=None)
    for other, placed, least in (
        (second, True, 1), (second, False, 4), (unknown, True, 6), (unknown, False, 8),
    ):  # fmt: skip
        for frames, enough in ((least - 1, False), (least, True)):
            theirs = np.where(np.arange(8)[:, None] < frames, tracks[1], np.nan)
            (missed,) = pair_missed(other, placed, lines, theirs[None], shift=False)
            assert np.isfinite(missed) == enough
            assert not enough or missed < 5 * NOISE * first.scale


@pytest.mark.parametrize("lag", [-50, 50])
def test_videos_may_have_half_of_the_shorter_one_in_common(motion, lag):
    tracks = filmed(motion, (100, 100, 100), (0, lag, 0), noise=0.0)
    assert promising(tracks, motion[1])[1][0] == lag
    tracks = filmed(motion, (100, 100, 100), (0, 1.1 * lag, 0), noise=0.0)
    assert np.abs(promising(tracks, motion[1])[1]).max() <= 50


def promising(tracks, rig):
    curves = [Curve(track, np.arange(100.0)) for track in tracks]
    return promising_lags(curves, np.ones(3), Unknowns.of(rig))


def test_the_lowest_of_neighbours_is_promising():
    lags = np.arange(-3.0, 9)
    missed = np.array([5, 2, 3, 4, 1, 6, np.inf, np.inf, 0.5, 0.7, 0.6, 0.9])
    # 4 frames apart or more, the lowest first: that at -2 is 3 beside the one at 1.
    assert _dips(lags, missed).tolist() == [5, 1]
    assert _dips(lags[:4], np.full(4, np.inf)).tolist() == []
    assert _apart(np.array([0, 3.9, 4, -4, -3.9, 8])).tolist() == [0, 4, -4, 8]


def test_what_misses_an_epipolar_line_is_in_units_of_the_scene():
    """Three pixels of half a unit above lines that are level: a shift takes it all out."""
    first = vl.OrthographicCamera(position=(0, 0, 0), normal=(0, 0, 1), scale=0.25, angle=0.3)
    second = vl.OrthographicCamera(position=(1, 2, 3), normal=(1, 0, 0), scale=0.5, angle=-2.0)
    x = 20 * np.random.default_rng(0).normal(size=(60, 3))
    lines = epipolar_lines(first, first.project(x), second)
    up = second.rows @ [0, 1, 0]  # both see y: the first one's lines of sight go along z
    theirs = second.seen((x @ second.rows.T - second.offset + 1.5 * up) / 0.5 @ turn(-2.0))
    (missed,) = pair_missed(second, True, lines, theirs[None], shift=False)
    (shifted,) = pair_missed(second, True, lines, theirs[None], shift=True)
    (unplaced,) = pair_missed(second, False, lines, theirs[None], shift=False)
    assert missed == pytest.approx(1.5)
    assert shifted < 1e-9
    assert unplaced < 1e-9
    # With an outlier in ten, left out, the rest fits at both lags, or at one of them.
    theirs[::10] += 400
    two = np.stack([theirs, theirs + 10 * np.random.default_rng(1).normal(size=theirs.shape)])
    fits, worse = pair_missed(second, True, lines, two, shift=True)
    assert fits < 1e-6 < 1 < worse


def test_rough_cameras_of_exact_tracks_are_exact(motion):
    tracks = filmed(motion, (60,) * 3, (0, 0, 0), noise=0)
    rig = motion[1].uncalibrated()
    for start in (rig, vl.Rig([*rig.cameras[:2], replace(rig.cameras[2], position=None)])):
        found = rough_cameras(Views.of(tracks), Unknowns.of(start))
        for camera, true in zip(found, motion[1].cameras, strict=True):
            np.testing.assert_allclose(camera.calibration, true.calibration, rtol=1e-9)
            np.testing.assert_allclose(camera.offset, true.offset, atol=1e-6 * 512 * true.scale)
    assert rough_cameras(Views.of(tracks), Unknowns.of(motion[1])) == motion[1].cameras


def test_rough_cameras_need_more_equations_than_unknowns(motion):
    tracks = filmed(motion, (2,) * 3, (0, 0, 0), noise=0)
    for frames, told in ((1, False), (2, True)):
        few = Views.of([track[:frames] for track in tracks])
        assert (rough_cameras(few, Unknowns.of(motion[1].uncalibrated())) is not None) == told


def test_a_camera_turns_as_most_views_say(motion):
    """Three in ten of the views are wrong."""
    tracks = filmed(motion, (100,) * 3, (0, 0, 0), noise=0)
    tracks[1][:25] += 80
    rig = motion[1].uncalibrated()
    scale, angle = motion[1].cameras[1].calibration
    found = _turned(Views.of(tracks), rig.cameras, 1)
    np.testing.assert_allclose(found, scale * np.exp(1j * angle), rtol=1e-6)
    few = Views.of([track[25:29] for track in tracks])
    assert _turned(few, rig.cameras, 1) == 0
