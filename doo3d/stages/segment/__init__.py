"""Segment the object conservatively: rather lose some of it than keep other things (paper, section III-A)."""

from .segment import segment, segment_extended
from .segmentation import Segmentation

__all__ = ["Segmentation", "segment", "segment_extended"]
