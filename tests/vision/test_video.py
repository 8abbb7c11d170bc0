"""Video files by round trip, against OpenCV's reader, and where something is wrong with them."""

import os
import resource
import struct
import subprocess
import sys
import wave
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from vidsindy_lite.vision import video
from vidsindy_lite.vision.rendering import Scene, render, render_video
from vidsindy_lite.vision.video import (
    pick_frames,
    read_frame,
    read_video,
    video_info,
    write_video,
)

SMALL = (96, 80)


@pytest.mark.parametrize(
    ("name", "codec"), [("clip.mov", None), ("clip.mkv", None), ("clip.avi", "FFV1")]
)
@pytest.mark.parametrize("size", [SMALL, (128, 96), (101, 67), (1, 1)])
def test_lossless_files_are_exact(tmp_path, name, codec, size):
    rng = np.random.default_rng(0)
    frames = [rng.integers(0, 256, (size[1], size[0], 3), np.uint8) for _ in range(5)]
    path = write_video(tmp_path / name, frames, fps=30, codec=codec)
    back = list(read_video(path))
    assert len(back) == 5
    assert all(np.array_equal(a, b) for a, b in zip(frames, back, strict=True))
    assert video_info(path) == (5, pytest.approx(30), size)


@pytest.mark.parametrize(
    ("name", "codec"), [("a.mp4", "mp4v"), ("a.avi", "MJPG"), ("a.mp4", "H264")]
)
def test_lossy_files_are_close(tmp_path, name, codec):
    frames = list(render(np.full((4, 2), 45.0), Scene("sky", image_size=SMALL)))
    back = list(read_video(write_video(tmp_path / name, frames, codec=codec)))
    assert len(back) == 4
    assert 0 < np.abs(np.array(back, float) - np.array(frames, float)).mean() < 6


@pytest.mark.parametrize("fps", [25, 1 / 3, 66.67, 29.97, 0.01, 1e4])
def test_frame_rate_is_kept(tmp_path, fps):
    path = write_video(tmp_path / "clip.mov", [np.zeros((64, 64, 3), np.uint8)] * 3, fps)
    assert video_info(path).fps == pytest.approx(fps, rel=1e-4)


def test_files_of_still_backgrounds_are_small_and_all_alike(tmp_path):
    scene, track = Scene("hills", size=12), np.linspace([100, 100], [200, 180], 120)
    paths = [render_video(tmp_path / name, track, scene) for name in ("a.mov", "b.mov", "c.mkv")]
    first, again, other = (path.read_bytes() for path in paths)
    assert first == again
    assert len(first) < 0.1 * len(other)


@pytest.mark.parametrize("suffix", [".mov", ".mkv"])
def test_one_frame_is_that_of_all(tmp_path, suffix):
    frames = list(render(np.linspace([20, 20], [70, 60], 120), Scene(image_size=SMALL)))
    path = write_video(tmp_path / f"clip{suffix}", frames)
    for number in (119, 0, 1, 49, 50, 51, 75):
        assert np.array_equal(read_frame(path, number), frames[number])
    with pytest.raises(ValueError, match=r"number: .* must have that frame, got 120"):
        read_frame(path, 120)
    with pytest.raises(ValueError, match="number: must be an integer of at least 0, got -1"):
        read_frame(path, -1)


@pytest.mark.parametrize("suffix", [".mov", ".mkv"])
def test_nothing_half_written_is_left(tmp_path, suffix):
    def frames():
        yield np.zeros((64, 64, 3), np.uint8)
        raise RuntimeError("interrupted")

    with pytest.raises(RuntimeError, match="interrupted"):
        write_video(tmp_path / f"clip{suffix}", frames())
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_keeps_the_old_file(tmp_path):
    path = write_video(tmp_path / "clip.mkv", [np.full((64, 64, 3), 7, np.uint8)])
    with pytest.raises(ValueError, match="at least one frame"):
        write_video(path, [])
    assert next(read_video(path)).mean() == 7


