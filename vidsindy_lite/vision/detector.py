"""Learned detectors: where the target is in a single frame, whatever the other frames show.

The paper tracks with YOLO-v8. Its vendor's code and weights cannot be part of this package, so here
is a small network of the same family, written and trained from scratch (see `training`): fully
convolutional, anchor-free, one class, with decoupled heads for *what* (the confidence) and *where*
(centre and size). And any YOLO-v8 model that a user has exported to ONNX runs behind the same
method, through OpenCV.

Both turn an image into *predictions* of shape (5, n), one column per anchor: centre (u, v), width
and height in pixels, confidence in [0, 1]. `detections` averages those that agree.
"""

import re
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import torch
from torch import nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from ..checks import check_path

WEIGHTS = Path(__file__).with_name("detector.pt")
"""The weights of the package's own network; how they came about is in detector.json beside it."""
STRIDE = 4
"""Pixels between two anchors."""
LEAST = 0.4
"""Smallest confidence of a detection. Detectors of this family are modest: the package's own gives
0.44 to 0.9 to whole targets, more the smaller they are, and less than 0.3 to what is none."""

_WIDTHS = (16, 16, 32, 64)  # channels at strides 2, 4, 8, 16; multiples of 16 run fastest
_COARSEST = 16  # pixels; the sides of an image are multiples of this
_TYPICAL = 16.0  # pixels; a size of exp(0)
_RARE = 0.01  # confidence of an untrained network: targets are rare among anchors
_AGREE = 0.25  # of the target's size: distance within which predictions speak of one target
_WEAK = 0.5  # of the largest confidence: below, a prediction is not averaged
_GREY = 114  # of the margins of an image that has another aspect ratio than the model's input


