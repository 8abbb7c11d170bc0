"""Video files and films of images: by round trip, against OpenCV's reader, and what is wrong."""

import os
import re
import resource
import struct
import subprocess
import sys
import wave
import weakref
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from phones import waver, write_at

import vidsindy_lite as vl
from vidsindy_lite.vision import read_frame, read_video, render, video, video_info, write_video

SMALL = (96, 80)


def test_files_of_still_backgrounds_are_small_and_all_alike(tmp_path):
    scene, track = vl.Scene("hills", size=12), np.linspace([100, 100], [200, 180], 60)
    paths = [vl.render_video(tmp_path / name, track, scene) for name in ("a.mov", "b.mov", "c.mkv")]
    first, again, other = (path.read_bytes() for path in paths)
    assert first == again
    assert len(first) < 0.15 * len(other)


@pytest.mark.parametrize(
    ("name", "codec"), [("clip.mov", None), ("clip.mkv", None), ("clip.avi", "FFV1")]
)
@pytest.mark.parametrize("size", [(101, 67), (1, 1)])
def test_lossless_files_are_exact_though_frames_share_an_array(tmp_path, name, codec, size):
    frames = np.random.default_rng(0).integers(0, 256, (5, size[1], size[0], 3), np.uint8)

    def in_one_array():
        canvas = np.empty_like(frames[0])
        for frame in frames:
            canvas[:] = frame
            yield canvas

    path, read = write_video(tmp_path / name, in_one_array(), fps=30, codec=codec), []
    for frame in read_video(path):
        read.append(frame.copy())
        frame[:] = 7  # it belongs to who draws on it
    np.testing.assert_array_equal(read, frames)
    assert video_info(path) == (5, pytest.approx(30), size)


@pytest.mark.parametrize("suffix", [".mov", ".mkv"])
def test_nothing_half_written_is_left(tmp_path, suffix):
    def frames():
        yield np.zeros((64, 64, 3), np.uint8)
        raise RuntimeError("interrupted")

    path = tmp_path / "new" / f"clip{suffix}"  # the folder is made
    with pytest.raises(RuntimeError, match="interrupted"):
        write_video(path, frames())
    assert list(path.parent.iterdir()) == []
    write_video(path, [np.full((64, 64, 3), 7, np.uint8)])
    with pytest.raises(ValueError, match="at least one frame"):
        write_video(path, [])
    assert next(read_video(path)).mean() == 7


@pytest.mark.parametrize(
    ("name", "options", "error", "message"),
    [
        ("clip.txt", {}, ValueError, "path: must end in .mov or .mkv"),
        ("clip.mkv", {"codec": "XVID"}, ValueError, "codec: must be one of"),
        ("clip.mkv", {"codec": "mp4v"}, ValueError, "path: must end in .mp4"),
        ("clip.mkv", {"fps": 1001}, ValueError, r"fps: must be in \[0.01, 1000\] for .mkv, got 1"),
        ("clip.mov", {"fps": 0}, ValueError, r"fps: must be in \[0.01, 10000\] for .mov, got 0"),
        ("clip.mov", {"fps": 1e300}, ValueError, r"fps: must be in .* for .mov, got 1e\+300"),
        ("clip.mov", {"fps": np.nan}, ValueError, "fps: must be a finite number, got nan"),
    ],
)
def test_write_video_rejects(tmp_path, name, options, error, message):
    with pytest.raises(error, match=message):
        write_video(tmp_path / name, [np.zeros((64, 64, 3), np.uint8)], **options)


@pytest.mark.parametrize(
    "frame", [np.zeros((64, 64, 3)), np.zeros((64, 64), np.uint8), np.zeros((64, 80, 3), np.uint8)]
)
def test_write_video_rejects_frames(tmp_path, frame):
    with pytest.raises(ValueError, match="frames: must be of type Iterable, got None"):
        write_video(tmp_path / "clip.mkv", None)
    with pytest.raises(ValueError, match="^frames: .* at frame 1"):
        write_video(tmp_path / "clip.mkv", [np.zeros((64, 64, 3), np.uint8), frame])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("read", [read_video, video_info, vl.track])
