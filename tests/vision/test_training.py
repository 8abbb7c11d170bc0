"""The training of the detector: its frames, its loss and its log."""

import json

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from vidsindy_lite.__main__ import main
from vidsindy_lite.vision import network
from vidsindy_lite.vision.network import anchors


@pytest.fixture
def small(monkeypatch):
    """Training that takes seconds."""
    monkeypatch.setattr(network, "BATCH", 2)
    monkeypatch.setattr(network, "_EACH", 1)


def test_a_training_again_gives_the_same_weights_and_log(small, tmp_path, capsys):
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
