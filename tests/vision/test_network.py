"""The network: its anchors, what it says untrained, and the colours that it sees."""

import numpy as np
import pytest
import torch

from vidsindy_lite.vision.network import STRIDE, Network, anchors, as_input, fused


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


def test_colours_reach_the_network_as_red_green_blue():
    image = np.zeros((1, 16, 16, 3), np.uint8)
    image[..., 0] = 255
    planes = as_input(image)
    assert planes.shape == (1, 3, 16, 16)
    assert planes[0, 0].min() == 1
    assert planes[0, 1:].max() == 0


def test_predictions_are_in_pixels():
    """What the last layers say by themselves, with everything before them silent."""
    network = Network().eval()
    with torch.inference_mode():
        for layer in (network.what[-1], network.where[-1]):
            layer.weight.zero_()
        network.where[-1].bias.copy_(torch.tensor([0.5, -0.25, np.log(2.0), 0.0]))
        (found,) = network(torch.rand(1, 3, 32, 48))
    place = anchors(8, 12)
    torch.testing.assert_close(found[0], place[:, 0] + 2)
    torch.testing.assert_close(found[1], place[:, 1] - 1)
    torch.testing.assert_close(found[2], torch.full((96,), 32.0))
    torch.testing.assert_close(found[3], torch.full((96,), 16.0))
    torch.testing.assert_close(found[4], torch.full((96,), float(np.log(0.01 / 0.99))))


def test_half_of_the_channels_pass_a_residual_pair():
    """With a pair that says nothing, the tail comes twice."""
    torch.manual_seed(0)
    split = Network().fine[1].eval()
    with torch.inference_mode():
        split.pair[1][1].weight.zero_()
        x = torch.rand(1, 16, 8, 8)
        inside = split.enter(x)
        expected = split.leave(torch.cat([inside, inside[:, 8:]], dim=1))
        torch.testing.assert_close(split(x), expected)
