"""Define the network that segments thin deformable objects: convolutions at five scales, joined from coarse to fine."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import nn

WIDTHS = (16, 32, 64, 96, 128)
"""Channels at strides 2, 4, 8, 16 and 32: 1.43 million parameters, chosen for 60 ms per 640 x 360 px on one core."""


def convolution(inputs: int, outputs: int, stride: int = 1, dilation: int = 1, size: int = 3) -> nn.Sequential:
    """Return a convolution, followed by batch normalization and a rectifier.

    Parameters
    ----------
    inputs, outputs
        numbers of channels.
    stride
        stride of the output, px.
    dilation
        distance between the weights, px.
    size
        width of the kernel, px.
    """
    layer = nn.Conv2d(inputs, outputs, size, stride, dilation * (size // 2), dilation, bias=False)
    return nn.Sequential(layer, nn.BatchNorm2d(outputs), nn.ReLU(inplace=True))


class Residual(nn.Module):
    """Two convolutions that are added to their input (He et al., CVPR 2016)."""

    def __init__(self, channels: int, dilation: int = 1) -> None:
        super().__init__()
        self.first = convolution(channels, channels, dilation=dilation)
        self.second = convolution(channels, channels)[:2]

    def forward(self, x: Any) -> Any:
        """Return features (B, C, H, W) of the shape of `x`."""
        return torch.relu(x + self.second(self.first(x)))


class Network(nn.Module):
    """The segmentation network, which computes logits of the object and of the centre of its strand.

    The input is B images (B, 3, H, W), RGB from 0 to 1, with H and W multiples of 32; the output is (B, 2, H, W).
    """

    def __init__(self, widths: Sequence[int] = WIDTHS) -> None:
        super().__init__()
        a, b, c, d, e = widths
        self.down2 = convolution(3, a, 2)
        self.down4 = nn.Sequential(convolution(a, b, 2), Residual(b))
        self.down8 = nn.Sequential(convolution(b, c, 2), Residual(c), Residual(c))
        self.down16 = nn.Sequential(convolution(c, d, 2), Residual(d), Residual(d, 2))
        self.down32 = nn.Sequential(convolution(d, e, 2), Residual(e), Residual(e, 2))
        self.up16, self.mix16 = convolution(e, d, size=1), convolution(d, d)
        self.up8, self.mix8 = convolution(d, c, size=1), convolution(c, c)
        self.up4, self.mix4 = convolution(c, b, size=1), convolution(b, b)
        self.up2, self.mix2 = convolution(b, a, size=1), convolution(a, a)
        self.up = nn.Upsample(scale_factor=2, mode="nearest")
        self.head = nn.Sequential(nn.Conv2d(a, 8, 3, 1, 1), nn.PixelShuffle(2))

    def forward(self, x: Any) -> Any:
        """Return logits (B, 2, H, W) for images (B, 3, H, W)."""
        x2 = self.down2(x)
        x4 = self.down4(x2)
        x8 = self.down8(x4)
        x16 = self.down16(x8)
        y = self.mix16(x16 + self.up(self.up16(self.down32(x16))))
        y = self.mix8(x8 + self.up(self.up8(y)))
        y = self.mix4(x4 + self.up(self.up4(y)))
        y = self.mix2(x2 + self.up(self.up2(y)))
        return self.head(y)
