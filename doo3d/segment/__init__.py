"""Segment the object: rather lose part of the object than keep something else (Keipour et al., RA-L 2022, section III-A)."""

from .mask_image import object_in_mask_image
from .methods.strands import IMAGE_PIXELS as NETWORK_PIXELS
from .segment import segment, segment_extended
from .segmentation import Segmentation

__all__ = ["NETWORK_PIXELS", "Segmentation", "object_in_mask_image", "segment", "segment_extended"]
