"""Detectors: what predictions mean, the package's own network on scenes unlike those of its
training, ONNX files, and the training itself."""

import json

import cv2
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from tiny_onnx import BOX, write_red_detector

from vidsindy_lite.__main__ import main
from vidsindy_lite.vision import training
from vidsindy_lite.vision.detector import LEAST, WEIGHTS, LearnedDetector, OnnxDetector, detections
from vidsindy_lite.vision.network import STRIDE, Network, anchors, as_input, fused
from vidsindy_lite.vision.rendering import LabelledFrame, render
from vidsindy_lite.vision.scenery import BACKGROUNDS
from vidsindy_lite.vision.scenes import SHAPES, Scene

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


# ------------------------------------------------------------------------------------- predictions


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


def test_anchors_are_the_centres_of_squares_of_pixels():
    u, v = np.mgrid[:12, :8]
    image = np.stack([u, v]).astype(np.float32)  # (2, columns, rows)
    means = image.reshape(2, 3, 4, 2, 4).mean(axis=(2, 4))
    np.testing.assert_allclose(anchors(2, 3).T.reshape(2, 2, 3), means.transpose(0, 2, 1))
    np.testing.assert_allclose(anchors(2, 3)[1], [STRIDE + 1.5, 1.5])


def test_an_untrained_network_is_sure_of_nothing():
    torch.manual_seed(0)
    with torch.inference_mode():
        predictions = Network().eval()(torch.rand(2, 3, 64, 96))
    assert predictions.shape == (2, 5, 16 * 24)
    assert predictions[:, 4].sigmoid().max() < 0.1
    assert Network().what[-1].bias.sigmoid().item() == pytest.approx(0.01)


def test_fused_normalisation_changes_no_value():
    torch.manual_seed(0)
    network, images = Network(), torch.rand(4, 3, 64, 64)
    network(images)  # in training mode: moves the running means
    network.eval()
    with torch.inference_mode():
        plain = network(images)
        torch.testing.assert_close(fused(network)(images), plain, rtol=1e-4, atol=1e-4)


# ----------------------------------------------------------------------------- the learned detector


def test_the_weights_are_small_and_the_log_of_their_training_is_complete():
    assert WEIGHTS.stat().st_size < 2e6
    parameters = sum(p.numel() for p in Network().parameters())
    assert LOG["parameters"] == parameters <= 300_000
    assert LOG["frames"] == LOG["steps"] * training.BATCH
    assert len(LOG["loss"]) * LOG["steps_per_loss"] >= LOG["steps"]
    assert LOG["loss"][-1] < 0.3 * LOG["loss"][0]
    assert set(LOG["versions"]) == {"python", "torch", "numpy", "opencv"}
    assert LOG["backgrounds"] == list(training.SEEN_BACKGROUNDS)
    assert LOG["shapes"] == list(training.SEEN_SHAPES)


@pytest.mark.parametrize(("variance", "bound"), [(0.0, 0.5), (0.01, 0.7)])
def test_targets_of_unseen_kinds(learned, variance, bound):
    errors = []
    for seed in range(10):
        scene = unseen_scene(seed, noise_variance=variance, image_size=(256, 256))
        truth = np.random.default_rng(seed).uniform(40, 215, (2, 2))
        for frame, true in zip(render(truth, scene, seed), truth, strict=True):
            found = detections(learned.predict(frame))
            errors.append(np.linalg.norm(found[0].centre - true) if found else np.inf)
    assert np.median(errors) < bound
    assert np.mean(np.array(errors) < 5) >= 0.95


def test_sizes_that_are_no_multiple_of_anything(learned):
    scene = unseen_scene(3, size=20, image_size=(218, 150))
    frame = next(render([[140.3, 70.6]], scene, 0))
    (found,) = detections(learned.predict(frame))
    np.testing.assert_allclose(found.centre, [140.3, 70.6], atol=1.5)
    np.testing.assert_allclose(found.size, 20, rtol=0.35)


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_seen_in_an_empty_scene(learned, seed):
    frame = next(render([[np.nan, np.nan]], unseen_scene(seed, image_size=(256, 256)), seed))
    assert detections(learned.predict(frame)) == []


def test_missing_weights(tmp_path):
    with pytest.raises(FileNotFoundError, match="weights: no such file"):
        LearnedDetector(tmp_path / "none.pt")


# -------------------------------------------------------------------------------------------- ONNX


@pytest.mark.parametrize("size", [(128, 96), (256, 256), (288, 192), (512, 512)])
def test_an_onnx_model_sees_frames_of_any_size(tmp_path, size):
    detector = OnnxDetector(write_red_detector(tmp_path / "red.onnx", size))
    frame = np.full((192, 256, 3), 90, np.uint8)
    frame[64:96, 96:128] = (0, 0, 255)  # whole squares of anchors in all of these sizes
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
    with pytest.raises(ValueError, match=r"shape \(1, 4 \+ classes, anchors\), got \(1, 4, 64\)"):
        thin.predict(np.zeros((64, 64, 3), np.uint8))


