"""Detectors: where the target is in a single frame, whatever the other frames show.

The paper tracks with YOLO-v8. Its vendor's code and weights cannot be part of this package, so here
is a small network of the same family, written and trained from scratch (see `network`).
And any YOLO-v8 model that a user has exported to ONNX runs behind the same method, through OpenCV.

Both turn an image into *predictions* of shape (5, n), one column per anchor: centre (u, v), width
and height in pixels, confidence in [0, 1]. `detections` averages those that agree.
"""

import os
import re
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from ..arrays import Floats, Floats32, Image
from ..checks import MALFORMED, check_path, shown

WEIGHTS = Path(__file__).with_name("detector.pt")
"""The weights of the package's own network; detector.json beside it is their training log."""
LEAST = 0.4
"""Smallest confidence of a detection. Detectors of this family are modest: the package's own gives
0.44 to 0.9 to whole targets, more the smaller they are, and less than 0.3 to what is none."""

Predictions = Floats32
"""Centre (u, v), width, height and confidence of each anchor, shape (5, n)."""


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

    def __init__(self, weights: str | os.PathLike = WEIGHTS) -> None:
        import torch  # takes a second, which most videos do not need

        from .network import Network

        weights = check_path("weights", weights)
        if not weights.is_file():
            raise FileNotFoundError(f"weights: no such file, got '{weights}'")
        network = Network()
        network.load_state_dict(torch.load(weights, weights_only=True))
        self.network = network.eval().to(memory_format=torch.channels_last)  # type: ignore[call-overload]

    def predict(self, image: Image) -> Predictions:
        """Predictions, (5, n), for an image (height, width, 3) uint8, red, green and blue."""
        return self.predict_all(image[None])[0]

    def predict_all(self, images: Image) -> Predictions:
        """Predictions, (b, 5, n), for images of one size: many small ones are quicker at once."""
        import torch

        from .network import as_input

        height, width = images.shape[1:3]
        # The sides of what the network takes are multiples of its coarsest stride.
        margins = ((0, 0), (0, -height % 16), (0, -width % 16), (0, 0))
        with torch.inference_mode():
            found = self.network(as_input(np.pad(images, margins, "edge")))
            found[:, 4].sigmoid_()
        return found.numpy()


class OnnxDetector:
    """A YOLO-v8 detection model that was exported to ONNX with a fixed input shape, in fp32.

    Frames are shrunk or enlarged to the model's input size and padded with grey, as in training.
    Of several classes the most confident counts.

    Parameters
    ----------
    path : path
        The .onnx file, which is there.

    Raises
    ------
    ValueError
        If OpenCV cannot read it, or its shapes are not those of a YOLO-v8 detection model.
    """

    def __init__(self, path: str | os.PathLike) -> None:
        self.path = path
        try:
            self.network = cv2.dnn.readNetFromONNX(str(path), cv2.dnn.ENGINE_NEW)
        except (*MALFORMED, cv2.error) as error:
            raise ValueError(
                f"detector: must be an ONNX file that OpenCV can run, got '{self.path}': "
                f"{shown(str(error))}"
            ) from None
        # OpenCV tells the shape of an input only in its description of the whole network.
        shape = set(re.findall(r"<Input> \w+ \[1 x 3 x (\d+) x (\d+)\]", self.network.dump()))
        if len(shape) != 1:
            raise ValueError(
                "detector: must take one image of fixed shape (1, 3, height, width), got another "
                f"input in '{self.path}'"
            )
        self.height, self.width = map(int, shape.pop())

    def predict(self, image: Image) -> Predictions:
        """Predictions, (5, n), for an image (height, width, 3) uint8, red, green and blue."""
        height, width = image.shape[:2]
        scale = min(self.height / height, self.width / width)
        size = round(scale * width), round(scale * height)
        left, top = (self.width - size[0]) // 2, (self.height - size[1]) // 2
        margins = (top, self.height - size[1] - top, left, self.width - size[0] - left)
        resized = cv2.resize(image, size, interpolation=cv2.INTER_LINEAR)
        padded = cv2.copyMakeBorder(resized, *margins, cv2.BORDER_CONSTANT, value=(114,) * 3)
        self.network.setInput(cv2.dnn.blobFromImage(padded, 1 / 255))
        found = np.asarray(self.network.forward(), np.float32)
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

    centre: Floats
    size: Floats
    confidence: float


def detections(predictions: Predictions, least: float = LEAST, most: int = 3) -> list[Detection]:
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

    Returns
    -------
    list of Detection
    """
    found: list[Detection] = []
    predictions = predictions[:, predictions[4] >= least / 2]
    while len(found) < most and predictions.shape[1]:
        best = predictions[:, np.argmax(predictions[4])]
        if best[4] < least:
            break
        apart = np.hypot(*(predictions[:2] - best[:2, None])) / best[2:4].mean()
        # Within a quarter of its size predictions speak of one target, if they are half as sure.
        agree = (apart <= 0.25) & (predictions[4] >= best[4] / 2)
        weight = predictions[4, agree]
        mean = np.average(predictions[:4, agree].astype(float), axis=1, weights=weight)
        found.append(Detection(mean[:2], mean[2:], float(best[4])))
        predictions = predictions[:, apart > 1]
    return found
