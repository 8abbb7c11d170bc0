"""The motion of a camera: by corners or pixels, and which of them is believed."""

import cv2
import numpy as np
import pytest
from footage import Phone, render_phone, write_phone

from vidsindy_lite import track
from vidsindy_lite.vision.camera import Look, camera_motion, rescaled, stands_still, steadied
from vidsindy_lite.vision.camera import align as align_on
from vidsindy_lite.vision.plate import carry, sampled
from vidsindy_lite.vision.video import Reel, write_video

CLOUDY, VGA = (320, 240), (640, 480)


@pytest.mark.parametrize(("ground", "noise", "size"), [("sky", 3, CLOUDY), ("hills", 16, VGA)])
def test_the_frames_of_a_camera_that_trembles_lie_in_the_first(ground, noise, size, tmp_path):
    phone = Phone(ground, 40, noise=noise, camera="trembling", image_size=size, frames=60)
    frames, here, there = map(np.array, zip(*render_phone(phone, 2), strict=True))
    film = Reel(write_video(tmp_path / "clip.mkv", frames))
    motion, doubts = camera_motion(film, *sampled(film)[::-1])
    error = np.linalg.norm(carry(motion.maps, there) - here, axis=1)
    assert not doubts
    assert np.median(error) < 0.2 * np.median(np.linalg.norm(there - here, axis=1))
    assert np.sqrt(np.mean(error**2)) < 2 * np.sqrt(2 * np.mean(motion.errors**2))


SIZE = 960, 720


def grains(seed=0):
    """A picture full of corners."""
    rng = np.random.default_rng(seed)
    soft = cv2.GaussianBlur(rng.normal(size=SIZE[::-1]), (0, 0), 2)
    grey = np.clip(128 + 40 * soft / soft.std(), 0, 255).astype(np.uint8)
    return cv2.cvtColor(grey, cv2.COLOR_GRAY2RGB)


def test_a_plane_that_is_seen_more_from_the_side_has_a_map_of_eight_numbers():
    tilt = np.array([[1, 0, -3], [0, 1, 4], [4e-6, -5e-6, 1]])
    later = cv2.warpPerspective(grains(), tilt, SIZE, flags=cv2.INTER_CUBIC)
    found = np.linalg.inv(steadied([grains(), later], 1).maps[-1])
    corners = np.array([[100, 100], [860, 100], [860, 620], [100, 620.0]])
    np.testing.assert_allclose(carry(found, corners), carry(tilt, corners), atol=0.2)


@pytest.mark.parametrize(("share", "still"), [(0.0, False), (0.2, False), (0.45, True), (1, True)])
def test_a_camera_moves_if_clearly_more_corners_share_a_motion_than_stay(share, still):
    before = grains()
    after = cv2.warpAffine(before, np.array([[1, 0, 1.8], [0, 1, 0]]), SIZE)
    stays = np.s_[:, : int(share * SIZE[0])]
    after[stays] = before[stays]
    assert stands_still([before, after]) is still


@pytest.mark.parametrize(("width", "told"), [(0.3, False), (1.0, True)])
def test_what_one_large_thing_shares_is_its_own_motion_not_the_cameras(width, told):
    # Before noise that is new in each frame: what moves is as wide as a share of the image. It must
    # fill less than a tenth of it, else it may be the wall before which the camera moves.
    def frame(place):
        picture = np.random.default_rng(place).normal(128, 3, (*SIZE[::-1], 3))
        side = (int(width * SIZE[0]), int(width * SIZE[1]))
        left, top = (SIZE[0] - side[0]) // 2, (SIZE[1] - side[1]) // 2
        moved = cv2.warpAffine(grains(), np.array([[1, 0, 2.5 * place], [0, 1, 0]]), SIZE)
        window = np.s_[top : top + side[1], left : left + side[0]]
        picture[window] = moved[window]
        return np.clip(picture, 0, 255).astype(np.uint8)

    frames = [frame(place) for place in range(4)]
    assert (stands_still(frames) is False) == told


def test_reduced_maps_become_those_of_whole_pixels():
    shift = np.array([[1, 0, 2], [0, 1, -3], [0, 0, 1.0]])
    tilt = np.array([[1, 0, 0], [0, 1, 0], [0.001, 0, 1.0]])
    maps = np.array([np.eye(3), shift, np.diag([1.2, 0.9, 1]), 2 * tilt])
    # The reduced pixels (10, 20) lie at (41.5, 81.5), in the middle of four by four.
    ends = [(10, 20), (12, 17), (12, 18), (10 / 1.01, 20 / 1.01)]
    for here, (u, v) in zip(rescaled(maps, 1 / 4), ends, strict=True):
        end = carry(here, np.array([[41.5, 81.5]]))[0]
        np.testing.assert_allclose(end, [4 * u + 1.5, 4 * v + 1.5])
        assert here[2, 2] == pytest.approx(1)


