"""Turn the skeleton into ordered paths (Keipour et al., RA-L 2022, section III-C)."""

from .traversal import Traversal
from .traverse import traverse

__all__ = ["Traversal", "traverse"]
