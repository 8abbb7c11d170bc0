"""The clock of a file: even where it is, and right to a millisecond where it is not."""

import av
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from phones import waver, write_at

from vidsindy_lite import track
from vidsindy_lite.vision import frame_clock, read_frame, read_video, video_info, write_video

SIZE = (32, 24)


def blank(count):
    return [np.full((*SIZE[::-1], 3), 7 * i % 256, np.uint8) for i in range(count)]


def clock_error(path, seconds):
    return np.abs(frame_clock(path) / video_info(path).fps - (seconds - seconds[0])).max()


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    ("name", "codec", "pixels"),
    [("a.mov", "qtrle", "rgb24"), ("a.mp4", "libx264", "yuv420p"), ("a.mkv", "ffv1", "bgr0")],
)
def test_the_clock_of_a_phone_is_right_to_a_millisecond(tmp_path, seed, name, codec, pixels):
    seconds = waver(np.random.default_rng(seed), 90)
    path = write_at(tmp_path / name, seconds, blank(len(seconds)), codec, pixels)
    assert len(frame_clock(path)) == len(list(read_video(path))) == len(seconds)
    assert clock_error(path, seconds) < 1e-3
    assert video_info(path).fps == pytest.approx(1 / np.median(np.diff(seconds)), rel=0.05)


@pytest.mark.parametrize("rate", [30, 29.97, 24000 / 1001, 240])
@pytest.mark.parametrize("name", ["a.mov", "a.mkv"])
def test_dropped_frames_are_gaps_of_an_even_clock(tmp_path, rate, name):
    kept = np.delete(np.arange(60), [3, 20, 21, 50])
    codec = ("qtrle", "rgb24") if name == "a.mov" else ("ffv1", "bgr0")
    path = write_at(tmp_path / name, kept / rate, blank(len(kept)), *codec)
    assert frame_clock(path).tolist() == kept.tolist()
    assert video_info(path).fps == pytest.approx(rate, rel=1e-3)
    assert clock_error(path, kept / rate) < 1e-3


@pytest.mark.parametrize("fps", [25, 29.97, 600, 999.9, 1 / 3])
@pytest.mark.parametrize(
    ("name", "codec"),
    [("a.mov", None), ("a.mkv", None), ("a.mp4", "mp4v"), ("a.avi", "MJPG"), ("a.avi", "FFV1")],
)
def test_even_files_have_an_even_clock_though_their_times_are_rounded(tmp_path, fps, name, codec):
    path = write_video(tmp_path / name, blank(50), fps, codec)
    assert frame_clock(path).tolist() == list(range(50))
    assert video_info(path).fps == pytest.approx(fps, rel=1e-4)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(1, 400), min_size=2, max_size=30))
def test_any_times_are_kept(tmp_path_factory, steps):
    seconds = np.cumsum(steps) / 400
    path = write_at(tmp_path_factory.mktemp("any") / "a.mov", seconds, blank(len(steps)))
    assert clock_error(path, seconds) < 1e-3


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
    assert len(frames) == len(frame_clock(path)) == video_info(path).frames == 20
    assert frame_clock(path).tolist() == list(range(20))
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
@pytest.mark.parametrize("size", [(96, 64), pytest.param((3840, 2160), marks=pytest.mark.slow)])
def test_what_phones_code_is_read_in_eight_bits(tmp_path, name, codec, pixels, size):
    ramp = np.linspace(30, 220, size[0]).astype(np.uint8)
    frames = [np.tile(ramp[None, :, None], (size[1], 1, 3)) for _ in range(3)]
    quality = {"x265-params": "log-level=none:crf=10"} if codec == "libx265" else {}
    quality |= {"preset": "ultrafast"} if codec != "prores_ks" else {}
    path = write_at(tmp_path / name, np.arange(3) / 30, frames, codec, pixels, **quality)
    assert video_info(path) == (3, 30, size)
    for ours, true in zip(read_video(path), frames, strict=True):
        assert ours.dtype == np.uint8
        assert np.abs(ours.astype(int) - true).mean() < 4


@pytest.mark.parametrize(
    ("name", "codec", "sound"),
    [("a.avi", "mjpeg", False), ("a.webm", "libvpx", False), ("a.mkv", "ffv1", True)],
)
def test_half_a_file_is_told(tmp_path, name, codec, sound):
    pixels = {"mjpeg": "yuvj420p", "ffv1": "bgr0"}.get(codec, "yuv420p")
    with av.open(str(tmp_path / name), "w") as out:
        stream = out.add_stream(codec, rate=30)
        stream.width, stream.height, stream.pix_fmt = 80, 60, pixels
        voice = out.add_stream("pcm_s16le", rate=8000, layout="mono") if sound else None
        noise = np.random.default_rng(0).integers(0, 99, (60, 80, 3))
        for k in range(60):
            image = noise.copy()
            image[20:30, 5 + k : 15 + k] = 230
            frame = av.VideoFrame.from_ndarray(image.astype(np.uint8), format="rgb24")
            out.mux(stream.encode(frame))
            if voice:
                heard = av.AudioFrame.from_ndarray(np.zeros((1, 267), np.int16), "s16", "mono")
                heard.sample_rate, heard.pts = 8000, 267 * k
                out.mux(voice.encode(heard))
        out.mux(stream.encode())
    whole = (tmp_path / name).read_bytes()
    assert video_info(tmp_path / name).frames == 60
    (tmp_path / name).write_bytes(whole[: len(whole) // 2])
    assert video_info(tmp_path / name).frames == pytest.approx(60, abs=1)
    told = track(tmp_path / name).warnings
    assert any("frames can be read: it is cut off" in warning for warning in told)