# ---------------------------------------------------------------------------------------- training


@pytest.fixture
def small(monkeypatch):
    """Training that takes seconds."""
    monkeypatch.setattr(training, "BATCH", 2)
    monkeypatch.setattr(training, "_EACH", 1)
    monkeypatch.setattr(training, "_CHECKPOINT", 2)


@pytest.mark.slow
def test_training_goes_on_where_it_was_stopped(small, tmp_path, monkeypatch, capsys):
    whole = training.train(tmp_path / "whole.pt", seed=3, steps=5)
    step, batch = [], training._batch

    def stopped(seed, number, pool):
        step.append(number)
        if len(step) == 4:
            raise KeyboardInterrupt
        return batch(seed, number, pool)

    monkeypatch.setattr(training, "_batch", stopped)
    with pytest.raises(KeyboardInterrupt):
        training.train(tmp_path / "parts.pt", seed=3, steps=5)
    assert not (tmp_path / "parts.pt").exists()
    command = ["train-detector", "--seed", "3", "--steps", "5", "--output"]
    assert main([*command, str(tmp_path / "parts.pt")]) == 0
    assert step == [0, 1, 2, 3, 2, 3, 4]
    assert "10 frames" in capsys.readouterr().out
    one, other = (torch.load(tmp_path / f"{n}.pt", weights_only=True) for n in ("whole", "parts"))
    assert all(torch.equal(one[name], other[name]) for name in one)
    assert json.loads((tmp_path / "parts.json").read_text()) == whole
    assert sorted(p.suffix for p in tmp_path.iterdir()) == [".json", ".json", ".pt", ".pt"]


def test_a_checkpoint_of_another_training_is_not_used(small, tmp_path):
    for seed in (1, 2):
        training.train(tmp_path / f"{seed}.pt", seed=seed, steps=2)
    weights = [torch.load(tmp_path / f"{s}.pt", weights_only=True)["where.1.bias"] for s in (1, 2)]
    assert not torch.equal(*weights)


def test_the_log_of_a_training_tells_the_loss_of_block_after_block():
    log = training._training_log(3, [float(step) for step in range(251)], 7)
    assert (log["seed"], log["steps"], log["parameters"]) == (3, 251, 7)
    assert log["frames"] == 251 * training.BATCH
    assert log["steps_per_loss"] == 2
    assert log["loss"] == [*np.arange(0.5, 250, 2), 250]  # the last one stands alone


def test_the_loss_of_perfect_predictions_is_least():
    centre, size = torch.tensor([[30.2, 41.7]]), torch.tensor([[20.0, 24.0]])
    place = anchors(16, 16)
    squared = (place - centre).square().sum(dim=1)
    quality = torch.exp((squared.min() - squared) / (2 * 4.4**2)).clamp(1e-6, 1 - 1e-6)
    boxes = torch.cat([centre, size], dim=1).T.expand(4, 256)
    perfect = torch.cat([boxes, quality.logit()[None]])
    least = training.detection_loss(perfect[None], centre, size, torch.ones(1))
    assert least < 1e-3
    for row, change in enumerate((1.0, 1.0, 3.0, 3.0, 2.0)):
        worse = perfect.clone()
        worse[row] += change
        assert training.detection_loss(worse[None], centre, size, torch.ones(1)) > least + 0.01
    # The same image twice costs as much as once.
    worse, whole = perfect[None] + 0.3, torch.ones(1)
    once = training.detection_loss(worse, centre, size, whole)
    pair = worse.tile(2, 1, 1), centre.tile(2, 1), size.tile(2, 1), whole.tile(2)
    torch.testing.assert_close(training.detection_loss(*pair), once)
    hidden = training.detection_loss(perfect[None], centre, size, torch.zeros(1))
    assert hidden > least + 0.1


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000))
def test_training_frames_show_what_their_labels_say(seed):
    pool = np.full((1, 512, 512, 3), 128, np.uint8)
    drawn, centre = training.training_frame(np.random.default_rng(seed), pool)
    assert drawn.frame.shape == (training.SIDE, training.SIDE, 3)
    assert drawn.frame.dtype == np.uint8
    assert 0 <= drawn.visible <= 1 + 1e-9
    assert np.array_equal(np.isnan(centre), np.isnan(drawn.extent))
    assert drawn.visible == 0 or (drawn.extent > 3).all()


def test_colours_reach_the_network_as_red_green_blue():
    image = np.zeros((1, 16, 16, 3), np.uint8)
    image[..., 2] = 255
    planes = as_input(image)
    assert planes.shape == (1, 3, 16, 16)
    assert planes[0, 0].min() == 1
    assert planes[0, 1:].max() == 0
    assert cv2.cvtColor(image[0], cv2.COLOR_BGR2RGB)[0, 0, 0] == 255


