"""Detectors: what predictions mean, our own network and its training, and ONNX files."""

import json

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from tiny_onnx import BOX, write_red_detector

from vidsindy_lite.__main__ import main
from vidsindy_lite.vision import WEIGHTS, LearnedDetector, check_detector, detections, network
from vidsindy_lite.vision.network import Network, anchors
from vidsindy_lite.vision.rendering import BACKGROUNDS, SHAPES, Scene, render
from vidsindy_lite.vision.tracking import LEAST, OnnxDetector

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


def test_predictions_that_agree_are_averaged_and_the_surest_comes_first():
    predictions = np.array([  # u, v, width, height, confidence
        [100, 50, 20, 20, 0.9], [102, 50, 20, 20, 0.9], [100, 53, 22, 22, 0.6],
        [104, 60, 20, 20, 0.7],  # of another place,
        [101, 51, 20, 20, 0.2],  # and too weak
    ]).T  # fmt: skip
    (found,) = detections(predictions)
    np.testing.assert_allclose(found.centre, np.array([90 + 91.8 + 60, 45 + 45 + 31.8]) / 2.4)
    assert found.confidence == 0.9
    predictions = np.array(
        [[300, 50, 20, 20, 0.6], [100, 50, 20, 20, 0.8], [200, 90, 20, 20, LEAST - 0.01]]
    ).T
    assert [d.centre[0] for d in detections(predictions)] == [100, 300]
    assert [d.centre[0] for d in detections(predictions, most=1)] == [100]
    assert detections(np.empty((5, 0))) == []


def test_the_weights_are_small_and_the_log_of_their_training_is_complete():
    assert WEIGHTS.stat().st_size < 2e6
    parameters = sum(p.numel() for p in Network().parameters())
    assert LOG["parameters"] == parameters <= 300_000
    assert LOG["frames"] == LOG["steps"] * network.BATCH
    assert len(LOG["loss"]) * LOG["steps_per_loss"] >= LOG["steps"]
    assert LOG["loss"][-1] < 0.3 * LOG["loss"][0]
    assert [told.split()[0] for told in LOG["versions"]] == ["python", "torch", "numpy", "opencv"]
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
    for name in ("none.onnx", tmp_path / "none.onnx", tmp_path / "NONE.ONNX"):
        with pytest.raises(FileNotFoundError, match=rf"detector: no such file, got '{name}'"):
            check_detector(name)
    assert check_detector(write_red_detector(tmp_path / "red.onnx", (256, 256))) is None
    thin = OnnxDetector(write_red_detector(tmp_path / "thin.onnx", (64, 64), rows=4))
    with pytest.raises(FileNotFoundError, match="weights: no such file"):
        LearnedDetector(tmp_path / "none.pt")
    with pytest.raises(ValueError, match=r"shape \(1, 4 \+ classes, anchors\), got \(1, 4, 64\)"):
        thin.predict(np.zeros((64, 64, 3), np.uint8))
    poses = OnnxDetector(write_red_detector(tmp_path / "poses.onnx", (64, 64), rows=56))
    with pytest.raises(
        ValueError, match="must give scores from 0 to 1 below its boxes, got .* to 160"
    ):
        poses.predict(np.zeros((64, 64, 3), np.uint8))


def test_a_training_again_gives_the_same_weights_and_log(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(network, "BATCH", 2)  # it takes seconds
    monkeypatch.setattr(network, "_EACH", 1)
    log = network.train(tmp_path / "one.pt", seed=3, steps=2)
    command = ["train-detector", "--seed", "3", "--steps", "2", "--output"]
    assert main([*command, str(tmp_path / "other.pt")]) == 0
    assert "4 frames" in capsys.readouterr().out
    one, other = (torch.load(tmp_path / f"{n}.pt", weights_only=True) for n in ("one", "other"))
    assert all(torch.equal(one[name], other[name]) for name in one)
    network.train(tmp_path / "third.pt", seed=4, steps=2)
    third = torch.load(tmp_path / "third.pt", weights_only=True)
    assert not torch.equal(one["where.1.bias"], third["where.1.bias"])
    assert json.loads((tmp_path / "other.json").read_text()) == log
    assert sorted(p.suffix for p in tmp_path.iterdir()) == [".json"] * 3 + [".pt"] * 3


def test_the_loss_of_perfect_predictions_is_least():
    centre, size = torch.tensor([[30.2, 41.7]]), torch.tensor([[20.0, 24.0]])
    place = anchors(16, 16)
    squared = (place - centre).square().sum(dim=1)
    quality = torch.exp((squared.min() - squared) / (2 * 4.4**2)).clamp(1e-6, 1 - 1e-6)
    boxes = torch.cat([centre, size], dim=1).T.expand(4, 256)
    perfect = torch.cat([boxes, quality.logit()[None]])
    least = network.detection_loss(perfect[None], centre, size, torch.ones(1))
    assert least < 1e-3
    for row, change in enumerate((1.0, 1.0, 3.0, 3.0, 2.0)):
        worse = perfect.clone()
        worse[row] += change
        assert network.detection_loss(worse[None], centre, size, torch.ones(1)) > least + 0.01
    # The same image twice costs as much as once.
    worse, whole = perfect[None] + 0.3, torch.ones(1)
    once = network.detection_loss(worse, centre, size, whole)
    pair = worse.tile(2, 1, 1), centre.tile(2, 1), size.tile(2, 1), whole.tile(2)
    torch.testing.assert_close(network.detection_loss(*pair), once)
    hidden = network.detection_loss(perfect[None], centre, size, torch.zeros(1))
    assert hidden > least + 0.1


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000))
def test_training_frames_show_what_their_labels_say(seed):
    pool = np.full((1, 512, 512, 3), 128, np.uint8)
    drawn, centre = network.training_frame(np.random.default_rng(seed), pool)
    assert drawn.frame.shape == (network.SIDE, network.SIDE, 3)
    assert drawn.frame.dtype == np.uint8
    assert 0 <= drawn.visible <= 1 + 1e-9
    assert np.array_equal(np.isnan(centre), np.isnan(drawn.extent))
    assert drawn.visible == 0 or (drawn.extent > 3).all()
