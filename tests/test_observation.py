"""What tracks tell of a path with lags that are given, and what is wrong where they tell none."""

import json
from dataclasses import replace

import numpy as np
import pytest
from helpers import by_hand, room
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import vidsindy_lite as vl
from vidsindy_lite import cameras, study
from vidsindy_lite.companion.report import write_report
from vidsindy_lite.pipeline import Refused, refusing, without_wild


@pytest.fixture(scope="module")
def case():
    """A rig, and what its cameras see of a motion."""
    _, x = study.SYSTEMS["Lorenz"].trajectory(150)
    rig = vl.Rig.around(x)
    return rig, [camera.project(x) for camera in rig.cameras]


@pytest.mark.parametrize("lag", [75.5, -76, -1e300])
def test_a_hopeless_lag_is_named(case, lag):
    rig, tracks = case
    message = (
        r"lags: every video must have half of the shorter of the two in common with the first "
        r"\(150 frames\), got .* for tracks\[2\] \(150 frames\)"
    )
    with pytest.raises(ValueError, match=message):
        vl.observe_tracks(tracks, rig, np.arange(150), lags=(0, 0, lag))


def test_a_view_along_the_motion_helps_though_its_lag_is_not_told():
    t = np.arange(120) / 30
    x = np.outer(3 + 2 * np.cos(4 * t), (0, 0, 1))
    cameras = [
        vl.OrthographicCamera(position=10 * normal, normal=normal, scale=0.02, angle=0.0)
        for normal in np.eye(3)
    ]
    rng, rig = np.random.default_rng(0), vl.Rig(tuple(cameras))
    tracks = [c.project(x) + 0.2 * rng.normal(size=(120, 2)) for c in cameras]
    found = vl.observe_tracks(tracks, rig, t)
    assert any("the lag of video 3 cannot be told" in warning for warning in found.warnings)
    np.testing.assert_allclose(found.x, x, atol=0.02)
    exact = [c.project(x) for c in cameras]
    law = vl.discover_from_tracks(exact, rig, t, order=2, degree=1)
    np.testing.assert_allclose(law.fitted, x, atol=1e-6)  # along z, whatever its law calls that


def before_three_cameras(x, noise=0.3):
    """The tracks of a path, with noise, and a rig around it."""
    rng, rig = np.random.default_rng(0), vl.Rig.around(x)
    return [c.project(x) + noise * rng.normal(size=(len(x), 2)) for c in rig.cameras], rig


def thrown(t):
    return np.outer(t, (1.5, 0.4, 5)) - np.outer(4.905 * t**2, (0, 0, 1))


def test_a_throw_before_three_cameras_has_the_law_of_its_flight():
    t = np.arange(40) / 30
    tracks, rig = before_three_cameras(thrown(t))
    for wild, told in (
        ([], ""), ([7, 20], "tracks[1], far from their neighbours: frames 7, 20"),
        ([10, 11, 12, 39], "tracks[1], which the other views contradict: frames 10 to 12, 39"),
    ):  # fmt: skip
        given = [track.copy() for track in tracks]
        given[1][wild] += 60
        found = vl.discover_from_tracks(given, rig, t)
        assert found.status == "ok"
        assert abs(found.g.value - 9.81) < 3 * found.g.error < 0.1
        np.testing.assert_allclose(found.fitted, thrown(t), atol=0.01)
        np.testing.assert_allclose(found.x, thrown(t), atol=0.02)
        assert found.rig.note == (f"left out of {told}" if told else "")


