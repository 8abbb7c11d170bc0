"""The package's own network, in PyTorch: fully convolutional, anchor-free, one class.

Of the family of YOLO-v8, with decoupled heads for *what* (the confidence) and *where* (centre and
size). Only this module imports torch.

It is trained from scratch, on frames that the package renders: every step draws its frames and
augmentations from the seed and its own number.
"""

import io
import os
from typing import Any

import cv2
import numpy as np
import torch
from torch import nn
from torch.nn import functional
from torch.optim import lr_scheduler
from tqdm import trange

from ..arrays import Floats, Floats32, Image
from ..checks import check_integer, check_output
from ..storage import library_versions, write_file, write_json
from .rendering import BACKGROUNDS, COLOURS, Box, LabelledFrame, Scene, draw_frames
from .tracking import WEIGHTS

STRIDE = 4  # pixels between two anchors


class _Conv(nn.Sequential):
    """Convolution, batch normalisation, SiLU: the brick of the family."""

    def __init__(self, inputs: int, outputs: int, size: int = 3, stride: int = 1):
        super().__init__(
            nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False),
            nn.BatchNorm2d(outputs),
            nn.SiLU(inplace=True),
        )


class _Split(nn.Module):
    """Half of the channels pass through a residual pair of convolutions; all are kept (C2f)."""

    def __init__(self, inputs: int, outputs: int):
        super().__init__()
        half = outputs // 2
        self.enter = _Conv(inputs, outputs, 1)
        self.pair = nn.Sequential(_Conv(half, half), _Conv(half, half))
        self.leave = _Conv(outputs + half, outputs, 1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        x = self.enter(x)
        tail = x[:, x.shape[1] // 2 :]
        return self.leave(torch.cat([x, tail + self.pair(tail)], dim=1))


class Network(nn.Module):
    """Images to predictions, at one anchor per 4 x 4 pixels.

    Features go down to 1/16 of the resolution, where an anchor sees all of a large target, and back
    up to 1/4, where the small ones and the fractions of a pixel are.
    """

    def __init__(self) -> None:
        super().__init__()
        # Channels at strides 2, 4, 8, 16; multiples of 16 run fastest.
        stem, fine, middle, coarse = 16, 16, 32, 64
        self.stem = _Conv(3, stem, stride=2)
        self.fine = nn.Sequential(_Conv(stem, fine, stride=2), _Split(fine, fine))
        self.middle = nn.Sequential(_Conv(fine, middle, stride=2), _Split(middle, middle))
        self.coarse = nn.Sequential(_Conv(middle, coarse, stride=2), _Split(coarse, coarse))
        self.up_middle = _Split(coarse + middle, middle)
        self.up_fine = _Split(middle + fine, fine)
        self.what = nn.Sequential(_Conv(fine, fine), nn.Conv2d(fine, 1, 1))
        self.where = nn.Sequential(_Conv(fine, fine), nn.Conv2d(fine, 4, 1))
        # Targets are rare among anchors: an untrained network's confidence is 0.01.
        nn.init.constant_(self.what[-1].get_parameter("bias"), float(np.log(0.01 / 0.99)))

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """Predictions, the confidence before the sigmoid.

        Parameters
        ----------
        images : tensor, shape (b, 3, height, width)
            Red, green, blue in [0, 1]; sides are multiples of 16.

        Returns
        -------
        predictions : tensor, shape (b, 5, n)
            Centre, width and height in pixels, with the centre of the first pixel at 0; logit.
        """
        fine = self.fine(self.stem(images))
        middle = self.middle(fine)
        up = nn.functional.interpolate(self.coarse(middle), scale_factor=2.0)
        up = self.up_middle(torch.cat([up, middle], dim=1))
        up = nn.functional.interpolate(up, scale_factor=2.0)
        up = self.up_fine(torch.cat([up, fine], dim=1))
        where, what = self.where(up).flatten(2), self.what(up).flatten(2)
        centre = anchors(*up.shape[2:]).T + STRIDE * where[:, :2]
        # Pixels; a size of exp(0).
        return torch.cat([centre, 16.0 * where[:, 2:].exp(), what], dim=1)


def anchors(rows: int, columns: int) -> torch.Tensor:
    """Centre (u, v) of each square of 4 x 4 pixels, row by row, (rows columns, 2) pixels."""
    v, u = torch.meshgrid(torch.arange(rows), torch.arange(columns), indexing="ij")
    return STRIDE * torch.stack([u, v], dim=-1).reshape(-1, 2) + (STRIDE - 1) / 2


def as_input(images: Image) -> torch.Tensor:
    """Images (b, height, width, 3) uint8 as what the network takes."""
    planes = torch.from_numpy(np.ascontiguousarray(images)).permute(0, 3, 1, 2)
    return planes.float().div_(255)  # permuted, the channels stay last in memory: the fast order


#: What the detector is trained on. The other backgrounds and shapes are kept to test it.
SEEN_BACKGROUNDS = ("plain", "sky", "hills", "wood")
SEEN_SHAPES = ("disc", "polygon")
STEPS = 2000
BATCH = 16
SIDE = 96  # pixels; width and height of a training frame

_POOLED = 512  # pixels; width and height of the backgrounds that frames are cut from
_EACH = 12  # such backgrounds of each kind

# ------------------------------------------------------------------------------------------ frames


def training_frame(rng: np.random.Generator, pool: Image) -> tuple[LabelledFrame, Floats]:
    """One random frame, its labels, and the centroid of the target, (2,), NaN without target.

    Scenes, colours and occluders are random, targets stretched, frames disturbed as by a camera.

    Parameters
    ----------
    rng : np.random.Generator
    pool : ndarray
        As of `background_pool`.
    """
    occluders = tuple(_rectangle(rng) for _ in range(rng.choice(3, p=(0.5, 0.25, 0.25))))
    scene = Scene(
        background=str(rng.choice(SEEN_BACKGROUNDS)),
        shape=str(rng.choice(SEEN_SHAPES)),
        size=float(np.exp(rng.uniform(np.log(5), np.log(80)))),
        colour=str(rng.choice(list(COLOURS))),
        noise_variance=float(rng.choice(2) * rng.uniform(0, 0.015)),
        occluders=occluders,
        shape_seed=int(rng.integers(2**31)),
        image_size=(SIDE, SIDE),
    )
    centre = rng.uniform(-0.5, SIDE - 0.5, 2)
    if rng.random() < 0.15:  # without a target
        centre = np.full(2, np.nan)
    elif occluders and rng.random() < 0.5:  # near an edge of an occluder, where it is hard
        box = np.array(occluders[-1])
        centre = box[:2] + rng.uniform(-0.3, 1.3, 2) * box[2:]
    stretch = np.exp(rng.uniform(-0.35, 0.35) * np.array([1, -1]))
    angle = rng.uniform(0, np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shape = turn * stretch @ turn.T
    seed, scenery = int(rng.integers(2**31)), _scenery(rng, pool)
    drawn = next(draw_frames(centre[None], scene, seed, shape[None], scenery))
    return drawn._replace(frame=_seen_by_a_camera(drawn.frame, rng)), centre


def _rectangle(rng: np.random.Generator) -> Box:
    """Left, top, width and height of a post or a hedge."""
    size = rng.integers((8, 24), (60, SIDE))
    size = size if rng.random() < 0.5 else size[::-1]
    left, top = (int(rng.integers(0, SIDE - s + 1)) for s in size)
    return left, top, int(size[0]), int(size[1])


def background_pool(rng: np.random.Generator) -> Image:
    """Backgrounds to cut training frames from, (m, 512, 512, 3) uint8."""
    size = (_POOLED, _POOLED)
    return np.stack([BACKGROUNDS[kind](rng, size) for kind in SEEN_BACKGROUNDS * _EACH])


def _scenery(rng: np.random.Generator, pool: Image) -> Image:
    """A patchwork of backgrounds at several scales and in unlike colours, (SIDE, SIDE, 3)."""
    image = _background(rng, pool)
    for _ in range(rng.choice(4, p=(0.55, 0.15, 0.15, 0.15))):
        if rng.random() < 0.5:
            left, top, width, height = _rectangle(rng)
            part = np.s_[top : top + height, left : left + width]
            image[part] = _background(rng, pool)[part]
        else:
            image = np.asarray(cv2.add(image, _tiles(rng), dtype=cv2.CV_8U), np.uint8)
    return image


def _background(rng: np.random.Generator, pool: Image) -> Image:
    """A piece of a background, sometimes magnified or reduced, in colours of its own."""
    size = round(SIDE * np.exp(rng.uniform(np.log(0.5), np.log(_POOLED / SIDE))))
    left, top = rng.integers(0, _POOLED - size + 1, 2)
    image = pool[rng.integers(len(pool))][top : top + size, left : left + size]
    resized = cv2.resize(image, (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    # Its colours are mixed, muted: the target's are the vivid ones.
    mix = np.eye(3) + rng.uniform(-0.25, 0.25, (3, 3))[::-1, ::-1]  # as the shipped weights saw it
    mix *= rng.uniform(0.6, 1.3) / mix.sum(axis=1, keepdims=True)
    return np.asarray(cv2.transform(resized, mix.astype(np.float32)), np.uint8)


def _tiles(rng: np.random.Generator) -> Floats32:
    """Brightness of tiles: a grid of random pitch, turned at random, (SIDE, SIDE, 3)."""
    v, u = np.mgrid[:SIDE, :SIDE].astype(np.float32)
    angle = rng.uniform(0, np.pi)
    across, along = np.array([np.cos(angle), np.sin(angle)], np.float32)
    rows = ((u * across + v * along) / np.float32(rng.uniform(8, 60))).astype(int)
    columns = ((v * across - u * along) / np.float32(rng.uniform(8, 60))).astype(int)
    light = rng.uniform(-40, 40, (SIDE, SIDE)).astype(np.float32)[rows % SIDE, columns % SIDE]
    return np.stack([light] * 3, axis=-1)


def _seen_by_a_camera(frame: Image, rng: np.random.Generator) -> Image:
    """Another white balance, colours exchanged, blur, or a lossy codec."""
    frame = frame[..., ::-1]  # OpenCV's order, whose codec it is
    frame = frame[..., rng.permutation(3)] if rng.random() < 0.5 else frame
    if rng.random() < 0.1:
        frame = np.stack([cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)] * 3, axis=-1)
    gain = rng.uniform(0.8, 1.2) * rng.uniform(0.9, 1.1, 3)
    frame = np.clip(frame * gain + rng.uniform(-15, 15), 0, 255).astype(np.uint8)
    if rng.random() < 0.2:
        frame = np.asarray(cv2.GaussianBlur(frame, (0, 0), rng.uniform(0.4, 1.2)), np.uint8)
    if rng.random() < 0.15:
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(40, 95))]
        coded = cv2.imencode(".jpg", frame, quality)[1]
        frame = np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR), np.uint8)
    return np.ascontiguousarray(frame[..., ::-1])


