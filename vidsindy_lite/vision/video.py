"""Reading and writing of video files, through PyAV (ffmpeg); films of single images are read, too.

The files are lossless unless a lossy codec is asked for, because a lossy codec moves the edges of a
small target by more than the tracker's own error. QuickTime's run-length code (.mov) writes of each
frame only the pixels that differ from the last one: before a background at rest it is quick, and
its files are small. FFV1 (.mkv) codes whole frames, in several times the time.

What phones write is read as it was filmed: upright, each frame at the time that the file states,
and of an interlaced frame, which shows two instants, the lines of one, with those between
interpolated. Which of the two fields came first does not matter: half a frame, the same for all
frames, is part of the video's lag.

A film may also be a folder of images, images whose names follow a pattern, or the pages of one
TIFF. Such films state no frame rate. The numbers in the names are the clock: an image that is
missing is a frame that was dropped. Images of 16 bits of which the film uses fewer, as those of
cameras of 10 or 12 bits, are read by those it uses.

PyAV is imported by the functions that need it, since who works with tracks needs none.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, cast

import cv2
import numpy as np

from ..arrays import Floats, Image
from ..checks import check_choice, check_instance, check_integer, check_number, check_path
from ..storage import check_file

if TYPE_CHECKING:
    from av import VideoFrame
    from av.container import InputContainer, OutputContainer
    from av.video.stream import VideoStream


def timing(shown: Sequence[int | None], stream: VideoStream) -> tuple[Floats, float]:
    """When each frame is `shown`, in ticks, as frames; and the number of frames in a second."""
    stated = float(stream.guessed_rate or 0)
    even = np.arange(len(shown), dtype=float)
    ticks = np.sort([time for time in shown if time is not None]).astype(float)
    steps = np.diff(ticks)
    if len(ticks) < len(shown) or len(ticks) < 2 or not stream.time_base or steps.min() <= 0:
        return even, stated  # some old files do not say
    tick = float(stream.time_base)
    seconds = (ticks - ticks[0]) * tick
    usual = float(np.median(steps)) * tick
    # Between dropped frames, most follow each other at an even rate, which may not be the stated.
    counted = np.concatenate(([0.0], np.cumsum(np.rint(steps * tick / usual))))
    mean = counted[-1] / seconds[-1]
    # By less than a tick rounded times may be off: a whole one is a frame in some files.
    for clock, rate in ((even, stated), (counted, stated), (counted, mean)):
        if rate > 0 and np.abs(seconds * rate - clock).max() < (1 - 1e-6) * rate * tick:
            return clock, rate
    return seconds / usual, 1 / usual


def cut_off(
    shown: Sequence[int | None], end: float, container: InputContainer, stream: VideoStream
) -> int:
    """Number of frames that were cut off the end of a file, by the duration that it states.

    `end` is when the last packet of all its streams ends, in seconds: a file whose sound goes on
    to its end is whole.
    """
    times = [time for time in shown if time is not None]
    if not (container.duration and stream.time_base and times):
        return 0
    rate, whole = float(stream.guessed_rate or 0), container.duration / 1e6
    if len(container.streams) > 1 and (whole - end) * rate < 2:
        return 0
    return max(round((whole - float(max(times) * stream.time_base)) * rate) - 1, 0)


def upper_field(frame: VideoFrame) -> Image:
    """What an interlaced frame shows in its first, third, ... lines, at full height.

    Parameters
    ----------
    frame : VideoFrame

    Returns
    -------
    ndarray, shape (height, width, 3), uint8
        Red, green and blue.
    """
    import av

    # By ffmpeg's filter, which takes the right lines of coarser colour planes, too.
    graph = av.filter.Graph()
    source = graph.add_buffer(
        width=frame.width, height=frame.height, format=frame.format, time_base=frame.time_base
    )
    graph.link_nodes(source, graph.add("field", "type=top"), graph.add("buffersink")).configure()
    graph.push(frame)
    pulled = cast("VideoFrame", graph.pull())
    field = _turned(cast("Image", pulled.to_ndarray(format="bgr24", threads=1)))
    # Between two lines their mean, and the last one twice.
    lower = np.concatenate((field[1:], field[-1:]))
    between = ((field.astype(np.uint16) + lower + 1) // 2).astype(np.uint8)
    return np.stack((field, between), axis=1).reshape(-1, *field.shape[1:])[: frame.height]


class Stills(NamedTuple):
    """The files of a film's images in their order, and when each was taken, in frames.

    Of pages, the file stands there once for each.
    """

    files: list[Path]
    clock: Floats
    pages: bool = False

    def _bits(self) -> int:
        """How many bits the film uses, by some of its images: an even number, from 8 to 16."""
        shown = np.unique(np.linspace(0, len(self.files) - 1, 9).astype(int)).tolist()
        images = [image for k in shown if (image := self._decoded(k)) is not None]
        used = max((int(image.max()) for image in images), default=0).bit_length()
        return max(used + used % 2, 8)

    def pick(self, numbers: Iterable[int]) -> Iterator[Image]:
        """The images of these numbers as far as they go, red, green and blue, all of one size.

        They are upright, and the bits that the film uses are made eight.

        Raises
        ------
        ValueError
            Where an image cannot be read or has another size.
        """
        size, bits = None, self._bits()
        for k in (number for number in numbers if number < len(self.files)):
            image = self._decoded(k)
            if image is None:
                raise ValueError(
                    f"path: must be an image that OpenCV can read, got '{self.files[k]}'"
                )
            if image.dtype == np.uint16:
                image = np.clip(image >> (bits - 8), 0, 255).astype(np.uint8)
            image = _turned(cast("Image", image))
            size = size or image.shape[1::-1]
            if image.shape[1::-1] != size:
                raise ValueError(
                    f"path: all images of a film must have one size, {size}, got "
                    f"{image.shape[1::-1]} in '{self.files[k]}'"
                )
            yield image

    def _decoded(self, number: int) -> np.ndarray | None:
        """An image as it is stored, but for its colours."""
        file, how = self.files[number], cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH
        try:
            if self.pages:
                _, images = cv2.imreadmulti(str(file), number, 1, flags=how)
                return images[0] if images else None
            # Not imread, which knows no Chinese name on some systems.
            return cv2.imdecode(np.fromfile(file, np.uint8), how)
        except (cv2.error, OSError):  # such as a header of more pixels than there are
            return None


def find_stills(path: Path) -> Stills | None:
    """The images in a folder or of a pattern, such as ``shots/a_%04d.png`` or ``shots/*.png``.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Stills or None
        None if the path is neither a folder nor a pattern, but the name of a file that is no TIFF.

    Raises
    ------
    FileNotFoundError, ValueError
        If there are no such images, or their numbers do not tell their order.
    """
    if path.is_file() and path.suffix.lower() in (".tif", ".tiff"):
        count = cv2.imcount(str(path)) if path.stat().st_size else 0
        return Stills([path] * count, np.arange(count, dtype=float), True) if count else None
    if path.is_file() or not (path.is_dir() or re.search(r"[*?]|%\d*d", path.name)):
        return None
    if path.is_dir():
        suffixes = ".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".ppm", ".pgm"
        files = [file for file in path.glob("[!.]*") if file.suffix.lower() in suffixes]
        if not files:
            raise ValueError(
                f"path: must be a video file, or a folder of images, got '{path}' without any"
            )
    else:
        named = re.sub(r"%\d*d", r"\\d+", re.escape(path.name))
        named = named.replace(r"\*", ".*").replace(r"\?", ".")
        files = [file for file in path.parent.glob("*") if re.fullmatch(named, file.name)]
        if not files:
            raise FileNotFoundError(
                f"path: no such video file, nor images of that name, got {str(path)!r}"
            )
    numbers = [re.findall(r"\d+", file.stem)[-1:] for file in files]
    if [] in numbers:
        return Stills(sorted(files), np.arange(len(files), dtype=float))
    return _in_order(path, files, np.array(numbers, dtype=float)[:, 0])


def _in_order(path: Path, files: list[Path], numbers: Floats) -> Stills:
    """Images by the last numbers in their names, which must be those of frames."""
    order = np.argsort(numbers)
    steps = np.diff(numbers[order])
    step = steps.min() if steps.size else 1.0
    if step == 0:
        k = int(steps.argmin())
        twins = " and ".join(files[i].name for i in order[k : k + 2])
        raise ValueError(f"path: each image of a film must have its own number, got {twins}")
    if (steps % step).any() or (steps.size and np.median(steps) > step):
        raise ValueError(
            f"path: the numbers of images must count frames, got {files[order[0]].name}, "
            f"{files[order[1]].name}, ... in '{path}': rename them 0001, 0002, ..."
        )
    return Stills([files[i] for i in order], (numbers[order] - numbers.min()) / step)


class _Codec(NamedTuple):
    """How a codec is called here by ffmpeg, and what it needs."""

    suffixes: tuple[str, ...]
    encoder: str
    pixels: str  #: Format of the pixels that it codes.
    #: Bits per pixel and frame that a lossy codec may use: as many as OpenCV grants it.
    bits: int = 0
    options: dict[str, str] = {}  #: Of the encoder.


CODECS = {
    # Frames from one that stands on its own to the next: a jump costs half of that.
    "qtrle": _Codec((".mov",), "qtrle", "rgb24", options={"g": "50"}),
    "FFV1": _Codec((".mkv", ".avi"), "ffv1", "bgr0"),
    "mp4v": _Codec((".mp4",), "mpeg4", "yuv420p", 1),
    "H264": _Codec((".mp4", ".mkv"), "libx264", "yuv420p"),
    "MJPG": _Codec((".avi", ".mkv"), "mjpeg", "yuvj420p", 3),
    "VP9": _Codec(
        (".webm",), "libvpx-vp9", "yuv420p",
        options={"deadline": "realtime", "cpu-used": "8", "crf": "36", "b": "0"},
    ),
}  # fmt: skip


class VideoInfo(NamedTuple):
    """Number of frames, frames per second and (width, height) of a film.

    The rate is that of most frames if some were dropped or taken at uneven times, and zero if the
    film does not state one.
    """

    frames: int
    fps: float
    size: tuple[int, int]


# ----------------------------------------------------------------------------------------- writing


def write_video(
    path: str | os.PathLike,
    frames: Iterable[Image],
    fps: float | Fraction = 25,
    codec: str | None = None,
) -> Path:
    """Write frames to a video file.

    The file appears under its name only when it is complete and holds all frames.

    Parameters
    ----------
    path : path
        .mov (qtrle) or .mkv (FFV1), both lossless; .mp4 only with a lossy codec.
    frames : iterable of ndarray, shape (height, width, 3), uint8
        Red, green and blue, all of one size.
    fps : float or Fraction
        Frames per second, in [0.01, 10000]; at most 1000 in .mkv, whose clock counts milliseconds.
    codec : {"qtrle", "FFV1", "mp4v", "MJPG", "H264", "VP9"}, optional
        Lossless by default; "mp4v", "MJPG", "H264", which phones write, and "VP9", which pages
        show (.webm), are lossy.

    Returns
    -------
    path : Path

    Raises
    ------
    ValueError
        For an unknown suffix or codec, a frame rate that the file cannot hold, no frame, or a frame
        of another type or of changing size.
    OSError
        If the file cannot be written, e.g. on a full disk.
    """
    path = check_path("path", path)
    check_instance("frames", frames, Iterable)
    suffix = path.suffix.lower()
    codec = codec or {".mov": "qtrle", ".mkv": "FFV1"}.get(suffix)
    if codec is None:
        raise ValueError(f"path: must end in .mov or .mkv unless codec is given, got '{path}'")
    check_choice("codec", codec, CODECS)
    if suffix not in CODECS[codec].suffixes:
        allowed = " or ".join(CODECS[codec].suffixes)
        raise ValueError(f"path: must end in {allowed} for {codec}, got '{path}'")
    rate = _frame_rate(fps, suffix)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.stem}.{os.getpid()}{suffix}")
    try:
        _encode(partial, frames, rate, CODECS[codec], path)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    return path


def _frame_rate(fps: float | Fraction, suffix: str) -> Fraction:
    """The fraction next to a frame rate that a file of that suffix holds."""
    high = 1_000.0 if suffix == ".mkv" else 10_000.0  # its clock counts milliseconds
    if not 0.01 <= check_number("fps", fps) <= high:
        raise ValueError(f"fps: must be in [0.01, {high:g}] for {suffix}, got {fps}")
    # Numerator and denominator have 16 bits in MPEG-4, and so in all these files.
    return Fraction(float(fps)).limit_denominator(int(65_535 / max(fps, 1)))


def _encode(
    partial: Path, frames: Iterable[Image], rate: Fraction, codec: _Codec, path: Path
) -> None:
    """Write a file under its temporary name, and make sure that it holds all frames."""
    import av

    stream, count, held = None, 0, 0
    try:
        with av.open(str(partial.absolute()), "w") as container:
            for frame in _checked(frames):
                stream = stream or _add_stream(container, codec, rate, frame.shape[1::-1])
                container.mux(stream.encode(av.VideoFrame.from_ndarray(_turned(frame), "bgr24")))
                count += 1
            if stream is None:
                raise ValueError("frames: at least one frame is needed, got none")
            container.mux(stream.encode(None))
    except av.FFmpegError as error:
        raise OSError(f"path: cannot write {count} frames to '{path}': {error}") from error
    with suppress(av.FFmpegError, ValueError), _opened(partial) as opened:
        held = len(_packets(*opened))
    if held != count:
        raise OSError(f"path: cannot write {count} frames to '{path}', only {held} are in the file")


def _checked(frames: Iterable[Image]) -> Iterator[Image]:
    """The frames, all of one size."""
    size = None
    for i, frame in enumerate(frames):
        frame = np.ascontiguousarray(frame)
        if frame.dtype != np.uint8 or frame.ndim != 3 or frame.shape[2] != 3 or not frame.size:
            raise ValueError(
                "frames: each must be uint8 of shape (height, width, 3), "
                f"got {frame.dtype} {frame.shape} at frame {i}"
            )
        size = size or frame.shape[1::-1]
        if frame.shape[1::-1] != size:
            raise ValueError(
                f"frames: all must have size {size}, got {frame.shape[1::-1]} at frame {i}"
            )
        yield frame


def _add_stream(
    container: OutputContainer, codec: _Codec, rate: Fraction, size: tuple[int, int]
) -> VideoStream:
    """A stream that takes the frames; the same bytes on any number of cores."""
    options = dict(codec.options)
    stream = cast("VideoStream", container.add_stream(codec.encoder, rate, options=options))
    stream.width, stream.height = size
    stream.pix_fmt = codec.pixels
    stream.codec_context.thread_count = 1
    if codec.bits:
        granted = codec.bits * size[0] * size[1] * float(rate)
        stream.codec_context.bit_rate = int(min(granted, 2**30))
        stream.codec_context.qmin = 3  # the finest quantiser, OpenCV's
    return stream


# ----------------------------------------------------------------------------------------- reading


def read_video(path: str | os.PathLike) -> Iterator[Image]:
    """Frames of a film, one at a time, up to where its file is cut off or damaged.

    Parameters
    ----------
    path : path
        A video file, a folder of images, a pattern of their names as ``shots/a_%04d.png`` or
        ``shots/*.png``, or a TIFF of several pages. The numbers in the names tell the order.

    Yields
    ------
    frame : ndarray, shape (height, width, 3), uint8
        Red, green and blue, upright if the file says how the camera was held. Of an interlaced
        frame the upper field, with the lines between interpolated.

    Raises
    ------
    FileNotFoundError, ValueError
        At once, if the file is missing, empty, not a video, or holds no frame.
    """
    _first(path)
    return _images(path)


def read_frame(path: str | os.PathLike, number: int) -> Image:
    """One frame of a video file, without decoding all before it.

    Parameters
    ----------
    path : path
    number : int
        From 0, in the order of `read_video`.

    Returns
    -------
    frame : ndarray, shape (height, width, 3), uint8
        Red, green and blue.

    Raises
    ------
    FileNotFoundError, ValueError
        If the file is missing, empty, not a video, or holds no such frame.
    """
    number = check_integer("number", number)
    found = list(pick_frames(path, [number]))
    if not found:
        raise ValueError(f"number: '{path}' must have that frame, got {number}")
    return found[0]


def video_info(path: str | os.PathLike) -> VideoInfo:
    """Number of frames, frame rate and size of a film.

    The number is what the file's header states, which is more than the frames that can be read if
    the file was cut off later. Where the header states none (.mkv), the frames are counted, and of
    a file without sound those that its duration promises are added.

    Parameters
    ----------
    path : path

    Returns
    -------
    VideoInfo

    Raises
    ------
    FileNotFoundError, ValueError
        If the file is missing, empty, not a video, or holds no frame.
    """
    size = _first(path).shape[1::-1]
    clock, rate = _clock(path)
    return VideoInfo(len(clock), rate, size)


def frame_clock(path: str | os.PathLike) -> Floats:
    """When each frame of a film was taken, in frames at the even rate that `video_info` tells.

    Parameters
    ----------
    path : path
        See `read_video`.

    Returns
    -------
    ndarray, shape (n,)
        0, 1, 2, ... if the frames are evenly spaced to within the ticks of the file's clock, or the
        file states no times, or was cut off; 0, 1, 3, 4, ... if one was dropped. Divided by the
        rate, seconds.

    Raises
    ------
    FileNotFoundError, ValueError
        See `read_video`.
    """
    return _clock(path)[0]


def _clock(path: str | os.PathLike) -> tuple[Floats, float]:
    """When each frame was taken, those included that were cut off a file later; and their rate."""
    if stills := find_stills(check_path("path", path)):
        return stills.clock, 0.0
    with _opened(path) as (container, stream):
        stated, shown, end = stream.frames, [], 0.0
        for packet in container.demux():
            if not packet.size:  # the last one of a stream
                continue
            if packet.pts is not None and packet.time_base is not None:
                end = max(end, float((packet.pts + (packet.duration or 0)) * packet.time_base))
            if packet.stream.index == stream.index and packet.is_discard:
                stated -= 1  # before the start that an editor has set
            elif packet.stream.index == stream.index:
                shown.append(packet.pts)
        clock, rate = timing(shown, stream)
        count = stated if stream.frames else len(clock) + cut_off(shown, end, container, stream)
    return (clock if len(clock) == count else np.arange(count, dtype=float)), rate


def pick_frames(path: str | os.PathLike, numbers: Sequence[int]) -> Iterator[Image]:
    """The frames of these increasing numbers, as far as the file holds them.

    In a video, the packets say, without being decoded, when each frame is shown and where decoding
    can begin: a jump meets the right frame, also where frames are not evenly spaced in time. Where
    one does not, as in transport streams, or no times are stated, all frames are decoded.
    """
    if stills := find_stills(check_path("path", path)):
        yield from stills.pick(numbers)
        return
    with _opened(path) as (container, stream):
        packets = _packets(container, stream)
        times = sorted({time for time, _ in packets if time is not None})
        keys = [time or 0 for time, is_key in packets if is_key]
        left = [number for number in numbers if number < len(packets)]
        frames: Iterator[VideoFrame] = iter(())
        now = -np.inf
        whole = len(times) == len(packets) and min(keys, default=0) <= min(times, default=0)
        while left and whole:
            time = times[left[0]]
            key = max((key for key in keys if key <= time), default=min(keys, default=time))
            if key > now:
                container.seek(key, stream=stream)
                frames = _decoded(container, stream)
            frame = next((f for f in frames if f.pts is not None and f.pts >= time), None)
            if frame is None or frame.pts != time:
                break
            now = time
            del left[0]
            yield _image(frame)
    every = zip(range(max(left, default=-1) + 1), _images(path), strict=False)
    yield from (image for number, image in every if number in left)


@contextmanager
def _opened(path: str | os.PathLike) -> Iterator[tuple[InputContainer, VideoStream]]:
    """A video file while it is open, and the stream of it that matters."""
    import av

    path = check_file("path", path, "video file")
    if path.stat().st_size == 0:
        raise ValueError(f"path: must be a video file, got the empty file '{path}'")
    try:
        # Absolute, as the part before a colon would be a protocol, e.g. of "12:30.mov".
        container = av.open(str(path.absolute()), metadata_errors="replace")
    except av.FFmpegError:
        raise ValueError(f"path: must be a video file that PyAV can read, got '{path}'") from None
    with container:
        stream = container.streams.best("video")
        if stream is None:
            raise ValueError(f"path: must be a video file, got '{path}', which holds none")
        yield container, cast("VideoStream", stream)


def _packets(container: InputContainer, stream: VideoStream) -> list[tuple[int | None, bool]]:
    """When each frame is shown, in ticks, and whether decoding can begin there."""
    packets = container.demux(stream)  # one a frame; the last one of a stream is empty
    return [(p.pts, p.is_keyframe) for p in packets if p.size and not p.is_discard]


def _decoded(container: InputContainer, stream: VideoStream) -> Iterator[VideoFrame]:
    """The frames from here on, up to where the file is cut off or damaged."""
    import av

    with suppress(av.FFmpegError):
        yield from container.decode(stream)


def _first(path: str | os.PathLike) -> Image:
    """The first frame of a film, which must have one."""
    for image in _images(path):
        return image
    raise ValueError(f"path: must hold at least one frame, got none in '{path}'")


def _images(path: str | os.PathLike) -> Iterator[Image]:
    """All frames of a film; a file is opened with the first and closed after the last."""
    if stills := find_stills(check_path("path", path)):
        yield from stills.pick(range(len(stills.files)))
        return
    with _opened(path) as (container, stream):
        yield from map(_image, _decoded(container, stream))


def _image(frame: VideoFrame) -> Image:
    """Red, green and blue of a decoded frame, upright."""
    if frame.interlaced_frame:
        image = upper_field(frame)
    else:  # more threads cost more than they save
        image = _turned(cast("Image", frame.to_ndarray(format="bgr24", threads=1)))
    return np.ascontiguousarray(np.rot90(image, round(frame.rotation / 90)))


def _turned(image: Image) -> Image:
    """Red, green and blue to blue, green and red, or back.

    From the colours of a codec ffmpeg makes these to other roundings than those; OpenCV takes
    these, so that other readers see the same frames.
    """
    return cast("Image", cv2.cvtColor(image, cv2.COLOR_BGR2RGB))


def reduce(image: Image, factor: int) -> Image:
    """The means over squares of `factor` pixels, also over what is left of squares at the edges."""
    bottom, right = (-side % factor for side in image.shape[:2])
    if right or bottom:
        padded = cv2.copyMakeBorder(image, 0, bottom, 0, right, cv2.BORDER_REPLICATE)
        image = np.asarray(padded, np.uint8)
    while factor > 1:
        step = factor if factor % 2 else 2  # OpenCV halves an image much faster than it quarters it
        factor //= step
        size = (image.shape[1] // step, image.shape[0] // step)
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    return image


class Reel:
    """The frames of a film that is looked at several times, whole or reduced; few are kept.

    Parameters
    ----------
    path : path
        See `read_video`.
    longest : int, optional
        Pixels of the longer side of its frames, to which they are reduced.
    """

    def __init__(self, path: str | os.PathLike, longest: int | None = None) -> None:
        self.path, self.info = path, video_info(path)
        if self.info.frames < 2:
            raise ValueError(f"path: must hold two frames or more, got one in '{path}'")
        width, height = self.info.size
        self.factor = -(-max(width, height) // longest) if longest else 1
        self._larger = None if self.factor == 1 else Reel(path)
        # Bytes of frames that are kept, whole or reduced.
        self.few = 3 * width * height * self.info.frames <= 300_000_000 * self.factor**2
        self._kept: list[Image] | None = None

    @property
    def whole(self) -> Reel:
        """The film in frames that are not reduced."""
        return self._larger or self

    def __iter__(self) -> Iterator[Image]:
        if self._kept is not None:
            yield from self._kept
            return
        kept: list[Image] = []
        for frame in read_video(self.path) if self.factor == 1 else self.whole:
            small = reduce(frame, self.factor)
            if self.few:
                kept.append(small)
            yield small
        self._kept = kept if self.few else None

    def pick(self, numbers: Sequence[int]) -> Iterator[Image]:
        """The frames of these increasing numbers, as far as the film holds them."""
        if self.few:
            return (frame for i, frame in enumerate(self) if i in numbers)
        return (reduce(frame, self.factor) for frame in pick_frames(self.path, numbers))
