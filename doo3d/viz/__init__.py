"""Draw pictures, videos and reports of detections."""

from .overlay import draw

__all__ = ["draw"]
