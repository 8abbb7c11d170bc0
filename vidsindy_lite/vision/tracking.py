"""Where the moving target is in each frame of a video file, to a fraction of a pixel.

Two ways to find it stand behind one call. The film tracker (`film`) knows all frames: it takes
out the camera's motion and the light's, and of all that differs from the ground it follows what
moves most plainly: to a thousandth of a pixel in clean films of a camera at rest. A *detector*
knows what targets look like and finds it in each frame on its own, whatever the background does, to
a few tenths of a pixel; what it sees in the single frames is linked to one motion.

The paper tracks with a detector, YOLO-v8. Its vendor's code and weights cannot be part of this
package, so here is a small network of the same family, written and trained from scratch (see
`network`). And any YOLO-v8 model that a user has exported to ONNX runs behind the same method,
through OpenCV. Both turn an image into *predictions* of shape (5, n), one column per anchor: centre
(u, v), width and height in pixels, confidence in [0, 1]. `detections` averages those that agree.

A frame gets NaN where the target is not seen, or not for sure.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from pickle import UnpicklingError
from threading import Lock
from typing import NamedTuple

import cv2
import numpy as np

from ..arrays import Floats, Floats32, Image
from ..checks import MALFORMED, check_instance, shown
from ..storage import check_file
from .candidates import Candidates, Hint, as_written, best_path
from .film import Track, follow
from .video import read_video, video_info

DETECTORS = ("auto", "background", "learned")
#: The weights of the package's own network; detector.json beside it is their training log.
WEIGHTS = Path(__file__).with_name("detector.pt")
#: Smallest confidence of a detection. Detectors of this family are modest: the package's own gives
#: 0.44 to 0.9 to whole targets, more the smaller they are, and less than 0.3 to what is none.
LEAST = 0.4

Predictions = Floats32  #: Centre (u, v), width, height and confidence of each anchor, shape (5, n).


# ------------------------------------------------------------------------------------------ tracks


def track(
    path: str | os.PathLike, detector: str | os.PathLike = "auto", target: Hint | None = None
) -> Track:
    """Track the one moving target of a video.

    Parameters
    ----------
    path : path
        A video of a target that moves. Other things may move, too, and the camera may tremble or
        be held in the hand.
    detector : {"auto", "background", "learned"} or path
        * "auto": the camera's motion and the light's are taken out, and of all that moves the
          plainest path is followed: something that travels, keeps its colour and turns gently.
          The target may turn and change its size slowly; views of a part of it are left out.
        * "background": the same for a camera that is known to be at rest.
        * "learned": the package's own network, for backgrounds that move or change.
        * the name of a YOLO-v8 model exported to ONNX (see `OnnxDetector`).
    target : Hint, optional
        Which of the things that move is the target, for "auto". It is then carried on where a
        part of it shows, and beyond its first and last whole view.

    Returns
    -------
    Track
        Its warnings say where something else might be the target, whether it misses a hint, and
        whether the camera may move other than is known.

    Raises
    ------
    FileNotFoundError, ValueError
        If the file is missing, empty, not a video, or holds no frame, or if there is no such
        detector or .onnx file.
    """
    check_detector(detector)
    if target is not None:
        check_instance("target", target, Hint)
        if detector != "auto":
            raise ValueError(f"target: may be given for detector='auto', got {shown(detector)}")
    if detector in ("auto", "background"):
        found = follow(path, target, rests=detector == "background")
    else:
        network = LearnedDetector() if detector == "learned" else OnnxDetector(detector)
        chain = link([detections(network.predict(frame)) for frame in read_video(path)])
        found = Track(*chain, str(detector))
    lacking, stated = found.warnings + _lost(found), video_info(path).frames
    if target is not None and target.colour is not None and np.isnan(found.pixels).all():
        lacking += (f"nothing was found of the colour {as_written(target.colour)} as told",)
    if len(found.pixels) != stated:
        lacking += (f"{len(found.pixels)} of its {stated} frames can be read: it is cut off",)
    return replace(found, warnings=tuple(f"{Path(path).name}: {doubt}" for doubt in lacking))


def _lost(found: Track) -> tuple[str, ...]:
    """Is the target lost in many of the frames from its first to its last?"""
    at = np.flatnonzero(np.isfinite(found.pixels[:, 0]))
    if not len(at):
        return () if found.warnings else ("nothing was found that looks like one target",)
    # Share of the frames below which many of them are lost.
    if len(at) >= 0.5 * (between := at[-1] - at[0] + 1):
        return ()
    lost = between - len(at)
    return (f"the target is lost in {lost} of {between} frames, from {at[0]} to {at[-1]}",)


def check_detector(name: str | os.PathLike) -> None:
    """The name of a way to find the target, or of an .onnx file that is there.

    Raises
    ------
    FileNotFoundError, ValueError
        If it is neither.
    """
    if isinstance(name, str) and name in DETECTORS:
        return
    if not isinstance(name, str | os.PathLike) or Path(name).suffix.lower() != ".onnx":
        raise ValueError(
            f"detector: must be one of {', '.join(DETECTORS)}, or the name of an .onnx file, "
            f"got {shown(name)}"
        )
    check_file("detector", name)


def link(sightings: Sequence[Sequence[Detection]]) -> tuple[Floats, Floats]:
    """At most one sighting of each frame, such that together they are one motion.

    They are candidates as good as the detector is sure of them, see `best_path`; a target may be
    away for any time.

    Parameters
    ----------
    sightings : sequence of sequence of Detection
        What is seen in each frame.

    Returns
    -------
    pixels : ndarray, shape (n, 2)
        Centre of the one of each frame, NaN where there is none.
    confidence : ndarray, shape (n,)
    """
    flat = [(i, d) for i, seen in enumerate(sightings) for d in seen]
    frame = np.array([i for i, _ in flat], int)
    centre = np.array([d.centre for _, d in flat]).reshape(-1, 2)
    size = np.array([d.size for _, d in flat]).reshape(-1, 2)
    sure, black = np.array([d.confidence for _, d in flat]), np.zeros((len(flat), 3))
    box = np.hstack([centre - size / 2, size])
    seen = Candidates(frame, centre, centre, box, size.prod(axis=1), black, black, sure, sure > 0)
    rows = best_path(seen, away=True).rows
    pixels, confidence = np.full((len(sightings), 2), np.nan), np.zeros(len(sightings))
    pixels[frame[rows]], confidence[frame[rows]] = centre[rows], sure[rows]
    return pixels, confidence


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

        network, file = Network(), check_file("weights", weights)
        try:
            network.load_state_dict(torch.load(file, weights_only=True))
        except (*MALFORMED, UnpicklingError):
            raise ValueError(f"weights: must be written by train-detector, got '{file}'") from None
        self.network = network.eval().to(memory_format=torch.channels_last)  # type: ignore[call-overload]

    def predict(self, image: Image) -> Predictions:
        """Predictions, (5, n), for an image (height, width, 3) uint8, red, green and blue."""
        return self.predict_all(_colours(image)[None])[0]

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


def _colours(image: Image) -> Image:
    """An image as detectors take it."""
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or not image.size:
        raise ValueError(f"image: must be (height, width, 3) of uint8, got {shown(image)}")
    return image


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
        self._one = Lock()  # of two threads, each would get the other's answers

    def predict(self, image: Image) -> Predictions:
        """Predictions, (5, n), for an image (height, width, 3) uint8, red, green and blue."""
        height, width = _colours(image).shape[:2]
        scale = min(self.height / height, self.width / width)
        size = round(scale * width), round(scale * height)
        left, top = (self.width - size[0]) // 2, (self.height - size[1]) // 2
        margins = (top, self.height - size[1] - top, left, self.width - size[0] - left)
        resized = cv2.resize(image, size, interpolation=cv2.INTER_LINEAR)
        padded = cv2.copyMakeBorder(resized, *margins, cv2.BORDER_CONSTANT, value=(114,) * 3)
        with self._one:
            self.network.setInput(cv2.dnn.blobFromImage(padded, 1 / 255))
            found = np.array(self.network.forward(), np.float32)
        if found.ndim != 3 or len(found) != 1 or not 5 <= found.shape[1] <= found.shape[2]:
            raise ValueError(
                "detector: must give one array of shape (1, 4 + classes, anchors), "
                f"got {found.shape} from '{self.path}'"
            )
        # Also of this shape are keypoints, masks and angles: mostly beyond.
        if not ((found[0, 4:] >= -1e-3) & (found[0, 4:] <= 1 + 1e-3)).all():
            raise ValueError(
                "detector: must give scores from 0 to 1 below its boxes, "
                f"got {found[0, 4:].min():g} to {found[0, 4:].max():g} from '{self.path}'"
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


def detections(predictions: Predictions, most: int = 3) -> list[Detection]:
    """What the predictions show, the surest first.

    The most confident prediction is averaged with those that agree with it, which is where the
    fractions of a pixel come from; the others near it are left out, and so on.

    Parameters
    ----------
    predictions : ndarray, shape (5, n)
    most : int
        Largest number of detections.

    Returns
    -------
    list of Detection
    """
    found: list[Detection] = []
    predictions = predictions[:, predictions[4] >= LEAST / 2]
    while len(found) < most and predictions.shape[1]:
        best = predictions[:, np.argmax(predictions[4])]
        if best[4] < LEAST:
            break
        apart = np.hypot(*(predictions[:2] - best[:2, None])) / best[2:4].mean()
        # Within a quarter of its size predictions speak of one target, if they are half as sure.
        agree = (apart <= 0.25) & (predictions[4] >= best[4] / 2)
        weight = predictions[4, agree]
        mean = np.average(predictions[:4, agree].astype(float), axis=1, weights=weight)
        found.append(Detection(mean[:2], mean[2:], float(best[4])))
        predictions = predictions[:, apart > 1]
    return found
