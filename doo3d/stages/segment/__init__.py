"""Keep what surely is the object (paper, section III-A)."""

from .segment import segment

__all__ = ["segment"]
