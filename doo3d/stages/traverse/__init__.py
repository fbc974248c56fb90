"""Turn the skeleton into ordered paths (paper, section III-C)."""

from .traversal import Traversal
from .traverse import traverse

__all__ = ["Traversal", "traverse"]
