"""A camera that trembles before ground without corners."""

import numpy as np
import pytest
from footage import Phone, render_phone, write_phone

from vidsindy_lite import track, write_video
from vidsindy_lite.vision import camera as trembling_module
from vidsindy_lite.vision.background import sample_frames
from vidsindy_lite.vision.camera import trembling
from vidsindy_lite.vision.steadying import carry
from vidsindy_lite.vision.video import Reel, reduce

SKY = Phone("sky", 40, noise=3, image_size=(320, 240), frames=60)


def film(folder, seed, **change):
    """The film, the target in the first frame's pixels and in each one's own."""
    phone = Phone(**(vars(SKY) | change))
    frames, here, there = zip(*render_phone(phone, seed), strict=True)
    path = write_video(folder / "clip.mkv", iter(frames))
    return path, np.array(here), np.array(there)


def found(path):
    return trembling(Reel(path), sample_frames(Reel(path)))


@pytest.mark.parametrize("seed", [1, 2])
def test_all_frames_together_tell_how_a_camera_trembles_before_a_sky(tmp_path, seed):
    path, here, there = film(tmp_path, seed, camera="trembling")
    motion = found(path)
    known = np.isfinite(motion.errors)
    assert known.mean() > 0.9
    moved = np.linalg.norm(there - here, axis=1)
    error = np.linalg.norm(carry(motion.maps, there) - here, axis=1)[known]
    assert np.median(error) < min(0.4, 0.4 * np.median(moved))
    np.testing.assert_allclose(motion.maps[0], np.eye(3), atol=1e-9)
    assert motion.errors[0] == 0


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("change", [{}, {"size": 90}, {"person": True, "leaves": True}])
def test_nothing_else_is_taken_for_a_motion_of_the_camera(tmp_path, monkeypatch, seed, change):
    path, *_ = film(tmp_path, seed, **change)
    assert found(path) is None

    def with_room(*given):
        alike, error = halves(*given)
        return alike + 0.1, error

    halves = trembling_module._halves
    monkeypatch.setattr(trembling_module, "_halves", with_room)
    assert found(path) is None


@pytest.mark.parametrize("background", ["plain", "sky"])
def test_what_is_too_plain_or_moves_too_far_is_not_told(tmp_path, background):
    assert found(film(tmp_path, 1, background=background, camera="held")[0]) is None


def test_maps_are_those_of_whole_frames(tmp_path):
    path, here, there = film(tmp_path, 1, camera="trembling", image_size=(640, 480))
    samples = np.array([reduce(sample, 2) for sample in sample_frames(Reel(path))])
    motion = trembling(Reel(path, 160), samples)
    error = np.linalg.norm(carry(motion.maps, there) - here, axis=1)
    assert np.median(error[np.isfinite(motion.errors)]) < 0.5


@pytest.mark.parametrize("seed", [1, 4])
def test_a_ball_before_a_sky_is_tracked_with_a_camera_that_trembles(tmp_path, seed):
    phone = Phone("sky", 40, noise=3.6, camera="trembling", bitrate=2_000_000, frames=60)
    here, there = write_phone(tmp_path / "clip.mp4", phone, seed)
    result = track(tmp_path / "clip.mp4")
    error = np.linalg.norm(result.pixels - here, axis=1)
    assert np.isfinite(error).all()
    assert np.nanmedian(error) < 0.4
    assert np.median(np.linalg.norm(there - here, axis=1)) > 0.9
    assert result.warnings == ()


def test_errors_are_as_large_as_they_are_told(tmp_path):
    ratios = []
    for seed in range(1, 7):
        phone = Phone(**(vars(SKY) | {"camera": "trembling", "bitrate": 2_000_000}))
        here, there = write_phone(tmp_path / "clip.mp4", phone, seed)
        motion = found(tmp_path / "clip.mp4")
        if motion is None:
            continue
        known = np.isfinite(motion.errors) & (motion.errors > 0)
        error = (carry(motion.maps, there) - here)[known]
        ratios.append(np.sqrt((error**2).mean() / (motion.errors[known] ** 2).mean()))
    print(ratios)
    assert len(ratios) >= 4
    assert 0.6 < np.exp(np.mean(np.log(ratios))) < 1.1
