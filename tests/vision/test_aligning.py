"""Two views of one scene, laid on each other by all of their pixels, where the motion is known."""

import cv2
import numpy as np
import pytest
from footage import Phone, write_phone
from hypothesis import given
from hypothesis import strategies as st

from vidsindy_lite import track
from vidsindy_lite.vision import steadying as aligning
from vidsindy_lite.vision.steadying import (
    Ground,
    Steadying,
    _as_similarity,
    _error,
    _middle,
    grounds,
    pyramid,
)
from vidsindy_lite.vision.steadying import align as align_on

SIZE = 320, 240


def align(before, after, guess):
    """One pyramid laid on another."""
    return align_on(grounds(before), after, guess)


def sight(seed, here=None, noise=2.0, contrast=20, light=1.0):
    """A cloudy scene of few corners, seen through a map of its pixels to those of the view."""
    rng = np.random.default_rng(seed)
    cloud = cv2.GaussianBlur(rng.normal(size=(300, 380)).astype(np.float32), (0, 0), 12)
    scene = 130 + contrast * cloud / cloud.std()
    move = np.array([[1, 0, -30], [0, 1, -30], [0, 0, 1.0]])
    here = np.eye(3) if here is None else here
    rng = np.random.default_rng([seed, int(1e6 * abs(here).sum())])
    view = light * cv2.warpAffine(scene, (here @ move)[:2], SIZE, flags=cv2.INTER_LINEAR)
    view = view[..., None] + rng.normal(0, noise, (*SIZE[::-1], 3))
    return np.clip(view, 0, 255).astype(np.uint8)


def similar(u, v, turn=0.0, scale=1.0):
    c, s = scale * np.cos(turn), scale * np.sin(turn)
    return np.array([[c, -s, u], [s, c, v], [0, 0, 1]])