# ------------------------------------------------------------------------------------- the network


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
        tail = x[:, x.shape[1] // 2:]
        return self.leave(torch.cat([x, tail + self.pair(tail)], dim=1))


class Network(nn.Module):
    """Images to predictions, at one anchor per 4 x 4 pixels.

    Features go down to 1/16 of the resolution, where an anchor sees all of a large target, and back
    up to 1/4, where the small ones and the fractions of a pixel are.
    """

    def __init__(self):
        super().__init__()
        stem, fine, middle, coarse = _WIDTHS
        self.stem = _Conv(3, stem, stride=2)
        self.fine = nn.Sequential(_Conv(stem, fine, stride=2), _Split(fine, fine))
        self.middle = nn.Sequential(_Conv(fine, middle, stride=2), _Split(middle, middle))
        self.coarse = nn.Sequential(_Conv(middle, coarse, stride=2), _Split(coarse, coarse))
        self.up_middle = _Split(coarse + middle, middle)
        self.up_fine = _Split(middle + fine, fine)
        self.what = nn.Sequential(_Conv(fine, fine), nn.Conv2d(fine, 1, 1))
        self.where = nn.Sequential(_Conv(fine, fine), nn.Conv2d(fine, 4, 1))
        nn.init.constant_(self.what[-1].bias, float(np.log(_RARE / (1 - _RARE))))

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
        return torch.cat([centre, _TYPICAL * where[:, 2:].exp(), what], dim=1)


def anchors(rows: int, columns: int) -> torch.Tensor:
    """Centre (u, v) of each square of 4 x 4 pixels, row by row, (rows columns, 2) pixels."""
    v, u = torch.meshgrid(torch.arange(rows), torch.arange(columns), indexing="ij")
    return STRIDE * torch.stack([u, v], dim=-1).reshape(-1, 2) + (STRIDE - 1) / 2


def as_input(images: np.ndarray) -> torch.Tensor:
    """Blue-green-red images (b, height, width, 3) uint8 as what the network takes."""
    colours = np.stack([cv2.cvtColor(image, cv2.COLOR_BGR2RGB) for image in images])
    planes = torch.from_numpy(colours).permute(0, 3, 1, 2)
    return planes.float().div_(255)  # permuted, the channels stay last in memory: the fast order


# --------------------------------------------------------------------------------------- detectors


class LearnedDetector:
    """The package's own network.

    Parameters
    ----------
    weights : path
        As written by ``python -m vidsindy_lite train-detector``.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    """

    def __init__(self, weights: str | Path = WEIGHTS):
        weights = check_path("weights", weights)
        if not weights.is_file():
            raise FileNotFoundError(f"weights: no such file, got '{weights}'")
        network = Network()
        network.load_state_dict(torch.load(weights, weights_only=True))
        self.network = _fused(network.eval()).to(memory_format=torch.channels_last)

    def predict(self, image: np.ndarray) -> np.ndarray:
        """Predictions, (5, n), for an image (height, width, 3) uint8, blue-green-red."""
        height, width = image.shape[:2]
        margins = (0, -height % _COARSEST, 0, -width % _COARSEST)
        image = cv2.copyMakeBorder(image, *margins, cv2.BORDER_REPLICATE)
        with torch.inference_mode():
            found = self.network(as_input(image[None]))[0]
            found[4].sigmoid_()
        return found.numpy()


def _fused(module: nn.Module) -> nn.Module:
    """Fold each batch normalisation into the convolution before it: the same values, faster."""
    for child in module.modules():
        if isinstance(child, _Conv):
            child[0], child[1] = fuse_conv_bn_eval(child[0], child[1]), nn.Identity()
    return module


class OnnxDetector:
    """A YOLO-v8 detection model that was exported to ONNX with a fixed input shape, in fp32.

    Frames are shrunk or enlarged to the model's input size and padded with grey, as in training.
    Of several classes the most confident counts.

    Parameters
    ----------
    path : path
        The .onnx file.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If OpenCV cannot read it, or its shapes are not those of a YOLO-v8 detection model.
    """

    def __init__(self, path: str | Path):
        self.path = check_path("detector", path)
        if not self.path.is_file():
            raise FileNotFoundError(f"detector: no such file, got '{self.path}'")
        try:
            self.network = cv2.dnn.readNetFromONNX(str(self.path), cv2.dnn.ENGINE_NEW)
        except cv2.error as error:
            raise ValueError(
                f"detector: must be an ONNX file that OpenCV can run, got '{self.path}': {error}"
            ) from None
        # OpenCV tells the shape of an input only in its description of the whole network.
        shape = set(re.findall(r"<Input> \w+ \[1 x 3 x (\d+) x (\d+)\]", self.network.dump()))
        if len(shape) != 1:
            raise ValueError(
                "detector: must take one image of fixed shape (1, 3, height, width), got another "
                f"input in '{self.path}'"
            )
        self.height, self.width = map(int, shape.pop())

    def predict(self, image: np.ndarray) -> np.ndarray:
        """Predictions, (5, n), for an image (height, width, 3) uint8, blue-green-red."""
        height, width = image.shape[:2]
        scale = min(self.height / height, self.width / width)
        size = round(scale * width), round(scale * height)
        left, top = (self.width - size[0]) // 2, (self.height - size[1]) // 2
        margins = (top, self.height - size[1] - top, left, self.width - size[0] - left)
        image = cv2.resize(image, size, interpolation=cv2.INTER_LINEAR)
        image = cv2.copyMakeBorder(image, *margins, cv2.BORDER_CONSTANT, value=(_GREY,) * 3)
        self.network.setInput(cv2.dnn.blobFromImage(image, 1 / 255, swapRB=True))
        found = self.network.forward()
        if found.ndim != 3 or len(found) != 1 or found.shape[1] < 5:
            raise ValueError(
                "detector: must give one array of shape (1, 4 + classes, anchors), "
                f"got {found.shape} from '{self.path}'"
            )
        found = np.concatenate([found[0, :4], found[0, 4:].max(axis=0, keepdims=True)])
        found[:2] -= np.array([[left], [top]])
        found[:4] /= scale
        found[:2] -= 0.5  # YOLO counts from the corner of the first pixel, we from its centre
        return found


# ------------------------------------------------------------------------------------- predictions


class Detection(NamedTuple):
    """Centre (2,) and size (2,) of the target in pixels, and how sure that is, in [0, 1]."""

    centre: np.ndarray
    size: np.ndarray
    confidence: float


def detections(predictions: np.ndarray, least: float = LEAST, most: int = 3) -> list[Detection]:
    """What the predictions show, the surest first.

    The most confident prediction is averaged with those that agree with it, which is where the
    fractions of a pixel come from; the others near it are left out, and so on.

    Parameters
    ----------
    predictions : ndarray, shape (5, n)
    least : float
        Smallest confidence of a detection.
    most : int
        Largest number of detections.
    """
    found = []
    predictions = predictions[:, predictions[4] >= _WEAK * least]
    while len(found) < most and predictions.shape[1]:
        best = predictions[:, np.argmax(predictions[4])]
        if best[4] < least:
            break
        apart = np.hypot(*(predictions[:2] - best[:2, None])) / best[2:4].mean()
        agree = (apart <= _AGREE) & (predictions[4] >= _WEAK * best[4])
        weight = predictions[4, agree]
        mean = np.average(predictions[:4, agree].astype(float), axis=1, weights=weight)
        found.append(Detection(mean[:2], mean[2:], float(best[4])))
        predictions = predictions[:, apart > 1]
    return found