# -------------------------------------------------------------------------------------------- loss


def detection_loss(
    predictions: torch.Tensor, centres: torch.Tensor, sizes: torch.Tensor, presence: torch.Tensor
) -> torch.Tensor:
    """Quality focal loss of the confidence, plus the errors of centre and size where it matters.

    Parameters
    ----------
    predictions : tensor, shape (b, 5, n)
        As of `Network`, of square images.
    centres, sizes : tensor, shape (b, 2)
        Pixels; anything where there is no target.
    presence : tensor, shape (b,)
        1 for a target that is seen whole, 0 for none.

    Returns
    -------
    loss : tensor, scalar
    """
    side = round(predictions.shape[2] ** 0.5)
    squared = (anchors(side, side)[None] - centres[:, None]).square().sum(dim=2)
    spread = (0.2 * sizes.mean(dim=1)).clamp(min=STRIDE)[:, None]
    # Among the anchors around a target the nearest is to be sure of it, the others less.
    nearest = squared.amin(dim=1, keepdim=True)
    quality = presence[:, None] * torch.exp((nearest - squared) / (2 * spread**2))
    logit = predictions[:, 4]
    entropy = functional.binary_cross_entropy_with_logits(logit, quality, reduction="none")
    what = ((quality - logit.sigmoid()).square() * entropy).sum()
    weight = torch.where(quality > 0.2, quality, 0)
    off = (predictions[:, :2] - centres[:, :, None]).abs().sum(dim=1) / STRIDE
    stretch = (predictions[:, 2:4] / sizes[:, :, None]).log().abs().sum(dim=1)
    where = (weight * (off + 0.5 * stretch)).sum()
    return what / quality.sum().clamp(min=1) + where / weight.sum().clamp(min=1)


