"""Segment the object: rather lose part of the object than keep something else (Keipour et al., RA-L 2022, section III-A)."""

from .segment import segment, segment_extended
from .segmentation import Segmentation

__all__ = ["Segmentation", "segment", "segment_extended"]
