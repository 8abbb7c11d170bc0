"""What is wrong with a rig is named by trying it, and errors of the tracks are not taken for it."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers import by_hand, room, walk

import vidsindy_lite as vl
from vidsindy_lite.cameras import explain, learn_cameras, smooth

NAMES = ["a.mp4", "b.mp4", "c.mp4", "d.mp4"]
FRAMES = np.arange(500)


def seen(rng, rig, noise=0.5, late=0.0):
    """Tracks, those of the last camera so many frames late."""
    tracks = []
    for i, camera in enumerate(rig.cameras):
        height, extra = camera.image_size[1], late if i == len(rig.cameras) - 1 else 0.0
        track = camera.project(walk(FRAMES + extra))
        for _ in range(10):
            shift = extra + camera.readout * (track[:, 1] - (height - 1) / 2) / height
            track = camera.project(walk(FRAMES + shift))
        tracks.append(track + noise * rng.normal(size=track.shape))
    return tracks


def flawed(rng, what):
    """Tracks, and a rig of four cameras with one thing wrong, of the last camera or of all."""
    wide = {"distortion": {"distortion": (-0.15,)}, "readout": {"readout": 0.4}}
    rig = room(rng, 4, **wide.get(what, {}))
    late = {"lag": 0.3, "drift": 0.8 * np.linspace(-0.5, 0.5, len(FRAMES))}
    tracks = seen(rng, rig, late=late.get(what, 0.0))
    *others, last = (replace(c, distortion=None, readout=0.0) for c in rig.cameras)
    change = {
        "normal": {"normal": last.normal + 0.02 * last.rows[0]},
        "position": {"position": last.position + 0.05 * last.rows[1]},
        "scale": {"scale": 1.03 * last.scale},
    }
    if what == "nearness":
        flat = [
            vl.OrthographicCamera(
                position=np.zeros(3), normal=c.normal, angle=c.angle, image_size=c.image_size,
                scale=c.scale * (c.normal @ c.position),
            )
            for c in (*others, last)
        ]  # fmt: skip
        aimed = [replace(c, normal=c.position) for c in rig.cameras]
        tracks = seen(rng, vl.Rig(aimed))
        flat = [replace(f, normal=c.normal) for f, c in zip(flat, aimed, strict=True)]
        return tracks, vl.Rig(flat)
    return tracks, vl.Rig((*others, replace(last, **change.get(what, {}))))


CAUSES = {
    "normal": r"the normal \([-\d., ]+\) of cameras\[3\] \(d.mp4\)",
    "position": r"the position \([-\d., ]+\) of cameras\[3\] \(d.mp4\)",
    "scale": r"a scale -[\d.]+ % off of cameras\[3\] \(d.mp4\)",
    "distortion": r"a distortion of the lens of all cameras, .* k1 off by -0.",
    "readout": r"a rolling shutter of all cameras, .* a readout of 0.[2345]",
    "lag": r"a lag of d.mp4 that is off by 0.[23]\d* frames",
    "drift": r"another clock of d.mp4, 0.[789]\d* frames slow over the whole video",
    "nearness": "perspective, where the cameras are taken as orthographic",
}


@pytest.mark.parametrize("what", CAUSES)
@pytest.mark.parametrize("seed", [0, 1])
def test_the_cause_is_named(what, seed):
    tracks, rig = flawed(np.random.default_rng([seed, 7]), what)
    found = explain(tracks, rig, learn_cameras(tracks, rig))
    assert found is not None
    assert found.cause.what == what
    assert re.match(CAUSES[what], found.text(NAMES))
    assert found.left < 1.5  # what half a pixel of noise leaves


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("part", [{"distortion": (-0.15,)}, {"readout": 0.4}])
def test_one_camera_is_blamed_where_all_would_explain_as_much(part, seed):
    rng = np.random.default_rng([seed, 7])
    rig = room(rng, 4)
    *others, last = rig.cameras
    tracks = seen(rng, vl.Rig((*others, replace(last, **part))))
    cause = explain(tracks, rig, learn_cameras(tracks, rig)).cause
    assert (cause.what, cause.cameras) == (*part, (3,))


def slow_noise(rng, size, rho):
    """Errors of a track that are similar from frame to frame."""
    errors = rng.normal(size=(len(FRAMES), 2))
    for k in range(1, len(errors)):
        errors[k] = rho * errors[k - 1] + np.sqrt(1 - rho**2) * errors[k]
    return size * errors


@pytest.mark.parametrize("rho", [0.0, 0.8, 0.95])
@pytest.mark.parametrize("learned", [False, True])
def test_a_good_rig_and_poor_tracks_are_no_reason_to_doubt(rho, learned):
    """Residuals of 1 to 1.5 pixels, as good calibrations of real recordings leave them."""
    for seed in range(4):
        rng = np.random.default_rng([seed, 11])
        rig = room(rng, 4)
        exact = [camera.project(walk(FRAMES)) for camera in rig.cameras]
        tracks = [track + slow_noise(rng, 1.2, rho) for track in exact]
        given = rig.uncalibrated() if learned else rig
        assert explain(tracks, given, learn_cameras(tracks, given)) is None


def test_what_was_measured_with_an_error_is_not_blamed():
    rng = np.random.default_rng(13)
    rig = room(rng, 4)
    tracks = seen(rng, rig)
    measured = by_hand(rng, rig)
    assert explain(tracks, measured, learn_cameras(tracks, measured)) is None
    exact = vl.Rig(
        replace(c, normal_error=0.0, position_error=0.0, scale_error=0.0) for c in measured.cameras
    )
    assert explain(tracks, exact, learn_cameras(tracks, exact)) is not None


def test_residuals_that_follow_the_motion():
    rng = np.random.default_rng(14)
    rig = room(rng, 4)
    assert not smooth(seen(rng, rig, noise=5.0), rig)
    tracks, wrong = flawed(rng, "normal")
    assert smooth(tracks, wrong)


def test_nothing_seen_is_nothing_wrong():
    rig = room(np.random.default_rng(0), 3)
    blind = [np.full((20, 2), np.nan) for _ in rig.cameras]
    blind = [np.where(np.arange(20)[:, None] == i, 300.0, t) for i, t in enumerate(blind)]
    assert explain(blind, rig, rig) is None
    assert not smooth(blind, rig)
