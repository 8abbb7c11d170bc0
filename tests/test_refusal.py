"""Where to look first when tracks lead to no law."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import vidsindy_lite as vl
from vidsindy_lite import study
from vidsindy_lite.pipeline import Refused, refusing

LOOP = np.column_stack((np.cos(np.arange(200) / 9), np.sin(np.arange(200) / 7))) * 90 + 200


def causes(step, *tracks):
    names = [f"{letter}.mp4" for letter, _ in zip("abc", tracks, strict=False)]
    with pytest.raises(Refused) as caught, refusing(step, tracks, names):
        raise ValueError("what is wrong")
    assert caught.value.step == step
    assert len(caught.value.tracks) == len(tracks)
    said, order = str(caught.value).split("; likely causes, in this order: ")
    assert said == "what is wrong"
    return order


def test_good_tracks_accuse_the_rig_or_the_lags():
    assert causes("cameras", LOOP, LOOP) == "the rig, the lags, the tracker"
    assert causes("lags", LOOP, LOOP) == "the lags, the rig, the tracker"


def strange(kind):
    rng, track = np.random.default_rng(0), LOOP.copy()
    if kind == "jumps":
        track[rng.permutation(200)[:20]] = 5.0
    elif kind == "trembles":
        track = track + 60 * rng.normal(size=track.shape)
    elif kind == "stands still":
        track = 200 + 0.2 * rng.normal(size=track.shape)
    else:
        track[40:] = np.nan
    return track


@pytest.mark.parametrize(
    ("kind", "step"),
    [("jumps", "lags"), ("trembles", "cameras"), ("stands still", "law"), ("is missing", "law")],
)
def test_a_strange_track_accuses_the_tracker(kind, step):
    order = causes(step, LOOP, strange(kind))
    assert order == "the tracker (look at b.mp4), the lags, the rig"


@given(st.integers(0, 3), st.integers(0, 2**31))
def test_any_track_is_judged(rows, seed):
    rng = np.random.default_rng(seed)
    track = np.where(rng.random((rows, 1)) < 0.5, np.nan, rng.normal(size=(rows, 2)))
    assert "the tracker" in causes("law", track)


def test_an_interruption_holds_the_tracks_and_is_no_error_to_be_caught():
    with pytest.raises(KeyboardInterrupt) as caught, refusing("law", [LOOP], ["a"]):
        raise KeyboardInterrupt
    assert caught.value.step == "law"
    np.testing.assert_array_equal(caught.value.tracks[0], LOOP)
    with pytest.raises(OSError, match="disk"), refusing("law", [LOOP], ["a"]):
        raise OSError("disk")


def test_tracks_of_which_nothing_can_be_learned_come_with_the_refusal():
    _, x = study.SYSTEMS["Lorenz"].trajectory(150)
    rig = vl.Rig.around(x)
    tracks = [camera.project(x) for camera in rig.cameras]
    tracks[1] = np.full((150, 2), 200.0)
    with pytest.raises(Refused, match=r"must determine .* \(look at tracks.1") as caught:
        vl.discover_from_tracks(tracks, rig.uncalibrated(0), np.arange(150), lags="synchronous")
    assert caught.value.step == "cameras"
    np.testing.assert_array_equal(caught.value.tracks[1], tracks[1])