def test_labels_of_a_batch_say_how_much_of_the_target_is_seen(monkeypatch):
    shown = iter([(1.0, 1.0), (0.95, 1.0), (0.775, 0.5), (0.6, 0.0), (0.0, 0.0)])
    wanted = []

    def frame(rng, pool):
        visible, presence = next(shown)
        wanted.append(presence)
        image = np.zeros((training.SIDE, training.SIDE, 3), np.uint8)
        return LabelledFrame(image, np.array([20.0, 10.0]), visible), np.array([30.0, 40.0])

    monkeypatch.setattr(training, "BATCH", 5)
    monkeypatch.setattr(training, "training_frame", frame)
    images, centres, sizes, presence = training._batch(0, 0, None)
    assert images.shape == (5, 3, training.SIDE, training.SIDE)
    np.testing.assert_allclose(presence, wanted, atol=1e-6)
    np.testing.assert_allclose(centres, [[30, 40]] * 5)
    np.testing.assert_allclose(sizes, [[20, 10]] * 5)


class Given:
    """A source of these random numbers, in this order."""

    def __init__(self, *numbers):
        self.numbers = list(numbers)

    def uniform(self, *ranges):
        return self.numbers.pop(0)

    integers = random = uniform


@pytest.mark.parametrize("turned", [False, True])
def test_tiles_are_rectangles_of_one_brightness(turned):
    table = np.arange(training.SIDE**2, dtype=float).reshape(training.SIDE, training.SIDE)
    light = training._tiles(Given(np.pi / 2 if turned else 0.0, 12.0, 20.0, table))
    assert light.shape == (training.SIDE, training.SIDE, 3)
    assert np.ptp(light, axis=2).max() == 0
    plane = light[..., 0] if turned else light[..., 0].T
    for axis, pitch in ((0, 12), (1, 20)):
        steps = np.flatnonzero(np.diff(plane, axis=axis).any(axis=1 - axis)) + 1
        np.testing.assert_array_equal(steps, np.arange(pitch, training.SIDE, pitch))


def test_a_piece_of_a_background_keeps_its_place_and_mixes_its_colours():
    v, u = np.mgrid[:512, :512]
    pool = np.stack([np.dstack([u // 4, v // 4, 0 * u + 60])]).astype(np.uint8)
    # As large as the frame, from (100, 200); each colour by itself, 0.8 times as bright.
    place, alone = np.array([100, 200]), np.zeros((3, 3))
    piece = training._background(Given(np.log(1.0), place, 0, alone, 0.8), pool)
    expected = 0.8 * pool[0, 200 : 200 + training.SIDE, 100 : 100 + training.SIDE]
    np.testing.assert_allclose(piece, expected, atol=0.51)
    # Twice as large, so that it shrinks; red takes half of blue, and the sum of shares stays one.
    mix = np.array([[0, 0, 0], [0, 0, 0], [0.25, 0, 0]])
    piece = training._background(Given(np.log(2.0), place, 0, mix, 1.0), pool)
    large = pool[0, 200 : 200 + 2 * training.SIDE, 100 : 100 + 2 * training.SIDE].astype(float)
    small = large.reshape(training.SIDE, 2, training.SIDE, 2, 3).mean(axis=(1, 3))
    small[..., 2] = (0.25 * small[..., 0] + small[..., 2]) / 1.25
    np.testing.assert_allclose(piece, small, atol=1.01)


def test_posts_and_hedges_lie_in_the_frame():
    assert training._rectangle(Given(np.array([10, 50]), 0.4, 86, 46)) == (86, 46, 10, 50)
    assert training._rectangle(Given(np.array([10, 50]), 0.6, 46, 86)) == (46, 86, 50, 10)
    rng = np.random.default_rng(0)
    boxes = np.array([training._rectangle(rng) for _ in range(500)])
    assert (boxes[:, :2].min(axis=0) == 0).all()
    assert ((boxes[:, :2] + boxes[:, 2:]).max(axis=0) == training.SIDE).all()


def test_white_balance_of_a_camera():
    frame = np.full((8, 8, 3), (50, 100, 200), np.uint8)
    same = 0.9  # no exchange, no grey, no blur, no codec
    seen = training._seen_by_a_camera(frame, Given(same, same, 1.1, np.ones(3), -5.0, same, same))
    np.testing.assert_array_equal(seen, np.full((8, 8, 3), (50, 105, 215), np.uint8))
    grey = training._seen_by_a_camera(frame, Given(same, 0.05, 1.0, np.ones(3), 0.0, same, same))
    assert (grey == cv2.cvtColor(frame[:1, :1], cv2.COLOR_BGR2GRAY)[0, 0]).all()
    # Of a frame of one colour, neither blur nor a lossy codec leaves much to be seen.
    for rest in ([0.1, 1.0, same], [same, 0.1, 90]):
        seen = training._seen_by_a_camera(frame, Given(same, same, 1.0, np.ones(3), 0.0, *rest))
        np.testing.assert_allclose(seen.astype(float), frame, atol=2)
