"""Where a target is in frames that show only a part of it."""

import cv2
import numpy as np
import pytest

from vidsindy_lite import Hint, track, write_video

N = 60
TRUTH = np.column_stack([30 + 4.4 * np.arange(N), 110 - 25 * np.sin(np.arange(N) / 15)])
HINT = Hint(frame=10, box=(*(TRUTH[10] - 12), 25, 25))


def film(path, post, wall):
    """A red ball that flies behind a post, or before a wall of its colour, past other things."""
    rng = np.random.default_rng(0)
    ground = cv2.GaussianBlur(rng.uniform(0, 255, (200, 320, 3)).astype(np.float32), (0, 0), 4)
    ground = 60 + ground / 2
    if wall:
        ground[:, 150:162] = (30, 30, 210)

    def frames():
        for i in range(N):
            frame = ground.copy()
            cv2.circle(frame, tuple(np.rint(16 * TRUTH[i]).astype(int)), 16 * 11, (30, 30, 210),
                       -1, cv2.LINE_AA, 4)  # fmt: skip
            frame[:, 150 : 150 + post] = (60, 80, 90)
            noise = rng.normal(0, 3, frame.shape)
            yield np.clip((1 + 0.1 * np.sin(i)) * frame + noise, 0, 255).astype(np.uint8)

    return write_video(path, frames())


@pytest.mark.parametrize(("post", "wall"), [(14, False), (0, True)], ids=["post", "wall"])
def test_what_is_seen_in_part_is_where_its_motion_leads(tmp_path, post, wall):
    path = film(tmp_path / "clip.mov", post, wall)
    error, hinted = (
        np.linalg.norm(track(path, target=hint).pixels - TRUTH, axis=1) for hint in (None, HINT)
    )
    for found in (error, hinted):
        assert np.isfinite(found).mean() >= 0.95
        assert np.nanmax(found) < 1
    assert np.isfinite(hinted[np.isfinite(error)]).all()


def test_what_is_hidden_altogether_stays_a_gap(tmp_path):
    path = film(tmp_path / "clip.mov", 60, False)
    error = np.linalg.norm(track(path, target=HINT).pixels - TRUTH, axis=1)
    hidden = (TRUTH[:, 0] > 150 + 13) & (TRUTH[:, 0] < 210 - 13)
    assert hidden.sum() > 5
    assert np.isnan(error[hidden]).all()
    assert np.nanmax(error) < 3
