"""The motion of a camera from the corners of its frames: which map of them is taken."""

import cv2
import numpy as np
import pytest

from vidsindy_lite.vision.steadying import (
    _MANY,
    Steadying,
    _Relief,
    carry,
    displacement,
    stands_still,
)

SIZE = 960, 720


def grains(seed=0):
    """A picture full of corners."""
    rng = np.random.default_rng(seed)
    soft = cv2.GaussianBlur(rng.normal(size=SIZE[::-1]), (0, 0), 2)
    grey = np.clip(128 + 40 * soft / soft.std(), 0, 255).astype(np.uint8)
    return cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)


def followed(*frames):
    """The map of the first frame to the last."""
    steadying = Steadying(1)
    for frame in frames:
        steadying.add(frame)
    return np.linalg.inv(steadying.motion().maps[-1])


def test_a_plane_that_is_seen_more_from_the_side_has_a_map_of_eight_numbers():
    tilt = np.array([[1, 0, -3], [0, 1, 4], [4e-6, -5e-6, 1]])
    found = followed(grains(), cv2.warpPerspective(grains(), tilt, SIZE, flags=cv2.INTER_CUBIC))
    corners = np.array([[100, 100], [860, 100], [860, 620], [100, 620.0]])
    np.testing.assert_allclose(carry(found, corners), carry(tilt, corners), atol=0.2)


@pytest.mark.parametrize("seed", range(3))
def test_what_only_half_of_the_corners_obey_is_no_reason_for_more_than_four_numbers(seed):
    before = grains(seed)
    after = cv2.warpAffine(before, np.array([[1, 0, 1.8], [0, 1, 0]]), SIZE)
    stays = np.random.default_rng(seed).uniform(size=(12, 12)) < 0.55
    stays = cv2.resize(stays.astype(np.uint8), SIZE, interpolation=cv2.INTER_NEAREST) > 0
    after[stays] = before[stays]
    found = followed(before, after)
    (a, b, _), (c, d, _), (e, f, _) = found
    np.testing.assert_allclose((d, c, e, f), (a, -b, 0, 0), atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("share", "still"), [(0.0, False), (0.2, False), (0.45, True), (1, True)])
def test_a_camera_moves_if_clearly_more_corners_share_a_motion_than_stay(seed, share, still):
    before = grains(seed)
    after = cv2.warpAffine(before, np.array([[1, 0, 1.8], [0, 1, 0]]), SIZE)
    stays = np.s_[:, : int(share * SIZE[0])]
    after[stays] = before[stays]
    assert stands_still([before, after]) is still


@pytest.mark.parametrize(("share", "told"), [(0.1, False), (0.5, True)])
def test_what_a_few_of_the_corners_share_is_chance_and_tells_no_motion(share, told):
    rng = np.random.default_rng(0)
    before = grains()
    after = before.copy()
    for v in range(0, SIZE[1], 60):
        for u in range(0, SIZE[0], 80):
            move = [3.0, 0] if rng.uniform() < share else rng.uniform(-8, 8, 2)
            here = np.array([[1, 0, move[0]], [0, 1, move[1]]])
            moved = cv2.warpAffine(before, here, SIZE)
            after[v : v + 60, u : u + 80] = moved[v : v + 60, u : u + 80]
    steadying = Steadying(1)
    steadying.add(before)
    found, count = steadying.by_corners(_Relief.of(after))
    assert (found is not None) is told
    assert (count > 0) is told


@pytest.mark.parametrize(("width", "told"), [(0.4, False), (1.0, True)])
def test_what_one_large_thing_shares_is_its_own_motion_not_the_cameras(width, told):
    # Before noise that is new in each frame: what moves is as wide as a share of the image.
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


def test_pixels_by_which_maps_move_an_image():
    shift = np.array([[1, 0, 3], [0, 1, -4], [0, 0, 1.0]])
    found = displacement(np.stack([np.eye(3), shift, np.diag([1.1, 1, 1])]), (200, 100))
    # The rms of a tenth of 40, 100 and 160 pixels.
    np.testing.assert_allclose(found, [0, 5, np.sqrt((16 + 100 + 256) / 3)])


def test_pixels_say_it_better_than_many_corners_in_noise():
    rng = np.random.default_rng(0)
    scene = cv2.GaussianBlur(rng.normal(0, 1, (280, 360)).astype(np.float32), (0, 0), 6)
    scene = 130 + 10 * scene / scene.std()
    steadying, misses = Steadying(1), []
    for k in range(12):
        shift = np.array([1.5 * np.sin(k), 1.5 * np.cos(2 * k) - 1.5])
        move = np.array([[1, 0, shift[0] - 20], [0, 1, shift[1] - 20]])
        view = cv2.warpAffine(scene, move, (320, 240))[..., None]
        noisy = view + rng.normal(0, 6, (240, 320, 3))
        steadying.add(np.clip(noisy, 0, 255).astype(np.uint8))
        here = carry(steadying.maps[-1], np.array([[160.0, 120]]))
        misses.append(np.linalg.norm(here + shift - [160, 120]))
    assert (
        steadying.by_corners(_Relief.of(np.clip(noisy, 0, 255).astype(np.uint8))).agreeing >= _MANY
    )
    assert np.median(misses) < 0.05
