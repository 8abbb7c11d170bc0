"""The training of the detector: its frames, its loss and its log."""

import json

import cv2
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from vidsindy_lite.__main__ import main
from vidsindy_lite.vision import rendering as scenery
from vidsindy_lite.vision import training
from vidsindy_lite.vision.network import anchors
from vidsindy_lite.vision.rendering import LabelledFrame

# Mean and standard deviation of the training frames of seeds 0 to 23.
FRAMES = (
    [195, 141, 206, 93, 144, 85, 57, 94, 129, 88, 67, 125]
    + [238, 132, 138, 128, 135, 162, 118, 158, 113, 94, 131, 152],
    [55, 80, 45, 63, 77, 41, 35, 58, 36, 31, 33, 30]
    + [23, 69, 65, 67, 60, 45, 68, 44, 36, 58, 43, 70],
)


def test_training_frames_look_as_they_did():
    kinds = enumerate(training.SEEN_BACKGROUNDS)
    pool = np.stack(
        [scenery.BACKGROUNDS[kind](np.random.default_rng(i), (512, 512)) for i, kind in kinds]
    )
    frames = [training.training_frame(np.random.default_rng(k), pool)[0].frame for k in range(24)]
    mean, spread = ([stat(frame) for frame in frames] for stat in (np.mean, np.std))
    np.testing.assert_allclose(mean, FRAMES[0], atol=1)
    np.testing.assert_allclose(spread, FRAMES[1], atol=1)


@pytest.fixture
def small(monkeypatch):
    """Training that takes seconds."""
    monkeypatch.setattr(training, "BATCH", 2)
    monkeypatch.setattr(training, "_EACH", 1)


@pytest.mark.slow
def test_a_training_again_gives_the_same_weights_and_log(small, tmp_path, capsys):
    log = training.train(tmp_path / "one.pt", seed=3, steps=5)
    command = ["train-detector", "--seed", "3", "--steps", "5", "--output"]
    assert main([*command, str(tmp_path / "other.pt")]) == 0
    assert "10 frames" in capsys.readouterr().out
    one, other = (torch.load(tmp_path / f"{n}.pt", weights_only=True) for n in ("one", "other"))
    assert all(torch.equal(one[name], other[name]) for name in one)
    assert json.loads((tmp_path / "other.json").read_text()) == log
    assert sorted(p.suffix for p in tmp_path.iterdir()) == [".json", ".json", ".pt", ".pt"]


def test_another_seed_gives_other_weights(small, tmp_path):
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
    small[..., 0] = (0.25 * small[..., 2] + small[..., 0]) / 1.25
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
    assert (grey == cv2.cvtColor(frame[:1, :1], cv2.COLOR_RGB2GRAY)[0, 0]).all()
    # Of a frame of one colour, neither blur nor a lossy codec leaves much to be seen.
    for rest in ([0.1, 1.0, same], [same, 0.1, 90]):
        seen = training._seen_by_a_camera(frame, Given(same, same, 1.0, np.ones(3), 0.0, *rest))
        np.testing.assert_allclose(seen.astype(float), frame, atol=2)


class Farthest(Given):
    """A source of random numbers that are the largest of their ranges, or given."""

    def integers(self, low, high=None, size=None):
        largest = (low if high is None else high) - 1
        return largest if size is None else np.full(size, largest)


