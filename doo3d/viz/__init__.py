"""Pictures, videos and reports of detections."""

from __future__ import annotations

from .overlay import draw

__all__ = ["draw"]
