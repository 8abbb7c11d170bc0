"""Learning cameras, reconstruction, rig files to start from, and what bad input is told."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from helpers import room, scene, trajectory, walk
from hypothesis import given, settings
from hypothesis import strategies as st

import vidsindy_lite as vl
from vidsindy_lite.cameras import (
    OrthographicCamera,
    Rig,
    adjust,
    calibrate,
    calibration_errors,
    check_learnable,
    learn_cameras,
    learn_cameras_eq4,
    reconstruct,
    residuals,
    rig_template,
    synchronise,
)

SEEDS = st.integers(0, 2**32 - 1)
PLACED = "[[camera]]\nposition = [0, 0, 1]\nnormal = [0, 0, 1]\n"


@pytest.fixture
def small():
    return scene(7, n=40)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[camera]", "must be a TOML file"),
        ("", r"must hold \[\[camera\]\] tables and at most a distance, got \[\]"),
        ("[camera]\nnormal = [0, 0, 1]", r"must hold \[\[camera\]\] tables"),
        ("unit = 'mm'\n[[camera]]", r".* at most a distance, got \['camera', 'unit'\]"),
        ("camera = [1, 2]", "camera 0: must be a table"),
        ("[[camera]]\nposition = [0, 0, 1]", "camera 0: normal: must be given, got keys posi"),
        (f"{PLACED}model = 'fisheye'", "camera 0: model: must be one of orthographic"),
        (f"{PLACED}distortion = [0.1]", "camera 0: distortion: must be one of model, target"),
        (f"{PLACED}zoom = 2", "camera 0: zoom: must"),
        (f"{PLACED}{PLACED}scale = -1\nangle = 0", "camera 1: scale: must be positive, got -1"),
        (PLACED + PLACED, "cameras: must have at least two independent normals"),
    ],
)
def test_bad_file_names_file_camera_and_key(tmp_path, text, message):
    path = tmp_path / "broken.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"^rig: {message}.*broken\.toml'"):
        Rig.load(path)
    with pytest.raises(FileNotFoundError, match=r"^rig: no such file, got '.*nowhere\.toml'$"):
        Rig.load(tmp_path / "nowhere.toml")


def test_needs_two_cameras_with_independent_normals(small):
    for second in ((0, 0, -1), (1e-9, 0, 1)):
        normals = ((0, 0, 1), second, (0, 0, 2))
        with pytest.raises(ValueError, match="cameras: must have at least two independent normals"):
            Rig(OrthographicCamera(position=(0, 0, 0), normal=n) for n in normals)
    with pytest.raises(ValueError, match="rig: must hold two or more cameras, got 1"):
        check_learnable(Rig(small[1].cameras[:1]))
    with pytest.raises(ValueError, match="cameras: must be one or more, got none"):
        Rig([])
    for none in (None, small[1].cameras[0], 3):
        with pytest.raises(ValueError, match="cameras.*: must be"):
            Rig(none)
    with pytest.raises(ValueError, match=r"cameras\[0\]: must be of type Camera, got 1"):
        Rig([1, 2])


def test_uncalibrated(small):
    _, rig, _, _ = small
    start = rig.uncalibrated(keep=2)
    assert [camera.is_calibrated for camera in start.cameras] == [False, False, True]
    assert start.cameras[2] == rig.cameras[2]
    with pytest.raises(ValueError, match="keep: must be an index of 3 cameras, got 3"):
        rig.uncalibrated(keep=3)
    for keep in (1.5, -1, "a"):
        with pytest.raises(ValueError, match="keep: must be an integer of at least 0, got"):
            rig.uncalibrated(keep)
    for name, use in (("rig", Rig.load), ("path", rig.save)):
        with pytest.raises(ValueError, match=f"{name}: must be the name of a file, got None"):
            use(None)


@given(SEEDS, st.sampled_from([(512, 512), (640, 480), (100, 300)]))
@settings(max_examples=10)
def test_around_fills_the_images(seed, image_size):
    x = trajectory(np.random.default_rng(seed), 200)
    rig = Rig.around(x, image_size=image_size)
    half = (np.array(image_size) - 1) / 2
    for camera in rig.cameras:
        used = np.abs(camera.project(x) - half) / half
        assert used.max() == pytest.approx(0.85, abs=1e-6)
    normals = np.array([camera.normal for camera in rig.cameras])
    assert np.linalg.svd(normals, compute_uv=False)[-1] > 0.3
    up = [np.diff(c.project([[0, 0, 0], [0, 0, 1]]), axis=0)[0] for c in rig.cameras]
    roll = [np.rad2deg(np.arctan2(-right, -down)) for right, down in up]
    np.testing.assert_allclose(roll, [6, -9, 14], atol=1e-9)


def test_around_needs_a_scene():
    with pytest.raises(ValueError, match="x: must hold at least two different points, got"):
        Rig.around(np.full((5, 3), np.nan))
    with pytest.raises(ValueError, match=r"got 1 without NaN in shape \(99, 3\)$"):
        Rig.around(np.ones((99, 3)))
    for size in (512, "ab", (1, 512)):
        with pytest.raises(ValueError, match="image_size: must be two integers of at least 2"):
            Rig.around(np.eye(3), image_size=size)


def test_residuals():
    _, rig, tracks, rng = scene(3, n=1000)
    noisy = [track + 2 * rng.normal(size=track.shape) for track in tracks]
    noisy[1][:10] = np.nan
    found = residuals(noisy, rig)
    assert np.isnan(found[1][:10]).all()
    assert np.isfinite(found[0]).all()
    # Three of the six numbers of a frame are free; 6000 of them give the rms to 1 %.
    rms = np.sqrt(np.nanmean(np.hstack(found) ** 2))
    assert rms == pytest.approx(2 / np.sqrt(2), rel=0.03)
    np.testing.assert_allclose(np.hstack(residuals(tracks, rig)), 0, atol=1e-9)


def test_calibration_errors(small):
    _, truth, _, _ = small
    first, *others = truth.cameras
    turned = replace(first, scale=1.01 * first.scale, angle=first.angle - 3 * np.pi + 0.1)
    off = Rig([turned, *others])
    expected = [[0.01, 0.1 - np.pi], [0, 0], [0, 0]]
    np.testing.assert_allclose(calibration_errors(off, truth), expected, atol=1e-12)
    with pytest.raises(ValueError, match="rig: must be one per camera of truth, got 2 for 3"):
        calibration_errors(Rig(others), truth)
    with pytest.raises(ValueError, match=r"truth: all cameras must .*placed, got cameras\[1\]"):
        calibration_errors(truth, truth.uncalibrated())


@pytest.mark.parametrize("learn", [learn_cameras, learn_cameras_eq4])
@given(SEEDS, st.integers(0, 2))
@settings(max_examples=6)
def test_exact_pixels_give_exact_cameras_that_one_outlier_does_not_bend(learn, seed, keep):
    x, truth, tracks, rng = scene(seed)
    turn, (camera, frame) = rng.uniform(0, 2 * np.pi), rng.integers((3, 500))
    tracks[camera][frame] += 200 * np.array([np.cos(turn), np.sin(turn)])
    learned = learn(tracks, truth.uncalibrated(keep))
    assert np.abs(calibration_errors(learned, truth)).max() < 1e-9
    found = np.delete(reconstruct(tracks, learned) - x, frame, axis=0)
    np.testing.assert_allclose(found, 0, atol=1e-9 * np.ptp(x))


TRACKED = ("learn_cameras", "reconstruct", "residuals", "learn_lags", "align")


@pytest.mark.parametrize(
    ("spoilt", "message"),
    [
        (np.zeros((30, 3)), r"must have shape \(n, 2\), got \(30, 3\)"),
        (np.full((30, 2), np.inf), "must be finite or NaN, got 60 infinite values"),
        (np.full((30, 2), 1e300), r"must be pixels of at most 1e\+100, got 1e\+300"),
        ("abc", "must be an array of real numbers, got 'abc'"),
    ],
)
@pytest.mark.parametrize("name", TRACKED)
def test_what_is_no_track(small, name, spoilt, message):
    _, rig, (first, _, third), _ = small
    use, other = getattr(vl, name), np.zeros(3) if name == "align" else rig
    with pytest.raises(ValueError, match=r"tracks\[1\]: " + message):
        use([first, spoilt, third], other)
    for none in (None, "a.mkv", {}, [], np.array(3.0)):
        with pytest.raises(ValueError, match="tracks: must be (a list, )?one per camera, got "):
            use(none, other)


@pytest.mark.parametrize("use", [learn_cameras, reconstruct, residuals])
def test_tracks_that_do_not_fit_the_rig(small, use):
    _, rig, tracks, _ = small
    for bad, message in [
        (tracks[:2], "tracks: must be one per camera, got 2 for 3"),
        ([tracks[0], tracks[1], tracks[2][:-1]], r"same number of frames, got \[40, 40, 39\]"),
        ([tracks[0], tracks[1], np.nan * tracks[2]], r"tracks\[2\]: must see the target in so"),
    ]:
        with pytest.raises(ValueError, match=message):
            use(bad, rig)
    with pytest.raises(ValueError, match="rig: must be of type Rig, got 'rig.toml'"):
        use(tracks, "rig.toml")
    if use is not learn_cameras:
        with pytest.raises(ValueError, match=r"rig: .* got cameras\[1\] without scale and angl"):
            use(tracks, rig.uncalibrated())


def test_too_few_common_frames(small):
    _, rig, tracks, _ = small
    with pytest.raises(ValueError, match=r"at least 2 equations .* of cameras\[1\] and .* got 1"):
        learn_cameras([track[:1] for track in tracks], rig.uncalibrated())


@pytest.mark.parametrize(
    ("noise", "learn"), [(0, learn_cameras), (3, learn_cameras), (0.3, learn_cameras_eq4)]
)
def test_static_target(small, noise, learn):
    _, rig, tracks, rng = small
    still = [track[:1] + noise * rng.normal(size=track.shape) for track in tracks]
    with pytest.raises(ValueError, match=r"motion must determine .* cameras\[1\] and cameras\[2"):
        learn(still, rig.uncalibrated())


def without(rig, *loose):
    return Rig(
        replace(camera, position=None) if i in loose else camera
        for i, camera in enumerate(rig.cameras)
    )


@given(SEEDS, st.sampled_from([(0, (2,)), (0, (1,)), (2, (2,)), (1, (0,))]))
@settings(max_examples=6)
def test_exact_tracks_give_the_exact_path(seed, which):
    keep, loose = which
    x, rig, tracks, _ = scene(seed, n=100)
    learned = learn_cameras(tracks, without(rig.uncalibrated(keep), *loose))
    for camera, true in zip(learned.cameras, rig.cameras, strict=True):
        np.testing.assert_allclose(camera.offset, true.offset, atol=1e-6 * np.abs(x).max())
    assert np.abs(calibration_errors(learned, rig)).max() < 1e-7
    pixel = np.sqrt(np.mean([camera.scale**2 for camera in rig.cameras]))
    assert np.abs(reconstruct(tracks, learned) - x).max() < 1e-5 * pixel


def test_what_cannot_be_learned_is_said(small):
    x, rig, tracks, _ = small
    with pytest.raises(ValueError, match=r"rig: the positions of two cameras .* got 1"):
        learn_cameras(tracks, without(rig, 1, 2))
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs all positions, got .* cameras\[2\]"):
        learn_cameras_eq4(tracks, without(rig.uncalibrated(), 2))
    still = [np.repeat(track[:1], 40, axis=0) for track in tracks]
    message = r"must determine scale, angle and position of .*cameras\[2\]"
    with pytest.raises(ValueError, match=message):
        learn_cameras(still, without(rig.uncalibrated(), 2))
    loose = without(rig, 1)
    with pytest.raises(ValueError, match=r"got cameras\[1\] without position; learn_cameras"):
        reconstruct(tracks, loose)
    with pytest.raises(ValueError, match="camera: position must be known, got None"):
        loose.cameras[1].project(x)


def test_a_search_that_ran_out_of_steps_is_told(monkeypatch, small):
    _, rig, tracks, rng = small
    given = [track + 0.05 * rng.normal(size=track.shape) for track in tracks], rig.uncalibrated()
    lens = room(rng)
    seen = [c.project(walk(np.arange(99))) + 0.3 * rng.normal(size=(99, 2)) for c in lens.cameras]
    assert learn_cameras(*given).warnings == vl.learn_lags(*given).warnings == ()
    assert learn_cameras(seen, lens.uncalibrated()).warnings == ()
    monkeypatch.setattr(calibrate, "adjust", partial(adjust.adjust, most=1))
    for tracks, start in (given, (seen, lens.uncalibrated())):
        (warning,) = learn_cameras(tracks, start).warnings
        assert "the search for the cameras did not converge in 1 evaluations" in warning
    monkeypatch.setattr(adjust, "_IN_TIME", 0.0)
    monkeypatch.setattr(synchronise, "STEPS", 3)
    found = vl.learn_lags(*given)
    assert found.agree
    assert "the search for the lags of the videos did not converge" in found.warnings[0]


def test_what_eq_4_needs(small):
    _, rig, tracks, _ = small
    assert learn_cameras_eq4(tracks, rig) is rig
    gaps = [np.where(np.arange(40)[:, None] % 3 == i, np.nan, t) for i, t in enumerate(tracks)]
    with pytest.raises(ValueError, match="common views must give at least 4 equations"):
        learn_cameras_eq4(gaps, rig.uncalibrated())
    twin = replace(rig.cameras[1], normal=-rig.cameras[1].normal)
    twins = Rig([rig.cameras[0], rig.cameras[1], twin])
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs two independent normals among"):
        learn_cameras_eq4(tracks, twins.uncalibrated())
    rig = room(np.random.default_rng(0))
    tracks = [camera.project(walk(np.arange(60))) for camera in rig.cameras]
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs orthographic cameras, got a persp"):
        learn_cameras_eq4(tracks, rig.uncalibrated())


@pytest.mark.parametrize("model", ["orthographic", "perspective"])
@pytest.mark.parametrize(("cameras", "apart"), [(2, 120), (3, 120), (5, 72)])
def test_a_template_is_a_rig_with_a_known_camera_evenly_around(tmp_path, cameras, apart, model):
    path = tmp_path / "rig.toml"
    path.write_text(rig_template(cameras, model, (640, 480)), encoding="utf-8")
    placed = vl.Rig.load(path).cameras
    calibrated = [camera.is_calibrated for camera in placed]
    assert calibrated == [True] + [model == "perspective"] * (cameras - 1)
    assert {(camera.model, camera.image_size) for camera in placed} == {(model, (640, 480))}
    azimuths = np.deg2rad(20 + apart * np.arange(cameras))
    circle = np.cos(np.deg2rad(20)) * np.column_stack((np.cos(azimuths), np.sin(azimuths)))
    expected = np.column_stack((circle, np.full(cameras, np.sin(np.deg2rad(20)))))
    np.testing.assert_allclose([c.normal for c in placed], expected, atol=2e-3)
    np.testing.assert_allclose([c.position for c in placed], 3 * expected, atol=2e-3)


def test_what_a_hand_measures(tmp_path):
    path = tmp_path / "rig.toml"
    text = """
