"""Rigs of which nothing or only the lenses are known: where they stand, or an affine map."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import aligned_error, far_off, real, room, shot, walk

import vidsindy_lite as vl
from vidsindy_lite.cameras import AffineCamera, Footage, factorised, learn_cameras_eq4, posed
from vidsindy_lite.pipeline import observe_tracks

FRAMES = np.arange(240)


def lenses(rng, rig, off=0.05, **more):
    """The rig with nothing but focal lengths, within a share of the true ones."""
    return vl.Rig(
        [
            vl.PerspectiveCamera(
                scale=c.scale * (1 + off * rng.uniform(-1, 1)), image_size=c.image_size,
                scale_error=off / 2,
            )
            for c in rig.cameras
        ],
        **more,
    )  # fmt: skip


def test_the_frame_is_that_of_the_first_camera_and_is_told():
    rng = np.random.default_rng(1)
    rig = room(rng)
    tracks = shot(rng, rig, FRAMES)
    learned = posed(tracks, lenses(rng, rig))
    first, second, _ = learned.cameras
    np.testing.assert_allclose(first.normal, [0, 0, 1], atol=1e-12)
    assert abs(first.angle) < 1e-12
    np.testing.assert_allclose(np.linalg.norm(first.position - second.position), 1, rtol=1e-9)
    path = vl.reconstruct(tracks, learned)
    np.testing.assert_allclose(path.mean(axis=0), 0, atol=1e-3)
    u = tracks[0] - tracks[0].mean(axis=0)
    assert np.sum(path[:, 0] * u[:, 0]) > 0
    assert np.sum(path[:, 1] * u[:, 1]) < 0  # v is down
    assert "x is to the right and y up in the image of the first camera" in learned.note
    assert learned.note in learned.text()
    assert vl.learn_cameras(tracks, learned).note == learned.note
    assert posed(tracks, learned) is learned
    with pytest.raises(ValueError, match="cameras stand.* got no start"):
        posed([track[:7] for track in tracks], lenses(rng, rig))


def test_a_known_distance_gives_the_unit_of_length():
    rng = np.random.default_rng(2)
    rig = room(rng)
    tracks = shot(rng, rig, FRAMES)
    first, second, _ = (c.position for c in rig.cameras)
    distance = float(np.linalg.norm(first - second))
    seen = observe_tracks(tracks, lenses(rng, rig, distance=distance), FRAMES / 30)
    spread = [np.sqrt(np.mean(np.var(x, axis=0))) for x in (seen.x, walk(FRAMES))]
    assert abs(spread[0] / spread[1] - 1) < 0.01
    assert seen.warnings == ()
    assert "the first camera is" in seen.rig.note


def test_small_lags_are_learned_beside():
    rng = np.random.default_rng(3)
    rig, late = room(rng, 4), (0, 0.7, -0.9, 0.3)
    tracks = shot(rng, rig, FRAMES, late)
    seen = observe_tracks(tracks, lenses(rng, rig), FRAMES / 30)
    np.testing.assert_allclose(seen.lags.frames, late, atol=0.1)
    x = walk(FRAMES)
    inside = np.isfinite(seen.x).all(axis=1)
    assert aligned_error(seen.x[inside], x[inside]) < 0.005 * np.ptp(x, axis=0).max()


def of_lenses(rig, by):
    """The same views, by lenses so many times as long, from so many times as far."""
    return vl.Rig(replace(c, position=by * c.position, scale=c.scale / by) for c in rig.cameras)


def blind(rig, known=0):
    """Cameras of which nothing is known, but for the focal lengths of some."""
    return vl.Rig(
        vl.PerspectiveCamera(scale=c.scale if i < known else None, image_size=c.image_size)
        for i, c in enumerate(rig.cameras)
    )


@pytest.mark.parametrize(("times", "known"), [(1, 1), (6, 0)])
def test_nothing_is_known_at_all(times, known):
    rng = np.random.default_rng([5, times])
    rig = of_lenses(room(rng), times)
    x, tracks = walk(FRAMES), shot(rng, rig, FRAMES)
    learned = vl.learn_cameras(tracks, blind(rig, known))
    assert aligned_error(vl.reconstruct(tracks, learned), x) < 0.005 * np.ptp(x, axis=0).max()
    assert "focal lengths are those that the tracks tell" in learned.note
    if times == 1:
        found = [c.focal_length for c in learned.cameras]
        np.testing.assert_allclose(found, [c.focal_length for c in rig.cameras], rtol=0.05)


def test_from_infinity_either_hand_fits():
    rng = np.random.default_rng(6)
    rig = vl.Rig(far_off(room(rng)))
    tracks = shot(rng, rig, FRAMES)
    with pytest.raises(ValueError, match="cameras too far away"):
        vl.learn_cameras(tracks, blind(rig))


def test_a_file_of_lenses(tmp_path):
    text = '[[camera]]\nmodel = "perspective"\nfield_of_view = 60\nscale_error = 0.03\n'
    (tmp_path / "rig.toml").write_text("distance = 2.5\n" + 3 * text)
    rig = vl.Rig.load(tmp_path / "rig.toml")
    assert not rig.is_measured
    assert rig.distance == 2.5
    assert [c.focal_length for c in rig.cameras] == pytest.approx([512 / 2 / np.tan(np.pi / 6)] * 3)
    rig.save(tmp_path / "again.toml")
    assert "normal" not in (tmp_path / "again.toml").read_text()
    assert vl.Rig.load(tmp_path / "again.toml") == rig


def test_what_is_no_rig_of_lenses():
    lens = vl.PerspectiveCamera(scale=1e-3)
    flat = vl.OrthographicCamera(normal=(0, 0, 1), position=(0, 0, 1), scale=1.0, angle=0.0)
    with pytest.raises(ValueError, match="cameras: must be 3 or more if nothing is measured"):
        vl.Rig([lens, lens])
    with pytest.raises(ValueError, match=r"must all have a position, or none .* cameras\[1\]"):
        vl.Rig([flat, lens, lens])
    with pytest.raises(ValueError, match="distance: must not be given with positions"):
        vl.Rig([flat, vl.OrthographicCamera(normal=(1, 0, 0))], distance=2.0)
    with pytest.raises(ValueError, match="distance: must be positive"):
        vl.Rig([lens] * 3, distance=0.0)
    with pytest.raises(ValueError, match=r"Eq. \(4\) needs all positions, got none"):
        learn_cameras_eq4([walk(np.arange(20))[:, :2]] * 3, vl.Rig([lens] * 3))
    with pytest.raises(ValueError, match="camera: position must be known"):
        lens.project(np.zeros((1, 3)))


LAGS = np.array([0.0, 17.4, -8.0, 5.5])
FPS = 30


def swinging(frames, moving=3):
    """Places of a weight that swings along three axes, each with a period of its own, in pixels."""
    t = frames / FPS
    period, size = np.array([1.3, 2.1, 0.9]), np.array([40.0, 25, 15]) * (np.arange(3) < moving)
    return size * np.cos(2 * np.pi * t[:, None] / period + [0.3, 1.0, 2.0])


def far_away(views=3, moving=3, noise=0.2, count=240, seed=0, lags=LAGS):
    """Tracks of cut-out films by cameras far away, each begun at its own time."""
    rng = np.random.default_rng(seed)
    tracks = []
    for lag in lags[:views]:
        axes, middle = rng.normal(size=(2, 3)), rng.uniform(50, 300, size=2)
        x = swinging(np.arange(count) + lag, moving)
        tracks.append(middle + x @ axes.T + noise * rng.normal(size=(count, 2)))
    return tracks, vl.Rig(tuple(vl.PerspectiveCamera() for _ in range(views)))


@pytest.mark.parametrize(("views", "moving"), [(3, 2), (4, 3)])
def test_lags_and_axes_of_motion(views, moving):
    tracks, rig = far_away(views, moving)
    found = factorised(Footage.of(tracks), rig)
    assert len(found.variance) == moving
    np.testing.assert_allclose(found.lags.frames, LAGS[:views], atol=0.1)
    assert (found.lags.errors[1:] < 0.05).all()
    assert found.lags.residual < 0.3
    assert found.lags.warnings == ()


def test_noise_makes_no_pinholes_of_parallel_views():
    tracks, rig = far_away(noise=2.0, count=100, lags=[0.0, 2.0, -3.0])
    assert "affine" in vl.observe_tracks(tracks, rig, np.arange(100) / FPS).rig.note


@pytest.mark.parametrize("seed", range(4, 8))
def test_noise_makes_no_fractions_of_whole_lags(seed):
    tracks, rig = far_away(noise=2.0, count=150, seed=seed, lags=[0.0, 2.0, -3.0])
    lags = factorised(Footage.of(tracks), rig).lags
    assert (np.abs(lags.frames - [0.0, 2.0, -3.0]) <= 3 * lags.errors).all()
    assert lags.errors.max() < 0.2


def test_lags_that_others_fit_as_well_are_doubted():
    rng = np.random.default_rng([77, 12, 2])
    rig = vl.Rig(replace(c, image_size=(1280, 2400)) for c in of_lenses(room(rng), 12).cameras)
    tracks = shot(rng, rig, FRAMES, (0, 5, -3))
    tracks = [track + 1.5 * rng.normal(size=track.shape) for track in tracks]
    doubt = "the lags of the videos cannot be told: "
    seen = observe_tracks(tracks, blind(rig), FRAMES / FPS)
    assert any(text.startswith(doubt) for text in seen.warnings)


def test_views_of_different_things_do_not_agree():
    tracks, rig = far_away(count=120)
    rng = np.random.default_rng(1)
    tracks[2] = np.cumsum(rng.normal(size=(120, 2)), axis=0) * 5
    assert factorised(Footage.of(tracks), rig) is None
    with pytest.raises(ValueError, match="must tell where the cameras stand"):
        vl.observe_tracks(tracks, rig, np.arange(120) / FPS)


def test_few_frames_in_which_all_agree_by_chance_are_told():
    rng = np.random.default_rng(4)
    rig = room(rng, 4)
    films = Footage.of(shot(rng, rig, FRAMES, (0, 30, -30, 5)))
    (doubt,) = factorised(films, lenses(rng, rig)).lags.warnings
    assert "views agree on one motion but for" in doubt


def test_views_with_nothing_in_common_and_what_stands_still_tell_nothing():
    tracks, rig = far_away()
    told = factorised(Footage.of(tracks, LAGS[:3]), rig, synchronous=True)
    assert told.lags.frames.tolist() == [*LAGS[:3]]
    tracks[1][:] = np.nan
    for synchronous in (False, True):
        assert factorised(Footage.of(tracks), rig, synchronous) is None
    assert factorised(Footage.of([np.ones_like(track) for track in tracks]), rig) is None


def test_what_two_views_alike_cannot_tell_is_no_more_than_the_spread_of_the_path():
    rng, x = np.random.default_rng(3), swinging(np.arange(200))
    one, other = rng.normal(size=(2, 2, 3))
    each = one, one + 0.01 * rng.normal(size=(2, 3)), other
    tracks = [100 + x @ axes.T + 0.3 * rng.normal(size=(200, 2)) for axes in each]
    tracks[2][120:] = np.nan
    found = factorised(Footage.of(tracks, [0.0] * 3), far_away()[1], synchronous=True)
    places, known = found.places(tracks), np.column_stack([np.ones(200), x])
    off = places - known @ np.linalg.lstsq(known[:120], places[:120], rcond=None)[0]
    assert (off[:120].std(axis=0) < 0.5).all()
    assert (off[120:].std(axis=0) < 1.5 * places[:120].std(axis=0)).all()


def test_the_law_of_a_swing_needs_no_rig():
    swings = 2.1, 1.3
    tracks, rig = far_away(moving=len(swings))
    found = vl.discover_from_tracks(tracks, rig, fps=FPS)
    periods = [q for q in found.discovery.physics() if q.name.startswith("period")]
    for period, true in zip(periods, swings, strict=True):
        assert abs(period.value - true) < 4 * period.error + 1e-9
        assert period.error < 0.02 * true
    assert "frequencies and dampings" in found.rig.note
    assert max(np.nanstd(missed) for missed in found.residuals) < 0.3


@pytest.mark.thorough  # three films, two minutes
def test_three_telephones_of_which_nothing_is_known():
    hints = [None, None, vl.Hint(frame=0, box=(68, 38, 70, 82))]
    found = vl.discover_from_videos([real(f"can_{i}") for i in (1, 2, 3)], hints=hints)
    assert abs(found.period.value - 40.2 / 30) < 3 * found.period.error < 0.08


def test_affine_cameras_see_what_their_axes_say_and_have_a_file(tmp_path):
    down, x = np.array([[1.0, 2, 0], [0.5, 0, -3]]), np.random.default_rng(0).normal(size=(9, 3))
    camera = AffineCamera.of(down, np.array([20.0, 30]), (100, 80))
    np.testing.assert_allclose(camera.project(x), [20, 30] + x @ down.T)
    other = AffineCamera.of(down[::-1] + 1, np.array([20.0, 30]), (100, 80))
    rig = vl.Rig((camera, other))
    rig.save(tmp_path / "rig.toml")
    assert vl.Rig.load(tmp_path / "rig.toml") == rig
    tracks = [one.project(x) for one in rig.cameras]
    np.testing.assert_allclose(vl.reconstruct(tracks, rig), x, atol=1e-10)


@pytest.mark.parametrize("axes", [np.ones((2, 3)), np.zeros((3, 2)), None, [[1, 2, np.nan]] * 2])
def test_axes_must_be_independent(axes):
    with pytest.raises(ValueError, match="axes"):
        AffineCamera(axes=axes, normal=(0, 0, 1))
