"""Segment the object: rather lose some of it than keep other things (Keipour et al., RA-L 2022, section III-A)."""

from .segment import segment, segment_extended
from .segmentation import Segmentation

__all__ = ["Segmentation", "segment", "segment_extended"]