[[camera]]
model = "perspective"
position = [3, 1, 1]
looks_at = [0, 1, 1]
field_of_view = 90
roll = {roll}
image_size = [641, 481]
normal_error = 2
"""
    for roll in (30, -90):
        other = "position = [1, 4, 1]\nlooks_at = [1, 1, 1]"
        first = text.format(roll=roll)
        path.write_text(first + first.replace("position = [3, 1, 1]\nlooks_at = [0, 1, 1]", other))
        camera = vl.Rig.load(path).cameras[0]
        middle, above, side = camera.project([[0, 1, 1], [0, 1, 2], [0, 4, 1]])
        np.testing.assert_allclose(middle, (320, 240), atol=1e-9)
        lean = np.deg2rad(roll)
        long = 641 / 2 / 3  # pixels of one metre at three metres
        upright = long * np.array([-np.sin(lean), -np.cos(lean)])
        np.testing.assert_allclose(above - middle, upright, atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(side - middle), 3 * long, rtol=1e-12)
        assert camera.normal_error == 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("looks_at = ", "normal = [1, 0, 0]\nlooks_at = ", "looks_at: must be given with a pos"),
        ("field_of_view = 60", "field_of_view = 180", "field_of_view: must be between 5 and 180"),
        ("field_of_view = 60", "field_of_view = 1.05", r"degrees \(not radians; .*, got 1.05"),
        ("position = [", "position = [0, 0, 0] # ", "looks_at: must be another place than the pos"),
        ("field_of_view = 60", "scale = 1\nfield_of_view = 60", "in place of scale and angle"),
        ("field_of_view = 60", "", "roll: must be given with a field_of_view"),
        ("looks_at = ", "# ", "normal: must be"),
        ("roll = 0", "roll = '0'", "roll: must be a finite number"),
    ],
)
def test_what_a_hand_cannot_have_measured(tmp_path, old, new, message):
    path = tmp_path / "rig.toml"
    path.write_text(rig_template(2).replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ValueError, match=message) as caught:
        vl.Rig.load(path)
    assert "camera 0" in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((1,), "cameras: must be an integer of at least 2, got 1"),
        ((101,), "cameras: must be at most 100, got 101"),
        ((3, "fisheye"), "model: must be one of orthographic, perspective, got 'fisheye'"),
        ((3, "orthographic", (0, 1)), "image_size: must be two integers of at least 1"),
    ],
)
def test_bad_input_is_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        rig_template(*arguments)


@pytest.mark.parametrize("far", [1.0, 1e6])
def test_pinholes_at_one_place_are_no_rig_however_far_from_the_origin(far):
    def rig(apart):
        places = [(far, 0, 0), (far, apart * far, 0)]
        return vl.Rig(vl.PerspectiveCamera(position=p, normal=(1, 0, 0)) for p in places)

    assert len(rig(1e-8).cameras) == 2
    with pytest.raises(ValueError, match="must have at least two independent positions"):
        rig(1e-10)