@pytest.mark.parametrize(("views", "wild", "blamed"), [(3, 4, [1]), (2, 4, [0, 1]), (3, 5, [])])
def test_few_places_that_other_views_contradict_do_not_count(views, wild, blamed):
    tracks, rig = before_three_cameras(thrown(np.arange(40) / 30))
    tracks[1][:wild] += 60
    cleared, outliers = cameras.without_view_outliers(tracks[:views], vl.Rig(rig.cameras[:views]))
    expected = np.zeros((40, views), dtype=bool)
    expected[:wild, blamed] = True  # of two views nobody knows which, and of many it is the rig
    np.testing.assert_array_equal(outliers, expected)
    np.testing.assert_array_equal(np.isnan(np.stack(cleared, axis=1)).all(axis=2), expected)


def test_the_tilt_of_a_rig_measured_by_hand_is_no_force():
    rng, t = np.random.default_rng([2, 17]), np.arange(30) / 30
    rig, x = room(rng), thrown(t) - [0.7, 0, 0.5]
    tracks = [c.project(x) + 0.5 * rng.normal(size=(30, 2)) for c in rig.cameras]
    found = vl.discover_from_tracks(tracks, by_hand(rng, rig), t, lags="synchronous")
    assert found.status == "ok"
    assert found.discovery.system.support.sum() == 3 + 1
    assert abs(found.g.value - 9.81) < 3 * found.g.error


def bob(t):
    """The angle of a pendulum of half a metre."""
    how = {"t_eval": t, "rtol": 1e-9}
    return solve_ivp(lambda _, y: [y[1], -19.62 * np.sin(y[0])], (0, 5), [1, 0], **how).y[0]


@pytest.mark.parametrize(
    ("angle", "term", "pull"),
    [
        (lambda t: 6 * t - 0.25 * t**2, "1", 0.5),
        (bob, "sin(angle)", 19.62),
        (lambda t: np.cos(4 * t), None, None),  # a twisted wire: no such pull is the same a turn on
    ],
)
def test_what_is_on_a_circle_before_three_cameras_has_the_law_of_its_angle(angle, term, pull):
    t = np.arange(150) / 30
    aside, down = np.array([0.8, 0.6, 0]), np.array([0, 0, -1.0])
    x = 0.5 * (np.outer(np.sin(angle(t)), aside) + np.outer(np.cos(angle(t)), down))
    found = vl.discover_from_tracks(*before_three_cameras(x), t, lags="synchronous")
    law = found.discovery
    assert found.status == ("suspect" if term is None else "ok")
    assert abs(found.circle.radius - 0.5) < 5 * found.circle.radius_error
    assert f"{found}".startswith("on a circle of radius 0.")
    if term is not None:
        assert [law.terms[row] for row in np.flatnonzero(law.system.support[:, 1])] == [term]
        assert abs(law.coefficients[law.terms.index(term), 1]) == pytest.approx(pull, rel=0.02)
        np.testing.assert_allclose(found.fitted, x, atol=3e-3)


@pytest.mark.parametrize(("order", "smooth"), [("auto", 0), (2, 0), ("auto", 1.5)])
def test_what_is_bound_to_a_plane_has_its_law_there(order, smooth):
    t, aslant = np.arange(240) / 30, np.array([0.6, 0, 0.8])
    x = np.outer(0.3 * np.cos(4 * t), aslant) + np.outer(0.2 * np.sin(5.3 * t), (0, 1, 0))
    tracks, rig = before_three_cameras(x)
    for k, track in enumerate(tracks):  # errors that no smoothing tells from motion
        track += smooth * np.sin(np.outer(2 + t, [0.7, 1.1]) * (1 + k))
    found = vl.discover_from_tracks(tracks, rig, t, lags="synchronous", order=order)
    assert found.status == "ok" or smooth
    said = found.discovery.physics()
    pulls = [float(said[f"spring constant {axis}"].value) for axis in "xy"]
    np.testing.assert_allclose(sorted(pulls), [16, 28.09], rtol=0.02)
    assert float(found.period.value) == pytest.approx(2 * np.pi / 4, rel=0.01)  # it moves furthest
    np.testing.assert_allclose(found.fitted, x, atol=5e-3 + 0.01 * smooth)


