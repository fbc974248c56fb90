"""Which chain ends belong together (paper, section III-F)."""

from .merge import merge

__all__ = ["merge"]