@pytest.mark.parametrize(
    ("name", "options", "error", "message"),
    [
        ("clip.txt", {}, ValueError, "path: must end in .mov or .mkv"),
        ("clip.mkv", {"codec": "XVID"}, ValueError, "codec: must be one of"),
        ("clip.mkv", {"codec": "mp4v"}, ValueError, "path: must end in .mp4"),
        ("clip.mkv", {"fps": 0}, ValueError, r"fps: must be in \[0.01, 1000\] for .mkv, got 0"),
        ("clip.mov", {"fps": 1e300}, ValueError, r"fps: must be in .* for .mov, got 1e\+300"),
        ("clip.mov", {"fps": np.nan}, ValueError, "fps: must be a finite number, got nan"),
        ("none/clip.mkv", {}, FileNotFoundError, "path: the folder must exist"),
    ],
)
def test_write_video_rejects(tmp_path, name, options, error, message):
    with pytest.raises(error, match=message):
        write_video(tmp_path / name, [np.zeros((64, 64, 3), np.uint8)], **options)


@pytest.mark.parametrize(
    "frame", [np.zeros((64, 64, 3)), np.zeros((64, 64), np.uint8), np.zeros((64, 80, 3), np.uint8)]
)
def test_write_video_rejects_frames(tmp_path, frame):
    with pytest.raises(ValueError, match="^frames: .* at frame 1"):
        write_video(tmp_path / "clip.mkv", [np.zeros((64, 64, 3), np.uint8), frame])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("read", [read_video, video_info])
def test_reading_rejects(tmp_path, read):
    with pytest.raises(FileNotFoundError, match="path: no such video file"):
        read(tmp_path / "missing.mkv")
    empty = tmp_path / "empty.mkv"
    empty.touch()
    with pytest.raises(ValueError, match="got the empty file"):
        read(empty)
    text = tmp_path / "text.mkv"
    text.write_text("this is no video\n" * 100)
    with pytest.raises(ValueError, match="path: must be a video file that PyAV can read"):
        read(text)
    headers = tmp_path / "headers.avi"
    writer = cv2.VideoWriter(
        str(headers), cv2.CAP_FFMPEG, cv2.VideoWriter_fourcc(*"MJPG"), 25, (64, 64)
    )
    writer.release()
    with pytest.raises(ValueError, match=f"path: must .* '{headers}'"):
        read(headers)


def test_what_is_no_scene_path_or_frames_is_named(tmp_path):
    with pytest.raises(ValueError, match="scene: must be of type Scene, got 'hills'"):
        render([[40, 40]], "hills")
    with pytest.raises(ValueError, match="path: must be the name of a file, got None"):
        write_video(None, [])
    with pytest.raises(ValueError, match="frames: must be of type Iterable, got None"):
        write_video(tmp_path / "clip.mkv", None)
    for read in (read_video, video_info):
        with pytest.raises(ValueError, match="path: must be the name of a file, got 5"):
            read(5)


def test_frames_are_counted_where_the_header_states_no_number(tmp_path):
    rng = np.random.default_rng(0)
    path, cut = tmp_path / "clip.mkv", tmp_path / "cut.mkv"
    fourcc = cv2.VideoWriter_fourcc(*"FFV1")
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, fourcc, 25, SMALL)
    for _ in range(200):
        writer.write(rng.integers(0, 256, (*SMALL[::-1], 3), np.uint8))
    cut.write_bytes(path.read_bytes())  # before the length is written into the header
    writer.release()
    assert video_info(path).frames == 200
    assert 0 < video_info(cut).frames < 200
    assert video_info(cut).frames == len(list(read_video(cut)))


@pytest.mark.parametrize("seconds", [0.5, 3.0])
def test_frames_of_a_file_with_sound_are_not_those_of_the_sound(tmp_path, seconds):
    path = tmp_path / "clip.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", 25)
        stream.width, stream.height = SMALL
        stream.pix_fmt = "bgr0"
        sound = container.add_stream("pcm_s16le", rate=8000, layout="mono")
        for frame in drawn(30):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, "rgb24")))
        container.mux(stream.encode(None))
        silence = np.zeros((1, int(8000 * seconds)), np.int16)
        heard = av.AudioFrame.from_ndarray(silence, "s16", "mono")
        heard.sample_rate = 8000
        container.mux(sound.encode(heard))
        container.mux(sound.encode(None))
    assert video_info(path) == (30, 25, SMALL)
    assert len(list(read_video(path))) == 30


