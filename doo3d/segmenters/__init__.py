"""Ways of telling the object from the rest.

One file each with one function `mask(data, config, seed) -> bool array`: (H, W) for a Frame, (N,) for a Cloud.
To add one: a file, a line in SEGMENTERS, its name in `SegmentConfig.method`.
"""

from __future__ import annotations

from collections.abc import Callable

from ..config import SegmentConfig
from ..types import Bools, Cloud, Frame
from . import auto, background, everything, hsv, plane

Segmenter = Callable[[Frame | Cloud, SegmentConfig, int], Bools]

SEGMENTERS: dict[str, Segmenter] = {
    "hsv": hsv.mask,
    "plane": plane.mask,
    "background": background.mask,
    "everything": everything.mask,
    "auto": auto.mask,
}
