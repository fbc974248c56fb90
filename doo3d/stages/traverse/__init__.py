"""Turn the skeleton into ordered paths (Keipour et al., RA-L 2022, section III-C)."""

from .traverse import Traversal, traverse

__all__ = ["Traversal", "traverse"]