def test_frames_of_changing_duration_are_counted_and_those_that_are_cut_off(tmp_path):
    times = np.cumsum(np.random.default_rng(0).integers(5, 60, 50))
    path = write_at(tmp_path / "clip.mkv", times, drawn(50))
    assert video_info(path).frames == 50
    path = write_video(tmp_path / "clip.mkv", drawn(50))
    path.write_bytes(path.read_bytes()[:-1000])
    assert video_info(path).frames == 50 > len(list(read_video(path)))


def test_broken_files_print_nothing(tmp_path, capfd):
    whole = write_video(tmp_path / "clip.mkv", [np.zeros((64, 64, 3), np.uint8)] * 50)
    cut, text = tmp_path / "cut.mkv", tmp_path / "text.mkv"
    cut.write_bytes(whole.read_bytes()[:-3000])
    text.write_text("this is no video\n" * 100)
    assert 0 < len(list(read_video(cut))) < 50
    with pytest.raises(ValueError, match="path: must be a video file"):
        read_video(text)
    assert capfd.readouterr().err == ""


# ------------------------------------------------------------------------ against OpenCV's reader


def drawn(n=30, **options):
    scene = Scene("hills", image_size=SMALL, **options)
    return list(render(np.linspace([20, 20], [70, 60], n), scene))


def read_by_opencv(path):
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    try:
        while (more := capture.read())[0]:
            yield cv2.cvtColor(more[1], cv2.COLOR_BGR2RGB)
    finally:
        capture.release()


ALL = [
    ("a.mov", None),
    ("a.mkv", None),
    ("a.avi", "FFV1"),
    ("a.mp4", "mp4v"),
    ("a.avi", "MJPG"),
    ("a.mkv", "MJPG"),
    ("a.mp4", "H264"),
]


@pytest.mark.parametrize(("name", "codec"), ALL)
def test_another_reader_sees_the_same_frames(tmp_path, name, codec):
    path = write_video(tmp_path / name, drawn(), 30, codec)
    pairs = zip(read_video(path), read_by_opencv(path), strict=True)
    assert all(np.array_equal(ours, theirs) for ours, theirs in pairs)
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    assert video_info(path).frames == capture.get(cv2.CAP_PROP_FRAME_COUNT) == 30
    assert video_info(path).fps == pytest.approx(capture.get(cv2.CAP_PROP_FPS), rel=1e-9)
    capture.release()


@pytest.mark.parametrize(("name", "codec"), [("a.mp4", "mp4v"), ("a.avi", "MJPG")])
def test_lossy_files_are_as_lossy_as_those_of_opencv(tmp_path, name, codec):
    frames = drawn()
    fourcc = cv2.VideoWriter_fourcc(*codec)
    writer = cv2.VideoWriter(str(tmp_path / name), cv2.CAP_FFMPEG, fourcc, 25, SMALL)
    for frame in frames:
        writer.write(cv2.cvtColor(frame, cv2.COLOR_RGB2BGR))
    writer.release()
    ours = write_video(tmp_path / f"ours_{name}", frames, codec=codec)
    assert ours.stat().st_size == pytest.approx((tmp_path / name).stat().st_size, rel=0.1)
    loss = [
        np.abs(np.array(list(read_video(path)), float) - frames).mean()
        for path in (ours, tmp_path / name)
    ]
    assert loss[0] == pytest.approx(loss[1], rel=0.1)


@pytest.mark.parametrize("name", ["a.mov", "a.mkv"])
def test_frames_belong_to_who_draws_on_them(tmp_path, name):
    """One array that is drawn anew for each frame is written, and what is read may be drawn on."""
    frames = drawn(6)

    def in_one_array():
        canvas = np.empty_like(frames[0])
        for frame in frames:
            canvas[:] = frame
            yield canvas

    read = []
    for frame in read_video(write_video(tmp_path / name, in_one_array())):
        read.append(frame.copy())
        frame[:] = 7
    np.testing.assert_array_equal(read, frames)


def hold_upright(path, quarters):
    """Let a .mov file say that the camera was turned by so many quarters, as phones do."""
    data = bytearray(path.read_bytes())
    matrix = data.index(b"tkhd") + 4 + 40
    c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][quarters]
    for place, value in ((0, c), (1, s), (3, -s), (4, c)):
        data[matrix + 4 * place : matrix + 4 * place + 4] = struct.pack(">i", value << 16)
    path.write_bytes(data)


