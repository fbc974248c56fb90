"""Where strands cross in the view, and which of them is on top."""

from .crossings import find_crossings

__all__ = ["find_crossings"]
