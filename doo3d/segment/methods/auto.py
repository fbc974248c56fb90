"""Choose the method that fits the config and the data."""

from __future__ import annotations

from ...config import SegmentConfig
from ...types import Cloud, Frame, Image
from ..broad_surface import is_broad
from .network import IS_PACKAGED


def choose_method(data: Frame | Cloud | Image, config: SegmentConfig) -> str:
    """Return the name of the segmentation method that fits the settings and the data.

    "hsv" if color ranges are set, "background" if a reference image is set. Otherwise "network" for an image and for a frame with
    color, "strands" if none is installed; without color "plane" for a scene of mostly wide surfaces such as a table, and
    "everything" for any other.
    """
    if config.ranges:
        return "hsv"
    if config.reference is not None:
        return "background"
    if not isinstance(data, Cloud) and data.color is not None:
        return "network" if IS_PACKAGED else "strands"
    return "plane" if is_broad(data, config) else "everything"
