"""What is wrong with a rig is named by trying it, and errors of the tracks are not taken for it."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers import by_hand, dependent, room, shot, walk
from scipy.interpolate import make_interp_spline

import vidsindy_lite as vl
from vidsindy_lite import study
from vidsindy_lite.cameras import Footage, explain, find_mistake, learn_cameras

NAMES = ["a.mp4", "b.mp4", "c.mp4", "d.mp4"]
FRAMES = np.arange(300)


def flawed(rng, what):
    """Tracks, and a rig of four cameras with one thing wrong, of the last camera or of all."""
    wide = {"distortion": {"distortion": (-0.15,)}, "readout": {"readout": 0.4}}
    rig = room(rng, 4, **wide.get(what, {}))
    late = {"lag": 0.3, "drift": 0.8 * np.linspace(-0.5, 0.5, len(FRAMES))}
    tracks = shot(rng, rig, FRAMES, (0, 0, 0, late.get(what, 0.0)))
    *others, last = (replace(c, distortion=None, readout=0.0) for c in rig.cameras)
    change = {
        "direction": {"normal": last.normal + 0.02 * last.rows[0], "angle": last.angle + 0.02},
        "position": {"position": last.position + 0.05 * last.rows[1]},
        "scale": {"scale": 1.03 * last.scale},
    }
    return tracks, vl.Rig((*others, replace(last, **change.get(what, {}))))


CAUSES = {
    "direction": r"the normal .* and the angle .* of cameras\[3\] \(d.mp4\)",
    "position": r"the position \([-\d., ]+\) of cameras\[3\] \(d.mp4\)",
    "scale": r"a scale -[\d.]+ % off of cameras\[3\] \(d.mp4\)",
    "distortion": r"a distortion of the lens of all cameras, .* k1 off by -0.",
    "readout": r"a rolling shutter of all cameras, .* a readout of 0.[2345]",
    "lag": r"a lag of d.mp4 that is off by 0.[23]\d* frames",
    "drift": r"another clock of d.mp4, 0.[789]\d* frames slow over the whole video",
}


@pytest.mark.parametrize("what", CAUSES)
def test_the_cause_is_named(what):
    tracks, rig = flawed(np.random.default_rng([len(what) % 2, 7]), what)
    found = explain(tracks, rig, learn_cameras(tracks, rig))
    assert found is not None
    assert found.what == what
    assert re.match(CAUSES[what], found.text(NAMES))
    assert found.left < 1.5  # what half a pixel of noise leaves
    if what == "direction":
        told = vl.observe_tracks(tracks, rig, FRAMES / 30, lags="synchronous", names=NAMES)
        assert told.status == "suspect"
        assert told.warnings[0].startswith("the rig does not agree with the tracks: ")
        assert "of cameras[3] (d.mp4) would explain it best" in told.warnings[0]


def test_a_larger_scene_is_no_cause_though_it_hides_what_is_wrong_in_it():
    x, rng = study.SYSTEMS["SprottF"].trajectory(400)[1], np.random.default_rng(0)
    sides, size = np.array([[1, 0, 0.3], [-0.5, 0.9, 0.2], [-0.4, -0.9, 0.5]]), x.std()
    middle, how = x.mean(axis=0), {"scale": 0.01 * size, "angle": 0.2}
    views = [vl.OrthographicCamera(position=middle + 3 * size * n, normal=n, **how) for n in sides]
    tracks = [view.project(x) + 0.3 * rng.normal(size=(len(x), 2)) for view in views]
    one, two, three = vl.Rig(views).uncalibrated(keep=0).cameras
    rig = vl.Rig([one, replace(two, normal=two.normal + 2e-3 * two.rows[0]), three])
    assert explain(tracks, rig, learn_cameras(tracks, rig)).what == "direction"


@pytest.mark.parametrize("part", [{"distortion": (-0.15,)}, {"readout": 0.4}])
def test_one_camera_is_blamed_where_all_would_explain_as_much(part):
    rng = np.random.default_rng([1, 7])
    rig = room(rng, 4)
    *others, last = rig.cameras
    tracks = shot(rng, vl.Rig((*others, replace(last, **part))), FRAMES)
    cause = explain(tracks, rig, learn_cameras(tracks, rig))
    assert (cause.what, cause.cameras) == (*part, (3,))


@pytest.mark.parametrize(("rho", "learned"), [(0.0, False), (0.8, True), (0.95, False)])
def test_a_good_rig_and_poor_tracks_are_no_reason_to_doubt(rho, learned):
    rng = np.random.default_rng([0, 11])
    rig = room(rng, 4)
    exact = [camera.project(walk(FRAMES)) for camera in rig.cameras]
    tracks = [track + 1.2 * dependent(rng, len(FRAMES), rho) for track in exact]
    given = rig.uncalibrated() if learned else rig
    assert explain(tracks, given, learn_cameras(tracks, given)) is None


def test_what_was_measured_with_an_error_is_not_blamed():
    rng = np.random.default_rng(13)
    rig = room(rng, 4)
    tracks = shot(rng, rig, FRAMES)
    measured = by_hand(rng, rig)
    assert explain(tracks, measured, learn_cameras(tracks, measured)) is None
    exact = vl.Rig(
        replace(c, normal_error=0.0, position_error=0.0, scale_error=0.0) for c in measured.cameras
    )
    assert explain(tracks, exact, learn_cameras(tracks, exact)) is not None
    tracks[2] = tracks[2][::-1]
    told = vl.observe_tracks(tracks, rig, FRAMES / 30, lags="synchronous", names=NAMES)
    assert ": without c.mp4 the others agree" in told.warnings[0]


VIEWS = ("A", "B", "C")


def of_a_law(seed):
    """A rig, the tracks of its views, and by how much faster a view may be sampled: a function."""
    rng = np.random.default_rng(seed)
    law = study.SYSTEMS[[*study.SYSTEMS][seed % len(study.SYSTEMS)]].shift(study.REFERENCE_OFFSET)
    t, x = law.trajectory(400)
    rig, path = vl.Rig.around(x), make_interp_spline(t, x, k=5)
    tracks = [c.project(x) + 0.1 * rng.normal(size=(len(x), 2)) for c in rig.cameras]

    def sampled(view, rate):
        at = t[0] + np.arange(0, len(t) - 1, 1 / rate) * (t[1] - t[0])
        return rig.cameras[view].project(path(at)) + 0.1 * rng.normal(size=(len(at), 2))

    return (rig if seed % 2 else rig.uncalibrated(0)), tracks, sampled, rng


def of_a_room(seed):
    """The same of noisy tracks by perspective cameras that a hand has measured."""
    rng = np.random.default_rng(seed)
    true, noise = room(rng), 0.5

    def sampled(view, rate):
        return shot(rng, true, np.arange(0, 499, 1 / rate), noise=noise)[view]

    tracks = shot(rng, true, np.arange(500), noise=noise)
    return by_hand(rng, true), tracks, sampled, rng


def swapped(rig, tracks, sampled, rng):
    i, j = sorted(rng.choice(3, 2, replace=False))
    order = [*range(3)]
    order[i], order[j] = j, i
    return [tracks[k] for k in order], f"{VIEWS[i]} and {VIEWS[j]} swapped"


def ring(rig, tracks, sampled, rng):
    return [*tracks[1:], tracks[0]], "A and B and C in another order than their cameras"


def flipped(axis, what):
    def flip(rig, tracks, sampled, rng):
        k = int(rng.integers(3))
        given = [track.copy() for track in tracks]
        given[k][:, axis] = rig.cameras[k].image_size[axis] - 1 - given[k][:, axis]
        # Without an angle, which is learned, they are the same but for half a turn; and half a turn
        # of all that was learned is that of the one camera that is known.
        free = "mirrored, or with v counted upwards"
        known = all(camera.is_calibrated for camera in rig.cameras)
        return given, f"{VIEWS[k]} {what if known else free}"

    return flip


def slow(rig, tracks, sampled, rng):
    k = int(rng.integers(3))
    given = [sampled(i, 25 / 30) if i == k else track for i, track in enumerate(tracks)]
    return given, f"{VIEWS[k]} with 25 frames for 30"


def dropped(rig, tracks, sampled, rng):
    k, at, count = int(rng.integers(3)), int(rng.integers(60, 340)), int(rng.integers(3, 20))
    given = [np.delete(p, slice(at, at + count), 0) if i == k else p for i, p in enumerate(tracks)]
    return given, f"{count} frames dropped of {VIEWS[k]} before its frame"


MISTAKES = {
    "swapped": swapped, "mirrored": flipped(0, "mirrored"), "slow": slow, "dropped": dropped,
    "upwards": flipped(1, "with v counted upwards"), "ring": ring,
}  # fmt: skip


@pytest.mark.parametrize(
    ("cause", "seed", "of"),
    [
        *((*one, of_a_law) for one in zip(MISTAKES, (1, 2, 2, 504, 1, 5), strict=True)),
        ("dropped", 51, of_a_room),
    ],
)  # fmt: skip
def test_a_mistake_is_named(cause, seed, of):
    rig, tracks, sampled, rng = of(seed)
    given, what = MISTAKES[cause](rig, tracks, sampled, rng)
    found = find_mistake(Footage.of(given), rig, VIEWS)
    assert what in found.text
    assert found.lags.residual < 1
    if cause == "swapped":
        assert find_mistake(Footage.of(tracks), rig, VIEWS) is None


def test_a_motion_that_repeats_itself_is_no_mistake():
    turn = 2 * np.pi * np.arange(300) / 41.3
    x = np.column_stack([np.cos(turn), 0.9 * np.sin(turn), 0.5 * np.cos(turn + 1)])
    rig, rng = vl.Rig.around(x), np.random.default_rng(1)
    tracks = [camera.project(x) + 0.05 * rng.normal(size=(300, 2)) for camera in rig.cameras]
    given = [tracks[0], tracks[1][12:], tracks[2]]
    assert find_mistake(Footage.of(given), rig.uncalibrated(keep=0), VIEWS) is None


def test_the_path_is_found_without_it_and_that_is_told_first():
    rig, tracks, _, _ = of_a_law(1)
    right = vl.observe_tracks(tracks, rig, np.arange(400.0))
    given = [tracks[0], tracks[2], tracks[1]]
    told = vl.observe_tracks(given, rig, np.arange(400.0), names=VIEWS)
    said = "the rig does not agree with the tracks as they are given: B"
    assert told.warnings[0].startswith(said)
    np.testing.assert_allclose(told.x, right.x)
    np.testing.assert_allclose(told.tracks, given)  # each stays with its video


def test_times_are_those_of_the_first_video_that_was_put_right():
    rig, tracks, sampled, _ = of_a_law(1)
    t, fast, slow = np.arange(400.0), sampled(1, 2), sampled(0, 25 / 30)
    told = vl.observe_tracks([fast, tracks[0], tracks[2]], rig, [np.arange(len(fast)) / 2, t, t])
    np.testing.assert_allclose(told.t, np.arange(len(fast)) / 2)
    told = vl.observe_tracks([slow, *tracks[1:]], rig, np.arange(len(slow)))
    np.testing.assert_allclose(told.t, 30 / 25 * np.arange(len(slow)))