def about_the_middle(**change):
    here = similar((SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2)
    return here @ similar(0, 0, **change) @ np.linalg.inv(here)


@pytest.mark.parametrize(
    ("move", "light"),
    [
        (about_the_middle(turn=0.06), 1.0),
        (about_the_middle(scale=1.05), 1.0),
        (similar(0, 0), 1.0),
        (similar(0.7, -0.4), 1.0),
        (similar(-6, 9, 0.01), 1.1),
        (similar(14, -3, -0.02, 1.01), 0.8),
    ],
)
def test_shift_turn_and_scale_of_clouds(move, light):
    before, after = pyramid(sight(0)), pyramid(sight(0, move, light=light))
    found = align(before, after, np.eye(3))
    points = np.array([[40, 40, 1], [280, 40, 1], [160, 120, 1], [280, 200, 1.0]])
    miss = np.linalg.norm((points @ (found.map - move).T)[:, :2], axis=1)
    assert miss.max() < 0.1
    assert miss.mean() <= 8 * found.error < 0.5


def test_the_perspective_of_a_guess_does_no_harm():
    move = similar(3, -2, 0.01)
    guess = move.copy()
    guess[2, :2] = 1e-4, -5e-5
    found = align(pyramid(sight(0)), pyramid(sight(0, move)), guess)
    points = np.array([[40, 40, 1], [280, 40, 1], [160, 120, 1], [280, 200, 1.0]])
    ends = points @ found.map.T
    assert np.linalg.norm((ends / ends[:, 2:] - points @ move.T)[:, :2], axis=1).max() < 0.1


def test_what_moves_on_its_own_is_left_aside():
    move = similar(3, 2)
    views = [sight(1), sight(1, move)]
    for view, left in zip(views, (60, 110), strict=True):
        view[60:180, left : left + 60] = (20, 20, 160)  # a large thing that goes elsewhere
    found = align(*map(pyramid, views), np.eye(3))
    assert np.linalg.norm(found.map[:2, 2] - move[:2, 2]) < 0.5


@pytest.mark.parametrize("light", [0.85, 1.0, 1.15])
def test_a_dark_post_in_another_light_shifts_nothing(light):
    move = similar(4.3, -2.6)
    views = [sight(2).astype(np.float32), sight(2, move).astype(np.float32)]
    for view, here in zip(views, (np.eye(3), move), strict=True):
        post = np.zeros(SIZE[::-1], np.float32)
        post[:, 150:168] = 1
        post = cv2.warpAffine(post, here[:2], SIZE)[..., None]
        view[:] = view * (1 - post) + 30 * post
    before, after = sight(2), sight(2, move)
    before[:], after[:] = views[0], np.clip(light * views[1], 0, 255)
    found = align(pyramid(before), pyramid(after), np.eye(3))
    assert np.linalg.norm(found.map[:2, 2] - move[:2, 2]) < 0.15


@pytest.mark.parametrize("things", [0, 3])
def test_noise_and_a_few_things_tell_nothing(things):
    rng = np.random.default_rng(3)
    views = []
    for _ in range(2):
        wall = 120 + np.linspace(0, 20, SIZE[0])[None, :, None] + np.zeros((SIZE[1], 1, 3))
        for u, v in rng.integers(20, 200, (things, 2)):
            wall[v : v + 12, u : u + 12] = 40
        views.append(np.clip(wall + rng.normal(0, 3, wall.shape), 0, 255).astype(np.uint8))
    assert align(*map(pyramid, views), np.eye(3)).error > 2


@pytest.mark.parametrize("seed", range(3))
def test_clouds_tell_a_motion_better_than_leaves_that_sway(seed):
    rng = np.random.default_rng(seed)
    shift = np.array([5, -4])
    views = [sight(seed, noise=1), sight(seed, similar(*shift), noise=1)]
    for _ in range(30):
        leaf = rng.uniform(30, [290, 210])
        for view, here in zip(views, (leaf, leaf + shift + rng.uniform(-2.5, 2.5, 2)), strict=True):
            cv2.circle(view, tuple(np.rint(16 * here).astype(int)), 48, (90, 90, 90), -1, 8, 4)
    steadying = Steadying(1)
    for view in views:
        steadying.add(view)
    motion = steadying.motion()
    assert motion.errors[1] < 0.15
    assert np.linalg.norm(np.linalg.inv(motion.maps[1])[:2, 2] - shift) < 0.5


def test_a_camera_held_before_a_plain_wall_is_doubted(tmp_path):
    phone = Phone("plain", 20, camera="held", flicker=0.03, image_size=(320, 240), frames=40)
    write_phone(tmp_path / "clip.mp4", phone, 3)
    found = track(tmp_path / "clip.mp4")
    assert any("too plain to tell whether the camera moves" in doubt for doubt in found.warnings)


def test_a_plain_wall_tells_no_motion(tmp_path):
    phone = Phone("plain", 30, person=True, image_size=(320, 240), frames=40)
    write_phone(tmp_path / "clip.mp4", phone, 3)
    found = track(tmp_path / "clip.mp4")
    assert found.maps is None


def waves(faint, u=0.0, v=0.0):
    """Plain waves to the right, grey levels, and such faint ones downwards, shifted by pixels."""
    down, right = np.mgrid[:120, :160].astype(float)
    plain = 20 * np.sin((right - u) / 9) + 20 * np.sin((right - u) / 5 + 1)
    return [(100 + plain + faint * np.sin((down - v) / 11)).astype(np.float32)]


def test_the_less_is_told_of_a_direction_the_closer_to_the_guess_it_stays():
    faints = np.geomspace(1e-3, 1, 16)
    found = [align(waves(faint), waves(faint, 2, 3), np.eye(3)) for faint in faints]
    shifts = np.array([one.map[:2, 2] for one in found])  # of an image twice as large
    np.testing.assert_allclose(shifts[:, 0], 4, atol=0.01)
    assert (np.diff(shifts[:, 1]) > -0.01).all()
    np.testing.assert_allclose(shifts[[0, -1], 1], (0, 6), atol=0.5)


@pytest.mark.parametrize("turn", [0.05, 0.2])
def test_a_turn_alone_is_followed_to_its_end(turn):
    # Clouds that are the same upside down tell no shift at all, at no step.
    clouds = cv2.GaussianBlur(np.random.default_rng(0).normal(size=(241, 321)), (0, 0), 8)
    clouds = 20 * (clouds + clouds[::-1, ::-1]) / clouds.std()
    views = []
    for angle in (0.0, turn):
        middle = similar(160, 120) @ similar(0, 0, -angle) @ similar(-79.5, -59.5)
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        views.append([cv2.warpAffine(clouds, middle[:2], (160, 120), flags=flags)])
    found = align(*[[np.float32(100 + level) for level in view] for view in views], np.eye(3))
    assert np.arctan2(found.map[1, 0], found.map[0, 0]) == pytest.approx(turn, abs=1e-4)


@given(st.lists(st.floats(-1e3, 1e3, width=32), min_size=3, max_size=60))
def test_the_middle_is_the_median_of_every_other_value(values):
    values = np.array(values, np.float32)
    assert _middle(values) == np.median(values[::2])


def plane(width, height, right, down, middle=50.0):
    """Grey levels that grow evenly, with so much in the middle."""
    v, u = np.mgrid[:height, :width].astype(np.float32)
    plain = middle + right * (u - (width - 1) / 2) + down * (v - (height - 1) / 2)
    return plain.astype(np.float32)


def test_the_slopes_of_a_plane_are_what_shift_scale_turn_and_light_change():
    ground = Ground.of(plane(36, 25, 2.0, -3.0))
    np.testing.assert_array_equal(ground.u, np.arange(36) - 17.5)
    np.testing.assert_array_equal(ground.v, (np.arange(25) - 12)[:, None])
    shift_u, shift_v, scale, turn, gain, offset = (by[1:-1, 1:-1] for by in ground.slopes)
    u, v = (ground.u + 0 * ground.v)[1:-1, 1:-1], (ground.v + 0 * ground.u)[1:-1, 1:-1]
    np.testing.assert_allclose(shift_u, 2, atol=1e-4)
    np.testing.assert_allclose(shift_v, -3, atol=1e-4)
    np.testing.assert_allclose(scale, 2 * u - 3 * v, atol=1e-2)
    np.testing.assert_allclose(turn, -3 * u - 2 * v, atol=1e-2)
    np.testing.assert_allclose(gain, 50 + 2 * u - 3 * v, atol=1e-4)
    assert (offset == 1).all()


@pytest.mark.parametrize(("right", "down"), [(1, 0), (0, 1), (0.6, 0.8)])
def test_no_block_may_tell_more_than_four_times_as_much_as_a_usual_one(right, down):
    v, u = np.mgrid[:96, :120]
    steep = (abs(u - 60) < 12) & (abs(v - 48) < 10)
    for factor, share in ((1.6, 1.0), (4.0, 0.25), (10.0, 0.04)):
        way = right * (u - 60) + down * (v - 48)
        ground = Ground.of(np.where(steep, factor * way, way).astype(np.float32))
        assert ground.share[48, 60] == pytest.approx(share, rel=1e-3)
        assert ground.share[5, 5] == pytest.approx(1)


@pytest.mark.parametrize(
    ("size", "levels"),
    [((320, 240), [(120, 160), (60, 80), (30, 40)]),
     ((32, 64), [(32, 16)]), ((31, 200), []),
     ((640, 530), [(265, 320), (133, 160), (67, 80), (34, 40)])],
)  # fmt: skip
def test_a_pyramid_has_four_levels_as_long_as_there_are_32_pixels_to_halve(size, levels):
    image = np.full((*size[::-1], 3), 77, np.uint8)
    found = pyramid(image)
    assert [level.shape for level in found] == levels
    assert all(np.allclose(level, 77) for level in found)


def test_the_similar_map_nearest_to_a_guess():
    # Over the corners of 200 x 100 pixels the places spread four times as much along u.
    size = np.array([200, 100])
    same = similar(3, -7, 0.2, 1.1)
    np.testing.assert_allclose(_as_similarity(same, size), same, atol=1e-9)
    np.testing.assert_allclose(_as_similarity(2 * same, size), same, atol=1e-9)
    wide = np.array([[1.2, 0, 0], [0, 1, 0], [0, 0, 1]])
    nearest = [[1.16, 0, 120 - 116], [0, 1.16, 50 - 58], [0, 0, 1]]
    np.testing.assert_allclose(_as_similarity(wide, size), nearest, atol=1e-9)
    skew = np.array([[1, 0.2, 0], [0, 1, 0], [0, 0, 1]])
    nearest = [[1, 0.04, 110 - 102], [-0.04, 1, 50 - 46], [0, 0, 1]]
    np.testing.assert_allclose(_as_similarity(skew, size), nearest, atol=1e-9)


def test_errors_of_one_block_add_up_and_those_of_different_ones_do_not():
    # Blocks of 3 x 2 pixels; what all told pulls by 6 in one block, or by 1 in each of six.
    u, v = np.arange(36, dtype=np.float32) - 17.5, (np.arange(24, dtype=np.float32) - 11.5)[:, None]
    far = np.mean(u**2) + np.mean(v**2)
    information = np.diag([2.0, 2, 4, 4, 1, 1])
    one, six = np.zeros((24, 36), np.float32), np.zeros((24, 36), np.float32)
    one[6:8, 9:12] = 1
    six[6:18:2, 9] = 1
    for channel, variance in ((0, 0.25), (1, 0.25), (2, far / 16), (3, far / 16)):
        slopes = np.zeros((6, 24, 36), np.float32)
        slopes[channel] = 1
        known = 0.5 + 0.5 + far * (0.25 + 0.25)
        own = 0.5 if channel < 2 else far * 0.25
        for pull, square in ((one, 36), (six, 6)):
            wanted = np.sqrt((known - own + max(own, variance * square)) / 2)
            assert _error(slopes, pull, information, (u, v)) == pytest.approx(wanted, rel=1e-5)
    odd = np.pad(one, ((0, 5), (0, 7)))  # what is over is left out
    slopes = np.zeros((6, 29, 43), np.float32)
    slopes[0] = 1
    wanted = np.sqrt((0.25 * 36 + 0.5 + far * 0.5) / 2)
    assert _error(slopes, odd, information, (u, v)) == pytest.approx(wanted, rel=1e-5)
    assert _error(slopes[:, :11], odd[:11], information, (u, v)) == np.inf
    assert _error(slopes[..., :11], odd[:, :11], information, (u, v)) == np.inf


@pytest.mark.parametrize(("gone", "found"), [(0.55, True), (0.8, False)])
@pytest.mark.parametrize("across", [True, False])
def test_two_views_must_share_three_tenths_of_what_they_show(across, gone, found):
    rng = np.random.default_rng(0)
    cloud = cv2.GaussianBlur(rng.normal(size=(560, 640)).astype(np.float32), (0, 0), 6)
    scene = (100 + 20 * cloud / cloud.std()).astype(np.float32)
    u, v = (round(gone * 160), 0) if across else (0, round(gone * 120))
    before, after = scene[200:320, 200:360], scene[200 + v : 320 + v, 200 + u : 360 + u]
    guess = similar(-2.0 * u, -2.0 * v)
    told = align_on(grounds([before]), [after], guess)
    assert (told is not None) == found
    if told:
        np.testing.assert_allclose(told.map, guess, atol=0.05)


@pytest.mark.parametrize(("width", "told"), [(20, False), (110, True)])
def test_what_few_blocks_tell_may_move_on_its_own(width, told):
    rng = np.random.default_rng(0)
    cloud = cv2.GaussianBlur(rng.normal(size=(130, 170)).astype(np.float32), (0, 0), 3)
    cloud *= 20 / cloud.std()
    views = []
    for u in (5, 6):
        view = np.full((120, 160), 100, np.float32)
        view[40 : 40 + width // 2, 30 : 30 + width] += cloud[
            45 : 45 + width // 2, 30 + u : 30 + u + width
        ]
        views.append(view + rng.normal(0, 0.5, view.shape).astype(np.float32))
    found = align_on(grounds(views[:1]), views[1:], np.eye(3))
    assert np.isfinite(found.error) == told


@pytest.mark.parametrize("seed", range(12))
def test_frames_that_share_mere_noise_tell_no_map(seed):
    before, after = np.random.default_rng(seed).normal(128, 3, (2, 360, 480, 3))
    views = [np.clip(one, 0, 255).astype(np.uint8) for one in (before, after)]
    assert not np.isfinite(align(*map(pyramid, views), np.eye(3)).error)


@pytest.mark.parametrize(("error", "known"), [(3.9, True), (4.1, False)])
def test_a_map_that_is_known_no_better_than_its_guess_is_not_known(monkeypatch, error, known):
    # The guess to 8 pixels; the finest level is of half the size.
    monkeypatch.setattr(aligning, "_error", lambda *_: error)
    views = pyramid(sight(0)), pyramid(sight(0, similar(0.7, -0.4)))
    assert np.isfinite(align(*views, np.eye(3)).error) == known


def test_the_error_of_a_map_is_about_that_by_which_it_misses():
    errors, misses = [], []
    for seed in range(12):
        move = similar(1.3, -0.8, 0.004)
        found = align(pyramid(sight(seed, noise=4)), pyramid(sight(seed, move, noise=4)), np.eye(3))
        points = np.array([[u, v, 1.0] for u in (20, 160, 300) for v in (20, 120, 220)])
        errors.append(found.error)
        misses.append(np.mean(((points @ (found.map - move).T) ** 2).sum(axis=1)) / 2)
    assert 0.5 < np.sqrt(np.mean(misses) / np.mean(np.square(errors))) < 2
