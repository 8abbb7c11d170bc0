"""Frames of two instants: one of them is shown, whichever it is for all frames alike."""

import av
import numpy as np
import pytest
from phones import write_at

import vidsindy_lite as vl
from vidsindy_lite.vision.rendering import Scene, render
from vidsindy_lite.vision.video import with_lines_between

SIZE = (160, 120)
INTERLACED = {"x264-params": "interlaced=1:tff=1", "crf": "6"}


def film(path, track, **options):
    """A film with two views a frame: the upper lines of one, the lower of the next."""
    views = list(render(track, Scene("plain", size=14, image_size=SIZE)))
    frames = [view.copy() for view in views[::2]]
    for frame, later in zip(frames, views[1::2], strict=True):
        frame[1::2] = later[1::2]
    # With colours of every line: an ordinary converter would mix those of two instants.
    return write_at(path, np.arange(len(frames)) / 25, frames, "libx264", "yuv422p", **options)


def test_the_target_is_where_it_was_at_one_instant(tmp_path):
    along = np.linspace(0, 2 * np.pi, 120)
    track = np.column_stack((80 + 45 * np.cos(along), 60 + 35 * np.sin(2 * along)))
    found = vl.track(film(tmp_path / "a.mp4", track, **INTERLACED)).pixels
    seen = np.isfinite(found).all(axis=1)
    assert seen.mean() > 0.7
    assert np.sqrt(np.mean((found - track[::2])[seen] ** 2)) < 0.2
    # The same lines in a file that does not say so are half a frame late.
    mixed = vl.track(film(tmp_path / "b.mp4", track, crf="6")).pixels
    assert np.nanmedian(np.abs(mixed - track[::2])) > np.nanmedian(np.abs(found - track[::2]))


def test_every_reader_sees_the_same(tmp_path):
    track = np.linspace([30, 30], [120, 90], 40)
    path = film(tmp_path / "a.mp4", track, **INTERLACED)
    with av.open(str(path)) as container:
        assert all(frame.interlaced_frame for frame in container.decode(video=0))
    frames = list(vl.read_video(path))
    assert frames[0].shape == (120, 160, 3)
    for number in (0, 7, 19):
        assert np.array_equal(vl.read_frame(path, number), frames[number])


@pytest.mark.parametrize("lines", [1, 2, 5])
def test_a_ramp_stays_a_ramp(lines):
    field = np.arange(0, 20 * lines, 20, np.uint8)[:, None, None] * np.ones((1, 4, 3), np.uint8)
    full = with_lines_between(field)
    assert full.shape == (2 * lines, 4, 3)
    assert full[:, 0, 0].tolist() == [*range(0, 20 * lines - 19, 10), 20 * (lines - 1)]