@pytest.mark.parametrize("quarters", range(4))
def test_the_view_of_a_turned_camera_is_upright(tmp_path, quarters):
    frames = drawn(3)
    path = write_video(tmp_path / "clip.mov", frames)
    hold_upright(path, quarters)
    upright = [np.rot90(frame, -quarters) for frame in frames]
    for ours, theirs, true in zip(read_video(path), read_by_opencv(path), upright, strict=True):
        assert np.array_equal(ours, true)
        assert np.array_equal(ours, theirs)
    assert np.array_equal(read_frame(path, 2), upright[2])
    assert video_info(path).size == upright[0].shape[1::-1]


# ------------------------------------------------------------------------------- times and numbers


def write_at(path, times, frames, codec="ffv1", pixels="bgr0", b_frames=0):
    """A file whose frames are shown at these times, in milliseconds."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, 1000)
        stream.width, stream.height = SMALL
        stream.pix_fmt = pixels
        stream.codec_context.max_b_frames = b_frames
        stream.codec_context.gop_size = 8
        for time, frame in zip(times, frames, strict=True):
            picture = av.VideoFrame.from_ndarray(frame, "rgb24")
            picture.pts = int(time)
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    return path


@pytest.mark.parametrize(
    ("name", "codec", "pixels", "b_frames"),
    [
        ("a.mkv", "ffv1", "bgr0", 0),
        ("a.mp4", "mpeg4", "yuv420p", 2),
        ("b.avi", "mpeg4", "yuv420p", 2),  # keeps no times
        ("b.mp4", "libx264", "yuv420p", 3),
    ],
)
def test_one_frame_is_that_of_all_whatever_the_times(tmp_path, name, codec, pixels, b_frames):
    step = np.random.default_rng(0).integers(5, 60, 60)
    times = np.cumsum(step) if name != "b.avi" else np.arange(60)
    path = write_at(tmp_path / name, times, drawn(60), codec, pixels, b_frames)
    frames = list(read_video(path))
    assert len(frames) >= 58
    for number in (0, 1, 7, 8, 9, 31, len(frames) - 1):
        assert np.array_equal(read_frame(path, number), frames[number])
    numbers = [0, 3, 4, 20, 21, 50]
    picked = list(pick_frames(path, numbers))
    assert all(np.array_equal(one, frames[k]) for one, k in zip(picked, numbers, strict=True))


def test_frames_that_no_other_needs_are_not_decoded_on_the_way(tmp_path, monkeypatch):
    path = write_at(tmp_path / "a.mp4", np.arange(24), drawn(24), "mpeg4", "yuv420p", 2)
    decoded = []
    decode = video._decoded
    monkeypatch.setattr(
        video, "_decoded", lambda *args: (decoded.append(f) or f for f in decode(*args))
    )
    assert len(list(pick_frames(path, [0, 7]))) == 2
    assert len(decoded) < 7


def test_no_file_has_so_many_frames(tmp_path):
    path = write_video(tmp_path / "clip.mov", drawn(3))
    for number in (3, 10**6, 2**63, 10**30):
        with pytest.raises(ValueError, match=rf"number: .*must .*, got {number}"):
            read_frame(path, number)


@pytest.mark.parametrize(("name", "codec"), ALL)
@pytest.mark.parametrize(
    "fps", [25, np.int64(24), np.float32(59.94), np.float64(1 / 3), Fraction(30000, 1001), 999.9]
)
def test_every_file_keeps_the_frame_rate(tmp_path, name, codec, fps):
    path = write_video(tmp_path / name, [np.zeros((64, 64, 3), np.uint8)] * 4, fps, codec)
    assert video_info(path).fps == pytest.approx(float(fps), rel=1e-4)
    assert video_info(path).frames == 4


def test_a_rate_that_mkv_cannot_hold_is_refused(tmp_path):
    frames = [np.zeros((64, 64, 3), np.uint8)] * 4
    with pytest.raises(ValueError, match=r"fps: must be in \[0.01, 1000\] for .mkv, got 1001"):
        write_video(tmp_path / "clip.mkv", frames, 1001)
    assert len(list(read_video(write_video(tmp_path / "clip.mkv", frames, 1000)))) == 4


# ------------------------------------------------------------------------------------- broken files


@pytest.mark.parametrize(("name", "codec"), ALL)
def test_a_file_that_is_cut_off_ends_there(tmp_path, name, codec):
    path = write_video(tmp_path / name, drawn(), codec=codec)
    data, whole = path.read_bytes(), list(read_video(path))
    for share in (0.02, 0.3, 0.6, 0.9, 0.999):
        path.write_bytes(data[: int(share * len(data))])
        try:
            read = list(read_video(path))
        except ValueError:
            continue
        assert len(read) <= 30
        assert all(np.array_equal(one, other) for one, other in zip(read[:-1], whole))  # noqa: B905


@pytest.mark.parametrize(("name", "codec"), ALL)
def test_damage_ends_a_file_or_is_refused(tmp_path, name, codec):
    path = write_video(tmp_path / name, drawn(), codec=codec)
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 500] = np.random.default_rng(0).bytes(500)
    path.write_bytes(data)
    try:
        count = len(list(read_video(path)))
    except ValueError:
        return
    assert 0 < count <= 30


def test_sound_is_no_video(tmp_path):
    with wave.open(str(tmp_path / "sound.wav"), "wb") as sound:
        sound.setparams((1, 2, 8000, 0, "NONE", ""))
        sound.writeframes(bytes(8000))
    for read in (read_video, video_info):
        with pytest.raises(ValueError, match="path: must be a video file, got .* holds none"):
            read(tmp_path / "sound.wav")


def test_a_name_with_a_colon_is_no_protocol(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    frames = drawn(2)
    write_video("12:30.mov", frames)
    assert all(np.array_equal(a, b) for a, b in zip(frames, read_video("12:30.mov"), strict=True))


def test_frames_may_be_views_of_others(tmp_path):
    frames = [frame[::-1, 3::2, ::-1] for frame in drawn(3)]
    back = list(read_video(write_video(tmp_path / "clip.mov", frames)))
    assert np.array_equal(back, frames)


# ------------------------------------------------------------------------------ a disk that is full


@pytest.fixture
def largest_file():
    """Sets the size from which on no file can grow, as on a disk that is full."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize(("name", "codec"), ALL)