@given(st.floats(0.5, 30), st.integers(5, 40), st.integers(0, 9))
def test_where_a_target_bounces_nothing_is_wild(speed, period, seed):
    n = np.arange(90)
    track = np.column_stack([3.0 * n, speed * np.abs(n % (2 * period) - period)])
    track += np.random.default_rng(seed).normal(size=track.shape)
    cleared, said = without_wild(track, "a")
    np.testing.assert_array_equal(cleared, track)
    assert said == ""


def test_given_lags_that_are_off_by_a_fraction_are_told(case):
    rig, tracks = case
    for off, told in ((0.0, False), (0.01, False), (0.05, True)):
        found = vl.observe_tracks(tracks, rig, np.arange(150), lags=(0, off, 0))
        warned = [w for w in found.warnings if "at are given" in w]
        assert bool(warned) == told
        assert all("(0, 0, 0)" in w for w in warned)


def test_the_residual_is_that_of_the_given_lags(case):
    rig, tracks = case
    learned = vl.observe_tracks(tracks, rig, np.arange(150))
    assert learned.lags.frames.tolist() == [0, 0, 0]
    assert learned.lags.residual < 1e-6
    given = vl.observe_tracks(tracks, rig, np.arange(150), lags=(0, 0.4, 0))
    assert given.lags.frames.tolist() == [0, 0.4, 0]
    residuals = [np.hypot(*part.T) for part in vl.residuals(given.tracks, given.rig)]
    missed = [np.nanquantile(part, 0.9) for part in residuals]
    assert given.lags.residual == pytest.approx(max(missed))
    assert given.lags.residual > 0.1


def test_a_law_from_noisy_tracks_does_not_bend_the_path_to_fit_their_noise():
    truth = study.SYSTEMS["Lorenz"].shift(study.REFERENCE_OFFSET)
    t, x = truth.trajectory(700)
    rig, rng = vl.Rig.around(x), np.random.default_rng(3)
    tracks = [study.add_noise(camera.project(x), 0.15, rng) for camera in rig.cameras]
    seen = vl.observe_tracks(tracks, rig.uncalibrated(keep=0), t, lags="synchronous")
    # Systematic errors are those of the motion: made of noisy tracks, they would jump as these do.
    jumps = np.diff(seen.systematic, axis=1).std(axis=1) / seen.systematic.std(axis=1)
    assert jumps.max() < 0.4
    found = vl.discover(t, seen.x, systematic=seen.systematic)
    assert study.score(found, truth).exact
    assert study.score(found, truth).l2 < 0.02


def test_synchronous_cameras_have_no_lags_and_no_others_are_tried(case, monkeypatch):
    rig, tracks = case
    known = vl.observe_tracks(tracks, rig, np.arange(150), lags=(0, 0, 0))
    monkeypatch.setattr(cameras, "learn_lags", lambda *_, **__: pytest.fail("tried lags"))
    seen = vl.observe_tracks(tracks, rig, np.arange(150), lags="synchronous")
    np.testing.assert_allclose(seen.x, known.x)
    np.testing.assert_array_equal(seen.lags.frames, np.zeros(3))
    assert seen.lags.agree
    with pytest.raises(ValueError, match="lags: must be one of synchronous, got 'together'"):
        vl.observe_tracks(tracks, rig, np.arange(150), lags="together")


LOOP = np.column_stack((np.cos(np.arange(200) / 9), np.sin(np.arange(200) / 7))) * 90 + 200