@pytest.mark.parametrize("size", [48, 96, 192, 512])
def test_a_piece_of_a_background_reaches_to_its_last_pixel_and_not_beyond(size):
    v, u = np.mgrid[:512, :512]
    pool = np.stack([np.zeros((512, 512, 3)), np.dstack([u // 4, v // 4, (u + v) // 8])])
    pool = pool.astype(np.uint8)
    rng = Farthest(np.log(size / training.SIDE), np.zeros((3, 3)), 1.0)
    piece = training._background(rng, pool)
    corner = pool[1, -size:, -size:].astype(float)
    step = size / training.SIDE
    for k in (0, 1):
        line = piece.astype(float).mean(axis=k)[:, k]
        wanted = corner.mean(axis=k)[:, k]
        assert line.shape == (training.SIDE,)
        np.testing.assert_allclose(line[[0, -1]], wanted[[0, -1]], atol=1 + step / 4)
        assert line.mean() == pytest.approx(wanted.mean(), abs=0.6)


def test_pieces_are_of_half_the_frame_to_the_whole_background():
    asked = []

    class Ranges(Farthest):
        def uniform(self, low, high, size=None):
            asked.append((low, high))
            return high if size is None else np.full(size, high)

    pool = np.full((1, 512, 512, 3), (40, 80, 120), np.uint8)
    piece = training._background(Ranges(), pool)
    np.testing.assert_allclose(np.exp(asked[0]), [0.5, 512 / 96])
    # A quarter of the other colours each, 1.3 times as bright.
    mixed = 1.3 * (np.array([40, 80, 120]) + 0.25 * 240) / 1.75
    np.testing.assert_allclose(piece[50, 50], mixed, atol=1)


def test_the_loss_of_a_place_is_that_of_the_anchors_around_the_target():
    # A small target on an anchor: those beside it are to be sure to 0.61, diagonally to 0.37.
    place = anchors(4, 4)
    centre, size = place[5:6], torch.tensor([[6.0, 10.0]])
    steps = (place - centre).square().sum(dim=1) / training.STRIDE**2
    near = steps < 2.5
    assert near.sum() == 9
    quality = torch.exp(-steps / 2)
    right = torch.cat([centre, size], dim=1).T.expand(4, 16).clone()

    perfect = quality.clamp(1e-6, 1 - 1e-6).logit()

    def loss(boxes, logit=perfect):
        return training.detection_loss(
            torch.cat([boxes, logit[None]])[None], centre, size, torch.ones(1)
        ).item()

    least = loss(right)
    off = right + torch.tensor([training.STRIDE, -0.5 * training.STRIDE, 0, 0])[:, None]
    assert loss(off) == pytest.approx(least + 1.5, abs=1e-3)
    large = right * torch.tensor([1, 1, np.e, np.exp(-0.4)])[:, None]
    assert loss(large) == pytest.approx(least + 0.5 * 1.4, abs=1e-3)
    far = torch.where(near, right, off)  # whose place matters to nobody
    assert loss(far) == pytest.approx(least, abs=1e-3)
    # Of the nine, the corners have the weight of e^-1 each, of all of which the sum is 4.9.
    corners = torch.where((steps > 1.5) & near, off, right)
    weights = np.exp(-np.array([0, 0.5, 1])) * [1, 4, 4]
    assert loss(corners) == pytest.approx(least + 1.5 * weights[2] / weights.sum(), abs=1e-3)
    # Of undecided anchors each costs ln 2, by the square of how far it is from decided.
    undecided = ((quality - 0.5) ** 2).sum() * np.log(2) / quality.sum()
    assert loss(right, torch.zeros(16)) == pytest.approx(undecided.item(), rel=1e-4)


def test_the_larger_a_target_the_more_anchors_are_to_be_sure_of_it():
    place = anchors(16, 16)
    centre = place[120:121]
    squared = (place - centre).square().sum(dim=1)
    for size, spread in ((10.0, 4.0), (40.0, 8.0), (80.0, 16.0)):
        sides = torch.tensor([[1.2 * size, 0.8 * size]])
        boxes = torch.cat([centre, sides], dim=1).T.expand(4, 256)
        losses = [
            training.detection_loss(
                torch.cat([boxes, torch.exp(-squared / (2 * (factor * spread) ** 2))
                           .clamp(1e-6, 1 - 1e-6).logit()[None]])[None],
                centre, sides, torch.ones(1),
            ).item()
            for factor in (0.8, 1.0, 1.25)
        ]  # fmt: skip
        assert losses[1] < 1e-4 < min(losses[0], losses[2])


def test_middles_of_targets_are_drawn_from_one_edge_of_the_frame_to_the_other():
    drawn = []

    class Noted(np.random.Generator):
        def uniform(self, low=0.0, high=1.0, size=None):
            drawn.append((low, high, size))
            return super().uniform(low, high, size)

    pool = np.full((1, 512, 512, 3), 128, np.uint8)
    training.training_frame(Noted(np.random.PCG64(0)), pool)
    assert (-0.5, training.SIDE - 0.5, 2) in drawn