@pytest.mark.parametrize("left", [0.3, 0.99])
def test_a_full_disk_is_an_error(tmp_path, largest_file, name, codec, left):
    frames = list(np.random.default_rng(0).integers(0, 256, (20, 64, 64, 3), np.uint8))
    size = write_video(tmp_path / f"whole_{name}", frames, codec=codec).stat().st_size
    largest_file(int(left * size))
    with pytest.raises(OSError, match="path: cannot write .* to '.*'"):
        write_video(tmp_path / name, frames, codec=codec)
    assert [p.name for p in tmp_path.iterdir()] == [f"whole_{name}"]


def test_frames_that_a_writer_loses_in_silence_are_an_error(tmp_path, monkeypatch):
    class Silent:
        def __init__(self, stream):
            self.stream, self.count = stream, 0

        def encode(self, frame):
            self.count += 1
            return self.stream.encode(frame) if self.count != 5 else []

    add = video._add_stream
    monkeypatch.setattr(video, "_add_stream", lambda *args: Silent(add(*args)))
    with pytest.raises(OSError, match="cannot write 10 frames to .*, only 9 are in the file"):
        write_video(tmp_path / "clip.mov", drawn(10))
    assert list(tmp_path.iterdir()) == []


# -------------------------------------------------------------------------- what is open, imported


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="counts open files in /proc")
def test_no_file_stays_open(tmp_path):
    path = write_video(tmp_path / "clip.mov", drawn(5))
    text = tmp_path / "text.mkv"
    text.write_text("this is no video\n" * 100)
    count = len(os.listdir("/proc/self/fd"))
    kept = [video_info(path), read_video(path), read_frame(path, 3), list(read_video(path))]
    begun = read_video(path)
    kept.append(next(begun))
    begun.close()
    for read in (read_video, video_info):
        with pytest.raises(ValueError, match="path") as caught:
            read(text)
        kept.append(caught)
    assert len(os.listdir("/proc/self/fd")) == count


def test_import_sets_no_variable_and_loads_no_heavy_library():
    code = (
        "import os, sys; import cv2; before = dict(os.environ); import vidsindy_lite; "
        "assert dict(os.environ) == before; "
        "print([name for name in ('av', 'torch') if name in sys.modules])"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout == "[]\n"
