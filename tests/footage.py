"""Films of a ball as phones write them, with its exact track: for the tests of the tracker."""

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np

from vidsindy_lite.vision.rendering import BACKGROUNDS, coverage, leaves

NEARNESS = 1.3  # by what factor the size of a target changes


@dataclass(frozen=True)
class Phone:
    """What is filmed and how.

    `size` is the diameter in pixels at the middle distance; `colour` in red, green and blue.
    """

    background: str = "hills"
    size: float = 24.0
    colour: tuple[int, int, int] = (215, 30, 35)
    flicker: float = 0.0
    noise: float = 2.0
    shadow: float = 0.0  # 1: well apart; half of that touches the target
    leaves: bool = False
    camera: str = "fixed"
    image_size: tuple[int, int] = (640, 480)
    frames: int = 120


def path_of(phone: Phone, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Centre of the target over the scene, sub-frame by sub-frame, and its relative size."""
    width, height = phone.image_size
    t = np.arange(phone.frames * 8) / 8 / 120
    largest = phone.size * NEARNESS / 2 + 4
    reach = np.array([width, height]) / 2 - largest - 30
    pace, phase = rng.uniform(1.2, 2.2, 2), rng.uniform(0, 2 * np.pi, 2)
    centre = np.array([width, height]) / 2 - 0.5
    places = centre + np.clip(reach, 15, None) * np.sin(2 * np.pi * np.outer(t, pace) + phase)
    scale = NEARNESS ** np.sin(2 * np.pi * t * rng.uniform(0.5, 1) + rng.uniform(0, 6))
    return places, scale


def camera_maps(phone: Phone, rng: np.random.Generator) -> np.ndarray:
    """Where the scene is in each sub-frame: maps from the first frame's pixels, (n, 3, 3)."""
    n, (width, height) = phone.frames * 8, phone.image_size
    maps = np.tile(np.eye(3), (n, 1, 1))
    if phone.camera == "fixed":
        return maps
    t = np.arange(n) / 8
    if phone.camera == "trembling":
        rates, amplitudes = rng.uniform(0.1, 0.45, (3, 4)), np.array([1.5, 1.5, 0.002])
    else:
        rates, amplitudes = rng.uniform(0.005, 0.06, (3, 4)), np.array([16, 12, 0.015])
    waves = np.sin(2 * np.pi * t[:, None, None] * rates + rng.uniform(0, 6, (3, 4))).mean(axis=2)
    waves = (waves - waves[4]) * amplitudes * 1.5  # at rest in the middle of the first exposure
    c, s = np.cos(waves[:, 2]), np.sin(waves[:, 2])
    maps[:, 0, 0], maps[:, 0, 1], maps[:, 1, 0], maps[:, 1, 1] = c, -s, s, c
    middle = np.array([width - 1, height - 1]) / 2
    maps[:, :2, 2] = middle + waves[:, :2] - np.einsum("nij,j->ni", maps[:, :2, :2], middle)
    return maps


def _paint(image, polygon, colour, opacity=1.0):
    """A polygon over a float image, in place; what of it can be seen."""
    alpha, corner = coverage(polygon)
    left, top = np.maximum(corner, 0)
    right, bottom = np.minimum(corner + alpha.shape[::-1], image.shape[1::-1])
    if left >= right or top >= bottom:
        return
    a = alpha[top - corner[1] : bottom - corner[1], left - corner[0] : right - corner[0], None]
    window = image[top:bottom, left:right]
    ink = window * 0.55 if colour is None else np.array(colour, np.float32)
    window += (opacity * a * (ink - window)).astype(np.float32)


def _disc(centre, size):
    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    area = np.sqrt(np.pi / (24 * np.sin(2 * np.pi / 48)))  # of the polygon: that of the disc
    return centre + size / 2 * area * np.column_stack([np.cos(angle), np.sin(angle)])


def render_phone(phone: Phone, seed: int = 0):
    """Frames and truth: (frames, 2) in the first frame's pixels, (frames, 2) in each one's own."""
    rng = np.random.default_rng(seed)
    width, height = phone.image_size
    margin = 60
    scene = BACKGROUNDS[phone.background](rng, (width + 2 * margin, height + 2 * margin))
    scene = cv2.GaussianBlur(scene, (0, 0), 0.8).astype(np.float32)
    places, scale = path_of(phone, rng)
    maps = camera_maps(phone, rng)
    phase = rng.uniform(0, 6)
    twigs = []
    for _ in range(25 * phone.leaves):
        place = rng.uniform(0, 1, 2) * [width, 0.3 * height] + margin
        twigs.append((place, rng.uniform(0, 6), rng.uniform(5, 14)))
    green = leaves(rng, (64, 64)).reshape(-1, 3).mean(axis=0)
    shift = np.array([[1, 0, -margin], [0, 1, -margin], [0, 0, 1.0]])
    light = 1 + phone.flicker * np.sin(2 * np.pi * 0.37 * np.arange(phone.frames) + phase)
    for i in range(phone.frames):
        use = list(range(8 * i + 2, 8 * i + 6))  # an exposure of half a frame
        base = scene.copy()
        for place, beat, size in twigs:
            sway = 5 * np.array([np.sin(i / 4 + beat), 0.5 * np.cos(i / 3 + beat)])
            _paint(base, _disc(place + sway, size), green)
        here = places[use].mean(axis=0)
        around = 3 * phone.size * NEARNESS + np.ptp(places[use], axis=0).max() + 20
        low = np.clip(here + margin - around, 0, None).astype(int)
        window = base[
            low[1] : int(here[1] + margin + around), low[0] : int(here[0] + margin + around)
        ]
        total = np.zeros_like(window)
        for k in use:
            image, size = window.copy(), phone.size * scale[k]
            centre = places[k] + margin - low
            if phone.shadow:
                apart = phone.shadow * np.array([0.9 * size + 12, 0.8 * size + 10])
                _paint(image, _disc(centre + apart, size), None, 0.8)
            _paint(image, _disc(centre, size), phone.colour)
            total += image / 4
        window[:] = total
        middle = maps[8 * i + 4]
        base = cv2.warpPerspective(base, middle @ shift, (width, height))
        there = (middle @ [*here, 1])[:2]
        noise = phone.noise * rng.standard_normal(base.shape, np.float32)
        yield np.clip(np.rint(light[i] * base + noise), 0, 255).astype(np.uint8), here, there


def write_phone(path: Path, phone: Phone, seed: int = 0):
    """The film in an H.264 file; the truth in the first frame's pixels and in each frame's own."""
    import av

    steady, raw = [], []
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", Fraction(30))
        stream.width, stream.height = phone.image_size
        stream.pix_fmt = "yuv420p"
        stream.bit_rate = 4_000_000
        stream.codec_context.thread_count = 1
        stream.options = {"preset": "fast"}
        for frame, here, there in render_phone(phone, seed):
            picture = cv2.cvtColor(frame, cv2.COLOR_RGB2BGR)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "bgr24")))
            steady.append(here)
            raw.append(there)
        container.mux(stream.encode(None))
    return np.array(steady), np.array(raw)
