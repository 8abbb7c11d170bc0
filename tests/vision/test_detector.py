"""Detectors: what predictions mean, the package's own network, and ONNX files."""

import json

import numpy as np
import pytest
from tiny_onnx import BOX, write_red_detector

from vidsindy_lite.vision import network
from vidsindy_lite.vision.detector import LEAST, WEIGHTS, LearnedDetector, OnnxDetector, detections
from vidsindy_lite.vision.network import Network
from vidsindy_lite.vision.rendering import BACKGROUNDS, SHAPES, Scene, render

LOG = json.loads(WEIGHTS.with_suffix(".json").read_text())


@pytest.fixture(scope="module")
def learned():
    return LearnedDetector()


def unseen_scene(seed, **fixed):
    """A random scene whose background and shape are of kinds that the training has not drawn."""
    rng = np.random.default_rng([seed, 99])
    background = rng.choice(sorted(set(BACKGROUNDS) - set(LOG["backgrounds"])))
    shape = rng.choice(sorted(set(SHAPES) - set(LOG["shapes"])))
    return Scene.random(rng, background=str(background), shape=str(shape), **fixed)


def column(u, v, size, confidence):
    return [u, v, size, size, confidence]


def test_predictions_that_agree_are_averaged():
    predictions = np.array([
        column(100, 50, 20, 0.9), column(102, 50, 20, 0.9), column(100, 53, 22, 0.6),
        column(104, 60, 20, 0.7),  # of another place,
        column(101, 51, 20, 0.2),  # and too weak
    ]).T  # fmt: skip
    (found,) = detections(predictions)
    np.testing.assert_allclose(found.centre, np.array([90 + 91.8 + 60, 45 + 45 + 31.8]) / 2.4)
    assert found.confidence == 0.9


def test_the_surest_comes_first_and_the_unsure_not_at_all():
    predictions = np.array(
        [column(300, 50, 20, 0.6), column(100, 50, 20, 0.8), column(200, 90, 20, LEAST - 0.01)]
    ).T
    assert [d.centre[0] for d in detections(predictions)] == [100, 300]
    assert [d.centre[0] for d in detections(predictions, most=1)] == [100]
    assert [d.centre[0] for d in detections(predictions, least=0.3)] == [100, 300, 200]
    assert detections(predictions, least=0.81) == []
    assert detections(np.empty((5, 0))) == []


def test_the_weights_are_small_and_the_log_of_their_training_is_complete():
    assert WEIGHTS.stat().st_size < 2e6
    parameters = sum(p.numel() for p in Network().parameters())
    assert LOG["parameters"] == parameters <= 300_000
    assert LOG["frames"] == LOG["steps"] * network.BATCH
    assert len(LOG["loss"]) * LOG["steps_per_loss"] >= LOG["steps"]
    assert LOG["loss"][-1] < 0.3 * LOG["loss"][0]
    assert set(LOG["versions"]) == {"python", "torch", "numpy", "opencv"}
    assert LOG["backgrounds"] == list(network.SEEN_BACKGROUNDS)
    assert LOG["shapes"] == list(network.SEEN_SHAPES)


@pytest.mark.parametrize(("variance", "bound"), [(0.0, 0.5), (0.01, 0.7)])
def test_targets_of_unseen_kinds(learned, variance, bound):
    errors, size = [], (256, 218)  # which is no multiple of anything
    for seed in range(10):
        scene = unseen_scene(seed, noise_variance=variance, image_size=size)
        truth = np.random.default_rng(seed).uniform(40, 178, (2, 2))
        for frame, true in zip(render(truth, scene, seed), truth, strict=True):
            found = detections(learned.predict(frame))
            errors.append(np.linalg.norm(found[0].centre - true) if found else np.inf)
    assert np.median(errors) < bound
    assert np.mean(np.array(errors) < 5) >= 0.95


@pytest.mark.parametrize("seed", range(2))
def test_nothing_is_seen_in_an_empty_scene(learned, seed):
    frame = next(render([[np.nan, np.nan]], unseen_scene(seed, image_size=(256, 256)), seed))
    assert detections(learned.predict(frame)) == []


@pytest.mark.parametrize("size", [(128, 96), (288, 192), (512, 512)])
def test_an_onnx_model_sees_frames_of_any_size(tmp_path, size):
    detector = OnnxDetector(write_red_detector(tmp_path / "red.onnx", size))
    frame = np.full((192, 256, 3), 90, np.uint8)
    frame[64:96, 96:128] = (255, 0, 0)  # whole squares of anchors in all of these sizes
    found = detector.predict(frame)
    sure = found[:, found[4] > 0.5]
    np.testing.assert_allclose(sure[:2].mean(axis=1), [111.5, 79.5], atol=0.01)
    scale = min(size[0] / 256, size[1] / 192)
    np.testing.assert_allclose(sure[2:4], BOX / scale)
    assert sure.shape[1] == (32 * scale / 8) ** 2  # its anchors are 8 pixels apart


def test_bad_onnx_files(tmp_path):
    text = tmp_path / "text.onnx"
    text.write_text("no protocol buffer")
    with pytest.raises(ValueError, match="detector: must be an ONNX file that OpenCV can run"):
        OnnxDetector(text)
    batch = write_red_detector(tmp_path / "batch.onnx", (64, 64), batch="batch")
    with pytest.raises(ValueError, match=r"detector: .* fixed shape \(1, 3, height, width\)"):
        OnnxDetector(batch)
    thin = OnnxDetector(write_red_detector(tmp_path / "thin.onnx", (64, 64), rows=4))
    with pytest.raises(FileNotFoundError, match="weights: no such file"):
        LearnedDetector(tmp_path / "none.pt")
    with pytest.raises(ValueError, match=r"shape \(1, 4 \+ classes, anchors\), got \(1, 4, 64\)"):
        thin.predict(np.zeros((64, 64, 3), np.uint8))
