"""Segmentation methods.

Each file holds one method, a function `mask(data, config, seed)`. It returns the mask of the object, (H, W) bool for a Frame or
an Image and (N,) bool for a Cloud, or a `MethodResult` with that mask. To add a method, add a file, a line in SEGMENTERS, and its
name in `SegmentConfig.method`; or write a plug-in (entry points "doo3d.segmenters"), whose name `SegmentConfig.method` accepts.
"""

from collections.abc import Callable

from ... import plugins
from ...config import SegmentConfig
from ...plugins import Registry
from ...types import Bools, Cloud, Frame, Image
from . import auto, background, everything, hsv, network, onnx, plane, ridge, strands
from .result import MethodResult

Segmenter = Callable[[Frame | Cloud | Image, SegmentConfig, int], Bools | MethodResult]

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
    """Return the name of the segmentation method to use: `config.method`, or the method that fits the data if that is "auto"."""
    return auto.choose_method(data, config) if config.method == "auto" else config.method
