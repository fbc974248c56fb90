"""Depth in OpenEXR images, which OpenCV's wheels do not decode, read by the package OpenEXR."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import InputError, require
from ...guard.guarding import guarded
from ...types import Array

_OF_DEPTH = ("z", "depth", "v")  # last words of channels, best first: Blender's Depth.Z and Depth.V, others' Z and depth


def read_exr(path: Path) -> Array:
    """Return the depth in an EXR image as stored, (H, W) float32 or uint32.

    It is the only channel, one named Z, depth or V, or any of several that are equal, where depth is written as a gray picture.

    Raises
    ------
    InputError : the file is damaged, or has several channels of which none is depth.
    MissingDependency : the package OpenEXR is not installed.
    """
    openexr = require("OpenEXR", "exr")
    with guarded(path):
        channels = openexr.File(str(path), separate_channels=True).channels()
        images = {name: np.asarray(channel.pixels) for name, channel in channels.items()}
    last = {name.lower().rpartition(".")[2]: name for name in images}
    name = next((last[word] for word in _OF_DEPTH if word in last), None)
    if name is None and (first := next(iter(images), None)) is not None:
        equal = all(np.array_equal(image, images[first], equal_nan=True) for key, image in images.items() if key != "A")
        name = first if equal and first != "A" else None
    if name is None:
        sentence = f"{path}: has the channels {', '.join(images) or '(none)'}, expected one of depth, such as Z or depth"
        raise InputError(sentence, code="depth-shape")
    image = images[name]
    return image.astype(np.float32) if image.dtype.kind == "f" else image