def align(before, after):
    """The map of one view to another, about which nothing is known."""
    return align_on(Look(before), Look(after), np.eye(3))


def sight(seed, here=None, noise=2.0, contrast=20, light=1.0):
    """A cloudy scene of few corners, seen through a map of its pixels to those of the view."""
    rng = np.random.default_rng(seed)
    cloud = cv2.GaussianBlur(rng.normal(size=(300, 380)).astype(np.float32), (0, 0), 12)
    scene = 130 + contrast * cloud / cloud.std()
    move = np.array([[1, 0, -30], [0, 1, -30], [0, 0, 1.0]])
    here = np.eye(3) if here is None else here
    rng = np.random.default_rng([seed, int(1e6 * abs(here).sum())])
    view = light * cv2.warpAffine(scene, (here @ move)[:2], CLOUDY, flags=cv2.INTER_LINEAR)
    view = view[..., None] + rng.normal(0, noise, (*CLOUDY[::-1], 3))
    return np.clip(view, 0, 255).astype(np.uint8)


def similar(u, v, turn=0.0, scale=1.0):
    c, s = scale * np.cos(turn), scale * np.sin(turn)
    return np.array([[c, -s, u], [s, c, v], [0, 0, 1]])


def about_the_middle(**change):
    here = similar((CLOUDY[0] - 1) / 2, (CLOUDY[1] - 1) / 2)
    return here @ similar(0, 0, **change) @ np.linalg.inv(here)


@pytest.mark.parametrize(
    ("move", "light"),
    [
        (about_the_middle(turn=0.06), 1.0),
        (about_the_middle(scale=1.05), 1.0),
        (similar(0.7, -0.4), 1.0),
        (similar(-6, 9, 0.01), 1.1),
        (similar(14, -3, -0.02, 1.01), 0.8),
    ],
)
def test_shift_turn_and_scale_of_clouds(move, light):
    found = align(sight(0), sight(0, move, light=light))
    points = np.array([[40, 40, 1], [280, 40, 1], [160, 120, 1], [280, 200, 1.0]])
    miss = np.linalg.norm((points @ (found.map - move).T)[:, :2], axis=1)
    assert miss.max() < 0.1
    assert miss.mean() <= 8 * found.error < 0.5


def test_what_moves_on_its_own_is_left_aside():
    move = similar(3, 2)
    views = [sight(1), sight(1, move)]
    for view, left in zip(views, (60, 110), strict=True):
        view[60:180, left : left + 60] = (20, 20, 160)  # a large thing that goes elsewhere
    found = align(*views)
    assert np.linalg.norm(found.map[:2, 2] - move[:2, 2]) < 0.5


@pytest.mark.parametrize("things", [0, 3])
def test_noise_and_a_few_things_tell_nothing(things):
    rng = np.random.default_rng(3)
    views = []
    for _ in range(2):
        wall = 120 + np.linspace(0, 20, CLOUDY[0])[None, :, None] + np.zeros((CLOUDY[1], 1, 3))
        for u, v in rng.integers(20, 200, (things, 2)):
            wall[v : v + 12, u : u + 12] = 40
        views.append(np.clip(wall + rng.normal(0, 3, wall.shape), 0, 255).astype(np.uint8))
    assert align(*views).error > 2
    assert things or stands_still(views) is None
    assert align(*(view[:30] for view in views)) is None  # too small to tell


def test_all_pixels_tell_of_a_motion_where_there_are_no_corners():
    move = similar(3, -4)
    views = [sight(0), sight(0, move)]
    assert stands_still(views) is False
    motion = steadied(views, 1)
    assert motion.errors[1] < 0.15
    np.testing.assert_allclose(np.linalg.inv(motion.maps[1])[:2, 2], move[:2, 2], atol=0.1)
    assert stands_still([views[0], sight(0, similar(0, 1e-6))]) is True


@pytest.mark.parametrize(
    "phone",
    [
        Phone("plain", flicker=0.03, camera="held", image_size=CLOUDY, frames=40),
        Phone("sky", noise=20, camera="trembling", frames=40),
    ],
)
def test_a_camera_held_before_a_plain_wall_is_doubted(phone, tmp_path):
    write_phone(tmp_path / "clip.mp4", phone, 3)
    found = track(tmp_path / "clip.mp4")
    assert any("too plain to tell whether the camera moves" in doubt for doubt in found.warnings)