def causes(step, *tracks):
    names = [f"{letter}.mp4" for letter, _ in zip("abc", tracks, strict=False)]
    outer, inner = (refusing(one, tracks, names) for one in ("law", step))
    with pytest.raises(Refused) as caught, outer, inner:
        raise ValueError("what is wrong")
    assert caught.value.step == step
    assert len(caught.value.tracks) == len(tracks)
    said, order = str(caught.value).split("; likely causes, in this order: ")
    assert said == "what is wrong"
    return order


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
def test_a_strange_track_accuses_the_tracker_and_good_ones_the_rig_or_the_lags(kind, step):
    assert causes("cameras", LOOP, LOOP) == "the rig, the lags, the tracker"
    assert causes("lags", LOOP, LOOP) == "the lags, the rig, the tracker"
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


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"t": range(150), "fps": 9}, "fps: must not be given with t, got 9"),
        ({"fps": 9, "individual": "a"}, "individual: must be given with files of tracks alone"),
        ({"fps": 9, "lags": "synchronous", "still": True}, "tracks: must show a target that moves"),
        ({"fps": 9, "twice": True}, r"another film for each camera, got tracks.0. and tracks.2. w"),
        ({"fps": 9, "size": (150, 512)}, r"image_size = \(150, 512\), got tracks.1. with places"),
    ],
)
def test_tracks_need_times_once_and_a_motion(case, more, message):
    rig, tracks = case
    if more.pop("still", False):
        tracks = [np.tile(track[:1], (150, 1)) for track in tracks]
    tracks = [*tracks[:2], tracks[0]] if more.pop("twice", False) else tracks
    one, two, three = rig.cameras
    rig = vl.Rig([one, replace(two, image_size=more.pop("size", two.image_size)), three])
    with pytest.raises(ValueError, match=message):
        vl.discover_from_tracks(tracks, rig, **more)
    with pytest.raises(ValueError, match="names: must be one per track, got 1 for 3"):
        vl.observe_tracks(tracks, rig, np.arange(150), names=["a"])


def test_tracks_of_which_nothing_can_be_learned_come_with_the_refusal(case):
    rig, (first, _, third) = case
    tracks = [first, np.full((150, 2), 200.0), third]
    with pytest.raises(Refused, match=r"must determine .* \(look at tracks.1") as caught:
        vl.discover_from_tracks(tracks, rig.uncalibrated(0), np.arange(150), lags="synchronous")
    assert caught.value.step == "cameras"
    np.testing.assert_array_equal(caught.value.tracks[1], tracks[1])
    thirds = [np.where(np.arange(150)[:, None] // 50 == i, t, np.nan) for i, t in enumerate(tracks)]
    with pytest.raises(Refused, match="do two views share frames"):
        vl.observe_tracks(thirds, rig, np.arange(150))


SPRINGS = vl.PolynomialSystem.from_terms(
    {
        "x": {"vx": 1}, "y": {"vy": 1}, "z": {"vz": 1},
        "vx": {"x": -30, "vx": -0.25}, "vy": {"y": -34, "vy": -0.25}, "vz": {"z": -40, "vz": -0.25},
    }
)  # fmt: skip


def test_the_stiffness_of_three_springs_and_a_report_on_accelerations(tmp_path):
    x = SPRINGS.simulate(np.arange(240) / 30, [0.5, 0.2, -0.1, 0, 1, 0.7])[:, :3]
    rig, rng = vl.Rig.around(x, (512, 512)), np.random.default_rng(0)
    tracks = [c.project(x) + 0.1 * rng.normal(size=(240, 2)) for c in rig.cameras]
    found = vl.discover_from_tracks(tracks, rig, fps=30, degree=2, order=2)
    law = found.discovery.system.text(2)
    assert law == "x'' = -30 x - 0.25 vx\ny'' = -34 y - 0.25 vy\nz'' = -40 z - 0.25 vz"
    assert found.status == "ok", found.warnings
    write_report(found, None, tmp_path / "report", {})
    written = json.loads((tmp_path / "report" / "result.json").read_text())
    equations = [term["equation"] for term in written["law"]["data"]["terms"]]
    assert equations == ["x''", "x''", "y''", "y''", "z''", "z''"]
    assert "\nperiod x = 1.147" in (tmp_path / "report" / "report.html").read_text()