def test_reading_rejects(tmp_path, capfd, read):
    with pytest.raises(ValueError, match="path: must be the name of a file, got 5"):
        read(5)
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
    fourcc = cv2.VideoWriter_fourcc(*"MJPG")
    cv2.VideoWriter(str(headers), cv2.CAP_FFMPEG, fourcc, 25, (64, 64)).release()
    with pytest.raises(ValueError, match=f"path: must .* '{headers}'"):
        read(headers)
    with wave.open(str(tmp_path / "sound.wav"), "wb") as sound:
        sound.setparams((1, 2, 8000, 0, "NONE", ""))
        sound.writeframes(bytes(8000))
    with pytest.raises(ValueError, match="path: must be a video file, got .* holds none"):
        read(tmp_path / "sound.wav")
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("name", "codec", "pixels", "sound"),
    [
        ("a.avi", "mjpeg", "yuvj420p", 0),
        ("a.mkv", "ffv1", "bgr0", 267),
        ("b.mkv", "ffv1", "bgr0", 800),  # three times as long
    ],
)
def test_half_a_file_is_told_and_frames_are_not_those_of_the_sound(
    tmp_path, name, codec, pixels, sound
):
    path = tmp_path / name
    with av.open(str(path), "w") as out:
        stream = out.add_stream(codec, rate=30)
        stream.width, stream.height, stream.pix_fmt = 80, 60, pixels
        voice = out.add_stream("pcm_s16le", rate=8000, layout="mono") if sound else None
        noise = np.random.default_rng(0).integers(0, 99, (60, 80, 3), np.uint8)
        for k in range(60):
            image = noise.copy()
            image[20:30, 5 + k : 15 + k] = 230
            out.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
            if voice:
                heard = av.AudioFrame.from_ndarray(np.zeros((1, sound), np.int16), "s16", "mono")
                heard.sample_rate, heard.pts = 8000, sound * k
                out.mux(voice.encode(heard))
        out.mux(stream.encode())
    whole = path.read_bytes()
    assert video_info(path) == (60, 30, (80, 60))
    assert len(list(read_video(path))) == 60
    path.write_bytes(whole[: len(whole) // 2])
    assert video_info(path).frames == pytest.approx(60, abs=1) or sound == 800
    told = vl.track(path).warnings
    assert any("frames can be read: it is cut off" in warning for warning in told)
    with pytest.raises(ValueError, match="target: its frame must be one of .*, got 55"):
        vl.track(path, target=vl.Hint(frame=55, box=(55, 15, 20, 20)))


def drawn(n=30, **options):
    scene = vl.Scene("hills", image_size=SMALL, **options)
    return list(render(np.linspace([20, 20], [70, 60], n), scene))


def read_by_opencv(path):
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    try:
        while (more := capture.read())[0]:
            yield cv2.cvtColor(more[1], cv2.COLOR_BGR2RGB)
    finally:
        capture.release()


ALL = [
    ("a.mov", None), ("a.mkv", None), ("a.avi", "FFV1"), ("a.mp4", "mp4v"), ("a.avi", "MJPG"),
    ("a.mkv", "MJPG"), ("a.mp4", "H264"), ("a.webm", "VP9"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "codec"), ALL)
def test_another_reader_sees_the_same_frames_and_these_are_close(tmp_path, name, codec):
    path = write_video(tmp_path / name, drawn(), 30, codec)
    ours = np.array(list(read_video(path)))
    assert np.array_equal(ours, list(read_by_opencv(path)))
    assert np.abs(ours.astype(float) - drawn()).mean() < 6
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    assert video_info(path).frames == capture.get(cv2.CAP_PROP_FRAME_COUNT) == 30
    assert video_info(path).fps == pytest.approx(capture.get(cv2.CAP_PROP_FPS), rel=1e-9)
    capture.release()


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


@pytest.mark.parametrize(
    ("name", "codec", "pixels", "options"),
    [
        ("a.mov", None, None, {}),  # as we write it, at an even rate
        ("a.mkv", "ffv1", "bgr0", {}),
        ("b.mp4", "libx264", "yuv420p", {"bf": "3", "g": "8"}),
        ("c.ts", "libx264", "yuv420p", {"bf": "2", "g": "25"}),  # of a camcorder
    ],
)
def test_one_frame_is_that_of_all_whatever_the_times(tmp_path, name, codec, pixels, options):
    times = np.cumsum(np.random.default_rng(0).integers(5, 60, 120)) / 1000
    path, scenes = tmp_path / name, drawn(120)
    if codec is None:
        write_video(path, scenes)
    else:
        write_at(path, times, scenes, codec, pixels, **options)
    frames = list(read_video(path))
    assert 118 <= len(frames) == video_info(path).frames
    for number in (len(frames) - 1, 0, 1, 7, 8, 9, 31, 49, 50, 51, 75):
        assert np.array_equal(read_frame(path, number), frames[number])
    numbers = [0, 3, 4, 20, 21, 50]
    picked = list(video.pick_frames(path, numbers))
    assert all(np.array_equal(one, frames[k]) for one, k in zip(picked, numbers, strict=True))
    for number in (len(frames), 2**63, 10**30):
        with pytest.raises(ValueError, match=rf"number: .*must .*, got {number}"):
            read_frame(path, number)
    with pytest.raises(ValueError, match="number: must be an integer of at least 0, got -1"):
        read_frame(path, -1)


@pytest.mark.parametrize(("name", "codec"), ALL)
def test_a_file_that_is_cut_off_or_damaged_ends_there_or_is_refused(tmp_path, name, codec):
    path = write_video(tmp_path / name, drawn(), codec=codec)
    data, whole = path.read_bytes(), list(read_video(path))
    for share in (0.02, 0.6, 0.999):
        path.write_bytes(data[: int(share * len(data))])
        try:
            read = list(read_video(path))
        except ValueError:
            continue
        assert len(read) <= 30
        assert all(np.array_equal(one, other) for one, other in zip(read[:-1], whole))  # noqa: B905
    damaged = bytearray(data)
    damaged[len(data) // 2 :][:500] = np.random.default_rng(0).bytes(500)
    path.write_bytes(damaged)
    with suppress(ValueError):
        assert 0 < len(list(read_video(path))) <= 30


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


def test_a_name_with_a_colon_is_no_protocol(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    frames = drawn(2)
    write_video("12:30.mov", frames)
    assert all(np.array_equal(a, b) for a, b in zip(frames, read_video("12:30.mov"), strict=True))


@pytest.fixture
def largest_file():
    """Sets the size from which on no file can grow, as on a disk that is full."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize(("name", "codec"), ALL)
def test_a_full_disk_is_an_error(tmp_path, largest_file, name, codec):
    frames = list(np.random.default_rng(0).integers(0, 256, (20, 64, 64, 3), np.uint8))
    size = write_video(tmp_path / f"whole_{name}", frames, codec=codec).stat().st_size
    largest_file(int(0.99 * size))
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


SIZE = (32, 24)


def blank(count):
    return [np.full((*SIZE[::-1], 3), 7 * i % 256, np.uint8) for i in range(count)]


KEPT = np.delete(np.arange(60), [3, 20, 21, 50])


@pytest.mark.parametrize(
    ("name", "codec", "pixels"),
    [("a.mov", "qtrle", "rgb24"), ("a.mp4", "libx264", "yuv420p"), ("a.mkv", "ffv1", "bgr0")],
)
@pytest.mark.parametrize("rate", [None, 24000 / 1001, 240])
def test_the_clock_of_a_phone_is_right_and_dropped_frames_are_gaps(
    tmp_path, rate, name, codec, pixels
):
    seconds = KEPT / rate if rate else waver(np.random.default_rng(0), 90)
    path = write_at(tmp_path / name, seconds, blank(len(seconds)), codec, pixels)
    clock, fps = video.frame_clock(path), video_info(path).fps
    assert len(clock) == len(list(read_video(path))) == len(seconds)
    assert np.abs(clock / fps - (seconds - seconds[0])).max() < 1e-3
    assert fps == pytest.approx(rate or 1 / np.median(np.diff(seconds)), rel=1e-3 if rate else 0.05)
    assert rate is None or clock.tolist() == KEPT.tolist()


@pytest.mark.parametrize("fps", [np.float32(29.97), Fraction(30000, 1001), 999.9, 1 / 3])
@pytest.mark.parametrize(("name", "codec"), ALL)
def test_even_files_have_an_even_clock_though_their_times_are_rounded(tmp_path, fps, name, codec):
    path = write_video(tmp_path / name, blank(50), fps, codec)
    assert video.frame_clock(path).tolist() == list(range(50))
    assert video_info(path)[:2] == (50, pytest.approx(float(fps), rel=1e-4))


def test_the_start_that_an_editor_has_cut_off_does_not_count(tmp_path):
    whole = write_at(tmp_path / "whole.mp4", np.arange(30) / 30, blank(30), "libx264", "yuv420p")
    path = tmp_path / "cut.mp4"
    with av.open(str(whole)) as source, av.open(str(path), "w") as target:
        stream = target.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(source.streams.video[0]):
            if packet.size:
                packet.pts -= round(10 / 30 / packet.time_base)
                packet.dts -= round(10 / 30 / packet.time_base)
                packet.stream = stream
                target.mux(packet)
    frames = list(read_video(path))
    assert len(frames) == len(video.frame_clock(path)) == video_info(path).frames == 20
    assert video.frame_clock(path).tolist() == list(range(20))
    assert np.array_equal(read_frame(path, 4), frames[4])
    assert np.array_equal(frames[0], list(read_video(whole))[10])


@pytest.mark.parametrize(
    ("name", "codec", "pixels"),
    [
        ("a.mp4", "libx264", "yuv420p"),
        ("a.mp4", "libx265", "yuv420p"),
        ("a.mov", "libx265", "yuv420p10le"),
        ("a.mov", "prores_ks", "yuv422p10le"),
    ],
)
def test_what_phones_code_is_read_in_eight_bits(tmp_path, name, codec, pixels):
    size = (96, 64)
    ramp = np.linspace(30, 220, size[0]).astype(np.uint8)
    frames = [np.tile(ramp[None, :, None], (size[1], 1, 3)) for _ in range(3)]
    quality = {"x265-params": "log-level=none:crf=10"} if codec == "libx265" else {}
    quality |= {"preset": "ultrafast"} if codec != "prores_ks" else {}
    path = write_at(tmp_path / name, np.arange(3) / 30, frames, codec, pixels, **quality)
    assert video_info(path) == (3, 30, size)
    for ours, true in zip(read_video(path), frames, strict=True):
        assert ours.dtype == np.uint8
        assert np.abs(ours.astype(int) - true).mean() < 4


def interlaced(path, track, **options):
    """A film with two views a frame: the upper lines of one, the lower of the next."""
    views = list(render(track, vl.Scene("plain", size=14, image_size=(160, 120))))
    frames = [view.copy() for view in views[::2]]
    for frame, later in zip(frames, views[1::2], strict=True):
        frame[1::2] = later[1::2]
    # With colours of every line: an ordinary converter would mix those of two instants.
    return write_at(path, np.arange(len(frames)) / 25, frames, "libx264", "yuv422p", **options)


def test_the_target_is_where_it_was_at_one_instant(tmp_path):
    along = np.linspace(0, 2 * np.pi, 120)
    track = np.column_stack((80 + 45 * np.cos(along), 60 + 35 * np.sin(2 * along)))
    path = interlaced(tmp_path / "a.mp4", track, crf="6", **{"x264-params": "interlaced=1:tff=1"})
    assert np.array_equal(read_frame(path, 19), list(read_video(path))[19])
    found = vl.track(path).pixels
    seen = np.isfinite(found).all(axis=1)
    assert seen.mean() > 0.7
    assert np.sqrt(np.mean((found - track[::2])[seen] ** 2)) < 0.2
    # The same lines in a file that does not say so are half a frame late.
    mixed = vl.track(interlaced(tmp_path / "b.mp4", track, crf="6")).pixels
    assert np.nanmedian(np.abs(mixed - track[::2])) > np.nanmedian(np.abs(found - track[::2]))


def fill(folder, names, size=(32, 24)):
    folder.mkdir(exist_ok=True, parents=True)
    for i, name in enumerate(names):
        image = np.full((*size[::-1], 3), 10 * (i % 25), np.uint8)
        (folder / name).write_bytes(cv2.imencode(".png", image)[1].tobytes())
    return folder


def shades(path):
    return [int(frame[0, 0, 0]) for frame in read_video(path)]


@pytest.mark.parametrize("place", ["弾む球", "it's $5"])
def test_a_folder_is_a_film_in_the_order_of_its_numbers(tmp_path, place):
    folder = fill(tmp_path / place, [f"f{i}.png" for i in range(1, 13)])
    (folder / "notes.txt").write_text("no image")
    (folder / ".hidden.png").write_text("no image")
    assert shades(folder) == [10 * i for i in range(12)]
    assert video_info(folder) == (12, 0, (32, 24))
    assert video.frame_clock(folder).tolist() == list(range(12))
    assert read_frame(folder, 10)[0, 0, 0] == 100
    with pytest.raises(ValueError, match="number: .* must have that frame, got 12"):
        read_frame(folder, 12)


@pytest.mark.parametrize("pattern", ["a_%04d.png", "a_%d.png", "a_????.png"])
def test_a_pattern_leaves_the_others_aside(tmp_path, pattern):
    fill(tmp_path / "shots", [f"b_{i:04d}.png" for i in range(3)])
    fill(tmp_path / "shots", [f"a_{i:04d}.png" for i in range(7)])
    assert shades(tmp_path / "shots" / pattern) == [10 * i for i in range(7)]
    path = tmp_path / "none" / pattern
    said = re.escape(f"nor images of that name, got '{path}'")
    with pytest.raises(FileNotFoundError, match=said):
        read_video(path)


def test_a_missing_image_is_a_dropped_frame_and_letters_are_in_their_order(tmp_path):
    folder = fill(tmp_path / "shots", [f"{i:03d}.png" for i in (100, 110, 130, 140, 150)])
    assert video.frame_clock(folder).tolist() == [0, 1, 3, 4, 5]
    assert shades(fill(tmp_path / "letters", ["a.png", "b.png", "c.png"])) == [0, 10, 20]


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ([], "path: must be a video file, or a folder of images, got .* without any"),
        (["a1.png", "b1.png", "b2.png"], "must have its own number, got .*1.png and .*1.png"),
        (["0033.png", "0066.png", "0101.png"], "the numbers of images must count frames"),
        (["1.png", "2.png", "900.png", "1800.png", "2700.png"], "must count frames"),
    ],
)
def test_folders_that_are_no_film(tmp_path, names, message):
    folder = fill(tmp_path / "shots", names)
    for read in (read_video, video_info, video.frame_clock):
        with pytest.raises(ValueError, match=message):
            read(folder)


def test_images_that_cannot_be_read(tmp_path):
    folder = fill(tmp_path / "shots", ["1.png", "2.png", "3.png"])
    (folder / "2.png").write_bytes(b"")
    with pytest.raises(ValueError, match=r"must be an image that OpenCV can read, got .*2\.png"):
        shades(folder)
    fill(folder, ["2.png"], size=(8, 8))
    with pytest.raises(ValueError, match=r"one size, \(32, 24\), got \(8, 8\) in .*2\.png"):
        shades(folder)
    cv2.imwritemulti(str(tmp_path / "a.tif"), [np.zeros((9, 9), np.float32)] * 3)
    with pytest.raises(ValueError, match="path: must be an image that OpenCV can read"):
        video_info(tmp_path / "a.tif")


def pages(dtype, shift=0):
    """A bright disc that goes to and fro, 40 images."""
    for k in range(40):
        page = np.full((60, 80), 90, np.uint8)
        u, v = 40 + 25 * np.cos(k / 5), 30 + 17 * np.sin(k / 5)
        cv2.circle(page, (round(u), round(v)), 5, 230, -1)
        yield page.astype(dtype) << shift


@pytest.mark.parametrize(("name", "bits"), [("film.tif", 8), ("弾む.TIFF", 10), ("a.tif", 16)])
def test_pages_of_one_tiff_are_a_film_of_as_many_bits_as_it_uses(tmp_path, name, bits):
    dtype = np.uint8 if bits == 8 else np.uint16
    cv2.imwritemulti(str(tmp_path / "a.tif"), list(pages(dtype, bits - 8)))
    path = (tmp_path / "a.tif").rename(tmp_path / name)
    assert video_info(path)[::2] == (40, (80, 60))
    film = [page[..., 0] for page in read_video(path)]
    np.testing.assert_array_equal(film, list(pages(np.uint8)))
    assert len(vl.track(path).pixels) == 40
    (tmp_path / "bad.tif").write_bytes(path.read_bytes()[:100])
    with pytest.raises(ValueError, match=r"path: must hold .* frame, got none in '.*bad.tif'"):
        video_info(tmp_path / "bad.tif")


@pytest.mark.parametrize("factor", [2, 3, 4, 6, 8])
def test_reduced_pixels_are_means_the_last_row_and_column_repeated(factor):
    image = np.random.default_rng(0).integers(0, 256, (25, 49, 3), np.uint8)
    cut = np.pad(image, ((0, -25 % factor), (0, -49 % factor), (0, 0)), mode="edge")
    means = cut.reshape(len(cut) // factor, factor, -1, factor, 3).mean(axis=(1, 3))
    # Each step, a halving or the rest, rounds to whole levels.
    steps = {2: 1, 3: 1, 4: 2, 6: 2, 8: 3}[factor]
    np.testing.assert_allclose(video.reduce(image, factor), means, atol=0.51 * steps)
    assert video.reduce(image, 1) is image


def test_the_frames_of_a_film_leave_the_memory_with_it(tmp_path):
    frames = np.zeros((4, 40, 60, 3), np.uint8)
    film = video.Reel(write_video(tmp_path / "film.mkv", iter(frames)), 480)
    assert len(list(film)) == len(list(film)) == 4
    gone = weakref.ref(film.whole)
    del film  # and no cycle waits for the garbage collector
    assert gone() is None
