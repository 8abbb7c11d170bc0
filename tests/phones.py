"""Video files as phones and camcorders write them."""

from fractions import Fraction

import av
import cv2
import numpy as np

TICKS = 90_000  # in a second


def write_at(path, seconds, frames, codec="qtrle", pixels="rgb24", **options):
    """A file whose frames are shown at these times."""
    base = Fraction(1, TICKS)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, 25, options=options)
        for i, (time, frame) in enumerate(zip(seconds, frames, strict=True)):
            if i == 0:
                stream.width, stream.height = frame.shape[1::-1]
                stream.pix_fmt = pixels
                stream.time_base = stream.codec_context.time_base = base
            picture = av.VideoFrame.from_ndarray(cv2.cvtColor(frame, cv2.COLOR_RGB2BGR), "bgr24")
            picture.pts, picture.time_base = round(time * TICKS), base
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))
    return path


def waver(rng, frames, rate=30.0):
    """Times of a phone's frames: they waver, one in twenty is dropped, the rate falls half-way."""
    k = np.arange(frames)
    beats = np.where(k > frames // 2, frames // 2 + 1.25 * (k - frames // 2), k)
    times = (beats + 0.15 * rng.uniform(-1, 1, frames)) / rate
    kept = np.sort(rng.permutation(frames)[: frames - frames // 20])
    return times[kept] - times[kept[0]]
