"""Methods that select the object.

Each file holds one method, a function `mask(data, config, seed) -> bool array`: (H, W) for a Frame or an Image, (N,) for a
Cloud, or `Selected`, such a mask with a note. To add one: a file, a line in SEGMENTERS, its name in `SegmentConfig.method`; or
a plug-in (entry points "doo3d.segmenters"), whose name `SegmentConfig.method` takes as it is.
"""

from __future__ import annotations

from collections.abc import Callable

from ... import plugins
from ...config import SegmentConfig
from ...plugins import Registry
from ...types import Bools, Cloud, Frame, Image
from . import auto, background, everything, hsv, network, onnx, plane, ridge, strands
from .selected import Selected

Segmenter = Callable[[Frame | Cloud | Image, SegmentConfig, int], Bools | Selected]

SEGMENTERS: Registry[Segmenter] = Registry(
    plugins.SEGMENTERS,
    {
        "hsv": hsv.mask,
        "plane": plane.mask,
        "background": background.mask,
        "everything": everything.mask,
        "ridge": ridge.mask,
        "strands": strands.mask,
        "network": network.mask,
        "onnx": onnx.mask,
    },
)


def resolve_method(data: Frame | Cloud | Image, config: SegmentConfig) -> str:
    """Return the name of the segmentation method to use: `config.method`, or if that is "auto", the method that fits the data."""
    return auto.choose_method(data, config) if config.method == "auto" else config.method