def _batch(seed: int, step: int, pool: Image) -> tuple[torch.Tensor, ...]:
    """Images and labels of one step."""
    rngs = [np.random.default_rng(s) for s in np.random.SeedSequence((seed, step)).spawn(BATCH)]
    frames, centres = zip(*(training_frame(rng, pool) for rng in rngs), strict=True)
    images = as_input(np.stack([drawn.frame for drawn in frames]))
    visible = np.array([drawn.visible for drawn in frames])
    # Seen to 0.95 it is a target, to 0.6 it is none.
    presence = np.clip((visible - 0.6) / (0.95 - 0.6), 0, 1)
    sizes = np.nan_to_num([drawn.extent for drawn in frames], nan=1.0)
    labels = (np.nan_to_num(centres), sizes, presence)
    return images, *(torch.as_tensor(label, dtype=torch.float32) for label in labels)


# -------------------------------------------------------------------------------------------- loop


def train(
    weights: str | os.PathLike = WEIGHTS, seed: int = 0, steps: int = STEPS
) -> dict[str, Any]:
    """Train the detector and write its weights, with the log of the training beside them.

    It takes a few minutes, and a terminal shows how far it is.

    Parameters
    ----------
    weights : path
        File for the weights (.pt); the log is a .json of the same name.
    seed : int
    steps : int
        Batches of 16 frames.

    Returns
    -------
    log : dict
        Seed, numbers of steps, frames and parameters, loss curve, what was trained on, versions.
    """
    weights = check_output("weights", weights)
    beside = weights.with_suffix(".json")
    if weights.suffix != ".pt" or (beside.exists() and not weights.exists()):
        raise ValueError(
            "weights: must be a .pt file, beside which a .json of its name is free for its log, "
            f"got '{weights}'"
        )
    seed, steps = check_integer("seed", seed), check_integer("steps", steps, 1)
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        network = Network().to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    optimiser = torch.optim.AdamW(network.parameters(), weight_decay=1e-3)
    # The largest learning rate, to which it rises over a twentieth of the steps.
    schedule = lr_scheduler.OneCycleLR(optimiser, 3e-3, steps + 1, pct_start=0.05)
    pool = background_pool(np.random.default_rng(seed))
    losses: list[float] = []
    for step in trange(steps, unit="step", disable=None):
        images, *labels = _batch(seed, step, pool)
        loss = detection_loss(network(images), *labels)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimiser.step()
        schedule.step()
        losses.append(loss.item())
    memory = io.BytesIO()
    torch.save(network.state_dict(), memory)
    write_file(weights, memory.getvalue())
    log = _training_log(seed, losses, sum(p.numel() for p in network.parameters()))
    write_json(beside, log)
    return log


def _training_log(seed: int, losses: list[float], parameters: int) -> dict[str, Any]:
    """What the training was, as it goes into a JSON file."""
    block = max(len(losses) // 100, 1)  # of as many points the curve is
    means = [np.mean(losses[i : i + block]) for i in range(0, len(losses), block)]
    return {
        "seed": seed,
        "steps": len(losses),
        "frames": len(losses) * BATCH,
        "frame_size": [SIDE, SIDE],
        "backgrounds": list(SEEN_BACKGROUNDS),
        "shapes": list(SEEN_SHAPES),
        "parameters": parameters,
        "steps_per_loss": block,
        "loss": [round(float(mean), 4) for mean in means],
        "versions": library_versions(),
    }
