"""The package's own network, in PyTorch: fully convolutional, anchor-free, one class.

Of the family of YOLO-v8, with decoupled heads for *what* (the confidence) and *where* (centre and
size). Only this module and `training` import torch.
"""

import numpy as np
import torch
from torch import nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from ..arrays import Image

STRIDE = 4  # pixels between two anchors
COARSEST = 16  # pixels, of which the sides of an image are multiples


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
    colours = np.ascontiguousarray(images)
    planes = torch.from_numpy(colours).permute(0, 3, 1, 2)
    return planes.float().div_(255)  # permuted, the channels stay last in memory: the fast order


def fused(module: Network) -> Network:
    """Fold each batch normalisation into the convolution before it: the same values, faster."""
    for child in module.modules():
        if isinstance(child, _Conv):
            convolution, normalisation, _ = child
            assert isinstance(convolution, nn.Conv2d)
            assert isinstance(normalisation, nn.BatchNorm2d)
            child[0], child[1] = fuse_conv_bn_eval(convolution, normalisation), nn.Identity()
    return module
